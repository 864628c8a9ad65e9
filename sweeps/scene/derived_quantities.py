"""Quantities that follow from others: their names, and of which there are some.

`delta_elasticity` in [output] asks for the elasticities of `delta`. What is computed for it is in
`sweeps.scene.plan.variations`. `torque_rms` and `torque_mean`, the root mean square and the mean
of a curve, are nodes of the graph (`engine_dyn.quantities.curve_extremes`), so that nothing is
needed here.
"""

from __future__ import annotations

from collections.abc import Sequence

from engine_dyn.quantities.graph import ALL_QUANTITIES
from sweeps.base.dimensions import ELASTICITY
from sweeps.base.errors import SceneError


def elasticities_in(quantities: Sequence[str]) -> tuple[str, ...]:
    """Quantities whose elasticities are asked for."""
    bases = (q.removesuffix(ELASTICITY) for q in quantities if q.endswith(ELASTICITY))
    return tuple(name for name in bases if name in ALL_QUANTITIES)


def meanings_of(quantity: str) -> tuple[str, ...]:
    """Meanings of the numbers of a verdict; empty for a quantity that is a measure."""
    node = ALL_QUANTITIES.get(quantity)
    return node.meanings if node is not None else ()


def ordinary(quantities: Sequence[str], where: str) -> tuple[str, ...]:
    """Return the quantities, each once, and in place of an elasticity its quantity.

    Elasticities of outcomes and of verdicts are refused.
    """
    names = []
    for quantity in quantities:
        base = quantity.removesuffix(ELASTICITY)
        if base == "status" and base != quantity:
            raise SceneError(f"{where}: '{quantity}': an outcome has no elasticity")
        if meanings_of(base) and base != quantity:
            raise SceneError(f"{where}: '{quantity}': a verdict has no elasticity")
        names.append(base if quantity != base and base in ALL_QUANTITIES else quantity)
    return tuple(dict.fromkeys(names))
