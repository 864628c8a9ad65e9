"""Files of laboratories with bytes changed, and what a scene or an import may say of them."""

from __future__ import annotations

import io
import zipfile
from functools import cache
from typing import Any

import netCDF4
import numpy as np
from hypothesis import strategies as st

import sweeps
from benchmarks.fuzz.changes import changed, cut_up
from benchmarks.fuzz.checking import read_hostile
from benchmarks.fuzz.sandbox import names, sandbox
from benchmarks.fuzz.texts import in_scene
from sweeps.reading.laboratory.pressure_options import ImportOptions
from sweeps.reading.pressure_recordings import read_pressure

__all__ = ["check_measured_speed", "check_recording", "measured_speeds", "recordings"]

STEP = 4.0
"""Degrees: small files are read fast, and a change more often hits what steers the reading."""

_VALUES = st.one_of(
    st.sampled_from(
        ["p", "CA", "1", "9**9**9", "kPa", "V", "rev", "\x1b[2J", "", "BDC", "inlet", "compression",
         "low_pass", "savitzky_golay", "cycles", "gas exchange", "backward", ";", "tab", ",", True]
    ),
    st.integers(-3, 1000), st.floats(-720.0, 720.0), st.floats(),
    st.lists(st.floats(-10.0, 400.0), max_size=3), st.just(["CA", "p"]),
)  # fmt: skip


@cache
def good_recordings() -> dict[str, bytes]:
    """A sound recording of one cycle of each kind."""
    import pandas as pd
    from asammdf import MDF, Signal
    from nptdms import ChannelObject, TdmsWriter
    from scipy.io import savemat, wavfile

    angle = np.arange(-360.0, 360.0, STEP)
    pressure = 1.0 + 50.0 * np.exp(-((((angle + 350.0) % 720.0 - 360.0) / 30.0) ** 2))
    table = pd.DataFrame({"CA [deg]": angle, "p [bar]": pressure})
    home = sandbox() / "out"
    table.to_excel(home / "good.xlsx", index=False)
    table.to_parquet(home / "good.parquet")
    (home / "good.csv").write_text("Run;12\nCA;p\ndeg;bar\n" + table.to_csv(
        sep=";", decimal=",", index=False, header=False))  # fmt: skip
    for suffix, compressed in ((".mat", True), (".MAT", False)):
        savemat(home / f"good{suffix}", {"CA": angle, "p_bar": pressure}, do_compression=compressed)
    wavfile.write(home / "good.wav", 48_000, pressure.astype(np.float32))
    with TdmsWriter(home / "good.tdms") as writer:
        writer.write_segment(
            [
                ChannelObject("run", "CA", angle, {"unit_string": "deg"}),
                ChannelObject("run", "p", pressure, {"unit_string": "bar", "wf_increment": 0.01}),
            ]
        )
    with MDF(version="4.10") as file:
        times = 1e-3 * np.arange(len(angle))
        file.append([Signal(angle, times, name="CA", unit="deg"),
                     Signal(pressure, times, name="p", unit="bar")])  # fmt: skip
        file.save(home / "good.mf4")
    with netCDF4.Dataset(home / "good.nc", "w") as file:
        file.createDimension("n", len(angle))
        for name, unit, values in (("CA", "degree", angle), ("p", "bar", pressure)):
            variable = file.createVariable(name, "f8", ("n",))
            variable.units = unit
            variable[:] = values
    found = {path.suffix: path.read_bytes() for path in sorted(home.glob("good.*"))}
    for path in home.glob("good.*"):
        path.unlink()
    return found


@st.composite
def _parts_changed(draw: st.DrawFn, data: bytes) -> bytes:
    """An .xlsx file in which one of the texts is changed, so that it can still be unpacked."""
    made = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as old, zipfile.ZipFile(made, "w") as new:
        names = old.namelist()
        chosen = draw(st.sampled_from(names))
        for name in names:
            text = old.read(name)
            new.writestr(name, draw(cut_up(text)) if name == chosen else text)
    return made.getvalue()


def recordings() -> st.SearchStrategy[tuple[str, bytes, dict[str, Any]]]:
    """Suffix, bytes and options."""
    keys = st.sampled_from(sorted(ImportOptions.model_fields))
    options = st.one_of(st.just({}), st.dictionaries(keys, _VALUES, max_size=2))
    good = good_recordings()

    def changed(suffix: str) -> st.SearchStrategy[tuple[str, bytes, dict[str, Any]]]:
        kinds = [st.just(good[suffix]), cut_up(good[suffix])]
        if suffix == ".xlsx":
            kinds.append(_parts_changed(good[suffix]))
        return st.tuples(st.just(suffix), st.one_of(kinds), options)

    return st.sampled_from(sorted(good)).flatmap(changed)


def check_recording(example: tuple[str, bytes, dict[str, Any]]) -> None:
    suffix, data, options = example
    read_hostile(f"recording{suffix}", data, lambda path: read_pressure(path, **options).text())


# --- measured speeds, named by scenes -------------------------------------------------------------

TEETH = 11
"""Of a wheel 12-1: few, so that a change more often hits what matters."""

CYCLES, SAMPLES = 3, 1600


@cache
def _recordings() -> dict[str, bytes]:
    """A sound recording of each kind: three cycles at 1500 rpm, slower around firing."""
    angle = np.arange(-360.0, 360.0 * (2 * CYCLES - 1) + 1.0, 5.0)
    speed = 1500.0 - 40.0 * np.cos(np.deg2rad(0.5 * angle))
    time = np.arange(2 * CYCLES * 12) * 0.04 / 12.0
    time = time[np.arange(time.size) % 12 != TEETH]
    sampled = np.linspace(0.0, 0.04 * 2 * CYCLES, SAMPLES)
    wave = np.sin(2.0 * np.pi * sampled / (0.04 / 12.0))
    signal = np.where(np.floor(sampled / (0.04 / 12.0)) % 12 == TEETH, -1.0, wave)
    return {
        "speed": _text("crank angle [deg],speed [rpm]", angle, speed),
        "teeth": _text("time [s]", time),
        "encoder": _text("time [s],signal [V]", sampled, signal),
    }


def _text(head: str, *columns: np.ndarray[Any, Any]) -> bytes:
    lines = (",".join(f"{value:.7g}" for value in row) for row in zip(*columns, strict=True))
    return "\n".join([head, *lines, ""]).encode()


def _scene(kind: str) -> dict[str, Any]:
    wheel = {} if kind == "speed" else {"wheel": "12-1", "gap_angle": 10.0}
    measured = {"file": ["mutated.csv"] * 2, "kind": kind, "at": {"load": [50, 90]}, **wheel}
    return {"engine": "ntua", "axes": {"load": [50, 90]}, "output": {"quantities": ["delta"]},
            "measured": measured}  # fmt: skip


def measured_speeds() -> st.SearchStrategy[tuple[dict[str, Any], bytes]]:
    """Scene and recording."""

    def of(kind: str) -> st.SearchStrategy[tuple[dict[str, Any], bytes]]:
        scene, data = _scene(kind), _recordings()[kind]
        table = changed(scene["measured"], names())
        hostile = table.map(lambda tree: {**scene, "measured": tree})
        return st.one_of(st.tuples(hostile, st.just(data)), st.tuples(st.just(scene), cut_up(data)))

    return st.sampled_from(sorted(_recordings())).flatmap(of)


def check_measured_speed(example: tuple[dict[str, Any], bytes]) -> None:
    scene, data = example
    in_scene(data, scene, sweeps.measured)
