"""Single lines of physics, each made wrong, and the tests that must notice: a list of what the tests are worth.

    python benchmarks/mutations.py [--only WORD] [--kept FILE]

Each mutation is made in a copy of the sources, and the test that is likeliest to see it runs on that copy. A mutation
that survives is printed with its line. What was seen is kept in a file, so that a second call goes on.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


@dataclass(frozen=True)
class Mutation:
    """A line of `file`, `old`, that becomes `new`; `test` is what must fail: a file, and words for -k."""

    what: str
    file: str
    old: str
    new: str
    test: str


TWIN, PRINTED_TWIN = "test_total_lagrangian_twin.py -k 2-", "test_total_lagrangian_twin.py -k 3-"
LENGTHS = "test_lengths_and_clamps.py"
RESPONSE = "test_materials_response.py"
MUTATIONS = [
    Mutation("brittle: no flaws but those dealt out", "materials/damage/grady_kipp.py",
             "max(min((strain / least) ** exponent, number), row[FLAWS] * strain ** row[EXPONENT])",
             "min((strain / least) ** exponent, number)", "test_materials_models.py -k brittle"),
    Mutation("damage that is coupled takes nothing", "materials/damage/johnson_cook.py",
             "1.0 - row[SOFTENING] * harm", "1.0", f"{RESPONSE} -k coupled"),
    Mutation("thin rings of standard SPH thin without end", "schemes/standard/scheme.py",
             "if self.revolved else 0.0", "if False else 0.0", "test_axisymmetric.py -k thin_rings"),
    Mutation("the bore of a ring is a void", "measures/debris/voids.py", "if len(begun) else 0", "if False else 0",
             "test_measure_groups.py -k bore"),
    Mutation("an oblique plate seen from behind", "visualization/camera.py", "key=lambda angles: float(",
             "key=lambda angles: -float(", "test_pictures_view.py -k oblique"),
    Mutation("a layer's own openings count as ways through", "measures/target/perforation.py",
             "if not plate.open or scene.start is None:", "if True:", "test_measure_openings.py -k from_the_start"),
    Mutation("residual before the projectile is through", "measures/frame/has_passed.py",
             "if not is_behind(scene, plate):", "if False:", "test_measure_openings.py -k residual"),
    Mutation("Total Lagrangian density without J", "schemes/total_lagrangian/deformation_gradient.py",
             "rows[i, M] / (volume[i] * section)", "rows[i, M] / volume[i]", TWIN),
    Mutation("Total Lagrangian stress without J", "schemes/total_lagrangian/deformation_gradient.py",
             "stress = times(j, product(", "stress = times(1.0, product(", TWIN),
    Mutation("power of viscosity not halved", "schemes/total_lagrangian/law.py",
             "-= 0.5 * inverse_rho0 * total(power)", "-= inverse_rho0 * total(power)", TWIN),
    Mutation("hourglass control twice as stiff", "schemes/total_lagrangian/law.py", "0.5 * hourglass * w", "hourglass * w", TWIN),
    Mutation("printed viscosity with a wrong sign", "schemes/total_lagrangian/law.py",
             "both_w = minus(times(b[IJ], nw)", "both_w = plus(times(b[IJ], nw)", PRINTED_TWIN),
    Mutation("secant modulus blind to damage", "schemes/total_lagrangian/deformation_gradient.py",
             " * (1.0 - min(damage, 1.0))", "", TWIN),
    Mutation("no share of the viscosity in shear", "schemes/total_lagrangian/deformation_gradient.py",
             "shear_share(full) * c if SHEARS else c", "c", TWIN),
    Mutation("volume jumps where neighbours leave", "schemes/total_lagrangian/deformation_gradient.py",
             "section = swellings[i] * of_list", "section = of_list", "test_total_lagrangian.py -k volume_goes_on"),
    Mutation("contact: frequency without its second part", "sph/contact/repulsion.py",
             "+ 3.0 * power_of_w * at_zero * ih * ih", "", "test_contact.py -k frequency"),
    Mutation("contact: all of the work on each side", "sph/contact/repulsion.py",
             "-0.5 * scale_own * total(power)", "-scale_own * total(power)", "test_contact.py -k 'work or energy'"),
    Mutation("contact: the stiffer of two", "sph/contact/repulsion.py",
             "both = other * b[V] * min(stiffness, b[K])", "both = other * b[V] * max(stiffness, b[K])", "test_contact.py"),
    Mutation("contact: loaded where it starts", "sph/contact/penalty_contact.py",
             "max(phi - rows[i, START], 0.0)", "max(phi, 0.0)", "test_contact.py -k unloaded"),
    Mutation("sliding contact: friction pulls", "schemes/riemann/law.py",
             "constants[1] * t_n)", "-constants[1] * t_n)", "test_sph_laws.py -k 'formulas and separating-2'"),
    Mutation("more tension than bearable", "schemes/riemann/law.py",
             "t_n = min(t_n, min(rows[i, TENSION_LIMIT], cold[TENSION_LIMIT]))", "t_n = min(t_n, rows[i, TENSION_LIMIT])",
             "test_sph_laws.py -k 'formulas and consistent-2'"),
    Mutation("density of pairs in tension is the number", "sph/terms/riemann_solver.py",
             "inverse * inverse * min(t, 0.0)", "inverse * inverse * t",
             "test_sph_laws.py -k 'formulas and consistent-2'"),
    Mutation("variable h: no term of the own kernel", "schemes/riemann/law.py",
             " + scale(1.0 / h) * DIM * shape(0.0)", "", "test_sph_laws.py -k 'formulas and following-2'"),
    Mutation("variable h follows the volume, not its root", "integrators/particle_steps.py",
             "grown(dt * swelling / DIM), h_low", "grown(dt * swelling), h_low", LENGTHS),
    Mutation("variable h without its largest value", "integrators/particle_steps.py",
             "min(max(now.h * grown(dt * swelling / DIM), h_low), h_high)",
             "max(now.h * grown(dt * swelling / DIM), h_low)", f"{LENGTHS} -k limits"),
    Mutation("what clamps take is not counted", "integrators/particle_update.py",
             "in_space(times(mass, resting)), of_force)", "in_space(times(0.0, resting)), of_force)",
             f"{LENGTHS} -k held"),
    Mutation("clamped particles are pushed", "integrators/particle_steps.py",
             "a = times(free, a)", "a = times(1.0, a)", f"{LENGTHS} -k held"),
    Mutation("clamped particles of projection are pushed", "schemes/projection/law.py",
             "                a = no_vector(DIM)\n", "", "test_projection.py -k clamped"),
    Mutation("energy without the work at the mean velocity", "integrators/particle_steps.py",
             "now.e + dt * (power - missing)", "now.e + dt * power", "test_integrators_schemes.py -k energy"),
    Mutation("sheets keep their density as they thin", "integrators/particle_steps.py",
             "rho *= grown(-dt * (swelling + zz))", "rho *= grown(-dt * swelling)", "test_plane_stress.py"),
    Mutation("rings: no hoop in the density", "integrators/particle_steps.py",
             "rho *= grown(-dt * (swelling + hoop))", "rho *= grown(-dt * swelling)", "test_axisymmetric.py"),
    Mutation("stress turned half as far", "materials/stress_update.py",
             "times(0.25 * dt, curl(l))", "times(0.125 * dt, curl(l))", f"{RESPONSE} -k 'rotat'"),
    Mutation("artificial stress one power higher", "schemes/standard/law.py",
             "range(EXPONENT - 1)", "range(EXPONENT)", "test_sph_standard_options.py -k exponent"),
    Mutation("dissipation of density cools", "schemes/standard/law.py",
             "power -= 0.5 * inverse_rho * flow", "power += 0.5 * inverse_rho * flow",
             "test_sph_standard_options.py -k dissipation_heats"),
    Mutation("corrections without the own volume", "sph/terms/kernel_correction.py",
             " + rows[i, M] / rows[i, RHO] * scale(1.0 / h) * h * shape(0.0)", "", "test_corrections.py -k sums_to_one"),
    Mutation("corrections: shift without its sign", "sph/terms/kernel_correction.py",
             "times(-inverse_s * inverse_s,", "times(inverse_s * inverse_s,", "test_corrections.py -k formulas"),
    Mutation("spin: half of the pairs' torque is not told", "schemes/riemann/law.py",
             "spin = times(-0.5, made)", "spin = times(-0.25, made)", "test_angular_momentum.py -k 'formulas and contact-2'"),
    Mutation("spin: what the own w takes back is not told", "schemes/riemann/law.py",
             "spin = minus(spin, on_rows(inertia", "spin = plus(spin, on_rows(inertia",
             "test_angular_momentum.py -k 'formulas and contact-2'"),
    Mutation("spin: turning strains the edges", "schemes/standard/law.py",
             "minus(identity(l), matrix(moment))))", "minus(identity(l), identity(l))))",
             "test_angular_momentum.py -k turning_strains_nothing"),
    Mutation("spin: taken back at half the rate", "schemes/standard/law.py",
             "turning(own_axial(rows, i, SPIN_STRESS, DIM))", "turning(times(0.5, own_axial(rows, i, SPIN_STRESS, DIM)))",
             "test_angular_momentum.py -k 'formulas and standard-2'"),
    Mutation("edges: density forgets them", "sph/terms/free_surface_correction.py",
             "(1.0 - opened) * rate + opened * divergence(l)", "rate", "test_sph_laws.py -k 'formulas and consistent-2'"),
    Mutation("edges: a front is one", "sph/terms/free_surface_correction.py",
             " * max(1.0 - closing / FRONT, 0.0)", "", "test_sph_laws.py -k 'formulas and consistent-2'"),
    Mutation("rings: both rates of the axis change places", "sph/terms/axisymmetric.py",
             "return 0.5 * max(1.0 - ring / h, 0.0)", "return max(1.0 - ring / h, 0.0)", "test_axisymmetric_twin.py"),
    Mutation("rings: an image over the axis works as another ring", "sph/terms/axisymmetric.py",
             "own - (2.0 * real - 1.0) * its", "own - its", "test_axisymmetric_twin.py"),
    Mutation("rings: Riemann problems press through the axis", "sph/terms/axisymmetric.py",
             "radial(e) * min(apart, 0.0) *", "0.0 * min(apart, 0.0) *", "test_axisymmetric_twin.py"),
    Mutation("rings of a reference: held by the wrong face", "schemes/total_lagrangian/deformation_gradient.py",
             "held = (left * stress[DIM * DIM - 1] - around)", "held = (stress[DIM * DIM - 1] - around)",
             "test_axisymmetric_lagrangian.py -k formulas"),
    Mutation("squeezed matter keeps its step", "schemes/total_lagrangian/deformation_gradient.py",
             "* max(shrunk, 1.0)", "", "test_total_lagrangian.py -k squeezed"),
    Mutation("Us-up table: no curve in the speed of sound", "materials/eos/us_up_table.py",
             "d, bends = 1.0 - s * eta, 1.0 + s * eta", "d, bends = 1.0 - s * eta, 1.0", "test_materials_eos.py"),
    Mutation("Us-up table: the first piece for all", "materials/eos/us_up_table.py",
             "at = PIECE + 3 * (int(row[PIECES]) - 1)", "at = PIECE", "test_materials_points.py"),
    Mutation("heat capacity: one scale for all densities", "materials/isentrope.py",
             "heat *= per_theta + share * (next_per_theta - per_theta)", "heat *= 1.0", "test_materials_points.py"),
    Mutation("pieces: the smallest keeps the number", "sph/neighbours/connected_components.py",
             "np.lexsort((least, -sizes, of))", "np.lexsort((least, sizes, of))", "test_fragmentation.py -k keeps"),
    Mutation("pieces: cells along one axis alone", "sph/neighbours/connected_components.py",
             "for shift in range(np.uint64(3**DIM)):", "for shift in range(np.uint64(3)):", "test_fragmentation.py -k pairs"),
    Mutation("unlike spacings: one length for both", "sph/contact/variable_resolution.py",
             "(depth_a / h_a + depth_b / h_b) / (depth_a + depth_b)", "2.0 / (h_a + h_b)", "test_sph_laws.py -k 'formulas and unlike-2'"),
    Mutation("Total Lagrangian velocity gradient without F's inverse", "schemes/total_lagrangian/deformation_gradient.py",
             "l = product(rate, inverse)", "l = product(rate, identity(f))", TWIN),
    Mutation("Total Lagrangian: modulus blind to plastic flow", "schemes/total_lagrangian/deformation_gradient.py",
             "1.0 + modulus * inverse_yield * plastic_strain", "1.0", TWIN),
    Mutation("Total Lagrangian: mixed pairs count twice", "schemes/total_lagrangian/law.py",
             "share = 0.5 * (kind + b[KIND])", "share = 1.0 * (kind + b[KIND])", "test_adaptive.py -k interface_forces"),
    Mutation("reference corrections: shift without its sign", "sph/neighbours/reference_neighbours.py",
             "times(-inverse_s * inverse_s,", "times(inverse_s * inverse_s,", TWIN),
    Mutation("Total Lagrangian: what squeezes across is no squeeze", "schemes/total_lagrangian/deformation_gradient.py",
             "dot(inverse, inverse) - (DIM - 1.0)", "dot(inverse, inverse) - DIM", "test_total_lagrangian.py -k squeezed"),
    Mutation("pressing contact: friction never sticks", "sph/contact/penalty_contact.py",
             "held = min(abs(constants[2] * dot(force, n_ab)), sticks)", "held = abs(constants[2] * dot(force, n_ab))",
             "test_contact.py -k friction"),
    Mutation("pressing contact: images are faces of their body", "sph/contact/penalty_contact.py",
             "own_face = own_face * max(np.copysign(1.0, b[RING]), 0.0)", "own_face = own_face",
             "test_contact.py -k 'image'"),
    Mutation("pressing contact: all of the work on each side", "sph/contact/penalty_contact.py",
             "totals(a)), -0.5 * scale_own * total(power)", "totals(a)), -scale_own * total(power)", "test_contact.py -k 'friction or account'"),
    Mutation("contact: one power too many", "sph/contact/repulsion.py",
             "range(EXPONENT - 3)", "range(EXPONENT - 2)", "test_contact.py -k gradient_of_the_energy"),
    Mutation("held particles are predicted to move", "integrators/particle_update.py",
             "a = no_vector(DIM) if held else rate.a", "a = rate.a", f"{LENGTHS} -k held"),
    Mutation("variable h: Omega with a wrong sign", "schemes/riemann/law.py",
             "(1.0 - rows[i, FREE_LENGTH] * volume", "(1.0 + rows[i, FREE_LENGTH] * volume", "test_sph_laws.py -k 'formulas and following-2'"),
    Mutation("variable h: what is at its limit still grows", "integrators/particle_update.py",
             "1.0 if h_low < ahead.h < h_high else 0.0", "1.0", f"{LENGTHS} -k contact"),
    Mutation("rings: a ring alone has its whole hoop", "sph/terms/axisymmetric.py",
             "min(max(EDGES * fullness, 0.0), 1.0)", "1.0", "test_axisymmetric_twin.py"),
    Mutation("rings: their step knows no radius", "integrators/particle_steps.py",
             "return STEEPNESS * (h / ring - NEAR)", "return 0.0", "test_axisymmetric.py -k step_of_a_ring"),
    Mutation("rubble rubs beyond what the whole bore", "materials/stress_update.py",
             "flow = min(flow, friction * max(p, 0.0))", "flow = friction * max(p, 0.0)",
             "test_materials_models.py -k 'rubble or failed'"),
    Mutation("what has failed holds tension", "materials/stress_update.py",
             "        p = max(p, 0.0)\n        if friction == 0.0", "        if friction == 0.0", f"{RESPONSE} -k damage"),
    Mutation("pores bear as the solid does", "materials/stress_update.py",
             "rho, filled = rho * first, 1.0 / first", "rho, filled = rho * first, 1.0", "test_materials_models.py -k porous"),
    Mutation("pores that crush break nothing", "materials/stress_update.py",
             "damage = max(damage, (row[DISTENSION] - first) / (row[DISTENSION] - 1.0))", "damage = damage",
             "test_materials_models.py -k pores"),
    Mutation("projection: half of the neighbours' pressure", "schemes/projection/law.py",
             "8.0 * total(others)", "4.0 * total(others)", "test_projection.py -k 'formulas and 2'"),
    Mutation("projection: nothing softens close pairs", "schemes/projection/law.py",
             "(densities * densities * (r2 + eta2))", "(densities * densities * r2)", "test_projection.py -k 'formulas and 2'"),
    Mutation("projection: open neighbourhoods have a pressure", "schemes/projection/law.py",
             "if diagonal < 0.0 and not -diagonal * rho * h * h * fullness < min_support:", "if diagonal < 0.0:",
             "test_projection.py -k 'formulas or min_support'"),
    Mutation("corrections: a lonely particle is corrected", "sph/terms/kernel_correction.py",
             "good = total(count) > 1.5", "good = True", "test_corrections.py"),
    Mutation("unlike spacings: numbers counted in the own room", "schemes/riemann/law.py",
             "space = to_dimensions(1.0 + other * (b[H] / h - 1.0), dx) if VARIABLE_RESOLUTION else 1.0", "space = 1.0",
             "test_sph_laws.py -k 'formulas and unlike-2'"),
    Mutation("selection: others beside, not in, a cell are missed", "sph/neighbours/contact_candidates.py",
             "meets[cell] = low != high", "meets[cell] = lowest[cell] != highest[cell]", "test_contact_candidates.py"),
]  # fmt: skip


def survives(mutation, copy):
    """Make the mutation in a copy of the sources; return whether its test passes all the same, and what it said."""
    path = copy / "hvisph" / mutation.file
    text = path.read_text(encoding="utf-8")
    if text.count(mutation.old) != 1:
        raise SystemExit(f"{mutation.what}: its line stands {text.count(mutation.old)} times in {mutation.file}")
    path.write_text(text.replace(mutation.old, mutation.new), encoding="utf-8")
    command = f"{sys.executable} -m pytest -x -q -n 0 -p no:cacheprovider tests/{mutation.test}"
    environment = os.environ | {"PYTHONPATH": str(copy)}
    done = subprocess.run(command, shell=True, cwd=copy, env=environment, capture_output=True, text=True, check=False)
    path.write_text(text, encoding="utf-8")
    if done.returncode not in (0, 1):
        raise SystemExit(f"{mutation.what}: {done.stdout[-2000:]}{done.stderr[-2000:]}")
    return done.returncode == 0, done.stdout


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="")
    parser.add_argument("--kept", type=Path, default=Path("mutations.json"))
    parser.add_argument("--seconds", type=float, default=float("inf"))
    asked = parser.parse_args()
    kept = json.loads(asked.kept.read_text()) if asked.kept.is_file() else {}
    began = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder)
        for name in ("hvisph", "tests", "cases", "schemas", "benchmarks", "pyproject.toml"):
            source = ROOT / name
            if source.is_dir():
                shutil.copytree(source, copy / name, ignore=shutil.ignore_patterns("__pycache__"))
            else:
                shutil.copy(source, copy / name)
        for mutation in MUTATIONS:
            if asked.only not in mutation.what or kept.get(mutation.what) is False:
                continue
            if time.perf_counter() - began > asked.seconds:
                break
            lives, said = survives(mutation, copy)
            kept[mutation.what] = lives
            asked.kept.write_text(json.dumps(kept, indent=1))
            print(f"{'SURVIVES' if lives else 'noticed '} {mutation.what}: {said.strip().splitlines()[-1]}", flush=True)
    print(f"{sum(not lives for lives in kept.values())} of {len(kept)} noticed")


if __name__ == "__main__":
    main()
