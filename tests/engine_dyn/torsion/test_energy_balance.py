"""Energy of the forced response: the work of all excitations is lost in the dampers.

Angles, and with them the work of the excitations, are those of dense matrices of all discs; what is
lost is told by the product. Each kind of damping, shaft and excitation meets each other one.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.linalg import eigh, null_space

from engine_dyn.loads.torque_curves import torque_of_harmonics
from engine_dyn.status import CONVERGED
from engine_dyn.torsion.excitation import Excitation, add_drifting
from engine_dyn.torsion.forced import forced_response
from engine_dyn.torsion.shaft import pendulum
from engine_dyn.torsion.system import ShaftSystem, shaft_system

SPEED, CYCLE = 105.0, 4.0 * math.pi
ORDERS = np.arange(0.5, 12.25, 0.5)
PROPELLER, RATIO = 5, -0.4
LOST = ("shaft_loss", "frame_loss")

PLAIN: dict[str, Any] = {
    "inertia": [0.05, 0.05, 1.5, 0.1, 0.4, 6.0], "stiffness": [9e5, 8e5, 4e4, 1e5],
    "shafts": [(0, 1), (1, 2), (2, 3), (4, 5)], "meshes": [(3, 4)], "ratios": [RATIO],
}  # fmt: skip
"""Two throws, flywheel, pinion; a wheel and a propeller."""

SWINGING = pendulum(0.8, 0.12, 0.02)

SHAFTS: dict[str, dict[str, Any]] = {
    "geared": PLAIN,
    "two gears": {
        **PLAIN, "inertia": [*PLAIN["inertia"], 0.3, 0.8],
        "stiffness": [*PLAIN["stiffness"], 2e4], "shafts": [*PLAIN["shafts"], (6, 7)],
        "meshes": [(3, 4), (4, 6)], "ratios": [RATIO, -2.5],
    },
    "pendulum": {
        **PLAIN, "inertia": [*PLAIN["inertia"], SWINGING.inertia],
        "stiffness": [*PLAIN["stiffness"], 0.0], "shafts": [*PLAIN["shafts"], (2, 6)],
        "speed_stiffness": [0.0] * 4 + [SWINGING.speed_stiffness],
    },
}  # fmt: skip

DAMPING: dict[str, Any] = {
    "loss factors": {"loss_factor": [0.02, 0.02, 0.15, 0.01]},
    "dampers between discs": {"damping": [5.0, 3.0, 20.0, 40.0]},
    "dampers on discs": {"disc_damping": [2.0, 2.0, 0.0, 0.0, 0.0, 30.0]},
    "a ring in oil": {"ring": (0.02, 0.0, 0.0, 3.0)},
    "a ring in rubber": {"ring": (0.02, 9e3, 0.2, 0.0)},
    "modes": {"modal_damping": [0.02, 0.05]},
}
DAMPING["all"] = {key: value for one in DAMPING.values() for key, value in one.items()}

EXCITATIONS = ("gas", "gas and masses", "blades in step", "blades that drift", "all")


def damped(shaft: dict[str, Any], given: dict[str, Any]) -> dict[str, Any]:
    """A shaft with such damping; a ring is one more disc, on the first throw."""
    made = {key: value for key, value in given.items() if key != "ring"}
    found = {**shaft}
    if "ring" in given:
        inertia, stiffness, loss_factor, damping = given["ring"]
        number = len(shaft["shafts"])
        found["inertia"] = [*shaft["inertia"], inertia]
        found["stiffness"] = [*shaft["stiffness"], stiffness]
        found["shafts"] = [*shaft["shafts"], (0, len(shaft["inertia"]))]
        for name, of_ring in (("loss_factor", loss_factor), ("damping", damping)):
            own = list(made.get(name, []))
            made[name] = [*own, *[0.0] * (number - len(own)), of_ring]
    for name, key in (("loss_factor", "shafts"), ("damping", "shafts"),
                      ("disc_damping", "inertia"), ("speed_stiffness", "shafts")):  # fmt: skip
        own = list(made.get(name, found.get(name, [])))
        found[name] = own + [0.0] * (len(found[key]) - len(own))
    return {**made, **found}


class Dense:
    """Matrices of all discs, gears eliminated by a null space, and damping of modes."""

    def __init__(self, given: dict[str, Any]) -> None:
        count, pairs = len(given["inertia"]), given["shafts"]
        twist = np.zeros((len(pairs), count))
        for number, (first, second) in enumerate(pairs):
            twist[number, first], twist[number, second] = -1.0, 1.0
        mesh = np.zeros((len(given["meshes"]), count))
        for number, (first, second) in enumerate(given["meshes"]):
            mesh[number, first], mesh[number, second] = given["ratios"][number], -1.0
        self.free = free = null_space(mesh)
        real = np.array(given["stiffness"]) + SPEED**2 * np.array(given["speed_stiffness"])

        def reduced(matrix: Any) -> Any:
            return free.T @ matrix @ free

        self.inertia = reduced(np.diag(given["inertia"]))
        self.stiffness = reduced(twist.T @ (real[:, None] * twist))
        self.lost = reduced(twist.T @ ((real * np.array(given["loss_factor"]))[:, None] * twist))
        self.damping = reduced(
            twist.T @ (np.array(given["damping"])[:, None] * twist) + np.diag(given["disc_damping"])
        )
        squares, shapes = eigh(self.stiffness, self.inertia)
        moving = squares > 1e-9 * squares[-1]
        ratios = np.resize(given.get("modal_damping", [0.0])[-1:], moving.sum())
        first = given.get("modal_damping", [])[: moving.sum()]
        ratios[: len(first)] = first
        rates = np.zeros(squares.size)
        rates[moving] = 2.0 * ratios * np.sqrt(squares[moving])
        of_modes = self.inertia @ shapes
        self.modal = of_modes @ np.diag(rates) @ of_modes.T

    def powers(self, w: float, force: Any) -> tuple[float, float]:
        """Mean power put in by torques on all discs, and what the damping of modes takes of it."""
        acting = self.free.T @ force
        viscous = 1j * w * (self.damping + self.modal)
        matrix = self.stiffness + 1j * self.lost + viscous - w**2 * self.inertia
        angle = np.linalg.solve(matrix, acting)
        put_in = 0.5 * (acting * (1j * w * angle).conj()).sum().real
        return put_in, 0.5 * w**2 * (angle.conj() @ self.modal @ angle).real


def blades(order: float) -> Excitation:
    sine, cosine = -300.0 * math.sin(0.3), 300.0 * math.cos(0.3)
    torques = (torque_of_harmonics(-2000.0, {order: (sine, cosine), 2 * order: (0.0, 40.0)}),)
    return Excitation("blades", PROPELLER, torques, power=2.0, reference_speed=100.0)


def losses(system: ShaftSystem, name: str) -> tuple[dict[str, Any], list[tuple[float, int, Any]]]:
    """Response of the product, and frequency, first disc and torques of all that acts."""
    draw = np.random.default_rng(5).normal(size=(2, 2, 2, ORDERS.size))
    gas, mass = (
        (draw[0] + 1j * draw[1]) / (1.0 + ORDERS**2) * np.array([400.0, 0.02])[:, None, None]
    )
    throws, parts, factors = [0, 1], [gas], [1.0]
    if name in ("gas and masses", "all"):
        parts, factors = [gas, mass], [1.0, SPEED**2]
    if name.startswith("blades"):
        parts = [0.0 * gas]
    if name in ("blades in step", "all"):
        throws = [0, 1, PROPELLER]
        own = np.sign(RATIO) * blades(5.0).harmonics(ORDERS, SPEED, RATIO)
        parts = [np.concatenate([part, 0.0 * part[:1]]) for part in parts]
        parts[0][2] = own
    total = sum(factor * part for factor, part in zip(factors, parts, strict=True))
    found = forced_response(
        system, ORDERS, SPEED, throws, parts, factors, wanted=LOST, period=CYCLE
    )
    acts = [(order * SPEED, throws, total[:, v]) for v, order in enumerate(ORDERS)]
    if name in ("blades that drift", "all"):
        drifting = blades(4.0)
        found = add_drifting(found, system, drifting, 1.5, SPEED, RATIO)
        own = 1.5 * np.sign(RATIO) * drifting.own_harmonics(SPEED)
        acts += [
            (order * abs(RATIO) * SPEED, [PROPELLER], own[v : v + 1])
            for v, order in enumerate(drifting.orders)
        ]
    return found, acts


@pytest.mark.parametrize("excitation", EXCITATIONS)
@pytest.mark.parametrize("damping", DAMPING)
@pytest.mark.parametrize("shaft", SHAFTS)
def test_what_is_put_in_is_lost(shaft: str, damping: str, excitation: str) -> None:
    given = damped(SHAFTS[shaft], DAMPING[damping])
    found, acts = losses(shaft_system(**given), excitation)
    dense, put_in, in_modes = Dense(given), 0.0, 0.0
    for w, discs, torque in acts:
        force = np.zeros(len(given["inertia"]), dtype=complex)
        force[discs] = torque
        one, modal = dense.powers(w, force)
        put_in, in_modes = put_in + one, in_modes + modal
    lost = found["shaft_loss"].sum() + found["frame_loss"] + in_modes
    assert found["status"] == CONVERGED
    assert lost == pytest.approx(put_in, rel=1e-9) and put_in > 0.0
    assert (found["shaft_loss"] >= 0.0).all() and found["frame_loss"] >= 0.0
    assert (in_modes > 0.0) == ("modal_damping" in given)
