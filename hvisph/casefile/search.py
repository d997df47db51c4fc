"""Search in keys, values, measures, materials, cases and pages for `hvisph help`."""

import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path

from hvisph.case.case import Case
from hvisph.core.measure_catalogue import SECTIONS

from .material_library import Library
from .model_fields import inner_of, places
from .paths import bundled_cases
from .spellings import spellings

MOST = 40
# Titles and headings of the documentation, made by `python tools/commands.py --write`.
PAGES = Path(__file__).with_name("pages.json")
ALLOY = re.compile(r"(?:al|aa)_?(\d{4}.*)")  # what alloys of aluminium are called for short: Al2024, AA6061-T6


@dataclass(frozen=True)
class Entry:
    """Search result."""

    kind: str  # key, value, measure, material, case, page or command
    name: str  # how it is written; of keys the whole path
    text: str  # description in one line


def search(word: str, commands: Sequence[tuple[str, str]] = ()) -> list[Entry]:
    """Search words in keys, paths, values, measures, materials, cases, pages and `commands`; the best result first."""
    query = word.strip().lower().replace("-", "_")
    subject = spellings("subjects").get(query)
    synonyms = {query, spellings("synonyms").get(query.replace("_", ""), query), ALLOY.sub(r"aluminium_\1", query)}
    everything = list(_entries(commands))
    scored = [
        (9 if e.name == subject else max(_score(e, text) for text in synonyms), k, e) for k, e in enumerate(everything)
    ]
    if " " in query and not any(score for score, _, _ in scored):
        scored = [(min(_score(e, text) for text in query.split()), k, e) for k, e in enumerate(everything)]
    ranked = _outermost(sorted((entry for entry in scored if entry[0] > 0), key=lambda entry: (-entry[0], entry[1])))
    best = ranked[0][0] if ranked else 0
    # words in texts only matter where no name has the word
    return [e for score, _, e in ranked if best <= 3 or score > 2][:MOST]


def _outermost(ranked: Sequence[tuple[int, int, Entry]]) -> list[tuple[int, int, Entry]]:
    """Return results without those of blocks within blocks of their kind, such as shapes of the parts of shapes."""
    shortest: dict[tuple[str, str, str], str] = {}
    for _, _, e in ranked:
        mark = (e.kind, ".".join(e.name.split(".")[-2 if e.kind == "key" else -1 :]), e.text)
        shortest[mark] = min(shortest.get(mark, e.name), e.name, key=len)
    names = set(shortest.values())
    return [entry for entry in ranked if entry[2].name in names]


def nearest_names(word: str, commands: Sequence[tuple[str, str]] = ()) -> list[str]:
    """Return the names nearest to a word without results."""
    names = {entry.name.split(".")[-1]: entry.name for entry in _entries(commands)}
    return [names[name] for name in get_close_matches(word.lower().replace("-", "_"), names, n=5, cutoff=0.6)]


def _score(entry: Entry, word: str) -> int:
    name = entry.name.replace(".NAME", "").lower().replace("-", "_")
    last = name.split(".")[-1]
    if last == word or name in (word, f"hvisph {word}"):
        return 8
    if name.endswith(f".{word}"):
        return 7
    if word in re.split(r"[_/ :.]", last):
        return 6
    text = entry.text.lower().replace("-", " ").replace("_", " ")
    words = word.replace("_", " ")
    if entry.kind == "page" and re.search(rf"\b{re.escape(words)}\b", text.partition(":")[0]):  # its title
        return 5
    if word in last or (entry.kind == "page" and words in text.partition(":")[0]):
        return 4
    if word in name:
        return 3
    return 2 if re.search(rf"\b{re.escape(words)}\b", text) else int(words in text)


def _entries(commands: Sequence[tuple[str, str]]) -> Iterator[Entry]:
    yield from (Entry("command", f"hvisph {name}", text) for name, text in commands)
    marks: set[tuple[str, str, str]] = set()
    for entry in _keys():
        mark = (entry.kind, entry.name, entry.text)
        if mark not in marks:
            marks.add(mark)
            yield entry
    for section, measures in SECTIONS.items():
        head = "measures" if section == "run" else section
        yield from (Entry("measure", f"{head}.{name}", measure.meaning) for name, measure in measures.items())
    library = Library()
    for name in library.names():
        notes = library.notes(name)
        yield Entry("material", name, "; ".join([*notes.aliases, *(source.text for source in notes.sources)]))
    yield from (Entry("case", name, "") for name in bundled_cases())
    for page, (title, *headings) in json.loads(PAGES.read_text(encoding="utf-8")).items():
        yield Entry("page", f"docs/{page}", ": ".join([title, ", ".join(headings)]) if headings else title)


def _keys() -> Iterator[Entry]:
    for path, below, info, spot in places(Case):
        if not path.endswith("type"):
            yield Entry("key", path, info.description or "")
            yield from (Entry("value", f"{path}: {choice}", info.description or "") for choice in spot.choices)
        for tag, alternative in inner_of(spot).models.items():
            if tag:
                first = (alternative.__doc__ or "").strip().splitlines()[0]
                yield Entry("value", f"{below}.type: {tag}", first)
