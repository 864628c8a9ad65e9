"""Every cell of every tutorial runs, in order, in an empty folder, as a reader types it."""

import contextlib
import io
import os
import re
import subprocess
import sys
from pathlib import Path

import matplotlib
import matplotlib.pyplot as plt
import pytest

ROOT = Path(__file__).resolve().parents[1]
PAGES = sorted((ROOT / "docs" / "tutorials").glob("*.md"))

COMMAND = '#!/bin/sh\nexec "{}" -c "from sweeps.cli.main import main; main()" "$@"\n'
"""The command of this Python and of this copy, whatever else is on the path."""

SHELL = re.compile(r"^!((?:.*\\\n)*.*)$", re.MULTILINE)


def cells(page: Path) -> list[str]:
    """Code of a page, without the options of its cells."""
    text = page.read_text(encoding="utf-8")
    found = re.findall(r"^```\{code-cell\}[^\n]*\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
    return [re.sub(r"\A(?:---\n(?s:.*?)\n---\n|(?::.*\n)+)", "", cell).lstrip() for cell in found]


def shell(lines: str, environment: dict[str, str]) -> None:
    """Run lines of the shell, all of which must succeed."""
    done = subprocess.run(["bash", "-ec", lines], env=environment, capture_output=True, text=True)
    assert done.returncode == 0, f"{lines}\n{done.stderr[-2000:]}"


def run(cell: str, space: dict[str, object], environment: dict[str, str]) -> None:
    """Run a cell: a file that is written, lines of the shell, Python."""
    first, _, rest = cell.partition("\n")
    if first.startswith("%%writefile "):
        Path(first.split()[1]).write_text(rest, encoding="utf-8")
    elif first == "%%bash":
        shell(rest, environment)
    else:
        shell("\n".join(SHELL.findall(cell)), environment)
        python = re.sub(r"^%.*$", "", SHELL.sub("", cell), flags=re.MULTILINE)
        with contextlib.redirect_stdout(io.StringIO()):
            exec(python, space)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="needs bash")
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_tutorial(
    page: Path, tmp_path: Path, tmp_path_factory: pytest.TempPathFactory,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    programs = tmp_path_factory.mktemp("programs")
    (programs / "engine-dyn").write_text(COMMAND.format(sys.executable), encoding="utf-8")
    (programs / "engine-dyn").chmod(0o755)
    path = os.pathsep.join([str(programs), os.environ["PATH"]])
    environment = {**os.environ, "PATH": path, "PYTHONPATH": str(ROOT)}
    monkeypatch.chdir(tmp_path)
    matplotlib.use("agg")
    found = cells(page)
    assert found
    space: dict[str, object] = {"__name__": "__main__", "display": print}
    for cell in found:
        run(cell, space, environment)
    plt.close("all")
