"""Of the quantities that are asked for, those that one engine of several has."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

from sweeps.base.errors import SceneError

__all__ = ["those_possible"]

Made = TypeVar("Made")


def those_possible(
    quantities: Sequence[str], make: Callable[[Sequence[str]], Made]
) -> tuple[Made, dict[str, SceneError]]:
    """Make something of all quantities, or of those of which it can be made.

    Parameters
    ----------
    quantities : sequence of str
        What is asked for.
    make : callable
        Makes it of some quantities; raises `SceneError` where that is not possible.

    Returns
    -------
    made, refused
        What was made, and the error of each quantity that was left out.

    Raises
    ------
    SceneError
        That of all quantities together, where it is possible of none of them.
    """
    try:
        return make(quantities), {}
    except SceneError as error:
        if len(quantities) < 2:
            raise
        of_all = error
    refused: dict[str, SceneError] = {}
    for quantity in quantities:
        try:
            make([quantity])
        except SceneError as error:
            refused[quantity] = error
    if not refused or len(refused) == len(quantities):
        raise of_all
    return make([quantity for quantity in quantities if quantity not in refused]), refused
