"""The keys of scenes and of engine files that belong to no single subject, as plain data.

Keys of one subject alone stand beside its quantities: `single_cylinders`, `balance`, `flywheels`,
`characteristics`, `mechanism_forces`.
"""

from __future__ import annotations

from engine_dyn.geometry import arrangement, masses, slider_crank
from engine_dyn.loads import driven_machine
from engine_dyn.quantities.node import Node, parameter
from engine_dyn.units import BAR, DEGREE, RPM

__all__ = [
    "CHEN_FLYNN_KEYS",
    "CYCLE_KEYS",
    "INERTIA_PARTS",
    "PARAMETERS",
    "SOLVER_COLUMNS",
    "STROKE_SHARES",
]

PARAMETERS: tuple[Node, ...] = (
    parameter(
        "reciprocating_mass", "m", "kg", "reciprocating mass per cylinder",
        source="Kakaitsas eq. 2.10", low=0.0, low_included=True,
        make=lambda piston_mass, rod_mass, rod_centre_of_gravity, rod: masses.reciprocating_mass(
            piston_mass, rod_mass, rod_centre_of_gravity, rod
        ),
    ),
    parameter(
        "inertia", r"\Theta", "kg m2", "moment of inertia of the whole engine with its load",
        source="Kakaitsas section 3.2", low=0.0, when="wanted_delta",
        make=lambda inertia_required: inertia_required,
    ),
    parameter(
        "inertia", r"\Theta", "kg m2", "moment of inertia of the whole engine with its load",
        source="Kakaitsas section 3.2", low=0.0, when="given_inertia inertia_in_parts",
        make=lambda engine_inertia, auxiliary_inertia, flywheel_inertia, inertia_beyond_gear:
        masses.inertia_of_parts(
            engine_inertia, auxiliary_inertia, flywheel_inertia, inertia_beyond_gear
        ),
    ),
    parameter(
        "inertia", r"\Theta", "kg m2", "moment of inertia of the whole engine with its load",
        source="Kakaitsas section 3.2", low=0.0, when="given_inertia inertia_of_shaft",
        make=lambda shaft_inertia: shaft_inertia,
    ),
    parameter(
        "inertia", r"\Theta", "kg m2", "moment of inertia of the whole engine with its load",
        source="Kakaitsas section 3.2", low=0.0, when="given_inertia inertia_whole",
    ),
    parameter(
        "auxiliary_inertia", r"\Theta_{aux}", "kg m2",
        "moment of inertia of the auxiliaries, referred to the "
        "crankshaft", low=0.0, low_included=True,
        source="Kakaitsas eq. 3.2", unless_given=0.0,
    ),
    parameter(
        "flywheel_inertia", r"\Theta_{fly}", "kg m2", "moment of inertia of the flywheel",
        low=0.0, low_included=True, source="Kakaitsas eq. 3.2", unless_given=0.0,
    ),
    parameter(
        "load_inertia", r"\Theta_L", "kg m2", "moment of inertia of the load at its own shaft",
        low=0.0, low_included=True, source="Kakaitsas eq. 3.1", unless_given=0.0,
    ),
    parameter(
        "gear_ratio", "i", "1", "gear ratio, load-shaft speed over crankshaft speed", low=0.0,
        high=100.0, high_included=True, source="Kakaitsas eq. 3.1", unless_given=1.0,
    ),
    parameter(
        "load_phase", r"\theta_0", "degree",
        "phase of a load over angle: the load's angle at firing top dead centre of cylinder "
        "1", si=DEGREE,
        low=-720.0, high=720.0, low_included=True, high_included=True, source="this project",
        unless_given=0.0,
    ),
    parameter(
        "load_table_factor", "f_L", "1", "factor on a load over angle", low=0.0, low_included=True,
        source="this project", unless_given=1.0,
    ),
    parameter(
        "torque_factor", "f_M", "1", "factor on the torque that an engine file gives", low=0.0,
        source="this project", unless_given=1.0,
    ),
    parameter(
        "motor_gear_ratio", "i_m", "1",
        "driving motor: shaft speed over crankshaft speed", low=0.0, high=100.0,
        high_included=True, source="this project", unless_given=1.0,
    ),
    parameter(
        "motor_synchronous_speed", "n_s", "rpm",
        "driving motor: synchronous speed, at its own shaft", si=RPM, low=0.0,
        source="Kloss's formula", when="motor_of_slip",
        needs=("speed", "motor_slip", "motor_gear_ratio"), make=driven_machine.synchronous_speed,
    ),
    parameter(
        "motor_synchronous_speed", "n_s", "rpm",
        "driving motor: synchronous speed, at its own shaft", si=RPM, low=0.0,
        source="Kloss's formula", when="motor_of_speed",
    ),
    parameter(
        "motor_slip", "s_n", "1",
        "driving motor: slip at nominal speed, for a gear or supply that follows that speed",
        low=0.0, high=1.0, source="Kloss's formula",
    ),
    parameter(
        "motor_breakdown_slip", "s_b", "1",
        "driving motor: breakdown slip, the slip at the largest torque", low=0.0,
        high=10.0, source="Kloss's formula",
    ),
    parameter(
        "motor_breakdown_torque", "M_b", "N m",
        "driving motor: breakdown torque, the largest torque, at its own shaft",
        low=0.0, source="Kloss's formula",
    ),
    parameter(
        "crank_ratio", r"\lambda", "1", "crank ratio, crank radius over rod length",
        source="Kakaitsas eq. 1.3", low=0.0, high=1.0, when="offset",
        make=lambda rod_length, stroke, pin_line: slider_crank.crank_radius(
            stroke, rod_length, pin_line
        ) / rod_length,
    ),
    parameter(
        "crank_ratio", r"\lambda", "1", "crank ratio, crank radius over rod length",
        source="Kakaitsas eq. 1.3", low=0.0, high=1.0, when="centred",
        make=lambda rod_length, stroke: 0.5 * stroke / rod_length,
    ),
    parameter(
        "rod_length", "l", "m", "connecting rod length between centres", low=0.0,
        source="Kakaitsas table 4.1",
    ),
    parameter("bore", "D", "m", "cylinder bore", low=0.0, source="Kakaitsas table 4.1"),
    parameter("stroke", "s", "m", "piston stroke", low=0.0, source="Kakaitsas table 4.1"),
    parameter(
        "pin_offset", "e_p", "m",
        "piston-pin offset from the cylinder axis, positive on the side where the crank pin moves "
        "down",
        source="Norton, Design of Machinery: offset slider-crank", unless_given=0.0,
    ),
    parameter(
        "crank_offset", "e_c", "m",
        "cylinder-axis offset from the crankshaft axis, positive on the side where the crank pin "
        "moves down",
        source="Norton, Design of Machinery: offset slider-crank", unless_given=0.0,
    ),
    parameter(
        "speed", "n", "rpm", "nominal crank speed", si=RPM, low=0.0, source="Kakaitsas table 4.1",
        when="given_speed",
    ),
    *(
        parameter(
            "speed", "n", "rpm", "nominal crank speed", si=RPM, low=0.0,
            source="Kakaitsas table 4.1", when=when, make=lambda speed_found: speed_found,
        )
        for when in ("speed_of_largest", "speed_of_smallest")
    ),
    parameter(
        "largest_speed", "n_{max}", "rpm",
        "largest crank speed over the cycle, in place of the nominal one, of an engine whose "
        "torque is given", si=RPM, low=0.0, source="this project",
    ),
    parameter(
        "smallest_speed", "n_{min}", "rpm",
        "smallest crank speed over the cycle, in place of the nominal one, of an engine whose "
        "torque is given", si=RPM, low=0.0, source="this project",
    ),
    parameter(
        "load", "L", "percent", "engine load",
        source="Kakaitsas section 5.2.5", low=0.0, low_included=True, when="given_load",
    ),
    parameter(
        "recorded_cycle", "c", "1", "recorded cycle, treated as if it repeated",
        whole=True, low=1.0, low_included=True, source="this project", when="over_cycles",
    ),
    parameter(
        "cylinders", "Z", "1", "number of cylinders", whole=True, low=1.0, low_included=True,
        high=float(arrangement.MOST_CYLINDERS), high_included=True, source="Kakaitsas section 5.4",
    ),
    parameter(
        "misfire", "i_0", "1", "misfiring cylinder, 0 for none", whole=True,
        low=0.0, low_included=True, high=float(arrangement.MOST_CYLINDERS), high_included=True,
        source="this project", unless_given=0.0,
    ),
    parameter(
        "load_exponent", r"\alpha", "1", "exponent of the speed in the load torque", low=0.0,
        low_included=True, source="Kakaitsas eq. 3.4",
    ),
    # Made, not `unless_given`: archives list what is given of the laws that hold.
    parameter(
        "load_linear", "b", "N m s",
        "linear coefficient of the speed in the load torque", low=0.0, low_included=True,
        source="M_L = a + k (b omega + c omega^2): a brake or a fan with bearing losses",
        make=lambda: 0.0,
    ),
    parameter(
        "load_square", "c", "N m s2",
        "quadratic coefficient of the speed in the load torque", low=0.0, low_included=True,
        source="M_L = a + k (b omega + c omega^2): a brake or a fan with bearing losses",
        make=lambda: 0.0,
    ),
    parameter(
        "load_offset", "a", "N m", "load torque independent of speed",
        source="Kakaitsas eq. 3.4",
    ),
    parameter(
        "crankcase_pressure", "p_c", "bar", "crankcase pressure, absolute, under the piston",
        si=BAR, low=0.0, low_included=True, source="Kakaitsas section 2.1",
    ),
    parameter(
        "piston_mass", r"m_\epsilon", "kg", "piston mass with pin and rings", low=0.0,
        low_included=True, source="Kakaitsas table 4.1",
    ),
    parameter(
        "rod_mass", r"m_\delta", "kg", "connecting rod mass", low=0.0, low_included=True,
        source="Kakaitsas table 4.1",
    ),
    parameter(
        "rod_centre_of_gravity", "l_{cg}", "m",
        "distance of the rod's centre of gravity from the big end", low=0.0, low_included=True,
        source="Kakaitsas table 4.1",
    ),
    parameter(
        "rod_inertia", r"\theta_\delta", "kg m2",
        "moment of inertia of the rod about its centre of gravity; by default, that of the "
        "two-mass model",
        low=0.0, source="Rakopoulos notes, third condition",
        make=lambda two_mass_rod_inertia: two_mass_rod_inertia,
    ),
    parameter(
        "crank_mass", r"m_\sigma", "kg", "mass of each throw, reduced to the crank radius", low=0.0,
        low_included=True, source="Kakaitsas eq. 2.15", when="throw_given",
        make=lambda throw_mass, throw_radius, double_radius: masses.crank_mass_at_pin(
            throw_mass, throw_radius, 0.5 * double_radius
        ),
    ),
    parameter(
        "crank_mass", r"m_\sigma", "kg", "mass of each throw, reduced to the crank radius", low=0.0,
        low_included=True, source="Kakaitsas eq. 2.15", when="crank_mass_given",
    ),
    parameter(
        "throw_mass", "m_o", "kg", "mass of a crank throw", low=0.0, low_included=True,
        source="Kakaitsas eq. 2.15, Asgari eq. 6",
    ),
    parameter(
        "throw_radius", "r_o", "m", "distance of a throw's centre of gravity from the shaft axis",
        low=0.0, low_included=True, source="Kakaitsas eq. 2.15, Asgari eq. 6",
    ),
    parameter(
        "friction_constant", "a_2", "bar", "constant part of the friction mean effective pressure",
        si=BAR, low=0.0, low_included=True, source="Kakaitsas eq. 3.9",
    ),
    parameter(
        "friction_peak_pressure", "b_2", "1",
        "friction mean effective pressure per peak pressure", low=0.0,
        low_included=True, source="Kakaitsas eq. 3.9",
    ),
    parameter(
        "friction_mean_piston_speed", "c_2", "bar s m-1",
        "friction mean effective pressure per mean piston speed", si=BAR, low=0.0,
        low_included=True, source="Kakaitsas eq. 3.9",
    ),
    parameter(
        "friction_mean_piston_speed_square", "d_2", "bar s2 m-2",
        "friction mean effective pressure per squared mean piston speed", si=BAR, low=0.0,
        low_included=True, source="Chen and Flynn, SAE 650733", unless_given=0.0,
    ),
    parameter(
        "friction_boundary", "f_b", "1",
        "share of piston friction with a constant coefficient (boundary lubrication)", low=0.0,
        low_included=True, high=1.0, high_included=True,
        source="after Rezeka and Henein, SAE 840179", unless_given=0.0,
    ),
    parameter(
        "friction_mixed", "f_m", "1",
        "share of piston friction whose coefficient falls with piston speed (mixed lubrication)",
        low=0.0, low_included=True, high=1.0, high_included=True,
        source="after Rezeka and Henein, SAE 840179", unless_given=0.0,
    ),
    parameter(
        "friction_hydrodynamic", "f_h", "1",
        "share of piston friction that grows with the square root of speed times pressure "
        "(hydrodynamic lubrication)",
        low=0.0, low_included=True, high=1.0, high_included=True,
        source="after Rezeka and Henein, SAE 840179", unless_given=0.0,
    ),
    parameter(
        "friction_skirt", "f_s", "1",
        "share of piston friction that grows with piston speed (skirt)", low=0.0,
        low_included=True, high=1.0, high_included=True,
        source="after Rezeka and Henein, SAE 840179", unless_given=0.0,
    ),
    parameter(
        "ring_pressure", "p_r", "bar",
        "contact pressure of the piston rings on the liner due to ring tension", si=BAR, low=0.0,
        high=100.0, source="after Rezeka and Henein, SAE 840179",
    ),
    parameter(
        "auxiliary_torque", "M_{aux}", "N m",
        "torque of the auxiliaries at the crankshaft, part of the friction", low=0.0,
        low_included=True, source="this project", unless_given=0.0,
    ),
    parameter(
        "compression_ratio", r"\varepsilon", "1",
        "compression ratio, largest over smallest cylinder volume; in a scene, that of the "
        "modelled cycles", low=1.5,
        high=40.0, source="Heywood (1988), ch. 2",
    ),
    parameter(
        "intake_pressure", "p_i", "bar",
        "modelled cycle: absolute pressure of intake manifold or scavenge air", si=BAR, low=0.0,
        high=20.0, source="Heywood (1988), ch. 6",
    ),
    parameter(
        "heat", "q", "bar", "modelled cycle: heat released per cycle over the swept volume",
        si=BAR, low=0.0, low_included=True, high=200.0, high_included=True,
        source="Heywood (1988), ch. 9",
    ),
    parameter(
        "combustion_start", r"\varphi_b", "degree", "modelled cycle: start of the combustion",
        si=DEGREE, low=-90.0, high=90.0, source="Heywood (1988), eq. 9.30",
    ),
    parameter(
        "combustion_duration", r"\Delta\varphi_b", "degree",
        "modelled cycle: duration of the combustion", si=DEGREE, low=2.0, high=270.0,
        source="Heywood (1988), eq. 9.30",
    ),
    parameter(
        "truncation", r"\nu_{max}", "1",
        "highest order kept in the truncated series of piston motion",
        whole=True, even=True, low=2.0, low_included=True, high=40.0, high_included=True,
        source="Mosakowski eqs. 13, 18", unless_given=2.0,
    ),
    parameter(
        "passes", "N", "1",
        "number of cycles to compute (method thesis)", whole=True, low=1.0,
        low_included=True, source="Kakaitsas section 4.2", unless_given=0.0,
    ),
    parameter(
        "start_speed", r"\omega_1", "rad s-1", "crank speed at the start (method thesis)",
        low=0.0, source="Kakaitsas section 4.2", unless_given=0.0,
    ),
    parameter(
        "start_angle", r"\varphi_1", "degree", "crank angle at the start (method thesis)",
        si=DEGREE, low=-720.0, high=720.0, low_included=True, high_included=True,
        source="Kakaitsas section 4.2", unless_given=-180.0,
    ),
)  # fmt: skip

CYCLE_KEYS = (
    "compression_ratio", "intake_pressure", "heat", "combustion_start", "combustion_duration",
)  # fmt: skip
"""Parameters of a modelled cycle that a scene may replace in the engine's diagrams."""

INERTIA_PARTS = ("auxiliary_inertia", "flywheel_inertia", "load_inertia")
"""Any of them given, the inertia is that of the engine's running gear and these parts."""

STROKE_SHARES = (
    "friction_boundary", "friction_mixed", "friction_hydrodynamic", "friction_skirt",
)  # fmt: skip
"""Parameters that spread the friction over the stroke."""

CHEN_FLYNN_KEYS = (
    "friction_constant", "friction_peak_pressure", "friction_mean_piston_speed",
    "friction_mean_piston_speed_square",
)  # fmt: skip
"""Constants of the friction mean effective pressure a + b p_max + c c_m + d c_m^2."""

SOLVER_COLUMNS = ("passes", "start_speed", "start_angle")
"""Parameters of the methods that repeat cycles, given in [solver] or as columns of [designs]."""
