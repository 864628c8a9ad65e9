"""Archives of every kind against the CF conventions, and their units against pint.

The checker is compliance-checker, its suite that of CF-1.11, which archives say that they follow.
It runs once, over all archives, in a process of its own.
"""

import copy
import json
import subprocess
import sys
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import netCDF4
import pytest
import xarray as xr
from cf_xarray.units import units

from engine_dyn.quantities.graph import QUANTITIES
from sweeps.running.archive import netcdf
from sweeps.running.compute import into_archive
from sweeps.running.compute.options import Options
from sweeps.running.join.extend import extend
from sweeps.running.join.merge import merge
from sweeps.scene.plan.plan import make_plan
from sweeps.scene.reading import built_in_scenes, read_scene
from tests.support.archives import shards, sound_archive
from tests.support.scenes import (
    APART,
    GENERATING_SET,
    IN_BLOCKS,
    IN_PASSING,
    NOT_OF_AN_ENGINE,
    OF_TRANSIENTS,
)
from tests.support.shafts import passing_shaft

SUITE = "cf:1.11"
SCRIPTS = Path(sys.executable).parent

# For each of its checks, it looks anew for the results among the variables of a file.
ONCE = """
import functools, sys
from compliance_checker.cf import util
util.get_geophysical_variables = functools.cache(util.get_geophysical_variables)
sys.path.insert(0, sys.argv.pop(1))
from cchecker import main
sys.exit(main())
"""

TOGETHER = 12
"""Quantities of one archive."""

OWN: dict[str, dict[str, Any]] = {
    "words": {"engine": "si_four_87x101", "set": {"cylinders": 8},
        "axes": {"arrangement": ["V8 cross-plane", "V8 flat-plane"], "speed": [1500, 2500]},
        "solver": {"method": ["auto", "newton"], "inertia_model": ["constant", "variable"]},
        "output": {"quantities": ["delta", "torque_order", "omega"], "angle_step": 30}},
    "unit by exponent": {"engine": "ntua", "axes": {"load_exponent": [1.0, 1.6]},
        "output": {"quantities": ["load_coefficient"]}},
    "letters": {"title": "Größe λ ω 漢字", "engine": "ntua",
        "designs": {"case": ["ärmer", "λ = 1/4"], "bore": [0.14, 0.15]},
        "output": {"quantities": ["imep"]}},
}  # fmt: skip


def reduced(name: str) -> dict[str, Any]:
    """A built-in scene with no more than two values along each axis."""
    path = built_in_scenes()[name]
    raw = tomllib.loads(path.read_text(encoding="utf-8"))
    for axis, values in raw.get("axes", {}).items():
        if isinstance(values, dict):
            raw["axes"][axis] = {**values, "num": 2}
        else:
            raw["axes"][axis] = values[:2]
    if "reference" in raw and "designs" not in raw:
        del raw["reference"]  # its rows belong to values that are gone
    for table in ("reference", "indicator", "designs"):
        file = raw.get(table, {}).get("file")
        if file is not None:
            raw[table]["file"] = str(path.with_name(file))
    return raw


def everything() -> Iterator[tuple[str, dict[str, Any]]]:
    """Scenes of every quantity; the checker takes the square of their number as long."""
    names = [name for name in QUANTITIES if name not in APART]
    passing = {**copy.deepcopy(NOT_OF_AN_ENGINE), "engine": "ntua", "shaft": passing_shaft(1)}
    yield "quantities in passing", {**passing, "output": {"quantities": list(IN_PASSING)}}
    followed = {**copy.deepcopy(GENERATING_SET), "engine": "ntua"}
    yield "a speed that does not repeat", {**followed, "output": {"quantities": OF_TRANSIENTS}}
    for number, begin in enumerate(range(0, len(names), TOGETHER)):
        raw: dict[str, Any] = copy.deepcopy(NOT_OF_AN_ENGINE)
        raw |= {"engine": "ntua", "axes": {"speed": [1200, 1300]}}
        chosen = names[begin : begin + TOGETHER]
        raw["output"] = {"quantities": chosen, "angle_step": 30, "highest_order": 2}
        yield f"quantities {number}", raw


def written(folder: Path) -> list[Path]:
    found: list[Path] = []

    def run(name: str, raw: Mapping[str, Any], **options: Any) -> Path:
        path = folder / f"{name.replace(' ', '_')}.nc"
        into_archive.run(make_plan(read_scene(raw)), path, Options(**options))
        found.append(path)
        return path

    for name, raw in (*OWN.items(), *everything()):
        run(name, raw)
    for name, raw in IN_BLOCKS.items():
        run(f"of blocks, {name}", {"engine": "ntua", **raw})
    for name in built_in_scenes():
        run(name, reduced(name))
    run("in 32 bits", OWN["words"], single=True)
    grown = run("compressed", reduced("first"), level=4)
    extend(grown, "inertia", [33.0], Options())
    pieces = shards(reduced("first"), 2, folder)
    found += pieces
    merge(pieces, folder / "merged.nc", Options())
    found.append(folder / "merged.nc")
    return found


@pytest.fixture(scope="module")
def archives(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    return written(tmp_path_factory.mktemp("archives"))


def checked(paths: list[Path], report: Path) -> tuple[int, dict[str, list[str]]]:
    """Status of the checker, and what it says against each file, recommendations too."""
    done = subprocess.run(
        [sys.executable, "-c", ONCE, str(SCRIPTS), f"--test={SUITE}", "--criteria=strict",
         "--format=json_new", f"--output={report}", *map(str, paths)],
        capture_output=True, text=True,
    )  # fmt: skip
    assert report.exists(), done.stderr[-2000:]
    found = {}
    for name, suites in json.loads(report.read_text()).items():
        told = suites[SUITE]
        found[name] = [
            f"{check['name']}: {message}"
            for priority in ("high_priorities", "medium_priorities", "low_priorities")
            for check in told[priority]
            for message in check["msgs"]
            if check["value"][0] < check["value"][1]
        ]
    return done.returncode, found


@pytest.mark.compiled
@pytest.mark.slow
def test_a_checker_of_conventions_finds_nothing(archives: list[Path], tmp_path: Path) -> None:
    assert len(archives) > 25
    status, found = checked(archives, tmp_path / "report.json")
    assert len(found) == len(archives)
    assert not any(found.values()), found
    assert status == 0


def test_the_checker_finds_what_is_wrong(tmp_path: Path) -> None:
    path = tmp_path / "wrong.nc"
    path.write_bytes(sound_archive())
    with netCDF4.Dataset(path, "r+") as file:
        file["delta"].units = "furlong per whim"
        file["speed"].delncattr("units")
        file["status"].flag_meanings = "one"
    status, found = checked([path], tmp_path / "report.json")
    told = " ".join(next(iter(found.values())))
    assert status != 0
    assert "furlong per whim" in told and "flag_" in told


@pytest.mark.compiled
@pytest.mark.slow  # with the other test of all archives, which are made once
def test_pint_xarray_quantifies_every_archive(archives: list[Path]) -> None:
    pytest.importorskip("pint_xarray", reason="pip install pint-xarray")
    for path in archives:
        with netcdf.open_archive(path) as opened:
            dataset = opened.load()
        quantified = dataset.pint.quantify(unit_registry=units)
        for name, variable in quantified.data_vars.items():
            if "units" in dataset[name].attrs:
                assert variable.pint.units == units.Unit(dataset[name].attrs["units"])
            else:
                assert str(name).startswith("load_coefficient")  # of several exponents
        xr.testing.assert_equal(quantified.pint.dequantify(), dataset)
