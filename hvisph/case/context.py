"""Interface of a case for the checks of its parts."""

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

from .bodies import Body
from .output import BoxRegion, InitialLoad, Output, SymmetryPlane
from .time import Time


class Surroundings(Protocol):
    """Properties of a case that its parts depend on."""

    @property
    def units(self) -> str:
        """``si`` or ``none``."""

    @property
    def kinematics(self) -> str:
        """Dimensions and stress state by name."""

    @property
    def dim(self) -> int:
        """Number of space dimensions."""

    @property
    def drawing_dimensions(self) -> int:
        """Number of dimensions in which bodies are drawn."""

    @property
    def resolution(self) -> float:
        """Spacing dx [m]."""

    @property
    def bodies(self) -> Mapping[str, Body]:
        """Bodies by name."""

    @property
    def symmetry(self) -> Sequence[SymmetryPlane]:
        """Symmetry planes."""

    @property
    def formulation(self) -> Any:
        """Scheme that computes the run, one of `case.formulations`."""

    @property
    def initial_loads(self) -> Sequence[InitialLoad]:
        """Impulses of the first step."""

    @property
    def domain(self) -> BoxRegion | None:
        """Box outside of which particles are retired."""

    @property
    def time(self) -> Time:
        """Duration and time stepping."""

    @property
    def duration(self) -> float:
        """Time from start to end [s]."""

    @property
    def output(self) -> Output:
        """Output options."""
