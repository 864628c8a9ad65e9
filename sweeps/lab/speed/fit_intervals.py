"""How uncertain the unknowns of a least squares fit are, also beside bounds.

docs/method.md section 19, in its last linear model.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from engine_dyn.types import Booleans, Floats

__all__ = ["Unbound", "beside_bounds"]

TAIL = 300.0
"""Standard deviations beyond a bound from which on what is left of a normal distribution is an
exponential one, to 1e-4."""


def _inverse_of_curvature(slopes: Floats) -> Floats:
    """Inverse of slopes^T slopes, without the rounding of that product."""
    length = np.linalg.norm(slopes, axis=0)
    root = np.linalg.pinv(slopes / length) / length[:, None]
    return np.asarray(root @ root.T)


@dataclass(frozen=True, eq=False)
class Unbound:
    """The solution that the last linear model has where it is not bound, and its uncertainty."""

    # Inverse of the curvature, and covariance; 0 for unknowns that are held; shape (n, n)
    inverse: Floats
    covariance: Floats
    # From the unknowns as they are, and half the width of the 95 % intervals; shape (n,)
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
        # Welch and Satterthwaite: what few cycles say of the variance, for each recording.
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
    mean = -np.sign(beyond) * size * (ratio - far)  # from the bound inwards
    # Far beyond the bound the difference is lost in rounding: there the tail is an exponential one.
    variance = size**2 * np.where(
        far < TAIL, 1.0 + far * ratio - ratio**2, np.maximum(far, TAIL) ** -2
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
