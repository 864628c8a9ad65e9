"""Figures from synthetic archives: right names and attributes, simple formulas."""

import json

import matplotlib
import numpy as np
import pytest
import xarray as xr
from matplotlib.collections import PolyCollection, QuadMesh
from numpy.testing import assert_allclose, assert_array_equal

from engine_dyn import status
from engine_dyn.geometry.cylinders import cylinders_of
from engine_dyn.geometry.layouts import arrangement_from_text
from sweeps.base.errors import SceneError
from sweeps.running.archive import labels as dataset
from sweeps.view.figures import arrangement, draw
from sweeps.view.figures.angle_lines import draw_curves
from sweeps.view.figures.cycle_curves import curve_figure
from sweeps.view.figures.maps import cell_edges
from sweeps.view.figures.scales import crank_axis
from sweeps.view.figures.sheet import new_sheet
from sweeps.view.figures.study import study_of
from sweeps.view.figures.wording import axis_label, typeset, unit_text, value_text, wrap
from tests.support.figures import assert_inside, plain, plates, style, texts, variable, words
from tests.support.tiers import all_but

ATTRIBUTES = {
    "reciprocating_mass": ("reciprocating mass per cylinder", "m", "kg"),
    "inertia": ("moment of inertia of the whole engine with its load", r"\Theta", "kg m2"),
    "crank_ratio": ("crank ratio, crank radius over rod length", r"\lambda", "1"),
    "speed": ("nominal crank speed", "n", "rpm"),
    "load": ("engine load", "L", "percent"),
    "load_exponent": ("exponent of the speed in the load torque", r"\alpha", "1"),
    "cylinders": ("number of cylinders", "Z", "1"),
    "start_angle": ("crank angle at the start", r"\varphi_1", "degree"),
    "crank_angle": ("crank angle, 0 at firing top dead centre", r"\varphi", "degree"),
    "delta": ("coefficient of speed fluctuation", r"\delta", "1"),
    "omega": ("crank speed over the cycle", r"\omega", "rad s-1"),
    "omega_max": ("largest crank speed", r"\omega_{max}", "rad s-1"),
    "omega_mean": ("mean crank speed over crank angle", r"\omega_m", "rad s-1"),
    "omega_min": ("smallest crank speed", r"\omega_{min}", "rad s-1"),
    "torque_range": ("range of the torque at nominal speed", "M_{max}-M_{min}", "N m"),
    "position": ("piston travel from top dead centre over crank radius", "x/r", "1"),
    "velocity": ("reduced piston velocity", r"c/(r\omega)", "1"),
    "acceleration": ("reduced piston acceleration", r"b/(r\omega^2)", "1"),
    "pressure": ("absolute pressure in cylinder 1", "p", "bar"),
    "gas_torque": ("gas torque, all cylinders", "M_g", "N m"),
    "inertia_torque": ("torque of the reciprocating masses", "M_l", "N m"),
    "friction_torque": ("mean friction torque, positive, subtracted", "M_{fr}", "N m"),
    "torque": ("engine torque at nominal speed", "M", "N m"),
    "load_torque": ("load torque at the solved speed", "M_L", "N m"),
}
STATUS = {
    "long_name": "outcome of the design", "units": "1",
    "flag_values": np.arange(7, dtype=np.int8), "flag_meanings": " ".join(status.OF_SPEED),
}  # fmt: skip
NOMINAL = {
    "reciprocating_mass": 6.67, "inertia": 2.0, "crank_ratio": 0.25, "speed": 1200.0,
    "load": 50.0, "load_exponent": 2.0, "cylinders": 1.0,
}  # fmt: skip


def attributes(name: str) -> dict[str, str]:
    long_name, symbol, units = ATTRIBUTES[name]
    return {"long_name": long_name, "symbol": f"${symbol}$", "units": units}


def angles(step: float = 10.0) -> np.ndarray:
    return np.arange(-360.0, 360.0, step)


