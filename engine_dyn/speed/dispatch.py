"""Broadcasting front of the kernels: arrays of parameters in, arrays of results out.

Inputs are NumPy arrays that broadcast against each other: an axis of size 1 is one on which the
input does not depend. What designs share is read off these shapes; nothing here knows what an axis
is called.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache, partial, wraps
from typing import Any

import numpy as np
import numpy.typing as npt

from engine_dyn.geometry.cylinders import Cylinders, Member, even_cylinders
from engine_dyn.loads.driven_machine import (
    NOTHING_DRIVEN,
    DrivenMachine,
    TorqueOverAngle,
    repeats_of,
    whole_ratio,
)
from engine_dyn.loads.friction import FRICTIONLESS
from engine_dyn.pressure.diagram import Diagram
from engine_dyn.pressure.family import Family, family_from_diagrams
from engine_dyn.pressure.family_grid import FamilyAtSpeeds, FamilyStack
from engine_dyn.pressure.motored import row_with_factor
from engine_dyn.speed import designs
from engine_dyn.speed.batch import lanes, panels, traces
from engine_dyn.speed.batch.levels import CHUNK
from engine_dyn.speed.general.cycles import Samples
from engine_dyn.speed.general.newton import CYCLE_TIME, POWER_MEAN
from engine_dyn.speed.general.segments import SEGMENTS
from engine_dyn.speed.packing import (
    FEWEST,
    PIECE,
    TABLE_NAMES,
    Packed,
    Part,
    Progress,
    aligned,
    run_pieces,
    shared_by,
    split,
)
from engine_dyn.speed.product import Product
from engine_dyn.speed.tables.load_over_angle import PLAIN_ROWS
from engine_dyn.speed.tables.work_tables import (
    FEWEST_NODES,
    GAS_WORK,
    GAS_WORK_MIDDLE,
    GAS_WORK_TILT,
    MOST_NODES,
    QUINTIC,
    TABLE_ROWS,
    Blend,
    Grid,
    build_equal,
    make_grid,
    steps_per_cycle,
)
from engine_dyn.status import CONVERGED, INVALID_INPUT, NOT_CONVERGED, TOLERANCE_NOT_MET
from engine_dyn.types import Floats, Integers

__all__ = [
    "CLOSURES",
    "INERTIA_MODELS",
    "METHODS",
    "SPEED_RESULTS",
    "TORQUE_RESULTS",
    "mean_gas_torque",
    "solve",
    "torque_extremes",
]


METHODS = ("auto", "thesis", "picard", "newton", "closed")
INERTIA_MODELS = ("constant", "variable")
CLOSURES = ("power_mean", "cycle_time")

SPEED_RESULTS = (
    "delta", "delta_midrange", "omega_max", "omega_min", "omega_mean", "load_factor",
    "delta_error", "iterations",
)  # fmt: skip
"""Scalar results of the periodic solution, in the kernel's order."""

COMPARED = ("delta", "omega_min")
"""Results whose difference between two solutions is the error."""

CURVE_RESULTS = ("omega", "angular_acceleration")

TORQUE_RESULTS = ("torque_max", "torque_min", "energy_swing")

FRICTION_NAMES = (
    "boundary_friction", "mixed_friction", "hydrodynamic_friction", "skirt_friction",
    "ring_pressure",
)  # fmt: skip
"""Inputs that spread the friction over the stroke, see `friction.StrokeFriction`."""

NOT_GIVEN = {
    "start_speed": 0.0, "passes": 0.0, "start_angle": -np.pi, "offset_ratio": 0.0,
    **dict.fromkeys(FRICTION_NAMES, 0.0), "gear_ratio": 1.0, "load_phase": 0.0,
    "load_scale": 1.0, "synchronous_speed": 1.0, "breakdown_slip": 1.0,
}  # fmt: skip
"""Inputs of `solve` that may be left out."""

SAMPLE_WIDTH = np.pi / 180.0
"""Step of the thesis's method: one degree."""

NOWHERE = np.zeros(0)
NO_CURVES = designs.Curves(np.zeros(0, dtype=np.int64), NOWHERE, NOWHERE)
NO_SAMPLES = Samples(
    np.zeros((1, 1, 1)), np.zeros((1, 1)), np.zeros((1, 1)), np.ones(1), np.ones(1)
)
"""What kernels take where no curves, and no samples of the thesis's method, are wanted."""

NO_EXPONENT = 5e-8
"""Exponents up to here are solved as their limit 0: omega differs by alpha/2 times the variance of
log omega, 2e-9 where the speed nearly falls to nothing; q^(alpha/2) - 1 would lose as much."""

FEW_CYLINDERS, SMALL_EXPONENT, RATIOS = 2, 2.0, (8, 4)
"""Nodes of a table for each coarse node of `lanes`, up to that many cylinders and that exponent,
and beyond either: the load counts by its share of the period over one coarse interval, and by how
steeply it grows. Twice as many would do for most designs with a linear load, but leave errors of
2e-6 where it is strong."""

PIECES = math.lcm(SEGMENTS, max(RATIOS) * CHUNK)
"""What the nodes of a cycle's torque are a multiple of."""

MANY_TABLES, FEW_DESIGNS = 64, 64
"""From that many tables on, each for fewer designs than that, none is built: see `panels`. A design
then differs by some 1e-9 from what it is with a table of its own."""

PANEL_BYTES = 64_000_000
"""Shared tables that are kept at a time."""

PIECE_IN_LANES = 65536
"""Designs of one call at most in lanes: each begins with a table, as long as a thousand designs, or
sorts them by their shared ones."""

FEWEST_IN_LANES, ANGLES_OF_DESIGN = 4096, 32
"""Designs that are worth a thread in lanes, a fraction of a microsecond each, and the angles of a
curve that take as long."""

