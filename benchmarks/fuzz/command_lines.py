"""Command lines of hostile words."""

from __future__ import annotations

from typing import Any

from hypothesis import strategies as st

from benchmarks.fuzz.archives import good_archive
from benchmarks.fuzz.changes import WORDS
from benchmarks.fuzz.checking import in_one_line, unchanged
from benchmarks.fuzz.sandbox import sandbox

__all__ = ["check_command_line", "command_lines"]


def command_lines() -> st.SearchStrategy[list[str]]:
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
        [
            st.tuples(*(st.just(w) if isinstance(w, str) else w for w in line)).map(list)
            for line in lines
        ]
    )


def check_command_line(arguments: list[str]) -> None:
    with unchanged(sandbox()):
        in_one_line(*arguments)
