"""Values that publications print, of closed forms and of an independent program.

The systems stand in tests/reference/torsional_systems.toml, and tools/published_shafts.py computes
ours, for the page as well. A value is met within half a unit of its last digit, but for those that
the source itself has rounded on its way.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

from engine_dyn.torsion.modes import natural_modes
from engine_dyn.torsion.system import shaft_system
from tests.support.tools import tool

published = tool("published_shafts")

SEARCHED = {"peak", "viscous damper", "tuned damper"}
"""Kinds that are searched for over 20001 frequencies."""

CASES = [
    pytest.param(name, number, marks=[pytest.mark.compiled] if given["kind"] in SEARCHED else [])
    for name, system in published.SYSTEMS.items()
    for number, given in enumerate(system["compare"])
    if given["kind"] != "not computed"
]


@pytest.mark.parametrize(("name", "number"), CASES)
def test_ours_is_the_value_of_the_source(name: str, number: int) -> None:
    system = published.SYSTEMS[name]
    given = system["compare"][number]
    for one in published.compared(system, given):
        assert one.agrees != given.get("erratum", False), (one.value, one.ours)


def test_what_is_rounded_wrong_or_not_computed_has_a_reason() -> None:
    reasons = {"rounding", "erratum", "interval"}
    for system in published.SYSTEMS.values():
        assert system["source"] and system["title"]
        for given in system["compare"]:
            assert given["origin"] in ("printed", "closed form", "independent program")
            if given.keys() & reasons or given["kind"] == "not computed":
                assert given["remark"]
    assert {given["kind"] for s in published.SYSTEMS.values() for given in s["compare"]} == set(
        published.KINDS
    )


@pytest.mark.parametrize("mode", [0, 1, 2, 3])
def test_elements_converge_to_the_continuous_shaft(mode: int) -> None:
    """Friswell et al., hollow shaft of 800 m, discs of 200 and 10 kg m2; errors fall as 1/n^2.

    theta = A cos(a x) + B sin(a x), a = omega sqrt(rho/G); G I theta' = -J_0 omega^2 theta at x = 0
    and J_L omega^2 theta at x = L.
    """
    system = published.SYSTEMS["friswell_hollow_shaft"]
    length, polar, shear, density = (
        system["uniform"][key] for key in ("length", "polar_moment", "shear_modulus", "density")
    )

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
    assert exact / (2.0 * np.pi) == pytest.approx(
        [1.9103323, 3.8206648, 5.7309976, 7.6413309][mode]
    )
    errors, counts = [], np.array([30, 60])
    for count in counts:
        made = published.made(system, {"elements": count})
        errors.append(1.0 - natural_modes(made).omega[mode] / exact)
    # The chain has 2 n/l sqrt(G/rho) sin(x), x = m pi/(2 n), where the shaft has 2 n/l ... x.
    np.testing.assert_allclose(errors, ((mode + 1) * np.pi / counts) ** 2 / 24.0, rtol=0.05)


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
    modes = natural_modes(made, unit=0)
    np.testing.assert_allclose(modes.omega, 2 * np.sqrt(stiffness / inertia) * np.sin(angle))
    if ends == "free":
        place = np.arange(1, count + 1) - 0.5
        shape = np.cos(mode[:, None] * np.pi * place / count)
        np.testing.assert_allclose(modes.shape, shape / shape[:, :1], atol=1e-12)
        np.testing.assert_allclose(
            modes.modal_inertia, inertia * count / 2 / shape[:, 0] ** 2, rtol=1e-12
        )
