r"""Counterweights on the webs of a crankshaft, and the bending of the shaft between its bearings.

Everything here turns with the crank, so its forces are vectors in the crank's plane, complex as in
`engine_dyn.forces.balance`: at phi = 0 the real axis points outwards along cylinder 1. A
counterweight of mass m, radius R and angle alpha (zero and sense as of throws) has the unbalance

    u = f m R e^(i (alpha - alpha_1 + theta_T)),

where alpha_1 is the angle of the throw of cylinder 1, theta_T that of its crank at top dead centre
(0 without offset) and f a factor on all masses. Its force is u omega^2, its moment about the middle
of the crank that times its distance z from there.

Main bearings stand halfway between neighbouring throws, and half a spacing outside the outermost.
Each bay between two of them is a simply supported beam of its own (statically determinate;
continuity of the shaft is left out). It carries the rotating masses of its throw at their places
and the counterweights at theirs; what overhangs an outermost bearing belongs to that bay. With the
loads F_k at z_k and bearings at A and B the bending moment is, along the shaft,

    M(z) = (z - A) sum F_k (B - z_k)/(B - A) - sum_{z_k < z} F_k (z - z_k),

a vector whose size is largest at a load or a bearing, since it is linear in between.

Source: statics, derived here; balance in several planes: Khurmi and Gupta, chapters 21 and 22.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from engine_dyn.forces.balance.lines import lines_of
from engine_dyn.forces.mechanism import banks_of
from engine_dyn.geometry import slider_crank
from engine_dyn.geometry.arrangement import MOST_CYLINDERS
from engine_dyn.geometry.cylinder_means import value_of_sets
from engine_dyn.geometry.cylinders import Cylinders, CylindersByCount
from engine_dyn.quantities.features.feature import Feature
from engine_dyn.quantities.node import Node, hidden, parameter
from engine_dyn.types import Floats


@dataclass(frozen=True, eq=False)
class WebWeights:
    """Counterweights, one a place of each array, shape (N,)."""

    mass: Floats  # Mass of each counterweight [kg]
    radius: Floats  # Distance of each centre of gravity from the shaft's axis [m]
    angle: Floats  # Direction of each counterweight [rad], counted as the angles of throws are
    # Position along the shaft [m], from position 0 of the throws, away from the free end.
    position: Floats


class Crankshaft(NamedTuple):
    """Masses that turn with the crank; arrays broadcast."""

    webs: WebWeights | None  # Counterweights of the webs
    factor: Any  # Factor on the counterweights' masses [1]
    # Crank ratio lambda [1]; offset of the piston-pin line over the crank radius [1].
    crank_ratio: Any
    offset: Any
    # Cylinder set of each design, and the cylinders of each set.
    cylinders: Any
    by_count: CylindersByCount
    # Distance of neighbouring throws, and offset of each bank along the shaft [m].
    spacing: Any = np.nan
    bank_offset: Any = 0.0
    crank_radius: Any = 1.0  # Crank radius [m]
    # Rotating mass of each cylinder's rod and of each throw, at the crank radius [kg].
    rod_mass: Any = 0.0
    throw_mass: Any = 0.0


def unbalance(shaft: Crankshaft) -> Any:
    """Unbalance of all counterweights [kg m], complex."""
    ones = [np.ones(())] * len(_places(shaft))
    return value_of_sets(
        shaft.cylinders, shaft.by_count, lambda engine: _summed(shaft, engine, ones)
    )


def couple(shaft: Crankshaft) -> Any:
    """Unbalance times distance from the middle of the crank, of all counterweights [kg m2]."""

    def of_engine(engine: Cylinders) -> Any:
        middle = np.asarray(shaft.spacing) * middle_of(engine)
        return _summed(shaft, engine, [place - middle for place in _places(shaft)])

    return value_of_sets(shaft.cylinders, shaft.by_count, of_engine)


def on_journals(shaft: Crankshaft, journals: Any) -> Any:
    """Unbalance of the counterweights that each main journal bears [kg m], complex.

    The real axis points upright (`mechanism.banks_of`) at phi = 0. `journals` are numbers from 1
    and broadcast; nothing is past an engine's last one.
    """

    def of_engine(engine: Cylinders) -> Any:
        bearings = _bearings(engine)
        shares = []
        for place in _places(shaft):
            z = place / np.asarray(shaft.spacing)
            before = np.clip(np.searchsorted(bearings, z, side="right") - 1, 0, len(bearings) - 2)
            share = (z - bearings[before]) / (bearings[before + 1] - bearings[before])
            number = np.asarray(journals) - 1
            shares.append(
                np.where(number == before, 1.0 - share, 0.0)
                + np.where(number == before + 1, share, 0.0)
            )
        return _summed(shaft, engine, shares) * np.exp(1j * banks_of(engine)[0])

    return value_of_sets(shaft.cylinders, shaft.by_count, of_engine)


def largest_bending(shaft: Crankshaft, bays: Any) -> Any:
    """Largest bending moment of bays over omega^2 [kg m2]; NaN past an engine's last bay.

    `bays` are their numbers, from 1, as of the throws along the shaft, and broadcast.

    Examples
    --------
    One throw of 2 kg at 0.05 m between bearings 0.1 m apart: 2 x 0.05 x 0.1/4.

    >>> from engine_dyn.geometry.cylinders import even_cylinders
    >>> single = Crankshaft(None, 1.0, 0.25, 0.0, 1, {1: even_cylinders(1, 4.0 * np.pi)},
    ...                     spacing=0.1, crank_radius=0.05, throw_mass=2.0)
    >>> round(float(largest_bending(single, 1)), 6)
    0.0025
    """
    return _of_bays(shaft, bays, lambda engine: _loads(engine, shaft))


def bending_over_angle(
    shaft: Crankshaft, bays: Any, speed: Any, phi: Any, pins: Callable[[Cylinders], list[Any]]
) -> Any:
    """Largest bending moment within bays at crank angles [N m], with the forces on crank pins.

    All arrays have a last axis for the angles `phi` [rad]. `pins` gives the force on the throw of
    each cylinder of an engine, `bearings.pin_forces`, with all that rotates but the counterweights
    of webs.
    """

    def loads(engine: Cylinders) -> list[tuple[Any, Any]]:
        rotating = _loads(engine, shaft)
        turning = speed**2 * np.exp(1j * (phi + banks_of(engine)[0]))
        on_pins = zip(pins(engine), (place for _, place in rotating), strict=False)
        of_webs = rotating[engine.count :]
        return [*on_pins, *((vector * turning, place) for vector, place in of_webs)]

    return _of_bays(shaft, bays, loads)


def _of_bays(
    shaft: Crankshaft, bays: Any, loads: Callable[[Cylinders], list[tuple[Any, Any]]]
) -> Any:
    numbers = np.asarray(bays)

    def of_engine(engine: Cylinders) -> Any:
        moment: Any = np.nan
        here = loads(engine)
        for number in range(1, len(_bearings(engine))):
            if (numbers == number).any():
                moment = np.where(numbers == number, _of_bay(number, engine, shaft, here), moment)
        return moment

    return value_of_sets(shaft.cylinders, shaft.by_count, of_engine)


def _of_bay(number: int, engine: Cylinders, shaft: Crankshaft, every: list[tuple[Any, Any]]) -> Any:
    bearings = _bearings(engine)
    spacing = np.asarray(shaft.spacing)
    start, end = spacing * bearings[number - 1], spacing * bearings[number]
    first, last = number == 1, number == len(bearings) - 1
    loads = []
    for force, place in every:
        inside = (first | (place > start)) & (last | (place <= end))
        if inside.any():
            loads.append((np.where(inside, force, 0.0), place))
    reaction = sum(force * (end - place) for force, place in loads) / (end - start)
    largest: Any = 0.0
    for point in (start, end, *(place for _, place in loads)):
        z = np.clip(point, start, end)
        moment = reaction * (z - start)
        moment = moment - sum(force * np.maximum(z - place, 0.0) for force, place in loads)
        largest = np.maximum(largest, np.abs(moment))
    return largest


def _loads(engine: Cylinders, shaft: Crankshaft) -> list[tuple[Any, Any]]:
    """Unbalance [kg m] and position [m] of everything that turns."""
    lines, spacing = lines_of(engine), np.asarray(shaft.spacing)
    loads = []
    for k, radius in enumerate(lines.radius):
        top = slider_crank.dead_centres(
            radius * np.asarray(shaft.crank_ratio),
            lines.side[k] * np.asarray(shaft.offset) / radius,
        ).top
        mass = np.asarray(shaft.rod_mass) + lines.throw_share[k] * np.asarray(shaft.throw_mass)
        direction = np.exp(1j * (lines.direction[k] + lines.phase[k] + np.asarray(top)))
        place = spacing * (lines.place[k] + middle_of(engine)) + lines.bank[k] * shaft.bank_offset
        loads.append((mass * radius * shaft.crank_radius * direction, place))
    each = zip(_vectors(shaft, engine), _places(shaft), strict=True)
    return [*loads, *((vector, np.asarray(place)) for vector, place in each)]


def _summed(shaft: Crankshaft, engine: Cylinders, weights: list[Any]) -> Any:
    total: Any = 0.0
    most: Any = 0.0
    for vector, weight in zip(_vectors(shaft, engine), weights, strict=True):
        total, most = total + vector * weight, most + np.abs(vector * weight)
    # A sum of vectors below this fraction of the sum of their sizes is rounding.
    return np.where(np.abs(total) < 1e-13 * most, 0.0, total)


def _vectors(shaft: Crankshaft, engine: Cylinders) -> list[Any]:
    """Unbalance vector of each counterweight [kg m]."""
    made, webs = engine.arrangement, shaft.webs
    if webs is None or made is None:
        return []
    first = made.throws[made.cylinders[0].throw].angle
    top = np.asarray(slider_crank.dead_centres(shaft.crank_ratio, shaft.offset).top)
    return [
        np.asarray(shaft.factor) * mass * radius * np.exp(1j * (angle - first + top))
        for mass, radius, angle in zip(webs.mass, webs.radius, webs.angle, strict=True)
    ]


def _places(shaft: Crankshaft) -> list[float]:
    return [] if shaft.webs is None else shaft.webs.position.tolist()


def middle_of(engine: Cylinders) -> float:
    """Middle of the crank, in distances of neighbouring throws."""
    return 0.5 * float(min(_throws(engine)) + max(_throws(engine)))


def _throws(engine: Cylinders) -> list[float]:
    """Positions of the throws along the shaft, each once."""
    made = engine.arrangement
    assert made is not None  # scenes without throws are refused these nodes
    return sorted({throw.position for throw in made.throws})


def _bearings(engine: Cylinders) -> Floats:
    """Positions of the main bearings, in distances of neighbouring throws."""
    throws = np.array(_throws(engine))
    between = 0.5 * (throws[1:] + throws[:-1])
    return np.array([throws[0] - 0.5, *between, throws[-1] + 0.5])


# --- nodes ----------------------------------------------------------------------------------------

OF_WEBS = (
    "counterweights", "counterweights_factor", "crank_ratio", "offset_ratio", "cylinder_set",
    "cylinders_by_count",
)  # fmt: skip


def crankshaft(needs: dict[str, Any]) -> Crankshaft:
    """Return what turns with the crank, from the needs of a node."""
    more = {
        field: needs[name]
        for field, name in (
            ("spacing", "cylinder_spacing"), ("bank_offset", "bank_offset"),
            ("rod_mass", "journal_rod_mass"), ("throw_mass", "journal_throw_mass"),
        )
        if name in needs
    }  # fmt: skip
    if "double_radius" in needs:
        more["crank_radius"] = 0.5 * needs["double_radius"]
    return Crankshaft(*(needs[name] for name in OF_WEBS), **more)


def _of_webs(
    name: str, unit: str, long_name: str, more: tuple[str, ...], make: Callable[..., Any]
) -> list[Node]:  # fmt: skip
    """A vector of the counterweights of webs; nothing without them."""
    needs = (*OF_WEBS, *more)
    return [
        hidden(name, unit, long_name, make, needs, when="weights_of_webs", width=16, throws=True),
        *(
            hidden(name, unit, long_name, lambda: 0.0, when=word)
            for word in ("weights_by_fraction", "weights_given")
        ),
    ]  # fmt: skip


BENDING = (
    *OF_WEBS, "cylinder_spacing", "bank_offset", "double_radius", "journal_rod_mass",
    "journal_throw_mass",
)  # fmt: skip


def _largest_bending(*, speed: Any, **needs: Any) -> Any:
    shaft = crankshaft(needs)
    largest: Any = 0.0
    for bay in range(1, MOST_CYLINDERS + 1):
        largest = np.fmax(largest, largest_bending(shaft, bay))
    return largest * speed**2


NODES: tuple[Node, ...] = (
    *_of_webs("web_unbalance", "kg m", "unbalance of the counterweights of webs", (),
              lambda **needs: unbalance(crankshaft(needs))),
    *_of_webs(
        "web_unbalance_couple", "kg m2",
        "unbalance of the counterweights of webs times distance from the middle of the crank",
        ("cylinder_spacing",), lambda **needs: couple(crankshaft(needs)),
    ),
    *_of_webs(
        "journal_web_unbalance", "kg m",
        "unbalance of the counterweights of webs that a main journal bears",
        ("cylinder_spacing", "main_bearing"),
        lambda main_bearing, **needs: on_journals(crankshaft(needs), main_bearing),
    ),
    Node(
        "bay_bending_moment", "M_b", "N m",
        "largest bending moment of the shaft between the main bearings beside each throw, due to "
        "centrifugal forces, each bay a simply supported beam",
        "this project", needs=(*BENDING, "speed", "bay"), throws=True,
        make=lambda speed, bay, **needs: largest_bending(crankshaft(needs), bay) * speed**2,
    ),
    Node(
        "bay_bending_moment_max", "M_{b,max}", "N m",
        "largest bending moment of the shaft in any bay, due to centrifugal forces",
        "this project", needs=(*BENDING, "speed"), make=_largest_bending, throws=True,
    ),
)  # fmt: skip

FEATURE: Feature[WebWeights] = Feature(
    "counterweights", "counterweights on the webs", "balance", NODES, constant="counterweights",
    parameters=(
        parameter(
            "counterweights_factor", "f_B", "1",
            "factor on the masses of the table [[counterweights]]", "this project", low=0.0,
            low_included=True, unless_given=1.0,
        ),
    ),
    words=(
        {
            "weights_by_fraction": "counterweights balance a fraction of the reciprocating mass",
            "weights_given": "the mass of the counterweights is given",
            "weights_of_webs": "mass, place and direction of each counterweight are given",
        },
        {
            "no_counterweights": "nothing says what the counterweights are",
            "counterweights": "scene or engine says what the counterweights are",
        },
    ),
    called={
        "bay_bending_moment": "internal bending moment, internal moment, crankshaft bending",
    },
)  # fmt: skip
of = FEATURE.of
