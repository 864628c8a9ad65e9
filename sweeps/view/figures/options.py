"""Options of figures: kinds, style, size, crank angle, targets, slices."""

from __future__ import annotations

import io
import logging
import math
import os
import re
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from logging.handlers import BufferingHandler
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from sweeps.base.errors import SceneError, did_you_mean, one_line, shown, size_text
from sweeps.base.files.numbers_with_units import PATTERN, number_with_unit
from sweeps.base.naming import DESCRIPTION
from sweeps.base.ratios import number_or_ratio

SMALLEST, LARGEST = 60.0, 1200.0
"""Smallest and largest side of a figure in mm; smaller ones have no room for their labels."""

ZEROS: Mapping[str, tuple[float, str]] = {
    "firing-tdc": (0.0, "firing top dead centre"),
    "gas-exchange-tdc": (-360.0, "gas-exchange top dead centre"),
    "bdc": (-180.0, "bottom dead centre before compression"),
    "expansion-bdc": (180.0, "bottom dead centre after expansion"),
}
"""Zeros of the crank angle: degrees after firing dead centre, and the name of the place."""

MOST_STYLE = 1 << 20  # Largest style file in bytes

MOST_DPI = 1200  # Largest number of dots per inch of a style; with more, a figure takes gigabytes

MOST_POINTS = 500
"""Largest letters, lines, marks and gaps of a style in points; larger ones fill any figure."""

Target = tuple[str, float]  # Target value, as the user wrote it (1/200) and as a number


@dataclass(frozen=True)
class Options:
    """Options of figures; all of them may be left out.

    `options_of` makes one of what people write, and says what each keyword is. Here kinds have the
    names of `sweeps.view.figures.kinds.KINDS`, and empty tuples stand for all. A figure without a
    size is 7 inches (178 mm) wide and as tall as what it shows needs.
    """

    only: tuple[str, ...] = ()
    quantities: tuple[str, ...] = ()
    select: Mapping[str, float | str] = field(default_factory=dict)
    style: Mapping[str, Any] = field(default_factory=dict)
    size: tuple[float, float] | None = None
    angle: tuple[float, float] | None = None
    zero: str = "firing-tdc"
    targets: Mapping[str, tuple[Target, ...]] = field(default_factory=dict)
    sides: Mapping[str, str] = field(default_factory=dict)  # "<" if a target is an upper limit
    at: float | None = None

    @property
    def inches(self) -> tuple[float, float] | None:
        """The size as matplotlib takes it, in inches of 25.4 mm."""
        return None if self.size is None else (self.size[0] / 25.4, self.size[1] / 25.4)


