"""Material library: materials of the package and of user files.

A file holds one material, called as the file is, or several by name. A material is what a case may write out, and may
start from another one, `base: NAME`, with only what differs. Beside it stand `aliases`, `note`, the `sources` of its
numbers and, where they are known, points of its Hugoniot or published fits to them.
"""

import re
from collections.abc import Sequence
from difflib import get_close_matches
from functools import lru_cache
from math import exp
from pathlib import Path
from typing import Literal

from hvisph.case.materials.material import Material
from hvisph.case.model import StrictModel, key
from hvisph.case.units import Number, PositiveNumber, PositiveVelocity, Velocity
from hvisph.core.errors import CaseError
from hvisph.core.text import Plain, shorten

from .document import Document, read_yaml
from .errors import validate_values
from .overrides import override_material

_FOLDER = Path(__file__).resolve().parents[1] / "case" / "library"
_ENDINGS = (".yaml", ".yml")
MOST_BASES = 8
ON_A_LINE = 16  # points at which a material is held against a published fit
Confidence = Literal["opened", "derived", "memory", "memory-low"]
CONFIDENCE = {
    "opened": "",
    "derived": "derived",
    "memory": "not checked against the source",
    "memory-low": "not checked, and the range in the literature is wide",
}


class Source(StrictModel):
    """Source of numbers and its reliability."""

    of: tuple[str, ...] = key("What it says: `density`, `eos`, `strength.a` and so on")
    text: str = key("Author, year, report, and where it was read")
    confidence: Confidence = key("Whether the source was opened to check the number", "opened")


# What names of explosives and of woven materials begin with, in letters and digits alone.
EXPLOSIVES = ("tnt", "c4", "comp", "pbx", "hmx", "rdx", "petn", "octol", "anfo", "lx1", "semtex", "explosive")
FABRICS = ("kevlar", "nextel", "aramid", "dyneema", "twaron", "zylon")
CLOSE = 0.8  # how like a name is that was probably meant: a slip of a letter or two, and no other substance


class MeasuredLine(StrictModel):
    """A published fit to measured shocks whose points are not at hand, Us = c0 + s up + q up^2 + b up exp(-d up)."""

    source: str = key("Author of the fit, points, and where it was read")
    c0: PositiveVelocity = key("c0 [m/s]")
    s: PositiveNumber = key("s [-]")
    q: Number = key("q [s/m]", 0.0)
    bump: tuple[Number, Number] = key("b [-] and d [s/m], of liquids", (0.0, 0.0))
    up: tuple[PositiveVelocity, PositiveVelocity] = key("Particle velocities of the comparison [m/s]", (250.0, 4000.0))

    @property
    def points(self) -> list[tuple[float, float]]:
        """Points [up, Us] on it, evenly from end to end [m/s]."""
        low, high = self.up
        evenly = [low + (high - low) * k / (ON_A_LINE - 1) for k in range(ON_A_LINE)]
        b, d = self.bump
        return [(u, self.c0 + u * (self.s + self.q * u + b * exp(-d * u))) for u in evenly]


class Notes(StrictModel):
    """Aliases, sources and Hugoniot data of a material."""

    aliases: tuple[str, ...] = key("Other names", ())
    note: str = key("What a user should know", "")
    sources: tuple[Source, ...] = key("Sources of the numbers", ())
    hugoniot: tuple[tuple[PositiveVelocity, PositiveVelocity], ...] = key("Measured points [up, Us] [m/s]", ())
    lines: tuple[MeasuredLine, ...] = key("Published fits to measured points", ())
    shocks: tuple[Velocity, PositiveVelocity] | None = key("Particle velocities with errors up to 2 % [m/s]", None)
    beyond: str = key("Material for shocks beyond `shocks`, or for all where none is within 2 % of measured ones", "")

    @property
    def hugoniot_points(self) -> list[tuple[Sequence[tuple[float, float]], str]]:
        """Hugoniot points [up, Us] [m/s] and their sources."""
        points: list[tuple[Sequence[tuple[float, float]], str]] = []
        if self.hugoniot:
            points.append((self.hugoniot, f"{len(self.hugoniot)} measured points"))
        return points + [(line.points, f"the line of {line.source}") for line in self.lines]


