"""Write the tables of the documentation that come from the tables in the code.

Each stands between two comments, `<!-- begin NAME: ... -->` and `<!-- end NAME -->`; everything in
between is replaced. Longer ones are CSV files; `docs/conf.py` shows some of these as tables of the
site. Run it from the project's root: `python tools/reference_tables.py`.
"""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

import xarray as xr
from pages import DOCS, ROOT, csv_rows, csv_text, markdown, write

import sweeps
from engine_dyn.plausibility.usual_ranges import CHECKS, DIAGRAM_CHECKS, RESULT_CHECKS
from engine_dyn.quantities.graph import (
    DIMENSIONS,
    NODES,
    NUMBERED,
    PARAMETERS,
    PATTERNS,
    QUANTITIES,
)
from engine_dyn.quantities.shaft_numbers import OF_SHAFT
from engine_dyn.quantities.sources import SOURCES
from engine_dyn.status import MEANINGS, has_numbers
from sweeps.presenting.key_texts import WORDS_OF_KEYS, default_text, values_text
from sweeps.presenting.lists import LISTS, symbol_text
from sweeps.presenting.quantity_search import OTHER_WORDS, SUBJECTS
from sweeps.reading.engine_files import catalogue, load_engine
from sweeps.scene.engine_schema import engine_schema
from sweeps.scene.json_schema import scene_schema
from sweeps.scene.schema_parts import Schema

OUTCOMES = {row["name"]: row for row in csv_rows(Path(__file__).with_name("outcomes.csv"))}
"""What the outcomes of `engine_dyn.status` mean for a person, and what to do about each."""


def with_notes(meaning: str, **notes: str) -> str:
    """A meaning, and below it in small print what else there is: narrow tables fit a phone."""
    small = "; ".join(f"{head}: {text}" for head, text in notes.items() if text)
    return f"{meaning}<br><small>{small}</small>" if small else meaning


KEY_HEADS = ("key", "unit", "meaning", "synonyms", "default", "allowed", "stands in")


def key_rows() -> list[dict[str, str]]:
    """Keys of scenes and of an engine file's [values] that are numbers or names."""
    rows = []
    scene = scene_schema()
    free, columns = (_abouts(scene, _resolved(scene, scene["properties"][name]))
                     for name in ("set", "designs"))  # fmt: skip
    engine = engine_schema()
    of_engine = _abouts(engine, _resolved(engine, engine["properties"]["values"]))
    nodes = {k: node for k, node in PARAMETERS.items() if k not in NUMBERED} | dict(PATTERNS)
    for name, node in nodes.items():
        one = name.replace("_N", "_2")
        where = ["scene"] if one in free else ["[solver]", "[designs]"]
        if one not in columns:
            raise ValueError(f"{name}: no column of [designs]")
        if name in of_engine:
            where.append("engine file")
        unit = "" if node.unit == "1" else node.unit
        rule = values_text(node, "`").replace(f" [{node.unit}]", "").removeprefix("a finite number")
        cells = (
            name, unit, node.long_name, WORDS_OF_KEYS.get(name, ""), default_text(node),
            rule.strip() or "any number", ", ".join(where),
        )  # fmt: skip
        rows.append(dict(zip(KEY_HEADS, cells, strict=True)))
    return rows


def keys() -> str:
    """The same as a table: of what is allowed, only names. Those of a shaft stand with [shaft]."""
    rows = []
    for row in key_rows():
        if row["key"].replace("_N", "_1") in OF_SHAFT:
            continue
        anywhere = row["stands in"] == "scene, engine file" or row["key"] in PATTERNS
        only = "" if anywhere else row["stands in"]
        rule = row["allowed"]
        names = rule if rule.startswith("one of") else "".join(rule.partition("a name")[1:])
        meaning = with_notes(
            row["meaning"], also=row["synonyms"],
            default=f"`{row['default']}`" if f"`{row['default']}`" in names else row["default"],
            allowed=names, **{"only in": only},
        )  # fmt: skip
        unit = f"[{row['unit']}] " if row["unit"] else ""
        rows.append([f"`{row['key']}`", unit + meaning])
    return markdown([["key", "[unit] meaning"], *rows])


def key_file() -> str:
    """Every such key, with its range."""
    rows = [[row[head].replace("`", "") for head in KEY_HEADS] for row in key_rows()]
    return csv_text([KEY_HEADS, *rows])


