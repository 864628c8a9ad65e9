"""Ships' shafts excited by propellers alone, and frequencies of a two-stroke plant, as printed.

Geared electric propulsion of a container ship of 64 TEU: CCS COMPASS, SRM09, sheet of 3 April 2026,
as transcribed in the public repository lidderbus/gearbox-new. Three numbers are not printed and
were fitted to the amplitudes of its forced table by least squares: the blade torque over the rated
one, the loss factor of the coupling, and the propeller's damping. So the table proves the shape
over the speed and along the shaft, not these sizes. Of the others nothing is fitted.
"""

from __future__ import annotations

import numpy as np
import pytest

from engine_dyn.loads.torque_curves import torque_of_harmonics
from engine_dyn.torsion.excitation import Excitation
from engine_dyn.torsion.forced import forced_response
from engine_dyn.torsion.modes import natural_modes
from engine_dyn.torsion.system import ShaftSystem, shaft_system, shear_stress
from engine_dyn.units import DEGREE, MPA, RPM

INERTIA = [1.35, 1.54, 0.3436, 0.0282 + 0.1344, 0.0133, 0.0481, 0.9918]
FLEXIBILITY = 1e-10 * np.array(
    [5434.7826, 389105.0584, 7677.5432, 62111.8012, 60679.6117, 456621.0046]
)
RATED_SPEED, RATIO, BLADES = 1500.0, 5.048, 4
RATED_TORQUE = 249e3 / (RATED_SPEED * RPM)

FITTED_BLADE_TORQUE = 0.0750  # over the rated torque, at the motor's speed
FITTED_LOSS_FACTOR = 1.16
FITTED_ROUNDING = 2e-3  # What the last digits of the blade torque and the loss factor may change

FITTED_DAMPING = 35.65  # of the propeller [N m s/rad] at rated speed, referred to the motor

DIAMETER = 0.12  # of intermediate and propeller shaft [m]

FORCED = np.array([
    # rpm, angle of the motor [degree], stress of intermediate and of propeller shaft [N/mm2]
    [150.0, 0.099598, 0.014, 0.014], [300.0, 0.102521, 0.056, 0.057],
    [481.0, 0.109090, 0.152, 0.154], [666.0, 0.120218, 0.317, 0.321],
    [910.0, 0.145007, 0.700, 0.705], [1112.0, 0.178767, 1.260, 1.265],
    [1337.0, 0.230166, 2.278, 2.277], [1500.0, 0.252586, 3.072, 3.060],
    [1642.0, 0.236805, 3.375, 3.351], [1800.0, 0.195151, 3.255, 3.221],
])  # fmt: skip


def plant(speed: float | None = None) -> ShaftSystem:
    """Motor, coupling, gear and propeller, at the motor's speed."""
    damping = np.zeros(7)
    damping[-1] = 0.0 if speed is None else FITTED_DAMPING * speed / RATED_SPEED
    loss = [0.0, FITTED_LOSS_FACTOR, 0.0, 0.0, 0.0, 0.0]
    return shaft_system(INERTIA, 1.0 / FLEXIBILITY, loss_factor=loss, disc_damping=damping)


def test_natural_frequencies_are_those_printed() -> None:
    per_minute = natural_modes(plant()).frequency * 60.0
    printed = [1112.1, 2886.6, 13794.09, 15296.2, 33131.79]
    # The program stopped its search for the first two roots within 0.03 %
    assert per_minute[:5] == pytest.approx(printed, rel=5e-4)
    assert per_minute[2:5] == pytest.approx(printed[2:], abs=0.01)


@pytest.mark.parametrize("row", FORCED, ids=lambda row: f"{row[0]:g} rpm")
def test_forced_vibration_by_the_blades_is_that_printed(row: np.ndarray) -> None:
    rpm, angle, *stresses = row
    speed = rpm * RPM
    size = FITTED_BLADE_TORQUE * RATED_TORQUE * RATIO
    torque = torque_of_harmonics(0.0, {BLADES: (0.0, size)})
    blades = Excitation("blades", 6, (torque,), power=2.0, reference_speed=RATED_SPEED * RPM)
    # The propeller is referred to the motor, and so is its torque
    harmonics = blades.own_harmonics(speed)[None, :] / RATIO
    found = forced_response(plant(rpm), blades.orders / RATIO, speed, [6], harmonics)
    assert abs(found["angle"][0, 0]) / DEGREE == pytest.approx(angle, rel=FITTED_ROUNDING)
    for shaft, printed in zip((4, 5), stresses, strict=True):
        stress = shear_stress(RATIO * abs(found["torque"][shaft, 0]), DIAMETER, 0.0) / MPA
        assert stress == pytest.approx(printed, rel=FITTED_ROUNDING, abs=6e-4)


