"""Whether the projectile has left all layers behind it: only then is anything residual."""

from __future__ import annotations

from collections.abc import Sequence

from hvisph.measures.target.perforation import NO, NOT_YET, is_behind
from hvisph.measures.target.targets import LayerMeasures

from .measurement_frame import Scene

HALF = 0.5  # share of the mass below which the largest piece does not stand for the projectile


def held_back(scene: Scene, layers: Sequence[LayerMeasures]) -> str:
    """Return why nothing is residual, in words: a layer holds, or the projectile is not through; empty where it is.

    A layer that was open along the projectile's path need not be perforated, but it must be passed.
    """
    if scene.now.dimensions == 1:
        return "in 1D nothing is perforated"
    if not {"velocity", "mass"} <= scene.now.fields.keys():
        return "the snapshot has no velocity or no mass"
    if not layers:
        return "there is no layer"
    for layer, body in zip(layers, scene.layers, strict=True):
        plate = scene.plate(body)
        if plate is None:
            return layer.results["perforated"].reason
        if layer.state in (NO, NOT_YET):
            return f"'{layer.body}' is not perforated{' yet' if layer.state == NOT_YET else ''}"
        if not is_behind(scene, plate):
            return f"half of the projectile's mass is not behind '{layer.body}' yet"
    return ""


def in_pieces(scene: Scene) -> str:
    """Return why the largest piece does not stand for the projectile, in words; empty where it does."""
    mass = scene.now.fields["mass"]
    share = scene.shot_groups.heaviest.mass / (scene.shot_mass or float(mass[scene.is_projectile].sum()))
    return "" if share >= HALF else f"the projectile's largest piece holds {100.0 * share:.2g} % of its mass"
