"""Calibration: modelled cycles of an engine that is known by its data sheet.

Bore, stroke, number of cylinders, rated power and rated speed are enough; largest pressure and fuel
consumption help. Everything else is assumed (`sweeps.lab.speed.usual_engines`) unless the data
sheet has it, and every assumption is kept with its reason. docs/method.md (134) to (138).
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from engine_dyn.geometry.firing_orders import customary_order
from engine_dyn.plausibility.judgement import ImplausibleWarning
from engine_dyn.pressure.first_law import FourStrokeCycle
from engine_dyn.units import BAR, DEGREE, RPM
from sweeps.base.arguments import a_path
from sweeps.base.checks import mentioned
from sweeps.base.errors import SceneError
from sweeps.base.one_thread import linear_algebra_on_one_thread
from sweeps.lab.speed.calibration_model import (
    LEAST_LOAD,
    Calibration,
    Point,
    Published,
    engine_file,
    published,
)
from sweeps.lab.speed.cycle_fits import (
    Friction,
    NotReached,
    brake_mean_pressure,
    friction_of,
    indicated_mean_pressure,
    peak_by_start,
    root,
    solved,
    trapped_mass,
    with_charge,
)
from sweeps.lab.speed.usual_engines import KINDS, VALUES, EngineKind
from sweeps.scene.engine.data_sheets import PERIOD, Sheet, described, read_data_sheet
from sweeps.scene.engine.engine_files import read_values
from sweeps.scene.engine.modelled_diagrams import modelled_cycle

__all__ = ["Calibration", "calibrate", "fit"]

WALL_FACTORS = 0.2, 5.0  # Range of the factor on Woschni's heat transfer in a fit

GRAMS_PER_KWH = 1e-3 / 3.6e6  # One g/kWh in kg/J


def calibrate(
    engine: str | Path,
    *,
    power: float | str | None = None,
    speed: float | str | None = None,
    peak: float | str | None = None,
    fuel_consumption: float | str | None = None,
    kind: str | None = None,
    loads: Iterable[float] | None = None,
) -> Calibration:
    """Fit the diagrams of an engine to its data sheet.

    Parameters
    ----------
    engine : str or Path
        An engine file with bore, stroke and cylinders; all else in it is taken as it is, but for
        its diagrams.
    power, speed, peak, fuel_consumption : float or str, optional
        Rated brake power [kW], rated speed [rpm], largest pressure at rated power, absolute [bar],
        and fuel consumption there [g/kWh]; or texts with a unit, such as "50 hp". They go before
        those of [data_sheet]. Without power or speed nothing can be fitted.
    kind : str, optional
        "diesel" (the default), "turbocharged-diesel", "spark-ignition" or
        "turbocharged-spark-ignition".
    loads : iterable of float, optional
        Percentages of the rated mean effective pressure that get a diagram; 100 is added.

    Returns
    -------
    Calibration
        Its `text` is the engine file. Values that are not usual give an `ImplausibleWarning`.

    Raises
    ------
    SceneError
        With one line, for bad input and for a data sheet that the model cannot reach, with what it
        could.

    Examples
    --------
    >>> import sweeps
    >>> text = '''title = "Car engine"
    ... cycle = "four-stroke"
    ... [values]
    ... cylinders = 4
    ... bore = 0.0875
    ... stroke = 0.101
    ... rod_length = 0.151
    ... reciprocating_mass = 0.65
    ... inertia = 0.15
    ... '''
    >>> with open("engine.toml", "w") as file:
    ...     written = file.write(text)
    >>> made = sweeps.calibrate(
    ...     "engine.toml", power=110, speed=5200, kind="spark-ignition", loads=[100]
    ... )
    >>> "[[diagram]]" in made.text
    True
    """
    sheet = read_data_sheet(a_path(engine, "engine"))
    given = published(
        sheet, "",
        {"power": power, "speed": speed, "peak": peak, "fuel_consumption": fuel_consumption},
        kind, None if loads is None else list(loads),
    )  # fmt: skip
    for line in sheet.unusual:
        warnings.warn(line, ImplausibleWarning, stacklevel=2)
    return fit(sheet, given)


@linear_algebra_on_one_thread()
def fit(sheet: Sheet, given: Published) -> Calibration:
    """Fit the diagrams of a data sheet; parameters as `read_data_sheet` and `published` make them.

    SceneError tells what the model could reach where it cannot reach what is published.
    """
    kind = KINDS[given.kind]
    for key in ("intake_pressure",) if kind.throttled else ():
        if key in sheet.known:
            raise SceneError(
                f"{sheet.name}: [data_sheet.cycle] {key}: not allowed for kind = '{given.kind}', "
                "where it is fitted to the power"
            )
    if given.peak is not None and "combustion_start" in sheet.known:
        raise SceneError(
            f"{sheet.name}: [data_sheet.cycle] combustion_start: not allowed together with "
            f"{given.places['peak']}, which it is fitted to"
        )
    try:
        return _fitted(sheet, given, kind)
    except SceneError:
        raise
    except (ValueError, ArithmeticError) as error:
        # A cycle cannot be computed if its gas is too hot, its cylinder is not emptied, or a number
        # overflows.
        raise SceneError(
            f"{sheet.name}: [data_sheet.cycle]: cannot reach this power: {mentioned(error)}"
        ) from None


def _fitted(sheet: Sheet, given: Published, kind: EngineKind) -> Calibration:
    """Fit of a data sheet with consistent keys; ValueError where a cycle cannot be computed."""
    values, assumed, order = _completed(sheet, given, kind)
    own = read_values(values, sheet.name)
    if not min(given.loads) <= own["load"] <= max(given.loads):
        raise SceneError(
            f"{sheet.name}: [values] load = {own['load']:g}: must be within the loads, "
            f"{min(given.loads):g} to {max(given.loads):g} percent"
        )
    fitting = _Fitting(sheet, given, kind, own, friction_of(own, PERIOD))
    rated = fitting.at_full_load()
    points = tuple(
        fitting.point(load, rated if load == 100.0 else fitting.at_load(load, rated))
        for load in given.loads
    )
    if not given.places["kind"]:
        assumed["kind"] = f"Not given: assumed to be a {kind.title}."
    for key in points[0].table:
        usual = kind.cycle.get(key)
        if usual is not None and key not in sheet.known and key not in fitting.fitted:
            assumed[key] = usual.reason
    assumed["fuel"] = f"{kind.fuel.name}: {kind.fuel.source}."
    made = Calibration(sheet, given, values, order, points, assumed, fitting.fitted)
    return replace(made, text=engine_file(made))


def _completed(
    sheet: Sheet, given: Published, kind: EngineKind
) -> tuple[dict[str, float], dict[str, str], tuple[int, ...] | None]:
    """Values of the engine, the reasons of the assumed ones, and the firing order if assumed."""
    values = {**sheet.values, "speed": given.speed}
    left = set()
    if "crank_ratio" in values:
        left.add("rod_length")
    if "reciprocating_mass" in values:
        left |= {"piston_mass", "rod_mass", "rod_centre_of_gravity", "crank_mass"}
    if {"auxiliary_inertia", "flywheel_inertia", "load_inertia"} & set(values):
        left.add("inertia")  # The inertia is the sum of the parts that the sheet gives
    if {"load_linear", "load_square"} & set(values) or "load_table" in sheet.rest:
        left |= {"load_exponent"}
    assumed: dict[str, str] = {}
    for key, usual in VALUES.items():
        if key not in values and key not in left:
            values[key] = usual.make({**values, "power": given.power}, kind)
            assumed[key] = usual.reason
    order = None
    if not described(sheet) and values["cylinders"] > 1:
        order = customary_order(int(values["cylinders"]))
    if order is not None:
        assumed["firing_order"] = "In-line with the customary firing order; not given in the file."
    return values, assumed, order


class _Free(NamedTuple):
    """Function that makes a cycle from one number, fitted to the power, and its range."""

    make: Callable[[float], FourStrokeCycle]
    low: float
    high: float
    tolerance: float = 0.1


class _Fitting:
    """The fit of one engine."""

    def __init__(
        self, sheet: Sheet, given: Published, kind: EngineKind, own: Mapping[str, float],
        friction: Friction,
    ) -> None:  # fmt: skip
        self.sheet, self.given, self.kind, self.own = sheet, given, kind, own
        self.friction = friction
        volume = 0.25 * math.pi * own["bore"] ** 2 * own["stroke"] * own["cylinders"]
        # Brake mean effective pressure [Pa] of 1 kW, docs/method.md (134).
        self.of_power = 1e3 * PERIOD / (volume * own["speed"] * RPM)
        self.goal = given.power * self.of_power
        self.fitted: dict[str, str] = {}
        self.charged = kind.charge_fitted and "intake_pressure" not in sheet.known

    # --- full load -------------------------------------------------------------------------------

    def at_full_load(self) -> FourStrokeCycle:
        """Cycle of the rated point."""
        base = self._base(1.0)
        free = self._free(base)
        words = f"{self.given.power:.6g} kW at {self.given.speed:.6g} rpm"
        if self.given.peak is None:
            try:
                cycle = self._solved(free, self.goal)
            except NotReached as error:
                raise self._power_not_reached(error) from None
            return self._named(cycle, words)
        peak = self.given.peak * BAR

        def at(start: float) -> FourStrokeCycle:
            moved = free._replace(make=lambda number: _starting(free.make(number), start))
            return self._solved(moved, self.goal)

        # Starts of the combustion [rad] between which the start that gives the wanted largest
        # pressure is searched
        starts = np.linspace(*self.kind.starts, 9) * DEGREE
        try:
            cycle = peak_by_start(at, peak, starts.tolist())
        except NotReached as error:
            raise self._peak_not_reached(error, free) from None
        self.fitted["combustion_start"] = f"the largest pressure, {self.given.peak:.6g} bar"
        return self._named(cycle, words)

    def _named(self, cycle: FourStrokeCycle, words: str) -> FourStrokeCycle:
        """Name the fitted numbers and their aims."""
        if self.given.fuel_consumption is not None:
            fuel = f"the fuel consumption, {self.given.fuel_consumption:.6g} g/kWh"
            self.fitted["heat"] = f"{fuel}; at other loads to their share of the power"
            self.fitted["wall_factor"] = f"the power, {words}"
            if self.charged:
                self.fitted["intake_pressure"] = f"{fuel}, at the assumed air-fuel ratio"
        elif self.charged:
            self.fitted["intake_pressure"] = f"the power, {words}"
            self.fitted["heat"] = "that of the trapped charge"
            if not self.kind.throttled:
                self.fitted["heat"] += "; at other loads to their share of the power"
        else:
            self.fitted["heat"] = f"the power, {words}, and its share at other loads"
        return cycle

    def _solved(self, free: _Free, goal: float) -> FourStrokeCycle:
        """Cycle that is fitted to a brake mean effective pressure [Pa]."""
        cycle: FourStrokeCycle = solved(
            free.make, self.friction, goal, free.low, free.high, free.tolerance
        )
        return cycle

    def _free(self, base: FourStrokeCycle) -> _Free:
        """Number by which the rated cycle is fitted to the power, and how it makes the cycle."""
        fuel = self.given.fuel_consumption
        if fuel is not None:
            return _Free(self._with_heat(base, self.heat_of(fuel)), *WALL_FACTORS, 1e-6)
        return self._charged(base) if self.charged else self._heated(base)

    def _heated(self, base: FourStrokeCycle) -> _Free:
        """Cycles by their heat over the swept volume [Pa], up to what the charge can burn."""
        most = self.kind.fuel.heat * trapped_mass(base) / self.kind.fuel.least_air_fuel_ratio
        return _Free(lambda heat: replace(base, heat=heat), 0.0, most)

    def heat_of(self, fuel_consumption: float) -> float:
        """Heat over the swept volume [Pa] at rated power; docs/method.md (137)."""
        return self.goal * fuel_consumption * GRAMS_PER_KWH * self.kind.fuel.heat

    def _charged(self, base: FourStrokeCycle) -> _Free:
        """Cycles by their intake pressure [Pa], with the kind's air-fuel ratio."""
        of_charge = self.kind.fuel.heat_of_charge
        low, high = (end * BAR for end in self.kind.intake)
        return _Free(
            lambda intake: with_charge(base, intake, of_charge, self._exhaust(base, intake)),
            low, high,
        )  # fmt: skip

    def _exhaust(self, base: FourStrokeCycle, intake: float) -> float:
        """Exhaust pressure [Pa]: before a turbine as far above atmosphere as the intake."""
        if not self.kind.boosted or "exhaust_pressure" in self.sheet.known:
            return base.exhaust_pressure
        return self.kind.cycle["exhaust_pressure"].full * BAR + max(intake - BAR, 0.0)

    def _with_heat(self, base: FourStrokeCycle, heat: float) -> Callable[[float], FourStrokeCycle]:
        """Cycle with the heat of a fuel consumption and a factor on its loss to the walls."""
        where = f"{self.given.places['fuel_consumption']} = {self.given.fuel_consumption:g} g/kWh"
        if self.charged:
            charged, low, high, _ = self._charged(base)
            ends = charged(low).heat, charged(high).heat
            if not ends[0] <= heat <= ends[1]:
                least, most = (
                    end / (self.goal * GRAMS_PER_KWH * self.kind.fuel.heat) for end in ends
                )
                raise SceneError(
                    f"{where}: must be between {least:.4g} and {most:.4g} g/kWh at this power, "
                    f"for intake pressures from {low / BAR:g} to {high / BAR:g} bar"
                )
            base = charged(root(lambda p: charged(p).heat - heat, low, high, xtol=0.1))
        else:
            ratio = self.kind.fuel.heat * trapped_mass(base) / heat
            if ratio < self.kind.fuel.least_air_fuel_ratio:
                most = self.given.fuel_consumption or 0.0
                most *= ratio / self.kind.fuel.least_air_fuel_ratio
                raise SceneError(
                    f"{where}: must be at most {most:.4g} g/kWh at this power: the air-fuel ratio "
                    f"would be {ratio:.3g} at an intake pressure of "
                    f"{base.intake_pressure / BAR:.4g} bar, and is "
                    f"{self.kind.fuel.least_air_fuel_ratio:g} or more"
                )
        return lambda factor: replace(base, heat=heat, wall_factor=factor)

    # --- aims that cannot be reached -------------------------------------------------------------

    def _power_not_reached(self, error: NotReached) -> SceneError:
        """Error that names the power, or the fuel consumption, that could be reached."""
        fuel = self.given.fuel_consumption
        if fuel is not None:
            if error.most <= 0.0:  # Even the smallest loss to the walls leaves no brake power
                return SceneError(
                    f"{self.given.places['fuel_consumption']} = {fuel:g} g/kWh: must be higher: "
                    "friction consumes all the work of this much fuel"
                )
            low, high = (fuel * self.goal / max(p, 1e-9) for p in (error.most, error.least))
            top = f"and {high:.3g} g/kWh" if 0.0 < high < 2000.0 else "and 2000 g/kWh"
            return SceneError(
                f"{self.given.places['fuel_consumption']} = {fuel:g} g/kWh: must be between about "
                f"{low:.3g} {top} at this power, with Woschni's heat transfer times "
                f"{WALL_FACTORS[0]:g} to {WALL_FACTORS[1]:g} and the friction that is assumed"
            )
        least, most = (max(p, 0.0) / self.of_power for p in (error.least, error.most))
        where = f"{self.given.places['power']} = {self.given.power:g} kW"
        at = f"at {self.given.speed:g} rpm"
        if self.goal < error.least:
            return SceneError(f"{where}: must be at least {least:.4g} kW {at} for {self._limits()}")
        if most == 0.0:
            return SceneError(
                f"{where}: cannot be reached: friction consumes all the work of {self._limits()}"
            )
        other = "" if self.kind.boosted else f"; or kind = 'turbocharged-{self.given.kind}'"
        return SceneError(
            f"{where}: more than the charge allows; must be at most {most:.4g} kW {at} for "
            f"{self._limits()}{other}"
        )

    def _limits(self) -> str:
        """Limits of the power, in words."""
        if self.charged:
            low, high = self.kind.intake
            return (
                f"a {self.kind.title} with an intake pressure of {low:g} to {high:g} bar and an "
                f"air-fuel ratio of {self.kind.fuel.air_fuel_ratio:g}"
            )
        intake = self._table(1.0)["intake_pressure"]
        return (
            f"a {self.kind.title} with an intake pressure of {intake:g} bar and an air-fuel ratio "
            f"of {self.kind.fuel.least_air_fuel_ratio:g} or more"
        )

    def _peak_not_reached(self, error: NotReached, free: _Free) -> SceneError:
        """Error that names the largest pressure that could be reached."""
        if math.isnan(error.least):
            try:
                self._solved(free, self.goal)
            except NotReached as power:
                return self._power_not_reached(power)
            return SceneError(
                f"{self.given.places['power']} = {self.given.power:g} kW: cannot be reached while "
                "the start of combustion is fitted to the peak pressure; leave out the peak "
                "pressure"
            )
        first, last = self.kind.starts
        base = self._base(1.0)
        ratio = base.compression_ratio
        whose = "given" if "compression_ratio" in self.sheet.known else "assumed"
        if self.charged:
            try:
                base = self._solved(free, self.goal)
            except NotReached:
                base = free.make(0.5 * (free.low + free.high))
        alone = replace(base, heat=0.0).points()[1].max() / BAR
        return SceneError(
            f"{self.given.places['peak']} = {self.given.peak:g} bar: must be between "
            f"{error.least / BAR:.3g} and {error.most / BAR:.3g} bar at this power, with the "
            f"combustion starting between {first:g} and {last:g} degree; compression alone gives "
            f"{alone:.3g} bar (compression_ratio = {ratio:g}, {whose}; [data_sheet.cycle] takes "
            "another)"
        )

    # --- other loads -----------------------------------------------------------------------------

    def at_load(self, load: float, rated: FourStrokeCycle) -> FourStrokeCycle:
        """Cycle of another load: of its share of the rated mean effective pressure."""
        share = load / 100.0
        base = self._base(share)
        if "combustion_start" in self.fitted:
            usual = self.kind.cycle["combustion_start"]
            shift = rated.combustion_start / DEGREE - usual.full
            base = _starting(base, (usual.at(share) + shift) * DEGREE)
        base = replace(base, wall_factor=rated.wall_factor)
        if self.charged and not self.kind.throttled:
            intake = BAR + (rated.intake_pressure - BAR) * share
            base = replace(
                base, intake_pressure=intake, exhaust_pressure=self._exhaust(base, intake)
            )
        free = self._charged(base) if self.kind.throttled else self._heated(base)
        try:
            return self._solved(free, share * self.goal)
        except NotReached as error:
            low, high = (100.0 * p / self.goal for p in (error.least, error.most))
            if low > load:
                allowed = f"must be {low:.3g} percent or more"
            elif high > LEAST_LOAD:
                allowed = f"must be at most {high:.3g} percent"
            else:
                allowed = "must be left out: it cannot be reached"
            raise SceneError(
                f"{self.given.places['loads']} = {load:g}: {allowed} for {self._limits()}"
            ) from None

    # --- tables ----------------------------------------------------------------------------------

    def _table(self, share: float) -> dict[str, Any]:
        """Table [[diagram]] of a load before anything is fitted."""
        usual = {key: item.at(share) for key, item in self.kind.cycle.items()}
        table: dict[str, Any] = {
            "wall": "woschni", "intake_pressure": 1.0, "heat": 0.0, **usual, **self.sheet.known,
        }  # fmt: skip
        if table.get("premixed_share", 0.0) > 0.0:
            table["premixed_start"] = table["combustion_start"]
        return table

    def _base(self, share: float) -> FourStrokeCycle:
        """Cycle of a load before anything is fitted."""
        where = f"{self.sheet.name}: [data_sheet.cycle]"
        cycle, _ = modelled_cycle("first_law", self._table(share), where, PERIOD, self.own)
        base: FourStrokeCycle = cycle
        return base

    def point(self, load: float, cycle: FourStrokeCycle) -> Point:
        """The table of a cycle, with rounded numbers, and what these make."""
        table = self._table(load / 100.0)
        for key in ("heat", "intake_pressure", "exhaust_pressure"):
            table[key] = _rounded(getattr(cycle, key) / BAR)
        for key in ("combustion_start", "premixed_start"):
            if key in table:
                table[key] = _rounded(getattr(cycle, key) / DEGREE)
        if "wall_factor" in self.fitted:
            table["wall_factor"] = _rounded(cycle.wall_factor)
        written, _ = modelled_cycle("first_law", table, self.sheet.name, PERIOD, self.own)
        angle, pressure = written.points()
        bmep = brake_mean_pressure(written, self.friction)
        burnt = written.heat / self.kind.fuel.heat
        mass = trapped_mass(written) - (burnt if self.kind.fuel.with_air else 0.0)
        power = bmep / self.of_power
        return Point(
            load=load,
            table=_ordered({"load": load, "kind": "first_law", **table}),
            power=power,
            goal=self.given.power * load / 100.0,
            imep=indicated_mean_pressure(written) / BAR,
            bmep=bmep / BAR,
            peak=float(pressure.max()) / BAR,
            peak_angle=float(angle[pressure.argmax()]) / DEGREE,
            compression=float(replace(written, heat=0.0).points()[1].max()) / BAR,
            air_fuel_ratio=mass / burnt,
            fuel_consumption=burnt / bmep / GRAMS_PER_KWH,
        )


def _starting(cycle: FourStrokeCycle, start: float) -> FourStrokeCycle:
    """Return the cycle with another start of the combustion, and of its premixed part."""
    premixed = start if cycle.premixed_share > 0.0 else cycle.premixed_start
    return replace(cycle, combustion_start=start, premixed_start=premixed)


def _rounded(value: float) -> float:
    return float(f"{value:.6g}")


def _ordered(table: dict[str, Any]) -> dict[str, Any]:
    """A table with its keys in the order of the catalogue."""
    leading = (
        "load", "kind", "wall", "compression_ratio", "intake_pressure", "exhaust_pressure",
        "charge_temperature", "heat", "combustion_start", "combustion_duration", "combustion_form",
        "premixed_share", "premixed_start", "premixed_duration", "premixed_form",
        "wall_temperature", "wall_factor", "intake_loss", "exhaust_loss", "intake_closing",
        "exhaust_opening",
    )  # fmt: skip
    first = [key for key in leading if key in table]
    return {key: table[key] for key in (*first, *(k for k in table if k not in first))}
