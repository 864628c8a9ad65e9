"""The design that a search found, as a text."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from sweeps.base.errors import one_line
from sweeps.decide.explore.rows import fixed_of, rows
from sweeps.running.reduce.every_point import TEXT
from sweeps.scene.conditions import constraint, units_of
from sweeps.view.texts.readable_units import converted
from sweeps.view.texts.tables import rows_text

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["found_text"]

MOST = 50
"""Points of a design that are shown."""


def found_text(
    archive: xr.Dataset, found: xr.Dataset, quantities: Sequence[str] | None = None,
    units: str | None = None, width: int | None = None, within: Sequence[str] = (),
) -> str:  # fmt: skip
    """Describe what `sweeps.best` returned.

    Parameters
    ----------
    archive : Dataset
        What was searched.
    found : Dataset
        The design.
    quantities : sequence of str, optional
        Those to show.
    units : str, optional
        As `rows_text` takes them.
    width : int, optional
        Of the terminal.
    within : sequence of str, optional
        Conditions of the search, which are told with their units.

    Raises
    ------
    SceneError
        As `rows` and `rows_text`.
    """
    place = fixed_of(archive, found)
    lines = [one_line(found.attrs[TEXT])] if TEXT in found.attrs else []
    if within:
        lines.append(f"conditions: {', '.join(_condition(text, archive) for text in within)}")
    shown = rows(found, quantities=quantities, limit=MOST)
    shown = replace(shown, fixed={**place, **shown.fixed})
    lines.append(rows_text(shown, units, width))
    return "\n".join(lines)


def _condition(text: str, archive: xr.Dataset) -> str:
    """A condition with the unit of its limit."""
    units = units_of(archive)
    condition = constraint(text, units)
    _, unit = converted(units(condition.name) or "", None)
    return str(condition) if condition.written else f"{condition} {unit}".rstrip()
