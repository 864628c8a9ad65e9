"""Sums of curves over the cylinders of an engine, the order of cylinders along the shaft, extremes.

Kernels sum over cylinders by themselves, in their own loops. Values of each set of cylinders are
taken by `cylinder_means.value_of_sets`.

The largest value of a curve over a cycle is looked for between its samples too. A sample beside
which the largest value may stand is a *crest*: neither neighbour is above it, and with its second
difference, by which neither a smooth curve nor a kink between samples rises further, it reaches the
largest sample. Beside each crest the curve itself is evaluated, at the top of the parabola through
three points, or in the middle of the wider gap, until nothing is left to rise. So the result is not
below any point of the curve, wherever the samples are.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from engine_dyn.compilation import kernel
from engine_dyn.geometry.cylinders import EQUAL, Cylinders, CylindersByCount, Member
from engine_dyn.pressure.cycle_table import CycleTable
from engine_dyn.pressure.family import Family
from engine_dyn.types import Booleans, Floats, Integers


def superpose(
    curve: Callable[[Any, Member], Any],
    phi: Any,
    cylinders: Any,
    period: float,
    by_count: CylindersByCount | None = None,
    phase_of: Callable[[Member], Any] = lambda member: member.phase,
) -> Any:
    """Sum of a cylinder's curve over all cylinders.

    docs/method.md (39); Kakaitsas (2015), eqs. 5.1-5.3. The curve is evaluated at the shifted
    angles themselves, for a cylinder whose factors it may use; `cylinders` broadcasts with `phi`.
    They are keys of `by_count`, or numbers of evenly firing equal cylinders. `phase_of` is
    the phase of a cylinder that differs from others [rad].
    """
    counts = np.asarray(cylinders)
    others = {z: c for z, c in (by_count or {}).items() if not c.plain and (counts == z).any()}
    total: Any = 0.0
    if not np.isin(counts, list(others)).all():
        numbers = counts.astype(float)
        for key, engine in (by_count or {}).items():
            numbers = np.where(counts == key, float(engine.count), numbers)
        for i in range(int(numbers.max())):
            term = curve(phi - i * period / numbers, EQUAL)
            total = total + (term if i == 0 else np.where(i < numbers, term, 0.0))
    for count, engine in others.items():
        whole = sum(curve(phi + phase_of(member), member) for member in engine.members)
        total = np.where(counts == count, whole, total)
    return total


class CrankTrain(NamedTuple):
    """Slider-cranks of the cylinders of designs; arrays broadcast."""

    crank_ratio: Any  # Engine's crank radius over rod length, lambda = r/l [1]
    double_radius: Any  # Twice the crank radius, 2 r [m], the stroke of an engine without offset
    cylinders: Any  # Cylinder set of each design, or its number of evenly firing equal cylinders
    period: float  # Crank angle of the cycle [rad]
    # Distance from the crank's axis to the line on which the piston pin moves, over the crank
    # radius [1].
    offset: Any = 0.0
    by_count: CylindersByCount | None = None  # Cylinders of each cylinder set

    def velocity(self, phi: Any, member: Member) -> Any:
        """Piston velocity of a cylinder over the engine's crank radius and speed [1]."""
        return member.velocity(phi, self.crank_ratio, self.offset)

    def acceleration(self, phi: Any, member: Member) -> Any:
        """Piston acceleration of a cylinder over the engine's crank radius and speed squared."""
        return member.acceleration(phi, self.crank_ratio, self.offset)

    def square(self, phi: Any, member: Member) -> tuple[Any, Any]:
        """Kinetic energy of a cylinder's masses over m r^2 omega^2/2, and its slope [1]."""
        return member.square(phi, self.crank_ratio, self.offset)

    def phase_of(self, member: Member) -> Any:
        """Angle to add to the engine's to get a cylinder's own [rad]."""
        return member.phase_of(self.crank_ratio, self.offset)

    def superpose(self, curve: Callable[[Any, Member], Any], phi: Any) -> Any:
        """Sum of a cylinder's curve over all cylinders: see `superpose`."""
        return superpose(curve, phi, self.cylinders, self.period, self.by_count, self.phase_of)


