"""Orders of the torque as the excitation of a shaft, for programs of torsional vibration.

The torque of gas and reciprocating masses that acts on each throw, order by order, comes from an
archive with the quantities `throw_torque_order`, `throw_torque_phase` and `order_frequency`. It is
M cos(nu phi + psi), phi = omega t from firing top dead centre of cylinder 1, at constant speed; the
mean torque is left out. openTorsion's `PeriodicExcitation` takes the same numbers, as
U exp(i omega t).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from engine_dyn.types import Floats
from sweeps.base.errors import SceneError
from sweeps.decide.explore.opening import nearest

if TYPE_CHECKING:
    import xarray as xr

QUANTITIES = ("throw_torque_order", "throw_torque_phase", "order_frequency")
"""Quantities that an archive needs for an excitation."""


@dataclass(frozen=True)
class Excitation:
    """Torques on the nodes of a shaft."""

    nodes: tuple[int, ...]  # Number of the node on which each throw acts, along the shaft
    order: Floats  # Orders, in periods per revolution of the crank; shape (n,)
    omega: Floats  # Angular frequencies of the orders [rad/s], ascending; shape (n,)
    # Torque on each node: amplitude [N m] times cos(omega t + phase [rad]); shape (nodes, n)
    amplitude: Floats
    phase: Floats

    @property
    def complexes(self) -> npt.NDArray[np.complex128]:
        """U of U exp(i omega t), shape (nodes, n)."""
        return self.amplitude * np.exp(1j * self.phase)

    def for_opentorsion(self, dofs: int) -> Any:
        """Return an `opentorsion.PeriodicExcitation` of a shaft with so many degrees of freedom.

        Raises
        ------
        ImportError
            One line, where openTorsion is not installed.
        ValueError
            If a node lies outside the shaft.
        """
        self._check(dofs)
        try:
            import opentorsion
        except ImportError:
            raise ImportError(
                "opentorsion is not installed; pip install 'engine-dyn[torsion]'"
            ) from None
        made = opentorsion.PeriodicExcitation(dofs, self.omega)
        for node, amplitude, phase in zip(self.nodes, self.amplitude, self.phase, strict=True):
            made.add_sines(node, self.omega, amplitude, phase)
        return made

    def matrix(self, dofs: int) -> npt.NDArray[np.complex128]:
        """U for every degree of freedom, shape (dofs, n); errors as `for_opentorsion`."""
        self._check(dofs)
        torques = np.zeros((dofs, self.omega.size), dtype=np.complex128)
        for node, line in zip(self.nodes, self.complexes, strict=True):
            torques[node] += line
        return torques

    def _check(self, dofs: int) -> None:
        for node in self.nodes:
            if not 0 <= node < dofs:
                raise ValueError(f"node {node}: must be from 0 to {dofs - 1}")


def excitation(archive: xr.Dataset, nodes: Sequence[int], **select: float | str) -> Excitation:
    """Excitation of a shaft by one design of an archive.

    Parameters
    ----------
    archive : xarray.Dataset
        What `sweeps.run` returns, with the variables of `QUANTITIES`.
    nodes : sequence of int
        Node of each throw, from throw 1 on.
    **select : float
        Values of the archive's axes, where it has more than one design, as `nearest` takes them.

    Raises
    ------
    SceneError
        One line: variables or axes that are missing, more than one design, or more or fewer nodes
        than throws.
    """
    missing = [name for name in QUANTITIES if name not in archive]
    if missing:
        raise SceneError(
            f"archive: has no {', '.join(missing)}; ask for {', '.join(QUANTITIES)} in [output]"
        )
    data = nearest(archive, **select)[list(QUANTITIES)]
    # Archives of versions before 0.3 call the dimension of the throws "cylinder".
    throw = "throw" if "throw" in data.dims else "cylinder"
    several = [str(d) for d in data.dims if d not in (throw, "order") and data.sizes[d] > 1]
    if several:
        raise SceneError(f"archive: more than one design along {', '.join(several)}; choose one")
    data = data.squeeze([d for d in data.dims if d not in (throw, "order")])
    amplitude = data["throw_torque_order"].transpose(throw, "order").values
    phase = np.radians(data["throw_torque_phase"].transpose(throw, "order").values)
    throws = np.isfinite(amplitude).all(axis=1)
    if len(nodes) != throws.sum():
        raise SceneError(f"nodes: {len(nodes)} given for {throws.sum()} throws; one for each")
    omega = 2.0 * np.pi * data["order_frequency"].values
    order = np.asarray(data["order"].values, dtype=float)
    return Excitation(tuple(nodes), order, omega, amplitude[throws], phase[throws])
