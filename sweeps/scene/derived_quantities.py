"""Quantities that are derivatives of others by the parameters of a design: their names.

`delta_elasticity` in [output] asks for the elasticities of `delta`. What is computed for it is in
`sweeps.planning.elasticities`.
"""

from __future__ import annotations

from collections.abc import Sequence

from engine_dyn.quantities.graph import QUANTITIES
from sweeps.dimensions import ELASTICITY
from sweeps.errors import SceneError

__all__ = ["elasticities_in", "ordinary"]


def elasticities_in(quantities: Sequence[str]) -> tuple[str, ...]:
    """Quantities whose elasticities are asked for."""
    found = (q.removesuffix(ELASTICITY) for q in quantities if q.endswith(ELASTICITY))
    return tuple(name for name in found if name in QUANTITIES)


def ordinary(quantities: Sequence[str], where: str) -> tuple[str, ...]:
    """Return the quantities in place of whose elasticities they stand, each once.

    Raises
    ------
    SceneError
        Where the elasticity of an outcome is asked for.
    """
    names = []
    for quantity in quantities:
        base = quantity.removesuffix(ELASTICITY)
        if base == "status" and base != quantity:
            raise SceneError(f"{where}: '{quantity}': an outcome has no elasticity")
        names.append(base if quantity != base and base in QUANTITIES else quantity)
    return tuple(dict.fromkeys(names))
