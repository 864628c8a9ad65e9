"""Compiled kernels on disk: what is there is whole, of these very sources, and of this user."""

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from engine_dyn.compilation import COMPILING

ROOT = Path(__file__).resolve().parents[2]

pytestmark = pytest.mark.compiled

MODULE = """
from engine_dyn.compilation import inlined, kernel


@inlined
def times(x, n):
    return x * n


@kernel
def twice(x):
    return times(x, 2.0)
"""

PROGRAM = """
import sys
from engine_dyn.compilation import on_compiling
from module import twice
on_compiling(lambda: print("compiled"))
for word in sys.argv[1:] or ["1.5"]:
    x = eval(word)
    assert twice(x) == 2.0 * x
"""


def start(
    folder: Path, *words: str, program: str = PROGRAM, **environment: str
) -> subprocess.Popen[str]:
    """Start a process that calls a kernel, and keeps it below `folder` unless told otherwise."""
    if not (folder / "module.py").exists():  # older versions of Numba look at its date
        (folder / "module.py").write_text(MODULE)
    return subprocess.Popen(
        [sys.executable, "-c", program, *words],
        text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        env={
            **os.environ, "PYTHONPATH": os.pathsep.join([str(folder), str(ROOT)]),
            "NUMBA_CACHE_DIR": str(folder / "cache"), **environment,
        },
    )  # fmt: skip


def outcome(folder: Path, program: str, **environment: str) -> tuple[str, str]:
    """What another program prints and what it says beside."""
    process = start(folder, program=program, **environment)
    said, errors = process.communicate()
    assert process.returncode == 0, errors
    return said, errors


def run(folder: Path, *words: str, **environment: str) -> tuple[bool, str]:
    """Whether a process has compiled anything, and what it says beside."""
    process = start(folder, *words, **environment)
    said, errors = process.communicate()
    assert process.returncode == 0, errors
    assert said in ("", "compiled\n")
    return bool(said), errors


def archives(folder: Path) -> list[Path]:
    return sorted((folder / "cache" / "engine-dyn").iterdir())


def test_another_process_finds_what_one_has_compiled(tmp_path: Path) -> None:
    assert run(tmp_path) == (True, "")
    (archive,) = archives(tmp_path)
    content = archive.read_bytes()
    assert run(tmp_path) == (False, "")
    assert archive.read_bytes() == content
    # For another kind of argument it is compiled, and the first one stays.
    assert run(tmp_path, "1.5", "2") == (True, "")
    assert archives(tmp_path) == [archive]
    assert run(tmp_path, "2", "1.5") == (False, "")


def test_damaged_files_of_a_cache_are_written_again(tmp_path: Path) -> None:
    assert run(tmp_path) == (True, "")
    (archive,) = archives(tmp_path)
    content = archive.read_bytes()
    with zipfile.ZipFile(archive) as opened:
        code = max(opened.infolist(), key=lambda info: info.compress_size)
    place = code.header_offset + code.compress_size // 2
    for damaged in (b"", content[:place] + bytes(64) + content[place + 64 :]):
        archive.write_bytes(damaged)
        assert run(tmp_path) == (True, "")
    assert run(tmp_path) == (False, "")


def test_processes_that_compile_at_once_write_one_sound_archive(tmp_path: Path) -> None:
    """Each has its own kind of argument; what the last one wrote is there as a whole."""
    processes = [start(tmp_path, word) for word in ("1.5", "2", "1j")]
    for process in processes:
        _, errors = process.communicate()
        assert process.returncode == 0, errors
    (archive,) = archives(tmp_path)
    with zipfile.ZipFile(archive) as opened:
        assert opened.testzip() is None
    run(tmp_path, "1.5", "2", "1j")
    assert run(tmp_path, "1.5", "2", "1j") == (False, "")


