"""Results at nominal speed: extremes of the torque, the swing of its work, the mean gas torque.

The mean gas torque is the mean over angle of the gas pressure times the reduced piston velocity, of
one cylinder or all, times piston area, crank radius and number of cylinders, docs/method.md (29).
The mean is a sum of columns as the work is, see `engine_dyn.speed.work`, and linear in the factor
on a cylinder's pressure above motored: equal throws need two means at most.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from engine_dyn.compilation import inlined, kernel
from engine_dyn.forces.superposition import CrankTrain, CurveOfDesigns, tops
from engine_dyn.forces.torque import (
    GasPressure,
    friction_of_cylinder,
    gas_torque,
    inertia_torque,
    piston_area,
)
from engine_dyn.geometry.articulated_rod import ArticulatedRod
from engine_dyn.geometry.cylinder_means import mean_of_cylinders
from engine_dyn.geometry.cylinders import Cylinders, CylindersByCount, Member
from engine_dyn.geometry.firing_sequence import PressureFactor
from engine_dyn.loads.driven_machine import NOTHING_DRIVEN, DrivenMachine, whole_ratio
from engine_dyn.loads.friction import StrokeFriction
from engine_dyn.plain_arrays import plain
from engine_dyn.pressure.cycle_table import CycleTable
from engine_dyn.pressure.family import Family, own_diagrams, remembered
from engine_dyn.pressure.motored import pressures_of_rows
from engine_dyn.speed.designs import Designs, Inputs, discard, take_unknown
from engine_dyn.speed.fields import DEFAULTS, FRICTION_NAMES, OF_SPEED_ALONE, TORQUE_NAMES
from engine_dyn.speed.general.newton import Motion, add_row, fill_motion, make_motion, part_of
from engine_dyn.speed.grouping import Grouping, Piece
from engine_dyn.speed.mechanisms import Progress, map_on_threads
from engine_dyn.speed.work.boxes import Box, box_of, boxes_of
from engine_dyn.speed.work.columns import ATMOSPHERE, SLOPE, Columns, mean_weights
from engine_dyn.speed.work.interpolation import largest, max_between, max_near
from engine_dyn.types import Floats, Integers

CLOSE, ROUNDS = np.pi / 18000.0, 3
"""Distance of a parabola's points, 0.01 degree, and largest number of parabolas."""


def torque_extremes(
    *,
    family: Family,
    wanted: Sequence[str],
    cylinders: Any = 1,
    cylinders_by_count: Mapping[int, Cylinders] | None = None,
    tolerance: float = 1e-6,
    threads: int | None = None,
    progress: Progress | None = None,
    driven: DrivenMachine = NOTHING_DRIVEN,
    **inputs: Any,
) -> dict[str, Any]:
    """Largest and smallest torque at nominal speed [N m] and energy swing [J] of every design.

    Arguments are those of `engine_dyn.speed.dispatch.solve`, without those that only the periodic
    speed needs; `wanted` are some of `TORQUE_NAMES`. The energy swing is the range of the work of
    the torque, less a load over angle of `driven`, less the mean.
    """
    inputs = {**DEFAULTS, **dict.fromkeys(OF_SPEED_ALONE, 0.0), **inputs, "inertia": 1.0}
    inputs["gear_ratio"] = whole_ratio(driven.over_angle, inputs["gear_ratio"], family.period)
    inputs["cylinders"] = np.asarray(cylinders, dtype=np.int64)
    unknown, whole = take_unknown(inputs), Inputs.of(inputs)
    high, low, swing = results = [
        np.empty(whole.size if name in wanted else 0) for name in TORQUE_NAMES
    ]
    # A torque is some 20 times as rough as its work, whose roughness determines the number of
    # nodes: so the tolerance is divided by 20. Noise of 0.02 bar at steps of 0.2 degree then leaves
    # an error of 6e-6 of the torque's size; without the division it would be 8e-4.
    grouping = Grouping(whole, family, cylinders_by_count, driven, tolerance / 20.0, ("cylinders",))

    def solve(piece: Piece) -> int:
        for call in piece.calls():
            columns, designs = plain(call.columns), plain(call.designs())
            motion, count = make_motion(columns.fine.shape[1]), call.piece.size
            if swing.size:
                _swings(count, columns, designs, swing, motion)
            if high.size or low.size:
                of_load = call.needs.parts.is_load(designs.part)
                alone = designs._replace(share=plain(np.where(of_load, 0.0, designs.share)))
                # An extreme is searched at four places at most; smooth torques mostly have one.
                places = [np.empty((count if one.size else 0, 4)) for one in (high, low)]
                _places(count, columns, alone, *places, motion.dw)
                sign = np.repeat([1.0, -1.0], [len(place) for place in places])
                curve, target = _torque_of(call.piece), designs.target[:count]
                largest = sign * _highest(sign, np.concatenate(places), columns.width, curve)
                for one, values in ((high, largest[:count]), (low, largest[-count:])):
                    if one.size:
                        one[target] = values
        return piece.size

    for done in map_on_threads(solve, grouping.pieces(None, 1), threads):
        if progress:
            progress(done)
    by_name = zip(TORQUE_NAMES, results, strict=True)
    return discard({n: array.reshape(whole.shape) for n, array in by_name if n in wanted}, unknown)


