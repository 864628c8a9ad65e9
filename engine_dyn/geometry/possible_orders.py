"""All firing orders that a crankshaft and its banks allow.

In a four-stroke engine every cylinder passes top dead centre twice in a cycle and fires at one of
them, which the camshafts say. So a crankshaft of Z cylinders has 2^(Z-1) ways to fire once cylinder
1 fires at 0, and those count as firing orders here that leave the engine its own firing intervals:
an even engine stays even. A two-stroke engine fires at each dead centre, so its crankshaft says
everything.

Which crankshafts there are is a choice of its own, `CRANKS`. What stands at one place along the
shaft, a pin or the two of a split one, stays as it is and is turned as a whole.

Derived here. Counts: the in-line four has 1-3-4-2 and 1-2-4-3; the in-line six has 4 orders for its
crankshaft, 8 with that of the other hand and 5! = 120 in all; the in-line eight 7! = 5040.
"""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from engine_dyn.geometry.arrangement import SAME_ANGLE, TURN, Arrangement
from engine_dyn.geometry.firing_orders import (
    BOXER_ORDERS,
    IN_LINE_ORDERS,
    TWO_STROKE_BOXER_ORDERS,
    TWO_STROKE_IN_LINE_ORDERS,
    TWO_STROKE_VEE_ORDERS,
    VEE_ORDERS,
    KnownOrder,
)
from engine_dyn.types import Floats
from engine_dyn.units import DEGREE

CRANKS = {
    "own": "the engine's crankshaft as it is",
    "either-hand": "the engine's crankshaft and its mirror image",
    "any": "the throws of the engine's crankshaft in any sequence along the shaft",
}
"""Choices of crankshafts for a search of firing orders, in words."""

DIGITS = 9  # Decimals to which angles in degrees are rounded, because sums of turns are not exact


@dataclass(frozen=True)
class PossibleOrder:
    """One firing order of an engine."""

    arrangement: Arrangement  # The engine with this firing order; its name is the order
    own_crank: bool  # Whether the crankshaft is the given engine's, unchanged


def count_orders(engine: Arrangement, crank: str = "own") -> int:
    """How many orders `possible_orders` gives, without making them.

    `crank` is a word of `CRANKS`. The in-line twelve with any crank has 39 916 800 orders.

    Raises
    ------
    ValueError
        For a word that is none of `CRANKS`.
    """
    _check_crank(crank)
    places = _places(engine)
    each = sum(1 for _ in _firing_angles(engine, _offsets(places, places.base)))
    if crank == "any":
        return each * sum(_count_of(places, base) for base in _kinds_of_cranks(places))
    return each * (1 if crank == "own" else len(_kinds_of_cranks(places, alike=False)))


def possible_orders(engine: Arrangement, crank: str = "own") -> tuple[PossibleOrder, ...]:
    """Make every arrangement of an engine that fires in another order, the engine's own among them.

    Parameters
    ----------
    engine : Arrangement
        Crankshaft, banks and firing intervals, which all orders share.
    crank : str
        "own", "either-hand" or "any", see `CRANKS`.

    Returns
    -------
    tuple of PossibleOrder
        Sorted by their orders.

    Raises
    ------
    ValueError
        For a word that is none of `CRANKS`.

    Notes
    -----
    `count_orders` says beforehand how many there are. Cylinder 1 fires at 0 in all of them, so
    orders that begin at another cylinder of the same cycle do not count twice.

    Examples
    --------
    >>> from engine_dyn.geometry.layouts import in_line
    >>> [one.arrangement.name for one in possible_orders(in_line(4))]
    ['1-2-4-3', '1-3-4-2']
    """
    _check_crank(crank)
    places = _places(engine)
    bases: Iterator[tuple[float, ...]] = iter((places.base,))
    if crank == "either-hand":
        bases = iter(_kinds_of_cranks(places, alike=False))
    elif crank == "any":
        bases = itertools.chain.from_iterable(
            _cranks_of(places, base) for base in _kinds_of_cranks(places)
        )
    orders = []
    for base in bases:
        offsets = _offsets(places, base)
        own = _same_angles(base, places.base)
        for firing in _firing_angles(engine, offsets):
            orders.append(PossibleOrder(_with(engine, places, base, firing), own))
    return _named(orders)


