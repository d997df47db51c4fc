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
    moments: Iterable[Snapshot], bodies: Sequence[str], ranges: Sequence[ValidityRange]
) -> dict[str, list[str]]:
    """Return warnings on each body from all moments of a run, at most one of each kind.

    `bodies`, `ranges`: names of the bodies and ranges of validity of their materials.
    """
    seen, pure = [_Extremes() for _ in bodies], False
    for moment in moments:
        pure = moment.metadata.get("units") == "none"
        if "internal_energy" not in moment.fields:
            continue
        fields = {name: moment.fields[name] for name in FIELDS_READ if name in moment.fields}  # of a file read once
        for number, (e, limits) in enumerate(zip(seen, ranges, strict=True)):
            mine = np.flatnonzero((moment.body == number) & (fields["mass"] > 0.0))
            if len(mine):
                _record_extremes(e, limits, moment, fields, mine)
    return {name: list(_range_warnings(e, limits, pure)) for name, e, limits in zip(bodies, seen, ranges, strict=True)}


def _record_extremes(
    peak: _Extremes, limits: ValidityRange, moment: Snapshot, fields: Mapping[str, np.ndarray], mine: np.ndarray
) -> None:
    """Update the extremes of a body by its particles `mine` at a moment; `fields` are those of `FIELDS_READ`."""
    mass = fields["mass"][mine]
    fields_read = [fields[name][mine] if name in fields else None for name in ("temperature", "pressure", "damage")]
    outside = limits.outside(fields["density"][mine], fields["internal_energy"][mine], *fields_read)
    share = float(mass[outside].sum() / mass.sum())
    if share > LEAST_MASS_SHARE and peak.first is None:
        peak.first = moment.time
    if share > peak.share:
        peak.share, peak.at = share, moment.time
    if limits.tension is None or "pressure" not in fields:
        return
    tension = -np.nan_to_num(fields["pressure"][mine], nan=0.0)  # of a run that failed
    peak.torn = max(peak.torn, float(mass[tension > limits.tension].sum() / mass.sum()))
    highest = int(tension.argmax())
    if tension[highest] > peak.tension:
        peak.tension, peak.time = float(tension[highest]), moment.time
        peak.place = tuple(float(x) for x in np.atleast_1d(moment.fields["position"][mine[highest]]))


def _range_warnings(peak: _Extremes, limits: ValidityRange, unitless: bool) -> Iterator[str]:
    def format_stress(value: float) -> str:
        return f"{value:.3g}" if unitless else f"{1e-9 * value:.3g} GPa"

    def format_moment(time: float) -> str:
        return f"{time:.3g}" if unitless else format_time(time, ".3g")

    if peak.first is not None:
        first_words = "" if peak.at == peak.first else f", first at {format_moment(peak.first)}"
        yield (
            f"{format_share(peak.share)} of its mass has left the range of its material at {format_moment(peak.at)}"
            f"{first_words} ({limits.words}): later results extrapolate its models"
        )
    if limits.tension is not None and peak.torn > LEAST_MASS_SHARE:
        unit, factor = ("", 1.0) if unitless else axis_unit("mm", peak.place)
        place = ", ".join(f"{factor * value:.3g}" for value in peak.place)
        yield (
            f"tension of up to {format_stress(peak.tension)}, which none of its models limits, at "
            f"({place}){unit and f' {unit}'} and {format_moment(peak.time)} (of the snapshots); such a material "
            f"spalls below {format_stress(limits.tension)}"
        )


AXISYMMETRIC = tuple(name for name, kinematics in KINEMATICS.items() if kinematics.axisymmetric)
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
    final: Snapshot,
    start: Snapshot,
    bodies: Sequence[str],
    sound: Sequence[bool],
    spacing: float,
    ranges: Sequence[ValidityRange] = (),
    moments: Iterable[Snapshot] = (),
    cracks: Sequence[bool] = (),
) -> list[str]:
    """Return warnings on the final state of a run.

    `sound`: which bodies are solids without a damage model; `ranges`: range of validity of each body's material;
    `moments`: earlier states of the run; `cracks`: which bodies have a fracture energy.
    """
    texts = []
    notes = validity_notes(chain(moments, [final]), bodies, ranges) if ranges else {}
    for number, (name, has_no_damage) in enumerate(zip(bodies, sound, strict=True)):
        mine = (final.body == number) & (final.fields["mass"] > 0.0)
        if mine.sum() < 2:
            continue
        texts += [f"{name}: {text}" for text in notes.get(name, [])]
        position = final.fields["position"][mine]
        texts += [f"{name}: {text}" for text in _particle_warnings(final, mine, position, spacing)]
        breaks = bool(cracks) and cracks[number]
        if has_no_damage or breaks:
            # by number: particles may have left the domain since
            before = start.fields["position"][np.searchsorted(start.id, final.id[mine])]
        if breaks:
            share, torn = undamaged_crack_share(position, before, final.fields["damage"][mine], spacing)
            if share > UNDAMAGED_CRACK_SHARE and torn > 1:
                texts.append(
                    f"{name}: torn_without_damage {format_share(share)}: this share of the cracks lies between "
                    "particles with little softening and has absorbed little fracture energy: the particle lattice "
                    "has separated; use a coarser resolution or another formulation"
                )
        if has_no_damage:
            strain = final.fields["plastic_strain"][mine] if "plastic_strain" in final.fields else np.zeros(mine.sum())
            texts += [f"{name}: {text}" for text in _fracture_warnings(position, before, strain, spacing)]
    if final.count < start.count:
        lost = 1.0 - float(final.fields["mass"].sum() / start.fields["mass"].sum())
        texts.append(f"{format_share(lost)} of the mass has left the `domain`: measures do not contain it")
    return [*texts, *_energy_warnings(final, start), *_isolation_warnings(final, start)]


