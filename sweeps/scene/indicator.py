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

from engine_dyn.engine import Engine
from engine_dyn.pressure.diagram import Diagram
from engine_dyn.quantities.graph import ALL_QUANTITIES, NODES
from sweeps.base.errors import SceneError, no_laboratory
from sweeps.base.files.regular_files import (
    add_files_read,
    file_bytes,
    kept,
    kept_name,
    read_text,
    referred,
)
from sweeps.scene.engine.diagram_speeds import SPEEDS, read_speeds
from sweeps.scene.engine.indicator_files import (
    HEAD,
    HEADER,
    NAMES,
    WHAT,
    cycles_of_text,
    indicator_of_text,
    notes_in,
    notes_of,
    read_indicator,
)
from sweeps.scene.toml_tables import Indicator

_OF_ONE_CYLINDER = (
    "pressure", "crank_pin_components", "piston_pin_components", "main_journal_components",
    "torque_after_throw", "cylinder_gas_torque_harmonics", "cylinder_torque_harmonics",
    "throw_torque_harmonics",
)  # fmt: skip
"""Nodes that have the diagram of a single cylinder in them, over angle or order."""

_RESULT, _LEVEL = ": imep ", ": not pegged, "
_VALUE = re.compile(r"(?<![\d.])[+-]?[\d.]++(?:e[+-]?\d++)?+(?= ?(?:bar|%))")


def _all_that_need(roots: Iterable[str]) -> frozenset[str]:
    """Quantities among these nodes, and all that follow from them."""
    needing = set(roots)
    more = set(needing)
    while more:
        more = {
            name
            for name, nodes in NODES.items()
            if name not in needing and any(not needing.isdisjoint(node.needs) for node in nodes)
        }
        needing |= more
    return frozenset(needing & set(ALL_QUANTITIES))


TELLING = _all_that_need(_OF_ONE_CYLINDER)
"""Quantities that tell the pressure to who knows the engine's measures and masses."""


def check_quantities(quantities: Iterable[str], name: str) -> None:
    """Refuse quantities that tell a confidential diagram.

    Raises
    ------
    SceneError
        For the first of them; `name` is the scene as messages call it.
    """
    for quantity in quantities:
        if quantity in TELLING:
            raise SceneError(
                f"{name}: [output] quantities: '{quantity}': not allowed together with "
                "[indicator] confidential = true: the pressure could be derived from it with the "
                "engine's dimensions and masses"
            )


def without_pressures(notes: Iterable[str]) -> tuple[str, ...]:
    """Notes without imep and largest pressure; warnings and level without pressures."""
    return tuple(
        _VALUE.sub("...", note) if note.startswith("warning: ") or _LEVEL in note else note
        for note in notes
        if _RESULT not in note
    )


_LABORATORY = EntryPoint(
    "pressure", "sweeps.lab.pressure.pressure:imported", group="sweeps.recordings"
)
"""Used as it stands by a checkout that was installed before pyproject.toml had this entry point."""

_OWN_KEYS = frozenset(("file", "confidential", SPEEDS))
_OWN_HEADER = re.compile(rf"^[^#;\t\n]*({'|'.join(NAMES)})[^;\t\n]*$".encode(), re.MULTILINE)


class Indicated(NamedTuple):
    """The diagram of [indicator]."""

    diagram: Diagram | None  # None without the table. Of recorded cycles their mean.
    cycles: tuple[Diagram, ...] = ()  # Recorded cycles, where they are asked for
    # Notes: what was done to the recording, by the header of the imported file; of a confidential
    # one without imep and pressures.
    notes: tuple[str, ...] = ()
    confidential: tuple[str, ...] = ()  # Name of its file where archives must not hold it
    # Lowest and highest speed [rpm] for which it holds, where that is known.
    speeds: tuple[float, float] | None = None


def read_indicator_table(
    table: Indicator, engine: Engine, base: Path, name: str, *, cycles: bool = False
) -> Indicated:
    """Read the diagram of [indicator].

    Parameters
    ----------
    table : Indicator
        The table.
    engine : Engine
        Its cycle, measures and firing angles are used.
    base : Path
        Folder where its path starts from.
    name : str
        The scene as messages call it.
    cycles : bool
        Whether each recorded cycle is a diagram.

    Raises
    ------
    SceneError
        In one line; also where the diagram is confidential and the archive that is read again does
        not hold it.
    """
    where = f"{name}: [indicator] {table.file}"
    path = referred(base, table.file, f"{name}: [indicator] file")
    secret = (kept_name(path),) if table.confidential else ()
    speeds = read_speeds({SPEEDS: table.speeds}, f"{name}: [indicator]")
    if kept(path) is False and table.confidential:
        raise SceneError(
            f"{where}: is confidential and not stored in the archive; `engine-dyn rerun "
            "--indicator FILE` reads it from a file"
        )
    if _is_diagram(table, path):
        diagram = read_indicator(path, where, engine.period)
        text = read_text(path, where, WHAT) if cycles else ""
        each = cycles_of_text(text, where, engine.period) if cycles else ()
        notes = notes_of(path)
    else:
        from sweeps.base.columns.recording import read_recording

        recording = read_recording(path, where, table)
        pressure = _laboratory(where)(recording, path.name, table, engine.period, engine)
        text = pressure.text(cycles=cycles)
        add_files_read({kept_name(path): text.encode()})  # the part that a scene needs
        diagram, notes = indicator_of_text(text, where, engine.period), notes_in(text)
        each = cycles_of_text(text, where, engine.period) if cycles else ()
    return Indicated(diagram, each, without_pressures(notes) if secret else notes, secret, speeds)


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
    """Whether a file is read as it is: no key asks for more, and it has one of our columns.

    Among the files of an archive, one that was imported is not imported again.
    """
    try:
        head = file_bytes(path)[:HEAD]
    except (OSError, ValueError):
        return True  # the reader says what is wrong
    if kept(path) and head.startswith(HEADER.encode()):
        return True
    from sweeps.base.columns.recording import SUFFIXES

    own = _OWN_HEADER.search(head) is not None
    text = SUFFIXES.get(path.suffix.lower(), "text") == "text"
    return text and own and not table.model_fields_set - _OWN_KEYS
