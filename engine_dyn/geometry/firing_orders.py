"""Firing orders of practice, each with its source: nothing else becomes the order of a layout.

Read forwards for an engine that turns clockwise as seen from its free end; the same engine turning
the other way fires in the reverse order. An order alone says nothing of the angles: in-line and
boxer engines fire evenly, the others by their crankshaft (see `layouts`).

Sources that were looked up give the orders of the catalogue's engines, those of Kakaitsas and the
FAA, and those whose entry names a manual or a page. The lists of the Bosch handbook, and makers'
names without a document, are from memory: public service lists agree for in-line 3, 4, 5 and 6,
LS, GT350 and the V10; no page was compared.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

_BOSCH = "Bosch Automotive Handbook, reciprocating-piston engines, firing orders"
_FAA = "FAA-H-8083-32, Aviation Maintenance Technician Handbook: Powerplant, firing order"
_GENERIC = "the only order, apart from the sense of rotation"
_TOGETHER = f"pairs that fire together; {_GENERIC}"
_MAN = "MAN B&W two-stroke engines; not compared with a maker's table"


class KnownOrder(NamedTuple):
    """A firing order and where it comes from."""

    order: tuple[int, ...]  # Numbers of the cylinders, from 1, in the order of firing
    source: str  # Citation of the order, or engines that use it
    # Numbering of cylinders of an engine with two banks: "banks" numbers one bank after the other
    # (DIN 73021), "alternate" from throw to throw, with odd numbers on one bank.
    numbering: str = "banks"
    crank: str = ""  # Kind of crankshaft, "cross-plane" or "flat-plane", where both exist
    # Bank angle [degree] and pins, "shared" or "split", of V engines built with this order. Where
    # an engine gives no order, the first one built as that engine is taken. None stands for any
    # bank angle below 180 degrees. Both kinds of pins are listed where split pins would coincide.
    built: tuple[tuple[float | None, str], ...] = ()


def in_line_order_by_rule(cylinders: int) -> tuple[int, ...]:
    """Four-stroke in-line order: 1, even numbers up, odd numbers down.

    Gives the customary orders of 5 and 7 and one of 6, and an example where none is known. With an
    even number the cranks are mirrored: cylinders at equal distance from the middle move together,
    half a cycle apart.
    """
    even = range(2, cylinders + 1, 2)
    odd = range(cylinders - (cylinders + 1) % 2, 1, -2)
    return (1, *even, *odd)


def two_stroke_in_line_order_by_rule(cylinders: int) -> tuple[int, ...]:
    """Two-stroke in-line order: near one end and near the other in turns.

    One half of the firings walks 1, even numbers up, odd numbers down, the other comes back from
    the far end. Gives the order 1-7-2-5-4-3-6 of large engines, and an example where none is known.
    """
    if cylinders % 2:
        first = (1, *range(2, cylinders, 2))
        second = tuple(range(cylinders, 1, -2))
    else:
        first = in_line_order_by_rule(cylinders // 2)
        second = tuple(cylinders + 1 - c for c in (first[0], *reversed(first[1:])))
    order = [0] * cylinders
    order[0::2], order[1::2] = first, second
    return tuple(order)


IN_LINE_ORDERS: dict[int, tuple[KnownOrder, ...]] = {
    1: (KnownOrder((1,), _GENERIC),),
    2: (KnownOrder((1, 2), "both pistons in step, 360 degree firing interval"),),
    3: (KnownOrder((1, 3, 2), _BOSCH),),
    4: (KnownOrder((1, 3, 4, 2), _BOSCH), KnownOrder((1, 2, 4, 3), _BOSCH)),
    5: (KnownOrder((1, 2, 4, 5, 3), _BOSCH),),
    6: (
        KnownOrder((1, 5, 3, 6, 2, 4), f"Kakaitsas (2015), section 5.4; {_BOSCH}; {_FAA}"),
        KnownOrder((1, 2, 4, 6, 5, 3), _BOSCH),
        KnownOrder((1, 4, 2, 6, 3, 5), _BOSCH),
        KnownOrder((1, 4, 5, 6, 3, 2), _BOSCH),
    ),
    7: (KnownOrder((1, 2, 4, 6, 7, 5, 3), "medium-speed marine engines"),),
    8: (
        KnownOrder((1, 5, 2, 6, 8, 4, 7, 3), "Kakaitsas (2015), section 5.4"),
        KnownOrder((1, 6, 2, 5, 8, 3, 7, 4), _BOSCH),
        KnownOrder((1, 3, 6, 8, 4, 2, 7, 5), _BOSCH),
        KnownOrder((1, 4, 7, 3, 8, 5, 2, 6), _BOSCH),
        KnownOrder((1, 3, 2, 5, 8, 6, 7, 4), _BOSCH),
    ),
}
"""Firing orders of four-stroke in-line engines; the first of each count is the customary one."""

CUSTOMARY_ORDERS: dict[int, tuple[int, ...]] = {
    count: known[0].order for count, known in IN_LINE_ORDERS.items()
}
"""The customary firing order of in-line four-stroke engines, by number of cylinders."""

TWO_STROKE_IN_LINE_ORDERS: dict[int, tuple[KnownOrder, ...]] = {
    1: (KnownOrder((1,), _GENERIC),),
    2: (KnownOrder((1, 2), _GENERIC),),
    3: (KnownOrder((1, 3, 2), _GENERIC),),
    4: (KnownOrder((1, 3, 2, 4), _MAN),),
    5: (KnownOrder((1, 4, 3, 2, 5), _MAN),),
    6: (KnownOrder((1, 5, 3, 4, 2, 6), _MAN),),
    7: (
        KnownOrder(
            (1, 7, 2, 5, 4, 3, 6), "MAN B&W 7S80ME-C9.2: Shen, Zhang, Yang and Jia (2020), table 1"
        ),
    ),
}
"""Firing orders of two-stroke in-line engines; the first of each count is the customary one."""

_BOTH_90: tuple[tuple[float, str], ...] = ((90.0, "shared"), (90.0, "split"))

VEE_ORDERS: dict[int, tuple[KnownOrder, ...]] = {
    2: (KnownOrder((1, 2), _GENERIC, built=((None, "shared"),)),),
    4: (
        KnownOrder((1, 3, 2, 4), _BOSCH, "alternate"),
        KnownOrder(
            (1, 3, 4, 2),
            "Ford Taunus V4 (60 degrees, four pins, one balance shaft): Wikipedia, Firing order "
            "and Ford Taunus V4 engine",
            built=((60.0, "split"),),
        ),
        KnownOrder(
            (1, 4, 2, 3),
            "Honda VF750 (90 degrees, pistons of a bank in step): Cycle News 57 (2020) no. 29, p. "
            "77; which of two pistons in step fires first is not stated there and changes no "
            "force",
            built=((90.0, "shared"),),
        ),
    ),
    6: (
        KnownOrder(
            (1, 4, 3, 6, 2, 5),
            "Mercedes-Benz M272, Volkswagen 90 degree V6; Ferrari F163 of 120 degrees: ferrari.com "
            "prints 1-6-3-4-2-5, its second bank read as counted from the other end",
            built=((90.0, "split"), (120.0, "shared"), (120.0, "split")),
        ),
        KnownOrder((1, 2, 5, 6, 4, 3), _BOSCH),
        KnownOrder((1, 4, 5, 6, 2, 3), _BOSCH),
        KnownOrder(
            (1, 4, 2, 5, 3, 6),
            "Mercedes-Benz OM642: service manual of the 2007 Sprinter, crankshaft: 72 degrees, "
            "throws 48 degrees apart",
            built=((72.0, "split"),),
        ),
        KnownOrder(
            (1, 2, 3, 4, 5, 6),
            "Chrysler 3.5 l and General Motors 60 degree V6",
            "alternate",
            built=((60.0, "split"),),
        ),
        KnownOrder(
            (1, 6, 5, 4, 3, 2),
            "Buick and General Motors 3800 90 degree V6: uneven with shared pins, even with pins "
            "30 degrees apart (service manual of the 1997 Riviera)",
            "alternate",
            built=_BOTH_90,
        ),
    ),
    8: (
        KnownOrder(
            (1, 8, 4, 3, 6, 5, 7, 2),
            "Chevrolet small block, Chrysler 4.7 l service manual",
            "alternate",
            "cross-plane",
            _BOTH_90,
        ),
        KnownOrder((1, 8, 7, 2, 6, 5, 4, 3), "General Motors LS", "alternate", "cross-plane"),
        KnownOrder((1, 5, 4, 8, 6, 3, 7, 2), f"{_BOSCH}; BMW M60", "banks", "cross-plane"),
        KnownOrder((1, 5, 4, 2, 6, 3, 7, 8), "Ford FE", "banks", "cross-plane"),
        KnownOrder((1, 3, 7, 2, 6, 5, 4, 8), "Ford small block (351)", "banks", "cross-plane"),
        KnownOrder((1, 5, 3, 7, 4, 8, 2, 6), "Ferrari F355", "banks", "flat-plane", _BOTH_90),
        KnownOrder((1, 6, 3, 5, 4, 7, 2, 8), _BOSCH, "banks", "flat-plane"),
        KnownOrder((1, 8, 3, 6, 4, 5, 2, 7), _BOSCH, "banks", "flat-plane"),
        KnownOrder(
            (1, 5, 4, 8, 3, 7, 2, 6),
            "Ford 5.2 l (GT350); rusEFI, list of firing orders",
            "banks",
            "flat-plane",
        ),
    ),
    10: (
        KnownOrder(
            (1, 10, 9, 4, 3, 6, 5, 8, 7, 2),
            "Dodge Viper; rusEFI, list of firing orders",
            "alternate",
            built=((90.0, "shared"),),
        ),
        KnownOrder(
            (1, 6, 5, 10, 2, 7, 3, 8, 4, 9),
            "Audi and Lamborghini V10; rusEFI, list of firing orders; pins of the Lamborghini of "
            "5 l 18 degrees apart: Wikipedia, V10 engine",
            built=((90.0, "split"),),
        ),
    ),
    12: (
        KnownOrder(
            (1, 7, 5, 11, 3, 9, 6, 12, 2, 8, 4, 10),
            "BMW M70, Ferrari 456 M; rusEFI, list of firing orders",
            built=((60.0, "shared"), (60.0, "split")),
        ),
    ),
    16: (
        KnownOrder(
            (1, 2, 5, 6, 3, 4, 9, 10, 15, 16, 11, 12, 13, 14, 7, 8),
            "Caterpillar 3516 of 60 degrees, uneven: wall chart RENR1935-02",
            "alternate",
            built=((60.0, "shared"),),
        ),
    ),
}
"""Firing orders of four-stroke V engines, with the numbering that they refer to."""

TWO_STROKE_VEE_ORDERS: dict[int, tuple[KnownOrder, ...]] = {2: VEE_ORDERS[2]}
"""Firing orders of two-stroke V engines."""

VR_ORDERS: dict[int, KnownOrder] = {
    5: KnownOrder((1, 2, 4, 5, 3), "Volkswagen VR5 of 15 degrees: Wikipedia, VR5 engine"),
    6: KnownOrder(
        (1, 5, 3, 6, 2, 4),
        "Volkswagen VR6 of 15 and 10.6 degrees: from memory; as six in line fire, as Wikipedia, "
        "VR6 engine, says of it",
    ),
}
"""Firing orders of four-stroke VR engines, odd numbers in one bank, even ones in the other."""

BOXER_ORDERS: dict[int, tuple[KnownOrder, ...]] = {
    2: (KnownOrder((1, 2), "BMW boxer; " + _GENERIC),),
    4: (
        KnownOrder((1, 4, 3, 2), f"{_BOSCH}; Volkswagen"),
        KnownOrder((1, 3, 2, 4), f"Subaru; {_FAA}", "alternate"),
        KnownOrder((1, 4, 2, 3), _FAA, "alternate"),
    ),
    6: (
        KnownOrder((1, 6, 2, 4, 3, 5), "Porsche 911"),
        KnownOrder((1, 6, 3, 2, 5, 4), "Subaru EZ30", "alternate"),
        KnownOrder((1, 4, 5, 2, 3, 6), _FAA, "alternate"),
    ),
    8: (
        KnownOrder(
            (1, 5, 8, 3, 2, 6, 7, 4),
            "Lycoming IO-720; not compared with a maker's manual",
            "alternate",
        ),
    ),
}
"""Firing orders of four-stroke boxer engines; the first of each count is the customary one."""

TWO_STROKE_BOXER_ORDERS: dict[int, tuple[KnownOrder, ...]] = {
    2: (KnownOrder((1, 2), _TOGETHER),),
    4: (KnownOrder((1, 3, 2, 4), _TOGETHER),),
    6: (KnownOrder((1, 4, 3, 6, 2, 5), _TOGETHER),),
}
"""Firing orders of two-stroke boxer engines, whose cylinders fire in pairs."""


def customary_order(cylinders: int, two_stroke: bool = False) -> tuple[int, ...] | None:
    """Return the customary firing order in line, or None where this project knows none."""
    known = TWO_STROKE_IN_LINE_ORDERS if two_stroke else IN_LINE_ORDERS
    return known[int(cylinders)][0].order if int(cylinders) in known else None


def known_vee_order(
    known: Sequence[KnownOrder], bank_angle: float, pins: str, crank: str = ""
) -> KnownOrder | None:
    """Return the order of a V engine that has been built so, or None where none is known.

    Parameters
    ----------
    known : sequence of KnownOrder
        Those of V engines with so many cylinders.
    bank_angle : float
        Angle between the banks [degree].
    pins, crank : str
        As `KnownOrder` has them.
    """
    for entry in known:
        for angle, pins_then in entry.built:
            # Bank angles that differ by less than 0.01 degree are the same.
            near = bank_angle < 180.0 if angle is None else abs(angle - bank_angle) < 0.01
            if near and pins_then == pins and entry.crank == crank:
                return entry
    return None
