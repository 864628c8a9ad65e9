"""Exact kinematics of a piston whose rod hangs on a master rod: radial engines, some V engines.

The master rod works on the crank pin, and its big end carries a knuckle pin at the distance q from
the crank pin, at the angle alpha from the master rod's own axis, on which the articulated rod of
length s works. Angles are positive in the sense of rotation. Seen along the articulated cylinder,
which lies gamma behind the master's, with the crank at theta from the master's cylinder and the
master rod leaning by beta, sin(beta) = lambda (sin(theta) - E), all over the crank radius:

    u = sin(theta - gamma) + K sin(psi) - E,    psi = alpha - gamma - beta,    K = q/r,
    y = cos(theta - gamma) + K cos(psi) + R,    R = sqrt(S^2 - u^2),           S = s/r.

y is the height of the piston pin above the crank's axis; the slopes of beta are those of the master
rod, beta' = lambda cos(theta)/cos(beta), and everything is differentiated in closed form. Dead
centres are the roots of y' near gamma and gamma + pi, by Newton's method. The piston's own angle
counts from its own top dead centre. Derived here; K = 0 and S = 1/lambda is the plain slider-crank.

A mass at the knuckle pin, over m r^2 omega^2/2, has the kinetic energy 1 + K^2 beta'^2 -
2 K beta' cos(theta - alpha + beta). The 1 is that of a mass at the crank pin; what is beyond it is
`knuckle_square`.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from engine_dyn.geometry import slider_crank


class _Height(NamedTuple):
    """Height of the piston pin over the crank radius, with two derivatives over theta."""

    value: Any
    slope: Any
    bend: Any


class ArticulatedRod(NamedTuple):
    """Numbers that tell an articulated rod from a plain one."""

    radius: float  # Distance K of the knuckle pin from the crank pin, over the crank radius [1]
    angle: float  # Direction alpha of the knuckle pin from the master rod's axis [rad]
    bank: float  # Direction gamma of the cylinder from the master cylinder's [rad]
    # Rod length S over the crank radius [1]; 0 stands for the master rod's length less the knuckle
    # pin's radius.
    length: float = 0.0
    knuckle_mass: float = 0.0  # Mass at the knuckle pin over the engine's reciprocating mass [1]

    def rod(self, crank_ratio: Any) -> Any:
        """Length S of the rod over the crank radius [1]."""
        return self.length if self.length else 1.0 / np.asarray(crank_ratio) - self.radius

    def _lean(self, theta: Any, crank_ratio: Any, offset: Any) -> tuple[Any, Any, Any]:
        """Angle of the master rod, with first and second derivative."""
        sine = crank_ratio * (np.sin(theta) - offset)
        cosine = np.sqrt(1.0 - sine * sine)
        slope = crank_ratio * np.cos(theta) / cosine
        bend = (sine * slope * slope - crank_ratio * np.sin(theta)) / cosine
        return np.arcsin(sine), slope, bend

    def _height(self, theta: Any, crank_ratio: Any, offset: Any) -> _Height:
        beta, beta1, beta2 = self._lean(theta, crank_ratio, offset)
        crank, psi, k = theta - self.bank, self.angle - self.bank - beta, self.radius
        sine, cosine, of_psi, along_psi = np.sin(crank), np.cos(crank), np.sin(psi), np.cos(psi)
        u = sine + k * of_psi - offset
        u1 = cosine - k * beta1 * along_psi
        u2 = -sine - k * (beta2 * along_psi + beta1 * beta1 * of_psi)
        root = np.sqrt(self.rod(crank_ratio) ** 2 - u * u)
        tangent = u / root
        return _Height(
            cosine + k * along_psi + root,
            k * beta1 * of_psi - sine - tangent * u1,
            k * (beta2 * of_psi - beta1 * beta1 * along_psi) - cosine
            - tangent * u2 - (1.0 + tangent * tangent) * u1 * u1 / root,
        )  # fmt: skip

    def _theta(self, crank_ratio: Any, offset: Any, half_turn: float = 0.0) -> Any:
        """Angle of the crank to the master's cylinder at a dead centre: top, or bottom with pi."""
        theta = self.bank + half_turn + 0.0 * (np.asarray(crank_ratio) + offset)
        # Newton's method starts within some degrees of the dead centre, and each step doubles the
        # number of right digits: eight are enough.
        for _ in range(8):
            height = self._height(theta, crank_ratio, offset)
            theta = theta - height.slope / height.bend
        return theta

    def top(self, crank_ratio: Any, offset: Any) -> Any:
        """Engine's angle from the dead centre of a plain rod here to the own top dead centre [rad].

        A plain rod of the engine's length on the crank pin would stand at gamma + theta_T.
        """
        plain = self.bank + slider_crank.dead_centres(crank_ratio, offset).top
        return self._theta(crank_ratio, offset) - plain

    def bottom(self, crank_ratio: Any, offset: Any) -> Any:
        """Own angle at bottom dead centre [rad]: pi, about."""
        return self._theta(crank_ratio, offset, np.pi) - self._theta(crank_ratio, offset)

    def stroke(self, crank_ratio: Any, offset: Any) -> Any:
        """Stroke over two crank radii [1]."""
        return 0.5 * self.position(self.bottom(crank_ratio, offset), crank_ratio, offset)

    def position(self, angle: Any, crank_ratio: Any, offset: Any) -> Any:
        """Piston travel from its top dead centre over the crank radius; `angle` is its own."""
        top = self._theta(crank_ratio, offset)
        at_top = self._height(top, crank_ratio, offset).value
        return at_top - self._height(angle + top, crank_ratio, offset).value

    def velocity(self, angle: Any, crank_ratio: Any, offset: Any) -> Any:
        """Piston velocity over the crank pin's, positive away from its top dead centre."""
        return -self._height(angle + self._theta(crank_ratio, offset), crank_ratio, offset).slope

    def acceleration(self, angle: Any, crank_ratio: Any, offset: Any) -> Any:
        """Piston acceleration at constant speed over r omega^2."""
        return -self._height(angle + self._theta(crank_ratio, offset), crank_ratio, offset).bend

    def diagram_angle(self, angle: Any, crank_ratio: Any, offset: Any) -> Any:
        """Angle of the master at the same part of its stroke, downwards or upwards as this one.

        The pressure follows the volume: with that of the master's diagram at this angle, every
        cylinder has the same diagram over its volume. Dead centres are dead centres of both.
        """
        turns = np.floor(np.asarray(angle) / (2.0 * np.pi))
        down = angle - 2.0 * np.pi * turns < self.bottom(crank_ratio, offset)
        most = 2.0 * slider_crank.dead_centres(crank_ratio, offset).stroke
        part = self.position(angle, crank_ratio, offset) / (2.0 * self.stroke(crank_ratio, offset))
        travel = np.clip(most * part, 0.0, most)
        master = slider_crank.angle_of_travel(travel, down, crank_ratio, offset)
        return master + 2.0 * np.pi * np.where(down, turns, turns + 1.0)

    def knuckle_square(self, angle: Any, crank_ratio: Any, offset: Any) -> tuple[Any, Any]:
        """Squared speed of the knuckle pin beyond the crank pin's over (r omega)^2, and its slope.

        K^2 beta'^2 - 2 K beta' cos(theta - alpha + beta).
        """
        theta = angle + self._theta(crank_ratio, offset)
        beta, beta1, beta2 = self._lean(theta, crank_ratio, offset)
        chi, k = theta - self.angle + beta, self.radius
        sine, cosine = np.sin(chi), np.cos(chi)
        return (
            k * beta1 * (k * beta1 - 2.0 * cosine),
            2.0 * k * (beta2 * (k * beta1 - cosine) + beta1 * (1.0 + beta1) * sine),
        )

    def direction(self, angle: Any, crank_ratio: Any, offset: Any) -> Any:
        """Direction of the rod from its piston to its knuckle pin, complex as there; length 1."""
        theta = angle + self._theta(crank_ratio, offset)
        beta, _, _ = self._lean(theta, crank_ratio, offset)
        across = np.sin(theta - self.bank) + self.radius * np.sin(self.angle - self.bank - beta)
        sine = (across - offset) / self.rod(crank_ratio)
        return 1j * sine - np.sqrt(1.0 - sine * sine)

    def knuckle_acceleration(self, angle: Any, crank_ratio: Any, offset: Any) -> Any:
        """Acceleration of the knuckle pin beyond the crank pin's over r omega^2, complex.

        The real part is along the cylinder, the imaginary one a right angle ahead in the sense of
        rotation.
        """
        theta = angle + self._theta(crank_ratio, offset)
        beta, beta1, beta2 = self._lean(theta, crank_ratio, offset)
        turned = self.radius * np.exp(1j * (self.angle - self.bank - beta))
        return -(beta1 * beta1 + 1j * beta2) * turned
