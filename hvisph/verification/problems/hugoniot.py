"""Flat impact of strengthless metals: stress, density and energy behind the shocks, by the jump conditions.

Plates of one spacing meet; before any release the state between the shocks is uniform. It is read
between ten particles from the interface and three quarters of the shock's way, and held against
impedance matching of the two Hugoniots. In two dimensions the same on the axis of a strip that is
too wide for the release from its edges.
"""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from hvisph.case.materials.material import Material
from hvisph.core.text import Plain
from hvisph.exact.hugoniot import Impact, impedance_match
from hvisph.setup.materials import material_of
from hvisph.verification import problem
from hvisph.visualization.curves import Curve

METALS = {
    "aluminium": "aluminium-howell-ball",
    "aluminium (Mie-Grueneisen)": "aluminium-howell-ball-mie-gruneisen",
    "steel": "steel-howell-ball",
    "steel (Mie-Grueneisen)": "steel-howell-ball-mie-gruneisen",
    "copper": "copper-ofhc",
    "tungsten": "tungsten",
}
SPEEDS = (600.0, 3100.0, 6000.0, 12000.0, 24000.0)
PAIRS = (
    ("steel", "aluminium"),
    ("copper", "aluminium"),
    ("tungsten", "aluminium"),
    ("tungsten", "steel"),
    ("copper", "steel"),
    ("tungsten", "copper"),
)
LONG, SHORT = 200, 100  # particles along a plate
STRIP = (44, 100, 6)  # particles: along a plate, across half of it, read about the axis
SPACING = 25e-6  # [m]
NEAR = 10  # particles beside the interface that are left out: the wall-heated zone and its surroundings
SHARE = {1: 0.75, 2: 0.6}  # of the shock's way over which the state is read; a strip is short
HEATED = 0.02  # difference of density that counts as wall heating
WHY = "a conservative scheme owes the jump conditions; the rest is the lattice sum of the kernel, 0.4 %"


def _trials(options: problem.Options) -> Iterator[problem.Trial]:
    dx = options.dx(SPACING, SPACING)
    if options.quick:
        yield _trial("aluminium", "aluminium", 3100.0, dx, SHORT)
        yield _trial("aluminium", "aluminium", 12000.0, dx, SHORT)
        yield _trial("steel", "aluminium", 6000.0, dx, SHORT)
        return
    for metal in METALS:
        for speed in SPEEDS:
            yield _trial(metal, metal, speed, dx, LONG)
    for projectile, target in PAIRS:
        for speed in SPEEDS[1:4]:
            yield _trial(projectile, target, speed, dx, LONG)
    for projectile, target, speed in (
        ("aluminium", "aluminium", 3100.0),
        ("aluminium", "aluminium", 12000.0),
        ("steel", "aluminium", 6000.0),
    ):
        yield _trial(projectile, target, speed, dx, STRIP[0], STRIP[1])


def _trial(projectile: str, target: str, speed: float, dx: float, length: int, width: int = 0) -> problem.Trial:
    flyer, struck = problem.fluid(METALS[projectile]), problem.fluid(METALS[target])
    return flat_impact(f"{projectile} on {target}", flyer, struck, speed, dx, length, width)


def flat_impact(
    name: str, projectile: Plain, target: Plain, speed: float, dx: float, length: int, width: int = 0
) -> problem.Trial:
    """Return the flat impact of two materials without strength, its `speed` and dimensions added to `name`.

    `dx` is the spacing [m]; `length`, `width` count particles along each plate and across half of a strip (0: 1D).
    """
    shape: Plain = {"type": "interval", "length": length * dx}
    at_rest = [0.0]
    if width:
        shape, at_rest = {"type": "box", "size": [length * dx, 2 * width * dx]}, [0.0, 0.0]
    exact = impedance_match(_material(projectile), _material(target), speed)
    fastest = max(exact.projectile.shock_speed, exact.target.shock_speed)
    case: Plain = {
        "title": f"{name} at {speed / 1e3:g} km/s",
        "kinematics": "plane_strain" if width else "uniaxial_strain",
        "resolution": dx,
        "bodies": {
            "projectile": {"material": projectile, "shape": shape, "velocity": [speed, *at_rest[1:]]},
            "target": {"material": target, "shape": shape},
        },
        "time": {"end": 0.8 * length * dx / fastest},
    }
    if width:
        case["symmetry"] = [{"axis": "y"}]
    return problem.Trial(
        f"{name} {speed / 1e3:g} km/s {'2D strip' if width else '1D'}", [problem.Start(case)], _figures, _curves
    )


