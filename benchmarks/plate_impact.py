"""Elastic-plastic plate impact beside its exact solution: precursor, plateau, fronts, free surface.

    python benchmarks/plate_impact.py [--picture FILE] [--runs FOLDER]

Runs `plate_impact_600` (Howell & Ball's stiffened gas), the same with a Mie-Grueneisen equation of state, and an
impact that overdrives the precursor, and prints what is measured.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hvisph.casefile.loader import load_case
from hvisph.output.reader import read_history
from hvisph.postprocessing.exact_solution import ExactSolution, exact_solution
from hvisph.simulation.run import run
from hvisph.visualization.curves import curves_picture, gauge_panels, steps

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from gauge_beside_exact import compare_gauge

CASE = "plate_impact_600"
MIE_GRUENEISEN = "eos={type: mie_gruneisen, sound_speed: 5328, gamma: 2.0, s1: 1.338}"
VARIANTS = {
    "stiffened gas, 600 m/s": (),
    "Mie-Grueneisen, 600 m/s": tuple(f"bodies.{body}.material.{MIE_GRUENEISEN}" for body in ("projectile", "target")),
    "overdriven, 3.1 km/s": ("bodies.projectile.velocity=[3.1 km/s]", "time.end=2 us"),
}
APART = 5e-3  # of the gauges `near` and `far`, at centres of particles [m]


@dataclass(frozen=True)
class Row:
    """A figure, as found and exact."""

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
    at_near, at_far = (
        # rises of a tenth of the precursor's stress at least, plateaus of 40 ns: the precursor's at `near` has 60
        compare_gauge(time, -history[f"gauge.{name}.stress_xx"], gauges[name].times,
                      -gauges[name].values("stress_xx"), shortest=4e-8, smallest=6e7)
        for name in ("near", "far")
    )  # fmt: skip
    pairs = list(zip(at_near.arrivals, at_far.arrivals, strict=False))
    # with a precursor, the first plateau is far below the second
    two = len(pairs) > 1 and at_far.plateaus[1].exact < 0.5 * at_far.plateaus[2].exact
    names = ("precursor", "plastic shock") if two else ("shock",)
    rows = []
    for name, (a, b) in zip(names, pairs, strict=False):
        rows.append(Row(f"speed of the {name}", APART / (b.found - a.found), APART / (b.exact - a.exact), "m/s"))
    for name, level in zip((*names[:-1], "plateau"), at_far.plateaus[1:], strict=False):
        rows.append(Row(f"stress of the {name}", level.found / 1e9, level.exact / 1e9, "GPa"))
    surface = gauges["surface"]
    # The exact surface still rises in small steps behind the shock: both are averaged over the same time.
    arrival = surface.times[1:][np.abs(np.diff(surface.values("velocity_x"))).argmax()]
    late = np.linspace(0.75 * arrival + 0.25 * time[-1], 0.25 * arrival + 0.75 * time[-1], 200)
    found = np.interp(late, time, history["gauge.surface.velocity_x"])
    rows.append(
        Row(
            "velocity of the free surface", float(found.mean()), float(surface.sample("velocity_x", late).mean()), "m/s"
        )
    )
    return rows


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
                exact_gauges = {f"gauge.{g.name}.{column}": steps(g.times, g.values(column), case.time.end)
                          for g in exact.gauges for column in g.columns}  # fmt: skip
                curves_picture(gauge_panels(folder, exact_gauges), options.picture, title=case.title)


if __name__ == "__main__":
    main()
