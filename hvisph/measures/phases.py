"""Melt and vapour after release, by entropy.

    melt      (S - S_im)/(S_cm - S_im)  in [0, 1]        vapour    (S - S_iv)/(S_cv - S_iv)  in [0, 1]

Release is isentropic: the fractions are those at 1 bar once the pressure has gone, whatever it is now. The metadata
contain the five `entropies` of each material, and particles have their `entropy` (`exact.entropy`).
"""

import numpy as np

from hvisph.measures.frame.measurement_frame import Scene

from .result import Outcome, Outcomes, Result, UndefinedMeasureError, measures


def phase_fractions(entropy: np.ndarray, levels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the mass fractions of melt and of vapour, (n,) each.

    `entropy`: specific entropy, (n,) [J/(kg K)].
    `levels`: at rest, and of incipient and complete melting and vaporisation at 1 bar, (n, 5) [J/(kg K)].
    """
    _, solid, liquid, boiling, gas = levels.T
    melt = np.clip((entropy - solid) / (liquid - solid), 0.0, 1.0)
    return melt, np.clip((entropy - boiling) / (gas - boiling), 0.0, 1.0)


@measures("run", "melt", "vapour", needs=("motion",))
def phases(scene: Scene) -> Outcomes:
    """Return the masses of melt and vapour of projectile and layers [kg]."""
    known = scene.now.metadata.get("entropies")
    if not known or "entropy" not in scene.now.fields:
        raise UndefinedMeasureError("no material has `melting: {entropies: ...}`")
    levels = np.array([[np.nan] * 5 if one is None else one for one in known])[scene.now.material]
    fractions = phase_fractions(scene.now.fields["entropy"], levels)
    layers = np.isin(scene.now.body, scene.layers)
    bodies = {"all": scene.is_projectile | layers, "projectile": scene.is_projectile, "target": layers}

    def mass(rows: np.ndarray, fraction: np.ndarray) -> Outcome:
        own = rows & np.isfinite(fraction)
        if not own.any():
            return (
                "its material has no `melting: {entropies: ...}`, or is in a late stage"
                if rows.any()
                else "there is no layer"
            )
        note = "" if own.sum() == rows.sum() else "materials without entropies, or in a late stage, are left out"
        return Result(float((scene.now.fields["mass"][own] * fraction[own]).sum()), note=note)

    return {
        name: {body: mass(rows, fraction) for body, rows in bodies.items()}
        for name, fraction in zip(("melt", "vapour"), fractions, strict=True)
    }
