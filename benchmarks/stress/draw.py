"""Designs drawn over absurd ranges, chunk by chunk, each chunk from its own seed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from benchmarks.stress.shapes import Shapes
from engine_dyn.pressure.family import Family
from engine_dyn.speed import dispatch
from engine_dyn.speed.fields import SCALAR_NAMES
from engine_dyn.types import Floats
from oracle import spline
from sweeps.scene.engine.engine_files import load_engine

ENGINE = "ntua"
CHUNK = 2**17

FEWEST = 8
"""Chunks of a run, so that each kind occurs."""

RANGES = {
    "inertia": (1e-6, 1e6), "reciprocating mass": (1e-6, 1e4), "crank ratio": (1e-6, 0.999),
    "speed": (1.0, 1e5), "bore": (1e-3, 1.0), "stroke": (1e-3, 2.0),
}  # fmt: skip
"""Drawn evenly in the logarithm; docs/stability/drawn.csv has the units and all others."""

CRANKCASES = (0.0, 101325.0)

COLUMNS = (
    "row", "crankcase", "crank_ratio", "bore", "stroke", "mass", "inertia", "speed", "exponent",
    "offset", "mean_torque", "friction", "cylinders", "variable",
)  # fmt: skip


@dataclass(frozen=True)
class Chunk:
    """Designs of one call of `sweep.solve`: arrays that broadcast; the closure is one for all.

    `wanted` are the results that are asked for; with `delta_error` a design takes several times as
    long. The diagrams are those of the catalogue engine, unless a family is given.
    """

    columns: dict[str, npt.NDArray[Any]]
    closure: str
    shape: tuple[int, ...]
    seed: tuple[int, int]
    wanted: tuple[str, ...] = SCALAR_NAMES
    diagrams: Family | None = None

    @property
    def size(self) -> int:
        """Number of designs."""
        return math.prod(self.shape)

    def solve(self, **options: Any) -> Any:
        """The kernels' answer, shaped as the product."""
        c: dict[str, Any] = {**self.columns}
        variable, crankcase, stroke, friction = (
            c.pop(name) for name in ("variable", "crankcase", "stroke", "friction")
        )
        return dispatch.solve(
            wanted=self.wanted, closure=self.closure, family=self.diagrams or family(), scale=1.0,
            inertia_model=np.where(variable, "variable", "constant"), crankcase_pressure=crankcase,
            double_radius=stroke, friction_torque=friction, **c, **options,
        )  # fmt: skip

    def exact(self, splits: int = 1) -> spline.Solutions:
        """The answer of the independent solver."""
        return exact(self.columns, self.closure, self.diagrams, splits)

    def flat(self, index: Any = slice(None)) -> dict[str, npt.NDArray[Any]]:
        """Columns of one length: those of the designs at `index`."""
        places: Any = index
        if len(self.shape) > 1:
            places = np.unravel_index(np.arange(self.size)[index], self.shape)
        return {
            name: np.broadcast_to(array, self.shape)[places] for name, array in self.columns.items()
        }


def designs_of(columns: dict[str, Any], closure: Any) -> spline.Designs:
    """The same designs for the independent solver."""
    c = {**columns, "surplus": columns["mean_torque"] - columns["offset"]}
    for name in ("mean_torque", "offset", "friction"):
        c.pop(name, None)
    return spline.Designs.of(scale=1.0, cycle_time=np.asarray(closure) == "cycle_time", **c)


def exact(
    columns: dict[str, Any], closure: Any, one: Family | None = None, splits: int = 1
) -> spline.Solutions:
    """Answers of the independent solver, for diagrams of a family, else of the catalogue engine."""
    used = one or family()
    return spline.solve(
        designs_of(columns, closure), lambda row, phi: used.row(row)(phi), used.row(0).angle, splits
    )


@cache
def family() -> Family:
    """The diagrams of the catalogue engine."""
    found = load_engine(ENGINE, Path()).family
    assert isinstance(found, Family)
    return found


@cache
def rows() -> Floats:
    """Diagrams that are drawn: the ends, the middle, and between them, most between two rows."""
    last = float(family().row_count - 1)
    return np.array([0.0, 0.37, 1.0, 23.0, 60.5, 100.0, 128.25, 150.0, last - 0.01, last])


@cache
def shapes() -> Shapes:
    """What bounds and draws need to know of these diagrams."""
    return Shapes(family(), rows(), CRANKCASES)


