"""Forces of the mechanism against equilibrium of its bodies, energy, and printed relations."""

import math
from typing import Any

import numpy as np
import pytest

from engine_dyn.forces import mechanism
from engine_dyn.forces import torque as forces
from engine_dyn.geometry import kinematic_series, masses, slider_crank
from engine_dyn.geometry.cylinders import cylinders_of
from engine_dyn.geometry.layouts import arrangement_from_text
from oracle.rigid_bodies import Bodies

PHI = np.linspace(-6.0, 6.0, 97)
CASES = [(0.25, 0.0), (0.5, 0.0), (0.3, 0.2), (0.35, -0.4)]


@pytest.mark.parametrize(("ratio", "offset"), CASES)
def test_components_are_those_of_one_force(ratio: float, offset: float) -> None:
    thrust = mechanism.thrust_ratio(PHI, ratio, offset)
    rod = mechanism.rod_ratio(PHI, ratio, offset)
    tangential = slider_crank.velocity(PHI, ratio, offset)
    radial = mechanism.radial_ratio(PHI, ratio, offset)
    assert rod**2 == pytest.approx(1.0 + thrust**2, rel=1e-13)  # at the piston: N, P and S
    assert rod**2 == pytest.approx(tangential**2 + radial**2, rel=1e-13)  # at the crank: T and R
    theta = PHI + slider_crank.dead_centres(ratio, offset).top
    beta = slider_crank.rod_angle(PHI, ratio, offset)
    assert tangential == pytest.approx(np.sin(theta + beta) / np.cos(beta), abs=1e-13)
    assert radial == pytest.approx(np.cos(theta + beta) / np.cos(beta), abs=1e-13)
    # N H = T r: H above the crank's axis; P acts along the line of the pin, e beside the axis.
    height = np.cos(theta) + np.cos(beta) / ratio
    assert thrust * height + offset == pytest.approx(tangential, abs=1e-12)


@pytest.mark.parametrize("offset", [0.0, 0.2, -0.3])
def test_exact_rod_against_newtons_equations(offset: float) -> None:
    bodies = Bodies(offset)
    ratio, speed = bodies.ratio, bodies.omega
    share = masses.rod_mass_at_piston(bodies.rod_mass, bodies.centre, bodies.length)
    mass = bodies.piston_mass + share
    two = mechanism.two_mass_rod_inertia(bodies.rod_mass, bodies.centre, bodies.length)
    excess = bodies.rod_inertia - two
    assert excess < 0.0
    missed = 0.0
    for phi in np.linspace(0.05, 6.2, 12):
        exact = bodies.solve(float(phi), bodies.gas)
        inertia = -mass * bodies.radius * speed**2 * slider_crank.acceleration(phi, ratio, offset)
        force = bodies.gas + inertia
        thrust = force * mechanism.thrust_ratio(phi, ratio, offset)
        torque = force * bodies.radius * slider_crank.velocity(phi, ratio, offset)
        left_thrust = mechanism.rod_thrust(phi, ratio, excess, speed, bodies.length, offset)
        left_torque = mechanism.rod_couple_torque(phi, ratio, excess, speed, offset)
        assert thrust + left_thrust == pytest.approx(exact["thrust"], abs=2e-3)
        assert torque + left_torque == pytest.approx(exact["torque"], abs=2e-4)
        missed = max(missed, abs(torque - exact["torque"]))
    assert missed > 1.0  # N m: what the usual model leaves out is not nothing


@pytest.mark.parametrize(("ratio", "offset"), CASES)
def test_motion_of_the_rod_against_differences(ratio: float, offset: float) -> None:
    step = 1e-4
    ahead, here, behind = (
        slider_crank.rod_angle(PHI + k * step, ratio, offset) for k in (1, 0, -1)
    )
    speed = mechanism.rod_speed(PHI, ratio, offset)
    assert speed == pytest.approx((ahead - behind) / (2.0 * step), abs=1e-7)
    second = (ahead - 2.0 * here + behind) / step**2
    assert mechanism.rod_acceleration(PHI, ratio, offset) == pytest.approx(second, abs=1e-6)


