"""Empirical correlations of impact engineering for comparison with a result, within their ranges.

Spheres of any metal on plates of aluminium. Sources:

- crater depth and single wall: Cour-Palais, as in NASA TM-2009-214785 eqs. 4-1 to 4-6;
- Whipple shield: Christiansen, ibid. eqs. 4-23 to 4-26;
- stuffed Whipple shield: Christiansen and Kerr 2001, Int. J. Impact Eng. 26, 93; multi-wall shield of cloth before
  aluminium: Christiansen 2003, NASA/TP-2003-210788, eqs. 4-25 to 4-37; both read in the public code pyBLOSSUM;
- honeycomb panel: that of the Whipple shield with a gap of at most two cells; that limit is from memory;
- hole in a thin plate: Maiden and McHugh 1963 and Sawle 1969; their coefficients are from memory, not read in a source;
- crater in a thick layer of soil, rock, ice or water: Holsapple 1993, Annu. Rev. Earth Planet. Sci. 21, 333, constants
  as in the public code cratermaker; in rock, Gault 1973, The Moon 6, 32, in the form of
  Melosh's program (1996 to 2016); Gault's own relation, 10^-2.823 rho_p^(1/6) rho_t^(-1/2) E^0.37 in cgs, from memory;
- residual velocity: Recht and Ipson 1963; Lambert and Jonas 1976;
- metal driven by an explosive: Gurney 1943, BRL report 405; metal on both faces: Kennedy 1970, SC-RR-70-790. The
  explosive shares its Gurney energy E between the metal and its products, whose velocity varies linearly across them.
  Gurney velocities (2 E)^(1/2) are those of cylinder tests (Kury et al. 1965; Dobratz & Crawford 1985), from memory.

Hardness, sound speed and yield strength of alloys: NASA TM-2009-214789.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import cos, inf, pi, sqrt
from typing import NamedTuple

import numpy as np

CM, KM, KSI = 1e-2, 1e3, 6.894757e6
HONEYCOMB_GAP = 2.0  # [cell widths]; largest effective gap of a honeycomb, whose cells confine the cloud
RECHT = "Recht and Ipson 1963"
FINAL_VELOCITY = "final velocity of "  # and the name of the body
WHIPPLE = "NASA TM-2009-214785 eqs. 4-23 to 4-26"
COUR_PALAIS = ("aluminium alloys, 0.5 to 8 km/s, 0 to 85 deg", "NASA TM-2009-214785 eqs. 4-1 to 4-6")
THIN_PLATE_RANGE = "aluminium on aluminium, normal, 2 to 8 km/s, t/d below 0.5"
POINT_SOURCE = "point source, above 1 km/s; layer twice as thick as the crater; a paraboloid as deep as 2/3 radius"
HOLSAPPLE = "Holsapple 1993; editions differ by two in K1"
CRITICAL = "critical diameter of the sphere"
# By key: name, quantity with the body's name in place of {}, range and source.
LAWS = {
    "crater": ("Cour-Palais", "crater depth in a thick {}", *COUR_PALAIS),
    "wall": ("Cour-Palais", "least thickness of {} that holds", *COUR_PALAIS),
    "maiden": ("Maiden-McHugh", "hole in {}", THIN_PLATE_RANGE, "Maiden and McHugh 1963; coefficients from memory"),
    "sawle": ("Sawle", "hole in {}", THIN_PLATE_RANGE, "Sawle 1969; coefficients from memory"),
    "whipple": ("Christiansen, Whipple", CRITICAL, "two aluminium walls, 1 to 15 km/s; +-25 % in diameter", WHIPPLE),
    "honeycomb": ("Christiansen, honeycomb", CRITICAL,
                  f"aluminium faces on honeycomb, gap at most {HONEYCOMB_GAP:g} cells (from memory)", WHIPPLE),
    "stuffed": ("Christiansen, stuffed Whipple", CRITICAL, "aluminium bumper, cloth, aluminium wall, 1 to 15 km/s",
                "Christiansen and Kerr 2001"),
    "multi-wall": ("Christiansen, multi-wall", CRITICAL,
                   "four bumpers of cloth before an aluminium wall, 1 to 15 km/s",
                   "NASA/TP-2003-210788 eqs. 4-25 to 4-37"),
    "radius": ("Holsapple", "crater radius in {}", POINT_SOURCE, HOLSAPPLE),
    "depth": ("Holsapple", "crater depth in {}", POINT_SOURCE, HOLSAPPLE),
    "gault": ("Gault", "crater diameter in {}",
              "dense rock, craters up to 10 m; layer thicker than 2/3 of the diameter",
              "Gault 1973 as in Melosh's program; Gault's relation in cgs, from memory, gives 3.9 times as much"),
    "gurney": ("Gurney", FINAL_VELOCITY + "{}",
               "final velocity, without losses at edges; metal of 0.1 to 10 times the mass of the explosive",
               "Gurney 1943; constant of the explosive from memory"),
}  # fmt: skip


@dataclass(frozen=True)
class Correlation:
    """A number of a correlation in SI: name and quantity, range of validity, source."""

    name: str
    quantity: str
    value: float
    unit: str
    text: str  # verdict for this shot; empty if the number is sufficient
    range: str
    source: str


def correlation(key: str, body: str, value: float, text: str = "", unit: str = "m") -> Correlation:
    """Return a number by one of `LAWS` for a body."""
    name, quantity, span, source = LAWS[key]
    return Correlation(name, quantity.format(body), value, unit, text, span, source)


class Alloy(NamedTuple):
    """An aluminium alloy."""

    hardness: float  # of Brinell
    sound: float  # sound speed [m/s]
    strength: float  # yield strength [Pa]


# By what the name of a material begins with.
ALLOYS = {
    "aluminium-1100-o": Alloy(23.0, 5050.0, 5.0 * KSI),
    "aluminium-1100": Alloy(32.0, 5050.0, 17.0 * KSI),
    "aluminium-2024": Alloy(120.0, 5110.0, 50.0 * KSI),
    "aluminium-2219": Alloy(130.0, 5100.0, 57.0 * KSI),
    "aluminium-6061": Alloy(95.0, 5050.0, 40.0 * KSI),
    "aluminium-7075": Alloy(150.0, 5040.0, 73.0 * KSI),
}


def alloy_of(material: str) -> Alloy | None:
    """Return the constants of an aluminium alloy by the name of a material; None for other materials."""
    return next((alloy for name, alloy in ALLOYS.items() if material.startswith(name)), None)


class Ground(NamedTuple):
    """Constants of crater scaling in a class of matter: K1 [-], mu [-], effective strength Y [Pa]."""

    coefficient: float
    exponent: float
    strength: float


GROUNDS = {
    "sand": Ground(0.24, 0.41, 0.0),
    "dry soil": Ground(0.24, 0.41, 0.18e6),
    "wet soil": Ground(0.20, 0.55, 1.14e6),
    "hard rock": Ground(0.20, 0.55, 18.0e6),
    "ice": Ground(15.6, 0.48, 0.0),
    "water": Ground(2.30, 0.55, 0.0),
}


@dataclass(frozen=True)
class Wall:
    """A plate: thickness [m], density with pores [kg/m^3], distance to the one before it [m], material.

    `ground` is its class in `GROUNDS`, empty for what craters are not scaled in; `cell` the width of the cells of a
    honeycomb that fills the gap, 0 without one [m].
    """

    name: str
    thickness: float
    density: float
    gap: float = 0.0
    alloy: Alloy | None = None
    cloth: bool = False
    ground: str = ""
    cell: float = 0.0

    @property
    def areal_density(self) -> float:
        """Mass per area [kg/m^2]."""
        return self.thickness * self.density


@dataclass(frozen=True)
class Impact:
    """A sphere on plates."""

    # of the sphere [m], [kg/m^3]
    diameter: float
    density: float
    speed: float  # of the impact [m/s]
    obliquity: float  # angle to the plates' normal [rad]
    walls: tuple[Wall, ...]  # the plates in the order along the shot line
    gravity: float = 0.0  # magnitude of a uniform field [m/s^2]; 0 without one

    @property
    def mass(self) -> float:
        """Mass of the sphere [kg]."""
        return self.density * pi / 6.0 * self.diameter**3

    @property
    def normal(self) -> float:
        """Normal component of the velocity [m/s]."""
        return self.speed * cos(self.obliquity)


def crater_depth(impact: Impact, wall: Wall, alloy: Alloy) -> float:
    """Return the depth of the crater in a thick wall by Cour-Palais [m]."""
    ratio = impact.density / wall.density
    power = 0.5 if ratio < 1.5 else 2.0 / 3.0
    d = impact.diameter / CM
    return 5.24 * d ** (19 / 18) * alloy.hardness**-0.25 * ratio**power * (impact.normal / alloy.sound) ** (2 / 3) * CM


def crater_volume(impact: Impact, wall: Wall) -> float:
    """Return the crater's volume by Holsapple [m^3], by the normal velocity; infinite without strength and gravity."""
    ground, ratio = GROUNDS[wall.ground], wall.density / impact.density
    weight = impact.gravity * 0.5 * impact.diameter / impact.normal**2 * ratio ** (-1 / 3)
    resistance = weight + (ground.strength / (wall.density * impact.normal**2)) ** (1.0 + 0.5 * ground.exponent)
    if resistance == 0.0:
        return inf
    power = 3.0 * ground.exponent / (2.0 + ground.exponent)
    return float(ground.coefficient * resistance**-power * impact.mass / wall.density)


