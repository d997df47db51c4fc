"""Flat impacts of foams and powders: state behind the shock, and stress beside the struck face.

Crushed pores bring particles together by their distension at a pressure far below the bulk modulus, so that an error of
0.2 % in density is one of 10 % in stress. Pores begin to crush at 1 MPa: an elastic precursor, which the exact solution
leaves out, would return from the rear face and change the state ahead of the shock.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from hvisph.core.text import Plain
from hvisph.verification.problem import EULERIAN, Figure, Options, Problem, Ran, Trial, fluid, stress_xx, vectors
from hvisph.verification.problems.hugoniot import flat_impact

ALUMINIUM, COPPER = "aluminium-howell-ball-mie-gruneisen", "copper-ofhc"
ALONG, BEGINS = 200, 1e6  # particles along a plate; pressure at which pores begin to crush [Pa]
TOLERANCES = {"stress": 0.03, "density": 0.01, "energy": 0.03}
WHY = "jump conditions; where pores crush, stress is three times as sensitive to density as in the solid"
FACE, BESIDE = 0.025, 3  # particles next to the interface


def porous(solid: str, distension: float, crushed: float) -> Plain:
    """Return a material without strength whose pores are gone at the pressure `crushed` [Pa]."""
    return fluid(solid) | {
        "porosity": {"distension": distension, "elastic_pressure": BEGINS, "solid_pressure": crushed}
    }


def beside_the_face(trial: Trial) -> Trial:
    """Return the trial of porous material with the stress beside the interface over that behind the front."""

    def figures(runs: Sequence[Ran]) -> Iterator[Figure]:
        (ran,) = runs
        distance, stress = np.abs(vectors(ran.first, "position")[:, 0]), stress_xx(ran.last)
        for figure in trial.figures(runs):
            quantity, _, where = figure.name.partition(" in the ")
            yield replace(figure, tolerance=TOLERANCES[quantity], why=WHY) if where else figure
            if quantity == "stress":
                rows = np.flatnonzero(ran.last.body == ("projectile", "target").index(where))
                mean_near = stress[rows[np.argsort(distance[rows])[:BESIDE]]].mean()
                yield Figure(f"stress beside the face of the {where}", float(mean_near / figure.found), 1.0, FACE,
                             why="stress is continuous; wall heating must not show in it")  # fmt: skip

    return replace(trial, figures=figures)


def _trials(options: Options) -> Iterator[Trial]:
    dx, solid = options.dx(25e-6, 50e-6), fluid(ALUMINIUM)
    for distension, crushed, speed in ((1.5, 0.7e9, 1500.0), (2.0, 0.7e9, 1500.0), (14.3, 0.2e9, 1000.0)):
        foam = porous(ALUMINIUM, distension, crushed)
        yield beside_the_face(flat_impact(f"foam of distension {distension:g}", foam, foam, speed, dx, ALONG))
    light, foam = porous(ALUMINIUM, 2.5, 0.7e9), porous(ALUMINIUM, 14.3, 0.2e9)
    yield beside_the_face(flat_impact("copper on foam of distension 2.5", fluid(COPPER), light, 2000.0, dx, ALONG))
    yield beside_the_face(flat_impact("aluminium on foam of distension 14.3", solid, foam, 3000.0, dx, ALONG))
    powder = porous(ALUMINIUM, 1.6, 0.7e9)
    yield beside_the_face(flat_impact("powder of distension 1.6", powder, powder, 3000.0, dx, ALONG))


PROBLEM = Problem(
    "porous", "flat impacts of foams and powders: state behind the shocks and beside the face", _trials, EULERIAN,
    why_not="its density at rest is below that of the solid",
)  # fmt: skip
