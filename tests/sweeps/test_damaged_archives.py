"""Damaged archives: refused in one line and with status 2, and none runs for ever."""

from __future__ import annotations

import ctypes
import io
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

import netCDF4
import numpy as np
import psutil
import pytest

import sweeps
from sweeps.errors import SceneError
from sweeps.reading import hdf5_links, hdf5_messages, hdf5_structure, netcdf_child, netcdf_files
from tests.support.archives import PLAIN, run, sound_archive
from tests.support.commands import invoke, refused

ROOT = Path(__file__).resolve().parents[2]

COMMAND = "from sweeps.cli.main import main; main()"

READING = ("info", "show", "compare", "export", "plot", "rerun", "merge", "extend")
"""Commands that read archives."""


def words(command: str, path: Path, folder: Path) -> list[str | Path]:
    """A command line that reads an archive."""
    found: list[str | Path] = [command, path]
    if command in ("compare", "merge"):
        (folder / "sound.nc").write_bytes(sound_archive())
        found.append(folder / "sound.nc")
    if command == "extend":
        found += ["--axis", "speed=1800"]
    if command in ("export", "plot", "rerun", "merge"):
        found += ["-o", folder / f"out.{'csv' if command == 'export' else 'nc'}"]
    return found


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


@pytest.mark.parametrize("make", [with_zero_size, with_damaged_stretch])
def test_a_heap_without_sizes_does_not_hang(make: Any, tmp_path: Path) -> None:
    path = tmp_path / "a.nc"
    path.write_bytes(make())
    # In a process of its own first: inside the library this test could not be stopped.
    done = subprocess.run(
        [sys.executable, "-c", COMMAND, "info", path], timeout=120, capture_output=True, text=True,
        cwd=ROOT,
    )  # fmt: skip
    assert done.returncode == 2, done.stderr
    for command in READING:
        before = set(tmp_path.iterdir())
        told = refused(*words(command, path, tmp_path))
        assert f"{path}: not a netCDF archive (damaged: " in told
        assert set(tmp_path.iterdir()) - before <= {tmp_path / "sound.nc"}


def test_archives_with_single_flipped_bits(tmp_path: Path) -> None:
    sound, draw = sound_archive(), random.Random(20)
    # Metadata, which is a small part of an archive, and values.
    starts = [sound.index(mark) for mark in (b"GCOL", b"FHIB")]
    starts += [i for i in range(len(sound)) if sound[i : i + 4] in (b"OHDR", b"FRHP", b"BTHD")]
    for number in range(60):
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
    library = hdf5_links._library()
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
    # Without the walk too, nothing is printed by the library's callback.
    assert hdf5_links.external_member(path)
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


# --- the walk -------------------------------------------------------------------------------------


def test_what_run_writes_is_cleared_by_its_metadata(tmp_path: Path) -> None:
    path = tmp_path / "a.nc"
    for level in (0, 4):
        run(tomllib.loads(PLAIN), path, level=level, overwrite=path.exists())
        assert hdf5_structure.not_walked(path) == ""
    for data in (sound_archive(), sound_archive(True)):
        path.write_bytes(data)
        assert hdf5_structure.not_walked(path) == ""
    assert hdf5_structure.not_walked(ROOT / "tests" / "data" / "version_0_1.nc") == ""


def test_the_walk_reads_metadata_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """2000 chunks of a megabyte each: holes in the file, but in its index they are there."""
    path = tmp_path / "a.nc"
    with netCDF4.Dataset(path, "w") as file:
        file.createDimension("n", 2000 << 17)
        made = file.createVariable("delta", "f8", ("n",), chunksizes=(1 << 17,), fill_value=False)
        for chunk in range(0, 2000, 20):
            made[chunk << 17 : (chunk << 17) + 1] = 1.0
    assert path.stat().st_size > 50e6

    class Counted(io.FileIO):
        read_bytes = 0

        def read(self, size: int | None = -1, /) -> bytes:
            data = super().read(-1 if size is None else size) or b""
            Counted.read_bytes += len(data)
            return data

    monkeypatch.setattr(hdf5_structure, "opened_file", lambda p: Counted(p))
    assert hdf5_structure.not_walked(path) == ""
    assert Counted.read_bytes < 100_000
    monkeypatch.undo()
    spent = []
    for _ in range(5):
        begin = time.process_time()
        hdf5_structure.not_walked(path)
        spent.append(time.process_time() - begin)
    assert min(spent) < 0.05


