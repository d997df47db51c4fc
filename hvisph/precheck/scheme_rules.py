"""Advice on the scheme of a case: formulation, contact, smoothing length and step, held against the verification.

`docs/verification.md` has the figures that it leans on.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from hvisph.case.formulations.riemann import following, is_gas

from .impact_pair import meeting
from .regime import ELASTIC, SHOCK, Regime, material_of_body

if TYPE_CHECKING:
    from hvisph.case.case import Case

# Of the speed of sound: what moves slower than this, and for many crossings, swings rather than rings.
SLOW, CROSSINGS = 0.01, 20.0
# And what never yields below this share of it: balls of 11 particles across that meet part with 0.2 of their speed in
# contact SPH at 5 m/s and with half of it at 50, by Total Lagrangian kernels with 0.987.
BOUNCING = 0.1
# Particle velocity over the speed of sound beyond which density that does not keep to the spacing is off by 2 %.
STRONG = 0.3
# Courant number up to which contact SPH was verified.
LONGEST_STEP = 0.42


def scheme_advice(case: Case, kind: Regime, still: bool) -> Iterator[str]:
    """Yield what a user should consider of the scheme; `still` where nothing happens in the case."""
    if not still:
        yield from _slow(case, kind)
    yield from _hasty(case)
    yield from _strong(case, kind)
    yield from _peaks(case, kind)
    yield from _gas(case)
    yield from _loaded(case)


def _slow(case: Case, kind: Regime) -> Iterator[str]:
    """Bodies that swing, bend or spin: kernels in the current configuration damp that away."""
    model: Any = case.formulation
    if model.type not in ("riemann", "eulerian") or kind.strength is None:
        return
    fastest = max(math.dist(body.velocity, (0.0,) * case.dim) for body in case.bodies.values())
    slowest = min(material_of_body(body).bulk_sound_speed for body in case.bodies.values())
    # some shapes know their size only where they stand
    size = max((size for body in case.bodies.values() for size in body.shape.extent()), default=math.inf)
    elastic = kind.pressure < ELASTIC * kind.strength
    slow = BOUNCING if math.isinf(kind.strength) else SLOW
    if elastic and fastest < slow * slowest and case.time.end > CROSSINGS * size / slowest:
        lost = "" if model.conserve_angular_momentum else ", and loses spin,"
        yield (
            f"formulation: the bodies stay elastic and move slowly over {case.time.end * slowest / size:.3g} crossings "
            f"of their waves, and '{model.type}' damps swinging and bouncing{lost} within a few; take total_lagrangian"
        )


def _hasty(case: Case) -> Iterator[str]:
    """Yield what is to be said of steps longer than contact SPH was verified with."""
    if case.formulation.type == "riemann" and case.time.step is None and case.time.cfl > LONGEST_STEP:
        yield (
            f"time.cfl: {case.time.cfl:g} is beyond the {LONGEST_STEP:g} that 'riemann' was verified with; from 0.5 on "
            "metal that has flowed, liquids and gases no longer settle; leave it out"
        )


def _strong(case: Case, kind: Regime) -> Iterator[str]:
    """Shocks stronger than a scheme keeps its figures in."""
    model: Any = case.formulation
    if kind.velocity <= 0.0:
        return
    met = meeting(case)
    material = material_of_body(next(iter(case.bodies.values())) if met is None else case.bodies[met.second])
    share = 0.5 * kind.velocity / material.bulk_sound_speed
    if model.type == "riemann" and model.variant == "original" and share > STRONG / 2:
        yield (
            "formulation.variant: 'original' underestimates the stress behind strong shocks, by 2 % at 3 km/s and "
            "37 % at 24 km/s in aluminium; take 'corrected'"
        )
    if model.type == "eulerian" and getattr(model, "density_form", "mass") == "volume" and share > 1.5 * STRONG:
        yield (
            "formulation.density_form: 'volume' drifts from the particles' spacing in shocks this strong, by up to 6 % "
            "of the stress at 24 km/s in aluminium; take 'mass', or the formulation riemann"
        )
    if model.type == "total_lagrangian" and kind.strength is not None and kind.pressure > SHOCK * kind.strength:
        yield (
            "formulation: an impact pressure of more than ten times the strength brings strains that reference kernels "
            "do not survive; take riemann, adaptive, which lets such particles go, or give reference_update_strain: 0.3"
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
    if contact is None or contact.type != "penalty" or case.formulation.type != "eulerian":
        return
    for name, body in list(case.bodies.items())[1:]:
        if body.position is None and body.gap < 0.5 * case.resolution:
            yield (
                f"formulation.contact: 'penalty' starts loaded where bodies touch: bodies.{name} is pushed off at "
                f"rest; give it a gap of {case.resolution:g}, or take 'frictional'"
            )
            return
