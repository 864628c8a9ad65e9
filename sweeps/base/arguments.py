"""Checks of arguments of functions: paths, datasets, names, threads and devices.

Nothing of scenes is loaded for them. Every failure is a `SceneError` of one line.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from sweeps.base.errors import SceneError, shown, shown_for_whole


def a_path(value: object, key: str) -> Path:
    """Return the path in a text or Path; messages on anything else begin with `key`."""
    if isinstance(value, str | Path) and str(value):
        return Path(value)
    said = "is missing" if value is None else f"= {shown(value)}"
    raise SceneError(f"{key} {said}: must be the path of a file, as a string or a Path")


def check_dataset(value: object, key: str = "archive") -> None:
    """Refuse an argument that is no dataset, such as the path of an archive."""
    if not hasattr(value, "data_vars"):
        opened = isinstance(value, str | Path) and f", such as sweeps.open({str(value)!r})"
        raise SceneError(
            f"{key} = {shown(value)}: must be a dataset, as sweeps.run and sweeps.open return it"
            f"{opened or ''}"
        )


def names_given(value: Any, key: str) -> list[str]:
    """Return the texts of an argument that is one text or several; messages begin with `key`."""
    texts = [value] if isinstance(value, str) else value
    if not isinstance(texts, Iterable) or not all(isinstance(text, str) for text in texts):
        raise SceneError(f"{key} = {shown(value)}: must be a string or a list of strings")
    return list(texts)


def thread_count(threads: Any) -> int | None:
    """Return a checked number of threads; None for as many as there are processors."""
    whole = isinstance(threads, int | np.integer) and not isinstance(threads, bool)
    if threads is not None and not (whole and threads >= 1):
        raise SceneError(f"threads = {shown_for_whole(threads)}: must be a whole number, 1 or more")
    return None if threads is None else int(threads)


def usable_device(device: Any) -> str:
    """Return a checked device, "cpu" or "cuda"; messages say why a card cannot be used."""
    from engine_dyn.speed.fields import DEVICES

    if device not in DEVICES:
        allowed = " or ".join(f'"{name}"' for name in DEVICES)
        raise SceneError(f"device = {shown(device)}: must be {allowed}")
    if device == "cuda":
        from engine_dyn.card.card import check_card

        try:
            check_card()
        except ValueError as error:
            raise SceneError(str(error)) from None
    return str(device)
