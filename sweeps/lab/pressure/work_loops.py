"""Pressure over volume, or over the piston's travel: the crank angle of each point of the loop.

The points stand in the order in which the engine passes them. The sense of each stroke follows from
the order, or from a column that names the strokes.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace

import numpy as np

from engine_dyn.geometry.slider_crank import angle_of_travel, dead_centres
from engine_dyn.recordings.cylinder_geometry import CylinderGeometry
from engine_dyn.types import Booleans, Floats, Integers
from engine_dyn.units import CUBIC_CENTIMETRE, DEGREE
from sweeps.base.columns.options import PressureOptions
from sweeps.base.columns.recorded_columns import Recording, named_column, wanted_pressures
from sweeps.base.errors import SceneError, counted, one_line, shown
from sweeps.lab.pressure.cycles_of_signals import LONGEST
from sweeps.lab.pressure.imported_pressure import EngineMeasures

SAME = 1e-9  # Travels of the piston, over the stroke, that differ by less are the same

STROKES = {1: "intake", 2: "compression", 3: "expansion", 4: "exhaust"}
"""Names of the strokes by their numbers in a column; a two-stroke cycle has 2 and 3."""


@dataclass(frozen=True)
class _Source:
    """Column that the travel comes from, as messages name it."""

    recording: Recording
    key: str
    name: str
    backward: bool  # Whether the crank passes the points in the reverse order of the file

    def __str__(self) -> str:
        return self.recording.where(self.name)

    def at(self, place: int) -> str:
        """Return the file and the row of a point, by its place in the order of the crank."""
        rows = self.recording.columns[self.name].values.size
        return self.recording.at(rows - 1 - place if self.backward else place)


def with_loop_angles(
    recording: Recording, options: PressureOptions, geometry: CylinderGeometry,
    engine: EngineMeasures | None, period: float, said: list[str],
) -> tuple[Recording, PressureOptions, Floats]:  # fmt: skip
    """Find the crank angle of each point of a pressure over volume or travel.

    The mechanism of `geometry` gives it, whose bore and stroke count where `engine` has them; a
    cycle has `period` degrees, and remarks are added to `said`. Returned are the pressures, where
    points of one travel are merged, options with columns by their names, and the rising angle
    [rad]: 0 is a top dead centre, the firing one where the strokes are named.

    Raises
    ------
    SceneError
        In one line: missing measures, points outside the travel, loops that turn back between dead
        centres or pass too few of them, strokes out of order.
    """
    _check_keys(recording, options, engine)
    key = "volume_column" if options.volume_column is not None else "travel_column"
    wanted = getattr(options, key)
    backward = options.direction == "backward"
    source = _Source(recording, key, named_column(recording, wanted, key), backward)
    used = {source.name}
    order = slice(None, None, -1 if backward else 1)
    travel = _inside(_travel(source, options, geometry, engine, said)[order], source, said)
    strokes = None
    if options.stroke_column is not None:
        name = named_column(recording, options.stroke_column, "stroke_column")
        used.add(name)
        strokes = _numbers_of_strokes(recording, name, period)[order]
    names = _pressure_columns(recording, options, used)
    if strokes is None:
        angle = _angles(travel, _moves_down(travel, source), geometry)
    else:
        _check_strokes(travel, strokes, source, period)
        angle = _angles(travel, (strokes == 1) | (strokes == 3), geometry)
        if period > 360.0 and strokes[0] in (1, 4):
            angle = angle + 360.0  # Compression then ends at a multiple of the cycle, as it must
    columns = {name: recording.numbers(name)[order] for name in names}
    _check_cycle(angle, period, source, said)
    angle, columns = _merged(angle, columns, source)
    kept = {
        name: replace(recording.columns[name], values=values) for name, values in columns.items()
    }
    options = options.model_copy(
        update={
            "pressure_column": names,
            "direction": "forward" if backward else None,
            "dead_centre": options.dead_centre if strokes is None else "firing",
        }
    )  # fmt: skip
    return replace(recording, columns=kept, first_line=None), options, angle * DEGREE


def _check_keys(
    recording: Recording, options: PressureOptions, engine: EngineMeasures | None
) -> None:
    """Refuse keys that exclude each other, and missing dimensions."""
    label = recording.label
    if options.volume_column is not None and options.travel_column is not None:
        raise SceneError(f"{label}: volume_column and travel_column: only one of them")
    mine = "volume_column" if options.volume_column is not None else "travel_column"
    for key in ("angle_column", "angle_increment", "encoder_column", "columns_are"):
        if getattr(options, key) is not None:
            raise SceneError(f"{label}: {mine} and {key}: only one of them")
    if options.zero == "BDC":
        raise SceneError(f"{label}: {mine} and zero: only one of them; the travel tells its zero")
    if options.crank_ratio is None and (engine is None or "crank_ratio" not in engine.values):
        raise SceneError(
            f"{label}: {mine}: needs crank_ratio, or an engine, for the crank angle of each point"
        )
    measures = () if engine is None else engine.values
    if mine == "volume_column":
        for key in ("bore", "stroke"):
            if key not in measures:
                raise SceneError(f"{label}: volume_column: needs an engine with its {key}")


def _travel(
    source: _Source, options: PressureOptions, geometry: CylinderGeometry,
    engine: EngineMeasures | None, said: list[str],
) -> Floats:  # fmt: skip
    """Distance of the piston from top dead centre over the stroke, from the columns of the file."""
    recording, name = source.recording, source.name
    values = recording.numbers(name)
    if values.ndim > 1:
        raise SceneError(f"{source}: has several rows of points; must be one column")
    over_volume = source.key == "volume_column"
    own = options.volume_unit if over_volume else options.travel_unit
    ending = re.search(r"[_\s]([A-Za-z]{1,7}[23]?)$", name)
    unit = own or recording.columns[name].unit or (ending[1] if ending else "")
    # Cubic metres in each unit of volumes
    volumes = {
        "m3": 1.0, "dm3": 1e-3, "l": 1e-3, "litre": 1e-3, "liter": 1e-3, "cm3": CUBIC_CENTIMETRE,
        "ccm": CUBIC_CENTIMETRE, "cc": CUBIC_CENTIMETRE, "ml": CUBIC_CENTIMETRE, "mm3": 1e-9,
        "in3": 0.0254**3,
    }  # fmt: skip
    lengths = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254}  # Metres in each unit of lengths
    # Factor from each unit to fractions of the stroke
    parts = {"1": 1.0, "-": 1.0, "x/s": 1.0, "%": 0.01, "percent": 0.01}
    known = volumes if over_volume else {**parts, **lengths}
    plain = unit.strip().lower().replace("³", "3").replace("^", "").replace("**", "")
    if not plain and not over_volume:
        plain = "1"
        said.append(f"'{one_line(name, 60)}' taken as fractions of the stroke")
    if plain not in known:
        unit_key = source.key.replace("column", "unit")
        raise SceneError(
            f"{source}: {f'unit {shown(unit)}' if unit else 'states no unit'}; must have "
            f"{unit_key} out of {', '.join(known)}"
        )
    if over_volume:
        if geometry.compression_ratio is None:
            raise SceneError(
                f"{source}: needs compression_ratio: volumes count from the cylinder head"
            )
        volume = values * known[plain]
        return np.asarray((volume - geometry.clearance_volume) / geometry.swept_volume)
    if plain in parts:
        return np.asarray(values * known[plain])
    if engine is None or "stroke" not in engine.values:
        raise SceneError(f"{source}: in {unit}: needs an engine with its stroke")
    return np.asarray(values * known[plain] / geometry.stroke)


def _inside(travel: Floats, source: _Source, said: list[str]) -> Floats:
    """Travels from 0 to 1; points slightly beyond a dead centre are moved to it."""
    beyond = np.maximum(-travel, travel - 1.0)
    worst = int(np.argmax(beyond))
    # Points may lie beyond a dead centre by a thousandth of the stroke; they are moved to it.
    if beyond[worst] > 1e-3:
        raise SceneError(
            f"{source.at(worst)}, column '{one_line(source.name, 60)}': lies at "
            f"{travel[worst]:.4g} of the stroke from top dead centre; must be from 0 to 1 "
            f"(check unit{', compression_ratio' if source.key == 'volume_column' else ''} and "
            "the engine's measures)"
        )
    if beyond[worst] > SAME:
        said.append(
            f"{counted(int((beyond > SAME).sum()), 'point')} beyond a dead centre, by up to "
            f"{beyond[worst]:.2g} of the stroke, moved to the dead centre"
        )
    return np.asarray(np.clip(travel, 0.0, 1.0))


def _numbers_of_strokes(recording: Recording, name: str, period: float) -> Integers:
    """Number of the stroke that each point belongs to."""
    allowed = tuple(STROKES) if period > 360.0 else (2, 3)
    listed = ", ".join(f"{number} ({STROKES[number]})" for number in allowed)
    column = recording.columns[name]
    wrong = ~np.isin(column.values, allowed)
    if wrong.any():
        row = int(np.argmax(wrong))
        text = column.text[1] if column.text is not None and column.text[0] == row else ""
        said = one_line(text, 40) or f"{column.values[row]:g}"
        raise SceneError(
            f"{recording.at(row)}, column '{one_line(name, 60)}': '{said}': must be one of {listed}"
        )
    return np.asarray(column.values.astype(np.int64))


def _pressure_columns(recording: Recording, options: PressureOptions, used: set[str]) -> list[str]:
    """Columns of pressure: those asked for, otherwise all without volume and stroke."""
    wanted = wanted_pressures(recording, options)
    if wanted is not None:
        return wanted
    rest = [name for name in recording.columns if name not in used]
    if len(rest) != 1:
        raise SceneError(
            f"{recording.label}: pressure_column: cannot be determined from the columns "
            f"({one_line(', '.join(repr(name) for name in rest[:20]), 300)}); give the name or "
            "number of one"
        )
    return rest


def _moves_down(travel: Floats, source: _Source) -> Booleans:
    """Whether the piston moves down at each point, by the places where its travel turns back."""
    count = len(travel)
    steps = np.diff(travel)
    signs = np.where(np.abs(steps) <= SAME, 0.0, np.sign(steps))
    moving = np.flatnonzero(signs)
    if not len(moving):
        raise SceneError(f"{source}: the piston does not move; is this the right column?")
    # At first, a step in which the piston does not move counts with the movement before it.
    last = np.maximum.accumulate(np.where(signs != 0.0, np.arange(count - 1), -1))
    sense = np.where(last >= 0, signs[last], signs[moving[0]])
    down = np.append(sense > 0.0, sense[-1] > 0.0)
    for change in np.flatnonzero(sense[1:] != sense[:-1]) + 1:
        first = change
        while first > 0 and abs(travel[first - 1] - travel[change]) <= SAME:
            first -= 1
        _check_turn(travel[change], bool(sense[change] > 0.0), source, int(change))
        run = change - first + 1  # Number of points at the turning point
        down[first : first + run // 2] = sense[change] < 0.0
        down[first + (run + 1) // 2 : change + 1] = sense[change] > 0.0
        if run % 2:
            middle = first + run // 2
            down[middle] = _belongs_down(travel, int(middle), int(first), int(change),
                                         bool(sense[change] > 0.0))  # fmt: skip
    return down


def _belongs_down(travel: Floats, middle: int, first: int, end: int, begins_down: bool) -> bool:
    """Whether the last point before or the first after a dead centre is on the way down."""
    # The point belongs to the side on which the steps of angle next to it are more alike. Near a
    # dead centre the travel grows as the square of the angle, so its root stands for the angle.
    at = 1.0 if not begins_down else 0.0
    here = math.sqrt(abs(travel[middle] - at))
    before = math.sqrt(abs(travel[first - 1] - at)) if first > 0 else here
    after = math.sqrt(abs(travel[end + 1] - at)) if end + 1 < len(travel) else here
    # If the point stays on the side before the turn, the steps to its neighbours are before - here
    # and after + here; on the other side they are before + here and after - here.
    on_old = abs(before - here - (after + here))
    on_new = abs(before + here - (after - here))
    return begins_down if on_new < on_old else not begins_down


def _check_turn(travel: float, at_top: bool, source: _Source, place: int) -> None:
    apart = travel if at_top else 1.0 - travel
    # Fraction of the stroke within which a loop must approach a dead centre to turn back
    near = 0.02
    if apart > near:
        raise SceneError(
            f"{source.at(place)}, column '{one_line(source.name, 60)}': turns back at {travel:.4g} "
            f"of the stroke; must {'fall' if at_top else 'rise'} on to within {near:g} of the "
            f"stroke of {'top' if at_top else 'bottom'} dead centre"
        )


def _check_strokes(travel: Floats, strokes: Integers, source: _Source, period: float) -> None:
    """Refuse strokes out of order, and a travel that contradicts its stroke."""
    down = (strokes == 1) | (strokes == 3)
    following = strokes % 4 + 1 if period > 360.0 else 5 - strokes
    steps = np.diff(travel)
    for i in range(len(travel) - 1):
        if strokes[i + 1] != strokes[i]:
            if strokes[i + 1] != following[i]:
                raise SceneError(
                    f"{source.at(i + 1)}: {STROKES[int(strokes[i + 1])]} follows "
                    f"{STROKES[int(strokes[i])]}; must be {STROKES[int(following[i])]}"
                )
            for place in (i, i + 1):
                _check_turn(float(travel[place]), bool(down[i + 1]), source, place)
        elif steps[i] * (1.0 if down[i] else -1.0) < -SAME:
            raise SceneError(
                f"{source.at(i + 1)}, column '{one_line(source.name, 60)}': goes from "
                f"{travel[i]:.4g} to {travel[i + 1]:.4g} of the stroke; must "
                f"{'rise' if down[i] else 'fall'} in {STROKES[int(strokes[i])]}"
            )


def _angles(travel: Floats, down: Booleans, geometry: CylinderGeometry) -> Floats:
    """Crank angles of the points [degree]; a turn begins where the piston turns back upwards."""
    turn = np.cumsum(np.append(False, ~down[1:] & down[:-1]))
    offset = geometry.offset_ratio
    stroke = 2.0 * float(dead_centres(geometry.crank_ratio, offset).stroke)
    angle = angle_of_travel(travel * stroke, down, geometry.crank_ratio, offset)
    return np.asarray(angle / DEGREE + 360.0 * turn)


def _merged(
    angle: Floats, columns: dict[str, Floats], source: _Source
) -> tuple[Floats, dict[str, Floats]]:
    """Points of one angle as one, with the average of their pressures, if these are alike."""
    new = np.append(True, np.diff(angle) > 1e-7)
    if new.all():
        return angle, columns
    group = np.cumsum(new) - 1
    size = np.bincount(group)
    merged = {}
    # Share of the largest pressure by which pressures that are averaged may differ
    alike = 0.02
    for name, values in columns.items():
        low, high = np.full(len(size), np.inf), np.full(len(size), -np.inf)
        np.minimum.at(low, group, values)
        np.maximum.at(high, group, values)
        most = float(np.abs(values).max())
        worst = int(np.argmax(high - low))
        if high[worst] - low[worst] > alike * most:
            raise SceneError(
                f"{source.recording.label}, '{one_line(name, 60)}': two pressures, "
                f"{low[worst]:.4g} and {high[worst]:.4g}, at one piston position near crank angle "
                f"{angle[np.argmax(group == worst)]:.4g} degree; must agree within "
                f"{100.0 * alike:.0f} % of the largest"
            )
        merged[name] = np.bincount(group, weights=values) / size
    return angle[new], merged


def _check_cycle(angle: Floats, period: float, source: _Source, said: list[str]) -> None:
    """Refuse an incomplete cycle, and points that are too far apart."""
    if len(angle) < 8:
        raise SceneError(f"{source}: {counted(len(angle), 'point')}; must be 8 at least")
    steps = np.diff(angle)
    span = float(angle[-1] - angle[0])
    if span < period - LONGEST:
        passed = round(span / 180.0)
        raise SceneError(
            f"{source}: passes {counted(passed, 'dead centre')}; must be {period / 180.0:g} in the "
            "order of the strokes, a whole cycle"
        )
    widest = int(np.argmax(steps))
    if steps[widest] > LONGEST:
        raise SceneError(
            f"{source.at(widest + 1)}, column '{one_line(source.name, 60)}': the crank turns by "
            f"{steps[widest]:.3g} degree from the point before; must be {LONGEST:g} at most: near "
            "dead centres, points of little difference in travel are far apart in angle"
        )
    over = "volume" if source.key == "volume_column" else "travel"
    said.append(
        f"pressure over {over}: crank angles of {len(angle)} points by the mechanism, at most "
        f"{max(float(steps.max()), period - span):.3g} degree apart"
    )
