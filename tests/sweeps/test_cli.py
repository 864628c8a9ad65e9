"""The command line as a user meets it: files, what is printed, lists, exit status."""

import itertools
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import click
import numpy as np
import pytest
import xarray as xr
from click.shell_completion import ShellComplete
from click.testing import CliRunner
from numpy.testing import assert_array_equal

import sweeps
from engine_dyn.quantities.graph import NUMBERED, PARAMETERS, PATTERNS, QUANTITIES, SOURCES
from engine_dyn.status import MEANINGS
from sweeps.cli.main import COMMANDS, main
from sweeps.scene.engine.cylinder_keys import CYLINDER_KEYS
from sweeps.scene.engine.engine_files import catalogue, load_engine
from sweeps.scene.features import GIVEN_FEATURES, KEYS_OF_SET
from sweeps.scene.features.shaft import built_in_shafts
from sweeps.scene.reading import built_in_scenes
from sweeps.view.texts.lists import symbol_text
from sweeps.view.texts.published import text as reference_text
from tests.support import commands
from tests.support.archives import PLAIN, sound_archive
from tests.support.commands import invoke, ok, refused
from tests.sweeps.processes import COMMAND, ROOT

SCENE = """\
title = "A small map"
engine = "ntua"

[axes]
inertia = [1.5, 2.0, 5.0]
speed = [1200, 1500]

[output]
quantities = ["delta", "omega_mean", "torque"]
angle_step = 5
"""

# At this inertia the engine stops within its cycle.
STALLING = """\
engine = "ntua"

[axes]
inertia = [0.01, 2.0]

[output]
quantities = ["delta"]
fail_on = ["stalled", "not_converged"]
"""


def shell(
    *arguments: str | Path, folder: Path, text: str | None = None
) -> subprocess.CompletedProcess[str]:
    """Run the installed command in a process of its own."""
    command = Path(sys.executable).with_name("engine-dyn")
    return subprocess.run(
        [str(command), *map(str, arguments)],
        cwd=folder, capture_output=True, text=True, input=text,
    )  # fmt: skip


@pytest.fixture(scope="module")
def archive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("archive")
    folder.joinpath("scene.toml").write_text(SCENE)
    path = folder / "out.nc"
    assert invoke("run", folder / "scene.toml", "-o", path, "-q").output == ""
    return path


