"""Extremes of the torque at nominal speed for arrays of designs, and the swing of its work."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from engine_dyn.compilation import inlined, kernel
from engine_dyn.geometry.cylinders import Cylinders
from engine_dyn.loads.driven_machine import NOTHING_DRIVEN, DrivenMachine, whole_ratio
from engine_dyn.pressure.family import Family
from engine_dyn.speed.broadcasting import shape_of, without_unknown
from engine_dyn.speed.designs import Designs, Inputs
from engine_dyn.speed.fields import DEFAULTS, OF_SPEED_ALONE
from engine_dyn.speed.general.curve import Curve, fill_curve, make_curve
from engine_dyn.speed.grouping import Grouping, Work
from engine_dyn.speed.pieces import Progress, run_on_threads
from engine_dyn.speed.results import TORQUE_NAMES
from engine_dyn.speed.work.columns import Columns
from engine_dyn.speed.work.summit import peak_between, summit_at
from engine_dyn.types import Floats, Integers

__all__ = ["torque_extremes"]


@without_unknown
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
    if driven.over_angle is not None:
        inputs["gear_ratio"] = whole_ratio(driven.over_angle, inputs["gear_ratio"], family.period)
    inputs["cylinders"] = np.asarray(cylinders, dtype=np.int64)
    shape = shape_of(*inputs.values())
    names = [name for name in TORQUE_NAMES if name in wanted]
    scalars = np.empty((max(len(names), 1), int(np.prod(shape, dtype=np.int64))))
    places = np.array([names.index(n) if n in names else -1 for n in TORQUE_NAMES])
    whole = Inputs.of(inputs, shape)
    grouping = Grouping(whole, family, cylinders_by_count, driven, tolerance, ("cylinders",))

    def solve(work: Work) -> None:
        friction = np.ascontiguousarray(work.chosen.full("friction_torque"), dtype=float)
        designs = work.designs()
        of_load = designs.part >= work.needs.parts.first_load
        alone = designs._replace(share=np.where(of_load, 0.0, designs.share))
        curve = make_curve(work.columns.fine.shape[1])
        if places[2] >= 0:
            _swings(work.size, work.columns, designs, scalars[places[2]], curve)
        if places[0] >= 0 or places[1] >= 0:
            _extremes(work.size, work.columns, alone, friction, places, scalars, curve)

    cores = threads or os.cpu_count() or 1
    run_on_threads(grouping.works(None, 1), solve, lambda work: work.size, cores, progress)
    return {name: scalars[i].reshape(shape) for i, name in enumerate(names)}


@inlined
def _range_of(width: float, value: Floats, slope: Floats, missed: Floats) -> tuple[float, float]:
    """Largest and smallest value of a curve, docs/method.md (98) and (99).

    `missed` is what the cubics through values and slopes miss in the middle of intervals.
    """
    high, low = value[0], value[0]
    for j in range(value.size):
        high, low = max(high, value[j]), min(low, value[j])
    top, bottom = high, -low
    for j in range(value.size):
        n = j + 1 if j + 1 < value.size else 0
        for side in range(2):
            sign = 1.0 if side == 0 else -1.0
            best = top if side == 0 else bottom
            up, down = sign * width * slope[j], sign * width * slope[n]
            if up >= 0.0 and down < 0.0 and sign * value[j] + up >= best:
                found, _ = peak_between(
                    sign * value[j], sign * value[n], up, down, sign * missed[j]
                )
                if side == 0:
                    top = max(top, found)
                else:
                    bottom = max(bottom, found)
    return top, -bottom


@inlined
def _energy(which: int, designs: Designs) -> float:
    """Kinetic energy [J] at nominal speed of 1 kg m2, which designs are reduced with."""
    return 0.5 * designs.speed[which] ** 2


@kernel
def _swings(count: int, columns: Columns, designs: Designs, found: Floats, curve: Curve) -> None:
    """Ranges of the work of the first designs [J]; `curve` is scratch."""
    for which in range(count):
        fill_curve(which, False, columns, designs, curve)
        high, low = _range_of(columns.width, curve.w, curve.dw, curve.w_missed)
        found[designs.target[which]] = _energy(which, designs) * (high - low)


@inlined
def _highest(sign: float, v: Floats) -> float:
    """Largest sign * v of a periodic curve, by polynomials through seven nodes."""
    n, best = v.size, -math.inf
    for j in range(n):
        best = max(best, sign * v[j])
    highest = best
    for j in range(n):
        d = sign * v[j]
        c, e = sign * v[(j - 1) % n], sign * v[(j + 1) % n]
        if d < c or d < e or d + 0.25 * (2.0 * d - c - e) < highest:
            continue
        a, b = sign * v[(j - 3) % n], sign * v[(j - 2) % n]
        f, g = sign * v[(j + 2) % n], sign * v[(j + 3) % n]
        t = summit_at(b, c, d, e, f)
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
    count: int, columns: Columns, designs: Designs, friction: Floats, wanted: Integers,
    scalars: Floats, curve: Curve,
) -> None:  # fmt: skip
    """Largest and smallest torque of the first designs [N m]; `curve` is scratch."""
    for which in range(count):
        fill_curve(which, False, columns, designs, curve)
        mean = 0.0
        for piece in range(designs.part.shape[0]):
            share = designs.gas[which] * designs.share[piece, which]
            for t in range(designs.factor.shape[1]):
                mean += (
                    share * designs.factor[which, t] * columns.mean[designs.part[piece, which], t]
                )
        energy, target = _energy(which, designs), designs.target[which]
        for row in range(2):
            if wanted[row] >= 0:
                sign = 1.0 if row == 0 else -1.0
                value = sign * _highest(sign, curve.dw) + mean
                scalars[wanted[row], target] = energy * value - friction[which]
