"""Figures of an archive, drawn from the Dataset alone.

Nothing here knows an engine or computes physics: a variable is drawn by its dimensions, and what
is written beside it comes from its attributes (``long_name``, ``symbol``, ``units``).

=====================  ==========================================================================
a variable over        is drawn as
=====================  ==========================================================================
nothing                a row of the table ``summary``
one axis               points joined by lines
two axes               a map with labelled contours, or lines where an axis is words or short
more axes              small multiples of these; what is left is cut at one slice, which is stated
``crank_angle``        curves, one line per value of one axis
``design``             the list of designs is taken apart into families, see `_families`
=====================  ==========================================================================

Designs without an answer (``status``) are hatched in maps and marked on the frame in curves, and
the legend names the outcome; they are never drawn as numbers.

matplotlib is imported inside functions, and always as `Figure` on the Agg canvas: pyplot keeps
figures alive and picks a backend for the whole process, which a library must not do.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from engine_dyn import status as outcome
from sweeps.errors import SceneError, did_you_mean, shown

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.colors import Colormap, Normalize
    from matplotlib.figure import Figure
    from matplotlib.legend import Legend

__all__ = ["FORMATS", "axis_label", "draw", "unit_text"]

FORMATS = ("png", "svg", "pdf")

MOST_LINES = 8  # more cannot be told apart without colour
MOST_PANELS = 9
MOST_ROWS = 45  # of a chart with a row for each case

# Dimensions that a curve runs along; all others are axes of the study.
RUNNING = ("crank_angle", "order")
# Columns of a list of designs that say how a design was computed and not what it is.
BOOKKEEPING = ("case", "start_speed", "start_angle", "passes")
# What may change together with a parameter without being a second one: a longer rod leaves
# another share of its mass to the piston (Kakaitsas 5.2.3), a stroke moves the rod of equal ratio.
FOLLOWERS = {
    "crank_ratio": ("reciprocating_mass", "rod_length"),
    "rod_length": ("reciprocating_mass", "crank_ratio"),
    "stroke": ("reciprocating_mass", "rod_length"),
}
PUBLISHED = "_published"

SOUND = (outcome.CONVERGED, outcome.PASSES_DONE)
# Made from the speed solution: what a status of "tolerance not met" speaks of.
FROM_SPEED = ("delta", "omega", "load_torque", "load_coefficient", "angular_acc", "inertia_torque_")
NO_VALUE = "no value"
HARD_SPACE = "\N{NO-BREAK SPACE}"  # keeps a unit with its symbol
EN_DASH = "\N{EN DASH}"
OWN_ORDINATES = "each panel has its own ordinate"

KINEMATICS = ("position", "velocity", "acceleration")
COMPONENTS = ("gas_torque", "inertia_torque", "friction_torque")
LOAD_LAW = ("load_exponent", "load_offset")
# Drawn on common axes where they depend on the same things.
TOGETHER = {
    "omega_extremes": ("omega_max", "omega_mean", "omega_min"),
    "torque_extremes": ("torque_max", "torque_mean", "torque_min"),
}
# What a study is made for: drawn against each of its axes, even where there is a map.
MAIN = ("delta",)

# One style for all figures, for the 7 inch width of two journal columns; sizes in points.
STYLE: dict[str, Any] = {
    "font.family": "DejaVu Sans",
    "mathtext.fontset": "dejavusans",
    "font.size": 8.0,
    "axes.titlesize": 8.0,
    "axes.labelsize": 8.0,
    "xtick.labelsize": 7.5,
    "ytick.labelsize": 7.5,
    "legend.fontsize": 7.5,
    "legend.title_fontsize": 7.5,
    "figure.titlesize": 9.5,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.titlelocation": "left",
    "axes.formatter.useoffset": False,
    "axes.formatter.limits": (-4, 6),
    "axes.formatter.use_mathtext": True,
    "grid.color": "#dcdcdc",
    "grid.linewidth": 0.5,
    "lines.linewidth": 1.2,
    "lines.markersize": 4.0,
    "lines.markeredgewidth": 0.8,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.minor.width": 0.4,
    "ytick.minor.width": 0.4,
    "legend.frameon": False,
    "legend.handlelength": 3.0,
    "hatch.linewidth": 0.5,
    "savefig.dpi": 300,
    "svg.hashsalt": "engine-dyn",  # the same archive gives the same file
}
WIDTH = 7.0
GREY = "#555555"
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "h")
DASHES: tuple[Any, ...] = (
    "-",
    (0, (6, 1.5)),
    (0, (4, 1.2, 1, 1.2)),
    (0, (1.2, 1)),
    (0, (3, 1, 1, 1, 1, 1)),
    (0, (9, 3)),
    (0, (2.5, 2)),
    (0, (5, 1, 1, 1, 1, 1, 1, 1)),
)
HATCHES = ("////", "....", "\\\\\\\\", "xxxx", "++++", "oo")
LOST_MARKERS = ("x", "+", "1", "2", "3", "4")
# Colour, dashes and width of each torque, in all figures; lightness differs as well as hue.
TORQUES: dict[str, tuple[str, Any, float]] = {
    "torque": ("#000000", "-", 1.6),
    "gas_torque": ("#d1541b", (0, (6, 1.5)), 1.2),
    "inertia_torque": ("#1b4f9c", (0, (4, 1.2, 1, 1.2)), 1.2),
    "friction_torque": ("#c79a1e", (0, (1.2, 1)), 1.4),
    "load_torque": ("#3f8f63", (0, (9, 2)), 1.4),
}

FloatArray = NDArray[np.float64]
Entries = dict[str, "Artist"]  # of a legend: text and what it explains
Plates = Iterator[tuple[str, "Figure"]]  # name of the file without its ending, and the figure


# --------------------------------------------------------------------------------- wording


def unit_text(units: str) -> str:
    """Units as they are printed: ``rad s-1`` becomes rad/s, ``kg m2`` gets its superscript.

    Parameters
    ----------
    units : str
        A unit as UDUNITS reads it, with powers as ``m2``, ``m^2`` or ``m**2``.

    Returns
    -------
    str
        Text for matplotlib; empty for a dimensionless quantity (``1``), and the text as it
        came where it is not a product of powers.
    """
    units = units.strip()
    if units in ("", "1"):
        return ""
    special = {"percent": "%", "degree": "\N{DEGREE SIGN}", "degrees": "\N{DEGREE SIGN}"}
    over: list[str] = []
    under: list[str] = []
    sign = 1
    for part in re.findall(r"/|(?:\*\*|[^\s/*.]|\.(?=\d))+", units):
        if part == "/":
            sign = -1
            continue
        match = re.fullmatch(r"([^\d\s^*+-]+)(?:\^|\*\*)?([-+]?\d+(?:\.\d+)?)?", part)
        if match is None or not match[1].strip("()"):
            return _plain(units)
        power = sign * float(match[2] or 1)
        sign = 1
        name = special.get(match[1], _plain(match[1]))
        (over if power > 0 else under).append(name + _power(abs(power)))
    if not under:
        return " ".join(over)
    below = " ".join(under)
    return (" ".join(over) or "1") + "/" + (below if len(under) == 1 else f"({below})")


def axis_label(variable: xr.Variable, key: str) -> str:
    """What stands beside an axis: long name (up to its first comma), symbol, unit.

    Parameters
    ----------
    variable : xarray.Variable
        With the attributes ``long_name``, ``symbol`` and ``units``, all optional.
    key : str
        Its name in the archive, used where there is no ``long_name``.

    Returns
    -------
    str
        For instance ``Engine speed n (rpm)``; a dash stands for dimensionless.
    """
    return _title(variable, key) + _brackets(variable)


def _title(variable: xr.Variable, key: str) -> str:
    return f"{_sentence(_name(variable, key))} {_symbol(variable)}".rstrip()


def _power(power: float) -> str:
    if power == 1:
        return ""
    if power == int(power):
        return "".join("\N{SUPERSCRIPT ZERO}¹²³⁴⁵⁶⁷⁸⁹"[int(digit)] for digit in str(int(power)))
    return f"$^{{{power:g}}}$"


def _plain(text: str) -> str:
    """Text that is not mathematics: a dollar sign must not start a formula."""
    return text.replace("$", r"\$")


def _number(value: float) -> str:
    """Four significant digits, without an exponent where it can be read without."""
    value = float(value)
    size = abs(value)
    if not np.isfinite(value):
        return EN_DASH
    if value == round(value) and size < 1e7:
        text = f"{value:.0f}"
    elif 1e-4 <= size < 1e6:
        text = f"{value:.4g}" if size < 1e4 else f"{value:.0f}"
    else:
        mantissa, _, exponent = f"{value:.3e}".partition("e")
        text = f"{float(mantissa):g}".replace("-", "\N{MINUS SIGN}")
        return text + rf"$\times 10^{{{int(exponent)}}}$"
    return text.replace("-", "\N{MINUS SIGN}")


def _shorten(text: str, most: int = 40) -> str:
    """A label of at most `most` characters; its end is kept, since cases often differ there."""
    text = " ".join(text.split())
    if len(text) > most:
        tail = most // 3
        text = text[: most - tail - 1].rstrip() + "\N{HORIZONTAL ELLIPSIS}" + text[-tail:].lstrip()
    # matplotlib leaves labels that begin with an underscore out of legends
    return _plain(f" {text}" if text.startswith("_") else text) or "(no name)"


def _wrap(text: str, most: int) -> str:
    """Break lines at spaces, never inside a formula or a bracket."""
    lines: list[str] = []
    room = 0
    for word in re.findall(r"(?:(?<!\\)\$[^$]*\$|\([^()]*\)|[^ ])+", text):
        size = len(re.sub(r"\\[a-zA-Z]+", "x", re.sub(r"[${}^_]", "", word)))
        if lines and size + 1 <= room:
            lines[-1] += " " + word
            room -= size + 1
        else:
            lines.append(word)
            room = most - size
    return "\n".join(lines)


def _sentence(text: str) -> str:
    """First letter as a capital, unless the first word is a symbol such as mN or pH."""
    return text[:1].upper() + text[1:] if text[:2].islower() else text


def _name(variable: xr.Variable, key: str) -> str:
    """The long name up to its first comma: what follows explains, and the file keeps it."""
    name = str(variable.attrs.get("long_name") or "").split(",")[0].strip()
    return _plain(name or key.replace("_", " "))


def _symbol(variable: xr.Variable) -> str:
    """The symbol if matplotlib can set it, else nothing."""
    symbol = str(variable.attrs.get("symbol", "")).strip()
    if "$" in symbol:
        from matplotlib.mathtext import MathTextParser

        try:
            MathTextParser("path").parse(symbol)
        except (ValueError, RuntimeError):
            return ""
    return symbol


def _brackets(variable: xr.Variable) -> str:
    """Unit in brackets, a dash for dimensionless, nothing where the file gives no units."""
    if "units" not in variable.attrs:
        return ""
    return f"{HARD_SPACE}({unit_text(str(variable.attrs['units'])) or EN_DASH})"


def _tag(variable: xr.Variable, key: str, value: float) -> str:
    """One value of a parameter: symbol = number unit."""
    unit = unit_text(str(variable.attrs.get("units", "")))
    space = "" if unit in ("", "\N{DEGREE SIGN}") else " "
    return f"{_symbol(variable) or _name(variable, key)} = {_number(value)}{space}{unit}"


def _slug(text: str) -> str:
    """A part of a file name."""
    return re.sub(r"[^A-Za-z0-9_.+-]+", "_", text).strip("_.") or "x"


# --------------------------------------------------------------------------------- axes


@dataclass(frozen=True)
class _Axis:
    """One dimension of an archive: its numbers or words, and how they are spoken of."""

    name: str
    values: FloatArray
    words: tuple[str, ...]  # empty for numbers
    label: str
    variable: xr.Variable
    log: bool
    remarks: tuple[str, ...] = ()  # what changes along with it
    nominal: int | None = None

    @property
    def size(self) -> int:
        return int(self.values.size)

    def text(self, index: int) -> str:
        """The value alone, for a legend that has the label as its title."""
        text = self.words[index] if self.words else _number(self.values[index])
        if self.remarks and self.remarks[index]:
            text += f", {self.remarks[index]}"
        return text

    def tag(self, index: int) -> str:
        """Name and value, for titles."""
        if self.words:
            return self.words[index]
        return _tag(self.variable, self.name, float(self.values[index]))


def _is_words(variable: xr.Variable) -> bool:
    return variable.dtype.kind in "OUS"


def _strings(variable: xr.Variable) -> list[str]:
    values = np.atleast_1d(variable.values)
    return [_shorten(v.decode() if isinstance(v, bytes) else str(v)) for v in values]


def _is_log(values: FloatArray) -> bool:
    """Whether values are spaced by ratio rather than by difference, over a wide range."""
    if values.size < 3 or not np.all(values > 0):
        return False
    values = np.sort(values)
    steps, ratios = np.diff(values), np.diff(np.log(values))
    if values[-1] < 8 * values[0] or np.any(steps == 0):
        return False
    return bool(np.std(ratios) / np.mean(ratios) < 0.8 * np.std(steps) / np.mean(steps))


def _pick(size: int, most: int, keep: int | None = None) -> list[int]:
    """At most `most` indices, evenly over all, with `keep` among them."""
    if size <= most:
        return list(range(size))
    chosen = np.unique(np.round(np.linspace(0, size - 1, most)).astype(int))
    if keep is not None and keep not in chosen:
        chosen[1 + np.argmin(np.abs(chosen[1:-1] - keep))] = keep
    return sorted(int(index) for index in chosen)


# --------------------------------------------------------------------------------- views


@dataclass(frozen=True)
class _View:
    """A Dataset whose dimensions are axes to draw along, with what has been cut away.

    `fixed` holds the slices by their former dimension, `had` the former dimensions of each
    variable, so that a title names only slices that matter to what it shows.
    """

    data: xr.Dataset
    fixed: Mapping[str, str] = field(default_factory=dict)
    had: Mapping[str, frozenset[str]] = field(default_factory=dict)
    nominal: Mapping[str, int] = field(default_factory=dict)
    remarks: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    suffix: str = ""
    caption: str = ""

    def array(self, name: str) -> xr.Variable:
        return self.data.variables[name]

    def has(self, name: str) -> bool:
        """Whether there is a variable of numbers of this name."""
        return name in self.data.data_vars and self.array(name).dtype.kind in "iufb"

    def axes(self, names: Iterable[str]) -> list[str]:
        """Axes that any of the variables has, in the order of the archive."""
        used = {dim for name in names for dim in self.array(name).dims}
        return [str(dim) for dim in self.data.sizes if dim in used and dim not in RUNNING]

    def axis(self, dim: str) -> _Axis:
        """The axis of a dimension.

        Words stand in an auxiliary coordinate (``method_name`` along ``method``, ``case`` along
        ``design``); the dimension's own coordinate then only numbers them.
        """
        data = self.data
        own = data.variables.get(dim, xr.Variable((dim,), np.arange(data.sizes[dim])))
        labels = [
            str(key)
            for key in data.coords
            if data.variables[key].dims == (dim,) and _is_words(data.variables[key])
        ]
        if dim != "design" and dim not in labels:
            # along a parameter taken out of a list of designs, the name of a case says less
            labels = [key for key in labels if key == f"{dim}_name"]
        nominal = self.nominal.get(dim)
        if labels:
            preferred = [key for key in (f"{dim}_name", dim, "case") if key in labels]
            key = (preferred or labels)[0]
            label = _sentence(_name(self.array(key), key))
            words = tuple(_strings(self.array(key)))
            numbers = np.arange(len(words), dtype=float)
            return _Axis(dim, numbers, words, label, own, False, nominal=nominal)
        values = np.asarray(own.values, dtype=float)
        remarks = self.remarks.get(dim, ())
        return _Axis(dim, values, (), axis_label(own, dim), own, _is_log(values), remarks, nominal)

    def cut(self, index: Mapping[str, int]) -> _View:
        """One slice: the dimensions of `index` are gone."""
        index = {dim: i for dim, i in index.items() if dim in self.data.sizes}
        if not index:
            return self
        return replace(
            self,
            data=self.data.isel(dict(index)),
            fixed={**self.fixed, **{dim: self.axis(dim).tag(i) for dim, i in index.items()}},
            had=self._history(),
            nominal={dim: i for dim, i in self.nominal.items() if dim not in index},
        )

    def _history(self) -> dict[str, frozenset[str]]:
        return {
            str(name): self.had.get(str(name), frozenset()) | {str(dim) for dim in variable.dims}
            for name, variable in self.data.variables.items()
        }

    def only(self, names: Iterable[str], keep: Iterable[str | None]) -> _View:
        """Cut every axis of the variables but `keep` at its default slice."""
        kept = set(keep)
        return self.cut({dim: self.default(dim) for dim in self.axes(names) if dim not in kept})

    def default(self, dim: str) -> int:
        """The slice when none is chosen: nominal design, middle number or first word."""
        if dim in self.nominal:
            return self.nominal[dim]
        axis = self.axis(dim)
        return 0 if axis.words else (axis.size - 1) // 2

    def slices(self, names: Iterable[str]) -> list[str]:
        """Texts of the slices that these variables were cut at."""
        had = {dim for name in names for dim in self.had.get(name, ())}
        return [text for dim, text in self.fixed.items() if dim in had]

    def varies(self, names: Iterable[str], dim: str) -> bool:
        """Whether any of the variables changes along an axis (looked at on its default slice)."""
        for name in names:
            if dim not in self.array(name).dims:
                continue
            array = self.only([name], [dim]).array(name)
            array = array.isel({dim: _pick(array.sizes[dim], MOST_LINES)})
            values = np.asarray(array.transpose(dim, ...).values, dtype=float)
            size = np.max(np.abs(values), where=np.isfinite(values), initial=0.0)
            if not np.allclose(values, values[:1], rtol=0.0, atol=1e-9 * size, equal_nan=True):
                return True
        return False

    def published(self, name: str) -> str | None:
        """The variable of published values beside a computed one, if in the same units."""
        other = name + PUBLISHED
        if not self.has(other) or self.array(other).dims != self.array(name).dims:
            return None
        units = self.array(name).attrs.get("units")
        return other if self.array(other).attrs.get("units", units) == units else None

    def outcomes(self, name: str, array: xr.Variable, index: Mapping[str, int]) -> NDArray[Any]:
        """For each element of a slice of a variable: "" or why it is no number to rely on."""
        values = np.asarray(array.values, dtype=float)
        lost = ~np.isfinite(values)
        said = np.where(lost, NO_VALUE, "").astype(object)
        doubtful = name.startswith(FROM_SPEED)
        if "status" not in self.data.variables or not (lost.any() or doubtful):
            return said
        status = self.array("status")
        status = status.isel({d: i for d, i in index.items() if d in status.dims})
        if set(status.dims) <= set(array.dims):
            sizes = {dim: array.sizes[dim] for dim in array.dims}
            codes = status.set_dims(sizes).transpose(*array.dims).values
            for code, text in _meanings(status).items():
                if code not in SOUND:
                    said[(codes == code) & lost] = text
            if doubtful:
                code = outcome.TOLERANCE_NOT_MET
                said[(codes == code) & ~lost] = _meanings(status)[code]
        return said


def _meanings(status: xr.Variable) -> dict[int, str]:
    """What the codes of a status variable mean, in words."""
    known = dict(enumerate(outcome.MEANINGS))
    values = np.atleast_1d(status.attrs.get("flag_values", []))
    words = str(status.attrs.get("flag_meanings", "")).split()
    known.update({int(value): word for value, word in zip(values, words, strict=False)})
    return {code: word.replace("_", " ") for code, word in known.items()}


# --------------------------------------------------------------------------------- designs


@dataclass(frozen=True)
class _Family:
    """Designs that differ in one parameter."""

    parameter: str
    members: tuple[int, ...]  # by rising value
    followers: tuple[str, ...] = ()
    differs: tuple[str, ...] = ()  # in which other parameters it is not the first design


@dataclass(frozen=True)
class _Study:
    """An archive as it is drawn: its view, and the families that its designs fall into."""

    view: _View
    base: tuple[tuple[str, _View], ...] = ()  # parameter, view in which it is an axis
    # the same, away from the nominal design, and the parameters in which it is away
    aside: tuple[tuple[str, _View, tuple[str, ...]], ...] = ()
    apart: bool = False  # some designs are in no family

    def along(self, names: Sequence[str]) -> list[tuple[_View, str | None]]:
        """Each axis that the variables can be drawn along, with the view that has it."""
        found: list[tuple[_View, str | None]] = []
        axes = self.view.axes(names)
        if "design" in axes and self.base:
            found += [(view, p) for p, view in self.base if view.varies(names, p)]
            axes.remove("design")
        found += [(self.view, axis) for axis in axes]
        return found or [(self.view.only(names, ()), None)]


def _parameters(data: xr.Dataset) -> list[str]:
    """Parameters that vary over the designs."""
    return [
        str(key)
        for key, coordinate in data.coords.items()
        if coordinate.dims == ("design",)
        and key not in ("design", *BOOKKEEPING)
        and _codes(coordinate.variable).any()
    ]


def _codes(variable: xr.Variable) -> NDArray[np.int64]:
    """Equal values get equal whole numbers (twelve digits count)."""
    if _is_words(variable):
        values = variable.values.astype(str)
    else:
        values = variable.values.astype(float)
        scale = np.max(np.abs(values), where=np.isfinite(values), initial=0.0) or 1.0
        values = np.round(values / scale, 12)
    return np.asarray(np.unique(values, return_inverse=True)[1], dtype=np.int64).reshape(-1)


def _families(data: xr.Dataset) -> list[_Family]:
    """Take a list of designs apart into families that vary one parameter.

    The first design is the nominal one. For every parameter, the designs that differ from it in
    this parameter alone (or, where there is none, in it and its `FOLLOWERS`) are a family;
    `BOOKKEEPING` columns do not count. Designs that agree in all other parameters, but elsewhere
    than the nominal one, are a family too when there are at least three of them (such as three
    inertias of an eight-cylinder engine).
    """
    names = _parameters(data)
    codes = {name: _codes(data[name].variable) for name in names}
    found: list[_Family] = []
    for name in names:
        values = data[name].variable
        for following in ((), FOLLOWERS.get(name, ())):
            alike = np.ones(data.sizes["design"], dtype=bool)
            for key in names:
                if key != name and key not in following:
                    alike &= codes[key] == codes[key][0]
            members = _distinct(values, codes[name], np.flatnonzero(alike))
            if len(members) > 1 and 0 in members:
                moved = [k for k in following if k in names and np.ptp(codes[k][list(members)])]
                found.append(_Family(name, members, tuple(moved)))
                break
        others = [codes[key] for key in names if key != name]
        if others:
            groups = np.unique(np.stack(others, axis=1), axis=0, return_inverse=True)[1].reshape(-1)
            found += _asides(values, codes, name, groups)
    return found


def _asides(
    values: xr.Variable,
    codes: Mapping[str, NDArray[np.int64]],
    name: str,
    groups: NDArray[np.int64],
) -> list[_Family]:
    """Families of a parameter that the nominal design is not in."""
    sizes = np.bincount(groups)
    found = []
    for group in np.flatnonzero(sizes >= 3):
        members = _distinct(values, codes[name], np.flatnonzero(groups == group))
        if group != groups[0] and len(members) >= 3:
            row = members[0]
            differs = [key for key in codes if key != name and codes[key][row] != codes[key][0]]
            found.append(_Family(name, members, (), tuple(differs)))
    return [found[i] for i in _pick(len(found), MOST_LINES - 1)]


def _distinct(
    values: xr.Variable, codes: NDArray[np.int64], rows: NDArray[np.intp]
) -> tuple[int, ...]:
    """The first design of each value, by rising value (words: in their own order)."""
    rows = rows[np.sort(np.unique(codes[rows], return_index=True)[1])]
    if not _is_words(values):
        numbers = values.values.astype(float)
        rows = rows[np.isfinite(numbers[rows])]
        rows = rows[np.argsort(numbers[rows], kind="stable")]
    return tuple(int(row) for row in rows)


def _family_view(view: _View, family: _Family) -> _View:
    """A family as a view in which the parameter is an axis in place of ``design``."""
    data, name, members = view.data, family.parameter, list(family.members)
    part = data.isel(design=members).swap_dims(design=name)
    remarks = tuple(
        ", ".join(_design_tag(data, key, member) for key in family.followers) for member in members
    )
    apart = [_design_tag(data, key, members[0]) for key in family.differs]
    suffix = "".join(f"_{key}_{_slug(_bare(data, key, members[0]))}" for key in family.differs)
    others = [
        _design_tag(data, key, members[0])
        for key in _parameters(data)
        if key != name and key not in family.followers
    ]
    had = {
        key: dims | {"design"} if "design" in data.variables[key].dims else dims
        for key, dims in view._history().items()
    }
    return replace(
        view,
        data=part,
        had=had,
        fixed={**view.fixed, **({"design": ", ".join(apart)} if apart else {})},
        nominal={} if apart else {**view.nominal, name: members.index(0)},
        remarks={**view.remarks, name: remarks},
        suffix=view.suffix + suffix,
        caption="Other parameters: " + ", ".join(others) if others else "",
    )


def _bare(data: xr.Dataset, key: str, design: int) -> str:
    value = data[key].variable.values[design]
    return str(value) if _is_words(data[key].variable) else f"{value:.6g}"


def _design_tag(data: xr.Dataset, key: str, design: int) -> str:
    variable = data[key].variable
    if _is_words(variable):
        return _shorten(str(variable.values[design]))
    return _tag(variable, key, float(variable.values[design]))


def _study(data: xr.Dataset, select: Mapping[str, float | str]) -> _Study:
    """Cut what was selected and what has one value, sort the axes, find the families."""
    order: dict[Hashable, Any] = {}
    for dim in data.sizes:
        own = data.variables.get(dim)
        if own is None or dim == "design" or _is_words(own):
            continue
        rising = np.argsort(own.values, kind="stable")
        if np.any(np.diff(rising) != 1):
            order[dim] = rising
    view = _View(data.isel(order) if order else data)
    view = view.cut({dim: _selected(view, dim, value) for dim, value in select.items()})
    view = view.cut({str(d): 0 for d, n in view.data.sizes.items() if n == 1 and d not in RUNNING})
    empty = [dim for dim, size in view.data.sizes.items() if size == 0]
    view = replace(view, data=view.data.drop_dims(empty))
    if "design" not in view.data.sizes:
        return _Study(view)
    base: list[tuple[str, _View]] = []
    aside: list[tuple[str, _View, tuple[str, ...]]] = []
    lonely = np.ones(view.data.sizes["design"], dtype=bool)
    listed = ", ".join(_design_tag(view.data, key, 0) for key in _parameters(view.data))
    for family in _families(view.data):
        part = _family_view(view, family)
        if family.differs:
            aside.append((family.parameter, part, family.differs))
        else:
            base.append((family.parameter, part))
        lonely[list(family.members)] = False
    caption = f"Parameters: {listed}" if base else ""
    view = replace(view, nominal={"design": 0}, caption=caption)
    return _Study(view, tuple(base), tuple(aside), bool(lonely.any()))


def _selected(view: _View, dim: str, value: float | str) -> int:
    """The index of a selected slice: the word itself, or the nearest number."""
    if dim not in view.data.sizes:
        axes = [str(name) for name in view.data.sizes]
        hint = did_you_mean(dim, axes) or f"; its axes are {', '.join(axes) or 'none'}"
        raise SceneError(f"select: the archive has no axis {shown(dim)}{hint}")
    axis = view.axis(dim)
    if isinstance(value, str):
        if axis.words and _shorten(value) in axis.words:
            return axis.words.index(_shorten(value))
        allowed = ", ".join(axis.words[:20]) if axis.words else "numbers"
        raise SceneError(f"select: {dim} is {shown(value)}, allowed: {allowed}")
    if not np.isfinite(value):
        raise SceneError(f"select: {dim} must be a finite number, not {value}")
    numbers = np.asarray(axis.variable.values if not axis.words else axis.values, dtype=float)
    return int(np.nanargmin(np.abs(numbers - float(value))))


# --------------------------------------------------------------------------------- parts


def _sheet(
    rows: int, columns: int, height: float, *, width: float = WIDTH, **share: Any
) -> tuple[Figure, list[Axes]]:
    """A figure on the Agg canvas with its panels, as a flat list by rows."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    layout = ConstrainedLayoutEngine(w_pad=0.06, h_pad=0.06)
    figure = Figure(figsize=(width, height), layout=layout)
    FigureCanvasAgg(figure)
    return figure, list(figure.subplots(rows, columns, squeeze=False, **share).ravel())


