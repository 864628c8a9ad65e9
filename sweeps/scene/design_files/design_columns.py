"""Columns of a table of designs, gathered piece by piece and checked the same in every format.

Tables have millions of rows: columns are kept as arrays, and a row is looked at by itself only to
say what is wrong with it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from engine_dyn.quantities.graph import ALL_QUANTITIES, PARAMETERS
from engine_dyn.quantities.node import Node
from engine_dyn.types import Floats
from sweeps.base.checks import allowed, check_range, is_ratio, known_key, number, outside
from sweeps.base.dimensions import DESIGN, EXPLAINED, HIGH, LABELS, LOW, PUBLISHED, SEARCHED
from sweeps.base.errors import SceneError, counted, did_you_mean, not_known, one_line, shown
from sweeps.base.files.numbers_with_units import number_with_unit
from sweeps.scene.toml_tables import DesignTable
from sweeps.scene.whole_keys import check_of_designs

ROWS = 1 << 18  # Rows of a netCDF or Parquet file that are read at a time


@dataclass
class DesignColumns:
    """Columns as they are read, piece by piece."""

    name: str
    nodes: Mapping[str, Node | None]
    # Factors from the units that a file states to those of scenes, where they differ
    factors: Mapping[str, float] = field(default_factory=dict)
    results: Sequence[str] = ()  # Columns of results, which are left out
    pieces: dict[str, list[Floats]] = field(default_factory=dict)
    texts: dict[str, list[str]] = field(default_factory=dict)

    def take(self, key: str, values: Any) -> None:
        """Append a piece of a column: numbers, or the texts of labels."""
        if self.nodes[key] is None:
            self.texts.setdefault(key, []).extend(one_line(text) for text in values)
        else:
            self.pieces.setdefault(key, []).append(values)

    def whole(self) -> DesignTable:
        """Columns of numbers and of labels; the pieces are released."""
        numbers = {}
        for key in [key for key, node in self.nodes.items() if node is not None]:
            numbers[key] = np.concatenate(self.pieces.pop(key))
        labels = {key: tuple(texts) for key, texts in self.texts.items()}
        return DesignTable(numbers, labels, tuple(self.results))


def is_result(key: str) -> bool:
    """Whether a column of an exported archive is none of its parameters, and is left out."""
    if key in PARAMETERS or key in LABELS:
        return False
    ending = next((e for e in (PUBLISHED, LOW, HIGH, EXPLAINED) if key.endswith(e)), "")
    return key in (DESIGN, *SEARCHED) or key.removesuffix(ending) in ALL_QUANTITIES


def name_and_unit(head: str) -> tuple[str, str]:
    """Take the head of a column apart, as `export` with units in heads writes it: "speed [rpm]"."""
    match = re.fullmatch(r"(\w{1,100})\s*\[([^\[\]]{1,60})\]", head)
    return (match[1], match[2].strip()) if match else (head, "")


def factor_of(key: str, node: Node | None, unit: str, name: str) -> float:
    """Factor from a unit that the head of a column states to that of the key; 1 without a unit."""
    if not unit:
        return 1.0
    if node is None:
        raise SceneError(f"{name}: {key}: holds texts, which have no unit")
    try:
        check_units(key, node, unit, name)
        return 1.0
    except SceneError:
        pass
    try:
        return number_with_unit(f"1 {unit}", key, node.unit)
    except SceneError:
        kind = "without a unit" if node.unit == "1" else f"'{node.unit}', or another of its kind"
        raise SceneError(f"{name}: {key}: units are {shown(unit)}; must be {kind}") from None


def known_columns(keys: Iterator[str] | list[str], name: str, what: str) -> dict[str, Node | None]:
    """Parameter of each column, None for labels; other names are refused with the nearest one."""
    keys = list(keys)
    known = (*PARAMETERS, *ALL_QUANTITIES, *LABELS)
    if keys and not any(key in known or did_you_mean(key, known) for key in keys):
        # Any file may be named: the message must not show the content of a file that is not ours.
        meant = not_known(keys[0], known, command="engine-dyn list keys")
        raise SceneError(f"{name}: {what} 1: unknown key{meant}")
    for key in keys:
        if key not in LABELS:
            check_of_designs(key, f"{name}: {what} {key}", "the file")
    return {key: known_key(key, f"{name}: {what}", LABELS) for key in keys}


def check_kind(key: str, node: Node | None, kind: Any, shown_as: str, name: str) -> None:
    """Check that labels are texts and parameters are numbers; ratios may be either."""
    letter = "U" if kind is str else getattr(kind, "kind", "O")
    text, numeric = letter in "US", letter in "iuf"
    if text and is_ratio(node):
        return
    if (node is None and not text) or (node is not None and not numeric):
        what = "strings" if node is None else "numbers"
        raise SceneError(f"{name}: {key}: holds {shown(shown_as)}; must be {what}")


def check_units(key: str, node: Node | None, units: Any, name: str) -> None:
    """Refuse other units, because silent conversions are a source of errors."""
    if node is None or units is None:
        return
    words = " ".join(str(units).replace("**", "").replace("^", "").replace("*", " ").split())
    # Other spellings of the units of scenes
    spellings = {
        "": "1", "-": "1", "dimensionless": "1", "%": "percent", "deg": "degree",
        "degrees": "degree", "rad/s": "rad s-1", "bar s/m": "bar s m-1", "min-1": "rpm",
        "1/min": "rpm",
    }  # fmt: skip
    if spellings.get(words, words) != node.unit:
        raise SceneError(f"{name}: {key}: units are {shown(str(units))}; must be '{node.unit}'")


def take_numbers(
    columns: DesignColumns, key: str, values: Any, missing: npt.NDArray[np.bool_], begin: int
) -> None:
    """Check that no number is missing or outside its range, and append them from row `begin` on.

    Numbers, and of ratios texts such as "1/200".
    """
    node = columns.nodes[key]
    assert node is not None
    if np.asarray(values).dtype.kind in "OU":
        numbers = _of_texts(columns.name, key, node, values, begin)
    else:
        numbers = np.array(values, dtype=np.float64)
    missing = missing | np.isnan(numbers)
    if missing.any():
        row = begin + int(np.argmax(missing)) + 1
        raise SceneError(
            f"{columns.name}, row {row}: {key}: missing ({counted(int(missing.sum()), 'value')} "
            f"among the rows {begin + 1} to {begin + numbers.size}); must be {allowed(node)}"
        )
    bad = np.flatnonzero(outside(numbers, node))
    if bad.size:
        row = begin + int(bad[0]) + 1
        check_range(numbers[bad[0]], f"{columns.name}, row {row}: {key}", node)
    columns.take(key, numbers)


def _of_texts(name: str, key: str, node: Node, values: Any, begin: int) -> Floats:
    """Numbers of a column of fractions and numbers; NaN where a value is missing or blank."""
    return np.array(
        [
            np.nan
            if value is None or (isinstance(value, str) and not value.strip())
            else _of_text(value, f"{name}, row {row}: {key}", node)
            for row, value in enumerate(values, start=begin + 1)
        ]
    )


def _of_text(value: Any, where: str, node: Node) -> float:
    if isinstance(value, int | float):
        return float(value)
    return number(str(value).strip(), where, node)
