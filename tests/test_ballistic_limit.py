"""Six velocities about a ballistic limit: what is said of the plate, beside where the core is."""

import numpy as np
import pytest
from small_runs import final

from hvisph.casefile.loader import load_case
from hvisph.simulation.run import run

CORE = {
    "density": 7830.0,
    "eos": {"type": "mie_gruneisen", "sound_speed": 4570.0, "s1": 1.49, "gamma": 1.93},
    "strength": {"type": "johnson_cook", "shear_modulus": 81.8e9, "a": 792e6, "b": 510e6, "n": 0.26, "c": 0.014,
                 "m": 1.03, "room_temperature": 298.0, "melt_temperature": 1793.0, "heat_capacity": 477.0},
}  # fmt: skip
THICK = 4e-3


@pytest.mark.slow
@pytest.mark.parametrize("speed", [150.0, 250.0, 300.0, 320.0, 350.0, 450.0])
def test_six_velocities_about_the_limit_of_a_flat_core(tmp_path, speed):
    """A steel core of 6 x 12 mm on 4 mm of free 6061-T6 as rings, coarse: through between 300 and 310 m/s."""
    bodies = {
        "core": {"material": CORE, "shape": {"type": "cylinder", "diameter": 6e-3, "length": 12e-3},
                 "velocity": [speed, 0.0]},
        "plate": {"material": "aluminium-6061-t6", "shape": {"type": "cylinder", "diameter": 48e-3, "length": THICK}},
    }  # fmt: skip
    case = load_case({"kinematics": "axisymmetric", "resolution": 6.7e-4, "bodies": bodies,
                      "formulation": {"type": "riemann"}, "time": {"end": 1e-4}, "output": {"every": 5e-6}})  # fmt: skip
    summary = run(case, tmp_path / "run", threads=1).summary
    last = final(tmp_path / "run")
    core, mass = last.body == 0, last.fields["mass"]
    rim = (last.body == 1) & (last.fields["position"][:, 1] > 20e-3)
    velocity = last.fields["velocity"][:, 0]
    faster = np.average(velocity[core], weights=mass[core]) - np.average(velocity[rim], weights=mass[rim])
    # a core that is stuck flies with the plate, which is free
    through = bool(faster > 0.1 * speed)
    assert summary["measures"]["perforated"]["value"] == float(through)
    assert through == (speed > 305.0)
    residual = summary["measures"]["residual_velocity"]
    if through:
        assert residual["value"] == pytest.approx(np.average(velocity[core], weights=mass[core]), rel=0.02)
    else:
        assert residual["value"] is None
        assert "not perforated" in residual["reason"]
