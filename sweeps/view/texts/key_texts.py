"""Texts about keys of scenes: other names, values that are allowed, defaults."""

from __future__ import annotations

from collections.abc import Mapping

from engine_dyn.quantities.graph import PARAMETERS
from engine_dyn.quantities.node import Node
from sweeps.base.checks import allowed

WORDS_OF_KEYS: Mapping[str, str] = {
    "reciprocating_mass": "oscillating mass",
    "inertia": "mass moment of inertia, GD2",
    "auxiliary_inertia": "accessories, ancillaries",
    "auxiliary_torque": "accessories, ancillaries",
    "gear_ratio": "transmission ratio, speed ratio",
    "motor_gear_ratio": "transmission ratio, speed ratio",
    "crank_ratio": "rod ratio (some authors mean the inverse l/r)",
    "rod_length": "con-rod length, conrod length",
    "bore": "cylinder diameter",
    "stroke": "piston travel (as a length)",
    "pin_offset": "désaxé, gudgeon-pin offset, wrist-pin offset",
    "crank_offset": "désaxé, crankshaft offset",
    "speed": "rpm, rated speed, mean speed (approximately)",
    "load": "load level, operating point",
    "misfire": "motored cylinder, cut-off cylinder",
    "load_offset": "constant load",
    "crankcase_pressure": "back pressure",
    "counterweight_fraction": "balance weight",
    "counterweight_mass": "balance weight",
    "balance_shaft_mass": "Lanchester shaft, counter-rotating balancer",
    "second_shaft_mass": "Lanchester shaft, counter-rotating balancer",
    "wanted_delta": "required irregularity, degree of irregularity",
    "friction_law": "friction breakdown, loss categories",
    "valve_train": "camshaft, valve gear",
    "crank_pin_diameter": "big-end journal",
    "crank_pin_width": "big-end bearing",
    "pole_pairs": "half the number of poles",
    "synchronising_torque": "synchronizing torque, stiffness of the grid",
    "synchronising_power": "synchronizing power",
    "damping_torque": "asynchronous torque, damper winding",
    "piston_pin_diameter": "gudgeon pin, wrist pin",
    "piston_pin_width": "small-end bearing",
    "main_journal_diameter": "main bearing",
}
"""Other names of keys; the search covers name and meaning of a key too."""


def unit_text(unit: str) -> str:
    """Return a blank and a unit in brackets, empty for numbers without one."""
    return f" [{unit}]" if unit not in ("", "1") else ""


def values_text(node: Node, quote: str = "") -> str:
    """Return which values a key may have, with the names of values, each between two quotes."""
    names = [f"{quote}{name}{quote}" for name, _ in node.named]
    if node.whole and names:
        return f"one of {', '.join(names)}"
    rule = allowed(node)
    if not names:
        return rule
    listed = f" such as {names[0]}" if len(names) > 7 else f": {', '.join(names)}"
    return f"{rule}, or a name{listed}"


def default_text(node: Node) -> str:
    """Return the value that holds where neither scene nor engine gives one; empty if none does."""
    given = node.unless_given
    # A neutral value outside the range of the key means that it has no default.
    if given is None or not (
        node.low < given < node.high or (given == node.low and node.low_included)
    ):
        return ""
    return value_text(node, given)


def value_text(node: Node, value: float, digits: int = 6) -> str:
    """Return a value of a key: the name of a number that stands for one, else the number."""
    words = {number: name for name, number in node.named} if node.whole else {}
    return words.get(value, f"{value:.{digits}g}")


def with_word(key: str, value: object) -> object:
    """Return the word that a number of a key stands for, with the number; other values as they are.

    A name in an archive need not be that of a key.
    """
    node = PARAMETERS.get(key)
    if node is None or not (node.whole and node.named) or not isinstance(value, int | float):
        return value
    return f"{value_text(node, value)} ({value:g})"


def key_line(node: Node) -> str:
    """Return what a key means, its values and its default, on one line."""
    default = default_text(node)
    return f"{node.long_name}: {values_text(node)}{f'; default {default}' if default else ''}"
