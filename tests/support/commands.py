"""The command `engine-dyn`, called in this process."""

from pathlib import Path

import click.testing

from engine_dyn.compilation import COMPILING
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
    told = result.stderr.replace(f"{COMPILING}\n", "")  # where this test is the first to compile
    assert told.count("\n") == 1 and told[:-1].isprintable(), result.stderr
    return told
