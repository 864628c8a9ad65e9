"""Commands that compute or put together archives: run, extend, merge, rerun."""

from __future__ import annotations

import os
import re
import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sweeps.base.dimensions import OUTCOMES, STATUS
from sweeps.base.errors import SceneError, counted, size_text
from sweeps.cli.arguments import (
    PATH,
    archive_argument,
    complete_scene,
    compression_option,
    memory_size,
    new_points,
    output_option,
    overwrite_option,
    quiet_option,
    resume_option,
    shard_number,
    threads_option,
    untrusted_option,
)
from sweeps.cli.exits import (
    DESIGNS_FAILED,
    announce_compiling,
    end,
    guarded,
    say,
    tell,
    terminal_width,
    warn,
)
from sweeps.cli.files import check_archive_output, check_output, files_of, writing

if TYPE_CHECKING:
    from sweeps.running.compute.options import Finished
    from sweeps.scene.model import Scene
    from sweeps.scene.plan.plan import Plan

LARGEST_TABLE = 200e6
"""Bytes of the variables of an archive up to which published values are printed."""


@click.command()
@click.argument("scene", shell_complete=complete_scene)
@output_option()
@overwrite_option()
@resume_option
@click.option(
    "--memory",
    metavar="SIZE",
    help="Memory limit for arrays, such as 500MB or 2GB (decimal units, 100MB or more).",
)
@click.option(
    "--compression",
    "level",
    type=click.IntRange(0, 9),
    default=0,
    help="Compress the archive, from 1 (fastest) to 9 (smallest). Default: 0, no compression.",
)
@click.option("--float32", "single", is_flag=True, help="Store results with 32 bits instead of 64.")
@threads_option
@click.option(
    "--device",
    type=click.Choice(["cpu", "cuda"]),
    default="cpu",
    help="What solves the designs: the processor (default), or an NVIDIA card.",
)
@click.option(
    "--shard",
    metavar="I/N",
    help="Compute only the I-th of N parts. `engine-dyn merge` joins the parts.",
)
@click.option(
    "--scheduler",
    metavar="ADDRESS",
    help="Compute on the workers of a dask scheduler (tcp://host:8786) or in N processes "
    "(local:N).",
)
@click.option(
    "--uncertainty",
    is_flag=True,
    help="Also compute uncertainty bands of all results from the ranges that the engine file "
    "gives for uncertain values.",
)
@click.option(
    "--full-paths",
    is_flag=True,
    help="Store full paths of files and of this command line in the archive. Without this option, "
    "paths are relative to the folder of the scene.",
)
@quiet_option
@untrusted_option
@guarded
def run(
    scene: str, output: Path, overwrite: bool, resume: bool, memory: str | None, level: int,
    single: bool, threads: int | None, device: str, shard: str | None, scheduler: str | None,
    uncertainty: bool, full_paths: bool, quiet: bool,
) -> None:  # fmt: skip  # one parameter for each option
    """Run SCENE (a TOML file, a built-in scene, or - for standard input); write a netCDF archive.

    Designs are computed and written in blocks. An interrupted run leaves its finished blocks in
    the folder OUTPUT.partial; the same command with --resume completes it. Only one run can write
    to an output at a time; locks left by killed runs are ignored.
    """
    allowed = None if memory is None else memory_size(memory)
    part = None if shard is None else shard_number(shard)
    if scheduler is not None:
        from sweeps.running.compute.cluster import check_address

        check_address(scheduler)
        if threads is not None:
            raise SceneError(
                "--threads: not allowed with --scheduler, whose workers have one thread each"
            )
    # This check comes before the imports, which take seconds
    check_archive_output(output, overwrite or resume, Path(scene))
    from sweeps.base.arguments import usable_device
    from sweeps.scene.reading import read_scene, with_uncertainty

    read = with_uncertainty(scene) if uncertainty else read_scene(scene)
    check_output(output, overwrite or resume, *files_of(read))

    from sweeps.running.compute import into_archive
    from sweeps.running.compute.options import Options
    from sweeps.scene.plan.plan import make_plan
    from sweeps.scene.plan.plausibility import plausibility_warnings
    from sweeps.scene.plan.shards import shard as shard_of

    announce_compiling(quiet)
    plan = make_plan(read)
    if part is not None:
        plan = shard_of(plan, *part)
    again = ["engine-dyn", "run", scene, "-o", str(output), "--resume"]
    again += [] if memory is None else ["--memory", memory]
    again += ["--compression", str(level)] if level else []
    again += ["--float32"] if single else []
    again += [] if device == "cpu" else ["--device", device]
    again += [] if shard is None else ["--shard", shard]
    again += [] if scheduler is None else ["--scheduler", scheduler]
    again += ["--uncertainty"] if uncertainty else []
    again += ["--full-paths"] if full_paths else []
    again += ["--overwrite"] if overwrite and output.exists() else []
    options = Options(
        resume=resume, overwrite=overwrite, memory=allowed, threads=threads,
        device=usable_device(device), progress=_shows_progress(quiet), level=level, single=single,
        command=_command_line(full_paths), full_paths=full_paths,
        resume_command=shlex.join(again),
    )  # fmt: skip

    def progress(line: str) -> None:
        if not quiet:
            tell(line, err=True)

    # Warnings come before the run, which may take hours; only those on results come afterwards.
    before = () if quiet else plausibility_warnings(plan)
    warn(before)
    if read.measured is not None:
        progress(f"[measured] is not compared here: engine-dyn measured {scene} -o OUT.nc")
    with writing(output):
        done = into_archive.run(plan, output, options, scheduler or "", progress)
    if not quiet:
        warn(line for line in done.warnings if line not in before)
        _print_published(plan, output)
        _print_outcomes(read, plan, done)
        _print_numbers(plan, output)
        _print_load(plan)
        tell(f"{output} ({size_text(output.stat().st_size)})")
    _end_if_designs_failed(read, done, output)


