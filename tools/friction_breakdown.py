"""Write the table of docs/friction.md: friction by component of an engine of the catalogue.

Run it from the project's root: `python tools/friction_breakdown.py`.
"""

from __future__ import annotations

import re
from pathlib import Path

import xarray as xr

import sweeps

PAGE = Path(__file__).resolve().parents[1] / "docs" / "friction.md"

ENGINE, SPEEDS = "si_four_87x101", (1500, 2000, 3000, 4000, 5200)

CRANKSHAFT = ("fmep_crankshaft_seals", "fmep_main_bearings", "fmep_crank_pin_bearings")
PISTONS = ("fmep_skirt", "fmep_rings", "fmep_ring_gas_pressure")
OTHERS = ("fmep_valve_train", "fmep_auxiliaries", "fmep_components")


def rows() -> list[str]:
    """Lines of the table: a speed each."""
    found = sweeps.run(
        engine=ENGINE,
        axes={"speed": SPEEDS},
        output={"quantities": [*CRANKSHAFT, *PISTONS, *OTHERS]},
    )
    lines = [
        "| speed, rpm | sum, bar | crankshaft over valve train | "
        "pistons over crankshaft and valve train | auxiliaries, % |",
        "| --- | --- | --- | --- | --- |",
        "| published | | 1.5 to 2 | about 1 | 20 to 30 |",
    ]
    return [*lines, *(_row(found.sel(speed=speed)) for speed in SPEEDS)]


def _row(one: xr.Dataset) -> str:
    crankshaft, pistons = (sum(float(one[n]) for n in names) for names in (CRANKSHAFT, PISTONS))
    valves, auxiliaries, total = (float(one[name]) for name in OTHERS)
    numbers = [f"{float(one['speed']):g}", f"{total:.3f}"]
    numbers += [f"{crankshaft / valves:.2f}", f"{pistons / (crankshaft + valves):.2f}"]
    return f"| {' | '.join([*numbers, f'{100.0 * auxiliaries / total:.0f}'])} |"


def written(text: str) -> str:
    """Return the page with the table as it is computed now."""
    table = "\n".join(rows())
    return re.sub(
        r"(<!-- begin breakdown[^\n]*-->\n).*?(<!-- end breakdown -->)",
        lambda match: f"{match[1]}{table}\n{match[2]}", text, flags=re.DOTALL,
    )  # fmt: skip


def main() -> int:
    """Write the page."""
    PAGE.write_text(written(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