def along_shaft(engine: Cylinders) -> tuple[tuple[int, ...], ...]:
    """Places of the cylinders (from 0) on each throw along the shaft, from the free end.

    Raises
    ------
    ValueError
        Where their order along the shaft is not known.
    """
    places = engine.along_shaft
    if places is None:
        raise ValueError(f"{len(engine.members)} cylinders: their order along the shaft is unknown")
    return places


WIDEST = np.pi / 360.0  # Widest step of samples, half a degree: enough for smooth curves

CurveOfDesigns = Callable[[Integers, Floats], Floats]
"""Values of the curves of some designs, each at an angle [rad] of its own: shapes (N,)."""


def sample_angles(period: float, family: Family | None = None) -> Floats:
    """Equal steps of a period from minus half of it on [rad], no wider than the gaps of diagrams.

    A curve may turn in each gap between the points of a noisy recording.
    """
    gap = WIDEST
    if family is not None and not isinstance(family, CycleTable):  # modelled cycles are smooth
        # Steps are no wider than the gaps of a diagram, but never below 1/32 degree.
        every = [one for each in (family, *family.of_cylinders.values()) for one in each.diagrams]
        gap = max(min(WIDEST, *(one.widest_gap for one in every)), np.pi / 5760.0)
    count = int(np.ceil(period / gap - 1e-6))
    return np.asarray(-0.5 * period + np.arange(count, dtype=np.float64) * (period / count))


def largest(
    values: Floats, phi: Floats, curve: CurveOfDesigns, sign: float = 1.0
) -> tuple[Floats, Floats]:
    """Largest value of periodic curves times `sign`, and its angle.

    Parameters
    ----------
    values : ndarray, shape (D, A)
        Samples of one period.
    phi : ndarray, shape (A,)
        Their angles [rad], equal steps.
    curve : callable
        The curves themselves.

    Returns
    -------
    value, angle : ndarray, shape (D,)
        NaN where a sample is.

    Examples
    --------
    >>> phi = np.arange(0.0, 2.0 * np.pi, np.pi / 20.0)
    >>> found = largest(np.cos(phi - 0.1234)[None], phi, lambda which, at: np.cos(at - 0.1234))
    >>> [round(float(one[0]), 6) for one in found]
    [1.0, 0.1234]
    """
    which, place, around = crests(values, sign)
    return tops(
        len(values), which, phi[place], around, phi[1] - phi[0],
        lambda designs, angle: sign * curve(designs, angle),
    )  # fmt: skip


def crests(values: Floats, sign: float = 1.0) -> tuple[Integers, Integers, Floats]:
    """Crests of curves times `sign`: rows, places, and values before, at and behind each.

    `values` has a curve in each row, shape (D, A); one with NaN has none.
    """
    marked = np.zeros(values.shape, dtype=np.bool_)
    _mark_crests(values, sign, marked)
    which, place = np.nonzero(marked)
    count = values.shape[1]
    return which, place, np.stack([sign * values[which, (place + k) % count] for k in (-1, 0, 1)])


def reach(around: Floats) -> Floats:
    """Bound that a curve is not above beside its crests."""
    return np.asarray(3.0 * around[1] - around[0] - around[2])


@kernel
def _mark_crests(values: Floats, sign: float, marked: Booleans) -> None:
    designs, count = values.shape
    for design in range(designs):
        curve, total = values[design], 0.0
        highest = sign * curve[0]
        for i in range(count):
            highest = max(highest, sign * curve[i])
            total += curve[i]
        if total != total:
            continue
        for i in range(count):
            here, before = sign * curve[i], sign * curve[i - 1 if i > 0 else count - 1]
            after = sign * curve[i + 1 if i < count - 1 else 0]
            if here >= before and here >= after and 3.0 * here - before - after >= highest:
                marked[design, i] = True


