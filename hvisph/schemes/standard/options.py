"""Options of standard SPH as objects, with their additions to state, rows and coefficients."""

from dataclasses import dataclass
from typing import ClassVar

from hvisph.integrators.particle_steps import BALSARA, MORRIS_MONAGHAN, WHOLE


@dataclass(frozen=True)
class MonaghanViscosity:
    """Monaghan's viscosity with full coefficients in every particle; SAV1 has alpha 1 and beta 2."""

    # linear and quadratic coefficients
    alpha: float = 1.0
    beta: float = 2.0

    # The share of it that a particle takes, what that adds to the state, and s_min and C1 of its law.
    switch: ClassVar[int] = WHOLE
    fields: ClassVar[tuple[str, ...]] = ()

    @property
    def relaxation(self) -> tuple[float, float]:
        """s_min and C1 of factors that relax; unused by others."""
        return 0.1, 0.2

    @property
    def has_switch(self) -> bool:
        """Whether particles have a factor of it."""
        return self.switch != WHOLE


NO_VISCOSITY = MonaghanViscosity(0.0, 0.0)


@dataclass(frozen=True)
class BalsaraViscosity(MonaghanViscosity):
    """BAL: the factor of a particle is |div u|/(|div u| + |curl u|) (Balsara 1995)."""

    switch: ClassVar[int] = BALSARA


@dataclass(frozen=True)
class MorrisMonaghanViscosity(MonaghanViscosity):
    """MON: the factor of a particle is raised by compression and relaxes (Morris & Monaghan 1997)."""

    # s_min, which the share relaxes to, and C1: it does so in the time h/(C1 c)
    share_minimum: float = 0.1
    share_decay: float = 0.2

    switch: ClassVar[int] = MORRIS_MONAGHAN
    fields: ClassVar[tuple[str, ...]] = ("viscosity_factor",)

    @property
    def relaxation(self) -> tuple[float, float]:
        """s_min and C1."""
        return self.share_minimum, self.share_decay


@dataclass(frozen=True)
class GrayArtificialStress:
    """Repulsion in tension against clumping (Gray, Monaghan & Swift 2001)."""

    eps: float = 0.3  # its strength
    exponent: int = 4  # n of W/W(dx)

    @property
    def acts(self) -> bool:
        """Whether it acts."""
        return self.eps != 0.0


NO_ARTIFICIAL_STRESS = GrayArtificialStress(0.0)


@dataclass(frozen=True)
class DensityDissipation:
    """Diffusion of density by pressure differences (Zisis 2013 eqs. 22-24)."""

    alpha: float = 0.3  # coefficient alpha_rho

    @property
    def acts(self) -> bool:
        """Whether it acts."""
        return self.alpha != 0.0


NO_DENSITY_DISSIPATION = DensityDissipation(0.0)


@dataclass(frozen=True)
class KernelCorrection:
    """A correction of the kernel and its gradient in the current configuration (Young 2021 eqs. 3-5)."""

    # whether the kernel is divided by its own sum, and whether its gradient is exact for linear fields
    shepard: bool = True
    gradient: bool = True
    # C_f, above 1: a pair whose corrected gradient is more than this many times as long as the plain one, or has less
    # than its inverse of it along the pair, takes the plain gradient; infinity for no limit
    factor: float = 7.5
    by_component: bool = False  # whether each component is tested instead, as printed: that depends on the frame

    @property
    def acts(self) -> bool:
        """Whether it acts."""
        return self.shepard or self.gradient


PLAIN_GRADIENT = KernelCorrection(False, False)
