"""Facts that have one owner, and the compiled places that have to agree with it."""

import inspect
import re
from pathlib import Path

import numpy as np
import pytest

import engine_dyn
from engine_dyn import periodic_speed
from engine_dyn.compilation import imported
from engine_dyn.loads import laws
from engine_dyn.parameters import PARAMETERS as SAID
from engine_dyn.quantities.graph import ALTERNATIVES, NODES, PARAMETERS, QUANTITIES
from engine_dyn.speed import fields
from engine_dyn.speed.designs import store
from engine_dyn.units import BAR
from sweeps.base.dimensions import OUTCOMES


def test_codes_of_methods_are_their_places() -> None:
    codes = fields.AUTO, fields.THESIS, fields.NEWTON, fields.CLOSED
    assert codes == tuple(range(len(fields.METHODS)))
    assert fields.STEPPING == ("thesis",)


def test_inputs_of_laws_are_inputs_of_solvers() -> None:
    names = {field.name for field in fields.FIELDS}
    assert {law_input.name for law_input in laws.INPUTS} < names
    for law in laws.LAWS:
        assert set(law.numbers) <= names and len(law.numbers) <= 2
    assert len(names) == len(fields.FIELDS)
    assert set(fields.FRICTION_NAMES) <= set(fields.TABLE_QUANTITIES)


def test_places_of_results_are_those_of_their_names() -> None:
    numbers = {
        "delta": 0.4, "delta_midrange": 0.5, "omega_max": 5.0, "omega_min": 3.0, "omega_mean": 5.0,
        "load_factor": 0.25, "delta_error": 0.01, "iterations": 7.0,
    }  # fmt: skip
    found = np.empty((len(numbers), 1))
    store(0, 5.0, 3.0, 5.0, 2.0, 4.0, 0.01, 7.0, np.arange(len(numbers)), found)
    assert dict(zip(fields.SCALAR_NAMES, found[:, 0].tolist(), strict=True)) == numbers


def test_results_are_quantities() -> None:
    for result in (*fields.RESULTS, *fields.CURVES, *fields.TORQUE_RESULTS):
        if result.name in QUANTITIES:
            node = QUANTITIES[result.name]
            assert (node.unit, node.long_name) == (result.unit, result.long_name)


def test_laws_are_words_of_scenes() -> None:
    names = {law.name for law in laws.LAWS}
    assert any(set(group) == names for group in ALTERNATIVES)
    assert all(key in PARAMETERS for law in laws.LAWS for key in law.keys)


TABLE = np.array([[50.0, 99.0], [1.0, 4.0], [0.1, 0.1]])  # speeds, torques, slopes
NUMBERS = {"power_law": (1.6, 0.0), "linear_square": (3.0, 0.02), "motor": (90.0, 0.3)}


@pytest.mark.parametrize("kind", range(len(laws.LAWS)), ids=lambda kind: laws.LAWS[kind].name)
def test_every_law_is_one_at_the_nominal_speed(kind: int) -> None:
    facts = laws.LAWS[kind]
    table = TABLE if facts.torque is None else np.zeros((3, 0))
    form = laws.Form(kind, 1.0, False, table)
    numbers = NUMBERS.get(facts.name, (0.0, 0.0))
    law, sign = laws.law_of(80.0, *numbers, 1.0, form)
    value, slope = laws.load_terms(1.0, law)
    assert sign > 0.0
    assert value == pytest.approx(1.0, abs=1e-15)
    step = 1e-6
    higher, lower = laws.load_terms(1.0 + step, law)[0], laws.load_terms(1.0 - step, law)[0]
    assert slope == pytest.approx((higher - lower) / (2.0 * step), rel=1e-8)
    if facts.torque is not None:
        given = (np.array([value]) for value in (80.0, *numbers))
        assert laws.slope_and_sign(*given, form)[0] == pytest.approx(slope, rel=1e-13)


def test_a_law_is_flat_where_it_is_flat_at_every_speed() -> None:
    none = np.zeros((3, 0))
    flat_table = np.array([[50.0, 99.0], [3.0, 3.0], [0.0, 0.0]])
    # The motor has its breakdown torque at the nominal speed 80 rad/s: flat there alone.
    cases = (
        ("power_law", (0.0, 0.0), none, True), ("power_law", (1e-9, 0.0), none, False),
        ("motor", (100.0, 0.2), none, False), ("table", (0.0, 0.0), flat_table, False),
    )  # fmt: skip
    names = [facts.name for facts in laws.LAWS]
    for name, numbers, table, flat in cases:
        form = laws.Form(names.index(name), 1.0, False, table)
        law, _ = laws.law_of(80.0, *numbers, 1.0, form)
        assert laws.slope_of(law)[1] == flat, (name, numbers)


def test_keywords_of_periodic_speed_have_the_defaults_of_the_inputs() -> None:
    keywords = inspect.signature(periodic_speed).parameters
    for name in ("gear_ratio", "load_phase", "load_scale", "start_angle"):
        assert keywords[name].default == fields.DEFAULTS[name]
    assert keywords["crankcase_pressure"].default == SAID["crankcase_pressure"].typical * BAR
    assert keywords["load_offset"].default == SAID["load_offset"].typical
    assert f"alpha ({SAID['load_exponent'].typical:g} unless given)" in (
        periodic_speed.__doc__ or ""
    )


def test_inputs_of_solvers_are_nodes_with_their_defaults() -> None:
    for field in fields.FIELDS:
        assert field.quantity in NODES, field.name
        one = SAID.get(field.quantity)
        if one is not None and one.unless_given is not None:
            assert field.default == one.unless_given * one.si, field.name


def test_a_new_parameter_compiles_no_kernel_again() -> None:
    root = Path(engine_dyn.__file__).parent
    compiled = [
        text
        for path in root.rglob("*.py")
        if re.search(r"^@(kernel|inlined|formula)", text := path.read_text(encoding="utf-8"), re.M)
    ]
    assert len(compiled) > 20
    assert not any("engine_dyn.parameters" in imported(text) for text in compiled)


def test_outcomes_are_what_stages_that_can_fail_tell() -> None:
    told = {node.outcome for variants in NODES.values() for node in variants if node.outcome}
    assert told == {*OUTCOMES} and told <= {*QUANTITIES}
