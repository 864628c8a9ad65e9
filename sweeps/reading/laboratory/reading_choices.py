"""How a laboratory's file is read, where that is not to be guessed."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from sweeps.checks import Strict

__all__ = ["ReadingChoices"]


class ReadingChoices(Strict):
    """How a laboratory's file is read, where that is not to be guessed.

    The description of a field completes the sentence "must be ...".
    """

    separator: str | None = Field(
        default=None, min_length=1, max_length=5,
        description="a string of one character, such as ';', or 'tab' or 'blank'",
    )  # fmt: skip
    decimal: Literal[".", ","] | None = Field(default=None, description="'.' or ','")
    sheet: str | None = Field(default=None, description="a string: the name of a sheet of an .xlsx")
    group: str | None = Field(
        default=None, description="a string: the name of a group of channels of a .tdms or .mf4"
    )
