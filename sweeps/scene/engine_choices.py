"""Several engines or arrangements in one scene: one ordinary scene for each of them.

`engine` and `arrangement` may be axes or columns of [designs]. The number of cylinders follows from
each arrangement, and quantities that an engine has not are missing there. So such a scene is a list
of ordinary scenes, which are put together at the labels; `EngineChoice` says what is another in
each, and where its results belong.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from engine_dyn.engine import Engine
from engine_dyn.types import Floats, Integers
from sweeps.base.checks import mentioned
from sweeps.base.dimensions import ARRANGEMENT, DESIGN, ENGINE
from sweeps.base.errors import SceneError, counted, shown
from sweeps.scene.crossings import refused
from sweeps.scene.cylinders import read_arrangement_axis
from sweeps.scene.engine.cylinder_keys import (
    ArrangementTable,
    arrangement_of,
    name_of,
    read_arrangement,
    read_cylinder_keys,
)
from sweeps.scene.engine.engine_files import engine_path, load_engine
from sweeps.scene.toml_tables import SceneFile

MOST = 200  # Largest number of ordinary scenes that one scene may consist of


# One choice: names of engine and arrangement, and its positions along each axis
_Chosen = tuple[dict[str, str], dict[str, Integers]]


@dataclass(frozen=True)
class EngineChoice:
    """One engine and one arrangement out of several."""

    raw: dict[str, Any]  # Tables of a scene of this engine and arrangement alone
    name: str  # Name of that scene in messages
    # Positions along `engine`, `arrangement` and `design` that have this engine and arrangement.
    places: Mapping[str, Integers]


@dataclass(frozen=True)
class EngineChoices:
    """All of them, and the axes of words that they make, in the order of the scene's axes."""

    each: tuple[EngineChoice, ...]  # Choices of engine and arrangement, at least one
    # Axes of the scene in order: texts for `engine` and `arrangement`, otherwise None.
    axes: Mapping[str, tuple[str, ...] | None]


def engine_choices(
    given: SceneFile, raw: Mapping[str, Any], name: str, base: Path,
    designs: Mapping[str, Floats], labels: Mapping[str, Sequence[str]],
) -> EngineChoices | None:  # fmt: skip
    """Take a scene of several engines or arrangements apart; None for an ordinary scene.

    `given` is the scene, its structure checked, `raw` the same as it was read, and `base` the
    folder where its paths start from; `designs` and `labels` are columns of [designs]. Refused are
    engines that are unknown or given twice, arrangements that no engine has, and keys that do not
    go with several of them.
    """
    engines = _engine_axis(given, name, base)
    _check_once(given, labels, name)
    of_rows = {key: labels[key] for key in (ENGINE, ARRANGEMENT) if key in labels}
    rows = of_rows.get(ENGINE, ())
    for text in dict.fromkeys(rows):
        load_engine(text, base, f"{name}: [designs] engine, row {rows.index(text) + 1}")
    several = _arrangements(given, name)
    if engines is None and not of_rows and not _differ(several, given, name, base):
        return None
    if several or ARRANGEMENT in of_rows:
        for table, keys in (("set", given.set), ("axes", given.axes), ("designs", designs)):
            if "cylinders" in keys:
                raise refused("cylinders", "several arrangements", f"{name}: [{table}] cylinders")
    told = {ENGINE: engines or [], ARRANGEMENT: list(several)}
    told = {key: texts for key, texts in told.items() if texts}
    along: list[list[_Chosen]] = [
        [({key: text}, {key: np.array([place])}) for place, text in enumerate(texts)]
        for key, texts in told.items()
    ]
    each = [
        _choice(
            given, raw, name, base, designs, labels, several,
            {key: text for words, _ in chosen for key, text in words.items()},
            {key: here for _, places in chosen for key, here in places.items()},
        )
        for chosen in product(*along, _groups(of_rows))
    ]  # fmt: skip
    if len(each) > MOST:
        raise SceneError(
            f"{name}: {counted(len(each), 'combination')} of engines and arrangements; must be at "
            f"most {MOST}"
        )
    first = [ENGINE] if ENGINE in told and ENGINE not in given.axes else []
    axes = {key: tuple(told[key]) if key in told else None for key in (*first, *given.axes)}
    return EngineChoices(tuple(each), axes)


