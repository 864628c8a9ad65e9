"""Measured speed beside computed: recordings of engines whose speed is known."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import sweeps
from engine_dyn.geometry.toothed_wheel import wheel_from_text
from sweeps.lab.speed.measured_files import records_of
from sweeps.lab.speed.recorded_speeds import cycles_in_a_row
from sweeps.scene.reading import read_scene
from tests.support.scenes import refusal_of, write_scene
from tests.support.teeth import SampledEngine, noisy, random_errors, tooth_times, write_times

LOADS = [20, 50, 80]
GAP = 100.0  # degree
WHEEL = wheel_from_text("60-2")
ERRORS = random_errors(WHEEL.width, 0.005, 11)
CYCLES = 12
SCENE: dict[str, Any] = {
    "engine": "ntua", "set": {"speed": 1200}, "axes": {"load": LOADS},
    "output": {"quantities": ["omega", "delta"]},
}  # fmt: skip


@pytest.fixture(scope="module")
def computed() -> xr.Dataset:
    return sweeps.run(SCENE)


def stamps(
    computed: xr.Dataset, load: int, first_turn: int = 0, seed: int = 0, errors: np.ndarray = ERRORS
) -> np.ndarray:
    """Times of teeth; single intervals differ by a random factor of a tenth of a %."""
    angle = np.deg2rad(computed.crank_angle.values)
    engine = SampledEngine(angle, computed.omega.sel(load=load).values)
    gap = np.deg2rad(GAP) + 2 * np.pi * first_turn
    times = tooth_times(engine, WHEEL.width, 2 * CYCLES + 1, gap, errors)
    return noisy(times, 0.001, np.random.default_rng(seed))


def scene_with(folder: Path, name: str = "scene.toml", **keys: Any) -> Path:
    given = {"set": {"speed": 1200}, "axes": {"load": LOADS}, "measured": keys}
    return write_scene(folder / name, **given)


@pytest.fixture(scope="module")
def teeth(tmp_path_factory: pytest.TempPathFactory, computed: xr.Dataset) -> Path:
    folder = tmp_path_factory.mktemp("teeth")
    for place, load in enumerate(LOADS):
        times = stamps(computed, load, first_turn=place % 2, seed=load)
        write_times(folder / f"teeth_{load}.csv", times)
    return folder


FILES = [f"teeth_{load}.csv" for load in LOADS]


@pytest.fixture(scope="module")
def compared(teeth: Path) -> xr.Dataset:
    path = scene_with(teeth, file=FILES, kind="teeth", wheel="60-2", at={"load": LOADS})
    return sweeps.measured(path)


def test_computed_speed_is_found_again_with_its_orders(
    compared: xr.Dataset, computed: xr.Dataset
) -> None:
    """Corrected delta agrees with the computed one within three standard errors, for each load."""
    between = np.ptp(compared.omega_between_teeth.values, axis=1)
    between /= compared.omega_between_teeth.values.mean(axis=1)
    off = np.abs(compared.delta_measured.values - between)
    assert np.all(off < 3 * compared.delta_measured_uncertainty.values + 3e-4)
    assert np.all(compared.delta_measured_raw > compared.delta_measured)
    assert np.allclose(compared.delta, computed.delta, rtol=1e-4)
    assert np.all(compared.correlation > 0.995)
    assert np.all(compared.correlation_raw > 0.995)
    assert compared["load"].values.tolist() == LOADS
    assert compared.recorded_cycles.values.tolist() == [CYCLES] * 3
    omega = computed.omega.sel(load=80).values
    angle = np.deg2rad(computed.crank_angle.values)
    for order in (0.5, 1.0, 1.5, 6.0):
        wave = 2 * np.mean(omega * np.exp(-1j * order * angle))
        found = compared.isel(recording=2).sel(order=order)
        assert float(found.omega_order) == pytest.approx(abs(wave), rel=1e-6)
        assert float(found.omega_measured_order) == pytest.approx(
            abs(wave), abs=0.002 * omega.mean() / np.sqrt(116 * CYCLES) * 6
        )


def test_curves_over_the_crank_angle_gap_and_teeth(compared: xr.Dataset) -> None:
    off = (compared.omega_measured - compared.omega) / compared.omega.mean("crank_angle")
    assert float(np.abs(off).max()) < 0.004
    assert float(off.std()) < 0.0008
    # each interval has its own random time of 0.1 %
    scatter = float(compared.omega_raw_std.mean() / compared.omega.mean())
    assert scatter == pytest.approx(0.001, rel=0.1)
    assert compared.attrs["gap_angle"] == pytest.approx(GAP, abs=0.5)
    assert "estimated, not measured" in compared.attrs["gap_angle_from"]
    off = compared.tooth_error.values - ERRORS
    assert np.corrcoef(compared.tooth_error, ERRORS)[0, 1] > 0.98
    assert np.std(off) < 0.2 * np.std(ERRORS)


def test_teeth_far_off_beside_the_gap_are_left_out(tmp_path: Path, computed: xr.Dataset) -> None:
    """As inductive sensors see them; the tooth times of the gap's neighbours are off by 15 %."""
    errors = ERRORS.copy()
    errors[0], errors[-2] = -0.15, -0.09
    errors[-1] += (ERRORS[0] + 0.15 + ERRORS[-2] + 0.09) / 3.0
    for load in LOADS:
        times = stamps(computed, load, seed=load, errors=errors)
        text = "\n".join(f"{one:.9f}" for one in times)
        (tmp_path / f"teeth_{load}.csv").write_text("time [s]\n" + text + "\n")
    found = sweeps.measured(
        scene_with(tmp_path, file=FILES, kind="teeth", wheel="60-2", at={"load": LOADS})
    )
    assert "intervals 1, 57, 58 of 58" in found.attrs["remarks"]
    assert found.interval_used.values.sum() == 116 - 6
    assert np.all(np.abs(found.delta_measured - found.delta) < 0.002)
    # sound teeth are all nearly 15 % of a pitch before their places behind the first one
    aside = np.rad2deg(np.cumsum(WHEEL.width * errors)[:-3]).mean()
    assert aside < -0.7
    assert found.attrs["gap_angle"] == pytest.approx(GAP + aside, abs=0.2)
    off = (found.omega_measured - found.omega) / found.omega.mean("crank_angle")
    assert float(np.abs(off).max()) < 0.005


