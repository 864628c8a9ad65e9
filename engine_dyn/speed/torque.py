"""Extremes of the torque at nominal speed for arrays of designs, and the swing of its work."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from engine_dyn.compilation import inlined, kernel
from engine_dyn.geometry.cylinders import Cylinders
from engine_dyn.loads.driven_machine import NOTHING_DRIVEN, DrivenMachine, whole_ratio
from engine_dyn.plain_arrays import plain
from engine_dyn.pressure.family import Family
from engine_dyn.speed.broadcasting import discard, take_unknown
from engine_dyn.speed.designs import Designs, Inputs
from engine_dyn.speed.fields import DEFAULTS, OF_SPEED_ALONE
from engine_dyn.speed.general.motion import Motion, add_row, fill_motion, make_motion, part_of
from engine_dyn.speed.grouping import Grouping, Piece
from engine_dyn.speed.pieces import Progress, map_on_threads
from engine_dyn.speed.results import TORQUE_NAMES
from engine_dyn.speed.work.columns import SLOPE, Columns
from engine_dyn.speed.work.maxima import largest, max_between, max_near
from engine_dyn.types import Floats

__all__ = ["torque_extremes"]

ROUGHER = 20.0
"""How much rougher a torque is than its work, from which nodes are told to be close enough: with
it, noise of 0.02 bar at 0.2 degree leaves 6e-6 of the torque's size, without it 8e-4."""


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
    grouping = Grouping(
        whole, family, cylinders_by_count, driven, tolerance / ROUGHER, ("cylinders",)
    )

    def solve(piece: Piece) -> int:
        for call in piece.calls():
            columns, designs = plain(call.columns), plain(call.designs())
            motion = make_motion(columns.fine.shape[1])
            chosen, count = call.piece.chosen, call.piece.size
            if swing.size:
                _swings(count, columns, designs, swing, motion)
            if high.size or low.size:
                constant = chosen.take("friction_torque")
                if driven.engine_torque is not None:
                    constant = constant - chosen.take("torque_factor") * driven.engine_torque.mean
                    constant = constant + getattr(driven.auxiliaries, "mean", 0.0)
                friction = np.full(count, constant, dtype=float)
                of_load = call.needs.parts.is_load(designs.part)
                alone = designs._replace(share=plain(np.where(of_load, 0.0, designs.share)))
                _extremes(count, columns, alone, friction, high, low, motion.dw)
        return piece.size

    for done in map_on_threads(solve, grouping.pieces(None, 1), threads):
        if progress:
            progress(done)
    found = zip(TORQUE_NAMES, results, strict=True)
    return discard({n: array.reshape(whole.shape) for n, array in found if n in wanted}, unknown)


@inlined
def _top(sign: float, width: float, value: Floats, slope: Floats, missed: Floats) -> float:
    """Largest sign * value of a curve, docs/solver.md (98) and (99).

    `missed` is what the cubics through values and slopes miss in the middle of intervals.
    """
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
        # Designs are reduced with the kinetic energy of 1 kg m2 at nominal speed.
        found[designs.target[which]] = 0.5 * designs.speed[which] ** 2 * swing


@inlined
def _highest(sign: float, v: Floats) -> float:
    """Largest sign * v of a periodic curve, by polynomials through seven nodes."""
    n = len(v)
    best = highest = largest(sign, v)
    for j in range(n):
        d = sign * v[j]
        c, e = sign * v[(j - 1) % n], sign * v[(j + 1) % n]
        if d < c or d < e or d + 0.25 * (2.0 * d - c - e) < highest:
            continue
        a, b = sign * v[(j - 3) % n], sign * v[(j - 2) % n]
        f, g = sign * v[(j + 2) % n], sign * v[(j + 3) % n]
        t = max_near(b, c, d, e, f)
        # Stirling's formula.
        s = t * t
        value = d + 0.5 * t * (e - c) + 0.5 * s * (e - 2.0 * d + c)
        value += t * (s - 1.0) / 6.0 * (0.5 * (f - b) - (e - c))
        value += s * (s - 1.0) / 24.0 * (f - 4.0 * e + 6.0 * d - 4.0 * c + b)
        rest = t * (s - 1.0) * (s - 4.0)
        value += rest / 120.0 * (0.5 * (g - a) - 2.0 * (f - b) + 2.5 * (e - c))
        value += rest * t / 720.0 * (g - 6.0 * f + 15.0 * e - 20.0 * d + 15.0 * c - 6.0 * b + a)
        best = max(best, value)
    return best


@kernel
def _extremes(
    count: int, columns: Columns, designs: Designs, friction: Floats, high: Floats, low: Floats,
    torque: Floats,
) -> None:  # fmt: skip
    """Largest and smallest torque of the first designs [N m], each where its array is not empty.

    `torque` is scratch.
    """
    for which in range(count):
        factor, mean = designs.factor[which], 0.0
        for j in range(len(torque)):
            torque[j] = 0.0
        for piece in range(designs.part.shape[0] + 1):
            part, share = part_of(piece, which, designs)
            if share != 0.0:
                add_row(torque, share, columns.fine[part], SLOPE, factor)
                for t in range(len(factor)):
                    mean += share * factor[t] * columns.mean[part, t]
        energy, target = 0.5 * designs.speed[which] ** 2, designs.target[which]
        for sign, found in ((1.0, high), (-1.0, low)):
            if found.size > 0:
                value = sign * _highest(sign, torque) + mean
                found[target] = energy * value - friction[which]
