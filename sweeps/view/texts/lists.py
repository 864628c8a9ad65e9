"""Lists to choose from: engines, scenes, keys and others, each with names and texts."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path

from engine_dyn.quantities.graph import NUMBERED, PARAMETERS, PATTERNS, SOURCES
from sweeps.base.ratios import ratio_text
from sweeps.scene.axes import WORD_KEYS
from sweeps.scene.engine.cylinder_keys import CYLINDER_KEYS
from sweeps.scene.engine.engine_files import catalogue
from sweeps.scene.features import KEYS_OF_SET
from sweeps.scene.features.shaft import built_in_shafts
from sweeps.scene.reading import built_in_scenes
from sweeps.view.texts.key_texts import WORDS_OF_KEYS, key_line
from sweeps.view.texts.quantity_search import matching_lines, matching_quantities

Lines = list[tuple[str, str]]


def symbol_text(symbol: str) -> str:
    r"""Write a symbol of TeX in plain letters: ``\beta_\nu`` becomes beta_nu, ``M_{max}`` M_max."""
    text = symbol.replace(r"\var", "\\")  # variants of a letter have its name
    text = text.replace("^*", "*")
    # The name of a sign is set apart from a letter, digit or brace before it, not from _ and ^.
    text = re.sub(r"(?<=[A-Za-z0-9}])\\", " ", text)
    text = re.sub(r"\^\{([^{}]*)\}", r"^(\1)", text)
    return re.sub(r"[\\{}]", "", text)


def quantity_lines(words: str = "") -> list[str]:
    """Lines of the quantities that words lead to, grouped by subject; without words of all."""
    groups, note = matching_quantities(words)
    width = max(len(node.name) for nodes in groups.values() for node in nodes)
    lines: list[str] = [f"# {note}"] if note else []
    for subject, nodes in groups.items():
        lines += ["", f"# {subject}"] if lines else [f"# {subject}"]
        for node in nodes:
            # The unit of the load coefficient depends on the load exponent: the table has none.
            unit = node.unit or "unit follows the load exponent"
            symbol = f", {symbol_text(node.symbol)}" if node.symbol else ""
            source = f" ({node.source})" if node.source else ""
            lines.append(f"{node.name:<{width}}  [{unit}] {node.long_name}{symbol}{source}")
    if not words:
        lines += ["", "# full citations of the sources in brackets: engine-dyn list sources"]
        lines += ["# axes of curves, such as order: engine-dyn list quantities axes of curves"]
        lines += ["# and of every curve over crank_angle its <curve>_rms and <curve>_mean"]
    return lines


def _keys() -> Lines:
    nodes = {k: node for k, node in PARAMETERS.items() if k not in NUMBERED} | dict(PATTERNS)
    keys = [(key, key_line(node)) for key, node in nodes.items()]
    others = {**CYLINDER_KEYS, **{k: w.says for k, w in WORD_KEYS.items() if w.read is not None}}
    return [*keys, *others.items(), *((key, one.says) for key, one in KEYS_OF_SET.items())]


def _classes() -> Lines:
    thesis, lecture = "Kakaitsas (2015), section 3.2.1", "Power units, lecture 18"
    return [
        (name, f"delta {ratio_text(limit)} ({lecture if 'road' in name else thesis})")
        for name, limit in PARAMETERS["wanted_delta"].named
    ]


def _titles(files: Mapping[str, Path]) -> Lines:
    """Titles of files of ours; they are read as far as that, since an engine models its cycles."""
    return [
        (name, tomllib.loads(path.read_text(encoding="utf-8"))["title"])
        for name, path in files.items()
    ]


LISTS: dict[str, Callable[[], Lines]] = {
    "engines": lambda: _titles(catalogue()),
    "scenes": lambda: _titles(built_in_scenes()),
    "shafts": lambda: _titles(built_in_shafts()),
    "keys": _keys,
    "classes": _classes,
    "sources": lambda: list(SOURCES.items()),
}
"""Lists of `engine-dyn list` besides quantities, with the functions that make their lines."""


def list_lines(of: str, words: str = "") -> list[str]:
    """Lines of one of `LISTS` that words lead to; without words of all."""
    lines = dict(LISTS[of]())
    more = WORDS_OF_KEYS if of == "keys" else {}
    matches = matching_lines(
        words, {n: f"{text} {more.get(n, '')}" for n, text in lines.items()}, of
    )
    width = max(len(name) for name in matches.names)
    told = [f"# {matches.note}"] if matches.note else []
    return [*told, *(f"{name:<{width}}  {lines[name]}" for name in matches.names)]
