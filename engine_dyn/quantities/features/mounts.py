r"""Forces of an engine block on its mounts: a rigid block on mounts that hold it upright.

Statics at every crank angle, without the inertia of the block: it stands still, as on mounts whose
natural frequencies lie far above the orders that count. Seen along the shaft so that the crank
turns clockwise, the block bears

    R = -(M + e sum m r omega^2 b)      roll moment about the crank's axis, clockwise
    F, S                                shaking force, upwards and to the right
    P = sum F z                         pitch moment of the vertical shaking forces

M is the engine's torque less friction: cylinders and bearings pass the reaction of what turns on to
the block, whether the load or the flywheel's acceleration takes M. The sum is over the cylinders'
reciprocating masses, whose force passes the axis at the offset e of the pin's line; it is 0 without
one. The mounts at height h take S, so they bear R - h S. What drives or brakes the shaft stands
beside the block.

A mount of stiffness k at the lateral place y (right of the axis, where an upright crank goes down)
and the place x along the shaft gives way by w + a y + c x, which a rigid block has in common for
all. With A the rows 1, y and x of the mounts, K their stiffnesses and L = (F, h S - R, P), the
forces on the mounts, positive upwards, are K A^T (A K A^T)^-1 L: statically determinate for two
mounts without x and for three with it. Two at +-b bear -+R/(2 b).

Source: statics, derived here.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from engine_dyn.forces.balance import acceleration_harmonics
from engine_dyn.forces.mechanism import banks_of
from engine_dyn.forces.superposition import CrankTrain
from engine_dyn.geometry.cylinder_means import value_of_sets
from engine_dyn.geometry.cylinders import Cylinders, Member
from engine_dyn.quantities.balance import FORCE, MOMENT, running_gear
from engine_dyn.quantities.features.feature import Feature
from engine_dyn.quantities.features.web_weights import middle_of
from engine_dyn.quantities.node import Dimension, Node, hidden
from engine_dyn.types import Floats


@dataclass(frozen=True, eq=False)
class Mounts:
    """Mounts of a block, one a place of each array, shape (N,).

    Raises
    ------
    ValueError
        Where they do not hold the block.
    """

    # Distance of each mount to the right of the crank's axis [m]; the crank turns clockwise.
    lateral: Floats
    # Position of each mount along the shaft [m], from position 0 of the throws, away from the free
    # end. With None, pitch is not computed.
    position: Floats | None
    stiffness: Floats  # Stiffness of each mount over a value that all have in common [1]
    height: float = 0.0  # Height of all mounts above the crank's axis [m]

    def __post_init__(self) -> None:
        """Refuse mounts on which the block can tilt."""
        rows = self._places
        size = np.abs(rows).max(axis=1, keepdims=True)
        if np.linalg.matrix_rank(rows / np.where(size > 0.0, size, 1.0), tol=1e-9) < len(rows):
            must = "must stand at two lateral places at least"
            if self.position is not None:
                must = "with positions, three at least must not stand in one line"
            raise ValueError(f"the block can tilt: {must}")

    @property
    def _places(self) -> Floats:
        rows = [np.ones(self.lateral.size), self.lateral]
        return np.stack(rows if self.position is None else [*rows, self.position])

    @cached_property
    def shares(self) -> Floats:
        """K A^T (A K A^T)^-1, shape (N, 2 or 3): force of each mount per load."""
        rows = self._places
        weighted = self.stiffness * rows
        return np.asarray(np.linalg.solve(weighted @ rows.T, weighted).T)

    def forces(self, number: Any, roll: Any, force: Any, pitch: Any = 0.0) -> Any:
        """Force on mounts, positive upwards [N]; all broadcast, also amplitudes of orders.

        Parameters
        ----------
        number : array_like of int
            Of the mount, from 1.
        roll : array_like
            R [N m].
        force : tuple of array_like
            F and S [N].
        pitch : array_like
            P about the place 0 along the shaft [N m].

        Examples
        --------
        >>> mounts = Mounts(np.array([-0.3, 0.3]), None, np.ones(2))
        >>> mounts.forces(np.array([1, 2]), -60.0, (0.0, 0.0))
        array([-100.,  100.])
        """
        up, side = force
        loads = (up, self.height * np.asarray(side) - roll, pitch)
        shares = self.shares[np.asarray(number, dtype=int) - 1]
        return sum(shares[..., i] * loads[i] for i in range(shares.shape[-1]))


# --- nodes ----------------------------------------------------------------------------------------

SOURCE = "this project"

_OFFSET = (
    "crank_ratio", "offset_ratio", "double_radius", "reciprocating_mass", "speed", "cylinder_set",
    "cylinders_by_count",
)  # fmt: skip


def _lever(needs: dict[str, Any]) -> Any:
    """Return m r omega^2 e [N m], the lever of a moment by the pin's offset."""
    radius = 0.5 * needs["double_radius"]
    return needs["reciprocating_mass"] * np.square(radius * needs["speed"]) * needs["offset_ratio"]