@click.command()
@archive_argument
@click.option("--axis", metavar="AXIS=VALUES", help="New points, such as speed=1600,1700.")
@click.option(
    "--number", type=int, help="New total number of points of the scene's [sample], such as 4096."
)
@overwrite_option("Discard an extension that was interrupted.")
@compression_option
@threads_option
@quiet_option
@untrusted_option
@guarded
def extend(
    archive: Path, axis: str | None, number: int | None, overwrite: bool, level: int | None,
    threads: int | None, quiet: bool,
) -> None:  # fmt: skip
    """Add points to an axis or to the sample of ARCHIVE and compute only these.

    The archive is replaced when the new one is complete; its earlier results do not change.
    After an interruption, the same command continues after the last finished block.
    """
    if (axis is None) == (number is None):
        raise SceneError("either --axis AXIS=VALUES or --number POINTS is needed")
    name, values = new_points(axis) if axis is not None else ("", [])
    _check_archive(archive)
    from sweeps.base.dimensions import DESIGN
    from sweeps.running.compute.options import Options
    from sweeps.running.join.extend import extend as add_points
    from sweeps.running.join.extend import extend_sample

    announce_compiling(quiet)
    more = ["--axis", axis] if axis is not None else ["--number", str(number)]
    again = ["engine-dyn", "extend", str(archive), *more]
    again += [] if level is None else ["--compression", str(level)]
    options = Options(
        threads=threads, level=level, command=_command_line(), overwrite=overwrite,
        progress=_shows_progress(quiet), resume_command=shlex.join(again),
    )  # fmt: skip
    with writing(archive):
        if number is None:
            plan = add_points(archive, name, values, options)
        else:
            plan = extend_sample(archive, number, options)
    if not quiet:
        _warn_of(archive)
        tell(
            f"{archive}: {counted(plan.sizes[name or DESIGN], 'point')} of {name or DESIGN}, "
            f"{counted(plan.designs, 'design')}, {size_text(archive.stat().st_size)}"
        )


