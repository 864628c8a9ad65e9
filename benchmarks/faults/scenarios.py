"""What is run with faults: a new run, one that goes on, one that replaces, and so on."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

SCENE = Path(__file__).with_name("scene.toml").read_text(encoding="utf-8")

OTHER = SCENE.replace("9.0", "8.0")
"""The text of other.toml."""

LITTLE = SCENE.replace("num = 100", "num = 3")

Command = tuple[str, ...]


class Scenario(NamedTuple):
    """One command, and what is there before it."""

    scene: str  # the text of scene.toml
    command: Command  # what is run with a fault
    again: Command  # what is run after that, to complete it
    output: str = "out.nc"
    before: tuple[Command, ...] = ()  # make what is there before
    cut: bool = False  # whether `command` was killed half way before: it is one that goes on
    afterwards: str = ""  # what `again` may say where everything was done already


RUN = ("run", "scene.toml", "--threads", "1", "-o", "out.nc")
FAR = (*RUN[:-1], "of/today/out.nc")
EXTEND = ("extend", "out.nc", "--axis", "speed=1100,1700", "--threads", "1")
MERGE = ("merge", "1.nc", "2.nc", "-o", "out.nc")
SHARDS = tuple((*RUN[:-1], f"{i}.nc", "--shard", f"{i}/2") for i in (1, 2))
REPLACE = (*RUN, "--overwrite")
BEFORE = ("run", "other.toml", *RUN[2:])

SCENARIOS = {
    "a new run": Scenario(SCENE, FAR, (*FAR, "--resume"), "of/today/out.nc"),
    "a run that goes on": Scenario(SCENE, (*RUN, "--resume"), (*RUN, "--resume"), cut=True),
    "a run that replaces": Scenario(SCENE, REPLACE, (*REPLACE, "--resume"), before=(BEFORE,)),
    "a run of one block": Scenario(LITTLE, RUN, (*RUN, "--resume")),
    "extend": Scenario(
        LITTLE, EXTEND, EXTEND, before=(RUN,), afterwards="is already on the axis"
    ),
    "merge": Scenario(LITTLE, MERGE, (*MERGE, "--overwrite"), before=SHARDS),
}  # fmt: skip