def _particle_warnings(final: Snapshot, mine: np.ndarray, position: np.ndarray, spacing: float) -> Iterator[str]:
    position = position.reshape(len(position), -1)
    density = final.fields["density"][mine]
    if inverted := int((density <= 0.0).sum()):
        yield (f"{inverted} of its particles are inverted (negative density): results there have no meaning")
    volume = final.fields["mass"][mine] / np.maximum(np.abs(density), np.finfo(float).tiny)
    if final.metadata.get("kinematics") in AXISYMMETRIC:  # the section
        volume = volume / (2.0 * np.pi * np.maximum(np.abs(position[:, 1]), 0.5 * spacing))
    size = volume ** (1.0 / position.shape[1])
    reach = CLUMP_DISTANCE * size
    nearest = scipy.spatial.cKDTree(position).query(position, 2, distance_upper_bound=2.0 * float(reach.max()))[0][:, 1]
    share = float((nearest < reach).mean())
    if share > CLUMPED_SHARE:
        words = f"have a neighbour within {CLUMP_DISTANCE:g} of their own size: they have clumped,"
        yield f"{format_share(share)} of its particles {words} and the material is not resolved"


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
    separated = pairs[pieces[pairs[:, 0]] != pieces[pairs[:, 1]]]
    torn = int((damage[separated] <= LARGE_DAMAGE).all(axis=1).sum())
    return (torn / len(separated) if len(separated) else 0.0), torn


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


def _isolation_warnings(final: Snapshot, start: Snapshot) -> Iterator[str]:
    if not {"internal_energy", "pressure", "smoothing_length"} <= final.fields.keys():
        return
    mass, density, pressure = (final.fields[name] for name in ("mass", "density", "pressure"))
    work = np.where((mass > 0.0) & (density > 0.0), mass * pressure / np.where(density > 0.0, density, 1.0), 0.0)
    pressed, at_start = np.flatnonzero(work > 0.0), _initial_energy(start)
    if not float(work[pressed].sum()) > ISOLATED_WORK_SHARE * at_start:  # also where it is no number
        return
    position = final.fields["position"].reshape(final.count, -1)
    reach = ISOLATION_DISTANCE * final.fields["smoothing_length"][pressed]
    tree = scipy.spatial.cKDTree(position[mass > 0.0])
    distance = tree.query(position[pressed], 2, distance_upper_bound=float(reach.max()))[0][:, 1]
    isolated = pressed[distance > reach]
    work_held = float(work[isolated].sum())
    if work_held > ISOLATED_WORK_SHARE * at_start:
        highest = float(pressure[isolated].max())
        texts = f"{highest:.3g}" if final.metadata.get("units") == "none" else f"{1e-9 * highest:.3g} GPa"
        share = format_share(float(mass[isolated].sum() / mass.sum()))
        words = f"isolated particles without neighbours, at up to {texts}: they cannot expand, and keep"
        kept = f"{100 * work_held / at_start:.2g} % of the initial energy as p/rho;"
        less = "`smoothing_length: {type: variable}` with a larger `max_over_initial` leaves less"
        yield f"{share} of the mass are {words} {kept} {less}"


def _energy_warnings(final: Snapshot, start: Snapshot) -> Iterator[str]:
    if "internal_energy" not in final.fields:
        return
    energy, at_start = final.fields["mass"] * final.fields["internal_energy"], _initial_energy(start)
    below = float(-energy[energy < 0.0].sum())
    if at_start > 0.0 and below > NEGATIVE_ENERGY_SHARE * at_start:
        yield (f"negative internal energies add up to {100 * below / at_start:.2g} % of the initial energy")
