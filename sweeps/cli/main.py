"""The command line: thin commands around the functions of this package.

Exit status 0 on success, 2 on bad input with one line on stderr, 1 on other failures, 3 when
designs failed and the scene asked for that to be an error. NumPy, Numba, xarray and matplotlib are
imported by the commands that need them, so that help is quick.
"""

from __future__ import annotations

import errno
import functools
import math
import os
import re
import shlex
import sys
import tempfile
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, TypeVar

import click

from sweeps.errors import SceneError, counted, one_line, plain_number, printable, size_text

if TYPE_CHECKING:
    import xarray as xr

    from sweeps.planning.plan import Plan
    from sweeps.running.into_archive import Finished, Options
    from sweeps.scene.model import Scene

__all__ = ["main"]

Result = TypeVar("Result")

BAD_INPUT, FAILURE, DESIGNS_FAILED = 2, 1, 3

_COUNTED = 1_000_000
"""Outcomes that are counted at a time."""

SMALLEST_MEMORY = 100e6

LARGEST_TABLE = 200e6
"""Bytes of the variables of an archive up to which published values are printed."""

_CANNOT_WRITE = (
    errno.EACCES, errno.EPERM, errno.EROFS, errno.ENOTDIR, errno.EISDIR, errno.ENAMETOOLONG,
    errno.ELOOP, errno.EINVAL,
)  # fmt: skip

LONGEST = 1000
"""Characters of one line that `info` prints of an attribute."""


def _guarded(function: Callable[..., Any]) -> Callable[..., Any]:
    """Turn exceptions into one line on stderr and an exit status."""

    @click.option("--debug", is_flag=True, help="Show the traceback of a failure.")
    @functools.wraps(function)
    def command(*args: Any, debug: bool, **options: Any) -> None:
        try:
            function(*args, **options)
        except (click.ClickException, click.exceptions.Exit, click.Abort, BrokenPipeError):
            raise
        except KeyboardInterrupt:
            _end("interrupted; nothing written", FAILURE)
        except SceneError as error:
            if debug:
                traceback.print_exc()
            _end(one_line(error, 2000), BAD_INPUT)
        except MemoryError as error:
            if debug:
                traceback.print_exc()
            _end(f"out of memory ({one_line(error, 200)})".replace(" ()", ""), FAILURE)
        except Exception as error:
            if debug:
                traceback.print_exc()
            _end(
                f"failed: {type(error).__name__}: {one_line(error)} (--debug shows where)", FAILURE
            )

    return command


def _say(text: object, *, err: bool = False) -> None:
    """Print a text, part of which may come from files."""
    click.echo(printable(str(text)), err=err)


def _end(message: str, exit_status: int) -> NoReturn:
    _say(f"engine-dyn: {message}", err=True)
    sys.exit(exit_status)


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="engine-dyn", prog_name="engine-dyn")
def main() -> None:
    """Dynamics of reciprocating engines, swept over many designs.

    A scene (a TOML file) says which engine, which axes and which quantities; `engine-dyn new`
    writes one to start from.
    """


