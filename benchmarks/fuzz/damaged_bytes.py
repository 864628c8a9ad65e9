"""Sound netCDF files with bytes damaged: at random, or where structures have sizes and addresses.

Most structures of HDF5 carry a checksum, so that random damage in them is noticed by the library
and leads no further. In half of the cases the checksums of what was changed are therefore made
right again, as somebody who means harm would do. Structures are found by their signatures.

Source of these: The HDF Group, "HDF5 File Format Specification", version 3.0.
"""

from __future__ import annotations

import random
import re
import struct
import tempfile
from functools import cache
from pathlib import Path
from typing import Literal, NamedTuple

import netCDF4

from benchmarks.command import ROOT
from benchmarks.fuzz.sound import PLAIN, good_archive
from sweeps.running.compute import into_archive
from sweeps.running.compute.options import Options
from sweeps.scene.plan.plan import make_plan
from sweeps.scene.reading import read_scene

STRETCH = 500
"""Bytes of a damaged stretch."""

KINDS = {
    "bit": 16, "bits": 6, "zero byte": 10, "byte": 6, "zeros": 8, "noise": 8, "cut": 4,
    "spliced": 8, "removed": 2, "inserted": 2, "field": 30,
}  # fmt: skip
"""Kinds of damage, and how often each is made, in percent."""

_SCENES = {
    "compressed": PLAIN,
    "labelled": {
        "engine": "diesel_105x137",
        "designs": {
            "case": [f"design {n}" for n in range(12)],
            "stroke": [0.1 + 0.005 * n for n in range(12)],
        },
        "output": {"quantities": ["mean_piston_speed"]},
    },
}
"""Scenes that need no compiled kernel; archives of them have chunks in trees, and texts."""


class Damaged(NamedTuple):
    """A damaged file: which it was, what was done, and its bytes."""

    name: str
    kind: str
    data: bytes


@cache
def sound_files() -> dict[str, bytes]:
    """Sound files by name: archives of several makes, and tables of designs."""
    found = {
        "archive": good_archive(),
        "shard": good_archive(True),
        "version 0.1": (ROOT / "tests" / "data" / "version_0_1.nc").read_bytes(),
    }
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "made.nc"
        for name, scene in _SCENES.items():
            into_archive.run(
                make_plan(read_scene(scene)), path, Options(level=4, overwrite=path.exists())
            )
            found[name] = path.read_bytes()
        kinds: dict[str, Literal["NETCDF4", "NETCDF3_CLASSIC"]]
        kinds = {"table": "NETCDF4", "classic table": "NETCDF3_CLASSIC"}
        for name, kind in kinds.items():
            with netCDF4.Dataset(path, "w", format=kind) as file:
                file.createDimension("n", 9)
                bore = file.createVariable("bore", "f8", ("n",))
                bore.units = "m"
                bore[:] = [0.1 + 0.001 * n for n in range(9)]
                if kind == "NETCDF4":
                    case = file.createVariable("case", str, ("n",))
                    for n in range(9):
                        case[n] = f"design {n}"
            found[name] = path.read_bytes()
    return found


# --- structures of a sound file -------------------------------------------------------------------


_SIGNATURES = re.compile(b"OHDR|OCHK|FRHP|BTHD|GCOL|TREE")

MASK = 0xFFFFFFFF

_HEAP = struct.Struct("<4sBHHBI12QHQQHHQH")
_INDEX = struct.Struct("<4sBBIHHBBQHQ")


