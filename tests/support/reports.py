"""Archives that reports are written on."""

import json
from random import Random
from typing import Any

import numpy as np
import xarray as xr

SCENE: dict[str, Any] = {
    "title": "three loads",
    "engine": "ntua",
    "axes": {"load": [20, 50, 80], "inertia": [0.05, 2.0, 3.0, 5.0]},
    "output": {"quantities": ["delta", "omega_max", "brake_power", "omega", "torque", "gas_torque"],
        "angle_step": 4},
}  # fmt: skip


def large(designs: int = 60, angles: int = 180) -> xr.Dataset:
    """An archive whose numbers nobody computed, over two axes and the crank angle."""
    speed, inertia = np.linspace(1000.0, 2000.0, designs), np.geomspace(1.0, 20.0, designs)
    number = speed[:, np.newaxis] + inertia
    angle = np.linspace(0.0, 720.0, angles, endpoint=False)
    return xr.Dataset(
        {
            "delta": (("speed", "inertia"), number),
            "omega": (("speed", "inertia", "crank_angle"), number[..., np.newaxis] + angle),
            "status": (("speed", "inertia"), np.zeros(number.shape, "i1")),
        },
        {"speed": speed, "inertia": inertia, "crank_angle": angle},
        {"title": "made up"},
    )


def alike(speeds: int) -> xr.Dataset:
    """Misfires of twelve cylinders that are all alike, over speeds."""
    speed, misfire = np.linspace(1000.0, 2000.0, speeds), np.arange(13.0)
    delta = 0.01 + 1e-5 * speed + 0.02 * np.minimum(misfire, 1.0)[:, np.newaxis]
    return xr.Dataset(
        {"delta": (("misfire", "speed"), delta, {"units": "1"})},
        {"misfire": misfire, "speed": speed}, {"title": "made up"},
    )  # fmt: skip


NASTY = (
    "<script>window.broken = 1</script>", "</script><img src=x onerror='window.broken = 1'>",
    '"\' onload="window.broken=1', "$$\\frac{1}{2}$$ \\(x\\) @x $index &amp; &lt;", "x" * 5000,
    "\u202egnirts", "</title></style>", "a\nb\u2028c\x00d", "-->", "]]>", "constructor",
    "__proto__",
)  # fmt: skip


def hostile() -> xr.Dataset:
    """An archive whose every text is markup, with missing, infinite and no numbers."""
    words = np.array(NASTY, dtype=object)
    size = len(words)
    numbers = np.full((size, 3), 1e300)
    numbers[0], numbers[1], numbers[2] = np.nan, np.inf, -np.inf
    attrs = {"long_name": NASTY[0], "units": NASTY[1], "references": NASTY[2]}
    data = {
        "delta": (("design", NASTY[0]), numbers, attrs),
        NASTY[1]: (("design",), numbers[:, 0], attrs),
        "omega": (("design", "crank_angle"), numbers[:, :1], attrs),
        "nothing": (("empty",), np.zeros(0), attrs),
        "__proto__": (("design",), numbers[:, 0]),
        "words": (("design",), words),
        "status": (("design",), np.arange(size, dtype="i1") % 7),
    }
    coords = {
        "case": ("design", words, attrs),
        "mass": ("design", numbers[:, 0], attrs),
        "crank_angle": [0.0],
        NASTY[0]: (NASTY[0], [1.0, np.nan, np.inf], attrs),
    }
    about = {
        "title": NASTY[0], "engine": NASTY[1], "engine_title": NASTY[2], "history": NASTY[7],
        "warnings": "\n".join(NASTY[:6]), "references": NASTY[0], "scene": '{"set": {"<b>": [1]}}',
        "engine_assumed": json.dumps({NASTY[0]: NASTY[1]}), "parameters": "[" * 9000,
        "solver": '{"method": 3}', "arrangement": "null", "input_files": '{"files": {"<b>": 1}}',
        NASTY[2]: NASTY[1],
    }  # fmt: skip
    return xr.Dataset(data, coords, about)


def any_archive(random: Random) -> xr.Dataset:
    """An archive that somebody may have made: any dimensions, sizes, texts and numbers."""
    numbers = np.random.default_rng(random.randrange(10**6))
    known = ["speed", "engine", "design", "throw", "direction", "crank_angle", "order", "tooth",
             "an axis", "recorded_cycle"]  # fmt: skip
    sizes = {
        n: random.choice([0, 1, 1, 2, 3, 12]) for n in random.sample(known, random.randint(0, 5))
    }
    coords: dict[str, Any] = {}
    for name, size in sizes.items():
        if name == "engine" or random.random() < 0.2:
            coords[name] = (name, np.array([random.choice(NASTY) for _ in range(size)], object))
        elif random.random() < 0.8:
            unit = random.choice(["rpm", "m", "percent", "", "W", "<b>", "rad s-1"])
            scale = 10.0 ** random.randint(-3, 5)
            coords[name] = (name, np.sort(numbers.normal(size=size)) * scale, {"units": unit})
        if random.random() < 0.3:
            column = numbers.normal(size=size) * random.choice([1.0, np.nan, 1e200])
            coords[f"{name} of it"] = (name, column)
    data: dict[str, Any] = {}
    quantities = ["delta", "omega", "torque", "a b", "shaking_force", "delta_published", "x<y"]
    for name in random.sample(quantities, random.randint(0, 5)):
        dims = random.sample([*sizes], random.randint(0, min(4, len(sizes))))
        values = numbers.normal(size=[sizes[d] for d in dims]) * 10.0 ** random.randint(-99, 99)
        odd = random.choice([0.0, np.nan, np.inf, 1.0])
        values = np.where(
            numbers.random(values.shape) < random.choice([0.0, 0.4, 1.0]), odd, values
        )
        unit = random.choice(["rad s-1", "N m", "1", "bogus", "N", ""])
        data[name] = (dims, values, {"units": unit, "long_name": random.choice(NASTY)})
    if random.random() < 0.6:
        dims = [d for d in sizes if d not in ("crank_angle", "order", "direction")][:3]
        codes = numbers.integers(0, 7, size=[sizes[d] for d in dims])
        data["status"] = (dims, codes.astype("i1"))
    return xr.Dataset(data, coords, {"title": random.choice(NASTY)})
