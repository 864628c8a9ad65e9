"""Deviations of imep from the speed: against the integrated equation of motion, drawn errors."""

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.stats import norm

from engine_dyn.geometry.toothed_wheel import wheel_from_text
from engine_dyn.recordings.cylinder_geometry import CylinderGeometry
from engine_dyn.recordings.cylinder_work import (
    MeanCycle,
    WheelNoise,
    combustion_torque,
    detection,
    energy_deviation,
    work_estimator,
)
from engine_dyn.recordings.tooth_errors import speed_through_wheel

PERIOD = 4.0 * np.pi
SAMPLES = 1440
ANGLE = (np.arange(SAMPLES) / SAMPLES - 0.5) * PERIOD
WHEEL = wheel_from_text("36-1")
GAP = 1.3
FIRING = tuple(np.radians([0.0, 540.0, 180.0, 360.0]))
VOLUME = 5e-4
NOISE = WheelNoise(0.001, 0.0, 0.0002)
BAR = 1e5


def bump(u: float) -> float:
    """Torque of combustion for each unit of imep: a smooth bump behind dead centre."""
    start, end = -0.1, 2.3
    if not start < u < end:
        return 0.0
    return VOLUME * 2.0 / (end - start) * float(np.sin(np.pi * (u - start) / (end - start)) ** 2)


def inertia(phi: float) -> float:
    return 0.15 + 0.003 * float(np.cos(2.0 * phi))


def torque(phi: float, imep: dict[tuple[int, int], float]) -> float:
    """Of all cylinders: 5 bar, unless (cycle, cylinder) is given another imep."""
    cycle = int(np.floor(phi / PERIOD + 0.5))
    return sum(
        bump(phi - firing - near * PERIOD) * imep.get((near, number), 5.0 * BAR)
        for near in (cycle - 1, cycle, cycle + 1)
        for number, firing in enumerate(FIRING)
    )


MEAN_TORQUE = 4.0 * VOLUME * 5.0 * BAR / PERIOD


def run(exponent: float, imep: dict[tuple[int, int], float], start: float, cycles: int,
        speed: float = 100.0):  # fmt: skip
    """omega and time over the angle from -period/2 on, by SciPy."""
    coefficient = MEAN_TORQUE / speed**exponent

    def slopes(phi: float, y: np.ndarray) -> list[float]:
        load = coefficient * y[0] ** exponent
        centrifugal = -0.003 * np.sin(2.0 * phi) * y[0] ** 2
        return [(torque(phi, imep) - load - centrifugal) / (inertia(phi) * y[0]), 1.0 / y[0]]

    span = (-0.5 * PERIOD, (cycles - 0.5) * PERIOD)
    found = solve_ivp(slopes, span, [start, 0.0], "DOP853", rtol=1e-9, atol=1e-11,
                      max_step=0.1, dense_output=True)  # fmt: skip
    assert found.success
    return found.sol


def mean_cycle(exponent: float, speed: float = 100.0) -> MeanCycle:
    """The cycle that an engine without deviations settles to."""
    start = speed
    for _ in range(12 if exponent else 1):
        start = float(run(exponent, {}, start, 1, speed)(0.5 * PERIOD)[0])
    omega = run(exponent, {}, start, 1, speed)(ANGLE)[0]
    theta = np.array([inertia(phi) for phi in ANGLE])
    power = MEAN_TORQUE / speed**exponent * omega**exponent
    damping = exponent * power / (theta * omega**2)
    shape = np.array([bump(u) for u in ANGLE])
    return MeanCycle(ANGLE, omega, theta, shape, FIRING, PERIOD, damping)


def raw_of(solution, cycles: int) -> np.ndarray:
    edges = np.append(WHEEL.angle + 2 * np.pi * np.arange(2 * cycles)[:, None], 4 * np.pi * cycles)
    edges = np.sort(edges.ravel()) + GAP
    return (np.diff(edges) / np.diff(solution(edges)[1])).reshape(cycles, -1)


