"""The torsional calculation in a report: the shaft, its modes, cases, limits and verdicts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from sweeps.base.errors import one_line
from sweeps.base.naming import meaning_of
from sweeps.decide.explore.attributes import members_of
from sweeps.decide.explore.shaft_extremes import Worst, has_places, worst_of_shaft
from sweeps.view.report.html import table

if TYPE_CHECKING:
    import xarray as xr


def shaft_results(archive: xr.Dataset) -> str:
    """Tables about the shaft; empty where the archive has nothing of one."""
    if not (_numeric(archive, "disc") or _numeric(archive, "shaft")):
        return ""
    parts = [*_system(archive), *_modes(archive)]
    parts += _worst(archive) if has_places(archive) else []
    return "".join(["<h3>Torsional vibration of the shaft</h3>", *parts]) if parts else ""


def _numeric(archive: xr.Dataset, place: str) -> bool:
    """Whether there are numbers over discs or shafts, which have names."""
    names = archive.coords.get(f"{place}_name")
    own = [v for v in archive.data_vars.values() if place in v.dims]
    known = names is not None and names.dims == (place,)
    return known and any(v.dtype.kind == "f" and v.size for v in own)


def _system(archive: xr.Dataset) -> Iterator[str]:
    """Section on the shaft: numbers that all designs share, and those that vary."""
    given = members_of(archive, "parameters")
    numbers = {
        "disc": ("inertia kg m2", "damping N m s/rad", "ground_stiffness N m/rad"),
        "shaft": ("stiffness N m/rad", "loss_factor", "damping N m s/rad", "length m", "diameter m",
                  "bore m", "stress_limit MPa", "torque_limit N m"),
    }  # fmt: skip
    for place, facts in numbers.items():
        if f"{place}_name" not in archive.coords:
            continue
        names = [one_line(name, 60) for name in archive[f"{place}_name"].values]
        rows = []
        for number, name in enumerate(names, start=1):
            keys = [f"{place}_{fact.partition(' ')[0]}_{number}" for fact in facts]
            rows.append([number, name, *(_told(archive, given, key) for key in keys)])
        shown = [i for i in range(len(facts)) if any(row[2 + i] for row in rows)]
        heads = [facts[i].replace("_", " ") for i in shown]
        body = [[row[0], row[1], *(row[2 + i] for i in shown)] for row in rows]
        yield table(("", place, *heads), body, tuple(range(2, 2 + len(heads))))
    dampers = {
        key: f"{value:.6g}" for key, value in given.items()
        if key.startswith(("damper_", "pendulum_", "shaft_gear_ratio_", "load_damping"))
        and isinstance(value, int | float)
    }  # fmt: skip
    varying = [str(n) for n in archive.coords if str(n).startswith(("damper_", "pendulum_"))]
    dampers |= dict.fromkeys(varying, "varies")
    if dampers:
        yield table(("dampers, pendulums, gears and load", ""), list(dampers.items()), (1,))


def _told(archive: xr.Dataset, given: Mapping[str, Any], key: str) -> str:
    if key in archive.coords:
        return "varies"
    value = given.get(key)
    return f"{value:.6g}" if isinstance(value, int | float) else ""


def _modes(archive: xr.Dataset) -> Iterator[str]:
    """Section on natural frequencies, and critical speeds of strong orders within the speeds."""
    wanted = ("natural_frequency", "modal_inertia", "modal_damping_ratio",
              "damped_natural_frequency", "damping_ratio")  # fmt: skip
    names = [n for n in wanted if n in archive and archive[n].dims == ("mode",)]
    if names:
        heads = [f"{n.replace('_', ' ')} [{archive[n].attrs.get('units', '1')}]" for n in names]
        body = [
            [str(mode), *(f"{archive[n].values[i]:.5g}" for n in names)]
            for i, mode in enumerate(archive["mode"].values)
        ]
        yield table(("mode", *heads), body, tuple(range(1, 1 + len(names))))
    crossings = list(_critical(archive))
    if crossings:
        yield table(("mode", "order", "critical speed", "vector sum"), crossings, (1, 2, 3))


def _critical(archive: xr.Dataset) -> Iterator[list[str]]:
    for name in ("critical_speed", "mode_vector_sum"):
        if name not in archive or archive[name].dims != ("mode", "order"):
            return
    if "speed" not in archive.coords or archive["speed"].dtype.kind != "f":
        return
    speeds, sums = archive["critical_speed"], archive["mode_vector_sum"].values
    low, high = (float(end(archive["speed"])) for end in (np.min, np.max))
    for i, mode in enumerate(archive["mode"].values):
        for j, order in enumerate(archive["order"].values):
            speed = float(speeds.values[i, j])
            # Orders much weaker than the strongest one of a mode do not matter.
            if low <= speed <= high and sums[i, j] >= 0.3 * np.nanmax(sums[i]):
                yield [str(mode), f"{order:g}", f"{speed:.4g} {speeds.attrs.get('units', '')}",
                       f"{sums[i, j]:.3g}"]  # fmt: skip


def _cases(archive: xr.Dataset) -> Iterator[tuple[str, xr.Dataset]]:
    """The archive, or its parts without and with a misfire."""
    if "misfire" not in archive.dims or archive["misfire"].dtype.kind not in "fiu":
        yield "", archive
        return
    misses = archive["misfire"].values > 0
    for name, chosen in (("all cylinders fire", ~misses), ("one cylinder misfires", misses)):
        if chosen.any():
            yield name, archive.isel({"misfire": np.flatnonzero(chosen)})


def _worst(archive: xr.Dataset) -> Iterator[str]:
    """Table of the worst place of each quantity, for each case, with a verdict by its limit."""
    rows = []
    of_crank = _of_crank(archive)
    for case, part in _cases(archive):
        most: dict[str, Worst] = {}
        for one in worst_of_shaft(part):
            if one.quantity == "shaft_torque_min" and one.place in of_crank:
                continue  # A crankshaft's torque always reverses
            best = most.get(one.quantity)
            if best is None or one.worse_than(best):
                most[one.quantity] = one
        for name, one in most.items():
            meaning = meaning_of(archive[name].attrs, name)
            meaning = meaning.partition(",")[0].partition(":")[0]
            unit = "" if one.unit == "1" else one.unit
            at = ", ".join(f"{key} {value:g}" for key, value in one.at.items()
                           if isinstance(value, int | float))  # fmt: skip
            verdict = _verdict(one)
            rows.append([case, meaning, one.place, f"{one.value:.4g} {unit}".strip(), at, verdict])
    if rows:
        yield table(("case", "quantity", "on", "worst", "at", "verdict"), rows, (3,))


def _of_crank(archive: xr.Dataset) -> set[str]:
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
