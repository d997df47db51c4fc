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

LOOKED_AT = ("mass", "density", "internal_energy", "temperature", "pressure", "damage")
LEFT = 1e-3  # share of a body's mass


@dataclass(frozen=True)
class Holds:
    """Range of validity of a body's material models."""

    # whether states lie outside, of density [kg/m^3], energy [J/kg], and temperature [K], pressure [Pa] and damage or
    # None, each (n,)
    outside: Callable[..., np.ndarray]
    words: str  # the range, in words
    tension: float | None = None  # largest tension of such a material [Pa]; None where its damage model limits tension


@dataclass
class _Seen:
    share: float = 0.0  # of the mass, the most at any moment
    at: float = 0.0
    first: float | None = None
    torn: float = 0.0  # share of the mass under too much tension, the most
    tension: float = 0.0
    place: tuple[float, ...] = ()
    time: float = 0.0


def validity_notes(moments: Iterable[Snapshot], bodies: Sequence[str], holds: Sequence[Holds]) -> dict[str, list[str]]:
    """Return warnings on each body from all moments of a run, at most one of each kind.

    `bodies`, `holds`: names of the bodies, and where their materials hold.
    """
    seen, plain = [_Seen() for _ in bodies], False
    for now in moments:
        plain = now.metadata.get("units") == "none"
        if "internal_energy" not in now.fields:
            continue
        fields = {name: now.fields[name] for name in LOOKED_AT if name in now.fields}  # of a file read once
        for number, (one, limits) in enumerate(zip(seen, holds, strict=True)):
            mine = np.flatnonzero((now.body == number) & (fields["mass"] > 0.0))
            if len(mine):
                _look(one, limits, now, fields, mine)
    return {name: list(_messages(one, limits, plain)) for name, one, limits in zip(bodies, seen, holds, strict=True)}


def _look(seen: _Seen, limits: Holds, now: Snapshot, fields: Mapping[str, np.ndarray], mine: np.ndarray) -> None:
    """Take account of a body's particles `mine` at a moment with the `fields` of `LOOKED_AT`."""
    mass = fields["mass"][mine]
    further = [fields[name][mine] if name in fields else None for name in ("temperature", "pressure", "damage")]
    outside = limits.outside(fields["density"][mine], fields["internal_energy"][mine], *further)
    share = float(mass[outside].sum() / mass.sum())
    if share > LEFT and seen.first is None:
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


def _messages(seen: _Seen, limits: Holds, plain: bool) -> Iterator[str]:
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
    if limits.tension is not None and seen.torn > LEFT:
        unit, factor = ("", 1.0) if plain else axis_unit("mm", seen.place)
        place = ", ".join(f"{factor * value:.3g}" for value in seen.place)
        yield (
            f"tension of up to {format_stress(seen.tension)}, which none of its models limits, at "
            f"({place}){unit and f' {unit}'} and {format_moment(seen.time)} (of the snapshots); such a material "
            f"spalls below {format_stress(limits.tension)}"
        )


REVOLVED = tuple(name for name, one in KINEMATICS.items() if one.axisymmetric)
# Distance over size below which nearest neighbours are clumped, and share of such particles that causes a warning.
CLUMPED, CLUMPS = 0.3, 0.01
# Negative internal energy over the initial energy, and share of detached particles, that cause a warning.
BELOW_ZERO, TORN = 1e-3, 0.01
ALONE = 3.0  # distance over h of the nearest neighbour beyond which a particle is isolated; kernels reach 2 to 3
HELD = 1e-3  # p V of isolated particles over the initial energy that causes a warning
LINK = 2.0  # distance in spacings of connected particles
NEXT = 1.3  # largest distance in spacings of initial nearest neighbours, below the diagonal of a square
SOFT = 0.5  # damage past onset at which three quarters of the fracture energy are absorbed
TORN_CRACK = 0.05  # share of the crack between sound particles that causes a warning
# A fragment of at least this share of the largest one was cut off if the plastic strain of its edge exceeds this value.
PIECE, CUT = 0.25, 0.5


