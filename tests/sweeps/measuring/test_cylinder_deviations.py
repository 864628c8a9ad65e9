"""Missed cycles and weak cylinders of an engine that was integrated apart from the estimator."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

import sweeps
from sweeps.errors import SceneError
from sweeps.figures import draw
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
    times = tooth_times(angle, speed, np.radians(GAP), seed=1, **noise)  # type: ignore[arg-type]
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


def test_false_alarms_are_as_many_as_asked_for(tmp_path: Path, pressures: Any) -> None:
    """One alarm in ten cycles, so that there are enough to count; within four deviations."""
    record(tmp_path / "long.csv", pressures, factors(12, cycles=600))
    found = sweeps.cylinder_deviations(scene(tmp_path / "long.csv"), false_alarms=0.1)
    judged = np.isfinite(found["imep_deviation_of_cycle"].values[0]).all(axis=1)
    alarms = (found["missed"].values[0][judged] > 0.0).any(axis=1)
    assert alarms.mean() == pytest.approx(0.1, abs=4.0 * np.sqrt(0.09 / judged.sum()))


def test_few_cycles_ask_for_more(faulty: Path, tmp_path: Path, found: xr.Dataset) -> None:
    """What is left of a dispersion that few cycles tell stands in the threshold."""
    lines = faulty.read_text().splitlines()
    (tmp_path / "few.csv").write_text("\n".join(lines[: 2 + 10 * 116]) + "\n")
    few = sweeps.cylinder_deviations(scene(tmp_path / "few.csv")).isel(recording=0)
    wide, usual = (
        -one["missed_threshold"] / np.hypot(one["imep_deviation_of_cycle_std"],
                                            one["imep_dispersion"])
        for one in (few, found)
    )  # fmt: skip
    assert (wide > 1.2 * usual).all()


def test_lost_teeth_cost_their_cycles(faulty: Path, found: xr.Dataset) -> None:
    lines = faulty.read_text().splitlines()
    del lines[1 + 40 * 116 + 30]
    path = faulty.with_name("lost.csv")
    path.write_text("\n".join(lines) + "\n")
    other = sweeps.cylinder_deviations(scene(path)).isel(recording=0)
    unknown = np.isnan(other["imep_deviation_of_cycle"].values)
    assert unknown[40].all()
    assert unknown[1:-1].sum() < 16
    called = {tuple(place) for place in np.argwhere(other["missed"].values > 0.0)}
    assert called == set(MISSED)


def test_the_gap_says_with_which_turn_the_recording_begins(faulty: Path, found: xr.Dataset) -> None:
    """A turn later, cylinders 1 and 4 and cylinders 2 and 3 change places."""
    other = sweeps.cylinder_deviations(scene(faulty, gap_angle=GAP + 360.0)).isel(recording=0)
    assert other["weak"].values.tolist() == [0.0, 0.0, 1.0, 0.0]
    assert {cylinder for _, cylinder in np.argwhere(other["missed"].values > 0.0)} == {0, 1, 3}
    with pytest.raises(SceneError, match=r"gap_angle: missing.*every 180 degrees"):
        sweeps.cylinder_deviations(scene(faulty, gap_angle=None) | {
            "measured": {"file": str(faulty), "kind": "teeth", "wheel": "60-2"}
        })  # fmt: skip


def test_several_recordings_stand_side_by_side(
    faulty: Path, found: xr.Dataset, pressures: Any
) -> None:
    record(faulty.with_name("sound.csv"), pressures, factors(9)[:40])
    both = scene(faulty, file=[str(faulty), str(faulty.with_name("sound.csv"))],
                 at={"load": [60, 40]})  # fmt: skip
    both["set"] = {key: value for key, value in SET.items() if key != "load"}
    both["axes"] = {"load": [40, 60]}
    result = sweeps.cylinder_deviations(both)
    assert result["load"].values.tolist() == [60.0, 40.0]
    first = result.isel(recording=0)
    assert_allclose(first["imep_deviation"], found["imep_deviation"], rtol=1e-6)
    assert np.isnan(result["imep_deviation"][1, 41:]).all()
    drawn = {figure.stem for figure in draw(result, faulty.parent / "figures")}
    assert {"cylinder_deviations_1", "cylinder_deviations_2", "cylinder_means"} <= drawn
    assert float(result["imep_of_combustion"][1]) < float(result["imep_of_combustion"][0])


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


def test_cycles_that_never_follow_each_other_are_refused(faulty: Path) -> None:
    """A tooth is missed in every fourth turn: no window, which is a cycle wide, is complete."""
    lines = faulty.read_text().splitlines()
    path = faulty.with_name("torn.csv")
    torn = [line for number, line in enumerate(lines) if number == 0 or (number - 1) % 232 != 150]
    path.write_text("\n".join(torn) + "\n")
    with pytest.raises(SceneError, match="no two consecutive complete cycles"):
        sweeps.cylinder_deviations(scene(path))


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
