"""Natural frequencies that publications print, and of shafts that closed forms solve.

The inertias and stiffnesses are SI values of what the sources print. A printed value is met within
half a unit of its last digit, but for those that the source itself has rounded on its way.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.optimize import brentq

from engine_dyn.torsion.modes import critical_speeds, modal_excitation, natural_modes
from engine_dyn.torsion.stress import shaft_stiffness
from engine_dyn.torsion.system import matrices, shaft_system
from engine_dyn.units import RPM


class Published(NamedTuple):
    """A system, its printed frequencies as text, their unit in rad/s, and where they stand.

    `rounding` is a relative error of the source itself.
    """

    source: str
    system: dict[str, Any]
    printed: tuple[str, ...]
    unit: float
    rounding: float = 0.0


HERTZ = 2.0 * np.pi

PUBLISHED = {
    "two_mass": Published(
        "openTorsion, opentorsion/tests/tests.py (MIT)",
        {"inertia": [211.4, 8.3], "stiffness": [9.775e6]},
        ("176.1",), HERTZ,
    ),
    "friswell_chain": Published(
        "Friswell, Penny, Garvey, Lees, Dynamics of Rotating Machines (2010), Example 9.7.1, as "
        "quoted there",
        {"inertia": [0.0035, 0.0035, 0.0035, 0.15, 0.05], "stiffness": [12e3, 12e3, 14e3, 10e3]},
        ("81.21", "141.21", "378.95", "536.36"), HERTZ,
    ),
    "friswell_branched": Published(
        "Friswell et al., Example 9.6.3, as quoted there: two branches geared to one shaft",
        {
            "inertia": [3200.0, 200.0, 200.0, 800.0, 800.0, 450.0, 450.0],
            "stiffness": [
                shaft_stiffness(68e9, 2.5, 0.2), *[shaft_stiffness(68e9, 3.5, 0.25)] * 2
            ],
            "shafts": [(0, 1), (3, 5), (4, 6)],
            "meshes": [(1, 2), (1, 3), (2, 4)],
            "ratios": [-1.0, -0.5 / 0.8, -0.5 / 0.8],
        },
        ("10.304", "20.479", "24.423"), HERTZ,
    ),
    "wind_turbine": Published(
        "Sopanen et al. (2011), doi:10.1109/TIE.2010.2087301, as quoted in openTorsion's notebooks",
        {"inertia": [1e7, 5770.0, 97030.0], "stiffness": [3.67e8, 5.496e9]},
        ("58.34", "1034.115"), 1.0,
    ),
    "thomson_three_discs": Published(
        "Thomson, Theory of Vibration, on Holzer's method, from memory",
        {"inertia": [5.0, 11.0, 22.0], "stiffness": [1e5, 2e5]},
        ("123.666", "202.658"), 1.0,
    ),
    "bevan_three_rotors": Published(
        "Bevan, The Theory of Machines, ch. 15, Example 9, as in the FOSSEE companion, which "
        "rounds the first to 16 1/s before it scales the second",
        {
            "inertia": [235.9846165, 707.9538496, 283.1815398],
            "stiffness": [5993394.79, 2277490.02],
        },
        ("961", "1784"), RPM, 0.002,
    ),
    "three_rotor_oil_engine": Published(
        "question bank of qna.carrieradda.com, 26013; rounded in the source",
        {"inertia": [0.15, 0.3, 0.09], "stiffness": [132001.8693, 198002.804]},
        ("171",), HERTZ, 0.002,
    ),
    "pipe_flywheel": Published(
        "ME 440, University of Wisconsin-Madison (2017): pipe of 40/34 mm, 1 m, fixed at one end",
        {
            "inertia": [0.2], "stiffness": [],
            "ground_stiffness": shaft_stiffness(77.2e9, 1.0, 0.04, 0.034),
        },
        ("34.272",), HERTZ,
    ),
    "diesel_1939_three_mass": Published(
        "Rolls-Royce experimental archive, scan 0117 (1939), in its printed quadratic. Erratum: it "
        "prints 1800 for the first, an arithmetical slip; its own equation gives 1881.9",
        {"inertia": [0.66, 0.66, 10.0], "stiffness": [4465116.279, 6e6]},  # lbf in s2, lbf in
        ("1881.9", "4441.8"), 1.0, 0.0013,
    ),
    "car_six_1928": Published(
        "S. S. Tresilian, Rolls-Royce experimental archive, box 25, scan 317 (1928): the critical "
        "speed of order 3, measured 3300. Erratum of the reading: the formula lacks the order",
        {"inertia": [0.01559, 0.6911], "stiffness": [16350.0]},  # slug ft2, lbf ft
        ("9889",), RPM,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", PUBLISHED)
def test_natural_frequencies_are_those_printed(name: str) -> None:
    case = PUBLISHED[name]
    found = natural_modes(shaft_system(**case.system)).omega / case.unit
    assert found.size == len(case.system["inertia"]) - len(case.system.get("meshes", ())) - (
        "ground_stiffness" not in case.system
    )
    for value, text in zip(found[: len(case.printed)], case.printed, strict=True):
        digits = len(text.partition(".")[2])
        allowed = 0.5000001 * 10.0**-digits + case.rounding * float(text)
        assert abs(value - float(text)) <= allowed, (value, text)


def test_printed_critical_speed() -> None:
    """Tresilian's memorandum prints 3296 1/min for order 3, and 3300 as measured."""
    system = shaft_system(**PUBLISHED["car_six_1928"].system)
    assert round(critical_speeds(system, [3.0])[0, 0] / RPM) == 3296


