"""Figures of reliability, one file of JSON for each command: docs/reliability/NAME.json.

tools/reliability.py reads them; every part says when it was made, with which versions.
"""

from __future__ import annotations

import datetime
import json
import os
import sys
from pathlib import Path
from typing import Any

from sweeps.archive.provenance import PACKAGES, version

__all__ = ["part_file", "write_part"]

FOLDER = Path(__file__).resolve().parents[1] / "docs" / "reliability"


def part_file(name: str) -> Path:
    """Where the figures of a command lie."""
    return FOLDER / f"{name}.json"


def write_part(path: Path, figures: dict[str, Any]) -> None:
    """Write figures, with the day, the machine and the versions that they belong to."""
    about = {
        "date": datetime.datetime.now(datetime.UTC).date().isoformat(),
        "system": f"{sys.platform}, {os.cpu_count()} processors",
        "python": sys.version.split()[0],
        "versions": {name: version(name) for name in PACKAGES},
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    text = json.dumps({**about, **figures}, indent=1, ensure_ascii=False)
    path.write_text(text + "\n", encoding="utf-8")
