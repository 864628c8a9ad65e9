"""Forces of engines with master and articulated rods: on the frame, and on the first master rod."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from engine_dyn.forces import torque
from engine_dyn.forces.balance.lines import lines_of
from engine_dyn.forces.bearings import EXTREMES
from engine_dyn.forces.superposition import CrankTrain, largest, sample_angles
from engine_dyn.geometry import slider_crank
from engine_dyn.geometry.cylinder_means import value_of_sets
from engine_dyn.geometry.cylinders import Cylinders, CylindersByCount
from engine_dyn.types import Complexes

SAMPLES = 360  # Number of samples of a revolution from which single orders are computed


def inertia_force(
    phi: Any, crank_ratio: Any, crank_radius: Any, mass: Any, speed: Any, cylinder_set: Any,
    by_count: CylindersByCount, offset: Any = 0.0,
) -> Complexes:  # fmt: skip
    """Force of the reciprocating masses on the frame [N], real along cylinder 1.

    m r omega^2 (f b exp(i g) - mu k'' exp(i g)) of each cylinder in the direction g, with its
    reduced acceleration b, and the acceleration k'' of its knuckle pin, with a mass of mu m, beyond
    that of the crank pin; the imaginary part is a right angle ahead in the sense of rotation.
    Derived here.

    Parameters
    ----------
    phi : array_like
        Crank angle [rad]; all arrays broadcast.
    crank_ratio, offset : array_like
        lambda, and offset over the crank radius [1].
    crank_radius, mass, speed : array_like
        [m], of one cylinder [kg], [rad/s].
    cylinder_set, by_count
        As of `value_of_sets`.
    """

    def of_engine(engine: Cylinders) -> Any:
        total: Any = 0.0
        for member, direction in zip(engine.members, lines_of(engine).direction, strict=True):
            angle = phi + member.phase_of(crank_ratio, offset)
            one = member.mass_factor * member.acceleration(angle, crank_ratio, offset)
            if member.rod is not None:
                knuckle = member.rod.knuckle_acceleration(angle, crank_ratio, offset)
                one = one - member.rod.knuckle_mass * knuckle
            total = total + one * np.exp(1j * direction)
        return total

    return mass * crank_radius * speed**2 * value_of_sets(cylinder_set, by_count, of_engine)


def inertia_force_of_order(order: int, phi: Any, *motion: Any) -> Complexes:
    """One order of `inertia_force` over the angle [N]; `motion`: its arguments after `phi`."""
    turn = np.arange(SAMPLES) * (2.0 * np.pi / SAMPLES)
    force = inertia_force(turn, *motion)
    wave = np.exp(1j * order * turn)
    forward, backward = (
        np.mean(force * one, axis=-1, keepdims=True) for one in (np.conj(wave), wave)
    )
    angle = order * np.asarray(phi, dtype=float)
    return np.asarray(forward * np.exp(1j * angle) + backward * np.exp(-1j * angle))


class MasterLoads(NamedTuple):
    """Loads of the master rod of cylinder 1 [N]."""

    # Force of the wall on the master's piston, to the side to which the crank pin descends.
    wall_thrust: Any
    # Force on the crank pin: real part along the throw, imaginary in the sense of rotation.
    crank_pin: Any


def master_loads(
    phi: Any, train: CrankTrain, bore: Any, gas: torque.GasPressure, mass: Any, speed: Any,
    turning: Any,
) -> MasterLoads:  # fmt: skip
    """Loads of the master rod of cylinder 1 and of its crank pin, over the crank angle.

    A piston pushes its rod with P = (p - p_c) A - m b; an articulated rod takes P/cos(delta) along
    itself to its knuckle pin, where the mass mu m adds its inertia. The moments of all that about
    the crank pin leave the master's piston the thrust P_1 tan(beta) - M/(l cos(beta)) beside the
    force P_1, and all forces together load the pin, with what turns with it. Derived here.

    Parameters
    ----------
    phi, train, bore, gas, mass, speed
        As of `torque.torque_after_throw`.
    turning : array_like
        Mass of each rod that turns with the crank pin [kg].
    """
    crank = train.crank_ratio, train.offset
    unit = 0.5 * train.double_radius * speed**2
    theta = phi + slider_crank.dead_centres(*crank).top
    beta = slider_crank.rod_angle(phi, *crank)
    pin = np.exp(1j * theta)

    def of_engine(engine: Cylinders) -> Any:
        assert engine.arrangement is not None
        throws = [cylinder.throw for cylinder in engine.arrangement.cylinders]
        moment: Any = 0.0
        total: Any = 0.0
        for number, member in enumerate(engine.members):
            if throws[number] != throws[0]:
                continue
            angle = phi + train.phase_of(member)
            push = torque.piston_area(bore) * gas.difference(angle, member, train)
            push = push - mass * member.mass_factor * unit * train.acceleration(angle, member)
            if member.rod is None:
                total = total - push
                first = push
                continue
            rod, turned = member.rod, np.exp(1j * member.rod.bank)
            along = rod.direction(angle, *crank)
            force = -push / along.real * along * turned
            knuckle = rod.knuckle_acceleration(angle, *crank) * turned
            beyond = -mass * rod.knuckle_mass * unit * knuckle
            arm = rod.radius * np.exp(1j * (rod.angle - beta))
            whole = force + beyond + mass * rod.knuckle_mass * unit * pin
            moment = moment + (np.conj(arm) * whole).imag
            total = total + force + beyond
        thrust = first * np.tan(beta) - moment * train.crank_ratio / np.cos(beta)
        load = (total + 1j * thrust) * np.conj(pin) + throws.count(throws[0]) * turning * unit
        return np.stack([thrust + 0j, load])

    assert train.by_count is not None
    thrust, load = value_of_sets(train.cylinders, train.by_count, of_engine)
    return MasterLoads(thrust.real, load)


def crank_pin_extremes(
    period: float, train: CrankTrain, bore: Any, gas: torque.GasPressure, *masses: Any
) -> npt.NDArray[Any]:
    """Extremes of the load of the first crank pin, as `bearings.extremes`.

    `period` [rad] is that of the curve, the others are of `master_loads`; all arrays have a last
    axis of length 1, which the result has not.
    """
    parts = np.broadcast_arrays(
        train.crank_ratio, train.double_radius, train.cylinders, train.offset, bore, gas.row,
        gas.scale, gas.crankcase, *masses,
    )  # fmt: skip
    columns = [part.reshape(-1, 1) for part in parts]

    def load(which: Any, phi: Any) -> Any:
        ratio, radius, sets, offset, width, row, scale, crankcase, *rest = (
            column[which] for column in columns
        )
        own = train._replace(crank_ratio=ratio, double_radius=radius, cylinders=sets, offset=offset)
        pressure = gas._replace(row=row, scale=scale, crankcase=crankcase)
        return np.abs(master_loads(phi, own, width, pressure, *rest).crank_pin)

    phi = sample_angles(period, gas.family)
    size = load(slice(None), phi)
    extremes = np.empty(len(size), dtype=EXTREMES)
    extremes["peak"], extremes["angle"] = largest(
        size, phi, lambda which, angle: load(which, angle[:, None])[:, 0]
    )
    extremes["mean"], extremes["rms"] = size.mean(axis=-1), np.sqrt((size**2).mean(axis=-1))
    return extremes.reshape(parts[0].shape[:-1])
