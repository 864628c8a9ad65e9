"""Drawings of docs/conventions.md: angle, mechanism with its forces, numbering of the cylinders.

`python tools/convention_figures.py` writes them into docs/figures. Their ground is white, so
that they can be read on dark pages too.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib

matplotlib.use("agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import Arc, Circle, FancyArrowPatch, Rectangle

from sweeps.reading.engine_files import load_engine

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FIGURES = Path(__file__).resolve().parents[1] / "docs" / "figures"

INK = "#222222"
GREY = "#8a8a8a"
PALE = "#dddddd"
BLUE = "#1b4f9c"
RED = "#d1541b"
GREEN = "#2f7d55"
PURPLE = "#7b2d8b"

RADIUS = 1.0
ROD = 3.0
"""Length of the rod in crank radii: shorter than usual, so that its angle can be seen."""

STYLE: Any = {"font.family": "DejaVu Sans", "font.size": 9, "savefig.dpi": 160}


def at(angle: float, length: float = 1.0) -> tuple[float, float]:
    """Point at an angle [degree], clockwise from upright."""
    return length * math.sin(math.radians(angle)), length * math.cos(math.radians(angle))


def arrow(
    axes: Axes, start: tuple[float, float], end: tuple[float, float], colour: str, **kw: Any
) -> None:
    """An arrow from one point to another."""
    axes.add_patch(
        FancyArrowPatch(
            start,
            end,
            arrowstyle=kw.pop("arrowstyle", "-|>"),
            mutation_scale=kw.pop("size", 11),
            color=colour,
            shrinkA=0,
            shrinkB=0,
            linewidth=kw.pop("width", 1.6),
            zorder=kw.pop("zorder", 6),
            **kw,
        )
    )


def turning(
    axes: Axes, centre: tuple[float, float], radius: float, ends: tuple[float, float], colour: str
) -> None:
    """An arrow on a circle from one angle to another [degree], clockwise from upright."""
    angles = np.linspace(*ends, 60)
    points = np.array([at(a, radius) for a in angles]) + centre
    axes.plot(*points[:-3].T, color=colour, linewidth=1.6, zorder=6)
    arrow(axes, tuple(points[-6]), tuple(points[-1]), colour)


def bare(axes: Axes, width: tuple[float, float], height: tuple[float, float], title: str) -> None:
    """No frame, equal scales."""
    axes.set_aspect("equal")
    axes.set_xlim(*width)
    axes.set_ylim(*height)
    axes.axis("off")
    axes.set_title(title, fontsize=10, loc="left")


def crank_train(axes: Axes, crank_angle: float) -> tuple[tuple[float, float], tuple[float, float]]:
    """Draw crank, rod, piston and cylinder; return crank pin and piston pin."""
    pin = at(crank_angle, RADIUS)
    wrist = (0.0, pin[1] + math.sqrt(ROD**2 - pin[0] ** 2))
    top = ROD + RADIUS
    for side in (-0.78, 0.78):
        axes.plot([side, side], [top - 2.45, top + 0.75], color=INK, linewidth=2.2)
    axes.plot([-0.78, 0.78], [top + 0.75, top + 0.75], color=INK, linewidth=2.2)
    axes.plot([0, 0], [-1.35, top + 1.0], color=GREY, linewidth=0.8, linestyle=(0, (8, 2, 1, 2)))
    axes.add_patch(Circle((0, 0), RADIUS, fill=False, color=GREY, linewidth=0.8, linestyle=":"))
    axes.add_patch(
        Rectangle((-0.74, wrist[1] - 0.45), 1.48, 0.9, facecolor=PALE, edgecolor=INK, linewidth=1.2)
    )
    axes.plot([0, pin[0]], [0, pin[1]], color=INK, linewidth=5, solid_capstyle="round", zorder=3)
    axes.plot([pin[0], wrist[0]], [pin[1], wrist[1]], color=INK, linewidth=2.5, zorder=4)
    for point, size in (((0.0, 0.0), 0.16), (pin, 0.13), (wrist, 0.11)):
        axes.add_patch(Circle(point, size, facecolor="white", edgecolor=INK, zorder=5))
    return pin, wrist


def mechanism() -> Any:
    """Geometry, and the forces of one cylinder with the torques of the engine."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(7.6, 5.2))
    figure.subplots_adjust(0.01, 0.01, 0.99, 0.94, 0.03)
    crank_angle = 50.0
    top = ROD + RADIUS

    bare(left, (-2.75, 2.85), (-2.15, 5.2), "Angles, lengths and offset")
    pin, wrist = crank_train(left, crank_angle)
    left.add_patch(Arc((0, 0), 1.3, 1.3, theta1=90 - crank_angle, theta2=90, color=BLUE))
    left.text(*at(22, 0.86), "φ", color=BLUE, ha="center", va="center", fontsize=12)
    beta = math.degrees(math.asin(pin[0] / ROD))
    left.add_patch(Arc(wrist, 3.4, 3.4, theta1=270, theta2=270 + beta, color=BLUE))
    left.text(0.17, wrist[1] - 2.0, "β", color=BLUE, fontsize=12, ha="center")
    left.text(0.62, 0.22, "r", fontsize=11)
    left.text(0.66, 1.45, "l", fontsize=11)
    turning(left, (0, 0), 1.35, (85, 140), INK)
    left.text(*at(108, 1.5), "sense of\nrotation", va="center", fontsize=8.5)
    for height, text in ((top, "top\ndead centre"), (top - 2 * RADIUS, "bottom\ndead centre")):
        left.plot([-1.15, 0], [height, height], color=GREY, linewidth=0.8)
        left.text(-1.2, height, text, ha="right", va="center", fontsize=8.5)
    arrow(left, (-0.98, top), (-0.98, wrist[1]), RED)
    left.text(-1.08, wrist[1] - 0.02, "travel x", color=RED, ha="right", va="top")
    arrow(left, (1.2, top - 0.2), (1.2, top - 1.3), RED)
    left.text(1.3, top - 0.75, "x, velocity and\nacceleration\nare positive\nthis way", color=RED,
              va="center", fontsize=8.5)  # fmt: skip
    left.plot([0.35, 0.35], [-1.9, -1.2], color=PURPLE, linewidth=1)
    left.plot([0, 0], [-1.9, -1.2], color=PURPLE, linewidth=1)
    arrow(left, (0, -1.78), (0.35, -1.78), PURPLE, size=8)
    left.text(0.45, -1.8, "offset e: positive on the side\nwhere the crank pin moves down",
              color=PURPLE, va="center", fontsize=8.5)  # fmt: skip

    bare(right, (-2.75, 2.85), (-2.15, 5.2), "Forces of cylinder 1, and torques")
    pin, wrist = crank_train(right, crank_angle)
    arrow(right, (0, wrist[1] + 1.35), (0, wrist[1] + 0.5), BLUE)
    right.text(0.12, wrist[1] + 1.02, "P", color=BLUE, fontsize=12)
    arrow(right, (-0.78, wrist[1] - 0.15), (-1.55, wrist[1] - 0.15), PURPLE)
    right.text(-1.62, wrist[1] - 0.15, "N", color=PURPLE, fontsize=12, ha="right", va="center")
    along = np.subtract(pin, wrist) / ROD
    start = np.array(pin) + 0.9 * along
    arrow(right, tuple(np.array(pin) + 0.13 * along), tuple(start), INK)
    right.text(start[0] + 0.07, start[1] - 0.2, "S", fontsize=12)
    tangent = np.array(at(crank_angle + 90))
    radial = -np.array(at(crank_angle))
    arrow(right, pin, tuple(np.array(pin) + 0.95 * tangent), GREEN)
    right.text(*(np.array(pin) + 1.05 * tangent), "T", color=GREEN, fontsize=12, va="center")
    arrow(right, pin, tuple(np.array(pin) + 0.68 * radial), RED)
    right.text(*(np.array(pin) + 0.62 * radial + (-0.1, 0.16)), "R", color=RED, fontsize=12,
               ha="right")  # fmt: skip
    turning(right, (0, 0), 1.3, (185, 245), GREEN)
    right.text(-0.6, -1.42, "torque, driver torque:\npositive in the sense of rotation",
               color=GREEN, ha="center", va="top", fontsize=8.5)  # fmt: skip
    turning(right, (0, 0), 1.3, (330, 275), RED)
    right.text(-1.35, 0.95, "load torque:\npositive against it", color=RED, ha="right",
               va="center", fontsize=8.5)  # fmt: skip
    names = [
        ("P", "piston_force", BLUE),
        ("N", "wall_thrust", PURPLE),
        ("S", "rod_force", INK),
        ("T", "tangential_force", GREEN),
        ("R", "radial_force", RED),
    ]
    for k, (letter, name, colour) in enumerate(names):
        right.text(0.92, 3.3 - 0.27 * k, f"{letter}  {name}", color=colour, fontsize=8)
    return figure


