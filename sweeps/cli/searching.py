"""The command that searches archives: best."""

from __future__ import annotations

from pathlib import Path

import click

from sweeps.cli.arguments import archive_argument, axis_slice, untrusted_option
from sweeps.cli.completing import complete_quantities
from sweeps.cli.exits import guarded, say, terminal_width
from sweeps.cli.files import opened

__all__ = ["best"]


@click.command()
@archive_argument
@click.option(
    "--least",
    metavar="NAME",
    shell_complete=complete_quantities,
    help="Quantity or axis of which the design has the least.",
)
@click.option(
    "--most",
    metavar="NAME",
    shell_complete=complete_quantities,
    help="Quantity or axis of which the design has the most.",
)
@click.option(
    "--within",
    multiple=True,
    metavar="CONDITION",
    help="Condition such as 'delta <= 1/200' or 'delta <= generator' (engine-dyn list classes). "
    "May be given several times; all must hold.",
)
@click.option(
    "--at-every",
    metavar="AXES",
    help="Axes at all values of which the conditions must hold, such as load,speed.",
)
@click.option(
    "--not-counted",
    metavar="OUTCOMES",
    help="With --at-every: outcomes whose points are left out, such as no_steady_state (idle).",
)
@click.option(
    "--select",
    "slices",
    multiple=True,
    metavar="AXIS=VALUE",
    help="Search at this value of an axis alone. Several with commas, or given several times.",
)
@click.option(
    "--quantities",
    metavar="NAMES",
    shell_complete=complete_quantities,
    help="Quantities to show of the design, such as delta,imep.",
)
@click.option("--units", metavar="NAME=UNIT", help="Units of columns, as `show` takes them.")
@untrusted_option
@guarded
def best(
    archive: Path, least: str | None, most: str | None, within: tuple[str, ...],
    at_every: str | None, not_counted: str | None, slices: tuple[str, ...],
    quantities: str | None, units: str | None,
) -> None:  # fmt: skip  # one parameter for each option
    """Find the design of ARCHIVE with the least, or most, of a quantity, under conditions.

    Lightest flywheel for 1/200 at every load and speed: `engine-dyn best my.nc --least inertia
    --within "delta <= 1/200" --at-every load,speed`.
    """
    from sweeps.reading.netcdf_files import check_file

    select = dict(axis_slice(part) for text in slices for part in text.split(","))
    check_file(archive)
    with opened(archive) as dataset:
        from sweeps.exploring.search import best as best_of
        from sweeps.exploring.slices import nearest
        from sweeps.presenting.found import found_text

        part = nearest(dataset, **select)
        found = best_of(
            part, least=least, most=most, within=within, at_every=_names(at_every),
            not_counted=_names(not_counted),
        )  # fmt: skip
        text = found_text(dataset, found, _names(quantities) or None, units, terminal_width())
    say(text)


def _names(text: str | None) -> list[str]:
    return [] if text is None else [name.strip() for name in text.split(",")]