def tops(
    designs: int, which: Integers, angle: Floats, around: Floats, step: float, curve: CurveOfDesigns
) -> tuple[Floats, Floats]:
    """Largest value of each design, and its angle, from its crests; NaN for one without.

    Parameters
    ----------
    designs : int
        How many there are.
    which, angle : ndarray, shape (N,)
        Design and angle [rad] of each crest, those of a design in the order of their angles.
    around : ndarray, shape (3, N)
        Values a step before the crest, at it, and behind it.
    step : float
        [rad].
    curve : callable
        The curves.
    """
    value, place = np.full(designs, np.nan), np.full(designs, np.nan)
    top, moved = _risen(which, angle, around, step, curve)
    np.fmax.at(value, which, top)
    # Crests within 1e-9 of the largest value are equal but for rounding. The angle of the first
    # of them is taken: in reversed order, it is written last.
    size = 1e-9 * np.abs(value)
    first = np.flatnonzero(top >= (value - size)[which])[::-1]
    place[which[first]] = angle[first] + step * moved[first]
    return value, place


def _risen(
    which: Integers, angle: Floats, around: Floats, step: float, curve: CurveOfDesigns
) -> tuple[Floats, Floats]:
    """Value at the top next to each crest, and the distance of the top from the crest, in steps."""
    left, here, right = np.stack([np.full(which.size, k) for k in (-1.0, 0.0, 1.0)])
    before, top, after = around.copy()
    # The search ends where a curve may rise by no more than 1e-11 of its size.
    least = 1e-11 * np.abs(around).max(axis=0)
    calm = np.zeros(which.size, dtype=np.int64)
    alive = np.arange(which.size)
    # A search at a kink takes about forty evaluations.
    for number in range(80):
        a, m, b = left[alive], here[alive], right[alive]
        up = (top[alive] - before[alive]) / (m - a)
        bend = ((after[alive] - top[alive]) / (b - m) - up) / (b - a)
        slope = up + bend * (m - a)
        with np.errstate(divide="ignore", invalid="ignore"):
            vertex = m - 0.5 * slope / bend
            rise = np.where(bend < 0.0, -0.25 * slope * slope / bend, 0.0)
        calm[alive] = np.where(rise > least[alive], 0, calm[alive] + 1)
        wider = np.where(m - a > b - m, 0.5 * (a + m), 0.5 * (m + b))
        near = np.abs(vertex - m) < 1e-3 * (b - a)
        by_gap = near | (calm[alive] > 0) | ~np.isfinite(vertex)
        # Some steps halve the wider gap, in case parabolas approach the top from one side only: one
        # of three in the first six, which a smooth crest needs, then three of four.
        by_gap |= number % 3 == 2 if number < 6 else number % 4 != 0
        tried = np.where(by_gap, wider, vertex)
        go = (calm[alive] < 2) & (b - a > 1e-12)
        if not go.any():
            break
        alive, tried, m = alive[go], tried[go], m[go]
        # NumPy may compute a single point by another loop, with other last bits.
        two = np.resize(np.arange(alive.size), max(alive.size, 2))
        risen = curve(which[alive][two], (angle[alive] + step * tried)[two])[: alive.size]
        higher, behind = risen > top[alive], tried > m
        # The new point or the previous top becomes the end of the bracket on its side.
        end, value = np.where(higher, m, tried), np.where(higher, top[alive], risen)
        to_left = higher == behind
        left[alive] = np.where(to_left, end, left[alive])
        before[alive] = np.where(to_left, value, before[alive])
        right[alive] = np.where(to_left, right[alive], end)
        after[alive] = np.where(to_left, after[alive], value)
        here[alive] = np.where(higher, tried, m)
        top[alive] = np.where(higher, risen, top[alive])
    return top, here
