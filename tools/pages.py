"""Common parts of the tools: tables, templates, commands that are run, pictures that are kept."""

from __future__ import annotations

import argparse
import contextlib
import csv
import io
import re
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib
import xarray as xr
from click.testing import CliRunner
from matplotlib.figure import Figure
from PIL import Image

from sweeps.cli.main import main as engine_dyn
from sweeps.view.figures import draw
from sweeps.view.figures.sheet import STYLE

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
FIGURES = DOCS / "figures"

sys.path.append(str(ROOT))
"""The folder `oracle` is not installed."""

WIDTH = 900
"""Width in pixels of a scaled picture."""


def csv_text(rows: Iterable[Sequence[str]]) -> str:
    """Rows, heads first, as a CSV file."""
    file = io.StringIO()
    csv.writer(file, lineterminator="\n").writerows(rows)
    return file.getvalue()


def csv_rows(path: Path) -> list[dict[str, str]]:
    """Rows of a CSV file as text, so that printed digits stay; lines that begin with # are none."""
    lines = path.read_text(encoding="utf-8").splitlines()
    return list(csv.DictReader(line for line in lines if not line.startswith("#")))


def markdown(rows: Iterable[Sequence[str]], texts: int | None = None) -> str:
    """Rows, heads first, as a Markdown table.

    Columns behind the first `texts` are numbers, which stand to the right.
    """
    heads, *rest = rows
    numbers = 0 if texts is None else len(heads) - texts
    rule = ["---"] * (len(heads) - numbers) + ["---:"] * numbers
    return "\n".join("| " + " | ".join(line) + " |" for line in [heads, rule, *rest])


def with_notes(meaning: str, **notes: str) -> str:
    """A meaning, and below it in small print what else there is: narrow tables fit a phone."""
    small = "; ".join(f"{head}: {text}" for head, text in notes.items() if text)
    return f"{meaning}<br><small>{small}</small>" if small else meaning


def filled(template: str, values: Mapping[str, str]) -> str:
    """Put values in the places `{{ NAME }}` of a template, all of them and each at least once.

    Raises
    ------
    KeyError
        If a place has no value, or a value no place.
    """
    text = re.sub(r"\{\{ (\w+) \}\}", lambda place: values[place[1]], template)
    if unused := set(values) - set(re.findall(r"\{\{ (\w+) \}\}", template)):
        raise KeyError(f"no place in the template for {', '.join(sorted(unused))}")
    return text


def with_numbers(text: str, numbers: Mapping[str, str]) -> str:
    """Part of an engine file with other numbers; comments behind them stay in their column."""
    for key, number in numbers.items():
        found = re.search(rf"(?m)^{key} = \S+( *)", text)
        if found is None:
            raise ValueError(f"no line for {key}")
        line = f"{key} = {number}"
        if found[1]:
            line = line.ljust(len(found[0]) - 2) + "  "
        text = text.replace(found[0], line, 1)
    return text


def write(files: Mapping[Path, str]) -> None:
    """Write files, and say so."""
    for path, text in files.items():
        path.parent.mkdir(exist_ok=True)
        path.write_text(text, encoding="utf-8")
    print(f"written: {', '.join(str(path.relative_to(ROOT)) for path in files)}")


def figures_wanted(description: str) -> bool:
    """Whether the command line does not say --no-figures."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--no-figures", action="store_true", help="leave docs/figures alone")
    return not parser.parse_args().no_figures


def run_command(command: str, folder: Path, status: int = 0) -> tuple[str, str]:
    """Run a command in a folder; what it writes to standard output and to standard error.

    `python -m` runs from the project's root, and takes the folder where it says `.`.

    Raises
    ------
    RuntimeError
        If `engine-dyn` ends with another status.
    """
    program, *arguments = shlex.split(command)
    if program == "python":
        arguments = [str(folder) if part == "." else part for part in arguments]
        subprocess.run([sys.executable, *arguments], cwd=ROOT, check=True, capture_output=True)
        return "", ""
    if program != "engine-dyn":
        subprocess.run(command, shell=True, cwd=folder, check=True)
        return "", ""
    with contextlib.chdir(folder):
        done = CliRunner(env={"COLUMNS": "80"}).invoke(engine_dyn, arguments)
    if done.exit_code != status:
        raise RuntimeError(f"{command}: {done.exit_code}: {done.stderr}") from done.exception
    return done.stdout, done.stderr


def keep_picture(drawn: Sequence[Path], target: Path, width: int = WIDTH) -> None:
    """Keep drawn pictures, one below the other, scaled to a width in pixels."""
    parts = []
    for path in drawn:
        with Image.open(path) as picture:
            size = width, round(picture.height * width / picture.width)
            parts.append(picture.convert("RGB").resize(size, Image.Resampling.LANCZOS))
    whole = Image.new("RGB", (width, sum(part.height for part in parts)), "white")
    top = 0
    for part in parts:
        whole.paste(part, (0, top))
        top += part.height
    whole.quantize(256).save(target, optimize=True)


def keep_figure(data: xr.Dataset, name: str) -> None:
    """Draw a dataset, and keep the figure of this name in docs/figures."""
    with tempfile.TemporaryDirectory() as folder:
        drawn = {path.stem: path for path in draw(data, folder)}
        keep_picture([drawn[name]], FIGURES / f"{name}.png")


@contextlib.contextmanager
def sheet(
    name: str, size: tuple[float, float], rows: int = 1, columns: int = 1, **more: Any
) -> Iterator[tuple[Figure, Any]]:
    """A figure of docs/figures in the style of those of archives, and its panels (rows, columns).

    `size` is in inches; `more` are keywords of matplotlib's `Figure.subplots`.
    """
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(STYLE)  # type: ignore[arg-type]
        figure = Figure(figsize=size, layout="constrained")
        yield figure, figure.subplots(rows, columns, squeeze=False, **more)
        figure.savefig(FIGURES / f"{name}.png", dpi=150, metadata={"Software": None})
