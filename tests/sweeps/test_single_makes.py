"""Engines whose cylinders have bores or diagrams of their own.

They are the sum of engines with one cylinder each, which are computed apart; quantities are walked
by their list.
"""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import engine_dyn
from engine_dyn.pressure.family import Family
from engine_dyn.quantities.each_cylinder import OF_MAKES
from engine_dyn.quantities.graph import NODES, QUANTITIES
from engine_dyn.speed.api import energy_swing
from engine_dyn.units import BAR, RPM
from sweeps import SceneError
from sweeps.scene.engine.engine_files import load_engine
from sweeps.scene.reading import read_scene
from tests.support.engine_files import VALUES, indicator_text
from tests.support.scenes import NOT_OF_AN_ENGINE, asking, computed, refusal, refusal_of
from tests.support.shafts import complete_shaft

STEP = 0.5
OMEGA = 1200.0 * math.pi / 30.0
BORES, RADII = (0.14, 0.11), (1.0, 0.85)
WITHOUT = VALUES.replace("friction_mean_piston_speed = 0.142", "friction_mean_piston_speed = 0")


def pressure(which: int) -> np.ndarray:
    """A diagram [bar] every 2 degrees, which = 1 or 2: its compression ratio and its combustion."""
    degrees = np.arange(-360.0, 361.0, 2.0)
    volume = 1.0 + (11.0, 7.0)[which - 1] * 0.5 * (1.0 - np.cos(np.radians(degrees)))
    base = ((1.0 + (11.0, 7.0)[which - 1]) / volume) ** 1.3
    burnt = (25.0, 45.0)[which - 1] * np.exp(-(((degrees - 14.0) / (22.0, 30.0)[which - 1]) ** 2))
    return np.where(np.abs(degrees) < 180.0, base, 1.0) + burnt


def engine(
    folder: Path, name: str, makes: tuple[int, ...], values: str = WITHOUT, head: str = "",
    more: str = "",
) -> str:  # fmt: skip
    """An engine file whose cylinders have diagrams 1 or 2, in this sequence; `more` of [values]."""
    for which in (1, 2):
        rows = zip(np.arange(-360.0, 361.0, 2.0), pressure(which), strict=True)
        (folder / f"p{which}.csv").write_text(indicator_text([(float(a), p) for a, p in rows]))
    text = values.replace("[values]", f"{head}\n[values]")
    text = text.replace("cylinders = 2", f"cylinders = {len(makes)}") + more
    for number, which in enumerate(makes, start=1):
        own = f"cylinder = {number}\n" if number > 1 else ""
        text += f'[[diagram]]\nload = 50\nkind = "points"\nfile = "p{which}.csv"\n{own}'
    path = folder / f"{name}.toml"
    path.write_text(text, encoding="utf-8")
    return str(path)


ASKED = (
    "gas_torque", "inertia_torque", "displacement", "imep", "friction_torque", "peak_pressure",
    "torque_mean", "combined_rod_load_compression", "combined_rod_load_tension",
    "crank_pin_load_max", "crank_pin_load_mean", "piston_pin_load_max", "wall_thrust",
    "cylinder_power", "cylinder_pressure", "pressure", "torque_order", "throw_torque_order",
    "main_journal_load_max", "main_journal_load_mean", "rod_load_reversal", "gas_torque_order",
)  # fmt: skip
TWIN = 'arrangement = "parallel twin 360"\n'
PISTON = {"piston_mass": 5.0, "rod_mass": 2.5, "rod_centre_of_gravity": 0.12, "crank_mass": 4.0}
OUTPUT = {"angle_step": STEP, "highest_order": 8.0}


