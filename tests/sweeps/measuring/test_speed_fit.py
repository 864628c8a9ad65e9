"""Least squares on measured speeds: intervals cover the truth, what cannot be told is refused."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sweeps.lab.speed.speed_fit import (
    Inseparable,
    MeasuredCycles,
    Parameter,
    Unbound,
    beside_bounds,
    fit_speeds,
)
from tests.support.measured_speeds import INTERVALS, LOADS, TEETH, WIDTH, Case, model, random_case
from tests.support.tiers import every

pytest.importorskip("scipy")

TRUTH = np.array([0.02, 0.03, 0.05])
PARAMETERS = (
    Parameter("inertia", 0.015, 0.001, 1.0, scale=0.02),
    Parameter("angle", 0.0, scale=0.1),
    Parameter("share", 0.0, scale=0.05),
)


def exact(errors: np.ndarray | float = 0.0, noise: float = 1e-6) -> list[MeasuredCycles]:
    rng = np.random.default_rng(5)
    return [
        MeasuredCycles(
            f"load {load:g}",
            np.exp(
                logs + np.tile(errors * np.ones(TEETH), 2) + noise * rng.normal(size=(8, INTERVALS))
            )
            * 300.0,
            WIDTH,
        )
        for load, logs in zip(LOADS, model(TRUTH[None]), strict=True)
    ]


@pytest.mark.parametrize(
    "case",
    every(4, [Case(), Case(wheel=False, correlated=True), Case(correlated=True, priors=True),
              Case(correlated=True, at_bound=True)]),
    ids=["white", "perfect wheel", "priors", "at a bound"],
)  # fmt: skip
def test_intervals_cover_the_truth(case: Case) -> None:
    """`python -m benchmarks identification` has 400 cases of each kind; three sigma of 60 here."""
    rng = np.random.default_rng(20)
    covered = np.zeros(3)
    number = 60
    for _ in range(number):
        fit, truth = random_case(case, rng)
        covered += (fit.interval[:, 0] <= truth) & (truth <= fit.interval[:, 1])
    least = 0.95 - 3.0 * np.sqrt(0.95 * 0.05 / number)
    assert (covered / number >= least).all(), covered / number
    assert covered.sum() < 3 * number  # wider than 95 % would be as wrong


@pytest.mark.parametrize("beyond", [-0.2, 1.5])
def test_the_others_follow_what_is_at_its_bound(beyond: float) -> None:
    """Against draws from the normal distribution, of which those beyond the bound are left out."""
    size = np.array([[4.0, 1.8], [1.8, 1.0]])  # covariance; the second one is at its bound
    mean = np.array([0.7, beyond])  # of the free solution, from the bound
    rng = np.random.default_rng(6)
    draws = mean + rng.normal(size=(400_000, 2)) @ np.linalg.cholesky(size).T
    kept = draws[draws[:, 1] * np.sign(beyond) < 0.0]
    at = mean[0] - size[0, 1] / size[1, 1] * beyond  # with the second one held
    left = size[0, 0] - size[0, 1] ** 2 / size[1, 1]
    held = np.array([[left, 0.0], [0.0, 0.0]])
    step, reach, covariance = beside_bounds(
        Unbound(size, size, np.array([mean[0] - at, beyond]), 1.96 * np.sqrt(np.diag(size))),
        Unbound(held, held, np.zeros(2), 1.96 * np.sqrt(np.diag(held))),
        np.array([True, False]),
    )
    assert at + step[0] == pytest.approx(kept[:, 0].mean(), abs=0.03)
    assert reach[0] == pytest.approx(1.96 * kept[:, 0].std(), rel=0.01)
    assert_allclose(covariance, np.cov(kept.T), rtol=0.03)
    assert (step[1], reach[1]) == (beyond, 1.96)  # its own interval is cut off by the caller


def test_parameters_and_teeth_are_found_without_noise() -> None:
    errors = 0.003 * np.sin(np.arange(TEETH) ** 2.0)
    errors -= errors @ WIDTH[:TEETH] / WIDTH[:TEETH].sum()
    fit = fit_speeds(model, PARAMETERS, exact(errors), teeth=TEETH)
    assert_allclose(fit.value, TRUTH, rtol=1e-4)
    assert_allclose(fit.tooth_error, errors, atol=5e-6)


def test_what_repeats_every_turn_or_has_no_effect_is_refused() -> None:
    def of_turn(values: np.ndarray) -> list[np.ndarray]:
        wave = np.sin(2.0 * np.pi * np.arange(INTERVALS) / TEETH)
        return [m + values[:, [3]] * wave for m in model(values[:, :3])]

    more = (*PARAMETERS, Parameter("reciprocating_mass", 0.0, scale=0.1))
    with pytest.raises(Inseparable, match="reciprocating_mass, the tooth errors: cannot"):
        fit_speeds(of_turn, more, exact(), teeth=TEETH)
    fit_speeds(of_turn, more, exact())  # with perfect teeth it can
    told = replace(more[3], prior=0.0, prior_deviation=0.1)
    fit = fit_speeds(of_turn, (*PARAMETERS, told), exact(), teeth=TEETH, largest_condition=1e7)
    assert fit.deviation[3] == pytest.approx(0.1, rel=0.01)  # the prior is all that is known
    idle = (*PARAMETERS, Parameter("bore", 1.0))
    with pytest.raises(Inseparable, match="bore: no measured value depends on it"):
        fit_speeds(lambda values: model(values[:, :3]), idle, exact())
