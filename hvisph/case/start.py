"""Start of a run from a snapshot of another run."""

from collections.abc import Callable, Iterator
from pathlib import Path as Folder
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationInfo, create_model

from .model import Problem, Shorthand, StrictModel
from .units import NonNegativeTime, PositiveLength


def _resolve_folder(value: object, info: ValidationInfo) -> object:
    """Return the path of a folder beside the files of the case, else of the working folder, where there is one."""
    if isinstance(value, str) and len(value) <= 4096 and "\0" not in value:
        for folder in (*(info.context or {}).get("folders", ()), "."):
            if (Folder(folder) / value).is_dir():
                return str((Folder(folder) / value).resolve())
    return value


class _Start(StrictModel):
    run: Annotated[str, Shorthand(_resolve_folder, ()), Field(min_length=1, max_length=4096)] = Field(
        description="Folder of the other run, relative to the case file or to the working folder"
    )
    at: NonNegativeTime = Field(
        description="Time of one of its snapshots [s]; the time of this run goes on from there, to `time.end`"
    )
    width: PositiveLength | None = Field(
        default=None, description="Width along z [m] to which a plane run is extruded; `as: extruded` alone"
    )

    @property
    def mapping(self) -> str:
        """How the state is taken: `same`, `axisymmetric` or `extruded`."""
        return str(getattr(self, "as"))

    def words(self, number: Callable[[float, str], str]) -> str:
        """Return the start in words, with quantities by `number`."""
        extruded = f", extruded along z to {number(self.width or 0.0, 'm')}"
        how = {"same": "", "revolved": ", revolved about x", "extruded": extruded}[self.mapping]
        return f"from {self.run} at {number(self.at, 's')}{how}"


# `as` is a keyword of Python, so that no class statement can contain it.
Start: Any = create_model(
    "Start",
    __base__=_Start,
    __doc__="State of another run that this one starts from.",
    **{
        "as": (
            Literal["same", "revolved", "extruded"],
            Field(
                default="same",
                description="`same`: particles as they are, in the same kinematics; `axisymmetric`: those of an "
                "axisymmetric run become particles about x in 3D; `extruded`: those of a plane strain run become rows "
                "along z in 3D",
            ),
        )
    },
)  # type: ignore[call-overload]


def start_problems(case: Any) -> Iterator[Problem]:
    """Yield the errors of a start from another run that the case alone shows."""
    start = case.start
    if start is None:
        return
    if not case.time.end > start.at:
        yield Problem(("time", "end"), f"{case.time.end:g} is not after the start, start.at = {start.at:g}")
    if start.mapping != "same" and case.kinematics != "three_d":
        yield Problem(("start", "as"), f"{start.mapping} needs kinematics three_d, not {case.kinematics}")
    if (start.mapping == "extruded") != (start.width is not None):
        yield Problem(("start", "width"), "`as: extruded` needs it, and nothing else has it")
    if case.formulation.type == "projection":
        yield Problem(("start",), "projection does not start from another run; use another formulation")
    if case.time.step is not None:
        yield Problem(("time", "step"), "a run with a start has steps by criteria; leave it out")
    if case.overburden is not None:
        yield Problem(("overburden",), "the bodies have the stress of the other run; leave it out")
