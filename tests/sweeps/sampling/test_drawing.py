"""[sample]: what is drawn follows the distributions that were asked for, and can be drawn again."""

from typing import Any

import numpy as np
import pytest
from scipy import stats

import sweeps
from tests.support.scenes import refusal

NUMBER = 1 << 12

LAWS: dict[str, tuple[str, Any, Any]] = {
    "uniform": ("inertia", {"low": 1.0, "high": 12.0}, stats.uniform(1.0, 11.0)),
    "log": ("inertia", {"low": 1.0, "high": 12.0, "spacing": "log"}, stats.loguniform(1.0, 12.0)),
    "triangular": ("rod_length", {"low": 0.3, "mode": 0.35, "high": 0.45},
        stats.triang(1.0 / 3.0, 0.3, 0.15)),
    "mode at the end": ("rod_length", {"low": 0.3, "mode": 0.45, "high": 0.45},
        stats.triang(1.0, 0.3, 0.15)),
    "normal": ("reciprocating_mass", {"mean": 6.67, "deviation": 0.8, "low": 5.0, "high": 7.0},
        stats.truncnorm((5.0 - 6.67) / 0.8, (7.0 - 6.67) / 0.8, 6.67, 0.8)),
}  # fmt: skip


@pytest.mark.parametrize("law", list(LAWS))
@pytest.mark.parametrize("method", ["sobol", "latin_hypercube"])
def test_values_follow_the_law(law: str, method: str) -> None:
    """Stratified samples are closer to their law than 3 / number everywhere, as a grid would be."""
    key, table, expected = LAWS[law]
    values = sweeps.sample({key: table}, NUMBER, method=method, seed=5)[key].to_numpy()
    distance = stats.kstest(values, expected.cdf).statistic
    assert distance < 3.0 / NUMBER
    assert values.min() >= table["low"] and values.max() <= table["high"]


def test_whole_numbers_choices_and_words_are_equally_likely() -> None:
    words = ["V8 90 cross-plane", "in-line 4", "in-line 6"]
    choices = {"cylinders": {"low": 3, "high": 6}, "load": [10, 50, 90], "crank_ratio": [0.2, 0.3]}
    numbers = sweeps.sample(choices, NUMBER)
    of_words = sweeps.sample({"arrangement": words, "inertia": RANGE}, NUMBER)
    for drawn, values in (
        (numbers["cylinders"], [3, 4, 5, 6]), (numbers["load"], [10, 50, 90]),
        (of_words["arrangement"], words),
    ):  # fmt: skip
        found, counts = np.unique(drawn, return_counts=True)
        assert found.tolist() == values
        assert np.abs(counts - NUMBER / len(values)).max() <= 2


def test_parameters_are_drawn_independently_and_seeds_repeat() -> None:
    drawn = sweeps.sample({key: LAWS[law][1] for law, key in _KEYS.items()}, NUMBER)
    correlation = np.corrcoef(drawn.to_numpy().T)
    assert np.abs(correlation - np.eye(len(correlation))).max() < 0.01
    one, two, again = (
        sweeps.sample({"inertia": LAWS["log"][1]}, 16, seed=seed)["inertia"].to_numpy()
        for seed in (1, 2, 1)
    )
    assert np.array_equal(one, again) and not np.array_equal(one, two)


RANGE = {"low": 1.0, "high": 2.0}

_KEYS = {"log": "inertia", "triangular": "rod_length", "normal": "reciprocating_mass"}


@pytest.mark.parametrize("method", ["sobol", "saltelli"])
def test_more_points_begin_with_the_same_ones(method: str) -> None:
    parameters = {key: LAWS[law][1] for law, key in _KEYS.items()}
    few, many = (sweeps.sample(parameters, n, method=method, seed=2) for n in (16, 128))
    assert np.array_equal(few.to_numpy(), many.to_numpy()[: len(few)])


def test_saltelli_groups_change_one_parameter_at_a_time() -> None:
    parameters = {key: LAWS[law][1] for law, key in _KEYS.items()}
    rows = sweeps.sample(parameters, 8, method="saltelli").to_numpy()
    groups = rows.reshape(8, len(parameters) + 2, len(parameters))
    for number in range(len(parameters)):
        changed = groups[:, 1 + number] != groups[:, 0]
        assert changed[:, number].all() and changed.sum() == 8
        assert np.array_equal(groups[:, 1 + number, number], groups[:, -1, number])


def scene(sample: Any, **more: Any) -> dict[str, Any]:
    return {"engine": "ntua", "output": {"quantities": ["delta"]}, "sample": sample, **more}


