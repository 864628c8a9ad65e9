"""The periodic crank speed of one design, by adaptive integration and shooting.

Everything here is derived from three statements and written for clarity, not for speed.

1. Slider-crank.  With the crank radius ``r`` and the rod ``l = r / crank_ratio`` the piston is
   ``x / r = 1 - cos phi + (1 - sqrt(1 - lambda^2 sin^2 phi)) / lambda`` below top dead centre;
   ``v`` and ``b`` are the first and second derivatives of that by ``phi``.
2. Virtual work.  A force ``F`` on the piston is the torque ``F r v`` on the crank, so the gas
   gives ``(p - p_crankcase) A r v`` and, at the constant speed ``omega_n``, the piston's inertia
   ``-m r^2 omega_n^2 b v``.  ``M(phi)`` is the sum over evenly firing cylinders less friction.
3. Energy.  The kinetic energy grows by the work done:
   ``dT/dphi = M - a - k omega^alpha``, with

   * ``constant`` inertia: ``T = Theta omega^2 / 2``, the piston's inertia being a torque in ``M``;
   * ``variable`` inertia: ``T = Theta(phi) omega^2 / 2`` with
     ``Theta(phi) = Theta + m r^2 sum_i (v_i^2 - mean v^2)``, the piston's inertia being in ``T``
     and ``M`` holding gas and friction only.

Scaled with ``e = 2 T / (Theta omega_n^2)``, ``theta = Theta(phi) / Theta``,
``u = e / theta = (omega / omega_n)^2`` and the nominal load ``L = k omega_n^alpha``, and with the
mean of statement 3 over the cycle, ``L c = mean M - a`` where ``c = mean (omega/omega_n)^alpha``,

    ``e(phi) = e_0 + w(phi) - kappa J(phi)``,      ``kappa = 2 (mean M - a) / (Theta omega_n^2)``,
    ``w' = 2 (M - mean M) / (Theta omega_n^2)``,   ``J' = u^(alpha/2) / c - 1``.

``w`` is periodic by itself, so a steady cycle is ``J(4 pi) = 0``.  Shooting for that instead of
for ``e(4 pi) = e_0`` loses no digits when the load is weak.  Unknown are ``e_0`` and ``c``:

* ``power_mean``: ``c = 1``; for ``alpha = 0`` (``J`` vanishes identically) and for ``k = 0``
  (it has no effect) the mean of ``log u``, or of ``u^(alpha/2) - 1``, fixes ``e_0``;
* ``cycle_time``: the mean of ``u^(-1/2)`` is 1.

The cycle's duration grows beyond all bounds, though only with the logarithm, as the smallest speed
falls to zero, so ``cycle_time`` has a positive solution for every smooth torque; ``FLOOR`` decides
what still counts as running.  With ``power_mean`` the limit is a sharp one.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq, minimize_scalar

CYCLE = 4.0 * math.pi
FLOOR = 1e-4  # of (omega/omega_n)^2: a hundredth of the nominal speed is a standstill
RELATIVE, ABSOLUTE = 1e-12, 1e-13  # of the integration
IDLE = 1e-9  # |mean M - a| within this share of max M - min M is no load at all

Array = NDArray[np.float64]
Curve = Callable[[Any], Any]


@dataclass(frozen=True)
class Design:
    """One four-stroke engine at one operating point, in SI units.

    Attributes
    ----------
    pressure : callable
        Absolute cylinder pressure [Pa] over the crank angle [rad], 0 at firing top dead centre,
        of period 4 pi.  Called with arrays.
    bore, stroke : float
        In m.
    crank_ratio : float
        Crank radius over rod length.
    reciprocating_mass : float
        Of one cylinder, kg.
    inertia : float
        Of the whole engine with its load, kg m2; the cycle mean if the model is ``variable``.
    speed_rpm : float
        Nominal speed.
    cylinders : int
        Evenly firing.
    load_exponent, load_offset : float
        alpha and a [N m] of the load torque ``a + k omega^alpha``.
    friction_torque : float
        Of the whole engine, N m, subtracted.
    crankcase_pressure : float
        Pa.
    inertia_model : str
        ``"constant"`` or ``"variable"``.
    closure : str
        ``"power_mean"`` or ``"cycle_time"``.
    offset : float
        Of the piston pin's line from the crank's axis [m], positive where the crank pin goes down.
    firing_angles : tuple of float, optional
        Crank angle at which each cylinder fires [rad]; evenly spaced if not given.
    pressure_factors, mass_factors : tuple of float, optional
        f of each cylinder in ``p = p_motored + f (p - p_motored)``, and on its mass; 1 by default.
    motored : callable, optional
        Pressure without combustion.
    radius_factors : tuple of float, optional
        Crank radius of each cylinder over that of the engine; 1 by default.
    friction_shares : tuple of float, optional
        Boundary, mixed, hydrodynamic and skirt shares of the mean friction; the rest is constant.
    ring_pressure : float
        Of the rings on the liner by their own tension [Pa].
    """

    pressure: Curve
    bore: float
    stroke: float
    crank_ratio: float
    reciprocating_mass: float
    inertia: float
    speed_rpm: float
    cylinders: int = 1
    load_exponent: float = 2.0
    load_offset: float = 0.0
    friction_torque: float = 0.0
    crankcase_pressure: float = 101325.0
    inertia_model: str = "constant"
    closure: str = "power_mean"
    offset: float = 0.0
    firing_angles: tuple[float, ...] | None = None
    pressure_factors: tuple[float, ...] | None = None
    mass_factors: tuple[float, ...] | None = None
    motored: Curve | None = None
    radius_factors: tuple[float, ...] | None = None
    friction_shares: tuple[float, ...] | None = None
    ring_pressure: float = 0.0

    @property
    def masses(self) -> Array:
        """Reciprocating mass of every cylinder [kg]."""
        factors = np.ones(self.cylinders) if self.mass_factors is None else self.mass_factors
        return self.reciprocating_mass * np.asarray(factors)

    @cached_property
    def radius(self) -> float:
        """Crank radius [m]: the one whose two dead centres are a stroke apart."""
        if self.offset == 0.0:
            return self.stroke / 2.0

        def excess(radius: float) -> float:
            rod = radius / self.crank_ratio
            heights = [math.sqrt((rod + s * radius) ** 2 - self.offset**2) for s in (1.0, -1.0)]
            return heights[0] - heights[1] - self.stroke

        return float(brentq(excess, 0.4 * self.stroke, 0.5 * self.stroke, xtol=1e-16))

    def cylinder_pressures(self, angle: Array) -> Array:
        """Pressure in every cylinder [Pa] at its own angle, cylinders along the last axis."""
        pressure = np.asarray(self.pressure(angle))
        if self.pressure_factors is None:
            return pressure
        assert self.motored is not None
        motored = np.asarray(self.motored(angle))
        return np.asarray(motored + np.asarray(self.pressure_factors) * (pressure - motored))

    @property
    def omega_n(self) -> float:
        """Nominal speed in rad/s."""
        return self.speed_rpm * math.pi / 30.0

    @property
    def fmep(self) -> float:
        """Friction mean effective pressure [Pa] that makes ``friction_torque``."""
        swept = self.cylinders * math.pi / 4.0 * self.bore**2 * self.stroke
        return self.friction_torque * CYCLE / swept


@dataclass(frozen=True)
class Solution:
    """What `solve` found; NaN (or a callable giving NaN) where there is no steady speed.

    Attributes
    ----------
    status : str
        ``"converged"``, ``"stalled"``, ``"no_steady_state"`` or ``"invalid_input"``.
    omega_mean, omega_max, omega_min : float
        rad/s, the mean over the crank angle.
    delta : float
        ``(omega_max - omega_min) / omega_mean``.
    k : float
        Load coefficient, N m s^alpha.
    load_torque_nominal : float
        ``k omega_n^alpha``, N m.
    energy_swing : float
        Largest less smallest kinetic energy in the cycle, J.
    torque_mean, torque_max, torque_min : float
        Of ``M`` at the constant nominal speed (with the inertia torque), N m.
    omega : callable
        Speed [rad/s] at any crank angles [rad].
    torque : callable
        ``M`` [N m] at the constant nominal speed at any crank angles.
    """

    status: str
    omega_mean: float
    omega_max: float
    omega_min: float
    delta: float
    k: float
    load_torque_nominal: float
    energy_swing: float
    torque_mean: float
    torque_max: float
    torque_min: float
    omega: Curve
    torque: Curve


@dataclass(frozen=True)
class Problem:
    """The equation of motion without its origin: a torque, an inertia and a load law.

    ``torque`` [N m] does the work that changes the kinetic energy, ``inertia_ratio`` is
    Theta(phi)/Theta and ``inertia_slope`` its derivative, all over the crank angle.
    ``torque_mean`` is the mean of ``torque``; ``torque_range`` [N m] decides what is no load.
    ``law`` takes the place of ``u^(alpha/2)``: its value, 1 at ``u = 1``, and its slope; ``sign``
    is that of the slope, -1 for a driver, whose torque falls with the speed.
    """

    torque: Curve
    torque_mean: float
    torque_range: float
    inertia: float
    inertia_ratio: Curve
    inertia_slope: Curve
    omega_n: float
    load_exponent: float
    load_offset: float
    closure: str
    law: Callable[[float], tuple[float, float]] | None = None
    sign: float = 1.0


@dataclass(frozen=True)
class Speed:
    """Periodic solution of a `Problem`, in the units of `Solution`."""

    status: str
    omega_mean: float = math.nan
    omega_max: float = math.nan
    omega_min: float = math.nan
    load_torque_nominal: float = math.nan
    energy_swing: float = math.nan
    omega: Curve = lambda phi: np.full(np.shape(phi), np.nan)


# Geometry -----------------------------------------------------------------------------------------


def position(phi: ArrayLike, crank_ratio: float, offset: float = 0.0) -> Array:
    """Piston travel from top dead centre over the crank radius, statement 1 of the module.

    With an offset (over the crank radius) the pin's height is ``cos theta + sqrt(rod^2 - (sin theta
    - offset)^2)``, the crank and rod in line at the top: ``sin theta_top = offset / (rod + 1)``.
    """
    rod = 1.0 / crank_ratio
    angle = _theta(phi, rod, offset)
    highest = math.sqrt((rod + 1.0) ** 2 - offset**2)
    return np.asarray(highest - np.cos(angle) - np.sqrt(rod**2 - (np.sin(angle) - offset) ** 2))


def velocity(phi: ArrayLike, crank_ratio: float, offset: float = 0.0) -> Array:
    """First derivative of `position` by the crank angle."""
    rod = 1.0 / crank_ratio
    angle = _theta(phi, rod, offset)
    sine, cosine = np.sin(angle), np.cos(angle)
    side = sine - offset
    return np.asarray(sine + side * cosine / np.sqrt(rod**2 - side**2))


def acceleration(phi: ArrayLike, crank_ratio: float, offset: float = 0.0) -> Array:
    """Second derivative of `position` by the crank angle."""
    rod = 1.0 / crank_ratio
    angle = _theta(phi, rod, offset)
    sine, cosine = np.sin(angle), np.cos(angle)
    side = sine - offset
    root = np.sqrt(rod**2 - side**2)
    return np.asarray(cosine + (cosine**2 - side * sine) / root + (side * cosine) ** 2 / root**3)


def _theta(phi: ArrayLike, rod: float, offset: float) -> Array:
    """Angle of the crank to the cylinder at the engine's angle ``phi``."""
    angle = np.asarray(phi, dtype=float)
    return angle if offset == 0.0 else np.asarray(angle + math.asin(offset / (rod + 1.0)))


