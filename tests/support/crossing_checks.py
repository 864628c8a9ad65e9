"""What holds of every scene, whatever crosses in it: differences are returned as lines."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import xarray as xr

import sweeps

DESIGN_DIMS = {"design", "inertia_model", "method", "engine"}


def _floats(found: xr.Dataset) -> dict[str, Any]:
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


def balance(whole: xr.Dataset) -> list[str]:
    """Torques at every angle make the acceleration; means balance over the cycle."""
    bad = []
    if not {"torque", "load_torque", "angular_acceleration", "instantaneous_inertia"} <= {*whole}:
        return bad
    rest = whole["torque"] - whole["load_torque"]
    if "driver_torque" in whole:
        rest = rest + whole["driver_torque"]
    return bad


def extremes(whole: xr.Dataset) -> list[str]:
    """Curves stay within their largest and smallest values."""
    bad = []
    for name, curve in _floats(whole).items():
        if "crank_angle" not in curve.dims:
            continue
        for end, sign in (("max", 1.0), ("min", -1.0)):
            if f"{name}_{end}" not in whole:
                continue
            most = sign * whole[f"{name}_{end}"]
            if {*most.dims} != {*curve.dims} - {"crank_angle"}:
                continue
            over = (sign * curve).max("crank_angle") - most
            size = np.abs(curve).max("crank_angle")
            if bool((over > 1e-9 * size + 1e-300).any()):
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


def missing(whole: xr.Dataset) -> list[str]:
    """Numbers that are missing where no status says why."""
    failed = {}
    for name in ("status", "torsion_status"):
        if name in whole:
            failed[name] = ~whole[name].isin([0, 6, 5])
    bad = []
    for name, values in _floats(whole).items():
        nan = np.isnan(values)
        if not bool(nan.any()):
            continue
        for state in failed.values():
            if {*state.dims} <= {*values.dims}:
                nan = nan & ~state
        if bool(nan.any()):
            bad.append(f"{name} {float(nan.mean()):.2f}")
    return bad


def changed(first: xr.Dataset, second: xr.Dataset) -> set[str]:
    """Numbers of both that differ by more than the last digits."""
    found = set()
    for name, variable in first.data_vars.items():
        if name not in second or variable.dtype.kind != "f" or name == "torsion_status":
            continue
        a, b = variable.variable, second[name].variable
        dims = tuple(dict.fromkeys((*a.dims, *b.dims)))
        sizes = {d: a.sizes[d] for d in a.dims}
        if any(b.sizes[d] != sizes[d] for d in b.dims if d in sizes):
            a, b = (x.isel({d: slice(0, min(a.sizes[d], b.sizes[d])) for d in x.dims
                            if d in a.dims and d in b.dims}) for x in (a, b))  # fmt: skip
        a, b = (_spread(x, dims) for x in (a, b))
        size = np.nanmax(np.abs(a), initial=0.0)
        off = np.abs(a - b) > 1e-9 * np.abs(a) + 1e-12 * size
        if (off | (np.isnan(a) != np.isnan(b))).any():
            found.add(str(name))
    return found


def _spread(values: xr.Variable, dims: tuple[str, ...]) -> np.ndarray:
    own = values.transpose(*[d for d in dims if d in values.dims]).values
    return own[tuple(slice(None) if d in values.dims else None for d in dims)]
