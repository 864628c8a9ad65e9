"""Write docs/gallery.md and its pictures: every kind of figure, and the commands that draw it.

The commands of the page are those that are run here, in a folder of their own. Run it from the
project's root: `python tools/gallery.py`, or with names of kinds to draw only these again; the page
is always written. All of them take some two minutes.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from PIL import Image

from sweeps.cli.main import main as engine_dyn
from sweeps.figures.kinds import KINDS

ROOT = Path(__file__).resolve().parents[1]
DOCUMENT = ROOT / "docs" / "gallery.md"
PICTURES = ROOT / "docs" / "gallery"
WIDTH, COLOURS = 900, 192
"""Of the pictures: pixels, and colours of their palettes."""


@dataclass(frozen=True)
class Entry:
    """How a kind of figure is drawn.

    Attributes
    ----------
    kind : str
        Its name in `KINDS`.
    scene : str
        Text of the scene.toml that the commands read; empty where they read none, or write it.
    commands : tuple of str
        What is run; empty where another tool draws the picture.
    made_by : str
        Page with the picture that another tool draws, as Markdown.
    picture : str
        Path of that picture in docs; of drawn ones, the beginning of the file's name where it is
        not the first that is drawn.
    """

    kind: str
    scene: str = ""
    commands: tuple[str, ...] = ()
    made_by: str = ""
    picture: str = ""


def drawn(kind: str, scene: str, options: str = "", picture: str = "", run: str = "") -> Entry:
    """Entry of a scene that is run and drawn: its text, or the name of a built-in one."""
    built_in = "\n" not in scene
    what = scene if built_in else "scene.toml"
    plot = f"engine-dyn plot out.nc --only {kind}{options and ' ' + options}"
    commands = (f"engine-dyn run {what} -o out.nc{run and ' ' + run}", plot)
    return Entry(kind, "" if built_in else scene, commands, picture=picture)


ONE_CYLINDER = """\
engine = "ntua"

[output]
quantities = ["torque", "gas_torque", "inertia_torque", "friction_torque", "load_torque", "omega"]
"""

LOADS = """\
engine = "ntua"

[axes]
load = [20, 50, 80]             # percent

[output]
quantities = ["pressure", "cylinder_volume", "torque", "omega"]
"""

FOUR = """\
engine = "si_four_87x101"

[set]
speed = 4000                    # rpm
load = 100                      # percent

[output]
quantities = [
    "gas_force", "inertia_force", "piston_force", "wall_thrust", "rod_force", "tangential_force",
    "radial_force", "crank_pin_x", "crank_pin_y", "main_journal_x", "main_journal_y",
]
"""

BEARINGS = """\
engine = "si_four_87x101"

[set]
load = 100                      # percent
crank_pin_diameter = 0.050      # m
crank_pin_width = 0.022
main_journal_diameter = 0.055
main_journal_width = 0.024

[axes]
speed = { start = 1000, stop = 6000, num = 26 }     # rpm

[output]
quantities = [
    "crank_pin_load_max", "crank_pin_load_mean", "main_journal_load_max", "main_journal_load_mean",
    "crank_pin_pressure_max", "crank_pin_pressure_mean",
    "main_journal_pressure_max", "main_journal_pressure_mean",
]
"""

FRICTION = """\
engine = "si_four_87x101"

[set]
friction_law = "patton_nitschke_heywood"

[axes]
speed = { start = 1000, stop = 6000, num = 26 }     # rpm

[output]
quantities = [
    "fmep_rings", "fmep_ring_gas_pressure", "fmep_skirt", "fmep_main_bearings",
    "fmep_crank_pin_bearings", "fmep_crankshaft_seals", "fmep_valve_train", "fmep_auxiliaries",
]
"""

RECORDINGS = "python -m benchmarks identification --write ."
"""Writes simulated recordings and scene.toml."""

GROUPS: dict[str, tuple[Entry, ...]] = {
    "The engine": (
        drawn("arrangement", """\
engine = "v8_cross_plane_93x86"

[output]
quantities = ["delta"]
"""),
        drawn("crank_star", """\
engine = "ntua"

[set]
cylinders = 6
arrangement = "in-line 6"

[output]
quantities = ["delta"]
"""),
        drawn("strokes", """\
engine = "si_four_87x101"

[output]
quantities = ["delta"]
"""),
        drawn("kinematics", """\
engine = "ntua"

[axes]
crank_ratio = [0.2, 0.25, 0.3333]

