"""Orders as the excitation of a shaft, and the page on torsional vibration."""

import importlib
import re
import sys
import tomllib
import types
from typing import Any

import numpy as np
import pytest

import sweeps
from engine_dyn.torsion.forced import forced_response
from engine_dyn.torsion.system import shaft_system
from engine_dyn.units import RPM
from sweeps.decide.explore.torsion import QUANTITIES, excitation
from tests.support.shafts import DIESEL
from tests.sweeps.processes import ROOT

sys.path.insert(0, str(ROOT / "tools"))
example: Any = importlib.import_module("torsional_vibration")

NODES = [2, 3, 4, 5, 6, 7]


def archive(*more: str, **tables: Any) -> Any:
    output = {"quantities": [*QUANTITIES, *more], "highest_order": 200, "angle_step": 1.0}
    return sweeps.run({"engine": "diesel_105x137", "output": output, **tables})


@pytest.fixture(scope="module")
def found() -> Any:
    return archive("torque_after_throw", "torque_mean")


def test_orders_on_each_node_are_the_torque_of_its_throw(found: Any) -> None:
    one = excitation(found, NODES)
    phi = np.radians(found["crank_angle"].values)
    omega = 2200 * np.pi / 30
    waves = (one.complexes[:, None] * np.exp(1j * one.omega * (phi / omega)[:, None])).real
    summed = waves.sum(axis=-1)
    # torque after a throw less that after the next; its mean part has no order
    after = found["torque_after_throw"].values
    throw = after - np.vstack([after[1:], np.zeros_like(after[:1])])
    throw = throw - throw.mean(axis=1, keepdims=True)
    # the measured points scatter: orders above 200 are left out
    assert np.abs(summed - throw).max() < 3e-3 * np.abs(throw).max()
    assert float(found["order_frequency"].sel(order=3.0)) == pytest.approx(3.0 * 2200 / 60)


def test_openTorsion_is_called_as_it_wants(found: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    # The class of openTorsion 0.2, in what it does with add_sines.
    class PeriodicExcitation:
        def __init__(self, dofs: int, omegas: Any) -> None:
            self.omegas = omegas
            self.U = np.zeros([dofs, len(omegas)], dtype=complex)

        def add_sines(self, node: int, omegas: Any, amplitudes: Any, phases: Any) -> None:
            assert len(omegas) == len(amplitudes) == len(phases)
            for i, (a, p) in enumerate(zip(amplitudes, phases, strict=True)):
                self.U[node, i] += a * np.exp(1j * p)

    fake = types.ModuleType("opentorsion")
    fake.PeriodicExcitation = PeriodicExcitation
    monkeypatch.setitem(sys.modules, "opentorsion", fake)
    one = excitation(found, NODES)
    made = one.for_opentorsion(9)
    assert np.allclose(made.U, one.matrix(9), rtol=1e-14)
    assert (made.U[[0, 1, 8]] == 0.0).all()
    assert made.omegas[1] == pytest.approx(2200 * np.pi / 30)  # order 1
    with pytest.raises(ValueError, match="node 5: must be from 0 to 4"):
        one.for_opentorsion(5)
    monkeypatch.setitem(sys.modules, "opentorsion", None)
    with pytest.raises(ImportError, match=r"pip install 'engine-dyn\[torsion\]'"):
        one.for_opentorsion(9)


@pytest.mark.parametrize("speed", [1000.0, 2165.0])
def test_shaft_systems_agree_with_openTorsion(speed: float) -> None:
    """With amplitude and phase: the same convention from the engine's orders to the shaft."""
    import opentorsion

    inertia, stiffness, damping = (
        DIESEL[name] for name in ("inertia", "stiffness", "disc_damping")
    )
    shafts = [opentorsion.Shaft(i, i + 1, None, None, k=k, I=0) for i, k in enumerate(stiffness)]
    discs = [opentorsion.Disk(i, one, c=damping[i]) for i, one in enumerate(inertia)]
    one = excitation(archive(set={"speed": speed}), NODES)
    assembly = opentorsion.Assembly(shafts, disk_elements=discs)
    theirs, _ = assembly.vibratory_torque(one.for_opentorsion(9))
    system = shaft_system(inertia, stiffness, disc_damping=damping)
    ours = forced_response(system, one.order, speed * RPM, NODES, one.complexes)
    scale = np.abs(theirs).max(axis=0)
    # Its torque is that on the second disc of a shaft.
    assert (np.abs(ours["torque"] + theirs) < 1e-9 * scale).all()


@pytest.mark.slow
def test_the_document_is_current() -> None:
    number = re.compile(r"[-+]?\d+(?:\.\d+)?")
    fresh = example.documents(example.diesel())
    assert len(fresh) == 4
    for path, made in fresh.items():
        kept = path.read_text(encoding="utf-8")
        assert path == example.DOCUMENT or f"]({path.name})" in fresh[example.DOCUMENT]
        assert number.sub("#", made) == number.sub("#", kept)
        for new, old in zip(number.findall(made), number.findall(kept), strict=True):
            unit = 10.0 ** -len(old.partition(".")[2])
            assert float(new) == pytest.approx(float(old), rel=1e-9, abs=1.001 * unit)


def test_the_documents_code_runs(capsys: pytest.CaptureFixture[str]) -> None:
    text = example.DOCUMENT.read_text(encoding="utf-8")
    for block in re.findall(r"```python\n(.*?)```", text, re.DOTALL):
        exec(block, {})
    assert "[" in capsys.readouterr().out
    system = example.DOCUMENT.with_name("torsional_vibration.md").read_text(encoding="utf-8")
    scene, *_ = re.findall(r"```toml\n(.*?)```", system, re.DOTALL)
    made = sweeps.run(tomllib.loads(scene))
    assert (made["torsion_status"] == 0).all()
    assert made["natural_frequency"].dims == ("shaft_stiffness_2", "mode")