def remarks(
    now: Snapshot,
    start: Snapshot,
    bodies: Sequence[str],
    whole: Sequence[bool],
    spacing: float,
    holds: Sequence[Holds] = (),
    moments: Iterable[Snapshot] = (),
    cracks: Sequence[bool] = (),
) -> list[str]:
    """Return warnings on the final state of a run.

    `whole` says which bodies are solids without a model of damage, `holds` where the material of each body is valid;
    `moments` are earlier states of the run; `cracks` says which bodies have a fracture energy.
    """
    texts = []
    left = validity_notes(chain(moments, [now]), bodies, holds) if holds else {}
    for number, (name, has_no_damage) in enumerate(zip(bodies, whole, strict=True)):
        mine = (now.body == number) & (now.fields["mass"] > 0.0)
        if mine.sum() < 2:
            continue
        texts += [f"{name}: {text}" for text in left.get(name, [])]
        position = now.fields["position"][mine]
        texts += [f"{name}: {text}" for text in _of_body(now, mine, position, spacing)]
        breaks = bool(cracks) and cracks[number]
        if has_no_damage or breaks:
            # by number: particles may have left the domain since
            before = start.fields["position"][np.searchsorted(start.id, now.id[mine])]
        if breaks:
            share, torn = torn_without_damage(position, before, now.fields["damage"][mine], spacing)
            if share > TORN_CRACK and torn > 1:
                texts.append(
                    f"{name}: torn_without_damage {format_share(share)}: this share of the cracks lies between "
                    "particles with little softening, and has absorbed little fracture energy: the lattice "
                    "separated; use a coarser resolution or another formulation"
                )
        if has_no_damage:
            strain = now.fields["plastic_strain"][mine] if "plastic_strain" in now.fields else np.zeros(mine.sum())
            texts += [f"{name}: {text}" for text in _tearing(position, before, strain, spacing)]
    return [*texts, *_energy(now, start), *_isolated_vapour(now, start)]


def _of_body(now: Snapshot, mine: np.ndarray, position: np.ndarray, spacing: float) -> Iterator[str]:
    position = position.reshape(len(position), -1)
    density = now.fields["density"][mine]
    if turned := int((density <= 0.0).sum()):
        yield (f"{turned} of its particles are inverted (negative density): results there have no meaning")
    volume = now.fields["mass"][mine] / np.maximum(np.abs(density), np.finfo(float).tiny)
    if now.metadata.get("kinematics") in REVOLVED:  # the section
        volume = volume / (2.0 * np.pi * np.maximum(np.abs(position[:, 1]), 0.5 * spacing))
    size = volume ** (1.0 / position.shape[1])
    reach = CLUMPED * size
    nearest = scipy.spatial.cKDTree(position).query(position, 2, distance_upper_bound=2.0 * float(reach.max()))[0][:, 1]
    share = float((nearest < reach).mean())
    if share > CLUMPS:
        yield (
            f"{format_share(share)} of its particles have a neighbour within {CLUMPED:g} of their own size: they have "
            "clumped, and the material is not resolved"
        )


def _tearing(position: np.ndarray, before: np.ndarray, strain: np.ndarray, spacing: float) -> Iterator[str]:
    links = scipy.spatial.cKDTree(before.reshape(len(before), -1)).query_pairs(LINK * spacing, output_type="ndarray")
    pieces = connected_groups(position, spacing, LINK)
    sizes = np.bincount(pieces)

    def is_cut(piece: np.ndarray) -> bool:
        """Return whether a fragment was separated by plastic flow, not by numerical fracture in tension."""
        broken = links[piece[links[:, 0]] != piece[links[:, 1]]]
        return len(broken) > 0 and float(np.median(strain[broken])) >= CUT

    large = np.flatnonzero(sizes >= PIECE * sizes[0])
    sound = [piece for piece in large if piece == 0 or is_cut(pieces == piece)]
    share = 1.0 - float(sizes[sound].sum()) / len(position)
    if share > TORN and share > float((connected_groups(before, spacing, LINK) != 0).mean()) + TORN:
        yield (
            f"{format_share(share)} of it has separated without a damage model: separation depends on the particle "
            "lattice; give the material `damage`"
        )