# --- engines and arrangements --------------------------------------------------------------------


def _engine_axis(given: SceneFile, name: str, base: Path) -> list[str] | None:
    """Engines of a list at the top or of [axes]; None without one."""
    where = f"{name}: engine"
    texts: Any = given.engine if isinstance(given.engine, list) else None
    if ENGINE in given.axes:
        where, texts = f"{name}: [axes] engine", given.axes[ENGINE]
    if texts is None:
        return None
    if not isinstance(texts, list) or not texts or not all(isinstance(t, str) for t in texts):
        raise SceneError(
            f"{where} = {shown(texts)}: must be a list of strings: engines of the catalogue or "
            "paths of engine files"
        )
    seen: dict[Path, int] = {}
    for number, text in enumerate(texts, start=1):
        path, _ = engine_path(text, base, f"{where} number {number}")
        try:
            real = path.resolve()
        except (OSError, ValueError, RuntimeError):  # Opening the file later gives the reason
            real = path
        if real in seen:
            raise SceneError(
                f"{where}: duplicate {shown(text)}: the same engine as number {seen[real]}; "
                "engines must be unique"
            )
        seen[real] = number
        load_engine(text, base, f"{where} number {number}")
    return texts


def _check_once(given: SceneFile, labels: Mapping[str, Sequence[str]], name: str) -> None:
    """Check that engine and arrangement are each given in one place."""
    engines = {
        "at the top": given.engine is not None,
        "in [axes]": ENGINE in given.axes,
        "in [designs]": ENGINE in labels,
    }
    places = [place for place, is_there in engines.items() if is_there]
    if len(places) > 1:
        raise SceneError(f"{name}: engine: given {' and '.join(places)}; give it once")
    if not places:
        raise _no_engine(name)
    arrangements = {
        "[set]": ARRANGEMENT in given.set,
        "[axes]": ARRANGEMENT in given.axes,
        "[designs]": ARRANGEMENT in labels,
    }
    places = [place for place, is_there in arrangements.items() if is_there]
    if len(places) > 1 and "[designs]" in places:
        raise SceneError(f"{name}: arrangement: given in {' and '.join(places)}; give it once")


def check_engine_given(raw: Mapping[str, Any], name: str) -> None:
    """Check that a scene without wrong keys names an engine, as far as its tables tell."""
    fields = SceneFile.model_fields
    axes = raw.get("axes")
    in_axes = isinstance(axes, Mapping) and ENGINE in axes
    if set(raw) <= set(fields) and not (ENGINE in raw or "designs" in raw or in_axes):
        raise _no_engine(name)


def _no_engine(name: str) -> SceneError:
    what = SceneFile.model_fields[ENGINE].description
    return SceneError(f"{name}: engine: missing; must be {what}")


def _arrangements(given: SceneFile, name: str) -> dict[str, Any]:
    """Arrangements of [axes] by their names, with equal or different numbers of cylinders."""
    if ARRANGEMENT not in given.axes:
        return {}
    keys = read_cylinder_keys(given.set, f"{name}: [set] ")
    several = read_arrangement_axis(given.axes[ARRANGEMENT], keys, name)
    return dict(zip(map(name_of, several), given.axes[ARRANGEMENT], strict=True))


def _differ(several: Mapping[str, Any], given: SceneFile, name: str, base: Path) -> bool:
    """Whether arrangements differ from the scene in the number of cylinders, which then follows."""
    # Numbers of cylinders in the scene itself stay as they are: arrangements must fit them.
    if not several or "cylinders" in given.set or "cylinders" in given.axes:
        return False
    if isinstance((given.designs or {}).get("cylinders"), list | np.ndarray):
        return False
    assert isinstance(given.engine, str)
    engine = load_engine(given.engine, base, f"{name}: engine")
    try:
        counts = {_count(one, engine, name) for one in several.values()}
    except SceneError:
        return False  # Reading the ordinary scene gives the reason
    return counts != {int(engine.values["cylinders"])}


