"""JSON schema of engine files: all keys, their units, and what is allowed.

The structure comes from the models that read engine files, names, units and ranges from the table
of parameters and from the fields of the modelled cycles: nothing is said twice.
"""

from __future__ import annotations

from dataclasses import MISSING, fields

from engine_dyn.pressure.diesel_cycle import DieselCycle
from engine_dyn.pressure.file_fields import MEANINGS, FileField
from engine_dyn.pressure.first_law_fields import FIELDS_OF_WALL
from engine_dyn.quantities.graph import NUMBERED, PARAMETERS
from engine_dyn.quantities.parameters import CYCLE_KEYS, SOLVER_COLUMNS
from sweeps.scene.engine.cylinder_keys import CYLINDER_KEYS
from sweeps.scene.engine.data_sheets import KNOWN_OF_CYCLE
from sweeps.scene.engine.diagram_speeds import MEANING, SPEEDS
from sweeps.scene.engine.engine_files import TORQUE
from sweeps.scene.engine.engine_tables import EngineFile
from sweeps.scene.engine.modelled_diagrams import KINDS, OF_ENGINE, Kind
from sweeps.scene.engine.silenced_warnings import KNOWN
from sweeps.scene.features.shaft import SHAFT_KEYS
from sweeps.scene.features.torque_diagrams import TorqueDiagram
from sweeps.scene.schema_parts import (
    DRAFT,
    Schema,
    closed,
    key_of_cylinders,
    keys_of_torque_tables,
    model_schema,
    plain_schema,
    reference,
    text_schema,
    value_schema,
)

__all__ = ["engine_schema"]

_NOT_OF_ENGINES = (*CYCLE_KEYS, *NUMBERED, *SHAFT_KEYS, *SOLVER_COLUMNS, "wanted_delta")


def engine_schema() -> Schema:
    """JSON schema (draft 2020-12) of an engine file, in JSON's types."""
    schema, tables = model_schema(EngineFile)
    parameters = {k: value_schema(n) for k, n in PARAMETERS.items() if k not in _NOT_OF_ENGINES}
    properties = schema["properties"]
    properties["values"] |= closed({name: reference(name) for name in parameters})
    for name in CYLINDER_KEYS:
        properties[name] = key_of_cylinders(name)
    properties |= keys_of_torque_tables()
    properties["silenced_warnings"]["items"] = {"enum": list(KNOWN)}
    head: Schema = {
        "load": reference("load"),
        "speed": reference("speed"),
        SPEEDS: {
            "type": "array", "items": {"type": "number", "exclusiveMinimum": 0},
            "minItems": 2, "maxItems": 2, "description": MEANING,
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
    return {"$schema": DRAFT, "title": "Engine file of engine-dyn", **schema, "$defs": definitions}


def _of_values(kind: Kind) -> tuple[str, ...]:
    """Fields that come from [values] where a diagram does not have them."""
    return ("offset_ratio",) if kind.cycle is DieselCycle else ("offset_ratio", *OF_ENGINE)


def _name_of(kind: str) -> str:
    return "".join(part.capitalize() for part in kind.split("_")) + "Diagram"


def _diagram(name: str, kind: Kind, head: Schema) -> Schema:
    """[[diagram]] of a modelled kind."""
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
