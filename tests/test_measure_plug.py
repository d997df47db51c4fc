"""Plug and lip of a perforated plate, on bodies made by hand."""

import numpy as np
import pytest

from hvisph.measures.measurement_frame import Scene
from hvisph.measures.result import evaluate
from hvisph.output.snapshot import Snapshot

DX = 1e-3


def perforated(height=1.5e-3, shift=20e-3, plug_radius=4.2e-3):
    """A plate with a plug gone and a lip bent up, and a sphere's particles ahead; before and after."""
    y = (np.arange(60) - 29.5) * DX
    plate = np.stack(np.meshgrid([0.5e-3, 1.5e-3, 2.5e-3], y, y, indexing="ij"), -1).reshape(-1, 3)
    shot = np.stack(np.meshgrid(*[(np.arange(12) - 5.5) * DX] * 3, indexing="ij"), -1).reshape(-1, 3)
    shot = shot[np.linalg.norm(shot, axis=1) < 6e-3] - [6e-3, 0.0, 0.0]
    before = np.concatenate([shot, plate])
    body = np.repeat([0, 1], [len(shot), len(plate)])
    after, velocity = before.copy(), np.zeros_like(before)
    r = np.linalg.norm(before[:, 1:], axis=1)
    plug = (body == 1) & (r < plug_radius)
    lip = (body == 1) & (r > 6e-3) & (r < 8e-3)
    after[plug, 0] += shift
    velocity[plug, 0] = 300.0
    gone = (body == 1) & (r >= plug_radius) & (r <= 6e-3)
    after[lip, 0] += height
    keep = ~gone

    def snapshot(position, speed, chosen, time, step):
        fields = {"position": position[chosen], "velocity": speed[chosen], "mass": np.ones(chosen.sum()),
                  "smoothing_length": np.full(chosen.sum(), 1.2 * DX)}  # fmt: skip
        numbers = np.flatnonzero(chosen)
        return Snapshot(time, step, 3, fields, body[chosen], np.zeros(chosen.sum(), int), numbers, ["shot", "plate"],
                        ["metal"], {"spacing": DX})  # fmt: skip

    whole = np.ones(len(before), bool)
    return Scene(snapshot(after, velocity, keep, 1e-4, 100), snapshot(before, velocity * 0.0, whole, 0.0, 0))


def test_plug_and_lip():
    found = evaluate("run", perforated())
    assert found["plug_velocity"].value == pytest.approx(300.0)
    assert found["plug_thickness"].value == pytest.approx(2e-3)
    assert found["plug_width"].value == pytest.approx(7e-3)  # lattice points within 4.2 mm: -3.5 to 3.5
    # the lip's last layer is half a spacing below the face that it was
    assert found["lip_height"].value == pytest.approx(1.5e-3 - 0.5 * DX)
    assert found["lip_height_max"].value == pytest.approx(1.5e-3 - 0.5 * DX)
    # the innermost ring of the lip, where all are level
    assert 12e-3 < found["impact_diameter"].value < 14e-3
    assert found["target_fragments"].value == 1.0


def test_what_is_thrown_back_is_no_plug():
    scene = perforated()
    plug = scene.state.body == 1
    plug &= scene.state.fields["velocity"][:, 0] > 0.0
    scene.state.fields["velocity"][plug] *= -1.0
    found = evaluate("run", scene)
    assert found["plug_velocity"].value is None
    assert found["target_fragments"].value == 1.0


@pytest.mark.parametrize("known", [True, False])
def test_debris_beside_the_plate_is_not_attached(known):
    """A piece of the middle that has flown out to the rim, or past it, is a fragment where the start is known."""
    scene = perforated()
    plug = (scene.state.body == 1) & (scene.state.fields["velocity"][:, 0] > 0.0)
    scene.state.fields["position"][plug, 1] += 28 * DX if known else 60 * DX
    found = evaluate("run", Scene(scene.state, scene.start if known else None))
    assert found["target_fragments"].value == 1.0
    assert found["plug_velocity"].value == pytest.approx(300.0)


def test_both_halves_of_a_plate_struck_off_its_middle_are_attached():
    y = (np.arange(100) - 79.5) * DX  # -80 to 20 mm: the upper half ends where the lower one's rim is far away
    plate = np.stack(np.meshgrid([0.5e-3, 1.5e-3, 2.5e-3], y, indexing="ij"), -1).reshape(-1, 2)
    plate = plate[np.abs(plate[:, 1]) > 5e-3]
    shot = np.stack(np.meshgrid(*[(np.arange(8) - 3.5) * DX] * 2, indexing="ij"), -1).reshape(-1, 2)
    position = np.concatenate([shot, plate])
    body = np.repeat([0, 1], [len(shot), len(plate)])
    n = len(position)
    fields = {"position": position, "velocity": np.ones((n, 2)), "mass": np.ones(n)}
    snapshot = Snapshot(0.0, 0, 2, fields, body, np.zeros(n, int), np.arange(n), ["shot", "plate"], ["metal"],
                        {"spacing": DX})  # fmt: skip
    for start in (snapshot, None):
        found = evaluate("run", Scene(snapshot, start))
        assert found["target_fragments"].value == 0.0
        assert found["plug_velocity"].value is None


def test_a_whole_plate_has_no_plug():
    found = evaluate("run", perforated(height=0.0, shift=0.0, plug_radius=6e-3))
    assert found["plug_velocity"].value is None
    assert "detached" in found["plug_width"].reason
