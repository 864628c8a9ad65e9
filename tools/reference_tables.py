"""Write the tables of the documentation that come from the tables in the code.

Each stands between two comments, `<!-- begin NAME: ... -->` and `<!-- end NAME -->`; everything in
between is replaced. Longer ones are CSV files; `docs/conf.py` shows some of these as tables of the
site. Run it from the project's root: `python tools/reference_tables.py`.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

import key_tables
import xarray as xr
from pages import DOCS, ROOT, csv_rows, csv_text, markdown, with_notes, write

import sweeps
from engine_dyn.plausibility.usual_ranges import CHECKS, DIAGRAM_CHECKS, RESULT_CHECKS
from engine_dyn.quantities.graph import (
    DIMENSIONS,
    NODES,
    QUANTITIES,
    SOURCES,
)
from engine_dyn.status import MEANINGS, NOT_STARTED, RUNAWAY, STOPPED, has_numbers
from sweeps.scene.crossings import CROSSINGS, NOT_WITH, REPLACED
from sweeps.scene.crossings import KEYS as KEY_PAIRS
from sweeps.scene.engine.engine_files import catalogue, load_engine
from sweeps.view.texts.lists import LISTS, OTHER_WORDS, SUBJECTS, symbol_text

OUTCOMES = {row["name"]: row for row in csv_rows(Path(__file__).with_name("outcomes.csv"))}
"""Meaning of each outcome of `engine_dyn.status` for a user, and what to do about it."""


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


TURNING = ", positive in the sense of rotation"
"""Words that hold for all torques, said once at the top of the page."""


OF_ORDERS = ("_phase", "_largest_order")
OF_A_CURVE = ("_max", "_mean", "_rms")
PARTS = ("gas_", "inertia_")
WHOLE = ("omega", "torque")
"""Curves whose parts and numbers have rows of their own: most scenes ask for them."""


def _folded(listed: Sequence[str]) -> dict[str, list[str]]:
    """Quantities that stand in the row of another one: phases, parts, numbers of a curve.

    Those that people call by other words of their own keep their rows.
    """
    found: dict[str, list[str]] = {}
    for name in (n for n in listed if n not in WHOLE and not n.endswith(OF_ORDERS)):
        if name.endswith("_order"):
            beside = [f"{name.removesuffix('order')}{end}" for end in ("phase", "largest_order")]
        else:
            beside = [f"{part}{name}" for part in PARTS] + [f"{name}{end}" for end in OF_A_CURVE]
        if kept := [n for n in beside if n in listed and n not in OTHER_WORDS]:
            found[name] = kept
    return found


def _quantity_table(names: Iterable[str]) -> str:
    rows = []
    listed = sorted(names)
    folded = _folded(listed)
    inside = {name for kept in folded.values() for name in kept}
    for name in (n for n in listed if n not in inside):
        node = QUANTITIES[name]
        unit = node.unit or "N m s^alpha"
        symbol = node.symbol.replace("|", r"\vert ")  # `|` would end the cell
        over = ", ".join(f"`{d}`" for d in DIMENSIONS if d in dimensions(name))
        also = [word for word in OTHER_WORDS.get(name, "").split(", ") if word != node.long_name]
        meaning = node.long_name.replace(TURNING, "") + (f", ${symbol}$" if symbol else "")
        beside = [m for n in (name, *folded.get(name, ())) for m in folded.get(n, ())]
        if unit != "1":
            meaning = f"[{unit}] {meaning}"
        rows.append([
            f"`{name}`",
            with_notes(
                meaning, over=over, also=", ".join(also),
                **{"and": ", ".join(f"`{n}`" for n in beside)},
            ),
        ])  # fmt: skip
    return markdown([["quantity", "[unit] meaning"], *rows])


def dimensions(name: str) -> set[str]:
    """Dimensions that a quantity has beside the axes of a scene; `sweeps.scene.plan` adds those."""
    if name in DIMENSIONS:
        return {name}
    node = NODES[name][0]
    found = set(node.adds)
    if node.kind == "curve" and "close_angle" not in found:
        found.add("crank_angle")
    for need in node.needs:
        # Stages take curves whole: only their results name the dimension.
        found |= set() if node.kind == "stage" else dimensions(need)
    return found - set(node.removes)


def axes() -> str:
    """Axes that curves have beside those of a scene."""
    rows = [["axis", "symbol", "unit", "meaning"]]
    for name, axis in ((n, d) for n, d in DIMENSIONS.items() if d.public):
        symbol = f"${axis.symbol}$" if axis.symbol else ""
        rows.append([f"`{name}`", symbol, "" if axis.unit == "1" else axis.unit, axis.long_name])
    return markdown(rows)


def quantity_file() -> str:
    """Every quantity with its source."""
    heads = ["quantity", "symbol", "unit", "over", "meaning", "synonyms", "source"]
    rows = [
        [name, symbol_text(node.symbol), node.unit or "N m s^alpha",
         " ".join(d for d in DIMENSIONS if d in dimensions(name)),
         node.long_name, OTHER_WORDS.get(name, ""), node.source]
        for name, node in sorted(QUANTITIES.items())
    ]  # fmt: skip
    return csv_text([heads, *rows])


def source_file() -> str:
    """Full citations of the sources that quantities and keys name in short."""
    return csv_text([("name", "source"), *SOURCES.items()])


def range_file() -> str:
    """Usual ranges of plausibility checks, with their sources."""
    rows = [
        [check.name, check.what, f"{check.low:g}", f"{check.high:g}", check.unit, check.source]
        for check in (*CHECKS, *DIAGRAM_CHECKS, *RESULT_CHECKS)
    ]
    return csv_text([["name", "measure", "lowest", "highest", "unit", "source"], *rows])


def outcomes() -> str:
    """Outcomes of a design."""
    rows = [["status", "name", "meaning", "results hold", "what to do"]]
    for code, name in enumerate(MEANINGS):
        holds, told = "numbers" if has_numbers(code) else "NaN", OUTCOMES[name]
        if code in (STOPPED, NOT_STARTED, RUNAWAY):
            holds = "numbers up to then"
        rows.append([str(code), f"`{name}`", told["meaning"], holds, told["what to do"]])
    return markdown(rows)


def engines() -> str:
    """Engines of the catalogue; each name leads to its file, which has the sources."""
    rows = []
    for name, path in catalogue().items():
        engine = load_engine(name, Path())
        raw = tomllib.loads(path.read_text(encoding="utf-8"))
        order = "-".join(str(cylinder) for cylinder in engine.firing_order or ())
        cylinders = engine.values["cylinders"]
        layout = str(raw.get("arrangement", f"in-line {cylinders:g}")).removesuffix(f" {order}")
        kind = f"{layout}, {order}" if cylinders > 1 else "single cylinder"
        size = " x ".join(f"{1e3 * engine.values[key]:.4g}" for key in ("bore", "stroke"))
        diagrams = ", ".join(f"`{kind}`" for kind in {one["kind"]: 0 for one in raw["diagram"]})
        loads = ", ".join(f"{load:g}" for load in engine.family.loads)
        file = path.relative_to(ROOT).as_posix()
        rows.append([
            f"[`{name}`](../{file})", engine.title, f"{raw['cycle']}, {kind}", size,
            f"{engine.values['speed']:g}", f"{diagrams} at {loads} %",
        ])  # fmt: skip
    heads = ["engine", "what it is", "cycle, layout, firing order", "bore x stroke (mm)",
             "speed (rpm)", "diagrams at load"]  # fmt: skip
    return markdown([heads, *rows])


def scenes() -> str:
    """Scenes that come with the package."""
    return markdown([["scene", "title"], *([f"`{name}`", t] for name, t in LISTS["scenes"]())])


CRANKSHAFT = ("fmep_crankshaft_seals", "fmep_main_bearings", "fmep_crank_pin_bearings")
PISTONS = ("fmep_skirt", "fmep_rings", "fmep_ring_gas_pressure")
OTHERS = ("fmep_valve_train", "fmep_auxiliaries", "fmep_components")


def friction() -> str:
    """Friction by component of an engine of the catalogue: a speed each."""
    names = [*CRANKSHAFT, *PISTONS, *OTHERS]
    speeds = (1500, 2000, 3000, 4000, 5200)
    found = sweeps.run(
        engine="si_four_87x101",
        silenced_warnings=["diagram_speeds"],
        axes={"speed": speeds},
        output={"quantities": names},
    )

    def row(one: xr.Dataset) -> list[str]:
        crankshaft, pistons = (sum(float(one[n]) for n in group) for group in (CRANKSHAFT, PISTONS))
        valves, auxiliaries, total = (float(one[name]) for name in OTHERS)
        shares = f"{crankshaft / valves:.2f}", f"{pistons / (crankshaft + valves):.2f}"
        speed, last = f"{float(one['speed']):g}", f"{100.0 * auxiliaries / total:.0f}"
        return [speed, f"{total:.3f}", *shares, last]

    return markdown([
        ["speed, rpm", "sum, bar", "crankshaft over valve train",
         "pistons over crankshaft and valve train", "auxiliaries, %"],
        ["published", "", "1.5 to 2", "about 1", "20 to 30"],
        *(row(found.sel(speed=speed)) for speed in speeds),
    ])  # fmt: skip


EXAMPLES = ("printed", "by the formula", "ours", "who is wrong, and why")
"""Columns of worked examples after example and value; the file has all columns."""


def examples() -> str:
    """Printed values of worked examples, by subject; an example's name only in its first row."""
    found: dict[str, list[list[str]]] = {}
    before = None
    for row in csv_rows(DOCS / "worked_examples.csv"):
        if not row["printed"]:
            continue
        unit = "" if row["unit"] == "1" else f" [{row['unit']}]"
        row["ours"] = row["ours"] or "waits"
        label = "" if row["example"] == before else row["example"]
        before = row["example"]
        cells = [label, row["value"] + unit, *(row[head] for head in EXAMPLES)]
        found.setdefault(row["subject"], [["example", "value", *EXAMPLES]]).append(cells)
    return "\n\n".join(f"## {subject}\n\n{markdown(rows)}" for subject, rows in found.items())


