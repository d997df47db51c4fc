"""Random bodies of every shape, spacing and arrangement: mass of the whole, and of what planes of symmetry leave.

    python benchmarks/masses.py [--bodies 200] [--seed 0]

Every body is filled whole and with planes through its middle across one, two and all axes, in 1D to 3D and as rings about
an axis; its mass is held against that of its shape, and that of a half, quarter or eighth against its share of the
whole. What a case refuses is counted by its message.
"""

from __future__ import annotations

import argparse
import itertools
import math
from collections import Counter
from typing import Any

import numpy as np

from hvisph.casefile.loader import load_case
from hvisph.core.catalogues import SECTION_ARRANGEMENTS, arrangements_of
from hvisph.core.errors import CaseError
from hvisph.setup.bodies import placed_bodies

ASKED = 1e-3
DENSITY = 2700.0
MATERIAL = {
    "density": DENSITY,
    "eos": {"type": "stiffened_gas", "sound_speed": 5000.0, "gamma": 3.0},
    "strength": {"type": "von_mises", "shear_modulus": 27e9, "yield_stress": 0.3e9},
}
KINEMATICS = {1: "uniaxial_strain", 2: "plane_strain", 3: "three_d"}


def random_shape(random: np.random.Generator, dim: int) -> dict[str, Any]:
    """Return a shape whose thinnest part is some six spacings of 1 mm or more."""
    a, b, c = (float(v) for v in random.uniform(8e-3, 20e-3, 3))
    wide, narrow = a + 14e-3, a
    if dim == 1:
        return {"type": "interval", "length": a}
    nosed = [
        {"type": "cone", "diameter": wide, "length": b + 10e-3},
        {"type": "frustum", "back_diameter": wide, "front_diameter": narrow, "length": b},
        {"type": "ogive", "diameter": a, "nose_length": a + b, "shank_length": c},
        {"type": "dome", "diameter": wide},
        {"type": "rounded_cylinder", "diameter": a, "length": b + 8e-3, "edge_radius": 2e-3},
    ]
    if dim == 2:
        own = [
            {"type": "disc", "diameter": a},
            {"type": "box", "size": [a, b]},
            {"type": "annulus", "outer_diameter": wide, "inner_diameter": narrow},
            {"type": "polygon", "points": [[-b, 0], [-0.5 * b, -c], [0.5 * b, -c], [b, 0], [0.5 * b, c],
                                           [-0.5 * b, c]]},
            {"type": "difference", "whole": {"type": "box", "size": [a + 10e-3, b + 10e-3]},
             "removed": [{"shape": {"type": "disc", "diameter": 5e-3}}]},
            {"type": "intersection", "parts": [{"shape": {"type": "disc", "diameter": wide}},
                                               {"shape": {"type": "box", "size": [a, wide]}}]},
            {"type": "repeat", "shape": {"type": "disc", "diameter": a}, "vectors": [[0, a + 3e-3], [a + b, 0]],
             "counts": [2, 3]},
            {"type": "union", "parts": [{"shape": {"type": "box", "size": [a, b]}},
                                        {"shape": {"type": "box", "size": [a, b]}, "rotation": "45 deg"}]},
        ]  # fmt: skip
    else:
        own = [
            {"type": "sphere", "diameter": a},
            {"type": "cylinder", "diameter": a, "length": b},
            {"type": "tube", "outer_diameter": wide, "inner_diameter": narrow, "length": b},
            {"type": "hollow_sphere", "outer_diameter": wide, "inner_diameter": narrow},
            {"type": "ring", "section": {"type": "disc", "diameter": 7e-3}, "radius": a},
            {"type": "ring", "section": {"type": "box", "size": [b, 7e-3]}, "radius": a},
            {"type": "union", "parts": [{"shape": {"type": "cylinder", "diameter": a, "length": b}},
                                        {"shape": {"type": "sphere", "diameter": a + 2e-3}}]},
            {"type": "difference", "whole": {"type": "cylinder", "diameter": wide, "length": b},
             "removed": [{"shape": {"type": "sphere", "diameter": 0.8 * b}}]},
            {"type": "intersection", "parts": [{"shape": {"type": "sphere", "diameter": wide}},
                                               {"shape": {"type": "cylinder", "diameter": a, "length": wide}}]},
            {"type": "box", "size": [a, b, c]},
            {"type": "difference", "whole": {"type": "box", "size": [a + 6e-3, b + 6e-3, c + 6e-3]},
             "removed": [{"shape": {"type": "cylinder", "diameter": 6e-3, "length": 1.0, "axis": "z"}}]},
            {"type": "repeat", "shape": {"type": "cylinder", "diameter": 7e-3, "length": a, "axis": "z"},
             "vectors": [[0, 9e-3, 0]], "counts": [3]},
            {"type": "prism", "section": {"type": "annulus", "outer_diameter": wide, "inner_diameter": narrow},
             "length": b, "axis": "x"},
        ]  # fmt: skip
    shapes = own + nosed
    return dict(shapes[int(random.integers(len(shapes)))])


