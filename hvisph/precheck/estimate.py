"""Estimated cost of a case: particles, steps, time, memory and disk. Compiles nothing.

Steps follow from the time-step criterion at the start of the impact, time from speeds measured on
a laptop core: both are rough.
"""

import math
import os
from dataclasses import dataclass

from hvisph.case.bodies import Body
from hvisph.case.case import Case
from hvisph.compiler.jit import missing_loops
from hvisph.core.errors import CaseError, locate
from hvisph.core.fields import CATALOGUE
from hvisph.core.memory import free_memory
from hvisph.core.particles import BASE_FIELDS
from hvisph.geometry.cutting_planes import Section
from hvisph.geometry.filling import estimated_count
from hvisph.integrators.time_step import VISCOUS_SIGNAL
from hvisph.setup.bodies import PlacedBody, placed_bodies
from hvisph.setup.build import build
from hvisph.setup.materials import material_of, start_of
from hvisph.setup.shapes import shape_of

# Bodies of more particles than this are counted by their volumes instead of being filled.
MOST_FILLED = 2_000_000
# What the largest memory of runs grows by from 300,000 to 1,000,000 particles (`benchmarks/memory.py`), with moments of
# output inside steps, checkpoints and measures: by formulation and dimensions [bytes a particle], what lists of
# neighbours take [bytes a neighbour], and the constant rest: interpreter, compiled loops, measures.
MEMORY = {
    "eulerian": {1: 570, 2: 600, 3: 970},
    "riemann": {1: 540, 2: 720, 3: 1080},
    "total_lagrangian": {1: 700, 2: 1070, 3: 1600},
    "adaptive": {1: 700, 2: 1080, 3: 1600},
    "projection": {1: 600, 2: 640, 3: 640},
}
_REFERENCE = {1: 30, 2: 30, 3: 15}
LISTED = {"total_lagrangian": _REFERENCE, "adaptive": _REFERENCE, "projection": {1: 20, 2: 18, 3: 21}}
INTERPRETER = 190_000_000  # [bytes]
# What the first of several processes holds of the whole when it hands it out or writes it [bytes a particle].
BEGINNING = 600
# Share of a spacing by which particles that touch may place a body off its face.
PLACED = 0.25
# Share of the impact velocity that the signals of a run gain over those at rest, on the mean of steps:
# 0.7 to 1.0 in the bundled cases.
COMPRESSION = 0.8
HISTORY_LINE = 300  # [bytes]
# What a snapshot holds beside the state, as padded for ParaView [bytes a particle].
SNAPSHOT_EXTRAS = 8 * 4 + 17 + 24 + 33
VTU_GROWTH = 4 / 3  # numbers as text in base 64


@dataclass(frozen=True)
class BodyEstimate:
    """One body, as particles."""

    name: str  # name in the case
    particles: int  # number of particles
    # particles across the shot line, on both sides of an axis of revolution; in 1D along the body
    across: int
    mass: float  # mass [kg], per metre of depth in 2D and per square metre in 1D
    volume: float = 0.0  # volume of the shape, of its part that symmetry planes keep [m^dim]
    exactness: float = 1.0  # mass of the particles over that of the shape [-]
    note: str = ""  # change that makes sizes and mass exact, or size that differs in a nominal filling
    # where it begins and ends along x [m]; empty where particles were not made
    along: tuple[float, float] | tuple[()] = ()
    carried: bool = False  # whether it starts from another run


@dataclass(frozen=True)
class Estimate:
    """Estimated cost of a case."""

    bodies: tuple[BodyEstimate, ...]  # its bodies
    counted: bool  # whether particles were made and counted; otherwise their number follows from volumes
    steps: int  # number of steps
    seconds: float  # wall time on `threads` threads without compilation [s]
    threads: int  # number of threads
    # memory of the process and size of the run's folder [bytes]
    memory: float
    disk: float
    snapshots: int  # number of snapshots

    @property
    def particles(self) -> int:
        """Number of particles of all bodies."""
        return sum(body.particles for body in self.bodies)