def _grid(count: int) -> tuple[int, int]:
    """Rows and columns for small multiples."""
    columns = count if count <= 3 else 2 if count == 4 else 3
    return -(-count // columns), columns


def _finish(
    figure: Figure,
    title: str,
    notes: Iterable[str] = (),
    entries: Mapping[str, Artist] | None = None,
    legend_title: str = "",
    caption: str = "",
    below: bool = False,
    spare: Sequence[Axes] = (),
) -> Figure:
    """Title, slices and the like below it, legend outside the data, caption.

    The figure grows by what they take, so that the panels keep their size. The legend goes to
    the right, below the panels, or into the room of panels that are not used.
    """
    width, height = figure.get_size_inches()
    head = [(line, 9.5, "black") for line in _wrap(title, int(width * 13.5)).split("\n")]
    said = "; ".join(note for note in notes if note)
    head += [(line, 8.0, GREY) for line in _wrap(said, int(width * 16)).split("\n") if line]
    foot = [(line, 7.0, GREY) for line in _wrap(caption, int(width * 18)).split("\n") if line]
    leading = 1.4 / 72
    top = 0.06 + sum(size * leading for _, size, _ in head)
    bottom = 0.04 + sum(size * leading for _, size, _ in foot)

    aside = under = 0.0
    legend = _legend(figure, entries or {}, legend_title, below) if entries else None
    cell = _cell(spare[0], width, height) if spare else (0.0, 0.0)
    if legend is not None and spare:
        # in one column it may fit where a panel is missing
        narrow = _legend(figure, entries or {}, legend_title, False, 22)
        if all(size < room for size, room in zip(_inches(figure, narrow), cell, strict=True)):
            legend.remove()
            legend = narrow
            spare[0].set_visible(True)
            spare[0].axis("off")
            legend.set_loc("upper left")
            legend.set_bbox_to_anchor((0, 0, 1, 1), transform=spare[0].transAxes)
        else:
            narrow.remove()
            cell = (0.0, 0.0)
    if legend is not None and not any(cell):
        wide, tall = _inches(figure, legend)
        aside, under = (0.0, tall) if below else (wide, 0.0)
        height = height + tall if below else max(height, tall)
    height += top + bottom
    figure.set_figheight(height)
    bounds = (
        0.0,
        (bottom + under) / height,
        1 - aside / width,
        1 - (top + bottom + under) / height,
    )
    figure.get_layout_engine().set(rect=bounds)  # type: ignore[call-arg, union-attr]
    if legend is not None and (aside or under):
        legend.set_loc("upper right" if aside else "lower left")
        legend.set_bbox_to_anchor((0, bottom / height, 1, 1 - (top + bottom) / height))
    for lines, start in ((head, 1 - 0.05 / height), (foot, bottom / height)):
        place = start
        for text, size, colour in lines:
            figure.text(0.07 / width, place, text, size=size, color=colour, va="top")
            place -= size * leading / height
    return figure


def _legend(
    figure: Figure, entries: Mapping[str, Artist], title: str, below: bool, most: int = 27
) -> Legend:
    """A legend of the figure that the layout does not know of."""
    texts = [_wrap(text, most) for text in entries]
    legend = figure.legend(
        list(entries.values()),
        texts,
        title=_wrap(title, most) or None,
        ncols=min(len(texts), 3) if below else 1,
        alignment="left",
        borderaxespad=0.3,
    )
    legend.get_title().set_multialignment("left")
    legend.set_in_layout(False)
    return legend


def _inches(figure: Figure, legend: Legend) -> tuple[float, float]:
    renderer = figure.canvas.get_renderer()  # type: ignore[attr-defined]
    box = legend.get_window_extent(renderer)
    return box.width / figure.dpi + 0.1, box.height / figure.dpi + 0.1


def _cell(panel: Axes, width: float, height: float) -> tuple[float, float]:
    """Inches that a panel of small multiples has, less some margin."""
    place = panel.get_subplotspec()
    if place is None:
        return 0.0, 0.0
    grid = place.get_gridspec()
    return width / grid.ncols - 0.4, height / grid.nrows - 0.3


def _shade(position: float) -> Any:
    """Colours from dark to light, so that grey print keeps their order."""
    import matplotlib

    return matplotlib.colormaps["viridis"](0.82 * position)


def _style(index: int, count: int, strong: bool = False) -> dict[str, Any]:
    """Line number `index` of `count`: lightness, dashes and marker all differ."""
    return {
        "color": _shade(index / max(count - 1, 1) if count > 1 else 0.15),
        "linestyle": DASHES[index % len(DASHES)],
        "marker": MARKERS[index % len(MARKERS)],
        "linewidth": 1.9 if strong else 1.2,
        "markerfacecolor": "white" if index % 2 else None,
    }


def _lost_handle(rank: int, colour: Any = GREY) -> Artist:
    from matplotlib.lines import Line2D

    marker = LOST_MARKERS[rank % len(LOST_MARKERS)]
    return Line2D([], [], linestyle="none", marker=marker, color=colour, markersize=5)


def _y_label(axes: Axes, text: str, height: float) -> None:
    """Label of a panel `height` inches tall, broken to fit."""
    axes.set_ylabel(_wrap(text, max(14, int(height * 13.5))))


def _left_labels(panels: Sequence[Axes], columns: int, text: str, height: float) -> None:
    for panel in panels[::columns]:
        _y_label(panel, text, height)


def _x_label(axes: Axes, text: str, width: float) -> None:
    axes.set_xlabel(_wrap(text, max(14, int(width * 14.5))))


def _value_ticks(axis: Axis, values: FloatArray, log: bool) -> None:
    """Ticks at the values of a short axis, at round numbers otherwise."""
    from matplotlib.ticker import FixedLocator, FuncFormatter, MaxNLocator, NullLocator

    places = np.sort(np.log(values) if log else values)
    span = float(np.ptp(places)) or 1.0
    if values.size <= 7 and (values.size == 1 or np.min(np.diff(places)) > 0.085 * span):
        axis.set_major_locator(FixedLocator(list(values)))
        axis.set_minor_locator(NullLocator())
        axis.set_major_formatter(FuncFormatter(lambda value, _: _number(value)))
    elif log:
        _log_ticks(axis, float(values.min()), float(values.max()))
    elif np.all(values == np.round(values)) and span < 50:
        axis.set_major_locator(MaxNLocator(integer=True))


def _log_ticks(axis: Axis, low: float, high: float, few: bool = False) -> None:
    """Ticks at 1, 2, 5 where a decade or two are shown, written as plain numbers."""
    from matplotlib.ticker import (
        FuncFormatter,
        LogFormatterMathtext,
        LogLocator,
        MaxNLocator,
        NullFormatter,
        NullLocator,
    )

    decades = np.log10(high / low)
    plain = FuncFormatter(lambda value, _: _number(value))
    if decades < 0.7:
        axis.set_major_locator(MaxNLocator(4 if few else 6))
        axis.set_minor_locator(NullLocator())
        axis.set_major_formatter(plain)
    else:
        axis.set_major_locator(
            LogLocator(subs=(1.0,) if decades > (1.6 if few else 3) else (1.0, 2.0, 5.0))
        )
        axis.set_minor_locator(LogLocator(subs=np.arange(1.0, 10.0).tolist()))
        axis.set_major_formatter(plain if decades < 5 else LogFormatterMathtext())
        axis.set_minor_formatter(NullFormatter())


def _parameter_ticks(axes: Axes, axis: _Axis, which: str, room: float) -> None:
    """Scale and ticks of a panel along an axis of the study, `room` inches long."""
    line = axes.xaxis if which == "x" else axes.yaxis
    if axis.words:
        line.set_ticks(list(axis.values), list(axis.words))
        if which == "x" and sum(len(word) + 2 for word in axis.words) > room * 14:
            axes.tick_params("x", labelrotation=35)
            for label in axes.get_xticklabels():
                label.set(ha="right", rotation_mode="anchor")
        (axes.set_xlim if which == "x" else axes.set_ylim)(-0.5, axis.size - 0.5)
        return
    if axis.log:
        (axes.set_xscale if which == "x" else axes.set_yscale)("log")
    _value_ticks(line, axis.values, axis.log)


def _free_scale(axes: Axes, values: Sequence[FloatArray]) -> None:
    """A logarithmic ordinate where positive values span more than a decade and a bit."""
    known = np.concatenate([v[np.isfinite(v)] for v in values]) if values else np.empty(0)
    if known.size and np.all(known > 0) and known.max() > 20 * known.min():
        axes.set_yscale("log")
        low, high = axes.get_ylim()
        _log_ticks(axes.yaxis, low, high)


def _crank_axis(axes: Axes, angle: xr.Variable, room: float, named: bool = True) -> None:
    """Crank angle with ticks at quarter or half turns and the dead centres by name."""
    from matplotlib.ticker import FixedLocator, FuncFormatter

    low, high = axes.get_xlim()
    four_stroke = high - low > 360 or low >= 0
    per_degree = room / max(high - low, 1.0)
    gap = " " if 180 * per_degree > 0.62 else "\n"

    def text(value: float, _: object) -> str:
        number = _number(value)
        if value % 180 or not named:
            return number
        if value % 360:
            return f"{number}\nBDC"
        if value % 720 or not four_stroke:
            return f"{number}\nTDC"
        return f"{number}\nfiring{gap}TDC"

    # a quarter turn needs some 0.45 inch for its number beside the name of a dead centre
    step = next((s for s in (90, 180, 360) if s * per_degree > (0.42 if s == 90 else 0.5)), 360)
    first = np.ceil(low / step) * step
    axes.xaxis.set_major_locator(FixedLocator(list(np.arange(first, high + 1, step))))
    axes.xaxis.set_major_formatter(FuncFormatter(text))
    for value in np.arange(np.ceil(low / 180) * 180, high + 1, 180):
        axes.axvline(value, color="#b8b8b8", linewidth=0.6, zorder=0.5)
    if named:
        _x_label(axes, axis_label(angle, "crank_angle"), room)


# --------------------------------------------------------------------------------- curves


def _trace(
    view: _View, name: str, index: Mapping[str, int], running: str
) -> tuple[FloatArray, FloatArray, str]:
    """One curve: abscissa, ordinate, and the outcome if there is no curve.

    Over the crank angle it is closed by its first point, unless the design is a number of passes
    from a starting angle: there the gap between end and start stays open.
    """
    array = view.array(name)
    array = array.isel({dim: i for dim, i in index.items() if dim in array.dims})
    x = np.asarray(view.data.variables.get(running, np.arange(array.size)), dtype=float)
    y = np.asarray(array.values, dtype=float)
    if not np.isfinite(y).any():
        said = view.outcomes(name, array, index)
        return x, y, str(said[0]) if y.size else NO_VALUE
    if running != "crank_angle" or x.size < 3:
        return x, y, ""
    period = round((x[-1] - x[0]) + (x[1] - x[0]), 6)
    if period % 360 == 0:
        x, y = np.append(x, x[0] + period), np.append(y, y[0])
        start = _start_angle(view, index) if name.startswith(FROM_SPEED) else None
        if start is not None:
            place = int(np.searchsorted(x, (start - x[0]) % period + x[0]))
            if 0 < place < x.size - 1:
                x, y = np.insert(x, place, x[place]), np.insert(y, place, np.nan)
    return x, y, ""


def _start_angle(view: _View, index: Mapping[str, int]) -> float | None:
    """Where a curve that was not run to a closed cycle begins."""
    found = []
    for name in ("status", "start_angle"):
        if name not in view.data.variables:
            return None
        array = view.array(name)
        array = array.isel({dim: i for dim, i in index.items() if dim in array.dims})
        if array.ndim or not np.isfinite(float(array.values)):
            return None
        found.append(float(array.values))
    return found[1] if found[0] == outcome.PASSES_DONE else None


def _running(view: _View, name: str) -> str:
    dims = view.array(name).dims
    return next(dim for dim in RUNNING if dim in dims)


def _curves(
    axes: Axes,
    view: _View,
    name: str,
    axis: _Axis | None,
    fixed: Mapping[str, int],
    entries: Entries,
    change: Callable[[FloatArray], FloatArray] | None = None,
) -> list[FloatArray]:
    """Lines of one variable, one per (picked) value of an axis; the ordinates are returned."""
    running = _running(view, name)
    picked = _pick(axis.size, MOST_LINES, axis.nominal) if axis else [0]
    drawn = []
    for rank, index in enumerate(picked):
        place = {**fixed, axis.name: index} if axis else fixed
        x, y, lost = _trace(view, name, place, running)
        text = axis.text(index) if axis else _title(view.array(name), name)
        nominal = axis is not None and index == axis.nominal
        if nominal:
            text += " (nominal)"
        style = _style(rank, len(picked), nominal)
        if lost:
            if axis is None or axis.name != "cylinder":  # padded to the longest engine
                entries.setdefault(f"{text}: {lost}", _lost_handle(0, style["color"]))
            continue
        if len(picked) == 1 and running == "crank_angle":
            style["marker"] = ""
        if x.size > 40:
            step = max(x.size // 8, 1)
            style["markevery"] = (rank * step // len(picked) + step // 16, step)
        (line,) = axes.plot(x, change(y) if change else y, **style)
        entries.setdefault(text, line)
        drawn.append(y)
    if running == "crank_angle":
        axes.set_xlim(float(x[0]), float(x[-1]))
    return drawn


def _said_picked(axis: _Axis | None, most: int = MOST_LINES) -> str:
    if axis is None or axis.size <= most:
        return ""
    shown_count = len(_pick(axis.size, most, axis.nominal))
    what = "cases" if axis.name == "design" else f"values of {axis.name.replace('_', ' ')}"
    return f"{shown_count} of {axis.size} {what} shown"


def _facet(view: _View, names: Sequence[str], taken: Iterable[str | None]) -> str | None:
    """The axis for small multiples: words first, else the shortest of those that are left."""
    rest = [dim for dim in view.axes(names) if dim not in set(taken)]
    rest.sort(key=lambda dim: (not view.axis(dim).words, view.data.sizes[dim]))
    return rest[0] if rest else None


def _curve_figure(view: _View, name: str, along: str | None) -> Figure:
    """One variable over the crank angle (or order): a line per value of one axis, and facets."""
    facet = _facet(view, [name], [along]) if along else None
    view = view.only([name], [along, facet])
    axis = view.axis(along) if along else None
    running = _running(view, name)
    entries: Entries = {}
    notes = [*view.slices([name]), _said_picked(axis)]
    if facet:
        across = view.axis(facet)
        picked = _pick(across.size, MOST_PANELS, across.nominal)
        rows, columns = _grid(len(picked))
        figure, panels = _sheet(rows, columns, 0.5 + 1.75 * rows, sharex=True, sharey=True)
        room, height = 5.2 / columns, 1.6
        for panel, index in zip(panels, picked, strict=False):
            _curves(panel, view, name, axis, {facet: index}, entries)
            panel.set_title(across.tag(index))
        notes.append(_said_picked(across, MOST_PANELS))
        _bare_panels(panels, len(picked), columns)
        lowest = _lowest(panels, len(picked), columns)
    else:
        figure, panels = _sheet(1, 1, 3.3)
        room, height = 5.0, 2.8
        drawn = _curves(panels[0], view, name, axis, {}, entries)
        if _far_apart(drawn):
            figure, panels = _sheet(2, 1, 4.9, sharex=True)
            height, entries = 2.2, {}
            _curves(panels[0], view, name, axis, {}, entries)
            _curves(panels[1], view, name, axis, {}, {}, _deviation)
            _y_label(panels[1], "Deviation from the mean over the cycle (%)", height)
        lowest = list(panels[-1:])
    for panel in lowest:
        _running_axis(panel, view, running, room)
    for panel in panels[: len(picked) if facet else None]:
        if panel not in lowest and running == "crank_angle":
            _crank_axis(panel, view.array(running), room, named=False)
    label = axis_label(view.array(name), name)
    if facet:
        _left_labels(panels, columns, label, height)
    else:
        _y_label(panels[0], label, height)
    title = _title(view.array(name), name)
    return _finish(
        figure,
        f"{title} by {_what(axis)}" if axis else title,
        notes,
        entries if axis else None,
        axis.label if axis else "",
        view.caption,
        spare=panels[len(picked) :] if facet else (),
    )


def _running_axis(axes: Axes, view: _View, running: str, room: float) -> None:
    if running == "crank_angle" and running in view.data.variables:
        _crank_axis(axes, view.array(running), room)
    else:
        variable = view.data.variables.get(running, xr.Variable((), 0.0))
        _x_label(axes, axis_label(variable, running), room)


def _far_apart(curves: Sequence[FloatArray]) -> bool:
    """Whether lines lie so far apart that their own swings can hardly be seen."""
    if len(curves) < 2 or not all(np.nanmin(curve) > 0 for curve in curves):
        return False
    means = [float(np.nanmean(curve)) for curve in curves]
    swings = [float(np.nanmax(curve) - np.nanmin(curve)) for curve in curves]
    return max(means) - min(means) > 1.5 * max(swings) > 0


def _deviation(values: FloatArray) -> FloatArray:
    mean = np.nanmean(values[:-1])
    return np.asarray(100 * (values / mean - 1))


def _bare_panels(panels: Iterable[Axes], count: int, columns: int) -> None:
    """Hide the panels that are left over, and give the ones above them their tick labels."""
    listed = list(panels)
    for number, panel in enumerate(listed):
        if number >= count:
            panel.set_visible(False)
        elif number + columns >= count:
            panel.tick_params(labelbottom=True)


def _lowest(panels: Iterable[Axes], count: int, columns: int) -> list[Axes]:
    return [p for number, p in enumerate(panels) if count - columns <= number < count]


# --------------------------------------------------------------------------------- the themes


def _stem(base: str, view: _View, along: str | None, alone: bool = False) -> str:
    """Name of a file: what, along which axis, and where if not at the nominal design."""
    suffix = "" if alone or along in (None, "design") else f"_{along}"
    return base + suffix + view.suffix


def _over_angle(view: _View, name: str) -> bool:
    return view.has(name) and "crank_angle" in view.array(name).dims


def _what(axis: _Axis) -> str:
    """An axis in the middle of a sentence: its key says it shortest."""
    return axis.name.replace("_", " ")


def _set_cycle(panels: Iterable[Axes], view: _View, room: float, lowest: Sequence[Axes]) -> None:
    """The whole cycle on each panel, named below the lowest ones."""
    angle = view.array("crank_angle")
    degrees = np.asarray(angle.values, dtype=float)
    step = degrees[1] - degrees[0] if degrees.size > 1 else 0.0
    for panel in panels:
        panel.set_xlim(float(degrees[0]), float(degrees[-1] + step))
        _crank_axis(panel, angle, room, named=panel in lowest)


def _stacked(
    study: _Study,
    names: Sequence[str],
    base: str,
    title: str,
    panels_of: Sequence[str],
    adjust: Callable[[Sequence[Axes], _View], None],
) -> Plates:
    """Panels above each other with one crank angle, and a line for each value of an axis."""
    found = study.along(names)
    for whole, along in found:
        view = whole.only(names, [along])
        axis = view.axis(along) if along else None
        figure, panels = _sheet(len(panels_of), 1, 0.5 + 1.6 * len(panels_of), sharex=True)
        entries: Entries = {}
        for panel, name in zip(panels, panels_of, strict=True):
            _curves(panel, view, name, axis, {}, entries)
            _y_label(panel, axis_label(view.array(name), name), 1.6)
        _set_cycle(panels, view, 5.0, panels[-1:])
        adjust(panels, view)
        heading = f"{title} by {_what(axis)}" if axis else title
        notes = [*view.slices(names), _said_picked(axis)]
        legend = axis.label if axis else ""
        yield (
            _stem(base, view, along, len(found) == 1),
            _finish(figure, heading, notes, entries if axis else {}, legend, view.caption),
        )


def _kinematics(study: _Study) -> Plates:
    """Reduced position, velocity and acceleration over one turn."""
    names = [name for name in KINEMATICS if _over_angle(study.view, name)]

    def one_turn(panels: Sequence[Axes], view: _View) -> None:
        low, high = panels[-1].get_xlim()
        if high - low > 360:  # the second turn repeats the first
            panels[-1].set_xlim(0, 360)
            for panel in panels:
                _crank_axis(panel, view.array("crank_angle"), 5.0, named=panel is panels[-1])

    if names:
        title = "Motion of the slider-crank"
        yield from _stacked(study, names, "kinematics", title, names, one_turn)


def _indicator(study: _Study) -> Plates:
    """Pressure over the crank angle, with a linear and a logarithmic ordinate."""

    def logarithmic(panels: Sequence[Axes], view: _View) -> None:
        values = view.array("pressure").values
        known = values[np.isfinite(values)]
        if known.size and known.min() > 0:
            panels[1].set_yscale("log")
            low, high = panels[1].get_ylim()
            _log_ticks(panels[1].yaxis, low, high)

    if _over_angle(study.view, "pressure"):
        panels = ["pressure", "pressure"]
        title = "Indicator diagrams"
        yield from _stacked(study, ["pressure"], "indicator_diagrams", title, panels, logarithmic)


def _torque_lines(
    panel: Axes, view: _View, names: Sequence[str], index: Mapping[str, int], entries: Entries
) -> None:
    """Torques in their own colours; friction is drawn as it acts, against the rotation."""
    for name in names:
        variable = view.array(name)
        colour, dashes, width = TORQUES[name]
        sign = -1.0 if name == "friction_torque" else 1.0
        label = ("\N{MINUS SIGN}" if sign < 0 else "") + _title(variable, name)
        style: dict[str, Any] = {"color": colour, "linestyle": dashes, "linewidth": width}
        if "crank_angle" in variable.dims:
            x, y, lost = _trace(view, name, index, "crank_angle")
        else:
            array = variable.isel({d: i for d, i in index.items() if d in variable.dims})
            x = np.asarray(view.array("crank_angle").values[[0, -1]], dtype=float)
            y = np.full(2, float(array.values))
            lost = "" if np.isfinite(y[0]) else str(view.outcomes(name, array, index))
        if lost:
            _mark_lost(panel, 0.9, colour)
            entries.setdefault(f"{label}: {lost}", _lost_handle(0, colour))
        else:
            (line,) = panel.plot(x, sign * y, **style)
            entries.setdefault(label, line)


def _mark_lost(panel: Axes, height: float, colour: Any = GREY) -> None:
    panel.plot([0.04], [height], marker=LOST_MARKERS[0], color=colour, transform=panel.transAxes)


def _components(study: _Study) -> Plates:
    """Gas, inertia and friction torque with their sum: nominal, and along each axis."""
    if not any(_over_angle(study.view, name) for name in COMPONENTS):
        return
    sums = [name for name in (*COMPONENTS, "torque") if study.view.has(name)]
    load = [name for name in ("load_torque",) if _over_angle(study.view, name)]
    title = "Components of the torque"
    view = study.view.only(sums, ())
    figure, panels = _sheet(1, 1, 3.3)
    entries: Entries = {}
    _torque_lines(panels[0], view, sums, {}, entries)
    _set_cycle(panels, view, 4.6, panels)
    _y_label(panels[0], "Torque" + _brackets(view.array(sums[0])), 2.8)
    notes = view.slices(sums)
    yield "torque_components", _finish(figure, title, notes, entries, caption=view.caption)
    for whole, along in study.along([*sums, *load]):
        if along is None:
            continue
        if whole.varies(sums, along):
            yield _components_along(whole, [*sums, *load], along, title)
        elif load and along in LOAD_LAW:
            yield _load_law(whole, sums, along, title)


def _components_along(
    whole: _View, names: Sequence[str], along: str, title: str
) -> tuple[str, Figure]:
    """Small multiples: one panel of components for each value of an axis."""
    view = whole.only(names, [along])
    axis = view.axis(along)
    picked = _pick(axis.size, 6, axis.nominal)
    rows, columns = _grid(len(picked))
    traced = [name for name in names if _over_angle(view, name)]
    share = _comparable(
        [[_trace(view, name, {along: i}, "crank_angle")[1] for name in traced] for i in picked]
    )
    figure, panels = _sheet(rows, columns, 0.5 + 1.75 * rows, sharex=True, sharey=share)
    entries: Entries = {}
    for panel, index in zip(panels, picked, strict=False):
        _torque_lines(panel, view, names, {along: index}, entries)
        panel.set_title(axis.tag(index) + (" (nominal)" if index == axis.nominal else ""))
    _bare_panels(panels, len(picked), columns)
    lowest = _lowest(panels, len(picked), columns)
    _set_cycle(panels[: len(picked)], view, 6.3 / columns, lowest)
    _left_labels(panels, columns, "Torque" + _brackets(view.array(names[0])), 1.5)
    notes = [*view.slices(names), _said_picked(axis, 6)]
    if not share:
        notes.append(OWN_ORDINATES)
    stem = _stem("torque_components", view, along)
    title = f"{title} by {_what(axis)}"
    spare = panels[len(picked) :]
    return stem, _finish(
        figure, title, notes, entries, caption=view.caption, below=True, spare=spare
    )


def _load_law(whole: _View, sums: Sequence[str], along: str, title: str) -> tuple[str, Figure]:
    """Where only the load torque changes: components once, load torque for each value."""
    view = whole.only([*sums, "load_torque"], [along])
    axis = view.axis(along)
    figure, panels = _sheet(2, 1, 4.9, sharex=True)
    entries: Entries = {}
    _torque_lines(panels[0], view, sums, {along: axis.nominal or 0}, entries)
    lines: Entries = {}
    _curves(panels[1], view, "load_torque", axis, {}, lines)
    _set_cycle(panels, view, 4.6, panels[-1:])
    _y_label(panels[0], "Torque" + _brackets(view.array(sums[0])), 2.0)
    _y_label(panels[1], axis_label(view.array("load_torque"), "load_torque"), 2.0)
    panels[0].set_title(f"the same for every {_what(axis)}")
    for text, line in lines.items():
        sign = "" if axis.words else f"{_symbol(axis.variable) or _what(axis)} = "
        entries[f"Load torque, {sign}{text}"] = line
    notes = [*view.slices([*sums, "load_torque"]), _said_picked(axis)]
    stem = _stem("torque_components", view, along)
    return stem, _finish(figure, f"{title} by {_what(axis)}", notes, entries, caption=view.caption)


def _torque_and_speed(study: _Study) -> Plates:
    """Total torque, load torque and, on the other side, the speed that comes of them."""
    names = ["torque", "load_torque", "omega"]
    if not all(_over_angle(study.view, name) for name in ("torque", "omega")):
        return
    names = [name for name in names if _over_angle(study.view, name)]
    view = study.view.only(names, ())
    figure, panels = _sheet(1, 1, 3.3)
    left = panels[0]
    right = left.twinx()
    entries: Entries = {}
    torques = [name for name in names if name != "omega"]
    _torque_lines(left, view, torques, {}, entries)
    x, torque, _ = _trace(view, "torque", {}, "crank_angle")
    if "load_torque" in names:
        # the load may have a gap where the passes start: interpolated for the shading alone
        angle, load, lost = _trace(view, "load_torque", {}, "crank_angle")
        if not lost:
            known = np.isfinite(load)
            load = np.interp(x, angle[known], load[known])
            above = left.fill_between(
                x, torque, load, where=torque > load, interpolate=True, color="#d9d9d9", linewidth=0
            )
            below = left.fill_between(
                x,
                torque,
                load,
                where=torque < load,
                interpolate=True,
                facecolor="white",
                edgecolor="#bdbdbd",
                hatch="////",
                linewidth=0,
            )
            entries["Excess of work: speed rises"] = above
            entries["Lack of work: speed falls"] = below
    x, speed, lost = _trace(view, "omega", {}, "crank_angle")
    label = _title(view.array("omega"), "omega") + " (right)"
    if lost:
        _mark_lost(left, 0.9)
        entries[f"{label}: {lost}"] = _lost_handle(0)
        right.set_yticks([])
    else:
        (line,) = right.plot(x, speed, color="#7b2d8b", linestyle=(0, (3, 1)), linewidth=1.6)
        entries[label] = line
        right.margins(y=0.15)
    right.grid(False)
    right.spines["right"].set_visible(True)
    _set_cycle(panels, view, 4.4, panels)
    _y_label(left, "Torque" + _brackets(view.array("torque")), 2.8)
    _y_label(right, axis_label(view.array("omega"), "omega"), 2.8)
    notes = view.slices(names)
    yield (
        "torque_and_speed",
        _finish(
            figure,
            "Torque, load torque and speed",
            notes,
            entries,
            caption=view.caption,
            below=True,
        ),
    )


def _cylinders(study: _Study) -> Plates:
    """Engines of different numbers of cylinders: torque beside speed, a row for each."""
    names = [name for name in ("torque", "omega") if _over_angle(study.view, name)]
    if len(names) < 2:
        return
    for whole, along in study.along(names):
        if along != "cylinders":
            continue
        view = whole.only(names, [along])
        axis = view.axis(along)
        picked = _pick(axis.size, 6, axis.nominal)
        figure, panels = _sheet(len(picked), 2, 0.8 + 1.15 * len(picked), sharex=True, sharey="col")
        entries: Entries = {}
        for row, index in enumerate(picked):
            for panel, name in zip(panels[2 * row :], names, strict=False):
                x, y, lost = _trace(view, name, {along: index}, "crank_angle")
                panel.set_title(axis.tag(index) + (f": {lost}" if lost else ""))
                if lost:
                    _mark_lost(panel, 0.85)
                    continue
                panel.plot(x, y, color="black", linewidth=1.1)
                mean = float(np.nanmean(y[:-1]))
                line = panel.axhline(mean, color="#c05a1c", linewidth=0.9, linestyle=DASHES[1])
                entries["Mean over the cycle"] = line
        _set_cycle(panels, view, 3.0, panels[-2:])
        for panel, name in zip(panels[:2], names, strict=True):
            text = axis_label(view.array(name), name)
            panel.set_title(f"{text}\n{panel.get_title(loc='left')}", linespacing=1.5)
        notes = [*view.slices(names), _said_picked(axis, 6)]
        title = "Torque and speed for different numbers of cylinders"
        yield (
            _stem("cylinders", view, None),
            _finish(figure, title, notes, entries, caption=view.caption, below=True),
        )


# --------------------------------------------------------------------------------- numbers


@dataclass(frozen=True)
class _Line:
    """Numbers along an axis, what is wrong with each ("" nothing), and published ones beside."""

    text: str
    y: FloatArray
    said: NDArray[Any]
    published: FloatArray | None
    x: FloatArray | None = None  # if not the axis's own values
    strong: bool = False


def _line(view: _View, name: str, index: Mapping[str, int], text: str, **more: Any) -> _Line:
    """One line of a variable: all axes but one are fixed by `index`."""
    array = view.array(name)
    array = array.isel({dim: i for dim, i in index.items() if dim in array.dims})
    other = view.published(name)
    published = None
    if other is not None:
        beside = view.array(other)
        beside = beside.isel({dim: i for dim, i in index.items() if dim in beside.dims})
        published = np.asarray(beside.values, dtype=float)
    values = np.asarray(array.values, dtype=float)
    return _Line(text, values, view.outcomes(name, array, index), published, **more)


def _points(panel: Axes, axis: _Axis, lines: Sequence[_Line], entries: Entries) -> None:
    """Numbers along an axis as joined points; lost designs are marked on the frame."""
    for rank, line in enumerate(lines):
        style = _style(rank, len(lines), line.strong and len(lines) > 1)
        if axis.words:
            style["linestyle"] = "none"
        x = axis.values if line.x is None else line.x
        if x.size > 60:
            style["markevery"] = max(x.size // 20, 1)
        y = np.where(np.isfinite(line.y), line.y, np.nan)
        (drawn,) = panel.plot(x, y, **style)
        entries.setdefault(line.text, drawn)
        if line.published is not None and np.isfinite(line.published).any():
            look = {"linestyle": "none", "marker": "o", "markersize": 7.5, "color": style["color"]}
            (beside,) = panel.plot(x, line.published, markerfacecolor="none", **look)
            single = len(lines) == 1
            entries.setdefault("Published" if single else f"{line.text}, published", beside)
        for number, why in enumerate(sorted({str(said) for said in line.said if said})):
            places = line.said == why
            marker = LOST_MARKERS[number % len(LOST_MARKERS)]
            look = {"linestyle": "none", "marker": marker, "markersize": 6.0, "clip_on": False}
            if np.isfinite(y[places]).any():  # a number, though not to the tolerance
                look |= {"marker": "s", "markersize": 9.0, "markerfacecolor": "none"}
                height, where = y[places], panel.transData
            else:
                height, where = np.zeros(int(places.sum())), panel.get_xaxis_transform()
            (cross,) = panel.plot(
                x[places], height, color=style["color"], transform=where, zorder=5, **look
            )
            entries.setdefault(_sentence(why), cross)


def _scalar_label(view: _View, names: Sequence[str]) -> str:
    """Label for one variable, or for several of one kind: what their long names share."""
    if len(names) == 1:
        return axis_label(view.array(names[0]), names[0])
    words = [re.findall(r"\w+", _name(view.array(n), n).lower()) for n in names]
    common = [word for word in words[0] if all(word in other for other in words[1:])]
    common = [word for word in common if word not in ("of", "the", "in", "over", "at", "a")]
    text = " ".join(common) or names[0].split("_")[0].replace("_", " ")
    return _sentence(text) + _brackets(view.array(names[0]))


def _scalar_figure(
    view: _View,
    names: Sequence[str],
    along: str,
    over: str | None = None,
    facet: str | None = None,
    more: Sequence[_Line] = (),
    text: str = "Computed",
) -> Figure:
    """Numbers against one axis: a line for each variable, or for each value of a second axis."""
    view = view.only(names, [along, over, facet])
    axis = view.axis(along)
    across = view.axis(facet) if facet else None
    other = view.axis(over) if over else None
    panels_at = _pick(across.size, MOST_PANELS, across.nominal) if across else [0]
    rows, columns = _grid(len(panels_at))
    height = 3.3 if rows * columns == 1 else 0.5 + 1.85 * rows
    figure, panels = _sheet(rows, columns, height, sharex=True, sharey=True)
    entries: Entries = {}
    room = 5.0 / columns
    picked = _pick(other.size, MOST_LINES, other.nominal) if other else [0]
    every = []
    for panel, place in zip(panels, panels_at, strict=False):
        at = {facet: place} if facet else {}
        if over and other:
            lines = [
                _line(view, names[0], {**at, over: i}, other.text(i), strong=i == other.nominal)
                for i in picked
            ]
        elif len(names) == 1:
            lines = [_line(view, names[0], at, text, strong=True), *more]
        else:
            lines = [_line(view, name, at, _title(view.array(name), name)) for name in names]
        _points(panel, axis, lines, entries)
        every += [line.y for line in lines]
        if across:
            panel.set_title(across.tag(place))
    for panel in panels[: len(panels_at)]:
        _parameter_ticks(panel, axis, "x", room)
        _free_scale(panel, every)
    _bare_panels(panels, len(panels_at), columns)
    for panel in _lowest(panels, len(panels_at), columns):
        _x_label(panel, axis.label, room)
    label = _scalar_label(view, names)
    if facet:
        _left_labels(panels, columns, label, 1.6)
    else:
        _y_label(panels[0], label, 2.8)
    notes = [*view.slices(names), _said_picked(other), _said_picked(across, MOST_PANELS)]
    lonely = list(entries) == ["Computed"]
    return _finish(
        figure,
        f"{label.split(HARD_SPACE)[0]} against {_what(axis)}",
        notes,
        {} if lonely else entries,
        other.label if other else "",
        view.caption,
        spare=panels[len(panels_at) :],
    )


def _edges(axis: _Axis) -> FloatArray:
    """Borders of cells around the values of an axis, half way on its scale."""
    places = np.log(axis.values) if axis.log else axis.values
    if places.size == 1:
        return np.array([places[0] - 0.5, places[0] + 0.5])
    middle = (places[1:] + places[:-1]) / 2
    ends = places[0] - (middle[0] - places[0]), places[-1] + (places[-1] - middle[-1])
    borders = np.concatenate(([ends[0]], middle, [ends[1]]))
    return np.exp(borders) if axis.log else borders


def _levels(values: FloatArray, log: bool) -> FloatArray:
    """Round values for contours, strictly inside the range."""
    from matplotlib.ticker import MaxNLocator

    low, high = float(values.min()), float(values.max())
    if log:
        decades = np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)) + 1)
        for steps in ((1.0,), (1.0, 3.0), (1.0, 2.0, 5.0), (1.0, 1.5, 2.0, 3.0, 5.0, 7.0)):
            levels = np.sort(np.outer(10.0**decades, steps).ravel())
            levels = levels[(levels > low) & (levels < high)]
            if levels.size >= 5:
                return np.asarray(levels)
    levels = np.asarray(MaxNLocator(8, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high))
    return np.asarray(levels[(levels > low) & (levels < high)], dtype=float)


def _light_map() -> Colormap:
    """Light to middle tones, darker for more: black contours and hatching can be seen on it."""
    import matplotlib
    from matplotlib.colors import ListedColormap

    return ListedColormap(matplotlib.colormaps["YlGnBu"](np.linspace(0.04, 0.72, 256)))


def _map_figure(view: _View, name: str, along: str, up: str, facet: str | None = None) -> Figure:
    """A variable over two axes: colours with labelled contours; designs without one hatched."""
    from matplotlib.colors import LogNorm, Normalize

    view = view.only([name], [along, up, facet])
    x, y = view.axis(along), view.axis(up)
    across = view.axis(facet) if facet else None
    places = _pick(across.size, MOST_PANELS, across.nominal) if across else [0]
    rows, columns = _grid(len(places))
    array = view.array(name)
    if facet:
        array = array.isel({facet: places})
    array = array.transpose(*([facet] if facet else []), up, along)
    values = np.asarray(array.values, dtype=float).reshape(-1, y.size, x.size)
    said = xr.Variable(view.array(name).dims, view.outcomes(name, view.array(name), {}))
    if facet:
        said = said.isel({facet: places})
    reasons = said.transpose(*array.dims).values.reshape(values.shape)
    known = values[np.isfinite(values)]
    norm: Normalize = Normalize(0, 1)
    if known.size:
        low, high = float(known.min()), float(known.max())
        log = low > 0 and high > 20 * low
        norm = LogNorm(low, high) if log else Normalize(low, high if high > low else low + 1)
    levels = _levels(known, isinstance(norm, LogNorm)) if known.size else np.empty(0)
    height = 3.9 if rows * columns == 1 else 0.6 + (2.2 if columns == 2 else 1.85) * rows
    figure, panels = _sheet(rows, columns, height, sharex=True, sharey=True)
    whys = sorted({str(why) for why in reasons.ravel() if why})
    room = 5.4 / columns
    for panel, table, why in zip(panels, values, reasons, strict=False):
        _map_panel(panel, x, y, table, why, whys, norm, levels)
        _parameter_ticks(panel, x, "x", room)
        _parameter_ticks(panel, y, "y", height / rows)
    for panel, place in zip(panels, places, strict=False):
        if across:
            panel.set_title(across.tag(place))
    _bare_panels(panels, len(places), columns)
    for panel in _lowest(panels, len(places), columns):
        _x_label(panel, x.label, room)
    for panel in panels[::columns]:
        _y_label(panel, y.label, height / rows * 0.75)
    if known.size:
        _colour_bar(figure, panels[: len(places)], norm, levels, axis_label(array, name), height)
    notes = [*view.slices([name]), _said_picked(across, MOST_PANELS)]
    title = f"{_title(array, name)} over {_what(x)} and {_what(y)}"
    return _finish(figure, title, notes, _hatches(whys), caption=view.caption, below=True)


def _map_panel(
    panel: Axes,
    x: _Axis,
    y: _Axis,
    table: FloatArray,
    why: NDArray[Any],
    whys: Sequence[str],
    norm: Normalize,
    levels: FloatArray,
) -> None:
    """Cells for designs, contours through their middles, hatching for what is lost."""
    panel.grid(False)
    edges = _edges(x), _edges(y)
    lost = ~np.isfinite(table)
    masked = np.ma.masked_array(table, lost)
    panel.pcolormesh(*edges, masked, norm=norm, cmap=_light_map(), rasterized=True)
    inside = table[~lost]
    if min(table.shape) > 1 and inside.size:
        levels = levels[(levels > inside.min()) & (levels < inside.max())]
        if levels.size:
            lines = panel.contour(
                x.values, y.values, masked, levels, colors="black", linewidths=0.7, linestyles="-"
            )
            panel.clabel(lines, fmt=_number, fontsize=6.5, inline_spacing=3)
    for number, reason in enumerate(whys):
        where = why == reason
        if not where.any():
            continue
        if lost[where].all():
            _hatch(panel, *edges, where, HATCHES[number % len(HATCHES)])
        else:
            rows, columns = np.nonzero(where)
            panel.plot(x.values[columns], y.values[rows], **_doubt())


def _hatch(
    panel: Axes,
    x: FloatArray,
    y: FloatArray,
    where: NDArray[Any],
    hatch: str,
    ground: str = "white",
) -> None:
    """Hatch cells of a map; neighbours in a row are one rectangle."""
    from matplotlib.collections import PolyCollection

    boxes = []
    for row, cells in enumerate(where):
        turns = np.flatnonzero(np.diff(np.concatenate(([0], cells.astype(int), [0]))))
        for left, right in turns.reshape(-1, 2):
            corners = [(left, row), (right, row), (right, row + 1), (left, row + 1)]
            boxes.append([(x[i], y[j]) for i, j in corners])
    look: dict[str, Any] = {"facecolors": ground, "edgecolors": GREY, "linewidths": 0.0}
    panel.add_collection(PolyCollection(boxes, hatch=hatch or None, **look))


def _doubt() -> dict[str, Any]:
    """Marks of designs that missed the tolerance."""
    return {
        "linestyle": "none",
        "marker": "s",
        "markersize": 4.0,
        "markerfacecolor": "none",
        "markeredgecolor": "black",
        "markeredgewidth": 0.6,
    }


def _hatches(whys: Sequence[str]) -> Entries:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    doubtful = outcome.MEANINGS[outcome.TOLERANCE_NOT_MET].replace("_", " ")
    return {
        _sentence(why): Line2D([], [], **_doubt())
        if why == doubtful
        else Patch(
            facecolor="white",
            edgecolor=GREY,
            hatch=HATCHES[number % len(HATCHES)],
            linewidth=0.5,
        )
        for number, why in enumerate(whys)
    }


def _colour_bar(
    figure: Figure,
    panels: Sequence[Axes],
    norm: Normalize,
    levels: FloatArray,
    label: str,
    height: float,
) -> None:
    """Colour bar with the contours on it, ticks at their levels."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.ticker import NullLocator

    mappable = ScalarMappable(norm, _light_map())
    bar = figure.colorbar(mappable, ax=list(panels), aspect=28, pad=0.02)
    bar.outline.set_linewidth(0.6)
    bar.set_label(_wrap(label, int(height * 9)))
    if levels.size:
        bar.set_ticks(list(levels), labels=[_number(level) for level in levels])
        bar.ax.yaxis.set_minor_locator(NullLocator())
        for level in levels:
            bar.ax.axhline(level, color="black", linewidth=0.7)


def _field(view: _View, name: str) -> Plates:
    """A number over the axes of a study: line, map, or small multiples of them."""
    axes = view.axes([name])
    wide = [dim for dim in axes if not view.axis(dim).words and view.data.sizes[dim] >= 3]
    stem = name
    if len(wide) >= 2:
        # the two longest, in the order of the archive
        chosen = sorted(wide, key=lambda dim: -view.data.sizes[dim])[:2]
        along, up = (dim for dim in axes if dim in chosen)
        facet = _facet(view, [name], (along, up))
        stem += f"_map_{along}_{up}" + (f"_by_{facet}" if facet else "")
        yield stem + view.suffix, _map_figure(view, name, along, up, facet)
        if name not in MAIN:
            return
        for dim in wide:
            over = min((d for d in axes if d != dim), key=lambda d: view.data.sizes[d])
            yield f"{name}_{dim}{view.suffix}", _scalar_figure(view, [name], dim, over)
        return
    numbers = [dim for dim in axes if not view.axis(dim).words] or axes
    along = max(numbers, key=lambda dim: view.data.sizes[dim])
    second = _facet(view, [name], (along,))
    facet = _facet(view, [name], (along, second)) if second else None
    stem += f"_{along}" + (f"_by_{facet}" if facet else "")
    yield stem + view.suffix, _scalar_figure(view, [name], along, second, facet)


def _groups(view: _View, names: Sequence[str]) -> list[tuple[str, list[str]]]:
    """Variables that share axes, by the name of their figure; all others alone."""
    groups: list[tuple[str, list[str]]] = []
    taken: set[str] = set()
    for stem, members in TOGETHER.items():
        found = [name for name in members if name in names]
        alike = {(view.array(n).dims, view.array(n).attrs.get("units")) for n in found}
        if len(found) > 1 and len(alike) == 1:
            groups.append((stem, found))
            taken |= set(found)
    return groups + [(name, [name]) for name in names if name not in taken]


def _numbers(study: _Study, names: Sequence[str]) -> Plates:
    """All variables without a running dimension."""
    single = [name for name in names if not study.view.axes([name])]
    if len(single) > 1:
        yield "summary", _summary(study.view, single)
    for stem, group in _groups(study.view, [name for name in names if name not in single]):
        axes = study.view.axes(group)
        if "design" in axes:
            yield from _over_designs(study, stem, group, axes)
        elif len(axes) == 1:
            yield f"{stem}_{axes[0]}{study.view.suffix}", _scalar_figure(study.view, group, axes[0])
        else:
            for name in group:
                yield from _field(study.view, name)


def _over_designs(study: _Study, stem: str, group: Sequence[str], axes: Sequence[str]) -> Plates:
    """Variables over a list of designs: along each parameter that has a family."""
    if len(axes) > 1:
        if study.base:
            for (_, view), name in ((pair, name) for pair in study.base for name in group):
                yield from _field(view, name)
        else:
            for name in group:
                yield from _field(study.view, name)
        return
    if study.base:
        if group[0] in MAIN:
            for parameter, view in study.base:
                yield _stem(group[0], view, parameter), _family_figure(study, group[0], parameter)
        else:
            families = [(p, view) for p, view in study.base if view.varies(group, p)]
            if families:
                yield stem, _family_panels(study.view, group, families)
    if not study.base or (group[0] in MAIN and study.apart):
        size = study.view.data.sizes["design"]
        parameters = [
            key for key in _parameters(study.view.data) if not _is_words(study.view.array(key))
        ]
        if size <= MOST_ROWS or not parameters:
            yield f"{stem}_cases", _case_chart(study.view, group)
        else:
            yield f"{stem}_cases", _scatter(study.view, group, parameters)


def _family_figure(study: _Study, name: str, parameter: str) -> Figure:
    """One variable against one parameter, with the families that lie elsewhere."""
    view = dict(study.base)[parameter]
    aside = [(other, keys) for key, other, keys in study.aside if key == parameter]
    more = [
        _line(other, name, {}, other.fixed["design"], x=other.axis(parameter).values)
        for other, _ in aside
    ]
    apart = dict.fromkeys(key for _, keys in aside for key in keys)
    tags = ", ".join(_design_tag(study.view.data, key, 0) for key in apart)
    text = f"{tags} (nominal)" if more else "Computed"
    return _scalar_figure(view, [name], parameter, more=more, text=text)


def _family_panels(
    view: _View, group: Sequence[str], families: Sequence[tuple[str, _View]]
) -> Figure:
    """Small multiples: the same variables along one parameter after the other."""
    picked = families[:MOST_PANELS]
    lines = [
        [
            _line(
                family, name, {}, _title(family.array(name), name) if len(group) > 1 else "Computed"
            )
            for name in group
        ]
        for _, family in picked
    ]
    ordinates = [[line.y for line in some] for some in lines]
    share = _comparable(ordinates)
    rows, columns = _grid(len(picked))
    figure, panels = _sheet(rows, columns, 2.05 * rows, sharey=share)
    entries: Entries = {}
    for panel, (parameter, family), some in zip(panels, picked, lines, strict=False):
        _points(panel, family.axis(parameter), some, entries)
    for panel, (parameter, family), own in zip(panels, picked, ordinates, strict=False):
        axis = family.axis(parameter)
        _free_scale(panel, [y for each in ordinates for y in each] if share else own)
        _parameter_ticks(panel, axis, "x", 5.4 / columns)
        _x_label(panel, axis.label, 5.4 / columns)
    for panel in panels[len(picked) :]:
        panel.set_visible(False)
    label = _scalar_label(view, group)
    _left_labels(panels, columns, label, 1.5)
    notes = [*view.slices(group), "" if share else OWN_ORDINATES]
    if list(entries) == ["Computed"]:
        entries = {}
    return _finish(
        figure,
        f"{label.split(HARD_SPACE)[0]}, one parameter varied at a time",
        notes,
        entries,
        caption=view.caption,
        below=True,
        spare=panels[len(picked) :],
    )


def _comparable(panels: Sequence[Sequence[FloatArray]]) -> bool:
    """Whether panels can have one ordinate without being flattened by the widest of them."""
    known = [
        values[np.isfinite(values)]
        for values in (np.concatenate([np.ravel(y) for y in panel]) for panel in panels)
    ]
    known = [values for values in known if values.size]
    if not known:
        return True
    every = np.concatenate(known)
    if every.min() > 0 and every.max() > 20 * every.min():
        known, every = [np.log(values) for values in known], np.log(every)
    return bool(np.median([np.ptp(values) for values in known]) > 0.2 * np.ptp(every))


def _case_chart(view: _View, group: Sequence[str]) -> Figure:
    """Unrelated designs: a row for each."""
    axis = view.axis("design")
    rows = [axis.tag(i) if axis.words else _number(axis.values[i]) for i in range(axis.size)]
    picked = _pick(axis.size, MOST_ROWS)
    figure, panels = _sheet(1, 1, 0.7 + 0.2 * len(picked))
    panel = panels[0]
    entries: Entries = {}
    for rank, name in enumerate(group):
        line = _line(
            view, name, {}, _title(view.array(name), name) if len(group) > 1 else "Computed"
        )
        style = _style(rank, len(group)) | {"linestyle": "none"}
        y = np.arange(len(picked))
        (drawn,) = panel.plot(line.y[picked], y, **style)
        entries[line.text] = drawn
        if line.published is not None and np.isfinite(line.published).any():
            (beside,) = panel.plot(
                line.published[picked],
                y,
                "o",
                markersize=8,
                markerfacecolor="none",
                color=style["color"],
            )
            entries.setdefault("Published", beside)
        for number, why in enumerate(sorted({str(said) for said in line.said if said})):
            places = np.flatnonzero(line.said[picked] == why)
            if np.isfinite(line.y[picked][places]).any():
                continue
            marker = LOST_MARKERS[number % len(LOST_MARKERS)]
            (cross,) = panel.plot(
                np.full(places.size, 0.01),
                places,
                marker=marker,
                linestyle="none",
                color=GREY,
                transform=panel.get_yaxis_transform(),
                markersize=6.0,
            )
            entries.setdefault(_sentence(why), cross)
    panel.set_yticks(range(len(picked)), [rows[i] for i in picked])
    panel.set_ylim(len(picked) - 0.5, -0.5)
    label = _scalar_label(view, group)
    _x_label(panel, label, 4.5)
    notes = [*view.slices(group), _said_picked(axis, MOST_ROWS)]
    if list(entries) == ["Computed"]:
        entries = {}
    return _finish(figure, f"{label.split(HARD_SPACE)[0]}, case by case", notes, entries)


def _scatter(view: _View, group: Sequence[str], parameters: Sequence[str]) -> Figure:
    """Many unrelated designs: the variable against each parameter."""
    drawn = list(parameters)[:MOST_PANELS]
    rows, columns = _grid(len(drawn))
    height = 2.05 * rows
    figure, panels = _sheet(rows, columns, height, sharey=True)
    entries: Entries = {}
    size = view.data.sizes["design"]
    picked = _pick(size, 5000)
    lines = [
        _line(view, name, {}, _title(view.array(name), name) if len(group) > 1 else "Computed")
        for name in group
    ]
    for panel, parameter in zip(panels, drawn, strict=False):
        variable = view.array(parameter)
        x = np.asarray(variable.values, dtype=float)[picked]
        for rank, line in enumerate(lines):
            colour = _style(rank, len(lines))["color"]
            (dots,) = panel.plot(
                x, line.y[picked], ".", color=colour, markersize=2.5, rasterized=True
            )
            entries.setdefault(line.text, dots)
            for number, why in enumerate(sorted({str(said) for said in line.said if said})):
                places = (line.said[picked] == why) & ~np.isfinite(line.y[picked])
                (ticks,) = panel.plot(
                    x[places],
                    np.zeros(places.sum()),
                    linestyle="none",
                    color=GREY,
                    marker=LOST_MARKERS[number % len(LOST_MARKERS)],
                    clip_on=False,
                    transform=panel.get_xaxis_transform(),
                    rasterized=True,
                )
                entries.setdefault(_sentence(why), ticks)
        known = np.unique(x[np.isfinite(x)])
        if _is_log(known):
            panel.set_xscale("log")
            _log_ticks(panel.xaxis, known[0], known[-1])
        _free_scale(panel, [line.y for line in lines])
        _x_label(panel, axis_label(variable, parameter), 5.4 / columns)
    for panel in panels[len(drawn) :]:
        panel.set_visible(False)
    label = _scalar_label(view, group)
    _left_labels(panels, columns, label, 1.6)
    notes = list(view.slices(group))
    if len(picked) < size:
        notes.append(f"{len(picked)} of {size} designs shown")
    if list(entries) == ["Computed"]:
        entries = {}
    title = f"{label.split(HARD_SPACE)[0]}, all designs"
    spare = panels[len(drawn) :]
    return _finish(figure, title, notes, entries, below=True, spare=spare)


def _summary(view: _View, names: Sequence[str]) -> Figure:
    """Single numbers as a table."""
    listed = list(names)[:MOST_ROWS]
    figure, panels = _sheet(1, 1, 0.3 + 0.2 * len(listed))
    panel = panels[0]
    panel.axis("off")
    panel.set(xlim=(0, 1), ylim=(len(listed) + 0.5, -0.7))
    for row, name in enumerate(listed):
        variable = view.array(name)
        value = float(variable.values)
        if name == "status":
            said = _meanings(variable).get(int(value), _number(value))
        elif np.isfinite(value):
            said = f"{_number(value)} {unit_text(str(variable.attrs.get('units', '')))}"
        else:
            said = str(view.outcomes(name, variable, {}))
        cells = [
            _wrap(_sentence(_name(variable, name)), 70).split("\n")[0],
            _symbol(variable),
            said,
        ]
        for x, text in zip((0.0, 0.62, 0.74), cells, strict=True):
            panel.text(x, row, text, va="center")
        panel.axhline(row + 0.5, color="#dcdcdc", linewidth=0.5)
    return _finish(figure, "Summary", view.slices(listed), caption=view.caption)


def _status(study: _Study) -> Plates:
    """What became of the designs, where two axes or more tell something about it."""
    from matplotlib.patches import Patch

    if not study.view.has("status"):
        return
    view = study.view
    axes = [dim for dim in view.axes(["status"]) if dim != "design"]
    codes = view.array("status").values
    if len(axes) < 2 or np.isin(codes, SOUND).all():
        return
    numeric = [dim for dim in axes if not view.axis(dim).words]
    pool = numeric if len(numeric) >= 2 else axes
    chosen = sorted(pool, key=lambda dim: -view.data.sizes[dim])[:2]
    along, up = (dim for dim in axes if dim in chosen)
    facet = _facet(view, ["status"], (along, up))
    view = view.only(["status"], [along, up, facet])
    x, y = view.axis(along), view.axis(up)
    across = view.axis(facet) if facet else None
    places = _pick(across.size, MOST_PANELS, across.nominal) if across else [0]
    rows, columns = _grid(len(places))
    height = 3.9 if rows * columns == 1 else 0.6 + 1.85 * rows
    figure, panels = _sheet(rows, columns, height, sharex=True, sharey=True)
    meanings = _meanings(view.array("status"))
    present = [int(code) for code in np.unique(codes)]
    lost = [code for code in present if code not in SOUND]
    greys = {code: str(0.97 - 0.09 * rank) for rank, code in enumerate(present)}
    room = 6.0 / columns
    for panel, place in zip(panels, places, strict=False):
        array = view.array("status")
        array = array.isel({facet: place}) if facet else array
        table = array.transpose(up, along).values
        panel.grid(False)
        for code in present:
            hatch = HATCHES[lost.index(code) % len(HATCHES)] if code in lost else ""
            _hatch(panel, _edges(x), _edges(y), table == code, hatch, greys[code])
        _parameter_ticks(panel, x, "x", room)
        _parameter_ticks(panel, y, "y", height / rows)
        panel.set_xlim(*_edges(x)[[0, -1]].tolist())
        panel.set_ylim(*_edges(y)[[0, -1]].tolist())
        if across:
            panel.set_title(across.tag(place))
    _bare_panels(panels, len(places), columns)
    for panel in _lowest(panels, len(places), columns):
        _x_label(panel, x.label, room)
    for panel in panels[::columns]:
        _y_label(panel, y.label, height / rows * 0.75)
    entries: Entries = {
        f"{_sentence(meanings.get(code, str(code)))} ({np.mean(codes == code):.1%})": Patch(
            facecolor=greys[code],
            edgecolor=GREY,
            hatch=HATCHES[lost.index(code) % len(HATCHES)] if code in lost else "",
            linewidth=0.5,
        )
        for code in present
    }
    notes = [*view.slices(["status"]), _said_picked(across, MOST_PANELS)]
    title = f"Outcome of the designs over {_what(x)} and {_what(y)}"
    stem = "status" + (f"_by_{facet}" if facet else "")
    yield stem, _finish(figure, title, notes, entries, caption=view.caption, below=True)


def _published(study: _Study) -> Plates:
    """Computed against published: differences case by case, and one against the other."""
    view = study.view
    pairs = [
        (str(name), other)
        for name in view.data.data_vars
        if view.has(str(name)) and (other := view.published(str(name))) is not None
    ]
    pairs = [(n, o) for n, o in pairs if np.isfinite(view.array(o).values.astype(float)).any()]
    if not pairs:
        return
    yield "published_parity", _parity(view, pairs)
    dims = {view.array(name).dims for name, _ in pairs}
    if len(dims) == 1 and len(next(iter(dims))) == 1:
        axis = view.axis(str(next(iter(dims))[0]))
        known = np.any([np.isfinite(view.array(o).values.astype(float)) for _, o in pairs], axis=0)
        rows = np.flatnonzero(known)
        if rows.size <= MOST_ROWS:
            yield "published", _differences(view, pairs, axis, rows)


def _differences(
    view: _View, pairs: Sequence[tuple[str, str]], axis: _Axis, rows: NDArray[np.intp]
) -> Figure:
    """Percent by which computed values differ from published ones, a row for each case."""
    from matplotlib.ticker import FuncFormatter, NullLocator, SymmetricalLogLocator

    figure, panels = _sheet(1, 1, 0.7 + 0.22 * rows.size)
    panel = panels[0]
    entries: Entries = {}
    every = [np.zeros(1)]
    for rank, (name, other) in enumerate(pairs):
        computed = view.array(name).values.astype(float)[rows]
        known = view.array(other).values.astype(float)[rows]
        with np.errstate(divide="ignore", invalid="ignore"):
            percent = np.where(known != 0, 100 * (computed - known) / np.abs(known), np.nan)
        shift = 0.5 * ((rank + 0.5) / len(pairs) - 0.5)
        style = _style(rank, len(pairs)) | {"linestyle": "none", "markersize": 4.5}
        (dots,) = panel.plot(percent, np.arange(rows.size) + shift, **style)
        entries[_title(view.array(name), name)] = dots
        every.append(percent[np.isfinite(percent)])
    panel.axvline(0.0, color="black", linewidth=0.8, zorder=1)
    for row in range(1, rows.size):
        panel.axhline(row - 0.5, color="#e6e6e6", linewidth=0.5, zorder=0.4)
    panel.grid(False, axis="y")
    panel.tick_params("y", length=0)
    panel.set_yticks(range(rows.size), [axis.tag(int(row)) for row in rows])
    panel.set_ylim(rows.size - 0.5, -0.5)
    size = np.abs(np.concatenate(every))
    if size.max() > 5 and size.max() > 20 * np.median(size):
        panel.set_xscale("symlog", linthresh=0.1, linscale=0.6)
        panel.xaxis.set_major_locator(SymmetricalLogLocator(base=10, linthresh=0.1))
        panel.xaxis.set_minor_locator(NullLocator())
        panel.xaxis.set_major_formatter(FuncFormatter(lambda value, _: _number(value)))
    _x_label(panel, "Computed less published (%)", 4.5)
    title = "Difference from the published values"
    return _finish(figure, title, view.slices([n for n, _ in pairs]), entries)


def _parity(view: _View, pairs: Sequence[tuple[str, str]]) -> Figure:
    """Computed against published values, one panel for each quantity."""
    drawn = list(pairs)[:MOST_PANELS]
    rows, columns = _grid(len(drawn))
    figure, panels = _sheet(rows, columns, 0.2 + 2.6 * rows)
    entries: Entries = {}
    for panel, (name, other) in zip(panels, drawn, strict=False):
        computed = view.array(name).values.astype(float).ravel()
        known = view.array(other).values.astype(float).ravel()
        good = np.isfinite(computed) & np.isfinite(known)
        both = np.concatenate([computed[good], known[good]])
        variable = view.array(name)
        panel.set_title(_wrap(axis_label(variable, name), int(72 / columns)))
        if both.size:
            log = both.min() > 0 and both.max() > 20 * both.min()
            pad = (both.max() / both.min()) ** 0.08 if log else 0.08 * np.ptp(both) or 1.0
            low, high = (
                (both.min() / pad, both.max() * pad)
                if log
                else (both.min() - pad, both.max() + pad)
            )
            (line,) = panel.plot([low, high], [low, high], color=GREY, linewidth=0.8)
            (dots,) = panel.plot(
                known[good], computed[good], "o", color=_shade(0.15), markerfacecolor="none"
            )
            entries["Equal"] = line
            entries["Case"] = dots
            panel.set(xlim=(low, high), ylim=(low, high))
            if log:
                panel.set(xscale="log", yscale="log")
                _log_ticks(panel.xaxis, low, high, few=True)
                _log_ticks(panel.yaxis, low, high, few=True)
            else:
                panel.locator_params(nbins=4)
        panel.set_box_aspect(1)
    for panel in panels[len(drawn) :]:
        panel.set_visible(False)
    for panel in _lowest(panels, len(drawn), columns):
        panel.set_xlabel("Published")
    _left_labels(panels, columns, "Computed", 1.5)
    notes = view.slices([n for n, _ in pairs])
    title = "Computed against published"
    spare = panels[len(drawn) :]
    return _finish(figure, title, notes, entries, below=True, spare=spare)


# --------------------------------------------------------------------------------- all figures


def _plates(study: _Study) -> Plates:
    """All figures of an archive, named; nothing is drawn for what is not there."""
    view = study.view
    yield from _kinematics(study)
    yield from _indicator(study)
    yield from _components(study)
    yield from _torque_and_speed(study)
    yield from _cylinders(study)
    drawn: set[str] = {"status"}
    if any(_over_angle(view, name) for name in COMPONENTS):
        drawn |= {name for name in (*COMPONENTS, "torque", "load_torque") if view.has(name)}
    drawn |= {name for name in (*KINEMATICS, "pressure") if _over_angle(view, name)}
    names = [str(name) for name in view.data.data_vars if view.has(str(name))]
    rest = [n for n in names if n not in drawn and not n.endswith(PUBLISHED)]
    curves = [name for name in rest if set(view.array(name).dims) & set(RUNNING)]
    for name in curves:
        for whole, along in study.along([name]):
            yield _stem(name, whole, along), _curve_figure(whole, name, along)
        for parameter, aside, _ in study.aside:
            if "design" in view.array(name).dims and aside.varies([name], parameter):
                yield _stem(name, aside, parameter), _curve_figure(aside, name, parameter)
    yield from _numbers(study, [name for name in rest if name not in curves])
    yield from _status(study)
    yield from _published(study)


def draw(
    dataset: xr.Dataset,
    folder: str | Path,
    format: str = "png",
    *,
    select: Mapping[str, float | str] | None = None,
) -> list[Path]:
    """Draw every figure that an archive gives rise to.

    Parameters
    ----------
    dataset : xarray.Dataset
        An archive: axes of the study (or ``design``) and ``crank_angle`` as dimensions; variables
        with ``long_name``, ``units`` and, where there is one, ``symbol`` (text for matplotlib).
    folder : str or Path
        Where the files go; made if it is not there. Files of the same names are replaced.
    format : {"png", "svg", "pdf"}
        PNG has 300 dots per inch.
    select : mapping of str to float or str, optional
        Slices: values of axes that are not to be drawn along, the nearest one is taken (for an
        axis of words the word itself). Axes that a figure has no room for and that are not named
        here are cut at the nominal design, the middle value or the first word. Either way the
        slice is stated in the title.

    Returns
    -------
    list of Path
        The files, in the order in which they were drawn.

    Raises
    ------
    SceneError
        For an unknown format, and for an axis or a word in `select` that the archive lacks.
    """
    import matplotlib

    if format not in FORMATS:
        raise SceneError(f"format is {shown(format)}, allowed: {', '.join(FORMATS)}")
    study = _study(dataset, select or {})
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    metadata = {"png": {"Software": None}, "svg": {"Date": None}, "pdf": {"CreationDate": None}}
    written: list[Path] = []
    with matplotlib.rc_context():
        matplotlib.rcdefaults()  # a person's own settings would break the layout
        matplotlib.rcParams.update(STYLE)  # type: ignore[arg-type]
        for stem, figure in _plates(study):
            path = folder / f"{_slug(stem)}.{format}"
            if path not in written:
                figure.savefig(path, metadata=metadata[format])
                written.append(path)
    return written
