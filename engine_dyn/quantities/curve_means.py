"""Root mean squares and means of curves over the crank angle: `<curve>_rms`, `<curve>_mean`.

Every curve has both, so they stand in no file of a subject. Where a subject has a quantity of such
a name (`torque_mean`, `shaking_force_rms`), which a kernel or a closed form gives, that one holds.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from engine_dyn.quantities.node import Node

RMS, MEAN = "_rms", "_mean"  # Endings of the names


def root_mean_square(curve: Any) -> Any:
    """Root of the mean square along the last axis, whose points are equal steps of one cycle.

    The rectangle rule, which is the trapezoidal rule of a periodic curve: where the curve is
    smooth, its error falls faster than any power of the step (L. N. Trefethen and J. A. C.
    Weideman, SIAM Review 56, 2014, pp. 385-458).

    Parameters
    ----------
    curve : array_like
        Values at equal steps, the end of the cycle left out; a single number is a constant.

    Returns
    -------
    ndarray
        Without the last axis, in the unit of the curve.

    Examples
    --------
    >>> import numpy as np
    >>> round(float(root_mean_square(np.sin(np.arange(0.0, 2.0 * np.pi, np.pi / 4)))), 6)
    0.707107
    """
    return np.sqrt(curve_mean(np.square(curve)))


def curve_mean(curve: Any) -> Any:
    """Mean along the last axis, whose points are equal steps of one cycle: see `root_mean_square`.

    Examples
    --------
    >>> float(curve_mean([1.0, 2.0, 3.0]))
    2.0
    """
    values = np.asarray(curve, dtype=float)
    # In this order of memory the sum of a row has the same bits, however many rows there are.
    return values if values.ndim == 0 else np.ascontiguousarray(values).mean(axis=-1)


def _of_curve(curve: Node, ending: str, about: str, symbol: str, formula: Callable[[Any], Any]
              ) -> Node:  # fmt: skip
    def make(**needs: Any) -> Any:
        return formula(needs[curve.name])

    return Node(
        f"{curve.name}{ending}", symbol.format(curve.symbol), curve.unit,
        f"{about} of the {curve.long_name}",
        "rectangle rule over the steps of crank_angle", needs=(curve.name,),
        removes=("crank_angle",), make=make, si=curve.si,
    )  # fmt: skip


def means_of_curves(quantities: Iterable[Node]) -> tuple[Node, ...]:
    """Root mean square and mean of each curve over the crank angle that has none of this name.

    Parameters
    ----------
    quantities : iterable of Node
        All quantities; variants of one name have one unit.
    """
    nodes = list(quantities)
    known = {node.name for node in nodes}
    curves = {node.name: node for node in reversed(nodes) if node.kind == "curve" and node.public}
    means = []
    for curve in curves.values():
        plain = replace(curve, when="")
        means += [
            _of_curve(plain, RMS, "root mean square", "({})_{{rms}}", root_mean_square),
            _of_curve(plain, MEAN, "mean", r"\langle {} \rangle", curve_mean),
        ]
    return tuple(node for node in means if node.name not in known)