def _log(random: np.random.Generator, name: str, size: int) -> Floats:
    low, high = RANGES[name]
    return np.exp(random.uniform(math.log(low), math.log(high), size))


def _exponents(random: np.random.Generator, size: int) -> Floats:
    """0, 1 and 2 exactly, hardly more or less than these, small ones, and any up to 10."""
    near = random.choice([1.0, 2.0], size) + random.choice([-1.0, 1.0], size) * 10.0 ** (
        random.uniform(-15.0, -2.0, size)
    )
    return np.select(
        list(_one_of(random, (0.15, 0.15, 0.15, 0.05, 0.1), size)),
        [np.zeros(size), np.ones(size), np.full(size, 2.0), near,
         10.0 ** random.uniform(-12.0, 0.0, size)],
        random.uniform(0.0, 10.0, size),
    )  # fmt: skip


def _one_of(random: np.random.Generator, shares: tuple[float, ...], size: int) -> Any:
    """Masks that choose each design's kind, in these shares."""
    drawn = random.uniform(0.0, 1.0, size)
    edges = np.cumsum((0.0, *shares))
    return ((drawn >= a) & (drawn < b) for a, b in pairwise(edges))


def _loads(random: np.random.Generator, size: int, wide: Floats) -> Floats:
    """Mean torque less offset, over the mean torque; `wide` is the torque's range over it."""
    tiny = 10.0 ** random.uniform(-13.0, 0.0, size)
    return np.select(
        list(_one_of(random, (0.45, 0.2, 0.08, 0.08, 0.07), size)),
        [
            np.ones(size),
            tiny,
            np.zeros(size),
            -tiny,
            # About what counts as idle.
            random.choice([-1.0, 1.0], size) * 1e-9 * wide * random.uniform(0.2, 3.0, size),
        ],
        1.0 + 10.0 ** random.uniform(-3.0, 2.0, size),
    )  # fmt: skip


def table(seed: int, number: int, size: int = CHUNK) -> Chunk:
    """Designs that share nothing.

    In every other chunk the inertia is not drawn from its whole range but such that the energy
    swing is 1e-3 to 10 times the nominal kinetic energy, where designs are near stalling.
    """
    random = np.random.default_rng([seed, number])
    ratio = np.where(
        random.uniform(0.0, 1.0, size) < 0.5,
        _log(random, "crank ratio", size),
        random.uniform(0.05, 0.999, size),
    )
    cylinders = random.integers(1, 17, size)
    columns: dict[str, Any] = {
        "row": random.choice(rows(), size),
        "crankcase": random.choice(CRANKCASES, size),
        "crank_ratio": ratio,
        "bore": _log(random, "bore", size),
        "stroke": _log(random, "stroke", size),
        "mass": _log(random, "reciprocating mass", size),
        "inertia": _log(random, "inertia", size),
        "speed": _log(random, "speed", size) * math.pi / 30.0,
        "exponent": _exponents(random, size),
        "cylinders": cylinders,
        "variable": random.uniform(0.0, 1.0, size) < 0.5,
    }
    _complete(random, columns, size)
    if number % 2 == 1:
        bounds = shapes().bounds(columns)
        swing = 10.0 ** random.uniform(-3.0, 1.0, size)
        inertia = 2.0 * bounds.gas_swing / (swing * columns["speed"] ** 2)
        columns["inertia"] = np.clip(inertia, *RANGES["inertia"])
        # Else nearly all have no speed but from the masses, or vanishing inertia.
        share = 10.0 ** random.uniform(-6.0, 0.5, size)
        moment = share * columns["inertia"] / cylinders
        columns["mass"] = np.clip(
            moment / (0.5 * columns["stroke"]) ** 2, *RANGES["reciprocating mass"]
        )
    closure = "cycle_time" if number % 16 >= 8 else "power_mean"
    return Chunk(columns, closure, (size,), (seed, number))


def _complete(random: np.random.Generator, columns: dict[str, Any], size: int) -> None:
    """Friction, mean torque and offset."""
    bounds = shapes().bounds(columns)
    gas = bounds.mean_gas
    friction = np.select(
        list(_one_of(random, (0.3, 0.5), size)),
        [np.zeros(size), np.abs(gas) * random.uniform(0.0, 0.9, size)],
        np.abs(gas) * 10.0 ** random.uniform(-6.0, 2.0, size),
    )
    mean = gas - friction
    scale = np.where(mean == 0.0, 1.0, np.abs(mean))
    columns["friction"] = friction
    columns["mean_torque"] = mean
    columns["offset"] = mean - scale * _loads(random, size, bounds.torque_most / scale)


