"""Shafts of publications, closed forms and an independent program, beside what is computed here.

The systems stand in tests/reference/torsional_systems.toml; each kind of comparison is a function.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from engine_dyn.torsion.forced import forced_response
from engine_dyn.torsion.impacts import Pulses, pulse_response
from engine_dyn.torsion.modes import (
    Modes,
    critical_speeds,
    damped_modes,
    modal_damping,
    natural_modes,
)
from engine_dyn.torsion.synthesis import half_range
from engine_dyn.torsion.system import ShaftSystem, matrices, shaft_system
from engine_dyn.units import DEGREE, RPM

PATH = Path(__file__).resolve().parents[1] / "tests" / "reference" / "torsional_systems.toml"
DATA = tomllib.loads(PATH.read_text(encoding="utf-8"))
SYSTEMS: dict[str, dict[str, Any]] = {system["id"]: system for system in DATA["system"]}
SI = {"Hz": 2.0 * np.pi, "1/min": RPM, "degree": DEGREE}
"""SI value of units that are not SI units; a frequency is an angular one."""

TORQUE = DATA["diesel_torque"]
THROWS = TORQUE["throws"]
ORDERS = np.array(TORQUE["throw_1"])[:, 0]


class Comparison(NamedTuple):
    """A value of a source, with its digits, and ours in the same unit; NaN if there is none."""

    system: dict[str, Any]
    given: dict[str, Any]
    value: str
    ours: float

    @property
    def difference(self) -> float:
        """Relative; NaN beside 0."""
        return self.ours / float(self.value) - 1.0 if float(self.value) else np.nan

    @property
    def within(self) -> bool:
        """Whether ours rounds to the value, half a unit of its last digit allowed."""
        return self._off <= self._half_a_unit

    @property
    def agrees(self) -> bool:
        """The same, with what the source itself rounds."""
        return self._off <= self._half_a_unit + self.given.get("rounding", 0.0) * abs(
            float(self.value)
        )

    @property
    def _off(self) -> float:
        return abs(self.ours - float(self.value))

    @property
    def _half_a_unit(self) -> float:
        mantissa, _, power = self.value.partition("e")
        return 0.5000001 * 10.0 ** (int(power or 0) - len(mantissa.partition(".")[2]))


def diesel_torques(silent: int | None = None) -> Any:
    """Harmonics on the throws of the diesel, (throw, order)."""
    order, amplitude, phase = np.array(TORQUE["throw_1"]).T
    delay = np.radians(TORQUE["delay"])[:, None]
    torques = amplitude * np.exp(1j * np.radians(phase)) * np.exp(-1j * order * delay)
    if silent is not None:
        torques[silent] = 0.0
    return torques


def made(system: dict[str, Any], given: dict[str, Any]) -> ShaftSystem:
    """The shaft of a comparison."""
    if "shaft" in system:
        return shaft_system(**{**system["shaft"], **given.get("change", {})})
    shaft: dict[str, Any] = system["uniform"]
    count = given["elements"]
    moment = shaft["polar_moment"] * shaft["length"] / count
    inertia = np.full(count + 1, shaft["density"] * moment)
    inertia[[0, -1]] = 0.5 * inertia[[0, -1]] + np.array(shaft["ends"])
    stiffness = np.full(count, shaft["shear_modulus"] * moment / (shaft["length"] / count) ** 2)
    if not shaft.get("held"):
        return shaft_system(inertia, stiffness)
    ground = np.zeros(count)
    ground[0] = stiffness[0]
    return shaft_system(inertia[1:], stiffness[1:], ground_stiffness=ground)


class Optimum(NamedTuple):
    """The stiffness and damping that hold a damper's ring, and the largest amplitude with them."""

    stiffness: Any  # Stiffness of the damper [N m/rad]
    damping: Any  # Damping of the damper [N m s/rad]
    magnifier: Any  # Largest amplitude of a mode over that of its static twist [1]


