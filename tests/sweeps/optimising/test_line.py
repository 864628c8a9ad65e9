"""A search of one number: never worse than an even scan of as many designs, and exact at edges."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import sweeps
from sweeps.decide.optimise.evaluation import Judgement
from sweeps.decide.optimise.optimise import search_line
from sweeps.decide.optimise.space import Space
from sweeps.scene.distributions import Uniform
from sweeps.view.texts.optimised import optimised_text

Function = Callable[[Any], Any]

NEVER: Function = lambda x: np.full_like(x, -1.0)  # noqa: E731


def searched(wanted: Function, violation: Function, low: float, high: float) -> tuple[Any, int]:
    """The best number that is found, and how many were computed."""
    every: list[Any] = []

    space = Space({"x": Uniform(low, high)}, {})

    def judge(positions: Any, _: int) -> Judgement:
        (x,) = space.columns(positions).values()
        every.append(x)
        return Judgement(wanted(x)[:, None], violation(x)[:, None], violation(x) <= 0.0)

    search_line(judge, space, 257, 30)
    x = np.concatenate(every)
    return x[best_of(x, wanted, violation)], x.size


def best_of(x: Any, wanted: Function, violation: Function) -> int:
    return int(np.argmin(np.where(violation(x) <= 0.0, wanted(x), np.inf)))


CASES: dict[str, tuple[Function, Function, float, float, float]] = {
    "edge of a condition": (lambda x: x, lambda x: 2.306 - x, 0.2, 5.0, 2.306),
    "edge over decades": (lambda x: x, lambda x: 0.0123456 - x, 1e-3, 1e3, 0.0123456),
    "kink": (lambda x: abs(x - np.pi), NEVER, 0.0, 10.0, np.pi),
    "jump below the rest": (lambda x: np.where(x < 0.377, -x, 1.0 + x), NEVER, 0.1, 1.0, 0.377),
    "island of a condition": (lambda x: -x, lambda x: abs(x - 3.21) - 0.003, 1.0, 9.0, 3.213),
    "upper end": (lambda x: -x, NEVER, 1.0, 2.0, 2.0),
    "lower end of zero": (lambda x: x * x, NEVER, 0.0, 1.0, 0.0),
    "kinks side by side": (
        lambda x: np.minimum(abs(x - 2.0), abs(x - 7.1) - 1e-5), NEVER, 0.0, 10.0, 7.1,
    ),
    "two allowed ranges": (
        lambda x: -np.sin(x), lambda x: np.where(x < 5.0, x - 1.0, 7.0 - x), 0.0, 9.0,
        7.853981633974483,
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_the_best_number_is_found_to_a_millionth(case: str) -> None:
    wanted, violation, low, high, expected = CASES[case]
    best, number = searched(wanted, violation, low, high)
    assert best == pytest.approx(expected, rel=1e-6, abs=1e-12)
    assert number < 900
    even = np.linspace(low, high, number)
    assert wanted(best) <= wanted(even[best_of(even, wanted, violation)])
    assert violation(np.array([best]))[0] <= 0.0


@pytest.mark.parametrize("seed", range(40))
def test_no_even_scan_of_as_many_is_better(seed: int) -> None:
    """Of sums of six waves with jumps; a wave is longer than twenty of the first intervals."""
    random = np.random.default_rng(seed)
    height, phase = random.normal(size=(2, 6))
    waves = random.uniform(1.0, 12.0, 6)
    jumps, steps = random.uniform(0.0, 1.0, 4), 0.3 * random.normal(size=4)

    def wanted(x: Any) -> Any:
        smooth = height @ np.sin(2.0 * np.pi * waves[:, None] * x + phase[:, None])
        return smooth + steps @ (x > jumps[:, None])

    best, number = searched(wanted, NEVER, 0.0, 1.0)
    even = np.linspace(0.0, 1.0, number)
    assert number < 900
    assert wanted(np.array([best]))[0] <= wanted(even).min() + 1e-9


def test_an_even_minimum_takes_a_few_hundred() -> None:
    _, number = searched(lambda x: (x - 2.7) ** 2, NEVER, 0.2, 5.0)
    assert number < 600


QUIET = {"silenced_warnings": ["all"]}


@pytest.mark.compiled
def test_an_engine_with_few_designs_and_without_libraries(monkeypatch: pytest.MonkeyPatch) -> None:
    """As the exact inverse, to 1e-6, where another condition stands in the way of the inverse."""
    from sweeps.decide.optimise import optimise

    monkeypatch.setattr(optimise, "library", None)  # Neither pymoo nor SciPy is asked for
    question: dict[str, Any] = {
        "engine": "ntua", "axes": {"load": [50.0, 90.0], "misfire": [0, 1]},
        "set": {"speed": 1500.0, "cylinders": 6}, "least": "inertia",
        "over": "inertia = 1 to 200", **QUIET,
    }  # fmt: skip
    exact = sweeps.optimise(within="delta <= 1/50", **question)
    archive = sweeps.optimise(within=["delta <= 1/50", "omega_max <= 1e3"], **question)
    needed = float(exact["inertia"].item())
    best = archive.isel(design=int(np.argmax(archive["found"].values)))
    assert float(best["inertia"]) == pytest.approx(needed, rel=1e-5)
    assert float(best["delta"].max()) <= 0.02
    assert archive.sizes["design"] < 600
    text = optimised_text(archive)
    assert text.startswith("best found: least inertia = ") and " kg m²" in text
    assert "at load = 90 %, misfire = 1" in text and "257 designs evenly over the range" in text
    again = sweeps.optimise(within=["delta <= 1/50", "omega_max <= 1e3"], seed=5, **question)
    np.testing.assert_array_equal(again["delta"].values, archive["delta"].values)


@pytest.mark.compiled
def test_a_range_without_an_answer_says_what_failed() -> None:
    archive = sweeps.optimise(
        engine="ntua", set={"inertia": 20.0}, least="delta", within="delta <= 1/100000",
        over="rod_length = 0.36 to 0.5", number=9, generations=2, **QUIET,
    )  # fmt: skip
    assert not archive["found"].any() and archive.sizes["design"] <= 9 + 90
    assert "0 meet delta <= 1/100000" in optimised_text(archive)
