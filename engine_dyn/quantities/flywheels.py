"""Nodes of the flywheel: see `engine_dyn.flywheel`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from engine_dyn import flywheel
from engine_dyn.geometry import masses
from engine_dyn.quantities.node import Node, formula, parameter, quotient, variants
from engine_dyn.units import DEGREE, MPA


def _limits() -> tuple[tuple[str, float], ...]:
    """Admissible deltas by name: the finer end of each range, and the coarser if any."""
    limits = []
    for name, (fine, coarse) in flywheel.ADMISSIBLE.items():
        limits.append((name, fine))
        if coarse != fine:
            limits.append((f"{name}, coarse", coarse))
    return tuple(limits)


PARAMETERS = (
    parameter(
        "wanted_delta", r"\delta_w", "1",
        "wanted coefficient of speed fluctuation (cyclic irregularity), from which the inertia "
        "follows",
        "Kakaitsas section 3.2.2", low=0.0, high=2.0, named=_limits(),
    ),
    parameter(
        "flywheel_outer_diameter", "D_f", "m", "outer diameter of the flywheel's ring",
        "Asgari eq. 15", low=0.0,
    ),
    parameter(
        "flywheel_inner_diameter", "D_i", "m", "inner diameter of the flywheel's ring",
        "Asgari eq. 17", low=0.0, low_included=True,
    ),
    parameter(
        "flywheel_density", r"\rho", "kg m-3", "density of the flywheel", "handbook values",
        low=0.0, named=tuple(flywheel.DENSITIES.items()),
    ),
    parameter(
        "rim_speed_lowest", r"v_{min}", "m s-1", "lowest usual rim speed of the flywheel",
        "Asgari eq. 14", low=0.0, low_included=True,
        named=tuple((name, least) for name, (least, _) in flywheel.RIM_SPEEDS.items()),
    ),
    parameter(
        "rim_speed_limit", r"v_{max}", "m s-1", "largest allowed rim speed of the flywheel",
        "Asgari eq. 14", low=0.0,
        named=tuple((name, high) for name, (_, high) in flywheel.RIM_SPEEDS.items()),
    ),
    parameter(
        "given_energy_swing", r"\Delta E", "J",
        "energy swing that is known, where no torque is given", "Khurmi and Gupta chapter 16",
        low=0.0,
    ),
    parameter(
        "given_energy_fluctuation", "C_E", "1",
        "coefficient of fluctuation of energy that is known: energy swing over the work of a cycle",
        "Khurmi and Gupta chapter 16", low=0.0,
    ),
    parameter(
        "rim_stress_limit", r"\sigma_{max}", "MPa", "allowed hoop stress of the flywheel's rim",
        "Khurmi and Gupta chapter 16", si=MPA, low=0.0,
    ),
    parameter(
        "rim_mean_diameter", "D_m", "m",
        "mean diameter of the flywheel's rim, by default the largest that the allowed hoop stress "
        "permits",
        "Khurmi and Gupta chapter 16", low=0.0,
        make=lambda rim_largest_diameter: 1.0 * rim_largest_diameter,
    ),
    parameter(
        "rim_width_over_thickness", "b/t", "1",
        "width of the flywheel's rim along the shaft over its radial thickness",
        "Khurmi and Gupta chapter 16", low=0.0,
    ),
    parameter(
        "rim_inertia_share", "I_r/I_F", "1",
        "share of the rim in the flywheel's moment of inertia, beside hub and arms",
        "Khurmi and Gupta chapter 16", low=0.0, high=1.0, high_included=True, unless_given=1.0,
    ),
)  # fmt: skip


def _of_triangle(name: str, symbol: str, unit: str, long_name: str, source: str,
                 field: str) -> Node:  # fmt: skip
    def make(brake_power: Any, speed: Any, wanted_delta: Any, period: Any) -> Any:
        power = np.asarray(brake_power, dtype=float)
        drives = power > 0.0
        triangle = flywheel.triangular_torque(
            np.where(drives, power, 1.0), speed, wanted_delta, period
        )
        return np.where(drives, getattr(triangle, field), np.nan)

    return Node(name, symbol, unit, long_name, source, make=make)


def _flywheel_required(
    *, inertia_required: Any, auxiliary_inertia: Any, inertia_beyond_gear: Any,
    engine_inertia: Any = 0.0,
) -> Any:  # fmt: skip
    parts = engine_inertia, auxiliary_inertia, 0.0, inertia_beyond_gear
    return np.maximum(inertia_required - masses.inertia_of_parts(*parts), 0.0)


def _step(crank_angle: Any) -> float:
    angle = np.asarray(crank_angle).reshape(-1)
    return float(angle[1] - angle[0])


def _crossing(which: int) -> Callable[..., Any]:
    def make(*, torque: Any, load_over_angle: Any, crank_angle: Any) -> Any:
        first = float(np.asarray(crank_angle).reshape(-1)[0])
        net = flywheel.net_torque(torque, load_over_angle)
        return flywheel.crossings(net, first, _step(crank_angle))[which]

    return make


def _delta_of_swing(energy_swing: Any, inertia: Any, speed: Any) -> Any:
    return energy_swing / (inertia * speed**2)


def _of_swing(swing: str, name: str, about: str) -> tuple[Node, Node]:
    """Nodes of inertia and delta that follow from an energy swing."""

    def inertia_of(*, wanted_delta: Any, speed: Any, **needs: Any) -> Any:
        return flywheel.energy_swing_inertia(needs[swing], wanted_delta, speed)

    def delta_of(*, inertia: Any, speed: Any, **needs: Any) -> Any:
        return _delta_of_swing(needs[swing], inertia, speed)

    return (
        Node(f"inertia_of_{name}", r"\Theta_{\Delta E}", "kg m2",
             f"inertia for the wanted delta from {about}", _ENERGY,
             needs=(swing, "wanted_delta", "speed"), make=inertia_of),
        Node(f"delta_of_{name}", r"\delta_{\Delta E}", "1",
             f"coefficient of speed fluctuation from {about}", _ENERGY,
             needs=(swing, "inertia", "speed"), make=delta_of),
    )  # fmt: skip


_ENERGY = "Khurmi and Gupta chapter 16"  # Source of the energies' definitions

_SIZED = "sized_flywheel_inertia", "", "kg m2", "inertia of the flywheel that is sized"


def _verdict(
    name: str, symbol: str, long_name: str, source: str, needs: tuple[str, ...],
    make: Callable[..., Any],
) -> Node:  # fmt: skip
    """Return a node that says whether a value lies in a usual range."""
    return Node(
        name, symbol, "1", long_name, source, needs=needs, make=make, meanings=flywheel.VERDICTS
    )


NODES = (
    Node(
        "flywheel_side_inertia", r"\Theta_{F}", "kg m2",
        "moment of inertia of flywheel and load, referred to the crankshaft",
        "Kakaitsas eq. 3.2", when="given_inertia inertia_in_parts",
        make=lambda flywheel_inertia, inertia_beyond_gear: flywheel_inertia + inertia_beyond_gear,
    ),
    *(
        Node(
            "flywheel_side_inertia", r"\Theta_{F}", "kg m2",
            "moment of inertia of flywheel and load, referred to the crankshaft",
            "Kakaitsas eq. 3.2", when=when,
            make=lambda inertia, engine_inertia, auxiliary_inertia: flywheel.inertia_behind(
                inertia, engine_inertia + auxiliary_inertia
            ),
        )
        for when in (
            "given_inertia inertia_whole", "given_inertia inertia_of_shaft", "wanted_delta",
        )
    ),
    Node(
        "flywheel_shaft_torque", "M_{F}", "N m",
        "torque in the shaft between running gear and flywheel, positive where it drives the "
        "flywheel, rigid shaft",
        "Newton's law, Kakaitsas eqs. 3.1, 3.2", kind="curve",
        make=lambda load_torque, driver_torque, flywheel_side_inertia, angular_acceleration:
        flywheel.shaft_torque(
            load_torque - driver_torque, flywheel_side_inertia, angular_acceleration
        ),
    ),
    *variants(
        Node("load_side_inertia", "", "kg m2",
             "moment of inertia of the load, referred to the crankshaft", public=False),
        dict.fromkeys(("wanted_delta", "given_inertia inertia_in_parts"),
                      lambda inertia_beyond_gear: inertia_beyond_gear),
    ),
    # Of an inertia that is given as one number, or by the discs of a shaft, the load's share is
    # unknown: scenes that need it are refused.
    *(
        Node(
            "load_side_inertia", "", "kg m2",
            "moment of inertia of the load, referred to the crankshaft",
            public=False, when=f"given_inertia {when}", kind="parameter",
        )
        for when in ("inertia_whole", "inertia_of_shaft")
    ),
    Node(
        "load_shaft_torque", "M_{FL}", "N m",
        "torque in the shaft between flywheel and load, referred to the crankshaft, positive where "
        "it drives the load, rigid shaft",
        "Newton's law, Kakaitsas eq. 3.1", kind="curve",
        make=lambda load_torque, driver_torque, load_side_inertia, angular_acceleration:
        flywheel.shaft_torque(
            load_torque - driver_torque, load_side_inertia, angular_acceleration
        ),
    ),
    Node(
        "rim_speed", "v_f", "m s-1", "rim speed of the flywheel", "Asgari eq. 15",
        **formula(flywheel.rim_speed, "flywheel_outer_diameter", "speed"),
    ),
    Node(
        "flywheel_smallest_diameter", "D_{min}", "m",
        "smallest outer diameter of the flywheel, at which the rim has the lowest usual speed",
        "Asgari eqs. 14, 15", make=lambda rim_speed_lowest, speed: 2.0 * rim_speed_lowest / speed,
    ),
    _verdict(
        "rim_speed_verdict", r"\chi_v", "whether the rim speed lies within its limits",
        "Asgari eq. 14", ("rim_speed", "rim_speed_lowest", "rim_speed_limit"),
        lambda rim_speed, rim_speed_lowest, rim_speed_limit: flywheel.verdict(
            rim_speed, rim_speed_lowest, rim_speed_limit
        ),
    ),
    Node(
        "flywheel_largest_diameter", "D_{max}", "m",
        "largest outer diameter of the flywheel, at which the rim has the largest allowed speed",
        "Asgari eqs. 14, 15", **formula(flywheel.largest_diameter, "rim_speed_limit", "speed"),
    ),
    Node(
        "flywheel_mean_diameter", "D_r", "m", "mean diameter of the flywheel's ring",
        "Asgari eq. 17",
        **formula(flywheel.mean_diameter, "flywheel_outer_diameter", "flywheel_inner_diameter"),
    ),
    Node(
        "diameter_over_stroke", "D_r/s", "1",
        "mean diameter of the flywheel over the stroke, usually 2 to 3", "Asgari eq. 16",
        make=lambda flywheel_mean_diameter, stroke: flywheel_mean_diameter / stroke,
    ),
    _verdict(
        "diameter_over_stroke_verdict", r"\chi_D",
        "whether the flywheel's mean diameter is 2 to 3 strokes", "Asgari eq. 16",
        ("diameter_over_stroke",),
        lambda diameter_over_stroke: flywheel.verdict(
            diameter_over_stroke, *flywheel.DIAMETER_OVER_STROKE
        ),
    ),
    Node(
        "cycle_rate", "n_c", "min-1",
        "number of cycles per minute of one cylinder, at nominal speed",
        "Asgari eq. 20", si=1.0 / 60.0, make=lambda speed, period: speed / period,
    ),
    _of_triangle("cycle_work", "W", "J", "work of a cycle", "Asgari eqs. 20, 21", "work"),
    _of_triangle(
        "triangle_expansion_work", "W_E", "J", "triangular torque: work of the expansion",
        "Asgari eq. 24", "expansion_work",
    ),
    _of_triangle(
        "triangle_torque_max", "T_{Max}", "N m", "triangular torque: its largest value",
        "Asgari eq. 25", "torque_max",
    ),
    _of_triangle(
        "triangle_torque_mean", "T_{Mean}", "N m", "triangular torque: mean of the cycle",
        "Asgari eq. 26", "torque_mean",
    ),
    _of_triangle(
        "triangle_torque_excess", "T_{Ex}", "N m", "triangular torque: maximum above the mean",
        "Asgari eq. 27", "torque_excess",
    ),
    _of_triangle(
        "triangle_base", "DE", "rad", "triangular torque: angle over which it is above the mean",
        "Asgari eq. 28", "base",
    ),
    _of_triangle(
        "triangle_energy_swing", r"\Delta E", "J", "triangular torque: work above the mean",
        "Asgari eq. 29", "energy_swing",
    ),
    _of_triangle(
        "inertia_triangular", r"\Theta_\triangle", "kg m2",
        "inertia for the wanted delta from the triangular torque", "Asgari eq. 30", "inertia",
    ),
    Node(
        "excess_energy", "E", "J",
        "work of torque less load since the cycle's mean, which the moment of inertia takes up",
        _ENERGY, kind="curve",
        make=lambda torque, load_over_angle, crank_angle: flywheel.excess_energy(
            flywheel.net_torque(torque, load_over_angle), _step(crank_angle)
        ),
    ),
    Node(
        "crossing_angle", r"\varphi_c", "degree",
        "crank angle at which the torque crosses the load, both about their means",
        _ENERGY, si=DEGREE, adds=("crossing",), removes=("crank_angle",),
        make=_crossing(0), width=8 * flywheel.MOST_CROSSINGS,
    ),
    Node(
        "crossing_energy", "E_c", "J", "excess energy where the torque crosses the load",
        _ENERGY, adds=("crossing",), removes=("crank_angle",),
        make=_crossing(1), width=8 * flywheel.MOST_CROSSINGS,
    ),
    Node(
        "energy_fluctuation", "C_E", "1",
        "coefficient of fluctuation of energy, energy swing over the work of a cycle",
        _ENERGY, make=lambda energy_swing, torque_mean, period: quotient(
            energy_swing, np.abs(torque_mean) * period
        ),
    ),
    Node(
        "delta_energy_swing", r"\delta_W", "1",
        "coefficient of speed fluctuation from the energy swing, E/(inertia omega^2)",
        _ENERGY, make=_delta_of_swing,
    ),
    Node(
        "swing_of_energy_fluctuation", r"\Delta E_C", "J",
        "energy swing from a given coefficient of fluctuation of energy and the rated power",
        _ENERGY, make=lambda given_energy_fluctuation, rated_power, speed, period:
        given_energy_fluctuation * rated_power * period / speed,
    ),
    *(
        node
        for swing, name, about in (
            ("given_energy_swing", "given_swing", "a given energy swing"),
            ("swing_of_energy_fluctuation", "energy_fluctuation",
             "a given coefficient of fluctuation of energy"),
        )
        for node in _of_swing(swing, name, about)
    ),
    Node(
        "inertia_energy_swing", r"\Theta_W", "kg m2",
        "inertia for the wanted delta from the energy swing of the torque",
        "Asgari eq. 30 with the real torque",
        **formula(flywheel.energy_swing_inertia, "energy_swing", "wanted_delta", "speed"),
    ),
    Node(
        "inertia_required", r"\Theta_w", "kg m2",
        "inertia of engine and load that gives exactly the wanted delta",
        "Kakaitsas section 3.2.2", needs=("inertia_search",),
    ),
    Node(
        "search_status", "", "1", "outcome of the search for the inertia", public=False,
        needs=("inertia_search",),
    ),
    Node(
        "inertia_triangular_error", r"\Theta_\triangle/\Theta_w-1", "1",
        "relative error of the inertia from the triangular torque", "this project",
        make=lambda inertia_triangular, inertia_required: inertia_triangular / inertia_required
        - 1.0,
    ),
    Node(
        "inertia_energy_swing_error", r"\Theta_W/\Theta_w-1", "1",
        "relative error of the inertia from the energy swing", "this project",
        make=lambda inertia_energy_swing, inertia_required: inertia_energy_swing
        / inertia_required - 1.0,
    ),
    *(
        # Where a torque is given in place of pressures, the masses of the running gear are unknown.
        Node(
            "flywheel_inertia_required", r"\Theta_{fl}", "kg m2",
            "flywheel inertia needed for the wanted delta, in addition to running gear, "
            "auxiliaries and load (of a given torque, with the running gear), 0 if none is needed",
            "Kakaitsas sections 3.2, 3.2.2", when=when,
            needs=("inertia_required", "auxiliary_inertia", "inertia_beyond_gear", *gear),
            make=_flywheel_required,
        )
        for when, gear in (("by_pressure", ("engine_inertia",)), ("by_torque", ()))
    ),
    *variants(
        Node(*_SIZED, public=False),
        {
            "wanted_delta": lambda flywheel_inertia_required: flywheel_inertia_required,
            "given_inertia inertia_in_parts": lambda flywheel_inertia: flywheel_inertia,
        },
    ),
    # Of an inertia that is given as one number, or by the discs of a shaft, the flywheel's share is
    # unknown: scenes that need it are refused.
    *(
        Node(*_SIZED, public=False, when=f"given_inertia {when}", kind="parameter")
        for when in ("inertia_whole", "inertia_of_shaft")
    ),
    Node(
        "inertia_share", "I_F/I_T", "1",
        "share of the flywheel in the inertia of all rotating parts of the engine, usually 0.8 to "
        "0.9",
        "Asgari eq. 18",
        make=lambda sized_flywheel_inertia, inertia, inertia_beyond_gear: sized_flywheel_inertia
        / (inertia - inertia_beyond_gear),
    ),
    _verdict(
        "inertia_share_verdict", r"\chi_I",
        "whether the flywheel's share of the inertia is 0.8 to 0.9", "Asgari eq. 18",
        ("inertia_share",),
        lambda inertia_share: flywheel.verdict(inertia_share, *flywheel.SHARE_OF_INERTIA),
    ),
    Node(
        "flywheel_mass", "M_f", "kg",
        "mass of a ring with the inertia of the flywheel, given or required", "Asgari eq. 31",
        **formula(flywheel.ring_mass, "sized_flywheel_inertia", "flywheel_outer_diameter",
                  "flywheel_inner_diameter"),
    ),
    Node(
        "flywheel_thickness", "b_f", "m", "thickness of the flywheel's ring along the shaft",
        "Asgari, after eq. 31",
        **formula(flywheel.ring_thickness, "flywheel_mass", "flywheel_outer_diameter",
                  "flywheel_inner_diameter", "flywheel_density"),
    ),
    Node(
        "rim_speed_at_stress_limit", r"v_\sigma", "m s-1",
        "largest speed of the rim's mean diameter, at the allowed hoop stress of a thin rim",
        _ENERGY, **formula(flywheel.rim_speed_at_stress, "rim_stress_limit", "flywheel_density"),
    ),
    Node(
        "rim_largest_diameter", r"D_\sigma", "m",
        "largest mean diameter of the flywheel's rim, at the allowed hoop stress", _ENERGY,
        **formula(flywheel.largest_diameter, "rim_speed_at_stress_limit", "speed"),
    ),
    Node(
        "rim_stress", r"\sigma_r", "MPa", "hoop stress of the flywheel's rim at nominal speed",
        _ENERGY, si=MPA,
        **formula(flywheel.rim_stress, "rim_mean_diameter", "speed", "flywheel_density"),
    ),
    Node(
        "rim_mass", "m_r", "kg",
        "mass of the flywheel's rim with its share of the inertia of the flywheel, given or "
        "required",
        _ENERGY,
        make=lambda rim_inertia_share, sized_flywheel_inertia, rim_mean_diameter: flywheel.rim_mass(
            rim_inertia_share * sized_flywheel_inertia, rim_mean_diameter
        ),
    ),
    Node(
        "rim_thickness", "t_r", "m", "radial thickness of the flywheel's rim", _ENERGY,
        **formula(flywheel.rim_thickness, "rim_mass", "rim_mean_diameter", "flywheel_density",
                  "rim_width_over_thickness"),
    ),
    Node(
        "rim_width", "b_r", "m", "width of the flywheel's rim along the shaft", _ENERGY,
        make=lambda rim_thickness, rim_width_over_thickness: rim_width_over_thickness
        * rim_thickness,
    ),
)  # fmt: skip
