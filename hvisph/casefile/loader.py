"""Loading of cases from files, bundled names and mappings, and of sweeps."""

import csv
import hashlib
import os
import re
from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from pathlib import Path

from hvisph.case.case import Case
from hvisph.case.model import Path as Keys
from hvisph.case.sweep import Sweep
from hvisph.casefile.document import Document, Place, dump, plain_document, read_yaml
from hvisph.casefile.errors import locate_error, validate_values
from hvisph.casefile.material_library import Library, library, library_of, load_material, material_names
from hvisph.casefile.overrides import merge, overridden, with_bases
from hvisph.casefile.paths import bundled_cases
from hvisph.casefile.spellings import renamed_key
from hvisph.core.errors import CaseError, suggest_nearest
from hvisph.core.text import shorten

__all__ = ["bundled_cases", "case_hash", "dump_case", "library", "load_case", "load_material", "material_names"]
MOST_BASES = 8
ENDINGS = (".yaml", ".yml", ".json")  # of files that a case may be based on
_QUOTED = re.compile(r"'[^']*'")
Source = str | os.PathLike[str] | Mapping[str, object]


def load_case(source: Source, overrides: Iterable[str] = (), resolution: str | float | None = None) -> Case:
    """Return the validated case.

    `source`: path of a case file, name of a bundled case, or a mapping with the keys of one.
    `overrides`: settings ``path.to.key=value`` laid over it, in their order.
    `resolution`: particle spacing in place of the case's own: plain numbers are metres.
    Raises `CaseError` for anything wrong with any of them; `CaseErrors` lists several.
    """
    document = case_document(source)
    if isinstance(overrides, str):
        overrides = [overrides]
    for override in overrides:
        document = overridden(document, override, materials_of(document).values)
    if resolution is not None:
        places: dict[Keys, Place] = {("resolution",): Place(f"--resolution {str(resolution)[:80]}")}
        document = merge(document, Document({"resolution": resolution}, places))
    return validate(document)


def validate(document: Document) -> Case:
    """Validate `document` and return its case; raises all errors."""
    if {"case", "vary"} <= document.value.keys():
        place = document.places.get(("vary",), Place(""))
        raise CaseError("the file is a sweep, not a case: `hvisph sweep FILE`", file=place.file, line=place.line)
    units, materials = document.value.get("units"), materials_of(document)
    document = with_bases(document, materials.values)
    folders = dict.fromkeys(str(Path(place.file).parent) for place in document.places.values() if place.file)
    context = {"units": units, "library": materials.load, "folders": tuple(folders)}
    return validate_values(Case, document.value, document.places, context)


def materials_of(document: Document) -> Library:
    """Return the material library with the files that `materials` of the case lists."""
    names = document.value.get("materials") or ()
    libraries = []
    for index, name in enumerate(names if isinstance(names, list | tuple) else ()):
        place = document.places.get(("materials", index)) or document.places.get(("materials",), Place(""))
        if isinstance(name, str):
            libraries.append(_resolve_near(name, place, ("materials", str(index))))
    return library_of(tuple(libraries))


def _resolve_near(name: str, place: Place, path: Keys) -> Path:
    """Resolve `name` relative to the case file, or else to the working folder."""
    try:
        sibling = Path(place.file).parent / name if place.file else Path(name)
        for candidate in (sibling, Path(name)):
            if candidate.exists():
                return candidate.resolve()
    except (OSError, ValueError):
        pass
    message = f"there is no file or folder '{name[:200]}'"
    raise CaseError(message, where=".".join(map(str, path)), file=place.file, line=place.line)


def dump_case(case: Case) -> str:
    """Return the effective case in YAML, every default written out; it loads to an equal case."""
    return dump(_type_first(case.model_dump(mode="json")))


def case_hash(text: str) -> str:
    """Return the hash of an effective case's text."""
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _type_first(value: object) -> object:
    """Move the `type` of every block to its front."""
    if isinstance(value, list):
        return [_type_first(item) for item in value]
    if not isinstance(value, dict):
        return value
    front = {"type": value["type"]} if "type" in value else {}
    return front | {key: _type_first(item) for key, item in value.items()}


