"""Plastic shells that collapse and come to rest: where the inner face stops, and its plastic strain.

Verney's problem: the motion is gone where plastic work has taken it, and geometry alone gives the strain.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from hvisph_validation.structures import Shell

from hvisph.core.particles import Particles
from hvisph.setup.bodies import PlacedBody
from hvisph.verification.problem import ALL, Figure, Options, Problem, Ran, Start, Trial, vectors
from hvisph.visualization.curves import Curve

SHELLS = {
    "cylinder": Shell(2, 60e-3, 75e-3, 40e-3, 2700.0, 0.25e9),
    "sphere": Shell(3, 60e-3, 75e-3, 42e-3, 2700.0, 0.25e9),
}
STIFF: dict[str, Any] = {  # stiff, so that its compression does not show
    "density": 2700.0,
    "eos": {"type": "linear", "bulk_modulus": 270e9},
    "strength": {"type": "von_mises", "shear_modulus": 120e9, "yield_stress": 0.25e9},
}
TIMES = {2: 170e-6, 3: 150e-6}  # by which the shells are at rest [s]


def _trials(options: Options) -> Iterator[Trial]:
    yield collapse("cylinder", SHELLS["cylinder"], options.dx(1.5e-3, 2.5e-3))
    if not options.quick:
        yield collapse("sphere", SHELLS["sphere"], options.dx(2.5e-3, 3.75e-3))


def collapse(name: str, shell: Shell, dx: float) -> Trial:
    """Return the collapse of `shell` with the spacing `dx` [m]."""
    dim = shell.dimensions
    case = {
        "title": f"imploding {name}",
        "kinematics": "plane_strain" if dim == 2 else "three_d",
        "resolution": dx,
        "bodies": {"shell": {"material": STIFF, "position": [0.0] * dim,
                             "shape": {"type": "disc" if dim == 2 else "sphere", "diameter": 2.0 * shell.outer}}},
        "symmetry": [{"axis": axis} for axis in "xyz"[:dim]],
        "time": {"end": TIMES[dim]},
    }  # fmt: skip

    def hollow(placed: list[PlacedBody]) -> list[PlacedBody]:
        (body,) = placed
        if dim == 2:
            positions, volumes = rings(shell.inner, shell.outer, dx)
            return [replace(body, positions=positions, volumes=volumes, spacing=np.full(len(volumes), dx))]
        outer = np.linalg.norm(body.positions, axis=1) > shell.inner
        parts = {name: getattr(body, name)[outer] for name in ("positions", "volumes", "spacing")}
        return [replace(body, **parts)]

    def inwards(particles: Particles) -> None:
        x = particles["position"]
        r = np.linalg.norm(x, axis=1)[:, None]
        particles["velocity"] = -shell.speed * (shell.inner / r) ** (dim - 1) * x / r

    def figures(runs: Sequence[Ran]) -> Iterator[Figure]:
        before, after, strain = _face(runs[0], shell)
        exact = shell.radius(before, shell.stop)
        yield Figure("final radius of the inner layer", float(after.mean()), float(exact.mean()), 0.02, "m",
                     why="its speed is that of the face within some per cent")  # fmt: skip
        of_displacement = shell.strain(before, after)  # of the way that it has gone, not of the way that it should have
        yield Figure(
            "plastic strain over that of the displacement", float((strain / of_displacement).mean()), 1.0, 0.05
        )
        yield Figure("plastic strain of the inner layer", float(strain.mean()),
                     float(shell.strain(before, exact).mean()), 0.05)  # fmt: skip

    def curves(runs: Sequence[Ran]) -> dict[str, list[Curve]]:
        last = runs[0].last
        r0, r = (np.linalg.norm(vectors(snapshot, "position"), axis=1) for snapshot in (runs[0].first, last))
        order = np.argsort(r)
        exact = shell.strain(r0[order], shell.radius(r0[order], shell.stop))
        return {"plastic_strain": [Curve("computed", r[order], last.fields["plastic_strain"][order]),
                                   Curve("exact", shell.radius(r0[order], shell.stop), exact, exact=True)]}  # fmt: skip

    return Trial(name, [Start(case, hollow, inwards)], figures, curves, across="r")


def rings(inner: float, outer: float, dx: float) -> tuple[np.ndarray, np.ndarray]:
    """Return places (n, 2) [m] and volumes (n,) [m^2] of a quarter of a cylinder, in rings between smooth faces."""
    layers = round((outer - inner) / dx)
    step = (outer - inner) / layers
    places, volumes = [], []
    for layer in range(layers):
        radius = inner + (layer + 0.5) * step
        count = round(0.5 * np.pi * radius / dx)
        angle = 0.5 * np.pi * (np.arange(count) + 0.5) / count
        places.append(radius * np.column_stack([np.cos(angle), np.sin(angle)]))
        volumes.append(np.full(count, 0.5 * np.pi * radius * step / count))
    return np.concatenate(places), np.concatenate(volumes)


def _face(ran: Ran, shell: Shell) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return radii at the start and now, and plastic strains, of the particles of the innermost layer."""
    r0, r = (np.linalg.norm(vectors(snapshot, "position"), axis=1) for snapshot in (ran.first, ran.last))
    inner = r0 < shell.inner + ran.dx
    return r0[inner], r[inner], ran.last.fields["plastic_strain"][inner]


PROBLEM = Problem("implosion", "plastic shells collapse: final radius, strain of the free face", _trials, ALL)
