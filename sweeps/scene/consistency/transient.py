"""Whether a scene can be followed in time: its tables, and what they need of each other."""

from __future__ import annotations

import math

import numpy as np

from engine_dyn.quantities.features.transient import FEATURE, KEY_OF, PARAMETERS, TABLES
from engine_dyn.transient.fields import faults
from engine_dyn.types import Floats
from engine_dyn.units import RPM
from sweeps.base.errors import SceneError
from sweeps.scene.known_values import Value
from sweeps.scene.model import Scene

_NEEDED = (
    ("starter_torque", ("starter_speed",), "the speed at which the starter gives nothing"),
    ("starter_speed", ("starter_torque",), "the torque of the starter at rest"),
    ("starter_release", ("starter_torque",), "the torque of the starter at rest"),
    ("clutch_inertia", ("clutch_time",), "the time at which it is switched in"),
    ("clutch_time", ("clutch_inertia",), "the inertia that is switched in"),
    ("clutch_torque", ("clutch_time", "clutch_inertia"), "what is switched in, and when"),
    ("clutch_speed", ("clutch_time", "clutch_inertia"), "what is switched in, and when"),
    ("transient_boost_margin", ("transient_boost_lag",), "the time constant of the air"),
)  # fmt: skip
"""Keys, those that they need, and what these are."""


def impossible(scene: Scene) -> list[tuple[str, float]]:
    """Given numbers that no design can have, in words, and the share of the designs that do."""
    part = FEATURE.of(scene.engine)
    if part is None:
        return []
    keys = KEY_OF | ({"load_exponent": "load_exponent"} if part.law == "exponent" else {})
    last_row = scene.engine.family.high
    highest = Value(min(100.0, last_row))
    given = {field: scene.known[key] for field, key in keys.items() if key in scene.known}
    given = {"highest_command": highest} | given
    dims = list(dict.fromkeys(dim for one in given.values() for dim in one.dims))
    numbers = {
        field: np.reshape(one.si, [-1 if d in one.dims else 1 for d in dims])
        for field, one in given.items()
    }  # fmt: skip
    found = []
    for name, wrong, must in faults(numbers, last_row):
        if wrong.any():
            bad = {
                field: np.broadcast_to(value, wrong.shape)[wrong].flat[0] / given[field].unit
                for field, value in numbers.items() if field == name or field in must
            }  # fmt: skip
            said = {field: f"{keys[field]}, {value:g}" for field, value in bad.items()}
            text = f"{keys[name]} = {bad[name]:g}: must be {must.format_map(said)}"
            found.append((text, float(wrong.mean())))
    return found


