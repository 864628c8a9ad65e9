"""Least squares of parameters on measured speeds, with what the data can and cannot tell.

The model is linearised in its last step for all that is said of the uncertainty, docs/method.md
section 19. Nothing here knows what the parameters are.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from engine_dyn.types import Booleans, Floats

Loss = Literal["linear", "soft_l1", "huber"]

LARGEST_CONDITION = 300.0
"""Largest condition number that is fitted: ratio of singular values, all columns of length 1.

Above it some combined change of the parameters has less than a 300th of the effect of another one:
errors of the model would determine its size."""

DRAWS = 999  # Number of fits to noise that residuals are compared with

LEAST_LIKELIHOOD = 1.0 / (1 + DRAWS)
"""Least likelihood of noise that the draws can show: the true one may be smaller."""


@dataclass(frozen=True)
class Parameter:
    """Something that is fitted."""

    name: str  # Name of the parameter in messages and results
    # First value of the fit, and bounds of the parameter, which may be infinite.
    start: float
    low: float = -np.inf
    high: float = np.inf
    prior: float | None = None  # Prior value, known without the data
    prior_deviation: float | None = None  # Standard deviation of the prior value
    # Size of a large change of the parameter; steps of differences are a thousandth of it.
    scale: float = 1.0

    def __post_init__(self) -> None:
        """Refuse what is no start between bounds, and a prior without a deviation."""
        if not self.low < self.high:
            raise ValueError(f"{self.name}: from {self.low:g} to {self.high:g}: must ascend")
        if not self.low <= self.start <= self.high:
            raise ValueError(
                f"{self.name}: start {self.start:g} must lie from {self.low:g} to {self.high:g}"
            )
        if (self.prior is None) != (self.prior_deviation is None):
            raise ValueError(f"{self.name}: a prior needs a value and a standard deviation")
        if self.prior is not None and not np.isfinite(self.prior):
            raise ValueError(f"{self.name}: prior {self.prior:g} must be a number")
        if self.prior_deviation is not None and not 0.0 < self.prior_deviation < np.inf:
            raise ValueError(
                f"{self.name}: standard deviation {self.prior_deviation:g} of the prior must be "
                "positive"
            )
        if not self.scale > 0.0:
            raise ValueError(f"{self.name}: scale {self.scale:g} must be positive")


@dataclass(frozen=True, eq=False)
class MeasuredCycles:
    """Speeds of the cycles of one recording, as the wheel shows them."""

    name: str  # Name of the recording
    # Measured speed [rad/s]; cycles count as independent of each other, the intervals of one cycle
    # do not; shape (cycles, intervals)
    speed: Floats
    width: Floats  # Width of the intervals [rad]; shape (intervals,)
    used: Booleans | None = None  # Intervals that count; by default all; shape (intervals,)

    def __post_init__(self) -> None:
        """Refuse fewer than two cycles, and speeds that are none."""
        if self.speed.ndim != 2 or len(self.speed) < 2:
            raise ValueError(
                f"{self.name}: one cycle has no scatter; at least two cycles are needed"
            )
        if self.speed.shape[1:] != self.width.shape:
            raise ValueError(f"{self.name}: {self.width.size} widths, not one for each interval")
        if not (np.isfinite(self.speed).all() and (self.speed > 0.0).all()):
            raise ValueError(f"{self.name}: speeds must be positive numbers")

    @property
    def shapes(self) -> Floats:
        """Logarithm of the speed of each cycle, less its mean over angle."""
        return level_free(np.log(self.speed), self.share)

    @property
    def counted(self) -> Booleans:
        """Intervals that count, shape (intervals,)."""
        return np.ones(self.width.size, dtype=np.bool_) if self.used is None else self.used

    @property
    def share(self) -> Floats:
        """Widths of the intervals that count, 0 for the others [rad]."""
        return np.where(self.counted, self.width, 0.0)

    @property
    def deviation(self) -> Floats:
        """Standard error of the mean over cycles at each interval, from it and its neighbours."""
        variance = self.shapes.var(axis=0, ddof=1)
        # Variances are averaged over a quarter of the intervals to each side: a few cycles give a
        # poor variance of a single interval, and weights that follow the noise make the 95 %
        # intervals too narrow. With noise of low orders, as from combustion, a tenth is too few:
        # the variances of neighbours are then wrong alike.
        reach = round(0.25 * variance.size)
        around = np.arange(-reach, reach + 1)
        near = variance[(np.arange(variance.size)[:, None] + around) % variance.size]
        deviation = np.sqrt(near.mean(axis=1) / len(self.speed))
        # Infinite deviations remove intervals that do not count from all sums.
        return np.where(self.counted, deviation, np.inf)


class Inseparable(ValueError):
    """The data cannot tell the parameters apart."""


@dataclass(frozen=True, eq=False)
class FittedSpeeds:
    """Fitted values, with their uncertainty."""

    parameters: tuple[Parameter, ...]  # Parameters of the fit, in their order
    value: Floats  # Fitted values within the bounds; shape (P,)
    # 95 % intervals, cut off at the bounds. They need not be centred on the value where another
    # value is at its bound; shape (P, 2)
    interval: Floats
    # Covariance of the values; a value at its bound counts with the part of its normal distribution
    # within the bounds; shape (P, P)
    covariance: Floats
    # Covariance of the values and the tooth errors together; shape (P + T, P + T)
    covariance_with_teeth: Floats = field(repr=False)
    # Ratio of the largest to the smallest singular value of the slopes of parameters without
    # priors, all columns of length 1, without the part that the other parameters can imitate.
    condition: float
    # Logarithm of the factor by which each tooth shows too high a speed, and its standard
    # deviation, for intervals that count; empty where the teeth are taken as perfect; shape (T,)
    tooth_error: Floats
    tooth_deviation: Floats
    # Measured less computed shape, in standard errors, for each recording.
    residual: tuple[Floats, ...] = field(repr=False)
    # Sum of the squares of the residuals over the degrees of freedom: intervals that count, less
    # one for each recording, less all unknowns. About 1 for noise alone.
    reduced_chi_square: float
    # Probability that noise like the spread over cycles, with its correlation over angle, leaves
    # residuals as large as these. If it is small, the model lacks an effect, which the 95 %
    # intervals ignore.
    likelihood_of_noise: float

    @property
    def at_bound(self) -> Booleans:
        """Whether each value is at one of its bounds: it might lie beyond."""
        room = [
            min(v - p.low, p.high - v) for p, v in zip(self.parameters, self.value, strict=True)
        ]
        # A value is at its bound within a millionth of the parameter's scale.
        return np.asarray(np.array(room) <= 1e-6 * np.array([p.scale for p in self.parameters]))

    @property
    def deviation(self) -> Floats:
        """Standard deviation of each value."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def correlation(self) -> Floats:
        """Correlations of the values, shape (P, P)."""
        sizes = np.outer(self.deviation, self.deviation)
        none = np.full(sizes.shape, np.nan)
        return np.divide(self.covariance, sizes, out=none, where=sizes > 0.0)


