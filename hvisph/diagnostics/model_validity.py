"""Validity of material models during a run: range of state, and unlimited tension."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hvisph.core.measure_catalogue import axis_unit, format_share, format_time
from hvisph.output.snapshot import Snapshot

LOOKED_AT = ("mass", "density", "internal_energy", "temperature", "pressure", "damage")
LEFT = 1e-3  # share of a body's mass


@dataclass(frozen=True)
class Holds:
    """Where the models of a body's material hold.

    Parameters
    ----------
    outside
        Whether states lie outside, of density [kg/m^3], energy [J/kg], and temperature [K], pressure [Pa] and damage or
        None, each (n,).
    words
        The range, in words.
    tension
        What such a material bears at most [Pa]; None where its model of damage knows tension, and decides.
    """

    outside: Callable[..., np.ndarray]
    words: str
    tension: float | None = None


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
    """Return what should be said of each body, from all moments of a run: at most one text of each kind.

    Parameters
    ----------
    moments
        In order of time.
    bodies, holds
        Names of the bodies, and where their materials hold.
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
            f"{most} ({limits.words}): what it does from there on is no statement of the model"
        )
    if limits.tension is not None and seen.torn > LEFT:
        unit, factor = ("", 1.0) if plain else axis_unit("mm", seen.place)
        place = ", ".join(f"{factor * value:.3g}" for value in seen.place)
        yield (
            f"its material bears tension of up to {format_stress(seen.tension)}, which none of its models limits, at "
            f"({place}){unit and f' {unit}'} and {format_moment(seen.time)} (of the snapshots); such a material "
            f"spalls below {format_stress(limits.tension)}"
        )