@inlined
def _top(sign: float, width: float, value: Floats, slope: Floats, missed: Floats) -> float:
    """Largest sign * value, docs/solver.md (98), (99); cubics miss `missed` between nodes."""
    best = largest(sign, value)
    for j in range(len(value)):
        n = (j + 1) % len(value)
        here, up, down = sign * value[j], sign * width * slope[j], sign * width * slope[n]
        if up >= 0.0 and down < 0.0 and here + up >= best:
            found, _ = max_between(here, sign * value[n], up, down, sign * missed[j])
            best = max(best, found)
    return best


@kernel
def _swings(count: int, columns: Columns, designs: Designs, found: Floats, motion: Motion) -> None:
    """Ranges of the work of the first designs [J]; `motion` is scratch."""
    for which in range(count):
        fill_motion(which, False, columns, designs, motion)
        swing = 0.0
        for sign in (1.0, -1.0):
            swing += _top(sign, columns.width, motion.w, motion.dw, motion.w_missed)
        # The works of designs are in units of the kinetic energy of 1 kg m2 at nominal speed.
        found[designs.target[which]] = 0.5 * designs.speed[which] ** 2 * swing


@inlined
def _candidates(sign: float, v: Floats, place: Floats) -> None:
    """Places in nodes where sign * v of a periodic curve may be largest; NaN behind the last one.

    A node above which neither a smooth curve nor a kink rises (see `forces.superposition`) is no
    place. Of too many places, those that reach highest are kept.
    """
    n, number = len(v), 0
    reach = np.empty(len(place))
    highest = largest(sign, v)
    for j in range(n):
        d = sign * v[j]
        c, e = sign * v[(j - 1) % n], sign * v[(j + 1) % n]
        told = 3.0 * d - c - e
        if d < c or d < e or told < highest:
            continue
        here = number
        if number < len(place):
            number += 1
        else:
            here = 0
            for k in range(1, number):
                if reach[k] < reach[here]:
                    here = k
            if told <= reach[here]:
                continue
        b, f = sign * v[(j - 2) % n], sign * v[(j + 2) % n]
        reach[here], place[here] = told, j + max_near(b, c, d, e, f)
    for k in range(number, len(place)):
        place[k] = np.nan


@kernel
def _places(
    count: int, columns: Columns, designs: Designs, high: Floats, low: Floats, torque: Floats
) -> None:
    """Places in nodes where torques may be largest and smallest, by design; `torque` is scratch."""
    for which in range(count):
        for j in range(len(torque)):
            torque[j] = 0.0
        for piece in range(designs.part.shape[0] + 1):
            part, share = part_of(piece, which, designs)
            if share != 0.0:
                add_row(torque, share, columns.fine[part], SLOPE, designs.factor[which])
        if len(high) > 0:
            _candidates(1.0, torque, high[which])
        if len(low) > 0:
            _candidates(-1.0, torque, low[which])


