"""Where an archive comes from: what it was computed from, by what, on what, and when.

What determines the numbers is the *identity* of a run: the scene, the files that it names, the
versions, the kind of archive. It says whether an interrupted run may be resumed or archives joined,
and if not, what differs. An archive contains the files themselves, so that
`sweeps.running.join.extend` needs nothing else.
"""

from __future__ import annotations

import base64
import hashlib
import json
import os
import platform
import zlib
from collections.abc import Collection, Iterator, Mapping
from datetime import UTC, datetime
from functools import cache, lru_cache
from importlib import metadata
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any

import numpy as np

from engine_dyn.compilation import processor, processor_features, source_hash
from engine_dyn.loads.torque_curves import TorqueOverAngle
from engine_dyn.pressure.diagram import Diagram
from sweeps.base.dimensions import LABELS
from sweeps.base.errors import counted, one_line, printable
from sweeps.catalogue import PACKAGE

if TYPE_CHECKING:
    from sweeps.scene.model import Scene
    from sweeps.scene.plan.plan import Plan

PACKAGES = ("engine-dyn", "numpy", "numba", "xarray", "netCDF4")


def identity(plan: Plan, *, numbers: str = "float64") -> dict[str, Any]:
    """All that the numbers of a plan depend on, in JSON's types; long texts as hashes.

    `numbers` is the kind of number that results are kept as.
    """
    scene = (plan.whole or plan).scene
    return {
        "scene": scene.source,
        "values": {
            name: _hash_of(values)
            for name, values in (
                *scene.axes.items(),
                *scene.designs.items(),
                *((key, scene.labels[key]) for key in LABELS[1:] if key in scene.labels),
            )
        },
        "files": {name: sha256(data) for name, data in _by_name(scene).items()},
        "versions": versions(),
        "numbers": numbers,
        "part": plan.piece,
    }


def versions() -> dict[str, str]:
    """Versions that determine the numbers."""
    return {
        "engine-dyn": version("engine-dyn"),
        "kernels": source_hash()[:16],
        "numpy": version("numpy"),
        "numba": version("numba"),
    }


def machine_kind() -> dict[str, str]:
    """Causes of different last digits besides versions: processor, instructions, libm."""
    library = " ".join(platform.libc_ver()).strip()
    return {
        "processor": processor(),
        "instructions": " ".join(processor_features()),
        "C library": library or platform.system(),
    }


def kind_differences(before: Mapping[str, str], now: Mapping[str, str]) -> list[str]:
    """Differences of two kinds of machine, in words; empty where they are the same."""
    unequal: list[str] = []
    for key in dict.fromkeys((*before, *now)):
        was, new = before.get(key, "not known"), now.get(key, "not known")
        if was == new:
            continue
        if key == "instructions":
            one, other = set(was.split()), set(new.split())
            lacking = [f"without {w}" for w in sorted(one - other)]
            more = [f"with {w}" for w in sorted(other - one)]
            unequal.append(one_line(f"{key} ({', '.join(lacking + more)})", 200))
        else:
            unequal.append(f"{key} (was {was}, is {new})")
    return unequal


def check_identity(known: Any) -> None:
    """Check that what a file says is its identity is of the form that `identity` gives it.

    Raises
    ------
    ValueError, KeyError
        Where it is not.
    """
    if not isinstance(known, dict) or not isinstance(known["scene"], dict):
        raise ValueError("identity: no scene")
    if known["numbers"] not in ("float64", "float32") or not isinstance(known["part"], str):
        raise ValueError("identity: neither float64 nor float32")
    for table in ("values", "files", "versions"):
        texts = known[table]
        if not isinstance(texts, dict) or not all(isinstance(t, str) for t in texts.values()):
            raise ValueError(f"identity: {table}: no table of texts")


def differences(
    before: Mapping[str, Any], now: Mapping[str, Any], *, but: str = "",
    words: tuple[str, str] = ("was", "is"),
) -> list[str]:  # fmt: skip
    """Differences of two identities, in words; empty where they are the same.

    `but` names an axis in which they may differ. `words` stand before the two values, such as "in
    first.nc" and "in second.nc" where neither is the earlier one.
    """
    earlier, later = words
    unequal: list[str] = []
    for table, what in (("versions", "version of {}"), ("files", "file {}")):
        one, other = before.get(table, {}), now.get(table, {})
        for key in dict.fromkeys((*one, *other)):
            if one.get(key) != other.get(key):
                was, new = one.get(key, "missing"), other.get(key, "missing")
                text = f"({earlier} {was[:16]}, {later} {new[:16]})"
                unequal.append(f"{what.format(key)} {text}")
    in_scene = list(_unequal(before.get("scene", {}), now.get("scene", {}), "", words))
    left_out = (f"[axes] {but}", f"[axes] {but} ")
    unequal += [
        f"scene: {text}"
        for where, text in in_scene
        if where != left_out[0] and not where.startswith(left_out[1])
    ]
    named = " ".join(where for where, _ in in_scene).split()
    one, other = before.get("values", {}), now.get("values", {})
    for key in dict.fromkeys((*one, *other)):
        if one.get(key) != other.get(key) and key not in (but, *named):
            unequal.append(f"values of {key}")
    told = ("scene", "values", "files", "versions")
    rest = [k for k in dict.fromkeys((*before, *now)) if k not in told]
    for key in rest:
        if before.get(key) != now.get(key):
            unequal.append(f"{key} ({earlier} {before.get(key)}, {later} {now.get(key)})")
    return unequal


