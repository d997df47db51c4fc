"""Frames of a run for the browser: positions in 16 bits, fields in 8, compressed.

A particle keeps its place in all frames. One that is not there in a frame has the position NOWHERE.
"""

import base64
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hvisph.core.measure_catalogue import axis_unit
from hvisph.core.text import Plain
from hvisph.measures.impact_geometry import spacing_of
from hvisph.output.reader import read_snapshot
from hvisph.output.snapshot import Snapshot
from hvisph.visualization.html.charts import COLOURS
from hvisph.visualization.style import appearance, body_colour, field_of, field_range

MOST_PARTICLES = 20_000
MOST_POINTS = 400_000  # particles times frames
MOST_FRAMES = 60
NOWHERE = 65535
STEPS = 65534  # of a coordinate
FIELDS = ("velocity", "pressure", "plastic_strain", "damage", "temperature", "internal_energy", "von_mises_stress")
MOST_FIELDS = 6
OUTSIDE = (0.5, 99.5)  # percentiles of the coordinates of all moments, between which one looks
MARGIN = 0.15  # beyond them, of what lies between


@dataclass(frozen=True)
class Frames:
    """Frames of a run."""

    content: Plain  # plain values for JSON: header and packed arrays
    remarks: tuple[str, ...]  # omissions, in words


def frames(paths: Sequence[Path], planes: Sequence[int] = ()) -> Frames:
    """Return the moments of a run, thinned to a page; `planes`: axes whose coordinate plane is a mirror."""
    places = np.unique(np.linspace(0, len(paths) - 1, min(len(paths), MOST_FRAMES)).round().astype(int))
    files = [paths[k] for k in places]  # evenly, first and last among them
    first, last = read_snapshot(files[0]), read_snapshot(files[-1])
    ids = np.union1d(first.id, last.id)
    most_particles = max(min(MOST_PARTICLES, MOST_POINTS // len(files)), 1)
    remarks = []
    if len(files) < len(paths):
        remarks.append(f"{len(files)} of {len(paths)} snapshots are shown")
    used = ids
    if len(ids) > most_particles:
        # a constant share everywhere: numbers follow the bodies' rows, so equal steps are spread over space
        used = ids[np.unique(np.linspace(0, len(ids) - 1, most_particles).astype(int))]
        remarks.append(f"{len(used)} of {len(ids)} particles are shown")
    moments = [read_snapshot(path) for path in files]
    names = [name for name in FIELDS if all(name in moment.fields for moment in moments)]
    names = [name for name in names if any(np.any(moment.fields[name]) for moment in moments)][:MOST_FIELDS]
    dim = first.dimensions
    positions = np.stack([_align_values(moment, moment.fields["position"], used) for moment in moments])
    low, high = _box(positions)
    view = _view(positions)
    parts = []
    for axis in range(dim):
        steps = np.rint((positions[..., axis] - low[axis]) / (high[axis] - low[axis]) * STEPS)
        number = np.where(np.isfinite(steps), np.clip(steps, 0, STEPS), NOWHERE).astype(np.uint16)
        parts += [part.astype(np.uint8).tobytes() for part in (number >> 8, number & 255)]  # high bytes compress well
    headers = []
    for name in names:
        label, factor, colours, symmetric = appearance(first, name)
        values = [field_of(moment, name) * factor for moment in moments]
        ends = field_range(np.concatenate(values), symmetric)
        aligned = np.stack([_align_values(moment, value, used) for moment, value in zip(moments, values, strict=True)])
        scaled = np.rint((aligned - ends[0]) / (ends[1] - ends[0]) * (COLOURS - 1))
        parts.append(np.clip(np.nan_to_num(scaled), 0, COLOURS - 1).astype(np.uint8).tobytes())
        headers.append({"name": name, "label": label.replace("$^3$", "³"), "colours": colours, "ends": ends})
    body = _align_values(first, first.body.astype(float), used)
    body = np.where(np.isnan(body), _align_values(last, last.body.astype(float), used), body).astype(np.uint8)
    content = {
        "title": str(first.metadata.get("title", "")),
        "dimensions": dim,
        "count": len(used),
        "spacing": spacing_of(first) * (len(ids) / len(used)) ** (1.0 / dim),
        "times": [moment.time for moment in moments],
        "units": _units(first, np.array([low, high]), moments[-1].time),
        "kinematics": str(first.metadata.get("kinematics", "")),
        "low": low.tolist(),
        "high": high.tolist(),
        "view": [ends.tolist() for ends in view],
        "fields": headers,
        "bodies": [{"name": name, "colour": body_colour(k)} for k, name in enumerate(first.bodies)],
        "planes": list(planes),
        "data": base64.b64encode(zlib.compress(b"".join([*parts, body.tobytes()]), 9)).decode(),
    }
    return Frames(content, tuple(remarks))


def _units(snapshot: Snapshot, box: np.ndarray, end: float) -> dict[str, tuple[str, float]]:
    """Return the units of lengths and times that suit a run, and how many of each are in the snapshots' own."""
    if snapshot.metadata.get("units") == "none":
        return {"length": ("", 1.0), "time": ("", 1.0)}
    unit, factor = axis_unit("us", [end])
    return {"length": axis_unit("mm", box.ravel()), "time": (unit.replace("us", "µs"), factor)}


def _align_values(moment: Snapshot, values: np.ndarray, ids: np.ndarray) -> np.ndarray:
    """Return the values of the particles `ids`, NaN for those that are not there."""
    out = np.full((len(ids), *values.shape[1:]), np.nan)
    order = np.argsort(moment.id)
    place = np.searchsorted(moment.id[order], ids)
    place = np.minimum(place, moment.count - 1)
    present = moment.id[order][place] == ids
    out[present] = values[order][place[present]]
    return out


def _box(positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    flat = positions.reshape(-1, positions.shape[-1])
    flat = flat[np.isfinite(flat).all(axis=1)]
    low, high = flat.min(axis=0), flat.max(axis=0)
    return low, np.where(high > low, high, low + 1.0)


def _view(positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the initial view box, without the outermost particles where these enlarge it by half."""
    low, high = _box(positions)
    first = _box(positions[:1])
    ends = np.nanpercentile(positions.reshape(-1, positions.shape[-1]), OUTSIDE, axis=0)
    margin = MARGIN * (ends[1] - ends[0])
    near_low = np.maximum(np.minimum(ends[0] - margin, first[0]), low)
    near_high = np.minimum(np.maximum(ends[1] + margin, first[1]), high)
    return (near_low, near_high) if np.any(high - low > 1.5 * (near_high - near_low)) else (low, high)
