"""Examples in the docstrings of all that a user of Python calls: there, and true."""

import doctest
import inspect
from pathlib import Path
from typing import Any

import pytest

import engine_dyn
import engine_dyn.transient
import sweeps
from sweeps.view.accessor.archive import ArchiveAccessor, Plots

ROOT = Path(__file__).resolve().parents[1]


def public() -> dict[str, Any]:
    """Everything that the page of the Python interface lists, by name."""
    found = {f"sweeps.{name}": getattr(sweeps, name) for name in sweeps.__all__}
    found |= {f"engine_dyn.{name}": getattr(engine_dyn, name) for name in engine_dyn.__all__}
    room = engine_dyn.transient
    found |= {f"engine_dyn.transient.{name}": getattr(room, name) for name in room.__all__}
    del found["engine_dyn.transient.ISO_8528_5_G2"]  # Values, not a function
    found |= {"archive.dyn": ArchiveAccessor, "archive.dyn.plot": Plots}
    for name, member in vars(ArchiveAccessor).items():
        if not name.startswith("_"):
            found[f"archive.dyn.{name}"] = member
    return found | {"archive.dyn.plot()": Plots.__call__}


PUBLIC = public()


def examples(name: str) -> list[doctest.Example]:
    return doctest.DocTestParser().get_examples(inspect.getdoc(PUBLIC[name]) or "", name)


@pytest.mark.parametrize("name", sorted(PUBLIC))
def test_every_public_name_has_an_example_that_runs(name: str) -> None:
    text = inspect.getdoc(PUBLIC[name]) or ""
    assert text.count("\nExamples\n--------\n") == 1
    found = examples(name)
    assert any(example.want for example in found) or name == "archive.dyn.explore"
    assert not any(doctest.SKIP in example.options for example in found)


@pytest.mark.compiled
@pytest.mark.parametrize("name", sorted(PUBLIC))
def test_examples_are_true(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    test = doctest.DocTest(examples(name), {}, name, None, 0, None)
    results = doctest.DocTestRunner().run(test)
    assert results.failed == 0, capsys.readouterr().out
    assert results.attempted > 0


def test_the_page_lists_every_public_name() -> None:
    page = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
    for name in PUBLIC:
        if name.startswith(("sweeps.", "engine_dyn.")):
            assert f":: {name}\n" in page, name
    assert "autoclass:: sweeps.view.accessor.archive.ArchiveAccessor\n   :members:\n" in page
    assert "autoclass:: sweeps.view.accessor.archive.Plots\n" in page
