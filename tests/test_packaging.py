"""What is installed, and which way imports point."""

import ast
import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from collections.abc import Iterator
from configparser import ConfigParser
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("engine_dyn", "sweeps")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def package_files() -> set[str]:
    """Files of both packages in the checkout, as names inside a wheel."""
    return {
        path.relative_to(ROOT).as_posix()
        for package in PACKAGES
        for path in (ROOT / package).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }


def imports(path: Path, *, module_level: bool = False) -> Iterator[str]:
    """Top-level names of the packages that a file imports (relative imports stay inside)."""
    todo: list[ast.AST] = [ast.parse(path.read_text(encoding="utf-8"))]
    while todo:
        node = todo.pop()
        if isinstance(node, ast.Import):
            yield from (alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            yield node.module.partition(".")[0]
        if module_level and isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            continue
        todo.extend(ast.iter_child_nodes(node))


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Iterator[zipfile.ZipFile]:
    """A wheel of this checkout, built from a copy, so that nothing stale is packed or left."""
    folder = tmp_path_factory.mktemp("wheel")
    for name in (PROJECT["readme"], "pyproject.toml", *PROJECT["license-files"]):
        shutil.copy(ROOT / name, folder)
    for package in PACKAGES:
        shutil.copytree(
            ROOT / package, folder / package, ignore=shutil.ignore_patterns("__pycache__")
        )
    done = subprocess.run(
        [sys.executable, "-c", "from setuptools.build_meta import *; build_wheel('dist')"],
        cwd=folder,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    (path,) = (folder / "dist").glob("*.whl")
    with zipfile.ZipFile(path) as file:
        yield file


def test_wheel_holds_every_file_of_both_packages_and_nothing_else(wheel: zipfile.ZipFile) -> None:
    packed = {name for name in wheel.namelist() if ".dist-info/" not in name}
    assert packed == package_files()


def test_wheel_installs_one_command_one_entry_point_and_the_licences(
    wheel: zipfile.ZipFile,
) -> None:
    info = f"engine_dyn-{PROJECT['version']}.dist-info"
    entry_points = ConfigParser()
    entry_points.read_string(wheel.read(f"{info}/entry_points.txt").decode())
    assert dict(entry_points["console_scripts"]) == {"engine-dyn": "sweeps.cli.main:main"}
    assert dict(entry_points["sweeps.recordings"]) == {
        "pressure": "sweeps.lab.pressure.pressure:imported"
    }
    for value in (value for section in entry_points.values() for value in section.values()):
        module, name = value.split(":")
        assert callable(getattr(import_module(module), name))
    for name in PROJECT["license-files"]:
        assert wheel.read(f"{info}/licenses/{name}") == (ROOT / name).read_bytes()


@pytest.fixture(scope="module")
def repository() -> list[str]:
    """Files of the checkout that git does not ignore."""
    words = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    if not (ROOT / ".git").exists() or not shutil.which("git"):
        pytest.skip("not a checkout of the repository")
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=True)
    return [name for name in done.stdout.split("\0") if name and (ROOT / name).is_file()]


@pytest.fixture(scope="module")
def source_distribution(
    repository: list[str], tmp_path_factory: pytest.TempPathFactory
) -> tarfile.TarFile:
    """A source distribution of this checkout, built from a copy."""
    folder = tmp_path_factory.mktemp("source")
    for name in repository:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / name, folder / name)
    done = subprocess.run(
        [sys.executable, "-c", "from setuptools.build_meta import *; build_sdist('dist')"],
        cwd=folder,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return tarfile.open(folder / "dist" / f"engine_dyn-{PROJECT['version']}.tar.gz")


def test_source_distribution_builds_tests_and_documents(
    repository: list[str], source_distribution: tarfile.TarFile
) -> None:
    packed = {member.name.partition("/")[2] for member in source_distribution if member.isfile()}
    made = {"PKG-INFO", "setup.cfg"}
    packed = {name for name in packed - made if not name.startswith("engine_dyn.egg-info/")}
    # Settings of tools that look at a repository: git, its hooks, CI.
    kept_out = {name for name in repository if name.startswith(".")}
    assert packed == set(repository) - kept_out


@pytest.mark.slow
def test_nothing_imports_packages_that_are_not_dependencies() -> None:
    allowed = set(PACKAGES) | set(sys.stdlib_module_names)
    allowed |= {requirement.partition(">")[0] for requirement in PROJECT["dependencies"]}
    # What an extra installs is imported where it is used, and nowhere else.
    extras = {"pyarrow", "opentorsion", "distributed", "scipy", "openpyxl", "bokeh", "pymoo"}
    for extra, package in (
        ("parquet", "pyarrow"), ("torsion", "opentorsion"), ("cluster", "distributed"),
        ("lab", "scipy"), ("excel", "openpyxl"), ("report", "bokeh"),
        ("optimise", "pymoo"),
    ):  # fmt: skip
        assert any(r.startswith(f"{package}>") for r in PROJECT["optional-dependencies"][extra])
    found = {
        f"{path.relative_to(ROOT)} imports {name}"
        for package in PACKAGES
        for path in (ROOT / package).rglob("*.py")
        if path.name != "fmu_slave.py"  # which runs in an FMU
        for name in (set(imports(path)) - extras | set(imports(path, module_level=True))) - allowed
    }
    assert found == set()


def locked(name: str) -> dict[str, tuple[str, int]]:
    """Version of each package in a file of `make lock`, and the number of its hashes."""
    found: dict[str, tuple[str, int]] = {}
    text = (ROOT / name).read_text(encoding="utf-8").replace("\\\n", " ")
    for line in text.splitlines():
        if line and not line.startswith("#"):
            pinned, *rest = line.split()
            package, _, number = pinned.partition("==")
            found[package] = (number, sum(word.startswith("--hash=sha256:") for word in rest))
    return found


@pytest.mark.parametrize("name", ["requirements.txt", "requirements-test.txt"])
def test_locked_versions_are_the_tested_ones_and_have_hashes(name: str) -> None:
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    tested = dict(line.split("==") for line in lines if line and not line.startswith("#"))
    packages = locked(name)
    assert all(hashes > 0 for _, hashes in packages.values())
    # Those of other systems, such as colorama on Windows, are not tested.
    others = {p: v for p, (v, _) in packages.items() if tested.get(p, v) != v}
    assert others == {}
    assert len(set(packages) - set(tested)) <= 10


def test_locked_packages_are_all_that_is_needed() -> None:
    extras = PROJECT["optional-dependencies"]
    run_time = [
        *PROJECT["dependencies"],
        *extras["parquet"],
        *extras["torsion"],
        *extras["cluster"],
    ]
    for name, wanted in (
        ("requirements.txt", run_time),
        ("requirements-test.txt", [*run_time, *extras["test"], *extras["lint"], *extras["docs"]]),
    ):
        names = {re.split(r"[<>=\[; ]", text)[0].lower().replace("_", "-") for text in wanted}
        assert names - {"engine-dyn"} - set(locked(name)) == set()
    assert set(locked("requirements.txt")) < set(locked("requirements-test.txt"))
