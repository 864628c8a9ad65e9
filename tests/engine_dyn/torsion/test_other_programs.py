"""Damped, geared and excited shafts beside openTorsion, which assembles matrices of all discs.

Values of ROSS, which is not installed here, stand in tests/reference/torsional_systems.toml.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import opentorsion
import pytest

from engine_dyn.torsion.forced import forced_response
from engine_dyn.torsion.modes import damped_modes, natural_modes
from engine_dyn.torsion.system import shaft_system
from tests.support.shafts import DIESEL

AGREES = 1e-9  # Both solve the same linear equations in double precision

CHAIN: dict[str, Any] = {
    "inertia": DIESEL["inertia"], "stiffness": DIESEL["stiffness"],
    "damping": [20.0, 0.0, 30.0, 0.0, 10.0, 0.0, 0.0, 50.0],
    "disc_damping": DIESEL["disc_damping"],
}  # fmt: skip

RING: dict[str, Any] = {
    "inertia": [*DIESEL["inertia"], 0.0722], "stiffness": [*DIESEL["stiffness"], 4e3],
    "shafts": [*((i, i + 1) for i in range(8)), (0, 9)], "damping": [10.0] * 8 + [71.7],
    "disc_damping": [*DIESEL["disc_damping"], 0.0],
}  # fmt: skip

GEARED: dict[str, Any] = {
    "inertia": [0.05, 0.05, 1.5, 0.1, 0.4, 6.0, 0.3, 0.8],
    "stiffness": [9e5, 8e5, 4e4, 1e5, 2e4],
    "shafts": [(0, 1), (1, 2), (2, 3), (4, 5), (6, 7)],
    "damping": [5.0, 5.0, 20.0, 40.0, 3.0],
    "disc_damping": [2.0, 2.0, 0.0, 0.0, 0.0, 30.0, 0.0, 1.0],
    "meshes": [(3, 4), (4, 6)], "ratios": [-0.4, -2.5],
}  # fmt: skip
"""Two throws, flywheel, pinion; a wheel with a propeller, and a second pinion with a generator."""

SHAFTS = {"chain": CHAIN, "ring": RING, "geared": GEARED}


def assembled(system: dict[str, Any]) -> Any:
    """The same shaft for openTorsion; wheels of the radii that give the ratios."""
    inertia = system["inertia"]
    count = len(inertia)
    own = system["disc_damping"]
    ground = system.get("ground_stiffness", [0.0] * count)
    pairs = system.get("shafts", [(i, i + 1) for i in range(count - 1)])
    shafts = [
        opentorsion.Shaft(first, second, k=k, I=0.0, c=c)
        for (first, second), k, c in zip(pairs, system["stiffness"], system["damping"], strict=True)
    ]
    # Damping belongs to discs alone, so wheels have a disc and no inertia of their own.
    discs = [opentorsion.Disk(i, inertia[i], c=own[i], k=ground[i]) for i in range(count)]
    gears: dict[int, Any] = {}
    for (first, second), ratio in zip(
        system.get("meshes", []), system.get("ratios", []), strict=True
    ):
        before = gears.setdefault(first, opentorsion.Gear(first, 0.0, 1.0))
        gears[second] = opentorsion.Gear(second, 0.0, before.R / -ratio, parent=before)
    return opentorsion.Assembly(shafts, disk_elements=discs, gear_elements=list(gears.values()))


def turning_with(system: dict[str, Any], assembly: Any) -> Any:
    """Angles of all discs over the coordinates that gears leave free."""
    if "meshes" not in system:
        return np.eye(len(system["inertia"]))
    return assembly.T(assembly.E())


@pytest.mark.parametrize("name", SHAFTS)
def test_modes_are_those_of_opentorsion(name: str) -> None:
    system, assembly = SHAFTS[name], assembled(SHAFTS[name])
    squares = np.sort(assembly.undamped_modal_analysis()[0].real)
    mine = natural_modes(shaft_system(**system)).omega
    moving = squares[squares > 1e-6 * squares[-1]]
    np.testing.assert_allclose(mine[-moving.size :], np.sqrt(moving), rtol=AGREES)
    omega, swing, ratio = assembly.modal_analysis()
    pairs = (swing > 1.0) & (omega > 1.0)
    found = damped_modes(shaft_system(**system))
    own = found.swing > 1.0
    np.testing.assert_allclose(found.omega[own], omega[pairs], rtol=AGREES)
    np.testing.assert_allclose(found.swing[own], swing[pairs], rtol=AGREES)
    np.testing.assert_allclose(found.ratio[own], ratio[pairs], rtol=1e-7)


@pytest.mark.parametrize("name", SHAFTS)
@pytest.mark.parametrize("modal_damping", [0.0, 0.02], ids=["", "and damped modes"])
def test_response_is_that_of_opentorsion(name: str, modal_damping: float) -> None:
    # Held by a soft spring: openTorsion gives a free shaft a damped mode of the rounding of 0 Hz.
    last = [0.0] * (len(SHAFTS[name]["inertia"]) - 1) + [500.0]
    system = {**SHAFTS[name], "ground_stiffness": last}
    assembly = assembled(system)
    free = turning_with(system, assembly)
    orders, speed, throws = np.array([0.5, 1.0, 2.5, 6.0]), 190.0, [0, 1, len(free) - 1]
    draw = np.random.default_rng(3).normal(size=(2, 3, 4))
    torque = 100.0 * (draw[0] + 1j * draw[1])
    acting = np.zeros((len(free), 4), dtype=complex)
    acting[throws] = torque
    damping = assembly.C + assembly.C_modal(assembly.M, assembly.K, xi=modal_damping)
    theirs, _ = assembly.ss_response(free.T @ acting, orders * speed, C=damping)
    modal = {"modal_damping": [modal_damping]} if modal_damping else {}
    mine = forced_response(shaft_system(**system, **modal), orders, speed, throws, torque)["angle"]
    expected = free @ theirs
    scale = np.abs(expected).max(axis=0)
    assert (np.abs(mine - expected) < AGREES * scale).all()
