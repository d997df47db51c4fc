"""Cost of the compiled core on one thread: pair sums and the pass over particles, per law and dimension.

    python benchmarks/pair_pass.py [--dims 23] [--laws standard,contact]

A disturbed lattice with random stress, h = 1.4 dx: 24 neighbours in 2D, 83 in 3D. The best of several
repetitions, in microseconds per particle and evaluation.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable

import numba
import numpy as np

from hvisph.core.particles import Particles
from hvisph.integrators.scheme import LEAPFROG
from hvisph.integrators.time_step import Criteria
from hvisph.materials.eos import StiffenedGas
from hvisph.materials.material_table import Material
from hvisph.materials.strength import VonMises
from hvisph.schemes.protocol import Formulation
from hvisph.schemes.riemann.scheme import Riemann
from hvisph.schemes.standard.options import GrayArtificialStress
from hvisph.schemes.standard.scheme import Eulerian
from hvisph.schemes.stepper import Stepper
from hvisph.sph.terms.limiters import LIMITERS

LAWS: dict[str, Formulation] = {
    "standard": Eulerian(),
    "artificial_stress": Eulerian(artificial_stress=GrayArtificialStress()),
    "contact": Riemann(reconstruction=LIMITERS["none"]),
    "contact_van_leer": Riemann(),
}
SIDES = {1: 20_000, 2: 134, 3: 46}
ALUMINIUM = Material("aluminium", 2785.0, StiffenedGas(5328.0, 2.0), VonMises(27.6e9, 0.3e9))
DX = 1e-4


def block(formulation: Formulation, dim: int) -> Stepper:
    """Return a `Stepper` of a disturbed, stressed block, its state in cell order."""
    x = np.stack(np.meshgrid(*[np.arange(SIDES[dim]) * DX] * dim, indexing="ij"), -1).reshape(-1, dim)
    rng = np.random.default_rng(1)
    particles = Particles(dim, len(x), LEAPFROG.extra_fields())
    particles["position"] = x + 0.05 * DX * rng.normal(size=x.shape)
    particles["velocity"] = 50.0 * rng.normal(size=x.shape)
    particles["mass"], particles["smoothing_length"] = ALUMINIUM.density * DX**dim, 1.4 * DX
    particles["density"] = ALUMINIUM.density * (1.0 + 0.01 * rng.normal(size=len(x)))
    deviator = 1e8 * rng.normal(size=particles["deviator"].shape)
    deviator[:, :3] -= deviator[:, :3].mean(axis=1, keepdims=True)
    particles["deviator"] = deviator
    made = Stepper(particles, formulation, [ALUMINIUM], LEAPFROG.stage, LEAPFROG.previous, 1.4 * DX)
    made.start()
    made.permute()
    made.evaluate()
    return made


def best(call: Callable[[], object], repetitions: int) -> float:
    """Return the shortest time [s] of several calls."""
    times = []
    for _ in range(repetitions):
        start = time.process_time()
        call()
        times.append(time.process_time() - start)
    return min(times)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--dims", default="23")
    parser.add_argument("--laws", default=",".join(LAWS))
    arguments = parser.parse_args()
    numba.set_num_threads(1)
    print(f"{'law':<20}{'dim':>4}{'particles':>11}{'pairs':>9}{'update':>9}{'criteria':>10}{'sum':>9}")
    for dim in map(int, arguments.dims):
        for law in arguments.laws.split(","):
            made = block(LAWS[law], dim)
            count = made.particles.count
            criteria = Criteria(dim, count, 0.3, LAWS[law].viscous_factor)
            repetitions = 30 if dim < 3 else 5
            costs = [
                1e6 / count * best(call, repetitions)
                for call in (
                    made.evaluate,
                    lambda made=made: made.complete(1e-14, 1e-14),
                    lambda made=made, c=criteria: c.limit(
                        made.lengths, made.signals, made.rates, made.place, made.particles.id
                    ),
                )
            ]
            print(f"{law:<20}{dim:>4}{count:>11}{costs[0]:>9.4f}{costs[1]:>9.4f}{costs[2]:>10.4f}{sum(costs):>9.4f}")


if __name__ == "__main__":
    main()
