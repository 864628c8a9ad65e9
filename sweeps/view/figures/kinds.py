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
                       `sweeps.view.figures.study.families_of`
=====================  ==========================================================================

An axis along which nothing changes is named in the note and not drawn: values that differ by less
than the solver's tolerance, or than ticks can show, are the same
(`sweeps.view.figures.views.View.idle`).

Designs without an answer (``status``) are hatched in maps and marked on the frame in curves, and
the legend names the outcome; they are never drawn as numbers.

To add a kind: write a function that takes a `Study` and the names of variables and yields figures
with the names of their files, in a file of its own, and add a row to `KINDS`. It begins a figure by
`sweeps.view.figures.sheet.multiples` and ends it by `finish`: size, style, a foreign ``ax`` and
the line about engine and speed are theirs. What else a caller wants (target lines) stands in
``study.view.options``.

matplotlib is imported inside functions, and always as `Figure` on the Agg canvas: pyplot keeps
figures alive and picks a backend for the whole process, which a library must not do.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sweeps.base.dimensions import EXPLAINED, FAILED_DRAWS, PUBLISHED, SHARE, UNCERTAIN
from sweeps.view.figures.angle_lines import over_angle
from sweeps.view.figures.arrangement import (
    arrangements,
    arrangements_of,
    crank_stars,
    has_banks,
    has_strokes,
    has_throws,
    strokes,
)
from sweeps.view.figures.balance import shaking, vector_names
from sweeps.view.figures.bearing_loads import (
    bearing_load_names,
    bearing_loads,
    bearing_pressure_names,
    bearing_pressures,
)
from sweeps.view.figures.compared import compared, compared_names
from sweeps.view.figures.crank_train import crank_train, train_force_names
from sweeps.view.figures.cycle_curves import (
    KINEMATICS,
    PRESSURES,
    component_names,
    curves,
    cylinders,
    cylinders_names,
    grouped_names,
    groups,
    indicator_diagrams,
    kinematics,
    load_curve_names,
    load_curves,
    torque_and_speed,
    torque_and_speed_names,
    torque_components,
)
from sweeps.view.figures.distributions import (
    distribution_names,
    distributions,
    statistics_names,
)
from sweeps.view.figures.firing_orders import firing_orders, order_names
from sweeps.view.figures.indicator import recorded_names, recording_sheet, work_diagrams, work_names
from sweeps.view.figures.maps import outcome_names, outcomes_map
from sweeps.view.figures.measured_speeds import fitted_speeds, measured_speeds
from sweeps.view.figures.numbers import numbers, says_something
from sweeps.view.figures.orders import orders, waterfall_names, waterfalls
from sweeps.view.figures.parameter_bars import (
    friction_components,
    friction_names,
    index_names,
    sensitivities,
    share_names,
    tornado_names,
    tornados,
    uncertain_values,
)
from sweeps.view.figures.parameter_lines import band_names
from sweeps.view.figures.pareto import pareto_names, paretos
from sweeps.view.figures.polar import polar_diagrams, polar_names
from sweeps.view.figures.published import published, published_names
from sweeps.view.figures.recorded_cycles import deviations, recorded_train
from sweeps.view.figures.shaft_modes import campbell, campbell_names, mode_shape_names, mode_shapes
from sweeps.view.figures.shaft_response import (
    shaft_cycle_names,
    shaft_cycles,
    shaft_load_names,
    shaft_loads,
    shaft_order_names,
    shaft_orders,
)
from sweeps.view.figures.sheet import NamedFigures
from sweeps.view.figures.study import Study
from sweeps.view.figures.turning_moment import turning_moment, turning_names
from sweeps.view.figures.views import RUNNING, View

__all__ = ["KINDS", "Kind", "figures_of"]


@dataclass(frozen=True)
class Kind:
    """A kind of figure.

    Parameters
    ----------
    name : str
        Its name for people and for ``--only``: an identifier in small letters.
    shows : str
        What is drawn, as one line for people.
    needs : str
        What an archive must have for it, as the end of a sentence: "it needs ...".
    takes : callable
        Names of the variables of a view that it can draw; nothing is drawn where there are none.
    draw : callable
        Figures of a study, each with the name of its file, from the names that `takes` gave. The
        first one is what `sweeps.view.figures.drawing.figure` returns.
    shared : bool
        Whether its variables get figures of general kinds too.
    general : bool
        Whether it draws only variables that no other kind takes for itself.
    own_angle : bool
        Whether it has an abscissa of its own: the options about the crank angle do not hold.
    """

    name: str
    shows: str
    needs: str
    takes: Callable[[View], Sequence[str]]
    draw: Callable[[Study, Sequence[str]], NamedFigures]
    shared: bool = False
    general: bool = False
    own_angle: bool = False


def _over_angle(*names: str) -> Callable[[View], list[str]]:
    """Take those of some variables that are curves over the crank angle."""
    return lambda view: [name for name in names if over_angle(view, name)]


