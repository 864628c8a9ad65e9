"""What the fuzzer does: for each target, how its input is drawn, and what is done with it.

Each reads the input as the program does, by the functions of `hostile` that check the three rules.
"""

from __future__ import annotations

import datetime
import hashlib
import io
import json
import os
import shutil
import tomllib
import zipfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from hypothesis import strategies as st

import sweeps
from benchmarks.fuzz.hostile import (
    WORDS,
    as_json,
    changed,
    cut_up,
    engines,
    in_one_line,
    read_hostile,
    refused_or_taken,
    sandbox,
    scenes,
    unchanged,
)
from benchmarks.fuzz.sound import (
    PLAIN,
    attributes_of_archive,
    good_archive,
    good_files,
    good_partial,
    good_texts,
)
from benchmarks.tables import toml_text
from sweeps.base.columns.options import ImportOptions
from sweeps.decide.explore import opening
from sweeps.lab.pressure.reading import read_pressure
from sweeps.running.archive.contents import part_of, plan_of, read_contents
from sweeps.running.archive.partial import Partial
from sweeps.running.compute import into_archive
from sweeps.running.compute.options import Options, Stopped
from sweeps.scene.design_files.design_files import read_designs
from sweeps.scene.engine.engine_files import load_engine
from sweeps.scene.plan.forecast import text
from sweeps.scene.plan.plan import make_plan
from sweeps.scene.reading import read_scene
from sweeps.view.texts.scenes import engine_text

Drawn = st.SearchStrategy[Any]


# Scenes, engine files and the CSV files that scenes name ------------------------------------------


def written(tree: Any) -> bytes:
    """A tree as a file of TOML."""
    return toml_text(tree).encode("utf-8", "replace")


def texts(files: dict[str, bytes]) -> Drawn:
    """Files of TOML with members or bytes changed."""
    trees = [tomllib.loads(data.decode()) for data in files.values()]
    members = st.sampled_from(trees).flatmap(changed).map(written)
    return members | st.sampled_from(list(files.values())).flatmap(cut_up)


def plan(scene: Any) -> str:
    """What `engine-dyn plan` says of a scene."""
    return text(make_plan(read_scene(scene)))


def check_scene(data: bytes) -> None:
    """A scene is planned."""
    read_hostile("mutated.toml", data, plan)


def check_engine(data: bytes) -> None:
    """An engine is described, and a scene of it planned."""
    if read_hostile("mutated.toml", data, lambda path: engine_text(load_engine(path))):
        engine = str(sandbox() / "scenes" / "mutated.toml")
        scene = {"engine": engine, "output": {"quantities": ["delta", "imep"]}}
        refused_or_taken(lambda: plan(scene))


def csv_files(measured: bool) -> Drawn:
    """A file, or what a scene says of it, changed; of recorded speeds, or all else."""

    def of(kind: str) -> Drawn:
        data, tables = good_texts()[kind]
        # Hypothesis draws the same strategy once only, however often it is given.
        of_data = [st.tuples(st.just(tables), cut_up(data)) for _ in range(3)]
        return st.one_of(*of_data, st.tuples(changed(tables), st.just(data)))

    return st.sampled_from([k for k, (_, t) in good_texts().items() if measured == ("measured" in t)
                            ]).flatmap(of)  # fmt: skip


def check_csv_file(example: tuple[dict[str, Any], bytes], read: Callable[[Any], Any]) -> None:
    """A scene that names it is read."""
    tables, data = example
    scene = {"engine": "ntua", "output": {"quantities": ["delta"]}, **tables}
    (sandbox() / "scenes" / "mutated.csv").write_bytes(data)
    read_hostile("mutated.toml", written(scene), read)


# Tables of designs in netCDF and Parquet ----------------------------------------------------------

KEYS = ["bore", "stroke", "case", "design", "speed", "Bore", "delta", "x", "passes"]

ATTRIBUTES: Drawn = st.tuples(
    st.sampled_from(
        ["units", "scale_factor", "add_offset", "valid_range", "missing_value", "coordinates",
         "long_name", "description", "symbol", "comment", "calendar", "flag_values",
         "flag_meanings", "dtype", "_Unsigned", "bounds", "grid_mapping", "valid_max"]
    ),
    st.one_of(
        st.sampled_from(["m", "rpm", "", "days since 0001-01-01", "$\\frac{$", "x\x1b[2J", "true"]),
        st.floats(), st.integers(-5, 5), st.lists(st.floats(), min_size=1, max_size=3),
    ),
)  # fmt: skip

