"""Scenes with a table [measured] whose members are changed, and recordings with bytes changed."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from hypothesis import strategies as st

import sweeps
from benchmarks.fuzz.changes import changed, cut_up
from benchmarks.fuzz.checking import refused_or_taken, unchanged
from benchmarks.fuzz.sandbox import names, sandbox
from benchmarks.tables import toml_text

__all__ = ["check_measured_speed", "measured_speeds"]

TEETH = 11
"""Of a wheel 12-1: few, so that a change more often hits what matters."""

CYCLES, SAMPLES = 3, 1600


@cache
def _recordings() -> dict[str, bytes]:
    """A sound recording of each kind: three cycles at 1500 rpm, slower around firing."""
    angle = np.arange(-360.0, 360.0 * (2 * CYCLES - 1) + 1.0, 5.0)
    speed = 1500.0 - 40.0 * np.cos(np.deg2rad(0.5 * angle))
    time = np.arange(2 * CYCLES * 12) * 0.04 / 12.0
    time = time[np.arange(time.size) % 12 != TEETH]
    sampled = np.linspace(0.0, 0.04 * 2 * CYCLES, SAMPLES)
    wave = np.sin(2.0 * np.pi * sampled / (0.04 / 12.0))
    signal = np.where(np.floor(sampled / (0.04 / 12.0)) % 12 == TEETH, -1.0, wave)
    return {
        "speed": _text("crank angle [deg],speed [rpm]", angle, speed),
        "teeth": _text("time [s]", time),
        "encoder": _text("time [s],signal [V]", sampled, signal),
    }


def _text(head: str, *columns: np.ndarray[Any, Any]) -> bytes:
    lines = (",".join(f"{value:.7g}" for value in row) for row in zip(*columns, strict=True))
    return "\n".join([head, *lines, ""]).encode()


def _scene(kind: str) -> dict[str, Any]:
    wheel = {} if kind == "speed" else {"wheel": "12-1", "gap_angle": 10.0}
    return {
        "engine": "ntua",
        "axes": {"load": [50, 90]},
        "output": {"quantities": ["delta"]},
        "measured": {
            "file": ["mutated.csv", "mutated.csv"],
            "kind": kind,
            "at": {"load": [50, 90]},
            **wheel,
        },
    }


def measured_speeds() -> st.SearchStrategy[tuple[dict[str, Any], bytes]]:
    """Scene and recording."""

    def of(kind: str) -> st.SearchStrategy[tuple[dict[str, Any], bytes]]:
        scene, data = _scene(kind), _recordings()[kind]
        table = changed(scene["measured"], names())
        hostile = table.map(lambda tree: {**scene, "measured": tree})
        return st.one_of(st.tuples(hostile, st.just(data)), st.tuples(st.just(scene), cut_up(data)))

    return st.sampled_from(sorted(_recordings())).flatmap(of)


def check_measured_speed(example: tuple[dict[str, Any], bytes]) -> None:
    scene, data = example
    folder = sandbox() / "scenes"
    (folder / "mutated.csv").write_bytes(data)
    path = folder / "mutated.toml"
    path.write_bytes(toml_text(scene).encode("utf-8", "replace"))
    with unchanged(sandbox()):
        refused_or_taken(lambda: sweeps.measured(path))