MANY_MEANS, POINTS_OF_MEANS = 512, 10
"""From that many on, mean torques are interpolated between that many crank ratios of a panel; what
they miss is rounding."""

ITERATED = 1e-2
"""Share of the tolerance that the iteration of the load term may leave of the range of q."""

SAFETY, LEAST_ERROR = 7.0, 5e-11
"""Factor on the difference to a solution with four times the nodes, and what is added to it: both
solutions still see the knots of a tabulated diagram. Measured with benchmarks.stress: twice the
nodes left one rough diagram in three hundred above the estimate, four times none of 800."""

SAFETY_OF_SLOWEST = 2.0
"""Factor on the difference of the smallest speed. Four times the nodes leave a quarter of the error
even at first order, so it is at most 4/3 of the difference; the rest is room for rounding, which
near a stall both solutions have alike."""

ITERATED_FINER = 0.1 * LEAST_ERROR
"""Error that the iteration of the finer solution may leave: both may stop after as many passes, and
then what is left is the same and no part of their difference."""

CHUNK_OF_ARRAYS = 1 << 16

LANES_TOLERANCE = 1e-7
"""Smaller tolerances go to the general method at once, whose error is smaller."""

NO_POWER = 4
"""Class of a load or driver over speed that is no power of it."""

FINEST = 16
"""Designs that miss the tolerance are solved again with more nodes, up to this factor."""


def _known_apart(solved: Callable[..., dict[str, Any]]) -> Callable[..., dict[str, Any]]:
    """Take out designs without a diagram, whose `scale` is NaN: they have no numbers.

    Kernels do not look for NaN, so they solve these with another diagram, and it is given up.
    """

    @wraps(solved)
    def of_known(*, scale: Any, **arguments: Any) -> dict[str, Any]:
        unknown = np.isnan(scale)
        if not unknown.any():
            return solved(scale=scale, **arguments)
        for name in ("mean_torque", "friction_torque"):  # made from it
            if name in arguments:
                arguments[name] = np.nan_to_num(arguments[name])
        found = solved(scale=np.where(unknown, 1.0, scale), **arguments)
        for name, array in found.items():
            here = unknown[..., None] if name in CURVE_RESULTS else unknown
            lost = INVALID_INPUT if name == "status" else np.nan
            np.copyto(array, lost, where=here, casting="unsafe")
        return found

    return of_known


