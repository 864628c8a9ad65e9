"""The measured diagram of [indicator]: a diagram in CSV, or a recording that becomes one.

A recording is imported as `engine-dyn import` does; an archive keeps the imported diagram, whose
header has the hash of the recording, and not the recording, which may be large.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Any, NamedTuple

from engine_dyn.engine import Engine
from engine_dyn.pressure.diagram import Diagram
from sweeps.base.errors import SceneError, no_laboratory
from sweeps.base.files.regular_files import (
    add_files_read,
    file_bytes,
    kept,
    kept_name,
    read_text,
    referred,
)
from sweeps.scene.confidential import without_pressures
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

__all__ = ["Indicated", "read_indicator_table"]

_LABORATORY = EntryPoint(
    "pressure", "sweeps.lab.pressure.pressure:imported", group="sweeps.recordings"
)
"""Used as it stands by a checkout that was installed before pyproject.toml had this entry point."""

_OWN = frozenset(("file", "confidential", SPEEDS))
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
        add_files_read({kept_name(path): text.encode()})  # of a recording, what a scene needs
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
        return True  # which says what is wrong
    if kept(path) and head.startswith(HEADER.encode()):
        return True
    from sweeps.base.columns.recording import SUFFIXES

    own = _OWN_HEADER.search(head) is not None
    text = SUFFIXES.get(path.suffix.lower(), "text") == "text"
    return text and own and not table.model_fields_set - _OWN
