"""A measured torsiogram beside the computed vibration of a disc, order by order."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from engine_dyn.recordings.torsiogram import torsiogram
from engine_dyn.units import DEGREE, RPM
from sweeps.base.arguments import check_dataset
from sweeps.base.errors import SceneError, not_known, shown

if TYPE_CHECKING:
    import xarray as xr

ORDER, PHASE = "disc_angle_order", "disc_angle_phase"


def compared_torsiogram(
    archive: xr.Dataset, disc: str, time: Any, speed: Any, *, cycles: int = 8,
    dead_centre: float | None = None,
) -> xr.Dataset:  # fmt: skip
    """Compare the recorded speed of a disc with its computed vibration.

    Parameters
    ----------
    archive : Dataset
        One design over an axis of speed, with `disc_angle_order` and, for phases,
        `disc_angle_phase`.
    disc : str
        Name of the disc, which turns as fast as the crank.
    time, speed : array_like
        Times [s], ascending, and recorded speed of the disc [rpm], at steady speeds or in a slow
        run-up.
    cycles : int
        Number of cycles of the engine over which each value is taken.
    dead_centre : float, optional
        A time of firing dead centre of cylinder 1 [s]; without it there are no phases.

    Returns
    -------
    Dataset
        `measured` and `computed` amplitudes [degree] over the speed of the recording and the order,
        `phase_difference` [degree], measured less computed; NaN beyond the archive's speeds.

    Raises
    ------
    SceneError
        In one line, for an archive or a recording that does not fit.
    """
    import xarray as xr

    check_dataset(archive)
    if ORDER not in archive or "speed" not in archive[ORDER].dims:
        raise SceneError(f"archive: must have {ORDER} over an axis of speed")
    names = [str(name) for name in archive["disc_name"].values]
    if disc not in names:
        raise SceneError(f"disc = {shown(disc)}: no such disc{not_known(disc, names)}")
    part = archive.isel(disc=names.index(disc))
    several = [str(d) for d in part[ORDER].dims if d not in ("speed", "order")]
    if any(part.sizes[d] > 1 for d in several):
        raise SceneError(f"archive: more than one design along {', '.join(several)}; choose one")
    part = part.squeeze(several)
    ratio = float(part["system_speed_ratio"]) if "system_speed_ratio" in part else 1.0
    if not np.isclose(ratio, 1.0):
        raise SceneError(f"disc = {shown(disc)}: turns {ratio:g} times as fast as the crank")
    described = json.loads(str(archive.attrs.get("arrangement") or "{}"))
    period = described.get("period", 720.0) if isinstance(described, dict) else 720.0
    orders = part["order"].values.astype(float)
    try:
        found = torsiogram(
            np.asarray(time, dtype=float), np.asarray(speed, dtype=float) * RPM, orders,
            period=period * DEGREE, cycles=cycles, dead_centre=dead_centre,
        )  # fmt: skip
    except ValueError as error:
        raise SceneError(str(error)) from None
    at = np.asarray(part["speed"].values, dtype=float)
    rank = np.argsort(at)
    size = part[ORDER].transpose("speed", "order").values
    phase = part[PHASE].transpose("speed", "order").values if PHASE in part else np.nan * size
    # Amplitudes also where there are no phases; between speeds vectors, which turn with the phase
    own = size * np.exp(1j * np.radians(np.nan_to_num(phase)))
    rpm = found.speed / RPM
    computed = np.stack(
        [np.interp(rpm, at[rank], one[rank], left=np.nan, right=np.nan) for one in own.T], axis=-1
    )
    turned = np.angle(np.exp(1j * found.phase) / np.where(computed == 0.0, 1.0, computed))
    known = np.isfinite(phase).all()
    over = ("speed", "order")
    about = {"units": "degree"}
    return xr.Dataset(
        {
            "measured": (over, found.amplitude / DEGREE, about),
            "computed": (over, np.abs(computed), about),
            "phase_difference": (over, np.degrees(turned) if known else np.nan * turned, about),
        },
        coords={"speed": ("speed", rpm, {"units": "rpm"}), "order": orders},
        attrs={"disc": disc},
    )
