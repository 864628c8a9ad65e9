"""Files that others made, and that may mean harm: one line, nothing elsewhere, bounded memory.

What the fuzzer (`make fuzz`) found first has a test of its own here.
"""

import base64
import json
import os
import socket
import sys
import tempfile
import time
import tomllib
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import openpyxl
import pytest
import xarray as xr

import sweeps
import sweeps.view.accessor
import sweeps.view.figures
from sweeps.base.errors import SceneError
from sweeps.base.files import regular_files
from sweeps.base.netcdf import netcdf_files
from sweeps.catalogue import ENGINES
from sweeps.running.archive import partial, provenance
from sweeps.running.archive.partial import Partial
from sweeps.running.compute import into_archive, limits
from sweeps.running.compute.options import Options
from sweeps.scene.design_files.design_files import read_designs
from sweeps.scene.plan.plan import make_plan
from sweeps.scene.reading import read_scene
from tests.support.archives import PLAIN, SMALL, interrupted_files, sound_archive
from tests.support.commands import invoke, ok, refused
from tests.sweeps.processes import ROOT, python

SCENE = 'engine = "ntua"\n[output]\nquantities = ["delta"]\n'

unix = pytest.mark.skipif(sys.platform == "win32", reason="has no such files")


REFERENCES = {
    "indicator": '[indicator]\nfile = "{}"\n', "designs": '[designs]\nfile = "{}"\n',
    "reference": '[reference]\nfile = "{}"\n', "load_table": '[set]\nload_table = "{}"\n',
    "engine": "",
}  # fmt: skip


@pytest.mark.parametrize("key", REFERENCES)
@pytest.mark.parametrize("way", ["dots", "link", "link to folder"])
def test_references_stay_in_the_folder_of_the_scene(key: str, way: str, tmp_path: Path) -> None:
    folder = tmp_path / "scenes"
    folder.mkdir()
    suffix = ".toml" if key == "engine" else ".csv"
    secret = tmp_path / f"secret{suffix}"
    secret.write_text("password,bore\n1,0.1\n")
    named = f"../secret{suffix}"
    if way == "link":
        (folder / f"mine{suffix}").symlink_to(secret)
        named = f"mine{suffix}"
    elif way == "link to folder":
        (folder / "inside").symlink_to(tmp_path)
        named = f"inside/secret{suffix}"
    text = SCENE.replace('"ntua"', f'"{named}"') if key == "engine" else SCENE
    (folder / "scene.toml").write_text(text + REFERENCES[key].format(named))
    told = refused("plan", folder / "scene.toml")
    assert "leads outside the folder" in told and str(secret) in told and "password" not in told
    # Said in full, it is read, and is what it is.
    text = SCENE.replace('"ntua"', f'"{secret}"') if key == "engine" else SCENE
    (folder / "scene.toml").write_text(text + REFERENCES[key].format(secret))
    assert "leads out" not in refused("plan", folder / "scene.toml")


