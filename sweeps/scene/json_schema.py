"""JSON schema of scenes, for editors and for programs that write scenes.

The structure comes from the models that read scenes, names, units and ranges from the table of
parameters and quantities: nothing is said twice. What a schema cannot say, such as keys that
exclude each other, `engine-dyn plan` finds.
"""

from __future__ import annotations

import math
from typing import Any

from engine_dyn.loads.characteristic import CHARACTERISTICS
from engine_dyn.plausibility.usual_ranges import NAMES
from engine_dyn.quantities.graph import PARAMETERS, QUANTITIES
from engine_dyn.quantities.node import Node
from engine_dyn.quantities.parameters import SOLVER_COLUMNS
from engine_dyn.speed.methods import CLOSURES, INERTIA_MODELS, METHOD_NAMES
from sweeps.checks import allowed
from sweeps.dimensions import LABELS
from sweeps.reading.cylinder_keys import CYLINDER_KEYS, ArrangementTable
from sweeps.reading.silenced_warnings import ALL
from sweeps.reading.torque_tables import TORQUE_TABLE_KEYS
from sweeps.scene.toml_tables import (
    FAILURES,
    LARGEST_TOLERANCE,
    SMALLEST_TOLERANCE,
    Range,
    SceneFile,
)

__all__ = ["scene_schema"]

Schema = dict[str, Any]


def scene_schema() -> Schema:
    """JSON schema (draft 2020-12) of a scene, in JSON's types."""
    schema: Schema = _plain(SceneFile.model_json_schema())
    tables: dict[str, Schema] = schema.pop("$defs")
    tables["Range"] = _plain(Range.model_json_schema())
    written_out = _plain(ArrangementTable.model_json_schema())
    tables |= {**written_out.pop("$defs"), "ArrangementTable": written_out}
    parameters = {name: _value(node) for name, node in PARAMETERS.items()}
    free = {name: node for name, node in PARAMETERS.items() if name not in SOLVER_COLUMNS}

    properties = schema["properties"]
    properties["set"] |= _closed(
        {
            **{name: _reference(name) for name in free},
            **{name: _key_of_cylinders(name) for name in CYLINDER_KEYS},
            **{name: _text(about) for name, about in TORQUE_TABLE_KEYS.items()},
        }
    )
    several = {"type": "array", "minItems": 1, "uniqueItems": True, "items": _ONE_ARRANGEMENT}
    properties["axes"] |= _closed(
        {
            **{name: _axis(name) for name in free},
            "arrangement": {**several, "description": CYLINDER_KEYS["arrangement"]},
        }
    )
    properties["designs"] = {
        "description": properties["designs"]["description"],
        "anyOf": [
            {
                **_closed({"file": _text("the path of a CSV, netCDF or Parquet file")}),
                "type": "object",
                "required": ["file"],
            },
            {
                **_closed(
                    {
                        **{name: _list(_reference(name)) for name in PARAMETERS},
                        **{name: _list({"type": "string"}) for name in LABELS},
                    }
                ),
                "type": "object",
                "minProperties": 1,
            },
        ],
    }

    solver = tables["Solver"]["properties"]
    solver["method"] |= _one_or_several(METHOD_NAMES)
    solver["inertia_model"] |= _one_or_several(INERTIA_MODELS)
    solver["closure"]["enum"] = list(CLOSURES)
    solver["tolerance"] |= {"minimum": SMALLEST_TOLERANCE, "maximum": LARGEST_TOLERANCE}
    for name in SOLVER_COLUMNS:
        solver[name] = _reference(name)
    output = tables["Output"]["properties"]
    output["quantities"] |= {
        "minItems": 1,
        "uniqueItems": True,
        "items": {
            "oneOf": [
                {"const": name, "description": f"{node.long_name} {_unit(node)}".rstrip()}
                for name, node in QUANTITIES.items()
            ]
        },
    }
    output["fail_on"]["items"] = {"enum": list(FAILURES)}
    properties["silenced_warnings"]["items"] = {"enum": [*NAMES, ALL]}
    tables["Characteristic"]["properties"]["kind"]["enum"] = list(CHARACTERISTICS)
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Scene of engine-dyn",
        **schema,
        "$defs": {**tables, **parameters},
    }


def _plain(schema: Any) -> Any:
    """Without titles that repeat names, and without null, which TOML has not."""
    if isinstance(schema, list):
        return [_plain(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    found = {
        key: {name: _plain(item) for name, item in value.items()}
        if key in ("properties", "$defs")
        else _plain(value)
        for key, value in schema.items()
        if key != "title" and not (key == "default" and value is None)
    }
    some = [item for item in found.get("anyOf", []) if item != {"type": "null"}]
    if len(some) == 1:
        del found["anyOf"]
        found = {**some[0], **found}
    elif some:
        found["anyOf"] = some
    return found


def _value(node: Node) -> Schema:
    """One value of a parameter."""
    number: Schema = {"type": "number"}
    if node.whole:
        number["multipleOf"] = 2 if node.even else 1
    if node.low > -math.inf:
        number["minimum" if node.low_included else "exclusiveMinimum"] = node.low
    if node.high < math.inf:
        number["maximum" if node.high_included else "exclusiveMaximum"] = node.high
    about = {"description": f"{node.long_name}: {allowed(node)}"}
    if node.named:
        return {**about, "anyOf": [number, {"enum": [name for name, _ in node.named]}]}
    return {**about, **number}


def _unit(node: Node) -> str:
    return f"[{node.unit}]" if node.unit else ""  # none where it follows an exponent


def _reference(name: str) -> Schema:
    return {"$ref": f"#/$defs/{name}"}


def _axis(name: str) -> Schema:
    return {
        "description": PARAMETERS[name].long_name,
        "anyOf": [{**_list(_reference(name)), "uniqueItems": True}, _reference("Range")],
    }


def _list(items: Schema) -> Schema:
    return {"type": "array", "minItems": 1, "items": items}


def _text(about: str) -> Schema:
    return {"type": "string", "minLength": 1, "description": about}


_ONE_ARRANGEMENT: Schema = {"anyOf": [{"type": "string"}, _reference("ArrangementTable")]}


def _key_of_cylinders(name: str) -> Schema:
    if name == "arrangement":
        return {**_ONE_ARRANGEMENT, "description": CYLINDER_KEYS[name]}
    return {**_list({"type": "number"}), "description": CYLINDER_KEYS[name]}


def _one_or_several(words: tuple[str, ...]) -> Schema:
    one = {"enum": list(words)}
    return {"anyOf": [one, {**_list(one), "uniqueItems": True}]}


def _closed(properties: Schema) -> Schema:
    """Nothing but these."""
    return {"properties": properties, "additionalProperties": False}