@click.command()
@click.argument("archives", nargs=-1, required=True, type=PATH)
@output_option()
@overwrite_option()
@compression_option
@quiet_option
@untrusted_option
@guarded
def merge(
    archives: tuple[Path, ...], output: Path, overwrite: bool, level: int | None, quiet: bool
) -> None:
    """Join ARCHIVES of one scene: all its shards, or archives that differ in one axis.

    Results that are in several archives must be the same in all of them.
    """
    for path in archives:
        _check_archive(path)
    check_archive_output(output, overwrite)
    from sweeps.running.compute.options import Options
    from sweeps.running.join.merge import merge as join

    options = Options(overwrite=overwrite, level=level, command=_command_line())
    with writing(output):
        plan = join(archives, output, options)
    if not quiet:
        _warn_of(output)
        tell(_designs_line(plan, output))


@click.command()
@archive_argument
@output_option()
@overwrite_option()
@resume_option
@compression_option
@threads_option
@quiet_option
@untrusted_option
@click.option(
    "--indicator",
    type=PATH,
    help="File with the confidential diagram, which is not stored in the archive.",
)
@guarded
def rerun(
    archive: Path, output: Path, overwrite: bool, resume: bool, level: int | None,
    threads: int | None, quiet: bool, indicator: Path | None,
) -> None:  # fmt: skip
    """Compute ARCHIVE again from the scene and the files that are stored in it.

    If its pressure diagram is confidential, --indicator names the file; its hash is checked.
    """
    _check_archive(archive)
    check_archive_output(output, overwrite or resume, archive)
    from sweeps.running.compute.options import Options
    from sweeps.running.join.extend import rerun as run_again

    announce_compiling(quiet)
    again = ["engine-dyn", "rerun", str(archive), "-o", str(output), "--resume"]
    again += ["--indicator", str(indicator)] if indicator is not None else []
    options = Options(
        overwrite=overwrite, resume=resume, level=level, threads=threads, command=_command_line(),
        progress=_shows_progress(quiet), resume_command=shlex.join(again),
    )  # fmt: skip
    with writing(output):
        plan, differences = run_again(archive, output, options, indicator)
    if differences:
        tell(f"made in a different way from {archive}: {'; '.join(differences)}", err=True)
    if not quiet:
        _warn_of(output)
        tell(_designs_line(plan, output))


# --- before and after a run ---------------------------------------------------------------------


def _check_archive(path: Path) -> None:
    from sweeps.base.netcdf.netcdf_files import check_file

    check_file(path)


def _warn_of(output: Path) -> None:
    """Print the plausibility warnings that a finished archive holds."""
    from sweeps.running.archive.warnings import lines_of

    warn(lines_of(output))


def _shows_progress(quiet: bool) -> bool:
    return not quiet and sys.stderr.isatty()


def _command_line(full_paths: bool = False) -> str:
    """Return the command line as an archive keeps it: absolute paths are reduced to their names."""
    arguments = sys.argv[1:] if full_paths else map(_without_folders, sys.argv[1:])
    words = shlex.join([Path(sys.argv[0]).name, *arguments])
    # A file name need not be valid UTF-8, but an attribute of an archive must be.
    return words.encode("utf-8", "replace").decode("utf-8")


def _without_folders(argument: str) -> str:
    """An argument; its path, if absolute or leading upwards, is reduced to its name."""
    parts = re.match(r"(-\w|--[\w-]+=)?(.*)", argument, re.DOTALL)
    assert parts is not None  # The regular expression matches every text
    path = Path(parts[2])
    leads_out = path.is_absolute() or os.pardir in path.parts
    return f"{parts[1] or ''}{path.name}" if leads_out else argument


def _print_published(plan: Plan, output: Path) -> None:
    """Print published next to computed values, where the scene has some."""
    if plan.scene.reference is None:
        return
    if plan.output_bytes > LARGEST_TABLE:
        tell(f"published values are in the archive; {plan.designs} designs are too many to print")
        return
    from sweeps.running.archive.stored_dataset import stored_dataset
    from sweeps.view.texts.published import text

    with stored_dataset(output, own=True) as dataset:
        published = text(dataset)
    if published:
        say(published + "\n")


