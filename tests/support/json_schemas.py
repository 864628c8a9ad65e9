"""Whether values fit a JSON schema: the words of draft 2020-12 that this project uses."""

import re
from typing import Any

TYPES: dict[str, Any] = {
    "object": dict, "array": list, "string": str, "number": (int, float), "integer": int,
    "boolean": bool,
}  # fmt: skip

KNOWN = {
    "$schema", "$defs", "$ref", "title", "description", "default", "type", "properties",
    "additionalProperties", "required", "minProperties", "items", "minItems", "maxItems",
    "uniqueItems", "enum", "const", "anyOf", "oneOf", "minimum", "maximum", "exclusiveMinimum",
    "exclusiveMaximum", "multipleOf", "minLength", "pattern",
}  # fmt: skip


def fits(value: Any, schema: Any, definitions: dict[str, Any]) -> bool:
    """Whether a value fits a schema: the words of draft 2020-12 that the schema uses, no others."""
    if isinstance(schema, bool):
        return schema
    assert set(schema) <= KNOWN, set(schema) - KNOWN
    if "$ref" in schema:
        target = definitions[schema["$ref"].removeprefix("#/$defs/")]
        if not fits(value, target, definitions):
            return False
    kind = schema.get("type")
    if kind and not isinstance(value, TYPES[kind]):
        return False
    if kind and isinstance(value, bool) and kind != "boolean":
        return False
    if "enum" in schema and value not in schema["enum"]:
        return False
    if "const" in schema and value != schema["const"]:
        return False
    if "anyOf" in schema and not any(fits(value, item, definitions) for item in schema["anyOf"]):
        return False
    if "oneOf" in schema and sum(fits(value, item, definitions) for item in schema["oneOf"]) != 1:
        return False
    if isinstance(value, dict):
        properties = schema.get("properties", {})
        others = schema.get("additionalProperties", True)
        return (
            all(key in value for key in schema.get("required", ()))
            and len(value) >= schema.get("minProperties", 0)
            and all(
                fits(item, properties.get(key, others), definitions) for key, item in value.items()
            )
        )
    if isinstance(value, list):
        return (
            schema.get("minItems", 0) <= len(value) <= schema.get("maxItems", len(value))
            and all(fits(item, schema.get("items", True), definitions) for item in value)
            and not (schema.get("uniqueItems") and len(set(map(str, value))) < len(value))
        )
    if isinstance(value, bool):
        return True
    if isinstance(value, str):
        return len(value) >= schema.get("minLength", 0) and bool(
            re.search(schema.get("pattern", ""), value)
        )
    return (
        value >= schema.get("minimum", value)
        and value <= schema.get("maximum", value)
        and not value <= schema.get("exclusiveMinimum", value - 1)
        and not value >= schema.get("exclusiveMaximum", value + 1)
        and value % schema.get("multipleOf", value or 1) == 0
    )
