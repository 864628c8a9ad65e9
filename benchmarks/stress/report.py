"""The report of everything that was measured, and its figures."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from benchmarks.stress import calibration, draw, driven, sample, sampled, spikes, strong, weak
from benchmarks.stress.checks import CHECKS
from benchmarks.stress.chunks import Outcome
from engine_dyn.status import MEANINGS

OURS, EULER, REPEATED, POWER = "#0072B2", "#D55E00", "#882255", "#009E73"
"""Colours of Okabe and Ito."""


@dataclass(frozen=True)
class Measured:
    """Everything that one run found."""

    when: str
    machine: str
    versions: str
    seed: int
    took: float
    outcome: Outcome
    agreement: sample.Agreement
    spiky: spikes.Spiky
    light: strong.Strong
    machines: driven.Driven
    studies: list[sampled.Found]
    reading: calibration.Reading
    own_error: float
    weak: list[weak.Weak]
    drift: list[float]
    cure: float

    @property
    def defects(self) -> int:
        """Designs, chunks and bits that should not be."""
        o = self.outcome
        wrong = sum(self.agreement.of(name) for name in sample.DEFECTS)
        return (
            sum(o.broken.values())
            + len(o.lost)
            + o.unlike.total()
            + wrong
            + (self.spiky.wrong + self.light.wrong + self.machines.wrong)
            + sum(found.defects for found in self.studies)
        )


# Text ---------------------------------------------------------------------------------------------


def rows(head: Sequence[str], body: Sequence[Sequence[str]], left: int = 1) -> list[str]:
    """A table: the first columns to the left, numbers to the right."""
    lines = ["---"] * left + ["---:"] * (len(head) - left)
    return [f"| {' | '.join(cells)} |" for cells in (head, lines, *body)]


def count(number: int) -> str:
    """Digits in threes."""
    return f"{number:,}".replace(",", " ")


def share(part: int, whole: int) -> str:
    """Percent, small ones with their size."""
    percent = 100.0 * part / max(whole, 1)
    return "0" if part == 0 else f"{percent:.2f}" if percent >= 0.01 else f"{percent:.1g}"


def size(value: float) -> str:
    """An error's size."""
    return "0" if value == 0.0 else "-" if not math.isfinite(value) else f"{value:.1e}"


def cycles(value: float) -> str:
    """Cycles, or that they do not end."""
    return f"{value:.0f}" if math.isfinite(value) else "over 30000"


def document(m: Measured) -> str:
    """The report: a page that stands by itself, of which `tables` makes files."""
    parts = [
        *_head(m), *_draws(), *_outcomes(m), *_rules(m), *_agreement(m), *_spikes(m), *_light(m),
        *_driven(m), *_sampled(m), *_repetition(m), *_closures(m), *_errors(m),
    ]  # fmt: skip
    return "\n".join(parts).rstrip() + "\n"


