"""Archives that are written block by block: the same bytes, in bounded memory, whatever happens."""

import json
import os
import random
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_array_equal

import sweeps
from engine_dyn.compilation import COMPILING
from sweeps.running.archive import netcdf
from sweeps.running.archive.partial import Partial
from sweeps.running.compute import into_archive, limits
from sweeps.running.compute.options import Options
from sweeps.scene.plan.plan import make_plan
from sweeps.scene.reading import read_scene
from tests.support.archives import assert_same, interrupted, plan_of, stop_after, watch_blocks
from tests.support.commands import invoke, ok, refused
from tests.support.engine_files import ENGINES
from tests.support.scenes import IN_BLOCKS, LARGE_MAP, MAP
from tests.sweeps.processes import ROOT, python

pytestmark = pytest.mark.compiled

SMALL = 4e4
"""Bytes of a block."""

PROGRAM = """
import sys
import sweeps.running.compute.limits
sweeps.running.compute.limits.LARGEST_BLOCK = 4e5
from sweeps.cli.main import main
main()
"""


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limits, "LARGEST_BLOCK", SMALL)


@pytest.mark.parametrize("name", IN_BLOCKS)
@pytest.mark.parametrize("limit", [1e3, 64e6])
def test_streamed_archive_is_that_of_the_dataset(
    name: str, limit: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = {"engine": "ntua", **IN_BLOCKS[name]}
    monkeypatch.setattr(limits, "LARGEST_BLOCK", limit)
    done = into_archive.run(make_plan(read_scene(scene)), tmp_path / "out.nc", Options())
    if limit == 1e3 and name != "one design":
        assert done.blocks > 1
    expected = sweeps.run(scene)
    assert_same(tmp_path / "out.nc", expected)
    if "status" in expected:
        assert sum(done.outcomes.values()) == expected["status"].size
    assert [p.name for p in tmp_path.iterdir()] == ["out.nc"]


def test_compressed_and_in_32_bits(tmp_path: Path, small: None) -> None:
    plan = plan_of(tmp_path)
    sizes = []
    for number, options in enumerate(
        (Options(), Options(level=4), Options(single=True), Options(level=9, single=True))
    ):
        path = tmp_path / f"{number}.nc"
        into_archive.run(plan, path, options)
        sizes.append(path.stat().st_size)
        expected = sweeps.run(tmp_path / "scene.toml")
        with netCDF4.Dataset(path) as file:
            delta = file["delta"]
            assert delta.chunking() != "contiguous"
            assert delta.filters()["complevel"] == (options.level or 0)
            values = delta[...]
        if options.single:
            assert values.dtype == np.float32
            assert_array_equal(values, expected["delta"].values.astype("f4"))
        else:
            assert_array_equal(values, expected["delta"].values)
    assert sizes[1] < sizes[0] and sizes[2] < sizes[0] and sizes[3] < sizes[2]


@pytest.mark.parametrize(
    ("dims", "shape", "lengths"),
    [
        ("abc", (20, 1000, 500), {"a": 3}), ("abc", (1000, 500, 200), {"a": 1, "b": 384}),
        ("a", (10_000_001,), {"a": 499_968}), ("abc", (7, 1013, 1019), {}),
        ("abc", (3, 720, 5000), {"c": 1024}), ("ab", (10, 10), {"a": 3}),
    ],
)  # fmt: skip
def test_blocks_are_whole_chunks_and_little_room_is_lost(
    dims: str, shape: tuple[int, ...], lengths: dict[str, int]
) -> None:
    chunks = netcdf.chunks_of(tuple(dims), shape, lengths)
    if chunks != shape:
        assert all(lengths[d] % c == 0 for d, c in zip(dims, chunks, strict=True) if d in lengths)
        assert 2000 < np.prod(chunks) <= netcdf.CHUNK
    room = np.prod([-(-n // c) * c for n, c in zip(shape, chunks, strict=True)])
    assert np.prod(shape) > 0.98 * room


def test_columns_that_do_not_fit_the_memory_are_refused() -> None:
    columns = {key: np.linspace(0.1, 0.2, 4_000_000) for key in ("stroke", "bore", "crank_ratio")}
    scene = {"engine": "ntua", "designs": columns, "output": {"quantities": ["delta"]}}
    plan = make_plan(read_scene(scene))
    with pytest.raises(sweeps.SceneError, match=r"--memory 100 MB: 4000000 designs .* 112 MB"):
        limits.block_bytes(plan, 100e6)
    assert limits.block_bytes(plan, 200e6) == pytest.approx((200e6 - 96e6) / 4, rel=1e-3)
    assert limits.block_bytes(plan, None) == limits.LARGEST_BLOCK


def test_an_archive_larger_than_the_disk_is_refused_before_computing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, small: None
) -> None:
    plan_of(tmp_path)
    monkeypatch.setattr(into_archive, "Computation", None)
    real = limits.shutil.disk_usage(tmp_path)
    monkeypatch.setattr(limits.shutil, "disk_usage", lambda _: real._replace(free=100_000))
    result = refused("run", tmp_path / "scene.toml", "-o", tmp_path / "out.nc")
    assert re.search(r"6000 designs make an archive of 103 kB; 100 kB are free", result)
    assert [p.name for p in tmp_path.iterdir()] == ["scene.toml"]


def test_a_disk_with_room_for_one_archive_is_enough(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, small: None
) -> None:
    """Not for the blocks beside it: they are given up as they are put together."""
    plan = plan_of(tmp_path, LARGE_MAP)
    size = limits.archive_bytes(plan)
    real = limits.shutil.disk_usage(tmp_path)
    room = 1.2 * size
    monkeypatch.setattr(limits.shutil, "disk_usage", lambda _: real._replace(free=room))
    seen: list[int] = []
    put = netcdf.Writer.put

    def measured(self: netcdf.Writer, *arguments: Any) -> None:
        put(self, *arguments)
        files = (tmp_path / "out.nc.partial").iterdir()
        seen.append(sum(path.stat().st_size for path in files))

    monkeypatch.setattr(netcdf.Writer, "put", measured)
    into_archive.run(plan, tmp_path / "out.nc", Options())
    assert 0.9 * size < max(seen) < room
    monkeypatch.undo()
    assert_same(tmp_path / "out.nc", sweeps.run(tmp_path / "scene.toml"))


def test_resume_computes_nothing_but_what_is_missing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, small: None
) -> None:
    plan, output = plan_of(tmp_path), tmp_path / "out.nc"
    interrupted(plan, output, monkeypatch, 5)
    told = ok("info", tmp_path / "out.nc.partial")
    assert re.search(r"A map\n.*6000\n.*5 of \d+ blocks\n", told)
    assert "use --resume to complete it" in refused("run", tmp_path / "scene.toml", "-o", output)
    seen = watch_blocks(monkeypatch)
    header = json.loads((tmp_path / "out.nc.partial" / "run.json").read_text())
    assert header["block_bytes"] == SMALL
    (tmp_path / "out.nc.partial" / "run.json").write_text(
        json.dumps({**header, "block_bytes": 30e6})
    )
    with pytest.raises(sweeps.SceneError, match="at least the memory limit of the first run"):
        into_archive.run(plan, output, Options(resume=True, memory=100e6))
    for wrong in ({"lengths": {"": 3}}, {"lengths": {"speed": 1}}, {"blocks": 1}):
        (tmp_path / "out.nc.partial" / "run.json").write_text(json.dumps({**header, **wrong}))
        with pytest.raises(sweeps.SceneError, match=r"run\.json is damaged: it has blocks of"):
            into_archive.run(plan, output, Options(resume=True))
    (tmp_path / "out.nc.partial" / "run.json").write_text(json.dumps(header))
    # Less memory would cut otherwise: what is there counts.
    monkeypatch.setattr(limits, "LARGEST_BLOCK", 2e4)
    done = into_archive.run(plan, output, Options(resume=True))
    assert (done.before, len(seen)) == (5, done.blocks - 5)
    assert_same(output, sweeps.run(tmp_path / "scene.toml"))
    assert sorted(p.name for p in tmp_path.iterdir()) == ["out.nc", "scene.toml"]
    # Finished and matching: at once, and nothing is computed.
    seen.clear()
    before = output.stat()
    again = ok("run", tmp_path / "scene.toml", "-o", output, "--resume")
    assert "already complete" in again
    assert f"converged {6000}" in again
    assert not seen and output.stat().st_mtime_ns == before.st_mtime_ns


DAMAGE: dict[str, Callable[[bytes, bytes], bytes]] = {
    "flip": lambda own, _: own[:99] + bytes([own[99] ^ 4]) + own[100:],
    "cut": lambda own, _: own[:-8],
    "empty": lambda own, _: b"",
    "swap": lambda own, other: other,
}


@pytest.mark.parametrize("damage", [*DAMAGE, "remove"])
def test_a_damaged_block_is_computed_again(
    damage: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, small: None
) -> None:
    plan, output = plan_of(tmp_path), tmp_path / "out.nc"
    interrupted(plan, output, monkeypatch, 6)
    block, other = sorted((tmp_path / "out.nc.partial").glob("block-*"))[2:4]
    if damage == "remove":
        block.unlink()
    else:
        block.write_bytes(DAMAGE[damage](block.read_bytes(), other.read_bytes()))
    told = ok("run", tmp_path / "scene.toml", "-o", output, "--resume")
    assert "(5 of " in told and " had been computed before" in told
    assert ("; 1 block was damaged and computed again)" in told) == (damage != "remove")
    assert_same(output, sweeps.run(tmp_path / "scene.toml"))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("scene", r"\[axes\] inertia stop \(was 9.0, is 8.0\)"),
        ("quantity", r"\[output\] quantities"),
        ("engine", r"file my.toml \(was [0-9a-f]{16}, is [0-9a-f]{16}\)"),
        ("indicator", "file pressure.csv"),
        ("kernels", r"version of kernels"),
        ("version", r"version of engine-dyn \(was 0.0.9, is"),
        ("numbers", r"numbers \(was float64, is float32\)"),
    ],
)
def test_resume_refuses_what_does_not_match_and_says_what(
    change: str, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, small: None
) -> None:
    engine = (ENGINES / "diesel_105x137.toml").read_text()
    (tmp_path / "my.toml").write_text(engine.replace("diesel_105x137_pressure.csv", "pressure.csv"))
    pressure = (ENGINES / "diesel_105x137_pressure.csv").read_text()
    (tmp_path / "pressure.csv").write_text(pressure)
    text = MAP.replace('"ntua"', '"my.toml"')
    plan, output = plan_of(tmp_path, text), tmp_path / "out.nc"
    interrupted(plan, output, monkeypatch)
    single = change == "numbers"
    if change == "scene":
        text = text.replace("9.0", "8.0")
    elif change == "quantity":
        text = text.replace('"fmep"', '"bmep"')
    elif change == "engine":
        path = tmp_path / "my.toml"
        path.write_text(path.read_text() + "\n# another\n")
    elif change == "indicator":
        (tmp_path / "pressure.csv").write_text(pressure + "\n")
    elif change in ("kernels", "version"):
        header = tmp_path / "out.nc.partial" / "run.json"
        found = json.loads(header.read_text())
        key, old = ("kernels", "0123") if change == "kernels" else ("engine-dyn", "0.0.9")
        found["identity"]["versions"][key] = old
        header.write_text(json.dumps(found))
    plan = plan_of(tmp_path, text)
    with pytest.raises(sweeps.SceneError, match=said):
        into_archive.run(plan, output, Options(resume=True, single=single))
    assert len(Partial.of(output).finished()) == 3
    # Beginning again is always possible; then the finished archive is compared instead.
    into_archive.run(plan, output, Options(overwrite=True, single=single))
    assert_same(output, sweeps.run(tmp_path / "scene.toml")) if not single else None
    other = plan_of(tmp_path, text.replace("1800", "1900"))
    with pytest.raises(sweeps.SceneError, match=r"archive of something else: .*speed stop"):
        into_archive.run(other, output, Options(resume=True, single=single))


