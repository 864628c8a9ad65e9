"""The shaft that twists: [shaft] of scenes and engine files, and files with such a table.

A shaft is discs and what joins them. Names tell discs apart; numbers of discs, shafts, gears and
dampers, in the order of the lists, are those of the parameters: `disc_inertia_3`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from engine_dyn.engine import Engine
from engine_dyn.loads.torque_curves import TorqueOverAngle
from engine_dyn.quantities.features.shaft import FEATURE
from engine_dyn.quantities.graph import PARAMETERS
from engine_dyn.quantities.parameters import INERTIA_PARTS
from engine_dyn.torsion.couplings import Coupling
from engine_dyn.torsion.shaft import MOST_MODES, OverSpeed, Shaft, Table
from engine_dyn.units import DEGREE, RPM
from sweeps.base.checks import Strict, check_range, check_structure, mentioned, number, plain
from sweeps.base.errors import SceneError, not_known, shown
from sweeps.base.files.regular_files import kept, referred
from sweeps.base.files.toml_files import parse_toml
from sweeps.catalogue import SHAFTS
from sweeps.scene.features.feature import GivenFeature, with_part
from sweeps.scene.features.shaft_tables import (
    BETWEEN,
    Disc,
    ExcitationTable,
    ShaftFile,
    ShaftPiece,
    ShaftTable,
    StiffnessTable,
    TwistTable,
)
from sweeps.scene.features.torque_diagrams import read_torque_diagram
from sweeps.scene.values import GivenValues

if TYPE_CHECKING:
    from engine_dyn.torsion.excitation import Excitation

SHAFT = (
    "a table [shaft] with discs and shafts, the name of a built-in shaft, or the path of a file "
    "with such a table"
)

INERTIA_KEYS = ("inertia", *INERTIA_PARTS)  # Parameters that the discs of a shaft replace

SHAFT_KEYS = (
    "load_damping", "load_damping_factor", "passing_start", "passing_end", "speed_ramp"
)  # fmt: skip
"""Parameters of a shaft that belong to no single disc."""

_NOT_NUMBERS = (
    "name", "between", "stiffness_over_torque", "torque_over_twist", "steel", "magnifier",
    "damping_over_speed",
)  # fmt: skip


@dataclass(frozen=True)
class GivenShaft:
    """A shaft as read: what all designs have, values of its parameters, and where it comes from."""

    shaft: Shaft
    values: Mapping[str, float]
    assumed: Mapping[str, str] = field(default_factory=dict)
    sources: tuple[str, ...] = ()


def built_in_shafts() -> dict[str, Path]:
    """Shafts that come with the package: name and file."""
    return {path.stem: path for path in sorted(SHAFTS.glob("*.toml"))}


def read_shaft(given: Any, base: Path, where: str) -> GivenShaft:
    """Read the key `shaft`: a table, the name of a built-in shaft, or the path of a file.

    The path is relative to `base`; messages begin with `where`, such as "scene.toml: ".
    """
    if isinstance(given, Mapping):
        return _read(check_structure(ShaftTable, given, f"{where}[shaft]"), base, f"{where}[shaft]")
    if not isinstance(given, str) or not given:
        raise SceneError(f"{where}shaft = {shown(given)}: must be {SHAFT}")
    known = built_in_shafts()
    own = SHAFTS / f"{given}.toml"
    if given in known or kept(own):
        path, name = own, f"shaft {given}"
    elif given.endswith(".toml") or "/" in given or "\\" in given:
        path, name = referred(base, given, f"{where}shaft"), f"{where}shaft {given}"
    else:
        also = ", or the path of a file (.toml)"
        hint = not_known(given, known, also=also)
        raise SceneError(f"{where}shaft = {shown(given)}: unknown shaft{hint}")
    file = check_structure(
        ShaftFile, plain(parse_toml(path, name, "a file with a [shaft]"), name), name
    )
    made = _read(file.shaft, path.parent, f"{name}: [shaft]")
    return GivenShaft(
        made.shaft, made.values, {f"shaft, {key}": text for key, text in file.assumed.items()},
        tuple(source.text for source in file.source),
    )  # fmt: skip


class _Values:
    """Values of the shaft's parameters, collected and checked one by one."""

    def __init__(self) -> None:
        self.numbers: dict[str, float] = {}

    def take(self, item: Strict, kind: str, place: int, where: str, skip: Sequence[str]) -> None:
        """Take the numbers of one table: those of `stiffness` become `shaft_stiffness_2`."""
        for name in type(item).model_fields:
            raw = getattr(item, name)
            if raw is not None and name not in skip:
                self.set(f"{kind}_{name}_{place}", raw, f"{where} {name}")

    def set(self, key: str, raw: Any, where: str) -> None:
        node = PARAMETERS[key]
        self.numbers[key] = number(raw, where, node)
        check_range(self.numbers[key], where, node)


