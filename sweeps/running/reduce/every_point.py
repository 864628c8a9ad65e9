"""Designs are judged by conditions at every value of some axes, such as all loads and speeds.

Without such axes each design is one point.

An archive is read a range at a time: it may be larger than memory.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from engine_dyn.status import MEANINGS, WITH_NUMBERS
from engine_dyn.types import Booleans, Floats
from sweeps.base.arguments import names_given
from sweeps.base.dimensions import DESIGN, LABELS, NOT_CHOSEN
from sweeps.base.errors import SceneError, counted, listed, not_known, shown
from sweeps.base.netcdf.netcdf_files import slabs
from sweeps.base.ratios import ratio_text
from sweeps.running.reduce.ranges import chunks_of, ranges
from sweeps.scene.conditions import Constraint, asked_of, units_of

if TYPE_CHECKING:
    import xarray as xr

AT_ONCE = 1 << 22  # Designs that are compared at a time, some twenty bytes each

NO_VALUE = "no value"  # In place of an outcome, of points that have neither value nor outcome

KEPT = "kept"  # Attribute of designs that [reduce] kept, while they are searched

TEXT = "search"
"""Attribute of a search's result: number of designs that fulfil the conditions, and of those left
out."""


def outcomes_given(not_counted: str | Sequence[str]) -> list[int]:
    """Codes of outcomes that are not counted; only those of failed designs are allowed."""
    failed = {word: code for code, word in enumerate(MEANINGS) if code not in WITH_NUMBERS}
    words = names_given(not_counted, "not_counted")
    for word in words:
        if word not in failed:
            raise SceneError(f"not counted: {shown(word)}: unknown{not_known(word, failed)}")
    return [failed[word] for word in words]


@dataclass
class Judged:
    """Some designs: what holds at all points that were read so far."""

    good: Booleans  # Whether all conditions hold at every point of the axes that counts
    # Largest value of each quantity times its sign over the points that count, along the first
    # axis.
    worst: Floats
    points: Booleans  # Whether any point of the axes counts
    holds: list[Booleans]  # Whether each condition holds by itself
    # Largest excess of a value over the limit of each condition, in its unit, along the first axis:
    # negative inside, -inf where no point has a number.
    excess: Floats
    lacking: npt.NDArray[np.int64]  # Number of points that count and lack a number

    @property
    def fulfilling(self) -> Booleans:
        """Whether each design fulfils all conditions."""
        return self.good & self.points


class EveryPoint:
    """All designs of an archive, each looked at at every point of some axes.

    A point that counts and has no result is never one at which a condition holds: neither one that
    was computed and failed, nor one that was not computed. How many there are, of which outcome, is
    told.

    Parameters
    ----------
    archive : Dataset
        An archive.
    wanted : sequence of tuple
        Names of which the worst value of each design is looked for, with 1.0 where that is the
        largest, -1.0 where it is the smallest.
    conditions : sequence of Constraint
        What must hold.
    at_every : str or sequence of str
        Axes at all values of which it must hold.
    not_counted : str or sequence of str
        Outcomes of points that do not count.
    choosing : bool
        Whether one of the designs is to be chosen.

    Attributes
    ----------
    own : list of str
        Dimensions that tell the designs apart.
    sizes : dict of int
        Lengths of these and of the axes.
    cases : bool
        Whether there is no design to choose: all that differs is under which conditions one works.

    Raises
    ------
    SceneError
        For names and axes that the archive does not have, and where designs are chosen for
        `NOT_CHOSEN` ones that neither the conditions nor `at_every` name.
    """

    def __init__(
        self, archive: xr.Dataset, wanted: Sequence[tuple[str, float]],
        conditions: Sequence[Constraint], at_every: str | Sequence[str] = (),
        not_counted: str | Sequence[str] = (), *, choosing: bool = True,
    ) -> None:  # fmt: skip
        axes = names_given(at_every, "at_every")
        self.noun = "kept design" if KEPT in archive.attrs else "design"
        self.codes = outcomes_given(not_counted)
        if self.codes and "status" not in archive:
            raise SceneError(
                "not counted: the archive has no status, because none of its designs can fail"
            )
        self.names = [name for name, _ in wanted]
        self.signs = np.array([sign for _, sign in wanted])
        self.conditions = conditions
        asked = asked_of(archive, wanted, conditions)
        self.variables, self.parts = asked.variables, asked.parts
        self.wanted, self.limited = asked.wanted, asked.limited
        dims = [str(d) for d in archive.dims]
        for axis in axes:
            if axis not in dims:
                raise SceneError(f"at every {shown(axis)}: {_no_axis(archive, axis, dims)}")
            if axis in self.names:
                raise SceneError(
                    f"at every {axis}: is the axis to be minimised or maximised itself"
                )
        used = asked.dims
        self.axes = [d for d in dims if d in axes and d in used]
        self.asked = axes
        self.own = [d for d in dims if d in used and d not in axes]
        self.sizes = {d: archive.sizes[d] for d in (*self.own, *self.axes)}
        self.cases = _only_cases(archive, self.own)
        if choosing and not self.cases:
            _check_choice(archive, self.own, {*self.names, *(c.name for c in conditions)})
        self.units = units_of(archive)
        if "torque_missing" in archive and used.issuperset(archive["torque_missing"].dims):
            self.variables["torque_missing"] = archive["torque_missing"].variable
        self.short = 0.0  # Largest torque that is missing [N m] where there is no result
        self.nearest = [math.inf] * len(conditions)
        self.fulfilling = self.unsolved = self.without = 0
        self.alone = [0] * len(conditions)
        self.left_out: dict[int, int] = dict.fromkeys(self.codes, 0)
        self.failed: dict[str, int] = {}  # Number of points without a result by their outcome
        self.designs = math.prod(self.sizes[d] for d in self.own)

    def judged(self) -> Iterator[tuple[tuple[slice, ...], Judged]]:
        """Yield all designs, some at a time: where they are along `own`, and what holds of them."""
        shape = tuple(self.sizes[d] for d in self.own)
        chunks = chunks_of(self.variables, self.own, shape)
        for place in slabs(shape, chunks, 1, AT_ONCE):
            designs = self._read(dict(zip(self.own, place, strict=True)))
            counting = designs.points if self.asked else designs.lacking == 0
            for number, holds in enumerate(designs.holds):
                self.alone[number] += int(np.count_nonzero(holds & counting))
                excess = designs.excess[number][designs.points & (designs.lacking == 0)]
                self.nearest[number] = min(self.nearest[number], excess.min(initial=math.inf))
            self.unsolved += int(np.count_nonzero(designs.lacking))
            self.without += int(np.count_nonzero(~designs.points))
            self.fulfilling += int(np.count_nonzero(designs.fulfilling))
            yield place, designs

    def _read(self, place: Mapping[str, slice]) -> Judged:
        """Values and outcomes of some designs at all points."""
        variables = {
            name: v.isel({d: s for d, s in place.items() if d in v.dims})
            for name, v in self.variables.items()
        }
        shape = tuple(s.stop - s.start for s in place.values())
        new = Judged(
            np.ones(shape, bool), np.full((len(self.wanted), *shape), -math.inf),
            np.zeros(shape, bool), [np.ones(shape, bool) for _ in self.conditions],
            np.full((len(self.conditions), *shape), -math.inf), np.zeros(shape, np.int64),
        )  # fmt: skip
        dims = (*self.own, *self.axes)
        lengths = (*shape, *(self.sizes[d] for d in self.axes))
        over = tuple(range(len(shape), len(dims)))
        for begin, extent, arrays in ranges(variables, dims, lengths, parts=self.parts):
            here = tuple(slice(b, b + n) for b, n in zip(begin, extent, strict=True))[: len(shape)]
            self._add(new, here, extent, arrays, over)
        return new

    def _add(
        self, designs: Judged, here: tuple[slice, ...], extent: tuple[int, ...],
        arrays: Mapping[str, npt.NDArray[Any]], over: tuple[int, ...],
    ) -> None:  # fmt: skip
        """Add points to the judgement of designs."""
        solved = np.ones(extent, bool)
        counts = np.ones(extent, bool)
        if "status" in arrays:
            status = np.broadcast_to(arrays["status"], extent)
            solved &= np.isin(status, WITH_NUMBERS)
            counts = ~np.isin(status, self.codes)
            for code in self.codes:
                self.left_out[code] += int(np.count_nonzero(status == code))
        wanted = [np.broadcast_to(arrays[key], extent) for key in self.wanted]
        for values in wanted:
            solved &= np.isfinite(values)
        good = np.ones(extent, bool)
        for number, (condition, key) in enumerate(zip(self.conditions, self.limited, strict=True)):
            one = np.broadcast_to(arrays[key], extent)
            solved &= np.isfinite(one)
            holds = condition.holds(one)
            good &= holds
            designs.holds[number][here] &= (holds | ~counts).all(over)
            beyond = one - condition.limit if condition.above else condition.limit - one
            _keep_largest(designs.excess, (number, *here), beyond, counts & np.isfinite(one), over)
        lacking = counts & ~solved
        if lacking.any():
            self._add_failed(arrays.get("status"), lacking)
            missing = np.abs(np.broadcast_to(arrays.get("torque_missing", 0.0), extent)[lacking])
            self.short = float(np.fmax.reduce(missing, initial=self.short))
        designs.lacking[here] += lacking.sum(over)
        designs.good[here] &= ((solved & good) | ~counts).all(over)
        designs.points[here] |= counts.any(over)
        for number, values in enumerate(wanted):
            _keep_largest(
                designs.worst, (number, *here), self.signs[number] * values, counts & solved, over
            )

    def _add_failed(self, status: npt.NDArray[Any] | None, lacking: Booleans) -> None:
        """Count points without a result by their outcome."""
        number = int(np.count_nonzero(lacking))
        codes = np.full(lacking.shape, np.nan) if status is None else status
        here = np.broadcast_to(codes, lacking.shape)[lacking]
        for code, word in enumerate(MEANINGS):
            count = 0 if code in WITH_NUMBERS else int(np.count_nonzero(here == code))
            if count:
                self.failed[word] = self.failed.get(word, 0) + count
                number -= count
        if number:  # Not computed, or without a value for another reason than the speed
            self.failed[NO_VALUE] = self.failed.get(NO_VALUE, 0) + number

    @property
    def _everywhere(self) -> str:
        return f"at every {listed(self.asked)}" if self.asked else ""

    def text(self, equal: int = 1) -> str:
        """How many designs fulfil the conditions, and what was left out.

        `equal` is how many designs are equally good.
        """
        what = " and ".join(map(str, self.conditions))
        verb = "fulfil" if what else "have results"
        if self.fulfilling == 1:
            verb = "fulfils" if what else "has results"
        parts = [
            f"{self.fulfilling} of {counted(self.designs, self.noun)} "
            f"{' '.join(filter(None, (verb, what, self._everywhere)))}"
        ]
        if equal > 1:
            parts.append(f"{equal} are equally good; this is the first")
        return "; ".join([*parts, *self.missing()])

    def missing(self) -> list[str]:
        """Which points have no result, and which were left out."""
        return [f"without a result: {text}" for text in self._failed()] + self._left_out()

    def _left_out(self) -> list[str]:
        return [
            f"left out: {self._of_points(MEANINGS[code], number)}"
            for code, number in self.left_out.items()
        ]

    def _failed(self) -> list[str]:
        return [self._of_points(word, number) for word, number in self.failed.items()]

    def _of_points(self, outcome: str, number: int) -> str:
        return f"{outcome}, {number} of {counted(math.prod(self.sizes.values()), 'point')}"

    def nothing(self) -> str:
        """Why no design was found, in words."""
        designs = counted(self.designs, self.noun)
        if not self.asked and not self.conditions:
            return f"no design has a value of {' and '.join(self.names)}"
        if not self.asked:
            with_each = (
                f"{n} with {c}{self._nearest(number)}"
                for number, (c, n) in enumerate(zip(self.conditions, self.alone, strict=True))
            )
            return (
                f"no design meets all conditions; {self.designs - self.unsolved} of {designs} have "
                f"a result, {', '.join(with_each)}"
            )
        each = [
            f"{c} holds {self._everywhere} for {n}{self._nearest(number)}"
            for number, (c, n) in enumerate(zip(self.conditions, self.alone, strict=True))
        ]
        if self.unsolved:
            short = f"; torque_missing at most {self.short:.4g} N m" if self.short else ""
            why = f" ({'; '.join(self._failed())}{short})" if self.failed else ""
            each.append(
                f"{self.unsolved} have no result at some point{why}: see the outcomes, and "
                "not_counted (--not-counted)"
            )
        if self.without:
            each.append(f"{self.without} have no point that is counted")
        told = "; ".join([*each, *self._left_out()])
        return f"no design meets all conditions {self._everywhere}; of {designs}: {told}"

    def _nearest(self, number: int) -> str:
        """Text on the value that comes nearest to a condition that no design meets."""
        excess, condition = self.nearest[number], self.conditions[number]
        if self.alone[number] or not math.isfinite(excess):
            return ""
        value = condition.limit + (excess if condition.above else -excess)
        return f" ({'least' if condition.above else 'most'}: {self._as_written(condition, value)})"

    def _as_written(self, condition: Constraint, value: float) -> str:
        """A value in the unit of the limit, or as the ratio that the limit is."""
        number = re.match(r"[-+.\deE]+", condition.written) if condition.written else None
        if number is not None and condition.limit:
            own = value / condition.limit * float(number[0])
            return f"{own:.4g}{condition.written[number.end() :]}"
        if 0.0 < value < 0.1 and ratio_text(condition.limit).startswith("1/"):
            return f"1/{1.0 / value:.4g}"
        unit = self.units(condition.name)
        return f"{value:.4g}{'' if unit in (None, '1') else f' {unit}'}"


def _no_axis(archive: xr.Dataset, name: str, dims: Sequence[str]) -> str:
    """Reason why an axis does not exist: a column of designs has one value with each design."""
    if name in archive.coords and DESIGN in archive[name].dims:
        return (
            "has one value with each design, so that no design is seen at several; the scene needs "
            "it in [axes], beside its [sample] or [designs]"
        )
    return f"not an axis{not_known(name, list(dims))}"


def _only_cases(archive: xr.Dataset, own: Sequence[str]) -> bool:
    """Whether nothing differs but what is not chosen with a design (`NOT_CHOSEN`)."""
    columns = {n for n, v in archive.coords.items() if DESIGN in own and v.dims == (DESIGN,)}
    chosen = [n for n in columns if archive[n].dtype.kind in "iuf" or n in LABELS[1:]]
    several = [d for d in own if d != DESIGN and archive.sizes[d] > 1]
    return set(NOT_CHOSEN).issuperset({*several, *chosen} - {DESIGN}) and (
        DESIGN not in own or bool(set(chosen) - {DESIGN})
    )


def _check_choice(archive: xr.Dataset, own: Sequence[str], named: set[str]) -> None:
    """Check that designs differ only in what can be chosen, or in the axes that a person named."""
    # Raises SceneError with a line that says how to name the axes.
    points = [d for d in own if d in NOT_CHOSEN and d not in named and archive.sizes[d] > 1]
    if points:
        axes, first = ",".join(points), points[0]
        them = "them" if points[1:] else "it"
        # Of a cylinder's or a cycle's number, more is neither better nor worse
        chosen = "" if first in ("misfire", "recorded_cycle", "cycle_number") else (
            f"; a condition such as --within '{first} >= VALUE' lets the search choose"
        )  # fmt: skip
        raise SceneError(
            f"{listed(points)}: a design works at all values of {them}, so none is chosen "
            f"with it. Say which count: --at-every {axes} (at_every) takes all, with the worst "
            f"result; --select {first}=VALUE (sweeps.nearest) takes one{chosen}"
        )
    for name in NOT_CHOSEN if DESIGN in own else ():
        if name not in named and name in archive.coords and _varies(archive[name].variable):
            raise SceneError(
                f"{name}: each design has its own, and it is not chosen with a design. With {name} "
                f"in the scene's [axes] instead, --at-every {name} (at_every) takes the worst "
                f"result at all its values; a condition such as --within '{name} >= VALUE' lets "
                "the search choose"
            )


def _varies(column: xr.Variable) -> bool:
    """Whether a column of designs has several values; reading ends at the second one."""
    if column.dims != (DESIGN,):
        return False
    for (part,) in slabs(column.shape, (1,), 1, AT_ONCE):
        values = column[part].values
        if (values != values[0]).any() or values[0] != column[0].values:
            return True
    return False


def _keep_largest(
    kept: Floats,
    here: tuple[int | slice, ...],
    values: Floats,
    known: Booleans,
    over: tuple[int, ...],
) -> None:
    """Keep the larger of the kept value and the largest known value along some axes."""
    largest = np.where(known, values, -math.inf).max(over, initial=-math.inf)
    kept[here] = np.maximum(kept[here], largest)
