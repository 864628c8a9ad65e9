"""Speed characteristics: power and torque over speed, and the load whose diagram gives them.

Power units, lecture 18: N_e = N_max x [A + C x - x^2] with x = n/n_max, and M = N_e/omega. The
lecture writes 9550 N_e/n, with kW and rpm; its 9550 is 30000/pi = 9549.3, rounded. In all four sets
A + C = 2, so that N_e(n_max) = N_max.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt

from engine_dyn.quantities.features.feature import Feature
from engine_dyn.quantities.node import Node, parameter
from engine_dyn.types import Floats, Integers
from engine_dyn.units import RPM


@dataclass(frozen=True)
class Characteristic:
    """A curve of power over speed, as a polynomial of x = n/n_max.

    Attributes
    ----------
    constant, linear, square : float
        Coefficients of N_e/(N_max x) = constant + linear x + square x^2.
    source : str
        Author and equation.
    """

    constant: float
    linear: float
    square: float
    source: str

    def power(self, speed: Any, rated_power: Any, rated_speed: Any) -> Any:
        """Power [W] at crank speeds [rad/s]; arguments broadcast.

        Raises
        ------
        ValueError
            For a rated power or speed that is not above 0.
        """
        return self.torque(speed, rated_power, rated_speed) * np.asarray(speed, dtype=float)

    def torque(self, speed: Any, rated_power: Any, rated_speed: Any) -> Any:
        """Torque [N m] at crank speeds [rad/s], also at standstill; errors as `power`."""
        for name, value in (("rated_power", rated_power), ("rated_speed", rated_speed)):
            number = np.asarray(value, dtype=float)
            if not (number > 0.0).all():
                bad = number[~(number > 0.0)].flat[0]
                raise ValueError(f"{name} = {bad:g}: must be above 0")
        x = np.asarray(speed, dtype=float) / rated_speed
        relative = self.constant + x * (self.linear + x * self.square)
        return np.asarray(rated_power) / rated_speed * relative

    @property
    def largest_torque(self) -> tuple[float, float]:
        """Speed over rated speed at which the torque is largest, and that over the rated one."""
        x = -0.5 * self.linear / self.square
        return x, self.constant + x * (self.linear + x * self.square)


def _lecture(a: float, c: float) -> Characteristic:
    return Characteristic(a, c, -1.0, "Power units, lecture 18")


PROPELLER = Characteristic(0.0, 0.0, 1.0, "Kakaitsas section 3.2: torque over omega squared")
"""Characteristic of a fixed-pitch propeller: power over the cube of the speed."""

CHARACTERISTICS: Mapping[str, Characteristic] = MappingProxyType(
    {
        "spark ignition": _lecture(1.00, 1.00),
        "diesel": _lecture(0.87, 1.13),
        "pre-chamber diesel": _lecture(0.60, 1.40),
        "swirl-chamber diesel": _lecture(0.70, 1.30),
        "propeller": PROPELLER,
    }
)
"""Characteristics by name; "diesel" is for an undivided combustion chamber."""


SLACK = 1e-5
"""Share of a torque by which that of the first or the last diagram may miss it.

