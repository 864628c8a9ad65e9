"""Write docs/measured.md: recordings of a small generator engine beside what is computed for it.

The recordings have no licence and are no part of the project; whoever has a copy of them runs
`python tools/measured_speed.py FOLDER` from the project's root. They are known by their SHA-256
hashes, so names do not matter; `.gz` is unpacked. `--no-figures` leaves the figures alone. All
that is computed is computed by the commands that the document shows, in a folder of its own. It
takes some five minutes.
"""

from __future__ import annotations

import argparse
import gzip
import hashlib
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import xarray as xr
from csv_tables import as_csv

ROOT = Path(__file__).resolve().parents[1]
TEMPLATE = Path(__file__).with_suffix(".md.in")
DOCUMENT = ROOT / "docs" / "measured.md"
BESIDE = ROOT / "docs" / "measured"
RAW_FIGURE = ROOT / "docs" / "figures" / "measured_raw.png"
CORRECTED_FIGURE = ROOT / "docs" / "figures" / "measured_corrected.png"

RECORDINGS = {
    "first_none.txt": "840a58f6ef8b17e6821326f7d0075f3c880c7ba2fd565250d2908b805bddc9df",
    "first_half.txt": "7349d55a8dbdad0b20a9b5658bd0808fb9999d2d75bf149145e4c8141caf7c7f",
    "first_full.txt": "512999957fe1578709b313fe45a98d8060b9981fa21c63a49144d8e37d1f72bc",
    "second_none.txt": "6f15ae512b655c026b4f8c899d91a338a1e9cff010d122e068f8a2371defd3e7",
    "second_half.txt": "9d3502996a06076c13e3f222c2885aec3e5f8eba46f13c14a2ec91039ea7369d",
    "second_full.txt": "0390e9733a40021877764a3da87d697e0eb63184a080bdeeeb92394056d4e2b5",
    "second_motored.txt": "885dc953e2c04061191144ee17358279f22bb520b5af094edd07d9748b516989",
}
"""What the recordings are called here, and the SHA-256 hashes of their texts."""

DIAGRAMS = """
[[diagram]]                      # and so on for half and full load
kind = "points"
load = 0
file = "none.csv"
"""

LOADS = {"none": 0, "half": 50, "full": 100}
MASSES = (0.15, 0.25, 0.35)
MASS = 0.25
"""Assumed for all that does not depend on it [kg]."""

ENGINE = """\
name = "generator"
title = "Generator engine, 67 x 55 mm"
cycle = "four-stroke"

[values]
cylinders = 1
bore = 0.067
stroke = 0.055
rod_length = 0.084
reciprocating_mass = {mass}      # assumed, kg
speed = 3000
inertia = {inertia}
load = 100
load_exponent = 1
load_offset = 0
friction_constant = 0.2          # assumed, bar
crankcase_pressure = 1.0
friction_peak_pressure = 0.0
friction_mean_piston_speed = 0.0
"""

DIAGRAM = """
[[diagram]]
kind = "points"
load = {load}
file = "{file}"
"""

SCENE = """\
title = "Generator engine, measured"
engine = "engine.toml"
silenced_warnings = ["noise", "expansion_exponent"]

[designs]
load = [0, 50, 100]
speed = [3100, 3000, 2950]       # replaced by the measured ones

[solver]
closure = "cycle_time"
inertia_model = "variable"

[output]
quantities = ["delta", "torque_mean"]

[measured]
file = {files}
kind = "encoder"
wheel = "60-2"
gap_angle = {gap}
column = {column}
time_column = 1
at = {{ design = [1, 2, 3] }}
"""


@dataclass(frozen=True)
class Series:
    """Recordings of one day: columns, scale of the pressure, and where the wheel's gap is.

    Attributes
    ----------
    name : str
        Of the files.
    pressure, encoder : int
        Columns.
    calibration : str
        Bar per volt, bar at 0 V.
    gap : float
        First value of the crank angle of the first tooth after the gap [degree].
    gaps : dict of float
        Other values, with the words that say where they come from.
    """

    name: str
    pressure: int
    encoder: int
    calibration: str
    gap: float
    gaps: dict[str, float] = field(default_factory=dict)


SERIES = (
    Series(
        "first", 2, 3, "51.948,-29.87", -36.0,
        {"compression and expansion lines": -36.8, "peaks as in the second series": -30.0},
    ),
    Series(
        "second", 3, 2, "10.39,-21", 115.5,
        {"compression and expansion lines": 107.1, "motored run": 115.5},
    ),
)  # fmt: skip