def _offset_moment(*, crank_angle: Any, period: Any, **needs: Any) -> Any:
    train = CrankTrain(
        needs["crank_ratio"], needs["double_radius"], needs["cylinder_set"], period,
        needs["offset_ratio"], needs["cylinders_by_count"],
    )  # fmt: skip

    def one(phi: Any, member: Member) -> Any:
        return member.side * member.mass_factor * train.acceleration(phi, member)

    return _lever(needs) * train.superpose(one, crank_angle)


def _offset_moment_harmonics(*, order: Any, **needs: Any) -> Any:
    def of_engine(engine: Cylinders) -> Any:
        total: Any = 0.0
        for member in engine.members:
            own = member.own(needs["crank_ratio"], needs["offset_ratio"])
            share = member.side * member.mass_factor * member.radius_factor
            share = share * np.exp(1j * order * member.phase)
            total = total + share * acceleration_harmonics(order, *own)
        return total

    sums = value_of_sets(needs["cylinder_set"], needs["cylinders_by_count"], of_engine)
    return _lever(needs) * sums


def _upright(needs: dict[str, Any]) -> Any:
    """Turn vectors from cylinder 1's direction to one whose real part is upright."""
    return np.exp(1j * value_of_sets(
        needs["cylinder_set"], needs["cylinders_by_count"], lambda engine: banks_of(engine)[0]
    ))  # fmt: skip


def _middle(needs: dict[str, Any]) -> Any:
    return value_of_sets(
        needs["cylinder_set"], needs["cylinders_by_count"], middle_of
    ) * needs["cylinder_spacing"]  # fmt: skip


def _force(*, roll_moment: Any, crank_angle: Any, mounts: Any, mount: Any, **needs: Any) -> Any:
    gear, turn = running_gear(needs), _upright(needs)
    force = gear.force(crank_angle) * turn
    pitch: Any = 0.0
    if "cylinder_spacing" in needs:
        pitch = (gear.moment(crank_angle) * turn).real + _middle(needs) * force.real
    return mounts.forces(mount, roll_moment, (force.real, force.imag), pitch)


def _harmonics(*, roll_moment_harmonics: Any, order: Any, mounts: Any, mount: Any, **needs: Any
               ) -> Any:  # fmt: skip
    gear, turn = running_gear(needs), _upright(needs)
    forward, backward = (wave * turn for wave in gear.force_orders(order))
    # Real part (up) and imaginary part (side) of forward exp(i nu phi) + backward exp(-i nu phi),
    # each as its coefficient of exp(i nu phi).
    up, side = forward + np.conj(backward), -1j * (forward - np.conj(backward))
    pitch: Any = 0.0
    if "cylinder_spacing" in needs:
        forward, backward = (wave * turn for wave in gear.moment_orders(order))
        pitch = forward + np.conj(backward) + _middle(needs) * up
    return mounts.forces(mount, roll_moment_harmonics, (up, side), pitch)


