"""The Al-Al impact by PySPH: standard SPH for solids, as `against_pysph.py` times it.

    pip install pysph
    python benchmarks/pysph_al_al.py DX_MM STEPS FOLDER

The same particles, kernel, smoothing length, viscosity and material as `cases/al_al.yaml`, no artificial stress and no
XSPH; a predictor and corrector with one evaluation a step. Compiled by Cython on its first run.
"""

from __future__ import annotations

import sys

import numpy as np
from pysph.base.kernels import CubicSpline
from pysph.base.utils import get_particle_array
from pysph.solver.application import Application
from pysph.solver.solver import Solver
from pysph.sph.basic_equations import ContinuityEquation, MonaghanArtificialViscosity, VelocityGradient2D
from pysph.sph.equation import Group
from pysph.sph.integrator import PECIntegrator
from pysph.sph.integrator_step import SolidMechStep
from pysph.sph.solid_mech.basic import (
    EnergyEquationWithStress,
    HookesDeviatoricStressRate,
    MomentumEquationWithStress,
)
from pysph.sph.solid_mech.hvi import StiffenedGasEOS, VonMisesPlasticity2D

DENSITY, SOUND, GAMMA, SHEAR, YIELD, SPEED = 2785.0, 5328.0, 2.0, 27.6e9, 0.3e9, 3100.0
TENSORS = [f"{kind}{one}" for kind in ("s", "as", "r") for one in ("00", "01", "02", "11", "12", "22")]
BEFORE = ["s000", "s010", "s020", "s110", "s120", "s220", "rho0", "u0", "v0", "w0", "x0", "y0", "z0", "e0"]
GRADIENT = [f"v{a}{b}" for a in range(3) for b in range(3)]
RATES = ["arho", "au", "av", "aw", "ax", "ay", "az", "ae", "e"]


def lattice(dx, low, high):
    """Return the points of a square lattice between two corners, half a spacing inside."""
    axes = [np.arange(a + 0.5 * dx, b, dx) for a, b in zip(low, high, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 2)


class Impact(Application):
    """A disc of 10 mm on a plate of 2 mm."""

    def __init__(self, dx, folder):
        self._dx = dx
        super().__init__(fname="al_al", output_dir=folder)

    def create_particles(self):
        """Return both bodies as one array, as hvisph has them."""
        dx = self._dx
        disc = lattice(dx, (-10e-3, -5e-3), (0.0, 5e-3))
        disc = disc[((disc - (-5e-3, 0.0)) ** 2).sum(axis=1) <= 25e-6]
        plate = lattice(dx, (0.0, -25.05e-3), (2e-3, 25.05e-3))
        x = np.concatenate([disc, plate])
        moving = np.arange(len(x)) < len(disc)
        made = get_particle_array(name="metal", x=x[:, 0], y=x[:, 1], m=DENSITY * dx**2, rho=DENSITY, h=1.4 * dx,
                                  cs=SOUND, u=SPEED * moving)  # fmt: skip
        for name in (*TENSORS, *BEFORE, *GRADIENT, *RATES):
            made.add_property(name)
        for name, value in (("G", SHEAR), ("n", 4), ("wdeltap", CubicSpline(dim=2).kernel(rij=dx, h=1.4 * dx))):
            made.add_constant(name, value)
        print("particles", len(x), flush=True)
        return [made]

    def create_solver(self):
        """Return the solver: fixed steps, so that their number is known."""
        solver = Solver(kernel=CubicSpline(dim=2), dim=2, integrator=PECIntegrator(metal=SolidMechStep()))
        solver.set_time_step(2e-9)
        solver.set_final_time(1.0)
        return solver

    def create_equations(self):
        """Return the equations of standard SPH for solids."""
        own, pairs = {"dest": "metal", "sources": None}, {"dest": "metal", "sources": ["metal"]}
        state = [
            StiffenedGasEOS(**own, gamma=GAMMA, r0=DENSITY, c0=SOUND),
            VelocityGradient2D(**pairs),
            VonMisesPlasticity2D(**own, flow_stress=YIELD),
        ]
        rates = [
            ContinuityEquation(**pairs),
            MomentumEquationWithStress(**pairs),
            EnergyEquationWithStress(**pairs, alpha=1.0, beta=2.0, eta=0.1),
            MonaghanArtificialViscosity(**pairs, alpha=1.0, beta=2.0),
            HookesDeviatoricStressRate(**own),
        ]
        return [Group(equations=state), Group(equations=rates)]


if __name__ == "__main__":
    made = Impact(1e-3 * float(sys.argv[1]), sys.argv[3])
    made.run(["--no-openmp", "--disable-output", "--max-steps", sys.argv[2]])
