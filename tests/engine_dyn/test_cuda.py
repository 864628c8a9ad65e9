"""The batch solver on a card, run by numba's simulator, against the processor's."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from engine_dyn.card import card_of
from tests.support import card_designs

pytestmark = pytest.mark.compiled

CASES = sorted(card_designs.cases())
ROOT = Path(__file__).parents[2]
ABSOLUTE = {"delta_error": 1e-12}  # a difference of two numbers that nearly agree
ONE = {"wanted": ("delta",), **card_designs.designs(1)}


def python(*arguments: str, simulator: bool = True) -> str:
    """What a process says whose device is the simulator; warnings are errors."""
    more = {"NUMBA_ENABLE_CUDASIM": "1"} if simulator else {}
    done = subprocess.run(
        [sys.executable, "-W", "error", *arguments], cwd=ROOT, text=True, capture_output=True,
        check=False, env={**os.environ, "PYTHONPATH": str(ROOT), **more},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout + done.stderr


@pytest.fixture(scope="module")
def on_card(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    path = tmp_path_factory.mktemp("card") / "found.npz"
    python("-m", "tests.support.card_designs", str(path))
    return dict(np.load(path))


@pytest.fixture(scope="module")
def on_processor() -> dict[str, Any]:
    return card_designs.solutions("cpu")


@pytest.mark.parametrize("case", CASES)
def test_a_card_finds_what_the_processor_finds(
    case: str, on_card: dict[str, Any], on_processor: dict[str, Any]
) -> None:
    names = [name for name in on_processor if name.startswith(f"{case}/")]
    assert f"{case}/status" in names
    assert np.array_equal(on_card[f"{case}/status"], on_processor[f"{case}/status"])
    assert on_card[f"{case}/left"] == on_processor[f"{case}/left"]
    for name in names:
        absolute = ABSOLUTE.get(name.rpartition("/")[2], 0.0)
        np.testing.assert_allclose(
            on_card[name], on_processor[name], rtol=1e-12, atol=absolute, err_msg=name
        )


def test_all_kinds_were_solved_on_the_card(on_card: dict[str, Any]) -> None:
    """Else the comparison would be of the processor with itself."""
    sizes = {name: on_card[f"{name}/status"].size for name in CASES}
    assert on_card["sizes"].sum() == sum(sizes.values()) + sizes["error"]  # solved twice
    left = {name: int(on_card[f"{name}/left"]) for name in CASES}
    assert left.pop("failing") >= 5
    assert not any(left.values())
    assert np.unique(on_card["failing/status"]).size >= 3


def test_launches_of_other_sizes_give_the_same_bits(
    on_card: dict[str, Any], tmp_path: Path
) -> None:
    python(
        "-m",
        "tests.support.card_designs",
        str(tmp_path / "found.npz"),
        "7",
        "every exponent",
        "error",
    )
    found = dict(np.load(tmp_path / "found.npz"))
    assert found.pop("sizes").max() == 7 < on_card["sizes"].max()
    for name, array in found.items():
        assert array.tobytes() == on_card[name].tobytes(), name


REASONS = {
    "a variable inertia": {"inertia_model": "variable"},
    "closure 'cycle_time'": {"closure": "cycle_time"},
    "method 'newton'": {"method": "newton"},
    "curves over the crank angle": {"wanted": ("omega",), "crank_angle": [0.0, 1.0]},
}


def test_the_processor_solves_the_rest_and_says_so_once() -> None:
    script = """
import sys
from tests.support.card_designs import card_of, designs, dispatch, launched
sizes = launched()
for more in eval(sys.argv[1]):
    inputs = {"wanted": ("delta",), **designs(2), **more}
    found, *_ = [dispatch.solve(card=card_of("cuda"), **inputs) for _ in range(2)]
    right = dispatch.solve(**inputs)
    assert not sizes and all(right[n].tobytes() == found[n].tobytes() for n in right)
"""
    said = python("-c", script, repr([*REASONS.values()])).splitlines()
    assert [line for line in said if "device" in line] == [
        f"device 'cuda': {reason} is solved on the processor" for reason in REASONS
    ]


def test_a_call_that_needs_more_memory_than_there_is_goes_to_the_processor() -> None:
    script = """
from engine_dyn.card import card
from tests.support.card_designs import card_of, designs, dispatch, launched
card.PART_OF_MEMORY = 1e-7
inputs = {"wanted": ("delta",), **designs(2)}
found, right = (dispatch.solve(card=card_of(one), **inputs) for one in ("cuda", "cpu"))
assert all(right[n].tobytes() == found[n].tobytes() for n in right)
"""
    line = "device 'cuda': what needs more memory than the card has is solved on the processor"
    assert line in python("-c", script).splitlines()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("find_spec = lambda name: None", "needs numba-cuda, which is not installed: pip install "
         "'engine-dyn[gpu]'"),
        ("find_spec = lambda name: True; device.cuda.is_available = lambda: False",
         "no NVIDIA card with a working driver was found (see nvidia-smi)"),
        ("simulated = lambda: True; device.free_memory = lambda: 100_000_000",
         "0.10 GB of the card's memory are free, 0.26 GB are needed"),
    ],
)  # fmt: skip
def test_a_device_that_cannot_be_used_is_refused_in_one_line(change: str, message: str) -> None:
    script = f"""
from engine_dyn.card import device
device.{change}
from engine_dyn.card.card import check_card
try:
    check_card()
except ValueError as error:
    print(error)
"""
    assert python("-c", script, simulator=False).strip() == f"device 'cuda': {message}"


def test_an_unknown_device_is_refused() -> None:
    with pytest.raises(ValueError, match="device 'gpu': not one of 'cpu', 'cuda'"):
        card_of("gpu")
