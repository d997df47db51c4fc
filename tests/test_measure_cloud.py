"""The debris cloud and what is left of the projectile, on bodies made by hand."""

from dataclasses import replace

import numpy as np
import pytest
from measure_bodies import MM, box, snapshot
from test_measure_perforation import DX, holed, moment, plates, same, shot

from hvisph.core.errors import CaseError
from hvisph.core.measure_catalogue import SECTIONS
from hvisph.measures.debris import cloud
from hvisph.measures.measure import measure_snapshot
from hvisph.measures.measurement_frame import Scene
from hvisph.measures.result import weighted_quantile
from hvisph.visualization.curves import witness_picture

RATE = 1e5  # [1/s]


def expanding(dim, witness=None):
    """A holed plate and a cloud behind it: a loose lattice whose velocity is `RATE` times its place, less 5 mm."""
    layers = plates(dim)[:1]
    start = moment([shot(dim, -3 * MM), *layers], [1000.0, 0.0])
    count = int((start.body == 0).sum())
    nodes = box([12 * MM, *[-9 * MM] * (dim - 1)], [30 * MM, *[9 * MM] * (dim - 1)], 2.5 * DX)
    chosen = np.random.default_rng(1).permutation(len(nodes))[:count]
    pieces = nodes[np.sort(chosen)]
    extra = count - len(pieces)
    pieces = np.concatenate([pieces, np.repeat(nodes[:1], extra, axis=0)])
    parts = [pieces, *layers]
    position, body = np.concatenate(parts), np.repeat([0, 1], [len(part) for part in parts])
    kept = (body == 0) | (np.sqrt((position[:, 1:] ** 2).sum(axis=1)) > 4 * MM)
    now = moment(parts, [0.0, 0.0], kept, time=1e-5)
    cloudy = now.body == 0
    now.fields["velocity"][cloudy] = RATE * now.fields["position"][cloudy]
    now.fields["velocity"][cloudy, 0] -= RATE * 5 * MM
    if witness is not None:
        now.metadata["witness"] = witness
    return start, now


@pytest.mark.parametrize("dim", [2, 3])
def test_a_cloud_that_expands_evenly(dim):
    start, now = expanding(dim)
    found = measure_snapshot(now, start)
    cloudy = now.body == 0
    x, mass = now.fields["position"][cloudy], now.fields["mass"][cloudy]
    value = {name: result.value for name, result in found.cloud.results.items()}
    speed = {name: result.value for name, result in found.cloud.results["cloud_velocity"].variants.items()}
    ahead = 2.5 * DX  # quantiles are those of particles, which stand in rows
    assert value["cloud_velocity"] == pytest.approx(RATE * (x[:, 0].max() - 5 * MM), abs=RATE * ahead)
    assert speed["rear"] == pytest.approx(RATE * (x[:, 0].min() - 5 * MM), abs=RATE * ahead)
    assert speed["front"] >= speed["front_99"] >= speed["front_90"]
    radius = np.sqrt((x[:, 1:] ** 2).sum(axis=1))
    assert speed["radial"] == pytest.approx(RATE * radius.max(), abs=RATE * ahead)
    assert value["cloud_width"] == pytest.approx(2 * radius.max(), abs=2 * ahead)
    velocity = now.fields["velocity"][cloudy]
    assert value["cloud_mass"] == pytest.approx(mass.sum())
    assert value["cloud_momentum"] == pytest.approx((mass * velocity[:, 0]).sum())
    assert value["cloud_energy"] == pytest.approx(0.5 * (mass[:, None] * velocity**2).sum())
    for kind in ("mass", "momentum", "energy"):
        assert sum(found.cloud.over_angle[kind]) == pytest.approx(value[f"cloud_{kind}"])
    assert list(found.cloud.results) == list(SECTIONS["cloud"])
    assert list(found.projectile) == list(SECTIONS["projectile"])
    if dim == 3:
        for section, results in (("cloud", found.cloud.results), ("projectile", found.projectile)):
            assert {name: result.unit for name, result in results.items()} == {
                name: measure.unit for name, measure in SECTIONS[section].items()
            }


def test_what_a_witness_plane_receives():
    start, now = expanding(3, witness=100 * MM)
    found = measure_snapshot(now, start).cloud
    # velocities point away from (5 mm, 0, 0): so do the impacts
    cloudy = now.body == 0
    x = now.fields["position"][cloudy]
    reach = 95 * MM / (x[:, 0] - 5 * MM) * np.sqrt((x[:, 1:] ** 2).sum(axis=1))
    assert found.witness["mass_share"] == pytest.approx(1.0)
    assert found.witness["radius"][-1] == pytest.approx(reach.max(), rel=0.05)
    assert sum(found.witness["momentum"]) == pytest.approx(found.results["cloud_momentum"].value)
    edges = np.concatenate([[0.0], found.witness["radius"]])
    whole = (np.array(found.witness["areal_momentum"]) * np.pi * np.diff(edges**2)).sum()
    assert whole == pytest.approx(found.results["cloud_momentum"].value)
    assert found.witness["first"] == pytest.approx(1e-5 + ((100 * MM - x[:, 0]) / (RATE * (x[:, 0] - 5 * MM))).min())


