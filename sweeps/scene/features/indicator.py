"""The measured diagram of [indicator]: a diagram in CSV, or a recording that becomes one.

A recording is imported as `engine-dyn import` does; an archive keeps the imported diagram, whose
header has the hash of the recording, and not the recording, which may be large.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import Field

from engine_dyn.pressure.diagram import Diagram
from engine_dyn.pressure.family_grid import FamilyGrid
from engine_dyn.quantities.features.indicator import FEATURE
from engine_dyn.quantities.graph import ALL_QUANTITIES, NODES
from sweeps.base.columns.options import PressureOptions
from sweeps.base.errors import SceneError, no_laboratory
from sweeps.base.files.regular_files import (
    add_files_read,
    file_bytes,
    kept,
    kept_name,
    read_text,
    referred,
)
from sweeps.scene.features.feature import GivenFeature
from sweeps.scene.features.indicator_files import (
    HEAD,
    HEADER,
    MEANING,
    NAMES,
    SPEEDS,
    WHAT,
    cycles_of_text,
    indicator_of_text,
    notes_in,
    notes_of,
    read_indicator,
    read_speeds,
)
from sweeps.scene.values import GivenValues


def _all_that_need(roots: Iterable[str]) -> frozenset[str]:
    """Some nodes that are quantities, and all quantities that follow from the nodes."""
    followers: dict[str, list[str]] = {}
    for name, nodes in NODES.items():
        for need in {need for node in nodes for need in node.needs}:
            followers.setdefault(need, []).append(name)
    needing: set[str] = set()
    waiting = [*roots]
    while waiting:
        name = waiting.pop()
        if name not in needing:
            needing.add(name)
            waiting += followers.get(name, [])
    return frozenset(needing & set(ALL_QUANTITIES))


# Nodes that contain the diagram of a single cylinder, over angle or order.
TELLING = _all_that_need((
    "pressure", "crank_pin_components", "piston_pin_components", "main_journal_components",
    "torque_after_throw", "cylinder_gas_torque_harmonics", "cylinder_torque_harmonics",
    "throw_torque_harmonics",
))  # fmt: skip
"""Quantities that reveal the pressure to readers who know the engine's dimensions and masses."""


def without_pressures(notes: Iterable[str]) -> tuple[str, ...]:
    """Notes without imep and largest pressure; warnings and level without pressures."""
    value = re.compile(r"(?<![\d.])[+-]?[\d.]++(?:e[+-]?\d++)?+(?= ?(?:bar|%|N m))")
    telling = re.compile(r"warning: |indicated torque |.*(?:: not pegged, | of imep\b)")
    return tuple(
        value.sub("...", note) if telling.match(note) else note
        for note in notes
        if ": imep " not in note
    )


_LABORATORY = EntryPoint(
    "pressure", "sweeps.lab.pressure.pressure:imported", group="sweeps.recordings"
)
"""Entry point that a checkout uses which was installed before pyproject.toml had it."""


class Indicator(PressureOptions):
    """A measured diagram, and how its file becomes one."""

    file: str = Field(
        description="a string: the path of a recorded pressure, such as a CSV file", min_length=1
    )
    confidential: bool = Field(
        default=False, description="true or false: archives store only the hash of the diagram"
    )
    speeds: list[float] | None = Field(
        default=None, description=f"a list of two numbers: {MEANING}"
    )


class Indicated(NamedTuple):
    """The diagram of [indicator]."""

    diagram: Diagram | None  # Diagram, the mean of recorded cycles; None without the table
    file: str = ""  # Name of the file in the scene
    cycles: tuple[Diagram, ...] = ()  # Recorded cycles, if the scene asks for them
    # Notes on the recording from the header of the imported file; notes on a confidential file
    # leave out imep and pressures.
    notes: tuple[str, ...] = ()
    confidential: tuple[str, ...] = ()  # Name of the diagram's file if archives must not hold it
    # Lowest and highest speed [rpm] for which the diagram holds, where known.
    speeds: tuple[float, float] | None = None
    compression_ratio: float | None = None  # Compression ratio in the table [1]


def of(scene: GivenValues) -> Indicated:
    """Return the measured diagram of a scene, or one without a diagram."""
    part: Indicated | None = FEATURE.of(scene)
    return Indicated(None) if part is None else part