WHOLE = "inertia,recording_shift"
"""What is fitted for the prediction that counts."""

LOW_ORDERS = 3.0
"""Up to which the crank is taken to be rigid where orders are looked at apart."""

LEFT_OUT = re.compile(r"^compiling kernels")


class Workshop:
    """A folder in which commands run."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def shell(self, command: str) -> str:
        """Run `engine-dyn ...`; its command line and what it prints."""
        code = "from sweeps.cli.main import main; main()"
        words = [sys.executable, "-c", code, *command.split()[1:]]
        done = subprocess.run(words, cwd=self.folder, capture_output=True, text=True, check=False)
        if done.returncode:
            raise RuntimeError(f"{command}: {done.returncode}: {done.stderr}")
        said = [*done.stdout.splitlines(), *done.stderr.splitlines()]
        return "\n".join([f"$ {command}", *(x for x in said if not LEFT_OUT.match(x))]).rstrip()

    def pressure(self, series: Series, load: str, gap: float) -> str:
        """Write the mean pressure of a recording over the crank angle."""
        return self.shell(
            f"engine-dyn import {series.name}_{load}.txt -o {load}.csv --overwrite "
            f"--pressure-column {series.pressure} --encoder-column {series.encoder} "
            f"--time-column 1 --wheel 60-2 --gap-angle={gap:g} --unit V "
            f"--calibration {series.calibration} --pegging inlet --inlet-pressure 1.0 "
            "--pegging-angle 330 --compression-ratio 8.5 --angle-step 0.5 --average "
            "--smoothing low_pass --highest-order 30"
        )

    def prepare(
        self, series: Series, gap: float, mass: float = MASS, inertia: float = 0.016
    ) -> dict[str, str]:
        """Pressures, engine and scene of a series with the gap at a crank angle."""
        said = {load: self.pressure(series, load, gap) for load in LOADS}
        engine = ENGINE.format(mass=mass, inertia=inertia) + "".join(
            DIAGRAM.format(load=value, file=f"{load}.csv") for load, value in LOADS.items()
        )
        (self.folder / "engine.toml").write_text(engine, encoding="utf-8")
        files = "[" + ", ".join(f'"{series.name}_{load}.txt"' for load in LOADS) + "]"
        scene = SCENE.format(files=files, gap=f"{gap:g}", column=series.encoder)
        (self.folder / "scene.toml").write_text(scene, encoding="utf-8")
        return said

    def identify(self, vary: str, more: str = "") -> tuple[str, xr.Dataset]:
        """Fit, and what was printed."""
        said = self.shell(
            f"engine-dyn identify scene.toml --vary {vary}{more} -o fit.nc --overwrite"
        )
        return said, xr.load_dataset(self.folder / "fit.nc")

    def measured(self) -> xr.Dataset:
        """Measured beside computed speeds."""
        self.shell("engine-dyn measured scene.toml -o measured.nc --overwrite")
        return xr.load_dataset(self.folder / "measured.nc")


def unpack(given: Path, folder: Path) -> None:
    """Copy the recordings into a folder, whatever they are called."""
    names = {digest: name for name, digest in RECORDINGS.items()}
    for path in sorted(given.rglob("*")):
        if path.suffix not in (".txt", ".gz", ".csv", ".dat") or not path.is_file():
            continue
        opened = gzip.open if path.suffix == ".gz" else open
        with opened(path, "rb") as file:
            data = file.read()
        name = names.pop(hashlib.sha256(data).hexdigest(), None)
        if name is not None:
            (folder / name).write_bytes(data)
    if names:
        missing = ", ".join(f"{name} (SHA-256 {digest})" for digest, name in names.items())
        raise SystemExit(f"{given}: recordings are missing: {missing}")


# --- what is compared -----------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Found:
    """All that the document says of a series."""

    series: Series
    imported: dict[str, str]
    fitted: str
    fit: xr.Dataset
    variants: list[tuple[str, xr.Dataset | str]]
    measured: dict[float, xr.Dataset]
    inertia: dict[float, float]

    @property
    def gap(self) -> float:
        """Crank angle of the first tooth after the gap, as fitted [degree]."""
        return self.series.gap + _value(self.fit, "recording_shift")


def _value(fit: xr.Dataset, name: str, part: str = "value") -> float:
    return float(fit[part].sel(parameter=name))


def examine(shop: Workshop, series: Series) -> Found:
    """All fits of a series."""
    imported = shop.prepare(series, series.gap)
    fitted, fit = shop.identify(WHOLE)
    variants = list(_variants(shop, series))
    gap = round(series.gap + _value(fit, "recording_shift"), 2)
    measured, inertia = {}, {}
    for mass in MASSES:
        shop.prepare(series, gap, mass)
        inertia[mass] = _value(shop.identify("inertia")[1], "inertia")
        shop.prepare(series, gap, mass, inertia[mass])
        measured[mass] = shop.measured()
    return Found(series, imported, fitted, fit, variants, measured, inertia)


def _variants(shop: Workshop, series: Series) -> Iterator[tuple[str, xr.Dataset | str]]:
    """Other choices, and what they give."""
    for words, gap in series.gaps.items():
        shop.prepare(series, gap)
        yield f"inertia; dead centre from {words}", _tried(shop, "inertia")
        yield (
            f"inertia and slope of the load torque; dead centre from {words}",
            _tried(shop, "inertia,load_offset"),
        )
    shop.prepare(series, series.gap)
    yield (
        "inertia and place of the wheel alone; pressures where they were imported",
        _tried(shop, "inertia,gap_angle"),
    )
    yield (
        "inertia, dead centre, and the pegging of each recording (0 +- 0.05 bar)",
        _tried(shop, f"{WHOLE},pegging", " --own pegging --prior pegging=0+-0.05"),
    )
    for mass in MASSES:
        if mass != MASS:
            shop.prepare(series, series.gap, mass)
            yield f"inertia and dead centre; mass {mass:g} kg", _tried(shop, WHOLE)


def _tried(shop: Workshop, vary: str, more: str = "") -> xr.Dataset | str:
    try:
        return shop.identify(vary, more)[1]
    except RuntimeError as error:
        return str(error).strip().rsplit(": ", 1)[-1]


# --- the document ---------------------------------------------------------------------------------


def _table(head: Sequence[str], rows: Sequence[Sequence[str]], left: int = 1) -> str:
    rule = ["---"] * left + ["---:"] * (len(head) - left)
    return "\n".join("| " + " | ".join(row) + " |" for row in [head, rule, *rows])


def predictions(found: Sequence[Found]) -> str:
    """Measured and predicted raw delta."""
    rows = []
    for one in found:
        scatter = one.measured[MASS].delta_of_cycles_std.values
        for place, load in enumerate(LOADS):
            fit = one.fit.isel(recording=place)
            raw, sure = float(fit.delta_measured_raw), float(fit.delta_measured_raw_uncertainty)
            said, unsure = float(fit.delta_predicted), float(fit.delta_predicted_deviation)
            apart = abs(said - raw) / np.hypot(sure, unsure)
            rows.append([
                one.series.name, load, f"{float(fit.speed):.0f}", f"{raw:.4f} ± {sure:.4f}",
                f"{scatter[place]:.4f}", f"{said:.4f} ± {unsure:.4f}",
                f"{100.0 * (said / raw - 1.0):+.1f}", f"{apart:.1f}",
            ])  # fmt: skip
    return _table(
        ["series", "load", "rpm", "raw δ, measured", "of single cycles", "predicted",
         "difference, %", "in standard errors"], rows, 2,
    )  # fmt: skip


def alternatives(found: Sequence[Found]) -> str:
    """The same with other choices."""
    rows = []
    for one in found:
        for words, fit in [("**inertia and dead centre** (as above)", one.fit), *one.variants]:
            if isinstance(fit, str):
                rows.append([one.series.name, words, f"refused: {fit}", "", "", "", "", ""])
                continue
            sloped = "load_offset" in fit.parameter.values
            off = 100.0 * (fit.delta_predicted / fit.delta_measured_raw - 1.0).values
            rows.append([
                one.series.name, words, *(f"{x:+.1f}" for x in off),
                f"{_value(fit, 'inertia'):.4f}",
                f"{_value(fit, 'load_offset'):.0f}" if sloped else "",
                f"{fit.attrs['reduced_chi_square']:.0f}",
            ])  # fmt: skip
    head = ["series", "fitted", *(f"{load}, %" for load in LOADS), "inertia, kg m²", "a, N m",
            "χ²"]  # fmt: skip
    return _table(head, rows, 2)


def corrected(found: Sequence[Found]) -> str:
    """Delta without the tooth errors, for the masses."""
    rows = []
    for one in found:
        for mass, data in one.measured.items():
            for place, load in enumerate(LOADS):
                here = data.isel(recording=place)
                known, sure, computed = (
                    float(here[name])
                    for name in ("delta_measured", "delta_measured_uncertainty", "delta")
                )
                rows.append([
                    one.series.name, f"{mass:g}", f"{one.inertia[mass]:.4f}", load,
                    f"{known:.4f} ± {sure:.4f}", f"{computed:.4f}",
                    f"{100.0 * (computed / known - 1.0):+.1f}",
                    f"{float(here.correlation):.3f}", f"{100.0 * float(here.rms_difference):.2f}",
                ])  # fmt: skip
    head = ["series", "mass, kg", "inertia, kg m²", "load", "corrected δ, measured", "computed",
            "difference, %", "correlation", "rms of the difference, %"]  # fmt: skip
    return _table(head, rows, 4)


def orders(found: Sequence[Found]) -> str:
    """Amplitudes of orders in percent of the mean speed."""
    rows = []
    for one in found:
        data = one.measured[MASS]
        mean = data.omega_mean_measured.values[:, None]
        for words, name in (("measured", "omega_measured_order"), ("computed", "omega_order")):
            share = 100.0 * data[name].transpose("recording", "order").values / mean
            for load, row in zip(LOADS, share, strict=True):
                rows.append([one.series.name, load, words, *(f"{x:.3f}" for x in row)])
    rows.sort(key=lambda row: (row[0], list(LOADS).index(row[1])))
    first = found[0].measured[MASS]
    return _table(["series", "load", "", *(f"{x:g}" for x in first.order.values)], rows, 3)


def of_low_orders(found: Sequence[Found]) -> str:
    """Delta of the orders 1/2 to 3 alone."""
    rows = []
    angle = np.deg2rad(np.arange(-360.0, 360.0, 0.5))
    for one in found:
        data = one.measured[MASS]
        low = data.order.values <= LOW_ORDERS
        waves = data.order.values[low, None] * angle
        for place, load in enumerate(LOADS):
            here = data.isel(recording=place)
            deltas = []
            for name in ("omega_measured", "omega"):
                size = here[f"{name}_order"].values[low, None]
                phase = np.deg2rad(here[f"{name}_phase"].values[low, None])
                curve = np.sum(size * np.cos(waves + phase), axis=0)
                deltas.append(float(np.ptp(curve) / here.omega_mean_measured))
            known, computed = deltas
            rows.append([
                one.series.name, load, f"{known:.4f}", f"{computed:.4f}",
                f"{100.0 * (computed / known - 1.0):+.1f}",
            ])  # fmt: skip
    return _table(["series", "load", "measured", "computed", "difference, %"], rows, 2)


def fitted(found: Sequence[Found]) -> str:
    """Fitted values of both series."""
    rows = []
    for one in found:
        low, high = (_value(one.fit, "inertia", f"value_{end}") for end in ("low", "high"))
        shift = [_value(one.fit, "recording_shift", f"value{end}") for end in ("_low", "_high")]
        rows.append([
            one.series.name, f"{_value(one.fit, 'inertia'):.4f} ({low:.4f} to {high:.4f})",
            f"{one.gap:.1f} ({one.series.gap + shift[0]:.1f} to {one.series.gap + shift[1]:.1f})",
            *(f"{gap:.1f}" for gap in one.series.gaps.values()),
            f"{one.fit.attrs['condition_number']:.0f}",
            f"{one.fit.attrs['reduced_chi_square']:.0f}",
        ])  # fmt: skip
    head = ["series", "inertia, kg m²", "gap angle from the speeds, degree",
            "from the lines of compression and expansion", "from the motored run",
            "condition number", "χ²"]  # fmt: skip
    return _table(head, rows)


def written(found: Sequence[Found], motored: str) -> dict[str, str]:
    """Texts of the page and of the files beside it, by their names."""
    fits = "\n".join(f"# the {one.series.name} series\n{one.fitted}" for one in found)
    return {
        "predictions": predictions(found),
        "alternatives": alternatives(found),
        "corrected": corrected(found),
        "orders": orders(found),
        "low_orders": of_low_orders(found),
        "fitted": fitted(found),
        "engine": ENGINE.format(mass=MASS, inertia=0.016).rstrip(),
        "scene": SCENE.format(
            files='["first_none.txt", "first_half.txt", "first_full.txt"]', gap="-36", column=3
        ).rstrip(),
        "commands": f"{found[0].imported['full']}\n\n{fits}\n\n# the motored run\n{motored}",
        "recordings": _table(
            ["recording", "SHA-256"], [[f"`{name}`", f"`{digest}`"] for name, digest in
                                       RECORDINGS.items()], 2,
        ),
    }  # fmt: skip


def documents(values: dict[str, str]) -> dict[Path, str]:
    """The page, and the files beside it: tables as CSV, the rest as it is."""
    page = TEMPLATE.read_text("utf-8").replace("{{ predictions }}", values["predictions"])
    made = {DOCUMENT: page}
    for name in ("alternatives", "corrected", "orders", "low_orders", "fitted", "recordings"):
        made[BESIDE / f"{name}.csv"] = as_csv(values[name])
    made[BESIDE / "engine.toml"] = f"{values['engine']}\n{DIAGRAMS}"
    made[BESIDE / "scene.toml"] = values["scene"] + "\n"
    made[BESIDE / "commands.txt"] = values["commands"].rstrip() + "\n"
    return made


# --- figures --------------------------------------------------------------------------------------


def draw(found: Sequence[Found], corrected_ones: bool) -> None:
    """Measured and computed mean speeds from tooth to tooth, every six degrees."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    with mpl.rc_context({"font.size": 8.0, "axes.spines.top": False, "axes.spines.right": False}):
        figure = Figure(figsize=(10.0, 5.2), layout="constrained")
        panels = figure.subplots(len(found), len(LOADS), sharex=True, sharey=True)
        for row, one in zip(panels, found, strict=True):
            data = one.measured[MASS]
            for place, (load, panel) in enumerate(zip(LOADS, row, strict=True)):
                if corrected_ones:
                    angle = data.interval.values
                    used = data.interval_used.values == 1
                    shown = data.omega_corrected.values[place]
                    said = data.omega_between_teeth.values[place]
                    words = ("measured, tooth errors taken out", "computed")
                else:
                    angle = one.fit.interval.values
                    shown = one.fit.omega_raw.values[place]
                    said = one.fit.omega_predicted.values[place]
                    used = np.isfinite(said)
                    words = ("measured, mean of the cycles", "predicted from the other loads")
                for speed, style, label in (
                    (shown, {"ls": "", "marker": ".", "ms": 3.0, "color": "0.25"}, words[0]),
                    (said, {"lw": 1.1, "color": "tab:red"}, words[1]),
                ):
                    # Lines break where an interval does not count.
                    percent = np.where(used, 100.0 * (speed / speed[used].mean() - 1.0), np.nan)
                    panel.plot(angle, percent, label=label, **style)
                panel.set_title(f"{one.series.name} series, load: {load}")
                panel.set_xticks(range(-360, 361, 180))
                panel.grid(lw=0.3, color="0.85")
            row[0].set_ylabel("speed less its mean, %")
        for panel in panels[-1]:
            panel.set_xlabel("crank angle after firing dead centre, degree")
        handles, labels = panels[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=2, frameon=False)
        path = CORRECTED_FIGURE if corrected_ones else RAW_FIGURE
        figure.savefig(path, dpi=150, metadata={"Software": None})


def main() -> None:
    """Write the document and the figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="a copy of the recordings")
    parser.add_argument("--no-figures", action="store_true", help="leave the figures alone")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        unpack(given.folder, folder)
        shop = Workshop(folder)
        found = [examine(shop, series) for series in SERIES]
        motored = shop.shell(
            "engine-dyn import second_motored.txt -o motored.csv --pressure-column 3 "
            "--encoder-column 2 --time-column 1 --wheel 60-2 --gap-angle=115.5 --unit V "
            "--calibration 10.39,-28 --pegging inlet --inlet-pressure 1.0 --pegging-angle=-180 "
            "--compression-ratio 8.5 --angle-step 0.5 --average"
        )
    BESIDE.mkdir(exist_ok=True)
    for path, text in documents(written(found, motored)).items():
        path.write_text(text, encoding="utf-8")
    if not given.no_figures:
        draw(found, corrected_ones=False)
        draw(found, corrected_ones=True)


if __name__ == "__main__":
    main()