@main.command()
@click.argument("scene")
@click.option(
    "-o", "--output", required=True, type=click.Path(path_type=Path), help="The archive to write."
)
@click.option("--overwrite", is_flag=True, help="Replace the archive if it exists.")
@click.option("--resume", is_flag=True, help="Complete an interrupted run; start if there is none.")
@click.option(
    "--memory",
    metavar="SIZE",
    help="What arrays may take, such as 500MB or 2GB (decimal; at least 100MB).",
)
@click.option(
    "--compression",
    "level",
    type=click.IntRange(0, 9),
    default=0,
    help="Compress the archive: 1 (quick) to 9.",
)
@click.option("--float32", "single", is_flag=True, help="Keep results in 32 bits instead of 64.")
@click.option("--threads", type=click.IntRange(min=1), help="Threads; all cores if not given.")
@click.option("--shard", metavar="I/N", help="Compute only the Ith of N parts; see merge.")
@click.option(
    "--scheduler",
    metavar="ADDRESS",
    help="Let the workers of a dask scheduler compute (tcp://host:8786), or N processes (local:N).",
)
@click.option("-q", "--quiet", is_flag=True, help="Print nothing but errors.")
@_guarded
def run(
    scene: str, output: Path, overwrite: bool, resume: bool, memory: str | None, level: int,
    single: bool, threads: int | None, shard: str | None, scheduler: str | None, quiet: bool,
) -> None:  # fmt: skip
    """Run SCENE (a TOML file or the name of a built-in scene) and write a netCDF archive.

    Blocks are written as they are computed. A run that is interrupted leaves them in the folder
    OUTPUT.partial; the same command with --resume completes it.
    """
    allowed = None if memory is None else _size(memory)
    piece = None if shard is None else _shard(shard)
    if scheduler is not None:
        from sweeps.running.cluster import check_address

        check_address(scheduler)
        if threads is not None:
            raise SceneError("--threads: not with --scheduler, whose workers have one thread each")
    from sweeps.scene.model import read_scene

    read = read_scene(scene)
    _check_output(output, overwrite or resume, *_files_of(read))

    from sweeps.planning.plan import make_plan
    from sweeps.running.into_archive import Options

    _tell_of_compiling(quiet)
    planned = make_plan(read)
    if piece is not None:
        from sweeps.planning.shards import shard as shard_of

        planned = shard_of(planned, *piece)
    again = ["engine-dyn", "run", scene, "-o", str(output), "--resume"]
    again += [] if memory is None else ["--memory", memory]
    again += ["--compression", str(level)] if level else []
    again += ["--float32"] if single else []
    again += [] if shard is None else ["--shard", shard]
    again += [] if scheduler is None else ["--scheduler", scheduler]
    again += ["--overwrite"] if overwrite and output.exists() else []
    options = Options(
        resume=resume,
        overwrite=overwrite,
        memory=allowed,
        threads=threads,
        progress=not quiet and sys.stderr.isatty(),
        level=level,
        single=single,
        command=_command_line(),
        again=shlex.join(again),
        scheduler=scheduler or "",
        tell=(lambda _: None) if quiet else functools.partial(click.echo, err=True),
    )
    done = _streamed(lambda: _run(planned, output, options), output)
    counts = done.outcomes
    if not quiet:
        _print_published(planned, output)
        _say(f"{read.title}: {counted(planned.designs, 'design')}")
        if planned.unused:
            _say(f"nothing that is asked for depends on: {', '.join(planned.unused)}")
        if counts:
            click.echo("outcomes: " + ", ".join(f"{name} {n}" for name, n in counts.items()))
        if read.inertia_follows and "stalled" in counts:
            click.echo(
                "stalled: no inertia gives the wanted delta, the engine would have to be so light "
                "that it stops"
            )
        if done.already:
            click.echo("complete already; nothing to do")
        else:
            resumed = f" ({done.before} of {done.blocks} blocks were there)" if done.before else ""
            click.echo(f"computing {done.computing:.2f} s, writing {done.writing:.2f} s{resumed}")
        _say(f"{output} ({size_text(output.stat().st_size)})")
    failed = {name: n for name, n in counts.items() if name in read.fail_on}
    if failed:
        listed = ", ".join(f"{name} {n}" for name, n in failed.items())
        _end(f"designs failed: {listed} ([output] fail_on); {output} is written", DESIGNS_FAILED)


@main.command()
@click.argument("archive", type=click.Path(path_type=Path))
@click.option("--axis", required=True, metavar="AXIS=VALUES", help="Such as speed=1600,1700.")
@click.option("--overwrite", is_flag=True, help="Drop an extension that was interrupted.")
@click.option("--compression", "level", type=click.IntRange(0, 9), help="As it was, if not given.")
@click.option("--threads", type=click.IntRange(min=1), help="Threads; all cores if not given.")
@click.option("-q", "--quiet", is_flag=True, help="Print nothing but errors.")
@_guarded
def extend(
    archive: Path, axis: str, overwrite: bool, level: int | None, threads: int | None, quiet: bool
) -> None:
    """Add points to an axis of ARCHIVE, computing only these.

    The archive is replaced when the new one is whole; what it held stays as it is. After an
    interruption the same command goes on with what is finished.
    """
    name, values = _points(axis)
    _check_archive(archive)
    from sweeps.joining import merge as joining
    from sweeps.running.into_archive import Options

    _tell_of_compiling(quiet)
    again = ["engine-dyn", "extend", str(archive), "--axis", axis]
    again += [] if level is None else ["--compression", str(level)]
    options = Options(
        threads=threads, level=level, command=_command_line(), overwrite=overwrite,
        progress=not quiet and sys.stderr.isatty(), again=shlex.join(again),
    )  # fmt: skip
    plan = _streamed(lambda: joining.extend(archive, name, values, options), archive)
    if not quiet:
        _say(
            f"{archive}: {counted(plan.sizes[name], 'point')} of {name}, "
            f"{counted(plan.designs, 'design')}, {size_text(archive.stat().st_size)}"
        )


