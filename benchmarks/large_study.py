"""A study of the catalogue's V6 over eight parameters, however many designs it takes.

python -m benchmarks large-study [--points 131072] [--resume] [-o ARCHIVE]

Saltelli's design of so many base points is drawn, computed at two speeds and reduced as it goes
(`[reduce]`): the least inertia under conditions, the front of inertia and irregularity, Sobol'
indices and quantiles of the irregularity. A run that was interrupted is completed with --resume.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

import sweeps
from benchmarks.command import ROOT, log, settings
from benchmarks.tables import number, rows
from sweeps.errors import size_text

RANGES = {
    "inertia": (0.15, 0.35), "piston_mass": (0.45, 0.75), "rod_mass": (0.45, 0.75),
    "rod_length": (0.135, 0.175), "rod_centre_of_gravity": (0.03, 0.055),
    "bore": (0.093, 0.099), "stroke": (0.078, 0.084), "pin_offset": (0.0, 0.0015),
}  # fmt: skip
"""Around the engine's own 0.2, 0.6, 0.647, 0.15, 0.042, 0.096, 0.081 and 0; kg m2, kg, m."""

SPEEDS = (1000.0, 6000.0)
"""At the first, gas moves the speed, at the second masses; rpm, full load."""

CONDITIONS = ("delta <= 1/9", "torque_mean >= 282 N m")
"""At both speeds, about what the engine itself reaches."""

SHOWN = 5
"""Best designs, and designs of the front, that are printed."""


def scene(points: int) -> dict[str, Any]:
    """The study with so many base points."""
    ranges = {name: {"low": low, "high": high} for name, (low, high) in RANGES.items()}
    return {
        "title": "V6, eight parameters",
        "engine": "v6_96x81",
        "sample": {"method": "saltelli", "number": points, "seed": 1, **ranges},
        "axes": {"speed": [*SPEEDS]},
        "output": {"quantities": ["delta", "torque_mean", "delta_error"]},
        "reduce": {
            "statistics": ["delta", "delta_error"],
            "over": "design",
            "within": [*CONDITIONS],
            "at_every": "speed",
            "best": [{"least": "inertia", "within": [*CONDITIONS], "number": SHOWN}],
            "front": [{"of": ["inertia", "delta"], "within": CONDITIONS[1]}],
        },
    }


def tables(found: Any, seconds: float) -> list[str]:
    """Lines to print of the reduced archive."""
    import resource  # not there on Windows, where other commands run

    outcomes = found.outcomes.values.sum(axis=0)
    designs = int(outcomes.sum())
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    peak *= 1 if sys.platform == "darwin" else 1024
    said = ", ".join(f"{n} {w}" for w, n in zip(found.outcome.values, outcomes, strict=True))
    what = [
        ["sampled engines", f"{designs // len(SPEEDS):,}"],
        ["designs, of both speeds", f"{designs:,}"],
        ["outcomes", said],
        ["seconds, compiling and writing included", f"{seconds:.1f}"],
        ["designs a second", number(designs / seconds)],
        ["largest resident memory, libraries included", size_text(peak)],
        ["largest estimated error of delta", f"{found.delta_error_largest.values.max():.1e}"],
    ]
    lines = rows(["study", "found"], what)
    for place, search in enumerate(found.search.values):
        rank = found["rank"].values[place]
        many = int(np.count_nonzero(rank))
        chosen = np.argsort(rank, kind="stable")[-many:] if many else rank[:0]
        # Of a front, some from end to end.
        chosen = chosen[np.unique(np.linspace(0, many - 1, min(many, SHOWN)).round().astype(int))]
        lines += ["", f"{search}: {many} kept", "", *_designs(found.isel(design=chosen))]
    for place, speed in enumerate(SPEEDS):
        lines += ["", f"Sobol' indices of delta at {speed:g} rpm, 95 % intervals", ""]
        lines += _indices(found.isel(speed=place))
    lines += ["", "Quantiles of delta", ""]
    shares = [f"{100 * share:g} %" for share in found["quantile"].values]
    body = [
        [f"{speed:g} rpm", *(f"{v:.5g} ± {e:.1g}" for v, e in zip(values, errors, strict=True))]
        for speed, values, errors in zip(
            SPEEDS, found.delta_quantile.values, found.delta_quantile_error.values, strict=True
        )
    ]
    return [*lines, *rows(["speed", *shares], body)]


def _designs(kept: Any) -> list[str]:
    """Parameters of designs, and their delta and torque at each speed."""
    names = ["delta", "torque_mean"]
    head = ["design", *RANGES, *(f"{n} at {s:g} rpm" for n in names for s in SPEEDS)]
    body = []
    for place in range(kept.sizes["design"]):
        one = kept.isel(design=place)
        values = [*(float(one[key]) for key in RANGES), *(v for n in names for v in one[n].values)]
        body.append([str(int(one.design)), *(f"{value:.4g}" for value in values)])
    return rows(head, body)


def _indices(found: Any) -> list[str]:
    """First-order and total indices, the largest first."""
    ending = "" if "delta_first" in found else "_conditional"
    keys = found["parameter"].values
    body = []
    for place in np.argsort(-found[f"delta_total{ending}"].values):
        cells = [
            f"{float(found[f'delta_{kind}{ending}'][place]):.5f} ± "
            f"{float(found[f'delta_{kind}_confidence{ending}'][place]):.5f}"
            for kind in ("first", "total")
        ]
        body.append([str(keys[place]), *cells])
    return rows(["parameter", "first", "total"], body)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the study and print what it found."""
    given = settings(
        "benchmarks large-study", __doc__, arguments, points=1 << 17, resume=False,
        output=ROOT / "out" / "large_study.nc",
    )  # fmt: skip
    path: Path = given.output
    path.parent.mkdir(parents=True, exist_ok=True)
    log(f"{given.points * (len(RANGES) + 2) * len(SPEEDS):,} designs")
    began = time.perf_counter()
    sweeps.stream(
        **scene(given.points), archive=path, overwrite=not given.resume, resume=given.resume,
        progress=sys.stderr.isatty(),
    )  # fmt: skip
    seconds = time.perf_counter() - began
    with sweeps.open(path) as found:
        print("\n".join(tables(found, seconds)))


if __name__ == "__main__":
    main()
