"""The graph of quantities: complete, without cycles, read by UDUNITS, and all of it reachable."""

import itertools
import re
from typing import Any

import cf_units
import numpy as np
import pytest

from engine_dyn.loads.laws import LAWS, LOAD_LAWS
from engine_dyn.quantities.graph import (
    ALL_QUANTITIES,
    ALTERNATIVES,
    DIMENSIONS,
    NODES,
    NUMBERED,
    PARAMETERS,
    WORDS,
    check_words,
    variants_of,
)
from engine_dyn.quantities.node import Node, check_needs, power
from engine_dyn.quantities.parameters import CYCLE_KEYS
from tests.support.scenes import (
    APART,
    GENERATING_SET,
    IN_PASSING,
    NOT_OF_AN_ENGINE,
    OF_TRANSIENTS,
    computed,
)
from tests.support.shafts import passing_shaft

pytestmark = pytest.mark.compiled

ALL = [node for variants in NODES.values() for node in variants]


def test_whoever_needs_the_cylinders_needs_to_know_which() -> None:
    for node in ALL:
        if "cylinders_by_count" in node.needs:
            assert not {"cylinder_set", "undisturbed_set"}.isdisjoint(node.needs), node.name


def test_words_stand_in_one_group_and_select_something() -> None:
    assert len(WORDS) == sum(len(group) for group in ALTERNATIVES)
    assert {word for node in ALL for word in node.when.split()} == set(WORDS)


def test_a_word_that_does_not_exist_is_refused() -> None:
    message = "node 'imep': when = 'equal centered': 'centered' is no word of "
    message += "engine_dyn.quantities.graph; did you mean 'centred'?"
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        check_words("imep", "equal centered")


OF_EXTREMES = "speed_of_largest", "speed_of_smallest"

NO_SCENES = (
    *({law, "with_driver"} for law in LOAD_LAWS), {"motor", "no_driver"},
    {"equal", "unequal_throws"},
    *({other, word} for other in ("by_pressure", "motor", "with_driver") for word in OF_EXTREMES),
)  # fmt: skip
"""Words that no scene has together."""

ONLY_THEN = {
    "diagram_scale": {"characteristic", "held"}, "inertia_beyond_gear": set(),
    "recorded_cycle": {"over_cycles"}, "speed_search": set(OF_EXTREMES),
    "shape_at_nominal": {law.name for law in LAWS} - {"power_law"},
}  # fmt: skip
"""Names that nothing needs unless a scene has one of these words."""


@pytest.mark.parametrize("name", [name for name in NODES if any(n.when for n in NODES[name])])
def test_words_of_a_scene_select_one_variant(name: str) -> None:
    used = {word for node in NODES[name] for word in node.when.split()}
    groups = [group for group in ALTERNATIVES if not used.isdisjoint(group)]
    for words in itertools.product(*groups):
        if any(pair <= set(words) for pair in NO_SCENES):
            continue
        if name in ONLY_THEN and ONLY_THEN[name].isdisjoint(words):
            continue
        found = [node for node in NODES[name] if set(node.when.split()) <= set(words)]
        assert len(found) == 1, words
        assert variants_of(words)[name] is found[0]


def test_every_unit_is_read_by_udunits() -> None:
    for node in (*PARAMETERS.values(), *ALL_QUANTITIES.values()):
        if node.unit:
            cf_units.Unit(node.unit)
        else:
            assert node.name in ("load_coefficient",), node.name


def test_factors_to_si_are_those_of_udunits() -> None:
    base = {
        "bar": "Pa", "rpm": "rad s-1", "degree": "rad", "bar s m-1": "Pa s m-1",
        "bar s2 m-2": "Pa s2 m-2", "MPa": "Pa", "GPa": "Pa", "cm3": "m3", "min-1": "s-1",
        "MPa degree-1": "Pa rad-1", "rpm s-1": "rad s-2", "N m degree-1": "N m rad-1",
    }  # fmt: skip
    for node in (*PARAMETERS.values(), *ALL_QUANTITIES.values()):
        if node.unit in base:
            exact = cf_units.Unit(node.unit).convert(1.0, cf_units.Unit(base[node.unit]))
            assert node.si == pytest.approx(exact, rel=1e-12), node.name
        else:
            assert node.si == 1.0, f"{node.name}: base has no {node.unit}"