VARIABLES: Drawn = st.lists(
    st.tuples(
        st.sampled_from(KEYS),
        st.sampled_from(["f8", "f4", "i4", "i8", "u1", "S1", "str", "compound", "vlen", "enum",
                         "opaque"]),
        st.lists(st.sampled_from(["design", "n", "huge", "none"]), max_size=2, unique=True),
        st.sampled_from([None, 1, 10**3, 10**9]),
        st.lists(ATTRIBUTES, max_size=2),
    ),
    min_size=1, max_size=4, unique_by=lambda v: v[0],
)  # fmt: skip

REFUSED = (AttributeError, RuntimeError, TypeError, OSError, ValueError, LookupError)
"""What the library raises for what it does not write."""


def add_variables(file: Any, variables: list[Any]) -> None:
    """Define hostile variables in a netCDF file; what the library refuses is left out."""
    for name, size in (("n", 3), ("huge", 10**11), ("none", 0), ("design", 3)):
        if name not in file.dimensions:
            file.createDimension(name, size)
    types: dict[str, Any] = {
        "compound": lambda: file.createCompoundType(np.dtype([("a", "f8")]), "pair"),
        "vlen": lambda: file.createVLType("f8", "ragged"),
        "enum": lambda: file.createEnumType("i1", "state", {"a": 0, "b": 1}),
        "opaque": lambda: file.createVLType("i1", "bytes"),
    }
    for name, kind, dims, chunk, attributes in variables:
        if name in file.variables:
            continue
        with suppress(*REFUSED):
            found = str if kind == "str" else types[kind]() if kind in types else kind
            lengths = [file.dimensions[d].size for d in dims]
            sizes = [min(chunk or 1000, max(n, 1)) for n in lengths]
            more = {"chunksizes": sizes, "zlib": kind != "str"} if dims else {}
            made = file.createVariable(name, found, tuple(dims), **more)
            for attribute, value in attributes:
                with suppress(*REFUSED):
                    made.setncattr(attribute, value)
            if "huge" not in dims and kind in ("f8", "f4", "i4", "i8", "u1"):
                made[...] = np.arange(1, 1 + int(np.prod(lengths))).reshape(lengths)


def parquet_columns() -> dict[str, Any]:
    """Two values of every kind."""
    return {
        "double": pa.array([0.1, 0.2]), "int64": pa.array([1, 2]), "string": pa.array(["a", None]),
        "list": pa.array([[1.0], [2.0]]), "struct": pa.array([{"a": 1.0}, {"a": 2.0}]),
        "timestamp": pa.array([datetime.datetime(2026, 1, 1)] * 2), "bool": pa.array([True, False]),
        "decimal": pa.array([1, 2]).cast(pa.decimal128(20)), "binary": pa.array([b"\xff", b"a"]),
        "null": pa.nulls(2), "dictionary": pa.array(["a", "b"]).dictionary_encode(),
        "float16": pa.array(np.array([0.1, 0.2], dtype=np.float16)),
        "uint64": pa.array([2**64 - 1, 1], pa.uint64()),
        "map": pa.array([[("a", 1)], []], pa.map_(pa.string(), pa.int64())),
    }  # fmt: skip


def write_parquet(path: Path, columns: list[tuple[str, str, Any]]) -> None:
    """Write columns: names, kinds, and units, or what pandas would note of the table."""
    values = parquet_columns()
    fields = [
        pa.field(n, values[k].type, metadata={"units": m} if m else None) for n, k, m in columns
    ]
    about = next((m for _, _, m in columns if m and m[:1] in b"{["), None)
    schema = pa.schema(fields, metadata={"pandas": about} if about else None)
    pq.write_table(pa.Table.from_arrays([values[k] for _, k, _ in columns], schema=schema), path)