def test_the_old_archive_stays_until_the_new_one_is_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, small: None
) -> None:
    path, output = tmp_path / "scene.toml", tmp_path / "out.nc"
    plan_of(tmp_path)
    into_archive.run(make_plan(read_scene("first")), output, Options())
    before = output.read_bytes()
    with monkeypatch.context() as patch:
        stop_after(patch, 4, KeyboardInterrupt())
        result = invoke("run", path, "-o", output, "--overwrite")
    assert result.exit_code == 1
    assert result.stderr.endswith(f"engine-dyn run {path} -o {output} --resume --overwrite\n")
    assert output.read_bytes() == before
    # Without --overwrite, the archive that is there counts, and is another one.
    assert "archive of something else" in invoke("run", path, "-o", output, "--resume").stderr
    assert len(Partial.of(output).finished()) == 4
    again = ok("run", path, "-o", output, "--resume", "--overwrite")
    assert "(4 of " in again
    assert_same(output, sweeps.run(path))


LIMITED = """
import resource, sys
import sweeps.running.compute.limits
from sweeps.cli.main import main
sweeps.running.compute.limits.LARGEST_BLOCK = 4e5
sweeps.run(sys.argv[3])  # loads the kernels, which need files of their own
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv.pop(1)),) * 2)
main()
"""


