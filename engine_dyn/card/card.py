"""The batch solver on a GPU: one thread a design.

What the card runs is `kernel`: one lane, whose rows are columns of a global array (row,
thread). Columns lie in global memory, once for each call. Here is the way to the card and back.

Pieces come from several threads of the processor. Each takes one of two slots, with a stream and
pinned buffers of its own, so that copies of one piece hide behind the kernel of the other. What a
design gets depends neither on the slot nor on the piece: it has the same bits in every run on a
card.
"""

from __future__ import annotations

import logging
import math
from functools import cache
from itertools import accumulate, chain
from queue import SimpleQueue
from typing import Any, NamedTuple

import numpy as np

from engine_dyn.card import device
from engine_dyn.card.kernel import INSTEAD, solve_on_card
from engine_dyn.loads.laws import LAWS, LINEAR_SQUARE, POWER
from engine_dyn.speed.batch.block import MOST_TERMS, row_numbers
from engine_dyn.speed.batch.work_table import Weights
from engine_dyn.speed.designs import Designs, Task
from engine_dyn.speed.fields import AUTO, CLOSURES, METHODS, POWER_MEAN, RESULTS, Results
from engine_dyn.speed.work.columns import Columns
from engine_dyn.speed.work.interpolation import weights_between
from engine_dyn.types import Booleans, Integers

PIECE = 1 << 16  # Largest number of designs in one launch of the kernel
BLOCK = 64  # Number of threads in a block of the card
SLOTS = 2  # Number of launches that are under way at a time, each with buffers of its own
LEAST_MEMORY = 256_000_000  # Bytes of the card's memory that must be free for it to be used
PART_OF_MEMORY = 0.8  # Fraction of the card's free memory that is used for buffers

OF_DESIGN = ("gas", "eta", "kappa", "unsure", "speed", "first", "second", "gear")
"""Numbers of `Designs` on the card, in the order of their rows; factors and shares follow."""

_said: set[str] = set()


def check_card() -> None:
    """Refuse a device that cannot be used: ValueError, one line, names what is missing."""
    missing = device.what_is_missing()
    if not missing and device.free_memory() < LEAST_MEMORY:
        free, least = (f"{size / 1e9:.2f} GB" for size in (device.free_memory(), LEAST_MEMORY))
        missing = f"{free} of the card's memory are free, {least} are needed"
    if missing:
        raise ValueError(f"device 'cuda': {missing}")


def reason_against(task: Task) -> str:
    """Why designs cannot be solved on a card: what they have that it does not know, or nothing."""
    if task.method != AUTO:
        return f"method {METHODS[task.method].name!r}"
    if task.variable:
        return "a variable inertia"
    if task.closure != POWER_MEAN:
        return f"closure {CLOSURES[task.closure]!r}"
    if task.form.kind not in (POWER, LINEAR_SQUARE):
        return f"the law of load or driver {LAWS[task.form.kind].name!r}"
    return "curves over the crank angle" if task.angles.node.size else ""


def tell(reason: str) -> None:
    """Say once, through the logger, that the processor solves such designs."""
    if reason not in _said:
        _said.add(reason)
        logging.getLogger("engine_dyn").warning(
            "device 'cuda': %s is solved on the processor", reason
        )


class Buffer(NamedTuple):
    """Memory of the card under a name, and where it is copied from or to."""

    shape: tuple[int, ...]
    dtype: Any = np.float64
    pinned: bool = False

    @property
    def size(self) -> int:
        """Number of entries."""
        return math.prod(self.shape)

    @property
    def nbytes(self) -> int:
        """Bytes."""
        return self.size * np.dtype(self.dtype).itemsize


class Slot:
    """A stream, and buffers that stay for the next launch: of the card, and pinned ones."""

    def __init__(self, memory: int) -> None:
        self.memory = memory
        self.stream = device.new_stream()
        self.held: dict[str, tuple[Buffer, Any, Any]] = {}
        self.columns: Columns | None = None

    def take(self, needed: dict[str, Buffer]) -> tuple[dict[str, Any], dict[str, Any]]:
        """Arrays of the card, and pinned ones; all are released before they become too many."""
        sizes = {name: one[0].nbytes for name, one in self.held.items()}
        total = sizes | {n: max(b.nbytes, sizes.get(n, 0)) for n, b in needed.items()}
        if sum(total.values()) > self.memory:
            self.held, self.columns = {}, None
        cards, pinned = {}, {}
        for name, one in needed.items():
            if name not in self.held or self.held[name][0].size < one.size:
                self.held.pop(name, None)
                card = device.new_device_array(one.size, dtype=one.dtype)
                host = device.new_pinned_array(one.size, dtype=one.dtype) if one.pinned else None
                self.held[name] = one, card, host
                if name in OF_COLUMNS:
                    self.columns = None
            _, card, host = self.held[name]
            cards[name] = card[: one.size].reshape(one.shape)
            if one.pinned:
                pinned[name] = host[: one.size].reshape(one.shape)
        return cards, pinned


OF_COLUMNS = ("fine", "coarse", "jagged", "between", "ends")
"""Buffers that the next launch uses again where its designs have the same work table."""