def _head(m: Measured) -> list[str]:
    o, a, r = m.outcome, m.agreement, m.reading
    wrong = sum(a.of(name) for name in sample.DEFECTS)
    _, covered, median, tail, _, _ = r.numbers()
    met = (
        covered >= calibration.COVERAGE and median <= calibration.MEDIAN
        and tail <= calibration.TAIL
    )  # fmt: skip
    return [
        "# Numerical stability",
        "",
        "Made by make stress (python -m benchmarks.stress).",
        "",
        f"{m.when}; {m.machine}; {m.versions}; seed {m.seed}; {m.took / 60.0:.1f} minutes.",
        "",
        "In short:",
        "",
        f"- {count(o.designs)} designs from absurd ranges: {len(o.lost)} hangs or crashes, "
        f"{count(sum(o.broken.values()))} broken rules.",
        f"- {count(o.compared)} of the absurd designs solved again, among other designs and by one "
        f"thread: "
        + (", ".join(f"`{name}` of {count(n)}" for name, n in o.unlike.items()) or "none")
        + " differs in a bit.",
        f"- {count(a.size)} of the absurd designs solved again by an independent solver: {wrong} "
        f"disagree.",
        f"- {count(sum(m.light.compared.values()))} ordinary engines with light flywheels that "
        f"the fast kernels report as "
        f"converged: {count(m.light.wrong)} beyond the tolerance.",
        f"- {count(m.machines.size)} designs with motors, driver tables and loads over speed and "
        f"angle, compared with an integration in time: {count(m.machines.wrong)} wrong.",
        *_sampled_in_short(m),
        f"- `delta_error`: the true error is below the estimate for {100.0 * covered:.2f} % of "
        f"{count(len(r))} realistic designs; median of estimate over error {median:.3g}, 95th "
        f"percentile {tail:.3g}. Required: {100.0 * calibration.COVERAGE:.1f} %, "
        f"{calibration.MEDIAN:g} and {calibration.TAIL:g}: {'met' if met else 'not met'}.",
        f"- For a load so weak that repeated cycles would need {cycles(m.weak[-1].repetition)} "
        f"cycles, the solver needs {m.weak[-1].iterations} sweep"
        f"{'s' if m.weak[-1].iterations != 1 else ''}.",
        "",
    ]


def _draws() -> list[str]:
    ranges = [[name, f"{low:g} to {high:g} {unit}".strip()]
              for name, (low, high, unit) in draw.RANGES.items()]  # fmt: skip
    ranges += [
        ["cylinders", "1 to 16"],
        ["load exponent", "0, 1, 2; these but for 1e-15 to 1e-2; 1e-12 to 1; any from 0 to 10"],
        ["mean torque less offset", "the mean torque (no offset); 1e-13 to 1 of it; nothing; less "
         "than nothing; about the idle limit; up to 100 times it (negative offset)"],
        ["friction", "none; up to 90 % of the indicated torque; up to 100 times it"],
        ["crankcase pressure", "0 and 1.01325 bar"],
        ["diagram", f"engine `{draw.ENGINE}`: both ends of its loads, and between"],
        ["inertia model, closure", "both of each"],
    ]  # fmt: skip
    return [
        "## What was drawn",
        "",
        *rows(["input", "range"], ranges, 2),
        "",
        "Values are drawn uniformly in the logarithm; half of the crank ratios are "
        "drawn uniformly in the value itself. In every second chunk of designs, "
        "inertia and masses follow from an energy swing of 1e-3 to 10 times the "
        "kinetic energy, so that many designs nearly stall. Of eight chunks, one is a "
        "full factorial. One, an eighth of the size, has designs that share nothing, "
        "with `delta_error`. In the others, each of 16 crank ratios with its diagram, "
        "crankcase pressure and number of cylinders is shared by many designs, and "
        "everything else is drawn for each design.",
        "",
    ]


def _outcomes(m: Measured) -> list[str]:
    o = m.outcome
    kinds = sorted({(closure, model) for closure, model, _ in o.parts})
    body = [
        [f"{code} {MEANINGS[code]}", count(o.status[code]), share(o.status[code], o.designs),
         *(count(o.parts[closure, model, code]) for closure, model in kinds)]
        for code in sorted(o.status)
    ]  # fmt: skip
    heads = [f"{closure}, {model}" for closure, model in kinds]
    rate = o.designs / max(o.seconds, 1e-9)
    return [
        "## Outcomes",
        "",
        f"{count(o.designs)} designs in {o.seconds:.0f} s of kernel time, {count(round(rate))} a "
        "second. With the closure `cycle_time`, the load coefficient is solved for as "
        "well.",
        "",
        *rows(["status", "designs", "%", *heads], body),
        "",
        *(f"- {line}" for line in o.lost),
        *([""] if o.lost else []),
    ]


