"""Some rows of an archive as a table: those of a slice, the first of an order."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from engine_dyn.quantities.graph import DIMENSIONS
from sweeps.base.arguments import check_dataset
from sweeps.base.dimensions import (
    DESIGN,
    ELASTICITY,
    EXPLAINED,
    FAILED_DRAWS,
    HIGH,
    LABELS,
    LOW,
    PARAMETER,
    REDUCTION,
    SHARE,
    UNCERTAIN,
    words_of,
)
from sweeps.base.errors import SceneError, not_known, one_line, shown
from sweeps.base.naming import meaning_of
from sweeps.decide.explore.attributes import axes_of, members_of, of_designs
from sweeps.decide.explore.columns import (
    check_one_table,
    chosen_quantities,
    columns_of,
    dims_of,
    in_words,
    ranks_of,
    words_for_numbers,
)
from sweeps.decide.explore.opening import nearest
from sweeps.running.reduce.ranges import ranges

if TYPE_CHECKING:
    import xarray as xr

CRANK_ANGLE = "crank_angle"

MOSTLY = 2.0 / 3.0
"""Share of the explained variance that the uncertain values named for a result have together."""


@dataclass(frozen=True, eq=False)
class Rows:
    """Some designs of an archive."""

    # Columns with a value for each design: axes, columns of designs, quantities, in the units of
    # the archive.
    table: dict[str, npt.NDArray[Any]]
    units: dict[str, str]  # Units of the columns that are numbers
    texts: dict[str, str]  # Meanings of the quantities and axes
    given: tuple[str, ...]  # Columns that identify a design: axes and columns of designs
    fixed: dict[str, Any]  # Values of the axes at which the archive was cut, the same in all rows
    designs: int  # Number of designs in the slice, shown or not
    # Curves over the crank angle that are left out, where no quantities were asked for.
    curves: tuple[str, ...]
    changes: frozenset[str] = frozenset()  # Columns that hold changes in percent
    # Names of elasticities that were not asked for; each would need a row for each parameter.
    elasticities: tuple[str, ...] = ()
    # Lower and upper ends of the uncertainty bands of quantities in each row, if there are any.
    bands: dict[str, tuple[npt.NDArray[Any], npt.NDArray[Any]]] = field(default_factory=dict)
    # Names of the parameters that cause most of the uncertainty of a quantity in the whole slice.
    mainly: dict[str, str] = field(default_factory=dict)
    # Quantities with several numbers for each design, left out where no quantities were asked for,
    # by a choice that would leave one number, such as "main_bearing=2".
    several: dict[str, tuple[str, ...]] = field(default_factory=dict)
    # Axes of the chosen quantities, along which each design has several rows.
    listed: tuple[str, ...] = ()

    @property
    def number(self) -> int:
        """Number of rows."""
        return len(next(iter(self.table.values()), ()))


def rows(
    archive: xr.Dataset,
    *,
    select: Mapping[str, float | str] | None = None,
    quantities: str | Sequence[str] | None = None,
    sort: str | None = None,
    limit: int = 20,
    relative_to: Mapping[str, float | str] | str | None = None,
) -> Rows:
    """Return some designs of an archive as a table.

    The archive is read a range at a time: it may be larger than memory.

    Parameters
    ----------
    archive : Dataset
        As `sweeps.open` or `sweeps.run` returns it.
    select : mapping, optional
        Values of axes, of which the nearest are taken, and words: ``{"load": 50, "case": "B"}``.
    quantities : str or sequence of str, optional
        If not given, all that have one number for each design. Those over bearings, cylinders,
        orders or directions have a row for each of these.
    sort : str, optional
        A column; the smallest come first, with a hyphen before the name the largest. Designs
        without a number come last. Unless given, the order is that of the archive; of a reduced
        archive that of its first search.
    limit : int
        Most rows.
    relative_to : mapping or "nominal", optional
        A design, by values of all axes that `select` leaves: quantities are changes from it in
        percent. An empty mapping takes the first design. ``"nominal"`` takes the design of this
        name, and the engine's own values of axes.

    Raises
    ------
    SceneError
        For names that the archive does not have, a limit below 1, and a design that is not one.
    """
    check_dataset(archive)
    _check_arguments(limit, select, relative_to)
    part = nearest(archive, **(select or {}))
    names = _names(part, quantities)
    dims = dims_of(part, names)
    shape = [part.sizes[d] for d in dims]
    columns = {n: v for n, v in columns_of(part, dims, names).items() if v.ndim or n in names}
    uncertain = [n for n in names if n + SHARE in part]
    ends = {} if relative_to is not None else _ends(part, uncertain)
    if sort is None and quantities is None and REDUCTION in part.attrs:
        sort = next((name for name in ranks_of(part) if name in columns), None)
    _check_sort(sort, columns | ends)
    first = _first(columns | ends, dims, shape, sort, limit)
    table = {name: first[name] for name in columns}
    words = words_for_numbers(columns)
    changes = frozenset[str]()
    if relative_to is not None:
        changes = frozenset(names) - words.keys()
        one = _one_design(part, relative_to, dims)
        for name in changes:
            table[name] = _change(table[name].astype(float), float(one[name].values))
    for name, meant in words.items():
        table[name] = in_words(table[name], meant)
    curves, several = _left_out(part) if quantities is None else ((), {})
    return Rows(
        table,
        units={
            name: "percent" if name in changes else str(variable.attrs.get("units", ""))
            for name, variable in columns.items()
            if variable.dtype.kind in "fiu" and name not in words
        },
        texts={name: meaning_of(v.attrs) for name, v in columns.items()},
        given=tuple(name for name in columns if name not in names),
        fixed=fixed_of(archive, part),
        designs=math.prod(shape),
        curves=curves,
        changes=changes,
        elasticities=_elasticities(part, names),
        bands={n: (first[f"{n} low"], first[f"{n} high"]) for n in uncertain if ends},
        mainly=_mainly(part, uncertain),
        several=several,
        listed=tuple(d for d in dims if d in DIMENSIONS or d not in axes_of(part)),
    )


def _check_arguments(limit: object, select: object, relative_to: object) -> None:
    if not isinstance(limit, int) or limit < 1:
        raise SceneError(f"limit = {shown(limit)}: must be a whole number, 1 or more")
    axes = "must be values of axes, such as {'load': 50}"
    if select is not None and not isinstance(select, Mapping):
        raise SceneError(f"select = {shown(select)}: {axes}")
    if relative_to not in (None, NOMINAL) and not isinstance(relative_to, Mapping):
        raise SceneError(f"relative_to = {shown(relative_to)}: {axes}, or 'nominal'")


def _check_sort(sort: str | None, columns: Mapping[str, xr.Variable]) -> None:
    key = sort.removeprefix("-") if sort is not None else None
    if key is not None and key not in columns:
        raise SceneError(f"{shown(key)}: not a column of the table{not_known(key, columns)}")


def _names(part: xr.Dataset, quantities: str | Sequence[str] | None) -> list[str]:
    """Quantities of the table; by default without those that belong to bands."""
    names = chosen_quantities(part, quantities)
    check_one_table(part, names)
    curved = [n for n in names if CRANK_ANGLE in part[n].dims]
    if curved:
        raise SceneError(
            f"{curved[0]}: has no single number for each design; engine-dyn plot draws it, and "
            "engine-dyn export writes it"
        )
    if quantities is not None:
        return names
    of_bands = {n + end for n in names if n + SHARE in part for end in (LOW, HIGH, EXPLAINED)}
    if FAILED_DRAWS in names and not part[FAILED_DRAWS].values.any():
        of_bands.add(FAILED_DRAWS)
    return [n for n in names if n not in of_bands]


def _change(values: npt.NDArray[Any], base: float) -> npt.NDArray[Any]:
    """Changes from a value in percent; NaN where it is zero."""
    return 100.0 * (values / base - 1.0) if base else np.full(values.shape, np.nan)


def _elasticities(part: xr.Dataset, names: Sequence[str]) -> tuple[str, ...]:
    """Elasticities that are not in the table."""
    named = [str(name) for name in part.data_vars if PARAMETER in part[name].dims]
    return tuple(name for name in named if name.endswith(ELASTICITY) and name not in names)


def _left_out(part: xr.Dataset) -> tuple[tuple[str, ...], dict[str, tuple[str, ...]]]:
    """Names of curves, and of quantities with several numbers for each design, with examples."""
    curves: list[str] = []
    several: dict[str, tuple[str, ...]] = {}
    for name in of_designs(part):
        dims = part[name].dims
        over = [str(d) for d in dims if d in DIMENSIONS and d not in (PARAMETER, UNCERTAIN)]
        if CRANK_ANGLE in over:
            curves.append(name)
        elif over and all(dim in part.coords and part.sizes[dim] for dim in over):
            words = words_of(part)
            one = ",".join(f"{d}={_example(part[words.get(d, d)].values)}" for d in over)
            several[one] = (*several.get(one, ()), name)
    return tuple(curves), several


def _example(values: npt.NDArray[Any]) -> str:
    """One value of an axis, the second if there is one, as a person may select it."""
    value = values[min(1, values.size - 1)]
    return f"{value:g}" if values.dtype.kind in "iuf" else one_line(value, 40)


def _ends(part: xr.Dataset, uncertain: Sequence[str]) -> dict[str, xr.Variable]:
    """Ends of the bands of quantities, by names that no variable has."""
    return {
        f"{n} {end.removeprefix('_')}": part.variables[n + end]
        for n in uncertain
        for end in (LOW, HIGH)
    }


def _mainly(part: xr.Dataset, uncertain: Sequence[str]) -> dict[str, str]:
    """Uncertain parameters that make up most of the variance of each quantity, the largest first.

    They are as few as together have `MOSTLY` of the explained variance.
    """
    causes = {}
    for name in uncertain:
        share = part[name + SHARE]
        over = tuple(i for i, d in enumerate(share.dims) if d != UNCERTAIN)
        total = np.nansum(share.values, axis=over)
        if total.max(initial=0.0) > 0.0:
            order = np.argsort(-total, kind="stable")
            together = np.cumsum(total[order])
            few = order[: 1 + int(np.argmax(together >= MOSTLY * together[-1]))]
            *before, last = part[UNCERTAIN].values[few].tolist()
            causes[name] = f"{', '.join(before)} and {last}" if before else last
    return causes


def fixed_of(archive: xr.Dataset, part: xr.Dataset) -> dict[str, Any]:
    """The values at which axes of an archive were cut, by axis; a word for an axis of words."""
    fixed = {}
    for name, coordinate in part.coords.items():
        if coordinate.ndim == 0 and archive[name].ndim and f"{name}_name" not in part.coords:
            own = str(name).removesuffix("_name")
            fixed[own if own in part.coords else str(name)] = coordinate.values.item()
    return fixed


def _first(
    columns: Mapping[str, xr.Variable], dims: list[str], shape: list[int], sort: str | None,
    limit: int,
) -> dict[str, npt.NDArray[Any]]:  # fmt: skip
    """The first rows in the order of a column, or of the archive."""
    kept: dict[str, npt.NDArray[Any]] = {}
    for _, extent, arrays in ranges(columns, dims, shape, in_order=True):
        read = {n: np.broadcast_to(a, extent).reshape(-1) for n, a in arrays.items()}
        if sort is not None:
            read = _sorted(read, sort, limit)
        kept = {
            name: np.concatenate([kept[name], values[:limit]]) if kept else values[:limit]
            for name, values in read.items()
        }
        if sort is not None:
            kept = _sorted(kept, sort, limit)
        elif len(next(iter(kept.values()))) >= limit:
            break
    return {name: values[:limit] for name, values in kept.items()}


def _sorted(
    table: dict[str, npt.NDArray[Any]], sort: str, limit: int
) -> dict[str, npt.NDArray[Any]]:
    """The first rows in an order; equal ones in the order of the archive."""
    values = table[sort.removeprefix("-")]
    if values.dtype.kind in "fiu":
        numbers = values.astype(float)
        keys = -numbers if sort.startswith("-") else numbers
        missing = np.isnan(keys)
        order = np.lexsort((np.where(missing, 0.0, keys), missing))
    else:
        order = np.argsort(values.astype(str), kind="stable")
        order = order[::-1] if sort.startswith("-") else order
    return {name: column[order[:limit]] for name, column in table.items()}


def _one_design(
    part: xr.Dataset, relative_to: Mapping[str, float | str] | str, dims: list[str]
) -> xr.Dataset:
    """The design that changes are counted from."""
    if isinstance(relative_to, str):
        return part.isel(nominal_places(part, dims))
    if not relative_to:
        return part.isel({d: 0 for d in dims})
    one = nearest(part, **relative_to)
    left = [d for d in dims if d in one.dims and one.sizes[d] > 1]
    if left:
        raise SceneError(
            f"relative to {', '.join(f'{k}={v}' for k, v in relative_to.items())}: not a single "
            f"design; also give a value of {' and '.join(left)}"
        )
    return one.isel({d: 0 for d in one.dims if one.sizes[d] == 1})


NOMINAL = "nominal"


def nominal_places(archive: xr.Dataset, dims: list[str]) -> dict[str, int]:
    """Place along each axis of designs of the nominal design.

    It is the design that is named so, and the engine's own values of axes. SceneError refuses
    archives without such a name or value.
    """
    own = members_of(archive, "engine_values")
    places = {}
    for dim in dims:
        if archive.sizes[dim] == 1:
            places[dim] = 0
        elif dim == DESIGN:
            names = [
                list(map(str, archive[label].values)).index(NOMINAL)
                for label in LABELS
                if label in archive.coords and NOMINAL in archive[label].values
            ]
            if not names:
                raise SceneError("relative to nominal: no design is named 'nominal'")
            places[dim] = names[0]
        else:
            places[dim] = _own_place(archive, dim, own.get(dim))
    return places


def _own_place(archive: xr.Dataset, dim: str, value: float | None) -> int:
    """Place of the engine's own value on an axis."""
    if value is None:
        raise SceneError(
            f"relative to nominal: {dim}: the archive has no value of the engine for it; select "
            "the design by values of its axes instead"
        )
    near = np.flatnonzero(np.isclose(archive[dim].values.astype(float), value, rtol=1e-9))
    if not near.size:
        raise SceneError(
            f"relative to nominal: {dim} = {value:g}, the engine's own value, is not on the axis; "
            "select the design by values of its axes instead"
        )
    return int(near[0])
