"""Checks of single tables and values: structure by pydantic, values by the table of parameters.

Engine files and scenes share them; whether the parts of a whole scene fit each other is checked in
`sweeps.scene.consistency`. Every failure is a `SceneError` of one line; pydantic's own messages
never reach a person.
"""

from __future__ import annotations

import contextlib
import math
import re
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, get_args, get_origin

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict, ValidationError, model_validator

from engine_dyn.plausibility.possible import impossible, possible
from engine_dyn.quantities.graph import ALL_QUANTITIES, PARAMETERS
from engine_dyn.quantities.node import Node
from engine_dyn.types import Floats
from sweeps.base.errors import (
    SceneError,
    did_you_mean,
    not_known,
    one_line,
    shown,
    shown_for_whole,
)
from sweeps.base.files.numbers_with_units import PATTERN, factor_between, number_with_unit
from sweeps.base.ratios import BEYOND, LARGEST, number_or_ratio

DEEPEST = 8  # Largest depth of tables and lists within each other in a scene

LONGEST_TEXT = 20_000
"""Characters of one text of a scene; the factors of the longest firing pattern take most."""

LONG = 1000  # Longer lists stay arrays when they are read, and archives state only their length


class Strict(BaseModel):
    """Base of every table: no conversions, no unknown keys, no NaN or infinity.

    The description of a field completes the sentence "must be ...". A field of numbers also takes
    texts with a unit of the kind that its description names.
    """

    model_config = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False, frozen=True)

    @model_validator(mode="before")
    @classmethod
    def _without_units(cls, data: Any) -> Any:
        """Replace texts such as "40 kN m"; those that fit no number are left to be refused."""
        if not isinstance(data, Mapping):
            return data
        units = ((key, unit_of_field(cls, key)) for key, raw in data.items()
                 if isinstance(raw, str | list))  # fmt: skip
        return {**data, **{key: _plain_numbers(data[key], unit) for key, unit in units if unit}}


@cache
def unit_of_field(model: type[Strict], key: str) -> str | None:
    """Return the unit of a field of numbers, "1" if it has none; None for other fields."""
    field = model.model_fields.get(key)
    if field is None or not _of_numbers(field.annotation):
        return None
    for text in re.findall(
        r"(?=(?:\b(?:in|of) |\[)([A-Za-z][A-Za-z0-9/ ]*)\b)", field.description or ""
    ):
        words = text.split(" ")
        for count in range(min(len(words), 4), 0, -1):
            unit = " ".join(words[:count])
            if factor_between(unit, unit) is not None:
                return unit
    return "1"


def _of_numbers(annotation: Any) -> bool:
    """Whether values are numbers with decimals or lists of such, and never texts."""
    inside = [_of_numbers(argument) for argument in get_args(annotation) if argument is not str]
    return annotation is float or (str not in get_args(annotation) and any(inside))


def _plain_numbers(raw: Any, unit: str) -> Any:
    if isinstance(raw, list):
        return (
            [_plain_numbers(one, unit) for one in raw]
            if any(isinstance(o, str) for o in raw)
            else raw
        )
    if isinstance(raw, str) and re.match(PATTERN, raw):
        with contextlib.suppress(SceneError):
            return number_with_unit(raw, "", unit)
    return raw


Model = TypeVar("Model", bound=Strict)

Companions = Mapping[tuple[str, ...], Mapping[str, tuple[str, ...]]]
"""Keys that have no effect without one of others; values of these, or () for any."""