def _shafts(
    given: ShaftTable, names: list[str], values: _Values, over_speed: dict[str, OverSpeed],
    where: str,
) -> tuple[list[tuple[int, int]], dict[int, Table | Coupling]]:  # fmt: skip
    """Ends of the shafts, and couplings over their torque."""
    pairs: list[tuple[int, int]] = []
    tables: dict[int, Table | Coupling] = {}
    for i, piece in enumerate(given.shafts, start=1):
        at = f"{where} shafts number {i}"
        pairs.append(_ends(piece.between, i, names, at))
        values.take(piece, "shaft", i, at, _NOT_NUMBERS)
        over_speed |= _over_speed(piece, f"shaft_damping_{i}", at)
        damped = _one_of(piece, ("loss_factor", "magnifier"), at)
        if piece.magnifier is not None:
            values.set(f"shaft_loss_factor_{i}", 1.0 / piece.magnifier, f"{at} 1/magnifier")
        if piece.stiffness_over_torque is not None:
            tables[i - 1] = _over_torque(piece.stiffness_over_torque, f"{at} stiffness_over_torque")
        elif piece.torque_over_twist is not None:
            tables[i - 1] = _over_twist(piece.torque_over_twist, i - 1, f"{at} torque_over_twist")
        if not damped and given.loss_factor is not None:
            values.set(f"shaft_loss_factor_{i}", given.loss_factor, f"{where} loss_factor")
        if piece.length is not None and piece.shear_modulus is None and (
            given.shear_modulus is not None
        ):  # fmt: skip
            values.set(f"shaft_shear_modulus_{i}", given.shear_modulus, f"{where} shear_modulus")
        _check_stiffness(piece, values.numbers, i, at)
    return pairs, tables


def _gears(
    given: ShaftTable, names: list[str], values: _Values, where: str
) -> list[tuple[int, int]]:  # fmt: skip
    gears = []
    for i, gear in enumerate(given.gears, start=1):
        at = f"{where} gears number {i}"
        gears.append(_ends(gear.between, i, names, at))
        values.set(f"shaft_gear_ratio_{i}", gear.ratio, f"{at} ratio")
        if values.numbers[f"shaft_gear_ratio_{i}"] == 0.0:
            raise SceneError(f"{at} ratio = 0: must not be 0")
    return gears


def _held(
    given: ShaftTable, names: list[str], values: _Values, where: str
) -> list[tuple[int, int]]:  # fmt: skip
    """Disc and ring of the dampers, then those of the pendulums."""
    pairs = []
    for i, damper in enumerate(given.dampers, start=1):
        at = f"{where} dampers number {i}"
        pairs.append((_place(damper.on, names, f"{at} on"), len(names) + i - 1))
        values.take(damper, "damper", i, at, ("name", "on"))
        held = {f"damper_{name}_{i}" for name in ("damping", "stiffness")} & values.numbers.keys()
        if not any(values.numbers[key] > 0.0 for key in held):
            raise SceneError(f"{at}: has neither damping nor stiffness; nothing holds its ring")
    for i, pendulum in enumerate(given.pendulums, start=1):
        at = f"{where} pendulums number {i}"
        place = len(names) + len(given.dampers) + i - 1
        pairs.append((_place(pendulum.on, names, f"{at} on"), place))
        values.take(pendulum, "pendulum", i, at, ("name", "on"))
    return pairs