def optimum_viscous(ring: Any, modal_inertia: Any, omega: Any) -> Optimum:
    """Best viscous damping c = 2 zeta J_d omega_m of a ring without spring.

    zeta = 1/sqrt(2 (1 + mu) (2 + mu)); the peak 1 + 2/mu lies at omega_m sqrt(2/(2 + mu)), where
    all curves of other damping pass. Den Hartog, Mechanical Vibrations, on the Houdaille damper.

    Parameters
    ----------
    ring, modal_inertia : array_like
        Inertia of the damper's ring; of the mode, over the square of the hub's amplitude [kg m2].
    omega : array_like
        Natural frequency of the mode [rad/s].
    """
    mu = ring / modal_inertia
    zeta = (2.0 * (1.0 + mu) * (2.0 + mu)) ** -0.5
    return Optimum(0.0 * mu, 2.0 * zeta * ring * omega, 1.0 + 2.0 / mu)


def optimum_tuned(ring: Any, modal_inertia: Any, omega: Any) -> Optimum:
    """Best spring and damping of a `ring` for a mode: inertias [kg m2], `omega` [rad/s].

    Tuned to omega_m/(1 + mu), with zeta = c/(2 J_d omega_m) = sqrt(3 mu/(8 (1 + mu)^3)). The
    magnifier is that of the two fixed points, sqrt(1 + 2/mu); the peak is up to 1.3 percent
    higher for mu up to 1. Den Hartog, Mechanical Vibrations, on the damped absorber.
    """
    mu = ring / modal_inertia
    tuned = omega / (1.0 + mu)
    zeta = (0.375 * mu / (1.0 + mu) ** 3) ** 0.5
    return Optimum(ring * tuned**2, 2.0 * zeta * ring * omega, (1.0 + 2.0 / mu) ** 0.5)


def modal_excitation(modes: Modes, throws: Any, torque: Any) -> Any:
    """Torque on each mode [N m], sum_j a_j U_j: with U_j = exp(i nu psi_j) the phase-vector sum.

    Parameters
    ----------
    modes : Modes
        Their discs.
    throws : array_like of int
        Disc on which each torque acts.
    torque : array_like of complex
        U, shape (..., T, orders): amplitude and phase of each order.

    Returns
    -------
    ndarray, shape (..., m, orders)
    """
    return np.asarray(np.matmul(modes.shape[..., np.asarray(throws)], np.asarray(torque)))


def resonance_angle(modes: Modes, zeta: Any, excitation: Any) -> Any:
    """Amplitude [rad] of the disc of unit amplitude at resonance, |W|/(2 zeta omega^2 J_m).

    One mode alone: for a comparison, and to rank critical speeds. `excitation` is what
    `modal_excitation` returns, `zeta` what `modal_damping` returns.
    """
    stiff = 2.0 * np.asarray(zeta) * modes.omega**2 * modes.modal_inertia
    return np.asarray(np.abs(excitation) / stiff[..., None])


def of_modes(values: Any, given: dict[str, Any]) -> Any:
    return values[np.array(given["modes"]) - 1]


def frequency(shaft: ShaftSystem, given: dict[str, Any]) -> Any:
    return of_modes(natural_modes(shaft).omega, given)


def damping_ratio(shaft: ShaftSystem, given: dict[str, Any]) -> Any:
    return of_modes(modal_damping(shaft, natural_modes(shaft)), given)


def vector_sum(shaft: ShaftSystem, given: dict[str, Any]) -> Any:
    vectors = np.exp(-1j * np.radians(given["delay"])[:, None] * given["orders"])
    sums = modal_excitation(natural_modes(shaft, unit=0), given["throws"], vectors)
    return np.abs(of_modes(sums, given)).ravel()


