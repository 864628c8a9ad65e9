"""The soak, small: what a process keeps, and use by many threads and processes at once."""

from __future__ import annotations

import tempfile
from pathlib import Path

import pytest

from benchmarks import soak
from sweeps.running.compute import limits

pytestmark = [pytest.mark.compiled, pytest.mark.slow]


@pytest.fixture(autouse=True)
def apart(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Many blocks, and a folder of one's own for temporary files."""
    monkeypatch.setattr(limits, "LARGEST_BLOCK", soak.BLOCK)
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))


def test_a_process_keeps_nothing(tmp_path: Path) -> None:
    (tmp_path / "one").mkdir()
    wrong, figures = soak.one_process(160, tmp_path / "one")
    assert wrong == []
    assert figures["runs"] == 160


def test_threads_do_not_disturb_each_other(tmp_path: Path) -> None:
    """Before netCDF's library was locked, this crashed."""
    assert soak.many_threads(3, tmp_path) == []


@pytest.mark.parametrize("own", [True, False])
def test_processes_do_not_disturb_each_other(
    own: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(soak, "PROCESSES", 2)
    wrong, refused = soak.many_processes(2, tmp_path, own=own)
    assert wrong == []
    assert refused < 2 * soak.PROCESSES
    assert not (own and refused)


def test_readers_see_the_old_archive_or_the_new_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(soak, "PROCESSES", 2)  # one reader
    wrong, reads = soak.readers_beside_a_writer(90, tmp_path)
    assert wrong == []
    assert reads > 3
