"""What a figure draws along: the axes of an archive, its slices and its families of designs."""

from __future__ import annotations

import json
from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from engine_dyn import status as outcome
from engine_dyn.types import Floats, Integers
from sweeps.errors import SceneError, did_you_mean, shown
from sweeps.figures.wording import (
    axis_label,
    digits_of,
    name_of,
    number_text,
    plain_text,
    sentence,
    shorten,
    slug,
    value_text,
)

MOST_LINES = 8  # more cannot be told apart without colour
MOST_PANELS = 9
# Dimensions that a curve runs along; all others are axes of the study.
RUNNING = ("crank_angle", "order")
# Columns of a list of designs that say how a design was computed and not what it is.
BOOKKEEPING = ("case", "start_speed", "start_angle", "passes")
# What may change together with a parameter without being a second one: a longer rod leaves
# another share of its mass to the piston (Kakaitsas 5.2.3), a stroke moves the rod of equal ratio.
FOLLOWERS = {
    "crank_ratio": ("reciprocating_mass", "rod_length"),
    "rod_length": ("reciprocating_mass", "crank_ratio"),
    "stroke": ("reciprocating_mass", "rod_length"),
}
PUBLISHED = "_published"
SOUND = (outcome.CONVERGED, outcome.PASSES_DONE)
# Made from the speed solution: what a status of "tolerance not met" speaks of.
FROM_SPEED = ("delta", "omega", "load_torque", "load_coefficient", "angular_acc", "inertia_torque_")
NO_VALUE = "no value"
# Found by the solver to the scene's tolerance, which is the relative error of these.
TO_TOLERANCE = ("delta", "delta_midrange", "inertia_required")
LEAST_SPAN = 1e-6
"""Of values over their size; what differs by less is rounding, or finer than ticks can say."""
ROUNDING = 1e-12
"""Of the largest value of a variable."""
MOST_READ = 4_000_000
"""Values of a variable that are read to see whether an axis does anything to it."""


@dataclass(frozen=True)
class StudyAxis:
    """One dimension of an archive: its numbers or words, and how they are spoken of."""

    name: str
    values: Floats
    words: tuple[str, ...]  # empty for numbers
    label: str
    variable: xr.Variable
    log: bool
    remarks: tuple[str, ...] = ()  # what changes along with it
    nominal: int | None = None

    @property
    def size(self) -> int:
        """Number of values."""
        return int(self.values.size)

    def text(self, index: int) -> str:
        """The value alone, for a legend that has the label as its title."""
        text = self.words[index] if self.words else number_text(self.values[index], self.digits)
        if self.remarks and self.remarks[index]:
            text += f", {self.remarks[index]}"
        return text

    def tag(self, index: int) -> str:
        """Name and value, for titles."""
        if self.words:
            return self.words[index]
        return value_text(self.variable, self.name, float(self.values[index]), self.digits)

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