def _torque_of(piece: Piece) -> CurveOfDesigns:
    """Function of the torque of a piece's designs [N m], each once or more, at any angles."""
    source, driven, key = piece.source, piece.grouping.driven, piece.key[0]
    depends_on = (
        "crank_ratio", "double_radius", "offset_ratio", "bore", "row", "scale",
        "crankcase_pressure", "mass", "speed", "friction_torque", "torque_factor", *FRICTION_NAMES,
    )  # fmt: skip
    given = {name: np.broadcast_to(piece.chosen.take(name), piece.size) for name in depends_on}
    levels = [given[name] for name in FRICTION_NAMES]
    uniform = not any(level.any() for level in levels[:-1])
    known: dict[tuple[Any, ...], Floats] = {}

    def at(which: Integers, angle: Floats, means: dict[tuple[Any, ...], Floats]) -> Floats:
        one = {name: column[which] for name, column in given.items()}
        train = CrankTrain(
            one["crank_ratio"], one["double_radius"], np.full(which.size, key),
            source.cylinders.period, one["offset_ratio"], {key: source.cylinders},
        )  # fmt: skip
        gas = GasPressure(source.family, one["row"], one["scale"], one["crankcase_pressure"])
        torque = gas_torque(angle, train, one["bore"], gas)
        torque = torque + inertia_torque(angle, train, one["mass"], one["speed"])
        torque = torque - one["friction_torque"]
        if not uniform:
            friction = StrokeFriction._make(level[which] for level in levels)
            varying = train.superpose(friction_of_cylinder(train, gas, friction, means), angle)
            torque = torque - piston_area(one["bore"]) * 0.5 * one["double_radius"] * varying
        if driven.engine_torque is not None:
            torque = torque + one["torque_factor"] * driven.engine_torque(angle)
        if driven.auxiliaries is not None:
            mean = driven.auxiliaries.mean if driven.engine_torque is None else 0.0
            torque = torque - (driven.auxiliaries(angle) - mean)
        return np.asarray(torque)

    if not uniform:  # the means over the cycle are computed once
        at(np.arange(piece.size), np.zeros(piece.size), known)

    def curve(row: Integers, angle: Floats) -> Floats:
        which = row % piece.size
        return at(which, angle, {name: mean[:, which] for name, mean in known.items()})

    return curve


def _highest(sign: Floats, place: Floats, width: float, curve: CurveOfDesigns) -> Floats:
    """Largest sign * value of the curves themselves, from places in nodes, (row, candidate).

    There is a row or two for each design. Parabolas through three near points find the value; where
    they do not converge, at a kink or in noise, the search of `forces.superposition` does.
    """
    which, column = np.nonzero(np.isfinite(place))
    angle = place[which, column] * width
    node = np.rint(place[which, column]) * width

    def signed(row: Integers, angle: Floats) -> Floats:
        return sign[row] * curve(row, angle)

    def near(chosen: Integers, angle: Floats, step: float) -> Floats:
        angles = angle[:, None] + step * np.array([-1.0, 0.0, 1.0])
        return signed(np.repeat(which[chosen], 3), angles.reshape(-1)).reshape(-1, 3).T

    highest, rest = np.full(len(place), np.nan), np.arange(which.size)
    for _ in range(ROUNDS):
        if not rest.size:
            return highest
        before, here, after = near(rest, angle[rest], CLOSE)
        slope, bend = 0.5 * (after - before), before - 2.0 * here + after
        with np.errstate(divide="ignore", invalid="ignore"):
            shift = np.where(bend < 0.0, -slope / bend, 2.0 * np.sign(slope))
            top = here + np.where(np.abs(shift) <= 1.0, 0.5 * slope * shift, 0.0)
        np.fmax.at(highest, which[rest], np.fmax(np.fmax(before, after), top))
        far = np.abs(shift) > 1.0
        rest, moved = rest[far], CLOSE * shift[far]
        angle[rest] = np.clip(angle[rest] + moved, node[rest] - width, node[rest] + width)
    around = near(rest, node[rest], width) if rest.size else np.empty((3, 0))
    top, _ = tops(len(place), which[rest], node[rest], around, width, signed)
    return np.fmax(highest, top)


ROWS_AT_ONCE = 384  # Diagrams whose pressures are tabulated at a time


