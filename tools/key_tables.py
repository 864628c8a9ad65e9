"""Keys of scenes and engine files: rows of docs/keys.csv, and the tables that the site shows."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping, Sequence

from pages import csv_text, markdown, with_notes

from engine_dyn.quantities.graph import NUMBERED, PARAMETERS, PATTERNS
from engine_dyn.quantities.shaft_numbers import OF_SHAFT
from sweeps.scene.json_schema import Schema, engine_schema, scene_schema
from sweeps.view.texts.key_texts import WORDS_OF_KEYS, default_text, values_text

Row = dict[str, str]
"""A key as a row of the file: cell by head."""

HEADS = (
    "key", "unit", "meaning", "synonyms", "default", "allowed", "needed by", "taken by", "stands in"
)  # fmt: skip
"""Heads of a table of keys; kinds of the table, or all without kinds, need or take a key."""


def number_rows() -> list[Row]:
    """Keys of scenes and of an engine file's [values] that are numbers or names."""
    rows = []
    scene = scene_schema()
    free, columns = (_resolved(scene, scene["properties"][name])["properties"]
                     for name in ("set", "designs"))  # fmt: skip
    engine = engine_schema()
    of_engine = _resolved(engine, engine["properties"]["values"])["properties"]
    nodes = {k: node for k, node in PARAMETERS.items() if k not in NUMBERED} | dict(PATTERNS)
    for name, node in nodes.items():
        one = name.replace("_N", "_2")
        where = ["scene"] if one in free else ["[solver]", "[designs]"]
        if one not in columns:
            raise ValueError(f"{name}: no column of [designs]")
        if one in of_engine:
            where.append("engine file")
        unit = "" if node.unit == "1" else node.unit
        rule = values_text(node, "`").replace(f" [{node.unit}]", "").removeprefix("a finite number")
        cells = (
            name, unit, node.long_name, WORDS_OF_KEYS.get(name, ""), default_text(node),
            rule.strip() or "any number", "", "", ", ".join(where),
        )  # fmt: skip
        rows.append(dict(zip(HEADS, cells, strict=True)))
    return rows


def number_table() -> str:
    """The same as a table: of what is allowed, only names. Those of a shaft stand with [shaft]."""
    rows = []
    for row in number_rows():
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


def tables(schema: Schema, what: str) -> dict[str, list[Row]]:
    """Keys of every table by the place where it stands; [set] and its like without numbers."""
    top = _resolved(schema, schema)
    found = {f"the top of the {what}": _rows(schema, top)}
    for name, given in top["properties"].items():
        one = _resolved(schema, given)
        choices = [one["items"]] if "items" in one else [one]
        choices = [c for choice in choices for c in choice.get("oneOf", [choice])]
        place = f"`[[{name}]]`" if "items" in one else f"`[{name}]`"
        parts = [_resolved(schema, choice) for choice in choices]
        several = len(parts) > 1
        found[place] = _rows_of_kinds(schema, parts) if several else _rows(schema, parts[0])
        for inner, described in parts[0].get("properties", {}).items():
            if name in ("arrangement", "shaft") and "items" in described:
                items = _resolved(schema, described["items"])
                found[f"`{inner}` of {place}"] = _rows(schema, items, inner.removesuffix("s"))
    return {place: rows for place, rows in found.items() if rows}


def _rows(schema: Schema, part: Schema, of: str = "") -> list[Row]:
    """Keys of a table; those of an item `of` a list may also be numbers, as `disc_inertia_N`."""
    rows = []
    known = set(PARAMETERS) - NUMBERED
    varied = len(set(part.get("properties", ())) & known) > len(known) / 3
    for key, given in part.get("properties", {}).items():
        one = {**_resolved(schema, given), **given}
        if (varied and key in PARAMETERS) or "const" in one:
            continue
        unit, meaning = "", _about(one)
        if number := PATTERNS.get(f"{of}_{key}_N"):
            unit, meaning = number.unit.removeprefix("1"), number.long_name
        by = ("all", "") if key in part.get("required", ()) else ("", "all")
        cells = (key, unit, meaning, "", _default(one), "", *by, "")
        rows.append(dict(zip(HEADS, cells, strict=True)))
    return rows


def _rows_of_kinds(schema: Schema, parts: Sequence[Schema]) -> list[Row]:
    """Keys of a table of several kinds, once each, with the kinds that need or take it."""
    found: dict[str, Row] = {}
    kinds: dict[str, dict[str, list[str]]] = {}
    for part in parts:
        kind = part["properties"]["kind"]["const"]
        for row in _rows(schema, part):
            key, by = row["key"], "needed by" if row["needed by"] else "taken by"
            found[key] = max(found.get(key, row), row, key=_text_length)
            kinds.setdefault(key, {}).setdefault(by, []).append(f"`{kind}`")
    for key, row in found.items():
        row |= {"needed by": "", "taken by": ""}
        for by, named in kinds[key].items():
            row[by] = "all" if len(named) == len(parts) else ", ".join(named)
    return list(found.values())


def _text_length(row: Row) -> int:
    return len(row["meaning"] + row["default"])


def _resolved(schema: Schema, part: Schema) -> Schema:
    """A part of a schema with what it refers to; of several choices, those with keys."""
    while "$ref" in part:
        rest = {key: value for key, value in part.items() if key != "$ref"}
        part = {**schema["$defs"][part["$ref"].rpartition("/")[2]], **rest}
    if "properties" in part:
        return part
    choices = [_resolved(schema, one) for one in part.get("anyOf", ())]
    parts = [one for one in choices if "properties" in one]
    if len(parts) > 1:  # either these keys or those: none is required
        return {"properties": {k: v for one in parts for k, v in one["properties"].items()}}
    return parts[0] if parts else part


