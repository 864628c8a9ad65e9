"""What holds of every scene, whatever crosses in it: differences are returned as lines."""

from __future__ import annotations

import copy
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

import sweeps
from engine_dyn.speed.fields import INERTIA_MODELS
from sweeps import SceneError
from sweeps.running.compute.options import Options
from sweeps.running.join.extend import extend
from sweeps.running.join.merge import merge
from sweeps.scene.crossings import CROSSINGS
from tests.support.archives import run, shards


def _floats(found: xr.Dataset) -> dict[str, xr.DataArray]:
    return {str(name): v for name, v in found.data_vars.items() if v.dtype.kind == "f"}


def differing(found: xr.Dataset, expected: xr.Dataset) -> list[str]:
    """Names of results that both have, whose bits differ; those that one lacks."""
    bad = [f"{name} lacks" for name in {*found.data_vars} ^ {*expected.data_vars}]
    for name in {*found.data_vars} & {*expected.data_vars}:
        theirs = expected[name]
        ours = found[name]
        if {*ours.dims} != {*theirs.dims}:
            bad.append(f"{name} has {ours.dims}, not {theirs.dims}")
            continue
        a, b = ours.transpose(*theirs.dims).values, theirs.values
        if a.shape != b.shape:
            bad.append(f"{name} has shape {a.shape}, not {b.shape}")
            continue
        same = np.asarray(a == b)
        if b.dtype.kind == "f":
            same |= np.isnan(a) & np.isnan(b)
        if not same.all():
            bad.append(f"{name} differs")
    return sorted(map(str, bad))


def axes_of(scene: dict[str, Any]) -> dict[str, list[Any]]:
    """Axes of a scene, those of words that stand elsewhere among them."""
    found = dict(scene.get("axes", {}))
    for key in ("method", "inertia_model"):
        if isinstance(value := scene.get("solver", {}).get(key), list):
            found[key] = value
    return found


def _with_axes(scene: dict[str, Any], axes: dict[str, list[Any]]) -> dict[str, Any]:
    scene = copy.deepcopy(scene)
    for key in ("method", "inertia_model"):
        if key in axes:
            scene["solver"][key] = axes[key]
    scene["axes"] = {key: axes[key] for key in scene["axes"]}
    return scene


def alone(scene: dict[str, Any], whole: xr.Dataset) -> list[str]:
    """The last point of every axis in a scene of its own has the same bits."""
    axes = axes_of(scene)
    one = _with_axes(scene, {key: values[-1:] for key, values in axes.items()})
    if "designs" in one:
        one["designs"] = {key: values[-1:] for key, values in one["designs"].items()}
    found = sweeps.run(one)
    dims = {
        d: [-1]
        for d in [*axes, "design"]
        if d in whole.dims and not (d == "design" and "designs" not in one)
    }
    chosen = whole.isel(dims)
    cut = {d: slice(0, found.sizes[d]) for d in found.dims if d in chosen.dims
           and found.sizes[d] < chosen.sizes[d]}  # fmt: skip
    if cut.pop("order", None):
        chosen = chosen.sel(order=found["order"].values)
    chosen = chosen.isel(cut)
    lone = [d for d in dims if found.sizes.get(d, 1) == 1]
    return differing(found.squeeze([d for d in lone if d in found.dims]), chosen.squeeze(lone))


def backwards(scene: dict[str, Any], whole: xr.Dataset) -> list[str]:
    """Axes in another order and backwards have the same bits."""
    axes = axes_of(scene)
    other = _with_axes(scene, {key: axes[key][::-1] for key in reversed(axes)})
    other["axes"] = dict(reversed(other["axes"].items()))
    if "designs" in other:
        other["designs"] = {key: values[::-1] for key, values in other["designs"].items()}
    found = sweeps.run(other)
    dims = [d for d in [*axes, *(["design"] if "designs" in scene else [])] if d in whole.dims]
    return differing(found.isel({d: slice(None, None, -1) for d in dims}), whole)


def in_parts(scene: dict[str, Any], whole: xr.Dataset) -> list[str]:
    """Archives of two shards, merged, have the bits of the whole."""
    with tempfile.TemporaryDirectory() as folder:
        try:
            parts = shards(scene, 2, Path(folder))
        except SceneError as error:
            return [] if "the longest axis has" in str(error) else [str(error)]
        merge(parts, Path(folder) / "whole.nc", Options())
        with sweeps.open(Path(folder) / "whole.nc") as opened:
            return differing(opened.load(), whole)