def crossings() -> str:
    """Features that are refused together, and what is replaced, from `sweeps.scene.crossings`."""
    found: dict[tuple[str, str], list[str]] = {}
    for feature, other, says in CROSSINGS:
        why = says.replace("engine {engine}", "the engine").replace(" ({labels})", "")
        why = re.sub(rf"^(?:{NOT_WITH} [^,;:]*|not allowed(?= here|:)|)(?: here)?[,;:]? ?", "", why)
        found.setdefault((feature, why), []).append(other)
    refused = [(feature, ", ".join(others), why) for (feature, why), others in found.items()]
    refused += [(f"`{key}`", f"`{'`, `'.join(keys)}`", why) for key, keys, why in KEY_PAIRS]
    tables = (
        [("what a scene has", "is refused with", "why, and what to do"), *refused],
        [("what a scene gives", "replaces"), *REPLACED],
    )
    # Names of tables in brackets would become links.
    return re.sub(r"(\[\[?\w+\]\]?)", r"`\1`", "\n\n".join(markdown(rows) for rows in tables))


def of_the_checkout(make: Callable[[], str]) -> Callable[[], str]:
    """The same tables by names alone."""
    return lambda: key_tables.names_only(make())


KEYS: Mapping[str, Callable[[], str]] = {
    "keys": key_tables.number_table,
    "scene tables": key_tables.scene_tables,
    "engine tables": key_tables.engine_tables,
}

