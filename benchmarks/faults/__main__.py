"""Make every system call of a run fail once, and kill the run there.

python -m benchmarks.faults [--first N] [--points N] [-o FILE]

Points are numbered; an interrupted campaign goes on with `--first`. The summary
(docs/reliability/faults.json) is written at the end. Exit status 1 where a point did not end as
promised.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any

from benchmarks.command import log, part_file, settings, write_part
from benchmarks.faults.campaign import Campaign, Point, Verdict
from benchmarks.faults.server import Server, Unavailable


def summary(tried: Mapping[Point, Verdict], every: int) -> dict[str, Any]:
    """Figures of the points that were tried, of so many."""
    reached = {p: v for p, v in tried.items() if v.hit or p.fault.startswith("power")}

    def by(kinds: Iterable[str]) -> dict[str, int]:
        return dict(sorted(Counter(kinds).items()))

    return {
        "points": len(reached),
        "of": every,
        "not_reached": len(tried) - len(reached),
        "ended": by(v.ended for v in reached.values()),
        "faults": by(p.fault for p in reached),
        "calls": by(v.hit.split(" ")[0] or "end" for v in reached.values()),
        "scenarios": by(p.scenario for p in reached),
        "wrong": [
            f"{p.scenario}, call {p.call}, {p.fault} ({v.hit}): {v.wrong}"
            for p, v in tried.items() if v.wrong
        ],
    }  # fmt: skip


def main() -> None:
    """Run the campaign."""
    options = settings(
        "benchmarks.faults", __doc__, first=0, points=2500, output=part_file("faults")
    )
    tried: dict[Point, Verdict] = {}
    try:
        with Server() as server:
            campaign = Campaign(server)
            chosen = campaign.points[options.first : options.first + options.points]
            for number, point in enumerate(chosen, options.first):
                verdict = tried[point] = campaign.attempt(point)
                if verdict.wrong:
                    print(f"{number}, {point}: {verdict.hit}: {verdict.wrong}", flush=True)
                if number % 100 == 0:
                    log(f"point {number} of {len(campaign.points)}")
    except Unavailable as error:
        sys.exit(f"{error}")
    found = summary(tried, len(campaign.points))
    write_part(options.output, found)
    print(options.output)
    sys.exit(1 if found["wrong"] else 0)


if __name__ == "__main__":
    main()