def extended(scene: dict[str, Any], whole: xr.Dataset) -> list[str]:
    """An archive that lacks the last value of an axis has the bits of the whole with it."""
    long = [key for key, values in scene["axes"].items()
            if len(values) > 1 and isinstance(values[0], float)]  # fmt: skip
    if not long:
        return []
    (*first, last) = scene["axes"][long[-1]]
    axes = {**scene["axes"], long[-1]: first}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "short.nc"
        run({**scene, "axes": axes}, path)
        try:
            extend(path, long[-1], [last], Options())
        except SceneError as error:
            return (
                []
                if any(row.says.split("{")[0] in str(error) for row in CROSSINGS)
                else [str(error)]
            )
        with sweeps.open(path) as opened:
            return differing(opened.load(), whole)


STIFF = 1e13
"""N m/rad: with the heavy flywheel, shafts so stiff leave a rigid engine."""


def stiff(scene: dict[str, Any]) -> list[str]:
    """With stiff shafts and a heavy flywheel, the elastic engine has the delta of the rigid one."""
    if "delta_elastic" not in scene["output"]["quantities"]:  # a given torque has no throws
        return []
    if "wanted_delta" in {**scene["set"], **scene["axes"]}:  # its flywheel is as light as may be
        return []
    if scene.get("solver", {}).get("method") == "thesis":  # its few passes end before the period
        return []
    scene = copy.deepcopy(scene)
    heavy = 1e4 if "double_acting" in Path(scene["engine"]).read_text(encoding="utf-8") else 150.0
    for disc in scene["shaft"]["discs"]:
        if disc["name"] == "flywheel":
            disc["inertia"] = heavy
    for one in scene["shaft"]["shafts"]:
        one.pop("stiffness_over_torque", None)
        one["stiffness"] = STIFF
    if "shaft_stiffness_1" in scene["axes"]:
        scene["axes"]["shaft_stiffness_1"] = [STIFF, 2.0 * STIFF]
    scene["output"] = {"quantities": ["delta", "delta_elastic"]}
    found = sweeps.run(scene)
    off = abs(found["delta_elastic"] / found["delta"] - 1.0)
    bad = off > 2e-3
    both = np.isfinite(found["delta"]) == np.isfinite(found["delta_elastic"])
    lines = [f"stiff limit missed by {float(off.max()):.2g}"] if bool(bad.any()) else []
    return lines if bool(both.all()) else [*lines, "one delta is missing in the stiff limit"]


LACK = 1e-7
"""Torque that may be missing in the balance, over the range of the engine's torque."""


def balance(whole: xr.Dataset, model: str = "constant") -> list[str]:
    """Newton's law at every angle: the torques make the angular acceleration of one inertia."""
    names = ("torque", "load_torque", "driver_torque", "angular_acceleration")
    if not {*names} <= {*map(str, whole.data_vars)}:
        return []
    if "inertia_model" in whole.dims:
        codes = whole["inertia_model"].values
        each = (balance(whole.isel(inertia_model=place), INERTIA_MODELS[int(code)])
                for place, code in enumerate(codes))  # fmt: skip
        return [line for lines in each for line in lines]
    torque, load, driver, acceleration = (whole[name] for name in names)
    rest = torque - load + driver
    if model == "variable":
        if not {"inertia_torque", "inertia_torque_actual"} <= {*map(str, whole.data_vars)}:
            return []
        rest = rest - whole["inertia_torque"] + whole["inertia_torque_actual"]
    over = "crank_angle"
    inertia = (rest * acceleration).sum(over) / (acceleration**2).sum(over)
    off = abs(rest - inertia * acceleration).max(over)
    size = torque.max(over) - torque.min(over)
    if model == "constant" and "shaft_inertia" not in whole and "inertia" in whole.coords:
        given = whole["inertia"] + whole.get("idler_gear_inertia", 0.0)
        off = off + size * abs(inertia / given - 1.0)
    if {"delta_error", "omega"} <= {*map(str, whole.data_vars)}:
        off = (off - _error_of_steep_torques(whole)).clip(min=0.0)
    lack = (off / size).where(whole["status"] == 0) if "status" in whole else off / size
    bad = bool((lack > LACK).any())
    return [f"torques do not balance by {float(lack.max()):.2g}"] if bad else []


def _error_of_steep_torques(whole: xr.Dataset) -> xr.DataArray:
    """Torque that a motor or load gives for the error of the speed that `delta_error` states."""
    over, omega = "crank_angle", whole["omega"]
    outer = whole["driver_torque"] - whole["load_torque"]
    swing = omega.max(over) - omega.min(over)
    slope = (outer.max(over) - outer.min(over)) / swing
    return (slope * whole["delta_error"] * omega.mean(over)).fillna(0.0)


