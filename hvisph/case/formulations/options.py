"""Options of every formulation: kernel and smoothing length."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from pydantic import Field

from hvisph.case.context import Surroundings
from hvisph.case.dimensions import NUMBER
from hvisph.case.model import Problem, StrictModel
from hvisph.case.units import Quantity
from hvisph.core.catalogues import REACH

if TYPE_CHECKING:  # what is made from the catalogue cannot be read by a type checker
    Kernel = str
else:
    Kernel = Literal[tuple(REACH)]


class FixedSmoothingLength(StrictModel):
    """h stays h_over_dx times the resolution."""

    type: Literal["fixed"] = "fixed"


class VariableSmoothingLength(StrictModel):
    """h follows density, dh/dt = -(h/d) (drho/dt)/rho, within limits."""

    type: Literal["variable"] = "variable"
    min_over_initial: Annotated[float, Quantity(NUMBER, above=0, maximum=1)] = Field(
        default=0.5, description="Lower limit of h over its initial value [-], above 0 and at most 1"
    )
    max_over_initial: Annotated[float, Quantity(NUMBER, minimum=1, maximum=10)] = Field(
        default=2.0, description="Upper limit of h over its initial value [-], 1 to 10"
    )


SmoothingLength = Annotated[FixedSmoothingLength | VariableSmoothingLength, Field(discriminator="type")]


class KernelOptions(StrictModel):
    """Options of every kernel-based formulation."""

    kernel: Kernel = Field(
        default="cubic_spline",
        description="Smoothing kernel; reaches to 2h, `quartic_spline` to 2.5h, `quintic_spline` and "
        "`gaussian` (cut off there) to 3h",
    )
    h_over_dx: Annotated[float, Quantity(NUMBER, minimum=1.0, maximum=2.5)] = Field(
        default=1.4, description="Initial smoothing length h over the resolution dx [-], 1 to 2.5"
    )
    smoothing_length: SmoothingLength = Field(
        default=FixedSmoothingLength(), description="Whether h stays fixed or follows density"
    )

    @property
    def support_over_h(self) -> float:
        """Kernel support in smoothing lengths [-]."""
        return REACH[self.kernel]

    @property
    def contact_algorithm(self) -> bool:
        """Whether a contact algorithm instead of the kernel sums acts between bodies."""
        return False

    # Whether bodies, or regions of them, may have kernels of their own kind; whether a particle may leave the
    # others without a trace.
    mixes_kernels: ClassVar[bool] = False
    retires: ClassVar[bool] = False

    def problems(self, case: Surroundings) -> Iterator[Problem]:
        """Yield the errors of this formulation in `case`, with paths from the root."""
        kind = getattr(self, "type")  # noqa: B009 - every formulation has one, of a literal of its own
        if not self.mixes_kernels:
            yield from _kernels_of_another_kind(kind, case)
        if case.domain is not None and not self.retires:
            yield Problem(
                ("domain",),
                f"particles cannot be retired with '{kind}', whose particles keep what surrounds them; "
                "leave it out, or use eulerian or riemann",
            )

    def warnings(self, case: Surroundings) -> Iterator[str]:
        """Yield warnings about this formulation in a valid `case`."""
        yield from ()


def _kernels_of_another_kind(kind: str, case: Surroundings) -> Iterator[Problem]:
    for number, _ in enumerate(case.initial_loads):
        yield Problem(
            ("initial_loads", number),
            f"has no meaning for '{kind}'; use the formulation total_lagrangian, where a body may be eulerian",
        )
    for name, body in case.bodies.items():
        if body.formulation is not None:
            yield Problem(
                ("bodies", name, "formulation"),
                f"beside '{kind}' no body has a formulation of its own; give the case total_lagrangian or adaptive",
            )


# What siblings of `adaptive` say of its key.
NO_CONVERSION = {"conversion": "only particles of the formulation 'adaptive' turn Eulerian"}
