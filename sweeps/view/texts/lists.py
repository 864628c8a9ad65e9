"""Lists searched by words; quantities by subject, found by the words that people have for them."""

from __future__ import annotations

import difflib
import re
import tomllib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from engine_dyn.quantities import (
    balance,
    bearing_loads,
    each_cylinder,
    flywheels,
    friction,
    generator,
    loads,
    mechanism_forces,
    orders,
    pressure,
    running_gear,
    speed,
    torque,
)
from engine_dyn.quantities.features import FEATURES
from engine_dyn.quantities.graph import (
    ALL_QUANTITIES,
    CURVE_MEANS,
    DIMENSIONS,
    NODES,
    NUMBERED,
    PARAMETERS,
    PATTERNS,
    QUANTITIES,
    SOURCES,
)
from engine_dyn.quantities.node import Node
from sweeps.base.errors import SceneError, shown
from sweeps.base.ratios import ratio_text
from sweeps.scene.axes import WORD_KEYS
from sweeps.scene.engine.cylinder_keys import CYLINDER_KEYS
from sweeps.scene.engine.engine_files import catalogue
from sweeps.scene.features import GIVEN_FEATURES, KEYS_OF_SET
from sweeps.scene.features.shaft import built_in_shafts
from sweeps.scene.reading import built_in_scenes
from sweeps.view.texts.key_texts import WORDS_OF_KEYS, key_line

SAME: tuple[tuple[str, ...], ...] = (
    ("piston pin", "gudgeon pin", "wrist pin", "small end", "gudgeon", "wrist"),
    ("connecting rod", "con rod", "conrod", "rod"),
    ("crank pin", "crankpin", "big end"),
    ("main journal", "main bearing"),
)
"""Groups of words for one thing: each finds texts with any of them. Longer words come first."""

_NAMES = tuple((re.compile(rf"\b(?:{'|'.join(n)})s?\b"), n[0].replace(" ", "")) for n in SAME)
"""Patterns of the words for each thing, and the word that stands for all of them."""


@dataclass(frozen=True)
class Found:
    """Names that words lead to, one that is exactly what was typed first."""

    names: list[str]
    note: str = ""  # Remark on a word without results, and the word that was searched in its place


def named_by(words: str, texts: Mapping[str, str]) -> list[str]:
    """Return the names in a list that words lead to, one that is exactly what was typed first.

    Each word must begin a word of the name or of its text; no words find all.
    """
    parts = _typed(words)
    names = [name for name, text in _searched(texts).items() if _begin(parts, text)]
    return sorted(names, key=lambda name: not same_words(name, words))


def same_words(name: str, words: str) -> bool:
    """Whether words are a name, written with underscores, hyphens or blanks."""
    return _plain(name) == _plain(words)


def matching_lines(words: str, texts: Mapping[str, str], of: str) -> Found:
    """Return what `named_by` finds in a list; where that is nothing, what near spellings find.

    Where nothing is found, SceneError names the list as the command does, by `of`.
    """
    names = named_by(words, texts)
    if names:
        return Found(names)
    known = {part for text in _searched(texts).values() for part in text.split()}
    near = {part: _nearest(part, known) for part in _typed(words)}
    if all(near.values()):
        names = named_by(" ".join(near.values()), texts)
    if not names:
        each = {name: None for part in near for name in named_by(part, texts)}
        if each and all(near.values()):
            return Found([*each], "nothing has all of these words; what has one of them:")
    if not names:
        raise SceneError(f"list {of} {shown(words)}: nothing found; engine-dyn list {of} lists all")
    said = "; ".join(
        f"nothing found for '{part}'; did you mean '{meant}'?"
        for part, meant in near.items()
        if part != meant
    )
    return Found(names, f"{said} This is what that finds:")


def _plain(text: str) -> str:
    """Words in small letters with single blanks between them."""
    return " ".join(re.findall(r"[^\W_]+", text.lower()))


def _typed(words: str) -> list[str]:
    """Words of a search: a name of several words becomes one word."""
    text = _plain(words)
    for names, word in _NAMES:
        text = names.sub(word, text)
    return text.split()


def _searched(texts: Mapping[str, str]) -> dict[str, str]:
    """Each name with the text to search: its own, and all other words for the same things."""
    searched = {name: _plain(f"{name} {text}") for name, text in texts.items()}
    for name, text in searched.items():
        for (names, word), same in zip(_NAMES, SAME, strict=True):
            if names.search(text):
                searched[name] += f" {word} {' '.join(same)}"
    return searched