def _rules(m: Measured) -> list[str]:
    body = [
        [name, meaning, count(m.outcome.broken.get(name, 0))] for name, meaning in CHECKS.items()
    ]
    lines = [
        "## Rules",
        "",
        "Every true answer satisfies these rules. They are checked for every design "
        "by formulas that share no code with the kernels:",
        "",
        *rows(["rule", "", "broken"], body, 2),
        "",
    ]
    return lines + _examples([e for e in m.outcome.examples if "rule" in e], "rule")


def _examples(found: list[dict[str, Any]], key: str, most: int = 3) -> list[str]:
    """Some designs with their inputs, a few of each kind."""
    lines: list[str] = []
    for kind in sorted({e[key] for e in found}):
        for e in [e for e in found if e[key] == kind][:most]:
            known = {k: v for k, v in e.items() if k != key}
            lines.append(f"- {kind}: `{json.dumps(known)}`")
    return [*lines, ""] if lines else []


def _agreement(m: Measured) -> list[str]:
    a = m.agreement
    codes = sorted({code for code, _ in a.verdicts})
    body = [
        [name, meaning, *(str(a.verdicts[code, name]) for code in codes)]
        for name, meaning in sample.VERDICTS.items()
        if a.of(name) or name in sample.DEFECTS
    ]
    worst = [[f"`{name}`", size(value)] for name, value in a.worst.items()]
    return [
        "## Against an independent solver",
        "",
        "The designs are picked so that every status, kind of exponent, weakness of "
        "load, inertia model and size of δ is about equally frequent. The independent "
        "solver (oracle/spline.py) integrates the same spline piece by piece with "
        "formulas of order 7 that stay stable for stiff loads. It continues the "
        "solution below standstill, where exactly one always exists; the design "
        "stalls if this solution falls below zero.",
        "",
        *rows(["verdict", "", *(MEANINGS[code] for code in codes)], body, 2),
        "",
        "Largest relative differences where the status is converged and the verdict *agrees*:",
        "",
        *rows(["quantity", "difference"], worst),
        "",
        *_examples([e for e in a.examples if e["verdict"] in sample.DEFECTS], "verdict", 4),
    ]


def _spikes(m: Measured) -> list[str]:
    s = m.spiky
    body = [
        [name, str(s.asked[name]), str(s.refused[name]), str(s.agree[name]), str(s.border[name]),
         str(s.off[name]), size(s.worst[name])]
        for name in s.asked
    ]  # fmt: skip
    return [
        "## Diagrams with a spike, with noise, with steps",
        "",
        f"Through `engine_dyn.periodic_speed`, at 0.5 to 2 degrees, on the diagrams of "
        f"`{draw.ENGINE}`. "
        "The checks of pressure diagrams refuse some of them, as they should. "
        "Differences are those between δ and the δ of the independent solver for the "
        "same spline.",
        "",
        *rows(["diagram", "made", "refused", "agree", "by a hair", "off", "largest difference"],
              body),
        "",
        *_examples(s.examples, "diagram"),
    ]  # fmt: skip


def _light(m: Measured) -> list[str]:
    s = m.light
    body = [
        [*key, count(s.compared[key]), count(s.off[key]), size(s.worst[key])] for key in s.compared
    ]
    return [
        "## Light flywheels",
        "",
        "Ordinary engines of 1 to 8 cylinders with inertias from large to almost "
        "none, half of them in full factorials and half as designs that share "
        "nothing, without `delta_error`. Designs that the fast kernels report as "
        "converged are compared with the general solver with four times as many "
        "nodes. Off: δ, ω_max, ω_min or ω_mean differs by more than the tolerance, "
        f"{sample.TOLERANCE:g}.",
        "",
        *rows(["inertia model", "load exponent", "both converged", "off", "largest difference"],
              body, 2),
        "",
        *_examples(s.examples, "inertia_model"),
    ]  # fmt: skip


