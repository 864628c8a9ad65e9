"""[[diagram]] of kind 'torque': the engine's torque over the crank angle in place of pressure.

It is given as points or orders of a file, in closed form, or as areas between crossings with the
mean line.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import Field

from engine_dyn.loads.torque_curves import (
    LARGEST,
    MOST_ORDERS,
    MOST_REVOLUTIONS,
    REVOLUTION,
    TorqueOverAngle,
    torque_of_harmonics,
)
from engine_dyn.units import DEGREE
from sweeps.base.checks import Strict, check_structure, mentioned
from sweeps.base.errors import SceneError
from sweeps.base.files.regular_files import referred

LOBE = 36  # Intervals that an area between two crossings is divided into


class Harmonic(Strict):
    """One order of a torque in closed form."""

    order: float = Field(description="a number above 0: oscillations in a revolution")
    sine: float = Field(default=0.0, description="a number in N m: the factor of its sine")
    cosine: float = Field(default=0.0, description="a number in N m: the factor of its cosine")
    amplitude: float | None = Field(
        default=None, ge=0.0,
        description="a number in N m, 0 or more, in place of sine and cosine",
    )  # fmt: skip
    phase: float = Field(
        default=0.0, description="a number in degree: psi of amplitude cos(order angle + psi)"
    )

    @property
    def parts(self) -> tuple[float, float]:
        """Factors of sine and cosine [N m]."""
        if self.amplitude is None:
            return self.sine, self.cosine
        psi = self.phase * DEGREE
        return -self.amplitude * math.sin(psi), self.amplitude * math.cos(psi)


class GivenTorque(Strict):
    """A torque over an angle: one of `file`, `harmonics` and `areas`."""

    kind: str
    file: str | None = Field(
        default=None,
        description="a string: the path of a file with angle and torque, or with a table of orders",
    )
    angle_column: str | int | None = Field(
        default=None, description="the name or number of the column of the crank angle"
    )
    torque_column: str | int | None = Field(
        default=None, description="the name or number of the column of the torque"
    )
    torque_unit: str | None = Field(
        default=None, description="a string: the unit of the torque, such as 'kN m'"
    )
    mean: float | None = Field(default=None, description="a number in N m: the mean torque")
    harmonics: list[Harmonic] | None = Field(
        default=None,
        description=f"a list of at most {MOST_ORDERS} tables with order, and sine and cosine, "
        "or amplitude and phase",
        max_length=MOST_ORDERS,
    )
    areas: list[float] | None = Field(
        default=None, min_length=2, max_length=1000,
        description="a list of 2 to 1000 areas in J between the torque and its mean, in sequence, "
        "those below it negative",
    )  # fmt: skip
    crossings: list[float] | None = Field(
        default=None,
        description="a list of crank angles in degrees at which the areas begin, and the last ends",
    )
    rounded: bool = Field(
        default=False,
        description="true or false: the areas are rounded as printed; what they add up to, at most "
        "1 percent of the sum of their sizes, is taken off all of them evenly",
    )
    revolutions: int | None = Field(
        default=None, ge=1, le=MOST_REVOLUTIONS,
        description="a whole number: revolutions that equally wide areas take together",
    )  # fmt: skip


class TorqueDiagram(GivenTorque):
    """[[diagram]] with kind = 'torque'."""

    of: Literal["engine", "cylinder"] = Field(
        default="engine",
        description="'engine', or 'cylinder': that of each cylinder, over the angle from its own "
        "firing dead centre",
    )


_BESIDE = {
    "file": ("angle_column", "torque_column", "torque_unit", "mean"),
    "harmonics": ("mean",),
    "areas": ("mean", "crossings", "revolutions", "rounded"),
}
"""Ways to give the torque, and the keys that belong to each."""


def read_torque_diagram(table: Mapping[str, Any], where: str, folder: Path) -> TorqueOverAngle:
    """Read the torque of a whole [[diagram]] table of kind 'torque'.

    The path of a file starts from `folder`; messages begin with `where`.
    """
    given = check_structure(TorqueDiagram, dict(table), where)
    ways = [way for way in _BESIDE if getattr(given, way) is not None]
    if len(ways) != 1:
        both = " and ".join(ways)
        said = f"has both {both}" if ways else "file, harmonics or areas: missing"
        raise SceneError(f"{where} {said}: give one of {', '.join(_BESIDE)}")
    for key in [key for keys in _BESIDE.values() for key in keys]:
        if key not in _BESIDE[ways[0]] and key in given.model_fields_set:
            raise SceneError(f"{where} {key}: not allowed together with {ways[0]}")
    if ways[0] != "file" and given.mean is None:
        raise SceneError(f"{where} mean: missing; must be a number in N m: the mean torque")
    try:
        if given.file is not None:
            # Engines without a file of torque need not load the readers of recordings.
            from sweeps.scene.features.torque_files import torque_of_file

            path = referred(folder, given.file, f"{where} file")
            return torque_of_file(
                path, f"{where} {given.file}", given.angle_column, given.torque_column,
                given.torque_unit, given.mean,
            )  # fmt: skip
        if given.harmonics is not None:
            return harmonics_of(given.harmonics, float(given.mean or 0.0))
        return _of_areas(given)
    except SceneError:  # The error names the file and its column already
        raise
    except ValueError as error:
        raise SceneError(f"{where}: {mentioned(error)}") from None


def harmonics_of(given: list[Harmonic], mean: float, own_angle: bool = False) -> TorqueOverAngle:
    """Torque in closed form; see `torque_of_harmonics` for what is refused."""
    orders = [one.order for one in given]
    twice = next((order for order in orders if orders.count(order) > 1), None)
    if twice is not None:
        raise ValueError(f"order = {twice:g}: given twice; must be given once")
    made = torque_of_harmonics(mean, {o.order: o.parts for o in given}, own_angle)
    for one in given:
        here, where = one.model_fields_set, f"order = {one.order:g}"
        if not {"sine", "cosine", "amplitude"} & here:
            raise ValueError(f"{where}: sine, cosine: missing; must have one or both, or amplitude")
        if "amplitude" in here and {"sine", "cosine"} & here:
            raise ValueError(f"{where}: has both amplitude and sine or cosine; give one of them")
        if "phase" in here and "amplitude" not in here:
            raise ValueError(f"{where}: phase: has no effect without amplitude")
    return made


def torque_warnings(tables: Sequence[Mapping[str, Any]], where: str) -> tuple[str, ...]:
    """Lines that say what was taken off areas that are rounded as printed."""
    return tuple(
        f"{where} areas: add up to {sum(areas):.4g} J, "
        f"{100.0 * abs(sum(areas)) / sum(map(abs, areas)):.2g} percent of the sum of their sizes; "
        "this is taken off all of them evenly (rounded = true)"
        for areas in (table["areas"] for table in tables if table.get("rounded"))
        if sum(areas)
    )


def _of_areas(given: TorqueDiagram) -> TorqueOverAngle:
    """Torque whose areas between crossings with its mean are given; each is a squared sine."""
    # The energy at the crossings, and thus its swing, depends on the areas alone, see
    # docs/torque_diagrams.md.
    areas, mean = np.array(given.areas), float(given.mean or 0.0)
    # The areas of a cycle may add up to a thousandth of the largest of them; where they are said to
    # be rounded, to a hundredth of the sum of their sizes.
    left, most = abs(areas.sum()), np.abs(0.01 * areas).sum()
    if left > (most if given.rounded else 1e-3 * np.abs(areas).max()):
        offer = f", to at most {most:.3g} J with rounded = true" if left <= most else ""
        if given.rounded:
            offer = f", to at most {most:.3g} J (1 percent of the sum of their sizes)"
        raise ValueError(
            f"areas add up to {areas.sum():.6g} J: must add up to 0 over a cycle{offer}"
        )
    if given.crossings is None:
        revolutions = given.revolutions or 1
        edges = np.linspace(0.0, 360.0 * revolutions, len(areas) + 1)
    else:
        edges = np.array(given.crossings)
        if given.revolutions is not None:
            raise ValueError("revolutions: not allowed together with crossings")
        if len(edges) != len(areas) + 1:
            raise ValueError(
                f"crossings: {len(edges)} angles for {len(areas)} areas: must be one more"
            )
        back = next((b for a, b in pairwise(edges.tolist()) if b <= a), None)
        if back is not None:
            raise ValueError(f"crossings: {back:g} degrees: must ascend")
        revolutions = round((edges[-1] - edges[0]) / 360.0)
        whole = abs(edges[-1] - edges[0] - 360.0 * revolutions) <= 1e-6
        if not (whole and 1 <= revolutions <= MOST_REVOLUTIONS):
            raise ValueError(
                f"crossings cover {edges[-1] - edges[0]:g} degrees: must cover whole revolutions, "
                f"{MOST_REVOLUTIONS} at most"
            )
    edges = edges * DEGREE
    part = np.arange(LOBE) / LOBE
    width = np.diff(edges)[:, None]
    with np.errstate(over="ignore"):
        height = 2.0 * (areas - areas.mean())[:, None] / width
    high = np.flatnonzero(~(np.abs(height[:, 0]) <= LARGEST))
    if high.size:
        raise ValueError(
            f"areas number {high[0] + 1} = {areas[high[0]]:g} J over "
            f"{width[high[0], 0] / DEGREE:g} degrees: the torque must be at most {LARGEST:g} N m"
        )
    angle = (edges[:-1, None] + width * part).reshape(-1)
    torque = mean + (height * np.sin(math.pi * part) ** 2).reshape(-1)
    slope = (height * math.pi / width * np.sin(2.0 * math.pi * part)).reshape(-1)
    return TorqueOverAngle(angle, torque, slope, revolutions * REVOLUTION)
