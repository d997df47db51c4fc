"""Pressures, free-surface velocities, temperatures and phases: peaks, pull-back, plateau of a plate impact, means.

A run records at every step `centre_pressure`, the mean pressure of the projectile's particles that were initially
within 0.3 mm of its centre, and `axis_pressure_min`, the lowest pressure of those within dx of the shot line. Peaks are
the largest and smallest samples.

Melt and vapour are those at 1 bar after an isentropic release, by the entropy S of the particles (`exact.hugoniot`) and
the five `entropies` of each material in the metadata:

    melt      (S - S_im)/(S_cm - S_im)  in [0, 1]        vapour    (S - S_iv)/(S_cv - S_iv)  in [0, 1]
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from hvisph.core.text import PlainMapping

from .measurement_frame import Scene
from .result import Outcome, Outcomes, Result, UndefinedMeasureError, measures, refuse_if, weighted_quantile

CENTRE_RADIUS = 0.3e-3  # [m]
CENTRE_COLUMN, AXIS_COLUMN = "centre_pressure", "axis_pressure_min"
QUANTILE = 0.999  # mass fraction that does not exceed a maximum


def centre_particles(position: np.ndarray, spacing: float, axis: np.ndarray | None = None) -> np.ndarray:
    """Return the rows of particles (n, dim) that began near the projectile's centre, or at `axis` across the shot.

    Particles within 0.3 mm count, or within a tenth of the width of a projectile below 3 mm; `spacing` is dx [m].
    """
    centre = np.concatenate([position[:, :1].mean(axis=0), _axis(position, axis)])
    radius = min(CENTRE_RADIUS, 0.1 * float(np.ptp(position[:, 0]) + spacing))
    distance = np.sqrt(((position - centre) ** 2).sum(axis=1))
    # a node of the lattice on the limit, or one of several nearest, must not depend on round-off
    limit = max(radius, float(distance.min())) + 1e-6 * spacing
    return np.flatnonzero(distance <= limit)


def axis_particles(position: np.ndarray, spacing: float, axis: np.ndarray | None = None) -> np.ndarray:
    """Return the rows of particles that began within dx of the shot line; arguments as `centre_particles`."""
    lateral = position[:, 1:] - _axis(position, axis)
    distance = np.sqrt((lateral**2).sum(axis=1))
    return np.flatnonzero(distance <= max(spacing, float(distance.min())) + 1e-6 * spacing)


@measures("run", "centre_pressure_peak")
def centre_pressure_peak(scene: Scene) -> Result:
    """Return the largest recorded pressure of the centre [Pa], with its time."""
    return peak(scene.history, CENTRE_COLUMN, 1.0, scene.state.time)


@measures("run", "centre_tension_peak")
def centre_tension_peak(scene: Scene) -> Result:
    """Return the largest recorded tension on the shot line [Pa], positive, with its time; zero without tension."""
    return peak(scene.history, AXIS_COLUMN, -1.0, scene.state.time)


def _axis(position: np.ndarray, axis: np.ndarray | None) -> np.ndarray:
    return position[:, 1:].mean(axis=0) if axis is None else np.asarray(axis, dtype=float)


def peak(history: Mapping[str, np.ndarray] | None, column: str, sign: float, end: float = np.inf) -> Result:
    """Return the largest `sign` times a column up to time `end` [s]; its scatter is the step to its neighbours."""
    if history is None:
        raise UndefinedMeasureError("there is no history: a single snapshot, or files of another code")
    refuse_if(column not in history or "time" not in history, f"the history has no column '{column}'")
    try:
        time = np.asarray(history["time"], dtype=float)
        value = sign * np.asarray(history[column], dtype=float)
    except ValueError:
        raise UndefinedMeasureError(f"column '{column}' of the history holds something else than numbers") from None
    valid = np.isfinite(value) & (time <= end * (1.0 + 1e-12))
    time, value = time[valid], value[valid]
    refuse_if(len(value) == 0, f"column '{column}' of the history has no value up to this time")
    at = int(np.argmax(value))
    neighbours = value[max(at - 1, 0) : at + 2]
    return Result(max(float(value[at]), 0.0), scatter=float(np.abs(neighbours - value[at]).max()), time=float(time[at]))


LEAST_FALL = 0.03  # of the highest velocity: smaller decreases are oscillations
LEAST_RISE = 0.1  # of the decrease: a smaller rise is no spall signal


@measures("run", "pull_back_velocity", "spall_strength")
def pull_back(scene: Scene) -> Outcomes:
    """Return pull-back velocity [m/s] and spall strength [Pa] by the first free-surface gauge that shows a pull-back.

    The snapshot's metadata describe the gauges under ``surfaces``: `axis`, `sign` and `impedance` rho0 c_b [Pa s/m].
    """
    surfaces: PlainMapping = scene.state.metadata.get("surfaces", {})
    history, reason = scene.history, "there is no gauge of the type 'free_surface'"
    for name, surface in surfaces.items():
        column = f"gauge.{name}.velocity_{'xyz'[int(surface['axis'])]}"
        if history is None or column not in history or "time" not in history:
            reason = f"the history has no column '{column}'"
            continue
        velocity = float(surface["sign"]) * np.asarray(history[column], float)
        signal = _fall(np.asarray(history["time"], float), velocity, scene.state.time)
        if signal is None:
            reason = f"the velocity of gauge '{name}' shows no pull-back"
            continue
        time, fall, spread = signal
        half = 0.5 * float(surface["impedance"])
        return {
            "pull_back_velocity": Result(fall, scatter=spread, time=time),
            "spall_strength": Result(half * fall, scatter=half * spread, time=time),
        }
    raise UndefinedMeasureError(reason)


def _fall(time: np.ndarray, velocity: np.ndarray, end: float) -> tuple[float, float, float] | None:
    """Return the time of the minimum before the spall signal [s], the decrease from the peak and its scatter [m/s]."""
    valid = np.isfinite(velocity) & (time <= end * (1.0 + 1e-12))
    time, velocity = time[valid], velocity[valid]
    if len(velocity) < 5:
        return None
    peak = valley = 0
    highest = float(velocity.max())
    for k in range(1, len(velocity)):
        fall = velocity[peak] - velocity[valley]
        if fall > LEAST_FALL * highest and velocity[k] - velocity[valley] > LEAST_RISE * fall:
            deviations = np.concatenate(
                [
                    velocity[max(peak - 1, 0) : peak + 2] - velocity[peak],
                    velocity[max(valley - 1, 0) : valley + 2] - velocity[valley],
                ]
            )
            return float(time[valley]), float(fall), float(np.abs(deviations).max())
        if velocity[k] > velocity[peak]:
            peak = valley = k
        elif velocity[k] < velocity[valley]:
            valley = k
    return None


PLATEAU_BEGIN, PLATEAU_END = 10.0, 0.5  # distances from the interface: [dx], and over that of the nearer end
FEWEST_IN_PLATEAU = 5  # particles
UNRELEASED_SHARE = 0.97  # share of the highest mean stress of any moment, below which the plateau has been released


@dataclass(frozen=True)
class Plateau:
    """Means over the plateau."""

    stress: Result  # longitudinal stress -sigma_xx, positive in compression [Pa]; uncertainty: its standard deviation
    velocity: Result  # velocity of the material, and so of the interface [m/s]; uncertainty likewise
    count: int  # number of particles in the means


@measures("run", "plateau_stress", "interface_velocity", needs=("layer",))
def plateau_measures(scene: Scene) -> Outcomes:
    """Return stress [Pa] and velocity [m/s] of the plateau; of a run, those before releases reached it."""
    timeline, best = scene.timeline, None
    if timeline is None or timeline.series:
        best = plateau(scene)
    else:
        plateaus = []
        for number in range(timeline.count):
            moment = scene if number == timeline.count - 1 else timeline.load(number)
            if moment.state.time <= scene.state.time:
                with suppress(UndefinedMeasureError):
                    plateaus.append((moment.state.time, plateau(moment)))
        best = before_release(plateaus) if plateaus else plateau(scene)
    return {"plateau_stress": best.stress, "interface_velocity": best.velocity}


def plateau(scene: Scene) -> Plateau:
    """Return the plateau of a plate impact; raises `UndefinedMeasureError` where there is none."""
    refuse_if("pressure" not in scene.state.fields, "the snapshot has no pressure")
    x = scene.position[:, 0]
    pressure, deviator = scene.state.fields["pressure"], scene.state.fields.get("deviator")
    stress = pressure if deviator is None else pressure - deviator[:, 0]  # -sigma_xx
    projectile, target = scene.is_projectile, scene.is_target
    interface = 0.5 * (x[projectile].max() + x[target].min())
    top = np.quantile(stress[projectile | target], 0.99)
    refuse_if(not top > 0.0, "no part of the plates is compressed")
    level = 0.5 * float(np.median(stress[(projectile | target) & (stress > 0.1 * top)]))
    reach = min(_reach(x[body] - interface, stress[body], level) for body in (projectile, target))
    distance = np.abs(x - interface)
    rows = (projectile | target) & (distance >= PLATEAU_BEGIN * scene.spacing) & (distance <= PLATEAU_END * reach)
    refuse_if(rows.sum() < FEWEST_IN_PLATEAU, "the compressed region is too short, or releases have overtaken it")
    velocity = scene.state.fields["velocity"].reshape(len(x), -1)[rows, 0]
    return Plateau(_mean(stress[rows]), _mean(velocity), int(rows.sum()))


def before_release(plateaus: Sequence[tuple[float, Plateau]]) -> Plateau:
    """Return the longest plateau, before releases from the free faces reached it, from times [s] and plateaus."""
    highest = max(p.stress.value or 0.0 for _, p in plateaus)
    threshold = min(UNRELEASED_SHARE * highest, highest)  # in tension only the least
    time, best = max(
        ((time, p) for time, p in plateaus if (p.stress.value or 0.0) >= threshold),
        key=lambda pair: (pair[1].count, pair[0]),
    )
    return Plateau(replace(best.stress, time=time), replace(best.velocity, time=time), best.count)


def _reach(x: np.ndarray, stress: np.ndarray, level: float) -> float:
    """Distance from the interface over which stress stays above `level` without a break [m]."""
    order = np.argsort(np.abs(x))
    distance, above = np.abs(x)[order], stress[order] > level
    # some schemes have a tensile spike at the interface: begin at the tenth particle
    start = min(10, len(above) - 1)
    below = np.flatnonzero(~above[start:])
    return float(distance[start + below[0]]) if len(below) else float(distance[-1])


def _mean(sample: np.ndarray) -> Result:
    return Result(float(sample.mean()), scatter=float(sample.std(ddof=1)))


@measures("run", "projectile_temperature", "target_temperature", "temperature_max")
def temperatures(scene: Scene) -> Outcomes:
    """Return mass-mean temperatures of the projectile and of all layers, and the maximum of both [K]."""
    fields = scene.state.fields
    refuse_if(not {"temperature", "mass"} <= fields.keys(), "no material has a heat capacity")
    layers = np.isin(scene.state.body, scene.layers)

    def value(rows: np.ndarray, maximum: bool = False) -> Outcome:
        defined = rows & np.isfinite(fields["temperature"])
        if not defined.any():
            return "its material has no heat capacity" if rows.any() else "there is no layer"
        values, weights = fields["temperature"][defined], fields["mass"][defined]
        return weighted_quantile(values, weights, QUANTILE) if maximum else float(np.average(values, weights=weights))

    return {
        "projectile_temperature": value(scene.is_projectile),
        "target_temperature": value(layers),
        "temperature_max": value(scene.is_projectile | layers, maximum=True),
    }


def phase_fractions(entropy: np.ndarray, levels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return mass fractions of melt and vapour (n,); `levels` (n, 5) [J/(kg K)] as in the module's formulas."""
    _, solid, liquid, boiling, gas = levels.T
    melt = np.clip((entropy - solid) / (liquid - solid), 0.0, 1.0)
    return melt, np.clip((entropy - boiling) / (gas - boiling), 0.0, 1.0)