def test_frequencies_of_a_two_stroke_plant_are_those_printed() -> None:
    """Wärtsilä 5RT-flex50D of 6,350 kW at 99 rpm with a damper, coupled directly to its propeller.

    Inertias, stiffnesses and frequencies as a public student's calculation in MATLAB has them; it
    was seen as a file without a name.
    """
    inertia = [8730.0, 578.0, *[4920.0] * 5, 735.0, 8136.0, 82.095, 194.14, 21497.0]
    stiffness = [18e6, 1.508e9, *[1.344e9] * 4, 0.892e9, 0.509e9, 0.020e9, 62.058e9, 19.377e9]
    per_minute = natural_modes(shaft_system(inertia, stiffness)).frequency * 60.0
    assert per_minute[:3] == pytest.approx([330.08, 502.10, 1872.20], rel=2e-5)


# --- marine steam turbine -------------------------------------------------------------------------
# Gunter and Chen, Introduction to Dynamics of Rotor-Bearing Systems (2001), Example 8.1, pages 388
# to 392; values, and points read from its Figure 8.10-5, as in openTorsion,
# examples/marine_steam_turbine_forced_response.py (MIT, Copyright (c) 2020 Sampo Laine, Urho
# Hakonen), in inches, pounds and seconds. Two turbines drive the propeller, each by two gears.

TURBINE = {
    # Propeller, bull gear; low pressure: pinion, wheel, pinion, turbine; high pressure: the same
    "inertia": [2.454e6, 0.826e6, 1e-9, 1.283e4, 1e-9, 1.509e4, 1e-9, 2.723e4, 1e-9, 261.2],
    "stiffness": [826e6, 203.94e6, 30.51e6, 24.17e6, 14.26e6],
    "shafts": [(0, 1), (2, 3), (4, 5), (6, 7), (8, 9)],
    "meshes": [(1, 2), (3, 4), (1, 6), (7, 8)],
    "ratios": [-9.4094, -40.0424 / 9.4094, -9.4094, -78.2365 / 9.4094],
    "disc_damping": [3.86e6, 0.0, 0.0, 0.0, 0.0, 108.77, 0.0, 0.0, 0.0, 42.738],
    "modal_damping": [0.00398],
}
PROPELLER_TORQUE, PROPELLER_SPEED = 22.24e6, 85.0  # [lbf in] at [rpm]; a tenth of it by the blades

READ = np.array([
    # rpm, vibratory torque of the propeller shaft [lbf in]
    [14.483, 69149], [21.022, 180851], [26.948, 468085], [30.081, 898936], [31.648, 1367021],
    [32.805, 1856383], [33.895, 2803191], [34.713, 3585106], [36.484, 3585106], [37.301, 2877660],
    [38.186, 2297872], [39.685, 1643617], [41.797, 1218085], [45.202, 893617], [50.038, 696809],
    [56.645, 569149], [64.002, 500000], [72.584, 454787], [82.324, 425532], [97.105, 409574],
])  # fmt: skip
READ_PEAK = 35.46, 4148936.0
READ_SPEED, READ_TORQUE = 0.5, 0.02 * READ_PEAK[1]  # What a figure of 100 rpm and 5e6 lbf in shows


def of_blades(rpm: np.ndarray) -> np.ndarray:
    """Amplitude of the torque in the propeller shaft under five blades [lbf in]."""
    size = 0.1 * PROPELLER_TORQUE
    torque = torque_of_harmonics(0.0, {5: (0.0, size)})
    blades = Excitation("blades", 0, (torque,), power=2.0, reference_speed=PROPELLER_SPEED * RPM)
    harmonics = blades.own_harmonics(rpm * RPM)[:, None, :]
    found = forced_response(shaft_system(**TURBINE), blades.orders, rpm * RPM, [0], harmonics)
    return np.abs(found["torque"][:, 0, 0])


def test_frequencies_of_the_turbine_are_those_printed() -> None:
    per_minute = natural_modes(shaft_system(**TURBINE)).frequency * 60.0
    assert per_minute[:3] == pytest.approx([177.7, 220.2, 1282.6], abs=0.05)


def test_torque_of_the_propeller_shaft_is_that_of_the_figure() -> None:
    rpm = np.arange(10.0, 100.0, 0.02)
    torque = of_blades(rpm)
    assert torque.max() == pytest.approx(READ_PEAK[1], abs=READ_TORQUE)
    assert rpm[torque.argmax()] == pytest.approx(READ_PEAK[0], abs=READ_SPEED)
    for speed, read in READ:
        near = torque[np.abs(rpm - speed) <= READ_SPEED]
        assert near.min() - READ_TORQUE < read < near.max() + READ_TORQUE, speed
