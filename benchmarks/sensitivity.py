"""Sensitivity of the default scheme to each of its constants: changes of results when one is raised or lowered.

    python benchmarks/sensitivity.py [NAME ...] [--factor 1.3 --factor 0.7]

Every constant is changed in a process of its own, before the loops are compiled; NAME+NAME changes several together.
Results are those of the Al-Al impact at 0.25 mm, of a copper plate impact at 3.1 km/s and of aluminium plates at 600
m/s in 1D, and of the coarse form of the verification problem that the constant acts in. A line of JSON for each run;
NONE has the results of the scheme as it is.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile

import hvisph
from hvisph.integrators import particle_steps
from hvisph.materials import slots, traction_limits
from hvisph.schemes.riemann import law, scheme
from hvisph.simulation import clock, loop
from hvisph.sph.contact import contact_normal, riemann_contact, variable_resolution
from hvisph.sph.terms import (
    axisymmetric,
    conduction,
    density_correction,
    free_surface_correction,
    limiters,
    reconstruction,
    riemann_solver,
    shape_matrix,
    tension_stabilization,
)
from hvisph.verification.problem import Options
from hvisph.verification.runner import PROBLEMS, verdicts

# Constants by name: module and further verification problem, or the setting of a case and its default.
CONSTANTS = {
    "h_over_dx": ("formulation.h_over_dx", 1.2),
    "cfl": ("time.cfl", 0.42),
    "SHOCK_SLOPE": (riemann_solver, "noh"),
    "CONDUCTIVITY": (conduction, "noh"),
    "EXCHANGE_CUTOFF_MAX": (density_correction, None),
    "MIN_LIMITER": (reconstruction, "cantilever"),
    "TENSION_GAIN": (tension_stabilization, "tension"),
    "DISORDER": (traction_limits, "tension"),
    "CORRECTION_ONSET": (free_surface_correction, None),
    "CORRECTION_RANGE": (free_surface_correction, None),
    "CORRECTABLE_MIN": (free_surface_correction, None),
    "FRONT": (riemann_solver, "noh"),
    "SINGULAR": (shape_matrix, None),
    "OPEN": (contact_normal, "bars"),
    "PRESSED": (riemann_contact, "porous"),
    "NORMAL_COSINE_MIN": (contact_normal, "walls"),
    "FACING_COSINE": (contact_normal, None),
    "SHEAR_IMPEDANCE_MIN": (riemann_solver, "separation"),
    "DEPTH_MIN": (variable_resolution, "spacings"),
    "DEPTH_RANGE": (variable_resolution, "spacings"),
    "GROWTH": (clock, None),
    "TIME_TOLERANCE": (clock, None),
    "FRAGMENT_SEARCH_EVERY": (loop, None),
    "FLOOR_SHARE": (slots, None),
    "TINY": (limiters, None),
    "FILLER_VOLUME": (law, None),
    "SECTION_RATIO_MIN": (scheme, "axisymmetric"),
    "HOOP_ONSET": (axisymmetric, "axisymmetric"),
    "ON_AXIS": (particle_steps, "axisymmetric"),
    "HOOP_SLOPE": (particle_steps, "axisymmetric"),
    "HOOP_OFFSET": (particle_steps, "axisymmetric"),
}
# Constants near 1 whose difference from 1 is what counts.
FROM_ONE = ("OPEN", "CLOSED", "CORRECTION_ONSET", "GROWTH")
# Constants that act in no other than the named verification problem.
ELSEWHERE = (
    "PRESSED",
    "DEPTH_MIN",
    "DEPTH_RANGE",
    "SECTION_RATIO_MIN",
    "HOOP_ONSET",
    "ON_AXIS",
    "HOOP_SLOPE",
    "HOOP_OFFSET",
)
MEASURES = ("crater_diameter", "extension", "penetration", "centre_pressure_peak")


def changed(name: str, factor: float) -> list[str]:
    """Change a constant wherever the package has imported it; return the settings of cases that do so instead."""
    place, value = CONSTANTS[name]
    if isinstance(place, str):
        return [f"{place}={factor * value}"]
    modules = [module for key, module in sys.modules.items() if key.startswith("hvisph.")]
    value = getattr(place, name)
    new = type(value)(1.0 + factor * (value - 1.0) if name in FROM_ONE else factor * value)
    for module in modules:
        if vars(module).get(name) == value:
            setattr(module, name, new)
    return []


def measured(names: list[str], factor: float) -> dict[str, float]:
    """Return the results of all problems with constants changed."""
    settings = [setting for name in names for setting in changed(name, factor)]
    own = [(one, Options(quick=True), "") for one in {CONSTANTS[name][1] for name in names} if one in PROBLEMS]
    if names and all(name in ELSEWHERE for name in names):
        return solved(own, settings)
    with tempfile.TemporaryDirectory() as folder:
        case = hvisph.load_case("al_al_coarse", settings)
        summary = hvisph.run(case, f"{folder}/run", threads=1).summary
    found = {key: summary["measures"][key]["value"] for key in MEASURES} | {
        "energy": summary["conservation"]["energy_drift"]
    }
    impacts = [("hugoniot", Options(), "copper on copper 3.1"), ("plate", Options(quick=True), "")]
    return found | solved([*impacts, *own], settings)


def solved(problems: list[tuple[str, Options, str]], settings: list[str]) -> dict[str, float]:
    """Return the results of verification problems."""
    figures = {}
    for problem, options, only in problems:
        for verdict in verdicts(PROBLEMS[problem], ["riemann"], options, settings, only=only, threads=1):
            figures |= {f"{problem}: {verdict.trial}: {figure.name}": figure.found for figure in verdict.figures}
            if verdict.status != "done":
                figures[f"{problem}: {verdict.trial}: {verdict.message}"] = float("nan")
    return figures


def main() -> None:
    """Print the results of each constant and factor."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", default=list(CONSTANTS), help="constants; all unless given")
    parser.add_argument("--factor", type=float, action="append", help="1.3 and 0.7 unless given")
    options = parser.parse_args()
    factors = options.factor or [1.3, 0.7]
    if len(options.names) == len(factors) == 1:
        (name,), (factor,) = options.names, factors
        names = [] if name == "NONE" else name.split("+")
        print(json.dumps({"constant": name, "factor": factor, "results": measured(names, factor)}))
        return
    for name in options.names:
        for factor in factors:
            subprocess.run([sys.executable, __file__, name, "--factor", str(factor)], check=True)


if __name__ == "__main__":
    main()
