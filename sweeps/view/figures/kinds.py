"""The kinds of figures, in the order in which they are drawn.

A figure shows variables of an archive (`sweeps.view.figures.views.View`). Nothing here knows an
engine or computes physics: what is written beside a variable comes from its attributes
(``long_name``, ``symbol``, ``units``).

Some kinds show certain variables together. All other variables are drawn by their dimensions:

=====================  ==========================================================================
a variable over        is drawn as
=====================  ==========================================================================
nothing                nothing; so is what is the same in all designs (``engine-dyn show``)
one axis               points joined by lines; points alone for words, cylinders, bearings and
                       directions
two axes               a map with labelled contours; lines if an axis is short, or has words or
                       whole numbers such as those of cylinders
more axes              small multiples of these; the remaining axes are cut at one slice, which the
                       title states
``crank_angle``        curves, one line for each value of one axis
``order``              bars, in front of each other or in panels for the values of one axis
``design``             the list of designs is taken apart into families, see
                       `sweeps.view.figures.study.families_of`; samples, and more than 45 designs
                       without families, are points over each parameter
=====================  ==========================================================================

An axis along which nothing changes is named in the note and not drawn: values that differ by less
than the solver's tolerance, or than ticks can show, are the same
(`sweeps.view.figures.views.View.idle`).

Designs without an answer (``status``) are hatched in maps and marked on the frame in curves, and
the legend names the outcome; they are never drawn as numbers.

To add a kind: write a function that takes a `Study` and the names of variables and yields figures
with the names of their files, in a file of its own, and add a row to `KINDS`. Lines over the crank
angle are panels of `angle_lines.angle_figure`, lines over a parameter those of
`parameter_lines.parameter_figure`. Any other figure begins by `sheet.multiples` and ends by its
`finish`: size, style, a foreign ``ax`` and the line about engine and speed are theirs. What else a
caller wants (target lines) stands in ``study.view.options``.

matplotlib is imported inside functions, and always as `Figure` on the Agg canvas: pyplot keeps
figures alive and picks a backend for the whole process, which a library must not do.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sweeps.base.dimensions import EXPLAINED, FAILED_DRAWS, PUBLISHED, SHARE, UNCERTAIN
from sweeps.view.figures import (
    angle_lines,
    arrangement,
    balance,
    bearing_loads,
    compared,
    crank_train,
    cycle_curves,
    distributions,
    firing_orders,
    indicator,
    maps,
    measured_speeds,
    numbers,
    orders,
    parameter_bars,
    parameter_lines,
    pareto,
    polar,
    recorded_cycles,
    shaft_modes,
    shaft_response,
    shaft_system,
    transient_run,
    turning_moment,
)
from sweeps.view.figures.sheet import NamedFigures
from sweeps.view.figures.study import Study
from sweeps.view.figures.views import RUNNING, View


@dataclass(frozen=True)
class Kind:
    """A kind of figure."""

    name: str  # Name for people and for `--only`: an identifier in small letters
    shows: str  # Content of the figure, in one line for people
    needs: str  # Data that an archive must have, as the end of "it needs ..."
    # Function that selects the variables that the kind draws; without any, it draws nothing
    takes: Callable[[View], Sequence[str]]
    # Function that draws the variables that `takes` selected: figures with the names of their files
    draw: Callable[[Study, Sequence[str]], NamedFigures]
    shared: bool = False  # Whether its variables get figures of general kinds too
    general: bool = False  # Whether it draws only variables that no other kind takes for itself
    own_angle: bool = False  # Whether it has an abscissa of its own, without options of the angle


def _over_angle(*names: str) -> Callable[[View], list[str]]:
    """Function that selects those of some variables that are curves over the crank angle."""
    return lambda view: [name for name in names if angle_lines.over_angle(view, name)]


def _all_of(*names: str) -> Callable[[View], list[str]]:
    """Function that selects all variables of an archive with some of them; otherwise none."""

    def takes(view: View) -> list[str]:
        return [str(name) for name in view.data.data_vars] if all(map(view.has, names)) else []

    return takes


def _described(usable: Callable[[Mapping[str, Any]], bool]) -> Callable[[View], list[str]]:
    """Function that selects the attribute with arrangements, if one of them can be drawn."""
    return lambda view: ["arrangement"] if arrangement.arrangements_of(view, usable) else []


def _running(dimension: str | None) -> Callable[[View], list[str]]:
    """Function that selects variables that run along a dimension, or along none."""

    def takes(view: View) -> list[str]:
        names = [str(name) for name in view.data.data_vars if view.has(str(name))]
        along = {name: [d for d in RUNNING if d in view.array(name).dims] for name in names}
        return [name for name in names if next(iter(along[name]), None) == dimension]

    return takes


KINDS = (
    Kind("arrangement", "crankshaft, banks and firing star", "two cylinders or more",
         _described(arrangement.has_banks), arrangement.arrangements),
    Kind("crank_star", "side view of the crankshaft and star of its throws",
         "two cylinders or more", _described(arrangement.has_throws), arrangement.crank_stars),
    Kind("strokes", "strokes of all cylinders over the crank angle, in firing order",
         "two cylinders or more", _described(arrangement.has_strokes), arrangement.strokes),
    Kind("kinematics", "travel, velocity and acceleration of the piston, angle of the rod",
         "position, velocity, acceleration or rod_angle",
         _over_angle("position", "velocity", "acceleration", "rod_angle"), cycle_curves.kinematics),
    Kind("indicator_diagrams", "pressure over the crank angle, linear and logarithmic", "pressure",
         _over_angle("pressure"), cycle_curves.indicator_diagrams),
    Kind("work_diagrams", "pressure over the volume, linear and logarithmic",
         "pressure, and cylinder_volume or position", indicator.work_names, indicator.work_diagrams,
         shared=True),
    Kind("recorded_pressure",
         "recorded pressure on one page: cycles, work diagrams, heat release, spread",
         "an evaluated recording (engine-dyn import)", indicator.recorded_names,
         indicator.recording_sheet, own_angle=True),
    Kind("torque_components", "gas, inertia and friction torque with their sum",
         "gas_torque, inertia_torque or friction_torque over the crank angle",
         cycle_curves.component_names, cycle_curves.torque_components),
    Kind("torque_and_speed", "torque, load torque and speed of the nominal design",
         "torque and omega", cycle_curves.torque_and_speed_names, cycle_curves.torque_and_speed,
         shared=True),
    Kind("turning_moment",
         "turning-moment diagram: torque, load, areas of excess and deficit, energy levels",
         "torque over the crank angle", turning_moment.turning_names, turning_moment.turning_moment,
         shared=True),
    Kind("load_curves", "pressure, torque and speed over the crank angle, a line for each load",
         "two of pressure, torque and omega over the crank angle", cycle_curves.load_curve_names,
         cycle_curves.load_curves, shared=True),
    Kind("cylinders", "torque and speed of engines with different numbers of cylinders",
         "torque and omega over the axis cylinders", cycle_curves.cylinders_names,
         cycle_curves.cylinders, shared=True),
    Kind("shaking", "shaking forces and moments over the crank angle, and their hodographs",
         "shaking_force or shaking_moment", balance.vector_names, balance.shaking),
    Kind("measured_speed", "measured speed beside the computed one",
         "a comparison with a recording (engine-dyn measured)",
         _all_of("omega_measured", "omega_through_wheel"), measured_speeds.measured_speeds,
         own_angle=True),
    Kind("torsiogram", "measured and computed amplitude of a disc by order over the speed",
         "a comparison of a disc with a recording (engine-dyn measured)",
         _all_of(*measured_speeds.DISC_ORDERS), measured_speeds.torsiogram, own_angle=True),
    Kind("fitted_speed", "fit to measured speeds: curves, residuals, predictions, correlations",
         "a fit (engine-dyn identify)", _all_of("omega_through_wheel", "residual", "value"),
         measured_speeds.fitted_speeds, own_angle=True),
    Kind("recorded_train",
         "train of recorded cycles: in sequence, train repeated, each cycle repeated",
         "a train of recorded cycles (engine-dyn train)", _all_of("omega_followed", "omega_closed"),
         recorded_cycles.recorded_train, own_angle=True),
    Kind("cylinder_deviations",
         "imep deviation of each cylinder from the measured speed: misfires, weak cylinders",
         "deviations of single cylinders (engine-dyn cylinders)",
         _all_of("imep_deviation_of_cycle", "missed_threshold"), recorded_cycles.deviations,
         own_angle=True),
    Kind("firing_orders", "firing orders side by side, by every criterion",
         "ranked firing orders (engine-dyn firing-orders)", firing_orders.order_names,
         firing_orders.firing_orders),
    Kind("mechanism_forces", "forces of the crank mechanism in one panel",
         "two forces of the piston or the mechanism", cycle_curves.grouped_names,
         cycle_curves.groups),
    Kind("crank_train", "crank train with its forces to scale at one crank angle",
         "tangential_force and two more of gas_force, inertia_force, rod_force, wall_thrust and "
         "radial_force over the crank angle; with offsets also rod_angle",
         crank_train.train_force_names, crank_train.crank_train, shared=True),
    Kind("bearing_polar", "loads of pins and journals as polar diagrams",
         "both components of a load over the crank angle", polar.polar_names, polar.polar_diagrams),
    Kind("bearing_loads", "largest and mean loads of pins and journals over the speed",
         "two loads of pins or journals along an axis speed", bearing_loads.bearing_load_names,
         bearing_loads.bearing_loads, shared=True),
    Kind("bearing_pressures",
         "largest and mean pressures of pins and journals over their projected area",
         "two pressures of pins or journals along an axis speed",
         bearing_loads.bearing_pressure_names, bearing_loads.bearing_pressures, shared=True),
    Kind("friction_components",
         "friction of rings, skirts, bearings, valve train and auxiliaries, stacked",
         "three components of the friction, such as fmep_rings", parameter_bars.friction_names,
         parameter_bars.friction_components),
    Kind("mass_elastic", "discs and shafts of the shaft, drawn to scale",
         "system_inertia, system_stiffness and system_speed_ratio", shaft_system.system_names,
         shaft_system.mass_elastic),
    Kind("phase_vectors", "firing diagram: phase vectors of the strongest orders in their modes",
         "mode_shape and mode_vector_sum of two cylinders or more",
         shaft_system.phase_vector_names, shaft_system.phase_vectors, shared=True),
    Kind("mode_shapes", "mode shapes of the shaft, with nodes", "mode_shape",
         shaft_modes.mode_shape_names, shaft_modes.mode_shapes),
    Kind("campbell", "natural frequencies and orders over the speed, with their crossings",
         "natural_frequency or damped_natural_frequency, an order such as mode_vector_sum, and an "
         "axis speed", shaft_modes.campbell_names, shaft_modes.campbell),
    Kind("shaft_orders", "strongest orders of torque and angle of the shaft over the speed",
         "shaft_torque_order or disc_angle_order along an axis speed",
         shaft_response.shaft_order_names, shaft_response.shaft_orders),
    Kind("shaft_loads", "torque, stress, twist, angle and power lost over the speed, with limits",
         "a half range or shaft_loss along an axis speed", shaft_response.shaft_load_names,
         shaft_response.shaft_loads),
    Kind("shaft_cycle", "torque and angle of the shaft over the cycle, as sums of orders",
         "order and phase of shaft_torque or disc_angle", shaft_response.shaft_cycle_names,
         shaft_response.shaft_cycles),
    Kind("transient_run",
         "speed over the time that does not repeat, with what each change of load is judged by, "
         "fuel command and load",
         "run_speed over run_time, or transient_mean_speed over transient_time",
         transient_run.run_names, transient_run.transient_run, shared=True, own_angle=True),
    Kind("transient_phase", "speed over two turns of recorded cycles, the first to the last",
         "run_speed and run_angle", transient_run.phase_names, transient_run.transient_phase,
         shared=True, own_angle=True),
    Kind("curves", "any other variable over the crank angle",
         "a variable over the crank angle that no other kind draws", _running("crank_angle"),
         cycle_curves.curves, general=True),
    Kind("orders", "any other variable over the order",
         "a variable over the order, such as torque_order", _running("order"), orders.orders,
         general=True),
    Kind("order_map", "amplitudes over order and speed, in colours on a logarithmic scale",
         "amplitudes over order and three speeds or more", orders.order_map_names,
         orders.order_maps, shared=True),
    Kind("numbers", "any other variable with a number for each design",
         "a number that differs between designs and repeats no axis", _running(None),
         numbers.numbers, general=True),
    Kind("pareto", "all designs over two objectives, with the Pareto front",
         "ten designs or more at one speed and load, and two conflicting objectives, such as "
         "inertia and delta; quantities= names any two in Python", pareto.pareto_names,
         pareto.paretos, shared=True),
    Kind("tornado", "elasticities: how much each parameter changes a result",
         "an elasticity, such as delta_elasticity", parameter_bars.tornado_names,
         parameter_bars.tornados),
    Kind("sensitivities", "Sobol' indices: share of each parameter in the variance of a result",
         "Sobol' indices (engine-dyn sensitivities)", parameter_bars.index_names,
         parameter_bars.sensitivities, own_angle=True),
    Kind("uncertainty", "share of each uncertain value in the variance of a result",
         "results with bands (engine-dyn run --uncertainty)", parameter_bars.share_names,
         parameter_bars.uncertain_values),
    Kind("distributions", "histogram of a quantity over all designs, with mean and quantiles",
         "statistics of [reduce]", distributions.distribution_names, distributions.distributions),
    Kind("outcomes", "status of the designs over two axes", "two axes, and designs that failed",
         maps.outcome_names, maps.outcomes_map),
    Kind("compared", "two archives in one chart, and their difference in percent",
         "a second archive (engine-dyn compare --figures)", compared.compared_names,
         compared.compared),
    Kind("published", "computed against published values", "a scene's [reference]",
         compared.published_names, compared.published, shared=True),
)  # fmt: skip
"""Every kind of figure. This is the only list of kinds."""


def uncertainty_names(view: View) -> set[str]:
    """Variables of `run --uncertainty`; the figures of their quantities show them."""
    of_bands = {
        end for name in view.data.data_vars for end in parameter_lines.band_names(str(name))
    }
    uncertain = {str(n) for n, v in view.data.data_vars.items() if UNCERTAIN in v.dims}
    uncertain |= {name.removesuffix(SHARE) + EXPLAINED for name in uncertain}
    return uncertain | of_bands | {FAILED_DRAWS} if uncertain else set()


def figures_of(study: Study, only: Sequence[str] = ()) -> NamedFigures:
    """All figures of a study, or those of some kinds, with the names of their files."""
    for kind, names in taken_by_kinds(study):
        if names and (not only or kind.name in only):
            yield from kind.draw(study.with_own_angle() if kind.own_angle else study, names)


def taken_by_kinds(study: Study) -> list[tuple[Kind, list[str]]]:
    """Every kind with the variables that it draws of an archive; none where it has nothing."""
    names_of = {kind.name: list(kind.takes(study.view)) for kind in KINDS}
    special = [kind.name for kind in KINDS if not (kind.general or kind.shared)]
    taken = {name for kind in special for name in names_of[kind]}
    statistics = uncertainty_names(study.view) | distributions.statistics_names(study.view)
    chosen = study.view.options.quantities
    for kind in KINDS:
        if kind.general:
            names_of[kind.name] = [
                name
                for name in names_of[kind.name]
                if not name.endswith(PUBLISHED)
                and name != "status"
                # A variable with these flags is a verdict, whose numbers stand for words.
                and "flag_meanings" not in study.view.array(name).attrs
                and name not in statistics
                and (name in chosen if chosen else name not in taken)
                and (kind.draw is not numbers.numbers or numbers.says_something(study.view, name))
            ]
        elif chosen:
            names_of[kind.name] = [name for name in names_of[kind.name] if name in chosen]
    return [(kind, names_of[kind.name]) for kind in KINDS]
