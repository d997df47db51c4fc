"""Plain Python twins of the pair laws, written from the formulas, and clouds of particles to try them on."""

from dataclasses import dataclass, fields, replace

import numpy as np
from riemann_twin import about, ahead_twice, gradients_before, riemann_rates, torque

from hvisph.schemes.riemann.scheme import Riemann
from hvisph.schemes.standard.scheme import Eulerian
from hvisph.sph.neighbours.pairs import Pairs
from hvisph.sph.terms.shape_matrix import SINGULAR

H = 1.4e-3  # mean smoothing length of the random clouds [m]


@dataclass
class Cloud:
    """Particles with everything that a pair law may read; `stress` is (n, dim, dim)."""

    x: np.ndarray
    u: np.ndarray
    h: np.ndarray
    m: np.ndarray
    rho: np.ndarray
    c: np.ndarray
    c_l: np.ndarray
    c_t: np.ndarray
    stress: np.ndarray
    body: np.ndarray
    bear: np.ndarray
    shear: np.ndarray
    order: np.ndarray
    grows: np.ndarray
    face: np.ndarray
    twist: np.ndarray
    heat: np.ndarray
    counts: np.ndarray
    leaves: np.ndarray
    fades: np.ndarray

    @property
    def compression(self):
        """Volumetric compression from a density at rest, here 0.9 of the mean."""
        return np.maximum(1.0 - 0.9 * self.rho.mean() / self.rho, 0.0)

    @property
    def dim(self):
        return self.x.shape[1]

    def turned(self, rotation):
        """Return the cloud turned as a whole."""
        stress = rotation @ self.stress @ rotation.T
        x, u, face = (vectors @ rotation.T for vectors in (self.x, self.u, self.face))
        twist = np.linalg.det(rotation) * (self.twist @ rotation.T if self.dim == 3 else self.twist)
        return replace(self, x=x, u=u, face=face, stress=stress, twist=twist)

    def with_image(self, axis, at):
        """Return the cloud and its image at the plane normal to `axis` at coordinate `at`."""
        sign = np.where(np.arange(self.dim) == axis, -1.0, 1.0)
        image = self.turned(np.diag(sign))
        image.x[:, axis] += 2.0 * at
        return Cloud(*(np.concatenate([getattr(c, f.name) for c in (self, image)]) for f in fields(Cloud)))


def random_cloud(dim, seed=0, spacing=1e-3):
    """Return a disturbed lattice of two densities and many lengths h, moving and stressed at random."""
    rng = np.random.default_rng(seed)
    side = {1: 40, 2: 9, 3: 5}[dim]
    axes = [np.arange(side) * spacing] * dim
    x = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, dim)
    n = len(x)
    x = x + rng.normal(size=x.shape) * 0.1 * spacing
    stress = rng.normal(size=(n, dim, dim)) * 1e9
    rho = rng.choice([2785.0, 7900.0], n) * (1 + 0.05 * rng.normal(size=n))
    c = 5000.0 + 300.0 * rng.normal(size=n)
    u, h = rng.normal(size=x.shape) * 300.0, H * (1 + np.clip(0.15 * rng.normal(size=n), -0.3, 0.3))
    stress = stress + stress.transpose(0, 2, 1)
    middle = 0.5 * (side - 1) * spacing
    body = 1.0 + (x[:, 0] > middle) + 3.0 * (x[:, -1] > middle) * (dim > 1)
    limits = rng.uniform(0.2e9, 2e9, n), rng.uniform(0.1e9, 1e9, n), rng.uniform(0, 1, n), rng.integers(0, 2, n)
    limits[0][::7] = 0.0  # some bear no tension
    limits[2][::14] = -1.0  # and have failed
    m = rho * spacing**dim * (1 + 0.1 * rng.normal(size=n))
    face = 0.4 * np.random.default_rng(seed + 1).normal(size=x.shape)
    twist = 0.1e9 * np.random.default_rng(seed + 2).normal(size=(n, (0, 1, 3)[dim - 1]))
    later = np.random.default_rng(seed + 3)
    heat, counts, leaves = 1e6 * later.uniform(size=n), m / rho * later.uniform(0.9, 1.1, n), 1e5 * later.normal(size=n)
    fades = leaves * later.uniform(1.0, 2.0, n)
    return Cloud(x, u, h, m, rho, c, 1.2 * c, 0.6 * c, stress, body, *limits, face, twist, heat, counts, leaves, fades)


