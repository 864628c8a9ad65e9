"""What follows a change of the load: deviations and recovery of the speed averaged over a cycle."""

from __future__ import annotations

from engine_dyn import status
from engine_dyn.compilation import inlined
from engine_dyn.transient.fields import AT, Found, Given
from engine_dyn.transient.work import Work

SPEED, BAND, FUEL_CUT = AT["speed"], AT["recovery_band"], AT["fuel_cut"]


@inlined
def measure(
    d: int, firings: int, per_cycle: int, given: Given, work: Work, found: Found
) -> None:  # fmt: skip
    """Store what follows each change of a design that was followed for so many firings."""
    marks = given.marks[d if given.marks.shape[0] > 1 else 0]
    band = given.numbers[d, BAND] * given.numbers[d, SPEED]
    cut = given.numbers[d, FUEL_CUT]
    times, speeds = work.trace_time, work.trace_speed
    f = 0
    for m in range(len(marks)):
        until = min(marks[m + 1], cut) if m + 1 < len(marks) else cut
        while f < firings and times[f] <= marks[m]:
            f += 1
        if f == 0 or f == firings:
            continue
        begin, end = f, f
        low = high = speeds[begin]
        while end < firings and times[end] <= until:
            low, high = min(low, speeds[end]), max(high, speeds[end])
            end += 1
        if end == begin:
            continue
        row = found.marks[d, m]
        after = speeds[end - 1]
        row[0], row[1], row[2], row[3] = speeds[begin - 1], low, high, after
        outside = end - 1
        while outside >= begin and abs(speeds[outside] - after) <= band:
            outside -= 1
        if outside + per_cycle >= end or not (found.outcome[d] == status.FOLLOWED or end < firings):
            continue  # It was not seen for a whole cycle within the band
        row[4] = 0.0
        if outside >= begin:
            # The speed passes the edge of the band between two firings.
            edge = after + (band if speeds[outside] > after else -band)
            part = (edge - speeds[outside]) / (speeds[outside + 1] - speeds[outside])
            row[4] = times[outside] + part * (times[outside + 1] - times[outside]) - marks[m]
