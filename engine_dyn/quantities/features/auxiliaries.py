"""Torque of auxiliaries over the angle: valve train, injection pump and others, as one torque.

An auxiliary turns at i times the crank's speed, theta = i phi + theta_0, and takes the torque T at
its own shaft, which is i T(i phi + theta_0) at the crank (equal powers). All together are one
periodic cubic over the crank angle, with the knots of all: the sum is exact.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from engine_dyn.loads.torque_curves import WHOLE, TorqueOverAngle
from engine_dyn.quantities.features.feature import Feature
from engine_dyn.types import Floats

APART = 1e-9  # Knots nearer to each other than this angle [rad] count as one

MOST_KNOTS = 200_000


class Auxiliary(NamedTuple):
    """Torque at its own shaft, positive against the rotation; speed over the crank's; phase [rad].

    The phase is its own angle at firing top dead centre of cylinder 1.
    """

    torque: TorqueOverAngle
    ratio: float = 1.0
    phase: float = 0.0


class Auxiliaries(NamedTuple):
    """Torque of all auxiliaries over the crank angle, and remarks on how it was evened out."""

    torque: TorqueOverAngle
    warnings: tuple[str, ...] = ()


def over_crank(auxiliaries: Sequence[Auxiliary], cycle: float) -> TorqueOverAngle:
    """Torque of all auxiliaries over the crank angle, for a cycle [rad].

    Raises
    ------
    ValueError
        For one that does not repeat with the cycle.

    Examples
    --------
    >>> from engine_dyn.loads.torque_curves import torque_of_harmonics
    >>> cam = torque_of_harmonics(2.0, {4: (10.0, 0.0)})
    >>> all_of_them = over_crank([Auxiliary(cam, 0.5)], 4.0 * math.pi)
    >>> all_of_them.mean.round(9), all_of_them(math.pi / 4.0).round(9)
    (1.0, array(6.))
    """
    knots: list[Floats] = []
    for number, (torque, ratio, phase) in enumerate(auxiliaries, start=1):
        turns = ratio * cycle / torque.period
        repeats = turns * torque.repeats
        if abs(repeats - round(repeats)) > WHOLE * max(repeats, 1.0) or round(repeats) < 1:
            raise ValueError(
                f"number {number} ratio = {ratio:g}: must be a multiple of "
                f"{torque.period / cycle / torque.repeats:g}, so that it repeats with the cycle of "
                f"{math.degrees(cycle):g} degrees"
            )
        whole = np.arange(math.ceil(turns) + 2)[:, None] * torque.period
        first = torque.angle[0] + math.floor((phase - torque.angle[0]) / torque.period) * (
            torque.period
        )
        own = (first + (torque.angle - torque.angle[0]) + whole).reshape(-1)
        here = (own - phase) / ratio
        knots.append(here[(here > -APART) & (here < cycle - APART)])
    angle = np.sort(np.concatenate(knots))
    angle = angle[np.diff(angle, prepend=-1.0) > APART]
    if angle.size > MOST_KNOTS:
        raise ValueError(f"{angle.size} knots in a cycle: must be at most {MOST_KNOTS}")
    total, slope = np.zeros(angle.size), np.zeros(angle.size)
    for torque, ratio, phase in auxiliaries:
        total += ratio * torque(ratio * angle + phase)
        slope += ratio**2 * torque.slope_at(ratio * angle + phase)
    return TorqueOverAngle(angle, total, slope, cycle)


FEATURE: Feature[Auxiliaries] = Feature(
    "auxiliaries", "torque of auxiliaries over their angle",
    words=(
        {
            "bare": "no auxiliaries take torque",
            "auxiliaries": "auxiliaries take torque, which is part of the friction",
        },
        {
            "steady_auxiliaries": "their torque is the same over the whole cycle",
            "angle_auxiliaries": "it is given over the angle of each",
        },
    ),
)  # fmt: skip
of = FEATURE.of