def _read(values: GivenValues, table: Indicator, folder: Path, where: str) -> Indicated:
    """Read the diagram; its cycles only where the scene chooses them by their numbers."""
    period, cycles = values.engine.period, values.gives("recorded_cycle")
    where = f"{where}[indicator]"
    path = referred(folder, table.file, f"{where} file")
    secret = (kept_name(path),) if table.confidential else ()
    speeds = read_speeds({SPEEDS: table.speeds}, where)
    where = f"{where} {table.file}"
    if kept(path) is False and table.confidential:
        raise SceneError(
            f"{where}: is confidential and not stored in the archive; `engine-dyn rerun "
            "--indicator FILE` reads it from a file"
        )
    if _is_diagram(table, path):
        diagram = read_indicator(path, where, period)
        text = read_text(path, where, WHAT) if cycles else ""
        notes = notes_of(path)
    else:
        from sweeps.base.columns.recording import read_recording

        recording = read_recording(path, where, table)
        pressure = _laboratory(where)(recording, path.name, table, period, values.engine)
        text = pressure.text(cycles=cycles)
        # Archives keep the diagram, not the recording
        add_files_read({kept_name(path): text.encode()})
        diagram, notes = indicator_of_text(text, where, period), notes_in(text)
    each = cycles_of_text(text, where, period) if cycles else ()
    notes = without_pressures(notes) if secret else notes
    return Indicated(
        diagram, table.file, each, notes, secret, speeds, table.compression_ratio
    )  # fmt: skip


def _laboratory(where: str) -> Callable[..., Any]:
    """Function of the laboratory that makes a diagram of a recording."""
    entries = entry_points(group=_LABORATORY.group, name=_LABORATORY.name)
    try:
        return next(iter(entries), _LABORATORY).load()
    except ModuleNotFoundError as error:
        missing = no_laboratory(error)
        if missing is None:
            raise
        raise SceneError(
            f"{where}: is a recording, and {missing}; a diagram with the columns "
            f"{' and '.join(NAMES)} is read without it"
        ) from None


def _is_diagram(table: Indicator, path: Path) -> bool:
    """Whether a file is read as it is: no key asks for more, and it has one of our columns."""
    # An archive keeps the diagram that was made of a recording: it is not made again.
    try:
        head = file_bytes(path)[:HEAD]
    except (OSError, ValueError):
        return True  # The reader refuses the file with a reason
    if kept(path) and head.startswith(HEADER.encode()):
        return True
    from sweeps.base.columns.recording import SUFFIXES

    own_header = re.compile(rf"^[^#;\t\n]*({'|'.join(NAMES)})[^;\t\n]*$".encode(), re.MULTILINE)
    own = own_header.search(head) is not None
    text = SUFFIXES.get(path.suffix.lower(), "text") == "text"
    return text and own and not table.model_fields_set - {"file", "confidential", SPEEDS}


def _check_asked(values: GivenValues, quantities: Iterable[str], name: str) -> None:
    """Refuse quantities that reveal a confidential diagram."""
    telling = TELLING.intersection(quantities) if of(values).confidential else ()
    for quantity in quantities:
        if quantity in telling:
            raise SceneError(
                f"{name}: [output] quantities: '{quantity}': not allowed together with "
                "[indicator] confidential = true: the pressure could be derived from it with the "
                "engine's dimensions and masses"
            )


def _words(values: GivenValues) -> tuple[str, ...]:
    engine, measured = values.engine, of(values).diagram is not None
    over_speed = not measured and isinstance(engine.family, FamilyGrid)
    scaled = not measured and engine.pressure_scale is not None
    diagrams = "over_speed" if over_speed else "over_load"
    return (
        "over_cycles" if values.gives("recorded_cycle") else diagrams,
        "scale_over_speed" if scaled else "one_scale",
    )


GIVEN = GivenFeature(
    FEATURE, "a table with file = 'pressure.csv'", Indicator, read_of_scene=_read,
    scenes_only=True, words=_words, check_asked=_check_asked,
    replaces="the diagrams of the engine and their factor over the speed",
    line=lambda part: f"one pressure diagram for all: {part.file}",
)  # fmt: skip
