"""Write docs/data_sheet.md: from a data sheet to delta, as a user would.

Every command of the document is run in an empty folder. Run it from the project's root:
`python tools/data_sheet.py`; `--no-figures` leaves the figure alone.
"""

from __future__ import annotations

import re
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pandas as pd
from pages import DOCS, FIGURES, csv_text, figures_wanted, filled, markdown, run_command, write

import sweeps

TEMPLATE = Path(__file__).with_suffix(".md.in")
DOCUMENT = DOCS / "data_sheet.md"
BESIDE = DOCS / "data_sheet"

Rows = list[list[str]]
"""A table as rows of cells, heads first."""

POWER, SPEED, BORE, STROKE = 36.4, 2700, 87.0, 102.4
"""Data sheet of the Kubota V2403: kW, rpm, mm, mm; four cylinders in line."""

EDITS = {
    "name": '"v2403"',
    "title": '"Kubota V2403, in-line four, 87/102.4 mm, from its data sheet"',
    "bore": "0.087                            # m",
    "stroke": "0.1024                         # m",
}
"""Lines of the file that `new --engine` writes, each with the line that replaces it."""

COMMANDS = {
    "new_engine": "engine-dyn new --engine v2403.toml",
    "calibrate": "engine-dyn calibrate v2403.toml --power 36.4kW --speed 2700rpm "
    "--kind diesel -o v2403_fitted.toml",
    "new_scene": "engine-dyn new flywheel.toml --for v2403_fitted.toml",
    "run": "engine-dyn run flywheel.toml -o flywheel.nc",
    "export": "engine-dyn export flywheel.nc -o flywheel.csv",
}
"""The five commands of the page, in their order."""

REFUSED = "engine-dyn calibrate v2403.toml --power 80kW --speed 2700rpm -o other.toml"
PLOT = "engine-dyn plot flywheel.nc -o figures"

WIDTH = 150
"""Characters that are shown of an output line; refusals are shown whole."""


def shell(command: str, folder: Path, status: int = 0) -> str:
    """Run `engine-dyn ...` in a folder; its command line and what it prints."""
    said, refused = run_command(command, folder, status)
    if status:
        return f"$ {command}\n{refused.rstrip()}"
    lines = said.splitlines()
    kept = [line if len(line) <= WIDTH else f"{line[:WIDTH]} [...]" for line in lines]
    return "\n".join([f"$ {command}", *kept]).rstrip()


def edited(text: str) -> str:
    """Text of the template as the document tells its reader to change it."""
    for key, value in EDITS.items():
        text, count = re.subn(rf"(?m)^{key} = .*$", f"{key} = {value}", text)
        if count != 1:
            raise ValueError(f"{key}: {count} lines")
    return text


def session(folder: Path) -> dict[str, str]:
    """Run the commands one after the other."""
    found = {}
    for name, command in COMMANDS.items():
        found[name] = shell(command, folder)
        if name == "new_engine":
            path = folder / "v2403.toml"
            path.write_text(edited(path.read_text("utf-8")), encoding="utf-8")
    return found


# --- effect of the assumptions --------------------------------------------------------------------


def fluctuation(
    folder: Path, values: dict[str, float], cycle: dict[str, float], **given: Any
) -> tuple[float, float]:
    """Delta at full load and at 10 percent with these values and options."""
    text = (folder / "v2403.toml").read_text("utf-8")
    lines = "".join(f"{key} = {value}\n" for key, value in values.items())
    text = text.replace("cylinders = 4\n", f"cylinders = 4\n{lines}", 1)
    text += "[data_sheet.cycle]\n" + "".join(f"{k} = {v}\n" for k, v in cycle.items())
    (folder / "changed.toml").write_text(text, encoding="utf-8")
    made = sweeps.calibrate(folder / "changed.toml", power=POWER, speed=SPEED, loads=[10], **given)
    path = folder / "changed_fitted.toml"
    path.write_text(made.text, encoding="utf-8")
    archive = sweeps.run(
        engine=str(path), axes={"load": [10, 100]}, output={"quantities": ["delta"]}
    )
    low, full = archive["delta"].values.tolist()
    return full, low


