"""Another package of the index installs a module `sweeps` too: the command says so."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import sweeps
from tests.support.commands import invoke, ok

OURS = Path(sweeps.__file__).parent


def command_in(folder: Path) -> subprocess.CompletedProcess[str]:
    """`engine-dyn list classes` where the packages of a folder alone are installed."""
    code = (
        "import sys; sys.path = [p for p in sys.path if p != sys.argv[1]]; "
        "from sweeps.cli.main import main; main(['list', 'classes'])"
    )
    return subprocess.run(
        [sys.executable, "-c", code, str(OURS.parent)], cwd=folder, capture_output=True, text=True
    )


@pytest.fixture
def installed(tmp_path: Path) -> Path:
    """A folder with both packages of this project."""
    shutil.copytree(OURS, tmp_path / "sweeps", ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "engine_dyn").symlink_to(OURS.parent / "engine_dyn")
    return tmp_path


def test_our_own_module_is_known(installed: Path) -> None:
    done = command_in(installed)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize(
    ("text", "word"), [('__version__ = "0.3.0"\n', "another package's"), (None, "gone")]
)
def test_a_module_that_was_replaced_or_removed(
    installed: Path, text: str | None, word: str
) -> None:
    init = installed / "sweeps" / "__init__.py"
    if text is None:
        init.unlink()
    else:
        init.write_text(text, encoding="utf-8")
    done = command_in(installed)
    assert done.returncode == 1
    assert done.stderr.count("\n") == 1
    assert f"engine-dyn: engine-dyn's module sweeps is {word}" in done.stderr
    assert "pip uninstall sweeps" in done.stderr


def test_a_package_that_this_one_has_replaced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert invoke("list", "classes").stderr == ""
    about = tmp_path / "sweeps-0.3.0.dist-info" / "METADATA"
    about.parent.mkdir()
    about.write_text("Metadata-Version: 2.1\nName: sweeps\nVersion: 0.3.0\n", encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    result = invoke("list", "classes")
    assert result.exit_code == 0
    assert result.stderr.startswith(
        "warning: package 'sweeps' 0.3.0 is installed beside engine-dyn"
    )
    assert result.stderr.count("\n") == 1
    assert result.stdout == ok("list", "classes")