def _nearest(part: str, known: Iterable[str]) -> str:
    """The word itself where it begins a known one, otherwise the nearest; empty without any."""
    if any(one.startswith(part) for one in known):
        return part
    return next(iter(difflib.get_close_matches(part, known, n=1, cutoff=0.75)), "")


def _begin(parts: Iterable[str], text: str) -> bool:
    """Whether each part begins a word of a text."""
    return all(f" {part}" in f" {text}" for part in parts)


_SUBJECTS: dict[str, Iterable[Node]] = {
    "crank speed": speed.NODES,
    "torque": torque.NODES,
    "load and driver": loads.NODES,
    "pressure, work and power": pressure.NODES,
    "friction": friction.NODES,
    "flywheel": flywheels.NODES,
    "orders": orders.NODES,
    "torsional vibration of the shaft": (),
    "generator: angle, grid and times in the cycle": generator.NODES,
    "balance": balance.NODES,
    "motion and masses of the running gear": (*running_gear.NODES, *each_cylinder.MOTION),
    "forces in one cylinder": mechanism_forces.NODES,
    "bearing loads": bearing_loads.NODES,
    "speed characteristic": (),
    "transients": (),
    "truncated series": orders.SERIES_NODES,
}
SUBJECTS: Mapping[str, Iterable[Node]] = {
    subject: (
        *nodes,
        *(n for one in FEATURES if one.subject == subject for n in one.nodes if n.name != "status"),
    )
    for subject, nodes in _SUBJECTS.items()
}
"""Quantities by subject; the outcome of all designs is one of the speed."""

OF_CURVES = "axes of curves, which come with them and cannot be asked for"
"""Subject of axes of curves; like means of curves, they are listed only if words lead to them."""

AXES: Mapping[str, Node] = {
    name: NODES[name][0] for name, dimension in DIMENSIONS.items() if dimension.public
}
"""Axes of quantities that are no axes of scenes."""

