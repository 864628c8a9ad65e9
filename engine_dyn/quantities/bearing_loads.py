"""Nodes of the bearing loads: see `engine_dyn.forces.bearings`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from engine_dyn.forces import bearings, torque
from engine_dyn.geometry import masses, slider_crank
from engine_dyn.geometry.arrangement import MOST_CYLINDERS
from engine_dyn.geometry.cylinders import even_cylinders
from engine_dyn.quantities.features.web_weights import (
    BENDING,
    OF_WEBS,
    bending_over_angle,
    crankshaft,
    on_journals,
)
from engine_dyn.quantities.node import Node, formula, hidden, parameter
from engine_dyn.units import DEGREE, MPA

NOTES = "Rakopoulos notes, bearing loads; derived here"

BEARINGS = {
    "crank_pin": ("crank pin", "C", "width of the bearing of one rod on the crank pin"),
    "main_journal": ("main journal", "H", "width of a main bearing"),
    "piston_pin": ("piston pin", "P", "width of the rod's bearing on the piston pin"),
}
"""Bearings, with the index of their loads' symbols and the part whose width counts."""

PARAMETERS = tuple(
    node
    for bearing, (text, index, width) in BEARINGS.items()
    for node in (
        parameter(
            f"{bearing}_diameter", f"D_{index}", "m", f"diameter of a {text}",
            "bearing pressure: load over diameter times width", low=0.0, high=3.0,
        ),
        parameter(
            f"{bearing}_width", f"B_{index}", "m", width,
            "bearing pressure: load over diameter times width", low=0.0, high=3.0,
        ),
    )
)  # fmt: skip

_COUNTED = ("cylinder_set", "cylinders_by_count")
_RODS = ("rod_mass", "rod_centre_of_gravity", "rod")
_UNBALANCE = ("journal_rod_mass", "journal_throw_mass")
_LOADED = (
    "crank_ratio", "offset_ratio", "family", "row", "pressure_scale", "crankcase_pressure", "bore",
    "double_radius", "reciprocating_mass", "speed", "period", "curve_period",
)  # fmt: skip


def _factors(
    turning: Any, needs: dict[str, Any], throws: Any = 0.0, webs: Any = 0.0
) -> bearings.Factors:
    area = torque.piston_area(needs["bore"])
    centrifugal = 0.5 * needs["double_radius"] * needs["speed"] ** 2
    return bearings.Factors(
        needs["pressure_scale"] * area, needs["crankcase_pressure"] * area,
        needs["reciprocating_mass"] * centrifugal, turning * centrifugal, throws * centrifugal,
        np.real(webs) * needs["speed"] ** 2, np.imag(webs) * needs["speed"] ** 2,
    )  # fmt: skip


def _crank_pin_factors(needs: dict[str, Any]) -> bearings.Factors:
    return _factors(masses.rod_mass_at_crank(*(needs[name] for name in _RODS)), needs)


def _piston_pin_factors(needs: dict[str, Any]) -> bearings.Factors:
    return _factors(masses.rod_mass_at_piston(*(needs[name] for name in _RODS)), needs)


def _journal_factors(needs: dict[str, Any]) -> bearings.Factors:
    return _factors(
        needs["journal_rod_mass"], needs, needs["journal_throw_mass"],
        needs.get("journal_web_unbalance", 0.0),
    )  # fmt: skip


def _engines(needs: dict[str, Any]) -> tuple[Any, Any]:
    """Cylinders to take; for equal cylinders, one stands for any number of them."""
    if "cylinder_set" in needs:
        return needs["cylinder_set"], needs["cylinders_by_count"]
    return 1, {1: even_cylinders(1, needs["period"])}


def _pressure_nodes(bearing: str) -> list[Node]:
    """Nodes of a bearing's load over its projected area: over the angle, largest and mean."""
    text, index, _ = BEARINGS[bearing]
    of_first = "" if bearing == "main_journal" else ", cylinder 1"
    sizes = (f"{bearing}_diameter", f"{bearing}_width")

    def node(ending: str, symbol: str, long_name: str, kind: str = "value") -> Node:
        return Node(
            f"{bearing}_pressure{ending}", symbol, "MPa",
            f"{long_name} of the {text}'s bearing over its projected area{of_first}",
            "bearing pressure: load over diameter times width", si=MPA, kind=kind,
            **formula(bearings.bearing_pressure, f"{bearing}_load{ending}", *sizes),
        )  # fmt: skip

    return [
        node("", f"p_{index}", "load", "curve"),
        node("_max", f"p_{{{index},max}}", "largest load"),
        node("_mean", rf"\bar p_{index}", "mean magnitude of the load"),
    ]


