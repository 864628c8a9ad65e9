"""Write the tables of the documentation that come from the tables in the code.

Each stands between two comments, `<!-- begin NAME: ... -->` and `<!-- end NAME -->`; everything in
between is replaced. Run it from the project's root: `python tools/reference_tables.py`; with
`--check` it writes nothing and ends with status 1 if one of them is not current.
"""

from __future__ import annotations

import argparse
import re
import sys
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

from engine_dyn.plausibility.usual_ranges import CHECKS, DIAGRAM_CHECKS, RESULT_CHECKS
from engine_dyn.quantities.graph import PARAMETERS, QUANTITIES
from engine_dyn.quantities.single_cylinders import OF_CYLINDER, PATTERNS
from engine_dyn.quantities.sources import SOURCES
from engine_dyn.status import MEANINGS, has_numbers
from sweeps.checks import allowed
from sweeps.presenting.quantity_search import OTHER_WORDS, SUBJECTS
from sweeps.reading.engine_files import catalogue, load_engine
from sweeps.scene.reading import built_in_scenes

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"

OUTCOMES = {
    "converged": "periodic solution found, the tolerance is met",
    "stalled": "the speed would reach zero within the cycle: there is no running steady state",
    "no_steady_state": "the mean torque is below the constant part of the load torque and no "
    "driver makes up for it, or load or driver do not hold the speed",
    "not_converged": "the iteration did not end",
    "invalid_input": "no such solution: the moment of inertia would vanish somewhere in the cycle, "
    "the parameters are no modelled cycle, a table does not cover the speeds of the solution, the "
    "diagrams do not give the torque of the speed characteristic, or method `closed` at an "
    "exponent other than 0 and 2",
    "tolerance_not_met": "a solution, but `delta_error` is above the tolerance",
    "passes_done": "the cycles asked for (`passes`) are done",
}
"""What the outcomes of `engine_dyn.status` mean for a person."""


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Write a Markdown table."""
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def keys() -> str:
    """Keys of scenes and of an engine file's [values]."""
    rows = []
    nodes = {k: node for k, node in PARAMETERS.items() if k not in OF_CYLINDER} | dict(PATTERNS)
    for name, node in nodes.items():
        unit = "" if node.unit == "1" else node.unit
        rule = allowed(node).replace(f" [{node.unit}]", "").removeprefix("a finite number").strip()
        rows.append([f"`{name}`", unit, node.long_name, rule or "any number"])
    return table(["key", "unit", "meaning", "allowed"], rows)


def quantities() -> str:
    """Quantities of [output], by subject, with the words that people have for them."""
    listed: set[str] = set()
    parts = []
    for subject, nodes in SUBJECTS.items():
        names = [n for n in dict.fromkeys(node.name for node in nodes) if n in QUANTITIES]
        listed.update(names)
        parts.append(f"## {subject[0].upper()}{subject[1:]}\n\n{_quantity_table(names)}\n")
    if missing := set(QUANTITIES) - listed:
        raise ValueError(f"quantities without a subject: {', '.join(sorted(missing))}")
    return "\n".join(parts)


def _quantity_table(names: Iterable[str]) -> str:
    rows = []
    for name in sorted(names):
        node = QUANTITIES[name]
        unit = node.unit or "N m s^alpha"
        meaning = node.long_name
        if node.kind == "curve":
            meaning += "; over `crank_angle`"
            meaning += "".join(f" and `{d}`" for d in node.adds if d != "crank_angle")
        elif "order" in node.needs:
            meaning += "; over `order`"
        words = OTHER_WORDS.get(name, "")
        rows.append([f"`{name}`", "" if unit == "1" else unit, meaning, words, node.source])
    return table(["quantity", "unit", "meaning", "also called", "source"], rows)


def sources() -> str:
    """Full citations of the sources that quantities and keys name in short."""
    return table(["name", "source"], SOURCES.items())


def outcomes() -> str:
    """Outcomes of a design."""
    rows = [
        [str(code), f"`{name}`", OUTCOMES[name], "numbers" if has_numbers(code) else "NaN"]
        for code, name in enumerate(MEANINGS)
    ]
    return table(["status", "name", "meaning", "results hold"], rows)


def engines() -> str:
    """Engines of the catalogue."""
    rows = []
    for name in catalogue():
        engine = load_engine(name, Path())
        loads = ", ".join(f"{load:g}" for load in engine.family.loads)
        rows.append([f"`{name}`", engine.title, f"{loads} %"])
    return table(["engine", "what it is", "diagrams at load"], rows)


def scenes() -> str:
    """Scenes that come with the package."""
    return table(
        ["scene", "title"],
        [
            [f"`{name}`", tomllib.loads(path.read_text(encoding="utf-8"))["title"]]
            for name, path in built_in_scenes().items()
        ],
    )


def ranges() -> str:
    """Usual ranges of plausibility checks."""
    rows = []
    for check in (*CHECKS, *DIAGRAM_CHECKS, *RESULT_CHECKS):
        unit = f" {check.unit}" if check.unit else ""
        zero = ", or 0" if check.zero else ""
        usual = f"{check.low:g} to {check.high:g}{unit}{zero}"
        rows.append([f"`{check.name}`", check.what, usual, check.source])
    return table(["name", "measure", "usual", "source"], rows)


DOCUMENTS: Mapping[Path, Mapping[str, Callable[[], str]]] = {
    DOCS / "keys.md": {"keys": keys},
    DOCS / "quantities.md": {"quantities": quantities, "sources": sources},
    DOCS / "conventions.md": {"outcomes": outcomes},
    DOCS / "engine_files.md": {"engines": engines},
    DOCS / "scenes.md": {"scenes": scenes},
    DOCS / "plausibility.md": {"ranges": ranges},
}
"""Pages, and the tables in each."""


def updated(text: str, tables: Mapping[str, Callable[[], str]]) -> str:
    """Return the text of a page with every table made anew.

    Raises
    ------
    ValueError
        If a table does not have its two comments, once each.
    """
    for name, make in tables.items():
        place = re.compile(
            rf"(?<=<!-- begin {name}: made by tools/reference_tables.py -->\n)(.*?)"
            rf"(?=<!-- end {name} -->)",
            re.DOTALL,
        )
        parts = place.split(text)
        if len(parts) != 3:
            raise ValueError(f"{len(parts) // 2} places for the table {name!r}")
        text = parts[0] + make() + "\n" + parts[2]
    return text


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="write nothing, compare only")
    check = parser.parse_args().check
    old = {path: path.read_text(encoding="utf-8") for path in DOCUMENTS}
    new = {path: updated(old[path], tables) for path, tables in DOCUMENTS.items()}
    if check:
        sys.exit(new != old)
    for path, text in new.items():
        path.write_text(text, encoding="utf-8")
        print(f"written: {path.name}")


if __name__ == "__main__":
    main()
