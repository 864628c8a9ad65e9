"""Disks that fail: what is told, what is kept, what lasts; benchmarks.faults tries every call."""

import copy
import errno
import os
import pickle
from pathlib import Path
from typing import Any

import pytest

import sweeps
from sweeps.base.netcdf import netcdf_files
from sweeps.base.netcdf.netcdf_files import netcdf_library
from sweeps.running.archive import partial
from sweeps.running.archive.partial import Partial
from sweeps.running.compute import into_archive, limits
from sweeps.running.compute.options import Options
from tests.support.archives import interrupted, plan_of
from tests.support.commands import invoke

FAILS = OSError(errno.EIO, "Input/output error")


def failing(error: OSError) -> Any:
    def call(*_: Any, **__: Any) -> Any:
        raise error

    return call


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limits, "LARGEST_BLOCK", 4e4)


def test_the_names_of_new_folders_are_synced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else a failure of the power would lose the folder with all the synced blocks in it."""
    synced: list[Path] = []
    monkeypatch.setattr(partial, "sync_folder", synced.append)
    partial.made_folder(tmp_path / "of" / "today")
    assert synced == [tmp_path, tmp_path / "of"]
    with Partial.of(tmp_path / "of" / "today" / "out.nc").locked(tmp_path / "out.nc"):
        assert synced[2:] == [tmp_path / "of" / "today"]
    partial.made_folder(tmp_path / "of" / "today")
    assert len(synced) == 3


@pytest.mark.skipif(not hasattr(os, "O_DIRECTORY"), reason="needs folders that can be opened")
def test_a_folder_that_cannot_be_synced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Some file systems know no such thing; an error of the disk is another matter."""
    monkeypatch.setattr(partial.os, "fsync", failing(OSError(errno.EINVAL, "Invalid argument")))
    partial.sync_folder(tmp_path)
    monkeypatch.setattr(partial.os, "fsync", failing(FAILS))
    with pytest.raises(OSError, match="Input/output"):
        partial.sync_folder(tmp_path)


@pytest.mark.parametrize("number", [errno.EIO, errno.EDQUOT, errno.EINTR, errno.ESTALE])
def test_every_failure_of_the_disk_is_told_in_one_line(
    number: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    error = OSError(number, os.strerror(number), str(tmp_path / "out.nc.partial" / "lock"))
    monkeypatch.setattr(partial, "_opened_lock", failing(error))
    result = invoke("run", "first", "-o", tmp_path / "out.nc")
    assert result.exit_code == 1
    assert result.stderr == (
        f"engine-dyn: {tmp_path}/out.nc: cannot be written ({tmp_path}/out.nc.partial/lock: "
        f"{os.strerror(number)})\n"
    )


@pytest.mark.compiled
def test_a_failure_after_the_first_block_says_how_to_go_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, small: None
) -> None:
    plan_of(tmp_path)
    written = Partial.write

    def write(self: Partial, number: int, arrays: Any) -> int:
        if number:
            raise OSError(errno.EINTR, "Interrupted system call")
        return written(self, number, arrays)

    monkeypatch.setattr(Partial, "write", write)
    result = invoke("run", tmp_path / "scene.toml", "-o", tmp_path / "out.nc")
    assert result.exit_code == 1
    assert "cannot be written (Interrupted system call; " in result.stderr
    assert "; 1 of " in result.stderr and "; to continue: " in result.stderr


@pytest.mark.compiled
def test_a_header_that_cannot_be_read_costs_no_block(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, small: None
) -> None:
    """It was taken for a run that had not begun, whose blocks belong to nothing."""
    plan, output = plan_of(tmp_path), tmp_path / "out.nc"
    interrupted(plan, output, monkeypatch, 3)
    with monkeypatch.context() as patch:
        patch.setattr(partial, "regular_bytes", failing(FAILS))
        result = invoke("run", tmp_path / "scene.toml", "-o", output, "--resume")
    assert result.exit_code == 1 and result.stderr.count("\n") == 1
    assert len(Partial.of(output).finished()) == 3
    assert into_archive.run(plan, output, Options(resume=True)).before == 3


def test_a_file_whose_closing_failed_is_never_closed_again() -> None:
    """The library would crash; it tries again by itself when the object is freed as open."""

    class File:
        _isopen, times = 1, 0

        def close(self) -> None:
            self.times += 1
            raise RuntimeError("NetCDF: HDF error")

    file = File()
    with pytest.raises(RuntimeError):
        netcdf_files.close(file)
    assert (file.times, file._isopen) == (1, 0)


def test_the_lock_of_the_library_goes_with_copies_and_other_processes(tmp_path: Path) -> None:
    assert copy.deepcopy(netcdf_library) is netcdf_library
    assert pickle.loads(pickle.dumps(netcdf_library)) is netcdf_library
    sweeps.stream("first", tmp_path / "out.nc")
    with sweeps.open(tmp_path / "out.nc") as opened, netcdf_library, netcdf_library:
        again = pickle.loads(pickle.dumps(opened))
        assert again["delta"].identical(opened["delta"])
        again.close()