@pytest.fixture(scope="module")
def three(tmp_path_factory: pytest.TempPathFactory) -> tuple[xr.Dataset, xr.Dataset, xr.Dataset]:
    """The engine of two makes, and each of its cylinders as an engine of its own."""
    folder = tmp_path_factory.mktemp("makes")
    both = engine(folder, "both", (1, 2), head=TWIN + f"radius_factor = {list(RADII)}",
                  more=f"bore_2 = {BORES[1]}\n")  # fmt: skip
    more = "delta", "energy_swing", "torque_max", "torque_min"
    found = [computed((*ASKED, *more), both, output=OUTPUT,
                      set={**PISTON, "load_exponent": 0, "inertia": 3.0})]  # fmt: skip
    for which in (1, 2):
        one = engine(folder, f"one{which}", (which,), head='arrangement = "in-line 1"')
        size = {"bore": BORES[which - 1], "stroke": 0.18 * RADII[which - 1],
                "rod_length": 0.35}  # fmt: skip
        asked = [name for name in ASKED if not name.startswith("throw_")]
        found.append(computed(asked, one, set={**PISTON, **size}, output=OUTPUT))
    return found[0], found[1], found[2]


def test_an_engine_is_the_sum_of_its_cylinders(three: Any) -> None:
    both, *each = three
    turn = round(360.0 / STEP)

    def summed(name: str) -> np.ndarray:
        return np.asarray(each[0][name].values + np.roll(each[1][name].values, turn))

    for name in ("gas_torque", "inertia_torque"):
        expected = summed(name)
        np.testing.assert_allclose(
            both[name].values, expected, rtol=0.0, atol=1e-9 * np.ptp(expected)
        )
    for name in ("displacement", "friction_torque"):
        assert float(both[name]) == pytest.approx(sum(float(o[name]) for o in each), rel=1e-12)
    powers = [float(one["cylinder_power"].squeeze()) for one in each]
    np.testing.assert_allclose(both["cylinder_power"].values, powers, rtol=1e-9)
    indicated = float(both["torque_mean"] + both["friction_torque"])
    assert indicated * OMEGA == pytest.approx(sum(powers), rel=1e-9)
    volume = float(both["displacement"])
    assert float(both["imep"]) * 1e5 == pytest.approx(indicated * 4.0 * math.pi / volume, rel=1e-12)
    for name in ("peak_pressure", "combined_rod_load_compression", "combined_rod_load_tension"):
        assert float(both[name]) == pytest.approx(max(float(o[name]) for o in each), rel=1e-9)
    name = "rod_load_reversal"
    assert float(both[name]) == pytest.approx(min(float(one[name]) for one in each), abs=1e-6)


def test_loads_of_bearings_are_those_of_each_cylinder(three: Any) -> None:
    both, first, second = three
    for name in ("crank_pin_load_max", "crank_pin_load_mean", "piston_pin_load_max"):
        assert float(both[name]) == pytest.approx(float(first[name]), rel=1e-12)
    for name in ("wall_thrust", "pressure"):
        np.testing.assert_allclose(both[name].values, first[name].values, rtol=1e-12)
    # The outermost journals carry half of one throw.
    for name in ("main_journal_load_max", "main_journal_load_mean"):
        outer = both[name].values[[0, 2]]
        own = [one[name].values[0] for one in (first, second)]
        np.testing.assert_allclose(outer, own, rtol=1e-9)
    pressures = both["cylinder_pressure"].values
    turn = round(360.0 / STEP)
    np.testing.assert_allclose(pressures[0], first["pressure"].values, rtol=1e-12)
    np.testing.assert_allclose(pressures[1], np.roll(second["pressure"].values, turn), rtol=1e-12)


def test_orders_are_those_of_the_sum(three: Any) -> None:
    both, *each = three
    curve = both["gas_torque"].values
    waves = np.fft.rfft(curve)[1 : both.sizes["order"] + 1] * (2.0 / curve.size)
    np.testing.assert_allclose(
        both["gas_torque_order"].values, np.abs(waves), rtol=0.0, atol=1e-5 * np.abs(waves).max()
    )
    for throw, one in enumerate(each):
        np.testing.assert_allclose(
            both["throw_torque_order"].values[throw], one["torque_order"].values, rtol=1e-9
        )


