"""Gas behind a metal wall that is struck: smoothing lengths that follow density on both sides of a contact."""

from itertools import pairwise

import numpy as np
import pytest
from small_runs import final

from hvisph.casefile.loader import load_case
from hvisph.compiler.jit import python_twin
from hvisph.materials.eos import tillotson
from hvisph.materials.material_table import Material, pack
from hvisph.setup.build import build
from hvisph.simulation.run import run
from hvisph.sph.kernels import CUBIC_SPLINE
from hvisph.sph.terms import grad_h


@pytest.mark.parametrize("density", [59.4, 1.19], ids=["50_bar", "1_bar"])
def test_the_balances(density, tmp_path):
    """Every pair in contact is in the lists of both sides: energy and momentum are balanced to round-off.

    The ball's spacing is fitted to its size, so that the contact takes unequal smoothing lengths.
    """
    case = load_case({
        "kinematics": "plane_strain", "resolution": 0.25e-3,
        "bodies": {
            "ball": {"material": "aluminium-6061-t6", "shape": {"type": "disc", "diameter": 2e-3},
                     "velocity": [5000.0, 0.0]},
            "wall": {"material": "aluminium-6061-t6", "shape": {"type": "box", "size": [1.5e-3, 6e-3]}},
            "air": {"material": {"density": density, "eos": {"type": "ideal_gas", "gamma": 1.4}},
                    "internal_energy": 2.1e5, "shape": {"type": "box", "size": [4e-3, 6e-3]}},
        },
        "time": {"end": 1e-6}, "output": {"every": 1e-6},
    })  # fmt: skip
    conservation = run(case, tmp_path / "run").summary["conservation"]
    assert abs(conservation["energy_drift"]) < 1e-12
    assert abs(conservation["momentum_drift"]) < 1e-12


def struck(density, end):
    """A disc of 2 mm at 5 km/s on a wall of 1.6 mm with air behind it."""
    return load_case({
        "kinematics": "plane_strain", "resolution": 0.2e-3,
        "bodies": {
            "ball": {"material": "aluminium-6061-t6", "shape": {"type": "disc", "diameter": 2e-3},
                     "velocity": [5000.0, 0.0]},
            "wall": {"material": "aluminium-6061-t6", "shape": {"type": "box", "size": [1.6e-3, 12e-3]}},
            "air": {"material": {"density": density, "eos": {"type": "ideal_gas", "gamma": 1.4}},
                    "internal_energy": 2.1e5, "shape": {"type": "box", "size": [10e-3, 12e-3]}},
        },
        "time": {"end": end}, "output": {"every": end},
    })  # fmt: skip


@pytest.mark.parametrize("density", [59.4, 1.19], ids=["50_bar", "1_bar"])
@pytest.mark.parametrize("end", [5.3e-6, pytest.param(30e-6, marks=pytest.mark.slow)])
def test_thin_debris_beside_the_gas_goes_on(density, end, tmp_path):
    """By 3 us debris has thinned to a tenth of its density, and gas among it at 5 us to a tenth of its own.

    Energy is balanced and none of it is negative but for 1e-10 in elastic waves ahead of the shock.
    """
    outcome = run(struck(density, end), tmp_path / "run")
    assert outcome.exit_code == 0
    assert abs(outcome.summary["conservation"]["energy_drift"]) < 1e-12
    fields = final(tmp_path / "run").fields
    energy = fields["mass"] * fields["internal_energy"]
    assert -energy[energy < 0.0].sum() < 1e-6 * energy.sum()


