"""What of a run is written: fields, precision, compression, constants, regions; measures read all of it."""

import json
from dataclasses import replace

import h5py
import numpy as np
import pytest
from small_runs import HARDENING, METAL, row_of

from hvisph.core.errors import CaseError, OutputError
from hvisph.measures.measure import measure
from hvisph.output.hdf5 import StorageOptions, write_hdf5
from hvisph.output.reader import list_snapshots, read_snapshot
from hvisph.simulation.run import run

REGIONS = {"front": {"box": {"min": [0.0, None]}, "bodies": ["body_1"]}, "thinned": {"stride": 5}}
LEAN = {"precision": "single", "compress": "gzip", "static_fields": "once", "full_every": 2, "regions": REGIONS}


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """The folder of one run as it is by default, and of one that writes little, read by name."""
    folder = tmp_path_factory.mktemp("options")
    for name, options in (("plain", {}), ("lean", LEAN)):
        case = row_of([METAL, HARDENING], time={"end": 5e-7}, output={"every": 1e-7} | options)
        run(case, folder / name, threads=1)
    return folder


def test_single_precision_holds_seven_digits_and_positions_whole(runs):
    for path in list_snapshots(runs / "lean"):
        a, b = read_snapshot(runs / "plain" / "snapshots" / path.name), read_snapshot(path)
        assert b.fields.keys() == a.fields.keys()
        for name, values in a.fields.items():
            assert b.fields[name].dtype == values.dtype
            if name != "position":
                values = values.astype(np.float32).astype(values.dtype)
            np.testing.assert_array_equal(b.fields[name], values, err_msg=name)
        for name in ("id", "body", "material"):
            np.testing.assert_array_equal(getattr(a, name), getattr(b, name))


def test_only_some_moments_are_whole_and_the_last_is(runs):
    assert [int(path.stem) for path in list_snapshots(runs / "lean")] == [0, 2, 4, 5]


def test_regions_are_written_at_every_moment(runs):
    for number in range(6):
        whole = read_snapshot(runs / "plain" / "snapshots" / f"{number:06d}.vtkhdf")
        front = read_snapshot(runs / "lean" / "regions" / f"front.{number:06d}.vtkhdf")
        thinned = read_snapshot(runs / "lean" / "regions" / f"thinned.{number:06d}.vtkhdf")
        inside = (whole.fields["position"][:, 0] >= 0.0) & (whole.body == 1)
        assert list(front.id) == list(whole.id[inside])
        assert list(thinned.id) == [one for one in whole.id if one % 5 == 0]
        np.testing.assert_array_equal(thinned.fields["position"], whole.fields["position"][thinned.id])


def test_constants_stand_in_the_first_snapshot_and_in_the_series(runs, tmp_path):
    first, *later = list_snapshots(runs / "lean")
    with h5py.File(first) as h5:
        assert {"mass", "body", "material"} <= set(h5["VTKHDF/PointData"])
        count = len(h5["VTKHDF/Points"])
    with h5py.File(later[0]) as h5:
        assert not {"mass", "body", "material"} & set(h5["VTKHDF/PointData"])
    with h5py.File(runs / "lean" / "series.vtkhdf") as h5:
        mass = h5["VTKHDF/PointData/mass"][...]
        assert len(mass) == 4 * count
        assert (mass.reshape(4, count) == mass[:count]).all()
        assert (mass > 0.0).all()
    alone = tmp_path / later[0].name
    alone.write_bytes(later[0].read_bytes())
    with pytest.raises(OutputError, match="masses, bodies and materials stand in"):
        read_snapshot(alone)


def test_compression_and_single_precision_take_less_room(runs, tmp_path):
    shown = read_snapshot(list_snapshots(runs / "plain")[-1])
    many = replace(shown.part(np.tile(np.arange(shown.count), 60)), id=np.arange(60 * shown.count))
    single = replace(many, fields={name: values.astype(np.float32) for name, values in many.fields.items()})
    sizes = []
    for number, (one, form) in enumerate(
        [(many, StorageOptions()), (single, StorageOptions()), (single, StorageOptions(compress=True))]
    ):
        path = tmp_path / f"{number:06d}.vtkhdf"
        write_hdf5(path, one, form)
        assert read_snapshot(path).count == many.count
        sizes.append(path.stat().st_size)
    assert sizes[1] < 0.7 * sizes[0]
    assert sizes[2] < 0.7 * sizes[1]


def test_measures_of_the_end_agree(runs):
    expected, found = (json.loads((runs / name / "summary.json").read_text())["measures"] for name in ("plain", "lean"))
    # a run measures what it has, not what it wrote; only how a value swings is told by what it wrote
    assert {k: v["value"] for k, v in found.items()} == {k: v["value"] for k, v in expected.items()}
    again = measure(list_snapshots(runs / "lean")[-1]).results
    for name, one in measure(list_snapshots(runs / "plain")[-1]).results.items():
        alike = one.value if one.value is None else pytest.approx(one.value, rel=1e-6, nan_ok=True)
        assert again[name].value == alike, name


@pytest.mark.parametrize("fields", [["velocity"], ["pressure", "damage", "velocity"]])
def test_chosen_fields_alone_are_written(fields, tmp_path):
    case = row_of([METAL, HARDENING], time={"end": 2e-7}, output={"every": 1e-7, "fields": fields})
    outcome = run(case, tmp_path / "run", threads=1)
    assert outcome.exit_code == 0
    for path in list_snapshots(tmp_path / "run"):
        assert set(read_snapshot(path).fields) == {"position", "mass", "density", *fields}
        measure(path)


@pytest.mark.parametrize(("options", "said"), [
    ({"fields": ["velocty"]}, "velocty"),
    ({"precision": "half"}, "single"),
    ({"regions": {"a.b": {}}}, "regions"),
    ({"regions": {"front": {"bodies": ["body_9"]}}}, "unknown body 'body_9'"),
    ({"regions": {"front": {"box": {"min": [1.0, 0.0], "max": [0.0, 1.0]}}}}, "must be below"),
])  # fmt: skip
def test_what_cannot_be_written_is_refused(options, said):
    with pytest.raises(CaseError, match=said):
        row_of([METAL, HARDENING], output=options)
