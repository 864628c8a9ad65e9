"""The fuzzer: some inputs of each of its targets, the same in every run."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tomllib
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import netCDF4
import psutil
import pytest
from hypothesis import HealthCheck, given, settings

from benchmarks.fuzz import damage
from benchmarks.fuzz.__main__ import TARGETS
from benchmarks.fuzz.checking import COUNTS, in_one_line, refused_or_taken
from benchmarks.fuzz.damage import read_damaged
from benchmarks.fuzz.damaged_bytes import sound_files
from benchmarks.fuzz.hdf5_spans import checksum, spans
from benchmarks.fuzz.sandbox import engines, scenes
from benchmarks.tables import toml_text
from sweeps.reading.design_files import read_designs

ROOT = Path(__file__).resolve().parents[2]

EXAMPLES = {"figures": 3, "archive": 12, "engine": 12}
"""Inputs of a target where they take long; else as many as the profile says."""


@pytest.mark.parametrize("name", list(TARGETS))
def test_hostile_input_is_taken_or_refused_in_one_line(name: str) -> None:
    make, check = TARGETS[name]
    count = EXAMPLES.get(name, settings.default.max_examples if settings.default else 25)

    @settings(max_examples=count, suppress_health_check=list(HealthCheck))
    @given(make())
    def run(example: Any) -> None:
        check(example)

    before = sum(COUNTS.values())
    run()
    assert sum(COUNTS.values()) > before


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="has no such files")
def test_a_campaign_counts_what_it_made(tmp_path: Path) -> None:
    part = tmp_path / "fuzz.json"
    words = [sys.executable, "-m", "benchmarks.fuzz", "--target", "table", "--seconds", "0.1"]
    words += ["--part", str(part)]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    first, counts = done.stdout.splitlines()
    assert first.startswith("seed ")
    assert json.loads(counts.removeprefix("table: "))["refused"] > 0
    assert json.loads(part.read_text(encoding="utf-8"))["wrong"] == []


def test_written_toml_is_what_was_meant() -> None:
    for data in (*scenes().values(), *engines().values()):
        tree = tomllib.loads(data.decode())
        assert tomllib.loads(toml_text(tree)) == tree


@pytest.mark.skipif(not hasattr(os, "fork"), reason="reads them in forks")
def test_damaged_bytes_are_taken_or_refused(tmp_path: Path) -> None:
    counts = read_damaged(range(120), 3, tmp_path)
    assert counts["files"] == 120
    assert 20 < counts["taken"] < 100


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="reads them in forks")
def test_a_campaign_of_damage_finds_what_hangs_and_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A worker that hangs is killed, its file kept; what was read is not read again."""
    slow = "import time\nfrom benchmarks.fuzz import damage\nread = damage.Reader.read\n"
    slow += "def late(self, number, seed):\n    if number == 2:\n        time.sleep(3600)\n"
    slow += "    read(self, number, seed)\ndamage.Reader.read = late\ndamage.work(*given)\n"

    class Late:
        """Starts a process that is patched."""

        @staticmethod
        def Pipe() -> Any:
            return get_context("spawn").Pipe()

        @staticmethod
        def Process(target: Any, args: Any, daemon: bool) -> Any:
            return get_context("spawn").Process(
                target=exec, args=(slow, {"given": args}), daemon=daemon
            )

    monkeypatch.setattr(damage, "get_context", lambda method: Late)
    monkeypatch.setattr(damage, "LONGEST", 1.0)
    counts = damage.campaign(tmp_path, 5, 4, 1, 600.0)
    assert counts["wrong"] == 1 and (tmp_path / "2.nc").exists()
    before = dict(counts)
    assert damage.campaign(tmp_path, 5, 4, 1, 600.0) == before


def test_checksum_of_a_known_text() -> None:
    """Jenkins's own example, in lookup3.c (driver5)."""
    assert checksum(b"Four score and seven years ago") == 0x17770551
    assert checksum(b"") == 0xDEADBEEF


def test_structures_of_a_file_are_found() -> None:
    for name, data in sound_files().items():
        if not data.startswith(b"\x89HDF"):
            continue
        found = [data[begin : begin + 4] for begin, _, _ in spans(data)]
        assert found[0] == data[:4] and {b"OHDR", b"FRHP", b"BTHD", b"BTLF", b"FHIB"} & {*found}
        assert found.count(b"OHDR") == data.count(b"OHDR"), name


@pytest.mark.parametrize("name", [b"_Netcdf4Dimid", b"DIMENSION_LIST", b"CLASS", b"half_width"])
def test_attributes_that_netcdf_would_not_write(name: bytes, tmp_path: Path) -> None:
    """A list of dimensions that said it was a list of texts crashed the library, a type that it
    refuses while netCDF opens the file ended a later close, and a number of a dimension made a list
    of 11 GB."""
    path = tmp_path / "a.nc"
    with netCDF4.Dataset(path, "w") as file:
        file.scene = "{}"
        for axis in "ab":
            file.createDimension(axis, 2)
            file.createVariable(axis, "f8", (axis,)).setncattr("half_width", 0.25)
        file.createVariable("both", "f8", ("a", "b"))
    sound = path.read_bytes()
    places = spans(sound)
    begin = sound.index(name + b"\0")
    for place in (begin - 8, begin - 1, *range(begin + len(name) + 1, begin + len(name) + 40, 2)):
        data = bytearray(sound)
        data[place] ^= 87 if name == b"_Netcdf4Dimid" else 1
        for start, end, checked in places:
            if checked and data[start:end] != sound[start:end]:
                data[end : end + 4] = checksum(bytes(data[start:end])).to_bytes(4, "little")
        path.write_bytes(data)
        in_one_line("info", path)
        before = psutil.Process().memory_info().rss
        refused_or_taken(lambda: read_designs(path, "damaged"))
        assert psutil.Process().memory_info().rss - before < 500e6