@measures("run", "melt", "vapour", needs=("motion",))
def phases(scene: Scene) -> Outcomes:
    """Return the masses of melt and vapour of projectile and layers [kg]."""
    entropies: Sequence[Sequence[float] | None] = scene.state.metadata.get("entropies") or ()
    refuse_if(not entropies or "entropy" not in scene.state.fields, "no material has `melting: {entropies: ...}`")
    levels = np.array([[np.nan] * 5 if values is None else values for values in entropies])[scene.state.material]
    fractions = phase_fractions(scene.state.fields["entropy"], levels)
    layers = np.isin(scene.state.body, scene.layers)
    bodies = {"all": scene.is_projectile | layers, "projectile": scene.is_projectile, "target": layers}

    def mass(rows: np.ndarray, fraction: np.ndarray) -> Outcome:
        defined = rows & np.isfinite(fraction)
        if not defined.any():
            without = "its material has no `melting: {entropies: ...}`, or is in a late stage"
            return without if rows.any() else "there is no layer"
        note = "" if defined.sum() == rows.sum() else "materials without entropies, or in a late stage, are left out"
        return Result(float((scene.state.fields["mass"][defined] * fraction[defined]).sum()), note=note)

    return {
        name: {body: mass(rows, fraction) for body, rows in bodies.items()}
        for name, fraction in zip(("melt", "vapour"), fractions, strict=True)
    }
