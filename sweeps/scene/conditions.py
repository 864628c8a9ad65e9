"""Conditions on designs, such as "delta <= 1/150", and the names that they are about."""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from engine_dyn.quantities.graph import DIMENSIONS, PARAMETERS
from sweeps.base.arguments import names_given
from sweeps.base.dimensions import words_of
from sweeps.base.errors import SceneError, not_known, one_line, shown
from sweeps.base.files.numbers_with_units import number_with_unit
from sweeps.base.ratios import number_or_ratio, ratio_text

if TYPE_CHECKING:
    import xarray as xr

Units = Callable[[str], str | None]  # Function from a name to its unit; None for an unknown name

LONGEST = 500  # Largest number of characters of a condition

PARTS = frozenset(name for name, dimension in DIMENSIONS.items() if dimension.whole)
"""Dimensions that count parts, such as main bearings, shafts, discs and modes: of a quantity with a
value for each of them the worst one counts."""


@dataclass(frozen=True)
class Constraint:
    """One condition on designs."""

    name: str  # Name of a quantity or an axis
    sign: str  # Sign of comparison: <=, >=, < or >
    limit: float  # Limit in the units of the archive
    written: str = ""  # Limit with its unit as the scene has it, if any

    def __str__(self) -> str:
        return f"{self.name} {self.sign} {self.written or ratio_text(self.limit)}"

    @property
    def above(self) -> bool:
        """Whether it is a limit from above."""
        return self.sign.startswith("<")

    def holds(self, values: npt.NDArray[Any]) -> npt.NDArray[np.bool_]:
        """Where values fulfil it; never for NaN."""
        signs = {"<=": operator.le, ">=": operator.ge, "<": operator.lt, ">": operator.gt}
        return np.asarray(signs[self.sign](values, self.limit))


FLUCTUATIONS = ("delta", "cycle_delta", "delta_elastic")

MOST_FLUCTUATION = 2.0  # (omega_max - omega_min)/omega_mean, with a mean in between


def constraint(text: str, units: Units | None = None) -> Constraint:
    """Read a condition such as "delta <= 1/150", "delta <= generator" or "brake_power >= 60 kW".

    Parameters
    ----------
    text : str
        A name, a sign, and a number, a fraction of two, a number with a unit, or the name of a
        value, such as a class of cyclic irregularity.
    units : callable, optional
        Unit of each name, which limits without a unit are in.

    Raises
    ------
    SceneError
        For anything else, and for a unit of another kind.
    """
    if len(text) > LONGEST:
        raise SceneError(
            f"condition {shown(text)}: has {len(text)} characters; must be at most {LONGEST}"
        )
    match = re.fullmatch(r"(\w++)\s*+(<=|>=|<|>)(.*+)", text.strip())
    if match is None or not match[3].strip():
        raise _no_condition(text)
    name, sign, limit = match[1], match[2], match[3].strip().strip("'\"")
    node = PARAMETERS.get("wanted_delta" if name == "delta" else name)
    named = {} if node is None else dict(node.named)  # For delta, its admissible values
    if limit in named:
        return Constraint(name, sign, named[limit])
    try:
        number = number_or_ratio(limit)
    except ValueError:
        pass
    else:
        if name in FLUCTUATIONS and number > MOST_FLUCTUATION:
            raise SceneError(
                f"condition {shown(text)}: a coefficient of fluctuation is at most "
                f"{MOST_FLUCTUATION:g}; did you mean '{name} {sign} 1/{number:g}'?"
            )
        return Constraint(name, sign, number)
    # The pattern is possessive: it never goes back into digits that it has matched, which would
    # take time that grows with the square of their number. It matches a number and what may be a
    # unit, for `number_with_unit` to check.
    with_unit = re.compile(
        r"[+-]?(?:\d++\.?+\d*+|\.\d++)(?:[eE][+-]?\d++)?+\s*+(?:%|1?/?[A-Za-z][^<>=]*+)"
    )
    if with_unit.fullmatch(limit):
        unit = units(name) if units is not None else None
        where = f"condition on {name}: limit"  # `check_name` refuses unknown names
        number = math.nan if unit is None else number_with_unit(limit, where, unit or "1")
        return Constraint(name, sign, number, one_line(limit))
    if named and limit[:1].isalpha() and limit != "nan":
        raise SceneError(
            f"condition {shown(text)}: {shown(limit)}: unknown{not_known(limit, named)}, "
            "or a number such as 1/150"
        )
    ratio = re.fullmatch(r"[\d.]++\s*+/\s*+[\d.]++\s*+([A-Za-z].*+)", limit)
    if ratio is not None and name in FLUCTUATIONS:
        raise SceneError(f"condition {shown(text)}: {name} has no unit {shown(ratio[1])}")
    raise _no_condition(text)


