"""Typical mistakes of people who write scenes: mostly another unit, made with catalogue engines.

Each is a right value and what somebody writes by mistake. Whether it is noticed is tested in
tests/sweeps/test_plausibility.py; docs/plausibility.md tells those that are not.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from sweeps.scene.engine.engine_files import load_engine

__all__ = ["MISTAKES", "Mistake"]


@dataclass(frozen=True)
class Mistake:
    """What was written by mistake.

    `diagram` has the factors on angles and pressures of the engine's own diagram, written as
    [indicator]: angle factor, shift [degree], pressure factor, what is added [bar].
    """

    text: str
    engine: str
    set: Mapping[str, Any] = field(default_factory=dict)
    quantities: tuple[str, ...] = ("delta",)
    diagram: tuple[float, float, float, float] | None = None
    more: Mapping[str, Any] = field(default_factory=dict)

    def scene(self, folder: Path) -> dict[str, Any]:
        """The scene; files that it names are written into a folder."""
        raw: dict[str, Any] = {
            "engine": self.engine, "set": dict(self.set),
            "output": {"quantities": list(self.quantities)}, **self.more,
        }  # fmt: skip
        if self.diagram is not None:
            raw["indicator"] = {"file": str(self._written(folder / "diagram.csv"))}
        return raw

    def _written(self, path: Path) -> Path:
        """The engine's own diagram, as somebody has written it."""
        assert self.diagram is not None
        turn, shift, factor, added = self.diagram
        engine = load_engine(self.engine, Path())
        own = engine.family.diagrams[list(engine.family.loads).index(engine.values["load"])]
        half = round(math.degrees(own.period)) // 2
        degrees = np.arange(-half, half, 1.0)
        pressure = own(np.radians(degrees - shift)) * 1e-5 * factor + added
        rows = [f"{a * turn:.9g},{p:.9g}" for a, p in zip(degrees, pressure, strict=True)]
        path.write_text("\n".join(["crank_angle_deg,pressure_bar", *rows]) + "\n")
        return path


def _set(text: str, engine: str, *quantities: str, **values: Any) -> Mistake:
    return Mistake(text, engine, values, quantities or ("delta",))


def _diagram(text: str, engine: str, turn: float = 1.0, shift: float = 0.0, factor: float = 1.0,
             added: float = 0.0) -> Mistake:  # fmt: skip
    return Mistake(text, engine, diagram=(turn, shift, factor, added))


