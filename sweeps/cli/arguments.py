"""Options that several commands share, and the values of options that are written as a text.

A text is parsed by the command and not by click, so that what is wrong with it is told in one line
like all other bad input.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import click
from click.shell_completion import CompletionItem

from sweeps.base.dimensions import LABELS
from sweeps.base.errors import SceneError, one_line, plain_number
from sweeps.base.files.numbers_with_units import number_with_unit, with_unit_of_last
from sweeps.base.ratios import number_or_ratio

LISTED = ("quantities", "engines", "scenes", "shafts", "keys", "classes", "sources")
"""Lists of `engine-dyn list`."""


def _words(
    words: Callable[[], Iterable[tuple[str, str]]], *, several: bool = False, files: bool = False
) -> Callable[[click.Context, click.Parameter, str], list[CompletionItem]]:
    """Complete a word, or the last of several with commas; files where no word matches."""

    def complete(
        context: click.Context, parameter: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        del context, parameter
        before, comma, last = incomplete.rpartition(",") if several else ("", "", incomplete)
        try:
            matching = [(word, text) for word, text in words() if word.startswith(last)]
        except Exception:
            matching = []
        items = [CompletionItem(f"{before}{comma}{word}", help=text) for word, text in matching]
        # The shell completes files itself.
        return items or ([CompletionItem(incomplete, type="file")] if files else [])

    return complete


def _scenes() -> list[tuple[str, str]]:
    from sweeps.scene.reading import built_in_scenes

    return [(name, "built-in scene") for name in built_in_scenes()]


def _engines() -> list[tuple[str, str]]:
    from sweeps.scene.engine.engine_files import catalogue

    return [(name, "engine of the catalogue") for name in catalogue()]


def _keys() -> list[tuple[str, str]]:
    from engine_dyn.quantities.graph import PARAMETERS

    return [(name, node.long_name) for name, node in PARAMETERS.items()]


def _quantities() -> list[tuple[str, str]]:
    from engine_dyn.quantities.graph import ALL_QUANTITIES

    return [(name, node.long_name) for name, node in ALL_QUANTITIES.items()]


complete_scene = _words(_scenes, files=True)
complete_engine = _words(_engines, files=True)
complete_engine_or_scene = _words(lambda: [*_scenes(), *_engines()], files=True)
complete_keys = _words(_keys, several=True)
complete_quantities = _words(_quantities, several=True)
complete_list = _words(lambda: [(name, "list") for name in LISTED])


Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]

# Smallest number of bytes of memory that may be asked for; with less, a block of designs could not
# be held
SMALLEST_MEMORY = 100e6

PATH = click.Path(path_type=Path)

archive_argument = click.argument("archive", type=PATH)

resume_option = click.option(
    "--resume",
    is_flag=True,
    help="Complete an interrupted run. If there is none, start from the beginning.",
)
threads_option = click.option(
    "--threads", type=click.IntRange(min=1), help="Number of threads. Default: one for each core."
)
seed_option = click.option(
    "--seed", default=1, show_default=True, help="Seed of the random numbers."
)
quiet_option = click.option("-q", "--quiet", is_flag=True, help="Print nothing but errors.")
compression_option = click.option(
    "--compression",
    "level",
    type=click.IntRange(0, 9),
    help="Compression level, 0 to 9. Default: that of the archive that is read.",
)


def _read_apart_first(context: click.Context, _: click.Parameter, value: bool) -> None:
    if value:
        from sweeps.base.netcdf.netcdf_files import untrusted

        context.with_resource(untrusted())


untrusted_option = click.option(
    "--untrusted",
    is_flag=True,
    expose_value=False,
    callback=_read_apart_first,
    help="Read the results of netCDF files too in a separate process with limited time and memory, "
    "as all else of them, before they are opened.",
)


def output_option(help: str = "The archive to write.") -> Decorator:
    """Option -o, which names the file to write."""
    return click.option("-o", "--output", required=True, type=PATH, help=help)


def overwrite_option(help: str = "Replace the archive if it exists.") -> Decorator:
    """Option --overwrite, without which nothing that exists is replaced."""
    return click.option("--overwrite", is_flag=True, help=help)


def select_option(help: str) -> Decorator:
    """Option --select: values of axes."""
    return click.option(
        "--select",
        "slices",
        multiple=True,
        metavar="AXIS=VALUE",
        help=f"{help} A number may have a unit; without one it is in that of the archive (W, m). "
        "Several separated by commas, or given several times.",
    )


def quantities_option(help: str) -> Decorator:
    """Option --quantities: their names with commas between them."""
    return click.option(
        "--quantities", metavar="NAMES", shell_complete=complete_quantities, help=help
    )


def units_option(help: str = "Units of columns, as in `engine-dyn show`.") -> Decorator:
    """Option --units: in which units quantities are told."""
    return click.option("--units", metavar="NAME=UNIT", help=help)


def format_option(what: str) -> Decorator:
    """Option --format of figures."""
    return click.option(
        "--format",
        "file_format",
        type=click.Choice(["png", "svg", "pdf"]),
        default="png",
        show_default=True,
        help=f"Format of the {what}.",
    )


def names_of(text: str | None) -> list[str] | None:
    """Return the names of "delta,imep"; None where the option is not given."""
    return None if text is None else [name.strip() for name in text.split(",")]


def memory_size(text: str) -> float:
    """Return the bytes of "500MB" or "1.5 GB", decimal units."""
    size = _bytes(text, ("MB", "GB"))
    if not SMALLEST_MEMORY <= size < math.inf:
        raise SceneError(
            f"--memory {one_line(text, 60)}: must be a number and MB or GB, such as 500MB or 2GB, "
            "100MB or more"
        )
    return size


def file_size(text: str) -> float:
    """Return the bytes of "20MB" or "500 kB", decimal units."""
    size = _bytes(text, ("kB", "MB", "GB"))
    if not 0.0 < size < math.inf:
        raise SceneError(
            f"--limit {one_line(text, 60)}: must be a number and kB, MB or GB, such as 20MB"
        )
    return size


def _bytes(text: str, units: Iterable[str]) -> float:
    """Bytes in a text such as "2 GB", in one of some units; 0 for any other text."""
    pattern = rf"\s*(\d+(?:\.\d*)?)\s*({'|'.join(units)})\s*"
    match = re.fullmatch(pattern, text, re.IGNORECASE | re.ASCII)
    return float(match[1]) * {"KB": 1e3, "MB": 1e6, "GB": 1e9}[match[2].upper()] if match else 0.0


def shard_number(text: str) -> tuple[int, int]:
    """Return the number and the count of "2/8", the second of eight shards."""
    match = re.fullmatch(r"(\d{1,9})/(\d{1,9})", text.strip(), re.ASCII)
    number, count = (int(match[1]), int(match[2])) if match else (0, 0)
    if not 1 <= number <= count:
        why = f"{number} is more than {count}; " if number > count else ""
        raise SceneError(
            f"--shard {one_line(text, 60)}: {why}must be I/N, such as 2/8: the second of eight "
            "parts"
        )
    return number, count


def new_points(text: str) -> tuple[str, list[float]]:
    """Return the axis and the values of "speed=1600,1700" or "bore=80, 90 mm"."""
    name, _, values = (part.strip() for part in text.partition("="))
    if name in LABELS[1:]:
        raise SceneError(
            f"--axis {name}: {name} cannot be added to an archive; run a scene with all of them"
        )
    if not name or not values:
        raise SceneError(
            f"--axis {one_line(text, 60)}: must be AXIS=VALUE,VALUE, such as speed=1600,1700"
        )
    from engine_dyn.quantities.graph import PARAMETERS

    unit = PARAMETERS[name].unit if name in PARAMETERS else "1"
    points = []
    for value in with_unit_of_last(values.split(",")):
        try:
            points.append(number_or_ratio(value))
        except ValueError:
            points.append(number_with_unit(value, f"--axis {name}", unit))
    return name, points


def number_of(text: str, option: str) -> float:
    """Return the number of an option such as "1e-4"."""
    try:
        return plain_number(text)
    except ValueError:
        raise SceneError(f"{option} {one_line(text.strip(), 30)}: must be a number") from None


def difference(text: str) -> float:
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


def percentages(text: str) -> list[float]:
    """Return the numbers of "25,50,100"."""
    try:
        return [plain_number(part) for part in text.split(",")]
    except ValueError:
        raise SceneError(
            f"--loads {one_line(text, 60)}: must be percentages with commas, such as 25,50,100"
        ) from None


def axis_slice(text: str, option: str = "--select") -> tuple[str, str]:
    """Return the axis and the value of "load=50" or "method=newton" as it is written.

    Whoever takes it of an archive knows whether the axis is one of numbers: "1", "1e3" and "1/200"
    may be names of designs.
    """
    axis, separator, value = text.partition("=")
    if not separator or not axis.strip() or not value.strip():
        raise SceneError(f"{option} {one_line(text, 60)}: must be AXIS=VALUE, such as load=50")
    return axis.strip(), value.strip()


def axis_slices(texts: Iterable[str], option: str = "--select") -> dict[str, str]:
    """Return the axes and values of several texts such as "load=50,speed=1500"."""
    slices: dict[str, str] = {}
    for part in (part for text in texts for part in re.split(r",(?=\s*\w+\s*=)", text)):
        axis, value = axis_slice(part, option)
        if axis in slices:
            raise SceneError(f"{option} {axis}: given twice; must be given once")
        slices[axis] = value
    return slices
