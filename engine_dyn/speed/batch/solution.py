"""The periodic speed of a block of designs at its coarse nodes.

With q = (omega/omega_n)^2 = 1 + u, X = g P - eta V and tau = 1, or 1 + eta V where the inertia
varies, the energy equation is

    u tau = X - y,      y' = kappa (F(q)/mu - 1),      y periodic,

where y is the work of the load, docs/method.md (55). Its law is split into a part that is
proportional to the energy, with the slope s of F, and a remainder r, so that with beta = kappa s

    y' + beta y = beta (X + r),      r = (F/mu - 1)/s - u tau,

which is linear in y. One pass solves it, exactly for the integrals of X that are tabulated, and for
a cubic through r: docs/method.md (70) to (74). Passes are repeated with the remainder of their
results. The equation contains the closure <F> = mu, because y is periodic, so an idle engine is one
with a tiny beta.

Along the period all is a recurrence; the designs of a block go through it side by side.
"""

from __future__ import annotations

import math

from engine_dyn.compilation import inlined
from engine_dyn.loads.laws import POWER, Form, law_of
from engine_dyn.speed.batch.block import (
    HALO,
    LEFT,
    SETTLED,
    SOLVING,
    Curves,
    Lanes,
    Scratch,
)
from engine_dyn.speed.batch.law_polynomial import fit_law
from engine_dyn.speed.batch.weights import Weights
from engine_dyn.speed.designs import Designs
from engine_dyn.speed.methods import CYCLE_TIME
from engine_dyn.types import Floats

__all__ = ["repeat_ends", "solve_curves"]

MOST_PASSES = 40
"""Designs that need more are left to the general solver."""

ROUNDING = 2e-15
"""Change of the remainder that is nothing but rounding."""

LIGHTEST = 0.4
"""Least inertia over its mean at any node."""

TERMS_AT_ONCE = 4
"""Terms of polynomials that are evaluated in one loop; their number is a multiple of this."""

# Loops over lanes touch six arrays at most: for more, the compiler does not ask whether they
# overlap, and makes no vectors. That is worth a factor of three.


@inlined
def begin_lanes(first: int, weights: Weights, lanes: Lanes) -> None:
    """Take the weights of a block."""
    for k in range(lanes.state.size):
        i = first + k
        lanes.decay[k], lanes.of_mass[k] = weights.decay[i], weights.of_mass[i]
        lanes.of_tilt[k], lanes.end[k] = weights.of_tilt[i], weights.end[i]
        lanes.beta[k] = weights.beta[i]
        lanes.slope[k], lanes.mu[k], lanes.passes[k] = weights.slope[i], 1.0, 1.0
        lanes.state[k] = SOLVING if weights.solvable[i] else LEFT


@inlined
def run_load(with_rest: bool, lanes: Lanes, curves: Curves) -> None:
    """Solve y' + beta y = beta (X + r) from y = 0 on, docs/method.md (70) and (72)."""
    decay, of_mass, of_tilt, mean = lanes.decay, lanes.of_mass, lanes.of_tilt, lanes.force
    first = curves.load[HALO]
    for k in range(mean.size):
        first[k] = mean[k] = 0.0
    for i in range(curves.drive.shape[0]):
        if with_rest:
            r0, r1, r2 = curves.rest[HALO + i - 2], curves.rest[HALO + i - 1], curves.rest[HALO + i]
            r3, r4 = curves.rest[HALO + i + 1], curves.rest[HALO + i + 2]
            r5 = curves.rest[HALO + i + 3]
            # The mean of r over the interval by six nodes, and its first moment by four.
            for k in range(mean.size):
                sums = 802.0 * (r2[k] + r3[k]) - 93.0 * (r1[k] + r4[k])
                mean[k] = of_mass[k] * (sums / 1440.0)
            for k in range(mean.size):
                mean[k] += of_mass[k] * ((r0[k] + r5[k]) * (11.0 / 1440.0))
            for k in range(mean.size):
                inner = r3[k] - r2[k]
                moment = inner / 12.0 - ((r4[k] - r1[k]) - 3.0 * inner) / 720.0
                mean[k] += of_tilt[k] * moment
        before, after, drive = curves.load[HALO + i], curves.load[HALO + i + 1], curves.drive[i]
        for k in range(mean.size):
            after[k] = decay[k] * before[k] + (drive[k] + mean[k])


@inlined
def close_period(variable: bool, lanes: Lanes, curves: Curves) -> None:
    """Add the start that makes y periodic, docs/method.md (74), and find u and its range."""
    nodes = curves.drive.shape[0]
    behind = curves.load[HALO + nodes]
    start, decay, high, low = lanes.start, lanes.decay, lanes.high, lanes.low
    for k in range(start.size):
        start[k] = behind[k] / lanes.end[k]
        high[k], low[k] = -1e300, 1e300
    for i in range(nodes):
        load, work, u = curves.load[HALO + i], curves.work[HALO + i], curves.u[HALO + i]
        for k in range(start.size):
            load[k] += start[k]
            start[k] *= decay[k]
        if variable:
            tau = curves.inertia[i]
            for k in range(start.size):
                u[k] = (work[k] - load[k]) / tau[k]
        else:
            for k in range(start.size):
                u[k] = work[k] - load[k]
        for k in range(start.size):
            high[k] = u[k] if u[k] > high[k] else high[k]
            low[k] = u[k] if u[k] < low[k] else low[k]


