"""Balance: shaking forces and moments of any arrangement, and what balances them.

What the inertia of the running gear does to the engine's frame at constant speed. Vectors across
the shaft are complex numbers: the real axis points outwards along cylinder 1, the imaginary one a
right angle further in the sense of rotation. At the crank angle phi a cylinder whose own crank
angle is phi + psi and whose axis lies gamma from that of cylinder 1 adds

    m r omega^2 b(phi + psi) e^(i gamma)               its reciprocating mass, b reduced, exact
    m_u r omega^2 e^(i (gamma + phi + psi + theta_T))  what is left at its crank pin

where m_u is the rotating mass (of the rod, and its share of the throw where rods share a pin) less
the counterweight's, both at the crank radius, and theta_T the crank's angle at top dead centre (0
without offset). The two-mass rod has the rod's mass and centre of gravity, so these forces are
exact. A moment is the same sum, each force times its distance z from the middle of the crank,
positive away from the free end: its real part acts in the plane of shaft and cylinder 1. The moment
about the shaft is that of the torque, and not meant here.

Each order nu of the sum turns forwards and backwards, F_nu e^(i nu phi) + B_nu e^(-i nu phi): an
ellipse with the semi-axes |F| + |B| and ||F| - |B||. Counterweights change F_1 alone; a shaft that
turns backwards with the crank's speed changes B_1, a pair at twice that speed F_2 and B_2.

Sources: T. Asgari et al. (2019), eqs. 1 to 13 (one cylinder, two orders); Power units, lecture 18.
"""

from engine_dyn.forces.balance.lines import Ellipse, acceleration_harmonics
from engine_dyn.forces.balance.shaking_forces import (
    RunningGear,
    balance_shaft_mass,
    counterweight_mass,
    running_gear,
    unbalanced_mass,
)

__all__ = [
    "Ellipse",
    "RunningGear",
    "acceleration_harmonics",
    "balance_shaft_mass",
    "counterweight_mass",
    "running_gear",
    "unbalanced_mass",
]
