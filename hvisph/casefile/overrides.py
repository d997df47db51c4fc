"""Overrides of a case before validation: bases and single settings.

In both, mappings merge key by key, anything else is replaced, null takes a key away (so that its default holds again),
another `type` replaces a whole block, and a key that stands for others takes their place. A null that has nothing to
take away and stands where no key can is kept, so that validation names it.
"""

from collections.abc import Callable
from typing import Any

from hvisph.case.case import Case
from hvisph.case.model import Path
from hvisph.case.units import kind_of
from hvisph.core.errors import CaseError
from hvisph.core.text import Plain

from .document import MOST_DEEP, Document, Place, parse
from .model_fields import walk

LONGEST_OVERRIDE = 10_000
# Keys that stand for one another: giving one takes those of the other side from what it is laid over.
INSTEAD = (
    ({"us_up"}, {"sound_speed", "s1", "s2", "s3"}),
    ({"heat_capacity"}, {"heat_capacities", "heat_of_melting", "melting_point"}),
)


def merge(base: Document, changes: Document) -> Document:
    """Merge `changes` into `base`; every value keeps its file and line."""
    result = Document(base.value, dict(base.places))
    result.value = _merge(base.value, changes.value, (), result.places, changes.places)
    return result


def _merge(old: object, new: object, path: Path, places: dict[Path, Place], new_places: dict[Path, Place]) -> object:
    if not isinstance(old, dict) or not isinstance(new, dict) or new.get("type") not in (None, old.get("type")):
        _replace_places(path, places, new_places)
        return _without_null(new, path) if isinstance(new, dict) else new
    result = _without_replaced(old, new)
    for key, item in new.items():
        below = (*path, key)
        if item is None and (key in result or _has_default(below)):
            result.pop(key, None)
            _replace_places(below, places, {})
        elif key in result:
            result[key] = _merge(result[key], item, below, places, new_places)
        else:
            _replace_places(below, places, new_places)
            result[key] = _without_null(item, below) if isinstance(item, dict) else item
    return result


def _without_replaced(old: Plain, new: Plain) -> Plain:
    """Return a copy of `old` without the keys that keys of `new` replace, see `INSTEAD`."""
    keys = {key for key, item in new.items() if item is not None}
    replaced_keys: set[str] = set()
    for first, second in INSTEAD:
        for side, replaced in ((first, second), (second, first)):
            if keys & side and not keys & replaced:
                replaced_keys |= replaced
    return {key: item for key, item in old.items() if key not in replaced_keys}


def _without_null(value: Plain, path: Path) -> Plain:
    return {
        key: _without_null(item, (*path, key)) if isinstance(item, dict) else item
        for key, item in value.items()
        if item is not None or not _has_default((*path, key))
    }


def _has_default(path: Path) -> bool:
    """Whether some alternative of the models has the key at the end of `path`, rather than a name of the user's."""
    above = walk(Case, path[:-1])
    return above is not None and not above.named and walk(Case, path) is not None


def _replace_places(path: Path, places: dict[Path, Place], new_places: dict[Path, Place]) -> None:
    depth = len(path)
    for old in [p for p in places if p[:depth] == path]:
        del places[old]
    places.update({p: place for p, place in new_places.items() if p[:depth] == path})


def override_material(material: Plain, changes: Plain) -> Plain:
    """Return a material's plain values with `changes` laid over them, by the rules of a case and its base."""
    merged = _merge(material, changes, ("bodies", "", "material"), {}, {})
    assert isinstance(merged, dict)
    return merged


def with_bases(document: Document, values_of: Callable[[str], Plain]) -> Document:
    """Return `document` with every `material: {base: NAME, ...}` of bodies and their inclusions written out.

    `values_of` returns the plain values of a material by its name. Raises `CaseError` for an unknown name.
    """
    bodies = document.value.get("bodies")
    if not isinstance(bodies, dict):
        return document
    result = dict(bodies)
    for name, body in bodies.items():
        result[name] = body = _written_out(body, ("bodies", name), document, values_of)
        if isinstance(body, dict) and "inclusions" in body:
            inclusions = _written_out(body["inclusions"], ("bodies", name, "inclusions"), document, values_of)
            result[name] = {**body, "inclusions": inclusions}
    return Document({**document.value, "bodies": result}, document.places)


