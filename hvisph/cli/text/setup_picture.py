"""Picture of the set-up of a case."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from hvisph.core.catalogues import KINEMATICS
from hvisph.core.measure_catalogue import format_time

if TYPE_CHECKING:
    from hvisph.case.case import Case


def draw_setup(case: Case, path: str) -> Path:
    """Draw the set-up of `case` into the file `path`."""
    from hvisph.precheck.impact_pair import first_contact
    from hvisph.setup.bodies import placed_bodies
    from hvisph.setup.initial_state import held_particles
    from hvisph.visualization.setup import DrawnBody, Setup, setup_picture

    placed = placed_bodies(case)
    bodies = []
    for body in placed:
        model, held = body.model, held_particles(case.clamped, body.name, body.positions)
        label = f"{body.name}: {model.material.name or 'own material'}, {model.shape.type}"
        bodies.append(DrawnBody(body.name, label, body.positions, body.breadth, body.mean_velocity, held))
    notes = []
    contact = first_contact(placed)
    if contact is not None:
        time, one, other = contact
        shown = format_time(time) if case.units == "si" else f"{time:.4g}"
        notes.append(f"first contact: {one} and {other} at {shown}")
    planes = [("xyz".index(plane.axis), plane.at) for plane in case.symmetry]
    gauges = {name: gauge.at for name, gauge in case.gauges.items()}
    title, revolved = case.title or "untitled case", KINEMATICS[case.kinematics].revolved
    return setup_picture(Setup(title, bodies, planes, gauges, notes, case.units == "si", revolved), path)
