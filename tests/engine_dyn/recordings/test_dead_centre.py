"""Wrong dead centres are suspected, right ones are not."""

import math

import numpy as np
import pytest

from engine_dyn.recordings.compression_fit import fitted_shift, lines_of
from engine_dyn.recordings.cylinder_geometry import CylinderGeometry, RecordedCycles
from engine_dyn.recordings.dead_centre import (
    dead_centre_of_fired,
    dead_centre_of_motored,
    looks_motored,
)
from engine_dyn.recordings.signal_checks import examine
from sweeps.scene.engine.engine_files import catalogue, load_engine
from tests.support import recorded_engine as engine

DEGREE = engine.DEGREE


def recorded(diagram: object, shift: float = 0.0, step: float = 1.0) -> RecordedCycles:
    """The pressure of a diagram, `shift` degrees late."""
    period = diagram.period
    angle = np.arange(0.0, period - 1e-9, step * DEGREE) - 0.5 * period
    return RecordedCycles(angle, diagram(angle - shift * DEGREE)[None], period)


def catalogue_diagrams() -> list:
    """Each diagram of each engine of the catalogue; compression ratio where it is known."""
    found = []
    for name in catalogue():
        own = load_engine(name)
        if {"load_table", "driver_table"} & own.parts.keys() or "compressor" in name:
            continue
        values = own.values
        ratios = {"ntua": 17.433233, "b112": 19.0}
        for number, diagram in enumerate(own.family.diagrams):
            cycle = own.cycles[number] if own.cycles else None
            ratio = cycle.cycle.compression_ratio if cycle else ratios.get(name)
            geometry = CylinderGeometry(
                values["bore"], values["stroke"], values["crank_ratio"], ratio,
                values.get("pin_offset", 0.0),
            )  # fmt: skip
            label = f"{name} at {own.family.loads[number]:g} percent"
            found.append(pytest.param(diagram, geometry, id=label))
    return found


DIAGRAMS = catalogue_diagrams()
OF_KNOWN_RATIO = [one for one in DIAGRAMS if one.values[1].compression_ratio is not None]


@pytest.mark.parametrize(("diagram", "geometry"), DIAGRAMS)
def test_the_catalogue_passes_without_a_word(diagram: object, geometry: CylinderGeometry) -> None:
    assert examine(recorded(diagram), geometry) == []


@pytest.mark.parametrize("shift", [-6.0, -2.0, 2.0, 6.0])
@pytest.mark.parametrize(("diagram", "geometry"), OF_KNOWN_RATIO)
def test_shifts_are_found_in_the_catalogue_and_large_ones_told(
    diagram: object, geometry: CylinderGeometry, shift: float
) -> None:
    found = dead_centre_of_fired(recorded(diagram, shift), geometry)
    assert abs(found.shift / DEGREE - shift) < 2.0 * found.uncertainty / DEGREE
    assert found.suspected == (abs(shift) > 4.0)


def test_noise_enlarges_the_uncertainty() -> None:
    clean = dead_centre_of_fired(engine.cycles(0.5), engine.GEOMETRY)
    noisy = dead_centre_of_fired(engine.cycles(0.5, noise=2e4), engine.GEOMETRY)
    many = dead_centre_of_fired(engine.cycles(0.5, 50, noise=2e4), engine.GEOMETRY)
    assert noisy.uncertainty > 1.3 * clean.uncertainty
    assert many.uncertainty < 0.9 * noisy.uncertainty


@pytest.mark.parametrize("shift", [0.0, 2.0])
def test_without_a_compression_ratio(shift: float) -> None:
    geometry = CylinderGeometry(engine.BORE, engine.STROKE, engine.GEOMETRY.crank_ratio)
    lines = lines_of(engine.cycles(0.5, shift=shift))
    found = fitted_shift(lines, geometry, end=-20.0 * DEGREE)
    given = fitted_shift(lines, engine.GEOMETRY, end=-20.0 * DEGREE)
    # What the compression ratio does to both sides alike is no shift: little is lost.
    assert found.shift_uncertainty < 1.2 * given.shift_uncertainty
    assert abs(found.shift - shift * DEGREE) < 2.0 * found.shift_uncertainty
    ratio = 1.0 + 11.0 * math.exp(-found.clearance)
    assert ratio == pytest.approx(engine.RATIO, rel=0.1)


def motored(shift: float = 0.0, loss: float = 5.0, step: float = 0.5) -> RecordedCycles:
    return engine.cycles(step, shift=shift, heat=0.0, loss=loss)


@pytest.mark.parametrize("loss", [3.0, 7.0])
@pytest.mark.parametrize("shift", [-2.0, -1.2, 0.0, 1.2, 2.0])
def test_motored_cycles_measure_the_shift(shift: float, loss: float) -> None:
    recorded_cycles = motored(shift, loss)
    assert looks_motored(recorded_cycles)
    found = dead_centre_of_motored(recorded_cycles, engine.GEOMETRY)
    # The loss angle of this cycle, from p' = 0: gamma p V' = -(gamma - 1) loss (pV/pV0 - 1).
    true = motored(0.0, loss, 0.1)
    own = true.angle[np.argmax(true.pressure[0])]
    assert -1.0 * DEGREE < own < -0.2 * DEGREE
    assert found.peak == pytest.approx(own + shift * DEGREE, abs=0.06 * DEGREE)
    assert abs(found.shift / DEGREE - shift) < 0.5
    assert found.symmetry / DEGREE == pytest.approx(shift, abs=0.35)
    assert found.suspected == (shift != 0.0)
