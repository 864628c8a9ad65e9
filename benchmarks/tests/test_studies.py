"""Kinds of study: no code of Python runs once per design, and their measurement works."""

from __future__ import annotations

import sys
from types import FrameType
from typing import Any

import pytest

import sweeps
from benchmarks.studies import STUDIES, Study, study

FEW, MANY = 3000, 30_000
"""Numbers of designs between which calls are compared. Few are so many that they need nearly every
row of a family of diagrams."""

ALLOWED = 0.1
"""Calls of Python that a further design may bring, because a few more rows are needed."""

OF_TABLES = ("build_panel",)
"""Kernels that are called once for each table that designs share. Tables are limited in number by
the rows of a family and the intervals of crank ratios, but by thousands."""

solved = pytest.mark.parametrize(
    "one", [one for one in STUDIES if not one.modelled], ids=lambda one: one.name
)
"""Every kind of study but modelled cycles, which are made one by one."""


def calls_of_python(scene: dict[str, Any]) -> int:
    """Functions of Python that are called while a scene is computed in this thread."""
    count = 0

    def note(frame: FrameType, event: str, _: object) -> None:
        nonlocal count
        if event == "call" and frame.f_code.co_name not in OF_TABLES:
            count += 1

    before = sys.getprofile()
    sys.setprofile(note)
    try:
        sweeps.run(scene, threads=1)
    finally:
        sys.setprofile(before)
    return count


@pytest.mark.compiled
@pytest.mark.slow
@solved
def test_calls_of_python_do_not_grow_with_the_number_of_designs(one: Study) -> None:
    scenes = [one.build(size) for size in (FEW, MANY)]
    designs = [sweeps.run(scene, threads=1)["delta"].size for scene in scenes]
    few, many = (calls_of_python(scene) for scene in scenes)
    assert many - few <= ALLOWED * (designs[1] - designs[0]), (few, many)


def test_a_study_is_known_by_its_name() -> None:
    assert study("sampled").name == "sampled"
    with pytest.raises(ValueError, match="no study; there are one_table, "):
        study("unknown")
