"""The tables of a scene as keywords of `sweeps.run`, `sweeps.plan` and all that take a scene.

An editor and a type checker read `Tables`; what may stand in each table is said by
`sweeps.scene.toml_tables`, and a test keeps the names the same.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypedDict, TypeVar

from engine_dyn.parameters import PARAMETERS
from sweeps.base.errors import SceneError, did_you_mean, one_line

OPTIONS = (
    "progress", "threads", "device", "resume", "overwrite", "memory", "scheduler", "compression",
    "single", "full_paths", "archive", "computed", "vary", "teeth", "tooth_deviation", "loss",
    "predict",
    "largest_condition", "false_alarms",
    "least", "most", "within", "over", "not_counted", "number", "generations", "restarts", "seed",
)  # fmt: skip
"""Keywords of `sweeps.run` and other functions that are no tables, for hints on misspelt ones."""


class TablesButOutput(TypedDict, total=False):
    """Tables and keys of a scene, but for [output]."""

    title: str | None
    engine: Any  # Name or path of an engine, or several of them
    shaft: Any  # Mapping, or the name or path of a shaft
    auxiliaries: Any  # List of mappings
    counterweights: Any  # List of mappings
    mounts: Any  # List of mappings
    idler_gears: Any  # List of mappings
    silenced_warnings: Any  # Names of checks
    set: Mapping[str, Any] | None
    axes: Mapping[str, Any] | None
    designs: Any  # Columns: a mapping, DataFrame, Dataset or DataArray
    sample: Any
    uncertainty: Any
    reduce: Mapping[str, Any] | None
    indicator: Any  # Mapping with a file, or a DataFrame, Series or DataArray
    measured: Mapping[str, Any] | None
    characteristic: Mapping[str, Any] | None
    transient: Mapping[str, Any] | None
    governor: Mapping[str, Any] | None
    starter: Mapping[str, Any] | None
    clutch: Mapping[str, Any] | None
    solver: Mapping[str, Any] | None
    reference: Mapping[str, Any] | None


class Tables(TablesButOutput, total=False):
    """Tables and keys of a scene."""

    output: Mapping[str, Any] | None


_TABLES = tuple(dict.fromkeys((*TablesButOutput.__annotations__, *Tables.__annotations__)))

Function = TypeVar("Function", bound=Callable[..., Any])


def tables_in_signature(function: Function) -> Function:
    """Let the signature of a function with ``**tables`` name them, for `help` and completion."""
    signature = inspect.signature(function)
    own = [p for p in signature.parameters.values() if p.kind is not p.VAR_KEYWORD]
    taken = {parameter.name for parameter in own}
    tables = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=None)
        for name in _TABLES if name not in taken
    ]  # fmt: skip
    shown = signature.replace(parameters=[*own, *tables])
    function.__signature__ = shown  # type: ignore[attr-defined]
    return function


def changed(raw: Mapping[str, Any], tables: Mapping[str, Any], base: Path) -> dict[str, Any]:
    """Return a scene in which keywords replace whole tables; None leaves a table out.

    Parameters
    ----------
    raw : mapping
        The scene, as its file has it.
    tables : mapping
        Keywords of a call. Paths in them start from the working folder.
    base : Path
        Folder where paths of the scene start from.

    Raises
    ------
    SceneError
        For a keyword that is no table of a scene.
    """
    for key in tables:
        if key in PARAMETERS:
            raise SceneError(
                f"{key}: is a parameter and no table; give several values as axes={{'{key}': "
                f"[...]}}, one value as set={{'{key}': ...}}"
            )
        if key not in _TABLES:
            hint = did_you_mean(key, [*_TABLES, *OPTIONS]) or "."
            raise SceneError(
                f"{one_line(key, 60)}: unknown keyword{hint} Allowed: {', '.join(_TABLES)}, and "
                "the options of the called function (see help())"
            )
    if base != Path():
        tables = {key: _from_here(key, item) for key, item in tables.items()}
    return {key: item for key, item in {**raw, **tables}.items() if item is not None}


def _from_here(key: str, item: Any) -> Any:
    """Tables whose relative paths are replaced by absolute ones."""
    if key == "engine" and isinstance(item, str | Path) and Path(item).is_file():
        return str(Path(item).absolute())
    if isinstance(item, Mapping) and isinstance(item.get("file"), str | Path):
        return {**item, "file": str(Path(item["file"]).absolute())}
    return item


def no_scene() -> SceneError:
    """Return what is said of a call that names no scene at all."""
    return SceneError(
        "scene = None: must be the path of a scene file, the name of a built-in scene or a dict; "
        "or give its tables as keywords: engine='ntua', axes={'inertia': [2.0, 4.0]}, "
        "output={'quantities': ['delta']}"
    )