@inlined
def fill_rest(variable: bool, terms: int, law: Floats, lanes: Lanes, curves: Curves) -> None:
    """Remainder of the law at the nodes, docs/method.md (68), of lanes that go on; its change."""
    change, state, gain, shift = lanes.change, lanes.state, lanes.gain, lanes.shift
    centre, half, scaled, force = lanes.centre, lanes.half, lanes.scaled, lanes.force
    for k in range(change.size):
        change[k] = 0.0
        gain[k] = 1.0 / (lanes.mu[k] * lanes.slope[k])
        shift[k] = (1.0 - lanes.mu[k]) * gain[k]
    for i in range(curves.drive.shape[0]):
        u, rest = curves.u[HALO + i], curves.rest[HALO + i]
        for k in range(scaled.size):
            scaled[k] = (u[k] - centre[k]) * half[k]
        for k in range(scaled.size):
            force[k] = 0.0
        for n in range(terms - TERMS_AT_ONCE, -1, -TERMS_AT_ONCE):
            c0, c1, c2, c3 = law[n], law[n + 1], law[n + 2], law[n + 3]
            for k in range(scaled.size):
                t = scaled[k]
                force[k] = (((force[k] * t + c3[k]) * t + c2[k]) * t + c1[k]) * t + c0[k]
        if variable:
            work, load = curves.work[HALO + i], curves.load[HALO + i]
            for k in range(scaled.size):
                scaled[k] = work[k] - load[k]
            energy = scaled
        else:
            energy = u
        for k in range(scaled.size):
            force[k] = force[k] * gain[k] + shift[k] - energy[k]
        for k in range(scaled.size):
            old = rest[k]
            new = force[k] if state[k] > 0.0 else old
            moved = abs(new - old)
            change[k] = moved if moved > change[k] else change[k]
            rest[k] = new


@inlined
def repeat_ends(curve: Floats) -> None:
    """Repeat a curve before and behind the period."""
    nodes = curve.shape[0] - 2 * HALO
    for i in range(HALO):
        before, last = curve[i], curve[nodes + i]
        after, first = curve[HALO + nodes + i], curve[HALO + i]
        for k in range(before.size):
            before[k] = last[k]
        for k in range(before.size):
            after[k] = first[k]


@inlined
def fill_ones(curve: Floats) -> None:
    """Set a curve to 1."""
    for i in range(curve.shape[0]):
        here = curve[i]
        for k in range(here.size):
            here[k] = 1.0


@inlined
def add_missed(variable: bool, terms: int, law: Floats, lanes: Lanes, curves: Curves) -> None:
    """Add to the drive what six nodes of the remainder miss of its mean where X is rough.

    Over an interval r changes with X by F'/(s tau) - 1, which is smooth: docs/method.md (72).
    """
    half, slope, centre, state = lanes.half, lanes.slope, lanes.centre, lanes.state
    scaled, steep, gain = lanes.scaled, lanes.force, lanes.gain
    for k in range(gain.size):
        gain[k] = half[k] / slope[k]
    for i in range(curves.drive.shape[0]):
        u, found = curves.u[HALO + i], curves.steep[HALO + i]
        for k in range(scaled.size):
            scaled[k] = (u[k] - centre[k]) * half[k]
        for k in range(scaled.size):
            steep[k] = 0.0
        for n in range(terms - TERMS_AT_ONCE, -1, -TERMS_AT_ONCE):
            c0, c1, c2, c3 = law[n], law[n + 1], law[n + 2], law[n + 3]
            f0, f1, f2, f3 = float(n), n + 1.0, n + 2.0, n + 3.0
            if n > 0:
                for k in range(scaled.size):
                    t = scaled[k]
                    upper = (steep[k] * t + f3 * c3[k]) * t + f2 * c2[k]
                    steep[k] = (upper * t + f1 * c1[k]) * t + f0 * c0[k]
            else:
                for k in range(scaled.size):
                    t = scaled[k]
                    steep[k] = ((steep[k] * t + 3.0 * c3[k]) * t + 2.0 * c2[k]) * t + c1[k]
        for k in range(scaled.size):
            found[k] = steep[k] * gain[k] if state[k] > 0.0 else 1.0
        if variable:
            tau = curves.inertia[i]
            for k in range(scaled.size):
                found[k] /= tau[k]
    repeat_ends(curves.steep)
    of_mass = lanes.of_mass
    for i in range(curves.drive.shape[0]):
        here, after = curves.steep[HALO + i], curves.steep[HALO + i + 1]
        missed, drive = curves.missed[i], curves.drive[i]
        for k in range(scaled.size):
            drive[k] += of_mass[k] * (0.5 * (here[k] + after[k]) - 1.0) * missed[k]


