"""The designs that every solver gets, and their solution by a method of its own.

Two sets. `scene` is a product of axes at one crank ratio, `table` a list of designs that share
nothing but engine size and pressure diagram. The pressure is a closed form (`oracle.designs`),
analytic and periodic: solvers that need points get it every half degree, as a file would have it;
the others evaluate the formula.

The reference shares no line with the kernels: collocation by `oracle/spline.py`, with the formula
in the place of a spline; tests compare that with the adaptive integration of `oracle`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from engine_dyn import Diagram, Family, diagram_from_points, family_from_diagrams
from engine_dyn.pressure.family import ROW_STEP
from engine_dyn.speed import dispatch
from engine_dyn.speed.torque import mean_gas_torque
from engine_dyn.types import Floats
from oracle import spline
from oracle.designs import SmoothPressure
from oracle.designs import table as points_of

CYCLE = 4.0 * math.pi
BORE, STROKE, CRANKCASE = 0.14, 0.18, 1.0e5
RADIUS = 0.5 * STROKE
LEVER = 0.25 * math.pi * BORE**2 * RADIUS

PRESSURE = SmoothPressure(
    charge=1.0, compression=1.0, ratio=14.0, polytropic=1.33,
    burn=40.0, burn_angle=math.radians(10.0), burn_order=120,
    after=6.0, after_angle=math.radians(45.0), after_order=30,
)  # fmt: skip

MOTORED = replace(PRESSURE, burn=0.0, after=0.0)
"""The same without combustion."""

LEAST_HEAT = 0.4
"""Smallest factor on the combustion's part of the pressure; the largest is 1, full load."""

MOST_CYLINDERS = 8
"""Of sampled designs."""

FINE = np.arange(2880) * CYCLE / 2880
"""Equal steps integrate a smooth periodic torque to rounding."""

KNOTS = np.radians(np.arange(-360.0, 360.0, 0.5))
"""Pieces of the reference."""

EXPONENTS = (0.0, 1.0, 1.6, 2.0)
"""Load exponents mixed in the table."""


@dataclass(frozen=True)
class Designs:
    """Columns of designs, which broadcast: SI units, speed in rad/s.

    `heat` is the factor on the combustion's part of the pressure, 1 at full load; `friction` is
    the torque of the whole engine. `cylinders` is one number for all, or a column.
    """

    ratio: Any
    mass: Any
    speed: Any
    inertia: Any
    friction: Any
    exponent: Any
    heat: Any = 1.0
    cylinders: Any = 1
    variable: bool = False

    COLUMNS = ("ratio", "mass", "speed", "inertia", "friction", "exponent", "heat")

    @property
    def shape(self) -> tuple[int, ...]:
        """Designs along each axis of a product."""
        return np.broadcast_shapes(*(np.shape(getattr(self, name)) for name in self.COLUMNS))

    def __len__(self) -> int:
        return math.prod(self.shape)

    def take(self, index: Any) -> Designs:
        """The designs at `index`, as columns of one length."""
        shape = self.shape
        places = np.unravel_index(np.arange(len(self))[index], shape) if len(shape) > 1 else index
        names = [*self.COLUMNS, "cylinders"] if np.ndim(self.cylinders) else self.COLUMNS
        columns: dict[str, Any] = {
            name: np.ascontiguousarray(np.broadcast_to(getattr(self, name), shape)[places])
            for name in names
        }
        return replace(self, **columns)


def scene(each: int, exponent: float, cylinders: int = 1, variable: bool = False) -> Designs:
    """A factorial scene of so many inertias, speeds and masses."""
    return product(
        np.geomspace(1.5, 8.0, each), np.linspace(100.0, 220.0, each), np.linspace(3.0, 9.0, each),
        0.2571, 30.0, exponent, cylinders, variable,
    )  # fmt: skip


def product(
    inertia: Floats, speed: Floats, mass: Floats, ratio: float, friction: float, exponent: float,
    cylinders: int, variable: bool,
) -> Designs:  # fmt: skip
    """A full factorial at one crank ratio, friction of a cylinder [N m] and load exponent."""
    return Designs(
        ratio, mass, speed[:, None], inertia[:, None, None], cylinders * friction, exponent, 1.0,
        cylinders, variable,
    )  # fmt: skip


