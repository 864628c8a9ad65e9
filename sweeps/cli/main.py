"""The command `engine-dyn` and the commands in it.

Exit status 0 on success, 2 on bad input with one line on stderr, 1 on other failures, 3 when
designs failed and the scene asked for that to be an error. NumPy, Numba, xarray and matplotlib are
imported by the commands that need them, so that help is quick.
"""

from __future__ import annotations

import gc
import itertools
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from typing import Any

import click

from sweeps.base import array_libraries
from sweeps.base.errors import one_line
from sweeps.cli.exits import BAD_INPUT, FAILURE, end, open_closed_streams, replaced, replacing, warn
from sweeps.cli.knowing import list_, new, plan, schema
from sweeps.cli.laboratory import calibrate, cylinders, identify, import_, measured, train
from sweeps.cli.looking import compare, export, info, plot, report, show
from sweeps.cli.running import extend, merge, rerun, run
from sweeps.cli.searching import (
    barred,
    best,
    firing_orders,
    firing_patterns,
    optimise,
    sensitivities,
)


@contextmanager
def _in_one_line(ctx: click.Context) -> Iterator[None]:
    try:
        yield
    except click.UsageError as error:
        path = ctx.command_path if error.ctx is None else error.ctx.command_path
        end(f"{one_line(error.format_message()).rstrip('.')}; see `{path} --help`", BAD_INPUT)


COMMANDS = {
    "Compute": (run, plan, extend, merge, rerun),
    "Look": (show, plot, report, info, compare),
    "Decide": (best, barred, optimise, sensitivities, firing_orders, firing_patterns),
    "Measure": (import_, measured, train, cylinders, identify, calibrate),
    "Files and names": (new, list_, export, schema),
}
"""Commands by what they are for, as the help lists them."""


class _Commands(click.Group):
    """Commands whose options with one value may be given once: click takes the last in silence."""

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        """Run as a program, which has its process to itself, and start quickly."""
        array_libraries.keep_out()
        # Imports make objects by the hundred thousand, among which the collector finds nothing.
        gc.set_threshold(100_000)
        return super().__call__(*args, **kwargs)

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Take the options before the command."""
        # Without any arguments, click raises its help text as an error, which is left as it is.
        with _in_one_line(ctx) if args else nullcontext():
            return super().parse_args(ctx, args)

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command that is given."""
        with _in_one_line(ctx):
            return super().invoke(ctx)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Find the command, and refuse an option that is given again."""
        name, command, rest = super().resolve_command(ctx, args)
        if command is not None and not ctx.resilient_parsing:
            parser = command.make_parser(click.Context(command, parent=ctx, info_name=name))
            _, _, given = parser.parse_args(list(rest))
            for option in given:
                one = isinstance(option, click.Option) and not (option.multiple or option.is_flag)
                if one and given.count(option) > 1:
                    count = given.count(option)
                    end(f"{option.opts[-1]}: given {count} times; must be given once", BAD_INPUT)
        return name, command, rest

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the commands by what they are for, each with its whole first sentence."""
        for purpose, commands in COMMANDS.items():
            with formatter.section(purpose):
                formatter.write_dl(
                    [(str(one.name), one.get_short_help_str(limit=1000)) for one in commands]
                )


@click.group(cls=_Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="engine-dyn", prog_name="engine-dyn")
def main() -> None:
    """Dynamics of reciprocating engines, swept over many designs.

    A scene (a TOML file) says which engine, which axes and which quantities to compute.
    `engine-dyn new` writes a scene to start from.
    """
    open_closed_streams()
    if reason := replaced():
        end(reason, FAILURE)
    if reason := replacing():
        warn([reason])


for command in itertools.chain(*COMMANDS.values()):
    main.add_command(command)
