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
  webs together act in its middle): with the part of the rod m_t r omega^2 e for each cylinder,
  which has its share of the throw.
  Journal j lies before throw j and the last one behind the last throw: one more than there are
  throws. The loads of all journals add up to the forces of all cylinders, N s - P a +
  m_t r omega^2 e.
- Piston pin, the force of the piston on pin and rod: P_g - m_piston b along the cylinder towards
  the crank, and N s to the side (the wall pushes the piston with N, the piston the pin).

All are sums of five parts with a factor each: gas pressure, crankcase pressure, reciprocating and
rotating masses, and throws; counterweights of webs, by the lever rule in their bay
(`web_weights`), add to journals. Weights are left out. Curves over the crank angle are such sums;
extremes are found design by design by a kernel (`bearing_extremes`).

Source: Rakopoulos notes, loads of the bearings and polar diagrams (without formulas there); the
components after Kakaitsas (2015), ch. 2. Shares of the main journals: derived here, as is usual
for a first design.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from engine_dyn.forces import mechanism, torque
from engine_dyn.forces.bearing_extremes import (
    COUNT,
    CRANK_PIN,
    CRESTS,
    FIRST,
    MAIN_JOURNAL,
    MEAN,
    PISTON_PIN,
    RMS,
    Sampled,
    curve_of,
    fill_crests_of_loads,
)
from engine_dyn.forces.superposition import along_shaft, sample_angles, tops
from engine_dyn.geometry import slider_crank
from engine_dyn.geometry.cylinder_means import value_of_sets
from engine_dyn.geometry.cylinders import Cylinders, CylindersByCount, Member
from engine_dyn.pressure.curves import on_threads
from engine_dyn.pressure.family import Family, own_diagrams
from engine_dyn.types import Floats, Integers


def bearing_pressure(load: Any, diameter: Any, width: Any) -> Any:
    """Mean pressure in a bearing, the load over its projected area D B [Pa].

    docs/method.md (38); Shigley and Mischke, Mechanical Engineering Design, journal bearings: the
    load per unit of projected area. `load` [N]; `diameter` of the journal and `width` of the
    bearing [m]. Oil films have several times this pressure.

    Examples
    --------
    >>> bearing_pressure(50e3, 0.05, 0.02)
    50000000.0
    """
    return load / (diameter * width)


PARTS = 5
"""Number of parts of a load: of gas, crankcase, reciprocating and rotating masses, and throws."""

DESIGNS_AT_ONCE = 65536

BYTES_OF_TABLE = 32e6  # Largest size in bytes of the table of pressures that is held at a time

EXTREMES = np.dtype([(field, np.float64) for field in ("peak", "mean", "angle", "rms")])
"""Extremes of a load: largest and mean size [N], angle of the largest [rad], rms [N]."""

Parts = Callable[[Any, Cylinders, Any, Any, Family, Any, int], Any]
"""A load's parts from angle, engine, crank ratio, offset, family, row, number: see `_crank_pin`."""


class Factors(NamedTuple):
    """Factors of the five parts of a load, for each design."""

    # Factors of four parts, in the order of the fields: pressure scale times piston area [m2],
    # crankcase pressure times piston area, m r omega^2 and m_turning r omega^2 [N].
    gas: Any
    crankcase: Any
    reciprocating: Any
    rotating: Any
    throws: Any = 0.0  # Inertia force m r omega^2 of each throw [N], which only main journals bear
    # Load of a main journal by the counterweights of webs at crank angle 0 [N]: upwards, sideways.
    web_up: Any = 0.0
    web_side: Any = 0.0


def _piston_force(
    phi: Any, member: Member, crank_ratio: Any, offset: Any, family: Family, row: Any
) -> Any:
    """Five parts of the force P on a piston; crank ratio and offset are the cylinder's own."""
    own, area = own_diagrams(family, member.diagram), member.area_factor
    gas = area * torque.pressure(phi, own, row, 1.0, member.pressure_factor)
    share = member.mass_factor * member.radius_factor
    inertia = -share * slider_crank.acceleration(phi, crank_ratio, offset)
    none = np.zeros(np.shape(inertia))
    return np.stack(np.broadcast_arrays(gas, none - area, inertia, none, none), axis=-1)


