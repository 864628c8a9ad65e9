"""[uncertainty]: bands of results, and what they come from."""

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import sweeps
from sweeps.errors import SceneError
from sweeps.figures.drawing import figure
from sweeps.planning.plan import make_plan
from sweeps.running.uncertainty import shares
from sweeps.scene.reading import read_scene
from tests.support.archives import assert_same_in_parts
from tests.support.commands import ok, refused
from tests.support.engine_files import ENGINES
from tests.support.scenes import computed, refusal_of

compiled = pytest.mark.compiled

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


@compiled
def test_a_parameter_with_one_value_where_there_are_numbers_has_no_share() -> None:
    draws = np.random.default_rng(5).random((64, 2))
    draws[:, 1] = draws[:, 1] > 0.5
    values = np.where(draws[:, 1] == 0.0, 3.0 + 2.0 * draws[:, 0], np.nan)
    explained, share = shares(draws, values[:, None])
    assert np.allclose(share, [[1.0, 0.0]], atol=1e-12)
    assert np.allclose(explained, 1.0, atol=1e-12)


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
def test_blocks_and_shards_have_the_same_bits(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    raw = scene({"number": 16, "friction_constant": RANGES["friction_constant"]})
    raw = {**raw, "set": {"load": 35.0}, "axes": {"inertia": [1.0, 2.0, 4.0], "speed": [1e3, 2e3]}}
    assert_same_in_parts(raw, tmp_path, monkeypatch)


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


WRONG: list[tuple[Any, ...]] = [
    (scene({}), "[uncertainty]: no uncertain values: the engine file of ntua"),
    (scene(RANGES, axes={"inertia": [1.0, 2.0]}),
     "[uncertainty] inertia: varies in [axes]; give it in one place"),
    (scene({"method": "sobol", **RANGES}), "[uncertainty] method: unknown key"),
    (scene({"number": 100, **RANGES}), "[uncertainty] number = 100: must be a power of"),
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


@pytest.mark.parametrize(("raw", "expected"), WRONG)
def test_bad_input_is_told_in_one_line(raw: Any, expected: str) -> None:
    assert expected in refusal_of(lambda: make_plan(read_scene(raw)))


def test_ranges_of_engine_files_are_checked(tmp_path: Path) -> None:
    text = (ENGINES / "b112.toml").read_text(encoding="utf-8")
    wrong = text.replace("friction_constant = { low = 0.3", "friction_constant = { low = -0.3")
    assert wrong != text
    (tmp_path / "b112.toml").write_text(wrong)
    for extra in ENGINES.glob("*.csv"):
        shutil.copy(extra, tmp_path)
    path = tmp_path / "scene.toml"
    path.write_text('engine = "b112.toml"\n[output]\nquantities = ["delta"]\n')
    said = refused("run", path, "-o", tmp_path / "out.nc", "--uncertainty")
    assert "[uncertainty] friction_constant low = -0.3: must be a finite number" in said


@compiled
def test_the_figure_has_the_shares_that_can_be_seen() -> None:
    archive = sweeps.run(
        engine="b112", uncertainty={"number": 64}, output={"quantities": ["delta"]}
    )
    drawn = figure(archive, "uncertainty")
    (panel,) = drawn.axes
    shares = np.sort(archive.delta_share.values)[::-1]
    seen = shares[shares >= 0.005]
    assert 1 < seen.size < shares.size
    assert [bar.get_width() for bar in panel.patches] == pytest.approx(100.0 * seen)
    labels = [text.get_text().replace("\n", " ") for text in panel.get_yticklabels()]
    largest = int(archive.delta_share.argmax("uncertain_parameter"))
    name = str(archive.uncertain_parameter_long_name.values[largest])
    assert labels[0].lower() == name.split(",")[0].lower()
    texts = " ".join(text.get_text() for text in drawn.texts).replace("\n", " ")
    assert f"{float(archive.delta):.4g}" in texts and "95 % range" in texts
    with pytest.raises(SceneError, match="run --uncertainty"):
        figure(sweeps.run(engine="b112", output={"quantities": ["delta"]}), "uncertainty")
