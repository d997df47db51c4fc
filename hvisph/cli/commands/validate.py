"""`hvisph validate`: comparison of computed and measured results of experiments."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hvisph.cli.guard import FAILED
from hvisph.cli.sweep_options import Running, shared
from hvisph.cli.text.echo import say
from hvisph.cli.text.formatting import echo_json, table
from hvisph.core.errors import CaseError

from .sweep import go

if TYPE_CHECKING:
    from hvisph_validation.experiments import Experiments, Form
    from hvisph_validation.results import SetResult


@shared
def validate(
    how: Running,
    names: Annotated[
        list[str] | None, typer.Argument(metavar="[NAME]...", help="Sets to compute; they are listed unless given.")
    ] = None,
    every: Annotated[bool, typer.Option("--all", help="Compute all sets.")] = False,
    second: Annotated[
        bool,
        typer.Option("--second-resolution", help="Second, coarser resolution, for the discretization error."),
    ] = False,
    coarse: Annotated[bool, typer.Option("--coarse", help="Coarse form, seconds per shot, as a test.")] = False,
    across: Annotated[
        float | None,
        typer.Option(
            "--particles-across", min=2, metavar="N", help="Number of particles across; the set's unless given."
        ),
    ] = None,
    only: Annotated[
        str | None, typer.Option("--only", metavar="WHAT", help="failed, interrupted, or numbers of shots: 3..7.")
    ] = None,
    table: Annotated[bool, typer.Option("--table", help="Show the results and run nothing.")] = False,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Folder of all runs; validation unless given.")
    ] = None,
    page: Annotated[
        Path | None,
        typer.Option(
            "--page", metavar="FILE", help="Write a page, with results and pictures in a folder of the same name."
        ),
    ] = None,
) -> None:
    """Compute sets of experiments and print measured and computed values; the command continues an interrupted set.

    Exit codes: 0 all as asked, 1 some not, 2 invalid input, 3 a shot failed, 130 interrupted.
    """
    from hvisph.verification.checkout import require_module

    require_module("experiments")
    if second and coarse:
        raise CaseError("give either --second-resolution or --coarse", where="--coarse")
    from hvisph_validation.experiments import Experiments, experiment_names

    chosen = list(dict.fromkeys(names or ())) or (experiment_names() if every else [])
    sets = [Experiments(name) for name in chosen]
    if not sets and (only is not None or table):
        raise CaseError("name a set, or give --all", where="--table" if table else "--only")
    if not sets and page is None:
        _list([Experiments(name) for name in experiment_names()], how.as_json)
        return
    form: Form = "coarse" if coarse else "second" if second else "full"
    sets_done = []
    if table and every:
        sets = list(_sets_with_results(sets, form, across, out))
    for one in sets:
        sets_done.append(_compute_set(one, form, across, only, table, out, how))
        if not how.silent:
            from hvisph_validation.terminal import result_text

            say(result_text(one, sets_done[-1]))
    if page is not None:
        from hvisph_validation.report import write_page

        say(str(write_page(page, sets_done)), err=how.as_json)
    _end(sets, sets_done, how.as_json)


def _sets_with_results(
    sets: list[Experiments], form: Form, across: float | None, out: Path | None
) -> Iterator[Experiments]:
    """Yield the sets with results, and report the others."""
    from hvisph_validation.evaluation import folders

    for one in sets:
        try:
            folders(one, form, across, out, there=True)
        except CaseError as error:
            say(str(error), err=True)
        else:
            yield one


def _compute_set(experiments: Experiments, form: Form, across: float | None, only: str | None, table: bool,
              out: Path | None, how: Running) -> SetResult:  # fmt: skip
    """Compute the remaining experiments of a set and return its results."""
    from hvisph_validation.evaluation import folders, result

    from hvisph.sweeps.selection import Selection

    sweeps = folders(experiments, form, across, out, table)
    if not table:
        for folder in sweeps.values():
            go(folder, how, Selection.parse(only), only)
    return result(experiments, experiments.particles(form, across), sweeps)


def _end(sets: list[Experiments], results: list[SetResult], as_json: bool) -> None:
    from hvisph_validation.comparison import verdicts

    said = {one.name: verdicts(result.rows, one.model.asked) for one, result in zip(sets, results, strict=True)}
    if as_json:
        echo_json([result.as_dict() | {"verdicts": [asdict(one) for one in said[result.name]]} for result in results])
    if any(one["status"] in ("failed", "error", "killed") for result in results for one in result.shots.values()):
        raise typer.Exit(FAILED)
    if any(one.passed is False for verdict in said.values() for one in verdict):
        raise typer.Exit(1)


def _list(sets: list[Experiments], as_json: bool) -> None:
    if as_json:
        echo_json([{"name": one.name, "shots": len(one.shots), **one.model.model_dump(mode="json")} for one in sets])
        return
    say(table([(one.name, f"{len(one.shots)} shots", one.model.title) for one in sets], indent=0))
    say("\nRun with: hvisph validate NAME... [--coarse | --second-resolution], or --all")
