"""Whether values fit a JSON schema: the words of draft 2020-12 that this project uses."""

import operator
import re
from collections.abc import Callable
from typing import Any

TYPES: dict[str, Any] = {
    "object": dict, "array": list, "string": str, "number": (int, float), "integer": int,
    "boolean": bool,
}  # fmt: skip

CHECKS: dict[str, tuple[Any, Callable[[Any, Any], Any]]] = {
    "enum": (object, lambda value, allowed: value in allowed),
    "const": (object, operator.eq),
    "required": (dict, lambda value, keys: all(key in value for key in keys)),
    "minProperties": (dict, lambda value, least: len(value) >= least),
    "minItems": (list, lambda value, least: len(value) >= least),
    "maxItems": (list, lambda value, most: len(value) <= most),
    "uniqueItems": (list, lambda value, on: not on or len(set(map(str, value))) == len(value)),
    "minLength": (str, lambda value, least: len(value) >= least),
    "maxLength": (str, lambda value, most: len(value) <= most),
    "pattern": (str, lambda value, pattern: re.search(pattern, value)),
    "minimum": ((int, float), operator.ge),
    "maximum": ((int, float), operator.le),
    "exclusiveMinimum": ((int, float), operator.gt),
    "exclusiveMaximum": ((int, float), operator.lt),
    "multipleOf": ((int, float), lambda value, of: value % of == 0),
}
"""Words, the values that they judge, and how."""

KNOWN = {*CHECKS} | {
    "$schema", "$defs", "$ref", "title", "description", "default", "type", "properties",
    "additionalProperties", "items", "anyOf", "oneOf",
}  # fmt: skip


def fits(value: Any, schema: Any, definitions: dict[str, Any]) -> bool:
    """Whether a value fits a schema: the words of draft 2020-12 that the schema uses, no others."""
    if isinstance(schema, bool):
        return schema
    assert set(schema) <= KNOWN, set(schema) - KNOWN

    def all_fit(*pairs: tuple[Any, Any]) -> bool:
        return all(fits(one, own, definitions) for one, own in pairs)

    if "$ref" in schema and not all_fit((value, definitions[schema["$ref"][len("#/$defs/") :]])):
        return False
    kind = schema.get("type")
    if kind and (
        not isinstance(value, TYPES[kind]) or (isinstance(value, bool) and kind != "boolean")
    ):
        return False
    for word, (judged, check) in CHECKS.items():
        if word in schema and isinstance(value, judged) and not check(value, schema[word]):
            return False
    if "anyOf" in schema and not any(all_fit((value, one)) for one in schema["anyOf"]):
        return False
    if "oneOf" in schema and sum(all_fit((value, one)) for one in schema["oneOf"]) != 1:
        return False
    if isinstance(value, dict):
        properties, others = schema.get("properties", {}), schema.get("additionalProperties", True)
        return all_fit(*((one, properties.get(key, others)) for key, one in value.items()))
    if isinstance(value, list):
        return all_fit(*((one, schema.get("items", True)) for one in value))
    return True
