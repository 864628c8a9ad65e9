"""The kinds of figures, in the order in which they are drawn.

A figure shows variables of an archive (`sweeps.figures.views.View`). Nothing here knows an engine
or computes physics: what is written beside a variable comes from its attributes (``long_name``,
``symbol``, ``units``).

Some kinds show certain variables together. All other variables are drawn by their dimensions:

=====================  ==========================================================================
a variable over        is drawn as
=====================  ==========================================================================
nothing                a row of the table ``summary``; so is what is the same in all designs
one axis               points joined by lines
two axes               a map with labelled contours; lines if an axis is short, or has words or
                       whole numbers such as those of cylinders
more axes              small multiples of these; the remaining axes are cut at one slice, which the
                       title states
``crank_angle``        curves, one line for each value of one axis
``order``              stems, side by side for the values of one axis
``design``             the list of designs is taken apart into families, see
                       `sweeps.figures.study.families_of`
=====================  ==========================================================================

An axis along which nothing changes is named in the note and not drawn: values that differ by less
than the solver's tolerance, or than ticks can show, are the same
(`sweeps.figures.views.View.idle`).

Designs without an answer (``status``) are hatched in maps and marked on the frame in curves, and
the legend names the outcome; they are never drawn as numbers.

To add a kind: write a function that takes a `Study` and the names of variables and yields figures
with the names of their files, in a file of its own, and add a row to `KINDS`.

matplotlib is imported inside functions, and always as `Figure` on the Agg canvas: pyplot keeps
figures alive and picks a backend for the whole process, which a library must not do.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from sweeps.dimensions import PUBLISHED
from sweeps.figures.arrangement import arrangements, described
from sweeps.figures.balance import shaking, vector_names
from sweeps.figures.bearing_loads import bearing_load_names, bearing_loads
from sweeps.figures.curves import curves
from sweeps.figures.cylinder_deviations import deviation_names, deviations
from sweeps.figures.fitted import fitted_names, fitted_speeds
from sweeps.figures.indicator import (
    recorded_names,
    recording_sheet,
    work_diagrams,
    work_names,
)
from sweeps.figures.load_curves import load_curve_names, load_curves
from sweeps.figures.measured import measured_names, measured_speeds
from sweeps.figures.numbers import numbers
from sweeps.figures.orders import orders
from sweeps.figures.outcomes import outcomes_map
from sweeps.figures.polar import polar_diagrams, polar_names
from sweeps.figures.published import published, published_names
from sweeps.figures.recorded_train import recorded_train, train_names
from sweeps.figures.sheet import NamedFigures
from sweeps.figures.stacked import KINEMATICS, PRESSURE, indicator_diagrams, kinematics
from sweeps.figures.study import Study
from sweeps.figures.together import grouped_names, groups
from sweeps.figures.torques import (
    component_names,
    cylinders,
    torque_and_speed,
    torque_and_speed_names,
    torque_components,
)
from sweeps.figures.traces import over_angle
from sweeps.figures.turning_moment import turning_moment, turning_names
from sweeps.figures.views import RUNNING, View

__all__ = ["KINDS", "Kind", "figures_of"]


@dataclass(frozen=True)
class Kind:
    """A kind of figure.

    Parameters
    ----------
    name : str
        One word for it.
    shows : str
        What is drawn, as one line for people.
    takes : callable
        Names of the variables of a view that it can draw; nothing is drawn where there are none.
    draw : callable
        Figures of a study, each with the name of its file, from the names that `takes` gave.
    shared : bool
        Whether its variables get figures of general kinds too.
    general : bool
        Whether it draws only variables that no other kind takes for itself.
    """

    name: str
    shows: str
    takes: Callable[[View], Sequence[str]]
    draw: Callable[[Study, Sequence[str]], NamedFigures]
    shared: bool = False
    general: bool = False


def _over_angle(*names: str) -> Callable[[View], list[str]]:
    """Take those of some variables that are curves over the crank angle."""
    return lambda view: [name for name in names if over_angle(view, name)]


def _running(dimension: str | None) -> Callable[[View], list[str]]:
    """Take variables that run along a dimension, or along none."""

    def takes(view: View) -> list[str]:
        names = [str(name) for name in view.data.data_vars if view.has(str(name))]
        along = {name: [d for d in RUNNING if d in view.array(name).dims] for name in names}
        return [name for name in names if next(iter(along[name]), None) == dimension]

    return takes


def _status(view: View) -> list[str]:
    return ["status"] if view.has("status") else []


KINDS = (
    Kind("arrangement", "crankshaft, banks and firing star", described, arrangements),
    Kind("kinematics", "travel, velocity and acceleration of the piston",
         _over_angle(*KINEMATICS), kinematics),
    Kind("indicator", "pressure over the crank angle, linear and logarithmic",
         _over_angle(*PRESSURE), indicator_diagrams),
    Kind("work", "pressure over the volume, linear and logarithmic", work_names, work_diagrams,
         shared=True),
    Kind("recording", "sheet of a recorded pressure: cycles, work diagrams, heat release, spread",
         recorded_names, recording_sheet),
    Kind("torque_components", "gas, inertia and friction torque with their sum",
         component_names, torque_components),
    Kind("torque_and_speed", "torque, load torque and speed of the nominal design",
         torque_and_speed_names, torque_and_speed, shared=True),
    Kind("turning_moment", "torque, load and their areas of excess, with the levels of energy",
         turning_names, turning_moment, shared=True),
    Kind("load_curves", "pressure, torque and speed over the crank angle, a line for each load",
         load_curve_names, load_curves, shared=True),
    Kind("cylinders", "torque and speed of engines with different numbers of cylinders",
         torque_and_speed_names, cylinders, shared=True),
    Kind("shaking", "shaking forces and moments over the crank angle, and their hodographs",
         vector_names, shaking),
    Kind("measured", "measured speed beside the computed one", measured_names, measured_speeds),
    Kind("fitted", "fit to measured speeds: curves, residuals, predictions, correlations",
         fitted_names, fitted_speeds),
    Kind("train", "recorded cycles in a row: followed, closed, repeated", train_names,
         recorded_train),
    Kind("deviations", "imep of single cylinders by the measured speed: missed cycles, weak ones",
         deviation_names, deviations),
    Kind("together", "forces of the mechanism in one panel", grouped_names, groups),
    Kind("polar", "loads of pins and journals as polar diagrams", polar_names, polar_diagrams),
    Kind("bearing_loads", "largest and mean loads of pins and journals over the speed",
         bearing_load_names, bearing_loads, shared=True),
    Kind("curves", "any other variable over the crank angle", _running("crank_angle"), curves,
         general=True),
    Kind("orders", "any other variable over the order", _running("order"), orders, general=True),
    Kind("numbers", "any other variable with a number for each design", _running(None), numbers,
         general=True),
    Kind("outcomes", "status of the designs over two axes", _status, outcomes_map),
    Kind("published", "computed against published values", published_names, published,
         shared=True),
)  # fmt: skip
"""Every kind of figure. This is the only list of them."""


def figures_of(study: Study) -> NamedFigures:
    """All figures of an archive with the names of their files; nothing for what is not there."""
    found = {kind.name: kind.takes(study.view) for kind in KINDS}
    special = [kind.name for kind in KINDS if not (kind.general or kind.shared)]
    taken = {name for kind in special for name in found[kind]}
    for kind in KINDS:
        names = found[kind.name]
        if kind.general:
            names = [n for n in names if n not in taken and not n.endswith(PUBLISHED)]
        if names:
            yield from kind.draw(study, names)