def _excitations(
    given: ShaftTable, names: list[str], values: _Values, folder: Path, where: str
) -> list[Excitation]:  # fmt: skip
    exciting = [one.name or f"excitation {i}" for i, one in enumerate(given.excitations, start=1)]
    _check_different(exciting, f"{where} excitations")
    excitations = []
    for i, excitation in enumerate(given.excitations, start=1):
        at = f"{where} excitations number {i}"
        place = _place(excitation.on, names, f"{at} on")
        if excitation.factor is not None:
            values.set(f"excitation_factor_{i}", excitation.factor, f"{at} factor")
        excitations.append(_read_excitation(excitation, place, exciting[i - 1], folder, at))
    return excitations


def _read(given: ShaftTable, folder: Path, where: str) -> GivenShaft:
    names = [disc.name for disc in given.discs]
    rings = [d.name or f"ring of damper {i}" for i, d in enumerate(given.dampers, start=1)]
    hung = [p.name or f"pendulum {i}" for i, p in enumerate(given.pendulums, start=1)]
    _check_different([*names, *rings, *hung], where)
    values, over_speed = _Values(), dict[str, OverSpeed]()
    # A common value is checked even if no shaft takes it
    for name in ("loss_factor", "shear_modulus"):
        if getattr(given, name) is not None:
            _Values().set(f"shaft_{name}_1", getattr(given, name), f"{where} {name}")
    for i, disc in enumerate(given.discs, start=1):
        at = f"{where} discs number {i}"
        values.take(disc, "disc", i, at, ("name", "throw", "damping_over_speed"))
        over_speed |= _over_speed(disc, f"disc_damping_{i}", at)
    pairs, tables = _shafts(given, names, values, over_speed, where)
    gears = _gears(given, names, values, where)
    pairs += _held(given, names, values, where)
    damped = _modal_damping(given, where)
    for i, ratio in enumerate(damped, start=1):
        values.set(f"modal_damping_{i}", ratio, f"{where} modal_damping number {i}")
    excitations = _excitations(given, names, values, folder, where)
    _one_of(given, ("load_damping", "load_damping_factor"), where)
    for name in SHAFT_KEYS:
        if getattr(given, name) is not None:
            values.set(name, getattr(given, name), f"{where} {name}")
    every = [*names, *rings, *hung]
    called = [
        piece.name or f"{every[first]} - {every[second]}"
        for piece, (first, second) in zip(
            [*given.shafts, *(ShaftPiece() for _ in (*rings, *hung))], pairs, strict=True
        )
    ]
    shaft = Shaft(
        discs=tuple(every),
        shafts=tuple(pairs),
        shaft_names=tuple(called),
        gears=tuple(gears),
        throws=_throws(given, where),
        flywheel=_place(given.flywheel, names, f"{where} flywheel"),
        load=len(names) - 1 if given.load is None else _place(given.load, names, f"{where} load"),
        auxiliaries=0
        if given.auxiliaries is None
        else _place(given.auxiliaries, names, f"{where} auxiliaries"),
        dampers=len(rings),
        pendulums=len(hung),
        includes_reciprocating=given.reciprocating == "included",
        keys=tuple(key for key in values.numbers if key not in SHAFT_KEYS),
        alloy=frozenset(i for i, piece in enumerate(given.shafts) if piece.steel == "alloy"),
        tables=tables,
        excitations=tuple(excitations),
        modes=len(damped),
        damping_over_speed=over_speed,
    )
    _check_joined(shaft, where)
    _check_different(called, where)
    if given.auxiliaries is None:
        shaft = replace(shaft, auxiliaries=shaft.free_end)
    return GivenShaft(shaft, values.numbers)


