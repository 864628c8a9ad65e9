"""Parts of JSON schemas (draft 2020-12) that scenes and engine files share."""

from __future__ import annotations

import math
from typing import Any

from engine_dyn.quantities.node import Node
from sweeps.base.checks import POWER, Strict, allowed, is_power, is_ratio
from sweeps.scene.engine.cylinder_keys import CYLINDER_KEYS, ArrangementTable, RodTable
from sweeps.scene.features import GIVEN_FEATURES
from sweeps.scene.features.torque_tables import TORQUE_TABLE_KEYS, LoadInClosedForm

__all__ = [
    "DRAFT",
    "ONE_ARRANGEMENT",
    "Schema",
    "closed",
    "key_of_cylinders",
    "keys_of_torque_tables",
    "list_of",
    "list_of_different",
    "model_schema",
    "reference",
    "text_schema",
    "unit_text",
    "value_schema",
    "plain_schema",
]

Schema = dict[str, Any]

DRAFT = "https://json-schema.org/draft/2020-12/schema"

FRACTION: Schema = {"type": "string", "pattern": "^[^/]+/[^/]+$"}
"""A ratio as a fraction, such as "1/200"."""


def model_schema(model: type[Strict]) -> tuple[Schema, dict[str, Schema]]:
    """Schema of a file, and those of tables in it, of arrangements and shafts, by their names."""
    schema: Schema = plain_schema(model.model_json_schema())
    tables = schema.pop("$defs")
    keys = schema["properties"]
    features = {name: one for name, one in GIVEN_FEATURES.items() if name in keys and one.table}
    written = [one.table for one in features.values() if one.table is not None]
    parts: list[type[Strict]] = [ArrangementTable, RodTable, LoadInClosedForm, *written]
    for part in parts:
        own: Schema = plain_schema(part.model_json_schema())
        tables |= {**own.pop("$defs", {}), part.__name__: own}
    for name, table in zip(features, written, strict=True):
        if features[name].most is None:
            text: Schema = {"type": "string", "minLength": 1}
            keys[name] |= {"anyOf": [text, reference(table.__name__)]}
        else:
            keys[name]["items"] = reference(table.__name__)
    return schema, tables


def keys_of_torque_tables() -> Schema:
    """Schemas of the keys that name tables of torque; a load's may stand in closed form."""
    found: Schema = {name: text_schema(about) for name, about in TORQUE_TABLE_KEYS.items()}
    closed_form = reference(LoadInClosedForm.__name__)
    about = found["load_table"].pop("description")
    found["load_table"] = {"description": about, "anyOf": [found["load_table"], closed_form]}
    return found


def plain_schema(schema: Any) -> Any:
    """Without titles that repeat names, and without null, which TOML has not."""
    if isinstance(schema, list):
        return [plain_schema(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    found = {
        key: {name: plain_schema(item) for name, item in value.items()}
        if key in ("properties", "$defs")
        else plain_schema(value)
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
    if is_power(node):
        ways.append({"type": "string", "pattern": f"^{POWER.pattern}$"})
    if node.named:
        ways.append({"enum": [name for name, _ in node.named]})
    return {**about, **number} if len(ways) == 1 else {**about, "anyOf": ways}


def unit_text(node: Node) -> str:
    """Unit of a quantity in brackets."""
    return f"[{node.unit}]" if node.unit else ""  # none where it follows an exponent


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


ONE_ARRANGEMENT: Schema = {"anyOf": [{"type": "string"}, reference("ArrangementTable")]}
"""One arrangement of the cylinders, by its name or written out."""


def key_of_cylinders(name: str) -> Schema:
    """Schema of a key of single cylinders."""
    if name == "arrangement":
        return {**ONE_ARRANGEMENT, "description": CYLINDER_KEYS[name]}
    if name == "articulated_rods":
        return {**reference("RodTable"), "description": CYLINDER_KEYS[name]}
    return {**list_of({"type": "number"}), "description": CYLINDER_KEYS[name]}


def closed(properties: Schema, *required: str) -> Schema:
    """Table with these keys and no others, some of which must be there."""
    table: Schema = {"type": "object", "properties": properties, "additionalProperties": False}
    return {**table, "required": list(required)} if required else table
