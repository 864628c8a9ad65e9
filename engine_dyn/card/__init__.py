"""Solving on an NVIDIA card; all other files here are imported only where a card is asked for."""

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
