"""Signals with one fault each: the check that speaks is the one that should."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from engine_dyn.plausibility.usual_ranges import RECORDING_CHECKS
from engine_dyn.recordings.cylinder_geometry import RecordedCycles
from engine_dyn.recordings.signal_checks import examine
from tests.support import recorded_engine as engine

DEGREE = engine.DEGREE


def names(recorded: RecordedCycles, **options: object) -> list[str]:
    found = examine(recorded, engine.GEOMETRY, **options)
    assert all("\n" not in str(one) and str(one).startswith(one.check) for one in found)
    assert {one.check for one in found} <= set(RECORDING_CHECKS)
    return [one.check for one in found]


def changed(recorded: RecordedCycles, pressure: np.ndarray) -> RecordedCycles:
    return RecordedCycles(recorded.angle, pressure, recorded.period)


def pressures(step: float, cycles: int, change: Callable[[np.ndarray], Any]) -> RecordedCycles:
    recorded = engine.cycles(step, cycles)
    return changed(recorded, change(recorded.pressure))


ANGLE = np.arange(-360.0, 360.0, 1.0) * DEGREE

JUDGED: list[tuple[RecordedCycles, list[str]]] = [
    *((engine.cycles(step, 20, noise=noise), []) for step, noise in ((0.2, 0.0), (1.0, 1e4))),
    (pressures(0.2, 3, lambda p: np.round(p / 5e3) * 5e3), []),  # steps of a converter
    (engine.cycles(0.5, heat=0.0, loss=5.0), []),  # motored
    (engine.cycles(0.5, 20, noise=1e5), ["noise"]),
    (RecordedCycles(ANGLE, np.full((2, 720), 1e5)), ["constant"]),
    (RecordedCycles(ANGLE, np.full((2, 720), 1e200)), ["missing"]),
    (RecordedCycles(ANGLE[::60], np.full((2, 12), 1e5)), ["samples"]),
]
"""Recordings, and all that is said of them."""


@pytest.mark.parametrize(("recorded", "said"), JUDGED)
def test_the_checks_that_speak(recorded: RecordedCycles, said: list[str]) -> None:
    assert names(recorded) == said


@pytest.mark.parametrize(
    ("recorded", "name"),
    [
        (pressures(0.5, 1, lambda p: np.maximum(p, 3e5)), "clipped"),
        (pressures(1.0, 1, lambda p: p + 6e4), "compression_exponent"),  # a pegging error
        (engine.cycles(8.0), "samples"),
    ],
)
def test_a_check_that_is_among_those(recorded: RecordedCycles, name: str) -> None:
    assert name in names(recorded)


@pytest.mark.parametrize("noise", [0.0, 5e3])
def test_a_clipped_peak(noise: float) -> None:
    recorded = engine.cycles(0.5, 5, noise=noise)
    clipped = changed(recorded, np.minimum(recorded.pressure, 0.9 * recorded.pressure.max()))
    found = [f for f in examine(clipped, engine.GEOMETRY) if f.check == "clipped"]
    assert len(found) == 1
    assert "largest pressure" in found[0].text
    assert "5 of 5 cycles" in found[0].text


def test_drift_from_cycle_to_cycle() -> None:
    recorded = engine.cycles(1.0, 20, noise=1e3)
    drifting = recorded.pressure + np.linspace(-1e4, 1e4, 20)[:, None]
    found = examine(changed(recorded, drifting), engine.GEOMETRY)
    assert [one.check for one in found] == ["drift"]
    assert found[0].value == pytest.approx(0.2, rel=0.05)


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
