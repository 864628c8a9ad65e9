"""JSON schema of scenes, for editors and for programs that write scenes.

The structure comes from the models that read scenes, names, units and ranges from the table of
parameters and quantities: nothing is said twice. What a schema cannot say, such as keys that
exclude each other, `engine-dyn plan` finds.
"""

from __future__ import annotations

import math
from dataclasses import MISSING, fields
from typing import Any

from engine_dyn.geometry.arrangement import MOST_CYLINDERS
from engine_dyn.pressure.diesel_cycle import DieselCycle
from engine_dyn.pressure.file_fields import MEANINGS, FileField
from engine_dyn.pressure.first_law_formulas import FIELDS_OF_WALL
from engine_dyn.quantities.each_cylinder import OF_CYLINDER
from engine_dyn.quantities.features.characteristic import CHARACTERISTICS
from engine_dyn.quantities.features.hold import HELD_KEYS
from engine_dyn.quantities.graph import (
    ALL_QUANTITIES,
    CURVE_MEANS,
    NUMBERED,
    PARAMETERS,
    QUANTITIES,
)
from engine_dyn.quantities.node import Node
from engine_dyn.quantities.parameters import CYCLE_KEYS, SOLVER_COLUMNS
from engine_dyn.speed.fields import CLOSURES, INERTIA_MODELS, METHOD_NAMES
from sweeps.base.checks import Strict, allowed, is_ratio
from sweeps.base.dimensions import ELASTICITY, LABELS
from sweeps.base.files.numbers_with_units import PATTERN
from sweeps.scene.axes import WORD_KEYS
from sweeps.scene.engine.cylinder_diagrams import CYLINDER, OF_CYLINDER_ALONE
from sweeps.scene.engine.cylinder_keys import CYLINDER_KEYS, ArrangementTable, RodTable
from sweeps.scene.engine.data_sheets import KNOWN_OF_CYCLE
from sweeps.scene.engine.engine_files import TORQUE
from sweeps.scene.engine.engine_tables import EngineFile
from sweeps.scene.engine.modelled_diagrams import KINDS, OF_ENGINE, Kind
from sweeps.scene.engine.silenced_warnings import KNOWN
from sweeps.scene.features import GIVEN_FEATURES, KEYS_OF_SET
from sweeps.scene.features.indicator_files import MEANING, SPEEDS
from sweeps.scene.features.shaft import SHAFT_KEYS
from sweeps.scene.features.torque_diagrams import TorqueDiagram
from sweeps.scene.sample import LARGEST, METHODS, WORDS
from sweeps.scene.toml_tables import (
    FAILURES,
    LARGEST_TOLERANCE,
    SMALLEST_TOLERANCE,
    TRANSIENT,
    Range,
    SceneFile,
)

Schema = dict[str, Any]

DRAFT = "https://json-schema.org/draft/2020-12/schema"

FRACTION: Schema = {"type": "string", "pattern": "^[^/]+/[^/]+$"}
"""A ratio as a fraction, such as "1/200"."""

WITH_UNIT: Schema = {"type": "string", "pattern": PATTERN}
"""A number with its unit, such as "62.5 kW"."""