def spans(data: bytes) -> list[tuple[int, int, bool]]:
    """Structures: where each begins and ends, and whether its checksum follows."""
    found = [(0, 44, True)]
    for match in _SIGNATURES.finditer(data):
        begin, mark = match.start(), match[0]
        if mark == b"OHDR":
            flags = data[begin + 5]
            size = begin + 6 + (16 if flags & 0x20 else 0) + (4 if flags & 0x10 else 0)
            start = size + (1 << (flags & 3))
            found.append((begin, start + int.from_bytes(data[size:start], "little"), True))
        elif mark == b"OCHK":  # whoever leads there says how long it is
            leads = data.find(struct.pack("<Q", begin))
            found.append((begin, begin + struct.unpack_from("<Q", data, leads + 8)[0] - 4, True))
        elif mark == b"FRHP":
            width, _, _, bits, _, root, rows = _HEAP.unpack_from(data, begin)[-7:]
            found.append((begin, begin + _HEAP.size, True))
            if rows:
                found.append((root, root + 13 + -(-bits // 8) + 8 * rows * width, True))
        elif mark == b"BTHD":
            *_, size, depth, _, _, root, count, _ = _INDEX.unpack_from(data, begin)
            found.append((begin, begin + _INDEX.size, True))
            if not depth and root + 1 < 1 << 64:
                found.append((root, root + 6 + size * count, True))
        elif mark == b"GCOL":
            size = struct.unpack_from("<Q", data, begin + 8)[0]
            found.append((begin, begin + size, False))
        else:
            used = struct.unpack_from("<H", data, begin + 6)[0]
            found.append((begin, begin + 24 + 40 * used, False))
    # What only looks like a structure has another checksum, or none.
    return [
        span
        for span in found
        if not span[2]
        or checksum(data[span[0] : span[1]]).to_bytes(4, "little") == data[span[1] : span[1] + 4]
    ]


def checksum(data: bytes) -> int:
    """Hash of bytes, hashlittle with 0 of Jenkins's lookup3.c."""
    a = b = c = 0xDEADBEEF + len(data) & MASK
    mixed = max(len(data) - 1, 0) // 12
    for x, y, z in struct.iter_unpack("<3I", data[: 12 * mixed]):
        a, b, c = a + x & MASK, b + y & MASK, c + z & MASK
        for turn in (4, 6, 8, 16, 19, 4):
            a = (a - c & MASK) ^ turned(c, turn)
            a, b, c = b, c + b & MASK, a
    rest = data[12 * mixed :]
    if not rest:
        return c
    x, y, z = struct.unpack("<3I", rest.ljust(12, b"\0"))
    a, b, c = a + x & MASK, b + y & MASK, c + z & MASK
    for turn in (14, 11, 25, 16, 4, 14, 24):
        a, b, c = b, (c ^ b) - turned(b, turn) & MASK, a
    return b


def turned(word: int, bits: int) -> int:
    """A word of 32 bits turned to the left."""
    return (word << bits | word >> 32 - bits) & MASK


@cache
def spans_of(name: str) -> list[tuple[int, int, bool]]:
    """Structures of a sound file: where each begins and ends, and whether a checksum follows."""
    data = sound_files()[name]
    if not data.startswith(b"\x89HDF"):
        return [(0, min(400, len(data)), False)]
    return spans(data)


# --- damage ---------------------------------------------------------------------------------------


def damaged(number: int, seed: int) -> Damaged:
    """Make the damaged file of a number, the same in every run."""
    draw = random.Random(f"{seed}/{number}")
    name = draw.choice(list(sound_files()))
    sound = sound_files()[name]
    kind = draw.choices(list(KINDS), list(KINDS.values()))[0]
    data = bytearray(sound)
    for _ in range(draw.choice((1, 1, 1, 2))):
        _damage(draw, kind, data, name)
    if len(data) == len(sound) and draw.random() < 0.5:
        for begin, end, checked in spans_of(name):
            if checked and data[begin:end] != sound[begin:end]:
                data[end : end + 4] = checksum(bytes(data[begin:end])).to_bytes(4, "little")
    return Damaged(name, kind, bytes(data))


def _place(draw: random.Random, data: bytearray, name: str) -> int:
    """A place to damage: two times of three in a structure, which are a small part of a file."""
    if draw.random() < 0.67:
        begin, end, _ = draw.choice(spans_of(name))
        return min(draw.randrange(begin, max(end, begin + 1)), max(len(data) - 1, 0))
    return draw.randrange(max(len(data), 1))


def _damage(draw: random.Random, kind: str, data: bytearray, name: str) -> None:
    """Change some bytes; nothing is done where none are left."""
    if not data:
        return
    place = _place(draw, data, name)
    end = place + min(draw.choice((STRETCH, STRETCH, 50, 8)), len(data) - place)
    if kind in ("bit", "bits"):
        for _ in range(1 if kind == "bit" else draw.randrange(2, 20)):
            data[place] ^= 1 << draw.randrange(8)
            place = _place(draw, data, name)
    elif kind == "zero byte":
        data[place] = 0
    elif kind == "byte":
        data[place] = draw.choice((0xFF, 1, draw.randrange(256)))
    elif kind == "zeros":
        data[place:end] = bytes(end - place)
    elif kind == "noise":
        data[place:end] = draw.randbytes(end - place)
    elif kind == "cut":
        del data[draw.choice((place, len(data) - 1, len(data) // 2)) :]
    elif kind == "spliced":
        source = _place(draw, data, name)
        part = data[source : source + end - place]
        data[place : place + len(part)] = part
    elif kind == "removed":
        del data[place : place + draw.choice((1, 4, 8, STRETCH))]
    elif kind == "inserted":
        data[place:place] = draw.randbytes(draw.choice((1, 4, 8, STRETCH)))
    else:
        _damage_field(draw, data, name)


def _damage_field(draw: random.Random, data: bytearray, name: str) -> None:
    """A number in a structure becomes 0, the largest, or the address of another structure."""
    spans = spans_of(name)
    begin, end, _ = draw.choice(spans)
    width = draw.choice((1, 2, 4, 8, 8))
    place = draw.randrange(begin + 4, max(end - width, begin + 5))
    old = int.from_bytes(data[place : place + width], "little")
    value = draw.choice(
        (0, 1, old + 1, max(old - 1, 0), 2 * old, (1 << 8 * width) - 1, 1 << (8 * width - 1),
         draw.choice(spans)[0], begin, len(data), draw.randrange(1 << 8 * width))
    )  # fmt: skip
    data[place : place + width] = (value % (1 << 8 * width)).to_bytes(width, "little")
