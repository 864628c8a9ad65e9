"""Facts that have one owner, and the compiled places that have to agree with it."""

from __future__ import annotations

import inspect

import numpy as np
import pytest

from engine_dyn import periodic_speed
from engine_dyn.loads import laws
from engine_dyn.quantities.graph import PARAMETERS, QUANTITIES
from engine_dyn.quantities.variants import ALTERNATIVES
from engine_dyn.speed import dispatch, fields, methods, results
from engine_dyn.speed.batch import state, storage


def test_every_method_has_a_solver() -> None:
    assert set(dispatch.SOLVERS) == set(methods.METHOD_NAMES)


def test_codes_of_methods_are_their_places() -> None:
    codes = (
        methods.AUTO, methods.THESIS, methods.PICARD, methods.NEWTON, methods.CLOSED,
    )  # fmt: skip
    assert codes == tuple(range(len(methods.METHODS)))
    assert methods.STEPPING == ("thesis", "picard")


def test_rows_of_the_state_are_the_inputs_of_kernels() -> None:
    """The batch solver copies inputs BORE to LOAD_SQUARE into its first rows by their places."""
    rows = (
        state.BORE, state.DOUBLE_RADIUS, state.MASS, state.SPEED, state.INERTIA, state.EXPONENT,
        state.OFFSET, state.MEAN_TORQUE, state.SYNCHRONOUS_SPEED, state.BREAKDOWN_SLIP,
        state.LOAD_LINEAR, state.LOAD_SQUARE,
    )  # fmt: skip
    inputs = (
        fields.BORE, fields.DOUBLE_RADIUS, fields.MASS, fields.SPEED, fields.INERTIA,
        fields.EXPONENT, fields.OFFSET, fields.MEAN_TORQUE,
        *(fields.INPUT_NAMES.index(name) for name in (
            "synchronous_speed", "breakdown_slip", "load_linear", "load_square",
        )),
    )  # fmt: skip
    assert [row // state.LANES for row in rows] == [place - fields.BORE for place in inputs]
    assert len(rows) == fields.LOAD_SQUARE + 1 - fields.BORE


def test_places_of_rows_are_those_of_their_names() -> None:
    names = [row.name for row in state.ROWS]
    assert len(set(names)) == len(names)
    for place, name in enumerate(names):
        assert getattr(state, name) == place * state.LANES
    assert len(names) * state.LANES == state.STATE_SIZE


def test_places_of_inputs_are_those_of_their_names() -> None:
    own = tuple(law_input.name for law_input in laws.INPUTS)
    last = fields.FIRST_OF_LAWS + len(own)
    for name in fields.INPUT_NAMES[: fields.FIRST_OF_LAWS] + fields.INPUT_NAMES[last:]:
        assert fields.INPUT_NAMES[getattr(fields, name.upper())] == name
    assert fields.INPUT_NAMES[fields.FIRST_OF_LAWS : last] == own
    assert fields.INPUT_NAMES[fields.LOAD_SQUARE] == "load_square"
    assert fields.INPUT_NAMES[fields.GEAR_RATIO] == "gear_ratio"
    assert fields.INPUT_NAMES[: fields.TABLE_INPUTS] == fields.TABLE_NAMES
    assert set(fields.FRICTION_NAMES) <= set(fields.TABLE_NAMES)


def test_places_of_results_are_those_of_their_names() -> None:
    for name in results.SCALAR_NAMES:
        assert results.SCALAR_NAMES[getattr(results, name.upper())] == name
    assert storage.SCALAR_ROWS == results.SCALARS * state.LANES


def test_results_are_quantities() -> None:
    for result in (*results.RESULTS, *results.CURVES, *results.TORQUE_RESULTS):
        if result.name in QUANTITIES:
            node = QUANTITIES[result.name]
            assert (node.unit, node.long_name) == (result.unit, result.long_name)


def test_laws_are_words_of_scenes() -> None:
    names = {law.name for law in laws.LAWS}
    assert any(set(group) == names for group in ALTERNATIVES)
    assert all(key in PARAMETERS for law in laws.LAWS for key in law.keys)


TABLE = np.array([[50.0, 99.0], [1.0, 4.0], [0.1, 0.1]])  # speeds, torques, slopes
FORMS = (laws.PowerForm(0), laws.CurveForm(1.0, False, TABLE))


@pytest.mark.parametrize("form", FORMS, ids=lambda form: type(form).__name__)
def test_every_law_is_one_at_the_nominal_speed(form: laws.Form) -> None:
    values = np.array([law_input.default for law_input in laws.INPUTS])
    law, sign = laws.make_law(80.0, 1.6, values, np.arange(values.size), form)
    value, slope, _ = laws.load_terms(1.0, law)
    assert sign > 0.0
    assert value == pytest.approx(1.0, abs=1e-15)
    step = 1e-6
    higher, lower = laws.load_terms(1.0 + step, law)[0], laws.load_terms(1.0 - step, law)[0]
    assert slope == pytest.approx((higher - lower) / (2.0 * step), rel=1e-8)


def test_keywords_of_periodic_speed_have_the_defaults_of_the_inputs() -> None:
    keywords = inspect.signature(periodic_speed).parameters
    for name in ("gear_ratio", "load_phase", "load_scale", "start_angle"):
        assert keywords[name].default == fields.DEFAULTS[name]
