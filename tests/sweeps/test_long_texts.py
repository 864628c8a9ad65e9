"""Long hostile texts at every door: what is refused is refused soon. Times are limits for hangs."""

import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click
import numpy as np
import pytest
import xarray as xr

import sweeps
from sweeps.base.columns.recording import read_recording
from sweeps.base.errors import SceneError, did_you_mean
from sweeps.base.files.numbers_with_units import number_with_unit
from sweeps.cli.arguments import axis_slices
from sweeps.cli.main import main
from sweeps.decide.optimise.space import read_space
from sweeps.running.archive.netcdf import write
from sweeps.scene.conditions import constraint
from sweeps.scene.features.indicator import without_pressures
from sweeps.scene.reading import read_scene
from sweeps.view.figures import options_of
from sweeps.view.figures.study import study_of
from sweeps.view.texts.readable_units import factor
from tests.support.commands import invoke

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="has no alarms")

HANG = 30
"""Seconds; all that is here takes a hundredth of it."""

BEFORE = ("", "a", "1", "delta <= 1", "deviation ", "bar (")
REPEATED = ("9", " ", "a", "_ ", ".1", ",1", "1 ", "-1", "([", "a=", "angle", "pcyl", "1e", "a-")
AFTER = ("", "!")


def hostile(length: int) -> Iterator[str]:
    for before in BEFORE:
        for repeated in REPEATED:
            for after in AFTER:
                yield before + repeated * (length // len(repeated)) + after


@contextmanager
def in_time() -> Iterator[None]:
    def stop(*_: object) -> None:
        raise TimeoutError

    before = signal.signal(signal.SIGALRM, stop)
    signal.alarm(HANG)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


SCENE = {"engine": "ntua", "output": {"quantities": ["delta"]}}


def scene_with(*path: str) -> Callable[[str], object]:
    """Read a scene in which one key holds the text."""

    def read(text: str) -> object:
        made: Any = text
        for key in reversed(path):
            made = [made] if key == "*" else {key: made}
        return read_scene({**SCENE, **made})

    return read


DOORS: dict[str, Callable[[str], object]] = {
    "condition": constraint,
    "number with unit": lambda text: number_with_unit(text, "here", "kW"),
    "unit": lambda text: factor("W", text),
    "name": lambda text: did_you_mean(text, ["delta", "omega_max"]),
    "option": lambda text: axis_slices([text]),
    "size": lambda text: options_of(size=text),
    "angle": lambda text: options_of(angle=text),
    "target": lambda text: options_of(target=text),
    "over": lambda text: read_space(f"inertia = {text}", {}, "scene"),
    "notes": lambda text: without_pressures([f"warning: {text}"]),
    **{" ".join(path): scene_with(*path) for path in (
        ("engine",), ("title",), ("set", "arrangement"), ("set", "firing_pattern"),
        ("axes", "firing_pattern", "*"), ("axes", "arrangement", "*"), ("axes", "speed", "*"),
        ("set", "speed"), ("set", "load_table"), ("set", "friction_law"), ("designs", "case", "*"),
        ("designs", "file"), ("output", "quantities", "*"), ("solver", "method"),
        ("indicator", "file"), ("measured", "wheel"), ("measured", "file"), ("shaft",),
        ("reference", "file"), ("reduce", "within"), ("reduce", "within", "*"), ("unknown",),
        ("sample", "method"), ("sample", "inertia"), ("silenced_warnings", "*"),
    )},
}  # fmt: skip


@pytest.mark.parametrize("door", DOORS)
@pytest.mark.parametrize("length", [3_000, 100_000])
def test_texts(door: str, length: int) -> None:
    with in_time():
        for text in hostile(length):
            try:
                DOORS[door](text)
            except SceneError as error:
                assert len(str(error)) < 5000


@pytest.mark.parametrize("repeated", REPEATED)
def test_heads_of_columns(repeated: str, tmp_path: Path) -> None:
    text = repeated.replace(",", ";") * (200_000 // len(repeated))
    numbers = "".join(f"{angle}\t{angle % 7}\n" for angle in range(-360, 360))
    path = tmp_path / "recording.txt"
    for head in (f"angle\tp {text} [bar]", f"{text} [deg]\t{text} (bar", f"angle\tp\ndeg\t[{text}"):
        path.write_text(f"{head}\n{numbers}")
        with in_time():
            try:
                read_recording(path)
                sweeps.read_pressure(path)
            except SceneError as error:
                assert len(str(error)) < 5000
    for table in ("designs", "reference"):
        (tmp_path / "table.csv").write_text(f"speed,{repeated * 200_000}\n1500,2\n")
        with in_time(), pytest.raises(SceneError):
            read_scene({**SCENE, table: {"file": str(tmp_path / "table.csv")}})


@pytest.mark.parametrize("repeated", REPEATED)
def test_attributes_of_archives(repeated: str) -> None:
    text = repeated * (50_000 // len(repeated))
    data = xr.Dataset(
        {"delta": ("speed", np.arange(3.0), {"long_name": text, "units": text, "symbol": text})},
        {"speed": ("speed", np.arange(3.0), {"long_name": f"a ({text}", "units": f"kg{text}"})},
    )
    with in_time():
        view = study_of(data, {}).view
        assert view.label("delta") and view.title("speed") and view.axis("speed").label


def _options() -> list[tuple[str, str]]:
    """Every option of every command that takes a text."""
    return [
        (name, option.opts[-1])
        for name, command in main.commands.items()
        for option in command.params
        if isinstance(option, click.Option) and not option.is_flag
        and not isinstance(option.type, click.Choice | click.types.IntParamType)
    ]  # fmt: skip


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("long")
    tables = (
        '[axes]\ninertia = [2, 3]\n[output]\nquantities = ["delta", "omega"]\nangle_step = 30\n'
    )
    (folder / "scene.toml").write_text(f'engine = "ntua"\n{tables}')
    archive = xr.Dataset(
        {"delta": (("method", "inertia"), np.ones((2, 2)), {"units": "1", "long_name": "delta"})},
        {"inertia": [2.0, 3.0], "method": [0, 1], "method_name": ("method", ["a", "1"])},
    )
    write(archive, folder / "archive.nc")
    rows = "".join(f"{angle},{2 + angle % 7}\n" for angle in range(-360, 360))
    (folder / "recording.csv").write_text("crank_angle_deg,pressure_bar\n" + rows)
    return {"scene": folder / "scene.toml", "raw": folder / "recording.csv", "folder": folder}


@pytest.mark.compiled
@pytest.mark.parametrize(("command", "option"), _options())
def test_options(command: str, option: str, files: dict[str, Path], tmp_path: Path) -> None:
    arguments: list[str] = []
    for parameter in main.commands[command].params:
        if isinstance(parameter, click.Argument):
            path = files.get(parameter.name or "", files["folder"] / "archive.nc")
            arguments.append(str(path))
        elif parameter.required and parameter.opts[-1] != option:
            arguments += [parameter.opts[-1], str(tmp_path / "out.nc")]
    for text in ("9" * 60_000, "a" + " " * 60_000 + "b", "delta <= " + "9" * 60_000, ",1" * 30_000):
        with in_time():
            result = invoke(command, *arguments, option, text)
        assert result.exit_code in (0, 1, 2), result.output
        assert "Traceback" not in result.output and "failed:" not in result.output, result.output