_OWN = ("on", "name", "phase", "power", "reference_speed", "factor", "over_speed")


def _read_excitation(
    given: ExcitationTable, disc: int, name: str, folder: Path, where: str
) -> Excitation:
    """Read one table, whose disc has this number; messages begin with `where`."""
    from engine_dyn.torsion.excitation import Excitation

    powered = "power" in given.model_fields_set
    if powered != (given.reference_speed is not None):
        missing = "reference_speed" if powered else "power"
        raise SceneError(
            f"{where} {missing}: missing; power and reference_speed go together: the torque is "
            "proportional to (speed/reference_speed)^power"
        )
    torque = given.model_dump(exclude_unset=True, exclude=set(_OWN))
    beside_file = {"harmonics", "areas", "angle_column", "torque_column"}
    if not {"file", "areas", "over_speed"} & given.model_fields_set:
        torque = {"harmonics": [], **torque}
    speeds, torques, of_file = list[float](), list[TorqueOverAngle](), None
    if given.file is not None and given.mean is not None and not beside_file & torque.keys():
        from sweeps.scene.features.torque_files import torques_of_file

        path = referred(folder, given.file, f"{where} file")
        label = f"{where} {given.file}"
        of_file = torques_of_file(path, label, given.torque_unit, given.mean)
    if of_file is not None and given.over_speed is None:
        speeds, torques = of_file
        if powered and speeds:
            raise SceneError(f"{where} power: not allowed: {given.file} has speeds")
    elif given.over_speed is None:
        torques = [read_torque_diagram({**torque, "kind": "torque"}, where, folder)]
    else:
        beside = [key for key in torque if key != "kind"]
        if beside or powered:
            key = [*beside, "power"][0]
            raise SceneError(f"{where} {key}: not allowed together with over_speed")
        speeds = [one.speed for one in given.over_speed]
        if not (np.diff(speeds) > 0.0).all():
            raise SceneError(f"{where} over_speed: speeds {shown(list(speeds))}: must ascend")
        torques = [
            read_torque_diagram(
                {**one.model_dump(exclude_unset=True, exclude={"speed"}), "kind": "torque"},
                f"{where} over_speed number {i}", folder,
            )
            for i, one in enumerate(given.over_speed, start=1)
        ]  # fmt: skip
    return Excitation(
        name, disc, tuple(torques), np.array(speeds) * RPM, given.power,
        (given.reference_speed or 1.0) * RPM, given.phase * DEGREE,
    )  # fmt: skip


def _place(name: str, names: Sequence[str], where: str) -> int:
    """Number of a disc, from 0."""
    if name not in names:
        raise SceneError(f"{where} = {shown(name)}: no such disc{not_known(name, names)}")
    return names.index(name)


def _ends(between: list[str] | None, number: int, names: Sequence[str], at: str) -> tuple[int, int]:
    """Discs that a shaft or gear joins."""
    if between is None:
        if number >= len(names):
            raise SceneError(
                f"{at}: between: missing; must be {BETWEEN}, because there is no disc number "
                f"{number + 1}"
            )
        return number - 1, number
    first, second = (_place(name, names, f"{at} between") for name in between)
    if first == second:
        raise SceneError(f"{at} between = {shown(between)}: must be two different discs")
    return first, second


def _check_different(names: Sequence[str], where: str) -> None:
    for i, name in enumerate(names):
        if name in names[:i]:
            raise SceneError(f"{where}: the name {shown(name)} is given twice; must be unique")