DOCUMENTS: Mapping[Path, Mapping[str, Callable[[], str]]] = {
    DOCS / "keys.md": {name: of_the_checkout(make) for name, make in KEYS.items()},
    DOCS / "quantities.md": {"axes": axes},
    DOCS / "status_codes.md": {"outcomes": outcomes},
    DOCS / "engines.md": {"engines": engines},
    DOCS / "scenes.md": {"scenes": scenes},
    DOCS / "friction.md": {"breakdown": friction},
    DOCS / "limits.md": {"crossings": crossings},
}
"""Pages, and the tables in each; those of keys by names alone."""

OF_THE_SITE: Mapping[str, Mapping[str, Callable[[], str]]] = {
    "keys": KEYS,
    "quantities": {"quantities": quantities},
    "worked_examples": {"examples": examples},
}
"""Pages whose tables are made when the site is built: a CSV file has the same rows already."""

FILES: Mapping[Path, Callable[[], str]] = {
    DOCS / "keys.csv": key_tables.file,
    DOCS / "quantities.csv": quantity_file,
    DOCS / "sources.csv": source_file,
    DOCS / "plausibility_ranges.csv": range_file,
}
"""Files whose whole text is made."""


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


if __name__ == "__main__":
    pages = {
        path: updated(path.read_text(encoding="utf-8"), made) for path, made in DOCUMENTS.items()
    }
    write(pages | {path: make() for path, make in FILES.items()})
