"""Commands about measured speed and recorded cycles: measured, train, cylinders."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sweeps.cli.arguments import number_of, output_option, overwrite_option, quiet_option
from sweeps.cli.completing import complete_scene
from sweeps.cli.exits import guarded, say
from sweeps.cli.files import check_output, files_of, write_archive, writing

if TYPE_CHECKING:
    import xarray as xr

    from sweeps.scene.model import Scene

__all__ = ["cylinders", "measured", "train"]


def _read(scene: str, output: Path, overwrite: bool) -> Scene:
    """The scene, after a look at what would be written."""
    from sweeps.scene.reading import read_scene

    read = read_scene(scene)
    check_output(output, overwrite, *files_of(read))
    return read


def _write(
    make: Callable[[], xr.Dataset], text: Callable[[xr.Dataset], str], output: Path,
    overwrite: bool, quiet: bool,
) -> None:  # fmt: skip
    """Compute a result, write it, and tell it."""
    with writing(output):
        dataset = make()
    write_archive(dataset, output, overwrite)
    if not quiet:
        say(text(dataset))


@click.command()
@click.argument("scene", shell_complete=complete_scene)
@output_option()
@overwrite_option()
@quiet_option
@guarded
def measured(scene: str, output: Path, overwrite: bool, quiet: bool) -> None:
    """Compare the speed computed from SCENE with the recordings in its table [measured].

    Prints the measured delta, raw and corrected for tooth errors, beside the computed delta, and
    writes all curves to a netCDF archive that `plot` can draw. The page 'Measured speed' explains
    the keys of the table; `engine-dyn new` writes a scene with an example.
    """
    read = _read(scene, output, overwrite)
    from sweeps.lab.speed.measured import measured as compare
    from sweeps.view.texts.lab_texts import measured_text

    _write(lambda: compare(read), measured_text, output, overwrite, quiet)


@click.command()
@click.argument("scene", shell_complete=complete_scene)
@output_option()
@overwrite_option()
@quiet_option
@guarded
def train(scene: str, output: Path, overwrite: bool, quiet: bool) -> None:
    """Compute the speed over the consecutive recorded cycles of SCENE.

    These cycles form a train. Initial speed and load are fitted to the speed in [measured], or
    taken from the mean cycle. Two variants are computed for comparison: the whole train repeated
    periodically, with the jump in speed that this forces, and each cycle repeated periodically.
    """
    read = _read(scene, output, overwrite)
    from sweeps.lab.speed.recorded_train import follow_cycles
    from sweeps.view.texts.lab_texts import train_text

    _write(lambda: follow_cycles(read), train_text, output, overwrite, quiet)


@click.command()
@click.argument("scene", shell_complete=complete_scene)
@click.option(
    "--false-alarms",
    default="1e-4",
    metavar="NUMBER",
    help="Accepted probability of a false alarm in one engine cycle. Default: 1e-4.",
)
@click.option(
    "--tooth-deviation",
    default="0.001",
    metavar="NUMBER",
    help="Standard deviation of unknown tooth errors, as a fraction of the tooth pitch; it limits "
    "how well weak cylinders are detected. Default: 0.001.",
)
@output_option()
@overwrite_option()
@quiet_option
@guarded
def cylinders(
    scene: str, false_alarms: str, tooth_deviation: str, output: Path, overwrite: bool, quiet: bool
) -> None:
    """Find misfires and weak cylinders from the speeds in the table [measured] of SCENE.

    Prints for each cylinder how its imep differs from that of the other cylinders, and the
    threshold below which a cycle counts as a misfire. Writes the deviation of every cycle to a
    netCDF archive.
    """
    read = _read(scene, output, overwrite)
    rate = number_of(false_alarms, "--false-alarms")
    deviation = number_of(tooth_deviation, "--tooth-deviation")
    from sweeps.lab.speed.cylinder_deviations import cylinder_deviations
    from sweeps.view.texts.lab_texts import deviations_text

    _write(
        lambda: cylinder_deviations(read, false_alarms=rate, tooth_deviation=deviation),
        deviations_text, output, overwrite, quiet,
    )  # fmt: skip
