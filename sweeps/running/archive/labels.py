"""Labels at the mouth of the river: arrays get names, units and provenance.

`describe` knows all of them, without any array of results; a dataset (`label`) and an archive that
is written block by block (`sweeps.running.archive.netcdf`) are both made from what it says.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from engine_dyn import status
from engine_dyn.engine import Engine
from engine_dyn.forces.balance.lines import is_boxer
from engine_dyn.geometry.articulated_rod import ArticulatedRod
from engine_dyn.geometry.cylinders import Cylinders
from engine_dyn.plausibility.usual_ranges import Check
from engine_dyn.quantities.each_cylinder import OF_CYLINDER, with_values
from engine_dyn.quantities.features.transient import FEATURE as TRANSIENT
from engine_dyn.quantities.graph import DIMENSIONS, PARAMETERS
from engine_dyn.quantities.loads import load_coefficient_unit
from engine_dyn.quantities.node import Dimension, Node
from engine_dyn.units import RPM
from sweeps.base.dimensions import (
    ARRANGEMENT,
    DESIGN,
    ENGINE,
    PARAMETER,
    PUBLISHED,
    UNCERTAIN,
    WORD_AXES,
)
from sweeps.base.errors import printable
from sweeps.base.naming import named, renamed
from sweeps.base.netcdf import ARCHIVE_FORMAT
from sweeps.running.archive.provenance import provenance
from sweeps.running.archive.warnings import ATTRIBUTE, Watch
from sweeps.scene.features.indicator_files import NOT_PEGGED
from sweeps.scene.model import Scene
from sweeps.scene.plan.plan import Plan
from sweeps.scene.plan.plausibility import implausible_results, plausibility_warnings
from sweeps.scene.plan.variations import KIND, KINDS

if TYPE_CHECKING:
    import xarray as xr

    from engine_dyn.torsion.excitation import Excitation


@dataclass(frozen=True, eq=False)
class Variable:
    """One variable of an archive."""

    dims: tuple[str, ...]  # Dimensions of the variable
    attributes: Mapping[str, Any]  # Texts, numbers and arrays of numbers by the names of attributes
    # Values in the units of files, where they are known before the computation.
    data: npt.NDArray[Any] | None = None
    kind: str = "f8"  # NumPy's code for the type of the numbers
    si: float = 1.0  # SI value of one unit of the variable


@dataclass(frozen=True, eq=False)
class Labels:
    """All that an archive says beside its results: see `describe`.

    `warnings` are lines about implausible values of what is given, and `watched` the ranges of
    results; what is outside is known when these are there (`sweeps.running.archive.warnings`).
    """

    sizes: Mapping[str, int]
    variables: Mapping[str, Variable]
    coordinates: Mapping[str, Variable]
    attributes: Mapping[str, Any]
    warnings: tuple[str, ...] = ()
    watched: Mapping[str, Check] = field(default_factory=dict)

    def shape(self, name: str) -> tuple[int, ...]:
        """Lengths of a variable's dimensions."""
        return tuple(self.sizes[d] for d in self.variables[name].dims)

    def watch(self) -> Watch:
        """Return what looks at results while they are put."""
        sizes = {
            name: {d: self.sizes[d] for d in self.variables[name].dims} for name in self.watched
        }
        axes = {
            name: (str(axis.attributes.get("units", "")).removeprefix("1"), axis.data)
            for name, axis in self.coordinates.items()
            if axis.data is not None and axis.data.dtype.kind in "if"
        }
        for name in axes:
            words = self.coordinates.get(f"{name}_name")
            if words is not None and words.data is not None:
                axes[name] = "", words.data
        return Watch(self.warnings, self.watched, sizes, axes)


