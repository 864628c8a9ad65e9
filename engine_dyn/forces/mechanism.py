"""Forces and torques of the mechanism: on wall, rod, crank pin and frame, and what reduces them.

Directions
----------
Everything is seen so that the crank turns clockwise, the cylinder upright; theta is the angle of
the crank to the cylinder (phi without offset), beta that of the rod, positive while the big end is
on the side on which the crank pin goes down ("the far side" is the other). Friction and weight are
left out; the net forces have them besides.

=========  ========================  ==========================================================
force      made from P                positive
=========  ========================  ==========================================================
P          P_g + P_l                  on the piston, along the cylinder, towards the crank
N          P tan(beta)                of the piston on the wall of the far side
S          P / cos(beta)              compression of the rod
T          P c/(r omega)              of the rod on the crank pin, in the sense of rotation
R          P cos(theta + beta)/cos(beta)  of the rod on the crank pin, towards the crank's axis
=========  ========================  ==========================================================

P_g = (p - p_c) A is that of the gas, P_l = -m b that of the reciprocating masses. They hold for
each of the two as for their sum: the components are linear in P. The torque on the crank is T r;
the frame bears the opposite moment -T r, the overturning moment, as a couple: N acts at the height
H above the crank's axis and N H = T r. The force P_l reaches the block's supports too, along the
line of the pin; P_g does not, the cylinder head has its opposite.

Over the area of the piston the forces are "pressures", p_T = T/A and so on; over the displacement
of the cylinder the torque is mu = T r/V_h, which is p_T/2 without offset. The mean of p_T over the
cycle is p_i/pi in a two-stroke and p_i/(2 pi) in a four-stroke engine (p_i the indicated mean
effective pressure).

Sources: Kakaitsas (2015), ch. 2; Rakopoulos notes. tan(beta) = lambda u/W, u = sin(theta) - e/r.

The exact rod
-------------
Two masses at the ends have the rod's mass and centre of gravity, with distances a and l - a to big
and small end, but the moment of inertia m a (l - a) about it, which is usually more than the rod's
own Theta (the third condition of Kakaitsas, section 2.2, and the Rakopoulos notes). The rod is the
two masses and a body without mass of the moment of inertia Theta - m a (l - a), which may be
negative, that turns by beta. Its kinetic energy (Theta - m a (l - a)) beta'^2 omega^2/2 gives, at
constant speed, the torque that the usual model leaves out,

    M_c = -(Theta - m a (l - a)) omega^2 beta' beta'',

and moments about the crank pin give the couple -(Theta - m a (l - a)) omega^2 beta'', which the
wall bears with N_c = -(Theta - m a (l - a)) omega^2 beta''/(l cos(beta)); a force of the opposite
sign acts on the frame at the crank. beta' = lambda cos(theta)/W, beta'' = -lambda sin(theta)/W +
lambda^3 u cos^2(theta)/W^3.

Loads at the crosshead pin
--------------------------
In the direction of the piston rod, the *combined rod load* is the gas load and the inertia of
everything that reciprocates on the piston's side of the crosshead pin: piston, piston rod,
crosshead and the pin (API Standard 618, 5th edition). The connecting rod's reciprocating share,
which P has besides, loads the pin from the other side. Compression of the rod is positive. Without
weight and friction.

The bush of the pin gets oil only while the load changes its direction. API 618, paragraph 6.6.4,
asks that the reversal lasts at least 15 degrees of the crank angle and that the largest reversed
load is at least 3 percent of the largest in the other direction.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from engine_dyn.compilation import kernel
from engine_dyn.forces import torque
from engine_dyn.forces.superposition import largest, sample_angles
from engine_dyn.geometry import slider_crank
from engine_dyn.geometry.cylinder_means import value_of_sets
from engine_dyn.geometry.cylinders import Cylinders, CylindersByCount, Member
from engine_dyn.geometry.slider_crank import offset_acceleration_at, sine_of_top, sum_of_angles
from engine_dyn.pressure.family import Family, own_diagrams
from engine_dyn.types import Floats, Integers

GRAVITY = 9.80665  # Standard acceleration of free fall [m/s2] (CGPM 1901)
SAMPLES = 720  # Number of angles of a turn at which a largest value is searched


def _sine_and_cosine(phi: npt.ArrayLike, crank_ratio: Any, offset: Any) -> tuple[Any, Any]:
    """Sine and cosine of the crank's angle to the cylinder."""
    theta = np.asarray(phi, dtype=float) + slider_crank.dead_centres(crank_ratio, offset).top
    return np.sin(theta), np.cos(theta)


