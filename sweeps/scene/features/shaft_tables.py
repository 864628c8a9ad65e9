"""Tables of a shaft that twists, as scenes, engine files and files of shafts give them."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from engine_dyn.torsion.shaft import (
    MOST_DAMPERS,
    MOST_EXCITATIONS,
    MOST_GEARS,
    MOST_MODES,
    MOST_OF_SCENE,
)
from sweeps.base.checks import Strict
from sweeps.scene.features.torque_diagrams import GivenTorque

NAME = "a string: its name, which tells it from the others"

BETWEEN = "a list of two names of discs"

MOST_SPEEDS = 1000

SPEED = "a number in rpm above 0: of the crank"


class TorqueOfDisc(GivenTorque):
    """A torque over the angle of its disc, as of a torque diagram."""

    kind: str = Field(default="torque", description="'torque'", pattern="torque")


class TorqueAtSpeed(TorqueOfDisc):
    """The torque at one speed of the crank."""

    speed: float = Field(description=SPEED, gt=0.0)


class ExcitationTable(TorqueOfDisc):
    """A torque on a disc of the shaft, positive in the sense in which the disc turns."""

    on: str = Field(description="the name of a disc", min_length=1)
    name: str | None = Field(
        default=None, description="a string: what acts, which tells it from the others",
        min_length=1, max_length=80,
    )  # fmt: skip
    phase: float = Field(
        default=0.0, ge=-720.0, le=720.0,
        description="a number in degree, -720 to 720: the disc's own angle at firing top dead "
        "centre of cylinder 1",
    )  # fmt: skip
    power: float = Field(
        default=0.0, ge=-10.0, le=10.0,
        description="a number, -10 to 10: of the speed to which the torque is proportional",
    )  # fmt: skip
    reference_speed: float | None = Field(
        default=None, description=f"{SPEED}, at which the torque is the one that is given", gt=0.0
    )
    factor: float | None = Field(default=None, description="a number: factor on the torque")
    over_speed: list[TorqueAtSpeed] | None = Field(
        default=None, min_length=2, max_length=MOST_SPEEDS,
        description=f"a list of 2 to {MOST_SPEEDS} tables with speed and a torque, in place of one",
    )  # fmt: skip


class Source(Strict):
    """A citation."""

    text: str = Field(description="a string: one citation")


class DampingTable(Strict):
    """Viscous damping over the speed of the crank."""

    speed: list[float] = Field(
        description="a list of speeds of the crank in rpm, ascending from 0 or more", min_length=2
    )
    damping: list[float] = Field(
        description="a list of dampings in N m s/rad, one for each speed", min_length=2
    )


class Disc(Strict):
    """A disc: what turns as one."""

    name: str = Field(description=NAME, min_length=1, max_length=80)
    inertia: float = Field(description="a number in kg m2")
    throw: int | None = Field(
        default=None, description="a whole number: the throw of the engine, from 1", ge=1
    )
    damping: float | None = Field(default=None, description="a number in N m s/rad")
    damping_over_speed: DampingTable | None = Field(
        default=None, description="a table with speed and damping, in place of damping"
    )
    ground_stiffness: float | None = Field(default=None, description="a number in N m/rad")


class StiffnessTable(Strict):
    """Stiffness of a coupling over its mean torque."""

    torque: list[float] = Field(
        description="a list of mean torques in N m, ascending from 0 or more", min_length=2
    )
    stiffness: list[float] = Field(
        description="a list of stiffnesses in N m/rad, one for each torque", min_length=2
    )


class TwistTable(Strict):
    """Torque of a coupling over its twist, which is not linear."""

    twist: list[float] = Field(
        description="a list of twists in degree, ascending: from 0, or from below 0 through 0",
        min_length=2,
    )
    torque: list[float] = Field(
        description="a list of torques in N m, ascending, one for each twist: 0 at 0", min_length=2
    )


class ShaftPiece(Strict):
    """A shaft between two discs: stiffness, or length, diameter and shear modulus."""

    name: str | None = Field(default=None, description=NAME, min_length=1, max_length=80)
    between: list[str] | None = Field(
        default=None,
        description=f"{BETWEEN}; by default the disc of the shaft's own number and the next",
        min_length=2,
        max_length=2,
    )
    stiffness: float | None = Field(default=None, description="a number in N m/rad")
    stiffness_over_torque: StiffnessTable | None = Field(
        default=None, description="a table with torque and stiffness, of a coupling"
    )
    torque_over_twist: TwistTable | None = Field(
        default=None, description="a table with twist and torque, of a coupling that is not linear"
    )
    clearance: float | None = Field(default=None, description="a number in degree")
    friction_torque: float | None = Field(default=None, description="a number in N m")
    friction_stiffness: float | None = Field(default=None, description="a number in N m/rad")
    loss_factor: float | None = Field(default=None, description="a number")
    magnifier: float | None = Field(
        default=None,
        description="a number above 0: dynamic magnifier of the shaft, 1/loss_factor, in its place",
        gt=0.0,
    )
    damping: float | None = Field(default=None, description="a number in N m s/rad")
    damping_over_speed: DampingTable | None = Field(
        default=None, description="a table with speed and damping, in place of damping"
    )
    length: float | None = Field(default=None, description="a number in m")
    diameter: float | None = Field(default=None, description="a number in m")
    bore: float | None = Field(default=None, description="a number in m")
    shear_modulus: float | None = Field(default=None, description="a number in GPa")
    stress_limit: float | None = Field(default=None, description="a number in MPa")
    transient_stress_limit: float | None = Field(default=None, description="a number in MPa")
    torque_limit: float | None = Field(default=None, description="a number in N m")
    tensile_strength: float | None = Field(default=None, description="a number in MPa")
    shape_factor: float | None = Field(default=None, description="a number, at most 1")
    steel: Literal["carbon", "alloy"] | None = Field(
        default=None,
        description="'carbon' or 'alloy', of which more of the tensile_strength counts; default: "
        "'carbon', as for propeller shafts of any steel",
    )


class Gear(Strict):
    """Two discs in mesh, which turn in a fixed ratio."""

    between: list[str] = Field(description=BETWEEN, min_length=2, max_length=2)
    ratio: float | str = Field(
        description="a number: speed of the second disc over that of the first, below 0 where it "
        "turns the other way"
    )


class Damper(Strict):
    """A ring that a spring, oil or rubber holds on a disc."""

    name: str | None = Field(default=None, description=NAME, min_length=1, max_length=80)
    on: str = Field(description="the name of a disc", min_length=1)
    inertia: float = Field(description="a number in kg m2")
    damping: float | None = Field(default=None, description="a number in N m s/rad")
    stiffness: float | None = Field(default=None, description="a number in N m/rad")
    loss_factor: float | None = Field(default=None, description="a number")
    surface: float | None = Field(
        default=None, description="a number in m2, which gives off its heat"
    )


class PendulumTable(Strict):
    """Pendulums on a disc that the centrifugal force holds, tuned to the order (R/r)^(1/2)."""

    name: str | None = Field(default=None, description=NAME, min_length=1, max_length=80)
    on: str = Field(description="the name of a disc", min_length=1)
    mass: float = Field(description="a number in kg: of all pendulums together")
    distance: float = Field(
        description="a number in m, R: from the axis of the shaft to the suspension"
    )
    length: float = Field(description="a number in m, r: of the pendulum")
    stop_angle: float | None = Field(default=None, description="a number in degree")


class ShaftTable(Strict):
    """Discs, shafts, gears and dampers; which discs the flywheel and the load are."""

    discs: list[Disc] = Field(
        description=f"a list of 2 to {MOST_OF_SCENE} tables with name, inertia and, of throws, "
        "throw",
        min_length=2,
        max_length=MOST_OF_SCENE,
    )
    shafts: list[ShaftPiece] = Field(
        description="a list of tables with stiffness, or length, diameter and shear_modulus",
        min_length=1,
        max_length=MOST_OF_SCENE,
    )
    gears: list[Gear] = Field(
        default=[], description="a list of tables with between and ratio", max_length=MOST_GEARS
    )
    dampers: list[Damper] = Field(
        default=[], description="a list of tables with on and inertia", max_length=MOST_DAMPERS
    )
    pendulums: list[PendulumTable] = Field(
        default=[],
        description="a list of tables with on, mass, distance and length",
        max_length=MOST_DAMPERS,
    )
    excitations: list[ExcitationTable] = Field(
        default=[],
        description=f"a list of at most {MOST_EXCITATIONS} tables with on, and mean and harmonics, "
        "file, areas or over_speed",
        max_length=MOST_EXCITATIONS,
    )
    flywheel: str = Field(
        default="flywheel", description="the name of a disc: that of the flywheel", min_length=1
    )
    load: str | None = Field(
        default=None, description="the name of a disc: that of the load; default: the last disc"
    )
    auxiliaries: str | None = Field(
        default=None,
        description="the name of a disc: that of [[auxiliaries]]; default: the free end of the "
        "crankshaft",
    )
    reciprocating: Literal["included", "added"] = Field(
        description="'included' where the inertias of the throws' discs include the mean of the "
        "reciprocating masses, else 'added'"
    )
    loss_factor: float | None = Field(
        default=None, description="a number: that of shafts that have none of their own"
    )
    shear_modulus: float | None = Field(
        default=None, description="a number in GPa: that of shafts that have none of their own"
    )
    modal_damping: float | list[float] | None = Field(
        default=None,
        description=f"a number, or a list of at most {MOST_MODES}: damping ratio of the modes from "
        "the lowest, of which the last is that of all higher ones",
    )
    modal_magnifier: float | list[float] | None = Field(
        default=None,
        description=f"a number above 0.5, or a list of at most {MOST_MODES}: dynamic magnifier of "
        "the modes, 1/(2 modal_damping), in its place",
    )
    load_damping: float | None = Field(default=None, description="a number in N m s/rad")
    load_damping_factor: float | None = Field(default=None, description="a number")
    passing_start: float | None = Field(default=None, description=SPEED)
    passing_end: float | None = Field(
        default=None, description=f"{SPEED}, above or below passing_start"
    )
    speed_ramp: float | None = Field(default=None, description="a number in rpm/s above 0")


class ShaftFile(Strict):
    """A file with a shaft."""

    title: str | None = Field(default=None, description="a string: one line about the shaft")
    shaft: ShaftTable = Field(description="a table [shaft] with discs and shafts")
    assumed: dict[str, str] = Field(
        default={}, description="a table with a reason, as a string, for each assumed value"
    )
    source: list[Source] = Field(default=[], description="tables [[source]] with one string each")