@pytest.mark.slow
def test_a_first_session(tmp_path: Path) -> None:
    """New, run, info, plot, as the README has it."""
    made = shell("new", "my.toml", folder=tmp_path)
    assert (made.returncode, made.stderr) == (0, "")
    done = shell("run", "my.toml", "-o", "deep/er/out.nc", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "75 designs" in done.stdout
    assert "converged 75" in done.stdout
    assert re.search(r"computing \d+\.\d+ s, writing \d+\.\d+ s", done.stdout)
    assert "deep/er/out.nc (" in done.stdout
    assert "%|" not in done.stderr  # no progress bar without a terminal
    with xr.open_dataset(tmp_path / "deep/er/out.nc") as dataset:
        assert dataset["delta"].dims == ("load", "inertia")
        assert dataset["delta"].shape == (3, 25)
    told = shell("info", "deep/er/out.nc", folder=tmp_path)
    assert told.returncode == 0
    assert "inertia (25)" in told.stdout
    drawn = shell("plot", "deep/er/out.nc", "-o", "figures", folder=tmp_path)
    assert drawn.returncode == 0, drawn.stderr
    paths = [tmp_path / line for line in drawn.stdout.splitlines()]
    assert paths
    assert all(path.stat().st_size > 1000 and path.suffix == ".png" for path in paths)
    again = shell("run", "my.toml", "-o", "deep/er/out.nc", folder=tmp_path)
    assert again.returncode == 2
    assert again.stderr.count("\n") == 1
    assert "--overwrite" in again.stderr
    assert sorted(p.name for p in (tmp_path / "deep/er").iterdir()) == ["out.nc"]


@pytest.mark.parametrize("name", sorted(main.commands))
def test_an_option_with_one_value_is_given_once(name: str) -> None:
    """The last one counted in silence."""
    command = main.commands[name]
    for option in command.get_params(click.Context(command)):
        if not isinstance(option, click.Option) or option.is_flag:
            continue
        for first, second in itertools.product(option.opts, repeat=2):
            words = [name, first, "1", second, "2"]
            if option.multiple:
                assert "given 2 times" not in invoke(*words).output
            else:
                told = f"{option.opts[-1]}: given 2 times; must be given once"
                assert told in refused(*words)
    assert "given" not in invoke(name, "--help", "--help").output.splitlines()[0]


@pytest.mark.slow
def test_a_scene_comes_from_the_standard_input_or_a_pipe(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(SCENE)
    output = tmp_path / "out.nc"
    expected = ok("plan", tmp_path / "scene.toml")
    told = CliRunner().invoke(main, ["plan", "-"], input=SCENE)
    assert told.exit_code == 0 and told.stdout == expected
    words = ["run", "-o", output, "-q", "--overwrite"]
    done = CliRunner().invoke(main, [*map(str, words), "-"], input=SCENE)
    assert done.exit_code == 0, done.output
    with sweeps.open(output) as archive:
        assert archive.delta.shape == (3, 2)
    output.unlink()
    assert shell(*words, "/dev/stdin", folder=tmp_path, text=SCENE).returncode == 0
    with sweeps.open(output) as archive:
        assert archive.delta.shape == (3, 2)
    bad = CliRunner().invoke(main, ["plan", "-"], input="engine = 1\nx = [")
    assert bad.exit_code == 2 and bad.stderr.startswith("engine-dyn: standard input, line 2: ")


def test_designs_that_fail_end_with_3_where_asked(tmp_path: Path) -> None:
    tmp_path.joinpath("scene.toml").write_text(STALLING)
    done = invoke("run", tmp_path / "scene.toml", "-o", tmp_path / "out.nc")
    assert done.exit_code == 3, done.stderr
    assert "stalled 1" in done.stderr
    assert "stalled 1" in done.stdout
    with xr.open_dataset(tmp_path / "out.nc") as dataset:
        assert_array_equal(dataset["status"], [MEANINGS.index("stalled"), 0])
        assert_array_equal(np.isnan(dataset["delta"]), [True, False])


@pytest.mark.parametrize(
    ("text", "run", "info"),
    [
        (STALLING.replace('"stalled", "not_converged"', ""),
         "outcomes: converged 1, stalled 1", "  converged: 1\n  stalled: 1\n"),
        ('engine = "ntua"\naxes = { main_journal_width = [0.03, 0.04, 0.05], speed = [900, 950] }\n'
         'set = { main_journal_diameter = 0.09 }\n'
         '[output]\nquantities = ["main_journal_pressure_max", "delta"]\n',
         "6 designs\noutcomes: converged 6\n", "outcomes\n  converged: 6\n"),
        pytest.param(
            'engine = "ntua"\naxes = { wanted_delta = [0.05, 1.9] }\n'
            '[output]\nquantities = ["inertia_required"]\n',
            "converged 1, stalled 1\nstalled: the wanted delta is so large that the", "stalled: 1",
            marks=pytest.mark.slow,
        ),
    ],
    ids=["failed ones are only counted", "those of all designs", "a wanted delta of no inertia"],
)  # fmt: skip
def test_outcomes_are_told(text: str, run: str, info: str, tmp_path: Path) -> None:
    path, out = tmp_path / "scene.toml", tmp_path / "out.nc"
    path.write_text(text)
    assert run in ok("run", path, "-o", out)
    assert info in ok("info", out)


def test_a_failure_leaves_the_old_archive_and_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: Any, **__: Any) -> None:
        raise RuntimeError("something\nwent wrong")

    monkeypatch.setattr("sweeps.cli.running.writing", broken)
    out = tmp_path / "out.nc"
    out.write_text("kept")
    result = invoke("run", "first", "-o", out, "--overwrite")
    assert result.exit_code == 1
    assert result.stderr == (
        "engine-dyn: failed: RuntimeError: something went wrong (--debug shows where)\n"
    )
    shown = invoke("run", "first", "-o", out, "--overwrite", "--debug")
    assert shown.exit_code == 1
    assert "Traceback" in shown.stderr
    assert out.read_text() == "kept"


def test_info_tells_axes_quantities_outcomes_values_and_provenance(
    archive: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = ok("info", archive, "--provenance")
    for expected in (
        "A small map", "inertia (3): 1.5, 2, 5 [kg m2]", "crank_angle (144)", "delta ",
        " rpm  ", "converged: 6", "  6 designs, ", " of results, float64, not compressed, ",
        ", computed in ", "history: ", "engine: ntua",
    ):  # fmt: skip
        assert expected in text, text
    assert text.index("converged: 6") < text.index("delta ") < text.index("history: ")
    short = ok("info", archive)
    assert "history: " not in short and "--provenance" in short
    with sweeps.open(archive) as data:
        low, high = float(data.delta.min()), float(data.delta.max())
    rows = [line for line in ok("info", archive).splitlines() if "; over " in line]
    told = next(line for line in rows if line.startswith("  delta "))
    assert [float(word) for word in told.split()[1:4:2]] == pytest.approx([low, high], rel=1e-3)
    monkeypatch.setattr("sweeps.view.texts.archives.MOST_READ", 100)
    text = ok("info", archive)
    assert "ranges of quantities of more than 100 values" in text
    rows = [line for line in text.splitlines() if "; over " in line]
    (curve,) = (line for line in rows if line.startswith("  torque "))
    found = re.search(r"  not read \[N m\]  +", curve)
    assert found is not None
    begin = found.end()
    assert all(line[begin - 2 : begin] == "  " and line[begin] != " " for line in rows)


@pytest.mark.parametrize("name", catalogue())
def test_info_of_an_engine_lists_what_is_assumed_and_why(name: str, tmp_path: Path) -> None:
    engine = load_engine(name, Path())
    text = ok("info", name)
    for key, reason in engine.assumed.items():
        assert key in text
        assert " ".join(reason.split()) in text
    for key in engine.values:
        assert f"  {key} = " in text
    assert "[1]" not in text
    scene = tmp_path / "scene.toml"
    scene.write_text(f'engine = "{name}"\n[output]\nquantities = ["mean_piston_speed"]\n')
    ok("run", scene, "-o", tmp_path / "out.nc")
    told = ok("info", tmp_path / "out.nc", "--provenance")
    for key, reason in engine.assumed.items():
        assert f"{key}: {' '.join(reason.split())}" in told


@pytest.mark.parametrize(
    ("what", "names"),
    [
        ("quantities", list(QUANTITIES)),
        (
            "keys",
            [
                *(k for k in PARAMETERS if k not in NUMBERED),
                *PATTERNS,
                *CYLINDER_KEYS,
                "firing_pattern",
                *KEYS_OF_SET,
                *(name for name, one in GIVEN_FEATURES.items() if not one.key),
            ],
        ),
        ("engines", list(catalogue())),
        ("scenes", list(built_in_scenes())),
        ("shafts", list(built_in_shafts())),
        ("sources", list(SOURCES)),
    ],
)
def test_list_has_a_name_and_a_text_on_each_line(what: str, names: list[str]) -> None:
    lines = [line for line in ok("list", what).splitlines() if line and line[0] != "#"]
    found = [line.split()[0] for line in lines]
    assert found == names or (what == "quantities" and sorted(found) == names)
    assert all(len(line.split()) > 2 for line in lines)
    everything = {line.split()[0] for line in ok("list").splitlines() if line}
    assert set(names) <= everything


@pytest.mark.parametrize(
    ("words", "name"),
    [
        ("cyclic irregularity", "delta"), ("degree of irregularity", "delta"),
        ("side thrust", "wall_thrust"), ("gudgeon pin", "piston_pin_load"),
        ("flywheel sizing", "inertia_required"), ("harmonics", "torque_order"),
        ("turning moment", "torque"), ("firing pressure", "peak_pressure"),
        ("irregularty", "delta"), ("wall_thrust", "wall_thrust"), ("IMEP", "imep"),
    ],
)  # fmt: skip
def test_quantities_are_found_by_other_words(words: str, name: str) -> None:
    lines = ok("list", "quantities", *words.split()).splitlines()
    assert name in [line.split()[0] for line in lines if line]
    assert len(lines) < 60  # of 190


def test_words_that_no_line_has_together_find_either() -> None:
    assert {"inertia", "stroke", "idler_gears"} <= {*names("keys", "stroke", "inertia")}
    assert names("keys", "idler") == ["idler_gears"]


"""Beginnings of sources that are no publication: definitions, and laws of all textbooks."""


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("run rako", ["rakopoulos", "rakopoulos_two_stroke"]),
        ("info nt", ["ntua", "ntua_all_rows"]),
        ("identify x.toml --vary inertia,load_exp", ["inertia,load_exponent"]),
        ("show a.nc --quantities delta,omega_ma", ["delta,omega_max"]),
        ("new my.toml --for b11", ["b112"]),
        ("run ./my", ["./my"]),  # of the shell's own files
        ("sho", ["show"]),
    ],
)
def test_the_shell_completes(words: str, expected: list[str]) -> None:
    *before, last = words.split(" ")
    complete = ShellComplete(main, {}, "engine-dyn", "_ENGINE_DYN_COMPLETE")
    assert [item.value for item in complete.get_completions(before, last)] == expected


