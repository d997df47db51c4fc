"""The regime of a case, and advice where what it has chosen is outside what the verification shows to hold.

The impact pressure of the two bodies that meet first against their strength tells whether waves stay elastic, plastic
strains decide, or a shock does; `docs/verification.md` has the figures that the advice leans on.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from hvisph.case.formulations.riemann import following, is_gas
from hvisph.simulation.impact_pressure import impact_pressure
from hvisph.simulation.meeting import meeting

if TYPE_CHECKING:
    from hvisph.case.bodies import Body
    from hvisph.case.case import Case
    from hvisph.materials.table import Material

# Pressure over strength below which a body stays elastic, and above which its strength matters little to the waves.
ELASTIC, SHOCK = 1.0, 10.0
# Of the speed of sound: what moves slower than this, and for many crossings, swings rather than rings.
SLOW, CROSSINGS = 0.01, 20.0
# And what never yields below this share of it: balls of 11 particles across that meet part with 0.2 of their speed in
# contact SPH at 5 m/s and with half of it at 50, by Total Lagrangian kernels with 0.987.
BOUNCING = 0.1
# Particle velocity over the speed of sound beyond which density that does not keep to the spacing is off by 2 %.
STRONG = 0.3
# Pressure over strength above which a plate may be punched, and speeds below which it is, rather than burst [m/s].
PUNCHED = 2.0
BALLISTIC = 1200.0
POINTED = ("cone", "ogive")
# Particles across a projectile from which on it shears out plugs in time, and up to which contact SPH slows it.
BAND, COARSE = 60.0, 24.0
# Courant number up to which contact SPH was verified.
LONGEST_STEP = 0.35
# Length over width of a rod, particles across from which on it erodes as it should, and speeds up to which it matters
# [m/s]: measured with 25 mm of `tungsten-alloy-wnife`, 5 mm across, in `steel-4340`, rings.
SLENDER, EVEN, ERODING = 3.0, 20.0, 2500.0
# Impact pressure up to which strength is felt [Pa], and materials of the library that are liquids.
FELT = 20e9
LIQUIDS = ("water",)
# Particles across a body below which its waves and its bending are not resolved.
FEWEST_ACROSS = 5


@dataclass(frozen=True)
class Regime:
    """What the two bodies that meet first do to each other.

    Parameters
    ----------
    velocity
        Closing velocity of the first two bodies to meet, or of one and its image [m/s]; 0 where nothing closes.
    pressure
        Impact pressure, acoustic: a shock's is higher [Pa].
    strength
        Least yield stress of the bodies that have one [Pa]; None without one, infinite where all are elastic.
    liquids
        Those of the two that have none.
    """

    velocity: float
    pressure: float
    strength: float | None
    liquids: tuple[str, ...] = ()

    @property
    def words(self) -> str:
        """The regime in a few words."""
        if self.velocity <= 0.0:
            return "no two bodies close: no impact"
        if self.strength is None:
            return "shock in materials without strength"
        over = self.pressure / self.strength if self.strength > 0.0 else math.inf
        if over < ELASTIC:
            but = f" of all but {', '.join(self.liquids)}, without strength" if self.liquids else ""
            return f"elastic: the impact pressure is below the strength{but}"
        if over < SHOCK:
            return f"ballistic: the impact pressure is about {over:.2g} times the strength, plastic flow decides"
        return f"shock: the impact pressure is about {over:.0f} times the strength"


def regime(case: Case) -> Regime:
    """Return the regime of a case."""
    materials = _materials(case)
    met = meeting(case)
    velocity = against_wall(case) if met is None else met.velocity
    names = [next(iter(case.bodies))] * 2 if met is None else [met.first, met.second]
    first, second = (_material(case.bodies[name]) for name in names)
    one, other = (m.density_at_rest * m.bulk_sound_speed for m in (first, second))
    pressure = velocity * one * other / (one + other)
    if first.porosity is not None or second.porosity is not None:  # pores crush far below the speed of sound
        pressure = min(pressure, impact_pressure(first, second, velocity))
    known = [y for y in (_strength(material, pressure) for material in materials) if y is not None]
    liquids = () if met is None else tuple(name for name, one in zip(names, (first, second), strict=True)
                                           if one.strength.name == "none")  # fmt: skip
    return Regime(velocity, pressure, min(known, default=None), liquids)


def against_wall(case: Case) -> float:
    """Return the closing velocity of a body and its image in a plane across x that it flies at [m/s]; 0 for none."""
    body = next(iter(case.bodies.values()))
    if body.position is None:
        return 0.0
    closing = [
        math.copysign(2.0, plane.at - body.position[0]) * body.velocity[0]
        for plane in case.symmetry
        if plane.axis == "x"
    ]
    return max([0.0, *closing])


def advice(case: Case) -> list[str]:
    """Return what a user should consider of formulation, contact, smoothing length and damage."""
    from hvisph.simulation.shock import beyond_measured

    kind = regime(case)
    return [
        *_still(case, kind),
        *beyond_measured(case),
        *_slow(case, kind),
        *_punching(case, kind),
        *_eroding(case, kind),
        *_hasty(case),
        *_strong(case, kind),
        *_peaks(case, kind),
        *_gas(case),
        *_loaded(case),
        *_brittle(case, kind),
        *_spalling(case, kind),
        *_liquid(case, kind),
    ]


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


def _materials(case: Case) -> list[Material]:
    return [_material(body) for body in case.bodies.values()]


def _material(body: Body) -> Material:
    from hvisph.simulation.materials import material_of

    return material_of(body.material, body.internal_energy)


def _strength(material: Material, pressure: float) -> float | None:
    """Return what a material yields at, cold, slow and undamaged, under a pressure: rock bears more under more."""
    from hvisph.simulation.material_point import flow_at

    name = material.strength.name
    if name == "none":
        return None
    return math.inf if name == "elastic" else flow_at(material, None, 0.0, 1.0, pressure)


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


def _slow(case: Case, kind: Regime) -> Iterator[str]:
    """Bodies that swing, bend or spin: kernels in the current configuration damp that away."""
    model: Any = case.formulation
    if model.type not in ("riemann", "eulerian") or kind.strength is None or any(_still(case, kind)):
        return
    materials = _materials(case)
    fastest = max(math.dist(body.velocity, (0.0,) * case.dim) for body in case.bodies.values())
    slowest = min(material.bulk_sound_speed for material in materials)
    # some shapes know their size only where they stand
    size = max((size for body in case.bodies.values() for size in body.shape.extent()), default=math.inf)
    elastic = kind.pressure < ELASTIC * kind.strength
    slow = BOUNCING if math.isinf(kind.strength) else SLOW
    if elastic and fastest < slow * slowest and case.time.end > CROSSINGS * size / slowest:
        lost = "" if model.angular_momentum == "kept" else ", and loses spin,"
        yield (
            f"formulation: the bodies stay elastic and move slowly over {case.time.end * slowest / size:.3g} crossings "
            f"of their waves, and '{model.type}' damps swinging and bouncing{lost} within a few; take total_lagrangian"
        )


def pointed(shape: Any) -> bool:
    """Tell whether a shape, or what a hollow one is cut from, has a nose that parts a plate rather than punches it."""
    return getattr(shape, "whole", shape).type in POINTED


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
    if across < BAND:
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
    if case.formulation.type == "riemann" and across < COARSE:
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
                "plates spalled at 3.0 depths of a crater and do so at 1.8 here, at 2.6 with the metal's "
                "spall_strength beside it (docs/validation.md); give it where spall decides"
            )
            return


def _hasty(case: Case) -> Iterator[str]:
    """Yield what is to be said of steps longer than contact SPH was verified with."""
    if case.formulation.type == "riemann" and case.time.step is None and case.time.cfl > LONGEST_STEP:
        yield (
            f"time.cfl: {case.time.cfl:g} is beyond the {LONGEST_STEP:g} that 'riemann' was verified with; from 0.4 on "
            "tension that should be held opens gaps, from 0.5 on slow elastic bodies break; leave it out"
        )


def _strong(case: Case, kind: Regime) -> Iterator[str]:
    """Shocks stronger than a scheme keeps its figures in."""
    model: Any = case.formulation
    if kind.velocity <= 0.0:
        return
    met = meeting(case)
    material = _material(next(iter(case.bodies.values())) if met is None else case.bodies[met.second])
    share = 0.5 * kind.velocity / material.bulk_sound_speed
    if model.type == "riemann" and model.form == "printed" and share > STRONG / 2:
        yield (
            "formulation.form: 'printed' loses stress behind strong shocks, 2 % at 3 km/s and 37 % at 24 in aluminium; "
            "take 'consistent'"
        )
    if model.type == "eulerian" and getattr(model, "density_form", "mass") == "volume" and share > 1.5 * STRONG:
        yield (
            "formulation.density_form: 'volume' drifts from the particles' spacing in shocks this strong, by up to 6 % "
            "of the stress at 24 km/s in aluminium; take 'mass', or the formulation riemann"
        )
    if model.type == "total_lagrangian" and kind.strength is not None and kind.pressure > SHOCK * kind.strength:
        yield (
            "formulation: an impact pressure of more than ten times the strength brings strains that reference kernels "
            "do not survive; take riemann, adaptive, which lets such particles go, or give renew_reference: 0.3"
        )


def _peaks(case: Case, kind: Regime) -> Iterator[str]:
    """Pressures of single particles that the lattice or the rim of a contact makes, in shocks."""
    if kind.velocity <= 0.0 or kind.strength is None or kind.pressure < SHOCK * kind.strength:
        return
    for name, body in case.bodies.items():
        if body.arrangement == "lattice_two_rings":
            yield (
                f"bodies.{name}.arrangement: 'lattice_two_rings' has holes in its middle: single particles on the axis "
                "read 1.3 times what 'square' and 'rings' read; take one of these, or a mean, where peaks count"
            )
    round_faces = any(body.shape.type == "sphere" for body in case.bodies.values())
    if case.formulation.type == "eulerian" and case.dim == 3 and round_faces:
        yield (
            "formulation: where a sphere meets another body in 3D 'eulerian' leaves single particles of the rim of the "
            "contact at up to 1.2 times the pressure of a flat impact, more of them at finer spacings (riemann: 1.09); "
            "take riemann where peaks count"
        )


def _gas(case: Case) -> Iterator[str]:
    model: Any = case.formulation
    names = [name for name, body in case.bodies.items() if is_gas(body)]
    gases = f"{', '.join(names)} is a gas or becomes one"
    if names and model.type in ("total_lagrangian", "adaptive"):
        yield (
            f"formulation: {gases}, which no reference kernel follows; take riemann, or give such bodies "
            "`formulation: eulerian`"
        )
    wanted = following(case.bodies.values(), case.kinematics)
    if names and model.type in ("riemann", "eulerian") and model.smoothing_length.type == "fixed":
        yield (
            f"formulation.smoothing_length: fixed, and {gases}, whose particles part by more than a fixed kernel "
            f"reaches; give {{{', '.join(f'{key}: {value}' for key, value in wanted.items())}}}"
        )
    plain = model.type == "eulerian" and model.correction.type == "none" and model.density_form == "volume"
    if plain and all(body.material.eos.type == "ideal_gas" for body in case.bodies.values()):
        yield (
            "formulation.density_form: 'volume' has density and pressure of a gas a fifth too high behind a shock that "
            "squeezes it fourfold (docs/verification.md, noh); take 'mass', or the formulation riemann"
        )


def _loaded(case: Case) -> Iterator[str]:
    """Repulsion between bodies that are placed nearer than a spacing begins with energy of its own."""
    contact = getattr(case.formulation, "contact", None)
    if contact is None or contact.type != "repulsive" or case.formulation.type != "eulerian":
        return
    for name, body in list(case.bodies.items())[1:]:
        if body.position is None and body.gap < 0.5 * case.resolution:
            yield (
                f"formulation.contact: 'repulsive' starts loaded where bodies touch: bodies.{name} is pushed off at "
                f"rest; give it a gap of {case.resolution:g}, or take 'separating'"
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
        end = math.log(-damage.d1 / damage.d2) / damage.d3
        if end < TRIAXIALITY_LIMIT:
            yield (
                f"bodies.{name}.material.damage: the strain to failure falls to nothing at a triaxiality of {end:.3g}, "
                "so that the tension of a release fails it at once: Taylor bars that held break so; where nothing "
                "breaks, or a spall strength is known, give damage none or pressure_cutoff"
            )