def estimate(case: Case, threads: int | None = None) -> Estimate:
    """Estimate the cost of running `case`.

    `threads`: number of threads asked for; those that a run would use unless given.

    Raises `CaseError` when the case cannot be built: overlapping bodies, a shape that cannot be filled, too little
    memory.
    """
    refuse_impossible(case)
    filled = rough_count(case) <= MOST_FILLED
    if filled:
        placed = placed_bodies(case)
        build(case, placed)  # compiles nothing, and refuses what a run would refuse
        bodies = tuple(_body_estimate(body, case) for body in placed)
    else:
        bodies = tuple(_coarse_estimates(case))
    particles = sum(body.particles for body in bodies)
    steps = estimated_steps(case)
    threads = min(threads, fed_threads(case, particles)) if threads else worthwhile_threads(case, particles)
    snapshots = 1 + math.ceil(case.duration / case.snapshot_interval - 1e-9)
    numbers = sum(PADDED[CATALOGUE[name].rank] for name in BASE_FIELDS)
    bytes_each = (8 * numbers + SNAPSHOT_EXTRAS) * sum(VTU_GROWTH if f == "vtu" else 1.0 for f in case.output.formats)
    return Estimate(
        bodies=bodies,
        counted=filled,
        steps=steps,
        seconds=steps * step_seconds(case, particles, threads),
        threads=threads,
        memory=INTERPRETER + memory_each(case) * particles,
        disk=snapshots * particles * bytes_each + HISTORY_LINE * steps / case.output.history_every,
        snapshots=snapshots,
    )


def refuse_impossible(
    case: Case, *, free: float | None = None, processes: int = 1, beside: int = 1, begins: bool = False
) -> None:
    """Refuse a case that surely needs more memory than there is, before a particle is made.

    Overlapping bodies are refused where they are placed (`hvisph.setup.bodies`).

    `free`: memory that may be used [bytes]; that of the system unless given.
    `processes`, `beside`: all processes, and those of this machine, each of which has its part.
    `begins`: whether one of them begins with the state of the whole, of which it gives the others theirs.

    Raises `CaseError` with the memory needed, the memory available, and a resolution that fits.
    """
    count = rough_count(case)
    per_particle, interpreter = memory_each(case) * beside / processes, beside * INTERPRETER
    if begins:
        per_particle += BEGINNING
    required = interpreter + per_particle * count
    free = free_memory() if free is None else free
    if required <= free:
        return
    available = max(free - interpreter, 0.0)
    si = case.units == "si"
    shrink = (count * per_particle / available) ** (1.0 / case.dim) if available else math.inf
    fits = f"{case.resolution * shrink * (1e3 if si else 1.0):.2g}{' mm' if si else ''}" if available else "none"
    share_words, fewer = "", ""
    if processes > 1:
        share_words = f" on this machine, which has {beside} of {processes} processes,"
        fewer = "take more machines; "
    name, extent = max(
        ((name, max(body.shape.extent(), default=0.0)) for name, body in case.bodies.items()), key=lambda pair: pair[1]
    )
    largest = f" (the largest, bodies.{name}, measures {extent:.4g}{' m' if case.units == 'si' else ''})"
    raise CaseError(
        f"about {count:.2g} particles{largest} need{share_words} about {required / 1e9:.3g} GB of memory, "
        f"and {free / 1e9:.3g} GB are free; {fewer}the finest resolution that fits is about {fits}",
        where="resolution",
    )


def rough_count(case: Case) -> float:
    """Return the number of particles by volume; each plane of symmetry is taken to halve it."""
    counts = []
    for name, body in case.bodies.items():
        with locate(f"bodies.{name}"):
            counts.append(_rough(body, case))
    return sum(counts)


def _rough(body: Body, case: Case) -> float:
    """Return the number of a body's particles by volume; a graded body is taken to be fine throughout."""
    if body.shape.type == "particles":
        return 0.0
    shape = shape_of(body.shape, case.drawing_dimensions)
    filled = shape if case.drawing_dimensions == case.dim else Section(shape)
    count = estimated_count(filled, body.spacing(case))
    return count * 0.5 ** len({plane.axis for plane in case.symmetry})