@inlined
def begin_rest(
    first: int, linear: bool, closure: int, form: Form, designs: Designs, scratch: Scratch
) -> int:
    """Polynomials of the laws of a block; returns how many terms the longest has.

    Where the equation is linear if the law is proportional to q, such designs are done. A law that
    does not depend on the speed is that of the closure, docs/method.md (65) and (66).
    """
    lanes, longest = scratch.lanes, 0
    for k in range(lanes.state.size):
        i = first + k
        proportional = form.kind == POWER and designs.first[i] == 2.0
        if lanes.state[k] == SOLVING and linear and proportional:
            lanes.state[k] = SETTLED
        flat = lanes.slope[k] == 0.0
        lanes.free[k] = 0.0 if flat else 1.0
        if flat:
            lanes.slope[k] = 1.0
        if lanes.state[k] != SOLVING:
            continue
        law, _ = law_of(
            designs.speed[i], designs.first[i], designs.second[i], designs.gear[i], form
        )
        terms, lanes.centre[k], lanes.half[k] = fit_law(
            law, flat, closure, lanes.low[k], lanes.high[k], k, scratch.law, scratch.values
        )
        if terms == 0:
            lanes.state[k] = LEFT
        longest = max(longest, terms)
    rest = scratch.curves.rest
    for j in range(rest.shape[0]):
        here = rest[j]
        for k in range(here.size):
            here[k] = 0.0
    return longest


@inlined
def correct_mu(lanes: Lanes, curves: Curves) -> None:
    """Move the mean of F towards that at which the cycle takes its time, docs/method.md (77).

    `lanes.total` gets by how much.
    """
    nodes = curves.drive.shape[0]
    total = lanes.total
    for k in range(total.size):
        total[k] = 0.0
    for i in range(nodes):
        u, work = curves.u[HALO + i], curves.work[HALO + i]
        for k in range(total.size):
            # The mean of X is 0; what it is over the coarse nodes is taken away again.
            total[k] += 1.0 / math.sqrt(1.0 + u[k]) - 1.0 + 0.5 * work[k]
    for k in range(total.size):
        late = 2.0 * lanes.free[k] * lanes.slope[k] * total[k] / nodes
        total[k] = late if lanes.state[k] == SOLVING else 0.0
        lanes.mu[k] += total[k]


@inlined
def settle_lanes(tolerance: float, lanes: Lanes) -> bool:
    """End the lanes that changed little in the last pass, or left their range; whether any go on.

    What further passes would change is a fraction of the last change.
    """
    busy = False
    for k in range(lanes.state.size):
        if lanes.state[k] != SOLVING:
            continue
        lanes.passes[k] += 1.0
        span = lanes.high[k] - lanes.low[k]
        reach = max(lanes.high[k] - lanes.centre[k], lanes.centre[k] - lanes.low[k])
        if not (reach * lanes.half[k] <= 1.0 and span < 1e300):
            lanes.state[k] = LEFT
        elif lanes.change[k] <= tolerance * span + ROUNDING:
            lanes.state[k] = SETTLED
        else:
            busy = True
    return busy


@inlined
def leave_light(lanes: Lanes, curves: Curves) -> None:
    """Leave designs whose variable inertia falls too low somewhere to the general solver."""
    least = lanes.total
    for k in range(least.size):
        least[k] = 1.0
    for i in range(curves.inertia.shape[0]):
        tau = curves.inertia[i]
        for k in range(least.size):
            least[k] = min(least[k], tau[k])
    for k in range(least.size):
        if not (least[k] > LIGHTEST):
            lanes.state[k] = LEFT


@inlined
def solve_curves(
    first: int, variable: bool, closure: int, tolerance: float, form: Form, weights: Weights,
    designs: Designs, scratch: Scratch,
) -> None:  # fmt: skip
    """Solve a block, whose X is in `scratch`.

    Lanes end in the states `SETTLED` or `LEFT`. `tolerance` is the error that the passes may leave,
    over the range of u.
    """
    lanes, curves = scratch.lanes, scratch.curves
    begin_lanes(first, weights, lanes)
    if variable:
        leave_light(lanes, curves)
    timed, terms = closure == CYCLE_TIME, 0
    # Each function is called in one place, because the compiler copies it to each.
    for number in range(MOST_PASSES + 1):
        if number > 0:
            if timed:
                correct_mu(lanes, curves)
            fill_rest(variable, terms, scratch.law, lanes, curves)
            if timed:
                for k in range(lanes.change.size):
                    lanes.change[k] = max(lanes.change[k], abs(lanes.total[k]))
            repeat_ends(curves.rest)
        run_load(number > 0, lanes, curves)
        close_period(variable, lanes, curves)
        if number == 0:
            linear = not (variable or timed)
            terms = begin_rest(first, linear, closure, form, designs, scratch)
            if terms == 0:
                fill_ones(curves.steep)
                return
            add_missed(variable, terms, scratch.law, lanes, curves)
        elif not settle_lanes(tolerance, lanes):
            return
    for k in range(lanes.state.size):
        if lanes.state[k] == SOLVING:
            lanes.state[k] = LEFT
