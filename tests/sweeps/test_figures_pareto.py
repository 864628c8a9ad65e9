"""Pareto fronts of archives as figures: what is drawn, from datasets made here."""

from typing import Any

import numpy as np
import pytest
import xarray as xr

import sweeps
from engine_dyn import status
from sweeps.errors import SceneError
from sweeps.figures import pareto
from sweeps.figures.drawing import figure, figures, kinds_of
from sweeps.figures.options import options_of
from sweeps.figures.study import study_of
from tests.support.figures import variable, words


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
    # The front is that of the search.
    data = choices()
    drawn = figure(data, "pareto", options_of(quantities="inertia,delta"))
    found = sweeps.pareto(data, "inertia", "delta", within=["speed > 0", "load > 0"])
    assert of_front(drawn) == pytest.approx(np.array([found["inertia"], found["delta"]]))
    # the legend names the designs at both ends
    assert "moment of inertia = 1 kg m², engine speed = 2000 rpm, engine load = 20 %" in words(
        drawn
    )
    assert "moment of inertia = 10 kg m², engine speed = 2000 rpm" in words(drawn)


def test_slabs_give_the_front_of_all(monkeypatch: pytest.MonkeyPatch) -> None:
    view = study_of(choices(), {}).view
    whole = pareto.front(view, ["delta", "brake_power"])
    monkeypatch.setattr(pareto, "MOST_AT_ONCE", 9)  # one inertia at a time
    again = pareto.front(view, ["delta", "brake_power"])
    assert (again.values == whole.values).all() and (again.places == whole.places).all()
    assert again.count == whole.count == 51
    # Of journals the largest load counts.
    found = pareto.front(view, ["inertia", "main_journal_load_max"])
    assert found.dims == ("inertia", "speed", "load")
    assert found.values[1].min() == pytest.approx(1.0 + 20.0 / 40.0)


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


def test_a_sample_of_speeds_has_no_front() -> None:
    inertia, stroke, speed = np.random.default_rng(1).uniform(1.0, 2.0, (3, 40))
    data = xr.Dataset(
        {
            "delta": variable("design", stroke / inertia / speed, "fluctuation", "1"),
            "brake_power": variable("design", stroke * speed, "brake power", "W"),
        },
        {"inertia": ("design", inertia), "stroke": ("design", stroke)},
    )
    assert pareto.pareto_names(study_of(data, {}).view) == ["inertia", "delta", "brake_power"]
    sampled = data.assign_coords(speed=("design", speed))
    assert pareto.pareto_names(study_of(sampled, {}).view) == []
    assert figure(sampled, "pareto", options_of(quantities="delta,brake_power"))


def test_a_mean_speed_that_is_the_nominal_one_is_no_figure() -> None:
    data = choices().isel(speed=1, drop=True)
    data["omega_mean"] = variable(
        ("inertia", "load"), 157.08 - data["delta"].values * 1e-4, "mean speed", "rad s-1"
    )
    assert not [stem for stem in figures(data) if stem.startswith("omega_mean")]
    only = data[["omega_mean"]]
    offered = {kind.name for kind, names in kinds_of(only) if names}
    assert "numbers" not in offered
    with pytest.raises(SceneError, match=r"numbers: not available .* repeats no axis"):
        figure(only, "numbers")
    # 1 % is more than the closure makes of the mean
    data["omega_mean"] = data["omega_mean"] * (1.0 + 0.01 * data["load"] / 100.0)
    assert [stem for stem in figures(data[["omega_mean"]]) if stem.startswith("omega_mean")]
