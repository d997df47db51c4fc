"""`hvisph verify` and `validate`: comparison with exact solutions and with experiments."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from hvisph.cli.formatting import echo_json, say, table
from hvisph.cli.guard import FAILED
from hvisph.cli.options import JsonOption, QuietOption, SetOption, ThreadsOption, argument, option, parse_option, shared
from hvisph.core.errors import CaseError, suggest_nearest
from hvisph.verification.problem import ALL, Options, Problem
from hvisph.verification.runner import FOLDER, PROBLEMS, Verdict, default_formulation, draw, require_module, verdicts

from .sweep import WorkerOptions, go

if TYPE_CHECKING:
    from hvisph_validation.experiments import Experiments, Form
    from hvisph_validation.results import SetResult


READABLE = {"Pa": (1e-9, "GPa"), "J/kg": (1e-3, "kJ/kg")}  # units that read better than SI's own


def verify(
    names: list[str] | None = argument("[NAME]...", "Problems to run; they are listed unless given.", None),
    all_problems: bool = option("--all", "Run all problems.", False),
    formulations: list[str] | None = option(
        "--formulation TYPE", "Only this formulation, or `default`. Repeatable.", None
    ),
    quick: bool = option("--quick", "Coarse forms, seconds each.", False),
    only: str = option("--only TEXT", "Only trials whose name contains TEXT: '12 km/s'.", ""),
    resolution: str | None = option("--resolution LENGTH", "Particle spacing in place of the problem's.", None),
    seeds: int | None = option("--seeds N", "Number of random initial states, where there are any.", None, min=1),
    settings: SetOption = None,
    threads: ThreadsOption = None,
    keep: Path | None = option("--keep DIR", "Keep the runs in this folder; they are deleted unless given.", None),
    pictures: Path | None = option(
        "--pictures DIR", "Write pictures of computed and exact solutions into this folder.", None
    ),
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Run problems with an exact solution; print computed and exact values and tolerances.

    Exit codes: 0 all passed, 1 some failed or nothing could run, 2 invalid input.
    """
    if not names and not all_problems:
        _list(PROBLEMS, as_json)
        return
    selection = list(PROBLEMS) if all_problems else list(names or ())
    types = _formulations(formulations)
    for name in selection:
        _require_known(name, list(PROBLEMS), "problem", "NAME")
    spacing = None if resolution is None else parse_option(resolution, "LENGTH", "--resolution")
    options = Options(quick, spacing, seeds)
    if only:
        trials = [trial.name for name in selection for trial in PROBLEMS[name].trials(options)]
        if not any(only.lower() in trial.lower() for trial in trials):
            raise CaseError(f"no trial's name holds '{only[:200]}'; there are: {', '.join(trials)}", where="--only")
    results: list[Verdict] = []
    for name in selection:
        problem, heading = PROBLEMS[name], f"\n{name}: {PROBLEMS[name].title}"
        if not as_json and not quiet:
            say(heading)
            for kind in [kind for kind in types if formulations and kind not in problem.formulations]:
                say(f"  {kind}: not run, {problem.why_not}")
        for verdict in verdicts(problem, types, options, settings or (), only=only, keep=keep, threads=threads):
            results.append(verdict)
            if not as_json and not quiet:
                say(_text(verdict))
    if pictures is not None:
        draw(results, pictures)
    judged = [judgement for judgement in results if judgement.passed is not None]
    passed = sum(bool(judgement.passed) for judgement in judged)
    if as_json:
        echo_json([judgement.as_dict() for judgement in results])
    elif not quiet:
        note = f"; {len(results) - len(judged)} could not run" if len(results) > len(judged) else ""
        say(f"\n{passed} of {len(judged)} passed{note}" if judged else "\nno trial could run")
    raise typer.Exit(0 if judged and passed == len(judged) else 1)


def _require_known(name: str, allowed: list[str], noun: str, where: str) -> None:
    if name not in allowed:
        hint = "" if noun != "problem" or FOLDER.is_dir() else "; a source checkout has more problems"
        raise CaseError(f"there is no {noun} '{name[:200]}'{suggest_nearest(name[:200], allowed)}{hint}", where=where)


def _formulations(types: list[str] | None) -> list[str]:
    for name in types or ():
        _require_known(name, [*ALL, "default"], "formulation", "--formulation")
    return [default_formulation() if name == "default" else name for name in types or ALL]


def _list(problems: Mapping[str, Problem], as_json: bool) -> None:
    rows = [(p.name, "slow" if p.slow else "", p.title) for p in problems.values()]
    if as_json:
        echo_json(
            [
                {"name": p.name, "title": p.title, "slow": p.slow, "formulations": list(p.formulations)}
                for p in problems.values()
            ]
        )
        return
    say(table(rows, indent=0))
    say("\nRun with: hvisph verify NAME... [--quick] [--formulation TYPE], or --all")


