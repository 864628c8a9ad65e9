"""Ends beyond which no machine can be: the one table of sizes that are refused, not questioned.

A length of 105 m in place of 105 mm makes all results wrong. These ends leave a factor of ten or
more beyond the largest engines ever built (bore 0.98 m, stroke 3.7 m, 15 t of reciprocating masses
a cylinder) and the smallest (model engines, of 6 mm); all are judgement. Nearer values are
questioned by the usual ranges. A size of 0 is always possible: it leaves something out; and so is
any inertia: a huge one holds the speed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from engine_dyn.plausibility.usual_ranges import (
    LENGTH,
    MASS,
    PRESSURE,
    SPEED,
    SUSPICIONS,
    Suspicion,
)
from engine_dyn.types import Booleans


class Possible(NamedTuple):
    """Least and largest possible size of a parameter, in the unit of files, either sign."""

    least: float
    most: float

    def beyond(self, values: npt.ArrayLike) -> Booleans:
        """Whether values have a size that is not possible; 0 always is."""
        size = np.abs(values)
        return np.asarray((size > self.most) | ((size < self.least) & (size > 0.0)))


_OF_UNITS: Mapping[str, tuple[Possible, tuple[Suspicion, ...]]] = {
    "m": (Possible(0.0, 30.0), LENGTH),
    "kg": (Possible(1e-9, 1e6), MASS),
    "rpm": (Possible(0.0, 1e6), SPEED),
    "rad s-1": (Possible(0.0, 1e5), SPEED),
    "bar": (Possible(0.0, 1e3), PRESSURE),
    "bar s m-1": (Possible(0.0, 1e3), PRESSURE),
    "bar s2 m-2": (Possible(0.0, 1e3), PRESSURE),
    "MPa": (Possible(0.0, 1e5), PRESSURE),
    "kg m-3": (Possible(10.0, 1e5), SUSPICIONS["flywheel_density"]),
    "m s-1": (Possible(0.0, 1e4), ()),
}
"""By the unit of files: sizes that any parameter may have, and units that may be meant."""

_OWN: Mapping[str, Possible] = {
    "bore": Possible(5e-4, 10.0),
    "stroke": Possible(5e-4, 20.0),
    "rod_length": Possible(5e-4, 30.0),
    "shaft_length": Possible(0.0, 1e3),  # Lines of shafts of ships, and more for a margin
    "shaft_diameter": Possible(0.0, 10.0),
    "shaft_bore": Possible(0.0, 10.0),
}
"""Narrower and wider ends of single parameters."""


def _plain(name: str) -> str:
    return name.rstrip("0123456789").removesuffix("_")  # bore for bore_2


def possible(name: str, unit: str) -> Possible | None:
    """Return the sizes that a parameter can have, or None where none is impossible.

    Parameters
    ----------
    name : str
        The parameter, also of one cylinder, disc or shaft, such as "bore_2".
    unit : str
        Its unit in files, as in `engine_dyn.parameters`.

    Examples
    --------
    >>> possible("bore_2", "m")
    Possible(least=0.0005, most=10.0)
    >>> possible("crank_ratio", "1") is None
    True
    """
    of_unit = _OF_UNITS.get(unit)
    return None if of_unit is None else _OWN.get(_plain(name), of_unit[0])


def impossible(name: str, value: float, unit: str, si: float, written: float = 0.0) -> str:
    """Say what is allowed in place of an impossible value, and which unit may be meant.

    Parameters
    ----------
    name, unit : str
        As of `possible`.
    value : float
        The value, in this unit.
    si : float
        SI value of the unit.
    written : float
        SI value of the unit in which it was written, where that is another one.

    Returns
    -------
    str
        Words after "must be", or nothing for a possible value.

    Examples
    --------
    >>> impossible("bore", 105.0, "m", 1.0)
    'at most 10 m, more than any machine has; is it in mm?'
    >>> impossible("bore", 0.105, "m", 1.0)
    ''
    """
    ends, size = possible(name, unit), abs(value)
    if ends is None or not ends.beyond(value):
        return ""
    large = size > ends.most
    text = f"at most {ends.most:g}" if large else f"at least {ends.least:g}"
    text += f" {unit}, {'more' if large else 'less'} than any machine has"
    for other in SUSPICIONS.get(_plain(name), _OF_UNITS[unit][1]):
        meant = other.meant(size * si / (written or si)) / si
        if math.isfinite(meant) and ends.least <= meant <= 0.1 * ends.most:
            return f"{text}; is it {other.question}?"
    return text