def picked_text(axis: StudyAxis | None, most: int = MOST_LINES) -> str:
    """Say how many values of an axis are shown where they are not all."""
    if axis is None or axis.size <= most:
        return ""
    shown_count = len(pick(axis.size, most, axis.nominal))
    what = "cases" if axis.name == "design" else f"values of {axis.name.replace('_', ' ')}"
    return f"{shown_count} of {axis.size} {what} shown"


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
    others: tuple[str, ...] = ()  # parameters that are the same in all of it
    tolerance: float = 0.0  # of the solver

    @property
    def caption(self) -> str:
        """What stands below a figure: the parameters that it does not show."""
        return f"At {', '.join(self.others)}" if self.others else ""

    def array(self, name: str) -> xr.Variable:
        """Return a variable without its coordinates; not read before its values are."""
        return self.data.variables[name]

    def has(self, name: str) -> bool:
        """Whether there is a variable of numbers of this name."""
        return name in self.data.data_vars and self.array(name).dtype.kind in "iufb"

    def axes(self, names: Iterable[str]) -> list[str]:
        """Axes that any of the variables has, in the order of the archive."""
        used = {dim for name in names for dim in self.array(name).dims}
        return [str(dim) for dim in self.data.sizes if dim in used and dim not in RUNNING]

    def axis(self, dim: str) -> StudyAxis:
        """The axis of a dimension.

        Words stand in an auxiliary coordinate (``method_name`` along ``method``, ``case`` along
        ``design``); the dimension's own coordinate then only numbers them.
        """
        data = self.data
        own = data.variables.get(dim, xr.Variable((dim,), np.arange(data.sizes[dim])))
        labels = [
            str(key)
            for key in data.coords
            if data.variables[key].dims == (dim,) and is_words(data.variables[key])
        ]
        if dim != "design" and dim not in labels:
            # along a parameter taken out of a list of designs, the name of a case says less
            labels = [key for key in labels if key == f"{dim}_name"]
        nominal = self.nominal.get(dim)
        if labels:
            preferred = [key for key in (f"{dim}_name", dim, "case") if key in labels]
            key = (preferred or labels)[0]
            label = sentence(name_of(self.array(key), key))
            words = tuple(_strings(self.array(key)))
            numbers = np.arange(len(words), dtype=float)
            return StudyAxis(dim, numbers, words, label, own, False, nominal=nominal)
        values = np.asarray(own.values, dtype=float)
        remarks = self.remarks.get(dim, ())
        return StudyAxis(
            dim, values, (), axis_label(own, dim), own, is_log(values), remarks, nominal
        )

    def cut(self, index: Mapping[str, int]) -> View:
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
        view = self.cut({dim: self.default(dim) for dim in rest})
        return replace(view, fixed={**view.fixed, **{dim: self.same(dim) for dim in idle}})

    def same(self, dim: str) -> str:
        """What is said of an axis that does nothing."""
        return same_over([dim])

    def default(self, dim: str) -> int:
        """The slice when none is chosen: nominal design, middle number or first word."""
        if dim in self.nominal:
            return self.nominal[dim]
        axis = self.axis(dim)
        return 0 if axis.words or dim == "design" else (axis.size - 1) // 2

    def notes(self, names: Iterable[str], units: bool = True) -> list[str]:
        """The slices that these variables were cut at, and what is said in place of a unit.

        Where only ratios are drawn, `units` is False: no unit is missed.
        """
        names = list(names)
        had = {dim for name in names for dim in self.had.get(name, ())}
        notes = [text for dim, text in self.fixed.items() if dim in had]
        for name in names:
            attributes = self.array(name).attrs
            if units and "units" not in attributes and "comment" in attributes:
                notes.append(plain_text(str(attributes["comment"])))
        return notes

    def least_span(self, name: str) -> float:
        """Relative difference up to which two values of a variable are one and the same.

        Of what the solver finds to its tolerance, either may be off by that.
        """
        return max(LEAST_SPAN, 2.0 * self.tolerance if name in TO_TOLERANCE else 0.0)

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
            return False  # there is no number to be the same
        status = self.data.variables.get("status")
        if status is None or not name.startswith(FROM_SPEED) or dim not in status.dims:
            return True
        return _level(status, dim, 0.0)

    def published(self, name: str, everywhere: bool = False) -> str | None:
        """The variable of published values beside a computed one, if in the same units.

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
        if "status" not in self.data.variables or not (lost.any() or doubtful):
            return said
        status = self.array("status")
        status = status.isel({d: i for d, i in index.items() if d in status.dims})
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
    rounding = ROUNDING * size.max(initial=0.0)
    return bool(np.all(np.ptp(values, axis=0) <= np.maximum(least * size, rounding)))


def meanings_of(status: xr.Variable) -> dict[int, str]:
    """What the codes of a status variable mean, in words."""
    known = dict(enumerate(outcome.MEANINGS))
    values = np.atleast_1d(status.attrs.get("flag_values", []))
    words = str(status.attrs.get("flag_meanings", "")).split()
    known.update({int(value): word for value, word in zip(values, words, strict=False)})
    return {code: word.replace("_", " ") for code, word in known.items()}


def facet_of(view: View, names: Sequence[str], taken: Iterable[str | None]) -> str | None:
    """The axis for small multiples: words first, else the shortest of those that do something."""
    rest = [d for d in view.axes(names) if d not in set(taken) and not view.idle(names, d)]
    rest.sort(key=lambda dim: (not view.axis(dim).words, view.data.sizes[dim]))
    return rest[0] if rest else None


@dataclass(frozen=True)
class Family:
    """Designs that differ in one parameter."""

    parameter: str
    members: tuple[int, ...]  # by rising value
    followers: tuple[str, ...] = ()
    differs: tuple[str, ...] = ()  # in which other parameters it is not the first design


@dataclass(frozen=True)
class Study:
    """An archive as it is drawn: its view, and the families that its designs fall into."""

    view: View
    base: tuple[tuple[str, View], ...] = ()  # parameter, view in which it is an axis
    # the same, away from the nominal design, and the parameters in which it is away
    aside: tuple[tuple[str, View, tuple[str, ...]], ...] = ()
    apart: bool = False  # some designs are in no family

    def along(self, names: Sequence[str]) -> list[tuple[View, str | None]]:
        """Each axis that does something to the variables, with the view that has it."""
        found: list[tuple[View, str | None]] = []
        axes = self.view.axes(names)
        if "design" in axes and self.base:
            found += [(view, p) for p, view in self.base if view.varies(names, p)]
            axes.remove("design")
        found += [(self.view, axis) for axis in axes if not self.view.idle(names, axis)]
        return found or [(self.view.only(names, ()), None)]


def parameters_of(data: xr.Dataset) -> list[str]:
    """Parameters that vary over the designs."""
    return [
        str(key)
        for key, coordinate in data.coords.items()
        if coordinate.dims == ("design",)
        and key not in ("design", *BOOKKEEPING)
        and _codes(coordinate.variable).any()
    ]


def _codes(variable: xr.Variable) -> Integers:
    """Equal values get equal whole numbers (twelve digits count)."""
    if is_words(variable):
        values = variable.values.astype(str)
    else:
        values = variable.values.astype(float)
        scale = np.max(np.abs(values), where=np.isfinite(values), initial=0.0) or 1.0
        values = np.round(values / scale, 12)
    return np.asarray(np.unique(values, return_inverse=True)[1], dtype=np.int64).reshape(-1)


def families_of(data: xr.Dataset) -> list[Family]:
    """Take a list of designs apart into families that vary one parameter.

    The first design is the nominal one. For every parameter, the designs that differ from it in
    this parameter alone (or, where there is none, in it and its `FOLLOWERS`) are a family;
    `BOOKKEEPING` columns do not count. Designs that agree in all other parameters, but elsewhere
    than the nominal one, are a family too when there are at least three of them (such as three
    inertias of an eight-cylinder engine).
    """
    names = parameters_of(data)
    codes = {name: _codes(data[name].variable) for name in names}
    found: list[Family] = []
    for name in names:
        values = data[name].variable
        for following in ((), FOLLOWERS.get(name, ())):
            alike = np.ones(data.sizes["design"], dtype=bool)
            for key in names:
                if key != name and key not in following:
                    alike &= codes[key] == codes[key][0]
            members = _distinct(values, codes[name], np.flatnonzero(alike))
            if len(members) > 1 and 0 in members:
                moved = [k for k in following if k in names and np.ptp(codes[k][list(members)])]
                found.append(Family(name, members, tuple(moved)))
                break
        others = [codes[key] for key in names if key != name]
        if others:
            groups = np.unique(np.stack(others, axis=1), axis=0, return_inverse=True)[1].reshape(-1)
            found += _asides(values, codes, name, groups)
    return found


def _asides(
    values: xr.Variable,
    codes: Mapping[str, Integers],
    name: str,
    groups: Integers,
) -> list[Family]:
    """Families of a parameter that the nominal design is not in."""
    sizes = np.bincount(groups)
    found = []
    for group in np.flatnonzero(sizes >= 3):
        members = _distinct(values, codes[name], np.flatnonzero(groups == group))
        if group != groups[0] and len(members) >= 3:
            row = members[0]
            differs = [key for key in codes if key != name and codes[key][row] != codes[key][0]]
            found.append(Family(name, members, (), tuple(differs)))
    return [found[i] for i in pick(len(found), MOST_LINES - 1)]


def _distinct(values: xr.Variable, codes: Integers, rows: NDArray[np.intp]) -> tuple[int, ...]:
    """The first design of each value, by rising value (words: in their own order)."""
    rows = rows[np.sort(np.unique(codes[rows], return_index=True)[1])]
    if not is_words(values):
        numbers = values.values.astype(float)
        rows = rows[np.isfinite(numbers[rows])]
        rows = rows[np.argsort(numbers[rows], kind="stable")]
    return tuple(int(row) for row in rows)


def _family_view(view: View, family: Family) -> View:
    """A family as a view in which the parameter is an axis in place of ``design``."""
    data, name, members = view.data, family.parameter, list(family.members)
    part = data.isel(design=members).swap_dims(design=name)
    remarks = tuple(
        ", ".join(design_text(data, key, member) for key in family.followers) for member in members
    )
    apart = [design_text(data, key, members[0]) for key in family.differs]
    suffix = "".join(f"_{key}_{slug(_bare(data, key, members[0]))}" for key in family.differs)
    others = [
        design_text(data, key, members[0])
        for key in parameters_of(data)
        if key != name and key not in family.followers
    ]
    had = {
        key: dims | {"design"} if "design" in data.variables[key].dims else dims
        for key, dims in view.former_dims().items()
    }
    return replace(
        view,
        data=part,
        had=had,
        fixed={**view.fixed, **({"design": ", ".join(apart)} if apart else {})},
        nominal={} if apart else {**view.nominal, name: members.index(0)},
        remarks={**view.remarks, name: remarks},
        suffix=view.suffix + suffix,
        others=tuple(others),
    )


def _bare(data: xr.Dataset, key: str, design: int) -> str:
    value = data[key].variable.values[design]
    return str(value) if is_words(data[key].variable) else f"{value:.6g}"


def design_text(data: xr.Dataset, key: str, design: int) -> str:
    """One parameter of one design: symbol = number unit."""
    variable = data[key].variable
    if is_words(variable):
        return shorten(str(variable.values[design]))
    return value_text(variable, key, float(variable.values[design]))


def study_of(data: xr.Dataset, select: Mapping[str, float | str]) -> Study:
    """Cut what was selected and what has one value, sort the axes, find the families."""
    order: dict[Hashable, Any] = {}
    for dim in data.sizes:
        own = data.variables.get(dim)
        if own is None or dim == "design" or is_words(own):
            continue
        rising = np.argsort(own.values, kind="stable")
        if np.any(np.diff(rising) != 1):
            order[dim] = rising
    view = View(data.isel(order) if order else data, tolerance=_tolerance(data))
    view = view.cut({dim: _selected(view, dim, value) for dim, value in select.items()})
    view = view.cut({str(d): 0 for d, n in view.data.sizes.items() if n == 1 and d not in RUNNING})
    empty = [dim for dim, size in view.data.sizes.items() if size == 0]
    view = replace(view, data=view.data.drop_dims(empty))
    if "design" not in view.data.sizes:
        return Study(view)
    base: list[tuple[str, View]] = []
    aside: list[tuple[str, View, tuple[str, ...]]] = []
    lonely = np.ones(view.data.sizes["design"], dtype=bool)
    listed = tuple(design_text(view.data, key, 0) for key in parameters_of(view.data))
    for family in families_of(view.data):
        part = _family_view(view, family)
        if family.differs:
            aside.append((family.parameter, part, family.differs))
        else:
            base.append((family.parameter, part))
        lonely[list(family.members)] = False
    if base:
        view = replace(view, nominal={"design": 0}, others=listed)
    return Study(view, tuple(base), tuple(aside), bool(lonely.any()))


def _tolerance(data: xr.Dataset) -> float:
    """Tolerance of the solver, 0 for an archive that does not tell it."""
    try:
        return float(json.loads(data.attrs["solver"])["tolerance"])
    except (KeyError, TypeError, ValueError):
        return 0.0


def _selected(view: View, dim: str, value: float | str) -> int:
    """The index of a selected slice: the word itself, or the nearest number."""
    if dim not in view.data.sizes:
        axes = [str(name) for name in view.data.sizes]
        hint = did_you_mean(dim, axes) or f"; its axes are {', '.join(axes) or 'none'}"
        raise SceneError(f"select: the archive has no axis {shown(dim)}{hint}")
    axis = view.axis(dim)
    if isinstance(value, str):
        if axis.words and shorten(value) in axis.words:
            return axis.words.index(shorten(value))
        allowed = ", ".join(axis.words[:20]) if axis.words else "numbers"
        raise SceneError(f"select: {dim} is {shown(value)}, allowed: {allowed}")
    if not np.isfinite(value):
        raise SceneError(f"select: {dim} must be a finite number, not {value}")
    numbers = np.asarray(axis.variable.values if not axis.words else axis.values, dtype=float)
    return int(np.nanargmin(np.abs(numbers - float(value))))


def stem_of(base: str, view: View, along: str | None, alone: bool = False) -> str:
    """Name of a file: what, along which axis, and where if not at the nominal design."""
    suffix = "" if alone or along in (None, "design") else f"_{along}"
    return base + suffix + view.suffix


def same_over(dims: Sequence[str]) -> str:
    """What is said of axes that do nothing."""
    over = [said_of(dim) for dim in dims if dim != "design"]
    places = [f"over {' and '.join(over)}"] if over else []
    if "design" in dims:
        places.append("in every case")
    return f"the same {' and '.join(places)}"


def key_text(axis: StudyAxis) -> str:
    """An axis in the middle of a sentence: its key says it shortest."""
    return said_of(axis.name)


def said_of(dim: str) -> str:
    """A dimension in the middle of a sentence."""
    return "case" if dim == "design" else dim.replace("_", " ")