def thrust_ratio(phi: Any, crank_ratio: Any, offset: Any = 0.0) -> Any:
    """N/P = tan(beta) [1]. Kakaitsas (2015), eqs. 2.2, 2.17. See the module for directions.

    Here and below: `phi` crank angle [rad], `crank_ratio` lambda [1], `offset` that of the pin's
    line over the crank radius [1]; all broadcast.

    Raises
    ------
    ValueError
        If a crank ratio lies outside (0, 1), or an offset does not let the crank turn.
    """
    return np.tan(slider_crank.rod_angle(phi, crank_ratio, offset))


def rod_ratio(phi: Any, crank_ratio: Any, offset: Any = 0.0) -> Any:
    """S/P = 1/cos(beta) [1] at `phi` [rad]; ratios r/l, e/r. Kakaitsas (2015), eqs. 2.3, 2.18."""
    return 1.0 / np.cos(slider_crank.rod_angle(phi, crank_ratio, offset))


def radial_ratio(phi: Any, crank_ratio: Any, offset: Any = 0.0) -> Any:
    """R/P = cos(theta + beta)/cos(beta) [1] at `phi` [rad]; ratios r/l, e/r. Kakaitsas, eq. 2.5."""
    sine, cosine = _sine_and_cosine(phi, crank_ratio, offset)
    return cosine - sine * thrust_ratio(phi, crank_ratio, offset)


def of_cylinder(values: Callable[[Member], Any], cylinders: Any, by_count: CylindersByCount) -> Any:
    """Take a value of cylinder 1 of engines with different numbers of cylinders."""
    return value_of_sets(cylinders, by_count, lambda engine: values(engine.members[0]))


def gravity_torque(
    phi: Any,
    crank_ratio: Any,
    reciprocating_mass: Any,
    rotating_mass: Any,
    crank_radius: Any,
    cylinders: Any,
    by_count: CylindersByCount,
    offset: Any = 0.0,
    throw_turning_mass: Any = 0.0,
    inclination: Any = 0.0,
    web_unbalance: Any = 0.0,
) -> Any:
    """Torque of the weights of all running gear [N m], r (G_l c/(r omega) + G_r sin(theta)) each.

    A cylinder at angle g from upright (see `banks_of`) feels G_l cos(g) along its axis, and its
    throw stands at theta + g.
    `reciprocating_mass` and `rotating_mass` are those of each cylinder, `throw_turning_mass` that
    of each throw [kg]; what turns is at its own crank radius, less what its counterweight is there.
    `inclination` of the engine [rad] adds to g. `web_unbalance` [kg m] is that of counterweights on
    webs, complex, with the real axis along cylinder 1 at phi = 0 (`web_weights`).
    Rakopoulos notes, T_G (printed with two errors).
    """

    def of_engine(engine: Cylinders) -> Any:
        whole: Any = 0.0
        each = zip(engine.members, banks_of(engine), engine.throw_shares, strict=True)
        for member, from_upright, share in each:
            bank = from_upright + inclination
            angle, own = phi + member.phase, member.own(crank_ratio, offset)
            turning = rotating_mass + share * throw_turning_mass
            sine, cosine = _sine_and_cosine(angle, *own)
            lean = sine * np.cos(bank) + cosine * np.sin(bank)
            along = member.mass_factor * np.cos(bank)
            one = reciprocating_mass * along * slider_crank.velocity(angle, *own) + turning * lean
            whole = whole + member.radius_factor * one
        first = banks_of(engine)[0] + inclination
        return whole * crank_radius + np.imag(web_unbalance * np.exp(1j * (phi + first)))

    return GRAVITY * value_of_sets(cylinders, by_count, of_engine)


def sense_of_motion(velocity: Any) -> Any:
    """Return 1 where the piston moves towards the crank, -1 where away, 0 at the dead centres."""
    # A piston whose reduced velocity is below 1e-12 stands still: so little is rounding.
    return np.where(np.abs(velocity) < 1e-12, 0.0, np.sign(velocity))