def test_what_people_see_is_described() -> None:
    for node in (*PARAMETERS.values(), *ALL_QUANTITIES.values()):
        assert node.long_name and node.source, node.name
        if node.name not in ("status", "load_factor"):
            assert node.symbol, node.name


@pytest.mark.parametrize("closure", ["power_mean", "cycle_time"])
def test_every_quantity_is_computed(closure: str) -> None:
    more: dict[str, Any] = {
        "axes": {"speed": [1000, 1400]}, "solver": {"closure": closure},
        "output": {"angle_step": 10.0},
    }  # fmt: skip
    plain = [name for name in ALL_QUANTITIES if name not in APART]
    result = computed(plain, **NOT_OF_AN_ENGINE, **more)
    passed = computed(list(IN_PASSING), **{**NOT_OF_AN_ENGINE, "shaft": passing_shaft(1)}, **more)
    followed = computed(OF_TRANSIENTS, axes=more["axes"], **GENERATING_SET)
    result = {**result, **passed, **followed}
    for name in ALL_QUANTITIES:
        finite = np.isfinite(result[name])
        # Not each shaft has a node, or a diameter for a stress; crossings are few. Above the order
        # of a pendulum there is a critical speed less; what is overdamped does not swing.
        some = not {"shaft", "crossing"}.isdisjoint(finite.dims)
        # A run has fewer cycles than it might have.
        some |= (
            "run_cycle" in finite.dims
            or "critical_speed" in name
            or name.startswith(("damped", "damping"))
        )
        assert finite.any() if some else finite.all(), name
    used = {need for variants in NODES.values() for node in variants for need in node.needs}
    used |= {*DIMENSIONS}  # points of what quantities add
    used |= set(CYCLE_KEYS)  # the planner makes the family and which cycle of it from them
    used |= {"misfire", *NUMBERED}  # and the sets of cylinders
    used |= {"friction_law"}  # and a word
    assert {name for name in NODES if name not in used and name not in ALL_QUANTITIES} == set()


@pytest.mark.parametrize("exponent", [0.0, 0.5, 1.0, 1.5, 2.0, 3.0])
def test_powers_have_the_same_bits_in_every_shape(exponent: float) -> None:
    base = np.random.default_rng(3).uniform(50.0, 300.0, 5000)
    expected = power(base, np.full(base.size, exponent))
    mixed = np.resize([exponent, 0.7], base.size)
    for found in (
        power(base, exponent), power(base, np.array(exponent)), power(base, np.array([exponent])),
        power(base[:, None], np.full((base.size, 1), exponent))[:, 0],
        np.concatenate([power(base[i : i + 7], exponent) for i in range(0, base.size, 7)]),
    ):  # fmt: skip
        assert np.array_equal(found, expected)
    assert np.array_equal(power(base, mixed)[::2], expected[::2])


@pytest.mark.parametrize(
    ("needs", "make", "words"),
    [
        (("sped",), lambda sped: sped, "node 'mine' needs 'sped', .*; did you mean 'speed'?"),
        (("speed",), lambda speed, load: speed, r"make takes \['load'\], not among its needs"),
        (("speed", "load"), lambda speed: speed, r"make does not take \['load'\]"),
    ],
)
def test_needs_that_do_not_fit_are_named(needs, make, words) -> None:
    mine = Node("mine", "", "1", "what I want", needs=needs, make=make)
    with pytest.raises(ValueError, match=words):
        check_needs({**NODES, "mine": (mine,)})
    fitting = Node(
        "mine", "", "1", "what I want", needs=("load",), make=lambda load, half=0.5: half
    )
    check_needs({**NODES, "mine": (fitting,)})


def test_needs_that_are_left_out_are_the_arguments() -> None:
    def make(load: float, *, speed: float, threads: int, half: float = 0.5) -> float:
        return load * speed * threads * half

    assert Node("mine", "", "1", "what I want", make=make).needs == ("load", "speed")