def estimated_steps(case: Case) -> int:
    """Return about how many steps `case` takes; a late stage that begins by itself is taken not to."""
    finest = min(body.spacing(case) for body in case.bodies.values()) / case.resolution
    length = case.time.cfl * finest * case.smoothing_length
    dt = case.time.step or length / _signal_speed(case)
    timed = [stage for stage in case.late if stage.at != "auto"]
    begins = [case.begins, *(float(stage.at) for stage in timed), case.time.end]
    steps = math.ceil((begins[1] - case.begins) / dt - 1e-9)
    density = min(material_of(body.material, body.internal_energy).density_at_rest for body in case.bodies.values())
    for stage, begin, end in zip(timed, begins[1:-1], begins[2:], strict=True):
        if stage.bulk_modulus:  # with K + 4 G/3 = 3 K (1 - nu)/(1 + nu)
            stiff = 3.0 * stage.bulk_modulus * (1.0 - stage.nu) / (1.0 + stage.nu)
            dt = max(dt, case.time.step or length / math.sqrt(stiff / density))
        steps += math.ceil((end - begin) / dt - 1e-9)
    return min(steps, case.time.max_steps or steps)


def _signal_speed(case: Case) -> float:
    """Return the speed of signals that sets the step [m/s]: that at rest and a share of the impact's."""
    alpha = getattr(getattr(case.formulation, "viscosity", None), "alpha", 0.0)
    materials = [material_of(body.material, body.internal_energy) for body in case.bodies.values()]
    at_rest = max(m.longitudinal_sound_speed + VISCOUS_SIGNAL * alpha * m.bulk_sound_speed for m in materials)
    velocities = [body.velocity for body in case.bodies.values()]
    fastest = max(math.dist(u, v) for u in velocities for v in velocities)
    return at_rest + COMPRESSION * fastest


def _body_estimate(body: PlacedBody, case: Case) -> BodyEstimate:
    size, dim, ends = body.filling.size, len(body.filling.size), body.positions[:, 0]
    width = size[min(1, dim - 1)]
    if case.drawing_dimensions != case.dim:  # axisymmetric: the section on one side of the axis was filled
        outer = float((body.positions[:, 1] + 0.5 * body.spacing).max())
        inner = float((body.positions[:, 1] - 0.5 * body.spacing).min())
        width = 2.0 * outer if inner < 0.5 * body.filling.finest else outer - inner
    volume = float(body.volumes.sum())
    mass, count_across = _density(body.name, body.model) * volume, round(width / body.filling.finest)
    low, high = float((ends - 0.5 * body.spacing).min()), float((ends + 0.5 * body.spacing).max())
    if body.surface is not None:
        low, high = (float(corner[0]) for corner in body.surface.bounds())
        for plane in case.symmetry:
            if plane.axis == "x":
                low, high = (max(low, plane.at), high) if plane.keep == "above" else (low, min(high, plane.at))
    ends_x = (low, high)
    if body.model.position is None:  # in a row round bodies stand a little off
        ends_x = _at_zero(low, high, PLACED * body.filling.finest)
    count, carried, whole = len(body.positions), bool(body.carried), body.requested_volume
    return BodyEstimate(body.name, count, count_across, mass, whole, volume / whole, body.filling.note, ends_x, carried)


def _at_zero(low: float, high: float, tolerance: float) -> tuple[float, float]:
    """Return both ends, one of them 0 where it is less than `tolerance` from there [m]."""
    if abs(high) < tolerance:
        return low - high, 0.0
    return (0.0, high - low) if abs(low) < tolerance else (low, high)


def _density(name: str, model: Body) -> float:
    """Return the density that a body starts with [kg/m^3]."""
    return start_of(name, model, material_of(model.material, model.internal_energy))[0]


def _coarse_estimates(case: Case) -> list[BodyEstimate]:
    parts = []
    for name, body in case.bodies.items():
        shape, dx = shape_of(body.shape, case.drawing_dimensions), body.spacing(case)
        count, width = _rough(body, case), shape.extent()[min(1, case.dim - 1)] / dx
        volume = count * dx**case.dim if case.drawing_dimensions == case.dim else shape.volume
        parts.append(BodyEstimate(name, round(count), round(width), _density(name, body) * volume, volume))
    return parts


