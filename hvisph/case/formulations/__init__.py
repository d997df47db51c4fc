"""Formulations: options, consistency checks and warnings, one file each."""

from typing import Annotated

from hvisph.case.model import BY_TYPE

from .eulerian import EulerianFormulation
from .projection import ProjectionFormulation
from .riemann import RiemannFormulation
from .total_lagrangian import AdaptiveFormulation, TotalLagrangianFormulation

Formulation = Annotated[
    EulerianFormulation | RiemannFormulation | ProjectionFormulation | TotalLagrangianFormulation | AdaptiveFormulation,
    BY_TYPE,
]