def rock_crater_diameter(impact: Impact, wall: Wall) -> float:
    """Return the diameter of the crater in dense rock by Gault, up to 10 m [m]."""
    energy = 0.5 * impact.mass * impact.speed**2
    ratio = impact.density ** (1 / 6) * wall.density**-0.5
    return float(0.015 * ratio * energy**0.37 * cos(impact.obliquity) ** (2 / 3))


def critical_diameter(impact: Impact, bumper: Wall, wall: Wall, strength: float) -> float:
    """Return the diameter of the sphere that just perforates a Whipple shield's rear wall, by Christiansen [m]."""
    rho_p, rho_b = impact.density * 1e-3, bumper.density * 1e-3  # [g/cm^3]
    t_b, t_w, gap = bumper.thickness / CM, wall.thickness / CM, wall.gap / CM
    angle = min(impact.obliquity, 1.1344640137963142)  # angles above 65 degrees count as 65
    sigma = strength / KSI

    def slow(v: float) -> float:
        thickness = t_w * sqrt(sigma / 40.0) + t_b
        return float((thickness / (0.6 * cos(angle) ** (5 / 3) * sqrt(rho_p) * v ** (2 / 3))) ** (18 / 19))

    def fast(v: float) -> float:
        shield = 3.918 * t_w ** (2 / 3) * rho_p ** (-1 / 3) * rho_b ** (-1 / 9) * gap ** (1 / 3)
        return float(shield * (v * cos(angle)) ** (-2 / 3) * (sigma / 70.0) ** (1 / 3))

    v, cosine = impact.speed / KM, cos(angle)
    if not 3.0 < v * cosine < 7.0:
        return (slow(v) if v * cosine <= 3.0 else fast(v)) * CM
    low, high = slow(3.0 / cosine), fast(7.0 / cosine)
    return (low + (high - low) * (v * cosine - 3.0) / 4.0) * CM


