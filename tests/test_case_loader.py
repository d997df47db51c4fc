"""Loading: names, paths, mappings, bases, overrides, hostile files; and dumping."""

import os
import textwrap
import time

import pytest

from hvisph.case.formulations.options import MonaghanViscosity
from hvisph.casefile.document import parse
from hvisph.casefile.loader import bundled_cases, dump_case, load_case
from hvisph.core.errors import CaseError


def write(folder, name, text):
    path = folder / name
    path.write_text(textwrap.dedent(text), encoding="utf-8")
    return path


def target(case):
    return case.bodies["target"].material


def reloaded(text):
    return load_case(parse(text, "dumped").value)


def test_bundled_name_path_and_mapping_are_the_same_case():
    path = bundled_cases()["al_al"]
    assert (
        load_case("al_al") == load_case(path) == load_case(str(path)) == load_case(parse(path.read_text(), "x").value)
    )


def test_a_file_goes_before_a_bundled_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write(tmp_path, "al_al", dump_case(load_case("al_al_coarse")))
    assert load_case("al_al") == load_case("al_al_coarse")


def test_unknown_name_gives_the_nearest():
    with pytest.raises(CaseError, match="'al_all'; did you mean 'al_al'"):
        load_case("al_all")


def test_defaults():
    case = load_case(
        {
            "kinematics": "plane_strain",
            "resolution": "0.1 mm",
            "bodies": {
                "a": {
                    "material": "copper-ofhc",
                    "shape": {"type": "disc", "diameter": "1 cm"},
                    "rotation": 30,
                },
                "b": {"material": "tungsten", "shape": {"type": "box", "size": ["1 cm", "1 cm"]}},
            },
            "time": {"end": "1 us"},
        }
    )
    assert case.formulation.type == "riemann"
    assert case.formulation.reconstruction == "van_albada"
    assert case.bodies["a"].arrangement == "square"
    assert case.bodies["b"].velocity == (0.0, 0.0)
    assert case.bodies["a"].rotation.angle == 30.0
    assert list(case.bodies) == ["a", "b"]
    assert "plateau_stress" not in case.measures
    assert case.smoothing_length == pytest.approx(1.2e-4)


def test_case_is_frozen():
    case = load_case("al_al_coarse")
    with pytest.raises(ValueError, match="frozen"):
        case.time.end = 1.0


def test_no_units():
    data = {
        "units": "none",
        "kinematics": "uniaxial_strain",
        "resolution": 0.0025,
        "bodies": {
            "gamma": {
                "material": {"density": 1, "eos": {"type": "linear", "bulk_modulus": 1}},
                "shape": {"type": "interval", "length": 0.5},
                "velocity": 0.5,
            }
        },
        "time": {"end": "0.75", "step": 1e-4},
    }
    case = load_case(data)
    assert case.bodies["gamma"].arrangement == "uniform"
    assert case.bodies["gamma"].velocity == (0.5,)
    with pytest.raises(CaseError, match="only plain numbers are allowed"):
        load_case(data | {"resolution": "1 mm"})


@pytest.mark.parametrize(
    ("override", "value"),
    [
        ("time.end=2us", lambda c: c.time.end == 2e-6),
        ("bodies.projectile.velocity.0=4 km/s", lambda c: c.bodies["projectile"].velocity == (4000.0, 0.0)),
        (
            "bodies.projectile.velocity=[1 km/s, 2]",
            lambda c: c.bodies["projectile"].velocity == (1000.0, 2.0),
        ),
        ("bodies.target.material=tungsten", lambda c: c.bodies["target"].material.density == 19300.0),
        (
            "bodies.target.material.strength.yield_stress=0.4 GPa",
            lambda c: target(c).strength.yield_stress == 4e8 and target(c).density == 2785,
        ),
        (
            "formulation={type: riemann, reconstruction: none}",
            lambda c: c.formulation.reconstruction == "none",
        ),
        ("formulation.type=riemann", lambda c: c.formulation.reconstruction == "van_albada"),
        (
            "formulation.viscosity.beta=2.5",
            lambda c: c.formulation.viscosity == MonaghanViscosity(alpha=1, beta=2.5),
        ),
        ("formulation.viscosity.type=none", lambda c: c.formulation.viscosity.type == "none"),
        ("formulation.viscosity=", lambda c: c.formulation.viscosity.alpha == 1.0),
        (
            "formulation.artificial_stress={type: gray, eps: 0.15}",
            lambda c: c.formulation.artificial_stress.n == 4,
        ),
        (
            "formulation.smoothing_length.type=variable",
            lambda c: c.formulation.smoothing_length.max_over_initial == 2,
        ),
        ("output.formats=[vtu]", lambda c: c.output.formats == ("vtu",)),
        ("expected=", lambda c: not list(c.expected.items())),
        ("time.step=1e-9", lambda c: c.time.step == 1e-9),
        ("symmetry=[{axis: y}]", lambda c: c.symmetry[0].keep == "above"),
    ],
)
def test_override(override, value):
    assert value(load_case("al_al", [override]))


