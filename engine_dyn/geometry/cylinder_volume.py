"""Volume of a cylinder over the crank angle."""

from __future__ import annotations

from typing import Any

__all__ = ["clearance_volume", "cylinder_volume"]


def clearance_volume(swept_volume: Any, compression_ratio: Any) -> Any:
    """Smallest volume of a cylinder, V_h/(epsilon - 1), in the unit of the swept volume.

    The compression ratio epsilon is the largest over the smallest volume [1]; both broadcast.
    """
    return swept_volume / (compression_ratio - 1.0)


def cylinder_volume(travel: Any, area: Any, stroke: Any, compression_ratio: Any) -> Any:
    """Volume above the piston [m3]: V_h/(epsilon - 1) + A x, docs/method.md (121).

    Parameters
    ----------
    travel : array_like
        Travel x of the piston from top dead centre [m].
    area : array_like
        Area A of the piston [m2].
    stroke : array_like
        Stroke s [m]; the swept volume V_h is A s.
    compression_ratio : array_like
        Largest over smallest volume [1]. All broadcast.

    Examples
    --------
    >>> round(cylinder_volume(0.18, 0.01, 0.18, 10.0), 6)  # at bottom dead centre: 10/9 A s
    0.002
    """
    return clearance_volume(area * stroke, compression_ratio) + area * travel
