"""The fuzzer: some inputs of each of its targets, the same in every run."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tomllib
from collections import Counter
from pathlib import Path
from typing import Any

import netCDF4
import psutil
import pytest
from hypothesis import HealthCheck, given, settings

from benchmarks.fuzz import damage
from benchmarks.fuzz.damaged_bytes import checksum, sound_files, spans
from benchmarks.fuzz.hostile import COUNTS, engines, in_one_line, refused_or_taken, scenes
from benchmarks.fuzz.targets import TARGETS
from benchmarks.tables import toml_text
from benchmarks.workers import Lost, answers, in_processes
from sweeps.scene.design_files.design_files import read_designs
from tests.support.tiers import all_but

ROOT = Path(__file__).resolve().parents[2]

EXAMPLES = {"figures": 2, "archive": 6, "engine": 6, "recording": 3}
"""Inputs of a target where they take long; else as many as the profile says."""


LONG = ("figures", "archive", "recording", "binary table")
"""Targets whose inputs are drawn as figures or read in processes of their own."""


@pytest.mark.parametrize("name", all_but(LONG, TARGETS))
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
    words = [sys.executable, "-m", "benchmarks", "fuzz", "--target", "table", "--seconds", "0.1"]
    words += ["--seed", "1", "-o", str(part)]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    found = json.loads(part.read_text(encoding="utf-8"))
    assert found["wrong"] == [] and found["targets"]["table"]["refused"] > 0


def test_written_toml_is_what_was_meant() -> None:
    for data in (*scenes().values(), *engines().values()):
        tree = tomllib.loads(data.decode())
        assert tomllib.loads(toml_text(tree)) == tree


in_forks = pytest.mark.skipif(not hasattr(os, "fork"), reason="reads them in forks")


@in_forks
def test_damaged_bytes_are_taken_or_refused() -> None:
    counts = Counter[str]()
    for number in range(120):
        counts.update(damage.read_damaged((number, 3)))
    assert counts["files"] == 120
    assert 20 < counts["taken"] < 100


@in_forks
@pytest.mark.slow
def test_a_campaign_of_damage_keeps_what_went_wrong(tmp_path: Path) -> None:
    counts = damage.campaign(tmp_path, 0, 3, 4, 1)
    assert counts["files"] == 3 and counts["wrong"] == 0
    # No number is a job that `int` takes: all of these go wrong.
    assert damage.campaign(tmp_path, 3, 2, 4, 1, int) == {"wrong": 2}
    assert {path.name for path in tmp_path.glob("*.nc")} == {"3.nc", "4.nc"}
    assert "TypeError" in (tmp_path / "3.txt").read_text()


def test_processes_that_crash_or_hang_are_replaced() -> None:
    jobs = ["1 + 1", "__import__('os').abort()", "1 / 0", "__import__('time').sleep(60)", "2 + 2"]
    two, crashed, wrong, hung, four = answers(eval, jobs, 1, 0.2)
    assert (two, four) == (2, 4)
    assert crashed == Lost(f"ended with status {-signal.SIGABRT}")
    assert "ZeroDivisionError" in wrong.why
    assert hung == Lost("no answer in 0.2 s")
    with pytest.raises(RuntimeError, match="ZeroDivisionError"):
        list(in_processes(eval, jobs[2:3], 1))


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


@pytest.mark.slow
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