def piston_friction_torque(
    phi: Any, crank_ratio: Any, friction: Any, crank_radius: Any, cylinders: Any,
    by_count: CylindersByCount, offset: Any = 0.0,
) -> Any:  # fmt: skip
    """Torque of a constant friction force [N] against each piston's motion [N m], against rotation.

    F r abs(c/(r omega)) each; its mean is F s/pi a cylinder.
    """

    def of_engine(engine: Cylinders) -> Any:
        angles = ((m, phi + m.phase_of(crank_ratio, offset)) for m in engine.members)
        return sum(np.abs(m.velocity(angle, crank_ratio, offset)) for m, angle in angles)

    return friction * crank_radius * value_of_sets(cylinders, by_count, of_engine)


def banks_of(engine: Cylinders) -> tuple[float, ...]:
    """Direction of each cylinder from upright [rad], in the sense of rotation.

    The engine stands with its outermost banks equally far to both sides: V engines upright, boxers
    flat. Radial engines, whose banks span more than half a turn, stand with bank angle 0 upright.
    All 0 where no arrangement is known.
    """
    if engine.arrangement is None:
        return (0.0,) * len(engine.members)
    banks = engine.arrangement.banks
    low, high = min(banks), max(banks)
    upright = 0.5 * (low + high) if high - low <= np.pi else 0.0
    return tuple(banks[cylinder.bank] - upright for cylinder in engine.arrangement.cylinders)


def inertia_pressure(coefficient: Any, specific_mass: Any, mean_piston_speed: Any) -> Any:
    """Amplitude of a harmonic of P_l over piston area [Pa].

    Q_nu m r omega^2/A = Q_nu pi^2 m c_m^2/(2 V_h), with the specific mass m/V_h [kg/m3] of one
    cylinder and the mean piston speed [m/s]: c_m = s omega/pi. Rakopoulos notes, p_l,nu; without
    offset.
    """
    return 0.5 * coefficient * np.pi**2 * specific_mass * mean_piston_speed**2


def two_mass_rod_inertia(rod_mass: Any, rod_centre_of_gravity: Any, rod_length: Any) -> Any:
    """Moment of inertia of the two masses about the centre of gravity, m a (l - a) [kg m2].

    Kakaitsas (2015), section 2.2, third condition; Rakopoulos notes, theta*.
    """
    return rod_mass * rod_centre_of_gravity * (rod_length - rod_centre_of_gravity)


def rod_speed(phi: Any, crank_ratio: Any, offset: Any = 0.0) -> Any:
    """Angular speed of the rod over that of the crank, beta' [1], at `phi` [rad]."""
    _, cosine = _sine_and_cosine(phi, crank_ratio, offset)
    return crank_ratio * cosine * rod_ratio(phi, crank_ratio, offset)


def rod_acceleration(phi: Any, crank_ratio: Any, offset: Any = 0.0) -> Any:
    """Angular acceleration of the rod at constant speed over omega^2, beta'' [1]."""
    sine, _ = _sine_and_cosine(phi, crank_ratio, offset)
    speed = rod_speed(phi, crank_ratio, offset)
    lean = thrust_ratio(phi, crank_ratio, offset)
    # beta'^2 tan(beta) - lambda sin(theta)/W, the angular acceleration of the rod.
    return lean * speed**2 - crank_ratio * sine * rod_ratio(phi, crank_ratio, offset)


def rod_couple(phi: Any, crank_ratio: Any, excess: Any, speed: Any, offset: Any = 0.0) -> Any:
    """Inertia couple of the rod that two masses leave out [N m], in the sense of growing beta.

    `excess` is the rod's moment of inertia less that of the two masses [kg m2], `speed` that of the
    crank [rad/s]. See the module.
    """
    return -excess * speed**2 * rod_acceleration(phi, crank_ratio, offset)


def rod_couple_torque(
    phi: Any, crank_ratio: Any, excess: Any, speed: Any, offset: Any = 0.0
) -> Any:
    """Torque on the crank that two masses leave out [N m], by the rod's `excess` [kg m2]."""
    return rod_couple(phi, crank_ratio, excess, speed, offset) * rod_speed(phi, crank_ratio, offset)


def rod_thrust(
    phi: Any, crank_ratio: Any, excess: Any, speed: Any, rod_length: Any, offset: Any = 0.0
) -> Any:
    """Wall thrust N that two masses leave out [N]: rod's `excess` [kg m2], speed [rad/s], [m]."""
    couple = rod_couple(phi, crank_ratio, excess, speed, offset)
    return couple * rod_ratio(phi, crank_ratio, offset) / rod_length


