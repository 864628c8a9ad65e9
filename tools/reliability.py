"""Write docs/reliability.md: every promise, the test that holds it, the figure of the last run.

The promises are in tools/promises.csv. Figures come from docs/reliability/NAME.json, which the
commands that measure write (`make large-runs`, `make faults`, `make soak`, `make properties`, `make
fuzz`, `make stress`); nothing is measured here. The words are in tools/reliability.md.in.

Run it from the project's root: `python tools/reliability.py`.
"""

from __future__ import annotations

import csv
import json
from itertools import groupby
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]

NOT_YET = "not measured yet"

OF_STABILITY = {
    "absurd": "absurd ranges",
    "again": "solved again, among other designs",
    "independent": "by an independent solver",
    "estimate": "`delta_error`",
}
"""Figures that the first lines of docs/stability.md tell, and words by which a line is known."""


def read_parts() -> dict[str, dict[str, Any]]:
    """Figures of all commands that have been run, by their names."""
    files = sorted((ROOT / "docs" / "reliability").glob("*.json"))
    return {path.stem: json.loads(path.read_text(encoding="utf-8")) for path in files}


def number(value: float) -> str:
    """A whole number with blanks between its thousands."""
    return f"{value:,.0f}".replace(",", " ")


def wrong_of(part: dict[str, Any]) -> str:
    """How many findings a command had."""
    found = len(part["wrong"])
    return "nothing went wrong" if found == 0 else f"{found} went wrong"


def figure(name: str, parts: dict[str, dict[str, Any]]) -> str:
    """Words for the figure of a promise, from the part that has it."""
    if name in OF_STABILITY:
        return of_stability(OF_STABILITY[name])
    part = parts.get({"faults_power": "faults", "soak_processes": "soak", "readers": "soak",
                      "memory": "large_runs", "workers": "large_runs"}.get(name, name))  # fmt: skip
    return NOT_YET if part is None else FIGURES[name](part)


def of_stability(words: str) -> str:
    """The line of docs/stability.md in which these words are."""
    lines = (ROOT / "docs" / "stability.md").read_text(encoding="utf-8").splitlines()
    found = [line[2:].rstrip(".") for line in lines if line.startswith("- ") and words in line]
    return found[0] if found else NOT_YET


FIGURES = {
    "properties": lambda p: (
        f"{number(sum(n['passing'] for n in p['properties'].values()))} drawn scenes, "
        f"{number(sum(n['failing'] for n in p['properties'].values()))} failed"
    ),
    "fuzz": lambda p: (
        f"{number(sum(counts['inputs'] for counts in p['targets'].values()))} inputs of "
        f"{len(p['targets'])} kinds in {p['seconds'] / 60:.0f} minutes, {wrong_of(p)}"
    ),
    "damage": lambda p: (
        f"{number(p['files'])} damaged files: {number(p['opened'])} could be opened, "
        f"{number(p['refused'])} refused, {number(p.get('wrong', 0))} went wrong "
        "([hostile input](hostile_input.md))"
    ),
    "large_runs": lambda p: (
        f"{p['runs_killed']} runs killed, {number(p['blocks_found'])} finished blocks found, "
        f"{p['lost']} lost"
    ),
    "memory": lambda p: (
        f"{number(p['designs'])} designs, {p['archive_bytes'] / 1e9:.2f} GB: "
        f"{p['resident_bytes'] / 1e6:.0f} MB resident with `--memory {p['memory']}`"
    ),
    "workers": lambda p: f"{p['workers_killed']} workers killed, {p['lost_by_workers']} lost",
    "faults": lambda p: f"{number(p['points'])} failing system calls, {wrong_of(p)}",
    "faults_power": lambda p: (
        f"{number(sum(n for name, n in p['faults'].items() if name.startswith('power')))} "
        f"simulated power failures, {wrong_of(p)}"
    ),
    "soak": lambda p: (
        f"{number(p['runs'])} runs: {p['growth_bytes_per_run']:.0f} bytes a run; open files "
        f"{p['descriptors'][0]} before and {p['descriptors'][1]} after, threads "
        f"{p['threads'][0]} and {p['threads'][1]}"
    ),
    "soak_processes": lambda p: (
        f"{p['threads_at_once']} threads and {p['processes_at_once']} processes, "
        f"{p['rounds_each']} rounds each, {number(p['refused_on_one_output'])} refused on one "
        f"output, {wrong_of(p)}"
    ),
    "readers": lambda p: (
        f"{number(p['reads_beside_a_writer'])} reads beside {number(p['replacements'])} "
        f"replacements, {wrong_of(p)}"
    ),
}  # fmt: skip
"""Words of each figure; the part that a command writes has its numbers."""


def promises() -> list[dict[str, str]]:
    """Rows of tools/promises.csv."""
    with (ROOT / "tools" / "promises.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_link(test: str) -> str:
    """Link to a test from docs/reliability.md."""
    path, _, name = test.partition("::")
    return f"[{name.removeprefix('test_').replace('_', ' ')}](../{path})"


def table(rows: list[dict[str, str]], parts: dict[str, dict[str, Any]]) -> list[str]:
    """Tables of promises, one for each subject."""
    lines: list[str] = []
    for subject, some in groupby(rows, key=lambda row: row["subject"]):
        lines += [f"## {subject}", "", "| promise | tests | last run |", "| --- | --- | --- |"]
        for row in some:
            tests = ", ".join(map(test_link, row["tests"].split()))
            figures = "; ".join(figure(name, parts) for name in row["figure"].split())
            lines.append(f"| {row['promise']} | {tests} | {figures or 'the tests only'} |")
        lines.append("")
    return lines


def runs(parts: dict[str, dict[str, Any]]) -> list[str]:
    """When each command was run, and on what."""
    lines = ["| figures of | date | on | versions |", "| --- | --- | --- | --- |"]
    for name, part in parts.items():
        versions = ", ".join(f"{k} {v}" for k, v in part["versions"].items())
        lines.append(
            f"| {name.replace('_', ' ')} | {part['date']} | {part['system']} | "
            f"Python {part['python']}, {versions} |"
        )
    return lines


def text() -> str:
    """docs/reliability.md."""
    parts = read_parts()
    words = (ROOT / "tools" / "reliability.md.in").read_text(encoding="utf-8")
    made = {"promises": "\n".join(table(promises(), parts)), "runs": "\n".join(runs(parts))}
    for name, block in made.items():
        words = words.replace(f"@{name}@\n", f"{block.rstrip()}\n")
    return words


if __name__ == "__main__":
    page = ROOT / "docs" / "reliability.md"
    page.write_text(text(), encoding="utf-8")
    print(page)
