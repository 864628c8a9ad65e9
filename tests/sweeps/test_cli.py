"""The command line as a user meets it: files, what is printed, lists, exit status."""

import errno
import itertools
import os
import re
import subprocess
import sys
import time
from importlib import metadata
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
from engine_dyn.quantities.graph import DIMENSIONS, NUMBERED, PARAMETERS, PATTERNS, QUANTITIES
from engine_dyn.quantities.sources import SOURCES
from engine_dyn.status import MEANINGS
from sweeps.cli.main import main
from sweeps.scene.engine.cylinder_keys import CYLINDER_KEYS
from sweeps.scene.engine.engine_files import catalogue, load_engine
from sweeps.scene.features.shaft import built_in_shafts
from sweeps.scene.features.torque_tables import TORQUE_TABLE_KEYS
from sweeps.scene.reading import built_in_scenes, read_scene
from sweeps.view.report.sections import assumed
from sweeps.view.texts.archives import archive_text
from sweeps.view.texts.key_texts import WORDS_OF_KEYS, default_text, value_text
from sweeps.view.texts.lists import symbol_text
from sweeps.view.texts.published import text as reference_text
from sweeps.view.texts.quantity_search import found_quantities
from tests.support import commands
from tests.support.archives import sound_archive
from tests.support.commands import invoke, ok, refused
from tests.sweeps.processes import COMMAND, ROOT, python

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