def describe(
    plan: Plan, *, seconds: float | None = None, command: str = "", single: bool = False,
    machine: str = "", full_paths: bool = False,
) -> Labels:  # fmt: skip
    """Names, dimensions, units and provenance of what a plan computes.

    `seconds` is how long that took, `command` the command line that asked for it, and `machine`
    what computed it, unless it is this machine. With `single`, results are kept in 32 bits; with
    `full_paths`, names of files keep their folders, else they begin in that of the scene.
    """
    scene = plan.scene
    variables: dict[str, Variable] = {}
    for name in plan.outputs:
        node, dims = plan.computed[name].node, plan.dims(name)
        if name == "status":
            words = node.meanings or status.OF_SPEED
            variables[name] = Variable(dims, flags(name, node.long_name, words), kind="i1")
        elif name.endswith(KIND):
            variables[name] = Variable(dims, flags(name, node.long_name, KINDS), kind="i1")
        else:
            kind = "f4" if single else "f8"
            about = _of_several(plan, name) if plan.parts else _attributes(plan, node)
            if node.meanings:
                about = {**about, **flags(name, node.long_name, node.meanings, kind)}
            variables[name] = Variable(dims, about, kind=kind, si=node.si)
    if scene.reference is not None:
        for name, column in scene.reference.columns.items():
            node = scene.node(name)
            attributes = {
                **renamed(_attributes(plan, node), "{}, published"),
                "comment": f"from {printable(scene.reference.file)}",
            }
            variables[f"{name}{PUBLISHED}"] = Variable(
                scene.reference.dimensions, attributes, column
            )
    coordinates = _coordinates(plan, {d for v in variables.values() for d in v.dims})
    dims = tuple(d for v in (*coordinates.values(), *variables.values()) for d in v.dims)
    numbers = "float32" if single else "float64"
    attributes = _about(plan) | provenance(
        plan, seconds=seconds, command=command, numbers=numbers, machine=machine,
        full_paths=full_paths,
    )  # fmt: skip
    return Labels(
        {d: plan.sizes[d] for d in dims}, variables, coordinates, attributes,
        plausibility_warnings(plan), implausible_results(plan),
    )  # fmt: skip


def _of_several(plan: Plan, name: str) -> dict[str, Any]:
    """Attributes of a result of several engines: those of the first engine that has it."""
    plans = [part.plan for part in (plan.whole or plan).parts]
    each = [_attributes(one, one.scene.node(name)) for one in plans if name in one.outputs]
    attributes = each[0]
    if any(other.get("units") != attributes.get("units") for other in each):
        attributes.pop("units", None)
        attributes["comment"] = (
            "no single unit: it depends on the load exponent, which differs between the engines"
        )
    lacking = [_engine_of(one.scene) for one in plans if name not in one.outputs]
    if lacking:
        attributes["comment"] = f"not available for {', '.join(dict.fromkeys(lacking))}"
    return attributes


def _engine_of(scene: Scene) -> str:
    """Name of one of several engines, with its arrangement where arrangements differ."""
    own = scene.own_cylinders
    settings = scene.source.get("set") or {}
    if own is None or own.arrangement is None or ARRANGEMENT not in settings:
        return scene.engine.name
    return f"{scene.engine.name}, {own.arrangement.name}"


def _about_several(plan: Plan) -> dict[str, str]:
    """Attributes of an archive of several engines: those of one engine, for each of them."""
    # `engine`, `engine_title` and `references` list all engines. Assumptions and parameters that
    # differ are stated by engine, common ones once. `arrangement` is a list, one for each engine or
    # arrangement that lies along an axis.
    each = [_about_engine(part.plan) for part in (plan.whole or plan).parts]
    first = {attributes["engine"]: attributes for attributes in each}
    names = list(first)
    assumed = {engine: json.loads(a["engine_assumed"]) for engine, a in first.items()}
    given = [json.loads(attributes["parameters"]) for attributes in each]
    arrangements = [json.loads(a["arrangement"]) if a["arrangement"] else {} for a in each]
    if len(first) > 1 and all(arrangements):
        arrangements = [
            {**arrangement, "engine": a["engine"]}
            for arrangement, a in zip(arrangements, each, strict=True)
        ]
    told = {f"{engine}: {key}": why for engine, own in assumed.items() for key, why in own.items()}
    return {
        "references": "; ".join(
            dict.fromkeys(source for a in first.values() for source in a["references"].split("; "))
        ),
        "engine": ", ".join(first),
        # Titles of figures have little room; one engine with several arrangements is named once.
        "engine_title": f"engines {', '.join(names)}" if names[1:] else f"cylinders of {names[0]}",
        "engine_assumed": json.dumps(told if names[1:] else assumed[names[0]], ensure_ascii=False),
        "engine_values": "",
        "parameters": json.dumps(
            {k: v for k, v in given[0].items() if all(other.get(k) == v for other in given)}
        ),
        "arrangement": json.dumps(arrangements) if all(arrangements) else "",
    }