def thesis_like() -> xr.Dataset:
    """A list of designs as in Kakaitsas's tables, nominal first."""
    changes = [
        {}, {"reciprocating_mass": 2.5}, {"inertia": 12.0}, {"inertia": 0.5}, {"inertia": 5.0},
        {"crank_ratio": 1 / 3, "reciprocating_mass": 6.95}, {"speed": 1000.0}, {"speed": 4000.0},
        {"load": 0.0}, {"load": 90.0}, {"load_exponent": 0.0}, {"cylinders": 2.0},
        {"cylinders": 8.0}, {"cylinders": 8.0, "inertia": 5.0}, {"cylinders": 8.0, "inertia": 12.0},
    ]  # fmt: skip
    rows = [NOMINAL | change for change in changes]
    data = xr.Dataset(coords={"crank_angle": ("crank_angle", angles(), attributes("crank_angle"))})
    column = {name: np.array([row[name] for row in rows]) for name in NOMINAL}
    for name, values in column.items():
        data.coords[name] = ("design", values, attributes(name))
    start = np.where(column["cylinders"] == 1, -180.0, 0.0)
    data.coords["start_angle"] = ("design", start, attributes("start_angle"))
    cases = [" ".join(f"{k} {v:g}" for k, v in c.items()) or "nominal" for c in changes]
    data.coords["case"] = ("design", np.array(cases, dtype=object), {"long_name": "name"})

    phi = np.radians(angles())
    c = {name: values[:, None] for name, values in column.items()}
    ratio = c["crank_ratio"]
    omega_n = c["speed"] * np.pi / 30
    gas = (20 * c["load"] + 1500) * np.sin(phi * c["cylinders"]) * np.exp(-((phi - 0.4) ** 2))
    inertia = -c["reciprocating_mass"] * 0.004 * omega_n**2 * np.sin(2 * phi)
    friction = 30 * column["cylinders"] + 0.04 * column["load"]
    swing = 1500 / (c["inertia"] * omega_n**2 * c["cylinders"]) * (0.5 + c["load"] / 100)
    omega = omega_n * (1 + swing * np.sin(phi - 0.5))
    curves = {
        "position": 1 - np.cos(phi) + 0.5 * ratio * np.sin(phi) ** 2,
        "velocity": np.sin(phi) * (1 + ratio * np.cos(phi)),
        "acceleration": np.cos(phi) + ratio * np.cos(2 * phi),
        "pressure": 1 + (30 + 0.5 * c["load"]) * np.exp(-(phi**2)) + 0 * ratio,
        "gas_torque": gas,
        "inertia_torque": inertia,
        "torque": gas + inertia - friction[:, None],
        "load_torque": 100 * (omega / omega_n) ** c["load_exponent"],
        "omega": omega,
    }
    numbers = {
        "friction_torque": friction,
        "delta": np.ptp(omega, axis=1) / omega.mean(axis=1),
        "omega_max": omega.max(axis=1), "omega_mean": omega.mean(axis=1),
        "omega_min": omega.min(axis=1),
        "torque_range": np.ptp(curves["torque"], axis=1),
    }  # fmt: skip
    for name, values in (curves | numbers).items():
        data[name] = (("design", "crank_angle")[: values.ndim], values, attributes(name))
    data["status"] = ("design", np.full(len(rows), 6, dtype=np.int8), STATUS)
    beside = numbers["delta"] * 1.02
    beside[1] = np.nan
    data["delta_published"] = ("design", beside, attributes("delta"))
    return data


def product(words: dict[str, list[str]] | None = None, **axes: object) -> xr.Dataset:
    """delta, omega and status over a product of axes; the slowest, lightest designs fail."""
    values = {name: np.asarray(v, dtype=float) for name, v in axes.items()}
    numbers = values | {name: np.arange(len(v)) for name, v in (words or {}).items()}
    grid = dict(zip(numbers, np.meshgrid(*numbers.values(), indexing="ij"), strict=True))
    data = xr.Dataset()
    for name, column in values.items():
        data.coords[name] = (name, column, attributes(name))
    for name, column in (words or {}).items():
        data.coords[name] = (name, np.arange(len(column)), {"long_name": "number", "units": "1"})
        texts = np.array(column, dtype=object)
        data.coords[f"{name}_name"] = (name, texts, {"long_name": f"{name} of the speed"})
    shape = tuple(len(v) for v in numbers.values())
    speed = np.broadcast_to(grid.get("speed", 1200.0), shape)
    delta = np.broadcast_to(2e5 / grid.get("inertia", 2.0) / speed**2, shape)
    delta = delta * (1 + grid.get("load", 0.0) / 100) * (1 + 0.05 * grid.get("method", 0))
    code = np.where(delta > 0.6, status.STALLED, 0)
    code = np.where((delta > 0.4) & (delta <= 0.6), status.NOT_CONVERGED, code)
    code = np.where((delta > 0.3) & (delta <= 0.4), status.TOLERANCE_NOT_MET, code)
    lost = np.isin(code, (status.STALLED, status.NOT_CONVERGED))
    delta = np.where(lost, np.nan, delta)
    dims = tuple(numbers)
    data["delta"] = (dims, delta, attributes("delta"))
    data["status"] = (dims, code.astype(np.int8), STATUS)
    data.coords["crank_angle"] = ("crank_angle", angles(), attributes("crank_angle"))
    omega = (speed * np.pi / 30)[..., None] * (
        1 + delta[..., None] / 2 * np.sin(np.radians(angles()))
    )
    data["omega"] = ((*dims, "crank_angle"), omega, attributes("omega"))
    return data


def legend_texts(figure) -> list[str]:
    return [
        plain(t.get_text()).replace("\n", " ") for legend in figure.legends for t in legend.texts
    ]


@pytest.fixture(scope="module")
def thesis_plates() -> dict:
    return plates(thesis_like(), laid_out=True)


