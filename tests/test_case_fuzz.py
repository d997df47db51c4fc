"""Fuzzing: whatever is loaded, it is a case or a `CaseError`."""

import string

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hvisph.case.case import Case
from hvisph.casefile.document import parse
from hvisph.casefile.loader import bundled_cases, dump_case, load_case
from hvisph.core.errors import CaseError

TEXTS = [path.read_text(encoding="utf-8") for path in bundled_cases().values()]
WORDS = [
    "type",
    "none",
    "eulerian",
    "disc",
    "bodies",
    "1 mm",
    "3 km/s",
    "9e999",
    "-1",
    "1e-320",
    "al_al",
    "elastic",
]
SCALARS = (
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.sampled_from(WORDS)
    | st.text(string.printable, max_size=12)
)
VALUES = st.recursive(
    SCALARS,
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(st.sampled_from(WORDS) | st.text(max_size=6), inner, max_size=4)
    ),
    max_leaves=12,
)
QUICK = settings(max_examples=120, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


def attempt(source, overrides=()):
    try:
        case = load_case(source, overrides)
    except CaseError:
        return
    assert isinstance(case, Case)
    assert load_case(parse(dump_case(case), "dumped").value) == case


def paths_of(value, path=()):
    yield path
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, item in items:
        yield from paths_of(item, (*path, key))


def replaced(value, path, new):
    if not path:
        return new
    copy = dict(value) if isinstance(value, dict) else list(value)
    copy[path[0]] = replaced(value[path[0]], path[1:], new)
    return copy


@QUICK
@given(st.dictionaries(st.sampled_from(list(Case.model_fields)) | st.text(max_size=5), VALUES, max_size=6))
def test_any_mapping(data):
    attempt(data)


@QUICK
@given(st.data(), VALUES)
def test_a_case_with_one_value_changed(data, new):
    source = parse(data.draw(st.sampled_from(TEXTS)), "x").value
    path = data.draw(st.sampled_from([p for p in paths_of(source) if p]))
    attempt(replaced(source, path, new))


@QUICK
@given(st.data(), st.text(max_size=30), st.integers(0, 40))
def test_a_file_with_some_text_changed(tmp_path, data, new, cut):
    text = data.draw(st.sampled_from(TEXTS))
    at = data.draw(st.integers(0, len(text)))
    path = tmp_path / "case.yaml"
    path.write_bytes((text[:at] + new + text[at + cut :]).encode("utf-8", "surrogatepass"))
    attempt(path)


@QUICK
@given(st.binary(max_size=200))
def test_any_bytes(tmp_path, raw):
    path = tmp_path / "case.yaml"
    path.write_bytes(raw)
    attempt(path)


@QUICK
@given(st.data(), st.text(max_size=20))
def test_any_override(data, value):
    source = parse(TEXTS[0], "x").value
    key = data.draw(st.sampled_from([".".join(map(str, p)) for p in paths_of(source) if p]) | st.text(max_size=15))
    attempt("al_al_coarse", [f"{key}={value}"])
