"""Recorded cycles in a row: speed, load and jump of an engine that was integrated apart."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

import sweeps
from sweeps.errors import SceneError
from sweeps.figures import draw
from tests.support import recorded_engine
from tests.support.commands import ok, refused
from tests.support.known_cycles import KnownEngine, speed_of, tooth_times
from tests.support.scenes import refusal_of, write_scene

RPM = np.pi / 30.0
CYCLES, GAP, NOMINAL = 8, 100.0, 1200.0
ANGLE = np.arange(-360.0, 360.0)
FIRING = {1: (0.0,), 4: (0.0, 540.0, 180.0, 360.0)}
FACTORS = 1.0 + 0.08 * np.random.default_rng(5).standard_normal(CYCLES)
FACTORS[3] = 0.3
SET = {
    "speed": NOMINAL, "bore": 0.1, "stroke": 0.12, "rod_length": 0.21, "reciprocating_mass": 1.5,
    "load_exponent": 2.0, "load_offset": 0.0, "friction_constant": 0.0,
    "friction_peak_pressure": 0.0, "friction_mean_piston_speed": 0.0,
}  # fmt: skip
INERTIA = {1: 1.2, 4: 0.8}


@dataclass(frozen=True)
class Recorded:
    """Pressure and speed of one engine, as files in a folder, and what made them."""

    folder: Path
    cylinders: int
    angle: Any
    speed: Any
    load: float

    def scene(self, measured: bool = True, **tables: Any) -> dict[str, Any]:
        found: dict[str, Any] = {
            "engine": "ntua" if self.cylinders == 1 else "si_four_87x101",
            "set": {**SET, "inertia": INERTIA[self.cylinders], **tables.pop("set", {})},
            "axes": {"recorded_cycle": list(range(1, CYCLES + 1))},
            "indicator": {"file": str(self.folder / "pressure.csv"), "unit": "bar"},
            "output": {"quantities": ["delta"]},
        }
        if measured:
            found["measured"] = {"file": str(self.folder / "teeth.csv"), "kind": "teeth",
                                 "wheel": "60-2", "gap_angle": GAP}  # fmt: skip
        return found | tables


def pressures() -> tuple[Any, Any]:
    radians = np.radians(ANGLE)
    return recorded_engine.pressure(radians), recorded_engine.pressure(radians, heat=0.0)


def write(path: Path, factors: Any) -> None:
    fired, motored = pressures()
    lines = ["cycle;" + ";".join(f"{a:g}" for a in ANGLE)]
    for number, factor in enumerate(factors, start=1):
        row = (motored + factor * (fired - motored)) / 1e5
        lines.append(f"{number};" + ";".join(f"{p:.6f}" for p in row))
    path.write_text("\n".join(lines) + "\n")


@pytest.fixture(scope="module", params=[1, 4])
def recorded(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Recorded:
    folder, count = tmp_path_factory.mktemp("train"), int(request.param)
    write(folder / "pressure.csv", FACTORS)
    engine = KnownEngine(0.1, 0.12, 0.21, 1.5, INERTIA[count], FIRING[count])
    factors = np.tile(FACTORS[:, None], (1, count))
    angle, speed, load = speed_of(
        engine, np.radians(ANGLE), *pressures(), factors, 1.02 * NOMINAL * RPM
    )
    times = tooth_times(angle, speed, np.radians(GAP), errors=0.001, passage=0.0002, seed=7)
    (folder / "teeth.csv").write_text("time [s]\n" + "\n".join(f"{t:.9f}" for t in times) + "\n")
    return Recorded(folder, count, angle, speed, load)


@pytest.fixture(scope="module")
def followed(recorded: Recorded) -> xr.Dataset:
    return sweeps.follow_cycles(recorded.scene())


def test_first_speed_load_and_curve_are_those_of_the_engine(
    recorded: Recorded, followed: xr.Dataset
) -> None:
    """The true speed was integrated by another rule, and seen through teeth with errors.

    Of four cylinders, cycles before the first are those that fire late: what they did is not
    recorded, and the engine that made the speed had others than the closed train.
    """
    true = recorded.speed[:-1].reshape(CYCLES, -1)[:, ::4]
    off = followed["omega_followed"].values / true - 1.0
    late = recorded.cylinders > 1
    assert np.abs(off[1:]).max() < (1e-3 if late else 3e-4)
    assert np.abs(off[0]).max() < (0.02 if late else 3e-4)
    assert float(followed["load_coefficient_followed"]) == pytest.approx(
        recorded.load, rel=0.01 if late else 1e-3
    )
    if not late:
        assert float(followed["start_speed_followed"]) == pytest.approx(true[0, 0], rel=3e-4)
    assert followed["imep"].values.argmin() == 3
    assert followed.attrs["first_cycle_of_speed"] == 1
    assert (
        followed.attrs["rms_difference"] < 0.5 * (followed.attrs["rms_difference_of_cycles_next"])
    )


def test_mean_speeds_and_deltas_of_cycles(recorded: Recorded, followed: xr.Dataset) -> None:
    parts = [recorded.speed[2880 * c : 2880 * (c + 1) + 1] for c in range(CYCLES)]
    true = np.array([np.mean(0.5 * (part[1:] + part[:-1])) for part in parts])
    measured = followed["omega_mean_measured"].values
    assert np.isnan(measured[0])  # the first tooth passes within it
    known = np.isfinite(measured)
    assert known.sum() >= CYCLES - 2
    assert_allclose(measured[known], true[known], rtol=2e-4)
    assert_allclose(followed["omega_mean_followed"].values[1:], true[1:], rtol=1e-3)
    deltas = [np.ptp(part) / part.mean() for part in parts[1:]]
    assert_allclose(followed["delta_followed"].values[1:], deltas, rtol=0.01)


def test_the_closed_train_repeats_and_jumps(followed: xr.Dataset) -> None:
    first, last = followed["omega_closed"].values[0, 0], followed["omega_closed"].values[-1, -1]
    # the last sample stands a degree before the first one
    assert last == pytest.approx(first, rel=2e-3)
    jump = float(followed["jump"])
    assert jump == pytest.approx(first - followed["omega_followed"].values[0, 0], rel=1e-9)
    assert abs(jump) > 1e-3 * first
    means = [followed[f"omega_mean_{word}"].values.mean() for word in ("followed", "closed")]
    assert means[0] == pytest.approx(means[1], rel=1e-5)
    # what closing changes fades as the memory says, in energy
    energies = [followed[f"omega_{word}"].values[:, 0] ** 2 for word in ("followed", "closed")]
    apart = energies[1] - energies[0]
    fading = float(followed["memory_of_a_cycle"])
    load = float(followed["load_coefficient_closed"] / followed["load_coefficient_followed"]) - 1.0
    assert abs(load) < 0.1
    assert apart[1] / apart[0] == pytest.approx(fading, abs=0.35)


def test_a_recording_that_begins_later_is_put_in_its_place(
    recorded: Recorded, followed: xr.Dataset
) -> None:
    """The first two cycles of the speed are cut off, and the first of the pressure left out."""
    lines = (recorded.folder / "teeth.csv").read_text().splitlines()
    (recorded.folder / "late.csv").write_text(
        "\n".join([lines[0], *lines[1 + 2 * 2 * 58 :]]) + "\n"
    )
    scene = recorded.scene()
    scene["measured"]["file"] = str(recorded.folder / "late.csv")
    scene["axes"] = {"recorded_cycle": list(range(2, CYCLES + 1))}
    found = sweeps.follow_cycles(scene)
    assert found.attrs["first_cycle_of_speed"] == 3
    if recorded.cylinders == 1:
        assert_allclose(found["omega_followed"], followed["omega_followed"][1:], rtol=5e-4)


def test_without_a_measured_speed_the_mean_is_the_nominal_one(recorded: Recorded) -> None:
    found = sweeps.follow_cycles(recorded.scene(measured=False))
    assert (
        "starts from the steady state of the mean cycle" in found.attrs["first_speed_and_load_from"]
    )
    mean = found["omega_mean_followed"].values.mean()
    assert mean == pytest.approx(NOMINAL * RPM, rel=1e-10)
    assert "omega_raw" not in found
    # cycles that follow a weak one begin slower than if they repeated for ever
    assert found["omega_followed"].values[4, 0] < found["omega_followed"].values[3, 0]


def test_equal_cycles_need_no_jump(recorded: Recorded, tmp_path: Path) -> None:
    write(tmp_path / "pressure.csv", np.ones(3))
    scene = recorded.scene(measured=False)
    scene["indicator"]["file"] = str(tmp_path / "pressure.csv")
    scene["axes"] = {"recorded_cycle": [1, 2, 3]}
    scene["solver"] = {"inertia_model": "constant"}  # the train has its own
    found = sweeps.follow_cycles(scene)
    assert abs(float(found["jump"])) < 1e-7 * NOMINAL
    for word in ("closed", "repeated"):
        # the nominal speed of the scene is a power mean, that of the train a mean over the angle
        one, other = (found[f"omega_{w}"] / found[f"omega_{w}"].mean() for w in (word, "followed"))
        assert_allclose(one, other, rtol=2e-5)
        assert_allclose(found[f"delta_{word}"], found["delta_followed"], rtol=1e-3)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"axes": {"crank_mass": [1.0, 2.0]}, "indicator": {"average": True}},
         "recorded_cycle: missing"),
        ({"axes": {"recorded_cycle": [1, 2, 3], "crank_mass": [1.0, 2.0]}},
         "also varies crank_mass"),
        ({"axes": {"recorded_cycle": [1, 3]}}, "consecutive numbers"),
        ({"axes": {"recorded_cycle": [2]}}, "at least 2 consecutive numbers"),
        ({"set": {"pin_offset": 0.001}}, "pin_offset and crank_offset must be 0"),
        ({"set": {"friction_boundary": 0.3, "friction_skirt": 0.7, "ring_pressure": 1}},
         "friction over the stroke"),
        ({"set": {"load_offset": 1e4}}, "do not drive the load"),
        ({"set": {"wanted_delta": 0.05}}, "inertia must be given"),
        ({"measured": {"kind": "teeth", "wheel": "36-1"}}, "do not fit 36-1"),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_refused(
    recorded: Recorded, change: dict[str, Any], said: str
) -> None:
    if recorded.cylinders > 1:
        pytest.skip("said of one engine")
    scene = recorded.scene()
    for table, values in change.items():
        scene[table] = {**({} if table == "axes" else scene[table]), **values}
    if "wanted_delta" in scene["set"]:
        del scene["set"]["inertia"]
    assert re.search(said, refusal_of(lambda: sweeps.follow_cycles(scene)))


def test_too_many_steps_and_evenly_firing_cylinders_without_the_gap_are_refused(
    recorded: Recorded, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = recorded.scene()
    if recorded.cylinders > 1:  # one cylinder tells where the gap is
        del scene["measured"]["gap_angle"]
        with pytest.raises(SceneError, match=r"gap_angle: missing.*repeats every 180 degrees"):
            sweeps.follow_cycles(scene)
    monkeypatch.setattr("sweeps.measuring.recorded_train.MOST_SAMPLES", 2 * 720 * CYCLES - 1)
    with pytest.raises(SceneError, match=r"angle_step = 1: 8 cycles of 720 steps; must be at most"):
        sweeps.follow_cycles(recorded.scene())


def test_the_command_writes_and_draws(recorded: Recorded, tmp_path: Path) -> None:
    path = write_scene(tmp_path, **recorded.scene())  # with absolute paths
    said = ok("train", path, "-o", tmp_path / "train.nc")
    assert "if the train is repeated, it starts" in said
    assert "the speed recording begins in recorded cycle 1" in said
    with sweeps.open(tmp_path / "train.nc") as found:
        names = [figure.stem for figure in draw(found, tmp_path / "figures")]
    of_engine = {"arrangement", "crank_star", "strokes"}
    assert [name for name in names if name not in of_engine] == ["recorded_train"]
    assert "exists" in refused("train", path, "-o", tmp_path / "train.nc")