@pytest.mark.parametrize(
    ("units", "printed"),
    [("rad s-1", "rad/s"), ("rad s-2", "rad/s²"), ("kg m2", "kg m²"), ("kg m^2", "kg m²"),
     ("kg.m**2", "kg m²"), ("m3", "m³"), ("N m", "N m"), ("N m s2", "N m s²"), ("percent", "%"),
     ("degree", "°"), ("rpm", "rpm"), ("bar s m-1", "bar s/m"), ("W m-2 K-1", "W/(m² K)"),
     ("m/s", "m/s"), ("s-1", "1/s"), ("N m s1.6", "N m s$^{1.6}$"), ("1", ""), ("", ""),
     ("1e-3 kg", "1e-3 kg"), ("$ m", r"\$ m")],
)  # fmt: skip
def test_units_are_printed_with_signs_and_superscripts(units: str, printed: str) -> None:
    assert unit_text(units) == printed


def test_a_label_has_name_symbol_and_unit() -> None:
    label = axis_label(xr.Variable((), 0.0, attributes("inertia")), "inertia")
    assert plain(label) == r"Moment of inertia of the whole engine with its load $\Theta$ (kg m²)"
    # what follows a comma explains, and a unit of one is a dash
    label = axis_label(xr.Variable((), 0.0, attributes("crank_ratio")), "crank_ratio")
    assert plain(label) == r"Crank ratio $\lambda$ (–)"
    assert axis_label(xr.Variable((), 0.0), "load_factor") == "Load factor"
    broken = xr.Variable((), 0.0, {"symbol": r"$\nothing{", "long_name": "cost in $"})
    assert axis_label(broken, "x") == r"Cost in \$"


@pytest.mark.parametrize(
    ("value", "printed"),
    [(1200.0, "1200"), (0.25714285, "0.2571"), (-180.0, "\N{MINUS SIGN}180"),
     (1e-6, r"1$\times 10^{-6}$"), (-2.5e9, "\N{MINUS SIGN}2.5" + r"$\times 10^{9}$"),
     (123456.7, "123457"), (np.nan, "–")],
)  # fmt: skip
def test_numbers_are_printed_shortly(value: float, printed: str) -> None:
    assert typeset(value) == printed


def test_lines_break_outside_formulas_and_brackets() -> None:
    text = r"ratio of largest to mean torque $M_{max} / M_{mean}$ (N m s2) end"
    lines = wrap(text, 12).split("\n")
    assert " ".join(lines) == text
    assert any(r"$M_{max} / M_{mean}$" in line for line in lines)
    assert any("(N m s2)" in line for line in lines)
    inertia = value_text(xr.Variable((), 0.0, attributes("inertia")), "inertia", 5.158)
    assert plain(wrap(f"best with {inertia}", 12)) == "best with\n$\\Theta$ = 5.158 kg m²"


@pytest.mark.slow
def test_the_thesis_gets_its_figures(thesis_plates: dict) -> None:
    assert set(thesis_plates) == {
        "kinematics", "indicator_diagrams", "work_diagrams", "torque_components",
        "torque_components_reciprocating_mass", "torque_components_crank_ratio",
        "torque_components_speed", "torque_components_load", "torque_components_load_exponent",
        "torque_components_cylinders", "torque_and_speed", "turning_moment", "load_curves",
        "cylinders", "omega_inertia", "omega_inertia_cylinders_8", "omega_speed", "omega_load",
        "omega_cylinders", "omega_extremes", "torque_range", "delta_reciprocating_mass",
        "delta_inertia", "delta_crank_ratio", "delta_speed", "delta_load", "delta_load_exponent",
        "delta_cylinders", "published", "published_parity",
    }  # fmt: skip
    for stem, said in {
        "kinematics": "$c/(r\\omega)$ (–)", "indicator_diagrams": "(bar)",
        "torque_components": "Torque (N m)", "torque_and_speed": "(rad/s)", "cylinders": "(N m)",
        "omega_speed": "(rpm)", "delta_inertia": "(kg m²)", "delta_load": "(%)",
        "omega_extremes": "Deviation of the crank", "published": "(%)",
        "omega_load": "Crank angle $\\varphi$ (°)",
        "torque_components_load_exponent": "the same for every load exponent",
    }.items():  # fmt: skip
        assert said in words(thesis_plates[stem]), stem
    exponents = legend_texts(thesis_plates["torque_components_load_exponent"])
    assert sum(text.startswith("Load torque") for text in exponents) == 2
    assert "Torque, load torque and speed" in texts(thesis_plates["torque_and_speed"])


@pytest.mark.slow
def test_nothing_is_written_outside_a_figure_or_over_its_data(thesis_plates: dict) -> None:
    axes = {"inertia": np.geomspace(0.5, 12, 9), "speed": np.linspace(600, 3000, 8)}
    study = plates(product({"method": ["thesis", "newton"]}, **axes), laid_out=True)
    for stem, figure in (thesis_plates | study).items():
        assert_inside(stem, figure)


