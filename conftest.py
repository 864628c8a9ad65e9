"""Settings that all tests share."""

from __future__ import annotations

import os
import shutil
import tempfile
from pathlib import Path

import pytest
from hypothesis import settings

# The same examples in every run: what fails on one machine fails on all.
settings.register_profile("engine-dyn", deadline=None, max_examples=25, derandomize=True)
# For `make properties`: other examples in every run, and many of them.
settings.register_profile(
    "many", deadline=None, max_examples=int(os.environ.get("SCENES", "500")), print_blob=True
)
settings.load_profile("engine-dyn")

# Before NumPy is imported: as many test processes as processors leave none for more threads of
# linear algebra, which then wait for each other (the fits of speeds take 9 s instead of 81 s).
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# Before Numba is imported; processes that tests start inherit it.
os.environ["NUMBA_CACHE_DIR"] = os.environ.get("NUMBA_CACHE_DIR") or str(
    Path(__file__).parent / ".numba_cache"
)


def pytest_configure(config: pytest.Config) -> None:
    """Ignore implausible designs: those of tests are drawn or made up.

    Tests of plausibility ask for the warnings they mean. In pyproject.toml, this line would make
    pytest import engine_dyn, and so Numba, before the folder above is named.
    """
    config.addinivalue_line("filterwarnings", "ignore::engine_dyn.ImplausibleWarning")
    if not hasattr(config, "workerinput"):
        _keep_temporary_files_apart(config)


@pytest.hookimpl(trylast=True)  # when those that are not asked for are gone
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with modules that have slow tests: at the end, processes then share short ones.

    Each process is first given one stretch of the list, and later steals from the end of another's.
    So every stretch begins with its share of these modules, those with most slow tests first. A
    module stays together: its fixtures, and what its tests keep, are made once.
    """
    modules: dict[Path, list[pytest.Item]] = {}
    for item in items:
        modules.setdefault(item.path, []).append(item)

    def slow(tests: list[pytest.Item]) -> int:
        return sum(item.get_closest_marker("slow") is not None for item in tests)

    processes = int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1"))
    parts: list[list[pytest.Item]] = [[] for _ in range(processes)]
    short = []
    for number, tests in enumerate(sorted(modules.values(), key=slow, reverse=True)):
        (parts[number % processes] if slow(tests) else short).extend(tests)
    size = len(items) // processes
    items.clear()
    for part in parts:
        more = max(size - len(part), 0)
        items += part + short[:more]
        del short[:more]
    items += short


def _keep_temporary_files_apart(config: pytest.Config) -> None:
    """Remove temporary files at the end, also those of processes that tests kill.

    pytest's own `tmp_path` stays where it was.
    """
    os.environ.setdefault("PYTEST_DEBUG_TEMPROOT", tempfile.gettempdir())
    folder = tempfile.tempdir = os.environ["TMPDIR"] = tempfile.mkdtemp(prefix="engine-dyn-tests-")
    os.chmod(folder, 0o711)  # a test runs as another user
    config.add_cleanup(lambda: shutil.rmtree(folder, ignore_errors=True))


@pytest.fixture(autouse=True)
def _no_width(monkeypatch: pytest.MonkeyPatch) -> None:
    """Tables are as wide as they are: a width that somebody has set counts in no test."""
    monkeypatch.delenv("COLUMNS", raising=False)
