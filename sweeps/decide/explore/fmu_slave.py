"""The program of an exported FMU: curves over the crank angle, repeated and interpolated.

The FMU has a copy of this file. It needs pythonfmu, which the FMU has as well, and nothing else.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any
from uuid import NAMESPACE_OID, uuid5
from xml.etree.ElementTree import Element, SubElement

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class CrankAngleCurves(Fmi2Slave):
    """Curves at crank_angle + mean_speed time."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        text = Path(self.resources, "table.json").read_text(encoding="utf-8")
        table = json.loads(text)
        self.description = table["description"]
        self.guid = uuid5(NAMESPACE_OID, text)
        self.start, self.step = table["start"], table["step"]
        self.crank_angle = self.mean_speed = self.time = 0.0
        self.units = {"crank_angle": "rad", "mean_speed": "rad/s"}
        self.register_variable(
            Real(
                "crank_angle", causality=Fmi2Causality.input,
                description="crank angle, 0 at firing top dead centre of cylinder 1, of any size",
            )
        )  # fmt: skip
        self.register_variable(
            Real(
                "mean_speed", causality=Fmi2Causality.parameter, variability=Fmi2Variability.fixed,
                description="uniform speed: mean_speed times time is added to crank_angle; 0 where "
                "crank_angle alone drives the outputs",
            )
        )  # fmt: skip
        for name, curve in table["curves"].items():
            self.units[name] = curve["unit"]
            self.register_variable(
                Real(
                    name, causality=Fmi2Causality.output, description=curve["description"],
                    getter=lambda values=curve["values"]: self.interpolated(values),
                )
            )  # fmt: skip

    def interpolated(self, values: list[float]) -> float:
        """Cubic through four points with the slopes of central differences (Catmull-Rom)."""
        place = (self.crank_angle + self.mean_speed * self.time - self.start) / self.step
        low = math.floor(place)
        x = place - low
        a, b, c, d = (values[(low + i) % len(values)] for i in (-1, 0, 1, 2))
        cubic = 3.0 * (b - c) + d - a
        return b + 0.5 * x * (c - a + x * (2.0 * a - 5.0 * b + 4.0 * c - d + x * cubic))

    def setup_experiment(
        self, start_time: float, stop_time: float | None, tolerance: float | None
    ) -> None:
        """Begin at a time."""
        del stop_time, tolerance
        self.time = start_time

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Go on to the end of a step."""
        self.time = current_time + step_size
        return True

    def to_xml(self, model_options: dict[str, str] | None = None) -> Element:
        """Return the description of the model, with what pythonfmu leaves out: units, unknowns."""
        root = super().to_xml(model_options or {})
        defined = Element("UnitDefinitions")
        base_units = {
            "rad": {"rad": "1"},
            "rad/s": {"rad": "1", "s": "-1"},
            "N.m": {"kg": "1", "m": "2", "s": "-2"},
        }
        for unit in dict.fromkeys(self.units.values()):
            one = SubElement(defined, "Unit", {"name": unit})
            if unit in base_units:
                SubElement(one, "BaseUnit", base_units[unit])
        root.insert(1, defined)  # FMI wants UnitDefinitions after the first element, CoSimulation
        for variable in root.iter("ScalarVariable"):
            variable[0].set("unit", self.units[variable.attrib["name"]])
        for outputs in root.iterfind("ModelStructure/Outputs"):
            initial = SubElement(root[-1], "InitialUnknowns")
            initial.extend(Element("Unknown", unknown.attrib) for unknown in outputs)
        return root
