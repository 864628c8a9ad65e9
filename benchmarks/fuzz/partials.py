"""Folders of interrupted runs with members, bytes or whole files changed."""

from __future__ import annotations

import hashlib
import itertools
import json
import os
import shutil
from contextlib import suppress
from functools import cache
from typing import Any
from unittest import mock

import netCDF4
import numpy as np
from hypothesis import strategies as st

from benchmarks.fuzz.changes import as_json, changed, cut_up
from benchmarks.fuzz.checking import in_one_line, refused_or_taken, unchanged
from benchmarks.fuzz.sandbox import names, sandbox
from sweeps.archive.partial import Partial
from sweeps.planning.plan import make_plan
from sweeps.running import into_archive, limits
from sweeps.running.options import Options, Stopped
from sweeps.scene.reading import read_scene

__all__ = ["check_partial", "partials"]

PLAIN = {
    "engine": "diesel_105x137",
    "axes": {
        "speed": {"start": 1000, "stop": 2000, "num": 40},
        "stroke": {"start": 0.1, "stop": 0.2, "num": 40},
    },
    "output": {"quantities": ["mean_piston_speed"]},
}


@cache
def good_partial() -> dict[str, bytes]:
    """Files of an interrupted run that needs no compiled kernel."""
    output = sandbox() / "out" / "interrupted.nc"
    write, numbers = Partial.write, itertools.count()

    def until(self: Partial, *arguments: Any) -> int:
        if next(numbers) == 3:
            raise KeyboardInterrupt
        return write(self, *arguments)

    with (
        mock.patch.object(limits, "LARGEST_BLOCK", 4e3),
        mock.patch.object(Partial, "write", until),
        suppress(Stopped),
    ):
        into_archive.run(make_plan(read_scene(PLAIN)), output, Options())
    folder = Partial.of(output)
    found = {p.name: p.read_bytes() for p in folder.path.iterdir() if p.name != "lock"}
    folder.remove()
    return found


def partials() -> st.SearchStrategy[Any]:
    files = good_partial()
    header = json.loads(files["run.json"])
    blocks = [n for n in files if n != "run.json"]
    return st.one_of(
        changed(header, names()).map(lambda tree: ("run.json", as_json(tree).encode())),
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
    if isinstance(content, bytes):
        (folder / name).write_bytes(content)
    else:
        (folder / name).unlink(missing_ok=True)
        if content == "pipe":
            os.mkfifo(folder / name)
        elif content == "folder":
            (folder / name).mkdir()
        else:
            (folder / name).symlink_to(
                home / "outside" / "precious.txt" if content == "link" else name
            )
    with unchanged(home / "outside", home / "scenes"):
        in_one_line("info", folder)
        plan = make_plan(read_scene(PLAIN))
        try:
            taken = refused_or_taken(lambda: into_archive.run(plan, output, Options(resume=True)))
        except (Stopped, OSError) as error:
            # A folder or a link in a circle where a file must be: the command words it.
            assert content in ("folder", "loop", "pipe", "link"), error
            taken = False
    if taken:
        with netCDF4.Dataset(output) as file:
            values = file["mean_piston_speed"][...]
        speed, stroke = np.linspace(1000, 2000, 40), np.linspace(0.1, 0.2, 40)
        expected = np.multiply.outer(speed, stroke) / 30.0
        # Blocks with other numbers and the right hash were written by somebody who may.
        if not (isinstance(content, bytes) and name.startswith("block")):
            np.testing.assert_allclose(values, expected, rtol=1e-12)
