"""Level and dead centre of recordings that were not pegged, against closed forms."""

from dataclasses import replace

import numpy as np
import pytest

from engine_dyn.recordings.cylinder_geometry import CylinderGeometry, RecordedCycles
from engine_dyn.recordings.dead_centre import symmetric_shift
from engine_dyn.recordings.level import ANGLE_TOLD, TOLD, recorded_level
from engine_dyn.recordings.signal_checks import examine
from engine_dyn.units import BAR, DEGREE
from tests.support import recorded_engine
from tests.support.known_pressures import KnownPressure

OFFSETS, SHIFTS = (-2.0, -1.01325, -0.3, 0.0, 0.5, 3.4, 4.0), (-2.0, 0.0, 1.3)

ENGINES = {
    "diesel": KnownPressure(17.5, 1.34, rise=0.6),
    "spark ignition": KnownPressure(9.5, 1.31, rise=2.0, start=-25.0, duration=60.0),
    "throttled": KnownPressure(10.0, 1.32, inlet=0.5, rise=1.2, start=-30.0),
    "charged": KnownPressure(15.0, 1.36, inlet=2.2, rise=0.8),
    "motored": KnownPressure(16.0, 1.35, rise=0.0),
}


def recorded(known: KnownPressure, offset: float, late: float, noise: float = 0.02) -> tuple:
    angle, pressure = known.recorded(offset, late, cycles=10, noise=noise)
    geometry = CylinderGeometry(0.09, 0.1, known.crank_ratio, known.ratio)
    return RecordedCycles(angle * DEGREE, pressure * BAR), geometry


@pytest.mark.parametrize("with_ratio", [True, False], ids=["ratio known", "ratio unknown"])
@pytest.mark.parametrize("name", ENGINES)
def test_level_and_angle_are_right_or_not_told(name: str, with_ratio: bool) -> None:
    known = ENGINES[name]
    for number, offset in enumerate(OFFSETS):
        for late in SHIFTS[number % 2 :: 2]:  # the smallest and the largest, or the one between
            cycles, geometry = recorded(known, offset, late)
            if not with_ratio:
                geometry = replace(geometry, compression_ratio=None)
            found = recorded_level(cycles, geometry)
            wrong = abs(found.offset / BAR - offset)
            angle_told = found.motored and found.shift_uncertainty <= ANGLE_TOLD
            assert found.motored == (name == "motored")
            assert wrong < max(0.05, 3.0 * found.uncertainty / BAR), (offset, late)
            assert ("0.05 bar it cannot be told" in found.text) == (found.uncertainty > TOLD)
            assert ("cannot be told to 0.3 degree" in found.text) == (not angle_told)
            if found.uncertainty <= TOLD:
                assert wrong < 0.05, (offset, late)
            if angle_told:
                assert abs(found.shift / DEGREE - late) < 0.3, (offset, late)
            assert found.off == (offset != 0.0)
            assert found.inlet / BAR == pytest.approx(known.inlet, abs=wrong + 0.01)


@pytest.mark.parametrize("offset", [-2.0, 0.0, 3.4])
@pytest.mark.parametrize("heat", [0.0, 1500.0])
def test_a_gas_whose_exponent_falls(heat: float, offset: float) -> None:
    """First law, heat loss and a ratio of specific heats that falls with the temperature."""
    cycles = recorded_engine.cycles(0.5, shift=1.0, heat=heat)
    cycles = replace(cycles, pressure=cycles.pressure + offset * BAR)
    found = recorded_level(cycles, recorded_engine.GEOMETRY)
    assert found.offset / BAR == pytest.approx(offset, abs=0.05)
    assert found.motored == (heat == 0.0)
    if found.motored:
        assert found.shift / DEGREE == pytest.approx(1.0, abs=0.3)


@pytest.mark.parametrize("start", [-20.0, -6.0, 5.0])
@pytest.mark.parametrize("rise", [0.01, 0.02, 0.03, 0.05, 0.08])
def test_a_little_combustion_is_not_taken_for_a_motored_cycle(rise: float, start: float) -> None:
    cycles, geometry = recorded(KnownPressure(16.0, 1.35, rise=rise, start=start), 2.0, 1.0)
    found = recorded_level(cycles, geometry)
    assert found.offset / BAR == pytest.approx(2.0, abs=0.05)
    told = found.motored and found.shift_uncertainty <= ANGLE_TOLD
    assert not told or abs(found.shift / DEGREE - 1.0) < 0.3
    assert not found.motored or rise < 0.05


def test_noise_is_in_the_uncertainty_of_a_symmetric_shift() -> None:
    known = KnownPressure(9.0, 1.33, inlet=0.5, rise=0.0)
    angle = np.arange(-360.0, 360.0, 0.5)
    found = []
    for seed in range(30):
        noise = 0.1 * np.random.default_rng(seed).standard_normal((4, len(angle)))
        cycles = RecordedCycles(angle * DEGREE, (known(angle - 1.0) + noise) * BAR)
        found.append(symmetric_shift(cycles)[:2])
    shift, uncertainty = np.array(found).T / DEGREE
    assert shift.mean() == pytest.approx(1.0, abs=3.0 * shift.std() / np.sqrt(30))
    assert 0.5 < shift.std() / uncertainty.mean() < 1.5


def test_a_wrong_level_is_not_taken_for_an_angle_or_an_exponent() -> None:
    for offset in (-1.01325, 3.4):
        cycles, geometry = recorded(ENGINES["diesel"], offset, 1.0)
        level = recorded_level(cycles, geometry)
        assert [one.check for one in examine(cycles, geometry, level=level)] == ["level"]
    cycles, geometry = recorded(ENGINES["diesel"], 0.0, 1.0)
    assert examine(cycles, geometry, level=recorded_level(cycles, geometry)) == []


@pytest.mark.parametrize("seed", range(24))
def test_what_is_no_compression_is_refused_by_name_or_told(seed: int) -> None:
    rng = np.random.default_rng(seed)
    period = rng.choice([2.0, 4.0]) * np.pi
    count = int(rng.choice([16, 17, 180, 721]))
    angle = -0.5 * period + period * np.arange(count) / count
    curve = 1e5 * (1.0 + 40.0 * np.exp(-((angle / 0.6) ** 2)))
    p = (curve, -curve, np.full(count, 2e5), 1e5 * rng.standard_normal(count))[seed % 4]
    cycles = RecordedCycles(angle, np.stack([p, p + 1e3 * rng.standard_normal(count)]), period)
    try:
        found = recorded_level(cycles, recorded_engine.GEOMETRY)
    except ValueError as error:
        assert str(error)
    else:
        assert np.isfinite([found.offset, found.uncertainty, found.shift]).all()