def scene_tables() -> str:
    """Every table of a scene with its keys, from the schema that editors check scenes with."""
    return _tables(scene_schema(), "scene", {})


def engine_tables() -> str:
    """Tables of an engine file with their keys; those that a scene has too stand there."""
    scene = scene_schema()
    known = _abouts(scene, scene) | _abouts(scene, _resolved(scene, scene["properties"]["set"]))
    return _tables(engine_schema(), "engine file", known)


def _abouts(schema: Schema, part: Schema) -> dict[str, str]:
    """What each key of a part is."""
    return {
        key: _about({**_resolved(schema, given), **given})
        for key, given in part.get("properties", {}).items()
    }


def _tables(schema: Schema, what: str, known: Mapping[str, str]) -> str:
    """Tables with their keys. What stood in an earlier one is only named again."""
    top = _resolved(schema, schema)
    again = [key for key, about in _abouts(schema, top).items() if known.get(key) == about]
    parts: list[str] = []
    listed_in: dict[tuple[str, str], str] = {}
    headed: list[str] = []
    for name, given in top["properties"].items():
        one = _resolved(schema, given)
        if name in again and name not in ("arrangement", "articulated_rods"):
            continue
        listed = "items" in one
        choices = [one["items"]] if listed else [one]
        choices = [c for choice in choices for c in choice.get("oneOf", [choice])]
        shown = f"`[[{name}]]`" if listed else f"`[{name}]`"
        tables = [_resolved(schema, choice) for choice in choices]
        if len(tables) > 1:
            parts.append(f"### {shown}\n\n{_table_of_kinds(schema, tables)}\n")
            headed.append(name)
            continue
        abouts = _abouts(schema, tables[0])
        before = {key: listed_in[key, about] for key, about in abouts.items()
                  if (key, about) in listed_in and key not in PARAMETERS}  # fmt: skip
        listed_in |= {(key, about): shown for key, about in abouts.items() if key not in before}
        if rows := _schema_table(schema, tables[0], leave=list(before)):
            parts.append(f"### {shown}\n\n{rows}\n")
            headed.append(name)
            for place in dict.fromkeys(before.values()):
                same = ", ".join(f"`{key}`" for key, of in before.items() if of == place)
                parts.append(f"As in {place}: {same}.\n")
        for inner, described in tables[0].get("properties", {}).items():
            if name not in ("arrangement", "shaft") or "items" not in described:
                continue
            items = _resolved(schema, described["items"])
            part = inner.removesuffix("s")  # whose numbers are keys, such as disc_inertia_N
            numbers = [key for key in items.get("properties", ()) if f"{part}_{key}_N" in PATTERNS]
            if inner_rows := _schema_table(schema, items, leave=numbers):
                parts.append(f"### `{inner}` of `[{name}]`\n\n{inner_rows}\n")
            if numbers:
                same = ", ".join(
                    f"`{key}`" + f" [{unit}]" * (unit != "1")
                    for key in numbers
                    for unit in [PATTERNS[f"{part}_{key}_N"].unit]
                )
                parts.append(f"Numbers, each also a key such as `{part}_{numbers[0]}_2`: {same}.\n")
    # An arrangement may be a text as well, so its row stays.
    leave = [*again, *(name for name in headed if name != "arrangement")]
    first = f"### At the top of the {what}\n\n{_schema_table(schema, top, leave=leave)}\n"
    if again:
        first += f"\nAs in a scene or its `[set]`: {', '.join(f'`{key}`' for key in again)}.\n"
    return "\n".join([first, *parts])


def _table_of_kinds(schema: Schema, tables: Sequence[Schema]) -> str:
    """Keys of a table of several kinds, once each, with the kinds that need or take it."""
    kinds = [one["properties"]["kind"]["const"] for one in tables]
    about: dict[str, str] = {}
    needed: dict[str, list[str]] = {}
    taken: dict[str, list[str]] = {}
    for kind, one in zip(kinds, tables, strict=True):
        for key, given in one["properties"].items():
            if key == "kind":
                continue
            part = {**_resolved(schema, given), **given}
            text = _about(part) + (f"; by default {shown}" if (shown := _default(part)) else "")
            about[key] = max(about.get(key, ""), text, key=len)
            (needed if key in one.get("required", ()) else taken).setdefault(key, []).append(kind)

    def named(found: Sequence[str]) -> str:
        if len(found) == len(kinds):
            return "all"
        return ", ".join(f"`{kind}`" for kind in found)

    rows = [
        [f"`{key}`", text, named(needed.get(key, ())), named(taken.get(key, ()))]
        for key, text in about.items()
    ]
    return markdown([["key", "what it is", "needed by", "taken by"], *rows])