def extremes(whole: xr.Dataset) -> list[str]:
    """Curves stay within their largest and smallest values."""
    bad = []
    for name, curve in _floats(whole).items():
        if "crank_angle" not in curve.dims:
            continue
        for end, sign in (("max", 1.0), ("min", -1.0)):
            if f"{name}_{end}" not in whole:
                continue
            most: xr.DataArray = sign * whole[f"{name}_{end}"]
            if {*most.dims} != {*curve.dims} - {"crank_angle"}:
                continue
            over = (sign * curve).max("crank_angle") - most
            size = abs(curve).max("crank_angle")
            # Forces that cancel are rounding, some 1e-11 N.
            if bool((over > 1e-9 * size + 1e-9).any()):
                bad.append(f"{name} beyond its {end} by {float((over / size).max()):.2g}")
    return bad


SUMS = [
    ("torque", ("gas_torque", "inertia_torque", "-instantaneous_friction_torque")),
    ("overturning_moment", ("gas_overturning_moment", "inertia_overturning_moment")),
    ("piston_force", ("gas_force", "inertia_force")),
    ("tangential_force", ("gas_tangential_force", "inertia_tangential_force")),
    ("wall_thrust", ("gas_wall_thrust", "inertia_wall_thrust")),
    ("rod_force", ("gas_rod_force", "inertia_rod_force")),
    ("bmep", ("imep", "-fmep")),
    ("net_torque", ("torque", "gravity_torque", "-piston_friction_torque")),
]  # fmt: skip


def sums(whole: xr.Dataset) -> list[str]:
    bad = []
    for name, parts in SUMS:
        if not {name, *(part.lstrip("-") for part in parts)} <= {*map(str, whole)}:
            continue
        total = sum((-1.0 if p[0] == "-" else 1.0) * whole[p.lstrip("-")] for p in parts)
        size = sum(float(np.nanmax(np.abs(whole[p.lstrip("-")].values))) for p in parts)
        off = np.abs((whole[name] - total).values)
        if np.nanmax(off, initial=0.0) > 1e-9 * size:
            bad.append(f"{name} is not {parts}: {np.nanmax(off) / size:.2g}")
    return bad


WITH_STATUS = {
    "status": ("delta", "omega_max", "omega_min"),
    "torsion_status": ("delta_elastic", "shaft_torque_half_range"),
    "passing_status": ("shaft_torque_in_passing",),
}
"""Outcomes, and numbers that are missing where they say so and nowhere else."""


def missing(whole: xr.Dataset) -> list[str]:
    """Numbers that are missing where the status has no reason for it, or the reverse."""
    bad = []
    for state, names in WITH_STATUS.items():
        for name in (n for n in names if state in whole and n in whole):
            if {*whole[state].dims} <= {*whole[name].dims}:
                has, should = np.isfinite(whole[name]), whole[state].isin([0, 5, 6])
                if bool((has != should).any()):
                    bad.append(f"{name} has numbers otherwise than {state} says")
    return bad


def changed(first: xr.Dataset, second: xr.Dataset, within: float = 1e-9) -> set[str]:
    """Numbers of both that differ by more than the last digits."""
    found = set()
    for name, variable in first.data_vars.items():
        if name not in second or variable.dtype.kind != "f" or name.endswith("_status"):
            continue
        a, b = variable.variable, second[name].variable
        dims = tuple(map(str, dict.fromkeys((*a.dims, *b.dims))))
        sizes = {d: a.sizes[d] for d in a.dims}
        if any(b.sizes[d] != sizes[d] for d in b.dims if d in sizes):
            a, b = (x.isel({d: slice(0, min(a.sizes[d], b.sizes[d])) for d in x.dims
                            if d in a.dims and d in b.dims}) for x in (a, b))  # fmt: skip
        one, other = (_spread(x, dims) for x in (a, b))
        size = np.nanmax(np.abs(one), initial=0.0)
        off = np.abs(one - other) > within * np.abs(one) + 1e-3 * within * size
        if (off | (np.isnan(one) != np.isnan(other))).any():
            found.add(str(name))
    return found


def _spread(values: xr.Variable, dims: tuple[str, ...]) -> np.ndarray:
    own = values.transpose(*[d for d in dims if d in values.dims]).values
    return own[tuple(slice(None) if d in values.dims else None for d in dims)]
