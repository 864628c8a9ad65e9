"""One design followed in time by scipy's DOP853: slow, simple, and without any code of the kernels.

Between two events kinetic energy and time are integrated over the crank angle, from the pressures
of the diagrams themselves. Events in time and in speed are found by scipy.
"""

import math
from bisect import bisect_right
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from engine_dyn.pressure.diagram import Diagram

CYCLE = 4.0 * math.pi


@dataclass
class Reference:
    """One design; numbers as of `engine_dyn.transient.fields`, of which it takes some."""

    rows: list[Diagram]  # The first without combustion
    commands: Any
    firing: list[float]
    command_angle: float
    ratio: float
    numbers: dict[str, float]
    load: tuple[list[float], list[float]]
    missed: tuple[tuple[int, int], ...] = ()
    held: list[tuple[Any, Any, float]] = field(default_factory=list)
    gap: float = 1.0  # Last relative deviation that the governor saw

    def velocity(self, x: float) -> float:
        s, c = math.sin(x), math.cos(x)
        return s + self.ratio * s * c / math.sqrt(1.0 - (self.ratio * s) ** 2)

    def inertia(self, phi: float) -> float:
        """Inertia [kg m2], its mean over the cycle the given one."""
        n = self.numbers
        square = sum(self.velocity(phi - angle) ** 2 for angle in self.firing) - self.mean_square
        return n["inertia"] + self.more + n.get("reciprocating_inertia", 0.0) * square

    def gas(self, phi: float) -> float:
        """Torque of the gas [N m]."""
        total, knots = 0.0, self.knots
        for angle, (pressure, slope, _) in zip(self.firing, self.held, strict=True):
            x = (phi - angle + 0.5 * CYCLE) % CYCLE - 0.5 * CYCLE
            left = bisect_right(knots, x) - 1
            right = (left + 1) % len(knots)
            begin = knots[left] - (CYCLE if left < 0 else 0.0)
            step = (knots[right] - knots[left]) % CYCLE
            t = (x - begin) / step
            rest = 1.0 - t
            p = (
                pressure[left] * rest * rest * (1.0 + 2.0 * t)
                + pressure[right] * t * t * (3.0 - 2.0 * t)
                + step * (slope[left] * t * rest * rest - slope[right] * t * t * rest)
            )
            total += (p - 101325.0) * self.velocity(x)
        return self.numbers["lever"] * total

    def resisting(self, time: float, omega: float) -> float:
        """Torque of load and friction, less that of the starter [N m]."""
        n = self.numbers
        exponent = n.get("load_exponent", 2.0)
        load = float(np.interp(time, *self.segment)) if self.segment else self.level
        torque = load * (omega / n["speed"]) ** exponent + n.get("load_offset", 0.0)
        torque += n.get("friction_constant", 0.0)
        share = n.get("friction_peak_share", 0.0)
        if share:
            torque += share * float(np.mean([peak for *_, peak in self.held]))
        torque += n.get("friction_linear", 0.0) * omega + n.get("friction_square", 0.0) * omega**2
        if self.starting and self.pulling:
            torque -= n["starter_torque"] * (1.0 - omega / n["starter_speed"])
        return torque + self.slip

    def take(self, i: int, command: float) -> None:
        """Give a cylinder a command: pressures between two rows."""
        command = min(max(command, self.commands[0]), self.commands[-1])
        row = min(
            int(np.searchsorted(self.commands, command, side="right")) - 1, len(self.rows) - 2
        )
        part = (command - self.commands[row]) / (self.commands[row + 1] - self.commands[row])
        a, b = self.rows[row], self.rows[row + 1]
        held = (
            (a.pressure + part * (b.pressure - a.pressure)).tolist(),
            (a.slope + part * (b.slope - a.slope)).tolist(), a.peak + part * (b.peak - a.peak),
        )  # fmt: skip
        self.burnt[i] = command
        if len(self.held) > i:
            self.held[i] = held
        else:
            self.held.append(held)

    def actuator(self, time: float) -> float:
        """Position of the actuator: steps of its input, each with a first-order lag."""
        lag = self.numbers.get("actuator_lag", 0.0)
        x, u, since = self.numbers["start_command"], self.numbers["start_command"], 0.0
        for when, output in self.outputs:
            if when > time:
                break
            x = u + (x - u) * (math.exp((since - when) / lag) if lag else 0.0)
            u, since = output, when
        return u + (x - u) * (math.exp((since - time) / lag) if lag else 0.0)

    def sample(self, time: float, angle: float) -> None:
        """Proportional, integral and derivative action, as the page on transients has it."""
        n, window = self.numbers, int(self.numbers.get("window", 1))
        self.samples.append((angle, time))
        if len(self.samples) <= window:
            return
        back, since = self.samples[-1 - window], time - self.samples[-2][1]
        seen = (angle - back[0]) / (time - back[1])
        gap, droop = 1.0 - seen / n["reference_speed"], n.get("droop", 0.0) / 100.0
        rate = (gap - self.gap) / since if len(self.samples) > window + 1 else 0.0
        self.gap = gap
        raw = n["gain"] * gap + n.get("derivative_gain", 0.0) * rate + self.integral
        raw /= 1.0 + n["gain"] * droop
        low, high = n.get("lowest_command", -1e9), n.get("highest_command", 1e9)
        output = min(max(raw, low), high)
        left = gap - droop * output
        if not (raw >= high and left >= 0.0) and not (raw <= low and left <= 0.0):
            self.integral += n.get("integral_gain", 0.0) * left * since
        self.outputs.append((time + n.get("dead_time", 0.0), output))

    def run(self, cycles: int) -> Any:
        """Time and speed at the end of each cycle, shape (cycles, 2)."""
        n = self.numbers
        self.knots = self.rows[1].angle.tolist()
        x = np.linspace(0.0, 2.0 * math.pi, 1440, endpoint=False)
        squares = [self.velocity(float(one)) ** 2 for one in x]
        self.mean_square = len(self.firing) * float(np.mean(squares))
        self.more = self.slip = 0.0
        self.starting = n.get("starter_torque", 0.0) > 0.0
        self.burnt = [n["start_command"]] * len(self.firing)
        self.air, self.air_time = n["start_command"], 0.0
        self.outputs: list[tuple[float, float]] = []
        self.samples: list[tuple[float, float]] = []
        self.integral = n["start_command"]
        self.gap = 1.0
        omega = n["start_speed"]
        self.pulling = omega < n.get("starter_speed", 1.0)
        for i in range(len(self.firing)):
            fueled = omega >= n.get("fuel_from", 0.0) and (0, i) not in self.missed
            self.take(i, n["start_command"] if fueled else self.commands[0])
        times, torques = self.load
        self.segment: Any = None
        # All instants of the run, one after the other.
        every = n.get("sampling_time", 0.0) if n.get("governed") else 0.0
        instants = sorted({*(t for t in times if t > 0.0), n.get("clutch_time", math.inf)})
        self.level = torques[0]
        state = np.array([0.5 * self.inertia(0.0) * omega**2, 0.0])
        taken = [angle + self.command_angle for angle in self.firing]
        events = sorted({round(a % CYCLE, 12) for a in (*self.firing, *taken)} | {0.0})
        found, number = [], 1
        if every:
            self.sample(0.0, 0.0)
        for cycle in range(cycles):
            for begin, end in zip(events, [*events[1:], CYCLE], strict=True):
                time = state[1]
                speed = math.sqrt(2.0 * state[0] / self.inertia(begin))
                if (
                    any(abs(begin - one) < 1e-9 for one in self.firing)
                    and not every
                    and n.get("governed")
                ):
                    self.sample(time, cycle * CYCLE + begin)
                for i, angle in enumerate(taken):
                    if abs(angle % CYCLE - begin) < 1e-9:
                        self.fuel(i, cycle + int(angle < -1e-9), time, speed)
                at = begin
                while at < end - 1e-13:
                    due = [t for t in instants if t > state[1] + 1e-13]
                    if every:
                        due.append(number * every)
                    due = [min(due)] if due else []
                    self.set_load(state[1], times, torques)
                    at, state = self.piece(at, end, state, due[0] if due else math.inf)
                    if due and abs(state[1] - due[0]) < 1e-12:
                        if every and abs(due[0] - number * every) < 1e-12:
                            self.sample(state[1], cycle * CYCLE + at)
                            number += 1
                        if abs(due[0] - n.get("clutch_time", math.inf)) < 1e-12:
                            self.engage(at, state)
            found.append((state[1], math.sqrt(2.0 * state[0] / self.inertia(CYCLE))))
        return np.array(found)

    def set_load(self, time: float, times: list[float], torques: list[float]) -> None:
        """Load between this instant and the next point."""
        passed = sum(t <= time + 1e-13 for t in times)
        self.level = torques[max(passed - 1, 0)]
        self.segment = None
        if 0 < passed < len(times) and torques[passed] != torques[passed - 1]:
            self.segment = (times[passed - 1 : passed + 1], torques[passed - 1 : passed + 1])

    def engage(self, phi: float, state: Any) -> None:
        """Switch an inertia in at once; both turn with their common momentum."""
        own = self.inertia(phi)
        omega = math.sqrt(2.0 * state[0] / own)
        more = self.numbers["clutch_inertia"]
        both = (own * omega + more * self.numbers.get("clutch_speed", 0.0)) / (own + more)
        self.more = more
        state[0] = 0.5 * self.inertia(phi) * both**2

    def fuel(self, i: int, cycle: int, time: float, speed: float) -> None:
        """Give a cylinder what the actuator and the air allow."""
        n = self.numbers
        command, lag = self.actuator(time), n.get("boost_lag", 0.0)
        if lag:
            mean = float(np.mean(self.burnt))
            self.air = mean + (self.air - mean) * math.exp((self.air_time - time) / lag)
            command = min(command, self.air + n.get("boost_margin", math.inf))
        self.air_time = time
        if (cycle, i) in self.missed or speed < n.get("fuel_from", 0.0):
            command = self.commands[0]
        self.take(i, command)

    def piece(self, at: float, end: float, state: Any, due: float) -> tuple[float, Any]:
        """Integrate to the next event, at most to `end`."""
        n = self.numbers

        def rates(phi: float, y: Any) -> Any:
            # A step that scipy only tries, and rejects, may go below 0.
            omega = math.sqrt(max(2.0 * y[0] / self.inertia(phi), 1e-12))
            return self.gas(phi) - self.resisting(y[1], omega), 1.0 / omega

        def in_time(phi: float, y: Any) -> float:
            return y[1] - due if due < math.inf else -1.0

        def in_speed(phi: float, y: Any) -> float:
            if not self.starting:
                return 1.0
            return math.sqrt(max(2.0 * y[0] / self.inertia(phi), 0.0)) - n["starter_speed"]

        in_time.terminal = in_speed.terminal = True  # type: ignore[attr-defined]
        in_speed.direction = 1.0 if self.pulling else -1.0  # type: ignore[attr-defined]
        made = solve_ivp(
            rates, (at, end), state, "DOP853", rtol=1e-12, atol=(1e-9, 1e-14),
            events=(in_time, in_speed),
        )  # fmt: skip
        state, at = made.y[:, -1].copy(), float(made.t[-1])
        if made.t_events[0].size:
            state[1] = due
        elif made.t_events[1].size:
            self.pulling = not self.pulling
        return at, state
