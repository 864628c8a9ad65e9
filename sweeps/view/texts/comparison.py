"""A comparison of two archives as text for people."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sweeps.base.errors import counted, one_line
from sweeps.decide.explore.compare import Comparison, Difference, beside
from sweeps.view.texts.readable_units import READABLE, factor

if TYPE_CHECKING:
    import xarray as xr


def draw_comparison(
    first: xr.Dataset, second: xr.Dataset, folder: Path, file_format: str, files: Sequence[Path]
) -> list[Path]:
    """Draw what two archives have in common, in one chart with the difference in percent.

    Legends name the archives by their files. There are no figures where all is the same.
    """
    from sweeps.view.figures import draw
    from sweeps.view.figures.options import options_of
    from sweeps.view.texts.readable_dataset import readable_dataset

    names = [path.stem for path in files]
    if names[0] == names[1]:
        names = [str(path.with_suffix("")) for path in files]
    if names[0] == names[1]:
        names = ["first", "second"]
    both = readable_dataset(beside(first, second, names))
    return draw(both, folder, file_format, options=options_of(only="compared"))


def comparison_text(comparison: Comparison) -> str:
    """Lines on a comparison: axes, then each quantity with its largest differences."""
    lines = [f"axes: {'; '.join(comparison.axes) if comparison.axes else 'the same'}"]
    if comparison.made:
        lines.append(f"made in different ways: {'; '.join(comparison.made)}")
    for quantities, which in zip(
        (comparison.only_first, comparison.only_second), comparison.names, strict=True
    ):
        if quantities:
            lines.append(f"only in {which}: {', '.join(quantities)}")
    lines += [f"not compared: {why}" for why in comparison.not_compared]
    width = max((len(d.name) for d in comparison.quantities), default=0)
    for difference in comparison.quantities:
        lines += [
            f"{difference.name if i == 0 else '':<{width}}  {row}"
            for i, row in enumerate(_rows(difference))
        ]
    return "\n".join(lines)


def _rows(of: Difference) -> list[str]:
    """Lines on the difference of one quantity."""
    if not of.differing:
        return [f"the same in {counted(of.count, 'value')}"]
    rows = [f"{of.differing} of {counted(of.count, 'value')} differ"]
    if of.relative:
        wanted = READABLE.get(of.units, of.units)
        times, unit = factor(of.units, wanted), "" if wanted == "1" else wanted
        rows += [
            f"largest relative difference {of.relative:.3g}: {_pair(of.relative_pair, times)}"
            f"{_place(of.relative_at)}",
            f"largest difference {times * of.largest:.3g} {unit}".rstrip()
            + f": {_pair(of.pair, times)}{_place(of.largest_at)}",
        ]
    if of.only_one:
        rows.append(f"{of.only_one} with a number in only one archive, first{_place(of.only_at)}")
    return rows


def _pair(values: tuple[float, float], times: float) -> str:
    return f"{times * values[0]:.12g} and {times * values[1]:.12g}"


def _place(at: dict[str, Any]) -> str:
    if not at:
        return ""
    words = (f"{k}={v:.9g}" if isinstance(v, float) else f"{k}={v}" for k, v in at.items())
    return " at " + one_line(", ".join(words), 300)
