"""Write docs/torsional_vibration.md: a shaft excited by the orders of an engine's torque.

The measured diesel of the catalogue, its shaft of nine inertias, and the torsional response over
speed, by `engine_dyn.torsion`. The same excitation goes into openTorsion: see the document. Run it
from the project's root: `python tools/torsional_vibration.py`; `--no-figures` leaves the figure
alone.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from pages import DOCS, csv_text, figures_wanted, filled, markdown, sheet, write

import sweeps
from engine_dyn.torsion.forced import forced_response
from engine_dyn.torsion.modes import critical_speeds, natural_modes
from engine_dyn.torsion.synthesis import half_range
from engine_dyn.torsion.system import ShaftSystem, shaft_system
from engine_dyn.types import Complexes, Floats
from engine_dyn.units import RPM
from sweeps.exploring.torsion import QUANTITIES, excitation
from sweeps.figures.marks import DASHES, shade

TEMPLATE = Path(__file__).with_suffix(".md.in")
DOCUMENT = DOCS / "torsional_vibration.md"
PEAKS = {"flywheel": 7, "pulley": 0}
"""Shafts whose peaks have a file beside the page, by their number."""

# doi:10.1243/14644193JMBD126, Fig. 4, digitised in the example data of openTorsion (MIT licence,
# Copyright (c) 2020 Sampo Laine, Urho Hakonen), from which the damping is taken too.
INERTIAS = (0.0170, 0.0090, 0.0467, 0.0327, 0.0467, 0.0467, 0.0327, 0.0487, 2.0750)
STIFFNESSES = (1.106e6, 1.631e6, 1.253e6, 1.253e6, 1.678e6, 1.253e6, 1.253e6, 1.976e6)
NAMES = ("pulley", "gear train", *(f"cylinder {i}" for i in range(1, 7)), "flywheel")
CYLINDERS = tuple(range(2, 8))
ABSOLUTE_DAMPING = 2.0  # N m s/rad, at each cylinder
LOSS_FACTOR = 0.035  # of the shafts
SPEEDS = np.arange(1000.0, 2501.0, 5.0)  # rpm
HIGHEST_ORDER = 12


class Response(NamedTuple):
    """Torque in each shaft over the speed of the engine."""

    order: Floats
    torque: Complexes  # amplitudes [N m], shape (speeds, shafts, orders)
    range: Floats  # half the range over a cycle of the sum of all orders [N m], (speeds, shafts)


def diesel_shaft() -> ShaftSystem:
    damping = np.zeros(len(INERTIAS))
    damping[list(CYLINDERS)] = ABSOLUTE_DAMPING
    return shaft_system(INERTIAS, STIFFNESSES, loss_factor=LOSS_FACTOR, disc_damping=damping)


def over_speed(shaft: ShaftSystem) -> Response:
    """Response to the orders of the measured diesel at every speed."""
    archive: Any = sweeps.run(
        title="Excitation of the shaft of the measured diesel",
        engine="diesel_105x137",
        axes={"speed": SPEEDS.tolist()},
        output={"quantities": list(QUANTITIES), "highest_order": HIGHEST_ORDER},
    )
    excited = [excitation(archive, CYLINDERS, speed=float(speed)) for speed in SPEEDS]
    torque = np.array([one.complexes for one in excited])
    found = forced_response(shaft, excited[0].order, SPEEDS * RPM, CYLINDERS, torque,
                            wanted=("torque", "torque_extremes"))  # fmt: skip
    return Response(excited[0].order, found["torque"], half_range(found["torque_extremes"]))


def natural_table(shaft: ShaftSystem) -> list[list[str]]:
    """Natural frequencies, and the speeds at which orders meet them; heads first."""
    rows = [["natural frequency", "Hz", "rpm at which orders meet it"]]
    orders = np.arange(0.5, HIGHEST_ORDER + 0.5, 0.5)
    rpm = critical_speeds(shaft, orders, *(SPEEDS[[0, -1]] * RPM)) / RPM
    for number, omega in enumerate(natural_modes(shaft).omega[:3]):
        meets = [
            f"{order:g} at {speed:.0f}"
            for order, speed in zip(orders, rpm[:, number], strict=True) if np.isfinite(speed)
        ]  # fmt: skip
        hertz = f"{omega / (2 * np.pi):.1f}"
        rows.append([str(number + 1), hertz, "; ".join(meets) or "none"])
    return rows


def peak_table(found: Response, shaft: int) -> list[list[str]]:
    """Highest responses of one shaft over speed, and the order that is most of them."""
    curve = found.range[:, shaft]
    inside = np.flatnonzero((curve[1:-1] > curve[:-2]) & (curve[1:-1] >= curve[2:])) + 1
    rows = [["rpm", "torque, N m", "its largest order", "amplitude of that order, N m"]]
    for i in sorted(inside, key=lambda i: -curve[i])[:5]:
        sizes = np.abs(found.torque[i, shaft])
        top = int(sizes.argmax())
        order = f"{found.order[top]:g}"
        rows.append([f"{SPEEDS[i]:.0f}", f"{curve[i]:.0f}", order, f"{sizes[top]:.0f}"])
    return rows


def draw(found: Response) -> None:
    with sheet("torsional_vibration", (7.0, 3.4), columns=2) as (_, ((left, right),)):
        for panel, shaft in ((left, 7), (right, 0)):
            panel.plot(SPEEDS, found.range[:, shaft], color="black", label="all orders")
            curves = np.abs(found.torque[:, shaft])
            for rank, place in enumerate(np.argsort(-curves.max(axis=0))[:4]):
                panel.plot(
                    SPEEDS, curves[:, place], color=shade(rank / 4 + 0.1),
                    linestyle=DASHES[rank + 1], label=f"order {found.order[place]:g}",
                )  # fmt: skip
            panel.set_title(f"between {NAMES[shaft]} and {NAMES[shaft + 1]}")
            panel.set_xlabel("Engine speed (rpm)")
            panel.set_ylim(bottom=0.0)
            panel.legend()
        left.set_ylabel("Torque in the shaft, half of its range (N m)")


def documents(found: Response) -> dict[Path, str]:
    """The page, and the files of peaks beside it."""
    values = {"natural_table": markdown(natural_table(diesel_shaft()))}
    files = {}
    for name, place in PEAKS.items():
        rows = peak_table(found, place)
        speed, torque, order, _ = rows[1]
        values[f"{name}_peak"] = f"{torque} N m at {speed} rpm, mostly order {order},"
        files[DOCUMENT.with_name(f"{DOCUMENT.stem}_{name}.csv")] = csv_text(rows)
    return {DOCUMENT: filled(TEMPLATE.read_text(encoding="utf-8"), values), **files}


if __name__ == "__main__":
    wanted = figures_wanted("Write docs/torsional_vibration.md.")
    response = over_speed(diesel_shaft())
    write(documents(response))
    if wanted:
        draw(response)
