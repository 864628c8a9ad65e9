"""Times of compiling: what runs with which cache, and what the page says. Nothing is compiled."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Mapping
from pathlib import Path

import pytest

from benchmarks import compile_times, page
from benchmarks.compile_times import Command, Compiled
from benchmarks.studies import study

ROOT = Path(__file__).resolve().parents[2]

CHOSEN = [study("one_table"), study("driven")]


@pytest.mark.parametrize("short", [False, True])
def test_each_command_runs_cold_and_then_warm(short: bool) -> None:
    ran: list[tuple[list[str], Path]] = []

    def run(command: Command, environment: Mapping[str, str]) -> float:
        """Ten seconds for a command, and two for the same with the same cache again."""
        ran.append((list(map(str, command)), Path(environment["NUMBA_CACHE_DIR"])))
        assert ran[-1][1].parent.is_dir()
        return 2.0 if ran[-1] in ran[:-1] else 10.0

    found = compile_times.measured(CHOSEN, 7, short, run)
    single = [] if short else [one.words for one in CHOSEN]
    assert [row.words for row in found] == [
        "`engine-dyn run thesis`", *single, "2 studies in one process",
    ]  # fmt: skip
    assert {(row.cold, row.warm) for row in found} == {(10.0, 2.0)}
    # The first call warms the disk; then each comes twice.
    assert ran[1::2] == ran[2::2]
    thesis, *studies, together = ran[1::2]
    assert thesis[0][1:3] == ["run", "thesis"]
    assert [command[-1] for command, _ in studies] == ([] if short else ["one_table", "driven"])
    assert {cache for _, cache in studies} <= {thesis[1]}
    assert together[0][-3:] == ["7", "one_table", "driven"]
    assert together[1] != thesis[1]
    assert not thesis[1].parent.exists()


def test_processor_time_is_that_of_the_process() -> None:
    busy = "import time\nwhile time.process_time() < 0.3: pass"
    assert compile_times.processor_time((sys.executable, "-c", busy), {}) >= 0.3
    idle = "import time; time.sleep(0.5)"
    assert compile_times.processor_time((sys.executable, "-S", "-c", idle), {}) < 0.4
    given = "import os, sys; sys.exit('no' if os.environ.get('GIVEN') == 'yes' else 0)"
    with pytest.raises(RuntimeError, match="no"):
        compile_times.processor_time((sys.executable, "-c", given), {"GIVEN": "yes"})


def test_the_page_names_what_was_kept(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "docs" / "benchmarks", tmp_path / "benchmarks")
    for seconds in (20.0, 30.0):
        found = [Compiled("one", seconds, 2.0), Compiled("two", 2.04, 2.0)]
        compile_times.save_rows(found, 2000, tmp_path)
    assert [list(row.values()) for row in page.read(tmp_path, "compiling")] == [
        ["one", "28.0 s", "30.0 s", "2.0 s"], ["two", "-", "2.0 s", "2.0 s"],
    ]  # fmt: skip
    facts = page.facts_of(tmp_path)
    assert facts["compiled_designs"] == "2,000"
    assert facts["compiled"].endswith(compile_times.machine())
    text = (tmp_path / "benchmarks.md").read_text(encoding="utf-8")
    assert text.count(facts["compiled"]) == 1