def _resolved(schema: Schema, part: Schema) -> Schema:
    """A part of a schema with what it refers to; of several choices, those with keys."""
    while "$ref" in part:
        rest = {key: value for key, value in part.items() if key != "$ref"}
        part = {**schema["$defs"][part["$ref"].rpartition("/")[2]], **rest}
    if "properties" in part:
        return part
    choices = [_resolved(schema, one) for one in part.get("anyOf", ())]
    tables = [one for one in choices if "properties" in one]
    if len(tables) > 1:  # either these keys or those: none is required
        return {"properties": {k: v for one in tables for k, v in one["properties"].items()}}
    return tables[0] if tables else part


def _about(one: Schema) -> str:
    """What a key is, with the words it may have."""
    about = str(one.get("description", ""))
    if any(word not in about for word in one.get("enum", ())):
        about += f"; one of {', '.join(f'`{word}`' for word in one['enum'])}"
    return about.replace("|", "\\|")


def _default(one: Schema) -> str:
    """The value that holds without a key; nothing where there is none to show."""
    default = one.get("default")
    empty = default in (None, [], {}) or isinstance(default, dict)
    return "" if empty else f"`{json.dumps(default)}`"


def _schema_table(schema: Schema, part: Schema, leave: Sequence[str] = ()) -> str:
    """Keys of a table that are not among the numbers; nothing where there are none."""
    rows = []
    numbers = set(PARAMETERS) - NUMBERED
    varied = len(set(part.get("properties", ())) & numbers) > len(numbers) / 3
    for key, given in part.get("properties", {}).items():
        one = {**_resolved(schema, given), **given}
        if (varied and key in PARAMETERS) or "const" in one or key in leave:
            continue
        shown = _default(one)
        needed = "required" if key in part.get("required", ()) else shown and f"by default {shown}"
        rows.append([f"`{key}`", _about(one) + (f"; {needed}" if needed else "")])
    return markdown([["key", "what it is"], *rows]) if rows else ""


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
"""Said once for all torques, at the top of the page."""


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
        symbol = node.symbol.replace("|", r"\vert ")  # which would end the cell
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
    """Dimensions that a quantity has beside the axes of a scene; `sweeps.planning` adds those."""
    if name in DIMENSIONS:
        return {name}
    node = NODES[name][0]
    found = {*node.adds, "crank_angle"} if node.kind == "curve" else set(node.adds)
    for need in node.needs:
        # Stages take curves whole: only their results name the dimension.
        found |= set() if node.kind == "stage" else dimensions(need)
    return found - set(node.removes)


def axes() -> str:
    """Axes that curves have beside those of a scene."""
    rows = [["axis", "symbol", "unit", "meaning"]]
    for name, axis in DIMENSIONS.items():
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
        engine="si_four_87x101", axes={"speed": speeds}, output={"quantities": names}
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


DOCUMENTS: Mapping[Path, Mapping[str, Callable[[], str]]] = {
    DOCS / "keys.md": {
        "keys": keys,
        "scene tables": scene_tables,
        "engine tables": engine_tables,
    },
    DOCS / "quantities.md": {"axes": axes},
    DOCS / "status_codes.md": {"outcomes": outcomes},
    DOCS / "engines.md": {"engines": engines},
    DOCS / "scenes.md": {"scenes": scenes},
    DOCS / "friction.md": {"breakdown": friction},
}
"""Pages, and the tables in each."""

OF_THE_SITE: Mapping[str, Mapping[str, Callable[[], str]]] = {
    "quantities": {"quantities": quantities},
}
"""Pages whose tables are made when the site is built: a CSV file has the same rows already."""

FILES: Mapping[Path, Callable[[], str]] = {
    DOCS / "keys.csv": key_file,
    DOCS / "quantities.csv": quantity_file,
    DOCS / "sources.csv": source_file,
    DOCS / "plausibility_ranges.csv": range_file,
}
"""Files that are made whole."""


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
