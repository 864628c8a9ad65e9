"""Axes of an archive that figures draw along, and slices across the others."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from engine_dyn import status as outcome
from engine_dyn.types import Floats
from sweeps.base.dimensions import (
    COUNTED,
    DESIGN,
    NOT_CHOSEN,
    PERIODIC_STATUS,
    PUBLISHED,
    STATUS,
    WORD_AXES,
)
from sweeps.base.numbers import digits_of
from sweeps.view.figures.options import Options
from sweeps.view.figures.wording import (
    LEAST_SPAN,
    axis_label,
    name_of,
    plain_text,
    sentence,
    shorten,
    slug,
    title_of,
    typeset,
    unit_in_brackets,
    value_text,
)

MOST_LINES = 8  # Largest number of lines of one panel: more cannot be told apart without colour

MOST_PANELS = 9  # Largest number of panels of one figure

MOST_SLICES = 4  # Largest number of figures of one kind, each at another value of an axis

MOST_ROWS = 45  # Largest number of rows of a chart with a row for each case

MISFIRE = "misfire"  # Axis of the cylinder that does not burn; its value 0 means normal running

RUNNING = ("crank_angle", "order", "crossing", "run_point", "run_cycle")
"""Dimensions that curves run along; all others are axes of the study."""

SOUND = (
    outcome.CONVERGED,
    outcome.PASSES_DONE,
    outcome.FOLLOWED,
)  # Outcomes whose numbers are reliable

FROM_SPEED = ("delta", "omega", "load_torque", "load_coefficient", "angular_acc", "inertia_torque_")
"""Beginnings of the names of variables that come from the solution of the speed."""

LIMITED = ("_over_limit", "_over_stop")
"""Endings of the names of ratios that are 1 where the limit is reached."""

NO_VALUE = "no value"  # Words for a number that is missing though its design did not fail

# Largest number of values of a variable that are read to see whether an axis changes it
MOST_READ = 4_000_000


@dataclass(frozen=True)
class StudyAxis:
    """One dimension of an archive: its numbers or words, and how they are written."""

    name: str
    values: Floats
    words: tuple[str, ...]  # Names of the values; empty for numbers
    label: str
    variable: xr.Variable
    log: bool
    remarks: tuple[str, ...] = ()  # For each value, parameters that change along with it
    nominal: int | None = None

    @property
    def size(self) -> int:
        """Number of values."""
        return int(self.values.size)

    def __bool__(self) -> bool:
        """Whether it is an axis, and not `NO_AXIS`."""
        return bool(self.name)

    @property
    def called(self) -> str:
        """Name of the axis in the middle of a sentence."""
        return dimension_text(self.name)

    @property
    def plural(self) -> str:
        """Its values, after their number."""
        return "cases" if self.name == "design" else f"values of {self.called}"

    def picked(self, most: int = MOST_LINES) -> list[int]:
        """Indices of the values that are drawn."""
        return pick(self.size, most, self.nominal)

    def picked_text(self, most: int = MOST_LINES) -> str:
        """Say how many values are drawn where they are not all."""
        if self.size <= most:
            return ""
        return f"{len(self.picked(most))} of {self.size} {self.plural} shown"

    def place(self, index: int) -> dict[str, int]:
        """The index of a value by the name of the axis."""
        return {self.name: index} if self else {}

    def by(self, title: str) -> str:
        """A title, and along which axis it is."""
        return f"{title} by {self.called}" if self else title

    def text(self, index: int) -> str:
        """The value alone, for a legend that has the label as its title."""
        text = self.words[index] if self.words else typeset(self.values[index], self.digits)
        if self.remarks and self.remarks[index]:
            text += f", {self.remarks[index]}"
        return text

    def plain(self, index: int) -> str:
        """The value alone, without typesetting, for names of files."""
        return self.words[index] if self.words else f"{self.values[index]:.6g}"

    @property
    def joined(self) -> bool:
        """Whether there is something between its values, so that a line may run there."""
        others = (DESIGN, "cylinders", "direction", "valve_train", "mode", MISFIRE)
        return not self.words and self.name not in (*COUNTED, *others)

    def mark(self, index: int) -> str:
        """Words after the value of the nominal design; nothing after others."""
        return " (nominal)" if index == self.nominal else ""

    def tag(self, index: int) -> str:
        """Name and value, for titles."""
        if self.name == MISFIRE and self.words:
            word = self.words[index]
            return "no misfire" if word == "none" else f"misfire of cylinder {word}"
        if self.words:
            axis = WORD_AXES.get(self.name)
            return ("" if axis is None else axis.title) + self.words[index]
        return value_text(self.variable, self.name, float(self.values[index]), self.digits)

    def heading(self, place: Mapping[str, int]) -> str:
        """Title of a panel at a place along the axis."""
        index = place.get(self.name, 0)
        return self.tag(index) + self.mark(index)

    @cached_property
    def digits(self) -> int:
        """Digits that tell its values apart."""
        return digits_of(self.values)


def is_words(variable: xr.Variable) -> bool:
    """Whether a variable holds texts."""
    return variable.dtype.kind in "OUS"


def _strings(variable: xr.Variable) -> list[str]:
    values = np.atleast_1d(variable.values)
    return [shorten(v.decode() if isinstance(v, bytes) else str(v)) for v in values]


def is_log(values: Floats) -> bool:
    """Whether values are spaced by ratio rather than by difference, over a wide range."""
    if values.size < 3 or not np.all(values > 0):
        return False
    values = np.sort(values)
    steps, ratios = np.diff(values), np.diff(np.log(values))
    if values[-1] < 8 * values[0] or np.any(steps == 0):
        return False
    return bool(np.std(ratios) / np.mean(ratios) < 0.8 * np.std(steps) / np.mean(steps))


def pick(size: int, most: int, keep: int | None = None) -> list[int]:
    """At most `most` indices, evenly over all, with `keep` among them."""
    if size <= most:
        return list(range(size))
    chosen = np.unique(np.round(np.linspace(0, size - 1, most)).astype(int))
    if keep is not None and keep not in chosen:
        chosen[1 + np.argmin(np.abs(chosen[1:-1] - keep))] = keep
    return sorted(int(index) for index in chosen)


NO_AXIS = StudyAxis("", np.zeros(1), ("",), "", xr.Variable((), 0.0), False)
"""Axis of one place without a name, for figures that are not drawn along an axis."""


@dataclass(frozen=True)
class View:
    """A Dataset whose dimensions are axes to draw along, with what has been cut away.

    `fixed` holds the slices by their former dimension, `had` the former dimensions of each
    variable, so that a title names only slices that matter to what it shows.
    """

    data: xr.Dataset
    fixed: Mapping[str, str] = field(default_factory=dict)
    had: Mapping[str, frozenset[str]] = field(default_factory=dict)
    nominal: Mapping[str, int] = field(default_factory=dict)
    remarks: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    suffix: str = ""
    others: tuple[str, ...] = ()  # Parameters with one value in the whole view
    tolerance: float = 0.0  # Relative tolerance of the solver
    own: Mapping[str, float] = field(default_factory=dict)  # The engine's own values, by axis
    worst: Mapping[str, float] = field(default_factory=dict)  # Values that decide a limit, by axis
    equals: Mapping[str, str] = field(default_factory=dict)  # Notes on equal variables, by variable
    options: Options = field(default_factory=Options)

    @property
    def caption(self) -> str:
        """Caption below a figure: the parameters that it does not show."""
        return f"At {', '.join(self.others)}" if self.others else ""

    def array(self, name: str) -> xr.Variable:
        """Return a variable without its coordinates; not read before its values are."""
        return self.data.variables[name]

    def at(self, name: str, index: Mapping[str, Any]) -> xr.Variable:
        """A variable at places of those axes that it has."""
        array = self.array(name)
        return array.isel({dim: i for dim, i in index.items() if dim in array.dims})

    def numbers(self, name: str, index: Mapping[str, Any] | None = None) -> Floats:
        """Values of a variable or coordinate, at places of those axes that it has."""
        return np.asarray(self.at(name, index or {}).values, dtype=float)

    def label(self, name: str) -> str:
        """Label of an axis of a variable: name, symbol and unit."""
        return axis_label(self.array(name), name)

    def title(self, name: str) -> str:
        """Name and symbol of a variable."""
        return title_of(self.array(name), name)

    def unit(self, name: str) -> str:
        """Unit of a variable in brackets."""
        return unit_in_brackets(self.array(name))

    def has(self, name: str) -> bool:
        """Whether there is a variable of numbers of this name."""
        return name in self.data.data_vars and self.array(name).dtype.kind in "iufb"

    def axes(self, names: Iterable[str]) -> list[str]:
        """Axes that any of the variables has, in the order of the archive."""
        used = {dim for name in names for dim in self.array(name).dims}
        return [str(dim) for dim in self.data.sizes if dim in used and dim not in RUNNING]

    def axis(self, dim: str | None) -> StudyAxis:
        """The axis of a dimension; `NO_AXIS` where nothing is drawn along one.

        Words stand in an auxiliary coordinate (``method_name`` along ``method``, ``case`` along
        ``design``); the dimension's own coordinate then only numbers them.
        """
        if dim is None:
            return NO_AXIS
        data = self.data
        own = data.variables.get(dim, xr.Variable((dim,), np.arange(data.sizes[dim])))
        labels = [
            str(key)
            for key in data.coords
            if data.variables[key].dims == (dim,) and is_words(data.variables[key])
        ]
        if dim != "design" and dim not in labels:
            # Along a parameter of a list of designs, its values say more than the names of cases.
            labels = [key for key in labels if key == f"{dim}_name"]
        nominal = self.nominal.get(dim)
        if dim == MISFIRE and not is_words(own):
            numbers = np.asarray(own.values, dtype=float)
            words = tuple("none" if value == 0 else typeset(value) for value in numbers)
            places = np.arange(len(words), dtype=float)
            return StudyAxis(dim, places, words, "Misfiring cylinder", own, False, nominal=nominal)
        if labels:
            key = ([key for key in (f"{dim}_name", dim, "case") if key in labels] or labels)[0]
            label = sentence(name_of(self.array(key), key))
            words = tuple(_strings(self.array(key)))
            numbers = np.arange(len(words), dtype=float)
            return StudyAxis(dim, numbers, words, label, own, False, nominal=nominal)
        values = np.asarray(own.values, dtype=float)
        remarks = self.remarks.get(dim, ())
        return StudyAxis(
            dim, values, (), axis_label(own, dim), own, is_log(values), remarks, nominal
        )

    def slice_at(self, index: Mapping[str, int]) -> View:
        """One slice: the dimensions of `index` are gone."""
        index = {dim: i for dim, i in index.items() if dim in self.data.sizes}
        if not index:
            return self
        return replace(
            self,
            data=self.data.isel(dict(index)),
            fixed={**self.fixed, **{dim: self.axis(dim).tag(i) for dim, i in index.items()}},
            had=self.former_dims(),
            nominal={dim: i for dim, i in self.nominal.items() if dim not in index},
        )

    def former_dims(self) -> dict[str, frozenset[str]]:
        """Return the dimensions that each variable has or had, before slices."""
        return {
            str(name): self.had.get(str(name), frozenset()) | {str(dim) for dim in variable.dims}
            for name, variable in self.data.variables.items()
        }

    def only(self, names: Iterable[str], keep: Iterable[str | None]) -> View:
        """Cut every axis of the variables but `keep` at its default slice."""
        names, kept = list(names), set(keep)
        rest = [dim for dim in self.axes(names) if dim not in kept]
        idle = [dim for dim in rest if self.idle(names, dim)]
        view = self.slice_at({dim: self.default(dim) for dim in rest})
        same = {
            dim: "the same in every case"
            if dim == "design"
            else f"the same over {dimension_text(dim)}"
            for dim in idle
        }
        worst = {dim: f"{view.fixed[dim]} (worst)" for dim in rest if dim in self.worst}
        return replace(view, fixed={**view.fixed, **worst, **same})

    def slices(self, names: Iterable[str], keep: Iterable[str | None]) -> list[View]:
        """A view at each value of every axis of the variables but `keep`.

        Where these are many, it is the default slice alone, and a note says of how many.
        """
        names, kept = list(names), list(keep)
        rest = [d for d in self.axes(names) if d not in kept and not self.idle(names, d)]
        sizes = [self.data.sizes[dim] for dim in rest]
        if math.prod(sizes) > MOST_SLICES:
            view = self.only(names, kept)
            more = {
                dim: f"{view.fixed[dim]} (1 of {self.axis(dim).size} {self.axis(dim).plural}; "
                "select another)"
                for dim in rest
            }
            return [replace(view, fixed={**view.fixed, **more})]
        views = []
        for place in np.ndindex(*sizes):
            at = dict(zip(rest, place, strict=True))
            named = "".join(f"_{dim}_{slug(self.axis(dim).plain(i))}" for dim, i in at.items())
            view = self.slice_at(at).only(names, kept)
            views.append(replace(view, suffix=view.suffix + named))
        return views

    def with_values(self, names: Iterable[str], *dims: str | None) -> View:
        """Leave out the places of axes at which no variable has a number or a known outcome.

        A note says so, except of parts that an engine of fewer cylinders does not have.
        """
        view = self
        for dim in dims:
            arrays = [name for name in names if dim is None or dim in view.array(name).dims]
            if dim is None or len(arrays) < len(list(names)):
                continue
            there = np.zeros(view.data.sizes[dim], dtype=bool)
            for name in arrays:
                array = view.array(name)
                said = view.outcomes(name, array, {}) != NO_VALUE
                there |= said.any(axis=tuple(i for i, d in enumerate(array.dims) if d != dim))
            kept = np.flatnonzero(there)
            if 0 < kept.size < there.size:
                view = view._kept(dim, kept)
        return view

    def _kept(self, dim: str, places: NDArray[np.intp]) -> View:
        """The view with some places of an axis, and a note of the others."""
        axis, nominal = self.axis(dim), self.nominal.get(dim)
        fixed, others = dict(self.fixed), {d: n for d, n in self.nominal.items() if d != dim}
        if nominal in places:
            others[dim] = int(np.flatnonzero(places == nominal)[0])
        if dim not in COUNTED:
            left = f"{axis.size - places.size} of {axis.size}"
            fixed[dim] = f"{left} {axis.plural} without numbers left out"
        remarks = dict(self.remarks)
        if remarks.get(dim):
            remarks[dim] = tuple(remarks[dim][place] for place in places)
        return replace(
            self, data=self.data.isel({dim: places}), fixed=fixed, had=self.former_dims(),
            nominal=others, remarks=remarks,
        )  # fmt: skip

    def default(self, dim: str) -> int:
        """The slice when none is chosen: nominal, worst, the engine's own, middle or first."""
        if dim in self.nominal:
            return self.nominal[dim]
        axis, known = self.axis(dim), {**self.own, **self.worst}
        if dim in known:
            numbers = np.asarray(axis.variable.values, dtype=float)
            near = np.flatnonzero(np.isclose(numbers, known[dim], rtol=1e-6, atol=0.0))
            if near.size:
                return int(near[0])
        return 0 if axis.words or dim == "design" else (axis.size - 1) // 2

    def deciding(self) -> dict[str, float]:
        """Speed, load, misfire of the default design where its first limit decides."""
        ratios = [str(n) for n in self.data.data_vars if str(n).endswith(LIMITED)]
        for name in filter(self.has, (*self.options.sides, *ratios)):
            design = {d: self.default(d) for d in self.axes([name]) if d not in NOT_CHOSEN}
            array = self.at(name, design)
            sign = -1.0 if self.options.sides.get(name) == ">" else 1.0
            if array.ndim and array.size <= MOST_READ and array.notnull().any():
                at = array.dims, np.unravel_index(np.nanargmax(sign * array.values), array.shape)
                dims = {d: i for d, i in zip(*at, strict=True) if d in NOT_CHOSEN}
                return {str(d): float(self.axis(str(d)).variable.values[i]) for d, i in dims.items()
                        if self.axis(str(d)).variable.dtype.kind in "fiu"}  # fmt: skip
        return {}

    def notes(self, names: Iterable[str], units: bool = True) -> list[str]:
        """Slices that these variables were cut at, and comments of variables without a unit.

        Where only ratios are drawn, `units` is False: no unit is missed.
        """
        names = list(names)
        had = {dim for name in names for dim in self.had.get(name, ())}
        notes = [text for dim, text in self.fixed.items() if dim in had]
        notes += [self.equals[name] for name in names if name in self.equals]
        for name in names:
            attributes = self.array(name).attrs
            if units and "units" not in attributes and "comment" in attributes:
                notes.append(plain_text(str(attributes["comment"])))
        return notes

    def least_span(self, name: str) -> float:
        """Relative difference up to which two values of a variable are one and the same.

        Of what the solver finds to its tolerance, either may be off by that.
        """
        solved = name in ("delta", "delta_midrange", "inertia_required")
        return max(LEAST_SPAN, 2.0 * self.tolerance if solved else 0.0)

    def varies(self, names: Iterable[str], dim: str) -> bool:
        """Whether any of the variables changes along an axis (looked at on its default slice)."""
        for name in names:
            if dim not in self.array(name).dims:
                continue
            rest = {d: self.default(d) for d in self.axes([name]) if d != dim}
            array = self.array(name).isel(rest)
            array = array.isel({dim: pick(array.sizes[dim], MOST_LINES)})
            if not _level(array, dim, self.least_span(name)):
                return True
        return False

    def idle(self, names: Iterable[str], dim: str) -> bool:
        """Whether an axis does nothing to the variables, wherever the others stand.

        Values, their outcomes and what is published beside them are the same all along it.
        """
        return all(self._idle(name, dim) for name in names)

    def _idle(self, name: str, dim: str) -> bool:
        array, least = self.array(name), self.least_span(name)
        if dim not in array.dims:
            return True
        other = self.published(name)
        if other is not None and not _level(self.array(other), dim, 0.0):
            return False
        some = {d: pick(n, MOST_LINES) for d, n in array.sizes.items() if d not in RUNNING}
        if not _level(array.isel(some), dim, least):
            return False
        if array.size > MOST_READ or not _level(array, dim, least):
            return False
        if not np.isfinite(np.asarray(array.values, dtype=float)).any():
            return False  # Without any numbers, none are equal
        status = self.data.variables.get("status")
        if status is None or not name.startswith(FROM_SPEED) or dim not in status.dims:
            return True
        return _level(status, dim, 0.0)

    def published(self, name: str, everywhere: bool = False) -> str | None:
        """The variable of published values of a computed one, if in the same units.

        `everywhere`: also one over axes that the computed one does not depend on.
        """
        other = name + PUBLISHED
        if not self.has(other):
            return None
        if not everywhere and self.array(other).dims != self.array(name).dims:
            return None
        units = self.array(name).attrs.get("units")
        return other if self.array(other).attrs.get("units", units) == units else None

    def outcomes(self, name: str, array: xr.Variable, index: Mapping[str, int]) -> NDArray[Any]:
        """For each element of a slice of a variable: "" or why it is no number to rely on."""
        values = np.asarray(array.values, dtype=float)
        lost = ~np.isfinite(values)
        said = np.where(lost, NO_VALUE, "").astype(object)
        doubtful = name.startswith(FROM_SPEED)
        beside = doubtful and PERIODIC_STATUS in self.data.variables
        key = PERIODIC_STATUS if beside else STATUS
        if key not in self.data.variables or not (lost.any() or doubtful):
            return said
        status = self.at(key, index)
        if set(status.dims) <= set(array.dims):
            sizes = {dim: array.sizes[dim] for dim in array.dims}
            codes = status.set_dims(sizes).transpose(*array.dims).values
            for code, text in meanings_of(status).items():
                if code not in SOUND:
                    said[(codes == code) & lost] = text
            if doubtful:
                code = outcome.TOLERANCE_NOT_MET
                said[(codes == code) & ~lost] = meanings_of(status)[code]
        return said


