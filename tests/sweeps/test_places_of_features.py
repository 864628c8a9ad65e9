"""In how many product files each structured key is named: a feature stays in its own place."""

import re
from pathlib import Path

import pytest

import engine_dyn
import sweeps
from sweeps.base.dimensions import FIRING_PATTERN
from sweeps.scene.features import GIVEN_FEATURES

FEW = 8
"""Files that may name a key: two halves, two lists, the table of keywords, and three others, such
as the table of crossings."""

MORE = {
    "auxiliaries": 13,
    "counterweights": 14,  # five of them in words of the physics alone
    "indicator": 15,  # the command `import` and the laboratory have its keys
    "measured": 20,  # most of them in the laboratory
    "shaft": 33,  # most of them as the dimension of the same name
    "transient": 10,  # the method of the same name; two in reports, one where diagrams are checked
}
"""Keys that more files name, and how many."""

WORDS = {
    "auxiliaries", "characteristic", "clutch", "governor", "hold", "indicator", "measured", "shaft",
    "starter", "transient",
}  # fmt: skip
"""Keys that are words of the field too: only where they are written as keys do they count."""

FILES = [
    path
    for package in (engine_dyn, sweeps)
    for path in sorted(Path(package.__path__[0]).rglob("*.py"))
]


@pytest.mark.parametrize("key", [*GIVEN_FEATURES, FIRING_PATTERN])
def test_few_files_name_a_structured_key(key: str) -> None:
    as_key = rf"\[{key}\]|[\"']{key}[\"']|\b{key}\.(?:FEATURE|GIVEN|of)\b"
    name = re.compile(as_key if key in WORDS else rf"\b{key}\b")
    named = [str(path) for path in FILES if name.search(path.read_text(encoding="utf-8"))]
    assert 2 <= len(named) <= MORE.get(key, FEW), "\n".join(named)