def components(tensor):
    """Return the in-plane components (n, 1, 3 or 6) of symmetric tensors, in the order of packed rows."""
    dim = tensor.shape[1]
    pairs = [(a, a) for a in range(dim)] + [(a, b) for a in range(dim) for b in range(a + 1, dim)]
    return np.stack([tensor[:, a, b] for a, b in pairs], 1)


def tensile(tensor):
    """Return the tensile parts of symmetric tensors, by numpy's eigenvalues."""
    values, vectors = np.linalg.eigh(tensor)
    return np.einsum("nik,nk,njk->nij", vectors, np.maximum(values, 0.0), vectors)


def neighbours(cloud, kernel, a, own=False):
    """Return the indices of the neighbours of particle `a`, `own` says with all that its own kernel reaches."""
    r = np.linalg.norm(cloud.x - cloud.x[a], axis=1)
    near = r < kernel.reach * 0.5 * (np.maximum(cloud.h, cloud.h[a] if own else 0.0) + cloud.h[a])
    near[a] = False
    return np.flatnonzero(near)


def without_spin(gradient, moment):
    """Return a velocity gradient to which the rigid turning of the neighbourhood gives no strain."""
    dim = len(moment)
    if dim == 2:
        spin = np.array([[0.0, -1.0], [1.0, 0.0]]) * (gradient[1, 0] - gradient[0, 1]) / np.trace(moment)
        return gradient + spin @ (np.eye(2) - moment)
    whirl = np.array(
        [gradient[2, 1] - gradient[1, 2], gradient[0, 2] - gradient[2, 0], gradient[1, 0] - gradient[0, 1]]
    )
    w = np.linalg.solve(np.trace(moment) * np.eye(3) - moment, whirl)
    return gradient + np.array([about(w, axis) for axis in np.eye(3)]).T @ (np.eye(3) - moment)


def standard_rates(cloud, formulation):
    """Return rows of rates of the standard law, laid out as the compiled ones."""
    kernel, dim = formulation.kernel, cloud.dim
    w0 = kernel.shape.py_func(1.0 / formulation.h_over_dx)
    eps = formulation.artificial_stress.eps
    r_all = -eps * tensile(cloud.stress) / cloud.rho[:, None, None] ** 2
    rows = []
    for a in range(len(cloud.x)):
        acceleration, power, mu_max, gradient = np.zeros(dim), 0.0, 0.0, np.zeros((dim, dim))
        spin, moment = np.zeros(cloud.twist.shape[1]), np.zeros((dim, dim))
        for b in neighbours(cloud, kernel, a):
            x_ab, u_ab = cloud.x[a] - cloud.x[b], cloud.u[a] - cloud.u[b]
            r, h = np.linalg.norm(x_ab), 0.5 * (cloud.h[a] + cloud.h[b])
            grad = kernel.derivative(r, h, dim) * x_ab / r
            mu = min(h * u_ab @ x_ab / (r**2 + 0.01 * h**2), 0.0)
            mean_c, mean_rho = 0.5 * (cloud.c[a] + cloud.c[b]), 0.5 * (cloud.rho[a] + cloud.rho[b])
            viscous = (-formulation.viscosity.alpha * mean_c * mu + formulation.viscosity.beta * mu**2) / mean_rho
            f = (kernel.shape.py_func(r / h) / w0) ** 4
            shared = f * (r_all[a] + r_all[b]) - viscous * np.eye(dim)
            own, other = cloud.stress[a] / cloud.rho[a] ** 2, cloud.stress[b] / cloud.rho[b] ** 2
            own, other = own @ grad, other @ grad
            if formulation.angular_momentum:
                own = own + about(cloud.twist[a] / cloud.rho[a] ** 2, grad)
                other = other + about(cloud.twist[b] / cloud.rho[b] ** 2, grad)
                spin += cloud.m[b] * torque(x_ab, own + 0.5 * shared @ grad)
                moment -= cloud.m[b] / cloud.rho[b] * np.outer(x_ab, grad)
            acceleration += cloud.m[b] * (own + other + shared @ grad)
            power -= cloud.m[b] * u_ab @ (own + 0.5 * shared @ grad)
            gradient -= cloud.m[b] / cloud.rho[b] * np.outer(u_ab, grad)
            mu_max = max(mu_max, -mu)
        further = []
        if formulation.angular_momentum:
            gradient = without_spin(gradient, moment)
            further = [0.0, 0.0, 0.0, *spin]
        rows.append([*acceleration, power, mu_max, *gradient.ravel(), *further])
    return np.array(rows)


