"""Sums of curves over the cylinders of an engine, and the order of cylinders along the shaft.

Kernels sum over cylinders by themselves, in their own loops. Values of each set of cylinders are
taken by `cylinder_means.value_of_sets`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from engine_dyn.geometry.cylinders import EQUAL, Cylinders, CylindersByCount, Member

__all__ = ["along_shaft", "superpose"]


def superpose(
    curve: Callable[[Any, Member], Any],
    phi: Any,
    cylinders: Any,
    period: float,
    by_count: CylindersByCount | None = None,
) -> Any:
    """Sum of a cylinder's curve over all cylinders. Kakaitsas (2015), eqs. 5.1-5.3.

    The curve is evaluated at the shifted angles themselves, for a cylinder whose factors it may
    use; `cylinders` broadcasts with `phi`. They are keys of `by_count`, or numbers of evenly firing
    equal cylinders.
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
        whole = sum(curve(phi + member.phase, member) for member in engine.members)
        total = np.where(counts == count, whole, total)
    return total


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
