"""The command for files of laboratories: import."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

import click

from sweeps.base.errors import SceneError, one_line, plain_number
from sweeps.cli.arguments import PATH, output_option, overwrite_option, quiet_option
from sweeps.cli.exits import guarded, tell, warn
from sweeps.cli.files import check_folder, check_output, same_file, writing

if TYPE_CHECKING:
    from sweeps.lab.pressure.imported_pressure import ImportedPressure

__all__ = ["import_"]


class _WithKeys(click.Command):
    """A command with an option for each key of `ImportOptions`.

    They are made when the command is used: help on all commands does not load what the keys need.
    """

    def get_params(self, ctx: click.Context) -> list[click.Parameter]:
        """Options of the command itself, then those of the keys."""
        own = super().get_params(ctx)
        return [*own[:-1], *_key_options(), own[-1]]


@cache
def _key_options() -> tuple[click.Option, ...]:
    from sweeps.base.columns.options import ImportOptions

    options = []
    for name, field in ImportOptions.model_fields.items():
        words = [f"--{name.replace('_', '-')}", name]
        if field.annotation is bool:
            options.append(click.Option(words, is_flag=True, help=_FLAGS[name]))
            continue
        several = name == "pressure_column"
        how = " (several: repeat the option)" if several else ""
        about = f"{field.description or ''}{how}"
        options.append(click.Option(words, multiple=several, metavar="VALUE", help=about))
    return tuple(options)


_FLAGS = {
    "average": "Average over all cycles.",
    "two_stroke": "Two-stroke: the cycle is one revolution.",
}


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
    from sweeps.lab.pressure.reading import read_pressure

    chosen = {name: v for name, v in given.items() if v not in (None, False, ())}
    imported = read_pressure(raw, **{name: _value(name, v) for name, v in chosen.items()})
    check_output(output, overwrite)
    if figures is not None:
        check_folder(figures)
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
    """Draw the sheet of each cylinder, in folders of their own where there are several."""
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


def _value(name: str, text: Any) -> Any:
    """Value of an option in the type of its key; a text that has none is left for the check."""
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
