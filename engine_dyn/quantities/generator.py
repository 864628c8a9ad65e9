"""Nodes of a generator: the angle over the cycle, the grid that holds it, and times in the cycle.

See `engine_dyn.time_over_angle`. Angles are those of the crank; those of the
generator's voltage are its pole pairs times as large, and times the ratio of a gear between.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from engine_dyn import time_over_angle as times
from engine_dyn.quantities.node import Node, formula, hidden, parameter
from engine_dyn.units import DEGREE

KUNDUR = "Kundur, example 12.2"
DEVIATION = "this project: angle less the mean speed times the time"
SWING = "Newton's law, rigid rotor on a spring"

INTERVAL = ("interval_begin", "interval_end")
_ANGLES: dict[str, Any] = {
    "si": DEGREE, "low": -720.0, "high": 720.0, "low_included": True, "high_included": True
}  # fmt: skip

PARAMETERS: tuple[Node, ...] = (
    parameter(
        "pole_pairs", "p", "1", "pairs of poles of the generator", "this project", whole=True,
        low=1.0, low_included=True,
    ),
    parameter(
        "angle_deviation_limit", r"\theta_{lim}", "degree",
        "largest allowed deviation of the angle to either side, electrical", "this project",
        si=DEGREE, low=0.0,
    ),
    parameter(
        "synchronising_torque", "c_s", "N m rad-1",
        "synchronising torque of the generator at its own shaft, per radian of its shaft; by "
        "default from synchronising_power", KUNDUR, low=0.0,
        make=lambda synchronising_power, pole_pairs, speed, gear_ratio: times.torque_from_power(
            synchronising_power, pole_pairs, gear_ratio * speed
        ),
    ),
    parameter(
        "synchronising_power", "P_s", "W rad-1",
        "synchronising power of the generator per electrical radian, in place of "
        "synchronising_torque", KUNDUR, low=0.0,
    ),
    parameter(
        "damping_torque", "d_s", "N m s rad-1",
        "damping torque of the generator at its own shaft, per deviation of its speed", KUNDUR,
        low=0.0, low_included=True, unless_given=0.0,
    ),
    parameter(
        "resonance_band", "b", "1",
        "distance from the natural order against the grid, over it, within which an excited order "
        "is warned of", "this project", low=0.0, high=1.0, high_included=True, unless_given=0.2,
    ),
    parameter(
        INTERVAL[0], r"\varphi_a", "degree", "crank angle at which an interval begins",
        "this project", **_ANGLES,
    ),
    parameter(
        INTERVAL[1], r"\varphi_b", "degree",
        "crank angle at which an interval ends, the next time that it is reached", "this project",
        **_ANGLES,
    ),
)  # fmt: skip


def _electrical(of: Node) -> Node:
    """Node for the generator's voltage: the angle times pole pairs and gear ratio."""
    stem = "grid_angle" if of.name.startswith("grid_angle") else "angle_deviation"
    return Node(
        of.name.replace(stem, f"{stem}_electrical"), f"p {of.symbol}", of.unit,
        of.long_name.replace("angle of", "electrical angle of", 1), of.source,
        needs=(of.name, "pole_pairs", "gear_ratio"), si=of.si, kind=of.kind,
        make=lambda pole_pairs, gear_ratio, **angle: pole_pairs * gear_ratio * angle[of.name],
    )  # fmt: skip


# --- angular deviation of a shaft that runs alone -------------------------------------------------


def _close_curve(omega: Any, period: float) -> tuple[Any, Any, float]:
    """Angular deviation at equal steps, its slope, and the step [rad]."""
    turn = times.cycle_time(omega, period)[..., None]
    curve = times.angle_deviation(omega, period)
    return curve, 1.0 - period / turn / omega, period / np.shape(omega)[-1]


_EXTREMES = np.dtype([("low", np.float64), ("high", np.float64)])
"""Fields of extremes: smallest and largest deviation [rad]."""


def _extremes(*, omega_close: Any, curve_period: float) -> Any:
    extremes = times.extremes(*_close_curve(omega_close, curve_period))
    result = np.empty(extremes[0].shape, dtype=_EXTREMES)
    result["low"], result["high"] = extremes
    return result


def _extreme(which: str) -> Callable[..., Any]:
    return lambda angle_deviation_extremes: angle_deviation_extremes[which]


def _curve(*, omega_close: Any, crank_angle: Any, close_angle: Any, curve_period: float) -> Any:
    curve, slope, step = _close_curve(np.asarray(omega_close)[..., 0, :], curve_period)
    place = (np.ravel(crank_angle) - np.ravel(close_angle)[0]) / step
    return times.between(curve, slope, step, place)


