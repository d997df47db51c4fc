"""Execution, evaluation and pictures of trials."""

import shutil
import sys
import tempfile
import time as wall
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType

from hvisph.case.case import Case
from hvisph.casefile.loader import load_case
from hvisph.casefile.material_library import library_values
from hvisph.core.errors import CaseError, HvisphError
from hvisph.core.text import Plain
from hvisph.output.run_folder import RunFolder
from hvisph.precheck.estimate import worthwhile_threads
from hvisph.setup.bodies import placed_bodies
from hvisph.setup.build import build
from hvisph.simulation.listener import Listener
from hvisph.simulation.loop import Run
from hvisph.simulation.run import set_threads
from hvisph.verification.problem import Figure, Options, Problem, Ran, Start, Trial, limit
from hvisph.verification.problems import bars, hugoniot, plate, shock_tubes
from hvisph.visualization.curves import Curve, curves_picture

NAME = "hvisph_validation"
FOLDER = Path(__file__).resolve().parents[2] / "validation"


def checkout_module(name: str) -> ModuleType | None:
    """Return the module `name` of the folder `validation` beside the package; None where there is no such folder."""
    if NAME not in sys.modules:
        spec = spec_from_file_location(NAME, FOLDER / "__init__.py", submodule_search_locations=[str(FOLDER)])
        if spec is None or spec.loader is None or not (FOLDER / "__init__.py").is_file():
            return None
        package = sys.modules[NAME] = module_from_spec(spec)
        spec.loader.exec_module(package)
    return import_module(f"{NAME}.{name}")


def require_module(name: str) -> ModuleType:
    """Return the module `name` of the folder `validation`; raises `CaseError` with the remedy where there is none."""
    module = checkout_module(name)
    if module is None:
        fault = "the experiments are in the folder `validation` of a source checkout, which this installation is not;"
        raise CaseError(f"{fault} take the command in a checkout as `python -m hvisph validate`")
    return module


_QUICK = (hugoniot.PROBLEM, plate.PROBLEM, shock_tubes.SOD_PROBLEM, shock_tubes.BLAST_PROBLEM, bars.PROBLEM)
_OTHERS = checkout_module("problems")
PROBLEMS: dict[str, Problem] = {problem.name: problem for problem in _QUICK}
PROBLEMS |= _OTHERS.PROBLEMS if _OTHERS is not None else {}
_BLIND = checkout_module("blind")
PROBLEMS |= {_BLIND.PROBLEM.name: _BLIND.PROBLEM} if _BLIND is not None else {}
STRAIN = 0.85  # at which an adaptive particle turns: Young 2021
LIMITS = {"energy_drift": None, "speed_over_initial": None}  # limits that stop a run early would hide what it does


@dataclass
class Verdict:
    """Result of a formulation in a trial."""

    # names
    problem: str
    trial: str
    formulation: str
    status: str  # ``done``, ``failed`` (the run stopped), or ``refused`` (the case cannot be run by it)
    figures: list[Figure] = field(default_factory=list)  # results; empty unless done
    message: str = ""  # why it failed or was refused
    seconds: float = 0.0  # wall time of its runs
    # plotted data (see `Trial`), and whether its case has no units
    curves: dict[str, list[Curve]] = field(default_factory=dict)
    across: str = "x"
    units: Mapping[str, str] = field(default_factory=dict)
    unitless: bool = False

    @property
    def passed(self) -> bool | None:
        """Whether all figures passed; None for a refused case."""
        return None if self.status == "refused" else self.status == "done" and all(f.passed for f in self.figures)

    def as_dict(self) -> Plain:
        """Return the plain form for JSON."""
        return {
            "problem": self.problem,
            "trial": self.trial,
            "formulation": self.formulation,
            "status": self.status,
            "passed": self.passed,
            "message": self.message,
            "seconds": round(self.seconds, 2),
            "figures": [figure.as_dict() for figure in self.figures],
        }


def default_formulation() -> str:
    """Return the type of the formulation that a case gets when it names none."""
    return str(Case.model_fields["formulation"].get_default(call_default_factory=True).type)


def verdicts(
    problem: Problem,
    formulations: Sequence[str],
    options: Options,
    settings: Sequence[str] = (),
    *,
    only: str = "",
    keep: Path | None = None,
    threads: int | None = None,
) -> Iterator[Verdict]:
    """Run a problem by each of `formulations` that can, and yield how they did, trial by trial.

    `settings`: settings ``path.to.key=value`` laid over every case.
    `only`: text that the names of trials must hold.
    `keep`: folder in which the runs stay; they are deleted unless given.
    """
    able = [name for name in formulations if name in problem.formulations]
    for trial in problem.trials(options):
        if only.lower() not in trial.name.lower():
            continue
        results = []
        for name in able:
            results.append(run_trial(problem, trial, name, settings, keep, threads))
            yield results[-1]
        if problem.agree is not None:
            yield from _agreement(problem, trial, results)