def test_what_the_figures_of_the_thesis_draw(thesis_plates: dict) -> None:
    figure = thesis_plates["omega_inertia"]
    assert legend_texts(figure) == ["0.5", "2 (nominal)", "5", "12"]
    assert "$Z$ = 1" in words(figure)  # what the other parameters are
    eight = thesis_plates["omega_inertia_cylinders_8"]
    assert legend_texts(eight) == ["2", "5", "12"]
    assert "$Z$ = 8" in words(eight)
    rods = legend_texts(thesis_plates["kinematics"])
    assert rods == ["0.25, $m$ = 6.67 kg (nominal)", "0.3333, $m$ = 6.95 kg"]
    data = thesis_like()
    figure = thesis_plates["delta_inertia"]
    assert legend_texts(figure) == [
        "$Z$ = 1 (nominal)", "$Z$ = 1 (nominal), published", "$Z$ = 8", "$Z$ = 8, published",
    ]  # fmt: skip
    lines = figure.axes[0].get_lines()
    members = [3, 0, 4, 2]
    assert_array_equal(lines[0].get_xdata(), [0.5, 2, 5, 12])
    assert_array_equal(lines[0].get_ydata(), data.delta.values[members])
    assert_array_equal(lines[1].get_ydata(), data.delta_published.values[members])
    assert figure.axes[0].get_xscale() == figure.axes[0].get_yscale() == "log"
    percent = thesis_plates["published"].axes[0].get_lines()[0].get_xdata()
    assert_allclose(percent, np.full(14, 100 * (1 / 1.02 - 1)))  # one is not published
    # Friction is drawn as it acts.
    figure = thesis_plates["torque_components"]
    lines = dict(zip(legend_texts(figure), figure.axes[0].get_lines(), strict=False))
    parts = [line.get_ydata() for line in list(lines.values())[:3]]
    total = list(lines.values())[3].get_ydata()
    assert_allclose(parts[0] + parts[1] + parts[2][0], total)
    assert any(text.startswith("\N{MINUS SIGN}Mean friction torque") for text in lines)


@pytest.mark.slow
def test_what_is_left_of_figures_and_of_published_values_in_other_units() -> None:
    assert len(plates(thesis_like()[["position", "velocity"]])["kinematics"].axes) == 2
    data = thesis_like().drop_vars("load_torque")
    data["delta_published"].attrs["units"] = "percent"
    found = plates(data)
    assert "Torque and speed" in texts(found["torque_and_speed"])
    assert "load torque" not in words(found["torque_and_speed"]).lower()
    assert "published" not in found and "Published" not in words(found["delta_speed"])


def test_curves_are_closed_or_have_a_gap() -> None:
    data = thesis_like()
    data["status"][:] = 0
    with style():
        figure, panels = new_sheet(1, 1, 3.0)
        view = study_of(data, {"case": "#1"}).view
        (drawn,) = draw_curves(panels[0], view, "omega", view.axis(None), {}, {})
        crank_axis(panels[0], view.array("crank_angle"), 5.0)
        figure.canvas.draw()
    (line,) = [line for line in panels[0].get_lines() if len(line.get_xdata()) > 2]
    assert line.get_xdata()[0] == -360.0
    assert line.get_xdata()[-1] == 360.0
    assert drawn[-1] == drawn[0] == data.omega.values[0, 0]
    labels = [text.get_text() for text in panels[0].get_xticklabels()]
    assert labels == [
        "\N{MINUS SIGN}360\nTDC", "\N{MINUS SIGN}270", "\N{MINUS SIGN}180\nBDC",
        "\N{MINUS SIGN}90", "0\nfiring TDC", "90", "180\nBDC", "270", "360\nTDC",
    ]  # fmt: skip
    # Passes that do not close have a gap where they start.
    with style():
        figure = curve_figure(study_of(thesis_like(), {"case": "#1"}).view, "omega", None)
    (line,) = [line for line in figure.axes[0].get_lines() if len(line.get_xdata()) > 5]
    gap = np.flatnonzero(np.isnan(line.get_ydata()))
    assert line.get_xdata()[gap].tolist() == [-180.0]


def test_orders_and_padded_cylinders() -> None:
    throws = np.ones((2, 3, angles().size))
    throws[0, 2:] = np.nan  # two cylinders, padded to three
    curves = throws * np.sin(np.radians(angles()))
    of_throw = ("cylinders", "cylinder", "crank_angle")
    sizes = np.outer([1.0, 2.0], np.ones(6))
    data = xr.Dataset(
        {"torque_after_throw": variable(of_throw, curves, "torque after each throw", "N m"),
         "torque_amplitude": variable(("cylinders", "order"), sizes, "amplitudes", "N m")},
        {"cylinders": ("cylinders", [2.0, 3.0], attributes("cylinders")),
         "cylinder": variable("cylinder", [1, 2, 3], "cylinder", "1"),
         "order": variable("order", np.arange(1, 7) / 2, "order", "1"),
         "crank_angle": ("crank_angle", angles(), attributes("crank_angle"))},
    )  # fmt: skip
    found = plates(data)
    assert "Order" in words(found["torque_amplitude_cylinders"])
    panels = [p for p in found["torque_after_throw_cylinders"].axes if p.get_visible()]
    assert [len(p.get_lines()) for p in panels] == [2 + 5, 2 + 5, 1 + 5]  # and the dead centres
    assert "no value" not in words(found["torque_after_throw_cylinders"])