def test_no_symbol_of_a_quantity_prints_a_stray_sign() -> None:
    told = [line for line in ok("list", "quantities").splitlines() if line]
    lines = dict(line.split(maxsplit=1) for line in told)
    for name, node in QUANTITIES.items():
        text = symbol_text(node.symbol)
        assert f", {text} (" in lines[name] or not text
        assert not set(text) & set("\\{}"), name
        # An underscore stands between a sign and its index, and nowhere else.
        assert not re.search(r"(?<![A-Za-z0-9)*'])_|_(?![A-Za-z0-9])", text), name


def test_published_against_computed_is_printed_row_by_row(tmp_path: Path) -> None:
    tmp_path.joinpath("published.csv").write_text(
        "inertia,delta,omega_mean\n2,0.1,125.6\n5,,125.6\n"
    )
    path = tmp_path / "scene.toml"
    path.write_text(SCENE + '[reference]\nfile = "published.csv"\n')
    text = ok("run", path, "-o", tmp_path / "out.nc")
    with xr.open_dataset(tmp_path / "out.nc") as dataset:
        delta = float(dataset["delta"].sel(inertia=2.0, speed=1200.0))
        assert_array_equal(dataset["delta_published"], [np.nan, 0.1, np.nan])
        assert reference_text(dataset) in text
    row = next(line for line in text.splitlines() if line.startswith("inertia 2, speed 1200"))
    assert f"{delta:.6g}" in row
    assert f"{100.0 * (delta / 0.1 - 1.0):+.2f} %" in row
    assert not any(line.startswith("inertia 1.5,") for line in text.splitlines())
    assert "largest difference of delta" in text
    assert max(map(len, text.splitlines())) <= 120


