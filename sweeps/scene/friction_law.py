"""Which law of the friction mean effective pressure a scene has."""

from __future__ import annotations

from engine_dyn.quantities.friction_components import FRICTION_LAWS
from engine_dyn.quantities.parameters import STROKE_SHARES
from sweeps.scene.values import GivenValues

__all__ = ["BY_COMPONENT", "friction_law", "over_stroke"]

FIRST, BY_COMPONENT = FRICTION_LAWS
"""The law that holds unless another one is named; the law that adds up components."""


def friction_law(values: GivenValues) -> str:
    """Name of the law: that of the scene, or else of its engine."""
    number = values.given_or_own("friction_law", 1.0).values[0]
    return FRICTION_LAWS[int(number) - 1]


def over_stroke(values: GivenValues) -> bool:
    """Whether the friction varies over the stroke.

    By components it does where the pressure of the rings is given: the law says how much of it is
    of rings and skirt. Otherwise it does where shares of it are given.
    """
    if friction_law(values) == BY_COMPONENT:
        return values.nonzero("ring_pressure")
    return any(values.nonzero(share) for share in STROKE_SHARES)