def _deviation_order(*, angle_deviation: Any, omega: Any, crank_angle: Any, order: Any) -> Any:
    # The axis of orders, of length 1 here, comes before the axis of the crank angle.
    curve, speed = np.asarray(angle_deviation)[..., 0, :], np.asarray(omega)[..., 0, :]
    return np.abs(times.deviation_harmonics(curve, speed, np.ravel(crank_angle), np.ravel(order)))


_TEXT = "angle of the shaft against uniform rotation"


def _deviation(ending: str, symbol: str, text: str, needs: tuple[str, ...],
               make: Callable[..., Any], **more: Any) -> Node:  # fmt: skip
    return Node(f"angle_deviation{ending}", symbol, "degree", text, DEVIATION, needs=needs,
                make=make, si=DEGREE, **more)  # fmt: skip


_DEVIATIONS = (
    _deviation(
        "", r"\theta", f"{_TEXT}, positive where it is ahead",
        ("omega_close", "crank_angle", "close_angle", "curve_period"), _curve, kind="curve",
        removes=("close_angle",),
    ),
    _deviation("_max", r"\theta_{max}", f"largest {_TEXT}",
               ("angle_deviation_extremes",), _extreme("high"),
               extreme_of=("angle_deviation", "largest")),
    _deviation("_min", r"\theta_{min}", f"least {_TEXT}",
               ("angle_deviation_extremes",), _extreme("low"),
               extreme_of=("angle_deviation", "smallest")),
    _deviation(
        "_largest", r"\theta_{largest}", f"largest {_TEXT}, to either side",
        ("angle_deviation_max", "angle_deviation_min"),
        lambda angle_deviation_max, angle_deviation_min: np.maximum(
            angle_deviation_max, -angle_deviation_min
        ),
    ),
    _deviation(
        "_half_range", r"\hat\theta", f"{_TEXT}, half of its range over the cycle",
        ("angle_deviation_max", "angle_deviation_min"),
        lambda angle_deviation_max, angle_deviation_min: 0.5
        * (angle_deviation_max - angle_deviation_min),
    ),
    _deviation(
        "_order", r"\theta_\nu", f"amplitude of the orders of the {_TEXT}, over the time",
        ("angle_deviation", "omega", "crank_angle", "order"), _deviation_order,
        removes=("crank_angle",), width=2048,
    ),
)  # fmt: skip

# --- operation on the grid ------------------------------------------------------------------------


def _grid_curve(of: str) -> Callable[..., Any]:
    def make(*, order: Any, crank_angle: Any, **needs: Any) -> Any:
        harmonics = np.asarray(needs[of])[..., 0]  # drops the axis of the crank angle
        return times.sum_of_orders(harmonics, np.ravel(order), np.ravel(crank_angle))

    return make


def _swing(what: str, symbol: str, of_orders: str, unit: str, si: float, text: str) -> list[Node]:
    """Nodes of curve, amplitudes and half range that follow from harmonics of any kind."""
    of = f"{what}_harmonics"
    amplitude = f"amplitude of the orders of the {text}"
    return [
        Node(what, symbol, unit, text, SWING, kind="curve", si=si,
             needs=(of, "order", "crank_angle"), removes=("order",), make=_grid_curve(of)),
        Node(f"{what}_order", of_orders, unit, amplitude, SWING,
             needs=(of,), si=si, make=lambda **needs: np.abs(needs[of])),
        Node(f"{what}_half_range", rf"\hat{{{symbol}}}", unit,
             f"{text}, half of its range over the cycle", SWING,
             needs=(of, "order", "curve_period"), removes=("order",), si=si, width=12288,
             extreme_of=(what, "half_range"), make=lambda order, curve_period, **needs:
             times.half_range(needs[of], np.ravel(order), curve_period)),
    ]  # fmt: skip


_ANGLE = _swing(
    "grid_angle", r"\theta_g", r"\theta_{g,\nu}", "degree", DEGREE,
    "angle of the rigid rotor against the grid, from its mean",
)  # fmt: skip

# --- durations ------------------------------------------------------------------------------------


def _duration(begin: float, end: float) -> Callable[..., Any]:
    return lambda omega, crank_angle, curve_period: times.duration(
        omega, np.ravel(crank_angle)[0], begin, end, curve_period
    )


def _interval(
    *, omega: Any, crank_angle: Any, period: float, curve_period: float, interval_begin: Any,
    interval_end: Any,
) -> Any:  # fmt: skip
    # The interval ends within a cycle after its begin, however long the curve is.
    end = interval_begin + period - np.mod(interval_begin - interval_end, period)
    first = np.ravel(crank_angle)[0]
    return times.duration(omega, first, interval_begin, end, curve_period)


OF_FOUR_STROKES = ("intake_duration", "exhaust_duration")
"""Durations of strokes without a half turn of their own in two-stroke engines."""