Model = Callable[[Floats], Sequence[Floats]]
"""Function from parameters, shape (n, P), to logarithms of speeds that perfect teeth would show,
for each recording of shape (n, intervals)."""


def level_free(logs: Floats, width: Floats) -> Floats:
    """Logarithms of speeds less their mean over angle: the level is no part of what is fitted."""
    return np.asarray(logs - (logs @ width / width.sum())[..., None])


def fit_speeds(
    model: Model,
    parameters: Sequence[Parameter],
    recordings: Sequence[MeasuredCycles],
    *,
    teeth: int = 0,
    tooth_prior: float | None = None,
    loss: Loss = "linear",
    largest_condition: float = LARGEST_CONDITION,
) -> FittedSpeeds:
    """Fit parameters to the mean speeds of recordings.

    Parameters
    ----------
    model : callable
        Function that computes the speeds of given values.
    parameters : sequence of Parameter
        Parameters to fit.
    recordings : sequence of MeasuredCycles
        Measured speeds; weights come from the spread over cycles.
    teeth : int
        How many intervals of the wheel have errors that are fitted too, the same in all
        recordings; 0 where the wheel is taken as perfect.
    tooth_prior : float, optional
        Standard deviation of these errors [1], where it is known.
    loss : str
        A loss of `scipy.optimize.least_squares`; all but "linear" count large residuals less.
    largest_condition : float
        Above it the fit is refused.

    Raises
    ------
    Inseparable
        Where the data do not tell some of the parameters apart.
    ValueError
        For parameters of one name, or none.

    Notes
    -----
    The covariance is that of estimating equations whose cycles are independent, whatever the
    correlation within a cycle: Liang and Zeger, Biometrika 73 (1986) 13, from memory.
    """
    from scipy.optimize import least_squares

    names = [one.name for one in parameters]
    if not names or len({*names}) < len(names):
        raise ValueError(f"parameters {', '.join(names)}: at least one, each once")
    problem = _Problem(model, tuple(parameters), tuple(recordings), teeth, tooth_prior)
    count, errors = len(parameters), problem.of_teeth.shape[1]
    low = np.append([p.low for p in parameters], np.full(errors, -np.inf))
    high = np.append([p.high for p in parameters], np.full(errors, np.inf))
    start = np.append([p.start for p in parameters], np.zeros(errors))
    problem.check_condition(problem.slopes(start), largest_condition)
    solution = least_squares(
        problem.residuals, start, problem.slopes, bounds=(low, high),
        x_scale=np.append([p.scale for p in parameters], np.full(errors, problem.unit)),
        loss=loss, xtol=1e-10, ftol=1e-12, gtol=1e-12,
    )  # fmt: skip
    unknown = solution.x
    residual, slopes = problem.residuals(unknown), problem.slopes(unknown)
    weight = _weights(residual, loss)
    condition = problem.check_condition(slopes, largest_condition)
    few = np.array([len(recording.speed) - 1 for recording in recordings])
    spreads = problem.spreads_of_scores(slopes, weight)
    every = Unbound.of(slopes, weight, residual, spreads, few, np.ones(unknown.size, dtype=bool))
    inside = np.asarray(solution.active_mask == 0)
    held = every if inside.all() else Unbound.of(slopes, weight, residual, spreads, few, inside)
    step, reach, covariance = beside_bounds(every, held, inside)
    interval = np.stack([unknown + step - reach, unknown + step + reach], axis=1)
    interval = np.clip(interval, low[:, None], high[:, None])[:count]
    deviation = np.sqrt(np.diag(covariance))
    parts = problem.parts(residual)
    told = sum(int(recording.counted.sum()) - 1 for recording in recordings) - unknown.size
    chi = float(np.sum(residual[: problem.measured] ** 2) / told) if told > 0 else float("nan")
    likely = problem.likelihood_of_noise(residual, slopes, weight, held.inverse)
    return FittedSpeeds(
        tuple(parameters), unknown[:count], interval, covariance[:count, :count], covariance,
        condition, unknown[count:], deviation[count:], parts, chi, likely,
    )  # fmt: skip