def _no_condition(text: str) -> SceneError:
    return SceneError(
        f"condition {shown(text)}: must be a name, one of <= >= < >, and a number, such as "
        "'delta <= 1/150' or 'brake_power >= 60 kW'"
    )


def conditions_of(within: str | Sequence[str], units: Units) -> list[Constraint]:
    """Read one condition or several; see `constraint`."""
    return [constraint(text, units) for text in names_given(within, "within")]


def units_of(archive: xr.Dataset) -> Units:
    """Units of what an archive has."""
    return lambda name: (
        str(archive[name].attrs.get("units", "1")) if name in archive.variables else None
    )


def check_name(archive: xr.Dataset, name: str) -> None:
    """Check that a name has one number for each design, or one for each part (`PARTS`).

    Raises
    ------
    SceneError
        For a name that the archive does not have, and for curves.
    """
    known = [str(n) for n, v in archive.variables.items() if v.dtype.kind in "iuf"]
    words = words_of(archive)
    if name in words:
        raise SceneError(f"{name}: an axis of words, not of numbers; --select {name}=... takes one")
    if name not in known:
        known = [each for each in known if each not in words]
        hint = f"; `engine-dyn optimise` searches it (--over {name})" if name in PARAMETERS else ""
        raise SceneError(f"{shown(name)}: not in the archive{not_known(name, known)}{hint}")
    empty = [str(d) for d, size in archive[name].sizes.items() if not size]
    if empty:
        raise SceneError(f"{name}: has no values, because there is no {empty[0]}")
    curve = [str(d) for d in archive[name].dims if d in DIMENSIONS and d not in PARTS]
    if curve:
        raise SceneError(
            f"{name}: not one number per design, because it varies over {', '.join(curve)}; "
            f"reduce it first, for instance to its largest value with .max('{curve[0]}'), or "
            "select values with sweeps.nearest"
        )


@dataclass(frozen=True)
class Asked:
    """Variables of an archive that a search is about, by keys of its own."""

    # Variables by key; the outcome as "status" where every value has one
    variables: dict[str, xr.Variable]
    # Function that takes the value of the part that counts, for each variable with a value for each
    # part, such as a bearing or a shaft
    parts: dict[str, Callable[[npt.NDArray[Any], tuple[int, ...]], npt.NDArray[Any]]]
    wanted: list[str]  # Keys of the quantities that are minimised or maximised
    limited: list[str]  # Keys of the quantities in conditions

    @property
    def dims(self) -> set[str]:
        """Dimensions over which all these lie, but for those of parts."""
        return {str(d) for v in self.variables.values() for d in v.dims} - PARTS


def asked_of(
    archive: xr.Dataset, wanted: Sequence[tuple[str, float]], conditions: Sequence[Constraint]
) -> Asked:
    """Look up what a search is about: names, each with 1 for less or -1 for more, and conditions.

    Of a quantity with a value for each part, such as a bearing or a shaft, the worst one counts:
    the largest where less is wanted or where the limit is one from above, else the smallest.
    Engines with fewer parts than others of their archive have NaN at those that they lack, which
    do not count.

    Raises
    ------
    SceneError
        As `check_name`.
    """
    asked = Asked({}, {}, [], [])
    above = [*(sign > 0.0 for _, sign in wanted), *(c.above for c in conditions)]
    names = [*(name for name, _ in wanted), *(c.name for c in conditions)]
    for number, (name, largest) in enumerate(zip(names, above, strict=True)):
        check_name(archive, name)
        variable, key = archive[name].variable, name
        if not PARTS.isdisjoint(map(str, variable.dims)):
            key = f"{name}, {'largest' if largest else 'smallest'}"
            asked.parts[key] = np.fmax.reduce if largest else np.fmin.reduce
        asked.variables[key] = variable
        (asked.wanted if number < len(wanted) else asked.limited).append(key)
    if "status" in archive and asked.dims.issuperset(map(str, archive["status"].dims)):
        # A condition on an axis holds for failed designs too: their outcome tells them apart.
        asked.variables["status"] = archive["status"].variable
    return asked
