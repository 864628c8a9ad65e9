"""Write docs/gallery.md, its pictures, and the figures of other pages that commands draw.

What is drawn, and by which commands, is in tools/gallery.toml; the commands of the page are those
that are run here, in a folder of their own. Run it from the project's root:
`python tools/gallery.py`, or with names of pictures to draw only these again; the page is always
written. All of them take some four minutes. Other figures belong to one page, and its tool
draws them: `grep -l NAME tools/*.py` finds it.
"""

from __future__ import annotations

import argparse
import re
import tempfile
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pages import DOCS, FIGURES, filled, keep_picture, run_command, write

from sweeps.view.figures.kinds import KINDS

DOCUMENT = DOCS / "gallery.md"
PICTURES = DOCS / "gallery"

Entry = Mapping[str, Any]
"""A picture.

Its keys: `name`; `scene`, the text of the scene.toml that the commands read, or `scene_of`, the
entry or the page that has it; `files_of`, a page whose named files the commands read; `commands`,
where the two usual ones do not draw it; `files`, how
the names of the drawn files begin that are kept, one below the other; `made_by`, the page whose
tool draws it.
"""

LISTS: dict[str, list[Any]] = tomllib.loads(
    Path(__file__).with_suffix(".toml").read_text(encoding="utf-8")
)
GALLERY: list[Entry] = [one for subject in LISTS["subject"] for one in subject["picture"]]


def page() -> str:
    """Text of the gallery."""
    kinds = {kind.name: kind for kind in KINDS}
    parts: list[str] = []
    for subject in LISTS["subject"]:
        parts.append(f"## {subject['title']}\n")
        for entry in subject["picture"]:
            name = entry["name"]
            shows = kinds[name].shows[0].upper() + kinds[name].shows[1:]
            parts.append(f"### `{name}`\n\n{shows}; needs {kinds[name].needs}.\n")
            parts.append(f"![{name}]({picture_of(entry).relative_to(DOCS)})\n")
            if "made_by" in entry:
                parts.append(f"{entry['made_by']} evaluates this recording.\n")
            if same := entry.get("scene_of"):
                parts.append(f"Scene of [`{same}`](#{same}).\n")
            if "scene" in entry:
                parts.append(f"```toml\n{entry['scene']}```\n")
            if "commands" in entry:
                lines = "\n".join(f"$ {command}" for command in entry["commands"])
                parts.append(f"```console\n{lines}\n```\n")
    template = Path(__file__).with_suffix(".md.in").read_text(encoding="utf-8")
    return filled(template, {"pictures": "\n".join(parts)})


def picture_of(entry: Entry) -> Path:
    """Path of its picture; figures of other pages lie beside each other."""
    drawn_here = entry in GALLERY and "made_by" not in entry
    return (PICTURES if drawn_here else FIGURES) / f"{entry['name']}.png"


def scene_of(entry: Entry) -> str:
    """Text of its scene.toml: its own, of another entry, or the first whole one of a page."""
    place = entry.get("scene_of", "")
    if not place.endswith(".md"):
        return str(entry.get("scene") or next(
            (one["scene"] for one in GALLERY if one["name"] == place), ""
        ))  # fmt: skip
    text = (DOCS / place).read_text(encoding="utf-8")
    blocks = re.findall(r"^```toml\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    return next(block for block in blocks if block.startswith("engine = "))


def draw(entry: Entry, done: dict[tuple[str, ...], Path], among: Path) -> None:
    """Run the commands of an entry, and keep the pictures that its last one draws.

    `done` has the folders, in the folder `among`, of commands that were run for other entries.
    """
    plot = f"engine-dyn plot out.nc --only {entry['name']}"
    *first, last = entry.get("commands", ["engine-dyn run scene.toml -o out.nc", plot])
    page = entry.get("files_of", "")
    before = (page, scene_of(entry), *first)
    folder = done.get(before)
    if folder is None:
        folder = done[before] = Path(tempfile.mkdtemp(dir=among))
        if scene_of(entry):
            (folder / "scene.toml").write_text(scene_of(entry), encoding="utf-8")
        text = (DOCS / page).read_text(encoding="utf-8") if page else ""
        for block, name in re.findall(r"^```toml\n(# (\S+\.toml)\n.*?)^```", text, re.M | re.S):
            (folder / name).write_text(block, encoding="utf-8")
        for command in first:
            run_command(command, folder)
    for path in folder.rglob("*.png"):
        path.unlink()
    run_command(last, folder)
    new = sorted(folder.rglob("*.png"))
    print(f"{entry['name']}: {', '.join(path.stem for path in new)}")
    kept = [next(p for p in new if p.stem.startswith(one)) for one in entry.get("files", [""])]
    keep_picture(kept, picture_of(entry))


def main() -> None:
    parser = argparse.ArgumentParser(description="Write docs/gallery.md, and draw pictures.")
    parser.add_argument("names", nargs="*", help="draw only these again")
    wanted = parser.parse_args().names
    with tempfile.TemporaryDirectory() as folder:
        done: dict[tuple[str, ...], Path] = {}
        for entry in [*GALLERY, *LISTS["figure"]]:
            if "made_by" not in entry and (not wanted or entry["name"] in wanted):
                draw(entry, done, Path(folder))
    write({DOCUMENT: page()})


if __name__ == "__main__":
    main()