def _print_numbers(plan: Plan, output: Path) -> None:
    """Print the results where these are few numbers, otherwise how to look at them."""
    from sweeps.running.archive.stored_dataset import stored_dataset

    if plan.scene.gives("recorded_cycle"):
        from sweeps.view.texts.archives import recorded_cycle_lines

        with stored_dataset(output, own=True) as dataset:
            for line in recorded_cycle_lines(dataset):
                tell(f"over the recorded cycles: {line}")
    if plan.scene.reduce is not None:
        tell(f"results: engine-dyn info {shlex.quote(str(output))}")
        return
    shown = 10  # Designs up to which `run` prints their numbers
    if plan.designs > shown:
        tell(f"values: engine-dyn show {shlex.quote(str(output))}")
        return
    from sweeps.decide.explore.columns import has_single_numbers
    from sweeps.decide.explore.rows import rows
    from sweeps.view.texts.tables import rows_text

    with stored_dataset(output, own=True) as dataset:
        if has_single_numbers(dataset):
            say("\n" + rows_text(rows(dataset, limit=shown), width=terminal_width()) + "\n")


def _print_load(plan: Plan) -> None:
    """Print the torque that the loads of a scene have, where the run needed torques."""
    if plan.scene.gives("load") and "torque_mean" in plan.computed:
        from sweeps.view.texts.loads import load_line

        line = load_line(plan.scene)
        if line:
            tell(line)


def _print_outcomes(scene: Scene, plan: Plan, done: Finished) -> None:
    """Print the number of designs, their outcomes, and how long they took."""
    tell(f"{scene.title}: {plan.designs_text}")
    unused = (*plan.unused, *plan.unused_settings)
    if unused:
        tell(f"no requested quantity depends on:  {', '.join(unused)}")
    if plan.modes:
        tell(plan.modes)
    for line in filter(None, (scene.other_cylinders, scene.left_out)):
        tell(line)
    if done.outcomes:
        from sweeps.view.texts.archives import explained, of_all_designs

        counts = of_all_designs(done.outcomes, plan.designs)
        tell("outcomes: " + ", ".join(f"{one} {n}{explained(one)}" for one, n in counts.items()))
    for name in OUTCOMES:
        # Those of a shaft, or of a periodic speed beside, where they say what is not said above
        told = done.outcomes_of(name)
        if name != STATUS and told and (not done.outcomes or told.keys() - {"converged"}):
            tell(f"{name}: " + ", ".join(f"{one} {n}" for one, n in told.items()))
    if scene.gives("wanted_delta") and "stalled" in done.outcomes:
        tell(
            "stalled: the wanted delta is so large that the engine would stall first; no inertia "
            "gives it"
        )
    if done.already:
        tell("already complete; nothing to do")
        return
    compiling = min(done.compiling, done.computing)
    compiled = f"compiling {compiling:.1f} s, " if compiling >= 0.05 else ""
    times = f"computing {done.computing - compiling:.2f} s, writing {done.writing:.2f} s"
    tell(f"{compiled}{times}{_resumed(done)}")
    for line in done.found:
        tell(line)


def _resumed(done: Finished) -> str:
    """Number of blocks that an interrupted run had finished, in brackets; empty without any."""
    parts = []
    if done.before:
        parts.append(f"{done.before} of {done.blocks} blocks had been computed before")
    if done.damaged:
        verb = "was" if done.damaged == 1 else "were"
        parts.append(f"{counted(done.damaged, 'block')} {verb} damaged and computed again")
    return f" ({'; '.join(parts)})" if parts else ""


def _end_if_designs_failed(scene: Scene, done: Finished, output: Path) -> None:
    failed = [
        f"{'' if name == STATUS else f'{name} '}{word} {count}"
        for name in OUTCOMES
        for word, count in done.outcomes_of(name).items()
        if word in scene.fail_on
    ]
    if failed:
        end(
            f"designs failed: {', '.join(failed)} ([output] fail_on); {output} is written",
            DESIGNS_FAILED,
        )


def _designs_line(plan: Plan, output: Path) -> str:
    return f"{output}: {plan.designs_text}, {size_text(output.stat().st_size)}"
