"""Commands about measured speed: measured."""

from __future__ import annotations

from pathlib import Path

import click

from sweeps.cli.arguments import output_option, overwrite_option, quiet_option
from sweeps.cli.exits import guarded, say
from sweeps.cli.files import check_output, files_of, writing

__all__ = ["measured"]


@click.command()
@click.argument("scene")
@output_option()
@overwrite_option()
@quiet_option
@guarded
def measured(scene: str, output: Path, overwrite: bool, quiet: bool) -> None:
    """Compare the speed that SCENE computes with the recordings in its table [measured].

    Prints delta, raw and with the errors of the teeth taken out, beside the computed one, and
    writes all curves to a netCDF archive, which `plot` draws.
    """
    from sweeps.scene.reading import read_scene

    read = read_scene(scene)
    check_output(output, overwrite, *files_of(read))
    from sweeps.archive.netcdf import write
    from sweeps.measuring.measured import measured as compare
    from sweeps.presenting.measured import measured_text

    with writing(output):
        found = compare(read)
        write(found, output, overwrite=overwrite)
    if not quiet:
        say(measured_text(found))
