"""Nodes of the largest torque in each shaft while the speed passes a range.

The formulas are those of `engine_dyn.torsion.passing`.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from engine_dyn.quantities.node import Node, parameter
from engine_dyn.quantities.shaft_response import (
    EXCITED,
    NEEDS,
    OF_NUMBERS,
    Acting,
    acting_torques,
    on_discs,
    with_outcome,
)
from engine_dyn.quantities.torsion import system_of
from engine_dyn.status import OF_SPEED
from engine_dyn.units import RPM

if TYPE_CHECKING:
    from engine_dyn.torsion.excitation import Excitation
    from engine_dyn.torsion.shaft import Shaft

LEWIS = "Lewis, Vibration during acceleration through a critical speed"

PARAMETERS: tuple[Node, ...] = (
    parameter("passing_start", "n_1", "rpm", "speed of the crank at which a passing begins, in "
              "steady running", LEWIS, si=RPM, low=0.0),
    parameter("passing_end", "n_2", "rpm", "speed of the crank at which a passing ends, above or "
              "below its start", LEWIS, si=RPM, low=0.0),
    parameter("speed_ramp", "dn/dt", "rpm s-1", "change of the speed over time in a passing", LEWIS,
              si=RPM, low=0.0),
)  # fmt: skip


def _pass(
    when: str, *, passing_start: Any, passing_end: Any, speed_ramp: Any, curve_period: float,
    wanted: tuple[str, ...], threads: int | None = None, progress: Any = None, **values: Any,
) -> dict[str, Any]:  # fmt: skip
    from engine_dyn.torsion.passing import AtNodes, node_speeds, passing

    del wanted
    shaft: Shaft = values["shaft_system"]
    start, nowhere = passing_start, np.equal(passing_start, passing_end)
    end = np.where(nowhere, 2.0 * start, passing_end)
    if shaft.damping_over_speed:
        values["damping_speed"] = 0.5 * (start + end)
    system, bad = system_of(values)
    bad = bad | nowhere
    orders, ratios = np.ravel(values["every_order"]), shaft.speed_ratios(values)
    acting = acting_torques(when, shaft, ratios, curve_period=curve_period, **values)
    drifting: list[tuple[Acting, Excitation, Any]] = []
    for one, factor in zip(shaft.excitations, shaft.excitation_factors(values), strict=True):
        ratio, at = np.asarray(ratios[one.disc]), np.asarray(node_speeds(start, end))
        signed, in_step = np.sign(ratio) * factor, one.in_step(ratio, curve_period)
        if one.speeds.size:
            known = np.isfinite(one.mean(at)).all(axis=-1)
            bad, at = bad | ~known, np.where(known[..., None], at, one.within)
            ratio = ratio[..., None]
        else:
            at, signed = np.asarray(one.reference_speed), signed * one.reference_speed**-one.power
        made = partial(Acting, (one.disc,), power=one.power)
        if np.any(in_step):
            harmonics = one.harmonics(orders, at, ratio)[..., None, :]
            acting.append(made(AtNodes(harmonics) if one.speeds.size else harmonics,
                               signed * in_step))  # fmt: skip
        if not np.all(in_step):
            own = one.own_harmonics(at)[..., None, :]
            drifting.append((made(AtNodes(own) if one.speeds.size else own, signed * ~in_step),
                             one, np.abs(ratios[one.disc])))  # fmt: skip
    discs = list(dict.fromkeys(disc for part in acting for disc in part.discs))
    torques = [
        AtNodes(on_discs(part._replace(harmonics=part.harmonics.torque), discs))
        if isinstance(part.harmonics, AtNodes) else on_discs(part, discs) for part in acting
    ]  # fmt: skip
    found = passing(
        system, orders, start, end, speed_ramp, discs, torques, [part.factor for part in acting],
        [part.power for part in acting], period=curve_period, threads=threads, progress=progress,
    )  # fmt: skip
    torque, speed, status = found["half_range"], found["speed"], found["status"]
    for part, one, size in drifting:
        more = passing(
            system, one.orders, start * size, end * size, speed_ramp * size, [one.disc],
            [part.harmonics], [part.factor * size**-part.power], [part.power], period=one.period,
            threads=threads,
        )  # fmt: skip
        own = more["half_range"], more["speed"] / np.asarray(size)[..., None]
        speed = np.where(own[0] > torque, own[1], speed)
        torque, status = torque + own[0], np.maximum(status, more["status"])
    results = {"shaft_torque_in_passing": torque, "speed_in_passing": speed}
    results, status = with_outcome(results, status, bad, values["load_damping"])
    return {**results, "passing_status": status.astype(float)}


def _result(name: str, symbol: str, unit: str, long_name: str, **more: Any) -> Node:
    return Node(name, symbol, unit, long_name, LEWIS, needs=("torsional_passing",), **more)


NODES: tuple[Node, ...] = (
    *(
        Node(
            "torsional_passing", "", "", "vibration of the shaft while the speed passes a range",
            kind="stage", public=False, outcome="passing_status", source=LEWIS,
            make=partial(_pass, when),
            of_shaft=OF_NUMBERS, width=60_000, when=when,
            gives=("shaft_torque_in_passing", "speed_in_passing", "passing_status"),
            needs=(*NEEDS, "passing_start", "passing_end", "speed_ramp", *needs),
        )
        for when, (_, needs) in EXCITED.items()
    ),
    _result("shaft_torque_in_passing", r"\hat T_p", "N m",
            "largest half range of the torque in each shaft while the speed passes a range",
            adds=("shaft",)),
    _result("speed_in_passing", "n_p", "rpm", "speed of the crank at which the torque in each "
            "shaft is largest while it passes a range", adds=("shaft",), si=RPM),
    _result("passing_status", r"\chi_p", "1", "outcome of passing a range of speeds",
            meanings=OF_SPEED),
)  # fmt: skip
