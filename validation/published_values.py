"""What the papers print for the impacts of a cylinder on a plate at 3.1 km/s, 8 us after contact.

The tables are given in the papers' own units, centimetres to one decimal and gigapascals, and read in SI.
Names of rows are those of the bundled cases below ``cases/published``; `howell_ball` is the
free-Lagrange Godunov scheme with which the papers compare the others.

Sources:
Howell & Ball 2002 (`howell_ball`) and Mehra & Chaturvedi 2006 (SAV, BAL, MON, CON), as quoted by
Farahani 2009, Tables 2 and 3, and by Young 2021, Table 1, who add their own. Centre pressures of the
first are in the text of Farahani 2009, section 6.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

CM, GPA = 1e-2, 1e9
FARAHANI_2, FARAHANI_3 = "Farahani 2009 Table 2", "Farahani 2009 Table 3"
YOUNG_1 = "Young 2021 Table 1"

# Tolerances of printed values: no single definition of the lengths fits every published method within 1 mm.
# Pressures: share of the value.
LENGTH_TOLERANCE = {"crater_diameter": 0.2 * CM, "extension": 0.1 * CM, "penetration": 0.1 * CM}
PRESSURE_TOLERANCE = 0.12

COLUMNS = {"d_cra": ("crater_diameter", CM), "L_ext": ("extension", CM), "L_proj": ("penetration", CM),
           "P": ("centre_pressure_peak", GPA)}  # fmt: skip

# Table, impact, columns, and a line a row; a dash where the paper prints nothing.
TABLES = {
    (FARAHANI_2, "al_al"): """
        row                           d_cra  L_ext  L_proj  P
        projection                    1.9    0.7    1.9     -
        sav1                          2.0    0.7    1.8     -
        sav2                          1.9    0.7    1.8     -
        bal                           2.0    0.7    1.8     -
        mon                           2.0    0.8    2.0     -
        con                           2.1    0.7    1.9     -
        howell_ball                   1.9    0.7    2.0     18.6
        """,
    (FARAHANI_3, "steel_al"): """
        row                           d_cra  L_proj  P
        projection                    1.5    2.2     -
        sav1                          1.9    2.1     -
        sav2                          1.9    2.1     -
        bal                           1.8    2.2     -
        mon                           1.8    2.2     -
        con                           1.7    2.2     -
        howell_ball                   1.6    2.3     27.9
        """,
    (YOUNG_1, "al_al"): """
        row                           P      d_cra  L_ext  L_proj
        howell_ball                   18.6   1.9    0.7    2.0
        sav1                          19.4   2.1    0.6    1.9
        sav1_artificial_stress        19.4   2.1    0.6    1.9
        sav1_contact                  19.5   2.2    0.6    1.9
        sav1_mixed                    19.5   2.1    0.7    2.0
        sav1_mixed_artificial_stress  19.5   2.1    0.8    2.0
        adaptle                       20.9   2.2    0.7    1.9
        """,
}


@dataclass(frozen=True)
class Published:
    """One printed number.

    `impact`, `row`: ``al_al`` or ``steel_al``, and name of the row.
    `measure`: name of the measure.
    `value`, `tolerance`: value and tolerance in SI.
    `source`: the table.
    """

    impact: str
    row: str
    measure: str
    value: float
    tolerance: float
    source: str


def published_values(impact: str = "", row: str = "", source: str = "") -> Iterator[Published]:
    """Yield what is printed, in the order of the tables; all of it where no impact, row or table is named."""
    for (table, target), text in TABLES.items():
        if impact in ("", target) and source in ("", table):
            head, *lines = (line.split() for line in text.strip().splitlines())
            for name, *cells in lines:
                if row in ("", name):
                    yield from _row(target, name, table, dict(zip(head[1:], cells, strict=True)))


def tolerance(measure: str, value: float) -> float:
    """Return the tolerance of a printed `value` of a measure, in its unit."""
    return LENGTH_TOLERANCE.get(measure, PRESSURE_TOLERANCE * abs(value))


def _row(impact: str, name: str, table: str, cells: dict[str, str]) -> Iterator[Published]:
    for column, cell in cells.items():
        if cell != "-":
            measure, unit = COLUMNS[column]
            value = float(cell) * unit
            yield Published(impact, name, measure, value, tolerance(measure, value), table)
