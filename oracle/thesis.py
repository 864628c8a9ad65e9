"""Explicit Euler as Kakaitsas runs it (section 4.2), in plain Python: lists, loops, `math`."""

import math
from dataclasses import dataclass

from .solution import Design


@dataclass(frozen=True)
class EulerRun:
    """The last pass.

    Attributes
    ----------
    status : str
        ``"passes_done"`` or ``"stalled"`` (then the rest is what there was up to there).
    degrees : list of float
        Crank angles of the samples of the last pass, the first being the start angle.
    omega : list of float
        Speeds [rad/s] there.
    omega_end : float
        Speed after the last step, a cycle after the first sample.
    omega_mean, omega_max, omega_min, delta : float
        Over the samples of the last pass.
    torque_mean : float
        Mean of the torque samples [N m].
    k : float
        Load coefficient.
    """

    status: str
    degrees: list[float]
    omega: list[float]
    omega_end: float
    omega_mean: float
    omega_max: float
    omega_min: float
    delta: float
    torque_mean: float
    k: float


def torque_at(design: Design, degrees: float) -> float:
    """Total torque [N m] at the nominal speed, at a crank angle in degrees."""
    radius = design.stroke / 2.0
    area = math.pi / 4.0 * design.bore * design.bore
    omega_n = design.speed_rpm * 2.0 * math.pi / 60.0
    ratio = design.crank_ratio
    torque = 0.0
    for cylinder in range(design.cylinders):
        phi = math.radians(degrees + 720.0 * cylinder / design.cylinders)
        s, c = math.sin(phi), math.cos(phi)
        root = math.sqrt(1.0 - (ratio * s) ** 2)
        speed = s + ratio * s * c / root
        acceleration = (
            c + ratio * (c * c - s * s) / root + ratio**3 * s * s * c * c / (root * root * root)
        )
        gas = (float(design.pressure(phi)) - design.crankcase_pressure) * area
        inertia = -design.reciprocating_mass * radius * omega_n * omega_n * acceleration
        torque += (gas + inertia) * radius * speed
    return torque - design.friction_torque


def euler(
    design: Design,
    passes: int = 1,
    start_speed: float | None = None,
    start_degrees: float = -180.0,
    step_degrees: float = 1.0,
    k: float | None = None,
) -> EulerRun:
    """Integrate ``Theta omega domega/dphi = M - a - k omega^alpha`` (constant inertia).

    Parameters
    ----------
    design : Design
    passes : int
        Cycles to run; the last is reported.
    start_speed : float, optional
        rad/s; the nominal speed unless given.
    start_degrees : float
        Crank angle of the first sample, firing top dead centre being 0.
    step_degrees : float
        Must divide 720.
    k : float, optional
        Load coefficient; from the mean of the torque samples unless given.
    """
    omega_n = design.speed_rpm * 2.0 * math.pi / 60.0
    steps = round(720.0 / step_degrees)
    dphi = 4.0 * math.pi / steps
    degrees = []
    torque = []
    total = 0.0
    for j in range(steps):
        degrees.append(start_degrees + j * step_degrees)
        torque.append(torque_at(design, degrees[j]))
        total += torque[j]
    torque_mean = total / steps
    if k is None:
        k = (torque_mean - design.load_offset) / omega_n**design.load_exponent
    speed = omega_n if start_speed is None else start_speed
    status = "passes_done"
    samples: list[float] = []
    for _ in range(passes):
        samples = []
        for j in range(steps):
            samples.append(speed)
            load = design.load_offset + k * speed**design.load_exponent
            speed = speed + (torque[j] - load) / (design.inertia * speed) * dphi
            if speed <= 0.0:
                status = "stalled"
                break
        if status == "stalled":
            break
    mean = sum(samples) / len(samples)
    return EulerRun(
        status=status,
        degrees=degrees[: len(samples)],
        omega=samples,
        omega_end=speed,
        omega_mean=mean,
        omega_max=max(samples),
        omega_min=min(samples),
        delta=(max(samples) - min(samples)) / mean,
        torque_mean=torque_mean,
        k=k,
    )