PRODUCT = (16, 8, 8, 8, 4, 4)
"""Inertia, speed, mass, geometry and diagram together, exponent and load together, cylinders."""


def product(seed: int, number: int, size: int = CHUNK) -> Chunk:
    """A full factorial over the same ranges, of `size` designs rounded down."""
    random = np.random.default_rng([seed, number])
    inertias = max(1, size // math.prod(PRODUCT[1:]))
    shape = (inertias, *PRODUCT[1:])

    def along(axis: int, values: Any) -> npt.NDArray[Any]:
        places = [1] * len(shape)
        places[axis] = shape[axis]
        return np.asarray(values).reshape(places)

    geometry = {
        "crank_ratio": random.uniform(0.0, 1.0, shape[3]) ** 3 * 0.9989 + 1e-6,
        "row": random.choice(rows(), shape[3]),
        "bore": np.full(shape[3], _log(random, "bore", 1)[0]),
    }
    columns: dict[str, Any] = {
        "inertia": along(0, _log(random, "inertia", shape[0])),
        "speed": along(1, _log(random, "speed", shape[1]) * math.pi / 30.0),
        "mass": along(2, _log(random, "reciprocating mass", shape[2])),
        **{name: along(3, values) for name, values in geometry.items()},
        "stroke": _log(random, "stroke", 1)[0],
        "crankcase": random.choice(CRANKCASES),
        "exponent": along(4, [0.0, 1.0, 2.0, random.uniform(0.0, 10.0)]),
        "cylinders": along(5, random.choice(np.arange(1, 17), shape[5], replace=False)),
        "variable": np.asarray(random.uniform() < 0.5),
    }
    gas = shapes().bounds(columns).mean_gas
    columns["friction"] = 0.1 * np.abs(gas)
    columns["mean_torque"] = gas - columns["friction"]
    columns["offset"] = columns["mean_torque"] * (
        1.0 - along(4, [1.0, random.uniform(-0.1, 1.0), 1e-6, 1.0])
    )
    closure = "cycle_time" if number % 16 == 8 else "power_mean"
    arrays = {name: np.asarray(array) for name, array in columns.items()}
    return Chunk(arrays, closure, shape, (seed, number), WITHOUT_ERROR)


GROUPS = 16
"""Crank ratios, each with a diagram, a crankcase and a number of cylinders, of a group."""

WITHOUT_ERROR = tuple(name for name in SCALAR_NAMES if name != "delta_error")


def group(seed: int, number: int, size: int = CHUNK) -> Chunk:
    """Designs that share crank ratio, diagram, crankcase and cylinders only, each by many."""
    each = size // GROUPS
    drawn = table(seed, number, GROUPS * each).columns
    columns: dict[str, Any] = {}
    for name in ("crank_ratio", "row", "crankcase", "cylinders"):
        columns[name] = drawn[name][:GROUPS, None]
    for name in ("exponent", "variable"):
        columns[name] = drawn[name][None, :each]
    for name in ("bore", "stroke", "mass", "inertia", "speed"):
        columns[name] = drawn[name].reshape(GROUPS, each)
    flat = {name: np.broadcast_to(a, (GROUPS, each)).reshape(-1) for name, a in columns.items()}
    _complete(np.random.default_rng([seed, number, 2]), flat, GROUPS * each)
    for name in ("friction", "mean_torque", "offset"):
        columns[name] = flat[name].reshape(GROUPS, each)
    closure = "cycle_time" if number % 16 == 10 else "power_mean"
    return Chunk(columns, closure, (GROUPS, each), (seed, number), WITHOUT_ERROR)


def size_of(designs: int) -> int:
    """Designs of a chunk in a run of so many."""
    return min(CHUNK, -(-designs // FEWEST))


def count_of(designs: int) -> int:
    """Chunks of a run of so many designs: every eighth one is a small one."""
    size = size_of(designs)
    whole = -(-designs // size)
    return whole + whole // 8


def chunk(seed: int, number: int, size: int = CHUNK) -> Chunk:
    """Return chunk `number`: of eight, a product, groups, and, eight times smaller, a table."""
    if number % 8 == 0:
        return product(seed, number, size)
    if number % 8 == 3:
        return table(seed, number, -(-size // 8))
    return group(seed, number, size)
