"""Runs whose blocks are computed by workers of dask, other processes: the bytes of a local run."""

import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_array_equal

import sweeps
from sweeps.running.archive import provenance
from sweeps.running.archive.netcdf import open_archive
from sweeps.running.archive.partial import Partial
from sweeps.running.compute import cluster, into_archive, limits, worker
from sweeps.running.compute.options import Options
from tests.support.archives import assert_same, interrupted, plan_of
from tests.support.commands import invoke, ok, refused
from tests.support.engine_files import ENGINES
from tests.support.scenes import DESIGN_TABLE, LARGE_MAP, MAP, write_scene
from tests.sweeps.processes import COMMAND, ROOT, python

cloudpickle = pytest.importorskip("cloudpickle")
distributed = pytest.importorskip("distributed")


pytestmark = [pytest.mark.compiled, pytest.mark.slow]

# The workers of this module are no part of pytest: what they are given to do comes as code.
cloudpickle.register_pickle_by_value(sys.modules[__name__])


def workers(number: int, threads: int = 1, processes: bool = True, **more: Any) -> Any:
    return distributed.LocalCluster(
        n_workers=number, threads_per_worker=threads, processes=processes, memory_limit=0,
        dashboard_address="127.0.0.1:0", silence_logs=60, **more,
    )  # fmt: skip


