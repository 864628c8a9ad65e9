"""Sound files, which the fuzzer makes hostile: archives, interrupted runs, tables, recordings."""

from __future__ import annotations

import itertools
from contextlib import suppress
from functools import cache
from typing import Any
from unittest import mock

import netCDF4
import numpy as np

from benchmarks.fuzz.hostile import FILES, PRESSURE, sandbox
from sweeps.catalogue import ENGINES
from sweeps.running.archive import netcdf
from sweeps.running.archive.labels import label
from sweeps.running.archive.partial import Partial
from sweeps.running.compute import into_archive, limits
from sweeps.running.compute.options import Options, Stopped
from sweeps.scene.plan.plan import make_plan
from sweeps.scene.plan.shards import shard
from sweeps.scene.reading import read_scene

_SMALL = {
    "title": "small",
    "engine": "diesel_105x137",
    "axes": {"speed": [1500, 1600, 1700], "inertia": [1.0, 2.0]},
    "solver": {"method": ["auto", "newton"]},
    "output": {"quantities": ["delta", "omega", "imep", "gas_torque"], "angle_step": 30},
}

PLAIN = {
    "engine": "diesel_105x137",
    "axes": {
        "speed": {"start": 1000, "stop": 2000, "num": 40},
        "stroke": {"start": 0.1, "stop": 0.2, "num": 40},
    },
    "output": {"quantities": ["mean_piston_speed"]},
}
"""A scene that needs no compiled kernel."""


@cache
def good_archive(part: bool = False) -> bytes:
    """An archive whose numbers nobody computed."""
    plan = make_plan(read_scene(_SMALL))
    if part:
        plan = shard(plan, 1, 3)
    shapes = {name: tuple(plan.sizes[d] for d in plan.dims(name)) for name in plan.outputs}
    results = {name: 1.0 + np.indices(shape).sum(0) for name, shape in shapes.items()}
    results["status"] = np.zeros(shapes["status"], "i1")
    path = sandbox() / "good.nc"
    netcdf.write(label(plan, results, seconds=1.0), path, overwrite=True)
    data = path.read_bytes()
    path.unlink()
    return data


@cache
def attributes_of_archive(part: bool) -> dict[str, Any]:
    """Attributes of such an archive."""
    path = sandbox() / "good.nc"
    path.write_bytes(good_archive(part))
    with netCDF4.Dataset(path) as file:
        found = {n: file.getncattr(n) for n in file.ncattrs()}
    path.unlink()
    return found


@cache
def good_partial() -> dict[str, bytes]:
    """Files of an interrupted run."""
    output = sandbox() / "out" / "interrupted.nc"
    write, numbers = Partial.write, itertools.count()

    def until(self: Partial, *arguments: Any) -> int:
        if next(numbers) == 3:
            raise KeyboardInterrupt
        return write(self, *arguments)

    with (
        mock.patch.object(limits, "LARGEST_BLOCK", 4e3),
        mock.patch.object(Partial, "write", until),
        suppress(Stopped),
    ):
        into_archive.run(make_plan(read_scene(PLAIN)), output, Options())
    folder = Partial.of(output)
    found = {p.name: p.read_bytes() for p in folder.path.iterdir() if p.name != "lock"}
    folder.remove()
    return found