def binary_tables() -> Drawn:
    """Suffix, and hostile variables, columns or bytes."""
    units = st.sampled_from([None, b"m", b"furlong", b"\xff\xfe", b'{"index_columns": 3}', b"["])
    column = st.tuples(st.sampled_from(KEYS), st.sampled_from(sorted(parquet_columns())), units)
    return st.one_of(
        st.tuples(st.just(".nc"), VARIABLES),
        st.tuples(st.just(".parquet"), st.lists(column, min_size=1, max_size=3)),
        *(st.tuples(st.just(s), cut_up(good_files()[f"table{s}"])) for s in (".nc", ".parquet")),
    )


def check_binary_table(example: tuple[str, Any]) -> None:
    """It is read as a table of designs."""
    suffix, content = example
    if not isinstance(content, bytes):
        path = sandbox() / f"written{suffix}"
        if suffix == ".nc":
            with netCDF4.Dataset(path, "w") as file:
                add_variables(file, content)
        else:
            write_parquet(path, content)
        content = path.read_bytes()
        path.unlink()
    read_hostile(f"mutated{suffix}", content, lambda path: read_designs(path, "mutated"))


# Recordings of laboratories -----------------------------------------------------------------------

OPTIONS: Drawn = st.one_of(
    st.sampled_from(
        ["p", "CA", "1", "9**9**9", "kPa", "V", "rev", "\x1b[2J", "", "BDC", "inlet", "compression",
         "low_pass", "savitzky_golay", "cycles", "gas exchange", "backward", ";", "tab", ",", True]
    ),
    st.integers(-3, 1000), st.floats(-720.0, 720.0), st.floats(),
    st.lists(st.floats(-10.0, 400.0), max_size=3), st.just(["CA", "p"]),
)  # fmt: skip


@st.composite
def parts_changed(draw: st.DrawFn, data: bytes) -> bytes:
    """An .xlsx file in which one of the texts is changed, so that it can still be unpacked."""
    made = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as old, zipfile.ZipFile(made, "w") as new:
        chosen = draw(st.sampled_from(old.namelist()))
        for name in old.namelist():
            part = old.read(name)
            new.writestr(name, draw(cut_up(part)) if name == chosen else part)
    return made.getvalue()


def recordings() -> Drawn:
    """Suffix, bytes and options."""
    keys = st.sampled_from(sorted(ImportOptions.model_fields))
    options: Drawn = st.just({}) | st.dictionaries(keys, OPTIONS, max_size=2)

    def of(name: str) -> Drawn:
        data = good_files()[name]
        kinds = [st.just(data), cut_up(data)] + [parts_changed(data)] * name.endswith(".xlsx")
        return st.tuples(st.just(Path(name).suffix), st.one_of(kinds), options)

    return st.sampled_from([n for n in good_files() if n.startswith("good")]).flatmap(of)


def check_recording(example: tuple[str, bytes, dict[str, Any]]) -> None:
    """It is read as a recorded pressure."""
    suffix, data, options = example
    read_hostile(f"recording{suffix}", data, lambda path: read_pressure(path, **options).text())


# Archives -----------------------------------------------------------------------------------------


def _json_or_text(value: Any) -> Drawn:
    """An attribute changed: its JSON, where it is some, its text, its type."""
    others: list[Drawn] = [
        st.sampled_from(["", "{}", "[]", "null", "[" * 100_000, '{"a":' * 5000, "NaN", "1e999"]),
        st.floats(), st.integers(-9, 9), st.lists(st.floats(), min_size=1, max_size=3),
    ]  # fmt: skip
    if isinstance(value, str):
        cut = cut_up(value.encode("utf-8", "replace"))
        others.append(cut.map(lambda data: data.decode("utf-8", "replace").replace("\0", "")))
        with suppress(ValueError):
            tree = json.loads(value)
            if isinstance(tree, dict):
                others += [changed(tree).map(as_json)] * 4
    return st.one_of(others)