# Torques ------------------------------------------------------------------------------------------


def _crank_angles(design: Design, phi: ArrayLike) -> Array:
    """Angle of every cylinder's own crank, shape ``(..., cylinders)``."""
    shift = np.arange(design.cylinders) * CYCLE / design.cylinders
    if design.firing_angles is not None:
        shift = -np.asarray(design.firing_angles)
    return np.asarray(np.asarray(phi, dtype=float)[..., None] + shift)


def _speeds(design: Design, angle: Array) -> Array:
    """Piston velocity of every cylinder over the engine's crank radius and speed."""
    return _of_throws(design, angle, velocity)


def _rates(design: Design, angle: Array) -> Array:
    """Derivative of `_speeds` by the crank angle."""
    return _of_throws(design, angle, acceleration)


def _of_throws(design: Design, angle: Array, motion: Callable[..., Array]) -> Array:
    offset = design.offset / design.radius
    if design.radius_factors is None:
        return motion(angle, design.crank_ratio, offset)
    # The same rod and offset on another throw: r_i/l, e/r_i and x/r = (x/r_i)(r_i/r); each turns
    # by its own angle from its own top dead centre.
    return np.stack(
        [
            factor * motion(angle[..., i], design.crank_ratio * factor, offset / factor)
            for i, factor in enumerate(design.radius_factors)
        ],
        axis=-1,
    )