def test_the_speed_is_that_of_a_dense_quadrature(three: Any) -> None:
    """A constant load: omega^2 is the work over half the inertia, and a constant.

    The geometric mean of omega over the angle is the nominal speed. The work is summed by the
    trapezoidal rule over 0.5 degree, whose error of 1e-4 of a curve without corners is stated.
    """
    both = three[0]
    torque = (both["gas_torque"] + both["inertia_torque"]).values - float(both["friction_torque"])
    excess = torque - torque.mean()
    work = np.concatenate([[0.0], np.cumsum(0.5 * (excess[1:] + excess[:-1]))])
    work *= np.radians(STEP)
    assert float(both["energy_swing"]) == pytest.approx(np.ptp(work), rel=1e-4)
    low, high = 0.5 * OMEGA**2 - 2.0 * work.min() / 3.0, 2.0 * OMEGA**2
    for _ in range(80):
        middle = 0.5 * (low + high)
        mean = 0.5 * np.log(middle + 2.0 * work / 3.0).mean()
        low, high = (middle, high) if mean < math.log(OMEGA) else (low, middle)
    omega = np.sqrt(low + 2.0 * work / 3.0)
    assert float(both["delta"]) == pytest.approx(np.ptp(omega) / omega.mean(), rel=2e-4)
    assert float(both["torque_max"]) >= torque.max() - 1e-9
    assert float(both["torque_max"]) == pytest.approx(torque.max(), rel=1e-3)
    assert float(both["torque_min"]) == pytest.approx(torque.min(), rel=1e-3)


# --- the list of quantities -----------------------------------------------------------------------


def everything() -> dict[str, Any]:
    tables = {key: value for key, value in NOT_OF_AN_ENGINE.items() if key != "characteristic"}
    return {**tables, "set": {**tables["set"], **PISTON}, "shaft": complete_shaft(2)}


def allowed(path: str, tables: dict[str, Any]) -> tuple[list[str], dict[str, str]]:
    """Quantities that an engine has, and the refusals of others."""
    names, refused = [], {}
    for name in QUANTITIES:
        try:
            read_scene(asking([name], path, **tables))
        except SceneError as error:
            refused[name] = str(error)
        else:
            names.append(name)
    return names, refused


REFUSED = {
    "fmep_auxiliaries", "fmep_components", "fmep_crank_pin_bearings", "fmep_crankshaft_seals",
    "fmep_main_bearings", "fmep_ring_gas_pressure", "fmep_rings", "fmep_skirt", "fmep_valve_train",
    "friction_share_auxiliaries", "friction_share_bearings", "friction_share_rings",
    "friction_share_skirt", "friction_share_valve_train", "full_load_torque", "reduced_torque_mean",
    "tangential_pressure_mean",
}  # fmt: skip
"""Quantities that are not computed for such engines, and say so."""


def test_each_quantity_holds_or_is_refused_by_name(tmp_path: Path) -> None:
    """An equal bore and an equal diagram, given by themselves, must not matter to any quantity."""
    plain = engine(tmp_path, "plain", (1,), head=TWIN)
    text = Path(plain).read_text().replace("cylinders = 1", "cylinders = 2")
    Path(plain).write_text(text)
    made = engine(tmp_path, "made", (1, 1), head=TWIN, more="bore_2 = 0.14\n")
    assert load_engine(made).own_cylinders.several_makes
    tables = everything()
    known, _ = allowed(plain, tables)
    names, refused = allowed(made, tables)
    says = "is not computed for cylinders with bores or diagrams of their own"
    assert {name for name in known if name not in names} <= REFUSED
    assert all(says in refused[name] for name in known if name not in names)
    asked = [name for name in names if name in known]
    output = {"angle_step": 10.0, "highest_order": 4.0, "modes": 3}
    one, other = (computed(asked, path, **{**tables, "output": output}) for path in (plain, made))
    bad = []
    for name in asked:
        here, there = one[name].values, other[name].values
        size = np.nanmax(np.abs(here), initial=1e-300)
        # What rounding leaves, where orders of equal cylinders cancel to the bit
        if name == "delta_error" or name.endswith("torque_phase"):
            continue
        if not np.allclose(there, here, rtol=1e-8, atol=1e-8 * size, equal_nan=True):
            bad.append((name, here.flat[0], there.flat[0]))
    assert not bad


