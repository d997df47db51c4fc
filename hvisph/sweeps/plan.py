"""A sweep from its file: the model, the case that it starts from, and every case that it makes, all checked."""

import hashlib
import json
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from hvisph.case.case import Case
from hvisph.case.sweep import Fit, Sweep
from hvisph.casefile.document import Document, Place
from hvisph.casefile.errors import locate_error
from hvisph.casefile.loader import load_sweep, materials_of, validate
from hvisph.casefile.overrides import overridden
from hvisph.core.errors import CaseError
from hvisph.core.text import PlainMapping, format_value
from hvisph.precheck.estimate import estimated_steps, rough_count

from .calibration import with_data
from .design import points
from .parameters import EXPERIMENT, Values
from .statistics import read_fit

T = TypeVar("T")


@dataclass(frozen=True)
class Member:
    """One case of a sweep."""

    number: int  # its place in the table, from 0
    digest: str  # hash of its effective case, eight digits
    values: Values  # its settings by path, and columns carried along
    cost: float = 0.0  # estimated cost in particle-steps

    @property
    def name(self) -> str:
        """Name of its run's folder."""
        return f"{self.number:05d}-{self.digest}"


class Plan:
    """A sweep, the case before settings (`base`), and lines of the sweep's file for messages (`places`)."""

    def __init__(self, sweep: Sweep, base: Document, places: Mapping[Any, Place], folder: Path):
        self.sweep, self.places, self.folder = sweep, places, folder
        self.base = base
        self.counts: dict[str, float] = {}  # of particles, by spacing and shapes: estimates for the order of the cases
        vary: Any = sweep.vary  # with the content of its files, so that the sweep's folder is complete
        if isinstance(vary, Fit):
            vary = self._locate(("vary",), lambda: with_data(vary, folder))
        elif getattr(vary, "fit", None) is not None:
            fit = self._locate(("vary",), lambda: read_fit(vary.fit, folder))
            vary = vary.model_copy(update={"fit": fit})
        self.sweep = sweep.model_copy(update={"vary": vary})
        for path, value in sweep.set.items():
            self.base = self._locate(("set", path), lambda: setting(self.base, path, value))  # noqa: B023 called at once

    def first(self) -> list[Member]:
        """Return the cases that are known before anything runs, each one loaded and found good."""
        values = self._locate(("vary",), lambda: points(self.sweep.vary, self.base.value, self.folder))
        return self.members(values, 0)

    def members(self, values: Sequence[Values], start: int) -> list[Member]:
        """Return cases for `values`, numbered from `start`."""
        members = []
        for number, settings in enumerate(values, start):
            case = self.case(settings, number)
            shapes = f"{case.resolution} {[body.shape for body in case.bodies.values()]}"
            if shapes not in self.counts:
                self.counts[shapes] = float(rough_count(case))
            members.append(Member(number, digest(case), settings, self.counts[shapes] * estimated_steps(case)))
        return members

    def case(self, values: Values, number: int = 0) -> Case:
        """Return the loaded case with these values; raises `CaseError` that names the case."""
        try:
            document = self.base
            for path, value in values.items():
                if not path.startswith(EXPERIMENT):
                    document = setting(document, path, value)
            return validate(document)
        except CaseError as error:
            settings = ", ".join(f"{path} = {format_value(value)}" for path, value in values.items())
            raise locate_error(("vary",), f"case {number} ({settings}): {error}", self.places) from None

    def _locate(self, path: tuple[str, ...], call: Callable[[], T]) -> T:
        """Call, and add the sweep's file and line to errors."""
        try:
            return call()
        except CaseError as error:
            keys = tuple(part for part in error.where.split(".") if part) if path == ("vary",) else ()
            location = (*path, *keys)
            raise locate_error(location, error.message, self.places) from None


def setting(document: Document, path: str, value: object) -> Document:
    """Return the case with one setting applied, as of `--set`."""
    return overridden(document, f"{path}={json.dumps(value)}", materials_of(document).values)


def digest(case: Case) -> str:
    """Return a hash of a case in eight digits."""
    return hashlib.sha256(case.model_dump_json().encode()).hexdigest()[:8]


def load_plan(source: str | os.PathLike[str] | PlainMapping) -> Plan:
    """Return the plan of a sweep's file, or of a mapping with its keys; raises `CaseError` for anything wrong."""
    sweep, document, base, folder = load_sweep(source)
    return Plan(sweep, base, document.places, folder)