@pytest.fixture(scope="module")
def scheduler() -> Iterator[str]:
    """A scheduler with two workers, processes of one thread each."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", str(ROOT))
        with workers(2) as running:
            yield running.scheduler_address


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limits, "LARGEST_BLOCK", 4e5)


@pytest.fixture
def scene(tmp_path: Path, small: None) -> Path:
    path = tmp_path / "scene.toml"
    path.write_text(LARGE_MAP)
    return path


def same_but_machine(path: Path, expected: xr.Dataset) -> None:
    """As `assert_same`; the attribute says which machines computed."""
    expected = expected.copy()
    with open_archive(path) as opened:
        expected.attrs["machine"] = opened.attrs["machine"]
        assert re.match(r"(tcp://\S+|local:2): 2 workers on ", opened.attrs["machine"])
    assert_same(path, expected)


@pytest.mark.parametrize("name", ["map", "one block", "table", "files", "thesis", "float32"])
def test_archive_is_that_of_a_local_run(
    name: str, scheduler: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene: Any = {"table": DESIGN_TABLE, "thesis": "thesis"}.get(name)
    if scene is None:
        scene = tmp_path / "scene.toml"
        scene.write_text(MAP)
    if name == "files":
        engine = (ENGINES / "diesel_105x137.toml").read_text()
        (tmp_path / "my.toml").write_text(engine)
        pressure = (ENGINES / "diesel_105x137_pressure.csv").read_text()
        (tmp_path / "diesel_105x137_pressure.csv").write_text(pressure)
        table = "\n".join(f"{0.5 + 0.1 * i!r},number {i}" for i in range(1200))
        (tmp_path / "table.csv").write_text("inertia,case\n" + table)
        own = {"engine": "my.toml", "designs": {"file": "table.csv"}}
        write_scene(scene, ["delta", "imep"], **own, axes={"speed": [1200, 1500]})
    if name != "one block":
        monkeypatch.setattr(limits, "LARGEST_BLOCK", 2e4)
    single = name == "float32"
    done = sweeps.stream(scene, tmp_path / "out.nc", scheduler=scheduler, single=single)
    assert (done.blocks == 1) == (name == "one block")
    if not single:
        same_but_machine(tmp_path / "out.nc", sweeps.run(scene))
    else:
        sweeps.stream(scene, tmp_path / "local.nc", single=True)
        with open_archive(tmp_path / "local.nc") as local, open_archive(tmp_path / "out.nc") as out:
            xr.testing.assert_identical(out.drop_attrs(), local.drop_attrs())
    assert not list(tmp_path.glob("*.partial"))


def test_by_the_command_and_in_shards(scheduler: str, tmp_path: Path, scene: Path) -> None:
    for part in ("1/2", "2/2"):
        path = tmp_path / f"{part[0]}.nc"
        result = ok("run", scene, "-o", path, "--shard", part, "--scheduler", scheduler)
        assert "converged 60000" in result
    ok("merge", tmp_path / "1.nc", tmp_path / "2.nc", "-o", tmp_path / "out.nc")
    assert_same(tmp_path / "out.nc", sweeps.run(scene))


def test_blocks_are_enough_for_all_and_not_tiny(tmp_path: Path) -> None:
    plan = plan_of(tmp_path, LARGE_MAP.replace("num = 400", "num = 500000"))
    few, many = (cluster.DaskWorkers(None, "tcp://h:1", {}, ["m"] * n, print) for n in (2, 100))
    assert len(set(cluster.EACH * np.array([2, 100]) > cluster.FEWEST)) == 2
    assert 4e6 < many.block_bytes(plan, 64e6) < few.block_bytes(plan, 64e6) < 64e6
    assert few.block_bytes(plan, 1e5) == 1e5
    small = plan_of(tmp_path, MAP)
    assert few.block_bytes(small, 64e6) == 4e6


def test_a_folder_holds_the_scene_as_plain_data(tmp_path: Path, small: None) -> None:
    """No path of the one who asks is read, and nothing is unpickled."""
    plan = plan_of(tmp_path, MAP)
    here = Partial(tmp_path / "folder")
    here.path.mkdir()
    identity = provenance.identity(plan)
    here.begin({"identity": identity, "lengths": {}})
    worker.hand_over(here, plan)
    (tmp_path / "scene.toml").unlink()
    again = worker.plan_of_folder(here)
    assert provenance.differences(identity, provenance.identity(again)) == []
    assert again.designs == plan.designs and again.outputs == plan.outputs
    for name, values in plan.scene.axes.items():
        assert_array_equal(again.scene.axes[name], values)


def slow_block(folder: str, key: str, number: int) -> Any:
    """Compute a block as a worker does, slowly, and keep a diary of it beside the folder."""
    import os
    import time
    from pathlib import Path

    from sweeps.running.compute import worker

    def write(word: str) -> None:
        with Path(folder).with_name("diary.txt").open("a") as stream:
            stream.write(f"{word} {number} {os.getpid()}\n")

    there = Path(folder, f"block-{number:06d}.bin").exists()
    write("there" if there else "begun")
    time.sleep(0.2)
    found = worker.block(folder, key, number)
    if not there:
        write("ended")
    return found


def diary(folder: Path) -> list[tuple[str, int, int]]:
    try:
        lines = (folder / "diary.txt").read_text().splitlines()
    except OSError:
        return []
    return [(word, int(number), int(pid)) for word, number, pid in map(str.split, lines)]


def ended(folder: Path) -> int:
    return sum(word == "ended" for word, _, _ in diary(folder))


def wait_for(what: Callable[[], bool]) -> None:
    for _ in range(3000):
        if what():
            return
        time.sleep(0.02)
    raise AssertionError("it never came")


@pytest.mark.skipif(sys.platform == "win32", reason="needs SIGKILL")
def test_a_killed_worker_costs_its_blocks_and_nothing_else(
    scheduler: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, scene: Path
) -> None:
    monkeypatch.setattr(worker, "block", slow_block)
    killed: list[int] = []

    def kill() -> None:
        wait_for(lambda: ended(tmp_path) >= 4)
        killed.append(diary(tmp_path)[-1][2])
        os.kill(killed[0], signal.SIGKILL)

    killer = threading.Thread(target=kill)
    killer.start()
    done = sweeps.stream(scene, tmp_path / "out.nc", scheduler=scheduler)
    killer.join()
    assert done.blocks > 10
    story = diary(tmp_path)
    begun = [number for word, number, _ in story if word == "begun"]
    lost = {n for w, n, pid in story if w == "begun" and pid == killed[0]}
    lost -= {n for w, n, pid in story if w == "ended" and pid == killed[0]}
    assert len(lost) <= 1  # a worker is at one block
    assert sorted(begun) == sorted([*range(done.blocks), *lost])
    same_but_machine(tmp_path / "out.nc", sweeps.run(scene))


SLOW_CLIENT = """
import sys, time
import sweeps.running.compute.limits, sweeps.running.compute.worker
sweeps.running.compute.limits.LARGEST_BLOCK = 4e5
def slow(folder, key, number):
    import time
    from sweeps.running.compute import worker
    time.sleep(0.2)
    return worker.block(folder, key, number)