@main.command()
@click.argument("archives", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option(
    "-o", "--output", required=True, type=click.Path(path_type=Path), help="The archive to write."
)
@click.option("--overwrite", is_flag=True, help="Replace the archive if it exists.")
@click.option("--compression", "level", type=click.IntRange(0, 9), help="As it was, if not given.")
@click.option("-q", "--quiet", is_flag=True, help="Print nothing but errors.")
@_guarded
def merge(
    archives: tuple[Path, ...], output: Path, overwrite: bool, level: int | None, quiet: bool
) -> None:
    """Join ARCHIVES of one scene: all its shards, or archives that differ in one axis.

    What several of them hold must be the same in all.
    """
    for path in archives:
        _check_archive(path)
    _check_output(output, overwrite)
    from sweeps.joining import merge as joining
    from sweeps.running.into_archive import Options

    options = Options(overwrite=overwrite, level=level, command=_command_line())
    plan = _streamed(lambda: joining.merge(archives, output, options), output)
    if not quiet:
        size = size_text(output.stat().st_size)
        _say(f"{output}: {counted(plan.designs, 'design')}, {size}")


@main.command()
@click.argument("archive", type=click.Path(path_type=Path))
@click.option(
    "-o", "--output", required=True, type=click.Path(path_type=Path), help="The archive to write."
)
@click.option("--overwrite", is_flag=True, help="Replace the archive if it exists.")
@click.option("--resume", is_flag=True, help="Complete an interrupted run; start if there is none.")
@click.option("--compression", "level", type=click.IntRange(0, 9), help="As it was, if not given.")
@click.option("--threads", type=click.IntRange(min=1), help="Threads; all cores if not given.")
@click.option("-q", "--quiet", is_flag=True, help="Print nothing but errors.")
@_guarded
def rerun(
    archive: Path, output: Path, overwrite: bool, resume: bool, level: int | None,
    threads: int | None, quiet: bool,
) -> None:  # fmt: skip
    """Make ARCHIVE again, from what it holds and nothing else."""
    _check_archive(archive)
    _check_output(output, overwrite or resume, archive)
    from sweeps.joining.rerun import rerun as run_again
    from sweeps.running.into_archive import Options

    _tell_of_compiling(quiet)
    again = ["engine-dyn", "rerun", str(archive), "-o", str(output), "--resume"]
    options = Options(
        overwrite=overwrite, resume=resume, level=level, threads=threads,
        command=_command_line(), progress=not quiet and sys.stderr.isatty(),
        again=shlex.join(again),
    )  # fmt: skip
    plan, found = _streamed(lambda: run_again(archive, output, options), output)
    if found:
        _say(f"made otherwise than {archive}: {'; '.join(found)}", err=True)
    if not quiet:
        size = size_text(output.stat().st_size)
        _say(f"{output}: {counted(plan.designs, 'design')}, {size}")


@main.command()
@click.argument("first", type=click.Path(path_type=Path))
@click.argument("second", type=click.Path(path_type=Path))
@click.option(
    "--tolerance",
    metavar="NUMBER",
    help="End with status 1 where a relative difference is larger, or an axis or quantity differs.",
)
@_guarded
def compare(first: Path, second: Path, tolerance: str | None) -> None:
    """Compare two archives: axes, quantities, the largest differences and where they are.

    Where axes differ, the values that both have are compared. A relative difference is over the
    greater of the two magnitudes.
    """
    limit = None if tolerance is None else _tolerance(tolerance)
    with _opened(first) as one, _opened(second) as two:
        from sweeps.exploring import compare as comparing

        found = comparing.compare(one, two)
        told = comparing.text(found)
    _say(told)
    if limit is not None and not found.within(limit):
        _end(f"{first} and {second} differ by more than {limit:g}, relative", FAILURE)


@main.command()
@click.argument("archive", type=click.Path(path_type=Path))
@click.option(
    "-o",
    "--output",
    required=True,
    type=click.Path(path_type=Path),
    help="The table to write, FILE.csv or FILE.parquet.",
)
@click.option(
    "--quantities",
    metavar="NAMES",
    help="Such as delta,imep; all that have one number a design, if not given.",
)
@click.option("--overwrite", is_flag=True, help="Replace the table if it exists.")
@click.option("-q", "--quiet", is_flag=True, help="Print nothing but errors.")
@_guarded
def export(
    archive: Path, output: Path, quantities: str | None, overwrite: bool, quiet: bool
) -> None:
    """Write ARCHIVE as a table, CSV or Parquet, with a row for each design.

    With a curve among the quantities, such as omega over crank_angle, a row for each of its points.
    """
    _check_archive(archive)
    from sweeps.exploring.export import check_format
    from sweeps.exploring.export import export as write

    check_format(output)
    _check_output(output, overwrite, archive)
    names = None if quantities is None else [name.strip() for name in quantities.split(",")]
    with _opened(archive) as dataset:
        done = _streamed(
            lambda: write(dataset, output, quantities=names, overwrite=overwrite), output
        )
    if not quiet:
        if done.left_out:
            _say(f"left out, not one number a design: {', '.join(done.left_out)}", err=True)
        size = size_text(output.stat().st_size)
        _say(
            f"{output}: {counted(done.rows, 'row')}, {counted(len(done.columns), 'column')}, {size}"
        )


@main.command()
@click.argument("scene")
@_guarded
def plan(scene: str) -> None:
    """Show what SCENE would compute, what it skips, and its time and memory; computes nothing."""
    from sweeps.scene.model import read_scene

    read = read_scene(scene)

    from sweeps.planning.forecast import text
    from sweeps.planning.plan import make_plan

    _say(text(make_plan(read)))


@main.command()
@click.argument("archive", type=click.Path(path_type=Path))
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path, file_okay=False),
    help="Folder for the figures; a folder beside the archive, named after it, if not given.",
)
@click.option(
    "--format", "kind", type=click.Choice(["png", "svg", "pdf"]), default="png", show_default=True
)
@click.option(
    "--select",
    "slices",
    multiple=True,
    metavar="AXIS=VALUE",
    help="Where to cut an axis that a figure has no room for; may be repeated.",
)
@_guarded
def plot(archive: Path, output: Path | None, kind: str, slices: tuple[str, ...]) -> None:
    """Draw figures of ARCHIVE, a netCDF file that `run` wrote."""
    select = dict(_slice(text) for text in slices)
    _check_archive(archive)
    folder = archive.with_suffix("") if output is None else output
    try:
        if folder.exists() and not folder.is_dir():
            raise SceneError(f"{folder}: is a file; -o must name a folder for the figures")
    except (OSError, ValueError) as error:
        raise _not_written(folder, error) from None
    with _opened(archive) as dataset:
        from sweeps.figures.draw import draw

        paths = _streamed(lambda: draw(dataset, folder, kind, select=select), folder)
    for path in paths:
        _say(path)
    if not paths:
        click.echo("nothing to draw: no quantity varies", err=True)


