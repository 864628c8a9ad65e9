"""What an archive holds beside its results: the scene, and all files that the scene names.

It is read without xarray, and without any file but the archive.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from engine_dyn.quantities.graph import PARAMETERS
from sweeps.archive.provenance import check_identity, files_from_text
from sweeps.checks import shortened
from sweeps.dimensions import DESIGN, LABELS
from sweeps.errors import SceneError, one_line
from sweeps.planning.plan import Plan, make_plan
from sweeps.planning.shards import part
from sweeps.reading.netcdf_files import opened_archive
from sweeps.scene.model import Scene
from sweeps.scene.reading import scene_of

__all__ = ["Held", "held", "part_of", "plan_of", "sound"]

MOST = 10**9
"""Positions along an axis of which an archive may claim to be a part."""

_NEEDED = ("scene", "scene_name", "input_files", "identity")


@dataclass(frozen=True)
class Held:
    """What an archive says about the run that made it.

    Attributes
    ----------
    path : Path
        The archive.
    attributes : mapping
        Its own attributes.
    source : dict
        The scene as it was read; of very long lists their number of values.
    folder : str
        Where paths of the scene start from.
    files : dict of bytes
        The files that it names.
    identity : dict
        See `sweeps.archive.provenance`.
    piece : dict
        Which part of the scene the archive is; empty for the whole.
    values : dict
        Values along each dimension, columns and labels of designs.
    along : dict of str
        The dimension of each of them.
    level : int
        Of its compression.
    """

    path: Path
    attributes: Mapping[str, Any]
    source: dict[str, Any]
    folder: str
    files: dict[str, bytes]
    identity: dict[str, Any]
    piece: dict[str, Any]
    values: dict[str, Any]
    along: dict[str, str]
    level: int

    @property
    def single(self) -> bool:
        """Whether results are kept in 32 bits."""
        return bool(self.identity.get("numbers") == "float32")


@contextmanager
def sound(path: Path) -> Iterator[None]:
    """Word the failures of reading what an archive holds: it may be damaged, or of other hands.

    Raises
    ------
    SceneError
        For them all.
    """
    try:
        yield
    except SceneError:
        raise
    except (
        ValueError, LookupError, TypeError, AttributeError, OverflowError, RecursionError,
        RuntimeError, OSError,
    ) as error:  # fmt: skip
        raise SceneError(
            f"{path}: what it holds of its scene is damaged ({one_line(error, 200)})"
        ) from error


def held(path: Path) -> Held:
    """Read what an archive holds beside its results.

    Raises
    ------
    SceneError
        Where it is no archive that `run` wrote, or an older one that holds less.
    """
    with sound(path), opened_archive(path) as file:
        attributes = {name: file.getncattr(name) for name in file.ncattrs()}
        missing = [name for name in _NEEDED if name not in attributes]
        if missing:
            raise SceneError(
                f"{path}: not an archive that this version's `run` wrote (no attribute "
                f"'{missing[0]}')"
            )
        coordinates = {
            name: variable
            for name, variable in file.variables.items()
            if variable.dimensions == (name,)
            or (variable.dimensions == (DESIGN,) and _is_column(name))
        }
        values = {name: variable[...] for name, variable in coordinates.items()}
        along = {name: variable.dimensions[0] for name, variable in coordinates.items()}
        filters = [variable.filters() or {} for variable in file.variables.values()]
        level = max((f["complevel"] for f in filters if f.get("zlib")), default=0)
    with sound(path):
        piece = json.loads(attributes.get("part", "{}"))
        _check_piece(piece, along, values)
        folder, files = files_from_text(attributes["input_files"])
        known = json.loads(attributes["identity"])
        check_identity(known)
        source = json.loads(attributes["scene"])
        if not isinstance(source, dict) or not isinstance(source.get("axes", {}), dict):
            raise ValueError("scene: no tables")
        return Held(path, attributes, source, folder, files, known, piece, values, along, level)


def plan_of(
    archive: Held, *, axis: str = "", values: Any = None, whole: Mapping[str, Any] | None = None
) -> Plan:
    """Plan of the scene that an archive holds, which reads no other file.

    Parameters
    ----------
    archive : Held
        Where the scene is held.
    axis, values
        An axis that has other values.
    whole : mapping, optional
        Values of axes, columns of designs and labels instead of the archive's own: a shard has but
        its part of them.

    Raises
    ------
    SceneError
        As `read_scene`; where the archive is a shard that does not hold all values.
    """
    with sound(archive.path):
        return _plan_of(archive, axis, values, whole)


def _plan_of(archive: Held, axis: str, values: Any, whole: Mapping[str, Any] | None) -> Plan:
    known = archive.values if whole is None else whole
    raw = json.loads(json.dumps(archive.source))
    cut = "" if whole is not None else archive.piece.get("axis", "")

    def filled(table: str, key: str) -> Any:
        if cut == (DESIGN if table == "designs" else key):
            raise SceneError(
                f"{archive.path}: a shard, which holds its own values of {key} only; merge all "
                "shards first"
            )
        return np.asarray(known[key])

    for key, item in raw.get("axes", {}).items():
        if isinstance(item, str):  # a long list, told by its number of values
            raw["axes"][key] = filled("axes", key)
    designs = raw.get("designs", {})
    if "file" in designs:
        columns = [k for k in known if _is_column(k) and k not in raw.get("axes", {})]
        designs = raw["designs"] = dict.fromkeys(columns, "in the archive")
    for key, item in designs.items():
        if isinstance(item, str):
            found = filled("designs", key)
            designs[key] = [str(t) for t in found] if key in LABELS else found
    source = archive.source
    if axis:
        raw["axes"][axis] = values
        listed = shortened([float(value) for value in values])
        source = {**source, "axes": {**source["axes"], axis: listed}}
    name = str(archive.attributes["scene_name"])
    scene: Scene = scene_of(raw, name, Path(archive.folder), Path(name), archive.files)
    scene = replace(scene, source=source)
    return make_plan(scene)


def _check_piece(piece: Any, along: Mapping[str, str], values: Mapping[str, Any]) -> None:
    """Check that an archive says of which part of its scene it is, where it is one."""
    if not isinstance(piece, dict):
        raise ValueError("part: no table")
    if "shard" not in piece:
        return
    first, size, axis = piece["first"], piece["of"], piece["axis"]
    if not (isinstance(first, int) and isinstance(size, int) and isinstance(piece["shard"], str)):
        raise ValueError("part: no numbers")
    if first < 0 or along.get(axis) != axis or not first + len(values[axis]) <= size <= MOST:
        raise ValueError("part: it does not fit its axis")


def _is_column(name: str) -> bool:
    return name in PARAMETERS or name in LABELS


def part_of(archive: Held, plan: Plan) -> Plan:
    """Return the part of a plan that an archive is; the plan itself where it is the whole."""
    if not archive.piece:
        return plan
    with sound(archive.path):
        axis, first = archive.piece["axis"], int(archive.piece["first"])
        places = np.arange(first, first + len(archive.values[axis]))
        return part(plan, axis, places, archive.attributes["part"])