@pytest.mark.skipif(sys.platform == "win32", reason="needs limits of the system")
@pytest.mark.parametrize("limit", [20_000, 300_000])
def test_a_file_that_may_not_grow(limit: int, tmp_path: Path, monkeypatch: Any) -> None:
    """The system itself refuses: first a block, then only the archive."""
    path, output = tmp_path / "scene.toml", tmp_path / "out.nc"
    path.write_text(MAP.replace("num = 40", "num = 200"))
    done = python(LIMITED, limit, "run", path, "-o", output)
    assert done.returncode == 1, done.stderr
    assert "cannot be written" in done.stderr and "Traceback" not in done.stderr
    assert not output.exists()
    monkeypatch.setattr(limits, "LARGEST_BLOCK", 4e5)
    finished = into_archive.run(make_plan(read_scene(path)), output, Options(resume=True))
    assert finished.before == (0 if limit < 100_000 else finished.blocks)
    assert_same(output, sweeps.run(path))


@pytest.mark.parametrize(
    "name",
    ["with blank.nc", "größe λ ω.nc", "'quotes\" & $HOME.nc", "n" * 246 + ".nc", "ü" * 120 + ".nc"],
    ids=["blank", "unicode", "quotes", "long", "long unicode"],
)
def test_names_of_every_kind(name: str, tmp_path: Path, monkeypatch: Any, small: None) -> None:
    plan = plan_of(tmp_path)
    output = tmp_path / "a folder ñ" / name
    output.parent.mkdir()
    interrupted(plan, output, monkeypatch)
    into_archive.run(plan, output, Options(resume=True))
    assert [p.name for p in output.parent.iterdir()] == [name]
    assert_same(output, sweeps.run(tmp_path / "scene.toml"))


