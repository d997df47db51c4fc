"""Advice on a case: on its bodies, spacing and materials here, on its scheme in `scheme_advice`.

What it is held against is in `docs/verification.md` and `docs/validation.md`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from hvisph.core.errors import CaseError

from .impact_pair import meeting
from .regime import SHOCK, Regime, against_wall, regime
from .scheme_rules import scheme_advice

if TYPE_CHECKING:
    from hvisph.case.case import Case

# Pressure over strength above which a plate may be punched, and speeds below which it is, rather than burst [m/s].
PUNCHED = 2.0
BALLISTIC = 1200.0
POINTED, ROUND_NOSED = ("cone", "ogive"), ("sphere", "hollow_sphere", "disc", "annulus", "dome", "rounded_cylinder")
# Particles across a projectile from which on it shears out plugs in time, and up to which contact SPH slows it.
BAND, COARSE = 60.0, 24.0
# Length over width of a rod, particles across from which on it erodes as it should, and speeds up to which it matters
# [m/s]: measured with 25 mm of `tungsten-alloy-wnife`, 5 mm across, in `steel-4340`, rings.
SLENDER, EVEN, ERODING = 3.0, 20.0, 2500.0
# Smoothing length over spacing from which on the foot of a bar in 3D holds together.
WIDE = 1.5
# Impact pressure up to which strength is felt [Pa], and materials of the library that are liquids.
FELT = 20e9
LIQUIDS = ("water",)
# Particles across a body below which its waves and its bending are not resolved.
FEWEST_IN_WALL = 3.0  # particles across a wall of a mesh
SHEET = 0.2  # of the least extent of a mesh: below it a body is of sheet; a solid ball has a third
FEWEST_ACROSS = 5


def advice(case: Case) -> list[str]:
    """Return what a user should consider of formulation, contact, smoothing length and damage."""
    from .hugoniot_check import beyond_measured

    kind = regime(case)
    still = list(_still(case, kind))
    return [
        *still,
        *beyond_measured(case),
        *scheme_advice(case, kind, bool(still)),
        *_punching(case, kind),
        *_eroding(case, kind),
        *_spreading(case, kind),
        *_brittle(case, kind),
        *_spalling(case, kind),
        *_liquid(case, kind),
        *_thin_walls(case),
    ]


def _thin_walls(case: Case) -> Iterator[str]:
    """Meshes of sheet that the spacing does not resolve: of shapes with sizes these are refused."""
    for name, body in case.bodies.items():
        if body.shape.type == "mesh":
            from hvisph.setup.shapes import shape_of

            try:
                shape, dx = shape_of(body.shape, case.drawing_dimensions), body.resolution or case.resolution
            except CaseError as error:
                raise CaseError(error.message, where=f"bodies.{name}.{error.where}") from error
            wall = getattr(shape, "thickness", math.inf)
            if wall < min(FEWEST_IN_WALL * dx, SHEET * min(shape.extent())):
                yield (
                    f"bodies.{name}: its walls are {wall * 1e3:.3g} mm thick in the mean, {wall / dx:.2g} particles: "
                    f"three are few, so give it a `resolution` of {wall / FEWEST_IN_WALL * 1e3:.2g} mm or finer"
                )


def sparse(across: dict[str, int]) -> list[str]:
    """Return which bodies have too few particles across to be resolved, from the numbers by name."""
    return [
        f"bodies.{name}: {count} particles across do not resolve its waves and its bending; {FEWEST_ACROSS} are few, "
        "10 show what matters: give a finer resolution"
        for name, count in across.items()
        if count < FEWEST_ACROSS
    ]


def tears(case: Case, kind: Regime) -> str:
    """Return what becomes of solids without damage in the tension that follows an impact; empty where none comes."""
    if kind.velocity <= 0.0 or kind.strength is None or kind.pressure < kind.strength:
        return ""
    names = [
        name
        for name, body in case.bodies.items()
        if body.material.strength.type != "none" and body.material.damage.type == "none"
    ]
    if not names:
        return ""
    what = "it has" if len(names) == 1 else "they have"
    return (
        f"releases bring tension of up to the impact pressure to {', '.join(names)}: {what} no model of damage, and "
        "may tear where the lattice lets go"
    )


def _still(case: Case, kind: Regime) -> Iterator[str]:
    """Cases in which nothing happens: a velocity was forgotten, or has the wrong sign."""
    bodies = case.bodies.values()
    driven = any(body.initial_velocity or body.internal_energy or body.temperature for body in bodies)
    driven = driven or any(body.material.eos.type in ("jwl", "ideal_gas") for body in bodies)
    if kind.velocity > 0.0 or driven or case.initial_loads:
        return
    moving = [name for name, body in case.bodies.items() if any(body.velocity)]
    if not moving:
        yield "bodies: none has a velocity, and nothing else sets them in motion: nothing will happen"
    elif len(case.bodies) > 1 and all(plane.axis != "x" for plane in case.symmetry):
        first = case.bodies[moving[0]]
        row = "; in a row the first body stands at x < 0 and meets the next flying towards +x"
        yield (
            f"bodies.{moving[0]}.velocity: no two bodies approach each other: nothing will be struck"
            f"{row if first.position is None else ''}"
        )


def pointed(shape: Any) -> bool:
    """Tell whether a shape, or what a hollow one is cut from, has a nose that parts a plate rather than punches it."""
    return _cut_from(shape) in POINTED


def _cut_from(shape: Any) -> str:
    """Return the type of a shape, or of what a hollow one is cut from."""
    return str(getattr(shape, "whole", shape).type)


def _punching(case: Case, kind: Regime) -> Iterator[str]:
    """Plates that are punched at ballistic speeds: contact SPH spreads the shear of a plug."""
    if not 0.0 < kind.velocity < BALLISTIC or len(case.bodies) < 2 or case.dim == 1:
        return
    met = meeting(case)
    struck = {name: body for name, body in case.bodies.items() if met is None or name != met.first}
    failing = {
        name: body.material.damage for name, body in struck.items() if body.material.damage.type == "johnson_cook"
    }
    if not failing or kind.strength is None or kind.pressure <= PUNCHED * kind.strength:
        return
    if met is not None and pointed(case.bodies[met.first].shape):
        return
    widths = [min(body.shape.extent()[1:], default=0.0) for name, body in case.bodies.items() if name not in struck]
    across = max(widths, default=0.0) / case.resolution
    # both figures are of flat cores: a round nose pushes metal aside before what is left of the plate shears
    flat = met is None or _cut_from(case.bodies[met.first].shape) not in ROUND_NOSED
    if flat and across < BAND:
        yield (
            "resolution: a blunt projectile shears out a plug along a band that 80 particles across it resolve; a "
            "limit came out 8 % too high with 60 and by more than 12 % with 40 (docs/validation.md); compare with a "
            "shot that was fired"
        )
    for name, damage in failing.items():
        if getattr(damage, "softening", 0.0) == 0.0:
            yield (
                f"bodies.{name}.material.damage: takes nothing from the yield stress before it fails, so that in a "
                "metal that hardens no band of shear forms and plugs leave too late; give `softening`, D_c, if the "
                "damage was published with one"
            )
            break
    if flat and case.formulation.type == "riemann" and across < COARSE:
        yield (
            "formulation: what punches a plate at this speed loses too much of its own in 'riemann' (a flat steel core "
            "at 850 m/s leaves 10 mm of aluminium at 616 m/s at 8 particles across, at 648 at 12, for 680); take "
            "adaptive, and compare with eulerian"
        )


def _eroding(case: Case, kind: Regime) -> Iterator[str]:
    """Rods that erode in thick metal: with few particles across they come to rest too early."""
    met = meeting(case)
    if met is None or case.formulation.type != "riemann" or case.dim == 1 or not 0.0 < kind.velocity < ERODING:
        return
    if kind.strength is None or kind.pressure < SHOCK * kind.strength:
        return
    rod, struck = (case.bodies[name].shape.extent() for name in (met.first, met.second))
    slender = rod and min(rod[1:]) > 0.0 and rod[0] > SLENDER * max(rod[1:])
    if slender and struck and struck[0] > max(rod[1:]) and max(rod[1:]) < EVEN * case.resolution:
        yield (
            "resolution: a rod that erodes stops too early with few particles across it: tungsten at 1.5 km/s goes "
            "0.75 of its length into steel at 8 across and 0.91 at 14; compare with a finer one"
        )


def _spreading(case: Case, kind: Regime) -> Iterator[str]:
    """Bars in 3D whose foot flattens: particles drawn apart both ways pass out of each other's reach."""
    model: Any = case.formulation
    if case.dim < 3 or model.type != "riemann" or model.h_over_dx >= WIDE or meeting(case) is not None:
        return
    if against_wall(case) > 0.0 and kind.strength is not None and kind.pressure > SHOCK * kind.strength:
        yield (
            "formulation.h_over_dx: in a foot that flattens against a wall in 3D particles draw apart beyond the "
            "reach of their kernels, and it spreads too wide: by 9 % at 1.2 in a bar that finite elements agree on, "
            f"{WIDE:g} is within 3 %; give that, or run the bar as rings"
        )