def test_override_reaches_into_a_block_left_to_its_default(tmp_path):
    path = write(tmp_path, "case.yaml", dump_case(load_case("al_al_coarse", ["formulation="])))
    assert load_case(path).formulation.type == "riemann"
    plain = write(tmp_path, "plain.yaml", "base: al_al_coarse\nformulation: null\n")
    assert load_case(plain, ["formulation.h_over_dx=1.5"]).formulation.h_over_dx == 1.5
    assert (
        load_case("al_al", ["formulation.viscosity=", "formulation.viscosity.beta=3"]).formulation.viscosity.beta == 3
    )


@pytest.mark.parametrize(
    ("override", "parts"),
    [
        ("time.ned=2us", ["time.ned: unknown key", "'end'", "--set time.ned=2us"]),
        ("time.end=2 mm", ["time.end", "expected a time", "--set time.end=2 mm"]),
        ("time.end", ["looks like time.end=2us"]),
        ("=3", ["looks like"]),
        ("a..b=3", ["looks like"]),
        ("time.end.x=3", ["time.end: has no keys", "'x'"]),
        ("bodies.projectile.velocity.7=3", ["bodies.projectile.velocity: has no entry '7'", "2 entries"]),
        ("bodies.target.material=alu", ["bodies.target.material: unknown 'alu'", "--set"]),
        ("time.end=[1", ["time.end: is not valid YAML", "--set"]),
        ("time.end=!!python/name:os.system x", ["tag"]),
        ("resolution=\udc80", ["Unicode"]),
        ("time=null", ["time: missing"]),
        ("tiem=null", ["tiem: unknown key", "'time'"]),
        ("time={ned: null}", ["time.ned: unknown key", "'end'"]),
        ("bodies.projectil=null", ["bodies.projectil", "found nothing"]),
        ("formulation={type:riemann}", ["formulation.type:riemann", "space after a colon: 'type: riemann'"]),
    ],
)
def test_bad_override_is_named(override, parts):
    with pytest.raises(CaseError) as caught:
        load_case("al_al", [override])
    for part in parts:
        assert part in str(caught.value), str(caught.value)
    assert "line" not in str(caught.value)


def test_resolution():
    assert load_case("al_al", resolution="0.2mm").resolution == 2e-4
    assert load_case("al_al", resolution=2e-4).resolution == 2e-4
    with pytest.raises(CaseError, match=r"resolution: .*--resolution 2 us"):
        load_case("al_al", resolution="2 us")
    with pytest.raises(CaseError, match=r"thinner than the kernel's support"):
        load_case("al_al", resolution="1 mm")


def test_base(tmp_path):
    write(tmp_path, "base.yaml", dump_case(load_case("al_al")))
    path = write(
        tmp_path,
        "sav2.yaml",
        """\
        base: base.yaml
        title: SAV2
        formulation: {viscosity: {alpha: 2.5, beta: 2.5}}
        expected: null
        """,
    )
    case = load_case(path)
    assert (case.title, case.formulation.viscosity.alpha, case.kinematics) == ("SAV2", 2.5, "plane_strain")
    assert not list(case.expected.items())
    con = write(tmp_path, "con.yaml", "base: sav2.yaml\nformulation: {type: riemann, reconstruction: none}\n")
    assert load_case(con).formulation.reconstruction == "none"


def test_an_error_names_the_file_that_holds_it(tmp_path):
    write(tmp_path, "base.yaml", dump_case(load_case("al_al")).replace("cfl: 0.6", "cfl: 3"))
    path = write(tmp_path, "row.yaml", "base: base.yaml\n\nformulation: {viscosity: {alhpa: 1}}\n")
    with pytest.raises(CaseError) as caught:
        load_case(path)
    assert "base.yaml, line" in str(caught.value)
    assert "row.yaml, line 3)" in str(caught.value)


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("base: row.yaml", "leads back"),
        ("base: missing.yaml", "no case file"),
        ("base: [1]", "expected the path"),
        ("base: ''", "base:"),
        ('base: "a\\0b"', "base:"),
    ],
)
def test_bad_base(tmp_path, text, part):
    path = write(tmp_path, "row.yaml", text + "\n")
    with pytest.raises(CaseError, match=part) as caught:
        load_case(path)
    assert "row.yaml, line 1" in str(caught.value)


