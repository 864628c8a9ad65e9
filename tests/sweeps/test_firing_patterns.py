"""Firing patterns and firing orders: in scenes, searched and ranked."""

import json
import re
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

import sweeps
from sweeps.base.dimensions import OF_ORDERS
from sweeps.decide.explore.firing_patterns import _necklaces, _turned_once
from sweeps.view.texts.firing_orders import orders_text
from tests.support import commands
from tests.support.commands import ok, refused
from tests.support.scenes import computed, refusal, refusal_of

FOUR = {"cylinders": 4, "load": 50, "inertia": 5, "speed": 1000}


def test_axis_set_designs_and_sample_give_the_same() -> None:
    """Alone, along an axis or for each design: the bits of one pattern."""
    texts = ["1", "110", "1 0.5 1"]
    axis = computed(["delta"], set=FOUR, axes={"firing_pattern": texts})
    assert axis.firing_pattern_name.values.tolist() == texts
    designs = computed(
        ["delta"], set={k: v for k, v in FOUR.items() if k != "inertia"},
        designs={"firing_pattern": texts[::-1], "inertia": [5, 5, 5]},
    )  # fmt: skip
    assert designs.delta.values.tolist() == axis.delta.values[::-1].tolist()
    assert designs.firing_pattern.values.tolist() == texts[::-1]
    for text, delta in zip(texts, axis.delta.values, strict=True):
        listed = [float(one) for one in (text.split() if " " in text else text)]
        alone = computed(["delta"], set={**FOUR, "firing_pattern": text})
        as_list = computed(["delta"], set={**FOUR, "firing_pattern": listed})
        assert float(as_list.delta) == float(alone.delta)
        assert float(alone.delta) == float(delta)
    sample = computed(
        ["delta"], set={k: v for k, v in FOUR.items() if k != "inertia"},
        sample={"number": 8, "firing_pattern": texts, "inertia": {"low": 4, "high": 6}},
    )  # fmt: skip
    assert set(sample.firing_pattern.values.tolist()) <= set(texts)
    assert np.isfinite(sample.delta).all()


def test_a_pattern_within_a_cycle_is_a_misfire() -> None:
    """Every fourth firing left out is the last cylinder to fire without combustion."""
    pattern = computed(["delta", "torque_mean"], set={**FOUR, "firing_pattern": "1110"})
    misfire = computed(["delta", "torque_mean"], set={**FOUR, "misfire": 2})  # 1-3-4-2
    assert float(pattern.delta) == pytest.approx(float(misfire.delta), rel=1e-12)
    assert float(pattern.torque_mean) == pytest.approx(float(misfire.torque_mean), rel=1e-12)


def test_curves_orders_and_cycles() -> None:
    asked = ["delta", "omega", "omega_mean", "torque", "torque_order", "torque_mean", "cycle_delta"]
    found = computed(
        asked, set={**FOUR, "firing_pattern": "11010"}, output={"angle_step": 0.5}
    )  # fmt: skip
    angle = found.crank_angle.values
    assert (angle[0], angle[-1], angle.size) == (-360.0, 5 * 720 - 360.5, 5 * 1440)
    assert found.order.values[:3] == pytest.approx([0.1, 0.2, 0.3])
    assert float(found.torque.mean()) == pytest.approx(float(found.torque_mean), rel=1e-6)
    waves = 2.0 * np.abs(np.fft.rfft(found.torque.values))[1 : found.order.size + 1] / angle.size
    assert found.torque_order.values == pytest.approx(waves, abs=1e-6 * waves.max())
    # Firings that repeat after five halves of a turn: other orders are not excited.
    excited = np.isclose(found.order.values % 0.4, 0.0) | np.isclose(found.order.values % 0.4, 0.4)
    assert waves[~excited].max() < 1e-9 * waves.max()
    each = found.omega.values.reshape(5, -1)
    each = np.column_stack([each, np.roll(each[:, 0], -1)])  # the end of a cycle belongs to it
    ranges = (each.max(axis=1) - each.min(axis=1)) / float(found.omega_mean)
    assert found.cycle_delta.values == pytest.approx(ranges, rel=1e-3)
    assert (found.cycle_delta.values <= float(found.delta) * (1.0 + 1e-6)).all()


@pytest.mark.slow
def test_random_firings() -> None:
    """The same seed gives the same bits; the deviation is that of the firings."""
    text = "deviation 0.04, 64 cycles, seeds 5 to 8"
    found = computed(["delta", "imep"], set=FOUR, axes={"firing_pattern": [text, "1"]})
    assert found.firing_pattern_name.values[:2].tolist() == [
        "deviation 0.04, 64 cycles, seed 5", "deviation 0.04, 64 cycles, seed 6",
    ]  # fmt: skip
    alone = computed(["delta"], set={**FOUR, "firing_pattern": "deviation 0.04, 64 cycles, seed 7"})
    assert float(alone.delta) == float(found.delta[2])
    delta = found.delta.values
    assert (delta[:4] > delta[4]).all()
    assert len(set(delta.tolist())) == 5
    # The mean of 256 independent firings: 0.04 over the root of 256, times 4.5.
    assert found.imep.values[:4] == pytest.approx(float(found.imep[4]), rel=4.5 * 0.04 / 16.0)


