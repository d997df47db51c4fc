"""Plausibility of numbers: errors of units, digits and signs.

Each warning gives the number, the usual range, and the value that was probably meant. The ranges hold every material of
the library; they are about solids and liquids under impact, and gases have none.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from hvisph.case.materials.material import Material
from hvisph.case.model import AnyCase


@dataclass(frozen=True)
class Range:
    """Usual range of a number."""

    # ends of the range, in SI
    low: float
    high: float
    unit: str = ""  # its unit, for the words
    slips: tuple[float, ...] = (1e-3, 1e3, 1e-6, 1e6, 1e-9, 1e9, 1e-1, 1e1)  # of a unit, the likeliest first


DENSITY = Range(20.0, 25_000.0, "kg/m^3")
SPEED = Range(100.0, 15_000.0, "m/s")
DETONATION = Range(1000.0, 12_000.0, "m/s")
SLOPE = Range(0.8, 2.5)
GAMMA = Range(0.2, 4.0)
MODULUS = Range(1e-3, 2.0)  # G over rho c0^2
YIELD = Range(2e-5, 0.2)  # Y over rho c0^2
HARDENING = Range(0.0, 1.5)
SOFTENING = Range(0.3, 4.0)
MELTING = Range(150.0, 4600.0, "K")
SCATTER = 0.1  # of a measured shock speed, by which the line through points may miss it
HEL = 0.05  # share by which P_HEL may miss what a JH-2 set implies
HEAT = Range(50.0, 6000.0, "J/(kg K)")
# Ends of a run over the time that the slowest crossing takes, by sound or by flight.
END = Range(1e-3, 1e4)
_LIKELY = Range(0.1, 1e2)
_TIMES = (("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9))
_PRESSURES = (("TPa", 1e12), ("GPa", 1e9), ("MPa", 1e6), ("kPa", 1e3), ("Pa", 1.0))
# Ends of the energies of Tillotson's equation; papers give them in erg/g.
_ENERGIES = {"reference_energy": (1e6, 1e9), "incipient_energy": (1e5, 2e7), "vaporization_energy": (1e6, 1e8)}


def implausible(case: AnyCase) -> list[str]:
    """Return warnings about implausible numbers of `case`; none for a case without units."""
    if case.units != "si":
        return []
    doubts: list[str] = []
    for name, body in case.bodies.items():
        doubts += [f"bodies.{name}.material.{text}" for text in of_material(body.material)]
        melts = getattr(body.material.strength, "melt_temperature", None)
        melts = getattr(body.material.melting, "temperature", melts)
        if body.temperature is not None and melts is not None and body.temperature >= melts:
            subject = f"bodies.{name}.temperature: {body.temperature:g} K is above the melting point of its strength"
            doubts.append(f"{subject}, {melts:g} K: the body starts without strength")
    return [*doubts, *_end(case), *_step(case), *_output(case), *_pressure(case)]


def of_material(material: Material) -> Iterator[str]:
    """Yield warnings about implausible numbers of a material."""
    eos, strength = material.eos, material.strength
    if eos.type != "ideal_gas":
        yield from _check_range("density", material.density, DENSITY, "kg/m^3")
    speed = bulk_speed(material)
    if speed is not None:
        given = hasattr(eos, "sound_speed")
        what = "" if given else "the sound speed sqrt(K/rho0) that follows"
        yield from _check_range("eos.sound_speed" if given else "eos", speed, SPEED, "m/s", what)
    if eos.type == "tillotson":
        for key, ends in _ENERGIES.items():
            yield from _check_range(f"eos.{key}", getattr(eos, key), Range(*ends, "J/kg", (1e-4, 1e6, 1e3)))
    if eos.type == "mie_gruneisen":
        _, s1, s2, s3 = eos.hugoniot
        if s2 == 0.0 and s3 == 0.0:
            yield from _check_range("eos.s1", s1, SLOPE)
        residuals = eos.residuals if eos.us_up else ()
        off = [(abs(left) / us, up, us) for left, (up, us) in zip(residuals, eos.us_up, strict=True)]
        if off and max(off)[0] > SCATTER:
            share, up, us = max(off)
            subject = f"eos.us_up: at [{up:g}, {us:g}] m/s the line through all points"
            yield f"{subject} is {100.0 * share:.2g} % off; points scatter by a few; was a unit left out?"
        if eos.gamma:
            yield from _check_range("eos.gamma", eos.gamma, GAMMA)
    if eos.type == "jwl" and eos.detonation is not None and eos.detonation.speed is not None:
        yield from _check_range("eos.detonation.speed", eos.detonation.speed, DETONATION, "m/s")
    stiffness = material.density * speed**2 if speed else 0.0
    if stiffness and SPEED.low <= (speed or 0.0) <= SPEED.high and DENSITY.low <= material.density <= DENSITY.high:
        if material.shear_modulus:
            yield from _share("strength.shear_modulus", material.shear_modulus, stiffness, MODULUS)
        for key in ("yield_stress", *(("a",) if strength.type == "johnson_cook" else ())):
            value = getattr(strength, key, None)
            if value:
                yield from _share(f"strength.{key}", value, stiffness, YIELD)
    yield from _ceramic(material)
    for key, usual in (("n", HARDENING), ("m", SOFTENING), ("melt_temperature", MELTING), ("heat_capacity", HEAT)):
        value = getattr(strength, key, None)
        if value is not None:
            yield from _check_range(f"strength.{key}", value, usual)
    points = getattr(material.temperature, "heat_capacities", ())
    if points and value is not None and not 0.9 <= value / points[0][1] <= 1.1:  # the heat capacity came last
        fault = f"strength.heat_capacity: {value:g} J/(kg K) is not used: temperature.heat_capacities counts, which"
        yield f"{fault} begins with {points[0][1]:g}"


def _ceramic(material: Material) -> Iterator[str]:
    """Yield a warning for a JH-2 set that is inconsistent with its Hugoniot elastic limit."""
    strength, eos = material.strength, material.eos
    if strength.type != "johnson_holmquist" or eos.type != "polynomial":
        return
    low, high = 0.0, 1.0
    for _ in range(60):
        mu = 0.5 * (low + high)
        pressure = mu * (eos.a1 + mu * (eos.a2 + mu * eos.a3))
        stress = pressure + 4.0 / 3.0 * material.shear_modulus * mu / (1.0 + mu)
        low, high = (mu, high) if stress < strength.hugoniot_elastic_limit else (low, mu)
    if abs(pressure / strength.hel_pressure - 1.0) > HEL:
        subject = (
            f"strength.hel_pressure: {_pressure_text(strength.hel_pressure)}, but with K1 to K3 and G the pressure"
        )
        yield f"{subject} at the Hugoniot elastic limit is {_pressure_text(pressure)}; was that meant?"


def bulk_speed(material: Material) -> float | None:
    """Return the bulk sound speed at rest [m/s] where the material defines it."""
    eos: Any = material.eos
    if eos.type == "mie_gruneisen":
        return float(eos.hugoniot[0])
    if eos.type == "us_up_table":
        return float(eos.us_up[0][1])
    if eos.type == "stiffened_gas":
        return float(eos.sound_speed)
    modulus = {
        "linear": lambda: eos.modulus(material.density),
        "elastic": lambda: eos.bulk_modulus,
        "tillotson": lambda: eos.bulk_modulus,
        "murnaghan": lambda: eos.bulk_modulus,
        "polynomial": lambda: eos.a1,
    }.get(eos.type)
    return None if modulus is None else math.sqrt(modulus() / material.density)


def _check_range(key: str, value: float, usual: Range, unit: str = "", what: str = "") -> Iterator[str]:
    if usual.low <= value <= usual.high:
        return
    unit = unit or usual.unit
    spaced = f" {unit}" if unit else ""
    meant = _guess_intended(value, usual)
    remedy = f"; was {meant:g}{spaced} meant?" if meant is not None else ""
    subject = f"{what}, {value:g}{spaced}," if what else f"{value:g}{spaced}"
    yield f"{key}: {subject} is outside the usual {usual.low:g} to {usual.high:g}{spaced}{remedy}"


def _share(key: str, value: float, stiffness: float, usual: Range) -> Iterator[str]:
    share = value / stiffness
    if usual.low <= share <= usual.high:
        return
    meant = _guess_intended(share, usual)
    remedy = f"; was {_pressure_text(meant * stiffness)} meant?" if meant is not None else ""
    subject = f"{_pressure_text(value)} is {share:.2g} of rho0 c0^2 = {_pressure_text(stiffness)}"
    yield f"{key}: {subject}, outside the usual {usual.low:g} to {usual.high:g}{remedy}"


def _guess_intended(value: float, usual: Range) -> float | None:
    return next((value * slip for slip in usual.slips if usual.low <= value * slip <= usual.high), None)


def _pressure_text(value: float) -> str:
    unit, size = next(((u, f) for u, f in _PRESSURES if value >= f), _PRESSURES[-1])
    return f"{value / size:.4g} {unit}"


def _end(case: AnyCase) -> Iterator[str]:
    crossings = []
    for body in case.bodies.values():
        speed = bulk_speed(body.material)
        across = max(body.shape.extent(), default=0.0)  # some shapes know their size only where they stand
        if across > 0.0 and speed is not None and SPEED.low <= speed <= SPEED.high:
            crossings.append(across / speed)
    flight = [math.hypot(*body.velocity) for body in case.bodies.values()]
    if not crossings:
        return
    longest = max(crossings)
    if any(flight):
        longest = max(longest, max(max(b.shape.extent(), default=0.0) for b in case.bodies.values()) / max(flight))
    share = case.duration / longest
    if END.low <= share <= END.high:
        return
    meant = _guess_intended(share, _LIKELY)
    remedy = ""
    if meant is not None:
        unit, size = next(((u, f) for u, f in _TIMES if meant * longest >= f), _TIMES[-1])
        remedy = f"; was {meant * longest / size:.3g} {unit} meant?"
    fault = f"time.end: {case.duration:g} s is {share:.2g} times what sound or flight takes across a body,"
    yield f"{fault} {longest:.3g} s{remedy}"


def _step(case: AnyCase) -> Iterator[str]:
    """Yield a warning where sound crosses more than a smoothing length in a fixed step."""
    known = [(bulk_speed(body.material), body.spacing(case)) for body in case.bodies.values()]
    crossings = [case.formulation.h_over_dx * spacing / speed for speed, spacing in known if speed]
    if case.time.step is not None and crossings and case.time.step > min(crossings):
        fault = f"time.step: {case.time.step:g} s is longer than sound takes across a smoothing length,"
        yield f"{fault} {min(crossings):.3g} s: the run is unstable; leave it out, or give a part of that"


def _output(case: AnyCase) -> Iterator[str]:
    every = case.output.every
    if every is not None and every > case.duration:
        fault = f"output.every: {every:g} s is beyond the end, {case.duration:g} s:"
        yield f"{fault} the first and the last state alone are written; was a unit left out?"


def _pressure(case: AnyCase) -> Iterator[str]:
    """Yield a warning where the first impact exceeds the range of an equation of state."""
    bodies = list(case.bodies.values())[:2]
    if len(bodies) < 2:
        return
    speed = math.hypot(*(a - b for a, b in zip(bodies[0].velocity, bodies[1].velocity, strict=False)))
    impedances = [body.material.density * (bulk_speed(body.material) or 0.0) for body in bodies]
    if not all(impedances) or speed <= 0.0:
        return
    pressure = speed * impedances[0] * impedances[1] / sum(impedances)  # acoustic: the least that a shock has
    for name, body, impedance in zip(case.bodies, bodies, impedances, strict=False):
        eos, stiffness = body.material.eos, impedance**2 / body.material.density
        share = pressure / stiffness
        if eos.type in ("linear", "elastic") and share > 0.1:
            fault = f"bodies.{name}.material.eos: about {_pressure_text(pressure)} is {share:.2g} of the bulk modulus;"
            yield f"{fault} a `{eos.type}` law has no shocks above 0.1 of it; use mie_gruneisen"
        if eos.type == "mie_gruneisen":
            c0, s1, s2, s3 = eos.hugoniot
            u = pressure / impedance
            if s1 > 1.0 and not (s2 or s3) and u / (c0 + s1 * u) * s1 > 0.9:
                fault = f"bodies.{name}.material.eos: about {_pressure_text(pressure)} is near the end of its Hugoniot,"
                yield f"{fault} where U = c0/(1 - s1 eta) has no bound; use tillotson or a table"
