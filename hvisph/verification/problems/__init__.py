"""The problems, one a file, and the table of them."""

from hvisph.verification.problem import Problem

from . import (
    axisymmetric,
    axisymmetric_bodies,
    bars,
    cantilever,
    core,
    friction,
    hugoniot,
    impacts,
    implosion,
    invariance,
    noh,
    plate,
    random_collisions,
    separation,
    sod,
    spacings,
    spall,
    spinning_disc,
    symmetry,
    tension,
)

PROBLEMS: dict[str, Problem] = {
    problem.name: problem
    for problem in (
        hugoniot.PROBLEM,
        plate.PROBLEM,
        sod.SOD_PROBLEM,
        sod.BLAST_PROBLEM,
        noh.PROBLEM,
        tension.PROBLEM,
        spall.PROBLEM,
        bars.PROBLEM,
        spacings.PROBLEM,
        friction.PROBLEM,
        friction.WALLS,
        separation.PROBLEM,
        cantilever.PROBLEM,
        spinning_disc.PROBLEM,
        implosion.PROBLEM,
        axisymmetric.PROBLEM,
        axisymmetric.GAS_PROBLEM,
        axisymmetric_bodies.PROBLEM,
        core.PROBLEM,
        impacts.PROBLEM,
        random_collisions.PROBLEM,
        invariance.PROBLEM,
        symmetry.PROBLEM,
    )
}