def angle() -> Any:
    """The cycle with its strokes and dead centres, and the other zeros that figures may have."""
    figure, axes = plt.subplots(figsize=(7.6, 3.1), layout="constrained")
    diagram = load_engine("ntua", Path()).family.diagrams[1]
    degrees = np.degrees(diagram.angle)
    axes.plot(degrees, diagram.pressure / 1e5, color=BLUE, linewidth=1.6)
    axes.set_ylim(-38, 105)
    axes.set_xlim(-360, 360)
    axes.set_xticks(range(-360, 361, 90))
    axes.set_yticks([0, 20, 40, 60])
    axes.set_ylabel("pressure of cylinder 1, bar", loc="top")
    axes.set_xlabel("crank angle φ, degree")
    for name, middle in (("intake", -270), ("compression", -90), ("expansion", 90),
                         ("exhaust", 270)):  # fmt: skip
        axes.text(middle, 92, name, ha="center", va="center", fontsize=9)
    for place in (-180, 0, 180):
        axes.axvline(place, color=GREY, linewidth=0.8, linestyle=":")
    axes.text(8, 76, "firing top dead centre", fontsize=8.5, color=RED)
    zeros = (
        (-360, "gas-exchange-tdc", "left", 6),
        (-180, "bdc", "center", 0),
        (0, "firing-tdc (default)", "center", 0),
        (180, "expansion-bdc", "center", 0),
    )
    for place, name, side, shift in zeros:
        axes.plot(place, -6, marker="^", color=RED, markersize=6, clip_on=False)
        low = -25 if name == "bdc" else -13
        axes.text(place + shift, low, f"--zero {name}", color=RED, fontsize=8.5, ha=side, va="top")
    return figure


