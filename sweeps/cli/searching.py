"""Commands that search designs, and say what moves their results: best, optimise, sensitivities."""

from __future__ import annotations

from pathlib import Path

import click

from sweeps.cli.arguments import (
    PATH,
    archive_argument,
    axis_slices,
    names_of,
    number_of,
    overwrite_option,
    quantities_option,
    quiet_option,
    seed_option,
    select_option,
    threads_option,
    units_option,
    untrusted_option,
)
from sweeps.cli.completing import complete_quantities, complete_scene
from sweeps.cli.exits import (
    FAILURE,
    announce_compiling,
    end,
    guarded,
    say,
    tell,
    terminal_width,
    warn,
)
from sweeps.cli.files import check_output, check_slices, opened, write_archive
from sweeps.decide.optimise import DESIGNS, GENERATIONS, RESTARTS

__all__ = ["best", "optimise", "sensitivities"]


@click.command()
@archive_argument
@click.option(
    "--least",
    metavar="NAME",
    shell_complete=complete_quantities,
    help="Quantity or axis to minimise.",
)
@click.option(
    "--most",
    metavar="NAME",
    shell_complete=complete_quantities,
    help="Quantity or axis to maximise.",
)
@click.option(
    "--within",
    multiple=True,
    metavar="CONDITION",
    help="Condition such as 'delta <= 1/200', 'delta <= generator' (engine-dyn list classes) or "
    "'brake_power >= 60 kW'. A number without a unit is in the unit of the archive (W, rad s-1). "
    "May be given several times; all must hold.",
)
@click.option(
    "--at-every",
    metavar="AXES",
    help="Axes at whose every value the conditions must hold, such as load,speed. Needed for speed "
    "and load, which are not chosen with a design, unless --select or a condition names them.",
)
@click.option(
    "--not-counted",
    metavar="OUTCOMES",
    help="With --at-every: leave out points with these outcomes, such as no_steady_state (idle).",
)
@select_option("Search only at this value of an axis, or the nearest one in the archive.")
@quantities_option("Quantities of the design to show, such as delta,imep.")
@units_option()
@untrusted_option
@guarded
def best(
    archive: Path, least: str | None, most: str | None, within: tuple[str, ...],
    at_every: str | None, not_counted: str | None, slices: tuple[str, ...],
    quantities: str | None, units: str | None,
) -> None:  # fmt: skip  # one parameter for each option
    """Find the design of ARCHIVE that minimises or maximises a quantity under conditions.

    Example, the lightest flywheel for delta = 1/200 at every load and speed: `engine-dyn best my.nc
    --least inertia --within "delta <= 1/200" --at-every load,speed`.
    """
    from sweeps.base.netcdf.netcdf_files import check_file

    select = axis_slices(slices)
    check_file(archive)
    with opened(archive) as dataset:
        from sweeps.decide.explore.opening import nearest
        from sweeps.decide.explore.search import best as best_of
        from sweeps.view.texts.optimised import found_text

        check_slices(dataset, select)
        part = nearest(dataset, **select)
        designs = best_of(
            part, least=least, most=most, within=within, at_every=names_of(at_every) or (),
            not_counted=names_of(not_counted) or (),
        )  # fmt: skip
        text = found_text(dataset, designs, names_of(quantities), units, terminal_width(), within)
    say(text)