@_known_apart
def solve(
    *,
    family: Family,
    wanted: Sequence[str],
    method: Any = "auto",
    inertia_model: Any = "constant",
    closure: str = "power_mean",
    tolerance: float = 1e-6,
    cylinders: Any = 1,
    cylinders_by_count: Mapping[int, Cylinders] | None = None,
    crank_angle: Floats | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
    finer: int = 1,
    iterated: float | None = None,
    general: bool = False,
    sharing: tuple[int, int] | None = None,
    driven: DrivenMachine = NOTHING_DRIVEN,
    **inputs: Any,
) -> dict[str, Any]:
    """Solve the periodic speed of every design of a product of axes.

    Designs that miss the tolerance are solved again with four, then sixteen times the nodes. Where
    "delta_error" is wanted, all are solved a second time with four times the nodes, and with
    interpolated tables from points half as far apart: the difference is the error, and `status`
    says whether that is within the tolerance. It is that of delta or of the smallest speed,
    whichever is more; the latter where a design nearly stalls.

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
        Relative error of delta and of the speeds aimed at.
    cylinders : array_like of int
        How many, or keys of `cylinders_by_count`.
    cylinders_by_count : mapping, optional
        Cylinders of each key; so many evenly firing equal ones where there is none.
    crank_angle : ndarray, optional
        Angles [rad] for curves.
    threads : int, optional
        As many as the machine has processors, unless given.
    progress : callable, optional
        Called with the number of designs done since the last call.
    finer : int
        Factor on the number of nodes.
    iterated : float, optional
        Error that iterations may leave, relative to the range of the speed; a hundredth of the
        tolerance unless given.
    general : bool
        Leave `lanes` out.
    sharing : tuple of int, optional
        Tables of the whole sweep, and designs that share one, where these designs are a block of
        it: blocks must not decide for themselves how tables are made. Their own unless given.
    driven : DrivenMachine
        Load over angle, load over speed or driver beside a + k omega^alpha: these take the general
        method.
    **inputs : array_like
        SI values, all broadcasting: crank_ratio, row (of the family), scale (of the pressure; NaN
        says that a design has no diagram: its status is "invalid input"),
        crankcase_pressure, offset_ratio (of the pin's line over the crank radius, 0 unless given),
        boundary_friction, mixed_friction, hydrodynamic_friction, skirt_friction (see
        `friction.StrokeFriction`, 0 unless given), ring_pressure (needed by the first three),
        bore, stroke (two crank radii, where there is an offset), mass, speed (nominal, rad/s),
        inertia, exponent, offset, mean_torque, friction_torque; for methods thesis and picard also
        start_speed (0: nominal), passes (0: until the cycle closes) and start_angle [rad]; for a
        load over its own angle or speed gear_ratio, for one over angle load_phase [rad] and
        load_scale (the factor on it), its mean being part of `offset`; for a motor
        synchronous_speed [rad/s] and breakdown_slip.

    Returns
    -------
    dict
        Arrays of the broadcast shape; "status" holds the codes of `engine_dyn.status`.
    """
    inputs = {**NOT_GIVEN, **inputs}
    methods, models = _codes(METHODS, method), _codes(INERTIA_MODELS, inertia_model)
    shape = _shape_of(*inputs.values(), methods, models, cylinders)
    rank, size = len(shape), math.prod(shape)
    period = family.row(0).period
    row = aligned(np.asarray(inputs["row"], dtype=float), rank)
    if driven.over_angle is not None:
        inputs["gear_ratio"] = whole_ratio(driven.over_angle, inputs["gear_ratio"], period)
    gear = aligned(np.asarray(inputs["gear_ratio"], dtype=float), rank)
    methods = aligned(methods, rank)
    if not driven.plain and (methods == designs.THESIS).any():
        raise ValueError("method 'thesis' marches a + k omega^alpha alone: take another")
    exponent = aligned(np.asarray(inputs["exponent"], dtype=float), rank)
    sets = aligned(np.asarray(cylinders, dtype=np.int64), rank)
    keys = [
        methods,
        aligned(models, rank),
        _kinds(exponent) if driven.power_law else np.full((1,) * rank, NO_POWER),
        np.asarray(exponent > SMALL_EXPONENT, dtype=np.int64),
        _fewest_nodes(family, row, tolerance),
        _repeats(driven.over_angle, gear, period),
        _fewest_nodes_of_load(driven.over_angle, gear, period, tolerance),
        *_along_axes(sets),
    ]
    if sharing is None:
        tables = math.prod(_shape_of(*(inputs[name] for name in TABLE_NAMES)))
        sharing = tables, size // max(tables, 1)
    solved = partial(
        _solve_parts, split(shape, keys), Packed.of(inputs, shape), size, family=family, row=row,
        sets=sets, cylinders_by_count=cylinders_by_count, closure=closure, tolerance=tolerance,
        general=general, driven=driven, threads=threads or os.cpu_count() or 1,
        built=sharing[0] < MANY_TABLES or sharing[1] >= FEW_DESIGNS or _own_tables(inputs),
    )  # fmt: skip
    compared = [name for name in COMPARED if "delta_error" in wanted and name not in wanted]
    wanted = (*wanted, *compared)
    angles = NOWHERE if crank_angle is None else np.asarray(crank_angle, dtype=float)
    found, left = solved(wanted, angles, finer=finer, iterated=iterated, progress=progress)
    status = found["status"]
    marching = (methods == designs.THESIS) | (methods == designs.PICARD)
    # More nodes help where the tolerance is missed; once they are tried where nothing converged.
    failed = status == TOLERANCE_NOT_MET
    if finer == 1:
        failed |= status == NOT_CONVERGED
    missed = np.flatnonzero(failed)
    if iterated is not None:  # the finer one of two solutions: whatever it is
        missed = missed[:0]

    def chosen(value: Any, places: Integers) -> Any:
        index = np.unravel_index(places, shape) if shape else ()
        return np.broadcast_to(np.asarray(value), shape)[index].reshape(-1)

    if missed.size and finer < FINEST:
        # Repeating cycles from a start has an error of its own, which more nodes do not mend.
        missed = missed[~chosen(marching, missed)]
    if missed.size and finer < FINEST:
        again = solve(
            family=family, wanted=wanted, method=chosen(method, missed),
            inertia_model=chosen(inertia_model, missed), closure=closure, tolerance=tolerance,
            cylinders=chosen(cylinders, missed), cylinders_by_count=cylinders_by_count,
            crank_angle=crank_angle, threads=threads, finer=4 * finer, general=True, driven=driven,
            **{name: chosen(value, missed) for name, value in inputs.items()},
        )  # fmt: skip
        for name, array in found.items():
            array[missed] = again[name]
    if "delta_error" in wanted and iterated is None:
        known = (status == CONVERGED) | (status == TOLERANCE_NOT_MET)
        # Those know their error from the solutions with more nodes, or from the periodic one.
        known[missed] = False
        if marching.any():
            known &= ~np.broadcast_to(marching, shape).reshape(-1)
        if known.any():
            refined, _ = solved(
                COMPARED, NOWHERE, finer=4 * finer, left=left,
                iterated=min(0.01 * ITERATED * tolerance, ITERATED_FINER),
            )  # fmt: skip
            _compare(found, known, refined, tolerance, inputs, shape)
    return {
        name: array.reshape((*shape, *array.shape[1:]))
        for name, array in found.items() if name not in compared
    }  # fmt: skip


