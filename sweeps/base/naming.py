"""What variables of archives are called: `long_name`, and `description` where that says more.

The `long_name` is what plots of xarray write beside an axis, with the unit in brackets and in lines
of 30 letters. Beside the ticks of a default figure there is room for one such line. What a name
leaves out is in the attribute `description`, which tables, reports and our own figures show.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

LONGEST_NAME = 30
"""Letters of a long name with a space and its unit in brackets."""

DESCRIPTION = "description"
"""Attribute with the whole meaning of a variable whose `long_name` does not say all of it."""

_SHORT = {
    "angle_deviation_electrical": "el. angle deviation",
    "angle_deviation_electrical_half_range": "el. angle half range",
    "angle_deviation_electrical_largest": "el. angle, either way",
    "angle_deviation_electrical_max": "largest el. angle",
    "angle_deviation_electrical_mean": "mean el. angle",
    "angle_deviation_electrical_min": "smallest el. angle",
    "angle_deviation_electrical_order": "el. angle orders",
    "angle_deviation_electrical_rms": "el. angle rms",
    "any_main_journal_load_max": "largest load, any journal",
    "bay_bending_moment_cycle_max": "bay moment in the cycle",
    "bore_N": "bore of cylinder N",
    "counterweight_fraction": "balance fraction",
    "crank_mass": "mass of each throw",
    "crank_pin_radial": "radial crank-pin load",
    "crank_pin_tangential": "tangential crank-pin load",
    "crank_pin_x": "crank-pin load x",
    "crank_pin_y": "crank-pin load y",
    "crankshaft_twist_half_range": "half crankshaft twist",
    "cycle_delta": "fluctuation in each cycle",
    "cylinder_gravity_torque_phase": "cyl. gravity phase",
    "cylinder_inertia_torque_phase": "cyl. inertia phase",
    "delta": "speed fluctuation",
    "delta_elastic": "elastic speed fluctuation",
    "delta_energy_swing": "delta from energy swing",
    "delta_error": "error of speed fluctuation",
    "delta_midrange": "fluctuation over mid-range",
    "delta_of_given_swing": "delta from given swing",
    "disc_damping_N": "disc N damping",
    "disc_ground_stiffness_N": "spring of disc N",
    "firing_angle_N": "firing angle, cyl. N",
    "friction_mean_piston_speed": "fmep per speed",
    "friction_mean_piston_speed_square": "fmep per speed^2",
    "governor_highest_command": "highest command",
    "governor_lowest_command": "lowest command",
    "grid_angle_electrical_half_range": "el. grid half range",
    "grid_angle_electrical_mean": "mean el. grid angle",
    "grid_angle_electrical_order": "el. grid angle orders",
    "grid_angle_electrical_rms": "el. grid angle rms",
    "heat": "heat over swept volume",
    "inertia": "moment of inertia",
    "inertia_model": "inertia model",
    "inertia_of_energy_fluctuation": "inertia from fluct.",
    "inertia_piston_pressure_mean": "mean inertia pist. pr.",
    "inertia_tangential_pressure_mean": "mean inertia tang. pr.",
    "instantaneous_engine_inertia_mean": "mean of engine inertia",
    "iterations": "cycles or iterations",
    "load_factor": "load coefficient factor",
    "load_linear": "linear load term",
    "load_square": "square load term",
    "main_journal_radial": "radial journal load",
    "main_journal_tangential": "tangential journal load",
    "main_journal_x": "main-journal load x",
    "main_journal_y": "main-journal load y",
    "mass_factor_N": "mass factor of cylinder N",
    "omega": "crank speed",
    "omega_mean": "mean crank speed",
    "omega_start": "crank speed at start",
    "passes": "cycles to compute",
    "pendulum_swing_half_range": "half pendulum swing",
    "piston_pin_down": "piston-pin load down",
    "piston_pin_side": "piston-pin load to a side",
    "position": "reduced piston travel",
    "position_coefficient": "piston travel coefficient",
    "position_mean": "mean of reduced travel",
    "position_truncated": "piston travel, truncated",
    "position_truncation_error": "error of truncated travel",
    "pressure_factor_N": "pressure factor, cyl. N",
    "propulsion_stress_limit_passing": "prop. limit in passing",
    "radius_factor_N": "crank radius, cylinder N",
    "rim_speed_at_stress_limit": "rim speed at limit",
    "shaft_friction_stiffness_N": "stick stiffn. N",
    "shaft_stress_in_passing_over_limit": "stress in passing/limit",
    "shaft_stress_limit_in_passing": "stress limit in passing",
    "shaft_tensile_strength_N": "tensile strength N",
    "shaft_transient_stress_limit_N": "transient limit N",
    "shaft_twist_half_range": "half range of twist",
    "transient_boost_margin": "boost margin",
    "transient_command_angle": "command angle",
    "transient_recovery_band": "recovery band",
    "transient_start_command": "start command",
    "truncation": "highest order kept",
}
"""Names by key or quantity where its own words are too long or say too little; N is a number."""

_FIRST = {"max": "largest", "min": "smallest", "mean": "mean", "required": "required"}
"""Last words of names that stand first in ordinary words."""

_ABBREVIATED = {
    "instantaneous": "inst.", "reciprocating": "recip.", "overturning": "overt.",
    "acceleration": "accel.", "inclination": "incl.", "synchronising": "sync.",
    "compression": "compr.", "fluctuation": "fluct.", "truncation": "trunc.",
    "tangential": "tang.", "propulsion": "prop.", "geometric": "geom.", "truncated": "trunc.",
    "crankshaft": "crank", "deviation": "dev.", "diameter": "diam.", "pendulum": "pend.",
    "stiffness": "stiffn.", "resistance": "res.", "velocity": "vel.", "friction": "frict.",
    "pressure": "press.", "crosshead": "crossh.", "combined": "comb.",
    "required": "req.", "cylinder": "cyl.",
    "bending": "bend.", "journal": "jnl.", "angular": "ang.", "flywheel": "flyw.",
    "reduced": "red.", "second": "2nd", "moment": "mom.", "torque": "torq.", "first": "1st",
    "smallest": "min.", "largest": "max.", "engine": "eng.", "piston": "pist.", "radial": "rad.",
    "actual": "act.",
}  # fmt: skip
"""Abbreviations of words, in the order in which they are made until a name is short enough."""


def named(name: str, meaning: str, unit: str | None = "1") -> dict[str, str]:
    """Return the attributes that say what a variable is.

    Parameters
    ----------
    name : str
        Name of the variable.
    meaning : str
        One line of explanation.
    unit : str, optional
        Its unit, which plots write behind the long name; None for none.

    Returns
    -------
    dict of str
        `long_name`, and `description` where the long name is not the whole meaning.

    Examples
    --------
    >>> named("torque_mean", "mean brake torque over the cycle", "N m")
    {'long_name': 'mean torque', 'description': 'mean brake torque over the cycle'}
    >>> named("bore", "cylinder bore", "m")
    {'long_name': 'cylinder bore'}
    """
    label = _long_name(name, meaning, "" if unit is None else f" [{unit}]")
    return {"long_name": label} | ({} if label == meaning else {DESCRIPTION: meaning})


def meaning_of(attributes: Mapping[str, Any], name: str = "") -> str:
    """One line that says what a variable is: its description, else its long name, else its name."""
    # In foreign files they may also be numbers or lists of them
    texts = (attributes.get(DESCRIPTION), attributes.get("long_name"))
    return next((text for text in texts if isinstance(text, str) and text), name)


def renamed(attributes: Mapping[str, Any], text: str) -> dict[str, Any]:
    """Attributes of what is made from a variable: `text` has {} where the variable is named."""
    names = {key: text.format(attributes[key]) for key in ("long_name", DESCRIPTION)
             if key in attributes}  # fmt: skip
    return {**attributes, **names}


def made_from(attributes: Mapping[str, Any], text: str, unit: str = "1") -> dict[str, Any]:
    """Names and unit alone of what is made from a variable, as `renamed` gives them."""
    kept = {key: attributes[key] for key in ("long_name", DESCRIPTION) if key in attributes}
    return {**renamed(kept, text), "units": unit}


def _long_name(name: str, meaning: str, unit: str) -> str:
    room = LONGEST_NAME - len(unit)
    number = re.search(r"(?<=_)[0-9]+\Z", name)
    pattern = name if number is None else f"{name[: number.start()]}N"
    short = _SHORT.get(pattern)
    if short is not None:
        return short if number is None else short.replace("N", number[0])
    if len(meaning) <= room:
        return meaning
    words = name.split("_")
    if words[-1] in _FIRST and len(words) > 1:
        words = [_FIRST[words[-1]], *words[:-1]]
    for word, abbreviated in _ABBREVIATED.items():
        if len(" ".join(words)) <= room:
            break
        words = [abbreviated if one == word else one for one in words]
    return " ".join(words)