@pytest.mark.parametrize("valves_shut", [False, True])
def test_search(valves_shut: bool) -> None:
    scene = {"engine": "ntua", "set": FOUR}
    found = sweeps.firing_patterns(scene, "2/3", longest=6, valves_shut=valves_shut)
    assert found.ranked_by.values.tolist() == sorted(found.delta.values.tolist())
    whole = computed(["torque_mean"], set=FOUR)
    assert found.torque_mean.values == pytest.approx(float(whole.torque_mean), rel=1e-4)
    # The best by the general solver, from tables of torque that no other pattern is in.
    best = str(found.firing_pattern_name.values[0])
    general = computed(
        ["delta", "delta_error"], set={**FOUR, "firing_pattern": best}, solver={"method": "newton"}
    )  # fmt: skip
    assert float(found.delta[0]) == pytest.approx(float(general.delta), rel=1e-6)
    about = json.loads(found.attrs["firing_patterns"])
    assert about["density"] == "2/3"
    # A little more than 3/2 for the friction of higher pressures; less without gas exchange.
    assert about["pressure_factor"] == pytest.approx(1.5, rel=0.02)


def test_a_rounded_order_means_the_fraction() -> None:
    scene = {"engine": "ntua", "set": FOUR}
    third, rounded = (
        sweeps.firing_patterns(scene, "2/3", longest=3, by="torque_order", order=order)
        for order in (1.0 / 3.0, 0.3333)
    )
    assert rounded.ranked_by.values.tolist() == third.ranked_by.values.tolist()
    with pytest.raises(sweeps.SceneError, match=r"order = 0.33: must be one of the orders"):
        sweeps.firing_patterns(scene, "2/3", longest=3, by="torque_order", order=0.33)


@pytest.mark.slow
def test_search_among_patterns_that_repeat_together_after_very_many_cycles() -> None:
    """After 210, of which no pattern needs more than 7: each has its own orders alone."""
    scene = {
        "engine": "ntua", "set": FOUR, "output": {"quantities": ["delta"], "highest_order": 2}
    }  # fmt: skip
    found = sweeps.firing_patterns(
        scene, "1/2", longest=14, by="torque_order", order=0.5, keep_torque=False
    )
    assert found.sizes["firing_pattern"] == 358
    assert found.sizes["order"] == 840
    last = found.isel(firing_pattern=-1)
    alone = computed(
        ["torque_order", "delta"], set={**FOUR, "firing_pattern": str(last.firings.values)},
        output={"highest_order": 2},
    )  # fmt: skip
    assert float(alone.delta) == float(last.delta)
    assert (alone.torque_order == last.torque_order.sel(order=alone.order)).all()
    assert float(alone.torque_order.sel(order=0.5)) == float(last.ranked_by) > 0.0


def test_all_patterns_once() -> None:
    """Against all words, and their classes by turning them."""
    for length in range(2, 11):
        for ones in range(1, length):
            words = {"".join(w) for w in product("01", repeat=length) if w.count("1") == ones}
            classes = {max(w[i:] + w[:i] for i in range(length)) for w in words}
            assert set(_turned_once(length, ones)) == classes
            assert _necklaces(length, ones) == len(classes)


def test_command(tmp_path: Path) -> None:
    sets = "cylinders=4,load=50,inertia=5"
    told = ok("firing-patterns", "ntua", "--set", sets, "--density", "2/3", "--longest", "6",
              "-o", tmp_path / "found.nc")  # fmt: skip
    assert "3 firing patterns of density 2/3" in told
    assert "1.5 times the combustion pressure" in told
    line = refused("firing-patterns", "ntua", "--set", sets, "--density", "1/5")
    assert "times the combustion pressure; must be at most 4" in line
    with sweeps.open(tmp_path / "found.nc") as opened:
        assert opened.firings.values.tolist() == ["110", "111010", "111100"]


