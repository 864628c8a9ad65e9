"""The columns of a flat table of an archive."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from engine_dyn.quantities.graph import DIMENSIONS
from engine_dyn.status import MEANINGS
from sweeps.base.arguments import names_given
from sweeps.base.dimensions import DESIGN, RANK, REDUCTION, STATE, words_of
from sweeps.base.errors import SceneError, not_known, shown
from sweeps.decide.explore.attributes import of_designs

if TYPE_CHECKING:
    import xarray as xr


def chosen_quantities(archive: xr.Dataset, quantities: str | Sequence[str] | None) -> list[str]:
    """Quantities of a table: those asked for, or all that have one number for each design.

    SceneError refuses names that the archive does not have or that are given twice, and archives
    without any such quantity.
    """
    if quantities is not None:
        quantities = names_given(quantities, "quantities")
    known = [str(n) for n in archive.data_vars if n != STATE]
    if quantities is None:
        names = [n for n in of_designs(archive) if not set(archive[n].dims) & set(DIMENSIONS)]
        if not names:
            none = "no quantity has one number per design"
            if REDUCTION in archive.attrs:
                none = "the archive was reduced, and no design was kept"
            raise SceneError(f"{none}; name the quantities to write, out of {', '.join(known)}")
        return names
    for i, name in enumerate(quantities):
        if name not in known:
            raise SceneError(
                f"{shown(name)}: not a quantity in the archive{not_known(name, known)}"
            )
        if name in quantities[:i]:
            raise SceneError(f"{name}: given twice; give each quantity once")
    if not quantities:
        raise SceneError("no quantities; at least one is needed")
    return list(quantities)


def chosen_curves(
    archive: xr.Dataset, quantities: str | Sequence[str] | None, over: Sequence[str]
) -> dict[str, xr.DataArray]:
    """Curves of a file of curves, by name, each over one of the dimensions `over`.

    Without `quantities` they are all that have one curve over the first of these for each design.
    SceneError refuses quantities that the archive does not have or that are no curves, and an
    archive without curves.
    """
    if quantities is None:
        quantities = [
            str(n)
            for n, v in archive.data_vars.items()
            if set(v.dims) & set(DIMENSIONS) == {over[0]}
        ]
        if not quantities:
            raise SceneError(
                f"archive: has no curve over {over[0]}; ask for torque or omega in [output]"
            )
    names = chosen_quantities(archive, quantities)
    for name in names:
        if not set(archive[name].dims) & set(over):
            raise SceneError(f"{name}: no curve; must lie over {' or '.join(over)}")
    return {name: archive[name] for name in names}


def check_one_table(archive: xr.Dataset, names: Sequence[str]) -> None:
    """Check that quantities with several numbers for each design have them over the same thing.

    SceneError refuses a curve beside the amplitudes of orders, say: their table would have a row
    for each pair of an angle and an order.
    """
    over = {name: [str(d) for d in archive[name].dims if d in DIMENSIONS] for name in names}
    widest = max(over, key=lambda name: len(over[name]))
    for name, dims in over.items():
        if not set(dims) <= set(over[widest]):
            raise SceneError(
                f"{widest} (over {', '.join(over[widest])}) and {name} (over {', '.join(dims)}) "
                "do not fit into one table; show or export one after the other"
            )


def has_single_numbers(archive: xr.Dataset) -> bool:
    """Whether a quantity beside the outcome has one number for each design."""
    return any(
        name != "status" and not set(archive[name].dims) & set(DIMENSIONS)
        for name in of_designs(archive)
    )


def dims_of(archive: xr.Dataset, names: Sequence[str]) -> list[str]:
    """Dimensions of some quantities, in the order of the archive."""
    used = {dim for name in names for dim in archive[name].dims}
    return [str(dim) for dim in archive.dims if dim in used]


def words_for_numbers(columns: Mapping[str, xr.Variable]) -> dict[str, npt.NDArray[Any]]:
    """Words that 0, 1, 2 ... stand for in the columns of the outcome and of verdicts."""
    words_of = {}
    for name, variable in columns.items():
        words = str(variable.attrs.get("flag_meanings", "")).split()
        values = np.atleast_1d(variable.attrs.get("flag_values", []))
        if name == "status":
            words_of[name] = np.array(MEANINGS, dtype=object)
        elif words and variable.dtype.kind == "f" and values.tolist() == [*range(len(words))]:
            words_of[name] = np.array(words, dtype=object)
    return words_of


def in_words(values: npt.NDArray[Any], words: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Words in place of the numbers of an outcome or verdict; empty where there is none."""
    known = np.isin(values, np.arange(len(words)))
    return np.where(known, words[np.where(known, values, 0).astype(np.int64)], "")


def columns_of(
    archive: xr.Dataset, dims: Sequence[str], names: Sequence[str]
) -> dict[str, xr.Variable]:
    """Variables of a table by the names of its columns: axes, columns of designs, quantities."""
    words = words_of(archive)
    columns: dict[str, xr.Variable] = {}
    for dimension in dims:
        # An axis of words has a coordinate of numbers and one of words; the words are shown.
        home = words.get(dimension, dimension)
        columns[dimension] = (
            archive.variables[home] if home in archive.coords else _numbered(archive, dimension)
        )
    for name, coordinate in archive.coords.items():
        if str(name) in (*dims, *words.values()) or not set(coordinate.dims) <= set(dims):
            continue
        # Where one word of an axis is chosen, it is shown, from the coordinate NAME_name.
        cut = coordinate.ndim == 0
        if (
            cut
            and str(name).endswith("_name")
            and str(name).removesuffix("_name") in archive.coords
        ):
            continue
        home = f"{name}_name" if cut and f"{name}_name" in archive.coords else str(name)
        columns[str(name)] = archive.variables[home]
    for shown_as, name in words.items():
        if shown_as not in columns and set(archive[name].dims) <= set(dims):
            columns[shown_as] = archive.variables[name]
    if DESIGN in dims and REDUCTION in archive.attrs:
        columns |= ranks_of(archive)
    return {**columns, **{name: archive.variables[name] for name in names}}


def ranks_of(archive: xr.Dataset) -> dict[str, xr.Variable]:
    """Ranks of the designs that a reduced archive kept, a column for each search.

    A design that a search did not keep has no number.
    """
    import xarray as xr

    if RANK not in archive or archive[RANK].ndim != 2:
        return {}
    ranks = archive[RANK].values
    texts = [str(text) for text in archive["search"].values]
    columns = {}
    for number, (values, text) in enumerate(zip(ranks, texts, strict=True), start=1):
        about = {"long_name": f"rank of {text}", "units": "1"}
        name = RANK if len(texts) == 1 else f"{RANK}_{number}"
        columns[name] = xr.Variable((DESIGN,), np.where(values > 0, values, np.nan), about)
    return columns


def _numbered(archive: xr.Dataset, dimension: str) -> xr.Variable:
    import xarray as xr

    return xr.Variable((dimension,), np.arange(archive.sizes[dimension]))
