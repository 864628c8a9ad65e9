"""Extremes of curves that nodes make: evaluated between the points that a scene asks for.

The curve is followed back to what it is made from, without the crank angle, and made again at
angles of its own: see `engine_dyn.forces.samples`. So its extremes do not depend on the points.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
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
        # Kernels are imported where they are called: importing the graph compiles and loads none.
        from engine_dyn.forces.samples import largest, sample_angles

        if "curve_period" in needs:
            given["curve_period"] = curve_period
        behind = {name: _with_last_axis(value) for name, value in given.items()}
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
    """Whether a node is over the crank angle; such ones are put into `chain`, in their order."""
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


def _with_last_axis(value: Any) -> Any:
    return value[..., None] if _varies(value) else value
