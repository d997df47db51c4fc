"""Rings about an axis: the compiled laws against plain sums over every pair, from the formulas."""

from dataclasses import replace

import numpy as np
import pytest
from sph_twins import neighbours, packed, random_cloud

from hvisph.schemes.riemann.scheme import Riemann
from hvisph.schemes.standard.options import MonaghanViscosity
from hvisph.schemes.standard.scheme import Eulerian
from hvisph.sph.kernels import KERNELS
from hvisph.sph.neighbours import particle_layout as places
from hvisph.sph.neighbours.ghost_rows import AXIS
from hvisph.sph.terms.limiters import LIMITERS

LAWS = {
    "standard": Eulerian(viscosity=MonaghanViscosity(1.3, 2.1), axisymmetric=True),
    "density by mass": Eulerian(viscosity=MonaghanViscosity(1.3, 2.1), mass_form=True, axisymmetric=True),
    "contact": Riemann(reconstruction=LIMITERS["none"], corrected_variant=False, axisymmetric=True),
}


APART = 1.3


def viscous_pair(cloud, formulation, a, b, gradient):
    """Return force over m_b, what of it does the own work, and half of the viscosity, of a pair of the standard law."""
    x, u = cloud.x[a] - cloud.x[b], cloud.u[a] - cloud.u[b]
    h, c = 0.5 * (cloud.h[a] + cloud.h[b]), 0.5 * (cloud.c[a] + cloud.c[b])
    mu = min(h * u @ x / (x @ x + 0.01 * h**2), 0.0)
    pressed = (-formulation.viscosity.alpha * c * mu + formulation.viscosity.beta * mu**2) * 2.0
    pressed = pressed / (cloud.rho[a] + cloud.rho[b]) * np.eye(2)
    own, other = (cloud.stress[k] / cloud.rho[k] ** 2 for k in (a, b))
    return (own + other - pressed) @ gradient, (own - 0.5 * pressed) @ gradient, -0.5 * pressed @ gradient


def contact(cloud, a, b, e):
    """Return u* - u_a and t* of the acoustic Riemann problem."""
    u, t = np.zeros(2), np.zeros(2)
    for part, speed in ((np.outer(e, e), cloud.c_l), (np.eye(2) - np.outer(e, e), cloud.c_t)):
        za, zb = cloud.rho[a] * speed[a], cloud.rho[b] * speed[b]
        ta, tb, jump = part @ cloud.stress[a] @ e, part @ cloud.stress[b] @ e, part @ (cloud.u[b] - cloud.u[a])
        u += (za * part @ cloud.u[a] + zb * part @ cloud.u[b] + tb - ta) / (za + zb)
        t += (zb * ta + za * tb + za * zb * jump) / (za + zb)
    return u - cloud.u[a], t


def ring_rates(cloud, hoop, formulation):
    """Return acceleration, power, gradient, rate of the circumference and what is added to that of ln(rho) of every ring."""
    count, whole, rows = len(cloud.x), cloud.with_image(1, 0.0), []
    for a in range(count):
        force, power, found, shape, by_mass = np.zeros(2), 0.0, np.zeros((2, 2)), np.zeros((2, 2)), 0.0
        r, rho = cloud.x[a, 1], cloud.rho[a]
        for b in neighbours(whole, formulation.kernel, a):
            x, image = whole.x[a] - whole.x[b], b >= count
            distance = np.linalg.norm(x)
            slope = formulation.kernel.derivative(distance, 0.5 * (whole.h[a] + whole.h[b]), 2)
            gradient, area = slope * x / distance, whole.m[b] / whole.rho[b]
            w = 0.5 * (1.0 + whole.x[b, 1] / r)
            radially = w * (cloud.u[a, 1] - whole.u[b % count, 1])  # of the two real rings
            if isinstance(formulation, Eulerian):
                pair, own, halved = viscous_pair(whole, formulation, a, b, gradient)
                pair, own = whole.m[b] * pair, whole.m[b] * own
                closing = whole.u[a] - whole.u[b]
                half = whole.m[b] * halved  # of what dissipates: over the axis as over a mirror
                if image:
                    force[1] += (1.0 - 2.0 * w) * 2.0 * half[1]
                    power -= own[1] * radially + ((1.0 - w) * closing[1] - radially) * half[1]
                else:
                    power -= w * own @ closing
                found -= area * np.outer(closing, gradient)
                by_mass += (whole.m[b] / rho - area) * closing @ gradient
            else:
                e = -x / distance
                jump, traction = contact(whole, a, b, e)
                pair = -2.0 * area * slope * traction / rho
                power += -0.5 * pair[1] * radially if image else w * pair @ jump
                if image:  # what closes is braked
                    za, zb = whole.rho[a] * whole.c_t[a], whole.rho[b] * whole.c_t[b]
                    brake = za * zb / (za + zb) * min((whole.u[b] - whole.u[a]) @ e, 0.0) * e[1]
                    brake *= -2.0 * (1.0 - w) * area * slope / rho
                    force[1] += brake
                    power -= 0.5 * brake * (whole.u[a, 1] - whole.u[b, 1])
                found -= 2.0 * area * slope * np.outer(jump, e)
            force += w * pair * ((0.0, 1.0) if image else (1.0, 1.0))
            shape -= area * np.outer(x, gradient)
        leaning = np.clip(4.0 * shape[1, 1], 0.0, 1.0)  # a ring alone has no hoop
        hooped = leaning * ((1.0 - shape[1, 1]) * cloud.stress[a, 1, 1] - hoop[a]) / (rho * r)
        force[1] += hooped
        power -= hooped * cloud.u[a, 1]
        found, around = found @ np.linalg.inv(shape), leaning * cloud.u[a, 1] / r
        if isinstance(formulation, Eulerian):  # the same about the axis, and their sum as it is
            unlike = 0.5 * max(1.0 - r / cloud.h[a], 0.0) * (around - found[1, 1])
            found[1, 1], around = found[1, 1] + unlike, around - unlike
        rows.append([*force, power, *found.ravel(), around, by_mass])
    return np.array(rows)