WRONG: list[tuple[dict[str, Any], str]] = [
    ({"set": {"firing_pattern": ""}}, r"\[set\] firing_pattern = ''.*must be a string: a letter"),
    ({"set": {"firing_pattern": [1, 5]}}, "'5'; must be a string"),
    ({"set": {"firing_pattern": [1, "x"]}}, r"\[set\] firing_pattern"),
    ({"set": {"firing_pattern": 110}}, r"\[set\] firing_pattern = 110: must be a string"),
    ({"set": {"firing_pattern": "11x"}}, r"firing_pattern = '11x': 'x'; must be a string"),
    ({"set": {"firing_pattern": "1 4.5"}}, r"'4.5'; must be a string"),
    ({"set": {"firing_pattern": "1" * 66 + "0"}}, "repeats after 67 cycles; must be at most 64"),
    ({"axes": {"firing_pattern": "110"}}, r"\[axes\] firing_pattern = '110': must be a list"),
    ({"axes": {"firing_pattern": ["110", "1 1 0", "110"]}}, "duplicate '110'"),
    (
        {"axes": {"firing_pattern": ["1" * n + "0" for n in (30, 36, 40)]}},
        "together repeat after 47,027 cycles; must be at most 2,520",
    ),
    ({"set": {"firing_pattern": "deviation 0.9, 8 cycles"}}, "deviation must be above 0"),
    ({"set": {"firing_pattern": "deviation 0.1, 80 cycles"}}, "cycles must be from 2 to 64"),
    ({"set": {"firing_pattern": "deviation 0.1, 8 cycles, seeds 1 to 2"}}, "several seeds"),
    (
        {"set": {"firing_pattern": "110"}, "axes": {"firing_pattern": ["110"]}},
        r"given in \[set\] and \[axes\]; give it once",
    ),
]


@pytest.mark.parametrize(("tables", "message"), WRONG)
def test_refused(tables: dict[str, Any], message: str) -> None:
    settings = {"load": 50, "cylinders": 4, **tables.get("set", {})}
    scene = {"engine": "ntua", **tables, "set": settings, "output": {"quantities": ["delta"]}}
    if "after" in message:  # of a single cylinder, each firing is a cycle
        settings["cylinders"] = 1
    assert re.search(message, refusal(scene))


@pytest.mark.parametrize(
    ("given", "options", "message"),
    [
        (("ntua", 1.5), {}, "density = 1.5: must be between 0 and 1"),
        (("ntua", "5/13"), {}, "no pattern of at most 12 firings has it"),
        (("ntua", 0.5), {"longest": 30}, "longest = 30: must be a whole number from 2 to 24"),
        (("ntua", 0.5), {"longest": 24}, "patterns of density 1/2; at most 2,000"),
        (
            ("ntua", 0.5),
            {"by": "omega", "longest": 4, "settings": {"load": 50}},
            "by 'omega': must be a quantity",
        ),
        (
            ("ntua", 0.5),
            {"order": 1.0, "longest": 4, "settings": {"load": 50}},
            "order: only with a quantity",
        ),
        (("nothing", 0.5), {}, "neither an engine nor a scene"),
    ],
)
def test_search_refuses(given: tuple[Any, ...], options: dict[str, Any], message: str) -> None:
    assert message in refusal_of(lambda: sweeps.firing_patterns(*given, **options))


@pytest.fixture(scope="module")
def six() -> xr.Dataset:
    return sweeps.firing_orders("ntua", arrangement="in-line 6", settings={"cylinder_spacing": 0.2})


def of(found: xr.Dataset, order: str, name: str) -> np.ndarray:
    where = found["firing_order"].values.tolist().index(order)
    return np.asarray(found[name].isel(arrangement=where))


def test_orders_of_the_six_and_their_ranks(six: xr.Dataset) -> None:
    assert six["firing_order"].values.tolist() == [
        "1-2-3-6-5-4", "1-2-4-6-5-3", "1-3-2-6-4-5", "1-3-5-6-4-2", "1-4-2-6-3-5", "1-4-5-6-3-2",
        "1-5-3-6-2-4", "1-5-4-6-2-3",
    ]  # fmt: skip
    assert six["own_crank"].values.tolist() == [1, 1, 0, 0, 0, 0, 1, 1]
    assert of(six, "1-5-3-6-2-4", "other_way") == "1-4-2-6-3-5"
    assert of(six, "1-5-3-6-2-4", "from_other_end") == "1-5-3-6-2-4"
    assert str(of(six, "1-5-3-6-2-4", "known_order")).startswith("Kakaitsas (2015)")
    assert of(six, "1-5-4-6-2-3", "known_order") == ""
    about = json.loads(six.attrs[OF_ORDERS])
    assert (about["orders"], about["but_for_the_end"], about["but_for_end_and_way"]) == (8, 8, 4)
    # Ranks by a plain loop; equal values share a place.
    by = json.loads(six.attrs[OF_ORDERS])["by"]
    assert by == ["torque_after_throw_range", "first_mode_torque_rms", "any_main_journal_load_max",
                  "all_main_journals_load_rms"]  # fmt: skip
    summed = np.zeros(8)
    for name in by:
        values = six[name].values
        summed += [1 + sum(v < 0.999 * one for v in values) for one in values]
    assert six["rank_sum"].values.tolist() == summed.tolist()
    assert six["rank"].values.tolist() == [1 + int((summed < one).sum()) for one in summed]
    assert sorted(six.sortby("rank")["firing_order"].values[:2]) == ["1-4-2-6-3-5", "1-5-3-6-2-4"]


