"""Command lines of hostile words."""

from __future__ import annotations

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
    return st.one_of(
        st.tuples(st.sampled_from(["info", "plan"]), word).map(list),
        st.tuples(st.just("run"), word, st.just("-o"), output).map(list),
        st.tuples(st.just("run"), st.just("first"), st.just("-o"), output).map(list),
        st.tuples(st.just("export"), st.just(good), st.just("-o"), output | word,
                  st.just("--quantities"), word).map(list),
        st.tuples(st.just("extend"), st.just(good), st.just("--axis"),
                  word | word.map(lambda w: f"inertia={w}")).map(list).filter(
                      lambda words: not any(c.isdigit() for c in words[-1])),
        st.tuples(st.just("plot"), st.just(good), st.just("-o"), output, st.just("--select"),
                  word | word.map(lambda w: f"speed={w}")).map(list),
        st.tuples(st.just("compare"), st.just(good), word, st.just("--tolerance"), word).map(list),
        st.tuples(st.just("merge"), word, st.just(good), st.just("-o"), output).map(list),
        st.tuples(st.just("rerun"), word, st.just("-o"), output).map(list),
        st.tuples(st.just("run"), st.just("first"), st.just("-o"), output, st.just("--overwrite"),
                  st.just("--shard"), word).map(list),
        st.tuples(st.just("run"), st.just("first"), st.just("-o"), output, st.just("--memory"),
                  word).map(list),
        st.tuples(st.just("new"), output).map(list),
    )  # fmt: skip


def check_command_line(arguments: list[str]) -> None:
    with unchanged(sandbox()):
        in_one_line(*arguments)
