"""Tables [[shaft.excitations]]: torques on discs besides those of engine, load and auxiliaries."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from pydantic import Field

from engine_dyn.torsion.excitation import Excitation
from engine_dyn.units import DEGREE, RPM
from sweeps.base.errors import SceneError, shown
from sweeps.scene.features.torque_diagrams import TorqueDiagram, read_torque_diagram

MOST_SPEEDS = 1000

SPEED = "a number in rpm above 0: of the crank"


class TorqueOfDisc(TorqueDiagram):
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


_OWN = ("on", "name", "phase", "power", "reference_speed", "factor", "over_speed")


def read_excitation(
    given: ExcitationTable, disc: int, name: str, folder: Path, where: str
) -> Excitation:
    """Read one table, whose disc has this number; messages begin with `where`."""
    powered = "power" in given.model_fields_set
    if powered != (given.reference_speed is not None):
        missing = "reference_speed" if powered else "power"
        raise SceneError(
            f"{where} {missing}: missing; power and reference_speed go together: the torque is "
            "proportional to (speed/reference_speed)^power"
        )
    torque = given.model_dump(exclude_unset=True, exclude=set(_OWN))
    speeds: Sequence[float] = ()
    if given.over_speed is None:
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
