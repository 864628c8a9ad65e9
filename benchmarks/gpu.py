"""How fast a card solves sampled designs: `make bench-gpu`, some minutes, on a machine with a card.

The study `sampled` (six parameters at random, of the thesis's engine) with four results. Rates are
those of the kernel alone, with both copies, and of `sweeps.run` as a whole; the errors are against
the processor.
"""

from __future__ import annotations

import sys
import time
import warnings
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any
from unittest import mock

import numpy as np

import sweeps
from benchmarks.command import processor, settings
from benchmarks.measure import seconds_of
from benchmarks.studies import RANGES, SCALARS, sampled
from engine_dyn.types import Floats
from sweeps.base.arguments import usable_device
from sweeps.base.errors import SceneError


def solve(designs: int, device: str) -> Any:
    """Archive of the study; what is unusual of its designs is meant so."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return sweeps.run(sampled(designs, RANGES), device=device)


def rate_of(designs: int, seconds: float, work: Callable[[], None]) -> float:
    """Designs a second of work on so many designs, repeated for so long."""
    work()
    began, runs = time.perf_counter(), 0
    while time.perf_counter() < began + seconds:
        work()
        runs += 1
    return runs * designs / (time.perf_counter() - began)


def rates(given: Any, seconds: float) -> tuple[float, float]:
    """Designs a second of the kernel alone, and with both copies on two streams."""
    from engine_dyn.card.card import SLOTS, Card

    card, designs = Card(), given[-1].size
    launch = card.launch
    with mock.patch.object(card, "launch", side_effect=launch) as launched:
        card.solve(*given)
    launches = [call.args for call in launched.call_args_list]

    def kernels() -> None:
        for arguments in launches:
            launch(*arguments)
        launches[-1][2].synchronize()

    alone = rate_of(designs, seconds, kernels)

    def several() -> None:
        with ThreadPoolExecutor(2 * SLOTS) as pool:
            list(pool.map(lambda _: card.solve(*given), range(2 * SLOTS)))

    return alone, rate_of(2 * SLOTS * designs, seconds, several)


def errors(designs: int) -> tuple[float, int]:
    """Largest relative difference to the processor of any result, and how many statuses differ."""
    one, other = solve(designs, "cuda"), solve(designs, "cpu")
    differences: list[Floats] = [
        np.abs(one[name].values / other[name].values - 1.0) for name in SCALARS
    ]
    return float(np.nanmax(differences)), int((one.status != other.status).sum())


def table(designs: int, seconds: float, compared: int) -> list[tuple[str, str]]:
    """Rows of the table: what, and how much."""
    from engine_dyn.card.card import Card
    from engine_dyn.card.device import device_name

    first, again = (seconds_of(solve, compared, "cuda") for _ in range(2))
    with mock.patch.object(Card, "solve", autospec=True, side_effect=Card.solve) as called:
        whole = seconds_of(solve, designs, "cuda")
    given = (call.args[1:] for call in called.call_args_list)  # the first one is the card
    largest = max(given, key=lambda one: one[-1].size)
    alone, copied = rates(largest, seconds)
    difference, other = errors(compared)
    return [
        ("card", device_name()),
        ("processor", processor()),
        ("designs of a launch", f"{largest[-1].size:,}"),
        ("kernel, designs/s", f"{alone:,.0f}"),
        ("with both copies, designs/s", f"{copied:,.0f}"),
        (f"sweeps.run of {designs:,}, designs/s", f"{designs / whole:,.0f}"),
        ("compiling, s", f"{max(first - again, 0.0):.1f}"),
        (f"largest difference to the processor, {compared:,} designs", f"{difference:.1e}"),
        ("designs with another status", str(other)),
    ]


def main(arguments: Sequence[str]) -> int:
    """Print the table, or one line where there is no card."""
    asked = settings("gpu", __doc__, arguments, designs=1 << 22, seconds=10.0, compared=1 << 16)
    try:
        usable_device("cuda")
    except SceneError as error:
        print(f"bench-gpu: {error}", file=sys.stderr)
        return 2
    rows = table(asked.designs, asked.seconds, asked.compared)
    width = max(len(what) for what, _ in rows)
    for what, value in rows:
        print(f"| {what:{width}} | {value} |")
    return 0
