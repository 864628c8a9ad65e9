"""Keys that hold for a whole scene, where values of single designs stand."""

from __future__ import annotations

from engine_dyn.quantities.graph import PARAMETERS
from sweeps.base.errors import SceneError
from sweeps.scene.engine.cylinder_keys import CYLINDER_KEYS
from sweeps.scene.features import KEYS_OF_SET


def check_of_designs(key: str, where: str, table: str) -> None:
    """Refuse a key that one value cannot be given for, design by design.

    `where` is the place of the key, as messages say it, and `table` what has such values.
    """
    if key in KEYS_OF_SET and KEYS_OF_SET[key].scenes_only:
        raise SceneError(f"{where}: must be in [set], one for all designs")
    if key in CYLINDER_KEYS or key in KEYS_OF_SET:
        one = f"{key.removesuffix('s')}_2"  # Parameter of the second cylinder
        instead = f"{one} and so on" if one in PARAMETERS else "misfire and arrangement"
        also = f"; {table} may have {instead}" if table else ""
        raise SceneError(f"{where}: must be in [set] or the engine file{also}")
