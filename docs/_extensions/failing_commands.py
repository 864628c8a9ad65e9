"""Run by the kernel of each notebook: a command of the shell that fails makes its cell fail."""

from __future__ import annotations

import subprocess
from typing import Any


def _install(shell: Any) -> None:
    """Let `!command` raise where the command fails, so that the build of the site ends.

    What the command says is printed at once, because streams that come in pieces are broken into
    lines where the pieces meet.
    """

    def checked(command: str) -> None:
        done = subprocess.run(
            command, shell=True, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
        )
        print(done.stdout, end="")
        if done.returncode:
            raise RuntimeError(f"exit status {done.returncode}: {command}")

    shell.system = checked


_install(get_ipython())  # type: ignore[name-defined]  # noqa: F821
