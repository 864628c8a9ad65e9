"""Options of a run into an archive, its summary, and how it stops."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from engine_dyn.status import MEANINGS
from engine_dyn.types import Integers
from sweeps.base.dimensions import OUTCOMES, STATUS
from sweeps.base.errors import counted


class Stopped(Exception):
    """A run that did not come to its end; the message says how to go on."""


@dataclass(frozen=True)
class Options:
    """How a run writes its archive."""

    resume: bool = False  # Whether to complete an interrupted run, or start one
    overwrite: bool = False  # Whether to replace an archive, and begin an interrupted run again
    # Bytes that arrays and buffers may take beyond the loaded libraries.
    memory: float | None = None
    threads: int | None = None  # Number of threads; by default that of processors
    device: str = "cpu"  # Device that solves the designs, "cpu" or "cuda"
    progress: bool = False  # Whether to show a progress bar
    # Compression level, 0 to 9; by default that of the archives that a new one is made from, or
    # none.
    level: int | None = None
    single: bool = False  # Whether to store results in 32 bits
    command: str = ""  # Command line that the archive keeps
    # Whether the archive keeps the folders of the files that it was made from.
    full_paths: bool = False
    # Command that goes on with an interrupted run, for messages.
    resume_command: str = "the same command with --resume"


@dataclass(repr=False)
class Finished:
    """Summary of a finished run.

    Attributes
    ----------
    codes : dict of str to ndarray of int
        Number of values of each outcome, by its code, for each name of `dimensions.OUTCOMES`.
    blocks : int
        Number of blocks that the run was divided into.
    before : int
        How many of them an interrupted run had finished before, without the damaged ones.
    damaged : int
        Number of blocks that turned out to be damaged and were computed again.
    computing, writing : float
        Seconds; computing includes compiling.
    compiling : float
        Seconds in which this process compiled kernels.
    already : bool
        The archive was complete before; nothing was done.
    warnings : tuple of str
        Plausibility warnings, a line each, as the archive has them.
    found : tuple of str
        What the searches of [reduce] found, a line each.
    """

    codes: dict[str, Integers] = field(
        default_factory=lambda: {name: np.zeros(len(MEANINGS), dtype=np.int64) for name in OUTCOMES}
    )
    blocks: int = 1
    before: int = 0
    computing: float = 0.0
    writing: float = 0.0
    compiling: float = 0.0
    already: bool = False
    warnings: tuple[str, ...] = ()
    damaged: int = 0
    found: tuple[str, ...] = ()

    def __repr__(self) -> str:
        first = next(filter(None, map(self.outcomes_of, OUTCOMES)), {})  # The speed's, or a shaft's
        outcomes = ", ".join(f"{n} {name}" for name, n in first.items())
        parts = [
            outcomes or "no design can fail",
            counted(self.blocks, "block"),
            "complete before" if self.already else f"computed in {self.computing:.2g} s",
            *([counted(len(self.warnings), "warning")] if self.warnings else []),
        ]
        return f"<Finished: {'; '.join(parts)}>"

    @property
    def outcomes(self) -> dict[str, int]:
        """Number of designs of each outcome that occurred, in the order of the codes."""
        return self.outcomes_of(STATUS)

    def outcomes_of(self, name: str) -> dict[str, int]:
        """Number of values of each outcome that occurred in one of `dimensions.OUTCOMES`."""
        return {word: int(n) for word, n in zip(MEANINGS, self.codes[name], strict=True) if n}

    def count(self, name: str, status: npt.NDArray[Any]) -> None:
        """Add the outcomes of some designs; what has none is left out."""
        codes = status.reshape(-1)
        most_counted = 1_000_000  # Outcomes that are counted at a time
        for begin in range(0, codes.size, most_counted):
            # Counting makes an index of eight bytes out of each code: it is done for some at a
            # time.
            some = codes[begin : begin + most_counted]
            known = some[np.isfinite(some)].astype(np.uint8)
            self.codes[name] += np.bincount(known, minlength=len(MEANINGS))