@main.command()
@click.argument("what")
@_guarded
def info(what: str) -> None:
    """Tell what is in an archive (netCDF), or about an engine (its name or its TOML file).

    Of an interrupted run (the folder OUTPUT.partial), tell how far it has come.
    """
    from sweeps.reading.engine_files import catalogue, load_engine

    if what.endswith(".toml") or (what in catalogue() and not Path(what).exists()):
        _say(_engine_text(load_engine(what)))
        return
    folder = _interrupted(Path(what))
    if folder is not None:
        _say(_partial_text(folder))
        return
    with _opened(Path(what)) as dataset:
        told = _archive_text(dataset, what)
    _say(told)


@main.command(name="list")
@click.argument(
    "what", required=False, type=click.Choice(["quantities", "engines", "scenes", "keys"])
)
@_guarded
def list_(what: str | None) -> None:
    """List quantities, engines, built-in scenes, or keys of a scene; all of them if not told which.

    The first word of each line is the name.
    """
    lines: list[tuple[str, str]] = []
    for kind, make in _LISTS.items():
        if what in (None, kind):
            lines += make()
    width = max(len(name) for name, _ in lines)
    for name, text in lines:
        click.echo(f"{name:<{width}}  {text}")


@main.command()
@_guarded
def schema() -> None:
    """Print the JSON schema of scenes, for editors and for programs that write scenes."""
    import json

    from sweeps.scene.schema import scene_schema

    click.echo(json.dumps(scene_schema(), indent=2, ensure_ascii=False))