class Library:
    """Materials by name, those of `user_files` before the package's; `CaseError` where one is unreadable."""

    def __init__(self, user_files: Sequence[Path] = ()):
        self.documents: dict[str, Document] = {}
        self.files = {path.stem: path for path in sorted(_FOLDER.glob("*.yaml"))}
        for path in user_files:
            files = path.iterdir() if path.is_dir() else ()
            own_files = [file for file in files if file.suffix in _ENDINGS and not file.name.startswith(".")]
            for file in sorted(own_files) if path.is_dir() else [path]:
                self.documents |= _materials_of(file)

    def names(self) -> list[str]:
        """Return all names, sorted."""
        return sorted({*self.files, *self.documents})

    def name_of(self, name: str) -> str:
        """Return the proper name of a material's name or alias; raises `CaseError` if there is none."""
        names = self.names()
        if name in names:
            return name
        letters = _letters(name)
        for candidate in names if letters else ():
            if letters in {_letters(candidate), *map(_letters, self.notes(candidate).aliases)}:
                return candidate
        raise CaseError(f"unknown '{shorten(name)}'{self._suggestion(name[:64], letters)}")

    def _suggestion(self, name: str, letters: str) -> str:
        """Return the remedy for an unknown name: the names that contain it, or the nearest one."""
        if letters.startswith(EXPLOSIVES):
            kin = [n for n in self.names() if _letters(n).startswith(EXPLOSIVES)]
            return f"; the library's explosives are {', '.join(kin)}; another is an eos {{type: jwl}} written out"
        if letters.startswith(FABRICS):
            kin = [n for n in self.names() if _letters(n).startswith(FABRICS)]
            return f"; the library's fabrics are {', '.join(kin)}; another is a strength {{type: fabric}} written out"
        names = self.names()
        similar = [n for n in names if len(letters) > 2 and letters in _letters(n)]
        if similar:
            return f"; there are {', '.join(similar)}" if len(similar) > 1 else f"; did you mean '{similar[0]}'?"
        families = {re.split(r"[-0-9]", n)[0] for n in names}
        close = get_close_matches(name.lower(), [*names, *families], n=1, cutoff=CLOSE)
        if close:
            return f"; did you mean '{close[0]}'?"
        return "; `hvisph materials` lists the library's, and a case may write one out"

    def _document(self, name: str) -> Document:
        if name not in self.documents:
            self.documents[name] = read_yaml(self.files[name])
        return self.documents[name]

    def notes(self, name: str) -> Notes:
        """Return aliases, sources and points of the material `name`, its proper name."""
        document = self._document(name)
        values = {key: value for key, value in document.value.items() if key in Notes.model_fields}
        return validate_values(Notes, values, document.places)

    def values(self, name: str) -> Plain:
        """Return the material called `name` as plain values, those of its base included."""
        return self._values(self.name_of(name), ())

    def _values(self, name: str, chain: tuple[str, ...]) -> Plain:
        content = self._document(name).value
        values = {key: value for key, value in content.items() if key not in {*Notes.model_fields, "base"}}
        if "base" in content:
            if len(chain) > MOST_BASES:
                raise CaseError("leads back to itself, or over too many others", where=f"{name}.base")
            base = self._values(self.name_of(str(content["base"])), (*chain, name))
            values = override_material(base, values)
        source = "; ".join(dict.fromkeys(source.text for source in self.notes(name).sources))
        if source and "base" in content and values.get("source"):
            source += f"; all else as {content['base']}: {values['source']}"
        return values | {"name": name} | ({"source": source} if source else {})

    def load(self, name: str) -> Material:
        """Return the material called `name`. Raises `CaseError` if there is none of that name, or it is no material."""
        name = self.name_of(name)
        return validate_values(Material, self.values(name), self._document(name).places)


def _letters(name: str) -> str:
    """Return letters and digits of a name, so that AL 6061-T6, AA6061-T6 and aluminum-6061-t6 are one."""
    letters = re.sub(r"[^a-z0-9]", "", name.lower()).replace("aluminum", "aluminium")
    return re.sub(r"^(al|aa)(?=\d)", "aluminium", letters)


def _materials_of(file: Path) -> dict[str, Document]:
    document = read_yaml(file)
    if {"density", "base"} & set(document.value):
        return {file.stem: document}
    documents = {}
    for name, value in document.value.items():
        if not isinstance(value, dict):
            raise CaseError("expected a material: a mapping with `density` or `base`", where=name, file=str(file))
        places = {path[1:]: place for path, place in document.places.items() if path[:1] == (name,)}
        documents[name] = Document(value, places)
    return documents


@lru_cache(maxsize=8)
def library_of(files: tuple[Path, ...] = ()) -> Library:
    """Return the library with a user's own files, read once."""
    return Library(files)


def material_names() -> list[str]:
    """Return the names of all materials of the package's library, sorted."""
    return library_of().names()


@lru_cache(maxsize=256)
def load_material(name: str) -> Material:
    """Return the package's material called `name`; `CaseError` if there is none."""
    return library_of().load(name)


def library_values(name: str) -> Plain:
    """Return the package's material called `name` as plain values, those of its base included."""
    return library_of().values(name)


def library() -> dict[str, Material]:
    """Return all materials of the package's library by name."""
    return {name: load_material(name) for name in material_names()}