def cylinders() -> Any:
    """Numbers of throws, main journals, cylinders and banks; angles of throws and banks."""
    figure = plt.figure(figsize=(7.6, 6.2), layout="constrained")
    grid = figure.add_gridspec(2, 2, height_ratios=(1, 1.15))

    shaft = figure.add_subplot(grid[0, :])
    bare(shaft, (-1.4, 11.4), (-1.75, 2.1), "Along the shaft: an in-line four")
    places = [1.2, 3.6, 6.0, 8.4]
    for k, place in enumerate(places):
        height = 0.62 if k in (0, 3) else -0.62
        shaft.plot([place - 0.6, place - 0.6, place + 0.6, place + 0.6],
                   [0, height, height, 0], color=INK, linewidth=4, solid_joinstyle="round",
                   zorder=3)  # fmt: skip
        shaft.plot([place, place], [height, 1.25], color=INK, linewidth=1.6, zorder=2)
        shaft.add_patch(Rectangle((place - 0.45, 1.25), 0.9, 0.45, facecolor=PALE, edgecolor=INK))
        shaft.text(place, 1.475, str(k + 1), ha="center", va="center", color=BLUE, fontsize=11)
        shaft.text(place + 0.75, 0.7 if k in (0, 3) else -0.75, f"throw {k + 1}", fontsize=8.5,
                   va="center", ha="left")  # fmt: skip
    for k, place in enumerate([0.0, 2.4, 4.8, 7.2, 9.6]):
        shaft.plot([place - 0.6, place + 0.6], [0, 0], color=INK, linewidth=4, zorder=3)
        journal = Rectangle((place - 0.28, -0.26), 0.56, 0.52, facecolor="white", edgecolor=RED)
        journal.set(zorder=4, linewidth=1.4)
        shaft.add_patch(journal)
        shaft.text(place, 0, str(k + 1), ha="center", va="center", color=RED, fontsize=9, zorder=5)
    shaft.add_patch(Rectangle((10.2, -1.0), 0.35, 2.0, facecolor=PALE, edgecolor=INK, zorder=4))
    shaft.text(10.4, -1.15, "flywheel,\ntake-off", ha="center", va="top", fontsize=8.5)
    shaft.text(-1.3, 0.55, "free end", fontsize=8.5)
    shaft.text(-1.3, 1.475, "cylinders", color=BLUE, fontsize=8.5, va="center")
    shaft.text(-1.3, -0.6, "main journals", color=RED, fontsize=8.5, va="center")
    arrow(shaft, (0.6, -1.35), (4.2, -1.35), PURPLE)
    shaft.text(4.35, -1.35, "positive direction along the shaft", color=PURPLE, fontsize=8.5,
               va="center")  # fmt: skip

    plan = figure.add_subplot(grid[1, 0])
    bare(plan, (-0.6, 6.2), (-1.1, 5.6), "Seen from above: two numberings of a V6")
    for column, (title, numbers) in enumerate(
        (("bank by bank", ((1, 4), (2, 5), (3, 6))), ("alternate", ((1, 2), (3, 4), (5, 6))))
    ):
        middle = 1.15 + 3.2 * column
        for row, pair in enumerate(numbers):
            for side, number in zip((-0.62, 0.62), pair, strict=True):
                centre = (middle + side, 0.8 + 1.3 * row + (-0.12 if side < 0 else 0.12))
                plan.add_patch(Circle(centre, 0.5, facecolor=PALE, edgecolor=INK))
                plan.text(*centre, str(number), ha="center", va="center", color=BLUE, fontsize=11)
        plan.text(middle - 0.62, -0.05, "bank 1", ha="center", fontsize=8.5)
        plan.text(middle + 0.62, -0.05, "bank 2", ha="center", fontsize=8.5)
        plan.text(middle, 4.75, title, ha="center", fontsize=9.5)
        plan.text(middle, 4.3, "flywheel", ha="center", va="center", fontsize=8.5, color=GREY)
        plan.text(middle, -0.25, "free end", ha="center", va="top", fontsize=8.5, color=GREY)

    end = figure.add_subplot(grid[1, 1])
    bare(end, (-2.6, 3.3), (-1.9, 3.4), "Along the shaft, at φ = 0: banks and throws")
    for bank, colour in ((0, BLUE), (76, BLUE)):
        end.plot(*zip((0, 0), at(bank, 2.5), strict=True), color=colour, linewidth=1,
                 linestyle=(0, (8, 2, 1, 2)))  # fmt: skip
    end.text(*at(0, 2.6), "bank 1: direction 0°\n(cylinder 1)", ha="center", va="bottom",
             fontsize=8.5, color=BLUE)  # fmt: skip
    end.text(at(76, 1.7)[0], at(76, 2.5)[1] + 0.12, "bank 2: 76°", ha="left", va="bottom",
             fontsize=8.5, color=BLUE)  # fmt: skip
    for throw, name in ((0, "throw 1: 0°"), (28, "throw 2: 28°"), (180, "throw 3: 180°"),
                        (208, "throw 4: 208°")):  # fmt: skip
        end.plot(*zip((0, 0), at(throw), strict=True), color=INK, linewidth=3.5,
                 solid_capstyle="round")  # fmt: skip
        end.add_patch(Circle(at(throw), 0.13, facecolor="white", edgecolor=INK, zorder=5))
        x, y = at(throw, 1.25)
        right = throw in (28, 180)
        end.text(x + (0.12 if right else -0.12), y, name, ha="left" if right else "right",
                 va="center", fontsize=8.5)  # fmt: skip
    end.add_patch(Circle((0, 0), 0.17, facecolor="white", edgecolor=INK, zorder=5))
    turning(end, (0, 0), 1.75, (250, 300), INK)
    end.text(*at(275, 1.85), "sense of\nrotation", ha="right", va="center", fontsize=8.5)
    arrow(end, (0, 0), at(90, 2.3), PURPLE, size=9, width=1.1)
    end.text(2.35, -0.05, "direction 90°\nof shaking\nforces", color=PURPLE, fontsize=8.5,
             va="top", ha="center")  # fmt: skip
    return figure


DRAWINGS = {
    "conventions_angle.png": angle,
    "conventions_mechanism.png": mechanism,
    "conventions_cylinders.png": cylinders,
}


def main(folder: Path = FIGURES) -> None:
    """Write the drawings."""
    with plt.rc_context(STYLE):
        for name, draw in DRAWINGS.items():
            figure = draw()
            figure.savefig(folder / name, metadata={"Software": None})
            plt.close(figure)
            print(folder / name)


if __name__ == "__main__":
    main()