def test_one_axis_gives_curves_and_one_value_is_a_slice() -> None:
    data = product(inertia=[12.0, 0.5, 2.0, 6.0], speed=[1200.0])  # not in order
    found = plates(data)
    assert set(found) == {"omega_inertia", "delta_inertia"}
    line = found["delta_inertia"].axes[0].get_lines()[0]
    assert_array_equal(line.get_xdata(), [0.5, 2, 6, 12])
    assert_array_equal(line.get_ydata(), data.delta[:, 0].sortby("inertia").values)
    assert "(kg m²)" in words(found["delta_inertia"])
    assert "$n$ = 1200 rpm" in texts(found["delta_inertia"])


@pytest.mark.slow
def test_maps_over_two_axes_and_more() -> None:
    data = product(inertia=np.geomspace(0.5, 12, 8), speed=np.linspace(600, 3000, 6))
    found = plates(data)
    panel = found["delta_map_inertia_speed"].axes[0]
    assert (panel.get_xscale(), panel.get_yscale()) == ("log", "linear")
    (mesh,) = [item for item in panel.collections if isinstance(item, QuadMesh)]
    assert_array_equal(
        np.ma.filled(mesh.get_array(), np.nan), data.delta.transpose("speed", "inertia").values
    )
    said = words(found["delta_map_inertia_speed"])
    assert "(kg m²)" in said
    assert "(rpm)" in said
    assert "Coefficient of speed fluctuation $\\delta$ (–)" in said
    assert {"delta_inertia", "delta_speed"} <= set(found)
    axes = {"inertia": np.geomspace(0.5, 12, 13), "speed": np.linspace(600, 3000, 12)}
    data = product(**axes, load=np.arange(0, 91, 9))[["delta", "status"]]
    figure = plates(data)["delta_map_inertia_speed_by_load"]
    panels = [a for a in figure.axes if a.get_title(loc="left")]
    assert len(panels) == 9
    assert plain(panels[0].get_title(loc="left")) == "$L$ = 0 %"
    assert "9 of 11 values of load shown" in texts(figure)
    axes = {"inertia": np.geomspace(0.5, 12, 5), "speed": np.linspace(600, 3000, 6)}
    data = product({"method": ["thesis", "newton"]}, **axes, load=[0.0, 50.0, 90.0])
    figure = plates(data)["delta_map_inertia_speed_by_method"]
    assert "$L$ = 50 %" in texts(figure)
    chosen = plates(data, {"load": 80.0, "method": "newton"})
    figure = chosen["delta_map_inertia_speed"]
    assert "$L$ = 90 %; newton" in texts(figure)
    (mesh,) = [c for c in figure.axes[0].collections if isinstance(c, QuadMesh)]
    expected = data.delta.sel({"load": 90.0, "method": 1}).transpose("speed", "inertia").values
    assert_array_equal(np.ma.filled(mesh.get_array(), np.nan), expected)


def test_maps_end_at_the_outermost_designs() -> None:
    """Half a cell farther, colours would stand at negative speeds, where nothing is computed."""
    speed, inertia = [300.0, 1200.0, 2000.0, 3000.0, 4000.0], [0.5, 1.1, 1.6, 4.0, 12.0]
    found = plates(product(inertia=inertia, speed=speed))
    for stem in ("delta_map_inertia_speed", "status"):
        panel = found[stem].axes[0]
        assert panel.get_xlim() == (0.5, 12.0) and panel.get_ylim() == (300.0, 4000.0)
        for cells in panel.collections:
            for path in cells.get_paths():
                low, high = path.get_extents().get_points()
                assert np.all(low >= (0.5, 300.0)) and np.all(high <= (12.0, 4000.0)), stem
    axis = study_of(product(inertia=inertia, cylinders=[2, 4, 6]), {}).view.axis("cylinders")
    assert_array_equal(cell_edges(axis), [1, 3, 5, 7])  # Nothing lies between numbers of cylinders