def archives() -> Drawn:
    """What is changed of an archive, and how."""

    def attributes(part: bool) -> Drawn:
        known = attributes_of_archive(part)
        likely = [n for n in ("scene", "identity", "input_files", "part") if n in known] * 4
        one = st.sampled_from([*known, *likely]).flatmap(
            lambda n: st.tuples(st.just(n), st.none() | _json_or_text(known[n]))
        )
        return st.tuples(st.just(part), st.lists(one, min_size=1, max_size=2))

    of_variable = st.lists(
        st.tuples(
            st.sampled_from(["delta", "speed", "method_name", "status", "omega", "crank_angle"]),
            ATTRIBUTES | st.tuples(st.just("rename"), st.sampled_from(KEYS)),
        ),
        max_size=3,
    )
    return st.one_of(
        *(st.tuples(st.just("attributes"), st.booleans().flatmap(attributes)) for _ in range(2)),
        st.tuples(st.just("variables"), st.tuples(VARIABLES, of_variable)),
        st.tuples(st.just("bytes"), cut_up(good_archive())),
    )


def write_archive(path: Path, example: tuple[str, Any]) -> None:
    """Write what `archives` has drawn."""
    kind, content = example
    path.unlink(missing_ok=True)
    if kind == "bytes":
        path.write_bytes(content)
        return
    path.write_bytes(good_archive(content[0] if kind == "attributes" else False))
    with netCDF4.Dataset(path, "r+") as file:
        if kind == "attributes":
            for name, value in content[1]:
                with suppress(*REFUSED):
                    file.delncattr(name)
                    if value is not None:
                        file.setncattr(name, value)
            return
        add_variables(file, content[0])
        for name, (attribute, value) in content[1]:
            with suppress(*REFUSED):
                if attribute != "rename":
                    file[name].setncattr(attribute, value)
                # The library cannot close a file with a variable named as a dimension.
                elif value not in file.dimensions:
                    file.renameVariable(name, value)


def check_archive(example: tuple[str, Any]) -> None:
    """Whatever reads archives, but figures: they take long."""
    home = sandbox()
    path, other = home / "scenes" / "mutated.nc", home / "scenes" / "other.nc"
    write_archive(path, example)
    other.write_bytes(good_archive())
    with unchanged(home):
        refused_or_taken(lambda: part_of(old := read_contents(path), plan_of(old)))
        refused_or_taken(lambda: opening.open([other, path]).close())
    table, merged = home / "out" / "table.csv", home / "out" / "merged.nc"
    for arguments in (
        ("info", path), ("show", path), ("compare", path, other), ("compare", other, path),
        ("export", path, "-o", table, "--overwrite"),
        ("merge", path, other, "-o", merged, "--overwrite"),
    ):  # fmt: skip
        in_one_line(*arguments)


def check_figures(example: tuple[str, Any]) -> None:
    """It is drawn."""
    home = sandbox()
    path = home / "scenes" / "mutated.nc"
    write_archive(path, example)
    with unchanged(home / "scenes", home / "outside"):
        in_one_line("plot", path, "-o", home / "out" / "figures", "--format", "svg")


# Folders of interrupted runs ----------------------------------------------------------------------


def partials() -> Drawn:
    """A file of the folder, and its new bytes or what it becomes."""
    files = good_partial()
    header = json.loads(files["run.json"])
    blocks = [n for n in files if n != "run.json"]
    return st.one_of(
        changed(header).map(lambda tree: ("run.json", as_json(tree).encode())),
        cut_up(files["run.json"]).map(lambda data: ("run.json", data)),
        st.sampled_from(blocks).flatmap(
            lambda n: st.tuples(st.just(n), cut_up(files[n]).map(_with_right_hash))
        ),
        st.tuples(
            st.sampled_from([*files, "archive.nc", "lock", "run.json.new", "block-000004.bin.new"]),
            st.sampled_from(["link", "loop", "pipe", "folder"]),
        ),
    )


def _with_right_hash(data: bytes) -> bytes:
    """A damaged block that somebody signed."""
    first, _, rest = data.partition(b"\n")
    return first[: first.rfind(b" ") + 1] + hashlib.sha256(rest).hexdigest().encode() + b"\n" + rest