def test_coursework_range() -> None:
    """perfectcustompapers.com, torsional vibration of ship propulsion: 8000 to 8500 1/min."""
    inertia, stiffness = [4.0, *[0.4] * 6, 2.0, 4.0], [1e7, *[1.4e7] * 5, 2e7, 2e7]
    assert 8000.0 < natural_modes(shaft_system(inertia, stiffness)).omega[0] / RPM < 8500.0


def test_damped_eigenvalues_of_a_printed_state_matrix() -> None:
    """openTorsion's tests: two shafts, gear 10:60, viscous damping everywhere.

    They print the state matrix; these are its eigenvalues to 8 digits.
    """
    system = shaft_system(
        [1.0, 0.1, 0.1, 1.0], [400.0, 800.0], [(0, 1), (2, 3)], meshes=[(1, 2)], ratios=-1.0 / 6.0,
        damping=[1.0, 0.5], disc_damping=[0.5, 0.1, 0.1, 1.0],
    )  # fmt: skip
    inertia, stiffness, _, damping = matrices(system)
    size = inertia.size
    state = np.zeros((2 * size, 2 * size))
    state[:size, size:] = np.eye(size)
    state[size:] = -np.hstack([stiffness, damping]) / inertia[:, None]
    found = np.linalg.eigvals(state)
    pairs = found[found.imag > 0.0]
    pairs = pairs[np.argsort(-pairs.imag)]
    expected = [-5.8726244 + 67.051798j, -0.7809345 + 27.863017j]
    np.testing.assert_allclose(pairs, expected, rtol=2e-8)
    assert np.isclose(found[found.imag == 0.0].real, -0.557747, rtol=1e-6).any()


@pytest.mark.parametrize(
    ("order", "printed"),
    [
        (1.5, 1.111), (2.0, 1.414), (2.5, 1.663), (3.0, 0.765), (3.5, 1.961), (4.0, 0.0),
        (4.5, 1.961), (5.0, 0.765), (5.5, 1.663), (6.0, 1.414), (6.5, 1.111), (7.0, 1.848),
    ],
)  # fmt: skip
def test_printed_bank_factors(order: float, printed: float) -> None:
    """Rolls-Royce archive, box 138, scan 0009 (1932): V12 of 45 degree, |1 + exp(-i nu 405)|.

    Erratum: 2 cos(11.25 degree) = 1.9616 is cut to 1.961; the others are rounded.
    """
    two = natural_modes(shaft_system([1.0, 1.0, 1e12], [1e9, 1.0]))  # both throws move alike
    torque = np.exp(-1j * order * np.radians([[0.0], [405.0]]))
    cut = 0.0005 if printed == 1.961 else 0.0
    found = abs(modal_excitation(two, [0, 1], torque)[0, 0])
    assert abs(found - printed - cut) <= 0.0005


def _elements(count: int, stiffness: float, inertia: float) -> tuple[Any, Any]:
    """Inertias and stiffnesses of a uniform shaft in equal elements, half of each at its ends."""
    own = np.full(count + 1, inertia / count)
    own[[0, -1]] *= 0.5
    return own, np.full(count, stiffness * count)