def _text(verdict: Verdict) -> str:
    head = f"  {verdict.trial}, {verdict.formulation} ({verdict.seconds:.1f} s)"
    if verdict.status != "done":
        return f"{head}\n    {'cannot run' if verdict.status == 'refused' else 'FAILED'}: {verdict.message}"
    rows = [("", "computed", "exact", "off", "asked", "")]
    for f in verdict.figures:
        error, limit = (
            (f"{100 * f.off:+.3g} %", f"{100 * f.tolerance:.3g} %")
            if f.relative
            else (f"{f.off:+.3g}", f"{f.tolerance:.3g}")
        )
        factor, unit = READABLE.get(f.unit, (1.0, f.unit))
        name = f"{f.name} [{unit}]" if unit else f.name
        rows.append(
            (name, f"{factor * f.found:.5g}", f"{factor * f.exact:.5g}", error, limit, "pass" if f.passed else "FAIL")
        )
    return f"{head}\n{table(rows, indent=4)}"


@shared
def validate(
    how: WorkerOptions,
    names: list[str] | None = argument("[NAME]...", "Sets to compute; they are listed unless given.", None),
    all_sets: bool = option("--all", "Compute all sets.", False),
    second: bool = option("--second-resolution", "Second, coarser resolution, for the discretization error.", False),
    coarse: bool = option("--coarse", "Coarse form, seconds per shot, as a test.", False),
    particles_across: float | None = option(
        "--particles-across N", "Number of particles across; the set's unless given.", None, min=2
    ),
    only: str | None = option("--only WHAT", "failed, interrupted, or numbers of shots: 3..7.", None),
    table: bool = option("--table", "Show the results and run nothing.", False),
    out: Path | None = option("--out DIR", "Folder of all runs; validation unless given.", None),
    page: Path | None = option(
        "--page FILE", "Write a page, with results and pictures in a folder of the same name.", None
    ),
) -> None:
    """Compute sets of experiments and print measured and computed values; the command continues an interrupted set.

    Exit codes: 0 all within tolerance, 1 some not, 2 invalid input, 3 a shot failed, 130 interrupted.
    """
    require_module("experiments")
    if second and coarse:
        raise CaseError("give either --second-resolution or --coarse", where="--coarse")
    from hvisph_validation.experiments import Experiments, experiment_names

    selection = list(dict.fromkeys(names or ())) or (experiment_names() if all_sets else [])
    sets = [Experiments(name) for name in selection]
    if not sets and (only is not None or table):
        raise CaseError("name a set, or give --all", where="--table" if table else "--only")
    if not sets and page is None:
        _list_sets([Experiments(name) for name in experiment_names()], how.as_json)
        return
    form: Form = "coarse" if coarse else "second" if second else "full"
    sets_done = []
    if table and all_sets:
        sets = list(_sets_with_results(sets, form, particles_across, out))
    for experiments in sets:
        sets_done.append(_compute_set(experiments, form, particles_across, only, table, out, how))
        if not how.silent:
            from hvisph_validation.terminal import result_text

            say(result_text(experiments, sets_done[-1]))
    if page is not None:
        from hvisph_validation.report import write_page

        say(str(write_page(page, sets_done)), err=how.as_json)
    _end(sets, sets_done, how.as_json)


def _sets_with_results(
    sets: list[Experiments], form: Form, particles_across: float | None, out: Path | None
) -> Iterator[Experiments]:
    from hvisph_validation.evaluation import folders

    for experiments in sets:
        try:
            folders(experiments, form, particles_across, out, there=True)
        except CaseError as error:
            say(str(error), err=True)
        else:
            yield experiments


def _compute_set(
    experiments: Experiments,
    form: Form,
    particles_across: float | None,
    only: str | None,
    table: bool,
    out: Path | None,
    how: WorkerOptions,
) -> SetResult:
    from hvisph_validation.evaluation import folders, result

    sweeps = folders(experiments, form, particles_across, out, table)
    if not table:
        for folder in sweeps.values():
            go(folder, how, only)
    return result(experiments, experiments.particles(form, particles_across), sweeps)


def _end(sets: list[Experiments], results: list[SetResult], as_json: bool) -> None:
    from hvisph_validation.comparison import verdicts

    judged = {s.name: verdicts(result.rows, s.model.required) for s, result in zip(sets, results, strict=True)}
    if as_json:
        echo_json([result.as_dict() | {"verdicts": [asdict(v) for v in judged[result.name]]} for result in results])
    if any(shot["status"] in ("failed", "error", "killed") for result in results for shot in result.shots.values()):
        raise typer.Exit(FAILED)
    if any(item.passed is False for verdict in judged.values() for item in verdict):
        raise typer.Exit(1)


def _list_sets(sets: list[Experiments], as_json: bool) -> None:
    if as_json:
        echo_json([{"name": s.name, "shots": len(s.shots), **s.model.model_dump(mode="json")} for s in sets])
        return
    shots = [f"{len(s.shots)} shot{'s' * (len(s.shots) > 1)}" for s in sets]
    say(table([(s.name, count, s.model.title) for s, count in zip(sets, shots, strict=True)], indent=0))
    say("\nRun with: hvisph validate NAME... [--coarse | --second-resolution], or --all")