def plain(value: Any, name: str, depth: int = 0) -> Any:
    """Return a copy in Python's own types: NumPy arrays and numbers, tuples and paths converted.

    Long arrays of numbers stay arrays, because converting a million of them takes a second.

    Raises
    ------
    SceneError
        For keys that are not texts, masked values, texts longer than any scene has, and nesting
        that no scene has, such as a list in itself.
    """
    if depth > DEEPEST:
        raise SceneError(f"{name}: tables or lists nested more than {DEEPEST} deep")
    if isinstance(value, Mapping):
        for key in value:
            if not isinstance(key, str):
                raise SceneError(f"{name}: key {shown(key)} must be a string")
            _check_length(key, f"{name}: a key")
        places = (f"{name}: [{key}]" if depth == 0 else f"{name} {key}" for key in value)
        items = zip(places, value.items(), strict=True)
        return {str(key): plain(item, place, depth + 1) for place, (key, item) in items}
    if np.ma.isMaskedArray(value) and np.ma.getmaskarray(value).any():
        place = np.flatnonzero(np.ma.getmaskarray(value).reshape(-1))[0]
        raise SceneError(f"{name}: value {place + 1} is masked: must be a number")
    if isinstance(value, np.ndarray):
        if value.ndim == 1 and value.size > LONG and value.dtype.kind in "iuf":
            return np.array(value, dtype=np.float64)
        return plain(value.tolist(), name, depth + 1)
    if isinstance(value, str):
        _check_length(value, name)
        return value
    if isinstance(value, list | tuple):
        kinds = set(map(type, value))
        if kinds <= {int, float, str}:  # A test of all types at once, quick for long lists
            if str in kinds:
                _check_length(max((item for item in value if isinstance(item, str)), key=len), name)
            return list(value)
        return [plain(item, name, depth + 1) for item in value]
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, range):
        return list(value)
    if hasattr(value, "tolist"):  # Columns of pandas become lists
        return plain(value.tolist(), name, depth + 1)
    return value


def _check_length(text: str, where: str) -> None:
    """Refuse a text longer than anybody writes, before it is searched."""
    if len(text) > LONGEST_TEXT:
        raise SceneError(
            f"{where} = {shown(text)}: has {len(text)} characters; must be at most {LONGEST_TEXT}"
        )


def shortened(value: Any, longest: int | None = None) -> Any:
    """Return a copy in which a text with their length replaces very long lists.

    An archive holds these values as a coordinate; as text they would exceed everything else in it.
    One that holds no more than reductions keeps lists of up to `longest` values.
    """
    if isinstance(value, dict):
        return {key: shortened(item, longest) for key, item in value.items()}
    if isinstance(value, np.ndarray) and longest is not None:
        value = value.tolist()
    if isinstance(value, np.ndarray) or (
        isinstance(value, list) and len(value) > (longest or LONG)
    ):
        return f"{len(value)} values, see the coordinate"
    if isinstance(value, list):
        return [shortened(item, longest) for item in value]
    return value


def check_structure(model: type[Model], data: Any, name: str) -> Model:
    """Check tables, keys and types; `name` is the file as messages call it.

    An unknown key is refused first, because a misspelt key is both an unknown one and a missing
    one.
    """
    try:
        return model.model_validate(data)
    except ValidationError as failure:
        errors = failure.errors(include_url=False, include_context=False)
    # Of a table where a word may stand in its place, the error is told that lies within it.
    first = errors[0]
    within = (e for e in errors if len(e["loc"]) > len(first["loc"])
              and isinstance(first["input"], Mapping))  # fmt: skip
    error = next((e for e in errors if e["type"] == "extra_forbidden"), next(within, first))
    raise SceneError(f"{name}: {_sentence(model, error)}")


def check_companions(given: Strict, companions: Companions, where: str) -> None:
    """Refuse keys that have no effect without another one; messages begin with `where`."""
    values = {key: getattr(given, key) for key in given.model_fields_set}
    known = {key for key, value in values.items() if value is not None and value is not False}
    each = ((key, others) for keys, others in companions.items() for key in keys if key in known)
    for key, others in each:
        met = (other in known and values[other] in (allowed or [values[other]])
               for other, allowed in others.items())  # fmt: skip
        if not any(met):
            wanted = " or ".join(
                f"{other}{' = ' * bool(allowed)}" + " or ".join(map(repr, allowed))
                for other, allowed in others.items()
            )
            raise SceneError(f"{where} {key}: has no effect without {wanted}")


def _sentence(model: type[Strict], error: Any) -> str:
    """Word one error of pydantic."""
    inside: type[Strict] = model
    place: list[str] = []
    description = "a table"
    of_free_keys = False
    rest = list(error["loc"])
    while rest:
        part = rest.pop(0)
        if isinstance(part, int):
            place.append(f"number {part + 1}")
            continue
        field = inside.model_fields.get(part)
        if field is None:
            if rest and part == inside.__name__:  # The member of a union that pydantic tried
                continue
            if error["type"] != "extra_forbidden":
                if of_free_keys:
                    place.append(part)
                break  # The rest names the member of a union that pydantic tried
            known = list(inside.model_fields)
            kind = "table or key" if inside is model else "key"
            return f"{_place([*place, part])}: unknown {kind}{not_known(part, known)}"
        place.append(part)
        description = field.description or description
        of_free_keys = get_origin(field.annotation) is dict
        inner = _model_inside(field.annotation)
        if inner is not None:
            inside = inner
    where = _place(place)
    if error["type"] == "missing":
        return f"{where}: missing; must be {description}"
    said = shown_for_whole if error["type"] == "int_type" else shown
    return f"{where} = {said(error['input'])}: must be {description}"