@pytest.mark.parametrize("closed", ["2>&-", ">&-", "<&-", "<&- >&- 2>&-"])
def test_a_caller_may_close_the_standard_streams(closed: str, tmp_path: Path) -> None:
    scene, output = tmp_path / "scene.toml", tmp_path / "out.nc"
    scene.write_text(PLAIN)
    # A file that is opened gets the number of a stream that is closed: the one that is written is
    # in danger, and where all are closed, the one that is read.
    for words in ('run "$3" -o', *["info"] * (closed.count("&-") == 3)):
        command = f'exec "$0" -c "$1" {words} "$2" {closed}'
        done = subprocess.run(
            ["sh", "-c", command, sys.executable, COMMAND, str(output), str(scene)],
            cwd=ROOT, capture_output=True, text=True, timeout=600,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
    with xr.open_dataset(output, engine="netcdf4") as archive:
        assert (archive["mean_piston_speed"] > 0.0).all()


@pytest.mark.skipif(sys.platform == "win32", reason="a folder in use cannot be removed there")
@pytest.mark.parametrize(
    "words",
    ["list", "info out.nc", "plan first", "run first -o out.nc", "new my.toml", "plot out.nc"],
)
def test_a_removed_working_folder_is_told(words: str, tmp_path: Path) -> None:
    folder = tmp_path / "gone"
    folder.mkdir()
    before = os.getcwd()
    os.chdir(folder)
    folder.rmdir()
    try:
        result = invoke(*words.split())
    finally:
        os.chdir(before)
    assert result.exit_code == 2
    assert result.stderr == (
        "engine-dyn: the current folder no longer exists; change to another folder\n"
    )


def test_plot_takes_slices_and_refuses_bad_ones(tmp_path: Path) -> None:
    good, folder = tmp_path / "good.nc", tmp_path / "figures"
    good.write_bytes(sound_archive())
    for bad, said in (
        ("speed=1751", "speed = 1751 rpm: outside the axis, 1500 to 1700 rpm"),
        ("speed=-5", "speed = -5 rpm: outside the axis, 1500 to 1700 rpm"),
        ("speed", "speed"), ("=3", "=3"), ("speeed=1500", "speeed"), ("speed=", "speed"),
    ):  # fmt: skip
        assert said in refused("plot", good, "-o", folder, "--select", bad)
        assert not folder.exists()
    file = tmp_path / "file"
    file.write_text("")
    for place in (file, file / "deeper"):
        refused("plot", good, "-o", place)
    # The end is the nearest point as far as half the distance to the next one.
    ok("plot", good, "-o", folder, "--select", "speed=1749", "--select", "inertia=1")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("run", "thesis"), "Missing option '-o' / '--output'"),
        (("run", "thesis", "--ouput", "a.nc"), "No such option '--ouput'"),
        (("run", "thesis", "-o", "a.nc", "--threads", "0"), "'--threads': 0 is not in the range"),
        (("schema", "x"), "unexpected extra argument (x)"),
        (("rum", "thesis"), "No such command 'rum'"),
        (("--ouput", "run", "thesis"), "No such option '--ouput'"),
    ],
)
def test_wrong_options_are_refused_in_one_line(arguments: tuple[str, ...], said: str) -> None:
    told = refused(*arguments)
    assert said in told and "--help`" in told


