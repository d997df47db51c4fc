"""What a layer has received: impulse, and how wide and how hard it was struck.

The impulse is the change of momentum of the layer's own matter along its normal. Matter of the projectile and of
earlier layers has arrived where it is less than two spacings before the struck face, or behind it.
"""

from __future__ import annotations

import numpy as np

from hvisph.measures.frame.measurement_frame import Scene
from hvisph.measures.frame.roles import PROJECTILE
from hvisph.measures.frame.target_geometry import Plate
from hvisph.measures.result import MOMENTUM_UNITS, Result, meaningless
from hvisph.measures.statistics import weighted_quantile

NEAR = 2.0  # [dx] before the struck face
MOST = 0.9  # share of what has arrived that counts for the width
LEAST = 1e-4  # share of the shot's mass that must have arrived


def arrived(scene: Scene, plate: Plate) -> np.ndarray:
    """Return the indices of the particles of what flies at a layer that have reached it."""
    before = scene.layers[: scene.layers.index(plate.body)]
    flying = [body for body, role in enumerate(scene.shot.roles) if role == PROJECTILE or body in before]
    reach = plate.depth(scene.position) > -NEAR * scene.spacing
    return np.flatnonzero(np.isin(scene.now.body, flying) & reach)


def is_struck(scene: Scene, plate: Plate) -> bool:
    """Whether enough of what flies at a layer has reached it."""
    mass = scene.now.fields["mass"]
    return bool(mass[arrived(scene, plate)].sum() > LEAST * (scene.shot_mass or mass[scene.is_projectile].sum()))


def loads(scene: Scene, plate: Plate) -> dict[str, Result]:
    """Return the impulse on a layer and the width over which it was struck."""
    unit = MOMENTUM_UNITS[scene.space]
    unknown = "a single snapshot does not tell the momentum at the start"
    results = {"impulse": meaningless(unit, unknown), "mean_pressure": meaningless("Pa", "see struck_diameter")}
    if scene.start is not None:
        taken = _momentum(scene, plate, at_start=False) - _momentum(scene, plate, at_start=True)
        results["impulse"] = Result(taken, unit)
    if not is_struck(scene, plate):
        reason = "nothing has reached the layer"
        return results | {name: meaningless(_unit(name), reason) for name in ("struck_diameter", "mean_pressure")}
    rows = arrived(scene, plate)
    across = np.sqrt((plate.across(scene.position[rows]) ** 2).sum(axis=1))
    width = 2.0 * weighted_quantile(across, scene.now.fields["mass"][rows], MOST) + scene.spacing
    results["struck_diameter"] = Result(width, "m", scene.spacing, spacing=scene.spacing, support=scene.support)
    return results | {"mean_pressure": meaningless("Pa", "a single moment does not tell since when")}


def mean_pressure(impulse: Result, width: Result, lasted: float, unit: str) -> Result:
    """Return the pressure [Pa] that, over the width struck and the time since the first arrival, gives the impulse."""
    if impulse.value is None or width.value is None or not lasted > 0.0:
        return meaningless("Pa", impulse.reason or width.reason or "nothing has reached the layer")
    area = 0.25 * np.pi * width.value**2 if unit == MOMENTUM_UNITS[3] else width.value
    return Result(float(impulse.value / (area * lasted)), "Pa")


def _momentum(scene: Scene, plate: Plate, at_start: bool) -> float:
    snapshot = scene.start if at_start else scene.now
    assert snapshot is not None
    own = snapshot.body == plate.body
    along = snapshot.fields["velocity"][own] @ np.array(plate.basis[0])
    return float((snapshot.fields["mass"][own] * along).sum())


def _unit(name: str) -> str:
    return "m" if name == "struck_diameter" else "Pa"