SLOW = """
import signal
import time
from sweeps.running.archive.partial import Partial
signal.signal(signal.SIGINT, signal.default_int_handler)
write = Partial.write
def wait_and_write(*arguments):
    time.sleep(0.1)
    return write(*arguments)
Partial.write = wait_and_write
"""
"""Put before PROGRAM: on a quick machine all would be done before a signal arrives, and what a
shell starts in the background does not hear this one."""


def start(*arguments: str | Path, folder: Path, before: str = "") -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", before + PROGRAM, *map(str, arguments)],
        cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip


def wait_for(what: Callable[[], bool], process: subprocess.Popen[str]) -> None:
    while process.poll() is None and not what():
        time.sleep(0.002)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> xr.Dataset:
    folder = tmp_path_factory.mktemp("whole")
    (folder / "scene.toml").write_text(LARGE_MAP)
    return sweeps.run(folder / "scene.toml")


@pytest.mark.skipif(sys.platform == "win32", reason="needs SIGKILL")
@pytest.mark.parametrize("number", range(2))
def test_killed_at_any_moment(number: int, tmp_path: Path, whole: xr.Dataset) -> None:
    """Two points; `make large-runs` has a hundred."""
    (tmp_path / "scene.toml").write_text(LARGE_MAP)
    chance = random.Random(number)
    output, folder = tmp_path / "out.nc", tmp_path / "out.nc.partial"
    process = start("run", "scene.toml", "-o", "out.nc", folder=tmp_path)
    wait_for(lambda: (folder / "run.json").exists(), process)
    time.sleep(chance.uniform(0.0, 0.4))
    process.kill()
    process.communicate()
    if not output.exists():
        ok("info", folder)
    finished = {p.name: p.stat().st_mtime_ns for p in folder.glob("block-*.bin")}
    again = start("run", "scene.toml", "-o", "out.nc", "--resume", folder=tmp_path)
    text, errors = again.communicate()
    assert again.returncode == 0, errors
    if finished:
        assert f"({len(finished)} of " in text or "already complete" in text
    assert_same(output, whole)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["out.nc", "scene.toml"]


