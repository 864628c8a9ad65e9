"""Elasticities against closed forms, and [uncertainty]: bands and what they come from."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.optimize import brentq

import sweeps
from engine_dyn.types import Floats
from sweeps.running.compute.variations import derivative, shares
from sweeps.scene.plan.plan import make_plan
from sweeps.scene.plan.variations import AGREE, DIFFER, ONE_SIDE, STEPS, UNKNOWN
from sweeps.scene.reading import read_scene
from tests.support.archives import assert_same_in_parts
from tests.support.commands import ok
from tests.support.scenes import computed, refusal_of


def differenced(function: Any, x: float, low: float = -np.inf, high: float = np.inf) -> Any:
    """Derivative of a function at a point of its range."""

    def at(place: float) -> Floats:
        return np.array([function(place) if low <= place <= high else np.nan])

    sides = [(at(x * (1.0 - step)), at(x * (1.0 + step))) for step in STEPS]
    return derivative(at(x), sides, [np.array([step * x]) for step in STEPS])


@pytest.mark.parametrize("power", [-3.0, -1.0, 0.5, 2.0, 7.0])
def test_smooth_functions(power: float) -> None:
    found = differenced(lambda x: x**power, 1.7)
    exact = power * 1.7 ** (power - 1.0)
    assert found.kind == AGREE
    assert abs(found.value - exact) < found.error < 1e-4 * abs(exact)
    for side in (found.below, found.above):
        assert abs(side - exact) < 1e-3 * abs(exact)


def test_a_bend_at_the_point_has_two_sides_and_one_beyond_the_steps_none() -> None:
    found = differenced(lambda x: np.maximum(x, 2.0 * x - 1.7), 1.7)
    assert found.kind == DIFFER
    assert found.below == pytest.approx(1.0) and found.above == pytest.approx(2.0)
    assert found.value == pytest.approx(1.5)
    found = differenced(lambda x: np.maximum(x, 2.0 * x - 1.7 * 1.01), 1.7)
    assert found.kind == AGREE and found.value == pytest.approx(1.0, abs=1e-6)
    unknown = differenced(lambda x: np.nan, 1.7)
    assert unknown.kind == UNKNOWN and np.isnan(unknown.value)


def test_noise_makes_no_bend() -> None:
    """Noise of the size that is allowed for is neither told as two sides nor under-estimated."""
    random = np.random.default_rng(3)
    values = [1.0 + 5e-10 * random.uniform(-1, 1, 1000) for _ in range(7)]
    sides = [(values[i], values[i + 1]) for i in (0, 2, 4)]
    found = derivative(values[6], sides, [np.full(1000, step) for step in STEPS])
    assert (found.kind == AGREE).all()
    assert (np.abs(found.value) < found.error).mean() > 0.95


BASE: dict[str, Any] = {
    "engine": "ntua",
    "set": {"speed": 1200.0, "load": 35.0, "inertia": 2.0, "reciprocating_mass": 6.67},
    "output": {"quantities": ["delta_elasticity"]},
}


def with_quantities(*quantities: str, **more: Any) -> dict[str, Any]:
    return {**BASE, "output": {"quantities": [*quantities]}, **more}


compiled = pytest.mark.compiled


@compiled
def test_closed_forms() -> None:
    """Displacement goes with bore^2 stroke, the mean piston speed with stroke times speed."""
    found = sweeps.run(with_quantities("displacement_elasticity", "mean_piston_speed_elasticity"))
    for quantity, expected in (
        ("displacement", {"bore": 2.0, "stroke": 1.0}),
        ("mean_piston_speed", {"stroke": 1.0, "speed": 1.0}),
    ):
        assert set(found.parameter.values) == {"bore", "stroke", "speed"}
        for key in found.parameter.values:
            one = found.sel(parameter=key)
            exact = expected.get(key, 0.0)
            assert abs(one[f"{quantity}_elasticity"] - exact) < 1e-8
            assert abs(one[f"{quantity}_elasticity"] - exact) < one[f"{quantity}_elasticity_error"]


def periodic_square(
    torque: Floats, inertia: float, load: float, count: int
) -> tuple[Floats, Floats]:
    """omega^2 over the cycle, and its derivative by the inertia, at so many even angles.

    d(omega^2)/dphi = 2 (M - k omega^2) / Theta is linear: Y_n = 2 M_n / (i n Theta + 2 k), with
    the order n; dY_n/dTheta is its derivative. Both Fourier series are summed by the fast
    transform.
    """
    spectrum = np.fft.rfft(torque) / torque.size
    order = 0.5j * np.arange(spectrum.size)  # a cycle of two turns
    square = 2.0 * spectrum / (order * inertia + 2.0 * load)
    slope = -2.0 * spectrum * order / (order * inertia + 2.0 * load) ** 2
    return np.fft.irfft(square * count, count), np.fft.irfft(slope * count, count)


@compiled
def test_inertia_against_the_derivative_of_the_periodic_solution() -> None:
    """Implicit function theorem and, at the extremes, the envelope theorem.

    The extreme moves, but to first order its value changes with the solution at the same angle. The
    torque is taken from samples every 0.1 degree: what they lose of the bends of the diagram is
    some 1e-5 of the swing.
    """
    names = ("delta", "omega_max", "omega_min")
    found = sweeps.run(
        {
            **BASE,
            "output": {
                "quantities": [*(f"{n}_elasticity" for n in names), "torque", "load_coefficient"],
                "angle_step": 0.1,
            },
        }
    )
    torque = found.torque.values - (found.torque.values.mean() - _brake_mean(found))
    inertia = 2.0
    square, slope = periodic_square(torque, inertia, float(found.load_coefficient), 72_000)
    speed = np.sqrt(square)
    change = slope / (2.0 * speed)
    largest, smallest = int(np.argmax(speed)), int(np.argmin(speed))
    exact = {
        "omega_max": change[largest] * inertia / speed[largest],
        "omega_min": change[smallest] * inertia / speed[smallest],
    }
    mean, swing = speed.mean(), speed[largest] - speed[smallest]
    of_mean = change.mean() * inertia / mean
    exact["delta"] = (change[largest] - change[smallest]) * inertia / swing - of_mean
    assert float(found.delta) == pytest.approx(swing / mean, rel=1e-5)
    for name in names:
        one = found[f"{name}_elasticity"].sel(parameter="inertia")
        error = float(found[f"{name}_elasticity_error"].sel(parameter="inertia"))
        assert abs(float(one) - exact[name]) < min(error, 2e-5 * abs(exact[name])), name


def _brake_mean(found: xr.Dataset) -> float:
    """Mean of the torque that drives the load: k omega_nominal^2."""
    return float(found.load_coefficient) * (1200.0 * np.pi / 30.0) ** 2


@compiled
def test_rows_of_the_load_family_have_two_sides() -> None:
    found = sweeps.run(
        {**with_quantities("delta_elasticity"), "set": {**BASE["set"], "load": 50.0}}
    )
    here = found.sel(parameter="load")
    near = computed(
        ["delta_elasticity"],
        set={k: v for k, v in BASE["set"].items() if k != "load"},
        axes={"load": [49.0, 51.0]},
    ).sel(parameter="load")
    assert here.delta_elasticity_kind == DIFFER
    assert here.delta_elasticity_below > 1.2 * here.delta_elasticity_above
    middle = 0.5 * (here.delta_elasticity_below + here.delta_elasticity_above)
    assert float(here.delta_elasticity) == pytest.approx(float(middle), rel=1e-9)
    for side, load in (("below", 49.0), ("above", 51.0)):
        assert float(here[f"delta_elasticity_{side}"]) == pytest.approx(
            float(near.delta_elasticity.sel(load=load)), rel=0.03
        )
    assert (near.delta_elasticity_kind == AGREE).all()
    others = found.delta_elasticity_kind.drop_sel(parameter="load")
    assert (others == AGREE).all()


@compiled
def test_the_last_diagram_and_the_last_speed_have_one_side() -> None:
    """An engine at full load, and at the ends of the speeds of its diagram, is not refused."""
    quantity = ["torque_max_elasticity"]
    full = computed(quantity, "si_four_87x101").sel(parameter="load")
    assert full.torque_max_elasticity_kind == ONE_SIDE
    assert np.isnan(full.torque_max_elasticity_above)
    assert full.torque_max_elasticity == full.torque_max_elasticity_below != 0.0
    ends = computed(quantity, "diesel_105x137", axes={"speed": [997.847, 1500.0, 2550.551]})
    kinds = ends.torque_max_elasticity_kind.sel(parameter="speed")
    assert kinds[[0, 2]].values.tolist() == [ONE_SIDE, ONE_SIDE] and kinds[1] != ONE_SIDE


def test_extremes_that_tie_have_two_sides() -> None:
    """Near 2110 rpm the speed has equally low minima during compression and at the dead centre."""
    scene: dict[str, Any] = {"engine": "ntua", "set": {"load": 40.0, "inertia": 2.0}}

    def difference(speed: float) -> float:
        settings = {**scene["set"], "speed": speed}
        omega = sweeps.run({**scene, "set": settings, "output": {"quantities": ["omega"]}}).omega
        compression = omega.sel(crank_angle=slice(-100, -40)).min()
        return float(compression - omega.sel(crank_angle=slice(-20, 20)).min())

    tie = brentq(difference, 2000.0, 2400.0, xtol=1e-3)
    found = sweeps.run(
        {
            **scene,
            "axes": {"speed": [0.98 * tie, tie, 1.02 * tie]},
            "output": {"quantities": ["delta_elasticity"]},
        }
    ).sel(parameter="speed")
    assert found.delta_elasticity_kind.values.tolist() == [AGREE, DIFFER, AGREE]
    below, _, above = found.delta_elasticity.values
    assert abs(below - above) > 0.5
    assert float(found.delta_elasticity_below[1]) == pytest.approx(below, rel=0.05)
    assert float(found.delta_elasticity_above[1]) == pytest.approx(above, rel=0.05)


@compiled
def test_designs_that_fail_have_none() -> None:
    axes = {"inertia": [1e-4, 2.0]}
    rest = {key: value for key, value in BASE["set"].items() if key != "inertia"}
    found = sweeps.run({**BASE, "set": rest, "axes": axes})
    assert found.status.values[0] != 0 and found.status.values[1] == 0
    assert (found.delta_elasticity_kind.values[0] == UNKNOWN).all()
    assert np.isnan(found.delta_elasticity.values[0]).all()
    assert np.isfinite(found.delta_elasticity.sel(parameter="inertia").values[1])


@compiled
def test_blocks_shards_and_reruns_have_the_same_bits(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = {
        "engine": "ntua",
        "axes": {"speed": [1200.0, 1500.0], "load": [35.0, 60.0]},
        "designs": {"inertia": [1.0, 2.0, 5.0], "reciprocating_mass": [6.0, 6.7, 7.0]},
        "output": {"quantities": ["delta_elasticity", "torque_mean_elasticity"]},
    }
    assert_same_in_parts(scene, tmp_path, monkeypatch)


WRONG = {
    "omega_elasticity": "'omega_elasticity': omega is a curve over crank_angle; elasticities",
    "status_elasticity": "'status_elasticity': an outcome has no elasticity",
    "detla_elasticity": "'detla_elasticity': unknown quantity",
    "inertia_elasticity": "unknown quantity",
    "phase_vector_sum_elasticity": "elasticit",
}


@pytest.mark.parametrize("quantity", list(WRONG))
def test_what_has_no_elasticity_is_refused(quantity: str) -> None:
    assert WRONG[quantity] in refusal_of(lambda: make_plan(read_scene(with_quantities(quantity))))


RANGES: dict[str, Any] = {
    "friction_constant": {"low": 0.05, "high": 0.25},
    "inertia": {"low": 1.8, "high": 2.2},
}


def scene(uncertainty: Any, *quantities: str, **more: Any) -> dict[str, Any]:
    return {
        "engine": "ntua",
        "set": {"speed": 1200.0, "load": 35.0},
        "uncertainty": uncertainty,
        "output": {"quantities": [*(quantities or ("delta", "torque_mean"))]},
        **more,
    }


def test_shares_of_a_linear_function_and_without_some_draws() -> None:
    random = np.random.default_rng(1)
    draws = random.uniform(-1.0, 1.0, (4096, 3)) * [1.0, 2.0, 5.0]
    values = 10.0 + draws @ [3.0, 1.0, 0.0]
    explained, share = shares(draws, values)
    assert explained == pytest.approx(1.0)
    assert share == pytest.approx(np.array([9.0, 4.0, 0.0]) / 13.0, abs=0.03)
    curved, _ = shares(draws, draws[:, 0] ** 2)
    assert curved < 0.05
    random = np.random.default_rng(2)
    draws = random.uniform(-1.0, 1.0, (512, 2))
    values = np.stack([draws @ [1.0, 2.0], draws @ [2.0, 1.0]], axis=1)
    values[random.choice(512, 50, replace=False), 0] = np.nan
    explained, share = shares(draws, values)
    kept = np.isfinite(values[:, 0])
    alone = shares(draws[kept], values[kept, 0])
    assert share[0] == pytest.approx(alone[1], rel=1e-9) and explained[0] == pytest.approx(1.0)
    assert share[0, 1] > share[0, 0] and share[1, 0] > share[1, 1]


def test_bands_are_quantiles_of_a_sample() -> None:
    """Each draw is a design that could be run by itself."""
    found = sweeps.run(scene({"number": 64, "seed": 5, **RANGES}))
    columns = sweeps.sample(RANGES, 64, seed=5)
    alone = computed(
        ["delta", "torque_mean"],
        set={"speed": 1200.0, "load": 35.0},
        designs={key: columns[key].to_numpy() for key in columns},
    )
    for name in ("delta", "torque_mean"):
        low, high = np.quantile(alone[name].broadcast_like(alone.inertia), [0.025, 0.975])
        assert float(found[f"{name}_low"]) == pytest.approx(low, rel=1e-6)
        assert float(found[f"{name}_high"]) == pytest.approx(high, rel=1e-6)
    assert found.failed_draws == 0
    plain = sweeps.run({k: v for k, v in scene({}).items() if k != "uncertainty"})
    assert float(found.delta) == float(plain.delta)  # the nominal value stays
    # Friction lowers the mean torque as a straight line; the inertia does not change it.
    torque = found.torque_mean_share.sel(uncertain_parameter="friction_constant")
    assert float(torque) == pytest.approx(1.0, abs=1e-6)
    assert float(found.delta_share.sel(uncertain_parameter="inertia")) > 0.99


@compiled
def test_known_parameters_are_not_drawn() -> None:
    """What the scene gives is known; what no requested quantity depends on is left out."""

    def of(*quantities: str, **given: float) -> xr.Dataset:
        return sweeps.run(engine="b112", set=given, uncertainty={"number": 32},
                          output={"quantities": list(quantities)})  # fmt: skip

    drawn = set(of("torque_mean", inertia=0.095).uncertain_parameter.values)
    assert "inertia" not in drawn and "friction_constant" in drawn and "pressure_factor_1" in drawn
    # The range of the whole inertia gives way to its parts, which it would replace.
    found = of("inertia_share", "delta", flywheel_inertia=0.09, auxiliary_inertia=0.0176)
    assert "inertia" not in found["uncertain_parameter"].values
    assert float(found["delta_low"]) < float(found["delta"]) < float(found["delta_high"])
    assert float(found["inertia_share_low"]) == pytest.approx(float(found["inertia_share"]))


@compiled
def test_failed_draws_are_counted() -> None:
    found = sweeps.run(scene({"number": 64, "inertia": {"low": 1e-3, "high": 1.0}}, "delta"))
    failed = int(found.failed_draws)
    assert 0 < failed < 64
    assert np.isfinite(found.delta_low) and found.delta_low < found.delta_high


@compiled
def test_the_command_and_its_table(tmp_path: Path) -> None:
    path = tmp_path / "b112.toml"
    path.write_text('engine = "b112"\n[output]\nquantities = ["delta", "brake_power"]\n')
    archive = tmp_path / "b112.nc"
    text = ok("run", path, "-o", archive, "--uncertainty")
    with sweeps.open(archive) as found:
        low, high = float(found.delta_low), float(found.delta_high)
        share = found.delta_share
        main, second = found.uncertain_parameter.values[np.argsort(-share.values)[:2]]
        assert share.max() < 2.0 / 3.0 * share.sum()  # the largest alone is not most of it
        alone = found.uncertain_parameter.values[
            int(found.brake_power_share.argmax("uncertain_parameter"))
        ]
        assert found.brake_power_share.max() > 2.0 / 3.0
    assert f"({low:.5f} to {high:.5f})" in text
    said = " ".join(text.split())
    assert f"uncertainty mostly from {main} and {second}" in said
    assert f"uncertainty mostly from {alone} " in said
    assert "delta_low" not in text  # stands in brackets


NO_BANDS: list[tuple[Any, ...]] = [
    (scene({}), "[uncertainty]: no uncertain values: the engine file of ntua"),
    (scene(RANGES, axes={"inertia": [1.0, 2.0]}),
     "[uncertainty] inertia: varies in [axes]; give it in one place"),
    (scene({"method": "sobol", **RANGES}), "[uncertainty] method: unknown key"),
    (scene({"frction": RANGES["inertia"]}), "[uncertainty] frction: unknown key"),
    (scene({"inertia": {"low": 2.0, "high": 1.0}}),
     "[uncertainty] inertia: low = 2 and high = 1: low must be below high"),
    (scene({"friction_constant": RANGES["friction_constant"]}, "displacement"),
     "[uncertainty]: no requested quantity depends on friction_constant"),
    ({**scene({"compression_ratio": {"low": 17.0, "high": 21.0}}, "brake_power"),
      "engine": "b112", "set": {}},
     "[uncertainty] compression_ratio: not allowed: engine b112 has diagrams that are not "
     "modelled"),
    (scene({"load": {"low": 50.0, "high": 120.0}}, "torque_mean"), "[uncertainty] load = "),
    (scene(RANGES, "omega"), "[uncertainty]: no quantity with one number per design is requested"),
    ({**scene(RANGES), "engine": ["ntua", "b112"]}, "not allowed with several engines"),
]  # fmt: skip


@pytest.mark.parametrize(("raw", "expected"), NO_BANDS)
def test_bad_input_is_told_in_one_line(raw: Any, expected: str) -> None:
    assert expected in refusal_of(lambda: make_plan(read_scene(raw)))