def test_outputs_and_archives_of_another_kind_are_refused(tmp_path: Path) -> None:
    scene = tmp_path / "mine.toml"
    scene.write_text("")
    for arguments, said in (
        (
            ("run", "first", "-o", "x.csv"),
            "x.csv: -o must name another file, such as out.nc; engine-dyn export writes tables",
        ),
        (("merge", scene, "-o", "x.html"), "mine.toml: is a TOML file"),
        (("show", scene), "mine.toml: is a TOML file, such as a scene, and no archive"),
        (("run", "first", "-o", "/far/x.nc"), "the folder /far does not exist; make it first"),
        (("plot", scene, "-o", tmp_path / "a" / "b"), "mine.toml: is a TOML file"),
    ):
        assert said in refused(*arguments)
    assert not (tmp_path / "a").exists() and not Path("/far").exists()


def test_each_command_is_in_one_group_of_the_help_with_its_whole_sentence() -> None:
    told = " ".join(ok("--help").split())
    assert told.count("...") == 1  # Only that of the usage, COMMAND [ARGS]...
    for purpose, commands_of in COMMANDS.items():
        assert f"{purpose}: {commands_of[0].name} " in told
    assert sorted(str(c.name) for each in COMMANDS.values() for c in each) == sorted(main.commands)


def listed(*words: str) -> list[str]:
    return commands.ok("list", *words).splitlines()


def names(*words: str) -> list[str]:
    return [line.split()[0] for line in listed(*words) if line and line[0] != "#"]


@pytest.mark.parametrize(
    "same",
    [
        ("gudgeon pin", "wrist pin", "piston pin", "piston-pin", "Gudgeon"),
        ("conrod", "con-rod", "connecting rod", "connecting-rod", "rods"),
        ("crank pin", "crankpin", "big end"),
        ("main journal", "main bearings"),
    ],
)
@pytest.mark.parametrize("of", ["quantities", "keys"])
def test_names_of_one_thing_find_the_same(of: str, same: tuple[str, ...]) -> None:
    first, *others = (names(of, *words.split()) for words in same)
    assert len(first) > 1
    assert all(other == first for other in others)


def test_shafts_that_are_listed_are_described() -> None:
    for line in ok("list", "shafts").splitlines():
        name = line.split()[0]
        told = ok("info", name)
        assert f'shaft = "{name}"' in told and "  1 pulley: inertia = " in told
        assert "stiffness = " in told and "sources" in told
        assert f"no archive; `engine-dyn info {name}` describes it" in refused("show", name)


def test_other_numbers_of_cylinders_than_the_engines_are_told(tmp_path: Path) -> None:
    for count, told in ((6, False), (5, True)):
        scene = tmp_path / f"{count}.toml"
        scene.write_text(
            f'engine = "diesel_105x137"\n[set]\ncylinders = {count}\n'
            '[output]\nquantities = ["torque_mean"]\n'
        )
        line = "cylinders = 5: in line with the customary firing order; the arrangement of engine"
        for words in (("plan", scene), ("run", scene, "-o", tmp_path / f"{count}.nc")):
            said = ok(*words)
            assert (line in said) == told
            assert ("is for 6, firing order 1-5-3-6-2-4" in said) == told
