"""Options of figures, two archives in one chart, and Pareto fronts: what is drawn."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure

import sweeps
from engine_dyn import status
from sweeps.base.errors import SceneError
from sweeps.decide.explore.compare import beside
from sweeps.view.figures import pareto
from sweeps.view.figures.drawing import figure, figures, kinds_of
from sweeps.view.figures.kinds import KINDS
from sweeps.view.figures.options import Options, options_of
from sweeps.view.figures.study import study_of
from tests.support.figures import variable, words

DOCUMENT = Path(__file__).parents[2] / "docs" / "gallery.md"


def archive() -> xr.Dataset:
    angle = np.arange(-360.0, 360.0, 10.0)
    phi, inertia = np.radians(angle), np.array([1.0, 2.0, 4.0])
    wave = np.cos(phi)[None, :] / inertia[:, None]
    names = ("inertia", "crank_angle")
    data = xr.Dataset(
        {
            "torque": (names, 100.0 * wave, {"long_name": "torque", "units": "N m"}),
            "omega": (names, 100.0 + wave,
                      {"long_name": "crank speed", "symbol": r"$\omega$", "units": "rad s-1"}),
            "delta": ("inertia", 0.02 / inertia, {"long_name": "fluctuation", "units": "1"}),
        },
        coords={
            "inertia": ("inertia", inertia, {"units": "kg m2"}),
            "crank_angle": ("crank_angle", angle, {"long_name": "crank angle", "units": "degree"}),
        },
        attrs={"engine_title": "A test engine (of nobody)", "parameters": '{"speed": 955}'},
    )  # fmt: skip
    return data


def test_one_kind_is_a_figure_that_names_engine_and_speed() -> None:
    drawn = figure(archive(), "torque_and_speed")
    said = " ".join(text.get_text() for text in drawn.texts)
    assert "A test engine" in said and "nobody" not in said
    assert "955\N{NO-BREAK SPACE}rpm" in said
    assert set(figures(archive(), options_of(only="numbers"))) == {"delta_inertia"}
    given = {kind.name for kind, names in kinds_of(archive()) if names}
    assert {"torque_and_speed", "numbers"} <= given and "shaking" not in given


@pytest.mark.parametrize(
    ("kind", "more", "said"),
    [
        ("numberz", {}, "did you mean 'numbers'"),
        ("shaking", {}, "needs shaking_force or shaking_moment"),
        ("turning_moment", {"ax": Figure().add_subplot()}, "2 panels"),
        ("torque_and_speed", {"options": Options(angle=(0.0, 360.0))}, "720 degrees"),
        ("numbers", {"options": options_of(target="delt=1")}, "did you mean 'delta'"),
    ],
)
def test_figures_that_cannot_be_are_bad_input(kind: str, more: dict, said: str) -> None:
    with pytest.raises(SceneError, match=said):
        figure(archive(), kind, **more)


def test_targets_are_lines_with_their_text_in_a_panel_of_ones_own() -> None:
    mine = Figure()
    panel = mine.add_subplot()
    drawn = figure(archive(), "numbers", options_of(target="delta=1/200"), ax=panel)
    assert drawn is mine and "luctuation" in panel.get_title(loc="left")
    assert [0.005, 0.005] in [list(line.get_ydata()) for line in panel.get_lines()]
    legends = [*drawn.legends, panel.get_legend()]
    assert "1/200" in " ".join(t.get_text() for one in legends if one for t in one.get_texts())


@pytest.mark.parametrize(
    ("angle", "zero", "peak"),
    [("0..720", "firing-tdc", [0.0, 360.0, 720.0]), (None, "bdc", [180.0, 540.0])],
)
def test_the_crank_angle_is_counted_as_asked(angle: str | None, zero: str, peak: list) -> None:
    options = options_of(angle=angle, zero=zero)
    panel = figure(archive().isel(inertia=0), "torque_and_speed", options).axes[0]
    line = next(one for one in panel.get_lines() if len(one.get_xdata()) > 50)
    x, y = np.asarray(line.get_xdata()), np.asarray(line.get_ydata())
    assert (x[0], x[-1]) == (0.0, 720.0)
    assert list(x[y > 99.99]) == peak


@pytest.mark.parametrize(
    "given",
    [{"size": "5x5"}, {"size": "big"}, {"angle": "0..100"}, {"zero": "here"}, {"target": "delta"},
     {"target": "delta=1/0"}, {"style": "no such style"}, {"style": {"no.key": 1}}],
)  # fmt: skip
def test_bad_options_are_bad_input(given: dict) -> None:
    with pytest.raises(SceneError, match=next(iter(given))):
        options_of(**given)


@pytest.mark.parametrize(
    ("key", "value", "allowed"),
    [(key, dots, "1 to 1200") for key in ("figure.dpi", "savefig.dpi")
     for dots in ("6000", "0.5", "nan")]
    + [("font.size", "1e6", "1 to 500 points"), ("font.size", "0", "1 to 500 points"),
     ("font.size", "nan", "1 to 500 points"), ("axes.labelsize", "501", "0 to 500 points"),
     ("lines.markersize", "1e8", "0 to 500 points"), ("grid.linewidth", "1e9", "0 to 500 points"),
     ("axes.labelpad", "-1e9", "-500 to 500 points"), ("xtick.major.size", "1e6", "0 to 500 poi")],
)  # fmt: skip
def test_dots_and_sizes_have_limits(key: str, value: str, allowed: str, tmp_path: Path) -> None:
    (tmp_path / "big.mplstyle").write_text(f"{key}: {value}\n")
    for style in (tmp_path / "big.mplstyle", {key: float(value)}):
        with pytest.raises(SceneError, match=rf"{key} = .*; must be from {allowed}"):
            options_of(style=style)
    assert options_of(style={"figure.dpi": 1200, "savefig.dpi": "figure"}).style
    assert options_of(style={"font.size": 30, "axes.labelpad": -3.0, "axes.titlesize": "large"})


def test_the_document_lists_every_kind() -> None:
    page = DOCUMENT.read_text("utf-8")
    for kind in KINDS:
        shows = kind.shows[0].upper() + kind.shows[1:]
        assert f"### `{kind.name}`\n\n{shows}; needs {kind.needs}.\n" in page


ANGLES = np.arange(-360.0, 360.0, 5.0)
PHI = np.radians(ANGLES)


def study(factor: float = 1.0, inertia: Any = (1.0, 2.0, 4.0), **given: float) -> xr.Dataset:
    heavy = np.asarray(inertia)
    return xr.Dataset(
        {
            "delta": variable("inertia", factor * 0.1 / heavy, "fluctuation", "1"),
            "torque": variable("crank_angle", 200.0 * factor * np.sin(PHI), "torque", "N m"),
            "torque_order": variable("order", factor * np.array([8.0, 4.0]), "orders", "N m"),
            "imep": variable((), 5.0 * factor, "mean pressure", "bar"),
            "fmep": variable((), 1.0, "friction", "bar"),
        },
        coords={
            "inertia": variable("inertia", heavy, "moment of inertia", "kg m2"),
            "order": variable("order", [0.5, 1.0], "order", "1"),
            "crank_angle": variable("crank_angle", ANGLES, "crank angle", "degree"),
        },
        attrs={"engine_title": "Engine of a test", "parameters": json.dumps(given)},
    )


def drawn(both: xr.Dataset) -> dict[str, Any]:
    return figures(both, options_of(only="compared"))


def test_both_archives_and_their_difference_are_drawn() -> None:
    plates = drawn(beside(study(), study(1.05), ("old", "new")))
    assert set(plates) == {
        "compared_delta_inertia", "compared_torque", "compared_torque_order", "compared_numbers",
    }  # fmt: skip
    upper, lower = plates["compared_delta_inertia"].axes
    one, two = (line.get_ydata() for line in upper.lines)
    assert one == pytest.approx([0.1, 0.05, 0.025])
    assert two == pytest.approx([0.105, 0.0525, 0.02625])
    assert lower.lines[0].get_ydata() == pytest.approx([5.0, 5.0, 5.0])
    said = words(plates["compared_delta_inertia"])
    assert "Fluctuation: old and new" in said and "difference: new less old" in said
    # Curves through zero differ by a share of their largest value.
    upper, lower = plates["compared_torque"].axes
    one, two = (line.get_ydata()[:-1] for line in upper.lines[:2])
    assert one == pytest.approx(200.0 * np.sin(PHI)) and two == pytest.approx(1.05 * one)
    assert lower.lines[0].get_ydata()[:-1] == pytest.approx(5.0 * np.sin(PHI))
    assert lower.get_ylabel().replace("\n", " ") == "Difference (% of the largest)"
    upper, lower = plates["compared_torque_order"].axes
    assert [bar.get_height() for bar in upper.patches] == [8.0, 4.0, 8.4, 4.2]
    assert [bar.get_height() for bar in lower.patches] == pytest.approx(
        [5.0, 2.5]
    )  # % of the largest
    (bar,) = plates["compared_numbers"].axes[0].patches  # friction is the same
    assert bar.get_width() == pytest.approx(5.0)
    assert "5 → 5.25 bar (+5 %)" in words(plates["compared_numbers"])


def choices() -> xr.Dataset:
    """Heavier flywheels run more evenly; power costs evenness; some designs stalled."""
    inertia, speed = np.geomspace(1.0, 10.0, 6), np.array([1000.0, 1500.0, 2000.0])
    load = np.array([20.0, 60.0, 100.0])
    delta = load / (inertia[:, None, None] * (speed[:, None] / 1000.0) ** 2)
    power = 10.0 * load * (speed[:, None] / 1000.0) ** 0.5 * np.ones((6, 1, 1))
    codes = np.zeros(delta.shape, dtype=np.int8)
    codes[0, 0] = status.STALLED
    journals = np.stack([0.5 * delta, delta + 1.0], axis=-1)
    dims = ("inertia", "speed", "load")
    data = xr.Dataset(
        {
            "delta": variable(dims, np.where(codes == 0, delta, np.nan), "fluctuation", "1"),
            "brake_power": variable(dims, power, "brake power", "W"),
            "main_journal_load_max": variable((*dims, "main_bearing"), journals, "load", "N"),
            "status": (dims, codes, {"units": "1"}),
        },
        coords={
            "inertia": variable("inertia", inertia, "moment of inertia", "kg m2"),
            "speed": variable("speed", speed, "engine speed", "rpm"),
            "load": variable("load", load, "engine load", "percent"),
        },
    )
    return data


def of_front(drawn: Any) -> np.ndarray:
    line = next(one for one in drawn.axes[0].lines if one.get_drawstyle() == "steps-post")
    return np.array(line.get_data())


def beaten(points: np.ndarray) -> np.ndarray:
    """The rule by definition, each pair against every other; less is better."""
    less = (points[:, :, None] <= points[:, None, :]).all(axis=0)
    strictly = (points[:, :, None] < points[:, None, :]).any(axis=0)
    return (less & strictly).any(axis=0)


def test_the_front_is_what_no_other_design_beats_and_that_of_the_search() -> None:
    data = choices()
    drawn = figure(data, "pareto", options_of(quantities="delta,brake_power"))
    good = np.isfinite(data["delta"].values).ravel()
    pairs = np.array([data["delta"].values.ravel(), data["brake_power"].values.ravel()])[:, good]
    expected = pairs[:, ~beaten(pairs * [[1.0], [-1.0]])]
    assert of_front(drawn) == pytest.approx(expected[:, np.argsort(expected[0])])
    assert "Brake power (W), more is better" in words(drawn)
    assert "Fluctuation (–), less is better" in words(drawn)
    assert f"{expected.shape[1]} of {good.sum()} designs" in words(drawn)
    data = choices()
    drawn = figure(data, "pareto", options_of(quantities="inertia,delta"))
    found = sweeps.pareto(data, "inertia", "delta", within=["speed > 0", "load > 0"])
    assert of_front(drawn) == pytest.approx(np.array([found["inertia"], found["delta"]]))
    # the legend names the designs at both ends
    assert "moment of inertia = 1 kg m², engine speed = 2000 rpm, engine load = 20 %" in words(
        drawn
    )
    assert "moment of inertia = 10 kg m², engine speed = 2000 rpm" in words(drawn)


def test_a_front_of_most_designs_is_drawn_only_when_asked_for_and_none_of_no_goals() -> None:
    one = choices().isel(speed=0, load=0).drop_vars(["speed", "load"])
    line = one.interp(inertia=np.geomspace(1.6, 10.0, 20))
    assert not [name for name in figures(line[["delta"]]) if name.startswith("pareto")]
    assert figure(line, "pareto", options_of(quantities="inertia,delta"))
    data = choices()
    level = data.assign(delta=data["delta"] * 0.0 + 0.01)  # the same in all designs
    assert "delta" not in pareto.pareto_names(study_of(level, {}).view)
    curve = 100.0 + data["delta"] * xr.DataArray([0.0, 1.0], dims="crank_angle")
    with pytest.raises(SceneError, match="pareto: not available for this archive"):
        figure(data.assign(omega=curve), "pareto", options_of(quantities="delta,omega"))


def test_speed_and_load_are_no_choice_and_an_axis_is_a_goal_only_when_asked_for() -> None:
    data = choices()[["delta", "brake_power"]]
    # power depends on speed and load alone, which are the operating point and not the design
    assert "brake_power" not in pareto.pareto_names(study_of(data, {}).view)
    stroke = xr.DataArray(np.linspace(0.9, 1.1, 5), dims="stroke", coords={"stroke": range(5)})
    choice = xr.Dataset(
        {"delta": data["delta"] * stroke**2, "brake_power": data["brake_power"] * stroke}
    )
    ((stem, drawn),) = figures(choice, options_of(only="pareto")).items()
    assert stem == "pareto_delta_brake_power"
    assert "speed = 1500 rpm" in words(drawn) and "of 30 designs" in words(drawn)
