"""The command identify: parameters of an engine from its measured speed."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from sweeps.base.errors import SceneError, one_line, plain_number
from sweeps.cli.arguments import PATH, output_option, overwrite_option, percentages, quiet_option
from sweeps.cli.completing import complete_keys, complete_scene
from sweeps.cli.exits import announce_compiling, guarded, say, tell
from sweeps.cli.files import check_output, same_file, write_archive, writing

if TYPE_CHECKING:
    from sweeps.lab.speed.identification import Varied

__all__ = ["calibrate", "identify"]


@click.command()
@click.argument("scene", shell_complete=complete_scene)
@click.option(
    "--vary",
    shell_complete=complete_keys,
    required=True,
    metavar="KEYS",
    help="Parameters to fit, such as inertia,gap_angle, with bounds if they are known: "
    "inertia=0.01..0.05. Besides the keys of scenes: dead_centre_shift, pegging and "
    "pressure_factor (of the diagrams), gap_angle (of the wheel) and recording_shift (of "
    "both).",
)
@click.option("--own", metavar="KEYS", help="Parameters with a separate value for each recording.")
@click.option(
    "--prior",
    "priors",
    multiple=True,
    metavar="KEY=VALUE+-DEVIATION",
    help="Prior value of a parameter with its standard deviation, such as pegging=0+-0.05. May be "
    "given several times.",
)
@click.option(
    "--teeth",
    default="estimated",
    metavar="TEXT",
    help="Tooth errors of the wheel: 'estimated' (default), 'perfect', or the standard deviation "
    "assumed for the estimate, as a fraction of a tooth interval, such as 0.002.",
)
@click.option(
    "--loss",
    type=click.Choice(["linear", "soft_l1", "huber"]),
    default="linear",
    help="Loss function of the residuals. linear is least squares; the others give large "
    "residuals less weight.",
)
@click.option(
    "--no-predictions",
    is_flag=True,
    help="Skip the cross-validation (predicting each recording from the others).",
)
@click.option("-o", "--output", type=click.Path(path_type=Path), help="Archive to write, FIT.nc.")
@overwrite_option("Replace the result if it exists.")
@quiet_option
@guarded
def identify(
    scene: str, vary: str, own: str | None, priors: tuple[str, ...], teeth: str, loss: str,
    no_predictions: bool, output: Path | None, overwrite: bool, quiet: bool,
) -> None:  # fmt: skip
    """Fit parameters of SCENE to the measured speeds named in its table [measured].

    Prints each value with its 95 % interval, how well the speed determines the parameters, and how
    well each recording is predicted from the others.
    """
    if output is not None:
        check_output(output, overwrite, Path(scene))
    wanted = _wanted(vary, own, priors)
    perfect = teeth in ("estimated", "perfect")
    deviation = None if perfect else _deviation(teeth)
    from sweeps.lab.speed.identification import identify as fit
    from sweeps.view.texts.lab_texts import fit_text

    fitted = fit(
        scene, wanted, teeth=teeth if perfect else "estimated", tooth_deviation=deviation,
        loss=loss, predict=not no_predictions,  # type: ignore[arg-type]
    )  # fmt: skip
    write_archive(fitted, output, overwrite)
    if not quiet:
        say(fit_text(fitted))


def _wanted(vary: str, own: str | None, priors: tuple[str, ...]) -> dict[str, Varied]:
    """The parameters to fit, read from the texts of the options."""
    from dataclasses import replace

    from sweeps.lab.speed.identification import Varied

    varied: dict[str, Varied] = {}
    for part in vary.split(","):
        key, separator, bounds = (text.strip() for text in part.partition("="))
        low, dots, high = bounds.partition("..")
        where = f"--vary {one_line(part.strip(), 60)}"
        if not key or key in varied or bool(separator) != bool(dots):
            raise SceneError(f"{where}: must be KEY or KEY=LOW..HIGH, such as inertia=0.01..0.05")
        how = Varied()
        if dots:
            how = Varied(low=_number(low, where), high=_number(high, where))
        varied[key] = how
    for text in priors:
        where = f"--prior {one_line(text, 60)}"
        key, _, known = (part.strip() for part in text.partition("="))
        value, sign, deviation = known.partition("+-")
        if key not in varied or not sign:
            raise SceneError(
                f"{where}: must be KEY=VALUE+-DEVIATION, and KEY one of --vary, such as "
                "pegging=0+-0.05"
            )
        varied[key] = replace(
            varied[key], prior=_number(value, where), deviation=_number(deviation, where)
        )
    for key in () if own is None else (part.strip() for part in own.split(",")):
        if key not in varied:
            raise SceneError(f"--own {one_line(key, 60)}: must be one of --vary")
        varied[key] = replace(varied[key], own=True)
    return varied


def _deviation(teeth: str) -> float:
    """Standard deviation of the teeth's errors, from the option --teeth."""
    try:
        return plain_number(teeth)
    except ValueError:
        raise SceneError(
            f"--teeth {one_line(teeth.strip(), 30)}: must be estimated, perfect, or a standard "
            "deviation of the relative errors, such as 0.002"
        ) from None


def _number(text: str, where: str) -> float:
    try:
        return plain_number(text)
    except ValueError:
        raise SceneError(f"{where}: {one_line(text.strip(), 30)} is not a number") from None


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
        from sweeps.view.texts.lab_texts import calibration_text

        say(calibration_text(made))
        say("")
        tell(f"{output}: show it with `engine-dyn info {output}`, and start a scene with")
        tell(f"`engine-dyn new study.toml --for {output}`")
