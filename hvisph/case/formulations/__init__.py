"""Formulations: which published scheme computes the run. One file each, with its options, rules and warnings."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from hvisph.case.formulations.eulerian import EulerianFormulation
from hvisph.case.formulations.projection import ProjectionFormulation
from hvisph.case.formulations.riemann import RiemannFormulation
from hvisph.case.formulations.total_lagrangian import AdaptiveFormulation, TotalLagrangianFormulation

Formulation = Annotated[
    EulerianFormulation | RiemannFormulation | ProjectionFormulation | TotalLagrangianFormulation | AdaptiveFormulation,
    Field(discriminator="type"),
]
