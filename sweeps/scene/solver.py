"""[solver] of a scene: methods, inertia models, closure, tolerance and start of the speed solution.

Lists of methods and of inertia models become axes of words.
"""

from __future__ import annotations

from dataclasses import dataclass

from engine_dyn.quantities.graph import PARAMETERS
from engine_dyn.quantities.parameters import SOLVER_COLUMNS
from engine_dyn.speed.fields import CLOSURES, INERTIA_MODELS, METHOD_NAMES, STEPPING
from sweeps.base.checks import check_range, number
from sweeps.base.dimensions import INERTIA_MODEL, METHOD
from sweeps.base.errors import SceneError, not_known, shown
from sweeps.scene.toml_tables import (
    LARGEST_TOLERANCE,
    SMALLEST_TOLERANCE,
    Solver,
)


@dataclass(frozen=True)
class SolverSettings:
    """[solver], checked by itself."""

    # As asked for.
    methods: tuple[str, ...]
    inertia_models: tuple[str, ...]
    axes: dict[str, tuple[str, ...]]  # Axes: those of them that are lists, and so dimensions
    # `passes`, `start_speed` and `start_angle`, where given, in the units of files.
    start: dict[str, float]


def read_solver(solver: Solver, name: str) -> SolverSettings:
    """Check [solver].

    Raises
    ------
    SceneError
        For unknown words, values outside their range, and keys that exclude each other.
    """
    where = f"{name}: [solver]"
    start = _start(solver, where)
    axes: dict[str, tuple[str, ...]] = {}
    methods, several = _words(solver.method, METHOD_NAMES, f"{where} method")
    if several:
        axes[METHOD] = methods
    models, several = _words(solver.inertia_model, INERTIA_MODELS, f"{where} inertia_model")
    if several:
        axes[INERTIA_MODEL] = models
    _check_solver(solver, methods, start, where)
    return SolverSettings(methods, models, axes, start)


def _start(solver: Solver, where: str) -> dict[str, float]:
    """Values of passes, start_speed and start_angle, where given."""
    values: dict[str, float] = {}
    for key in SOLVER_COLUMNS:
        raw = getattr(solver, key)
        if raw is not None:
            values[key] = number(raw, f"{where} {key}", PARAMETERS[key])
            check_range(values[key], f"{where} {key}", PARAMETERS[key])
    return values


def _words(
    raw: str | list[str], known: tuple[str, ...], where: str
) -> tuple[tuple[str, ...], bool]:
    """Check a word or a list of words; say also whether it was a list."""
    words = [raw] if isinstance(raw, str) else raw
    if not words:
        raise SceneError(f"{where} = []: no values; at least one of {', '.join(known)}")
    for i, word in enumerate(words):
        if word not in known:
            raise SceneError(f"{where} = {shown(word)}: unknown{not_known(word, known)}")
        if word in words[:i]:
            raise SceneError(f"{where}: duplicate {shown(word)}; values must be unique")
    return tuple(words), not isinstance(raw, str)


def _check_solver(
    solver: Solver, methods: tuple[str, ...], start: dict[str, float], where: str
) -> None:
    if not SMALLEST_TOLERANCE <= solver.tolerance <= LARGEST_TOLERANCE:
        raise SceneError(
            f"{where} tolerance = {solver.tolerance:g}: must be a number from "
            f"{SMALLEST_TOLERANCE:g} to {LARGEST_TOLERANCE:g}"
        )
    _words(solver.closure, CLOSURES, f"{where} closure")
    stepping = [method for method in methods if method in STEPPING]
    for key, value in start.items():
        if not stepping:
            raise SceneError(
                f"{where} {key} = {value:g}: has no effect with method '{', '.join(methods)}'; "
                f"allowed with {' and '.join(STEPPING)}"
            )
