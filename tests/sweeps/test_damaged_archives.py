"""Damaged archives: refused in one line and with status 2, and none runs for ever."""

import ctypes
import os
import random
import signal
import struct
import subprocess
import sys
import time
import tomllib
from pathlib import Path
from typing import Any

import psutil
import pytest

import sweeps
from sweeps.base.errors import SceneError
from sweeps.base.netcdf import netcdf_child, netcdf_whole
from tests.support.archives import PLAIN, run, sound_archive
from tests.support.commands import invoke, ok, refused
from tests.support.tiers import all_but
from tests.sweeps.processes import COMMAND, ROOT, python

READING = ("info", "show", "compare", "export", "plot", "rerun", "merge", "extend")
"""Commands that read archives."""


def words(command: str, path: Path, folder: Path) -> list[str | Path]:
    """A command line that reads an archive."""
    other, table = folder / "sound.nc", folder / "out.csv"
    if command in ("compare", "merge"):
        other.write_bytes(sound_archive())
    output = ["-o", table if command == "export" else folder / "out.nc"]
    more: dict[str, list[str | Path]] = {
        "compare": [other], "merge": [other, *output], "extend": ["--axis", "speed=1800"],
        "export": output, "plot": output, "rerun": output,
    }  # fmt: skip
    return [command, path, *more.get(command, [])]


@pytest.mark.parametrize("size", all_but((0, 3000, 0.9), (0, 100, 3000, 0.5, 0.9)))
def test_cut_archives(size: float, tmp_path: Path) -> None:
    path, whole = tmp_path / "cut.nc", sound_archive()
    path.write_bytes(whole[: int(size * len(whole)) if size < 1 else int(size)])
    # All open by one door: one archive goes through every command.
    for command in READING if size == 100 else ("info", "export"):
        assert str(path) in refused(*words(command, path, tmp_path))


