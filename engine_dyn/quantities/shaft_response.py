"""Nodes of the forced vibration of the shaft: what acts on it, and how it answers.

The formulas are those of `engine_dyn.torsion`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from engine_dyn.forces.torque import piston_area
from engine_dyn.loads.driven_machine import harmonics_of_load
from engine_dyn.quantities.node import Node, formula, hidden, power, variants
from engine_dyn.quantities.orders import EVERY
from engine_dyn.quantities.shaft_numbers import WILSON
from engine_dyn.quantities.torsion import OF_ALL, OF_SYSTEM, system_of
from engine_dyn.status import CONVERGED, INVALID_INPUT, NO_STEADY_STATE, OF_SPEED
from engine_dyn.torsion.couplings import CONTACTS, departure
from engine_dyn.torsion.shaft import Shaft, mean_torques_of_throws
from engine_dyn.torsion.system import ShaftSystem, mean_torques
from engine_dyn.units import DEGREE

KRACK = "Krack and Gross, Harmonic Balance for Nonlinear Vibration Problems"

COMPLEX = 16  # Bytes of one harmonic, a complex number

_RESULTS = {
    "disc_harmonics": "angle", "shaft_harmonics": "torque",
    "disc_angle_half_range": "angle_extremes", "shaft_torque_half_range": "torque_extremes",
    "shaft_torque_lowest": "torque_extremes", "shaft_torque_highest": "torque_extremes",
    "shaft_twist_half_range": "twist_extremes", "crankshaft_twist_half_range": "twist_extremes",
    "delta_elastic": "speed_extremes", "shaft_loss": "shaft_loss",
}  # fmt: skip
"""Results of the stage, each with the result of `engine_dyn.torsion.forced` that it comes from."""


class Acting(NamedTuple):
    """A part of the torques on discs: harmonics times a factor times a power of the speed.

    Parts are added up later: a node of their sum would keep an array for each design.
    """

    discs: tuple[int, ...]
    harmonics: Any  # With axes of discs and orders
    factor: Any  # Of each design
    power: float = 0.0  # Power of the crank's speed [rad/s]


def _of_cylinders(
    shaft: Shaft, *, every_throw_gas_sum: Any, every_throw_speed_sum: Any,
    every_throw_inertia_sum: Any, every_throw_friction_sum: Any, pressure_scale: Any,
    crankcase_pressure: Any, bore: Any, reciprocating_mass: Any, double_radius: Any, **_: Any,
) -> list[Acting]:  # fmt: skip
    """Torques on throws."""
    radius = 0.5 * double_radius
    lever = piston_area(bore) * radius
    parts = (
        (every_throw_gas_sum, lever * pressure_scale, 0.0),
        (every_throw_speed_sum, -lever * crankcase_pressure, 0.0),
        (every_throw_inertia_sum, reciprocating_mass * radius**2, 2.0),
        (every_throw_friction_sum, -lever, 0.0),
    )
    # A torque part that does not act is the number 0.
    return [Acting(shaft.throws, part[0], *part[1:]) for part in parts if np.ndim(part[0])]


def _of_given_torque(
    shaft: Shaft, *, driven: Any, torque_factor: Any, every_order: Any, curve_period: float,
    **_: Any,
) -> list[Acting]:  # fmt: skip
    """As `_of_cylinders`, of an engine that gives its torque, on its one throw or on each."""
    harmonics = [
        harmonics_of_load(torque, np.ravel(every_order), curve_period)
        for torque in driven.throw_torques or (driven.engine_torque,)
    ]
    return [Acting(shaft.throws, np.array(harmonics), torque_factor)]


EXCITED: Mapping[str, tuple[Callable[..., list[Acting]], tuple[str, ...]]] = {
    "by_pressure": (_of_cylinders, (
        *(f"{EVERY}throw_{part}_sum" for part in ("gas", "speed", "inertia", "friction")),
        "pressure_scale", "crankcase_pressure", "bore", "reciprocating_mass", "double_radius",
    )),
    "by_torque": (_of_given_torque, ("driven", "torque_factor")),
}  # fmt: skip
"""Torques of the engine in scenes of each word, and what they need."""

NEEDS = (
    *OF_SYSTEM, "load_damping", "every_order", "curve_period", f"{EVERY}load_harmonics",
    f"{EVERY}auxiliary_harmonics", "load_swing",
)  # fmt: skip
"""What the vibration of a shaft needs besides the torques of the engine."""

OF_NUMBERS = (*OF_ALL, "excitation_factor")


def acting_torques(
    when: str, shaft: Shaft, ratios: list[Any], *, every_load_harmonics: Any,
    every_auxiliary_harmonics: Any, load_swing: Any, **values: Any,
) -> list[Acting]:  # fmt: skip
    """Torques of engine, load and auxiliaries, whose discs have these speed ratios."""
    acting = EXCITED[when][0](shaft, **values)
    for disc, harmonics, factor in (
        (shaft.load, every_load_harmonics, -load_swing / ratios[shaft.load]),
        (shaft.auxiliaries, every_auxiliary_harmonics, -1.0 / ratios[shaft.auxiliaries]),
    ):
        if np.ndim(harmonics):
            acting.append(Acting((disc,), np.expand_dims(harmonics, -2), factor))
    return acting


def with_outcome(
    results: dict[str, Any], status: Any, bad: Any, load_damping: Any
) -> tuple[dict[str, Any], Any]:
    """Results and outcomes of designs of which some, `bad`, have no system: these get NaN."""
    if not bad.any():
        return results, status
    for name, array in results.items():
        own = array.ndim - status.ndim
        results[name] = np.where(bad[(..., *(None,) * own)], np.nan, array)
    status = np.where(bad & (status == CONVERGED), INVALID_INPUT, status)
    return results, np.where(np.isneginf(load_damping), NO_STEADY_STATE, status)


def _excited(
    when: str, *, speed: Any, **values: Any
) -> tuple[ShaftSystem, Any, list[Acting], list[Any]]:
    """System, designs without one, what excites it, and what does not repeat with the cycle."""
    shaft: Shaft = values["shaft_system"]
    system, bad = system_of(values)
    orders, ratios = np.ravel(values["every_order"]), shaft.speed_ratios(values)
    curve_period = values["curve_period"]
    acting = [
        part._replace(factor=part.factor * power(speed, part.power) if part.power else part.factor)
        for part in acting_torques(when, shaft, ratios, **values)
    ]
    drifting = []
    for one, factor in zip(shaft.excitations, shaft.excitation_factors(values), strict=True):
        ratio, known = ratios[one.disc], np.isfinite(one.mean(speed))
        bad = bad | ~known
        within = np.where(known, speed, one.within)
        in_step = one.in_step(ratio, curve_period)
        if np.any(in_step):
            harmonics = one.harmonics(orders, within, np.where(in_step, ratio, 0.0))
            factors = np.sign(ratio) * factor * in_step
            acting.append(Acting((one.disc,), harmonics[..., None, :], factors))
        if not np.all(in_step):
            drifting.append((one, factor * ~in_step, within, ratio))
    return system, bad, acting, drifting


def _respond(
    when: str, *, order: Any, wanted: tuple[str, ...], threads: int | None = None,
    progress: Any = None, **values: Any,
) -> dict[str, Any]:  # fmt: skip
    from engine_dyn.torsion.excitation import add_drifting
    from engine_dyn.torsion.forced import forced_response
    from engine_dyn.torsion.synthesis import half_range

    shaft: Shaft = values["shaft_system"]
    speed, orders = values["speed"], np.ravel(values["every_order"])
    system, bad, acting, drifting = _excited(when, **values)
    discs = list(dict.fromkeys(disc for part in acting for disc in part.discs))
    pairs = [*shaft.shafts, (0, shaft.flywheel)]
    response = forced_response(
        system, orders, speed, discs, [on_discs(part, discs) for part in acting],
        [part.factor for part in acting], kept=np.searchsorted(orders, np.ravel(order) - 1e-9),
        wanted=tuple(dict.fromkeys(_RESULTS[name] for name in wanted if name in _RESULTS)),
        twist=pairs, speed_of=(shaft.flywheel,), period=values["curve_period"], threads=threads,
        progress=progress,
    )  # fmt: skip
    for one, factor, within, ratio in drifting:
        response = add_drifting(
            response, system, one, factor, within, ratio, twist=pairs, speed_of=(shaft.flywheel,),
            threads=threads,
        )  # fmt: skip

    def value(name: str) -> Any:
        result = response[_RESULTS[name]]
        match name:
            case "shaft_torque_lowest":
                return result[..., 0]
            case "shaft_torque_highest":
                return result[..., 1]
            case "delta_elastic":
                return result[..., 0, 1] - result[..., 0, 0]
            case "shaft_twist_half_range":
                return half_range(result)[..., :-1]
            case "crankshaft_twist_half_range":
                return half_range(result)[..., -1]
        return half_range(result) if name.endswith("half_range") else result

    results = {name: value(name) for name in wanted if name in _RESULTS}
    results, status = with_outcome(results, response["status"], bad, values["load_damping"])
    return {**results, "torsion_status": status.astype(float)}


def _respond_nonlinear(
    when: str, *, shaft_torque_mean: Any, wanted: tuple[str, ...],
    threads: int | None = None, progress: Any = None, **values: Any,
) -> dict[str, Any]:  # fmt: skip
    from engine_dyn.torsion.nonlinear import nonlinear_response
    from engine_dyn.torsion.synthesis import half_range

    del wanted
    shaft: Shaft = values["shaft_system"]
    system, bad, acting, drifting = _excited(when, **values)
    for _, factor, *_ in drifting:  # No cycle repeats
        bad = bad | (factor != 0.0)
    discs = list(dict.fromkeys(disc for part in acting for disc in part.discs))
    torque = sum(
        on_discs(part, discs) * np.asarray(part.factor)[..., None, None] for part in acting
    )
    couplings = shaft.couplings(values)
    found = nonlinear_response(
        system, couplings, np.ravel(values["every_order"]), values["speed"], discs, torque,
        np.where(np.asarray(bad)[..., None], np.nan, shaft_torque_mean),
        wanted=("torque_extremes",), period=values["curve_period"], threads=threads,
        progress=progress,
    )  # fmt: skip
    contact = np.full((*found["status"].shape, len(shaft.shafts)), np.nan)
    for c, coupling in enumerate(couplings):
        own = np.where(found["contact"][..., c] < 0, np.nan, found["contact"][..., c])
        contact[..., coupling.shaft] = np.where(np.asarray(coupling.clearance) > 0.0, own, np.nan)
    return {
        "shaft_torque_nonlinear": half_range(found["torque_extremes"]),
        "coupling_contact": contact, "nonlinear_error": found["error"],
        "nonlinear_status": np.where(
            np.isneginf(values["load_damping"]), NO_STEADY_STATE, found["status"]
        ).astype(float),
    }  # fmt: skip


def _without_last(values: Mapping[str, Any]) -> dict[str, Any]:
    """Values without the last axis, of discs or shafts, along which they do not vary."""
    return {name: np.asarray(v)[..., 0] if np.ndim(v) else v for name, v in values.items()}


def _departure(
    *, shaft_system: Shaft, shaft_torque_mean: Any, shaft_torque_half_range: Any,
    coupling_stiffness: Any, **values: Any,
) -> Any:  # fmt: skip
    """Departure of each coupling from its linear form; given values have the axis of shafts."""
    own = _without_last(values)
    stiffness = shaft_system.stiffnesses(own, coupling_stiffness)
    mean, half = np.asarray(shaft_torque_mean), np.asarray(shaft_torque_half_range)
    columns: list[Any] = [np.nan * mean[..., 0] * half[..., 0]] * len(shaft_system.shafts)
    for coupling in shaft_system.couplings(own):
        k = np.where(stiffness[coupling.shaft] == 0.0, np.nan, stiffness[coupling.shaft])
        columns[coupling.shaft] = departure(
            coupling, mean[..., coupling.shaft], half[..., coupling.shaft], k
        )
    return np.stack(np.broadcast_arrays(*columns), axis=-1)


def on_discs(part: Acting, discs: list[int]) -> Any:
    """Harmonics of a part, extended to more discs, which get 0."""
    given = np.asarray(part.harmonics)[..., : len(part.discs), :]
    if list(part.discs) == discs:
        return given
    torques = np.zeros((*given.shape[:-2], len(discs), given.shape[-1]), dtype=np.complex128)
    torques[..., [discs.index(disc) for disc in part.discs], :] = given
    return torques


def _mean_torques(
    *, shaft_system: Shaft, throw_torque_mean: Any, auxiliary_mean: Any, **values: Any
) -> Any:
    """Mean torque in each shaft; given torques have the axis of throws last.

    The speed is that of excitations.
    """
    own = _without_last(values)
    each, ratios = np.asarray(throw_torque_mean), shaft_system.speed_ratios(own)
    means = [
        np.sign(ratios[one.disc]) * factor * one.mean(own["speed"])
        for one, factor in zip(
            shaft_system.excitations, shaft_system.excitation_factors(own), strict=True
        )
    ]
    shape = np.broadcast_shapes(each.shape[:-1], *(np.shape(mean) for mean in means))
    torque = np.zeros((*shape, len(shaft_system.discs)))
    for one, mean in zip(shaft_system.excitations, means, strict=True):
        torque[..., one.disc] += mean
    for number, disc in enumerate(shaft_system.throws):
        torque[..., disc] += each[..., number]
    at = shaft_system.auxiliaries
    torque[..., at] -= auxiliary_mean / ratios[at]
    return mean_torques(shaft_system.paths(own), torque, shaft_system.load)


def _torque_min(*torques: Any) -> Any:
    from engine_dyn.torsion.synthesis import least_torque

    return least_torque(*torques)


def _largest_order(of: str) -> Any:
    """Order of the largest amplitude of harmonics; NaN where all are."""

    def make(order: Any, **needs: Any) -> Any:
        size = np.abs(needs[of])
        place = np.where(np.isnan(size), -1.0, size).argmax(axis=-1)
        return np.where(np.isnan(size).all(axis=-1), np.nan, np.ravel(order)[place])

    return make


def _result(name: str, symbol: str, unit: str, long_name: str, adds: tuple[str, ...] = (),
            **more: Any) -> Node:  # fmt: skip
    return Node(
        name, symbol, unit, long_name, WILSON, needs=("torsional_response",), adds=adds,
        **more,
    )  # fmt: skip


def _polar(what: str, symbol: str, unit: str, si: float, long_name: str, of: str) -> list[Node]:
    """Nodes of amplitude, phase and largest order of harmonics."""
    return [
        Node(f"{what}_order", symbol, unit, f"amplitude of the orders of the {long_name}", WILSON,
             needs=(of,), si=si, make=lambda **needs: np.abs(needs[of])),
        Node(f"{what}_phase", rf"\psi({symbol})", "degree",
             f"phase of the orders of the {long_name}, psi of cos(nu phi + psi)", WILSON,
             needs=(of,), si=DEGREE, make=lambda **needs: np.angle(needs[of])),
        Node(f"{what}_largest_order", rf"\nu_{{max}}({symbol})", "1",
             f"order of the largest amplitude of the {long_name}", WILSON, needs=(of, "order"),
             removes=("order",), make=_largest_order(of)),
    ]  # fmt: skip


_COUPLINGS = ("shaft_clearance", "shaft_friction_torque", "shaft_friction_stiffness")
_DISC_ANGLE = "angle of each disc against uniform rotation"
_SHAFT_TORQUE = "vibratory torque in each shaft"

NODES: tuple[Node, ...] = (
    *variants(
        Node("load_swing", "", "1", "factor on the harmonics of the load over angle, at the crank",
             public=False),
        {
            "steady_load": lambda: 0.0,
            "angle_load": lambda load_gear, load_table_factor: load_gear * load_table_factor,
        },
    ),
    *(
        Node(
            name, "", "", long_name, kind="stage", public=False, outcome=gives[-1], source=source,
            make=partial(respond, when), of_shaft=(*OF_NUMBERS, *own), gives=gives, width=width,
            when=when, needs=(*NEEDS, "damping_speed", "speed", more, *needs),
        )
        for name, long_name, source, respond, own, gives, width, more in (
            ("torsional_response", "steady torsional vibration of the shaft", WILSON, _respond, (),
             (*_RESULTS, "torsion_status"), 3000, "order"),
            ("nonlinear_response", "vibration of the shaft with couplings that are not linear",
             KRACK, _respond_nonlinear, _COUPLINGS,
             ("shaft_torque_nonlinear", "coupling_contact", "nonlinear_error", "nonlinear_status"),
             100_000, "shaft_torque_mean"),
        )
        for when, (_, needs) in EXCITED.items()
    ),
    _result("disc_harmonics", "", "rad", f"harmonics of the {_DISC_ANGLE}", ("disc", "order"),
            public=False, width=COMPLEX),
    _result("shaft_harmonics", "", "N m", f"harmonics of the {_SHAFT_TORQUE}",
            ("shaft", "order"), public=False, width=COMPLEX),
    *_polar("disc_angle", r"\theta_\nu", "degree", DEGREE, _DISC_ANGLE, "disc_harmonics"),
    *_polar("shaft_torque", r"T_\nu", "N m", 1.0, _SHAFT_TORQUE, "shaft_harmonics"),
    _result("disc_angle_half_range", r"\hat\theta", "degree",
            f"{_DISC_ANGLE}, half of its range over the cycle", ("disc",), si=DEGREE),
    _result("shaft_twist_half_range", r"\hat{\Delta\theta}", "degree",
            "twist between the two discs of each shaft, half of its range over the cycle",
            ("shaft",), si=DEGREE),
    _result("crankshaft_twist_half_range", r"\hat{\Delta\theta}_F", "degree",
            "twist between disc 1 and flywheel, half of its range over the cycle", si=DEGREE),
    _result("shaft_torque_half_range", r"\hat T", "N m",
            f"{_SHAFT_TORQUE}, half of its range over the cycle", ("shaft",)),
    _result("shaft_torque_lowest", "", "N m", f"least {_SHAFT_TORQUE}", ("shaft",), public=False),
    _result("shaft_torque_highest", "", "N m", f"largest {_SHAFT_TORQUE}", ("shaft",),
            public=False),
    _result("shaft_loss", "P", "W", "mean power lost in each shaft, coupling or damper",
            ("shaft",)),
    _result("delta_elastic", r"\delta_e", "1",
            "coefficient of speed fluctuation of the flywheel's disc on the elastic shaft, linear; "
            "delta is that of the rigid engine"),
    _result("torsion_status", r"\chi_T", "1", "outcome of the torsional vibration",
            meanings=OF_SPEED),
    *(
        Node(name, symbol, unit, long_name, KRACK, needs=("nonlinear_response",), adds=adds,
             meanings=meanings)
        for name, symbol, unit, long_name, adds, meanings in (
            ("shaft_torque_nonlinear", r"\hat T_n", "N m", f"{_SHAFT_TORQUE} with couplings that "
             "are not linear, half of its range over the cycle", ("shaft",), ()),
            ("coupling_contact", r"\chi_c", "1", "what each coupling with clearance does over the "
             "cycle: touches one side always, or at times, or both, or none", ("shaft",),
             CONTACTS),
            ("nonlinear_error", r"\epsilon_n", "1", "error of torque and twist of the couplings "
             "that are not linear, over their half ranges", (), ()),
            ("nonlinear_status", r"\chi_n", "1", "outcome of the vibration with couplings that are "
             "not linear", (), OF_SPEED),
        )
    ),
    Node(
        "coupling_departure", r"\Delta T/\hat T", "1",
        "largest difference of the torque of a coupling from its linear form, over the linear half "
        "range: above 0.1 the linear results do not hold", "definition", adds=(),
        needs=("shaft_system", "shaft_torque_mean", "shaft_torque_half_range",
               "coupling_stiffness"),
        make=_departure,
        of_shaft=(*_COUPLINGS, "shaft_stiffness", "shaft_length", "shaft_diameter", "shaft_bore",
                  "shaft_shear_modulus"),
    ),
    hidden(
        "throw_torque_mean", "N m",
        "mean torque on each throw, less its share of the friction without auxiliaries over angle",
        lambda pressure_scale, bore, double_radius, crank_ratio, offset_ratio, row, family,
        friction_torque, auxiliary_mean, cylinder_set, cylinders_by_count, throw:
        mean_torques_of_throws(
            pressure_scale * piston_area(bore) * 0.5 * double_radius, crank_ratio, offset_ratio,
            row, family, friction_torque - auxiliary_mean, cylinder_set, cylinders_by_count,
            throw,
        ), when="by_pressure",
    ),
    hidden(
        "throw_torque_mean", "N m", "mean torque on each throw, as given",
        lambda driven, torque_factor, throw: torque_factor * np.array(
            [torque.mean for torque in driven.throw_torques or (driven.engine_torque,)]
        )[np.asarray(throw, dtype=np.int64) - 1], when="by_torque",
    ),
    *(
        Node(
            "shaft_torque_mean", r"\bar T", "N m",
            "mean torque in each shaft, with the sign of its twist: below 0 where the first disc "
            "drives the second", WILSON, when=when, adds=("shaft",), removes=("throw",),
            needs=("shaft_system", "throw_torque_mean", "auxiliary_mean", *needs),
            make=_mean_torques, of_shaft=("shaft_gear_ratio", *factor),
        )
        for when, needs, factor in (
            ("no_excitations", (), ()), ("excitations", ("speed",), ("excitation_factor",)),
        )
    ),
    Node(
        "shaft_torque_min", "T_{min}", "N m",
        "least torque in each shaft, mean and vibration, in the direction of the mean: below 0 a "
        "coupling or a mesh reverses", WILSON,
        **formula(_torque_min, "shaft_torque_mean", "shaft_torque_lowest", "shaft_torque_highest"),
    ),
)  # fmt: skip
