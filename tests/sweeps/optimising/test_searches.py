"""Searches find what is known by other means, and say how sure they are."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_array_equal

import sweeps
from engine_dyn.status import has_numbers
from sweeps.decide.optimise import ATTRIBUTE_OF_SEARCH
from sweeps.view.texts.optimised import optimised_text
from tests.support.commands import invoke, ok

pytestmark = pytest.mark.compiled

SMALL: dict[str, Any] = {"number": 32, "generations": 6, "restarts": 2}
POINTS = {"load": [50.0, 90.0], "speed": [1200.0, 1500.0]}
LOADS = {"load": [50.0, 90.0]}
QUIET = ["all"]


def about(archive: xr.Dataset) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(archive.attrs[ATTRIBUTE_OF_SEARCH])
    return found


def found(archive: xr.Dataset) -> xr.Dataset:
    return archive.isel(design=np.flatnonzero(archive["found"].values))


def delta_with(inertia: float, **more: Any) -> float:
    one = sweeps.run(
        engine="ntua", set={"inertia": inertia}, axes=POINTS, output={"quantities": ["delta"]},
        silenced_warnings=QUIET, **more,
    )  # fmt: skip
    return float(one["delta"].max())


def test_the_least_inertia_is_found_exactly() -> None:
    """Delta is at the limit with it, and above with a thousandth less."""
    archive = sweeps.optimise(
        engine="ntua", axes=POINTS, least="inertia", within="delta <= 1/200",
        over="inertia = 1 to 100", silenced_warnings=QUIET,
    )  # fmt: skip
    assert archive.sizes["design"] == 1 and about(archive)["exact"] == "inverse"
    inertia = float(found(archive)["inertia"].item())
    assert 0.005 * (1.0 - 3e-6) < float(archive["delta"].max()) <= 0.005
    assert delta_with(inertia) <= 0.005 < delta_with(0.999 * inertia)
    assert "exact: the inertia follows" in optimised_text(archive)
    assert "best found" not in optimised_text(archive)


def test_the_least_inertia_is_that_of_the_energy_swing_where_delta_is_small() -> None:
    """Delta is proportional to the swing up to its square: Theta = dW/(delta omega^2)."""
    scene = {"engine": "ntua", "set": {"load": 90.0, "speed": 1500.0, "load_exponent": 0.0},
             "silenced_warnings": QUIET}  # fmt: skip
    archive = sweeps.optimise(
        scene, least="inertia", within="delta <= 1/2000", over="inertia = 1 to 2000"
    )
    swing = float(sweeps.run(scene, output={"quantities": ["energy_swing"]})["energy_swing"])
    expected = swing / (0.0005 * (1500.0 * np.pi / 30.0) ** 2)
    assert float(archive["inertia"].item()) == pytest.approx(expected, rel=1e-3)


def test_an_inertia_without_that_of_idler_gears_is_searched() -> None:
    """The inverse has their inertia in it, the key `inertia` has not."""
    archive = sweeps.optimise(
        engine="ntua", axes=POINTS, least="inertia", over="inertia = 1 to 100",
        within="delta <= 1/200", idler_gears=[{"inertia": 2.0, "ratio": -2.0}],
        silenced_warnings=QUIET, **SMALL,
    )  # fmt: skip
    assert about(archive)["exact"] == ""
    best = found(archive)
    assert float(best["delta"].max()) <= 0.005
    with_them = float(best["inertia"].item()) + 2.0**2 * 2.0
    assert delta_with(with_them) == pytest.approx(float(best["delta"].max()), rel=1e-6)


def test_a_condition_that_changes_with_the_inertia_is_searched() -> None:
    """The largest speed falls with the inertia: here it needs a heavier one than delta does."""
    limit = delta_speed(30.0)
    archive = sweeps.optimise(
        engine="ntua", axes=POINTS, least="inertia", over="inertia = 5 to 100",
        within=["delta <= 1/50", f"omega_max <= {limit!r}"], silenced_warnings=QUIET, **SMALL,
    )  # fmt: skip
    assert about(archive)["exact"] == ""
    assert 30.0 <= float(found(archive)["inertia"].item()) < 30.3


def delta_speed(inertia: float) -> float:
    one = sweeps.run(engine="ntua", set={"inertia": inertia}, axes=POINTS,
                     output={"quantities": ["omega_max"]})  # fmt: skip
    return float(one["omega_max"].max())


TWO: dict[str, Any] = {
    "engine": "ntua",
    "axes": LOADS,
    "least": "delta",
    "within": "inertia <= 40",
    "over": ["inertia = 10 to 60", "rod_length = 0.36 to 0.5"],
    "silenced_warnings": QUIET,
}


def test_no_grid_has_a_better_design() -> None:
    archive = sweeps.optimise(**TWO, **{**SMALL, "generations": 25})
    grid = sweeps.run(
        engine="ntua",
        axes={**LOADS, "inertia": np.linspace(10.0, 40.0, 31),
              "rod_length": np.linspace(0.36, 0.5, 29)},
        output={"quantities": ["delta"]}, silenced_warnings=QUIET,
    )  # fmt: skip
    best = float(found(archive)["delta"].max())
    assert best <= float(grid["delta"].max("load").min()) * (1.0 + 1e-4)
    assert float(found(archive)["inertia"].item()) <= 40.0


def test_what_is_found_is_what_best_finds() -> None:
    archive = sweeps.optimise(**TWO, **SMALL)
    best = sweeps.best(archive, least="delta", within="inertia <= 40", at_every="load")
    assert float(best["inertia"]) == float(found(archive)["inertia"].item())
    text = optimised_text(archive)
    assert text.startswith("best found: least delta = ") and "a better one may exist" in text
    assert "optim" not in text


def test_the_same_seed_gives_the_same_archive() -> None:
    one, same = (sweeps.optimise(**TWO, **SMALL, threads=n) for n in (1, 2))
    other = sweeps.optimise(**TWO, **SMALL, seed=2)
    for name in one.variables:
        assert_array_equal(one[name].values, same[name].values)
    assert not np.array_equal(one["inertia"][:32], other["inertia"][:32])


def test_a_space_that_can_be_counted_is_computed_whole() -> None:
    archive = sweeps.optimise(
        engine="ntua", axes=LOADS, least="delta", within="torque_range <= 4 kN m",
        over=["cylinders = 1 to 4", "rod_length = 0.36, 0.42, 0.5"], set={"inertia": 20.0},
    )  # fmt: skip
    assert about(archive)["exact"] == "all" and archive.sizes["design"] == 12
    grid = sweeps.run(
        engine="ntua", set={"inertia": 20.0}, output={"quantities": ["delta", "torque_range"]},
        axes={**LOADS, "cylinders": [1, 2, 3, 4], "rod_length": [0.36, 0.42, 0.5]},
    )  # fmt: skip
    worst = grid.max("load")
    good = worst["delta"].where(worst["torque_range"] <= 4000.0)
    assert 1 < int(good.notnull().sum()) < 12
    assert float(found(archive)["delta"].max()) == pytest.approx(float(good.min()), rel=1e-9)
    assert "all 12 designs that are possible were computed" in optimised_text(archive)


def test_words_and_whole_numbers_are_searched_with_ranges() -> None:
    archive = sweeps.optimise(
        engine="si_four_87x101", axes={"load": [50.0, 100.0]}, set={"speed": 3000.0},
        least="delta", within="inertia <= 0.3",
        over=["inertia = 0.1 to 0.5", "arrangement = in-line 4 | in-line 6 | boxer 6"],
        silenced_warnings=QUIET, **SMALL,
    )  # fmt: skip
    best = found(archive)
    assert "6" in str(best["arrangement"].item())
    assert 0.29 < float(best["inertia"].item()) <= 0.3
    assert len(set(archive["arrangement"].values)) == 3
    # each design is there once
    rows = list(zip(archive["inertia"].values, archive["arrangement"].values, strict=True))
    assert len(set(rows)) == len(rows)


def test_designs_that_fail_are_never_found_and_stop_nothing() -> None:
    archive = sweeps.optimise(
        engine="ntua", set={"load": 90.0, "speed": 600.0}, most="delta",
        over="inertia = 0.2 to 40 log", silenced_warnings=QUIET, **SMALL,
    )  # fmt: skip
    assert (archive["status"] == 1).any() and about(archive)["lacking"] > 0
    best = found(archive)
    assert has_numbers(best["status"].item())  # Next to stalling, perhaps of less accuracy
    assert float(best["delta"].item()) == float(archive["delta"].max())


def test_of_bearings_the_worst_counts() -> None:
    archive = sweeps.optimise(
        engine="si_four_87x101", axes={"load": [50.0, 100.0]}, set={"cylinder_spacing": 0.097},
        least="main_journal_load_max", over="counterweight_fraction = 0 to 1", **SMALL,
    )  # fmt: skip
    assert "main_bearing" in archive["main_journal_load_max"].dims
    worst = archive["main_journal_load_max"].max(["load", "main_bearing"])
    assert int(np.argmin(worst.values)) == int(np.argmax(archive["found"].values))


@pytest.mark.parametrize("names", [["inertia", "delta"], ["inertia", "delta", "rod_length"]])
def test_a_front_is_that_of_all_designs(names: list[str]) -> None:
    archive = sweeps.optimise(
        engine="ntua", axes=LOADS, least=names, within="torque_range <= 1e5",
        over=["inertia = 10 to 60", "rod_length = 0.36 to 0.5"], silenced_warnings=QUIET, **SMALL,
    )  # fmt: skip
    front = sweeps.pareto(archive, *names, at_every="load")
    assert sorted(front["design"].values) == sorted(found(archive)["design"].values)
    assert front.sizes["front"] > 10
    text = optimised_text(archive)
    assert f"front of {front.sizes['front']} designs" in text
    assert text.count("\n") < 30


SCENE = """
engine = "ntua"
silenced_warnings = ["all"]
[sample]
inertia = { low = 10.0, high = 60.0 }
rod_length = { low = 0.36, high = 0.5 }
[axes]
load = [50, 90]
[output]
quantities = ["imep", "omega"]
"""
SEARCH = ("--least", "delta", "--within", "inertia <= 40", "--designs", "32", "--generations", "4",
          "--restarts", "1")  # fmt: skip


@pytest.fixture(scope="module")
def searched(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """The archive of a search by the command, and what it printed."""
    folder = tmp_path_factory.mktemp("search")
    (folder / "scene.toml").write_text(SCENE)
    path = folder / "search.nc"
    return path, ok("optimise", folder / "scene.toml", *SEARCH, "-o", path)


def test_the_command_prints_and_writes(searched: tuple[Path, str]) -> None:
    path, said = searched
    assert said.startswith("best found: least delta = ")
    assert "not shown, because they are curves: omega" in said
    with sweeps.open(path) as archive:
        assert archive.sizes["design"] == 128 and "omega" not in archive
        assert archive["imep"].dims == ("design", "load")
        assert optimised_text(archive).splitlines()[0] == said.splitlines()[0]


def test_an_interrupted_search_writes_nothing(
    searched: tuple[Path, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from sweeps.decide.optimise import evaluation

    computed, compute = [0], evaluation.compute

    def stops(*given: Any, **more: Any) -> Any:
        computed[0] += 1
        if computed[0] == 3:
            raise KeyboardInterrupt
        return compute(*given, **more)

    monkeypatch.setattr(evaluation, "compute", stops)
    monkeypatch.chdir(tmp_path)  # Folders are created below the current one alone
    output = tmp_path / "out" / "search.nc"
    done = invoke("optimise", searched[0].with_name("scene.toml"), *SEARCH, "-o", output)
    assert done.exit_code == 1 and "interrupted; nothing was written" in done.stderr
    assert not output.exists() and not list(tmp_path.rglob("*.part"))


EXACT = """
engine = "ntua"
silenced_warnings = ["all"]
[set]
load = 90
speed = 1500
[output]
quantities = ["delta"]
"""


@pytest.mark.parametrize(
    ("over", "plain"),
    [
        ("inertia = 1 to 100 kg m2", {"low": 1.0, "high": 100.0}),
        ("inertia = 100 to 2000 lb ft2", {"low": 4.214011009380, "high": 84.28022018761}),
        ("bore = 100 to 110 mm", {"low": 0.1, "high": 0.11}),
        ("bore = 100, 105, 110 mm", [0.1, 0.105, 0.11]),
        ("bore = 1.0 to 1.1 dm log", {"low": 0.1, "high": 0.11, "spacing": "log"}),
    ],
)
def test_ranges_have_units(over: str, plain: Any, tmp_path: Path) -> None:
    """The command and Python find what the same range in the units of scenes gives."""
    key = over.partition(" ")[0]
    scene, path = tmp_path / "exact.toml", tmp_path / "found.nc"
    scene.write_text(EXACT if key == "inertia" else EXACT.replace("load", "inertia = 12\nload"))
    least = "inertia" if key == "inertia" else "delta"
    few = {"number": 8, "generations": 2, "restarts": 1}
    options = ("--least", least, "--within", "delta <= 1/20", "--designs", "8",
               "--generations", "2", "--restarts", "1")  # fmt: skip
    assert f"least {least} = " in ok("optimise", scene, *options, "--over", over, "-o", path)
    wanted: dict[str, Any] = {"least": least, "within": "delta <= 1/20", **few}
    by_python = sweeps.optimise(scene, **wanted, over=over)
    without = sweeps.optimise(scene, **wanted, over={key: plain})
    tables = about(by_python)["over"]
    ends = plain if isinstance(plain, list) else [plain["low"], plain["high"]]
    read = tables[key] if isinstance(plain, list) else [tables[key][e] for e in ("low", "high")]
    assert read == pytest.approx(ends, rel=1e-12)
    with sweeps.open(path) as archive:
        for one in (archive, by_python):
            assert found(one)[key].values == pytest.approx(found(without)[key].values, rel=1e-9)
    assert "end of" not in optimised_text(by_python)


def test_a_value_at_the_end_of_a_range_with_a_unit_is_marked(tmp_path: Path) -> None:
    archive = sweeps.optimise(
        engine="ntua", set={"load": 90, "speed": 1500}, least="delta", silenced_warnings=QUIET,
        over={"inertia": {"low": "1000 kg dm2", "high": "20 kg m2"}}, **SMALL,
    )  # fmt: skip
    assert "inertia = 20 kg m², the upper limit of its range" in optimised_text(archive)