def _model_inside(annotation: Any) -> type[Strict] | None:
    if isinstance(annotation, type) and issubclass(annotation, Strict):
        return annotation
    models = (_model_inside(argument) for argument in get_args(annotation))
    return next((model for model in models if model is not None), None)


def _place(path: list[str]) -> str:
    """`[solver] tolerance` for a key of a table, the bare name at the top."""
    return path[0] if len(path) <= 1 else f"[{path[0]}] {' '.join(path[1:])}"


def known_key(
    key: str, where: str, also: tuple[str, ...] = (), without: tuple[str, ...] = ()
) -> Node | None:
    """Return the parameter of this name, or None for a name in `also`.

    Any other name is refused with the nearest right one, and names in `without` are not offered.
    """
    if key in also:
        return None
    node = PARAMETERS.get(key)
    if node is None:
        known = [*(name for name in PARAMETERS if name not in without), *also]
        if key in ALL_QUANTITIES:
            raise SceneError(
                f"{where} {key}: unknown key: this is a computed quantity, not a parameter. "
                "Allowed: see `engine-dyn list keys`"
            )
        numbered = _numbered(key, known)
        if numbered:
            raise SceneError(f"{where} {key}: unknown key{numbered}")
        told = not_known(
            key, known, command="engine-dyn list keys", also="".join(f", {name}" for name in also)
        )
        raise SceneError(f"{where} {key}: unknown key{told}")
    return node


def _numbered(key: str, known: Sequence[str]) -> str:
    """What follows "unknown key" for a key of cylinders, discs or shafts with a wrong number."""
    plain = key.rpartition("_")[0]
    numbers = [int(one.removeprefix(f"{plain}_")) for one in known
               if plain and re.fullmatch(rf"{re.escape(plain)}_[0-9]+", one)]  # fmt: skip
    if not numbers:
        return ""
    return f"; must be {plain}_N with a number N from {min(numbers)} to {max(numbers)}"


def number(raw: Any, where: str, node: Node | None = None, unit: str | None = None) -> float:
    """Return a finite number; truth values and other texts than these are refused.

    The text may be a number with a unit of the parameter's kind, such as "62.5 kW", or of `unit`
    where there is no parameter; of a ratio also a fraction such as "1/200", or "0.5 %". A key whose
    values are whole numbers has neither.

    Raises
    ------
    SceneError
        For anything else; messages begin with `where`, such as "scene.toml: [set] inertia".
    """
    if not isinstance(raw, bool) and isinstance(raw, int | float):
        try:
            value = float(raw)
        except OverflowError:
            value = math.inf
        if abs(value) <= LARGEST:
            return value
        if math.isfinite(value):
            raise SceneError(f"{where} = {shown(raw)}: {BEYOND}")
    names = dict(node.named) if node is not None else {}
    if isinstance(raw, str) and raw in names:
        return names[raw]
    if isinstance(raw, str) and is_ratio(node):
        with contextlib.suppress(ValueError):
            return number_or_ratio(raw)
    unit = unit if node is None else None if node.whole else node.unit
    if isinstance(raw, str) and unit and re.match(PATTERN, raw):
        return number(number_with_unit(raw, where, unit), where, node)
    if names and node is not None and node.whole:  # Each of the key's values has a name
        listed = "', '".join(names)
        raise SceneError(f"{where} = {shown(raw)}: must be one of '{listed}'")
    has_unit = unit not in (None, "", "1")
    hint = ""
    if isinstance(raw, str):
        hint = (
            f" without quotes, or with a unit such as '10 {unit}'"
            if has_unit
            else " without quotes"
        )
        if is_ratio(node):
            hint += ", or a fraction such as '1/200'"
        if names:
            listed = "', '".join(names)
            hint += f", or one of '{listed}'{did_you_mean(raw, names)}"
        if re.fullmatch(r"[+-]?[0-9]{1,20},[0-9]{1,20}", raw.strip()):
            hint = f" with a decimal point: {raw.strip().replace(',', '.')}"
    elif isinstance(raw, list | dict):
        hint = ", not a list or table"
    raise SceneError(
        f"{where} = {shown(raw)}: must be a finite number{f' in {unit}' * has_unit}{hint}"
    )