@pytest.mark.parametrize(
    ("select", "message"),
    [
        ({"inertai": 2.0}, r"inertai: not an axis of the archive; did you mean 'inertia'\?"),
        ({"method": "nowton"}, r"method = 'nowton': unknown; did you mean 'newton'\?"),
        ({"inertia": "large"}, r"inertia = 'large': must be a number in kg m2"),
        ({"inertia": np.nan}, r"inertia = nan: must be a number in kg m2"),
    ],
)
def test_a_slice_that_is_not_there_is_bad_input(select: dict, message: str) -> None:
    data = product({"method": ["thesis", "newton"]}, inertia=[1.0, 2.0])
    with pytest.raises(SceneError, match=message):
        study_of(data, select)


def test_axes_of_words_are_spelled() -> None:
    data = product({"method": ["thesis", "newton"]}, speed=np.linspace(600, 3000, 5))
    found = plates(data)
    assert legend_texts(found["delta_speed"])[:2] == ["thesis", "newton"]
    assert [a.get_title(loc="left") for a in found["omega_speed"].axes] == ["thesis", "newton"]
    words_only = product({"method": ["thesis", "newton"], "model": ["constant", "variable"]})
    words_only["delta"][:, 1] *= 1.1
    figure = plates(words_only)["delta_method"]
    assert [t.get_text() for t in figure.axes[0].get_xticklabels()] == ["thesis", "newton"]
    assert legend_texts(figure) == ["constant", "variable"]


def constant_map(noise: float, tolerance: float) -> xr.Dataset:
    """A wanted delta over two axes, met to some relative noise."""
    data = product(inertia=np.geomspace(2, 12, 6), speed=np.linspace(1500, 3000, 7))
    rng = np.random.default_rng(1)
    data["delta"][:] = (1 + noise * rng.uniform(-1, 1, (6, 7))) / 6
    data["status"][:] = 0
    data.attrs["solver"] = json.dumps({"method": ["auto"], "tolerance": tolerance})
    return data[["delta", "status"]]


@pytest.mark.parametrize(("noise", "tolerance"), [(1e-9, 1e-6), (9e-4, 1e-3)])
def test_what_the_tolerance_leaves_is_no_map(noise: float, tolerance: float) -> None:
    assert plates(constant_map(noise, tolerance)) == {}
    for code, said in ((status.STALLED, "Stalled"), (status.TOLERANCE_NOT_MET, "Tolerance not")):
        data = constant_map(0.0, tolerance)
        data["status"][0, 0] = code
        if code == status.STALLED:
            data["delta"][0, 0] = np.nan
        drawn = plates(data)["delta_map_inertia_speed"]
        assert any(text.startswith(said) for text in legend_texts(drawn))


def test_what_is_more_than_the_tolerance_is_drawn_and_nothing_of_empty_archives() -> None:
    assert "delta_map_inertia_speed" in plates(constant_map(9e-4, 1e-6))
    # of a speed, the tolerance is not the relative error
    data = constant_map(9e-4, 1e-3).rename(delta="omega_max")
    data["omega_max"].attrs = attributes("omega_max")
    assert "omega_max_map_inertia_speed" in plates(data)
    data = product(inertia=np.geomspace(2, 12, 6))
    valueless = data[["delta"]] * np.nan
    for empty in (xr.Dataset(), data.isel(inertia=slice(0, 0)), valueless):
        assert plates(empty) == {}


def test_an_axis_without_effect_is_said_and_not_drawn() -> None:
    data = product({"model": ["constant", "variable"]}, inertia=np.geomspace(2, 12, 6))
    found = plates(data)
    figure = found["delta_inertia"]
    assert len(figure.axes[0].get_lines()) == 1
    assert not figure.legends
    assert "the same over model" in texts(figure)
    assert "omega_model" not in found
    assert len([a for a in found["omega_inertia"].axes if a.get_title(loc="left")]) == 0
    assert "the same over model" in texts(found["omega_inertia"])


def test_contours_and_legends_tell_values_apart() -> None:
    data = product(inertia=np.geomspace(2, 12, 6), speed=np.linspace(1500, 3000, 7))[["delta"]]
    grid = np.add.outer(np.linspace(0, 0.05, 6), np.linspace(0, 0.05, 7))
    data["delta"] = data["delta"].copy(data=125.6 + grid)
    figure = plates(data)["delta_map_inertia_speed"]
    bar = [t.get_text() for t in figure.axes[-1].get_yticklabels() if t.get_text()]
    assert len(set(bar)) == len(bar) >= 4
    data = product(inertia=[2.00001, 2.00002], speed=np.linspace(1500, 3000, 4))[["delta"]]
    data["delta"] = data["delta"] * np.array([1.0, 2.0])[:, None]
    assert legend_texts(plates(data)["delta_speed"]) == ["2.00001", "2.00002"]


