"""Piston and rod as rigid bodies, by Newton's equations and numerical derivatives.

No formula of the packages is used but the angle of the crank at top dead centre.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from engine_dyn.geometry import slider_crank


class Bodies:
    """Piston and rod as rigid bodies by Newton's equations; positions differentiated numerically.

    x to the side where the crank pin goes down, y away from the crank; unknown are the force of the
    crank on the big end and that of the wall on the piston.
    """

    radius, length = 0.045, 0.150
    centre, rod_mass, rod_inertia, piston_mass = 0.050, 0.60, 0.0021, 0.50
    omega, gas = 300.0, 4000.0

    def __init__(self, offset: float = 0.0) -> None:
        self.offset = offset
        self.ratio = self.radius / self.length
        self.top = float(slider_crank.dead_centres(self.ratio, offset).top)

    def places(self, phi: float) -> list[Any]:
        theta = phi + self.top
        crank = self.radius * np.array([math.sin(theta), math.cos(theta)])
        beta = math.asin((crank[0] - self.offset * self.radius) / self.length)
        pin = np.array([self.offset * self.radius, crank[1] + self.length * math.cos(beta)])
        return [pin, crank + (pin - crank) * self.centre / self.length, beta, crank]

    def solve(self, phi: float, gas: float) -> dict[str, float]:
        step = 1e-4
        # second derivatives of the fourth order
        weights = {-2: -1 / 12, -1: 4 / 3, 0: -5 / 2, 1: 4 / 3, 2: -1 / 12}
        placed = {k: self.places(phi + k * step) for k in weights}
        pin_a, rod_a, beta_a = (
            sum(w * placed[k][i] for k, w in weights.items()) * (self.omega / step) ** 2
            for i in range(3)
        )
        pin, middle, _, crank = placed[0]
        down = -gas - self.piston_mass * pin_a[1]  # of the piston on the rod, y
        one, two = crank - middle, pin - middle
        matrix = np.array([[1.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-one[1], one[0], -two[1]]])
        right = np.array([
            self.rod_mass * rod_a[0],
            self.rod_mass * rod_a[1] - down,
            self.rod_inertia * beta_a - two[0] * down,
        ])  # fmt: skip
        x, y, wall = np.linalg.solve(matrix, right)
        # on the crank: the opposite; clockwise torque is y-force times x less x-force times y
        torque = y * crank[0] - x * crank[1]
        return {"thrust": wall, "torque": torque, "x": -x, "y": -y, "down": -down}
