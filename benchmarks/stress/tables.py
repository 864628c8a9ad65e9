"""The tables of a report of the stress run as CSV files: docs/stability/*.csv.

A report is what `report.document` writes, a Markdown page with everything that was found. The files
are made from its text, so that those of an earlier run can be made without running again.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

__all__ = ["write"]

NAMES: dict[str, tuple[str, ...]] = {
    "What was drawn": ("drawn",),
    "Outcomes": ("outcomes",),
    "Rules": ("rules",),
    "Against an independent solver": ("independent", "independent_differences"),
    "Diagrams with a spike, with noise, with steps": ("spikes",),
    "Light flywheels": ("light_flywheels",),
    "Motors, drivers and loads over speed and angle": ("driven_outcomes", "driven"),
    "Sampled studies": ("sampled_outcomes", "sampled_differences", "sampled_again"),
    "Repeating cycles": ("euler_cycles", "repeated_cycles"),
    "Which closure keeps its digits": ("closures",),
    "How reliable is `delta_error`?": ("error_ranges", "error_estimate"),
}
"""Files of the tables below each heading, in their order."""

LINES = {
    "run": r"; seed \d+; ",
    "absurd": "absurd ranges",
    "again": "solved again, among other designs",
    "independent": "absurd designs solved again by an independent solver",
    "light": "with light flywheels",
    "driven": "with motors, driver tables",
    "sampled": "of sampled studies",
    "estimate": "- `delta_error`",
    "weak": "For a load so weak",
    "time": "of kernel time",
    "closures": "error of end = start grows",
    "own_error": "when its pieces are halved",
    "shortfall": r"above (?:the estimate \(|its estimate)",
}
"""Sentences with figures, by a pattern that each has; they are kept in summary.csv."""


def tables(report: str) -> Iterator[tuple[str, list[list[str]]]]:
    """Names of files and their rows, heads first."""
    for part in report.split("\n## ")[1:]:
        heading, _, text = part.partition("\n")
        blocks = re.findall(r"(?:^\|.*\|$\n?)+", text, re.MULTILINE)
        for name, block in zip(NAMES.get(heading, ()), blocks, strict=False):
            lines = [
                [cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]]
                for line in block.splitlines()
            ]
            yield name, [lines[0], *lines[2:]]


def examples(report: str) -> list[list[str]]:
    """Designs that the report shows with their inputs: heading, what is shown, the design."""
    return [
        [part.partition("\n")[0], words, design]
        for part in report.split("\n## ")[1:]
        for words, design in re.findall(r"^- (.*): `(\{.*\})`$", part, re.MULTILINE)
    ]


def summary(report: str) -> list[list[str]]:
    """Sentences with figures by their names."""
    lines = report.splitlines()
    return [
        [name, found[0].removeprefix("- ")]
        for name, words in LINES.items()
        if (found := [line for line in lines if re.search(words, line)])
    ]


def write(report: str, folder: Path) -> None:
    """Write all files below `folder`.

    Raises
    ------
    ValueError
        Where the text is no report.
    """
    files = dict(tables(report))
    if not files:
        raise ValueError("no tables: a report is out/stability.md; out/stress.json has none")
    (folder / "stability").mkdir(parents=True, exist_ok=True)
    files["examples"] = [["part", "what", "design"], *examples(report)]
    files["summary"] = [["what", "words"], *summary(report)]
    for name, rows in files.items():
        _save(folder / "stability" / f"{name}.csv", rows)


def _save(path: Path, rows: Iterable[Sequence[str]]) -> None:
    """Write one file; names stand in it without marks."""
    with path.open("w", encoding="utf-8", newline="") as file:
        plain = path.stem != "summary"
        csv.writer(file, lineterminator="\n").writerows(
            [re.sub(r"`|\*", "", cell) if plain else cell for cell in row] for row in rows
        )
