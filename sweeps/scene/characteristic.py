"""[characteristic] of a scene: the torque over speed that the load follows."""

from __future__ import annotations

import math

from engine_dyn.loads.characteristic import CHARACTERISTICS, Characteristic
from sweeps.base.errors import SceneError, not_known, shown
from sweeps.scene.toml_tables import SceneFile

__all__ = ["read_characteristic"]


def read_characteristic(given: SceneFile, name: str) -> Characteristic | None:
    """Read [characteristic]: a known curve, or coefficients; None without it.

    Raises
    ------
    SceneError
        For an unknown kind and for coefficients that are not finite.
    """
    table = given.characteristic
    if table is None:
        return None
    where = f"{name}: [characteristic]"
    if (table.kind is None) == (table.coefficients is None):
        raise SceneError(f"{where}: must have either kind or coefficients")
    if table.coefficients is not None:
        constant, linear = table.coefficients
        if not (math.isfinite(constant) and math.isfinite(linear)):
            raise SceneError(f"{where} coefficients = {table.coefficients}: must be finite numbers")
        return Characteristic(constant, linear, -1.0, "coefficients of the scene")
    kind = str(table.kind)
    if kind not in CHARACTERISTICS:
        raise SceneError(f"{where} kind = {shown(kind)}: unknown{not_known(kind, CHARACTERISTICS)}")
    return CHARACTERISTICS[kind]
