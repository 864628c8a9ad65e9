"""Curves over the crank angle as an FMU (FMI 2.0, co-simulation), which pythonfmu builds."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from engine_dyn.units import DEGREE
from sweeps.base.errors import SceneError, one_line
from sweeps.decide.explore.columns import chosen_curves
from sweeps.decide.explore.universal_files import CRANK_ANGLE, conditions

if TYPE_CHECKING:
    import xarray as xr

SLAVE = Path(__file__).with_name("fmu_slave.py")
"""The script inside, which imports nothing of this project."""

ZERO = (
    "angle zero is firing top dead centre of cylinder 1; angles and torques are positive in the "
    "sense of rotation"
)


def functional_mockup_unit(
    path: Path, archive: xr.Dataset, quantities: str | Sequence[str] | None, orders: str | None
) -> tuple[int, tuple[str, ...], tuple[str, ...]]:
    """Write an FMU with curves of one design as outputs, over an angle or a time that is given.

    Parameters
    ----------
    path : Path
        The file.
    archive : Dataset
        As `sweeps.open` returns it, of one design.
    quantities : str or sequence of str, optional
        Curves to write; all over the crank angle alone if not given.
    orders : str, optional
        None: an FMU has no orders.

    Returns
    -------
    tuple of (int, tuple of str, tuple of str)
        Points of a curve, names of the angle and the curves, and an empty tuple.

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
                "description": one_line(curve.attrs.get("long_name", name)),
                "values": curve.values.reshape(count).tolist(),
            }
            for name, curve in curves.items()
        },
    }
    _build(path, json.dumps(table))
    return count, (CRANK_ANGLE, *curves), ()


def _fmi_unit(text: str) -> str:
    """Return a unit as FMUs write it: N.m of "N m", rad/s2 of "rad s-2"."""
    above = [part for part in text.split() if "-" not in part]
    below = [part.replace("-", "").removesuffix("1") for part in text.split() if "-" in part]
    return "/".join([".".join(above) or "1", *below])


def _build(path: Path, table: str) -> None:
    """Build the FMU of a table in a folder of its own, and copy it."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        text = SLAVE.read_text(encoding="utf-8")
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