def eigenvalues(shaft: ShaftSystem, _: dict[str, Any]) -> Any:
    inertia, stiffness, _loss, damping = matrices(shaft)
    below = -np.hstack([stiffness, damping]) / inertia[:, None]
    state = np.vstack([np.hstack([np.zeros_like(stiffness), np.eye(inertia.size)]), below])
    found = np.linalg.eigvals(state)
    pairs = sorted(found[found.imag > 0.0], key=lambda value: -value.imag)
    alone = found.real[(found.imag == 0.0) & (np.abs(found.real) > 1e-9)]
    return [part for pair in pairs for part in (pair.real, pair.imag)] + list(alone)


def swinging(shaft: ShaftSystem, _: dict[str, Any]) -> Any:
    """Roots of the modes that swing, the slowest first: real and imaginary part of each."""
    found = damped_modes(shaft)
    pairs = zip(-found.ratio * found.omega, found.swing, strict=True)
    return [part for pair in pairs for part in pair]


def pulse(shaft: ShaftSystem, given: dict[str, Any]) -> Any:
    """Highest and lowest torque of some shafts in time, after half a sine on a disc."""
    one = Pulses(np.zeros(1), np.array([given["duration"]]), np.array([given["torque"]]))
    found = pulse_response(shaft, given["disc"], one, until=given["until"])
    return np.stack([found["highest"], found["lowest"]], axis=-1)[given["shafts"]].ravel()


def of_diesel(shaft: ShaftSystem, given: dict[str, Any], what: str, **more: Any) -> Any:
    """Response to the torques of the diesel at their speed."""
    torques = diesel_torques(given.get("silent"))
    omega = TORQUE["speed"] * RPM
    return forced_response(shaft, ORDERS, omega, THROWS, torques, wanted=what.split(), **more)


def resonance(shaft: ShaftSystem, given: dict[str, Any]) -> Any:
    modes = natural_modes(shaft, unit=0)
    torques = diesel_torques()[:, given["order"] == ORDERS]
    direct = forced_response(shaft, [1.0], modes.omega[0], THROWS, torques)["angle"][0, 0]
    one = resonance_angle(
        modes, modal_damping(shaft, modes), modal_excitation(modes, THROWS, torques)
    )
    return abs(direct), one[0, 0]


def twist(shaft: ShaftSystem, given: dict[str, Any]) -> Any:
    found = of_diesel(shaft, given, "twist_extremes", twist=shaft.shafts)["twist_extremes"]
    return shaft.stiffness[1:] * half_range(found)


def angle_of_orders(shaft: ShaftSystem, given: dict[str, Any]) -> Any:
    places = np.searchsorted(ORDERS, given["orders"])
    return np.abs(of_diesel(shaft, given, "angle")["angle"][given["disc"], places])


def power(shaft: ShaftSystem, given: dict[str, Any]) -> Any:
    found = of_diesel(shaft, given, "frame_loss shaft_loss")
    return float(found["frame_loss"]), found["shaft_loss"].sum()


def stiff_limit(shaft: ShaftSystem, given: dict[str, Any]) -> Any:
    omega, place = given["speed"] * RPM, np.flatnonzero(given["order"] == ORDERS)
    w, torques = given["order"] * omega, diesel_torques()[:, place]
    inertia, damping = shaft.inertia.sum(), shaft.disc_damping.sum()
    rigid = torques.sum() / (-(w**2) * inertia + 1j * w * damping)
    own = SYSTEMS["diesel_105x137"]["shaft"]
    found = [
        forced_response(
            shaft_system(**{**own, "stiffness": factor * np.array(own["stiffness"])}),
            [given["order"]], omega, THROWS, torques,
        )["angle"][given["disc"], 0]
        for factor in given["factors"]
    ]  # fmt: skip
    return np.abs(np.array(found) / rigid - 1.0)


def at_frequency(shaft: ShaftSystem, given: dict[str, Any], what: str = "angle") -> Any:
    """Response to equal torques in phase."""
    throws = given.get("throws", THROWS)
    torque = np.full((len(throws), 1), given.get("torque", 100.0))
    omega = 2.0 * np.pi * np.asarray(given["frequency"])
    return forced_response(shaft, [1.0], omega, throws, torque, wanted=(what,))[what]