Diagrams that follow from the powers of a data sheet have these powers to 1e-6: the torque at its
first and last load is reached.
"""


def load_for_torque(
    torque_of: Callable[[Floats, Integers], Any], loads: npt.ArrayLike, wanted: npt.ArrayLike,
    resolution: float = 0.0,
) -> Floats:  # fmt: skip
    """Load [percent] at which the brake torque is what is wanted, for every element.

    Parameters
    ----------
    torque_of : callable
        Torque [N m] of loads; it rises with the load. Takes flat arrays: loads, and the places of
        their elements in `wanted`, of which only those without an answer are asked for.
    loads : array_like
        Loads of the given diagrams, ascending: between each two of them is a bracket.
    wanted : array_like
        [N m].
    resolution : float
        Difference of loads [percent] that the torque does not see.

    Returns
    -------
    ndarray
        Shape of `wanted`; NaN where the diagrams do not reach it. The root is found to rounding, by
        regula falsi (the Illinois form) in the first bracket that contains it.
    """
    shape = np.shape(wanted)
    goal = np.array(wanted, dtype=np.float64).reshape(-1)
    knots = np.asarray(loads, dtype=np.float64)
    every = np.arange(goal.size)
    miss = [np.asarray(torque_of(np.full(goal.size, load), every)) - goal for load in knots]
    # Where the wanted torque differs from that of the largest or smallest load by less than this,
    # that load is the solution.
    slack = SLACK * np.abs(goal)
    solution = np.full(goal.size, np.nan)
    for load, here in ((knots[-1], miss[-1]), (knots[0], miss[0])):
        solution = np.where(np.abs(here) <= slack, load, solution)
    low, high, below, above = np.full((4, goal.size), np.nan)
    for left, right, one, other in zip(knots, knots[1:], miss, miss[1:], strict=False):
        holds = np.isnan(low) & (one <= 0.0) & (other >= 0.0)
        low, high = np.where(holds, left, low), np.where(holds, right, high)
        below, above = np.where(holds, one, below), np.where(holds, other, above)
    todo = np.flatnonzero(np.isnan(solution) & np.isfinite(low))
    # Rows: both ends of the bracket, the torque missed at each, the end that stayed in the last
    # step (-1 the lower, 1 the upper, 0 before the first step), and the last load.
    bracket = np.stack([low, high, below, above, np.zeros(goal.size), low])[:, todo]
    for _ in range(60):
        if not todo.size:
            break
        low, high, below, above, side, last = bracket
        with np.errstate(divide="ignore", invalid="ignore"):
            load = (low * above - high * below) / (above - below)
        load = np.where(np.isfinite(load), np.clip(load, low, high), 0.5 * (low + high))
        here = np.asarray(torque_of(load, todo)) - goal[todo]
        done = (np.abs(here) <= 1e-13 * np.abs(goal[todo])) | (high - low <= 1e-13 * high)
        done |= np.abs(load - last) <= resolution
        solution[todo[done]] = load[done]
        down = here > 0.0
        # The missed torque of an end that stays twice is halved, so that the other end moves as
        # well.
        below = np.where(down, np.where(side < 0.0, 0.5 * below, below), here)
        above = np.where(down, here, np.where(side > 0.0, 0.5 * above, above))
        low, high = np.where(down, low, load), np.where(down, load, high)
        bracket = np.stack([low, high, below, above, np.where(down, -1.0, 1.0), load])[:, ~done]
        todo = todo[~done]
    solution[todo] = 0.5 * (bracket[0] + bracket[1])
    return solution.reshape(shape)


def made_of(name: str, known: dict[str, Any], variant_of: Callable[[str], Node]) -> Any:
    """Value of a node that formulas alone make of known ones; all on the way is then known too."""
    if name not in known:
        node = variant_of(name)
        assert node.make is not None
        known[name] = node.make(**{need: made_of(need, known, variant_of) for need in node.needs})
    return known[name]


def load_with_torque(
    wanted: Any, load: str, needs: Mapping[str, Any], variant_of: Callable[[str], Node]
) -> Floats:  # fmt: skip
    """Load with a mean brake torque, for every design; NaN where no diagram gives it.

    Parameters
    ----------
    wanted : array_like
        [N m]; broadcasts with the arrays among `needs`.
    load : str
        Name of the node of the load whose diagram the graph takes.
    needs : mapping
        Values of the nodes in `OF_TORQUE`, and in `OF_FRICTION` of the scene's law.
    variant_of : callable
        Variant of a node that the scene has.
    """
    wanted, torque_of = _torques(wanted, load, needs, variant_of)
    family = needs["family"]
    return load_for_torque(torque_of, family.loads, wanted, family.resolution)


def torque_beyond(
    wanted: Any, load: str, needs: Mapping[str, Any], variant_of: Callable[[str], Node]
) -> Floats:  # fmt: skip
    """Wanted mean brake torque less the nearest one of the diagrams; as `load_with_torque`."""
    wanted, torque_of = _torques(wanted, load, needs, variant_of)
    every = np.arange(wanted.size)
    given = [torque_of(np.full(wanted.size, one), every) for one in needs["family"].loads]
    flat = wanted.reshape(-1)
    beyond = flat - np.clip(flat, np.minimum.reduce(given), np.maximum.reduce(given))
    # As in `load_for_torque`
    return np.where(np.abs(beyond) <= SLACK * np.abs(flat), 0.0, beyond).reshape(wanted.shape)


def _torques(
    wanted: Any, load: str, needs: Mapping[str, Any], variant_of: Callable[[str], Node]
) -> tuple[Floats, Callable[[Floats, Integers], Any]]:  # fmt: skip
    """The wanted torque of every design, and the torque of some of them at other loads."""
    arrays = {n: v for n, v in needs.items() if isinstance(v, np.ndarray) and v.ndim}
    wanted = np.broadcast_to(
        wanted, np.broadcast_shapes(np.shape(wanted), *(v.shape for v in arrays.values()))
    )

    def torque_of(loads: Any, which: Any) -> Any:
        places = np.unravel_index(which, wanted.shape) if wanted.shape else ()
        known = {**needs, load: loads}
        known |= {n: np.broadcast_to(v, wanted.shape)[places] for n, v in arrays.items()}
        return made_of("torque_mean", known, variant_of)

    return wanted, torque_of


def _load_of_characteristic(
    *, characteristic_torque: Any, characteristic_share: Any, variant_of: Callable[[str], Node],
    **needs: Any,
) -> Any:  # fmt: skip
    wanted = np.asarray(characteristic_torque) * characteristic_share
    return load_with_torque(wanted, "load", needs, variant_of)


OF_TORQUE = (
    "variant_of", "speed", "family", "cycle",
    "crank_ratio", "offset_ratio", "pressure_share", "diagram_scale", "bore",
    "double_radius", "cylinders", "cylinder_set", "cylinders_by_count", "displacement", "period",
    "stroke_share", "all_cycles_known", "auxiliary_torque", "auxiliary_mean",
)  # fmt: skip
"""Nodes of the mean brake torque that do not depend on the load, whatever the law of friction."""

OF_FRICTION = {
    "chen_flynn": (
        "mean_piston_speed", "friction_constant", "friction_peak_pressure",
        "friction_mean_piston_speed", "friction_mean_piston_speed_square",
    ),
    "patton_nitschke_heywood": ("fmep_without_gas", "ring_gas_pressure_unthrottled"),
}  # fmt: skip
"""Nodes that each law of friction needs and that do not depend on the load."""

PARAMETERS = (
    parameter(
        "rated_power", "N_{max}", "W",
        "rated power of the full-load curve (speed characteristic)",
        "Power units, lecture 18", low=0.0,
    ),
    parameter(
        "rated_speed", "n_{max}", "rpm",
        "rated speed of the full-load curve (speed characteristic)",
        "Power units, lecture 18", low=0.0, si=RPM,
    ),
    parameter(
        "characteristic_share", "s", "1", "share of the full-load torque", "this project",
        low=0.0, low_included=True, make=lambda: 1.0,
    ),
    *(
        parameter(
            "load", "L", "percent", "engine load",
            "Power units, lecture 18", low=0.0, low_included=True, when=f"characteristic {law}",
            needs=("characteristic_torque", "characteristic_share", *OF_TORQUE, *needs),
            make=_load_of_characteristic,
        )
        for law, needs in OF_FRICTION.items()
    ),
)  # fmt: skip

_RATED = ("characteristic", "speed", "rated_power", "rated_speed")

NODES = (
    Node(
        "characteristic_power", "N_e", "W", "power on the full-load curve (speed characteristic)",
        "Power units, lecture 18", needs=_RATED,
        make=lambda characteristic, speed, rated_power, rated_speed: characteristic.power(
            speed, rated_power, rated_speed
        ),
    ),
    Node(
        "characteristic_torque", "M_e", "N m",
        "torque on the full-load curve (speed characteristic)",
        "Power units, lecture 18", needs=_RATED,
        make=lambda characteristic, speed, rated_power, rated_speed: characteristic.torque(
            speed, rated_power, rated_speed
        ),
    ),
    Node(
        "characteristic_load", "L", "percent",
        "engine load that gives this share of the full-load torque", "this project",
        needs=("load",), make=lambda load: load,
    ),
)  # fmt: skip

FEATURE: Feature[Characteristic] = Feature(
    "characteristic", "power and torque over speed", "speed characteristic", NODES,
    constant="characteristic",
    words=(
        {
            "given_load": "the load that names the diagram is given",
            "characteristic": "it follows from a speed characteristic",
        },
    ),
)  # fmt: skip
of = FEATURE.of
