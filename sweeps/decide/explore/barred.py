"""Barred ranges of speed of a shaft, solved between the speeds of an archive.

An archive has the stress or torque of a shaft at some speeds alone, and a resonance may lie between
two of them. Its scene is therefore computed again at many more speeds: in steps of at most 1 rpm
or, of long ranges, of 1/3000 of them, and at the critical speeds of its modes and stored orders.
Where a value crosses its limit, and where a peak may reach it between two speeds, ten times finer
speeds follow. The edges of a range are then known to a tenth of a step: on one side of each the
value was computed to be above the limit, on the other not to be.

A mode damped so little that its peak is narrower than a step is seen at its critical speed. All
orders of the half range count, also those that are not stored.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from engine_dyn.status import MEANINGS, WITH_NUMBERS
from engine_dyn.types import Floats
from sweeps.base.arguments import check_dataset, thread_count
from sweeps.base.dimensions import (
    DESIGN,
    LABELS,
    NONLINEAR_STATUS,
    REDUCTION,
    STATUS,
    TORSION_STATUS,
    words_of,
)
from sweeps.base.errors import SceneError
from sweeps.decide.explore.shaft_extremes import (
    NEEDED,
    OVER_LIMITS,
    PLACES,
    crossing,
    limited_by,
    ranges_above,
)
from sweeps.scene.sample import parameters_of

if TYPE_CHECKING:
    import xarray as xr

    from sweeps.running.archive.contents import Contents

SPEED, SHAFT = "speed", PLACES[1]

PROPULSION = "propulsion_stress_over_limit"

MOST_POINTS = 2_000_000  # Largest number of points that are solved, speeds times cases

MOST_STEPS = 3000  # Largest number of steps of the first speeds

FINER = 10  # Number of parts that a step is divided into where a value crosses its limit

NEAR = 0.15
"""How far outside a range a critical speed may lie that explains it, relative to the speed."""


DIP = 0.05
"""How far the value falls between two peaks of a range, as a share of the smaller one."""


@dataclass(frozen=True)
class Peak:
    """A peak of a quantity over its limit within a barred range.

    Attributes
    ----------
    largest : float
        Ratio of value to limit at its top.
    at : float
        Speed of its top [rpm].
    order : float
        Order of the largest torque there.
    mode : int
        The mode whose critical speed of this order lies near; 0 where there is none: the vibration
        is forced, without a resonance.
    critical_speed : float
        That speed [rpm]; NaN where there is none.
    over_passing : float
        Of a propulsion shaft, ratio of the stress at the top to the limit of IACS UR M68 for
        ranges that are passed quickly; above 1 barring does not suffice. NaN of other limits, and
        above 0.8 of the rated speed, where the rule has no such limit.
    """

    largest: float
    at: float
    order: float = math.nan
    mode: int = 0
    critical_speed: float = math.nan
    over_passing: float = math.nan


@dataclass(frozen=True)
class BarredRange:
    """A range of speed in which a quantity is above its limit on one shaft, in one case.

    Attributes
    ----------
    quantity : str
        Name of the quantity that is above its limit.
    place : str
        Name of the shaft.
    case : dict
        Values of the other axes, such as misfire and load; names where an axis has names.
    low, high : float
        Edges of the range [rpm].
    low_between, high_between : tuple of float
        From where to where each edge is sure to lie [rpm]: between two speeds that were computed,
        or infinite where the archive's speeds end above the limit.
    peaks : tuple of Peak
        The peaks of the value within the range, the largest first: several where ranges of
        different orders or modes touch.
    """

    quantity: str
    place: str
    case: Mapping[str, Any]
    low: float
    high: float
    low_between: tuple[float, float]
    high_between: tuple[float, float]
    peaks: tuple[Peak, ...]

    @property
    def largest(self) -> float:
        """Largest ratio of value to limit within the range."""
        return self.peaks[0].largest

    @property
    def at(self) -> float:
        """Speed of the largest ratio [rpm]."""
        return self.peaks[0].at

    @property
    def order(self) -> float:
        """Order of the largest torque there."""
        return self.peaks[0].order

    @property
    def mode(self) -> int:
        """The mode whose critical speed of this order lies near; 0 where there is none."""
        return self.peaks[0].mode

    @property
    def critical_speed(self) -> float:
        """That speed [rpm]; NaN where there is none."""
        return self.peaks[0].critical_speed


@dataclass(frozen=True)
class Barred:
    """What was found about the barred speeds of an archive.

    Attributes
    ----------
    quantities : tuple of str
        Quantities over limits that were looked at.
    speeds : tuple of float
        Speeds between which was looked, those of the archive [rpm].
    step : float
        Largest distance of the speeds on both sides of an edge [rpm].
    cases : tuple of dict
        All cases.
    ranges : tuple of BarredRange
        The ranges of all cases; empty where no speed is barred.
    worst : tuple of tuple
        Largest value of each case over all shafts and quantities with its shaft and speed.
    without : tuple of int
        Number of speeds without a result of each case.
    outcomes : tuple of str
        Outcomes of these speeds, of each case.
    solved, ratio : ndarray
        All speeds that were solved [rpm], and the largest ratio of each case over shafts and
        quantities, shape (speed, case).
    modes : Dataset
        Natural frequencies, critical speeds and vector sums of the first case; over the archive's
        speeds, where they change with the speed.
    """

    quantities: tuple[str, ...]
    speeds: tuple[float, float]
    step: float
    cases: tuple[Mapping[str, Any], ...]
    ranges: tuple[BarredRange, ...]
    worst: tuple[tuple[float, str, float], ...]
    without: tuple[int, ...]
    outcomes: tuple[str, ...]
    solved: Floats = field(repr=False)
    ratio: Floats = field(repr=False)
    modes: xr.Dataset = field(repr=False)


def points_of(archive: xr.Dataset) -> int:
    """Number of points that `barred_ranges` would solve at first, speeds times cases."""
    names, speeds = _asked(archive)
    cases = {str(d): archive.sizes[d] for n in names for d in archive[n].dims}
    number = math.prod(size for d, size in cases.items() if d not in (SPEED, SHAFT))
    return _grid(speeds).size * number


def barred_ranges(
    archive: xr.Dataset, *, threads: int | None = None, progress: bool = False
) -> Barred:
    """Find the speeds at which stresses or torques are above their limits, by solving.

    Each case (healthy, each misfire, each load and design) is by itself. The scene that the archive
    has is computed at more speeds, between the lowest and the highest one of the archive.

    Parameters
    ----------
    archive : Dataset
        As `sweeps.open` or `sweeps.run` returns it, or a part of it, with a speed axis and a
        quantity over a limit, such as `shaft_stress_over_limit`.
    threads : int, optional
        As many as the machine has processors, unless given.
    progress : bool
        Show a progress bar on the terminal.

    Returns
    -------
    Barred
        The ranges, with edges, order and mode, and the worst value of each case.

    Raises
    ------
    SceneError
        In one line: for an archive without a quantity over a limit, an axis of speed or the scene
        that it was computed from; one of which no shaft has a limit; a shard; one whose diagram is
        confidential; and one with too many cases.

    Examples
    --------
    >>> import sweeps
    >>> archive = sweeps.run(
    ...     engine="diesel_105x137",
    ...     shaft="diesel_105x137",
    ...     set={"shaft_stress_limit_8": 60},
    ...     axes={"speed": [1000, 1500, 2000, 2500]},
    ...     output={"quantities": ["shaft_stress_over_limit"]},
    ... )
    >>> found = sweeps.barred_ranges(archive)
    >>> one = found.ranges[-1]
    >>> one.place, one.order, one.mode, round(one.at, -1)
    ('throw 6 - flywheel', 6.0, 1, 2170.0)
    >>> round(one.low, -1), round(one.high, -1)
    (2120.0, 2210.0)
    """
    threads = thread_count(threads)
    names, speeds = _asked(archive)
    number = points_of(archive)
    if number > MOST_POINTS:
        raise SceneError(
            f"barred: {number:,} points would be solved, at most {MOST_POINTS:,} are; choose one "
            "value of an axis (--select, sweeps.nearest)"
        )
    scene = _Scene(archive, threads, progress)
    modes = scene.solved(speeds, ["natural_frequency", "critical_speed", "mode_vector_sum"])
    first = np.concatenate([_grid(speeds), speeds, _critical(modes, speeds)])
    ratio = scene.solved(first, names)
    grid = ratio[SPEED].values.astype(float)
    finer = _finer(grid, [_stacked(ratio[name]) for name in names])
    if finer.size:
        import xarray as xr

        more = scene.solved(np.setdiff1d(finer, grid), names)
        ratio = xr.concat([ratio, more], SPEED, data_vars="minimal").sortby(SPEED)
    first_case = {d: 0 for d in modes.dims if d not in ("mode", "order", SHAFT, SPEED)}
    found, places = _judged(ratio, names, speeds, modes.isel(first_case), archive)
    return replace(found, ranges=tuple(_explained(found.ranges, places, scene)))


def _asked(archive: xr.Dataset) -> tuple[list[str], Floats]:
    """Quantities over limits, and the speeds of the archive."""
    check_dataset(archive)
    if REDUCTION in archive.attrs:
        raise SceneError("archive: was reduced; barred speeds need one with all speeds")
    names = limited_by(archive)
    if not names:
        raise SceneError(f"archive: has none of {', '.join(OVER_LIMITS)}; {NEEDED}")
    for name in names:
        if SPEED not in archive[name].dims or archive.sizes[SPEED] < 2:
            raise SceneError(
                f"archive: {name}: has one speed alone; barred speeds need an axis of two speeds "
                "or more, between which they are looked for"
            )
    names = [name for name in names if np.isfinite(archive[name].values).any()]
    if not names:
        raise SceneError(
            "archive: no shaft has a limit; give stress_limit or torque_limit of a shaft"
        )
    speeds = archive[SPEED].values if SPEED in archive.coords else np.zeros(0)
    if not (speeds.size and speeds.dtype.kind in "fiu" and np.isfinite(speeds).all()
            and (speeds > 0).all()):  # fmt: skip
        raise SceneError("archive: speed: must have finite numbers above 0 [rpm]")
    return names, np.sort(speeds.astype(float))


def _grid(speeds: Floats) -> Floats:
    """First speeds: in equal steps, of slow engines in finer ones."""
    low, high = float(speeds[0]), float(speeds[-1])
    step = min(1.0, low / 1000.0)
    count = math.ceil(min((high - low) / step, MOST_STEPS))
    return np.linspace(low, high, max(count, 100) + 1)


def _critical(modes: xr.Dataset, speeds: Floats) -> Floats:
    """Critical speeds between the archive's speeds; of very many every n-th one."""
    critical = np.unique(np.round(modes["critical_speed"].values, 2))
    critical = critical[(critical > speeds[0]) & (critical < speeds[-1])]
    return critical[:: 1 + critical.size // MOST_STEPS]


def _stacked(ratio: xr.DataArray) -> Floats:
    """Values over the speed, and all else together."""
    values = ratio.transpose(SPEED, ...).values.astype(float)
    return values.reshape(len(values), -1)


def _finer(speed: Floats, ratios: list[Floats]) -> Floats:
    """Speeds within the steps in which a value crosses its limit, or may be above it."""
    steps = np.zeros(speed.size - 1, bool)
    for values in ratios:
        over = np.nan_to_num(values, nan=0.0) > 1.0
        steps |= (over[1:] != over[:-1]).any(axis=1)
        # A peak between two speeds is at most as high as this, if it is not much narrower than
        # they are apart; narrower ones are seen at their critical speeds.
        middle = values[1:-1]
        bend = values[:-2] - 2.0 * middle + values[2:]
        peak = (middle >= values[:-2]) & (middle >= values[2:])
        maybe = (peak & (middle <= 1.0) & (middle - 2.0 * bend > 1.0)).any(axis=1)
        steps[:-1] |= maybe
        steps[1:] |= maybe
    at = np.flatnonzero(steps)
    parts = np.linspace(0.0, 1.0, FINER + 1)[1:-1]
    return np.ravel(speed[at, None] + parts * (speed[at + 1] - speed[at])[:, None])


def _judged(
    ratio: xr.Dataset, names: list[str], speeds: Floats, modes: xr.Dataset, archive: xr.Dataset
) -> tuple[Barred, list[dict[str, int]]]:
    """Ranges of each case and shaft, without their orders and modes, and the place of each."""
    speed = ratio[SPEED].values.astype(float)
    dims = list(dict.fromkeys(
        str(d) for n in names for d in ratio[n].dims if d not in (SPEED, SHAFT)
    ))  # fmt: skip
    each = [dict(zip(dims, at, strict=True)) for at in np.ndindex(*(ratio.sizes[d] for d in dims))]
    cases = [_case(ratio, here) for here in each]
    shafts = [str(name) for name in ratio["shaft_name"].values]
    ranges: list[BarredRange] = []
    places: list[dict[str, int]] = []
    worst, without, outcomes, largest, step = [], [], [], [], 0.0
    for here, case in zip(each, cases, strict=True):
        most, lacking = (-math.inf, "", math.nan), np.zeros(speed.size, bool)
        curve = np.full(speed.size, np.nan)
        for name in names:
            data = ratio[name].isel(here, missing_dims="ignore")
            values = data.transpose(SPEED, SHAFT).values.astype(float)
            limited = np.isfinite(values).any(axis=0)
            lacking |= np.isnan(values[:, limited]).any(axis=1) | (not limited.any())
            for number in np.flatnonzero(limited):
                one = values[:, number]
                top = int(np.nanargmax(one))
                most = max(most, (float(one[top]), shafts[number], float(speed[top])))
                curve = np.fmax(curve, one)
                for found in _ranges(speed, one):
                    new = BarredRange(name, shafts[number], case, *found)
                    ranges.append(new)
                    places.append({**here, SHAFT: int(number)})
                    ends = (*new.low_between, *new.high_between)
                    gaps = np.diff(np.reshape(ends, (2, 2)), axis=1)
                    step = max(step, *(float(gap) for gap in gaps.ravel() if np.isfinite(gap)), 0.0)
        worst.append(most)
        without.append(int(lacking.sum()))
        outcomes.append(_outcomes(archive, here) if lacking.any() else "")
        largest.append(curve)
    return Barred(
        tuple(names), (float(speeds[0]), float(speeds[-1])), step, tuple(cases), tuple(ranges),
        tuple(worst), tuple(without), tuple(outcomes), speed, np.transpose(largest), modes,
    ), places  # fmt: skip


def _case(archive: xr.Dataset, place: Mapping[str, int]) -> dict[str, Any]:
    """Values of axes at a place: names where they have names, columns of designs."""
    words = words_of(archive)
    case: dict[str, Any] = {}
    for dim, index in place.items():
        home = words.get(dim, dim)
        labels = [key for key in LABELS if key in archive.coords and archive[key].dims == (dim,)]
        if dim == DESIGN and labels:
            case |= {key: str(archive[key].values[index]) for key in labels}
        elif home in archive.coords:
            case[dim] = archive[home].values[index].item() if home == dim else str(
                archive[home].values[index]
            )  # fmt: skip
        else:
            case[dim] = index + 1
    return case


def _ranges(speed: Floats, values: Floats) -> Iterator[tuple[Any, ...]]:
    """Edges of ranges above 1, between which speeds they lie, and the peaks of each."""
    for first, end in ranges_above(values):
        low, below = crossing(speed, values, first - 1, first)
        high, above = crossing(speed, values, end, end - 1)
        between = (below, float(speed[first])), (float(speed[end - 1]), above)
        yield low, high, *between, _peaks(speed[first:end], values[first:end])


def _peaks(speed: Floats, values: Floats) -> tuple[Peak, ...]:
    """Peaks of a range, the largest first; between two of them the value falls by `DIP`."""
    ends = np.concatenate([[-math.inf], values, [-math.inf]])
    kept: list[int] = []
    for top in np.flatnonzero((values >= ends[:-2]) & (values > ends[2:])).tolist():
        while kept:
            last = kept[-1]
            smaller = min(values[last], values[top])
            if values[last:top].min() <= (1.0 - DIP) * smaller or values[last] >= values[top]:
                break
            kept.pop()  # A shoulder of the peak that follows
        if not kept or values[kept[-1] : top].min() <= (1.0 - DIP) * values[top]:
            kept.append(top)
    kept.sort(key=lambda place: -values[place])
    return tuple(Peak(float(values[place]), float(speed[place])) for place in kept)


def _outcomes(archive: xr.Dataset, here: Mapping[str, int]) -> str:
    """Outcomes without numbers that the archive's own speeds have in a case, as words."""
    words: list[str] = []
    for name in (STATUS, TORSION_STATUS, NONLINEAR_STATUS):
        if name not in archive or words:  # The shaft fails wherever the speed does
            continue
        codes = np.unique(archive[name].isel(here, missing_dims="ignore").values)
        known = [int(code) for code in codes if code in range(len(MEANINGS))]
        words = [MEANINGS[code] for code in known if code not in WITH_NUMBERS]
    return ", ".join(words)


def _explained(
    ranges: tuple[BarredRange, ...], places: list[dict[str, int]], scene: _Scene
) -> Iterator[BarredRange]:
    """Ranges with the order and mode of each of their peaks."""
    if not ranges:
        return
    names = ["shaft_torque_largest_order", "natural_frequency"]
    if any(one.quantity == PROPULSION for one in ranges):
        names += ["propulsion_stress_limit", "propulsion_stress_limit_passing"]
    found = scene.solved(np.unique([peak.at for one in ranges for peak in one.peaks]), names)
    for one, here in zip(ranges, places, strict=True):
        data = [found[name].isel(here, missing_dims="ignore") for name in names]
        yield replace(one, peaks=tuple(
            _cause(one, peak, *(one.sel({SPEED: peak.at}) if SPEED in one.dims else one
                                for one in data))
            for peak in one.peaks
        ))  # fmt: skip


def _cause(
    one: BarredRange, peak: Peak, order: xr.DataArray, natural: xr.DataArray, *limits: xr.DataArray
) -> Peak:
    """A peak of a range with its order, the mode that is near, and the limit for passing."""
    peak = replace(peak, order=float(order))
    if one.quantity == PROPULSION:
        permitted, passing = map(float, limits)
        peak = replace(peak, over_passing=peak.largest * permitted / passing)
    critical = 60.0 * natural.values / peak.order
    if not np.isfinite(critical).any():
        return peak
    mode = int(np.nanargmin(np.abs(critical - peak.at)))
    speed = float(critical[mode])
    if not (1.0 - NEAR) * one.low <= speed <= (1.0 + NEAR) * one.high:
        return peak
    return replace(peak, mode=int(natural["mode"].values[mode]), critical_speed=speed)


class _Scene:
    """The scene of an archive, which is computed at other speeds."""

    def __init__(self, archive: xr.Dataset, threads: int | None, progress: bool) -> None:
        from sweeps.running.archive.contents import contents_of

        contents = contents_of(archive)
        if contents.piece:
            raise SceneError(f"{contents.path}: is a shard; merge all shards first")
        if contents.confidential:
            raise SceneError(
                f"{contents.path}: its diagram is confidential and not in it, so that nothing can "
                "be solved; run its scene at more speeds"
            )
        source = json.loads(json.dumps(contents.source))
        for key in ("reference", "uncertainty"):
            source.pop(key, None)
        self.contents: Contents = replace(contents, source=_narrowed(source, archive))
        self.archive, self.threads, self.progress = archive, threads, progress

    def solved(self, speeds: Floats, names: list[str]) -> xr.Dataset:
        """Quantities at some speeds, at the places of the archive along its other axes."""
        from sweeps.running.archive.contents import plan_of
        from sweeps.running.archive.labels import label
        from sweeps.running.compute.in_memory import compute

        values = np.unique(speeds)
        output = {**self.contents.source.get("output", {}), "quantities": names}
        output.pop("fail_on", None)
        contents = replace(self.contents, source={**self.contents.source, "output": output})
        plan = plan_of(contents, axis=SPEED, values=values)
        found = label(plan, compute(plan, progress=self.progress, threads=self.threads))
        for dim in map(str, found.dims):
            # Of axes of words a part may have been chosen.
            if dim in found.coords and dim in self.archive.coords and dim not in (SPEED, DESIGN):
                kept = np.atleast_1d(self.archive[dim].values)
                if kept.size < found.sizes[dim] and dim in words_of(found):
                    found = found.sel({dim: kept})
        return found


def _narrowed(source: dict[str, Any], archive: xr.Dataset) -> dict[str, Any]:
    """Scene with the values of axes and designs that the archive, or the part of it, has."""

    def values_of(key: str) -> list[Any]:
        return [
            str(v) if isinstance(v, str) else float(v) for v in np.atleast_1d(archive[key].values)
        ]

    axes = source.get("axes", {})
    for key in axes:
        if key in archive.coords and archive[key].dtype.kind in "fiu" and key not in words_of(
            archive
        ):  # fmt: skip
            axes[key] = values_of(key)
    columns = {*source.get("designs", {}), *parameters_of(source.get("sample") or {})}
    if "file" in columns:
        columns = {str(n) for n, c in archive.coords.items() if DESIGN in c.dims and n != DESIGN}
    if columns:
        source.pop("sample", None)
        source["designs"] = {
            key: values_of(key) for key in sorted(columns) if key in archive.coords
        }
    return source