def _about(one: Schema) -> str:
    """Meaning of a key, with the words that it may have."""
    about = str(one.get("description", ""))
    if any(word not in about for word in one.get("enum", ())):
        about += f"; one of {', '.join(f'`{word}`' for word in one['enum'])}"
    return about


def _default(one: Schema) -> str:
    """Default value of a key; empty where there is none to show."""
    default = one.get("default")
    empty = default in (None, [], {}) or isinstance(default, dict)
    return "" if empty else f"`{json.dumps(default)}`"


def rows() -> list[Row]:
    """Every key once for each meaning, with all places where it stands."""
    numbers = number_rows()
    listed = {(row["key"], place) for row in numbers for place in row["stands in"].split(", ")}
    found: dict[tuple[str, ...], list[str]] = {}
    for schema, what in ((scene_schema(), "scene"), (engine_schema(), "engine file")):
        for place, of_table in tables(schema, what).items():
            for row in (r for r in of_table if (r["key"], place.strip("`")) not in listed):
                found.setdefault(tuple(row[head] for head in HEADS[:-1]), []).append(place)
    return [
        *numbers,
        *(dict(zip(HEADS, (*cells, ", ".join(dict.fromkeys(places))), strict=True))
          for cells, places in found.items()),
    ]  # fmt: skip


def file() -> str:
    """The same as a file."""
    return csv_text([HEADS, *([row[head].replace("`", "") for head in HEADS] for row in rows())])


def scene_tables() -> str:
    """Every table of a scene with its keys, from the schema that editors check scenes with."""
    return _text(tables(scene_schema(), "scene"), {})


def engine_tables() -> str:
    """Tables of an engine file with their keys; those that a scene has too stand there."""
    scene = tables(scene_schema(), "scene")
    known = {
        row["key"]: row["meaning"]
        for place in ("the top of the scene", "`[set]`")
        for row in scene[place]
    }
    return _text(tables(engine_schema(), "engine file"), known)


def _text(found: Mapping[str, Sequence[Row]], known: Mapping[str, str]) -> str:
    """Tables with their keys. What stood in an earlier one is only named again."""
    (top, of_top), *others = found.items()
    again = [row["key"] for row in of_top if known.get(row["key"]) == row["meaning"]]
    parts: list[str] = []
    listed_in: dict[tuple[str, str], str] = {}
    headed = set()
    for place, of_table in others:
        part, inner, _ = place.strip("`").partition("s` of ")
        name = re.findall(r"\w+", place)[-1]  # such as `shaft`, from "`discs` of `[shaft]`"
        if name in again and name not in ("arrangement", "articulated_rods"):
            continue
        before = {row["key"]: listed_in[row["key"], row["meaning"]] for row in of_table
                  if (row["key"], row["meaning"]) in listed_in}  # fmt: skip
        if not inner and not _of_kinds(of_table):
            listed_in |= {(row["key"], row["meaning"]): place for row in of_table
                          if row["key"] not in (*before, *PARAMETERS)}  # fmt: skip
        numbers = [row for row in of_table if inner and f"{part}_{row['key']}_N" in PATTERNS]
        if rest := [r for r in of_table if r["key"] not in before and r not in numbers]:
            parts.append(f"### {place}\n\n{_table(rest)}\n")
            headed.add(name)
            for other in dict.fromkeys(before.values()):
                same = ", ".join(f"`{key}`" for key, of in before.items() if of == other)
                parts.append(f"As in {other}: {same}.\n")
        if numbers:
            units = {row["key"]: f" [{row['unit']}]" if row["unit"] else "" for row in numbers}
            same = ", ".join(f"`{key}`{unit}" for key, unit in units.items())
            also = f"`{part}_{next(iter(units))}_2`"
            parts.append(f"Numbers, each also a key such as {also}: {same}.\n")
    # An arrangement may be a text as well, so its row stays.
    leave = {*again, *headed - {"arrangement"}}
    first = f"### At {top}\n\n{_table(row for row in of_top if row['key'] not in leave)}\n"
    if again:
        first += f"\nAs in a scene or its `[set]`: {', '.join(f'`{key}`' for key in again)}.\n"
    return "\n".join([first, *parts])


def _of_kinds(rows: Iterable[Row]) -> bool:
    """Whether a table has several kinds."""
    return any(row[by] not in ("", "all") for row in rows for by in ("needed by", "taken by"))


def _table(rows: Iterable[Row]) -> str:
    """Keys of a table, with the kinds where it has several."""
    rows = list(rows)
    by_kinds = _of_kinds(rows)
    lines = []
    for row in rows:
        text = row["meaning"].replace("|", "\\|")
        if row["needed by"] and not by_kinds:
            text += "; required"
        elif row["default"]:
            text += f"; by default {row['default']}"
        kinds = [row["needed by"], row["taken by"]] if by_kinds else []
        lines.append([f"`{row['key']}`", text, *kinds])
    heads = ["needed by", "taken by"] if by_kinds else []
    return markdown([["key", "what it is", *heads], *lines])


def names_only(text: str) -> str:
    """Text in which tables are lists of their rows' first cells, as in the checkout's pages."""

    def names(table: re.Match[str]) -> str:
        first = [line.split(" | ")[0].removeprefix("| ") for line in table[0].splitlines()[2:]]
        return ", ".join(first) + "."

    return re.sub(r"(?m)^\|.*(?:\n\|.*)*", names, text)
