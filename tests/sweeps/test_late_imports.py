"""What is not needed is not imported, with the packages or a command of theirs."""

from pathlib import Path

import pytest

import sweeps
from tests.support.scenes import asking
from tests.sweeps.processes import python

# Numba imports scipy itself where it is installed (scipy and its BLAS), and xarray imports cftime
# and, by pandas, pyarrow: theirs are not counted. dask would be imported by xarray for every
# variable that it converts: `dataset` hands over arrays as they are.
LATE = {"matplotlib", "dask", "distributed", "netCDF4", "tqdm", "scipy.interpolate",
        "scipy.integrate", "scipy.optimize", "h5py", "h5netcdf", "zarr"}  # fmt: skip

# A package of this name that says so when it is imported, in front of an installed one.
DECOYS = ("dask", "distributed", "matplotlib", "netCDF4", "h5netcdf", "zarr", "sparse", "cupy",
          "pint")  # fmt: skip

SCENE = asking(["delta", "omega"], axes={"inertia": [1.0, 2.0]})


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
def test_nothing_is_imported_that_is_not_used(code: str, tmp_path: Path) -> None:
    for name in DECOYS:
        folder = tmp_path / name
        folder.mkdir()
        folder.joinpath("__init__.py").write_text(f"raise SystemExit('{name} was imported')\n")
    done = python(f"{code}\nimport sys; print(*sys.modules)", path=tmp_path)
    assert done.returncode == 0, done.stderr
    assert not LATE & set(done.stdout.splitlines()[-1].split())


COMPILER = {"numba", "llvmlite"}

LABELS = {"xarray", "pandas", "pint"}


def modules_after(*words: str) -> set[str]:
    """Modules that a command has loaded at its end."""
    code = (
        "from sweeps.cli.main import main\n"
        f"main({list(words)!r}, standalone_mode=False)\n"
        "import sys; print(*sys.modules)"
    )
    return set(python(code, check=True).stdout.splitlines()[-1].split())


@pytest.mark.parametrize("command", ["list", "plan first", "info first", "schema"])
def test_telling_loads_neither_labels_nor_kernels(command: str) -> None:
    modules = modules_after(*command.split())
    assert not modules & {"xarray", "pandas", "netCDF4", "pyarrow", "sweeps.archive.labels"}
    assert not modules & {"scipy", "engine_dyn.speed.dispatch", *COMPILER}


def test_archives_are_told_without_the_compiler(tmp_path: Path) -> None:
    path = tmp_path / "of_two.nc"
    sweeps.stream(SCENE, path)
    for command in ("show", "info"):
        assert not modules_after(command, str(path)) & (COMPILER | LABELS)


def test_a_run_prints_what_it_has_written_without_xarray(tmp_path: Path) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text('engine = "ntua"\n[output]\nquantities = ["mean_piston_speed"]\n')
    assert not modules_after("run", str(scene), "-o", str(tmp_path / "out.nc")) & LABELS