@pytest.mark.parametrize("density", [59.4, 1.19], ids=["50_bar", "1_bar"])
def test_a_gas_pushes_the_wall_as_its_exact_solution(density, tmp_path):
    """Before the rarefaction of the open end arrives, p at the wall is that on a receding piston (Riemann).

    dU/dt = p(U)/m, p = p0 (1 - (gamma - 1)/2 U/c)^(2 gamma/(gamma - 1)); the wall has m = 4.3 kg/m^2.
    """
    end, mass, steps = 8e-6, 2703.0 * 1.6e-3, 4000
    case = load_case({
        "kinematics": "uniaxial_strain", "resolution": 0.1e-3,
        "bodies": {
            "wall": {"material": "aluminium-6061-t6", "shape": {"type": "interval", "length": 1.6e-3}},
            "air": {"material": {"density": density, "eos": {"type": "ideal_gas", "gamma": 1.4}},
                    "internal_energy": 2.1e5, "shape": {"type": "interval", "length": 10e-3}},
        },
        "time": {"end": end}, "output": {"every": end},
    })  # fmt: skip
    run(case, tmp_path / "run")
    state = final(tmp_path / "run")
    p0, c, speed, impulse = 0.4 * density * 2.1e5, (1.4 * 0.4 * 2.1e5) ** 0.5, 0.0, 0.0
    for _ in range(steps):
        p = p0 * (1.0 - 0.2 * speed / c) ** 7
        speed, impulse = speed + p * end / steps / mass, impulse + p * end / steps
    gas, wall = ((state.fields["mass"] * state.fields["velocity"][:, 0])[state.body == k].sum() for k in (1, 0))
    assert gas == pytest.approx(impulse, rel=0.02)  # half a spacing of the wave's way of 3 mm
    assert wall == pytest.approx(-impulse, rel=0.02)


def test_bounds_of_smoothing_lengths_are_those_of_each_material():
    material = {"density": 1.19, "eos": {"type": "ideal_gas", "gamma": 1.4}}
    bodies = {
        "fine": {"material": "aluminium-6061-t6", "shape": {"type": "interval", "length": 2e-3}},
        "air": {
            "material": material,
            "shape": {"type": "interval", "length": 8e-3},
            "resolution": 0.8e-3,
            "internal_energy": 2.1e5,
        },
    }
    setup = build(load_case({"kinematics": "uniaxial_strain", "resolution": 0.1e-3, "bodies": bodies,
                             "time": {"end": 1e-6}}))  # fmt: skip
    assert setup.materials[0] == "aluminium-6061-t6"
    assert setup.stepper.h_limits == pytest.approx(1.2e-3 * np.array([[0.01, 0.4], [0.08, 3.2]]), rel=1e-9)


# 20 MJ/kg vaporise aluminium; a, E0, alpha, beta and both energies of nylon, of basalt: those of cloths.
VAPOURS = {
    "aluminium": (2700.0, 2e7, tillotson.Tillotson(75.2e9, 65e9, 0.5, 1.63, 5e6, 5.0, 5.0, 3e6, 13.9e6)),
    "aramid": (1440.0, 8e6, tillotson.Tillotson(12.7e9, 19.7e9, 0.6, 0.3, 7e6, 10.0, 5.0, 2e6, 2.4e6)),
    "nextel": (2750.0, 4e7, tillotson.Tillotson(100e9, 110e9, 0.5, 0.5, 487e6, 5.0, 5.0, 4.72e6, 18.2e6)),
}


@pytest.mark.parametrize("name", VAPOURS)
def test_vapour_expands_along_its_isentrope(name, tmp_path):
    """Half of a hot slab expands to the twentieth of its density where h follows, and to half where it is fixed.

    Energy at the density reached is that of de = p drho/rho^2; 3 %: heat of the fronts of neighbours that part.
    """
    density, hot, eos = VAPOURS[name]
    names = {"capital_b": "b_modulus", "small_a": "a", "small_b": "b"}
    given = {names.get(key, key): value for key, value in vars(eos).items()}
    state, row = python_twin(tillotson.state), pack([Material(name, density, eos)])[0][0]
    follow = {"smoothing_length": {"type": "variable", "min_over_initial": 1.0, "max_over_initial": 10.0},
              "conserve_angular_momentum": False}  # fmt: skip
    # Far from all else: with it the slab has the loops of bodies that meet.
    far = {"far": {"material": "aluminium-tillotson", "shape": {"type": "interval", "length": 1e-3}, "position": [1.0]}}
    kinetic = []
    for k, (options, more) in enumerate(((follow, {}), ({}, far))):
        case = load_case({
            "kinematics": "uniaxial_strain", "resolution": 0.1e-3, "formulation": {"type": "riemann"} | options,
            "bodies": {"slab": {"material": {"density": density, "eos": {"type": "tillotson"} | given,
                                             "damage": {"type": "pressure_cutoff", "pressure": -1e9}},
                                "shape": {"type": "interval", "length": 2e-3}, "position": [0.0],
                                "internal_energy": hot}} | more,
            "symmetry": [{"axis": "x", "at": 0.0, "keep": "above"}], "time": {"end": 10e-6}, "output": {"every": 10e-6},
        })  # fmt: skip
        run(case, tmp_path / str(k))
        fields = final(tmp_path / str(k)).fields
        middle = np.argmin(fields["position"][:, 0])
        thin, e = fields["density"][middle], hot
        steps = np.geomspace(density, thin, 4000)
        for rho, following in pairwise(steps.tolist()):
            half = e + state(rho, e, row)[0] / rho**2 * 0.5 * (following - rho)
            e += state(0.5 * (rho + following), half, row)[0] / (rho * following) * (following - rho)
        assert fields["internal_energy"][middle] == pytest.approx(e, rel=0.03)
        assert (thin < 0.06 * density) if k == 0 else (thin > 0.3 * density)
        kinetic.append((fields["mass"] * fields["velocity"][:, 0] ** 2).sum())
    assert kinetic[0] > 1.3 * kinetic[1]


