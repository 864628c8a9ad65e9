"""An archive as it is drawn: one view of it, and the families that a list of designs falls into."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from engine_dyn.types import Integers
from sweeps.base.dimensions import (
    DESIGN,
    RANK,
    REDUCTION,
    SEARCHED,
    number_inside,
    selected_places,
    words_of,
)
from sweeps.view.figures.options import Options, with_angle_from_zero, with_targets
from sweeps.view.figures.views import MISFIRE, MOST_LINES, RUNNING, View, is_words, pick
from sweeps.view.figures.wording import shorten, slug, value_text


def kept_as_cases(data: xr.Dataset) -> xr.Dataset:
    """A reduced archive whose kept designs are named cases, the best of the first search first."""
    if REDUCTION not in data.attrs or DESIGN not in data.dims or RANK not in data:
        return data
    ranks = np.where(data[RANK].values > 0, data[RANK].values, np.iinfo(np.int32).max)
    data = data.isel({DESIGN: np.lexsort(ranks[::-1])})
    if "case" in data.coords:
        return data
    names = [f"design {number}" for number in data[DESIGN].values]
    return data.assign_coords(case=(DESIGN, np.array(names, dtype=object)))


def is_sample(data: xr.Dataset) -> bool:
    """Whether the designs were drawn from distributions: each parameter has its own value."""
    try:
        return bool(json.loads(data.attrs["scene"]).get("sample"))
    except (KeyError, TypeError, ValueError, AttributeError):
        return False


def with_kept_note(view: View) -> View:
    """A view whose notes say how many designs were kept, of how many."""
    if REDUCTION not in view.data.attrs or DESIGN not in view.data.sizes:
        return view
    every = json.loads(view.data.attrs[REDUCTION])["designs"]
    text = f"{view.data.sizes[DESIGN]:,} designs kept of {every:,}"
    return replace(view, fixed={**view.fixed, DESIGN: text}, had=view.former_dims())


@dataclass(frozen=True)
class Family:
    """Designs that differ in one parameter."""

    parameter: str
    members: tuple[int, ...]  # Numbers of the designs by ascending value
    followers: tuple[str, ...] = ()
    differs: tuple[str, ...] = ()  # Parameters in which the members differ from the nominal design


@dataclass(frozen=True)
class Study:
    """An archive as it is drawn: its view, and the families that its designs fall into."""

    view: View
    base: tuple[tuple[str, View], ...] = ()
    """Families with the nominal design: the parameter, and the view in which it is an axis."""
    elsewhere: tuple[tuple[str, View, tuple[str, ...]], ...] = ()
    """Families without the nominal design: parameter, view, and the parameters in which they
    differ."""
    apart: bool = False
    """Whether some designs are in no family."""
    given: xr.Dataset | None = None
    """The archive itself, where the view counts the crank angle from another zero."""

    def with_own_angle(self) -> Study:
        """The same study with the crank angle of the archive."""
        options = replace(self.view.options, angle=None, zero="firing-tdc")
        return self if self.given is None else study_of(self.given, options.select, options)

    def views_by_axis(self, names: Sequence[str]) -> list[tuple[View, str | None]]:
        """Each axis that changes the variables, with the view in which it is an axis."""
        views: list[tuple[View, str | None]] = []
        axes = self.view.axes(names)
        if "design" in axes and self.base:
            views += [(view, p) for p, view in self.base if view.varies(names, p)]
            axes.remove("design")
        views += [(self.view, axis) for axis in axes if not self.view.idle(names, axis)]
        return views or [(self.view.only(names, ()), None)]

    def views_of(self, name: str) -> Iterator[tuple[View, str | None]]:
        """Families of one variable by axis, and its families away from the nominal design."""
        yield from self.views_by_axis([name])
        # A grid of designs has very many families away from the nominal design.
        if "design" in self.view.array(name).dims and len(self.elsewhere) <= 4:
            for parameter, view, _ in self.elsewhere:
                if view.varies([name], parameter):
                    yield view, parameter


def parameters_of(data: xr.Dataset) -> list[str]:
    """Parameters that vary over the designs."""
    # Columns of designs that are no parameters of the engine: name of the design, how the solver
    # starts and how many cycles it computes, and how a search came to the design
    bookkeeping = ("case", "start_speed", "start_angle", "passes", *SEARCHED)
    return [
        str(key)
        for key, coordinate in data.coords.items()
        if coordinate.dims == ("design",)
        and key not in ("design", *bookkeeping)
        and _codes(coordinate.variable).any()
    ]


def _codes(variable: xr.Variable) -> Integers:
    """Whole numbers for values, equal for equal values (twelve digits count)."""
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
    this parameter alone (or, where there is none, also in those that follow this parameter) are a
    family. Designs that agree in all other parameters, but elsewhere than the nominal one, are a
    family too when there are at least three of them (such as three inertias of an eight-cylinder
    engine).
    """
    names = parameters_of(data)
    codes = {name: _codes(data[name].variable) for name in names}
    families: list[Family] = []
    # Parameters that may change together with another one without being varied: a longer rod leaves
    # another part of its mass to the piston (Kakaitsas 5.2.3), a stroke of equal ratio moves the
    # rod
    follow = {
        "crank_ratio": ("reciprocating_mass", "rod_length"),
        "rod_length": ("reciprocating_mass", "crank_ratio"),
        "stroke": ("reciprocating_mass", "rod_length"),
    }
    for name in names:
        values = data[name].variable
        for following in ((), follow.get(name, ())):
            alike = np.ones(data.sizes["design"], dtype=bool)
            for key in names:
                if key != name and key not in following:
                    alike &= codes[key] == codes[key][0]
            members = _distinct(values, codes[name], np.flatnonzero(alike))
            if len(members) > 1 and 0 in members:
                moved = [k for k in following if k in names and np.ptp(codes[k][list(members)])]
                families.append(Family(name, members, tuple(moved)))
                break
        others = [codes[key] for key in names if key != name]
        if others:
            groups = np.unique(np.stack(others, axis=1), axis=0, return_inverse=True)[1].reshape(-1)
            families += _families_elsewhere(values, codes, name, groups)
    return families