@main.command()
@click.argument("file", required=False, type=click.Path(path_type=Path))
@_guarded
def new(file: Path | None) -> None:
    """Write a commented scene to start from, to FILE or to the terminal; it runs as it is."""
    from sweeps.scene.model import built_in_scenes

    text = built_in_scenes()["first"].read_text(encoding="utf-8")
    if file is None:
        click.echo(text, nl=False)
        return
    try:
        with file.open("x", encoding="utf-8") as stream:
            stream.write(text)
    except FileExistsError:
        raise SceneError(f"{file}: exists; it is not overwritten") from None
    except (OSError, ValueError) as error:
        raise _not_written(file, error) from None
    _say(f"{file}: run it with `engine-dyn run {file} -o out.nc`")


def _run(plan: Plan, output: Path, options: Options) -> Finished:
    from sweeps.running import into_archive

    return into_archive.run(plan, output, options)


def _streamed(work: Callable[[], Result], output: Path) -> Result:
    """Do what writes an archive, and word its failures."""
    from sweeps.running import into_archive

    try:
        return work()
    except into_archive.Stopped as error:
        _end(one_line(error, 2000), FAILURE)
    except OSError as error:
        if error.errno not in _CANNOT_WRITE:
            raise
        raise _not_written(output, error) from None


def _not_written(path: Path, error: Exception) -> SceneError:
    reason = getattr(error, "strerror", None) or error
    return SceneError(f"{path}: cannot be written ({one_line(reason)})")


def _tell_of_compiling(quiet: bool) -> None:
    from engine_dyn.compilation import on_compiling

    if not quiet:
        on_compiling(
            lambda: click.echo(
                "compiling kernels (once for this version; later runs start at once)", err=True
            )
        )


def _print_published(plan: Plan, output: Path) -> None:
    """Published against computed values, where the scene has some."""
    if plan.scene.reference is None:
        return
    if plan.output_bytes > LARGEST_TABLE:
        click.echo(f"published values are in the archive; {plan.designs} designs are no table")
        return
    from sweeps.archive.netcdf import open_archive
    from sweeps.exploring.published import text

    with open_archive(output) as dataset:
        published = text(dataset)
    if published:
        _say(published + "\n")


def _command_line() -> str:
    words = shlex.join([Path(sys.argv[0]).name, *sys.argv[1:]])
    # A name of a file need not be text.
    return words.encode("utf-8", "replace").decode("utf-8")


def _shard(text: str) -> tuple[int, int]:
    """Number and count of "2/8"."""
    found = re.fullmatch(r"(\d{1,9})/(\d{1,9})", text.strip(), re.ASCII)
    number, count = (int(found[1]), int(found[2])) if found else (0, 0)
    if not 1 <= number <= count:
        raise SceneError(
            f"--shard {one_line(text, 60)}: must be I/N, such as 2/8: the second of eight parts"
        )
    return number, count


def _points(text: str) -> tuple[str, list[float]]:
    """Axis and values of "speed=1600,1700"."""
    name, _, values = text.partition("=")
    try:
        found = [plain_number(value) for value in values.split(",")]
    except ValueError:
        found = []
    if not name.strip() or not found or not all(math.isfinite(value) for value in found):
        raise SceneError(
            f"--axis {one_line(text, 60)}: must be AXIS=VALUE,VALUE, such as speed=1600,1700"
        )
    return name.strip(), found


def _tolerance(text: str) -> float:
    """Return a relative difference such as 1e-6."""
    try:
        limit = plain_number(text)
    except ValueError:
        limit = math.nan
    if not 0.0 <= limit < math.inf:
        raise SceneError(
            f"--tolerance {one_line(text, 60)}: must be a number of 0 or more, such as 1e-6"
        )
    return limit


def _size(text: str) -> float:
    """Bytes of "500MB" or "1.5 GB"."""
    found = re.fullmatch(r"\s*(\d+(?:\.\d*)?)\s*(MB|GB)\s*", text, re.IGNORECASE | re.ASCII)
    size = float(found[1]) * {"MB": 1e6, "GB": 1e9}[found[2].upper()] if found else 0.0
    if not SMALLEST_MEMORY <= size < math.inf:
        raise SceneError(
            f"--memory {one_line(text, 60)}: must be a number and MB or GB, such as 500MB or 2GB, "
            "100MB or more"
        )
    return size


# --- files --------------------------------------------------------------------------------------


