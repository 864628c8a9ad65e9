"""The main job on held-out input: a CSV diagram, scenes, archives, against an independent solver.

The designs and their solutions come from oracle, which shares no code with the packages. The
pressure reaches the packages as a CSV file at half degrees, as a user would give it.
"""

from pathlib import Path

import numpy as np
import pytest

import sweeps
from oracle import golden
from oracle.designs import HeldOut, held_out

ENGINE = """
name = "held_out"
title = "Held-out design"
cycle = "four-stroke"
[values]
bore = {bore!r}
stroke = {stroke!r}
crank_ratio = {crank_ratio!r}
reciprocating_mass = {reciprocating_mass!r}
inertia = {inertia!r}
speed = {speed_rpm!r}
cylinders = {cylinders}
load = 100
load_exponent = {load_exponent!r}
load_offset = {load_offset!r}
crankcase_pressure = {crankcase!r}
friction_constant = {friction!r}
friction_peak_pressure = 0.0
friction_mean_piston_speed = 0.0
[[diagram]]
load = 100
kind = "points"
file = "pressure.csv"
"""

QUANTITIES = ["delta", "omega_max", "omega_min", "omega_mean", "torque_mean", "load_coefficient"]


def scene_of(item: HeldOut, folder: Path) -> dict[str, object]:
    design = item.design
    degrees, bar = item.table(0.5)
    rows = "\n".join(f"{a!r},{p!r}" for a, p in zip(degrees.tolist(), bar.tolist(), strict=True))
    (folder / "pressure.csv").write_text(f"crank_angle_deg,pressure_bar\n{rows}\n")
    values = {
        name: getattr(design, name)
        for name in ("bore", "stroke", "crank_ratio", "reciprocating_mass", "inertia", "speed_rpm",
                     "cylinders", "load_exponent", "load_offset")
    }  # fmt: skip
    text = ENGINE.format(
        **values, crankcase=design.crankcase_pressure / 1e5, friction=design.fmep / 1e5
    )
    (folder / "engine.toml").write_text(text)
    return {
        "engine": str(folder / "engine.toml"),
        "solver": {"inertia_model": design.inertia_model, "closure": design.closure},
        "output": {"quantities": QUANTITIES},
    }


CASES = [item for item in held_out() if not item.exact]


@pytest.mark.parametrize("item", CASES, ids=[item.name for item in CASES])
def test_scene_agrees_with_independent_solution(item: HeldOut, tmp_path: Path) -> None:
    """Limits of issue "end to end": 1e-5 in delta and the extremes, 1e-7 and 2e-6 in the means."""
    known = golden.read()[item.name]
    result = sweeps.run(scene_of(item, tmp_path))
    words = result["status"].attrs["flag_meanings"].split()
    assert words[int(result["status"])] == known["status"]
    assert float(result["torque_mean"]) == pytest.approx(known["torque_mean"], rel=2e-6)
    if known["status"] != "converged":
        assert all(np.isnan(result[name]) for name in ("delta", "omega_max", "omega_mean"))
        return
    for name, limit in (("delta", 1e-5), ("omega_max", 1e-5), ("omega_min", 1e-5),
                        ("omega_mean", 1e-7)):  # fmt: skip
        assert float(result[name]) == pytest.approx(known[name], rel=limit), name
    if not item.name.startswith("weak load"):  # there k is a small difference of large torques
        assert float(result["load_coefficient"]) == pytest.approx(known["k"], rel=2e-6)
