"""The key `hold` of [set]: the load follows so that the mean brake torque stays."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from engine_dyn.engine import Engine
from engine_dyn.quantities.features.hold import FEATURE, HELD_KEYS, QUANTITIES
from sweeps.base.errors import SceneError, shown
from sweeps.scene.features.feature import GivenFeature, with_part
from sweeps.scene.values import GivenValues

SAYS = " or ".join(f"'{one}'" for one in QUANTITIES)


def _read(engine: Engine, given: Any, folder: Path, where: str) -> Engine:
    if given not in QUANTITIES:
        raise SceneError(
            f"{where}hold = {shown(given)}: must be {SAYS}, of the engine whose cylinders all "
            "burn; a number belongs in held_torque [N m] or held_power [W]"
        )
    return with_part(engine, FEATURE.name, given)


def _words(values: GivenValues) -> tuple[str, ...]:
    number = next((key for key in HELD_KEYS if values.gives(key)), "")
    held = "held" if number or FEATURE.of(values.engine) else "not_held"
    return held, number.replace("held", "hold") or "hold_undisturbed"


GIVEN = GivenFeature(
    FEATURE,
    f"{SAYS}: the load follows so that this stays what it is while every cylinder burns",
    Any, _read, key=True, scenes_only=True, words=_words,
    line=lambda held: f"hold: the load keeps the {held.replace('_', ' ')} of the undisturbed "
    "engine",
)  # fmt: skip