def _files_of(scene: Scene) -> Iterator[Path]:
    """Files that a scene is made of, as far as they are on this disk."""
    if scene.path is not None:
        yield scene.path
    yield from map(Path, scene.files)
    table = (scene.source.get("designs") or {}).get("file")
    if isinstance(table, str):
        yield Path(scene.folder) / table


def _check_output(path: Path, overwrite: bool, *inputs: Path) -> None:
    """Refuse, before anything is computed, an output that could not be written, or is read."""
    try:
        str(path.absolute()).encode()
    except UnicodeEncodeError:
        raise SceneError(f"{path}: must be a name in UTF-8, which netCDF's library wants") from None
    try:
        if path.is_dir():
            raise SceneError(f"{path}: is a folder; -o must name a file")
        if path.exists():
            if not path.is_file():
                raise SceneError(f"{path}: is a pipe or a device; -o must name a file")
            for given in inputs:
                if given.exists() and path.samefile(given):
                    what = "the scene itself" if given == inputs[0] else "read by it"
                    raise SceneError(f"{path}: is {what}; -o must name another file")
        if os.path.lexists(path) and not overwrite:
            raise SceneError(f"{path}: exists; use --overwrite to replace it")
        folder = path.parent
        while not folder.exists():
            folder = folder.parent
        # Asking for permission is not enough: a file system can be read-only for its owner.
        with tempfile.TemporaryFile(dir=folder):
            pass
    except SceneError:
        raise
    except (OSError, ValueError) as error:
        raise _not_written(path, error) from None


def _check_archive(path: Path) -> None:
    """Refuse what is no file."""
    from sweeps.reading.guards import check_file

    check_file(path)


@contextmanager
def _opened(path: Path) -> Iterator[xr.Dataset]:
    """Open an archive for reading only; what then fails, the archive is to blame for.

    Of other hands, or damaged, it may hold anything under the names of quantities.
    """
    from sweeps.exploring import search

    with search.open(path) as dataset:
        try:
            yield dataset
        except (SceneError, MemoryError, click.exceptions.Exit):
            raise
        except Exception as error:
            if isinstance(error, OSError) and (error.errno or 0) > 0:
                raise  # netCDF's own have numbers below 0
            raise SceneError(
                f"{path}: cannot be read as an archive of `run`: {type(error).__name__}: "
                f"{one_line(error, 200)} (--debug shows where)"
            ) from error


def _slice(text: str) -> tuple[str, float | str]:
    """Axis and value of "load=50" or "method=newton"."""
    axis, separator, value = text.partition("=")
    if not separator or not axis.strip() or not value.strip():
        raise SceneError(f"--select {one_line(text, 60)}: must be AXIS=VALUE, such as load=50")
    try:
        return axis.strip(), plain_number(value)
    except ValueError:
        return axis.strip(), value.strip()


# --- what is printed ----------------------------------------------------------------------------


def _outcomes(dataset: xr.Dataset) -> dict[str, int]:
    """Count the designs of each outcome, in the order of the codes; none without a status."""
    if "status" not in dataset:
        return {}
    import numpy as np

    from engine_dyn.status import MEANINGS
    from sweeps.exploring.search import ranges

    codes = dataset["status"].variable
    dims = [str(d) for d in codes.dims]
    counts = np.zeros(len(MEANINGS), dtype=np.int64)
    for _, _, read in ranges({"status": codes}, dims, codes.shape, _COUNTED):
        # Piece by piece: counting makes an index of eight bytes out of each code.
        counts += np.bincount(read["status"].reshape(-1), minlength=len(MEANINGS))
    return {name: int(n) for name, n in zip(MEANINGS, counts, strict=True) if n}


def _interrupted(path: Path) -> Path | None:
    """Folder of an interrupted run that is named, or that is all there is of an archive."""
    from sweeps.archive.partial import Partial

    try:
        here = Partial(path) if path.exists() else Partial.of(path)
        if here.path.is_dir() and here.header() is None:
            here = here.adding()
        return here.path if here.path.is_dir() and here.header() is not None else None
    except (OSError, ValueError):
        return None


def _partial_text(path: Path) -> str:
    """What an interrupted run has finished, and how to go on."""
    from sweeps.archive.partial import Partial

    here = Partial(path)
    about = here.header() or {}
    output = shlex.quote(str(path.parent / about["output"]))
    what, again = f"run of {about['output']}", f"engine-dyn run SCENE -o {output} --resume"
    if about["output"] == here.added.name:
        what, again = "extension of an archive", "the same command"
    lines = [
        f"{path}: an interrupted {what}",
        f"  title: {about['title']}",
        f"  designs: {about['designs']}",
        f"  finished: {len(here.finished())} of {counted(about['blocks'], 'block')}",
        f"  started: {about['started']}",
        f"  command line: {one_line(about['command_line'], LONGEST)}",
        f"  to go on: {again}",
    ]
    return "\n".join(lines)


