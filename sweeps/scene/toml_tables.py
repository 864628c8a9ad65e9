"""The tables of a scene's TOML file, as pydantic models: which keys there are, and their types.

Whether parameters and quantities exist, and whether their values are allowed, is checked where a
table is read. The JSON schema (`sweeps.scene.json_schema`) is made from these models.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from pydantic import Field

from engine_dyn import status
from engine_dyn.quantities.graph import PARAMETERS
from engine_dyn.quantities.parameters import SOLVER_COLUMNS
from engine_dyn.speed.fields import CLOSURES, INERTIA_MODELS, METHOD_NAMES, STEPPING
from engine_dyn.types import Floats
from sweeps.base.checks import Strict, check_range, number
from sweeps.base.dimensions import INERTIA_MODEL, METHOD
from sweeps.base.errors import SceneError, not_known, shown
from sweeps.scene.engine.silenced_warnings import SILENCED
from sweeps.scene.features import file_with_features
from sweeps.scene.reduce import ReduceTable

FAILURES = tuple(w for w in status.MEANINGS if w not in ("converged", "followed"))
"""Outcomes that [output] fail_on may name."""

TRANSIENT = "transient"
"""Method of [transient]; periodic quantities of such a scene are solved by `auto`."""

SMALLEST_TOLERANCE, LARGEST_TOLERANCE = 1e-12, 0.1
LARGEST_ORDER = 360.0

LARGEST_AXIS = 10_000_000  # Largest number of values of one axis


class Range(Strict):
    """An axis as start, stop and number of values."""

    start: float = Field(description="a finite number")
    stop: float = Field(description="a finite number")
    num: int = Field(description=f"a whole number from 2 to {LARGEST_AXIS}", ge=2, le=LARGEST_AXIS)
    spacing: Literal["linear", "log"] = Field(default="linear", description="'linear' or 'log'")


class File(Strict):
    """A file that the scene names."""

    file: str = Field(description="a string: the path of a CSV file", min_length=1)


class Solver(Strict):
    """How the speed is solved."""

    method: str | list[str] = Field(
        default="auto",
        description=f"one of {', '.join(METHOD_NAMES)}, or a list of them; or "
        f"'{TRANSIENT}', which follows the speed in time",
    )
    tolerance: float = Field(
        default=1e-6, description=f"a number from {SMALLEST_TOLERANCE:g} to {LARGEST_TOLERANCE:g}"
    )
    inertia_model: str | list[str] = Field(
        default="constant", description=f"one of {', '.join(INERTIA_MODELS)}, or a list of them"
    )
    closure: str = Field(default="power_mean", description=f"one of {', '.join(CLOSURES)}")
    passes: Any = Field(default=None, description="a whole number")
    start_speed: Any = Field(default=None, description="a number in rad/s")
    start_angle: Any = Field(default=None, description="a number in degree")


class Output(Strict):
    """What is computed and written."""

    quantities: list[str] = Field(description="a list of strings; see `engine-dyn list quantities`")
    fail_on: list[str] = Field(
        default=[], description=f"a list of outcomes from {', '.join(FAILURES)}"
    )
    angle_step: float = Field(default=1.0, description="a number of degrees that divides the cycle")
    highest_order: float = Field(
        default=12.0,
        description=f"an order of the cycle, from 1 to {LARGEST_ORDER:g}",
        ge=1.0,
        le=LARGEST_ORDER,
    )
    modes: int | None = Field(
        default=None,
        description="a whole number above 0: modes of the shaft; default: all that orders can "
        "excite",
        ge=1,
    )
    modes_below: float | None = Field(
        default=None,
        description="a number in Hz above 0, in place of modes: all undamped modes below it",
        gt=0.0,
    )


class SceneFile(Strict):
    """Tables and keys of a scene, before parameters and quantities are looked at."""

    title: str | None = Field(default=None, description="a string")
    engine: str | list[str] | None = Field(
        default=None,
        description="a string: an engine of the catalogue or the path of an engine file; several "
        "as a list, here or in [axes] or [designs]",
    )
    silenced_warnings: list[str] = Field(default=[], description=SILENCED)
    set: dict[str, Any] = Field(default={}, description="a table of single values")
    axes: dict[str, Any] = Field(default={}, description="a table of lists and ranges")
    designs: dict[str, Any] | None = Field(
        default=None, description="a table of equally long lists, or file = 'table.csv'"
    )
    sample: dict[str, Any] | None = Field(
        default=None, description="a table of number, method, seed and distributions of parameters"
    )
    uncertainty: dict[str, Any] | None = Field(
        default=None, description="a table of number, seed and distributions of uncertain values"
    )
    reduce: ReduceTable | None = Field(
        default=None, description="a table of what is asked of all designs, in place of each"
    )
    solver: Solver = Field(default=Solver(), description="a table")
    output: Output = Field(description="a table [output] with quantities = ['delta', ...]")
    reference: File | None = Field(default=None, description="a table with file = 'table.csv'")


if not TYPE_CHECKING:  # Type checkers do not see the tables of features as attributes
    SceneFile = file_with_features(SceneFile, scenes=True)


@dataclass(frozen=True)
class SolverSettings:
    """[solver], checked by itself."""

    # Methods of the solver, as the scene asks.
    methods: tuple[str, ...]
    inertia_models: tuple[str, ...]
    # Words of each key of [solver] that has a list: it is a dimension of the results.
    axes: dict[str, tuple[str, ...]]
    # `passes`, `start_speed` and `start_angle`, where given, in the units of files.
    start: dict[str, float]


def read_solver(solver: Solver, name: str) -> SolverSettings:
    """Check the words and values of [solver], and that its keys go together."""
    where = f"{name}: [solver]"
    start = _start(solver, where)
    axes: dict[str, tuple[str, ...]] = {}
    asked = solver.method if isinstance(solver.method, str) else ", ".join(solver.method)
    if solver.method == TRANSIENT:
        solver = solver.model_copy(update={"method": "auto"})
    elif TRANSIENT in solver.method:
        raise SceneError(
            f"{where} method = {shown(solver.method)}: '{TRANSIENT}' stands alone; periodic "
            "quantities of such a scene are solved by 'auto'"
        )
    methods, several = _words(solver.method, METHOD_NAMES, f"{where} method")
    if several:
        axes[METHOD] = methods
    models, several = _words(solver.inertia_model, INERTIA_MODELS, f"{where} inertia_model")
    if several:
        axes[INERTIA_MODEL] = models
    _check_solver(solver, methods, start, where, asked)
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
    """Check a word or a list of words; return also whether it was a list."""
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
    solver: Solver, methods: tuple[str, ...], start: dict[str, float], where: str, asked: str
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
                f"{where} {key} = {value:g}: has no effect with method '{asked}'; "
                f"allowed with {' and '.join(STEPPING)}"
            )


class DesignTable(NamedTuple):
    """Numbers of parameters in the units of files, texts, and names of results, left out."""

    columns: dict[str, Floats]
    labels: dict[str, tuple[str, ...]]
    results: tuple[str, ...] = ()
