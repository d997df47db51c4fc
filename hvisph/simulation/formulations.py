"""From the case's formulation to the published scheme with its numbers."""

from __future__ import annotations

from typing import Any

from hvisph.formulations.eulerian import Eulerian
from hvisph.formulations.formulation import Formulation, Smoothing
from hvisph.formulations.riemann import Riemann
from hvisph.sph.kernels import KERNELS


def formulation_of(model: Any) -> Formulation:
    """Return the scheme that a case's `model` (of `hvisph.case.formulation`) describes."""
    length = model.smoothing_length
    shared: dict[str, Any] = {
        "kernel": KERNELS[model.kernel],
        "h_over_dx": model.h_over_dx,
        "smoothing": Smoothing(True, length.min_over_initial, length.max_over_initial)
        if length.type == "variable"
        else Smoothing(),
    }
    match model.type:
        case "eulerian":
            viscous = model.viscosity.type == "monaghan"
            return Eulerian(
                **shared,
                alpha=model.viscosity.alpha if viscous else 0.0,
                beta=model.viscosity.beta if viscous else 0.0,
                stress_eps=model.artificial_stress.eps if model.artificial_stress.type == "gray" else 0.0,
            )
        case "riemann":
            return Riemann(**shared, reconstruction=model.reconstruction)
    raise ValueError(model.type)