@pytest.mark.parametrize("style", ["one cycle", "running on", "descending", "wraps"])
def test_speed_over_angle(tmp_path: Path, computed: xr.Dataset, style: str) -> None:
    omega = computed.omega.sel(load=50).values
    angle = computed.crank_angle.values
    rpm = omega * 30 / np.pi
    if style == "running on":
        angle = np.arange(-100.0, 3 * 720 - 100.0)
        rpm = np.interp(angle, computed.crank_angle.values, omega, period=720) * 30 / np.pi
    if style == "descending":
        angle, rpm = angle[::-1], rpm[::-1]
    if style == "wraps":  # 0 to 720 again and again, both ends written
        angle = np.tile(np.arange(721.0), 3)
        rpm = np.interp(angle, computed.crank_angle.values, omega, period=720) * 30 / np.pi
    rows = "\n".join(f"{a:g},{v:.6f}" for a, v in zip(angle, rpm, strict=True))
    (tmp_path / "speed.csv").write_text("crank angle [deg],speed [rpm]\n" + rows + "\n")
    found = sweeps.measured(scene_with(tmp_path, file="speed.csv", kind="speed", at={"load": 50}))
    assert float(found.correlation[0]) == pytest.approx(1.0, abs=1e-6)
    assert float(found.delta_measured[0]) == pytest.approx(
        float(computed.delta.sel(load=50)), rel=1e-3
    )
    assert int(found.recorded_cycles[0]) == (2 if style in ("running on", "wraps") else 1)
    assert "tooth_error" not in found


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"wheel": "36-1"}, "do not fit 36-1 .35 teeth a turn.; found: wheel = .60-2."),
        ({"wheel": "sixty"}, "is not a pattern"),
        ({"wheel": None}, "wheel: missing"),
        ({"kind": "speed"}, "not allowed with kind = 'speed'"),
        ({"kind": "sound"}, "kind"),
        ({"file": "none.csv"}, "none.csv"),
        ({"file": "../teeth.csv"}, "leads outside the folder"),
        ({"at": {}}, "varies load"),
        ({"at": {"load": 30}}, "must be among them"),
        ({"at": {"inertia": 30}}, "not an axis"),
        ({"at": {"load": [20, 50]}}, "2 values for 1 files"),
        ({"tooth_errors": "others"}, "there is only one file"),
        ({"tooth_errors": "some"}, "must be one of others, all, none"),
        ({"tooth_errors": [0.1]}, "must be 58"),
        ({"column": 3}, "must be 1 to 1"),
        ({"column": "teeth"}, "no such column"),
        ({"unit": "furlong"}, "is not a unit of time"),
        ({"gap_angle": 1000.0}, "gap_angle"),
        ({"colour": "red"}, "colour"),
    ],
)
def test_bad_input_is_one_line(teeth: Path, keys: dict[str, Any], said: str) -> None:
    given = {"file": FILES[0], "kind": "teeth", "wheel": "60-2", "at": {"load": 20}, **keys}
    path = scene_with(teeth, "bad.toml", **{k: v for k, v in given.items() if v is not None})
    line = refusal_of(lambda: sweeps.measured(path))
    assert re.search(said, line)
    assert "bad.toml" in line


