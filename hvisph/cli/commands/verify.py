"""`hvisph verify`: comparison of computed and exact results."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from hvisph.cli.options import JsonOption, QuietOption, SetOption, ThreadsOption
from hvisph.cli.text.echo import say
from hvisph.cli.text.formatting import echo_json, table
from hvisph.core.errors import CaseError, suggest_nearest

READABLE = {"Pa": (1e-9, "GPa"), "J/kg": (1e-3, "kJ/kg")}  # units that read better than SI's own


def verify(
    names: Annotated[
        list[str] | None, typer.Argument(metavar="[NAME]...", help="Problems to run; they are listed unless given.")
    ] = None,
    every: Annotated[bool, typer.Option("--all", help="Run all problems.")] = False,
    formulations: Annotated[
        list[str] | None,
        typer.Option("--formulation", metavar="TYPE", help="Only this formulation, or `default`. Repeatable."),
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Coarse forms, seconds each.")] = False,
    only: Annotated[
        str, typer.Option("--only", metavar="TEXT", help="Only trials whose name contains TEXT: '12 km/s'.")
    ] = "",
    resolution: Annotated[
        str | None, typer.Option("--resolution", metavar="LENGTH", help="Particle spacing in place of the problem's.")
    ] = None,
    seeds: Annotated[
        int | None,
        typer.Option("--seeds", min=1, metavar="N", help="Number of random initial states, where there are any."),
    ] = None,
    settings: SetOption = None,
    threads: ThreadsOption = None,
    keep: Annotated[
        Path | None,
        typer.Option("--keep", metavar="DIR", help="Keep the runs in this folder; they are deleted unless given."),
    ] = None,
    pictures: Annotated[
        Path | None,
        typer.Option(
            "--pictures", metavar="DIR", help="Write pictures of computed and exact solutions into this folder."
        ),
    ] = None,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Run problems with an exact solution; print computed and exact values and tolerances.

    Exit codes: 0 all passed, 1 some failed or nothing could run, 2 invalid input.
    """
    from hvisph.verification.catalogue import PROBLEMS

    if not names and not every:
        _list(PROBLEMS, as_json)
        return
    chosen = list(PROBLEMS) if every else list(names or ())
    wanted = _formulations(formulations)
    for name in chosen:
        _require_known(name, list(PROBLEMS), "problem", "NAME")
    from hvisph.verification.problem import Options
    from hvisph.verification.runner import verdicts

    options = Options(quick, _length(resolution), seeds)
    if only:
        trials = [trial.name for name in chosen for trial in PROBLEMS[name].trials(options)]
        if not any(only.lower() in trial.lower() for trial in trials):
            raise CaseError(f"no trial's name holds '{only[:200]}'; there are: {', '.join(trials)}", where="--only")
    results: list[Any] = []
    for name in chosen:
        problem, heading = PROBLEMS[name], f"\n{name}: {PROBLEMS[name].title}"
        if not as_json and not quiet:
            say(heading)
            for one in [one for one in wanted if formulations and one not in problem.formulations]:
                say(f"  {one}: not run, {problem.why_not}")
        for verdict in verdicts(problem, wanted, options, settings or (), only=only, keep=keep, threads=threads):
            results.append(verdict)
            if not as_json and not quiet:
                say(_text(verdict))
    if pictures is not None:
        from hvisph.verification.pictures import draw

        draw(results, pictures)
    judged = [one for one in results if one.passed is not None]
    good = sum(bool(one.passed) for one in judged)
    if as_json:
        echo_json([one.as_dict() for one in results])
    elif not quiet:
        refused = f"; {len(results) - len(judged)} could not run" if len(results) > len(judged) else ""
        say(f"\n{good} of {len(judged)} as asked{refused}" if judged else "\nnothing was judged: no trial could run")
    raise typer.Exit(0 if judged and good == len(judged) else 1)


def _require_known(name: str, known: list[str], what: str, where: str) -> None:
    from hvisph.verification.checkout import FOLDER

    if name not in known:
        more = (
            ""
            if what != "problem" or FOLDER.is_dir()
            else "; a source checkout has more problems than this installation"
        )
        raise CaseError(f"there is no {what} '{name[:200]}'{suggest_nearest(name[:200], known)}{more}", where=where)


def _formulations(asked: list[str] | None) -> list[str]:
    from hvisph.verification.problem import ALL
    from hvisph.verification.runner import default_formulation

    for name in asked or ():
        _require_known(name, [*ALL, "default"], "formulation", "--formulation")
    return [default_formulation() if name == "default" else name for name in asked or ALL]


def _length(text: str | None) -> float | None:
    if text is None:
        return None
    from hvisph.case.dimensions import LENGTH
    from hvisph.case.units import parse_quantity

    try:
        return parse_quantity(text, LENGTH)
    except ValueError as error:
        raise CaseError(str(error), where="--resolution") from None


def _list(problems: dict[str, Any], as_json: bool) -> None:
    rows = [(p.name, "slow" if p.slow else "", p.title) for p in problems.values()]
    if as_json:
        echo_json([{"name": p.name, "title": p.title, "slow": p.slow, "formulations": list(p.formulations)}
                   for p in problems.values()])  # fmt: skip
        return
    say(table(rows, indent=0))
    say("\nRun with: hvisph verify NAME... [--quick] [--formulation TYPE], or --all")


def _text(verdict: Any) -> str:
    head = f"  {verdict.trial}, {verdict.formulation} ({verdict.seconds:.1f} s)"
    if verdict.status != "done":
        return f"{head}\n    {'cannot run' if verdict.status == 'refused' else 'FAILED'}: {verdict.message}"
    rows = [("", "computed", "exact", "off", "asked", "")]
    for f in verdict.figures:
        off, asked = (f"{100 * f.off:+.3g} %", f"{100 * f.tolerance:.3g} %") if f.relative else (
            f"{f.off:+.3g}", f"{f.tolerance:.3g}")  # fmt: skip
        factor, unit = READABLE.get(f.unit, (1.0, f.unit))
        name = f"{f.name} [{unit}]" if unit else f.name
        rows.append((name, f"{factor * f.found:.5g}", f"{factor * f.exact:.5g}", off, asked,
                     "pass" if f.passed else "FAIL"))  # fmt: skip
    return f"{head}\n{table(rows, indent=4)}"