[output]
quantities = ["position", "velocity", "acceleration", "rod_angle"]
"""),
    ),
    "Pressure": (
        drawn("indicator_diagrams", LOADS),
        drawn("work_diagrams", LOADS),
        Entry("recorded_pressure", made_by="[Measured pressure](measured_pressure.md)",
              picture="figures/recorded_pressure.png"),
    ),
    "Torque and speed": (
        drawn("torque_components", ONE_CYLINDER),
        drawn("torque_and_speed", ONE_CYLINDER),
        drawn("turning_moment", ONE_CYLINDER),
        drawn("load_curves", LOADS),
        drawn("cylinders", """\
engine = "ntua"

[axes]
cylinders = [1, 2, 4, 6, 8]

[output]
quantities = ["torque", "omega"]
"""),
        drawn("curves", """\
engine = "ntua"

[axes]
inertia = [1, 2, 5, 12]         # kg m2

[output]
quantities = ["angular_acceleration"]
"""),
    ),
    "Orders": (
        drawn("orders", """\
engine = "ntua"

[axes]
cylinders = [1, 4, 6]

[output]
quantities = ["torque_order"]
"""),
        drawn("waterfall", "four_cylinder", "--select load=100"),
    ),
    "Forces, bearings and friction": (
        drawn("shaking", """\
engine = "v8_cross_plane_93x86"

[set]
cylinder_spacing = 0.11         # m

[output]
quantities = ["shaking_moment"]
"""),
        drawn("mechanism_forces", FOUR),
        drawn("crank_train", FOUR),
        drawn("bearing_polar", FOUR),
        drawn("bearing_loads", BEARINGS),
        drawn("bearing_pressures", BEARINGS),
        drawn("friction_components", FRICTION),
    ),
    "Results over the designs": (
        drawn("numbers", "inertia_speed", "--target delta=1/75", picture="delta_map"),
        drawn("outcomes", """\
engine = "ntua"

[axes]
inertia = { start = 0.1, stop = 2, num = 30, spacing = "log" }      # kg m2
speed = { start = 400, stop = 2000, num = 33 }                      # rpm

[output]
quantities = ["delta"]
"""),
        drawn("pareto", """\
engine = "ntua"

[sample]
method = "sobol"
number = 512
inertia = { low = 1, high = 12 }                # kg m2
rod_length = { low = 0.30, high = 0.45 }        # m
reciprocating_mass = { low = 5, high = 9 }      # kg

[output]
quantities = ["delta"]
"""),
        drawn("tornado", "thesis_elasticities", picture="tornado_delta"),
        drawn("uncertainty", """\
engine = "b112"

[output]
quantities = ["delta"]
""", run="--uncertainty"),
        Entry("sensitivities", """\
engine = "ntua"

[sample]
method = "saltelli"
number = 4096
inertia = { low = 1.5, high = 3.0 }
load = { low = 30, high = 70 }
speed = { low = 1100, high = 1300 }
bore = { low = 0.138, high = 0.142 }
rod_length = { low = 0.30, mode = 0.35, high = 0.45 }

[output]
quantities = ["delta"]
""", (
            "engine-dyn run scene.toml -o out.nc",
            "engine-dyn sensitivities out.nc -o indices.nc",
            "engine-dyn plot indices.nc --only sensitivities",
        )),
        Entry("firing_orders", "", (
            'engine-dyn firing-orders ntua --arrangement "in-line 6" --set cylinder_spacing=0.2 '
            "-o out.nc",
            "engine-dyn plot out.nc --only firing_orders",
        )),
        Entry("compared", """\
engine = "ntua"

[axes]
inertia = { start = 1.5, stop = 12, num = 25, spacing = "log" }     # kg m2

[solver]
inertia_model = "constant"      # in a second scene: "variable"

[output]
quantities = ["delta"]
""", (
            "engine-dyn run scene.toml -o constant.nc",
            "sed s/constant/variable/ scene.toml > second.toml",
            "engine-dyn run second.toml -o variable.nc",
            "engine-dyn compare constant.nc variable.nc --figures compared",
        )),
        drawn("published", "thesis"),
    ),
    "Measurements": (
        Entry("measured_speed", "", (
            RECORDINGS,
            "engine-dyn measured scene.toml -o out.nc",
            "engine-dyn plot out.nc --only measured_speed",
        ), picture="measured_speed"),
        Entry("fitted_speed", "", (
            RECORDINGS,
            "engine-dyn identify scene.toml --vary inertia,gap_angle,dead_centre_shift -o fit.nc",
            "engine-dyn plot fit.nc --only fitted_speed",
        ), picture="fitted_speed"),
        Entry("recorded_train", made_by="[Measured speed](measured_speed.md)",
              picture="figures/recorded_train.png"),
        Entry("cylinder_deviations", made_by="[Misfire detection](misfire_detection.md)",
              picture="figures/cylinder_deviations.png"),
    ),
}  # fmt: skip
"""Every kind, by subject."""

HEAD = """\
# Gallery