@pytest.mark.parametrize(
    ("text", "kind", "said"),
    [
        ("time [s]\n0.1\n0.3\n0.2\n", "teeth", "number 3 "),
        ("time [s],a,b\n" + "0,1,2\n" * 5, "encoder", "column: ambiguous|does not ascend"),
        (
            "time [s],speed [rpm]\n" + "0,1500\n" * 5,
            "speed",
            "angle_column: ambig.*time_column in its place",
        ),
        ("time [s],encoder\n0,1\n1,1\n5,1\n", "encoder", "equally far apart"),
        ("angle [deg],speed\n0,1\n1,1\n2,1\n", "speed", "must span a cycle"),
        ("angle [deg],speed\n" + "".join(f"{i},0\n" for i in range(720)), "speed", "more than 0"),
        (
            "angle,speed\n" + "".join(f"{a % 360},90\n" for a in range(0, 1440, 5)),
            "speed",
            "begins again after 360 degrees",
        ),
        ("angle [deg],speed\n0,1\n2,1\n1,1\n5,2\n", "speed", "line 4: the crank angle goes"),
    ],
)
def test_bad_recordings_are_one_line(tmp_path: Path, text: str, kind: str, said: str) -> None:
    (tmp_path / "raw.csv").write_text(text)
    keys: dict[str, Any] = {"file": "raw.csv", "kind": kind, "at": {"load": 20}}
    if kind != "speed":
        keys["wheel"] = "60-2"
    assert re.search(said, refusal_of(lambda: sweeps.measured(scene_with(tmp_path, **keys))))


GROUPS = wheel_from_text("36-2-2-2")
GROUPS_OFF = random_errors(GROUPS.width, 0.003, 3)
GROUPS_GAP = 50.0  # degree
LATE = (0, 10, 20)  # teeth after the first one with which the recordings begin


@pytest.fixture(scope="module")
def engines() -> dict[int, SampledEngine]:
    computed = sweeps.run(
        {"engine": "ntua", "set": {"speed": 1200}, "axes": {"load": LOADS},
         "output": {"quantities": ["omega"]}}
    )  # fmt: skip
    phi = np.deg2rad(computed.crank_angle.values)
    return {load: SampledEngine(phi, computed.omega.sel(load=load).values) for load in LOADS}


