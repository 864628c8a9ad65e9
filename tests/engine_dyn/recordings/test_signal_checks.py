"""Signals with one fault each: the check that speaks is the one that should."""

import math

import numpy as np
import pytest

from engine_dyn.recordings.recorded_cycles import RecordedCycles
from engine_dyn.recordings.signal_checks import RECORDING_CHECKS, examine
from tests.support import recorded_engine as engine

DEGREE = engine.DEGREE


def names(recorded: RecordedCycles, **options: object) -> list[str]:
    found = examine(recorded, engine.GEOMETRY, **options)
    assert all("\n" not in str(one) and str(one).startswith(one.check) for one in found)
    assert {one.check for one in found} <= set(RECORDING_CHECKS)
    return [one.check for one in found]


def changed(recorded: RecordedCycles, pressure: np.ndarray) -> RecordedCycles:
    return RecordedCycles(recorded.angle, pressure, recorded.period)


@pytest.mark.parametrize(("step", "noise"), [(0.2, 0.0), (0.5, 5e3), (1.0, 1e4)])
def test_a_good_recording_passes(step: float, noise: float) -> None:
    assert names(engine.cycles(step, 20, noise=noise)) == []


def test_a_converter_with_steps_passes() -> None:
    recorded = engine.cycles(0.2, 3)
    assert names(changed(recorded, np.round(recorded.pressure / 5e3) * 5e3)) == []


@pytest.mark.parametrize("noise", [0.0, 5e3])
def test_a_clipped_peak(noise: float) -> None:
    recorded = engine.cycles(0.5, 5, noise=noise)
    clipped = changed(recorded, np.minimum(recorded.pressure, 0.9 * recorded.pressure.max()))
    found = [f for f in examine(clipped, engine.GEOMETRY) if f.check == "clipped"]
    assert len(found) == 1
    assert "largest pressure" in found[0].text
    assert "5 of 5 cycles" in found[0].text


def test_clipped_at_the_lower_end() -> None:
    recorded = engine.cycles(0.5)
    low = changed(recorded, np.maximum(recorded.pressure, 3e5))
    assert "clipped" in names(low)


def test_a_gap() -> None:
    recorded = engine.cycles(0.5)
    keep = (recorded.angle < 19.8 * DEGREE) | (recorded.angle > 25.8 * DEGREE)
    gap = RecordedCycles(recorded.angle[keep], recorded.pressure[:, keep])
    found = [f for f in examine(gap, engine.GEOMETRY) if f.check == "gap"]
    assert found[0].value == pytest.approx(6.5)
    assert "from 19.5 to 26 degree" in found[0].text


def test_pressures_that_are_no_numbers() -> None:
    recorded = engine.cycles(1.0, 2)
    p = recorded.pressure.copy()
    p[1, 360:362] = math.nan
    found = examine(changed(recorded, p), engine.GEOMETRY)
    assert [str(f) for f in found] == [
        "missing: 2 of 1440 pressures are not numbers, the first in cycle 2 at 0 degree; no other "
        "check is made"
    ]


def test_much_noise() -> None:
    assert names(engine.cycles(0.5, 20, noise=1e5)) == ["noise"]


def test_too_few_samples() -> None:
    found = examine(engine.cycles(8.0), engine.GEOMETRY)
    assert "samples" in [one.check for one in found]
    # Judged by what it does: the imep of this one is really wrong by about as much as is said.
    assert "step of 8 degree" in next(one.text for one in found if one.check == "samples")


def test_drift_from_cycle_to_cycle() -> None:
    recorded = engine.cycles(1.0, 20, noise=1e3)
    drifting = recorded.pressure + np.linspace(-1e4, 1e4, 20)[:, None]
    found = examine(changed(recorded, drifting), engine.GEOMETRY)
    assert [one.check for one in found] == ["drift"]
    assert found[0].value == pytest.approx(0.2, rel=0.05)


@pytest.mark.parametrize(("offset", "name"), [(6e4, "compression_exponent")])
def test_a_pegging_error(offset: float, name: str) -> None:
    recorded = engine.cycles(1.0)
    assert name in names(changed(recorded, recorded.pressure + offset))


def test_gauge_pressure_is_not_judged_but_said() -> None:
    recorded = engine.cycles(1.0)
    found = examine(changed(recorded, recorded.pressure - 5e5), engine.GEOMETRY)
    assert any("positive (absolute)" in str(one) for one in found)


def test_a_wrong_dead_centre() -> None:
    late = engine.cycles(0.5, shift=6.0)
    (found,) = (one for one in examine(late, engine.GEOMETRY) if one.check == "dead_centre")
    assert found.value == pytest.approx(6.0, abs=0.7)
    assert "dead_centre" not in names(late, silenced=["dead_centre"])
    assert "dead_centre" not in names(engine.cycles(0.5, shift=2.0))


def test_motored_cycles_are_recognised() -> None:
    assert names(engine.cycles(0.5, heat=0.0, loss=5.0)) == []
    late = engine.cycles(0.5, heat=0.0, loss=5.0, shift=2.0)
    found = examine(late, engine.GEOMETRY)
    assert "motored cycle lies at" in found[0].text
    assert "motored cycle this is a suspicion" not in found[0].text


def test_what_cannot_be_judged_is_told_in_one_line() -> None:
    angle = np.arange(-360.0, 360.0, 1.0) * DEGREE
    assert names(RecordedCycles(angle, np.full((2, 720), 1e5))) == ["constant"]
    assert names(RecordedCycles(angle, np.full((2, 720), 1e200))) == ["missing"]
    assert names(RecordedCycles(angle[::60], np.full((2, 12), 1e5))) == ["samples"]


@pytest.mark.parametrize("seed", range(40))
def test_no_signal_makes_the_checks_fail(seed: int) -> None:
    rng = np.random.default_rng(seed)
    period = rng.choice([2.0, 4.0]) * np.pi
    count = int(rng.choice([16, 17, 40, 180, 721]))
    angle = -0.5 * period + period * np.arange(count) / count
    if rng.random() < 0.5:
        angle = np.sort(rng.uniform(angle[0], angle[-1], count))
    curve = 1e5 * (1.0 + 40.0 * np.exp(-((angle / 0.6) ** 2)))
    curves = (curve, -curve, np.round(curve / 5e5) * 5e5, 1e5 * rng.standard_normal(count))
    p = curves[seed % 4] + 1e4 * rng.choice([0.0, 1.0]) * rng.standard_normal((3, count))
    names(RecordedCycles(angle, p, period))
    names(RecordedCycles(angle, p, period), motored=True)


def test_compression_in_both_revolutions() -> None:
    """A two-stroke engine, or one revolution of each cycle, read as four-stroke cycles."""
    recorded = engine.cycles(0.5, 4)
    firing = recorded.pressure[:, np.abs(recorded.angle + 1e-9) < np.pi]
    doubled = changed(recorded, np.roll(np.hstack([firing, firing]), firing.shape[1] // 2, axis=1))
    found = [one for one in examine(doubled, engine.GEOMETRY) if one.check == "gas_exchange"]
    assert len(found) == 1
    assert found[0].value == pytest.approx(np.ptp(doubled.mean) / 1e5)
    assert "two-stroke" in found[0].text
