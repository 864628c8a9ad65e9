"""Curves for other programs: orders as a table, universal files (UFF, ASCII), and FMUs.

A universal file has a data set 58 for each curve of a design. An FMU (FMI 2.0,
co-simulation), which pythonfmu builds, has the curves of one design as outputs.
"""

from __future__ import annotations

import errno
import json
import math
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from engine_dyn.units import DEGREE
from sweeps.base.errors import SceneError, counted, not_known, one_line, shown
from sweeps.base.files.libraries import library
from sweeps.base.naming import meaning_of
from sweeps.decide.explore.columns import chosen_curves, columns_of

if TYPE_CHECKING:
    import xarray as xr

CRANK_ANGLE, ORDER = "crank_angle", "order"

_KIND = {CRANK_ANGLE: 0, ORDER: 20}
"""Abscissas of curves, with the number that data set 58 has for each (0: no other)."""

MOST_SETS = 1000  # Largest number of data sets in a universal file; its readers list each of them


def universal_file(
    path: Path, archive: xr.Dataset, quantities: str | Sequence[str] | None, orders: str | None
) -> tuple[int, tuple[str, ...], tuple[str, ...]]:
    """Write curves over the crank angle or the order, or orders of a quantity as complex values.

    Without `quantities` all curves over the crank angle alone are written. Returned are the number
    of points, the names of abscissas and curves, and the curves that are left out because their
    design has no values.

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
    file, points, left_out = library("pyuff", "pyuff", str(path), "exchange").UFF(str(path)), 0, []
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
    # The last ID line of a data set says what the crank angle and the phase mean.
    zero_of_angle = "phi = 0: firing dead centre of cylinder 1"
    says = {
        CRANK_ANGLE: f"{zero_of_angle}; grows with the rotation",
        ORDER: f"Re[(re + i im) exp(i order phi)], {zero_of_angle}",
    }
    lines = (f"{name}: {meaning_of(one.attrs)}", about.get("engine_title"), None, told,
             says[over])  # fmt: skip
    of_moments = ("ordinate_spec_data_type", "ordinate_len_unit_exp", "ordinate_force_unit_exp")
    return {
        "type": 58, "binary": 0, "func_type": 0,
        **{f"id{place}": _field(line or "NONE", 80) for place, line in enumerate(lines, start=1)},
        "rsp_node": 0, "rsp_dir": 0, "ref_node": 0, "ref_dir": 0,
        "abscissa_spacing": int(_is_even(x)), "abscissa_spec_data_type": _KIND[over],
        "abscissa_axis_lab": over, "abscissa_axis_units_lab": _field(_unit(one[over]), 20),
        "ordinate_axis_lab": _field(name, 20), "ordinate_axis_units_lab": _field(unit, 20),
        "orddenom_spec_data_type": 0, **(dict.fromkeys(of_moments, 1) if unit == "N m" else {}),
        "x": x, "data": one.values,
    }  # fmt: skip


def _unit(one: xr.DataArray) -> str:
    return str(one.attrs.get("units", "1"))


def _field(text: str, width: int) -> str:
    """A text that fits into its field in a line: ASCII alone, and not longer."""
    return one_line(text.encode("ascii", "replace").decode(), width)


def _is_even(x: npt.NDArray[np.float64]) -> bool:
    """Whether a start and a step of six digits, all that the file can hold, give the values."""
    # If start and step do not give the values, each value is written, with six digits.
    start, step = float(f"{x[0]:.5e}"), float(f"{x[1] - x[0]:.5e}")
    error = np.abs(start + step * np.arange(len(x)) - x).max()
    return bool(error <= 1e-9 * math.fabs(x[-1] - x[0]))


CONVENTION = "order_convention"  # Attribute with the lines that say what amplitude and phase mean

FREQUENCY = "order_frequency"

COLUMNS = (FREQUENCY, "amplitude", "phase", "real", "imaginary")
"""Quantities of the table, over the axes of designs and `order`."""


def order_table(archive: xr.Dataset, quantity: str) -> xr.Dataset:
    """Orders of a quantity, such as "torque": the variables of `COLUMNS`, with the convention.

    Raises
    ------
    SceneError
        Where the archive lacks QUANTITY_order, QUANTITY_phase or order_frequency.
    """
    known = [
        name.removesuffix("_order")
        for name in map(str, archive.data_vars)
        if name.endswith("_order") and f"{name.removesuffix('_order')}_phase" in archive
    ]
    if quantity not in known:
        raise SceneError(
            f"orders of {shown(quantity)}: not in the archive{not_known(quantity, known)}; ask for "
            f"{one_line(quantity, 60)}_order, {one_line(quantity, 60)}_phase, {FREQUENCY} in "
            "[output]"
        )
    if FREQUENCY not in archive:
        raise SceneError(f"archive: has no {FREQUENCY}; ask for it in [output]")
    amplitude, phase = archive[f"{quantity}_order"], archive[f"{quantity}_phase"]
    unit = str(amplitude.attrs.get("units", "1"))
    angle = phase * (1.0 if phase.attrs.get("units") == "rad" else DEGREE)
    parts = {
        FREQUENCY: archive[FREQUENCY],
        "amplitude": amplitude,
        "phase": phase,
        "real": (amplitude * np.cos(angle)).assign_attrs(units=unit),
        "imaginary": (amplitude * np.sin(angle)).assign_attrs(units=unit),
    }
    taken = [f"{quantity}_order", f"{quantity}_phase", FREQUENCY]
    units = ", ".join(f"{name} [{part.attrs.get('units', '1')}]" for name, part in parts.items())
    lines = (
        f"{quantity}: {meaning_of(amplitude.attrs, 'amplitude of its orders')}",
        "an order is amplitude cos(order phi + phase) = Re((real + i imaginary) exp(i order phi))",
        "phi: crank angle in the sense of rotation; 0 at firing top dead centre of cylinder 1",
        "sign: a torque is positive in the sense of rotation; its mean is left out",
        f"order: periods per turn of the crank; {units}",
    )
    made = archive[taken].drop_vars(taken).assign(parts)
    return made.assign_attrs({CONVENTION: "\n".join(lines)})


ZERO = (
    "angle zero is firing top dead centre of cylinder 1; angles and torques are positive in the "
    "sense of rotation"
)


def functional_mockup_unit(
    path: Path, archive: xr.Dataset, quantities: str | Sequence[str] | None, orders: str | None
) -> tuple[int, tuple[str, ...], tuple[str, ...]]:
    """Write an FMU with curves of one design as outputs, over an angle or a time that is given.

    Without `quantities` all curves over the crank angle alone are written; `orders` are refused.
    Returned are the points of a curve, the names of the angle and the curves, and an empty tuple.

    Raises
    ------
    SceneError
        For what is no curve, several designs, and a design without values.
    """
    if orders is not None:
        raise SceneError("orders: an FMU has curves over the crank angle; write .uff or .csv")
    curves = chosen_curves(archive, quantities, (CRANK_ANGLE,))
    for name, curve in curves.items():
        for dim in curve.dims:
            if dim != CRANK_ANGLE and curve.sizes[dim] != 1:
                raise SceneError(
                    f"{name}: has {curve.sizes[dim]} values of {dim}, but an FMU has one design; "
                    f"--select {dim}=... takes one"
                )
        if not np.isfinite(curve.values).all():
            raise SceneError(f"{name}: has no values in this design")
    angle = archive[CRANK_ANGLE].values
    count, step = len(angle), float(np.ptp(angle)) / max(len(angle) - 1, 1)
    turns = count * step / 360.0
    if count < 4 or np.ptp(np.diff(angle)) > 1e-9 or abs(turns - round(turns)) > 1e-9:
        raise SceneError(f"{CRANK_ANGLE}: must be even steps of whole revolutions")
    told = conditions(next(iter(curves.values())).squeeze())
    title = str(archive.attrs.get("engine_title", "engine"))
    table = {
        "description": one_line(f"{title}; {told}; {ZERO}" if told else f"{title}; {ZERO}"),
        "start": float(angle[0]) * DEGREE,
        "step": step * DEGREE,
        "curves": {
            name: {
                "unit": _fmi_unit(str(curve.attrs.get("units", "1"))),
                "description": one_line(meaning_of(curve.attrs, name)),
                "values": curve.values.reshape(count).tolist(),
            }
            for name, curve in curves.items()
        },
    }
    _build(path, json.dumps(table))
    return count, (CRANK_ANGLE, *curves), ()


def _fmi_unit(text: str) -> str:
    """A unit as FMUs write it: N.m for "N m", rad/s2 for "rad s-2"."""
    above = [part for part in text.split() if "-" not in part]
    below = [part.replace("-", "").removesuffix("1") for part in text.split() if "-" in part]
    return "/".join([".".join(above) or "1", *below])


def _build(path: Path, table: str) -> None:
    """Build the FMU of a table in a folder of its own, and copy it."""
    # The FMU contains a copy of this script, which therefore imports nothing of this project.
    slave = Path(__file__).with_name("fmu_slave.py")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        text = slave.read_text(encoding="utf-8")
        (folder / "crank_angle_curves.py").write_text(text, encoding="utf-8")
        (folder / "table.json").write_text(table, encoding="utf-8")
        words = ["build", "-f", "crank_angle_curves.py", "-d", "made.fmu", "table.json"]
        done = subprocess.run(
            [sys.executable, "-m", "pythonfmu", *words], cwd=folder, capture_output=True, text=True,
            check=False,
        )  # fmt: skip
        if done.returncode:
            raise SceneError(f"pythonfmu builds no FMU: {one_line(done.stderr[-300:])}")
        shutil.copyfile(folder / "made.fmu", path)