def twin_rates(cloud, formulation):
    """Return the rates of `formulation` in plain Python."""
    if isinstance(formulation, Eulerian):
        return standard_rates(cloud, formulation)
    return riemann_rates(cloud, formulation, neighbours, SINGULAR)


def packed(cloud, formulation, planes=(), further=None):
    """Return `Pairs` of the formulation with the cloud in its rows, and what `further` says by slot."""
    dim = cloud.dim
    layout = formulation.layout(dim)
    coefficients = formulation.coefficients()
    pairs = Pairs(
        layout, formulation.kernel, formulation.passes(dim), coefficients, cloud.x, cloud.h.max(), planes,
        formulation.single,
    )  # fmt: skip
    known = {"X": cloud.x, "U": cloud.u, "H": cloud.h, "M": cloud.m, "V": cloud.m / cloud.rho}
    known |= {
        "BODY": cloud.body,
        "TENSION_LIMIT": cloud.bear,
        "SHEAR_LIMIT": cloud.shear,
        "LATTICE_ORDER": cloud.order,
        "FOLLOWING_SHARE": cloud.grows,
        "COMPRESSION": cloud.compression,
    }
    known |= {
        "N_PREVIOUS": cloud.face,
        "ENERGY": cloud.heat,
        "INV_NUMBER_DENSITY": cloud.counts,
        "DENSITY_RELAXATION": cloud.leaves,
        "CORRECTION_DECAY": cloud.fades,
        "RHO": cloud.rho,
        "C": cloud.c,
        "ZN": cloud.rho * cloud.c_l,
        "ZT": cloud.rho * cloud.c_t,
    }
    square = cloud.rho[:, None] ** 2
    if isinstance(formulation, Riemann):
        known |= {"T": components(cloud.stress), "SPIN_STRESS": cloud.twist}
    else:
        known |= {"T": components(cloud.stress) / square, "SPIN_STRESS": cloud.twist / square}
        known["R"] = -formulation.artificial_stress.eps * components(tensile(cloud.stress)) / square
    known |= {"GU_BEFORE": gradients_before(cloud), "AHEAD_TWICE": ahead_twice(cloud)}
    known |= further or {}
    for name, slot in layout.slots().items():
        if name in known:
            values = known[name].reshape(len(cloud.x), -1)
            pairs.rows[:, slot : slot + values.shape[1]] = values
    return pairs


def compiled_rates(cloud, formulation):
    """Return the rates of `formulation` by its compiled passes."""
    pairs = packed(cloud, formulation)
    pairs.evaluate(cloud.h.max())
    return pairs.rates[pairs.place[: len(cloud.x)]]
