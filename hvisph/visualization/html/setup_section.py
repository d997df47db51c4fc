"""Files of a run, and the set-up section of its report: picture, settings, materials, commands and files."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from hvisph.case.case import Case
from hvisph.casefile.document import symmetry_axes
from hvisph.casefile.loader import load_case
from hvisph.core.errors import CaseError, OutputError
from hvisph.core.measure_catalogue import axis_unit
from hvisph.core.text import Plain, PlainMapping
from hvisph.measures.impact_geometry import spacing_of
from hvisph.measures.measure import measure
from hvisph.output import file_names
from hvisph.output.reader import read_history, read_snapshot, read_summary, snapshots_in
from hvisph.visualization.html.charts import embedded_image
from hvisph.visualization.setup import DrawnBody, Setup, setup_figure

PICTURE_DPI = 75


class RunFiles:
    """Folder and files of a run; `CaseError` without any snapshot, `OutputError` for damaged ones."""

    def __init__(self, folder: Path):
        self.folder, self.name = folder, folder.resolve().name
        if not folder.is_dir():
            raise CaseError(f"there is no run at {folder}")
        self.paths = snapshots_in(folder)
        self.case: Case | None = None
        with suppress(CaseError):
            self.case = load_case(folder / file_names.CASE)
        self.summary: Plain = {}
        with suppress(OutputError):
            self.summary = read_summary(folder)
        self.history: Mapping[str, np.ndarray] = {}
        with suppress(OutputError):
            self.history = read_history(folder)
        self.last = read_snapshot(self.paths[-1])
        self.unitless = self.last.metadata.get("units") == "none"
        measured = self.summary.get("measures")
        self.measures: Mapping[str, PlainMapping] = measured or measure(folder).as_dict()["measures"]

    def text(self, name: str) -> str:
        """Return the content of a text file of the folder; empty where there is none."""
        try:
            return (self.folder / name).read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError):
            return ""


def picture(run: RunFiles) -> str:
    """Return the set-up as an image that the page holds."""
    first = read_snapshot(run.paths[0])
    position = first.fields["position"].reshape(first.count, -1)
    spacing = np.full(first.count, spacing_of(first))
    bodies = []
    for number, name in enumerate(first.bodies):
        mask = first.body == number
        if not mask.any():
            continue
        velocity = first.fields["velocity"].reshape(first.count, -1)[mask].mean(axis=0)
        label = f"{name}: {first.materials[int(first.material[mask][0])]}"
        if run.case is not None and name in run.case.bodies:
            label += f", {_describe_shape(run.case.bodies[name].shape, run.unitless)}"
        bodies.append(DrawnBody(name, label, position[mask], spacing[mask], velocity, np.zeros(mask.sum(), bool)))
    planes = [(axis, 0.0) for axis in symmetry_axes(first.metadata.get("case"))]
    gauges = {} if run.case is None else {name: gauge.at for name, gauge in run.case.gauges.items()}
    title = str(first.metadata.get("title", "")) or run.name
    setup = Setup(title, bodies, planes, gauges, (), not run.unitless, first.is_axisymmetric)
    return embedded_image(setup_figure(setup), PICTURE_DPI)


def facts(run: RunFiles) -> list[tuple[str, str]]:
    """Return names and texts of case and formulation."""
    last, metadata = run.last, run.last.metadata
    rows = [
        ("title", str(metadata.get("title", ""))),
        ("kinematics", str(metadata.get("kinematics", ""))),
        ("dimensions", str(last.dimensions)),
        ("particles", str(last.count)),
    ]
    if "spacing" in metadata:
        spacing = float(metadata["spacing"])
        rows.append(("resolution", f"{spacing:.4g}" if run.unitless else _length(spacing)))
    if run.case is not None:
        rows.append(("formulation", run.case.formulation.type))
        for name, body in run.case.bodies.items():
            velocity = ", ".join(f"{float(part):.4g}" for part in body.velocity)
            speed = f"velocity ({velocity}){'' if run.unitless else ' m/s'}"
            rows.append((f"body {name}", f"{_describe_shape(body.shape, run.unitless)}; {speed}"))
    for key, label in (
        ("steps", "steps"),
        ("threads", "threads"),
        ("wall_seconds", "wall time [s]"),
        ("code_version", "version of hvisph"),
        ("case_hash", "hash of the case"),
    ):
        if key in run.summary:
            value = run.summary[key]
            rows.append((label, f"{value:.4g}" if isinstance(value, float) else str(value)))
    return [(name, text) for name, text in rows if text]


def reproduce(run: RunFiles) -> str:
    """Return the commands that compute the run again."""
    if not (run.folder / file_names.CASE).is_file():
        return "These files hold no case: another program wrote them."
    version = run.summary.get("code_version", "")
    return f"pip install hvisph=={version}\nhvisph run {run.folder / file_names.CASE} --out again"


def files(run: RunFiles) -> list[tuple[Path, str]]:
    """Return the files of the run with their content."""
    contents = {
        file_names.CASE: "the effective case",
        file_names.SUMMARY: "measures and cost",
        file_names.HISTORY: "energies, step, pressures",
        file_names.LOG: "what happened when",
        file_names.TIME_SERIES: "all snapshots, for ParaView",
    }
    files = [(run.folder / name, text) for name, text in contents.items() if (run.folder / name).is_file()]
    return [*files, (run.paths[0].parent, f"{len(run.paths)} snapshots")]


def _describe_shape(shape: Any, unitless: bool) -> str:
    """Return a shape's kind and sizes as text; of combined and swept shapes only the kinds of their parts."""
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
    inner = [f"{parts.count(name)} {name}" if parts.count(name) > 1 else name for name in dict.fromkeys(parts)]
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