NODES: tuple[Node, ...] = (
    Node("angle_deviation_extremes", "", "", f"extremes of the {_TEXT}", public=False,
         removes=("close_angle",), make=_extremes, width=_EXTREMES.itemsize),
    *_DEVIATIONS,
    *(_electrical(node) for node in _DEVIATIONS),
    Node(
        "angle_deviation_over_limit", r"p\theta_{largest}/\theta_{lim}", "1",
        "largest electrical angle to either side over its limit, above 1 where it is exceeded",
        DEVIATION, make=lambda angle_deviation_electrical_largest, angle_deviation_limit:
        angle_deviation_electrical_largest / angle_deviation_limit,
    ),
    hidden(
        "grid_stiffness", "N m rad-1", "synchronising torque at the crank",
        lambda synchronising_torque, gear_ratio: gear_ratio**2 * synchronising_torque,
    ),
    hidden(
        "grid_damping", "N m s rad-1", "damping torque at the crank",
        lambda damping_torque, gear_ratio: gear_ratio**2 * damping_torque,
    ),
    Node(
        "electrical_frequency", "f", "Hz", "frequency of the generator's voltage at nominal speed",
        "this project",
        make=lambda pole_pairs, gear_ratio, speed: pole_pairs * gear_ratio * speed / (2.0 * np.pi),
    ),
    Node(
        "grid_natural_frequency", "f_0", "Hz",
        "natural frequency of the rigid rotor against the grid, without damping", KUNDUR,
        make=lambda inertia, grid_stiffness: times.natural_frequency(inertia, grid_stiffness)
        / (2.0 * np.pi),
    ),
    Node(
        "grid_natural_order", r"\nu_0", "1",
        "natural frequency of the rigid rotor against the grid, as an order", KUNDUR,
        make=lambda grid_natural_frequency, speed: 2.0 * np.pi * grid_natural_frequency / speed,
    ),
    Node(
        "grid_damping_ratio", r"\zeta_0", "1",
        "damping ratio of the rigid rotor against the grid", KUNDUR,
        **formula(times.damping_ratio, "inertia", "grid_stiffness", "grid_damping"),
    ),
    Node(
        "grid_amplification", r"V_\nu", "1",
        "amplitude of an order of the angle against the grid over that of the free rotor", SWING,
        make=lambda order, speed, inertia, grid_stiffness, grid_damping:
        times.amplification(order, speed, inertia, grid_stiffness, grid_damping),
    ),
    Node(
        "grid_nearest_order", r"\nu_e", "1",
        "excited order that is nearest to the natural order against the grid", "this project",
        removes=("order",),
        **formula(times.nearest_order, "order", "grid_natural_order", "torque_harmonics"),
    ),
    Node(
        "grid_resonance_nearness", r"b/|\nu_e/\nu_0-1|", "1",
        "resonance_band over the distance of the nearest excited order from the natural order "
        "against the grid, above 1 within the band", "this project",
        **formula(times.nearness, "resonance_band", "grid_nearest_order", "grid_natural_order"),
    ),
    hidden(
        "grid_angle_harmonics", "rad", "harmonics of the angle against the grid",
        **formula(times.angle_harmonics, "torque_harmonics", "order", "speed", "inertia",
                  "grid_stiffness", "grid_damping"),
        width=16, beside=("grid_resonance_nearness",),
    ),
    hidden(
        "grid_power_harmonics", "W", "harmonics of the power to the grid",
        lambda grid_angle_harmonics, order, speed, grid_stiffness, grid_damping:
        times.power_harmonics(grid_angle_harmonics, order, speed, grid_stiffness, grid_damping),
        width=16,
    ),
    *_ANGLE,
    *(_electrical(node) for node in _ANGLE),
    *_swing(
        "grid_power", r"\Delta P", r"\Delta P_\nu", "W", 1.0, "power to the grid, from its mean"
    ),
    Node(
        "cycle_time", "T", "s", "duration of a cycle", DEVIATION,
        **formula(times.cycle_time, "omega", "period"), removes=("crank_angle",),
    ),
    *(
        Node(
            f"{stroke}_duration", f"t_{{{stroke}}}", "s",
            f"duration of the {stroke} of cylinder 1, crank angle {begin / DEGREE:.0f} to "
            f"{end / DEGREE:.0f} degree", DEVIATION,
            make=_duration(begin, end), removes=("crank_angle",),
        )
        for stroke, begin, end in (
            ("intake", -2.0 * np.pi, -np.pi), ("compression", -np.pi, 0.0),
            ("expansion", 0.0, np.pi), ("exhaust", np.pi, 2.0 * np.pi),
        )
    ),
    Node(
        "interval_duration", "t_{ab}", "s", "duration from interval_begin to interval_end",
        DEVIATION, make=_interval, removes=("crank_angle",),
    ),
)  # fmt: skip
