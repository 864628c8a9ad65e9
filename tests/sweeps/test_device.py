"""Runs on a card, which numba's simulator stands for."""

from pathlib import Path

import pytest

import sweeps
from sweeps.base.errors import SceneError
from tests.sweeps.processes import python

pytestmark = pytest.mark.compiled

SCENE = {
    "engine": "ntua", "set": {"speed": 1500, "load": 90}, "axes": {"inertia": [2, 4, 8]},
    "output": {"quantities": ["delta", "delta_error"]},
}  # fmt: skip
SCRIPT = """
import sys
import numpy as np
import sweeps
from tests.support.card_designs import launched

scene, archive = eval(sys.argv[1]), sys.argv[2]
sizes = launched()
found = sweeps.run(scene, device="cuda")
assert sizes == [3, 3], sizes
sweeps.stream(scene, archive, device="cuda")
assert len(sizes) == 4
right, stored = sweeps.run(scene), sweeps.open(archive)
np.testing.assert_allclose(found.delta, right.delta, rtol=1e-12)
assert (found.status == right.status).all()
assert found.delta.identical(stored.delta.load()) or (found.delta == stored.delta).all()
try:
    sweeps.stream(scene, archive + "2", device="cuda", scheduler="local:2")
except sweeps.SceneError as error:
    print(error)
"""


def test_run_and_stream_take_a_card(tmp_path: Path) -> None:
    simulated = {"NUMBA_ENABLE_CUDASIM": "1"}
    done = python(SCRIPT, repr(SCENE), tmp_path / "found.nc", environment=simulated)
    assert done.returncode == 0, done.stderr
    assert done.stdout == "device 'cuda': not allowed with a scheduler and its workers\n"


def test_an_unknown_device_is_refused() -> None:
    with pytest.raises(SceneError, match='device = \'gpu\': must be "cpu" or "cuda"'):
        sweeps.run(SCENE, device="gpu")
