"""The shaft of a report: its numbers, cases, limits and verdicts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from engine_dyn.quantities.graph import PARAMETERS
from engine_dyn.units import RPM
from sweeps.base.errors import one_line
from sweeps.base.naming import meaning_of
from sweeps.decide.explore.attributes import members_of
from sweeps.decide.explore.shaft_extremes import Worst, has_places, worst_of_shaft
from sweeps.view.report.html import filled, table

if TYPE_CHECKING:
    import xarray as xr


def numeric(archive: xr.Dataset, place: str) -> bool:
    """Whether there are numbers over discs or shafts, which have names."""
    names = archive.coords.get(f"{place}_name")
    own = [v for v in archive.data_vars.values() if place in v.dims]
    known = names is not None and names.dims == (place,)
    return known and any(v.dtype.kind == "f" and v.size for v in own)


def system(
    archive: xr.Dataset,
    more: Mapping[str, Mapping[str, Sequence[str]]] | None = None,
) -> Iterator[str]:
    """Section on the shaft: numbers that all designs share, and those that vary.

    `more` has columns of discs and of shafts by their heads, which stand in place of the inertia
    and stiffness that the scene gives.
    """
    given = members_of(archive, "parameters")
    numbers = {
        "disc": ("inertia kg m2", "damping N m s/rad", "ground_stiffness N m/rad"),
        "shaft": ("stiffness N m/rad", "loss_factor", "damping N m s/rad", "length m", "diameter m",
                  "bore m", "stress_limit MPa", "torque_limit N m", "tensile_strength MPa",
                  "shape_factor"),
    }  # fmt: skip
    for place, every in numbers.items():
        columns = (more or {}).get(place, {})
        facts = every[1:] if columns else every
        if f"{place}_name" not in archive.coords:
            continue
        names = [one_line(name, 60) for name in archive[f"{place}_name"].values]
        rows = []
        for number, name in enumerate(names, start=1):
            keys = [f"{place}_{fact.partition(' ')[0]}_{number}" for fact in facts]
            told = [_told(archive, given, key) for key in keys]
            rows.append([f"{number} {name}", *(of[number - 1] for of in columns.values()), *told])
        heads = [place, *columns, *(_headed(fact) for fact in facts)]
        yield filled(heads, rows, range(1, len(heads)))
    dampers = {
        _with_unit(key): f"{value:.6g}" for key, value in given.items()
        if key.startswith(
            ("damper_", "pendulum_", "shaft_gear_ratio_", "load_damping", "modal_damping_",
             "excitation_factor_", "rated_speed"))
        and isinstance(value, int | float)
    }  # fmt: skip
    varying = [str(n) for n in archive.coords if str(n).startswith(("damper_", "pendulum_"))]
    dampers |= dict.fromkeys(varying, "varies")
    dampers |= _slope_of_load(archive, given)
    if dampers:
        yield table(("dampers, pendulums, gears, load", ""), list(dampers.items()), (1,))


def _slope_of_load(archive: xr.Dataset, given: Mapping[str, Any]) -> dict[str, str]:
    """Damping by the slope of the load's torque over the speed, alpha k omega^alpha/omega."""
    name, power = "load_torque_nominal", given.get("load_exponent")
    if (
        name not in archive
        or not isinstance(power, int | float)
        or any(
            key in given or key in archive.coords for key in ("load_damping", "load_damping_factor")
        )
    ):
        return {}
    torque = next(cases(archive))[1][name]
    torque = torque.isel({d: 0 for d in torque.dims if d != "speed"})
    speeds = np.atleast_1d(archive["speed"].values if "speed" in archive.coords else
                           given.get("speed", np.nan))  # fmt: skip
    values = np.broadcast_to(torque.values, speeds.shape) * power / (speeds * RPM)
    shown = sorted({0, speeds.size // 2, speeds.size - 1})
    return {
        f"load damping at {speeds[i]:g} rpm, at the crank, {power:g} T/omega [N m s/rad]":
        f"{values[i]:.4g}"
        for i in shown if np.isfinite(values[i])
    }  # fmt: skip


def _with_unit(key: str) -> str:
    """A parameter with its unit in brackets."""
    node = PARAMETERS.get(key)
    return key if node is None or node.unit == "1" else f"{key} [{node.unit}]"


def _headed(fact: str) -> str:
    name, _, unit = fact.partition(" ")
    return f"{name.replace('_', ' ')} [{unit}]" if unit else name.replace("_", " ")


def _told(archive: xr.Dataset, given: Mapping[str, Any], key: str) -> str:
    if key in archive.coords:
        return "varies"
    value = given.get(key)
    return f"{value:.6g}" if isinstance(value, int | float) else ""


def cases(archive: xr.Dataset) -> Iterator[tuple[str, xr.Dataset]]:
    """The archive, or its parts without and with a misfire."""
    if "misfire" not in archive.dims or archive["misfire"].dtype.kind not in "fiu":
        yield "", archive
        return
    misses = archive["misfire"].values > 0
    for name, chosen in (("all cylinders fire", ~misses), ("one cylinder misfires", misses)):
        if chosen.any():
            yield name, archive.isel({"misfire": np.flatnonzero(chosen)})


def worst(archive: xr.Dataset) -> Iterator[str]:
    """Table of the worst place of each quantity, for each case, with a verdict by its limit."""
    rows = []
    crank = of_crank(archive)
    for case, part in cases(archive):
        most: dict[str, Worst] = {}
        for one in worst_of_shaft(part) if has_places(part) else ():
            if one.quantity == "shaft_torque_min" and one.place in crank:
                continue  # A crankshaft's torque always reverses
            if one.quantity.endswith("_order"):
                continue
            best = most.get(one.quantity)
            if best is None or one.worse_than(best):
                most[one.quantity] = one
        for name, one in most.items():
            meaning = meaning_of(archive[name].attrs, name)
            meaning = meaning.partition(",")[0].partition(":")[0]
            unit = "" if one.unit == "1" else one.unit
            at = ", ".join(f"{key} {value:g}" for key, value in one.at.items()
                           if isinstance(value, int | float)
                           and not (key == "misfire" and not value))  # fmt: skip
            verdict = _verdict(one)
            rows.append([case, meaning, one.place, f"{one.value:.4g} {unit}".strip(), at, verdict])
    if rows:
        yield table(("case", "quantity", "on", "worst", "at", "verdict"), rows, (3,))


def of_crank(archive: xr.Dataset) -> set[str]:
    """Names of the shafts that are joined to a throw."""
    told = members_of(archive, "shaft")
    pairs, throws = told.get("shafts"), told.get("throws")
    if "shaft_name" not in archive.coords or not isinstance(pairs, list):
        return set()
    at_throws = [isinstance(throws, list) and bool({*map(str, throws)} & {*map(str, pair)})
              if isinstance(pair, list) else False for pair in pairs]  # fmt: skip
    names = archive["shaft_name"].values
    return {str(name) for name, near in zip(names, at_throws, strict=False) if near}


def _verdict(one: Worst) -> str:
    """Verdict: within or above the limit; whether a torque reverses."""
    if one.quantity.endswith("_over_limit"):
        # Between two speeds there may be a resonance, which the verdict of the report looks for.
        within = "within the limit at these points" if "speed" in one.at else "within the limit"
        return "above the limit" if one.value > 1.0 else within
    if one.quantity == "shaft_torque_min":
        return "reverses" if one.value < 0.0 else "does not reverse"
    return ""