def sampled_orders(
    engine: Arrangement, crank: str, number: int, seed: int = 1
) -> tuple[PossibleOrder, ...]:
    """Draw some of `possible_orders` at random, all equally likely; the engine's own is among them.

    Parameters
    ----------
    engine, crank
        As of `possible_orders`.
    number : int
        How many, at least 1; all of them where there are no more.
    seed : int
        Seed of the random numbers.

    Returns
    -------
    tuple of PossibleOrder
        Different ones, sorted by their orders.
    """
    total = count_orders(engine, crank)
    if number >= total:
        return possible_orders(engine, crank)
    random = np.random.default_rng(seed)
    places = _places(engine)
    kinds = _kinds_of_cranks(places, alike=crank == "any")
    kinds = kinds[:1] if crank == "own" else kinds
    base, firing = places.base, tuple(float(angle) for angle in engine.firing_angles)
    orders: dict[tuple[float, ...], PossibleOrder] = {}
    while len(orders) < number:
        made = _with(engine, places, base, firing)
        key = tuple(round(angle / DEGREE, DIGITS) for angle in firing)
        orders.setdefault(key, PossibleOrder(made, _same_angles(base, places.base)))
        base = kinds[random.integers(len(kinds))]
        if crank == "any":
            base = _shuffled(places, base, random)
        ways = list(_firing_angles(engine, _offsets(places, base)))
        firing = ways[random.integers(len(ways))]
    return _named(list(orders.values()))


def numbered_from_other_end(engine: Arrangement) -> Arrangement | None:
    """Return the same engine with its cylinders numbered from the other end.

    It is the mirror image in a plane across the shaft: loads and forces are the same, those of
    the first bearing now at the last. None where the places along the shaft differ.
    """
    members = _places(engine).members
    partner: dict[int, int] = {}
    for one, other in zip(members, reversed(members), strict=True):
        by_bank = {engine.cylinders[c].bank: c for c in other}
        if len(one) != len(other) or len(by_bank) != len(other):
            return None
        for cylinder in one:
            if engine.cylinders[cylinder].bank not in by_bank:
                return None
            partner[cylinder] = by_bank[engine.cylinders[cylinder].bank]
    return _fired_as(engine, [engine.firing_angles[partner[c]] for c in range(len(partner))])


def turning_other_way(engine: Arrangement) -> Arrangement | None:
    """Return the mirror image in a plane along the shaft, which fires in the reverse order.

    The engine turns the other way; seen in the mirror it turns as before, its banks are exchanged
    and its crankshaft is of the other hand. Phase vectors become their conjugates, so sums of them
    keep their length; the course of a load over the angle becomes another one.
    None where the banks do not stand alike on both sides.
    """
    banks = np.array(engine.banks)
    axis = banks[0] + banks[-1]
    exchanged = []
    for bank in banks:
        apart = [abs(math.remainder(axis - bank - other, TURN)) for other in banks]
        if min(apart) > SAME_ANGLE:
            return None
        exchanged.append(int(np.argmin(apart)))
    partner: dict[int, int] = {}
    for place in _places(engine).members:
        by_bank = {engine.cylinders[c].bank: c for c in place}
        for cylinder in place:
            bank = exchanged[engine.cylinders[cylinder].bank]
            if bank not in by_bank or len(by_bank) != len(place):
                return None
            partner[cylinder] = by_bank[bank]
    return _fired_as(engine, [-engine.firing_angles[partner[c]] for c in range(len(partner))])


def known_order_of(engine: Arrangement) -> tuple[KnownOrder, str] | None:
    """Return the order of practice that an engine fires in, and how its cylinders are counted.

    Parameters
    ----------
    engine : Arrangement
        In line, V or boxer; there are no lists of others.

    Returns
    -------
    tuple of KnownOrder and str, or None
        The text is empty, or "other end", "other way" or "other end, other way": the same engine
        counted from its other end, or turning the other way. None where no such order is known.
    """
    known = _known_of(engine)
    if not known:
        return None
    turned = turning_other_way(engine)
    ways = (
        (engine, ""), (numbered_from_other_end(engine), "other end"), (turned, "other way"),
        (None if turned is None else numbered_from_other_end(turned), "other end, other way"),
    )  # fmt: skip
    for seen, text in ways:
        orders = {} if seen is None else _orders_by_numbering(seen)
        for entry in known:
            if entry.order in orders.get(entry.numbering, ()):
                return entry, text
    return None


