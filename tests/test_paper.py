"""The paper: it cites what its bibliography has, and its numbers are those of the benchmarks."""

import csv
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAPER = (ROOT / "paper" / "paper.md").read_text(encoding="utf-8")
BIBLIOGRAPHY = (ROOT / "paper" / "paper.bib").read_text(encoding="utf-8")


def test_every_entry_is_cited_and_every_citation_has_its_entry() -> None:
    entries = set(re.findall(r"^@\w+\{(\w+),", BIBLIOGRAPHY, re.MULTILINE))
    assert set(re.findall(r"\[?@(\w+)", PAPER)) == entries


def test_its_ratios_are_those_that_were_measured() -> None:
    path = ROOT / "docs" / "benchmarks" / "peers.csv"
    with path.open(encoding="utf-8", newline="") as file:
        times = {row["peer"]: row["share nothing"] for row in csv.DictReader(file)}
    words = " ".join(PAPER.split())
    assert f"it solves {times['Numba loop']} times as many" in words
    assert f"{times['Harmonic balance']} times as many as harmonic" in words
    assert f"{times['SciPy solve_ivp']} times as many as SciPy's" in words
