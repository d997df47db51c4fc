"""Results of a sweep beside measured values and empirical correlations."""

import math
from collections.abc import Sequence
from dataclasses import asdict

import numpy as np

from hvisph.case.case import Case
from hvisph.case.units import DIMENSIONS, NUMBER, parse_quantity
from hvisph.core.catalogues import KINEMATICS
from hvisph.core.errors import CaseError
from hvisph.core.text import Plain, PlainMapping
from hvisph.measures.correlations import RECHT, limit_speeds, recht_ipson
from hvisph.precheck.correlation_input import impact_of

from .folder import Row
from .parameters import EXPERIMENT, FACTORS
from .plan import Plan


def against_experiment(rows: Sequence[Row]) -> Plain:
    """Return each measure beside its column of the experiment, by name.

    `rows`: cases that are done. A column counts where its name is that of a measure, and its cell is a number, with a
        unit or in SI.
    Returns by measure: ``unit``, ``cases`` (numbers), ``measured`` and ``computed`` [SI], and ``mean`` and ``worst``,
    the mean and the largest of (computed - measured)/measured with its sign; None where all that was measured is zero.
    """
    verdicts = {}
    for head in dict.fromkeys(head for row in rows for head in row["values"] if head.startswith(EXPERIMENT)):
        name = head.removeprefix(EXPERIMENT)
        pairs = [(row["number"], *pair) for row in rows if (pair := _pair(row, head, name)) is not None]
        if not pairs:
            continue
        numbers, measured, computed = (list(column) for column in zip(*pairs, strict=True))
        errors = [(c - m) / abs(m) for m, c in zip(measured, computed, strict=True) if m != 0.0]
        unit = next(
            row["measures"][name]["unit"] for row in rows if row["measures"].get(name, {}).get("unit") is not None
        )
        verdicts[name] = {
            "unit": unit,
            "cases": numbers,
            "measured": measured,
            "computed": computed,
            "mean": float(np.mean(errors)) if errors else None,
            "worst": max(errors, key=abs) if errors else None,
        }
    return verdicts


def _pair(row: Row, head: str, name: str) -> tuple[float, float] | None:
    """Return the measured and the computed value of a case [SI]; None where one of them is unknown."""
    measure = row["measures"].get(name, {})
    if not isinstance(measure.get("value"), int | float) or row["values"].get(head) is None:
        return None
    dimension = next((candidate for candidate in DIMENSIONS if candidate.unit == measure["unit"]), NUMBER)
    try:
        return parse_quantity(str(row["values"][head]), dimension), float(measure["value"])
    except ValueError:
        return None


def beside_limit(plan: Plan, limit: PlainMapping) -> Plain:
    """Return correlations beside a limit, in plain form: the speeds that they name, and residual velocities.

    Nothing where a velocity is not what varies, or where a correlation does not hold: those of plates are for spheres
    on aluminium, Recht and Ipson's for a cylinder that pushes a plug of its own diameter out of one plate.
    """
    if limit["limit"] is None or "velocity" not in limit["path"] or limit["unit"] not in FACTORS:
        return {}
    try:
        case = plan.case(limit["parameters"] | {limit["path"]: f"{limit['limit']!r} {limit['unit']}".strip()})
    except CaseError:
        return {}
    impact, _ = impact_of(case)
    references: Plain = {}
    if impact is not None and (laws := limit_speeds(impact)):
        references["correlations"] = [asdict(correlation) for correlation in laws]
    masses = _masses(case)
    if masses is not None:
        factor = FACTORS[limit["unit"]]
        speeds = [factor * shot["value"] for shot in limit["shots"]]
        residuals = [recht_ipson(speed, factor * limit["limit"], *masses) for speed in speeds]
        references["recht_ipson"] = {"a": masses[0] / sum(masses), "residuals": residuals, "source": RECHT}
    return references


def _masses(case: Case) -> tuple[float, float] | None:
    """Return the masses of a flat cylinder and of its plug from one plate [kg]; None for other shots."""
    if not (case.dim == 3 or KINEMATICS[case.kinematics].axisymmetric) or len(case.bodies) != 2:
        return None
    shot, plate = sorted(case.bodies.values(), key=lambda body: not any(body.velocity))
    if shot.shape.type != "cylinder" or plate.shape.type not in ("cylinder", "box") or any(plate.velocity):
        return None
    if shot.rotation is not None or plate.rotation is not None:
        return None
    length, diameter = shot.shape.extent()[:2]
    area = math.pi / 4.0 * diameter**2
    return shot.material.density * area * length, plate.material.density * area * min(plate.shape.extent())
