"""Curves in few numbers: their extremes, and `<curve>_rms` and `<curve>_mean`.

Extremes are evaluated between the points that a scene asks for: the curve is followed back to what
it is made from, without the crank angle, and made again at angles of its own (see
`engine_dyn.forces.superposition`). So they do not depend on the points.

Every curve has a root mean square and a mean, so they stand in no file of a subject. Where a
subject has a quantity of such a name (`torque_mean`, `shaking_force_rms`), which a kernel or a
closed form gives, that one holds.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from engine_dyn.quantities.node import Node
from engine_dyn.types import Floats, Integers

ANGLE = "crank_angle"


def is_of_curve(node: Node) -> bool:
    """Whether a node is an extreme of a curve that `of_curve` has to find."""
    return node.make is None and ANGLE in node.removes


def of_curve(node: Node, variant: Callable[[str], Node]) -> Node:
    """The node with what makes it and its needs, by the variants that a scene has."""
    assert node.extreme_of is not None
    curve, which = node.extreme_of
    chain: dict[str, Node] = {}
    _follow(curve, variant, chain, set())
    needs = {need for one in chain.values() for need in one.needs} - chain.keys() - {ANGLE}
    sign = {"largest": 1.0, "smallest": -1.0}[which]

    def values(phi: Any, given: Mapping[str, Any]) -> Any:
        known = {**given, ANGLE: phi}
        for name, one in chain.items():
            assert one.make is not None
            known[name] = one.make(**{need: known[need] for need in one.needs})
        return known[curve]

    def make(curve_period: float, **given: Any) -> Any:
        from engine_dyn.forces.superposition import largest, sample_angles

        if "curve_period" in needs:
            given["curve_period"] = curve_period
        behind = {n: value[..., None] if _varies(value) else value for n, value in given.items()}
        phi = sample_angles(curve_period, given.get("family"))
        samples = np.asarray(values(phi, behind))
        shape = samples.shape[:-1]
        columns = {
            name: np.broadcast_to(value, (*shape, 1)).reshape(-1, 1) if _varies(value) else value
            for name, value in behind.items()
        }

        def at(designs: Integers, angle: Floats) -> Floats:
            chosen = {n: v[designs] if _varies(v) else v for n, v in columns.items()}
            return np.asarray(values(angle[:, None], chosen))[:, 0]

        return sign * largest(samples.reshape(-1, phi.size), phi, at, sign)[0].reshape(shape)

    return replace(node, needs=tuple(sorted(needs | {"curve_period"})), removes=(), make=make)


def _follow(
    name: str, variant: Callable[[str], Node], chain: dict[str, Node], others: set[str]
) -> bool:
    """Whether a node depends on the crank angle; `chain` gets such nodes in their order."""
    if name in chain or name == ANGLE:
        return True
    if name in others:
        return False
    node = variant(name)
    over = [_follow(need, variant, chain, others) for need in node.needs]
    if any(over) and ANGLE not in node.removes:
        chain[name] = node
        return True
    others.add(name)
    return False


def _varies(value: Any) -> bool:
    return isinstance(value, np.ndarray) and value.ndim > 0


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
    # Where each row is contiguous in memory, its sum has the same bits for any number of rows.
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
            _of_curve(plain, "_rms", "root mean square", "({})_{{rms}}", root_mean_square),
            _of_curve(plain, "_mean", "mean", r"\langle {} \rangle", curve_mean),
        ]
    return tuple(node for node in means if node.name not in known)
