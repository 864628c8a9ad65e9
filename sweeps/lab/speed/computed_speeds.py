"""Computed speeds of a scene's recordings for many sets of parameters, in few runs."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from engine_dyn.given_numbers import distinct_combinations
from engine_dyn.pressure.diagram import Diagram, diagram_from_points
from engine_dyn.pressure.family import Family
from engine_dyn.quantities.graph import PARAMETERS
from engine_dyn.recordings.cylinder_geometry import RecordedCycles
from engine_dyn.recordings.transient import TorqueTrain, train_of_cycles
from engine_dyn.types import Floats
from engine_dyn.units import BAR, DEGREE, RPM
from sweeps.base.dimensions import DESIGN
from sweeps.base.errors import SceneError, did_you_mean
from sweeps.running.compute.in_memory import compute
from sweeps.scene.features import GIVEN_FEATURES, indicator, measured
from sweeps.scene.features.feature import GivenFeature, with_part
from sweeps.scene.model import Scene
from sweeps.scene.plan.leaves import leaves_of, mean_of
from sweeps.scene.plan.plan import make_plan

OF_DIAGRAM = {
    "dead_centre_shift": (0.0, 1.0, "degree", "delay angle of all diagrams"),
    "pegging": (0.0, 0.1, "bar", "pressure added to all diagrams"),
    "pressure_factor": (1.0, 0.1, "1", "factor on all diagrams"),
}
"""Parameters of diagrams: value without effect, size of a large change, unit, meaning."""

OF_WHEEL = {
    "gap_angle": (0.0, 1.0, "degree", "crank angle of the first tooth after the longest gap"),
}
"""Parameters of the toothed wheel: value without effect, size of a large change, unit, meaning."""

OF_RECORDING = {
    "recording_shift": (0.0, 1.0, "degree", "delay angle of diagrams and wheel together"),
}
"""Parameters that move pressure and wheel together: a wrong dead centre shifts both."""

NOT_OF_SCENES = OF_DIAGRAM | OF_WHEEL | OF_RECORDING


@dataclass(frozen=True, eq=False)
class SpeedsOfRecordings:
    """Speeds that a scene computes for the designs of its recordings."""

    scene: Scene  # Scene without axes, with one design for each recording
    # Keys of the varied parameters; one recording's own parameter is ``key@number``
    keys: tuple[str, ...]
    count: int  # Number of recordings
    disc: int | None = None  # Disc of the shaft whose speed it is; None for the rigid crankshaft

    @classmethod
    def of(
        cls, scene: Scene, places: Sequence[dict[str, float]], keys: Sequence[str]
    ) -> SpeedsOfRecordings:
        """Make a scene of one design for each recording.

        `places` hold, for each recording, the values of all that varies in the scene, `keys` name
        values that are going to vary. SceneError refuses unknown keys, and several words on an
        axis.
        """
        name = str(scene.path or "scene")
        words = [key for key, values in scene.axes.items() if isinstance(values, tuple)]
        several = [key for key in words if len(scene.axes[key]) > 1]
        if several:
            raise SceneError(
                f"{name}: [axes] {several[0]}: must be a single word for a fit of speeds"
            )
        for key in keys:
            plain = key.partition("@")[0]
            if plain not in PARAMETERS and plain not in NOT_OF_SCENES:
                known = (*PARAMETERS, *NOT_OF_SCENES)
                raise SceneError(
                    f"{name}: {plain}: not a parameter that can be "
                    f"fitted{did_you_mean(plain, known) or '.'} Allowed: "
                    f"{', '.join(NOT_OF_SCENES)}, and the keys of scenes"
                )
        columns: dict[str, Floats] = {}
        for key in dict.fromkeys(k for place in places for k in place):
            columns[key] = np.array([place[key] for place in places])
        for key in keys:
            plain = key.partition("@")[0]
            if plain in PARAMETERS and plain not in columns:
                columns[plain] = np.full(len(places), _first_value(scene, plain))
        made = replace(
            scene, axes={}, dimensions=(DESIGN,), labels={}, designs=columns,
            settings={k: v for k, v in scene.settings.items() if k not in columns},
            quantities=("omega",), reference=None, fail_on=(),
            silenced_warnings=scene.silenced_warnings,
        )  # fmt: skip
        disc = None if scene.measured is None else scene.measured.disc
        return cls(with_part(made, measured.GIVEN.name, None), tuple(keys), len(places), disc)

    def start(self, key: str) -> float:
        """Value that the scene has, the mean of its designs."""
        plain, _, number = key.partition("@")
        if plain in PARAMETERS:
            column = self.scene.designs[plain]
            return float(column[int(number) - 1] if number else column.mean())
        return NOT_OF_SCENES[plain][0]

    def speeds(self, values: Floats, *, first: bool = False) -> tuple[Floats, Floats]:
        """Angles [rad] and speeds [rad/s], shape (n, recordings, samples), of n sets of values.

        The `values`, shape (n, P), are those of the keys in the units of files; speeds of designs
        without an answer are NaN. If `first`, nothing was computed before: ValueError tells what is
        wrong with the scene where no design can be computed.
        """
        number = len(values)
        columns = {key: np.tile(column, (number, 1)) for key, column in self.scene.designs.items()}
        diagrams = {key: np.full((number, self.count), one[0]) for key, one in OF_DIAGRAM.items()}
        recorded = np.zeros((number, self.count))
        for key, varied in zip(self.keys, values.T, strict=True):
            plain, _, own = key.partition("@")
            if plain in OF_WHEEL:
                continue
            where = [int(own) - 1] if own else slice(None)
            if plain in OF_RECORDING:
                recorded[:, where] = varied[:, None]
            else:
                (columns if plain in PARAMETERS else diagrams)[plain][:, where] = varied[:, None]
        diagrams["dead_centre_shift"] += recorded
        cycle = math.degrees(self.scene.engine.period)
        step = self.scene.angle_step
        points = -0.5 * cycle + step * np.arange(round(cycle / step))
        angle: Floats = np.asarray(points * DEGREE, dtype=np.float64)
        distinct, which = distinct_combinations(*(diagrams[key] for key in OF_DIAGRAM))
        results: dict[int, Floats] = {}
        refused: ValueError | None = None
        for place, change in enumerate(distinct):
            here = which.ravel() == place
            picked = {key: column.ravel()[here] for key, column in columns.items()}
            try:
                changed = _with_diagrams(replace(self.scene, designs=picked), *change)
                results[place] = (
                    _run(changed) if self.disc is None else _of_disc(changed, self.disc, angle)
                )
            # A step of the fit may go too far, such as to a negative pressure
            except ValueError as error:
                refused = error
        if not results and refused is not None and first:
            raise refused
        speeds = np.full((number * self.count, angle.size), np.nan)
        for place, solved in results.items():
            speeds[which.ravel() == place] = solved
        return angle, speeds.reshape(number, self.count, -1)


def _first_value(scene: Scene, key: str) -> float:
    """Value that a scene gives, or one that follows from others (the mass from piston and rod)."""
    if scene.gives(key):
        return float(scene.given[key].values[0])
    return value_of(scene, key) / PARAMETERS[key].si


def _run(scene: Scene) -> Floats:
    """Speeds [rad/s] of the designs of a scene over `crank_angle`."""
    # Labels and warnings, which take `sweeps.run` as long as a few designs, are left out: a fit
    # needs no labels, and its steps may pass through engines that nobody builds.
    plan = make_plan(scene)
    omega, dims = compute(plan)["omega"], plan.dims("omega")
    return np.asarray(np.moveaxis(omega, dims.index("crank_angle"), -1))


def _of_disc(scene: Scene, disc: int, angle: Floats) -> Floats:
    """Speed of a disc [rad/s] of each design over its own angle, by its stored orders.

    A toothed wheel and an integrated speed count the disc's own angle phi + theta(phi), which is
    solved for phi; theta' is far below 1.
    """
    plan = make_plan(replace(scene, quantities=("disc_harmonics",)))
    found, dims = compute(plan)["disc_harmonics"], plan.dims("disc_harmonics")
    ends = [dims.index("disc"), dims.index("order")]
    harmonics = np.moveaxis(found, ends, [-2, -1])[..., disc, :].reshape(-1, found.shape[ends[1]])
    orders = plan.points["order"]
    mean = np.asarray(scene.designs["speed"])[:, None] * RPM

    def sums(values: Any, phi: Floats) -> Floats:
        total = np.zeros((len(values), angle.size))
        for order, one in zip(orders, values.T, strict=True):
            total += (one[:, None] * np.exp(1j * order * phi)).real
        return total

    phi = np.tile(angle, (len(harmonics), 1))
    for _ in range(5):
        phi = angle - sums(harmonics, phi)
    return mean * (1.0 + sums(1j * orders * harmonics, phi))


def _with_diagrams(scene: Scene, shift: float, pegging: float, factor: float) -> Scene:
    """The scene with its diagrams shifted by an angle, raised by a pressure and multiplied."""
    if (shift, pegging, factor) == tuple(neutral for neutral, *_ in OF_DIAGRAM.values()):
        return scene

    def changed(diagram: Diagram) -> Diagram:
        return _changed(diagram, shift * DEGREE, pegging * BAR, factor)

    if scene.indicator is not None:
        indicated = indicator.of(scene)._replace(diagram=changed(scene.indicator))
        return with_part(scene, indicator.GIVEN.name, indicated)
    family = scene.engine.family
    if not isinstance(family, Family):
        raise SceneError(
            f"{scene.engine.name}: diagrams that depend on speed cannot be changed by a fit; give "
            "diagrams for the recorded speeds"
        )
    return replace(scene, engine=replace(scene.engine, family=family.each(changed)))


def _changed(diagram: Diagram, shift: float, pegging: float, factor: float) -> Diagram:
    half, period = 0.5 * diagram.period, diagram.period
    angle = (diagram.angle + shift + half) % period - half
    order = np.argsort(angle)
    pressure = np.maximum(factor * diagram.pressure + pegging, 0.0)
    return diagram_from_points(angle[order], pressure[order], period)


def _grown(feature: GivenFeature) -> str:
    """Parameters to which a feature adds."""
    return " and ".join(sorted({one.parameter for one in feature.feature.adds} & PARAMETERS.keys()))


LEFT_OUT: Mapping[str, str] = {
    "offset": "pin_offset and crank_offset must be 0",
    "several_makes": "the bores and diagrams of all cylinders must be equal",
    "unequal": "cylinders must be equal, and all must burn",
    "unequal_throws": "the crank radii of all cylinders must be equal",
    **{
        word: f"{one.written} are not allowed; {_grown(one)} must have their parts"
        for one in GIVEN_FEATURES.values()
        if one.feature.adds
        for word in tuple(one.feature.words[0])[1:]
    },
    "wanted_delta": "wanted_delta is not allowed; inertia must be given",
    "held": "hold, held_torque and held_power are not allowed; load must be given",
}
"""Words of scenes (`engine_dyn.quantities.graph`) with which an engine is refused here."""


@dataclass(frozen=True)
class OneEngine:
    """An engine with equal cylinders, as the torque over recorded cycles needs it."""

    # Bore and stroke [m], and crank ratio [1].
    bore: float
    stroke: float
    crank_ratio: float
    # Reciprocating mass of a cylinder [kg]; mean inertia of engine and load [kg m2].
    reciprocating_mass: float
    inertia: float
    crankcase_pressure: float  # Absolute pressure in the crankcase [Pa]
    firing: tuple[float, ...]  # Angle at which each cylinder fires [rad], the first 0
    period: float  # Period of the cycle [rad]
    # Number of times that the torque repeats within a cycle if all cylinders are alike
    symmetry: int

    def train(
        self, pressure: Floats, friction_torque: float, exponent: float, constant: float
    ) -> TorqueTrain:
        """Torque and inertia over whole cycles; each cylinder has the cycles at its own angle.

        Of a cylinder that fires later than the first, what the first cycle needs of the one before
        it is taken from the last: it matters for the closed train, and little for another one. The
        `pressure` [Pa], shape (cycles, samples), is absolute and has an even number of samples from
        -period/2 on; friction is in N m, exponent and constant of the load are those of
        `TorqueTrain`.
        """
        samples = pressure.shape[1]
        angle = self.period * (np.arange(samples) / samples - 0.5)
        around = RecordedCycles(
            angle, np.vstack([pressure[-1:], pressure, pressure[:1]]), self.period
        )
        longer = train_of_cycles(
            [around] * len(self.firing),
            bore=self.bore,
            stroke=self.stroke,
            crank_ratio=self.crank_ratio,
            reciprocating_mass=self.reciprocating_mass,
            inertia=self.inertia,
            firing_angles=self.firing,
            friction_torque=friction_torque,
            crankcase_pressure=self.crankcase_pressure,
            exponent=exponent,
            constant=constant,
        )
        whole = slice(samples, samples + pressure.size + 1)
        return replace(longer, torque=longer.torque[whole], inertia=longer.inertia[whole])


def engine_of(scene: Scene, where: str, left_out: Mapping[str, str] = LEFT_OUT) -> OneEngine:
    """Take the engine out of a scene in which the values that it needs do not vary.

    SceneError, with `where` before it, refuses engines with words that are `left_out`, by what must
    hold instead, and several engines.
    """
    words = scene.words
    for word, must in left_out.items():
        if word in words:
            raise SceneError(f"{where}: {must}")
    if len(scene.counts) > 1 or scene.arrangements:
        raise SceneError(f"{where}: the scene has several engines; must be one")
    cylinders = scene.cylinders_by_count[scene.counts[0]]
    period = float(scene.engine.period)
    names = ("bore", "stroke", "crank_ratio", "reciprocating_mass", "inertia", "crankcase_pressure")
    bore, stroke, crank_ratio, mass, inertia, crankcase = values_of(scene, names)
    return OneEngine(
        bore, stroke, crank_ratio, mass, inertia, crankcase,
        tuple(-member.phase % period for member in cylinders.members), period,
        cylinders.symmetry,
    )  # fmt: skip


def values_of(scene: Scene, names: Iterable[str]) -> list[float]:
    """Parameters or quantities without dimensions [SI], the means of designs that differ."""
    leaves = leaves_of(scene, {})
    return [float(mean_of(scene.node, leaves, name)) for name in names]


def value_of(scene: Scene, name: str) -> float:
    """One of `values_of`; NaN where neither scene nor engine gives what it needs."""
    try:
        return values_of(scene, [name])[0]
    except KeyError:
        return math.nan
