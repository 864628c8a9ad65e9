"""Nodes of the modes of the shaft that twists, their damping and critical speeds.

Parameters and limits are in `shaft_numbers`, the forced vibration in `shaft_response`.

The formulas are those of `engine_dyn.torsion`.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from engine_dyn.loads.laws import LAWS
from engine_dyn.quantities.node import Node, formula, hidden, quotient, variants
from engine_dyn.quantities.shaft_numbers import PENDULUMS, WILSON, joined
from engine_dyn.torsion.shaft import Shaft, reciprocating_inertia_of_throws, stacked
from engine_dyn.torsion.system import ShaftSystem
from engine_dyn.units import DEGREE, RPM

OF_MODES = 6000  # Bytes of a design whose shaft has some ten discs, with its matrices


def _slope(name: str) -> Any:
    """Slope of a law at nominal speed over its torque there [s/rad]."""
    law = next(law for law in LAWS if law.name == name)

    def make(speed: Any, **needs: Any) -> Any:
        assert law.torque is not None
        torque, slope = law.torque(speed, *(needs[number] for number in law.needs))
        return quotient(slope, torque)

    return make


def _table_slope(driven: Any, speed: Any, ratio: Any = 1.0) -> Any:
    """Slope over torque of a table at `ratio` times the nominal speed, by a small difference."""
    table, omega = driven.over_speed, np.asarray(ratio * speed)
    low, high = np.maximum(0.9999 * omega, table.low), np.minimum(1.0001 * omega, table.high)
    return ratio * quotient((table(high) - table(low)) / (high - low), table(omega))


def _load_slope(when: str, needs: tuple[str, ...], make: Any) -> Node:
    return hidden(
        "load_slope", "s rad-1",
        "slope of the torque of load or driver over the speed, over that torque, at nominal speed",
        make, needs, when=when,
    )  # fmt: skip


_INERTIAS = ("disc_inertia", "damper_inertia", "shaft_gear_ratio", *PENDULUMS)
_ELASTIC = (
    *_INERTIAS, "disc_ground_stiffness", "shaft_stiffness", "shaft_length", "shaft_diameter",
    "shaft_bore", "shaft_shear_modulus", "damper_stiffness",
)  # fmt: skip
OF_ALL = (
    *_ELASTIC, "disc_damping", "shaft_loss_factor", "shaft_damping", "damper_damping",
    "damper_loss_factor", "modal_damping",
)  # fmt: skip
"""Kinds of numbers of a shaft that its inertia, its modes and its response depend on."""

# --- natural modes --------------------------------------------------------------------------------

OF_SYSTEM = (
    "shaft_system", "throw_reciprocating_inertia", "flywheel_excess", "coupling_stiffness"
)  # fmt: skip


def _modes(
    *, speed_of_modes: Any, mode: Any, wanted: tuple[str, ...], **values: Any
) -> dict[str, Any]:
    from engine_dyn.torsion.modes import mode_torques, natural_modes, zero_crossings

    system, bad = system_of(values)
    modes, count, results = natural_modes(system, speed_of_modes), np.size(mode), {}
    if "mode_node" in wanted:
        results["mode_node"] = _first_modes(zero_crossings(system, modes), count, bad, 1)
    if "mode_torque" in wanted:
        free_end = values["shaft_system"].free_end
        over = np.where(modes.shape[..., free_end] == 0.0, np.nan, modes.shape[..., free_end])
        torques = mode_torques(system, modes, speed_of_modes) / over[..., None]
        results["mode_torque"] = _first_modes(torques, count, bad, 1)
    for name, numbers in _numbers(system, values).items() if {*_NUMBERS} & {*wanted} else ():
        results[name] = np.where(bad[..., None], np.nan, numbers)
    return results | {
        "natural_frequency": _first_modes(modes.frequency, count, bad),
        "mode_shape": _first_modes(modes.shape, count, bad, 1),
        "modal_inertia": _first_modes(modes.modal_inertia, count, bad),
    }


_NUMBERS = ("system_inertia", "system_stiffness", "system_speed_ratio")


def _numbers(system: ShaftSystem, values: dict[str, Any]) -> dict[str, Any]:
    """Inertia, stiffness and speed ratio of discs and shafts, each at its own speed."""
    shaft, reciprocating, excess, of_tables = (values[name] for name in OF_SYSTEM)
    inertia = shaft.inertias(values, reciprocating)
    ratio = shaft.speed_ratios(values)[shaft.flywheel]
    inertia[shaft.flywheel] = inertia[shaft.flywheel] + np.asarray(excess) / ratio**2
    listed = (inertia, shaft.stiffnesses(values, of_tables), shaft.speed_ratios(values))
    return {
        name: np.broadcast_to(stacked(one), (*system.shape, len(one)))
        for name, one in zip(_NUMBERS, listed, strict=True)
    }


def system_of(values: dict[str, Any]) -> tuple[ShaftSystem, Any]:
    """The shaft system, and the designs without one, which get a system with other values.

    `values` are the nodes of `OF_SYSTEM`, those of the shaft's numbers, the load's damping, and the
    speed at which tables of damping are read.
    """
    shaft, reciprocating, excess, of_tables = (values[name] for name in OF_SYSTEM)
    read = shaft.dampings(values["damping_speed"]) if "damping_speed" in values else {}
    beyond: Any = np.any(
        [np.isnan(one) for one in np.broadcast_arrays(0.0, *read.values())], axis=0
    )
    values = {**values, **{key: np.nan_to_num(one) for key, one in read.items()}}
    load_damping = values.get("load_damping", 0.0)
    unknown = np.asarray(of_tables) == 0.0
    bad: Any = beyond | (unknown.any(axis=-1) if unknown.ndim else unknown)
    of_tables = np.where(unknown, 1.0, of_tables)
    damped = np.isfinite(load_damping)
    bad, load_damping = bad | ~damped, np.where(damped, load_damping, 0.0)
    if np.any(excess):
        own = shaft.inertias(values, reciprocating)[shaft.flywheel]
        ratio = shaft.speed_ratios(values)[shaft.flywheel]
        possible = own + np.asarray(excess) / ratio**2 > 0.0
        excess, bad = np.where(possible, excess, 0.0), bad | ~possible
    return shaft.system(values, reciprocating, excess, load_damping, of_tables), bad


_DAMPED = "damped_natural_omega", "damped_swing_omega", "damping_ratio"
"""Results of `engine_dyn.torsion.modes`, in the order in which it returns them."""


def _damping(
    *, speed_of_modes: Any, mode: Any, wanted: tuple[str, ...], **values: Any
) -> dict[str, Any]:
    from engine_dyn.torsion.modes import damped_modes, modal_damping, natural_modes

    system, bad = system_of(values)
    results = {}
    if "modal_damping_ratio" in wanted:
        modes = natural_modes(system, speed_of_modes)
        results["modal_damping_ratio"] = modal_damping(system, modes, speed_of_modes)
    if not {*_DAMPED}.isdisjoint(wanted):
        results |= zip(_DAMPED, damped_modes(system, speed_of_modes), strict=True)
    return {name: _first_modes(results[name], np.size(mode), bad) for name in wanted}


def _first_modes(array: Any, count: int, bad: Any, own: int = 0) -> Any:
    """Values of the first modes, before the last `own` axes; NaN for missing modes or systems."""
    kept = array[(..., slice(count), *(slice(None),) * own)]
    short = count - kept.shape[-1 - own]
    kept = np.pad(
        kept, [(0, 0)] * (kept.ndim - 1 - own) + [(0, short)] + [(0, 0)] * own,
        constant_values=np.nan,
    )  # fmt: skip
    return np.where(bad[(..., *(None,) * (1 + own))], np.nan, kept)


def _critical_speeds(
    *, order: Any, mode: Any, wanted: tuple[str, ...], **values: Any
) -> dict[str, Any]:
    """Critical speeds of a shaft with pendulums, whose stiffness follows the speed."""
    from engine_dyn.torsion.modes import critical_speeds, damped_critical_speeds

    system, bad = system_of(values)
    (name,) = wanted
    speeds = damped_critical_speeds if name.startswith("damped") else critical_speeds
    critical = np.swapaxes(speeds(system, np.ravel(order)), -1, -2)
    return {name: _first_modes(critical, np.size(mode), bad, 1)}


def _vector_sum(shaft_system: Shaft, mode_shape: Any, throw_phase_vectors: Any) -> Any:
    """Size |sum_j a_j exp(i nu psi_j)| of phase vectors; last axes: throw, mode, disc, order."""
    vectors, shape = np.asarray(throw_phase_vectors), np.asarray(mode_shape)
    total: Any = 0.0
    for throw, disc in enumerate(shaft_system.throws):
        total = total + shape[..., 0, :, disc, :] * vectors[..., throw, 0, :, :]
    return np.abs(total)


def _reciprocating_share(
    *, shaft_system: Shaft, mean_reciprocating_inertia_of_throw: Any,
    throw_reciprocating_inertia: Any, **values: Any,
) -> Any:  # fmt: skip
    own = shaft_system.along("disc_inertia", values, np.nan)
    discs = [np.atleast_1d(own[disc]) for disc in shaft_system.throws]
    moving, added = np.asarray(mean_reciprocating_inertia_of_throw), throw_reciprocating_inertia
    return moving / (joined(discs) + added)


def _of_modes(name: str, symbol: str, unit: str, long_name: str, adds: tuple[str, ...],
              **more: Any) -> Node:  # fmt: skip
    return Node(
        name, symbol, unit, long_name, WILSON, needs=("torsional_modes",), adds=("mode", *adds),
        **more,
    )  # fmt: skip


def _critical(
    name: str, symbol: str, met: str, frequency: str, needs: tuple[str, ...],
    of_shaft: tuple[str, ...],
) -> tuple[Node, ...]:  # fmt: skip
    """Nodes of critical speeds, from frequencies, and of shafts whose frequencies follow them."""
    one = Node(
        name, symbol, "rpm", f"speed of the crank at which an order meets {met}", WILSON, si=RPM,
        when="no_pendulums",
        **formula(lambda own, order: 2.0 * np.pi * own / order, frequency, "order"),
    )  # fmt: skip
    stage = Node(
        f"{name}s", "", "", "critical speeds of a shaft with pendulums", kind="stage", public=False,
        needs=(*OF_SYSTEM, *needs, "order", "mode"), gives=(name,), make=_critical_speeds,
        of_shaft=of_shaft, width=OF_MODES, source=WILSON,
    )  # fmt: skip
    followed = replace(
        one, when="pendulums", make=None, needs=(f"{name}s",), adds=("mode", "order")
    )
    return one, followed, stage


NODES: tuple[Node, ...] = (
    *(_load_slope(law.name, ("speed", *law.needs), _slope(law.name))
      for law in LAWS if law.torque is not None),
    _load_slope("table with_driver", (), lambda driven, speed: _table_slope(driven, speed)),
    _load_slope("table no_driver", (),
                lambda driven, speed, load_gear: _table_slope(driven, speed, load_gear)),
    *variants(
        Node("throw_reciprocating_inertia", "", "kg m2", "mean inertia of the reciprocating masses "
             "of each throw, where its disc does not have it", public=False),
        {
            "reciprocating_included": lambda throw: 0.0 * throw,
            "reciprocating_added": lambda mean_reciprocating_inertia_of_throw:
            mean_reciprocating_inertia_of_throw,
        },
    ),
    hidden(
        "mean_reciprocating_inertia_of_throw", "kg m2",
        "mean inertia of the reciprocating masses of each throw",
        lambda reciprocating_mass, double_radius, crank_ratio, offset_ratio, cylinder_set,
        cylinders_by_count, throw: reciprocating_inertia_of_throws(
            reciprocating_mass, 0.5 * double_radius, crank_ratio, offset_ratio, cylinder_set,
            cylinders_by_count, throw,
        ),
    ),
    Node(
        "reciprocating_share", r"J_l/J_j", "1",
        "share of the mean of the reciprocating masses in the inertia of each throw's disc: the "
        "shaft leaves out that they vary by as much", WILSON, of_shaft=("disc_inertia",),
        needs=("shaft_system", "mean_reciprocating_inertia_of_throw",
               "throw_reciprocating_inertia"),
        make=_reciprocating_share,
    ),
    hidden("speed_of_modes", "rad s-1", "speed for which modes are computed", lambda: 0.0,
           when="no_pendulums"),
    hidden("speed_of_modes", "rad s-1", "speed for which modes are computed",
           lambda speed: speed, when="pendulums"),
    hidden("damping_speed", "rad s-1", "speed for which damping is computed", lambda: 0.0,
           when="steady_damping"),
    hidden("damping_speed", "rad s-1", "speed for which damping is computed",
           lambda speed: speed, when="damping_over_speed"),
    hidden("coupling_stiffness", "N m rad-1", "stiffness of couplings by their tables",
           lambda shaft: np.nan * shaft, when="linear_couplings"),
    hidden("coupling_stiffness", "N m rad-1", "stiffness of couplings by their tables",
           lambda shaft_system, shaft_torque_mean: shaft_system.of_tables(shaft_torque_mean),
           when="coupling_tables"),
    hidden("flywheel_excess", "kg m2", "what the flywheel has beyond its disc, at the crank",
           lambda: 0.0, when="given_inertia"),
    hidden("flywheel_excess", "kg m2", "what the flywheel has beyond its disc, at the crank",
           lambda inertia, shaft_inertia: inertia - shaft_inertia, when="wanted_delta"),
    *(
        Node(
            "shaft_inertia", r"\Theta_s", "kg m2",
            "moment of inertia of all discs, referred to the crank: that of the rigid engine",
            WILSON, when=when, needs=("shaft_system", *needs), make=make,
            of_shaft=_INERTIAS,
        )
        for when, needs, make in (
            ("reciprocating_included", (), lambda shaft_system, **values: shaft_system.inertia(
                values, np.zeros(len(shaft_system.throws)))),
            ("reciprocating_added", ("mean_reciprocating_inertia",),
             lambda shaft_system, mean_reciprocating_inertia, **values: shaft_system.inertia(
                 values, np.zeros(len(shaft_system.throws))) + mean_reciprocating_inertia),
        )
    ),
    Node(
        "torsional_modes", "", "", "natural frequencies and mode shapes of the shaft",
        kind="stage", public=False, needs=(*OF_SYSTEM, "speed_of_modes", "mode"),
        gives=("natural_frequency", "mode_shape", "mode_node", "modal_inertia", "mode_torque",
               *_NUMBERS), make=_modes,
        width=OF_MODES, source=WILSON, of_shaft=_ELASTIC,
    ),
    _of_modes("natural_frequency", "f_m", "Hz", "natural frequencies of the undamped shaft", ()),
    _of_modes("mode_shape", "a", "1",
              "mode shape: amplitude of each disc, in its own turns, over that of the disc that "
              "moves most", ("disc",)),
    _of_modes("mode_node", "x_0", "1",
              "node of a mode: where in a shaft it does not move, as the part of the way from its "
              "first disc", ("shaft",)),
    _of_modes("modal_inertia", "J_m", "kg m2",
              "modal inertia, referred to the disc that moves most", ()),
    _of_modes("mode_torque", "T_m", "N m degree-1",
              "torque in each shaft in a mode, per degree of amplitude of the free end of the "
              "crankshaft (Holzer table)", ("shaft",), si=1.0 / DEGREE),
    *(
        Node(name, symbol, unit, long_name, WILSON, needs=("torsional_modes",), adds=(place,))
        for name, symbol, unit, long_name, place in (
            ("system_inertia", "J", "kg m2",
             "moment of inertia of each disc, with all that is added to it, at its own speed",
             "disc"),
            ("system_stiffness", "k", "N m rad-1", "stiffness of each shaft, at its own speed",
             "shaft"),
            ("system_speed_ratio", "i", "1", "speed of each disc over that of the crank", "disc"),
        )
    ),
    Node(
        "torsional_damping", "", "", "damping of the modes of the shaft", kind="stage",
        public=False,
        needs=(*OF_SYSTEM, "speed_of_modes", "load_damping", "damping_speed", "mode"),
        gives=("modal_damping_ratio", *_DAMPED), make=_damping, of_shaft=OF_ALL, width=OF_MODES,
        source=WILSON,
    ),
    Node(
        "modal_damping_ratio", r"\zeta_m", "1",
        "damping ratio of each undamped mode, from the losses of its shape: for small damping",
        WILSON, needs=("torsional_damping",), adds=("mode",),
    ),
    *(
        Node(name, "", "rad s-1", f"{text} of each damped mode", WILSON, public=False,
             needs=("torsional_damping",), adds=("mode",))
        for name, text in (("damped_natural_omega", "natural angular frequency"),
                           ("damped_swing_omega", "angular frequency of the free swing"))
    ),
    Node(
        "damped_natural_frequency", "f_d", "Hz",
        "natural frequency of each damped mode, |s| of its complex eigenvalue s: where its "
        "response lags by a quarter", WILSON,
        make=lambda damped_natural_omega: damped_natural_omega / (2.0 * np.pi),
    ),
    Node(
        "damped_swing_frequency", "f_s", "Hz",
        "frequency at which each damped mode swings freely, Im s of its complex eigenvalue s",
        WILSON, make=lambda damped_swing_omega: damped_swing_omega / (2.0 * np.pi),
    ),
    Node(
        "damping_ratio", r"\zeta_d", "1",
        "damping ratio of each damped mode, -Re s/|s| of its complex eigenvalue s", WILSON,
        needs=("torsional_damping",), adds=("mode",),
    ),
    *_critical("damped_critical_speed", "n_d", "the natural frequency of a damped mode",
               "damped_natural_frequency", ("load_damping",), OF_ALL),
    *_critical("critical_speed", "n_c", "a natural frequency of the undamped shaft",
               "natural_frequency", (), _ELASTIC),
    Node(
        "mode_vector_sum", r"|\sum a_j e^{i\nu\psi_j}|", "1",
        "sum of the phase vectors of all throws, each times the amplitude of its disc in a mode",
        WILSON, removes=("throw", "disc"), make=_vector_sum,
    ),
)  # fmt: skip
