"""Curves and orders as a universal file (UFF, ASCII): a data set 58 for each curve of a design."""

from __future__ import annotations

import errno
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from sweeps.base.errors import SceneError, counted, one_line
from sweeps.base.files.libraries import library
from sweeps.decide.explore.columns import chosen_curves, columns_of
from sweeps.decide.explore.order_table import order_table

if TYPE_CHECKING:
    import xarray as xr

CRANK_ANGLE, ORDER = "crank_angle", "order"

_KIND = {CRANK_ANGLE: 0, ORDER: 20}
"""Abscissas of curves, with the number that data set 58 has for each (0: no other)."""

_MOMENT = {"ordinate_spec_data_type": 1, "ordinate_len_unit_exp": 1, "ordinate_force_unit_exp": 1}

_ZERO = "phi = 0: firing dead centre of cylinder 1"
_SAYS = {
    CRANK_ANGLE: f"{_ZERO}; grows with the rotation",
    ORDER: f"Re[(re + i im) exp(i order phi)], {_ZERO}",
}
"""Last ID line: what the angle and the phase mean."""

MOST_SETS = 1000  # Data sets of a file; other programs list each of them


def universal_file(
    path: Path, archive: xr.Dataset, quantities: str | Sequence[str] | None, orders: str | None
) -> tuple[int, tuple[str, ...], tuple[str, ...]]:
    """Write curves over the crank angle or the order.

    Parameters
    ----------
    path : Path
        The file, which is empty or does not exist.
    archive : Dataset
        As `sweeps.open` returns it.
    quantities : str or sequence of str, optional
        Curves to write; all over the crank angle alone if not given.
    orders : str, optional
        In place of quantities: what to write the orders of, as complex values.

    Returns
    -------
    tuple of (int, tuple of str, tuple of str)
        Points, names of abscissas and curves, and curves that are left out because their design has
        no values.

    Raises
    ------
    SceneError
        For what is no curve, more than `MOST_SETS` data sets, and a curve of one point.
    OSError
        Where the file cannot be written.
    """
    if orders is None:
        curves = chosen_curves(archive, quantities, tuple(_KIND))
    else:
        table = order_table(archive, orders)
        values = table["real"] + 1j * table["imaginary"]
        curves = {orders: values.assign_attrs(archive[f"{orders}_order"].attrs)}
    over = {name: next(d for d in _KIND if d in curve.dims) for name, curve in curves.items()}
    sets = sum(curve.size // curve.sizes[over[name]] for name, curve in curves.items())
    if sets > MOST_SETS:
        raise SceneError(
            f"{counted(sets, 'data set')}; must be at most {MOST_SETS}; --select and --quantities "
            "take fewer"
        )
    pyuff = library("pyuff", "pyuff", str(path), "exchange")
    file, points, left_out = pyuff.UFF(str(path)), 0, []
    for name, curve in curves.items():
        for one, told in _designs(curve, over[name]):
            if np.isfinite(one.values).all():
                try:
                    file.write_sets(_data_set(name, over[name], one, told, archive.attrs), "add")
                except Exception as error:
                    raise OSError(errno.EIO, f"pyuff: {error}") from None
                points += one.size
            else:
                left_out.append(f"{name} ({told})" if told else name)
    return points, (*dict.fromkeys(over.values()), *curves), tuple(left_out)


def _designs(curve: xr.DataArray, over: str) -> Iterator[tuple[xr.DataArray, str]]:
    """Return the curve of each design, and of each cylinder or throw, with its conditions."""
    others = [d for d in curve.dims if d != over]
    if curve.sizes[over] < 2:
        raise SceneError(f"{curve.name or over}: one point over {over}; a curve needs two")
    for place in np.ndindex(*(curve.sizes[d] for d in others)):
        one = curve.isel(dict(zip(others, place, strict=True)))
        yield one, conditions(one)


def conditions(one: xr.DataArray) -> str:
    """Return the axes of a curve that have one value, such as "speed = 1500 rpm, load = 50 %"."""
    parts = []
    for name, variable in columns_of(one.to_dataset(name="curve"), [], []).items():
        value, unit = variable.values.item(), variable.attrs.get("units", "1")
        text = f"{value:.6g}" if isinstance(value, float) else str(value)
        parts.append(f"{name} = {text}" + (f" {unit}" if unit not in ("1", "") else ""))
    return ", ".join(parts)


def _data_set(
    name: str, over: str, one: xr.DataArray, told: str, about: dict[str, Any]
) -> dict[str, Any]:
    """Return one data set 58 in pyuff's words."""
    x = one[over].values.astype(np.float64)
    unit = _unit(one)
    lines = (f"{name}: {one.attrs.get('long_name', '')}", about.get("engine_title"), None, told,
             _SAYS[over])  # fmt: skip
    return {
        "type": 58, "binary": 0, "func_type": 0,
        **{f"id{place}": _field(line or "NONE", 80) for place, line in enumerate(lines, start=1)},
        "rsp_node": 0, "rsp_dir": 0, "ref_node": 0, "ref_dir": 0,
        "abscissa_spacing": int(_is_even(x)), "abscissa_spec_data_type": _KIND[over],
        "abscissa_axis_lab": over, "abscissa_axis_units_lab": _field(_unit(one[over]), 20),
        "ordinate_axis_lab": _field(name, 20), "ordinate_axis_units_lab": _field(unit, 20),
        "orddenom_spec_data_type": 0, **(_MOMENT if unit == "N m" else {}),
        "x": x, "data": one.values,
    }  # fmt: skip


def _unit(one: xr.DataArray) -> str:
    return str(one.attrs.get("units", "1"))


def _field(text: str, width: int) -> str:
    """Return a text that fits into its place in a line: ASCII alone, not longer."""
    return one_line(text.encode("ascii", "replace").decode(), width)


def _is_even(x: npt.NDArray[np.float64]) -> bool:
    """Whether a start and a step of six digits, which are all that the file has, give the values.

    Else each value is written, with six digits.
    """
    start, step = float(f"{x[0]:.5e}"), float(f"{x[1] - x[0]:.5e}")
    error = np.abs(start + step * np.arange(len(x)) - x).max()
    return bool(error <= 1e-9 * math.fabs(x[-1] - x[0]))