class ClothShield(NamedTuple):
    """Coefficients of a shield with cloth before an aluminium wall, lengths in cm, masses per area in g/cm^2."""

    low: float  # of the diameter below and above both speeds; between them it is interpolated
    high: float
    slow: float  # these speeds at normal impact [km/s]
    fast: float
    slow_power: float  # powers of 1/cos of the angle in both speeds, and in the diameter above
    fast_power: float
    high_power: float


# The coefficient of fast impacts on a stuffed shield falls where little is stuffed: 10 to 15 % of the shield's mass.
STUFFED_SHIELD = ClothShield(2.35, 0.6, 2.6, 6.5, 0.5, 0.75, 0.5)
MULTI_WALL_SHIELD = ClothShield(2.0, 0.358, 2.4, 6.4, 0.5, 0.25, 1 / 3)
LITTLE_STUFFING, LITTLE_COEFFICIENT = (0.10, 0.15), 0.45


def critical_diameter_of_cloth(shield: ClothShield, impact: Impact, strength: float) -> float:
    """Return the diameter of the sphere that just perforates the last wall, of yield `strength` [Pa], in m."""
    *front, wall = impact.walls
    rho_p, cosine, sigma = impact.density * 1e-3, cos(impact.obliquity), strength / KSI / 40.0
    areal, t_w = sum(bumper.areal_density for bumper in front) * 0.1, wall.thickness / CM
    gap = (sum(plate.gap for plate in impact.walls) + sum(plate.thickness for plate in front[1:])) / CM
    diameter = shield.low * (t_w * sqrt(sigma) + 0.37 * areal) / (cosine ** (4 / 3) * sqrt(rho_p))
    broken = shield.high * (wall.areal_density * 0.1 / rho_p) ** (1 / 3) * gap ** (2 / 3) * sigma ** (1 / 6)
    broken /= cosine**shield.high_power
    slow, fast = shield.slow / cosine**shield.slow_power, shield.fast / cosine**shield.fast_power
    v = impact.speed / KM
    if v <= slow:
        return float(diameter * v ** (-2 / 3) * CM)
    if v >= fast:
        return float(broken * v ** (-1 / 3) * CM)
    return float(np.interp(v, (slow, fast), (diameter * slow ** (-2 / 3), broken * fast ** (-1 / 3))) * CM)