def _archive_text(dataset: xr.Dataset, name: str) -> str:
    """Axes, quantities, outcomes and provenance of an archive."""
    lines = [f"{name}: {dataset.attrs.get('title', '')}".rstrip(": ")]
    lines += [f"  {line}" for line in (_size_line(dataset, name), _run_line(dataset)) if line]
    lines += ["", "axes"]
    for dimension, size in dataset.sizes.items():
        lines.append(f"  {dimension} ({size}): {_axis_text(dataset, str(dimension))}")
        columns = [
            f"{n} [{c.attrs.get('units', '1')}]"
            for n, c in dataset.coords.items()
            if c.dims == (dimension,) and n != dimension and c.dtype.kind not in "UOT"
        ]
        if columns:
            lines.append(f"    varying along it: {', '.join(columns)}")
    lines += ["", "quantities"]
    names = [str(n) for n in dataset.data_vars]
    width = max((len(n) for n in names), default=0)
    for variable in names:
        data = dataset[variable]
        over = ", ".join(str(d) for d in data.dims) or "one value"
        units = data.attrs.get("units", "no single unit")
        lines.append(
            f"  {variable:<{width}}  [{units}] {data.attrs.get('long_name', '')} over ({over}), "
            f"{size_text(data.nbytes)}"
        )
    counts = _outcomes(dataset)
    if counts:
        lines += ["", "outcomes", *(f"  {outcome}: {n}" for outcome, n in counts.items())]
    lines += ["", "provenance"]
    for key, value in dataset.attrs.items():
        if key != "title":
            lines += _attribute_lines(str(key), value)
    return "\n".join(lines)


def _size_line(dataset: xr.Dataset, name: str) -> str:
    """How large an archive is, in numbers and on the disk, and how it is stored."""
    from engine_dyn.quantities.graph import DIMENSIONS

    designs = math.prod(size for d, size in dataset.sizes.items() if d not in DIMENSIONS)
    numbers = {str(v.dtype) for v in dataset.data_vars.values() if v.dtype.kind == "f"}
    levels = [v.encoding.get("complevel", 0) for v in dataset.data_vars.values()]
    parts = [
        counted(designs, "design"),
        f"{size_text(sum(v.nbytes for v in dataset.data_vars.values()))} of results",
        *sorted(numbers),
        f"compression {max(levels)}" if any(levels) else "not compressed",
        f"{size_text(Path(name).stat().st_size)} on the disk",
    ]
    return ", ".join(parts)


def _run_line(dataset: xr.Dataset) -> str:
    """When an archive was made, how long that took, and by which command."""
    made = str(dataset.attrs.get("history", "")).splitlines()
    words = [] if not made else [made[-1].partition(": ")[0]]
    if "seconds" in dataset.attrs:
        words.append(f"computed in {one_line(dataset.attrs['seconds'], 30)} s")
    if "command_line" in dataset.attrs:
        words.append(f"by {one_line(dataset.attrs['command_line'], LONGEST)}")
    return ", ".join(words)


def _attribute_lines(key: str, value: object) -> list[str]:
    """One attribute; what is kept as JSON has a line for each of its members."""
    import json

    if isinstance(value, str) and value.startswith("{"):
        try:
            members = json.loads(value)
            if key == "input_files":  # their texts are long
                members = {name: f"sha256 {f['sha256']}" for name, f in members["files"].items()}
        except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
            members = {}
        if members:
            texts = {
                name: item if isinstance(item, str) else json.dumps(item, ensure_ascii=False)
                for name, item in members.items()
            }
            rows = [f"    {name}: {one_line(text, LONGEST)}" for name, text in texts.items()]
            return [f"  {key}:", *rows]
    return [f"  {key}: {one_line(value, LONGEST)}"]


