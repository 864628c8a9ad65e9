"""Parts of the loads of main journals for designs that have diagrams of their own, by a kernel.

What they are stands in `bearings`, whose formulas they follow point by point.
"""

from __future__ import annotations

import math

import numpy as np

from engine_dyn.compilation import kernel
from engine_dyn.forces import mechanism
from engine_dyn.forces.superposition import along_shaft
from engine_dyn.geometry.cylinders import Cylinders
from engine_dyn.geometry.slider_crank import offset_acceleration_at, sine_of_top, turned
from engine_dyn.pressure.curves import on_threads
from engine_dyn.pressure.cycle_table import CycleTable
from engine_dyn.types import Floats

__all__ = ["journal_parts"]


def journal_parts(
    phi: Floats, engine: Cylinders, crank_ratio: Floats, offset: Floats, row: Floats,
    family: CycleTable, number: int,
) -> Floats:  # fmt: skip
    """Parts of the load of main journal `number` (from 1), shape (designs, 4, 2, angles), x and y.

    Parameters
    ----------
    phi : ndarray, shape (A,)
        Crank angles [rad].
    engine : Cylinders
        Its cylinders.
    crank_ratio, offset, row : ndarray, shape (D,)
        Of each design: lambda, offset of the pin's line over the crank radius, and the place of its
        diagram in the table.
    family : CycleTable
        Diagrams.
    number : int
        Of the journal.
    """
    places, banks = along_shaft(engine), mechanism.banks_of(engine)
    parts = np.zeros((row.size, 4, 2, phi.size))
    beside = [places[i] for i in (number - 2, number - 1) if 0 <= i < len(places)]
    for cylinder in (c for place in beside for c in place):
        member, bank = engine.members[cylinder], float(banks[cylinder])
        angle = phi + member.phase
        own = member.own(crank_ratio, offset)
        pressure = family.pressures(angle, row[:, None], member.pressure_factor)
        sine, cosine = np.sin(angle), np.cos(angle)
        ratios, offsets = np.asarray(own.crank_ratio), np.asarray(own.offset)

        def work(
            begin: int, end: int, pressure: Floats = pressure, ratios: Floats = ratios,
            offsets: Floats = offsets, sine: Floats = sine, cosine: Floats = cosine,
            share: float = float(member.mass_factor * member.radius_factor),
            radius: float = float(member.radius_factor), bank: float = bank,
        ) -> None:  # fmt: skip
            here = slice(begin, end)
            _add(
                pressure[here], sine, cosine, ratios[here], offsets[here], share, radius,
                math.sin(bank), math.cos(bank), parts[here],
            )  # fmt: skip

        on_threads(row.size, work, family.threads)
    return parts


@kernel
def _add(
    pressure: Floats, sine: Floats, cosine: Floats, ratio: Floats, offset: Floats, share: float,
    radius: float, bank_sine: float, bank_cosine: float, parts: Floats,
) -> None:  # fmt: skip
    """Add the half of a cylinder's load to the four parts."""
    for design in range(ratio.size):
        lamda, e = ratio[design], offset[design]
        top = sine_of_top(lamda, e)
        upright = math.sqrt(1.0 - top * top)
        for i in range(sine.size):
            s, c = turned(sine[i], cosine[i], top, upright)
            lean = lamda * (s - e)
            thrust = lean / math.sqrt(1.0 - lean * lean)
            along_x = 0.5 * (thrust * bank_cosine - bank_sine)
            along_y = -0.5 * (thrust * bank_sine + bank_cosine)
            inertia = -share * offset_acceleration_at(s, c, lamda, e)
            gas = pressure[design, i]
            parts[design, 0, 0, i] += along_x * gas
            parts[design, 0, 1, i] += along_y * gas
            parts[design, 1, 0, i] -= along_x
            parts[design, 1, 1, i] -= along_y
            parts[design, 2, 0, i] += along_x * inertia
            parts[design, 2, 1, i] += along_y * inertia
            parts[design, 3, 0, i] += 0.5 * radius * (s * bank_cosine + c * bank_sine)
            parts[design, 3, 1, i] += 0.5 * radius * (c * bank_cosine - s * bank_sine)