FRESH = """
import hashlib, sys, sweeps
from engine_dyn.compilation import on_compiling
on_compiling(lambda: print("compiled", end=" "))
found = sweeps.run(sys.argv[1])
data = b"".join(found[name].values.tobytes() for name in sorted(found.data_vars))
print(hashlib.sha256(data).hexdigest())
"""


@pytest.mark.slow
def test_kernels_just_compiled_compute_the_same_bits(tmp_path: Path) -> None:
    """Else a run could be resumed to other bytes than it would have had in one go."""
    (tmp_path / "scene.toml").write_text(LARGE_MAP)
    cache = {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    said = [
        python(FRESH, tmp_path / "scene.toml", environment=cache, check=True).stdout
        for _ in range(2)
    ]
    assert said[0] == f"compiled {said[1]}"


@pytest.mark.skipif(sys.platform == "win32", reason="needs signals")
def test_ctrl_c_says_how_to_go_on(tmp_path: Path, whole: xr.Dataset) -> None:
    (tmp_path / "scene.toml").write_text(LARGE_MAP)
    folder = tmp_path / "out.nc.partial"
    process = start("run", "scene.toml", "-o", "out.nc", folder=tmp_path, before=SLOW)
    wait_for(lambda: len(list(folder.glob("block-*.bin"))) > 1, process)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate()
    assert process.returncode == 1, errors
    assert re.fullmatch(
        r"engine-dyn: interrupted; \d+ of \d+ blocks are finished in out.nc.partial; to continue: "
        r"engine-dyn run scene.toml -o out.nc --resume\n",
        errors.replace(f"{COMPILING}\n", ""),
    )
    told = ok("info", folder)
    assert f"{folder}: an interrupted run of out.nc\n" in told
    assert told.endswith("  to go on: engine-dyn run scene.toml -o out.nc --resume\n")
    again = start("run", "scene.toml", "-o", "out.nc", "--resume", folder=tmp_path)
    assert again.wait() == 0
    again.communicate()
    assert_same(tmp_path / "out.nc", whole)


@pytest.mark.skipif(sys.platform == "win32", reason="needs SIGSTOP")
def test_a_running_process_keeps_others_away_and_a_killed_one_does_not(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(LARGE_MAP)
    folder = tmp_path / "out.nc.partial"
    process = start("run", "scene.toml", "-o", "out.nc", folder=tmp_path)
    wait_for(lambda: (folder / "run.json").exists(), process)
    process.send_signal(signal.SIGSTOP)
    try:
        told = ok("info", folder)
        refused = invoke("run", tmp_path / "scene.toml", "-o", tmp_path / "out.nc", "--resume")
    finally:
        process.kill()
        process.communicate()
    assert refused.exit_code == 2, refused.output
    assert f"process {process.pid} on" in refused.stderr
    now = f"a run of out.nc, which is being computed now by process {process.pid} on "
    assert told.startswith(f"{folder}: {now}") and "to go on" not in told
    ok("run", tmp_path / "scene.toml", "-o", tmp_path / "out.nc", "--resume")