def receptance(shaft: ShaftSystem, given: dict[str, Any]) -> Any:
    found = [
        at_frequency(shaft, {**given, "throws": [one], "torque": 1.0})[other, 0]
        for one, other in given["pairs"]
    ]
    return [part for value in found for part in (value.real, value.imag)]


def damper_of_one_mode(_: ShaftSystem, given: dict[str, Any]) -> Any:
    modes = natural_modes(shaft_system(**SYSTEMS["diesel_105x137"]["shaft"]), unit=0)
    ring = SYSTEMS["diesel_viscous_damper"]["shaft"]["inertia"][-1]
    inertia, omega = modes.modal_inertia[0], modes.omega[0]
    damping = optimum_viscous(ring, inertia, omega).damping
    mu = ring / inertia
    peak = omega * np.sqrt(2.0 / (2.0 + mu)) / (2.0 * np.pi)
    return mu, damping / (2.0 * ring * omega), damping, peak


def peak(_: ShaftSystem, given: dict[str, Any]) -> Any:
    frequencies = np.linspace(150.0, 250.0, 20001)
    own = {**SYSTEMS["diesel_viscous_damper"]["shaft"], "loss_factor": 0.0, "disc_damping": 0.0}
    shafts = (
        shaft_system(**{**own, "damping": factor * np.array(own["damping"])})
        for factor in given["factors"]
    )
    return [
        np.abs(at_frequency(shaft, {"frequency": frequencies})[:, 0, 0]).max() for shaft in shafts
    ]


def with_ring(given: dict[str, Any], best: Any, w: Any) -> Any:
    """Amplitude of a disc of 2 kg m2 and 300 rad/s with a ring, over its static one."""
    shaft = shaft_system(
        [2.0, 2.0 * given["mu"]], [best.stiffness], damping=[best.damping],
        ground_stiffness=[180000.0, 0.0],
    )  # fmt: skip
    return np.abs(forced_response(shaft, [1.0], w, [0], [[180000.0]])["angle"][:, 0, 0])


def viscous_damper(_: ShaftSystem, given: dict[str, Any]) -> Any:
    ring, w = 2.0 * given["mu"], 300.0 * np.linspace(0.7, 1.1, 20001)
    best = optimum_viscous(ring, 2.0, 300.0)
    sizes = with_ring(given, best, w)
    return best.damping / (600.0 * ring), sizes.max(), w[sizes.argmax()] / 300.0


def tuned_damper(_: ShaftSystem, given: dict[str, Any]) -> Any:
    ring, w = 2.0 * given["mu"], 300.0 * np.linspace(0.3, 1.6, 20001)
    best = optimum_tuned(ring, 2.0, 300.0)
    return best.damping / (600.0 * ring), best.magnifier, with_ring(given, best, w).max()


def hub_loss(_: ShaftSystem, given: dict[str, Any]) -> Any:
    """A hub so heavy that the ring does not move it, moved by 0.01 rad at 400 rad/s."""
    w, moved = 400.0, 0.01
    found = []
    for ratio in given["ratios"]:
        shaft = shaft_system([1e9, 0.1], [0.0], damping=[ratio * 0.1 * w])
        force = [[-moved * 1e9 * w**2]]
        lost = forced_response(shaft, [1.0], w, [0], force, wanted=("shaft_loss",))["shaft_loss"]
        found.append(lost[0] * 2.0 * np.pi / w / (0.1 * w**2 * moved**2))
    return found


