"""Values of the one engine that a scene is about, in SI units: given ones, and what follows."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from engine_dyn.recordings.recorded_cycles import RecordedCycles
from engine_dyn.recordings.transient import TorqueTrain, train_of_cycles
from engine_dyn.types import Floats
from sweeps.base.errors import SceneError
from sweeps.scene.cylinders import cylinders_of_count
from sweeps.scene.model import Scene
from sweeps.scene.plan.leaves import leaves_of, mean_of

__all__ = ["LEFT_OUT", "OneEngine", "engine_of", "value_of"]

LEFT_OUT: Mapping[str, str] = {
    "offset": "pin_offset and crank_offset must be 0",
    "unequal": "cylinders must be equal, and all must burn",
    "unequal_throws": "the crank radii of all cylinders must be equal",
    "idler_gears": "[[idler_gears]] are not allowed; inertia and load_offset must have their parts",
    "wanted_delta": "wanted_delta is not allowed; inertia must be given",
}
"""Words of scenes (`engine_dyn.quantities.variants`) whose engines are not followed here."""


@dataclass(frozen=True)
class OneEngine:
    """An engine with equal cylinders, as the torque over recorded cycles needs it."""

    # [m], [m], [1].
    bore: float
    stroke: float
    crank_ratio: float
    # Per cylinder [kg]; mean of engine and load [kg m2].
    reciprocating_mass: float
    inertia: float
    crankcase_pressure: float  # Absolute [Pa]
    firing: tuple[float, ...]  # Angle at which each cylinder fires [rad], the first 0
    period: float  # Period of the cycle [rad]
    symmetry: int  # How often the torque repeats within the cycle where all cycles are the same

    def train(
        self, pressure: Floats, friction_torque: float, exponent: float, constant: float
    ) -> TorqueTrain:
        """Torque and inertia over whole cycles; each cylinder has the cycles at its own angle.

        Of a cylinder that fires later than the first, what the first cycle needs of the one before
        it is taken from the last: it matters for the closed train, and little for another one.

        Parameters
        ----------
        pressure : ndarray, shape (cycles, samples)
            Absolute pressure [Pa], an even number of samples from -period/2 on.
        friction_torque : float
            [N m]
        exponent, constant : float
            Of the load, see `TorqueTrain`.
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
    """Take the engine out of a scene.

    Parameters
    ----------
    scene : Scene
        What the engine needs must not vary in it.
    where : str
        The scene as messages call it, and who asks.
    left_out : dict
        Words of scenes that are refused, and what must hold instead.

    Raises
    ------
    SceneError
        In one line, for engines that are not followed.
    """
    words = scene.words
    for word, must in left_out.items():
        if word in words:
            raise SceneError(f"{where}: {must}")
    if len(scene.counts) > 1 or scene.arrangements:
        raise SceneError(f"{where}: the scene has several engines; must be one")
    cylinders = cylinders_of_count(scene, scene.counts[0])
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
    return [float(mean_of(scene, leaves, name)) for name in names]


def value_of(scene: Scene, name: str) -> float:
    """One of `values_of`; NaN where neither scene nor engine gives what it needs."""
    try:
        return values_of(scene, [name])[0]
    except KeyError:
        return math.nan
