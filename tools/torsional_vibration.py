"""Write docs/torsional_vibration.md: a shaft excited by the orders of an engine's torque.

The measured diesel of the catalogue, its shaft of nine inertias, and the torsional response over
speed, solved here with numpy. The same excitation goes into openTorsion: see the document. Run it
from the project's root: `python tools/torsional_vibration.py`; `--no-figures` leaves the figure
alone.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from csv_tables import as_csv, rows_of

import sweeps
from engine_dyn.types import Complexes, Floats
from sweeps.exploring.torsion import QUANTITIES, Excitation, excitation

ROOT = Path(__file__).resolve().parents[1]
TEMPLATE = Path(__file__).with_suffix(".md.in")
DOCUMENT = ROOT / "docs" / "torsional_vibration.md"
PEAKS = {"flywheel": 7, "pulley": 0}
"""Shafts whose peaks have a file beside the page, by their number."""

FIGURE = ROOT / "docs" / "figures" / "torsional_vibration.png"


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


@dataclass(frozen=True)
class Shaft:
    """Discs on a line of shafts.

    Attributes
    ----------
    inertia : ndarray, shape (n,)
        kg m2.
    stiffness : ndarray, shape (n - 1,)
        N m/rad, from each disc to the next.
    damping : ndarray, shape (n,)
        N m s/rad, of each disc against the frame.
    loss_factor : float
        Imaginary over real part of the stiffness.
    """

    inertia: Floats
    stiffness: Floats
    damping: Floats
    loss_factor: float = 0.0

    @property
    def matrix(self) -> Floats:
        """Stiffness matrix, without damping."""
        found = np.zeros((self.inertia.size, self.inertia.size))
        for i, k in enumerate(self.stiffness):
            found[i : i + 2, i : i + 2] += k * np.array([[1.0, -1.0], [-1.0, 1.0]])
        return found

    def natural_frequencies(self) -> Floats:
        """Of the undamped shaft [rad/s], without the rigid turn."""
        scale = 1.0 / np.sqrt(self.inertia)
        values = np.linalg.eigvalsh(scale[:, None] * self.matrix * scale)
        return np.sqrt(values[1:])

    def response(self, torque: Complexes, omega: Floats) -> Complexes:
        """Angle of each disc [rad] under U exp(i omega t), shape (n, orders)."""
        found = np.empty(torque.shape, dtype=np.complex128)
        for i, w in enumerate(omega):
            dynamic = (1.0 + 1j * self.loss_factor) * self.matrix
            dynamic = dynamic + np.diag(1j * w * self.damping - w**2 * self.inertia)
            found[:, i] = np.linalg.solve(dynamic, torque[:, i])
        return found

    def torques(self, angle: Complexes) -> Complexes:
        """Torque in each shaft [N m], shape (n - 1, orders)."""
        stiffness = (1.0 + 1j * self.loss_factor) * self.stiffness
        return stiffness[:, None] * np.diff(angle, axis=0)


def diesel_shaft() -> Shaft:
    damping = np.zeros(len(INERTIAS))
    damping[list(CYLINDERS)] = ABSOLUTE_DAMPING
    return Shaft(np.array(INERTIAS), np.array(STIFFNESSES), damping, LOSS_FACTOR)


def diesel_orders() -> Any:
    """Archive with the excitation at every speed."""
    return sweeps.run(
        {
            "title": "Excitation of the shaft of the measured diesel",
            "engine": "diesel_105x137",
            "axes": {"speed": SPEEDS.tolist()},
            "output": {"quantities": list(QUANTITIES), "highest_order": HIGHEST_ORDER},
        }
    )


def half_range(orders: Floats, torque: Complexes) -> Floats:
    """Half the range over a cycle of the sum of orders, shape (shafts,)."""
    phi = np.arange(1440) * (4.0 * np.pi / 1440)
    curves = (torque[..., None] * np.exp(1j * orders[:, None] * phi)).real.sum(axis=-2)
    return 0.5 * (curves.max(axis=-1) - curves.min(axis=-1))


def over_speed(archive: Any, shaft: Shaft) -> tuple[Floats, Complexes, list[Excitation]]:
    """Half ranges of the torque in each shaft over speed, the orders of it, the excitations."""
    ranges, orders, excited = [], [], []
    for speed in archive["speed"].values:
        one = excitation(archive, CYLINDERS, speed=float(speed))
        torque = shaft.torques(shaft.response(one.matrix(len(INERTIAS)), one.omega))
        ranges.append(half_range(one.order, torque))
        orders.append(torque)
        excited.append(one)
    return np.array(ranges), np.array(orders), excited


def natural_table(shaft: Shaft) -> str:
    lines = ["| natural frequency | Hz | rpm at which orders meet it |", "| --- | ---: | --- |"]
    for number, omega in enumerate(shaft.natural_frequencies()[:3], start=1):
        meets = []
        for order in np.arange(0.5, HIGHEST_ORDER + 0.5, 0.5):
            rpm = 30.0 * omega / np.pi / order
            if SPEEDS[0] <= rpm <= SPEEDS[-1]:
                meets.append(f"{order:g} at {rpm:.0f}")
        lines.append(f"| {number} | {omega / (2 * np.pi):.1f} | {'; '.join(meets) or 'none'} |")
    return "\n".join(lines)


def peak_table(ranges: Floats, orders: Complexes, excited: list[Excitation], shaft: int) -> str:
    """Highest responses of one shaft over speed, and the order that is most of them."""
    curve = ranges[:, shaft]
    inside = np.flatnonzero((curve[1:-1] > curve[:-2]) & (curve[1:-1] >= curve[2:])) + 1
    best = sorted(inside, key=lambda i: -curve[i])[:5]
    lines = [
        "| rpm | torque, N m | its largest order | amplitude of that order, N m |",
        "| ---: | ---: | ---: | ---: |",
    ]
    for i in best:
        sizes = np.abs(orders[i, shaft])
        top = int(sizes.argmax())
        order = excited[i].order[top]
        lines.append(f"| {SPEEDS[i]:.0f} | {curve[i]:.0f} | {order:g} | {sizes[top]:.0f} |")
    return "\n".join(lines)


def draw(ranges: Floats, orders: Complexes, excited: list[Excitation]) -> None:
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    from sweeps.figures.marks import DASHES, shade
    from sweeps.figures.sheet import STYLE

    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(STYLE)  # type: ignore[arg-type]
        figure = Figure(figsize=(7.0, 3.4), layout="constrained")
        FigureCanvasAgg(figure)
        panels = figure.subplots(1, 2)
        for panel, shaft in zip(panels, (7, 0), strict=True):
            panel.plot(SPEEDS, ranges[:, shaft], color="black", linewidth=1.6, label="all orders")
            sizes = np.abs(orders[:, shaft]).max(axis=0)
            for rank, place in enumerate(np.argsort(-sizes)[:4]):
                panel.plot(
                    SPEEDS, np.abs(orders[:, shaft, place]), color=shade(rank / 4 + 0.1),
                    linestyle=DASHES[rank + 1], label=f"order {excited[0].order[place]:g}",
                )  # fmt: skip
            panel.set_title(f"between {NAMES[shaft]} and {NAMES[shaft + 1]}")
            panel.set_xlabel("Engine speed (rpm)")
            panel.set_ylim(bottom=0.0)
            panel.legend()
        panels[0].set_ylabel("Torque in the shaft, half of its range (N m)")
        figure.savefig(FIGURE, dpi=130, metadata={"Software": None})


def peak(table: str) -> str:
    """The largest torque of a table, in words."""
    speed, torque, order, _ = rows_of(table)[1]
    return f"{torque} N m at {speed} rpm, mostly order {order},"


def document() -> tuple[str, tuple[Floats, Complexes, list[Excitation]]]:
    shaft = diesel_shaft()
    found = over_speed(diesel_orders(), shaft)
    text = TEMPLATE.read_text(encoding="utf-8")
    peaks = {f"{name}_peak": peak(peak_table(*found, place)) for name, place in PEAKS.items()}
    for name, value in {"natural_table": natural_table(shaft), **peaks}.items():
        text = text.replace("{{ " + name + " }}", value)
    return text, found


def main() -> None:
    parser = argparse.ArgumentParser(description="Write docs/torsional_vibration.md.")
    parser.add_argument("--no-figures", action="store_true")
    arguments = parser.parse_args()
    text, found = document()
    DOCUMENT.write_text(text, encoding="utf-8")
    for name, place in PEAKS.items():
        path = DOCUMENT.with_name(f"{DOCUMENT.stem}_{name}.csv")
        path.write_text(as_csv(peak_table(*found, place)), encoding="utf-8")
    if not arguments.no_figures:
        draw(*found)


if __name__ == "__main__":
    main()