def buffers_of(
    columns: Columns, pieces: int, count: int, results: int, threads: int
) -> dict[str, Buffer]:
    """Buffers of a launch, see `solve_on_card`."""
    _, size, kinds, terms = columns.fine.shape
    intervals, ends = columns.coarse.shape[1], _ends_of(columns)
    return {
        "fine": Buffer((columns.fine.size // terms, terms)),
        "coarse": Buffer((columns.coarse.size // terms, terms)),
        "jagged": Buffer((1, columns.jagged.size)),
        "between": Buffer(weights_between(size // intervals).shape),
        "ends": Buffer(ends.shape, np.int64),
        "rows": Buffer((int(ends[-1]), threads)),
        "whole": Buffer((3, threads), np.int64),
        "mixed": Buffer((kinds, terms, threads)),
        "node": Buffer((1, 2 * kinds, threads)),
        "numbers": Buffer((len(OF_DESIGN) + terms + pieces, count), pinned=True),
        "places": Buffer((1 + pieces, count), np.int64, pinned=True),
        "wanted": Buffer((len(RESULTS),), np.int64, pinned=True),
        "scalars": Buffer((results, count), pinned=True),
        "status": Buffer((count,), np.int8, pinned=True),
        "left": Buffer((count,), np.bool_, pinned=True),
    }


def _ends_of(columns: Columns) -> Integers:
    """Row ends of the work table and interpolation weights that every thread needs."""
    _, _, kinds, terms = columns.fine.shape
    numbers = chain(*row_numbers(columns.coarse.shape[1], kinds, terms))
    weights = [1] * len(Weights._fields)
    return np.array([*accumulate([*numbers, MOST_TERMS, MOST_TERMS, *weights], initial=0)])


class Card:
    """A card while it solves the designs of one call or search; its memory goes with it."""

    def __init__(self) -> None:
        check_card()
        slots = 1 if device.simulated() else SLOTS
        self.launch, self.piece = _launcher(), PIECE
        # At most 16 blocks of a launch for each multiprocessor of the card.
        self.most_threads = BLOCK * 16 * device.multiprocessors()
        if device.simulated():
            self.most_threads = 2  # the simulator runs a thread of Python for each
        memory = int(PART_OF_MEMORY * device.free_memory()) // slots
        self.slots: SimpleQueue[Slot] = SimpleQueue()
        for _ in range(slots):
            self.slots.put(Slot(memory))
        self.memory = memory

    def can_solve(self, task: Task) -> bool:
        """Whether designs can be solved on a card; a line tells once why they cannot."""
        reason = reason_against(task)
        if reason:
            tell(reason)
        return not reason

    def solve(
        self, task: Task, columns: Columns, designs: Designs, results: Results, left: Booleans
    ) -> bool:
        """Solve designs that share columns, as `solve_in_blocks`; False where memory is short."""
        slot = self.slots.get()
        try:
            for begin in range(0, left.size, self.piece):
                here = slice(begin, min(begin + self.piece, left.size))
                if not self._solve(slot, here, task, columns, designs, results, left):
                    tell("what needs more memory than the card has")
                    return False
        finally:
            self.slots.put(slot)
        return True

    def _solve(
        self, slot: Slot, here: slice, task: Task, columns: Columns, designs: Designs,
        results: Results, left: Booleans,
    ) -> bool:  # fmt: skip
        """Solve some designs on the card in one launch of the kernel."""
        count, pieces, rows = here.stop - here.start, len(designs.part), len(results.scalars)
        one, two = (
            sum(buffer.nbytes for buffer in buffers_of(columns, pieces, count, rows, n).values())
            for n in (1, 2)
        )
        step = BLOCK if self.most_threads >= BLOCK else 1
        threads = min(self.most_threads, -(-count // step) * step)
        threads = min(threads, int(self.memory - one) // (two - one) // step * step)
        if threads < step:
            return False
        cards, pinned = slot.take(buffers_of(columns, pieces, count, rows, threads))
        if slot.columns is None or slot.columns.fine is not columns.fine:
            for name, array in zip(OF_COLUMNS, _shared(columns), strict=True):
                cards[name].copy_to_device(array.reshape(cards[name].shape), slot.stream)
            slot.stream.synchronize()
            slot.columns = columns
        fill(pinned, here, designs, results)
        for name in ("numbers", "places", "wanted"):
            cards[name].copy_to_device(pinned[name], slot.stream)
        form = task.form
        self.launch(
            threads // step, step, slot.stream, count, form.kind, form.sign, int(form.own),
            task.tolerance, task.iterated, columns.width, columns.fine.shape[1], *cards.values(),
        )  # fmt: skip
        for name in ("scalars", "status", "left"):
            cards[name].copy_to_host(pinned[name], slot.stream)
        slot.stream.synchronize()
        left[here] = pinned["left"]
        finished = np.flatnonzero(~pinned["left"])
        target = designs.target[here][finished]
        results.status[target] = pinned["status"][finished]
        if results.scalars.shape[1]:
            results.scalars[:, target] = pinned["scalars"][:, finished]
        return True


def _shared(columns: Columns) -> tuple[Any, ...]:
    """Contents of the buffers that launches with one work table have in common."""
    between = weights_between(columns.fine.shape[1] // columns.coarse.shape[1])
    return columns.fine, columns.coarse, columns.jagged, between, _ends_of(columns)


def fill(pinned: dict[str, Any], here: slice, designs: Designs, results: Results) -> None:
    """Numbers of some designs, for the card."""
    numbers, places = pinned["numbers"], pinned["places"]
    for row, name in enumerate(OF_DESIGN):
        numbers[row] = getattr(designs, name)[here]
    terms = designs.factor.shape[1]
    numbers[len(OF_DESIGN) : len(OF_DESIGN) + terms] = designs.factor[here].T
    numbers[len(OF_DESIGN) + terms :] = designs.share[:, here]
    places[0] = np.arange(places.shape[1])
    places[1:] = designs.part[:, here]
    pinned["wanted"][:] = results.wanted


@cache
def _launcher() -> device.Launcher:
    """Return the launcher of the batch solver's kernel, which is compiled once."""
    return device.Launcher(solve_on_card, INSTEAD)
