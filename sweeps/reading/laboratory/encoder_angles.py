"""Crank angle of samples over time, from the pulses of an encoder beside them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from engine_dyn.recordings.encoder import teeth_of_signal
from engine_dyn.recordings.wheel import wheel_from_text
from engine_dyn.types import Floats
from engine_dyn.units import DEGREE
from sweeps.checks import mentioned
from sweeps.errors import SceneError
from sweeps.reading.laboratory.columns import named_column
from sweeps.reading.laboratory.pressure_options import PressureOptions
from sweeps.reading.laboratory.recorded_columns import Recording

__all__ = ["with_encoder_angles"]


def with_encoder_angles(
    recording: Recording, options: PressureOptions, said: list[str]
) -> tuple[Recording, PressureOptions, Floats]:
    """Find the crank angle of samples between the teeth of a wheel.

    Returns
    -------
    recording : Recording
        The other columns of the samples in whole turns.
    options : PressureOptions
        Columns of pressure by their names: numbers count the columns of the file.
    angle : ndarray, shape (samples,)
        Their crank angle [rad], counted on from turn to turn.

    Raises
    ------
    SceneError
        In one line: missing keys, times that are not even, a signal without the pattern.
    """
    if options.encoder_column is None or options.wheel is None:
        raise SceneError(f"{recording.label}: encoder_column and wheel: both are needed, or none")
    encoder = named_column(recording, options.encoder_column, "encoder_column")
    signal = recording.numbers(encoder)
    used = {encoder}
    if options.sample_rate is not None:
        interval = 1.0 / options.sample_rate
    elif options.time_column is not None:
        name = named_column(recording, options.time_column, "time_column")
        interval = _interval(recording, name)
        used.add(name)
    else:
        raise SceneError(f"{recording.label}: encoder_column: needs time_column or sample_rate")
    try:
        wheel = wheel_from_text(options.wheel)
        found = teeth_of_signal(signal, interval, wheel)
    except ValueError as error:
        raise SceneError(f"{recording.label}: {mentioned(error)}") from None
    times: Floats = np.asarray(interval * np.arange(len(signal)), np.float64)
    angle = found.teeth.angle_at(times, options.gap_angle * DEGREE)
    inside = np.isfinite(angle)
    said.append(
        f"crank angle from the wheel {wheel.text}: {len(found.teeth.turn)} turns, first tooth "
        f"after the gap at {options.gap_angle:g} degree"
    )
    said += found.teeth.faults[:5]
    rest = {
        name: replace(column, values=column.values[inside])
        for name, column in recording.columns.items()
        if name not in used and column.values.shape == signal.shape
    }
    wanted = options.pressure_column
    if wanted is not None:
        listed = wanted if isinstance(wanted, list) else [wanted]
        names = [named_column(recording, item, "pressure_column") for item in listed]
        options = options.model_copy(update={"pressure_column": names})
    return replace(recording, columns=rest), options, angle[inside]


def _interval(recording: Recording, name: str) -> float:
    """Time between samples [s]."""
    times = recording.numbers(name)
    scale = {"ms": 1e-3, "us": 1e-6, "µs": 1e-6}.get(recording.columns[name].unit, 1.0)
    count = len(times) - 1
    interval = float(times[-1] - times[0]) / max(count, 1)
    if count < 8 or interval <= 0.0 or np.ptp(np.diff(times)) > 0.5 * interval:
        raise SceneError(
            f"{recording.label}, column '{name}': times must rise in even steps; is it another?"
        )
    return interval * scale
