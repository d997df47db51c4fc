"""Solids of revolution as rings about an axis: implosions to a point and to the axis, whose exact ends are known.

The sphere of cold gas and the plastic shells are those of `noh` and `implosion`, in the half-plane (x, r): what is
spherical must stay so, at the axis as far from it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from hvisph_validation.structures import Shell

from hvisph.core.particles import Particles
from hvisph.setup.bodies import PlacedBody
from hvisph.verification.problem import EULERIAN, SOLIDS, Figure, Options, Problem, Ran, Start, Trial, limit, vectors
from hvisph.visualization.curves import Curve

from .implosion import SHELLS, STIFF, TIMES, rings
from .noh import SPHERE, Implosion, trial

# Of rings the pairs keep energy to round-off.
RINGS = Implosion("spherical, axisymmetric", 3, "axisymmetric", SPHERE, (0.025, 0.05), 0.15, "x", 1e-12)
RADIUS = "radius of the inner layer"
LONG = 8  # spacings between the planes of a piece of a cylinder


def _trials(options: Options) -> Iterator[Trial]:
    yield _shell("cylinder", SHELLS["cylinder"], options.dx(1.5e-3, 2.5e-3))
    yield _shell("sphere", SHELLS["sphere"], options.dx(1.5e-3, 2.5e-3))


def _gas(options: Options) -> Iterator[Trial]:
    yield trial(RINGS, options)


def _shell(name: str, shell: Shell, dx: float) -> Trial:
    sphere, end = shell.dimensions == 3, LONG * dx
    shape = {"type": "hollow_sphere"} if sphere else {"type": "tube", "length": end}
    case = {
        "title": f"imploding axisymmetric {name}",
        "kinematics": "axisymmetric",
        "resolution": dx,
        "bodies": {"shell": {"material": STIFF, "position": [0.0 if sphere else 0.5 * end, 0.0],
                             "shape": shape | {"outer_diameter": 2 * shell.outer, "inner_diameter": 2 * shell.inner}}},
        "symmetry": [{"axis": "x"}] if sphere else [{"axis": "x"}, {"axis": "x", "at": end, "keep": "below"}],
        "time": {"end": TIMES[shell.dimensions]},
    }  # fmt: skip

    def smooth(placed: list[PlacedBody]) -> list[PlacedBody]:
        (body,) = placed
        if not sphere:
            return placed
        positions, areas = rings(shell.inner, shell.outer, dx)
        volumes = 2.0 * np.pi * positions[:, 1] * areas
        volumes *= 2.0 / 3.0 * np.pi * (shell.outer**3 - shell.inner**3) / volumes.sum()
        return [replace(body, positions=positions, volumes=volumes, spacing=np.full(len(volumes), dx))]

    def inwards(particles: Particles) -> None:
        x = particles["position"] * ((1.0, 1.0) if sphere else (0.0, 1.0))
        r = np.linalg.norm(x, axis=1)[:, None]
        particles["velocity"] = -shell.speed * (shell.inner / r) ** (shell.dimensions - 1) * x / r

    def figures(runs: Sequence[Ran]) -> Iterator[Figure]:
        before, now, strain = _face(runs[0], shell)
        exact = shell.radius(before, shell.stop)
        yield Figure("final radius of the inner layer", float(now.mean()), float(exact.mean()), 0.02, "m",
                     why="its speed is that of the face within some per cent")  # fmt: skip
        yield limit("roundness of the inner layer", float(now.std() / now.mean()), 0.02,
                    why="at the axis as far from it")  # fmt: skip
        of_displacement = shell.strain(before, now)
        yield Figure(
            "plastic strain over that of the displacement", float((strain / of_displacement).mean()), 1.0, 0.05
        )
        yield limit("drift of energy", abs(float(runs[0].summary["conservation"]["energy_drift"])), 1e-12,
                    why="the pairs keep it to round-off")  # fmt: skip

    def curves(runs: Sequence[Ran]) -> dict[str, list[Curve]]:
        before, now, _ = _face(runs[0], shell)
        start = vectors(runs[0].first, "position")
        start = start[_distance(start, shell) < shell.inner + runs[0].dx]
        start = start[:, 0]  # the axis is at the right of a sphere
        order = np.argsort(start)
        exact = shell.radius(before, shell.stop)
        return {RADIUS: [Curve("computed", start[order], now[order]),
                         Curve("exact", start[order], exact[order], exact=True)]}  # fmt: skip

    return Trial(name, [Start(case, smooth, inwards)], figures, curves, units={RADIUS: "m"})


def _distance(position: np.ndarray, shell: Shell) -> np.ndarray:
    """Return the distance from the middle of a sphere, or from the axis of a cylinder [m]."""
    return np.asarray(np.linalg.norm(position, axis=1) if shell.dimensions == 3 else position[:, 1])


def _face(ran: Ran, shell: Shell) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return radii at the start and now, and plastic strains, of the particles of the innermost layer."""
    r0, r = (_distance(vectors(snapshot, "position"), shell) for snapshot in (ran.first, ran.last))
    inner = r0 < shell.inner + ran.dx
    return r0[inner], r[inner], ran.last.fields["plastic_strain"][inner]


GAS_PROBLEM = Problem(
    "axisymmetric_gas", "axisymmetric particles: Noh's sphere, state behind the shock", _gas, EULERIAN,
    "initial neighbours do not stay neighbours in a gas 64 times as dense",
)  # fmt: skip
PROBLEM = Problem(
    "axisymmetric", "axisymmetric particles: plastic shells collapse and stay round", _trials, SOLIDS
)  # fmt: skip
