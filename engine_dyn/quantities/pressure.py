"""Nodes of the cylinder pressure: the diagram of a design, its peak, and mean pressures."""

from __future__ import annotations

from typing import Any

import numpy as np

from engine_dyn.forces import torque
from engine_dyn.geometry.cylinder_means import mean_factor
from engine_dyn.pressure.family import Family
from engine_dyn.pressure.motored import (
    largest_with_factor,
    peak_by_displacement,
    peak_of_cylinders,
    peak_with_factor,
)
from engine_dyn.quantities.node import Node, balance_of, formula, hidden, quotient, variants
from engine_dyn.units import BAR, RPM

BYTES_OF_CYCLE = 40_000
"""Bytes of a modelled diagram and its samples for work tables: blocks hold a few hundred."""


def _known(load: Any, family: Any) -> Any:
    """Loads to look up: the first load where none is known, whose pressure scale is NaN."""
    return np.where(np.isnan(load), family.loads[0], load)


def _place(load: Any, family: Family) -> Any:
    row, weight = family.locate(_known(load, family))
    return row + weight


def _place_at_speed(load: Any, speed: Any, family: Any) -> Any:
    return family.place(_known(load, family), speed)


def _scale(speed: Any, scale_table: Any) -> Any:
    return np.interp(np.asarray(speed) / RPM, *scale_table)


def _scales(name: str, known: str, when: str) -> tuple[Node, ...]:
    """Nodes of the factor on the diagram, NaN where `known` tells that there is no cycle."""
    return (
        Node(
            name, "", "1", "factor on the diagram, NaN where the parameters give no valid cycle",
            public=False, needs=(known,), when=f"one_scale {when}",
            make=lambda **needs: needs[known],
        ),
        Node(
            name, "", "1", "factor on the diagram at this speed", public=False,
            make=_scale,
            when=f"given_cycles scale_over_speed {when}",
            source="diesel_105x137: curve times peak pressure over speed",
        ),
        Node(
            name, "", "1",
            "factor on the diagram at this speed, NaN where the parameters give no valid cycle",
            public=False, needs=("speed", "scale_table", known),
            when=f"own_cycles scale_over_speed {when}",
            make=lambda speed, scale_table, **needs: needs[known] * _scale(speed, scale_table),
        ),
    )  # fmt: skip


def _mean_gas_of_equal_throws(*needs: Any) -> Any:
    from engine_dyn.speed.torque import mean_gas_of_equal_throws

    return mean_gas_of_equal_throws(*needs)


def _mean_gas_of_unequal_throws(*needs: Any) -> Any:
    from engine_dyn.speed.torque import mean_gas_of_unequal_throws

    return mean_gas_of_unequal_throws(*needs)


