"""Whatever `run` refuses, `plan` refuses in the same words."""

from pathlib import Path
from typing import Any

import pytest

import sweeps
from sweeps.base.errors import SceneError
from tests.support.commands import refused
from tests.support.mistakes import MISTAKES, Mistake
from tests.support.scenes import toml

pytestmark = [
    pytest.mark.compiled,
    pytest.mark.filterwarnings("ignore::engine_dyn.ImplausibleWarning"),
]


def reducing(**asked: Any) -> dict[str, Any]:
    return {
        "engine": "ntua",
        "axes": {"inertia": [2, 3], "load": [50, 90], "crank_ratio": [0.25, 0.26]},
        "output": {"quantities": ["delta", "omega_max", "torque_mean", "omega"], "angle_step": 30},
        "reduce": {"statistics": ["delta"], **asked},
    }


def asking(*quantities: str, **values: Any) -> dict[str, Any]:
    return {"engine": "ntua", "set": values, "output": {"quantities": list(quantities)}}


REFUSED: tuple[dict[str, Any], ...] = (
    reducing(within="nonsense <= 3"),
    reducing(within="delta <= 3 kg"),
    reducing(within=["delta <= 1/50", "delta <"]),
    reducing(within="delta <= 1/5O"),
    reducing(within="omega <= 3"),
    reducing(at_every="load", best=[{"least": "inertia", "within": "nonsense <= 3"}]),
    reducing(at_every="load", best=[{"least": "delta", "within": "omega_max <= 3 kg"}]),
    reducing(at_every="load", best=[{"least": "delta", "not_counted": "converged"}]),
    reducing(at_every="load", best=[{"least": "delta", "not_counted": "no_such_outcome"}]),
    reducing(at_every="load", front=[{"of": ["delta", "inertia"], "within": "omega_max <= few"}]),
    reducing(best=[{"least": "inertia", "within": "delta <= 1/50"}]),
    reducing(at_every="load", best=[{"least": "inertia"}]),
    reducing(at_every="load", best=[{"least": "omega"}]),
    {"engine": "b112", "axes": {"firing_pattern": ["1", "10"]}, "set": {"speed": 1500},
     "output": {"quantities": ["delta"]}, "reduce": {"within": "firing_pattern <= 1"}},
    asking("flywheel_mass", wanted_delta=0.01, flywheel_outer_diameter=0.2,
           flywheel_inner_diameter=0.3, flywheel_density=7850),
    asking("position_coefficient", pin_offset=0.002),
    asking("position_mean", pin_offset=0.002),
    asking("position_truncated", pin_offset=0.002, truncation=4),
    asking("velocity_truncation_error", crank_offset=0.002, truncation=4),
)  # fmt: skip


def refusal_by(call: Any, scene: Any) -> str | None:
    try:
        call(scene)
    except SceneError as error:
        return str(error)
    return None


@pytest.mark.parametrize("scene", REFUSED)
def test_refused_without_computing(scene: dict[str, Any], tmp_path: Path) -> None:
    told = refusal_by(sweeps.run, scene)
    assert told is not None
    assert refusal_by(sweeps.plan, scene) == told
    path = tmp_path / "scene.toml"
    path.write_text("".join(f"{key} = {toml(value)}\n" for key, value in scene.items()))
    assert told.removeprefix("scene") in refused("plan", path)


@pytest.mark.parametrize("mistake", MISTAKES, ids=lambda mistake: mistake.text)
def test_mistakes(mistake: Mistake, tmp_path: Path) -> None:
    scene = mistake.scene(tmp_path)
    assert refusal_by(sweeps.plan, scene) == refusal_by(sweeps.run, scene)