OTHER_WORDS: Mapping[str, str] = {
    "delta": "cyclic irregularity, degree of irregularity, speed irregularity, non-uniformity, "
    "coefficient of fluctuation of speed, cyclic speed variation, uniformity, evenness of running",
    "delta_midrange": "cyclic irregularity, degree of irregularity, mid-range",
    "omega": "angular velocity, instantaneous speed, crankshaft speed, rpm over angle",
    "omega_mean": "mean angular velocity, mean rpm",
    "angular_acceleration": "crankshaft acceleration",
    "torque": "turning moment, crank effort, turning effort, instantaneous torque",
    "torque_mean": "mean turning moment, brake torque, shaft torque, engine torque",
    "torque_irregularity": "torque fluctuation, torque ripple, unevenness of the torque",
    "torque_irregularity_brake": "torque fluctuation, torque ripple",
    "energy_swing": "fluctuation of energy, excess energy, excess work, coefficient of fluctuation "
    "of energy",
    "brake_power": "output, shaft power, effective power, kW, horsepower",
    "bmep": "brake mean effective pressure, BMEP",
    "imep": "indicated mean effective pressure, IMEP",
    "fmep": "friction mean effective pressure, FMEP",
    "fmep_components": "friction breakdown, loss categories, rubbing friction",
    "fmep_rings": "piston assembly friction",
    "fmep_skirt": "piston assembly friction",
    "fmep_valve_train": "camshaft, cam follower, valve gear",
    "fmep_auxiliaries": "accessories, oil pump, water pump, alternator",
    "fmep_crank_pin_bearings": "big end bearing, conrod bearing",
    "peak_pressure": "firing pressure, maximum cylinder pressure, p max",
    "pressure": "cylinder pressure, indicator diagram, indicated pressure",
    "mechanical_efficiency": "friction losses",
    "displacement": "swept volume, cubic capacity",
    "inertia_required": "flywheel sizing, moment of inertia wanted, flywheel size, GD2",
    "flywheel_inertia_required": "flywheel sizing, flywheel size, GD2",
    "flywheel_mass": "weight of the flywheel",
    "flywheel_shaft_torque": "torque on the flywheel, twisting torque, torsion of the crankshaft",
    "load_shaft_torque": "twisting torque, torsion, coupling torque, torque on the generator",
    "load_torque": "resisting torque, driven machine, brake",
    "load_coefficient": "propeller law, load constant",
    "wall_thrust": "side thrust, side force, lateral force, piston side force, normal force",
    "rod_force": "connecting rod force, conrod force",
    "piston_force": "gudgeon force",
    "gas_force": "gas load, rod load",
    "combined_rod_load": "rod load, API 618",
    "rod_load_reversal": "rod reversal, API 618",
    "piston_pin_load": "gudgeon pin, wrist pin, small end bearing",
    "piston_pin_load_max": "gudgeon pin, wrist pin, small end bearing",
    "crank_pin_load": "big end bearing, conrod bearing, polar bearing load",
    "crank_pin_load_max": "big end bearing, conrod bearing",
    "main_journal_load": "main bearing, crankshaft bearing, polar bearing load",
    "main_journal_load_max": "main bearing, crankshaft bearing",
    "crank_pin_pressure_max": "specific bearing load, unit load, big end bearing",
    "main_journal_pressure_max": "specific bearing load, unit load, main bearing",
    "piston_pin_pressure_max": "specific bearing load, unit load, small end bearing, wrist pin",
    "shaking_moment": "free moment, unbalanced moment, rocking couple, pitching moment",
    **{name: words for feature in FEATURES for name, words in feature.called.items()},
    "overturning_moment": "torque reaction, rolling moment, guide force moment, roll",
    "counterweight_required": "balance weight, crank balancing",
    "balance_shaft_required": "Lanchester balancer, counter-rotating shaft",
    "torque_order": "harmonics, Fourier coefficients, harmonic analysis, excitation, half orders",
    "natural_frequency": "eigenfrequency, resonance, torsional frequency, Holzer",
    "damped_natural_frequency": "complex eigenvalue, complex mode, resonance with a damper",
    "damping_ratio": "complex eigenvalue, damper, decay, Lehr",
    "critical_speed": "resonance, Campbell diagram, barred speed",
    "shaft_torque_half_range": "vibratory torque, alternating torque, coupling torque",
    "shaft_stress_half_range": "vibratory stress, torsional stress, class rules",
    "disc_angle_half_range": "torsional amplitude, free-end amplitude, pulley amplitude",
    "shaft_twist_half_range": "coupling twist, damper twist, wind-up",
    "shaft_torque_min": "torque reversal, gear hammer, coupling separation",
    "shaft_loss": "damper heat, coupling heat, dissipated power",
    "angle_deviation": "angular deviation, cyclic deviation, electrical degrees, flicker",
    "angle_deviation_electrical_largest": "angular deviation, electrical degrees, parallel running",
    "grid_natural_frequency": "hunting, swing frequency, generator in parallel, synchronizing",
    "grid_amplification": "resonance module, magnification, hunting",
    "grid_angle_electrical_half_range": "hunting, load angle, rotor angle, electrical degrees",
    "grid_power_half_range": "hunting, power oscillation, power pulsation, swing",
    "interval_duration": "phase duration, time between angles",
    "phase_vector_sum": "vector sum, phase diagram, star diagram",
    "position": "piston displacement, piston travel, stroke over angle",
    "velocity": "piston speed over angle",
    "mean_piston_speed": "piston speed",
    "rod_angle": "obliquity, connecting rod angle",
    "status": "convergence, failure",
}
"""Other names of quantities; the search covers name and meaning too."""


def matching_quantities(words: str) -> tuple[dict[str, list[Node]], str]:
    """Return quantities by subject that words lead to, and a note on what was not found.

    Each word must begin a word of a quantity's name, meaning, source or other names; no words find
    all. Where none has them all, or `rms` is one of them, root mean squares and means of curves are
    searched too; then near spellings count. What has exactly this name comes first. SceneError if
    nothing is found.
    """
    texts, note = _texts(QUANTITIES if not words else {**QUANTITIES, **AXES}), ""
    parts = words.lower().replace("_", " ").split()
    names = named_by(words, texts)
    if not names or ("rms" in parts and len(parts) > 1):
        names += named_by(words, _texts(CURVE_MEANS))
    if not names:
        matches = matching_lines(words, texts, "quantities")
        names, note = matches.names, matches.note
    known = {**ALL_QUANTITIES, **AXES}
    subjects = {
        **SUBJECTS,
        OF_CURVES: AXES.values(),
        "root mean squares and means of curves over the cycle": CURVE_MEANS.values(),
    }
    groups = {
        subject: sorted(
            {n.name: known[n.name] for n in nodes if n.name in names}.values(),
            key=lambda node: (not same_words(node.name, words), node.name),
        )
        for subject, nodes in subjects.items()
    }
    filled = [(subject, nodes) for subject, nodes in groups.items() if nodes]
    return dict(sorted(filled, key=lambda one: not same_words(one[1][0].name, words))), note