@pytest.fixture(scope="module", params=[0.0, 2.0])
def cycle_and_exponent(request: pytest.FixtureRequest) -> tuple[MeanCycle, float]:
    return mean_cycle(request.param), request.param


def test_torque_of_combustion_does_the_work() -> None:
    geometry = CylinderGeometry(0.08, 0.09, 0.28)

    def extra(u: float) -> float:
        return 3e6 * np.exp(-((u - 0.4) ** 2) / 0.1)

    motored = 1e5 + 2e6 * np.exp(-(ANGLE**2) / 0.2)
    found = combustion_torque(
        ANGLE, motored + np.array([extra(u) for u in ANGLE]), motored, geometry
    )
    work, _ = quad(lambda u: extra(u) * float(geometry.volume_slope(u)), -2.0, 3.0)
    imep = work / geometry.swept_volume
    at = 800  # 40 degrees behind dead centre
    expected = extra(ANGLE[at]) * float(geometry.volume_slope(ANGLE[at])) / imep
    assert found[at] == pytest.approx(expected, rel=1e-9)
    assert found.mean() * PERIOD == pytest.approx(geometry.swept_volume, rel=1e-12)
    with pytest.raises(ValueError, match="no more work than the motored pressure"):
        combustion_torque(ANGLE, motored, motored, geometry)


def test_missed_and_strong_cycles_of_the_integrated_speed(
    cycle_and_exponent: tuple[MeanCycle, float],
) -> None:
    """Equations (139) to (144): SciPy's speed with two cycles that deviate, and no errors."""
    cycle, exponent = cycle_and_exponent
    changed = {(3, 2): 0.0, (6, 1): 6.0 * BAR}
    raw = raw_of(run(exponent, changed, cycle.speed[0], 9), 8)
    reference = speed_through_wheel(ANGLE, cycle.speed, WHEEL, GAP, PERIOD)
    estimator = work_estimator(cycle, WHEEL, GAP, NOISE, dispersion=0.2 * BAR)
    found = estimator.deviations(energy_deviation(raw, reference)) / BAR
    assert found[3, 2] == pytest.approx(-5.0, rel=0.01)
    assert found[6, 1] == pytest.approx(1.0, rel=0.01)
    quiet = found[[1, 4]]  # one cycle away and farther: no deviating cycle in their windows
    assert np.nanmax(np.abs(quiet)) < 0.01
    assert np.isnan(found).sum() in range(1, 5)
    # cylinders 1 and 4 fire next to it, and the mean of the others falls in their windows
    assert np.all(found[3, [0, 3]] > 0.2)
    assert np.all(found[3, [0, 3]] < 2.5)


def test_dead_cylinder_from_the_mean_of_cycles() -> None:
    """Energy of a periodic torque, by Fourier's series; the deviation repeats every cycle."""
    cycle = mean_cycle(0.0)
    energy = 0.5 * cycle.inertia * cycle.speed**2
    shift = np.roll(cycle.combustion, round(FIRING[1] / PERIOD * SAMPLES))
    waves = np.fft.rfft(-0.5 * BAR * shift)
    order = np.arange(waves.size) * 2.0 * np.pi / PERIOD
    waves[0] = 0.0
    waves[1:] /= 1j * order[1:]
    speed = np.sqrt(2.0 * (energy + np.fft.irfft(waves, SAMPLES) + 20.0) / cycle.inertia)
    raw = speed_through_wheel(ANGLE, speed, WHEEL, GAP, PERIOD)
    reference = speed_through_wheel(ANGLE, cycle.speed, WHEEL, GAP, PERIOD)
    relative = energy_deviation(raw, reference)
    for noise, spread in ((NOISE, 0.2 * BAR), (WheelNoise(0.0, 0.0, 2e-5), 1.0 * BAR)):
        estimator = work_estimator(cycle, WHEEL, GAP, noise, dispersion=spread, averaged=50)
        found = estimator.mean_deviations(relative) / BAR
        assert found[1] == pytest.approx(-0.5, rel=0.01)
        assert np.all(found[[0, 2, 3]] > 0.0)
    # where the dispersion outweighs all errors, the three others have equal weights in their mean
    assert found[[0, 2, 3]] == pytest.approx(0.5 / 3.0, rel=0.05)


