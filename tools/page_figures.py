"""Draw the figures of pages that the commands of the page draw, into docs/figures.

Scenes are read from the pages. Run it from the project's root: `python tools/page_figures.py`, or
with names of figures to draw only these. All of them take some two minutes. Figures that other
tools draw are not made here: `grep -l NAME.png tools/*.py` finds their tool.
"""

from __future__ import annotations

import argparse
import re
import tempfile
from dataclasses import dataclass
from pathlib import Path

from gallery import in_width, run_command
from PIL import Image

ROOT = Path(__file__).resolve().parents[1]
PICTURES = ROOT / "docs" / "figures"
WIDTH, COLOURS = 900, 256
"""Of a picture: pixels, and colours of its palette."""


@dataclass(frozen=True)
class Entry:
    """How a figure is drawn.

    Attributes
    ----------
    name : str
        Of the picture.
    commands : tuple of str
        What is run, in a folder of its own; the last one draws.
    files : tuple of str
        Beginnings of the names of the drawn files; several are put one below the other.
    page : str
        Page whose first scene is `scene.toml`; empty where the commands need none.
    scene : str
        Text of `scene.toml` that no page has.
    """

    name: str
    commands: tuple[str, ...]
    files: tuple[str, ...]
    page: str = ""
    scene: str = ""


B112 = """\
engine = "b112"

[axes]
speed = { start = 1500, stop = 3000, num = 6 }

[output]
quantities = ["delta"]
"""

IN_LINE_SIX = 'engine-dyn firing-orders ntua --arrangement "in-line 6" --set cylinder_spacing=0.2'

ENTRIES = (
    Entry("tornado_delta",
          ("engine-dyn run scene.toml -o study.nc", "engine-dyn plot study.nc --only tornado"),
          ("tornado_delta",), page="elasticities"),
    Entry("sensitivities_delta",
          ("engine-dyn run scene.toml -o ten.nc", "engine-dyn sensitivities ten.nc -o indices.nc",
           "engine-dyn plot indices.nc"),
          ("sensitivities_delta",), page="sensitivities"),
    Entry("uncertainty_delta",
          ("engine-dyn run scene.toml --uncertainty -o out.nc",
           "engine-dyn plot out.nc --only numbers"),
          ("delta",), scene=B112),
    Entry("firing_orders_six",
          (f"{IN_LINE_SIX} -o six.nc", "engine-dyn plot six.nc --only firing_orders"),
          ("firing_orders",)),
    Entry("firing_orders_any",
          (f"{IN_LINE_SIX} --crank any -o any.nc", "engine-dyn plot any.nc --only firing_orders"),
          ("firing_orders",)),
    Entry("tangential_pressures",
          ("engine-dyn run rakopoulos_two_stroke -o charts.nc", "engine-dyn plot charts.nc"),
          ("tangential_pressure",)),
    Entry("shaking_force_parts",
          ("engine-dyn run asgari_forces -o forces.nc", "engine-dyn plot forces.nc"),
          ("shaking_force_parts",)),
    Entry("identification",
          ("python -m benchmarks identification --write .",
           "engine-dyn identify scene.toml --vary inertia,gap_angle,dead_centre_shift -o fit.nc",
           "engine-dyn plot fit.nc --only fitted_speed"),
          ("fitted_speed", "fit_residuals", "fit_delta")),
)  # fmt: skip


def scene_of(page: str) -> str:
    """First block of TOML in a page that is a whole scene."""
    text = (ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```toml\n(.*?)^```", text, re.M | re.S)
    return next(block for block in blocks if block.startswith("engine = "))


def draw(entry: Entry) -> None:
    """Run the commands of an entry and keep what they draw."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        scene = entry.scene or (scene_of(entry.page) if entry.page else "")
        if scene:
            (folder / "scene.toml").write_text(scene, encoding="utf-8")
        for command in entry.commands:
            run_command(command, folder)
        drawn = sorted(folder.rglob("*.png"))
        print(f"{entry.name}: {', '.join(path.stem for path in drawn)}")
        parts = [
            in_width(next(one for one in drawn if one.stem.startswith(beginning)), WIDTH)
            for beginning in entry.files
        ]
    whole = Image.new("RGB", (WIDTH, sum(part.height for part in parts)), "white")
    top = 0
    for part in parts:
        whole.paste(part, (0, top))
        top += part.height
    whole.quantize(COLOURS).save(PICTURES / f"{entry.name}.png", optimize=True)


def main() -> None:
    """Draw all figures, or the named ones."""
    parser = argparse.ArgumentParser(description="Draw the figures of pages.")
    parser.add_argument("names", nargs="*", help="draw only these")
    names = parser.parse_args().names
    unknown = set(names) - {entry.name for entry in ENTRIES}
    if unknown:
        parser.error(f"no such figure: {', '.join(sorted(unknown))}")
    for entry in ENTRIES:
        if not names or entry.name in names:
            draw(entry)


if __name__ == "__main__":
    main()