def _of_cycle(name: str, symbol: str, size: str) -> Node:
    return Node(
        name, symbol, "N", f"{size} vertical force on each mount over the cycle, positive upwards",
        SOURCE, needs=("mount_force",), removes=("crank_angle",), throws=True, width=100_000,
        extreme_of=("mount_force", size),
    )  # fmt: skip


NODES: tuple[Node, ...] = (
    Node("offset_moment", "", "N m", "moment of the inertia forces about the crank's axis",
         kind="curve", public=False, when="centred", make=lambda: 0.0),
    Node("offset_moment", "", "N m", "moment of the inertia forces about the crank's axis",
         kind="curve", public=False, when="offset", needs=("crank_angle", "period", *_OFFSET),
         make=_offset_moment),
    hidden("offset_moment_harmonics", "N m", "harmonics of that moment", lambda: 0.0,
           when="centred"),
    hidden("offset_moment_harmonics", "N m", "harmonics of that moment", _offset_moment_harmonics,
           ("order", *_OFFSET), when="offset", width=16),
    Node(
        "roll_moment", "M_R", "N m",
        "moment of the engine on its block about the crankshaft's axis, reaction of the torque, "
        "positive in the sense of rotation",
        SOURCE, kind="curve", needs=("torque", "offset_moment"),
        make=lambda torque, offset_moment: -(torque + offset_moment),
    ),
    hidden(
        "roll_moment_harmonics", "N m", "harmonics of the roll moment",
        lambda torque_harmonics, offset_moment_harmonics:
        -(torque_harmonics + offset_moment_harmonics), width=16,
    ),
    Node(
        "roll_moment_order", r"M_{R,\nu}", "N m",
        "amplitude of the orders of the roll moment, without those of friction", SOURCE,
        needs=("roll_moment_harmonics",),
        make=lambda roll_moment_harmonics: np.abs(roll_moment_harmonics),
    ),
    *(
        node
        for word, needs in (
            ("mounts_without_pitch", FORCE),
            ("mounts_with_pitch", tuple(dict.fromkeys((*FORCE, *MOMENT)))),
        )
        for node in (
            Node(
                "mount_force", "F_M", "N",
                "vertical force of the engine on each mount, without weight, positive upwards, "
                "rigid block",
                SOURCE, kind="curve", throws=True, when=word,
                needs=("roll_moment", "crank_angle", "mounts", "mount", *needs), make=_force,
            ),
            hidden(
                "mount_force_harmonics", "N", "harmonics of the force on each mount",
                _harmonics, ("roll_moment_harmonics", "order", "mounts", "mount", *needs),
                throws=True, when=word, width=16,
            ),
        )
    ),
    _of_cycle("mount_force_max", "F_{M,max}", "largest"),
    _of_cycle("mount_force_min", "F_{M,min}", "smallest"),
    Node(
        "mount_force_order", r"F_{M,\nu}", "N",
        "amplitude of the orders of the vertical force on each mount", SOURCE,
        needs=("mount_force_harmonics",),
        make=lambda mount_force_harmonics: np.abs(mount_force_harmonics),
    ),
)  # fmt: skip

FEATURE: Feature[Mounts] = Feature(
    "mounts", "mounts of the engine block", "balance", NODES, constant="mounts",
    dimensions=(
        Dimension("mount", "", "1", "mount of the engine block, counted from 1", whole=True),
    ),
    sizes=lambda mounts: (mounts.lateral.size,),
    words=(
        {
            "mounts_without_pitch": "mounts have no places along the shaft, or there are none",
            "mounts_with_pitch": "mounts have places along the shaft too",
        },
    ),
    called={
        "shaking_force": "free force, unbalanced force, inertia force on the mounts",
        "roll_moment": "torque reaction, rolling moment, mount reaction",
        "mount_force": "engine mount, support, foundation, reaction",
    },
)  # fmt: skip
of = FEATURE.of
