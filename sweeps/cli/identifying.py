"""The command identify: parameters of an engine from its measured speed."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from sweeps.base.errors import SceneError, one_line, plain_number
from sweeps.cli.arguments import overwrite_option, quiet_option
from sweeps.cli.completing import complete_keys, complete_scene
from sweeps.cli.exits import guarded, say
from sweeps.cli.files import check_output, write_archive

if TYPE_CHECKING:
    from sweeps.lab.speed.identification import Varied

__all__ = ["identify"]


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
    from sweeps.view.texts.fits import fit_text

    found = fit(
        scene, wanted, teeth=teeth if perfect else "estimated", tooth_deviation=deviation,
        loss=loss, predict=not no_predictions,  # type: ignore[arg-type]
    )  # fmt: skip
    write_archive(found, output, overwrite)
    if not quiet:
        say(fit_text(found))


def _wanted(vary: str, own: str | None, priors: tuple[str, ...]) -> dict[str, Varied]:
    """What is fitted, from the texts of the options."""
    from dataclasses import replace

    from sweeps.lab.speed.identification import Varied

    found: dict[str, Varied] = {}
    for part in vary.split(","):
        key, separator, bounds = (text.strip() for text in part.partition("="))
        low, dots, high = bounds.partition("..")
        where = f"--vary {one_line(part.strip(), 60)}"
        if not key or key in found or bool(separator) != bool(dots):
            raise SceneError(f"{where}: must be KEY or KEY=LOW..HIGH, such as inertia=0.01..0.05")
        how = Varied()
        if dots:
            how = Varied(low=_number(low, where), high=_number(high, where))
        found[key] = how
    for text in priors:
        where = f"--prior {one_line(text, 60)}"
        key, _, known = (part.strip() for part in text.partition("="))
        value, sign, deviation = known.partition("+-")
        if key not in found or not sign:
            raise SceneError(
                f"{where}: must be KEY=VALUE+-DEVIATION, and KEY one of --vary, such as "
                "pegging=0+-0.05"
            )
        found[key] = replace(
            found[key], prior=_number(value, where), deviation=_number(deviation, where)
        )
    for key in () if own is None else (part.strip() for part in own.split(",")):
        if key not in found:
            raise SceneError(f"--own {one_line(key, 60)}: must be one of --vary")
        found[key] = replace(found[key], own=True)
    return found


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
