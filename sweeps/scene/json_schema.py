"""JSON schema of scenes, for editors and for programs that write scenes.

The structure comes from the models that read scenes, names, units and ranges from the table of
parameters and quantities: nothing is said twice. What a schema cannot say, such as keys that
exclude each other, `engine-dyn plan` finds.
"""

from __future__ import annotations

from engine_dyn.loads.characteristic import CHARACTERISTICS
from engine_dyn.quantities.graph import ALL_QUANTITIES, CURVE_MEANS, PARAMETERS, QUANTITIES
from engine_dyn.quantities.parameters import SOLVER_COLUMNS
from engine_dyn.speed.methods import CLOSURES, INERTIA_MODELS, METHOD_NAMES
from sweeps.base.checks import is_ratio
from sweeps.base.dimensions import ELASTICITY, FIRING_PATTERN, LABELS
from sweeps.scene.engine.cylinder_keys import CYLINDER_KEYS
from sweeps.scene.engine.silenced_warnings import KNOWN
from sweeps.scene.firing_patterns import PATTERN
from sweeps.scene.sample import LARGEST, METHODS, WORDS
from sweeps.scene.schema_parts import (
    DRAFT,
    FRACTION,
    ONE_ARRANGEMENT,
    Schema,
    closed,
    key_of_cylinders,
    keys_of_torque_tables,
    list_of,
    list_of_different,
    model_schema,
    plain_schema,
    reference,
    text_schema,
    unit_text,
    value_schema,
)
from sweeps.scene.toml_tables import (
    FAILURES,
    LARGEST_TOLERANCE,
    SMALLEST_TOLERANCE,
    Range,
    SceneFile,
)

__all__ = ["scene_schema"]


_ONE_PATTERN: Schema = {"anyOf": [{"type": "string", "minLength": 1}, list_of({"type": "number"})]}


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
            FIRING_PATTERN: {**_ONE_PATTERN, "description": PATTERN},
            **keys_of_torque_tables(),
        }
    )
    properties["axes"] |= closed(
        {
            **{name: _axis(name) for name in free},
            "arrangement": {
                "description": CYLINDER_KEYS["arrangement"],
                **list_of_different(ONE_ARRANGEMENT),
            },
            FIRING_PATTERN: {
                "description": f"a list, each {PATTERN}",
                **list_of_different(_ONE_PATTERN),
            },
            "engine": {
                "description": "a list of engines of the catalogue or paths of engine files",
                **list_of_different(text_schema(ENGINE_TEXT)),
            },
        }
    )
    properties["designs"] = {
        "description": properties["designs"]["description"],
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

    properties["sample"] = {
        "description": properties["sample"]["description"],
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

    schema["anyOf"] = [
        {"required": ["engine"]},
        *(
            {"required": [table], "properties": {table: {"required": ["engine"]}}}
            for table in ("axes", "designs", "sample")
        ),
        # The columns of a file are not known here.
        {"required": ["designs"], "properties": {"designs": {"required": ["file"]}}},
    ]
    solver = tables["Solver"]["properties"]
    solver["method"] |= _one_or_several(METHOD_NAMES)
    solver["inertia_model"] |= _one_or_several(INERTIA_MODELS)
    solver["closure"]["enum"] = list(CLOSURES)
    solver["tolerance"] |= {"minimum": SMALLEST_TOLERANCE, "maximum": LARGEST_TOLERANCE}
    for name in SOLVER_COLUMNS:
        solver[name] = reference(name)
    output = tables["Output"]["properties"]
    output["quantities"] |= list_of_different(
        {
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
    )
    output["fail_on"]["items"] = {"enum": list(FAILURES)}
    properties["silenced_warnings"]["items"] = {"enum": list(KNOWN)}
    tables["Characteristic"]["properties"]["kind"]["enum"] = list(CHARACTERISTICS)
    definitions = {**tables, **parameters}
    return {"$schema": DRAFT, "title": "Scene of engine-dyn", **schema, "$defs": definitions}


ENGINE_TEXT = "an engine of the catalogue or the path of an engine file"


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
