"""Tornado diagrams show the elasticities of an archive, the largest first."""

import numpy as np
import pytest

import sweeps
from sweeps.figures.drawing import figure

pytestmark = pytest.mark.compiled


def test_bars_are_the_elasticities_of_the_nominal_design() -> None:
    archive = sweeps.run(
        engine="ntua",
        set={"load": 50.0},
        axes={"speed": [1200.0, 1500.0]},
        output={"quantities": ["delta_elasticity"]},
    )
    drawn = figure(archive, "tornado")
    (panel,) = drawn.axes
    lengths = np.array([bar.get_width() for bar in panel.patches])
    values = archive.delta_elasticity.sel(speed=1200.0).values
    largest = values[np.argsort(-np.abs(np.nan_to_num(values)))]
    assert np.array_equal(lengths, largest[: lengths.size])
    assert lengths.size >= 5 and np.abs(lengths[-1]) >= 1e-3 * np.abs(lengths[0])
    labels = [text.get_text().replace("\n", " ") for text in panel.get_yticklabels()]
    assert labels[0] in ("Cylinder bore", "Nominal crank speed")
    both = {
        line.get_marker(): line.get_xdata() for line in panel.lines if line.get_marker() in "<>"
    }
    at_row = archive.sel(speed=1200.0, parameter="load")
    assert both["<"] == pytest.approx([float(at_row.delta_elasticity_below)])
    assert both[">"] == pytest.approx([float(at_row.delta_elasticity_above)])
    assert "in % for 1 % of the parameter" in panel.get_xlabel()
