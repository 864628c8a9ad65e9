"""Values, places and conditions of an archive in words: for decisions and verdicts."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sweeps.base.dimensions import SEARCHED, words_of
from sweeps.base.errors import listed, one_line
from sweeps.base.numbers import number_text
from sweeps.base.ratios import ratio_text
from sweeps.decide.explore.attributes import members_of
from sweeps.decide.explore.rows import fixed_of
from sweeps.scene.conditions import Constraint
from sweeps.view.texts.readable_units import asked_units, converted, unit_choices

if TYPE_CHECKING:
    import xarray as xr

REQUIRED = ("inertia_required", "flywheel_inertia_required")
"""Quantities that are inverse: what the delta that is wanted needs."""

AT_LIMIT = 5e-5  # Share of a limit; a value that is as near is said to be at it


class Wording:
    """Numbers of one archive with their units, as people read them; `units` is what they ask for.

    SceneError refuses units that do not fit, and names that the archive does not have.
    """

    def __init__(self, archive: xr.Dataset, units: str | None = None) -> None:
        self.units = units
        self._units = {
            str(name): one_line(variable.attrs.get("units", "1"))
            for name, variable in archive.variables.items() if variable.dtype.kind in "fiu"
        }  # fmt: skip
        self.choices = unit_choices(units, self._units)  # Units by name, where others are shown

    def number(self, name: str, value: float, digits: int = 4) -> str:
        """A value of a name with its unit."""
        factor, unit = self._converted(name)
        return f"{number_text(float(value) * factor, digits)} {unit}".rstrip()

    def cell(self, name: str, value: Any) -> str:
        """A value of a name without its unit, or a word."""
        if isinstance(value, str):
            return one_line(value, 60)
        return number_text(float(value) * self._converted(name)[0])

    def both(self, name: str, value: Any) -> str:
        """A value of a name with its unit, or a word."""
        if isinstance(value, str):
            return f"'{self.cell(name, value)}'" if "," in value else self.cell(name, value)
        if name == "wanted_delta":
            return ratio_text(float(value))
        return self.number(name, value)

    def bracket(self, name: str) -> str:
        """The unit of a name in the head of a column."""
        _, unit = self._converted(name)
        return f" [{unit}]" if unit else ""

    def condition(self, condition: Constraint) -> str:
        """A condition with the unit of its limit."""
        factor, unit = self._converted(condition.name)
        if condition.written or not unit:
            return str(condition)
        text = f"{condition.name} {condition.sign} {condition.limit * factor:.6g} {unit}"
        own = self._units.get(condition.name, "1")
        # A limit without a unit is in the archive's, which people do not see elsewhere
        given = f" ({condition.limit:g} {own}: no unit was given)" if factor != 1.0 else ""
        return text + given

    def value(self, condition: Constraint, value: float) -> str:
        """A value that is compared with a limit, as a ratio where the limit is one."""
        if 0.0 < value < 0.1 and ratio_text(condition.limit).startswith("1/"):
            return f"1/{number_text(1.0 / value)}"
        return self.number(condition.name, value)

    def worst(self, one: xr.Dataset, name: str, largest: bool) -> tuple[float, str]:
        """The worst value of a name over the points and parts of one design, and its place."""
        array = one[name]
        values = np.asarray(array.values, dtype=float)
        parameters = members_of(one, "parameters")
        aim = parameters.get("wanted_delta") if name in REQUIRED else None
        told = "" if aim is None else f"wanted_delta = {self.both('wanted_delta', aim)}"
        if not values.ndim:
            return float(values), told and f" at {told}"
        if not np.isfinite(values).any():
            return math.nan, ""
        flat = int(np.nanargmax(values) if largest else np.nanargmin(values))
        at = np.unravel_index(flat, values.shape)
        place = self.place(one, dict(zip(map(str, array.dims), map(int, at), strict=True)))
        return float(values[at]), f" at {', '.join(filter(None, (place, told)))}"

    def place(self, one: xr.Dataset, at: Mapping[str, int]) -> str:
        """A place along some dimensions in words."""
        said = []
        for dim, index in at.items():
            words = f"{dim}_name"
            home = words if words in one.coords else dim
            value = one[home].values[index] if home in one.coords else index + 1
            said.append(f"{dim} = {self.both(home, value)}")
        return ", ".join(said)

    def fixed(self, archive: xr.Dataset, one: xr.Dataset, but: Sequence[str] = ()) -> str:
        """The values at which axes of an archive were cut, but for some, in words."""
        place = {k: at for k, at in fixed_of(archive, one).items() if k not in (*but, *SEARCHED)}
        return ", ".join(f"{key} = {self.both(key, at)}" for key, at in place.items())

    def design(self, archive: xr.Dataset, one: xr.Dataset) -> str:
        """As `fixed`, but a name that tells all designs of a list apart stands for their values."""
        names = {
            str(archive[home].dims[0]): key for key, home in words_of(archive).items()
            if np.unique(archive[home].values.astype(str)).size == archive[home].size
        }  # fmt: skip
        hidden = [
            str(key) for key, at in archive.coords.items()
            if at.ndim == 1 and names.get(str(at.dims[0]), key) != key
        ]  # fmt: skip
        return self.fixed(archive, one, hidden)

    def conditions(
        self, one: xr.Dataset, conditions: Sequence[Constraint], at_every: Sequence[str]
    ) -> list[str]:
        """Lines on conditions: the worst value of each, where it is, and what is left to the limit.

        `at_every` are the axes at all values of which they hold.
        """
        if not conditions:
            return []
        worst = ", each with its worst value" if any(one[c.name].ndim for c in conditions) else ""
        lines = [f"conditions{everywhere(at_every)}{worst}:"]
        for condition in conditions:
            value, place = self.worst(one, condition.name, condition.above)
            text = f"  {self.condition(condition)}: {self.value(condition, value)}{place}"
            lines.append(", ".join(filter(None, (text, self.margin(condition, value)))))
        return lines

    def margin(self, condition: Constraint, value: float) -> str:
        """What a value leaves to a limit, or how far it is beyond; empty where that is zero."""
        margin = margin_of(condition, value)
        if not math.isfinite(margin):
            return ""
        near = abs(margin) < AT_LIMIT
        share = f"{number_text(100.0 * abs(margin), 2)} %"
        return (
            "at the limit" if near else f"{'a margin of' if margin > 0.0 else 'beyond by'} {share}"
        )

    def of_table(self, names: Sequence[str]) -> str | None:
        """What was asked of the units of some columns."""
        if self.units in (None, "archive"):
            return self.units
        asked = asked_units(self.units, self._units)
        return ",".join(f"{n}={unit}" for n, unit in asked.items() if n in names) or None

    def _converted(self, name: str) -> tuple[float, str]:
        return converted(self._units.get(name, "1"), self.choices.get(name))


def margin_of(condition: Constraint, value: float) -> float:
    """What a value leaves to a limit, as a share of the limit; NaN where the limit is zero."""
    room = condition.limit - value if condition.above else value - condition.limit
    return room / abs(condition.limit) if condition.limit else math.nan


def everywhere(at_every: Sequence[str]) -> str:
    """Words on axes at all values of which something holds."""
    return f" at every {listed(at_every)}" if at_every else ""
