"""Commands that search designs, firing orders and patterns, and say what moves their results."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import click

from sweeps.base.errors import SceneError, one_line, plain_number
from sweeps.base.files.numbers_with_units import PATTERN, number_with_unit
from sweeps.cli.arguments import (
    PATH,
    archive_argument,
    axis_slices,
    complete_engine_or_scene,
    complete_quantities,
    complete_scene,
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
from sweeps.cli.files import check_archive_output, check_slices, opened, write_archive
from sweeps.decide.optimise import DESIGNS, EVENLY, GENERATIONS, RESTARTS


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
    help="Axes at all values of which a design must work, such as load,speed: the conditions hold "
    "at each of them, and the worst value counts.",
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
        from sweeps.decide.explore.search import search_best
        from sweeps.view.texts.optimised import best_text

        check_slices(dataset, select)
        part = nearest(dataset, **select)
        found = search_best(
            part, least=least, most=most, within=within, at_every=names_of(at_every) or (),
            not_counted=names_of(not_counted) or (),
        )  # fmt: skip
        text = best_text(dataset, found, names_of(quantities), units, terminal_width())
    say(text)


@click.command()
@archive_argument
@select_option("Solve only this value of an axis, or the nearest one in the archive.")
@threads_option
@quiet_option
@untrusted_option
@guarded
def barred(archive: Path, slices: tuple[str, ...], threads: int | None, quiet: bool) -> None:
    """Find the speeds at which the shaft of ARCHIVE is above a limit, by solving.

    ARCHIVE has speed as an axis, and shaft_stress_over_limit, shaft_torque_over_limit or
    propulsion_stress_over_limit. Its scene is computed at more speeds in the same range, until both
    edges of each range are known. Each case (all cylinders fire, each misfire, each load and
    design) is by itself, with the order and the mode that it comes from.
    """
    from sweeps.base.netcdf.netcdf_files import check_file

    select = axis_slices(slices)
    if "speed" in select:
        raise SceneError("--select speed: barred needs all speeds; choose values of other axes")
    check_file(archive)
    announce_compiling(quiet)
    with opened(archive) as dataset:
        from sweeps.decide.explore.barred import barred_ranges
        from sweeps.decide.explore.opening import nearest
        from sweeps.decide.explore.shaft_extremes import NEEDED, OVER_LIMITS
        from sweeps.view.texts.barred import barred_text

        check_slices(dataset, select)
        limits = [name for name in OVER_LIMITS if name in dataset]
        if not limits:
            raise SceneError(f"{archive}: has none of {', '.join(OVER_LIMITS)}; {NEEDED}")
        if dataset.sizes.get("speed", 1) < 2:
            raise SceneError(
                f"{archive}: has one speed alone; barred needs two speeds or more, between which "
                "it looks"
            )
        used = {d for name in limits for d in dataset[name].dims}
        for key in [key for key in select if key in dataset.sizes and key not in used]:
            others = ", ".join(sorted(map(str, used - {"speed"}))) or "left out"
            raise SceneError(
                f"--select {key}: the limits do not depend on {key}, and all of it acts; must be "
                f"{others}"
            )
        part = nearest(dataset, **select)
        found = barred_ranges(part, threads=threads, progress=not quiet and sys.stderr.isatty())
        text = barred_text(part, found)
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
    type=int,
    help=f"Designs per generation. Default: {DESIGNS}, or where one number is searched for one "
    f"quantity {EVENLY} at first.",
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
    over: tuple[str, ...], not_counted: str | None, designs: int | None, generations: int,
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
    import warnings

    if output is not None:
        check_archive_output(output, overwrite, Path(scene))
    from sweeps.base.dimensions import FOUND
    from sweeps.decide.optimise.optimise import optimise as search
    from sweeps.view.texts.optimised import optimised_text

    announce_compiling(quiet)
    with warnings.catch_warnings():
        # The archive holds the warnings, and they are printed below
        warnings.simplefilter("ignore")
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
    from sweeps.base.netcdf.netcdf_files import check_file

    level = number_of(confidence, "--confidence")
    check_file(archive)
    if output is not None:
        check_archive_output(output, overwrite)
    with opened(archive) as dataset:
        from sweeps.decide.explore.sensitivities import sensitivities as indices_of
        from sweeps.view.texts.sensitivities import sensitivities_text

        indices = indices_of(
            dataset, names_of(quantities), confidence=level, resamples=resamples, seed=seed,
            progress=not quiet and sys.stderr.isatty(),
        )  # fmt: skip
    write_archive(indices, output, overwrite)
    if not quiet:
        say(sensitivities_text(indices))


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
        check_archive_output(output, overwrite, Path(what))
    announce_compiling(quiet)
    from sweeps.decide.explore.firing_orders import firing_orders as ranked
    from sweeps.view.texts.firing_orders import orders_text

    with _warnings_told_later():
        archive = ranked(
            what, arrangement=arrangement, settings=given, crank=crank, by=by, sample=sample,
            seed=seed, threads=threads, progress=not quiet and sys.stderr.isatty(),
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
        check_archive_output(output, overwrite, Path(what))
    announce_compiling(quiet)
    from sweeps.decide.explore.firing_patterns import firing_patterns as ranked
    from sweeps.view.texts.firing_orders import patterns_text

    with _warnings_told_later():
        archive = ranked(
            what, density, longest=longest, by=by, order=order, valves_shut=valves_shut,
            keep_torque=not any_torque, settings=given, threads=threads,
            progress=not quiet and sys.stderr.isatty(),
        )  # fmt: skip
    write_archive(archive, output, overwrite)
    if not quiet:
        warn(archive.attrs["warnings"].splitlines())
        say(patterns_text(archive, limit, units, terminal_width()))


@contextmanager
def _warnings_told_later() -> Iterator[None]:
    """Hold plausibility warnings back while an archive is computed: it holds one line of each."""
    import warnings

    from engine_dyn import ImplausibleWarning

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ImplausibleWarning)
        yield


def _settings(texts: tuple[str, ...]) -> dict[str, float]:
    return dict(_setting(part) for text in texts for part in text.split(","))


def _setting(text: str) -> tuple[str, float]:
    """Key and number of a setting such as "speed=1500"."""
    from engine_dyn.parameters import PARAMETERS

    key, _, value = (part.strip() for part in text.partition("="))
    try:
        if key in PARAMETERS and re.match(PATTERN, value):
            return key, number_with_unit(value, f"--set {key}", PARAMETERS[key].unit)
        return key, plain_number(value)
    except SceneError:
        raise
    except ValueError:
        raise SceneError(
            f"--set {one_line(text, 60)}: must be KEY=NUMBER, such as speed=1500"
        ) from None