def test_nothing_of_the_whole_engine_hangs_on_which_cylinder_is_the_first(tmp_path: Path) -> None:
    """Cylinders that change places: all but what belongs to cylinder 1 or to the shaft stays.

    What took the bore or the diagram of cylinder 1 for those of all would change.
    """
    one = engine(tmp_path, "one", (1, 2), VALUES, TWIN, f"bore_2 = {BORES[1]}\n")
    swapped = VALUES.replace("bore = 0.14", f"bore = {BORES[1]}")
    other = engine(tmp_path, "other", (2, 1), swapped, TWIN, "bore_2 = 0.14\n")
    tables = everything()
    del tables["shaft"]
    names, _ = allowed(one, tables)
    of_first = ("cylinder 1", "one cylinder", "throw 1", "first torsional mode", "along the shaft")
    # At an angle from the dead centre of cylinder 1, or of its size
    by_first = {"specific_mass", "interval_duration", "omega_start"}
    whole = [n for n in names if not any(text in QUANTITIES[n].long_name for text in of_first)
             and n not in by_first]  # fmt: skip
    first, second = (computed(whole, path, **tables) for path in (one, other))
    scalars = [name for name in whole if not first[name].ndim]
    assert len(scalars) > 100
    bad = [
        (name, float(first[name]), float(second[name]))
        for name in scalars
        if float(second[name])
        != pytest.approx(float(first[name]), rel=1e-5, abs=1e-12, nan_ok=True)
    ]
    assert not bad


def test_the_python_door_gives_what_the_scene_gives(tmp_path: Path) -> None:
    path = engine(
        tmp_path, "both", (1, 2), head=TWIN + f"radius_factor = {list(RADII)}",
        more=f"bore_2 = {BORES[1]}\n",
    )  # fmt: skip
    load = {"load_exponent": 1.0, "inertia": 3.0, "reciprocating_mass": 5.0}
    found = computed(("delta", "omega_max", "omega_min", "torque_mean", "energy_swing",
                      "friction_torque"), path, set=load)  # fmt: skip
    read = load_engine(path)
    family, values = read.family, read.values
    assert isinstance(family, Family)
    one, two = family.diagrams[0], family.of_cylinders[2].diagrams[0]
    makes = {
        **{key: values[key] for key in ("bore", "stroke", "crank_ratio")},
        "crankcase_pressure": BAR * values["crankcase_pressure"], "cylinders": 2,
        "speed": RPM * values["speed"], "reciprocating_mass": 5.0,
        "firing_angles": [0.0, 2.0 * math.pi], "radius_factor": RADII,
        "bore_factor": [1.0, BORES[1] / BORES[0]], "diagrams": {2: two},
        "friction_torque": float(found["friction_torque"]),
    }  # fmt: skip
    speed = engine_dyn.periodic_speed(one, **makes, inertia=3.0, load_exponent=1.0)
    for name in ("delta", "omega_max", "omega_min", "torque_mean"):
        assert getattr(speed, name) == float(found[name]), name
    assert energy_swing(one, **makes) == float(found["energy_swing"])


def test_nodes_that_take_bore_or_diagrams_are_known() -> None:
    """A new node that takes them is refused for such engines until it is added to the list."""
    assert NODES.keys() >= OF_MAKES
    for name in REFUSED & NODES.keys():
        assert name not in OF_MAKES, name