def _texts(quantities: Mapping[str, Node]) -> dict[str, str]:
    """Texts that quantities are found by, besides their names."""
    return {
        name: f"{node.long_name} {node.source} "
        + (OF_CURVES if name in AXES else OTHER_WORDS.get(name, ""))
        for name, node in quantities.items()
    }


Lines = list[tuple[str, str]]


def symbol_text(symbol: str) -> str:
    r"""Write a symbol of TeX in plain letters: ``\beta_\nu`` becomes beta_nu, ``M_{max}`` M_max."""
    text = symbol.replace(r"\var", "\\")  # A variant of a letter has the name of the letter
    text = text.replace("^*", "*")
    # A blank separates the name of a sign from a letter, digit or brace before it.
    text = re.sub(r"(?<=[A-Za-z0-9}])\\", " ", text)
    text = re.sub(r"\^\{([^{}]*)\}", r"^(\1)", text)
    return re.sub(r"[\\{}]", "", text)


def quantity_lines(words: str = "") -> list[str]:
    """Lines of the quantities that words lead to, grouped by subject; without words of all."""
    groups, note = matching_quantities(words)
    width = max(len(node.name) for nodes in groups.values() for node in nodes)
    lines: list[str] = [f"# {note}"] if note else []
    for subject, nodes in groups.items():
        lines += ["", f"# {subject}"] if lines else [f"# {subject}"]
        for node in nodes:
            # The unit of the load coefficient depends on the load exponent, so that the table has
            # none.
            unit = node.unit or "unit follows the load exponent"
            symbol = f", {symbol_text(node.symbol)}" if node.symbol else ""
            source = f" ({node.source})" if node.source else ""
            lines.append(f"{node.name:<{width}}  [{unit}] {node.long_name}{symbol}{source}")
    if not words:
        lines += ["", "# full citations of the sources in brackets: engine-dyn list sources"]
        lines += ["# axes of curves, such as order: engine-dyn list quantities axes of curves"]
        lines += ["# and of every curve over crank_angle its <curve>_rms and <curve>_mean"]
    return lines


def _keys() -> Lines:
    nodes = {k: node for k, node in PARAMETERS.items() if k not in NUMBERED} | dict(PATTERNS)
    keys = [(key, key_line(node)) for key, node in nodes.items()]
    others = {**CYLINDER_KEYS, **{k: w.says for k, w in WORD_KEYS.items() if w.read is not None}}
    of_set = ((key, one.says) for key, one in KEYS_OF_SET.items())
    tables = ((n, f"{one.written}: {one.says}") for n, one in GIVEN_FEATURES.items() if not one.key)
    return [*keys, *others.items(), *of_set, *tables]


def _classes() -> Lines:
    thesis, lecture = "Kakaitsas (2015), section 3.2.1", "Power units, lecture 18"
    return [
        (name, f"delta {ratio_text(limit)} ({lecture if 'road' in name else thesis})")
        for name, limit in PARAMETERS["wanted_delta"].named
    ]


def _titles(files: Mapping[str, Path]) -> Lines:
    """Titles of built-in files, read as TOML only, because reading an engine models its cycles."""
    return [
        (name, tomllib.loads(path.read_text(encoding="utf-8"))["title"])
        for name, path in files.items()
    ]


LISTS: dict[str, Callable[[], Lines]] = {
    "engines": lambda: _titles(catalogue()),
    "scenes": lambda: _titles(built_in_scenes()),
    "shafts": lambda: _titles(built_in_shafts()),
    "keys": _keys,
    "classes": _classes,
    "sources": lambda: list(SOURCES.items()),
}
"""Lists of `engine-dyn list` besides quantities, with the functions that make their lines."""


def list_lines(of: str, words: str = "") -> list[str]:
    """Lines of one of `LISTS` that words lead to; without words of all."""
    lines = dict(LISTS[of]())
    more = WORDS_OF_KEYS if of == "keys" else {}
    matches = matching_lines(
        words, {n: f"{text} {more.get(n, '')}" for n, text in lines.items()}, of
    )
    width = max(len(name) for name in matches.names)
    told = [f"# {matches.note}"] if matches.note else []
    return [*told, *(f"{name:<{width}}  {lines[name]}" for name in matches.names)]
