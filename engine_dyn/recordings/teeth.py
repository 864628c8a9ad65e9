"""Time stamps of teeth: which tooth each is, whole turns, and what does not fit the wheel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from engine_dyn.geometry.toothed_wheel import TURN, Wheel, wheel_from_text
from engine_dyn.types import Floats, Integers

FACTOR = 1.7
"""Largest ratio of an interval to the expected one. A missing tooth makes at least 2 of it, and
an extra pulse cuts it to half or less; speed and tooth errors change it far less in a turn."""

NAMED = 5  # Largest number of faults that are reported one by one

SHORTEST, LONGEST = 1e-9, 1e6  # Shortest and longest interval between teeth [s] that is accepted


@dataclass(frozen=True, eq=False)
class PassedTeeth:
    """Whole turns of a wheel in a row of time stamps."""

    wheel: Wheel  # Pattern of the wheel's teeth
    # Times at which the teeth of each turn passed [s]; the last is the first of the next turn;
    # shape (turns, teeth + 1)
    time: Floats
    # Number of each turn from the first, with gaps where turns were lost; shape (turns,)
    turn: Integers
    lost: float  # Share of the time between the first and the last turn that faults took
    # Scatter of intervals from turn to turn: relative standard deviation of second differences over
    # turns of the interval's share of its turn; the median over the teeth.
    scatter: float
    faults: tuple[str, ...]  # Extra pulses and missed teeth, one line each
    first: int  # Index of the pulse with which the first turn begins
    # Times of the pulses before the first and after the last turn [s].
    before: Floats
    after: Floats

    @property
    def interval(self) -> Floats:
        """Time from each tooth to the next one [s], shape (turns, teeth)."""
        return np.diff(self.time, axis=1)

    @property
    def speed(self) -> Floats:
        """Angle over time of each interval [rad/s], with the wheel as it should be."""
        return np.asarray(self.wheel.width / self.interval)

    def angle_at(
        self, time: Floats, gap_angle: float = 0.0, errors: Floats | float = 0.0
    ) -> Floats:
        """Crank angle at any times, counted on from turn to turn.

        Parameters
        ----------
        time : ndarray
            [s].
        gap_angle : float
            Crank angle [rad] at which the first tooth after the longest gap passes the sensor.
        errors : ndarray, shape (teeth,), or 0
            Relative errors of the wheel's intervals, see `tooth_errors`.

        Returns
        -------
        ndarray
            Angle [rad], of the shape of `time`; NaN outside whole turns. Between teeth it is a
            cubic with the slopes of the parabolas through three teeth.
        """
        width = self.wheel.width * (1.0 + errors)
        within = np.concatenate([[0.0], np.cumsum(width)])
        knots = gap_angle + TURN * self.turn[:, None] + within
        joined = self.turn[1:] == self.turn[:-1] + 1
        keep = np.ones(self.time.shape, dtype=bool)
        keep[:-1, -1] = ~joined  # the last tooth of a turn is the first of the next
        at, phi = self.time[keep], knots[keep]
        step, secant = np.diff(at), np.diff(phi) / np.diff(at)
        slope = np.empty(at.size)
        share = step[:-1] / (step[:-1] + step[1:])
        slope[1:-1] = (1.0 - share) * secant[:-1] + share * secant[1:]
        slope[0], slope[-1] = secant[0], secant[-1]
        time = np.asarray(time, dtype=float)
        place = np.clip(np.searchsorted(at, time, side="right") - 1, 0, at.size - 2)
        u = (time - at[place]) / step[place]
        value = (
            phi[place] * (1.0 + 2.0 * u) * (1.0 - u) ** 2
            + phi[place + 1] * u * u * (3.0 - 2.0 * u)
            + step[place] * u * (1.0 - u) * ((1.0 - u) * slope[place] - u * slope[place + 1])
        )
        lost = np.zeros(at.size, dtype=bool)
        ends = np.flatnonzero(~joined) + 1
        lost[np.cumsum(keep.sum(axis=1))[ends - 1] - 1] = True  # no tooth follows in its turn
        outside = (time < at[0]) | (time > at[-1]) | (lost[place] & (u > 0.0))
        return np.asarray(np.where(outside, np.nan, value))


def find_turns(time: Floats, wheel: Wheel, first: int | None = None) -> PassedTeeth:
    """Find the whole turns of a wheel in time stamps of its teeth.

    Each run of as many intervals as the wheel has teeth is compared with the pattern by
    docs/method.md (107): the logarithms of intervals and of widths, each less its mean, differ by
    the speed and by errors of teeth alone where they belong together. Where pulses are too many or
    too few, the search goes on with the next run that fits. On a wheel that repeats within a turn,
    turns are counted on from the first one, by the time between the runs.

    Parameters
    ----------
    time : ndarray, shape (pulses,)
        Ascending times [s].
    wheel : Wheel
        Its pattern.
    first : int, optional
        Place of a pulse [from 0] that is the wheel's first tooth; needed only by wheels of which
        several teeth could be that one.

    Returns
    -------
    PassedTeeth

    Raises
    ------
    ValueError
        One line: times that do not ascend, fewer than a turn, or a pattern that does not fit, with
        what was found instead.
    """
    time = np.asarray(time, dtype=float)
    if time.ndim != 1 or not np.isfinite(time).all():
        raise ValueError("times of teeth: must be a row of numbers")
    gaps = np.diff(time)
    if np.any(gaps <= 0.0):
        place = int(np.flatnonzero(gaps <= 0.0)[0])
        raise ValueError(
            f"times of teeth: number {place + 2} ({time[place + 1]:.9g} s) is not later than the "
            f"one before it ({time[place]:.9g} s)"
        )
    if gaps.size and not (gaps.min() > SHORTEST and gaps.max() < LONGEST):
        raise ValueError(
            f"times of teeth: intervals of {gaps.min():.3g} to {gaps.max():.3g} s; must be between "
            f"{SHORTEST:g} and {LONGEST:g} s"
        )
    if gaps.size < wheel.teeth:
        raise ValueError(
            f"times of teeth: {time.size}; a whole turn of the wheel {wheel.text} needs "
            f"{wheel.teeth + 1}"
        )
    if first is not None and not 0 <= first < time.size:
        raise ValueError(f"first_tooth: pulse {first + 1}; must be 1 to {time.size}")
    starts = _whole_turns(time, wheel, first)
    if starts.size == 0:
        raise ValueError(_what_was_found(time, wheel))
    every = time[starts[:, None] + np.arange(wheel.teeth + 1)]
    turn, faults = _between(time, starts, wheel)
    span = float(every[-1, -1] - every[0, 0])
    lost = max(1.0 - float(np.sum(every[:, -1] - every[:, 0])) / span, 0.0)
    return PassedTeeth(
        wheel, every, turn, lost, _scatter(every, wheel), faults, int(starts[0]),
        time[: starts[0]], time[starts[-1] + wheel.teeth + 1 :],
    )  # fmt: skip


def _whole_turns(time: Floats, wheel: Wheel, first: int | None = None) -> Integers:
    """First pulses of the whole turns; empty where the pulses do not have the pattern."""
    gaps, none = np.diff(time), np.empty(0, dtype=np.int64)
    starts = _even_starts(gaps, wheel, first) if wheel.even else _starts(gaps, wheel)
    _check_sense(gaps, wheel, starts)
    if wheel.symmetry > 1:
        starts = _counted_on(time, starts, wheel, first)
    if starts.size == 0:
        return none
    whole = float(np.sum(time[starts + wheel.teeth] - time[starts]))
    # A pattern counts as present if whole turns take this share of the time, without incomplete
    # turns at the begin and the end.
    if whole < 0.75 * (time[-1] - time[0]) - 2.0 * whole / starts.size:
        return none
    # With a tooth more in each turn than the pattern has, all intervals may still look alike.
    extra = np.diff(starts) - wheel.teeth * np.diff(_between(time, starts, wheel)[0])
    _, counts = np.unique(extra[extra != 0], return_counts=True)
    # The wheel has more teeth than its pattern if more than this share of the steps from turn to
    # turn has the same number of extra pulses.
    return none if counts.size and counts.max() > 0.5 * extra.size else starts


def _misfit(gaps: Floats, wheel: Wheel) -> Floats:
    """Largest deviation from the pattern, as logarithm, of the run from each interval on."""
    logs, teeth = np.log(gaps), wheel.teeth
    width = np.log(wheel.width)
    total = np.concatenate([[0.0], np.cumsum(logs - logs[0])])
    runs = gaps.size - teeth + 1
    level = (total[teeth:] - total[:runs]) / teeth + logs[0] - width.mean()
    worst = np.zeros(runs)
    for place in range(teeth):
        np.maximum(worst, np.abs(logs[place : place + runs] - level - width[place]), out=worst)
    return worst


def _starts(gaps: Floats, wheel: Wheel) -> Integers:
    """First intervals of the turns that fit, none within another; all equal groups' beginnings."""
    misfit, apart = _misfit(gaps, wheel), wheel.teeth // wheel.symmetry
    fits = np.flatnonzero(misfit < np.log(FACTOR))
    chosen: list[int] = []
    for start in fits:  # a short loop: few intervals fit, unless the wheel has no gap
        if chosen and start - chosen[-1] < apart:
            if misfit[start] < misfit[chosen[-1]]:
                chosen[-1] = int(start)
        else:
            chosen.append(int(start))
    return np.array(chosen, dtype=np.int64)


