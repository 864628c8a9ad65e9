"""Where structures of a sound HDF5 file are, found by their signatures, and their checksums.

Source: The HDF Group, "HDF5 File Format Specification", version 3.0.
"""

from __future__ import annotations

import re
import struct

__all__ = ["checksum", "spans"]

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