def _axis_text(dataset: xr.Dataset, dimension: str) -> str:
    """Values along one dimension: words, or the numbers with their unit."""
    words = [
        coordinate
        for coordinate in dataset.coords.values()
        if coordinate.dims == (dimension,) and coordinate.dtype.kind in "UOT"
    ]
    if words:
        return one_line(", ".join(str(word) for word in words[0].values), 100)
    if dimension not in dataset.coords:
        return ""
    coordinate = dataset[dimension]
    values = coordinate.values
    unit = coordinate.attrs.get("units", "1")
    if len(values) <= 8:
        listed = ", ".join(f"{value:g}" for value in values)
    else:
        listed = f"{values[0]:g}, {values[1]:g} ... {values[-1]:g}"
    return f"{listed} [{unit}]"


def _engine_text(engine: Any) -> str:
    """Values of an engine, which of them are assumed and why, and its sources."""
    from engine_dyn.quantities.graph import PARAMETERS

    family = engine.family
    lines = [f"{engine.name}: {engine.title}", "", "values"]
    for key, value in engine.values.items():
        node = PARAMETERS[key]
        mark = "  (assumed)" if key in engine.assumed else ""
        lines.append(f"  {key} = {value:.10g} [{node.unit}] {node.long_name}{mark}")
    if engine.firing_order is not None:
        lines.append("  firing order " + "-".join(str(c) for c in engine.firing_order))
    if engine.own_cylinders is not None:
        lines.append(f"  {engine.own_cylinders.solved}")
    for what, table in (("load", engine.load_table), ("driver", engine.driver_table)):
        if table is not None:
            lines.append(f"  {what}_table: {table}")
    lines += ["", "diagrams"]
    speeds = [f" at {s * 30.0 / math.pi:g} rpm" for s in getattr(family, "speeds", ())] or [""]
    points = [(load, speed) for speed in speeds for load in family.loads]
    for (load, speed), diagram in zip(points, family.diagrams, strict=True):
        lines.append(
            f"  load {load:g} percent{speed}: p_max {diagram.peak / 1e5:.4g} bar at "
            f"{math.degrees(diagram.peak_angle):.3g} degree, {len(diagram.angle)} points"
        )
    if engine.pressure_scale is not None:
        speed, scale = engine.pressure_scale
        lines.append(
            f"  scaled over speed from {speed[0]:g} to {speed[-1]:g} rpm by factors from "
            f"{min(scale):.4g} to {max(scale):.4g}"
        )
    if engine.assumed:
        lines += ["", "assumed, because the sources do not give it"]
        lines += [f"  {key}: {one_line(reason)}" for key, reason in engine.assumed.items()]
    if engine.sources:
        lines += ["", "sources", *(f"  {one_line(source)}" for source in engine.sources)]
    return "\n".join(lines)


def _quantity_lines() -> list[tuple[str, str]]:
    from engine_dyn.quantities.graph import QUANTITIES

    # The unit of the load coefficient follows the load exponent: it has none in the table.
    lines = []
    for name, node in QUANTITIES.items():
        symbol = re.sub(r"(?<=\w)\\", " ", node.symbol)  # TeX, as plain text
        symbol = re.sub(r"[\\{}]", "", symbol)
        text = f"[{node.unit or 'unit follows the load exponent'}] {node.long_name}"
        lines.append((name, f"{text}{symbol and f', {symbol}'} ({node.source})"))
    return lines


def _key_lines() -> list[tuple[str, str]]:
    from engine_dyn.quantities.graph import PARAMETERS
    from engine_dyn.quantities.single_cylinders import OF_CYLINDER, PATTERNS
    from sweeps.checks import allowed
    from sweeps.reading.cylinder_keys import KEYS
    from sweeps.reading.load_tables import KEYS as TABLE_KEYS

    nodes = {k: node for k, node in PARAMETERS.items() if k not in OF_CYLINDER} | dict(PATTERNS)
    keys = [(key, f"{node.long_name}: {allowed(node)}") for key, node in nodes.items()]
    return [*keys, *KEYS.items(), *TABLE_KEYS.items()]


def _engine_lines() -> list[tuple[str, str]]:
    from sweeps.reading.engine_files import catalogue, load_engine

    return [(name, load_engine(name).title) for name in catalogue()]


def _scene_lines() -> list[tuple[str, str]]:
    import tomllib

    from sweeps.scene.model import built_in_scenes

    return [
        (name, tomllib.loads(path.read_text(encoding="utf-8"))["title"])
        for name, path in built_in_scenes().items()
    ]


_LISTS: dict[str, Callable[[], list[tuple[str, str]]]] = {
    "quantities": _quantity_lines,
    "engines": _engine_lines,
    "scenes": _scene_lines,
    "keys": _key_lines,
}
