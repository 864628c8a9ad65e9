"""Whether parameters of single cylinders, misfires and firing orders fit the engine's cylinders."""

from __future__ import annotations

import numpy as np

from engine_dyn.forces.balance.lines import is_boxer
from engine_dyn.geometry import arrangement
from engine_dyn.geometry.cylinders import Cylinders
from engine_dyn.quantities.each_cylinder import with_values
from engine_dyn.quantities.graph import PARAMETERS
from sweeps.base.checks import mentioned
from sweeps.base.dimensions import ELASTICITY
from sweeps.base.errors import SceneError
from sweeps.scene.model import Scene
from sweeps.scene.values import GivenValues


def extreme_cylinders(scene: Scene, name: str) -> tuple[Cylinders, ...]:
    """Cylinders of the scene, with the parameters of single ones at both ends of what they take.

    Raises
    ------
    SceneError
        For a value that no cylinder of the engine can have.
    """
    keys = scene.cylinder_keys
    if not keys:
        return scene.described
    extremes = []
    for engine in scene.all_cylinders:
        for end in (np.min, np.max):
            values = {}
            for key in keys:
                table, given, _ = scene.given_or_own(key)
                values[key] = float(end(given)) * PARAMETERS[key].si
                try:
                    with_values(engine, {key: values[key]})
                except ValueError as error:
                    text = mentioned(error).removeprefix(f"{key}: ")
                    raise SceneError(f"{name}: [{table}] {key}: {text}") from None
            extremes.append(with_values(engine, values))
    return tuple(extremes)


def check_misfire(values: GivenValues, name: str) -> None:
    """Check that the cylinder that does not burn is one of the engine's in every combination."""
    table, silent, _ = values.given_or_own("misfire", 0.0)
    of_count, counts, _ = values.given_or_own("cylinders")
    if not of_count == table == "designs":  # Unless both are columns, all values meet
        silent, counts = silent.max(keepdims=True), counts.min(keepdims=True)
    wrong = np.flatnonzero(silent > counts)
    if wrong.size:
        most = np.broadcast_to(counts, silent.shape)[wrong[0]]
        raise SceneError(
            f"{name}: [{table or 'set'}] misfire = {silent[wrong[0]]:g}: must be the number of one "
            f"of {most:g} cylinders, or 0"
        )


def check_bank_offset(scene: Scene, quantity: str, name: str) -> None:
    """Check that a moment does not hang on a distance of banks that nobody gives.

    In the bays of a boxer it does: pins that are a whole distance of throws apart stand in the
    bearings of their bay.
    """
    from engine_dyn.forces.balance.shaking_forces import hangs_on_bank_offset

    order = {"shaking_moment_first": 1, "shaking_moment_second": 2}.get(
        quantity.removesuffix(ELASTICITY)
    )
    for engine in scene.all_cylinders:
        if engine.arrangement is None:
            continue  # `check_throws` refuses these cylinders
        boxer = is_boxer(engine)
        if "bay_" in quantity if boxer else hangs_on_bank_offset(engine, order):
            raise SceneError(
                f"{name}: [output] quantities: '{quantity}' needs bank_offset (offset of each bank "
                f"from the one before, along the shaft), without which it is 0 or unknown for "
                f"{engine.arrangement.name or 'this arrangement'}; must be in [set], [axes] or "
                "[designs], 0 where the rods of a pair work in one plane"
            )


def check_throws(scene: Scene, quantity: str, name: str) -> None:
    """Check that the order of the throws is known for every number of cylinders."""
    if scene.arrangements:
        return
    own = len(scene.own_cylinders.members) if scene.own_cylinders is not None else 0
    two_stroke = scene.engine.period == arrangement.TURN
    for count in scene.counts:
        if count != own and arrangement.customary_order(count, two_stroke) is None:
            counts = range(1, arrangement.MOST_CYLINDERS + 1)
            known = {z for z in counts if arrangement.customary_order(z, two_stroke) is not None}
            orders = ", ".join(str(z) for z in sorted({*known, own} - {0}))
            raise SceneError(
                f"{name}: cylinders = {count}: no firing order is known, which '{quantity}' "
                f"needs; must be one of {orders}"
            )