def _level(array: xr.Variable, dim: str, least: float) -> bool:
    """Whether values are the same along a dimension but for `least` of their size."""
    values = np.asarray(array.transpose(dim, ...).values, dtype=float)
    known = np.isfinite(values)
    if (known != known[:1]).any():
        return False
    values = np.where(known, values, 0.0)
    size = np.abs(values).max(axis=0, initial=0.0)
    rounding = 1e-12 * size.max(initial=0.0)
    return bool(np.all(np.ptp(values, axis=0) <= np.maximum(least * size, rounding)))


def meanings_of(status: xr.Variable) -> dict[int, str]:
    """Meanings of the codes of a status variable, in words."""
    known = dict(enumerate(outcome.MEANINGS))
    values = np.atleast_1d(status.attrs.get("flag_values", []))
    words = str(status.attrs.get("flag_meanings", "")).split()
    known.update({int(value): word for value, word in zip(values, words, strict=False)})
    return {code: word.replace("_", " ") for code, word in known.items()}


def facet_of(view: View, names: Sequence[str], taken: Iterable[str | None]) -> str | None:
    """The axis for small multiples: one of words, else the shortest of those that change them."""
    rest = [d for d in view.axes(names) if d not in set(taken) and not view.idle(names, d)]
    rest.sort(key=lambda dim: (not view.axis(dim).words, view.data.sizes[dim]))
    return rest[0] if rest else None


def stem_of(base: str, view: View, along: str | None, alone: bool = False) -> str:
    """Name of a file: what, along which axis, and where if not at the nominal design."""
    suffix = "" if alone or along in (None, "design") else f"_{along}"
    return base + suffix + view.suffix


def dimension_text(dim: str) -> str:
    """Name of a dimension in the middle of a sentence."""
    return "case" if dim == "design" else dim.replace("_", " ")
