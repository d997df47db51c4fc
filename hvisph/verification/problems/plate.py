"""Aluminium plates at 600 m/s: precursor, plateau, release, free surface and separation.

The material is elastic and perfectly plastic, so that an elastic precursor runs ahead of the plastic shock. All figures
but the last stand beside the exact waves of the welded plates, which hold until the interface would bear tension; the
velocities after parting are those of the exact plates at that moment, when each keeps the momentum that it has.
"""

from collections.abc import Iterator, Sequence
from functools import lru_cache

import numpy as np

from hvisph.core.text import Plain
from hvisph.exact.plate_impact import PlateImpact, impact, with_reflections
from hvisph.exact.wave_fronts import Tracked
from hvisph.materials.material_table import Material
from hvisph.verification.problem import Figure, Options, Problem, Ran, Start, Trial, body_material, computed_and_exact
from hvisph.visualization.curves import Curve
from hvisph.visualization.curves import steps as corners

MATERIALS = {"stiffened gas": "aluminium-howell-ball", "Mie-Grueneisen": "aluminium-howell-ball-mie-gruneisen"}
SPEED, LENGTH, END = 600.0, 10e-3, 8e-6
WAVES = 3.7e-6  # until when the exact waves are followed: the plates part before [s]
GAUGES = {"near": 3e-3, "middle": 5e-3, "far": 7.5e-3}  # from the interface into the target [m]
FINE = 12.5e-6  # spacing up to which the precursor has settled 3 mm from the interface [m]


def _trials(options: Options) -> Iterator[Trial]:
    dx = options.dx(12.5e-6, 25e-6)
    for name in list(MATERIALS)[:1] if options.quick else MATERIALS:
        yield _trial(name, dx)


def _trial(name: str, dx: float) -> Trial:
    shape = {"type": "interval", "length": LENGTH}
    case: Plain = {
        "title": f"aluminium plates at 600 m/s, {name}",
        "kinematics": "uniaxial_strain",
        "resolution": dx,
        "bodies": {
            "flyer": {"material": MATERIALS[name], "shape": shape, "velocity": [SPEED]},
            "target": {"material": MATERIALS[name], "shape": shape},
        },
        "time": {"end": END},
        "gauges": {
            gauge: {"type": "material", "at": [at], "fields": ["stress_xx", "velocity"]} for gauge, at in GAUGES.items()
        }
        | {"surface": {"type": "free_surface", "at": [LENGTH], "fields": ["velocity"]}},
    }
    return Trial(name, [Start(case)], _figures, _curves, across="time")


@lru_cache(maxsize=4)
def _waves(material: Material) -> tuple[PlateImpact, Tracked]:
    plates = [(material, -LENGTH, 0.0, SPEED), (material, 0.0, LENGTH, 0.0)]
    return impact(material, material, SPEED), with_reflections(plates, 4.2e-6)


def _figures(runs: Sequence[Ran]) -> Iterator[Figure]:
    (ran,) = runs
    first, waves = _waves(body_material(ran.case, "target"))
    elastic, plastic = first.target_fronts
    time = ran.history["time"]
    for gauge in ("near", "far") if ran.dx <= FINE else ("far",):
        at = GAUGES[gauge]
        # the later part of the step between both fronts, clear of the plastic front's foot
        begin, end = at / elastic.speed, at / plastic.speed
        inside = _in_interval(time, begin + 0.5 * (end - begin), begin + 0.75 * (end - begin))
        computed = -ran.history[f"gauge.{gauge}.stress_xx"][inside].mean()
        why = "a front of some particles must settle within the step"
        name = f"precursor (HEL) at {1e3 * at:g} mm"
        yield Figure(name, float(computed), plastic.ahead.stress, 0.03, "Pa", why=why)
    yield from _levels(ran, waves, first.stress)
    slowed = SPEED - interface_slowdown(waves)  # after parting each keeps what it had at the first tension between them
    why = "of the slower plate: the momentum that stays with it"
    yield Figure("flyer velocity after separation", float(ran.mean_velocity(0)[0]), slowed, 0.03, "m/s", why=why)
    right = SPEED - slowed
    yield Figure("target velocity after separation", float(ran.mean_velocity(1)[0]), right, 0.03, "m/s", slowed, why)


