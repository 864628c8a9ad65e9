"""How a laboratory's file is read, where that is not to be guessed."""

from __future__ import annotations

from typing import Literal, get_args

from pydantic import Field

from sweeps.base.checks import Strict

__all__ = ["Format", "ReadingChoices"]

Format = Literal[
    "text", "fixed_width", "xlsx", "mat", "tdms", "mf4", "netcdf", "parquet", "wav", "uff"
]
"""Formats of laboratory files; `sweeps.base.columns.recording` has a reader for each."""


class ReadingChoices(Strict):
    """How a laboratory's file is read, where that is not to be guessed.

    The description of a field completes the sentence "must be ...".
    """

    format: Format | None = Field(
        default=None,
        description=f"one of {', '.join(get_args(Format))}: the format of the file, where the "
        "ending of its name does not tell it",
    )
    separator: str | None = Field(
        default=None, min_length=1, max_length=5,
        description="a string of one character, such as ';', or 'tab' or 'blank'",
    )  # fmt: skip
    decimal: Literal[".", ","] | None = Field(default=None, description="'.' or ','")
    encoding: str | None = Field(
        default=None, max_length=40,
        description="a string: the encoding of a text file, such as 'cp1252' or 'gb18030'",
    )  # fmt: skip
    sheet: str | None = Field(default=None, description="a string: the name of a sheet of an .xlsx")
    group: str | None = Field(
        default=None, description="a string: the name of a group of channels of a .tdms or .mf4"
    )