def is_ratio(node: Node | None) -> bool:
    """Whether a parameter is a ratio, which may be written as a fraction."""
    return node is not None and node.unit == "1" and not node.whole


def numbers(raw: Any, where: str, node: Node | None = None, unit: str | None = None) -> Floats:
    """Return a list of finite numbers, at least one; messages name the place in the list."""
    if isinstance(raw, np.ndarray) and (np.abs(raw) <= LARGEST).all():
        return raw
    if isinstance(raw, np.ndarray):
        raw = raw.tolist()
    if not isinstance(raw, list):
        raise SceneError(f"{where} = {shown(raw)}: must be a list of numbers")
    if not raw:
        raise SceneError(f"{where} = []: no values; at least one is needed")
    if set(map(type, raw)) <= {float, int}:  # Long lists are converted without a loop in Python
        try:
            values = np.array(raw, dtype=np.float64)
        except OverflowError:  # A number is too large: the check of each value below names it
            values = np.array([np.nan])
        if (np.abs(values) <= LARGEST).all():
            return values
    return np.array(
        [number(item, f"{where}, value {i}", node, unit) for i, item in enumerate(raw, start=1)]
    )


def allowed(node: Node) -> str:
    """Return the physical range of a parameter in words: 'a number above 0 and below 1 [m]'.

    Where each of its values has a name: "one of 'ohv', 'dohc', or its number from 1 to 2".
    """
    low = f"{node.low:g} or more" if node.low_included else f"above {node.low:g}"
    high = f"at most {node.high:g}" if node.high_included else f"below {node.high:g}"
    parts = [low] if math.isfinite(node.low) else []
    parts += [high] if math.isfinite(node.high) else []
    if len(parts) == 2 and node.low_included and node.high_included:
        parts = [f"from {node.low:g} to {node.high:g}"]
    kind = "an even number" if node.even else "a whole number" if node.whole else "a finite number"
    unit = f" [{node.unit}]" if node.unit != "1" else ""
    if node.whole and node.named:
        listed = "', '".join(name for name, _ in node.named)
        kind = f"one of '{listed}', or its number"
    return f"{kind} {' and '.join(parts)}".rstrip() + unit


def outside(values: Floats, node: Node) -> npt.NDArray[np.bool_]:
    """Whether values (file units) are no usable numbers, or outside the range of a parameter.

    So are sizes that no machine can have (`engine_dyn.plausibility.possible`).
    """
    bad = ~(np.abs(values) <= LARGEST)
    if node.low == 0.0:
        # Positive numbers below 1 / LARGEST are refused too: their reciprocals exceed `LARGEST`.
        bad |= (values > 0.0) & (values < 1.0 / LARGEST)
    if node.low > -math.inf:
        bad |= (values < node.low) if node.low_included else (values <= node.low)
    if node.high < math.inf:
        bad |= (values > node.high) if node.high_included else (values >= node.high)
    if node.whole:
        bad |= values != np.rint(values)
    if node.even:
        bad |= np.remainder(values, 2.0) != 0.0
    ends = possible(node.name, node.unit) if node.kind == "parameter" else None
    if ends is not None:
        bad |= ends.beyond(values)
    return bad


def check_range(values: npt.ArrayLike, where: str, node: Node) -> None:
    """Refuse values (file units) outside the physical range of their parameter."""
    array = np.atleast_1d(np.asarray(values, dtype=float))
    bad = outside(array, node)
    if bad.any():
        value = float(array[bad][0])
        if LARGEST < abs(value) < math.inf and node.low < value < node.high:
            raise SceneError(f"{where} = {value:.12g}: {BEYOND}")
        if 0.0 == node.low < value < 1.0 / LARGEST:
            raise SceneError(f"{where} = {value:.12g}: must be at least {1.0 / LARGEST:g}")
        if beyond := impossible(node.name, value, node.unit, node.si):
            raise SceneError(f"{where} = {value:.12g}: must be {beyond}")
        spoken = node.name == "wanted_delta" and value > 1.0  # A delta of 1/250 is called 250
        meant = f"; did you mean '1/{value:g}'?" if spoken else ""
        raise SceneError(f"{where} = {value:.12g}: must be {allowed(node)}{meant}")


def mentioned(error: Exception) -> str:
    """Return the text of an error of the libraries below, on one line without a final full stop."""
    return one_line(error).rstrip(".")
