"""Residual projectile: velocity, mass, length and direction of its fragments, momentum transfer."""

import numpy as np

from hvisph.output.snapshot import Snapshot

from .debris import gravity_towards_layer
from .impact_geometry import LAYER, PROJECTILE, members
from .lengths import initial_length, length_of
from .measurement_frame import Scene
from .perforation import NO, NOT_YET, is_behind, layer_state
from .result import RELATIVE_ERRORS, Outcomes, Result, UndefinedMeasureError, measures, refuse_if

LEAST_SHARE = 0.5  # least mass fraction of the heaviest fragment for it to represent the projectile


def retention_reason(scene: Scene) -> str:
    """Return why there is no residual projectile: a layer is not perforated or not passed; empty if it is behind all.

    A layer that was open along the projectile's path need not be perforated, but it must be passed.
    """
    if scene.state.dimensions == 1:
        return "in 1D nothing is perforated"
    if not scene.has_motion:
        return "the snapshot has no velocity or no mass"
    if not scene.layers:
        return "there is no layer"
    for body in scene.layers:
        plate, state_of_layer = scene.plate(body), layer_state(scene, body)
        if plate is None:
            return state_of_layer.reason
        if state_of_layer.state in (NO, NOT_YET):
            return f"'{scene.name(body)}' is not perforated{' yet' if state_of_layer.state == NOT_YET else ''}"
        if not is_behind(scene, plate):
            return f"half of the projectile's mass is not behind '{scene.name(body)}' yet"
    return ""


def fragmentation_reason(scene: Scene) -> str:
    """Return why the heaviest fragment does not represent the projectile; empty where it does."""
    share = scene.shot_groups.heaviest.mass / scene.shot_mass
    return "" if share >= LEAST_SHARE else f"the projectile's heaviest fragment holds {100.0 * share:.2g} % of its mass"


LARGE_FRAGMENT_SHARE = 0.01  # mass fraction of the projectile above which a fragment is large


@measures("run", "residual_velocity")
def residual_velocity(scene: Scene) -> Outcomes:
    """Return mass-mean axial velocities of the projectile behind all layers [m/s].

    The main body and the heaviest fragment represent the projectile if they have half of its mass or more. The
    scatter is the standard error of the mean over the particles.
    """
    refuse_if(reason := retention_reason(scene), reason)
    broken = fragmentation_reason(scene)
    return {
        "main_body": broken or _mean(scene, scene.projectile),
        "heaviest": broken or _mean(scene, scene.shot_groups.heaviest.particles),
        "large_fragments": _mean(scene, _large_fragments(scene)),
        "all": _mean(scene, np.flatnonzero(scene.is_projectile)),
    }


@measures("run", "momentum_transfer", needs=("layer", "start", "motion"))
def momentum_transfer(scene: Scene) -> Result:
    """Return the layers' change of axial momentum, less the outer part, over the projectile's at the start."""
    assert scene.start is not None
    initial_momentum = _momentum(scene, scene.start, PROJECTILE)
    before = _momentum(scene, scene.start, LAYER)
    scale = float(np.abs(scene.start.fields["mass"] * _axial(scene.start)).sum())
    if not abs(initial_momentum) > 1e-12 * scale:  # round-off of a symmetric collision
        raise UndefinedMeasureError("the projectile had no axial momentum at the start")
    outer = outer_momentum(scene, np.eye(scene.state.dimensions)[0])
    ratio = (_momentum(scene, scene.state, LAYER) - before - outer) / initial_momentum
    return Result(ratio, discretization=RELATIVE_ERRORS["N s"] * scene.relative_spacing * abs(ratio))


