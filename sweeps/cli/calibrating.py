"""The command that makes an engine of a data sheet: calibrate."""

from __future__ import annotations

from pathlib import Path

import click

from sweeps.base.errors import SceneError
from sweeps.cli.arguments import PATH, output_option, overwrite_option, percentages, quiet_option
from sweeps.cli.exits import announce_compiling, guarded, say, tell
from sweeps.cli.files import check_output, same_file, writing

__all__ = ["calibrate"]


@click.command()
@click.argument("engine", type=PATH)
@click.option(
    "--power", metavar="POWER", help="Rated brake power, such as 19kW. Without a unit: kW."
)
@click.option("--speed", metavar="SPEED", help="Rated speed. Without a unit: rpm.")
@click.option(
    "--peak",
    metavar="PRESSURE",
    help="Peak cylinder pressure, absolute. Without a unit: bar.",
)
@click.option(
    "--fuel-consumption",
    metavar="RATE",
    help="Brake specific fuel consumption at rated power. Without a unit: g/kWh.",
)
@click.option(
    "--kind",
    metavar="KIND",
    help="diesel (default), turbocharged-diesel, spark-ignition or turbocharged-spark-ignition.",
)
@click.option(
    "--loads",
    metavar="LIST",
    help="Percentages of the rated mean effective pressure. Default: 10,25,50,75,100.",
)
@output_option("The engine file to write.")
@overwrite_option("Replace the file if it exists.")
@quiet_option
@guarded
def calibrate(
    engine: Path, power: str | None, speed: str | None, peak: str | None,
    fuel_consumption: str | None, kind: str | None, loads: str | None, output: Path,
    overwrite: bool, quiet: bool,
) -> None:  # fmt: skip  # one parameter for each option
    """Make an engine file with pressure diagrams from ENGINE, a data sheet (TOML).

    ENGINE is an engine file with bore, stroke and number of cylinders; `engine-dyn new --engine`
    writes one to fill in. Modelled cycles are fitted to rated power and speed and, if known, to
    the peak cylinder pressure and the fuel consumption. All assumptions are listed.
    """
    from sweeps.lab.speed.calibration import fit
    from sweeps.lab.speed.rated_point import published
    from sweeps.scene.engine.data_sheets import files_named, read_data_sheet

    shares = None if loads is None else percentages(loads)
    sheet = read_data_sheet(engine)
    if same_file(output, engine):
        raise SceneError(f"{output}: is the data sheet itself; -o must name another file")
    check_output(output, overwrite)
    elsewhere = output.parent.resolve() != engine.parent.resolve()
    for file in files_named(sheet) if elsewhere else ():
        raise SceneError(
            f"{output}: must be in the folder of {engine}, which names the file {file} beside it"
        )
    options = {"power": power, "speed": speed, "peak": peak, "fuel_consumption": fuel_consumption}
    given = published(sheet, "--", options, kind, shares)
    announce_compiling(quiet)
    made = fit(sheet, given)
    text = made.text
    from sweeps.running.archive.netcdf import replaced

    with writing(output), replaced(output) as partial:
        partial.write_text(text, encoding="utf-8")
    if not quiet:
        from sweeps.view.texts.calibrations import calibration_text

        say(calibration_text(made))
        say("")
        tell(f"{output}: show it with `engine-dyn info {output}`, and start a scene with")
        tell(f"`engine-dyn new study.toml --for {output}`")
