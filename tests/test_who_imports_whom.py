"""Test files import helpers, not each other; tests, benchmarks and the oracle stay apart.

The rules of the two packages are contracts of import-linter (`make imports`).
"""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]

FORBIDDEN = {
    "tests": {"benchmarks"}, "benchmarks": {"tests"}, "oracle": {"tests", "benchmarks", "sweeps"},
    "tools": {"tests", "benchmarks"},
}  # fmt: skip
"""Folders, and what no file in them imports."""


def imported(path: Path) -> Iterator[str]:
    """Full names of all modules that a file imports, inside functions too."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (name.name for name in node.names)
        elif isinstance(node, ast.ImportFrom):
            parts = path.relative_to(ROOT).parent.parts
            inside = parts[: len(parts) - node.level + 1] if node.level else ()
            module = ".".join([*inside, *([node.module] if node.module else [])])
            yield module
            yield from (f"{module}.{name.name}" for name in node.names)


@pytest.mark.parametrize("folder", FORBIDDEN)
def test_folders_stay_apart(folder: str) -> None:
    files = sorted((ROOT / folder).rglob("*.py"))
    assert files
    for path in files:
        for name in imported(path):
            assert name.split(".")[0] not in FORBIDDEN[folder], f"{path} imports {name}"


def test_no_test_file_is_imported() -> None:
    """What two of them need belongs in tests/support."""
    for folder in ("tests", "benchmarks"):
        for path in sorted((ROOT / folder).rglob("*.py")):
            for name in imported(path):
                modules = [part for part in name.split(".")[1:] if part.startswith("test_")]
                assert not (name.startswith(("tests.", "benchmarks.")) and modules), (
                    f"{path} imports {name}"
                )