def rod_torque_error(
    crank_ratio: Any, excess: Any, mass: Any, crank_radius: Any, offset: Any = 0.0
) -> Any:
    """Largest error of the inertia torque with two masses over the largest of the exact rod [1].

    At constant speed, one cylinder; it does not depend on the speed. `mass` is the reciprocating
    mass [kg]. Largest of 720 angles of a turn: of a smooth curve, to 1e-4 of itself.
    """
    return _largest_errors(_TORQUE, crank_ratio, excess, mass * crank_radius**2, offset)


def rod_thrust_error(
    crank_ratio: Any, excess: Any, mass: Any, crank_radius: Any, offset: Any = 0.0
) -> Any:
    """Largest error of the thrust of the masses with two masses over the largest of the exact rod.

    As `rod_torque_error`, for the wall thrust of inertia alone.
    """
    return _largest_errors(_THRUST, crank_ratio, excess, mass * crank_radius**2, offset)


_TORQUE, _THRUST = 0, 1


def _largest_errors(which: int, crank_ratio: Any, excess: Any, moment: Any, offset: Any) -> Any:
    """Largest error of the two-mass model over the largest exact value, for each design."""
    slider_crank.dead_centres(crank_ratio, offset)  # raises for cranks that cannot turn
    inputs = (crank_ratio, excess, moment, offset)
    columns = np.broadcast_arrays(*(np.asarray(one, dtype=float) for one in inputs))
    theta = np.arange(SAMPLES) * (2.0 * np.pi / SAMPLES)
    result = np.empty(columns[0].size)
    _fill_errors(
        which, np.stack([column.reshape(-1) for column in columns]), np.sin(theta), np.cos(theta),
        result,
    )  # fmt: skip
    return result.reshape(columns[0].shape)


@kernel
def _fill_errors(which: int, inputs: Floats, sine: Floats, cosine: Floats, result: Floats) -> None:
    """Fill in the errors of two masses; rows of `inputs` are lambda, excess, m r^2 and e/r."""
    for design in range(result.size):
        ratio, offset = inputs[0, design], inputs[3, design]
        excess, moment = inputs[1, design], inputs[2, design]
        top = sine_of_top(ratio, offset)
        upright = math.sqrt(1.0 - top * top)
        most, whole = 0.0, 0.0
        for i in range(sine.size):
            s, c = sum_of_angles(sine[i], cosine[i], top, upright)
            lean = ratio * (s - offset)
            root = 1.0 / math.sqrt(1.0 - lean * lean)  # 1/cos(beta) of the rod
            speed = ratio * c * root
            couple = -excess * (lean * root * speed * speed - ratio * s * root)
            b = offset_acceleration_at(s, c, ratio, offset)
            if which == _TORQUE:
                left_out = couple * speed
                masses = moment * (s + lean * root * c) * b
            else:  # both thrusts are taken times the crank radius, which their ratio does not show
                left_out = couple * root * ratio
                masses = moment * lean * root * b
            most, whole = max(most, abs(left_out)), max(whole, abs(left_out - masses))
        result[design] = most / whole


ROD_LOADS = np.dtype(
    [
        (name, np.float64)
        for name in ("gas_compression", "gas_tension", "compression", "tension", "reversal",
                     "ratio")
    ]
)  # fmt: skip
"""Fields of a rod's loads: largest compression and tension of the gas load and of the combined
rod load [N], 0 where there is none, and the load reversal's duration [rad] and ratio."""


