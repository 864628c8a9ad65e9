"""Harmonics of the slider-crank's motion and of its inertia torque, exact in the crank ratio.

Without offset, with phi from top dead centre and everything over the crank radius,

    x/r           = a_0 + a_1 cos(phi) + a_2 cos(2 phi) + a_4 cos(4 phi) + ...
    c/(r omega)   =       g_1 sin(phi) + g_2 sin(2 phi) + g_4 sin(4 phi) + ...
    b/(r omega^2) =       b_1 cos(phi) + b_2 cos(2 phi) + b_4 cos(4 phi) + ...

(Rakopoulos notes: a, gamma, beta; Q_nu is beta_nu). Mosakowski measures s = r + l - x from the
crank's axis: his A_2n is -a_2n for n > 0, and his A_0 is 1 + 1/lambda - a_0. Derivatives make
gamma_nu = -nu a_nu and beta_nu = nu gamma_nu; a_1 = -1; there are no other odd orders.

docs/method.md (15) to (18) derives them, and the closed forms of the inertia torque's orders. Its
rho is q = (1 - k')/(1 + k') here, with k' = sqrt(1 - lambda^2). The sums converge as q^2j, where q
is 0.07 at lambda = 0.5: the rest is below `REMAINDER` of the sum, which is why these are called
exact. Power series in lambda, which the sources print, are the expansion of these sums:
`truncated_position` and its derivatives have them.

An offset cylinder has all orders, sines and cosines; its series are not here (`harmonics` takes
the transform of the curves).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from engine_dyn.geometry import slider_crank
from engine_dyn.types import Floats

MOST_TERMS = 1_000_000
AT_ONCE = 1024  # Number of designs whose curves are held at the same time
REMAINDER = 1e-17  # Bound on the neglected rest of a sum, over the sum


def position_coefficients(orders: npt.ArrayLike, crank_ratio: npt.ArrayLike) -> Floats:
    """Coefficients a_nu of cos(nu phi) in x/r; Mosakowski's A_2n is -a_2n.

    Parameters
    ----------
    orders : array_like
        Orders nu above 0, broadcast with `crank_ratio`; half orders and odd ones above 1 have 0.
    crank_ratio : array_like
        lambda = r/l [1], in (0, 1).

    Raises
    ------
    ValueError
        For an order that is not above 0, or a crank ratio outside (0, 1).

    Notes
    -----
    docs/method.md (15) and (16); Mosakowski, eqs. 4, 7; Rakopoulos notes, a_2, a_4, a_6.
    """
    nu, ratio = _checked(orders, crank_ratio)
    even = (nu % 2.0 == 0.0) & (nu > 0.0)
    result = np.where(nu == 1.0, -1.0, 0.0)
    root = np.sqrt((1.0 - ratio) * (1.0 + ratio))
    # This form of q = (1 - k')/(1 + k') does not subtract nearly equal numbers.
    q = (ratio / (1.0 + root)) ** 2
    for order in np.unique(nu[even]):
        here = nu == order
        n = round(float(order) / 2.0)
        result[here] = -(1.0 + root[here]) / ratio[here] * q[here] ** n * _root_series(n, q[here])
    return result


def velocity_coefficients(orders: npt.ArrayLike, crank_ratio: npt.ArrayLike) -> Floats:
    """Coefficients gamma_nu of sin(nu phi) in c/(r omega), for orders nu above 0 and lambda = r/l.

    docs/method.md (16); Mosakowski, eq. 5; Rakopoulos notes, gamma_1 to gamma_6.
    """
    return 0.0 - np.asarray(orders, dtype=float) * position_coefficients(orders, crank_ratio)


def acceleration_coefficients(orders: npt.ArrayLike, crank_ratio: npt.ArrayLike) -> Floats:
    """Coefficients beta_nu of cos(nu phi) in b/(r omega^2), for orders nu above 0 and lambda = r/l.

    docs/method.md (16); Mosakowski, eq. 6; Rakopoulos notes, beta_1 to beta_6, there also Q_nu.
    """
    return 0.0 - np.asarray(orders, dtype=float) ** 2 * position_coefficients(orders, crank_ratio)


def mean_position(crank_ratio: npt.ArrayLike) -> Floats:
    """Mean of x/r over a turn, a_0 [1]. Rakopoulos notes, a_0; 1 + 1/lambda - A_0 of Mosakowski."""
    _, ratio = _checked(1.0, crank_ratio)
    root = np.sqrt((1.0 - ratio) * (1.0 + ratio))
    q = (ratio / (1.0 + root)) ** 2
    # (1 - mean of cos(beta))/lambda, with the rod's angle beta, in a form that does not subtract
    # nearly equal numbers.
    lost = 0.5 * ratio / (1.0 + root) - 0.5 * (1.0 + root) * _root_series(0, q, rest=True) / ratio
    return np.asarray(1.0 + lost)


def inertia_torque_coefficients(orders: npt.ArrayLike, crank_ratio: npt.ArrayLike) -> Floats:
    """Coefficients t_n of sin(n phi) in the inertia torque over m r^2 omega^2, at constant speed.

    docs/method.md (17) and (18), a closed form for any order n above 0 and lambda in (0, 1).
    Rakopoulos notes, Delta T_l of orders 1 to 6 (the second is misprinted there).
    """
    nu, ratio = _checked(orders, crank_ratio)
    root = np.sqrt((1.0 - ratio) * (1.0 + ratio))
    q = (ratio / (1.0 + root)) ** 2
    odd, even = nu % 2.0 == 1.0, nu % 2.0 == 0.0
    result = np.zeros(nu.shape)
    if odd.any():
        after = velocity_coefficients(nu[odd] + 1.0, ratio[odd])
        before = np.zeros(after.shape)
        more = nu[odd] > 1.0
        before[more] = velocity_coefficients(nu[odd][more] - 1.0, ratio[odd][more])
        result[odd] = 0.5 * nu[odd] * (after - before)
    half = np.rint(0.5 * nu[even])
    sign = np.where(half % 2.0 == 0.0, -1.0, 1.0)
    square = sign * nu[even] * root[even] * q[even] ** (half - 1.0) / (1.0 + root[even]) ** 2
    result[even] = np.where(half == 1.0, -0.5 * (1.0 + q[even] ** 2), square)
    return result


def truncated_position(
    phi: npt.ArrayLike, crank_ratio: npt.ArrayLike, highest: npt.ArrayLike
) -> Any:
    """Piston travel x/r by the truncated series. Mosakowski, eqs. 9 and 4 with 17 (from s there).

    Parameters
    ----------
    phi, crank_ratio : array_like
        As in `slider_crank.position`.
    highest : array_like
        Highest order kept, even: 2 drops powers of lambda from the third on, 4 from the fifth on.

    Raises
    ------
    ValueError
        For a highest order that is not 2, 4, 6, ...; crank ratios outside (0, 1).
    """
    return _truncated(phi, crank_ratio, highest, 0)


def truncated_velocity(
    phi: npt.ArrayLike, crank_ratio: npt.ArrayLike, highest: npt.ArrayLike
) -> Any:
    """Piston velocity c/(r omega) at `phi` [rad] by the series up to the order `highest`.

    Mosakowski, eqs. 12 and 5 with 17 (12 is printed with omega^2).
    """
    return _truncated(phi, crank_ratio, highest, 1)


def truncated_acceleration(
    phi: npt.ArrayLike, crank_ratio: npt.ArrayLike, highest: npt.ArrayLike
) -> Any:
    """Piston acceleration b/(r omega^2) at `phi` [rad] by the series up to the order `highest`.

    cos + lambda cos(2 phi) for 2, with (lambda + lambda^3/4) cos(2 phi) - lambda^3/4 cos(4 phi) for
    4. Exact at both dead centres, whatever the highest order: there all powers of lambda from the
    third on cancel. Mosakowski, eqs. 13 and 18 (18 is printed without its sign).
    """
    return _truncated(phi, crank_ratio, highest, 2)


def truncation_error(crank_ratio: npt.ArrayLike, highest: npt.ArrayLike, derivative: int) -> Any:
    """Largest error of a truncated series over the largest exact value [1].

    `derivative` is 0 for travel (over the stroke), 1 for velocity, 2 for acceleration (over that at
    top dead centre). Travel and acceleration have their largest error at 90 degrees; Mosakowski,
    eq. 16 is that of the acceleration with two orders:
    lambda/(1 + lambda) (1/sqrt(1 - lambda^2) - 1). Found on 1440 points of a half turn, 90 degrees
    among them: exact for these two, for the velocity to 1e-5 of itself.
    """
    if derivative not in (0, 1, 2):
        raise ValueError(f"derivative = {derivative}: must be 0, 1 or 2")
    exact = (slider_crank.position, slider_crank.velocity, slider_crank.acceleration)[derivative]
    ratio, kept = np.broadcast_arrays(np.asarray(crank_ratio, dtype=float), np.asarray(highest))
    phi = np.linspace(0.0, np.pi, 1441)
    result = np.empty(ratio.size)
    for begin in range(0, ratio.size, AT_ONCE):
        here = slice(begin, begin + AT_ONCE)
        own, most = ratio.reshape(-1)[here, None], kept.reshape(-1)[here, None]
        curve = exact(phi, own)
        off = np.abs(_truncated(phi, own, most, derivative) - curve)
        result[here] = off.max(axis=-1) / np.abs(curve).max(axis=-1)
    return result.reshape(ratio.shape)[()]


def checked_orders(orders: npt.ArrayLike, most: float = np.inf) -> Floats:
    """Orders as an array.

    Raises
    ------
    ValueError
        For an order that is not above 0, not finite, or above `most`.
    """
    nu = np.asarray(orders, dtype=float)
    good = (nu > 0.0) & (nu <= most) & np.isfinite(nu)
    if not good.all():
        limit = f" and at most {most:g}" if np.isfinite(most) else ""
        raise ValueError(f"order = {nu[~good].flat[0]:g}: must be above 0{limit}")
    return nu


def _checked(orders: npt.ArrayLike, crank_ratio: npt.ArrayLike) -> tuple[Floats, Floats]:
    nu, ratio = np.broadcast_arrays(
        np.asarray(orders, dtype=float), np.asarray(crank_ratio, dtype=float)
    )
    if not np.all((ratio > 0.0) & (ratio < 1.0)):
        bad = ratio[~((ratio > 0.0) & (ratio < 1.0))].flat[0]
        raise ValueError(f"crank_ratio = {bad:g}: must lie between 0 and 1, both excluded")
    return checked_orders(nu), ratio


def _root_series(n: int, q: Floats, *, rest: bool = False) -> Floats:
    """Sum over j of binom(1/2, n + j) binom(1/2, j) q^2j; without its first term with `rest`."""
    first = 1.0
    for i in range(n):
        first *= (0.5 - i) / (i + 1.0)
    term = np.full(q.shape, first)
    total = np.zeros(q.shape) if rest else term.copy()
    square = q * q
    bound = square / (1.0 - square)  # terms of the sum decrease at least as fast as square^j
    j, block = 0, 16
    while True:
        step = j + np.arange(block)
        factor = (0.5 - step) * (0.5 - n - step) / ((step + 1.0) * (n + step + 1.0))
        terms = term[..., None] * np.cumprod(factor * square[..., None], axis=-1)
        total = total + terms.sum(axis=-1)
        term = terms[..., -1]
        if np.all(np.abs(term) * bound <= REMAINDER * np.abs(total)):
            return total
        j, block = j + block, min(2 * block, max(16, MOST_TERMS // max(q.size, 1)))


def _truncated(
    phi: npt.ArrayLike, crank_ratio: npt.ArrayLike, highest: npt.ArrayLike, derivative: int
) -> Any:
    angle = np.asarray(phi, dtype=float)
    _, ratio = _checked(1.0, crank_ratio)
    kept = np.asarray(highest)
    if not np.all((kept >= 2) & (kept % 2 == 0)):
        bad = kept[~((kept >= 2) & (kept % 2 == 0))].flat[0]
        raise ValueError(f"highest order = {bad:g}: must be 2, 4, 6 or another even number")
    total = (1.0 - np.cos(angle), np.sin(angle), np.cos(angle))[derivative]
    for terms in range(1, int(kept.max()) // 2 + 1):
        # All terms with the power lambda^(2 terms - 1) are kept or dropped together.
        part = _of_power(angle, terms, derivative) * ratio ** (2 * terms - 1)
        total = total + np.where(kept >= 2 * terms, part, 0.0)
    return total


def _of_power(angle: Floats, power: int, derivative: int) -> Any:
    """Factors of lambda^(2 power - 1) in (1 - W)/lambda, or its derivatives, order by order."""
    binomial = 1.0
    for i in range(power):
        binomial *= (0.5 - i) / (i + 1.0)
    # W = cos(beta) is the sum over k of binom(1/2, k) (-1)^k (lambda sin(phi))^2k. The power of the
    # sine becomes a sum of cosines of multiples of 2 phi.
    weight = -binomial * (-1.0) ** power / 4.0**power
    total: Any = 0.0
    for n in range(power + 1):
        ways = math.comb(2 * power, power - n) * (-1.0) ** n * (2.0 if n else 1.0)
        turn = 2.0 * n * angle
        wave = (np.cos(turn), -2.0 * n * np.sin(turn), -4.0 * n * n * np.cos(turn))[derivative]
        total = total + weight * ways * wave
    return total
