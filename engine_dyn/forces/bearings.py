r"""Loads of crank pin, main journals and piston pin over the cycle: polar diagrams, peaks, means.

Axes
----
Engine-fixed: y upright (`mechanism.banks_of`), away from the crank, x to the side on which the
crank pin of an upright cylinder goes down; seen along the shaft so that the crank turns clockwise.
For a single cylinder, y is along that cylinder. Pin-fixed: radial away from the crank's axis,
tangential in the sense of rotation. With the crank at theta from its cylinder, and the cylinder at
g from y, all clockwise,

    a = (sin g, cos g) along the cylinder, s = (cos g, -sin g) to its side,
    e = s sin(theta) + a cos(theta) along the crank, t = s cos(theta) - a sin(theta).

Loads
-----
- Crank pin, the force of the rod on the pin: N s - P a = T t - R e (see `mechanism`) and the
  centrifugal force of the part of the rod that turns with the pin, m_rod r omega^2 e. One rod at a
  time: where rods share a pin, each has its own bearing on it.
- Main journals, the force of the journal on its bearing: each throw is a beam of its own on the
  journals beside it, loaded in the middle, so each of the two bears half (statically determinate
  shares; continuity of the shaft and clearances are left out). A throw bears the loads of all its
  rods and the centrifugal force of its own mass less that of its counterweights (those on its two
  webs together act in its middle): with the part of the rod m_t r omega^2 e for each cylinder.
  Journal j lies before throw j and the last one behind the last throw: one more than there are
  throws. The loads of all journals add up to the forces of all cylinders, N s - P a +
  m_t r omega^2 e.
- Piston pin, the force of the piston on pin and rod: P_g - m_piston b along the cylinder towards
  the crank, and N s to the side (the wall pushes the piston with N, the piston the pin).

All are sums of four parts with a factor each: gas pressure, crankcase pressure, reciprocating and
rotating masses. The parts depend on crank ratio, offset, diagram and arrangement alone: a table of
them serves all designs that share these. Weights are left out.

Functions take each of these inputs by itself: any may vary between designs, and the table is made
for the distinct ones.

Source: Rakopoulos notes, loads of the bearings and polar diagrams (without formulas there); the
components after Kakaitsas (2015), ch. 2. Shares of the main journals: derived here, as is usual
for a first design.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from engine_dyn.compilation import kernel, rows_on_stack
from engine_dyn.forces import mechanism, torque
from engine_dyn.forces.main_journals import journal_parts
from engine_dyn.forces.superposition import along_shaft
from engine_dyn.geometry import slider_crank
from engine_dyn.geometry.cylinder_means import value_of_sets
from engine_dyn.geometry.cylinders import Cylinders, CylindersByCount, Member
from engine_dyn.pressure.cycle_table import CycleTable
from engine_dyn.pressure.family import Family
from engine_dyn.types import Floats, Integers

__all__ = [
    "EXTREMES",
    "PARTS",
    "Factors",
    "crank_pin_load",
    "extremes",
    "first_crank",
    "main_journal_load",
    "piston_pin_load",
    "turned",
]


PARTS = 4
"""Gas pressure, crankcase pressure, reciprocating and rotating masses."""

SAMPLE = np.pi / 360.0
"""Half a degree: spacing of the angles at which peaks are looked for; a parabola refines them."""

TABLES_AT_ONCE, MANY_TABLES_AT_ONCE = 64, 160
DESIGNS_AT_ONCE = 65536

EXTREMES = np.dtype([("peak", np.float64), ("mean", np.float64), ("angle", np.float64)])
"""Largest and mean size of a load [N], and the crank angle of the largest [rad]."""

Parts = Callable[[Any, Cylinders, Any, Any, Family, Any, int], Any]
"""Of angle, engine, crank ratio, offset, family, row and number: see `_crank_pin`."""


class Factors(NamedTuple):
    """What the four parts of a load are multiplied with, for each design.

    Attributes
    ----------
    gas, crankcase, reciprocating, rotating : array_like
        p scale times area [m2], p_c times area [N], m r omega^2 and m_turning r omega^2 [N].
    """

    gas: Any
    crankcase: Any
    reciprocating: Any
    rotating: Any


def _piston_force(
    phi: Any, member: Member, crank_ratio: Any, offset: Any, family: Family, row: Any
) -> Any:
    """Parts of P of a cylinder, four along the last axis.

    `crank_ratio` and `offset` are those of the cylinder's own crank radius, the factors those of
    the engine's.
    """
    gas = torque.pressure(phi, family, row, 1.0, member.pressure_factor)
    share = member.mass_factor * member.radius_factor
    inertia = -share * slider_crank.acceleration(phi, crank_ratio, offset)
    none = np.zeros(np.shape(inertia))
    return np.stack(np.broadcast_arrays(gas, none - 1.0, inertia, none), axis=-1)


def _crank_pin(
    phi: Any, engine: Cylinders, crank_ratio: Any, offset: Any, family: Family, row: Any,
    number: int,
) -> Any:  # fmt: skip
    """Parts of the load of cylinder 1's rod on its pin, shape (..., parts, 2), radial, tangential.

    `number` is not used: there is one such load.
    """
    member = engine.members[0]
    pushed = _piston_force(phi, member, crank_ratio, offset, family, row)
    radial = -mechanism.radial_ratio(phi, crank_ratio, offset)[..., None] * pushed
    tangential = slider_crank.velocity(phi, crank_ratio, offset)[..., None] * pushed
    radial[..., 3] = 1.0
    return np.stack([radial, tangential], axis=-1)


def _piston_pin(
    phi: Any, engine: Cylinders, crank_ratio: Any, offset: Any, family: Family, row: Any,
    number: int,
) -> Any:  # fmt: skip
    """Parts of the load of cylinder 1's piston pin, shape (..., parts, 2), to the side, down.

    The fourth part is that of the rod's reciprocating share, which the pin does not carry along the
    cylinder; the thrust on the wall is that of all reciprocating masses.
    """
    member = engine.members[0]
    pushed = _piston_force(phi, member, crank_ratio, offset, family, row)
    side = mechanism.thrust_ratio(phi, crank_ratio, offset)[..., None] * pushed
    pushed[..., 3] = slider_crank.acceleration(phi, crank_ratio, offset)
    return np.stack([side, pushed], axis=-1)


def _main_journal(
    phi: Any, engine: Cylinders, crank_ratio: Any, offset: Any, family: Family, row: Any,
    number: int,
) -> Any:  # fmt: skip
    """Parts of the load of main journal `number` (from 1), shape (..., parts, 2), x and y."""
    places = along_shaft(engine)
    banks = mechanism.banks_of(engine)
    total: Any = np.zeros((*np.broadcast_shapes(np.shape(phi), np.shape(crank_ratio)), PARTS, 2))
    beside = [places[i] for i in (number - 2, number - 1) if 0 <= i < len(places)]
    for cylinder in (c for place in beside for c in place):
        member, bank = engine.members[cylinder], banks[cylinder]
        angle, radius = phi + member.phase, member.radius_factor
        own = member.own(crank_ratio, offset)
        pushed = _piston_force(angle, member, *own, family, row)
        crank = angle + slider_crank.dead_centres(*own).top + bank
        side = mechanism.thrust_ratio(angle, *own)[..., None] * pushed
        x = side * np.cos(bank) - pushed * np.sin(bank)
        y = -side * np.sin(bank) - pushed * np.cos(bank)
        x[..., 3], y[..., 3] = radius * np.sin(crank), radius * np.cos(crank)
        total = total + 0.5 * np.stack([x, y], axis=-1)
    return total


LOADS: dict[str, Parts] = {
    "crank_pin": _crank_pin,
    "piston_pin": _piston_pin,
    "main_journal": _main_journal,
}


def crank_pin_load(
    phi: Any, crank_ratio: Any, offset: Any, family: Family, row: Any, factors: Factors,
    cylinders: Any, by_count: CylindersByCount,
) -> tuple[Any, Any]:  # fmt: skip
    """Load of the rod of cylinder 1 on its crank pin [N], radial and tangential.

    Parameters
    ----------
    phi : array_like
        Crank angle [rad]; all arrays broadcast.
    crank_ratio, offset : array_like
        lambda [1]; offset of the pin's line over the crank radius [1].
    family, row
        Indicator diagrams and the place in their table.
    factors : Factors
        `rotating` with the part of the rod that turns.
    cylinders, by_count
        Number of cylinders, and the cylinders of each number.
    """
    return _curves("crank_pin", phi, crank_ratio, offset, family, row, factors, cylinders, by_count)


def piston_pin_load(
    phi: Any, crank_ratio: Any, offset: Any, family: Family, row: Any, factors: Factors,
    cylinders: Any, by_count: CylindersByCount,
) -> tuple[Any, Any]:  # fmt: skip
    """Load of the piston pin of cylinder 1 [N]: to the side to which the crank goes, and down.

    Parameters as `crank_pin_load`; `factors.rotating` with the part of the rod that reciprocates.
    """
    side, down = _curves(
        "piston_pin", phi, crank_ratio, offset, family, row, factors, cylinders, by_count
    )
    return side, down


def main_journal_load(
    phi: Any, crank_ratio: Any, offset: Any, family: Family, row: Any, factors: Factors,
    cylinders: Any, by_count: CylindersByCount, journals: Any,
) -> tuple[Any, Any]:  # fmt: skip
    """Loads of the main journals [N], x and y (engine-fixed); NaN past an engine's last journal.

    Parameters as `crank_pin_load`; `factors.rotating` with all that turns, per cylinder, less its
    counterweights;
    `journals` are their numbers, from 1, and broadcast.
    """
    numbers = np.asarray(journals)
    x: Any = np.nan
    y: Any = np.nan
    for number in np.unique(numbers).astype(int):
        one, other = _curves(
            "main_journal", phi, crank_ratio, offset, family, row, factors, cylinders, by_count,
            int(number),
        )  # fmt: skip
        x, y = np.where(numbers == number, one, x), np.where(numbers == number, other, y)
    return x, y


def turned(load: Any, angle: Any) -> Any:
    """Components in axes turned by the crank's angle; its own inverse.

    (x, y) to (radial, tangential) and back: radial = x sin + y cos, tangential = x cos - y sin.
    `load` is complex, the first component and i times the second; `angle` [rad] is that of the
    crank to y, in the sense of rotation.
    """
    return 1j * np.conj(load) * np.exp(-1j * angle)


def first_crank(
    phi: Any, crank_ratio: Any, offset: Any, cylinders: Any, by_count: CylindersByCount
) -> Any:
    """Angle of crank 1 from upright [rad]; parameters as `crank_pin_load`."""
    bank = value_of_sets(cylinders, by_count, lambda engine: mechanism.banks_of(engine)[0])
    return phi + slider_crank.dead_centres(crank_ratio, offset).top + bank


def _curves(
    load: str, phi: Any, crank_ratio: Any, offset: Any, family: Family, row: Any, factors: Factors,
    cylinders: Any, by_count: CylindersByCount, number: int = 1,
) -> tuple[Any, Any]:  # fmt: skip
    counts = np.asarray(cylinders)
    sums: list[Any] = [np.nan, np.nan]
    for count in np.unique(counts):
        engine = by_count[int(count)]
        if not _exists(load, engine, number):
            continue
        parts = LOADS[load](phi, engine, crank_ratio, offset, family, row, number)
        for i in (0, 1):
            whole = sum(factor * parts[..., k, i] for k, factor in enumerate(factors))
            sums[i] = np.where(counts == count, whole, sums[i])
    return sums[0], sums[1]


def _exists(load: str, engine: Cylinders, number: int) -> bool:
    places = engine.along_shaft
    return load != "main_journal" or places is None or number <= len(places) + 1


def extremes(
    load: str,
    crank_ratio: Any,
    offset: Any,
    family: Family,
    row: Any,
    factors: Factors,
    cylinders: Any,
    by_count: CylindersByCount,
    period: float,
    numbers: Any = 1,
) -> npt.NDArray[Any]:
    """Largest load, mean load and angle of the largest, for each design.

    Parameters
    ----------
    load : str
        One of `LOADS`.
    period : float
        Angle of the cycle [rad].
    numbers : array_like
        Of main journals, from 1; broadcasts.
    others
        As in `crank_pin_load`.

    Returns
    -------
    ndarray of dtype EXTREMES
        Shape of all arguments broadcast; NaN past an engine's last journal.

    Notes
    -----
    Sampled at half a degree, the peak refined by a parabola through the squares of the three
    largest samples: its error is of the fourth order for a smooth peak. Memory does not grow with
    the number of designs: tables and designs are taken in pieces.
    """
    inputs = (crank_ratio, offset, row, cylinders, numbers, *factors)
    columns = np.broadcast_arrays(*(np.asarray(one, dtype=float) for one in inputs))
    shape = columns[0].shape
    columns = np.atleast_1d(*columns)
    result = np.full(columns[0].size, np.nan, dtype=EXTREMES)
    samples = round(period / SAMPLE)
    phi: Floats = np.asarray(-0.5 * period + np.arange(samples) * (period / samples))
    many = isinstance(family, CycleTable)
    at_once = MANY_TABLES_AT_ONCE if many else TABLES_AT_ONCE
    for index in _pieces(columns[0].size):
        place = np.unravel_index(index, columns[0].shape)
        here = np.stack([column[place] for column in columns])
        keys, table = _distinct(here[:5])
        if many:  # those of one bearing beside each other
            order = np.lexsort(keys[3:])
            keys, table = keys[:, order], np.argsort(order)[table]
        memory = np.empty((min(at_once, keys.shape[1]), PARTS, 2, samples))
        for begin in range(0, keys.shape[1], at_once):
            some = keys[:, begin : begin + at_once]
            mine = np.flatnonzero((table >= begin) & (table < begin + some.shape[1]))
            parts = memory[: some.shape[1]]
            # Those of one bearing are made together, and those of one pressure unless there are
            # many of them.
            key = 3 if many else 2
            for *one, count, number in sorted(set(zip(*some[key:].tolist(), strict=True))):
                engine = by_count[int(count)]
                alike = np.equal(some[key:].T, (*one, count, number))
                these = np.flatnonzero(alike.all(axis=1))
                if not _exists(load, engine, int(number)):
                    parts[these] = np.nan
                elif isinstance(family, CycleTable) and load == "main_journal":
                    ratio, side, row_of = (
                        np.array(column, dtype=np.float64) for column in some[:3, these]
                    )
                    parts[these] = journal_parts(
                        phi, engine, ratio, side, row_of, family, int(number)
                    )
                else:
                    ratios, besides = some[:2, these, None]
                    where = one[0] if one else some[2, these, None]
                    made = LOADS[load](phi, engine, ratios, besides, family, where, int(number))
                    parts[these] = np.moveaxis(made, 1, -1)
            found = np.empty((3, mine.size))
            _extremes(parts, table[mine] - begin, np.ascontiguousarray(here[5:, mine]), found)
            rows = index[mine]
            result["peak"][rows], result["mean"][rows] = found[0], found[1]
            result["angle"][rows] = -0.5 * period + found[2] * (period / samples)
    return result.reshape(shape)


def _distinct(columns: Floats) -> tuple[Floats, Any]:
    """Different columns of an array, and which of them each is; quicker than by whole columns."""
    code = np.zeros(columns.shape[1], dtype=np.int64)
    for row in columns:
        if row[0] != row[-1] or (row != row[0]).any():
            values, number = np.unique(row, return_inverse=True)
            _, code = np.unique(code * values.size + number, return_inverse=True)
    _, first, which = np.unique(code, return_index=True, return_inverse=True)
    return columns[:, first], which


def _pieces(size: int) -> Iterator[Integers]:
    for begin in range(0, size, DESIGNS_AT_ONCE):
        yield np.arange(begin, min(begin + DESIGNS_AT_ONCE, size))


@kernel
def _extremes(parts: Floats, table: Any, factors: Floats, found: Floats) -> None:
    """Peak, mean and place of the peak (in samples) of |sum of factors times parts|."""
    samples = parts.shape[3]
    square = rows_on_stack(samples)
    for design in range(table.size):
        own = parts[table[design]]
        gas, crankcase = factors[0, design], factors[1, design]
        reciprocating, rotating = factors[2, design], factors[3, design]
        total = 0.0
        for i in range(samples):
            x = gas * own[0, 0, i] + crankcase * own[1, 0, i]
            y = gas * own[0, 1, i] + crankcase * own[1, 1, i]
            x += reciprocating * own[2, 0, i] + rotating * own[3, 0, i]
            y += reciprocating * own[2, 1, i] + rotating * own[3, 1, i]
            square[i] = x * x + y * y
            total += np.sqrt(square[i])
        best = 0
        for i in range(samples):
            if square[i] > square[best]:
                best = i
        before, top = square[best - 1 if best > 0 else samples - 1], square[best]
        after = square[best + 1 if best < samples - 1 else 0]
        bend = before - 2.0 * top + after
        move = 0.5 * (before - after) / bend if bend < 0.0 else 0.0
        peak = top - 0.25 * (before - after) * move
        found[0, design] = np.sqrt(peak) if total == total else np.nan
        found[1, design] = total / samples
        found[2, design] = best + move if total == total else np.nan
