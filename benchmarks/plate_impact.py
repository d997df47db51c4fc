"""Elastic-plastic plate impact beside its exact solution: precursor, plateau, fronts, free surface.

    python benchmarks/plate_impact.py [--picture docs/layered/plate_impact_600.png] [--runs FOLDER]

Runs `plate_impact_600` (Howell & Ball's stiffened gas), the same with a Mie-Grueneisen equation of state, and an
impact that overdrives the precursor, and prints what is measured.
"""

from __future__ import annotations

import argparse
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hvisph.case.loader import load_case
from hvisph.measure.curves import curves_picture, gauge_panels, steps
from hvisph.output.reader import read_history
from hvisph.simulation.exact_solution import ExactSolution, exact_solution
from hvisph.simulation.run import run

CASE = "plate_impact_600"
MIE_GRUENEISEN = "eos={type: mie_gruneisen, sound_speed: 5328, gamma: 2.0, s1: 1.338}"
VARIANTS = {
    "stiffened gas, 600 m/s": (),
    "Mie-Grueneisen, 600 m/s": tuple(f"bodies.{body}.material.{MIE_GRUENEISEN}" for body in ("projectile", "target")),
    "overdriven, 3.1 km/s": ("bodies.projectile.velocity=[3.1 km/s]", "time.end=2 us"),
}
# Plateaus are means over the middle half of the time between two fronts, as in `measure.against_exact`.
EDGE = 0.25


@dataclass(frozen=True)
class Row:
    """A figure: found, exact, and what the difference may be."""

    name: str
    found: float
    exact: float
    unit: str

    def __str__(self) -> str:
        off = self.found / self.exact - 1.0
        return f"    {self.name:38}{self.found:10.4g}{self.exact:10.4g} {self.unit:5}{off:+8.2%}"


def rows_of(history: dict[str, np.ndarray], exact: ExactSolution) -> list[Row]:
    """Return the figures of a run whose gauges are those of `plate_impact_600`."""
    gauges = {gauge.name: gauge for gauge in exact.gauges}
    time = history["time"]
    near, far = gauges["near"], gauges["far"]
    fronts = _fronts(near.values("stress_xx"))
    found_at, exact_at = {}, {}
    for name, gauge in (("near", near), ("far", far)):
        values = -history[f"gauge.{name}.stress_xx"]
        stress = -gauge.values("stress_xx")
        for number in range(fronts):
            level = 0.5 * (stress[number] + stress[number + 1])
            found_at[name, number] = _passing(time, values, level)
            exact_at[name, number] = float(gauge.times[number + 1])
    rows = []
    names = ("precursor", "plastic shock") if fronts == 2 else ("shock",)
    apart = 5e-3  # of the gauges `near` and `far` [m]
    for number, name in enumerate(names):
        speeds = [apart / (at["far", number] - at["near", number]) for at in (found_at, exact_at)]
        rows.append(Row(f"speed of the {name}", *speeds, "m/s"))
    stress = -far.values("stress_xx")
    bounds = [*far.times[1 : fronts + 1], far.times[fronts + 1] if len(far.times) > fronts + 1 else time[-1]]
    for number, name in enumerate((*names[:-1], "plateau")):
        found = _mean(time, -history["gauge.far.stress_xx"], bounds[number], bounds[number + 1])
        rows.append(Row(f"stress of the {name}", found / 1e9, stress[number + 1] / 1e9, "GPa"))
    surface = gauges["surface"]
    # From the shock's arrival, which the fastest change of the exact surface marks, to the end of the plateau.
    velocity = surface.values("velocity_x")
    end = time[-1]
    begin = float(surface.times[1:][np.abs(np.diff(velocity)).argmax()])
    middle = np.linspace(begin + EDGE * (end - begin), end - EDGE * (end - begin), 200)
    exact_mean = float(surface.sample("velocity_x", middle).mean())
    found = float(np.interp(middle, time, history["gauge.surface.velocity_x"]).mean())
    return [*rows, Row("velocity of the free surface", found, exact_mean, "m/s")]


def _fronts(stress: np.ndarray) -> int:
    """Return how many fronts lead to the first plateau: 2 with a precursor."""
    first = abs(stress[1] - stress[0])
    return 1 if first > 0.5 * np.abs(stress).max() else 2


def _passing(time: np.ndarray, values: np.ndarray, level: float) -> float:
    after = int((values >= level).argmax())
    low, high = values[after - 1], values[after]
    return float(time[after - 1] + (level - low) / (high - low) * (time[after] - time[after - 1]))


def _mean(time: np.ndarray, values: np.ndarray, begin: float, end: float) -> float:
    inner = EDGE * (end - begin)
    return float(values[(time >= begin + inner) & (time <= end - inner)].mean())


def main() -> None:
    """Run, print, draw."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--picture", type=Path, help="picture of the first case's gauges; none unless given")
    parser.add_argument("--runs", type=Path, help="folder of the runs, kept; a temporary one unless given")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        for number, (name, overrides) in enumerate(VARIANTS.items()):
            case = load_case(CASE, overrides=overrides)
            folder = (options.runs or Path(temporary)) / f"{CASE}_{number}"
            if not (folder / "summary.json").is_file():
                run(case, folder, force=True, threads=1)
            exact = exact_solution(case)
            print(f"{name}\n    {'':38}{'found':>10}{'exact':>10}")
            print("\n".join(str(row) for row in rows_of(read_history(folder), exact)))
            if options.picture and number == 0:
                beside = {f"gauge.{g.name}.{column}": steps(g.times, g.values(column), case.time.end)
                          for g in exact.gauges for column in g.columns}  # fmt: skip
                curves_picture(gauge_panels(folder, beside), options.picture, title=case.title)


if __name__ == "__main__":
    main()
