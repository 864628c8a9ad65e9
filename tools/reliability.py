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

import csv
import io
import json
import re
from pathlib import Path
from typing import Any

from sweeps.archive import partial, provenance
from sweeps.errors import size_text
from sweeps.figures import options
from sweeps.ratios import LARGEST
from sweeps.reading import design_xlsx, netcdf_child, regular_files, sheets, toml_files
from sweeps.reading.laboratory import (
    matlab_files,
    recorded_columns,
    recording,
    recordings_apart,
)
from sweeps.scene import axes, reading

ROOT = Path(__file__).resolve().parents[1]

NOT_YET = "not measured yet"

OF_STABILITY = ("run", "absurd", "again", "independent", "light", "driven", "sampled", "weak",
                "estimate", "shortfall")  # fmt: skip
"""Sentences of docs/stability/summary.csv that the page tells."""


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
        return of_stability(name).rstrip(".")
    part = parts.get({"faults_power": "faults", "soak_processes": "soak", "readers": "soak",
                      "memory": "large_runs", "workers": "large_runs"}.get(name, name))  # fmt: skip
    return NOT_YET if part is None else FIGURES[name](part)


def rows_of_stability(name: str) -> list[list[str]]:
    """Rows of a file of docs/stability, heads first; none where it was not written."""
    path = ROOT / "docs" / "stability" / f"{name}.csv"
    if not path.is_file():
        return []
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.reader(file))


def of_stability(name: str) -> str:
    """A sentence with a figure of the stress run."""
    return dict(rows_of_stability("summary")).get(name, NOT_YET)


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
        f"{number(p['refused'])} refused, {number(p.get('wrong', 0))} went wrong"
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


def promised(parts: dict[str, dict[str, Any]]) -> list[list[str]]:
    """Each promise with the figures of its last run, heads first."""
    body = [
        [row["subject"], row["promise"],
         "; ".join(figure(name, parts) for name in row["figure"].split()) or "the tests only"]
        for row in promises()
    ]  # fmt: skip
    return [["subject", "promise", "last run"], *body]


def runs(parts: dict[str, dict[str, Any]]) -> list[list[str]]:
    """When each command was run, and on what, heads first."""
    body = []
    for name, part in parts.items():
        versions = ", ".join(f"{k} {v}" for k, v in part["versions"].items())
        body.append([name.replace("_", " "), part["date"], part["system"],
                     f"Python {part['python']}, {versions}"])  # fmt: skip
    return [["figures of", "date", "on", "versions"], *body]


def doors() -> list[list[str]]:
    """Every way in for foreign files, and its limits as the code has them, heads first."""
    apart = [f".{name}" for name, kind in recording.KINDS.items() if kind.apart]
    return [
        ["what is read", "limits before it is read", "limits while it is read"],
        ["scene, engine file (TOML)", size_text(toml_files.MOST_BYTES),
         f"{number(toml_files.MOST_KEYS)} keys, tables and lists"],
        ["CSV that a scene or an engine file names", size_text(regular_files.MOST_TEXT), ""],
        ["table of designs: CSV, Parquet, netCDF", "",
         f"{number(regular_files.MOST_ROWS)} rows, and what fits into the free memory"],
        ["table of designs: .xlsx", size_text(design_xlsx.MOST), "as every sheet"],
        ["sheet of an .xlsx file", f"{size_text(sheets.MOST_INFLATED)} when inflated",
         f"{number(sheets.MOST_CELLS)} cells; in a child process of {sheets.SECONDS:.0f} s and "
         f"{size_text(sheets.MEMORY)}, and more by the size of its sheets"],
        ["laboratory recording", size_text(recording.MOST_BYTES),
         f"{number(recorded_columns.MOST_VALUES)} values, "
         f"{number(recorded_columns.MOST_COLUMNS)} columns"],
        [f"recording: {', '.join(apart)}", "as every recording",
         f"a child process of {recordings_apart.SECONDS:.0f} s and "
         f"{size_text(recordings_apart.MEMORY)}, and more by its size"],
        [".mat file", f"{size_text(matlab_files.MOST_INFLATED)} when inflated",
         "as every recording"],
        ["archive, netCDF file", "",
         f"a child process of {netcdf_child.SECONDS:.0f} s and {size_text(netcdf_child.OPENING)}, "
         "and more by its size"],
        ["files in an archive", "", size_text(provenance.MOST)],
        ["folder of an interrupted run", size_text(partial.MOST_BLOCK), "a block"],
        ["matplotlib style (--style)", size_text(options.MOST_STYLE), ""],
        ["any number", "", f"{LARGEST:g} in size; 0 or {1.0 / LARGEST:g} and more, if positive"],
        ["axes of a scene", "",
         f"{number(axes.MOST_VALUES)} values together, {reading.MOST_DESIGNS:.0e} designs"],
    ]  # fmt: skip


def as_csv(rows: list[list[str]]) -> str:
    """The text of a file."""
    file = io.StringIO()
    csv.writer(file, lineterminator="\n").writerows(rows)
    return file.getvalue()


def files() -> dict[Path, str]:
    """Every file that is made here, and its text."""
    parts, folder = read_parts(), ROOT / "docs" / "reliability"
    worst = dict(rows_of_stability("independent_differences"))
    made = {
        **{name: of_stability(name) for name in OF_STABILITY},
        **{name: figure(name, parts) for name in FIGURES},
        "worst_delta": worst.get("delta", NOT_YET),
        "worst_mean": worst.get("omega_mean", NOT_YET),
        "counted": str(len(promises())),
    }
    words = (ROOT / "tools" / "trust.md.in").read_text(encoding="utf-8")
    page = re.sub(r"@(\w+)@", lambda place: made[place[1]], words)
    return {
        ROOT / "docs" / "trust.md": page,
        folder / "promises.csv": as_csv(promised(parts)),
        folder / "runs.csv": as_csv(runs(parts)),
        folder / "doors.csv": as_csv(doors()),
    }


if __name__ == "__main__":
    for path, text in files().items():
        path.write_text(text, encoding="utf-8")
        print(path)
