"""Compiled kernels on disk: processes that compile at the same time must not write to one place."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from pathlib import Path

import numba
import pytest

from engine_dyn.compilation import COMPILING

ROOT = Path(__file__).resolve().parents[2]

pytestmark = [pytest.mark.compiled, pytest.mark.skipif(os.name == "nt", reason="needs Unix locks")]

MODULE = """
from engine_dyn.compilation import kernel


@kernel
def twice(x):
    return 2.0 * x
"""

PROGRAM = """
import sys
from engine_dyn.compilation import on_compiling, own_cache
if "before" in sys.argv:
    print(own_cache())
from module import twice
if "own" in sys.argv:
    print(own_cache())
on_compiling(lambda: print("compiled"))
assert twice(1.5) == 3.0
"""


def run(folder: Path, *words: str, **environment: str) -> list[str]:
    (folder / "module.py").write_text(MODULE)
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, *words], capture_output=True, text=True, check=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(folder), str(ROOT)]), **environment},
    )  # fmt: skip
    return done.stdout.split()


MISSING_MODULE = b"cmodule_of_another_version\nKind\n."


@pytest.mark.parametrize("kind", ["index", "code"])
@pytest.mark.parametrize("damage", ["empty", "zeros", "another version"])
def test_damaged_files_of_a_cache_are_written_again(tmp_path: Path, kind: str, damage: str) -> None:
    place = {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    assert run(tmp_path, **place) == ["compiled"]
    (path,) = (tmp_path / "cache").rglob("*.nbi" if kind == "index" else "*.nbc")
    content = path.read_bytes()
    if damage == "empty":
        path.write_bytes(b"")
    elif damage == "zeros":
        half = len(content) // 2
        path.write_bytes(content[:half] + bytes(len(content) - half))
    else:
        path.write_bytes(pickle.dumps(numba.__version__) + MISSING_MODULE)
    assert run(tmp_path, **place) == ["compiled"]
    assert run(tmp_path, **place) == []


def test_a_full_disk_ends_no_run(tmp_path: Path) -> None:
    """The kernel is compiled and used; that it cannot be kept is said in one line."""
    (tmp_path / "module.py").write_text(MODULE)
    limited = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100)); "
    done = subprocess.run(
        [sys.executable, "-c", limited + "from module import twice; print(twice(1.5), twice(1))"],
        capture_output=True, text=True,
        env={
            **os.environ,
            "PYTHONPATH": os.pathsep.join([str(tmp_path), str(ROOT)]),
            "NUMBA_CACHE_DIR": str(tmp_path / "cache"),
            "PYTHONDONTWRITEBYTECODE": "1",
        },
    )  # fmt: skip
    assert (done.returncode, done.stdout.split()) == (0, ["3.0", "2.0"])
    first, second = done.stderr.splitlines()
    assert first == COMPILING
    assert second.startswith(f"compiled kernels cannot be cached in {tmp_path / 'cache'}")
    assert second.endswith("(File too large): later runs will compile them again")


def test_python_says_once_that_kernels_are_compiled(tmp_path: Path) -> None:
    (tmp_path / "module.py").write_text(MODULE)
    command = [sys.executable, "-c", "from module import twice; twice(1.5); twice(1)"]
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join([str(tmp_path), str(ROOT)]),
        "NUMBA_CACHE_DIR": str(tmp_path / "cache"),
    }
    first, second = (
        subprocess.run(command, capture_output=True, text=True, check=True, env=environment).stderr
        for _ in range(2)
    )
    assert first == f"{COMPILING}\n"
    assert second == ""


def files(folder: Path) -> int:
    return len(list(folder.rglob("*.nbc")))


def test_a_process_may_have_a_cache_of_its_own(tmp_path: Path) -> None:
    shared = tmp_path / "shared"
    place = {"NUMBA_CACHE_DIR": str(shared)}
    folder, *more = run(tmp_path, "own", **place)
    assert more == ["compiled"]
    assert Path(folder).parent == shared and files(shared) == files(Path(folder)) == 1
    # The next process finds it, also for kernels made later; one beside it has another folder.
    assert run(tmp_path, "own", **place) == [folder]
    assert run(tmp_path, "before", **place) == [folder]
    with (Path(folder) / "lock").open("a") as lock:
        import fcntl

        fcntl.flock(lock.fileno(), fcntl.LOCK_EX)
        other, *more = run(tmp_path, "own", **place)
        assert other != folder and more == ["compiled"]
    # What all share is used, and not written to.
    assert run(tmp_path, **place) == ["compiled"]
    assert files(shared) == 3
    for path in (*Path(folder).rglob("*.nb?"), *Path(other).rglob("*.nb?")):
        path.unlink()
    assert run(tmp_path, "own", **place) == [folder]
    assert files(Path(folder)) == 0 and files(shared) == 1


def test_a_folder_that_others_may_write_to_is_not_used(tmp_path: Path) -> None:
    """What lies there would be executed."""
    base = tmp_path / f"engine-dyn-{os.getuid()}"
    base.mkdir(mode=0o777)
    base.chmod(0o777)
    folder, *_ = run(tmp_path, "own", TMPDIR=str(tmp_path), NUMBA_CACHE_DIR="")
    assert Path(folder).parent == tmp_path and Path(folder) != base
    assert list(base.iterdir()) == []
    base.chmod(0o700)
    folder, *_ = run(tmp_path, "own", TMPDIR=str(tmp_path), NUMBA_CACHE_DIR="")
    assert Path(folder).parent == base
