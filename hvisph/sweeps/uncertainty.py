"""Combined uncertainty of a computed number: spacing, time and material.

All are half-widths of about 95 %: the grid convergence index times the value where the spacings converge, the largest
difference between them where they do not; the change over the last tenth of the run, or half the bracket of a limit;
2 sqrt(g C g) of the material, with C the covariance of a fit and g finite differences over one standard deviation of
each parameter at the coarsest spacing. The combined one is the root of their sum of squares, and a share is a square
over that sum.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hvisph.core.errors import CaseError

from .parameters import Values
from .statistics import convergence

MATERIAL = "material."


def read_fit(source: str | Mapping[str, Any] | None, folder: Path) -> dict[str, Any] | None:
    """Return what a fit's folder says of its material: name, parameters, correlation; raises `CaseError`."""
    if source is None or not isinstance(source, str):
        return None if source is None else dict(source)
    path = next((one for one in (folder / source, Path(source)) if one.is_dir()), Path(source))
    try:
        fit = json.loads((path / "results.json").read_text(encoding="utf-8"))["fit"]
        paths = [name for name in fit["parameters"] if name.startswith(MATERIAL)]
        chosen = [list(fit["parameters"]).index(name) for name in paths]
        correlation = np.array(fit["correlation"])[np.ix_(chosen, chosen)].tolist()
        keys = ("value", "deviation", "unit")
        parameters = {name: {key: fit["parameters"][name][key] for key in keys} for name in paths}
        return {"material": fit["material"]["name"], "parameters": parameters, "correlation": correlation}
    except (OSError, ValueError, KeyError, TypeError):
        raise CaseError(f"{source} is not the folder of a finished fit of a material", where="fit") from None


def perturbations(fit: Any, base: Mapping[str, Any]) -> list[Values]:
    """Return settings that raise each parameter of the fit by its standard deviation, in all bodies of its material."""
    if fit is None:
        return []
    name = fit["material"]
    materials = {body: one.get("material") for body, one in base.get("bodies", {}).items()}
    bodies = [
        body for body, one in materials.items() if name in (one, one.get("base") if isinstance(one, dict) else "")
    ]
    if not bodies:
        raise CaseError(f"no body is made of {name}, the material of the fit", where="fit")
    return [
        {f"bodies.{body}.{path}": f"{one['value'] + one['deviation']:.8g} {one['unit']}".strip() for body in bodies}
        for path, one in fit["parameters"].items()
    ]


def combine_uncertainties(
    spacings: Sequence[float], values: Sequence[float], time: float, perturbed: Sequence[float | None],
    correlation: Sequence[Sequence[float]],
) -> dict[str, Any] | None:  # fmt: skip
    """Return half-width and shares; None where a perturbed value is missing.

    Parameters
    ----------
    spacings, values
        Values at spacings.
    time
        Half-width by time at the finest.
    perturbed
        Values at the coarsest spacing with one parameter raised each.
    correlation
        Of the parameters.
    """
    if any(value is None for value in perturbed) or not values:
        return None
    finest, coarsest = (values[int(pick(spacings))] for pick in (np.argmin, np.argmax))
    known = convergence(values, spacings)
    spread = max(values) - min(values) if known.index is None else known.index * abs(finest)
    g = np.array([float(value or 0.0) - coarsest for value in perturbed])
    parts = {"spacing": float(spread), "time": float(time)}
    if len(g):
        parts["material"] = 2.0 * float(np.sqrt(max(g @ np.array(correlation) @ g, 0.0)))
    total = float(np.sqrt(sum(one**2 for one in parts.values())))
    return {"value": finest, "half_width": total, "parts": parts,
            "shares": {kind: (one / total) ** 2 if total else 0.0 for kind, one in parts.items()}}  # fmt: skip