def test_a_witness_plane_is_drawn_with_its_pressure(tmp_path):
    start, now = expanding(3, witness=100 * MM)
    found = measure_snapshot(now, start).cloud
    told = found.witness
    assert told["impulse"] == pytest.approx(found.results["cloud_momentum"].value)
    # all of it arrives within last - first but the last hundredth; a bin lasts no longer
    least = np.array(told["areal_momentum"]) / (found.arrivals.when.max() - told["first"])
    assert (np.array(told["pressure"]) >= 0.999 * least).all()
    assert witness_picture(found, tmp_path / "plane.png", "cloud").stat().st_size > 10_000
    with pytest.raises(CaseError, match="no witness plane"):
        witness_picture(measure_snapshot(start, start).cloud, tmp_path / "none.png")


def test_quarter_of_a_cloud_is_the_cloud():
    start, now = expanding(3, witness=100 * MM)
    images = [np.array([1.0, a, b]) for a in (1, -1) for b in (1, -1)]
    snaps = []
    for snap in (start, now):
        quarter = (snap.fields["position"][:, 1:] > 0.0).all(axis=1)
        part = replace(snap, fields={k: v[quarter] for k, v in snap.fields.items()}, body=snap.body[quarter],
                       material=snap.material[quarter], id=np.arange(quarter.sum()))  # fmt: skip
        part.metadata["shot"] = {"planes": [{"axis": "y", "at": 0.0}, {"axis": "z", "at": 0.0}]}
        fields = {k: np.concatenate([v * image if v.ndim > 1 and v.shape[1] == 3 else v for image in images])
                  for k, v in part.fields.items() if k != "deviator"}  # fmt: skip
        whole = replace(part, fields=fields, body=np.tile(part.body, 4), material=np.tile(part.material, 4),
                        id=np.arange(4 * part.count), metadata={**part.metadata, "shot": {}})  # fmt: skip
        snaps.append((part, whole))
    part, whole = (measure_snapshot(now, start) for start, now in zip(*snaps, strict=True))
    same(part, whole)
    assert part.cloud.results["cloud_mass"].value > 0.0
    np.testing.assert_allclose(part.cloud.witness["momentum"], whole.cloud.witness["momentum"], rtol=1e-9)


def test_a_cloud_needs_a_hole_and_a_projectile_in_one_piece_its_velocity():
    start, now = holed(3, -3 * MM, 1000.0, (False, False))
    scene = Scene.from_snapshot(now, start)
    assert {result.value for result in cloud(scene).results.values()} == {None}
    start, now = holed(3, 30 * MM, 300.0, (True, True))
    whole = measure_snapshot(now, start)
    found = whole.projectile
    assert whole["residual_velocity"].variants["heaviest"].value == pytest.approx(300.0)
    assert found["residual_angle"].value == 0.0
    assert found["fragment_mass_fraction"].value == pytest.approx(1.0)
    assert found["eroded_length"].value == pytest.approx(0.0, abs=1e-12)
    assert found["projectile_length"].value == pytest.approx(6 * MM, abs=DX)
    # torn into three: no piece stands for the projectile
    place = now.fields["position"]
    own = now.body == 0
    third = np.digitize(place[own, 1], [-0.8 * MM, 0.8 * MM])
    place[own, 1] += 8 * MM * (third - 1)
    now.fields["velocity"][own, 0] += 30.0 * (third - 1)
    torn = measure_snapshot(now, start)
    assert torn["residual_velocity"].value is None
    velocity = torn["residual_velocity"].variants
    assert "heaviest fragment" in velocity["heaviest"].reason
    assert velocity["large_fragments"].value == pytest.approx(300.0)
    assert torn.projectile["fragment_mass_fraction"].variants["large_fragments"].value == pytest.approx(1.0)


def test_weighted_quantile_is_that_of_a_copied_sample():
    rng = np.random.default_rng(0)
    values, weights = rng.normal(size=101), rng.uniform(1.0, 2.0, 101)
    for share in (0.01, 0.5, 0.99, 1.0):
        twice = weighted_quantile(np.tile(values, 4), np.tile(weights, 4), share)
        assert weighted_quantile(values, weights, share) == twice
    assert weighted_quantile(np.arange(10.0), np.ones(10), 0.3) == 2.0


def test_snapshot_without_velocities_says_why():
    snap = snapshot(box([-4 * MM, -2 * MM], [0, 2 * MM], DX), box([0, -9 * MM], [MM, 9 * MM], DX), dx=DX)
    del snap.fields["velocity"]
    assert "velocity" in measure_snapshot(snap).projectile["residual_mass"].reason
