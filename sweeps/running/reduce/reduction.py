"""The results of [reduce], from blocks of designs as they are computed, from parts, from archives.

A `Reduction` takes blocks and other reductions in any order and division; what it knows are plain
arrays, which blocks on the disk and archives hold. `dataset` makes the archive of it.
"""

from __future__ import annotations

import io
import json
import math
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import numpy.typing as npt

from engine_dyn.plausibility.judgement import Implausible
from engine_dyn.status import MEANINGS, WITH_NUMBERS
from sweeps.base.dimensions import DESIGN, LABELS, PARAMETER, RANK, REDUCTION, STATE, STATUS
from sweeps.base.errors import SceneError, counted
from sweeps.base.naming import made_from, meaning_of, named, renamed
from sweeps.running.archive.labels import Labels, Variable, as_stored, dataset_of, describe
from sweeps.running.archive.warnings import ATTRIBUTE
from sweeps.running.reduce.indices import NAMES, Indices
from sweeps.running.reduce.searches import Search
from sweeps.running.reduce.statistics import Statistics
from sweeps.scene.conditions import check_name, conditions_of, units_of
from sweeps.scene.plan.blocks import Block, Results, aligned, index_of
from sweeps.scene.plan.plan import Plan

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["STATE", "Reduction", "State", "state_in"]


State = dict[str, npt.NDArray[Any]]


