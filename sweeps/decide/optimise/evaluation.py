"""Designs of a search: each is computed once, judged, and kept for the archive."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from engine_dyn.status import MEANINGS, TORQUE_NOT_REACHED
from engine_dyn.types import Booleans, Floats, Integers
from sweeps.base.dimensions import DESIGN, GENERATION, RESTART, words_of
from sweeps.base.errors import SceneError, counted, shown
from sweeps.base.naming import named
from sweeps.decide.optimise.space import Space
from sweeps.decide.optimise.task import Task
from sweeps.running.archive.labels import dataset_with_warnings, describe, label
from sweeps.running.compute.in_memory import compute
from sweeps.running.reduce.every_point import EveryPoint
from sweeps.scene.plan.blocks import check_memory
from sweeps.scene.plan.plan import Plan

if TYPE_CHECKING:
    import xarray as xr

MOST_MEMORY = 0.7  # Share of the free memory that results may take when they become one archive

Columns = Mapping[str, Any]


@dataclass(frozen=True)
class Judgement:
    """Judgement of some designs."""

    # Worst value of each wanted quantity, times -1 where more is wanted; 0 where a design has no
    # value; shape (designs, names)
    wanted: Floats
    # Amount by which each condition fails, in multiples of its limit; 0 or less where the condition
    # holds. The last column is for missing results; shape (designs, conditions + 1)
    violation: Floats
    fulfilling: Booleans  # Whether all conditions hold at every point of the axes that counts

    def __getitem__(self, places: npt.NDArray[Any]) -> Judgement:
        return Judgement(self.wanted[places], self.violation[places], self.fulfilling[places])


class Designs:
    """All designs that a search has computed, each once.

    The `space` says what positions mean; it is the task's own, or less where `completed` takes its
    columns and returns those of the task.
    """

    def __init__(
        self, task: Task, space: Space, completed: Callable[[Columns], dict[str, Any]] | None,
        threads: int | None,
    ) -> None:  # fmt: skip
        self.task, self.space, self.completed, self.threads = task, space, completed, threads
        self.computing = 0.0
        self._places: dict[bytes, int] = {}
        self._columns: dict[str, list[Any]] = {key: [] for key in task.space.parameters}
        self._results: list[tuple[Plan, dict[str, npt.NDArray[Any]]]] = []
        self._wanted = np.empty((0, len(task.wanted)))
        self._violation = np.empty((0, len(task.conditions) + 1))
        self._fulfilling = np.empty(0, dtype=bool)
        self._marks: list[tuple[int, int, int]] = []

    def __len__(self) -> int:
        return len(self._places)

    @property
    def all(self) -> Judgement:
        """Judgement of all designs, in the order in which they were computed."""
        return Judgement(self._wanted, self._violation, self._fulfilling)

    @property
    def points(self) -> int:
        """Points at which every design is computed."""
        plan = self._results[0][0]
        return plan.designs // plan.sizes[DESIGN]

    def at(self, positions: Floats, restart: int, generation: int) -> Integers:
        """Places of the designs at some positions; those that are new are computed."""
        columns = self.space.columns(positions)
        keys = _keys(self.space, columns)
        first: dict[bytes, int] = {}
        for number, key in enumerate(keys):
            if key not in self._places:
                first.setdefault(key, number)
        if first:
            new = np.array(list(first.values()))
            some = {
                k: [v[i] for i in new] if isinstance(v, list) else v[new]
                for k, v in columns.items()
            }
            self._compute(some if self.completed is None else self.completed(some), len(new))
            self._marks.append((len(new), restart, generation))
            for key in first:
                self._places[key] = len(self._places)
        return np.array([self._places[key] for key in keys], dtype=np.int64)

    def _compute(self, columns: Columns, count: int) -> None:
        plan = self.task.plan(columns, count)
        began = time.perf_counter()
        results = compute(plan, threads=self.threads)
        self.computing += time.perf_counter() - began
        data = {
            name: values if values.dtype.kind in "iu" else values / plan.computed[name].node.si
            for name, values in results.items()
        }
        judged = _judged(self.task, plan, data, columns)
        self._wanted = np.concatenate([self._wanted, judged.wanted])
        self._violation = np.concatenate([self._violation, judged.violation])
        self._fulfilling = np.concatenate([self._fulfilling, judged.fulfilling])
        self._results.append((plan, data))
        for key, kept in self._columns.items():
            kept.append(columns[key])

    def check_hold(self) -> None:
        """Refuse a torque to hold that no design reaches, of those computed so far.

        Designs that do not reach it have no results, from which a search could learn nothing.
        """
        import xarray as xr

        task, lacking = self.task, self._violation[:, -1] > 0.0
        left_out = MEANINGS[TORQUE_NOT_REACHED] in task.not_counted
        if left_out or not lacking.all() or "held" not in self._results[0][0].scene.words:
            return
        plan = task.plan(self.columns(), len(self), ("torque_to_hold", "torque_missing"))
        found = label(plan, compute(plan, threads=self.threads), seconds=0.0)
        missing = abs(found["torque_missing"])
        largest = missing.max([d for d in missing.dims if d != DESIGN])  # At the worst point
        if not (largest > 0.0).all():
            return
        one = (
            found.isel({DESIGN: int(largest.values.argmin())}) if DESIGN in largest.dims else found
        )
        lacks, wanted = xr.broadcast(one["torque_missing"], one["torque_to_hold"])
        at = np.unravel_index(int(abs(lacks).values.argmax()), lacks.shape)
        most, held = float(lacks.values[at]), float(wanted.values[at])
        words = words_of(found)
        place = ", ".join(
            f"{d} = {shown(one[words.get(str(d), str(d))].values[i])}"
            for d, i in zip(lacks.dims, at, strict=True)
        )
        raise SceneError(
            f"{MEANINGS[TORQUE_NOT_REACHED]}: none of {counted(len(self), 'design')} holds its "
            f"torque: of the one that comes nearest, the {'largest' if most > 0.0 else 'smallest'} "
            f"torque{f' at {place}' if place else ''} is {held - most:.4g} N m, and {held:.4g} N m "
            "is to be held; give another load or torque, or leave such points out "
            f"(--not-counted {MEANINGS[TORQUE_NOT_REACHED]}, not_counted)"
        )

    def check_memory(self, most: int) -> None:
        """Refuse, with the size and what is free, a search whose designs do not fit into memory."""
        few = self.space.one_of_each()
        columns = self.space.columns(few)
        if self.completed is not None:
            columns = self.completed(columns)
        need = 2.0 * most * self.task.plan(columns, len(few)).output_bytes / len(few)
        advice = (
            "; search fewer designs, generations or restarts, or request fewer quantities or axes"
        )
        check_memory(f"{self.task.given.name}: {most} designs", need, advice, MOST_MEMORY)

    def columns(self) -> dict[str, Any]:
        """Values of all designs, by the keys of what is searched."""
        columns: dict[str, Any] = {}
        for key, parts in self._columns.items():
            if isinstance(parts[0], list):
                columns[key] = [text for part in parts for text in part]
            else:
                columns[key] = np.concatenate(parts)
        return columns

    def archive(self, seconds: float) -> xr.Dataset:
        """The archive of all designs; their results leave this object."""
        import xarray as xr

        plan = self.task.plan(self.columns(), len(self))
        labels = describe(plan, seconds=seconds)
        data = {
            name: _joined([r.pop(name) for _, r in self._results], one.dims, labels.shape(name))
            for name, one in labels.variables.items()
            if one.data is None
        }
        dataset = dataset_with_warnings(labels, data)
        counts = [count for count, _, _ in self._marks]
        about = {
            RESTART: "restart of the search in which the design was computed, from 1",
            GENERATION: "generation of the search in which the design was computed, from 1",
        }
        for number, name in enumerate((RESTART, GENERATION), start=1):
            values = np.repeat([mark[number] for mark in self._marks], counts).astype(np.int32)
            attributes = {**named(name, about[name]), "units": "1"}
            dataset = dataset.assign_coords({name: xr.Variable((DESIGN,), values, attributes)})
        return dataset


def _keys(space: Space, columns: Columns) -> list[bytes]:
    """Keys of designs; equal designs have equal keys."""
    rows = [_numbers(space, key, values) for key, values in columns.items()]
    if not rows:
        return [b""]
    table = np.ascontiguousarray(np.array(rows, dtype=np.float64).T)
    return [row.tobytes() for row in table]


def _numbers(space: Space, key: str, values: Any) -> Any:
    if not isinstance(values, list):
        return values
    places = {text: place for place, text in enumerate(space.tables[key])}
    return [places[text] for text in values]


def _judged(
    task: Task, plan: Plan, data: Mapping[str, npt.NDArray[Any]], columns: Columns
) -> Judgement:
    """Judge designs: worst values over all points, and amounts by which conditions fail."""
    import xarray as xr

    names = [n for n in (*task.names, "status") if n in data]
    variables = {n: xr.Variable(plan.dims(n), data[n]) for n in names}
    coordinates = {
        key: xr.Variable((DESIGN,), np.asarray(columns[key]))
        for key in task.names if key in columns
    }  # fmt: skip
    dataset = xr.Dataset(variables, coordinates)
    dims = {str(d) for v in variables.values() for d in v.dims}
    points = [d for d in task.points if d in dims]
    codes = task.not_counted if "status" in dataset else ()
    search = EveryPoint(dataset, task.wanted, task.conditions, points, codes)
    ((_, designs),) = search.judged()
    many = max(1, int(np.prod([search.sizes[d] for d in search.axes])))

    scale = np.array([abs(c.limit) or 1.0 for c in task.conditions])[:, None]
    excess = np.where(np.isfinite(designs.excess), designs.excess, 0.0) / scale
    holds = np.array(designs.holds, dtype=bool).reshape(excess.shape)
    # A design exactly at a limit that must not be reached violates the condition by a tiny amount.
    excess = np.where(~holds & ~(excess > 0.0), 1e-12, excess)
    # Results that are missing at all points count as a violation of a thousand limits, fewer in
    # proportion: a violated condition is better than a missing result.
    lacking = 1e3 * np.where(designs.points, designs.lacking / many, 1.0)
    wanted = np.where(np.isfinite(designs.worst), designs.worst, 0.0)
    return Judgement(
        wanted.T, np.vstack([excess, lacking[None, :]]).T, np.asarray(designs.fulfilling)
    )


def _joined(
    parts: list[npt.NDArray[Any]], dims: tuple[str, ...], shape: tuple[int, ...]
) -> npt.NDArray[Any]:
    """Results of all designs together; NaN for bearings that an engine does not have."""
    if DESIGN not in dims:
        return parts[0]
    along = dims.index(DESIGN)
    if all(p.shape[:along] + p.shape[along + 1 :] == shape[:along] + shape[along + 1 :]
           for p in parts):  # fmt: skip
        return np.concatenate(parts, axis=along)
    joined = np.full(shape, np.nan)
    begin = 0
    for part in parts:
        place = [slice(n) for n in part.shape]
        place[along] = slice(begin, begin + part.shape[along])
        joined[tuple(place)] = part
        begin += part.shape[along]
    return joined
