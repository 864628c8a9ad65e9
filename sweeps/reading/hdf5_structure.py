"""Headers, indexes and heaps of an HDF5 file, walked before the library opens it.

The library follows sizes and addresses as it finds them: one zero byte in the size of a heap's free
space makes it run for ever, and a group that holds itself fills the stack. So the metadata is
walked here first, from the superblock along the addresses: each structure lies inside the file and
is reached once, no object of a heap has no size. Values are not read, except references to heaps.

Only what netCDF-4 writes is known here (superblock 2 and 3, object headers of version 2, fractal
heaps, B-trees of version 2, global heaps, chunks in B-trees of version 1); whatever else is met,
the file is not cleared. Checksums are verified although the library does so too: it may use memory
that it has freed when it finds a wrong one.

Source: The HDF Group, "HDF5 File Format Specification", version 3.0.
"""

from __future__ import annotations

import errno
import math
import struct
from bisect import bisect_right
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO, NamedTuple

import numpy as np

from sweeps.reading.hdf5_messages import (
    MOST_RANK,
    OWN_TYPES,
    Damaged,
    Unknown,
    after_name,
    check_atomic,
    check_layout,
    check_message,
    check_name,
    dataspace,
    expect,
    fill_value,
    padded,
    uint,
    verify,
)
from sweeps.reading.regular_files import opened_file

__all__ = ["SIGNATURE", "not_walked", "signature_place"]

SIGNATURE = b"\x89HDF\r\n\x1a\n"

_LARGEST_START = 1 << 30
_UNDEFINED = (1 << 64) - 1

MOST_STEPS = 5_000_000
"""Structures and objects of heaps of one file that are walked: some seconds."""

LARGEST_METADATA = 1 << 28
"""Bytes of one structure that are read at once."""

MOST_DIMENSIONS = 1 << 16
"""Dimensions of a file. netCDF makes a list as long as the largest number of one."""

DEEPEST_TYPE = 16
"""Types within types; netCDF allows compounds of arrays of compounds."""


def signature_place(stream: IO[bytes]) -> int:
    """Where the signature of HDF5 is, at one of the places where it may be; -1 where it is not."""
    place = 0
    while place <= _LARGEST_START:
        stream.seek(place)
        here = stream.read(len(SIGNATURE))
        if here == SIGNATURE:
            return place
        if len(here) < len(SIGNATURE):
            break
        place = 2 * place or 512
    return -1


def not_walked(path: Path) -> str:
    """Walk the metadata of an HDF5 file; why the walk could not clear it, empty where it did.

    Raises
    ------
    OSError
        Where it cannot be read, or is damaged in a way that the library might not survive.
    """
    with opened_file(path) as stream:
        place = signature_place(stream)
        if place:
            return "begins with a block of the user's" if place > 0 else "not HDF5"
        walk = _Walk(stream)
        try:
            walk.file()
        except Unknown as error:
            return str(error)
        except (struct.error, IndexError):
            return "a structure that ends too early"
        except RecursionError:
            return "types nested deeply"
        except Damaged as error:
            raise OSError(errno.EINVAL, f"damaged: {error}") from None
    return ""


class _Leaf(NamedTuple):
    """A reference within a value: where it is, and what it refers to.

    `base` is the type of the values of a sequence in a global heap; None for the address of an
    object.
    """

    offset: int
    base: _Type | None


class _Type(NamedTuple):
    """A datatype: bytes of a value, and the references that it has."""

    size: int
    leaves: tuple[_Leaf, ...]


class _Heap(NamedTuple):
    """A fractal heap: its blocks by their offset, and how its object IDs are made."""

    offsets: list[int]
    blocks: list[tuple[int, int]]
    offset_size: int
    length_size: int
    id_size: int
    huge: dict[int, tuple[int, int]]


class _Object:
    """What the messages of an object header say."""

    def __init__(self) -> None:
        self.type: _Type | None = None
        self.space: tuple[int, int] | None = None
        self.kinds: Counter[int] = Counter()
        self.scales: list[int] = []
        self.layout: bytes | None = None
        self.filtered = False
        self.group = False
        self.fill = b""


