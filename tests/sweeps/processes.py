"""Python in a process of its own."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
COMMAND = "from sweeps.cli.main import main; main()"


def python(
    code: str,
    *arguments: object,
    cwd: Path = ROOT,
    path: Path | None = None,
    environment: dict[str, str] | None = None,
    **more: Any,
) -> subprocess.CompletedProcess[str]:
    """Run a program with this repository's packages, behind those of a folder `path`."""
    packages = os.pathsep.join([*([str(path)] if path else []), str(ROOT)])
    return subprocess.run(
        [sys.executable, "-c", code, *map(str, arguments)], cwd=cwd, capture_output=True, text=True,
        env={**os.environ, "PYTHONPATH": packages, **(environment or {})}, **more,
    )  # fmt: skip
