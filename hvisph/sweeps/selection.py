"""Which cases of a sweep are to be computed, and in which order."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from hvisph.core.errors import CaseError

from .folder import ENDED, Standing
from .plan import Member

AGAIN = ("failed", "error", "killed", "interrupted")


@dataclass(frozen=True)
class Selection:
    """Cases to take.

    Parameters
    ----------
    statuses
        What ended like this is begun again or gone on with first.
    first, last
        Only these numbers.
    """

    statuses: tuple[str, ...] = ()
    first: int = 0
    last: int = 10**9

    @classmethod
    def parse(cls, text: str | None) -> Selection:
        """Return the selection that `--only` asks for: a status, or N..M; raises `CaseError`."""
        if text is None:
            return cls()
        numbers = re.fullmatch(r"(\d+)(?:\.\.(\d+))?", text)
        if numbers:
            first, last = int(numbers[1]), int(numbers[2] or numbers[1])
            if last < first:
                raise CaseError(f"'{text}' holds no number; the smaller one comes first", where="--only")
            return cls(first=first, last=last)
        if text not in AGAIN:
            raise CaseError(f"'{text}' is neither {', '.join(AGAIN)} nor numbers such as 3..7", where="--only")
        return cls(statuses=("failed", "error", "killed") if text == "failed" else (text,))

    def takes(self, member: Member, standing: Standing) -> bool:
        """Tell whether a case is to be computed."""
        inside = self.first <= member.number <= self.last
        cut_off = standing.status == "interrupted" and standing.message == "limit"
        return inside and standing.status not in ENDED and not cut_off

    def require(self, members: Sequence[Member]) -> None:
        """Raise `CaseError` where the sweep has no case of these numbers."""
        last = max((member.number for member in members), default=-1)
        if self.first > last:
            raise CaseError(f"there is no case {self.first}: numbers go from 0 to {last}", where="--only")

    @staticmethod
    def by_cost(members: Sequence[Member]) -> list[Member]:
        """Return the members, the costliest first, so that no long one is left for the end."""
        return sorted(members, key=lambda member: (-member.cost, member.number))
