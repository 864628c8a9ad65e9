"""Forty points of fault injection; `make faults` has thousands."""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

from benchmarks.faults import campaign as campaigns
from benchmarks.faults import power
from benchmarks.faults.campaign import Campaign
from benchmarks.faults.scenarios import SCENARIOS
from benchmarks.faults.server import Outcome, Server, Unavailable

pytestmark = [pytest.mark.compiled, pytest.mark.slow]

POINTS = 40


@pytest.fixture(scope="module")
def server() -> Iterator[Server]:
    try:
        with Server() as started:
            yield started
    except Unavailable as error:
        pytest.skip(str(error))


@pytest.fixture(scope="module")
def whole(server: Server) -> Campaign:
    """The points, none of which has been tried."""
    return Campaign(server)


def test_there_are_thousands_of_points_of_every_kind(whole: Campaign) -> None:
    assert len(set(whole.points)) == len(whole.points) > 5000
    for count in (400, len(whole.points)):
        scenarios = Counter(point.scenario for point in whole.points[:count])
        assert scenarios.keys() == SCENARIOS.keys()
        faults = {point.fault for point in whole.points[:count]}
        assert faults == {
            "ENOSPC", "EDQUOT", "EIO", "EINTR", "ENOLCK", "short", "full", "kill", "kill after",
            "power drop", "power names", "power mixed",
        }  # fmt: skip


def test_every_fault_ends_as_promised(whole: Campaign) -> None:
    found = campaigns.summary({p: whole.attempt(p) for p in whole.points[:POINTS]}, POINTS)
    assert found["wrong"] == []
    assert found["points"] + found["not_reached"] == POINTS
    assert found["not_reached"] < POINTS // 20
    assert found["ended"].keys() <= {"right", "told", "killed", "library"}
    assert min(found["ended"][how] for how in ("right", "told", "killed")) > 2


def test_what_should_not_be_is_found(whole: Campaign, monkeypatch: pytest.MonkeyPatch) -> None:
    """With archives that are expected to be others, everything but the old archive is wrong."""
    for name in SCENARIOS:
        monkeypatch.setitem(whole.expected, name, b"another")
    kinds = itertools.groupby(sorted(whole.points, key=lambda p: p.scenario), lambda p: p.scenario)
    for _, points in kinds:
        verdict = whole.attempt(next(points))
        assert verdict.ended == "wrong"
        assert "other bytes" in verdict.wrong or "the archive is" in verdict.wrong


@pytest.mark.parametrize(
    ("status", "errors", "said"),
    [
        (0, "", ""),
        (0, "HDF5-DIAG: Error\n", "on stderr"),
        (None, "", "does not end"),
        (-6, "Aborted\n", "status -6"),
        (1, "engine-dyn: out.nc: cannot be written (No space left on device)\n", ""),
        (2, "engine-dyn: scene.toml: cannot be read\n", ""),
        (1, "engine-dyn: failed: OSError: ... (--debug shows where)\n", "not told in one line"),
        (1, "Traceback (most recent call last):\n", "not told in one line"),
        (1, "engine-dyn: out.nc: one\nengine-dyn: two\n", "not told in one line"),
        (3, "engine-dyn: designs failed\n", "status 3"),
    ],
)
def test_how_a_run_may_end(status: int | None, errors: str, said: str) -> None:
    wrong = campaigns._badly_ended(Outcome(status, "", errors, [], "", []))
    assert said in wrong and bool(said) == bool(wrong)


def test_a_failure_of_the_power_loses_what_was_not_synced(tmp_path: Path) -> None:
    """A file is replaced: synced or not, and with the folder synced or not."""
    work, shadows = tmp_path / "work", tmp_path / "shadows"

    def replaced(*, file_synced: bool, folder_synced: bool, rule: str) -> tuple[set[str], str]:
        if work.exists():
            power.shutil.rmtree(work)
        work.mkdir()
        (work / "kept").write_text("old")
        power.all_synced(work, shadows)
        (work / "new").write_text("new")
        inode = (work / "new").stat().st_ino
        power.os.link(work / "new", shadows / f"{inode}.live")
        if file_synced:
            power.shutil.copy(work / "new", shadows / f"{inode}.data")
        (work / "new").replace(work / "kept")
        if folder_synced:
            (shadows / f"{work.stat().st_ino}.list").write_text(f"{inode} f kept\n")
        power.lose(work, shadows, rule, 1)
        return {p.name for p in work.iterdir()}, (work / "kept").read_text()

    both = {"file_synced": True, "folder_synced": True}
    assert {replaced(**both, rule=rule)[1] for rule in power.RULES} == {"new"}
    assert replaced(file_synced=True, folder_synced=False, rule="drop") == ({"kept"}, "old")
    assert replaced(file_synced=True, folder_synced=False, rule="names") == ({"kept"}, "new")
    assert replaced(file_synced=False, folder_synced=False, rule="names") == ({"kept"}, "")
