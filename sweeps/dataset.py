"""Labels at the mouth of the river: arrays become a dataset with names, units and provenance."""

from __future__ import annotations

import json
import math
import platform
import sys
from collections.abc import Mapping
from datetime import UTC, datetime
from functools import cache
from importlib import metadata
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd
import xarray as xr

from engine_dyn import status
from engine_dyn.cylinders import Cylinders
from engine_dyn.node import Dimension, Node
from engine_dyn.quantities import DIMENSIONS, PARAMETERS, load_coefficient_unit, select
from sweeps.plan import Plan
from sweeps.scene import DESIGN, Scene

__all__ = ["PUBLISHED", "label"]

PUBLISHED = "_published"
"""Ending of the variables that hold a scene's [reference]."""

_LABEL_NAMES = {"case": "name of the design"}
_WORD_NAMES = {
    "method": "method of the periodic speed",
    "inertia_model": "model of the moment of inertia",
    "arrangement": "arrangement of the cylinders",
}


def label(
    plan: Plan, results: Mapping[str, npt.NDArray[Any]], *, seconds: float | None = None
) -> xr.Dataset:
    """Put names, units and provenance on the results of a plan, which become part of the dataset.

    Values are converted from SI to the units of files here and nowhere else, in place.
    """
    scene = plan.scene
    dims = {s.node.name: s.dims for s in plan.stages}
    variables: dict[str, xr.Variable] = {}
    for name in plan.outputs:
        node = select(name, *scene.words)
        here = dims.get(name, plan.leaves[name].dims if name in plan.leaves else ())
        data = results[name]
        if name == "status":
            variables[name] = _variable(here, data, _status_attributes(node))
            continue
        if node.si != 1.0:
            # A second array of this size is what may not fit beside the first.
            data = np.divide(data, node.si, out=data if data.flags.writeable else None)
        variables[name] = _variable(here, data, _attributes(plan, node))
    for name, column in (scene.reference.columns if scene.reference else {}).items():
        node = select(name, *scene.words)
        attributes = _attributes(plan, node)
        attributes["long_name"] = f"{node.long_name}, published"
        attributes["comment"] = f"from {scene.reference.name}" if scene.reference else ""
        along = scene.reference.dimensions if scene.reference else ()
        variables[f"{name}{PUBLISHED}"] = _variable(along, column, attributes)
    used = {str(d) for v in variables.values() for d in v.dims}
    coordinates = {
        name: _variable(along, values, attributes, name)
        for name, (along, values, attributes) in _coordinates(plan, used).items()
    }
    dataset = xr.Dataset(variables, coords=coordinates)
    for variable in dataset.variables:
        if variable in dataset.coords or dataset[variable].dtype.kind != "f":
            dataset[variable].encoding["_FillValue"] = None
    dataset.attrs = _provenance(plan, seconds)
    return dataset


def _variable(
    dims: tuple[str, ...], data: npt.NDArray[Any], attributes: Mapping[str, Any], name: str = ""
) -> xr.Variable:
    # `fastpath`: an array or index is taken as it is. Else xarray asks whether it is one of dask's,
    # and imports dask, where it is installed, to find out.
    if dims == (name,):
        return xr.IndexVariable(dims, pd.Index(data), attributes, fastpath=True)
    return xr.Variable(dims, np.asarray(data), attributes, fastpath=True)


def _attributes(plan: Plan, node: Node) -> dict[str, str]:
    attributes = {"long_name": node.long_name}
    if node.symbol:
        attributes["symbol"] = f"${node.symbol}$"
    unit: str | None = node.unit
    if node.name == "load_coefficient" and not unit:
        exponents = plan.leaves["load_exponent"].data
        first = float(exponents.min())
        unit = load_coefficient_unit(first) if first == exponents.max() else None
        if unit is None:
            attributes["comment"] = "unit N m s^alpha: it changes with the load exponent"
    if unit is not None:
        attributes["units"] = unit
    if node.source:
        attributes["references"] = node.source
    return attributes


def _status_attributes(node: Node) -> dict[str, Any]:
    return {
        "long_name": node.long_name,
        "units": "1",
        "flag_values": np.arange(len(status.MEANINGS), dtype=np.int8),
        "flag_meanings": " ".join(status.MEANINGS),
    }


