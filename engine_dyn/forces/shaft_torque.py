"""The torque along the shaft in few numbers: its largest range, and what excites the first mode.

See `torque.torque_after_throw` for the curves, whose convention holds here: the take-off is at the
first throw. Designs are taken some at a time, those of one engine together, so that memory does not
grow with their number.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from engine_dyn.forces import torque
from engine_dyn.forces.harmonics import first_mode_weights
from engine_dyn.forces.superposition import (
    CrankTrain,
    CurveOfDesigns,
    along_shaft,
    crests,
    largest,
    reach,
    sample_angles,
)
from engine_dyn.geometry.cylinders import CylindersByCount
from engine_dyn.loads.friction import StrokeFriction
from engine_dyn.pressure.family import Family
from engine_dyn.types import Floats, Integers

EXTREMES = np.dtype([("range", np.float64), ("rms", np.float64)])
"""Fields of a shaft's torques: largest range of the torque after a throw, and the root mean
square, without the mean, of the torque that excites the first mode [N m]."""


def shaft_torque_extremes(
    numbers: Mapping[str, Any], family: Family, by_count: CylindersByCount, period: float
) -> npt.NDArray[Any]:
    """Largest range of the torque along the shaft, and the torque on its first mode.

    Parameters
    ----------
    numbers : mapping of array_like
        Numbers that broadcast over the designs: "crank_ratio", "double_radius" [m], "offset_ratio",
        "bore" [m], "row", "pressure_scale", "crankcase_pressure" [Pa], "reciprocating_mass" [kg],
        "speed" [rad/s], "friction_torque" [N m], "cylinder_set" and the fields of `StrokeFriction`
        as "friction_0" to "friction_4" [Pa].
    family : Family
        Diagrams.
    by_count : mapping
        Cylinders of each set.
    period : float
        Angle of the cycle [rad].

    Returns
    -------
    ndarray of dtype EXTREMES
        Shape of all numbers broadcast.

    Notes
    -----
    The torque T_j after throw j is the sum of those of throw j and all behind it. Its range is
    found between samples half a degree apart (`superposition`). The first mode takes up
    sum_j beta_j (T_j - T_(j+1)), with the amplitudes beta_j of `harmonics.first_mode_weights`.
    """
    columns = dict(zip(numbers, np.broadcast_arrays(*numbers.values()), strict=True))
    shape = columns["cylinder_set"].shape
    flat = {name: column.reshape(-1) for name, column in columns.items()}
    result = np.full(flat["cylinder_set"].size, np.nan, dtype=EXTREMES)
    phi = sample_angles(period, family)
    for number in np.unique(flat["cylinder_set"]).astype(int).tolist():
        mine = np.flatnonzero(flat["cylinder_set"] == number)
        engine = by_count[number]
        weights = first_mode_weights(engine)
        steps = np.diff(weights, prepend=0.0)[:, None]
        # Curves of at most 16 MB are held at once.
        at_once = max(1, 2_000_000 // (phi.size * len(along_shaft(engine))))
        for begin in range(0, mine.size, at_once):
            some = mine[begin : begin + at_once]
            one = {name: column[some][:, None] for name, column in flat.items()}
            friction: dict[tuple[Any, ...], Floats] = {}
            curves = _curves(one, phi, number, family, {number: engine}, period, friction)

            def of_throws(
                which: Integers, angle: Floats, one: Mapping[str, Any] = one, number: int = number,
                friction: dict[tuple[Any, ...], Floats] = friction, throws: int = weights.size,
            ) -> Floats:  # fmt: skip
                design, throw = np.divmod(which, throws)
                chosen = {name: column[design] for name, column in one.items()}
                known = {key: mean[:, design] for key, mean in friction.items()}
                curves = _curves(chosen, angle[:, None], number, family, by_count, period, known)
                return np.asarray(curves[np.arange(which.size), throw, 0])

            result["range"][some] = _largest_ranges(curves, phi, of_throws)
            result["rms"][some] = (steps * curves).sum(axis=-2).std(axis=-1)
    return result.reshape(shape)


def _curves(
    one: Mapping[str, Any], phi: Floats, number: int, family: Family, by_count: CylindersByCount,
    period: float, weights: dict[tuple[Any, ...], Floats],
) -> Floats:  # fmt: skip
    """Torque after each throw for designs of one engine, shape (design, throw, angle)."""
    friction = StrokeFriction._make(one[f"friction_{i}"] for i in range(5))
    uniform = not any(np.any(level) for level in friction.levels)
    gas = torque.GasPressure(family, one["row"], one["pressure_scale"], one["crankcase_pressure"])
    train = CrankTrain(
        one["crank_ratio"], one["double_radius"], number, period, one["offset_ratio"], by_count
    )
    return torque.torque_after_throw(
        phi, train, one["bore"], gas, one["reciprocating_mass"], one["speed"],
        one["friction_torque"], None if uniform else friction, weights,
    )  # fmt: skip


def _largest_ranges(curves: Floats, phi: Floats, curve: CurveOfDesigns) -> Floats:
    """Largest range of the curves of each design, between samples too; shape (design,)."""
    ranges, rows = np.ptp(curves, axis=-1), curves.reshape(-1, phi.size)
    reached = np.zeros(ranges.shape)
    for sign in (1.0, -1.0):
        which, _, around = crests(rows, sign)
        most = np.full(len(rows), np.nan)
        np.fmax.at(most, which, reach(around))
        reached += most.reshape(ranges.shape)
    may_be = reached >= ranges.max(axis=-1, keepdims=True)  # curves that may have the largest range
    throws = np.flatnonzero(may_be)
    ranges[may_be] = sum(
        largest(rows[throws], phi, lambda which, angle: curve(throws[which], angle), sign)[0]
        for sign in (1.0, -1.0)
    )
    return np.asarray(ranges.max(axis=-1))
