"""Weak cylinders and recorded cycles in a row, of engines that were integrated apart."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

import sweeps
from sweeps.base.errors import SceneError
from sweeps.view.figures import draw
from tests.support import recorded_engine
from tests.support.commands import ok, refused
from tests.support.known_cycles import KnownEngine, speed_of, tooth_times
from tests.support.scenes import refusal_of, write_scene

CYCLES, GAP, SPEED = 60, 78.0, 2000.0
DISPERSION, WEAK = 0.04, 0.2
MISSED = ((12, 2), (30, 0), (31, 3))
"""Cycle and cylinder, from 0: one alone, and two in cycles that follow each other."""
SET = {"speed": SPEED, "load": 60, "reciprocating_mass": 0.65, "inertia": 0.15}
ENGINE = KnownEngine(0.0875, 0.101, 0.151, 0.65, 0.15, (0.0, 540.0, 180.0, 360.0))


@pytest.fixture(scope="module")
def pressures() -> tuple[Any, Any, Any]:
    """Angle, pressure of the mean cycle, and the same without combustion."""
    found = [
        sweeps.run({"engine": "si_four_87x101", "set": SET | more,
                    "output": {"quantities": ["pressure"]}})
        for more in ({}, {"misfire": 1})
    ]  # fmt: skip
    angle = np.radians(found[0]["crank_angle"].values)
    return angle, *(1e5 * one["pressure"].values for one in found)


def factors(seed: int, weak: float = 0.0, missed: Any = (), cycles: int = CYCLES) -> Any:
    found = 1.0 + DISPERSION * np.random.default_rng(seed).standard_normal((cycles, 4))
    found[:, 1] -= weak
    for place in missed:
        found[place] = 0.0
    return found


def record(path: Path, pressures: tuple[Any, Any, Any], given: Any, **teeth: float) -> None:
    angle, speed, _ = speed_of(ENGINE, *pressures, given, SPEED * np.pi / 30.0)
    noise = {"errors": 0.001, "passage": 0.0002} | teeth
    times = tooth_times(angle, speed, np.radians(GAP), seed=1, **noise)
    path.write_text("time [s]\n" + "\n".join(f"{t:.9f}" for t in times) + "\n")


def scene(path: Path, **keys: Any) -> dict[str, Any]:
    return {
        "engine": "si_four_87x101",
        "set": SET,
        "output": {"quantities": ["delta"]},
        "measured": {"file": str(path), "kind": "teeth", "wheel": "60-2", "gap_angle": GAP} | keys,
    }


@pytest.fixture(scope="module")
def faulty(tmp_path_factory: pytest.TempPathFactory, pressures: Any) -> Path:
    path = tmp_path_factory.mktemp("cylinders") / "faulty.csv"
    record(path, pressures, factors(4, WEAK, MISSED))
    return path


@pytest.fixture(scope="module")
def found(faulty: Path) -> xr.Dataset:
    return sweeps.cylinder_deviations(scene(faulty)).isel(recording=0)


def test_missed_cycles_and_the_weak_cylinder_are_found_and_no_others(found: xr.Dataset) -> None:
    called = {tuple(place) for place in np.argwhere(found["missed"].values > 0.0)}
    assert called == set(MISSED)
    assert (found["missed_found"] > 0.99).all()
    lacking = float(found["imep_of_combustion"])
    for place in MISSED:
        assert float(found["imep_deviation_of_cycle"].values[place]) == pytest.approx(
            -lacking, rel=0.12
        )
    assert found["weak"].values.tolist() == [0.0, 1.0, 0.0, 0.0]
    assert not found["dead"].values.any()
    lacking = float(found["imep_of_combustion"])
    off = float(found["imep_deviation_lasting"][1]) + WEAK * lacking
    assert abs(off) < 3.0 * float(found["imep_deviation_lasting_std"][1])
    # the others are compared with a mean in which the weak one is
    others = found["imep_deviation_lasting"].values[[0, 2, 3]]
    assert others.mean() == pytest.approx(WEAK * lacking / 3.0, abs=0.3)
    both = found["imep_deviation_of_cycle"] + found["imep_deviation_lasting"]
    assert_allclose(found["imep_deviation"], both)
    assert (found["imep_deviation_std"] > found["imep_deviation_of_cycle_std"]).all()


def test_errors_are_as_large_as_is_said(found: xr.Dataset, pressures: Any) -> None:
    """Deviations of normal cycles less the true ones scatter as the standard deviation says."""
    true = factors(4, WEAK, MISSED)
    true = (true - np.mean(np.delete(true, [12, 30, 31], axis=0), axis=0)) * float(
        found["imep_of_combustion"]
    )
    off = found["imep_deviation_of_cycle"].values - true[: found.sizes["recorded_cycle"]]
    off[[11, 12, 13, 29, 30, 31, 32]] = np.nan
    scatter = float(np.sqrt(np.nanmean(off**2)))
    count = int(np.isfinite(off).sum())
    said = float(found["imep_deviation_of_cycle_std"].mean())
    assert scatter == pytest.approx(said, rel=4.0 / np.sqrt(2.0 * count))
    assert float(found["imep_dispersion"] / found["imep_of_combustion"]) == pytest.approx(
        DISPERSION, rel=0.25
    )
    assert float(found["tooth_passage"]) == pytest.approx(0.0002, rel=0.1)


def test_a_sound_engine_has_no_alarms_and_a_dead_cylinder_no_missed_cycle(
    tmp_path: Path, pressures: Any
) -> None:
    record(tmp_path / "sound.csv", pressures, factors(9))
    found = sweeps.cylinder_deviations(scene(tmp_path / "sound.csv"), false_alarms=1e-5)
    assert not (found["missed"] > 0.0).any()
    assert not (found["weak"] > 0.0).any()
    assert (found["missed_threshold"] < -4.0 * found["imep_deviation_of_cycle_std"]).all()
    given = factors(2)
    given[:, 2] = 0.0
    record(tmp_path / "dead.csv", pressures, given)
    found = sweeps.cylinder_deviations(scene(tmp_path / "dead.csv"))
    assert found["dead"].values[0].tolist() == [0.0, 0.0, 1.0, 0.0]
    assert not (found["missed"] > 0.0).any()


@pytest.mark.slow
def test_false_alarms_are_as_many_as_asked_for(tmp_path: Path, pressures: Any) -> None:
    """One alarm in ten cycles, so that there are enough to count; within four deviations."""
    record(tmp_path / "long.csv", pressures, factors(12, cycles=600))
    found = sweeps.cylinder_deviations(scene(tmp_path / "long.csv"), false_alarms=0.1)
    judged = np.isfinite(found["imep_deviation_of_cycle"].values[0]).all(axis=1)
    alarms = (found["missed"].values[0][judged] > 0.0).any(axis=1)
    assert alarms.mean() == pytest.approx(0.1, abs=4.0 * np.sqrt(0.09 / judged.sum()))


def test_the_gap_says_with_which_turn_the_recording_begins(faulty: Path, found: xr.Dataset) -> None:
    """A turn later, cylinders 1 and 4 and cylinders 2 and 3 change places."""
    other = sweeps.cylinder_deviations(scene(faulty, gap_angle=GAP + 360.0)).isel(recording=0)
    assert other["weak"].values.tolist() == [0.0, 0.0, 1.0, 0.0]
    assert {cylinder for _, cylinder in np.argwhere(other["missed"].values > 0.0)} == {0, 1, 3}
    with pytest.raises(SceneError, match=r"gap_angle: missing.*every 180 degrees"):
        sweeps.cylinder_deviations(scene(faulty, gap_angle=None) | {
            "measured": {"file": str(faulty), "kind": "teeth", "wheel": "60-2"}
        })  # fmt: skip


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"engine": "ntua"}, "cylinders = 1"),
        ({"measured": None}, r"\[measured\] is missing"),
        (
            {"measured": {"kind": "speed", "wheel": None, "gap_angle": None}},
            "kind = 'speed': must be 'teeth'",
        ),
        ({"set": {"misfire": 2}}, "cylinders must be equal"),
        ({"axes": {"bore": [0.08, 0.09]}}, "the scene varies bore"),
        ({"measured": {"wheel": "6-1"}}, "10 intervals a cycle; must be at least 4 for each of 4"),
        ({"short": 5}, "5 whole cycles; must be at least 6"),
    ],
)
def test_what_does_not_fit_is_refused(faulty: Path, change: dict[str, Any], said: str) -> None:
    given = scene(faulty)
    if "short" in change:
        path = faulty.with_name("short.csv")
        path.write_text("\n".join(faulty.read_text().splitlines()[: 2 + 5 * 116]) + "\n")
        given = scene(path)
    for table, values in change.items():
        if table == "short":
            continue
        if isinstance(values, dict):
            values = {k: v for k, v in {**given.get(table, {}), **values}.items() if v is not None}
        given[table] = values
    given = {key: value for key, value in given.items() if value is not None}
    assert re.search(said, refusal_of(lambda: sweeps.cylinder_deviations(given)))


def test_the_command_writes_and_draws(faulty: Path, tmp_path: Path) -> None:
    (tmp_path / "teeth.csv").write_bytes(faulty.read_bytes())
    path = write_scene(tmp_path, **scene(Path("teeth.csv")))
    out = tmp_path / "cylinders.nc"
    said = ok("cylinders", path, "-o", out)
    assert "weak" in said and "misfires" in said
    again = ok("cylinders", path, "-o", out, "--overwrite", "-q", "--false-alarms", "0.001")
    assert again == ""
    with sweeps.open(out) as found:
        names = [figure.stem for figure in draw(found, tmp_path / "figures")]
        assert found.attrs["false_alarms"] == pytest.approx(1e-3, rel=1e-12)
    assert {"cylinder_deviations", "cylinder_means"} <= set(names)
    assert "--false-alarms often: must be a number" in refused(
        "cylinders", path, "-o", out, "--overwrite", "--false-alarms", "often"
    )
    assert "between 0 and 1" in refused(
        "cylinders", path, "-o", out, "--overwrite", "--false-alarms", "2"
    )


RPM = np.pi / 30.0
IN_A_ROW, GAP_OF_TRAIN, NOMINAL = 8, 100.0, 1200.0
ANGLE = np.arange(-360.0, 360.0)
FIRING = {1: (0.0,), 4: (0.0, 540.0, 180.0, 360.0)}
FACTORS = 1.0 + 0.08 * np.random.default_rng(5).standard_normal(IN_A_ROW)
FACTORS[3] = 0.3
SET_OF_TRAIN = {
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
            "set": {**SET_OF_TRAIN, "inertia": INERTIA[self.cylinders], **tables.pop("set", {})},
            "axes": {"recorded_cycle": list(range(1, IN_A_ROW + 1))},
            "indicator": {"file": str(self.folder / "pressure.csv"), "unit": "bar"},
            "output": {"quantities": ["delta"]},
        }
        if measured:
            found["measured"] = {"file": str(self.folder / "teeth.csv"), "kind": "teeth",
                                 "wheel": "60-2", "gap_angle": GAP_OF_TRAIN}  # fmt: skip
        return found | tables


def pressures_of_train() -> tuple[Any, Any]:
    radians = np.radians(ANGLE)
    return recorded_engine.pressure(radians), recorded_engine.pressure(radians, heat=0.0)


def write(path: Path, factors: Any) -> None:
    fired, motored = pressures_of_train()
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
        engine, np.radians(ANGLE), *pressures_of_train(), factors, 1.02 * NOMINAL * RPM
    )
    times = tooth_times(
        angle, speed, np.radians(GAP_OF_TRAIN), errors=0.001, passage=0.0002, seed=7
    )
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
    true = recorded.speed[:-1].reshape(IN_A_ROW, -1)[:, ::4]
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


@pytest.mark.parametrize("recorded", [1], indirect=True)
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
def test_trains_that_do_not_fit_are_refused(
    recorded: Recorded, change: dict[str, Any], said: str
) -> None:
    scene = recorded.scene()
    for table, values in change.items():
        scene[table] = {**({} if table == "axes" else scene[table]), **values}
    if "wanted_delta" in scene["set"]:
        del scene["set"]["inertia"]
    assert re.search(said, refusal_of(lambda: sweeps.follow_cycles(scene)))
