"""Solving on an NVIDIA card; all but this file is imported where one is asked for.

card       the way to the card and back
kernel     what the card runs: the functions of the batch solver
device     functions compiled for a card, and what of numba.cuda solvers need
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from engine_dyn.speed.fields import DEVICES

if TYPE_CHECKING:
    from engine_dyn.card.card import Card

__all__ = ["card_of"]


def card_of(device: str) -> Card | None:
    """Card of a device, None for the processor; ValueError where there is none of the name."""
    if device not in DEVICES:
        raise ValueError(f"device {device!r}: not one of {', '.join(map(repr, DEVICES))}")
    if device == "cpu":
        return None
    from engine_dyn.card.card import Card

    return Card()
