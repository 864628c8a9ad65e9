"""What was found, as docs/stability/*.csv and figures; docs/measurements.md says what it means."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from benchmarks import tables
from benchmarks.stress import calibration, draw, driven, sample, sampled, spikes, weak
from benchmarks.stress.checks import CHECKS
from benchmarks.stress.chunks import Outcome
from benchmarks.stress.findings import DEFECTS, Findings
from engine_dyn.status import MEANINGS

OURS, EULER, REPEATED, POWER = "#0072B2", "#D55E00", "#882255", "#009E73"
"""Colours of Okabe and Ito."""

Rows = list[list[str]]


@dataclass(frozen=True)
class Measured:
    """Everything that one run found."""

    run: str  # the day, the machine, versions and the seed
    took: float
    outcome: Outcome
    agreement: Findings
    spiky: Findings
    light: Findings
    machines: Findings
    studies: list[sampled.Found]
    reading: calibration.Reading
    own_error: float
    weak: list[weak.Weak]
    drift: list[float]
    cure: float

    @property
    def parts(self) -> tuple[Findings, ...]:
        """Parts with verdicts."""
        return self.agreement, self.spiky, self.light, self.machines

    @property
    def defects(self) -> int:
        """Designs, chunks and bits that should not be."""
        o = self.outcome
        return (
            o.broken.total()
            + len(o.lost)
            + o.unlike.total()
            + sum(part.wrong for part in self.parts)
            + sum(found.defects for found in self.studies)
        )

    @property
    def examples(self) -> list[dict[str, Any]]:
        """Designs that are kept."""
        sources: list[Any] = [self.outcome, *self.parts, *self.studies, self.reading]
        return [example for source in sources for example in source.examples]


# Words --------------------------------------------------------------------------------------------


def count(number: int) -> str:
    """Digits in threes."""
    return f"{number:,}".replace(",", " ")


def share(part: int, whole: int) -> str:
    """Percent, small ones with their size."""
    percent = 100.0 * part / max(whole, 1)
    return "0" if part == 0 else f"{percent:.2f}" if percent >= 0.01 else f"{percent:.1g}"


def size(value: float) -> str:
    """An error's size."""
    return "0" if value == 0.0 else tables.small(value)


def cycles(value: float) -> str:
    """Cycles, or that they do not end."""
    return f"{value:.0f}" if math.isfinite(value) else "over 30000"


def summary(m: Measured) -> dict[str, str]:
    """Sentences with figures, by their names."""
    o, r, last = m.outcome, m.reading, m.weak[-1]
    _, covered, median, tail, _, _ = r.numbers()
    met = (
        covered >= calibration.COVERAGE and median <= calibration.MEDIAN
        and tail <= calibration.TAIL
    )  # fmt: skip
    bits = ", ".join(f"`{name}` of {count(n)}" for name, n in o.unlike.items()) or "none"
    growth, change = (
        getattr(last, name) / getattr(m.weak[0], name) for name in ("error_start", "error_mean")
    )
    largest = max((found.differences("delta")[0] for found in m.studies), default=math.nan)
    return {
        "run": f"{m.run}; {m.took / 60.0:.1f} minutes.",
        "absurd": f"{count(o.designs)} designs from absurd ranges: {len(o.lost)} hangs or crashes, "
        f"{count(o.broken.total())} broken rules.",
        "again": f"{count(o.compared)} of the absurd designs solved again, among other designs and "
        f"by one thread: {bits} differs in a bit.",
        "independent": f"{count(m.agreement.size)} of the absurd designs solved again by an "
        f"independent solver: {m.agreement.wrong} disagree.",
        "light": f"{count(m.light.size)} ordinary engines with light flywheels that the fast "
        f"kernels report as converged: {count(m.light.wrong)} beyond the tolerance.",
        "driven": f"{count(m.machines.size)} designs with motors, driver tables and loads over "
        f"speed and angle, compared with an integration in time: {count(m.machines.wrong)} wrong.",
        "sampled": f"{count(sum(found.status.total() for found in m.studies))} designs of sampled "
        "studies by `sweeps.run`, all solved again by the general solver: largest difference of δ "
        f"{size(largest)}, {count(sum(found.defects for found in m.studies))} defects.",
        "estimate": "`delta_error`: the true error is below the estimate for "
        f"{100.0 * covered:.2f} % of {count(len(r))} realistic designs; median of estimate over "
        f"error {median:.3g}, 95th percentile {tail:.3g}. Required: "
        f"{100.0 * calibration.COVERAGE:.1f} %, {calibration.MEDIAN:g} and {calibration.TAIL:g}: "
        f"{'met' if met else 'not met'}.",
        "weak": f"For a load so weak that repeated cycles would need {cycles(last.repetition)} "
        f"cycles, the solver needs {last.iterations} sweep{'s' * (last.iterations != 1)}.",
        "time": f"{count(o.designs)} designs in {o.seconds:.0f} s of kernel time, "
        f"{count(round(o.designs / max(o.seconds, 1e-9)))} a second. With the closure "
        "`cycle_time`, the load coefficient is solved for as well.",
        "closures": f"From 1 - ρ = {m.weak[0].weakness:g} to {last.weakness:.0e} the error of end "
        f"= start grows {growth:.0f}-fold, because a fixed error of the work in a cycle is divided "
        f"by 1 - ρ. The error of the power mean changes by a factor of {change:.2g}. A stop at a "
        f"difference of {weak.STOP:g} rad/s leaves an error of "
        f"{last.error_stop * weak.SPEED:.0e} rad/s there.",
        "own_error": "These are designs in realistic ranges with tabulated diagrams: "
        f"{calibration.CURVES} smooth curves in closed form at "
        f"{' and '.join(f'{s:g}' for s in calibration.STEPS)} degree, and the catalogue's engines. "
        "The true relative error of δ is the difference from the independent solver for the same "
        f"spline. That solver's own result changes by at most {size(m.own_error)} when its pieces "
        f"are halved. Errors below {calibration.FLOOR:g} count as that.",
        "shortfall": _shortfall(r),
    }


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


