"""Warnings on the reliability of a finished run: range of material models, unlimited tension, fracture, vapour."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np
import scipy

from hvisph.core.catalogues import KINEMATICS
from hvisph.core.measure_catalogue import axis_unit, format_share, format_time
from hvisph.measures.fragments import connected_groups
from hvisph.output.snapshot import Snapshot

FIELDS_READ = ("mass", "density", "internal_energy", "temperature", "pressure", "damage")
LEAST_MASS_SHARE = 1e-3  # of a body's mass, from which on a warning is given


@dataclass(frozen=True)
class ValidityRange:
    """Range of validity of a body's material models."""

    # function that returns which states are outside (n,), from density [kg/m^3], energy [J/kg], and temperature [K],
    # pressure [Pa] and damage or None, each (n,)
    outside: Callable[..., np.ndarray]
    words: str  # the range, in words
    tension: float | None = None  # largest tension of such a material [Pa]; None where its damage model limits tension


@dataclass
class _Extremes:
    share: float = 0.0  # of the mass, the most at any moment
    at: float = 0.0
    first: float | None = None
    torn: float = 0.0  # share of the mass under too much tension, the most
    tension: float = 0.0
    place: tuple[float, ...] = ()
    time: float = 0.0


def validity_notes(
    moments: Iterable[Snapshot], bodies: Sequence[str], holds: Sequence[ValidityRange]
) -> dict[str, list[str]]:
    """Return warnings on each body from all moments of a run, at most one of each kind.

    `bodies`, `holds`: names of the bodies and ranges of validity of their materials.
    """
    seen, plain = [_Extremes() for _ in bodies], False
    for now in moments:
        plain = now.metadata.get("units") == "none"
        if "internal_energy" not in now.fields:
            continue
        fields = {name: now.fields[name] for name in FIELDS_READ if name in now.fields}  # of a file read once
        for number, (one, limits) in enumerate(zip(seen, holds, strict=True)):
            mine = np.flatnonzero((now.body == number) & (fields["mass"] > 0.0))
            if len(mine):
                _record_extremes(one, limits, now, fields, mine)
    return {
        name: list(_range_warnings(one, limits, plain)) for name, one, limits in zip(bodies, seen, holds, strict=True)
    }


def _record_extremes(
    seen: _Extremes, limits: ValidityRange, now: Snapshot, fields: Mapping[str, np.ndarray], mine: np.ndarray
) -> None:
    """Update the extremes of a body by its particles `mine` at a moment; `fields` are those of `FIELDS_READ`."""
    mass = fields["mass"][mine]
    further = [fields[name][mine] if name in fields else None for name in ("temperature", "pressure", "damage")]
    outside = limits.outside(fields["density"][mine], fields["internal_energy"][mine], *further)
    share = float(mass[outside].sum() / mass.sum())
    if share > LEAST_MASS_SHARE and seen.first is None:
        seen.first = now.time
    if share > seen.share:
        seen.share, seen.at = share, now.time
    if limits.tension is None or "pressure" not in fields:
        return
    tension = -np.nan_to_num(fields["pressure"][mine], nan=0.0)  # of a run that failed
    seen.torn = max(seen.torn, float(mass[tension > limits.tension].sum() / mass.sum()))
    most = int(tension.argmax())
    if tension[most] > seen.tension:
        seen.tension, seen.time = float(tension[most]), now.time
        seen.place = tuple(float(x) for x in np.atleast_1d(now.fields["position"][mine[most]]))


def _range_warnings(seen: _Extremes, limits: ValidityRange, plain: bool) -> Iterator[str]:
    def format_stress(value: float) -> str:
        return f"{value:.3g}" if plain else f"{1e-9 * value:.3g} GPa"

    def format_moment(time: float) -> str:
        return f"{time:.3g}" if plain else format_time(time, ".3g")

    if seen.first is not None:
        most = "" if seen.at == seen.first else f", first at {format_moment(seen.first)}"
        yield (
            f"{format_share(seen.share)} of its mass has left the range of its material at {format_moment(seen.at)}"
            f"{most} ({limits.words}): later results extrapolate its models"
        )
    if limits.tension is not None and seen.torn > LEAST_MASS_SHARE:
        unit, factor = ("", 1.0) if plain else axis_unit("mm", seen.place)
        place = ", ".join(f"{factor * value:.3g}" for value in seen.place)
        yield (
            f"tension of up to {format_stress(seen.tension)}, which none of its models limits, at "
            f"({place}){unit and f' {unit}'} and {format_moment(seen.time)} (of the snapshots); such a material "
            f"spalls below {format_stress(limits.tension)}"
        )


