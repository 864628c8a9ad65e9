"""Lists of the command line: names of one thing count alike, near spellings are told."""

import pytest
import xarray as xr

from engine_dyn.quantities.graph import DIMENSIONS, PARAMETERS
from sweeps.presenting.archives import archive_text
from sweeps.presenting.key_texts import WORDS_OF_KEYS, default_text, value_text
from sweeps.presenting.quantity_search import found_quantities
from sweeps.presenting.report.sections import assumed
from tests.support import commands


def listed(*words: str) -> list[str]:
    return commands.ok("list", *words).splitlines()


def names(*words: str) -> list[str]:
    return [line.split()[0] for line in listed(*words) if line and line[0] != "#"]


@pytest.mark.parametrize(
    "same",
    [
        ("gudgeon pin", "wrist pin", "piston pin", "piston-pin", "Gudgeon"),
        ("conrod", "con-rod", "connecting rod", "connecting-rod", "rods"),
        ("crank pin", "crankpin", "big end"),
        ("main journal", "main bearings"),
    ],
)
@pytest.mark.parametrize("of", ["quantities", "keys"])
def test_names_of_one_thing_find_the_same(of: str, same: tuple[str, ...]) -> None:
    first, *others = (names(of, *words.split()) for words in same)
    assert len(first) > 1
    assert all(other == first for other in others)


def test_keys_are_found_by_their_other_names() -> None:
    for key, words in WORDS_OF_KEYS.items():
        assert key in PARAMETERS
        for one in words.split(" (")[0].split(", "):
            assert key in names("keys", *one.split()), (key, one)
    assert names("keys", "gudgeon", "pin")[-2:] == ["piston_pin_diameter", "piston_pin_width"]


def test_a_near_spelling_is_told() -> None:
    first, *rest = listed("quantities", "gudegon", "pin")
    assert first.startswith("# nothing found for 'gudegon'; did you mean 'gudgeon'?")
    assert rest[1:] == listed("quantities", "gudgeon", "pin")
    assert listed("keys", "irregularty")[0].startswith("# nothing found for 'irregularty'")
    assert found_quantities("irregularity")[1] == ""


@pytest.mark.parametrize("name", ["torque_mean", "torque", "crank_angle", "gas_torque_rms"])
def test_an_exact_name_comes_first(name: str) -> None:
    assert names("quantities", name)[0] == name
    assert names("quantities", *name.split("_"))[0] == name


def test_axes_of_curves_are_found_and_not_listed_as_quantities() -> None:
    assert sorted(names("quantities", "axes", "of", "curves")) == sorted(DIMENSIONS)
    assert "0 at firing top dead centre" in "".join(listed("quantities", "crank", "angle")[:2])
    assert not set(names("quantities")) & set(DIMENSIONS)


def test_keys_print_names_and_defaults() -> None:
    lines = {line.split()[0]: line for line in listed("keys")}
    assert lines["friction_law"].endswith(
        "one of chen_flynn, patton_nitschke_heywood; default chen_flynn"
    )
    assert "one of ohv, sohc_finger_follower" in lines["valve_train"]
    assert lines["flywheel_density"].endswith("or a name: cast iron, steel")
    assert lines["wanted_delta"].endswith("or a name such as pump")
    assert lines["gear_ratio"].endswith("; default 1")
    assert default_text(PARAMETERS["passes"]) == ""  # 0, outside the range: there is none
    assert value_text(PARAMETERS["valve_train"], 7.0) == "dohc_roller_finger_follower"
    assert value_text(PARAMETERS["flywheel_density"], 7850.0) == "7850"


@pytest.mark.parametrize(
    ("word", "said"), [("quantity", "did you mean 'quantities'"), ("units", "quantities and keys")]
)
def test_an_unknown_list_is_refused_in_one_line(word: str, said: str) -> None:
    assert said in commands.refused("list", word)


def test_words_of_values_are_shown() -> None:
    assert "valve_train = dohc_roller_finger_follower " in commands.ok("info", "si_four_87x101")
    node = xr.Dataset(attrs={"parameters": '{"valve_train": 7.0, "bore": 0.08}', "history": "now"})
    lines = archive_text(node, __file__, provenance=True).splitlines()
    assert "    valve_train: dohc_roller_finger_follower (7)" in lines
    assert "    bore: 0.08" in lines
    assert "dohc_roller_finger_follower (7)" in assumed(node, {})