def _driven(m: Measured) -> list[str]:
    d = m.machines
    codes = sorted({code for _, code in d.status})
    names = [name for name in driven.VERDICTS if any(v == name for _, v in d.verdicts)]
    outcomes, verdicts = [], []
    for law in driven.LAWS:
        of_law = [d.status[law, code] for code in codes]
        outcomes.append([law, count(sum(of_law)), *map(count, of_law)])
        verdicts.append(
            [law, *(count(d.verdicts[law, name]) for name in names), size(d.worst.get(law, 0.0)),
             f"{d.stiffest.get(law, 0.0):.3g}"]
        )  # fmt: skip
    return [
        "## Motors, drivers and loads over speed and angle",
        "",
        "The designs have motors of any slip, driving or braking; driver and load "
        "tables of up to ten points over the speed of the crank or of their own "
        "shaft; loads with a linear and a quadratic part; and power laws. A third of "
        "them have a load over the angle of its own shaft, at four gear ratios. They "
        "have one to six cylinders, fired or motored, both inertia models and "
        "closures, and flywheels from heavy to almost none. Each is integrated in "
        "time with SciPy (oracle/in_time.py). A solution that was found must repeat "
        "there. Where none was found, cycles from the nominal speed and from above it "
        "must end at standstill or run away.",
        "",
        *rows(["law", "designs", *(f"{code} {MEANINGS[code]}" for code in codes)], outcomes),
        "",
        *(f"- *{name}*: {driven.VERDICTS[name]}." for name in names),
        "",
        "The last column, s, is the stiffness: within a cycle a deviation of the "
        "speed shrinks by the factor exp(-s).",
        "",
        *rows(["law", *names, "largest difference", "stiffest that agrees"], verdicts),
        "",
        *_examples([e for e in d.examples if e["verdict"] in driven.DEFECTS], "verdict"),
    ]


def _sampled_in_short(m: Measured) -> list[str]:
    if not m.studies:
        return []
    solved = sum(found.status.total() for found in m.studies)
    worst = max(found.differences("delta")[0] for found in m.studies)
    wrong = sum(found.defects for found in m.studies)
    return [
        f"- {count(solved)} designs of sampled studies by `sweeps.run`, all solved again by the "
        f"general "
        f"solver: largest difference of δ {size(worst)}, {count(wrong)} defects."
    ]


