"""Shock tubes of Sod and of Woodward and Colella, with the exact Riemann solution.

Both gases start on one spacing. The tubes are longer than what is looked at, so that nothing comes from their ends.
Sod: J. Comput. Phys. 27 (1978) 1. Woodward & Colella: J. Comput. Phys. 54 (1984) 115, the left half.
"""

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from hvisph.exact.gas import GasState, riemann
from hvisph.verification.problem import Figure, Options, Problem, Ran, Start, Trial, limit, vectors
from hvisph.visualization.curves import Curve

GAMMA = 1.4
SEEN = 0.5  # of the tube on either side
COLUMNS = ("density", "pressure", "velocity")
WHY = "of the mean of the exact profile; contact and shock are spread over a few particles"
SOD = (GasState(1.0, 0.0, 1.0), GasState(0.125, 0.0, 0.1))
BLAST = (GasState(1.0, 0.0, 1000.0), GasState(1.0, 0.0, 0.01))


def tube(states: tuple[GasState, GasState], end: float, lengths: tuple[float, float], dx: float) -> Trial:
    """Return a tube of two gases at rest, of the given lengths, until `end`, with the spacing `dx`."""
    case = {
        "title": "shock tube",
        "units": "none",
        "kinematics": "uniaxial_strain",
        "resolution": dx,
        "bodies": {
            name: {
                "material": {"density": state.density, "eos": {"type": "ideal_gas", "gamma": GAMMA}},
                "shape": {"type": "interval", "length": length},
                "internal_energy": state.pressure / ((GAMMA - 1.0) * state.density),
            }
            for name, state, length in zip(("left", "right"), states, lengths, strict=True)
        },
        "time": {"end": end},
    }
    exact = riemann(*states, GAMMA)

    def profiles(ran: Ran) -> tuple[np.ndarray, dict[str, np.ndarray], dict[str, np.ndarray]]:
        x = vectors(ran.last, "position")[:, 0]
        order = np.argsort(x)
        order = order[np.abs(x[order]) < SEEN]
        computed = {name: ran.last.fields[name].reshape(len(x))[order] for name in COLUMNS}
        return x[order], computed, exact.sample(x[order] / ran.last.time)

    def figures(runs: Sequence[Ran]) -> Iterator[Figure]:
        x, computed, right = profiles(runs[0])
        width = np.gradient(x)  # particles are dense behind the shock: the mean is over the length
        for name in COLUMNS:
            error = (np.abs(computed[name] - right[name]) * width).sum() / (np.abs(right[name]) * width).sum()
            yield limit(f"L1 error of the {name}", float(error), 0.015, why=WHY)
        yield limit("drift of energy", abs(float(runs[0].summary["conservation"]["energy_drift"])), 1e-4)

    def curves(runs: Sequence[Ran]) -> dict[str, list[Curve]]:
        x, computed, right = profiles(runs[0])
        return {n: [Curve("computed", x, computed[n]), Curve("exact", x, right[n], exact=True)] for n in COLUMNS}

    return Trial(f"dx {dx:g}", [Start(case)], figures, curves)


def _trials(
    states: tuple[GasState, GasState], end: float, lengths: tuple[float, float], full: float, quick: float
) -> Callable[[Options], Iterator[Trial]]:
    def trials(options: Options) -> Iterator[Trial]:
        yield tube(states, end, lengths, options.dx(full, quick))

    return trials


SOD_PROBLEM = Problem(
    "sod", "Sod's shock tube: L1 errors against the Riemann problem", _trials(SOD, 0.2, (0.8, 0.9), 0.0025, 0.005)
)
BLAST_PROBLEM = Problem(
    "blast",
    "blast wave, pressures 1000 : 0.01, against the Riemann problem",
    _trials(BLAST, 0.012, (1.0, 0.6), 0.00125, 0.005),
)