def gas_torque(design: Design, phi: ArrayLike) -> Array:
    """Torque of the gas on all pistons [N m], shape of ``phi``."""
    angle = _crank_angles(design, phi)
    over = design.cylinder_pressures(angle) - design.crankcase_pressure
    force = over * math.pi / 4.0 * design.bore**2
    return np.asarray(np.sum(force * design.radius * _speeds(design, angle), axis=-1))


def inertia_torque(design: Design, phi: ArrayLike) -> Array:
    """Torque of all pistons' inertia at the nominal speed [N m], shape of ``phi``."""
    angle = _crank_angles(design, phi)
    product = _speeds(design, angle) * _rates(design, angle)
    factor = (design.radius * design.omega_n) ** 2
    return np.asarray(-factor * np.sum(design.masses * product, axis=-1))


def friction_torque(design: Design, phi: ArrayLike) -> Array:
    """Friction torque of all cylinders [N m], each an equal share of the mean, shape of ``phi``."""
    if design.friction_shares is None:
        return np.full(np.shape(phi), design.friction_torque)
    shares = np.asarray(design.friction_shares)
    one = 1.0 - shares.sum() + friction_regimes(design, phi) / friction_means(design) @ shares
    return np.asarray(one.sum(axis=-1) * design.friction_torque / design.cylinders)


