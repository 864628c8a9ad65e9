"""Broadcasting front of the kernels: arrays of parameters in, arrays of results out.

Inputs are NumPy arrays of one rank that broadcast against each other, as `numpy.broadcast_to`
would have them: an axis of size 1 is one on which the input does not depend. What designs share is
read off these shapes; nothing here knows what an axis is called.
"""

from __future__ import annotations

import itertools
import math
import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from engine_dyn.indicator import Family
from engine_dyn.speed import lanes
from engine_dyn.speed.fixed_point import LANE_ROWS, LANES
from engine_dyn.speed.newton import CYCLE_TIME, POWER_MEAN
from engine_dyn.status import TOLERANCE_NOT_MET
from engine_dyn.speed.tables import (
    FEWEST_NODES,
    GAS_WORK,
    GAS_WORK_MIDDLE,
    MOST_NODES,
    TABLE_ROWS,
    PressureNodes,
    build,
    pressure_nodes,
    steps_per_cycle,
)

__all__ = [
    "CLOSURES",
    "INERTIA_MODELS",
    "METHODS",
    "SPEED_RESULTS",
    "mean_gas_torque",
    "solve",
    "torque_extremes",
]

Floats = npt.NDArray[np.float64]
Progress = Callable[[int], None]

METHODS = ("auto", "thesis", "picard", "newton", "closed")
INERTIA_MODELS = ("constant", "variable")
CLOSURES = ("power_mean", "cycle_time")

SPEED_RESULTS = (
    "delta",
    "delta_midrange",
    "omega_max",
    "omega_min",
    "omega_mean",
    "load_factor",
    "delta_error",
    "iterations",
)
"""Scalar results of the periodic solution, in the kernel's order."""

TORQUE_RESULTS = ("torque_max", "torque_min", "energy_swing")

_INPUTS = (
    "crank_ratio",
    "row",
    "scale",
    "crankcase_pressure",
    "bore",
    "stroke",
    "mass",
    "speed",
    "inertia",
    "exponent",
    "offset",
    "mean_torque",
    "friction_torque",
    "start_speed",
    "passes",
    "start_angle",
)

_FINEST = 16

_SAMPLES = 720
"""Samples of a cycle in the thesis's method: one a degree of a four-stroke cycle."""


def _row_nodes(family: Family, row: int, tolerance: float, known: dict[int, int]) -> int:
    """Nodes of a cycle for one diagram: doubled until a cubic through them misses little.

    Judged on the work of one cylinder at a crank ratio of 0.3, at the middle of the worst
    interval. The extremes use the middles too, and rarely lie in the worst interval, so the
    threshold is above the tolerance; each design's own error decides about its status.
    """
    if row not in known:
        steps = FEWEST_NODES
        while steps < MOST_NODES:
            grid = pressure_nodes(family, np.array([row]), steps)
            table = np.empty((TABLE_ROWS, steps))
            build(
                0.3, 0, 0, 0.0, 1.0, 0.0, steps, steps, grid_width(family, steps),
                *_grid_arrays(grid), table, np.empty((4, steps)),
            )  # fmt: skip
            swing = np.ptp(table[GAS_WORK])
            if swing == 0.0 or np.abs(table[GAS_WORK_MIDDLE]).max() <= 30.0 * tolerance * swing:
                break
            steps *= 2
        known[row] = steps
    return known[row]


def grid_width(family: Family, steps: int) -> float:
    """Angle between nodes [rad]."""
    return family.row(0).period / steps


def _grid_arrays(grid: PressureNodes) -> tuple[Any, ...]:
    return (
        grid.at_node, grid.slope_at_node, grid.at_middle, grid.at_quadrature,
        *grid.node, *grid.middle, *grid.quadrature,
    )  # fmt: skip


@dataclass
class _Part:
    """Designs that one kernel call can treat alike: positions along each axis, and their keys."""

    positions: tuple[npt.NDArray[np.int64], ...]
    keys: tuple[Any, ...]