def memory_each(case: Case) -> float:
    """Return the memory of a run per particle [bytes]."""
    formulation, dim = case.formulation.type, case.dim
    reach = case.formulation.support_over_h * case.formulation.h_over_dx
    neighbours = {1: 2.0, 2: math.pi, 3: 4.0 / 3.0 * math.pi}[dim] * reach**dim
    pairs = LISTED.get(formulation, {}).get(dim, 0) * neighbours
    return MEMORY[formulation][dim] + pairs


PADDED = {"scalar": 1, "vector": 3, "symmetric": 6, "gradient": 9}  # numbers in a snapshot by rank
# Time on one core, by formulation and dimensions [us a particle-step].
MICROSECONDS = {
    "eulerian": {1: 0.15, 2: 0.25, 3: 0.85},
    "riemann": {1: 0.3, 2: 0.6, 3: 2.4},
    "projection": {1: 0.1, 2: 0.25, 3: 1.2},
    "total_lagrangian": {1: 0.2, 2: 0.3, 3: 0.9},
    "adaptive": {1: 0.3, 2: 0.45, 3: 1.2},
}
# Share of that with pairs in single precision.
SINGLE_PRECISION = {"eulerian": 0.9, "riemann": 0.8}
STEP_OVERHEAD = 2e-4  # whatever the number of particles [s]
THREAD_GAIN = 0.85  # of each further thread
# Compilation of a loop over particles with the models of materials, over pairs, and of any other [s of a core].
COMPILATION = {"update": 9.0, "deform": 9.0, "_diagnose": 1.5, "sweep": 3.0}
OTHER_LOOP = 0.5
# Work of a step that a further thread must find [s]. A step shares out its work four to eight times, and each costs
# the waking of a thread, 0.05 ms and far more on a busy machine: `benchmarks/small_cases.py`.
WORTH_A_THREAD = 1.5e-3
# And below which it waits for longer than it works, on a quiet machine too [s].
FEEDS_A_THREAD = 0.5e-3


def worthwhile_threads(case: Case, particles: int) -> int:
    """Return how many threads the case is worth, at most those that this process may use."""
    return max(1, min(available_threads(), int(_work(case, particles) / WORTH_A_THREAD)))


def fed_threads(case: Case, particles: int) -> int:
    """Return the most threads that a step finds work for: with more of them it takes longer."""
    return max(1, int(_work(case, particles) / FEEDS_A_THREAD))


def fewer_threads_reason(threads: int, case: Case, particles: int) -> str:
    """Return why a run uses fewer threads than requested; empty where it does not."""
    fed = fed_threads(case, particles)
    if threads <= fed:
        return ""
    work = 1e3 * _work(case, particles)
    return (
        f"{of_cores(fed, threads)} asked for: a step of {particles} particles is {work:.2g} ms of work, and a thread "
        f"that finds less than {1e3 * FEEDS_A_THREAD:g} ms makes it slower; the results are the same"
    )


def step_seconds(case: Case, particles: int, threads: int) -> float:
    """Return the wall time of a step on so many threads [s]."""
    return STEP_OVERHEAD + _work(case, particles) / (1.0 + THREAD_GAIN * (threads - 1))


def compilation() -> tuple[int, float]:
    """Return how many loops of the objects built in this process are not in the cache, and the time they take [s]."""
    loops = missing_loops()
    return len(loops), sum(COMPILATION.get(name, OTHER_LOOP) for name in loops)


def available_threads() -> int:
    """Return how many threads this process may use: a processor each, or fewer by ``NUMBA_NUM_THREADS``."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    setting = os.environ.get("NUMBA_NUM_THREADS", "")
    return max(1, int(setting)) if setting.isdigit() else cores


def of_cores(threads: int, cores: int) -> str:
    """Return a number of threads in words, with the number there could be where that is more."""
    words = f"{threads} thread{'s' if threads > 1 else ''}"
    return f"{words} of {cores}" if threads < cores else words


def is_single(case: Case) -> bool:
    """Return whether pairs are evaluated in single precision."""
    return getattr(case.formulation, "precision", "double") == "single"


def _work(case: Case, particles: int) -> float:
    pace = MICROSECONDS.get(case.formulation.type, MICROSECONDS["eulerian"])[case.dim]
    share = SINGLE_PRECISION[case.formulation.type] if is_single(case) else 1.0
    return 1e-6 * pace * share * particles
