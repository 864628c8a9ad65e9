"""Scenes in which features cross, in pairs and more: right, or refused as the table says.

The suite plans every pair, and computes each feature with a number at which it must not matter
beside others. `make properties` computes groups in which every pair stands that works, every pair
by itself, and as many triples as the environment's `CROSSINGS` says.
"""

from __future__ import annotations

import functools
import itertools
import os
import random
import re
import zlib
from collections.abc import Iterator, Sequence
from typing import Any

import pytest
import xarray as xr

import sweeps
from sweeps import SceneError
from sweeps.scene.crossings import CROSSINGS, KEYS
from sweeps.scene.features import GIVEN_FEATURES
from tests.support import crossing_checks as checks
from tests.support.crossing_scenes import (
    BASES,
    FRAGMENTS,
    NEUTRAL,
    Fragment,
    SameKeyError,
    possible,
    refusal_of_scene,
    scene_of,
)  # fmt: skip

pytestmark = [
    pytest.mark.compiled, pytest.mark.slow,
    pytest.mark.filterwarnings("ignore::engine_dyn.ImplausibleWarning"),
]  # fmt: skip

COUNT = int(os.environ.get("CROSSINGS", "0"))

in_properties = pytest.mark.skipif(not COUNT, reason="takes long: make properties runs it")

SAYS = [row.says for row in CROSSINGS] + [reason for *_, reason in KEYS]
OF_ENGINE = (
    r"must be of one of the 1 cylinders|must be the number of one of 1 cylinders|"
    r"no requested quantity depends on|it depends on no continuous parameter|"
    r"needs stroke|gives its torque|has \d+ cylinders|on one throw|as of the other cylinders|"
    r"no firing order is known|crank angle -360 degrees is outside|must be equally many"
)
"""Refusals of single features by the engine they stand on."""
NAMES = [*FRAGMENTS]
PAIRS = [*itertools.combinations(NAMES, 2)]


def says_the_table(line: str) -> bool:
    """Whether a refusal is one of the table, or of one feature by its engine."""
    patterns = (re.sub(r"\\\{\w+\\\}", ".*", re.escape(says)) for says in SAYS)
    return any(re.search(p, line) for p in patterns) or bool(re.search(OF_ENGINE, line))


