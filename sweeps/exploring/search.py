"""Designs are found in archives: the best under conditions, and the Pareto front.

The best at every point of some axes is found in `sweeps.exploring.every_point`.

An archive is read a range at a time: it may be larger than memory.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from engine_dyn.status import WITH_NUMBERS
from engine_dyn.types import Integers
from sweeps.checks import check_dataset, names_given
from sweeps.errors import SceneError, counted, shown
from sweeps.exploring.conditions import Constraint, asked_of, conditions_of, units_of
from sweeps.exploring.every_point import best_at_every_point, front_at_every_point
from sweeps.exploring.kept_front import Front
from sweeps.exploring.ranges import ranges

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["best", "pareto"]


def best(
    archive: xr.Dataset, *, least: str | None = None, most: str | None = None,
    within: str | Sequence[str] = (), at_every: str | Sequence[str] = (),
    not_counted: str | Sequence[str] = (),
) -> xr.Dataset:  # fmt: skip
    """Find the design with the least, or most, of a quantity, under conditions.

    Parameters
    ----------
    archive : Dataset
        As `open` or `run` returns it; it may be larger than memory.
    least, most : str
        A quantity or an axis; one of the two.
    within : str or sequence of str
        Conditions such as "delta <= 1/150", "delta <= generator" or "brake_power >= 60 kW", all of
        which must hold. Without a unit, a number is in the unit of the archive, here W.
    at_every : str or sequence of str
        Axes at all values of which the conditions must hold, such as ["load", "speed"]. Where
        `least` depends on them, its largest value there counts, of `most` the smallest.
    not_counted : str or sequence of str
        Only with `at_every`: outcomes such as "no_steady_state" (of an engine at idle, say). Points
        that have one of them are left out; all others must fulfil the conditions.

    Returns
    -------
    Dataset
        The archive at that design; the first of several. Axes on which none of the names depends
        stay, and those of `at_every`. Designs that failed are not considered. With `at_every`, the
        attribute `search` tells how many designs fulfil the conditions, how many are equally good,
        and what was not counted.

    Raises
    ------
    SceneError
        For names that the archive does not have, or that have more than one value for each design,
        and where no design fulfils the conditions.

    Examples
    --------
    >>> import sweeps
    >>> archive = sweeps.run(
    ...     engine="ntua",
    ...     axes={"inertia": [5, 20, 40], "load": [50, 90], "speed": [1200, 1500]},
    ...     output={"quantities": ["delta"]},
    ... )
    >>> found = sweeps.best(
    ...     archive, least="inertia", within="delta <= 1/50", at_every=["load", "speed"]
    ... )
    >>> float(found.inertia)
    20.0
    """
    check_dataset(archive)
    if (least is None) == (most is None):
        raise SceneError("best: needs either least or most")
    name, sign = (str(least), 1.0) if least is not None else (str(most), -1.0)
    conditions = conditions_of(within, units_of(archive))
    if at_every:
        return best_at_every_point(archive, name, sign, conditions, at_every, not_counted)
    if not_counted:
        raise SceneError("best: not_counted is only used with at_every; failed designs never count")
    found, smallest = -1, math.inf
    search = _Search(archive, [(name, sign)], conditions)
    for places, (values,) in search.designs():
        here = int(np.argmin(sign * values))
        if found < 0 or sign * values[here] < smallest:
            found, smallest = int(places[here]), sign * float(values[here])
    if found < 0:
        raise SceneError(search.nothing())
    at = np.unravel_index(found, search.shape)
    return archive.isel({d: int(i) for d, i in zip(search.dims, at, strict=True)})


def pareto(
    archive: xr.Dataset, first: str, second: str, *more: str, most: str | Sequence[str] = (),
    within: str | Sequence[str] = (), at_every: str | Sequence[str] = (),
    not_counted: str | Sequence[str] = (),
) -> xr.Dataset:  # fmt: skip
    """Pareto front of two quantities or more: the designs that no other beats in all of them.

    Parameters
    ----------
    archive : Dataset
        As `open` or `run` returns it; it may be larger than memory.
    first, second, *more : str
        Quantities or axes, of which less is better.
    most : str or sequence of str
        Those of them of which more is better.
    within : str or sequence of str
        Conditions, all of which must hold, as `best` takes them.
    at_every, not_counted : str or sequence of str
        As `best` takes them: axes at all values of which the conditions must hold, and at which
        the worst value of each quantity counts; outcomes that are left out.

    Returns
    -------
    Dataset
        The archive at these designs, along a new dimension `front`, the best in `first` first.
        Designs that are equal in all of them are all in it. Axes on which none of the names
        depends stay, and those of `at_every`.

    Raises
    ------
    SceneError
        As `best`.

    Examples
    --------
    >>> import sweeps
    >>> archive = sweeps.run(
    ...     engine="ntua",
    ...     axes={"inertia": [5, 20, 40], "speed": [1200, 1500]},
    ...     output={"quantities": ["delta", "torque_mean"]},
    ... )
    >>> front = sweeps.pareto(archive, "inertia", "delta")
    >>> front.inertia.values
    array([ 5., 20., 40.])
    >>> front.speed.values
    array([1500., 1500., 1500.])
    """
    check_dataset(archive)
    names = [str(name) for name in (first, second, *more)]
    for number, name in enumerate(names):
        if name in names[:number]:
            raise SceneError(f"pareto: {name} is given twice; needs two quantities or more")
    largest = names_given(most, "most")
    for name in largest:
        if name not in names:
            raise SceneError(
                f"pareto: most = {shown(name)}: must be {', '.join(names[:-1])} or {names[-1]}"
            )
    wanted = [(name, -1.0 if name in largest else 1.0) for name in names]
    conditions = conditions_of(within, units_of(archive))
    if at_every:
        return front_at_every_point(archive, wanted, conditions, at_every, not_counted)
    if not_counted:
        raise SceneError(
            "pareto: not_counted is only used with at_every; failed designs never count"
        )
    search = _Search(archive, wanted, conditions)
    front = Front(len(wanted))
    for places, values in search.designs():
        front.add(np.array([sign * v for (_, sign), v in zip(wanted, values, strict=True)]), places)
    if not front.places.size:
        raise SceneError(search.nothing())
    return front.taken_of(archive, search.dims)


class _Search:
    """All designs of an archive with the values of some names, a range at a time."""

    def __init__(
        self, archive: xr.Dataset, wanted: Sequence[tuple[str, float]],
        conditions: Sequence[Constraint],
    ) -> None:  # fmt: skip
        self.names = [name for name, _ in wanted]
        self.conditions = list(conditions)
        self.asked = asked_of(archive, wanted, conditions)
        self.dims = tuple(str(d) for d in archive.dims if d in self.asked.dims)
        self.shape = tuple(archive.sizes[d] for d in self.dims)
        self.alone = [0] * len(self.conditions)
        self.solved = 0

    def designs(self) -> Iterator[tuple[Integers, list[npt.NDArray[Any]]]]:
        """Places of the designs that fulfil all conditions, and their values of the names."""
        variables, parts = self.asked.variables, self.asked.parts
        for begin, extent, arrays in ranges(variables, self.dims, self.shape, parts=parts):
            good = np.ones(extent, dtype=bool)
            for name in variables:
                if name == "status":
                    good &= np.isin(arrays[name], WITH_NUMBERS)
                else:
                    good &= np.isfinite(arrays[name])
            self.solved += int(good.sum())
            kept = good.copy()
            limited = zip(self.conditions, self.asked.limited, strict=True)
            for number, (condition, key) in enumerate(limited):
                holds = good & condition.holds(arrays[key])
                self.alone[number] += int(holds.sum())
                kept &= holds
            if kept.any():
                yield (
                    self._places(kept, begin),
                    [
                        np.broadcast_to(arrays[n], extent)[kept].reshape(-1)
                        for n in self.asked.wanted
                    ],
                )

    def _places(self, kept: npt.NDArray[np.bool_], begin: tuple[int, ...]) -> Integers:
        """Numbers of designs in the archive."""
        inside = np.flatnonzero(kept)
        if not kept.shape:
            return inside
        at = np.unravel_index(inside, kept.shape)
        position = tuple(i + b for i, b in zip(at, begin, strict=True))
        return np.asarray(np.ravel_multi_index(position, self.shape), dtype=np.int64)

    def nothing(self) -> str:
        """Why no design was found, in words."""
        solved = f"{self.solved} of {counted(math.prod(self.shape), 'design')} have a result"
        if not self.conditions:
            return f"no design has a value of {' and '.join(self.names)}"
        each = ", ".join(f"{n} with {c}" for c, n in zip(self.conditions, self.alone, strict=True))
        return f"no design meets all conditions; {solved}, {each}"