def torn_without_damage(
    position: np.ndarray, before: np.ndarray, damage: np.ndarray, spacing: float
) -> tuple[float, int]:
    """Return the share of the cracks between sound particles [-], and the number of neighbours that it counts.

    Nearest neighbours at the start, at `before` (n, dim) [m], that are now in different pieces are apart across a crack
    if the `damage` (n,) of one of them is above `SOFT`, else across sound material.
    """
    pairs = scipy.spatial.cKDTree(before.reshape(len(before), -1)).query_pairs(NEXT * spacing, output_type="ndarray")
    pieces = connected_groups(position, spacing, LINK)
    apart = pairs[pieces[pairs[:, 0]] != pieces[pairs[:, 1]]]
    torn = int((damage[apart] <= SOFT).all(axis=1).sum())
    return (torn / len(apart) if len(apart) else 0.0), torn


def _at_start(start: Snapshot) -> float:
    """Return the initial energy without signs [J], with that of the weight above and below the centre of mass."""
    squared = (start.fields["velocity"].reshape(start.count, -1) ** 2).sum(axis=1)
    mass = start.fields["mass"]
    energy = float(0.5 * (mass * squared).sum() + np.abs(mass * start.fields["internal_energy"]).sum())
    pull = start.metadata.get("gravity", {}).get("acceleration")
    if pull:
        height = start.fields["position"].reshape(start.count, -1) @ np.array(pull)
        energy += float((mass * np.abs(height - (mass * height).sum() / mass.sum())).sum())
    return energy


def _isolated_vapour(now: Snapshot, start: Snapshot) -> Iterator[str]:
    if not {"internal_energy", "pressure", "smoothing_length"} <= now.fields.keys():
        return
    mass, density, pressure = (now.fields[name] for name in ("mass", "density", "pressure"))
    work = np.where((mass > 0.0) & (density > 0.0), mass * pressure / np.where(density > 0.0, density, 1.0), 0.0)
    pressed, at_start = np.flatnonzero(work > 0.0), _at_start(start)
    if not float(work[pressed].sum()) > HELD * at_start:  # also where it is no number
        return
    position = now.fields["position"].reshape(now.count, -1)
    reach = ALONE * now.fields["smoothing_length"][pressed]
    near = scipy.spatial.cKDTree(position[mass > 0.0]).query(
        position[pressed], 2, distance_upper_bound=float(reach.max())
    )[0][:, 1]
    alone = pressed[near > reach]
    held = float(work[alone].sum())
    if held > HELD * at_start:
        most = float(pressure[alone].max())
        texts = f"{most:.3g}" if now.metadata.get("units") == "none" else f"{1e-9 * most:.3g} GPa"
        share = format_share(float(mass[alone].sum() / mass.sum()))
        yield (
            f"{share} of the mass are isolated particles without neighbours, at up to {texts}: they cannot expand, and "
            f"keep {100 * held / at_start:.2g} % of the initial energy as p/rho; "
            "`smoothing_length: {type: variable}` with a larger `max_over_initial` leaves less"
        )


def _energy(now: Snapshot, start: Snapshot) -> Iterator[str]:
    if "internal_energy" not in now.fields:
        return
    energy, at_start = now.fields["mass"] * now.fields["internal_energy"], _at_start(start)
    below = float(-energy[energy < 0.0].sum())
    if at_start > 0.0 and below > BELOW_ZERO * at_start:
        yield (f"negative internal energies add up to {100 * below / at_start:.2g} % of the initial energy")
