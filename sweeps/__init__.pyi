from .archive.netcdf import open_archive as open_archive
from .errors import SceneError as SceneError
from .exploring.export import export as export
from .exploring.firing_orders import firing_orders as firing_orders
from .exploring.firing_patterns import firing_patterns as firing_patterns
from .exploring.opening import open as open
from .exploring.samples import sample as sample
from .exploring.search import best as best
from .exploring.search import pareto as pareto
from .exploring.sensitivities import sensitivities as sensitivities
from .exploring.slices import nearest as nearest
from .measuring.calibration import calibrate as calibrate
from .measuring.cylinder_deviations import cylinder_deviations as cylinder_deviations
from .measuring.identification import identify as identify
from .measuring.measured import measured as measured
from .measuring.recorded_train import follow_cycles as follow_cycles
from .optimising.optimise import optimise as optimise
from .planning.plan import Plan as Plan
from .presenting.report.page import report as report
from .reading.pressure_recordings import read_pressure as read_pressure
from .running.in_memory import run as run
from .running.planned import plan as plan
from .running.streaming import stream as stream
from .scene.model import Scene as Scene
from .scene.reading import read_scene as read_scene

__version__: str
