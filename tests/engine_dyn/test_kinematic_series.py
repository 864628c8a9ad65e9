"""Series of the mechanism's motion: against transforms of the exact curves, and as printed."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import scipy.special

from engine_dyn.forces import balance, harmonics
from engine_dyn.geometry import kinematic_series as series
from engine_dyn.geometry import slider_crank
from engine_dyn.geometry.arrangement import phase_sums
from engine_dyn.geometry.cylinders import even_cylinders

POINTS = 4096
PHI = np.arange(POINTS) * (2.0 * np.pi / POINTS)
ORDERS = np.arange(1.0, 41.0)
RATIOS = (1e-4, 0.05, 0.2571, 0.4, 0.5, 0.7, 0.9, 0.98)


def transform(curve: Any) -> Any:
    """Harmonics 1 to 40 of a curve over a turn, C_n of Re C_n exp(i n phi)."""
    return 2.0 * np.fft.rfft(curve)[1:41] / POINTS


@pytest.mark.parametrize("ratio", RATIOS)
def test_coefficients_are_the_transform_of_the_exact_motion(ratio: float) -> None:
    x = slider_crank.position(PHI, ratio)
    v = slider_crank.velocity(PHI, ratio)
    b = slider_crank.acceleration(PHI, ratio)
    limit = 4e-14
    found = transform(x)
    assert series.position_coefficients(ORDERS, ratio) == pytest.approx(found.real, abs=limit)
    found = transform(v)
    assert series.velocity_coefficients(ORDERS, ratio) == pytest.approx(-found.imag, abs=limit)
    found = transform(b)
    assert series.acceleration_coefficients(ORDERS, ratio) == pytest.approx(found.real, abs=limit)
    found = transform(-b * v)
    wanted = series.inertia_torque_coefficients(ORDERS, ratio)
    assert wanted == pytest.approx(-found.imag, abs=limit)
    assert series.mean_position(ratio) == pytest.approx(x.mean(), abs=1e-15, rel=1e-14)


def test_mean_is_the_complete_elliptic_integral() -> None:
    # Mean of sqrt(1 - lambda^2 sin^2) over a turn: 2 E(lambda)/pi.
    ratio = np.linspace(0.05, 0.99, 20)
    root = 2.0 / np.pi * scipy.special.ellipe(ratio**2)
    assert series.mean_position(ratio) == pytest.approx(1.0 + (1.0 - root) / ratio, rel=1e-13)


def test_coefficients_by_the_hypergeometric_function() -> None:
    ratio = 0.6
    root = math.sqrt(1.0 - ratio**2)
    q = (1.0 - root) / (1.0 + root)
    # The last are far below what a transform can see.
    for n in (1, 2, 5, 9, 20):
        whole = scipy.special.binom(0.5, n) * scipy.special.hyp2f1(-0.5, n - 0.5, n + 1, q * q)
        value = -(1.0 + root) / ratio * q**n * whole
        assert series.position_coefficients(2.0 * n, ratio) == pytest.approx(value, rel=1e-13)


Function = Callable[[Any, Any], Any]


@pytest.mark.parametrize(
    ("function", "order", "printed", "next_power"),
    [
        # Mosakowski eq. 7 (A = -a), Rakopoulos notes a_2, a_6
        (series.position_coefficients, 2, {1: -1 / 4, 3: -1 / 16, 5: -15 / 512}, 7),
        (series.position_coefficients, 6, {5: -1 / 512}, 7),
        # a_4 of the notes, corrected from -1/64; 3/256 is printed by Mosakowski (7) as 5/256
        (series.position_coefficients, 4, {3: 1 / 64, 5: 3 / 256, 7: 35 / 4096}, 9),
        # Rakopoulos notes gamma_2, gamma_4, gamma_6
        (series.velocity_coefficients, 2, {1: 1 / 2, 3: 1 / 8, 5: 15 / 256}, 7),
        (series.velocity_coefficients, 4, {3: -1 / 16, 5: -3 / 64}, 7),
        (series.velocity_coefficients, 6, {5: 3 / 256}, 7),
        # beta_2, beta_4 (Q_3 of the notes is this fourth order), beta_6 = Q_6 (printed 1/128)
        (series.acceleration_coefficients, 2, {1: 1.0, 3: 1 / 4, 5: 15 / 128}, 7),
        (series.acceleration_coefficients, 4, {3: -1 / 4, 5: -3 / 16}, 7),
        (series.acceleration_coefficients, 6, {5: 9 / 128}, 7),
        # inertia torque; the second order corrected: -lambda/2 is printed for -1/2
        (series.inertia_torque_coefficients, 1, {1: 1 / 4, 3: 1 / 16, 5: 15 / 512}, 7),
        (series.inertia_torque_coefficients, 2, {0: -1 / 2, 4: -1 / 32, 6: -1 / 32}, 8),
        (series.inertia_torque_coefficients, 3, {1: -3 / 4, 3: -9 / 32, 5: -81 / 512}, 7),
        (series.inertia_torque_coefficients, 4, {2: -1 / 4, 4: -1 / 8, 6: -1 / 16}, 8),
        (series.inertia_torque_coefficients, 5, {3: 5 / 32, 5: 75 / 512}, 7),
        (series.inertia_torque_coefficients, 6, {4: 3 / 32, 6: 3 / 32}, 8),
    ],
)
def test_printed_polynomials_are_the_first_terms(
    function: Function, order: int, printed: dict[int, float], next_power: int
) -> None:
    # What is left falls with the next power of lambda: halving lambda divides it by 2^power.
    def rest(ratio: float) -> float:
        return float(function(order, ratio)) - sum(c * ratio**p for p, c in printed.items())

    assert rest(0.2) / rest(0.1) == pytest.approx(2.0**next_power, rel=0.1)


def test_shortened_forms_are_those_of_mosakowski() -> None:
    phi, ratio = np.linspace(-4.0, 4.0, 41), 0.42
    two = np.cos(phi) + ratio * np.cos(2 * phi)  # 13
    four = (
        np.cos(phi)
        + (ratio + ratio**3 / 4) * np.cos(2 * phi)
        - ratio**3 / 4 * np.cos(4 * phi)  # 18, with the minus sign of 11 and 13 before b
    )
    assert series.truncated_acceleration(phi, ratio, 2) == pytest.approx(two, abs=1e-14)
    assert series.truncated_acceleration(phi, ratio, 4) == pytest.approx(four, abs=1e-14)
    # 18 as printed has the opposite sign to 11 and 13: it would accelerate the other way.
    assert series.truncated_acceleration(0.0, ratio, 4) == pytest.approx(1.0 + ratio)
    velocity = np.sin(phi) + 0.5 * ratio * np.sin(2 * phi)  # 12, over r omega (printed omega^2)
    assert series.truncated_velocity(phi, ratio, 2) == pytest.approx(velocity, abs=1e-14)
    # 9: s from the crank's axis over r; x/r = 1 + 1/lambda - s/r
    from_axis = 1.0 / ratio + np.cos(phi) + 0.25 * ratio * (np.cos(2 * phi) - 1.0)
    travel = 1.0 + 1.0 / ratio - from_axis
    assert series.truncated_position(phi, ratio, 2) == pytest.approx(travel, abs=1e-14)


def test_error_is_mosakowskis_equation_16() -> None:
    ratio = np.linspace(0.05, 0.7, 27)
    printed = ratio / (1.0 + ratio) * (1.0 / np.sqrt(1.0 - ratio**2) - 1.0)
    assert series.truncation_error(ratio, 2, 2) == pytest.approx(printed, rel=1e-12)
    # Text to Fig. 2: slightly over 1 % at 0.3, over 5 % at 0.5. No value is printed.
    assert 0.01 < series.truncation_error(0.3, 2, 2) < 0.012
    assert 0.05 < series.truncation_error(0.5, 2, 2) < 0.06
    # with the fourth order, at 90 degrees too: (lambda/W - lambda - lambda^3/2)/(1 + lambda)
    rest = (ratio / np.sqrt(1.0 - ratio**2) - ratio - 0.5 * ratio**3) / (1.0 + ratio)
    assert series.truncation_error(ratio, 4, 2) == pytest.approx(rest, rel=1e-9)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: series.position_coefficients([0, 1], 0.3), "order = 0: must be above 0"),
        (lambda: series.acceleration_coefficients(2, 1.2), "crank_ratio = 1.2: must lie between 0"),
        (lambda: series.truncated_position(0.1, 0.3, 3), "highest order = 3: must be 2, 4, 6"),
        (lambda: series.truncation_error(0.3, 2, 3), "derivative = 3: must be 0, 1 or 2"),
        (lambda: harmonics.velocity_harmonics([1.0, 1025.0], 0.3, 0.1),
         "order = 1025: must be above 0 and at most 1024"),
        (lambda: balance.acceleration_harmonics(513.0, 0.3),
         "order = 513: must be above 0 and at most 512"),
    ],
)  # fmt: skip
def test_bad_input_is_named(call: Callable[[], Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call()


@pytest.mark.parametrize("order", [0.0, -1.0, np.nan, np.inf])
def test_orders_that_are_none(order: float) -> None:
    by_count = {4: even_cylinders(4, 4.0 * np.pi)}
    calls = (
        lambda: series.position_coefficients(order, 0.3),
        lambda: series.velocity_coefficients([1.0, order], 0.3),
        lambda: series.acceleration_coefficients(order, 0.3),
        lambda: series.inertia_torque_coefficients(order, 0.3),
        lambda: harmonics.velocity_harmonics(order, 0.3, 0.1),
        lambda: harmonics.inertia_harmonics(order, 0.3),
        lambda: harmonics.phase_vectors(order, 4, by_count),
        lambda: balance.acceleration_harmonics(order, 0.3),
        lambda: balance.acceleration_harmonics([1.0, order], 0.3, 0.1),
    )
    for call in calls:
        with pytest.raises(ValueError, match=rf"order = {order:g}: must be above 0"):
            call()
    with pytest.raises(ValueError, match=rf"order = {order:g}: must be a multiple of 0.5 above 0"):
        phase_sums(order, [0.0], 4.0 * np.pi)