def check_transient(scene: Scene, name: str) -> None:
    """Check what depends on several tables, or on the engine.

    Raises
    ------
    SceneError
        For a table without its method or the other way round, a governor without gains or beside
        given commands, a starter without its speed, a clutch without time or inertia, numbers that
        none of the designs can have, a cylinder that there is not, and a load behind the end.
    """
    part = FEATURE.of(scene.engine)
    asked = scene.source.get("solver", {}).get("method") == FEATURE.name
    if part is None:
        if asked:
            raise SceneError(f"{name}: [solver] method = 'transient': needs a table [transient]")
        for table in (one for one in TABLES if scene.source.get(one) is not None):
            raise SceneError(f"{name}: [{table}]: has no effect without a table [transient]")
        return
    if not asked:
        raise SceneError(
            f"{name}: [transient]: needs [solver] method = 'transient', which follows the speed in "
            "time"
        )

    def at(key: str) -> Floats:
        return scene.given_or_own(key, math.nan).values

    def given(key: str) -> bool:
        return not bool(np.isnan(at(key)).all())

    gains = ("governor_gain", "governor_integral")
    of_governor = (node.name for node in PARAMETERS if node.name.startswith("governor_"))
    governed = [key for key in of_governor if given(key)]
    where, last_row = f"{name}: [transient]", scene.engine.family.high
    if part.command is not None and part.command.value.max() > last_row:
        raise SceneError(
            f"{where} command_steps: command {part.command.value.max():g}: must be at most "
            f"{last_row:g}, the load of the last diagram of engine {scene.engine.name}"
        )
    if part.command is not None and governed:
        raise SceneError(
            f"{where} command_steps: not allowed together with {governed[0]}: a governor gives the "
            "fuel command"
        )
    if governed and not any(scene.nonzero(key) for key in gains):
        raise SceneError(
            f"{name}: {governed[0]}: a governor needs gain or integral in [governor], above 0"
        )
    for one, others, why in _NEEDED:
        lacks = [other for other in others if given(one) and not given(other)]
        if lacks:
            raise SceneError(f"{name}: {one}: needs {' and '.join(lacks)}, {why}")
    if not given("transient_command_angle"):
        raise SceneError(
            f"{where} command_angle: missing; must be the angle from its firing at which a "
            "cylinder takes the fuel command: -360 degree with a mixture, about -15 with injection"
        )
    earliest, cycle = float(np.min(at("transient_command_angle"))), math.degrees(part.period)
    if earliest < -0.75 * cycle:
        raise SceneError(
            f"{where} command_angle = {earliest:g} degree: must be at least {-0.75 * cycle:g}: "
            "before it, the cylinder still works with the fuel of its last firing"
        )
    for text, share in impossible(scene):
        if share == 1.0:
            raise SceneError(f"{name}: {text}")
    if part.command is not None and given("transient_start_command"):
        raise SceneError(
            f"{where} start_command: not allowed together with command_steps, whose first command "
            "is that of the beginning"
        )
    family = scene.engine.family
    known = part.command is not None or given("transient_start_command")
    if family.low == family.high and not known:
        raise SceneError(
            f"{where} start_command: missing; engine {scene.engine.name} has diagrams for one "
            "load alone, from which the command of another load does not follow"
        )
    counts = [engine.count for engine in scene.all_cylinders]
    if part.missed is not None and part.missed[:, 1].max() >= min(counts):
        raise SceneError(
            f"{where} missed: cylinder {part.missed[:, 1].max() + 1}: must be a cylinder of every "
            f"engine, 1 to {min(counts)}"
        )
    speeds, start = at("speed") * RPM, at("transient_start_speed") * RPM
    fastest = max(float(np.nanmax(one)) for one in (speeds, start, at("governor_speed") * RPM)
                  if not np.isnan(one).all())  # fmt: skip
    most = part.duration * fastest / part.period
    if part.missed is not None and part.missed[:, 0].max() > 1.1 * most + 1.0:
        raise SceneError(
            f"{where} missed: cycle {part.missed[:, 0].max() + 1} lies behind duration = "
            f"{part.duration:g} s, in which the engine makes some {most:.3g} cycles"
        )
    cycle = part.period / min(float(np.nanmin(one)) for one in (speeds, at("governor_speed") * RPM)
                              if not np.isnan(one).all())  # fmt: skip
    lasts = min(part.cycles * cycle, part.duration + cycle)
    for key in ("transient_fuel_cut", "clutch_time"):
        # Twice: the speed may fall below the nominal one
        if not (start < 0.5 * speeds.max()).any() and np.min(at(key)) > 2.0 * lasts:
            raise SceneError(
                f"{name}: {key} = {np.min(at(key)):g}: lies behind the end of the run, some "
                f"{lasts:.3g} s"
            )
    if math.isinf(part.duration) and not (start < 0.5 * speeds.max()).any():
        lasts = part.cycles * part.period / float(speeds.max())
        for what, points in (("load", part.load), ("command", part.command)):
            if points is not None and points.time[-1] > 1.1 * lasts:
                raise SceneError(
                    f"{where} cycles = {part.cycles}: they last {lasts:.3g} s at nominal speed, "
                    f"and the {what} changes at {points.time[-1]:g} s"
                )
