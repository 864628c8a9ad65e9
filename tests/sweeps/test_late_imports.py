"""Imports: late ones, another package of the same name, and processes that are forked."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import sweeps
from sweeps.base import array_libraries
from tests.support.archives import sound_archive
from tests.support.commands import invoke, ok
from tests.support.scenes import asking
from tests.sweeps.processes import python

# Numba imports scipy itself where it is installed (scipy and its BLAS), and xarray imports cftime
# and, by pandas, pyarrow: theirs are not counted. dask would be imported by xarray for every
# variable that it converts: `dataset` hands over arrays as they are.
LATE = {"matplotlib", "dask", "distributed", "netCDF4", "tqdm", "scipy.interpolate",
        "scipy.integrate", "scipy.optimize", "h5py", "h5netcdf", "zarr"}  # fmt: skip

pytestmark = pytest.mark.slow  # some twenty interpreters are started

SCENE = asking(["delta", "omega"], axes={"inertia": [1.0, 2.0]})

# None stands for a module whose import fails, see `sweeps.base.array_libraries`.
TELL_MODULES = "import sys; print(*(name for name, one in sys.modules.items() if one is not None))"


@pytest.mark.parametrize(
    "code",
    [
        "import engine_dyn",
        "import sweeps",
        "import sweeps.cli.main",
        f"import sweeps; sweeps.run({SCENE})",
        "from sweeps.cli.main import main; main(['list'], standalone_mode=False)",
        "from sweeps.cli.main import main; main(['plan', 'first'], standalone_mode=False)",
    ],
)
def test_nothing_is_imported_that_is_not_used(code: str) -> None:
    done = python(f"{code}\n{TELL_MODULES}")
    assert done.returncode == 0, done.stderr
    assert not LATE & set(done.stdout.splitlines()[-1].split())


MOST_MODULES = 250
"""Modules of this project that a run of two designs loads; fewer is better."""

COMPILER = {"numba", "llvmlite"}

LABELS = {"xarray", "pandas", "pint"}


def modules_after(*words: str) -> set[str]:
    """Modules that a command has loaded at its end."""
    code = (
        "from sweeps.cli.main import main\n"
        f"main({list(words)!r}, standalone_mode=False)\n"
        f"{TELL_MODULES}"
    )
    return set(python(code, check=True).stdout.splitlines()[-1].split())


@pytest.mark.parametrize("command", ["list", "plan first", "info first", "schema"])
def test_telling_loads_neither_labels_nor_kernels(command: str) -> None:
    modules = modules_after(*command.split())
    assert not modules & {"xarray", "pandas", "netCDF4", "pyarrow", "sweeps.running.archive.labels"}
    assert not modules & {"scipy", "engine_dyn.speed.dispatch", *COMPILER}
    assert command != "list" or "psutil" not in modules


def test_help_loads_no_numbers() -> None:
    assert not modules_after("--help") & {"numpy", "pydantic", "engine_dyn.parameters"}


def test_archives_are_told_without_the_compiler(tmp_path: Path) -> None:
    path = tmp_path / "of_two.nc"
    sweeps.stream(SCENE, path)
    for command in ("show", "info"):
        assert not modules_after(command, str(path)) & (COMPILER | LABELS)
    least = ("best", str(path), "--least", "inertia", "--within", "delta <= 1")
    for words in (least, ("plot", str(path), "-o", str(tmp_path / "figures"))):
        assert not modules_after(*words) & (COMPILER | LIBRARIES | {"scipy"})


LIBRARIES = set(array_libraries.LIBRARIES)


@pytest.mark.parametrize("name", sorted(LIBRARIES))
def test_libraries_of_arrays_come_when_they_are_asked_for(name: str) -> None:
    told = python(
        "import sys\n"
        "from sweeps.base import array_libraries\n"
        "array_libraries.keep_out()\n"
        f"try: import {name}; print('there')\n"
        "except ImportError: print('not there')\n"
        f"array_libraries.let_in({name!r}); import {name}; array_libraries.let_in({name!r})\n"
        f"array_libraries.keep_out(); print(sys.modules[{name!r}] is {name})",
        check=True,
    )
    assert told.stdout.split("\n")[:2] == ["not there", "True"]


def test_commands_find_the_library_of_units(tmp_path: Path) -> None:
    """As a program, where it is kept out at first: `import` needs it for units of pressure."""
    angle = np.arange(-360.0, 360.0)
    pressure = 100.0 + 4900.0 / (1.0 + (angle / 20.0) ** 2)
    rows = "".join(f"{a:g},{p:.3f}\n" for a, p in zip(angle, pressure, strict=True))
    (tmp_path / "raw.csv").write_text("angle [deg],p_cyl [kPa]\n" + rows)
    words = ["import", str(tmp_path / "raw.csv"), "-o", str(tmp_path / "pressure.csv")]
    code = f"import sys; sys.argv[1:] = {words!r}; from sweeps.cli.main import main; main()"
    told = python(code)
    assert told.returncode == 0 and "pressure in kPa" in told.stdout, told.stderr


def test_a_run_of_two_designs_loads_what_it_uses() -> None:
    code = f"import sweeps; sweeps.run({SCENE})\n{TELL_MODULES}"
    modules = python(code, check=True).stdout.splitlines()[-1].split()
    ours = {name for name in modules if name.partition(".")[0] in ("engine_dyn", "sweeps")}
    # Neither laboratory nor figures, nor what no key of this scene asks for.
    rooms = ("sweeps.lab", "engine_dyn.recordings", "sweeps.view.figures", "sweeps.view.texts",
             "sweeps.view.report", "sweeps.decide", "sweeps.cli", "sweeps.running.reduce",
             "sweeps.running.join", "sweeps.base.columns.recording", "sweeps.base.columns.formats",
             "sweeps.scene.design_files", "sweeps.base.netcdf.netcdf_files")  # fmt: skip
    assert not [name for name in sorted(ours) if name.startswith(rooms)]
    assert len(ours) <= MOST_MODULES


OURS = Path(sweeps.__file__).parent


def command_in(folder: Path) -> subprocess.CompletedProcess[str]:
    """`engine-dyn list classes` where the packages of a folder alone are installed."""
    code = (
        "import sys; sys.path = [p for p in sys.path if p != sys.argv[1]]; "
        "from sweeps.cli.main import main; main(['list', 'classes'])"
    )
    return subprocess.run(
        [sys.executable, "-c", code, str(OURS.parent)], cwd=folder, capture_output=True, text=True
    )


@pytest.fixture
def installed(tmp_path: Path) -> Path:
    """A folder with both packages of this project."""
    shutil.copytree(OURS, tmp_path / "sweeps", ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "engine_dyn").symlink_to(OURS.parent / "engine_dyn")
    return tmp_path


@pytest.mark.parametrize(
    ("text", "word"), [('__version__ = "0.3.0"\n', "another package's"), (None, "gone")]
)
def test_a_module_that_was_replaced_or_removed(
    installed: Path, text: str | None, word: str
) -> None:
    init = installed / "sweeps" / "__init__.py"
    if text is None:
        init.unlink()
    else:
        init.write_text(text, encoding="utf-8")
    done = command_in(installed)
    assert done.returncode == 1
    assert done.stderr.count("\n") == 1
    assert f"engine-dyn: engine-dyn's module sweeps is {word}" in done.stderr
    assert "pip uninstall sweeps" in done.stderr


def test_a_package_that_this_one_has_replaced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert invoke("list", "classes").stderr == ""
    about = tmp_path / "sweeps-0.3.0.dist-info" / "METADATA"
    about.parent.mkdir()
    about.write_text("Metadata-Version: 2.1\nName: sweeps\nVersion: 0.3.0\n", encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    result = invoke("list", "classes")
    assert result.exit_code == 0
    assert result.stderr.startswith(
        "warning: package 'sweeps' 0.3.0 is installed beside engine-dyn"
    )
    assert result.stderr.count("\n") == 1
    assert result.stdout == ok("list", "classes")


FORK = """
import os, signal, sys
from pathlib import Path
from engine_dyn.pressure import family as families
from sweeps.base.netcdf import netcdf_child

class Family:
    pass

family = Family()

def remember():
    return families.remembered(family, "key", tuple)

def read():
    return netcdf_child.read_apart(Path(sys.argv[1]))

def held(lock, wanted):
    with lock:  # as another thread holds it; the child has only the thread that forks
        child = os.fork()
        if not child:
            signal.alarm(600)
            wanted()
            os._exit(0)
        return os.waitpid(child, 0)[1]

lock = families._making[id(family), "key"] = families.threading.Lock()
print(held(families._lock, remember), held(lock, remember), held(netcdf_child._LOCK, read))
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs forks")
def test_locks_are_free_in_a_fork(tmp_path: Path) -> None:
    (tmp_path / "sound.nc").write_bytes(sound_archive())
    told = python(FORK, tmp_path / "sound.nc", timeout=600)
    assert told.stdout == "0 0 0\n", told.stderr
