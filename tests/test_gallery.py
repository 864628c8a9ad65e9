"""The gallery: every kind of figure, drawn by the commands that stand beside it."""

from pathlib import Path

import pytest

from sweeps.view.figures.kinds import KINDS
from tests.support.tools import tool

gallery = tool("gallery")

ENTRIES = gallery.GALLERY
DRAWN = [entry for entry in ENTRIES if "made_by" not in entry]


def test_every_kind_is_in_the_gallery_once() -> None:
    assert sorted(entry["name"] for entry in ENTRIES) == sorted(kind.name for kind in KINDS)


def test_the_page_is_current() -> None:
    assert gallery.DOCUMENT.read_text(encoding="utf-8") == gallery.page()


@pytest.mark.slow
def test_every_picture_can_be_drawn_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pictures = tmp_path / "pictures"
    pictures.mkdir()
    monkeypatch.setattr(gallery, "PICTURES", pictures)
    done: dict[tuple[str, ...], Path] = {}
    for entry in DRAWN:
        gallery.draw(entry, done, tmp_path)
        assert (pictures / f"{entry['name']}.png").is_file()