def recht_ipson(speed: float, limit: float, mass: float, plug: float) -> float:
    """Return the residual velocity of a blunt projectile [m/s], 0 below the ballistic limit.

    `speed`, `limit`: of the impact, and the ballistic limit [m/s].
    `mass`, `plug`: of the projectile and of the plug that it pushes out [kg].
    """
    return mass / (mass + plug) * sqrt(max(speed**2 - limit**2, 0.0))


@dataclass(frozen=True)
class LambertJonas:
    """The curve of residual velocities v_r = a (v^p - limit^p)^(1/p), and their root mean square deviation [m/s]."""

    a: float
    p: float
    limit: float
    deviation: float

    def residual(self, velocity: np.ndarray | float) -> np.ndarray:
        """Return the residual velocity [m/s]; 0 below the limit."""
        return lambert_jonas_velocity(np.asarray(velocity, float), self.a, self.p, self.limit)


def lambert_jonas_velocity(v: np.ndarray, a: float, p: float, limit: float) -> np.ndarray:
    """Return the residual velocity a (v^p - limit^p)^(1/p), 0 below the limit [m/s]."""
    return a * np.maximum(np.maximum(v, 0.0) ** p - limit**p, 0.0) ** (1.0 / p)


def correlations(impact: Impact) -> list[Correlation]:
    """Return every correlation that holds for an impact; none where all are out of their range."""
    return [*_single_wall(impact), *_hole(impact), *_whipple(impact), *_cloth(impact), *_cratering(impact)]


def limit_speeds(impact: Impact) -> list[Correlation]:
    """Return the speeds from which correlations have the last wall perforated [m/s]; those that change there."""
    speeds = np.linspace(0.5, 8.0, 301) * KM
    judging = ("least thickness", "critical diameter")  # quantities that decide on perforation
    marks = [
        [result for result in correlations(replace(impact, speed=float(speed))) if result.quantity.startswith(judging)]
        for speed in speeds
    ]
    limits = []
    for name in dict.fromkeys(result.name for results in marks for result in results):
        verdicts = [(k, result) for k, results in enumerate(marks) for result in results if result.name == name]
        first = next((at for at, (_, result) in enumerate(verdicts) if result.text.endswith("perforated")), 0)
        if first == 0:  # perforated at the least speed already, or never
            continue
        (before, _), (after, result) = verdicts[first - 1], verdicts[first]
        speed, quantity = float(0.5 * (speeds[before] + speeds[after])), "speed from which it is perforated"
        limits.append(Correlation(name, quantity, speed, "m/s", "", result.range, result.source))
    return limits


def _single_wall(impact: Impact) -> Iterator[Correlation]:
    wall = impact.walls[0] if impact.walls else None
    if wall is None or wall.alloy is None or not 0.5 * KM <= impact.speed <= 8.0 * KM:
        return
    depth = crater_depth(impact, wall, wall.alloy)
    yield correlation("crater", wall.name, depth)
    if len(impact.walls) == 1:
        states = {3.0: "no incipient spall", 2.2: "incipient spall", 1.8: "detached spall", 0.0: "perforated"}
        text = next(text for ratio, text in states.items() if wall.thickness >= ratio * depth)
        yield correlation("wall", wall.name, 1.8 * depth, text)


