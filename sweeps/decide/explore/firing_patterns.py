"""All firing patterns of a density, computed side by side and ranked."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from fractions import Fraction
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from engine_dyn.geometry.firing_sequence import LARGEST_FIRING, shortest
from sweeps.base.dimensions import DESIGN, ENGINE, FIRING_PATTERN, OF_PATTERNS
from sweeps.base.errors import SceneError, shown
from sweeps.base.naming import DESCRIPTION
from sweeps.base.ratios import number_or_ratio
from sweeps.decide.explore.firing_orders import check_left_out, given_scene
from sweeps.scene.model import SeveralEngines
from sweeps.scene.reading import read_scene

if TYPE_CHECKING:
    import xarray as xr

MOST = 2000  # Largest number of patterns that are computed

LONGEST = 24  # Largest number of firings after which a pattern repeats


def firing_patterns(
    engine: str | Path | Mapping[str, Any], density: float | str, *, longest: int = 12,
    by: str = "delta", order: float | None = None, valves_shut: bool = False,
    keep_torque: bool = True, settings: Mapping[str, Any] | None = None,
    threads: int | None = None, progress: bool = False,
) -> xr.Dataset:  # fmt: skip
    """Compute an engine with all firing patterns of a density, and rank them.

    Patterns that differ only in where they begin are taken once, so cylinders should be alike and
    fire evenly.

    Parameters
    ----------
    engine : str, Path or dict
        An engine of the catalogue, an engine file, or a scene; a scene may have axes of numbers,
        and the largest value over them counts.
    density : float or str
        Share of the firings that happen, between 0 and 1: 0.75 or "2/3".
    longest : int
        Firings after which patterns repeat, at most; from 2 to 24.
    by : str
        Quantity with a number for each design, the least of which is best; or "torque_order" with
        `order`.
    order : float, optional
        Order whose amplitude counts.
    valves_shut : bool
        Whether cylinders that do not fire have their valves shut; otherwise they are motored.
    keep_torque : bool
        Whether those that fire have more pressure, so that the mean torque is that of all firings.
    settings : dict, optional
        Keys of `[set]`, which replace those of the scene.
    threads, progress
        As of `sweeps.run`.

    Returns
    -------
    Dataset
        An archive with the axis `firing_pattern`, the best first, and along it `firings` (1, 0 or d
        for each) and `ranked_by`. The attribute `firing_patterns` has the factor on the combustion
        pressure of cylinders that fire.

    Raises
    ------
    SceneError
        In one line: for a density that no pattern has, too many patterns, a factor on the pressure
        above 4, scenes that are not about one engine, and quantities that do not rank designs.

    Examples
    --------
    >>> import sweeps
    >>> scene = {"engine": "ntua", "set": {"cylinders": 4, "load": 50}}
    >>> found = sweeps.firing_patterns(scene, "2/3", longest=6)
    >>> [str(firings) for firings in found.firings.values]
    ['110', '111010', '111100']
    """
    from sweeps.running.compute.in_memory import run

    share = _density(density, longest)
    words = _words(share, longest)
    given, name = given_scene(engine, [by])
    tables = _tables(given, name, dict(settings or {}), by)
    idle = "d" if valves_shut else "0"
    factor = 1.0
    # A load that follows a torque keeps it without any factor
    if keep_torque and not read_scene(given, **tables).load_follows:
        factor = _factor_of_torque(given, name, tables, words[0], idle, float(share))
    texts = [_text(word, factor, idle) for word in words]
    tables["axes"] = {FIRING_PATTERN: texts, **tables["axes"]}
    computed = run(read_scene(given, **tables), threads=threads, progress=progress)
    values = _ranked_by(computed, by, order)
    sequence = np.argsort(values, kind="stable")
    firings = [words[i].replace("0", idle) for i in sequence]
    about = {"density": str(share), "by": by, "order": order, "pressure_factor": factor}
    kept = {
        key: computed[by].attrs[key]
        for key in ("units", "long_name", DESCRIPTION)
        if key in computed[by].attrs
    }
    text = {"long_name": "firings in sequence"}
    made = computed.isel({FIRING_PATTERN: sequence}).assign_coords(
        firings=(FIRING_PATTERN, firings, text),
        ranked_by=(FIRING_PATTERN, values[sequence], kept),
    )
    made.attrs[OF_PATTERNS] = json.dumps(about)
    return made


def _density(density: float | str, longest: int) -> Fraction:
    """Density as a fraction that a pattern with at most so many firings can have."""
    if isinstance(longest, bool) or not isinstance(longest, int) or not 2 <= longest <= LONGEST:
        raise SceneError(f"longest = {shown(longest)}: must be a whole number from 2 to {LONGEST}")
    try:
        value = number_or_ratio(str(density))
    except ValueError:
        value = math.nan
    if not 0.0 < value < 1.0:
        raise SceneError(f"density = {shown(density)}: must be between 0 and 1, such as 2/3")
    share = Fraction(value).limit_denominator(LONGEST)
    if abs(float(share) - value) > 1e-3 or share.denominator > longest:
        raise SceneError(
            f"density = {shown(density)}: no pattern of at most {longest} firings has it; must be "
            f"a fraction with a denominator up to {longest}"
        )
    return share


def _words(share: Fraction, longest: int) -> list[str]:
    """Patterns of a density, the shortest first; of those that differ by a rotation only one."""
    lengths = range(share.denominator, longest + 1, share.denominator)
    total = sum(_necklaces(n, int(n * share)) for n in lengths)
    if total > MOST:
        raise SceneError(
            f"longest = {longest}: {total:,} patterns of density {share}; at most {MOST:,} are "
            "computed; choose a smaller one"
        )
    every = (word for n in lengths for word in _turned_once(n, int(n * share)))
    return list(dict.fromkeys(map(shortest, every)))


def _necklaces(length: int, ones: int) -> int:
    """Number of patterns of a length that do not differ by a rotation alone (Burnside's lemma)."""
    common = math.gcd(length, ones)
    turned = sum(
        math.comb(length // d, ones // d) * sum(math.gcd(k, d) == 1 for k in range(1, d + 1))
        for d in range(1, common + 1)
        if common % d == 0
    )
    return turned // length


def _turned_once(length: int, ones: int) -> list[str]:
    """Patterns, one for all rotations of it: the largest."""
    patterns = []
    for places in combinations(range(1, length), ones - 1):
        fires = {0, *places}
        word = "".join("1" if i in fires else "0" for i in range(length))
        if word == max(word[i:] + word[:i] for i in range(length)):
            patterns.append(word)
    return sorted(patterns, reverse=True)


def _tables(given: Any, name: str, replaced: dict[str, Any], by: str) -> dict[str, Any]:
    """Tables of a scene about one engine, with the quantities that rank patterns."""
    own = read_scene(given)
    check_left_out(own, name, "firing patterns")
    several = isinstance(own, SeveralEngines) or own.firing_patterns
    if several or not {DESIGN, ENGINE}.isdisjoint(own.dimensions):
        raise SceneError(
            f"{name}: has several engines, designs or firing patterns; must have one engine, whose "
            "firing patterns are compared"
        )
    settings = {**(own.source.get("set") or {}), **replaced}
    output = dict(own.source.get("output") or {})
    asked = dict.fromkeys([by, "torque_mean", *output.get("quantities", ())])
    return {
        "set": settings,
        "axes": dict(own.source.get("axes") or {}),
        "output": {**output, "quantities": list(asked)},
    }


def _factor_of_torque(
    given: Any, name: str, tables: Mapping[str, Any], word: str, idle: str, density: float
) -> float:
    """Factor on the combustion pressure with which the mean torque is that of all firings."""
    # The mean torque is linear in the factor, unless friction depends on the largest pressure.
    from sweeps.running.compute.in_memory import run

    ends = 1.0, min(1.0 / density, LARGEST_FIRING)
    texts = ["1", *(_text(word, factor, idle) for factor in ends)]
    asked = {**tables, "axes": {FIRING_PATTERN: texts, **tables["axes"]},
             "output": {"quantities": ["torque_mean"]}}  # fmt: skip
    torque = run(read_scene(given, **asked))["torque_mean"]
    wanted, low, high = (torque.isel({FIRING_PATTERN: i}).values for i in range(3))
    factors = ends[0] + (ends[1] - ends[0]) * (wanted - low) / (high - low)
    factor = float(np.mean(factors))
    # One factor must keep the torque at all points of the axes, to within a thousandth.
    if not np.ptp(factors) <= 1e-3:
        others = ", ".join(str(dim) for dim in torque.dims if dim != FIRING_PATTERN)
        raise SceneError(
            f"{name}: no one factor on the pressure keeps the torque at every {others}; must be "
            "one, or do not keep the torque"
        )
    if factor > LARGEST_FIRING:
        raise SceneError(
            f"{name}: to keep the torque, cylinders that fire need {factor:.3g} times the "
            f"combustion pressure; must be at most {LARGEST_FIRING:g}: choose a higher density, or "
            "do not keep the torque"
        )
    return factor


def _text(word: str, factor: float, idle: str) -> str:
    """A pattern as scenes write it."""
    if factor == 1.0:
        return word.replace("0", idle)
    return " ".join(f"{factor:.6g}" if letter == "1" else idle for letter in word)


def _ranked_by(archive: xr.Dataset, by: str, order: float | None) -> Any:
    """Value that a pattern is ranked by: the largest over all other axes."""
    array = archive[by]
    if order is not None:
        if "order" not in array.dims:
            raise SceneError(f"order: only with a quantity over orders; {by} is none")
        orders = array["order"].values
        place = int(np.argmin(np.abs(orders - order)))
        if not math.isclose(orders[place], order, rel_tol=2e-4):  # An order 0.3333 means one third
            raise SceneError(f"order = {order:g}: must be one of the orders of the patterns")
        array = array.isel(order=place)
    if FIRING_PATTERN not in array.dims or array.dtype.kind != "f" or (
        {"order", "crank_angle"} & set(array.dims)
    ):  # fmt: skip
        raise SceneError(f"by {shown(by)}: must be a quantity with a number for each pattern"
                         + ("; give the order" if "order" in array.dims else ""))  # fmt: skip
    others: Sequence[Any] = [dim for dim in array.dims if dim != FIRING_PATTERN]
    return np.nan_to_num(array.max(others, skipna=False).values, nan=np.inf)