def _parts(shape: tuple[int, ...], keys: Sequence[npt.NDArray[Any]]) -> list[_Part]:
    """Split a product of axes so that every key is one value within a part.

    A key may depend on one axis at most, as every leaf does.
    """
    along: list[list[int]] = [[] for _ in shape]
    for number, key in enumerate(keys):
        axes = [axis for axis, size in enumerate(key.shape) if size > 1]
        if len(axes) > 1:
            raise ValueError("a choice (cylinders, method, model) may vary along one axis only")
        if axes:
            along[axes[0]].append(number)
    choices: list[list[tuple[npt.NDArray[np.int64], dict[int, Any]]]] = []
    for axis, size in enumerate(shape):
        if not along[axis]:
            choices.append([(np.arange(size), {})])
            continue
        columns = np.stack([keys[number].reshape(-1) for number in along[axis]], axis=1)
        unique, inverse = np.unique(columns, axis=0, return_inverse=True)
        inverse = inverse.reshape(-1)
        choices.append(
            [
                (np.flatnonzero(inverse == i), dict(zip(along[axis], unique[i], strict=True)))
                for i in range(len(unique))
            ]
        )
    parts = []
    for combination in itertools.product(*choices):
        values: dict[int, Any] = {n: key.reshape(-1)[0] for n, key in enumerate(keys)}
        for _, chosen in combination:
            values.update(chosen)
        parts.append(
            _Part(tuple(p for p, _ in combination), tuple(values[n] for n in range(len(keys))))
        )
    return parts