def test_what_no_process_has_used_for_long_is_removed(tmp_path: Path) -> None:
    run(tmp_path)
    (archive,) = archives(tmp_path)
    older, newer = (archive.with_name(f"{word}.zip") for word in ("older", "newer"))
    for days, path in ((61, older), (59, newer), (61, archive)):
        if path != archive:
            shutil.copy(archive, path)
        past = path.stat().st_mtime - days * 86400
        os.utime(path, (past, past))
    assert run(tmp_path) == (False, "")  # used
    assert run(tmp_path, "2") == (True, "")
    assert archives(tmp_path) == sorted([archive, newer])


FORKS = """
import os, sys
from pathlib import Path
from module import twice
assert twice(1.5) == 3.0
mine = set(Path(os.environ["TMPDIR"]).iterdir())
if child := os.fork():
    assert os.waitpid(child, 0)[1] == 0
    assert set(Path(os.environ["TMPDIR"]).iterdir()) == mine
else:
    assert twice(2) == 4.0
    assert len(set(Path(os.environ["TMPDIR"]).iterdir()) - mine) == 1
    sys.exit()
assert twice(1j) == 2j
"""


WHILE_COMPILING = """
import os, signal
from engine_dyn.compilation import kernel
@kernel
def twice(x):
    return 2.0 * x
with twice._lock:  # as another thread holds it while it imports the compiler
    child = os.fork()
    if not child:
        signal.alarm(600)
        os._exit(0 if twice(2.0) == 4.0 else 1)
assert os.waitpid(child, 0)[1] == 0
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs forks")
def test_a_fork_does_not_wait_for_a_thread_that_it_lacks(tmp_path: Path) -> None:
    outcome(tmp_path, WHILE_COMPILING)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs forks")
def test_a_fork_works_in_a_folder_of_its_own(tmp_path: Path) -> None:
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    outcome(tmp_path, FORKS, TMPDIR=str(scratch))
    assert list(scratch.iterdir()) == []
    assert run(tmp_path) == (False, "")


def cannot(errors: str) -> str:
    """Why kernels cannot be kept, which must be said in one line."""
    (line,) = errors.splitlines()
    begin, end = "compiled kernels cannot be cached (", "): later runs will compile them again"
    assert line.startswith(begin) and line.endswith(end)
    return line[len(begin) : -len(end)]


@pytest.mark.skipif(os.name == "nt", reason="needs Unix limits")
def test_a_full_disk_ends_no_run(tmp_path: Path) -> None:
    """The kernel is compiled and used; that it cannot be kept is said in one line."""
    limited = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100)); "
    program = limited + "from module import twice; print(twice(1.5), twice(1))"
    said, errors = outcome(tmp_path, program, PYTHONDONTWRITEBYTECODE="1")
    assert said.split() == ["3.0", "2.0"]
    first, second = errors.splitlines()
    assert first == COMPILING
    assert cannot(second) == "[Errno 27] File too large"
    assert archives(tmp_path) == []


@pytest.mark.skipif(os.name == "nt", reason="needs Unix permissions")
def test_a_folder_that_others_may_write_to_is_not_used(tmp_path: Path) -> None:
    """What lies there would be executed."""
    home = {"NUMBA_CACHE_DIR": "", "XDG_CACHE_HOME": str(tmp_path)}
    folder = tmp_path / "engine-dyn"
    folder.mkdir()
    folder.chmod(0o702)
    compiled, errors = run(tmp_path, **home)
    assert compiled and cannot(errors) == f"{folder}: others may write to it"
    assert list(folder.iterdir()) == []
    folder.chmod(0o700)
    assert run(tmp_path, **home) == (True, "")
    assert len(list(folder.iterdir())) == 1
    assert run(tmp_path, **home) == (False, "")
    folder.chmod(0o770)
    assert run(tmp_path, **home)[0]


def test_python_says_once_that_kernels_are_compiled(tmp_path: Path) -> None:
    program = "from module import twice; twice(1.5); twice(1)"
    assert [outcome(tmp_path, program)[1] for _ in range(2)] == [f"{COMPILING}\n", ""]