@pytest.mark.parametrize("name", bundled_cases())
def test_dump_loads_to_an_equal_case(name):
    case = load_case(name)
    text = dump_case(case)
    assert reloaded(text) == case
    assert dump_case(reloaded(text)) == text


@pytest.mark.parametrize(
    "title",
    ["1e9", "null", "yes", "tRue", "1:30", "010", "a: b", "- x", "é\x85\t\n", "", "#", "~", ".5", "0x1F"],
)
def test_dump_keeps_text_as_text(title):
    case = load_case(parse(bundled_cases()["al_al_coarse"].read_text(), "x").value | {"title": title})
    assert reloaded(dump_case(case)).title == title


def test_dump_writes_every_default():
    text = dump_case(load_case("al_al"))
    for key in (
        "h_over_dx: 1.4",
        "integrator: leapfrog",
        "arrangement: square",
        "momentum_form",
        "history_every: 1",
    ):
        assert key in text


HOSTILE = {
    "alias bomb": "a: &a [x,x,x,x,x,x,x,x,x,x]\n"
    + "".join(f"{chr(98 + n)}: &{chr(98 + n)} [{','.join(['*' + chr(97 + n)] * 10)}]\n" for n in range(9)),
    "deep": "a: " + "[" * 900_000,
    "deep block": "\n".join(" " * n + "a:" for n in range(300)),
    "recursive": "a: &a {b: *a}",
    "tab": "a:\n\t- b",
    "two documents": "a: 1\n---\nb: 2",
    "list": "- 1\n- 2",
    "scalar": "hello",
    "empty": "",
    "only comment": "# nothing",
    "null byte": "a: \0",
    "many keys": "".join(f"k{n}: 1\n" for n in range(60_000)),
    "long number": "resolution: " + "9" * 100_000,
    "long key": "x" * 100_000 + ": 1",
    "tag": "!!set {a, b}",
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_text(tmp_path, name):
    path = write(tmp_path, "case.yaml", "")
    path.write_text(HOSTILE[name], encoding="utf-8")
    start = time.perf_counter()
    with pytest.raises(CaseError) as caught:
        load_case(path)
    # none may hang; the largest takes 0.2 s on a free machine, so this fails for no load
    assert time.perf_counter() - start < 60.0
    assert len(str(caught.value)) < 10_000


def test_hostile_files(tmp_path):
    folder = tmp_path / "folder"
    folder.mkdir()
    with pytest.raises(CaseError, match="is a folder"):
        load_case(folder)
    with pytest.raises(CaseError, match="no case file"):
        load_case(tmp_path / "missing.yaml")
    big = tmp_path / "big.yaml"
    big.write_bytes(b"#" * 1_000_001)
    with pytest.raises(CaseError, match="larger than 1 MB"):
        load_case(big)
    latin = tmp_path / "latin.yaml"
    latin.write_bytes("a: 1\ntitle: é\n".encode("latin-1"))
    with pytest.raises(CaseError, match=r"UTF-8.*line 2"):
        load_case(latin)
    with pytest.raises(CaseError):
        load_case("a\0b")
    with pytest.raises(CaseError):
        load_case("x" * 10_000)
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(CaseError, match="not a regular file"):
        load_case(pipe)


def test_byte_order_mark_and_windows_lines(tmp_path):
    path = tmp_path / "case.yaml"
    text = bundled_cases()["al_al_coarse"].read_text(encoding="utf-8")
    path.write_bytes(b"\xef\xbb\xbf" + text.replace("\n", "\r\n").encode())
    assert load_case(path) == load_case("al_al_coarse")


def test_bad_mappings():
    loop: dict = {}
    loop["a"] = loop
    for source in (loop, {1: 2}, {"a": object()}, {"a": {3: 4}}, 7, None, ["x"]):
        with pytest.raises(CaseError):
            load_case(source)


def test_a_sweep_is_no_case():
    with pytest.raises(CaseError, match="is a sweep, not a case: `hvisph sweep FILE`"):
        load_case({"case": "al_al", "vary": {"type": "grid", "values": {"resolution": ["0.2 mm"]}}})