@dataclass
class _Product:
    """The inputs of a sweep, packed for the kernels."""

    shape: tuple[int, ...]
    values: Floats
    start: npt.NDArray[np.int64]
    strides: npt.NDArray[np.int64]
    table_axis: list[bool]

    @classmethod
    def pack(cls, inputs: Mapping[str, Any]) -> _Product:
        arrays = [np.asarray(inputs[name], dtype=np.float64) for name in _INPUTS]
        rank = max(a.ndim for a in arrays)
        arrays = [a.reshape((1,) * (rank - a.ndim) + a.shape) for a in arrays]
        shape = np.broadcast_shapes(*(a.shape for a in arrays))
        strides = np.zeros((lanes.INPUTS, max(rank, 1)), dtype=np.int64)
        start = np.zeros(lanes.INPUTS, dtype=np.int64)
        place = 0
        for i, array in enumerate(arrays):
            start[i] = place
            place += array.size
            step = 1
            for axis in reversed(range(rank)):
                if array.shape[axis] > 1:
                    strides[i, axis] = step
                    step *= array.shape[axis]
        step = 1
        for axis in reversed(range(rank)):
            strides[lanes.OUTPUT, axis] = step
            step *= shape[axis]
        table_axis = [bool(strides[: lanes.TABLE_INPUTS, axis].any()) for axis in range(rank)]
        return cls(
            shape, np.concatenate([a.ravel() for a in arrays]), start, strides, table_axis
        )

    def arguments(self, part: _Part, lane_width: int = 0) -> tuple[tuple[Any, ...], int, int]:
        """Kernel arguments of a part, its number of blocks, and lanes of a block.

        A block is as wide as its table has designs, up to `LANES` (or `lane_width`, if given).
        """
        sizes = [len(p) for p in part.positions]
        tables = [a for a, of_table in enumerate(self.table_axis) if of_table]
        others = [a for a, of_table in enumerate(self.table_axis) if not of_table]
        table_count = int(np.prod([sizes[a] for a in tables], dtype=np.int64))
        lane_count = int(np.prod([sizes[a] for a in others], dtype=np.int64))
        width = lane_width or min(LANES, max(4, 1 << (lane_count - 1).bit_length()))
        begin = np.concatenate([[0], np.cumsum(sizes)[:-1]]) if sizes else np.zeros(1)
        return (
            (
                np.array(tables, dtype=np.int64),
                np.array(others, dtype=np.int64),
                np.array(sizes or [1], dtype=np.int64),
                self.strides,
                np.concatenate([*part.positions, np.zeros(1, dtype=np.int64)]).astype(np.int64),
                begin.astype(np.int64),
                self.values,
                self.start,
            ),
            table_count * -(-lane_count // width),
            width,
        )


def _run(
    blocks: int, designs_a_block: float, work: Callable[[int, int], None], threads: int,
    progress: Progress | None,
) -> None:  # fmt: skip
    """Call `work(begin, end)` over all blocks, on threads when there is enough to share."""
    threads = max(1, min(threads, blocks // 4))
    # Many pieces even out the load; each is still long against the cost of a call.
    size = max(1, min(4096, -(-blocks // (threads * 8)))) if threads > 1 else min(blocks, 4096)
    pieces = [(i, min(i + size, blocks)) for i in range(0, blocks, size)]
    if threads == 1:
        for begin, end in pieces:
            work(begin, end)
            if progress:
                progress(int((end - begin) * designs_a_block))
        return
    with ThreadPoolExecutor(threads) as pool:
        futures = [(pool.submit(work, *piece), piece) for piece in pieces]
        try:
            for future, (begin, end) in futures:
                future.result()
                if progress:
                    progress(int((end - begin) * designs_a_block))
        except BaseException:
            pool.shutdown(wait=True, cancel_futures=True)
            raise


def _rows_needed(row: npt.NDArray[np.float64]) -> npt.NDArray[np.int64]:
    below = np.floor(row)
    return np.unique(np.concatenate([below.ravel(), np.ceil(row).ravel()])).astype(np.int64)


def _row_map(family: Family, rows: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    table = np.zeros(family.row_count + 1, dtype=np.int64)
    table[rows] = np.arange(len(rows))
    return table


def _node_counts(
    family: Family, row: Floats, tolerance: float, known: dict[int, int]
) -> npt.NDArray[np.int64]:
    """Nodes of a cycle for each (fractional) row: what its own two diagrams ask for."""
    counts = np.empty(row.shape, dtype=np.int64)
    for index, value in np.ndenumerate(row):
        below, above = int(np.floor(value)), int(np.ceil(value))
        counts[index] = max(
            _row_nodes(family, below, tolerance, known), _row_nodes(family, above, tolerance, known)
        )
    return counts


def _exponent_class(exponent: Floats) -> npt.NDArray[np.int64]:
    return np.select([exponent == 0.0, exponent == 1.0, exponent == 2.0], [0, 1, 2], default=3)


def _code(choices: tuple[str, ...], value: Any, rank: int) -> npt.NDArray[np.int64]:
    names = np.asarray(value)
    codes = np.array([choices.index(str(name)) for name in names.ravel()], dtype=np.int64)
    return codes.reshape((1,) * (rank - names.ndim) + names.shape)


def solve(
    *,
    family: Family,
    wanted: Sequence[str],
    method: Any = "auto",
    inertia_model: Any = "constant",
    closure: str = "power_mean",
    tolerance: float = 1e-6,
    cylinders: Any = 1,
    crank_angle: Floats | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
    finer: int = 1,
    **inputs: Any,
) -> dict[str, Any]:
    """Solve the periodic speed of every design of a product of axes.

    Designs that miss the tolerance are solved again with four, then sixteen times the nodes.

    Parameters
    ----------
    family : Family
        Indicator diagrams.
    wanted : sequence of str
        Of `SPEED_RESULTS`, "omega" and "angular_acceleration" (these with a last dimension
        `crank_angle`); "status" always comes.
    method, inertia_model : str or array of str
        Of `METHODS` and `INERTIA_MODELS`; arrays broadcast like the inputs.
    closure : str
        Of `CLOSURES`.
    tolerance : float
        Relative error of delta aimed at.
    cylinders : array_like of int
        Evenly firing.
    crank_angle : ndarray, optional
        Angles [rad] for curves.
    threads : int, optional
        As many as the machine has processors, unless given.
    progress : callable, optional
        Called with the number of designs done since the last call.
    finer : int
        Factor on the number of nodes.
    **inputs : array_like
        SI values, all broadcasting: crank_ratio, row (of the family), scale (of the pressure),
        crankcase_pressure, bore, stroke, mass, speed (nominal, rad/s), inertia, exponent, offset,
        mean_torque, friction_torque; for methods thesis and picard also start_speed (0: nominal),
        passes (0: until the cycle closes) and start_angle [rad].

    Returns
    -------
    dict
        Arrays of the broadcast shape.
    """
    inputs = {"start_speed": 0.0, "passes": 0.0, "start_angle": -np.pi, **inputs}
    rank = max(np.ndim(v) for v in (*inputs.values(), method, inertia_model, cylinders))
    choices: list[Any] = [
        np.asarray(cylinders, dtype=np.int64),
        _code(METHODS, method, rank),
        _code(INERTIA_MODELS, inertia_model, rank),
        _exponent_class(np.asarray(inputs["exponent"], dtype=float)),
        finer * _node_counts(family, np.asarray(inputs["row"], dtype=float), tolerance, {}),
    ]
    choices = [c.reshape((1,) * (rank - c.ndim) + c.shape) for c in choices]
    shape = np.broadcast_shapes(*(np.shape(v) for v in inputs.values()), *(c.shape for c in choices))
    product = _widened(_Product.pack(inputs), shape)
    size = int(np.prod(shape, dtype=np.int64))
    names = [name for name in SPEED_RESULTS if name in wanted]
    scalars = np.empty((max(len(names), 1), size))
    rows = np.array([names.index(n) if n in names else -1 for n in SPEED_RESULTS])
    status = np.empty(size, dtype=np.int8)
    angles = np.zeros(0) if crank_angle is None else np.asarray(crank_angle, dtype=float)
    period = family.row(0).period
    curves = [name in wanted for name in ("omega", "angular_acceleration")]
    traces = [np.empty((size, angles.size)) if on else np.empty((1, 0)) for on in curves]
    if not any(curves):
        angles = np.zeros(0)
    closure_code = CYCLE_TIME if closure == "cycle_time" else POWER_MEAN
    count = threads or os.cpu_count() or 1

    for part in _parts(shape, choices):
        cylinder_count, method_code, variable, kind, fewest = (int(k) for k in part.keys)
        steps = steps_per_cycle(cylinder_count, fewest)
        nodes = steps // cylinder_count
        width = period / steps
        row = np.asarray(inputs["row"], dtype=float)
        needed = _rows_needed(_taken(row, part, len(shape)))
        grid = pressure_nodes(family, needed, steps)
        sampled = (
            _sample_grid(family, needed, cylinder_count)
            if lanes.THESIS == method_code
            else (np.zeros((1, 1, 1)), np.zeros((1, 1)), np.zeros((1, 1)))
        )
        within = np.mod(angles, period / cylinder_count) / width
        output_node = np.minimum(np.floor(within + 1e-9).astype(np.int64), nodes - 1)
        output_share = np.maximum(within - output_node, 0.0)
        output_sample = np.mod(angles + 0.5 * period, period) / period * _SAMPLES
        arguments, blocks, lane_width = product.arguments(part)

        def work(begin: int, end: int) -> None:
            scratch = (
                np.empty((TABLE_ROWS, nodes)),
                np.empty((4, nodes)),
                np.empty((nodes, lane_width)),
                np.empty((nodes, lane_width)),
                np.empty((nodes, lane_width)),
                np.zeros(LANE_ROWS * LANES),
                np.empty((11, nodes)),
                np.empty((8, sampled[1].shape[1])),
            )
            lanes.march(
                begin, end, *arguments, _row_map(family, needed), cylinder_count, nodes, width,
                *_grid_arrays(grid), *sampled, method_code, kind, bool(variable), closure_code,
                tolerance, output_node, output_share, output_sample, rows, scalars, status,
                *traces, *scratch,
            )  # fmt: skip

        len_part = math.prod(len(p) for p in part.positions)
        _run(blocks, len_part / blocks, work, count, progress)

    results: dict[str, Any] = {name: scalars[i] for i, name in enumerate(names)}
    results["status"] = status
    for name, on, trace in zip(("omega", "angular_acceleration"), curves, traces, strict=True):
        if on:
            results[name] = trace
    missed = np.flatnonzero(status == TOLERANCE_NOT_MET) if finer < _FINEST else np.zeros(0, int)
    if missed.size:
        place = np.unravel_index(missed, shape) if shape else ()
        codes = np.broadcast_to(choices[1], shape)[place]
        # Repeating cycles from a start has an error of its own, which more nodes do not mend.
        solved = np.isin(codes, [lanes.AUTO, lanes.NEWTON, lanes.CLOSED])
        missed = missed[solved.reshape(-1)]
    if missed.size:
        place = np.unravel_index(missed, shape) if shape else ()

        def chosen(value: Any) -> Any:
            return np.broadcast_to(np.asarray(value), shape)[place].reshape(-1)

        again = solve(
            family=family, wanted=wanted, method=chosen(method),
            inertia_model=chosen(inertia_model), closure=closure, tolerance=tolerance,
            cylinders=chosen(cylinders), crank_angle=crank_angle, threads=threads,
            finer=4 * finer, **{name: chosen(value) for name, value in inputs.items()},
        )  # fmt: skip
        for name, array in results.items():
            array[missed] = again[name]
    return {
        name: array.reshape((*shape, *array.shape[1:])) for name, array in results.items()
    }


def _taken(array: Floats, part: _Part, rank: int) -> Floats:
    """Elements of a broadcasting input that belong to a part."""
    array = array.reshape((1,) * (rank - array.ndim) + array.shape)
    for axis, positions in enumerate(part.positions):
        if array.shape[axis] > 1:
            array = array.take(positions, axis=axis)
    return array


def _widened(product: _Product, shape: tuple[int, ...]) -> _Product:
    """Return the product with the sweep's whole shape, for axes that only choices depend on."""
    rank = len(shape)
    strides = np.zeros((lanes.INPUTS, max(rank, 1)), dtype=np.int64)
    if product.shape:
        strides[:, rank - len(product.shape) :] = product.strides
    step = 1
    for axis in reversed(range(rank)):
        strides[lanes.OUTPUT, axis] = step
        step *= shape[axis]
    table_axis = [False] * (rank - len(product.shape)) + product.table_axis
    return _Product(shape, product.values, product.start, strides, table_axis)


def _sample_grid(
    family: Family, rows: npt.NDArray[np.int64], cylinders: int
) -> tuple[Floats, Floats, Floats]:
    """Pressure at each cylinder's own angle for every sample of the thesis's method."""
    period = family.row(0).period
    angle = -0.5 * period + np.arange(_SAMPLES) * (period / _SAMPLES)
    angle = angle[None, :] - np.arange(cylinders)[:, None] * (period / cylinders)
    at_sample = np.array([family.row(int(row))(angle) for row in rows])
    return at_sample, np.sin(angle), np.cos(angle)


def torque_extremes(
    *,
    family: Family,
    wanted: Sequence[str],
    cylinders: Any = 1,
    tolerance: float = 1e-6,
    threads: int | None = None,
    progress: Progress | None = None,
    **inputs: Any,
) -> dict[str, Any]:
    """Largest and smallest torque at nominal speed [N m] and energy swing [J] of every design.

    Arguments as `solve`, without what only the periodic speed needs. `wanted` of "torque_max",
    "torque_min" and "energy_swing". The energy swing is the range of the work of the torque less
    its mean.
    """
    neutral = ("inertia", "exponent", "offset", "mean_torque", "start_speed", "passes",
               "start_angle")  # fmt: skip
    inputs = {**dict.fromkeys(neutral, 0.0), **inputs}
    rank = max(np.ndim(v) for v in (*inputs.values(), cylinders))
    choices: list[Any] = [
        np.asarray(cylinders, dtype=np.int64),
        _node_counts(family, np.asarray(inputs["row"], dtype=float), tolerance, {}),
    ]
    choices = [c.reshape((1,) * (rank - c.ndim) + c.shape) for c in choices]
    shape = np.broadcast_shapes(*(np.shape(v) for v in inputs.values()), *(c.shape for c in choices))
    product = _widened(_Product.pack(inputs), shape)
    size = int(np.prod(shape, dtype=np.int64))
    names = [name for name in TORQUE_RESULTS if name in wanted]
    scalars = np.empty((max(len(names), 1), size))
    rows = np.array([names.index(n) if n in names else -1 for n in TORQUE_RESULTS])
    period = family.row(0).period
    for part in _parts(shape, choices):
        cylinder_count, fewest = (int(k) for k in part.keys)
        steps = steps_per_cycle(cylinder_count, fewest)
        nodes = steps // cylinder_count
        row = np.asarray(inputs["row"], dtype=float)
        needed = _rows_needed(_taken(row, part, len(shape)))
        grid = pressure_nodes(family, needed, steps)
        arguments, blocks, lane_width = product.arguments(part, LANES)

        def work(begin: int, end: int) -> None:
            lanes.extremes_of_torque(
                begin, end, *arguments, _row_map(family, needed), cylinder_count, nodes,
                period / steps, *_grid_arrays(grid), rows, scalars,
                np.empty((TABLE_ROWS, nodes)), np.empty((4, nodes)),
            )  # fmt: skip

        len_part = math.prod(len(p) for p in part.positions)
        _run(blocks, len_part / blocks, work, threads or os.cpu_count() or 1, progress)
    return {name: scalars[i].reshape(shape) for i, name in enumerate(names)}


def mean_gas_torque(crank_ratio: Any, row: Any, family: Family) -> Floats:
    """Mean over angle of p c/(r omega) [Pa] for one cylinder, broadcasting.

    Times A r this is the mean torque of the absolute pressure, and of the gauge pressure too: the
    crankcase pressure does no work over a cycle. Three-point Gauss-Legendre on half degrees.
    """
    crank_ratio, row = np.broadcast_arrays(
        np.asarray(crank_ratio, dtype=float), np.asarray(row, dtype=float)
    )
    needed = _rows_needed(row)
    grid = pressure_nodes(family, needed, FEWEST_NODES)
    result = np.empty(row.size)
    lanes.mean_gas_torque(
        np.ascontiguousarray(crank_ratio).reshape(-1), np.ascontiguousarray(row).reshape(-1),
        _row_map(family, needed), grid.at_quadrature, *grid.quadrature, result,
    )  # fmt: skip
    return result.reshape(row.shape)
