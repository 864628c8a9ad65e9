"""Crank angle of samples over time, from the pulses of an encoder beside them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from engine_dyn.geometry.toothed_wheel import wheel_from_text
from engine_dyn.recordings.encoder import teeth_of_signal
from engine_dyn.recordings.marks import mark_times, teeth_from_mark
from engine_dyn.types import Floats
from engine_dyn.units import DEGREE
from sweeps.base.checks import mentioned
from sweeps.base.columns.options import PressureOptions
from sweeps.base.columns.recorded_columns import Recording, named_column, wanted_pressures
from sweeps.base.columns.units import SECONDS, is_time_name, stated_unit
from sweeps.base.errors import SceneError, one_line

__all__ = ["with_encoder_angles"]

MOST_REMARKS = 8
"""Of the signal of the wheel, that are told."""


def with_encoder_angles(
    recording: Recording, options: PressureOptions, degrees: float, said: list[str]
) -> tuple[Recording, PressureOptions, Floats]:
    """Find the crank angle of samples between the teeth of a wheel; `degrees` make a cycle.

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
        raise SceneError(f"{recording.label}: encoder_column and wheel: give both or neither")
    encoder = named_column(recording, options.encoder_column, "encoder_column")
    signal = recording.numbers(encoder)
    used = {encoder}
    timed = _time_column(recording, options, encoder, said)
    if options.sample_rate is not None:
        interval = 1.0 / options.sample_rate
    elif timed is not None:
        interval = _interval(recording, timed)
    else:
        raise SceneError(f"{recording.label}: encoder_column: needs time_column or sample_rate")
    if timed is not None:
        used.add(timed)
    try:
        wheel = wheel_from_text(options.wheel)
        found = teeth_of_signal(
            signal, interval, wheel, threshold=options.threshold, hysteresis=options.hysteresis,
            edge=options.edge,
        )  # fmt: skip
    except ValueError as error:
        raise SceneError(f"{recording.label}: {mentioned(error)}") from None
    teeth, gap = found.teeth, options.gap_angle
    if options.mark_column is not None:
        mark = named_column(recording, options.mark_column, "mark_column")
        used.add(mark)
        try:
            marked = teeth_from_mark(
                teeth, found.crossings.time * interval,
                mark_times(recording.numbers(mark), interval), options.mark_angle * DEGREE,
                round(degrees / 360.0),
            )  # fmt: skip
        except ValueError as error:
            raise SceneError(f"{recording.where(mark)}: {error}") from None
        teeth, gap = marked.teeth, round(marked.angle / DEGREE, 6)
        how = "once a cycle" if marked.turn_known else "once a revolution"
        said.append(f"the mark in column '{one_line(mark, 60)}' passes {how}")
    which = f"the {found.crossings.edge} edge of the first tooth " + (
        "at the mark"
        if options.mark_column is not None and (wheel.even or wheel.symmetry > 1)
        else "of the recording"
        if wheel.even
        else "after the first gap of the recording"
        if wheel.symmetry > 1
        else "after the longest gap"
    )
    if gap is None:
        raise SceneError(
            f"{recording.label}: gap_angle: missing; must be the crank angle in degree at which "
            f"{which} passes, from a drawing or measured on the engine; or give mark_column, or "
            "read a motored recording with gap_angle = 0 and use the negative of the angle of its "
            "largest pressure, minus the thermodynamic loss angle (usually 0.4 to 1 degree)"
        )
    times: Floats = np.asarray(interval * np.arange(len(signal)), np.float64)
    angle = teeth.angle_at(times, gap * DEGREE)
    inside = np.isfinite(angle)
    said.append(
        f"crank angle from the wheel {wheel.text}: {len(teeth.turn)} turns, {which} at "
        f"{gap:.6g} degree"
    )
    if options.edge is None and options.mark_column is None:
        said.append(
            f"the {found.crossings.edge} edge was chosen, because its intervals repeat best; if "
            "gap_angle refers to the other edge, one tooth width away, give edge"
        )
    said += [f"signal of the wheel: {remark}" for remark in found.remarks[:MOST_REMARKS]]
    rest = {
        name: replace(column, values=column.values[inside])
        for name, column in recording.columns.items()
        if name not in used and column.values.shape == signal.shape
    }
    options = options.model_copy(update={"pressure_column": wanted_pressures(recording, options)})
    return replace(recording, columns=rest), options, angle[inside]


def _time_column(
    recording: Recording, options: PressureOptions, encoder: str, said: list[str]
) -> str | None:
    """Name of the column of times: as given, or the only one that is called so."""
    if options.time_column is not None:
        return named_column(recording, options.time_column, "time_column")
    good = [
        name for name, column in recording.columns.items()
        if name != encoder and is_time_name(name)
        and stated_unit(column.unit, name, SECONDS) in SECONDS
    ]  # fmt: skip
    if len(good) != 1:
        return None
    if options.sample_rate is None:
        said.append(f"column '{good[0]}' taken as the time")
    return good[0]


def _interval(recording: Recording, name: str) -> float:
    """Time between samples [s]."""
    times = recording.numbers(name)
    scale = SECONDS.get(stated_unit(recording.columns[name].unit, name, SECONDS), 1.0)
    count = len(times) - 1
    interval = float(times[-1] - times[0]) / max(count, 1)
    if count < 8 or interval <= 0.0 or np.ptp(np.diff(times)) > 0.5 * interval:
        raise SceneError(
            f"{recording.label}, column '{name}': times must rise in even steps; is this the "
            "right column?"
        )
    return interval * scale
