"""Firing orders of an engine, computed side by side and ranked."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

import sweeps
from sweeps.dimensions import OF_ORDERS
from sweeps.figures import draw
from sweeps.presenting.firing_orders import orders_text
from tests.support import commands
from tests.support.scenes import refusal_of


@pytest.fixture(scope="module")
def six() -> xr.Dataset:
    return sweeps.firing_orders("ntua", arrangement="in-line 6", settings={"cylinder_spacing": 0.2})


@pytest.fixture(scope="module")
def file_of_six(six: xr.Dataset, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("six") / "six.nc"
    six.to_netcdf(path)
    return path


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
    # And one crankshaft, or its mirror image, shakes alike.
    for name in ("shaking_force_max", "shaking_moment_max"):
        values = six[name].values
        assert np.ptp(values) <= 1e-6 * 2720.0, name
    # Reverse orders excite the shaft alike.
    for order in six["firing_order"].values.tolist():
        other = str(of(six, order, "other_way"))
        for name in ("first_mode_torque_order", "first_mode_vector_sum", "first_mode_torque_rms"):
            one = of(six, order, name)
            assert_allclose(of(six, other, name), one, rtol=1e-9, atol=1e-9 * np.abs(one).max())


def test_bearings_of_an_engine_counted_from_its_other_end() -> None:
    """The in-line five is another order from its other end: its bearings are mirrored."""
    found = sweeps.firing_orders("ntua", arrangement="in-line 5")
    assert found["from_other_end"].values.tolist() == found["firing_order"].values[::-1].tolist()
    loads = found["main_journal_load_max"].transpose("arrangement", "main_bearing").values
    assert_allclose(loads[0], loads[1, ::-1], rtol=1e-6)
    assert found["rank"].values.tolist() == [1, 1]  # nothing tells them apart


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


def test_a_sample_of_too_many() -> None:
    found = sweeps.firing_orders(
        "ntua", arrangement="in-line 8", crank="any", sample=6, seed=3,
        settings={"cylinder_spacing": 0.2},
    )  # fmt: skip
    orders = found["firing_order"].values.tolist()
    assert len(set(orders)) == 6
    assert "1-5-2-6-8-4-7-3" in orders
    about = json.loads(found.attrs[OF_ORDERS])
    assert (about["orders"], about["computed"]) == (5040, 6)
    assert "5,040 firing orders" in orders_text(found)


REFUSED = [
    (("nobody",), {}, r"^'nobody': neither an engine nor a scene, and no such file"),
    (("ntua",), {}, r"^ntua: 1 cylinder, crank either-hand: there is only one firing order"),
    (("ntua",), {"arrangement": "in-line 6", "crank": "both"}, r"^crank = 'both': must be"),
    (("ntua",), {"arrangement": "in-line 6 1-2"}, r"^arrangement = 'in-line 6 1-2': order"),
    (("ntua",), {"arrangement": "in-line 12 1-7-5-11-3-9-6-12-2-8-4-10", "crank": "any"},
     r"39,916,800 firing orders; at most 1,000 are computed; choose another crank \(own"),
    (("ntua",), {"arrangement": "in-line 6", "crank": "any"}, r"so give cylinder_spacing \[m\]"),
    (("ntua",), {"arrangement": "in-line 6", "sample": 1}, r"^sample = 1: must be"),
    (("ntua",), {"arrangement": "in-line 6", "by": "imep"}, r"^by imep: is the same"),
    (("ntua",), {"arrangement": "in-line 6", "by": "imepp"}, r"'imepp': unknown quantity"),
    (("thesis",), {}, r"^thesis: \[designs\]: not allowed when all firing orders"),
    (("i4_v6_i6",), {}, r"^i4_v6_i6: the scene has several engines or arrangements"),
]  # fmt: skip


@pytest.mark.parametrize(("given", "options", "message"), REFUSED)
def test_refused_in_one_line(given: tuple[str], options: dict[str, object], message: str) -> None:
    assert re.search(message, refusal_of(lambda: sweeps.firing_orders(*given, **options)))


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


def test_figures(six: xr.Dataset, file_of_six: Path, tmp_path: Path) -> None:
    with sweeps.open(file_of_six) as archive:
        paths = draw(archive, tmp_path, "svg")
    names = {path.stem for path in paths}
    assert "firing_orders" in names
    assert not {"rank", "rank_sum"} & names
    text = next(path for path in paths if path.stem == "firing_orders").read_text()
    assert text.count("<!-- 1-5-3-6-2-4 -->") == 1