def _crank_pin(
    phi: Any, engine: Cylinders, crank_ratio: Any, offset: Any, family: Family, row: Any,
    number: int,
) -> Any:  # fmt: skip
    """Parts of cylinder 1's rod load on its pin, shape (..., parts, 2), radial, tangential."""
    pushed = _piston_force(phi, engine.members[0], crank_ratio, offset, family, row)
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
    pushed = _piston_force(phi, engine.members[0], crank_ratio, offset, family, row)
    side = mechanism.thrust_ratio(phi, crank_ratio, offset)[..., None] * pushed
    pushed[..., 3] = slider_crank.acceleration(phi, crank_ratio, offset)
    return np.stack([side, pushed], axis=-1)


def _main_journal(
    phi: Any, engine: Cylinders, crank_ratio: Any, offset: Any, family: Family, row: Any,
    number: int,
) -> Any:  # fmt: skip
    """Parts of the load of main journal `number` (from 1), shape (..., parts, 2), x and y."""
    places = along_shaft(engine)
    total: Any = np.zeros((*np.broadcast_shapes(np.shape(phi), np.shape(crank_ratio)), PARTS, 2))
    beside = [places[i] for i in (number - 2, number - 1) if 0 <= i < len(places)]
    for cylinder in (c for place in beside for c in place):
        on_throw = _on_throw(phi, engine, crank_ratio, offset, family, row, cylinder)
        total = total + 0.5 * np.stack(on_throw, axis=-1)
    return total


def _on_throw(
    phi: Any, engine: Cylinders, crank_ratio: Any, offset: Any, family: Family, row: Any,
    cylinder: int,
) -> tuple[Any, Any]:  # fmt: skip
    """Parts of the load that a cylinder (from 0) and its share of the throw cause, x and y."""
    member, bank = engine.members[cylinder], mechanism.banks_of(engine)[cylinder]
    angle, radius = phi + member.phase, member.radius_factor
    own = member.own(crank_ratio, offset)
    pushed = _piston_force(angle, member, *own, family, row)
    crank = angle + slider_crank.dead_centres(*own).top + bank
    side = mechanism.thrust_ratio(angle, *own)[..., None] * pushed
    x = side * np.cos(bank) - pushed * np.sin(bank)
    y = -side * np.sin(bank) - pushed * np.cos(bank)
    x[..., 3], y[..., 3] = radius * np.sin(crank), radius * np.cos(crank)
    share = engine.throw_shares[cylinder]
    x[..., 4], y[..., 4] = share * x[..., 3], share * y[..., 3]
    return x, y


def pin_forces(
    phi: Any, engine: Cylinders, crank_ratio: Any, offset: Any, family: Family, row: Any,
    factors: Factors,
) -> list[Any]:  # fmt: skip
    """Force of each cylinder on its throw [N], upwards and i times to the side.

    `phi` [rad], ratios r/l and e/r, a `row` of diagrams, and the factors for main journals.
    """
    forces = []
    for cylinder in range(engine.count):
        parts = _on_throw(phi, engine, crank_ratio, offset, family, row, cylinder)
        x, y = (
            sum(factor * part[..., k] for k, factor in enumerate(factors[:PARTS])) for part in parts
        )
        forces.append(y + 1j * x)
    return forces


LOADS: dict[str, Parts] = {
    "crank_pin": _crank_pin,
    "piston_pin": _piston_pin,
    "main_journal": _main_journal,
}

KINDS = {"crank_pin": CRANK_PIN, "piston_pin": PISTON_PIN, "main_journal": MAIN_JOURNAL}
"""Code of each bearing load in kernels."""


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
        lambda [1]; offset of the piston-pin line over the crank radius [1].
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

    `phi` [rad], ratios r/l and e/r, a `row` of diagrams and cylinder sets broadcast;
    `factors.rotating` contains the part of the rod that reciprocates.
    """
    return _curves(
        "piston_pin", phi, crank_ratio, offset, family, row, factors, cylinders, by_count
    )


def main_journal_load(
    phi: Any, crank_ratio: Any, offset: Any, family: Family, row: Any, factors: Factors,
    cylinders: Any, by_count: CylindersByCount, journals: Any,
) -> tuple[Any, Any]:  # fmt: skip
    """Loads of the main journals [N], x and y (engine-fixed); NaN past an engine's last journal.

    `phi` [rad], ratios r/l and e/r, a `row` of diagrams, cylinder sets and `journals` (numbers from
    1) broadcast. `factors.rotating` contains the part of each rod that turns, `factors.throws` each
    throw, less their counterweights.
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


def in_turned_axes(load: Any, angle: Any) -> Any:
    """Components in axes turned by the crank's angle; its own inverse.

    (x, y) to (radial, tangential) and back: radial = x sin + y cos, tangential = x cos - y sin.
    `load` is complex, the first component and i times the second; `angle` [rad] is that of the
    crank to y, in the sense of rotation.
    """
    return 1j * np.conj(load) * np.exp(-1j * angle)


