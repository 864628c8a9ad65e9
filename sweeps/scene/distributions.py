"""Distributions of sampled parameters: ranges and laws as [sample] writes them.

A distribution maps numbers between 0 and 1, of which a sampler draws one for each design, to values
of a parameter in the units of files. Equal numbers give equal values whatever else is drawn.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, Protocol

import numpy as np
from pydantic import Field

from engine_dyn.quantities.node import Node
from engine_dyn.types import Floats
from sweeps.base.checks import Strict, check_range, check_structure, number, numbers
from sweeps.base.errors import SceneError, shown
from sweeps.base.files.libraries import library

FORMS = (
    "low and high (with spacing = 'log' uniform in the logarithm), low, mode and high (triangular),"
    " mean, deviation, low and high (truncated normal), or a list of values"
)
"""Forms of a distribution, for messages."""


class DistributionTable(Strict):
    """A distribution as a scene writes it."""

    low: Any = Field(default=None, description="the lowest value")
    high: Any = Field(default=None, description="the highest value")
    mode: Any = Field(default=None, description="the most probable value: a triangle")
    mean: Any = Field(default=None, description="the mean of the normal distribution")
    deviation: Any = Field(default=None, description="its standard deviation")
    spacing: Literal["linear", "log"] = Field(default="linear", description="'linear' or 'log'")


class Distribution(Protocol):
    """The distribution of a sampled parameter."""

    def of(self, position: Floats) -> Any:
        """Values at positions in 0 to 1 of the cumulative distribution."""

    @property
    def words(self) -> str:
        """The distribution in words, for people."""


@dataclass(frozen=True)
class Uniform:
    """Equally likely between two values, or between their logarithms."""

    low: float
    high: float
    logarithmic: bool = False

    def of(self, position: Floats) -> Floats:
        """Values at positions of the cumulative distribution."""
        if self.logarithmic:
            values = self.low * (self.high / self.low) ** position
        else:
            values = self.low + (self.high - self.low) * position
        return np.asarray(np.clip(values, self.low, self.high))

    @property
    def words(self) -> str:
        """The distribution in words."""
        return f"{self.low:g} to {self.high:g}" + (" in the logarithm" * self.logarithmic)


@dataclass(frozen=True)
class WholeNumbers:
    """Whole numbers from the first to the last, `step` apart, equally likely."""

    low: int
    high: int
    step: int = 1

    def of(self, position: Floats) -> Floats:
        """Values at positions of the cumulative distribution."""
        count = (self.high - self.low) // self.step + 1
        place = np.minimum(np.floor(position * count), count - 1)
        return np.asarray(self.low + self.step * place)

    @property
    def words(self) -> str:
        """The distribution in words."""
        kind = "whole" if self.step == 1 else "even"
        return f"{kind} numbers from {self.low} to {self.high}"


@dataclass(frozen=True)
class Triangular:
    """Density that rises from the lowest value to the most probable one, and falls to the highest.

    The ends have density zero.
    """

    low: float
    mode: float
    high: float

    def of(self, position: Floats) -> Floats:
        """Values at positions of the cumulative distribution."""
        width = self.high - self.low
        rising = self.mode - self.low
        below = position * width < rising
        up = self.low + np.sqrt(position * width * rising)
        down = self.high - np.sqrt((1.0 - position) * width * (self.high - self.mode))
        return np.asarray(np.clip(np.where(below, up, down), self.low, self.high))

    @property
    def words(self) -> str:
        """The distribution in words."""
        return f"triangular, {self.low:g} to {self.high:g}, most probably {self.mode:g}"


@dataclass(frozen=True)
class TruncatedNormal:
    """Normal distribution, cut off at both ends."""

    mean: float
    deviation: float
    low: float
    high: float

    def of(self, position: Floats) -> Floats:
        """Values at positions of the cumulative distribution."""
        law = library("scipy.stats", "SciPy", "[sample]", extra="study").truncnorm
        ends = [(end - self.mean) / self.deviation for end in (self.low, self.high)]
        values = law.ppf(position, *ends, loc=self.mean, scale=self.deviation)
        return np.asarray(np.clip(values, self.low, self.high))

    @property
    def words(self) -> str:
        """The distribution in words."""
        return (
            f"normal, mean {self.mean:g}, standard deviation {self.deviation:g}, "
            f"from {self.low:g} to {self.high:g}"
        )


@dataclass(frozen=True)
class Choice:
    """One of several values, numbers or texts, equally likely."""

    values: tuple[Any, ...]

    def of(self, position: Floats) -> Any:
        """Values at positions of the cumulative distribution."""
        count = len(self.values)
        place = np.minimum(position * count, count - 1).astype(np.int64)
        if isinstance(self.values[0], str):
            return [self.values[i] for i in place]
        return np.array(self.values, dtype=np.float64)[place]

    @property
    def words(self) -> str:
        """The distribution in words."""
        return "one of " + ", ".join(f"{v:g}" if v != str(v) else str(v) for v in self.values)


def read_distribution(raw: Any, where: str, node: Node | None) -> Distribution:
    """Read one entry of [sample]; `node` is its parameter, None for a key whose values are texts.

    Raises
    ------
    SceneError
        With `where`, for what is no distribution, and for values that the parameter cannot have.
    """
    if isinstance(raw, list | np.ndarray):
        return _choice(raw, where, node)
    if node is None:
        raise SceneError(f"{where} = {shown(raw)}: must be a list of strings")
    if not isinstance(raw, Mapping):
        raise SceneError(
            f"{where} = {shown(raw)}: must be a table of {FORMS}; a single value belongs in [set]"
        )
    table = check_structure(DistributionTable, raw, where)
    given = {
        key: number(value, f"{where} {key}", node)
        for key, value in vars(table).items()
        if key != "spacing" and value is not None
    }
    for key in ("low", "mode", "high"):
        if key in given:
            check_range(given[key], f"{where} {key}", node)
    keys, log = set(given), table.spacing == "log"
    if not {"low", "high"} <= keys:
        missing = "low" if "low" not in keys else "high"
        raise SceneError(f"{where}: no {missing}; must have {FORMS}")
    low, high = given["low"], given["high"]
    if low >= high:
        raise SceneError(
            f"{where}: low = {low:g} and high = {high:g}: low must be below high (a single value "
            "belongs in [set])"
        )
    if log and (keys != {"low", "high"} or low <= 0.0):
        what = f"low = {low:g} must be above 0" if low <= 0.0 else "only low and high are allowed"
        raise SceneError(f"{where}: {what} with spacing = 'log'")
    if keys == {"low", "high"}:
        if node.whole or node.even:
            if log:
                raise SceneError(f"{where}: spacing = 'log': not for whole numbers")
            return WholeNumbers(int(low), int(high), 2 if node.even else 1)
        return Uniform(low, high, log)
    if node.whole or node.even:
        raise SceneError(f"{where}: whole numbers have low and high, or a list of values")
    if keys == {"low", "mode", "high"}:
        mode = given["mode"]
        if low <= mode <= high:
            return Triangular(low, mode, high)
        raise SceneError(f"{where} mode = {mode:g}: must be from {low:g} (low) to {high:g} (high)")
    if keys == {"mean", "deviation", "low", "high"}:
        return _truncated(given, where)
    raise SceneError(f"{where}: has {', '.join(given)}; must have {FORMS}")


def _choice(raw: Any, where: str, node: Node | None) -> Choice:
    """Read a list of values that are equally likely."""
    if len(raw) < 2:
        raise SceneError(
            f"{where} = {shown(raw)}: must have at least two values (a single value belongs in "
            "[set])"
        )
    values: tuple[Any, ...]
    if node is None:
        if not all(isinstance(item, str) and item for item in raw):
            raise SceneError(f"{where} = {shown(raw)}: must be a list of strings")
        values = tuple(raw)
    else:
        choices = numbers(raw, where, node)
        check_range(choices, where, node)
        values = tuple(float(value) for value in choices)
    if len(set(values)) < len(values):
        twice = next(value for value in values if values.count(value) > 1)
        raise SceneError(f"{where}: duplicate value {twice}; values must be unique")
    return Choice(values)


def _truncated(given: Mapping[str, float], where: str) -> TruncatedNormal:
    """Check that enough is left of a normal distribution that is cut."""
    mean, deviation, low, high = (given[key] for key in ("mean", "deviation", "low", "high"))
    if deviation <= 0.0:
        raise SceneError(f"{where} deviation = {deviation:g}: must be above 0")
    # Largest number of standard deviations between the mean and the nearer cut of a normal
    # distribution
    farthest = 6.0
    if low > mean + farthest * deviation or high < mean - farthest * deviation:
        raise SceneError(
            f"{where}: low = {low:g} to high = {high:g} is more than {farthest:g} standard "
            f"deviations away from mean = {mean:g}"
        )
    return TruncatedNormal(mean, deviation, low, high)
