"""`archive.dyn`: numbers, designs, files and figures of an archive."""

import numpy as np
import pytest
import xarray as xr

import sweeps
import sweeps.view.accessor
from sweeps.view.figures.kinds import KINDS
from tests.support.tiers import every
from tests.sweeps.processes import python


@pytest.fixture
def archive() -> xr.Dataset:
    """Two axes, one design without a steady state, and curves over the crank angle."""
    inertia, load = np.array([2.0, 4.0, 8.0]), np.array([50.0, 100.0])
    delta = load[:, None] / inertia / 1000.0
    delta[1, 0] = np.nan
    status = np.where(np.isnan(delta), 2, 0).astype(np.int8)
    angle = np.arange(-360.0, 360.0, 10.0)
    wave = np.sin(np.radians(angle))
    return xr.Dataset(
        {
            "delta": (("load", "inertia"), delta, {"units": "1", "long_name": "irregularity"}),
            "brake_power": ("load", load * 1e3, {"units": "W", "long_name": "brake power"}),
            "torque": ("crank_angle", 100.0 * wave, {"units": "N m", "long_name": "torque"}),
            "omega": ("crank_angle", 157.0 + wave, {"units": "rad s-1", "long_name": "speed"}),
            "status": (("load", "inertia"), status, {"long_name": "outcome"}),
        },
        coords={
            "inertia": ("inertia", inertia, {"units": "kg m2"}),
            "load": ("load", load, {"units": "percent"}),
            "crank_angle": ("crank_angle", angle, {"units": "degree"}),
        },
        attrs={"title": "a <made up> archive"},
    )


def test_outcomes_are_words(archive: xr.Dataset) -> None:
    words = archive.dyn.status_words
    assert words.dims == ("load", "inertia")
    assert words.values.tolist() == [["converged"] * 3, ["no_steady_state", *["converged"] * 2]]
    assert archive.dyn.outcomes == {"converged": 5, "no_steady_state": 1}
    assert archive["status"].dtype == np.int8, "the archive stays as it is"
    with pytest.raises(sweeps.SceneError, match="has no status"):
        _ = archive.drop_vars("status").dyn.status_words


def test_every_kind_of_figure_is_a_method(archive: xr.Dataset) -> None:
    plot = archive.dyn.plot
    assert dir(plot) == sorted(kind.name for kind in KINDS)
    for kind in KINDS:
        method = getattr(plot, kind.name)
        assert method.__name__ == kind.name and kind.shows in method.__doc__
    assert "torque_and_speed" in repr(plot).partition("not available for this archive")[0]
    assert "bearing_polar" in repr(plot).partition("not available for this archive")[2]


@pytest.mark.parametrize(
    ("call", "kind", "said"),
    [
        (lambda p: p.torque_and_sped(), AttributeError, "'torque_and_sped': no such kind; did you"),
        (lambda p: p.bearing_polar(), ValueError,
         "figure bearing_polar: not available for this archive"),
        (lambda p: p.numbers(styl=1), TypeError, r"got an unexpected keyword argument .styl"),
        (lambda p: p.numbers(style="nope"), ValueError, "style 'nope': no such file"),
        (lambda p: p.numbers(units={"foo": "kW"}), ValueError, "^units foo: no column"),
        (lambda p: p.numbers(ax=3), ValueError, "ax = 3: must be an Axes"),
    ],
)  # fmt: skip
def test_wrong_figures(archive: xr.Dataset, call, kind: type[Exception], said: str) -> None:
    with pytest.raises(kind, match=said):
        call(archive.dyn.plot)
    assert not hasattr(archive.dyn.plot, "_ipython_display_")


@pytest.mark.parametrize(
    "statement",
    every(
        4, ("sweeps.run", "sweeps.open", "sweeps.best", "sweeps.identify", "import sweeps.accessor")
    ),
)
def test_datasets_have_it_as_soon_as_there_are_any(statement: str) -> None:
    code = f"import sweeps; {statement}; import xarray; print(xarray.Dataset().dyn)"
    done = python(code, environment={"PYTHONWARNINGS": "error"})
    assert "<archive.dyn of ''" in done.stdout, done.stderr
