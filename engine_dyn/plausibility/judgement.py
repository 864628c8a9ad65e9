"""Values are compared with the usual ranges: what is outside, by how much, and what may be meant.

Arrays may be long: where no corner of the box that all values span is outside, none of them is,
because every measure rises or falls all the way with each of its parameters.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from engine_dyn.geometry.arrangement import FOUR_STROKE
from engine_dyn.given_numbers import given_array
from engine_dyn.plausibility.usual_ranges import CHECKS, DIAGRAM_CHECKS, SUSPICIONS, Check
from engine_dyn.pressure.diagram import Diagram
from engine_dyn.types import Floats

AT_ONCE = 1 << 18  # Number of values of one measure that are computed at a time

MOST_CORNERS = 12
"""Largest number of varying parameters for which the corners of their box are examined first."""

SI_UNITS: Mapping[str, tuple[str, float]] = {
    **dict.fromkeys(("bore", "stroke", "rod", "rod_length", "rod_centre_of_gravity", "pin_offset",
                     "cylinder_spacing"), ("m", 1.0)),
    **dict.fromkeys(("reciprocating_mass", "rod_mass", "piston_mass", "crank_mass"), ("kg", 1.0)),
    **dict.fromkeys(("inertia", "rod_inertia"), ("kg m2", 1.0)),
    **dict.fromkeys(("speed", "start_speed", "motor_synchronous_speed"), ("rad/s", 1.0)),
    **dict.fromkeys(("crankcase_pressure", "pressure"), ("Pa", 1.0)),
    **dict.fromkeys(("friction_torque", "load_offset"), ("N m", 1.0)),
}  # fmt: skip
"""Unit and SI factor of values given in Python: SI units, and none for dimensionless numbers."""


class ImplausibleWarning(UserWarning):
    """A value that engines do not have: often another unit. The computation goes on.

    Examples
    --------
    >>> import warnings
    >>> import engine_dyn
    >>> import numpy as np
    >>> degrees = [-360, -300, -240, -180, -135, -90, -60, -45, -30, -15, 0, 10, 20, 30, 45, 60]
    >>> bar = [1.0, 1.0, 1.0, 1.0, 1.2, 2.2, 4.3, 7.1, 14, 28, 48, 56, 46, 32, 18, 11]
    >>> degrees += [75, 90, 120, 150, 180, 240, 300]
    >>> bar += [7.5, 5.5, 3.6, 2.3, 1.2, 1.0, 1.0]
    >>> diagram = engine_dyn.diagram_from_points(np.radians(degrees), 1e5 * np.array(bar))
    >>> with warnings.catch_warnings(record=True) as caught:
    ...     warnings.simplefilter("always")
    ...     found = engine_dyn.periodic_speed(
    ...         diagram,
    ...         bore=0.1,
    ...         stroke=0.12,
    ...         crank_ratio=0.25,
    ...         reciprocating_mass=1.5,
    ...         inertia=1.0,
    ...         speed=1500.0,  # in rpm; speed is in rad/s
    ...     )
    >>> caught[0].category is engine_dyn.ImplausibleWarning
    True
    """


@dataclass(frozen=True)
class Implausible:
    """One measure outside its usual range. Its text is one line.

    Attributes
    ----------
    check : Check
        The measure.
    value : float
        The worst value, in the unit of the check.
    given : tuple of str
        Values that it follows from, such as "speed = 126 rpm".
    question : str
        The value that may be meant; empty where nothing usual fits.
    key : str
        The parameter that is asked about, or the first that may be wrong.
    count, of : int
        How many values are outside, out of how many.
    place : tuple of int
        Where the worst is, in the shape of the values together.
    others : tuple of str
        Further parameters to which the question may belong as well.

    Examples
    --------
    >>> import engine_dyn
    >>> (found,) = engine_dyn.implausible(bore=80.0)  # in mm; bore is in m
    >>> found.value, found.check.unit
    (80.0, 'm')
    """

    check: Check
    value: float
    given: tuple[str, ...]
    question: str
    key: str
    count: int = 1
    of: int = 1
    place: tuple[int, ...] = ()
    others: tuple[str, ...] = ()

    def text(self, places: str = "") -> str:
        """One line; `places` says how many designs, and which."""
        check = self.check
        unit = f" {check.unit}" if check.unit else ""
        usual = f"usual is {_number(check.low)} to {_number(check.high)}{unit}"
        if check.plain and self.given and self.given[0].startswith(f"{check.needs[0]} = "):
            parts = [f"{check.name}: {self.given[0].removeprefix(f'{check.name} = ')}", usual]
        else:
            of = f" ({', '.join(self.given)})" if self.given else ""
            parts = [f"{check.name}: {check.what} is {_number(self.value)}{unit}{of}", usual]
        parts += [self._times()] if self._times() else []
        parts += [places] if places else []
        keys = " or ".join((self.key, *self.others))
        parts += [f"is {keys} {self.question}?"] if self.question else []
        return "; ".join(parts)

    def __str__(self) -> str:
        return self.text(f"{self.count} of {self.of} values" if self.of > 1 else "")

    def _times(self) -> str:
        """Text that says how many times a value is too large or too small, where it is by far."""
        check, value = self.check, self.value
        if check.low < 0.0 or value <= 0.0:
            return ""
        if value > 2.0 * check.high:
            return f"{_number(value / check.high)} times the usual maximum"
        if value < 0.5 * check.low:
            return f"a factor of {_number(check.low / value)} below the usual minimum"
        return ""


def implausible(
    diagram: Diagram | None = None, *, driven: bool = False, silenced: Collection[str] = (),
    **values: Any,
) -> tuple[Implausible, ...]:  # fmt: skip
    """Compare an engine, or arrays of them, with what engines usually have.

    `periodic_speed` does so with one design and warns (`ImplausibleWarning`); for arrays of designs
    call this once.

    Parameters
    ----------
    diagram : Diagram, optional
        Indicator diagram.
    driven : bool
        Whether it is that of a driven machine, such as a compressor.
    silenced : collection of str
        Names of measures that are not looked at.
    **values : float or array_like
        Any of the parameters of `periodic_speed` and of `needs` in
        `engine_dyn.plausibility.usual_ranges`, SI, which broadcast; a measure is looked at where
        all that it needs is given. Names that no measure needs are ignored.

    Returns
    -------
    tuple of Implausible
        One for each measure that is outside its range; `str` makes a line of it. A parameter whose
        value is questioned is not looked at in further measures.

    Examples
    --------
    >>> import engine_dyn
    >>> (found,) = engine_dyn.implausible(bore=80.0)  # in mm; bore is in m
    >>> found.key
    'bore'
    """
    unusual: list[Implausible] = []
    values = {n: v if isinstance(v, float | int) else _array(n, v) for n, v in values.items()}
    if diagram is not None:
        values.setdefault("period", diagram.period)
        unusual += judged_diagrams((diagram,), driven=driven, silenced=frozenset(silenced))
    if "offset" in values:
        values["pin_offset"], values["crank_offset"] = values.pop("offset"), 0.0
    wrong: set[str] = set()
    for check in _checks_of(frozenset(values)):
        base = {need: values[need] for need in check.needs}
        if check.name in silenced or not wrong.isdisjoint(base) or check.inside(*base.values()):
            continue

        def measured(given: Mapping[str, Any], check: Check = check) -> Any:
            return check.measure(*(given[need] for need in check.needs))

        one = judged(check, base, measured, SI_UNITS)
        if one is not None:
            wrong.add(one.key)
            unusual.append(one)
    return tuple(unusual)


def _array(name: str, values: Any) -> Any:
    """An array of numbers, or a single number."""
    array = given_array(name, values)
    return array if array.ndim else float(array)


@lru_cache(maxsize=64)
def _checks_of(names: frozenset[str]) -> tuple[Check, ...]:
    """Checks of given values whose needs are all known; cached, because searches ask repeatedly."""
    return tuple(check for check in CHECKS if names.issuperset(check.needs))


def judged(
    check: Check,
    base: Mapping[str, Any],
    measured: Callable[[Mapping[str, Any]], Any],
    units: Mapping[str, tuple[str, float]],
) -> Implausible | None:
    """Compare one measure with its range; None where it is inside.

    Parameters
    ----------
    check : Check
        The measure.
    base : mapping
        Numbers and arrays that broadcast, from which it follows, in the units of `units`; what is
        no number goes through.
    measured : callable
        The measure [SI] of such a mapping.
    units : mapping
        Unit of each parameter as the person writes it, and its SI value.
    """
    arrays = {n: v for n, v in base.items() if isinstance(v, np.ndarray) and v.size > 1}
    if arrays and len(arrays) <= MOST_CORNERS:
        ends = [(float(values.min()), float(values.max())) for values in arrays.values()]
        corners = np.array(list(itertools.product(*ends)), dtype=float).T
        span = measured({**base, **dict(zip(arrays, corners, strict=True))})
        if not outside(check, span).any():
            return None
    count, of, point = 1, 1, dict(base)
    place: tuple[int, ...] = ()
    if arrays:
        count, of, place = _worst(check, base, measured)
        if not count:
            return None
        point = {
            name: np.broadcast_to(values, _shape(base))[place] if name in arrays else values
            for name, values in base.items()
        }
    elif not outside(check, measured(base)):
        return None
    point = {n: float(np.asarray(v).reshape(-1)[0]) if _is_number(v) else v
             for n, v in point.items()}  # fmt: skip
    value = float(np.asarray(measured(point)).reshape(-1)[0]) / check.si
    given = tuple(
        f"{key} = {point[key]:.6g} {units.get(key, ('',))[0]}".strip()
        for key in dict.fromkeys((*check.blames, *check.needs))
        if _is_number(point.get(key)) and key != "period" and (point[key] or check.plain)
    )
    (key, *others), question = _question(check, point, value, measured, units)
    return Implausible(check, value, given, question, key, count, of, place, tuple(others))


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float | np.number | np.ndarray)


def outside(check: Check, measure: Any) -> Any:
    """Whether a measure [SI] is outside the range; NaN is not."""
    low, high = check.edges
    bad = (measure < low) | (measure > high)
    if check.zero:
        bad = bad & (measure != 0.0)
    return bad


def _shape(base: Mapping[str, Any]) -> tuple[int, ...]:
    return np.broadcast_shapes(*(np.shape(v) for v in base.values() if _is_number(v)))


def _worst(
    check: Check, base: Mapping[str, Any], measured: Callable[[Mapping[str, Any]], Any]
) -> tuple[int, int, tuple[int, ...]]:
    """Number of values outside a range, number of values, and the place of the worst one."""
    shape = _shape(base)
    count, worst, place = 0, -math.inf, (0,) * len(shape)
    for piece in _pieces(shape):
        some = {
            name: values[_part(np.shape(values), piece, len(shape))]
            if isinstance(values, np.ndarray) and values.ndim
            else values
            for name, values in base.items()
        }
        with np.errstate(all="ignore"):
            measure = np.asarray(measured(some), dtype=float)
        bad = outside(check, measure)
        if not bad.any():
            continue
        extent = tuple(s.stop - s.start for s in piece)
        count += int(bad.sum()) * (math.prod(extent) // max(measure.size, 1))
        far = np.where(bad, _distance(check, measure), -math.inf)
        here = np.unravel_index(int(np.argmax(far)), far.shape)
        if far[here] > worst:
            worst = float(far[here])
            lead = len(shape) - far.ndim
            place = tuple(
                s.start + (int(here[i - lead]) if i >= lead else 0) for i, s in enumerate(piece)
            )
    return count, math.prod(shape), place


def _distance(check: Check, measure: Floats) -> Floats:
    """Distance of a measure from its range; relative where the range has a sign."""
    low, high = check.low * check.si, check.high * check.si
    with np.errstate(all="ignore"):
        if low > 0.0:
            return np.abs(np.log(np.maximum(measure, 1e-300) / math.sqrt(low * high)))
        return np.abs(measure - 0.5 * (low + high))


def _pieces(shape: Sequence[int]) -> Iterator[tuple[slice, ...]]:
    """Index ranges that cut an array into pieces of at most about `AT_ONCE` values."""
    rest = 1
    steps = [1] * len(shape)
    for i in reversed(range(len(shape))):
        steps[i] = max(1, min(shape[i], AT_ONCE // rest))
        rest *= steps[i]
    ranges = [
        [slice(b, min(b + step, n)) for b in range(0, n, step)]
        for n, step in zip(shape, steps, strict=True)
    ]
    yield from itertools.product(*ranges)


def _part(shape: Sequence[int], piece: Sequence[slice], dims: int) -> tuple[slice, ...]:
    """Index range of a piece in one of the arrays that broadcast."""
    own = piece[dims - len(shape) :]
    return tuple(slice(0, 1) if n == 1 else s for n, s in zip(shape, own, strict=True))


def _question(
    check: Check, point: Mapping[str, Any], value: float,
    measured: Callable[[Mapping[str, Any]], Any], units: Mapping[str, tuple[str, float]],
) -> tuple[Sequence[str], str]:  # fmt: skip
    """Parameters that may be wrong, and values that may be meant: a unit before a decimal place."""
    keys = [key for key in check.blames if key in point]
    for place, key in enumerate(keys):
        size = units.get(key, ("", 1.0))[1]
        fitting: list[tuple[int, str]] = []
        plain = key.rstrip("0123456789").removesuffix("_")  # bore for bore_2
        for suspicion in SUSPICIONS.get(plain, ()):
            meant = suspicion.meant(point[key]) / size
            if math.isclose(meant, point[key], rel_tol=1e-9):
                continue
            # NaN stands for a meaning of another dimension, whose value cannot be computed.
            if math.isnan(meant):
                fitting.append((0, suspicion.question))
                continue
            far = _fit(check, {**point, key: meant}, measured)
            if far is not None:
                fitting.append((int(2.0 * far) if check.low > 0.0 else 0, suspicion.question))
        if fitting:
            # The value nearest to the middle of the range; of equally near ones, the most usual.
            return [key], min(fitting, key=lambda fit: fit[0])[1]
        if place == 0 and check.low > 0.0 and not 0.5 * check.low <= value <= 2.0 * check.high:
            tens = [(k, {**point, k: point[k] * ten}) for k in keys for ten in (10.0, 0.1)]
            fits = [k for k, changed in tens if _fit(check, changed, measured) is not None]
            if wrong := list(dict.fromkeys(fits)):
                return wrong, "wrong by a decimal place"
    return (keys or list(check.blames))[:1], ""


def _fit(
    check: Check, point: Mapping[str, Any], measured: Callable[[Mapping[str, Any]], Any]
) -> float | None:
    """Distance of a measure from the middle of its range; None where it is outside."""
    with np.errstate(all="ignore"):
        measure = np.asarray(measured(point), dtype=float).reshape(-1)
    if not np.isfinite(measure).all() or outside(check, measure).any():
        return None
    return float(_distance(check, measure)[0])


def _number(value: float) -> str:
    return f"{value:.3g}"


# --- indicator diagrams ---------------------------------------------------------------------------

SAMPLES = 720  # Number of angles of a cycle over which a diagram's work is summed

_FACTS = ("largest", "lowest", "peak_angle", "imep", "rise")


@lru_cache(maxsize=1024)
def _facts(diagram: Diagram) -> tuple[float, ...]:
    """Measures of a diagram in SI units, in the order of `_FACTS`."""
    phi = (np.arange(SAMPLES) / SAMPLES - 0.5) * diagram.period
    # A crank ratio of 0.3 serves all engines: the mean effective pressure hardly depends on it.
    lean = 0.3 * np.sin(phi)
    velocity = np.sin(phi) + lean * np.cos(phi) / np.sqrt(1.0 - lean * lean)
    imep = float(np.mean(diagram(phi) * velocity)) * 0.5 * diagram.period
    angle = float(diagram.angle[int(np.argmax(diagram.pressure))])
    late, early = diagram(np.radians([-60.0, -90.0]))
    # Ports of a two-stroke engine may still be open 90 degrees before dead centre.
    rise = float(late / early) if math.isclose(diagram.period, FOUR_STROKE) else math.nan
    return diagram.peak, float(diagram.pressure.min()), angle, imep, rise


def indicated_pressure(diagram: Diagram) -> float:
    """Return the mean effective pressure [Pa] of a diagram, for a usual ratio of crank and rod."""
    return _facts(diagram)[_FACTS.index("imep")]


@lru_cache(maxsize=64)
def judged_diagrams(
    diagrams: tuple[Diagram, ...], *, driven: bool, silenced: frozenset[str] = frozenset(),
    written: float = 1.0,
) -> tuple[Implausible, ...]:  # fmt: skip
    """Compare indicator diagrams with what engines have: the worst of them, measure by measure.

    Parameters
    ----------
    diagrams : tuple of Diagram
        All that may be used. Sessions ask for the same again and again: what is found is cached.
    driven : bool
        Whether they are of a driven machine, such as a compressor.
    silenced : frozenset of str
        Names of measures that are not looked at.
    written : float
        SI value of the unit in which their pressures are written.
    """
    columns = np.array([_facts(diagram) for diagram in diagrams]).T
    facts = dict(zip(_FACTS, columns, strict=True))
    facts["burns"] = np.full(len(diagrams), not driven)
    unusual: list[Implausible] = []
    for check in DIAGRAM_CHECKS:
        if check.name in silenced:
            continue
        measure = np.asarray(check.measure(*(facts[need] for need in check.needs)), dtype=float)
        bad = outside(check, measure)
        if not bad.any():
            continue
        place = int(np.argmax(np.where(bad, _distance(check, measure), -math.inf)))
        value = float(measure[place]) / check.si
        question = _question_of_diagram(check, value, written)
        unusual.append(
            Implausible(
                check, value, (), question, "the diagram's " + check.blames[0], int(bad.sum()),
                len(diagrams), (place,),
            )
        )  # fmt: skip
        if question:
            break  # a wrong unit or angle makes the other measures wrong too
    return tuple(unusual)


def _question_of_diagram(check: Check, value: float, written: float) -> str:
    """Question after the pressures that a diagram may mean; empty where nothing usual fits."""
    if check.blames == ("angle",):
        late = value < check.low if check.name == "compression_rise" else value > check.high
        shift = "late" if late else "early"
        if check.name == "compression_rise":  # a shift of all pressures changes it too
            return f"{shift}? Or is its pressure too {'high' if late else 'low'}"
        return shift
    if check.name not in ("peak_pressure", "lowest_pressure"):
        return ""
    for suspicion in SUSPICIONS["pressure"]:
        meant = suspicion.meant(value * check.si / written) / check.si
        if not math.isclose(meant, value, rel_tol=1e-9) and check.low <= meant <= check.high:
            return suspicion.question
    return ""
