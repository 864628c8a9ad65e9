"""Attributes of an archive of several engines: those of one engine, for each of them.

`engine`, `engine_title` and `references` list all. Assumptions and parameters that differ are told
by engine, those that all share as of one. `arrangement` is a list, one for each engine or
arrangement that lies beside the others.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from typing import Any

from sweeps.scene.plan.plan import Part, Plan


def engine_of(part: Part) -> str:
    """Name of one of several engines, with its arrangement where that differs too."""
    engine = part.plan.scene.engine.name
    own = part.plan.scene.own_cylinders
    named = own is not None and own.arrangement is not None and "arrangement" in _given(part)
    return f"{engine}, {own.arrangement.name}" if named and own and own.arrangement else engine


def _given(part: Part) -> Mapping[str, Any]:
    settings: Mapping[str, Any] = part.plan.scene.source.get("set") or {}
    return settings


def about_several(plan: Plan, about: Callable[[Plan], Mapping[str, str]]) -> dict[str, str]:
    """Attributes of a plan of several engines; `about` gives those of the plan of one."""
    parts = (plan.whole or plan).parts
    each = [(engine_of(part), about(part.plan)) for part in parts]
    first = {attributes["engine"]: attributes for _, attributes in each}
    assumed = {engine: json.loads(a["engine_assumed"]) for engine, a in first.items()}
    given = [json.loads(attributes["parameters"]) for _, attributes in each]
    arrangements = [json.loads(a["arrangement"]) if a["arrangement"] else {} for _, a in each]
    if len(first) > 1 and all(arrangements):
        arrangements = [
            {**arrangement, "engine": a["engine"]}
            for arrangement, (_, a) in zip(arrangements, each, strict=True)
        ]
    return {
        "references": "; ".join(
            dict.fromkeys(source for a in first.values() for source in a["references"].split("; "))
        ),
        "engine": ", ".join(first),
        "engine_title": _title([a["engine_title"] for a in first.values()], list(first)),
        "engine_assumed": json.dumps(_of_each(assumed), ensure_ascii=False),
        "engine_values": "",
        "parameters": json.dumps(
            {k: v for k, v in given[0].items() if all(other.get(k) == v for other in given)}
        ),
        "arrangement": json.dumps(arrangements) if all(arrangements) else "",
    }


def _title(titles: list[str], names: list[str]) -> str:
    """Short enough for figures; a title of one engine names an arrangement that others have not."""
    return f"cylinders of {names[0]}" if len(titles) == 1 else f"engines {', '.join(names)}"


def _of_each(assumed: Mapping[str, Mapping[str, str]]) -> dict[str, str]:
    """Assumptions by key, with the engine in front where there are several engines."""
    if len(assumed) == 1:
        return dict(next(iter(assumed.values())))
    return {f"{engine}: {key}": why for engine, own in assumed.items() for key, why in own.items()}
