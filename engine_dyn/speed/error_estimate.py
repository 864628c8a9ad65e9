"""The error of a solution, from its difference to one with more nodes: docs/method.md (105)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from engine_dyn.speed.results import CANCELLED, ROUNDING
from engine_dyn.status import CONVERGED, TOLERANCE_NOT_MET

__all__ = ["ITERATED", "ITERATED_FINER", "compare"]

SAFETY, LEAST_ERROR = 7.0, 9e-10
"""Factor on the difference to a solution with four times the nodes, and a constant that is added,
because both solutions see the knots of a tabulated diagram alike, and both have the same columns.
Both were measured with benchmarks.stress: the error of none of 800 rough diagrams was above the
estimate, and columns missed up to 7.7e-10 of delta, most with 10 and 12 cylinders."""

SAFETY_OF_SLOWEST = 2.0
"""Factor on the difference of the smallest speed: 4/3 at first order, and room for rounding, which
near a stall is alike in both solutions."""

ITERATED = 1e-2
"""Fraction of the tolerance that the iteration of the load term may leave of the range of q."""

ITERATED_FINER = 0.025 * LEAST_ERROR
"""Error that the iteration of the finer solution may leave. Both solutions may stop after the same
number of passes; an error that they have in common is no part of their difference."""

CHUNK_OF_ARRAYS = 1 << 16


def compare(
    found: dict[str, Any], known: npt.NDArray[np.bool_], refined: dict[str, Any], tolerance: float,
    inputs: Mapping[str, Any], shape: tuple[int, ...],
) -> None:  # fmt: skip
    """Replace error and status by those from the difference to a solution with more nodes.

    docs/method.md (105). The status says whether this estimate, which is better than the kernel's,
    meets the tolerance. The work is done in pieces, so that no array has the size of the sweep.
    """

    def at(name: str) -> Any:
        return np.broadcast_to(inputs[name], shape).flat[here]

    for begin in range(0, known.size, CHUNK_OF_ARRAYS):
        here = slice(begin, begin + CHUNK_OF_ARRAYS)
        delta = found["delta"][here]
        with np.errstate(divide="ignore", invalid="ignore"):
            error = SAFETY * np.abs(delta / refined["delta"][here] - 1.0)
            slowest = np.abs(found["omega_min"][here] / refined["omega_min"][here] - 1.0)
            error = np.maximum(error, SAFETY_OF_SLOWEST * slowest) + LEAST_ERROR
            eta = 0.25 * np.square(at("double_radius")) * np.divide(at("mass"), at("inertia"))
            error += ROUNDING * (1.0 + CANCELLED * eta) / delta
        good = known[here] & np.isfinite(error)
        met = np.where(error <= tolerance, CONVERGED, TOLERANCE_NOT_MET).astype(np.int8)
        np.copyto(found["delta_error"][here], error, where=good)
        np.copyto(found["status"][here], met, where=good)