def variations(made: Any) -> Iterator[tuple[str, dict[str, float], dict[str, float], Any]]:
    """Assumptions that are changed: words, [values], [data_sheet.cycle] and options."""
    values = made.values
    for peak in (55.0, 75.0, 90.0):
        yield f"largest pressure {peak:g} bar", {}, {}, {"peak": peak}
    for ratio in (16.0, 22.0):
        yield f"compression ratio {ratio:g}", {}, {"compression_ratio": ratio}, {}
    for duration in (60.0, 100.0):
        yield f"combustion of {duration:g} degrees", {}, {"combustion_duration": duration}, {}
    yield "fuel consumption 260 g/kWh", {}, {}, {"fuel_consumption": 260.0}
    for factor in (0.75, 1.25):
        masses = {k: round(factor * values[k], 4) for k in ("piston_mass", "rod_mass")}
        yield f"masses of piston and rod x {factor:g}", masses, {}, {}
    for ratio in (0.25, 0.33):
        yield f"crank ratio {ratio:g}", {"crank_ratio": ratio}, {}, {}
    for factor in (0.5, 1.5):
        names = ("friction_constant", "friction_peak_pressure", "friction_mean_piston_speed")
        yield f"friction x {factor:g}", {k: round(factor * values[k], 6) for k in names}, {}, {}
    for exponent in (0.0, 1.0):
        yield f"load exponent {exponent:g}", {"load_exponent": exponent}, {}, {}
    for factor in (0.8, 1.25):
        inertia = round(factor * values["inertia"], 4)
        yield f"inertia x {factor:g}", {"inertia": inertia}, {}, {}


def sensitivities(folder: Path, made: Any) -> tuple[Rows, float, float]:
    """Table of what each assumption does, and delta without a change."""
    full, low = fluctuation(folder, {}, {})
    rows = [["assumption", "δ at full load", "δ at 10 percent"]]
    for words, values, cycle, given in variations(made):
        found = fluctuation(folder, values, cycle, **given)
        changes = zip(found, (full, low), strict=True)
        rows.append([words, *(f"{100.0 * (new / old - 1.0):+.1f} %" for new, old in changes)])
    return rows, full, low


def strongest(rows: Rows, number: int = 6) -> Rows:
    """The rows of a table of changes that change delta most, in its order."""
    heads, *body = rows

    def size(row: list[str]) -> float:
        return max(abs(float(cell.removesuffix(" %"))) for cell in row[1:])

    kept = sorted(body, key=size, reverse=True)[:number]
    return [heads, *(row for row in body if row in kept)]


def shortened(printed: str) -> str:
    """Printed output of `calibrate`, without the assumed values."""
    lines = printed.splitlines()
    first = next(n for n, line in enumerate(lines) if line.startswith("assumed, "))
    last = next(n for n, line in enumerate(lines) if n > first and not line)
    return "\n".join([*lines[: first + 1], "  ...", *lines[last:]])


# --- the document ---------------------------------------------------------------------------------


def delta_table(folder: Path) -> Rows:
    """Delta over load and inertia, every eighth inertia."""
    rows = pd.read_csv(folder / "flywheel.csv").pivot(index="load", columns="inertia")["delta"]
    kept = rows.iloc[:, ::8]
    body = [[f"{load:g}", *(f"{d:.5f}" for d in deltas)] for load, *deltas in kept.itertuples()]
    return [["load, percent", *(f"{i:.3g} kg m²" for i in kept.columns)], *body]


def main() -> None:
    figures = figures_wanted(__doc__.splitlines()[0])
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        parts = session(folder)
        parts["refused"] = shell(REFUSED, folder, status=2)
        parts["edits"] = "\n".join(f"{key} = {value}" for key, value in EDITS.items())
        parts["delta_table"] = markdown(delta_table(folder))
        parts["calibrate_short"] = shortened(calibrated := parts.pop("calibrate"))
        made = sweeps.calibrate(folder / "v2403.toml", power=POWER, speed=SPEED, loads=[10])
        table, full, low = sensitivities(folder, made)
        parts["strongest"] = markdown(strongest(table))
        parts |= {"delta_full": f"{full:.5f}", "delta_low": f"{low:.5f}"}
        parts |= {
            "bore": f"{BORE:g}", "stroke": f"{STROKE:g}", "power": f"{POWER:g}",
            "speed": f"{SPEED:g}", "inertia": f"{made.values['inertia']:g}",
        }  # fmt: skip
        if figures:
            shell(PLOT, folder)
            shutil.copy(folder / "figures" / "delta_inertia.png", FIGURES / "data_sheet.png")
    write({
        DOCUMENT: filled(TEMPLATE.read_text(encoding="utf-8"), parts),
        BESIDE / "calibrate.txt": calibrated + "\n",
        BESIDE / "assumptions.csv": csv_text(table),
    })  # fmt: skip


if __name__ == "__main__":
    main()
