"""Write docs/worked_examples.md and .csv: worked examples of textbooks, printed and computed.

Run it from the project's root: `python tools/worked_examples.py`. The examples stand in
tests/reference/worked_examples.toml; tools/textbook_examples.py computes them, and
tools/reference_tables.py makes the tables of the site from the file.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from pages import DOCS, csv_text, filled, markdown, write
from textbook_examples import DATA, EXAMPLES, Result, engine_file, results, scene

TEMPLATE = Path(__file__).with_suffix(".md.in")
DOCUMENT = DOCS / "worked_examples.md"
SHOWN = "khurmi-15-07"
"""The example whose files the page shows."""

SUBJECTS = {
    "flywheel": "Turning moments and flywheels",
    "forces": "Motion and forces",
    "balance": "Balance",
}
"""Headings of the page of examples, by subject."""


def number(value: Any) -> str:
    """Six digits; texts as they are, nothing where there is none."""
    if value is None:
        return ""
    return value if isinstance(value, str) else f"{value:.6g}"


def difference(one: Result) -> str:
    """From the exact value; digits of rounding differ between machines."""
    if math.isnan(one.difference):
        return ""
    return f"{one.difference:.0e}" if abs(one.difference) > 1e-10 else "0"


def posed_by(value: dict[str, Any]) -> str:
    """The quantities or the function that give a value, what is picked of them, and a factor."""
    times = value.get("times")
    asked = [
        " + ".join(value.get("ask", ())), value.get("function"), value.get("part"),
        value.get("pick"), f"times {times}" if isinstance(times, str) else None,
    ]  # fmt: skip
    return ", ".join(part for part in asked if part)


def cells(one: Result) -> dict[str, str]:
    """All about a value, by the heads of the file."""
    example, value = one.example, one.value
    wrong = f"{DATA['wrong'][value['wrong']]}: {value['why']}" if "wrong" in value else ""
    return {
        "subject": SUBJECTS[example["subject"]], "example": example["label"],
        "about": example["title"], "value": value["name"],
        "unit": value["unit"], "printed": value.get("printed", ""),
        "by the formula": number(value.get("expected")), "exact": number(value.get("exact")),
        "ours": number(one.ours), "difference": difference(one),
        "tolerance": f"{one.tolerance:g}", "for the reason": value.get("reason", ""),
        "posed by": posed_by(value), "needs": DATA["needs"].get(value.get("needs"), ""),
        "who is wrong, and why": wrong, "remark": example.get("remark", ""),
        "formula": example["formula"], "source": example["source"], "address": example["address"],
    }  # fmt: skip


def waiting(found: list[Result]) -> list[list[str]]:
    """Missing features, and the examples that need them."""
    rows = [["what is missing", "examples"]]
    for key, text in DATA["needs"].items():
        labels = [one.example["label"] for one in found if one.value.get("needs") == key]
        rows.append([text, ", ".join(dict.fromkeys(labels))])
    return rows


def documents() -> dict[Path, str]:
    """The page, and the file beside it."""
    found, shown = results(), EXAMPLES[SHOWN]
    computed = [one for one in found if one.ours is not None]
    values = {
        "examples": str(len(EXAMPLES)),
        "posed": str(len({one.example["id"] for one in computed})),
        "values": str(len(computed)),
        "engine": engine_file(shown).strip(),
        "quantities": json.dumps(scene(shown)["output"]["quantities"]),
        "waiting": markdown(waiting(found)),
    }
    rows = [cells(one) for one in found]
    return {
        DOCUMENT: filled(TEMPLATE.read_text(encoding="utf-8"), values),
        DOCUMENT.with_suffix(".csv"): csv_text(
            [list(rows[0]), *(list(row.values()) for row in rows)]
        ),
    }


if __name__ == "__main__":
    write(documents())