def _count(arrangement: Any, engine: Engine, where: str) -> int:
    """Number of cylinders of an arrangement."""
    read: str | ArrangementTable = read_arrangement(arrangement, where)
    try:
        return len(arrangement_of(read, engine.period).cylinders)
    except ValueError as error:
        raise SceneError(f"{where}: {mentioned(error)}") from None


def _groups(of_rows: Mapping[str, Sequence[str]]) -> list[_Chosen]:
    """Rows of [designs] with the same engine and arrangement, in the order of their first rows."""
    if not of_rows:
        return [({}, {})]
    groups: dict[tuple[str, ...], list[int]] = {}
    for row, texts in enumerate(zip(*of_rows.values(), strict=True)):
        groups.setdefault(texts, []).append(row)
    return [
        (dict(zip(of_rows, texts, strict=True)), {DESIGN: np.array(rows, dtype=np.int64)})
        for texts, rows in groups.items()
    ]


# --- ordinary scenes -----------------------------------------------------------------------------


def _choice(
    given: SceneFile, raw: Mapping[str, Any], name: str, base: Path,
    designs: Mapping[str, Floats], labels: Mapping[str, Sequence[str]],
    several: Mapping[str, Any], words: Mapping[str, str], places: Mapping[str, Integers],
) -> EngineChoice:  # fmt: skip
    """One engine and one arrangement as an ordinary scene; `words` are their names."""
    text: Any = words.get(ENGINE, given.engine)
    what = [f"{key} {shown(words[key])}" for key in (ENGINE, ARRANGEMENT) if key in words]
    named = f"{name}, {', '.join(what)}"
    made: dict[str, Any] = {"engine": text}
    for key, table in raw.items():
        if key == "axes":
            made[key] = {k: v for k, v in table.items() if k not in (ENGINE, ARRANGEMENT)}
        elif key == "designs" and table is not None:
            columns = _rows_of(designs, labels, places.get(DESIGN))
            if columns:
                made[key] = columns
        elif key not in ("engine", "sample"):
            made[key] = table
    if ARRANGEMENT in words:
        own = several.get(words[ARRANGEMENT], words[ARRANGEMENT])
        loaded = load_engine(text, base, f"{name}: engine")
        count = _count(own, loaded, named)
        made["set"] = {**made.get("set", {}), "cylinders": count, ARRANGEMENT: own}
    return EngineChoice(made, named, places)


def _rows_of(
    designs: Mapping[str, Floats], labels: Mapping[str, Sequence[str]], rows: Integers | None
) -> dict[str, Any]:
    """Table [designs] with some of its rows; empty if it gives only engine and arrangement."""
    if not designs:
        return {}
    columns: dict[str, Any] = {}
    for key, column in designs.items():
        columns[key] = column if rows is None else column[rows]
    for key, texts in labels.items():
        if key not in (ENGINE, ARRANGEMENT):
            columns[key] = list(texts) if rows is None else [texts[row] for row in rows]
    return columns


Made = TypeVar("Made")


def those_possible(
    quantities: Sequence[str], make: Callable[[Sequence[str]], Made]
) -> tuple[Made, dict[str, SceneError]]:
    """Make something of all quantities, or of those of which it can be made.

    `make` makes it of some quantities, and raises `SceneError` where that is not possible. Returned
    are what was made, and the error of each quantity that was left out. Where it is possible of
    none, the error of all together is raised.
    """
    try:
        return make(quantities), {}
    except SceneError as error:
        if len(quantities) < 2:
            raise
        of_all = error
    refused = _refused(quantities, make)
    if not refused or len(refused) == len(quantities):
        raise of_all
    return make([quantity for quantity in quantities if quantity not in refused]), refused


def _refused(
    quantities: Sequence[str], make: Callable[[Sequence[str]], Any]
) -> dict[str, SceneError]:
    """Error of each quantity of which nothing can be made.

    Halves in which all is possible are not divided further: mostly a few of many are refused.
    """
    try:
        make(quantities)
    except SceneError as error:
        if len(quantities) == 1:
            return {quantities[0]: error}
        half = len(quantities) // 2
        return _refused(quantities[:half], make) | _refused(quantities[half:], make)
    return {}
