"""Published values of [reference]: a CSV file whose rows are matched to the scene's designs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from engine_dyn.quantities.graph import ALL_QUANTITIES, PARAMETERS
from engine_dyn.quantities.parameters import SOLVER_COLUMNS
from engine_dyn.types import Floats
from sweeps.base.checks import is_ratio
from sweeps.base.dimensions import DESIGN, INERTIA_MODEL, LABELS, METHOD
from sweeps.base.errors import SceneError, counted, did_you_mean, not_known, one_line, shown
from sweeps.base.files.csv_tables import CsvTable, read_csv
from sweeps.base.files.regular_files import referred
from sweeps.scene.model import Reference, Scene
from sweeps.scene.toml_tables import LARGEST_AXIS


def read_reference(file: str, scene: Scene, base: Path, name: str) -> Reference:
    """Read a table of published values and place its rows among the scene's designs.

    Raises
    ------
    SceneError
        For unknown columns, and for rows that fit none or several of the designs.
    """
    path = referred(base, file, f"{name}: [reference] file")
    table = read_csv(path, f"{name}: [reference] {file}", "a table of published values (CSV)")
    quantities = _reference_quantities(table, scene)
    by_axis = tuple(d for d in scene.dimensions if d in table.header)
    of_design = tuple(key for key in table.header if key in scene.labels or key in scene.designs)
    dimensions = by_axis
    if DESIGN in scene.dimensions and (of_design or not by_axis):
        dimensions = tuple(d for d in scene.dimensions if d == DESIGN or d in by_axis)
    if not dimensions and (scene.dimensions or len(table.rows) > 1):
        raise SceneError(
            f"{table.name}: {counted(len(table.rows), 'row')} cannot be distinguished; must have "
            f"a column of {' or '.join(scene.dimensions) or 'an axis, or one row'}"
        )
    _check_constants(table, scene, (*by_axis, *of_design, *quantities))
    index = {axis: _axis_index(table, scene, axis) for axis in by_axis}
    if DESIGN in dimensions:
        index[DESIGN] = _design_index(table, scene, of_design, in_order=not by_axis)
    places = list(zip(*(index[d] for d in dimensions), strict=True)) or [()]
    _check_unique(table, places)
    return Reference(file, dimensions, _placed(table, scene, quantities, dimensions, places))


def _check_unique(table: CsvTable, places: Sequence[tuple[int, ...]]) -> None:
    """Check that no two rows belong to one design."""
    first: dict[tuple[int, ...], int] = {}
    for place, line in zip(places, table.lines, strict=True):
        if place in first:
            raise SceneError(
                f"{table.name}, line {line}: duplicate of the design on line {first[place]}; each "
                "design may have one row"
            )
        first[place] = line


def _placed(
    table: CsvTable,
    scene: Scene,
    quantities: tuple[str, ...],
    dimensions: tuple[str, ...],
    places: Sequence[tuple[int, ...]],
) -> dict[str, Floats]:
    """Values of each quantity over the dimensions; NaN without a row."""
    shape = tuple(scene.sizes[d] for d in dimensions)
    if math.prod(shape) * len(quantities) > LARGEST_AXIS:
        raise SceneError(
            f"{table.name}: {counted(len(table.rows), 'row')} of published values over "
            f"{' x '.join(map(str, shape))} points; must be at most {LARGEST_AXIS} values"
        )
    columns: dict[str, Floats] = {}
    for quantity in quantities:
        columns[quantity] = np.full(shape, np.nan)
        for place, value in zip(
            places,
            table.numbers(quantity, blanks=True, ratios=ALL_QUANTITIES[quantity].unit == "1"),
            strict=True,
        ):
            columns[quantity][place] = value
    return columns


def _reference_quantities(table: CsvTable, scene: Scene) -> tuple[str, ...]:
    """Columns that hold published values; every other column must be a key, label or axis."""
    words = tuple(key for key in (METHOD, INERTIA_MODEL) if key in scene.axes)
    known = (*ALL_QUANTITIES, *PARAMETERS, *LABELS, *words)
    ours = any(column in known for column in table.header)
    for number, column in enumerate(table.header, start=1):
        if column not in known:
            # Without a name like one of ours, another file may have been named, whose content must
            # not be shown.
            called = shown(column) if ours or did_you_mean(column, known) else f"{number}"
            raise SceneError(
                f"{table.name}: column {called}: unknown"
                f"{not_known(column, known, command='engine-dyn list')}"
            )
        if column in LABELS and column not in scene.labels:
            raise SceneError(
                f"{table.name}: column '{column}': the scene's [designs] have no such labels"
            )
    quantities = tuple(column for column in table.header if column in ALL_QUANTITIES)
    for quantity in quantities:
        if ALL_QUANTITIES[quantity].kind == "curve":
            raise SceneError(
                f"{table.name}: column '{quantity}': varies over crank angle; published values "
                "must be of quantities with one value per design"
            )
    if not quantities:
        raise SceneError(
            f"{table.name}: no column for a quantity; found "
            f"{one_line(', '.join(table.header), 200)}"
        )
    return quantities


def _numbers(table: CsvTable, key: str) -> list[float]:
    """Numbers in the column of a parameter; fractions too for a ratio."""
    return table.numbers(key, ratios=is_ratio(PARAMETERS.get(key)))


def _same(a: float, b: npt.ArrayLike) -> npt.NDArray[np.bool_]:
    # Relative difference within which a value of a reference file equals the scene's
    return np.isclose(np.asarray(b, dtype=float), a, rtol=1e-6, atol=1e-12)


def _check_constants(table: CsvTable, scene: Scene, used: Sequence[str]) -> None:
    """Check that columns of constant parameters agree with the scene."""
    for key in table.header:
        if key in used:
            continue
        here = scene.settings.get(key, scene.engine.values.get(key))
        solver = getattr(scene, key, None) if key in SOLVER_COLUMNS else here
        expected = here if solver is None else solver
        for value, line in zip(_numbers(table, key), table.lines, strict=True):
            if expected is None or not _same(value, expected):
                has = "no value" if expected is None else f"{expected:g}"
                raise SceneError(
                    f"{table.name}, line {line}: {key} = {value:g}: the scene has {has}; rows must "
                    "match"
                )


def _axis_index(table: CsvTable, scene: Scene, axis: str) -> list[int]:
    """Place of each row along one axis."""
    values = scene.axes[axis]
    places: list[int] = []
    if isinstance(values, tuple):
        for word, line in zip(table.texts(axis), table.lines, strict=True):
            if word not in values:
                raise SceneError(
                    f"{table.name}, line {line}: {axis} = {shown(word)}: not on the scene's axis; "
                    f"allowed: {', '.join(values)}"
                )
            places.append(values.index(word))
        return places
    for value, line in zip(_numbers(table, axis), table.lines, strict=True):
        hits = np.flatnonzero(_same(value, values))
        if len(hits) == 0:
            listed = one_line(", ".join(f"{v:g}" for v in values), 200)
            raise SceneError(
                f"{table.name}, line {line}: {axis} = {value:g}: not on the scene's axis; "
                f"allowed: {listed}"
            )
        places.append(int(hits[0]))
    return places


def _design_index(
    table: CsvTable, scene: Scene, columns: tuple[str, ...], in_order: bool
) -> list[int]:
    """Design of each row: in order where only designs vary, otherwise by columns that name it."""
    count = scene.sizes[DESIGN]
    if in_order:
        if len(table.rows) != count:
            raise SceneError(
                f"{table.name}: {counted(len(table.rows), 'row')} for {counted(count, 'design')}; "
                "one row for each, in order"
            )
        for key in columns:
            _check_order(table, scene, key)
        return list(range(count))
    values = {key: _values_of(table, scene, key) for key in columns}
    places: list[int] = []
    for row, line in enumerate(table.lines):
        hits = np.ones(count, dtype=bool)
        for key, (wanted, own) in values.items():
            hits &= own == wanted[row] if key in scene.labels else _same(wanted[row], own)
        if hits.sum() != 1:
            raise SceneError(
                f"{table.name}, line {line}: matches {hits.sum()} designs by "
                f"{', '.join(columns)}; must match one"
            )
        places.append(int(np.argmax(hits)))
    return places


def _values_of(table: CsvTable, scene: Scene, key: str) -> tuple[list[Any], npt.NDArray[Any]]:
    """Labels or values of the rows, and those of the designs."""
    if key in scene.labels:
        wanted: list[Any] = [one_line(text) for text in table.texts(key)]
        return wanted, np.array(scene.labels[key], dtype=object)
    return _numbers(table, key), scene.designs[key]


def _check_order(table: CsvTable, scene: Scene, key: str) -> None:
    """Check that each row has the label or value of the design at its place."""
    texts = table.texts(key)
    labels = scene.labels.get(key)
    numbers_here = None if labels is not None else _numbers(table, key)
    for i, line in enumerate(table.lines):
        if labels is not None:
            same, expected = one_line(texts[i]) == labels[i], shown(labels[i])
        else:
            assert numbers_here is not None
            value = float(scene.designs[key][i])
            same, expected = bool(_same(numbers_here[i], value)), f"{value:g}"
        if not same:
            raise SceneError(
                f"{table.name}, line {line}: {key} = {texts[i]}: design {i + 1} of the scene has "
                f"{expected}; rows must match [designs] in order"
            )
