"""docs/data_sheet.md: its five commands, typed as a new user would, and what it says of them."""

import re
from pathlib import Path

import pandas as pd
import pytest

from tests.support.tools import ROOT, tool

DOCUMENT = (ROOT / "docs" / "data_sheet.md").read_text("utf-8")
CALIBRATED = (ROOT / "docs" / "data_sheet" / "calibrate.txt").read_text("utf-8").rstrip()
"""All that `calibrate` prints; the page has it without the assumed values."""

tool = tool("data_sheet")


def numbers(text: str) -> list[float]:
    return [float(found) for found in re.findall(r"(?<![\w.])[+-]?\d+\.?\d*", text)]


@pytest.mark.compiled
@pytest.mark.slow
def test_five_commands_lead_from_the_data_sheet_to_delta(tmp_path: Path) -> None:
    typed = re.findall(r"(?m)^\$ (engine-dyn .*)$", DOCUMENT)
    assert [c for c in typed if c != tool.REFUSED] == list(tool.COMMANDS.values())
    assert len(tool.COMMANDS) == 5
    blocks = re.findall(r"```console\n(.*?)\n```", DOCUMENT, re.DOTALL)
    printed = {block.splitlines()[0]: block for block in blocks}
    calibrate = f"$ {tool.COMMANDS['calibrate']}"
    assert printed[calibrate] == tool.shortened(CALIBRATED)
    printed[calibrate] = CALIBRATED
    found = tool.session(tmp_path)
    for name, command in tool.COMMANDS.items():
        told = printed[f"$ {command}"]
        if name == "run":  # says how long it took
            assert "converged 125" in found[name] and "converged 125" in told
            continue
        words = re.sub(r"[\d.+-]+ k?B\b", "", told), re.sub(r"[\d.+-]+ k?B\b", "", found[name])
        # The last digit of "differs by", some 0.0005 %, is that of the machine.
        assert numbers(words[0]) == pytest.approx(numbers(words[1]), rel=1e-3, abs=2e-3)
    rows = pd.read_csv(tmp_path / "flywheel.csv")
    assert len(rows) == 125
    assert (rows["status"] == "converged").all()
    table = re.findall(r"(?m)^\| (\d+) \| (.*) \|$", DOCUMENT)
    assert len(table) == 5
    inertias = sorted(rows["inertia"].unique())[::8]
    for load, deltas in table:
        for inertia, delta in zip(inertias, deltas.split(" | "), strict=True):
            row = rows[(rows["load"] == float(load)) & (rows["inertia"] == inertia)]
            assert float(row["delta"].item()) == pytest.approx(float(delta), abs=5.1e-6)


def test_what_it_says_is_refused(tmp_path: Path) -> None:
    tool.shell(tool.COMMANDS["new_engine"], tmp_path)
    path = tmp_path / "v2403.toml"
    path.write_text(tool.edited(path.read_text("utf-8")), encoding="utf-8")
    said = tool.shell(tool.REFUSED, tmp_path, status=2)
    assert said in DOCUMENT
    assert not (tmp_path / "other.toml").exists()