def test_a_wrong_checksum_is_told_before_the_library_sees_it(tmp_path: Path) -> None:
    sound, path = sound_archive(), tmp_path / "a.nc"
    for mark in (b"OHDR", b"OCHK", b"FRHP", b"FHDB", b"FHIB", b"BTHD", b"BTLF"):
        data = bytearray(sound)
        data[sound.index(mark) + 20] ^= 1
        path.write_bytes(data)
        with pytest.raises(OSError, match="damaged: "):
            hdf5_structure.not_walked(path)


def test_checksum_of_a_known_text() -> None:
    """Jenkins's own example, in lookup3.c (driver5)."""
    assert hdf5_messages.checksum(b"Four score and seven years ago") == 0x17770551
    assert hdf5_messages.checksum(b"") == 0xDEADBEEF


# --- the child ------------------------------------------------------------------------------------


def test_what_the_walk_does_not_know_is_read_by_a_child(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.nc"
    with netCDF4.Dataset(path, "w", format="NETCDF3_CLASSIC") as file:
        file.createDimension("n", 2)
        file.createVariable("bore", "f8", ("n",))[:] = [0.1, 0.11]
        file["bore"].units = "m"
    read: list[Path] = []
    real = netcdf_child.read_apart

    def watched(path: Path) -> None:
        read.append(path)
        real(path)

    monkeypatch.setattr(netcdf_files, "read_apart", watched)
    scene = tmp_path / "scene.toml"
    scene.write_text(
        'engine = "ntua"\n[designs]\nfile = "a.nc"\n[output]\nquantities = ["delta"]\n'
    )
    assert invoke("plan", scene).exit_code == 0
    assert read == [path]


@pytest.mark.skipif(sys.platform == "win32", reason="has no limit of the processor's time")
def test_a_child_that_would_run_for_ever_is_ended(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.nc"
    path.write_bytes(with_zero_size())
    monkeypatch.setattr(netcdf_files, "not_walked", lambda path: "not known")
    monkeypatch.setattr(netcdf_child, "SECONDS", 1.0)
    told = refused("info", path)
    # On a busy machine its time by the clock ends first.
    assert "reading it takes more than 1 s" in told or "takes longer than 3 s" in told


@pytest.mark.skipif(sys.platform == "win32", reason="has no such signal")
def test_a_child_that_runs_for_ever_can_be_interrupted(tmp_path: Path) -> None:
    path = tmp_path / "a.nc"
    path.write_bytes(with_zero_size())
    code = "from sweeps.reading import netcdf_child, netcdf_files as files\n"
    code += "files.not_walked = lambda path: 'not known'\nnetcdf_child.SECONDS = 1000.0\n"
    # A shell that runs tests in the background makes them ignore the signal.
    code += "import signal\nsignal.signal(signal.SIGINT, signal.default_int_handler)\n"
    code += "print('ready', flush=True)\n" + COMMAND
    with subprocess.Popen(
        [sys.executable, "-c", code, "info", path], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        text=True, cwd=ROOT, start_new_session=True,
    ) as command:  # fmt: skip
        assert command.stdout is not None and command.stdout.readline() == "ready\n"
        process = psutil.Process(command.pid)
        end = time.monotonic() + 60.0
        while not any(p.cpu_times().user > 1.0 for p in process.children()):  # is in the library
            assert time.monotonic() < end and command.poll() is None
            time.sleep(0.1)
        os.killpg(command.pid, signal.SIGINT)
        _, told = command.communicate(timeout=60)
    assert command.returncode == 1
    assert told == "engine-dyn: interrupted; nothing was written\n"


def test_every_file_is_read_apart_where_none_is_trusted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.nc"
    path.write_bytes(sound_archive())
    read: list[Path] = []
    monkeypatch.setattr(netcdf_files, "read_apart", read.append)
    assert invoke("info", path).exit_code == 0
    assert not read
    netcdf_files._check_state.cache_clear()
    assert invoke("info", path, "--untrusted").exit_code == 0
    assert read == [path]
    netcdf_files._check_state.cache_clear()
    assert invoke("info", path).exit_code == 0
    assert read == [path]
    sweeps.open(path, untrusted=True).close()
    assert read == [path, path]
    for command in (*READING, "run", "plan"):
        assert "--untrusted" in invoke(command, "--help").stdout


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


def test_a_child_reads_all_values(tmp_path: Path) -> None:
    path = tmp_path / "a.nc"
    with netCDF4.Dataset(path, "w") as file:
        file.createDimension("n", 100_000)
        made = file.createVariable("bore", "f8", ("n",), zlib=True, chunksizes=(50_000,))
        made[:] = np.linspace(0.1, 0.2, 100_000)
    data = bytearray(path.read_bytes())
    data[-3000:-2000] = b"\xff" * 1000
    path.write_bytes(data)
    with pytest.raises(OSError, match="damaged"):
        netcdf_child.read_apart(path)


def small_file(path: Path, monkeypatch: pytest.MonkeyPatch) -> bytearray:
    """Write two axes and what lies over both, which the walk clears; what is changed of its bytes
    counts as having a right checksum."""
    with netCDF4.Dataset(path, "w") as file:
        for axis in "ab":
            file.createDimension(axis, 2)
            file.createVariable(axis, "f8", (axis,)).setncattr("half_width", 0.25)
        file.createVariable("both", "f8", ("a", "b"))
    assert hdf5_structure.not_walked(path) == ""
    monkeypatch.setattr(hdf5_structure, "verify", lambda *_: None)
    return bytearray(path.read_bytes())


@pytest.mark.parametrize("name", [b"_Netcdf4Dimid", b"_Netcdf4Coordinates"])
def test_a_huge_number_of_a_dimension_takes_no_memory(
    name: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A list as long as the number: 1.5e9 of them took 11 GB."""
    path = tmp_path / "a.nc"
    data = small_file(path, monkeypatch)
    told = []
    begin = data.index(name) + len(name)
    for place in range(begin, begin + 40):  # type, space and value of the attribute
        changed = bytearray(data)
        changed[place : place + 4] = (87 << 24).to_bytes(4, "little")
        path.write_bytes(changed)
        try:
            told.append(hdf5_structure.not_walked(path))
        except OSError as error:
            told.append(str(error))
    assert any("of which netCDF would make a list" in line for line in told)


@pytest.mark.parametrize("name", [b"DIMENSION_LIST", b"CLASS", b"NAME", b"_Netcdf4Dimid"])
def test_attributes_of_netcdf_must_have_their_types(
    name: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A list of dimensions that said it was a list of texts crashed the library."""
    path = tmp_path / "a.nc"
    data = small_file(path, monkeypatch)
    place = data.index(name + b"\0") + len(name) + 1
    data[place + (name == b"DIMENSION_LIST")] ^= 1  # of texts; the others are of another class
    path.write_bytes(data)
    assert hdf5_structure.not_walked(path) == f"{name.decode()} of another type"


@pytest.mark.parametrize(
    ("kind", "place", "told"),
    [
        ("flags of an attribute", -8, "attribute of version 3 with flags 64"),
        ("offset of the bits of a float", 8, "a type of floats"),
        ("exponent of a float", 13, "a type of floats"),
        ("coding of a name", -1, "an attribute in a form"),
    ],
)
def test_what_netcdf_does_not_write_is_not_cleared(
    kind: str, place: int, told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A type that the library refuses, while netCDF opens the file, ended a later close."""
    path = tmp_path / "a.nc"
    data = small_file(path, monkeypatch)
    float_type = bytes.fromhex("11203f0008000000")
    name = data.index(b"half_width\0")
    begin = data.index(float_type, name) if "float" in kind else name
    data[begin + place] ^= 64
    path.write_bytes(data)
    assert told in hdf5_structure.not_walked(path)
