"""`hvisph check`: estimate, warnings and picture of a case before it runs."""

import shlex
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

from hvisph.case.bodies import Body
from hvisph.case.case import Case
from hvisph.case.conditions import condition_words
from hvisph.case.consistency import warnings_of
from hvisph.cli import options
from hvisph.cli.formatting import duration, echo_json, paragraph, quantity, say, size, table
from hvisph.core.catalogues import KINEMATICS
from hvisph.core.errors import CaseError, computable
from hvisph.core.measure_catalogue import format_time
from hvisph.core.text import Plain
from hvisph.exact.hugoniot import Impact
from hvisph.precheck.advice import advice, contact_warnings, sparse, tears
from hvisph.precheck.estimate import (
    SINGLE_PRECISION,
    BodyEstimate,
    Estimate,
    available_threads,
    compilation,
    estimate,
    is_single,
    of_cores,
)
from hvisph.precheck.impact_pair import first_contact, impact_pair, plane_shock
from hvisph.precheck.regime import experience, regime
from hvisph.setup.bodies import placed_bodies
from hvisph.setup.initial_state import held_particles
from hvisph.setup.materials import material_of
from hvisph.setup.rigid_bodies import describe_rigid
from hvisph.visualization.setup import DrawnBody, Setup, setup_picture


def draw_setup(case: Case, path: str) -> Path:
    """Draw the set-up of `case` into the file `path`."""

    def number(value: float, unit: str) -> str:
        return quantity(value, unit if case.units == "si" else "")

    placed = placed_bodies(case)
    bodies = []
    for body in placed:
        model, clamped = body.model, held_particles(case.clamped, body.name, body.positions)
        shape = "of the run" if body.carried else model.shape.type
        label = f"{body.name}: {model.material.name or 'own material'}, {shape}"
        label += f", rigid, {model.rigid.words}" if model.rigid is not None else ""
        bodies.append(DrawnBody(body.name, label, body.positions, body.breadth, body.mean_velocity, clamped))
    notes = []
    if case.start is not None:
        notes.append(f"start {case.start.words(number)}")
    contact = first_contact(placed)
    if contact is not None:
        time, body_hit, partner = contact
        instant = format_time(time) if case.units == "si" else f"{time:.4g}"
        notes.append(f"first contact: {body_hit} and {partner} at {instant}")
    notes += [f"{word} {text}" for word, text in condition_words(case) if word.startswith(("moving", "load"))]
    if case.gravity is not None and case.gravity.type == "sphere":
        notes.append(f"gravity {case.gravity.words(number)}")
    planes = [("xyz".index(plane.axis), plane.at) for plane in case.symmetry]
    pull = case.gravity.acceleration if case.gravity is not None and case.gravity.type == "uniform" else ()
    moving = {
        (axis, at): sum(speed for _, speed in plane.velocity)
        for (axis, at), plane in zip(planes, case.symmetry, strict=True)
        if plane.velocity
    }
    edges = [("xyz".index(edge.axis), edge.at) for edge in case.edges]
    gauges = {name: gauge.at for name, gauge in case.gauges.items()}
    title, axisymmetric = case.title or "untitled case", KINEMATICS[case.kinematics].axisymmetric
    return setup_picture(
        Setup(title, bodies, planes, gauges, notes, case.units == "si", axisymmetric, edges, pull, moving), path
    )


Format = Callable[[float, str], str]  # of a number with its SI unit
LARGE = 1e7  # grammes and cubic millimetres from which on kilogrammes and metres are read
PLATE = 0.5  # of its other sizes: a thinner body is a layer, whose mass per area is shown


def check(
    case: options.CaseArgument,
    resolution: options.ResolutionOption = None,
    settings: options.SetOption = None,
    threads: options.ThreadsOption = None,
    as_json: options.JsonOption = False,
    picture: options.PictureOption = None,
) -> None:
    """Check a case without running it: particles, steps, time, memory, expected pressure, warnings."""
    loaded = options.load(case, settings, resolution)
    with computable():
        warnings = [*warnings_of(loaded), *contact_warnings(loaded), *advice(loaded)]
    with options.locate_errors(case), computable():
        estimates = estimate(loaded, threads)
        if picture is not None:
            file = draw_setup(loaded, picture)
            say(f"set-up drawn into {file}", err=True)
    warnings += sparse({body.name: body.across for body in estimates.bodies}, loaded.resolution)
    for warning in warnings:
        say(f"warning: {_tested(warning, case, settings or [], resolution)}", err=True)
    shock, reason = plane_shock(loaded)
    if as_json:
        echo_json(_plain(loaded, estimates, shock, reason))
    else:
        say(_words(loaded, estimates, shock, reason))