def _coordinates(plan: Plan, used: set[str]) -> dict[str, Any]:
    scene = plan.scene
    coordinates: dict[str, Any] = {}
    for name in scene.dimensions:
        if name == DESIGN:
            count = plan.sizes[DESIGN]
            coordinates[DESIGN] = (
                (DESIGN,),
                np.arange(count, dtype=np.int32),
                {"long_name": "number of the design", "units": "1"},
            )
            for column, values in scene.designs.items():
                coordinates[column] = ((DESIGN,), values, _parameter_attributes(column))
            for column, texts in scene.labels.items():
                attributes = {"long_name": _LABEL_NAMES.get(column, column), "units": "1"}
                coordinates[column] = ((DESIGN,), np.array(texts, dtype=object), attributes)
        elif name in PARAMETERS:
            coordinates[name] = ((name,), scene.axes[name], _parameter_attributes(name))
        else:
            words = scene.axes[name]
            text = _WORD_NAMES[name]
            coordinates[name] = (
                (name,),
                np.arange(len(words), dtype=np.int32),
                {"long_name": f"number of the {text}", "units": "1"},
            )
            coordinates[f"{name}_name"] = (
                (name,),
                np.array(words, dtype=object),
                {"long_name": text, "units": "1"},
            )
    for name, points in plan.points.items():
        if name in used:
            coordinates[name] = ((name,), points, _dimension_attributes(DIMENSIONS[name]))
    return coordinates


def _parameter_attributes(name: str) -> dict[str, str]:
    return _dimension_attributes(PARAMETERS[name])


def _dimension_attributes(node: Node | Dimension) -> dict[str, str]:
    attributes = {"long_name": node.long_name, "units": node.unit}
    if node.symbol:
        attributes["symbol"] = f"${node.symbol}$"
    return attributes


def _provenance(plan: Plan, seconds: float | None) -> dict[str, Any]:
    scene, engine = plan.scene, plan.scene.engine
    now = datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
    version = _version("engine-dyn")
    given = {
        name: float(plan.leaves[name].data)
        for name in PARAMETERS
        if name in plan.leaves and not plan.leaves[name].dims and name not in _MARCHING
    }
    plural = "" if plan.designs == 1 else "s"
    attributes: dict[str, Any] = {
        "Conventions": "CF-1.11",
        "title": scene.title,
        "institution": "",
        "source": f"engine-dyn {version}: periodic crank speed of piston engines",
        "history": f"{now}: engine-dyn {version} computed {plan.designs} design{plural}",
        "references": "; ".join(engine.sources),
        "engine": engine.name,
        "engine_title": engine.title,
        "engine_assumed": json.dumps(dict(engine.assumed), ensure_ascii=False),
        "parameters": json.dumps(given),
        "arrangement": _arrangements(scene),
        "solver": json.dumps(
            {
                "method": list(scene.methods),
                "inertia_model": list(scene.inertia_models),
                "closure": scene.closure,
                "tolerance": scene.tolerance,
            }
        ),
        "scene": json.dumps(scene.source, ensure_ascii=False),
        "software": "; ".join(
            [f"Python {sys.version.split()[0]}"]
            + [f"{name} {_version(name)}" for name in _PACKAGES]
        ),
        "machine": f"{platform.machine()} {platform.system()}",
    }
    if plan.unused:
        attributes["axes_without_effect"] = ", ".join(plan.unused)
    if seconds is not None:
        attributes["seconds"] = round(seconds, 3)
    return {key: value for key, value in attributes.items() if value != ""}


def _arrangements(scene: Scene) -> str:
    """JSON of the cylinders as the scene or engine describes them; empty where nothing does.

    A list where the arrangement is an axis.
    """
    if scene.arrangements:
        return json.dumps([_arrangement(cylinders) for cylinders in scene.arrangements])
    own = _arrangement(scene.own_cylinders)
    return json.dumps(own) if own else ""


def _arrangement(own: Cylinders | None) -> dict[str, Any]:
    """Throws, banks and factors of cylinders, angles in degree; empty where none are described."""
    if own is None or own.arrangement is None:
        return {}
    made = own.arrangement

    def degrees(angle: float) -> float:
        return round(math.degrees(angle), 6)

    return {
        "name": made.name,
        "period": degrees(made.period),
        "firing_angles": [degrees(c.firing_angle) for c in made.cylinders],
        "throws": [degrees(made.throws[c.throw].angle) for c in made.cylinders],
        "positions": [made.throws[c.throw].position for c in made.cylinders],
        "banks": [degrees(made.banks[c.bank]) for c in made.cylinders],
        "pressure_factor": list(own.pressure_factors),
        "mass_factor": list(own.mass_factors),
        "radius_factor": list(own.radius_factors),
    }


@cache
def _version(package: str) -> str:
    # A session does not change what is installed, and asking takes longer than solving a design.
    return metadata.version(package)


_PACKAGES = ("engine-dyn", "numpy", "numba", "xarray", "netCDF4")
_MARCHING = ("passes", "start_speed", "start_angle")
