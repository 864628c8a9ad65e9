"""The gallery: every kind of figure, drawn by the commands that stand beside it."""

from collections.abc import Callable, Sequence
from pathlib import Path

import pytest
import xarray as xr

from sweeps.view.figures import drawing
from sweeps.view.figures.kinds import KINDS, figures_of
from sweeps.view.figures.sheet import NamedFigures
from sweeps.view.figures.study import Study
from tests.support.figures import assert_filled, assert_inside, plates
from tests.support.tools import tool

gallery = tool("gallery")
misfire_map = tool("misfire_map")

ENTRIES = gallery.GALLERY
DRAWN = [entry for entry in ENTRIES if "made_by" not in entry]


def test_every_kind_is_in_the_gallery_once() -> None:
    assert sorted(entry["name"] for entry in ENTRIES) == sorted(kind.name for kind in KINDS)


def test_the_page_is_current() -> None:
    assert gallery.DOCUMENT.read_text(encoding="utf-8") == gallery.page()


MADE: dict[str, Callable[[], xr.Dataset]] = {
    "recorded_pressure": lambda: tool("recorded_figures").pressure(),
    "recorded_train": lambda: tool("recorded_figures").train(),
    "torsiogram": lambda: tool("recorded_figures").torsiogram(),
    "cylinder_deviations": lambda: misfire_map.example(misfire_map.Motor("si_four_87x101")),
}
"""What is drawn of recordings, by the tools of other pages, which simulate them."""


@pytest.mark.parametrize("name", [entry["name"] for entry in ENTRIES if "made_by" in entry])
def test_pictures_of_recordings_can_be_drawn_again(name: str) -> None:
    drawn = plates(MADE[name](), laid_out=True)
    assert name in drawn
    for stem, figure in drawn.items():
        assert_inside(stem, figure)


def filled(study: Study, only: Sequence[str] = ()) -> NamedFigures:
    """Figures of an archive, each of which must have something in all panels once it is drawn."""
    for stem, figure in figures_of(study, only):
        yield stem, figure
        assert_filled(stem, figure)


@pytest.mark.slow
def test_every_picture_can_be_drawn_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pictures = tmp_path / "pictures"
    pictures.mkdir()
    monkeypatch.setattr(gallery, "PICTURES", pictures)
    monkeypatch.setattr(drawing, "figures_of", filled)
    done: dict[tuple[str, ...], Path] = {}
    for entry in DRAWN:
        gallery.draw(entry, done, tmp_path)
        assert (pictures / f"{entry['name']}.png").is_file()
