"""Print what ROSS computes of two damped shafts, for tests/reference/torsional_systems.toml.

It was run once, with ROSS 2.3.0 (pip install ross-rotordynamics "plotly<6") in an environment of
its own; the tests do not need it. ROSS has six coordinates at each node: discs are held fast in the
other five, teeth that mesh are elastic, and the last shaft has a mass, which is made very small.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import ross  # type: ignore[import-not-found]

HELD, MESH = 1e9, 1e14  # Stiffness of bearings and of teeth [N/m]

CHAIN: dict[str, Any] = {
    "inertia": [0.017, 0.009, 0.0467, 0.0327, 0.0467, 0.0467, 0.0327, 0.0487, 2.075],
    "stiffness": [1.106e6, 1.631e6, 1.253e6, 1.253e6, 1.678e6, 1.253e6, 1.253e6, 1.976e6],
    "damping": [20.0, 0.0, 30.0, 0.0, 10.0, 0.0, 0.0, 50.0],
}


def rotor(
    inertia: list[float], stiffness: list[float], damping: list[float], held: float = HELD,
    gear: tuple[int, float] | None = None,
) -> Any:  # fmt: skip
    """Discs on couplings and one shaft; one disc may be a gear wheel of some base radius [m]."""
    length = diameter = 0.1
    *couplings, last = zip(stiffness, damping, strict=True)
    elements = [
        ross.CouplingElement(
            m_l=1.0, m_r=1.0, Ip_l=0.0, Ip_r=0.0, Id_l=1.0, Id_r=1.0, kt_x=1e9, kt_y=1e9, kt_z=1e9,
            kr_x=1e7, kr_y=1e7, kr_z=k, cr_z=c, L=length, o_d=diameter,
        )
        for k, c in couplings
    ]  # fmt: skip
    shear = last[0] * length * 32.0 / (np.pi * diameter**4)
    light = ross.Material("light", rho=1e-3, E=2.2 * shear, G_s=shear)
    elements.append(
        ross.ShaftElement(length, 0.0, diameter, material=light, beta=last[1] / last[0])
    )
    discs = []
    for node, own in enumerate(inertia):
        if gear is not None and node == gear[0]:
            teeth = round(1000.0 * gear[1])
            discs.append(ross.GearElement(
                node, 1.0, 0.1, own, teeth, base_diameter=2.0 * gear[1], pr_angle=np.radians(20.0)
            ))  # fmt: skip
        else:
            discs.append(ross.DiskElement(node, m=1.0, Id=0.1, Ip=own))
    bearings = [
        ross.BearingElement(node, kxx=held, cxx=1e3, kzz=held, czz=1e3)
        for node in range(len(inertia))
    ]
    return ross.Rotor(elements, discs, bearings)


def turning(made: Any) -> Any:
    """Places of the angles among all coordinates."""
    return 6 * np.arange(len(made.nodes)) + 5


def damped_modes(made: Any) -> None:
    """Real and imaginary parts of the pairs that are torsional, the fastest first."""
    found = made.run_modal(0.0, num_modes=2 * made.ndof, sparse=False)
    size = np.abs(found.evectors[: made.ndof]) ** 2
    torsional = size[turning(made)].sum(axis=0) > 0.5 * size.sum(axis=0)
    values = found.evalues[torsional & (found.evalues.imag > 1.0)]
    for value in values[np.argsort(-values.imag)]:
        print(f"{value.real:.9g} {value.imag:.9g}")


def forced(made: Any, disc: int, frequency: float) -> None:
    """Angles under 1000 N m on a disc [degree]."""
    found = made.run_freq_response(speed_range=np.array([2.0 * np.pi * frequency]))
    places = turning(made)
    print(np.degrees(1000.0 * np.abs(found.freq_resp[places, places[disc], 0])))


def pulse(made: Any, disc: int, shafts: list[int], stiffness: list[float]) -> None:
    """Highest and lowest torque of shafts after 1000 N m sin(pi t/2 ms) on a disc, until 50 ms."""
    times = np.linspace(0.0, 0.05, 20001)
    places = turning(made)
    force = np.zeros((times.size, made.ndof))
    force[:, places[disc]] = np.where(times < 2e-3, 1000.0 * np.sin(np.pi * times / 2e-3), 0.0)
    angle = made.run_time_response(0.0, force, times).yout[:, places]
    for shaft in shafts:
        torque = stiffness[shaft] * (angle[:, shaft + 1] - angle[:, shaft])
        print(shaft, f"{torque.max():.8g} {torque.min():.8g}")


if __name__ == "__main__":
    chain = rotor(**CHAIN)
    damped_modes(chain)
    forced(chain, 3, 200.0)
    pulse(chain, 8, [1, 3, 5, 6], CHAIN["stiffness"])
    driving = rotor([0.5, 1.5, 0.2], [4e5, 9e4], [30.0, 12.0], MESH, (2, 0.1))
    driven = rotor([1.1, 3.0], [6e5], [40.0], MESH, (0, 0.25))
    geared = ross.MultiRotor(driving, driven, coupled_nodes=(2, 0), gear_mesh_stiffness=MESH)
    damped_modes(geared)
    forced(geared, 0, 40.0)