def _counted_on(time: Floats, starts: Integers, wheel: Wheel, first: int | None) -> Integers:
    """First groups of a wheel that repeats, a whole number of turns apart."""
    if starts.size == 0:
        return starts
    length = (time[starts + wheel.teeth] - time[starts]) / wheel.symmetry
    steps = np.rint(np.diff(time[starts]) * 2.0 / (length[1:] + length[:-1]))
    group = np.concatenate([[0.0], np.cumsum(steps)])
    here = 0.0
    if first is not None:
        nearest = int(np.argmin(np.abs(starts - first)))
        groups, beside = divmod(first - int(starts[nearest]), wheel.teeth // wheel.symmetry)
        if beside:
            raise ValueError(
                f"first_tooth: pulse {first + 1} is not the first of a group; of {wheel.text} "
                f"pulse {starts[nearest] + 1} is one"
            )
        here = group[nearest] + groups
    return np.asarray(starts[(group - here) % wheel.symmetry == 0.0])


def _check_sense(gaps: Floats, wheel: Wheel, starts: Integers) -> None:
    """Refuse pulses that fit the reversed wheel better, where it differs."""
    if wheel.mirrored:
        return  # the wheel looks the same in both senses of rotation
    other = wheel.reversed
    backwards = _starts(gaps, other)
    here, there = (
        np.median(_misfit(gaps, one)[places]) if places.size else np.inf
        for one, places in ((wheel, starts), (other, backwards))
    )
    if there < here:
        raise ValueError(
            f"wheel: the pulses fit {wheel.text} in reverse: the wheel turns against the order of "
            "its teeth; give the teeth in the opposite order, or set reversed"
        )


def _even_starts(gaps: Floats, wheel: Wheel, first: int | None) -> Integers:
    """First intervals of turns without a gap; counted from one tooth, so none may be lost."""
    ratio = gaps / _usual(gaps)
    bad = np.flatnonzero((ratio > FACTOR) | (ratio < 1.0 / FACTOR))
    if bad.size:
        raise ValueError(
            f"times of teeth: interval {bad[0] + 1} is {ratio[bad[0]]:.2f} of its neighbours; the "
            f"wheel {wheel.text} has no gap, so no tooth may be missed or counted twice"
        )
    begin = (first or 0) % wheel.teeth
    return np.arange(begin, gaps.size - wheel.teeth + 1, wheel.teeth, dtype=np.int64)


def _usual(gaps: Floats) -> Floats:
    """Median of the intervals around each one; both ends take the nearest whole group."""
    # Number of neighbouring intervals whose median is taken as the usual interval.
    count = min(11, gaps.size - (gaps.size + 1) % 2)
    middle = np.median(np.lib.stride_tricks.sliding_window_view(gaps, count), axis=1)
    half = count // 2
    return np.concatenate(
        [np.full(half, middle[0]), middle, np.full(gaps.size - half - middle.size, middle[-1])]
    )


def _between(time: Floats, starts: Integers, wheel: Wheel) -> tuple[Integers, tuple[str, ...]]:
    """Numbers of the turns, and lines about faults between turns that are not consecutive."""
    teeth = wheel.teeth
    length = time[starts + teeth] - time[starts]
    turn = np.zeros(starts.size, dtype=np.int64)
    apart = (time[starts[1:]] - time[starts[:-1]]) / (0.5 * (length[1:] + length[:-1]))
    apart = np.where(np.diff(starts) == teeth, 1.0, np.maximum(np.rint(apart), 1.0))
    # At most a million turns can be lost in a row.
    turn[1:] = np.cumsum(np.minimum(apart, 1e6)).astype(np.int64)
    faulty = np.flatnonzero(np.diff(starts) != teeth)
    said = []
    for place in faulty[:NAMED]:
        begin, end = int(starts[place]) + teeth, int(starts[place + 1])
        turns = int(turn[place + 1] - turn[place]) - 1
        gaps = np.diff(time[begin : end + 1])
        where = f"turn {turn[place] + 2} (at {time[begin]:.6g} s)"
        extra = end - begin - turns * teeth
        if turns < 1:
            said.append(f"{where}: {end - begin} pulses too many; left out")
            continue
        usual = float(np.median(gaps))
        most, least = int(np.argmin(gaps)), gaps.min() / usual
        if extra > 0:
            kind = f"{extra} pulse{'s' * (extra > 1)} too many (a doubled tooth or noise)"
            kind += f": pulse {most + 1} is followed after {least:.2f} of a usual interval"
        elif extra < 0:
            kind = f"{-extra} {'teeth' if extra < -1 else 'tooth'} missed"
        else:
            kind = "the number of pulses is right, but not their positions"
        said.append(f"{where}: {kind}; {'turn' if turns == 1 else f'{turns} turns'} left out")
    if faulty.size > NAMED:
        said.append(f"and {faulty.size - NAMED} more faults of this kind")
    return turn, tuple(said)


def _scatter(time: Floats, wheel: Wheel) -> float:
    """Scatter of intervals; by second differences, so that a steady change does not count."""
    share = np.diff(time, axis=1) / (time[:, -1:] - time[:, :1])
    if len(share) < 3:
        return 0.0
    # Every second turn of a four-stroke engine is alike.
    step = 2 if len(share) > 4 else 1
    change = share[2 * step :] - 2.0 * share[step:-step] + share[: -2 * step]
    return float(np.median(np.std(change, axis=0) / np.sqrt(6.0) * TURN / wheel.width))


def _what_was_found(time: Floats, wheel: Wheel) -> str:
    """One line: the pattern of the pulses, as a text for the key `wheel` if it fits them."""
    gaps = np.diff(time)
    ratio = gaps / _usual(gaps)
    pitches = np.rint(ratio).astype(np.int64)
    long = np.flatnonzero(pitches >= 2)
    groups = _repeated(np.column_stack([np.diff(long), pitches[long[1:]] - 1]))
    text = _pattern(groups, wheel) if groups else ""
    if long.size == 0:
        description = f"{gaps.size + 1} pulses without a gap"
    elif text and _fits(time, text):
        description = f'wheel = "{text}"' + _how_often(groups, wheel)
    else:
        apart = np.diff(long)
        description = f"{long.size} gaps of {int(np.median(pitches[long])) - 1} or so, "
        description += ", ".join(map(str, apart[:4])) + " ..." * (apart.size > 4) + " teeth apart"
    short = int(np.count_nonzero(ratio < 0.6))
    if short:
        description += f", and {short} pulses closer than 0.6 of a usual interval"
    if sorted(teeth for teeth, _ in groups) == [1, wheel.teeth - 1]:
        description += (
            "; the gap is spread over two intervals, as the wrong edge of an inductive sensor "
            "shows it: take the other edge"
        )
    fault = f"wheel: the pulses do not fit {wheel.text} ({wheel.teeth} teeth a turn)"
    return f"{fault}; found: {description}"


def _fits(time: Floats, text: str) -> bool:
    """Whether `find_turns` would take a pattern that was found."""
    try:
        wheel = wheel_from_text(text)
        return time.size > wheel.teeth and _whole_turns(time, wheel).size > 0
    except ValueError:
        return False


def _repeated(groups: Integers) -> list[tuple[int, int]]:
    """Teeth of each group and missing teeth after it, in the pattern that repeats best."""
    # In a pattern, of at most 24 groups, at least this share of the groups equal those before.
    best, pattern = 0.6, groups[:0]
    for count in range(1, min(len(groups) // 2, 24) + 1):
        same = (groups[count:] == groups[:-count]).all(axis=1)
        runs = np.flatnonzero(np.convolve(same, np.ones(count), "valid") > count - 0.5)
        if same.mean() > best and runs.size:
            best, pattern = same.mean(), groups[runs[0] : runs[0] + count]
    pairs = [(int(teeth), int(missing)) for teeth, missing in pattern]
    # With faults near an end of the recording, a multiple of the pattern's period may agree better
    # than the period: the pattern is cut to its shortest period.
    periods = (n for n in range(1, len(pairs) + 1) if pairs == pairs[:n] * (len(pairs) // n))
    return pairs[: next(periods, 0)]


def _pattern(groups: list[tuple[int, int]], wheel: Wheel) -> str:
    """Text of the groups, repeated until they fill the wheel's expected pitches."""
    longest = max(range(len(groups)), key=lambda place: groups[place][1])
    groups = groups[longest + 1 :] + groups[: longest + 1]  # the first group follows the gap
    groups *= _repeats(groups, wheel) or 1
    pitches = sum(map(sum, groups))
    if len(set(groups)) == 1:
        return "-".join(map(str, [pitches, *(gap for _, gap in groups)]))
    return ", ".join(f"{teeth} teeth, {missing} missing" for teeth, missing in groups)


def _repeats(groups: list[tuple[int, int]], wheel: Wheel) -> int:
    """Number of repetitions of the groups that fill a turn's pitches; 0 where none does."""
    whole, beside = divmod(round(TURN / wheel.width.min()), sum(map(sum, groups)))
    return 0 if beside else whole


def _how_often(groups: list[tuple[int, int]], wheel: Wheel) -> str:
    """Say that pulses alone do not tell how often a repeated pattern occurs in a turn."""
    pitches, whole = sum(map(sum, groups)), _repeats(groups, wheel)
    if whole == 1:
        return ""
    if whole:
        return f" (its {pitches} pitches repeat; a turn has {whole * pitches} as {wheel.text} has)"
    return f" if its {pitches} pitches make a whole turn and not a part of one"