def _weights(residual: Floats, loss: Loss) -> Floats:
    """Weight of each residual, by the slope of the loss."""
    square = residual**2
    if loss == "soft_l1":
        return np.asarray(1.0 / np.sqrt(1.0 + square))
    if loss == "huber":
        return np.asarray(1.0 / np.maximum(np.sqrt(square), 1.0))
    return np.ones_like(residual)


class _Problem:
    """Residuals and their slopes; the unknowns are the parameters, then tooth errors."""

    def __init__(
        self, model: Model, parameters: tuple[Parameter, ...],
        recordings: tuple[MeasuredCycles, ...], teeth: int, tooth_prior: float | None,
    ) -> None:  # fmt: skip
        self.model, self.parameters, self.recordings = model, parameters, recordings
        self.teeth, self.tooth_prior = teeth, tooth_prior
        for recording in recordings:
            if teeth and recording.width.size % teeth:
                raise ValueError(
                    f"{recording.name}: {recording.width.size} intervals are not whole turns of "
                    f"{teeth}"
                )
        self.shapes = [recording.shapes for recording in recordings]
        self.deviations = [recording.deviation for recording in recordings]
        self.measured = sum(recording.width.size for recording in recordings)
        self.unit = min(float(deviation.min()) for deviation in self.deviations)
        self._priors = sum(p.prior is not None for p in parameters)
        self.fitted = recordings[0].counted[:teeth]
        self.of_teeth = self._slopes_of_teeth()

    def computed(self, values: Floats) -> list[Floats]:
        """Shapes that the model says, for parameters of shape (n, P)."""
        return [
            level_free(np.asarray(logs), recording.share)
            for logs, recording in zip(self.model(values), self.recordings, strict=True)
        ]

    def residuals(self, unknown: Floats) -> Floats:
        """Measured less computed, in standard errors; then what is known without the data."""
        value, errors = np.split(unknown, [len(self.parameters)])
        computed = self.computed(value[None])
        parts = [
            (shapes.mean(axis=0) - said[0]) / deviation
            for shapes, deviation, said in zip(self.shapes, self.deviations, computed, strict=True)
        ]
        known = [
            (here - p.prior) / p.prior_deviation
            for p, here in zip(self.parameters, value, strict=True)
            if p.prior is not None and p.prior_deviation is not None
        ]
        rest = np.zeros(len(self.of_teeth) - self.measured - len(known))
        return np.concatenate([*parts, known, rest]) + self.of_teeth @ errors

    @property
    def _share(self) -> Floats:
        width = self.recordings[0].width[: self.teeth][self.fitted]
        return np.asarray(width / width.sum())

    def _slopes_of_teeth(self) -> Floats:
        """Slopes of the residuals by the tooth errors."""
        blocks = []
        for recording, deviation in zip(self.recordings, self.deviations, strict=True):
            one = np.zeros((recording.width.size, self.teeth))
            if self.teeth:
                one[np.arange(len(one)), np.arange(len(one)) % self.teeth] = 1.0
                one -= recording.share @ one / recording.share.sum()
            blocks.append(-one[:, self.fitted] / deviation[:, None])
        fitted = int(self.fitted.sum())
        blocks.append(np.zeros((self._priors, fitted)))
        if self.teeth:
            # The mean error of all teeth is zero, since their widths make a turn.
            blocks.append(self._share[None] / self.unit)
            if self.tooth_prior is not None:
                blocks.append(np.eye(fitted) / self.tooth_prior)
        return np.vstack(blocks)

    def slopes(self, unknown: Floats) -> Floats:
        """Slopes of all residuals, by central differences of the model in one batch."""
        count = len(self.parameters)
        value = unknown[:count]
        low, high = (
            np.array([getattr(p, side) for p in self.parameters]) for side in ("low", "high")
        )
        # The error of central differences grows with the square of their step.
        step = 1e-3 * np.array([p.scale for p in self.parameters])
        up, down = np.minimum(value + step, high), np.maximum(value - step, low)
        batch = np.tile(value, (2 * count, 1))
        batch[np.arange(count), np.arange(count)] = up
        batch[count + np.arange(count), np.arange(count)] = down
        blocks = []
        for said, deviation in zip(self.computed(batch), self.deviations, strict=True):
            rise = (said[:count] - said[count:]) / (up - down)[:, None]
            blocks.append(-(rise / deviation).T)
        rows = [
            np.eye(count)[i] / p.prior_deviation
            for i, p in enumerate(self.parameters)
            if p.prior_deviation is not None
        ]
        blocks.append(np.reshape(rows, (len(rows), count)))
        blocks.append(np.zeros((len(self.of_teeth) - self.measured - len(rows), count)))
        return np.hstack([np.vstack(blocks), self.of_teeth])

    def check_condition(self, slopes: Floats, largest: float) -> float:
        """Condition number of the slopes; above the largest, Inseparable names the parameters."""
        names = [p.name for p in self.parameters]
        for name, column in zip(names, slopes[: self.measured].T, strict=False):
            if not column.any():
                raise Inseparable(f"{name}: no measured value depends on it")
        # A parameter with a prior may still follow the data: the others must be separable from it.
        known = np.array([p.prior is not None for p in self.parameters])
        teeth = int(self.fitted.sum())
        known = np.append(known, np.full(teeth, self.tooth_prior is not None))
        basis, _ = np.linalg.qr(slopes[:, known])
        left = slopes[:, ~known]
        left = left - basis @ (basis.T @ left)
        length = np.sqrt(np.sum(left**2, axis=0))
        if not left.size:
            return 1.0
        _, singular, rows = np.linalg.svd(left / np.maximum(length, 1e-300), full_matrices=False)
        condition = float(singular[0] / singular[-1]) if singular[-1] > 0.0 else np.inf
        if not condition <= largest:
            weak = np.zeros(slopes.shape[1])
            weak[~known] = np.abs(rows[-1])
            mixed = [n for n, share in zip(names, weak, strict=False) if share > 0.05]
            if np.max(weak[len(names) :], initial=0.0) > 0.05:
                mixed.append("the tooth errors")
            raise Inseparable(
                f"{', '.join(mixed)}: cannot be determined separately from these measurements "
                f"(condition number {condition:.2g}, allowed is {largest:g}); fix one of them, or "
                "give a prior"
            )
        return condition

    def spreads_of_scores(self, slopes: Floats, weight: Floats) -> list[Floats]:
        """Covariances of the slopes' products with the residuals.

        From the single cycles of each recording, and at last from what is known without the data.
        """
        spreads = []
        place = 0
        for shapes, deviation in zip(self.shapes, self.deviations, strict=True):
            rows = slice(place, place + deviation.size)
            place += deviation.size
            each = (shapes - shapes.mean(axis=0)) / deviation
            scores = each @ (weight[rows, None] * slopes[rows])
            count = len(scores)
            spreads.append(np.asarray(scores.T @ scores / (count * (count - 1))))
        known = slopes[self.measured :]
        if self.teeth:  # The zero mean of the tooth errors is exact and adds no spread
            known = np.delete(known, self._priors, axis=0)
        return [*spreads, np.asarray(known.T @ known)]

    def likelihood_of_noise(
        self, residual: Floats, slopes: Floats, weight: Floats, inverse: Floats
    ) -> float:
        """Share of fits to noise, made of cycles with random signs, with larger residuals.

        The wild bootstrap of Wu, Annals of Statistics 14 (1986) 1261, from memory, with cycles in
        place of single values.
        """
        draws = np.random.default_rng(0)
        noise = []
        for shapes, deviation in zip(self.shapes, self.deviations, strict=True):
            count = len(shapes)
            each = (shapes - shapes.mean(axis=0)) / deviation / np.sqrt(count * (count - 1))
            noise.append(draws.choice([-1.0, 1.0], (DRAWS, count)) @ each)
        made = np.hstack([*noise, draws.standard_normal((DRAWS, residual.size - self.measured))])
        left = made - (made * weight) @ slopes @ inverse @ slopes.T
        sizes = np.sum(weight[: self.measured] * left[:, : self.measured] ** 2, axis=1)
        here = np.sum(weight[: self.measured] * residual[: self.measured] ** 2)
        return float((1 + np.count_nonzero(sizes >= here)) / (1 + DRAWS))

    def parts(self, residual: Floats) -> tuple[Floats, ...]:
        """Residuals of each recording."""
        ends = np.cumsum([d.size for d in self.deviations])
        return tuple(np.split(residual[: self.measured], ends[:-1]))


