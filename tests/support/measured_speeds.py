"""Speeds of an engine that is not one: three loads, a wheel 60-2, noise of known kinds."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sweeps.lab.speed.speed_fit import (
    FittedSpeeds,
    MeasuredCycles,
    Parameter,
    fit_speeds,
)

__all__ = ["INTERVALS", "LOADS", "TEETH", "WIDTH", "Case", "model", "random_case"]

Floats = npt.NDArray[np.float64]

WHEEL = np.deg2rad(np.append(np.full(57, 6.0), 18.0))
TEETH, INTERVALS = WHEEL.size, 2 * WHEEL.size
WIDTH = np.tile(WHEEL, 2)
MIDDLE = np.cumsum(WIDTH) - 0.5 * WIDTH
LOADS = (0.3, 0.7, 1.0)


def model(values: Floats) -> list[Floats]:
    """Logarithms of the speed over inertia, an angle and a share of a torque, for each load."""
    inertia, angle, share = values[:, [0]], values[:, [1]], values[:, [2]]
    return [
        (
            load * np.cos(0.5 * (MIDDLE - angle))
            + 0.6 * load * np.cos(MIDDLE - 2.0 * angle)
            + 0.3 * np.sqrt(load) * np.cos(1.5 * MIDDLE)
            + share * load**2 * np.sin(2.0 * MIDDLE + 1.0)
        )
        / (100.0 * inertia)
        for load in LOADS
    ]


@dataclass(frozen=True)
class Case:
    """How a case is drawn."""

    cycles: int = 12
    wheel: bool = True
    correlated: bool = False
    priors: bool = False
    at_bound: bool = False


def random_case(case: Case, rng: np.random.Generator) -> tuple[FittedSpeeds, Floats]:
    """Fit to a drawn case, and the truth."""
    truth = np.array([
        0.02 * rng.uniform(0.8, 1.2),
        rng.normal(0.0, 0.03),
        0.0 if case.at_bound else rng.uniform(0.02, 0.1),
    ])  # fmt: skip
    errors = rng.normal(0.0, 0.003, TEETH) if case.wheel else np.zeros(TEETH)
    errors -= errors @ WHEEL / WHEEL.sum()
    recordings = []
    for load, logs in zip(LOADS, model(truth[None]), strict=True):
        noise = rng.normal(size=(case.cycles, INTERVALS))
        if case.correlated:  # as combustion: low orders are the largest
            spectrum = np.fft.rfft(noise, axis=1)
            spectrum /= 1.0 + 0.3 * np.arange(spectrum.shape[1])
            noise = 3.0 * np.fft.irfft(spectrum, INTERVALS, axis=1)
        noise *= 0.01 * (1.0 + 0.5 * np.cos(MIDDLE))
        level = 5.7 + rng.normal(0.0, 0.01, (case.cycles, 1))
        speed = np.exp(level + logs + np.tile(errors, 2) + noise)
        recordings.append(MeasuredCycles(f"load {load:g}", speed, WIDTH))
    known = _priors(truth, (0.0005, 0.005, None), rng) if case.priors else (None,) * 3
    parameters = [
        Parameter("inertia", 0.018, 0.001, 1.0, *_both(known[0]), scale=0.02),
        Parameter("angle", 0.0, -0.5, 0.5, *_both(known[1]), scale=0.1),
        Parameter("share", 0.05, 0.0 if case.at_bound else -1.0, 1.0, scale=0.05),
    ]
    fit = fit_speeds(model, parameters, recordings, teeth=TEETH if case.wheel else 0)
    return fit, truth


def _priors(
    truth: Floats, deviations: Sequence[float | None], rng: np.random.Generator
) -> list[tuple[float, float] | None]:
    return [
        None if deviation is None else (value + rng.normal(0.0, deviation), deviation)
        for value, deviation in zip(truth.tolist(), deviations, strict=True)
    ]


def _both(prior: tuple[float, float] | None) -> tuple[float | None, float | None]:
    return (None, None) if prior is None else prior
