"""A structured part of an engine that brings quantities of its own: one object says all of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Generic, NamedTuple, Protocol, TypeVar

from engine_dyn.quantities.node import Dimension, Node

Part = TypeVar("Part")


class HasParts(Protocol):
    """An engine, or a scene with parts that belong to no engine."""

    @property
    def parts(self) -> Mapping[str, Any]:
        """Structured parts by the names of their features."""


class Addition(NamedTuple):
    """An amount that a part adds to a parameter, wherever the graph takes the parameter."""

    # Parameter to which the amount is added. Its own value stays as given: archives list it, and
    # elasticities vary it.
    parameter: str
    node: str  # Node that holds the added amount, in the parameter's SI unit
    when: str = ""  # Cases in which it is added, in the words of `Node.when`; empty: in all


@dataclass(frozen=True)
class Feature(Generic[Part]):
    """Everything that the graph of quantities has because of one part of an engine."""

    name: str  # Key of the part in `Engine.parts`, or in the parts of a scene
    long_name: str  # Meaning of the part, in one line
    subject: str = ""  # Group of `engine-dyn list quantities` for the part's quantities
    # Nodes of the part: its quantities, and its keys of scenes.
    nodes: tuple[Node, ...] = ()
    parameters: tuple[Node, ...] = ()
    dimensions: tuple[Dimension, ...] = ()  # Dimensions that count members of the part from 1
    # Number of the part's members along each of `dimensions`; all are 0 without the part.
    sizes: Callable[[Part], tuple[int, ...]] = lambda part: ()
    # Groups of words that select variants, with their meanings, as in
    # `engine_dyn.quantities.graph`; the reader of a scene decides which word holds.
    words: tuple[Mapping[str, str], ...] = ()
    # Words that people search for, by the quantity that they mean: one of the part, or one that
    # the part is there for, such as `shaking_force`.
    called: Mapping[str, str] = field(default_factory=dict)
    adds: tuple[Addition, ...] = ()  # Amounts that the part adds to parameters
    # Name of the node that holds the part as a whole; None where no node needs it.
    constant: str | None = None

    def of(self, owner: HasParts) -> Part | None:
        """Return the part of an engine or of a scene; None where it has none."""
        return owner.parts.get(self.name)

    def points(self, engine: HasParts) -> dict[str, int]:
        """Return the number of points along each dimension of the part."""
        part = self.of(engine)
        sizes = (0,) * len(self.dimensions) if part is None else self.sizes(part)
        return {d.name: size for d, size in zip(self.dimensions, sizes, strict=True)}


def with_additions(node: Node, additions: Sequence[Addition]) -> Node:
    """Return a node that takes parameters together with what parts add to them."""
    added = [(one.parameter, one.node) for one in additions if one.parameter in node.needs]
    original = node.make
    if not added or original is None:
        return node

    def make(**needs: Any) -> Any:
        sums = {
            parameter: sum(
                (needs[name] for key, name in added if key == parameter), needs[parameter]
            )
            for parameter, _ in added
        }
        return original(**{key: value for key, value in needs.items() if key in own}, **sums)

    own = {*node.needs, "wanted", "threads", "progress", "device"} - {key for key, _ in added}
    return replace(node, needs=(*node.needs, *(name for _, name in added)), make=make)
