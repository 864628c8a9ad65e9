"""Tables of docs/validation.md on the kinematic series and on the forces and orders of the notes.

Printed are Mosakowski's relations and the notes after Rakopoulos (see `read_reference`); beside
them stands what the exact series of this project gives, and what the exact curves themselves give
by a transform or by finite differences.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

import sweeps
from engine_dyn.geometry import kinematic_series as series
from engine_dyn.geometry import slider_crank

POINTS = 4096
RATIOS = (0.2, 1.0 / 3.0, 0.5)

Function = Callable[[Any, Any], Any]

Polynomial = tuple[tuple[int, float], ...]
"""Powers of lambda and their factors."""

COEFFICIENTS: tuple[tuple[str, str, Function, int, Polynomial], ...] = (
    ("A_2", "Mosakowski (7)", series.position_coefficients, 2,
     ((1, 1 / 4), (3, 1 / 16), (5, 15 / 512))),
    ("A_4", "Mosakowski (7), corrected", series.position_coefficients, 4,
     ((3, -1 / 64), (5, -3 / 256), (7, -35 / 4096))),
    ("A_4", "Mosakowski (7), as printed", series.position_coefficients, 4,
     ((3, -1 / 64), (5, -5 / 256))),
    ("A_6", "Mosakowski (7)", series.position_coefficients, 6, ((5, 1 / 512),)),
    ("gamma_2", "Rakopoulos notes", series.velocity_coefficients, 2,
     ((1, 1 / 2), (3, 1 / 8), (5, 15 / 256))),
    ("gamma_4", "Rakopoulos notes", series.velocity_coefficients, 4,
     ((3, -1 / 16), (5, -3 / 64))),
    ("gamma_6", "Rakopoulos notes", series.velocity_coefficients, 6, ((5, 3 / 256),)),
    ("beta_2 = Q_2", "Rakopoulos notes", series.acceleration_coefficients, 2,
     ((1, 1.0), (3, 1 / 4), (5, 15 / 128))),
    ("beta_4 = Q_4, printed Q_3", "Rakopoulos notes", series.acceleration_coefficients, 4,
     ((3, -1 / 4), (5, -3 / 16))),
    ("beta_6 = Q_6", "Rakopoulos notes, corrected", series.acceleration_coefficients, 6,
     ((5, 9 / 128),)),
    ("beta_6", "Rakopoulos notes, as printed", series.acceleration_coefficients, 6,
     ((5, 1 / 128),)),
    ("T_1", "Rakopoulos notes", series.inertia_torque_coefficients, 1,
     ((1, 1 / 4), (3, 1 / 16), (5, 15 / 512))),
    ("T_2", "Rakopoulos notes, corrected", series.inertia_torque_coefficients, 2,
     ((0, -1 / 2), (4, -1 / 32), (6, -1 / 32))),
    ("T_2", "Rakopoulos notes, as printed", series.inertia_torque_coefficients, 2,
     ((1, -1 / 2), (4, -1 / 32), (6, -1 / 32))),
    ("T_3", "Rakopoulos notes", series.inertia_torque_coefficients, 3,
     ((1, -3 / 4), (3, -9 / 32), (5, -81 / 512))),
    ("T_4", "Rakopoulos notes", series.inertia_torque_coefficients, 4,
     ((2, -1 / 4), (4, -1 / 8), (6, -1 / 16))),
    ("T_5", "Rakopoulos notes", series.inertia_torque_coefficients, 5,
     ((3, 5 / 32), (5, 75 / 512))),
    ("T_6", "Rakopoulos notes", series.inertia_torque_coefficients, 6,
     ((4, 3 / 32), (6, 3 / 32))),
)  # fmt: skip
"""Name, source, function, order and printed polynomial; the sign of A is opposite to a's."""


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [heads, ["---", "---", *["---:"] * (len(heads) - 2)], *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def coefficient_table() -> str:
    """Printed polynomials beside the exact coefficients, at three crank ratios."""
    rows = []
    for name, source, function, order, polynomial in COEFFICIENTS:
        sign = -1.0 if name.startswith("A") else 1.0
        cells = [name, source]
        for ratio in RATIOS:
            printed = sum(factor * ratio**power for power, factor in polynomial)
            cells += [f"{printed:.6f}", f"{sign * float(function(order, ratio)):.6f}"]
        rows.append(cells)
    heads = ["coefficient", "source"]
    for ratio in RATIOS:
        heads += [f"printed, lambda {ratio:.4g}", "exact"]
    return table(heads, rows)


def largest_disagreement() -> str:
    """Largest difference of the exact series, orders 1 to 40, from transforms of the curves."""
    phi = np.arange(POINTS) * (2.0 * math.pi / POINTS)
    orders = np.arange(1.0, 41.0)
    worst = 0.0
    for ratio in (0.05, *RATIOS, 0.7, 0.9):
        v, b = slider_crank.velocity(phi, ratio), slider_crank.acceleration(phi, ratio)
        curves = (
            (slider_crank.position(phi, ratio), series.position_coefficients, 1.0),
            (v, series.velocity_coefficients, -1j),
            (b, series.acceleration_coefficients, 1.0),
            (-b * v, series.inertia_torque_coefficients, -1j),
        )
        for curve, function, factor in curves:
            found = 2.0 * np.fft.rfft(curve)[1:41] / POINTS
            worst = max(worst, float(np.abs(found - factor * function(orders, ratio)).max()))
    return f"{worst:.0e}"


def truncation_table() -> str:
    """Errors of the truncated series over lambda, and Mosakowski (16) evaluated as printed."""
    rows = []
    for ratio in (0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5, 0.55, 0.6, 0.65, 0.7):
        printed = ratio / (1.0 + ratio) * (1.0 / math.sqrt(1.0 - ratio**2) - 1.0)
        errors = [
            100.0 * float(series.truncation_error(ratio, highest, derivative))
            for derivative in (2, 1, 0)
            for highest in (2, 4)
        ]
        bound = {0.3: "slightly over 1", 0.5: "over 5"}.get(ratio, "")
        cells = [f"{ratio:.2f}", bound, f"{100.0 * printed:.4f}"]
        rows.append([*cells, *(f"{error:.4f}" for error in errors)])
    heads = ["lambda", "text", "(16)"]
    for what in ("acceleration", "velocity", "travel"):
        heads += [f"{what}, to order 2", "to order 4"]
    return table(heads, rows)


def marine_remark() -> str:
    """Say what the truncated series do to a long-stroke marine engine."""
    engine = "marine_80x345"
    found = sweeps.run(
        {
            "engine": engine,
            "axes": {"truncation": [2, 4]},
            "output": {"quantities": ["acceleration_truncation_error", "acceleration"]},
        }
    )
    two, four = (100.0 * float(e) for e in found["acceleration_truncation_error"])
    return (
        f"The long-stroke engine `{engine}` of the catalogue has lambda = 0.5. Its error is "
        f"{two:.2f} % with two orders and {four:.2f} % with the fourth order."
    )


def work_table() -> str:
    """Means of the tangential pressure against p_i/pi and p_i/(2 pi), of two engines."""
    rows = []
    for engine, turns, text in (("marine_80x345", 1, "p_i/π"), ("ntua", 2, "p_i/(2 π)")):
        found = sweeps.run(
            {
                "engine": engine,
                "output": {
                    "quantities": ["tangential_pressure", "tangential_pressure_mean", "imep"],
                    "angle_step": 0.25,
                },
            }
        )
        imep, curve = float(found["imep"]), float(found["tangential_pressure"].mean())
        rows.append([
            f"`{engine}`", text, f"{imep / (math.pi * turns):.4f}",
            f"{float(found['tangential_pressure_mean']):.4f}", f"{curve:.4f}",
        ])  # fmt: skip
    return table(
        ["engine", "notes", "bar", "`tangential_pressure_mean`", "mean of the curve"], rows
    )


def gravity_remark() -> str:
    """Say what the misprint in the gravity torque would do to a cylinder of the NTUA engine."""
    found = sweeps.run({"engine": "ntua", "output": {"quantities": ["gravity_torque"]}})
    curve = found["gravity_torque"].values
    phi = np.radians(found["crank_angle"].values)
    reciprocating = 4.97 + 6.33 * 0.094 / 0.350
    velocity = slider_crank.velocity(phi, 0.09 / 0.350)
    printed = 9.80665 * 0.09 * reciprocating * (velocity + np.sin(phi))
    return (
        f"The gravity torque of one cylinder of `ntua` is at most {np.abs(curve).max():.3f} N m. "
        f"With G_l instead of G_r, as printed, it would be {np.abs(printed).max():.3f} N m."
    )


def rod_table() -> str:
    """Error of the two-mass rod over the rod's moment of inertia, for the NTUA engine."""
    two = 6.33 * 0.094 * 0.256
    shares = (0.7, 0.8, 0.9, 1.0, 1.1)
    found = sweeps.run(
        {
            "engine": "ntua",
            "axes": {"rod_inertia": [share * two for share in shares]},
            "output": {"quantities": ["rod_torque_error", "rod_thrust_error"]},
        }
    )
    rows = [
        [
            f"{share:.1f}", f"{share * two:.4f}",
            f"{100.0 * float(found['rod_torque_error'][i]):.2f}",
            f"{100.0 * float(found['rod_thrust_error'][i]):.2f}",
        ]
        for i, share in enumerate(shares)
    ]  # fmt: skip
    return table(
        ["rod over two masses", "kg m2", "inertia torque, %", "wall thrust of inertia, %"], rows
    )
