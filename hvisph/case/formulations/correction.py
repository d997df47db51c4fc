"""Corrections of the kernel and its gradient."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field

from hvisph.case.dimensions import NUMBER
from hvisph.case.model import StrictModel
from hvisph.case.units import Quantity

# C_f without and with artificial stress (Young 2021 section 3.2).
FACTORS = {"none": 7.5, "gray": 90.0}
CORRECTIONS = ("shepard", "gradient", "mixed")


class NoCorrection(StrictModel):
    """The plain kernel gradient."""

    type: Literal["none"] = "none"


class _Limited(StrictModel):
    factor: Annotated[float, Quantity(NUMBER, above=1)] | None = Field(
        default=None,
        description="C_f: a pair whose corrected gradient is more than C_f times as long as the plain one, or has "
        "less than 1/C_f of it along the pair, takes the plain one [-], above 1; unless given, 7.5 without "
        "artificial stress and 90 with it",
    )
    limiter: Literal["pair", "components"] = Field(
        default="pair",
        description="Criterion of C_f: `pair`, independent of the frame of reference; `components` limits each "
        "component of the gradient, as published, so that results depend on the orientation of the axes",
    )


class ShepardCorrection(_Limited):
    """The kernel over its own sum: a constant is exact."""

    type: Literal["shepard"] = "shepard"


class GradientCorrection(_Limited):
    """The gradient times the inverse of its moment matrix: the gradient of a linear field is exact."""

    type: Literal["gradient"] = "gradient"


class MixedCorrection(_Limited):
    """Both (Young 2021 eqs. 3-5, 14)."""

    type: Literal["mixed"] = "mixed"


Correction = Annotated[
    NoCorrection | ShepardCorrection | GradientCorrection | MixedCorrection, Field(discriminator="type")
]


def fill_factor(data: object, key: str, unless_given: str) -> Any:
    """Write out C_f of the correction under `key`, by the artificial stress or what it is `unless_given`."""
    if not isinstance(data, dict):
        return data
    correction = data.get(key)
    if isinstance(correction, BaseModel):
        correction = correction.model_dump()
    if not isinstance(correction, dict) or correction.get("type") not in CORRECTIONS:
        return data
    stress = data.get("artificial_stress")
    kind = stress.get("type") if isinstance(stress, dict) else getattr(stress, "type", unless_given)
    if correction.get("factor") is None and isinstance(kind, str) and kind in FACTORS:
        return data | {key: correction | {"factor": FACTORS[kind]}}
    return data


def fill_correction(data: object) -> Any:
    """Write out C_f, by the artificial stress, and the momentum form where a formulation has a correction."""
    if not isinstance(data, dict):
        return data
    correction = data.get("correction")
    kind = correction.get("type") if isinstance(correction, dict) else getattr(correction, "type", None)
    if kind not in CORRECTIONS:
        return data
    return {"momentum_form": "product"} | fill_factor(data, "correction", "none")