# --- crankshafts ---------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Places:
    """Throws of the crankshaft and their cylinders, at each place along the shaft."""

    members: tuple[tuple[int, ...], ...]  # Cylinders (from 0) of each place, sorted by their banks
    base: tuple[float, ...]  # Angle of the first throw at each place [rad]
    # Kind of each place: for each cylinder there its bank, the angle of its throw from the first
    # throw [degree] and its crank radius. Places of one kind may exchange their throws.
    kinds: tuple[tuple[tuple[int, float, float], ...], ...]
    first: int  # Place along the shaft of cylinder 1


def _places(engine: Arrangement) -> _Places:
    where = [engine.throws[c.throw].position for c in engine.cylinders]
    members = tuple(
        tuple(sorted(
            (i for i, own in enumerate(where) if own == position),
            key=lambda i: engine.cylinders[i].bank,
        ))
        for position in sorted(set(where))
    )  # fmt: skip
    base = tuple(engine.throws[engine.cylinders[some[0]].throw].angle for some in members)
    kinds = []
    for some, angle in zip(members, base, strict=True):
        throws = [engine.throws[engine.cylinders[i].throw] for i in some]
        kinds.append(tuple(
            (engine.cylinders[i].bank, _rounded(throw.angle - angle), throw.radius_factor)
            for i, throw in zip(some, throws, strict=True)
        ))  # fmt: skip
    first = next(place for place, some in enumerate(members) if 0 in some)
    return _Places(members, base, tuple(kinds), first)


def _rounded(angle: float) -> float:
    """An angle in degrees, from 0 to below 360, rounded so that equal angles are equal numbers."""
    return round(angle / DEGREE % 360.0, 2) % 360.0


def _same_angles(one: Sequence[float], other: Sequence[float]) -> bool:
    return all(
        abs(math.remainder(a - b, TURN)) < SAME_ANGLE for a, b in zip(one, other, strict=True)
    )


def _by_kind(places: _Places, base: Sequence[float], turn: float = 0.0) -> list[Counter[float]]:
    """Number of places of each kind at each angle, after the crankshaft is turned by an angle."""
    return [
        Counter(
            _rounded(angle + turn)
            for angle, own in zip(base, places.kinds, strict=True) if own == kind
        )
        for kind in sorted(set(places.kinds))
    ]  # fmt: skip


def _turns_of(places: _Places, base: Sequence[float], target: Sequence[float]) -> list[float]:
    """Angles by which a crankshaft can be turned so that its throws are those of another."""
    wanted = _by_kind(places, target)
    turns: dict[float, float] = {}
    for angle in base:
        turn = target[0] - angle
        if _by_kind(places, base, turn) == wanted:
            turns.setdefault(_rounded(turn), turn)
    return list(turns.values())


def _kinds_of_cranks(places: _Places, alike: bool = True) -> list[tuple[float, ...]]:
    """The crankshaft, and its mirror image if other (`alike`: other than by the sequence)."""
    first = places.base[places.first]  # where the throw of cylinder 1 stays
    mirrored = tuple((2.0 * first - angle) % TURN for angle in places.base)
    same = bool(_turns_of(places, mirrored, places.base)) if alike else False
    if same or _same_angles(mirrored, places.base):
        return [places.base]
    return [places.base, mirrored]


def _count_of(places: _Places, base: Sequence[float]) -> int:
    """Number of different crankshafts that have these throws in any sequence."""
    ways = 1
    for angles in _by_kind(places, base):
        ways *= math.factorial(angles.total())
        for alike in angles.values():
            ways //= math.factorial(alike)
    # A sequence that is turned as a whole is the same crankshaft: each was counted once for each of
    # these turns, because no turn leaves a sequence unchanged.
    return ways // len(_turns_of(places, base, base))


