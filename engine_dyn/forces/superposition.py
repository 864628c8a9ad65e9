"""Sums of curves over the cylinders of an engine, and the order of cylinders along the shaft.

Kernels sum over cylinders by themselves, in their own loops. Values of each set of cylinders are
taken by `cylinder_means.value_of_sets`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from engine_dyn.geometry.cylinders import EQUAL, Cylinders, CylindersByCount, Member


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

    crank_ratio: Any  # lambda = r/l of the engine [1]
    double_radius: Any  # 2 r [m], the stroke of an engine without offset
    cylinders: Any  # Set of each design, or its number of evenly firing equal cylinders
    period: float  # Angle of the cycle [rad]
    # Distance of the piston pin's line from the crank's axis over the crank radius [1].
    offset: Any = 0.0
    by_count: CylindersByCount | None = None  # Cylinders of each set

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
