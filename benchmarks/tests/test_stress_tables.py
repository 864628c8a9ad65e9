"""Files of the stress run are made from the text of its report, of this run or an earlier one."""

from __future__ import annotations

import csv
import inspect
import re
import sys
from pathlib import Path

import pytest

from benchmarks.stress import __main__ as command
from benchmarks.stress import report, tables

DOCS = Path(__file__).resolve().parents[2] / "docs"

REPORT = """\
# Numerical stability

2026-01-02; a machine; Python 3; seed 7; 1.5 minutes.

- 9 designs from absurd ranges: 0 hangs or crashes, 0 broken rules.

## Rules

| rule |  | broken |
| --- | --- | ---: |
| order | *0* < `omega_min` | 0 |

- rule: `{"speed": 1}`

## Light flywheels

| inertia model | off |
| --- | ---: |
| constant | 0 |
"""


def read(path: Path) -> list[list[str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.reader(file))


def test_files_are_made_from_a_report(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "report.md").write_text(REPORT, encoding="utf-8")
    arguments = ["stress", "--from", str(tmp_path / "report.md"), "-o", str(tmp_path)]
    monkeypatch.setattr(sys, "argv", arguments)
    assert command.main() == 0
    folder = tmp_path / "stability"
    assert {path.stem for path in folder.iterdir()} == {
        "rules", "light_flywheels", "examples", "summary",
    }  # fmt: skip
    assert read(folder / "rules.csv")[1] == ["order", "0 < omega_min", "0"]
    assert read(folder / "light_flywheels.csv") == [["inertia model", "off"], ["constant", "0"]]
    assert read(folder / "examples.csv")[1] == ["Rules", "rule", '{"speed": 1}']
    assert dict(read(folder / "summary.csv"))["run"].startswith("2026-01-02; a machine")


def test_what_is_no_report_writes_nothing(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"a report is out/stability\.md"):
        tables.write("[]", tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_every_heading_and_sentence_of_a_report_has_its_file() -> None:
    text = inspect.getsource(report)
    assert set(re.findall(r'"## ([^"]+)"', text)) == set(tables.NAMES)
    written = {path.stem for path in (DOCS / "stability").glob("*.csv")}
    assert written == {name for names in tables.NAMES.values() for name in names} | {
        "examples", "summary",
    }  # fmt: skip
    assert [row[0] for row in read(DOCS / "stability" / "summary.csv")[1:]] == list(tables.LINES)
