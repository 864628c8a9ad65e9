"""Run by the kernel of each notebook: a command of the shell that fails makes its cell fail."""

from __future__ import annotations


def _install(shell: object) -> None:
    """Let `!command` raise where the command fails, so that the build of the site ends."""
    run = shell.system

    def checked(command: str) -> None:
        run(command)
        if status := shell.user_ns["_exit_code"]:
            raise RuntimeError(f"exit status {status}: {command}")

    shell.system = checked


_install(get_ipython())  # noqa: F821