def _levels(ran: Ran, waves: Tracked, plateau: float) -> Iterator[Figure]:
    """Yield the plateau and the release at the middle gauge, and the free surface, beside the exact waves."""
    time, at = ran.history["time"], _start_position(ran, GAUGES["middle"])
    stress, velocity = waves.sample(at, time, "stress"), waves.sample(at, time, "velocity")
    high = np.flatnonzero(np.abs(stress / plateau - 1.0) < 0.01)
    inside = _middle(time, time[high[0]], time[high[-1]])
    computed = -ran.history["gauge.middle.stress_xx"][inside].mean()
    yield Figure("stress of the plateau", float(computed), float(stress[inside].mean()), 0.005, "Pa")
    low = np.flatnonzero((time > time[high[-1]]) & (np.abs(stress) < 0.05 * plateau))
    # until the release is over: the next wave comes from the other surface
    last = low[np.flatnonzero(np.diff(low) > 1)[0]] if (np.diff(low) > 1).any() else low[-1]
    inside = _middle(time, time[low[0]], min(time[last], WAVES))
    computed = ran.history["gauge.middle.velocity_x"][inside].mean()
    yield Figure("velocity behind the release", float(computed), float(velocity[inside].mean()), 0.01, "m/s")
    times, values = waves.surface()
    arrival = times[1:][np.abs(np.diff(values)).argmax()]
    inside = _in_interval(time, arrival + 0.2e-6, arrival + 0.8e-6)
    exact = values[np.searchsorted(times, time[inside], side="right") - 1]
    computed = ran.history["gauge.surface.velocity_x"][inside].mean()
    yield Figure("velocity of the free surface", float(computed), float(exact.mean()), 0.01, "m/s")


def parting_time(waves: Tracked) -> float:
    """Return the time of the first tension at the interface of two bonded plates [s]."""
    times, states = waves.gauge(0.0)
    return next(float(t) for t, state in zip(times, states, strict=True) if t > 1e-6 and state.stress < 0.0)


def interface_slowdown(waves: Tracked) -> float:
    """Return the flyer's loss of velocity [m/s], by the impulse: good to 0.1 m/s, the momentum to 3 m/s."""
    times, states = waves.gauge(0.0)
    end = parting_time(waves)
    before = times < end
    stress = np.array([state.stress for state in states])[before]
    impulse = float((np.diff(np.append(times[before], end)) * stress).sum())
    return impulse / float(waves.bounds[1] - waves.bounds[0])


def _start_position(ran: Ran, at: float) -> float:
    """Return where the particle started that a gauge rides on [m]."""
    x = ran.first.fields["position"].ravel()
    return float(x[np.abs(x - at).argmin()])


def _in_interval(time: np.ndarray, begin: float, end: float) -> np.ndarray:
    return (time >= begin) & (time <= end)


def _middle(time: np.ndarray, begin: float, end: float) -> np.ndarray:
    return _in_interval(time, begin + 0.3 * (end - begin), begin + 0.8 * (end - begin))


def _curves(runs: Sequence[Ran]) -> dict[str, list[Curve]]:
    (ran,) = runs
    _, waves = _waves(body_material(ran.case, "target"))
    end = parting_time(waves)
    rows = ran.history["time"] < end
    time = ran.history["time"][rows]
    gauge, moments = waves.gauge(_start_position(ran, GAUGES["far"]))
    surface, values = waves.surface()
    stress = np.array([-state.stress for state in moments])
    exact = {"stress_xx": (gauge, stress), "velocity_x": (surface, values)}
    gauges = {"stress_xx": "gauge.far.stress_xx", "velocity_x": "gauge.surface.velocity_x"}
    panels: dict[str, list[Curve]] = {}
    for column, (times, right) in exact.items():
        x, values = corners(times[times < end], right[times < end], end)
        panels |= computed_and_exact(time, {column: ran.history[gauges[column]][rows]}, x, {column: values})
    return panels


PROBLEM = Problem("plate", "plastic plates at 600 m/s: precursor, plateau, release, surface, separation", _trials)
