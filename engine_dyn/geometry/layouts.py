"""Customary arrangements by name: in-line, V, VR, W, boxer, radial engines, parallel twins.

Functions take radians; `arrangement_from_text` reads what engine files say, in degrees:

    in-line 6                       in-line 6 1-4-2-6-3-5
    V8 cross-plane                  V8 flat-plane 1-5-4-8-3-7-2-6
    V6 60 split-pin                 V6 90 shared-pin alternate 1-6-5-4-3-2
    V2 45                           boxer 6
    VR6 15                          VR4 13 1-3-4-2
    W3 60,0,-60 1-3-2               radial 9, radial 14 two-row
    parallel twin 270

Without an order a layout takes the first of `firing_orders` that an engine built so has; where none
is known, one must be given: an even firing alone does not make a crankshaft that anybody builds.

The bank angle of a V engine may lie on either side of the first bank: the order decides, as the
side that needs the least splitting of pins, or makes the firing most even. Cylinders of a V or W
engine that face one place of the shaft share its pin, unless pins are split.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from engine_dyn.geometry.arrangement import (
    FOUR_STROKE,
    SAME_ANGLE,
    TURN,
    Arrangement,
    Cylinder,
    Throw,
)
from engine_dyn.geometry.firing_orders import (
    BOXER_ORDERS,
    TWO_STROKE_BOXER_ORDERS,
    TWO_STROKE_VEE_ORDERS,
    VEE_ORDERS,
    VR_ORDERS,
    KnownOrder,
    customary_order,
    in_line_order_by_rule,
    known_vee_order,
    two_stroke_in_line_order_by_rule,
)
from engine_dyn.units import DEGREE

NUMBERINGS = ("banks", "alternate")
PINS = ("shared", "split")
CRANKS = ("cross-plane", "flat-plane")
PIN_WORDS = ("shared-pin", "split-pin")
MOST = 99


def in_line(
    cylinders: int, order: Sequence[int] | None = None, period: float = FOUR_STROKE
) -> Arrangement:
    """In-line engine with evenly spaced firings.

    Parameters
    ----------
    cylinders : int
        1 to 99.
    order : sequence of int, optional
        Firing order; the customary one if not given, which is known for up to 8 cylinders, and up
        to 7 of two-stroke engines.
    period : float
        4 pi (four-stroke) or 2 pi.
    """
    _check_count("in-line", cylinders, 1, MOST)
    if order is None:
        order = customary_order(cylinders, two_stroke=period == TURN)
    if order is None:
        rule = in_line_order_by_rule if period > TURN else two_stroke_in_line_order_by_rule
        raise _no_order(f"in-line {cylinders}", cylinders, f"such as {_shown(rule(cylinders))}")
    firing = _even(order, cylinders, period)
    return _built(f"in-line {cylinders}", period, firing, [0] * cylinders, range(cylinders), (0.0,))


def parallel_twin(crank: float) -> Arrangement:
    """Four-stroke in-line twin whose second piston fires `crank` [rad] after the first.

    2 pi: both pistons in step, even firing. pi: pistons opposed, intervals of 180 and 540 degrees.
    3/2 pi: intervals of 270 and 450 degrees, as a V twin of 90 degrees.
    """
    if not 0.0 < crank <= TURN:
        raise ValueError(
            f"parallel twin: crank = {crank / DEGREE:g} degree: must be above 0 and at most 360"
        )
    name = f"parallel twin {crank / DEGREE:g}"
    return _built(name, FOUR_STROKE, [0.0, crank], [0, 0], range(2), (0.0,))


def vee(
    cylinders: int,
    bank_angle: float,
    pins: str = "shared",
    order: Sequence[int] | None = None,
    numbering: str | None = None,
    crank: str | None = None,
    period: float = FOUR_STROKE,
) -> Arrangement:
    """V engine of two banks.

    Parameters
    ----------
    cylinders : int
        An even number.
    bank_angle : float
        Angle between the banks [rad], above 0 and at most pi.
    pins : str
        "shared": two rods on a pin; the firing is uneven if the bank angle makes it so. "split":
        each rod has its pin, placed so that the firing is even.
    order : sequence of int, optional
        Firing order. Without it that of an engine known to be built with this bank angle, these
        pins and this crank (`firing_orders.known_vee_order`).
    numbering : str, optional
        Numbering that `order` counts by: "banks" or "alternate" (see `firing_orders.KnownOrder`).
        As the order is known with, "banks" for others.
    crank : str, optional
        "cross-plane" or "flat-plane", of a four-stroke V8 without an order.
    period : float
        4 pi (four-stroke) or 2 pi.

    Raises
    ------
    ValueError
        One line, for no such engine, and without an order where none is known.
    """
    name = f"V{cylinders}"
    _check_count("V", cylinders, 2, MOST)
    if cylinders % 2:
        raise ValueError(
            f"{name}: cylinders = {cylinders}: must be an even number; a table of throws, "
            "banks and cylinders describes such an engine"
        )
    if not 0.0 < bank_angle <= math.pi:
        raise ValueError(
            f"{name}: bank angle = {bank_angle / DEGREE:g} degree: must be above 0 and at most 180"
        )
    _check_word(name, "pins", pins, PINS)
    name = f"{name} {bank_angle / DEGREE:g} {pins}-pin"
    known = (VEE_ORDERS if period == FOUR_STROKE else TWO_STROKE_VEE_ORDERS).get(cylinders, ())
    if crank is not None:
        _check_word(name, "crank", crank, CRANKS)
        name = f"{name} {crank}"
    if order is None:
        cranks = {entry.crank for entry in known if entry.crank}
        if crank is not None and not cranks:
            raise ValueError(f"{name}: crank = '{crank}': allowed for four-stroke V8 engines only")
        if crank is None and cranks:
            raise ValueError(f"{name}: must say cross-plane or flat-plane, or give the order")
        entry = known_vee_order(
            _numbered_so(known, numbering), bank_angle / DEGREE, pins, crank or ""
        )
        if entry is None:
            raise _no_order(name, cylinders, _vee_hint(cylinders, known))
        order, numbering = entry.order, entry.numbering
    numbering = numbering or _known_numbering(order, known)
    _check_word(name, "numbering", numbering, NUMBERINGS)
    banks, places = _numbered(cylinders, 2, numbering)
    layouts = [
        _of_order(name, order, banks, places, (0.0, side * bank_angle), pins, period)
        for side in (1.0, -1.0)
    ]
    # With the second bank on the wrong side of the first, shared pins fire in another order.
    right = [one for one in layouts if _fires(one, order)]
    if not right:
        raise ValueError(
            f"{name}: order {_shown(order)}: shared pins and this bank angle fire "
            f"{_shown(layouts[0].firing_order)}"
        )
    made = min(right, key=lambda one: _oddness(one, pins))
    if crank is not None and _crank_of(made) != crank:
        raise ValueError(f"{name}: order {_shown(order)} makes a {_crank_of(made)} crank")
    return made


def vr_engine(
    cylinders: int,
    bank_angle: float,
    order: Sequence[int] | None = None,
    period: float = FOUR_STROKE,
) -> Arrangement:
    """VR engine: a narrow V whose cylinders, in turns in either bank, have each its own throw.

    Pins are splayed so that the firing is even. The banks lie to opposite sides of the crank's
    axis: an offset of the engine is that of the bank of cylinder 1, the other has it reversed. The
    second bank lies `bank_angle` behind the first, against the sense of rotation, so that the axes
    of the cylinders meet below the crank's with a positive offset, as they are built. Which bank
    cylinder 1 is in is an assumption; the other choice is the mirrored engine.

    Parameters
    ----------
    cylinders : int
        3 or more; odd numbers are in the first bank.
    bank_angle : float
        Angle between the banks [rad], above 0 and at most 45 degrees.
    order : sequence of int, optional
        Firing order; without it the one of `firing_orders.VR_ORDERS`.
    period : float
        4 pi (four-stroke) or 2 pi.
    """
    name = f"VR{cylinders}"
    _check_count("VR", cylinders, 3, MOST)
    if not 0.0 < bank_angle <= 0.25 * math.pi:
        raise ValueError(
            f"{name}: bank angle = {bank_angle / DEGREE:g} degree: must be above 0 and at most 45"
        )
    name = f"{name} {bank_angle / DEGREE:g}"
    if order is None:
        if period == TURN or cylinders not in VR_ORDERS:
            raise _no_order(name, cylinders, "in turns in either bank along the shaft")
        order = VR_ORDERS[cylinders].order
    banks = [k % 2 for k in range(cylinders)]
    made = _of_order(name, order, banks, range(cylinders), (0.0, -bank_angle), "split", period)
    return replace(made, sides=(1.0, -1.0))


def w_engine(
    cylinders: int,
    bank_angles: Sequence[float],
    pins: str = "shared",
    order: Sequence[int] | None = None,
    numbering: str = "banks",
    period: float = FOUR_STROKE,
) -> Arrangement:
    """Engine of any number of banks on one crankshaft; bank angles [rad] in the sense of rotation.

    `cylinders` is a multiple of the number of banks, `pins` shared or split, `numbering` by banks
    or alternate, `period` [rad]. No order of practice is known here, so one must be given.
    """
    name = f"W{cylinders}"
    banks = len(bank_angles)
    if banks < 2 or cylinders < banks or cylinders % banks:
        raise ValueError(
            f"{name}: {banks} bank angles: must be two or more, which divide the cylinders"
        )
    _check_word(name, "pins", pins, PINS)
    _check_word(name, "numbering", numbering, NUMBERINGS)
    if order is None:
        raise _no_order(name, cylinders, _BY_BANKS)
    bank_of, places = _numbered(cylinders, banks, numbering)
    made = _of_order(name, order, bank_of, places, tuple(bank_angles), pins, period)
    if not _fires(made, order):
        raise ValueError(
            f"{name}: order {_shown(order)}: shared pins and these banks fire "
            f"{_shown(made.firing_order)}"
        )
    return made


def boxer(
    cylinders: int,
    order: Sequence[int] | None = None,
    numbering: str | None = None,
    period: float = FOUR_STROKE,
) -> Arrangement:
    """Boxer engine: two banks 180 degrees apart, the pistons of a pair move against each other.

    The pins of a pair stand 180 degrees apart (a V engine of 180 degrees shares one). Four-stroke
    pairs fire a turn apart, two-stroke pairs together.

    Parameters
    ----------
    cylinders : int
        An even number.
    order : sequence of int, optional
        Firing order; without it the customary one, which is known for up to 8 cylinders, and up to
        6 of two-stroke engines.
    numbering : str, optional
        As in `vee`.
    period : float
        4 pi (four-stroke) or 2 pi.
    """
    name = f"boxer {cylinders}"
    _check_count("boxer", cylinders, 2, MOST)
    if cylinders % 2:
        raise ValueError(f"{name}: cylinders = {cylinders}: must be an even number")
    pairs = cylinders // 2
    known = (BOXER_ORDERS if period > TURN else TWO_STROKE_BOXER_ORDERS).get(cylinders, ())
    if order is None:
        so = _numbered_so(known, numbering)
        if not so:
            raise _no_order(name, cylinders, _BY_BANKS)
        order, numbering = so[0].order, so[0].numbering
    numbering = numbering or _known_numbering(order, known)
    _check_word(name, "numbering", numbering, NUMBERINGS)
    banks, places = _numbered(cylinders, 2, numbering)
    firing = _even(order, cylinders, period)
    if period == TURN:  # the second cylinder of each pair fires with the first
        for first, second in zip(order[0::2], order[1::2], strict=True):
            firing[second - 1] = firing[first - 1]
    for place in range(pairs):
        one, other = (k for k in range(cylinders) if places[k] == place)
        if abs(math.remainder(firing[one] - firing[other], TURN)) > SAME_ANGLE:
            raise ValueError(
                f"{name}: order {_shown(order)}: the pistons of cylinders {one + 1} and "
                f"{other + 1} do not move in opposition"
            )
    return _built(name, period, firing, banks, places, (0.0, math.pi))


def radial(cylinders: int, rows: int = 1, period: float = FOUR_STROKE) -> Arrangement:
    """Radial engine, numbered around in the sense of rotation, each row on one pin.

    Four-stroke rows have an odd number of cylinders: every second one fires, 1-3-5-2-4. Two rows
    (cylinders staggered, pins 180 degrees apart) fire in turns: of 14 cylinders, 9 on or 5 back
    (FAA-H-8083-32). Rods work on the pin itself unless `Cylinders.with_rods` makes some of them
    articulated rods.
    """
    name = f"radial {cylinders}" + (" two-row" if rows == 2 else "")
    if rows not in (1, 2) or (rows == 2 and period == TURN):
        raise ValueError(f"{name}: rows = {rows}: must be 1, or 2 in a four-stroke engine")
    in_row = cylinders // rows
    if in_row * rows != cylinders or in_row < 3 or (period > TURN and in_row % 2 == 0):
        odd = "an odd number, 3 or more," if period > TURN else "3 or more"
        two = cylinders % 4 == 2 and cylinders >= 6 and period > TURN and rows == 1
        hint = f"; 'radial {cylinders} two-row' has two rows" if two else ""
        raise ValueError(f"{name}: cylinders = {cylinders}: must be {odd} in each row{hint}")
    spacing = TURN / cylinders
    firing = []
    for k in range(cylinders):
        row = k % rows
        # A row begins with the cylinder whose dead centre is at the row's first firing.
        first = row * period / cylinders
        step = round(((k * spacing - row * math.pi - first) % TURN) / (TURN / in_row))
        second = period > TURN and step % 2
        firing.append((first + TURN * ((step % in_row) / in_row + bool(second))) % period)
    each, angles = range(cylinders), tuple(k * spacing for k in range(cylinders))
    return _built(name, period, firing, each, [k % rows for k in each], angles)


def arrangement_from_text(text: str, period: float = FOUR_STROKE) -> Arrangement:
    """Read an arrangement as engine files give it; angles in degrees. The module shows the forms.

    Raises
    ------
    ValueError
        One line that begins with `arrangement = '...'`.
    """
    try:
        return _read(text, period)
    except ValueError as error:
        raise ValueError(f"arrangement = '{text}': {error}") from None


def not_covered(text: str) -> str | None:
    """Why an engine that a text names is none of this project; None for all others."""
    words = text.strip().lower()
    # Words for engines with another mechanism, and why they are not covered.
    others = {
        r"wankel|rotary": "Wankel engines are not covered: a rotor is no piston on a crank",
        r"opposed[- ]piston": "opposed pistons are not covered: each cylinder has two, on "
        "two cranks",
        r"free[- ]piston": "free-piston engines are not covered: they have no crank",
        r"axial|barrel|(swash|wobble)[- ]?plate": "axial engines are not covered: their pistons "
        "work along the shaft, on a plate",
    }
    return next((why for name, why in others.items() if re.match(name, words)), None)


def _read(text: str, period: float) -> Arrangement:
    words = text.strip().lower().split()
    match words:
        case ["in-line", count, *rest]:
            order = _taken_order(rest)
            _no_more(rest, ("an order such as 1-3-4-2",))
            return in_line(_count(count), order, period)
        case ["parallel", "twin", angle]:
            if period != FOUR_STROKE:
                raise ValueError("a two-stroke twin is 'in-line 2'")
            return parallel_twin(_angle(angle))
        case ["boxer", count, *rest]:
            order, numbering = _taken_order(rest), _taken_word(rest, ("alternate",))
            _no_more(rest, ("an order such as 1-4-3-2", "alternate"))
            return boxer(_count(count), order, numbering, period)
        case ["radial", count, *rest]:
            rows = 2 if _taken_word(rest, ("two-row",)) else 1
            _no_more(rest, ("two-row",))
            return radial(_count(count), rows, period)
        case [first, *rest] if re.fullmatch(r"[vw]\d+", first):
            order, numbering = _taken_order(rest), _taken_word(rest, ("alternate",))
            pins = (_taken_word(rest, PIN_WORDS) or "shared-pin").removesuffix("-pin")
            crank = _taken_word(rest, CRANKS)
            angles = rest.pop(0) if rest else None
            allowed = ("one angle", *PIN_WORDS, *CRANKS, "alternate", "an order such as 1-3-4-2")
            _no_more(rest, allowed)
            cylinders = _count(first[1:])
            if first[0] == "w":
                banks = [_angle(word) for word in (angles or "").split(",") if word]
                return w_engine(cylinders, banks, pins, order, numbering or "banks", period)
            if angles is None and crank is None and not cylinders % 2:
                raise ValueError(f"the bank angle is missing, such as 'V{cylinders} 90'")
            bank_angle = 0.5 * math.pi if angles is None else _angle(angles)
            return vee(cylinders, bank_angle, pins, order, numbering, crank, period)
        case [first, *rest] if re.fullmatch(r"vr\d+", first):
            order = _taken_order(rest)
            if not rest:
                raise ValueError(f"the bank angle is missing, such as '{first.upper()} 15'")
            bank_angle = _angle(rest.pop(0))
            _no_more(rest, ("one angle", "an order such as 1-5-3-6-2-4"))
            return vr_engine(_count(first[2:]), bank_angle, order, period)
    raise ValueError(
        not_covered(text)
        or "must be one of 'in-line N', 'V<N> ANGLE', 'VR<N> ANGLE', "
        "'boxer N', 'W<N> ANGLE,ANGLE,...', 'radial N', 'parallel twin ANGLE'"
    )


def _taken_order(words: list[str]) -> tuple[int, ...] | None:
    """Remove a firing order such as 1-3-4-2 from the words and return it."""
    for word in words:
        if re.fullmatch(r"\d+(-\d+)+", word):
            words.remove(word)
            return tuple(int(number) for number in word.split("-"))
    return None


def _taken_word(words: list[str], known: tuple[str, ...]) -> str | None:
    taken = next((word for word in words if word in known), None)
    if taken is not None:
        words.remove(taken)
    return taken


def _no_more(words: list[str], allowed: tuple[str, ...]) -> None:
    if words:
        raise ValueError(f"'{words[0]}' is not understood; allowed here: {', '.join(allowed)}")


def _count(word: str) -> int:
    if not re.fullmatch(r"\d{1,3}", word):
        raise ValueError(f"'{word}' must be a number of cylinders")
    return int(word)


def _angle(word: str) -> float:
    try:
        degrees = float(word)
    except ValueError:
        degrees = math.nan
    if not math.isfinite(degrees):
        raise ValueError(f"'{word}' must be an angle in degrees")
    return degrees * DEGREE


def _check_count(what: str, cylinders: int, least: int, most: int) -> None:
    if not least <= cylinders <= most:
        raise ValueError(
            f"{what}: cylinders = {cylinders}: must be a whole number from {least} to {most}"
        )


def _check_word(name: str, what: str, word: str, known: tuple[str, ...]) -> None:
    if word not in known:
        raise ValueError(f"{name}: {what} = '{word}': must be {' or '.join(map(repr, known))}")


def _shown(order: Sequence[int]) -> str:
    return "-".join(map(str, order))


def _even(order: Sequence[int], cylinders: int, period: float) -> list[float]:
    """Firing angles of cylinders 1, 2, ... that fire evenly in an order."""
    if sorted(order) != list(range(1, cylinders + 1)) or order[0] != 1:
        raise ValueError(
            f"order {_shown(order)}: must name each of the cylinders 1 to {cylinders} once, "
            "beginning with 1"
        )
    firing = [0.0] * cylinders
    for step, cylinder in enumerate(order):
        firing[cylinder - 1] = step * (period / cylinders)
    return firing


def _no_order(name: str, cylinders: int, hint: str) -> ValueError:
    """Refusal of a layout without firing order, of which no built engine is known."""
    return ValueError(
        f"{name}: no firing order is known for this layout, so it must be given: cylinders 1 to "
        f"{cylinders}, {hint}"
    )


_BY_BANKS = "numbered bank by bank, or across the banks with the word 'alternate'"


def _vee_hint(cylinders: int, known: Sequence[KnownOrder]) -> str:
    """Hint on how a V engine's firing order is given, and which V engines need none."""
    built = sorted(
        (angle, f"{pins}-pin", entry.crank)
        for entry in known
        for angle, pins in entry.built
        if angle is not None
    )
    layouts = [" ".join((f"V{cylinders} {angle:g}", *words)) for angle, *words in built]
    listed = ", ".join(f"'{layout.strip()}'" for layout in layouts)
    return f"{_BY_BANKS}; without an order: {listed}" if layouts else _BY_BANKS


