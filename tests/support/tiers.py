"""How many of the cases of a test are in the first tier; the others are marked slow."""

import itertools
from collections.abc import Iterable, Sequence
from typing import Any

import pytest


def _case(case: Any, slow: bool) -> Any:
    values = case if isinstance(case, tuple) else (case,)
    return pytest.param(*values, marks=pytest.mark.slow if slow else ())


def every(step: int, cases: Iterable[Any]) -> list[Any]:
    """The first case of each `step` is in the first tier."""
    return [_case(case, number % step > 0) for number, case in enumerate(cases)]


def all_but(slow: Iterable[Any], cases: Iterable[Any]) -> list[Any]:
    """All cases but these are in the first tier."""
    late = {*slow}
    return [_case(case, case in late) for case in cases]


def each_once(*lists: Sequence[Any]) -> list[Any]:
    """All combinations of values; as many as the longest list has are in the first tier.

    Each value is in one of these at least.
    """
    first = [tuple(one[i % len(one)] for one in lists) for i in range(max(map(len, lists)))]
    return [_case(case, case not in first) for case in itertools.product(*lists)]
