"""Where the points of several archives of one scene lie in the joined archive.

No results are read. Archives are the shards of a scene, or differ in the values of one axis.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from engine_dyn.types import Floats, Integers
from sweeps.base.dimensions import DESIGN
from sweeps.base.errors import SceneError, counted
from sweeps.running.archive.contents import Contents, damage_refused, plan_of
from sweeps.running.archive.labels import Labels, describe
from sweeps.running.archive.provenance import differences, json_text
from sweeps.scene.plan.plan import Plan


@dataclass(frozen=True)
class Joined:
    """Archives of one scene, and where their points lie in the joined archive."""

    plan: Plan  # Plan of the joined archive
    axis: str  # Axis along which they are joined; empty where all have the same points
    archives: list[Contents]  # Archives that are joined
    places: list[Integers]  # Places of the points of each archive along the axis

    @property
    def shards(self) -> bool:
        """Whether the archives are shards of a scene."""
        return bool(self.archives[0].piece)

    def labels(self, command: str = "") -> Labels:
        """Labels of the joined archive: the history of all, and the versions of their numbers.

        `command` is the command line, for the archive.
        """
        first = self.archives[0]
        seconds = sum(a.attributes["seconds"] for a in self.archives)
        labels = describe(self.plan, seconds=seconds, command=command, single=first.single)
        made = str(labels.attributes["history"]).replace(" computed ", " joined ")
        before = [str(a.attributes.get("history", "")) for a in self.archives]
        history = "\n".join(dict.fromkeys([*"\n".join(before).splitlines(), made]))
        # Another version of the program may have computed the archives, and is kept as theirs.
        identity = json.loads(labels.attributes["identity"])
        identity["versions"] = first.identity["versions"]
        attributes = {"history": history, "identity": json_text(identity)}
        return replace(labels, attributes={**labels.attributes, **attributes})


def find_places(archives: list[Contents]) -> Joined:
    """Find out what belongs where in archives of one scene, version and kind, all complete."""
    first = archives[0]
    for one in archives:
        if "reduce" in one.source:
            raise SceneError(
                f"{one.path}: was reduced as it was computed; `engine-dyn merge` joins its shards"
            )
    for other in archives[1:]:
        if bool(other.piece) != bool(first.piece):
            raise SceneError(
                f"{other.path}: {'a shard' if other.piece else 'no shard'}, and {first.path} is "
                f"{'one' if first.piece else 'none'}; merge shards first"
            )
    with damage_refused(first.path):
        return _of_shards(archives) if first.piece else _of_axis(archives)


def _of_shards(archives: list[Contents]) -> Joined:
    first = archives[0]
    axis, size = first.piece["axis"], int(first.piece["of"])
    places = []
    for other in archives:
        check_same(first, other, shards=True)
        if other.piece["axis"] != axis or other.piece["of"] != size:
            raise SceneError(f"{other.path}: is a shard of a different division from {first.path}")
        begin = int(other.piece["first"])
        places.append(np.arange(begin, begin + len(other.values[axis])))
    missing = size - np.unique(np.concatenate(places)).size
    if missing:
        count = first.piece["shard"].partition("/")[2]
        given = ", ".join(sorted({a.piece["shard"] for a in archives}))
        raise SceneError(
            f"shards are missing: {counted(missing, 'point')} of {axis}; given are {given} of "
            f"{count} shards"
        )
    coordinates: dict[str, Any] = dict(first.values)
    for name, values in first.values.items():
        if first.dimension[name] == axis:
            joined = np.empty(size, dtype=values.dtype)
            for other, here in zip(archives, places, strict=True):
                joined[here] = other.values[name]
            coordinates[name] = joined
    plan = plan_of(first, coordinates=coordinates)
    _check_coordinates(plan, axis, archives, places)
    return Joined(plan, axis, archives, places)


def _check_coordinates(
    plan: Plan, axis: str, archives: Sequence[Contents], places: list[Integers]
) -> None:
    """Check that the coordinates of archives are those of the plan."""
    labels = describe(plan)
    for other, here in zip(archives, places, strict=True):
        for name, values in other.values.items():
            known = labels.coordinates.get(name)
            if known is None or known.data is None:
                continue
            expected = known.data[here] if known.dims == (axis,) else known.data
            if name == DESIGN == axis:  # A shard numbers its own designs
                continue
            if name == axis and known.data.dtype.kind == "i":  # A shard numbers its own words
                continue
            if not np.array_equal(values, expected):
                raise SceneError(f"{other.path}: values of {name} differ from those in its scene")


def _of_axis(archives: list[Contents]) -> Joined:
    first = archives[0]
    axes = list(first.source.get("axes", {}))
    differing = [
        axis
        for axis in axes
        if any(
            axis in other.values and not np.array_equal(other.values[axis], first.values[axis])
            for other in archives
        )
    ]
    if len(differing) > 1:
        raise SceneError(
            f"archives differ in more than one axis ({', '.join(differing)}); merge along one "
            "axis at a time"
        )
    axis = differing[0] if differing else next(iter(axes), "")
    for other in archives[1:]:
        check_same(first, other, axis=axis)
    if not axis:
        nowhere = [np.zeros(0, dtype=np.int64) for _ in archives]
        return Joined(plan_of(first), "", archives, nowhere)
    union = union_of([np.asarray(other.values[axis]) for other in archives])
    plan = plan_of(first, axis=axis, values=union) if differing else plan_of(first)
    places = [places_in(union, other.values[axis]) for other in archives]
    return Joined(plan, axis, archives, places)


def check_same(first: Contents, other: Contents, *, axis: str = "", shards: bool = False) -> None:
    """Check that two archives are of one scene, version and kind.

    They may differ in the values of `axis`, and `shards` in which part they are.
    """
    ignored = {"part"} if shards else set()
    one, two = (
        {key: value for key, value in a.identity.items() if key not in ignored}
        for a in (first, other)
    )
    unequal = differences(one, two, but=axis, words=(f"in {first.path}", f"in {other.path}"))
    if unequal:
        raise SceneError(
            f"{other.path}: its scene differs from that of {first.path}: {'; '.join(unequal)}"
        )


def union_of(values: Sequence[Floats]) -> Floats:
    """All values once: sorted where each sequence is, else in the order in which they come."""
    joined = np.concatenate(values)
    if all((np.diff(v) > 0).all() for v in values):
        return np.unique(joined)
    if all((np.diff(v) < 0).all() for v in values):
        return np.unique(joined)[::-1]
    _, index = np.unique(joined, return_index=True)
    return np.asarray(joined[np.sort(index)])


def places_in(union: Floats, values: Any) -> Integers:
    """Positions of values in an array that has each of them once."""
    order = np.argsort(union)
    return np.asarray(order[np.searchsorted(union, values, sorter=order)], dtype=np.int64)
