"""The check for overlapping bodies: two plates side by side, a million particles and more.

python benchmarks/overlap.py
"""

from __future__ import annotations

import time

import numpy as np

from hvisph.geometry.filling import fill
from hvisph.geometry.overlap import overlaps
from hvisph.geometry.placement import row
from hvisph.geometry.shapes import Box

DX = 0.1


def main() -> None:
    """Print the time."""
    plate = fill(Box((5.0, 10.0, 10.0)), None, DX)
    centres = row([plate, plate], [0.0, 0.0], [None, None], [None, None], [True, True])
    positions = np.concatenate([plate.positions + centre for centre in centres])
    bodies = np.repeat([0, 1], plate.count)
    begin = time.perf_counter()
    pairs = overlaps(positions, bodies, DX)
    print(f"{len(positions)} particles: {time.perf_counter() - begin:.2f} s, {len(pairs)} overlaps")


if __name__ == "__main__":
    main()
