"""The blind set: twenty problems away from the others, run once a release and never used to change a scheme.

Tolerances and their reasons were written before the first run and stay as they are; what misses is reported. A problem
that has served to find the cause of a miss is moved to `validation.problems` and replaced.
"""

from __future__ import annotations

from collections.abc import Iterator

from hvisph.verification.problem import EULERIAN, Options, Problem, Trial

from .bodies import colliding_bodies
from .shocks import shocks
from .solids import elastic_solids


def _trials(options: Options) -> Iterator[Trial]:
    yield from shocks(options)
    yield from elastic_solids(options)
    yield from colliding_bodies(options)


PROBLEM = Problem(
    "blind", "twenty problems run once a release, tolerances written before", _trials, EULERIAN, slow=True,
    why_not="foams, gases and unlike spacings among them are not for it",
)  # fmt: skip