def random_body(random: np.random.Generator) -> tuple[int, bool, dict[str, Any], float]:
    """Return dimensions, whether of rings, a body and its spacing [m]."""
    axisymmetric = bool(random.random() < 0.3)
    dim = 2 if axisymmetric else int(random.choice([1, 2, 2, 3, 3, 3]))
    while True:
        shape = random_shape(random, 3 if axisymmetric else dim)
        flat = shape.get("whole", shape)["type"] == "box"
        if not axisymmetric or (not flat and shape["type"] not in ("prism", "repeat")):
            break
    dx = float(random.uniform(0.6e-3, 1.1e-3))
    body: dict[str, Any] = {"material": MATERIAL, "shape": shape, "position": [0.0] * dim}
    allowed = SECTION_ARRANGEMENTS if axisymmetric else arrangements_of(dim, shape["type"])
    body["arrangement"] = str(random.choice(allowed))
    flat = shape["type"] in (("cylinder", "tube") if axisymmetric else ("interval", "box"))
    if flat and random.random() < 0.5:
        del body["arrangement"]
        body["grading"] = {"fine": [6e-3 if k else None for k in range(dim)], "coarsest": 1.7 * dx}
        if random.random() < 0.5:
            body["grading"] |= {"fine": [4e-3, *body["grading"]["fine"][1:]]}
    return dim, axisymmetric, body, dx


def masses(dim: int, axisymmetric: bool, body: dict[str, Any], dx: float, axes: tuple[str, ...]) -> tuple[float, float]:
    """Return mass of the particles, and of the shape's part that planes across `axes` leave [kg]."""
    case = load_case({
        "kinematics": "axisymmetric" if axisymmetric else KINEMATICS[dim],
        "resolution": dx,
        "bodies": {"body": body},
        "symmetry": [{"axis": axis} for axis in axes],
        "time": {"end": 1e-6},
    })  # fmt: skip
    (placed,) = placed_bodies(case)
    return DENSITY * float(placed.volumes.sum()), DENSITY * placed.asked


def main() -> None:
    """Fill, cut, weigh and print."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--bodies", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    random = np.random.default_rng(given.seed)
    refused: Counter[str] = Counter()
    farthest = {"whole": 0.0, "cut": 0.0}
    missed = cuts = 0
    for number in range(given.bodies):
        dim, axisymmetric, body, dx = random_body(random)
        told = f"{number} {'rings' if axisymmetric else f'{dim}D'} {body['shape']['type']} {body.get('arrangement', 'graded')}"
        try:
            whole, asked = masses(dim, axisymmetric, body, dx, ())
        except CaseError as error:
            refused[f"{told}: {error}"] += 1
            continue
        farthest["whole"] = max(farthest["whole"], abs(whole / asked - 1.0))
        if abs(whole / asked - 1.0) > ASKED:
            missed += 1
            print(f"{told}: mass off by {whole / asked - 1.0:+.2e}")
        if number % 20 == 19:
            print(f"{number + 1} bodies, {cuts} parts, {missed} off; farthest {farthest}", flush=True)
        across = ("x",) if axisymmetric else ("x", "y", "z")[:dim]
        for axes in itertools.chain.from_iterable(itertools.combinations(across, k + 1) for k in range(len(across))):
            try:
                part, _ = masses(dim, axisymmetric, body, dx, axes)
            except CaseError as error:
                kind = f"{'rings' if axisymmetric else f'{dim}D'} {body['shape']['type']} {body.get('arrangement', 'graded')}"
                refused[f"{kind} across {', '.join(axes)}: {' '.join(str(error).split()[1:9])} ..."] += 1
                continue
            cuts += 1
            off = abs(part / whole * 2.0 ** len(axes) - 1.0)
            farthest["cut"] = max(farthest["cut"], off)
            if not off < ASKED or math.isnan(off):
                missed += 1
                print(f"{told} cut across {', '.join(axes)}: {off:.2e} off its share of the whole")
    print(f"{given.bodies} bodies, {cuts} halves, quarters and eighths; {missed} off by more than {ASKED:g}")
    print(f"farthest off: whole {farthest['whole']:.1e}, cut {farthest['cut']:.1e}")
    for message, count in refused.most_common():
        print(f"refused {count}: {message}")


if __name__ == "__main__":
    main()
