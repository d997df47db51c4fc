"""Quantities: values, dimensions, messages, and the short table of units against pint."""

import contextlib
import subprocess
import sys

import pint
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

from hvisph.case.units import (
    ANGLE,
    COMMON_UNITS,
    DENSITY,
    HEAT_CAPACITY,
    LENGTH,
    NUMBER,
    PRESSURE,
    RATE,
    TEMPERATURE,
    TIME,
    VELOCITY,
    Length,
    Number,
    PositiveLength,
    parse_quantity,
)

REGISTRY = pint.UnitRegistry()


@pytest.mark.parametrize(
    ("text", "dimension", "value"),
    [
        ("0.1 mm", LENGTH, 1e-4),
        ("0.1mm", LENGTH, 1e-4),
        (" 50.1 mm ", LENGTH, 0.0501),
        ("1 inch", LENGTH, 0.0254),
        ("-3e-1 m", LENGTH, -0.3),
        ("7", LENGTH, 7.0),
        ("3.1 km/s", VELOCITY, 3100.0),
        ("3.1 km / s", VELOCITY, 3100.0),
        ("27.6 GPa", PRESSURE, 27.6e9),
        ("1 N/mm^2", PRESSURE, 1e6),
        ("2.785 g/cm**3", DENSITY, 2785.0),
        ("875 J/(kg K)", HEAT_CAPACITY, 875.0),
        ("875 J/kg/K", HEAT_CAPACITY, 875.0),
        ("20 degC", TEMPERATURE, 293.15),
        ("0.01 1/us", RATE, 1e4),
        ("1000 Hz", RATE, 1000.0),
        ("3.141592653589793 rad", ANGLE, 180.0),
        ("8 µs", TIME, 8e-6),
        (".5", NUMBER, 0.5),
        ("1_000", NUMBER, 1000.0),
    ],
)
def test_value_in_si(text, dimension, value):
    # hertz: pint reads it as cycles, 1/s; the tolerance is that of one float product
    assert parse_quantity(text, dimension) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize("text", ["3.1 km/s", "27.6 GPa", "0.1 mm", "0.979 GPa", "50.1 mm", "5.33 mm/us"])
def test_usual_units_give_the_nearest_float(text):
    """A product in floats would be one ulp off for 27.6 GPa, so equal cases would compare unequal."""
    number, unit = text.split()
    dimension, factor = COMMON_UNITS[unit]
    exponent = factor.adjusted()
    assert parse_quantity(text, dimension) == float(f"{number}e{exponent}")


@pytest.mark.parametrize("unit", COMMON_UNITS)
def test_short_table_agrees_with_pint(unit):
    dimension, factor = COMMON_UNITS[unit]
    if unit in ("kg/m3", "g/cm3"):  # pint wants the power sign
        unit = unit.replace("m3", "m^3")
    assert float(factor) == pytest.approx(REGISTRY.Quantity(1.0, unit).to(dimension.unit).magnitude, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "dimension", "parts"),
    [
        ("3 us", LENGTH, ["is a time", "expected a length", "0.1 mm"]),
        ("3 kg", LENGTH, ["is a mass", "expected a length", "0.1 mm"]),
        ("3 lightyear/s", PRESSURE, ["not a pressure", "27.6 GPa"]),
        ("3 mmm", LENGTH, ["unknown unit 'mmm'", "did you mean 'mm'?"]),
        ("mm", LENGTH, ["not a length"]),
        ("0,1 mm", LENGTH, ["unknown unit"]),
        ("3 mm", NUMBER, ["is a length", "expected a number"]),
        ("", LENGTH, ["not a length"]),
        ("nan", LENGTH, ["not a length"]),
        ("9**9**9**9 m", LENGTH, ["unknown unit"]),
        ("1 m**9**9**9", LENGTH, ["unknown unit"]),
        ("1 m.__class__", LENGTH, ["unknown unit"]),
        ("1 __import__('os')", LENGTH, ["unknown unit"]),
        ("1 " + "a" * 5000, LENGTH, ["not a length", "..."]),
        ("1 " + "ab" * 30 + "!", LENGTH, ["unknown unit"]),
        ("1 (((((m", LENGTH, ["unknown unit"]),
    ],
)
def test_message_names_dimension_and_remedy(text, dimension, parts):
    with pytest.raises(ValueError) as caught:
        parse_quantity(text, dimension)
    for part in parts:
        assert part in str(caught.value)
    assert len(str(caught.value)) < 400


@pytest.mark.parametrize(
    ("kind", "value", "part"),
    [
        (Length, True, "expected a length, found true/false"),
        (Length, None, "found nothing"),
        (Length, [1.0], "found a list"),
        (Length, float("nan"), "finite"),
        (Length, float("inf"), "finite"),
        (Length, "1e999 m", "finite"),
        (Length, 10**400, "too large"),
        (PositiveLength, 0, "must be above 0"),
        (PositiveLength, "-1 mm", "must be above 0"),
        (Number, "fast", "not a number"),
    ],
)
def test_bad_values(kind, value, part):
    with pytest.raises(ValidationError, match=part):
        TypeAdapter(kind).validate_python(value)


@settings(max_examples=60, deadline=None)
@given(
    st.floats(-1e12, 1e12, allow_nan=False),
    st.sampled_from([u for u in COMMON_UNITS if u not in ("kg/m3", "g/cm3")]),
)
def test_round_trip(number, unit):
    dimension, factor = COMMON_UNITS[unit]
    si = parse_quantity(f"{number!r} {unit}", dimension)
    assert si / float(factor) == pytest.approx(number, rel=1e-14, abs=1e-300)
    assert parse_quantity(f"{si!r}", dimension) == si


@settings(max_examples=150, deadline=None)
@given(st.text(max_size=60))
def test_any_text_is_a_number_or_a_value_error(text):
    with contextlib.suppress(ValueError):
        parse_quantity(f"1 {text}", LENGTH)


def test_usual_cases_need_neither_pint_nor_numba():
    """Importing pint and building its registry would take a third of the second that `check` may take."""
    code = (
        "import sys, hvisph.casefile.loader as l, hvisph.casefile.manual\n"
        "for name in l.bundled_cases(): l.load_case(name)\n"
        "l.library()\n"
        "print(sorted({'pint', 'numba', 'typer', 'h5py'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
