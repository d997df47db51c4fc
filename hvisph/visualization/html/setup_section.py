"""Set-up section of the report: picture, settings, materials, commands and files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from hvisph.case.case import Case
from hvisph.casefile.embedded_case import symmetry_axes
from hvisph.core.measure_catalogue import axis_unit
from hvisph.output import file_names
from hvisph.output.reader import read_snapshot
from hvisph.output.snapshot import Snapshot
from hvisph.visualization.inline import embedded_image
from hvisph.visualization.setup import DrawnBody, Setup, setup_figure

from .frames import spacing_of

PICTURE_DPI = 75


class Run(Protocol):
    """What is asked of a run: its folder and name, snapshots, case, summary, last state, and whether it has units."""

    folder: Path
    name: str
    paths: list[Path]
    case: Case
    summary: dict[str, Any]
    last: Snapshot
    unitless: bool


def picture(told: Run) -> str:
    """Return the set-up as an image that the page holds."""
    first = read_snapshot(told.paths[0])
    position = first.fields["position"].reshape(first.count, -1)
    spacing = np.full(first.count, spacing_of(first))
    drawn = []
    for number, name in enumerate(first.bodies):
        own = first.body == number
        if not own.any():
            continue
        velocity = first.fields["velocity"].reshape(first.count, -1)[own].mean(axis=0)
        label = f"{name}: {first.materials[int(first.material[own][0])]}"
        if told.case is not None and name in told.case.bodies:
            label += f", {_describe_shape(told.case.bodies[name].shape, told.unitless)}"
        drawn.append(DrawnBody(name, label, position[own], spacing[own], velocity, np.zeros(own.sum(), bool)))
    planes = [(axis, 0.0) for axis in symmetry_axes(first.metadata.get("case"))]
    gauges = {} if told.case is None else {name: gauge.at for name, gauge in told.case.gauges.items()}
    title = str(first.metadata.get("title", "")) or told.name
    setup = Setup(title, drawn, planes, gauges, (), not told.unitless, first.is_axisymmetric)
    return embedded_image(setup_figure(setup), PICTURE_DPI)


def facts(told: Run) -> list[tuple[str, str]]:
    """Return names and texts of what was computed, and how."""
    last, metadata = told.last, told.last.metadata
    rows = [("title", str(metadata.get("title", ""))), ("kinematics", str(metadata.get("kinematics", ""))),
            ("dimensions", str(last.dimensions)), ("particles", str(last.count))]  # fmt: skip
    if "spacing" in metadata:
        spacing = float(metadata["spacing"])
        rows.append(("resolution", f"{spacing:.4g}" if told.unitless else _length(spacing)))
    if told.case is not None:
        rows.append(("formulation", told.case.formulation.type))
        for name, body in told.case.bodies.items():
            velocity = ", ".join(f"{part:.4g}" for part in _parts(body.velocity))
            speed = f"velocity ({velocity}){'' if told.unitless else ' m/s'}"
            rows.append((f"body {name}", f"{_describe_shape(body.shape, told.unitless)}; {speed}"))
    for key, label in (("steps", "steps"), ("threads", "threads"), ("wall_seconds", "wall time [s]"),
                       ("code_version", "version of hvisph"), ("case_hash", "hash of the case")):  # fmt: skip
        if key in told.summary:
            value = told.summary[key]
            rows.append((label, f"{value:.4g}" if isinstance(value, float) else str(value)))
    return [(name, text) for name, text in rows if text]


def materials(told: Run) -> list[dict[str, str]]:
    """Return the material of each body: its models and its source."""
    if told.case is None:
        return []
    return [
        {"body": name, "name": body.material.name or "own",
         "models": ", ".join((body.material.eos.type, body.material.strength.type, body.material.damage.type)),
         "source": body.material.source}
        for name, body in told.case.bodies.items()
    ]  # fmt: skip


def reproduce(told: Run) -> str:
    """Return the commands that compute the run again."""
    if not (told.folder / file_names.CASE).is_file():
        return "These files hold no case: another program wrote them."
    version = told.summary.get("code_version", "")
    return f"pip install hvisph=={version}\nhvisph run {told.folder / file_names.CASE} --out again"


def files(told: Run) -> list[tuple[Path, str]]:
    """Return the files of the run, and what they hold."""
    what = {
        file_names.CASE: "the effective case",
        file_names.SUMMARY: "measures and cost",
        file_names.HISTORY: "energies, step, pressures",
        file_names.LOG: "what happened when",
        file_names.TIME_SERIES: "all snapshots, for ParaView",
    }
    files = [(told.folder / name, text) for name, text in what.items() if (told.folder / name).is_file()]
    return [*files, (told.paths[0].parent, f"{len(told.paths)} snapshots")]


def _parts(value: object) -> Sequence[float]:
    return [float(part) for part in value] if isinstance(value, Sequence) and not isinstance(value, str) else []


def _describe_shape(shape: Any, unitless: bool) -> str:
    """Return a shape's kind and sizes in words: of combined ones and of those drawn out, kinds of parts alone."""
    sizes, parts = [], []
    for key, field in type(shape).model_fields.items():
        value = getattr(shape, key)
        if key == "type" or value == field.default:
            continue
        if key == "file":
            sizes.append(Path(value).name)
        elif key == "points":
            sizes.append(f"{len(value)} points")
        elif hasattr(value, "type"):
            parts.append(value.type)
        elif key in ("parts", "removed"):
            parts += [part.shape.type for part in value]
        else:
            sizes.append(f"{key.replace('_', ' ')} {_format_value(value, unitless)}")
    inner = [f"{parts.count(kind)} {kind}" if parts.count(kind) > 1 else kind for kind in dict.fromkeys(parts)]
    return " ".join([shape.type, *(["of", ", ".join(inner)] if inner else []), ", ".join(sizes)]).strip()


def _length(value: float) -> str:
    unit, factor = axis_unit("mm", [value])
    return f"{value * factor:.4g} {unit}"


def _format_value(value: object, unitless: bool) -> str:
    if isinstance(value, float):
        return f"{value:.4g}" if unitless else _length(value)
    if isinstance(value, Sequence) and not isinstance(value, str):
        return " x ".join(_format_value(part, unitless) for part in value)
    return str(value)
