"""The best design that fulfils conditions at every value of some axes: all loads, all speeds.

An archive is read a range at a time: it may be larger than memory.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from engine_dyn.status import MEANINGS
from sweeps.checks import names_given
from sweeps.errors import SceneError, counted, not_known, shown
from sweeps.exploring.conditions import WITH_NUMBERS, Constraint, check_name
from sweeps.exploring.ranges import ranges
from sweeps.reading.netcdf_files import slabs

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["best_at_every_point"]

AT_ONCE = 1 << 22
"""Designs that are compared at a time; each takes some twenty bytes."""

TEXT = "search"
"""Attribute of what is found: how many designs fulfil the conditions, and what was left out."""


def best_at_every_point(
    archive: xr.Dataset, name: str, sign: float, conditions: Sequence[Constraint],
    at_every: str | Sequence[str], not_counted: str | Sequence[str] = (),
) -> xr.Dataset:  # fmt: skip
    """Find the design with the least of `sign` times a quantity; see `sweeps.best`.

    Raises
    ------
    SceneError
        As `sweeps.best`.
    """
    axes = names_given(at_every, "at_every")
    search = _Search(archive, name, sign, conditions, axes, _codes(not_counted, archive))
    search.read()
    if search.found is None:
        raise SceneError(search.nothing())
    found = archive.isel(search.found)
    found.attrs[TEXT] = search.text()
    return found


def _codes(not_counted: str | Sequence[str], archive: xr.Dataset) -> list[int]:
    words = [not_counted] if isinstance(not_counted, str) else list(not_counted)
    failed = {word: code for code, word in enumerate(MEANINGS) if code not in WITH_NUMBERS}
    for word in words:
        if word not in failed:
            raise SceneError(f"not counted: {shown(word)}: unknown{not_known(word, failed)}")
    if words and "status" not in archive:
        raise SceneError("not counted: the archive has no status: none of its designs can fail")
    return [failed[word] for word in words]


@dataclass
class _Designs:
    """Some designs: what holds at all points that were read so far."""

    good: npt.NDArray[np.bool_]
    worst: npt.NDArray[np.float64]
    points: npt.NDArray[np.bool_]
    holds: list[npt.NDArray[np.bool_]] = field(default_factory=list)
    failed: npt.NDArray[np.bool_] | None = None


class _Search:
    """All designs of an archive, each looked at at every point of some axes."""

    def __init__(
        self, archive: xr.Dataset, name: str, sign: float, conditions: Sequence[Constraint],
        axes: Sequence[str], codes: Sequence[int],
    ) -> None:  # fmt: skip
        self.name, self.sign, self.conditions, self.codes = name, sign, conditions, codes
        known = list(dict.fromkeys([name, *(c.name for c in conditions)]))
        for one in known:
            check_name(archive, one)
        dims = [str(d) for d in archive.dims]
        for axis in axes:
            if axis not in dims:
                raise SceneError(f"at every {shown(axis)}: not an axis{not_known(axis, dims)}")
            if axis == name:
                raise SceneError(f"at every {axis}: is what is wanted least or most itself")
        self.variables = {one: archive[one].variable for one in known}
        used = {str(d) for v in self.variables.values() for d in v.dims}
        if "status" in archive and used.issuperset(map(str, archive["status"].dims)):
            self.variables["status"] = archive["status"].variable
        self.axes = [d for d in dims if d in axes and d in used]
        self.asked = list(axes)
        self.own = [d for d in dims if d in used and d not in axes]
        self.sizes = {d: archive.sizes[d] for d in (*self.own, *self.axes)}
        self.found: dict[str, int] | None = None
        self.value = math.inf
        self.equal = self.fulfilling = self.unsolved = self.without = 0
        self.alone = [0] * len(conditions)
        self.left_out: dict[int, int] = dict.fromkeys(codes, 0)
        self.designs = math.prod(self.sizes[d] for d in self.own)

    def read(self) -> None:
        """Look at all designs."""
        shape = tuple(self.sizes[d] for d in self.own)
        for place in slabs(shape, (1,) * len(shape), 1, AT_ONCE):
            self._keep_best(self._read(dict(zip(self.own, place, strict=True))), place)

    def _read(self, place: Mapping[str, slice]) -> _Designs:
        """What some designs are at all points."""
        variables = {
            name: v.isel({d: s for d, s in place.items() if d in v.dims})
            for name, v in self.variables.items()
        }
        shape = tuple(s.stop - s.start for s in place.values())
        new = _Designs(
            np.ones(shape, bool), np.full(shape, -math.inf), np.zeros(shape, bool),
            [np.ones(shape, bool) for _ in self.conditions], np.zeros(shape, bool),
        )  # fmt: skip
        dims = (*self.own, *self.axes)
        lengths = (*shape, *(self.sizes[d] for d in self.axes))
        over = tuple(range(len(shape), len(dims)))
        for begin, extent, arrays in ranges(variables, dims, lengths):
            here = tuple(slice(b, b + n) for b, n in zip(begin, extent, strict=True))[: len(shape)]
            self._add(new, here, extent, arrays, over)
        return new

    def _add(
        self, designs: _Designs, here: tuple[slice, ...], extent: tuple[int, ...],
        arrays: Mapping[str, npt.NDArray[Any]], over: tuple[int, ...],
    ) -> None:  # fmt: skip
        """Add points to what is known of designs."""
        solved = np.ones(extent, bool)
        counts = np.ones(extent, bool)
        if "status" in arrays:
            status = np.broadcast_to(arrays["status"], extent)
            solved &= np.isin(status, WITH_NUMBERS)
            counts = ~np.isin(status, self.codes)
            for code in self.codes:
                self.left_out[code] += int(np.count_nonzero(status == code))
        values = np.broadcast_to(arrays[self.name], extent)
        solved &= np.isfinite(values)
        good = solved.copy()
        for number, condition in enumerate(self.conditions):
            one = np.broadcast_to(arrays[condition.name], extent)
            solved &= np.isfinite(one)
            holds = condition.holds(one)
            good &= holds
            designs.holds[number][here] &= (holds | ~counts).all(over)
        assert designs.failed is not None
        designs.failed[here] |= (counts & ~solved).any(over)
        designs.good[here] &= ((solved & good) | ~counts).all(over)
        designs.points[here] |= counts.any(over)
        worst = np.where(counts & solved, self.sign * values, -math.inf).max(
            over, initial=-math.inf
        )
        designs.worst[here] = np.maximum(designs.worst[here], worst)

    def _keep_best(self, designs: _Designs, place: tuple[slice, ...]) -> None:
        assert designs.failed is not None
        for number, holds in enumerate(designs.holds):
            self.alone[number] += int(np.count_nonzero(holds & designs.points))
        self.unsolved += int(np.count_nonzero(designs.failed))
        self.without += int(np.count_nonzero(~designs.points))
        fulfilling = designs.good & designs.points
        self.fulfilling += int(np.count_nonzero(fulfilling))
        if not fulfilling.any():
            return
        values = np.where(fulfilling, designs.worst, math.inf)
        smallest = float(values.min())
        if smallest < self.value:
            self.value, self.equal = smallest, 0
            at = np.unravel_index(int(np.argmin(values)), values.shape)
            self.found = {d: int(i) + s.start for d, i, s in zip(self.own, at, place, strict=True)}
        if smallest == self.value:
            self.equal += int(np.count_nonzero(values == smallest))

    @property
    def _everywhere(self) -> str:
        return f"at every {' and '.join(self.asked)}"

    def text(self) -> str:
        """How many designs fulfil the conditions, and what was left out."""
        what = " and ".join(map(str, self.conditions))
        verb = "fulfil" if what else "have numbers"
        if self.fulfilling == 1:
            verb = "fulfils" if what else "has numbers"
        parts = [
            f"{self.fulfilling} of {counted(self.designs, 'design')} "
            f"{f'{verb} {what}'.rstrip()} {self._everywhere}"
        ]
        if self.equal > 1:
            parts.append(f"{self.equal} are equally good, this is the first")
        parts += self._left_out()
        return "; ".join(parts)

    def _left_out(self) -> list[str]:
        points = math.prod(self.sizes.values())
        return [
            f"not counted: {MEANINGS[code]}, {number} of {counted(points, 'point')}"
            for code, number in self.left_out.items()
        ]

    def nothing(self) -> str:
        """Why no design was found, in words."""
        each = [
            f"{c} holds {self._everywhere} for {n}"
            for c, n in zip(self.conditions, self.alone, strict=True)
        ]
        if self.unsolved:
            each.append(
                f"{self.unsolved} lack numbers at some point, such as an engine at idle: see the "
                "outcomes, and not_counted (--not-counted)"
            )
        if self.without:
            each.append(f"{self.without} have no point that counts")
        told = "; ".join([*each, *self._left_out()])
        return (
            f"no design fulfils all conditions {self._everywhere}; of "
            f"{counted(self.designs, 'design')}: {told}"
        )