def _unequal(
    before: Any, now: Any, where: str, words: tuple[str, str]
) -> Iterator[tuple[str, str]]:
    """Places where two scenes differ, with both values."""
    if isinstance(before, dict) and isinstance(now, dict):
        for key in dict.fromkeys((*before, *now)):
            table = isinstance(before.get(key, now.get(key)), dict)
            name = f"[{key}]" if table and not where else key
            yield from _unequal(before.get(key), now.get(key), f"{where} {name}".strip(), words)
    elif before != now:
        shown = [
            "missing" if value is None else one_line(json.dumps(value, ensure_ascii=False), 60)
            for value in (before, now)
        ]
        yield where, f"{where} ({words[0]} {shown[0]}, {words[1]} {shown[1]})"


@cache
def machine_text() -> str:
    """One line about this machine."""
    return (
        f"{platform.node()}: {platform.machine()} {platform.system()}, {processor()}, "
        f"{counted(os.cpu_count() or 1, 'core')}"
    )


def provenance(
    plan: Plan, *, seconds: float | None = None, command: str = "", numbers: str = "float64",
    machine: str = "", full_paths: bool = False,
) -> dict[str, str | float]:  # fmt: skip
    """Attributes that say where an archive comes from: texts, JSON texts and numbers.

    `machine` is what computed it, unless that was this one; see `_without_folder` on `full_paths`.
    """
    scene = plan.scene
    folder, files = (scene.folder, scene.files) if full_paths else _without_folder(scene)
    own = version("engine-dyn")
    now = datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
    attributes: dict[str, Any] = {
        "source": f"engine-dyn {own}: periodic crank speed of piston engines",
        "history": f"{now}: engine-dyn {own} computed {plan.designs_text}",
        "scene": json_text(scene.source),
        "scene_name": printable(plan.name),
        "part": plan.piece,
        "input_files": files_text(folder, files, _confidential(scene, full_paths)),
        "indicator_notes": "\n".join(scene.indicator_notes),
        "indicator_diagrams": json.dumps(_diagrams(scene)),
        "identity": json_text(identity(plan, numbers=numbers)),
        "software": "; ".join(
            [f"Python {platform.python_version()}"] + [f"{n} {version(n)}" for n in PACKAGES]
        ),
        "git_commit": git_commit(),
        "machine": machine or machine_text(),
        "threading_layer": "none; kernels run on a pool of threads",
        "command_line": printable(command),
    }
    if seconds is not None:
        attributes["seconds"] = round(seconds, 3)
    return {key: value for key, value in attributes.items() if value != ""}


def json_text(value: Any) -> str:
    """JSON with letters as they are; names of files that are not valid text as escapes."""
    text = json.dumps(value, ensure_ascii=False)
    return text if text.isprintable() else json.dumps(value)


def sha256(data: bytes) -> str:
    """Hash of a file's content."""
    return hashlib.sha256(data).hexdigest()


def _confidential(scene: Scene, full_paths: bool) -> tuple[str, ...]:
    """Names of the files that an archive must not hold."""
    if full_paths or not scene.confidential:
        return scene.confidential
    now, before = _without_folder(scene)[1], scene.files
    return tuple(new for new, old in zip(now, before, strict=True) if old in scene.confidential)


def samples_hash(data: bytes) -> str:
    """Hash of a CSV file without its comments, which name versions."""
    lines = [line for line in data.splitlines() if not line.lstrip().startswith(b"#")]
    return sha256(b"\n".join(lines))


def files_text(folder: str, files: Mapping[str, bytes], confidential: Collection[str] = ()) -> str:
    """JSON of files: hash and text of each; a long text compressed (zlib, base64).

    `folder` is where paths of the scene start from; names of files begin with it. Of confidential
    files there are hashes alone.
    """
    table: dict[str, dict[str, str]] = {}
    for name, data in files.items():
        table[name] = {"sha256": sha256(data)}
        if name in confidential:
            table[name]["samples_sha256"] = samples_hash(data)
        elif len(data) < (1 << 14):  # Longer texts are compressed
            table[name]["text"] = data.decode("utf-8", "surrogateescape")
        else:
            table[name]["zlib"] = base64.b64encode(zlib.compress(data, 9)).decode("ascii")
    return json.dumps({"folder": folder, "files": table})


