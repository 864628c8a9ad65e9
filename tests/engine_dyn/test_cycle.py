"""The modelled diesel cycle, and the diagrams of the NTUA engine made with it."""

import tomllib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad, solve_ivp

from engine_dyn.geometry.slider_crank import velocity
from engine_dyn.pressure.diagram import diagram_from_points
from engine_dyn.pressure.diesel_cycle import FILE_UNITS, DieselCycle
from oracle import solution
from tests.support.cycles import smooth_step
from tests.support.tools import ROOT, tool

calibrate_ntua = tool("calibrate_ntua")

DEGREE = np.pi / 180.0
BAR = 1e5
ENGINES = ROOT / "sweeps" / "catalogue" / "engines"

USUAL = {
    "compression_ratio": 17.0, "crank_ratio": 0.25, "intake_pressure": 1.1, "exhaust_pressure": 1.2,
    "intake_loss": 0.1, "exhaust_loss": 0.05, "compression_exponent": 1.36,
    "expansion_exponent": 1.30, "heat": 14.0, "premixed_share": 0.15, "premixed_start": -6.0,
    "premixed_duration": 12.0, "premixed_form": 2.0, "diffusion_start": -4.0,
    "diffusion_duration": 70.0, "diffusion_form": 1.2, "intake_closing": -140.0,
    "exhaust_opening": 130.0, "valve_ramp": 40.0, "valve_lag": 8.0,
}  # fmt: skip


def cycle(**changes):
    """A cycle from values in file units."""
    values = {**USUAL, **changes}
    return DieselCycle(**{name: value * FILE_UNITS[name][1] for name, value in values.items()})


def equation(model):
    """p' of the model, written from its description without its code."""

    def volume(phi):
        rod, beside = 1.0 / model.crank_ratio, model.offset_ratio
        stroke = np.sqrt((rod + 1.0) ** 2 - beside**2) - np.sqrt((rod - 1.0) ** 2 - beside**2)
        travel = solution.position(phi, model.crank_ratio, beside)
        return 1.0 / (model.compression_ratio - 1.0) + travel / stroke

    def burnt(phi):
        total = 0.0
        for share, start, duration, form in (
            (model.premixed_share, model.premixed_start, model.premixed_duration,
             model.premixed_form),
            (1.0 - model.premixed_share, model.diffusion_start, model.diffusion_duration,
             model.diffusion_form),
        ):  # fmt: skip
            t = max(phi - start, 0.0) / duration
            total += share * (1.0 - 0.001 ** (t ** (form + 1.0)))
        return total

    def slope(function, phi, h=1e-6):
        return (function(phi + h) - function(phi - h)) / (2.0 * h)

    def right(phi, pressure):
        shut = smooth_step((phi - model.intake_closing) / model.valve_ramp + 1.0) * (
            1.0 - smooth_step((phi - model.exhaust_opening) / model.valve_ramp)
        )
        speed = 2.0 * slope(volume, phi)
        change = smooth_step((phi - 2.0 * np.pi + model.valve_ramp) / (2.0 * model.valve_ramp))
        share = 1.0 if phi < 0.0 else change
        manifold = (1.0 - share) * (model.exhaust_pressure + model.exhaust_loss * speed**2)
        manifold += share * (model.intake_pressure - model.intake_loss * speed**2)
        n = model.compression_exponent
        n += (model.expansion_exponent - n) * burnt(phi)
        gas = -n * pressure * slope(volume, phi) / volume(phi)
        gas += (n - 1.0) * model.heat * slope(burnt, phi) / volume(phi)
        return shut * gas - (1.0 - shut) * (pressure - manifold) / model.valve_lag

    return right


@pytest.mark.parametrize("offset", [0.0, 0.5])
def test_against_a_general_integrator(offset):
    model = cycle(offset_ratio=offset)
    angle, pressure = model.points(1.0)
    first = 90  # -270 degrees, in the intake stroke
    phi = np.concatenate([angle[first:], angle[:first] + 4.0 * np.pi, [angle[first] + 4.0 * np.pi]])
    found = solve_ivp(
        equation(model), (phi[0], phi[-1]), [pressure[first]],
        method="DOP853", rtol=1e-10, atol=1e-2, max_step=0.5 * DEGREE, t_eval=phi,
    )  # fmt: skip
    np.testing.assert_allclose(found.y[0][:-1], np.roll(pressure, -first), rtol=1e-7)
    # Periodic: the end is the start.
    assert found.y[0][-1] == pytest.approx(pressure[first], rel=1e-8)


