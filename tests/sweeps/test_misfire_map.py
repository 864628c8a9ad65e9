"""The map of missed cycles: formulas against drawn speeds, and its page is current."""

import importlib
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from engine_dyn.units import BAR, RPM

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))
tool: Any = importlib.import_module("misfire_map")


@pytest.fixture(scope="module")
def motors() -> dict[str, Any]:
    return {name: tool.Motor(name) for name in tool.ENGINES}


@pytest.mark.parametrize(
    ("name", "speed", "imep", "case"),
    [
        ("si_four_87x101", 6000.0, 1.0, tool.UNKNOWN),
        ("v6_96x81", 6000.0, 1.0, tool.UNKNOWN),
        ("v6_96x81", 3000.0, 2.0, tool.LEARNED),
    ],
)
def test_rates_of_drawn_speeds_are_those_of_the_formulas(
    motors: dict[str, Any], name: str, speed: float, imep: float, case: Any
) -> None:
    """Within four standard deviations of a count; cycles of a recording share its wheel."""
    # three false alarms in ten cycles: rare ones would leave nothing to count in so few
    one = tool.counted(
        motors[name], speed * RPM, imep * BAR, case, recordings=400, false_alarms=0.3, seed=5
    )
    recordings, alarms = 200, one.alarms_expected
    tries = recordings * len(motors[name].firing)  # as if all cycles of a recording were one
    assert abs(one.alarms - alarms) < 4.0 * np.sqrt(alarms * (1.0 - alarms) / tries)
    spread = np.sqrt(one.found_expected * (1.0 - one.found_expected) / recordings)
    assert abs(one.found - one.found_expected) < 4.0 * spread
    assert one.cycles >= 400


def test_the_page_is_current(motors: dict[str, Any]) -> None:
    page = tool.DOCUMENT.read_text(encoding="utf-8")
    assert "{{" not in page
    kept = (tool.BESIDE / "corner.csv").read_text(encoding="utf-8")
    assert kept == tool.csv_text(tool.corner_table(motors))
    linked = set(re.findall(r"\]\(misfire/(\w+)\.csv\)", page))
    assert linked == {path.stem for path in tool.BESIDE.iterdir()}