def _all_of(*names: str) -> Callable[[View], list[str]]:
    """Take all variables of an archive that has these; none of others."""

    def takes(view: View) -> list[str]:
        return [str(name) for name in view.data.data_vars] if all(map(view.has, names)) else []

    return takes


def _described(usable: Callable[[Mapping[str, Any]], bool]) -> Callable[[View], list[str]]:
    """Take the attribute that describes arrangements, where one of them can be drawn."""
    return lambda view: ["arrangement"] if arrangements_of(view, usable) else []


def _running(dimension: str | None) -> Callable[[View], list[str]]:
    """Take variables that run along a dimension, or along none."""

    def takes(view: View) -> list[str]:
        names = [str(name) for name in view.data.data_vars if view.has(str(name))]
        along = {name: [d for d in RUNNING if d in view.array(name).dims] for name in names}
        return [name for name in names if next(iter(along[name]), None) == dimension]

    return takes


KINDS = (
    Kind("arrangement", "crankshaft, banks and firing star",
         "two cylinders or more", _described(has_banks), arrangements),
    Kind("crank_star", "side view of the crankshaft and star of its throws",
         "two cylinders or more", _described(has_throws), crank_stars),
    Kind("strokes", "strokes of all cylinders over the crank angle, in firing order",
         "two cylinders or more", _described(has_strokes), strokes),
    Kind("kinematics", "travel, velocity and acceleration of the piston, angle of the rod",
         "position, velocity, acceleration or rod_angle", _over_angle(*KINEMATICS), kinematics),
    Kind("indicator_diagrams", "pressure over the crank angle, linear and logarithmic",
         "pressure", _over_angle(*PRESSURES), indicator_diagrams),
    Kind("work_diagrams", "pressure over the volume, linear and logarithmic",
         "pressure, and cylinder_volume or position", work_names, work_diagrams, shared=True),
    Kind("recorded_pressure",
         "recorded pressure on one page: cycles, work diagrams, heat release, spread",
         "an evaluated recording (engine-dyn import)", recorded_names, recording_sheet,
         own_angle=True),
    Kind("torque_components", "gas, inertia and friction torque with their sum",
         "gas_torque, inertia_torque or friction_torque over the crank angle",
         component_names, torque_components),
    Kind("torque_and_speed", "torque, load torque and speed of the nominal design",
         "torque and omega", torque_and_speed_names, torque_and_speed, shared=True),
    Kind("turning_moment",
         "turning-moment diagram: torque, load, areas of excess and deficit, energy levels",
         "torque over the crank angle", turning_names, turning_moment, shared=True),
    Kind("load_curves", "pressure, torque and speed over the crank angle, a line for each load",
         "two of pressure, torque and omega over the crank angle", load_curve_names, load_curves,
         shared=True),
    Kind("cylinders", "torque and speed of engines with different numbers of cylinders",
         "torque and omega over the axis cylinders", cylinders_names, cylinders, shared=True),
    Kind("shaking", "shaking forces and moments over the crank angle, and their hodographs",
         "shaking_force or shaking_moment", vector_names, shaking),
    Kind("measured_speed", "measured speed beside the computed one",
         "a comparison with a recording (engine-dyn measured)",
         _all_of("omega_measured", "omega_through_wheel"), measured_speeds, own_angle=True),
    Kind("fitted_speed", "fit to measured speeds: curves, residuals, predictions, correlations",
         "a fit (engine-dyn identify)", _all_of("omega_through_wheel", "residual", "value"),
         fitted_speeds, own_angle=True),
    Kind("recorded_train",
         "train of recorded cycles: in sequence, train repeated, each cycle repeated",
         "a train of recorded cycles (engine-dyn train)", _all_of("omega_followed", "omega_closed"),
         recorded_train, own_angle=True),
    Kind("cylinder_deviations",
         "imep deviation of each cylinder from the measured speed: misfires, weak cylinders",
         "deviations of single cylinders (engine-dyn cylinders)",
         _all_of("imep_deviation_of_cycle", "missed_threshold"), deviations, own_angle=True),
    Kind("firing_orders", "firing orders side by side, by every criterion",
         "ranked firing orders (engine-dyn firing-orders)", order_names, firing_orders),
    Kind("mechanism_forces", "forces of the crank mechanism in one panel",
         "two forces of the piston or the mechanism", grouped_names, groups),
    Kind("crank_train", "crank train with its forces to scale at one crank angle",
         "tangential_force and two more of gas_force, inertia_force, rod_force, wall_thrust and "
         "radial_force over the crank angle; with offsets also rod_angle",
         train_force_names, crank_train, shared=True),
    Kind("bearing_polar", "loads of pins and journals as polar diagrams",
         "both components of a load over the crank angle", polar_names, polar_diagrams),
    Kind("bearing_loads", "largest and mean loads of pins and journals over the speed",
         "two loads of pins or journals along an axis speed", bearing_load_names, bearing_loads,
         shared=True),
    Kind("bearing_pressures",
         "largest and mean pressures of pins and journals over their projected area",
         "two pressures of pins or journals along an axis speed", bearing_pressure_names,
         bearing_pressures, shared=True),
    Kind("friction_components",
         "friction of rings, skirts, bearings, valve train and auxiliaries, stacked",
         "three components of the friction, such as fmep_rings", friction_names,
         friction_components),
    Kind("mode_shapes", "mode shapes of the shaft, with nodes", "mode_shape", mode_shape_names,
         mode_shapes),
    Kind("campbell", "natural frequencies and orders over the speed, with their crossings",
         "natural_frequency or damped_natural_frequency, an order such as mode_vector_sum, and an "
         "axis speed",
         campbell_names, campbell),
    Kind("shaft_orders", "strongest orders of torque and angle of the shaft over the speed",
         "shaft_torque_order or disc_angle_order along an axis speed",
         shaft_order_names, shaft_orders),
    Kind("shaft_loads", "torque, stress, twist, angle and power lost over the speed, with limits",
         "a half range or shaft_loss along an axis speed", shaft_load_names, shaft_loads),
    Kind("shaft_cycle", "torque and angle of the shaft over the cycle, as sums of orders",
         "order and phase of shaft_torque or disc_angle", shaft_cycle_names, shaft_cycles),
    Kind("curves", "any other variable over the crank angle",
         "a variable over the crank angle that no other kind draws", _running("crank_angle"),
         curves, general=True),
    Kind("orders", "any other variable over the order",
         "a variable over the order, such as torque_order", _running("order"), orders,
         general=True),
    Kind("waterfall", "amplitudes over order and speed, a row of stems for each speed",
         "amplitudes over order and three speeds or more", waterfall_names, waterfalls,
         shared=True),
    Kind("numbers", "any other variable with a number for each design",
         "a number that differs between designs and repeats no axis",
         _running(None), numbers, general=True),
    Kind("pareto", "all designs over two objectives, with the Pareto front",
         "ten designs or more at one speed and load, and two conflicting objectives, such as "
         "inertia and delta; quantities= names any two in Python",
         pareto_names, paretos, shared=True),
    Kind("tornado", "elasticities: how much each parameter changes a result",
         "an elasticity, such as delta_elasticity", tornado_names, tornados),
    Kind("sensitivities", "Sobol' indices: share of each parameter in the variance of a result",
         "Sobol' indices (engine-dyn sensitivities)", index_names, sensitivities, own_angle=True),
    Kind("uncertainty", "share of each uncertain value in the variance of a result",
         "results with bands (engine-dyn run --uncertainty)", share_names, uncertain_values),
    Kind("distributions", "histogram of a quantity over all designs, with mean and quantiles",
         "statistics of [reduce]", distribution_names, distributions),
    Kind("outcomes", "status of the designs over two axes",
         "two axes, and designs that failed", outcome_names, outcomes_map),
    Kind("compared", "two archives in one chart, and their difference in percent",
         "a second archive (engine-dyn compare --figures)", compared_names, compared),
    Kind("published", "computed against published values", "a scene's [reference]",
         published_names, published, shared=True),
)  # fmt: skip
"""Every kind of figure. This is the only list of them."""