def _inverse_of_curvature(slopes: Floats) -> Floats:
    """Inverse of slopes^T slopes, without the rounding of that product."""
    length = np.linalg.norm(slopes, axis=0)
    root = np.linalg.pinv(slopes / length) / length[:, None]
    return np.asarray(root @ root.T)


@dataclass(frozen=True, eq=False)
class Unbound:
    """The solution that the last linear model has where it is not bound, and its uncertainty."""

    # Inverse of the curvature, and covariance; 0 for fixed unknowns; shape (n, n)
    inverse: Floats
    covariance: Floats
    # Step from the present unknowns, and half widths of the 95 % intervals; shape (n,)
    step: Floats
    reach: Floats

    @classmethod
    def of(
        cls, slopes: Floats, weight: Floats, residual: Floats, spreads: Sequence[Floats],
        few: Floats, free: Booleans,
    ) -> Unbound:  # fmt: skip
        """Solve for the unknowns that are free.

        `few` are the degrees of freedom of each recording's spread; the last spread has all.
        """
        from scipy.stats import t

        inverse = np.zeros((free.size, free.size))
        inverse[np.ix_(free, free)] = _inverse_of_curvature(
            np.sqrt(weight)[:, None] * slopes[:, free]
        )
        shares = [inverse @ spread @ inverse for spread in spreads]
        covariance = np.sum(shares, axis=0)
        variance, parts = np.diag(covariance), np.diagonal(shares, axis1=1, axis2=2)
        # Each recording's variance comes from a few cycles; freedom by Welch and Satterthwaite.
        told = np.sum(parts[:-1] ** 2 / few[:, None], axis=0)
        freedom = np.divide(variance**2, told, out=np.full(free.size, np.inf), where=told > 0.0)
        step = -inverse @ (slopes.T @ (weight * residual))
        return cls(inverse, covariance, step, np.sqrt(variance) * t.ppf(0.975, freedom))


