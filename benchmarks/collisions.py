"""Collisions of random bodies in 3D that `robustness.py` counts: ends, conservation, least internal energy."""

from __future__ import annotations

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "benchmarks")]

import numpy as np  # noqa: E402
from campaign import Tally, counts  # noqa: E402
from small_runs import DAMAGED, FORMULATIONS, HARDENING, METAL, OPTIONS, final  # noqa: E402

from hvisph.casefile.loader import load_case  # noqa: E402
from hvisph.core.errors import CaseError  # noqa: E402
from hvisph.output.reader import list_snapshots, read_snapshot  # noqa: E402
from hvisph.simulation.run import run  # noqa: E402

# As METAL, and it spalls.
SPALLING = METAL | {"damage": {"type": "pressure_cutoff", "pressure": -1.2e9}}
SOLIDS = [DAMAGED, HARDENING, METAL, SPALLING]


def case_of(seed):
    """Return two to four bodies of random shape, place, turn, speed and material, and what else there may be."""
    rng = np.random.default_rng(seed)
    bodies = {}
    for k in range(int(rng.integers(2, 5))):
        size = rng.uniform(2.5e-3, 4.5e-3, 3)
        shape = {"type": "box", "size": size.tolist()}
        if rng.random() < 0.5:
            shape = {"type": "sphere", "diameter": float(size[0])}
        place = [7e-3 * k, *rng.uniform(-1.2e-3, 1.2e-3, 2).tolist()]
        speed = rng.uniform(500.0, 4000.0)
        bodies[f"body_{k}"] = {
            "material": SOLIDS[int(rng.integers(len(SOLIDS)))],
            "shape": shape,
            "position": place,
            "velocity": [float(speed * (1 if k == 0 else -0.5)), *rng.normal(0.0, 200.0, 2).tolist()],
        }
        if shape["type"] == "box":
            bodies[f"body_{k}"]["rotation"] = {"angle": float(rng.uniform(0, 3)), "axis": rng.normal(size=3).tolist()}
    formulation = FORMULATIONS[seed % len(FORMULATIONS)]
    if formulation == "adaptive":  # something must be able to fail
        bodies["body_0"]["material"] = DAMAGED
    extra = {0: {}, 1: {"symmetry": [{"axis": "z", "at": 0.0}]}, 2: {"domain": {"min": [-4e-3, None, None]}}, 3: {}}
    further = extra[seed // len(FORMULATIONS) % 4]
    if "symmetry" in further:  # bodies on the plane, moving along it
        for body in bodies.values():
            body["position"][2] = body["velocity"][2] = 0.0
            if "rotation" in body:
                body["rotation"]["axis"] = [0.0, 0.0, 1.0]
    options = {"type": formulation} | OPTIONS.get(formulation, {})
    end = 4e-6 if formulation != "projection" else 3e-7
    plain = {"kinematics": "three_d", "resolution": 0.45e-3, "bodies": bodies, "formulation": options,
             "output": {"checkpoint_every": None, "every": None}, "time": {"end": end, "max_steps": 1500}}  # fmt: skip
    try:
        return load_case(plain | further), formulation
    except CaseError:  # not for every formulation
        try:
            return load_case(plain), formulation
        except CaseError:
            for body in bodies.values():
                body["material"] = METAL
            return load_case(plain), formulation


def collisions(work):
    """Let random bodies meet; momentum, angular momentum and energy stay, and no particle's energy falls below zero."""

    def trial(seed) -> Tally:
        case, formulation = case_of(seed)
        summary = run(case, work / "collision", force=True, threads=1).summary
        if summary["status"] != "done":
            print("  seed", seed, formulation, summary["failure"]["message"])
            return {
                "ends": {"stopped cleanly by a watcher": 1},
                "stopped": {f"{formulation}: {summary['failure']['criterion']}": 1},
            }
        start, end, kept = (
            read_snapshot(list_snapshots(work / "collision")[0]),
            final(work / "collision"),
            summary["conservation"],
        )
        found: Tally = {"ends": {"ended": 1}, "by formulation": {formulation: 1}}
        if not case.symmetry:
            found["most_momentum"] = kept["momentum_drift"]
        if kept["energy_drift"] is not None:
            found["most_energy"] = abs(kept["energy_drift"])
        if kept["angular_momentum_drift"] is not None:
            found["angular"] = {f"most_{formulation}": kept["angular_momentum_drift"]}
        speed = start.fields["velocity"] - np.average(start.fields["velocity"], axis=0, weights=start.fields["mass"])
        mean = 0.5 * float(np.average((speed**2).sum(axis=1), weights=start.fields["mass"]))
        if "internal_energy" in end.fields:
            found["internal"] = {f"least_{formulation}": float(end.fields["internal_energy"].min()) / mean}
        return found

    return trial


def told(tally):
    """Return the counts and extremes in words."""
    stopped = f" ({counts(tally['stopped'])})" if "stopped" in tally else ""
    angular_ = ", ".join(f"{name[5:]} {value:.0e}" for name, value in tally["angular"].items())
    least = ", ".join(f"{name[6:]} {value:.0e}" for name, value in tally["internal"].items())
    return (
        f"{tally['trials']} seeds: {counts(tally['ends'])}{stopped}; momentum within {tally['most_momentum']:.1e}, "
        f"energy within {tally['most_energy']:.1e}, angular momentum over the sum of its parts within {angular_}; "
        f"least internal energy of a particle over the mean kinetic energy of the start {least}"
    )
