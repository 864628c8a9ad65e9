"""Make every system call of a run fail once, and kill the run there.

python -m benchmarks.faults [--points N] [--state FILE] [-o FILE]

What is done is kept in the state: an interrupted campaign goes on with the same command, and more
points can be asked for. The summary (docs/reliability/faults.json) is written at the end. Exit
status 1 where a point did not end as promised.
"""

from __future__ import annotations

import hashlib
import sys
import time
from collections import Counter
from collections.abc import Iterable
from typing import Any

from benchmarks.command import ROOT, part_file, settings, write_part
from benchmarks.faults.campaign import Campaign
from benchmarks.faults.server import BLOCK, Server, Unavailable


def identity() -> str:
    """Hash of the code that is tested and that tests."""
    digest = hashlib.sha256(str(BLOCK).encode())
    for folder in ("engine_dyn", "sweeps", "benchmarks/faults"):
        for path in sorted((ROOT / folder).rglob("*")):
            if path.suffix in (".py", ".c", ".toml", ".csv"):
                digest.update(path.read_bytes())
    return digest.hexdigest()


def summary(campaign: Campaign, count: int) -> dict[str, Any]:
    """Figures of a campaign."""
    tried = {p: campaign.verdicts[p] for p in campaign.points[:count] if p in campaign.verdicts}
    reached = {p: v for p, v in tried.items() if v.hit or p.fault.startswith("power")}

    def by(kinds: Iterable[str]) -> dict[str, int]:
        return dict(sorted(Counter(kinds).items()))

    return {
        "points": len(reached),
        "of": len(campaign.points),
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
    """Run the campaign, or go on with it."""
    options = settings(
        "benchmarks.faults", __doc__, points=2500, state=ROOT / "out" / "faults.jsonl",
        output=part_file("faults"),
    )  # fmt: skip
    try:
        with Server() as server:
            campaign = Campaign(server, options.state, identity())
            missing = campaign.missing(options.points)
            print(f"{len(campaign.points)} points; {len(missing)} to be tried", flush=True)
            began = time.monotonic()
            for number, point in enumerate(missing, 1):
                verdict = campaign.attempt(point)
                if verdict.wrong:
                    print(f"{point}: {verdict.hit}: {verdict.wrong}", flush=True)
                if number % 100 == 0:
                    print(f"{number} tried, {time.monotonic() - began:.0f} s", flush=True)
    except Unavailable as error:
        sys.exit(f"{error}")
    found = summary(campaign, options.points)
    write_part(options.output, found)
    print(options.output)
    sys.exit(1 if found["wrong"] else 0)


if __name__ == "__main__":
    main()