def _check_stiffness(
    piece: ShaftPiece, values: Mapping[str, float], number: int, at: str
) -> None:  # fmt: skip
    """Check that a shaft has a stiffness, or dimensions that give it, and that its bore fits."""
    if not _one_of(
        piece, ("stiffness", "length", "stiffness_over_torque", "torque_over_twist"), at
    ):
        raise SceneError(f"{at}: stiffness: missing; must be a number in N m/rad, or length")
    if piece.length is not None:
        for name in ("diameter", "shear_modulus"):
            if f"shaft_{name}_{number}" not in values:
                raise SceneError(f"{at}: {name}: missing; length needs it")
    if piece.length is None and piece.shear_modulus is not None:
        raise SceneError(f"{at} shear_modulus: has no effect without length")
    bore, diameter = (values.get(f"shaft_{name}_{number}") for name in ("bore", "diameter"))
    if bore is not None and diameter is None:
        raise SceneError(f"{at} bore: has no effect without diameter")
    if bore is not None and diameter is not None and bore >= diameter:
        raise SceneError(f"{at} bore = {bore:g}: must be below the diameter, {diameter:g} m")


def _one_of(given: Strict, ways: Sequence[str], at: str) -> str:
    """Which of some keys that exclude each other is given; empty where none is."""
    here = [name for name in ways if getattr(given, name) is not None]
    if len(here) > 1:
        raise SceneError(f"{at}: has both {here[0]} and {here[1]}; give one of them")
    return "".join(here)


def _ascending(given: Strict, along: str, of: str, least: float, where: str) -> tuple[Any, Any]:
    """Two columns of a table, equally long, of which the first ascends from `least` or more."""
    places, values = (np.array(getattr(given, name)) for name in (along, of))
    if places.size != values.size:
        one, other = (f"{name}s" if name[-1] != "s" else f"{name}es" for name in (along, of))
        raise SceneError(
            f"{where}: has {places.size} {one} and {values.size} {other}; must be equally many"
        )
    if places[0] < least or not (np.diff(places) > 0.0).all():
        begin = " from 0 or more" if least == 0.0 else ""
        raise SceneError(f"{where} {along} = {shown(places.tolist())}: must ascend{begin}")
    return places, values


def _over_torque(given: StiffnessTable, where: str) -> Table:
    """Stiffness of a coupling over its mean torque."""
    torque, stiffness = _ascending(given, "torque", "stiffness", 0.0, where)
    if not (stiffness > 0.0).all():
        raise SceneError(f"{where} stiffness = {shown(given.stiffness)}: must be above 0")
    return Table(torque, stiffness)


def _over_twist(given: TwistTable, place: int, where: str) -> Coupling:
    """Coupling by its torque over the twist."""
    twist, torque = _ascending(given, "twist", "torque", -math.inf, where)
    if not (np.diff(torque) > 0.0).all():
        raise SceneError(f"{where} torque = {shown(given.torque)}: must ascend")
    coupling = Coupling(place, twist * DEGREE, torque)
    twist, torque = coupling.table()
    if not twist[0] < 0.0 < twist[-1] or np.interp(0.0, twist, torque) != 0.0:
        raise SceneError(
            f"{where}: must have the torque 0 at the twist 0, at its beginning or between others"
        )
    return coupling


def _over_speed(item: Disc | ShaftPiece, key: str, at: str) -> dict[str, OverSpeed]:
    """Damping over the speed in place of the number with this key, if there is one."""
    given, where = item.damping_over_speed, f"{at} damping_over_speed"
    _one_of(item, ("damping", "damping_over_speed"), at)
    if given is None:
        return {}
    speed, damping = _ascending(given, "speed", "damping", 0.0, where)
    if not (damping >= 0.0).all():
        raise SceneError(f"{where} damping = {shown(given.damping)}: must be 0 or more")
    return {key: OverSpeed(speed * RPM, damping)}


def _modal_damping(given: ShaftTable, where: str) -> list[float]:
    """Damping ratios of modes, as given or from their dynamic magnifiers."""
    key = _one_of(given, ("modal_damping", "modal_magnifier"), where)
    if not key:
        return []
    numbers = np.atleast_1d(getattr(given, key)).tolist()
    if not 1 <= len(numbers) <= MOST_MODES:
        raise SceneError(f"{where} {key}: {len(numbers)} numbers: must be 1 to {MOST_MODES}")
    if key == "modal_damping":
        return [float(one) for one in numbers]
    for place, one in enumerate(numbers, start=1):
        if not one > 0.5:
            raise SceneError(f"{where} modal_magnifier number {place} = {one:g}: must be above 0.5")
    return [0.5 / one for one in numbers]