def free_space(data: bytes) -> int:
    """Where the size of the free space of the first global heap is."""
    place = data.index(b"GCOL") + 16
    while struct.unpack_from("<H", data, place)[0]:
        place += 16 + -(-struct.unpack_from("<Q", data, place + 8)[0] // 8) * 8
    return place + 8


def with_zero_size() -> bytes:
    data = bytearray(sound_archive())
    place = free_space(data)
    data[place : place + 8] = bytes(8)
    return bytes(data)


def with_damaged_stretch() -> bytes:
    """Zeros over the last objects of the heap and over the size of its free space."""
    data = bytearray(sound_archive())
    place = free_space(data)
    data[place - 250 : place + 250] = bytes(500)
    return bytes(data)


@pytest.mark.slow
@pytest.mark.parametrize("make", [with_zero_size, with_damaged_stretch])
def test_a_heap_without_sizes_does_not_hang(
    make: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.nc"
    path.write_bytes(make())
    # In a process of its own first: inside the library this test could not be stopped.
    code = "from sweeps.base.netcdf import netcdf_child\nnetcdf_child.SECONDS = 0.3\n" + COMMAND
    done = python(code, "info", path, timeout=600)
    assert done.returncode == 2, done.stderr
    monkeypatch.setattr(netcdf_child, "SECONDS", 0.3)
    # All open by one door: see the cut archives.
    told = refused("rerun", path, "-o", tmp_path / "out.nc")
    assert f"{path}: not a netCDF archive (damaged: " in told
    if make is with_zero_size and sys.platform != "win32":
        # On a busy machine its time by the clock ends first.
        assert "reading it takes more than 0.3 s" in told or "takes longer than" in told
    assert [*tmp_path.iterdir()] == [path]


@pytest.mark.slow
def test_archives_with_single_flipped_bits(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Ten of them; `make damage` has many thousands."""
    monkeypatch.setattr(netcdf_child, "SECONDS", 0.5)
    sound, draw = sound_archive(), random.Random(20)
    # Metadata, which is a small part of an archive, and values.
    starts = [sound.index(mark) for mark in (b"GCOL", b"FHIB")]
    starts += [i for i in range(len(sound)) if sound[i : i + 4] in (b"OHDR", b"FRHP", b"BTHD")]
    for number in range(10):
        data = bytearray(sound)
        start = draw.choice(starts) + draw.randrange(300)
        data[start if number % 2 else draw.randrange(len(data))] ^= 1 << draw.randrange(8)
        path = tmp_path / f"{number}.nc"
        path.write_bytes(data)
        for command in ("info", "export"):
            result = invoke(*words(command, path, tmp_path))
            (tmp_path / "out.csv").unlink(missing_ok=True)
            assert result.exit_code in (0, 2), (number, result.stderr)
            assert result.exit_code == 0 or result.stderr.count("\n") == 1


def test_a_group_that_holds_itself(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "a.nc"
    path.write_bytes(sound_archive())
    library = netcdf_whole._library()
    if library is None:
        pytest.skip("the library of HDF5 is not found")
    file = library.H5Fopen(os.fsencode(path), 1, 0)
    link = library.H5Lcreate_hard
    number, text = ctypes.c_int64, ctypes.c_char_p
    link.argtypes = [number, text, number, text, number, number]
    assert link(file, b"/", file, b"again", 0, 0) >= 0
    library.H5Fclose(file)
    for command in READING:
        told = refused(*words(command, path, tmp_path))
        assert "perhaps by itself" in told
    assert netcdf_whole.external_member(path)
    assert capfd.readouterr().err == ""


def test_values_that_cannot_be_read(tmp_path: Path) -> None:
    """Opening reads no values, so that their damage is met by whoever uses them."""
    path = tmp_path / "a.nc"
    run(tomllib.loads(PLAIN), path, level=4)
    data = bytearray(path.read_bytes())
    starts = [i for i in range(len(data)) if data[i : i + 4] == b"TREE"]
    chunk = struct.unpack_from("<Q", data, starts[-1] + 24 + 8 + 8 * 3)[0]
    data[chunk + 2 : chunk + 60] = b"\xff" * 58
    path.write_bytes(data)
    with sweeps.open(path) as dataset, pytest.raises(SceneError, match="mean_piston_speed: cannot"):
        _ = dataset["mean_piston_speed"].values
    with (
        sweeps.open_archive(path) as dataset,
        pytest.raises(SceneError, match="mean_piston_speed: cannot"),
    ):
        dataset.load()
    (tmp_path / "b.nc").write_bytes(data)
    for line in (
        ["compare", path, tmp_path / "b.nc"],
        ["export", path, "-o", tmp_path / "out.csv"],
        ["plot", path, "-o", tmp_path / "figures"],
    ):
        assert "mean_piston_speed: cannot be read" in refused(*line)
    assert not (tmp_path / "out.csv").exists() and not (tmp_path / "figures").exists()


def test_a_child_that_takes_too_much_memory_is_ended(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.nc"
    path.write_bytes(sound_archive())
    netcdf_child._end()
    monkeypatch.setattr(netcdf_child, "OPENING", 1 << 20)
    monkeypatch.setattr(netcdf_child, "MEMORY", 0)
    assert "damaged: reading it takes more than" in refused("info", path)
    monkeypatch.undo()
    ok("info", path)


@pytest.mark.skipif(sys.platform == "win32", reason="has no such signal")
def test_a_child_that_runs_for_ever_can_be_interrupted(tmp_path: Path) -> None:
    path = tmp_path / "a.nc"
    path.write_bytes(with_zero_size())
    code = "from sweeps.base.netcdf import netcdf_child\nnetcdf_child.SECONDS = 5000.0\n"
    # A shell that runs tests in the background makes them ignore the signal.
    code += "import signal\nsignal.signal(signal.SIGINT, signal.default_int_handler)\n"
    code += "print('ready', flush=True)\n" + COMMAND
    with subprocess.Popen(
        [sys.executable, "-c", code, "info", path], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        text=True, cwd=ROOT, start_new_session=True,
    ) as command:  # fmt: skip
        assert command.stdout is not None and command.stdout.readline() == "ready\n"
        process = psutil.Process(command.pid)
        end = time.monotonic() + 600.0
        while not any(p.cpu_times().user > 1.0 for p in process.children()):  # is in the library
            assert time.monotonic() < end and command.poll() is None
            time.sleep(0.1)
        os.killpg(command.pid, signal.SIGINT)
        _, told = command.communicate(timeout=600)
    assert command.returncode == 1
    assert told == "engine-dyn: interrupted; nothing was written\n"


def test_an_index_of_chunks_that_holds_itself(tmp_path: Path) -> None:
    path = tmp_path / "a.nc"
    run(tomllib.loads(PLAIN), path, level=4)
    data = path.read_bytes()
    starts = [i for i in range(len(data)) if data[i : i + 4] == b"TREE"]
    refusals = 0
    for start in starts:
        changed = bytearray(data)
        changed[start + 5] = 1  # its level
        for rank in (1, 2):
            place = start + 24 + 8 + 8 * (rank + 1)
            changed[place : place + 8] = struct.pack("<Q", start)
        path.write_bytes(changed)
        for command in ("info", "export"):
            result = invoke(*words(command, path, tmp_path))
            (tmp_path / "out.csv").unlink(missing_ok=True)
            assert result.exit_code in (0, 2)
            refusals += "damaged: reading it ends the process" in result.stderr
    assert refusals


def test_a_child_stays_and_is_replaced(tmp_path: Path) -> None:
    sound, damaged, cut = (tmp_path / name for name in ("a.nc", "b.nc", "c.nc"))
    sound.write_bytes(sound_archive())
    damaged.write_bytes(with_damaged_stretch())
    cut.write_bytes(sound_archive()[:3000])
    netcdf_child.read_apart(sound)
    child = netcdf_child._children[-1]
    netcdf_child.read_apart(sound)
    assert netcdf_child._children[-1] is child and child.files >= 2
    # Ended by somebody else while it waited, such as by Ctrl-C in a terminal.
    child.process.kill()
    child.process.wait()
    netcdf_child.read_apart(sound)
    second = netcdf_child._children[-1]
    assert second is not child and second.files == 1
    with pytest.raises(OSError, match="damaged"):
        netcdf_child.read_apart(cut)
    assert second.process.returncode is not None and second not in netcdf_child._children
    netcdf_child.read_apart(sound)


def test_a_sound_archive_passes_the_child(tmp_path: Path) -> None:
    path = tmp_path / "a.nc"
    path.write_bytes(sound_archive())
    netcdf_child.read_apart(path)
    assert invoke("info", path, "--untrusted").stdout == invoke("info", path).stdout
    # No module of the working folder is run there.
    (tmp_path / "netCDF4.py").write_text("raise SystemExit(7)")
    before = os.getcwd()
    os.chdir(tmp_path)
    try:
        netcdf_child.read_apart(path)
    finally:
        os.chdir(before)
