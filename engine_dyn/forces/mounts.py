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

from engine_dyn.types import Floats

__all__ = ["Mounts"]


@dataclass(frozen=True, eq=False)
class Mounts:
    """Mounts of a block, one a place of each array, shape (N,).

    Attributes
    ----------
    lateral : ndarray
        Distance to the right of the crank's axis [m], seen so that the crank turns clockwise.
    position : ndarray, optional
        Place along the shaft [m], from where throws have the position 0, away from the free end.
        None: pitch is left to others.
    stiffness : ndarray
        Of each over that of any [1].
    height : float
        Of all above the crank's axis [m].

    Raises
    ------
    ValueError
        Where they do not hold the block.
    """

    lateral: Floats
    position: Floats | None
    stiffness: Floats
    height: float = 0.0

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