def friction_regimes(design: Design, phi: ArrayLike) -> Array:
    """Force times lever of each regime of lubrication, shape ``(..., cylinders, 4)``.

    With the speed of the piston u and the load N on its rings: dry friction, mu N u; mixed, mu
    falling with the speed as 1 - |sin|; hydrodynamic, mu = sqrt(u/N); a film of given thickness.
    """
    angle = _crank_angles(design, phi)
    over = design.cylinder_pressures(angle) - design.crankcase_pressure
    load = np.maximum(over + design.ring_pressure, 0.0)
    speed = np.abs(_speeds(design, angle))
    dry = load * speed
    mixed = dry * (1.0 - np.abs(np.sin(angle)))
    return np.stack([dry, mixed, load * np.sqrt(speed / load) * speed, speed**2], axis=-1)


@cache
def friction_means(design: Design) -> Array:
    """Cycle means of `friction_regimes`, shape ``(cylinders, 4)``."""
    # Every cylinder at its own angle, so that the dead centres lie at the ends of pieces.
    together = replace(design, firing_angles=(0.0,) * design.cylinders)

    def mean(i: int, regime: int) -> float:
        return cycle_mean(lambda phi: friction_regimes(together, phi)[..., i, regime])

    return np.array([[mean(i, regime) for regime in range(4)] for i in range(design.cylinders)])


def total_torque(design: Design, phi: ArrayLike) -> Array:
    """Gas, inertia and friction at the nominal speed [N m], shape of ``phi``."""
    angle = _crank_angles(design, phi)
    radius = design.radius
    over = design.cylinder_pressures(angle) - design.crankcase_pressure
    gas = over * math.pi / 4.0 * design.bore**2
    inertia = -design.masses * radius * design.omega_n**2
    force = gas + inertia * _rates(design, angle)
    torque = np.sum(force * radius * _speeds(design, angle), axis=-1)
    return np.asarray(torque - friction_torque(design, phi))