def first_crank(
    phi: Any, crank_ratio: Any, offset: Any, cylinders: Any, by_count: CylindersByCount
) -> Any:
    """Angle of crank 1 from upright [rad] at the crank angle `phi` [rad]; ratios r/l and e/r."""
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
        if not _exist(load, engine, np.array(number)):
            continue
        whole = _components(load, phi, engine, crank_ratio, offset, family, row, factors, number)
        sums = [np.where(counts == count, part, s) for part, s in zip(whole, sums, strict=True)]
    return sums[0], sums[1]


def _components(
    load: str, phi: Any, engine: Cylinders, crank_ratio: Any, offset: Any, family: Family, row: Any,
    factors: Factors, number: int,
) -> list[Any]:  # fmt: skip
    """Both components of a load of one engine [N]."""
    parts = LOADS[load](phi, engine, crank_ratio, offset, family, row, number)
    components = []
    for i in (0, 1):
        whole = sum(factor * parts[..., k, i] for k, factor in enumerate(factors[:PARTS]))
        if load == "main_journal":
            up, side = factors.web_up, factors.web_side
            ahead, behind = ((side, up), (up, -np.asarray(side)))[i]
            whole = whole + ahead * np.cos(phi) + behind * np.sin(phi)
        components.append(whole)
    return components


def _squares(load: str, engine: Cylinders, family: Family, columns: Floats, phi: Floats) -> Floats:
    """Square of a load of some designs, each at its own angle; `columns` as in `_of_engine`."""
    squares = np.empty(phi.size)
    for number in np.unique(columns[4]).astype(int).tolist():
        here = np.flatnonzero(columns[4] == number)
        # NumPy may compute a single angle by another loop, with other last bits.
        two = np.resize(here, max(here.size, 2))
        ratio, offset, row, _, _, *factors = columns[:, two, None]
        x, y = _components(
            load, phi[two, None], engine, ratio, offset, family, row, Factors(*factors), number
        )
        squares[here] = (x * x + y * y)[: here.size, 0]
    return squares


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
    threads: int | None = 1,
) -> npt.NDArray[Any]:
    """Largest, mean and root mean square load and angle of the largest, for each design.

    Parameters
    ----------
    load : str
        One of `LOADS`.
    period : float
        Angle of the cycle [rad].
    numbers : array_like
        Numbers of main journals, from 1; broadcasts.
    threads : int, optional
        Largest number of threads; None: one for each processor.
    others
        As in `crank_pin_load`.

    Returns
    -------
    ndarray of dtype EXTREMES
        Shape of all arguments broadcast; NaN past an engine's last journal.

    Notes
    -----
    Sampled at half a degree; the peak is found between samples (`superposition`). Memory does not
    grow with the number of designs: they are taken in pieces, in the order of their diagrams.
    """
    inputs = (crank_ratio, offset, row, cylinders, numbers, *factors)
    columns = np.broadcast_arrays(*(np.asarray(one, dtype=float) for one in inputs))
    shape = columns[0].shape
    columns = np.atleast_1d(*columns)
    result = np.full(columns[0].size, np.nan, dtype=EXTREMES)
    phi = sample_angles(period, family)
    for begin in range(0, result.size, DESIGNS_AT_ONCE):
        index = np.arange(begin, min(begin + DESIGNS_AT_ONCE, result.size))
        place = np.unravel_index(index, columns[0].shape)
        here = np.stack([column[place] for column in columns])
        for count in np.unique(here[3]).astype(int).tolist():
            mine = np.flatnonzero(here[3] == count)
            mine = mine[_exist(load, by_count[count], here[4, mine])]
            engine, columns_of = by_count[count], here[:, mine]
            for some, results in _of_engine(load, engine, family, columns_of, phi, threads):
                result[index[mine[some]]] = results
    return result.reshape(shape)