def write(path: Path, engine: SampledEngine, late: int, errors: np.ndarray) -> None:
    times = tooth_times(engine, GROUPS.width, 25, np.deg2rad(GROUPS_GAP), errors)[late:]
    write_times(path, times - times[0])


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, engines: dict[int, SampledEngine]) -> Path:
    folder = tmp_path_factory.mktemp("symmetric")
    for load, late in zip(LOADS, LATE, strict=True):
        write(folder / f"load_{load}.csv", engines[load], late, GROUPS_OFF)
    return folder


def compared_symmetric(folder: Path, **keys: Any) -> Any:
    given = {"kind": "teeth", "wheel": "36-2-2-2", "at": {"load": LOADS},
             "file": [str(folder / f"load_{load}.csv") for load in LOADS], **keys}  # fmt: skip
    return sweeps.measured(
        engine="ntua", set={"speed": 1200}, axes={"load": LOADS},
        output={"quantities": ["delta"]}, measured=given,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"first_tooth": 0}, "must be a number from 1"),
        ({"first_tooth": [1, 2]}, "one for each of 3 files"),
        ({"first_tooth": 2}, "pulse 2 is not the first of a group"),
        ({"first_tooth": 1, "wheel": "60-2"}, "several teeth could be the first"),
    ],
)
def test_no_first_tooth(folder: Path, keys: dict[str, Any], said: str) -> None:
    assert re.search(said, refusal_of(lambda: compared_symmetric(folder, **keys)))


def test_the_intervals_left_out_are_counted_from_the_first_tooth(
    tmp_path: Path, engines: dict[int, SampledEngine]
) -> None:
    """One tooth is off by a tenth of a pitch, in a recording that begins ten teeth later."""
    path, off = tmp_path / "times.csv", np.zeros(30)
    off[4:6] = 0.1, -0.1
    write(path, engines[50], 10, off)
    found = sweeps.measured(
        engine="ntua", set={"speed": 1200, "load": 50}, output={"quantities": ["delta"]},
        measured={"kind": "teeth", "wheel": "36-2-2-2", "file": str(path), "gap_angle": GROUPS_GAP},
    )  # fmt: skip
    assert "intervals 5, 6 of 30 after the gap" in found.attrs["remarks"]
    used = found.omega_raw[0].values[found.interval_used.values == 1]
    speeds = engines[50].speed(np.linspace(0.0, 4.0 * np.pi, 721))
    assert np.ptp(used) < np.ptp(speeds) < np.ptp(found.omega_raw[0].values)


@pytest.mark.parametrize("late", LATE)
def test_given_errors_belong_to_the_first_tooth(
    tmp_path: Path, engines: dict[int, SampledEngine], late: int
) -> None:
    """Rows of cycles begin with the recording; the errors do not."""
    path, engine, width = (
        tmp_path / "times.csv",
        engines[50],
        GROUPS.width * (1.0 + GROUPS_OFF),
    )
    write(path, engine, late, GROUPS_OFF)
    at = np.concatenate([[0.0], np.cumsum(np.tile(width, 3))])
    # on the average, the teeth are where they would be without errors
    gap = GROUPS_GAP + np.rad2deg(np.mean(at[:30] - np.cumsum(GROUPS.width) + GROUPS.width))
    given = read_scene(
        engine="ntua", output={"quantities": ["delta"]},
        measured={"file": str(path), "kind": "teeth", "wheel": "36-2-2-2", "gap_angle": gap,
                  "tooth_errors": GROUPS_OFF.tolist()},
    ).measured  # fmt: skip
    assert given is not None
    (record,) = records_of(given, 4.0 * np.pi, "scene")
    angle = np.linspace(-2.0 * np.pi, 2.0 * np.pi, 720, endpoint=False)
    row = cycles_in_a_row(record, given, angle, engine.speed(angle), 4.0 * np.pi, 1, "scene")
    edges = np.deg2rad(GROUPS_GAP) + at[late : late + 61]
    assert row.start == pytest.approx(edges[0], abs=1e-6)
    assert np.allclose(row.mean, np.diff(edges) / np.diff(engine.time(edges)), rtol=1e-5)
