"""The command that ranks the firing orders of an engine."""

from __future__ import annotations

from pathlib import Path

import click

from sweeps.cli.arguments import (
    PATH,
    overwrite_option,
    quiet_option,
    seed_option,
    threads_option,
    units_option,
)
from sweeps.cli.completing import complete_engine_or_scene, complete_quantities
from sweeps.cli.exits import announce_compiling, guarded, say, terminal_width, warn
from sweeps.cli.files import check_output, write_archive
from sweeps.errors import SceneError, one_line, plain_number

__all__ = ["firing_orders"]


@click.command("firing-orders")
@click.argument("what", shell_complete=complete_engine_or_scene)
@click.option(
    "--arrangement",
    metavar="TEXT",
    help="Another arrangement of the cylinders, such as 'in-line 6' or 'V8 cross-plane'.",
)
@click.option(
    "--set",
    "settings",
    multiple=True,
    metavar="KEY=VALUE",
    help="Value that replaces the engine's or the scene's, such as cylinder_spacing=0.15. Several "
    "separated by commas, or given several times.",
)
@click.option(
    "--crank",
    default="either-hand",
    show_default=True,
    metavar="WORD",
    help="own: the crankshaft as it is. either-hand: also its mirror image. any: its throws in "
    "any sequence along the shaft.",
)
@click.option(
    "--by",
    metavar="NAMES",
    shell_complete=complete_quantities,
    help="Quantities to rank by, smallest first; with several, by the sum of the ranks. Default: "
    "torque "
    "along the shaft, torsional excitation, loads of main bearings, shaking forces and moments.",
)
@click.option(
    "--sample",
    type=int,
    metavar="NUMBER",
    help="If there are too many orders, compute this many drawn at random.",
)
@seed_option
@click.option(
    "-o", "--output", type=PATH, help="Also write all firing orders to an archive, FILE.nc."
)
@click.option("--limit", type=click.IntRange(min=1), default=20, show_default=True,
              help="Largest number of orders to print.")  # fmt: skip
@units_option()
@threads_option
@overwrite_option()
@quiet_option
@guarded
def firing_orders(
    what: str, arrangement: str | None, settings: tuple[str, ...], crank: str, by: str | None,
    sample: int | None, seed: int, output: Path | None, limit: int, units: str | None,
    threads: int | None, overwrite: bool, quiet: bool,
) -> None:  # fmt: skip  # one parameter for each option
    """Compute WHAT, an engine or a scene, with all possible firing orders, and rank them.

    Example, an in-line six with its crankshaft as it is or mirrored: `engine-dyn firing-orders ntua
    --arrangement "in-line 6"`.
    """
    import warnings

    from engine_dyn import ImplausibleWarning

    given = dict(_setting(part) for text in settings for part in text.split(","))
    if output is not None:
        check_output(output, overwrite, Path(what))
    announce_compiling(quiet)
    from sweeps.exploring.firing_orders import firing_orders as ranked
    from sweeps.presenting.firing_orders import orders_text

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ImplausibleWarning)  # told below, one line each
        found = ranked(
            what, arrangement=arrangement, settings=given, crank=crank, by=by, sample=sample,
            seed=seed, threads=threads, progress=not quiet,
        )  # fmt: skip
    write_archive(found, output, overwrite)
    if not quiet:
        warn(found.attrs["warnings"].splitlines())
        say(orders_text(found, limit, units, terminal_width()))


def _setting(text: str) -> tuple[str, float]:
    """Return key and number of "speed=1500"."""
    key, _, value = text.partition("=")
    try:
        return key.strip(), plain_number(value)
    except ValueError:
        raise SceneError(
            f"--set {one_line(text, 60)}: must be KEY=NUMBER, such as speed=1500"
        ) from None
