"""Outcomes of designs near stalling: never a stall that is none.

The inertia at which a design with a constant load stalls follows from the closure alone: with the
power mean of order 0, the mean of log q is 0, and q = g (W - min W) there, with the work W of the
torque less its mean and g = 2/(Theta omega^2). So log g is minus the mean of log(W - min W).
"""

import math
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from engine_dyn.geometry.cylinders import even_cylinders
from engine_dyn.pressure.family import Family
from engine_dyn.speed import dispatch
from engine_dyn.speed.fields import SCALAR_NAMES
from engine_dyn.status import CONVERGED, STALLED, TOLERANCE_NOT_MET
from oracle import solution, spline
from sweeps.scene.engine.engine_files import load_engine

pytestmark = pytest.mark.compiled

PERIOD = 4.0 * math.pi
BORE, STROKE, RATIO, SPEED = 0.09, 0.1, 0.28, 150.0


@pytest.fixture(scope="module")
def family() -> Family:
    found = load_engine("ntua").family
    assert isinstance(found, Family)
    return found


def solved(family: Family, closure: str, columns: dict[str, Any]) -> Any:
    given = dict(columns)
    variable, crankcase, stroke, friction = (
        given.pop(name) for name in ("variable", "crankcase", "stroke", "friction")
    )
    return dispatch.solve(
        wanted=SCALAR_NAMES, closure=closure, family=family, scale=1.0, friction_torque=friction,
        inertia_model=np.where(variable, "variable", "constant"), crankcase_pressure=crankcase,
        double_radius=stroke, threads=1, **given,
    )  # fmt: skip


@pytest.mark.parametrize("cylinders", [1, 3, 4])
def test_the_inertia_at_which_a_constant_load_stalls(family: Family, cylinders: int) -> None:
    period = PERIOD / cylinders
    pressure = family.row(0)
    lever = 0.25 * math.pi * BORE**2 * 0.5 * STROKE

    def torque(phi: Any) -> Any:
        each = (phi + k * period for k in range(cylinders))
        return lever * sum(pressure(one) * solution.velocity(one, RATIO) for one in each)

    # Work at the ends of half degrees by Gauss's formula, and within them by the same.
    count = round(period / math.radians(0.5))
    edges = np.linspace(-0.5 * period, 0.5 * period, count + 1)
    node, weight = np.polynomial.legendre.leggauss(8)

    def integral(begin: Any, end: Any) -> Any:
        half = 0.5 * (np.asarray(end) - begin)
        return half * (weight[:, None] * torque(begin + half * (1.0 + node[:, None]))).sum(axis=0)

    gained = np.concatenate([[0.0], np.cumsum(integral(edges[:-1], edges[1:]))])
    mean = gained[-1] / period

    def work(phi: Any) -> Any:
        inside = edges[0] + (np.asarray(phi) - edges[0]) % period
        at = np.minimum(((inside - edges[0]) / (edges[1] - edges[0])).astype(int), count - 1)
        return gained[at] + integral(edges[at], inside) - mean * (inside - edges[0])

    # The lowest work is where the torque has its mean.
    low = edges[int(np.argmin(work(edges[:-1])))]
    width = edges[1] - edges[0]
    place = brentq(lambda phi: float(torque(np.array([phi]))[0]) - mean, low - width, low + width,
                   xtol=1e-14)  # fmt: skip
    least, swing = float(work(np.array([place]))[0]), float(np.ptp(work(edges)))
    # Panels that shrink towards it to both sides, where the logarithm is singular.
    ends = np.concatenate([[0.0], np.geomspace(1e-9, 0.5 * period, 400)])
    half = 0.5 * np.diff(ends)
    apart = (ends[:-1] + half * (1.0 + node[:, None])).reshape(-1)
    shares_of = np.tile((half * weight[:, None]).reshape(-1), 2) / period
    above = (work(np.concatenate([place + apart, place - apart])) - least) / swing

    def mean_log(level: float) -> float:
        """Mean of log((W - min W)/swing + level)."""
        return float(np.log(np.maximum(above, 1e-30) + level) @ shares_of)

    stalls_at = 2.0 * swing * math.exp(mean_log(0.0)) / SPEED**2

    def slowest(share: float) -> float:
        """Smallest q at an inertia above that by a share of it."""
        g = 2.0 * swing / (stalls_at * (1.0 + share) * SPEED**2)
        return g * brentq(lambda level: mean_log(level) + math.log(g), 0.0, 1.0, xtol=1e-12)

    shares = np.array([-0.05, -0.005, 0.001, 0.0015, 0.01, 0.1])
    found = solved(family, "power_mean", {
        "variable": False, "crankcase": 0.0, "stroke": STROKE, "friction": 0.0, "row": 0.0,
        "crank_ratio": RATIO, "bore": BORE, "mass": 0.0, "speed": SPEED, "exponent": 0.0,
        "cylinders": cylinders, "mean_torque": mean, "offset": 0.0,
        "cylinders_by_count": {cylinders: even_cylinders(cylinders, PERIOD)},
        "inertia": stalls_at * (1.0 + shares),
    })  # fmt: skip
    assert (found["status"][:2] == STALLED).all()
    runs = found["status"][2:]
    assert np.isin(runs, (CONVERGED, TOLERANCE_NOT_MET)).all()
    for share, speed in zip(shares[3:], found["omega_min"][3:], strict=True):
        assert (speed / SPEED) ** 2 == pytest.approx(slowest(share), rel=0.05)


ABSURD = (
    # Each was called a stall with the cycle time; slowest at 0.34, 8.6 and 1.4 percent.
    (100.0, 101325.0, 0.6145858676213815, 0.013604164091777816, 0.0023478034659990973,
     0.01121810988964218, 0.19797205766649492, 0.48416049378812503, 0.0, 4, True, 0.0,
     0.29460103580716407, 0.0),
    (100.0, 0.0, 0.00043153475831196, 0.0030239610846592413, 0.8206549299224943,
     0.0002965945701764115, 0.0035704902109495633, 12.847703461790028, 18.479662505751236, 6,
     False, 2.337286783354643, 0.8468250708264828, 0.0),
    (128.25, 0.0, 0.4941682681501725, 0.18217150011240663, 0.08815625037345215,
     31.454636470816638, 4.152817878990242, 19.772282579010476, 7.067015562931173, 1, True,
     2143.712070736292, 381.0905076293334, 0.0),
)  # fmt: skip
COLUMNS = (
    "row", "crankcase", "crank_ratio", "bore", "stroke", "mass", "inertia", "speed", "exponent",
    "cylinders", "variable", "friction", "mean_torque", "offset",
)  # fmt: skip


def test_absurd_designs_with_a_given_cycle_time(family: Family) -> None:
    """By the independent solver of oracle/spline.py, which cuts the cycle at every knot."""
    columns = {
        name: np.array(values)
        for name, values in zip(COLUMNS, zip(*ABSURD, strict=True), strict=True)
    }
    found = solved(family, "cycle_time", columns)
    own = {n: v for n, v in columns.items() if n not in ("friction", "mean_torque", "offset")}
    exact = spline.solve(
        spline.Designs.of(
            **own, scale=1.0, cycle_time=True, surplus=columns["mean_torque"] - columns["offset"]
        ),
        lambda row, phi: family.row(row)(phi), family.row(0).angle,
    )  # fmt: skip
    assert (exact.status == spline.CONVERGED).all()
    assert np.isin(found["status"], (CONVERGED, TOLERANCE_NOT_MET)).all()
    error = np.maximum(found["delta_error"], 1e-6)
    assert (np.abs(found["delta"] / exact.delta - 1.0) <= error).all()
