from .base.errors import SceneError as SceneError
from .decide.explore.barred import barred_ranges as barred_ranges
from .decide.explore.export import export as export
from .decide.explore.firing_orders import firing_orders as firing_orders
from .decide.explore.firing_patterns import firing_patterns as firing_patterns
from .decide.explore.opening import nearest as nearest
from .decide.explore.opening import open as open
from .decide.explore.search import best as best
from .decide.explore.search import pareto as pareto
from .decide.explore.sensitivities import sensitivities as sensitivities
from .decide.optimise.optimise import optimise as optimise
from .lab.pressure.reading import read_pressure as read_pressure
from .lab.speed.calibration import calibrate as calibrate
from .lab.speed.cylinder_deviations import cylinder_deviations as cylinder_deviations
from .lab.speed.identification import identify as identify
from .lab.speed.measured import measured as measured
from .lab.speed.recorded_train import follow_cycles as follow_cycles
from .running.archive.netcdf import open_archive as open_archive
from .running.compute.computation import plan as plan
from .running.compute.in_memory import run as run
from .running.compute.streaming import stream as stream
from .scene.model import Scene as Scene
from .scene.plan.plan import Plan as Plan
from .scene.reading import read_scene as read_scene
from .scene.sample import sample as sample
from .view.report.page import report as report

__version__: str
