"""Times of compiling: what runs with which cache, and what the page says. Nothing is compiled."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from pathlib import Path

import pytest

from benchmarks import compile_times
from benchmarks.compile_times import Command, Compiled
from benchmarks.studies import study

CHOSEN = [study("one_table"), study("driven")]


class Machine:
    """Takes ten seconds for a command, and two for the same with the same cache again."""

    def __init__(self) -> None:
        self.ran: list[tuple[list[str], Path]] = []

    def __call__(self, command: Command, environment: Mapping[str, str]) -> float:
        call = list(map(str, command)), Path(environment["NUMBA_CACHE_DIR"])
        assert call[1].parent.is_dir()
        seconds = 2.0 if call in self.ran else 10.0
        self.ran.append(call)
        return seconds


@pytest.mark.parametrize("short", [False, True])
def test_each_command_runs_cold_and_then_warm(short: bool) -> None:
    machine, told = Machine(), []
    found = compile_times.measured(CHOSEN, 7, short, 1, told.append, machine)
    single = [] if short else [one.words for one in CHOSEN]
    assert [row.words for row in found] == [
        "`engine-dyn run thesis`", *single, "2 studies in one process",
    ]  # fmt: skip
    assert {(row.cold, row.warm, row.compiling) for row in found} == {(10.0, 2.0, 8.0)}
    assert len(told) == len(found)
    ran = machine.ran[1:]  # without the call that warms the disk
    assert ran[::2] == ran[1::2]
    thesis, *studies, together = ran[::2]
    assert thesis[0][1:3] == ["run", "thesis"]
    assert [command[-1] for command, _ in studies] == ([] if short else ["one_table", "driven"])
    assert {cache for _, cache in studies} <= {thesis[1]}
    assert together[0][-3:] == ["7", "one_table", "driven"]
    assert together[1] != thesis[1]
    assert not thesis[1].parent.exists()


def test_the_least_time_of_several_runs_counts_and_each_has_new_caches() -> None:
    machine = Machine()
    times = iter([0.0, 9.0, 2.0, 30.0, 4.0, 0.0, 8.0, 3.0, 40.0, 3.0])
    found = compile_times.measured(
        CHOSEN, 7, True, 2, lambda words: None, lambda c, e: (machine(c, e), next(times))[1]
    )
    assert [(row.cold, row.warm) for row in found] == [(8.0, 2.0), (30.0, 3.0)]
    assert len({cache.parent for _, cache in machine.ran}) == 2


def test_processor_time_is_that_of_the_process() -> None:
    busy = "import time\nwhile time.process_time() < 0.3: pass"
    assert compile_times.processor_time((sys.executable, "-c", busy), {}) >= 0.3
    idle = "import time; time.sleep(0.5)"
    assert compile_times.processor_time((sys.executable, "-S", "-c", idle), {}) < 0.4
    given = "import os, sys; sys.exit('no' if os.environ.get('GIVEN') == 'yes' else 0)"
    with pytest.raises(RuntimeError, match="no"):
        compile_times.processor_time((sys.executable, "-c", given), {"GIVEN": "yes"})


def test_the_page_has_one_section_made_of_what_was_kept(tmp_path: Path) -> None:
    page = "# Benchmarks\n\nWords.\n\n## Traces\n\nMore.\n"
    (tmp_path / "benchmarks.md").write_text(page, encoding="utf-8")
    assert compile_times.kept_section(tmp_path) == []
    for seconds in (20.0, 30.0):
        found = [Compiled("one", seconds, 2.0), Compiled("two", 2.04, 2.0)]
        compile_times.keep(compile_times.figures(found, 2000), tmp_path)
    kept = json.loads((tmp_path / compile_times.KEPT).read_text(encoding="utf-8"))
    assert kept["designs"] == 2000
    section = "\n".join(compile_times.kept_section(tmp_path))
    text = (tmp_path / "benchmarks.md").read_text(encoding="utf-8")
    assert text == page.replace("## Traces", section + "\n## Traces")
    assert "\n| one | 28.0 s | 30.0 s | 2.0 s |\n| two | - | 2.0 s | 2.0 s |\n" in section
    assert f"numba {kept['numba']}" in section
    with pytest.raises(ValueError, match="no heading"):
        compile_times.with_section("# Another page\n", [])