def _cranks_of(places: _Places, base: tuple[float, ...]) -> Iterator[tuple[float, ...]]:
    """All sequences of throws along the shaft, with the place of cylinder 1 at its angle."""
    turns = _turns_of(places, base, base)
    free: dict[tuple[tuple[int, float, float], ...], list[float]] = {}
    for angle, kind in zip(base, places.kinds, strict=True):
        free.setdefault(kind, []).append(angle)
    # Where turning the shaft takes one angle for cylinder 1 to another, one of both is enough.
    firsts: list[float] = []
    for angle in free[places.kinds[places.first]]:
        turned = {_rounded(angle + turn) for turn in turns}
        if not turned & {_rounded(known) for known in firsts}:
            firsts.append(angle)
    rest = [place for place in range(len(base)) if place != places.first]
    for first in firsts:
        left = {kind: list(angles) for kind, angles in free.items()}
        left[places.kinds[places.first]].remove(first)
        shift = places.base[places.first] - first
        for chosen in _sequences([places.kinds[place] for place in rest], left):
            angles = dict(zip(rest, chosen, strict=True)) | {places.first: first}
            yield tuple((angles[place] + shift) % TURN for place in range(len(base)))


def _shuffled(
    places: _Places, base: tuple[float, ...], random: np.random.Generator
) -> tuple[float, ...]:
    """One sequence of throws along the shaft, with the place of cylinder 1 at its angle."""
    angles = list(base)
    for kind in sorted(set(places.kinds)):
        mine = [place for place, own in enumerate(places.kinds) if own == kind]
        for place, other in zip(mine, random.permutation(mine).tolist(), strict=True):
            angles[place] = base[other]
    shift = places.base[places.first] - angles[places.first]
    return tuple((angle + shift) % TURN for angle in angles)


def _sequences(
    kinds: Sequence[tuple[tuple[int, float, float], ...]],
    left: dict[tuple[tuple[int, float, float], ...], list[float]],
) -> Iterator[tuple[float, ...]]:
    """All different assignments of the remaining angles to the places, by their kinds."""
    if not kinds:
        yield ()
        return
    angles = left[kinds[0]]
    tried: set[float] = set()
    for number, angle in enumerate(angles):
        if _rounded(angle) in tried:
            continue
        tried.add(_rounded(angle))
        del angles[number]
        for rest in _sequences(kinds[1:], left):
            yield (angle, *rest)
        angles.insert(number, angle)


# --- firing angles --------------------------------------------------------------------------------


def _offsets(places: _Places, base: Sequence[float]) -> list[float]:
    """Angle by which each cylinder's dead centre moves when the throws stand at `base` [rad]."""
    moved = [0.0] * sum(len(some) for some in places.members)
    for some, before, after in zip(places.members, places.base, base, strict=True):
        for cylinder in some:
            moved[cylinder] = before - after
    return moved


def _firing_angles(engine: Arrangement, moved: Sequence[float]) -> Iterator[tuple[float, ...]]:
    """Firing angles [rad] of all orders of one crankshaft with the engine's firing intervals."""
    top = (engine.firing_angles + np.asarray(moved)) % TURN
    top[TURN - top < SAME_ANGLE] = 0.0
    wanted = np.sort(engine.firing_intervals)
    turns = round(engine.period / TURN)
    count = len(engine.cylinders)
    for some in _in_pieces(turns, count - 1):
        angles = np.zeros((len(some), count))
        angles[:, 1:] = top[1:] + TURN * some
        intervals = np.diff(np.sort(angles, axis=1), axis=1, append=engine.period)
        apart = np.abs(np.sort(intervals, axis=1) - wanted).max(axis=1)
        for row in angles[apart < 2.0 * SAME_ANGLE]:
            yield tuple(round(angle / DEGREE, DIGITS) * DEGREE for angle in row.tolist())