def test_designs_without_an_answer() -> None:
    data = product(inertia=[0.5, 1.1, 1.6, 4.0, 12.0], speed=[600.0, 1200, 2000, 3000, 4000])
    found = plates(data)
    figure = found["delta_map_inertia_speed"]
    assert legend_texts(figure) == ["Not converged", "Stalled", "Tolerance not met"]
    hatched = [c for c in figure.axes[0].collections if isinstance(c, PolyCollection)]
    assert len([c for c in hatched if c.get_hatch()]) == 2
    stalled = int((data.status == status.STALLED).sum())
    said = " ".join(legend_texts(found["status"]))
    assert f"Stalled ({100 * stalled / data.status.size:.3g} %)" in said
    data = product(inertia=[0.2, 0.28, 0.4, 1.0, 4.0, 12.0])
    found = plates(data)
    figure = found["delta_inertia"]
    assert legend_texts(figure) == ["Computed", "Not converged", "Stalled", "Tolerance not met"]
    drawn = figure.axes[0].get_lines()[0].get_ydata()
    assert_array_equal(np.isfinite(drawn), np.isfinite(data.delta.values))
    assert any("stalled" in text for text in legend_texts(found["omega_inertia"]))
    infinite = product(inertia=np.linspace(2, 12, 6))[["delta"]]
    infinite["delta"][2] = np.inf
    figure = plates(infinite)["delta_inertia"]
    assert legend_texts(figure) == ["Computed", "No value"]
    assert np.isfinite(figure.axes[0].get_ylim()).all()
    thesis = thesis_like()
    thesis["status"][[3, 9]] = status.STALLED
    for name in ("delta", "omega", "load_torque", "omega_max", "omega_mean", "omega_min"):
        thesis[name][[3, 9]] = np.nan
    found = plates(thesis)
    assert legend_texts(found["omega_inertia"])[0] == "0.5: stalled"
    assert "Stalled" in legend_texts(found["delta_load"])
    assert any("stalled" in text for text in legend_texts(found["torque_components_load"]))
    data = product(inertia=np.geomspace(0.5, 12, 5), speed=np.linspace(600, 3000, 5))
    data["status"][:] = status.NO_STEADY_STATE
    for name in ("delta", "omega"):
        data[name][:] = np.nan
    found = plates(data)
    for stem in ("delta_map_inertia_speed", "delta_inertia", "omega_inertia", "status"):
        assert "no steady state" in words(found[stem]).lower(), stem
    assert not found["delta_inertia"].axes[0].yaxis.get_tick_params()["labelleft"]


def unrelated(count: int, labels: list[str] | None = None) -> xr.Dataset:
    """Designs that differ in everything."""
    rng = np.random.default_rng(3)
    data = xr.Dataset()
    for name, low, high in (("inertia", 1.0, 12.0), ("speed", 600.0, 3000.0)):
        data.coords[name] = ("design", rng.uniform(low, high, count), attributes(name))
    if labels:
        data.coords["case"] = ("design", np.array(labels, dtype=object))
    data["delta"] = ("design", rng.uniform(0.01, 0.1, count), attributes("delta"))
    curves = np.sin(np.radians(angles())) * data.delta.values[:, None] + 100
    data.coords["crank_angle"] = ("crank_angle", angles(), attributes("crank_angle"))
    data["omega"] = (("design", "crank_angle"), curves, attributes("omega"))
    return data


def test_long_and_odd_labels_of_cases() -> None:
    labels = [
        "a label that somebody wrote to say everything there is to be said about a design",
        "_underscore first", "costs $5 or $6", r"$\lambda", "",
    ]  # fmt: skip
    found = plates(unrelated(5, labels), laid_out=True)
    rows = [t.get_text() for t in found["delta_cases"].axes[0].get_yticklabels()]
    assert len(rows) == 5
    assert all(len(row) <= 45 for row in rows)
    assert rows[0].endswith("a design")
    assert "underscore" in " ".join(legend_texts(found["omega"]))
    for figure in found.values():
        box = figure.axes[0].get_tightbbox(figure.canvas.get_renderer())
        assert box.x0 >= -1
        assert box.width > 0.3 * figure.bbox.width
    many = plates(unrelated(200)[["delta"]])["delta_cases"]  # over their parameters
    assert "(kg m²)" in words(many) and "(rpm)" in words(many)
    assert all(len(axes.get_lines()[0].get_xdata()) == 200 for axes in many.axes)


@pytest.mark.parametrize("loads", [2, 12])
def test_many_unrelated_designs_are_points_at_values_of_other_axes(loads: int) -> None:
    data = unrelated(200)[["delta"]].expand_dims(load=np.linspace(10.0, 90.0, loads), axis=1)
    data["load"].attrs = attributes("load")
    data["delta"] = data["delta"] * (1.0 + data["load"] / 100.0)
    # Two designs that differ in one parameter alone, as in Saltelli's design
    data["speed"].values[1] = data["speed"].values[0]
    data.attrs["scene"] = '{"sample": {"method": "saltelli"}}'
    found = {name: fig for name, fig in plates(data).items() if name.startswith("delta")}
    if loads == 2:
        assert set(found) == {"delta_cases_load_10", "delta_cases_load_90"}
    else:
        assert set(found) == {"delta_cases"}
        assert "1 of 12 values of load" in words(found["delta_cases"])
    for fig in found.values():
        assert all(len(axes.get_lines()[0].get_xdata()) == 200 for axes in fig.axes)
        assert all(axes.get_lines()[0].get_linestyle() == "None" for axes in fig.axes)


