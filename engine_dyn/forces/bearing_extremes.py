"""Bearing loads of many designs, sampled by a kernel: means, and crests (see `superposition`).

Each design is sampled by itself: its loads are those of `bearings`, formula by formula, of
pressures that are tabulated at the samples for each row of the diagrams. The loads of a throw serve
the main journals on both sides of it where these follow each other.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from engine_dyn.compilation import inlined, kernel
from engine_dyn.forces import mechanism
from engine_dyn.forces.superposition import along_shaft
from engine_dyn.geometry.cylinders import Cylinders, Member
from engine_dyn.geometry.firing_sequence import PressureFactor
from engine_dyn.geometry.slider_crank import sine_of_top, sum_of_angles
from engine_dyn.pressure.family import Family, own_diagrams
from engine_dyn.pressure.motored import pressures_of_rows
from engine_dyn.types import Floats, Integers

CRANK_PIN, PISTON_PIN, MAIN_JOURNAL = 0, 1, 2  # Codes of the bearing loads in kernels

INPUTS = 10
"""Rows of a design's numbers: crank ratio, offset over the crank radius, weight of the second row
of the diagrams, and the `bearings.Factors`; the last two are those of the webs beside a journal."""

CRESTS = 8  # Largest number of crests (samples near a maximum) kept for a design, the highest ones

MEAN, RMS, COUNT, FIRST = range(4)
"""Columns of a design's result: mean and root mean square of the load, number of crests; then,
for each crest, its place in samples and the squared load before, at and after that place."""


class Sampled(NamedTuple):
    """The cylinders of an engine at equally spaced crank angles."""

    # Seven numbers of each cylinder, shape (7, Z): mass times crank radius, and crank radius, both
    # over the engine's; sine and cosine of the cylinder's direction from upright; the cylinder's
    # share in the mass of its throw; its factor on the offset; its piston area over the engine's.
    cylinders: Floats
    # Index of each cylinder's curve in `turn` and `pressure`, shape (Z,): cylinders of the same
    # phase, pressure and piston area share a curve.
    curve: Integers
    # Index in `on_throws` at which the cylinders of each throw begin; shape (T + 1,)
    throws: Integers
    on_throws: Integers  # Indices of the cylinders, those of the first throw first
    turn: Floats  # Sine and cosine of the crank angle of each curve, at A samples; shape (C, 2, A)
    # Pressure [Pa] of each curve in each row of the diagrams, times the factor on the piston area;
    # shape (C, R, A)
    pressure: Floats

    @classmethod
    def of(
        cls, engine: Cylinders, family: Family, rows: Integers, phi: Floats, along: bool
    ) -> Sampled:
        """Sample an engine, or cylinder 1 alone, at the angles `phi` for some rows of a family."""
        members = engine.members if along else engine.members[:1]
        banks = mechanism.banks_of(engine) if along else (0.0,)
        places = along_shaft(engine) if along else ((0,),)
        kinds = list(dict.fromkeys(map(curve_of, members)))
        turn = np.empty((len(kinds), 2, phi.size))
        pressure = np.empty((len(kinds), rows.size, phi.size))
        for number, (phase, factor, diagram, area) in enumerate(kinds):
            angle = phi + phase
            turn[number] = np.sin(angle), np.cos(angle)
            own = own_diagrams(family, diagram)
            pressure[number] = area * pressures_of_rows(own, rows, angle, factor)
        cylinders = np.array([
            [member.mass_factor * member.radius_factor for member in members],
            [member.radius_factor for member in members], np.sin(banks), np.cos(banks),
            engine.throw_shares[: len(members)], [member.side for member in members],
            [member.area_factor for member in members],
        ])  # fmt: skip
        return cls(
            cylinders, np.array([kinds.index(curve_of(member)) for member in members]),
            np.cumsum([0, *(len(place) for place in places)]),
            np.array([cylinder for place in places for cylinder in place]), turn, pressure,
        )  # fmt: skip


def curve_of(member: Member) -> tuple[float, PressureFactor, int, float]:
    """Phase, pressure and area of a cylinder: those that have them in common share a curve."""
    return member.phase, member.pressure_factor, member.diagram, member.area_factor


@kernel
def fill_crests_of_loads(
    begin: int, end: int, load: int, inputs: Floats, rows: Integers, numbers: Integers,
    sampled: Sampled, extremes: Floats,
) -> None:  # fmt: skip
    """Means and crests of a load of some designs.

    Parameters
    ----------
    begin, end : int
        Which designs.
    load : int
        `CRANK_PIN`, `PISTON_PIN` or `MAIN_JOURNAL`.
    inputs : ndarray, shape (INPUTS, D)
        Numbers of each design.
    rows : ndarray of int64, shape (2, D)
        The two rows between which its pressure lies.
    numbers : ndarray of int64, shape (D,)
        Main journals, from 1.
    sampled : Sampled
        The engine of all of them.
    extremes : ndarray, shape (FIRST + 4 * CRESTS, D)
        Gets the results.
    """
    samples = sampled.turn.shape[2]
    throws = sampled.throws.size - 1
    # A main journal bears the loads of two neighbouring throws. The load of the throw with an even
    # index is kept in `x_even` and `y_even`, that of the other throw in `x_odd` and `y_odd`.
    x_even, y_even = np.empty(samples), np.empty(samples)
    x_odd, y_odd = np.empty(samples), np.empty(samples)
    x, y, square = np.empty(samples), np.empty(samples), np.empty(samples)
    even = odd = -1
    for design in range(begin, end):
        if design == begin or not _same_design(inputs, rows, design):
            even = odd = -1
        first, last = 0, 0
        if load == MAIN_JOURNAL:
            first, last = max(numbers[design] - 2, 0), min(numbers[design] - 1, throws - 1)
        for throw in range(first, last + 1):
            if throw % 2 == 0:
                if even != throw:
                    _load_of_throw(load, throw, design, inputs, rows, sampled, x_even, y_even)
                    even = throw
            elif odd != throw:
                _load_of_throw(load, throw, design, inputs, rows, sampled, x_odd, y_odd)
                odd = throw
        if first != last:
            for i in range(samples):
                x[i], y[i] = x_even[i] + x_odd[i], y_even[i] + y_odd[i]
        elif first % 2 == 0:
            x[:], y[:] = x_even, y_even
        else:
            x[:], y[:] = x_odd, y_odd
        up, side = inputs[8, design], inputs[9, design]
        for i in range(samples):
            # Cylinder 1 has the phase 0: its crank angle is the engine's.
            sine, cosine = sampled.turn[0, 0, i], sampled.turn[0, 1, i]
            across, along = x[i] + up * sine + side * cosine, y[i] + up * cosine - side * sine
            square[i] = across * across + along * along
        _crests_of_square(square, extremes[:, design])


@inlined
def _same_design(inputs: Floats, rows: Integers, design: int) -> bool:
    """Whether a design differs from the one before it in nothing but the number of its journal."""
    for i in range(INPUTS - 2):
        if inputs[i, design] != inputs[i, design - 1]:
            return False
    return bool(rows[0, design] == rows[0, design - 1] and rows[1, design] == rows[1, design - 1])


@inlined
def _load_of_throw(
    load: int, throw: int, design: int, inputs: Floats, rows: Integers, sampled: Sampled,
    x: Floats, y: Floats,
) -> None:  # fmt: skip
    """Components of the load that the cylinders of a throw put on a pin, or on an adjacent journal.

    As `bearings` defines them. With W = sqrt(1 - lean^2), tan(beta) = lean/W and, docs/method.md
    (10), b = cos(theta) + lambda cos^2(theta)/W^3 - lean sin(theta)/W.
    """
    samples = x.size
    for i in range(samples):
        x[i] = y[i] = 0.0
    engine_ratio, engine_offset, weight = inputs[0, design], inputs[1, design], inputs[2, design]
    gas, engine_crankcase, reciprocating = inputs[3, design], inputs[4, design], inputs[5, design]
    turning, of_throws = inputs[6, design], inputs[7, design]
    gas_below, gas_above = gas * (1.0 - weight), gas * weight
    for place in range(sampled.throws[throw], sampled.throws[throw + 1]):
        cylinder = sampled.on_throws[place]
        own = sampled.cylinders[:, cylinder]
        share, radius, bank_sine, bank_cosine = own[0], own[1], own[2], own[3]
        throw_share, offset_factor, area = own[4], own[5], own[6]
        # A product would be fused with the sum below, which would change its last bits
        crankcase = engine_crankcase if area == 1.0 else engine_crankcase * area
        ratio = engine_ratio * radius
        offset = offset_factor * engine_offset / radius
        mass = reciprocating * share
        number = sampled.curve[cylinder]
        below = sampled.pressure[number, rows[0, design]]
        above = sampled.pressure[number, rows[1, design]]
        sine, cosine = sampled.turn[number, 0], sampled.turn[number, 1]
        top = sine_of_top(ratio, offset)
        upright = math.sqrt(1.0 - top * top)
        throw_pull = (turning + throw_share * of_throws) * radius
        for i in range(samples):
            s, c = sum_of_angles(sine[i], cosine[i], top, upright)
            lean = ratio * (s - offset)
            root = 1.0 / math.sqrt(1.0 - lean * lean)
            slope = lean * root
            b = c + ratio * c * c * (root * root * root) - slope * s
            force = gas_below * below[i] + gas_above * above[i] - crankcase - mass * b
            if load == CRANK_PIN:  # radial and tangential component
                x[i] += turning - (c - s * slope) * force
                y[i] += (s + c * slope) * force
            elif load == PISTON_PIN:  # component to the side, and downwards
                x[i] += slope * force
                y[i] += force + turning * b
            else:  # component sideways, and upwards
                side = slope * force
                along, across = force - throw_pull * c, side + throw_pull * s
                x[i] += 0.5 * (across * bank_cosine - along * bank_sine)
                y[i] -= 0.5 * (across * bank_sine + along * bank_cosine)


@inlined
def _crests_of_square(square: Floats, extremes: Floats) -> None:
    """Fill in mean, root mean square and crests of a load from its squares over a cycle."""
    samples = square.size
    total = squares = highest = 0.0
    for i in range(samples):
        total += math.sqrt(square[i])
        squares += square[i]
        highest = max(highest, square[i])
    extremes[MEAN], extremes[RMS] = total / samples, math.sqrt(squares / samples)
    count = 0
    for i in range(samples):
        before, here = square[i - 1 if i > 0 else samples - 1], square[i]
        after = square[i + 1 if i < samples - 1 else 0]
        reach = 3.0 * here - before - after
        if here < before or here < after or reach < highest:
            continue
        if count == CRESTS:  # the new crest replaces the lowest one
            lowest, least = -1, reach
            for k in range(CRESTS):
                at = FIRST + 4 * k
                told = 3.0 * extremes[at + 2] - extremes[at + 1] - extremes[at + 3]
                if told < least:
                    lowest, least = k, told
            if lowest < 0:
                continue
            for row in range(FIRST + 4 * lowest, FIRST + 4 * (CRESTS - 1)):
                extremes[row] = extremes[row + 4]
            count -= 1
        at = FIRST + 4 * count
        extremes[at], extremes[at + 1], extremes[at + 2], extremes[at + 3] = i, before, here, after
        count += 1
    extremes[COUNT] = count if total == total else 0.0
