"""Layered impact (Zisis 2013): every case beside its exact solution, convergence, and figures 3 to 8.

    python benchmarks/layered.py [--figures docs/layered] [--runs FOLDER] [--quick]

Prints plateaus, arrivals, mean differences and overshoots as they are measured, and draws the figures of
the paper, computed beside exact. `--quick` leaves out the convergence study and the other kernels.
"""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
from pathlib import Path

import numpy as np

from hvisph.casefile.loader import load_case
from hvisph.output.reader import list_snapshots, read_history, read_snapshot
from hvisph.postprocessing.exact_solution import ExactSolution, exact_solution
from hvisph.simulation.run import run
from hvisph.visualization.curves import Curve, curves_picture, steps

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from gauge_beside_exact import Comparison, compare_gauge

FOLDER = "published/layered/"
SETS = ("test", "al_glass_al", "al_carbon_al", "st_glass_st", "st_carbon_st")
KERNELS = ("cubic_spline", "quadratic", "quartic_spline", "quintic_spline", "wendland_c2", "wendland_c4")
LABELS = {"test": "test", "al_glass_al": "Al-glass-Al", "al_carbon_al": "Al-carbon-Al",
          "st_glass_st": "St-glass-St", "st_carbon_st": "St-carbon-St"}  # fmt: skip
OTHER_FORM = {  # the rate of density that a set-up does not take: eq. 12 is `volume`
    name: f"formulation.density_form={'mass' if name.startswith('test') else 'volume'}" for name in (*SETS, "test_gap")
}
# Pressures are compared where no front is within so many spacings of the particles about an interface.
ABOUT, CLEAR = 8, 20


class Computed:
    """One run of a case, with its exact solution."""

    def __init__(self, name: str, runs: Path, *overrides: str):
        self.case = load_case(FOLDER + name, overrides=overrides)
        self.folder = runs / "_".join([name, *(o.replace("=", "_") for o in overrides)])
        if not (self.folder / "summary.json").is_file():
            run(self.case, self.folder, force=True, threads=1)
        self.history = read_history(self.folder)
        self.exact: ExactSolution = exact_solution(self.case)

    def compared(self, name: str) -> Comparison:
        """Return a gauge's velocity against the exact one."""
        gauge = next(g for g in self.exact.gauges if g.name == name)
        return compare_gauge(self.history["time"], self.history[f"gauge.{name}.velocity_x"], gauge.times,
                             gauge.values("velocity_x"), shortest=0.04, smallest=0.05)  # fmt: skip

    def overshoots(self) -> tuple[float, float]:
        """Return the highest overshoot of pressure at the impact point and at the layers' interfaces.

        Relative to the strongest exact pressure; moments with a front nearby are left out.
        """
        worst = [0.0, 0.0]
        for path in list_snapshots(self.folder)[1:]:
            snapshot = read_snapshot(path)
            time = min(snapshot.time, self.case.time.end * (1.0 - 1e-12))
            edges, states = self.exact.tracked.profile(time)
            pressures = np.array([state.pressure for state in states])
            x, p = snapshot.fields["position"][:, 0], snapshot.fields["pressure"]
            changes = np.flatnonzero(np.diff(snapshot.body)) + 1
            for number, at in enumerate(changes):
                low, high = (x[at] - CLEAR * self.case.resolution, x[at] + CLEAR * self.case.resolution)
                window = pressures[(edges[:, 1] > low) & (edges[:, 0] < high)]
                if len(window) and window.max() > 0.1 and np.ptp(window) < 1e-3 * window.max():
                    excess = (p[at - ABOUT : at + ABOUT].max() - window.max()) / window.max()
                    worst[min(number, 1)] = max(worst[min(number, 1)], excess)
        return worst[0], worst[1]


def table(runs: Path, kernels: bool) -> dict[str, Computed]:
    """Run all cases, print what is measured, return the runs."""
    rows = [(n + end, "") for n in SETS for end in ("", "_no_dissipation")]
    rows += [("test_gap", ""), ("test_gap_no_dissipation", "")]
    rows += [(f"test_{kernel}", "") for kernel in KERNELS] if kernels else []
    rows += [(n + end, other) for n, other in OTHER_FORM.items() for end in ("", "_no_dissipation")]
    found = {}
    print(f"{'case':42}{'gauge':6}{'mean':>8}{'plateau':>9}{'arrival':>9}   overshoot at impact, interfaces")
    for case, override in rows:
        one = Computed(case, runs, *filter(None, [override]))
        name = f"{case}, other form" if override else case
        found[name] = one
        for gauge in ("A", "B", "C"):
            c = one.compared(gauge)
            plateau = max(abs(p.found - p.exact) for p in c.plateaus)
            arrival = max((abs(a.found - a.exact) for a in c.arrivals), default=0.0)
            end = "   {:5.1%}, {:5.1%}".format(*one.overshoots()) if gauge == "A" else ""
            print(f"{name:42}{gauge:6}{c.mean_difference:8.4f}{plateau:9.4f}{arrival:9.4f}{end}")
    for gauge in ("A", "B", "C"):
        late = found["test_gap"].compared(gauge).arrivals[0].found - found["test"].compared(gauge).arrivals[0].found
        print(f"the gap of 0.1 delays {gauge} by {late:.4f}")
    return found