def rod_load_extremes(
    numbers: Mapping[str, Any], family: Family, by_count: CylindersByCount, period: float
) -> npt.NDArray[Any]:
    """Extremes and reversal of the rod loads, the worst of all cylinders.

    Parameters
    ----------
    numbers : mapping of array_like
        Numbers that broadcast over the designs: "crank_ratio", "double_radius" [m], "offset_ratio",
        "bore" [m], "row", "pressure_scale", "crankcase_pressure" [Pa], "piston_mass" [kg], "speed"
        [rad/s] and "cylinder_set".
    family : Family
        Diagrams; of double-acting cylinders, of the effective pressure.
    by_count : mapping
        Cylinders of each set.
    period : float
        Angle of the cycle [rad].

    Returns
    -------
    ndarray of dtype ROD_LOADS
        Shape of all numbers broadcast. Largest loads are found between samples (`superposition`);
        where the load changes its direction, it is a straight line between them.
    """
    columns = dict(zip(numbers, np.broadcast_arrays(*numbers.values()), strict=True))
    shape = columns["cylinder_set"].shape
    flat = {name: column.reshape(-1) for name, column in columns.items()}
    result = np.empty(flat["cylinder_set"].size, dtype=ROD_LOADS)
    phi = sample_angles(period, family)
    # Loads of at most 16 MB are held at once.
    at_once = max(1, (1 << 21) // phi.size)
    for number in np.unique(flat["cylinder_set"]).astype(int).tolist():
        mine = np.flatnonzero(flat["cylinder_set"] == number)
        for begin in range(0, mine.size, at_once):
            some = mine[begin : begin + at_once]
            one = {name: column[some][:, None] for name, column in flat.items()}
            worst = _worst(one, phi, by_count[number], family, period)
            for name, values in zip(ROD_LOADS.names or (), worst, strict=True):
                result[name][some] = values
    return result.reshape(shape)


def _worst(
    one: Mapping[str, Any], phi: Floats, engine: Cylinders, family: Family, period: float
) -> list[Floats]:
    """Extreme rod loads of designs along the first axis, in the order of `ROD_LOADS`."""
    extremes = []
    for member in dict.fromkeys(member._replace(phase=0.0) for member in engine.members):
        gas = _load(one, phi, member, family, 0.0)
        load = _load(one, phi, member, family, 1.0)
        reversed_for = np.empty(len(load))
        _fill_reversals(load, reversed_for)
        ends = []
        for values, moved in ((gas, 0.0), (load, 1.0)):

            def curve(
                which: Integers, angle: Floats, moved: float = moved, member: Member = member
            ) -> Floats:
                some = {name: column[which] for name, column in one.items()}
                return _load(some, angle[:, None], member, family, moved)[:, 0]

            for sign in (1.0, -1.0):  # largest compression and tension; 0 where there is none
                ends.append(np.maximum(largest(values, phi, curve, sign)[0], 0.0))
        highest = np.maximum(*ends[2:])
        ratio = np.minimum(*ends[2:]) / np.where(highest > 0.0, highest, 1.0)
        extremes.append((*ends, reversed_for * period / phi.size, ratio))
    return [
        (np.min if name in ("reversal", "ratio") else np.max)(values, axis=0)
        for name, values in zip(ROD_LOADS.names or (), zip(*extremes, strict=True), strict=True)
    ]


def _load(
    one: Mapping[str, Any], phi: Floats, member: Member, family: Family, moved: float
) -> Floats:
    """Rod load of designs along the first axis [N], with a fraction of the inertia force."""
    diagrams = own_diagrams(family, member.diagram)
    gas = torque.pressure(phi, diagrams, one["row"], one["pressure_scale"], member.pressure_factor)
    gas = (gas - one["crankcase_pressure"]) * torque.piston_area(one["bore"] * member.bore_factor)
    if moved == 0.0:
        return np.asarray(gas)
    own = member.own(one["crank_ratio"], one["offset_ratio"])
    mass = one["piston_mass"] * member.mass_factor * member.radius_factor
    inertia = mass * 0.5 * one["double_radius"] * one["speed"] ** 2
    return np.asarray(gas - inertia * slider_crank.acceleration(phi, *own))


@kernel
def _fill_reversals(load: Floats, result: Floats) -> None:
    """Fill in the shorter of the longest intervals of compression and of tension, in samples."""
    designs, count = load.shape
    for design in range(designs):
        force = load[design]
        first = -1
        for i in range(count):
            if (force[i] > 0.0) != (force[i - 1] > 0.0):
                first = i
                break
        longest_up, longest_down, last = 0.0, 0.0, 0.0
        if first >= 0:
            for k in range(count + 1):
                i = (first + k) % count
                before, here = force[i - 1], force[i]
                if (here > 0.0) == (before > 0.0):
                    continue
                place = first + k - 1.0 + before / (before - here)
                if k > 0:
                    if before > 0.0:
                        longest_up = max(longest_up, place - last)
                    else:
                        longest_down = max(longest_down, place - last)
                last = place
        result[design] = min(longest_up, longest_down) if math.isfinite(force[0]) else math.nan
