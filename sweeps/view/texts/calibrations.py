"""What a calibration did, as a text: what was fitted and how well, and every assumed value."""

from __future__ import annotations

from typing import TYPE_CHECKING

from engine_dyn.quantities.graph import PARAMETERS
from sweeps.base.errors import counted
from sweeps.lab.speed.calibrated_files import heading
from sweeps.scene.engine.modelled_diagrams import KINDS

if TYPE_CHECKING:
    from sweeps.lab.speed.calibration_model import Calibration

__all__ = ["calibration_text"]


def calibration_text(made: Calibration) -> str:
    """Describe a calibration in lines without a final line feed."""
    lines = heading(made)
    if made.sheet.diagrams:
        lines.append(f"{counted(made.sheet.diagrams, 'diagram')} of the file replaced.")
    place = made.published.places["power"]
    if place.startswith(f"{made.sheet.name}: "):
        lines.append(
            f"The power, {made.published.power:g} kW, is from the file ([data_sheet]); --power "
            "overrides it."
        )
    was = made.sheet.values.get("speed")
    if was is not None and was != made.published.speed:
        lines.append(
            f"[values] speed: {was:g} rpm in the file; {made.published.speed:g} rpm is written."
        )
    lines += [
        "",
        f"assumed, {counted(len(made.assumed), 'value')}; replace them where you know better:",
    ]
    rated = made.rated.table
    first = made.points[0].table
    for key, reason in made.assumed.items():
        if key in PARAMETERS and key in made.values:
            unit = PARAMETERS[key].unit
            value = f" = {made.values[key]:g}{'' if unit in ('', '1') else f' {unit}'}"
        elif key == "firing_order" and made.order is not None:
            value = " = " + "-".join(map(str, made.order))
        elif key == "kind":
            value = f" = {made.published.kind}"
        elif key in rated:
            value = f" = {rated[key]:g}{KINDS['first_law'].fields[key].words}"
            if first[key] != rated[key]:
                value += f" ({first[key]:g} at {made.points[0].load:g} percent)"
        else:
            value = ""
        lines.append(f"  {key}{value}: {reason}")
    return "\n".join(lines)
