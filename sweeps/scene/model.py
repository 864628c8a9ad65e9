"""A scene once it is read and checked: plain data in the units of files.

`sweeps.scene.reading` makes scenes; plans, archives and figures read them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from engine_dyn.engine import Engine
from engine_dyn.geometry.cylinders import Cylinders, even_cylinders
from engine_dyn.loads.driven_machine import DrivenMachine
from engine_dyn.pressure.diagram import Diagram
from engine_dyn.quantities.curve_extremes import is_of_curve, of_curve
from engine_dyn.quantities.features import FEATURES, characteristic
from engine_dyn.quantities.features.characteristic import Characteristic
from engine_dyn.quantities.features.feature import Addition, with_additions
from engine_dyn.quantities.graph import Variants, variants_of
from engine_dyn.quantities.node import Node
from engine_dyn.quantities.parameters import SOLVER_COLUMNS
from engine_dyn.types import Floats, Integers
from sweeps.base.dimensions import DESIGN
from sweeps.base.errors import counted, one_line
from sweeps.scene.engine.engine_files import RATIO
from sweeps.scene.features import indicator, measured
from sweeps.scene.features.measured import Measured
from sweeps.scene.features.torque_tables import driven_machine
from sweeps.scene.firing_patterns import FiringPatterns
from sweeps.scene.known_values import Value, known_values
from sweeps.scene.reduce import Reduce
from sweeps.scene.representations import ends, html_tables, named_some, unit_after
from sweeps.scene.sample import Sample
from sweeps.scene.values import GivenValues
from sweeps.scene.variants import variant_words


@dataclass(frozen=True, eq=False)
class Reference:
    """Published values for comparison with the computed ones."""

    file: str  # The file as the scene names it
    dimensions: tuple[str, ...]  # Dimensions of the scene on which rows differ, in its order
    # Published values of each quantity over these dimensions, NaN where none is printed.
    columns: dict[str, Floats]


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Scene(GivenValues):
    """A checked scene. Values are in the units of files; nothing has been computed yet.

    Attributes
    ----------
    title : str
        One line.
    engine, settings, axes, designs, parts
        See `GivenValues`.
    dimensions : tuple of str
        Axes in the order of the file, `design` where [designs] stands among its tables, then
        `method` and `inertia_model` where the solver gives lists.
    sample : Sample, optional
        What [sample] asks for; its values are columns of `designs`.
    reduce : Reduce, optional
        What is asked of all designs together, in place of each; of a sample that is drawn in
        portions, `designs` has the first.
    uncertainty : Sample, optional
        Values that are not well known, where their effect is asked for.
    labels : dict of tuple of str
        Names of the designs (`case`).
    own_cylinders : Cylinders, optional
        Arrangement and factors of the cylinders, the scene's over the engine's; they hold where an
        engine has as many.
    arrangements : tuple of Cylinders
        Cylinders along the axis `arrangement`; empty without it.
    firing_patterns : FiringPatterns, optional
        Which firings happen, in sequence and over several cycles.
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
    elasticities : tuple of str
        Quantities whose elasticities are asked for; they are among `quantities`.
    fail_on : tuple of str
        Outcomes that make the command end with status 3.
    silenced_warnings : tuple of str
        Names of plausibility checks that do not warn.
    angle_step : float
        Step of `crank_angle` [degree]; divides the cycle.
    highest_order : float
        Highest point of `order`.
    modes : int, optional
        Number of modes of the shaft; None: those below `modes_below`, or that orders can excite.
    modes_below : float, optional
        Frequency [Hz] below which modes are computed.
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
    reduce : Reduce, optional
        What is asked of all designs in place of each.
    results_left_out : tuple of str
        Columns of the file of designs that are results.

    Examples
    --------
    >>> import sweeps
    >>> scene = sweeps.read_scene("first")
    >>> scene.dimensions
    ('load', 'inertia')
    >>> scene.settings
    {'speed': 1200.0}
    """

    title: str
    dimensions: tuple[str, ...]
    sample: Sample | None
    uncertainty: Sample | None
    labels: dict[str, tuple[str, ...]]
    own_cylinders: Cylinders | None
    arrangements: tuple[Cylinders, ...]
    firing_patterns: FiringPatterns | None
    methods: tuple[str, ...]
    inertia_models: tuple[str, ...]
    tolerance: float
    closure: str
    passes: int | None
    start_speed: float | None
    start_angle: float | None
    quantities: tuple[str, ...]
    elasticities: tuple[str, ...]
    fail_on: tuple[str, ...]
    silenced_warnings: tuple[str, ...]
    angle_step: float
    highest_order: float
    modes: int | None
    modes_below: float | None
    reference: Reference | None
    source: dict[str, Any]
    path: Path | None
    folder: str
    files: Mapping[str, bytes]
    reduce: Reduce | None = None
    results_left_out: tuple[str, ...] = ()

    def __repr__(self) -> str:
        title, engine = one_line(self.title, 60), one_line(self.engine_names, 60)
        asked = named_some(self.quantities)
        return f"<Scene '{title}': engine {engine}; {self.varying}; {asked}>"

    def _repr_html_(self) -> str:
        rows = [("engine", f"{engine.name}: {engine.title}") for engine in self.engines]
        rows += [(key, f"{v:.10g}{unit_after(key)}") for key, v in self.settings.items()]
        rows += [(key, ends(values) + unit_after(key)) for key, values in self.axes.items()]
        rows += [(key, named_some(texts)) for key, texts in self.labels.items()]
        rows += [(key, f"{ends(v)}{unit_after(key)}, together") for key, v in self.designs.items()]
        rows += [
            ("varies", self.varying),
            ("computes", ", ".join(self.quantities)),
            ("method", ", ".join(self.methods)),
        ]
        return html_tables(f"Scene: {self.title}", rows)

    @cached_property
    def words(self) -> tuple[str, ...]:
        """Words that select the variants of quantities: see `sweeps.scene.variants`."""
        return variant_words(
            self, closure=self.closure, described=self.described,
            patterns=self.firing_patterns, law=self.driven.law,
        )  # fmt: skip

    @cached_property
    def variants(self) -> Variants:
        """Variants of nodes that the scene has."""
        return variants_of(self.words)

    @cached_property
    def known(self) -> dict[str, Value]:
        """Values in SI units that nothing has to compute: given ones, and neutral ones."""
        more = {key: getattr(self, key) for key in (RATIO, *SOLVER_COLUMNS)}
        single = {key: value for key, value in more.items() if value is not None}
        return known_values(self, self.words, single)

    @property
    def indicator(self) -> Diagram | None:
        """The measured diagram that replaces the engine's own; of several cycles their mean."""
        return indicator.of(self).diagram

    @property
    def recorded_cycles(self) -> tuple[Diagram, ...]:
        """Each recorded cycle, for the key `recorded_cycle`; empty without them."""
        return indicator.of(self).cycles

    @property
    def indicator_notes(self) -> tuple[str, ...]:
        """What was done to the recording of the measured diagram, as its file says."""
        return indicator.of(self).notes

    @property
    def indicator_speeds(self) -> tuple[float, float] | None:
        """Lowest and highest speed [rpm] for which the measured diagram holds, where known."""
        return indicator.of(self).speeds

    @property
    def left_out(self) -> str:
        """Line on the columns of a file of designs that are results; or ""."""
        names = self.results_left_out
        more = f" and {len(names) - 8} more" if names[8:] else ""
        return f"[designs] file: results, left out: {', '.join(names[:8])}{more}" if names else ""

    @property
    def other_cylinders(self) -> str:
        """Line on numbers of cylinders that the engine's own arrangement is not for; or ""."""
        own, order = self.engine.own_cylinders, self.engine.firing_order
        others = [count for count in self.counts if own is not None and count != own.count]
        if own is None or not others or self.own_cylinders is not own or len(self.engines) > 1:
            return ""
        named = "" if order is None else f", firing order {'-'.join(map(str, order))}"
        return (
            f"cylinders = {', '.join(map(str, others))}: in line with the customary firing order; "
            f"the arrangement of engine {self.engine.name} is for {own.count}{named}"
        )

    @property
    def confidential(self) -> tuple[str, ...]:
        """Names in `files` of which archives hold the hash alone."""
        each = (name for one in self.ordinary_scenes for name in indicator.of(one).confidential)
        return tuple(dict.fromkeys(each))

    @property
    def compression_ratio(self) -> float | None:
        """Compression ratio where no parameter of the scene gives it [1].

        It is that of [indicator], else the engine's.
        """
        stated = indicator.of(self).compression_ratio
        return self.engine.compression_ratio if stated is None else stated

    @property
    def measured(self) -> Measured | None:
        """Recordings of the speed to compare with."""
        return measured.of(self)

    @property
    def characteristic(self) -> Characteristic | None:
        """Torque over speed that the load follows, where the scene has one."""
        return characteristic.of(self.engine)

    @property
    def load_follows(self) -> bool:
        """Whether the load of a design follows from a torque."""
        return self.characteristic is not None or "held" in self.words

    @cached_property
    def driven(self) -> DrivenMachine:
        """Loads and driver of the crankshaft."""
        return driven_machine(self)

    def node(self, name: str) -> Node:
        """Variant of a node that the scene has, with all that it needs, also of the shaft."""
        own = self.variants[name]
        if self._additions:
            own = with_additions(own, self._additions)
        if is_of_curve(own):
            return of_curve(own, self.node)
        if not own.of_shaft:
            return own
        of_shaft = [key for key in self.shaft_keys if self._enters(key, own)]
        return replace(own, needs=(*own.needs, *of_shaft))

    @cached_property
    def _additions(self) -> tuple[Addition, ...]:
        """Amounts that parts of the engine add to parameters."""
        parts = (one for one in FEATURES if one.of(self.engine) is not None)
        return tuple(
            one for part in parts for one in part.adds if set(one.when.split()) <= set(self.words)
        )

    def _enters(self, key: str, node: Node) -> bool:
        """Whether a node needs a number of the shaft; a given stiffness needs no section."""
        what, _, number = key.rpartition("_")
        if what in ("shaft_diameter", "shaft_bore") and "shaft_length" in node.of_shaft:
            return f"shaft_length_{number}" in self.shaft_keys
        return what in node.of_shaft

    @cached_property
    def cycles(self) -> int:
        """Cycles after which all repeats, because of a firing pattern."""
        patterns = self.firing_patterns
        return 1 if patterns is None else patterns.cycles(self.counts)

    @property
    def ordinary_scenes(self) -> tuple[Scene, ...]:
        """The scene itself; of several engines or arrangements, the scene of each."""
        return (self,)

    @property
    def engines(self) -> tuple[Engine, ...]:
        """Engines of the scene, each once; one for an ordinary scene."""
        return tuple({one.engine.name: one.engine for one in self.ordinary_scenes}.values())

    @property
    def engine_names(self) -> str:
        """Names of the engines, with commas."""
        return ", ".join(engine.name for engine in self.engines)

    @cached_property
    def sizes(self) -> dict[str, int]:
        """Length of every dimension; that of designs is of the columns of their table."""
        columns: list[Any] = [*self.designs.values(), *self.labels.values()]
        return {d: len(columns[0]) if d == DESIGN else len(self.axes[d]) for d in self.dimensions}

    @property
    def varying(self) -> str:
        """Varying parameters and their designs: "inertia (5) x speed (15), 75 designs"."""
        over = " x ".join(f"{d} ({n})" for d, n in self.sizes.items())
        designs = counted(math.prod(self.sizes.values()), "design")
        return f"{over}, {designs}" if over else designs

    @cached_property
    def cylinders_by_count(self) -> dict[int, Cylinders]:
        """Cylinders of engines with so many: the scene's or engine's own, or the customary ones."""
        own, period = self.own_cylinders, self.engine.period
        of_own = {} if own is None else {len(own.members): own}
        return {z: of_own[z] if z in of_own else even_cylinders(z, period) for z in self.counts}

    @property
    def all_cylinders(self) -> tuple[Cylinders, ...]:
        """Cylinders of each arrangement; without several, of each number of cylinders."""
        return self.arrangements or tuple(self.cylinders_by_count.values())

    @property
    def described(self) -> tuple[Cylinders, ...]:
        """Cylinders that scene or engine say more of than their number."""
        return (*filter(None, (self.own_cylinders,)), *self.arrangements)


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class SeveralEngines(Scene):
    """A scene of several engines or arrangements: an ordinary scene for each of them."""

    # The ordinary scenes; each asks for the quantities that its engine has. Properties of the whole
    # scene that belong to an engine are those of the first.
    each: tuple[Scene, ...]
    # Ascending positions of each scene along those of `engine`, `arrangement` and `design` on which
    # the scenes differ.
    places: tuple[Mapping[str, Integers], ...]

    @property
    def ordinary_scenes(self) -> tuple[Scene, ...]:
        """The scene of each."""
        return self.each