if __name__ == "__main__":
    import signal
    signal.signal(signal.SIGINT, signal.default_int_handler)
    sweeps.running.compute.worker.block = slow
    from sweeps.cli.main import main
    main()
"""


def start(*arguments: str, folder: Path) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", SLOW_CLIENT, *arguments], cwd=folder, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip


def finished(folder: Path) -> dict[str, int]:
    return {p.name: p.stat().st_mtime_ns for p in folder.glob("out.nc.partial/block-*.bin")}


@pytest.mark.skipif(sys.platform == "win32", reason="needs SIGKILL")
def test_resume_after_the_client_was_killed(
    scheduler: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, scene: Path
) -> None:
    process = start("run", "scene.toml", "-o", "out.nc", "--scheduler", scheduler, folder=tmp_path)
    wait_for(lambda: len(finished(tmp_path)) >= 3 or process.poll() is not None)
    process.kill()
    _, errors = process.communicate()
    assert finished(tmp_path) and not (tmp_path / "out.nc").exists(), errors
    told = ok("info", tmp_path / "out.nc.partial")
    assert re.search(r"finished: \d+ of 12 blocks\n.*\n.*command line: .*", told)
    # A worker ends the block that it is at; dask forgets the others.
    kept = finished(tmp_path)
    monkeypatch.setattr(worker, "block", slow_block)
    result = ok("run", scene, "-o", tmp_path / "out.nc", "--resume", "--scheduler", scheduler)
    said = re.search(r"\((\d+) of 12 blocks had been computed before\)", result)
    assert said and int(said[1]) >= len(kept)
    again = {f"block-{number:06d}.bin" for word, number, _ in diary(tmp_path) if word == "begun"}
    assert not again & set(kept)
    same_but_machine(tmp_path / "out.nc", sweeps.run(scene))


@pytest.mark.parametrize(
    "bad",
    ["", "local", "local:", "local:0", "local:-1", "local:2.5", "local:1025", "local:²",
     "host:8786", "http://host:8786", "tcp://", "tcp:// host", "pickle.bin"],
)  # fmt: skip
def test_addresses_that_are_none(bad: str, tmp_path: Path) -> None:
    text = refused("run", "first", "-o", tmp_path / "out.nc", f"--scheduler={bad}")
    assert "tcp://host:8786, or local:N" in text
    with pytest.raises(sweeps.SceneError, match="local:N"):
        sweeps.stream("first", tmp_path / "out.nc", scheduler=bad or "x")
    assert list(tmp_path.iterdir()) == []


def test_dask_is_named_where_it_is_missing_and_needed_nowhere_else(tmp_path: Path) -> None:
    words = ["run", "first", "-o", tmp_path / "out.nc"]
    for name in ("distributed", "dask"):
        folder = tmp_path / f"without {name}"
        (folder / name).mkdir(parents=True)
        (folder / name / "__init__.py").write_text(f'raise ImportError("no {name}")')
        done = python(COMMAND, *words, "--scheduler", "local:2", path=folder)
        assert done.returncode == 2 and done.stderr.count("\n") == 1
        assert "needs dask" in done.stderr and "pip install 'engine-dyn[cluster]'" in done.stderr
    done = python(COMMAND, *words, path=folder)  # distributed needs dask too
    assert done.returncode == 0, done.stderr


def elsewhere(folder: str, key: str) -> str:
    from sweeps.running.compute.worker import look

    return look(f"/not shared{folder}", key)


def not_ours(folder: str, key: str) -> str:
    from sweeps.running.compute.worker import look

    return look(folder, "another key")


def other_kind(dask_worker: Any) -> dict[str, Any]:
    from sweeps.running.compute.worker import about

    told = about(dask_worker)
    if dask_worker.name == 1:
        kind = {**told["kind"], "processor": "i386"}
        kind["instructions"] = kind["instructions"].replace("sse2", "magic")
        told["kind"] = kind
    return told


def other_versions() -> dict[str, str]:
    return {**provenance.versions(), "numpy": "1.0", "kernels": "0"}


NOT_SHARED = "does not see .*must be on a file system that all workers share"


@pytest.mark.parametrize(
    ("module", "name", "instead", "message"),
    [
        (worker, "look", elsewhere, NOT_SHARED),
        (worker, "look", not_ours, NOT_SHARED),
        (worker, "about", other_kind,
         r"a different kind of machine from .*: processor \(was .*instructions \(with"),
        (cluster, "versions", other_versions,
         r"kernels \(is [0-9a-f]{16}, here 0\), numpy \(is \S+, here 1.0\)"),
    ],
)  # fmt: skip
def test_workers_that_do_not_fit(
    module: Any, name: str, instead: Any, message: str, scheduler: str, tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.setattr(module, name, instead)
    text = refused("run", "first", "-o", tmp_path / "out.nc", "--scheduler", scheduler)
    assert re.search(message, text), text
    assert list(tmp_path.iterdir()) == []


def dying(folder: str, key: str, number: int) -> Any:
    import os

    os._exit(1)


@pytest.mark.skipif(sys.platform == "win32", reason="needs a Unix")
def test_a_block_that_kills_its_workers_ends_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, small: None
) -> None:
    import dask

    (tmp_path / "scene.toml").write_text(MAP)
    monkeypatch.setattr(worker, "block", dying)
    with dask.config.set({"distributed.scheduler.allowed-failures": 0}):
        result = invoke(
            "run", tmp_path / "scene.toml", "-o", tmp_path / "o.nc", "--scheduler", "local:1"
        )
    assert result.exit_code == 1, result.output
    assert re.search(r"local:1: KilledWorker: .*; nothing written\n", result.stderr), result.stderr
    assert [p.name for p in tmp_path.iterdir()] == ["scene.toml"]


def test_a_scheduler_that_goes_away(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, scene: Path
) -> None:
    """The blocks stay; a run of one process goes on with them."""
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    monkeypatch.setattr(worker, "block", slow_block)
    with workers(1) as running:

        def leave() -> None:
            wait_for(lambda: ended(tmp_path) >= 2)
            running.close()

        leaver = threading.Thread(target=leave)
        leaver.start()
        result = invoke(
            "run", scene, "-o", tmp_path / "out.nc", "--scheduler", running.scheduler_address
        )
        leaver.join()
    assert result.exit_code == 1, result.output
    assert re.search(r"(has disappeared|has abandoned the run).*; \d+ of 12 blocks", result.stderr)
    kept = len(finished(tmp_path))
    assert sweeps.stream(scene, tmp_path / "out.nc", resume=True).before == kept >= 2
    assert_same(tmp_path / "out.nc", sweeps.run(scene))


@pytest.mark.parametrize("key", ["processor", "instructions", "C library"])
def test_resume_on_another_kind_of_machine_is_refused(
    key: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, small: None
) -> None:
    plan, output = plan_of(tmp_path, LARGE_MAP), tmp_path / "out.nc"
    interrupted(plan, output, monkeypatch)
    header = json.loads((tmp_path / "out.nc.partial" / "run.json").read_text())
    assert header["kind"] == provenance.machine_kind()
    now = {**header["kind"], key: header["kind"][key].replace(header["kind"][key][:4], "other ", 1)}
    with monkeypatch.context() as patch:
        patch.setattr(into_archive, "machine_kind", lambda: now)
        result = refused("run", tmp_path / "scene.toml", "-o", output, "--resume")
        assert f"cannot be resumed, because it belongs to a different run: {key} (" in result
    assert len(Partial.of(output).finished()) == 3
    assert into_archive.run(plan, output, Options(resume=True)).before == 3