@pytest.mark.parametrize("mode", [0, 1, 2, 3])
def test_elements_converge_to_the_continuous_shaft(mode: int) -> None:
    """Friswell et al., hollow shaft of 800 m, discs of 200 and 10 kg m2; errors fall as 1/n^2.

    theta = A cos(a x) + B sin(a x), a = omega sqrt(rho/G); G I theta' = -J_0 omega^2 theta at x = 0
    and J_L omega^2 theta at x = L.
    """
    length, shear, density = 800.0, 7.5e10, 8000.0
    polar = np.pi * (0.78**4 - 0.65**4) / 32.0
    stiffness = shaft_stiffness(shear, length, 0.78, 0.65)

    def end(omega: float) -> float:
        a = omega * np.sqrt(density / shear)
        slope = -200.0 * omega**2 / (shear * polar * a)  # B over A
        at_end = np.cos(a * length) + slope * np.sin(a * length)
        return float(
            shear * polar * a * (-np.sin(a * length) + slope * np.cos(a * length))
            - 10.0 * omega**2 * at_end
        )

    step = np.pi * np.sqrt(shear / density) / length
    exact = brentq(end, (mode + 0.98) * step, (mode + 1.02) * step)
    assert exact / HERTZ == pytest.approx([1.9103323, 3.8206648, 5.7309976, 7.6413309][mode])
    errors, counts = [], np.array([30, 60])
    for count in counts:
        inertia, shafts = _elements(count, stiffness, density * polar * length)
        inertia[0] += 200.0
        inertia[-1] += 10.0
        errors.append(1.0 - natural_modes(shaft_system(inertia, shafts)).omega[mode] / exact)
    # The chain has 2 n/l sqrt(G/rho) sin(x), x = m pi/(2 n), where the shaft has 2 n/l ... x.
    np.testing.assert_allclose(errors, ((mode + 1) * np.pi / counts) ** 2 / 24.0, rtol=0.05)


@pytest.mark.parametrize(("mode", "printed"), [(0, 2.41), (1, 7.93)])
def test_drill_string(mode: int, printed: float) -> None:
    """Rice University, MECH 517, application 137: b tan b = J_shaft/J_end, fixed at the top.

    The source calls its values approximate; in feet, pounds and seconds.
    """
    length, polar, shear, density = 5000.0, 0.00094, 1.728e9, 15.22
    ratio = density * polar * length / 29.3
    b = brentq(lambda x: x * np.tan(x) - ratio, mode * np.pi + 0.1, (mode + 0.4999) * np.pi)
    exact = b * np.sqrt(shear / density) / length
    assert exact == pytest.approx(printed, rel=5e-3)
    inertia, shafts = _elements(50, shear * polar / length, density * polar * length)
    inertia[-1] += 29.3
    ground = np.zeros(50)
    ground[0] = shafts[0]
    held = shaft_system(inertia[1:], shafts[1:], ground_stiffness=ground)
    assert natural_modes(held).omega[mode] == pytest.approx(exact, rel=2e-3)


@pytest.mark.parametrize("count", [2, 3, 6])
@pytest.mark.parametrize("ends", ["free", "one held", "both held"])
def test_equal_discs(count: int, ends: str) -> None:
    """theta_j = cos((j - 1/2) b), 4 sin^2(b/2) = omega^2 J/k; free ends ask for sin(n b) = 0."""
    inertia, stiffness = 0.04, 1.2e6
    mode = np.arange(1, count + (ends != "free"))
    angle = {
        "free": mode * np.pi / (2 * count),
        "one held": (2 * mode - 1) * np.pi / (2 * (2 * count + 1)),
        "both held": mode * np.pi / (2 * (count + 1)),
    }[ends]
    ground = np.zeros(count)
    ground[0] += stiffness * (ends != "free")
    ground[-1] += stiffness * (ends == "both held")
    made = shaft_system(
        np.full(count, inertia), np.full(count - 1, stiffness), ground_stiffness=ground
    )
    modes = natural_modes(made)
    np.testing.assert_allclose(modes.omega, 2 * np.sqrt(stiffness / inertia) * np.sin(angle))
    if ends == "free":
        place = np.arange(1, count + 1) - 0.5
        shape = np.cos(mode[:, None] * np.pi * place / count)
        np.testing.assert_allclose(modes.shape, shape / shape[:, :1], atol=1e-12)
        np.testing.assert_allclose(
            modes.modal_inertia, inertia * count / 2 / shape[:, 0] ** 2, rtol=1e-12
        )