MISTAKES: tuple[Mistake, ...] = (
    _set("bore in mm", "ntua", bore=140.0),
    _set("bore in cm", "si_four_87x101", bore=8.75),
    _set("bore in inches", "ntua", bore=5.512),
    _set("radius for bore", "si_four_87x101", bore=0.04375),
    _set("stroke in mm", "diesel_105x137", stroke=137.0),
    _set("stroke in cm", "diesel_105x137", stroke=13.7),
    _set("stroke in inches", "ntua", stroke=7.087),
    _set("crank radius for stroke", "ntua", stroke=0.09),
    _set("rod length in mm", "ntua", rod_length=350.0),
    _set("rod length in cm", "ntua", rod_length=35.0),
    _set("rod length in inches", "ntua", rod_length=13.78),
    _set("centre of gravity of the rod in mm", "ntua", rod_centre_of_gravity=94.0),
    _set("centre of gravity of the rod from the small end", "ntua", rod_centre_of_gravity=0.256),
    _set("crank ratio inverted", "ntua", crank_ratio=3.89),
    _set("stroke over rod for crank ratio", "ntua", crank_ratio=0.514),
    _set("half the crank ratio", "ntua", crank_ratio=0.1286),
    _set("reciprocating mass in g", "ntua", reciprocating_mass=6670.0),
    _set("reciprocating mass in lb", "ntua", reciprocating_mass=14.7),
    _set("piston mass in g", "si_four_87x101", piston_mass=500.0),
    _set("rod mass in g", "v8_cross_plane_93x86", rod_mass=555.0),
    _set("crank mass in g", "ntua", "rotating_force", crank_mass=1000.0),
    _set("inertia in kg cm2", "ntua", inertia=2e4),
    _set("inertia in kg cm2, one of many cylinders", "v8_flat_plane_94x93", inertia=2000.0),
    _set("inertia in g m2", "ntua", inertia=2000.0),
    _set("inertia in kg mm2", "ntua", inertia=2e6),
    _set("inertia in lb in2", "si_four_87x101", inertia=0.15 / 2.926397e-4),
    _set("inertia in lb ft2", "si_four_87x101", inertia=0.15 / 0.04214),
    _set("GD2 for inertia", "ntua", inertia=8.0),
    _set("flywheel's inertia in kg cm2", "compressor_79x83", flywheel_inertia=500.0),
    _set("inertia in t m2", "marine_80x345", inertia=400.0),
    _set("speed in rad/s", "ntua", speed=125.7),
    _set("speed in 1/s", "ntua", speed=20.0),
    _set("speed in rad/s, of a fast engine", "v8_flat_plane_94x93", speed=785.4),
    _set("crankcase pressure in kPa", "ntua", crankcase_pressure=101.325),
    _set("crankcase pressure in Pa", "ntua", crankcase_pressure=101325.0),
    _set("crankcase pressure in MPa", "ntua", crankcase_pressure=0.101325),
    _set("crankcase pressure in psi", "ntua", crankcase_pressure=14.7),
    _set("crankcase pressure over the atmosphere", "ntua", crankcase_pressure=0.0),
    _set("load as a share of 1", "ntua", load=0.5),
    _set("friction in kPa", "ntua", friction_constant=13.7),
    _set("friction in Pa", "ntua", friction_constant=13700.0),
    _set("friction torque for friction in bar", "ntua", friction_constant=32.8),
    _set("friction over piston speed in kPa s/m", "ntua", friction_mean_piston_speed=14.2),
    _set("moment of inertia of the rod in kg cm2", "diesel_105x137", "rod_couple_torque",
         rod_inertia=175.0),
    _set("spacing of cylinders in mm", "si_four_87x101", "shaking_moment", cylinder_spacing=96.0),
    _set("radius of counterweights in mm", "b112", "counterweight_required",
         counterweight_radius=31.34),
    _set("diameter of the flywheel in mm", "ntua", "flywheel_mass", wanted_delta=0.01,
         flywheel_outer_diameter=450.0, flywheel_inner_diameter=300.0, flywheel_density=7850.0),
    _set("density in g/cm3", "ntua", "flywheel_thickness", wanted_delta=0.01,
         flywheel_outer_diameter=0.45, flywheel_inner_diameter=0.3, flywheel_density=7.85),
    _set("wanted delta in percent", "ntua", "inertia_required", wanted_delta=0.67),
    _set("wanted delta inverted", "ntua", "inertia_required", wanted_delta=150.0),
    _set("slip in percent", "compressor_79x83", motor_slip=3.33),
    _set("breakdown slip in percent", "compressor_79x83", motor_breakdown_slip=16.0),
    _set("heat in kPa", "marine_80x345", heat=3340.0),
    _set("heat in MPa", "marine_80x345", heat=3.34),
    _set("intake pressure in kPa", "marine_80x345", intake_pressure=390.0),
    _set("intake pressure in psi", "si_four_87x101", intake_pressure=14.5),
    _set("duration of combustion in radians", "marine_80x345", combustion_duration=0.87),
    _set("start of combustion in radians", "marine_80x345", combustion_start=-0.07),
    Mistake(
        "rated power in kW", "ntua", {"speed": 1200.0}, ("characteristic_torque",),
        more={"characteristic": {"kind": "diesel"},
              "designs": {"rated_power": [25.0], "rated_speed": [1500.0]}},
    ),
    _set("held power in kW", "si_four_87x101", speed=3000.0, held_power=30.0),
    Mistake(
        "start speed in rpm", "ntua",
        more={"solver": {"method": "thesis", "passes": 1, "start_speed": 1200.0}},
    ),
    _diagram("diagram 20 degrees late", "ntua", shift=20.0),
    _diagram("diagram 20 degrees late, spark ignition", "si_four_87x101", shift=20.0),
    _diagram("diagram 20 degrees early", "ntua", shift=-20.0),
    _diagram("diagram 20 degrees early, spark ignition", "si_four_87x101", shift=-20.0),
    _diagram("diagram 180 degrees off", "ntua", shift=180.0),
    _diagram("diagram 360 degrees off", "ntua", shift=360.0),
    _diagram("diagram over radians", "ntua", turn=math.pi / 180.0),
    _diagram("diagram against the rotation", "ntua", turn=-1.0),
    _diagram("diagram in kPa", "ntua", factor=100.0),
    _diagram("diagram in Pa", "ntua", factor=1e5),
    _diagram("diagram in MPa", "ntua", factor=0.1),
    _diagram("diagram in MPa, charged engine", "diesel_105x137", factor=0.1),
    _diagram("diagram in psi", "ntua", factor=14.504),
    _diagram("diagram over the atmosphere", "ntua", added=-1.01325),
)  # fmt: skip