# Tables -------------------------------------------------------------------------------------------


def files(m: Measured) -> dict[str, Rows]:
    """Every table by the name of its file, heads first."""
    codes = sorted({status for status, _ in m.agreement.counts})
    return {
        "drawn": [["input", "range"], *_drawn()],
        "rules": [
            ["rule", "", "broken"],
            *([name, words, count(m.outcome.broken[name])] for name, words in CHECKS.items()),
        ],
        "independent": [
            ["verdict", "", *(MEANINGS[code] for code in codes)],
            *(
                [name, words, *(str(m.agreement.of(name, code)) for code in codes)]
                for name, words in sample.VERDICTS.items()
                if m.agreement.of(name) or name in DEFECTS
            ),
        ],
        "independent_differences": [
            ["quantity", "difference"],
            *([name, size(m.agreement.worst[name])] for name in sample.QUANTITIES),
        ],
        "spikes": [
            ["diagram", "made", "refused", "agree", "by a hair", "off", "largest difference"],
            *([kind, str(sum(numbers)), *map(str, numbers), size(m.spiky.worst.get(kind, 0.0))]
              for kind in spikes.KINDS
              for numbers in [[m.spiky.of(verdict, kind)
                               for verdict in ("refused", "agrees", "border", "off")]]),
        ],
        "light_flywheels": [
            ["inertia model", "load exponent", "both converged", "off", "largest difference"],
            *([*key, count(m.light.of("agrees", key) + m.light.of("off", key)),
               count(m.light.of("off", key)), size(worst)]
              for key, worst in m.light.worst.items()),
        ],
        "euler_cycles": [
            ["cycles of Euler", "ω_mean (rad/s)"],
            *([str(n), f"{mean:.2f}"] for n, mean in zip(weak.DRIFT, m.drift, strict=True)),
        ],
        "repeated_cycles": [
            ["1 - ρ", "cycles of Euler", "its error of ω_mean", "cycles of an exact repetition",
             "sweeps of the solver"],
            *([f"{w.weakness:.1e}", cycles(w.euler), size(w.error_euler), cycles(w.repetition),
               str(w.iterations)] for w in m.weak),
        ],
        "closures": [
            ["1 - ρ", "1/(1 - ρ)", "stopped", "end = start", "power mean"],
            *([f"{w.weakness:.1e}", f"{1.0 / w.weakness:.0f}",
               *map(size, (w.error_stop, w.error_start, w.error_mean))] for w in m.weak[::2]),
        ],
        "error_ranges": [["input", "range"], *map(list, calibration.RANGES.items())],
        "error_estimate": [
            ["designs", "number", "true error ≤ estimate, %", "median of estimate/error",
             "95th percentile", "median true error", "largest"],
            *_estimates(m.reading),
        ],
        **_outcomes(m.outcome), **_driven(m.machines), **_sampled(m.studies),
        "examples": [["part", "what", "design"], *_examples(m)],
    }  # fmt: skip


def _drawn() -> Rows:
    return [
        *([name, f"{low:g} to {high:g} {unit}".strip()]
          for name, (low, high, unit) in draw.RANGES.items()),
        ["cylinders", "1 to 16"],
        ["load exponent", "0, 1, 2; these but for 1e-15 to 1e-2; 1e-12 to 1; any from 0 to 10"],
        ["mean torque less offset", "the mean torque (no offset); 1e-13 to 1 of it; nothing; less "
         "than nothing; about the idle limit; up to 100 times it (negative offset)"],
        ["friction", "none; up to 90 % of the indicated torque; up to 100 times it"],
        ["crankcase pressure", "0 and 1.01325 bar"],
        ["diagram", f"engine {draw.ENGINE}: both ends of its loads, and between"],
        ["inertia model, closure", "both of each"],
    ]  # fmt: skip


