"""A recorded pressure as a Dataset: mean, cycles, volume, heat release, spread, what checks say."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from engine_dyn.geometry.arrangement import FOUR_STROKE
from engine_dyn.recordings.cylinder_geometry import CylinderGeometry, Finding, RecordedCycles
from engine_dyn.recordings.dead_centre import looks_motored
from engine_dyn.recordings.heat_release import (
    GAMMA,
    coefficient_of_variation,
    heat_release,
    mean_pressures,
    peak_pressures,
    polytropic_exponent,
)
from engine_dyn.recordings.signal_checks import LARGEST, LEAST_SAMPLES
from engine_dyn.types import Floats
from engine_dyn.units import BAR, CUBIC_CENTIMETRE, DEGREE
from sweeps.base.naming import named
from sweeps.base.one_thread import linear_algebra_on_one_thread

NOT_SIZED = "bore and stroke unknown: relative volume, no heat release"

ANGLE, CYCLE = "crank_angle", "recorded_cycle"


@linear_algebra_on_one_thread()
def evaluated(
    cycles: RecordedCycles,
    geometry: CylinderGeometry,
    *,
    title: str = "Recorded pressure",
    gamma: float = GAMMA,
    findings: Sequence[Finding] = (),
    sized: bool = True,
    pegged: bool = True,
) -> xr.Dataset:
    """Evaluate recorded cycles for figures and reports.

    Parameters
    ----------
    cycles : RecordedCycles
        Absolute pressure, unless `pegged` is false.
    geometry : CylinderGeometry
        Without a compression ratio there is the displaced volume, and neither heat release nor
        exponents.
    title : str
        Title of the figure.
    gamma : float
        Ratio of specific heats of the heat release [1].
    findings : sequence of Finding
        Findings of `engine_dyn.recordings.signal_checks.examine`, written below the figure.
    sized : bool
        Whether bore and stroke of `geometry` are the cylinder's. If not, volumes are relative to
        the swept volume (`relative_volume`, `relative_displaced_volume`), and there is no heat
        release.
    pegged : bool
        Whether the pressure is called absolute.

    Returns
    -------
    xarray.Dataset
        Over `crank_angle` [degree] and `recorded_cycle`: `pressure` (mean), `pressure_of_cycle`,
        `cylinder_volume` or `displaced_volume`, `heat_release_rate`, `heat_released`,
        `imep_of_cycle`, `peak_pressure_of_cycle`, `peak_angle_of_cycle`; and as numbers `imep`,
        `imep_gross`, `imep_pumping`, `imep_variation`, `compression_exponent`,
        `expansion_exponent`; where nothing burns `loss_angle` in place of
        `imep_variation`. `sweeps.view.figures.draw` makes the sheet of it.

    Raises
    ------
    ValueError
        If pressures are no numbers, or a cycle has fewer than 16 samples.
    """
    if not (np.abs(cycles.pressure) < LARGEST).all():
        raise ValueError("pressure: has values that are not numbers")
    if len(cycles.angle) < LEAST_SAMPLES:
        raise ValueError(
            f"a cycle has {len(cycles.angle)} samples; must be {LEAST_SAMPLES} or more"
        )
    mean = RecordedCycles(cycles.angle, cycles.mean[None], cycles.period)
    works = mean_pressures(cycles, geometry)
    peak, at = peak_pressures(cycles)
    data = xr.Dataset(
        coords={
            ANGLE: _named(ANGLE, cycles.angle / DEGREE, "crank angle", "degree", r"\varphi"),
            CYCLE: _named(CYCLE, np.arange(1, cycles.cycles + 1), "recorded cycle", "1", ""),
        },
        attrs={"title": title, "findings": "\n".join(str(one) for one in findings)},
    )
    bar, pressure = "bar", "absolute pressure" if pegged else "pressure as recorded"
    data["pressure"] = _named(
        ANGLE, mean.pressure[0] / BAR, f"{pressure}, mean of the recorded cycles", bar, "p"
    )
    data["pressure_of_cycle"] = _named(
        (CYCLE, ANGLE), cycles.pressure / BAR, f"{pressure} of a recorded cycle", bar, "p"
    )
    _add_volume(data, mean, geometry, gamma, sized)
    for name, values, said, unit, symbol in (
        ("imep_of_cycle", works.net / BAR, "imep of a cycle", bar, "p_i"),
        ("peak_pressure_of_cycle", peak / BAR, "largest pressure", bar, r"p_{max}"),
        ("peak_angle_of_cycle", at / DEGREE, "angle of the largest pressure", "degree",
         r"\varphi_{max}"),
    ):  # fmt: skip
        data[name] = _named(CYCLE, values, said, unit, symbol)
    motored = looks_motored(cycles)  # With an imep near 0, its relative spread means nothing
    variation = np.nan if motored else abs(coefficient_of_variation(works.net))
    for name, value, said, unit, symbol in (
        ("imep", works.net.mean() / BAR, "indicated mean effective pressure", bar, "p_i"),
        ("imep_gross", works.gross.mean() / BAR,
         "indicated mean effective pressure of compression and expansion", bar, r"p_{i,gross}"),
        ("imep_pumping", works.pumping.mean() / BAR,
         "indicated mean effective pressure of the gas exchange", bar, r"p_{i,pump}"),
        ("imep_variation", variation, "coefficient of variation of imep", "1", ""),
        ("loss_angle", -at.mean() / DEGREE if motored else np.nan,
         "thermodynamic loss angle, of the largest pressure before dead centre when motored",
         "degree", ""),
    ):  # fmt: skip
        if np.isfinite(value):
            data[name] = _named((), np.float64(value), said, unit, symbol)
    for key, variable in data.variables.items():
        about = variable.attrs
        about |= named(str(key), about["long_name"], about["units"])
    data.attrs["summary"] = _summary(works.net, peak, variation)
    if not sized:
        data.attrs["summary"] += f"; {NOT_SIZED}"
    if motored:
        data.attrs["summary"] += f"; motored, loss angle {-at.mean() / DEGREE:.3g} degree"
    return data


def _named(
    dims: str | Sequence[str], values: ArrayLike, said: str, unit: str, symbol: str
) -> object:
    attrs = {"long_name": said, "units": unit}
    if symbol:
        attrs["symbol"] = f"${symbol}$"
    return (dims, values, attrs)


def _add_volume(
    data: xr.Dataset, mean: RecordedCycles, geometry: CylinderGeometry, gamma: float, sized: bool
) -> None:
    """Add volume and the quantities that follow from it."""
    angle = mean.angle
    before, over, unit, symbol = "", "", "cm3", "V"
    scale = 1.0 / CUBIC_CENTIMETRE
    if not sized:
        before, over, unit, symbol = "relative_", ", over swept volume", "1", "V/V_h"
        scale = 1.0 / geometry.swept_volume
    if geometry.compression_ratio is None:
        data[f"{before}displaced_volume"] = _named(
            ANGLE, geometry.displaced(angle) * scale, f"volume that the piston displaces{over}",
            unit, symbol,
        )  # fmt: skip
        return
    data[f"{before or 'cylinder_'}volume"] = _named(
        ANGLE, geometry.volume(angle) * scale, f"volume of the cylinder{over}", unit, symbol
    )
    if sized:
        _add_heat(data, mean, geometry, gamma)
    _add_exponents(data, mean, geometry)


def _add_heat(
    data: xr.Dataset, mean: RecordedCycles, geometry: CylinderGeometry, gamma: float
) -> None:
    """Add the heat release, where there are samples while the cylinder is closed."""
    try:
        released = heat_release(mean, geometry, gamma)
    except ValueError:
        return
    for name, values, said, unit, symbol in (
        ("heat_release_rate", released.rate[0] * DEGREE, "apparent net heat release rate",
         "J degree-1", r"dQ/d\varphi"),
        ("heat_released", released.heat[0], "apparent net heat release", "J", "Q"),
    ):  # fmt: skip
        whole = np.full(mean.angle.shape, np.nan)
        whole[np.isin(mean.angle, released.angle)] = values
        data[name] = _named(ANGLE, whole, said, unit, symbol)


def _add_exponents(data: xr.Dataset, mean: RecordedCycles, geometry: CylinderGeometry) -> None:
    """Add polytropic exponents of compression and expansion."""
    four = mean.period == FOUR_STROKE
    # Ranges of angle over which exponents are fitted [degree]
    compression = (-95.0 if four else -85.0, -40.0)
    expansion = (65.0, 105.0 if four else 95.0)
    for name, (start, end) in (
        ("compression_exponent", compression), ("expansion_exponent", expansion),
    ):  # fmt: skip
        try:
            value = polytropic_exponent(mean, geometry, start * DEGREE, end * DEGREE).value[0]
        except ValueError:  # Samples are too few, or not positive: `examine` reports that
            continue
        data[name] = _named((), np.float64(value), name.replace("_", " "), "1", "n")
        data[name].attrs.update(from_angle=start, to_angle=end)


def _summary(imep: Floats, peak: Floats, variation: float) -> str:
    """One line: averages of the cycles, and their spread."""
    parts = [f"imep {imep.mean() / BAR:.4g} bar", f"largest pressure {peak.mean() / BAR:.4g} bar"]
    if len(imep) > 1:
        parts.insert(0, f"{len(imep)} cycles")
    if np.isfinite(variation):
        parts.append(f"coefficient of variation of imep {100.0 * variation:.2f} %")
    return "; ".join(parts)
