"""Where structures of a sound HDF5 file are, found by their signatures, and their checksums.

Source: The HDF Group, "HDF5 File Format Specification", version 3.0.
"""

from __future__ import annotations

import re
import struct

__all__ = ["checksum", "spans"]

_SIGNATURES = re.compile(b"OHDR|OCHK|FRHP|BTHD|GCOL|TREE")

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
