"""The benchmark of a card, in small: by numba's simulator, and without a card."""

import os
import subprocess
import sys

import pytest

from benchmarks import gpu
from benchmarks.command import ROOT

SMALL = ["--designs", "6", "--seconds", "0.01", "--compared", "4"]

pytestmark = pytest.mark.compiled


def test_a_table_is_made() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks", "gpu", *SMALL], cwd=ROOT, text=True, check=False,
        capture_output=True,
        env={**os.environ, "PYTHONPATH": str(ROOT), "NUMBA_ENABLE_CUDASIM": "1"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    cells = [line.strip("| ").split(" | ") for line in done.stdout.splitlines()]
    found = {what.strip(): value.strip() for what, value in cells}
    assert found["card"] == "numba's simulator"
    assert found["designs with another status"] == "0"
    assert float(found["largest difference to the processor, 4 designs"]) < 1e-12
    assert all(float(v.replace(",", "")) > 0.0 for k, v in found.items() if "designs/s" in k)


def test_without_a_card_one_line_says_so(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from engine_dyn.card import device

    monkeypatch.setattr(device, "what_is_missing", lambda: "no card")
    assert gpu.main(SMALL) == 2
    assert capsys.readouterr().err == "bench-gpu: device 'cuda': no card\n"