def _material(model: Plain) -> Any:
    return material_of(Material.model_validate(model))


def _exact(ran: problem.Ran) -> Impact:
    speed = ran.case.bodies["projectile"].velocity[0]
    return impedance_match(
        problem.body_material(ran.case, "projectile"), problem.body_material(ran.case, "target"), speed
    )


def _figures(runs: Sequence[problem.Ran]) -> Iterator[problem.Figure]:
    (ran,) = runs
    exact, last = _exact(ran), ran.last
    axis = np.ones(last.count, bool)
    steps = np.floor(
        np.abs(problem.vectors(ran.first, "position")[:, 0]) / ran.dx
    )  # particles from the interface at the start
    if last.dimensions > 1:
        axis = problem.vectors(ran.first, "position")[:, 1] < STRIP[2] * ran.dx
    heated = 0
    for body, (name, state) in enumerate({"projectile": exact.projectile, "target": exact.target}.items()):
        reach = SHARE[last.dimensions] * state.shock_speed * last.time / ran.dx
        mine = (last.body == body) & axis
        inside = mine & (steps >= NEAR) & (steps <= reach)
        for what, values, value, tolerance, unit in (
            ("stress", problem.stress_xx(last), exact.pressure, 0.01, "Pa"),
            ("density", last.fields["density"], state.density, 0.01, "kg/m^3"),
            ("energy", last.fields["internal_energy"], state.energy, 0.02, "J/kg"),
        ):
            yield problem.Figure(f"{what} in the {name}", float(values[inside].mean()), value, tolerance, unit, why=WHY)
        rho = last.fields["density"]
        heated_rows = mine & (steps <= reach) & (np.abs(rho / rho[inside].mean() - 1.0) > HEATED)
        heated = max(heated, int(steps[heated_rows].max()) + 1 if heated_rows.any() else 0)
    yield problem.limit("wall-heated particles per side", heated, 5, why="density off by more than 2 %")


def _curves(runs: Sequence[problem.Ran]) -> dict[str, list[Curve]]:
    (ran,) = runs
    last, exact = ran.last, _exact(ran)
    x = problem.vectors(last, "position")[:, 0]
    order = np.argsort(x)
    if last.dimensions > 1:
        order = order[problem.vectors(ran.first, "position")[order, 1] < ran.dx]
    t, u = last.time, exact.interface_velocity
    edges = [x.min(), exact.projectile_shock_velocity * t, u * t, exact.target_shock_velocity * t, x.max()]
    states = (exact.projectile, exact.target)
    cold = [problem.body_material(ran.case, body).density for body in ("projectile", "target")]
    exact_values = {
        "pressure": [0.0, *(state.pressure for state in states), 0.0],
        "density": [cold[0], *(state.density for state in states), cold[1]],
        "internal_energy": [0.0, *(state.energy for state in states), 0.0],
    }
    right = {name: np.repeat(values, 2) for name, values in exact_values.items()}
    computed = {name: last.fields[name][order] for name in right}
    return problem.computed_and_exact(x[order], computed, np.repeat(edges, 2)[1:-1], right)


PROBLEM = problem.Problem("hugoniot", "flat impacts of metals from 0.6 to 24 km/s: state behind the shocks", _trials)