def options_of(
    *,
    only: str | Iterable[str] = (),
    quantities: str | Iterable[str] = (),
    select: Mapping[str, float | str] | None = None,
    style: str | Path | Mapping[str, Any] | None = None,
    size: str | tuple[float, float] | None = None,
    angle: str | tuple[float, float] | None = None,
    zero: str = "firing-tdc",
    target: str | Iterable[str] | Mapping[str, Any] = (),
    at: str | float | None = None,
) -> Options:
    """Options from what people write; every keyword may be a text as on the command line.

    Parameters
    ----------
    only : str or iterable of str
        Kinds, several with commas: ``"torque_and_speed,bearing_polar"``.
    quantities : str or iterable of str
        What the general kinds draw (``numbers``, ``curves``, ``orders``), several with commas:
        ``"delta,omega_max"``.
    select : mapping, optional
        Values of axes that are not drawn along, as `sweeps.nearest` takes them.
    style : str, Path or mapping, optional
        Settings in place of those of `sweeps.view.figures.sheet.STYLE`: a matplotlib style file,
        the name of one of matplotlib's own styles (``"dark_background"``), or the settings
        themselves (``{"font.size": 10}``).
    size : str or tuple of float, optional
        ``"160x100"`` or ``(160, 100)``: width and height in millimetres.
    angle : str or tuple of float, optional
        ``"0..720"`` or ``(0, 720)``: first and last crank angle in degrees, one cycle apart.
    zero : str
        Where the crank angle is counted from: ``firing-tdc``, ``gas-exchange-tdc``, ``bdc``
        (before compression) or ``expansion-bdc``.
    target : str, iterable of str or mapping
        ``"delta=1/200"``, several with commas, or ``{"delta": 0.005}``: values of quantities that
        are drawn as lines wherever the quantity is.
    at : str or float, optional
        Crank angle in degrees, as it is counted here, at which the crank train is drawn; without
        it that of the largest tangential force.

    Returns
    -------
    Options

    Raises
    ------
    SceneError
        For anything that cannot be read; one line names the option and what is allowed.

    Examples
    --------
    >>> options_of(size="160x100", target="delta=1/200").targets
    {'delta': (('1/200', 0.005),)}
    """
    if zero not in ZEROS:
        raise SceneError(f"zero {shown(zero)}: must be one of {', '.join(ZEROS)}")
    if select is not None and not isinstance(select, Mapping):
        raise SceneError(f"select {shown(select)}: must be values of axes, such as {{'load': 50}}")
    return Options(
        only=tuple(name.replace("-", "_") for name in _names(only)),
        quantities=_names(quantities),
        select=dict(select or {}),
        style=_style(style),
        size=None if size is None else _size(size),
        angle=None if angle is None else _angle(angle),
        zero=zero,
        targets=_targets(target),
        sides={} if isinstance(target, Mapping) else _sides(_names(target)),
        at=None if at is None else _degrees(at),
    )


def _degrees(given: str | float) -> float:
    try:
        angle = float(given)
    except ValueError:
        angle = np.nan
    if not np.isfinite(angle):
        raise SceneError(f"at {shown(given)}: must be a crank angle in degrees, such as 20")
    return angle


def _names(given: str | Iterable[str]) -> tuple[str, ...]:
    several = isinstance(given, Iterable) and not isinstance(given, str)
    texts = [str(one) for one in (given if several else [given])]
    names = [name.strip() for text in texts for name in text.split(",")]
    return tuple(dict.fromkeys(name for name in names if name))


def _pair(given: str | tuple[float, float], sign: str) -> tuple[float, float] | None:
    """Two finite numbers in a text with a sign between them."""
    if isinstance(given, str):
        number = r"\s*+([-+]?(?:\d++(?:\.(?!\.)\d*+)?+|\.\d++))\s*+"
        match = re.fullmatch(number + sign + number, given, re.ASCII)
        parts: tuple[Any, ...] = match.groups() if match else ()
    else:
        parts = tuple(given) if isinstance(given, Iterable) else ()
    try:
        first, second = (float(part) for part in parts)
    except (TypeError, ValueError):
        return None
    return (first, second) if np.isfinite([first, second]).all() else None


def _size(given: str | tuple[float, float]) -> tuple[float, float]:
    sides = _pair(given, "[xX\N{MULTIPLICATION SIGN}]")
    if sides is None or not all(SMALLEST <= side <= LARGEST for side in sides):
        raise SceneError(
            f"size {shown(given)}: must be width and height in millimetres, such as 160x100, "
            f"each from {SMALLEST:g} to {LARGEST:g}"
        )
    return sides


def _angle(given: str | tuple[float, float]) -> tuple[float, float]:
    ends = _pair(given, r"\.\.")
    if ends is None or ends[1] - ends[0] not in (360.0, 720.0) or abs(ends[0]) > 720.0:
        raise SceneError(
            f"angle {shown(given)}: must be the first and the last crank angle of one cycle, "
            "such as 0..720 or -360..360"
        )
    return ends