def uncertainty_names(view: View) -> set[str]:
    """Variables of `run --uncertainty`, which are drawn beside their quantities."""
    of_bands = {end for name in view.data.data_vars for end in band_names(str(name))}
    found = {str(n) for n, v in view.data.data_vars.items() if UNCERTAIN in v.dims}
    found |= {name.removesuffix(SHARE) + EXPLAINED for name in found}
    return found | of_bands | {FAILED_DRAWS} if found else set()


def figures_of(study: Study, only: Sequence[str] = ()) -> NamedFigures:
    """All figures of an archive with the names of their files; nothing for what is not there.

    Parameters
    ----------
    study : Study
        From `sweeps.view.figures.study.study_of`.
    only : sequence of str
        Names of the kinds to draw; all of them if empty.
    """
    for kind, names in taken_by_kinds(study):
        if names and (not only or kind.name in only):
            yield from kind.draw(study.unturned() if kind.own_angle else study, names)


def taken_by_kinds(study: Study) -> list[tuple[Kind, list[str]]]:
    """Every kind with the variables that it draws of an archive; none where it has nothing."""
    found = {kind.name: list(kind.takes(study.view)) for kind in KINDS}
    special = [kind.name for kind in KINDS if not (kind.general or kind.shared)]
    taken = {name for kind in special for name in found[kind]}
    beside = uncertainty_names(study.view) | statistics_names(study.view)
    chosen = study.view.options.quantities
    for kind in KINDS:
        if kind.general:
            found[kind.name] = [
                name
                for name in found[kind.name]
                if not name.endswith(PUBLISHED)
                and name != "status"
                and "flag_meanings" not in study.view.array(name).attrs  # a verdict is a word
                and name not in beside
                and (name in chosen if chosen else name not in taken)
                and (kind.draw is not numbers or says_something(study.view, name))
            ]
        elif chosen:
            found[kind.name] = [name for name in found[kind.name] if name in chosen]
    return [(kind, found[kind.name]) for kind in KINDS]