# --- a two-stage compressor -----------------------------------------------------------------------


STAGE = """\
[[diagram]]
load = 100
kind = "compressor"
clearance_ratio = 0.05
suction_loss = 0
delivery_loss = 0
compression_exponent = 1.3
expansion_exponent = 1.3
valve_ramp = 1.5
valve_lag = 0.3
step = 0.25
"""


def two_stages(folder: Path) -> str:
    """Eastop and McConkey's example: 4.5 kg/min of air from 1.013 bar, ratio 9, 300 rpm."""
    bore, stroke = 0.2583, 0.25
    text = f"""\
name = "two_stage"
cycle = "two-stroke"
arrangement = "V2 90"

[values]
bore = {bore}
bore_2 = {bore / math.sqrt(3.0)!r}
stroke = {stroke}
rod_length = 0.6
reciprocating_mass = 10.0
inertia = 30.0
speed = 300
cylinders = 2
crankcase_pressure = 1.013
load_offset = 0
friction_constant = 0
friction_peak_pressure = 0
friction_mean_piston_speed = 0
motor_slip = 0.03
motor_breakdown_slip = 0.2
motor_breakdown_torque = 1500

{STAGE}
suction_pressure = 1.013
delivery_pressure = 3.039

{STAGE}
cylinder = 2
suction_pressure = 3.039
delivery_pressure = 9.117
"""
    path = folder / "two_stage.toml"
    path.write_text(text, encoding="utf-8")
    return str(path)


def test_a_two_stage_compressor_against_its_published_numbers(tmp_path: Path) -> None:
    """15.5 kW, 0.0131 and 0.00437 m3; both stages have the same work.

    Eastop and McConkey, Applied Thermodynamics: an example as others reprint it. By hand: a stage
    takes n/(n - 1) p V_in (3^((n-1)/n) - 1), V_in = V (1 - 0.05 (3^(1/n) - 1)), 7.74 kW. Valves
    that open at once would be exact; these take 1.5 degrees, so that 1 percent is allowed.
    """
    n = 1.3
    volume = 0.0131
    inlet = volume * (1.0 - 0.05 * (3.0 ** (1.0 / n) - 1.0))
    stage = n / (n - 1.0) * 1.013e5 * inlet * (3.0 ** ((n - 1.0) / n) - 1.0) * 5.0
    assert 2.0 * stage == pytest.approx(15.5e3, rel=0.005)
    found = computed(
        ["cylinder_power", "displacement", "peak_pressure", "delta", "brake_power"],
        two_stages(tmp_path),
    )
    np.testing.assert_allclose(found["cylinder_power"].values, -stage, rtol=0.01)
    assert float(found["displacement"]) == pytest.approx(0.0131 + 0.00437, rel=2e-3)
    assert float(found["brake_power"]) == pytest.approx(-15.5e3, rel=0.012)
    assert float(found["peak_pressure"]) == pytest.approx(9.117, rel=0.05)


def test_bores_vary_apart_from_each_other(tmp_path: Path) -> None:
    """A bore of the engine's file stays where the scene changes the other; elasticities follow."""
    path = two_stages(tmp_path)
    axes = {"bore": [0.2, 0.25, 0.3], "bore_2": [0.1, 0.15]}
    found = computed(["displacement"], path, axes=axes)
    each = [0.25 * math.pi * 0.25 * np.square(values) for values in axes.values()]
    np.testing.assert_allclose(found["displacement"].values, np.add.outer(*each), rtol=1e-12)
    kept = computed(["displacement", "displacement_elasticity"], path, set={"bore": 0.2})
    shares = np.square([0.2, 0.2583 / math.sqrt(3.0)])
    assert float(kept["displacement"]) == pytest.approx(
        0.25 * math.pi * 0.25 * shares.sum(), rel=1e-12
    )
    elasticity = kept["displacement_elasticity"].sel(parameter=["bore", "bore_2", "stroke"])
    np.testing.assert_allclose(elasticity.values, [*(2.0 * shares / shares.sum()), 1.0], rtol=1e-6)