def _throws(given: ShaftTable, where: str) -> tuple[int, ...]:
    """Disc of each throw, in the order of their numbers."""
    places: dict[int, int] = {}
    for place, disc in enumerate(given.discs):
        if disc.throw is None:
            continue
        if disc.throw in places:
            raise SceneError(
                f"{where} discs number {place + 1}: throw = {disc.throw}: is on disc number "
                f"{places[disc.throw] + 1} already; each throw has one disc"
            )
        places[disc.throw] = place
    count = len(places)
    if sorted(places) != list(range(1, count + 1)) or not count:
        listed = ", ".join(map(str, sorted(places))) or "none"
        raise SceneError(
            f"{where} discs: throws {listed}: must be the numbers of all throws of the engine, "
            "from 1"
        )
    return tuple(places[number] for number in range(1, count + 1))


def _check_joined(shaft: Shaft, where: str) -> None:
    """Check that shafts and gears join all discs, and form no ring."""
    try:
        shaft.paths({f"shaft_gear_ratio_{i + 1}": 1.0 for i in range(len(shaft.gears))})
    except ValueError as error:
        text = mentioned(error)
        for i in range(len(shaft.discs)):
            text = text.replace(f"disc {i}:", f"disc {shown(shaft.discs[i])}:")
        joined = shaft.discs[shaft.throws[0]]
        if "no shafts or meshes join it" in text:
            head = text.split(":")[0]
            text = f"{head}: no shafts or gears join it to disc {shown(joined)}"
        elif "closes a loop" in text:
            text = "shafts and gears form a ring; must be a tree"
        raise SceneError(f"{where}: {text}") from None


def _with_shaft(engine: Engine, given: Any, folder: Path, where: str) -> Engine:
    """Engine with a shaft, whose discs replace the engine's moments of inertia."""
    read = read_shaft(given, folder, where)
    old = {*INERTIA_KEYS, *SHAFT_KEYS, *(engine.shaft.keys if engine.shaft else ())}
    values = {key: value for key, value in engine.values.items() if key not in old}
    engine = replace(
        engine,
        values={**values, **read.values},
        assumed={**engine.assumed, **read.assumed},
        sources=tuple(dict.fromkeys((*engine.sources, *read.sources))),
    )
    return with_part(engine, FEATURE.name, read.shaft)


def _words(values: GivenValues) -> tuple[str, ...]:
    shaft, factor = values.engine.shaft, "load_damping_factor"
    # A damping of the scene replaces the engine's factor.
    by_factor = values.gives(factor) or (
        values.engine_gives(factor) and not values.gives("load_damping")
    )
    damped = "damping_by_factor" if by_factor else "damping_of_law"
    if shaft is None:
        return (damped, *(next(iter(group)) for group in FEATURE.words[:-1]))
    by_rule = any("tensile_strength" in key for key in shaft.keys)
    return (
        damped,
        "reciprocating_included" if shaft.includes_reciprocating else "reciprocating_added",
        "pendulums" if shaft.pendulums else "no_pendulums",
        "coupling_tables" if shaft.tables else "linear_couplings",
        "damping_over_speed" if shaft.damping_over_speed else "steady_damping",
        "excitations" if shaft.excitations else "no_excitations",
        "transient_limits_of_rule" if by_rule else "transient_limits_given",
    )


GIVEN = GivenFeature(
    FEATURE, SHAFT, Any, _with_shaft, table=ShaftTable, words=_words,
    replaces="the shaft of the engine, its inertia and the parts of it",
    missing="a shaft: a table [shaft] with discs and shafts, or shaft = its name or file",
)  # fmt: skip