def cycle_mean(curve: Curve) -> float:
    """Mean of a curve over the cycle, by adaptive quadrature on 32 pieces."""
    edges = np.linspace(-CYCLE / 2.0, CYCLE / 2.0, 33)
    scale = float(np.max(np.abs(curve(np.linspace(0.0, CYCLE, 721)))))
    total = 0.0
    for left, right in pairwise(edges):
        value, _ = quad(
            lambda phi: float(curve(phi)),
            left,
            right,
            epsabs=1e-14 * scale,
            epsrel=1e-13,
            limit=200,
        )
        total += value
    return total / CYCLE


def mean_torque(design: Design) -> float:
    """Cycle mean of the whole torque [N m]: the gas of each cylinder, less friction."""

    def mean_of(pressure: Curve, radius: float) -> float:
        def one(phi: float) -> float:
            offset = design.offset / (radius * design.radius)
            lever = radius * design.radius * velocity(phi, design.crank_ratio * radius, offset)
            return float(pressure(np.asarray(phi)) * math.pi / 4.0 * design.bore**2 * lever)

        # The crankcase pressure does no work over a cycle, and neither does the inertia.
        return cycle_mean(np.vectorize(one, otypes=[float]))

    radii = design.radius_factors or (1.0,) * design.cylinders
    gas = {radius: mean_of(design.pressure, radius) for radius in set(radii)}
    whole = sum(gas[radius] for radius in radii)
    if design.pressure_factors is not None:
        assert design.motored is not None
        motored = {radius: mean_of(design.motored, radius) for radius in set(radii)}
        whole = sum(
            motored[radius] + factor * (gas[radius] - motored[radius])
            for factor, radius in zip(design.pressure_factors, radii, strict=True)
        )
    return whole - design.friction_torque


def extreme_values(curve: Curve, step: float = CYCLE / 7200.0) -> tuple[float, float]:
    """Smallest and largest value of a smooth curve in the cycle.

    Samples, then a bounded search around every sample that could be the extreme.
    """
    grid = np.arange(0.0, CYCLE, step)
    values = np.asarray(curve(grid))
    found = []
    for sign in (1.0, -1.0):
        signed = sign * values
        near = signed <= signed.min() + 1e-3 * np.ptp(signed)
        local = near & (signed <= np.roll(signed, 1)) & (signed <= np.roll(signed, -1))
        candidates = [float(signed.min())]
        for angle in grid[local][:64]:
            search = minimize_scalar(
                lambda phi, s=sign: s * float(curve(phi)),
                bounds=(angle - step, angle + step),
                method="bounded",
                options={"xatol": 1e-9},
            )
            candidates.append(float(search.fun))
        found.append(sign * min(candidates))
    return found[0], found[1]


# Inertia ------------------------------------------------------------------------------------------


def _varying_inertia(design: Design) -> tuple[Curve, Curve]:
    """Theta(phi)/Theta and its derivative for the inertia model of the design."""
    if design.inertia_model == "constant":
        return (lambda phi: 1.0), (lambda phi: 0.0)
    if design.inertia_model != "variable":
        raise ValueError(f"inertia_model is constant or variable, not {design.inertia_model!r}")
    share = design.masses * design.radius**2 / design.inertia
    offset = design.offset / design.radius

    def mean(radius: float) -> float:
        ratio = design.crank_ratio * radius
        return cycle_mean(lambda phi: (radius * velocity(phi, ratio, offset / radius)) ** 2)

    means = np.array([mean(radius) for radius in design.radius_factors or (1.0,)])

    def ratio(phi: ArrayLike) -> Array:
        squares = _speeds(design, _crank_angles(design, phi)) ** 2
        return np.asarray(1.0 + np.sum(share * (squares - means), axis=-1))

    def slope(phi: ArrayLike) -> Array:
        angle = _crank_angles(design, phi)
        product = _speeds(design, angle) * _rates(design, angle)
        return np.asarray(np.sum(2.0 * share * product, axis=-1))

    return ratio, slope