def test_a_scene_comes_from_the_standard_input_or_a_pipe(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(SCENE)
    output = tmp_path / "out.nc"
    expected = ok("plan", tmp_path / "scene.toml")
    told = CliRunner().invoke(main, ["plan", "-"], input=SCENE)
    assert told.exit_code == 0 and told.stdout == expected
    for stream in ("-", "/dev/stdin"):
        words = ["run", stream, "-o", output, "-q", "--overwrite"]
        assert shell(*words, folder=tmp_path, text=SCENE).returncode == 0
        with sweeps.open(output) as archive:
            assert archive.delta.shape == (3, 2)
    bad = CliRunner().invoke(main, ["plan", "-"], input="engine = 1\nx = [")
    assert bad.exit_code == 2 and bad.stderr.startswith("engine-dyn: standard input, line 2: ")


def test_designs_that_fail_end_with_3_where_asked(tmp_path: Path) -> None:
    tmp_path.joinpath("scene.toml").write_text(STALLING)
    done = shell("run", "scene.toml", "-o", "out.nc", folder=tmp_path)
    assert done.returncode == 3, done.stderr
    assert "stalled 1" in done.stderr
    assert "stalled 1" in done.stdout
    with xr.open_dataset(tmp_path / "out.nc") as dataset:
        assert_array_equal(dataset["status"], [MEANINGS.index("stalled"), 0])
        assert_array_equal(np.isnan(dataset["delta"]), [True, False])


def test_help_is_quick_and_loads_nothing_heavy(tmp_path: Path) -> None:
    code = (
        "import sys\nfrom sweeps.cli.main import main\nmain(['--help'], standalone_mode=False)\n"
        "heavy = {'numba', 'xarray', 'matplotlib', 'numpy', 'pydantic'} & set(sys.modules)\n"
        "assert not heavy, heavy\n"
    )
    began = time.perf_counter()
    python(code, check=True)
    assert time.perf_counter() - began < 5.0  # typically 0.1 s; a busy machine is allowed for


@pytest.mark.parametrize(
    ("text", "run", "info"),
    [
        (STALLING.replace('"stalled", "not_converged"', ""),
         "outcomes: converged 1, stalled 1", "  converged: 1\n  stalled: 1\n"),
        ('engine = "ntua"\naxes = { main_journal_width = [0.03, 0.04, 0.05], speed = [900, 950] }\n'
         'set = { main_journal_diameter = 0.09 }\n'
         '[output]\nquantities = ["main_journal_pressure_max", "delta"]\n',
         "6 designs\noutcomes: converged 6\n", "outcomes\n  converged: 6\n"),
        ('engine = "ntua"\naxes = { wanted_delta = [0.05, 1.9] }\n'
         '[output]\nquantities = ["inertia_required"]\n',
         "converged 1, stalled 1\nstalled: the wanted delta is so large that the", "stalled: 1"),
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
        " rad s-1  ", "converged: 6", "  6 designs, ", " of results, float64, not compressed, ",
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


def test_info_begins_with_engine_version_and_part(tmp_path: Path) -> None:
    ok("run", "first", "-o", tmp_path / "a.nc", "--shard", "1/2")
    ok("run", "first", "-o", tmp_path / "b.nc", "--shard", "2/2")
    ok("merge", tmp_path / "a.nc", tmp_path / "b.nc", "-o", tmp_path / "c.nc")
    version = f"  computed with engine-dyn {metadata.version('engine-dyn')}"
    for name, computed, part in (
        ("b.nc", f"{version} on 20", "; part 2 of 2, cut along inertia"),
        ("c.nc", f"{version}, joined on 20", ""),
    ):
        head, _, _ = ok("info", tmp_path / name).partition("\n\n")
        lines = head.splitlines()
        assert lines[1].startswith("  engine ntua: Single-cylinder four-stroke diesel")
        assert lines[3].startswith(computed), head
        assert lines[3].endswith(part) and ("part " in lines[3]) == bool(part)


def test_info_tells_neutral_values_apart_from_given_ones(tmp_path: Path) -> None:
    scene = tmp_path / "scene.toml"
    text = (
        'engine = "ntua"\n[set]\npin_offset = 0.0\n[output]\nquantities = ["mean_piston_speed"]\n'
    )
    scene.write_text(text)
    ok("run", scene, "-o", tmp_path / "out.nc")
    text = ok("info", tmp_path / "out.nc", "--provenance")
    (line,) = (line for line in text.splitlines() if "not given, so neutral: " in line)
    assert "ring_pressure 0," in line and "gear_ratio 1," in line and "pin_offset" not in line
    given = text.partition("  parameters:\n")[2].partition(line)[0]
    assert "    pin_offset: 0.0\n" in given and "ring_pressure" not in given


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
                *TORQUE_TABLE_KEYS,
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


NOT_PRINTED = re.compile(
    r"this project|Lanchester's balancer|Newton's law|handbook values|bearing pressure:"
    r"|against a solution|closure cycle_time|rectangle rule|phase vectors|see the page|M_L = "
)
"""Beginnings of sources that are no publication: definitions, and laws of all textbooks."""


def test_every_publication_has_a_full_citation() -> None:
    cited = {n.source for n in (*PARAMETERS.values(), *QUANTITIES.values()) if n.source}
    printed = [s.removeprefix("after ") for s in cited if not NOT_PRINTED.match(s)]
    named = {re.split(r"[^A-Za-z]", source)[0] for source in printed}
    assert named == set(SOURCES)


def test_what_is_not_found_is_said() -> None:
    assert "nothing found" in refused("list", "quantities", "xyzzy")
    assert "nothing found" in refused("list", "engines", "steam")
    assert ok("list", "engines", "kakaitsas").startswith("ntua ")


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


@pytest.mark.parametrize(
    ("symbol", "text"),
    [
        (r"\beta_\nu", "beta_nu"),
        (r"\Theta_\triangle/\Theta_w-1", "Theta_triangle/Theta_w-1"),
        (r"\psi_{M{g1,\nu}}", "psi_Mg1,nu"),
        (r"\varphi_{C,max}", "phi_C,max"),
        (r"\bar\mu_\sigma", "bar mu_sigma"),
        (r"k\omega_n^\alpha", "k omega_n^alpha"),
        (r"\theta_\delta-\theta^*_\delta", "theta_delta-theta*_delta"),
        (r"|\sum e^{i\nu\psi_k}|", "|sum e^(i nu psi_k)|"),
        ("M_{max}-M_{min}", "M_max-M_min"),
    ],
)
def test_symbols_are_written_in_plain_letters(symbol: str, text: str) -> None:
    assert symbol_text(symbol) == text


def test_no_symbol_of_a_quantity_prints_a_stray_sign() -> None:
    told = [line for line in ok("list", "quantities").splitlines() if line]
    lines = dict(line.split(maxsplit=1) for line in told)
    for name, node in QUANTITIES.items():
        text = symbol_text(node.symbol)
        assert f", {text} (" in lines[name] or not text
        assert not set(text) & set("\\{}"), name
        # An underscore stands between a sign and its index, and nowhere else.
        assert not re.search(r"(?<![A-Za-z0-9)*'])_|_(?![A-Za-z0-9])", text), name


def test_new_writes_a_scene_that_reads(tmp_path: Path) -> None:
    text = ok("new")
    path = tmp_path / "scene.toml"
    assert str(path) in ok("new", path)
    assert path.read_text(encoding="utf-8") == text
    assert read_scene(path).dimensions == ("load", "inertia")


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


def dataset_with(**published: float) -> xr.Dataset:
    variables: dict[str, Any] = {"delta": ("design", [0.1, np.nan, 0.3])}
    variables["delta_published"] = ("design", [0.1, 0.2, 0.0])
    coordinates = {"design": [0, 1, 2], "case": ("design", np.array(["a", "b", "c"], dtype=object))}
    return xr.Dataset(variables, coordinates).assign(
        {f"{name}_published": value for name, value in published.items()}
    )


def test_rows_of_published_values() -> None:
    lines = reference_text(dataset_with(mu=1.0)).splitlines()
    assert re.split(r"\s+", lines[2]) == ["a", "0.1", "0.1", "0.00", "%"]
    assert re.split(r"\s+", lines[3]) == ["b", "0.2", "none"]
    assert re.split(r"\s+", lines[4]) == ["c", "0", "0.3"]
    assert "not requested in [output] quantities: mu" in lines[-1]
    dataset = xr.Dataset(
        {
            "delta": (("method", "speed"), [[0.1, 0.2], [0.11, 0.21]]),
            "delta_published": ("speed", [0.1, np.nan]),
            "mu": ((), 2.0),
            "mu_published": ((), 2.5),
        },
        {
            "method": [0, 1],
            "method_name": ("method", np.array(["newton", "thesis"], dtype=object)),
            "speed": [1000.0, 1100.0],
        },
    )
    text = reference_text(dataset)
    assert "newton, speed 1000" in text
    assert "thesis, speed 1000" in text
    assert "1100" not in text
    assert "largest difference of delta: +10.00 % (thesis, speed 1000)" in text
    assert "largest difference of mu: -20.00 % (the only row)" in text


@pytest.mark.compiled
@pytest.mark.parametrize("closed", ["2>&-", ">&-", "<&-", "<&- >&- 2>&-"])
def test_a_caller_may_close_the_standard_streams(closed: str, tmp_path: Path) -> None:
    output = tmp_path / "out.nc"
    for words in ("run first -o", "info"):
        command = f'exec "$0" -c "$1" {words} "$2" {closed}'
        done = subprocess.run(
            ["sh", "-c", command, sys.executable, COMMAND, str(output)],
            cwd=ROOT, capture_output=True, text=True, timeout=300,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
    with xr.open_dataset(output, engine="netcdf4") as archive:
        assert set(archive["status"].values.reshape(-1)) == {0}


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


def test_figures_on_a_full_disk_leave_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from matplotlib.figure import Figure

    good = tmp_path / "good.nc"
    good.write_bytes(sound_archive())
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "summary.png").write_bytes(b"old")
    save, saved = Figure.savefig, []

    def full(self: Figure, path: Path, **options: Any) -> None:
        save(self, path, **options)
        saved.append(path)
        if len(saved) == 2:
            raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Figure, "savefig", full)
    for folder in (tmp_path / "new" / "figures", tmp_path / "mine"):
        saved.clear()
        result = invoke("plot", good, "-o", folder)
        assert result.exit_code == 1
        assert result.stderr == (
            f"engine-dyn: {folder}: cannot be written (No space left on device)\n"
        )
        assert len(saved) == 2
    assert not (tmp_path / "new").exists()
    assert [p.name for p in (tmp_path / "mine").iterdir()] == ["summary.png"]
    assert (tmp_path / "mine" / "summary.png").read_bytes() == b"old"


def test_plot_takes_slices_and_refuses_bad_ones(tmp_path: Path) -> None:
    good, folder = tmp_path / "good.nc", tmp_path / "figures"
    good.write_bytes(sound_archive())
    for bad, said in (
        ("speed=1751", "speed = 1751: outside the axis, 1500 to 1700"),
        ("speed=-5", "speed = -5: outside the axis, 1500 to 1700"),
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


def test_keys_are_found_by_their_other_names() -> None:
    for key, words in WORDS_OF_KEYS.items():
        assert key in PARAMETERS
        for one in words.split(" (")[0].split(", "):
            assert key in names("keys", *one.split()), (key, one)
    assert names("keys", "gudgeon", "pin")[-2:] == ["piston_pin_diameter", "piston_pin_width"]


def test_a_near_spelling_is_told() -> None:
    first, *rest = listed("quantities", "gudegon", "pin")
    assert first.startswith("# nothing found for 'gudegon'; did you mean 'gudgeon'?")
    assert rest[1:] == listed("quantities", "gudgeon", "pin")
    assert listed("keys", "irregularty")[0].startswith("# nothing found for 'irregularty'")
    assert found_quantities("irregularity")[1] == ""


@pytest.mark.parametrize("name", ["torque_mean", "torque", "crank_angle", "gas_torque_rms"])
def test_an_exact_name_comes_first(name: str) -> None:
    assert names("quantities", name)[0] == name
    assert names("quantities", *name.split("_"))[0] == name


def test_axes_of_curves_are_found_and_not_listed_as_quantities() -> None:
    public = sorted(name for name, dimension in DIMENSIONS.items() if dimension.public)
    assert sorted(names("quantities", "axes", "of", "curves")) == public
    assert "0 at firing top dead centre" in "".join(listed("quantities", "crank", "angle")[:2])
    assert not set(names("quantities")) & set(DIMENSIONS)


def test_keys_print_names_and_defaults() -> None:
    lines = {line.split()[0]: line for line in listed("keys")}
    assert lines["friction_law"].endswith(
        "one of chen_flynn, patton_nitschke_heywood; default chen_flynn"
    )
    assert "one of ohv, sohc_finger_follower" in lines["valve_train"]
    assert lines["flywheel_density"].endswith("or a name: cast iron, steel")
    assert lines["wanted_delta"].endswith("or a name such as pump")
    assert lines["gear_ratio"].endswith("; default 1")
    assert default_text(PARAMETERS["passes"]) == ""  # 0, outside the range: there is none
    assert value_text(PARAMETERS["valve_train"], 7.0) == "dohc_roller_finger_follower"
    assert value_text(PARAMETERS["flywheel_density"], 7850.0) == "7850"


@pytest.mark.parametrize(
    ("word", "said"), [("quantity", "did you mean 'quantities'"), ("units", "quantities and keys")]
)
def test_an_unknown_list_is_refused_in_one_line(word: str, said: str) -> None:
    assert said in commands.refused("list", word)


def test_words_of_values_are_shown() -> None:
    assert "valve_train = dohc_roller_finger_follower " in commands.ok("info", "si_four_87x101")
    node = xr.Dataset(attrs={"parameters": '{"valve_train": 7.0, "bore": 0.08}', "history": "now"})
    lines = archive_text(node, __file__, provenance=True).splitlines()
    assert "    valve_train: dohc_roller_finger_follower (7)" in lines
    assert "    bore: 0.08" in lines
    assert "dohc_roller_finger_follower (7)" in assumed(node, {})
