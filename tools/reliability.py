"""Write docs/trust.md: how far one can trust the program, in figures of the last large runs.

Beside it come docs/reliability/promises.csv, every promise with its last run, runs.csv, when each
command was run, and doors.csv, the limits of everything that is read, as the code has them. The
promises and the tests that hold them are in tools/promises.csv. Figures come from
docs/reliability/NAME.json and docs/stability/*.csv, which the commands that measure write (`make
large-runs`, `make faults`, `make soak`, `make properties`, `make fuzz`, `make stress`); nothing is
measured here. The words are in tools/trust.md.in.

Run it from the project's root: `python tools/reliability.py`.
"""

from __future__ import annotations

import json
import pkgutil
import re
from collections import defaultdict
from pathlib import Path
from typing import Any

from pages import DOCS, csv_rows, csv_text, filled, write

from sweeps.base.errors import size_text

TOOLS = Path(__file__).parent

NOT_YET = "not measured yet"

OF_STABILITY = ("run", "absurd", "again", "independent", "light", "driven", "sampled", "estimate",
                "shortfall")  # fmt: skip
"""Sentences of docs/stability/summary.csv that the page tells."""


Part = dict[str, Any]
"""Figures of a command that has been run."""


def read_parts() -> dict[str, Part]:
    """Figures of all commands that have been run, by their names."""
    files = sorted((DOCS / "reliability").glob("*.json"))
    return {path.stem: json.loads(path.read_text(encoding="utf-8")) for path in files}


def number(value: float) -> str:
    """A whole number with blanks between its thousands."""
    return f"{value:,.0f}".replace(",", " ")


FIGURES = {row["figure"]: row for row in csv_rows(TOOLS / "figures_of_runs.csv")}
"""Words of each figure, and the part of the results that has its numbers."""


def numbers_of(part: Part) -> dict[str, Any]:
    """Numbers of a part that the words of figures may use; whole numbers as text."""
    sums: dict[str, int] = defaultdict(int)
    for one in [*part.get("properties", {}).values(), *part.get("targets", {}).values()]:
        for name, count in one.items():
            sums[name] += count
    for name, count in part.get("faults", {}).items():
        sums["power"] += count if name.startswith("power") else 0
    found = part.get("wrong", 0)
    wrong = found if isinstance(found, int) else len(found)
    told = {
        "verdict": f"{wrong} went wrong" if wrong else "nothing went wrong",
        "wrong": wrong,
        "kinds": len(part.get("targets", ())),
        "minutes": f"{part.get('seconds', 0.0) / 60:.0f}",
        "gigabytes": f"{part.get('archive_bytes', 0) / 1e9:.2f}",
        "megabytes": f"{part.get('resident_bytes', 0) / 1e6:.0f}",
    }
    told = {**sums, **part, **told}
    return {name: number(v) if isinstance(v, int) else v for name, v in told.items()}


def figure(name: str, parts: dict[str, Part]) -> str:
    """Words for the figure of a promise, from the part that has it."""
    if name in OF_STABILITY:
        return sentence(name).rstrip(".")
    part = parts.get(FIGURES[name]["part"])
    return FIGURES[name]["words"].format_map(numbers_of(part)) if part else NOT_YET


def sentence(name: str) -> str:
    """A sentence of `make stress`."""
    rows = csv_rows(DOCS / "stability" / "summary.csv")
    return {row["what"]: row["words"] for row in rows}.get(name, NOT_YET)


def largest(name: str) -> str:
    """Largest difference of a result of absurd designs from the independent solver."""
    rows = csv_rows(DOCS / "stability" / "findings.csv")
    of = {row["of"]: row["number"] for row in rows if row["what"] == "largest"}
    return of.get(name, NOT_YET)


def promises() -> list[dict[str, str]]:
    """Rows of tools/promises.csv."""
    return csv_rows(TOOLS / "promises.csv")


def promised(parts: dict[str, Part]) -> list[list[str]]:
    """Each promise with the figures of its last run, heads first."""
    rows = [["subject", "promise", "last run"]]
    for row in promises():
        told = "; ".join(figure(name, parts) for name in row["figure"].split())
        rows.append([row["subject"], row["promise"], told or "the tests only"])
    return rows


def runs(parts: dict[str, Part]) -> list[list[str]]:
    """When each command was run, and on what, heads first."""
    rows = [["figures of", "date", "on", "versions"]]
    for name, part in parts.items():
        versions = ", ".join(f"{k} {v}" for k, v in part["versions"].items())
        told = f"Python {part['python']}, {versions}"
        rows.append([name.replace("_", " "), part["date"], part["system"], told])
    return rows


FORMS = {
    "size": size_text,
    "number": number,
    "power": lambda value: f"{value:g}",
    "inverse": lambda value: f"{1.0 / value:g}",
}


def doors() -> str:
    """Every way in for foreign files, and its limits as the code has them."""
    words = (TOOLS / "doors.csv.in").read_text(encoding="utf-8")
    return re.sub(
        r"\{\{ (\w+) ([\w.]+) \}\}",
        lambda place: FORMS[place[1]](pkgutil.resolve_name(place[2])),
        words,
    )


def files() -> dict[Path, str]:
    """Every file that is made here, and its text."""
    parts, folder = read_parts(), DOCS / "reliability"
    words = (TOOLS / "trust.md.in").read_text(encoding="utf-8")
    made = {
        **{name: sentence(name) for name in OF_STABILITY},
        **{name: figure(name, parts) for name in FIGURES},
        "worst_delta": largest("delta"),
        "worst_mean": largest("omega_mean"),
        "counted": str(len(promises())),
    }
    told = {name: text for name, text in made.items() if f"{{{{ {name} }}}}" in words}
    return {
        DOCS / "trust.md": filled(words, told),
        folder / "promises.csv": csv_text(promised(parts)),
        folder / "runs.csv": csv_text(runs(parts)),
        folder / "doors.csv": doors(),
    }


if __name__ == "__main__":
    write(files())
