r"""Dampers, pendulums, and loads that damp.

A ring of inertia J_d on a hub is a disc, and what holds it a shaft: with viscous damping alone
(Houdaille), with stiffness and loss factor (rubber), or with both. Here are the values that are
best for one mode of modal inertia J_m and natural frequency omega_m, mu = J_d/J_m, and what makes
a pendulum a disc on a shaft.
"""

from __future__ import annotations

from typing import Any, NamedTuple

__all__ = ["Optimum", "Pendulum", "load_damping", "optimum_tuned", "optimum_viscous", "pendulum"]


class Optimum(NamedTuple):
    """What holds a damper's ring, and the largest amplitude with it.

    Attributes
    ----------
    stiffness : array_like
        [N m/rad].
    damping : array_like
        [N m s/rad].
    magnifier : array_like
        Largest amplitude of the mode over that of its static twist [1].
    """

    stiffness: Any
    damping: Any
    magnifier: Any


def optimum_viscous(ring: Any, modal_inertia: Any, omega: Any) -> Optimum:
    """Best viscous damping c = 2 zeta J_d omega_m of a ring without spring.

    zeta = 1/sqrt(2 (1 + mu) (2 + mu)); the peak 1 + 2/mu lies at omega_m sqrt(2/(2 + mu)), where
    all curves of other damping pass. Den Hartog, Mechanical Vibrations, on the Houdaille damper.

    Parameters
    ----------
    ring, modal_inertia : array_like
        Of the damper's ring; of the mode, over the square of the hub's amplitude [kg m2].
    omega : array_like
        Natural frequency of the mode [rad/s].
    """
    mu = ring / modal_inertia
    zeta = (2.0 * (1.0 + mu) * (2.0 + mu)) ** -0.5
    return Optimum(0.0 * mu, 2.0 * zeta * ring * omega, 1.0 + 2.0 / mu)


def optimum_tuned(ring: Any, modal_inertia: Any, omega: Any) -> Optimum:
    """Best spring and viscous damping of a ring; parameters as `optimum_viscous`.

    Tuned to omega_m/(1 + mu), with zeta = c/(2 J_d omega_m) = sqrt(3 mu/(8 (1 + mu)^3)). The
    magnifier is that of the two fixed points, sqrt(1 + 2/mu); the peak is up to 1.3 percent
    higher for mu up to 1. Den Hartog, Mechanical Vibrations, on the damped absorber.
    """
    mu = ring / modal_inertia
    tuned = omega / (1.0 + mu)
    zeta = (0.375 * mu / (1.0 + mu) ** 3) ** 0.5
    return Optimum(ring * tuned**2, 2.0 * zeta * ring * omega, (1.0 + 2.0 / mu) ** 0.5)


class Pendulum(NamedTuple):
    """A centrifugal pendulum as a disc on a shaft.

    Attributes
    ----------
    inertia : array_like
        Of the disc [kg m2].
    speed_stiffness : array_like
        Stiffness of the shaft over the square of the crank's speed [kg m2].
    order : array_like
        To which it is tuned, of the turns of its carrier [1].
    swing : array_like
        Its swing on the carrier over the twist of the shaft [1].
    """

    inertia: Any
    speed_stiffness: Any
    order: Any
    swing: Any


def pendulum(mass: Any, distance: Any, length: Any, ratio: Any = 1.0) -> Pendulum:
    r"""Small swings of a pendulum that the centrifugal force holds.

    With its suspension at R from the shaft, a pendulum of length r that swings by psi moves
    s = (R + r) theta + r psi along its path: kinetic energy m s'^2/2. To second order it comes
    closer to the shaft by R r psi^2/(2 (R + r)), in the centrifugal field
    the potential m R r Omega^2 psi^2/2. With chi = s/(R + r), that is the energy of a disc of
    inertia m (R + r)^2 at the angle chi on a shaft of stiffness m (R + r)^2 n^2 Omega^2,
    n^2 = R/r. At order nu, carrier and pendulum together have the inertia
    m (R + r)^2/(1 - nu^2/n^2): Thomson, Theory of Vibration, section 5.7. The mass is a point, or
    does not turn on the carrier (two suspensions); then its own inertia is the carrier's.

    Parameters
    ----------
    mass : array_like
        Of all pendulums on the carrier [kg].
    distance, length : array_like
        R and r [m].
    ratio : array_like
        Speed of the carrier over that of the crank [1].
    """
    inertia = mass * (distance + length) ** 2
    square = distance / length
    return Pendulum(inertia, inertia * square * ratio**2, square**0.5, 1.0 + square)


def load_damping(torque: Any, exponent: Any, speed: Any, offset: Any = 0.0) -> Any:
    """Damping [N m s/rad] of a disc whose load is a + k omega^alpha, alpha (M - a)/omega.

    The slope of the load at its mean torque M [N m] and the speed of the disc [rad/s].
    """
    return exponent * (torque - offset) / speed
