"""Small impacts of unlike materials and features, in both updated Lagrangian formulations: balances and bits.

Each case runs once with one thread, and again with two threads, stopped half way and resumed. Materials are those of
the library, so that each model meets each feature; the cases are too coarse for measures.
"""

import pytest
from small_runs import TWO, assert_same_results

import hvisph

pytestmark = pytest.mark.slow

AIR = {"density": 6.0, "eos": {"type": "ideal_gas", "gamma": 1.4}}
ALUMINIUM, STEEL, FOAM = "aluminium-6061-t6", "steel-4340", "aluminium-foam-6101-t6"
DRIFT = 1e-11  # of the energy at the start: round-off of a few hundred steps


def plane(ball, plate, speed, end=1e-6, **further):
    """A disc of six particles on a plate in plane strain."""
    return {"kinematics": "plane_strain", "resolution": 0.4e-3, "time": {"end": end}, "bodies": {
        "ball": {"material": ball, "shape": {"type": "disc", "diameter": 2.4e-3}, "velocity": [speed, 0.0]},
        "plate": {"material": plate, "shape": {"type": "box", "size": [1.6e-3, 6e-3]}}}} | further  # fmt: skip


def space(ball, plate, speed, **further):
    """A sphere of four particles on a plate in 3D, with further keys of the plate."""
    sheet = {"material": plate, "shape": {"type": "box", "size": [1.5e-3, 4e-3, 4e-3]}} | further
    sphere = {"material": ball, "shape": {"type": "sphere", "diameter": 2e-3}, "velocity": [speed, 0.0, 0.0]}
    return {"kinematics": "three_d", "resolution": 0.5e-3, "time": {"end": 8e-7},
            "bodies": {"ball": sphere, "plate": sheet}}  # fmt: skip


def rings(first, second, end=1e-6):
    """Two bodies about the axis."""
    return {"kinematics": "axisymmetric", "resolution": 0.4e-3, "time": {"end": end},
            "bodies": {"first": first, "second": second}}  # fmt: skip


def cylinder(material, length, diameter, **further):
    return {"material": material, "shape": {"type": "cylinder", "length": length, "diameter": diameter}} | further


def sphere(material, speed, **further):
    return {"material": material, "shape": {"type": "sphere", "diameter": 3e-3}, "velocity": [speed, 0.0]} | further


def with_air(case):
    """The same with a box of gas behind the plate."""
    air = {"material": AIR, "shape": {"type": "box", "size": [2e-3, 6e-3]}, "internal_energy": 4e5, "role": "other"}
    return case | {"bodies": case["bodies"] | {"air": air}}


def changed(case, body, **further):
    """The same with further keys of a body."""
    return case | {"bodies": case["bodies"] | {body: case["bodies"][body] | further}}


TURNED = {"one": [0, 1, 0], "two": [0, 0, 1]}
GRANITE, FOAMS = plane("granite", "granite", 3000.0), plane(ALUMINIUM, FOAM, 2000.0, end=1.5e-6)
CASES = {
    "metals": plane(ALUMINIUM, STEEL, 2000.0),
    "melting": plane(ALUMINIUM, "copper-etp", 6500.0, end=5e-7),
    "vapour": plane(f"{ALUMINIUM}-tillotson", f"{ALUMINIUM}-tillotson", 7000.0, end=5e-7),
    "foam": FOAMS,
    "glass": plane(STEEL, "glass-soda-lime", 1000.0),
    "ice": plane("ice", "ice", 2000.0),
    "water": plane(STEEL, "water", 1000.0),
    "polymer": plane(ALUMINIUM, "polycarbonate", 2000.0),
    "gas": with_air(plane(ALUMINIUM, ALUMINIUM, 2000.0)),
    "cloth": space(STEEL, "kevlar-km2", 800.0, axes=TURNED),
    "laminate": space(ALUMINIUM, "im7-8552", 1000.0, axes=TURNED),
    "explosive": rings(cylinder("tnt", 3e-3, 4e-3), cylinder("copper-ofhc", 1.6e-3, 4e-3), end=2e-6),
    "foam_about_an_axis": rings(sphere(FOAM, 3000.0), cylinder("ice", 2e-3, 8e-3)),
    "gravity": GRANITE | {"gravity": [1e6, 0.0], "symmetry": [{"axis": "x", "at": 1.6e-3, "keep": "below"}]},
    "late": plane("granite", "granite", 50.0) | {"late": [{"at": 5e-7, "bulk_modulus": 5e9}]},
    "inclusions": changed(GRANITE, "plate", inclusions={
        "material": "basalt", "diameters": [1.2e-3, 1.3e-3], "volume": 0.2}),
    "edges": FOAMS | {"edges": [{"axis": "y", "at": -2.6e-3, "keep": "above"}, {"axis": "y", "at": 2.6e-3, "keep": "below"}]},
    "pressed": FOAMS | {"loads": [{"box": {"min": [None, None]}, "bodies": ["plate"], "normal": "+x",
                                   "pressure": [[0, 1e8], [1e-6, 1e8]]}]},
    "driven": plane(ALUMINIUM, STEEL, 2000.0) | {
        "clamped": [{"box": {"max": [None, -2.5e-3]}, "bodies": ["plate"], "velocity": [50.0, 0.0]}]},
    "rigid_on_foam": changed(FOAMS, "ball", rigid=True),
    "rigid_beside_gas": changed(with_air(plane(ALUMINIUM, ALUMINIUM, 2000.0)), "ball", rigid=True),
    "rigid_on_cloth": changed(space(STEEL, "kevlar-km2", 800.0, axes=TURNED), "ball", rigid=True),
    "rigid_about_an_axis": rings(sphere(STEEL, 1000.0, rigid=True), cylinder("water", 2e-3, 8e-3)),
}  # fmt: skip


@pytest.mark.parametrize("formulation", ["riemann", "eulerian"])
@pytest.mark.parametrize("name", CASES)
def test_balances_and_bits(name, formulation, tmp_path):
    """Energy is kept to round-off; threads, and a stop half way, change no bit."""
    document = CASES[name] | {"formulation": {"type": formulation}}
    end = document["time"]["end"]
    document["output"] = {"every": end / 2}
    one = hvisph.run(hvisph.load_case(document), out=tmp_path / "one", threads=1)
    assert one.exit_code == 0
    assert abs(hvisph.open_run(tmp_path / "one").history["energy_drift"].iloc[-1]) < DRIFT
    half = document | {"time": {"end": end, "max_steps": one.summary["steps"] // 2 + 1}}
    stopped = hvisph.run(hvisph.load_case(half), out=tmp_path / "two", threads=TWO)
    assert 0 < stopped.summary["steps"] < one.summary["steps"]
    hvisph.resume(tmp_path / "two", max_steps=0, threads=1)
    assert_same_results(tmp_path / "one", tmp_path / "two")