def of_all_journals(
    crank_ratio: Any, offset: Any, family: Family, row: Any, factors: Factors, cylinders: Any,
    by_count: CylindersByCount, period: float, threads: int | None = 1,
    webs: Callable[[Integers], Any] | None = None,
) -> npt.NDArray[Any]:  # fmt: skip
    """Extremes over all main journals of each design; parameters and notes as `extremes`.

    `webs` gives `web_up` + i `web_side` of journals, which are along the last axis.
    The largest load of any journal and its crank angle, the mean over the journals of the mean
    loads, and the root of their mean square.
    """
    engines = [by_count[int(number)] for number in np.unique(np.asarray(cylinders))]
    most = max(len(along_shaft(engine)) for engine in engines) + 1
    ratio, offset, row, cylinders = (
        np.asarray(one)[..., None] for one in (crank_ratio, offset, row, cylinders)
    )
    factors = Factors(*(np.asarray(one)[..., None] for one in factors))
    journals = np.arange(1, most + 1)
    if webs is not None:
        of_webs = webs(journals)
        factors = factors._replace(web_up=of_webs.real, web_side=of_webs.imag)
    each = extremes(
        "main_journal", ratio, offset, family, row, factors, cylinders, by_count, period,
        journals, threads,
    )  # fmt: skip
    largest = np.empty(each.shape[:-1], dtype=EXTREMES)
    known = np.isfinite(each["mean"])
    there = np.maximum(known.sum(axis=-1), 1)
    highest = np.argmax(np.where(known, each["peak"], -np.inf), axis=-1)[..., None]
    for field in ("peak", "angle"):
        largest[field] = np.take_along_axis(each[field], highest, axis=-1)[..., 0]
    largest["mean"] = np.where(known, each["mean"], 0.0).sum(axis=-1) / there
    largest["rms"] = np.sqrt((np.where(known, each["rms"], 0.0) ** 2).sum(axis=-1) / there)
    for field in ("mean", "rms"):
        largest[field] = np.where(known.any(axis=-1), largest[field], np.nan)
    return largest


def _of_engine(
    load: str, engine: Cylinders, family: Family, columns: Floats, phi: Floats, threads: int | None
) -> Iterator[tuple[Integers, npt.NDArray[Any]]]:
    """Extremes of all designs of one engine, with the indices of these designs.

    `columns` are crank ratio, offset, row, engine, number of the main journal and the factors.
    """
    along = load == "main_journal"
    below = np.floor(columns[2]).astype(np.int64)
    curves = len(set(map(curve_of, engine.members))) if along else 1
    at_once = max(1, int(BYTES_OF_TABLE // (16 * curves * phi.size)))
    order = np.argsort(below, kind="stable")
    begins = np.flatnonzero(np.diff(below[order], prepend=-1))[::at_once]
    for some in np.split(order, begins[1:]) if order.size else ():
        # Contiguous for any number of designs: a kernel is compiled anew for what is not.
        here, weight = np.ascontiguousarray(columns[:, some]), columns[2, some] - below[some]
        places = np.stack([below[some], below[some] + (weight > 0.0)])
        rows = np.unique(places)
        inputs = np.concatenate([here[:2], weight[None], here[5:]])
        places, numbers = np.searchsorted(rows, places), here[4].astype(np.int64)
        sampled = Sampled.of(engine, family, rows, phi, along)
        results = np.empty(some.size, EXTREMES)
        told = np.empty((FIRST + 4 * CRESTS, some.size))

        def work(
            begin: int, end: int, inputs: Floats = inputs, places: Integers = places,
            numbers: Integers = numbers, sampled: Sampled = sampled, here: Floats = here,
            told: Floats = told, results: npt.NDArray[Any] = results,
        ) -> None:  # fmt: skip
            fill_crests_of_loads(begin, end, KINDS[load], inputs, places, numbers, sampled, told)
            mine, own = told[:, begin:end], here[:, begin:end]
            which, crest = np.nonzero(np.arange(CRESTS) < mine[COUNT][:, None])
            place, *around = (mine[FIRST + 4 * crest + k, which] for k in range(4))
            step = phi[1] - phi[0]
            square, angle = tops(
                end - begin, which, phi[0] + step * place, np.stack(around), step,
                lambda w, at: _squares(load, engine, family, own[:, w], at),
            )  # fmt: skip
            results["peak"][begin:end], results["angle"][begin:end] = np.sqrt(square), angle
            results["mean"][begin:end], results["rms"][begin:end] = mine[MEAN], mine[RMS]

        # 64 designs, each of which takes 5 us or more, are worth a thread.
        on_threads(some.size, work, threads or os.cpu_count() or 1, 64)
        yield some, results


def _exist(load: str, engine: Cylinders, numbers: Floats) -> Any:
    """Whether an engine has each of the given main journals."""
    places = engine.along_shaft
    if load != "main_journal" or places is None:
        return np.ones(numbers.shape, dtype=np.bool_)
    return numbers <= len(places) + 1
