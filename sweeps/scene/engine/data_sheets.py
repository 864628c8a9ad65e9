"""Engine files as data sheets: what is known of an engine that has no diagram yet.

Any engine file serves; `[[diagram]]` tables may be missing, and of [values] all but bore, stroke
and cylinders.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from engine_dyn.plausibility.judgement import implausible
from engine_dyn.quantities.graph import PARAMETERS
from sweeps.base.checks import number
from sweeps.base.errors import SceneError, not_known
from sweeps.scene.engine.cylinder_keys import CYLINDER_KEYS
from sweeps.scene.engine.engine_files import PERIODS, engine_file_of, read_cylinders, read_values
from sweeps.scene.engine.engine_tables import DataSheet
from sweeps.scene.engine.modelled_diagrams import KINDS
from sweeps.scene.engine.silenced_warnings import read_silenced
from sweeps.scene.engine.usual_engine import unusual_values
from sweeps.scene.features import KEYS_OF_SET
from sweeps.scene.features.torque_tables import read_driver, read_load

_NOT_KNOWN = ("heat", "premixed_start", "wall_factor", "compression_exponent", "expansion_exponent")

KNOWN_OF_CYCLE = tuple(
    key
    for key in KINDS["first_law"].fields
    if key not in ("crank_ratio", "offset_ratio", "bore", "stroke", "speed", *_NOT_KNOWN)
)
"""Keys of [data_sheet.cycle]: those of [[diagram]] kind = "first_law" without the fitted ones."""

PERIOD = PERIODS["four-stroke"]  # Period of the engines that a data sheet may describe [rad]


@dataclass(frozen=True)
class Sheet:
    """A data sheet, checked."""

    name: str  # The file as messages call it
    path: Path  # Path of the file
    values: Mapping[str, float]  # Table [values] as it is given, in the units of files
    published: DataSheet  # Table [data_sheet]; empty where there is none
    known: Mapping[str, float]  # Known numbers of the cycle, in the units of files
    rest: Mapping[str, Any]  # Other keys of the file as they are, without diagrams
    diagrams: int  # Number of diagrams in the file
    unusual: Sequence[str]  # One line for each measure of the values outside its usual range


def read_data_sheet(path: str | Path) -> Sheet:
    """Read an engine file as a data sheet; anything that a calibration cannot use is refused."""
    path = Path(path)
    name = str(path)
    given, raw = engine_file_of(path, name)
    if given.cycle != "four-stroke":
        raise SceneError(
            f"{name}: cycle = '{given.cycle}': must be 'four-stroke'; no usual values are known "
            "for two-stroke engines"
        )
    for key in ("pressure_scale", "pressure_factor"):
        if getattr(given, key) is not None:
            raise SceneError(
                f"{name}: {key}: not allowed here; diagrams are fitted for equal cylinders at "
                "rated speed"
            )
    own = read_values(given.values, name)
    values = {
        key: number(item, f"{name}: [values] {key}", PARAMETERS[key])
        for key, item in given.values.items()
    }
    if values.get("friction_law", 1.0) != 1.0:
        raise SceneError(
            f"{name}: [values] friction_law: not allowed here; diagrams are fitted with a + b p_max"
            " + c c_m + d c_m^2. Name the law in the scene, or in the calibrated file"
        )
    needed = {"bore": "a number in m", "stroke": "a number in m", "cylinders": "a whole number"}
    for key, what in needed.items():
        if key not in values:
            raise SceneError(f"{name}: [values] {key}: missing; must be {what}")
    for key in ("bore", "stroke"):
        most = KINDS["first_law"].fields[key].high
        if not values[key] < most:
            bore = implausible(bore=values[key])  # A stroke has about the length of a bore
            hint = f"; is {key} {bore[0].question}?" if bore and bore[0].question else ""
            raise SceneError(
                f"{name}: [values] {key} = {values[key]:g}: must be below {most:g} m{hint}"
            )
    read_cylinders(given, values["cylinders"], PERIOD, name)
    for key, read in (("load_table", read_load), ("driver_table", read_driver)):
        if raw.get(key) is not None:
            read(raw[key], path.parent, f"{name}: {key}")
    silenced = read_silenced(given.silenced_warnings, name)
    sheet = given.data_sheet or DataSheet()
    rest = {k: item for k, item in raw.items() if k not in ("values", "diagram", "data_sheet")}
    return Sheet(
        name=name,
        path=path,
        values=values,
        published=sheet,
        known=_known(sheet.cycle, f"{name}: [data_sheet.cycle]"),
        rest=rest,
        diagrams=len(given.diagram),
        unusual=unusual_values(own, silenced, name),
    )


def described(sheet: Sheet) -> bool:
    """Whether the file says how its cylinders are arranged."""
    return any(key in sheet.rest for key in ("firing_order", *CYLINDER_KEYS))


def files_named(sheet: Sheet) -> list[str]:
    """Files that the sheet refers to, whose paths start from its folder."""
    named = (sheet.rest.get(key) for key in KEYS_OF_SET)
    return [file for file in named if isinstance(file, str)]


def _known(table: Mapping[str, Any], where: str) -> dict[str, float]:
    """Numbers of [data_sheet.cycle], each within its range."""
    known = {}
    for key, raw in table.items():
        if key in _NOT_KNOWN:
            raise SceneError(
                f"{where} {key}: not allowed; it is fitted or follows from the other keys"
            )
        if key not in KNOWN_OF_CYCLE:
            raise SceneError(f"{where} {key}: unknown key{not_known(key, KNOWN_OF_CYCLE)}")
        field = KINDS["first_law"].fields[key]
        value = known[key] = number(raw, f"{where} {key}", unit=field.unit)
        inside = field.low <= value <= field.high if field.ends else field.low < value < field.high
        if not inside:
            raise SceneError(f"{where} {key} = {value:.6g}{field.words}: must be {field.allowed}")
    return known
