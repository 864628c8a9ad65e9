"""Modes, nodes of modes, critical speeds, and what excites and damps a mode."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigh

from engine_dyn.torsion.modes import (
    critical_speeds,
    modal_damping,
    natural_modes,
    zero_crossings,
)
from engine_dyn.torsion.shaft import pendulum
from engine_dyn.torsion.system import matrices, shaft_system
from tests.support.shafts import DIESEL


def test_modes_of_the_diesel() -> None:
    """Frequencies, shapes and modal inertias by scipy's generalised eigenproblem."""
    made = shaft_system(**DIESEL)
    inertia, stiffness, *_ = matrices(made)
    squares, vectors = eigh(stiffness, np.diag(inertia))
    vectors = (vectors / vectors[0]).T
    modes = natural_modes(made, unit=0)
    np.testing.assert_allclose(modes.omega, np.sqrt(squares[1:]), rtol=1e-12)
    np.testing.assert_allclose(modes.frequency[:3], [216.58361, 592.74048, 984.92296], rtol=1e-7)
    np.testing.assert_allclose(modes.shape, vectors[1:], rtol=1e-8)
    np.testing.assert_allclose(
        modes.modal_inertia, [vector**2 @ inertia for vector in vectors[1:]], rtol=1e-8
    )


def test_shapes_fulfil_the_equations_and_are_orthogonal() -> None:
    made = shaft_system(
        [4.0, 0.5, 0.2, 3.0, 0.7], [1e4, 2e3, 5e3], [(0, 1), (2, 3), (1, 4)], meshes=[(1, 2)],
        ratios=-2.5, ground_stiffness=[0.0, 0.0, 0.0, 300.0, 0.0],
    )  # fmt: skip
    modes = natural_modes(made, unit=3)
    own = np.array([4.0, 0.5, 0.2, 3.0, 0.7])
    products = (modes.shape * own) @ modes.shape.T
    np.testing.assert_allclose(products, np.diag(modes.modal_inertia), atol=1e-12)
    np.testing.assert_allclose(modes.shape[:, 3], 1.0)
    np.testing.assert_allclose(modes.shape[:, 2], -2.5 * modes.shape[:, 1])
    # Twist and potential energy, disc by disc: sum k (twist)^2 + ground = omega^2 J_m.
    twist = modes.shape[:, made.shafts[:, 1]] - modes.shape[:, made.shafts[:, 0]]
    energy = (twist**2) @ [1e4, 2e3, 5e3] + 300.0 * modes.shape[:, 3] ** 2
    np.testing.assert_allclose(energy, modes.omega**2 * modes.modal_inertia, rtol=1e-12)
    assert modes.omega.size == 4  # four nodes, and none turns freely


def test_two_discs_have_their_node_where_it_is_printed() -> None:
    """At J_2/(J_1 + J_2) of the shaft from disc 1; omega^2 = k (J_1 + J_2)/(J_1 J_2)."""
    made = shaft_system([211.4, 8.3], [9.775e6])
    modes = natural_modes(made)
    assert zero_crossings(made, modes)[0, 0] == pytest.approx(8.3 / 219.7, rel=1e-12)
    assert modes.omega[0] == pytest.approx(np.sqrt(9.775e6 * 219.7 / (211.4 * 8.3)), rel=1e-13)


def test_mode_m_of_a_chain_has_m_nodes() -> None:
    for system in (DIESEL, {"inertia": np.ones(5), "stiffness": 1.0}):
        made = shaft_system(**system)
        crossings = zero_crossings(made, natural_modes(made))
        assert np.isfinite(crossings).sum(axis=-1).tolist() == list(range(1, len(crossings) + 1))
        inside = crossings[np.isfinite(crossings)]
        assert ((inside >= 0.0) & (inside <= 1.0)).all()


def test_designs_broadcast_and_agree_one_by_one() -> None:
    scale = np.array([[0.5], [1.0], [3.0]])
    inertia = np.array(DIESEL["inertia"]) * np.linspace(1.0, 2.0, 2)[:, None]
    many = natural_modes(shaft_system(inertia[:, None, :], np.array(DIESEL["stiffness"]) * scale))
    assert many.omega.shape == (2, 3, 8)
    for i in range(2):
        for j in range(3):
            one = natural_modes(
                shaft_system(inertia[i], np.array(DIESEL["stiffness"]) * scale[j, 0])
            )
            np.testing.assert_array_equal(many.omega[i, j], one.omega)


def test_what_turns_freely_is_left_out() -> None:
    """A viscous ring has no frequency of its own; where it is also held, there is one mode more."""
    plain = natural_modes(shaft_system([1.0, 2.0, 9.0], [50.0, 80.0]))
    ringed = natural_modes(
        shaft_system(
            [1.0, 2.0, 9.0, 0.3], [[50.0, 80.0, 0.0], [50.0, 80.0, 1.0]],
            [(0, 1), (1, 2), (0, 3)], damping=[0.0, 0.0, 4.0],
        )
    )  # fmt: skip
    np.testing.assert_allclose(ringed.omega[0, :2], plain.omega, rtol=1e-12)
    assert np.isnan(ringed.omega[0, 2])
    assert np.isnan(ringed.shape[0, 2]).all()
    assert np.isfinite(ringed.omega[1]).all()
    assert ringed.omega[1, 0] == pytest.approx(np.sqrt(1.0 / 0.3), rel=0.02)
    np.testing.assert_allclose(ringed.shape[0, 1, 3], 0.0, atol=1e-12)


@pytest.mark.parametrize("order", [0.5, 2.0, 3.0, 4.5])
def test_critical_speeds_with_a_pendulum(order: float) -> None:
    """At a critical speed, the system stiffened for that speed has the frequency nu omega.

    With the pendulum tuned to order 3, order 3 meets the frequencies of the shaft with that disc
    held: Thomson, section 5.7, where the pendulum's inertia is infinite.
    """
    made_of = pendulum(0.4, 0.09, 0.01)
    assert made_of.order == pytest.approx(3.0)
    made = shaft_system(
        [0.5, 0.2, 4.0, made_of.inertia], [3e4, 2e4, 0.0], [(0, 1), (1, 2), (1, 3)],
        speed_stiffness=[0.0, 0.0, made_of.speed_stiffness],
    )  # fmt: skip
    found = critical_speeds(made, [order])[0]
    found = found[np.isfinite(found)]
    assert found.size >= 2
    for speed in found:
        omega = natural_modes(made, speed).omega
        assert np.min(np.abs(omega - order * speed)) < 1e-8 * order * speed
    if order == 3.0:
        held = [np.sqrt(2e4 / 4.0), np.sqrt(3e4 / 0.5)]
        np.testing.assert_allclose(found * 3.0, held, rtol=1e-8)


def test_damping_ratio_is_half_the_loss_factor_plus_viscous_parts() -> None:
    made = shaft_system(**DIESEL)
    modes = natural_modes(made)
    discs = np.array(DIESEL["disc_damping"])
    expected = 0.0175 + (modes.shape**2 @ discs) / (2.0 * modes.omega * modes.modal_inertia)
    np.testing.assert_allclose(modal_damping(made, modes), expected, rtol=1e-9)


@pytest.mark.parametrize("orders", [[0.0], [1.0, -0.5], [np.nan]])
def test_what_is_refused(orders: list[float]) -> None:
    made = shaft_system([1.0, 1.0], 1.0)
    with pytest.raises(ValueError, match="orders"):
        critical_speeds(made, orders)
    with pytest.raises(ValueError, match="unit = 2: must be a disc, from 0 to 1"):
        natural_modes(made, unit=2)
