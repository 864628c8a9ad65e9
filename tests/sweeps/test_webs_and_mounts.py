"""Scenes with counterweights on webs and with mounts of the block: agreement, axes, bad input."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import sweeps
from tests.support.scenes import asking, computed, refusal

pytestmark = pytest.mark.compiled

FOUR = "si_four_87x101"
SPACING = 0.12
TWO_MOUNTS = [{"lateral": -0.3}, {"lateral": 0.3}]


def on_webs(mass: float, radius: float, apart: float, angles: tuple[float, ...]) -> list[Any]:
    """Two counterweights of each throw, opposite its pin."""
    return [
        {"mass": mass, "radius": radius, "angle": angle - 180.0, "position": z * SPACING + side}
        for z, angle in enumerate(angles) for side in (-apart, apart)
    ]  # fmt: skip


def test_the_shaft_of_four_in_line_bends_although_it_is_balanced() -> None:
    """Eight counterweights take half or all of what turns; statics of one bay, by hand."""
    pins, speed, apart = (0.0, 180.0, 180.0, 0.0), 3000.0, 0.035
    values = sweeps.read_scene(asking(["imep"], engine=FOUR)).engine.values
    radius, crank_mass = 0.5 * values["stroke"], 1.2
    rod = radius / values["crank_ratio"]
    at_pin = crank_mass + values["rod_mass"] * (1.0 - values["rod_centre_of_gravity"] / rod)
    weight = 0.5 * at_pin * radius / 0.04
    found = computed(
        ["bay_bending_moment", "bay_bending_moment_max", "residual_rotating_force",
         "residual_rotating_moment", "shaking_moment_max", "shaking_force_major"], engine=FOUR,
        set={"cylinder_spacing": SPACING, "crank_mass": crank_mass, "speed": speed},
        axes={"counterweights_factor": [0.0, 0.5, 1.0]},
        counterweights=on_webs(weight, 0.04, apart, pins),
    )  # fmt: skip
    omega = speed * np.pi / 30.0
    force = at_pin * radius * omega**2
    half = 0.5 * SPACING
    for share, here in zip((0.0, 0.5, 1.0), found["bay_bending_moment_max"].values, strict=True):
        reaction = 0.5 * (1.0 - share) * force
        at_web = reaction * (half - apart)
        middle = reaction * half + 0.5 * share * force * apart
        assert here == pytest.approx(max(at_web, middle), rel=1e-12)
    assert found["bay_bending_moment"].dims == ("counterweights_factor", "bay")
    apart_from_largest = found["bay_bending_moment"] / found["bay_bending_moment_max"] - 1.0
    assert float(abs(apart_from_largest).max()) < 1e-12
    assert (np.diff(found["bay_bending_moment_max"]) < 0.0).all()
    for name in ("residual_rotating_force", "residual_rotating_moment", "shaking_moment_max"):
        assert (found[name] == 0.0).all()
    assert (found["shaking_force_major"].sel(order=1.0) == 0.0).all()


SAME = [
    "shaking_force", "shaking_moment", "shaking_force_max", "shaking_force_rms",
    "shaking_moment_max", "shaking_moment_rms", "shaking_force_major", "shaking_moment_minor",
    "counterweight_force", "gravity_torque", "gravity_torque_order", "main_journal_x",
    "main_journal_y", "main_journal_load_max", "main_journal_load_rms",
    "any_main_journal_load_max", "all_main_journals_load_rms", "best_fraction_rms",
    "best_fraction_peak", "residual_rotating_force", "residual_rotating_moment",
]  # fmt: skip


@pytest.mark.parametrize(
    ("more", "angles"),
    [
        ({"cylinders": 3}, (0.0, 240.0, 120.0)),
        ({"cylinders": 3, "pin_offset": 0.004}, (0.0, 240.0, 120.0)),
        ({"cylinders": 8, "arrangement": "V8 cross-plane"}, (0.0, 270.0, 90.0, 180.0)),
    ],
)  # fmt: skip
def test_pairs_of_webs_are_the_counterweight_of_a_throw(
    more: dict[str, Any], angles: tuple[float, ...]
) -> None:
    given = {"cylinder_spacing": SPACING, "crank_mass": 1.0, "speed": 2500.0, **more}
    if "arrangement" in more:
        made = sweeps.read_scene(asking(["imep"], engine=FOUR, set=given)).own_cylinders
        assert made is not None and made.arrangement is not None
        angles = tuple(np.degrees([throw.angle for throw in made.arrangement.throws]))
    output = {"angle_step": 15.0, "highest_order": 4}
    throws = computed(
        SAME, engine=FOUR, output=output,
        set={**given, "counterweight_mass": 1.4, "counterweight_radius": 0.045},
    )  # fmt: skip
    webs = computed(
        SAME, engine=FOUR, output=output, set=given,
        counterweights=on_webs(0.7, 0.045, 0.03, angles),
    )  # fmt: skip
    for name in SAME:
        size = float(np.abs(throws[name]).max())
        assert_allclose(webs[name], throws[name], rtol=1e-9, atol=1e-11 * size + 1e-6, err_msg=name)


def test_journals_bear_the_counterweights_by_the_lever_rule() -> None:
    webs = [{"mass": 2.0, "radius": 0.05, "angle": 70.0, "position": 0.2 * SPACING},
            {"mass": 1.5, "radius": 0.04, "angle": -20.0, "position": 3.9 * SPACING}]  # fmt: skip
    names = ["main_journal_x", "main_journal_y", "main_journal_load_max", "gravity_torque"]
    found = computed(
        [*names, "any_main_journal_load_max"], engine=FOUR, counterweights=webs,
        set={"cylinder_spacing": SPACING, "speed": 3000.0},
        axes={"counterweights_factor": [0.0, 1.0]}, output={"angle_step": 0.5},
    )  # fmt: skip
    phi, omega = np.radians(found["crank_angle"].values), 100.0 * np.pi
    one, other = (web["mass"] * web["radius"] * omega**2 for web in webs)
    expected = np.zeros((5, phi.size), dtype=complex)
    for j, (share, size, angle) in enumerate((
        (0.3, one, 70.0), (0.7, one, 70.0), (0.0, 0.0, 0.0), (-0.4, other, -20.0),
        (1.4, other, -20.0),
    )):  # fmt: skip
        expected[j] = share * size * np.exp(1j * (phi + np.radians(angle)))
    change = found.isel(counterweights_factor=1) - found.isel(counterweights_factor=0)
    limit = 1e-9 * one
    assert_allclose(change["main_journal_y"], expected.real, atol=limit)
    assert_allclose(change["main_journal_x"], expected.imag, atol=limit)
    gravity = sum(
        9.80665 * web["mass"] * web["radius"] * np.sin(phi + np.radians(web["angle"]))
        for web in webs
    )
    assert_allclose(change["gravity_torque"], gravity, atol=1e-9)
    sizes = np.hypot(found["main_journal_x"], found["main_journal_y"]).max("crank_angle")
    assert_allclose(found["main_journal_load_max"], sizes, rtol=2e-4)
    assert_array_equal(
        found["any_main_journal_load_max"], found["main_journal_load_max"].max("main_bearing")
    )


@pytest.mark.parametrize("offset", [0.0, 0.006])
def test_roll_moment_is_that_of_all_forces_on_the_block(offset: float) -> None:
    """Single cylinder: gas on the head and piston on the wall, about the axis of the crank."""
    found = computed(
        ["roll_moment", "torque", "friction_torque", "gas_force", "mount_force",
         "mount_force_max", "mount_force_min", "shaking_force"],
        set={"pin_offset": offset, "counterweight_mass": 0.0}, mounts=TWO_MOUNTS,
        output={"angle_step": 2.0},
    )  # fmt: skip
    phi = np.radians(found["crank_angle"].values)
    values = sweeps.read_scene(asking(["imep"])).engine.values
    radius = 0.5 * values["stroke"] if offset == 0.0 else None
    rod = 0.5 * values["stroke"] / values["crank_ratio"]
    if radius is None:
        # The stroke of an offset crank, solved for the radius with the rod's length as it is.
        ratio = values["crank_ratio"]
        spread = lambda r: (  # noqa: E731
            np.sqrt((r / ratio + r) ** 2 - offset**2) - np.sqrt((r / ratio - r) ** 2 - offset**2)
        )
        low, high = 0.4 * values["stroke"], 0.6 * values["stroke"]
        for _ in range(100):
            radius = 0.5 * (low + high)
            low, high = (radius, high) if spread(radius) < values["stroke"] else (low, radius)
        rod = radius / ratio
    top = np.arcsin(offset / (rod + radius))
    pin = radius * np.array([np.sin(phi + top), np.cos(phi + top)])
    height = pin[1] + np.sqrt(rod**2 - (offset - pin[0]) ** 2)
    omega = values["speed"] * np.pi / 30.0
    own = values["rod_centre_of_gravity"] / rod
    mass = values["piston_mass"] + values["rod_mass"] * own
    # Two derivatives of the height by the crank angle, from its Fourier series.
    orders = np.fft.fftfreq(phi.size, (phi[1] - phi[0]) / (2.0 * np.pi))
    rise = np.fft.ifft(-(orders**2) * np.fft.fft(height)).real * omega**2
    gas = found["gas_force"].values
    along_rod = gas + mass * rise  # upwards on the piston, by its vertical equation
    side = along_rod * (offset - pin[0]) / (height - pin[1])  # of the rod on the piston
    clockwise = -offset * gas + height * side
    expected = clockwise + float(found["friction_torque"])
    size = np.abs(expected).max()
    assert_allclose(found["roll_moment"], expected, atol=1e-9 * size)
    assert (float(abs(found["roll_moment"] + found["torque"]).max()) > 1e-3 * size) == bool(offset)

    forces = found["mount_force"]
    upward = found["shaking_force"].sel(direction=0.0)
    assert_allclose(forces.sum("mount"), upward, atol=1e-9 * size)
    couple = 0.3 * (forces.sel(mount=1) - forces.sel(mount=2))
    assert_allclose(couple, found["roll_moment"], atol=1e-9 * size)
    for name, extreme in (("max", forces.max("crank_angle")), ("min", forces.min("crank_angle"))):
        assert_allclose(found[f"mount_force_{name}"], extreme, rtol=3e-3)


def test_four_mounts_bear_roll_pitch_and_side_forces() -> None:
    """V8 with plane crank: rigid block on four springs, solved by its six equations of balance."""
    mounts = [
        {"lateral": y, "position": x, "height": -0.15, "stiffness": k}
        for y, x, k in ((-0.3, -0.1, 1.0), (0.3, -0.1, 2.0), (-0.25, 0.5, 1.5), (0.25, 0.5, 1.0))
    ]
    found = computed(
        ["mount_force", "mount_force_order", "roll_moment", "roll_moment_order", "shaking_force",
         "shaking_moment", "cylinder_direction", "torque_order"],
        engine=FOUR, mounts=mounts, output={"angle_step": 5.0, "highest_order": 6},
        set={"cylinders": 8, "arrangement": "V8 cross-plane", "cylinder_spacing": SPACING,
             "bank_offset": 0.02, "speed": 3000.0},
        axes={"counterweight_fraction": [0.0, 0.5]},
    )  # fmt: skip
    turn = np.exp(1j * np.radians(float(found["cylinder_direction"])))
    force, moment = (
        (found[name].sel(direction=0.0) + 1j * found[name].sel(direction=90.0)).values * turn
        for name in ("shaking_force", "shaking_moment")
    )
    y, x, k = np.array([(m["lateral"], m["position"], m["stiffness"]) for m in mounts]).T
    for share in range(2):
        for i in range(0, force.shape[-1], 7):
            f, m = force[share, i], moment[share, i]
            roll = float(found["roll_moment"][i])
            # Down by w, right side down by a, far end down by c: forces k (w + a y + c x).
            balance = np.array([
                [(k * p * q).sum() for q in (np.ones(4), y, x)] for p in (np.ones(4), y, x)
            ])  # fmt: skip
            loads = [f.real, -(roll - (-0.15) * f.imag), m.real + f.real * 1.5 * SPACING]
            w, a, c = np.linalg.solve(balance, loads)
            expected = k * (w + a * y + c * x)
            assert_allclose(found["mount_force"][share, :, i], expected, atol=1e-8 * abs(roll))
    curve = np.fft.rfft(found["mount_force"].values) * 2.0 / found.sizes["crank_angle"]
    for order in (0.5, 1.0, 2.0, 4.0, 6.0):
        expected = np.abs(curve[..., round(2 * order)])
        here = found["mount_force_order"].sel(order=order)
        assert_allclose(here, expected, rtol=2e-3, atol=1e-3 * np.abs(curve[..., 1:]).max())
    assert_array_equal(found["roll_moment_order"], found["torque_order"])


WEB = {"mass": 1.0, "radius": 0.05, "angle": 180.0, "position": 0.0}


@pytest.mark.parametrize(
    ("tables", "message"),
    [
        ({"counterweights": [{**WEB, "mass": -1.0}]},
         "[counterweights] number 1 mass = -1: must be a number in kg, 0 or more"),
        ({"counterweights": [WEB, {**WEB, "radius": 0.0}]}, "number 2 radius = 0: must be"),
        ({"counterweights": [{**WEB, "angle": 900.0}]}, "angle = 900: must be a number in degree"),
        ({"counterweights": [{**WEB, "position": "middle"}]}, "position = 'middle': must be"),
        ({"counterweights": [{"mass": 1.0}]}, "number 1 radius: missing; must be"),
        ({"counterweights": [{**WEB, "place": 1.0}]}, "place: unknown key"),
        ({"counterweights": []}, "counterweights = []: must be tables [[counterweights]]"),
        ({"counterweights": [WEB], "set": {"counterweight_mass": 1.0}},
         "[set] counterweight_mass: not allowed together with [[counterweights]]"),
        ({"counterweights": [WEB], "axes": {"counterweight_fraction": [0.1, 0.2]}},
         "[axes] counterweight_fraction: not allowed together with [[counterweights]]"),
        ({"set": {"counterweights_factor": -0.5}, "counterweights": [WEB]},
         "counterweights_factor = -0.5: must be a finite number 0 or more"),
        ({"counterweights": [WEB]}, "needs cylinder_spacing"),
        ({"mounts": [{"lateral": 0.1}]}, "[mounts]: the block can tilt: must stand at two lateral"),
        ({"mounts": [{"lateral": 0.1}, {"lateral": 0.1}]}, "must stand at two lateral places"),
        ({"mounts": [{"lateral": x, "position": x} for x in (-0.1, 0.0, 0.2)]},
         "with positions, three at least must not stand in one line"),
        ({"mounts": [*TWO_MOUNTS, {"lateral": 0.0, "position": 1.0}]},
         "[mounts] number 1 position: missing; must be given for all mounts or none"),
        ({"mounts": [{"lateral": 0.1}, {"lateral": -0.1, "height": 0.2}]},
         "[mounts] height: 0 and 0.2: must be the same for all"),
        ({"mounts": [{"lateral": 0.1, "stiffness": 0.0}, {"lateral": -0.1}]},
         "[mounts] number 1 stiffness = 0: must be a number above 0"),
        ({}, "'mount_force' needs tables [[mounts]] with lateral, one for each"),
    ],
)  # fmt: skip
def test_bad_input(tables: dict[str, Any], message: str) -> None:
    quantity = "mount_force" if "counterweights" not in tables else "shaking_moment_max"
    assert message in refusal(asking([quantity], **tables))


def test_bending_over_the_cycle_has_all_forces_on_the_pins() -> None:
    """Single cylinder: its journals bear all; beam cut at the webs and at the pin."""
    webs = [{"mass": 3.0, "radius": 0.06, "angle": 180.0, "position": place}
            for place in (-0.05, 0.06)]  # fmt: skip
    found = computed(
        ["bay_bending_moment_cycle_max", "main_journal_x", "main_journal_y"],
        counterweights=webs, axes={"speed": [1000.0, 2000.0]},
        set={"cylinder_spacing": 0.24, "pin_offset": 0.003}, output={"angle_step": 0.1},
    )  # fmt: skip
    values = sweeps.read_scene(asking(["imep"])).engine.values
    journals = found["main_journal_y"] + 1j * found["main_journal_x"]
    phi = np.radians(found["crank_angle"].values)
    radius = 0.5 * values["stroke"]  # but for a millionth, with this offset
    top = np.arcsin(0.003 / (radius / values["crank_ratio"] + radius))
    for speed in (1000.0, 2000.0):
        first = journals.sel(speed=speed, main_bearing=1).values
        square = (speed * np.pi / 30.0) ** 2
        turning = -3.0 * 0.06 * square * np.exp(1j * (phi + top))
        moments = [first * 0.07, first * 0.12 - turning * 0.05,
                   journals.sel(speed=speed, main_bearing=2).values * 0.06]  # fmt: skip
        largest = max(float(np.abs(moment).max()) for moment in moments)
        here = float(found["bay_bending_moment_cycle_max"].sel(speed=speed, bay=1))
        assert largest * (1.0 - 2e-6) <= here < largest * (1.0 + 1e-5)