@pytest.mark.parametrize("offset", [0.0, 0.25])
def test_errors_of_designs_are_those_of_the_curves(offset: float) -> None:
    """At the same 720 angles; each design alone has the same bits."""
    ratio, mass, radius = np.array([0.2, 0.3, 0.4])[:, None], 1.2, 0.05
    excess = np.array([-1e-3, -2e-4, 5e-4])[:, None]
    phi = np.arange(720) * (2.0 * np.pi / 720)
    v, b = (f(phi, ratio, offset) for f in (slider_crank.velocity, slider_crank.acceleration))
    thrust = mechanism.thrust_ratio(phi, ratio, offset)
    for error, left_out, usual in (
        (mechanism.rod_torque_error,
         mechanism.rod_couple_torque(phi, ratio, excess, 1.0, offset), mass * radius**2 * v * b),
        (mechanism.rod_thrust_error,
         mechanism.rod_thrust(phi, ratio, excess, 1.0, radius / ratio, offset),
         mass * radius * b * thrust),
    ):  # fmt: skip
        wanted = np.abs(left_out).max(axis=1) / np.abs(left_out - usual).max(axis=1)
        found = error(ratio, excess, mass, radius, offset)
        assert found[:, 0] == pytest.approx(wanted, rel=1e-9)
        for i in range(3):
            assert error(ratio[i], excess[i], mass, radius, offset) == found[i]


UNEQUAL = {"radius_factor": (1.0, 1.3, 0.7), "mass_factor": (1.0, 0.9, 1.2)}


@pytest.mark.parametrize("inclination", [0.0, 0.7])
@pytest.mark.parametrize(
    ("text", "factors"),
    [("in-line 4", {}), ("V6 60 split-pin", {}), ("boxer 4", {}), ("V8 cross-plane", {}),
     ("radial 5", {}), ("in-line 3", UNEQUAL)],
)  # fmt: skip
def test_gravity_torque_is_the_slope_of_the_height(
    text: str, factors: dict[str, Any], inclination: float
) -> None:
    # Power of the weights is -G dy/dt; per unit crank speed, by differences of the masses' heights.
    engine = cylinders_of(arrangement_from_text(text)).with_factors(**factors)
    count, ratio, radius, offset = len(engine.members), 0.3, 0.05, 0.1
    piston, turning = 1.3, 2.1

    def height(phi: Any) -> Any:
        total: Any = 0.0
        for member, from_upright in zip(engine.members, mechanism.banks_of(engine), strict=True):
            angle, own = phi + member.phase, member.radius_factor
            bank = from_upright + inclination
            crank = angle + slider_crank.dead_centres(own * ratio, offset / own).top + bank
            down = own * slider_crank.position(angle, own * ratio, offset / own)
            total = total - member.mass_factor * piston * down * np.cos(bank)
            total = total + turning * own * np.cos(crank)
        return radius * total

    step = 1e-5
    slope = (height(PHI + step) - height(PHI - step)) / (2.0 * step)
    found = mechanism.gravity_torque(
        PHI, ratio, piston, turning, radius, count, {count: engine}, offset,
        inclination=inclination,
    )  # fmt: skip
    assert found == pytest.approx(-mechanism.GRAVITY * slope, abs=1e-8)


def test_inertia_pressure_is_the_amplitude_of_the_inertia_force() -> None:
    bore, stroke, mass, speed, ratio = 0.14, 0.18, 6.67, 125.66, 0.2571
    area = forces.piston_area(bore)
    phi = np.arange(1440) * (np.pi / 720.0)
    force = -mass * 0.5 * stroke * speed**2 * slider_crank.acceleration(phi, ratio)
    found = 2.0 * np.fft.rfft(force / area)[1:7].real / phi.size
    orders = np.arange(1, 7)
    coefficient = kinematic_series.acceleration_coefficients(orders, ratio)
    pressures = mechanism.inertia_pressure(
        coefficient, mass / (area * stroke), stroke * speed / math.pi
    )
    assert pressures == pytest.approx(-found, rel=1e-9, abs=1e-6)