def mean_gas_torque(
    crank_ratio: Any, row: Any, family: Family, offset_ratio: Any = 0.0,
    pressure_factor: PressureFactor = 1.0, rod: ArticulatedRod | None = None,
) -> Floats:  # fmt: skip
    """Mean over angle of p c/(r omega) [Pa] for one cylinder, broadcasting.

    docs/method.md (29). Times A r this is the mean torque of the absolute pressure, and of the
    gauge pressure too, because the crankcase pressure does no work over a cycle. The quadrature is
    three-point Gauss-Legendre on half degrees. Of a factor for each cycle it is the mean over them.
    """
    if isinstance(pressure_factor, tuple):
        each = {
            factor: mean_gas_torque(crank_ratio, row, family, offset_ratio, factor, rod)
            for factor in sorted(set(pressure_factor))
        }
        return np.mean([each[factor] for factor in pressure_factor], axis=0)
    given = np.broadcast_arrays(
        *(np.asarray(v, dtype=float) for v in (crank_ratio, offset_ratio, row))
    )
    # Copies: kernels ask for write access, and NumPy warns about that for broadcast arrays.
    ratio, offset, places = (np.array(v).reshape(-1) for v in given)
    result, number = np.empty(ratio.size), boxes_of(ratio, offset, alone=rod is not None)
    for one in np.unique(number).tolist():
        here = np.flatnonzero(number == one)
        box = box_of(one, float(ratio[here[0]]), float(offset[here[0]]))
        low = np.floor(places[here]).astype(np.int64)
        weight = places[here] - low
        rows = np.unique(np.concatenate([low, low + (weight > 0.0)]))
        (means,) = remembered(
            family, ("mean gas", box, pressure_factor, rod, rows.tobytes()),
            partial(_means, family, box, Member(0.0, pressure_factor, 1.0, rod=rod), rows),
        )  # fmt: skip
        factors = box.factors(ratio[here], offset[here])
        result[here] = _add_up(factors, np.searchsorted(rows, low), weight, means)
    return result.reshape(given[0].shape)


def _means(family: Family, box: Box, member: Member, rows: Integers) -> tuple[Floats, ...]:
    """Mean of each diagram times each column of the velocity, shape (row, term)."""
    angle, weights = mean_weights(member, box, family.period)
    means = np.empty((rows.size, len(weights)))
    if isinstance(family, CycleTable):  # all rows at once: a later request may replace earlier rows
        family.curves(rows)
    for begin in range(0, rows.size, ROWS_AT_ONCE):
        some = rows[begin : begin + ROWS_AT_ONCE]
        pressure = pressures_of_rows(family, some, angle, member.pressure_factor) - ATMOSPHERE
        _weigh(weights, pressure, means[begin : begin + some.size])
    return (means,)


@kernel
def _weigh(weights: Floats, pressure: Floats, found: Floats) -> None:
    """Sum of pressures times weights, for each row of weights and each row of pressures."""
    for i in range(pressure.shape[0]):
        for t in range(weights.shape[0]):
            total = 0.0
            for j in range(weights.shape[1]):
                total += weights[t, j] * pressure[i, j]
            found[i, t] = total


@kernel
def _add_up(factors: Floats, row: Integers, weight: Floats, means: Floats) -> Floats:
    """Sum over columns of each design, interpolated between two diagrams."""
    found = np.zeros(weight.size)
    for i in range(found.size):
        after = row[i] + (weight[i] > 0.0)
        for t in range(factors.shape[1]):
            mean = (1.0 - weight[i]) * means[row[i], t] + weight[i] * means[after, t]
            found[i] += factors[i, t] * mean
    return found


def mean_gas_of_equal_throws(
    crank_ratio: Any, offset: Any, row: Any, family: Family, pressure_factor: Any
) -> Any:
    """Mean of p v [Pa] where all crank radii are the engine's; arguments as of `mean_gas_torque`.

    `pressure_factor` is the mean factor of the cylinders on the pressure above motored.
    """
    whole = mean_gas_torque(crank_ratio, row, family, offset)
    factor = np.asarray(pressure_factor)
    if (factor == 1.0).all():
        return whole * factor
    motored = mean_gas_torque(crank_ratio, row, family, offset, 0.0)
    return np.where(factor == 1.0, whole, motored + factor * (whole - motored))


def mean_gas_of_unequal_throws(
    crank_ratio: Any, offset: Any, row: Any, family: Family, cylinder_set: Any,
    by_count: CylindersByCount,
) -> Any:  # fmt: skip
    """Mean of p v over cylinders whose strokes, bores or diagrams differ [Pa].

    It is over the engine's crank radius and piston area. Arguments as of `mean_gas_torque` and
    `mean_of_cylinders`.
    """

    def of_one(member: Member) -> Any:
        return mean_gas_of_member(member, crank_ratio, offset, row, family)

    return mean_of_cylinders(cylinder_set, by_count, of_one)


def mean_gas_of_member(
    member: Member, crank_ratio: Any, offset: Any, row: Any, family: Family
) -> Any:
    """Mean of p v of one cylinder over the engine's crank radius and piston area [Pa].

    Arguments as of `mean_gas_torque`.
    """
    own, diagrams = member.own(crank_ratio, offset), own_diagrams(family, member.diagram)
    mean = mean_gas_torque(
        own.crank_ratio, row, diagrams, own.offset, member.pressure_factor, member.rod
    )
    return member.area_factor * member.radius_factor * mean