def test_energy_balance_of_the_closed_cycle():
    """With one exponent the first law integrates: change of U = p V/(n - 1) is Q - W."""
    n = 1.33
    model = cycle(compression_exponent=n, expansion_exponent=n)
    curve = diagram_from_points(*model.points(0.1))
    start, end = -139.0 * DEGREE, 129.0 * DEGREE

    def rate(phi):
        return float(curve(phi)) * 0.5 * float(velocity(phi, model.crank_ratio))

    work = quad(rate, start, end, limit=400, epsrel=1e-10, points=[-0.2, 0.0, 0.2])[0]
    inner = [float(curve(phi)) * float(model.volume(phi)) / (n - 1.0) for phi in (start, end)]
    heat = model.heat * float(model.burnt_fraction(end) - model.burnt_fraction(start))
    assert inner[1] - inner[0] + work == pytest.approx(heat, rel=1e-7)
    assert heat == pytest.approx(14.0 * BAR, rel=1e-6)


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("premixed_duration", -5.0, "premixed_duration = -5 degree: must be above 1 and below 180"),
        ("compression_ratio", 1.0, "compression_ratio = 1: must be above 1.5 and below 40"),
        ("intake_loss", 0.7, "intake_loss = 0.7 bar: must be between 0 and 0.55 bar"),
        ("premixed_start", -60.0, "before the combustion starts"),
        ("exhaust_opening", 200.0, "exhaust_opening = 200 degree"),
        ("heat", np.nan, "heat = nan: must be a finite number"),
    ],
)
def test_bad_parameters(name, value, words):
    with pytest.raises(ValueError) as caught:
        cycle(**{"intake_closing": -50.0, name: value})
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


@given(
    st.floats(10.0, 22.0),
    st.floats(1.25, 1.4),
    st.floats(0.0, 30.0),
    st.floats(-15.0, 10.0),
    st.floats(20.0, 120.0),
    st.floats(0.6, 3.0),
)
@settings(deadline=None, max_examples=30)
def test_any_usual_cycle_makes_a_diagram(ratio, exponent, heat, start, duration, boost):
    model = cycle(
        compression_ratio=ratio, compression_exponent=exponent, heat=heat, premixed_start=start,
        diffusion_start=start, diffusion_duration=duration, intake_pressure=boost,
        exhaust_pressure=boost,
    )  # fmt: skip
    curve = diagram_from_points(*model.points(0.5))
    assert curve.lowest > 0.0
    assert curve.peak > boost * BAR


# The diagrams of the NTUA engine (tools/calibrate_ntua.py). tests/test_documents.py compares what
# follows from them with what Kakaitsas (2015) printed.


@pytest.fixture(scope="module")
def tables():
    with (ENGINES / "ntua.toml").open("rb") as file:
        return tomllib.load(file)["diagram"]


@pytest.mark.compiled
@pytest.mark.parametrize("load", [0, 50, 90])
def test_ntua_file_is_what_its_script_finds(tables, load):
    """The figures are met, and no change that keeps them comes closer to the usual values."""
    found = {t["load"]: {n: t[n] for n in FILE_UNITS if n in t} for t in tables}
    usual, fixed = calibrate_ntua.varied_and_fixed(load, found[50])
    measure = calibrate_ntua.MEASURES[load]
    place = np.array(
        [(found[load][name] - mean) / spread for name, (mean, spread) in usual.items()]
    )
    figures = measure(calibrate_ntua.diagram_of(found[load]))
    np.testing.assert_allclose(figures, calibrate_ntua.targets()[load], rtol=1e-5, atol=1e-5)
    jacobian = calibrate_ntua.central_differences(
        lambda at: measure(calibrate_ntua.diagram_of(calibrate_ntua.together(usual, fixed, at))),
        place,
    )
    kept = place - np.linalg.pinv(jacobian) @ (jacobian @ place)
    assert np.abs(kept).max() < 1e-3