@click.command()
@click.argument("scene", shell_complete=complete_scene)
@click.option(
    "--least",
    multiple=True,
    metavar="NAMES",
    shell_complete=complete_quantities,
    help="Quantities or searched keys to minimise. If --least and --most give several names "
    "together, the Pareto front is found.",
)
@click.option(
    "--most",
    multiple=True,
    metavar="NAMES",
    shell_complete=complete_quantities,
    help="Quantities or searched keys to maximise.",
)
@click.option(
    "--within",
    multiple=True,
    metavar="CONDITION",
    help="Condition such as 'delta <= 1/200' or 'main_journal_load_max <= 30 kN', at every value "
    "of the scene's axes. A number without a unit is in the unit of archives (N, W, rad s-1). May "
    "be given several times; all must hold.",
)
@click.option(
    "--over",
    multiple=True,
    metavar="KEY[=RANGE]",
    help="Parameters to search: 'inertia = 0.2 to 5', 'inertia = 0.2 to 5 log', 'cylinders = 4, "
    "6', "
    "'arrangement = in-line 6 | boxer 6', or keys of the scene's [sample] separated by commas. "
    "May be given several times. Default: all of [sample].",
)
@click.option(
    "--not-counted",
    metavar="OUTCOMES",
    help="Leave out points with these outcomes, such as no_steady_state (idle).",
)
@click.option(
    "--designs",
    default=DESIGNS,
    show_default=True,
    help="Designs per generation.",
)
@click.option(
    "--generations", default=GENERATIONS, show_default=True, help="Generations per search."
)
@click.option(
    "--restarts",
    default=RESTARTS,
    show_default=True,
    help="Number of searches, each from different first designs.",
)
@seed_option
@click.option("-o", "--output", type=PATH, help="Also write all computed designs to this archive.")
@overwrite_option()
@threads_option
@quiet_option
@guarded
def optimise(
    scene: str, least: tuple[str, ...], most: tuple[str, ...], within: tuple[str, ...],
    over: tuple[str, ...], not_counted: str | None, designs: int, generations: int,
    restarts: int, seed: int, output: Path | None, overwrite: bool, threads: int | None,
    quiet: bool,
) -> None:  # fmt: skip  # one parameter for each option
    """Search SCENE for the design that minimises or maximises a quantity under conditions.

    The conditions must hold at every value of the scene's axes. The least inertia under a limit of
    delta is found exactly. All other parameters are searched over generations of designs, and the
    best computed design is printed. An interrupted search writes nothing. The exit status is 1 if
    no design meets the conditions.

    Example, the lightest flywheel for delta = 1/200: `engine-dyn optimise my.toml --least inertia
    --within "delta <= 1/200" --over "inertia = 0.2 to 5"`.
    """
    import sys
    import warnings

    if output is not None:
        check_output(output, overwrite, Path(scene))
    from sweeps.base.dimensions import FOUND
    from sweeps.decide.optimise.optimise import optimise as search
    from sweeps.view.texts.optimised import optimised_text

    announce_compiling(quiet)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the archive has them, and they are printed below
        archive = search(
            scene, least=_several(least), most=_several(most), within=within,
            over=list(over) or None, not_counted=names_of(not_counted) or (), number=designs,
            generations=generations, restarts=restarts, seed=seed, threads=threads,
            progress=not quiet and sys.stderr.isatty(),
        )  # fmt: skip
    write_archive(archive, output, overwrite)
    if not quiet:
        warn(archive.attrs["warnings"].splitlines())
        say(optimised_text(archive))
        if output is not None:
            tell(f"{output}: all computed designs; use engine-dyn show, plot and best with it")
    if not archive[FOUND].values.any():
        end("no computed design meets the conditions", FAILURE)


def _several(texts: tuple[str, ...]) -> list[str]:
    return [name for text in texts for name in names_of(text) or ()]


@click.command()
@archive_argument
@quantities_option("Quantities, such as delta,imep. Default: all with one number per design.")
@click.option(
    "--confidence",
    default="0.95",
    show_default=True,
    metavar="NUMBER",
    help="Confidence level of the intervals.",
)
@click.option(
    "--resamples", default=100, show_default=True, help="Bootstrap samples for the intervals."
)
@seed_option
@click.option("-o", "--output", type=PATH, help="Also write the indices to this netCDF file.")
@overwrite_option()
@quiet_option
@untrusted_option
@guarded
def sensitivities(
    archive: Path, quantities: str | None, confidence: str, resamples: int, seed: int,
    output: Path | None, overwrite: bool, quiet: bool,
) -> None:  # fmt: skip  # one parameter for each option
    """Compute which share of the variance of each result in ARCHIVE is due to which parameter.

    The shares are Sobol' indices: first-order and total indices with confidence intervals if the
    scene's [sample] has method = "saltelli", first-order indices for other samples, and both for
    grids. `plot` draws the file written with -o.
    """
    import sys

    from sweeps.base.netcdf.netcdf_files import check_file

    level = number_of(confidence, "--confidence")
    check_file(archive)
    if output is not None:
        check_output(output, overwrite)
    with opened(archive) as dataset:
        from sweeps.decide.explore.sensitivities import sensitivities as indices_of
        from sweeps.view.texts.sensitivities import sensitivities_text

        names = names_of(quantities)
        indices = indices_of(
            dataset, names, confidence=level, resamples=resamples, seed=seed,
            progress=not quiet and sys.stderr.isatty(),
        )  # fmt: skip
    write_archive(indices, output, overwrite)
    if not quiet:
        say(sensitivities_text(indices))
