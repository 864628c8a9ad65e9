"""What a shaft is, as lines: its discs, what joins them, and their numbers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from engine_dyn.quantities.graph import PARAMETERS, PATTERNS
from sweeps.base.errors import counted, one_line

if TYPE_CHECKING:
    from engine_dyn.torsion.shaft import Shaft

__all__ = ["shaft_lines"]


def shaft_lines(
    shaft: Shaft, values: Mapping[str, float], auxiliaries: bool = False
) -> list[str]:  # fmt: skip
    """Discs, shafts and gears with the numbers of their keys; rings of dampers come last.

    Parameters
    ----------
    shaft : Shaft
        Its names and what joins what.
    values : mapping
        Values of parameters, in the units of files.
    auxiliaries : bool
        Whether the engine has [[auxiliaries]], whose disc is told then.
    """
    masses = "include" if shaft.includes_reciprocating else "are without"
    lines = [
        f"shaft, {counted(len(shaft.discs), 'disc')}, counted as in keys such as disc_inertia_1; "
        f"discs of throws {masses} the reciprocating masses"
    ]
    for place, name in enumerate(shaft.discs):
        roles = [f"throw {n + 1}" for n, disc in enumerate(shaft.throws) if disc == place]
        parts = ("flywheel", "load", *(("auxiliaries",) if auxiliaries else ()))
        roles += [f"{part} on it" for part in parts if getattr(shaft, part) == place]
        lines.append(_line(place, name, [*roles, *_numbers(shaft, "disc", place, values)]))
    for place, name in enumerate(shaft.shaft_names):
        between = " - ".join(shaft.discs[disc] for disc in shaft.shafts[place])
        joins = [] if between == name else [between]
        lines.append(_line(place, name, [*joins, *_numbers(shaft, "shaft", place, values)]))
    for place, (first, second) in enumerate(shaft.gears):
        ratio = f"ratio = {values[f'shaft_gear_ratio_{place + 1}']:.6g}"
        lines.append(_line(place, f"gear {shaft.discs[first]} - {shaft.discs[second]}", [ratio]))
    return lines


def _line(place: int, name: str, about: list[str]) -> str:
    return f"  {place + 1} {one_line(name, 80)}: {', '.join(about)}"


def _numbers(shaft: Shaft, kind: str, place: int, values: Mapping[str, float]) -> list[str]:
    """Numbers of a disc or shaft, or of a damper where it is its ring."""
    found = []
    for pattern in PATTERNS:
        what = pattern.removesuffix("_N")
        key = shaft.key_of(what, place) if what.startswith(f"{kind}_") else ""
        if key in values and what != "shaft_gear_ratio":
            unit = PARAMETERS[key].unit
            said = f"{what.removeprefix(f'{kind}_')} = {values[key]:.6g}"
            found.append(said if unit == "1" else f"{said} [{unit}]")
    return found