def _liquid(case: Case, kind: Regime) -> Iterator[str]:
    """Solids of the library without a strength, where an impact is no stronger than strength is felt."""
    from hvisph.casefile.material_library import library_of

    if kind.velocity <= 0.0 or kind.pressure > FELT or case.units != "si":
        return
    library = library_of()
    for name, body in case.bodies.items():
        model = body.material
        if model.strength.type == "none" and model.name in library.files and not model.name.startswith(LIQUIDS):
            yield (
                f"bodies.{name}.material: the library has no strength of '{model.name}', a liquid here; "
                "give it a `strength` where bending, penetration and what is left count"
            )


def _spalling(case: Case, kind: Regime) -> Iterator[str]:
    """Shocked plates whose damage knows plastic strain alone: spall comes too late."""
    if kind.velocity <= 0.0 or kind.strength is None or kind.pressure < kind.strength:
        return
    if case.dim > 1 and (kind.pressure < SHOCK * kind.strength or kind.velocity < BALLISTIC):
        return  # elsewhere plates are bent and punched before they spall
    for name, body in reversed(list(case.bodies.items())[1:]):
        damage: Any = body.material.damage
        if damage.type == "johnson_cook" and damage.spall_strength is None and damage.pressure_cutoff is None:
            yield (
                f"bodies.{name}.material.damage: johnson_cook adds up plastic strain, of which a release makes little: "
                "plates spalled at 3.0 depths of a crater and do so at 1.8 here, at 2.7 with the metal's "
                "spall_strength beside it (docs/validation.md); give it where spall decides"
            )
            return


def _brittle(case: Case, kind: Regime) -> Iterator[str]:
    """Fits of the strain to failure that leave nothing of it in tension: Taylor bars that held break by them."""
    if kind.velocity <= 0.0 or kind.strength is None or kind.pressure < kind.strength:
        return
    from hvisph.materials.damage.johnson_cook import TRIAXIALITY_LIMIT

    for name, body in case.bodies.items():
        damage: Any = body.material.damage
        if damage.type != "johnson_cook" or damage.d1 >= 0.0 or damage.d2 <= -damage.d1 or damage.d3 >= 0.0:
            continue
        if damage.high_triaxiality == "void_growth":
            continue
        end = math.log(-damage.d1 / damage.d2) / damage.d3
        if end < TRIAXIALITY_LIMIT:
            yield (
                f"bodies.{name}.material.damage: the strain to failure falls to nothing at a triaxiality of {end:.3g}, "
                "so that the tension of a release fails it at once: Taylor bars that held break so; give "
                "high_triaxiality: void_growth; where nothing breaks, damage none"
            )