def find_case(source: str | os.PathLike[str]) -> Path:
    """Return the file of a path, or of a bundled case's name; raises `CaseError` if there is neither."""
    path = Path(source)
    try:
        exists = path.exists()
    except (OSError, ValueError):
        exists = False
    if exists and not (path.is_dir() and str(source) in bundled_cases()):
        return path
    cases = bundled_cases()
    name = str(source)
    if name in cases:
        return cases[name]
    hint = suggest_nearest(name[:200], [short for short in cases if "/" not in short])
    raise CaseError(f"there is no case file and no bundled case '{shorten(name, 200)}'{hint}")


def case_document(source: Source) -> Document:
    """Return the document of a source merged with its bases, not validated."""
    if isinstance(source, Mapping):
        return _on_base(plain_document(source), Path(), ())
    if not isinstance(source, str | os.PathLike):
        raise CaseError("a case is a path, the name of a bundled case, or a mapping")
    path = find_case(source)
    return _on_base(read_yaml(path), path, ())


def _on_base(document: Document, path: Path, chain: tuple[Path, ...]) -> Document:
    """Merge `document` with the file that its `base` names, if any."""
    if "base" not in document.value:
        return document
    base, place = document.value["base"], document.places.get(("base",), Place(""))
    changes = Document({k: v for k, v in document.value.items() if k != "base"}, document.places)
    chain = (*chain, path.resolve())
    try:
        if not isinstance(base, str):
            raise CaseError("expected the path of another case file, such as base.yaml")
        sibling = path.parent / base
        file = sibling if sibling.is_file() else find_case(base)
        if not file.is_file():
            raise CaseError(f"'{base[:200]}' is no file")
        if file.resolve() in chain:
            raise CaseError(f"'{base}' leads back to a file that is based on it")
        if file.suffix not in ENDINGS:
            raise CaseError(f"a case file ends in {' or '.join(ENDINGS)}, and '{base[:200]}' does not")
        if len(chain) > MOST_BASES:
            raise CaseError(f"more than {MOST_BASES} files are based on each other")
    except (OSError, ValueError):
        raise CaseError("is no path", where="base", file=place.file, line=place.line) from None
    except CaseError as error:
        raise CaseError(error.message, where="base", file=place.file, line=place.line) from None
    return merge(_on_base(_read_base(file), file, chain), changes)


def _read_base(path: Path) -> Document:
    """Return the content of a case's base; errors do not quote it, for it may be any file of the user."""
    try:
        document = read_yaml(path)
    except CaseError as error:
        raise CaseError(_QUOTED.sub("'...'", error.message), error.where, error.file, error.line) from None
    allowed = [*Case.model_fields, "base"]
    for key in document.value:
        if key not in allowed:
            renamed = renamed_key((key,), allowed)
            close = get_close_matches(key, allowed, n=1, cutoff=0.7)
            what = f"unknown key '{key}'; did you mean '{close[0]}'?" if close else "is no case file: it has other keys"
            place = document.places.get((key,), Place(str(path)))
            raise CaseError(renamed or what, where=key if renamed else "", file=place.file, line=place.line)
    return document


def load_sweep(source: str | os.PathLike[str] | Mapping[str, object]) -> tuple[Sweep, Document, Document, Path]:
    """Return a sweep's model, its text, the case that it starts from, and the folder that its paths are relative to.

    `source`: path of the file, or a mapping with its keys, whose paths are relative to the present folder.
    Raises `CaseError` for anything wrong with it or with the case that it names.
    """
    if isinstance(source, Mapping):
        document, folder = plain_document(source), Path()
    else:
        document, folder = read_yaml(Path(source)), Path(source).parent
    sweep = validate_values(Sweep, document.value, document.places)
    sibling = folder / sweep.case
    try:
        base = case_document(sibling if sibling.is_file() else sweep.case)
        validate(base)
    except CaseError as error:
        raise locate_error(("case",), str(error), document.places) from None
    return sweep, document, base, folder


def read_table(path: Path) -> list[dict[str, str]]:
    """Return the rows of a CSV file by its heads; raises `CaseError` where it cannot be read."""
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            table = csv.DictReader(file)
            heads = [head.strip() for head in table.fieldnames or ()]
            rows = list(table)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise CaseError(f"{path} cannot be read: {getattr(error, 'strerror', None) or error}") from None
    duplicate = next((head for head in heads if heads.count(head) > 1), None)
    if duplicate is not None:
        raise CaseError(f"{path}, line 1: the head '{duplicate}' stands there twice")
    for line, row in enumerate(rows, 2):
        if None in row or None in row.values():
            raise CaseError(f"{path}, line {line}: as many cells as heads are needed")
    return [dict(zip(heads, row.values(), strict=True)) for row in rows]