def _targets(given: str | Iterable[str] | Mapping[str, Any]) -> dict[str, tuple[Target, ...]]:
    targets: dict[str, tuple[Target, ...]] = {}
    if isinstance(given, Mapping):
        pairs = [
            (str(name), str(value))
            for name, values in given.items()
            for value in (values if isinstance(values, list | tuple) else [values])
        ]
    else:
        pairs = []
        for text in _names(given):
            target = re.fullmatch(r"\s*+(\w++)\s*+(?:<=|>=|<|>|=)([^<>=]++)", text)
            if target is None or not target[2].strip():
                raise SceneError(
                    f"target {shown(text)}: must be QUANTITY=VALUE or a condition, such as "
                    "delta=1/200 or 'delta <= 1/200'"
                )
            pairs.append((target[1], target[2].strip()))
    for name, value in pairs:
        # A unit is converted when the archive is known (`with_targets`)
        number = math.nan if re.match(PATTERN, value) else _ratio(name, value)
        targets[name] = (*targets.get(name, ()), (value, number))
    return targets


def _sides(texts: Iterable[str]) -> dict[str, str]:
    """The side on which each target is met; of "=" it is known of delta alone, which is limited."""
    pairs = re.findall(r"^\s*+(\w++)\s*+([<>=])", "\n".join(texts), re.MULTILINE)
    return {n: side.replace("=", "<") for n, side in pairs if side != "=" or n == "delta"}


def _ratio(name: str, text: str) -> float:
    """A plain number or a fraction such as 1/200."""
    try:
        return number_or_ratio(text[:40])
    except ValueError:
        raise SceneError(
            f"target {name}={shown(text)}: must be a number, with or without a unit, or a fraction "
            "such as 1/200"
        ) from None


def _style(given: str | Path | Mapping[str, Any] | None) -> dict[str, Any]:
    """Settings of matplotlib from a file, from one of its own styles, or from a mapping."""
    if given is None:
        return {}
    from matplotlib import style

    if isinstance(given, Mapping):
        _check_style(given, "style")
        return dict(given)
    if not os.path.exists(given):  # Path.exists fails for names that are too long
        if str(given) in style.library:
            return {str(key): value for key, value in style.library[str(given)].items()}
        raise SceneError(
            f"style {shown(str(given))}: no such file, and no style of matplotlib"
            f"{did_you_mean(str(given), [str(one) for one in style.library])}"
        )
    name = f"style {one_line(given, 200)}"
    # Some settings of a file are left out: TeX would run commands that read and write files, a
    # tight box would change the requested size, and others have no meaning here.
    left_out = {"backend", "interactive", "toolbar", "timezone", "svg.hashsalt", "text.usetex",
                "savefig.bbox"}  # fmt: skip
    kept = {k: v for k, v in _style_file(Path(given), name).items() if k not in left_out}
    _check_style(kept, name)
    return kept


def _style_file(path: Path, name: str) -> dict[str, Any]:
    """Settings of a style file; lines that matplotlib would only log as faults are refused."""
    import matplotlib

    if not path.is_file():
        raise SceneError(f"{name}: not a regular file; expected a matplotlib style file")
    if path.stat().st_size > MOST_STYLE:
        raise SceneError(f"{name}: larger than {size_text(MOST_STYLE)}")
    log, complaints = logging.getLogger("matplotlib"), BufferingHandler(sys.maxsize)
    complaints.setLevel(logging.WARNING)
    silent, log.propagate = log.propagate, False
    log.addHandler(complaints)
    try:
        settings: Any = matplotlib.rc_params_from_file(path, use_default_template=False)
    except Exception as error:  # matplotlib may raise any error for unknown text
        raise SceneError(f"{name}: {_first_line(error)}") from None
    finally:
        log.removeHandler(complaints)
        log.propagate = silent
    for record in complaints.buffer:
        said = " ".join(record.getMessage().split()).split(" You probably")[0]
        raise SceneError(f"{name}: {said[:200]}")
    return {str(key): value for key, value in settings.items()}