def beside_bounds(every: Unbound, held: Unbound, inside: Booleans) -> tuple[Floats, Floats, Floats]:
    """Steps, half widths and covariance where some unknowns are at their bounds.

    With these held the others would seem too certain, and free they would go beyond the bounds: an
    unknown at its bound is taken to be distributed as its normal distribution is on the side of
    the bound where it may be (moments in Johnson, Kotz and Balakrishnan, Continuous Univariate
    Distributions 1 (1994) 10.1, from memory), and the others follow it along the valley of the sum
    of squares.
    """
    if inside.all():
        return every.step, every.reach, every.covariance
    from scipy.stats import norm

    bound = ~inside
    size, beyond = np.sqrt(np.diag(every.covariance)[bound]), every.step[bound]
    far = np.abs(beyond) / size
    ratio = np.exp(norm.logpdf(far) - norm.logsf(far))
    mean = -np.sign(beyond) * size * (ratio - far)  # The mean lies inwards from the bound
    # Far beyond the bound the variance is lost in rounding; that of an exponential tail is taken.
    tail = 300.0  # Standard deviations beyond the bound from which the tail is exponential to 1e-4
    variance = size**2 * np.where(
        far < tail, 1.0 + far * ratio - ratio**2, np.maximum(far, tail) ** -2
    )
    follow = np.zeros((inside.size, size.size))
    follow[bound] = np.eye(size.size)
    curvature = every.inverse
    follow[inside] = np.linalg.solve(
        curvature[np.ix_(bound, bound)], curvature[np.ix_(bound, inside)]
    ).T
    added = (follow * variance) @ follow.T
    covariance = held.covariance + added
    step = np.where(inside, held.step + follow @ mean, every.step)
    reach = np.sqrt(held.reach**2 + norm.ppf(0.975) ** 2 * np.diag(added))
    return step, np.where(inside, reach, every.reach), covariance
