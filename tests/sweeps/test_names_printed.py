"""Names of files and designs, whatever is in them, as commands print and write them."""

import csv
from pathlib import Path

import click
import pytest
import xarray as xr

import sweeps
from sweeps.base.errors import SceneError
from sweeps.cli.main import main
from sweeps.decide.explore.export import not_computed
from sweeps.running.archive.netcdf import write
from tests.support.commands import invoke

pytestmark = pytest.mark.compiled

EVIL = "o\x1b]0;x\x07\u202e\nFORGED"
"""Sets the title of a terminal, turns the direction of writing, and begins a line of its own."""

NAMES = ("=1+1", "+cmd", "-cmd", "@sum", "\t=1+1", "a\t=1+1", "\n=1+1", "  =1+1", "\uff1d1+1",
         "-1", "1", "plain", 'a"b', "a,=1")  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("names")
    scene = (
        'engine = "ntua"\n'
        'title = "t\\u001b]0;x\\u0007\\u202e\\nFORGED"\n[output]\nquantities = ["delta"]\n'
        "[axes]\ninertia = [2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13]\n"
    )
    (folder / f"{EVIL}.toml").write_text(scene)
    one = xr.Dataset(
        {"delta": ("inertia", [0.1, 0.2], {"units": "1", "long_name": "delta"})},
        {"inertia": ("inertia", [2.0, 3.0], {"units": "kg m2"})},
    )
    write(one, folder / f"{EVIL}.nc")
    rows = "".join(f"{angle},{2 + (angle % 90) / 9}\n" for angle in range(-360, 360))
    (folder / f"{EVIL}.csv").write_text("crank_angle_deg,pressure_bar\n" + rows)
    return folder


def check_printed(text: str) -> None:
    lines = text.split("\n")
    assert all(line.isprintable() for line in lines), text
    assert not any(line.startswith("FORGED") for line in lines), text


@pytest.mark.parametrize("name", sorted(main.commands))
def test_every_command_escapes_names(name: str, folder: Path, tmp_path: Path) -> None:
    """Each argument and each option of a path gets the name, of a file that there is and not."""
    command = main.commands[name]
    arguments = [one for one in command.params if isinstance(one, click.Argument)]
    paths = [
        one.opts[-1] for one in command.params
        if isinstance(one, click.Option) and isinstance(one.type, click.Path)
    ]  # fmt: skip
    required = [
        one.opts[-1] for one in command.params
        if isinstance(one, click.Option) and one.required
    ]  # fmt: skip
    for ending in (".toml", ".nc", ".csv"):
        for place in (folder, tmp_path):  # which there is, and is not
            named = [str(place / f"{EVIL}{ending}") for _ in arguments]
            for number, option in enumerate(paths or [""]):
                out = tmp_path / f"{number}{ending[1:]}{place == folder}{EVIL}.nc"
                others = [w for o in required if o != option for w in (o, str(out))]
                given = [option, str(out)] if option else []
                result = invoke(name, *named, *others, *given)
                check_printed(result.output)
                assert result.exit_code in (0, 1, 2)


def test_no_spreadsheet_computes_names_of_designs(tmp_path: Path) -> None:
    cases = ("case", list(NAMES), {"long_name": "name of the design"})
    archive = xr.Dataset(
        {"delta": ("design", [0.1 * i for i in range(len(NAMES))], {"units": "1"})},
        {"design": range(len(NAMES)), "case": ("design", cases[1], cases[2])},
    )
    sweeps.export(archive, tmp_path / "t.csv")
    with (tmp_path / "t.csv").open(newline="", encoding="utf-8") as stream:
        text = stream.read()
    written = {row["case"] for row in csv.DictReader(text.splitlines())}
    assert written == {
        "'=1+1", "'+cmd", "'-cmd", "'@sum", "a =1+1", "'\uff1d1+1", "-1", "1", "plain", 'a"b',
        "a,=1",
    }  # fmt: skip
    assert text.count("\n") == len(NAMES) + 1 and "\t" not in text
    assert not_computed("-1e3") == "-1e3" and not_computed("-1e3-1") == "'-1e3-1"


FOREIGN = {
    "passwords": "root:$6$SECRET:19000:0:99999:7:::\nadmin:SECRET:1\n",
    "settings": "SECRET0 = 5\n[SECRET1]\npassword = SECRET2\n",
    "twice": "[SECRET]\na = 1\n[SECRET]\n",
    "word": "SECRET\n",
    "list": "SECRET1,SECRET2\nSECRET3,SECRET4\n",
    "short": "SECRET1,SECRET2\nSECRET3\n",
    "json": '{"SECRET1": "SECRET2"}\n',
}
"""Files of a system, which a scene of somebody else may name."""


@pytest.mark.parametrize("ending", ["", ".toml", ".csv", ".txt"])
@pytest.mark.parametrize("kind", FOREIGN)
def test_errors_do_not_quote_files(kind: str, ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"foreign{ending}"
    path.write_text(FOREIGN[kind])
    named = str(path)
    engine = tmp_path / "engine.toml"
    values = "title = 't'\n[values]\ninertia = 1\nspeed = 1500\n[[diagram]]\n"
    engine.write_text(f"{values}kind = 'torque'\nfile = '{named}'\n")
    places: tuple[dict[str, object], ...] = (
        {"engine": named}, {"engine": str(engine)}, {"shaft": named},
        {"set": {"load_table": named}}, {"set": {"driver_table": named}},
        *({table: {"file": named}} for table in ("designs", "reference", "indicator")),
    )  # fmt: skip
    for place in places:
        scene = {"engine": "ntua", "output": {"quantities": ["delta"]}, **place}
        with pytest.raises(SceneError) as error:
            sweeps.read_scene(scene)
        assert "SECRET" not in str(error.value)
    out = str(tmp_path / "out.toml")
    for words in (["run", named, "-o", out], ["plan", named], ["info", named], ["show", named],
                  ["calibrate", named, "-o", out], ["new", "--for", named],
                  ["import", named, "-o", out], ["measured", named]):  # fmt: skip
        result = invoke(*words)
        assert result.exit_code in (1, 2) and "SECRET" not in result.output, result.output
