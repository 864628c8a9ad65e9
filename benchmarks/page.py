"""docs/benchmarks.md, from `page.md.in` and the CSV files that lie beside the page.

`make bench` and `make compile-times` write the files below docs/benchmarks, and this the page.
Between two @ stands the name of a fact, of a study (its rate), of a peer (its ratio) or of a time.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from benchmarks import tables
from benchmarks.studies import STUDIES

WORDS = Path(__file__).with_name("page.md.in")


def save(folder: Path, name: str, head: Sequence[str], body: Iterable[Sequence[str]]) -> None:
    """Write a table beside the page."""
    tables.save(folder / "benchmarks" / f"{name}.csv", head, body)


def read(folder: Path, name: str) -> list[dict[str, str]]:
    """Rows of a table; none where it was not written."""
    return tables.read(folder / "benchmarks" / f"{name}.csv")


def facts_of(folder: Path) -> dict[str, str]:
    """Single numbers and words by their names."""
    return {row["fact"]: row["value"] for row in read(folder, "facts")}


def save_facts(folder: Path, facts: Mapping[str, str]) -> None:
    """Add facts to those that are kept, or replace them."""
    save(folder, "facts", ["fact", "value"], list((facts_of(folder) | dict(facts)).items()))


def text(folder: Path) -> str:
    """The page; lines about files that were not written are left out."""
    facts = facts_of(folder)
    rates = {row["study"]: row["designs/s"] for row in read(folder, "studies")}
    made = {
        **{one.name: rates.get(one.words, "-") for one in STUDIES},
        **{_key(row["peer"]): row["share nothing"] for row in read(folder, "peers")},
        **{_key(row["what"]): row["time"] for row in read(folder, "single")},
        **facts,
        "quick_run": " **A quick run, to see that it works.**" if facts["quick"] == "yes" else "",
    }
    page = re.sub(r"@(\w+)@", lambda place: made.get(place[1], "-"), WORDS.read_text("utf-8"))
    lines = [
        line
        for line in page.splitlines()
        if not (file := re.match(r"- \[.*\]\(benchmarks/(\w+)\.csv\)", line))
        or read(folder, file[1])
    ]
    return "\n".join(lines).rstrip() + "\n"


def _key(words: str) -> str:
    """Name of a row, without what is in brackets."""
    return re.sub(r"\W+", "_", words.partition(" (")[0])


def write(folder: Path) -> None:
    """Write the page beside its files."""
    (folder / "benchmarks.md").write_text(text(folder), encoding="utf-8")