def test_each_order_is_the_engine_computed_alone(six: xr.Dataset) -> None:
    names = ["torque_after_throw_range", "first_mode_torque_order", "main_journal_load_max",
             "shaking_moment_max", "delta"]  # fmt: skip
    for order in ("1-5-3-6-2-4", "1-3-2-6-4-5"):
        alone = sweeps.run(
            engine="ntua", output={"quantities": names},
            set={"arrangement": f"in-line 6 {order}", "cylinders": 6, "cylinder_spacing": 0.2},
        )  # fmt: skip
        for name in names:
            where = six["firing_order"].values.tolist().index(order)
            one = six[name].isel(arrangement=where) if "arrangement" in six[name].dims else (
                six[name]
            )  # fmt: skip
            assert_allclose(one, alone[name], rtol=1e-12)


def test_what_no_order_and_what_no_reversal_changes(six: xr.Dataset) -> None:
    """Even firing of equal cylinders: who fires when does not matter to the whole engine."""
    for name in ("delta", "torque_range"):
        assert np.ptp(six[name].values) <= 1e-9 * np.abs(six[name].values).max(), name
    largest = float(six["torque_order"].max())
    assert_allclose(
        six["torque_order"], six["torque_order"].isel(arrangement=[0] * 8), atol=1e-9 * largest
    )
    for name in ("shaking_force_max", "shaking_moment_max"):
        values = six[name].values
        assert np.ptp(values) <= 1e-6 * 2720.0, name
    for order in six["firing_order"].values.tolist():
        other = str(of(six, order, "other_way"))
        for name in ("first_mode_torque_order", "first_mode_vector_sum", "first_mode_torque_rms"):
            one = of(six, order, name)
            assert_allclose(of(six, other, name), one, rtol=1e-9, atol=1e-9 * np.abs(one).max())


def test_by_one_quantity_and_the_worst_of_an_axis() -> None:
    found = sweeps.firing_orders(
        {"engine": "ntua", "axes": {"speed": [600.0, 2400.0]}}, arrangement="in-line 6",
        by="first_mode_torque_rms",
    )  # fmt: skip
    worst = found["first_mode_torque_rms"].max("speed").values
    assert worst[found["rank"].values == 1].min() == worst.min()
    text = orders_text(found)
    assert "the worst value over speed counts" in text
    assert "rank_sum" not in text


def test_v8_of_its_own_crank_has_shaking_forces_in_common() -> None:
    found = sweeps.firing_orders(
        "v8_cross_plane_93x86", crank="own", settings={"cylinder_spacing": 0.11}
    )
    assert found.sizes["arrangement"] == 8
    for name in ("shaking_force_max", "shaking_moment_max", "delta"):
        values = found[name].values
        assert np.ptp(values) <= 1e-9 * values.max(), name
    sources = dict(zip(found["firing_order"].values, found["known_order"].values, strict=True))
    assert sources["1-8-7-2-6-5-4-3"].startswith("General Motors LS")
    # The LS is the small block, counted from its other end: its bearings are those mirrored.
    assert of(found, "1-8-4-3-6-5-7-2", "from_other_end") == "1-8-7-2-6-5-4-3"
    assert_allclose(
        of(found, "1-8-4-3-6-5-7-2", "main_journal_load_max"),
        of(found, "1-8-7-2-6-5-4-3", "main_journal_load_max")[::-1], rtol=1e-6,
    )  # fmt: skip


def test_command_writes_an_archive_that_others_read(tmp_path: Path) -> None:
    path = tmp_path / "six.nc"
    done = commands.ok("firing-orders", "ntua", "--arrangement", "in-line 6", "--set",
                       "cylinder_spacing=0.2,speed=1000", "-o", path, "--limit", "5")  # fmt: skip
    assert "8 firing orders, the engine's crankshaft and its mirror image" in done
    assert "the same in all of these rows" in done
    assert "1-5-3-6-2-4 * <" in done
    for command in (
        ["show", str(path), "--sort", "rank", "--quantities", "rank,any_main_journal_load_max"],
        ["best", str(path), "--least", "any_main_journal_load_max"],
        ["info", str(path)],
        ["report", str(path), "-o", str(tmp_path / "six.html")],
        ["export", str(path), "-o", str(tmp_path / "six.csv")],
        ["rerun", str(path), "-o", str(tmp_path / "again.nc")],
    ):
        commands.ok(*command)
    assert commands.refused("firing-orders", "ntua", "-o", path)
    wrong = commands.refused("firing-orders", "ntua", "--set", "speed=fast")
    assert "--set speed=fast: must be KEY=NUMBER" in wrong
