"""The best designs, and Pareto fronts, of designs that come a block at a time."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from engine_dyn.types import Floats, Integers
from sweeps.base.errors import SceneError
from sweeps.base.fronts import front_of, unbeaten
from sweeps.running.reduce.every_point import EveryPoint
from sweeps.scene.conditions import conditions_of, units_of

if TYPE_CHECKING:
    import xarray as xr

    from sweeps.scene.reduce import Kept

AT_ONCE = 1 << 16  # Smallest number of designs that are compared at a time


class Front:
    """Designs that none of those that came so far beats."""

    def __init__(self, numbers: int) -> None:
        self._values: Floats = np.empty((numbers, 0))
        self._places: Integers = np.empty(0, dtype=np.int64)
        self._waiting: list[tuple[Floats, Integers]] = []
        self._count = 0

    @property
    def values(self) -> Floats:
        """Numbers of designs, smaller being better, as in `sweeps.base.fronts.front_of`."""
        self._compare()
        return self._values

    @property
    def places(self) -> Integers:
        """Numbers of the designs."""
        self._compare()
        return self._places

    def add(self, values: Floats, places: Integers) -> None:
        """Add designs, values of shape (numbers, designs).

        As many are compared at a time as the front has designs, so that however long it becomes,
        each is compared a few times. What the first ones leave of a front spares others the
        sorting.
        """
        for begin in range(0, values.shape[1], AT_ONCE):
            some, here = values[:, begin : begin + AT_ONCE], places[begin : begin + AT_ONCE]
            candidates = unbeaten(self._values, some)
            self._waiting.append((some[:, candidates], here[candidates]))
            self._count += int(np.count_nonzero(candidates))
            if self._count >= max(AT_ONCE, self._places.size):
                self._compare()

    def _compare(self) -> None:
        """Move the waiting designs into the front."""
        if self._waiting:
            values = np.hstack([self._values, *(some for some, _ in self._waiting)])
            places = np.concatenate([self._places, *(here for _, here in self._waiting)])
            kept = front_of(*values)
            self._values, self._places = values[:, kept], places[kept]
            self._waiting, self._count = [], 0

    def taken_of(self, archive: xr.Dataset, dims: Sequence[str]) -> xr.Dataset:
        """The archive at these designs, along `FRONT`; places count along `dims`."""
        import xarray as xr

        if not dims:
            return archive.expand_dims("front")
        at = np.unravel_index(self.places, [archive.sizes[d] for d in dims])
        return archive.isel({d: xr.Variable(("front",), i) for d, i in zip(dims, at, strict=True)})


Rows = dict[str, npt.NDArray[Any]]

Designs = tuple[Floats, Integers, Rows]
"""Numbers of designs (smaller ones are better), their places, and their values."""


class Search:
    """Designs that one search has kept so far.

    Parameters
    ----------
    asked : Kept
        What is searched for.
    example : Dataset
        Labels and sizes of the designs; its values are not looked at.
    at_every : tuple of str
        Axes at all values of which designs are judged.
    sizes : mapping
        Lengths of the axes in the whole scene.

    Raises
    ------
    SceneError
        As `sweeps.best`; where an axis neither tells designs apart nor is among `at_every`.
    """

    def __init__(
        self, asked: Kept, example: xr.Dataset, at_every: tuple[str, ...], sizes: Mapping[str, int]
    ) -> None:
        self.asked, self.at_every = asked, at_every
        self.conditions = conditions_of(list(asked.within), units_of(example))
        self.whole = self._judge(example)
        self.own = [d for d in sizes if d not in at_every]
        for axis in self.own:
            if axis not in self.whole.own:
                raise SceneError(
                    f"{asked}: nothing in it depends on {axis}; {axis} must be among at_every, or "
                    "in a condition"
                )
        self.sizes = [sizes[d] for d in self.own]
        self.whole.sizes = {d: sizes[d] for d in self.whole.sizes}
        self.points = math.prod(sizes.values())
        self.counted = np.zeros(3 + len(self.conditions) + len(self.whole.codes), np.int64)
        self.nearest = np.full(len(self.conditions), math.inf)
        self._kept: Designs = np.empty((len(asked.wanted), 0)), np.empty(0, np.int64), {}
        self._waiting: list[Designs] = []

    def _judge(self, designs: xr.Dataset) -> EveryPoint:
        return EveryPoint(
            designs, self.asked.wanted, self.conditions, self.at_every, self.asked.not_counted
        )

    def add(self, designs: xr.Dataset, begin: Mapping[str, int]) -> None:
        """Add a block of designs, which begins at these places of the whole scene's axes."""
        search = self._judge(designs)
        for part, judged in search.judged():
            fulfilling = np.flatnonzero(judged.fulfilling)
            shape = judged.fulfilling.shape
            good = np.unravel_index(fulfilling, shape) if shape else ()
            at = {d: i + s.start for d, i, s in zip(search.own, good, part, strict=True)}
            values = judged.worst.reshape(len(judged.worst), -1)[:, fulfilling]
            wanted = self._unbeaten(values)
            at = {d: i[wanted] for d, i in at.items()}
            inside = [at[d] + begin.get(d, 0) for d in self.own]
            places = np.zeros(values[:, wanted].shape[1], np.int64)
            if self.own:
                places = np.asarray(np.ravel_multi_index(inside, self.sizes), np.int64)
            if places.size:
                self._keep(values[:, wanted], places, _rows_of(designs, at, places.size))
        more = [search.fulfilling, search.unsolved, search.without, *search.alone]
        self.counted += [*more, *search.left_out.values()]
        self.nearest = np.minimum(self.nearest, search.nearest)

    @property
    def places(self) -> Integers:
        """Designs that are kept."""
        self._compare()
        return self._kept[1]

    @property
    def rows(self) -> Rows:
        """Values of the kept designs."""
        self._compare()
        return self._kept[2]

    def _unbeaten(self, values: Floats) -> npt.NDArray[Any]:
        """Candidates for the front among the designs of a block, in their order."""
        least, places, _ = self._kept
        if self.asked.number:
            number = self.asked.number
            candidates = values[0] <= (least[0, -1] if places.size >= number else math.inf)
            if np.count_nonzero(candidates) > number:
                limit = np.partition(values[0, candidates], number - 1)[number - 1]
                candidates &= values[0] <= limit
            return np.asarray(candidates)
        return unbeaten(least, values)

    def _keep(self, *designs: *Designs) -> None:
        """Keep the best of the kept and other designs; the first one of equals."""
        # As many designs are compared at a time as are kept, so that each is compared only a few
        # times in a long front.
        self._waiting.append(designs)
        many = sum(places.size for _, places, _ in self._waiting)
        if self.asked.number or many >= max(AT_ONCE, self._kept[1].size):
            self._compare()

    def _compare(self) -> None:
        """Keep the best of the kept and waiting designs."""
        if not self._waiting:
            return
        every = [*([self._kept] if self._kept[1].size else []), *self._waiting]
        values = np.hstack([values for values, _, _ in every])
        places = np.concatenate([places for _, places, _ in every])
        names = every[0][2]
        rows = {name: np.concatenate([rows[name] for _, _, rows in every]) for name in names}
        order = np.argsort(places)
        if self.asked.number:
            best = np.argsort(values[0, order], kind="stable")[: self.asked.number]
        else:
            best = front_of(*values[:, order])
        kept = order[best]
        rows = {name: array[kept] for name, array in rows.items()}
        self._kept, self._waiting = (values[:, kept], places[kept], rows), []

    def state(self) -> dict[str, npt.NDArray[Any]]:
        """All that is known, for `merge`."""
        self._compare()
        values, places, rows = self._kept
        rows = {f"row {name}": array for name, array in rows.items()}
        return {
            "values": values, "places": places, "counted": self.counted,
            "nearest": self.nearest, **rows,
        }  # fmt: skip

    def merge(self, state: Mapping[str, npt.NDArray[Any]]) -> None:
        """Add the designs of another part."""
        rows = {k.removeprefix("row "): v for k, v in state.items() if k.startswith("row ")}
        if state["places"].size:
            self._keep(state["values"], state["places"], rows)
        self.counted = self.counted + state["counted"]
        self.nearest = np.minimum(self.nearest, state["nearest"])

    def text(self, points: int) -> str:
        """How many designs fulfil the conditions, or why none does.

        `points` were computed, at all values of all axes: fewer than in the whole scene in a shard.
        """
        whole, many = self.whole, len(self.conditions)
        whole.designs = math.prod(self.sizes) * points // self.points
        whole.fulfilling, whole.unsolved, whole.without = map(int, self.counted[:3])
        whole.alone = [int(n) for n in self.counted[3 : 3 + many]]
        left_out = map(int, self.counted[3 + many :])
        whole.left_out = dict(zip(whole.codes, left_out, strict=True))
        whole.nearest = [float(n) for n in self.nearest]
        return whole.text() if whole.fulfilling else whole.nothing()


def _rows_of(designs: xr.Dataset, at: Mapping[str, Integers], count: int) -> Rows:
    """Values of some designs, with the design as first axis."""
    rows = {}
    for name, variable in designs.variables.items():
        own = [d for d in variable.dims if d in at]
        if name in designs.sizes and not own:  # A coordinate that all designs share
            continue
        values = variable.transpose(*own, ...).values
        shape = (count, *values.shape[len(own) :])
        rows[str(name)] = np.broadcast_to(values[tuple(at[str(d)] for d in own)], shape)
    return rows