def _bytes_for(limit: int) -> int:
    """Bytes in which HDF5 stores numbers up to a limit."""
    return max(limit.bit_length() - 1, 0) // 8 + 1


_REPEATED = {0x00, 0x06, 0x0C}
"""Types of messages that a header may have more than once: nothing, links, attributes."""


class _Walk:
    """One walk through a file; see the module."""

    def __init__(self, stream: IO[bytes]) -> None:
        self.stream = stream
        self.size = stream.seek(0, 2)
        self.steps = 0
        self.seen: set[int] = set()
        self.links: list[int] = []
        self.objects: list[int] = []
        self.collections: dict[int, dict[int, tuple[int, int]]] = {}
        self.types: dict[int, _Type] = {}
        self.named: set[int] = set()
        self.current = _Object()

    # --- reading ----------------------------------------------------------------------------------

    def at(self, address: int, length: int, what: str) -> bytes:
        """Bytes of a structure, which lies inside the file."""
        self.step()
        if address + length > self.size:
            raise Damaged(f"{what} at byte {address} ends outside the file")
        if length > LARGEST_METADATA:
            raise Unknown(f"{what} of {length} bytes")
        self.stream.seek(address)
        data = self.stream.read(length)
        if len(data) < length:
            raise Damaged(f"{what} at byte {address} ends outside the file")
        return data

    def once(self, address: int, length: int, signature: bytes, what: str) -> bytes:
        """Bytes of a structure with a signature, which nothing else leads to."""
        if address in self.seen:
            raise Damaged(f"{what} at byte {address} is reached twice")
        self.seen.add(address)
        data = self.at(address, length, what)
        if data[:4] != signature:
            raise Damaged(f"no {what} at byte {address}, where one should be")
        return data

    def step(self, count: int = 1) -> None:
        self.steps += count
        if self.steps > MOST_STEPS:
            raise Unknown(f"more than {MOST_STEPS} structures")

    # --- superblock and object headers ------------------------------------------------------------

    def file(self) -> None:
        """Walk all that the superblock leads to."""
        data = self.at(0, 48, "superblock")
        version, offsets, lengths, _, base, extension, end, root = struct.unpack_from(
            "<4B4Q", data, 8
        )
        if version not in (2, 3):
            raise Unknown(f"superblock of version {version}")
        if (offsets, lengths, base, extension) != (8, 8, 0, _UNDEFINED):
            raise Unknown("superblock with an extension or other sizes")
        verify(data, 0, "superblock")
        if end > self.size:
            raise Damaged(f"{self.size} bytes of {end}")
        self.links.append(root)
        self.objects.append(root)
        walked: dict[int, bool] = {}
        while self.objects:
            address = self.objects.pop()
            if address not in walked:
                walked[address] = self.object(address)
        for address, count in Counter(self.links).items():
            if walked[address] and count > 1:
                raise Damaged(f"group at byte {address} is held twice, perhaps by itself")

    def object(self, address: int) -> bool:
        """Walk an object header and what it leads to; whether it is a group."""
        outer, self.current = self.current, _Object()
        found = self.current
        for kind, flags, body in self.messages(address):
            self.message(kind, flags, body, found)
        self.current = outer
        if any(count > 1 for kind, count in found.kinds.items() if kind not in _REPEATED):
            raise Unknown("a header that says something twice")
        if any(found.space is None or count != found.space[0] for count in found.scales):
            raise Unknown("dimensions that are not those of their variable")
        if found.group == (found.type is not None):
            raise Unknown("an object that is neither a group, a variable nor a type")
        if found.layout is not None:
            self.values(found)
        elif found.type is not None:  # a committed type
            self.types[address] = found.type
        return found.group

    def messages(self, address: int) -> Iterator[tuple[int, int, bytes]]:
        """Messages of an object header and its continuations: type, flags, body."""
        head = self.once(address, 6, b"OHDR", "object header")
        if head[4] != 2:
            raise Damaged(f"object header at byte {address} of version {head[4]}")
        flags = head[5]
        if flags & ~0x3F:
            raise Unknown(f"object header with flags {flags}")
        start = 6 + (16 if flags & 0x20 else 0) + (4 if flags & 0x10 else 0)
        width = 1 << (flags & 3)
        size = int.from_bytes(self.at(address + start, width, "object header"), "little")
        blocks = [(address, start + width, size)]
        ordered = 2 if flags & 4 else 0
        while blocks:
            begin, place, size = blocks.pop()
            size += place
            data = self.at(begin, size + 4, "object header")
            verify(data, begin, "object header")
            while place + 4 + ordered <= size:
                self.step()
                kind, length, marks = struct.unpack_from("<BHB", data, place)
                place += 4 + ordered
                if place + length > size:
                    raise Damaged(f"a message at byte {begin + place} ends outside its header")
                body = data[place : place + length]
                place += length
                if kind != 0x10:
                    yield kind, marks, body
                    continue
                where, more = struct.unpack_from("<2Q", body)
                if more < 8:
                    raise Damaged(f"continuation at byte {where} of {more} bytes")
                self.once(where, 4, b"OCHK", "continuation of an object header")
                blocks.append((where, 4, more - 8))

    def message(self, kind: int, flags: int, body: bytes, found: _Object) -> None:
        """Take from a message what it leads to."""
        shared = bool(flags & 2)
        if shared and kind not in (0x03, 0x0C):
            raise Unknown(f"shared message of type {kind}")
        check_message(kind, flags, body)
        found.kinds[kind] += 1
        if kind == 0x01:
            rank, count, end = dataspace(body)
            expect(end == len(body), "a dataspace")
            found.space = rank, count
        elif kind == 0x02:
            found.group = True
            self.dense(body, 8, self.link, 5)
        elif kind == 0x03:
            found.type, end = self.shared_type(body) if shared else self.datatype(body, 0, 0)
            expect(end == len(body), "a type")
        elif kind == 0x05:
            found.fill = fill_value(body)
        elif kind == 0x06:
            found.group = True
            self.link(body)
        elif kind == 0x08:
            found.layout = body
        elif kind == 0x0B:
            found.filtered = True
        elif kind == 0x0C:
            if shared:
                raise Unknown("shared attribute")
            self.attribute(body)
        elif kind == 0x15:
            self.dense(body, 2, self.attribute, 8)
        elif kind not in (0x00, 0x04, 0x0A, 0x0E, 0x12, 0x16):
            raise Unknown(f"message of type {kind}")

    def link(self, body: bytes) -> None:
        """Remember where a hard link leads."""
        version, flags = body[0], body[1]
        expect(flags < 0x20, "a link")
        place = 2
        kind = 0
        if flags & 8:
            kind = body[place]
            place += 1
        place += 8 if flags & 4 else 0
        if flags & 0x10:
            expect(body[place] < 2, "a link")
            place += 1
        width = 1 << (flags & 3)
        length = uint(body, place, width)
        place += width
        check_name(body[place : place + length])
        place += length
        if version != 1 or kind:
            raise Unknown("a link that is no hard link")
        address = uint(body, place, 8)
        expect(place + 8 == len(body), "a link")
        self.links.append(address)
        self.objects.append(address)

    # --- dense storage: fractal heaps with their indexes ------------------------------------------

    def dense(self, body: bytes, order_size: int, take: Callable[[bytes], None], kind: int) -> None:
        """Walk a heap of links or attributes and the two B-trees that index it."""
        flags = body[1]
        place = 2 + (order_size if flags & 1 else 0)
        address = uint(body, place, 8)
        indexes = [uint(body, place + 8, 8)]
        if flags & 2:
            indexes.append(uint(body, place + 16, 8))
        if address == _UNDEFINED:
            return
        heap = self.fractal_heap(address, 7 if kind == 5 else 8)
        found: list[list[bytes]] = []
        for number, index in enumerate(indexes):
            begin = 0 if kind == 8 else 8 if number else 4
            found.append([])
            for record in self.records(index, kind + number):
                found[-1].append(record[begin : begin + heap.id_size])
                if kind == 8 and record[8] & 2:
                    raise Unknown("shared attribute")
        if any(len({*f}) != len(f) or {*f} != {*found[0]} for f in found):
            raise Unknown("indexes that do not agree")
        for identity in found[0]:
            take(self.of_heap(heap, identity))

    def fractal_heap(self, address: int, expected: int) -> _Heap:
        """Walk the blocks of a fractal heap, whose IDs have the bytes that are expected."""
        form = struct.Struct("<4sBHHBI12QHQQHHQH")
        head = self.once(address, form.size + 4, b"FRHP", "fractal heap")
        verify(head, address, "fractal heap")
        (
            _, version, id_size, filters, flags, largest, _, huge_tree, *_,
            huge_count, _, tiny_count, width, start, most_direct, bits, _, root, rows,
        ) = form.unpack_from(head)  # fmt: skip
        if version or filters or tiny_count or id_size != expected:
            raise Unknown("fractal heap that is filtered, or of another version or kind")
        powers = (start, most_direct, width)
        if not all(n and n & (n - 1) == 0 for n in powers) or start > most_direct or bits > 64:
            raise Damaged(f"fractal heap at byte {address} with blocks of no power of two")
        found: dict[int, tuple[int, int]] = {}
        if root != _UNDEFINED:
            offset_size = -(-bits // 8)
            direct_rows = most_direct.bit_length() - start.bit_length() + 2
            extra = 13 + offset_size
            todo = [(root, 0, rows)] if rows else []
            if not rows:
                self.heap_block(root, start, extra, flags)
                found[0] = (root, start)
            while todo:
                block, offset, count = todo.pop()
                if count > bits:
                    raise Damaged(f"block of a heap at byte {block} with {count} rows")
                data = self.once(block, extra + 8 * count * width + 4, b"FHIB", "block of a heap")
                verify(data, block, "block of a heap")
                for row in range(count):
                    size = start << max(row - 1, 0)
                    for child in struct.unpack_from(f"<{width}Q", data, extra + 8 * row * width):
                        if child != _UNDEFINED and row < direct_rows:
                            self.heap_block(child, size, extra, flags)
                            found[offset] = (child, size)
                        elif child != _UNDEFINED:
                            inner = size.bit_length() - (start * width).bit_length() + 1
                            todo.append((child, offset, inner))
                        offset += size
        huge: dict[int, tuple[int, int]] = {}
        if huge_tree != _UNDEFINED:
            for record in self.records(huge_tree, 1):
                where, length, identity = struct.unpack_from("<3Q", record)
                huge[identity] = (where, length)
        if len(huge) != huge_count or largest > most_direct:
            raise Unknown("fractal heap that does not know its own objects")
        offsets = sorted(found)
        return _Heap(
            offsets, [found[o] for o in offsets], -(-bits // 8),
            min((most_direct.bit_length() + 6) // 8, _bytes_for(largest)), id_size, huge,
        )  # fmt: skip

    def heap_block(self, address: int, size: int, extra: int, flags: int) -> None:
        """Verify a block of a fractal heap that has objects."""
        data = self.once(address, size, b"FHDB", "block of a heap")
        if flags & 2:  # the checksum stands before the objects, and counts as 0 in itself
            plain = data[:extra] + bytes(4) + data[extra + 4 :] + data[extra : extra + 4]
            verify(plain, address, "block of a heap")

    def of_heap(self, heap: _Heap, identity: bytes) -> bytes:
        """An object of a fractal heap."""
        kind = identity[0] >> 4
        if kind == 0:
            offset = uint(identity, 1, heap.offset_size)
            length = uint(identity, 1 + heap.offset_size, heap.length_size)
            number = bisect_right(heap.offsets, offset) - 1
            if number < 0 or offset + length > heap.offsets[number] + heap.blocks[number][1]:
                raise Damaged(f"object at {offset} of a heap lies in none of its blocks")
            return self.at(
                heap.blocks[number][0] + offset - heap.offsets[number], length, "object of a heap"
            )
        if kind == 1 and heap.id_size < 17:
            number = uint(identity, 1, min(8, heap.id_size - 1))
            if number not in heap.huge:
                raise Damaged(f"huge object {number} of a heap is not in its index")
            return self.at(*heap.huge[number], "object of a heap")
        raise Unknown("object of a heap that is neither managed nor huge")

    def records(self, address: int, kind: int) -> Iterator[bytes]:
        """Records of a B-tree of version 2, of the kind that is expected."""
        form = struct.Struct("<4sBBIHHBBQHQ")
        head = self.once(address, form.size + 4, b"BTHD", "B-tree")
        verify(head, address, "B-tree")
        _, version, found, node, size, depth, _, _, root, count, total = form.unpack_from(head)
        smallest = {1: 24, 5: 11, 6: 15, 8: 17, 9: 13}[kind]
        if version or found != kind or size != smallest:
            raise Unknown(f"B-tree of type {found}")
        if node < 64 or depth > 32:
            raise Damaged(f"B-tree at byte {address} with nodes of {node} bytes, {depth} deep")
        # How many records a node of each level may have, which says how its pointers are stored.
        most = [(node - 10) // size]
        together = [most[0]]
        pointer = [0]
        narrow = _bytes_for(most[0])
        for level in range(1, depth + 1):
            pointer.append(8 + narrow + (_bytes_for(together[-1]) if level > 1 else 0))
            most.append((node - 10 - pointer[-1]) // (size + pointer[-1]))
            if most[-1] < 1:
                raise Damaged(f"B-tree at byte {address} whose nodes have no room")
            together.append((most[-1] + 1) * together[-1] + most[-1])
        if root == _UNDEFINED:
            return
        todo = [(root, count, depth)]
        number = 0
        while todo:
            place, count, level = todo.pop()
            if count > most[level]:
                raise Damaged(f"node of a B-tree at byte {place} with {count} records")
            data = self.once(place, node, b"BTIN" if level else b"BTLF", "node of a B-tree")
            end = 6 + count * size + (count + 1) * pointer[level] * bool(level)
            verify(data[: end + 4], place, "node of a B-tree")
            self.step(count)
            number += count
            for i in range(count):
                yield data[6 + i * size : 6 + (i + 1) * size]
            if level:
                begin = 6 + count * size
                for i in range(count + 1):
                    here = begin + i * pointer[level]
                    todo.append((uint(data, here, 8), uint(data, here + 8, narrow), level - 1))
        if number != total:
            raise Damaged(f"B-tree at byte {address}: {number} of {total} records")

    # --- types ------------------------------------------------------------------------------------

    def shared_type(self, body: bytes) -> tuple[_Type, int]:
        """Type that an object of its own holds, and where the reference to it ends."""
        version, kind = body[0], body[1]
        if version not in (1, 2, 3) or (version == 3 and kind != 2):
            raise Unknown("shared type that is not committed")
        place = 8 if version == 1 else 2
        address = uint(body, place, 8)
        if address not in self.types:
            self.object(address)
        if address not in self.types:
            raise Damaged(f"no type at byte {address}, where one should be")
        return self.types[address], place + 8

    def datatype(self, data: bytes, place: int, depth: int) -> tuple[_Type, int]:
        """A datatype, and where it ends."""
        if depth > DEEPEST_TYPE:
            raise Unknown("types nested deeply")
        self.step()
        first, bits, size = data[place], uint(data, place + 1, 3), uint(data, place + 4, 4)
        kind, version = first & 15, first >> 4
        place += 8
        if not 1 <= version <= 3 or not size:
            raise Unknown(f"type of version {version} and {size} bytes")
        if kind < 6:
            return _Type(size, ()), place + check_atomic(kind, bits, size, data[place : place + 12])
        if kind in (6, 8):
            expect(not bits >> 16 and bits, "a type of members")
        if kind == 6:
            return self.compound(data, place, depth, version, bits & 0xFFFF, size)
        if kind == 7:
            expect(not bits and size == 8, "a type of references")
            return _Type(size, (_Leaf(0, None),)), place
        if kind == 8:
            expect(data[place] & 15 == 0, "a type of names")
            base, place = self.datatype(data, place, depth + 1)
            expect(base.size == size, "a type of names")
            for _ in range(bits & 0xFFFF):
                place = after_name(data, place, version)
            return _Type(size, ()), place + (bits & 0xFFFF) * base.size
        if kind == 9:
            expect(bits & 15 < 2 and bits >> 4 & 15 < 3 and bits >> 8 < 2, "a type of sequences")
            expect(size == 16, "a type of sequences")
            base, place = self.datatype(data, place, depth + 1)
            return _Type(size, (_Leaf(0, base),)), place
        if kind == 10:
            count = data[place]
            place += 1 if version == 3 else 4
            dims = struct.unpack_from(f"<{count}I", data, place)
            base, place = self.datatype(
                data, place + 4 * count * (1 if version == 3 else 2), depth + 1
            )
            expect(not bits and 0 < count <= MOST_RANK, "a type of arrays")
            expect(math.prod(dims) * base.size == size, "a type of arrays")
            if base.leaves:
                raise Unknown(f"array of references over {dims}")
            return _Type(size, ()), place
        raise Unknown(f"type of class {kind}")

    def compound(
        self, data: bytes, place: int, depth: int, version: int, count: int, size: int
    ) -> tuple[_Type, int]:
        """A compound type, and where it ends."""
        leaves: list[_Leaf] = []
        for _ in range(count):
            place = after_name(data, place, version)
            width = 4 if version < 3 else _bytes_for(size)
            offset = uint(data, place, width)
            place += width
            if version == 1:
                if data[place]:
                    raise Unknown("arrays in a compound of version 1")
                place += 28
            member, place = self.datatype(data, place, depth + 1)
            if offset + member.size > size:
                raise Damaged("a member of a compound ends outside it")
            leaves += [_Leaf(offset + leaf.offset, leaf.base) for leaf in member.leaves]
        return _Type(size, tuple(leaves)), place

    # --- values -----------------------------------------------------------------------------------

    def attribute(self, body: bytes) -> None:
        """Walk what the value of an attribute leads to."""
        version, flags, name, kind, space = struct.unpack_from("<BBHHH", body)
        if version not in (1, 2, 3) or flags > (version > 1):
            raise Unknown(f"attribute of version {version} with flags {flags}")
        if version == 3:
            expect(body[8] < 2, "an attribute")
        place = 9 if version == 3 else 8
        pad = padded if version == 1 else int
        if body[place + name - 1]:
            raise Unknown("a name that does not end")
        called = body[place : place + name - 1]
        check_name(called)
        place += pad(name)
        shared = version > 1 and flags & 1
        if called in OWN_TYPES and (shared or not OWN_TYPES[called](body[place:])):
            raise Unknown(f"{called.decode()} of another type")
        if shared:
            found, end = self.shared_type(body[place : place + kind])
        else:
            found, end = self.datatype(body[place : place + kind], 0, 0)
        expect(end == kind, "the type of an attribute")
        place += pad(kind)
        _, count, end = dataspace(body[place : place + space])
        expect(end == space, "the dataspace of an attribute")
        place += pad(space)
        if place + count * found.size > len(body):
            raise Damaged("the value of an attribute ends outside it")
        expect(place + count * found.size == len(body), "the value of an attribute")
        if found.leaves:
            values = body[place : place + count * found.size]
            self.references(values, found)
        if called in (b"_Netcdf4Dimid", b"_Netcdf4Coordinates"):
            numbers = struct.unpack_from(f"<{count}I", body, place)
            if count and max(numbers) >= MOST_DIMENSIONS:
                raise Damaged(f"dimension {max(numbers)}, of which netCDF would make a list")
        if called == b"DIMENSION_LIST":  # netCDF takes the first of each without looking
            if not all(
                uint(values, n, 4) and uint(values, n + 4, 8) for n in range(0, 16 * count, 16)
            ):
                raise Unknown("a list of dimensions with none in it")
            self.current.scales.append(count)

    def values(self, found: _Object) -> None:
        """Walk where the values of a variable lie, and what they refer to."""
        body = found.layout or b""
        kind = found.type
        if kind is None or len(body) < 2 or body[0] != 3:
            raise Unknown(f"values stored by version {body[0] if body else 0}")
        if found.space is None:
            raise Unknown("a variable without a dataspace")
        check_layout(body, *found.space, kind.size)
        expect(len(found.fill) in (0, kind.size), "a fill value")
        if kind.leaves and found.fill:
            self.references(found.fill, kind)
        if body[1] == 0:
            if kind.leaves:
                self.references(body[4 : 4 + uint(body, 2, 2)], kind)
        elif body[1] == 1:
            address, size = struct.unpack_from("<2Q", body, 2)
            if address == _UNDEFINED:
                return
            if address + size > self.size:
                raise Damaged(f"values at byte {address} end outside the file")
            if kind.leaves:
                self.references(self.at(address, size, "values"), kind)
        elif body[1] == 2:
            dims = body[2]
            chunks = self.chunks(uint(body, 3, 8), dims)
            for size, address in chunks if kind.leaves else []:
                if found.filtered:
                    raise Unknown("compressed references")
                self.references(self.at(address, size, "values"), kind)
        else:
            raise Unknown("values stored elsewhere")

    def chunks(self, root: int, dims: int) -> list[tuple[int, int]]:
        """Sizes and addresses of all chunks of a variable, from a B-tree of version 1."""
        if root == _UNDEFINED:
            return []
        entry = np.dtype(
            [("size", "<u4"), ("mask", "<u4"), ("at", "<u8", (dims,)), ("child", "<u8")]
        )
        chunks: list[tuple[int, int]] = []
        todo = [(root, -1)]
        while todo:
            place, expected = todo.pop()
            head = self.once(place, 24, b"TREE", "B-tree of chunks")
            kind, level, used = head[4], head[5], uint(head, 6, 2)
            if kind != 1 or used > 64 or level > 32:
                raise Unknown(f"B-tree of chunks with nodes of {used} entries")
            if expected not in (-1, level):
                raise Damaged(f"B-tree of chunks at byte {place} whose level does not fall")
            data = self.at(place + 24, used * entry.itemsize, "B-tree of chunks")
            entries = np.frombuffer(data, entry)
            if level:
                todo += [(int(child), level - 1) for child in entries["child"]]
                continue
            ends = entries["child"] + entries["size"]
            if (ends > self.size).any() or (ends < entries["child"]).any():
                raise Damaged(f"a chunk in the B-tree at byte {place} ends outside the file")
            chunks += zip(entries["size"].tolist(), entries["child"].tolist(), strict=True)
        return chunks

    def references(self, data: bytes, kind: _Type) -> None:
        """Walk the heaps that values refer to."""
        todo = [(data, kind)]
        while todo:
            data, kind = todo.pop()
            for leaf in kind.leaves:
                base = leaf.base
                for place in range(leaf.offset, len(data) - kind.size + leaf.offset + 1, kind.size):
                    self.step()
                    if base is None:
                        self.reference(uint(data, place, 8))
                        continue
                    count, address, number = struct.unpack_from("<IQI", data, place)
                    if not count or not address:
                        continue
                    inside = self.collection(address)
                    if number not in inside or count * base.size > inside[number][1]:
                        raise Damaged(f"global heap at byte {address} has no such object {number}")
                    if base.leaves:
                        begin, _ = inside[number]
                        todo.append((self.at(begin, count * base.size, "object of a heap"), base))

    def reference(self, address: int) -> None:
        """Remember the object that a reference leads to."""
        if address not in (0, _UNDEFINED) and address not in self.named:
            self.named.add(address)
            self.objects.append(address)

    def collection(self, address: int) -> dict[int, tuple[int, int]]:
        """Objects of a global heap: where each begins, and how long it is."""
        if address in self.collections:
            return self.collections[address]
        head = self.once(address, 16, b"GCOL", "global heap")
        size = uint(head, 8, 8)
        if head[4] != 1 or size < 32:
            raise Damaged(f"global heap at byte {address} of {size} bytes")
        data = self.at(address, size, "global heap")
        form = struct.Struct("<H6xQ")
        found: dict[int, tuple[int, int]] = {}
        place = 16
        while place + 16 <= size:
            self.step()
            number, length = form.unpack_from(data, place)
            # The free space, which has no number, counts with its own header.
            room = padded(length) + 16 if number else length
            if room < 16 or place + room > size:
                raise Damaged(f"global heap at byte {address}: object {number} of {length} bytes")
            if number:
                found[number] = (address + place + 16, length)
            place += room
        self.collections[address] = found
        return found