def to_file_units(variable: Variable, data: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Results in the units of files, in place where they can be written to.

    Here and nowhere else; a second array of this size is what may not fit beside the first.
    """
    if variable.si == 1.0:
        return data
    return np.divide(data, variable.si, out=data if data.flags.writeable else None)


def as_stored(labels: Labels, results: dict[str, npt.NDArray[Any]]) -> dict[str, npt.NDArray[Any]]:
    """Results in the units and the kinds of number that their archive stores.

    They are in SI units, and are converted in place where that is possible.
    """
    stored = {}
    for name in list(results):
        variable = labels.variables[name]
        array = to_file_units(variable, results.pop(name))
        if array.dtype.str[1:] != variable.kind:
            with np.errstate(over="ignore"):  # A number too large for 32 bits becomes infinite
                array = array.astype(variable.kind)
        stored[name] = array
    return stored


def label(
    plan: Plan, results: Mapping[str, npt.NDArray[Any]], *, seconds: float | None = None
) -> xr.Dataset:
    """Put names, units and provenance on the results of a plan, which become part of the dataset.

    Values are converted from SI to the units of files in place.
    """
    labels = describe(plan, seconds=seconds)
    data = {
        name: to_file_units(v, results[name])
        for name, v in labels.variables.items()
        if v.data is None
    }
    return dataset_with_warnings(labels, data)


def dataset_with_warnings(labels: Labels, data: Mapping[str, npt.NDArray[Any]]) -> xr.Dataset:
    """Dataset of labels and of results in the units of files, which are looked at."""
    watch = labels.watch()
    for name, values in data.items():
        watch.look(name, (), values)
    dataset = dataset_of(labels, data)
    dataset.attrs[ATTRIBUTE] = watch.text()
    return dataset


def dataset_of(labels: Labels, data: Mapping[str, Any]) -> xr.Dataset:
    """Dataset of labels and of arrays in the units of files, which may be lazy ones of xarray."""
    import xarray as xr

    variables = {
        name: _variable(v.dims, data[name] if v.data is None else v.data, v.attributes)
        for name, v in labels.variables.items()
    }
    coordinates = {
        name: _variable(v.dims, v.data, v.attributes, name)
        for name, v in labels.coordinates.items()
        if v.data is not None
    }
    dataset = xr.Dataset(variables, coords=coordinates)
    for name, variable in dataset.variables.items():
        if name in dataset.coords or variable.dtype.kind != "f":
            variable.encoding["_FillValue"] = None
    dataset.attrs = dict(labels.attributes)
    return dataset


def _variable(
    dims: tuple[str, ...], data: Any, attributes: Mapping[str, Any], name: str = ""
) -> xr.Variable:
    import pandas as pd
    import xarray as xr
    from xarray.core.indexing import ExplicitlyIndexed

    # `fastpath` takes an array or index as it is. Otherwise xarray imports dask, where it is
    # installed, to ask whether the array belongs to it.
    if dims == (name,):
        return xr.IndexVariable(dims, pd.Index(data), attributes, fastpath=True)
    lazy = isinstance(data, ExplicitlyIndexed)
    return xr.Variable(dims, data if lazy else np.asarray(data), attributes, fastpath=True)


def _attributes(plan: Plan, node: Node) -> dict[str, str]:
    meaning = node.long_name
    if node.name == "pressure" and _as_recorded(plan.scene):
        meaning = "pressure in cylinder 1, level as recorded"
    attributes = named(node.name, meaning, node.unit)
    if node.symbol:
        attributes["symbol"] = f"${node.symbol}$"
    unit: str | None = node.unit
    if node.name == "load_coefficient" and not unit:
        exponents = plan.leaves["load_exponent"].data
        first = float(exponents.min())
        unit = load_coefficient_unit(first) if first == exponents.max() else None
        if unit is None:
            attributes["comment"] = "unit N m s^alpha: it depends on the load exponent"
    if unit is not None:
        attributes["units"] = unit
    if node.source:
        attributes["references"] = node.source
    return attributes


def _as_recorded(scene: Scene) -> bool:
    """Whether the pressure was recorded, and its level was not made absolute."""
    if scene.indicator is not None:
        return any(NOT_PEGGED in note for note in scene.indicator_notes)
    return any(" level: " in f" {line}" for line in scene.engine.diagram_warnings)


def flags(name: str, meaning: str, meanings: Sequence[str], kind: str = "i1") -> dict[str, Any]:
    """Attributes of a variable whose numbers stand for words; `kind` is that of its numbers."""
    return {
        **named(name, meaning),
        "units": "1",
        "flag_values": np.arange(len(meanings), dtype=kind),
        "flag_meanings": " ".join(meanings),
    }


def _coordinates(plan: Plan, used: set[str]) -> dict[str, Variable]:
    """Coordinates of the axes of a scene, and of other dimensions that are used."""
    scene = plan.scene
    coordinates: dict[str, Variable] = {}
    for name in scene.dimensions:
        if name in PARAMETERS:
            coordinates[name] = _of_values(name, scene.axes[name], PARAMETERS[name])
            continue
        what = "design" if name == DESIGN else WORD_AXES[name].long_name
        about = {**named(name, f"number of the {what}"), "units": "1"}
        coordinates[name] = Variable((name,), about, np.arange(plan.sizes[name], dtype=np.int32))
        if name != DESIGN:
            coordinates[f"{name}_name"] = _of_texts(
                name, _called(scene, name, scene.axes[name]), what
            )
            continue
        for column, values in scene.designs.items():
            coordinates[column] = _of_values(DESIGN, values, PARAMETERS[column])
        for column, texts in scene.labels.items():
            coordinates[column] = _of_texts(DESIGN, texts, WORD_AXES[column].long_name, column)
    for name, points in plan.points.items():
        if name in used:
            coordinates[name] = _of_values(name, points, DIMENSIONS[name])
            if name == "mode" and (told := plan.modes):
                about = {**coordinates[name].attributes, "comment": told}
                coordinates[name] = replace(coordinates[name], attributes=about)
    shaft = scene.engine.shaft
    if shaft is not None and not plan.parts:
        for name, texts in (("disc", shaft.discs), ("shaft", shaft.shaft_names)):
            if name in used:
                coordinates[f"{name}_name"] = _of_texts(name, texts, f"name of the {name}")
    for dimension in (d for d in (PARAMETER, UNCERTAIN) if d in used):
        for fact, text in (("unit", "unit"), ("long_name", "meaning")):
            facts = [getattr(PARAMETERS[key], fact) for key in plan.points[dimension]]
            coordinates[f"{dimension}_{fact}"] = _of_texts(
                dimension, facts, f"{text} of the parameter"
            )
    return coordinates


def _called(scene: Scene, name: str, texts: Iterable[Any]) -> list[str]:
    """Texts of an axis; engines by their names."""
    # A scene may name an engine by the path of its file, which says less than its name. A table of
    # designs keeps paths, because it is read back where the archive is computed again.
    if name != ENGINE:
        return list(texts)
    names: dict[str, str] = {}
    for one in scene.ordinary_scenes:
        given = one.source.get(ENGINE)
        if isinstance(given, str):
            names[given] = one.engine.name
    return [names.get(text, text) for text in texts]


def _of_values(dimension: str, values: Any, node: Node | Dimension) -> Variable:
    """Coordinate of numbers, or of words that are the points of a dimension."""
    attributes = {**named(node.name, node.long_name, node.unit), "units": node.unit}
    if node.symbol:
        attributes["symbol"] = f"${node.symbol}$"
    return Variable((dimension,), attributes, np.asarray(values))


def _of_texts(dimension: str, texts: Any, meaning: str, name: str = "") -> Variable:
    """Coordinate of texts; `name` is its own if it is not that of names along the dimension."""
    attributes = {**named(name or f"{dimension}_name", meaning), "units": "1"}
    return Variable((dimension,), attributes, np.array(texts, dtype=object))


def _about(plan: Plan) -> dict[str, Any]:
    """Attributes that describe what was computed."""
    scene = plan.scene
    attributes: dict[str, Any] = {
        "Conventions": "CF-1.11",
        "archive_format": str(ARCHIVE_FORMAT),
        "title": scene.title,
        **(_about_several(plan) if plan.parts else _about_engine(plan)),
        "solver": json.dumps(
            {
                "method": list(scene.methods),
                "inertia_model": list(scene.inertia_models),
                "closure": scene.closure,
                "tolerance": scene.tolerance,
            }
        ),
        "axes_without_effect": ", ".join(plan.unused),
    }
    return {key: value for key, value in attributes.items() if value != ""}


def _about_engine(plan: Plan) -> dict[str, str]:
    """Attributes that describe the engine of a plan."""
    leaves = plan.leaves
    # Places of the parameters that archives state, in their order
    places = {
        name: place
        for place, name in enumerate(PARAMETERS)
        if name not in ("passes", "start_speed", "start_angle")
    }
    names = sorted(places.keys() & leaves.keys(), key=places.__getitem__)
    given = {name: float(leaves[name].data) for name in names if not leaves[name].dims}
    described = _of_engine(plan.scene.engine)
    if "bank_offset" not in leaves and any(s.node.name == "bank_offset" for s in plan.stages):
        boxers = any(map(is_boxer, leaves["cylinders_by_count"].data.values()))
        offset = (
            "the cylinder_spacing of a boxer" if boxers else "0, the rods of a pair in one plane"
        )
        assumed = {**plan.scene.engine.assumed, "bank_offset": f"not given: {offset}"}
        described = {**described, "engine_assumed": json.dumps(assumed, ensure_ascii=False)}
    return {
        **described,
        "parameters": json.dumps(given),
        "arrangement": _arrangements(plan.scene),
        "shaft": _shaft(plan.scene),
        "transient_limits": _transient_limits(plan.scene.engine),
    }


def _transient_limits(engine: Engine) -> str:
    """JSON of changes of load [s] and limits after them, as scenes give them: percent and s."""
    part = TRANSIENT.of(engine)
    if part is None or part.limits is None:
        return ""
    fall, rise, band, recovery = part.limits
    return json.dumps(
        {"fall": 100.0 * fall, "rise": 100.0 * rise, "band": 100.0 * band, "recovery": recovery,
         "changes": part.marks.tolist()}
    )  # fmt: skip


@lru_cache(maxsize=16)
def _of_engine(engine: Engine) -> dict[str, str]:
    """Attributes on the engine in every archive."""
    return {
        "references": "; ".join(engine.sources),
        "engine": engine.name,
        "engine_title": engine.title,
        "engine_assumed": json.dumps(dict(engine.assumed), ensure_ascii=False),
        "engine_values": json.dumps(dict(engine.values)),
    }


def _arrangements(scene: Scene) -> str:
    """JSON of the cylinders of the scene; empty where their throws are not known."""
    # The JSON is a list where the scene has an axis of arrangements; it is empty where a firing
    # angle or the number of cylinders varies over the results.
    keys = {key: PARAMETERS[key].si for key in scene.cylinder_keys}
    if any(OF_CYLINDER[k].what == "firing_angle" and k not in scene.settings for k in keys):
        return ""
    fixed = {k: scene.settings[k] * si for k, si in keys.items() if k in scene.settings}
    bores = {k: scene.given_or_own(k) for k in scene.cylinder_set_keys if k.startswith("bore")}
    if not any(one.dims for one in bores.values()):
        fixed |= {k: float(one.values[0]) for k, one in bores.items()}
    if scene.arrangements:
        each = [_arrangement(with_values(engine, fixed)) for engine in scene.arrangements]
        return json.dumps(each)
    if len(scene.counts) > 1:
        return ""
    own = _arrangement(with_values(scene.cylinders_by_count[scene.counts[0]], fixed))
    return json.dumps(own) if own else ""


def _shaft(scene: Scene) -> str:
    """JSON of the discs joined by shafts and gears, and of those with a role, counted from 1."""
    # The text is empty without a shaft. Rings of dampers and then pendulums are the last discs.
    shaft = scene.engine.shaft
    if shaft is None:
        return ""
    pairs = {"shafts": shaft.shafts, "gears": shaft.gears}
    joined = {key: [[a + 1, b + 1] for a, b in numbers] for key, numbers in pairs.items()}
    roles = {"flywheel": shaft.flywheel, "load": shaft.load, "free_end": shaft.free_end}
    return json.dumps({
        **joined, "throws": [disc + 1 for disc in shaft.throws],
        **{role: disc + 1 for role, disc in roles.items()},
        "dampers": shaft.dampers, "pendulums": shaft.pendulums,
        "excitations": [_excitation(one) for one in shaft.excitations],
    })  # fmt: skip


def _excitation(one: Excitation) -> dict[str, Any]:
    """Name, disc and orders of an excitation at its reference speed, or the table's lowest one."""
    size = np.abs(one.own_harmonics(one.within))
    counting = np.sort(np.argsort(-size)[:12])
    return {
        "name": one.name, "disc": one.disc + 1, "power": one.power, "speed": one.within / RPM,
        "table": one.speeds.size > 0, "mean": float(one.mean(one.within)),
        "orders": one.orders[counting].tolist(), "amplitudes": size[counting].tolist(),
    }  # fmt: skip


@lru_cache(maxsize=64)
def _arrangement(own: Cylinders | None) -> dict[str, Any]:
    """Throws, banks and factors of cylinders, angles in degree; empty without a description."""
    if own is None or own.arrangement is None:
        return {}
    made = own.arrangement

    def degrees(angle: float) -> float:
        return round(math.degrees(angle), 6)

    def rod(one: ArticulatedRod | None) -> dict[str, float] | None:
        return one and {**one._asdict(), "angle": degrees(one.angle), "bank": degrees(one.bank)}

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
        **({"bore_factor": [one.bore_factor for one in own.members]} if own.several_makes else {}),
        **({"sides": list(made.cylinder_sides)} if own.both_sides else {}),
        **({"articulated_rods": [rod(one.rod) for one in own.members]}
           if own.articulated else {}),
    }  # fmt: skip