def _tested(warning: str, case: str, settings: list[str], resolution: str | None) -> str:
    """Return a warning whose settings the case accepts, else with the reason why it does not."""
    text, *line = warning.split("\n")
    if not line:
        return warning
    try:
        advised = shlex.split(line[0])[1::2]
        spacing = None if any(setting.startswith("resolution=") for setting in advised) else resolution
        options.load(case, [*settings, *advised], spacing)
    except CaseError as error:
        return f"{text}; this case would refuse {line[0].strip()}: {error}"
    return warning


def _plain(case: Case, estimates: Estimate, shock: Impact | None, reason: str) -> Plain:
    facts = {name: getattr(case, name) for name in ("title", "kinematics", "resolution", "smoothing_length")}
    facts |= {"formulation": case.formulation.type, "particles": estimates.particles} | asdict(estimates)
    facts["regime"] = asdict(regime(case)) | {"words": regime(case).words}
    facts["plane_shock"] = {"reason": reason} if shock is None else asdict(shock)
    return facts


def _words(case: Case, estimates: Estimate, shock: Impact | None, reason: str) -> str:
    si = case.units == "si"

    def number(value: float, unit: str, digits: int = 4) -> str:
        return quantity(value, unit if si else "", digits)

    about = "" if estimates.counted else "about "
    rows = [("body", "material", "shape", "velocity", "particles")]
    for body in estimates.bodies:
        model = case.bodies[body.name]
        velocity = ", ".join(f"{v:g}" for v in model.velocity) + (" m/s" if si else "")
        velocity += "".join(f" + {field.type}" for field in model.initial_velocity)
        velocity = "of the run" if body.carried else velocity
        filling = f"{about}{body.particles}, {body.across} {'along' if case.dim == 1 else 'across'}"
        rows.append((body.name, model.material.name or "own", _shape(model, number), velocity, filling))
    lines = [
        case.title or "untitled case",
        f"{KINEMATICS[case.kinematics].words}, {case.formulation.type} formulation, "
        f"dx = {number(case.resolution, 'm')}, h = {number(case.smoothing_length, 'm')}",
        "",
        table(rows),
        *(paragraph(f"{body.name}: {_filling(body, case, number)}", indent=2, hanging=4) for body in estimates.bodies),
        "",
    ]
    facts = [("particles", f"{about}{estimates.particles}")]
    if case.start is not None:
        facts.append(("start", case.start.words(number)))
    if case.gravity is not None:
        weight = ", bodies under their weight" if case.overburden else ""
        weight += f", settled for {number(case.settle, 's')} before the start" if case.settle else ""
        facts.append(("gravity", case.gravity.words(number) + weight))
    facts += _rigid(case, estimates)
    facts += condition_words(case)
    if case.start is None:
        impact = regime(case)
        facts.append(("regime", impact.words))
        if text := tears(case):
            facts.append(("", text))
        if validated := experience(case, impact):
            facts.append(("validation", validated))
    if shock is None:
        facts.append(("plane shock", f"none: {reason}"))
    else:
        pair = impact_pair(case)
        assert pair is not None
        interface = number(shock.interface_velocity, "m/s")
        speeds = [number(side.shock_speed, "m/s") for side in (shock.projectile, shock.target)]
        text = f"{number(shock.pressure, 'Pa')} by impedance matching without strength, {pair.first} on {pair.second} "
        text += f"at {number(pair.velocity, 'm/s')}; interface at {interface} relative to {pair.second}"
        into = f"into {pair.first}, {speeds[1]} into {pair.second}, relative to the material ahead of each"
        facts += [("plane shock", text), ("", f"shock speeds {speeds[0]} {into}")]
    threads = of_cores(estimates.threads, available_threads())
    loops, seconds = compilation()
    compiling = f"after compiling {loops} loops, about {duration(seconds)}" if loops else "all loops are in the cache"
    fewer = ", fewer once late stages begin" if any(stage.at == "auto" for stage in case.late) else ""
    facts += [
        ("steps", f"about {float(f'{estimates.steps:.2g}'):.0f} to t = {number(case.time.end, 's')}{fewer}"),
        ("time", f"about {duration(estimates.seconds)} on {threads}; {compiling}"),
        ("memory", f"about {size(estimates.memory)}"),
        ("disk", f"about {size(estimates.disk)} in {estimates.snapshots} snapshots ({', '.join(case.output.formats)})"),
    ]
    if is_single(case):
        gain = f"a step takes about {SINGLE_PRECISION[case.formulation.type]:g} of the time"
        facts.append(("precision", f"pairs in single: {gain}; energy and momentum drift by 1e-8, not by round-off"))
    facts += _fit_residuals(case, number, " m/s" if si else "")
    names = [name for name, _ in case.expected.items()]
    if names:
        facts.append(("expected", ", ".join(names)))
    return "\n".join([*lines, table(facts)])


