"""Tables of planetary codes: written in each layout from a Mie-Grueneisen equation of state, and read back."""

from dataclasses import replace

import numpy as np
import pytest

from hvisph.case.materials.material import Material as MaterialModel
from hvisph.core.errors import CaseError
from hvisph.materials.eos import StiffenedGas, check_units, read_table
from hvisph.materials.material_table import Material
from hvisph.setup.materials import material_of

RHO0, SPEED, GAMMA, HEAT = 2700.0, 5300.0, 2.0, 900.0
RHO = np.concatenate([np.geomspace(50.0, 1800.0, 20), np.linspace(1900.0, 6000.0, 150)])
T = np.concatenate([[1.0], np.geomspace(20.0, 5e4, 120)])
E = HEAT * T


def pressure(rho, e):
    """p of a stiffened gas [Pa], whose energy is all heat here."""
    return SPEED**2 * (rho - RHO0) + (GAMMA - 1.0) * rho * e


def five_a_line(numbers):
    return "\n".join("".join(f"{x:16.8E}" for x in numbers[k : k + 5]) for k in range(0, len(numbers), 5))


def aneos(fields=3, scale=1.0):
    rho, e = np.meshgrid(RHO, E)  # density fastest
    body = [pressure(rho, e) * 1e-9, e * 1e-6, 0.0 * e, 0.0 * e][:fields]
    numbers = np.concatenate([[len(RHO), len(T)], RHO * 1e-3 * scale, T, *(one.ravel() for one in body)])
    head = [" INDEX      MATID =   1  NWDS = 9", five_a_line(np.ones(5)), five_a_line(np.ones(4)),
            " RECORD     TYPE =  201     NWDS =        5", five_a_line(np.ones(5)),
            f" RECORD     TYPE =  301     NWDS = {len(numbers)}"]  # fmt: skip
    return "\n".join(head) + "\n" + five_a_line(numbers) + "\n"


def miluphcuda(scale=1.0):
    rows = [f"{r:.9e} {e:.9e} {scale * pressure(r, e):.9e} {e / HEAT:.9e} 0 0 0" for r in RHO for e in E]
    return "# a\n# b\n# c\n" + "\n".join(rows)


def gadget():
    """The temperature along an entropy rises with the density: T = T_0(S) (rho/rho0)^(gamma - 1)."""
    rho, of_s = np.meshgrid(RHO, T)
    t = of_s * (rho / RHO0) ** (GAMMA - 1.0)
    fields = [pressure(rho, HEAT * t) * 10.0, t, HEAT * t * 1e4, 0.0 * t]
    numbers = np.concatenate([RHO * 1e-3, HEAT * np.log(T) * 1e4, *(one.ravel() for one in fields)])
    return f"{len(RHO)} {len(T)}\n" + "\n".join(f"{x:.9e}" for x in numbers)


def woma():
    rows = [f"{e:.9e} {pressure(r, e):.9e} 1 1" for e in E for r in RHO]
    axes = [" ".join(f"{x:.9e}" for x in axis) for axis in (RHO, T)]
    return "\n".join(["# comment"] * 12 + ["20200101", f"{len(RHO)} {len(T)}", *axes, *rows])


@pytest.mark.parametrize("write", [aneos, miluphcuda, gadget, woma])
def test_a_table_is_read_back_as_it_was_written(write, tmp_path):
    path = tmp_path / "table.txt"
    path.write_text(write())
    grid = read_table(path)
    assert grid == read_table(path, write.__name__)
    check_units(grid, RHO0)
    keys = {"name": "t", "density": RHO0, "eos": {"type": "table", "file": str(path), "format": write.__name__}}
    table, exact = material_of(MaterialModel.model_validate(keys)), Material("x", RHO0, StiffenedGas(SPEED, GAMMA))
    # nine digits are written; e(T) through 120 points of a straight line; gadget's T bends between its densities
    assert grid.energy_at(RHO0, 300.0) == pytest.approx(HEAT * 300.0, rel=1e-3)
    for rho, e in ((2500.0, 3e5), (2700.0, 1e5), (3300.0, 2e6), (1500.0, 1.5e7)):
        scale = RHO0 * SPEED**2
        # p is a plane in (rho, e); the bicubic cells in ln rho are 0.01 wide, so that errors are of order 1e-5 of K
        assert table.pressure(rho, e) == pytest.approx(pressure(rho, e), abs=1e-4 * scale)
        assert table.sound_speed_squared(rho, e) == pytest.approx(exact.sound_speed_squared(rho, e), rel=1e-2)


def test_units_that_are_off_are_named(tmp_path):
    path = tmp_path / "table.txt"
    path.write_text(aneos(scale=1e3))
    with pytest.raises(CaseError, match=r"10\^3 times the material's density 2700: likely g/cm\^3"):
        check_units(read_table(path), RHO0)
    path.write_text(miluphcuda(scale=1e-9))
    with pytest.raises(CaseError, match=r"bulk modulus of 75.* Pa .*likely pressures in GPa"):
        check_units(read_table(path), RHO0)
    for factor, words in ((1e-6, r"heat capacity of 0\.\d+ J"), (1e4, r"heat capacity of \d\S*e\+0[67] J")):
        path.write_text(aneos())
        grid = read_table(path)
        with pytest.raises(CaseError, match=words + ".*likely energies in MJ/kg or erg/g"):
            check_units(replace(grid, energy=factor * grid.energy), RHO0)


@pytest.mark.parametrize(
    ("text", "words"), [(None, "no such file"), ("density,temperature,pressure,energy\n", "0 densities")]
)
def test_the_place_of_a_table_is_named(text, words, tmp_path):
    path = tmp_path / "rock.csv"
    if text is not None:
        path.write_text(text)
    keys = {"name": "t", "density": RHO0, "eos": {"type": "table", "file": str(path)}}
    with pytest.raises(CaseError, match=rf"^eos\.file: .*{words}.*rock\.csv"):
        material_of(MaterialModel.model_validate(keys))


def test_what_is_no_table_of_pressure_is_refused(tmp_path):
    for name in ("ANEOS.INPUT", "granite.aneos"):
        (tmp_path / name).write_text("x")
        with pytest.raises(CaseError, match="is the input of ANEOS, not a table"):
            read_table(tmp_path / name)
    path = tmp_path / "NEW-SESAME-EXT.TXT"
    path.write_text(aneos(fields=4))
    with pytest.raises(CaseError, match="holds entropy and sound speed, not pressure"):
        read_table(path)
    for write in (aneos, miluphcuda, gadget, woma):
        text = write()
        path.write_text(text[: text.rstrip().rindex("\n")])  # its last line is missing
        with pytest.raises(CaseError, match="does not fit|cannot be read"):
            read_table(path, write.__name__)
    path.write_text(gadget()[:-200])
    with pytest.raises(CaseError, match="no table 301 in it; if another program wrote it, give its `format`: aneos, "):
        read_table(path)
