"""The methods that find the periodic speed: the one table of what they are called and can do."""

from __future__ import annotations

from typing import NamedTuple


class Method(NamedTuple):
    """One method."""

    # Name in scenes and in `periodic_speed`; one line.
    name: str
    meaning: str
    # Whether it repeats cycles from a start. Such a method cannot solve for the load coefficient,
    # and its error does not fall with more nodes.
    steps: bool = False
    # Laws of load and driver over speed that it can solve (see `engine_dyn.loads.laws`); empty: all
    # of them.
    laws: tuple[str, ...] = ()
    over_angle: bool = True  # Whether it can solve a load over an angle
    # Exponents of the load that it can solve; empty: all of them. Others get status 4.
    exponents: tuple[float, ...] = ()
    in_batch: bool = False  # Whether the batch solver is tried first

    def can_solve(self, law: str, over_angle: bool) -> bool:
        """Whether it can solve this law over speed, with a load over an angle beside it or not."""
        return (not self.laws or law in self.laws) and (self.over_angle or not over_angle)


METHODS = (
    Method("auto", "the cheapest method that meets the tolerance", in_batch=True),
    Method(
        "thesis", "explicit Euler steps of one degree, as Kakaitsas (2015) prints them",
        steps=True, laws=("power_law",), over_angle=False,
    ),
    Method("newton", "Newton's method on the whole periodic curve"),
    Method("closed", "closed form of the exponents 0 and 2", exponents=(0.0, 2.0)),
)  # fmt: skip
"""All methods, in the order of their codes, which kernels know."""

AUTO, THESIS, NEWTON, CLOSED = range(len(METHODS))

METHOD_NAMES = tuple(method.name for method in METHODS)

STEPPING = tuple(method.name for method in METHODS if method.steps)
"""Methods that repeat cycles from a start."""

INERTIA_MODELS = ("constant", "variable")  # Models of the inertia, in the order of their codes

DEVICES = ("cpu", "cuda")
"""Devices that solve designs: the processor, or a GPU as far as `engine_dyn.card` can."""

CLOSURES = (
    "power_mean",
    "cycle_time",
)  # Meanings of the nominal speed, in the order of their codes

POWER_MEAN, CYCLE_TIME = range(len(CLOSURES))