def convergence(runs: Path) -> None:
    """Print how the mean differences fall from 200 to 1600 particles per unit length."""
    numbers = (200, 400, 800, 1600)
    for name, override in [*((n, "") for n in SETS), *((n, OTHER_FORM[n]) for n in SETS)]:
        label = f"{name}, other form" if override else name
        rows = []
        for n in numbers:
            # the published step suits 400; the layers between are compressed fourteenfold
            finer = [f"time.step={0.04 / n!r}"] if n > 400 else []
            computed = Computed(name, runs, f"resolution={1.0 / n!r}", *finer, *filter(None, [override]))
            rows.append([computed.compared(gauge).mean_difference for gauge in ("A", "B", "C")])
            print(f"{label:24}{n:5} per unit length: " + ", ".join(f"{value:.5f}" for value in rows[-1]))
        span = math.log(numbers[-1] / numbers[0])
        orders = [math.log(a / b) / span for a, b in zip(rows[0], rows[-1], strict=True)]
        print(f"{label:24}order over the whole range: " + ", ".join(f"{order:.2f}" for order in orders))


def figures(found: dict[str, Computed], folder: Path) -> None:
    """Draw figures 3 to 8 of the paper."""
    folder.mkdir(parents=True, exist_ok=True)
    profiles = (
        ("figure_3", "test_no_dissipation", 0.2),
        ("figure_4", "test", 0.2),
        ("figure_5", "test_gap", 0.2),
    )
    for figure, name, time in profiles:
        _profiles({"SPH": found[name]}, time, folder / f"{figure}.png")
    forms = {"rho_a sum m_b/rho_b (eq. 12)": found["al_glass_al, other form"], "sum m_b": found["al_glass_al"]}
    _profiles(forms, 0.7, folder / "density_forms.png")
    for figure, gauge in (("figure_6", "A"), ("figure_7", "B"), ("figure_8", "C")):
        curves = []
        for name in SETS[1:]:
            one = found[name]
            exact_gauge = next(g for g in one.exact.gauges if g.name == gauge)
            values = one.history[f"gauge.{gauge}.velocity_x"]
            curves.append(Curve(LABELS[name], one.history["time"], values))
            line = steps(exact_gauge.times, exact_gauge.values("velocity_x"), one.case.time.end)
            curves.append(Curve("exact" if len(curves) == 1 else "", *line, exact=True))
        curves_picture({"velocity_x": curves}, folder / f"{figure}.png", unitless=True,
                       title=f"Velocity of the material at gauge {gauge} (Zisis 2013)")  # fmt: skip


def _profiles(computed: dict[str, Computed], time: float, picture: Path) -> None:
    """Draw density, velocity and pressure of runs of one impact beside the exact ones."""
    panels: dict[str, list[Curve]] = {}
    for label, one in computed.items():
        snapshot = min(map(read_snapshot, list_snapshots(one.folder)), key=lambda s: abs(s.time - time))
        x = snapshot.fields["position"][:, 0]
        for column, field in (("density", "density"), ("velocity_x", "velocity"), ("pressure", "pressure")):
            panels.setdefault(column, []).append(Curve(label, x, np.ravel(snapshot.fields[field])))
    exact = one.exact.profile(snapshot.time)
    for column, curves in panels.items():
        curves.append(Curve("exact", exact["x"], exact[column], True))
    curves_picture(panels, picture, title=f"{one.case.title}, t = {snapshot.time:.2g}", across="x", unitless=True)


def main() -> None:
    """Run, print, draw."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--figures", type=Path, help="folder for the figures; none unless given")
    parser.add_argument("--runs", type=Path, help="folder of the runs, kept; a temporary one unless given")
    parser.add_argument("--quick", action="store_true", help="the published cases only")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        runs = options.runs or Path(folder)
        found = table(runs, kernels=not options.quick)
        if not options.quick:
            convergence(runs)
        if options.figures:
            figures(found, options.figures)


if __name__ == "__main__":
    main()
