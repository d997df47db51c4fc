"""The problems, one a file; the table of them."""

from hvisph.verification.problem import Problem
from hvisph.verification.problems import bars, hugoniot, noh, plate, sod

PROBLEMS: dict[str, Problem] = {
    problem.name: problem
    for problem in (
        hugoniot.PROBLEM,
        plate.PROBLEM,
        sod.SOD_PROBLEM,
        sod.BLAST_PROBLEM,
        noh.PROBLEM,
        bars.PROBLEM,
    )
}