@cache
def good_files() -> dict[str, bytes]:
    """A table of designs of each binary kind, and a recording of one cycle of each kind."""
    import pandas as pd
    from asammdf import MDF, Signal
    from nptdms import ChannelObject, TdmsWriter
    from pyuff import UFF
    from scipy.io import savemat, wavfile

    # Few angles: small files are read fast, and a change more often hits what steers the reading.
    angle = np.arange(-360.0, 360.0, 4.0)
    pressure = 1.0 + 50.0 * np.exp(-((((angle + 350.0) % 720.0 - 360.0) / 30.0) ** 2))
    table = pd.DataFrame({"CA [deg]": angle, "p [bar]": pressure})
    home = sandbox() / "out"
    pd.DataFrame({"bore": [0.1, 0.11], "case": ["a", "b"]}).to_parquet(home / "table.parquet")
    table.to_excel(home / "good.xlsx", index=False)
    table.to_parquet(home / "good.parquet")
    (home / "good.csv").write_text("Run;12\nCA;p\ndeg;bar\n" + table.to_csv(
        sep=";", decimal=",", index=False, header=False))  # fmt: skip
    for suffix, compressed in ((".mat", True), (".MAT", False)):
        savemat(home / f"good{suffix}", {"CA": angle, "p_bar": pressure}, do_compression=compressed)
    wavfile.write(home / "good.wav", 48_000, pressure.astype(np.float32))
    units = {"unit_string": "bar", "wf_increment": 0.01}
    with TdmsWriter(home / "good.tdms") as writer:
        writer.write_segment([
            ChannelObject("run", "CA", angle, {"unit_string": "deg"}),
            ChannelObject("run", "p", pressure, units),
        ])  # fmt: skip
    with MDF(version="4.10") as file:
        times = 1e-3 * np.arange(len(angle))
        file.append([Signal(angle, times, name="CA", unit="deg"),
                     Signal(pressure, times, name="p", unit="bar")])  # fmt: skip
        file.save(home / "good.mf4")
    one = {"type": 58, "binary": 0, "func_type": 0, "rsp_node": 0, "rsp_dir": 0, "ref_node": 0,
           "ref_dir": 0, "abscissa_spacing": 1, "orddenom_spec_data_type": 0, "x": angle,
           "abscissa_axis_lab": "CA", "abscissa_axis_units_lab": "deg", "ordinate_axis_lab": "p",
           "ordinate_axis_units_lab": "bar", "data": pressure}  # fmt: skip
    UFF(str(home / "good.uff")).write_sets([one, one | {"data": 1j * pressure}])
    for name, columns in (
        ("good.nc", {"CA": ("degree", angle), "p": ("bar", pressure)}),
        ("table.nc", {"bore": ("m", np.array([0.1, 0.11, 0.12]))}),
    ):  # fmt: skip
        with netCDF4.Dataset(home / name, "w") as file:
            for variable, (unit, values) in columns.items():
                if "n" not in file.dimensions:
                    file.createDimension("n", len(values))
                made = file.createVariable(variable, "f8", ("n",))
                made.units = unit
                made[:] = values
    paths = [p for pattern in ("good.*", "table.*") for p in sorted(home.glob(pattern))]
    found = {path.name: path.read_bytes() for path in paths}
    for path in paths:
        path.unlink()
    return found


def _text(head: str, *columns: Any) -> bytes:
    lines = (",".join(f"{value:.7g}" for value in row) for row in zip(*columns, strict=True))
    return "\n".join([head, *lines, ""]).encode()


def _measured() -> dict[str, bytes]:
    """Recordings of three cycles at 1500 rpm, slower around firing, with a wheel 12-1."""
    cycles, teeth = 3, 11
    angle = np.arange(-360.0, 360.0 * (2 * cycles - 1) + 1.0, 5.0)
    speed = 1500.0 - 40.0 * np.cos(np.deg2rad(0.5 * angle))
    time = np.arange(2 * cycles * 12) * 0.04 / 12.0
    sampled = np.linspace(0.0, 0.04 * 2 * cycles, 1600)
    place = sampled / (0.04 / 12.0)
    signal = np.where(np.floor(place) % 12 == teeth, -1.0, np.sin(2.0 * np.pi * place))
    return {
        "speed": _text("crank angle [deg],speed [rpm]", angle, speed),
        "teeth": _text("time [s]", time[np.arange(time.size) % 12 != teeth]),
        "encoder": _text("time [s],signal [V]", sampled, signal),
    }


@cache
def good_texts() -> dict[str, tuple[bytes, dict[str, Any]]]:
    """CSV files, and what names them in a scene."""
    designs = {"case": ["one", "two"], "bore": [0.14, 0.15]}
    wheel = {"wheel": "12-1", "gap_angle": 10.0}
    file = {"file": "mutated.csv"}
    return {
        "indicator": ((ENGINES / PRESSURE).read_bytes(), {"indicator": file}),
        "load": (FILES["load.csv"], {"set": {"load_table": "mutated.csv"}}),
        "driver": (FILES["driver.csv"], {"set": {"driver_table": "mutated.csv"}}),
        "designs": (FILES["designs.csv"], {"designs": file}),
        "reference": (FILES["published.csv"], {
            "axes": {"speed": [1000, 1200], "inertia": [1, 9]}, "designs": designs,
            "reference": file,
        }),
        **{
            kind: (data, {
                "axes": {"load": [50, 90]},
                "measured": {"file": ["mutated.csv"] * 2, "kind": kind, "at": {"load": [50, 90]},
                             **({} if kind == "speed" else wheel)},
            })
            for kind, data in _measured().items()
        },
    }  # fmt: skip
