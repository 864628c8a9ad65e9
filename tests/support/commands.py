"""The command `engine-dyn`, called in this process."""

from __future__ import annotations

from pathlib import Path

import click.testing

from sweeps.cli.main import main


def invoke(*arguments: str | Path) -> click.testing.Result:
    return click.testing.CliRunner().invoke(main, [str(a) for a in arguments])


def ok(*arguments: str | Path) -> str:
    """What a command that succeeds prints."""
    result = invoke(*arguments)
    assert result.exit_code == 0, result.output
    return result.stdout


def refused(*arguments: str | Path) -> str:
    """The one line with which a command refuses its input."""
    result = invoke(*arguments)
    assert result.exit_code == 2, result.output
    assert result.stderr.count("\n") == 1 and result.stderr[:-1].isprintable()
    return result.stderr
