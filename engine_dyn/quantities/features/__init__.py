"""Structured parts of engines, each a file with its physics, its nodes and its `FEATURE`.

A new one is a file here and a name in `FEATURES`; how scenes give it stands in
`sweeps.scene.features`.
"""

from __future__ import annotations

from typing import Any

from engine_dyn.quantities.features import (
    auxiliaries,
    characteristic,
    hold,
    idler_gears,
    indicator,
    mounts,
    shaft,
    torque_tables,
    transient,
    web_weights,
)
from engine_dyn.quantities.features.feature import Feature

__all__ = ["FEATURES"]

FEATURES: tuple[Feature[Any], ...] = (
    shaft.FEATURE, web_weights.FEATURE, mounts.FEATURE, auxiliaries.FEATURE,
    indicator.FEATURE, characteristic.FEATURE, torque_tables.LOAD, torque_tables.DRIVER,
    idler_gears.FEATURE, hold.FEATURE, transient.FEATURE,
)  # fmt: skip
"""All features, in the order of their dimensions in archives."""