def _agreement(problem: Problem, trial: Trial, results: Sequence[Verdict]) -> Iterator[Verdict]:
    """Evaluate the agreement of formulations in the figure that the problem names."""
    name, tolerance = problem.agree or ("", 0.0)
    values = [figure.found for verdict in results for figure in verdict.figures if figure.name == name]
    if len(values) > 1:
        spread = max(values) / min(values) - 1.0 if min(values) > 0.0 else float("inf")
        together = limit(f"{name}, largest over least", spread, tolerance)
        yield Verdict(problem.name, trial.name, "all", "done", [together])


def run_trial(
    problem: Problem,
    trial: Trial,
    formulation: str,
    settings: Iterable[str] = (),
    keep: Path | None = None,
    threads: int | None = None,
) -> Verdict:
    """Run one trial by one formulation."""
    verdict = Verdict(problem.name, trial.name, formulation, "done", across=trial.across, units=trial.units)
    began = wall.perf_counter()
    where = Path(tempfile.mkdtemp(prefix="hvisph_verify_"))
    if keep is not None:
        where = keep / problem.name / formulation / trial.name.replace(" ", "_").replace("/", "_")
    try:
        try:
            cases = [with_formulation(start, formulation, settings) for start in trial.starts]
            ran = [
                _compute(start, case, where / str(number), threads)
                for number, (start, case) in enumerate(zip(trial.starts, cases, strict=True))
            ]
        except CaseError as error:
            verdict.status, verdict.message = "refused", str(error)
            return verdict
        except HvisphError as error:
            verdict.status, verdict.message = "failed", str(error)
            return verdict
        failures = [r.summary["failure"] for r in ran if r.summary["failure"]]
        if failures and not trial.may_stop:
            verdict.status = "failed"
            verdict.message = f"stopped at t = {failures[0]['time']:.4g}: {failures[0]['message']}"
            return verdict
        verdict.figures, verdict.unitless = list(trial.figures(ran)), cases[0].units == "none"
        if trial.curves is not None:
            verdict.curves = trial.curves(ran)
        return verdict
    finally:
        verdict.seconds = wall.perf_counter() - began
        if keep is None:
            shutil.rmtree(where, ignore_errors=True)


def with_formulation(start: Start, formulation: str, settings: Iterable[str]) -> Case:
    """Return the case of a run by a formulation, with the settings of the problem."""
    options = dict(start.case.get("formulation", {}))
    if formulation == "adaptive":
        materials = [body["material"] for body in start.case["bodies"].values()]
        values = [library_values(material) if isinstance(material, str) else material for material in materials]
        grows = any(material.get("damage", {}).get("type") == "johnson_cook" for material in values)
        options = {"conversion": {"strain": STRAIN, "damage": grows}} | options
    content = start.case | {"formulation": {"type": formulation} | options}
    content["limits"] = LIMITS | start.case.get("limits", {})
    content["output"] = {"formats": ["hdf5"], "checkpoint_every": None} | start.case.get("output", {})
    return load_case(content, settings)


def _compute(start: Start, case: Case, folder: Path, threads: int | None) -> Ran:
    placed = placed_bodies(case)
    if start.place is not None:
        placed = start.place(placed)
    setup = build(case, placed)
    set_threads(threads, worthwhile_threads(case, setup.particles.count))
    if start.state is not None:
        start.state(setup.particles)
    with RunFolder.create(folder, True) as run_folder:
        outcome = Run(case, setup, run_folder, Listener()).go()
    if outcome.signal:
        raise KeyboardInterrupt
    return Ran(case, folder, outcome.summary)


PLAIN = ("computed", "mean", "tip")  # labels that say nothing beside the formulation's name


def draw(verdicts: Sequence[Verdict], folder: Path) -> list[Path]:
    """Draw ``PROBLEM.TRIAL.png`` for every trial that has curves, and return the files."""
    folder.mkdir(parents=True, exist_ok=True)
    trials = dict.fromkeys((one.problem, one.trial) for one in verdicts if one.curves)
    return [_draw([one for one in verdicts if (one.problem, one.trial) == trial], folder) for trial in trials]


def file_name(problem: str, trial: str) -> str:
    """Return the name of a trial's picture."""
    words = "".join(letter if letter.isalnum() or letter == "." else " " for letter in trial)
    return f"{problem}.{'_'.join(words.split())}.png"


def _draw(verdicts: Sequence[Verdict], folder: Path) -> Path:
    panels: dict[str, list[Curve]] = {}
    for verdict in verdicts:
        for column, curves in verdict.curves.items():
            into = panels.setdefault(column, [])
            before = any(curve.exact for curve in into)
            for curve in curves:
                if not curve.exact:
                    suffix = "" if curve.label in PLAIN else f", {curve.label}"
                    into.append(replace(curve, label=f"{verdict.formulation}{suffix}"))
                elif not before:
                    into.append(curve)
    first = verdicts[0]
    example = next(v for v in verdicts if v.curves)
    path = folder / file_name(first.problem, first.trial)
    return curves_picture(
        panels,
        path,
        title=f"{first.problem}: {first.trial}",
        across=example.across,
        unitless=example.unitless,
        units=example.units,
    )