def _check_style(style: Mapping[str, Any], name: str) -> None:
    """Check that matplotlib takes the settings, that no figure becomes huge, and that it draws."""
    # matplotlib accepts unknown markers and colours, and fails as it draws them.
    import matplotlib
    from matplotlib.figure import Figure

    settings: Any = style
    try:
        with matplotlib.rc_context(settings):
            for key, value in style.items():
                _check_size(key, value, name)
            figure = Figure((2.0, 2.0))
            panel = figure.add_subplot()
            panel.plot([1.0, 2.0], label="a")
            panel.pcolormesh([[1.0, 2.0], [3.0, 4.0]])
            panel.legend()
            figure.savefig(io.BytesIO(), format="png", dpi=30)
    except SceneError:
        raise
    except Exception as error:
        raise SceneError(f"{name}: {_first_line(error)}") from None


def _check_size(key: str, value: Any, name: str) -> None:
    """Check a setting that could make a figure huge, or stop its drawing."""
    dots = key in ("figure.dpi", "savefig.dpi") and value != "figure"
    points = re.search(r"(\.|font|label|title|marker|cap)size$|width$|(\.|label|title)pad$", key)
    low, high, unit = (1, MOST_DPI, "") if dots else (0, MOST_POINTS, " points")
    if key == "font.size":
        low = 1
    elif key.endswith("pad"):
        low = -MOST_POINTS
    sized = dots or (points and isinstance(value, int | float))
    if sized and not low <= float(value) <= high:
        raise SceneError(f"{name}: {key} = {value}; must be from {low} to {high}{unit}")


def _first_line(error: Exception) -> str:
    return " ".join(str(error.args[0] if isinstance(error, KeyError) else error).split())[:200]


def with_angle_from_zero(data: xr.Dataset, options: Options) -> xr.Dataset:
    """The same archive with the crank angle as the options count it.

    SceneError refuses a range of another length than a cycle of the archive.
    """
    before, name = ZEROS[options.zero]
    if "crank_angle" not in data.coords or (options.angle is None and options.zero == "firing-tdc"):
        return data
    angle = np.asarray(data["crank_angle"].values, dtype=float)
    step = angle[1] - angle[0] if angle.size > 1 else 0.0
    period = round(float(angle[-1] - angle[0] + step), 6)
    if period not in (360.0, 720.0):
        return data
    low, high = options.angle or (0.0, period)
    if high - low != period:
        raise SceneError(
            f"angle {low:g}..{high:g}: a cycle of this archive has {period:g} degrees, such as "
            f"{-period / 2:g}..{period / 2:g} or 0..{period:g}"
        )
    counted = np.round((angle - before - low) % period, 9) % period + low
    order = np.argsort(counted, kind="stable")
    attributes = data["crank_angle"].attrs | {
        DESCRIPTION: f"crank angle, 0 at {name}",
        "zero_at": before,
    }
    moved = data.isel(crank_angle=order)
    return moved.assign_coords(crank_angle=("crank_angle", counted[order], attributes))


def with_targets(options: Options, data: xr.Dataset) -> Options:
    """Return the options with all targets in the units of an archive that is drawn.

    Raises `SceneError` for targets and choices of quantities that it has not, and wrong units.
    """
    asked = [("target", one) for one in options.targets]
    asked += [("quantities", one) for one in options.quantities]
    for what, name in asked:
        if name not in data.variables:
            names = [str(one) for one in data.variables]
            raise SceneError(
                f"{what} {shown(name)}: the archive has no such quantity{did_you_mean(name, names)}"
            )
    targets = {
        name: tuple(_in_unit(name, one, data[name].attrs.get("units", "1")) for one in given)
        for name, given in options.targets.items()
    }
    return replace(options, targets=targets)


def _in_unit(name: str, target: Target, unit: str) -> Target:
    text, number = target
    if not math.isnan(number):
        return target
    number = number_with_unit(text, f"target {name}", unit or "1")
    return f"{number:.6g}", number