def test_few_unrelated_designs_are_not_joined() -> None:
    data = unrelated(12)[["delta"]].expand_dims(load=[10.0, 90.0], axis=1)
    data["load"].attrs = attributes("load")
    data["delta"] = data["delta"] * (1.0 + data["load"] / 100.0)
    for name, fig in plates(data).items():
        if name.startswith("delta"):
            lines = [line for line in fig.axes[0].get_lines() if len(line.get_xdata()) == 12]
            assert all(line.get_linestyle() == "None" for line in lines), name


def test_designs_beside_axes() -> None:
    data = thesis_like()[["delta", "omega", "status"]].isel(design=[0, 2, 3, 4])
    data = data.drop_vars("load").expand_dims(load=[10.0, 90.0])
    data["load"].attrs = attributes("load")
    for name in ("delta", "omega"):
        data[name] = data[name] * (1 + data["load"] / 1e4)
        data[name].attrs = attributes(name)
    found = plates(data.transpose("design", "load", "crank_angle"))
    assert legend_texts(found["delta_inertia"]) == ["10", "90"]
    titles = [plain(a.get_title(loc="left")) for a in found["omega_inertia"].axes]
    assert titles == ["$L$ = 10 %", "$L$ = 90 %"]


@pytest.mark.parametrize("kind", all_but(("png", "pdf"), ("png", "svg", "pdf")))
def test_files_are_written_and_come_out_the_same_again(tmp_path, kind: str) -> None:
    data = product(inertia=np.geomspace(0.5, 12, 5), speed=np.linspace(600, 3000, 5))[["delta"]]
    before = data.copy(deep=True)
    first = draw(data, tmp_path / "new" / "folder", format=kind)
    names = ["delta_map_inertia_speed", "delta_inertia", "delta_speed"]
    assert [path.name for path in first] == [f"{name}.{kind}" for name in names]
    contents = [path.read_bytes() for path in first]
    assert draw(data, tmp_path / "new" / "folder", kind) == first
    assert [path.read_bytes() for path in first] == contents
    xr.testing.assert_identical(data, before)
    if kind == "png":
        assert int.from_bytes(contents[0][16:20], "big") == 2100  # 7 inches of 300 dots
    with pytest.raises(SceneError, match="format is 'gif', allowed: png, svg, pdf"):
        draw(data, tmp_path / "x", format="gif")
    assert not (tmp_path / "x").exists()


def test_a_persons_own_settings_neither_matter_nor_change(tmp_path) -> None:
    data = product(inertia=[1.0, 2.0, 4.0])[["delta"]]
    (plain,) = draw(data, tmp_path / "plain")
    with matplotlib.rc_context({"font.size": 30, "axes.grid": False, "figure.dpi": 50}):
        (own,) = draw(data, tmp_path / "own")
        assert matplotlib.rcParams["font.size"] == 30
    assert own.read_bytes() == plain.read_bytes()


def described(*texts: str, **factors: tuple[float, ...]) -> xr.Dataset:
    """An archive of nothing but arrangements."""
    made = [
        dataset._arrangement(
            cylinders_of(arrangement_from_text(text, 4.0 * np.pi)).with_factors(**factors)
        )
        for text in texts
    ]
    return xr.Dataset(attrs={"arrangement": json.dumps(made[0] if len(made) == 1 else made)})


def test_arrangements_are_drawn_with_their_firing_stars() -> None:
    found = plates(described("V8 cross-plane"))
    assert set(found) == {"arrangement", "crank_star", "strokes"}
    plate = found["arrangement"]
    said = words(plate)
    assert "firing order 1-8-4-3-6-5-7-2; every 90°" in said
    assert texts(plate).count("90°") == 8
    for members in ("1, 3, 5, 7", "2, 4, 6, 8", "1, 2", "3, 4", "5, 6", "7, 8"):
        assert members in said
    found = plates(described("V4 90", "boxer 4", "in-line 4"))
    assert set(found) == {
        f"{kind}_{name}"
        for kind in ("arrangement", "crank_star", "strokes")
        for name in ("V4_90_shared-pin", "boxer_4", "in-line_4")
    }
    assert "intervals" in words(found["arrangement_V4_90_shared-pin"])
    assert "Boxer 4" in words(found["arrangement_boxer_4"])
    assert plates(described("in-line 1")) == {}
    assert arrangement._middle(np.array([0.0, 0.0, 90.0])) == pytest.approx(45.0)
    assert arrangement._middle(np.array([0.0, 180.0])) == pytest.approx(90.0)
    assert arrangement._middle(np.arange(0.0, 360.0, 40.0)) == 0.0