def drawn(names: Sequence[str]) -> tuple[str, list[Fragment]]:
    """An engine and a variant of each feature, the same for the same names."""
    number = zlib.crc32(" ".join(names).encode())
    variants = [FRAGMENTS[name] for name in names]
    return [*BASES][number % len(BASES)], [v[number // 7 % len(v)] for v in variants]


@functools.cache
def planned(names: tuple[str, ...]) -> tuple[dict[str, Any] | None, str]:
    """The scene of some features, or why it is refused; None where they are one key."""
    try:
        base, fragments = drawn(names)
        scene = scene_of(base, *fragments)
    except SameKeyError as error:
        return None, str(error)
    return scene, refusal_of_scene(scene, scene["output"]["quantities"])


def all_quantities(scene: dict[str, Any]) -> dict[str, Any]:
    one = scene["engine"][0] if isinstance(scene["engine"], list) else scene["engine"]
    names = possible({**scene, "engine": one})
    return {**scene, "output": {**scene["output"], "quantities": names}}


def model_of(scene: dict[str, Any]) -> str:
    model = scene.get("solver", {}).get("inertia_model", "constant")
    return model if isinstance(model, str) else "both"


AGAIN = (checks.alone, checks.backwards, checks.in_parts, checks.extended)
"""Ways to compute a scene again that must give the same bits."""


def wrong(scene: dict[str, Any], number: int = 0) -> list[str]:
    """What does not hold of a scene with all quantities, computed again in one of four ways."""
    whole = sweeps.run(scene)
    bad = [*checks.extremes(whole), *checks.sums(whole), *checks.missing(whole)]
    bad += checks.balance(whole, model_of(scene)) if "reduce" not in scene else []
    if "reduce" not in scene and "sample" not in scene and not isinstance(scene["engine"], list):
        again = AGAIN[number % len(AGAIN)]
        bad += [f"{again.__name__}: {line}" for line in again(scene, whole)]
        bad += checks.stiff(scene) if "shaft" in scene else []
    return bad


@pytest.mark.parametrize("first", NAMES)
def test_pairs_are_planned_or_refused_as_the_table_says(first: str) -> None:
    for second in NAMES[NAMES.index(first) + 1 :]:
        scene, line = planned((first, second))
        assert "\n" not in line
        assert scene is None or not line or says_the_table(line), (second, line)


def test_every_structured_feature_is_crossed() -> None:
    """A feature that no fragment gives would be drawn beside no other."""
    given = {key for variants in FRAGMENTS.values() for one in variants
             for key in (*one, *one.get("set", {}))}  # fmt: skip
    assert GIVEN_FEATURES.keys() - given == set()


LARGEST_GROUP = 7


def groups() -> Iterator[list[str]]:
    """Groups of features such that each pair that works stands in one of them."""
    works = {pair for pair in PAIRS if planned(pair)[1] == ""}
    left = dict.fromkeys(PAIRS[i] for i in range(len(PAIRS)) if PAIRS[i] in works)
    while left:
        group = list(next(iter(left)))
        others = sorted(NAMES, key=lambda one: -sum(one in pair for pair in left))
        for name in (n for n in others if n not in group):
            own = {_in_order(name, other) for other in group}
            if len(group) < LARGEST_GROUP and own <= works and own & left.keys():
                group.append(name)
        while planned(tuple(group))[1]:  # three of them do not go together
            group.pop()
        yield group
        for pair in itertools.combinations(group, 2):
            left.pop(_in_order(*pair), None)


def _in_order(first: str, second: str) -> tuple[str, str]:
    return (first, second) if NAMES.index(first) < NAMES.index(second) else (second, first)


@in_properties
def test_groups_of_all_pairs_that_work() -> None:
    """Each with all quantities: Newton's law, sums, extremes, alone or in another order."""
    bad = {}
    for number, group in enumerate([*groups()][:: 8 if len(PAIRS) > COUNT else 1]):
        scene, _ = planned(tuple(group))
        assert scene is not None
        if lines := wrong(all_quantities(scene), number):
            bad[", ".join(group)] = lines
    assert not bad, bad


def combinations() -> list[tuple[str, ...]]:
    """Triples, and all pairs where there are many: the same in each run."""
    draw = random.Random(60)
    triples = [tuple(draw.sample(NAMES, 3)) for _ in range(COUNT)]
    return triples if len(PAIRS) > COUNT else [*PAIRS, *triples]


@in_properties
def test_drawn_triples() -> None:
    bad: dict[str, list[str]] = {}
    refused = 0
    for number, names in enumerate(combinations()):
        scene, line = planned(names)
        if scene is None or line:
            refused += 1
            assert "\n" not in line
            continue
        try:
            lines = wrong(all_quantities(scene), number)
        except SceneError as error:  # planned, and refused when it is run
            lines = [f"refused when it is run: {error}"]
        if lines:
            bad[", ".join(names)] = lines
            print(names, lines, flush=True)
    print(f"\n{COUNT} drawn, {refused} refused")
    assert not bad, bad


@pytest.mark.parametrize("name", NEUTRAL)
def test_features_that_must_not_matter(name: str) -> None:
    """With its neutral number, a feature leaves the results of another one as they are."""
    draw = random.Random(name)
    for other in draw.sample([n for n in NAMES if n != name], 2 if COUNT < 100 else 12):
        base, (fragment,) = drawn([other])
        try:
            both = scene_of(base, NEUTRAL[name], fragment)
            alone = scene_of(base, fragment)
        except SameKeyError:
            continue
        asked = ["delta", "torque", "torque_max", "energy_swing", "torque_mean", "omega"]
        if "reduce" in both:
            asked = ["delta", "torque_max"]
        for scene in (both, alone):
            scene["output"]["quantities"] = asked
        if refusal_of_scene(both, asked) or refusal_of_scene(alone, asked):
            continue
        found: list[xr.Dataset] = [sweeps.run(scene) for scene in (alone, both)]
        assert checks.changed(*found, within=1e-8) == set(), other


@pytest.mark.parametrize("name", ["counterweights on webs", "mounts"])
def test_tables_on_which_nothing_depends_are_said(name: str) -> None:
    scene = scene_of("four", FRAGMENTS[name][0])
    (table,) = {"counterweights", "mounts"} & scene.keys()
    assert f"[[{table}]]" in sweeps.plan(scene).unused_settings
    asked = {"counterweights": "main_journal_load_max", "mounts": "mount_force_max"}[table]
    scene["output"]["quantities"] = [asked]
    assert f"[[{table}]]" not in sweeps.plan(scene).unused_settings