AXISYMMETRIC = tuple(name for name, one in KINEMATICS.items() if one.axisymmetric)
# Distance over size below which nearest neighbours are clumped, and share of such particles that causes a warning.
CLUMP_DISTANCE, CLUMPED_SHARE = 0.3, 0.01
# Negative internal energy over the initial energy, and share of detached particles, that cause a warning.
NEGATIVE_ENERGY_SHARE, SEPARATED_SHARE = 1e-3, 0.01
ISOLATION_DISTANCE = (
    3.0  # distance over h of the nearest neighbour beyond which a particle is isolated; kernels reach 2 to 3
)
ISOLATED_WORK_SHARE = 1e-3  # p V of isolated particles over the initial energy that causes a warning
LINK_DISTANCE = 2.0  # distance in spacings of connected particles
NEIGHBOUR_DISTANCE = 1.3  # largest distance in spacings of initial nearest neighbours, below the diagonal of a square
LARGE_DAMAGE = 0.5  # damage past onset at which three quarters of the fracture energy are absorbed
UNDAMAGED_CRACK_SHARE = 0.05  # share of the crack between sound particles that causes a warning
# A fragment of at least this share of the largest one was cut off if the plastic strain of its edge exceeds this value.
LARGE_FRAGMENT, CUT_STRAIN = 0.25, 0.5


def final_warnings(
    now: Snapshot,
    start: Snapshot,
    bodies: Sequence[str],
    whole: Sequence[bool],
    spacing: float,
    holds: Sequence[ValidityRange] = (),
    moments: Iterable[Snapshot] = (),
    cracks: Sequence[bool] = (),
) -> list[str]:
    """Return warnings on the final state of a run.

    `whole`: which bodies are solids without a damage model; `holds`: range of validity of each body's material;
    `moments`: earlier states of the run; `cracks`: which bodies have a fracture energy.
    """
    texts = []
    left = validity_notes(chain(moments, [now]), bodies, holds) if holds else {}
    for number, (name, has_no_damage) in enumerate(zip(bodies, whole, strict=True)):
        mine = (now.body == number) & (now.fields["mass"] > 0.0)
        if mine.sum() < 2:
            continue
        texts += [f"{name}: {text}" for text in left.get(name, [])]
        position = now.fields["position"][mine]
        texts += [f"{name}: {text}" for text in _particle_warnings(now, mine, position, spacing)]
        breaks = bool(cracks) and cracks[number]
        if has_no_damage or breaks:
            # by number: particles may have left the domain since
            before = start.fields["position"][np.searchsorted(start.id, now.id[mine])]
        if breaks:
            share, torn = undamaged_crack_share(position, before, now.fields["damage"][mine], spacing)
            if share > UNDAMAGED_CRACK_SHARE and torn > 1:
                texts.append(
                    f"{name}: torn_without_damage {format_share(share)}: this share of the cracks lies between "
                    "particles with little softening and has absorbed little fracture energy: the particle lattice "
                    "has separated; use a coarser resolution or another formulation"
                )
        if has_no_damage:
            strain = now.fields["plastic_strain"][mine] if "plastic_strain" in now.fields else np.zeros(mine.sum())
            texts += [f"{name}: {text}" for text in _fracture_warnings(position, before, strain, spacing)]
    return [*texts, *_energy_warnings(now, start), *_isolation_warnings(now, start)]


def _particle_warnings(now: Snapshot, mine: np.ndarray, position: np.ndarray, spacing: float) -> Iterator[str]:
    position = position.reshape(len(position), -1)
    density = now.fields["density"][mine]
    if turned := int((density <= 0.0).sum()):
        yield (f"{turned} of its particles are inverted (negative density): results there have no meaning")
    volume = now.fields["mass"][mine] / np.maximum(np.abs(density), np.finfo(float).tiny)
    if now.metadata.get("kinematics") in AXISYMMETRIC:  # the section
        volume = volume / (2.0 * np.pi * np.maximum(np.abs(position[:, 1]), 0.5 * spacing))
    size = volume ** (1.0 / position.shape[1])
    reach = CLUMP_DISTANCE * size
    nearest = scipy.spatial.cKDTree(position).query(position, 2, distance_upper_bound=2.0 * float(reach.max()))[0][:, 1]
    share = float((nearest < reach).mean())
    if share > CLUMPED_SHARE:
        yield (
            f"{format_share(share)} of its particles have a neighbour within {CLUMP_DISTANCE:g} of their own size: "
            "they have clumped, and the material is not resolved"
        )