# Shooting -----------------------------------------------------------------------------------------


class _Stalled(Exception):
    """The speed reached zero inside the cycle."""


# Order of the integrated quantities: see the module for w, J and C, here with the derivatives of
# J and C by e_0 and c; A is the integral of sqrt(u) - 1, for the mean speed.
W, J, J_E, J_C, C, C_E, C_C, A = range(8)


def _equations(
    problem: Problem, kappa: float, start: float, level: float
) -> Callable[[float, Array], list[float]]:
    """Right-hand side in the order above, for ``e_0 = start`` and ``c = level``."""
    half = problem.load_exponent / 2.0
    scale = 2.0 / (problem.inertia * problem.omega_n**2)

    def right(phi: float, state: Array) -> list[float]:
        theta = float(problem.inertia_ratio(phi))
        u = max((start + state[W] - kappa * state[J]) / theta, 0.5 * FLOOR)
        u_e = (1.0 - kappa * state[J_E]) / theta
        u_c = -kappa * state[J_C] / theta
        if problem.law is None:
            power = u**half
            power_u = half * power / u
        else:
            power, power_u = problem.law(u)
        if problem.closure == "cycle_time":
            closing, closing_u = 1.0 - u**-0.5, 0.5 * u**-1.5
        elif problem.law is not None:
            closing, closing_u = problem.sign * (power - 1.0), problem.sign * power_u
        elif half == 0.0:
            closing, closing_u = 0.5 * math.log(u), 0.5 / u
        else:
            closing, closing_u = power - 1.0, power_u
        return [
            scale * (float(problem.torque(phi)) - problem.torque_mean),
            power / level - 1.0,
            power_u * u_e / level,
            power_u * u_c / level - power / level**2,
            closing,
            closing_u * u_e,
            closing_u * u_c,
            math.sqrt(u) - 1.0,
        ]

    return right


def _sweep(problem: Problem, kappa: float, start: float, level: float, dense: bool = False) -> Any:
    """Integrate one cycle from ``phi = 0``; raises `_Stalled` when the speed reaches zero."""

    def standstill(phi: float, state: Array) -> float:
        theta = float(problem.inertia_ratio(phi))
        return float((start + state[W] - kappa * state[J]) / theta - FLOOR)

    standstill.terminal = True  # type: ignore[attr-defined]
    if standstill(0.0, np.zeros(8)) <= 0.0:
        raise _Stalled
    run = solve_ivp(
        _equations(problem, kappa, start, level),
        (0.0, CYCLE),
        np.zeros(8),
        method="DOP853",
        rtol=RELATIVE,
        atol=ABSOLUTE,
        events=standstill,
        dense_output=dense,
        # Between the steps the interpolant is only of order 7: short steps where it is used.
        max_step=math.radians(5.0 if dense else 20.0),
    )
    if run.status == 1:
        raise _Stalled
    if not run.success:
        raise RuntimeError(run.message)
    return run


def _increasing_root(function: Callable[[float], tuple[float, float]], guess: float) -> float:
    """Root of an increasing function from value and slope, by Newton inside a bracket.

    The function raises `_Stalled` where it does not exist, which is below some argument.  If it
    is positive wherever it exists, there is no root and `_Stalled` is raised.
    """
    low, high = 0.0, math.inf
    low_is_stalled = True
    x = guess
    for _ in range(200):
        try:
            value, slope = function(x)
        except _Stalled:
            low, low_is_stalled = x, True
            x = 2.0 * x if math.isinf(high) else 0.5 * (low + high)
        else:
            if value > 0.0:
                high = x
            else:
                low, low_is_stalled = x, False
            step = -value / slope
            # Newton is quadratic: a step this small leaves an error of the order of its square.
            if abs(step) < 1e-7 * abs(x):
                return x + step
            trial = x + step
            x = trial if low < trial < high else 0.5 * (low + min(high, 4.0 * x))
        if low_is_stalled and high - low < 0.1 * FLOOR * high:
            raise _Stalled
        if not low_is_stalled and high - low < 1e-15 * high:
            return x
    raise RuntimeError("the root was not found")


