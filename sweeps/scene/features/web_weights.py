"""Tables [[counterweights]]: counterweights on the webs of the crankshaft."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from pydantic import Field

from engine_dyn.engine import Engine
from engine_dyn.quantities.features.web_weights import FEATURE, WebWeights, of
from engine_dyn.units import DEGREE
from sweeps.base.checks import Strict
from sweeps.scene.features.feature import GivenFeature, with_part
from sweeps.scene.values import GivenValues

FRACTION, MASS = "counterweight_fraction", "counterweight_mass"
"""Parameters that give the weight of counterweights without their places."""


class CounterweightTable(Strict):
    """One counterweight on a web of the crankshaft."""

    mass: float = Field(description="a number in kg, 0 or more", ge=0.0, le=1e5)
    radius: float = Field(
        description="a number in m above 0: distance of its centre of gravity from the axis",
        gt=0.0, le=100.0,
    )  # fmt: skip
    angle: float = Field(
        description="a number in degree, -720 to 720: its direction, with zero and sense of the "
        "angles of throws", ge=-720.0, le=720.0,
    )  # fmt: skip
    position: float = Field(
        description="a number in m, -1000 to 1000: its place along the shaft, from that of throw 1 "
        "away from the free end", ge=-1e3, le=1e3,
    )  # fmt: skip


def _read(
    engine: Engine, given: Sequence[CounterweightTable], folder: Path, where: str
) -> Engine:  # fmt: skip
    rows = [(one.mass, one.radius, one.angle * DEGREE, one.position) for one in given]
    values = {key: value for key, value in engine.values.items() if key not in (FRACTION, MASS)}
    weights = WebWeights(*np.array(rows, dtype=float).T)
    return with_part(replace(engine, values=values), FEATURE.name, weights)


def _words(values: GivenValues) -> tuple[str, ...]:
    # A balanced fraction that the scene gives, also 0, replaces the engine's counterweight mass.
    by_mass = not values.gives(FRACTION) and (values.gives(MASS) or values.engine_gives(MASS))
    on_webs = of(values.engine) is not None
    known = on_webs or by_mass or values.gives(FRACTION) or values.engine_gives(FRACTION)
    sized = "weights_given" if by_mass else "weights_by_fraction"
    return (
        "weights_of_webs" if on_webs else sized,
        "counterweights" if known else "no_counterweights",
    )  # fmt: skip


GIVEN = GivenFeature(
    FEATURE, "tables [[counterweights]] with mass, radius, angle and position, one for each",
    list[CounterweightTable], _read, most=100, excludes=(FRACTION, MASS),
    replaces="[[counterweights]], counterweight_fraction and counterweight_mass of the engine",
    own_crank=True, dropped=lambda values: values.gives(FRACTION, MASS), words=_words,
    line=lambda weights: f"{len(weights.mass)} counterweights on webs",
)  # fmt: skip
