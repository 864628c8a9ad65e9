"""Commands that look into archives: info, show, compare, export, plot."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click

from sweeps.base.dimensions import REDUCTION
from sweeps.base.errors import SceneError, as_name, counted, size_text
from sweeps.cli.arguments import (
    PATH,
    archive_argument,
    axis_slices,
    complete_engine_or_scene,
    difference,
    file_size,
    format_option,
    names_of,
    output_option,
    overwrite_option,
    quantities_option,
    quiet_option,
    select_option,
    units_option,
    untrusted_option,
)
from sweeps.cli.exits import FAILURE, end, guarded, say, tell, terminal_width, warn
from sweeps.cli.files import (
    check_folder,
    check_output,
    check_slices,
    opened,
    opened_to_print,
    writing,
)


@click.command()
@click.argument("what", shell_complete=complete_engine_or_scene)
@click.option(
    "--provenance",
    is_flag=True,
    help="For an archive, also show assumptions, parameters, versions and hashes of files.",
)
@units_option(
    "For an archive: units of quantities, such as brake_power=hp; 'archive' keeps those of the "
    "archive. Default: kW, rpm, kN, kJ, mm and l."
)
@untrusted_option
@guarded
def info(what: str, provenance: bool, units: str | None) -> None:
    """Describe WHAT: an archive (netCDF), an engine or scene (name or TOML file), a shaft (name).

    For the folder OUTPUT.partial of an interrupted run, info shows how much of it is finished.
    """
    toml = what.endswith(".toml")
    if toml or not os.path.exists(what):
        from sweeps.scene.engine.engine_files import catalogue, load_engine
        from sweeps.scene.reading import built_in_scenes, is_scene, read_scene

        if is_scene(Path(what)) if toml else what in built_in_scenes():
            from sweeps.view.texts.scenes import scene_text

            scene = read_scene(what)
            say(scene_text(scene, as_name(what)))
            if any(engine.shaft is not None for engine in scene.engines):
                from sweeps.scene.plan.plan import make_plan
                from sweeps.scene.plan.plausibility import plausibility_warnings

                warn(plausibility_warnings(make_plan(scene)))
            return
        from sweeps.scene.features.shaft import built_in_shafts
        from sweeps.view.texts.scenes import engine_text, shaft_text

        # An engine and a shaft may have one name
        texts = [engine_text(load_engine(what))] if toml or what in catalogue() else []
        texts += [shaft_text(what)] if what in built_in_shafts() else []
        if texts:
            say("\n\n".join(texts))
            return
    from sweeps.view.texts.archives import interrupted_run, interrupted_text

    folder = interrupted_run(Path(what))
    if folder is not None:
        say(interrupted_text(folder))
        return
    from sweeps.base.netcdf.netcdf_child import start

    start()
    from sweeps.view.texts.archives import archive_text

    with opened_to_print(Path(what)) as dataset:
        described = archive_text(dataset, what, provenance=provenance, units=units)
    say(described)


@click.command()
@archive_argument
@select_option("Show only this value of an axis, or the nearest one in the archive.")
@quantities_option("Quantities to show, such as delta,imep.")
@click.option(
    "--sort",
    metavar="NAME",
    help="Sort by this column, smallest first; -NAME: largest first.",
)
@click.option(
    "--limit", type=int, default=20, show_default=True, help="Largest number of designs to show."
)
@click.option(
    "--relative-to",
    "relative",
    metavar="AXIS=VALUE",
    help="Show changes in percent relative to this design. 'nominal' is the design of that name, "
    "or the one with the engine's own values; 'first' is the first design.",
)
@units_option(
    "Units of columns, such as brake_power=hp,omega_mean=rad/s; 'archive' keeps those of the "
    "archive. Default: kW, rpm, kN, kJ, mm and l."
)
@untrusted_option
@guarded
def show(
    archive: Path, slices: tuple[str, ...], quantities: str | None, sort: str | None, limit: int,
    relative: str | None, units: str | None,
) -> None:  # fmt: skip
    """Show numbers of ARCHIVE as a table."""
    from sweeps.base.netcdf.netcdf_child import start
    from sweeps.base.netcdf.netcdf_files import check_file

    select = axis_slices(slices)
    base: Mapping[str, float | str] | str | None = None
    if relative is not None:
        words: dict[str, Mapping[str, float | str] | str] = {"first": {}, "nominal": "nominal"}
        base = words.get(relative)
        if base is None:
            base = axis_slices([relative], "--relative-to")
    names = names_of(quantities)
    if not archive.exists():
        from sweeps.scene.engine.engine_files import catalogue
        from sweeps.scene.features.shaft import built_in_shafts
        from sweeps.scene.reading import built_in_scenes

        if str(archive) in {*catalogue(), *built_in_scenes(), *built_in_shafts()}:
            raise SceneError(f"{archive}: no archive; `engine-dyn info {archive}` describes it")
    check_file(archive)
    start()
    from sweeps.decide.explore.attributes import of_designs
    from sweeps.decide.explore.opening import nearest
    from sweeps.decide.explore.rows import rows
    from sweeps.view.texts.readable_units import unit_choices
    from sweeps.view.texts.reductions import reduction_lines
    from sweeps.view.texts.sensitivities import has_indices, sensitivities_text
    from sweeps.view.texts.tables import rows_text

    with opened_to_print(archive) as dataset:
        check_slices(dataset, select, {} if base is None or isinstance(base, str) else base)
        part = nearest(dataset, **select)
        plain = names is None and sort is None and base is None
        if has_indices(part) and plain:
            text = sensitivities_text(part)
        elif REDUCTION in part.attrs and plain and not of_designs(part):
            known = {str(n): str(v.attrs.get("units", "1")) for n, v in part.variables.items()}
            text = "\n".join(reduction_lines(part, unit_choices(units, known))[1:])
        else:
            table = rows(dataset, select=select, quantities=names, sort=sort, limit=limit,
                         relative_to=base)  # fmt: skip
            text = rows_text(table, units, terminal_width())
    say(text)


@click.command()
@click.argument("first", type=PATH)
@click.argument("second", type=PATH)
@click.option(
    "--tolerance",
    metavar="NUMBER",
    help="End with status 1 if a relative difference is larger than NUMBER, or if an axis or a "
    "quantity differs.",
)
@click.option(
    "--figures",
    "folder",
    type=click.Path(path_type=Path, file_okay=False),
    help="Folder for figures of both archives in one chart and of their difference in percent.",
)
@format_option("figures")
@untrusted_option
@guarded
def compare(
    first: Path, second: Path, tolerance: str | None, folder: Path | None, file_format: str
) -> None:
    """Compare two archives: axes, quantities, and the largest differences and where they are.

    If axes differ, only values that are in both archives are compared. Relative differences refer
    to the larger of the two magnitudes; in the figures they refer to the first archive.
    """
    limit = None if tolerance is None else difference(tolerance)
    if folder is not None:
        check_folder(folder)
    paths: list[Path] = []
    with opened(first) as one, opened(second) as two:
        from sweeps.decide.explore.compare import compare as compare_archives
        from sweeps.view.texts.comparison import comparison_text

        comparison = compare_archives(one, two, (str(first), str(second)))
        described = comparison_text(comparison)
        if folder is not None:
            from sweeps.view.texts.comparison import draw_comparison

            with writing(folder):
                paths = draw_comparison(one, two, folder, file_format, (first, second))
    say(described)
    for path in paths:
        tell(path)
    if folder is not None and not paths:
        tell("nothing to draw: both archives have the same values", err=True)
    if limit is not None and not comparison.within(limit):
        end(f"{first} and {second} differ by more than {limit:g} (relative)", FAILURE)


@click.command()
@archive_argument
@output_option(
    "The table to write, FILE.csv, FILE.parquet or FILE.xlsx, or the curves: FILE.uff or FILE.fmu."
)
@select_option(
    "Write only this value of an axis, or the nearest one in the archive, in the unit of the "
    "archive."
)
@quantities_option(
    "Quantities to write, such as delta,imep. Default: all with one number per design; of curves, "
    "all over the crank angle."
)
@click.option(
    "--orders",
    metavar="NAME",
    help="In place of quantities: the orders of NAME, such as torque, with amplitude, phase, real "
    "and imaginary part. The archive must have NAME_order, NAME_phase and order_frequency.",
)
@click.option(
    "--head-units", is_flag=True, help="Write units into the column headings of a CSV file."
)
@units_option("Units of columns, such as brake_power=kW,speed=rpm. Default: those of the archive.")
@click.option(
    "--digits",
    metavar="NUMBER",
    help="Significant digits of results in a CSV or Excel file, or 'all'. Default: those that the "
    "tolerance of the solution carries, 10 at 1e-6. Values of axes are always whole.",
)
@overwrite_option("Replace the table if it exists.")
@quiet_option
@untrusted_option
@guarded
def export(
    archive: Path, output: Path, slices: tuple[str, ...], quantities: str | None,
    orders: str | None, head_units: bool, units: str | None, digits: str | None, overwrite: bool,
    quiet: bool,
) -> None:  # fmt: skip
    """Write ARCHIVE as a table (CSV, Parquet or Excel) with one row for each design.

    If the quantities include a curve, such as omega over crank_angle, there is one row for each
    point of the curve.

    Other programs read curves as a universal file (UFF, data sets 58) or, of one design, as an FMU.
    """
    from sweeps.base.netcdf.netcdf_files import check_file

    check_file(archive)
    from sweeps.decide.explore.export import check_format
    from sweeps.decide.explore.export import export as write

    check_format(output)
    check_output(output, overwrite, archive)
    select = axis_slices(slices)
    names = names_of(quantities)
    with opened(archive) as dataset, writing(output):
        from sweeps.decide.explore.opening import nearest
        from sweeps.view.texts.readable_dataset import in_units

        check_slices(dataset, select)
        asked = in_units(nearest(dataset, **select), units)
        done = write(
            asked, output, quantities=names, orders=orders, overwrite=overwrite,
            head_units=head_units, digits=digits,
        )  # fmt: skip
    if quiet:
        return
    if done.left_out:
        lack = "values" if output.suffix.lower() == ".uff" else "one number per design"
        left_out = ", ".join(done.left_out)
        tell(f"not in the file, because they do not have {lack}: {left_out}", err=True)
    size = size_text(output.stat().st_size)
    tell(f"{output}: {counted(done.rows, 'row')}, {counted(len(done.columns), 'column')}, {size}")
    if output.suffix.lower() == ".csv" and done.units and not head_units:
        units = ", ".join(f"{name} {unit}" for name, unit in done.units.items())
        tell(f"units: {units} (--head-units writes them into the file)")


@click.command()
@archive_argument
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path, file_okay=False),
    help="Folder for the figures. Default: a folder beside the archive, with its name.",
)
@format_option("files")
@select_option(
    "Value to use for an axis that the figure is not drawn over, or the nearest one in the archive."
)
@click.option(
    "--only",
    multiple=True,
    metavar="KIND",
    help="Draw only this kind of figure. Several separated by commas, or given several times.",
)
@click.option(
    "--list",
    "listed",
    is_flag=True,
    help="List the kinds of figure available for ARCHIVE; draw nothing.",
)
@click.option(
    "--target",
    "targets",
    multiple=True,
    metavar="QUANTITY=VALUE",
    help="Draw a line at this value in each figure of the quantity, such as delta=1/200.",
)
@units_option(
    "Units of quantities, such as brake_power=hp,omega=rad/s; 'archive' keeps those of the "
    "archive. Default: kW, rpm, kN, kJ, mm and l."
)
@click.option(
    "--style",
    metavar="FILE",
    help="Matplotlib style file, or the name of a matplotlib style.",
)
@click.option(
    "--size", metavar="WIDTHxHEIGHT", help="Size of each figure in millimetres, such as 160x100."
)
@click.option(
    "--angle",
    metavar="FIRST..LAST",
    help="Crank angles of one cycle, such as 0..720. Default: those of the archive.",
)
@click.option(
    "--zero",
    default="firing-tdc",
    show_default=True,
    metavar="PLACE",
    help="Where the crank angle is 0: firing-tdc, gas-exchange-tdc, bdc or expansion-bdc.",
)
@click.option(
    "--at",
    metavar="DEGREES",
    help="Crank angle at which the crank train is drawn. Default: that of the largest tangential "
    "force.",
)
@untrusted_option
@guarded
def plot(
    archive: Path, output: Path | None, file_format: str, slices: tuple[str, ...], listed: bool,
    units: str | None, **given: Any,
) -> None:  # fmt: skip
    """Draw figures of ARCHIVE, a netCDF file that `run` wrote."""
    select = axis_slices(slices)
    from sweeps.base.netcdf.netcdf_files import check_file

    check_file(archive)
    folder = archive.with_suffix("") if output is None else output
    if not listed:
        check_folder(folder)
    from sweeps.view.figures import draw, options_of

    options = options_of(select=select, target=given.pop("targets"), **given)
    with opened(archive) as dataset:
        from sweeps.view.figures.drawing import kinds_text
        from sweeps.view.texts.readable_dataset import readable_dataset

        readable = readable_dataset(dataset, units)
        # The option --zero shifts the crank angle, so the figures select its values themselves.
        check_slices(readable, {k: v for k, v in select.items() if k != "crank_angle"})
        if listed:
            say(kinds_text(readable, options))
            return
        with writing(folder):
            paths = draw(readable, folder, file_format, options=options)
    for path in paths:
        tell(path)
    if not paths:
        tell("nothing to draw: no quantity varies", err=True)


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
@click.option(
    "--target",
    "targets",
    multiple=True,
    metavar="CONDITION",
    help="Condition such as 'delta <= 1/250', as in `engine-dyn best`: the report says which "
    "designs meet it at every speed, load and misfire, and draws its limit. May be given several "
    "times.",
)
@click.option(
    "--not-counted",
    metavar="OUTCOMES",
    help="With --target: leave out points with these outcomes, such as no_steady_state (idle).",
)
@click.option(
    "--torsiogram",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="A file of `engine-dyn measured` of a disc of the same shaft: measured beside computed.",
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
    archive: Path, output: Path, limit: str, targets: tuple[str, ...], not_counted: str | None,
    torsiogram: Path | None, units: str | None, overwrite: bool, quiet: bool,
) -> None:  # fmt: skip
    """Write a report on ARCHIVE as one self-contained HTML file.

    It begins with the verdict: what meets the targets, and the barred speeds of a shaft that has
    limits. It has tables, figures that can be zoomed, and an explorer with a slider for every axis.
    It opens in any browser without a network connection.
    """
    from sweeps.base.netcdf.netcdf_files import check_file

    size = file_size(limit)
    if output.suffix.lower() not in (".html", ".htm"):
        raise SceneError(f"{output}: unknown extension; must be .html")
    check_file(archive)
    inputs = [archive] if torsiogram is None else [torsiogram, archive]
    check_output(output, overwrite, *inputs)
    from contextlib import ExitStack

    from sweeps.base.files.libraries import library

    library("bokeh", "bokeh", "report", extra="report")  # A missing one is said at once
    from sweeps.view.report.page import report as write

    with ExitStack() as files, writing(output):
        *more, dataset = [files.enter_context(opened(one)) for one in inputs]
        write(
            dataset, output, limit=size, units=units, target=targets, overwrite=overwrite,
            not_counted=names_of(not_counted) or (), torsiogram=more[0] if more else None,
        )  # fmt: skip
    if not quiet:
        tell(f"{output}: {size_text(output.stat().st_size)}")
