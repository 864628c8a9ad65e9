"""Engine files: the catalogue, a file of one's own, and every way in which one can be wrong."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from numpy.testing import assert_allclose, assert_array_equal

from engine_dyn.geometry.arrangement import FOUR_STROKE, TWO_STROKE
from engine_dyn.quantities.friction import COMPONENT_NODES
from engine_dyn.quantities.generator import OF_FOUR_STROKES
from engine_dyn.quantities.graph import PARAMETERS, QUANTITIES
from engine_dyn.quantities.parameters import SOLVER_COLUMNS
from sweeps.base.errors import SceneError
from sweeps.scene.engine.engine_files import catalogue, load_engine
from sweeps.scene.features.indicator_files import read_indicator
from sweeps.scene.reading import read_scene
from tests.support.engine_files import POINTS, VALUES, modelled, written
from tests.support.scenes import APART, NOT_OF_AN_ENGINE
from tests.support.shafts import complete_shaft


@pytest.mark.parametrize("name", catalogue())
def test_every_engine_gives_a_value_for_everything(name: str) -> None:
    engine = load_engine(name, Path())
    assert engine.name == name
    assert engine.title
    assert engine.sources
    assert engine.period in (FOUR_STROKE, TWO_STROKE)
    # What any quantity needs: a scene that names only the engine and everything there is.
    of_four_strokes = {*OF_FOUR_STROKES, *(node.name for node in COMPONENT_NODES)}
    quantities = [
        quantity for quantity in QUANTITIES
        if (engine.period == FOUR_STROKE or quantity not in of_four_strokes)
        and quantity not in APART
    ]  # fmt: skip
    asked = {"engine": name, "output": {"quantities": quantities}}
    own = engine.own_cylinders
    throws = len(own.along_shaft or ()) if own is not None else int(engine.values["cylinders"])
    read = read_scene({**asked, **NOT_OF_AN_ENGINE, "shaft": complete_shaft(throws)})
    assert read.engine.name == name
    assert set(engine.values) <= set(PARAMETERS) - {"rod_length", *SOLVER_COLUMNS}
    for reason in engine.assumed.values():
        assert len(reason) > 10


def test_ntua_is_the_engine_of_table_4_1() -> None:
    engine = load_engine("ntua", Path())
    values = engine.values
    assert (values["bore"], values["stroke"], values["inertia"]) == (0.14, 0.18, 2.0)
    assert values["crank_ratio"] == pytest.approx(90.0 / 350.0, rel=1e-12)
    assert (values["speed"], values["load"], values["load_exponent"]) == (1200.0, 50.0, 2.0)
    assert_array_equal(engine.family.loads, [0.0, 50.0, 90.0])
    # Table 5.2 with (3.8) and (3.9) fixes the peak pressures.
    peaks = [diagram.peak / 1e5 for diagram in engine.family.diagrams]
    assert_allclose(peaks, [51.4, 65.4, 80.8], atol=0.1)


def test_points_are_read_from_beside_the_engine_file(tmp_path: Path) -> None:
    path = written(tmp_path, VALUES + POINTS)
    engine = load_engine(path, Path())
    assert engine.name == "mine"
    assert engine.values["crank_ratio"] == pytest.approx(0.09 / 0.35, rel=1e-15)
    assert "rod_length" not in engine.values
    assert (engine.family.low, engine.family.high) == (50.0, 50.0)
    assert engine.pressure_scale is None
    assert engine.firing_order is None
    expected = read_indicator(tmp_path / "pressure.csv")
    assert_array_equal(engine.family.diagrams[0].pressure, expected.pressure)


def test_everything_optional(tmp_path: Path) -> None:
    text = VALUES.replace('name = "mine"\n', "firing_order = [2, 1]\n") + POINTS
    text += (
        '[pressure_scale]\nspeed = [1000, 2000]\nscale = [1, 1.2]\n[assumed]\nbore = "a guess"\n'
    )
    text += '[[source]]\ntext = "Author 1999"\n[[source]]\ntext = "Other 2001"\n'
    engine = load_engine(written(tmp_path, text), Path())
    assert engine.name == "mine"  # the file's
    assert engine.firing_order == (2, 1)
    assert engine.assumed == {"bore": "a guess"}
    assert engine.sources == ("Author 1999", "Other 2001")
    assert engine.pressure_scale is not None
    assert_array_equal(engine.pressure_scale[1], [1.0, 1.2])
    _, cycle, rest = VALUES.partition("cycle = ")
    for name, head in (("mine", ""), ("own", 'name = "own"\n')):
        plain = load_engine(written(tmp_path, head + cycle + rest + modelled()), Path())
        assert (plain.name, plain.title) == (name, name)  # without a title
        assert 1e6 < plain.family.diagrams[0].peak < 2e7


def test_what_an_engine_lacks_is_told(tmp_path: Path) -> None:
    path = written(tmp_path, VALUES.replace("inertia = 2\n", "") + POINTS)
    scene = {"engine": str(path), "output": {"quantities": ["delta"]}}
    with pytest.raises(SceneError, match=r"'delta' needs inertia .* engine mine does not give"):
        read_scene(scene)
    read_scene({**scene, "set": {"inertia": 2}})
    read_scene({**scene, "output": {"quantities": ["torque"]}})
    path = written(tmp_path, VALUES.replace("inertia = 2\n", "") + POINTS)
    scene = {"engine": str(path), "output": {"quantities": ["delta", "rotating_mass"]}}
    with pytest.raises(SceneError) as told:
        read_scene(scene)
    line = str(told.value)
    assert "'delta', 'rotating_mass' need " in line
    assert all(f"{key} (" in line for key in ("inertia", "crank_mass", "rod_mass"))
    assert line.endswith(f"must be in [set], [axes] or [designs], or in [values] of {path.name}")
    with pytest.raises(SceneError, match=r"must be in \[set\], \[axes\] or \[designs\]$"):
        read_scene({
            "engine": "ntua", "set": {"friction_boundary": 0.3},
            "output": {"quantities": ["delta"]},
        })  # fmt: skip


def swapped(old: str, new: str) -> Callable[[], str]:
    def text() -> str:
        whole = VALUES + POINTS
        assert old in whole
        return whole.replace(old, new)

    return text


def added(more: str) -> Callable[[], str]:
    return lambda: VALUES + POINTS + more


def cycle(old: str, new: str) -> Callable[[], str]:
    def text() -> str:
        lines = [new if line.startswith(old) else line for line in modelled().splitlines()]
        assert new in lines
        return VALUES + "\n".join(lines) + "\n"

    return text


WRONG: list[tuple[Any, ...]] = [
    (swapped("bore = 0.14", "bore = 0,14"), "line 9", "not TOML", "of bore", "mark is a point"),
    (swapped("bore = 0.14", "bore = .14"), "line 9", "not TOML", "of bore", "write 0.084 in place"),
    (swapped("bore = 0.14", "bore = 14."), "line 9", "not TOML", "of bore", "84.0 of 84."),
    (swapped("bore = 0.14", "bore = 140 mm"), "line 9", "of bore", "without their unit"),
    (swapped("bore = 0.14", "bore = 1/7"), "line 9", "of bore; a fraction needs quotes"),
    (swapped('"four-stroke"', "four-stroke"), "a text needs quotes"),
    (added("[value]\nbore = 1\n"), "value", "did you mean 'values'"),
    (swapped("bore =", "boer ="), "[values] boer", "did you mean 'bore'"),
    (swapped('cycle = "four-stroke"', ""), "cycle", "missing", "four-stroke"),
    (lambda: "[values]\nspeed = 225\n", "cycle: missing", "[values] cylinders: missing"),
    (swapped("four-stroke", "six-stroke"), "cycle = 'six-stroke'", "two-stroke"),
    (swapped("bore = 0.14", 'bore = "140 kg"'), "bore = '140 kg'", "in m"),
    (swapped("bore = 0.14", "bore = true"), "bore = true", "number"),
    (swapped("bore = 0.14", "bore = nan"), "bore = nan", "finite"),
    (swapped("bore = 0.14", "bore = -0.14"), "bore = -0.14", "above 0"),
    (swapped("cylinders = 2", "cylinders = 1.5"), "= 1.5", "whole"),
    (swapped("rod_length = 0.35", "rod_length = 0.35\ncrank_ratio = 0.25"), "crank_ratio",
     "rod_length"),
    (swapped("rod_length = 0.35", "rod_length = 0.08"), "= 0.08", "0.09 m"),
    (swapped("stroke = 0.18", ""), "stroke", "missing"),
    (swapped("file =", "fille ="), "[[diagram]] number 1 file: missing (other keys: fille)"),
    (lambda: VALUES.replace("load = 50\ncyl", "cyl") + POINTS
     + POINTS.replace("load = 50", "load = 90"),
     "[values] load", "missing"),
    (swapped("cylinders = 2", ""), "[values] cylinders", "missing"),
    (swapped("load = 50\ncyl", "load = 60\ncyl"), "[values] load = 60", "50"),
    (added("[pressure_scale]\nspeed = [2000, 3000]\nscale = [1, 1]\n"), "[values] speed = 1200",
     "2000 to 3000"),
    (added("[pressure_scale]\nspeed = [1000, 2000]\nscale = [1]\n"), "[pressure_scale]", "2 speeds",
     "1 factor"),
    (added("[pressure_scale]\nspeed = [2000, 1000]\nscale = [1, 1]\n"), "[pressure_scale] speed",
     "ascend"),
    (added("[pressure_scale]\nspeed = [1000, 2000]\nscale = [1, 0]\n"), "[pressure_scale] scale",
     "above 0"),
    (swapped("[values]", "firing_order = [1]\n[values]"), "firing_order = [1]", "1 to 2"),
    (swapped("[values]", "firing_order = [1, 1]\n[values]"), "firing_order = [1, 1]", "once"),
    (swapped("[values]", 'firing_order = ["1", "2"]\n[values]'), "firing_order",
     "list of cylinder numbers"),
    (swapped('load = 50\nkind', "kind"), "number 1 load", "missing"),
    (swapped('kind = "points"', ""), "number 1 kind", "missing"),
    (swapped('"points"', '"curve"'), "kind = 'curve'", "diesel_cycle", "points"),
    (swapped('file = "pressure.csv"', ""), "number 1 file", "missing"),
    (swapped("pressure.csv", "none.csv"), "none.csv", "no such file"),
    (swapped('file = "p', 'fiel = "x"\nfile = "p'), "fiel", "did you mean 'file'"),
    (added(POINTS), "[[diagram]]", "ascend"),
    (swapped("load = 50\nkind", "load = -1\nkind"), "load = -1", "0 or more"),
    (cycle("compression_ratio", ""), "compression_ratio", "missing"),
    (cycle("compression_ratio", "compression_ratio = 0.5"), "[[diagram]] number 1",
     "compression_ratio"),
    (cycle("compression_ratio", "compresion_ratio = 15"), "compresion_ratio",
     "did you mean 'compression_ratio'"),
    (lambda: (VALUES + modelled()).replace("four-stroke", "two-stroke"), "diesel_cycle",
     "four-stroke"),
    (added("[assumed]\nbore = true\n"), "bore", "reason"),
    (added('[[source]]\nname = "x"\n'), "source", "name", "text"),
]  # fmt: skip


@pytest.mark.parametrize("case", range(len(WRONG)))
def test_engine_file_is_refused_in_one_line(case: int, tmp_path: Path) -> None:
    text, *words = WRONG[case]
    path = written(tmp_path, text())
    with pytest.raises(SceneError) as caught:
        load_engine(path, Path())
    message = str(caught.value)
    assert "\n" not in message
    for word in ("mine.toml", *words):
        assert word in message, message