def test_what_is_not_known_leaves_no_trace(cycle_and_exponent: tuple[MeanCycle, float]) -> None:
    """Level, slope (a constant torque more), and the same imep more in all cylinders."""
    cycle, exponent = cycle_and_exponent
    estimator = work_estimator(cycle, WHEEL, GAP, NOISE, dispersion=0.2 * BAR)
    reference = speed_through_wheel(ANGLE, cycle.speed, WHEEL, GAP, PERIOD)
    more = {(c, i): 5.3 * BAR for c in range(-2, 9) for i in range(4)}
    for imep, start in (({}, 1.02 * cycle.speed[0]), (more, cycle.speed[0])):
        raw = raw_of(run(exponent, imep, start, 5), 4)
        found = estimator.deviations(energy_deviation(raw, reference)) / BAR
        assert np.nanmax(np.abs(found)) < 0.005


@pytest.mark.parametrize("noise", [NOISE, WheelNoise(0.0, 0.001, 0.0003)])
@pytest.mark.parametrize("reference_cycles", [np.inf, 10.0])
def test_uncertainty_is_the_spread_over_wheels(noise: WheelNoise, reference_cycles: float) -> None:
    """Equation (145): teeth are moved one by one here, in 4000 wheels."""
    cycle = mean_cycle(0.0)
    estimator = work_estimator(cycle, WHEEL, GAP, noise, reference_cycles=reference_cycles)
    rng = np.random.default_rng(3)
    wheels, cycles, pitch = 4000, 5, WHEEL.width.min()
    width = np.tile(WHEEL.width, 2 * cycles)

    def shown(passages: int) -> np.ndarray:
        """Relative speeds of cycles through each wheel; a mean over passages has less noise."""
        size = (wheels, width.size + 1)
        edges = noise.passage * pitch * rng.standard_normal(size) / np.sqrt(passages) + places
        return np.diff(edges, axis=1) / width + errors

    teeth = noise.place * pitch * rng.standard_normal((wheels, WHEEL.teeth))
    places = np.concatenate([np.tile(teeth, 2 * cycles), teeth[:, :1]], axis=1)
    single = noise.interval * pitch * rng.standard_normal((wheels, WHEEL.teeth)) / WHEEL.width
    errors = np.tile(single, 2 * cycles)
    relative = -shown(1)
    if np.isfinite(reference_cycles):
        # each tooth of the reference has its own passages: the mean over earlier cycles
        earlier = noise.passage * pitch * rng.standard_normal((wheels, width.size + 1))
        relative += np.diff(places, axis=1) / width + errors
        relative += np.diff(earlier / np.sqrt(reference_cycles), axis=1) / width
    found = np.array([estimator.deviations(one.reshape(cycles, -1))[2] for one in relative])
    assert found.std(axis=0) == pytest.approx(estimator.noise, rel=0.05)
    assert np.all(np.abs(found.mean(axis=0)) < 4.0 * estimator.noise / np.sqrt(wheels))


def test_thresholds_are_those_of_the_normal_distribution() -> None:
    """Equations (146) and (147), with SciPy's distribution."""
    cycle = mean_cycle(0.0)
    sigma = 0.3 * BAR
    estimator = work_estimator(
        cycle, WHEEL, GAP, WheelNoise(0.0, 0.0, 0.002), dispersion=sigma, reference_cycles=20
    )
    found = detection(estimator, 2.0 * BAR, 1e-3)
    normal = np.sqrt(estimator.noise**2 + estimator.others**2 + sigma**2 * 1.05)
    missed = np.sqrt(estimator.noise**2 + estimator.others**2 + sigma**2 * 0.05)
    none = np.prod(norm.sf(found.threshold / normal))
    assert 1.0 - none == pytest.approx(1e-3, rel=1e-9)
    assert found.probability == pytest.approx(norm.cdf((found.threshold + 2.0 * BAR) / missed))
    assert np.all((found.probability > 0.5) & (found.probability < 1.0))
