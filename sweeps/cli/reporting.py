"""The command that writes a report."""

from __future__ import annotations

from pathlib import Path

import click

from sweeps.base.errors import SceneError, size_text
from sweeps.cli.arguments import (
    archive_argument,
    file_size,
    output_option,
    overwrite_option,
    quiet_option,
    units_option,
    untrusted_option,
)
from sweeps.cli.exits import guarded, tell
from sweeps.cli.files import check_output, opened, writing

__all__ = ["report"]


@click.command()
@archive_argument
@output_option("The report to write, FILE.html.")
@click.option(
    "--limit",
    default="20MB",
    show_default=True,
    metavar="SIZE",
    help="Largest size of the file. Numbers that do not fit are thinned out; the report says "
    "which.",
)
@units_option(
    "Units of columns, such as brake_power=hp,omega_mean=rad/s; 'archive' keeps those of the "
    "archive. Default: kW, rpm, kN, kJ, mm and l."
)
@overwrite_option("Replace the report if it exists.")
@quiet_option
@untrusted_option
@guarded
def report(
    archive: Path, output: Path, limit: str, units: str | None, overwrite: bool, quiet: bool
) -> None:
    """Write a report on ARCHIVE as one self-contained HTML file.

    It has tables, figures that can be zoomed, and an explorer with a slider for every axis. It
    opens in any browser without a network connection.
    """
    from sweeps.base.netcdf.netcdf_files import check_file

    size = file_size(limit)
    if output.suffix.lower() not in (".html", ".htm"):
        raise SceneError(f"{output}: unknown extension; must be .html")
    check_file(archive)
    check_output(output, overwrite, archive)
    from sweeps.view.report.page import report as write

    with opened(archive) as dataset, writing(output):
        write(dataset, output, limit=size, units=units, overwrite=overwrite)
    if not quiet:
        tell(f"{output}: {size_text(output.stat().st_size)}")
