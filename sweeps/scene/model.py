"""Scenes: what a person wants computed, read and checked.

A scene is a TOML file, the name of a built-in one, or a dict of the same shape. Everything that
can be seen to be wrong without computing is refused here, in one line that names the file, the
key, the value and what is allowed. What a parameter or quantity is called, and which values it may
take, stands in `engine_dyn.quantities.graph` alone.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
from pydantic import Field

from engine_dyn import status
from engine_dyn.engine import Engine
from engine_dyn.geometry import arrangement
from engine_dyn.geometry.cylinders import Cylinders, even_cylinders
from engine_dyn.geometry.slider_crank import crank_radius, crank_radius_of_ratio
from engine_dyn.loads.characteristic import CHARACTERISTICS, Characteristic
from engine_dyn.loads.driven_machine import (
    DrivenMachine,
    TorqueOverAngle,
    TorqueOverSpeed,
    repeats_of,
)
from engine_dyn.pressure.diagram import Diagram
from engine_dyn.pressure.family_grid import FamilyGrid
from engine_dyn.pressure.motored import motored
from engine_dyn.quantities.friction import NO_STROKE_FRICTION
from engine_dyn.quantities.graph import (
    ALONG_SHAFT,
    CONSTANTS,
    DIMENSIONS,
    PARAMETERS,
    QUANTITIES,
    UNLESS_GIVEN,
    select,
)
from engine_dyn.quantities.node import Node
from engine_dyn.quantities.parameters import (
    CYCLE_KEYS,
    INERTIA_PARTS,
    MOTOR_KEYS,
    SOLVER_COLUMNS,
    STROKE_SHARES,
)
from engine_dyn.quantities.single_cylinders import OF_CYLINDER, with_values
from engine_dyn.types import Floats
from engine_dyn.units import RPM
from sweeps.catalogue import SCENES
from sweeps.checks import (
    Strict,
    check_range,
    check_structure,
    known_key,
    mentioned,
    number,
    numbers,
    plain,
    shortened,
)
from sweeps.errors import SceneError, counted, not_known, one_line, shown
from sweeps.reading.cylinder_keys import (
    KEYS,
    ArrangementTable,
    CylinderKeys,
    arrangement_of,
    name_of,
    read_arrangement,
    read_keys,
    resolve,
)
from sweeps.reading.design_tables import LABELS, read_designs
from sweeps.reading.engine_files import load_engine, parse_toml, read_indicator
from sweeps.reading.load_tables import KEYS as TABLE_KEYS
from sweeps.reading.load_tables import Tables, read_tables
from sweeps.reading.tables import Table, kept_files, read_table, referred

__all__ = [
    "DESIGN",
    "FAILURES",
    "CLOSURES",
    "INERTIA_MODELS",
    "LABELS",
    "METHODS",
    "Range",
    "Reference",
    "Scene",
    "SceneError",
    "SceneFile",
    "built_in_scenes",
    "cylinders_of_count",
    "read_scene",
    "scene_of",
]


DESIGN = "design"
METHODS = ("auto", "thesis", "picard", "newton", "closed")
INERTIA_MODELS = ("constant", "variable")
CLOSURES = ("power_mean", "cycle_time")
FAILURES = tuple(name for code, name in enumerate(status.MEANINGS) if code != status.CONVERGED)

STEPPING_METHODS = ("thesis", "picard")
"""Methods that repeat cycles from a start; they cannot solve for the load coefficient."""

SMALLEST_TOLERANCE, LARGEST_TOLERANCE = 1e-12, 0.1
SMALLEST_STEP = 0.01
LARGEST_ORDER = 360.0
LARGEST_AXIS = 10_000_000
MOST_VALUES = 2 * LARGEST_AXIS
MOST_DESIGNS = 10**15
MOST_DIAGRAMS = 1024
"""Cycles times speeds times loads of one scene, where diagrams change with speed or cycle: each is
tabulated, which takes about a tenth of a megabyte."""

SAME = 1e-6
"""Relative difference up to which a value of a reference file is the same as the scene's."""


class Range(Strict):
    """An axis as start, stop and number of values."""

    start: float = Field(description="a finite number")
    stop: float = Field(description="a finite number")
    num: int = Field(description=f"a whole number from 2 to {LARGEST_AXIS}", ge=2, le=LARGEST_AXIS)
    spacing: Literal["linear", "log"] = Field(default="linear", description="'linear' or 'log'")


class _File(Strict):
    file: str = Field(description="a text: the path of a CSV file", min_length=1)


