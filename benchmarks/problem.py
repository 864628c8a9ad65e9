"""The designs that every solver gets, and their solution by a method of its own.

Two sets. `scene` is a product of axes at one crank ratio, `table` a list of designs that share
nothing but engine size and pressure diagram. The pressure is a closed form (`oracle.designs`),
analytic and periodic: solvers that need points get it every half degree, as a file would have it;
the others evaluate the formula.

The reference shares no line with the kernels: Fourier series of the formula, integrated term by
term, and the load by fixed-point iteration. Where the torque is analytic its error falls
exponentially with the number of samples, so that rounding is what remains; `agreement` compares it
with the adaptive integration of `oracle` on a few designs.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from engine_dyn import Diagram, Family, diagram_from_points, family_from_diagrams
from engine_dyn.pressure.family import ROW_STEP
from engine_dyn.speed.mean_gas import mean_gas_torque
from engine_dyn.types import Floats, Integers
from oracle.designs import SmoothPressure
from oracle.designs import table as points_of
from oracle.solution import Design, solve

Complexes = npt.NDArray[Any]

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

EXPONENTS = (0.0, 1.0, 1.6, 2.0)
"""Load exponents mixed in the table."""

SAMPLES = 1024
"""Of the reference over a period; `agreement` shows that they suffice."""


@dataclass(frozen=True)
class Designs:
    """Columns of designs, each of one length: SI units, speed in rad/s.

    `heat` is the factor on the combustion's part of the pressure, 1 at full load; `friction` is
    the torque of the whole engine.
    """

    ratio: Floats
    mass: Floats
    speed: Floats
    inertia: Floats
    friction: Floats
    exponent: Floats
    heat: Floats
    cylinders: int = 1
    variable: bool = False

    COLUMNS = ("ratio", "mass", "speed", "inertia", "friction", "exponent", "heat")

    def __len__(self) -> int:
        return self.ratio.size

    def take(self, index: Any) -> Designs:
        """The designs at `index`."""
        columns: dict[str, Any] = {
            name: np.ascontiguousarray(getattr(self, name)[index]) for name in self.COLUMNS
        }
        return replace(self, **columns)


@dataclass(frozen=True)
class Scene:
    """A full factorial: inertia x speed x mass at one crank ratio and load exponent."""

    inertia: Floats
    speed: Floats
    mass: Floats
    exponent: float
    cylinders: int = 1
    variable: bool = False
    ratio: float = 0.2571
    friction: float = 30.0  # N m of a cylinder

    @property
    def shape(self) -> tuple[int, int, int]:
        """Designs along each axis."""
        return self.inertia.size, self.speed.size, self.mass.size

    @property
    def size(self) -> int:
        """Number of designs."""
        return math.prod(self.shape)

    def designs(self, index: Integers) -> Designs:
        """Chosen designs of the product as columns, for solvers that know no product."""
        inertia, speed, mass = np.unravel_index(index, self.shape)
        alike = np.ones(index.size)
        return Designs(
            ratio=self.ratio * alike,
            mass=self.mass[mass],
            speed=self.speed[speed],
            inertia=self.inertia[inertia],
            friction=self.cylinders * self.friction * alike,
            exponent=self.exponent * alike,
            heat=alike,
            cylinders=self.cylinders,
            variable=self.variable,
        )

    def inputs(self) -> dict[str, Any]:
        """Arguments of `sweep.solve`, shaped as a product."""
        friction = self.cylinders * self.friction
        return {
            "crank_ratio": self.ratio,
            "mass": self.mass[None, None, :],
            "speed": self.speed[None, :, None],
            "inertia": self.inertia[:, None, None],
            "exponent": self.exponent,
            "friction_torque": friction,
            "cylinders": self.cylinders,
            "inertia_model": "variable" if self.variable else "constant",
        }


def _divisor(number: int, most: int) -> int:
    return next(d for d in range(most, 0, -1) if number % d == 0)


def scene(size: int, exponent: float, cylinders: int = 1, variable: bool = False) -> Scene:
    """A factorial scene of `size` designs, of which two digits count so that it has divisors."""
    digits = max(0, len(str(size)) - 2)
    size = size // 10**digits * 10**digits
    speeds = _divisor(size, round(size ** (1.0 / 3.0)))
    masses = _divisor(size // speeds, math.isqrt(size // speeds))
    inertias = size // (speeds * masses)
    return Scene(
        inertia=np.geomspace(1.5, 8.0, inertias),
        speed=np.linspace(100.0, 220.0, speeds),
        mass=np.linspace(3.0, 9.0, masses),
        exponent=exponent,
        cylinders=cylinders,
        variable=variable,
    )


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


def sampled(size: int, cylinders: int, seed: int = 3) -> Designs:
    """Random designs of one number of cylinders at any load, exponent 2."""
    designs = table(size, (2.0,), seed=1000 * seed + cylinders)
    heat = np.random.default_rng(1000 * seed + cylinders + 500).uniform(LEAST_HEAT, 1.0, size)
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


def family() -> Family:
    """The diagram alone, as a family of one."""
    return family_from_diagrams([0.0], [diagram()])


def family_of_loads() -> Family:
    """The diagrams of least and full heat, so near in load that all between are their sums."""
    return family_from_diagrams([0.0, ROW_STEP], [diagram(LEAST_HEAT), diagram()])


def own_inputs(source: Scene | Designs, one: Family) -> dict[str, Any]:
    """Arguments of `sweep.solve`; the mean torque is computed here, as every peer does it too."""
    if isinstance(source, Scene):
        inputs = source.inputs()
    else:
        inputs = {
            "crank_ratio": source.ratio,
            "mass": source.mass,
            "speed": source.speed,
            "inertia": source.inertia,
            "exponent": source.exponent,
            "friction_torque": source.friction,
            "cylinders": source.cylinders,
            "inertia_model": "variable" if source.variable else "constant",
        }
    row: Any = 0.0
    if isinstance(source, Designs) and one.row_count > 1:
        row = (source.heat - LEAST_HEAT) / (1.0 - LEAST_HEAT)
    gas = mean_gas_torque(inputs["crank_ratio"], row, one)
    return {
        "family": one, "row": row, "scale": 1.0, "crankcase_pressure": CRANKCASE, "bore": BORE,
        "double_radius": STROKE, "offset": 0.0,
        "mean_torque": source.cylinders * LEVER * gas - inputs["friction_torque"], **inputs,
    }  # fmt: skip


# Reference ----------------------------------------------------------------------------------------


def kinematics(phi: Floats, ratio: Floats) -> tuple[Floats, Floats]:
    """Reduced velocity c/(r omega) and acceleration b/(r omega^2), from the rod l/r."""
    sine, cosine, rod = np.sin(phi), np.cos(phi), 1.0 / ratio
    root = np.sqrt(rod**2 - sine**2)
    v = sine + sine * cosine / root
    b = cosine + (cosine**2 - sine**2) / root + (sine * cosine) ** 2 / root**3
    return v, b


def reference(designs: Designs, samples: int = SAMPLES) -> Floats:
    """Delta of every design, to rounding."""
    blocks = [designs.take(slice(i, i + 64)) for i in range(0, len(designs), 64)]
    return np.concatenate([_reference(block, samples) for block in blocks])


def _reference(designs: Designs, samples: int) -> Floats:
    period = CYCLE / designs.cylinders
    phi = np.arange(samples) * period / samples
    gas = np.zeros((len(designs), samples))
    shape, square = np.zeros_like(gas), np.zeros_like(gas)
    for cylinder in range(designs.cylinders):
        angle = phi + cylinder * period
        v, b = kinematics(angle, designs.ratio[:, None])
        gas += LEVER * (pressure_of(angle, designs.heat[:, None]) - CRANKCASE) * v
        shape += b * v
        square += v * v
    column = {name: getattr(designs, name)[:, None] for name in designs.COLUMNS}
    scale = 2.0 / (column["inertia"] * column["speed"] ** 2)
    throw = column["mass"] * RADIUS**2
    drive = scale * (gas - column["friction"])
    theta = np.ones_like(gas)
    if designs.variable:
        theta += throw / column["inertia"] * (square - square.mean(axis=1, keepdims=True))
    else:
        drive -= scale * throw * column["speed"] ** 2 * shape
    half = 0.5 * column["exponent"]
    kappa = drive.mean(axis=1, keepdims=True)  # scaled load, the power mean being the nominal speed
    wave: Complexes = 2j * math.pi / period * np.arange(samples // 2 + 1)
    inverse = np.zeros(wave.size, dtype=complex)
    inverse[1:-1] = 1.0 / wave[1:-1]

    def integral(curve: Floats) -> Floats:
        return np.asarray(np.fft.irfft(inverse * np.fft.rfft(curve), samples))

    work = integral(drive)
    level, load = np.ones_like(kappa), np.zeros_like(work)
    torque_load = half == 0.0
    for _ in range(200):
        before = load
        for _ in range(50):  # Newton for the level at which the power mean is the nominal speed
            u = (level + work - kappa * load) / theta
            power = u**half
            closing = np.where(torque_load, np.log(u), power - 1.0).mean(axis=1, keepdims=True)
            slope = np.where(torque_load, 1.0, half * power) / (u * theta)
            step = closing / slope.mean(axis=1, keepdims=True)
            level = level - step
            if np.abs(step).max() < 1e-15:
                break
        u = (level + work - kappa * load) / theta
        load = integral(u**half)
        if np.abs(load - before).max() < 1e-15:
            break
    else:
        raise RuntimeError("the load's iteration did not settle")
    u = (level + work - kappa * load) / theta
    if u.min() <= 0.0:
        raise RuntimeError("a design of the benchmark stalls")
    high, low = _extreme(u, wave, 1.0), _extreme(u, wave, -1.0)
    return np.asarray((np.sqrt(high) - np.sqrt(low)) / np.sqrt(u).mean(axis=1))


def _extreme(curve: Floats, wave: Complexes, sign: float) -> Floats:
    """Largest (or smallest) value of the trigonometric interpolant of each row."""
    samples = curve.shape[1]
    waves = np.fft.rfft(curve) / samples
    waves[:, 1:] *= 2.0
    fine = np.fft.irfft(np.fft.rfft(curve), 8 * samples)
    period = 2.0 * math.pi / wave[1].imag
    at = np.argmax(sign * fine, axis=1)[:, None] * period / fine.shape[1]
    for _ in range(6):
        term = waves * np.exp(wave * at)
        slope = (wave * term).sum(axis=1, keepdims=True).real
        at = at - slope / (wave * wave * term).sum(axis=1, keepdims=True).real
    return np.asarray((waves * np.exp(wave * at)).sum(axis=1).real)


def agreement(designs: Designs, delta: Floats) -> float:
    """Largest relative difference of `delta` from the adaptive integration of `oracle`."""
    worst = 0.0
    for i in range(len(designs)):
        one = designs.take([i])
        design = Design(
            pressure=partial(pressure_of, heat=float(one.heat[0])), bore=BORE, stroke=STROKE,
            crank_ratio=float(one.ratio[0]),
            reciprocating_mass=float(one.mass[0]), inertia=float(one.inertia[0]),
            speed_rpm=float(one.speed[0]) * 30.0 / math.pi, cylinders=one.cylinders,
            load_exponent=float(one.exponent[0]), friction_torque=float(one.friction[0]),
            crankcase_pressure=CRANKCASE,
            inertia_model="variable" if one.variable else "constant",
        )  # fmt: skip
        worst = max(worst, abs(delta[i] / solve(design).delta - 1.0))
    return worst