def test_a_stage_that_draws_in_more_than_the_one_before_delivers_is_told(tmp_path: Path) -> None:
    path = Path(two_stages(tmp_path))
    assert not load_engine(str(path)).diagram_warnings
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("suction_pressure = 3.039", "suction_pressure = 4"))
    (line,) = load_engine(str(path)).diagram_warnings
    assert line.endswith(
        "stages: a cylinder draws in at suction_pressure = 4 bar, above the 3.039 bar that the "
        "stage before delivers"
    )


# --- what is refused ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (("bore_2", "bore_3"), "[values] bore_3: must be of one of the 2 cylinders"),
        (("bore = 0.2583\n", ""), "[values] bore_2: needs bore, that of cylinder 1"),
        (("cylinder = 2", "cylinder = 3"), "[[diagram]] number 2 cylinder = 3: must be the number "
         "of one of the engine's cylinders, from 1 to 2"),
        (("cylinder = 2", "cylinder = 1.5"), "cylinder = 1.5: must be the number of one of"),
        (("cylinder = 2", "cylinder = '2'"), "cylinder = '2': must be the number of one of"),
        (("cylinder = 2", 'cylinder = 2\nspeed = 300'), "cylinder: not allowed together with "
         "speed"),
        (("cylinder = 2", "cylinder = 2\nload = 90"), "[[diagram]] of cylinder 2: has the loads "
         "90; must have those of the other cylinders, 100"),
        (("suction_pressure = 1.013\n", "suction_pressure = 1.013\ncylinder = 2\n"),
         "[[diagram]]: cylinder 1 has none; must have its own, or there must be one without "
         "cylinder, for all cylinders without their own"),
    ],
)  # fmt: skip
def test_wrong_engine_files(tmp_path: Path, change: tuple[str, str], says: str) -> None:
    path = Path(two_stages(tmp_path))
    text = path.read_text().replace(*change)
    if "load = 90" in change[1]:
        head, last = text.rsplit("load = 100\n", 1)
        text = head + last
    path.write_text(text)
    assert says in refusal_of(lambda: load_engine(path))


def test_wrong_scenes(tmp_path: Path) -> None:
    path = two_stages(tmp_path)
    for tables, says in (
        ({"set": {"bore_3": 0.1}}, "[set] bore_3: must be of one of the 2 cylinders"),
        ({"set": {"bore_2": 0}}, "[set] bore_2 = 0: must be a finite number above 0 [m]"),
        ({"set": {"cylinders": 3}}, "[set] cylinders: not allowed: cylinders of engine two_stage "
         "have bores or diagrams of their own; must be its own number"),
        ({"set": {"bore_1": 0.1}}, "bore_1"),
    ):  # fmt: skip
        assert says in refusal(asking(["delta"], path, **tables))


def test_every_cylinder_may_have_its_own(tmp_path: Path) -> None:
    """With `cylinder = 1` in place of a diagram for all, nothing changes."""
    first = computed(["delta", "pressure", "cylinder_power"], two_stages(tmp_path))
    path = Path(two_stages(tmp_path))
    head = "suction_pressure = 1.013\n"
    path.write_text(path.read_text().replace(head, f"{head}cylinder = 1\n"))
    xr.testing.assert_identical(
        computed(["delta", "pressure", "cylinder_power"], str(path)).drop_attrs(),
        first.drop_attrs(),
    )


def test_two_diagrams_of_one_load_name_their_cylinder(tmp_path: Path) -> None:
    path = Path(engine(tmp_path, "twice", (1, 2)))
    text = path.read_text()
    path.write_text(text + text[text.rindex("[[diagram]]") :])
    with pytest.raises(SceneError, match=r"\[\[diagram\]\] of cylinder 2: loads \[50.0, 50.0\]"):
        load_engine(str(path))