@unix
@pytest.mark.parametrize("name", ["/dev/zero", "pipe", "folder", "loop"])
@pytest.mark.parametrize("key", ["scene", "archive", *REFERENCES])
def test_what_never_ends_is_not_read(name: str, key: str, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.csv")
    (tmp_path / "folder.csv").mkdir()
    (tmp_path / "loop.csv").symlink_to("loop.csv")
    (tmp_path / "zero.csv").symlink_to("/dev/zero")
    path = tmp_path / f"{name.rpartition('/')[2]}.csv"
    if key == "scene":
        told = refused("run", path, "-o", tmp_path / "out.nc")
    elif key == "archive":
        told = refused("info", path)
        refused("rerun", path, "-o", tmp_path / "out.nc")
        refused("merge", path, path, "-o", tmp_path / "out.nc")
    else:
        (tmp_path / "engine.toml").symlink_to(path)
        named = tmp_path / "engine.toml" if key == "engine" else path
        text = SCENE.replace('"ntua"', f'"{named}"') if key == "engine" else SCENE
        (tmp_path / "scene.toml").write_text(text + REFERENCES[key].format(path))
        told = refused("plan", tmp_path / "scene.toml")
    assert any(w in told for w in ("regular", "folder", "irectory", "symbolic", "no such", "not a"))


def test_servers_are_no_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def connect(*_: Any) -> None:
        raise AssertionError("the network was asked")

    monkeypatch.setattr(socket.socket, "connect", connect)
    monkeypatch.chdir(tmp_path)
    for address in ("http://localhost:1/x.nc", "dap4://localhost/x.nc", "s3://bucket/x.nc"):
        refused("info", address)
        (tmp_path / "scene.toml").write_text(SCENE + f'[designs]\nfile = "{address}"\n')
        refused("plan", "scene.toml")
    # A folder of that name makes it a file: it is opened by its whole path, which is no address.
    (tmp_path / "http:" / "localhost").mkdir(parents=True)
    (tmp_path / "http:" / "localhost" / "x.nc").write_bytes(sound_archive())
    ok("info", "http://localhost/x.nc")


TEXTS: dict[str, tuple[bytes, str]] = {
    "a whole number of 5000 digits": (b"x = " + b"9" * 5000, "not TOML: .*digits"),
    "deep lists": (b"x = " + b"[" * 100_000, "nested too deeply"),
    "deep tables": (b"a." * 100_000 + b"b = 1", "nested|not TOML"),
    "deep tables after texts": (
        b"x = {k = \"\"\" \" \"\"\", " + b'"a".' * 100_000 + b"b = 1}", "nested too deeply",
    ),
    "many escaped quotes": (b'x = "' + b'\\"' * 500_000 + b'"', "at most"),
    "no day": (b"x = 2026-02-30", "line 1: not TOML"),
    "UTF-16": (SCENE.encode("utf-16"), "UTF-8"),
    "null": (SCENE.encode() + b"\0", "line 4: not TOML"),
    "a long key": (b"k" * 100_000 + b" = 1", "at most"),
    "direction of writing": ('"\u202ex" = 1'.encode(), r"\\u202ex: unknown"),
    "steering of terminals": (b'"\\u001b[2Jx" = 1', r"\\x1b\[2Jx: unknown"),
    "bytes": (bytes(range(256)), "UTF-8"),
    "too many designs": (SCENE.encode() + b"[axes]\n" + b"\n".join(
        f"{key} = {{ start = 0.1, stop = 0.2, num = 1000000 }}".encode()
        for key in ("bore", "stroke", "crank_ratio")
    ), r"bore x stroke x crank_ratio: 1e\+18 designs; must be at most 1e\+15"),
    "an axis of 10^12": (
        SCENE.encode() + b"[axes]\nbore = { start = 0.1, stop = 0.2, num = 1000000000000 }",
        "num = 1000000000000: must be a whole number from 2 to 10000000",
    ),
    "a long title": (
        b'title = "' + b"a" * (1 << 24) + b'"\n' + SCENE.encode(), "larger than 16.8 MB",
    ),
    "many keys": (
        SCENE.encode() + b"[set]\n" + b"".join(b"k%d = 1\n" % i for i in range(200_000)),
        "200005 keys, tables and lists; must be at most 200000",
    ),
    "many lists": (SCENE.encode() + b"x = [" + b"[]," * 300_000 + b"]", "keys, tables and lists"),
    "a sample beyond numbers": (
        SCENE.encode() + b"[sample]\nnumber = 8\ninertia = { low = 1.0, high = 1e308 }",
        r"\[sample\] inertia high = 1e\+308: must be at most 1e\+30 in size",
    ),
    "a length that is nearly none": (
        SCENE.encode() + b"[set]\nstroke = 1e-200",
        r"\[set\] stroke = 1e-200: must be at least 1e-30",
    ),
    "beyond numbers": (
        SCENE.encode() + b"[axes]\nbore = { start = -1e308, stop = 1e308, num = 5 }",
        r"\[axes\] bore start = -1e\+308: must be at most 1e\+30 in size",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", TEXTS)
def test_texts_that_are_no_scenes(case: str, tmp_path: Path) -> None:
    data, said = TEXTS[case]
    path = tmp_path / "scene.toml"
    path.write_bytes(data)
    with pytest.raises(SceneError, match=said):
        read_scene(path)
    told = refused("plan", path)
    assert len(told) < 2100
    assert refused("info", path)


def test_axes_have_so_many_values_together(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sweeps.scene.axes.MOST_VALUES", 25)
    axis = {"start": 0.1, "stop": 0.2, "num": 9}
    axes = {key: axis for key in ("bore", "stroke", "crank_ratio")}
    with pytest.raises(SceneError, match=r"crank_ratio: 27 values .* at most 25 together"):
        read_scene({"engine": "ntua", "axes": axes, "output": {"quantities": ["delta"]}})


LIMITED = """
import resource, sys
import click.testing
from sweeps.cli.main import main
import sweeps.view.figures.drawing, sweeps.running.join.merge, sweeps.running.compute.into_archive
import netCDF4, pyarrow.parquet
limit = 6 << 30
resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
for line in sys.stdin.read().splitlines():
    result = click.testing.CliRunner().invoke(main, line.split("\\t"))
    now = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    print(result.exit_code, (now - before) // 1024, result.stderr.strip(), flush=True)
"""


def bombs(folder: Path) -> Iterator[tuple[str, ...]]:
    """Small files that claim to be large, and commands that read them."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    def table(name: str) -> tuple[str, ...]:
        path = folder / f"{name}.toml"
        path.write_text(SCENE + f'[designs]\nfile = "{name}"\n')
        return ("plan", str(path))

    for name in ("holes.csv", "holes.toml", "holes.nc", "holes.parquet"):
        with (folder / name).open("wb") as stream:
            stream.truncate(1 << 40)  # takes no room
    yield table("holes.csv")
    yield table("holes.nc")
    yield table("holes.parquet")
    yield "plan", str(folder / "holes.toml")
    yield "info", str(folder / "holes.nc")
    (folder / "line.csv").write_bytes(b"bore" + b" " * (40 << 20) + b"\n0.1\n")
    yield table("line.csv")
    (folder / "odd.csv").write_bytes(b"bore\n" + b"1\n" * (8 << 20) + b"x\n")
    yield table("odd.csv")
    # Parquet: a run of one value takes some bytes, however long it is.
    case = pa.DictionaryArray.from_arrays(np.zeros(20_000, "i4"), ["x" * 1_000_000])
    pq.write_table(
        pa.table({"case": case, "bore": np.full(20_000, 0.1)}), folder / "labels.parquet",
        dictionary_pagesize_limit=1 << 30, compression="zstd",
    )  # fmt: skip
    yield table("labels.parquet")
    for name, size in (("huge", 10**12), ("large", 2 * 10**9)):
        path = folder / f"{name}.nc"
        with netCDF4.Dataset(path, "w") as file:
            file.createDimension("n", size)
            file.createVariable("bore", "f8", ("n",), chunksizes=(1 << 20,), zlib=True)
        yield table(f"{name}.nc")
        path = folder / f"archive_{name}.nc"
        path.write_bytes(sound_archive())
        with netCDF4.Dataset(path, "r+") as file:
            file.createDimension("bore", size)
            file.createVariable("bore", "f8", ("bore",), chunksizes=(1 << 20,), zlib=True)
        for command in ("info", "plot", "compare", "export", "rerun", "merge"):
            more = [str(path)] if command in ("compare", "merge") else []
            name = f"x.{command}.{'csv' if command == 'export' else 'nc'}"
            out = [] if command in ("info", "compare") else ["-o", str(folder / name)]
            yield command, str(path), *more, *out
    chunk = folder / "chunk.nc"
    with netCDF4.Dataset(chunk, "w") as file:
        file.createDimension("n", 9 * 10**7)
        made = file.createVariable(
            "bore", "f8", ("n",), chunksizes=(9 * 10**7,), zlib=True, chunk_cache=1
        )
        made.units = "m"
    yield table("chunk.nc")
    # Attributes: files that inflate, and parts of axes that nobody has.
    with netCDF4.Dataset(path) as file:
        attributes = {name: file.getncattr(name) for name in file.ncattrs()}
    with netCDF4.Dataset(folder / "zlib.nc", "w") as file:
        file.setncatts(attributes)
        known = json.loads(file.getncattr("input_files"))
        zeros = base64.b64encode(zlib.compress(bytes(1 << 27), 9)).decode()
        known["files"] |= {
            f"{n}": {"zlib": zeros, "sha256": provenance.sha256(bytes(1 << 27))} for n in range(40)
        }
        file.setncattr("input_files", json.dumps(known))
    yield "rerun", str(folder / "zlib.nc"), "-o", str(folder / "x.nc")
    part = folder / "part.nc"
    part.write_bytes(sound_archive(True))
    with netCDF4.Dataset(part, "r+") as file:
        piece = {**json.loads(file.getncattr("part")), "of": 10**9}
        file.setncattr("part", json.dumps(piece))
    yield "merge", str(part), str(part), "-o", str(folder / "x.nc")
    interrupted = folder / "run.nc.partial"
    interrupted.mkdir()
    with (interrupted / "run.json").open("wb") as stream:
        stream.truncate(1 << 40)
    yield "info", str(interrupted)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="needs limits of memory that hold")
def test_small_files_do_not_fill_the_memory(tmp_path: Path) -> None:
    commands = list(bombs(tmp_path))
    assert all(p.stat().st_blocks * 512 < 50e6 for p in tmp_path.iterdir() if p.is_file())
    done = python(LIMITED, input="\n".join("\t".join(c) for c in commands), timeout=1200)
    assert done.returncode == 0, done.stderr[-2000:]
    lines = done.stdout.splitlines()
    assert len(lines) == len(commands)
    for command, line in zip(commands, lines, strict=True):
        status, more, message = (*line.split(maxsplit=2), "")[:3]
        if "labels.parquet" not in command[1]:
            assert status == "2", (command, line)
        assert int(more) < 700, (command, line)  # megabytes
        assert "Traceback" not in message


@unix
def test_links_in_the_folder_of_a_run_lead_nowhere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    precious = tmp_path / "precious.txt"
    precious.write_text("precious")
    monkeypatch.setattr(limits, "LARGEST_BLOCK", 4e3)
    plan = make_plan(read_scene(tomllib.loads(PLAIN)))
    for name in ("run.json.new", "block-000001.bin.new", "archive.nc", "run.json", "lock"):
        output = tmp_path / f"{name}.nc"
        folder = Partial.of(output).path
        folder.mkdir()
        (folder / name).symlink_to(precious)
        if name == "lock":
            with pytest.raises(OSError, match=r"symbolic|link|regular"):
                into_archive.run(plan, output, Options())
            scene = tmp_path / "scene.toml"
            scene.write_text(PLAIN)
            assert "cannot be written" in refused("run", scene, "-o", output)
        else:
            into_archive.run(plan, output, Options())
            assert not output.is_symlink() and output.exists()
        assert precious.read_text() == "precious"


@unix
@pytest.mark.parametrize("kind", ["device", "pipe", "loop", "dangling", "link"])
def test_outputs_that_are_no_files(kind: str, tmp_path: Path) -> None:
    path = tmp_path / "out.nc"
    target = tmp_path / "elsewhere.nc"
    if kind == "device":
        path = Path("/dev/null")
    elif kind == "pipe":
        os.mkfifo(path)
    else:
        path.symlink_to({"loop": path, "dangling": target, "link": target}[kind])
    if kind == "link":
        target.write_text("mine")
    told = refused("run", "first", "-o", path)
    assert ("pipe or a device" if kind in ("device", "pipe") else "exists") in told
    if kind in ("device", "pipe"):
        refused("run", "first", "-o", path, "--overwrite")
        refused("run", "first", "-o", path, "--resume")
        assert not path.is_file()
    assert target.exists() == (kind == "link")


@pytest.mark.parametrize("name", ["scene.toml", "engine.toml", "p.csv", "designs.csv"])
def test_a_run_does_not_replace_what_it_reads(name: str, tmp_path: Path) -> None:
    engine = (ENGINES / "diesel_105x137.toml").read_text()
    pressure = ENGINES / "diesel_105x137_pressure.csv"
    (tmp_path / "p.csv").write_bytes(pressure.read_bytes())
    (tmp_path / "engine.toml").write_text(engine.replace(pressure.name, "p.csv"))
    (tmp_path / "designs.csv").write_text("bore\n0.1\n")
    (tmp_path / "scene.toml").write_text(
        SCENE.replace('"ntua"', '"engine.toml"') + '[designs]\nfile = "designs.csv"\n'
    )
    before = (tmp_path / name).read_bytes()
    told = refused("run", tmp_path / "scene.toml", "-o", tmp_path / name, "--overwrite")
    assert "must name another file" in told
    assert (tmp_path / name).read_bytes() == before


@contextmanager
def nobody() -> Iterator[None]:
    """As somebody who may not do everything, where the tests run as root."""
    root = hasattr(os, "geteuid") and os.geteuid() == 0
    if root:
        os.seteuid(65534)
    try:
        yield
    finally:
        if root:
            os.seteuid(0)


@unix
def test_a_read_only_folder_is_refused_before_computing(monkeypatch: pytest.MonkeyPatch) -> None:
    # Not in pytest's own folder, which is its user's alone.
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for path in ("diesel_105x137.toml", "diesel_105x137_pressure.csv"):
            (folder / path).write_bytes((ENGINES / path).read_bytes())
        scene = folder / "scene.toml"
        scene.write_text(SCENE.replace('"ntua"', '"diesel_105x137.toml"'))
        assert invoke("plan", scene).exit_code == 0  # loads what the package may be hidden from
        good = folder / "good.nc"
        good.write_bytes(sound_archive())
        ok("export", good, "-o", folder / "before.csv")
        folder.chmod(0o555)
        for path in folder.iterdir():
            path.chmod(0o444)
        try:
            with nobody():
                # What follows must have been refused by the folder, not by the files.
                assert scene.read_text() and not os.access(folder, os.W_OK, effective_ids=True)
                for arguments in (
                    ("run", scene, "-o", folder / "out.nc"),
                    ("run", scene, "-o", folder / "new" / "out.nc"),
                    ("export", good, "-o", folder / "out.csv"),
                    ("plot", good, "-o", folder / "figures"),
                    ("new", folder / "my.toml"),
                ):
                    told = refused(*arguments)
                    assert "cannot be written (Permission denied)" in told
        finally:
            folder.chmod(0o755)


@pytest.mark.parametrize("place", ["file", pytest.param("/proc", marks=unix)])
def test_what_is_no_folder_to_write_into(place: str, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    good, place = tmp_path / "good.nc", tmp_path / place
    good.write_bytes(sound_archive())
    for arguments in (
        ("run", "first", "-o", place / "out.nc"), ("rerun", good, "-o", place / "out.nc"),
        ("merge", good, good, "-o", place / "out.nc"), ("export", good, "-o", place / "out.csv"),
        ("plot", good, "-o", place / "figures"), ("new", place / "my.toml"),
    ):  # fmt: skip
        assert "cannot be written" in refused(*arguments)
    refused("plot", good, "-o", tmp_path / ("n" * 300))
    assert (tmp_path / "file").read_text() == "mine"


@pytest.mark.skipif(sys.platform != "linux", reason="names of files are texts elsewhere")
def test_names_that_are_no_texts(tmp_path: Path) -> None:
    folder = tmp_path / os.fsdecode(b"b\xff d")
    folder.mkdir()
    scene = folder / os.fsdecode(b"s\xfe.toml")
    scene.write_text(PLAIN)
    output = tmp_path / "out.nc"
    ok("run", scene, "-o", output)
    ok("info", output)
    ok("rerun", output, "-o", tmp_path / "again.nc")
    # The library of netCDF takes names in UTF-8 alone.
    told = refused("run", scene, "-o", folder / "out.nc")
    assert "UTF-8" in told and r"b\udcff d" in told
    (folder / "a.nc").write_bytes(output.read_bytes())
    assert "not a netCDF archive" in refused("info", folder / "a.nc")
    assert "no such file" in refused("plan", folder / os.fsdecode(b"\xfc.toml"))


def test_texts_of_an_archive_stay_on_their_lines(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    said = "a\x1b[31m\nFORGED"
    archive = xr.Dataset(
        {"delta": ("design", [0.1, 0.2], {"long_name": said, "units": said, "symbol": said})},
        {"case": ("design", ["x\x1b[31mred", "y"])},
        {"title": said, "scene": "{}", "engine": said, "engine_title": said},
    )
    path = tmp_path / "a.nc"
    archive.to_netcdf(path, engine="netcdf4")
    for command in (("info",), ("show",), ("best", "--least", "delta"), ("plot", "--list")):
        told = invoke(command[0], path, *command[1:])
        assert told.exit_code == 0, told.output
        lines = told.output.splitlines()
        assert all(line.isprintable() and not line.startswith("FORGED") for line in lines)
    archive.dyn.show()
    assert all(line.isprintable() for line in capsys.readouterr().out.splitlines())
    # matplotlib warns of letters that its font lacks, and would print them
    sweeps.figures.figures(archive)


@pytest.mark.parametrize("style", ["/dev/zero", ".", "a" * 300, "big", "drawn"])
def test_styles_that_are_none(style: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("big").write_bytes(b"#" * ((1 << 20) + 1))
    Path("drawn").write_text("lines.marker: nosuch\n")
    Path("a.nc").write_bytes(sound_archive())
    told = refused("plot", "a.nc", "-o", "figures", "--style", style)
    assert told.startswith("engine-dyn: style ")
    assert not Path("figures").exists() or not list(Path("figures").iterdir())


def test_styles_run_no_tex(tmp_path: Path) -> None:
    path = tmp_path / "tex.mplstyle"
    path.write_text("text.usetex: True\nfont.size: 9\n")
    assert sweeps.figures.options_of(style=path).style == {"font.size": 9.0}


def test_styles_of_a_workbook_do_not_fill_the_memory(tmp_path: Path) -> None:
    path, book = tmp_path / "a.xlsx", openpyxl.Workbook()
    for row in (["inertia"], [1.0], [2.0]):
        book.active.append(row)
    book.save(path)
    formats = "".join(f'<numFmt numFmtId="{200 + i}" formatCode="0.0"/>' for i in range(950_000))
    with zipfile.ZipFile(path) as sound:
        parts = {name: sound.read(name) for name in sound.namelist()}
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as changed:
        for name, data in parts.items():
            if name == "xl/styles.xml":
                head, mark, rest = data.partition(b"<fonts")
                data = head + b"<numFmts>" + formats.encode() + b"</numFmts>" + mark + rest
                assert len(data) > 40e6
            changed.writestr(name, data)
    assert path.stat().st_size < 4e6
    before = time.monotonic()
    with pytest.raises(SceneError, match=r"a.xlsx: not an \.xlsx file to be read: it takes more"):
        read_designs(path, "a.xlsx")
    assert time.monotonic() - before < 30.0


def test_rerun_reads_no_file_but_the_archive(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever names its scene has, they are looked up in the archive alone."""
    secret = tmp_path / "secret.csv"
    secret.write_text("speed_rpm,torque_Nm\n0,1\n9000,2\n")
    path = tmp_path / "a.nc"
    path.write_bytes(sound_archive())
    for table in ({"set": {"load_table": str(secret)}}, {"engine": str(tmp_path / "e.toml")},
                  {"designs": {"file": str(secret)}}, {"indicator": {"file": "/dev/zero"}},
                  {"reference": {"file": str(secret)}}):  # fmt: skip
        with netCDF4.Dataset(path, "r+") as file:
            file.scene = json.dumps({**SMALL, **table})
        read: list[str] = []
        with monkeypatch.context() as patch:
            patch.setattr(regular_files, "opened_file", lambda p, read=read: read.append(str(p)))
            refused("rerun", path, "-o", tmp_path / "out.nc")
        assert not read
    assert not (tmp_path / "out.nc").exists()


ELSEWHERE = ROOT / "tests" / "data" / "stored_elsewhere"
"""HDF5 files of one variable, `bore`, whose values are those of `secret.bin` or `secret.h5`; made
by h5py."""


@pytest.mark.parametrize("kind", ["external_storage", "external_link", "virtual", "in_a_group"])
def test_archives_and_tables_that_lead_to_other_files(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "secret.bin").write_bytes(b"1234")
    path = tmp_path / "a.nc"
    path.write_bytes((ELSEWHERE / f"{kind}.h5").read_bytes())
    for command in (["info"], ["rerun", "-o", "out.nc"], ["export", "-o", "out.csv"]):
        told = refused(command[0], path, *command[1:])
        assert "is stored outside the file" in told
    (tmp_path / "scene.toml").write_text(SCENE + '[designs]\nfile = "a.nc"\n')
    assert "is stored outside the file" in refused("plan", "scene.toml")


def test_archives_larger_than_memory_are_opened_but_not_their_axes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.nc"
    path.write_bytes(sound_archive())
    real = netcdf_files.psutil.virtual_memory()
    for free, taken in ((1500, True), (100, False)):
        monkeypatch.setattr(
            netcdf_files.psutil, "virtual_memory", lambda free=free: real._replace(available=free)
        )
        with sweeps.open_archive(path) as dataset:
            assert dataset.nbytes > 1500
        if taken:
            sweeps.open(path).close()
        else:
            with pytest.raises(SceneError, match=r"axes of .* need .* of memory"):
                sweeps.open(path)


def test_axes_longer_than_their_file_are_refused(tmp_path: Path) -> None:
    """Without a value, but `export` numbered the designs: 745 GiB."""
    path = tmp_path / "a.nc"
    path.write_bytes(sound_archive())
    with netCDF4.Dataset(path, "a") as file:
        file.createDimension("huge", 10**11)
        file.createDimension("none", 0)
        file.createVariable("bore", "f8", ("huge", "none"))
    for command in ("export", "info", "plot"):
        more = ("-o", tmp_path / "table.csv") if command == "export" else ()
        assert "damaged: 100000000000 points of huge in a file of" in refused(command, path, *more)


def test_a_block_that_somebody_else_signed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A right hash does not make it a block: kind, shape and names must be right too."""
    monkeypatch.setattr(limits, "LARGEST_BLOCK", 4e3)
    plan, output = make_plan(read_scene(tomllib.loads(PLAIN))), tmp_path / "out.nc"
    folder = Partial.of(output)
    good = interrupted_files()
    for arrays in ({"delta": np.zeros(3)}, {}, {"mean_piston_speed": np.zeros(3, "i1")}):
        folder.path.mkdir()
        for name, data in good.items():
            (folder.path / name).write_bytes(data)
        assert folder.header() is not None
        folder.write(1, arrays)
        done = into_archive.run(plan, output, Options(resume=True))
        assert done.before == len(good) - 2
        output.unlink()
    with pytest.raises(partial.Damaged, match="cannot be read"):
        folder.read(1)