def _fracture_warnings(position: np.ndarray, before: np.ndarray, strain: np.ndarray, spacing: float) -> Iterator[str]:
    links = scipy.spatial.cKDTree(before.reshape(len(before), -1)).query_pairs(
        LINK_DISTANCE * spacing, output_type="ndarray"
    )
    pieces = connected_groups(position, spacing, LINK_DISTANCE)
    sizes = np.bincount(pieces)

    def is_cut(piece: np.ndarray) -> bool:
        """Return whether a fragment was separated by plastic flow, not by numerical fracture in tension."""
        broken = links[piece[links[:, 0]] != piece[links[:, 1]]]
        return len(broken) > 0 and float(np.median(strain[broken])) >= CUT_STRAIN

    large = np.flatnonzero(sizes >= LARGE_FRAGMENT * sizes[0])
    sound = [piece for piece in large if piece == 0 or is_cut(pieces == piece)]
    share = 1.0 - float(sizes[sound].sum()) / len(position)
    if (
        share > SEPARATED_SHARE
        and share > float((connected_groups(before, spacing, LINK_DISTANCE) != 0).mean()) + SEPARATED_SHARE
    ):
        yield (
            f"{format_share(share)} of it has separated without a damage model: separation depends on the particle "
            "lattice; give the material `damage`"
        )


def undamaged_crack_share(
    position: np.ndarray, before: np.ndarray, damage: np.ndarray, spacing: float
) -> tuple[float, int]:
    """Return the share of cracks through undamaged material [-], and the number of pairs separated by these.

    Pairs are nearest neighbours at the start, at `before` (n, dim) [m], that are now in different fragments. They are
    separated by damage if the `damage` (n,) of one of them is above `LARGE_DAMAGE`, otherwise without damage.
    """
    pairs = scipy.spatial.cKDTree(before.reshape(len(before), -1)).query_pairs(
        NEIGHBOUR_DISTANCE * spacing, output_type="ndarray"
    )
    pieces = connected_groups(position, spacing, LINK_DISTANCE)
    apart = pairs[pieces[pairs[:, 0]] != pieces[pairs[:, 1]]]
    torn = int((damage[apart] <= LARGE_DAMAGE).all(axis=1).sum())
    return (torn / len(apart) if len(apart) else 0.0), torn


def _initial_energy(start: Snapshot) -> float:
    """Return the sum of absolute initial energies [J], potential energies relative to the centre of mass included."""
    squared = (start.fields["velocity"].reshape(start.count, -1) ** 2).sum(axis=1)
    mass = start.fields["mass"]
    energy = float(0.5 * (mass * squared).sum() + np.abs(mass * start.fields["internal_energy"]).sum())
    pull = start.metadata.get("gravity", {}).get("acceleration")
    if pull:
        height = start.fields["position"].reshape(start.count, -1) @ np.array(pull)
        energy += float((mass * np.abs(height - (mass * height).sum() / mass.sum())).sum())
    return energy


def _isolation_warnings(now: Snapshot, start: Snapshot) -> Iterator[str]:
    if not {"internal_energy", "pressure", "smoothing_length"} <= now.fields.keys():
        return
    mass, density, pressure = (now.fields[name] for name in ("mass", "density", "pressure"))
    work = np.where((mass > 0.0) & (density > 0.0), mass * pressure / np.where(density > 0.0, density, 1.0), 0.0)
    pressed, at_start = np.flatnonzero(work > 0.0), _initial_energy(start)
    if not float(work[pressed].sum()) > ISOLATED_WORK_SHARE * at_start:  # also where it is no number
        return
    position = now.fields["position"].reshape(now.count, -1)
    reach = ISOLATION_DISTANCE * now.fields["smoothing_length"][pressed]
    near = scipy.spatial.cKDTree(position[mass > 0.0]).query(
        position[pressed], 2, distance_upper_bound=float(reach.max())
    )[0][:, 1]
    alone = pressed[near > reach]
    held = float(work[alone].sum())
    if held > ISOLATED_WORK_SHARE * at_start:
        most = float(pressure[alone].max())
        texts = f"{most:.3g}" if now.metadata.get("units") == "none" else f"{1e-9 * most:.3g} GPa"
        share = format_share(float(mass[alone].sum() / mass.sum()))
        yield (
            f"{share} of the mass are isolated particles without neighbours, at up to {texts}: they cannot expand, and "
            f"keep {100 * held / at_start:.2g} % of the initial energy as p/rho; "
            "`smoothing_length: {type: variable}` with a larger `max_over_initial` leaves less"
        )


def _energy_warnings(now: Snapshot, start: Snapshot) -> Iterator[str]:
    if "internal_energy" not in now.fields:
        return
    energy, at_start = now.fields["mass"] * now.fields["internal_energy"], _initial_energy(start)
    below = float(-energy[energy < 0.0].sum())
    if at_start > 0.0 and below > NEGATIVE_ENERGY_SHARE * at_start:
        yield (f"negative internal energies add up to {100 * below / at_start:.2g} % of the initial energy")
