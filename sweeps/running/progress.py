"""The progress bar of a terminal or a notebook."""

from __future__ import annotations

import warnings
from typing import Any

__all__ = ["progress_bar"]


def progress_bar(**options: Any) -> Any:
    """Return a bar of tqdm: a widget in a notebook that has ipywidgets, otherwise text."""
    with warnings.catch_warnings():
        # tqdm warns where ipywidgets is missing; text does as well.
        warnings.filterwarnings("ignore", message="IProgress not found")
        from tqdm.auto import tqdm

        return tqdm(**options)
