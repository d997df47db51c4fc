"""`hvisph correlations`: empirical correlations for a case, without running it."""

from __future__ import annotations

import typer

from hvisph.cli.loading import load
from hvisph.cli.options import CaseArgument, JsonOption, ResolutionOption, SetOption
from hvisph.cli.text.formatting import echo_json, table
from hvisph.core.measure_catalogue import axis_unit


def correlations(
    case: CaseArgument,
    resolution: ResolutionOption = None,
    settings: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Evaluate the empirical correlations whose range covers a case: crater, hole, single and Whipple walls."""
    loaded = load(case, settings, resolution)
    from hvisph.measures import correlations as formulas
    from hvisph.precheck.correlation_input import impact_of

    impact, reason = impact_of(loaded)
    known = formulas.correlations(impact) if impact is not None else []
    if as_json:
        echo_json({"correlations": [one.as_dict() for one in known], "reason": reason})
        return
    typer.echo(loaded.title or case)
    typer.echo(correlations_text([one.as_dict() for one in known], reason))


def correlations_text(known: list[dict[str, object]], reason: str = "") -> str:
    """Return correlations in their plain form as text."""
    if not known:
        return f"no correlation holds here{f': {reason}' if reason else ': all are out of their range'}"
    lines = [("correlation", "", "", "")]
    for one in known:
        value = one["value"]
        assert isinstance(value, float)
        unit, factor = axis_unit("mm", [value])
        what = f"{one['name']}: {one['quantity']}"
        lines.append((what, f"{factor * value:.2f} {unit}", str(one["text"]), str(one["source"])))
    return table(lines)