def _hole(impact: Impact) -> Iterator[Correlation]:
    wall = impact.walls[0] if impact.walls else None
    if wall is None or wall.alloy is None or impact.obliquity > 1e-3:
        return
    share, v = wall.thickness / impact.diameter, impact.speed / KM
    if not (2400.0 < impact.density < 3000.0 and 2.0 <= v <= 8.0 and share < 0.5):
        return
    yield correlation("maiden", wall.name, (0.45 * v * share ** (2 / 3) + 0.90) * impact.diameter)
    speed = impact.density * impact.speed / (wall.density * wall.alloy.sound)
    yield correlation("sawle", wall.name, (3.2 * speed**0.22 * share ** (2 / 3) + 1.0) * impact.diameter)


def _whipple(impact: Impact) -> Iterator[Correlation]:
    if len(impact.walls) != 2:
        return
    bumper, wall = impact.walls
    if wall.cell:  # cells channel the cloud
        wall = replace(wall, gap=min(wall.gap, HONEYCOMB_GAP * wall.cell))
    if bumper.alloy is None or wall.alloy is None or wall.gap <= 0.0 or not 1.0 * KM <= impact.speed <= 15.0 * KM:
        return
    share = 0.25 if wall.gap < 30.0 * impact.diameter else 0.20
    thin = bumper.thickness / impact.diameter < share * impact.density / bumper.density
    if thin and impact.normal >= 7.0 * KM:
        return  # too thin a bumper to break the sphere: the curve does not hold there
    critical = critical_diameter(impact, bumper, wall, wall.alloy.strength)
    yield _critical("honeycomb" if wall.cell else "whipple", impact, critical)


def _critical(key: str, impact: Impact, critical: float) -> Correlation:
    """Return the critical diameter [m] of a shield, and in words whether its last wall holds."""
    verdict = "perforated" if impact.diameter > critical else "holds"
    return correlation(key, "", critical, f"{impact.walls[-1].name} {verdict}")


def _cloth(impact: Impact) -> Iterator[Correlation]:
    if len(impact.walls) < 3:
        return
    *front, wall = impact.walls
    if wall.alloy is None or not all(bumper.cloth for bumper in front[1:]) or not 1.0 * KM <= impact.speed <= 15.0 * KM:
        return
    if front[0].alloy is not None:
        law = STUFFED_SHIELD
        stuffing = sum(bumper.areal_density for bumper in front[1:])
        share = stuffing / sum(plate.areal_density for plate in impact.walls)
        if LITTLE_STUFFING[0] <= share <= LITTLE_STUFFING[1]:
            law = law._replace(high=LITTLE_COEFFICIENT)
        yield _critical("stuffed", impact, critical_diameter_of_cloth(law, impact, wall.alloy.strength))
    elif front[0].cloth and len(front) == 4:
        yield _critical(
            "multi-wall", impact, critical_diameter_of_cloth(MULTI_WALL_SHIELD, impact, wall.alloy.strength)
        )


def _cratering(impact: Impact) -> Iterator[Correlation]:
    wall = impact.walls[0] if len(impact.walls) == 1 else None
    if wall is None or not wall.ground or impact.normal < 1.0 * KM:
        return
    volume = crater_volume(impact, wall)
    radius = (3.0 * volume / pi) ** (1 / 3)  # of a paraboloid, a third of its diameter deep
    depth = 2.0 / 3.0 * radius
    if wall.thickness >= 2.0 * depth:
        field = f"{impact.gravity:.3g} m/s^2" if impact.gravity else "no gravity"
        strength = 1e-6 * GROUNDS[wall.ground].strength
        text = f"{1e3 * volume:.3g} litre; taken as {wall.ground}, Y {strength:g} MPa; {field}"
        yield correlation("radius", wall.name, radius, text)
        yield correlation("depth", wall.name, depth)
    diameter = rock_crater_diameter(impact, wall) if wall.ground == "hard rock" else inf
    if diameter <= min(10.0, 1.5 * wall.thickness):
        yield correlation("gault", wall.name, diameter)
