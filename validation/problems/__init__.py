"""Verification problems of a source checkout, one a file, and the table of them."""

from hvisph.verification.problem import Problem

from . import (
    axisymmetric,
    axisymmetric_bodies,
    cantilever,
    core,
    elastic_bodies,
    friction,
    impacts,
    implosion,
    invariance,
    noh,
    notched_bar,
    porous,
    random_collisions,
    separation,
    spacings,
    spall,
    spinning_disc,
    symmetry,
    tension,
)

PROBLEMS: dict[str, Problem] = {
    problem.name: problem
    for problem in (
        noh.PROBLEM,
        tension.PROBLEM,
        spall.PROBLEM,
        spacings.PROBLEM,
        friction.PROBLEM,
        friction.WALLS,
        separation.PROBLEM,
        cantilever.PROBLEM,
        elastic_bodies.PROBLEM,
        elastic_bodies.REBOUND,
        spinning_disc.PROBLEM,
        spinning_disc.ORTHOTROPIC,
        implosion.PROBLEM,
        axisymmetric.PROBLEM,
        axisymmetric.GAS_PROBLEM,
        axisymmetric_bodies.PROBLEM,
        core.PROBLEM,
        notched_bar.PROBLEM,
        porous.PROBLEM,
        impacts.PROBLEM,
        random_collisions.PROBLEM,
        invariance.PROBLEM,
        symmetry.PROBLEM,
    )
}