def _load_nodes(
    load: str, text: str, letter: str, own: tuple[str, ...],
    factors: Callable[[dict[str, Any]], bearings.Factors], function: Any,
) -> list[Node]:  # fmt: skip
    def components(**needs: Any) -> Any:
        more = {"journals": needs["main_bearing"]} if load == "main_journal" else {}
        one, other = function(
            needs["crank_angle"], needs["crank_ratio"], needs["offset_ratio"], needs["family"],
            needs["row"], factors(needs), *_engines(needs), **more,
        )  # fmt: skip
        return one + 1j * other

    def make_extremes(threads: int | None = 1, **needs: Any) -> Any:
        return bearings.extremes(
            load, needs["crank_ratio"], needs["offset_ratio"], needs["family"], needs["row"],
            factors(needs), *_engines(needs), needs["curve_period"], needs.get("main_bearing", 1),
            threads,
        )  # fmt: skip

    whole, extreme = f"{load}_components", f"{load}_extremes"
    variants: tuple[tuple[str, tuple[str, ...]], ...] = (("", _COUNTED),)
    if load != "main_journal":
        # With articulated rods, nodes of the same names in `each_cylinder` hold.
        plain = " plain_rods" if load == "crank_pin" else ""
        variants = ((f"equal{plain}", ()), (f"unequal{plain}", _COUNTED))
    made = [
        node
        for when, counted in variants
        for node in (
            hidden(whole, "N", f"components of the {text}",
                    components, (*_LOADED, *own, *counted, "crank_angle"), kind="curve", when=when,
                    width=80),
            hidden(extreme, "N", f"extremes of the {text}", make_extremes,
                    (*_LOADED, *own, *counted), when=when, width=bearings.EXTREMES.itemsize,
                    threaded=True),
        )
    ]  # fmt: skip
    return [
        *made,
        Node(f"{load}_load", letter, "N", text, NOTES, kind="curve", needs=(whole,),
             make=lambda **needs: np.abs(needs[whole])),
        Node(f"{load}_load_max", rf"{letter[:-1]},max}}", "N", f"largest {text}", NOTES,
             extreme_of=(f"{load}_load", "largest"), needs=(extreme,),
             make=lambda **needs: needs[extreme]["peak"]),
        Node(f"{load}_load_mean", rf"\bar {letter}", "N",
             f"cycle mean of the magnitude of the {text}", NOTES, needs=(extreme,),
             make=lambda **needs: needs[extreme]["mean"]),
        Node(f"{load}_load_rms", rf"{letter[:-1]},rms}}", "N",
             f"root mean square of the {text}", NOTES, needs=(extreme,),
             make=lambda **needs: needs[extreme]["rms"]),
        Node(f"{load}_peak_angle", rf"\varphi_{{{letter[3:-1]},max}}", "degree",
             f"crank angle of the largest {text}", NOTES, si=DEGREE, needs=(extreme,),
             make=lambda **needs: needs[extreme]["angle"]),
        *_pressure_nodes(load),
    ]  # fmt: skip


def _part(name: str, symbol: str, long_name: str, turning: str = "") -> Node:
    """One component of a load: as it is, or turned with its own crank or with crank 1."""
    load, _, part = name.rpartition("_")
    of = f"{load}_components"
    needs: tuple[str, ...] = (of, "crank_angle", "crank_ratio", "offset_ratio")
    if turning == "engine":
        needs = (*needs, *_COUNTED)

    def make(**needs: Any) -> Any:
        component = needs[of]
        if turning == "engine":
            component = bearings.in_turned_axes(component, bearings.first_crank(
                needs["crank_angle"], needs["crank_ratio"], needs["offset_ratio"],
                needs["cylinder_set"], needs["cylinders_by_count"],
            ))  # fmt: skip
        elif turning == "crank":
            top = slider_crank.dead_centres(needs["crank_ratio"], needs["offset_ratio"]).top
            component = bearings.in_turned_axes(component, needs["crank_angle"] + top)
        return component.real if part in ("radial", "x", "side") else component.imag

    return Node(
        name, symbol, "N", long_name, NOTES, kind="curve", needs=needs if turning else (of,),
        make=make,
    )  # fmt: skip


_OF_ALL = "all_main_journals_extremes"


def _bending_over_angle(*, crank_angle: Any, **needs: Any) -> Any:
    factors = _journal_factors(needs)
    return bending_over_angle(
        crankshaft(needs), needs["bay"], needs["speed"], crank_angle,
        lambda engine: bearings.pin_forces(
            crank_angle, engine, needs["crank_ratio"], needs["offset_ratio"], needs["family"],
            needs["row"], factors,
        ),
    )  # fmt: skip


