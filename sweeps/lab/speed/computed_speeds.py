"""Computed speeds of a scene's recordings for many sets of parameters, in few runs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from engine_dyn.combinations import distinct_combinations
from engine_dyn.pressure.diagram import Diagram, diagram_from_points
from engine_dyn.pressure.family import Family
from engine_dyn.quantities.graph import PARAMETERS
from engine_dyn.types import Floats
from engine_dyn.units import BAR, DEGREE
from sweeps.base.dimensions import DESIGN
from sweeps.base.errors import SceneError, did_you_mean
from sweeps.lab.speed.scene_values import value_of
from sweeps.running.compute.in_memory import compute
from sweeps.scene.model import Scene
from sweeps.scene.plan.plan import make_plan

__all__ = ["NOT_OF_SCENES", "OF_RECORDING", "OF_WHEEL", "SpeedsOfRecordings"]

OF_DIAGRAM = {
    "dead_centre_shift": (0.0, 1.0, "degree", "delay angle of all diagrams"),
    "pegging": (0.0, 0.1, "bar", "pressure added to all diagrams"),
    "pressure_factor": (1.0, 0.1, "1", "factor on all diagrams"),
}
"""Parameters that change the diagrams: where they change nothing, a large change, unit, meaning."""

OF_WHEEL = {
    "gap_angle": (0.0, 1.0, "degree", "crank angle of the first tooth after the longest gap"),
}
"""Parameters of the wheel."""

OF_RECORDING = {
    "recording_shift": (0.0, 1.0, "degree", "delay angle of diagrams and wheel together"),
}
"""Parameters of pressure and wheel together: a dead centre that is wrong moves both."""

NOT_OF_SCENES = OF_DIAGRAM | OF_WHEEL | OF_RECORDING


@dataclass(frozen=True, eq=False)
class SpeedsOfRecordings:
    """Speeds that a scene computes for the designs of its recordings."""

    scene: Scene  # Without axes: one design for each recording
    keys: tuple[str, ...]  # Keys: what varies; of a parameter of one recording ``key@number``
    count: int  # Number of recordings

    @classmethod
    def of(
        cls, scene: Scene, places: Sequence[dict[str, float]], keys: Sequence[str]
    ) -> SpeedsOfRecordings:
        """Make a scene of one design for each recording.

        Parameters
        ----------
        scene : Scene
            With axes or designs.
        places : sequence of dict
            For each recording the values of all that varies in the scene.
        keys : sequence of str
            What is going to vary.

        Raises
        ------
        SceneError
            For keys that are none, and a scene with several words on an axis.
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
            quantities=("omega",), reference=None, fail_on=(), measured=None,
            silenced_warnings=scene.silenced_warnings,
        )  # fmt: skip
        return cls(made, tuple(keys), len(places))

    def start(self, key: str) -> float:
        """Value that the scene has, the mean of its designs."""
        plain, _, number = key.partition("@")
        if plain in PARAMETERS:
            column = self.scene.designs[plain]
            return float(column[int(number) - 1] if number else column.mean())
        return NOT_OF_SCENES[plain][0]

    def speeds(self, values: Floats, *, first: bool = False) -> tuple[Floats, Floats]:
        """Speeds over the angle.

        Parameters
        ----------
        values : ndarray, shape (n, P)
            Of the keys, in the units of files.
        first : bool
            Whether nothing was computed before: what is wrong is then wrong with the scene.

        Returns
        -------
        angle : ndarray, shape (samples,)
            [rad].
        speed : ndarray, shape (n, recordings, samples)
            [rad/s]; NaN for designs without an answer.

        Raises
        ------
        SceneError
            Where the first values are refused.
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
        distinct, which = distinct_combinations(*(diagrams[key] for key in OF_DIAGRAM))
        results: dict[int, Floats] = {}
        refused: ValueError | None = None
        for place, change in enumerate(distinct):
            here = which.ravel() == place
            picked = {key: column.ravel()[here] for key, column in columns.items()}
            try:
                scene = _with_diagrams(replace(self.scene, designs=picked), *change)
                results[place] = _run(scene)
            except ValueError as error:  # a step too far, such as a pressure below none
                refused = error
        if not results and refused is not None and first:
            raise refused
        cycle = math.degrees(self.scene.engine.period)
        step = self.scene.angle_step
        points = -0.5 * cycle + step * np.arange(round(cycle / step))
        angle = np.asarray(points * DEGREE, dtype=np.float64)
        speeds = np.full((number * self.count, angle.size), np.nan)
        for place, found in results.items():
            speeds[which.ravel() == place] = found
        return angle, speeds.reshape(number, self.count, -1)


def _first_value(scene: Scene, key: str) -> float:
    """Value that a scene gives, or that follows from others, as the mass from piston and rod."""
    if scene.gives(key):
        return float(scene.given[key].values[0])
    return value_of(scene, key) / PARAMETERS[key].si


def _run(scene: Scene) -> Floats:
    """Speeds [rad/s] of the designs of a scene over `crank_angle`.

    Without the labels and warnings of `sweeps.run`, which take as long as a few designs: steps of
    a fit may pass through engines that nobody builds.
    """
    plan = make_plan(scene)
    omega, dims = compute(plan)["omega"], plan.dims("omega")
    return np.asarray(np.moveaxis(omega, dims.index("crank_angle"), -1))


def _with_diagrams(scene: Scene, shift: float, pegging: float, factor: float) -> Scene:
    """The scene with diagrams that are moved by an angle, raised and multiplied."""
    if (shift, pegging, factor) == tuple(neutral for neutral, *_ in OF_DIAGRAM.values()):
        return scene

    def changed(diagram: Diagram) -> Diagram:
        return _changed(diagram, shift * DEGREE, pegging * BAR, factor)

    if scene.indicator is not None:
        return replace(scene, indicator=changed(scene.indicator))
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
