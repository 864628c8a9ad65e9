"""What is run with faults: a new run, one that goes on, one that replaces, and so on."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["SCENARIOS", "SCENE", "Scenario"]

SCENE = """\
title = "A small map"
engine = "ntua"

[axes]
crank_ratio = [0.2, 0.25, 0.3]
speed = [1000, 1200, 1500, 1600]
inertia = { start = 1.5, stop = 9.0, num = 100 }

[output]
quantities = ["delta", "omega_mean", "imep"]
"""

OTHER = SCENE.replace("9.0", "8.0")

LITTLE = SCENE.replace("num = 100", "num = 3")

RUN = ("run", "scene.toml", "--threads", "1")


@dataclass(frozen=True)
class Scenario:
    """One command, and what is there before it.

    Attributes
    ----------
    name : str
        As it is listed.
    scene : str
        The text of scene.toml.
    command : tuple of str
        What is run with a fault.
    again : tuple of str
        What is run after that, to complete it.
    output : str
        The archive.
    before : tuple of tuple of str
        Commands that make what is there before.
    cut : bool
        Whether the first run of `command` is killed half way before: it is one that goes on.
    afterwards : str
        What `again` may say where everything was done already, instead of succeeding.
    """

    name: str
    scene: str
    command: tuple[str, ...]
    again: tuple[str, ...]
    output: str = "out.nc"
    before: tuple[tuple[str, ...], ...] = ()
    cut: bool = False
    afterwards: str = ""


def _of_shards() -> tuple[tuple[str, ...], ...]:
    return tuple((*RUN, "--shard", f"{i}/2", "-o", f"{i}.nc") for i in (1, 2))


SCENARIOS = {
    scenario.name: scenario
    for scenario in (
        Scenario(
            "a new run", SCENE, (*RUN, "-o", "of/today/out.nc"),
            (*RUN, "-o", "of/today/out.nc", "--resume"), "of/today/out.nc",
        ),
        Scenario(
            "a run that goes on", SCENE, (*RUN, "-o", "out.nc", "--resume"),
            (*RUN, "-o", "out.nc", "--resume"), cut=True,
        ),
        Scenario(
            "a run that replaces", SCENE, (*RUN, "-o", "out.nc", "--overwrite"),
            (*RUN, "-o", "out.nc", "--overwrite", "--resume"),
            before=(("run", "other.toml", "-o", "out.nc", "--threads", "1"),),
        ),
        Scenario(
            "a run of one block", LITTLE, (*RUN, "-o", "out.nc"),
            (*RUN, "-o", "out.nc", "--resume"),
        ),
        Scenario(
            "extend", LITTLE, ("extend", "out.nc", "--axis", "speed=1100,1700", "--threads", "1"),
            ("extend", "out.nc", "--axis", "speed=1100,1700", "--threads", "1"),
            before=((*RUN, "-o", "out.nc"),), afterwards="is already on the axis",
        ),
        Scenario(
            "merge", LITTLE, ("merge", "1.nc", "2.nc", "-o", "out.nc"),
            ("merge", "1.nc", "2.nc", "-o", "out.nc", "--overwrite"), before=_of_shards(),
        ),
    )
}  # fmt: skip