def table(size: int, exponents: Sequence[float] = EXPONENTS, seed: int = 1) -> Designs:
    """Random designs that share nothing; `exponents` take turns."""
    random = np.random.default_rng(seed)
    return Designs(
        ratio=random.uniform(0.2, 0.33, size),
        mass=random.uniform(3.0, 9.0, size),
        speed=random.uniform(100.0, 220.0, size),
        inertia=np.exp(random.uniform(math.log(1.5), math.log(8.0), size)),
        friction=random.uniform(15.0, 45.0, size),
        exponent=np.resize(np.asarray(exponents), size),
        heat=np.ones(size),
    )


def sampled(size: int, seed: int = 3) -> Designs:
    """Random designs of one to eight cylinders in turn, at any load, exponent 2."""
    designs = table(size, (2.0,), seed)
    heat = np.random.default_rng(seed + 500).uniform(LEAST_HEAT, 1.0, size)
    cylinders = 1 + np.arange(size) % MOST_CYLINDERS
    return replace(
        designs, heat=heat, friction=cylinders * designs.friction, cylinders=cylinders,
        inertia=cylinders * designs.inertia,
    )  # fmt: skip


def pressure_of(phi: Any, heat: Any) -> Floats:
    """Pressure [Pa] at crank angles [rad], with a factor on what the combustion adds."""
    motored = MOTORED(phi)
    return np.asarray(motored + heat * (PRESSURE(phi) - motored))


def joined(first: Designs, second: Designs) -> Designs:
    """One table after the other."""
    columns: dict[str, Any] = {
        name: np.concatenate([getattr(first, name), getattr(second, name)])
        for name in Designs.COLUMNS
    }
    return replace(first, **columns)


def diagram(heat: float = 1.0) -> Diagram:
    """The pressure every half degree, as a file would give it."""
    degrees, bar = points_of(lambda phi: pressure_of(phi, heat))
    return diagram_from_points(np.radians(degrees), bar * 1e5, CYCLE)


@cache
def family() -> Family:
    """The diagram alone, as a family of one."""
    return family_from_diagrams([0.0], [diagram()])


@cache
def family_of_loads() -> Family:
    """The diagrams of least and full heat, so near in load that all between are their sums."""
    return family_from_diagrams([0.0, ROW_STEP], [diagram(LEAST_HEAT), diagram()])


def own_inputs(source: Designs) -> dict[str, Any]:
    """Arguments of `sweep.solve`; the mean torque is computed here, as every peer does it too."""
    one = family()
    row: Any = 0.0
    if np.any(source.heat != 1.0):
        one, row = family_of_loads(), (source.heat - LEAST_HEAT) / (1.0 - LEAST_HEAT)
    gas = mean_gas_torque(source.ratio, row, one)
    return {
        "family": one, "row": row, "scale": 1.0, "crankcase_pressure": CRANKCASE, "bore": BORE,
        "double_radius": STROKE, "offset": 0.0, "crank_ratio": source.ratio, "mass": source.mass,
        "speed": source.speed, "inertia": source.inertia, "exponent": source.exponent,
        "friction_torque": source.friction, "cylinders": source.cylinders,
        "inertia_model": "variable" if source.variable else "constant",
        "mean_torque": source.cylinders * LEVER * gas - source.friction,
    }  # fmt: skip


def answer(
    source: Designs, threads: int, wanted: tuple[str, ...] = ("delta",), **options: Any
) -> dict[str, Any]:
    """Results of `sweep.solve`, called as `sweeps` calls it."""
    return dispatch.solve(wanted=wanted, threads=threads, **own_inputs(source), **options)


# Reference ----------------------------------------------------------------------------------------


def reference(designs: Designs) -> Floats:
    """Delta of every design, to rounding: `oracle/spline.py` with the formula of the pressure."""
    gas = np.array([
        np.mean(pressure_of(FINE, heat) * spline.velocity(FINE, ratio))
        for heat, ratio in zip(designs.heat, designs.ratio, strict=True)
    ])  # fmt: skip
    batch = spline.Designs.of(
        row=(designs.heat - LEAST_HEAT) / (1.0 - LEAST_HEAT), scale=1.0, crankcase=CRANKCASE,
        crank_ratio=designs.ratio, bore=BORE, stroke=STROKE, mass=designs.mass,
        inertia=designs.inertia, speed=designs.speed, exponent=designs.exponent,
        surplus=designs.cylinders * LEVER * gas - designs.friction, cylinders=designs.cylinders,
        variable=designs.variable, cycle_time=False,
    )  # fmt: skip
    found = spline.solve(batch, lambda row, phi: pressure_of(phi, (LEAST_HEAT, 1.0)[row]), KNOTS)
    if np.any(found.status != spline.CONVERGED):
        raise RuntimeError("a design of the benchmark stalls")
    return found.delta
