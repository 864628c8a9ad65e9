"""Indicator diagrams: spline, checks of points, families over load."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline

from engine_dyn.geometry.arrangement import FOUR_STROKE, TWO_STROKE
from engine_dyn.periodic_spline import periodic_spline_slopes
from engine_dyn.pressure.diagram import Diagram, diagram_from_points
from engine_dyn.pressure.family import ROW_STEP, family_from_diagrams

DEGREE = np.pi / 180.0
BAR = 1e5


def hump(phi, peak=60.0, at=8.0, sharpness=60.0, base=1.05, period=FOUR_STROKE):
    """A smooth periodic pressure [Pa] with one peak [bar] at an angle [degree]."""
    u = (phi - at * DEGREE) * (2.0 * np.pi / period)
    return BAR * (base + (peak - base) * np.exp(sharpness * (np.cos(u) - 1.0)))


def uniform(step, period=FOUR_STROKE):
    count = round(period / DEGREE / step)
    return (np.arange(count) - count // 2) * step * DEGREE


def diagram(step=1.0, **shape):
    phi = uniform(step)
    return diagram_from_points(phi, hump(phi, **shape))


@given(st.integers(3, 60), st.integers(0, 2**32 - 1), st.sampled_from([FOUR_STROKE, TWO_STROKE]))
@settings(deadline=None, max_examples=60)
def test_spline_is_the_periodic_cubic_spline_of_scipy(count, seed, period):
    random = np.random.default_rng(seed)
    # Steps within a factor of 100 of each other.
    step = random.uniform(0.01, 1.0, count)
    step *= period / step.sum()
    angle = -period / 2.0 + np.concatenate(([0.0], np.cumsum(step)[:-1]))
    pressure = random.normal(size=count)
    reference = CubicSpline(
        np.append(angle, angle[0] + period), np.append(pressure, pressure[0]), bc_type="periodic"
    )
    slope = periodic_spline_slopes(angle, pressure, period)
    np.testing.assert_allclose(slope, reference(angle, 1), atol=1e-9 * np.abs(slope).max())
    ours = Diagram(angle, pressure, slope, period)
    phi = random.uniform(-3.0 * period, 3.0 * period, 200)
    np.testing.assert_allclose(ours(phi), reference(phi), atol=1e-9 * np.abs(ours(phi)).max())
    np.testing.assert_allclose(
        ours.derivative(phi), reference(phi, 1), atol=1e-9 * np.abs(slope).max()
    )


def test_peak_is_the_largest_point_and_its_angle_that_of_the_curve():
    curve = diagram(1.0, at=8.37)
    assert curve.peak == curve.pressure.max()
    assert curve.peak <= curve(curve.peak_angle)
    assert curve.peak_angle == pytest.approx(8.37 * DEGREE, abs=1e-3 * DEGREE)
    assert curve.derivative(curve.peak_angle) == pytest.approx(
        0.0, abs=1e-9 * np.abs(curve.slope).max()
    )


def changed(index, angle=None, pressure=None):
    phi = uniform(1.0)
    p = hump(phi)
    if angle is not None:
        phi[index] = angle
    if pressure is not None:
        p[index] = pressure
    return phi, p


def rolled(degrees):
    phi = uniform(1.0)
    return phi, np.roll(hump(phi), round(degrees))


def where(keep):
    """Points at the angles [degree] that are kept."""
    phi = uniform(1.0)
    phi = phi[keep(phi / DEGREE)]
    return phi, hump(phi)


def uneven_ends():
    phi = np.linspace(-2 * np.pi, 2 * np.pi, 721)
    return phi, hump(phi) + np.where(phi == phi[-1], 2.0 * BAR, 0.0)


def steep():
    """A step near the lowest pressure that makes a spline swing through zero."""
    phi = uniform(10.0)
    p = hump(phi, sharpness=200.0, base=0.05)
    p[np.abs(phi + 200 * DEGREE) < 1e-9] = 5.0 * BAR
    return phi, p


@pytest.mark.parametrize(
    ("points", "words"),
    [
        (([0.0, 1.0], [1e5]), ["same length"]),
        (([[0.0, 1.0]], [[1e5, 1e5]]), ["same length"]),
        ((uniform(60.0), hump(uniform(60.0))), ["12 points", "at least 16"]),
        (changed(5, pressure=np.nan), ["point 6", "-355 degrees", "nan bar", "finite"]),
        (changed(5, angle=np.inf), ["point 6", "inf degrees", "finite"]),
        (changed(719, angle=370 * DEGREE), ["point 720", "370 degrees", "-360..360"]),
        (changed(0, angle=-361 * DEGREE), ["point 1", "-361 degrees", "-360..360"]),
        (changed(10, angle=-352 * DEGREE), ["point 11", "-352 degrees after -351", "ascending"]),
        (changed(10, angle=-351 * DEGREE), ["point 11", "-351 degrees after -351", "ascending"]),
        (changed(100, pressure=0.0), ["point 101", "0 bar at -260 degrees", "positive"]),
        (changed(100, pressure=-0.1 * BAR), ["-0.1 bar", "positive", "gauge"]),
        ((uniform(1.0), 100.0 * hump(uniform(1.0))), ["500 bar", "kilopascal"]),
        ((uniform(1.0), 14.5 * hump(uniform(1.0))), ["500 bar", "psi"]),
        ((uniform(1.0), 1e5 * hump(uniform(1.0))), ["500 bar", "pascal"]),
        ((uniform(1.0), 0.1 * hump(uniform(1.0))), ["megapascal"]),
        ((uniform(1.0), 1e-5 * hump(uniform(1.0))), ["largest pressure is 0.0006", "in pascal"]),
        ((uniform(1.0), hump(uniform(1.0), peak=600.0)), ["600 bar at 8 degrees", "500 bar"]),
        (rolled(360), ["peak", "at -352 degrees", "-30..60", "shifted by 360 degrees"]),
        (rolled(180), ["peak", "at 188 degrees", "shifted by 180 degrees"]),
        (rolled(90), ["peak", "at 98 degrees", "firing top dead centre"]),
        (
            where(lambda a: (a < -299.5) | (a > -230.5)),
            ["-300 and -230 degrees", "gap of 70", "allowed are 60"],
        ),
        (
            where(lambda a: (a < 20.5) | (a > 39.5)),
            ["20 and 40 degrees", "gap of 20", "15 within 60"],
        ),
        (uneven_ends(), ["-360 degrees", "360", "differ by 2 bar", "2 % of the peak, 1.2 bar"]),
        (
            changed(slice(231, 250), pressure=40.0 * BAR),
            ["-120 degrees", "-20", "rise through the compression"],
        ),
        (steep(), ["between them", "bar"]),
        (where(lambda a: np.abs(a) < 324.5), ["between 324 and -324 degrees: a gap of 72"]),
        ((uniform(1.0), hump(uniform(1.0)), 3.0), ["720 or 360"]),
    ],
)
def test_bad_points(points, words):
    with pytest.raises(ValueError) as caught:
        diagram_from_points(*points)
    message = str(caught.value)
    assert "\n" not in message
    for word in words:
        assert word in message, message


def family(loads=(0.0, 50.0, 90.0)):
    shapes = [
        {"peak": 50.0, "at": 3.0, "sharpness": 80.0},
        {"peak": 65.0, "at": 8.0, "sharpness": 60.0},
        {"peak": 80.0, "at": 12.0, "sharpness": 45.0},
    ]
    return family_from_diagrams(loads, [diagram(1.0, **shape) for shape in shapes[: len(loads)]])


def test_given_loads_are_rows_and_give_the_given_diagrams():
    rows = family()
    assert rows.low == 0.0
    assert rows.high == 90.0
    assert rows.row_count == 181
    for load, given_one in zip(rows.loads, rows.diagrams, strict=True):
        row, weight = rows.locate(load)
        assert weight == 0.0
        assert rows.row(int(row)) is given_one
        assert rows.at(load) is given_one
        assert rows.row_loads[row] == load
    assert np.diff(rows.row_loads).max() <= ROW_STEP + 1e-12


def test_other_knots_are_resampled():
    one, two = diagram(1.0, at=3.0), diagram(2.0, at=8.0, peak=70.0)
    rows = family_from_diagrams([0.0, 10.0], [one, two])
    phi = np.linspace(-6.0, 6.0, 333)
    np.testing.assert_array_equal(rows.row(0).angle, rows.row(20).angle)
    np.testing.assert_allclose(rows.at(0.0)(phi), one(phi), rtol=1e-5)
    np.testing.assert_allclose(rows.at(10.0)(phi), two(phi), rtol=1e-4)


@pytest.mark.parametrize("load", [-0.1, 90.1, np.nan])
def test_load_outside_the_family(load):
    with pytest.raises(ValueError, match=r"load .* percent is not allowed.*0\.\.90 percent"):
        family().locate([10.0, load])


@pytest.mark.parametrize(
    ("loads", "count", "words"),
    [
        ([], 0, "0 loads for 0 diagrams"), ([1.0], 2, "1 loads for 2 diagrams"),
        ([10.0, 10.0], 2, "ascend strictly"), ([10.0, 5.0], 2, "ascend strictly"),
        ([-1.0, 5.0], 2, "0 or more"), ([0.0, np.nan], 2, "ascend"),
    ],
)  # fmt: skip
def test_bad_family(loads, count, words):
    with pytest.raises(ValueError, match=words):
        family_from_diagrams(loads, [diagram(1.0)] * count)


@given(
    st.floats(-10.0, 30.0),
    st.floats(-10.0, 30.0),
    st.floats(30.0, 120.0),
    st.floats(1.0, 2.0),
    st.floats(0.0, 100.0),
)
@settings(deadline=None, max_examples=40)
def test_between_two_loads_peak_and_phase_lie_between(at_one, at_two, peak, growth, load):
    one = diagram(1.0, at=at_one, peak=peak)
    two = diagram(1.0, at=at_two, peak=growth * peak)
    middle = family_from_diagrams([0.0, 100.0], [one, two]).at(load)
    slack = 2e-3  # points at 1 degree miss the summit by up to this
    assert one.peak * (1 - slack) <= middle.peak <= two.peak * (1 + slack)
    low, high = sorted((one.peak_angle, two.peak_angle))
    assert low - 0.05 * DEGREE <= middle.peak_angle <= high + 0.05 * DEGREE
    assert middle.lowest > 0.0