class Reduction:
    """Sums, counts and kept designs of all blocks that were added so far.

    Parameters
    ----------
    plan : Plan
        Of a scene with [reduce]; a shard, or the first portion of a sample.
    labels : Labels
        Of the same plan.

    Raises
    ------
    SceneError
        For conditions and searches that the scene has no answer to.
    """

    def __init__(self, plan: Plan, labels: Labels | None = None) -> None:
        asked = plan.scene.reduce
        assert asked is not None
        self.plan, self.asked = plan, asked
        self.labels = describe(plan) if labels is None else labels
        self.whole = plan.whole or plan
        self.sizes = {d: self.whole.sizes[d] for d in self.whole.scene.dimensions}
        if DESIGN in self.sizes:
            self.sizes[DESIGN] *= len(self.whole.portions)
        self.origin: dict[str, int] = {}
        if plan.piece:
            piece = json.loads(plan.piece)
            self.origin[piece["axis"]] = int(piece["first"])
        self.left = [d for d in self.sizes if d not in asked.over]
        example = self._designs(plan, {}, {})
        # Numbers stand for words in these arrays. Coordinates of texts mark their axes, so that
        # conditions on them are refused.
        of_words = {d for d in example.dims if f"{d}_name" in self.labels.coordinates}
        example = example.assign_coords(
            {f"{d}_name": ((d,), np.full(example.sizes[d], "")) for d in of_words}
        )
        try:
            self.searches = [Search(one, example, asked.at_every, self.sizes) for one in asked.kept]
            self.conditions = conditions_of(list(asked.within), units_of(example))
            for condition in self.conditions:
                check_name(example, condition.name)
        except SceneError as error:
            raise SceneError(f"{plan.name}: [reduce]: {error}") from None
        self.cells = {
            name: [d for d in self.left if d in plan.dims(name)] for name in asked.statistics
        }
        self.statistics = {
            name: Statistics([self.sizes[d] for d in cells]) for name, cells in self.cells.items()
        }
        # A variance over further axes would not be due to the sampled parameters alone: such
        # quantities have no indices.
        sample = plan.scene.sample
        self.indices = {
            name: Indices(sample, one.shape)
            for name, one in self.statistics.items()
            if sample is not None and sample.method == "saltelli"
            and {*plan.dims(name)} == {*self.cells[name], DESIGN} and DESIGN in asked.over
        }  # fmt: skip
        shape = [self.sizes[d] for d in self.left]
        self.outcomes = np.zeros((*shape, len(MEANINGS)), np.int64)
        self.within = np.zeros((*shape, len(self.conditions) + 1), np.int64)

    # --- adding -------------------------------------------------------------------------------

    def add(self, plan: Plan, first: int, block: Block, results: Results) -> None:
        """Add a block of the plan or of one of its portions, which begins at design `first`.

        `results` are in SI units, all of the block's, also those that other blocks have too.
        """
        begin = {d: self.origin.get(d, 0) + (block[d].start if d in block else 0)
                 for d in self.sizes}  # fmt: skip
        if DESIGN in begin and len(self.whole.portions) > 1:
            begin[DESIGN] = first + (block[DESIGN].start if DESIGN in block else 0)
        stored = as_stored(self.labels, results)
        designs = self._designs(plan, block, stored)
        for search in self.searches:
            search.add(designs, begin)
        for name, statistics in self.statistics.items():
            dims, cells = plan.dims(name), self.cells[name]
            if any(place for d, place in begin.items() if d not in dims):
                continue  # Another block adds the same values
            values = designs[name].variable.transpose(*cells, ...).values
            places = _places(cells, begin, values.shape)
            statistics.add(values, places)
            if name in self.indices:
                if STATUS in designs and {*designs[STATUS].dims} <= {*dims}:
                    status = _over(designs[STATUS].variable, cells, [DESIGN])
                    values = np.where(np.isin(status, WITH_NUMBERS), values, np.nan)
                self.indices[name].add(values, places, begin[DESIGN])
        self._count(designs, begin)

    def _count(self, designs: xr.Dataset, begin: Mapping[str, int]) -> None:
        """Count outcomes, and the designs that fulfil conditions."""
        sizes = [designs.sizes[d] for d in self.left]
        over = [d for d in self.sizes if d not in self.left]
        place = _places(self.left, begin, sizes)
        shape = (*sizes, *(designs.sizes[d] for d in over))
        solved = np.ones(shape, bool)
        last = tuple(range(len(sizes), len(shape)))
        if STATUS in designs:
            status = np.broadcast_to(_over(designs[STATUS].variable, self.left, over), shape)
            solved &= np.isin(status, WITH_NUMBERS)
            for code in np.unique(status):
                self.outcomes[..., code][place] += np.count_nonzero(status == code, axis=last)
        good = solved.copy()
        for number, condition in enumerate(self.conditions):
            values = _over(designs[condition.name].variable, self.left, over)
            holds = condition.holds(np.broadcast_to(values, shape)) & solved
            good &= holds
            self.within[..., number][place] += np.count_nonzero(holds, axis=last)
        self.within[..., -1][place] += np.count_nonzero(good, axis=last)

    def _designs(self, plan: Plan, block: Block, stored: Results) -> xr.Dataset:
        """Designs of a block with their labels; without results, an example of all."""
        import xarray as xr

        scene = plan.scene
        coordinates: dict[str, Any] = {}
        for name in scene.dimensions:
            if name == DESIGN:
                coordinates |= {key: ((DESIGN,), column) for key, column in scene.designs.items()}
                continue
            values: Any = scene.axes[name]
            if isinstance(values, tuple):
                values = np.arange(len(values))
            coordinates[name] = ((name,), np.asarray(values))
        inside = {
            name: xr.Variable(dims, data[index_of(dims, block)], self._about(name))
            for name, (dims, data) in coordinates.items()
        }
        for name in plan.outputs:
            dims = plan.dims(name)
            if stored:
                data = stored[name]
            else:
                kind = self.labels.variables[name].kind
                data = np.broadcast_to(np.zeros((), kind), [plan.sizes[d] for d in dims])
            inside[name] = xr.Variable(dims, data, self._about(name), fastpath=True)
        designs = xr.Dataset({n: v for n, v in inside.items() if n in plan.outputs})
        return designs.assign_coords({n: v for n, v in inside.items() if n not in plan.outputs})

    def _about(self, name: str) -> Mapping[str, Any]:
        known = self.labels.variables.get(name) or self.labels.coordinates.get(name)
        return {} if known is None else known.attributes

    # --- joining what parts of a run know -----------------------------------------------------

    def state(self) -> State:
        """All that is known, for `merge`."""
        arrays: State = {"outcomes": self.outcomes, "within": self.within}
        for name, one in self._parts.items():
            arrays |= {f"{name}: {key}": array for key, array in one.state().items()}
        return arrays

    def merge(self, state: Mapping[str, npt.NDArray[Any]]) -> None:
        """Add what another part knows.

        Raises
        ------
        KeyError, ValueError, IndexError
            For what is no state of this plan.
        """
        # Earlier versions knew fewer outcomes
        counts = state["outcomes"].reshape(*self.outcomes.shape[:-1], -1)
        self.outcomes = self.outcomes.copy()
        self.outcomes[..., : counts.shape[-1]] += counts
        self.within = self.within + state["within"].reshape(self.within.shape)
        for name, one in self._parts.items():
            begin = f"{name}: "
            one.merge({k.removeprefix(begin): v for k, v in state.items() if k.startswith(begin)})

    @property
    def _parts(self) -> dict[str, Search | Statistics | Indices]:
        searches = {f"search {n}": one for n, one in enumerate(self.searches)}
        indices = {f"indices of {k}": one for k, one in self.indices.items()}
        values = {f"values of {k}": one for k, one in self.statistics.items()}
        return {**searches, **indices, **values}

    # --- the archive --------------------------------------------------------------------------

    def dataset(self, seconds: float | None = None) -> xr.Dataset:
        """All that was asked for, with labels, units and provenance."""
        variables: dict[str, Variable] = {}
        coordinates: dict[str, Variable] = {}
        for name in {*self.left, *self.asked.at_every}:
            values = self.whole.scene.axes[name]
            about = self.labels.coordinates
            words = about.get(f"{name}_name")
            if isinstance(values, tuple):
                coordinates[name] = replace(about[name], data=np.arange(len(values), dtype="i4"))
                assert words is not None
                coordinates[f"{name}_name"] = replace(words, data=np.array(values, dtype=object))
            else:
                coordinates[name] = replace(about[name], data=np.asarray(values))
        self._add_statistics(variables, coordinates)
        self._add_indices(variables, coordinates)
        self._add_counts(variables, coordinates)
        self._add_kept(variables, coordinates)
        stream = io.BytesIO()
        np.savez(stream, **cast(Any, self.state()))
        variables[STATE] = Variable(
            ("state_byte",), {"long_name": "what merging needs", "units": "1"},
            np.frombuffer(stream.getvalue(), np.int8),
        )  # fmt: skip
        dataset = dataset_of(replace(self.labels, variables=variables, coordinates=coordinates), {})
        for one in dataset.variables.values():
            one.encoding["_FillValue"] = None
        dataset.attrs |= {
            REDUCTION: json.dumps(self._described()), ATTRIBUTE: "\n".join(self.warnings),
        }  # fmt: skip
        if seconds is not None:
            dataset.attrs["seconds"] = round(seconds, 3)
        return dataset

    @property
    def found(self) -> tuple[str, ...]:
        """Results of the searches, a line each."""
        return tuple(f"{one.asked}: {one.text(self.points)}" for one in self.searches)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Plausibility warnings: of what is given in the first portion, and of all results."""
        lines = list(self.labels.warnings)
        for name, check in self.labels.watched.items():
            if name in self.statistics:
                one = self.statistics[name]
                size = int(one.counts.sum())
                for value in (one.low.min(), one.high.max()):
                    if size and not check.low <= value <= check.high:
                        implausible = Implausible(check, float(value), (), "", name, 1, size)
                        lines.append(implausible.text(f"the worst of {counted(size, 'value')}"))
        return tuple(lines)

    def write(self, path: Path, seconds: float | None = None) -> None:
        """Write the archive."""
        path.unlink(missing_ok=True)
        self.dataset(seconds).to_netcdf(path, format="NETCDF4", engine="netcdf4")

    def _described(self) -> dict[str, Any]:
        """The request in the words of the archive."""
        return {
            "designs": self.points // math.prod(self.sizes[d] for d in self.asked.at_every),
            "points": self.points,
            "at_every": self.asked.at_every,
            "over": self.asked.over,
            "indices": {name: one.batches for name, one in self.indices.items()},
            "left": self.left,
            "quantities": self.plan.outputs,
            "statistics": self.asked.statistics,
            "kept": [
                {
                    "asked": str(one.asked), "wanted": one.asked.wanted, "number": one.asked.number,
                    "within": [str(c) for c in one.conditions],
                    "not_counted": one.asked.not_counted, "found": int(one.places.size),
                    "text": one.text(self.points),
                }
                for one in self.searches
            ],
        }  # fmt: skip

    @property
    def points(self) -> int:
        """Points that were added: designs, each at all values of the axes of `at_every`."""
        return int(self.outcomes.sum()) or self.plan.designs

    def _add_statistics(
        self, variables: dict[str, Variable], coordinates: dict[str, Variable]
    ) -> None:
        shares = np.array(self.asked.quantiles)
        texts = {
            "mean": "mean of the {}",
            "deviation": "standard deviation of the {}",
            "smallest": "smallest {}",
            "largest": "largest {}",
            "count": "number of values of the {}",
            "quantile": "quantile of the {}",
            "quantile_error": "largest error of the quantile of the {}",
        }
        for name, statistics in self.statistics.items():
            label = self.labels.variables[name].attributes
            for key, data in statistics.results(self.asked.quantiles).items():
                about = renamed(label, texts[key])
                about.pop("symbol", None)
                if key == "count":
                    about["units"] = "1"
                dims = (*self.cells[name], *(("quantile",) if key.startswith("quantile") else ()))
                variables[f"{name}_{key}"] = Variable(dims, about, data)
            self._add_histogram(name, variables, coordinates)
        if self.statistics:
            about = {**named("quantile", "share of the values that are below"), "units": "1"}
            coordinates["quantile"] = Variable(("quantile",), about, shares)

    def _add_indices(
        self, variables: dict[str, Variable], coordinates: dict[str, Variable]
    ) -> None:
        for name, one in self.indices.items():
            label, cells = self.labels.variables[name].attributes, (*self.cells[name],)
            ending, said = "", ""
            if one.conditional:
                ending, said = "_conditional", ", only designs with results"
            for key, data in one.results().items():
                about = made_from(label, f"{NAMES[key]} of the {{}}{said}")
                variables[f"{name}_{key}{ending}"] = Variable((*cells, PARAMETER), about, data)
            for key, counts, words in (
                ("left_out", one.lacking, "designs without a number"),
                ("groups_left_out", one.dropped, "groups of designs left out of the indices"),
            ):
                about = made_from(label, f"{words} of the {{}}")
                variables[f"{name}_{key}"] = Variable(cells, about, counts.reshape(one.shape))
            keys = [*one.sample.parameters]
            meanings = [meaning_of(self._about(key), key) for key in keys]
            for key, texts in ((PARAMETER, keys), (f"{PARAMETER}_long_name", meanings)):
                about = {"long_name": key.replace("_", " "), "units": "1"}
                coordinates[key] = Variable((PARAMETER,), about, np.array(texts, dtype=object))

    def _add_histogram(
        self, name: str, variables: dict[str, Variable], coordinates: dict[str, Variable]
    ) -> None:
        """Add the number of values of a quantity in each bin; nothing without any values."""
        edges, counts = self.statistics[name].histogram()
        if not edges.size:
            return
        label = self.labels.variables[name].attributes
        along = f"{name}_bin"
        told = made_from(label, "number of values of the {} in each bin")
        dims = (*self.cells[name], along)
        variables[f"{name}_histogram"] = Variable(dims, told, counts)
        coordinates[along] = Variable((along,), label, 0.5 * (edges[:-1] + edges[1:]))
        for ending, data, word in (("low", edges[:-1], "lower"), ("high", edges[1:], "upper")):
            about = renamed(label, f"{word} end of a bin of the {{}}")
            about.pop("symbol", None)
            coordinates[f"{along}_{ending}"] = Variable((along,), about, data)

    def _add_counts(self, variables: dict[str, Variable], coordinates: dict[str, Variable]) -> None:
        left = tuple(self.left)
        what = "points (a design at one value of at_every)" if self.asked.at_every else "designs"
        if self.outcomes.any():
            used = np.flatnonzero(self.outcomes.reshape(-1, len(MEANINGS)).any(axis=0))
            about = {**named("outcomes", f"number of {what} of each outcome"), "units": "1"}
            variables["outcomes"] = Variable((*left, "outcome"), about, self.outcomes[..., used])
            words = np.array([MEANINGS[code] for code in used], dtype=object)
            coordinates["outcome"] = Variable(
                ("outcome",), {"long_name": "outcome", "units": "1"}, words
            )
        if self.conditions:
            texts = [str(c) for c in self.conditions]
            texts += ["all conditions"] if len(texts) > 1 else []
            told = f"number of {what} that fulfil each condition"
            about = {**named("designs_within", told), "units": "1"}
            counts = self.within[..., : len(texts)]
            variables["designs_within"] = Variable((*left, "condition"), about, counts)
            coordinates["condition"] = Variable(
                ("condition",), {"long_name": "condition", "units": "1"},
                np.array(texts, dtype=object),
            )  # fmt: skip

    def _add_kept(self, variables: dict[str, Variable], coordinates: dict[str, Variable]) -> None:
        """Designs that searches keep, each once, in the order of the scene."""
        places = np.unique(np.concatenate([[], *(one.places for one in self.searches)]))
        if not places.size:
            return
        rank = np.zeros((len(self.searches), places.size), np.int32)
        rows: dict[str, Any] = {}
        for number, search in enumerate(self.searches):
            here = np.searchsorted(places, search.places)
            rank[number, here] = np.arange(1, here.size + 1)
            for name, values in search.rows.items():
                if name not in rows:
                    rows[name] = np.empty((places.size, *values.shape[1:]), values.dtype)
                rows[name][here] = values
        for name, values in rows.items():
            known = self.labels.variables.get(name)
            own = () if known is None else known.dims
            dims = (DESIGN, *(d for d in own if d in self.asked.at_every))
            target, words = variables, None
            if known is None:
                target, words = coordinates, self.labels.coordinates.get(f"{name}_name")
            if words is not None:
                texts = np.array(self.whole.scene.axes[name], dtype=object)
                about = {**words.attributes}
                coordinates[f"{name}_name"] = Variable(dims, about, texts[values.astype(int)])
            target[name] = Variable(dims, self._about(name), values)
        self._name_cases(places, coordinates)
        about = {**named(DESIGN, "number of the design in the whole scene"), "units": "1"}
        coordinates[DESIGN] = Variable((DESIGN,), about, places.astype(np.int64))
        variables[RANK] = Variable(
            ("search", DESIGN),
            {**named(RANK, "rank by each search, 0 for none"), "units": "1"},
            rank,
        )
        texts = np.array([str(one.asked) for one in self.searches], dtype=object)
        coordinates["search"] = Variable(("search",), {"long_name": "search", "units": "1"}, texts)

    def _name_cases(self, places: npt.NDArray[Any], coordinates: dict[str, Variable]) -> None:
        """Add the names that a table gives its designs."""
        names = self.whole.scene.labels.get(LABELS[0])
        own = [d for d in self.sizes if d not in self.asked.at_every]
        if names is None or DESIGN not in own:
            return
        at = np.unravel_index(places.astype(int), [self.sizes[d] for d in own])[own.index(DESIGN)]
        about = {"long_name": "name of the design", "units": "1"}
        texts = np.array(names, dtype=object)[at]
        coordinates[LABELS[0]] = Variable((DESIGN,), about, texts)


def _places(
    dims: Sequence[str], begin: Mapping[str, int], shape: Sequence[int]
) -> tuple[slice, ...]:
    """Range of cells in which a block lies."""
    return tuple(slice(begin[d], begin[d] + n) for d, n in zip(dims, shape, strict=False))


def _over(variable: xr.Variable, left: Sequence[str], over: Sequence[str]) -> npt.NDArray[Any]:
    """Values with one axis for each of some dimensions, of size 1 where they do not vary."""
    dims = [d for d in (*left, *over) if d in variable.dims]
    return aligned(variable.transpose(*dims).values, tuple(dims), (*left, *over))


def state_in(archive: xr.Dataset, where: str) -> State:
    """The state of an archive for `Reduction.merge`; a damaged one is refused."""
    data = archive[STATE].values.tobytes()
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as file:
            if sum(one.file_size for one in file.infolist()) > len(data):
                raise ValueError("larger than its archive")
        with np.load(io.BytesIO(data), allow_pickle=False) as file:
            return dict(file)
    except (ValueError, OSError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise SceneError(f"{where}: {STATE} is damaged ({error})") from None
