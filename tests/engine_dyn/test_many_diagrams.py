"""Many diagrams at once have the numbers of each by itself, to the bit."""

import numpy as np
import pytest

from engine_dyn.forces.torque import pressure
from engine_dyn.pressure.family import Family
from engine_dyn.pressure.motored import peak_with_factor, row_with_factor
from engine_dyn.types import Floats
from sweeps.scene.engine.engine_files import load_engine


def family_of(name: str) -> Family:
    family = load_engine(name).family
    assert isinstance(family, Family)
    return family


@pytest.fixture(scope="module")
def family() -> Family:
    return family_of("ntua")


@pytest.fixture(scope="module")
def places(family: Family) -> Floats:
    """Anywhere in the table, rows and the last of them included."""
    found = np.random.default_rng(3).uniform(0.0, family.row_count - 1, (40, 10))
    found[0] = np.floor(found[0])
    found[1, 0] = family.row_count - 1
    return found


def test_peaks_are_those_of_each_diagram(family: Family, places: Floats) -> None:
    expected = np.array([[family.between(float(p)).peak for p in line] for line in places])
    np.testing.assert_array_equal(family.peak_between(places), expected)
    assert family.peak_between(places[0, 0]) == expected[0, 0]


def test_peaks_of_cylinders_that_burn_less(family: Family, places: Floats) -> None:
    def peak(place: float) -> float:
        row = int(place)
        here = row_with_factor(family, row, 0.4).pressure
        if place == row:
            return float(here.max())
        after = row_with_factor(family, row + 1, 0.4).pressure
        return float(((1.0 - (place - row)) * here + (place - row) * after).max())

    flat = places.reshape(-1)[:60]
    np.testing.assert_array_equal(
        peak_with_factor(flat, family, 0.4), [peak(float(place)) for place in flat]
    )


@pytest.mark.parametrize("own_angles", [False, True])
def test_pressures_of_many_designs(family: Family, places: Floats, own_angles: bool) -> None:
    phi = np.linspace(-6.0, 6.0, 37)
    angles = phi + 0.01 * places[..., None] if own_angles else phi
    found = pressure(angles, family, places[..., None], 1.1, 0.4)
    assert found.shape == (*places.shape, 37)
    for place in ((0, 0), (1, 0), (5, 3), (39, 9)):
        row = int(places[place])
        share = places[place] - row
        angle = angles[place] if own_angles else phi
        expected = (1.0 - share) * row_with_factor(family, row, 0.4)(angle)
        if share:
            expected += share * row_with_factor(family, row + 1, 0.4)(angle)
        np.testing.assert_array_equal(found[place], expected * 1.1)
    alone = pressure(phi[3], family, places[1, 0], 1.0)
    assert alone == family.row(family.row_count - 1)(phi[3])