def files_from_text(text: str) -> tuple[str, dict[str, bytes]]:
    """Folder and files: the inverse of `files_text`; ValueError for a content with another hash."""
    files: dict[str, bytes] = {}
    listing = json.loads(text)
    room = MOST
    for name, entry in listing["files"].items():
        if "zlib" in entry:
            data = _inflated(base64.b64decode(entry["zlib"]), room)
            room -= len(data)
        elif "samples_sha256" in entry and "text" not in entry:
            continue  # A confidential file stays out
        else:
            data = entry["text"].encode("utf-8", "surrogateescape")
        if sha256(data) != entry["sha256"]:
            raise ValueError(f"{name}: its text is damaged")
        files[name] = data
    return str(listing["folder"]), files


def confidential_hashes(text: str) -> dict[str, str]:
    """Hash, without comments, of each file that a text of `files_text` does not hold."""
    return {
        name: str(entry["samples_sha256"])
        for name, entry in json.loads(text)["files"].items()
        if "samples_sha256" in entry
    }


MOST = 1 << 28
"""Largest number of bytes of the files in an archive, so that a few archives do not fill the
memory."""


def _inflated(data: bytes, room: int) -> bytes:
    stream = zlib.decompressobj()
    try:
        content = stream.decompress(data, room + 1)  # zlib takes 0 for no limit
    except zlib.error as error:
        raise ValueError(str(error)) from None
    if len(content) > room:
        raise ValueError(f"files of more than {MOST} bytes")
    return content


def _hash_of(values: Any) -> str:
    """Hash of the values of an axis or column."""
    if isinstance(values, tuple):
        return sha256("\n".join(values).encode())[:32]
    return sha256(np.ascontiguousarray(values, dtype="<f8").tobytes())[:32]


def _by_name(scene: Scene) -> dict[str, bytes]:
    """Files by their names alone: the same files in another folder are equal."""
    contents: dict[str, bytes] = {}
    for path, data in scene.files.items():
        name = PurePath(path).name
        number = 2
        while name in contents:
            name, number = f"{PurePath(path).name} ({number})", number + 1
        contents[name] = data
    return contents


def _without_folder(scene: Scene) -> tuple[str, Mapping[str, bytes]]:
    """Folder and files of a scene, named from its folder on, because archives are mailed to others.

    An absolute path in the scene or one of its files is reduced to its name, under which the file
    is looked up again.
    """
    if _within(scene.folder, PACKAGE) is not None:
        return PurePath(scene.folder).relative_to(PACKAGE.parent).as_posix(), scene.files

    def short(name: str) -> str:
        inside = _within(name, scene.folder)
        given = inside is None or (os.path.isabs(name) and _is_given(name, scene))
        return name if given else str(inside)

    return "", {short(name): data for name, data in scene.files.items()}


@lru_cache(maxsize=1024)
def _within(path: str, folder: str | PurePath) -> str | None:
    """Path relative to a folder; None where it lies elsewhere."""
    whole = PurePath(path)
    return str(whole.relative_to(folder)) if whole.is_relative_to(folder) else None


def _is_given(name: str, scene: Scene) -> bool:
    """Whether a scene or one of its files uses this name of a file."""
    texts = [json_text(scene.source).encode(errors="surrogateescape"), *scene.files.values()]
    return any(os.fsencode(name) in text for text in texts)


def _diagrams(scene: Scene) -> list[dict[str, Any]]:
    """Hash of each diagram that may be used: of its angles [rad] and absolute pressures [Pa].

    One of torque has torques [N m] in place of pressures, and is marked.
    """
    curves: list[Diagram | TorqueOverAngle] = []
    for one in scene.ordinary_scenes:
        curves += one.engine.diagrams if one.indicator is None else (one.indicator,)
        curves += [] if one.engine.torque is None else [one.engine.torque]
    return [
        {"points": len(curve.angle), "sha256": _hash_of_curve(curve)}
        | ({"of": "torque"} if isinstance(curve, TorqueOverAngle) else {})
        for curve in curves
    ]


@lru_cache(maxsize=1024)
def _hash_of_curve(curve: Diagram | TorqueOverAngle) -> str:
    values = curve.pressure if isinstance(curve, Diagram) else curve.torque
    return sha256(np.asarray((curve.angle, values), "<f8").tobytes())


@cache
def version(package: str) -> str:
    """Version of an installed package."""
    # Installed versions do not change within a session, and looking one up takes longer than
    # solving a design.
    return metadata.version(package)


@cache
def git_commit() -> str:
    """Commit of the checkout that this package lies in; empty where it lies in none."""
    try:
        return _commit_of(Path(__file__).resolve().parents[3])
    except (OSError, ValueError, IndexError):
        return ""


def _commit_of(folder: Path) -> str:
    git = folder / ".git"
    if git.is_file():  # A worktree has a file with "gitdir: ..."
        git = folder / git.read_text().partition(":")[2].strip()
    head = (git / "HEAD").read_text().strip()
    if not head.startswith("ref: "):
        return head
    name = head.removeprefix("ref: ")
    common = git / "commondir"
    homes = [git, git / common.read_text().strip()] if common.exists() else [git]
    for home in homes:
        if (home / name).is_file():
            return (home / name).read_text().strip()
        packed = home / "packed-refs"
        for line in packed.read_text().splitlines() if packed.exists() else ():
            if line.endswith(f" {name}"):
                return line.split()[0]
    return ""