def with_units(schema: Any) -> Any:
    """Let every number but a whole one also be a text with its unit."""
    if isinstance(schema, list):
        return [with_units(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    if schema.get("type") != "number" or "multipleOf" in schema:
        return {key: with_units(item) for key, item in schema.items()}
    about = {key: schema[key] for key in ("description", "default") if key in schema}
    number = {key: item for key, item in schema.items() if key not in about}
    return {**about, "anyOf": [number, WITH_UNIT]}


def model_schema(model: type[Strict]) -> tuple[Schema, dict[str, Schema]]:
    """Schema of a file, and those of tables in it, of arrangements and shafts, by their names."""
    schema: Schema = plain_schema(model.model_json_schema())
    tables = schema.pop("$defs")
    keys = schema["properties"]
    features = {
        name: one for name, one in GIVEN_FEATURES.items() if one.table and (one.key or name in keys)
    }
    written = [one.table for one in features.values() if one.table is not None]
    parts: list[type[Strict]] = [ArrangementTable, RodTable, *written]
    for part in parts:
        own: Schema = plain_schema(part.model_json_schema())
        tables |= {**own.pop("$defs", {}), part.__name__: own}
    for name, table in zip(features, written, strict=True):
        if features[name].key:
            continue  # `keys_of_features` has these keys
        if features[name].most is None:
            text: Schema = {"type": "string", "minLength": 1}
            keys[name] |= {"anyOf": [text, reference(table.__name__)]}
        else:
            keys[name]["items"] = reference(table.__name__)
    return schema, tables


def keys_of_features() -> Schema:
    """Schemas of the keys that are features: the path of a file, or the table of some of them."""
    schemas: Schema = {}
    for name, one in KEYS_OF_SET.items():
        schemas[name] = text = text_schema(one.says)
        if one.table is not None:
            about = text.pop("description")
            ways = [text, reference(one.table.__name__)]
            schemas[name] = {"description": about, "anyOf": ways}
    return schemas


def plain_schema(schema: Any) -> Any:
    """Without titles that repeat names, and without null, which TOML has not."""
    if isinstance(schema, list):
        return [plain_schema(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    plain = {
        key: {name: plain_schema(item) for name, item in value.items()}
        if key in ("properties", "$defs")
        else plain_schema(value)
        for key, value in schema.items()
        if key != "title" and not (key == "default" and value is None)
    }
    some = [item for item in plain.get("anyOf", []) if item != {"type": "null"}]
    if len(some) == 1:
        del plain["anyOf"]
        plain = {**some[0], **plain}
    elif some:
        plain["anyOf"] = some
    return plain


def value_schema(node: Node) -> Schema:
    """One value of a parameter."""
    number: Schema = {"type": "number"}
    if node.whole:
        number["multipleOf"] = 2 if node.even else 1
    if node.low > -math.inf:
        number["minimum" if node.low_included else "exclusiveMinimum"] = node.low
    if node.high < math.inf:
        number["maximum" if node.high_included else "exclusiveMaximum"] = node.high
    about = {"description": f"{node.long_name}: {allowed(node)}"}
    ways = [number]
    if is_ratio(node):
        ways.append(FRACTION)
    if node.named:
        ways.append({"enum": [name for name, _ in node.named]})
    return {**about, **number} if len(ways) == 1 else {**about, "anyOf": ways}


def unit_text(node: Node) -> str:
    """Unit of a quantity in brackets."""
    return f"[{node.unit}]" if node.unit else ""  # A unit that depends on an exponent is empty


def reference(name: str) -> Schema:
    """Reference to a definition."""
    return {"$ref": f"#/$defs/{name}"}


def list_of(items: Schema) -> Schema:
    """List of one item or more."""
    return {"type": "array", "minItems": 1, "items": items}


def list_of_different(items: Schema, least: int = 1) -> Schema:
    """List of at least so many items, all different."""
    return {"type": "array", "minItems": least, "uniqueItems": True, "items": items}


def text_schema(about: str) -> Schema:
    """Text that is not empty."""
    return {"type": "string", "minLength": 1, "description": about}


def key_of_cylinders(name: str) -> Schema:
    """Schema of a key of single cylinders."""
    if name in WORD_KEYS:
        return {**WORD_KEYS[name].schema, "description": CYLINDER_KEYS[name]}
    if name == "articulated_rods":
        return {**reference("RodTable"), "description": CYLINDER_KEYS[name]}
    return {**list_of({"type": "number"}), "description": CYLINDER_KEYS[name]}


def closed(properties: Schema, *required: str) -> Schema:
    """Table with these keys and no others, some of which must be there."""
    table: Schema = {"type": "object", "properties": properties, "additionalProperties": False}
    return {**table, "required": list(required)} if required else table


def scene_schema() -> Schema:
    """JSON schema (draft 2020-12) of a scene, in JSON's types."""
    schema, tables = model_schema(SceneFile)
    tables["Range"] = plain_schema(Range.model_json_schema())
    ends = {end: {"anyOf": [{"type": "number"}, FRACTION]} for end in ("start", "stop")}
    properties_of_range = {**tables["Range"]["properties"], **ends}
    tables["RatioRange"] = {**tables["Range"], "properties": properties_of_range}
    parameters = {name: value_schema(node) for name, node in PARAMETERS.items()}
    free = {name: node for name, node in PARAMETERS.items() if name not in SOLVER_COLUMNS}

    properties = schema["properties"]
    properties["set"] |= closed(
        {
            **{name: reference(name) for name in free},
            **{name: key_of_cylinders(name) for name in CYLINDER_KEYS},
            **{
                name: {**word.schema, "description": word.says}
                for name, word in WORD_KEYS.items()
                if name not in CYLINDER_KEYS and word.read is not None
            },
            **keys_of_features(),
        }
    )
    properties["axes"] |= closed(
        {
            **{name: _axis(name) for name in free},
            **{
                name: {"description": word.axis_says, **list_of_different(dict(word.schema))}
                for name, word in WORD_KEYS.items()
            },
        }
    )
    properties["designs"] = {"description": properties["designs"]["description"], **_designs()}
    properties["sample"] = {"description": properties["sample"]["description"], **_sample()}
    schema["anyOf"] = [
        {"required": ["engine"]},
        *(
            {"required": [table], "properties": {table: {"required": ["engine"]}}}
            for table in ("axes", "designs", "sample")
        ),
        # A file of designs may name engines in a column, which the schema cannot know.
        {"required": ["designs"], "properties": {"designs": {"required": ["file"]}}},
    ]
    solver = tables["Solver"]["properties"]
    solver["method"] |= _one_or_several(METHOD_NAMES)
    solver["method"]["anyOf"].append({"const": TRANSIENT})
    solver["inertia_model"] |= _one_or_several(INERTIA_MODELS)
    solver["closure"]["enum"] = list(CLOSURES)
    solver["tolerance"] |= {"minimum": SMALLEST_TOLERANCE, "maximum": LARGEST_TOLERANCE}
    for name in SOLVER_COLUMNS:
        solver[name] = reference(name)
    output = tables["Output"]["properties"]
    output["quantities"] |= list_of_different(_quantities())
    output["fail_on"]["items"] = {"enum": list(FAILURES)}
    properties["silenced_warnings"]["items"] = {"enum": list(KNOWN)}
    tables["Characteristic"]["properties"]["kind"]["enum"] = list(CHARACTERISTICS)
    definitions = {**tables, **parameters}
    whole = {"$schema": DRAFT, "title": "Scene of engine-dyn", **schema, "$defs": definitions}
    return dict(with_units(whole))


def _designs() -> Schema:
    """A table of designs, in a file or written out."""
    return {
        "anyOf": [
            closed({"file": text_schema("the path of a CSV, netCDF or Parquet file")}, "file"),
            {
                **closed(
                    {
                        **{name: list_of(reference(name)) for name in PARAMETERS},
                        **{
                            name: {
                                "description": f"a list of strings: the {name} of each design",
                                **list_of({"type": "string"}),
                            }
                            for name in LABELS
                        },
                    }
                ),
                "minProperties": 1,
            },
        ],
    }


def _sample() -> Schema:
    """How designs are drawn, and from what."""
    return {
        **closed(
            {
                **{name: _distribution(name) for name in PARAMETERS},
                **{name: _texts(name) for name in WORDS},
                "method": {
                    "description": "how designs are drawn",
                    "enum": list(METHODS),
                    "default": "sobol",
                },
                "number": {
                    "description": "number of designs; of points, with method 'saltelli'",
                    "type": "integer",
                    "minimum": 2,
                    "maximum": LARGEST,
                },
                "seed": {
                    "description": "seed of the random numbers",
                    "type": "integer",
                    "minimum": 0,
                    "default": 1,
                },
            },
            "number",
        ),
    }


def _quantities() -> Schema:
    """Names of what a scene may ask for."""
    return {
        "oneOf": [
            *(
                {"const": name, "description": f"{node.long_name} {unit_text(node)}".rstrip()}
                for name, node in QUANTITIES.items()
            ),
            {
                "enum": list(CURVE_MEANS),
                "description": "root mean square and mean over the cycle of every curve",
            },
            {
                "enum": [
                    f"{name}{ELASTICITY}"
                    for name, node in ALL_QUANTITIES.items()
                    if name != "status" and not node.meanings
                ],
                "description": "elasticities of a single value by every parameter",
            },
        ]
    }


def _axis(name: str) -> Schema:
    return {
        "description": PARAMETERS[name].long_name,
        "anyOf": [
            list_of_different(reference(name)),
            reference("RatioRange" if is_ratio(PARAMETERS[name]) else "Range"),
        ],
    }


def _distribution(name: str) -> Schema:
    return {
        "description": PARAMETERS[name].long_name,
        "anyOf": [
            list_of_different(reference(name), least=2),
            closed(
                {
                    **{key: reference(name) for key in ("low", "mode", "high")},
                    **{key: {"type": "number"} for key in ("mean", "deviation")},
                    "spacing": {"enum": ["linear", "log"]},
                },
                "low",
                "high",
            ),
        ],
    }


def _texts(name: str) -> Schema:
    return {
        **list_of_different(text_schema(f"one of several for the key {name}"), least=2),
        "description": f"{name}: one of these, equally likely",
    }


def _one_or_several(words: tuple[str, ...]) -> Schema:
    one = {"enum": list(words)}
    return {"anyOf": [one, list_of_different(one)]}


def engine_schema() -> Schema:
    """JSON schema (draft 2020-12) of an engine file, in JSON's types."""
    schema, tables = model_schema(EngineFile)
    bores = {key for key, place in OF_CYLINDER.items() if place.what == "bore"}
    numbered = NUMBERED - bores
    others = {*CYCLE_KEYS, *numbered, *SHAFT_KEYS, *SOLVER_COLUMNS, *HELD_KEYS, "wanted_delta"}
    parameters = {k: value_schema(n) for k, n in PARAMETERS.items() if k not in others}
    properties = schema["properties"]
    properties["values"] |= closed({name: reference(name) for name in parameters})
    for name in CYLINDER_KEYS:
        properties[name] = key_of_cylinders(name)
    properties |= keys_of_features()
    properties["silenced_warnings"]["items"] = {"enum": list(KNOWN)}
    head: Schema = {
        "load": reference("load"),
        "speed": reference("speed"),
        SPEEDS: {
            "type": "array", "items": {"type": "number", "exclusiveMinimum": 0},
            "minItems": 2, "maxItems": 2, "description": MEANING,
        },
        CYLINDER: {
            "type": "integer", "minimum": 1, "maximum": MOST_CYLINDERS,
            "description": OF_CYLINDER_ALONE,
        },
    }  # fmt: skip
    tables["PointsDiagram"] = {
        "description": "a measured diagram",
        **closed(
            {
                **head,
                "kind": {"const": "points"},
                "file": text_schema(
                    "path of a CSV file: columns crank_angle_deg (0 is firing top dead centre) and "
                    "pressure_bar (absolute)"
                ),
            },
            "load",
            "kind",
            "file",
        ),
    }
    for name, kind in KINDS.items():
        tables[_name_of(name)] = _diagram(name, kind, head)
    of_torque: Schema = plain_schema(TorqueDiagram.model_json_schema())
    of_torque["properties"]["kind"] = {"const": TORQUE}
    tables |= {**of_torque.pop("$defs"), _name_of(TORQUE): of_torque}
    kinds = ("points", TORQUE, *KINDS)
    properties["diagram"]["items"] = {"oneOf": [reference(_name_of(kind)) for kind in kinds]}
    first = KINDS["first_law"]
    tables["DataSheet"]["properties"]["cycle"] |= closed(
        {key: _number(key, first.fields[key], first) for key in KNOWN_OF_CYCLE}
    )
    definitions = {**tables, **parameters}
    whole = {"$schema": DRAFT, "title": "Engine file of engine-dyn", **schema, "$defs": definitions}
    return dict(with_units(whole))


def _of_values(kind: Kind) -> tuple[str, ...]:
    """Fields that come from [values] where a diagram does not have them."""
    return ("offset_ratio",) if kind.cycle is DieselCycle else ("offset_ratio", *OF_ENGINE)


def _name_of(kind: str) -> str:
    return "".join(part.capitalize() for part in kind.split("_")) + "Diagram"


def _diagram(name: str, kind: Kind, head: Schema) -> Schema:
    """Schema of [[diagram]] of a modelled kind."""
    numbers = {key: _number(key, field, kind) for key, field in kind.fields.items()}
    more: Schema = {
        "step": {
            "type": "number",
            "exclusiveMinimum": 0,
            "maximum": 10,
            "description": "step of the table [degree]; the cycle must be a multiple of it",
        }
    }
    if kind.by_first_law:
        words = ", ".join(f"'{w}' needs {', '.join(n)}" for w, n in FIELDS_OF_WALL.items() if n)
        more["wall"] = {
            "enum": list(FIELDS_OF_WALL),
            "default": "adiabatic",
            "description": f"loss of heat to the walls; {words}",
        }
    needed = [
        item.name
        for item in fields(kind.cycle)
        if item.default is MISSING and item.name not in _of_values(kind)
    ]
    return {
        "description": f"a modelled diagram: engine_dyn's {kind.cycle.__name__}",
        **closed({"kind": {"const": name}, **more, **numbers, **head}, "load", "kind", *needed),
    }


def _number(key: str, field: FileField, kind: Kind) -> Schema:
    """A number of a cycle with its unit and range."""
    about = MEANINGS[key]
    ends = ("minimum", "maximum") if field.ends else ("exclusiveMinimum", "exclusiveMaximum")
    if key in _of_values(kind):
        about += "; that of [values] if not given"
    return {
        "type": "number",
        "description": f"{about} [{field.unit}]",
        ends[0]: field.low,
        ends[1]: field.high,
    }
