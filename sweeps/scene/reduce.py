"""[reduce] of a scene: what is asked of all designs together, in place of every design."""

from __future__ import annotations

from dataclasses import dataclass

from pydantic import Field

from sweeps.base.checks import Strict

QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)  # Default quantiles of statistics

MOST_KEPT = 100_000  # Largest number of designs that one search keeps

MOST_SEARCHES = 16


class BestTable(Strict):
    """The best designs, as [[reduce.best]] asks for them."""

    least: str | None = Field(
        default=None, description="a string: what shall be small, a quantity or axis"
    )
    most: str | None = Field(
        default=None, description="a string: what shall be large, a quantity or axis"
    )
    number: int = Field(
        default=10, description=f"a whole number from 1 to {MOST_KEPT}: how many are kept", ge=1,
        le=MOST_KEPT,
    )  # fmt: skip
    within: str | list[str] = Field(
        default=[], description="a list of conditions such as 'delta <= 1/150', which must hold"
    )
    not_counted: str | list[str] = Field(
        default=[], description="a list of outcomes that are left out; only with at_every"
    )


class FrontTable(Strict):
    """A Pareto front, as [[reduce.front]] asks for it."""

    of: list[str] = Field(
        description="a list of two or three quantities or axes that shall be small", min_length=2,
        max_length=3,
    )  # fmt: skip
    most: str | list[str] = Field(default=[], description="a list of those that shall be large")
    within: str | list[str] = Field(default=[], description="a list, as in [[reduce.best]]")
    not_counted: str | list[str] = Field(default=[], description="a list, as in [[reduce.best]]")


class ReduceTable(Strict):
    """What is asked of all designs together."""

    statistics: list[str] | None = Field(
        default=None,
        description="a list of quantities whose mean, deviation and quantiles are wanted",
    )
    over: str | list[str] | None = Field(
        default=None, description="a list of axes over which statistics and counts go"
    )
    quantiles: list[float] = Field(
        default=list(QUANTILES),
        description="a list of numbers between 0 and 1",
        min_length=1,
        max_length=99,
    )
    within: str | list[str] = Field(
        default=[], description="a list of conditions such as 'delta <= 1/150', which are counted"
    )
    at_every: str | list[str] = Field(
        default=[], description="a list of axes at all values of which designs are judged"
    )
    best: list[BestTable] = Field(
        default=[],
        description="a list of tables [[reduce.best]]: the best designs",
        max_length=MOST_SEARCHES,
    )
    front: list[FrontTable] = Field(
        default=[],
        description="a list of tables [[reduce.front]]: Pareto fronts",
        max_length=MOST_SEARCHES,
    )


@dataclass(frozen=True)
class Kept:
    """Designs that a search keeps."""

    # Names of optimised quantities, with 1 where less is better and -1 where more is.
    wanted: tuple[tuple[str, float], ...]
    number: int  # Number of designs to keep; 0 for a whole Pareto front
    # Conditions on designs, and outcomes that are left out.
    within: tuple[str, ...]
    not_counted: tuple[str, ...]

    def __str__(self) -> str:
        words = [f"{'least' if sign > 0 else 'most'} {name}" for name, sign in self.wanted]
        conditions = f" within {', '.join(self.within)}" if self.within else ""
        what = f"the {self.number} best by" if self.number else "the front of"
        return f"{what} {' and '.join(words)}{conditions}"


@dataclass(frozen=True)
class Reduce:
    """The table [reduce], once it is read."""

    statistics: tuple[str, ...]  # Quantities with statistics
    over: tuple[str, ...]  # Axes over which statistics and counts are taken
    quantiles: tuple[float, ...]  # Ascending shares of the quantiles
    within: tuple[str, ...]  # Conditions; the designs that meet each of them are counted
    at_every: tuple[str, ...]  # Axes at all values of which the kept designs are judged
    kept: tuple[Kept, ...]  # Searches for designs to keep