NODES: tuple[Node, ...] = (
    *variants(
        Node("place", "", "1", "place of load and speed in the table of one family", public=False),
        {
            "over_load not_held": lambda load, family: _place(load, family),
            "over_load held": lambda held_load, family: _place(held_load, family),
            "over_speed not_held": lambda load, speed, family: _place_at_speed(load, speed, family),
            "over_speed held": lambda held_load, speed, family: _place_at_speed(
                held_load, speed, family
            ),
        },
    ),
    *variants(
        Node("row", "", "1", "place of the diagram in the family's table", public=False),
        {
            "given_cycles": lambda place: place,
            "own_cycles": lambda place, cycle, family: family.row_of(cycle, place),
        },
    ),
    *(
        node
        for name, where, make in (
            ("cycle_known", "",
             lambda row, family: np.where(family.known(row), 1.0, np.nan)),
            ("all_cycles_known", " at some load", lambda cycle, family: np.where(
                family.diagrams_known(cycle).all(axis=-1), 1.0, np.nan)),
        )
        for text in (f"1, or NaN where the parameters give no valid cycle{where}",)
        for node in (
            hidden(name, "1", text, lambda: 1.0, when="given_cycles"),
            hidden(name, "1", text, make, when="own_cycles", width=BYTES_OF_CYCLE),
        )
    ),
    *_scales("pressure_scale", "cycle_known", "given_load not_held"),
    *_scales("diagram_scale", "all_cycles_known", "characteristic not_held"),
    *_scales("diagram_scale", "all_cycles_known", "held"),
    *variants(
        Node(
            "pressure_scale", "", "1",
            "factor on the diagram, NaN where no diagram gives the torque that the load follows",
            public=False,
        ),
        {
            "characteristic not_held": lambda diagram_scale, load: np.where(
                np.isnan(load), np.nan, diagram_scale
            ),
            "held": lambda diagram_scale, held_load: np.where(
                np.isnan(held_load), np.nan, diagram_scale
            ),
        },
    ),
    Node(
        "pressure_share", "", "1",
        "factor on the cylinder pressure, averaged over the cylinders", public=False,
        make=lambda cylinder_set, cylinders_by_count: mean_factor(
            "all_pressure", cylinder_set, cylinders_by_count
        ),
    ),
    Node(
        "mean_peak_pressure", "", "Pa", "largest tabulated pressure", public=False,
        when="single_acting equal",
        make=lambda row, family, pressure_scale: family.peak_between(row) * pressure_scale,
    ),
    Node(
        "mean_peak_pressure", "", "Pa", "largest tabulated pressure, averaged over the cylinders",
        public=False, when="single_acting unequal one_make",
        make=lambda row, family, pressure_scale, cylinder_set, cylinders_by_count:
        pressure_scale * peak_of_cylinders(
            row, family, cylinder_set, cylinders_by_count, np.mean, peak_with_factor
        ),
    ),
    hidden(
        "mean_peak_pressure", "Pa",
        "largest tabulated pressure, averaged over the cylinders by their displacement",
        lambda row, family, pressure_scale, cylinder_set, cylinders_by_count, crank_ratio,
        offset_ratio: pressure_scale * peak_by_displacement(
            row, family, cylinder_set, cylinders_by_count, crank_ratio, offset_ratio
        ),
        when="single_acting unequal several_makes",
    ),
    *variants(
        Node("peak_pressure", "p_{max}", "bar", "largest absolute cylinder pressure",
             "Kakaitsas eq. 3.9", extreme_of=("pressure", "largest"), si=BAR),
        {
            "single_acting equal": lambda row, family, pressure_scale:
            pressure_scale * largest_with_factor(row, family, 1.0),
            "single_acting unequal": lambda row, family, pressure_scale, cylinder_set,
            cylinders_by_count: pressure_scale * peak_of_cylinders(
                row, family, cylinder_set, cylinders_by_count, np.max, largest_with_factor
            ),
        },
    ),
    Node(
        "pressure", "p", "bar", "absolute pressure in cylinder 1", "Kakaitsas section 2.1", si=BAR,
        kind="curve", when="single_acting equal",
        **formula(torque.pressure, "crank_angle", "family", "row", "pressure_scale"),
    ),
    Node(
        "pressure", "p", "bar", "absolute pressure in cylinder 1", "Kakaitsas section 2.1", si=BAR,
        kind="curve", when="single_acting unequal",
        **formula(torque.pressure_of_first, "crank_angle", "family", "row", "pressure_scale",
                  "cylinder_set", "cylinders_by_count"),
    ),
    Node(
        "peak_pressure", "p_{max}", "bar", "largest absolute pressure of both ends", "this project",
        si=BAR, when="double_acting", extreme_of=("pressure", "largest"),
        make=lambda double_acting: np.float64(double_acting.largest),
    ),
    hidden(
        "mean_peak_pressure", "Pa", "largest tabulated pressure of both ends",
        lambda double_acting: np.float64(double_acting.peak_of_ends), when="double_acting",
    ),
    Node(
        "pressure", "p", "bar", "absolute pressure in the head end of cylinder 1", "this project",
        si=BAR, kind="curve", when="double_acting",
        make=lambda crank_angle, double_acting: double_acting.head_end(crank_angle),
    ),
    *variants(
        Node("crank_end_pressure", "p_{ce}", "bar",
             "absolute pressure on the crank's side of the piston of cylinder 1", "this project",
             si=BAR, kind="curve"),
        {
            "double_acting": lambda crank_angle, double_acting:
            double_acting.crank_end(crank_angle),
            "single_acting": lambda crank_angle, crankcase_pressure:
            crankcase_pressure + 0.0 * crank_angle,
        },
    ),
    Node(
        "mean_gas", "", "Pa", "mean of pressure times reduced piston velocity", public=False,
        when="equal_throws", **formula(_mean_gas_of_equal_throws, "crank_ratio", "offset_ratio",
                                       "row", "family", "pressure_share"),
    ),
    Node(
        "mean_gas", "", "Pa",
        "mean of pressure times piston velocity over the engine's crank radius and speed, with "
        "factors on its piston area",
        public=False, when="unequal_throws",
        **formula(_mean_gas_of_unequal_throws, "crank_ratio", "offset_ratio", "row", "family",
                  "cylinder_set", "cylinders_by_count"),
    ),
    *variants(
        Node("imep", "p_i", "bar", "indicated mean effective pressure", "Rakopoulos notes", si=BAR),
        {
            "centred one_make": lambda mean_gas, pressure_scale, period, stroke_share:
            0.5 * period * pressure_scale * mean_gas / stroke_share,
            "offset one_make": lambda mean_gas, pressure_scale, period, double_radius, stroke,
            stroke_share: 0.5 * double_radius / (stroke * stroke_share) * period * pressure_scale
            * mean_gas,
            "several_makes": lambda indicated_torque_mean, period, displacement:
            indicated_torque_mean * period / displacement,
        },
    ),
    Node(
        "bmep", "p_e", "bar", "brake mean effective pressure", "Kakaitsas section 3.2.3", si=BAR,
        make=lambda imep, fmep: balance_of(imep, fmep),
    ),
    Node(
        "mechanical_efficiency", r"\eta_m", "1",
        "mechanical efficiency, brake over indicated mean effective pressure",
        "Kakaitsas section 3.2.3", make=lambda bmep, imep: quotient(bmep, imep),
    ),
)  # fmt: skip
