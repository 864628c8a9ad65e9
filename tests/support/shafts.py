"""Shafts of known response, and a slow solution that shares no code with `engine_dyn.torsion`."""

import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.linalg import null_space

__all__ = [
    "DIESEL",
    "DIESEL_NODES",
    "DIESEL_ORDERS",
    "DIESEL_SPEED",
    "complete_shaft",
    "dense",
    "diesel_torques",
    "passing_shaft",
    "shaft_with",
]

_DATA = tomllib.loads(
    Path(__file__)
    .resolve()
    .parents[1]
    .joinpath("reference", "torsional_systems.toml")
    .read_text(encoding="utf-8")
)
_TORQUE = _DATA["diesel_torque"]

DIESEL: dict[str, Any] = next(s["shaft"] for s in _DATA["system"] if s["id"] == "diesel_105x137")
"""Six-cylinder diesel 105 x 137: pulley, gear train, six throws, flywheel."""

DIESEL_NODES = range(2, 8)
DIESEL_SPEED = _TORQUE["speed"] * np.pi / 30.0

_THROW_1 = np.array(_TORQUE["throw_1"])
DIESEL_ORDERS = _THROW_1[:, 0]


def complete_shaft(throws: int) -> dict[str, Any]:
    """The table [shaft] of an engine with so many throws, which has all that a shaft may have.

    Shaft number `throws` follows from its length, the next is a coupling.
    """
    return {
        "reciprocating": "added",
        "loss_factor": 0.02,
        "shear_modulus": 80.0,
        "load": "load",
        "discs": [
            *(
                {"name": f"throw {i}", "throw": i, "inertia": 0.05, "damping": 2.0}
                for i in range(1, throws + 1)
            ),
            {"name": "flywheel", "inertia": 3.0},
            {"name": "pinion", "inertia": 0.1},
            {"name": "wheel", "inertia": 1.0},
            {"name": "load", "inertia": 4.0, "ground_stiffness": 10.0},
        ],
        "shafts": [
            *({"stiffness": 2e6, "stress_limit": 50.0} for _ in range(throws - 1)),
            {
                "length": 0.1, "diameter": 0.1, "bore": 0.01, "stress_limit": 50.0,
                "torque_limit": 5e3, "tensile_strength": 600.0, "shape_factor": 0.8,
            },
            {
                "name": "coupling", "stiffness": 5e4, "loss_factor": 0.1, "damping": 5.0,
                "clearance": 0.1, "friction_torque": 20.0, "friction_stiffness": 1e4,
            },
            {"between": ["wheel", "load"], "stiffness": 2e5},
        ],
        "gears": [{"between": ["pinion", "wheel"], "ratio": -0.5}],
        "dampers": [
            {"on": "throw 1", "inertia": 0.1, "damping": 20.0, "stiffness": 1e4,
             "loss_factor": 0.1, "surface": 0.2},
        ],
        "excitations": [
            {"on": "wheel", "mean": -5.0, "factor": 1.0,
             "harmonics": [{"order": 4, "amplitude": 3.0}]},
        ],
        "pendulums": [
            {"on": "flywheel", "mass": 1.0, "distance": 0.1, "length": 0.02, "stop_angle": 30.0},
        ],
    }  # fmt: skip


def passing_shaft(throws: int) -> dict[str, Any]:
    """The same without pendulums, which passes a range of speeds."""
    shaft = {key: value for key, value in complete_shaft(throws).items() if key != "pendulums"}
    limited = [{**one, "transient_stress_limit": 60.0} for one in shaft["shafts"]]
    ramp = {"passing_start": 900.0, "passing_end": 1100.0, "speed_ramp": 50.0}
    return {**shaft, "shafts": limited, **ramp}


def shaft_with(key: str) -> dict[str, Any]:
    """The table [shaft] of an engine of one throw that has the disc, shaft or damper of a key."""
    number = int(key.rpartition("_")[2]) if key[-1].isdigit() else 1
    discs = [{"name": f"disc {i}", "inertia": 1.0} for i in range(1, 41)]
    discs[0]["throw"] = 1
    shafts: list[dict[str, Any]] = [{"stiffness": 1e5} for _ in discs[1:]]
    found: dict[str, Any] = {
        "reciprocating": "included", "flywheel": "disc 2", "discs": discs, "shafts": shafts,
    }  # fmt: skip
    if key.startswith("shaft_gear_ratio"):
        found["shafts"] = shafts[:-number]
        found["gears"] = [
            {"between": [f"disc {40 - i}", f"disc {41 - i}"], "ratio": 2.0}
            for i in range(number, 0, -1)
        ]  # fmt: skip
    elif key.startswith("damper"):
        found["dampers"] = [{"on": "disc 3", "inertia": 1.0, "damping": 1.0}] * number
    elif key.startswith("pendulum"):
        one = {"on": "disc 3", "mass": 1.0, "distance": 1.0, "length": 1.0}
        found["pendulums"] = [one] * number
    elif key.startswith("excitation"):
        found["excitations"] = [{"on": "disc 3", "mean": 1.0}] * number
    elif key.startswith("modal_damping"):
        found["modal_damping"] = [0.01] * number
    elif key.startswith(("shaft_length", "shaft_shear", "shaft_bore")):
        size = {"length": 1.0, "diameter": 2.0, "shear_modulus": 80.0}
        shafts[number - 1] = size if "bore" not in key else {"stiffness": 1e5, "diameter": 2.0}
    return found


def diesel_torques() -> Any:
    """Harmonics on the throws, shape (6, 24), of the firing order 1-5-3-6-2-4."""
    first = _THROW_1[:, 1] * np.exp(1j * np.radians(_THROW_1[:, 2]))
    delay = np.radians(_TORQUE["delay"])
    return first * np.exp(-1j * DIESEL_ORDERS * delay[:, None])


def dense(
    omega: float,
    torque: Any,
    inertia: Sequence[float],
    stiffness: Sequence[float],
    shafts: Sequence[tuple[int, int]] | None = None,
    loss_factor: Any = 0.0,
    damping: Any = 0.0,
    disc_damping: Any = 0.0,
    ground_stiffness: Any = 0.0,
    meshes: Sequence[tuple[int, int]] = (),
    ratios: Sequence[float] = (),
) -> tuple[Any, Any]:
    """Angles of the discs and torques of the shafts under `torque` on the discs at omega.

    Gears are constraints, ratio theta_first - theta_second = 0: the angles lie in their null space.
    """
    count = len(inertia)
    pairs = list(zip(range(count), range(1, count), strict=False)) if shafts is None else shafts
    k = np.asarray(stiffness) * (1.0 + 1j * np.asarray(loss_factor)) + 1j * omega * np.asarray(
        damping
    )
    twist = np.zeros((len(pairs), count))
    for number, (first, second) in enumerate(pairs):
        twist[number, first], twist[number, second] = -1.0, 1.0
    own = np.broadcast_to(
        np.asarray(ground_stiffness) + 1j * omega * np.asarray(disc_damping), count
    )
    matrix = np.diag(own - omega**2 * np.asarray(inertia)) + twist.T @ (k[:, None] * twist)
    mesh = np.zeros((len(meshes), count))
    for number, (first, second) in enumerate(meshes):
        mesh[number, first], mesh[number, second] = ratios[number], -1.0
    free = null_space(mesh) if len(meshes) else np.eye(count)
    angle = free @ np.linalg.solve(free.T @ matrix @ free, free.T @ np.asarray(torque))
    return angle, k * (twist @ angle)
