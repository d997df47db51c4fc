"""All verification problems by name: those of the package, and those of a source checkout."""

from .checkout import checkout_module
from .problem import Problem
from .problems import bars, hugoniot, noh, plate, sod

_QUICK = (hugoniot.PROBLEM, plate.PROBLEM, sod.SOD_PROBLEM, sod.BLAST_PROBLEM, noh.PROBLEM, bars.PROBLEM)
_OTHERS = checkout_module("problems")

PROBLEMS: dict[str, Problem] = {problem.name: problem for problem in _QUICK}
PROBLEMS |= _OTHERS.PROBLEMS if _OTHERS is not None else {}