def _sampled(m: Measured) -> list[str]:
    if not m.studies:
        return []
    outcomes, differences, others = [], [], []
    for found in m.studies:
        words, designs = found.kind.words, found.status.total()
        codes = [share(found.status[code], designs) for code in (0, 1, 2, 3, 5)]
        outcomes.append([words, count(designs), *codes, share(found.deferred, found.solved),
                         str(found.broken.total())])  # fmt: skip
        differences.append([words, *map(size, found.differences("delta")),
                            *map(size, found.differences("speeds")),
                            *(count(found.verdicts[v]) for v in ("off", "outcome", "border"))]
                           )  # fmt: skip
        covered = 100.0 * found.covered / max(found.estimated, 1)
        others.append([words, count(found.compared), str(found.unlike.total()),
                       count(found.estimated), f"{covered:.3f}", str(found.exact),
                       size(found.exact_delta), size(found.exact_speeds)])  # fmt: skip
    worst = [
        f"- {found.kind.words}, {name}, {size(value)}: `{json.dumps(inputs)}`"
        for found in m.studies
        for name, (value, inputs) in found.worst.items()
    ]
    return [
        "## Sampled studies",
        "",
        "These are the parameters that people sample, over ranges twice as wide as in "
        "the benchmarks as far as the engine has diagrams: "
        + "; ".join(f"{name} {low:g} to {high:g}" for name, (low, high) in sampled.WIDE.items())
        + " (*the six*); offsets of pin or crank of either sign, up to half the crank "
        "radius. Each study is solved as a scene. The table gives the percentage of "
        "designs with each status, and of those that the batch solver passed on to "
        "the general solver (deferred). The rules are those of the list above that "
        "need only the results, and two more: the mean speed fits the required one, "
        "and status 2 is given exactly where the mean torque is below the constant "
        "part of the load.",
        "",
        *rows(["sampled", "designs", *(f"{code} {MEANINGS[code]}, %" for code in (0, 1, 2, 3, 5)),
               "deferred, %", "broken rules"], outcomes),
        "",
        "All of these designs were solved again by the general solver with "
        f"{sampled.FINER} times the nodes, which solves them one by one at the fine nodes. "
        "The table gives relative differences of δ and of the three speeds "
        f"where the status is converged. Off: beyond {sample.TOLERANCE:g}; border: at the limit "
        "between running and stalling.",
        "",
        *rows(["sampled", "δ: largest", "99.9 %", "median", "speeds: largest", "99.9 %", "median",
               "off", "another outcome", "border"], differences),
        "",
        "The designs with the largest differences:",
        "",
        *worst,
        "",
        "Some of the designs were solved again in another order, among other designs "
        "and by one thread; the column *other bits* counts those whose results differ "
        "in a bit. Some were solved again with `delta_error`: the table gives how "
        "often the true error, which is the difference from the general solver, is "
        f"below the estimate; required: {100.0 * sampled.COVERED:.1f} %. "
        "And some were solved by an independent solver, with the largest differences "
        "in the last columns (oracle/spline.py; or oracle/solution.py, which is made "
        "for smooth curves and differs by about 1e-8; friction over the stroke only "
        "with one and two cylinders).",
        "",
        *rows(["sampled", "again", "other bits", "with `delta_error`", "below it, %", "independent",
               "δ", "speeds"], others),
        "",
        *_examples([e for found in m.studies for e in found.examples], "defect"),
    ]  # fmt: skip


def _repetition(m: Measured) -> list[str]:
    drift = [[str(n), f"{mean:.2f}"] for n, mean in zip(weak.DRIFT, m.drift, strict=True)]
    body = [
        [f"{w.weakness:.1e}", cycles(w.euler), size(w.error_euler), cycles(w.repetition),
         str(w.iterations)]
        for w in m.weak
    ]  # fmt: skip
    return [
        "## Repeating cycles",
        "",
        "With a constant load torque (load exponent 0), explicit Euler at one degree "
        "never closes a cycle: each step adds energy, and nothing takes it away. The "
        f"periodic solution fixes the mean speed by its closure instead: {m.cure:.2f} rad/s.",
        "",
        *rows(["cycles of Euler", "ω_mean (rad/s)"], drift),
        "",
        f"With load exponent 2, a deviation shrinks by the factor ρ in each cycle. The "
        "weaker the load, the more cycles are needed until the speeds at the two ends "
        "of a cycle agree within "
        f"{weak.STOP:g} rad/s (Euler; stopped after 30000 cycles), or until {weak.LEFT:g} of the "
        "deviation is left (any repetition that is exact). Euler's false energy then also shifts "
        "the speed more. The solver needs the same few sweeps for every load.",
        "",
        *rows(["1 - ρ", "cycles of Euler", "its error of ω_mean", "cycles of an exact repetition",
               "sweeps of the solver"], body),
        "",
    ]  # fmt: skip


