"""Orders of a quantity as a table: for programs of torsional vibration, and to be read back."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from engine_dyn.units import DEGREE
from sweeps.base.errors import SceneError, not_known, one_line, shown

if TYPE_CHECKING:
    import xarray as xr

CONVENTION = "order_convention"  # Attribute with the lines that say what amplitude and phase mean

FREQUENCY = "order_frequency"

COLUMNS = (FREQUENCY, "amplitude", "phase", "real", "imaginary")
"""Quantities of the table, over the axes of designs and `order`."""


def order_table(archive: xr.Dataset, quantity: str) -> xr.Dataset:
    """Orders of a quantity in the words of their amplitude and phase.

    Parameters
    ----------
    archive : Dataset
        An archive that has the quantities QUANTITY_order, QUANTITY_phase and order_frequency.
    quantity : str
        What the orders are of: "torque", "throw_torque".

    Returns
    -------
    Dataset
        With the variables of `COLUMNS`.

    Raises
    ------
    SceneError
        Where the archive does not have them.
    """
    known = [
        name.removesuffix("_order")
        for name in map(str, archive.data_vars)
        if name.endswith("_order") and f"{name.removesuffix('_order')}_phase" in archive
    ]
    if quantity not in known:
        raise SceneError(
            f"orders of {shown(quantity)}: not in the archive{not_known(quantity, known)}; ask for "
            f"{one_line(quantity, 60)}_order, {one_line(quantity, 60)}_phase, {FREQUENCY} in "
            "[output]"
        )
    if FREQUENCY not in archive:
        raise SceneError(f"archive: has no {FREQUENCY}; ask for it in [output]")
    amplitude, phase = archive[f"{quantity}_order"], archive[f"{quantity}_phase"]
    unit = str(amplitude.attrs.get("units", "1"))
    angle = phase * (1.0 if phase.attrs.get("units") == "rad" else DEGREE)
    parts = {
        FREQUENCY: archive[FREQUENCY],
        "amplitude": amplitude,
        "phase": phase,
        "real": (amplitude * np.cos(angle)).assign_attrs(units=unit),
        "imaginary": (amplitude * np.sin(angle)).assign_attrs(units=unit),
    }
    taken = [f"{quantity}_order", f"{quantity}_phase", FREQUENCY]
    units = ", ".join(f"{name} [{part.attrs.get('units', '1')}]" for name, part in parts.items())
    lines = (
        f"{quantity}: {amplitude.attrs.get('long_name', 'amplitude of its orders')}",
        "an order is amplitude cos(order phi + phase) = Re((real + i imaginary) exp(i order phi))",
        "phi: crank angle in the sense of rotation; 0 at firing top dead centre of cylinder 1",
        "sign: a torque is positive in the sense of rotation; its mean is left out",
        f"order: periods per turn of the crank; {units}",
    )
    made = archive[taken].drop_vars(taken).assign(parts)
    return made.assign_attrs({CONVENTION: "\n".join(lines)})