def _shoot(problem: Problem, kappa: float) -> tuple[float, float]:
    """``e_0`` and ``c`` of the periodic solution; raises `_Stalled` if there is none."""
    alpha = problem.load_exponent
    falling = problem.law is not None or alpha > 0.0
    both = problem.closure == "cycle_time" and falling and kappa != 0.0

    def closing(start: float) -> tuple[float, float]:
        end = _sweep(problem, kappa, start, 1.0).y[:, -1]
        return float(end[C]), float(end[C_E])

    if not both:
        return _increasing_root(closing, 1.0), 1.0

    # Two unknown. First e_0 for a fixed c, from which Newton starts for both.
    level = 1.0
    for _ in range(12):

        def returning(start: float, level: float = level) -> tuple[float, float]:
            end = _sweep(problem, kappa, start, level).y[:, -1]
            return problem.sign * float(end[J]), problem.sign * float(end[J_E])

        try:
            guess = level ** (2.0 / alpha) if problem.law is None else 1.0
            start = _increasing_root(returning, guess)
            break
        except _Stalled:
            level *= 2.0
    else:
        raise _Stalled

    def residual(start: float, level: float) -> tuple[Array, Array]:
        end = _sweep(problem, kappa, start, level).y[:, -1]
        return end[[J, C]], np.array([[end[J_E], end[J_C]], [end[C_E], end[C_C]]])

    value, matrix = residual(start, level)
    for _ in range(60):
        step = -np.linalg.solve(matrix, value)
        if abs(step[0]) < 1e-7 * start and abs(step[1]) < 1e-7 * level:
            return start + float(step[0]), level + float(step[1])
        share = 1.0
        while share > 1e-10:
            trial = (start + share * float(step[0]), level + share * float(step[1]))
            try:
                if min(trial) <= 0.0:
                    raise _Stalled
                new_value, new_matrix = residual(*trial)
                if math.hypot(*new_value) < max(math.hypot(*value), 1e-10):
                    break
            except _Stalled:
                pass
            share *= 0.5
        else:
            raise _Stalled
        (start, level), value, matrix = trial, new_value, new_matrix
    raise RuntimeError("the periodic solution was not found")


def _zero_slope_extremes(value: Curve, slope: Curve) -> tuple[float, float]:
    """Smallest and largest ``value`` in the cycle, at roots of its ``slope``."""
    step = CYCLE / 7200.0
    grid = np.arange(0.0, CYCLE, step)
    samples = np.asarray(value(grid))
    found = []
    for sign in (1.0, -1.0):
        signed = sign * samples
        near = signed <= signed.min() + 1e-3 * np.ptp(signed)
        local = near & (signed <= np.roll(signed, 1)) & (signed <= np.roll(signed, -1))
        candidates = [float(signed.min())]
        for angle in grid[local][:64]:
            left, right = angle - step, angle + step
            if float(slope(left)) * float(slope(right)) < 0.0:
                candidates.append(sign * float(value(brentq(slope, left, right, xtol=1e-13))))
        found.append(sign * min(candidates))
    return found[0], found[1]


