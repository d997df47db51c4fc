"""Collisions of random bodies in 3D that `robustness.py` counts: ends, conservation, least internal energy."""

from __future__ import annotations

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "benchmarks")]

import numpy as np  # noqa: E402
from campaign import Tally, counts  # noqa: E402
from small_runs import DAMAGED, FORMULATIONS, METAL, OPTIONS, final  # noqa: E402

from hvisph.casefile.loader import load_case  # noqa: E402
from hvisph.core.errors import CaseError  # noqa: E402
from hvisph.output.reader import list_snapshots, read_snapshot  # noqa: E402
from hvisph.simulation.run import run  # noqa: E402

# As METAL, and it spalls.
SPALLING = METAL | {"damage": {"type": "pressure_cutoff", "pressure": -1.2e9}}
KEPT = {"eulerian": {"conserve_angular_momentum": True}}  # free by default, as published
SOLIDS = [DAMAGED, SPALLING]  # both in every case, so that all seeds of a formulation share their compiled loops
LIMITS = {"momentum": 1e-12, "angular momentum": 1e-3, "energy": 1e-12, "internal energy below zero": 1e-3}


def case_of(seed, dx):
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
            "material": SOLIDS[k if k < 2 else int(rng.integers(2))],
            "shape": shape,
            "position": place,
            "velocity": [float(speed * (1 if k == 0 else -0.5)), *rng.normal(0.0, 200.0, 2).tolist()],
        }
        if shape["type"] == "box":
            bodies[f"body_{k}"]["rotation"] = {"angle": float(rng.uniform(0, 3)), "axis": rng.normal(size=3).tolist()}
    formulation = FORMULATIONS[seed % len(FORMULATIONS)]
    variants = {0: {}, 1: {"symmetry": [{"axis": "z", "at": 0.0}]}, 2: {"domain": {"min": [-4e-3, None, None]}}, 3: {}}
    addition = variants[seed // len(FORMULATIONS) % 4]
    if "symmetry" in addition:  # bodies on the plane, moving along it
        for body in bodies.values():
            body["position"][2] = body["velocity"][2] = 0.0
            if "rotation" in body:
                body["rotation"]["axis"] = [0.0, 0.0, 1.0]
    options = {"type": formulation} | OPTIONS.get(formulation, {}) | KEPT.get(formulation, {})
    end = 4e-6 if formulation != "projection" else 3e-7
    content = {"kinematics": "three_d", "resolution": dx, "bodies": bodies, "formulation": options,
             "output": {"checkpoint_every": None, "every": None}, "time": {"end": end, "max_steps": 20_000}}  # fmt: skip
    try:
        return load_case(content | addition), formulation
    except CaseError:  # not for every formulation
        try:
            return load_case(content), formulation
        except CaseError:
            for body in bodies.values():
                body["material"] = METAL
            return load_case(content), formulation


def collisions(dx):
    """Return the campaign of random bodies that meet; momentum, angular momentum and energy stay, no energy is negative."""

    def start(work):
        def trial(seed) -> Tally:
            case, formulation = case_of(seed, dx)
            summary = run(case, work / "collision", force=True, threads=1).summary
            if summary["status"] != "done":
                print("  seed", seed, formulation, summary["failure"]["message"])
                return {
                    "ends": {"stopped cleanly by a watcher": 1},
                    "stopped": {f"{formulation}: {summary['failure']['criterion']}": 1},
                }
            figures = _figures(case, summary["conservation"], work / "collision")
            told: Tally = {"ends": {"ended": 1}, "by formulation": {formulation: 1}}
            for name, value in figures.items():
                told[name] = {f"most_{formulation}": value}
                if value > LIMITS[name]:
                    told["misses"] = [*told.get("misses", []), f"seed {seed}, {formulation}, {name} {value:.1e}"]
            return told

        return trial

    return start


def _figures(case, kept, folder):
    """Return what is held against the limits, by name: drifts, and the least internal energy, its sign turned."""
    figures = {"momentum": None if case.symmetry else kept["momentum_drift"], "energy": kept["energy_drift"],
             "angular momentum": None if case.symmetry else kept["angular_momentum_drift"]}  # fmt: skip
    start, end = read_snapshot(list_snapshots(folder)[0]), final(folder)
    velocity, mass = start.fields["velocity"], start.fields["mass"]
    speed = velocity - np.average(velocity, axis=0, weights=mass)
    mean = 0.5 * float(np.average((speed**2).sum(axis=1), weights=mass))
    if "internal_energy" in end.fields:
        figures["internal energy below zero"] = max(-float(end.fields["internal_energy"].min()) / mean, 0.0)
    return {name: abs(value) for name, value in figures.items() if value is not None}


def told(tally):
    """Return the counts and extremes in words."""
    stopped = f" ({counts(tally['stopped'])})" if "stopped" in tally else ""
    text = f"{tally['trials']} seeds: {counts(tally['ends'])}{stopped}"
    for what in LIMITS:
        most = ", ".join(f"{name[5:]} {value:.0e}" for name, value in sorted(tally.get(what, {}).items()))
        text += f"; {what} at most {most}"
    misses = tally.get("misses", [])
    return text + f"; beyond the limits {len(misses)}" + (f": {'; '.join(misses)}" if misses else "")
