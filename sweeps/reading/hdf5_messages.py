"""What single messages of HDF5 object headers say, and whether netCDF-4 would have written them.

A message that the library refuses makes netCDF close the file while it is still opening it, which
frees memory twice and ends the process some files later. So whatever a sound file of netCDF-4 has
not is not known here: `hdf5_structure` then does not clear the file.

Source: The HDF Group, "HDF5 File Format Specification", version 3.0, section IV.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable

__all__ = [
    "MOST_RANK",
    "OWN_TYPES",
    "Damaged",
    "Unknown",
    "after_name",
    "check_atomic",
    "check_layout",
    "check_message",
    "check_name",
    "checksum",
    "dataspace",
    "expect",
    "fill_value",
    "padded",
    "uint",
    "verify",
]

MOST_RANK = 32
"""Dimensions of a dataspace or of a type of arrays (H5S_MAX_RANK)."""


class Unknown(Exception):
    """Something that this walk does not know, which may be sound."""


class Damaged(Exception):
    """Something that no sound file has."""


def uint(data: bytes, place: int, size: int) -> int:
    """A whole number without sign, least significant byte first."""
    if place + size > len(data):
        raise struct.error
    return int.from_bytes(data[place : place + size], "little")


def padded(size: int) -> int:
    """Bytes that something takes where it fills whole words of eight."""
    return -(-size // 8) * 8


def verify(data: bytes, address: int, what: str) -> None:
    """Verify the checksum of a structure, its last four bytes (Bob Jenkins, lookup3)."""
    if checksum(data[:-4]) != int.from_bytes(data[-4:], "little"):
        raise Damaged(f"{what} at byte {address} has a wrong checksum")


def checksum(data: bytes) -> int:
    """Hash of bytes, hashlittle with 0 of Jenkins's lookup3.c."""
    mask = 0xFFFFFFFF
    a = b = c = 0xDEADBEEF + len(data) & mask
    words = struct.unpack(f"<{len(data) // 4}I", data[: len(data) // 4 * 4])
    mixed = max(len(data) - 1, 0) // 12
    for i in range(0, 3 * mixed, 3):
        b = b + words[i + 1] & mask
        c = c + words[i + 2] & mask
        a = (a + words[i] - c & mask) ^ (c << 4 & mask | c >> 28)
        c = c + b & mask
        b = (b - a & mask) ^ (a << 6 & mask | a >> 26)
        a = a + c & mask
        c = (c - b & mask) ^ (b << 8 & mask | b >> 24)
        b = b + a & mask
        a = (a - c & mask) ^ (c << 16 & mask | c >> 16)
        c = c + b & mask
        b = (b - a & mask) ^ (a << 19 & mask | a >> 13)
        a = a + c & mask
        c = (c - b & mask) ^ (b << 4 & mask | b >> 28)
        b = b + a & mask
    rest = data[12 * mixed :]
    if not rest:
        return c
    x, y, z = struct.unpack("<3I", rest.ljust(12, b"\0"))
    a, b, c = a + x & mask, b + y & mask, c + z & mask
    c = (c ^ b) - (b << 14 & mask | b >> 18) & mask
    a = (a ^ c) - (c << 11 & mask | c >> 21) & mask
    b = (b ^ a) - (a << 25 & mask | a >> 7) & mask
    c = (c ^ b) - (b << 16 & mask | b >> 16) & mask
    a = (a ^ c) - (c << 4 & mask | c >> 28) & mask
    b = (b ^ a) - (a << 14 & mask | a >> 18) & mask
    return (c ^ b) - (b << 24 & mask | b >> 8) & mask


def check_name(name: bytes) -> None:
    """The name of a link or an attribute; of others the library cannot be trusted to say no."""
    try:
        if not name or 0 in name:
            raise Unknown("a name that is empty or ends early")
        name.decode()
    except UnicodeDecodeError:
        raise Unknown("a name that is not UTF-8") from None


def _is_text(kind: bytes) -> bool:
    """Whether a type is a text of fixed length."""
    return kind[0] & 15 == 3


def _is_integer(kind: bytes) -> bool:
    """Whether a type is a whole number of four bytes, least significant first."""
    return kind[0] & 15 == 0 and not kind[1] & 1 and uint(kind, 4, 4) == 4


def _is_references(kind: bytes) -> bool:
    """Whether a type is sequences (not texts) of references to objects."""
    lists = kind[0] & 15 == 9 and kind[1] & 15 == 0 and uint(kind, 4, 4) == 16
    return lists and kind[8] & 15 == 7 and kind[9] & 15 == 0


OWN_TYPES: dict[bytes, Callable[[bytes], bool]] = {
    b"DIMENSION_LIST": _is_references,
    b"CLASS": _is_text,
    b"NAME": _is_text,
    b"_Netcdf4Dimid": _is_integer,
    b"_Netcdf4Coordinates": _is_integer,
}
"""Attributes that netCDF reads while it opens a file, without looking at their types."""


def dataspace(body: bytes) -> tuple[int, int, int]:
    """Rank, number of values and bytes of a dataspace."""
    version, rank, flags, kind = struct.unpack_from("<4B", body)
    expect(version in (1, 2) and rank <= MOST_RANK and flags in (0, 1), "a dataspace")
    start = 8 if version == 1 else 4
    if version == 2:
        expect(kind in (0, 1, 2) and (kind == 1) == (rank > 0), "a dataspace")
    dims = struct.unpack_from(f"<{rank}Q", body, start)
    if flags:
        largest = struct.unpack_from(f"<{rank}Q", body, start + 8 * rank)
        expect(all(n <= m for n, m in zip(dims, largest, strict=True)), "a dataspace")
    count = 0 if version == 2 and kind == 2 else math.prod(dims)
    return rank, count, start + 8 * rank * (1 + flags)


def fill_value(body: bytes) -> bytes:
    """Bytes of a fill value; none where it is not given."""
    version = body[0]
    if version == 3:
        flags = body[1]
        times = flags & 3 and flags >> 2 & 3 < 3
        given = bool(flags & 0x20)
        expect(times and flags < 0x40 and not (given and flags & 0x10), "a fill value")
        size = uint(body, 2, 4) if given else 0
        start = 6 if given else 2
    elif version == 2:
        allocated, written, given = body[1], body[2], bool(body[3])
        expect(1 <= allocated <= 3 and written < 3 and body[3] < 2, "a fill value")
        size = uint(body, 4, 4) if given else 0
        start = 8 if given else 4
    else:
        raise Unknown(f"fill value of version {version}")
    expect(start + size == len(body), "a fill value")
    return body[start:]


_FLOATS = {
    4: (0x1F20, bytes.fromhex("0000200017080017 7f000000")),
    8: (0x3F20, bytes.fromhex("0000400034 0b0034 ff030000")),
}
"""Class bits and properties of IEEE floats, least significant byte first, by their size."""

_NUMBERS, _REALS, _TEXTS, _OPAQUE = 0, 1, 3, 5


def check_atomic(kind: int, bits: int, size: int, properties: bytes) -> int:
    """Bytes of the properties of a number, a text or an opaque value that netCDF-4 writes."""
    if kind == _NUMBERS:
        expect(size in (1, 2, 4, 8) and not bits & ~9, "a type of integers")
        expect(properties[:4] == struct.pack("<2H", 0, 8 * size), "a type of integers")
        return 4
    if kind == _REALS:
        expected, form = _FLOATS.get(size, (0, b""))
        expect(bits & ~1 == expected and properties[:12] == form != b"", "a type of floats")
        return 12
    if kind == _TEXTS:
        expect(bits & 15 < 3 and bits >> 4 < 2, "a type of texts")
        return 0
    expect(kind == _OPAQUE and not bits >> 8 and not bits & 7, f"type of class {kind}")
    return bits


def check_message(kind: int, flags: int, body: bytes) -> None:
    """Check a message of an object header as far as it stands alone."""
    expect(not flags & ~7, f"flags {flags} of a message of type {kind}")
    if kind in (0x02, 0x15):
        wide = 8 if kind == 0x02 else 2
        expect(body[0] == 0 and body[1] < 4, "an index")
        needed = 2 + wide * (body[1] & 1) + 16 + 8 * (body[1] >> 1 & 1)
        expect(len(body) == needed, "an index")
    elif kind == 0x04:
        expect(len(body) == 4 + uint(body, 0, 4), "an old fill value")
    elif kind == 0x0A:
        needed = 2 + 4 * (body[1] & 1) + 4 * (body[1] >> 1 & 1)
        expect(body[0] == 0 and body[1] < 4 and len(body) == needed, "group information")
    elif kind == 0x0B:
        _check_filters(body)
    elif kind == 0x12:
        expect(body[:4] == b"\1\0\0\0" and len(body) == 8, "a time")
    elif kind == 0x16:
        expect(body[0] == 0 and len(body) == 5, "a number of links")


def check_layout(body: bytes, rank: int, count: int, size: int) -> None:
    """Check where a variable of so many values says that they lie."""
    if body[1] == 0:
        expect(len(body) == 4 + uint(body, 2, 2), "values in the header")
        expect(uint(body, 2, 2) == count * size, "values in the header")
    elif body[1] == 1:
        expect(len(body) == 18 and uint(body, 10, 8) == count * size, "values in one piece")
    elif body[1] == 2:
        dims = struct.unpack_from(f"<{body[2]}I", body, 11)
        expect(body[2] == rank + 1 and len(body) == 11 + 4 * body[2], "values in chunks")
        expect(all(dims) and dims[-1] == size, "values in chunks")


_KNOWN_FILTERS = {1: 1, 2: 1, 3: 0}
"""deflate, shuffle and fletcher32, and how many numbers each is given in a file."""


def _check_filters(body: bytes) -> None:
    """Check the filters of chunks: those that every HDF5 has."""
    version, count = struct.unpack_from("<2B", body)
    expect(version in (1, 2) and 0 < count <= len(_KNOWN_FILTERS), "filters")
    place = 8 if version == 1 else 2
    for _ in range(count):
        kind = uint(body, place, 2)
        expect(kind in _KNOWN_FILTERS, f"filter {kind}")
        named = uint(body, place + 2, 2) if version == 1 else 0
        place += 2 if version == 1 else 0
        flags, values = struct.unpack_from("<2H", body, place + 2)
        place += 6 + named
        expect(flags < 2 and values == _KNOWN_FILTERS[kind], "a filter")
        place += 4 * values + (4 * (values & 1) if version == 1 else 0)
    expect(place == len(body), "filters")


def expect(fine: object, what: str) -> None:
    """Do not clear a file that has something in a form that netCDF-4 does not write."""
    if not fine:
        raise Unknown(f"{what} in a form that netCDF does not write")


def after_name(data: bytes, place: int, version: int) -> int:
    """Where a name in a type ends; before version 3 names fill whole words of eight bytes."""
    end = data.find(b"\0", place)
    if end < 0:
        raise struct.error
    return end + 1 if version == 3 else place + padded(end + 1 - place)