def check_partial(example: tuple[str, Any]) -> None:
    """It is told of, and the run goes on."""
    home = sandbox()
    output = home / "out" / "interrupted.nc"
    folder = Partial.of(output).path
    # A folder that an example has made of a file, too; links are not followed.
    shutil.rmtree(folder, ignore_errors=True)
    output.unlink(missing_ok=True)
    folder.mkdir()
    for name, data in good_partial().items():
        (folder / name).write_bytes(data)
    name, content = example
    place = folder / name
    place.unlink(missing_ok=True)
    if isinstance(content, bytes):
        place.write_bytes(content)
    elif content == "pipe":
        os.mkfifo(place)
    elif content == "folder":
        place.mkdir()
    else:
        place.symlink_to(home / "outside" / "precious.txt" if content == "link" else name)
    with unchanged(home / "outside", home / "scenes"):
        in_one_line("info", folder)
        plan = make_plan(read_scene(PLAIN))
        try:
            taken = refused_or_taken(lambda: into_archive.run(plan, output, Options(resume=True)))
        except (Stopped, OSError) as error:
            # A folder or a link in a circle where a file must be: the command words it.
            assert content in ("folder", "loop", "pipe", "link"), error
            taken = False
    # Blocks with other numbers and the right hash were written by somebody who may.
    if taken and not (isinstance(content, bytes) and name.startswith("block")):
        with netCDF4.Dataset(output) as file:
            values = file["mean_piston_speed"][...]
        speed, stroke = np.linspace(1000, 2000, 40), np.linspace(0.1, 0.2, 40)
        np.testing.assert_allclose(values, np.multiply.outer(speed, stroke) / 30.0, rtol=1e-12)


# Command lines ------------------------------------------------------------------------------------


def command_lines() -> Drawn:
    """Commands with hostile words."""
    home = sandbox()
    folder = home / "scenes"
    (folder / "good.nc").write_bytes(good_archive())
    here = [name for name in (*WORDS, "good.nc", "n" * 300) if "/" not in name]
    paths = [str(folder / name) for name in (*here, "d/" * 3000)]
    word = st.sampled_from([*paths, *WORDS]).map(lambda w: w.replace("\0", "")) | st.text(
        max_size=12
    ).map(lambda w: w.replace("\0", "").encode("utf-8", "replace").decode())
    # No run starts: nothing here is both a sound scene and a place to write.
    output = st.sampled_from(
        [str(home / "outside" / "precious.txt" / "out.nc"), str(folder), "/dev/null", "/dev/full",
         str(folder / "fifo"), str(folder / "loop.csv"), str(folder / ("n" * 300)),
         str(folder / ("d/" * 3000) / "out.nc"), str(folder / "good.nc"), ""]
    )  # fmt: skip
    good = str(folder / "good.nc")
    run = ("run", "first", "-o", output)
    axis = (word | word.map(lambda w: f"inertia={w}")).filter(
        lambda w: not any(c.isdigit() for c in w)
    )
    lines: list[tuple[Any, ...]] = [
        ("info", word), ("plan", word), ("run", word, "-o", output), run,
        ("export", good, "-o", output | word, "--quantities", word),
        ("extend", good, "--axis", axis),
        ("plot", good, "-o", output, "--select", word | word.map(lambda w: f"speed={w}")),
        ("compare", good, word, "--tolerance", word), ("merge", word, good, "-o", output),
        ("rerun", word, "-o", output), (*run, "--overwrite", "--shard", word),
        (*run, "--memory", word), ("new", output),
    ]  # fmt: skip
    return st.one_of(
        [st.tuples(*(st.just(w) if isinstance(w, str) else w for w in line)) for line in lines]
    )


def check_command_line(arguments: tuple[str, ...]) -> None:
    """It is run."""
    with unchanged(sandbox()):
        in_one_line(*arguments)


TARGETS: dict[str, tuple[Callable[[], Drawn], Callable[[Any], None]]] = {
    "scene": (lambda: texts(scenes()), check_scene),
    "engine": (lambda: texts(engines()), check_engine),
    "table": (lambda: csv_files(False), lambda example: check_csv_file(example, plan)),
    "measured speed": (
        lambda: csv_files(True), lambda example: check_csv_file(example, sweeps.measured)
    ),
    "binary table": (binary_tables, check_binary_table),
    "recording": (recordings, check_recording),
    "archive": (archives, check_archive),
    "figures": (archives, check_figures),
    "partial": (partials, check_partial),
    "command line": (command_lines, check_command_line),
}  # fmt: skip
