"""Files made by somebody who knows the format: snapshots, checkpoints and summaries that are whole, and wrong."""

import json
import shutil

import h5py
import numpy as np

from hvisph.output.verified_hdf5 import CHECKSUM_LENGTH, append_checksum

NUMBERS = (0, -1, 1, 1e300, -1e300, float("nan"), float("inf"), 2**40, 5e-324)
PLAIN = (None, True, -1, 0, 2**70, 1e999, "", "x" * 1000, "\x1b[31m", [], [[]], {}, {"a": {}}, ["a", 1])


def resealed(path):
    """Give a file whose bytes were changed the checksum that fits them."""
    content = path.read_bytes()
    if b"hvisph crc32" in content[-CHECKSUM_LENGTH:]:
        path.write_bytes(content[:-CHECKSUM_LENGTH])
    with path.open("r+b") as file:
        append_checksum(file)


def forge(original, path, rng, elsewhere):
    """Write to `path` a copy of an HDF5 file with one lie in it and a right checksum; return what was done.

    Parameters
    ----------
    original, path
        The file, and where the forged one goes.
    rng
        Random numbers.
    elsewhere
        A file that nobody may read or write.
    """
    shutil.copyfile(original, path)
    content = path.read_bytes()[:-CHECKSUM_LENGTH]
    path.write_bytes(content)
    lie = rng.choice([values, shape, kind, link, external, virtual, huge, header, missing, more, bytes_of_it])
    if lie is bytes_of_it:
        bytes_of_it(path, rng)
    else:
        with h5py.File(path, "r+") as h5:
            names = []
            h5.visititems(lambda name, node: names.append(name) if isinstance(node, h5py.Dataset) else None)
            lie(h5, rng.choice(names) if lie is not header else next(n for n in names if "header" in n), rng, elsewhere)
    resealed(path)
    return lie.__name__


def replaced(h5, name, make):
    """Take an array away and put another thing in its place."""
    del h5[name]
    make()


def values(h5, name, rng, elsewhere):
    node = h5[name]
    if node.dtype.kind in "fiu" and node.shape:
        new = node[...]
        lie = rng.choice(NUMBERS)
        with np.errstate(all="ignore"):
            lie = np.array(lie).astype(node.dtype) if np.isfinite(lie) or node.dtype.kind == "f" else 0
        if rng.random() < 0.5:
            new[...] = lie
        else:
            new.flat[rng.randrange(max(new.size, 1)) :] = lie
        node[...] = new


def shape(h5, name, rng, elsewhere):
    old = np.atleast_1d(h5[name][...])
    new = rng.choice([old[:0], old.ravel(), np.zeros((3, 3, 3)), old[:1], np.float64(3.0)])
    replaced(h5, name, lambda: h5.create_dataset(name, data=new))


def kind(h5, name, rng, elsewhere):
    n = len(np.atleast_1d(h5[name][...]))
    new = rng.choice([np.array([b"text"] * n), np.zeros(n, bool), np.zeros(n, complex), np.zeros(n, "f2"),
                      np.zeros(n, [("a", "f8")])])  # fmt: skip
    replaced(h5, name, lambda: h5.create_dataset(name, data=new))


def link(h5, name, rng, elsewhere):
    def make():
        h5[name] = rng.choice(
            [h5py.ExternalLink(str(elsewhere), "/secret"), h5py.SoftLink("/VTKHDF"), h5py.SoftLink("/nothing")]
        )

    replaced(h5, name, make)


def external(h5, name, rng, elsewhere):
    old = h5[name]
    size = max(int(old.size), 1)
    replaced(
        h5, name, lambda: h5.create_dataset(name, (size,), "f8", external=[(str(elsewhere), 0, h5py.h5f.UNLIMITED)])
    )


def virtual(h5, name, rng, elsewhere):
    def make():
        layout = h5py.VirtualLayout((10,), "f8")
        layout[:] = h5py.VirtualSource(str(elsewhere), "secret", (10,))
        h5.create_virtual_dataset(name, layout)

    replaced(h5, name, make)


def huge(h5, name, rng, elsewhere):
    size = rng.choice([10**9, 10**12, 2**40])
    more = rng.choice([{}, {"chunks": (1000,)}, {"chunks": (1000,), "compression": "gzip"}])
    replaced(h5, name, lambda: h5.create_dataset(name, (size,), "f8", **more))


def header(h5, name, rng, elsewhere):
    node = h5[name]
    raw = node[()] if node.shape == () else node[...].tobytes()
    told = json.loads(raw)
    place = told
    while True:
        keys = list(place) if isinstance(place, dict) else range(len(place))
        if not keys:
            break
        key = rng.choice(list(keys))
        below = place[key]
        if isinstance(below, dict | list) and below and rng.random() < 0.7:
            place = below
            continue
        if rng.random() < 0.3 and isinstance(place, dict):
            del place[key]
        else:
            place[key] = rng.choice(PLAIN)
        break
    text = json.dumps(told).encode()
    scalar = node.shape == ()
    new = np.bytes_(text) if scalar else np.frombuffer(text, np.uint8)
    replaced(h5, name, lambda: h5.create_dataset(name, data=new))


def missing(h5, name, rng, elsewhere):
    del h5[name]


def more(h5, name, rng, elsewhere):
    group = h5.require_group("more")
    for number in range(rng.choice([1, 3000])):
        group.require_group(str(number))
    group["round"] = h5["/"]


def bytes_of_it(path, rng):
    """Turn some bytes, of the structure more often than of the numbers."""
    content = bytearray(path.read_bytes())
    for _ in range(rng.randint(1, 8)):
        content[rng.randrange(min(len(content), rng.choice([100, 4000, len(content)])))] = rng.randrange(256)
    path.write_bytes(content)


def forge_summary(text, rng):
    """Return a summary with one value of another kind, or one missing."""
    told = json.loads(text)
    place = told
    while True:
        key = rng.choice(list(place) if isinstance(place, dict) else list(range(len(place))))
        if isinstance(place[key], dict | list) and place[key] and rng.random() < 0.6:
            place = place[key]
            continue
        if rng.random() < 0.3 and isinstance(place, dict):
            del place[key]
        else:
            place[key] = rng.choice(PLAIN)
        return json.dumps(told)