def _rigid(case: Case, estimates: Estimate) -> list[tuple[str, str]]:
    """Return motion, mass and moments of inertia of rigid bodies, of large cases the motion alone."""
    rigid = {name: body.rigid for name, body in case.bodies.items() if body.rigid is not None}
    if not (rigid and estimates.counted):
        return [("rigid body", f"{name}, {body.words}") for name, body in rigid.items()]
    return [
        ("rigid body", f"{body.name}, {describe_rigid(case, body, material_of(body.model.material, 0.0))}")
        for body in placed_bodies(case)
        if body.name in rigid
    ]


def _fit_residuals(case: Case, number: Format, unit: str) -> list[tuple[str, str]]:
    """Return the lines through measured points of Hugoniots, with the residual of each point."""
    facts = []
    for name, body in case.bodies.items():
        eos = body.material.eos
        if eos.type == "mie_gruneisen" and eos.us_up:
            c0, s1, s2, s3 = eos.hugoniot
            curve = f" {s2:+.4g} up^2/Us {s3:+.4g} up^3/Us^2" if eos.us_up_order > 1 else ""
            residuals = ", ".join(f"{residual:+.3g}" for residual in eos.residuals)
            line = f"{name}: Us = {number(c0, 'm/s')} + {s1:.4g} up{curve}, {len(eos.us_up)} points"
            facts += [("Hugoniot", line), ("", f"measured less fitted: {residuals}{unit}")]
    return facts


def _filling(body: BodyEstimate, case: Case, number: Format) -> str:
    """Return place, mass and volume of a body, and the adjustments that make them exact."""
    if case.units == "si":
        depth = {1: "/m^2", 2: "/m", 3: ""}[case.drawing_dimensions]
        millimetres = {1: "mm", 2: "mm^2", 3: "mm^3"}[case.drawing_dimensions]
        metres = "m" if case.drawing_dimensions == 1 else f"m^{case.drawing_dimensions}"
        small = 1e3**case.drawing_dimensions * body.volume
        volume = f"{small:.5g} {millimetres}" if small < LARGE else f"{body.volume:.5g} {metres}"
        weight = f"{1e3 * body.mass:.5g} g" if 1e3 * body.mass < LARGE else f"{body.mass:.5g} kg"
        words = f"mass {weight}{depth}, volume of the shape {volume}"
        shape = case.bodies[body.name].shape
        sizes = sorted(shape.extent())
        if case.drawing_dimensions == 3 and shape.type in ("box", "cylinder") and sizes[0] < PLATE * sizes[1]:
            words += f", {0.1 * body.mass / body.volume * sizes[0]:.4g} g/cm^2"
    else:
        words = f"mass {body.mass:.5g}, volume of the shape {body.volume:.5g}"
    if body.along:
        words = f"x from {' to '.join(number(end, 'm') for end in body.along)}, {words}"
    error = body.exactness - 1
    words += "" if abs(error) < 1e-6 else f"; its particles weigh {100 * error:+.2g} % of it"
    return f"{words}; {body.note}" if body.note else words


def _shape(body: Body, number: Format) -> str:
    sizes = " x ".join(number(side, "m") for side in dict.fromkeys(body.shape.extent()))
    if body.shape.type == "box":
        sizes = " x ".join(number(side, "m") for side in body.shape.size)
    spacing = f", dx = {number(body.resolution, 'm')}" if body.resolution else ""
    return f"{body.shape.type} {sizes}, {body.arrangement}{spacing}".replace(" ,", ",")