def _of_all_journals(threads: int | None = 1, **needs: Any) -> Any:
    whole = ("counterweights", "cylinders_by_count", "family", "period")
    webs: tuple[Callable[[Any], Any], ...] = ()
    if "counterweights" in needs:
        each = {n: v if n in whole else np.asarray(v)[..., None] for n, v in needs.items()}
        shaft, square = crankshaft(each), each["speed"] ** 2
        webs = (lambda journals: on_journals(shaft, journals) * square,)
    return bearings.of_all_journals(
        needs["crank_ratio"], needs["offset_ratio"], needs["family"], needs["row"],
        _journal_factors(needs), *_engines(needs), needs["curve_period"], threads, *webs,
    )  # fmt: skip


NODES: tuple[Node, ...] = (
    *(
        hidden(_OF_ALL, "N", "extremes of the loads of all main journals", _of_all_journals,
               tuple(dict.fromkeys((*_LOADED, *_UNBALANCE, *_COUNTED, *more))), throws=True,
               width=(MOST_CYLINDERS + 1) * bearings.EXTREMES.itemsize, threaded=True, when=word)
        for word, more in (
            ("weights_by_fraction", ()), ("weights_given", ()),
            ("weights_of_webs", (*OF_WEBS, "cylinder_spacing")),
        )
    ),
    Node("any_main_journal_load_max", r"F_{H,max,max}", "N",
         "largest load of any main journal", NOTES, needs=(_OF_ALL,),
         extreme_of=("main_journal_load", "largest"),
         make=lambda **needs: needs[_OF_ALL]["peak"]),
    hidden("bay_bending_moment_over_angle", "N m", "largest bending moment within each bay",
           _bending_over_angle, tuple(dict.fromkeys((*_LOADED, *BENDING, "bay", "crank_angle"))),
           kind="curve", throws=True),
    Node("bay_bending_moment_cycle_max", r"M_{b,cyc}", "N m",
         "largest bending moment of the shaft between the main bearings beside each throw over the "
         "cycle, due to all forces on the crank pins and counterweights, each bay a simply "
         "supported beam", "this project", needs=("bay_bending_moment_over_angle",),
         removes=("crank_angle",), extreme_of=("bay_bending_moment_over_angle", "largest"),
         throws=True, width=400_000),
    Node("all_main_journals_load_rms", r"\bar F_{H,rms}", "N",
         "root mean square of the loads of all main journals", NOTES,
         needs=(_OF_ALL,), make=lambda **needs: needs[_OF_ALL]["rms"]),
    *_load_nodes("crank_pin", "crank-pin load, cylinder 1", "F_{C}", _RODS,
                 _crank_pin_factors, bearings.crank_pin_load),
    *_load_nodes("piston_pin", "piston-pin load, cylinder 1", "F_{P}", _RODS,
                 _piston_pin_factors, bearings.piston_pin_load),
    *_load_nodes("main_journal", "main-journal load, on the bearing", "F_{H}",
                 (*_UNBALANCE, "main_bearing", "journal_web_unbalance"), _journal_factors,
                 bearings.main_journal_load),
    _part("crank_pin_radial", "F_{C,r}",
          "crank-pin load along the crank throw, positive outwards, cylinder 1"),
    _part("crank_pin_tangential", "F_{C,t}",
          "crank-pin load perpendicular to the crank throw, positive in the sense of rotation, "
          "cylinder 1"),
    _part("crank_pin_x", "F_{C,x}",
          "crank-pin load perpendicular to the cylinder axis, positive to the side where the pin "
          "moves down, cylinder 1", "crank"),
    _part("crank_pin_y", "F_{C,y}",
          "crank-pin load along the cylinder axis, positive away from the crankshaft, cylinder 1",
          "crank"),
    _part("piston_pin_side", "F_{P,s}",
          "piston-pin load perpendicular to the cylinder axis, positive to the side where the "
          "crank pin moves down, cylinder 1"),
    _part("piston_pin_down", "F_{P,d}",
          "piston-pin load along the cylinder axis, positive towards the crankshaft, cylinder 1"),
    _part("main_journal_x", "F_{H,x}",
          "main-journal load to the side, positive to the side where an upright crank moves down"),
    _part("main_journal_y", "F_{H,y}",
    "main-journal load upwards, positive away from the crankshaft"),
    _part("main_journal_radial", "F_{H,r}", "main-journal load along throw 1, positive outwards",
          "engine"),
    _part("main_journal_tangential", "F_{H,t}",
          "main-journal load perpendicular to throw 1, positive in the sense of rotation",
          "engine"),
)  # fmt: skip