<!-- Made by python tools/gallery.py; change that, not this. -->

Every kind of figure, with the scene that gives it. Save the scene as scene.toml; unless other
commands stand there, two draw the figure (without `--only`, every kind that the archive gives):

```console
$ engine-dyn run scene.toml -o out.nc
$ engine-dyn plot out.nc --only KIND
```

Options for size, style, units and crank angle are in [figures](figures.md). Names such as
`four_cylinder` are [built-in scenes](scenes.md).
"""


def page() -> str:
    """Text of the gallery."""
    kinds = {kind.name: kind for kind in KINDS}
    parts = [HEAD]
    shown: dict[str, str] = {}
    for subject, entries in GROUPS.items():
        parts.append(f"## {subject}\n")
        for entry in entries:
            shows = kinds[entry.kind].shows
            shows = shows[0].upper() + shows[1:]
            parts.append(f"### `{entry.kind}`\n\n{shows}. It needs {kinds[entry.kind].needs}.\n")
            parts.append(f"![{entry.kind}]({picture_of(entry)})\n")
            if entry.made_by:
                parts.append(f"{entry.made_by} says how this recording is evaluated.\n")
            if entry.scene in shown:
                same = shown[entry.scene]
                parts.append(f"The scene is that of [`{same}`](#{same}).\n")
            elif entry.scene:
                shown[entry.scene] = entry.kind
                parts.append(f"```toml\n{entry.scene}```\n")
            if entry.commands and entry != drawn(entry.kind, entry.scene, picture=entry.picture):
                lines = "\n".join(f"$ {command}" for command in entry.commands)
                parts.append(f"```console\n{lines}\n```\n")
    return "\n".join(parts)


def picture_of(entry: Entry) -> str:
    """Path of its picture, from docs."""
    return entry.picture if entry.made_by else f"{PICTURES.name}/{entry.kind}.png"


def draw(entry: Entry, done: dict[Sequence[str], Path]) -> None:
    """Run the commands of an entry, and keep one of the pictures that they draw.

    `done` has the folders of commands that were run for other entries.
    """
    *first, last = entry.commands
    before = (entry.scene, *first)
    folder = done.get(before)
    if folder is None:
        folder = done[before] = Path(tempfile.mkdtemp(dir=done[()]))
        if entry.scene:
            (folder / "scene.toml").write_text(entry.scene, encoding="utf-8")
        for command in first:
            run_command(command, folder)
    known = set(folder.rglob("*.png"))
    run_command(last, folder)
    new = sorted(set(folder.rglob("*.png")) - known)
    print(f"{entry.kind}: {', '.join(path.stem for path in new)}")
    path = next(one for one in new if one.stem.startswith(entry.picture))
    in_width(path, WIDTH).quantize(COLOURS).save(PICTURES / f"{entry.kind}.png", optimize=True)


def in_width(path: Path, width: int) -> Image.Image:
    """A picture, scaled to a width in pixels."""
    with Image.open(path) as picture:
        height = round(picture.height * width / picture.width)
        return picture.convert("RGB").resize((width, height), Image.Resampling.LANCZOS)


def run_command(command: str, folder: Path) -> None:
    """Run a command in a folder."""
    program, *arguments = shlex.split(command)
    if program == "engine-dyn":
        with contextlib.chdir(folder), contextlib.redirect_stdout(io.StringIO()):
            engine_dyn(arguments, standalone_mode=False)
    elif program == "python":
        arguments = [str(folder) if part == "." else part for part in arguments]
        subprocess.run([sys.executable, *arguments], cwd=ROOT, check=True, capture_output=True)
    else:
        subprocess.run(command, shell=True, cwd=folder, check=True)


def main() -> None:
    parser = argparse.ArgumentParser(description="Write docs/gallery.md and its pictures.")
    parser.add_argument("kinds", nargs="*", help="draw only these again")
    wanted = parser.parse_args().kinds
    PICTURES.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        done: dict[Sequence[str], Path] = {(): Path(folder)}
        for entry in (entry for entries in GROUPS.values() for entry in entries):
            if entry.commands and (not wanted or entry.kind in wanted):
                draw(entry, done)
    DOCUMENT.write_text(page(), encoding="utf-8")
    print(f"written: {DOCUMENT.name}")


if __name__ == "__main__":
    main()