def _numbered_so(known: Sequence[KnownOrder], numbering: str | None) -> list[KnownOrder]:
    """Known orders that number the cylinders in the given way; all of them if no way is given."""
    return [entry for entry in known if numbering in (None, entry.numbering)]


def _known_numbering(order: Sequence[int], known: Sequence[KnownOrder]) -> str:
    return next((entry.numbering for entry in known if entry.order == tuple(order)), "banks")


def _numbered(cylinders: int, banks: int, numbering: str) -> tuple[list[int], list[int]]:
    """Bank and place along the shaft of cylinders 1, 2, ..."""
    in_bank = cylinders // banks
    if numbering == "alternate":
        return [k % banks for k in range(cylinders)], [k // banks for k in range(cylinders)]
    return [k // in_bank for k in range(cylinders)], [k % in_bank for k in range(cylinders)]


def _of_order(
    name: str,
    order: Sequence[int],
    banks: Sequence[int],
    places: Sequence[int],
    bank_angles: tuple[float, ...],
    pins: str,
    period: float,
) -> Arrangement:
    """Banks on one shaft that fire in a given order, as evenly as the pins let them.

    Even firing fixes the pins, by the cylinder of the lowest bank where they are shared; the other
    cylinders of a shared pin fire at their dead centre nearest to even firing.
    """
    firing = _even(order, len(banks), period)
    if pins == "shared":
        lowest: dict[int, int] = {}
        for k in sorted(range(len(banks)), key=lambda k: banks[k]):
            leader = lowest.setdefault(places[k], k)
            top = firing[leader] + bank_angles[banks[k]] - bank_angles[banks[leader]]
            firing[k] = (firing[k] - math.remainder(firing[k] - top, TURN)) % period
    return _built(name, period, firing, banks, places, bank_angles)


def _fires(made: Arrangement, order: Sequence[int]) -> bool:
    """Whether the cylinders fire one after the other in a given order."""
    return bool((made.firing_intervals > SAME_ANGLE).all()) and made.firing_order == tuple(order)


def _oddness(made: Arrangement, pins: str) -> float:
    """Angle by which pins are split, or firings uneven; it decides the side of a bank."""
    if pins == "shared":
        return round(float(np.ptp(made.firing_intervals)), 9)
    pairs = itertools.groupby(
        sorted(made.throws, key=lambda throw: throw.position), key=lambda throw: throw.position
    )
    splits = [0.0]
    for _, group in pairs:
        angles = [throw.angle for throw in group]
        splits.append(abs(math.remainder(angles[-1] - angles[0], TURN)))
    return round(max(splits), 9)


def _crank_of(made: Arrangement) -> str:
    """Kind of crankshaft: flat-plane if all throws lie in one plane, else cross-plane."""
    first = made.throws[0].angle
    flat = all(
        abs(math.remainder(throw.angle - first, 0.5 * TURN)) < SAME_ANGLE for throw in made.throws
    )
    return "flat-plane" if flat else "cross-plane"


def _built(
    name: str,
    period: float,
    firing: Sequence[float],
    banks: Sequence[int],
    places: Sequence[int],
    bank_angles: tuple[float, ...],
) -> Arrangement:
    """Arrangement whose pins follow from the firing angles; equal pins of a place are merged."""
    throws: list[Throw] = []
    cylinders = []
    reference = bank_angles[banks[0]]
    for fires, bank, place in zip(firing, banks, places, strict=True):
        angle = float(bank_angles[bank] - reference - fires) % TURN
        shared = [
            number
            for number, throw in enumerate(throws)
            if throw.position == place
            and abs(math.remainder(throw.angle - angle, TURN)) < SAME_ANGLE
        ]
        if not shared:
            throws.append(Throw(angle, float(place)))
        cylinders.append(Cylinder((shared or [len(throws) - 1])[0], bank, float(fires)))
    # True allows uneven firing, which `Arrangement` refuses where nobody asks for it.
    return Arrangement(period, tuple(throws), bank_angles, tuple(cylinders), True, name)