def _closures(m: Measured) -> list[str]:
    body = [
        [f"{w.weakness:.1e}", f"{1.0 / w.weakness:.0f}", size(w.error_stop), size(w.error_start),
         size(w.error_mean)]
        for w in m.weak[::2]
    ]  # fmt: skip
    first, last = m.weak[0], m.weak[-1]
    return [
        "## Which closure keeps its digits",
        "",
        "The same engine is integrated by a Runge-Kutta formula of order 4 at one "
        "degree and closed in three ways; the table gives relative errors of ω_mean. "
        "*Stopped*: cycles are repeated until |ω_end - ω_start| "
        f"< {weak.STOP:g} rad/s; the error is the difference from the integration's own periodic "
        "solution. *End = start*: that periodic solution, found exactly. *Power "
        "mean*: the initial speed for which the mean of ω² is ω_n².",
        "",
        *rows(["1 - ρ", "1/(1 - ρ)", "stopped", "end = start", "power mean"], body),
        "",
        f"From 1 - ρ = {first.weakness:g} to {last.weakness:.0e} the error of end = start grows "
        f"{last.error_start / first.error_start:.0f}-fold, because a fixed error of the work in a "
        f"cycle is divided by 1 - ρ. The "
        "error of the power mean changes by a factor of "
        f"{last.error_mean / first.error_mean:.2g}. A stop at a difference of "
        f"{weak.STOP:g} rad/s leaves an error of {last.error_stop * weak.SPEED:.0e} rad/s there.",
        "",
    ]


def _errors(m: Measured) -> list[str]:
    r = m.reading
    ranges = [[name, text] for name, text in calibration.RANGES.items()]
    body = []
    for name, mask in r.groups().items():
        if mask.any():
            number, covered, median, tail, typical, worst = r.numbers(mask)
            body.append([name, count(number), f"{100.0 * covered:.2f}", f"{median:.3g}",
                         f"{tail:.3g}", size(typical), size(worst)])  # fmt: skip
    return [
        "## How reliable is `delta_error`?",
        "",
        "These are designs in realistic ranges with tabulated diagrams: "
        f"{calibration.CURVES} smooth curves in closed form at "
        f"{' and '.join(f'{s:g}' for s in calibration.STEPS)} degree, and the catalogue's engines. "
        "The true relative error of δ is the difference from the independent solver "
        f"for the same spline. That solver's own result changes by at most {size(m.own_error)} "
        f"when its pieces are halved. Errors below {calibration.FLOOR:g} count as that.",
        "",
        *rows(["input", "range"], ranges, 2),
        "",
        *rows(["designs", "number", "true error ≤ estimate, %", "median of estimate/error",
               "95th percentile", "median true error", "largest"], body),
        "",
        _shortfall(r),
        "",
    ]  # fmt: skip


def _shortfall(r: calibration.Reading) -> str:
    """By how much the estimate falls short where it does."""
    short = r.true > r.estimate
    if not short.any():
        return "No true error is above its estimate."
    factor = r.true[short] / np.maximum(r.estimate[short], 1e-300)
    return (
        f"Where the true error is above the estimate ({count(int(short.sum()))} designs) it "
        f"exceeds it by a factor of {np.median(factor):.2g} (median) to {factor.max():.2g}."
    )


# Figures ------------------------------------------------------------------------------------------


def _axes(ax: Any) -> None:
    ax.spines[["top", "right"]].set_visible(False)
    ax.grid(color="0.9", linewidth=0.7)
    ax.set_axisbelow(True)
    ax.xaxis.set_major_locator(LogLocator(numticks=12))
    ax.yaxis.set_major_locator(LogLocator(numticks=12))
    ax.minorticks_off()