def _in_pieces(turns: int, count: int) -> Iterator[Floats]:
    """All combinations of whole turns for some cylinders, in arrays of at most 4096."""
    total = turns**count
    for begin in range(0, total, 4096):
        number = np.arange(begin, min(begin + 4096, total))
        yield (number[:, None] // turns ** np.arange(count)[None, :] % turns).astype(np.float64)


def _with(
    engine: Arrangement, places: _Places, base: Sequence[float], firing: Sequence[float]
) -> Arrangement:
    """The engine with other throw angles and other firing angles."""
    turned = {}
    for some, before, after in zip(places.members, places.base, base, strict=True):
        for cylinder in some:
            turned[engine.cylinders[cylinder].throw] = after - before
    throws = tuple(
        replace(throw, angle=round((throw.angle + turned[number]) / DEGREE % 360.0, DIGITS)
                % 360.0 * DEGREE)
        for number, throw in enumerate(engine.throws)
    )  # fmt: skip
    cylinders = tuple(
        replace(one, firing_angle=angle)
        for one, angle in zip(engine.cylinders, firing, strict=True)
    )
    return _named_by_order(replace(engine, throws=throws, cylinders=cylinders))


def _fired_as(engine: Arrangement, firing: Sequence[float]) -> Arrangement:
    """The engine with other firing angles, cylinder 1 at 0, and throws that follow from them."""
    angles = (np.asarray(firing) - firing[0]) % engine.period
    angles[engine.period - angles < SAME_ANGLE] = 0.0
    first = engine.cylinders[0]
    zero = engine.throws[first.throw].angle - engine.banks[first.bank]
    throws = list(engine.throws)
    cylinders = []
    for one, angle in zip(engine.cylinders, angles.tolist(), strict=True):
        throws[one.throw] = replace(
            throws[one.throw], angle=(zero + engine.banks[one.bank] - angle) % TURN
        )
        cylinders.append(replace(one, firing_angle=float(angle)))
    return _named_by_order(replace(engine, throws=tuple(throws), cylinders=tuple(cylinders)))


def _named(orders: list[PossibleOrder]) -> tuple[PossibleOrder, ...]:
    """Sorted firing orders with names that differ: where orders are equal, angles are added."""
    orders.sort(key=lambda o: (o.arrangement.firing_order, tuple(o.arrangement.firing_angles)))
    often = Counter(one.arrangement.name for one in orders)
    named = []
    for one in orders:
        if often[one.arrangement.name] > 1:
            degrees = np.sort(one.arrangement.firing_angles) / DEGREE
            text = ", ".join(f"{round(float(angle), 2):g}" for angle in degrees)
            name = f"{one.arrangement.name} at {text}"
            one = PossibleOrder(replace(one.arrangement, name=name), one.own_crank)
        named.append(one)
    return tuple(named)


# --- orders of practice --------------------------------------------------------------------------


def _known_of(engine: Arrangement) -> tuple[KnownOrder, ...]:
    """Firing orders of practice for engines of this kind and number of cylinders."""
    two_stroke = engine.period == TURN
    count = len(engine.cylinders)
    if len(engine.banks) == 1:
        return (TWO_STROKE_IN_LINE_ORDERS if two_stroke else IN_LINE_ORDERS).get(count, ())
    if len(engine.banks) != 2 or any(len(some) != 2 for some in _places(engine).members):
        return ()
    apart = abs(math.remainder(engine.banks[1] - engine.banks[0], TURN))
    splits = {
        _rounded(engine.throws[engine.cylinders[a].throw].angle
                 - engine.throws[engine.cylinders[b].throw].angle)
        for a, b in _places(engine).members
    }  # fmt: skip
    if abs(apart - 0.5 * TURN) < SAME_ANGLE and splits == {180.0}:
        return (TWO_STROKE_BOXER_ORDERS if two_stroke else BOXER_ORDERS).get(count, ())
    return (TWO_STROKE_VEE_ORDERS if two_stroke else VEE_ORDERS).get(count, ())


def _orders_by_numbering(engine: Arrangement) -> dict[str, set[tuple[int, ...]]]:
    """Firing orders for each numbering of an engine's cylinders: see `KnownOrder.numbering`."""
    members = _places(engine).members
    banks = len(engine.banks)
    orders: dict[str, set[tuple[int, ...]]] = {"banks": set(), "alternate": set()}
    for first in range(banks):
        numbers = {"banks": {}, "alternate": {}}  # type: dict[str, dict[int, int]]
        for place, some in enumerate(members):
            for cylinder in some:
                bank = (engine.cylinders[cylinder].bank - first) % banks
                numbers["banks"][cylinder] = bank * len(members) + place + 1
                numbers["alternate"][cylinder] = place * banks + bank + 1
        for numbering, number in numbers.items():
            order = [number[cylinder - 1] for cylinder in engine.firing_order]
            begin = order.index(1)
            orders[numbering].add((*order[begin:], *order[:begin]))
    return orders


def _check_crank(crank: str) -> None:
    if crank not in CRANKS:
        raise ValueError(f"crank = '{crank}': must be one of {', '.join(CRANKS)}")


def _named_by_order(made: Arrangement) -> Arrangement:
    return replace(made, name="-".join(map(str, made.firing_order)))