def outer_momentum(scene: Scene, normal: np.ndarray) -> float:
    """Return the momentum along `normal` that gravity, edges and supports at rest gave to the layers [N s]."""
    if scene.start is None or not scene.state.metadata.get("outer_forces"):
        return 0.0
    pair = scene.start, scene.state
    (before, u), (now, v) = ((one.fields["mass"], one.fields["velocity"] @ normal) for one in pair)
    change, lost = float(now @ v - before @ u), abs(now.sum() - before.sum()) > 1e-9 * before.sum()  # retired mass
    fall = gravity_towards_layer(scene, normal) * (scene.state.time - scene.start.time)  # of the projectile
    change -= fall * float(scene.state.fields["mass"][~np.isin(scene.state.body, scene.layers)].sum())
    return 0.0 if lost or abs(change) <= 1e-9 * float(before @ np.abs(u)) else change


def _large_fragments(scene: Scene) -> np.ndarray:
    """Return the particles of all large fragments; of the heaviest one where none is large."""
    groups = scene.shot_groups
    large = groups.masses >= LARGE_FRAGMENT_SHARE * scene.shot_mass
    return groups.groups.particles_of(large) if large.any() else groups.heaviest.particles


def _mean(scene: Scene, rows: np.ndarray) -> Result:
    velocity = _axial(scene.state)[rows]
    mean = float(np.average(velocity, weights=scene.state.fields["mass"][rows]))
    return Result(mean, scatter=float(velocity.std() / np.sqrt(len(rows))))


def _axial(snapshot: Snapshot) -> np.ndarray:
    return snapshot.fields["velocity"].reshape(snapshot.count, -1)[:, 0]


def _momentum(scene: Scene, snapshot: Snapshot, role: str) -> float:
    rows = members(snapshot, scene.shot.roles, role)
    return float((snapshot.fields["mass"][rows] * _axial(snapshot)[rows]).sum())


@measures("projectile", "residual_mass", needs=("motion",))
def residual_mass(scene: Scene) -> float:
    """Return the mass of all large fragments behind all layers [kg]; of the heaviest one where none is large."""
    refuse_if(reason := retention_reason(scene), reason)
    return float(scene.state.fields["mass"][_large_fragments(scene)].sum())


@measures("projectile", "residual_angle", needs=("motion",))
def residual_angle(scene: Scene) -> float:
    """Return the angle between the heaviest fragment's velocity and the shot line [rad]."""
    refuse_if(reason := retention_reason(scene) or fragmentation_reason(scene), reason)
    main = scene.shot_groups.heaviest
    lateral = float(np.sqrt((main.velocity[1:] ** 2).sum()))
    return float(np.arctan2(lateral, main.velocity[0])) if lateral > 1e-9 * main.speed else 0.0


@measures("projectile", "fragment_mass_fraction", needs=("motion",))
def fragment_mass_fraction(scene: Scene) -> Outcomes:
    """Return the mass fractions of the heaviest fragment and of all large ones."""
    masses, total = scene.shot_groups.masses, scene.shot_mass
    large = np.flatnonzero(masses >= LARGE_FRAGMENT_SHARE * total)
    return {"heaviest": scene.shot_groups.heaviest.mass / total, "large_fragments": sum(masses[large].tolist()) / total}


@measures("projectile", "projectile_length", "eroded_length", "residual_length", needs=("motion",))
def lengths(scene: Scene) -> Outcomes:
    """Return length of the heaviest fragment, lost length of the projectile, and residual length [m]."""
    refuse_if(reason := fragmentation_reason(scene), reason)
    length = length_of(scene, scene.position[scene.shot_groups.heaviest.particles, 0])
    no_start = "a single snapshot does not contain the initial length"
    return {
        "projectile_length": length,
        "eroded_length": no_start if scene.start is None else initial_length(scene) - length,
        "residual_length": retention_reason(scene) or length,
    }


@measures("projectile", "penetration_depth", needs=("motion",))
def penetration_depth(scene: Scene) -> float:
    """Return the depth of the heaviest fragment's tip below the first layer's struck face, along its normal [m]."""
    refuse_if(not scene.shot.plates, "there is no layer whose initial state is known")
    depth = scene.shot.plates[0].depth(scene.position[scene.shot_groups.heaviest.particles])
    return float(depth.max() + 0.5 * scene.spacing)
