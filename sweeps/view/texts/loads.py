"""What the load of a scene means: it names a diagram, and has a torque of its own."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from engine_dyn.pressure.family import Family
from engine_dyn.pressure.family_grid import FamilyGrid
from engine_dyn.quantities.graph import PARAMETERS
from sweeps.base.numbers import number_text, number_texts
from sweeps.scene.plan.variations import ordinary

if TYPE_CHECKING:
    from sweeps.scene.model import Scene

ALIKE = 1.0  # Percent by which the share of a torque may differ from the load that it is said by

MOST_LOADS = 5  # Largest number of loads that are told one by one


def load_line(scene: Scene) -> str:
    """Mean torque at the loads of a scene, and its share of that at 100 %, or the largest load.

    It is that of all cylinders firing, at the middle of the scene's other axes. Nothing is told
    where the load is not given, names the only diagram, or is that share.
    """
    family = scene.engine.family
    if (
        len(scene.ordinary_scenes) > 1 or not isinstance(family, Family | FamilyGrid)
        or len(family.loads) < 2 or not scene.gives("load") or scene.indicator is not None
        or scene.firing_patterns is not None or scene.sample is not None
    ):  # fmt: skip
        return ""
    given = {**scene.settings}
    for key, values in (*scene.axes.items(), *scene.designs.items()):
        if key in PARAMETERS:
            given[key] = float(values[len(values) // 2])
    given.pop("misfire", None)
    asked = np.unique(scene.axes.get("load", scene.designs.get("load", [given.pop("load")])))
    given.pop("load", None)
    if len(asked) > MOST_LOADS:
        asked = asked[[0, len(asked) // 2, -1]]
    full = 100.0 if family.low <= 100.0 <= family.high else family.high
    loads = np.unique([*asked, full])
    one = replace(
        ordinary(scene, ("torque_mean",)), axes={"load": loads}, designs={}, labels={},
        settings=given, dimensions=("load",), sample=None, reduce=None, fail_on=(),
        methods=scene.methods[:1], inertia_models=scene.inertia_models[:1], arrangements=(),
    )  # fmt: skip
    from sweeps.running.compute.in_memory import compute
    from sweeps.scene.plan.plan import make_plan

    try:
        plan = make_plan(one)
        torques = np.broadcast_to(compute(plan)["torque_mean"], loads.shape)
    except Exception:  # Some feature does not hold at another load: the run itself has its results
        return ""
    if not np.isfinite(torques).all():
        return ""
    reference = torques[loads == full][0]
    if reference <= 0.0:
        return ""
    shares = 100.0 * torques / reference
    # What is as good as its share needs no words
    if np.abs(shares - 100.0 * loads / full).max() < ALIKE:
        return ""
    texts = number_texts([float(value) for value in torques])
    told, first = [], True
    for load, text, share in zip(loads, texts, shares, strict=True):
        said = f"{load:g} % gives {text} N m"
        if load != full:
            said += f", {share:.0f} %" + f" of that at {full:g} %" * first
            first = False
        told.append(said)
    speed = plan.leaves.get("speed")
    at = f"at {number_text(float(np.asarray(speed.data)))} rpm, " if speed is not None else ""
    return f"load names a diagram of the engine, not a share of the torque: {at}{'; '.join(told)}"
