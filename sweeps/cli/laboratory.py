"""Commands of the laboratory: import, measured, cylinders, train, identify, calibrate."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

import click

from sweeps.base.errors import SceneError, one_line, plain_number
from sweeps.cli.arguments import (
    PATH,
    complete_keys,
    complete_scene,
    number_of,
    output_option,
    overwrite_option,
    percentages,
    quiet_option,
)
from sweeps.cli.exits import announce_compiling, guarded, say, tell, warn
from sweeps.cli.files import (
    check_archive_output,
    check_folder,
    check_output,
    files_of,
    same_file,
    write_archive,
    writing,
)

if TYPE_CHECKING:
    import xarray as xr

    from sweeps.lab.pressure.imported_pressure import ImportedPressure
    from sweeps.lab.speed.identification import Varied
    from sweeps.scene.model import Scene


class _WithKeys(click.Command):
    """A command with an option for each key of `ImportOptions`; only it loads these keys."""

    def get_params(self, ctx: click.Context) -> list[click.Parameter]:
        """Options of the command itself, then those of the keys."""
        own = super().get_params(ctx)
        return [*own[:-1], *_key_options(), own[-1]]


@cache
def _key_options() -> tuple[click.Option, ...]:
    from sweeps.base.columns.options import ImportOptions

    options = []
    flags = {
        "average": "Average over all cycles.",
        "two_stroke": "Two-stroke: the cycle is one revolution.",
    }
    for name, field in ImportOptions.model_fields.items():
        words = [f"--{name.replace('_', '-')}", name]
        if field.annotation is bool:
            options.append(click.Option(words, is_flag=True, help=flags[name]))
            continue
        several = name == "pressure_column"
        how = " (several: repeat the option)" if several else ""
        about = f"{field.description or ''}{how}"
        options.append(click.Option(words, multiple=several, metavar="VALUE", help=about))
    return tuple(options)


@click.command(name="import", cls=_WithKeys)
@click.argument("raw", type=PATH)
@output_option("The CSV file to write.")
@click.option("--figures", type=PATH, help="Folder for figures of the recorded cycles.")
@overwrite_option("Replace the CSV file if it exists.")
@quiet_option
@guarded
def import_(
    raw: Path, output: Path, figures: Path | None, overwrite: bool, quiet: bool, **given: Any
) -> None:
    """Convert the recorded pressure in RAW to a CSV file over crank angle that scenes can read.

    RAW is a text file, .xlsx, .mat, .tdms, .mf4, .nc, .parquet, .wav or .uff. All that is
    detected, assumed and changed is printed and written to the header of the CSV file. The options
    are the keys of [indicator] in a scene; the page 'Laboratory files' explains them.
    """
    if same_file(output, raw):
        raise SceneError(f"{output}: is the raw file; -o must name another file")
    if output.suffix.lower() in _NO_CSV:
        raise SceneError(f"{output}: -o must name a text file, such as pressure.csv")
    check_output(output, overwrite)
    if figures is not None:
        check_folder(figures)
    from sweeps.lab.pressure.reading import read_pressure

    chosen = {name: v for name, v in given.items() if v not in (None, False, ())}
    imported = read_pressure(raw, **_checked({n: _value(n, v) for n, v in chosen.items()}))
    text = imported.text()
    with writing(output):
        output.parent.mkdir(parents=True, exist_ok=True)
        unfinished = output.with_name(f".{output.name}.unfinished")
        try:
            unfinished.write_text(text, encoding="utf-8")
            unfinished.replace(output)
        finally:
            unfinished.unlink(missing_ok=True)
    if figures is not None:
        with writing(figures):
            _draw(imported, figures)
    if not quiet:
        for step in imported.steps:
            tell(step)
        tell(f"{output}: {len(imported.mean.angle)} points")
        if figures is not None and not imported.sized:
            from sweeps.lab.pressure.evaluation import NOT_SIZED

            tell(f"{figures}: {NOT_SIZED}; give engine")
    warn(f"{raw}: {warning}" for warning in imported.warnings)


def _draw(imported: ImportedPressure, folder: Path) -> None:
    """Draw the sheet of each cylinder, in one folder each where there are several."""
    from engine_dyn.recordings.signal_checks import examine
    from sweeps.lab.pressure.evaluation import evaluated
    from sweeps.view.figures import draw

    for number, (name, cycles) in enumerate(imported.recorded.items(), start=1):
        findings = examine(cycles, imported.geometry, level=imported.levels.get(name))
        sheet = evaluated(
            cycles, imported.geometry, title=one_line(f"{imported.file}, {name}", 60),
            findings=findings, sized=imported.sized, pegged=imported.pegged,
        )  # fmt: skip
        draw(sheet, folder / f"cylinder_{number}" if len(imported.recorded) > 1 else folder)


_NO_CSV = (".xlsx", ".xlsm", ".mat", ".tdms", ".mf4", ".mdf", ".nc", ".parquet", ".wav", ".uff",
           ".unv", ".json", ".toml", ".html", ".png", ".pdf", ".svg")  # fmt: skip


def _checked(chosen: dict[str, Any]) -> dict[str, Any]:
    """Refuse values outside their ranges, by the names of the options."""
    from sweeps.base.checks import check_structure
    from sweeps.base.columns.options import ImportOptions

    try:
        check_structure(ImportOptions, chosen, "import")
    except SceneError as error:
        key, found, rest = str(error).removeprefix("import: ").partition(" = ")
        if not found or key not in chosen:
            raise
        raise SceneError(f"--{key.replace('_', '-')} = {rest}") from None
    return chosen


def _value(name: str, text: Any) -> Any:
    """Value of an option in the type of its key; the check refuses a text that does not convert."""
    from sweeps.base.columns.options import ImportOptions

    if isinstance(text, bool):
        return text
    if isinstance(text, tuple):
        return list(text) if len(text) > 1 else text[0]
    if not text.strip():
        raise SceneError(f"--{name.replace('_', '-')}: empty; must be a value")
    kinds = get_args(ImportOptions.model_fields[name].annotation) or (
        ImportOptions.model_fields[name].annotation,
    )
    try:
        if list[float] in kinds:
            listed = text.strip()
            listed = listed[1:-1] if listed[:1] == "[" and listed[-1:] == "]" else listed
            return [plain_number(part) for part in listed.split(",")]
        if str not in kinds and float in kinds:
            return plain_number(text)
        if str not in kinds and int in kinds:
            return int(text) if text.isascii() and text.isdigit() else text
    except ValueError:
        return text
    return text


def _read(scene: str, output: Path, overwrite: bool) -> Scene:
    """Read the scene, after a check that its output can be written."""
    check_archive_output(output, overwrite, Path(scene))
    from sweeps.scene.reading import read_scene

    read = read_scene(scene)
    check_output(output, overwrite, *files_of(read))
    return read


def _write(
    make: Callable[[], xr.Dataset], text: Callable[[xr.Dataset], str], output: Path,
    overwrite: bool, quiet: bool,
) -> None:  # fmt: skip
    """Compute a result, write it, and print what it holds."""
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
        check_archive_output(output, overwrite, Path(scene))
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
    """Parameters to fit, read from the texts of the options."""
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
    """Standard deviation of the errors of teeth, from the option --teeth."""
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
    from sweeps.lab.speed.calibration_model import published
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
    warn(() if quiet else sheet.unusual)
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