WRONG: list[tuple[Any, ...]] = [
    (scene({"number": 4, "inertia": RANGE}, designs={"inertia": [1.0]}),
     "scene: [sample] and [designs]: only one of them is allowed"),
    (scene({"number": 4, "inertia": RANGE}, set={"inertia": 1.0}),
     "scene: inertia is in both [set] and [sample]; give it in one place"),
    (scene({"number": 4, "inertia": RANGE, "wanted_delta": {"low": 0.01, "high": 0.02}}),
     "scene: wanted_delta (in [sample]) and inertia (in [sample]): the inertia follows"),
    (scene({"number": 1, "inertia": RANGE}),
     "scene: [sample] number = 1: must be a whole number from 2 to 16777216"),
    (scene({"number": 1000.5, "inertia": RANGE}),
     "scene: [sample] number = 1000.5: must be a whole number from 2 to 16777216"),
    (scene({"number": 1 << 25, "inertia": RANGE}),
     "scene: [sample] number = 33554432: must be a whole number from 2 to 16777216; with [reduce], "
     "which keeps what is asked and not every design, up to 1073741824"),
    (scene({"number": 4, "method": "sobl", "inertia": RANGE}),
     "scene: [sample] method = 'sobl': unknown; did you mean 'sobol'?"),
    (scene({"method": "saltelli", "number": 1000, "inertia": RANGE}),
     "scene: [sample] number = 1000: must be a power of two with method = 'saltelli', such as 512 "
     "or 1024"),
    (scene({"inertia": RANGE}), "scene: [sample]: number is missing"),
    (scene({"number": 4}), "scene: [sample]: no parameter"),
    (scene({}), "scene: [sample]: no parameter"),
    (scene({"number": 4, "method": "halton", "inertia": RANGE}),
     "scene: [sample] method = 'halton': unknown. Allowed: sobol, latin_hypercube, saltelli"),
    (scene({"number": 4, "seed": -1, "inertia": RANGE}),
     "scene: [sample] seed = -1: must be a whole number from 0"),
    (scene({"number": 4, "inertai": RANGE}),
     "scene: [sample] inertai: unknown key; did you mean 'inertia'?"),
    (scene({"number": 4, "seeds": 3, "inertia": RANGE}),
     "scene: [sample] seeds: unknown key; did you mean 'seed'? Allowed: see "
     "`engine-dyn list keys`, engine, arrangement, firing_pattern, method, number, seed"),
    (scene({"number": 4, "inertia": {"low": 2.0, "high": 1.0}}),
     "scene: [sample] inertia: low = 2 and high = 1: low must be below high"),
    (scene({"number": 4, "inertia": {"low": 2.0, "high": 2.0}}), "low must be below high"),
    (scene({"number": 4, "inertia": {"low": -1.0, "high": 1.0}}),
     "scene: [sample] inertia low = -1: must be a finite number above 0 [kg m2]"),
    (scene({"number": 4, "inertia": 2.0}),
     "scene: [sample] inertia = 2: must be a table of low and high"),
    (scene({"number": 4, "cylinders": [4]}),
     "scene: [sample] cylinders = [4]: must have at least two values"),
    (scene({"number": 4, "cylinders": [4, 6, 4]}), "duplicate value 4"),
    (scene({"number": 4, "cylinders": [4, 99]}),
     "scene: [sample] cylinders = 99: must be a whole number"),
    (scene({"number": 4, "cylinders": {"low": 1.5, "high": 4}}),
     "scene: [sample] cylinders low = 1.5: must be a whole number"),
    (scene({"number": 4, "load_offset": {"low": -1.0, "high": 1.0, "spacing": "log"}}),
     "scene: [sample] load_offset: low = -1 must be above 0 with spacing = 'log'"),
    (scene({"number": 4, "inertia": {**RANGE, "mean": 1.5, "deviation": 1.0, "spacing": "log"}}),
     "only low and high are allowed with spacing = 'log'"),
    (scene({"number": 4, "inertia": {**RANGE, "mean": 1.5}}),
     "scene: [sample] inertia: has low, high, mean; must have low and high"),
    (scene({"number": 4, "inertia": {"mean": 1.5, "deviation": 0.1, "low": 1.0}}),
     "scene: [sample] inertia: no high; must have"),
    (scene({"number": 4, "inertia": {**RANGE, "mean": 1.5, "deviation": 0.0}}),
     "scene: [sample] inertia deviation = 0: must be above 0"),
    (scene({"number": 4, "inertia": {**RANGE, "mean": 9.0, "deviation": 0.5}}),
     "is more than 6 standard deviations away from mean = 9"),
    (scene({"number": 4, "inertia": {**RANGE, "mode": 3.0}}),
     "scene: [sample] inertia mode = 3: must be from 1 (low) to 2 (high)"),
    (scene([1.0]), "sample"),
    (scene({"number": 4, "arrangement": [1, 2]}),
     "scene: [sample] arrangement = [1, 2]: must be a list of strings"),
    (scene({"number": 4, "arrangement": {"low": 1.0, "high": 2.0}}),
     "scene: [sample] arrangement = {'low': 1.0, 'high': 2.0}: must be a list of strings"),
    (scene({"number": 4, "arrangement": ["in-line 1"]}),
     "scene: [sample] arrangement = ['in-line 1']: must have at least two values"),
    (scene({"number": 4, "arrangement": ["in-line 1", "in-line 2", "in-line 1"]}),
     "scene: [sample] arrangement: duplicate value in-line 1"),
    (scene({"number": 4, "case": ["a", "b"], "inertia": RANGE}),
     "scene: [sample] case: unknown key"),
    (scene({"number": 4, "engine": ["ntua", "b112"]}),
     "scene: engine: given at the top and in [sample]; give it once"),
    ({**scene({"number": 4, "engine": ["ntua", "ntuaa"]}), "engine": None},
     "scene: [sample] engine, row 2 = 'ntuaa': unknown engine; did you mean 'ntua'?"),
    (scene({"number": 4, "arrangement": ["in-line 1", "in-line 2"], "cylinders": [1, 2]}),
     "scene: [sample] cylinders: not allowed here; it follows from each arrangement"),
    ({**scene({"number": 4, "inertia": RANGE}), "engine": None}, "scene: engine: missing; must be"),
]  # fmt: skip


@pytest.mark.parametrize(("raw", "expected"), WRONG)
def test_bad_input_is_told_in_one_line(raw: Any, expected: str) -> None:
    assert expected in refusal(raw)