def _families_elsewhere(
    values: xr.Variable, codes: Mapping[str, Integers], name: str, groups: Integers
) -> list[Family]:
    """Families of a parameter without the nominal design."""
    sizes = np.bincount(groups)
    families = []
    for group in np.flatnonzero(sizes >= 3):
        members = _distinct(values, codes[name], np.flatnonzero(groups == group))
        if group != groups[0] and len(members) >= 3:
            row = members[0]
            differs = [key for key in codes if key != name and codes[key][row] != codes[key][0]]
            families.append(Family(name, members, (), tuple(differs)))
    return [families[i] for i in pick(len(families), MOST_LINES - 1)]


def _distinct(values: xr.Variable, codes: Integers, rows: NDArray[np.intp]) -> tuple[int, ...]:
    """The first design of each value, by ascending value (words: in their own order)."""
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


def study_of(
    data: xr.Dataset, select: Mapping[str, float | str], options: Options | None = None
) -> Study:
    """Cut what was selected and what has one value, sort the axes, find the families."""
    options = with_targets(options or Options(), data)
    given, data = data, kept_as_cases(with_angle_from_zero(data, options))
    places = selected_places(data, select)
    for name in select.keys() - words_of(data).keys():
        number_inside(data, name, select[name])
    several = {dim: here for dim, here in places.items() if len(here) > 1}
    data = data.isel(several) if several else data
    options = replace(options, select=select)
    view = View(data, tolerance=_tolerance(data), own=_own_values(data), options=options)
    view = view.slice_at({dim: here[0] for dim, here in places.items() if len(here) == 1})
    view = replace(view, data=_in_rising_order(view.data))
    single = {str(d): 0 for d, n in view.data.sizes.items() if n == 1 and d not in RUNNING}
    view = view.slice_at(single)
    empty = [dim for dim, size in view.data.sizes.items() if size == 0]
    view = replace(view, data=view.data.drop_dims(empty))
    view = replace(view, worst=view.deciding())
    if REDUCTION in view.data.attrs:  # The designs that a reduction kept form no families
        return Study(with_kept_note(view), given=given)
    if is_sample(view.data):  # Two sampled designs may differ in one parameter, but by chance
        return Study(view, given=None if data is given else given)
    if "design" not in view.data.sizes:
        return Study(view, given=None if data is given else given)
    base: list[tuple[str, View]] = []
    elsewhere: list[tuple[str, View, tuple[str, ...]]] = []
    single_designs = np.ones(view.data.sizes["design"], dtype=bool)
    listed = tuple(design_text(view.data, key, 0) for key in parameters_of(view.data))
    for family in families_of(view.data):
        part = _family_view(view, family)
        if family.differs:
            elsewhere.append((family.parameter, part, family.differs))
        else:
            base.append((family.parameter, part))
        single_designs[list(family.members)] = False
    if base:
        view = replace(view, nominal={"design": 0}, others=listed)
    return Study(view, tuple(base), tuple(elsewhere), bool(single_designs.any()), given)


def _in_rising_order(data: xr.Dataset) -> xr.Dataset:
    """The archive with axes of numbers in ascending order; designs and words stay as they are."""
    order: dict[Hashable, Any] = {}
    for dim in data.sizes:
        own = data.variables.get(dim)
        if own is None or dim == "design" or is_words(own):
            continue
        rising = np.argsort(own.values, kind="stable")
        if np.any(np.diff(rising) != 1):
            order[dim] = rising
    return data.isel(order) if order else data


def _own_values(data: xr.Dataset) -> dict[str, float]:
    """The engine's own values on axes: those of its file, and no misfire."""
    values = {MISFIRE: 0.0}
    try:
        files = json.loads(data.attrs["input_files"])["files"]
        texts = [entry["text"] for name, entry in files.items() if name.endswith(".toml")]
    except (KeyError, TypeError, ValueError, AttributeError):
        return values
    for text in texts:
        try:
            keys = tomllib.loads(text)
            keys |= keys.get("values", {})
        except (tomllib.TOMLDecodeError, TypeError, AttributeError):
            continue
        for name in map(str, data.dims):
            value = keys.get(name)
            if isinstance(value, int | float) and not isinstance(value, bool):
                values.setdefault(name, float(value))
    return values


def _tolerance(data: xr.Dataset) -> float:
    """Tolerance of the solver, 0 for an archive that does not state it."""
    try:
        return float(json.loads(data.attrs["solver"])["tolerance"])
    except (KeyError, TypeError, ValueError):
        return 0.0