def _written_out(holder: Any, path: Path, document: Document, values_of: Callable[[str], Plain]) -> Any:
    """Return a block with its `material: {base: NAME, ...}` written out."""
    material = holder.get("material") if isinstance(holder, dict) else None
    if not isinstance(material, dict) or "base" not in material:
        return holder
    path = (*path, "material", "base")
    place = next((document.places[path[:n]] for n in range(len(path), 0, -1) if path[:n] in document.places), Place(""))
    try:
        if not isinstance(material["base"], str):
            raise CaseError("expected the name of a material")
        return {**holder, "material": _expand_base(material, values_of)}
    except CaseError as error:
        raise CaseError(error.message, where=".".join(map(str, path)), file=place.file, line=place.line) from None


def _expand_base(material: Plain, values_of: Callable[[str], Plain]) -> Plain:
    """Return a material that varies a `base` with all its values."""
    base = values_of(material["base"])
    changes = {key: value for key, value in material.items() if key != "base"}
    varied = {"name": f"{base['name']}, varied"} if changes else {}
    return override_material(base | varied, changes)


def overridden(document: Document, override: str, values_of: Callable[[str], Plain]) -> Document:
    """Return `document` with one setting `path.to.key=value` applied, its value in YAML.

    It may reach into a material that the case names (`values_of` returns its plain values), and into a block left to
    its default. Raises `CaseError` if it is no setting, or something without keys is in its way.
    """
    keys, new, name = _parse(override)
    setting = _Setting(dict(document.places), Place(name), document.value, values_of)
    return Document(setting.apply(document.value, (), keys, new), setting.places)


def _parse(override: str) -> tuple[list[str], object, str]:
    name = f"--set {override[:80]}{'...' if len(override) > 80 else ''}"
    path, equals, text = override.partition("=")
    keys = [key.strip() for key in path.split(".")]
    if not equals or not all(keys):
        raise CaseError("a setting looks like time.end=2us", file=name)
    if len(override) > LONGEST_OVERRIDE or len(keys) > MOST_DEEP:
        raise CaseError("the setting is too long", file=name)
    try:
        return keys, parse(text, name).value, name
    except CaseError as error:
        raise CaseError(error.message, where=path.strip(), file=name) from None


class _Setting:
    """Application of one setting."""

    def __init__(self, places: dict[Path, Place], place: Place, root: object, values_of: Callable[[str], Plain]):
        self.places, self.place, self.root, self.values_of = places, place, root, values_of

    def apply(self, value: object, path: Path, keys: list[str], new: object) -> object:
        """Return `value`, found at `path`, with the entry at `keys` below it set to `new`."""
        if not keys:
            self.mark(path)
            return _merge(value, new, path, self.places, dict.fromkeys([path], self.place))
        if isinstance(value, list):
            return self.apply_in_list(value, path, keys, new)
        if value is None:
            value = self.default_block(path)
            self.mark(path)
        elif isinstance(value, str) and _is_material_path(path):
            value = self.values_of(value)
        elif _is_material_path(path) and isinstance(value, dict) and isinstance(value.get("base"), str):
            value = _expand_base(value, self.values_of)
        if not isinstance(value, dict):
            raise self.fail(path, f"has no keys, so '{keys[0]}' cannot be set in it; it is {kind_of(value)}")
        return self.apply_in_mapping(value, path, keys, new)

    def apply_in_list(self, value: list[object], path: Path, keys: list[str], new: object) -> list[object]:
        index = int(keys[0]) if keys[0].isdecimal() and len(keys[0]) < 9 else len(value)
        if index >= len(value):
            raise self.fail(path, f"has no entry '{keys[0]}'; its {len(value)} entries count from 0")
        item = self.apply(value[index], (*path, index), keys[1:], new)
        return [*value[:index], item, *value[index + 1 :]]

    def apply_in_mapping(self, value: Plain, path: Path, keys: list[str], new: object) -> Plain:
        key, *keys_below = keys
        below = (*path, key)
        if not keys_below and new is None:
            self.mark(below)
            null = {} if key in value or _has_default(below) else {key: None}
            return {name: item for name, item in value.items() if name != key} | null
        if not keys_below and key == "type" and value.get("type") != new:
            self.mark(path)
            return {"type": new}
        return _without_replaced(value, {key: new}) | {key: self.apply(value.get(key), below, keys_below, new)}

    def mark(self, path: Path) -> None:
        _replace_places(path, self.places, {path: self.place})

    def fail(self, path: Path, message: str) -> CaseError:
        return CaseError(message, where=".".join(map(str, path)), file=self.place.file)

    def default_block(self, path: Path) -> Plain:
        """Return the block for a missing one: the `type` of the default, if it has one."""
        spot = walk(Case, path, self.root)
        default = spot.info.default if spot and spot.info else None
        tag = getattr(default, "type", None)
        return {"type": tag} if tag is not None else {}


def _is_material_path(path: Path) -> bool:
    return len(path) == 3 and path[0] == "bodies" and path[2] == "material"
