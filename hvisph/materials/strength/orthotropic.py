"""Orthotropic elasticity beside an isotropic equation of state.

    sigma = T - p(rho, e) I,    dT/dt = C : D - K0 tr(D) I    in material axes,    K0 = rho0 c0^2

C is the stiffness of the engineering constants E_i, nu_ij, G_ij, S its inverse. K0 of the equation of state is
subtracted from C: at rest the stiffness is C for any c0, and at high pressure p is the isotropic part. For isotropic
constants of the bulk modulus K0, T is the deviator. The tangent stiffness K_s I I + (C - K0 I I) is positive as long as
the bulk modulus K_s of the state is above K0 - K_R, with K_R = 1/sum S_ij (Reuss). Choose K0 between K_R and K_V = sum
C_ij/9 (Voigt).

The squares of the speeds of waves along n are the eigenvalues of Christoffel's tensor G_ik = C_ijkl n_j n_l over rho;
computed shear waves, and waves between the axes, agree within 0.7 % at 72 spacings a wavelength (riemann). A disc in
rotation, 25 spacings in radius, has the stresses and the rim displacement of the closed form within 0.8 % in
`total_lagrangian`; in `riemann` they are 14 to 23 % too large at 4 layers of particles, 1 to 9 % at 12. A particle of
CFRP takes 1.04 to 1.5 times the time of one of aluminium. Anderson et al. 1994, Comput. Mech. 15, 201; Hiermaier et al.
1999, ESA CR(P) 4397 (AMMHIS); Auld 1973, Acoustic Fields and Waves in Solids.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import ClassVar

import numpy as np

from hvisph.compiler.jit import inline
from hvisph.core.errors import CaseError
from hvisph.materials import slots, tags
from hvisph.materials.slots import SHEAR_MODULUS

# C less K0 of the normal components, and the shear moduli.
R11, R22, R33, R12, R13, R23, G12, G13, G23 = slots.STRENGTH[:9]
SHEAR_GREATEST, BULK = slots.STRENGTH[9:11]
_STARTS, _STEPS = 9, 60  # directions along an edge, and iterations, of the search for the fastest wave
_ALIKE = 2e-3  # relative difference of constants that are the same: they are given to three digits


@dataclass(frozen=True)
class Orthotropic:
    """Parameters of orthotropic elasticity."""

    moduli: tuple[float, float, float]  # E1, E2, E3 [Pa]
    poisson: tuple[float, float, float]  # nu12, nu13, nu23 [-]
    shear_moduli: tuple[float, float, float]  # G12, G13, G23 [Pa]
    bulk_modulus: float  # K0 of the equation of state [Pa]

    name: ClassVar[str] = "orthotropic"
    tag: ClassVar[int] = tags.ORTHOTROPIC

    def __post_init__(self) -> None:
        if not np.linalg.eigvalsh(self.compliance * self.moduli[0]).min() > 0.0:
            raise CaseError(
                "no stable solid has these Poisson's ratios: the stiffness must be positive definite, which needs "
                "|nu_ij| < sqrt(E_i/E_j) and more; is nu_ij (strain along j over that along i, pulled along i) meant "
                "as nu_ji?",
                where=self.name,
            )
        if not self.fastest > self.bulk_modulus > 0.0:
            raise CaseError(
                f"the bulk modulus of the equation of state, {self.bulk_modulus:.4g} Pa, must be below the stiffness "
                f"of the fastest wave, {self.fastest:.4g} Pa; choose it between {self.reuss:.4g} and {self.voigt:.4g} "
                "Pa (Reuss and Voigt)",
                where=self.name,
            )

    @cached_property
    def compliance(self) -> np.ndarray:
        """S (6, 6) [1/Pa], components as 11 22 33 12 13 23, engineering shear strains."""
        (e1, e2, e3), (n12, n13, n23) = self.moduli, self.poisson
        s = np.diag([1.0 / e1, 1.0 / e2, 1.0 / e3, *(1.0 / g for g in self.shear_moduli)])
        s[0, 1] = s[1, 0] = -n12 / e1
        s[0, 2] = s[2, 0] = -n13 / e1
        s[1, 2] = s[2, 1] = -n23 / e2
        return s

    @cached_property
    def stiffness(self) -> np.ndarray:
        """C (6, 6) [Pa], components as in `compliance`."""
        return np.asarray(np.linalg.inv(self.compliance))

    @property
    def voigt(self) -> float:
        """K_V [Pa]."""
        return float(self.stiffness[:3, :3].sum() / 9.0)

    @property
    def reuss(self) -> float:
        """K_R [Pa]."""
        return float(1.0 / self.compliance[:3, :3].sum())

    @property
    def stable_limit(self) -> float:
        """Bulk modulus of a state below which its tangent is no longer positive [Pa]."""
        return max(self.bulk_modulus - self.reuss, 0.0)

    def christoffel(self, n: np.ndarray) -> np.ndarray:
        """Return Christoffel's tensor (3, 3) [Pa] for waves along the unit vector `n` in material axes."""
        c = self.stiffness
        g = np.array([[c[0, 0], c[3, 3], c[4, 4]], [c[3, 3], c[1, 1], c[5, 5]], [c[4, 4], c[5, 5], c[2, 2]]])
        made = np.outer(n, n) * (c[:3, :3] + g)
        made[np.diag_indices(3)] = g @ (n * n)
        return made

    @cached_property
    def fastest(self) -> float:
        """Greatest root of Christoffel's tensor over all directions [Pa].

        Direction and polarization play the same part in C_ijkl n_j n_l p_i p_k: alternately taking the one for the
        best other increases it up to a maximum; the greatest of those from many starts counts.
        """
        steps = np.linspace(0.0, 1.0, _STARTS)
        best = 0.0
        for start in product(steps, steps, steps):
            n = np.array(start)
            if not n.any():
                continue
            n /= np.linalg.norm(n)
            for _ in range(_STEPS):
                roots, vectors = np.linalg.eigh(self.christoffel(n))
                n = vectors[:, 2]
                if roots[2] <= best * (1.0 + 1e-14):
                    break
                best = float(roots[2])
        return best

    @property
    def shear_modulus(self) -> float:
        """G_eff [Pa] with which sqrt(c^2 + 4 G/(3 rho)) at rest is the speed of the fastest wave."""
        return 0.75 * (self.fastest - self.bulk_modulus)

    def is_same_about(self, axis: int) -> bool:
        """Return whether the material is the same in all directions about a material axis (0, 1 or 2)."""
        i, j = (k for k in range(3) if k != axis)
        c = self.stiffness
        shear = [c[5, 5], c[4, 4], c[3, 3]]  # normal to 1, 2 and 3
        pairs = (
            (c[i, i], c[j, j]),
            (c[i, axis], c[j, axis]),
            (shear[j], shear[i]),
            (shear[axis], 0.5 * (c[i, i] - c[i, j])),
        )
        return all(abs(a - b) <= _ALIKE * max(abs(a), abs(b)) for a, b in pairs)

    def pack(self, row: np.ndarray, density: float) -> None:
        c = self.stiffness
        row[SHEAR_MODULUS] = self.shear_modulus
        normal = c[:3, :3] - self.bulk_modulus
        row[[R11, R22, R33, R12, R13, R23]] = normal[(0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)]
        row[[G12, G13, G23]] = self.shear_moduli
        row[SHEAR_GREATEST], row[BULK] = max(self.shear_moduli), self.bulk_modulus


@inline
def add_strain(t, strain, borne, row):
    """Return T [Pa] after six strains along the axes; `borne` are shares of the shear moduli 12, 13, 23."""
    e1, e2, e3, e12, e13, e23 = strain
    return (
        t[0] + row[R11] * e1 + row[R12] * e2 + row[R13] * e3,
        t[1] + row[R12] * e1 + row[R22] * e2 + row[R23] * e3,
        t[2] + row[R13] * e1 + row[R23] * e2 + row[R33] * e3,
        t[3] + 2.0 * row[G12] * borne[0] * e12,
        t[4] + 2.0 * row[G13] * borne[1] * e13,
        t[5] + 2.0 * row[G23] * borne[2] * e23,
    )