KINDS: dict[str, Callable[[ShaftSystem, dict[str, Any]], Any]] = {
    "frequency": frequency,
    "critical": lambda shaft, given: critical_speeds(shaft, given["orders"])[:, given["mode"] - 1],
    "shape": lambda shaft, given: natural_modes(shaft, unit=0).shape[given["mode"] - 1],
    "modal inertia": lambda shaft, given: of_modes(
        natural_modes(shaft, unit=0).modal_inertia, given
    ),
    "damping ratio": damping_ratio,
    "vector sum": vector_sum,
    "eigenvalues": eigenvalues,
    "damped modes": swinging,
    "pulse": pulse,
    "resonance": resonance,
    "receptance": receptance,
    "half range": lambda shaft, given: half_range(
        of_diesel(shaft, given, "torque_extremes")["torque_extremes"]),
    "half range of twist": twist,
    "half range of angle": lambda shaft, given: half_range(
        of_diesel(shaft, given, "angle_extremes")["angle_extremes"])[given["discs"]],
    "angle of orders": angle_of_orders,
    "power": power,
    "stiff limit": stiff_limit,
    "angle": lambda shaft, given: np.abs(at_frequency(shaft, given)[given["discs"], 0]),
    "loss": lambda shaft, given: [at_frequency(shaft, given, "shaft_loss")[given["shaft"]]],
    "damper of one mode": damper_of_one_mode,
    "peak": peak,
    "viscous damper": viscous_damper,
    "tuned damper": tuned_damper,
    "hub loss": hub_loss,
    "not computed": lambda _, given: [np.nan] * len(given["values"]),
}  # fmt: skip


def compared(system: dict[str, Any], given: dict[str, Any]) -> list[Comparison]:
    """Values of one comparison."""
    ours = KINDS[given["kind"]](made(system, given), given)
    unit = SI.get(given["unit"], 1.0)
    return [
        Comparison(system, given, value, float(own) / unit)
        for value, own in zip(given["values"], ours, strict=True)
    ]


def comparisons() -> list[Comparison]:
    """Every value of every system."""
    return [
        one
        for system in SYSTEMS.values()
        for given in system["compare"]
        for one in compared(system, given)
    ]


def place(one: Comparison, number: int) -> str:
    """Words that identify one of several values of a comparison."""
    given = one.given
    for key, word, first in (
        ("modes", "mode", 0), ("discs", "disc", 1), ("orders", "order", 0), ("factors", "factor", 0)
    ):  # fmt: skip
        if len(given.get(key, ())) == len(given["values"]):
            return f"{given['kind']}, {word} {given[key][number] + first:g}"
    return given["kind"] + (f", {number + 1}" if len(given["values"]) > 1 else "")


def table(rows: list[Comparison]) -> list[list[str]]:
    """Every value that is compared."""
    found = [["system", "quantity", "unit", "value", "origin", "ours", "difference %", "remark"]]
    before, number = None, 0
    for one in rows:
        number = number + 1 if one.given is before else 0
        before = one.given
        known = np.isfinite(one.difference)
        found.append([
            one.system["title"], place(one, number), one.given["unit"], one.value,
            one.given["origin"], "" if np.isnan(one.ours) else f"{one.ours:.6g}",
            f"{100.0 * one.difference + 0.0:.3f}" if known else "", one.given.get("remark", ""),
        ])  # fmt: skip
    return found


def sources(rows: list[Comparison]) -> list[list[str]]:
    """Where each system is from."""
    found = {one.system["title"]: one.system["source"] for one in rows}
    return [["system", "source"], *([title, source] for title, source in found.items())]


def exceptions(rows: list[Comparison]) -> list[list[str]]:
    """Printed values that are not met within the rounding of their last digit, and why."""
    off: dict[str, list[Comparison]] = {}
    for one in rows:
        if one.given["origin"] == "printed" and not one.within and "interval" not in one.given:
            off.setdefault(one.given["remark"], []).append(one)
    found = [["system", "printed", "ours", "why"]]
    for remark, some in off.items():
        digits = [len(one.value.partition(".")[2]) + 1 for one in some]
        ours = ", ".join(f"{one.ours:.{d}f}" for one, d in zip(some, digits, strict=True))
        unit = some[0].given["unit"]
        values = ", ".join(one.value for one in some) + f" {unit}" * (unit != "1")
        found.append([some[0].system["title"], values, ours, remark])
    return found