@pytest.mark.parametrize("formulation", LAWS.values(), ids=LAWS)
def test_compiled_rates_of_rings_are_those_of_the_formulas(formulation):
    cloud = random_cloud(2)
    cloud.x[:, 1] = np.abs(cloud.x[:, 1]) + 0.3e-3
    # three that have left, too far apart for the whole of a hoop
    cloud.x[-3:] = [20e-3, 5e-3] + APART * cloud.h[-1] * np.array([[0.0, 0.0], [1.0, 0.0], [0.5, 0.87]])
    hoop = 1e9 * np.random.default_rng(8).normal(size=len(cloud.x))
    stored = hoop / cloud.rho**2 if isinstance(formulation, Eulerian) else hoop
    pairs = packed(cloud, formulation, (AXIS,), {"RING": cloud.x[:, 1], "HOOP": stored})
    pairs.evaluate(cloud.h.max())
    at, found = places.slots(2), pairs.rates[pairs.place[: len(cloud.x)]]
    chosen = [0, 1, at["R_POWER"], *range(at["R_GRADIENT"], at["R_GRADIENT"] + 4), at["R_HOOP"]]
    wanted = ring_rates(cloud, hoop, formulation)
    if isinstance(formulation, Eulerian) and formulation.mass_form:
        chosen.append(at["R_DENSITY"])
    wanted = wanted[:, : len(chosen)]
    # as of the laws in the plane: sums of up to 80 terms in another order; the inverse of the shape adds a digit
    assert np.all(np.abs(found[:, chosen] - wanted) <= 1e-11 * np.abs(wanted).max(axis=0))


def test_rings_about_a_hole_that_opens_keep_their_density():
    # what opens a hole of 3 spacings and keeps its density: r^2 = r_0^2 + (3 dx)^2, u_r = 1/r, sections of dx^2 r_0/r
    dx, count, tall = 1e-3, 12, 13
    start, along = np.meshgrid((np.arange(count) + 0.5) * dx, np.arange(tall) * dx)
    start, x = start.ravel(), along.ravel()
    r = np.hypot(start, 3 * dx)
    cloud = random_cloud(2)
    n, rho, c = len(r), 2700.0, 5000.0
    alike = {name: np.full(n, value) for name, value in {"rho": rho, "c": c, "c_l": c, "c_t": 0.6 * c}.items()}
    nothing = {name: np.zeros(n) for name in ("order", "grows", "heat", "leaves", "fades")}
    borne = {name: np.full(n, 1e9) for name in ("bear", "shear")}
    area = dx**2 * start / r
    cloud = replace(
        cloud, x=np.stack([x, r], 1), u=np.stack([0 * r, 10e-3 / r], 1), h=np.full(n, 1.2 * dx), m=rho * area,
        stress=np.zeros((n, 2, 2)), body=np.ones(n), face=np.zeros((n, 2)), twist=np.zeros((n, 1)), counts=area,
        **alike, **nothing, **borne)  # fmt: skip
    formulation = Riemann(kernel=KERNELS["quartic_spline"], h_over_dx=1.2, axisymmetric=True)
    pairs = packed(cloud, formulation, (AXIS,), {"RING": r, "HOOP": 0.0 * r, "REST_AREA": area})
    pairs.evaluate(cloud.h.max())
    at, found = places.slots(2), pairs.rates[pairs.place[:n]]
    in_plane = found[:, at["R_GRADIENT"]] + found[:, at["R_GRADIENT"] + 3] - found[:, at["R_DENSITY"]]
    whole = (x > 4 * dx) & (x < 8 * dx) & (start > 4 * dx) & (start < 9 * dx)  # beside neither face
    swells = (in_plane + found[:, at["R_HOOP"]])[whole] * r[whole] ** 2 / 10e-3
    # over the rate of the hoop: 0.016 is left of sums over uneven rows, 0.113 where each neighbour counts once
    assert np.all(np.abs(swells) < 0.03)