def periodic_speed(problem: Problem) -> Speed:
    """Periodic speed of a `Problem`.

    Returns
    -------
    Speed
        Its ``status`` is ``"no_steady_state"`` when the mean torque is below the load's offset,
        ``"stalled"`` when no solution is positive all through the cycle.
    """
    if problem.closure not in ("power_mean", "cycle_time"):
        raise ValueError(f"closure is power_mean or cycle_time, not {problem.closure!r}")
    scale = 2.0 / (problem.inertia * problem.omega_n**2)
    surplus = problem.torque_mean - problem.load_offset
    if abs(surplus) <= IDLE * problem.torque_range:
        surplus = 0.0
    if problem.sign * surplus < 0.0:
        return Speed("no_steady_state")
    # A torque load (alpha = 0) takes the mean torque at every angle: nothing is left for J.
    free = problem.load_exponent == 0.0 and problem.law is None
    kappa = 0.0 if free else scale * surplus
    try:
        start, level = _shoot(problem, kappa)
        run = _sweep(problem, kappa, start, level, dense=True)
    except _Stalled:
        return Speed("stalled")

    def energy(phi: ArrayLike) -> Array:
        angle = np.mod(np.asarray(phi, dtype=float), CYCLE)
        state = run.sol(angle.ravel())
        return np.asarray((start + state[W] - kappa * state[J]).reshape(angle.shape))

    def square(phi: ArrayLike) -> Array:
        return np.asarray(energy(phi) / problem.inertia_ratio(phi))

    def omega(phi: ArrayLike) -> Array:
        return np.asarray(problem.omega_n * np.sqrt(square(phi)))

    nominal_load = surplus / level

    def energy_slope(phi: float) -> float:
        u = float(square(phi))
        shape = u ** (problem.load_exponent / 2.0) if problem.law is None else problem.law(u)[0]
        load = problem.load_offset + nominal_load * shape
        drift = problem.torque_mean - problem.load_offset - surplus  # only when idle
        return scale * (float(problem.torque(phi)) - load - drift)

    def square_slope(phi: float) -> float:
        theta = float(problem.inertia_ratio(phi))
        return (energy_slope(phi) - float(square(phi)) * float(problem.inertia_slope(phi))) / theta

    lowest, highest = _zero_slope_extremes(square, square_slope)
    least, most = _zero_slope_extremes(energy, energy_slope)
    return Speed(
        status="converged",
        omega_mean=problem.omega_n * (1.0 + float(run.y[A, -1]) / CYCLE),
        omega_max=problem.omega_n * math.sqrt(highest),
        omega_min=problem.omega_n * math.sqrt(lowest),
        load_torque_nominal=nominal_load,
        energy_swing=(most - least) / scale,
        omega=omega,
    )


def problem_of(design: Design) -> tuple[Problem, tuple[float, float]]:
    """Equation of motion of a design, and the extremes of its torque at nominal speed [N m]."""
    lowest, highest = extreme_values(lambda phi: total_torque(design, phi))
    ratio, slope = _varying_inertia(design)
    if design.inertia_model == "constant":

        def working_torque(phi: ArrayLike) -> Array:
            return total_torque(design, phi)

    else:

        def working_torque(phi: ArrayLike) -> Array:
            return np.asarray(gas_torque(design, phi) - friction_torque(design, phi))

    problem = Problem(
        torque=working_torque,
        torque_mean=mean_torque(design),
        torque_range=highest - lowest,
        inertia=design.inertia,
        inertia_ratio=ratio,
        inertia_slope=slope,
        omega_n=design.omega_n,
        load_exponent=design.load_exponent,
        load_offset=design.load_offset,
        closure=design.closure,
    )
    return problem, (lowest, highest)


def inertia_vanishes(problem: Problem) -> bool:
    """Whether Theta(phi) reaches zero or less anywhere in the cycle."""
    ratio = np.broadcast_to(problem.inertia_ratio(np.linspace(0.0, CYCLE, 14401)), 14401)
    return bool(np.min(ratio) <= 0.0)


def solve(design: Design) -> Solution:
    """Solve one design.

    Parameters
    ----------
    design : Design

    Returns
    -------
    Solution
        Accurate to about 1e-10 relative for smooth pressure curves.

    Raises
    ------
    ValueError
        For an unknown inertia model or closure.
    """
    problem, (lowest, highest) = problem_of(design)
    speed = Speed("invalid_input") if inertia_vanishes(problem) else periodic_speed(problem)
    return Solution(
        status=speed.status,
        omega_mean=speed.omega_mean,
        omega_max=speed.omega_max,
        omega_min=speed.omega_min,
        delta=(speed.omega_max - speed.omega_min) / speed.omega_mean,
        k=speed.load_torque_nominal / design.omega_n**design.load_exponent,
        load_torque_nominal=speed.load_torque_nominal,
        energy_swing=speed.energy_swing,
        torque_mean=problem.torque_mean,
        torque_max=highest,
        torque_min=lowest,
        omega=speed.omega,
        torque=lambda phi: total_torque(design, phi),
    )