def test_omega_is_positive_for_any_neighbours():
    """The rate by the own kernel is d times the mean of (u_b - u_a) . e/r, weighed by q |w'|, whatever the volume.

    Neighbours at random, and at the edge of the kernel alone.
    """
    shape, slope, generator = CUBIC_SPLINE.shape.py_func, CUBIC_SPLINE.slope.py_func, np.random.default_rng(3)
    of = {"DIM": 2, "scale": lambda inverse: inverse**3, "shape": shape, "slope": slope, "OMEGA_MIN": grad_h.OMEGA_MIN}
    sums, rate = (type(one)(one.__code__, of | {"max": max}) for one in (grad_h.grad_h_sums, grad_h.grad_h_rate))
    for near in (generator.uniform(0.2, 1.9, 12), np.array([1.2, 1.3]), np.array([1.95])):
        h = 1.3
        r, jumps = h * near, generator.normal(size=len(near))
        parts = np.array([sums(h, *one, 0.0) for one in zip(r, np.ones(len(r)), jumps, strict=True)]).sum(axis=0)
        _, own, kernel, slopes = parts
        weights = np.array([-q * slope(q) for q in near])
        n, omega = kernel + shape(0.0) / h**2, (weights / h**2).sum() / 2.0
        expected = 2.0 * (weights * jumps / r).sum() / weights.sum() * min(omega / n / grad_h.OMEGA_MIN, 1.0)
        for volume in (1.0 / n, 20.0 / n):  # more than that of the number density counts as that
            assert rate(h, volume, 0.0, -own, kernel, slopes, 1.0) == pytest.approx(expected, rel=1e-12)


def test_a_wall_takes_the_work_of_the_gas_that_strains_it(tmp_path):
    """Gas that a piston of 3 km/s presses on a wall to 6 GPa: a fifth of the wall's own volume in each particle.

    Negative energies are 4e-6 of the energy; 4e-4, and a tenth of them in the plane, if such particles counted as much
    in the strain of the wall as its own.
    """
    bodies = {
        "piston": {"material": "aluminium-6061-t6", "shape": {"type": "interval", "length": 2e-3}, "velocity": [3e3]},
        "air": {"material": {"density": 59.4, "eos": {"type": "ideal_gas", "gamma": 1.4}},
                "internal_energy": 2.1e5, "shape": {"type": "interval", "length": 6e-3}},
        "wall": {"material": "aluminium-6061-t6", "shape": {"type": "interval", "length": 3e-3}},
    }  # fmt: skip
    run(load_case({"kinematics": "uniaxial_strain", "resolution": 0.2e-3, "bodies": bodies, "time": {"end": 2e-6},
                   "output": {"every": 1e-6}}), tmp_path / "run")  # fmt: skip
    state = final(tmp_path / "run")
    energy = state.fields["mass"] * state.fields["internal_energy"]
    assert state.fields["pressure"][state.body == 1].max() > 5e9
    assert -energy[energy < 0.0].sum() < 2e-5 * energy.sum()
