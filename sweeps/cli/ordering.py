"""The commands that rank the firing orders and the firing patterns of an engine."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import click

from sweeps.base.errors import SceneError, one_line, plain_number
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

__all__ = ["firing_orders", "firing_patterns"]


settings_option = click.option(
    "--set",
    "settings",
    multiple=True,
    metavar="KEY=VALUE",
    help="Value that replaces the engine's or the scene's, such as cylinder_spacing=0.15. Several "
    "separated by commas, or given several times.",
)


@click.command("firing-orders")
@click.argument("what", shell_complete=complete_engine_or_scene)
@click.option(
    "--arrangement",
    metavar="TEXT",
    help="Another arrangement of the cylinders, such as 'in-line 6' or 'V8 cross-plane'.",
)
@settings_option
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
    given = _settings(settings)
    if output is not None:
        check_output(output, overwrite, Path(what))
    announce_compiling(quiet)
    from sweeps.decide.explore.firing_orders import firing_orders as ranked
    from sweeps.view.texts.firing_orders import orders_text

    with _warnings_told_later():
        archive = ranked(
            what, arrangement=arrangement, settings=given, crank=crank, by=by, sample=sample,
            seed=seed, threads=threads, progress=not quiet,
        )  # fmt: skip
    write_archive(archive, output, overwrite)
    if not quiet:
        warn(archive.attrs["warnings"].splitlines())
        say(orders_text(archive, limit, units, terminal_width()))


@click.command("firing-patterns")
@click.argument("what", shell_complete=complete_engine_or_scene)
@click.option(
    "--density",
    required=True,
    metavar="SHARE",
    help="Share of the firings that happen, such as 2/3 or 0.75.",
)
@click.option(
    "--longest",
    type=int,
    default=12,
    show_default=True,
    metavar="FIRINGS",
    help="Firings after which patterns repeat, at most.",
)
@click.option(
    "--by",
    default="delta",
    show_default=True,
    metavar="NAME",
    shell_complete=complete_quantities,
    help="Quantity to rank by, smallest first.",
)
@click.option(
    "--order",
    type=float,
    metavar="ORDER",
    help="With a quantity over orders, such as torque_order: the order that counts.",
)
@click.option(
    "--valves-shut",
    is_flag=True,
    help="Cylinders that do not fire have their valves shut; otherwise they are motored.",
)
@click.option(
    "--any-torque",
    is_flag=True,
    help="Leave the pressure as it is; otherwise cylinders that fire have so much more that the "
    "mean torque is that of all firings.",
)
@settings_option
@click.option(
    "-o", "--output", type=PATH, help="Also write all firing patterns to an archive, FILE.nc."
)
@click.option(
    "--limit",
    type=click.IntRange(min=1),
    default=20,
    show_default=True,
    help="Largest number of patterns to print.",
)
@units_option()
@threads_option
@overwrite_option()
@quiet_option
@guarded
def firing_patterns(
    what: str, density: str, longest: int, by: str, order: float | None, valves_shut: bool,
    any_torque: bool, settings: tuple[str, ...], output: Path | None, limit: int,
    units: str | None, threads: int | None, overwrite: bool, quiet: bool,
) -> None:  # fmt: skip  # one parameter for each option
    """Compute WHAT, an engine or a scene, with all firing patterns of a density, and rank them.

    Example, two of three firings of a four-cylinder engine: `engine-dyn firing-patterns ntua --set
    cylinders=4,load=50 --density 2/3`.
    """
    given = _settings(settings)
    if output is not None:
        check_output(output, overwrite, Path(what))
    announce_compiling(quiet)
    from sweeps.decide.explore.firing_patterns import firing_patterns as ranked
    from sweeps.view.texts.firing_orders import patterns_text

    with _warnings_told_later():
        archive = ranked(
            what, density, longest=longest, by=by, order=order, valves_shut=valves_shut,
            keep_torque=not any_torque, settings=given, threads=threads, progress=not quiet,
        )  # fmt: skip
    write_archive(archive, output, overwrite)
    if not quiet:
        warn(archive.attrs["warnings"].splitlines())
        say(patterns_text(archive, limit, units, terminal_width()))


@contextmanager
def _warnings_told_later() -> Iterator[None]:
    """Keep plausibility silent while an archive is computed, whose attribute has one line each."""
    import warnings

    from engine_dyn import ImplausibleWarning

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ImplausibleWarning)
        yield


def _settings(texts: tuple[str, ...]) -> dict[str, float]:
    return dict(_setting(part) for text in texts for part in text.split(","))


def _setting(text: str) -> tuple[str, float]:
    """Return key and number of "speed=1500"."""
    key, _, value = text.partition("=")
    try:
        return key.strip(), plain_number(value)
    except ValueError:
        raise SceneError(
            f"--set {one_line(text, 60)}: must be KEY=NUMBER, such as speed=1500"
        ) from None
