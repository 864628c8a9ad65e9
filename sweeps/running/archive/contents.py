"""Contents of an archive besides its results: the scene, and all files that the scene names.

It is read without xarray, and without any file but the archive.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any

import numpy as np

from engine_dyn.quantities.graph import PARAMETERS
from sweeps.base.checks import shortened
from sweeps.base.dimensions import DESIGN, LABELS, REDUCTION
from sweeps.base.errors import SceneError, one_line
from sweeps.base.files.regular_files import MOST_RECORDING, reading, regular_bytes
from sweeps.base.netcdf.netcdf_files import DAMAGE, check_format, opened_archive
from sweeps.catalogue import PACKAGE
from sweeps.running.archive.provenance import (
    check_identity,
    confidential_hashes,
    files_from_text,
    samples_hash,
)
from sweeps.scene.model import SeveralEngines
from sweeps.scene.plan.plan import Plan, make_plan
from sweeps.scene.plan.shards import part, shard
from sweeps.scene.reading import scene_of
from sweeps.scene.sample import parameters_of

if TYPE_CHECKING:
    import xarray as xr

# Largest number of positions along an axis of which an archive may claim to be a part
MOST = 1 << 30


@dataclass(frozen=True)
class Contents:
    """Facts in an archive about the run that made it."""

    path: Path  # Path of the archive
    attributes: Mapping[str, Any]  # Attributes of the archive
    # The scene as it was read; long lists are replaced by their number of values
    source: dict[str, Any]
    folder: str  # Folder that relative paths of the scene start from
    files: dict[str, bytes]  # Contents of the files that the scene names
    values: dict[str, Any]  # Values along each dimension, columns and labels of designs
    # Origin of the results: see `sweeps.running.archive.provenance`.
    identity: dict[str, Any] = field(default_factory=dict)
    # Part of the scene that the archive holds; empty for the whole scene.
    piece: dict[str, Any] = field(default_factory=dict)
    dimension: dict[str, str] = field(default_factory=dict)  # Dimension of each entry of `values`
    level: int = 0  # Compression level of the archive
    # Hashes of the files that the archive must not hold, without their comments.
    confidential: Mapping[str, str] = field(default_factory=dict)

    @property
    def single(self) -> bool:
        """Whether results are kept in 32 bits."""
        return bool(self.identity.get("numbers") == "float32")


_NEEDED = ("scene", "scene_name", "input_files", "identity")
"""Attributes of every archive of `run`."""


@contextmanager
def damage_refused(path: Path) -> Iterator[None]:
    """Refuse in one line an archive whose contents cannot be used: damaged, or of other origin."""
    try:
        yield
    except SceneError:
        raise
    except DAMAGE as error:
        raise SceneError(
            f"{path}: the stored description of its run is damaged ({one_line(error, 200)})"
        ) from error


def read_contents(path: Path) -> Contents:
    """Read what an archive of `run`, of no newer format than this, contains beside its results."""
    with damage_refused(path), opened_archive(path) as file:
        attributes = {name: file.getncattr(name) for name in file.ncattrs()}
        missing = [name for name in _NEEDED if name not in attributes]
        if missing:
            raise SceneError(
                f"{path}: not an archive written by `run` of this version (no attribute "
                f"'{missing[0]}')"
            )
        coordinates = {
            name: variable
            for name, variable in file.variables.items()
            if variable.dimensions == (name,)
            or (variable.dimensions == (DESIGN,) and _is_column(name))
        }
        values = {name: variable[...] for name, variable in coordinates.items()}
        dimension = {name: variable.dimensions[0] for name, variable in coordinates.items()}
        filters = [variable.filters() or {} for variable in file.variables.values()]
        level = max((f["complevel"] for f in filters if f.get("zlib")), default=0)
    return _contents(path, attributes, values, dimension, level)


def contents_of(archive: xr.Dataset) -> Contents:
    """Return what an archive that is open, or was never a file, contains beside its results."""
    home = archive.encoding.get("source")
    path = Path(home) if isinstance(home, str) else Path("archive")
    with damage_refused(path):
        if missing := [name for name in _NEEDED if name not in archive.attrs]:
            raise SceneError(
                f"{path}: does not have the scene that it was computed from (no attribute "
                f"'{missing[0]}')"
            )
        columns = {
            str(name): coordinate
            for name, coordinate in archive.coords.items()
            if coordinate.dims == (name,)
            or (coordinate.dims == (DESIGN,) and _is_column(str(name)))
        }
        values = {name: column.values for name, column in columns.items()}
        dimension = {name: str(column.dims[0]) for name, column in columns.items()}
    return _contents(path, dict(archive.attrs), values, dimension, 0)


def _contents(
    path: Path, attributes: dict[str, Any], values: dict[str, Any], dimension: dict[str, str],
    level: int,
) -> Contents:  # fmt: skip
    """Contents by the attributes of an archive and the values along its dimensions."""
    with damage_refused(path):
        piece = json.loads(attributes.get("part", "{}"))
        _check_piece(piece, dimension, values, reduced=REDUCTION in attributes)
        folder, files = files_from_text(attributes["input_files"])
        folder, files = files_as_now(folder, files, check_format(attributes, path))
        identity = json.loads(attributes["identity"])
        check_identity(identity)
        attributes["seconds"] = float(attributes.get("seconds", 0.0))
        source = json.loads(attributes["scene"])
        if not isinstance(source, dict) or not isinstance(source.get("axes", {}), dict):
            raise ValueError("scene: no tables")
        return Contents(
            path, attributes, source, folder, files, values, identity, piece, dimension, level,
            confidential_hashes(attributes["input_files"]),
        )  # fmt: skip


def files_as_now(
    folder: str, files: dict[str, bytes], version: int
) -> tuple[str, dict[str, bytes]]:
    """Folder and files of an archive, those of the package as this version names them.

    Files of the package are kept by their place in it. The folder of a built-in scene is kept as it
    was on the machine of the run, where the package may have lain elsewhere.
    """
    # Folders of the package in archives of older formats, and their present names
    moved_folders = {
        1: {
            "sweeps/engines": "sweeps/catalogue/engines",
            "sweeps/scenes": "sweeps/catalogue/scenes",
        }
    }
    moved = moved_folders.get(version, {})

    def name_now(name: str) -> str:
        home = PurePath(name).parent.as_posix()
        return f"{moved[home]}/{PurePath(name).name}" if home in moved else name

    current = {name_now(name): data for name, data in files.items()}
    place = "/".join(PurePath(folder).parts[-(2 if version == 1 else 3) :])
    place = moved.get(place, place)
    if any(PurePath(name).parent.as_posix() == place for name in current):
        folder = str(PACKAGE.parent / place)
    return folder, current


def plan_of(
    archive: Contents, *, axis: str = "", values: Any = None,
    coordinates: Mapping[str, Any] | None = None,
) -> Plan:  # fmt: skip
    """Plan of the scene that an archive contains, which reads no other file.

    The axis `axis` may have other `values`. `coordinates` are values of axes, columns of designs
    and labels instead of the archive's own: a shard has only its part of them, and is refused
    without.
    """
    with damage_refused(archive.path):
        raw, drawn = _scene_tables(archive, coordinates)
        source = archive.source
        if axis:
            raw["axes"][axis] = values
            listed = shortened([float(value) for value in values])
            source = {**source, "axes": {**source["axes"], axis: listed}}
        name = str(archive.attributes["scene_name"])
        folder = Path(archive.folder)
        scene = scene_of(raw, name, folder, Path(name), archive.files, columns=drawn)
        scene = replace(scene, source=source)
        # Joined parts keep the modes of the archive, also where new values would lead to others.
        joined = (axis or coordinates is not None) and len(archive.values.get("mode", ()))
        if joined and scene.engine.shaft and not isinstance(scene, SeveralEngines):
            scene = replace(scene, modes=len(archive.values["mode"]), modes_below=None)
        return make_plan(scene)


def _scene_tables(
    archive: Contents, coordinates: Mapping[str, Any] | None
) -> tuple[dict[str, Any], dict[str, Any] | None]:
    """Tables of the scene, and the values of its sample."""
    # Long lists and drawn values are taken from the coordinates of the archive.
    known = archive.values if coordinates is None else coordinates
    raw: dict[str, Any] = json.loads(json.dumps(archive.source))
    divided = "" if coordinates is not None else archive.piece.get("axis", "")

    def texts_or_numbers(key: str) -> Any:
        labels = filled("designs", key)
        return [str(text) for text in labels] if key in LABELS else labels

    def filled(table: str, key: str) -> Any:
        if "reduce" in raw:
            raise SceneError(
                f"{archive.path}: holds the designs that [reduce] kept, and not all values of "
                f"{key}; the scene itself is needed"
            )
        if divided == (DESIGN if table == "designs" else key):
            raise SceneError(
                f"{archive.path}: is a shard with only its own values of {key}; merge all shards "
                "first"
            )
        return np.asarray(known[key])

    for key, item in raw.get("axes", {}).items():
        if isinstance(item, str):  # A long list is kept as its number of values alone
            raw["axes"][key] = filled("axes", key)
    designs = raw.get("designs", {})
    if "reduce" in raw and "file" in designs:
        filled("designs", "the columns of [designs]")
    if "file" in designs:
        columns = [k for k in known if _is_column(k) and k not in raw.get("axes", {})]
        designs = raw["designs"] = dict.fromkeys(columns, "in the archive")
    for key, item in designs.items():
        if isinstance(item, str):
            designs[key] = texts_or_numbers(key)
    if "sample" not in raw or "reduce" in raw:
        return raw, None
    return raw, {key: texts_or_numbers(key) for key in parameters_of(raw["sample"])}


def _check_piece(
    piece: Any, dimension: Mapping[str, str], values: Mapping[str, Any], *, reduced: bool
) -> None:
    """Check that an archive of a part of a scene states which part it is."""
    if not isinstance(piece, dict):
        raise ValueError("part: no table")
    if "shard" not in piece:
        return
    first, size, axis = piece["first"], piece["of"], piece["axis"]
    if reduced:  # A reduced archive has no coordinate of all its positions
        axis, values, dimension = "", {"": ()}, {"": ""}
    if not (isinstance(first, int) and isinstance(size, int) and isinstance(piece["shard"], str)):
        raise ValueError("part: no numbers")
    if first < 0 or dimension.get(axis) != axis or not first + len(values[axis]) <= size <= MOST:
        raise ValueError("part: it does not fit its axis")


def _is_column(name: str) -> bool:
    return name in PARAMETERS or name in LABELS


def with_confidential(archive: Contents, path: Path) -> Contents:
    """Return the contents with a file for the one that the archive does not hold."""
    if not archive.confidential:
        raise SceneError(
            f"{archive.path}: its diagram is stored in it; --indicator is only for "
            "an archive without its diagram"
        )
    with reading(str(path), "the confidential diagram of an archive"):
        data = regular_bytes(path, MOST_RECORDING)
    name = next(iter(archive.confidential))
    return replace(archive, files={**archive.files, name: data})


def check_confidential(archive: Contents, plan: Plan) -> None:
    """Check, by its hash, that a diagram is the one that the archive was made from."""
    for name, expected in archive.confidential.items():
        actual = samples_hash(plan.scene.files.get(name, b""))
        if actual != expected:
            raise SceneError(
                f"{archive.path}: --indicator: not the diagram with which the archive was made "
                f"(sha256 {actual[:16]}, must be {expected[:16]})"
            )


def part_of(archive: Contents, plan: Plan) -> Plan:
    """Return the part of a plan that an archive is; the plan itself where it has no parts."""
    if not archive.piece:
        return plan
    with damage_refused(archive.path):
        if plan.scene.reduce is not None:
            number, _, count = archive.piece["shard"].partition("/")
            return shard(plan, int(number), int(count))
        axis, first = archive.piece["axis"], int(archive.piece["first"])
        places = np.arange(first, first + len(archive.values[axis]))
        return part(plan, axis, places, archive.attributes["part"])