def _solve_parts(
    parts: list[Part], packed: Packed, size: int, wanted: Sequence[str], angles: Floats, *,
    family: Family, row: Floats, sets: Integers, cylinders_by_count: Mapping[int, Cylinders] | None,
    closure: str, tolerance: float, general: bool, driven: DrivenMachine, threads: int, built: bool,
    finer: int, iterated: float | None, progress: Progress | None = None,
    left: npt.NDArray[np.bool_] | None = None,
) -> tuple[dict[str, Any], npt.NDArray[np.bool_]]:  # fmt: skip
    """Solve all parts of a sweep once, with `finer` times the nodes; flat results by name.

    `iterated` and `general` as in `solve`; `built` says that tables are shared by many, or depend
    on what cannot be interpolated. `left` are the designs, flat, that are no matter for `lanes`:
    the coarser of two solutions left them to the general method. The finer one would not be finer
    by the other, whose coarse nodes may miss more than the general method does with fewer in all.
    They are returned too, empty where no error is wanted.
    """
    period = family.row(0).period
    names = [name for name in SPEED_RESULTS if name in wanted]
    curves = {name: name in wanted and angles.size > 0 for name in CURVE_RESULTS}
    if not any(curves.values()):
        angles = NOWHERE
    if left is None:
        left = np.zeros(size if "delta_error" in names else 0, dtype=np.bool_)
    results = designs.Results(
        wanted=np.array([names.index(n) if n in names else -1 for n in SPEED_RESULTS]),
        scalars=np.empty((max(len(names), 1), size if names else 0)),
        status=np.empty(size, dtype=np.int8),
        omega=np.empty((size, angles.size) if curves["omega"] else (1, 0)),
        acceleration=np.empty((size, angles.size) if curves["angular_acceleration"] else (1, 0)),
        left=left,
    )
    over_speed, over_angle = _acting(driven)
    for part in parts:
        method_code, variable, kind, steep, fewest, repeats, of_load = map(int, part.keys[:7])
        fewest = finer * max(fewest, of_load)
        choice = designs.Choice(
            method_code, kind, bool(variable),
            CYCLE_TIME if closure == "cycle_time" else POWER_MEAN, float(tolerance),
            ITERATED * tolerance if iterated is None else iterated,
        )  # fmt: skip
        in_lanes = not general and driven.plain and _fits_lanes(choice)
        # The finer of two solutions has to be finer: the general method is, for any exponent.
        in_lanes = in_lanes and (iterated is None or kind != 3)
        engine = _engine(int(part.take(sets).flat[0]), period, cylinders_by_count)
        # Torque and load repeat together as often as both do.
        times = math.gcd(engine.symmetry, repeats)
        apart = not (built or angles.size) and engine.equal_throws
        # Interpolated tables do not know what coarse nodes see wrongly of the logarithm.
        fine = engine.count > FEW_CYLINDERS or steep or (apart and kind == 0)
        in_lanes = in_lanes and fewest <= lanes.MOST_NODES * RATIOS[fine] * times
        ratio = RATIOS[fine] if in_lanes else 1
        pieces = math.lcm(SEGMENTS, ratio * CHUNK) if in_lanes else SEGMENTS
        steps = steps_per_cycle(times, fewest, pieces)
        nodes, width = steps // times, period / steps
        rows = _rows_needed(part.take(row))
        row_of = _row_map(family, rows)
        grid = make_grid(family, rows, steps, engine.representatives_of(times))
        samples = NO_SAMPLES
        if method_code == designs.THESIS:
            samples = _sample_grid(family, rows, engine)
        product = packed.product(part)

        rest = partial(
            _march_rest, product=product, row_of=row_of, width=width, grid=grid, samples=samples,
            choice=choice, over_speed=over_speed, over_angle=over_angle,
            curves=_curves_at(angles, period, times, nodes, width), results=results,
        )  # fmt: skip
        scratch = partial(
            designs.make_scratch, nodes, grid.node_sine.size, samples.sine.shape[1], ratio
        )
        if in_lanes and apart:
            _march_panels(
                part.size, family=family, product=product, nodes=nodes, ratio=ratio, width=width,
                grid=grid, row_of=row_of, choice=choice, results=results, scratch=scratch,
                rest=rest, threads=threads, progress=progress, parts=1 if iterated is None else 2,
            )  # fmt: skip
            continue
        fewest_shared = FEWEST
        if in_lanes:
            fewest_shared = max(FEWEST, FEWEST_IN_LANES // (1 + angles.size // ANGLES_OF_DESIGN))
        wanted_at = None
        if in_lanes and angles.size:
            wanted_at = traces.make_angles(angles, family, rows, engine, nodes, ratio)
        job = partial(
            _march, product=product, row_of=row_of, width=width, grid=grid, choice=choice,
            results=results, in_lanes=in_lanes, ratio=ratio, scratch=scratch, rest=rest,
            angles=wanted_at, threads=threads // shared_by(part.size, threads, fewest_shared),
        )  # fmt: skip
        largest = PIECE_IN_LANES if in_lanes and not angles.size else PIECE
        run_pieces(part.size, job, threads, progress, largest, fewest_shared)

    found: dict[str, Any] = {name: results.scalars[i] for i, name in enumerate(names)}
    found["status"] = results.status
    for name, array in zip(CURVE_RESULTS, (results.omega, results.acceleration), strict=True):
        if curves[name]:
            found[name] = array
    return found, left


def _curves_at(
    angles: Floats, period: float, times: int, nodes: int, width: float
) -> designs.Curves:
    """Where the general methods find the curves' angles [rad]."""
    if not angles.size:
        return NO_CURVES
    place = np.mod(angles, period / times) / width
    node = np.minimum(np.floor(place + 1e-9).astype(np.int64), nodes - 1)
    return designs.Curves(
        node=node,
        share=np.maximum(place - node, 0.0),
        sample=np.mod(angles + 0.5 * period, period) / SAMPLE_WIDTH,
    )


def _compare(
    found: dict[str, Any], known: npt.NDArray[np.bool_], refined: dict[str, Any], tolerance: float,
    inputs: Mapping[str, Any], shape: tuple[int, ...],
) -> None:  # fmt: skip
    """Relative error of delta from its difference to a solution with more nodes, in place.

    Or that of the smallest speed where it is more. That solution's own error is far smaller, so the
    difference is nearly all of the error; what rounding leaves of a small delta comes on top, more
    with a larger eta, which `inputs` give. It knows better than the kernel whether the tolerance is
    met, and says so in the status. Piece by piece: no array of the sweep's size.
    """

    def at(name: str) -> Any:
        value = inputs[name]
        return np.broadcast_to(value, shape).flat[here] if np.ndim(value) else value

    for begin in range(0, known.size, CHUNK_OF_ARRAYS):
        here = slice(begin, begin + CHUNK_OF_ARRAYS)
        delta = found["delta"][here]
        with np.errstate(divide="ignore", invalid="ignore"):
            error = SAFETY * np.abs(delta / refined["delta"][here] - 1.0)
            slowest = np.abs(found["omega_min"][here] / refined["omega_min"][here] - 1.0)
            error = np.maximum(error, SAFETY_OF_SLOWEST * slowest) + LEAST_ERROR
            eta = 0.25 * np.square(at("stroke")) * np.divide(at("mass"), at("inertia"))
            error += lanes.ROUNDING * (1.0 + lanes.CANCELLED * eta) / delta
        good = known[here] & np.isfinite(error)
        met = np.where(error <= tolerance, CONVERGED, TOLERANCE_NOT_MET).astype(np.int8)
        np.copyto(found["delta_error"][here], error, where=good)
        np.copyto(found["status"][here], met, where=good)


@_known_apart
def torque_extremes(
    *,
    family: Family,
    wanted: Sequence[str],
    cylinders: Any = 1,
    cylinders_by_count: Mapping[int, Cylinders] | None = None,
    tolerance: float = 1e-6,
    threads: int | None = None,
    progress: Progress | None = None,
    driven: DrivenMachine = NOTHING_DRIVEN,
    **inputs: Any,
) -> dict[str, Any]:
    """Largest and smallest torque at nominal speed [N m] and energy swing [J] of every design.

    Arguments as `solve`, without what only the periodic speed needs. `wanted` of
    `TORQUE_RESULTS`. The energy swing is the range of the work of the torque, less a load over
    angle of `driven`, less the mean.
    """
    neutral = ("inertia", "exponent", "offset", "mean_torque", "start_speed", "passes",
               "start_angle", "offset_ratio", "gear_ratio", "load_phase", "load_scale",
               "synchronous_speed", "breakdown_slip", *FRICTION_NAMES)  # fmt: skip
    inputs = {**dict.fromkeys(neutral, 0.0), **inputs}
    counts = np.asarray(cylinders, dtype=np.int64)
    shape = _shape_of(*inputs.values(), counts)
    row = aligned(np.asarray(inputs["row"], dtype=float), len(shape))
    sets = aligned(counts, len(shape))
    period = family.row(0).period
    gear = np.zeros((1,) * len(shape))
    if driven.over_angle is not None:
        inputs["gear_ratio"] = whole_ratio(driven.over_angle, inputs["gear_ratio"], period)
        gear = aligned(inputs["gear_ratio"], len(shape))
    keys = [
        _fewest_nodes(family, row, tolerance),
        _repeats(driven.over_angle, gear, period),
        _fewest_nodes_of_load(driven.over_angle, gear, period, tolerance),
        *_along_axes(sets),
    ]
    names = [name for name in TORQUE_RESULTS if name in wanted]
    scalars = np.empty((max(len(names), 1), int(np.prod(shape, dtype=np.int64))))
    places = np.array([names.index(n) if n in names else -1 for n in TORQUE_RESULTS])
    packed = Packed.of(inputs, shape)
    _, over_angle = _acting(driven)
    for part in split(shape, keys):
        fewest, repeats, of_load = map(int, part.keys[:3])
        engine = _engine(int(part.take(sets).flat[0]), period, cylinders_by_count)
        times = math.gcd(engine.symmetry, repeats)
        steps = steps_per_cycle(times, max(fewest, of_load), PIECES)
        rows = _rows_needed(part.take(row))
        row_of = _row_map(family, rows)
        grid = make_grid(family, rows, steps, engine.representatives_of(times))
        product = packed.product(part)

        job = partial(
            _extremes,
            product=product, row_of=row_of, width=period / steps, grid=grid, nodes=steps // times,
            wanted=places, scalars=scalars, over_angle=over_angle,
        )  # fmt: skip
        cores = threads or os.cpu_count() or 1
        run_pieces(part.size, job, cores, progress, fewest=FEWEST_IN_LANES)
    return {name: scalars[i].reshape(shape) for i, name in enumerate(names)}


def mean_gas_torque(
    crank_ratio: Any,
    row: Any,
    family: Family,
    offset_ratio: Any = 0.0,
    pressure_factor: float = 1.0,
    tables: int | None = None,
) -> Floats:
    """Mean over angle of p c/(r omega) [Pa] for one cylinder, broadcasting.

    Times A r this is the mean torque of the absolute pressure, and of the gauge pressure too: the
    crankcase pressure does no work over a cycle. Three-point Gauss-Legendre on half degrees. Many
    are interpolated: of `tables` pairs of crank ratio and row where these are a block of them.
    """
    offset = _may_be(offset_ratio)
    crank_ratio, row, offset_ratio = np.broadcast_arrays(
        np.asarray(crank_ratio, dtype=float), np.asarray(row, dtype=float),
        np.asarray(offset_ratio, dtype=float),
    )  # fmt: skip
    # Copies: kernels ask whether they may write, and of a broadcast array NumPy warns then.
    ratios, offsets, places = (np.array(v).reshape(-1) for v in (crank_ratio, offset_ratio, row))
    result = np.empty(ratios.size)
    rows = _rows_needed(places)
    member = Member(0.0, pressure_factor, 1.0)
    row_of, grid = _row_map(family, rows), make_grid(family, rows, FEWEST_NODES, (member,))
    rates = np.empty(6 * FEWEST_NODES)
    if (ratios.size if tables is None else tables) < MANY_MEANS or offset:
        designs.mean_gas_torque(ratios, offsets, places, row_of, grid, rates, result)
        return result.reshape(row.shape)
    # It is smooth in the crank ratio: of many, few are needed, in panels as `panels` has them.
    number = np.empty(ratios.size, dtype=np.int64)
    designs.panels_of(ratios, number)
    used = np.flatnonzero(np.bincount(number))
    points = panels.points_of(used, POINTS_OF_MEANS)
    means = np.zeros((panels.MOST_PANELS, POINTS_OF_MEANS, rows.size))
    at = np.tile(points[used, 0].reshape(-1), rows.size)
    of_rows = np.repeat(rows.astype(float), used.size * POINTS_OF_MEANS)
    found = np.empty(at.size)
    designs.mean_gas_torque(at, np.zeros(at.size), of_rows, row_of, grid, rates, found)
    shape = (rows.size, used.size, POINTS_OF_MEANS)
    means[used] = np.moveaxis(found.reshape(shape), 0, -1)
    designs.mean_gas_between(ratios, places, number, row_of, points, means, result)
    return result.reshape(row.shape)


def _fits_lanes(choice: designs.Choice) -> bool:
    """Whether the designs of a part are tried in lanes first."""
    return (
        choice.method == designs.AUTO
        and choice.closure == POWER_MEAN
        and choice.tolerance >= LANES_TOLERANCE
    )


def _form_of(choice: designs.Choice) -> tuple[lanes.Form, lanes.Inertia]:
    """What solves a block of these designs in lanes, and whether their inertia varies."""
    if choice.kind == 2 and not choice.variable:
        return lanes.LINEAR, lanes.CONSTANT
    form = (lanes.FREE, lanes.ROOT, lanes.SQUARE, lanes.POWER)[choice.kind]
    return form, lanes.VARIABLE if choice.variable else lanes.CONSTANT


def _march(
    begin: int, end: int, *, product: Product, row_of: Integers, width: float, grid: Grid,
    choice: designs.Choice, results: designs.Results, in_lanes: bool, ratio: int,
    scratch: Callable[[], designs.Scratch], rest: Callable[[Integers, designs.Scratch], None],
    angles: traces.Angles | None, threads: int,
) -> None:  # fmt: skip
    """Solve a piece; `threads` are what there is for those that `lanes` leaves."""
    memory = scratch()
    if not in_lanes:
        rest(np.arange(begin, end), memory)
        return
    left = np.empty(end - begin, dtype=np.int64)
    size, blocks = end - begin, 0
    if angles is not None:
        size, blocks = traces.blocks_of(end - begin, _designs_of_table(product))
    form, inertia = _form_of(choice)
    iterated = form not in (lanes.LINEAR, lanes.FREE)
    kept = traces.make_kept(blocks, memory.levels.coarse.shape[0], iterated)
    curves = None if angles is None else traces.make_working(angles, kept)
    count = 0
    for first in range(begin, end, size):
        last = min(first + size, end)
        of_lanes = first, last, lanes.LANES, ratio, product, row_of, width, grid, choice, results
        count += designs.march_lanes(form, inertia, *of_lanes, memory, left[count:], kept)
        if angles is not None and curves is not None:
            designs.write_traces(inertia, *of_lanes, memory, angles, kept, *curves)
    _march_left(left[:count], memory, scratch, rest, threads)


def _march_left(
    left: Integers, memory: designs.Scratch, scratch: Callable[[], designs.Scratch],
    rest: Callable[[Integers, designs.Scratch], None], threads: int,
) -> None:  # fmt: skip
    """Solve what lanes left by `rest`, on threads that are not busy: it takes far longer there."""

    def job(begin: int, end: int) -> None:
        rest(left[begin:end], memory if end - begin == left.size else scratch())

    run_pieces(left.size, job, threads, None)


def _march_rest(
    chosen: Integers, memory: designs.Scratch, *, product: Product, row_of: Integers, width: float,
    grid: Grid, samples: Samples, choice: designs.Choice,
    over_speed: designs.NoShape | designs.OverSpeed, over_angle: Floats, curves: designs.Curves,
    results: designs.Results,
) -> None:  # fmt: skip
    """Solve designs by the general methods."""
    designs.march(
        chosen, SEGMENTS, product, row_of, width, grid, samples, choice, over_speed, over_angle,
        curves, results, memory,
    )  # fmt: skip


def _designs_of_table(product: Product) -> int:
    """Designs that share a table."""
    return int(np.prod(product.shape[product.other_axes], dtype=np.int64))


def _march_panels(
    size: int, *, family: Family, product: Product, nodes: int, ratio: int, parts: int,
    width: float, grid: Grid, row_of: Integers, choice: designs.Choice, results: designs.Results,
    scratch: Callable[[], designs.Scratch], rest: Callable[[Integers, designs.Scratch], None],
    threads: int, progress: Progress | None,
) -> None:  # fmt: skip
    """Solve designs with tables of their own, by interpolation between shared ones.

    These are built for as many panels and rows at a time as PANEL_BYTES hold. `parts` as in
    `panels.panel_at`.
    """
    rows = family.row_count + 1
    steps = grid.node_sine.size
    seen = np.zeros(panels.MOST_PANELS * rows, dtype=np.bool_)

    def look(begin: int, end: int) -> None:
        keys = np.empty(end - begin, dtype=np.int64)
        designs.keys_of(begin, end, rows, parts, product, keys)
        seen[keys] = True

    run_pieces(size, look, threads, None, PIECE_IN_LANES, PIECE_IN_LANES)
    wanted = np.flatnonzero(seen)
    shared = shared_by(size, threads, FEWEST_IN_LANES)
    small = np.min_scalar_type(wanted[-1])  # short numbers sort in one pass
    most = max(4, PANEL_BYTES // panels.bytes_of_table(nodes, ratio) // 3)
    for group in np.array_split(wanted, -(-wanted.size // most)):
        low, high = int(group[0]), int(group[-1])
        of_key, of_panel, points, bases = _shared_tables(
            group, rows, nodes, ratio, parts, steps, width, grid, row_of, threads
        )

        def job(
            begin: int, end: int, low: int = low, high: int = high, of_key: Integers = of_key,
            of_panel: Integers = of_panel, points: Floats = points,
            bases: panels.Panels = bases,
        ) -> None:  # fmt: skip
            memory, levels = scratch(), panels.make_own(nodes, ratio, bases.fine)
            keys = np.empty(end - begin, dtype=np.int64)
            designs.keys_of(begin, end, rows, parts, product, keys)
            order = np.argsort(keys.astype(small), kind="stable")
            first, last = np.searchsorted(keys, [low, high + 1], sorter=order)
            left = np.empty(last - first, dtype=np.int64)
            count = designs.march_panels(
                *_form_of(choice), begin, order[first:last], keys, rows, of_key, of_panel, points,
                lanes.LANES, ratio, width, product, bases, choice, results, memory, levels,
                left,
            )  # fmt: skip
            _march_left(np.sort(left[:count]), memory, scratch, rest, threads // shared)

        share = progress if high == wanted[-1] else None
        run_pieces(size, job, threads, share, PIECE_IN_LANES, FEWEST_IN_LANES)


def _shared_tables(
    keys: Integers, rows: int, nodes: int, ratio: int, parts: int, steps: int, width: float,
    grid: Grid, row_of: Integers, threads: int,
) -> tuple[Integers, Integers, Floats, panels.Panels]:  # fmt: skip
    """Shared tables of some keys: number of each key's and of each panel's, points, tables."""
    # The row behind a key's is the other end of what designs blend; the last one has none.
    both = np.union1d(keys, keys[row_of[keys % rows + 1] >= 0] + 1)
    used = np.unique(keys // rows)
    of_key = np.full(panels.MOST_PANELS * rows + 1, -1, dtype=np.int64)
    of_key[both] = np.arange(both.size)
    of_panel = np.full(panels.MOST_PANELS, -1, dtype=np.int64)
    of_panel[used] = both.size + 2 * np.arange(used.size)
    points = panels.points_of(used, lanes.POINTS, parts)
    bases = panels.make_panels(both.size + 2 * used.size, nodes, ratio)
    work = [(int(of_key[k]), int(row_of[k % rows]), int(k // rows)) for k in both]
    work += [(int(of_panel[p]), -1, int(p)) for p in used]

    def build(begin: int, end: int) -> None:
        memory = panels.make_build(nodes, steps, ratio)
        for number, row, panel in work[begin:end]:
            panels.build_panel(number, row, points[panel, 0], width, ratio, grid, bases, *memory)

    run_pieces(len(work), build, threads, None, fewest=8)
    return of_key, of_panel, points, bases


def _extremes(
    begin: int, end: int, *, product: Product, row_of: Integers, width: float,
    grid: Grid, nodes: int, wanted: Integers, scalars: Floats, over_angle: Floats,
) -> None:  # fmt: skip
    designs.extremes_of_torque(
        begin, end, product, row_of, width, grid, wanted, scalars, over_angle,
        np.empty((TABLE_ROWS, nodes)), np.empty((4, nodes)), np.empty(grid.quadrature_sine.size),
        np.empty((PLAIN_ROWS, nodes)),
    )  # fmt: skip


def _along_axes(sets: Integers) -> list[Integers]:
    """Keys that tell sets of cylinders apart, each along one axis, as `split` wants them.

    Sets may vary along several axes (number, misfire, arrangement): places of an axis are one key
    where all sets there are the same.
    """
    varying = [axis for axis, size in enumerate(sets.shape) if size > 1]
    if len(varying) <= 1:
        return [sets]
    keys = []
    for axis in varying:
        rows = np.moveaxis(sets, axis, 0).reshape(sets.shape[axis], -1)
        _, number = np.unique(rows, axis=0, return_inverse=True)
        shape = [size if i == axis else 1 for i, size in enumerate(sets.shape)]
        keys.append(number.reshape(shape))
    return keys


def _shape_of(*values: Any) -> tuple[int, ...]:
    """Shape that values broadcast to; most are plain numbers, of a single design all."""
    return np.broadcast_shapes(*(np.shape(v) for v in values if not isinstance(v, float)))


def _codes(names: tuple[str, ...], value: Any) -> Integers:
    if isinstance(value, str):
        return np.array(names.index(value), dtype=np.int64)
    words = np.asarray(value)
    return np.array([names.index(str(w)) for w in words.ravel()], dtype=np.int64).reshape(
        words.shape
    )


def _kinds(exponent: Floats) -> Integers:
    """Classes of the load exponent, see `designs.Choice`."""
    power = np.where(exponent == 2.0, 2, 3)
    return np.where(exponent <= NO_EXPONENT, 0, np.where(exponent == 1.0, 1, power))


def _rows_needed(row: Floats) -> Integers:
    """Rows of the family between which the (fractional) rows lie."""
    flat = row.ravel()
    if flat.size == 1:
        return np.array(sorted({math.floor(flat[0]), math.ceil(flat[0])}))
    seen = np.zeros(int(np.ceil(flat.max())) + 1, dtype=np.bool_)
    seen[np.floor(flat).astype(np.int64)] = True
    seen[np.ceil(flat).astype(np.int64)] = True
    return np.flatnonzero(seen)


def _row_map(family: Family, rows: Integers) -> Integers:
    """Place of each row of the family among `rows`, -1 for those that are not there."""
    table = np.full(family.row_count + 1, -1, dtype=np.int64)
    table[rows] = np.arange(len(rows))
    return table


def _fewest_nodes(family: Family, row: Floats, tolerance: float) -> Integers:
    """Nodes of a cycle for each (fractional) row: what its own two diagrams ask for.

    Over load and speed, or where cycles differ, rows vary along several axes, of which `split`
    allows one: what the roughest of all given diagrams asks for.
    """
    over_speed = isinstance(family, FamilyAtSpeeds | FamilyStack)
    needed = _rows_needed(row)
    used = family.diagrams if over_speed else [family.row(i) for i in needed.tolist()]
    nodes = [_nodes_of_diagram(diagram, tolerance) for diagram in used]
    if over_speed or row.size == 1:
        return np.full((1,) * row.ndim, max(nodes))
    counts = np.zeros(family.row_count + 1, dtype=np.int64)
    counts[needed] = nodes
    below, above = np.floor(row).astype(np.int64), np.ceil(row).astype(np.int64)
    return np.maximum(counts[below], counts[above])


def _acting(driven: DrivenMachine) -> tuple[designs.NoShape | designs.OverSpeed, Floats]:
    """What kernels take of a driven machine: load or driver over speed, load over angle."""
    angle = np.zeros((4, 0))
    if driven.over_angle is not None:
        angle = np.ascontiguousarray(driven.over_angle.table)
    if driven.power_law:
        return designs.NoShape(0), angle
    curve, table = driven.over_speed, np.zeros((3, 0))
    own = curve is not None and curve.own_speed
    if curve is not None:
        table = np.stack([curve.speed, curve.torque, curve.slope])
    return designs.OverSpeed(-1.0 if driven.has_driver else 1.0, own, table), angle


def _repeats(load: TorqueOverAngle | None, gear: Floats, period: float) -> Integers:
    """How often a load over angle repeats within the cycle.

    0 where there is none: the engine's symmetry divides it.
    """
    if load is None:
        return np.zeros((1,) * gear.ndim, dtype=np.int64)
    return np.broadcast_to(repeats_of(load, gear, period), gear.shape)


def _fewest_nodes_of_load(
    load: TorqueOverAngle | None, gear: Floats, period: float, tolerance: float
) -> Integers:
    """Nodes of a cycle that a load over angle asks for, judged as `_nodes_of_diagram`."""
    if load is None:
        return np.zeros((1,) * gear.ndim, dtype=np.int64)
    found = np.empty(gear.shape, dtype=np.int64)
    for ratio in np.unique(gear):
        found[gear == ratio] = _nodes_of_load(load, float(ratio), period, tolerance)
    return found


def _nodes_of_load(load: TorqueOverAngle, ratio: float, period: float, tolerance: float) -> int:
    steps = FEWEST_NODES
    while steps < MOST_NODES:
        count = max(int(np.ceil(steps * load.period / (ratio * period))), 4)
        step = load.period / count
        here = load.angle[0] + np.arange(count) * step
        work, torque = load.work(here), load(here) - load.mean
        cubic = 0.5 * (work + np.roll(work, -1)) + 0.125 * step * (torque - np.roll(torque, -1))
        missed = np.abs(load.work(here + 0.5 * step) - cubic).max()
        if missed <= 30.0 * tolerance * np.ptp(work):
            break
        steps *= 2
    return steps


@lru_cache(maxsize=4096)
def _nodes_of_diagram(diagram: Diagram, tolerance: float) -> int:
    """Nodes of a cycle for one diagram: doubled until a cubic through them misses little.

    Judged on the work of one cylinder at a crank ratio of 0.3, at the middle of the worst interval.
    The extremes use the middles too and seldom lie in the worst interval, so the threshold is above
    the tolerance. What is missed beyond the middles, much only of rough diagrams, is no more than
    the tolerance. Each design's own error decides about its status.
    """
    family = family_from_diagrams([0.0], [diagram])
    steps = FEWEST_NODES
    while steps < MOST_NODES:
        table = np.empty((TABLE_ROWS, steps))
        grid = make_grid(family, np.array([0]), steps)
        build_equal(
            0.3, Blend(0, 0, 0.0, 1.0, 0.0, FRICTIONLESS), steps, diagram.period / steps, grid,
            table, np.empty((4, steps)), np.empty(6 * steps),
        )  # fmt: skip
        swing = np.ptp(table[GAS_WORK])
        beyond = 2.0 * QUINTIC * np.abs(table[GAS_WORK_TILT]).max()
        within = np.abs(table[GAS_WORK_MIDDLE]).max() <= 30.0 * tolerance * swing
        if within and beyond <= tolerance * swing:
            break
        steps *= 2
    return steps


def _may_be(value: Any) -> bool:
    """Whether it may be anything but 0 in the sweep: a block of it must not decide by its own."""
    return np.ndim(value) > 0 or float(value) != 0.0


def _own_tables(inputs: Mapping[str, Any]) -> bool:
    """Whether tables depend on more than crank ratio and pressure, so that each is built."""
    uneven = any(_may_be(inputs[name]) for name in FRICTION_NAMES)
    return uneven or _may_be(inputs["offset_ratio"])


def _engine(
    count: int, period: float, cylinders_by_count: Mapping[int, Cylinders] | None
) -> Cylinders:
    """Cylinders of this number of them; evenly firing equal ones unless given otherwise."""
    given = (cylinders_by_count or {}).get(count)
    return even_cylinders(count, period) if given is None else given


def _sample_grid(family: Family, rows: Integers, engine: Cylinders) -> Samples:
    """Pressure at each cylinder's own angle for every sample of the thesis's method."""
    period = family.row(0).period
    angle = -0.5 * period + np.arange(round(period / SAMPLE_WIDTH)) * SAMPLE_WIDTH
    count = len(engine.members)
    if engine.plain:  # in the order of firing
        angle = angle[None, :] - np.arange(count)[:, None] * (period / count)
    else:
        angle = angle[None, :] + np.array([[member.phase] for member in engine.members])
    pressure = [
        [
            row_with_factor(family, int(row), member.pressure_factor)(here)
            for member, here in zip(engine.members, angle, strict=True)
        ]
        for row in rows
    ]
    return Samples(
        np.array(pressure), np.sin(angle), np.cos(angle), np.array(engine.mass_factors),
        np.array(engine.radius_factors),
    )  # fmt: skip