def _outcomes(o: Outcome) -> dict[str, Rows]:
    kinds = sorted({(closure, model) for closure, model, _ in o.parts})
    body = [
        [f"{code} {MEANINGS[code]}", count(o.status[code]), share(o.status[code], o.designs),
         *(count(o.parts[closure, model, code]) for closure, model in kinds)]
        for code in sorted(o.status)
    ]  # fmt: skip
    heads = [f"{closure}, {model}" for closure, model in kinds]
    return {"outcomes": [["status", "designs", "%", *heads], *body]}


def _driven(found: Findings) -> dict[str, Rows]:
    codes = sorted({code for (_, code), _ in found.counts})
    names = [name for name in driven.VERDICTS if found.of(name)]
    outcomes = [["law", "designs", *(f"{code} {MEANINGS[code]}" for code in codes)]]
    verdicts = [["law", *names, "largest difference", "stiffest that agrees"]]
    for law in driven.LAWS:
        of_law = {key: n for key, n in found.counts.items() if key[0][0] == law}
        numbers = [sum(n for (row, _), n in of_law.items() if row[1] == code) for code in codes]
        outcomes.append([law, *map(count, (sum(numbers), *numbers))])
        numbers = [sum(n for (_, verdict), n in of_law.items() if verdict == v) for v in names]
        stiffest = found.worst.get((law, "stiffest"), 0.0)
        verdicts.append(
            [law, *map(count, numbers), size(found.worst.get(law, 0.0)), f"{stiffest:.3g}"]
        )
    return {"driven_outcomes": outcomes, "driven": verdicts}


def _sampled(studies: list[sampled.Found]) -> dict[str, Rows]:
    codes = (0, 1, 2, 3, 5)
    outcomes = [["sampled", "designs", *(f"{code} {MEANINGS[code]}, %" for code in codes),
                 "deferred, %", "broken rules"]]  # fmt: skip
    differences = [["sampled", "δ: largest", "99.9 %", "median", "speeds: largest", "99.9 %",
                    "median", "off", "another outcome", "border"]]  # fmt: skip
    again = [["sampled", "again", "other bits", "with delta_error", "below it, %", "independent",
              "δ", "speeds"]]  # fmt: skip
    for found in studies:
        words, designs = found.kind.words, found.status.total()
        outcomes.append([
            words, count(designs), *(share(found.status[code], designs) for code in codes),
            share(found.deferred, found.solved), str(found.broken.total()),
        ])  # fmt: skip
        differences.append([
            words, *map(size, found.differences("delta")), *map(size, found.differences("speeds")),
            *(count(found.verdicts[v]) for v in ("off", "outcome", "border")),
        ])  # fmt: skip
        again.append([
            words, count(found.compared), str(found.unlike.total()), count(found.estimated),
            f"{100.0 * found.covered / max(found.estimated, 1):.3f}", str(found.exact),
            size(found.exact_delta), size(found.exact_speeds),
        ])  # fmt: skip
    return {
        "sampled_outcomes": outcomes, "sampled_differences": differences, "sampled_again": again
    }  # fmt: skip


def _estimates(r: calibration.Reading) -> Iterator[list[str]]:
    for name, mask in r.groups().items():
        if mask.any():
            number, covered, median, tail, typical, worst = r.numbers(mask)
            yield [name, count(number), f"{100.0 * covered:.2f}", f"{median:.3g}",
                   f"{tail:.3g}", size(typical), size(worst)]  # fmt: skip


def _examples(m: Measured) -> Iterator[list[str]]:
    """Designs that should not be, a few of each kind, and the worst of the sampled ones."""
    for found in m.studies:
        for name, (value, inputs) in found.worst.items():
            words = f"{found.kind.words}, {name}, {size(value)}"
            yield ["Sampled studies", words, json.dumps(inputs)]
    for part, key, examples in (
        ("Rules", "rule", m.outcome.examples),
        ("Against an independent solver", "verdict", m.agreement.examples),
        ("Diagrams with a spike, with noise, with steps", "diagram", m.spiky.examples),
        ("Light flywheels", "inertia_model", m.light.examples),
        ("Motors, drivers and loads over speed and angle", "verdict", m.machines.examples),
        ("Sampled studies", "defect", [e for found in m.studies for e in found.examples]),
    ):
        chosen = [e for e in examples if key != "verdict" or e[key] in DEFECTS]
        for kind in sorted({e[key] for e in chosen}):
            for e in [e for e in chosen if e[key] == kind][:SHOWN]:
                yield [part, kind, json.dumps({k: v for k, v in e.items() if k != key})]


SHOWN = 4
"""Designs of a kind that are shown."""


def write(m: Measured, folder: Path) -> None:
    """Files and figures below `folder`."""
    for name, (head, *body) in files(m).items():
        tables.save(folder / "stability" / f"{name}.csv", head, body)
    words = map(list, summary(m).items())
    tables.save(folder / "stability" / "summary.csv", ["what", "words"], words, marks=True)
    (folder / "figures").mkdir(parents=True, exist_ok=True)
    for name, figure in (("weak", draw_weak(m)), ("error", draw_error(m))):
        path = folder / "figures" / f"stability_{name}.png"
        figure.savefig(path, dpi=160, metadata={"Software": None})


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
