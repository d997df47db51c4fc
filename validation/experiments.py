"""Measured values, and the cases that compute them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

from hvisph_validation.experiment_set import ExperimentSet, bundled_sets, load_set

from hvisph.casefile.loader import case_document, read_table
from hvisph.core.errors import CaseError, suggest_nearest
from hvisph.sweeps.parameters import EXPERIMENT, Values, plain, split

Form = Literal["full", "second", "coarse"]
SHOT = f"{EXPERIMENT}shot"
GROUP = f"{EXPERIMENT}group"
ACROSS = f"{EXPERIMENT}across"  # the length that particles are counted over, where a shot's is another
UNITS = {"-": 1.0, "mm": 1e-3, "m/s": 1.0, "km/s": 1e3, "us": 1e-6, "GPa": 1e9, "MPa": 1e6, "g": 1e-3, "cm^3": 1e-6}
CONFIDENCE = ("seen", "derived", "recalled")
WORDS = {"yes": 1.0, "no": 0.0}


@dataclass(frozen=True)
class Measured:
    """One measured number.

    `shot`, `quantity`: shot, and quantity of the set's evaluator.
    `at`: place along an outline, or velocity, in the set's own unit; None for single numbers.
    `value`, `unit`, `scatter`: number (1 and 0 for yes and no), unit of `UNITS`, and scatter of the experiment; None if
      unknown.
    `judged`: whether verdicts count it; never if recalled from memory.
    `confidence`, `source`: confidence of the number, and its source.
    """

    shot: str
    quantity: str
    at: float | None
    value: float
    unit: str
    scatter: float | None
    judged: bool
    confidence: str
    source: str

    @classmethod
    def from_row(cls, row: Mapping[str, str]) -> Measured:
        """Return a row of ``measured.csv``; raises `CaseError` for what cannot be."""
        if row["unit"] not in UNITS or row["confidence"] not in CONFIDENCE:
            raise CaseError(f"{row['shot']}, {row['quantity']}: unknown unit or confidence in measured.csv")
        sure = row["judged"] == "yes" and row["confidence"] != "recalled"
        value = WORDS[row["value"]] if row["value"] in WORDS else float(row["value"])
        at, scatter = (float(row[key]) if row[key] else None for key in ("at", "scatter"))
        return cls(row["shot"], row["quantity"], at, value, row["unit"], scatter, sure, row["confidence"],
                   row["source"])  # fmt: skip


class Experiments:
    """A set of experiments and the sweeps that compute it.

    `name`: of a bundled set; raises `CaseError` for any other.
    """

    def __init__(self, name: str):
        sets = bundled_sets()
        if name not in sets:
            raise CaseError(f"there is no set '{name[:200]}'{suggest_nearest(name[:200], list(sets))}", where="NAME")
        self.name, self.folder = name, sets[name]
        self.model: ExperimentSet = load_set(self.folder)

    @cached_property
    def measured(self) -> list[Measured]:
        """All that was measured."""
        return [Measured.from_row(row) for row in read_table(self.folder / "measured.csv")]

    @cached_property
    def shots(self) -> dict[str, Values]:
        """Settings of every shot by path."""
        if self.model.limits:
            return {name: dict(limit.set) for name, limit in self.model.limits.items()}
        rows = read_table(self.folder / "shots.csv")
        return {row.pop("shot"): {path: plain(cell) for path, cell in row.items() if cell} for row in rows}

    def particles(self, form: Form, across: float | None = None) -> float:
        """Return how many particles lie across in a form, or as many as were asked for."""
        return across or float(getattr(self.model.particles_across, form))

    def sweeps(self, form: Form, across: float | None = None) -> dict[str, dict[str, Any]]:
        """Return the sweeps that compute the set, by the name of their folder.

        `form`: ``full``, ``second`` or ``coarse``.
        `across`: particles across in place of the form's.
        """
        case, number = f"validation/{self.name}/case", self.particles(form, across)
        cases = [{SHOT: shot} | values | {"resolution": self._spacing(values, number)}
                 for shot, values in self.shots.items()]  # fmt: skip
        if not self.model.limits:
            return {"shots": {"title": self.model.title, "case": case, "vary": {"type": "list", "cases": cases}}}
        sweeps = {}
        for values in cases:
            name = str(values.pop(SHOT))
            limit = self.model.limits[name]
            fixed = {path: value for path, value in values.items() if not path.startswith(EXPERIMENT)}
            vary = {"type": "bisect", "path": limit.path, "bracket": list(limit.bracket), "tolerance": limit.tolerance,
                    "points": 1}  # fmt: skip
            sweeps[name] = {"title": f"{self.model.title}: {name}", "case": case, "set": fixed, "vary": vary}
        return sweeps

    @cached_property
    def _base(self) -> Any:
        return case_document(f"validation/{self.name}/case").value

    def _spacing(self, values: Mapping[str, object], number: float) -> str:
        path = self.model.particles_across.of
        text: Any = values.get(ACROSS, values.get(path))
        if text is None:
            text = self._base
            for key in path.split("."):
                text = text[int(key) if isinstance(text, list) else key]
        length, unit = split(path, text)
        return f"{length / number:.8g} {unit}".strip()


def experiment_names() -> list[str]:
    """Return the names of all bundled sets."""
    return list(bundled_sets())
