"""Options of figures: kinds by name, targets, size, crank angle, style, a panel of one's own."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure
from numpy.testing import assert_allclose

from sweeps.errors import SceneError
from sweeps.figures.drawing import figure, figures, kinds_of
from sweeps.figures.kinds import KINDS
from sweeps.figures.options import Options, options_of
from sweeps.presenting.readable_dataset import readable_dataset

DOCUMENT = Path(__file__).parents[2] / "docs" / "gallery.md"


def archive() -> xr.Dataset:
    angle = np.arange(-360.0, 360.0, 10.0)
    phi, inertia = np.radians(angle), np.array([1.0, 2.0, 4.0])
    wave = np.cos(phi)[None, :] / inertia[:, None]
    names = ("inertia", "crank_angle")
    data = xr.Dataset(
        {
            "torque": (names, 100.0 * wave, {"long_name": "torque", "units": "N m"}),
            "omega": (names, 100.0 + wave,
                      {"long_name": "crank speed", "symbol": r"$\omega$", "units": "rad s-1"}),
            "delta": ("inertia", 0.02 / inertia, {"long_name": "fluctuation", "units": "1"}),
        },
        coords={
            "inertia": ("inertia", inertia, {"units": "kg m2"}),
            "crank_angle": ("crank_angle", angle, {"long_name": "crank angle", "units": "degree"}),
        },
        attrs={"engine_title": "A test engine (of nobody)", "parameters": '{"speed": 955}'},
    )  # fmt: skip
    return data


def test_one_kind_is_a_figure_that_names_engine_and_speed() -> None:
    drawn = figure(archive(), "torque_and_speed")
    said = " ".join(text.get_text() for text in drawn.texts)
    assert "A test engine" in said and "nobody" not in said
    assert "955\N{NO-BREAK SPACE}rpm" in said
    assert set(figures(archive(), options_of(only="numbers"))) == {"delta_inertia"}
    given = {kind.name for kind, names in kinds_of(archive()) if names}
    assert {"torque_and_speed", "numbers"} <= given and "shaking" not in given


@pytest.mark.parametrize(
    ("kind", "more", "said"),
    [
        ("numberz", {}, "did you mean 'numbers'"),
        ("shaking", {}, "needs shaking_force or shaking_moment"),
        ("turning_moment", {"ax": Figure().add_subplot()}, "2 panels"),
        ("torque_and_speed", {"options": Options(angle=(0.0, 360.0))}, "720 degrees"),
        ("numbers", {"options": options_of(target="delt=1")}, "did you mean 'delta'"),
    ],
)
def test_figures_that_cannot_be_are_bad_input(kind: str, more: dict, said: str) -> None:
    with pytest.raises(SceneError, match=said):
        figure(archive(), kind, **more)


def test_targets_are_lines_with_their_text_in_a_panel_of_ones_own() -> None:
    mine = Figure()
    panel = mine.add_subplot()
    drawn = figure(archive(), "numbers", options_of(target="delta=1/200"), ax=panel)
    assert drawn is mine and "luctuation" in panel.get_title(loc="left")
    assert [0.005, 0.005] in [list(line.get_ydata()) for line in panel.get_lines()]
    legends = [*drawn.legends, panel.get_legend()]
    assert "1/200" in " ".join(t.get_text() for one in legends if one for t in one.get_texts())


def test_size_and_style(tmp_path: Path) -> None:
    drawn = figure(archive(), "numbers", options_of(size="160x100", style={"axes.facecolor": "k"}))
    assert drawn.get_size_inches() * 25.4 == pytest.approx([160.0, 100.0])
    assert drawn.axes[0].get_facecolor() == (0.0, 0.0, 0.0, 1.0)
    style = tmp_path / "tight.mplstyle"  # which must leave a figure its size
    style.write_text("savefig.bbox: tight\nsavefig.pad_inches: 20\nfont.size: 9\n")
    assert set(options_of(style=style).style) == {"savefig.pad_inches", "font.size"}


@pytest.mark.parametrize(
    ("angle", "zero", "peak"),
    [("0..720", "firing-tdc", [0.0, 360.0, 720.0]), (None, "bdc", [180.0, 540.0])],
)
def test_the_crank_angle_is_counted_as_asked(angle: str | None, zero: str, peak: list) -> None:
    options = options_of(angle=angle, zero=zero)
    panel = figure(archive().isel(inertia=0), "torque_and_speed", options).axes[0]
    line = next(one for one in panel.get_lines() if len(one.get_xdata()) > 50)
    x, y = np.asarray(line.get_xdata()), np.asarray(line.get_ydata())
    assert (x[0], x[-1]) == (0.0, 720.0)
    assert list(x[y > 99.99]) == peak


@pytest.mark.parametrize(
    "given",
    [{"size": "5x5"}, {"size": "big"}, {"angle": "0..100"}, {"zero": "here"}, {"target": "delta"},
     {"target": "delta=1/0"}, {"style": "no such style"}, {"style": {"no.key": 1}}],
)  # fmt: skip
def test_bad_options_are_bad_input(given: dict) -> None:
    with pytest.raises(SceneError, match=next(iter(given))):
        options_of(**given)


@pytest.mark.parametrize(
    ("key", "value", "allowed"),
    [(key, dots, "1 to 1200") for key in ("figure.dpi", "savefig.dpi")
     for dots in ("6000", "0.5", "nan")]
    + [("font.size", "1e6", "1 to 500 points"), ("font.size", "0", "1 to 500 points"),
     ("font.size", "nan", "1 to 500 points"), ("axes.labelsize", "501", "0 to 500 points"),
     ("lines.markersize", "1e8", "0 to 500 points"), ("grid.linewidth", "1e9", "0 to 500 points"),
     ("axes.labelpad", "-1e9", "-500 to 500 points"), ("xtick.major.size", "1e6", "0 to 500 poi")],
)  # fmt: skip
def test_dots_and_sizes_have_limits(key: str, value: str, allowed: str, tmp_path: Path) -> None:
    (tmp_path / "big.mplstyle").write_text(f"{key}: {value}\n")
    for style in (tmp_path / "big.mplstyle", {key: float(value)}):
        with pytest.raises(SceneError, match=rf"{key} = .*; must be from {allowed}"):
            options_of(style=style)
    assert options_of(style={"figure.dpi": 1200, "savefig.dpi": "figure"}).style
    assert options_of(style={"font.size": 30, "axes.labelpad": -3.0, "axes.titlesize": "large"})


def test_units_that_read_better_are_taken_and_others_kept() -> None:
    found = readable_dataset(archive())
    assert found["omega"].attrs["units"] == "rpm"
    assert found["omega"].attrs["symbol"] == "$n$"
    assert_allclose(found["omega"], archive()["omega"] * 30.0 / np.pi)
    kept = readable_dataset(archive(), "archive")
    assert kept["omega"].attrs["units"] == "rad s-1"


def test_the_document_lists_every_kind() -> None:
    page = DOCUMENT.read_text("utf-8")
    for kind in KINDS:
        shows = kind.shows[0].upper() + kind.shows[1:]
        assert f"### `{kind.name}`\n\n{shows}; needs {kind.needs}.\n" in page
