"""Parameters of single cylinders: `pressure_factor_3` is the factor on cylinder 3's pressure.

A list in [set] gives the values of all cylinders at once. These parameters give the value of one
cylinder, so it can vary from design to design: a gradual misfire, random masses, a crank pin turned
through the cycle.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any, NamedTuple

from engine_dyn.geometry.arrangement import MOST_CYLINDERS
from engine_dyn.geometry.cylinders import LARGEST_FACTOR, SMALLEST_RADIUS, Cylinders
from engine_dyn.quantities.node import Node
from engine_dyn.units import DEGREE


class Place(NamedTuple):
    """Kind of a parameter, such as `pressure_factor`, and the number of its cylinder, from 1."""

    what: str
    number: int


_FACTOR: dict[str, Any] = {
    "low": 0.0, "low_included": True, "high": LARGEST_FACTOR, "high_included": True,
}  # fmt: skip

PATTERNS: Mapping[str, Node] = MappingProxyType(
    {
        node.name: node
        for node in (
            Node(
                "pressure_factor_N", "f_N", "1",
                "factor on the combustion pressure (pressure above motored) of cylinder N, 0 for "
                "a misfire",
                "this project", kind="parameter", **_FACTOR,
            ),
            Node(
                "mass_factor_N", "m_N/m", "1", "factor on the reciprocating mass of cylinder N",
                "this project", kind="parameter", **_FACTOR,
            ),
            Node(
                "radius_factor_N", "r_N/r", "1",
                "crank radius of cylinder N, from 2 on, over that of cylinder 1", "this project",
                kind="parameter", **{**_FACTOR, "low": SMALLEST_RADIUS},
            ),
            Node(
                "firing_angle_N", r"\varphi_N", "degree",
                "crank angle at which cylinder N, from 2 on, fires; if the cylinder has its own "
                "throw, the throw moves with it",
                "this project", si=DEGREE, kind="parameter", low=0.0, low_included=True, high=720.0,
            ),
        )
    }
)  # fmt: skip
"""The parameters as tables and messages list them: N is the number of a cylinder."""


def _named() -> dict[str, tuple[Place, Node]]:
    nodes = {}
    for pattern in PATTERNS.values():
        what = pattern.name.removesuffix("_N")
        # Crank angle and stroke are those of cylinder 1.
        for number in range(2 if "from 2 on" in pattern.long_name else 1, MOST_CYLINDERS + 1):
            text = pattern.long_name.replace(" N, from 2 on,", " N").replace(" N", f" {number}")
            node = replace(
                pattern, name=f"{what}_{number}", long_name=text,
                symbol=pattern.symbol.replace("N", f"{{{number}}}"), public=False,
            )  # fmt: skip
            nodes[node.name] = Place(what, number), node
    return nodes


_NAMED = _named()

PARAMETERS = tuple(node for _, node in _NAMED.values())

OF_CYLINDER: Mapping[str, Place] = MappingProxyType({k: place for k, (place, _) in _NAMED.items()})
"""Parameter and cylinder of each name."""


def with_values(cylinders: Cylinders, values: Mapping[str, float]) -> Cylinders:
    """Return the same cylinders with some of these parameters, by name, in SI units.

    Raises
    ------
    ValueError
        One line that begins with the name: a cylinder that does not exist, or what
        `Cylinders.with_factors` and `Cylinders.firing_at` refuse.
    """
    if not values:
        return cylinders
    factors: dict[str, list[float]] = {}
    for key, value in values.items():
        what, number = OF_CYLINDER[key]
        if number > cylinders.count:
            raise ValueError(f"{key}: must be of one of the {cylinders.count} cylinders")
        if what == "firing_angle":
            try:
                cylinders = cylinders.firing_at(number, value)
            except ValueError as error:
                raise ValueError(f"{key}: {error}") from None
            continue
        each = factors.setdefault(what, list(getattr(cylinders, f"{what}s")))
        each[number - 1] = value
    return cylinders.with_factors(**{what: tuple(each) for what, each in factors.items()})