class _Solver(Strict):
    method: str | list[str] = Field(
        default="auto", description=f"one of {', '.join(METHODS)}, or a list of them"
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


class _Output(Strict):
    quantities: list[str] = Field(description="a list of texts; `engine-dyn list` shows them")
    fail_on: list[str] = Field(
        default=[], description=f"a list of outcomes out of {', '.join(FAILURES)}"
    )
    angle_step: float = Field(default=1.0, description="a number of degrees that divides the cycle")
    highest_order: float = Field(
        default=12.0, description=f"a number from 1 to {LARGEST_ORDER:g}", ge=1.0, le=LARGEST_ORDER
    )


class _Characteristic(Strict):
    kind: str | None = Field(default=None, description=f"one of {', '.join(CHARACTERISTICS)}")
    coefficients: list[float] | None = Field(
        default=None, description="a list of two numbers: A and C of lecture 18", min_length=2,
        max_length=2,
    )  # fmt: skip


class SceneFile(Strict):
    """Tables and keys of a scene, before parameters and quantities are looked at."""

    title: str | None = Field(default=None, description="a text")
    engine: str = Field(
        description="a text: an engine of the catalogue or the path of an engine file"
    )
    set: dict[str, Any] = Field(default={}, description="a table of single values")
    axes: dict[str, Any] = Field(default={}, description="a table of lists and ranges")
    designs: dict[str, Any] | None = Field(
        default=None, description="a table of equally long lists, or file = 'table.csv'"
    )
    indicator: _File | None = Field(default=None, description="a table with file = 'pressure.csv'")
    characteristic: _Characteristic | None = Field(
        default=None, description="a table with kind = 'diesel', or coefficients = [A, C]"
    )
    solver: _Solver = Field(default=_Solver(), description="a table")
    output: _Output = Field(description="a table [output] with quantities = ['delta', ...]")
    reference: _File | None = Field(default=None, description="a table with file = 'table.csv'")


@dataclass(frozen=True, eq=False)
class Reference:
    """Published values beside the computed ones.

    Attributes
    ----------
    file : str
        The file as the scene names it.
    dimensions : tuple of str
        Dimensions of the scene that the rows tell apart, in scene order.
    columns : dict of ndarray
        Published values of each quantity over these dimensions, NaN where nothing is printed.
    """

    file: str
    dimensions: tuple[str, ...]
    columns: dict[str, Floats]


@dataclass(frozen=True, eq=False)
class Scene:
    """A checked scene. Values are in the units of files; nothing has been computed yet.

    Attributes
    ----------
    title : str
        One line.
    engine : Engine
        The engine whose values hold where the scene gives none.
    dimensions : tuple of str
        Axes in the order of the file, `design` where [designs] stands among its tables, then
        `method` and `inertia_model` where the solver gives lists.
    axes : dict
        Values of every axis but `design`: numbers in file units, or words.
    designs : dict of ndarray
        Columns of [designs], equally long, in file units; empty without [designs].
    labels : dict of tuple of str
        Names of the designs (`case`).
    settings : dict of float
        Parameters of [set], in file units.
    own_cylinders : Cylinders, optional
        Arrangement and factors of the cylinders, the scene's over the engine's; they hold where an
        engine has as many.
    arrangements : tuple of Cylinders
        Cylinders along the axis `arrangement`; empty without it.
    tables : Tables
        Tables of load and driver that [set] names; they replace the engine's.
    indicator : Diagram, optional
        The measured diagram that replaces the engine's own.
    characteristic : Characteristic, optional
        Torque over speed that the load follows.
    methods, inertia_models : tuple of str
        As asked for; one unless they are dimensions.
    tolerance : float
        Relative error of delta aimed at.
    closure : str
        What the nominal speed means: `power_mean` or `cycle_time`.
    passes, start_speed, start_angle : float, optional
        For the stepping methods: [1], [rad/s], [degree]; None where not given here.
    quantities : tuple of str
        What is asked for.
    fail_on : tuple of str
        Outcomes that make the command end with status 3.
    angle_step : float
        Step of `crank_angle` [degree]; divides the cycle.
    highest_order : float
        Highest point of `order`.
    reference : Reference, optional
        Published values.
    source : dict
        The scene as it was read, in JSON's types; of very long lists their length.
    path : Path, optional
        Its file.
    folder : str
        Where paths in the scene start from.
    files : dict of bytes
        The engine's file and all others that were read, but tables of designs: their columns are
        coordinates.
    """

    title: str
    engine: Engine
    dimensions: tuple[str, ...]
    axes: dict[str, Floats | tuple[str, ...]]
    designs: dict[str, Floats]
    labels: dict[str, tuple[str, ...]]
    settings: dict[str, float]
    own_cylinders: Cylinders | None
    arrangements: tuple[Cylinders, ...]
    tables: Tables
    indicator: Diagram | None
    characteristic: Characteristic | None
    methods: tuple[str, ...]
    inertia_models: tuple[str, ...]
    tolerance: float
    closure: str
    passes: int | None
    start_speed: float | None
    start_angle: float | None
    quantities: tuple[str, ...]
    fail_on: tuple[str, ...]
    angle_step: float
    highest_order: float
    reference: Reference | None
    source: dict[str, Any]
    path: Path | None
    folder: str
    files: Mapping[str, bytes]

    @property
    def words(self) -> tuple[str, ...]:
        """What selects variants of quantities: see `engine_dyn.quantities.variants`."""
        centred = not (self._has("pin_offset") or self._has("crank_offset"))
        engines = self.described
        varied = {OF_CYLINDER[key].what for key in self.cylinder_keys}
        equal = all(engine.equal for engine in engines) and not self._has("misfire")
        equal = equal and varied <= {"firing_angle"}
        throws = all(engine.equal_throws for engine in engines) and "radius_factor" not in varied
        rubs = any(self._has(share) for share in STROKE_SHARES)
        over_speed = self.indicator is None and isinstance(self.engine.family, FamilyGrid)
        return (
            self.closure,
            "centred" if centred else "offset",
            "equal" if equal else "unequal",
            "equal_throws" if throws else "unequal_throws",
            "stroke_friction" if rubs else "uniform_friction",
            "over_speed" if over_speed else "over_load",
            "auxiliaries" if self._has("auxiliary_torque") else "bare",
            "own_cycles" if self.cycle_keys else "given_cycles",
            *self._load_words,
            "characteristic" if self.characteristic is not None else "given_load",
            *self._inertia_words,
            "load_inertia" if self._has("load_inertia") else "no_load_inertia",
            "weights_given" if self.weights_given else "weights_by_fraction",
            "counterweights" if self._has_counterweights else "no_counterweights",
            "shaft" if self._has("balance_shaft_mass") else "no_shaft",
            "pair" if self._has("second_shaft_mass") else "no_pair",
        )

    @property
    def described(self) -> tuple[Cylinders, ...]:
        """Cylinders that scene or engine say more of than their number."""
        return (*filter(None, (self.own_cylinders,)), *self.arrangements)

    @property
    def counts(self) -> list[int]:
        """Numbers of cylinders that the scene has, each once."""
        return _counts(self.settings, self.axes, self.designs, self.engine)

    @property
    def cylinder_keys(self) -> tuple[str, ...]:
        """Parameters of single cylinders that the scene gives."""
        given = {*self.settings, *self.axes, *self.designs}
        return tuple(key for key in OF_CYLINDER if key in given)

    @property
    def _load_words(self) -> tuple[str, ...]:
        driven = self.driven
        return (
            "power_law" if driven.power_law else "motor" if driven.motor else "table",
            "with_driver" if driven.has_driver else "no_driver",
            "steady_load" if driven.over_angle is None else "angle_load",
            "motor_of_slip" if self._motor_of_slip else "motor_of_speed",
        )

    @property
    def _motor_of_slip(self) -> bool:
        if self._gives(("motor_synchronous_speed",)):
            return False
        return self._gives(("motor_slip",)) or self._engine_gives(("motor_slip",))

    @property
    def driven(self) -> DrivenMachine:
        """What acts on the crankshaft beside a + k omega^alpha; the scene's over the engine's."""
        load = self.tables.load or self.engine.load_table
        motor = self.tables.driver is None and (
            self._gives(MOTOR_KEYS)
            or (self.engine.driver_table is None and self._engine_gives(MOTOR_KEYS))
        )
        return DrivenMachine(
            over_angle=load if isinstance(load, TorqueOverAngle) else None,
            load_over_speed=load if isinstance(load, TorqueOverSpeed) else None,
            driver_over_speed=None if motor else self.tables.driver or self.engine.driver_table,
            motor=motor,
        )

    @property
    def inertia_follows(self) -> bool:
        """Whether the inertia follows from a wanted delta."""
        return self._gives(("wanted_delta",))

    @property
    def _inertia_words(self) -> tuple[str, ...]:
        return (
            "wanted_delta" if self.inertia_follows else "given_inertia",
            "inertia_in_parts" if self._inertia_in_parts else "inertia_whole",
        )

    @property
    def _inertia_in_parts(self) -> bool:
        if self._gives(("inertia",)):
            return False
        return self._gives(INERTIA_PARTS) or self._engine_gives(INERTIA_PARTS)

    def _gives(self, keys: tuple[str, ...]) -> bool:
        """Whether the scene gives any of these."""
        places = (self.settings, self.axes, self.designs)
        return any(key in place for key in keys for place in places)

    def _engine_gives(self, keys: tuple[str, ...]) -> bool:
        return any(key in self.engine.values for key in keys)

    @property
    def cycle_keys(self) -> tuple[str, ...]:
        """Parameters of the modelled cycle that the scene replaces."""
        places = (self.settings, self.axes, self.designs)
        return tuple(key for key in CYCLE_KEYS if any(key in place for place in places))

    @property
    def weights_given(self) -> bool:
        """Whether the counterweights have a given mass; a fraction of the scene replaces it."""
        if self._gives(("counterweight_fraction",)):
            return False
        return self._gives(("counterweight_mass",)) or self._engine_gives(("counterweight_mass",))

    @property
    def _has_counterweights(self) -> bool:
        """Whether scene or engine says what the counterweights are; 0 is said too."""
        return self.weights_given or any(
            given(("counterweight_fraction",)) for given in (self._gives, self._engine_gives)
        )

    def _has(self, key: str) -> bool:
        """Whether a parameter is anything but zero somewhere in the scene."""
        places = (self.settings, self.axes, self.designs)
        mine = [place[key] for place in places if key in place]
        values = mine[0] if mine else self.engine.values.get(key, 0.0)
        return bool(np.any(np.asarray(values, dtype=float)))


def built_in_scenes() -> dict[str, Path]:
    """Scenes that come with the package: name and file."""
    return {path.stem: path for path in sorted(SCENES.glob("*.toml"))}


def read_scene(scene: str | Path | Mapping[str, Any] | Scene) -> Scene:
    """Read and check a scene.

    Parameters
    ----------
    scene : str, Path, dict or Scene
        Path of a TOML file, name of a built-in scene, a dict of the same shape (paths in it are
        relative to the working folder), or a Scene, which comes back as it is.

    Raises
    ------
    SceneError
        With one line, for everything that can be seen to be wrong without computing.
    """
    if isinstance(scene, Scene):
        return scene
    path: Path | None = None
    if isinstance(scene, Mapping):
        name, base, raw = "scene", Path(), plain(scene, "scene")
    elif isinstance(scene, str | Path):
        path, name = _find(scene)
        base, raw = path.parent, plain(parse_toml(path, name, "a scene (TOML)"), name)
    else:
        raise SceneError(
            f"scene = {shown(scene)}: must be a path, the name of a built-in scene, a dict or a "
            "Scene"
        )
    return scene_of(raw, name, base, path)


def scene_of(
    raw: dict[str, Any], name: str, base: Path, path: Path | None = None,
    files: Mapping[str, bytes] | None = None,
) -> Scene:  # fmt: skip
    """Check a scene that was read; with `files`, what it names is among these and nowhere else."""
    with kept_files(files, base) as read:
        scene = _scene(raw, name, base, path)
    return replace(scene, files=read)


def _find(scene: str | Path) -> tuple[Path, str]:
    """Path of a scene and what messages call it."""
    known = built_in_scenes()
    text = str(scene)
    if isinstance(scene, str) and text in known:
        return known[text], f"{text}.toml"
    path = Path(scene)
    try:
        exists = path.exists()
    except (OSError, ValueError):  # a name too long, a null character
        exists = False
    if not exists:
        raise SceneError(
            f"scene {shown(text, 300)}: no such file and no built-in scene{not_known(text, known)}"
        )
    return path, text


def _scene(raw: dict[str, Any], name: str, base: Path, path: Path | None) -> Scene:
    given = check_structure(SceneFile, raw, name)
    engine = load_engine(given.engine, base, f"{name}: engine")
    settings = _settings(
        {k: v for k, v in given.set.items() if k not in KEYS and k not in TABLE_KEYS}, name
    )
    keys = read_keys(given.set, f"{name}: [set] ")
    tables = read_tables(given.set, base, f"{name}: [set] ")
    axes: dict[str, Floats | tuple[str, ...]] = {}
    arranged: tuple[str | ArrangementTable, ...] = ()
    for key, item in given.axes.items():
        if key == "arrangement":
            arranged = _arrangement_axis(item, keys, name)
            axes[key] = tuple(name_of(one) for one in arranged)
        else:
            axes[key] = _axis(key, item, name)
        total = sum(len(values) for values in axes.values())
        if total > MOST_VALUES:
            raise SceneError(
                f"{name}: [axes] {key}: {total} values with those of the axes before; must be at "
                f"most {MOST_VALUES} together"
            )
    designs, labels = _designs(given.designs, name, base)
    start = _start(given.solver, name)
    _check_places(settings, axes, designs, start, name)

    dimensions = list(axes)
    if given.designs is not None:
        # Among the tables of the file, so that a person chooses which varies slowest.
        first = "axes" in raw and list(raw).index("axes") < list(raw).index("designs")
        dimensions.insert(len(dimensions) if first else 0, DESIGN)
    methods, several = _words(given.solver.method, METHODS, f"{name}: [solver] method")
    if several:
        axes["method"] = methods
        dimensions.append("method")
    models, several = _words(
        given.solver.inertia_model, INERTIA_MODELS, f"{name}: [solver] inertia_model"
    )
    if several:
        axes["inertia_model"] = models
        dimensions.append("inertia_model")

    designs_in_all = math.prod(map(len, axes.values())) * (
        len(next(iter(designs.values()))) if designs else 1
    )
    if designs_in_all > MOST_DESIGNS:
        raise SceneError(
            f"{name}: {' x '.join(dimensions)}: {designs_in_all:.3g} designs; must be at most "
            f"{MOST_DESIGNS:g}"
        )
    _check_solver(given.solver, methods, start, name)
    _check_output(given.output, engine, name)
    indicator = None
    if given.indicator is not None:
        if "load" in axes or "load" in designs:
            table = "axes" if "load" in axes else "designs"
            raise SceneError(
                f"{name}: [{table}] load: not allowed together with [indicator], whose one diagram "
                "holds for every design"
            )
        indicator = read_indicator(
            referred(base, given.indicator.file, f"{name}: [indicator] file"),
            f"{name}: [indicator] {given.indicator.file}",
            engine.period,
        )
    characteristic = _characteristic(given, (settings, axes, designs), name)
    counts = _counts(settings, axes, designs, engine)
    scene = Scene(
        title=one_line(given.title or f"Scene on {engine.title}"),
        engine=engine,
        dimensions=tuple(dimensions),
        axes=axes,
        designs=designs,
        labels=labels,
        settings=settings,
        own_cylinders=_own_cylinders(keys, counts, engine, f"{name}: [set] "),
        arrangements=_arrangements(arranged, keys, counts, engine, name),
        tables=tables,
        indicator=indicator,
        characteristic=characteristic,
        methods=methods,
        inertia_models=models,
        tolerance=given.solver.tolerance,
        closure=given.solver.closure,
        passes=None if start["passes"] is None else int(start["passes"]),
        start_speed=start["start_speed"],
        start_angle=start["start_angle"],
        quantities=tuple(given.output.quantities),
        fail_on=tuple(given.output.fail_on),
        angle_step=given.output.angle_step,
        highest_order=given.output.highest_order,
        reference=None,
        source=shortened(raw),
        path=path,
        folder=str(base),
        files={},
    )
    _check_values(scene, name)
    if given.reference is None:
        return scene
    label = f"{name}: [reference] {given.reference.file}"
    path_of_rows = referred(base, given.reference.file, f"{name}: [reference] file")
    rows = read_table(path_of_rows, label, "a table of published values (CSV)")
    return replace(scene, reference=_reference(rows, scene, given.reference.file))


# --- values -------------------------------------------------------------------------------------


def _settings(raw: Mapping[str, Any], name: str) -> dict[str, float]:
    """[set]."""
    values: dict[str, float] = {}
    for key, item in raw.items():
        node = _key(key, "set", name)
        where = f"{name}: [set] {key}"
        values[key] = number(item, where, node)
        check_range(values[key], where, node)
    return values


def _counts(
    settings: Mapping[str, float], axes: Mapping[str, Any], designs: Mapping[str, Any],
    engine: Engine,
) -> list[int]:  # fmt: skip
    """Numbers of cylinders that the scene has."""
    given = [table["cylinders"] for table in (settings, axes, designs) if "cylinders" in table]
    values = given[0] if given else engine.values["cylinders"]
    return [int(count) for count in np.unique(np.asarray(values, dtype=float))]


def _own_cylinders(
    keys: CylinderKeys, counts: list[int], engine: Engine, where: str
) -> Cylinders | None:
    """Cylinders of the scene's keys over the engine's; they say for which number of cylinders."""
    own = engine.own_cylinders
    if not keys.given:
        return own
    count = counts[0]
    if len(counts) > 1:
        lengths = {len(v) for k, v in keys.given.items() if k != "arrangement"}
        if keys.arrangement is not None:
            try:
                made = arrangement_of(keys.arrangement, engine.period)
            except ValueError as error:
                raise SceneError(f"{where}{mentioned(error)}") from None
            lengths = {len(made.cylinders)}
        count = min(lengths)
        if count not in counts:
            listed = ", ".join(str(z) for z in counts)
            key = next(iter(keys.given))
            raise SceneError(
                f"{where}{key}: is for {count} cylinders, which the scene does not have; must be "
                f"for one of {listed}"
            )
    fits = own is not None and len(own.members) == count
    base = own if own is not None and fits else even_cylinders(count, engine.period)
    return resolve(keys, base, count, where)


def cylinders_of_count(scene: Scene, count: int) -> Cylinders:
    """Cylinders of engines with so many: the scene's or engine's own, or the customary ones."""
    own = scene.own_cylinders
    if own is not None and len(own.members) == count:
        return own
    return even_cylinders(count, scene.engine.period)


def _characteristic(
    given: SceneFile, places: tuple[Mapping[str, Any], ...], name: str
) -> Characteristic | None:
    """[characteristic]: a known curve, or one of the lecture's form."""
    table = given.characteristic
    if table is None:
        return None
    where = f"{name}: [characteristic]"
    if (table.kind is None) == (table.coefficients is None):
        raise SceneError(f"{where}: must have one of kind and coefficients")
    if given.indicator is not None:
        raise SceneError(
            f"{where}: not allowed together with [indicator], whose one diagram holds at every "
            "speed"
        )
    if any("load" in place for place in places):
        raise SceneError(f"{name}: load: not allowed beside [characteristic], which it follows")
    if table.coefficients is not None:
        constant, linear = table.coefficients
        if not (math.isfinite(constant) and math.isfinite(linear)):
            raise SceneError(f"{where} coefficients = {table.coefficients}: must be finite numbers")
        return Characteristic(constant, linear, -1.0, "coefficients of the scene")
    kind = str(table.kind)
    if kind not in CHARACTERISTICS:
        raise SceneError(f"{where} kind = {shown(kind)}: unknown{not_known(kind, CHARACTERISTICS)}")
    return CHARACTERISTICS[kind]


def _arrangement_axis(
    raw: Any, keys: CylinderKeys, name: str
) -> tuple[str | ArrangementTable, ...]:
    """Texts and tables of [axes] arrangement."""
    where = f"{name}: [axes] arrangement"
    if not isinstance(raw, list) or not raw or not all(isinstance(i, str | dict) for i in raw):
        raise SceneError(
            f"{where} = {shown(raw)}: must be a list of texts such as 'V8 flat-plane', or of tables"
        )
    for key in ("arrangement", "firing_angles"):
        if key in keys.given:
            raise SceneError(f"{where}: not allowed beside {key} in [set]; give one of them")
    several = tuple(
        read_arrangement(item, f"{where} number {i}") for i, item in enumerate(raw, start=1)
    )
    names = [name_of(one) for one in several]
    for i, text in enumerate(names):
        if text in names[:i]:
            other = "" if isinstance(several[i], str) else ", or have another name"
            raise SceneError(f"{where}: {shown(text)} stands there twice; each once{other}")
    return several


def _arrangements(
    several: tuple[str | ArrangementTable, ...],
    keys: CylinderKeys,
    counts: list[int],
    engine: Engine,
    name: str,
) -> tuple[Cylinders, ...]:
    """Cylinders along the axis `arrangement`."""
    where = f"{name}: [axes] "
    if several and len(counts) > 1:
        raise SceneError(
            f"{where}arrangement: not allowed together with several numbers of cylinders; must be "
            "one number"
        )
    made = (_own_cylinders(replace(keys, arrangement=a), counts, engine, where) for a in several)
    return tuple(cylinders for cylinders in made if cylinders is not None)


def _key(key: str, table: str, name: str) -> Node:
    """Return the parameter that a key of [set] or [axes] names."""
    if key in KEYS or key in TABLE_KEYS:
        also = f"; [{table}] may have {_instead(key)}" if table != "set" else ""
        raise SceneError(f"{name}: [{table}] {key}: must stand in [set] or the engine's file{also}")
    if key in SOLVER_COLUMNS:
        raise SceneError(
            f"{name}: [{table}] {key}: must stand in [solver] or as a column of [designs]"
        )
    if key in ("method", "inertia_model"):
        raise SceneError(f"{name}: [{table}] {key}: belongs in [solver]; a list makes it an axis")
    node = known_key(key, f"{name}: [{table}]", without=SOLVER_COLUMNS)
    assert node is not None  # nothing else is known here
    return node


def _instead(key: str) -> str:
    """What an axis may have instead of a key of [set]."""
    one = f"{key.removesuffix('s')}_2"
    return f"{one} and so on" if one in PARAMETERS else "misfire and arrangement"


def _axis(key: str, raw: Any, name: str) -> Floats:
    """One axis: a list, or a range with start, stop, num and spacing."""
    node = _key(key, "axes", name)
    where = f"{name}: [axes] {key}"
    if isinstance(raw, dict):
        values = _range(raw, where)
    elif isinstance(raw, list | np.ndarray):
        values = numbers(raw, where, node)
    else:
        raise SceneError(
            f"{where} = {shown(raw)}: must be a list, or a table with start, stop, num and "
            "optionally spacing = 'log'; a single value belongs in [set]"
        )
    check_range(values, where, node)
    unique, counts = np.unique(values, return_counts=True)
    if len(unique) < len(values):
        twice = float(unique[counts > 1][0])
        raise SceneError(f"{where}: value {twice:.12g} stands there twice; each value once")
    return values


def _range(raw: dict[str, Any], where: str) -> Floats:
    """Values of start/stop/num."""
    given = check_structure(Range, raw, where)
    if given.start == given.stop:
        raise SceneError(
            f"{where}: start and stop are both {given.start:g}; they must differ (a single value "
            "belongs in [set])"
        )
    if given.spacing == "linear":
        with np.errstate(over="ignore", invalid="ignore"):  # what is not finite is refused after
            return np.linspace(given.start, given.stop, given.num)
    for end, value in (("start", given.start), ("stop", given.stop)):
        if value <= 0.0:
            raise SceneError(f"{where} {end} = {value:g}: must be above 0 with spacing = 'log'")
    with np.errstate(over="ignore", invalid="ignore"):
        return np.geomspace(given.start, given.stop, given.num)


def _designs(
    raw: Mapping[str, Any] | None, name: str, base: Path
) -> tuple[dict[str, Floats], dict[str, tuple[str, ...]]]:
    """[designs]: columns of numbers and labels."""
    columns: dict[str, Floats] = {}
    labels: dict[str, tuple[str, ...]] = {}
    if raw is None:
        return columns, labels
    if "file" in raw:
        return _designs_from_file(raw, name, base)
    for key, item in raw.items():
        where = f"{name}: [designs] {key}"
        node = known_key(key, f"{name}: [designs]", LABELS)
        if node is None:
            labels[key] = _labels(item, where)
            continue
        columns[key] = numbers(item, where, node)
        check_range(columns[key], where, node)
    _check_lengths({**columns, **labels}, name)
    return columns, labels


def _labels(raw: Any, where: str) -> tuple[str, ...]:
    if not isinstance(raw, list) or not raw or not all(isinstance(item, str) for item in raw):
        raise SceneError(f"{where} = {shown(raw)}: must be a list of texts, one for each design")
    return tuple(one_line(item) for item in raw)


def _check_lengths(columns: Mapping[str, Any], name: str) -> None:
    if not columns or all(key in LABELS for key in columns):
        raise SceneError(
            f"{name}: [designs] has no column of a parameter; at least one is needed, such as "
            "inertia = [1.0, 2.0]"
        )
    lengths = {key: len(values) for key, values in columns.items()}
    first, expected = next(iter(lengths.items()))
    for key, length in lengths.items():
        if length != expected:
            raise SceneError(
                f"{name}: [designs] {key} has {counted(length, 'value')}, {first} has {expected}: "
                "lists of [designs] must be equally long"
            )


def _designs_from_file(
    raw: Mapping[str, Any], name: str, base: Path
) -> tuple[dict[str, Floats], dict[str, tuple[str, ...]]]:
    """[designs] file = "table.csv": its columns are named as keys."""
    file = raw["file"]
    if not isinstance(file, str) or not file:
        raise SceneError(
            f"{name}: [designs] file = {shown(file)}: must be a text: the path of a CSV, "
            "netCDF or Parquet file"
        )
    for key in raw:
        if key != "file":
            raise SceneError(
                f"{name}: [designs] {key}: not allowed beside file, which holds all columns"
            )
    path = referred(base, file, f"{name}: [designs] file")
    columns, labels = read_designs(path, f"{name}: [designs] {file}")
    _check_lengths({**columns, **labels}, name)
    return columns, labels


def _start(solver: _Solver, name: str) -> dict[str, float | None]:
    """Values of [solver] passes, start_speed and start_angle."""
    values: dict[str, float | None] = {}
    for key in SOLVER_COLUMNS:
        raw = getattr(solver, key)
        values[key] = None
        if raw is not None:
            where = f"{name}: [solver] {key}"
            value = number(raw, where, PARAMETERS[key])
            check_range(value, where, PARAMETERS[key])
            values[key] = value
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
            raise SceneError(f"{where}: {shown(word)} stands there twice; each once")
    return tuple(words), not isinstance(raw, str)


# --- checks across keys -------------------------------------------------------------------------


def _check_places(
    settings: Mapping[str, Any],
    axes: Mapping[str, Any],
    designs: Mapping[str, Any],
    start: Mapping[str, float | None],
    name: str,
) -> None:
    """Each key stands in one place, and the rod is given once."""
    solver = {key: value for key, value in start.items() if value is not None}
    place: dict[str, str] = {}
    tables = {"set": settings, "axes": axes, "designs": designs, "solver": solver}
    for table, keys in tables.items():
        for key in keys:
            if key in place:
                raise SceneError(
                    f"{name}: {key} stands in [{place[key]}] and in [{table}]; give it in one place"
                )
            place[key] = table
    if "crank_ratio" in place and "rod_length" in place:
        raise SceneError(
            f"{name}: crank_ratio (in [{place['crank_ratio']}]) and rod_length (in "
            f"[{place['rod_length']}]) say the same thing; give one of them"
        )
    whole = next((key for key in ("inertia", "flywheel_inertia") if key in place), None)
    if "wanted_delta" in place and whole is not None:
        raise SceneError(
            f"{name}: wanted_delta (in [{place['wanted_delta']}]) and {whole} (in "
            f"[{place[whole]}]): the inertia follows from the wanted delta; give one of them"
        )
    if "counterweight_fraction" in place and "counterweight_mass" in place:
        raise SceneError(
            f"{name}: counterweight_fraction (in [{place['counterweight_fraction']}]) and "
            f"counterweight_mass (in [{place['counterweight_mass']}]) both size the "
            "counterweights; give one of them"
        )
    if "motor_slip" in place and "motor_synchronous_speed" in place:
        raise SceneError(
            f"{name}: motor_slip (in [{place['motor_slip']}]) and motor_synchronous_speed (in "
            f"[{place['motor_synchronous_speed']}]) say the same thing; give one of them"
        )
    part = next((key for key in INERTIA_PARTS if key in place), None)
    if part is not None and "inertia" in place:
        raise SceneError(
            f"{name}: inertia (in [{place['inertia']}]) and {part} (in [{place[part]}]): give the "
            "inertia whole or in parts"
        )


def _check_solver(
    solver: _Solver, methods: tuple[str, ...], start: Mapping[str, float | None], name: str
) -> None:
    if not SMALLEST_TOLERANCE <= solver.tolerance <= LARGEST_TOLERANCE:
        raise SceneError(
            f"{name}: [solver] tolerance = {solver.tolerance:g}: must be a number from "
            f"{SMALLEST_TOLERANCE:g} to {LARGEST_TOLERANCE:g}"
        )
    _words(solver.closure, CLOSURES, f"{name}: [solver] closure")
    stepping = [method for method in methods if method in STEPPING_METHODS]
    if solver.closure == "cycle_time" and stepping:
        others = [method for method in METHODS if method not in STEPPING_METHODS]
        raise SceneError(
            f"{name}: [solver] closure = 'cycle_time': method '{stepping[0]}' does not solve for "
            f"the load coefficient; use one of {', '.join(others)}, or closure = 'power_mean'"
        )
    for key, value in start.items():
        if value is not None and not stepping:
            raise SceneError(
                f"{name}: [solver] {key} = {value:g}: has no effect on method "
                f"'{', '.join(methods)}'; allowed with {' and '.join(STEPPING_METHODS)}"
            )


def _check_output(output: _Output, engine: Engine, name: str) -> None:
    where = f"{name}: [output] quantities"
    if not output.quantities:
        raise SceneError(f"{where} = []: empty; ask for at least one, such as 'delta'")
    for i, quantity in enumerate(output.quantities):
        if quantity not in QUANTITIES:
            if quantity in PARAMETERS:
                raise SceneError(
                    f"{where}: '{quantity}' is a parameter, not a quantity; given in [axes] or "
                    "[designs] it is in the archive as a coordinate"
                )
            raise SceneError(
                f"{where}: {shown(quantity)}: unknown quantity"
                f"{not_known(quantity, QUANTITIES, command='engine-dyn list quantities')}"
            )
        if quantity in output.quantities[:i]:
            raise SceneError(f"{where}: '{quantity}' stands there twice; each once")
    for outcome in output.fail_on:
        if outcome not in FAILURES:
            raise SceneError(
                f"{name}: [output] fail_on = {shown(outcome)}: unknown outcome"
                f"{not_known(outcome, FAILURES)}"
            )
    step, cycle = output.angle_step, round(math.degrees(engine.period))
    largest = cycle / 8
    count = cycle / step if step >= SMALLEST_STEP else 0.0
    # Decimal steps such as 0.1 divide the cycle only up to rounding.
    if not SMALLEST_STEP <= step <= largest or abs(count - round(count)) > 1e-9 * count:
        raise SceneError(
            f"{name}: [output] angle_step = {step:g}: must divide the cycle of {cycle} degrees "
            f"into equal steps of {SMALLEST_STEP:g} to {largest:g} degrees"
        )


def _places(scene: Scene, key: str) -> tuple[str, Floats] | None:
    """Table of the scene that gives a parameter, and its values there."""
    if key in scene.settings:
        return "set", np.array([scene.settings[key]])
    if key in scene.designs:
        return "designs", scene.designs[key]
    values = scene.axes.get(key)
    return None if values is None else ("axes", np.asarray(values, dtype=float))


def _check_values(scene: Scene, name: str) -> None:
    """Check what depends on the engine, or on two parameters."""
    family, scale = scene.engine.family, scene.engine.pressure_scale
    given = _places(scene, "load")
    if given is not None and scene.indicator is None:
        table, loads = given
        bad = (loads < family.low) | (loads > family.high)
        if bad.any():
            if family.low == family.high:
                covered = f"the one load of engine {scene.engine.name}, {family.low:g} percent"
            else:
                covered = (
                    f"from {family.low:g} to {family.high:g} percent, where engine "
                    f"{scene.engine.name} has diagrams"
                )
            raise SceneError(f"{name}: [{table}] load = {loads[bad][0]:g}: must be {covered}")
    given = _places(scene, "speed")
    if given is not None and scale is not None and scene.indicator is None:
        table, speeds = given
        low, high = float(scale[0][0]), float(scale[0][-1])
        bad = (speeds < low) | (speeds > high)
        if bad.any():
            raise SceneError(
                f"{name}: [{table}] speed = {speeds[bad][0]:g}: must be from {low:g} to {high:g} "
                f"rpm, where the diagram of engine {scene.engine.name} is known"
            )
    if given is not None and isinstance(family, FamilyGrid) and scene.indicator is None:
        _check_speeds(*given, family, scene, name)
    _check_cycles(scene, name)
    _check_count(scene, name)
    _check_rod(scene, name)
    _check_single_cylinders(scene, name)
    _check_offset(scene, name)
    _check_throw_radii(scene, name)
    _check_misfire(scene, name)
    _check_shares(scene, name)
    _check_motored(scene, name)
    _check_driven(scene, name)
    _check_needs(scene, name)


def _check_cycles(scene: Scene, name: str) -> None:
    """Check that the engine has modelled cycles where the scene changes them."""
    if not scene.cycle_keys:
        return
    key = scene.cycle_keys[0]
    table, _ = _places(scene, key) or ("set", None)
    where = f"{name}: [{table}] {key}"
    if scene.indicator is not None:
        raise SceneError(f"{where}: not allowed together with [indicator], which is measured")
    if scene.engine.cycles is None:
        raise SceneError(
            f"{where}: not allowed: engine {scene.engine.name} has diagrams that are not modelled "
            "by the first law; must be one whose [[diagram]] are all 'first_law' or 'two_stroke'"
        )


def _check_speeds(table: str, speeds: Floats, family: FamilyGrid, scene: Scene, name: str) -> None:
    """Check that the engine's diagrams over speed cover all speeds."""
    low, high = family.speeds[0] / RPM, family.speeds[-1] / RPM
    bad = (speeds < low * (1.0 - 1e-12)) | (speeds > high * (1.0 + 1e-12))
    if bad.any():
        allowed = f"from {low:g} to {high:g}" if low < high else f"the one speed {low:g}"
        raise SceneError(
            f"{name}: [{table}] speed = {speeds[bad][0]:g}: must be {allowed} rpm, where engine "
            f"{scene.engine.name} has diagrams"
        )


def _check_count(scene: Scene, name: str) -> None:
    """Check that diagrams that change with speed or cycle are not too many."""
    varying = {"cycles": scene.cycle_keys, "loads": ("load",)}
    if "over_speed" in scene.words:
        varying["speeds"] = ("speed",)
    elif not scene.cycle_keys:
        return
    counts = {}
    for what, keys in varying.items():
        count = math.prod(len(scene.axes[key]) for key in keys if key in scene.axes)
        columns = [scene.designs[key] for key in keys if key in scene.designs]
        counts[what] = count * (np.unique(np.stack(columns), axis=1).shape[1] if columns else 1)
    total = math.prod(counts.values())
    if total > MOST_DIAGRAMS:
        listed = ", ".join(f"{count} {what}" for what, count in counts.items() if count > 1)
        named = ", ".join(k for some in varying.values() for k in some if _places(scene, k))
        raise SceneError(
            f"{name}: {named}: {total} diagrams ({listed}): must be at most {MOST_DIAGRAMS} where "
            "they change with speed or cycle"
        )


def _check_needs(scene: Scene, name: str) -> None:
    """Check that scene and engine give everything that the asked quantities need."""
    given = {*scene.settings, *scene.axes, *scene.designs, *scene.engine.values}
    if _places(scene, "rod_length") is not None:
        given.discard("crank_ratio")  # the scene's rod replaces the engine's
    if "wanted_delta" in given:
        given.discard("inertia")
    if scene.characteristic is not None:
        given.discard("load")
    # What `sweeps.planning.plan` takes as known, as long as nothing is given.
    given |= set(UNLESS_GIVEN)
    given |= {"offset_ratio"} if "centred" in scene.words else set()
    given |= {"pressure_share", "mass_share"} if "equal" in scene.words else set()
    given |= {"stroke_share"} if "equal_throws" in scene.words else set()
    given |= set(NO_STROKE_FRICTION) if "uniform_friction" in scene.words else set()
    if "inertia_in_parts" in scene.words:
        given.discard("inertia")  # the scene's parts replace the engine's whole
    if "motor_of_slip" in scene.words:
        given.discard("motor_synchronous_speed")
    for quantity in scene.quantities:
        waiting, seen = [quantity], set(given) | {*DIMENSIONS, *CONSTANTS, *SOLVER_COLUMNS}
        along_shaft = False
        while waiting:
            need = waiting.pop()
            along_shaft |= need in ALONG_SHAFT
            if need == "characteristic" and scene.characteristic is None:
                raise SceneError(
                    f"{name}: [output] quantities: '{quantity}' needs a table [characteristic] "
                    "with a kind, such as 'diesel'"
                )
            if need in seen:
                continue
            seen.add(need)
            node = select(need, *scene.words)
            along_shaft |= node.throws
            if node.make is None and need in PARAMETERS:
                raise SceneError(
                    f"{name}: [output] quantities: '{quantity}' needs {need} "
                    f"({node.long_name}), which engine {scene.engine.name} does not give; must be "
                    "in [set], [axes] or [designs]"
                )
            waiting += node.needs
            along_shaft |= not ALONG_SHAFT.isdisjoint(node.adds)
        if along_shaft:
            _check_throws(scene, quantity, name)


def _check_throws(scene: Scene, quantity: str, name: str) -> None:
    """Check that the order of the throws is known for every number of cylinders."""
    if scene.arrangements:
        return
    given = _places(scene, "cylinders")
    counts = [scene.engine.values["cylinders"]] if given is None else np.unique(given[1])
    own = len(scene.own_cylinders.members) if scene.own_cylinders is not None else 0
    for count in counts:
        if int(count) != own and arrangement.customary_order(int(count)) is None:
            orders = ", ".join(str(z) for z in sorted({*arrangement.CUSTOMARY_ORDERS, own} - {0}))
            raise SceneError(
                f"{name}: cylinders = {count:g}: no firing order is known, which '{quantity}' "
                f"needs; must be one of {orders}"
            )


def _check_rod(scene: Scene, name: str) -> None:
    """Check that the rod is longer than half the stroke in every combination of the scene."""
    given = _places(scene, "rod_length")
    if given is None:
        return
    table, rods = given
    stroke = _places(scene, "stroke")
    own = scene.engine.values.get("stroke", 0.0)
    strokes = np.array([own]) if stroke is None else stroke[1]
    if stroke is None or not stroke[0] == table == "designs":
        rods, strokes = rods.min(keepdims=True), strokes.max(keepdims=True)
    short = np.flatnonzero(rods <= strokes / 2.0)
    if short.size:
        rod, length = rods[short[0]], strokes[short[0]]
        raise SceneError(
            f"{name}: [{table}] rod_length = {rod:g}: must be above half the stroke, "
            f"{length / 2.0:g} m"
        )


def _check_offset(scene: Scene, name: str) -> None:
    """Check that the crank turns in every combination of the scene: |e| + r < l."""
    if "centred" in scene.words:
        return
    rod = _places(scene, "rod_length")
    key = "crank_ratio" if rod is None else "rod_length"
    columns: dict[str, list[Floats]] = {}
    for parameter in ("pin_offset", "crank_offset", "stroke", key):
        given = _places(scene, parameter)
        table, values = ("", np.array([scene.engine.values.get(parameter, np.nan)]))
        if given is not None:
            table, values = given
        elif parameter.endswith("offset") and np.isnan(values).all():
            values = np.zeros(1)
        # Each is worst at an end of its axis; columns of designs go together.
        columns[parameter] = (
            [values]
            if table == "designs"
            else [np.array([v]) for v in {values.min(), values.max()}]
        )
    for pin, crank, stroke, length in itertools.product(*columns.values()):
        if np.isnan(stroke).any() or np.isnan(length).any():
            continue  # what is missing is told elsewhere
        try:
            if rod is None:
                radius, ratio = crank_radius_of_ratio(stroke, length, pin + crank), length
            else:
                radius = crank_radius(stroke, length, pin + crank)
                ratio = radius / length
            for engine in _extreme_cylinders(scene, name):
                engine.check_turning(ratio, (pin + crank) / radius)
        except ValueError as error:
            offset = next(k for k in ("pin_offset", "crank_offset") if columns[k][0].any())
            where = _places(scene, offset)
            table = f"[{where[0]}] " if where is not None else f"engine {scene.engine.name} "
            raise SceneError(f"{name}: {table}{offset}: {mentioned(error)}") from None


def _check_misfire(scene: Scene, name: str) -> None:
    """Check that the cylinder that does not burn is one of the engine's in every combination."""
    own = np.array([scene.engine.values.get("misfire", 0.0)])
    table, silent = _places(scene, "misfire") or ("set", own)
    counts = _places(scene, "cylinders")
    of_engine = np.array([scene.engine.values["cylinders"]])
    number = of_engine if counts is None else counts[1]
    if not (counts is not None and counts[0] == table == "designs"):
        silent, number = silent.max(keepdims=True), number.min(keepdims=True)
    wrong = np.flatnonzero(silent > number)
    if wrong.size:
        most = np.broadcast_to(number, silent.shape)[wrong[0]]
        raise SceneError(
            f"{name}: [{table}] misfire = {silent[wrong[0]]:g}: must be the number of one of "
            f"{most:g} cylinders, or 0"
        )


def _extreme_cylinders(scene: Scene, name: str) -> tuple[Cylinders, ...]:
    """Cylinders of the scene, with the parameters of single ones at both ends of what they take."""
    keys = scene.cylinder_keys
    if not keys:
        return scene.described
    engines = scene.arrangements or (cylinders_of_count(scene, scene.counts[0]),)
    found = []
    for engine in engines:
        for end in (np.min, np.max):
            values = {}
            for key in keys:
                table, given = _places(scene, key) or ("set", np.zeros(1))
                values[key] = float(end(given)) * PARAMETERS[key].si
                try:
                    with_values(engine, {key: values[key]})
                except ValueError as error:
                    text = mentioned(error).removeprefix(f"{key}: ")
                    raise SceneError(f"{name}: [{table}] {key}: {text}") from None
            found.append(with_values(engine, values))
    return tuple(found)


def _check_single_cylinders(scene: Scene, name: str) -> None:
    """Check that parameters of single cylinders are of an engine with a given number of them."""
    keys = scene.cylinder_keys
    if not keys:
        return
    table, _ = _places(scene, keys[0]) or ("set", None)
    if len(scene.counts) > 1:
        raise SceneError(
            f"{name}: [{table}] {keys[0]}: not allowed together with several numbers of cylinders; "
            "must be one number"
        )
    _extreme_cylinders(scene, name)


def _check_throw_radii(scene: Scene, name: str) -> None:
    """Check that the crank turns on throws of unequal radius; see `_check_offset` for offsets."""
    if "equal_throws" in scene.words or "offset" in scene.words:
        return
    given = _places(scene, "crank_ratio")
    rods, strokes = _places(scene, "rod_length"), _places(scene, "stroke")
    own = scene.engine.values
    if rods is None:
        ratio = own.get("crank_ratio", 0.0) if given is None else float(given[1].max())
    else:
        stroke = own.get("stroke", 0.0) if strokes is None else float(strokes[1].max())
        ratio = 0.5 * stroke / float(rods[1].min())
    for engine in _extreme_cylinders(scene, name):
        try:
            engine.check_turning(ratio)
        except ValueError as error:
            raise SceneError(f"{name}: {_place_of_radii(scene)} {mentioned(error)}") from None


def _place_of_radii(scene: Scene) -> str:
    """Where the crank radii of single cylinders stand."""
    for key in scene.cylinder_keys:
        given = _places(scene, key)
        if OF_CYLINDER[key].what == "radius_factor" and given is not None:
            return f"[{given[0]}]"
    if scene.arrangements:
        return "[axes] arrangement:"
    own = scene.own_cylinders is scene.engine.own_cylinders
    return f"engine {scene.engine.name}" if own else "[set]"


def _check_shares(scene: Scene, name: str) -> None:
    """Check that no design has more friction over the stroke than it has friction."""
    total: Any = 0.0
    of_designs: Any = 0.0
    for key in STROKE_SHARES:
        given = _places(scene, key)
        if given is not None and given[0] == "designs":
            of_designs = of_designs + given[1]
        else:
            total += scene.engine.values.get(key, 0.0) if given is None else given[1].max()
    total = float(np.max(total + of_designs))
    if total > 1.0 + 1e-12:
        raise SceneError(
            f"{name}: {' + '.join(STROKE_SHARES)} = {total:g} in one design: must be at most 1 "
            "together"
        )


def _check_driven(scene: Scene, name: str) -> None:
    """Check that loads repeat with the cycle and tables over speed cover all nominal speeds."""
    driven, engine = scene.driven, scene.engine
    motor = next((key for key in MOTOR_KEYS if scene._gives((key,))), None)
    if motor is not None and scene.tables.driver is not None:
        table, _ = _places(scene, motor) or ("set", None)
        raise SceneError(
            f"{name}: [{table}] {motor}: not allowed together with driver_table: give one driver"
        )
    if driven.load_over_speed is not None and driven.has_driver:
        raise SceneError(
            f"{name}: load_table over speed_rpm: not allowed together with a driver, whose factor "
            "the balance finds; must be over an angle"
        )
    if not driven.plain and "thesis" in scene.methods:
        raise SceneError(
            f"{name}: [solver] method = 'thesis': marches the load a + k omega^alpha alone; with "
            "load_table or a driver must be one of auto, picard, newton"
        )
    curve = driven.over_speed
    if curve is not None:
        what = "load_table" if driven.load_over_speed is not None else "driver_table"
        table, speeds = _places(scene, "speed") or ("", np.array([engine.values["speed"]]))
        where = f"[{table}] speed" if table else f"speed of engine {engine.name}"
        low, high = curve.low / RPM, curve.high / RPM
        gears = np.ones(1)
        if curve.own_speed:
            own_gear = engine.values.get("gear_ratio", UNLESS_GIVEN["gear_ratio"])
            of_gear, gears = _places(scene, "gear_ratio") or ("", np.array([own_gear]))
            if not of_gear == table == "designs":  # not column by column: all with all
                speeds, gears = np.broadcast_arrays(speeds[:, None], gears)
        there = gears * speeds
        bad = (there < low * (1.0 - 1e-9)) | (there > high * (1.0 + 1e-9))
        if bad.any():
            at_load = f" makes {there[bad][0]:g} of the load" if curve.own_speed else ""
            raise SceneError(
                f"{name}: {where} = {np.broadcast_to(speeds, bad.shape)[bad][0]:g}{at_load}: must "
                f"be from {low:g} to {high:g} rpm, which {what} covers"
            )
    if driven.over_angle is not None:
        given = _places(scene, "gear_ratio")
        own = engine.values.get("gear_ratio", UNLESS_GIVEN["gear_ratio"])
        ratios = np.array([own]) if given is None else given[1]
        try:
            repeats_of(driven.over_angle, ratios, engine.period)
        except ValueError as error:
            table = f"[{given[0]}] " if given is not None else ""
            raise SceneError(f"{name}: {table}{mentioned(error)}") from None


def _check_motored(scene: Scene, name: str) -> None:
    """Check that a pressure without combustion is known where a cylinder needs one."""
    engines = _extreme_cylinders(scene, name)
    factors = {f for engine in engines for f in engine.pressure_factors}
    silent = _places(scene, "misfire")
    if factors <= {1.0} and (silent is None or not silent[1].any()):
        return
    of_one = [k for k in scene.cylinder_keys if OF_CYLINDER[k].what == "pressure_factor"]
    key = "misfire" if silent is not None else of_one[0] if of_one else "pressure_factor"
    table, _ = _places(scene, key) or ("set", None)
    mine = scene.indicator
    for diagram in scene.engine.family.diagrams if mine is None else (mine,):
        try:
            motored(diagram)
        except ValueError as error:
            raise SceneError(f"{name}: [{table}] {key}: {mentioned(error)}") from None


# --- published values ---------------------------------------------------------------------------


def _reference(table: Table, scene: Scene, file: str) -> Reference:
    """Place the rows of a table of published values among the scene's designs."""
    quantities = _reference_quantities(table, scene)
    by_axis = tuple(d for d in scene.dimensions if d in table.header)
    of_design = tuple(key for key in table.header if key in scene.labels or key in scene.designs)
    dimensions = by_axis
    if DESIGN in scene.dimensions and (of_design or not by_axis):
        dimensions = tuple(d for d in scene.dimensions if d == DESIGN or d in by_axis)
    if not dimensions and (scene.dimensions or len(table.rows) > 1):
        raise SceneError(
            f"{table.name}: {counted(len(table.rows), 'row')} cannot be told apart; "
            f"must have a column of {' or '.join(scene.dimensions) or 'an axis, or one row'}"
        )
    _check_constants(table, scene, (*by_axis, *of_design, *quantities))
    index = {axis: _axis_index(table, scene, axis) for axis in by_axis}
    if DESIGN in dimensions:
        index[DESIGN] = _design_index(table, scene, of_design, in_order=not by_axis)
    places = list(zip(*(index[d] for d in dimensions), strict=True)) or [()]
    first: dict[tuple[int, ...], int] = {}
    for place, line in zip(places, table.lines, strict=True):
        if place in first:
            raise SceneError(
                f"{table.name}, line {line}: the same design as on line {first[place]}; each once"
            )
        first[place] = line
    shape = tuple(_length(scene, d) for d in dimensions)
    if math.prod(shape) * len(quantities) > LARGEST_AXIS:
        raise SceneError(
            f"{table.name}: {counted(len(table.rows), 'row')} of published values over "
            f"{' x '.join(map(str, shape))} points; must be at most {LARGEST_AXIS} values"
        )
    columns: dict[str, Floats] = {}
    for quantity in quantities:
        columns[quantity] = np.full(shape, np.nan)
        for place, value in zip(places, table.numbers(quantity, blanks=True), strict=True):
            columns[quantity][place] = value
    return Reference(file, dimensions, columns)


def _length(scene: Scene, dimension: str) -> int:
    if dimension == DESIGN:
        return len(next(iter(scene.designs.values())))
    return len(scene.axes[dimension])


def _reference_quantities(table: Table, scene: Scene) -> tuple[str, ...]:
    """Columns that hold published values; every other column must be a key, label or axis."""
    words = tuple(key for key in ("method", "inertia_model") if key in scene.axes)
    known = (*QUANTITIES, *PARAMETERS, *LABELS, *words)
    for column in table.header:
        if column not in known:
            raise SceneError(
                f"{table.name}: column '{column}': unknown"
                f"{not_known(column, known, command='engine-dyn list')}"
            )
        if column in LABELS and column not in scene.labels:
            raise SceneError(
                f"{table.name}: column '{column}': the scene's [designs] have no such labels"
            )
    quantities = tuple(column for column in table.header if column in QUANTITIES)
    for quantity in quantities:
        if QUANTITIES[quantity].kind == "curve":
            raise SceneError(
                f"{table.name}: column '{quantity}': runs over crank angle; published values must "
                "be of quantities with one value for each design"
            )
    if not quantities:
        raise SceneError(
            f"{table.name}: no column of a quantity; found {one_line(', '.join(table.header), 200)}"
        )
    return quantities


def _same(a: float, b: npt.ArrayLike) -> npt.NDArray[np.bool_]:
    return np.isclose(np.asarray(b, dtype=float), a, rtol=SAME, atol=1e-12)


def _check_constants(table: Table, scene: Scene, used: Sequence[str]) -> None:
    """Columns of parameters that do not vary must say what the scene says."""
    for key in table.header:
        if key in used:
            continue
        here = scene.settings.get(key, scene.engine.values.get(key))
        solver = getattr(scene, key, None) if key in SOLVER_COLUMNS else here
        expected = here if solver is None else solver
        for value, line in zip(table.numbers(key), table.lines, strict=True):
            if expected is None or not _same(value, expected):
                stands = "not" if expected is None else f"{expected:g}"
                raise SceneError(
                    f"{table.name}, line {line}: {key} = {value:g}: is {stands} in the "
                    "scene; rows must match"
                )


def _axis_index(table: Table, scene: Scene, axis: str) -> list[int]:
    """Place of each row along one axis."""
    values = scene.axes[axis]
    found: list[int] = []
    if isinstance(values, tuple):
        for word, line in zip(table.texts(axis), table.lines, strict=True):
            if word not in values:
                raise SceneError(
                    f"{table.name}, line {line}: {axis} = {shown(word)}: not on the scene's axis; "
                    f"allowed: {', '.join(values)}"
                )
            found.append(values.index(word))
        return found
    for value, line in zip(table.numbers(axis), table.lines, strict=True):
        hits = np.flatnonzero(_same(value, values))
        if len(hits) == 0:
            listed = one_line(", ".join(f"{v:g}" for v in values), 200)
            raise SceneError(
                f"{table.name}, line {line}: {axis} = {value:g}: not on the scene's axis; "
                f"allowed: {listed}"
            )
        found.append(int(hits[0]))
    return found


def _design_index(
    table: Table, scene: Scene, columns: tuple[str, ...], in_order: bool
) -> list[int]:
    """Design of each row: in order where only designs vary, else by the columns that name them."""
    count = _length(scene, DESIGN)
    if in_order:
        if len(table.rows) != count:
            raise SceneError(
                f"{table.name}: {counted(len(table.rows), 'row')} for {counted(count, 'design')}; "
                "one row for each, in order"
            )
        for key in columns:
            _check_order(table, scene, key)
        return list(range(count))
    values = {key: _values_of(table, scene, key) for key in columns}
    found: list[int] = []
    for row, line in enumerate(table.lines):
        hits = np.ones(count, dtype=bool)
        for key, (wanted, own) in values.items():
            hits &= own == wanted[row] if key in scene.labels else _same(wanted[row], own)
        if hits.sum() != 1:
            raise SceneError(
                f"{table.name}, line {line}: fits {hits.sum()} of the designs by "
                f"{', '.join(columns)}; must fit one"
            )
        found.append(int(np.argmax(hits)))
    return found


def _values_of(table: Table, scene: Scene, key: str) -> tuple[list[Any], npt.NDArray[Any]]:
    """Labels or values of the rows, and those of the designs."""
    if key in scene.labels:
        wanted: list[Any] = [one_line(text) for text in table.texts(key)]
        return wanted, np.array(scene.labels[key], dtype=object)
    return list(table.numbers(key)), scene.designs[key]


def _check_order(table: Table, scene: Scene, key: str) -> None:
    """Check that each row has the label or value of the design of the same place."""
    texts = table.texts(key)
    labels = scene.labels.get(key)
    numbers_here = None if labels is not None else table.numbers(key)
    for i, line in enumerate(table.lines):
        if labels is not None:
            same, expected = one_line(texts[i]) == labels[i], shown(labels[i])
        else:
            assert numbers_here is not None
            value = float(scene.designs[key][i])
            same, expected = bool(_same(numbers_here[i], value)), f"{value:g}"
        if not same:
            raise SceneError(
                f"{table.name}, line {line}: {key} = {texts[i]}: design {i + 1} of the scene has "
                f"{expected}; rows must match [designs] in order"
            )
