"""Comparison of the computed peak pressure with impedance matching."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hvisph.core.errors import HvisphError
from hvisph.core.text import recommend

if TYPE_CHECKING:
    from hvisph.case.case import Case
    from hvisph.casefile.material_library import Library, Notes
    from hvisph.exact.hugoniot import Impact

MARGIN = 0.9  # of the ends of the range that a material is known to hold in, since the estimate is a flat impact's
APART = 0.3  # of the estimate: a difference that is worth a remark


def plane_shock(case: Case) -> tuple[Impact | None, str]:
    """Return the result of impedance matching of the impact pair.

    Returns the `hvisph.exact.hugoniot.Impact`, in the frame of the second of their `impact_pair`, and an empty text; or
    None and the reason why there is none.
    """
    if case.start is not None:
        return None, "bodies start from another run"
    if len(case.bodies) < 2:
        return None, "there is only one body"
    if case.kinematics == "plane_stress":
        return None, "a sheet in plane stress thickens before it bears the pressure of a shock"
    from .impact_pair import impact_pair

    pair = impact_pair(case)
    if pair is None:
        return None, "no two bodies approach each other"
    from hvisph.exact.hugoniot import impedance_match
    from hvisph.setup.materials import material_of

    try:
        bodies = [case.bodies[name] for name in (pair.first, pair.second)]
        projectile, target = (material_of(body.material, body.internal_energy) for body in bodies)
        return impedance_match(projectile, target, pair.velocity), ""
    except HvisphError as error:
        return None, str(error)
    except ArithmeticError:
        return None, "the numbers of the materials or the velocity are beyond it"


def hugoniot_warnings(case: Case) -> list[str]:
    """Return a warning for each of the bodies that meet first whose material is known to miss measured shocks here."""
    from hvisph.casefile.material_library import library_of

    from .impact_pair import impact_pair

    matched, pair = plane_shock(case)[0], impact_pair(case)
    if matched is None or pair is None:
        return []
    library, said = library_of(), []
    behind = {pair.first: pair.velocity - matched.interface_velocity, pair.second: matched.interface_velocity}
    for name, speed in behind.items():
        body = case.bodies[name]
        if body.material.name not in library.files:
            continue
        notes = library.notes(body.material.name)
        better = _better(library, notes, speed)
        remedy = [f"bodies.{name}.material={better}"] if better else []
        here = f"about {speed:.0f} m/s come here{f'; take {better}' if better else ''}"
        known = f"bodies.{name}.material: '{body.material.name}' meets measured shock speeds to 2 %"
        if notes.shocks is None:
            said += [recommend(f"{known} at no particle velocity, and {here}", *remedy)] if better else []
            continue
        low, high = notes.shocks
        if not _holds(notes, speed):
            said.append(
                recommend(f"{known} behind shocks of {low:g} to {high:g} m/s of particle velocity, and {here}", *remedy)
            )
    return said


def _better(library: Library, notes: Notes, speed: float) -> str:
    """Return the first of the materials named one by another whose shocks are as measured; empty where none is."""
    seen: list[str] = []
    while notes.beyond and notes.beyond not in seen:
        seen.append(notes.beyond)
        notes = library.notes(seen[-1])
        if _holds(notes, speed):
            return seen[-1]
    return ""


def _holds(notes: Notes, speed: float) -> bool:
    """Whether shocks are as measured at a particle velocity [m/s]; where no range is given, among the points."""
    speeds = notes.shocks or [up for points, _ in notes.hugoniot_points for up, _ in points]
    return bool(speeds) and MARGIN * min(speeds) <= speed <= max(speeds) / MARGIN


def compare_peak_pressure(case: Case, highest: float) -> tuple[dict[str, float | None], list[str]]:
    """Return the highest pressure of a run and the estimate [Pa], and a remark where they are far apart.

    `highest`: highest pressure of any particle up to the end [Pa].
    """
    shock, _ = plane_shock(case)
    estimate = None if shock is None else float(shock.pressure)
    pressures: dict[str, float | None] = {"highest": highest, "impedance_match": estimate}
    if not estimate or abs(highest / estimate - 1.0) <= APART:
        return pressures, []
    scale, unit = (1.0, "") if case.units == "none" else (1e-9, " GPa")
    return pressures, [
        f"the highest pressure of any particle is {scale * highest:.3g}{unit}, {highest / estimate:.2g} times the "
        f"{scale * estimate:.3g}{unit} of a flat impact by impedance matching: "
        + (
            "particles too coarse or an impact that is not flat lower it"
            if highest < estimate
            else "a spike at the contact, or waves that met, raise it"
        )
    ]
