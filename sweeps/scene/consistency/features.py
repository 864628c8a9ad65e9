"""Features that scenes have, and the refusals of `sweeps.scene.crossings` for those that they have.

Each feature is a function of a scene: where messages say that it stands, or something false where
the scene does not have it. Of a feature that no message names the place of, it is True.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from engine_dyn.geometry.arrangement import FOUR_STROKE
from engine_dyn.loads.driven_machine import cycles_of
from engine_dyn.loads.laws import LOAD_LAWS, MOTOR_KEYS
from engine_dyn.pressure.diagram import never_burns
from engine_dyn.pressure.double_acting import OF_EFFECTIVE_PRESSURE
from engine_dyn.quantities.each_cylinder import OF_CYLINDER
from engine_dyn.quantities.features.hold import HELD_KEYS
from engine_dyn.quantities.parameters import CHEN_FLYNN_KEYS, CYCLE_KEYS, STROKE_SHARES
from engine_dyn.speed.fields import CLOSED, METHODS, STEPPING
from sweeps.base.dimensions import FIRING_PATTERN, LABELS
from sweeps.scene.consistency.pressure import burning_less
from sweeps.scene.crossings import CROSSINGS, HOLDING, SEVERAL, SINGLE, refused
from sweeps.scene.derived_quantities import elasticities_in
from sweeps.scene.features import GIVEN_FEATURES, shaft, web_weights
from sweeps.scene.features.feature import GivenFeature
from sweeps.scene.model import Scene
from sweeps.scene.toml_tables import SceneFile
from sweeps.scene.values import BY_COMPONENT, friction_law

Feature = Callable[[Scene], str | bool]


def _keys(*keys: str) -> Feature:
    """Feature of scenes that give any of some parameters."""

    def place(scene: Scene) -> str | bool:
        key = next((key for key in keys if key in scene.given), None)
        return key is not None and f"[{scene.table_of(key)}] {key}"

    return place


def _word(word: str, place: str | bool = True) -> Feature:
    """Feature of scenes with one of the words for variants."""
    return lambda scene: word in scene.words and place


def _single_of_engine(scene: Scene) -> bool:
    """Whether the engine itself has cylinders with bores or diagrams of their own."""
    own, values = scene.engine.own_cylinders, scene.engine.values
    return (own is not None and own.several_makes) or any(key in OF_CYLINDER for key in values)


def _own_bore(scene: Scene) -> str | bool:
    """Place of the first bore of a single cylinder."""
    for key in scene.cylinder_keys:
        if OF_CYLINDER[key].what == "bore":
            table = scene.given_or_own(key).table
            return f"[{table}] {key}" if table else f"engine {scene.engine.name} {key}"
    return False


def _other_load(scene: Scene) -> bool:
    """Whether a scene has a load or driver that methods which step through cycles cannot solve."""
    driven = scene.driven
    return not all(
        method.can_solve(driven.law, driven.over_angles) for method in METHODS if method.steps
    )


def _given(one: GivenFeature) -> Feature:
    """Feature of scenes that give a table or key of `sweeps.scene.features`."""
    # A scene also has the feature where its engine has the part, and the scene does not replace it.
    return lambda scene: (
        (one.given_in(scene.source) or one.part_of(scene) is not None)
        and (f"[set] {one.written}" if one.written in scene.source.get("set", {}) else one.written)
    )


FEATURES: Mapping[str, Feature] = {
    **{one.written: _given(one) for one in GIVEN_FEATURES.values()},
    "load": lambda scene: scene.gives("load") and "load",
    "a load that varies": lambda scene: (
        scene.table_of("load") != "set" and f"[{scene.table_of('load')}] load"
    ),
    "held_torque or held_power": _keys(*HELD_KEYS),
    HOLDING: lambda scene: (
        "held" in scene.words
        and next((f"[{scene.table_of(k)}] {k}" for k in HELD_KEYS if scene.gives(k)), "hold")
    ),
    "diagrams for one load": lambda scene: (
        len(scene.engine.family.diagrams) > 0
        and scene.engine.family.low == scene.engine.family.high
    ),
    "parameters of the modelled cycle": _keys(*CYCLE_KEYS),
    "an engine without diagrams": lambda scene: not scene.engine.family.diagrams,
    "diagrams that are not modelled by the first law": lambda scene: scene.engine.cycles is None,
    "an engine that gives its pressure": lambda scene: scene.engine.torque is None,
    "an engine that gives its torque": lambda scene: scene.engine.torque is not None,
    "largest_speed or smallest_speed": _keys("largest_speed", "smallest_speed"),
    "bore or crankcase_pressure": _keys(*OF_EFFECTIVE_PRESSURE),
    "double-acting cylinders": _word("double_acting"),
    "misfire, pressure_factor or firing_pattern": burning_less,
    "a compressor or pump": lambda scene: any(
        diagram.motored is never_burns for diagram in scene.engine.diagrams
    ),
    "parameters of single cylinders": _keys(*OF_CYLINDER),
    "several numbers of cylinders": lambda scene: (
        len(scene.counts) > 1 and f"[{scene.table_of('cylinders')}] cylinders"
    ),
    "radius_factor": _keys(*(key for key, of in OF_CYLINDER.items() if of.what == "radius_factor")),
    SINGLE: lambda scene: (
        "several_makes" in scene.words
        and (_own_bore(scene) or f"engine {scene.engine.name} [[diagram]]")
    ),
    f"{SINGLE} of the engine": _single_of_engine,
    "another number of cylinders": lambda scene: (
        scene.counts != [int(scene.engine.values.get("cylinders", 0))]
        and f"[{scene.table_of('cylinders')}] cylinders"
    ),
    "bore_N": _own_bore,
    "diagrams of single cylinders": lambda scene: any(
        any(engine.diagrams) for engine in scene.described
    ),
    "pin_offset": lambda scene: scene.nonzero("pin_offset") and "pin_offset",
    "banks to both sides of the crank's axis (VR)": lambda scene: any(
        engine.both_sides for engine in scene.described
    ),
    "articulated_rods": _word("articulated_rods"),
    "balance_shaft_mass": _word("shaft", "balance_shaft_mass"),
    "second_shaft_mass": _word("pair", "second_shaft_mass"),
    "firing_pattern": lambda scene: scene.firing_patterns is not None and FIRING_PATTERN,
    "firing_pattern over several cycles": lambda scene: scene.cycles > 1 and FIRING_PATTERN,
    "a load over several cycles": lambda scene: (
        cycles_of(scene.driven.over_angle, scene.engine.period) > 1
    ),
    "constants and shares of the friction": _keys(*CHEN_FLYNN_KEYS, *STROKE_SHARES),
    "friction by components": lambda scene: (
        friction_law(scene) == BY_COMPONENT and f"friction_law = '{BY_COMPONENT}'"
    ),
    "friction over the stroke": _word(
        "stroke_friction", "friction over the stroke (friction_boundary and other shares)"
    ),
    "diagrams over load and speed": _word("over_speed"),
    "a two-stroke engine": lambda scene: scene.engine.period != FOUR_STROKE,
    "a driver": lambda scene: scene.driven.has_driver,
    "a motor": _keys(*MOTOR_KEYS),
    "a load_table over speed": lambda scene: (
        scene.driven.load_over_speed is not None and "load_table over speed_rpm"
    ),
    "load_linear or load_square": _keys(
        *(key for law in LOAD_LAWS.values() if law.factored for key in law.keys)
    ),
    "method thesis": lambda scene: (
        not set(STEPPING).isdisjoint(scene.methods) and "[solver] method = 'thesis'"
    ),
    "another load than a + k omega^alpha": _other_load,
    "method closed": lambda scene: "closed" in scene.methods and "[solver] method = 'closed'",
    "another load over speed than a + k omega^alpha": lambda scene: (
        scene.driven.law not in METHODS[CLOSED].laws
    ),
    "variable inertia": lambda scene: (
        "variable" in scene.inertia_models and "[solver] inertia_model = 'variable'"
    ),
    "closure cycle_time": lambda scene: (
        scene.closure == "cycle_time" and "[solver] closure = 'cycle_time'"
    ),
    "inertia or its parts": _keys(*shaft.INERTIA_KEYS),
    "counterweight_fraction or counterweight_mass": _keys(*web_weights.GIVEN.excludes),
}
"""Functions that tell by a scene whether it has a feature; `check_tables` does it for tables."""


def check_crossings(scene: Scene, name: str) -> None:
    """Check that a scene has no two features that are refused together.

    Raises
    ------
    SceneError
        With the first such pair; `name` is the scene as messages call it.
    """
    for row in CROSSINGS:
        if row.feature not in FEATURES or row.other not in FEATURES:
            continue  # Another check covers it, at the reading or at the run
        place = FEATURES[row.other](scene) and FEATURES[row.feature](scene)
        if place:
            where = f"{name}: {place}"
            raise refused(row.feature, row.other, where, engine=scene.engine.name)


def check_tables(
    given: SceneFile, labels: Mapping[str, Sequence[str]], several: bool, name: str
) -> None:
    """Check that a scene has no two tables that are refused together, before they are read.

    `labels` are the columns of texts, and `several` says whether there are several engines or
    arrangements.

    Raises
    ------
    SceneError
        With the first such pair; `name` is the scene as messages call it.
    """
    asked = elasticities_in(given.output.quantities)
    texts = any(key in labels for key in LABELS[1:])
    places: dict[str, str] = {SEVERAL: SEVERAL} if several else {}
    if asked:
        places["elasticities"] = f"[output] quantities: elasticities of '{asked[0]}'"
    if texts:
        places["texts in [designs] or [sample]"] = "[designs]"
    for table in ("uncertainty", "reference", "reduce", *GIVEN_FEATURES):
        if getattr(given, table, None) is not None:
            places[f"[{table}]"] = f"[{table}]"
    for row in CROSSINGS:
        if row.feature in places and row.other in places:
            where = f"{name}: {places[row.feature]}"
            raise refused(row.feature, row.other, where, labels=", ".join(labels))