def draw_weak(m: Measured) -> Figure:
    """Cycles, and errors of the mean speed, against the weakness of the load."""
    figure = Figure(figsize=(7.4, 3.6), layout="constrained")
    FigureCanvasAgg(figure)
    left, right = figure.subplots(1, 2, sharex=True)
    x = [w.weakness for w in m.weak]
    for name, values, colour, marker in (
        ("explicit Euler, 1°", [w.euler for w in m.weak], EULER, "v"),
        ("exact repetition", [w.repetition for w in m.weak], REPEATED, "^"),
        ("periodic solution", [w.iterations for w in m.weak], OURS, "o"),
    ):
        left.plot(x, values, color=colour, marker=marker, markersize=4.5, linewidth=1.4, label=name)
    left.axhline(30000.0, color="0.5", linewidth=0.8, linestyle=":")
    left.annotate("given up", (x[0], 30000.0), (0.0, 3.0), textcoords="offset points",
                  fontsize=8, color="0.35", ha="left")  # fmt: skip
    left.set(xscale="log", yscale="log", ylabel="cycles or sweeps", ylim=(0.5, 2e5))
    left.set_title("a  Until the cycle closes", loc="left", fontsize=10)
    for name, values, colour, marker in (
        ("explicit Euler, 1°", [w.error_euler for w in m.weak], EULER, "v"),
        ("stopped at 1e-6 rad/s", [w.error_stop for w in m.weak], REPEATED, "^"),
        ("end = start", [w.error_start for w in m.weak], "#E69F00", "s"),
        ("power mean", [w.error_mean for w in m.weak], POWER, "o"),
    ):
        right.plot(x, values, color=colour, marker=marker, markersize=4.5, linewidth=1.4,
                   label=name)  # fmt: skip
    right.set(yscale="log", ylabel="relative error of $\\omega_m$", ylim=(1e-13, 30.0))
    right.set_title("b  What it costs in digits", loc="left", fontsize=10)
    for ax in (left, right):
        _axes(ax)
        ax.set_xlabel("weakness of the load, 1 - ρ")
    left.invert_xaxis()
    left.legend(frameon=False, fontsize=8, loc="center left", bbox_to_anchor=(0.0, 0.28))
    right.legend(frameon=False, fontsize=8, loc="upper left", ncols=2, columnspacing=1.0)
    return figure


def draw_error(m: Measured) -> Figure:
    """Estimates against true errors."""
    r = m.reading
    figure = Figure(figsize=(5.2, 4.4), layout="constrained")
    FigureCanvasAgg(figure)
    ax = figure.subplots()
    # What is smaller is drawn at the edge.
    least, most = 1e-14, 1e-4
    true, estimate = (np.clip(v, least, most) for v in (r.true, r.estimate))
    for name, mask, colour, marker in (
        ("smooth curves", np.char.startswith(r.diagram, "smooth"), OURS, "o"),
        ("engines", np.char.startswith(r.diagram, "engine"), EULER, "^"),
    ):
        ax.plot(
            true[mask], estimate[mask], linestyle="none", marker=marker, markersize=2.2,
            color=colour, alpha=0.45, markeredgewidth=0.0, label=name,
        )  # fmt: skip
    line = np.array([least, most])
    ax.plot(line, line, color="black", linewidth=1.0)
    ax.plot(line, 100.0 * line, color="0.4", linewidth=0.9, linestyle="--")
    for factor, words in ((1.0, "error = estimate"), (100.0, "a hundredth of it")):
        ax.annotate(words, (4e-6 / factor**0.5, 4e-6 * factor**0.5), (0.0, 4.0), rotation=45.0,
                    textcoords="offset points", ha="right", va="bottom", fontsize=8,
                    rotation_mode="anchor", transform_rotates_text=True)  # fmt: skip
    ax.axvline(calibration.FLOOR, color="0.5", linewidth=0.8, linestyle=":")
    ax.set(xscale="log", yscale="log", xlabel="true relative error of δ", ylabel="`delta_error`",
           xlim=(0.7 * least, most), ylim=(0.7 * least, most))  # fmt: skip
    ax.set_ylabel("delta_error")
    _axes(ax)
    ax.legend(frameon=False, loc="lower right", fontsize=8.5, markerscale=2.5)
    return figure


def draw_all(m: Measured, folder: Path) -> None:
    """Figures below `folder`."""
    (folder / "figures").mkdir(parents=True, exist_ok=True)
    for name, figure in (("weak", draw_weak(m)), ("error", draw_error(m))):
        path = folder / "figures" / f"stability_{name}.png"
        figure.savefig(path, dpi=160, metadata={"Software": None})
