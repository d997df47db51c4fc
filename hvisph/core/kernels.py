"""Catalogue of smoothing kernels: names and support over h [-].

`hvisph.sph.kernels` has their shapes, one a file.
"""

from __future__ import annotations

REACH = {
    "cubic_spline": 2.0,
    "quadratic": 2.0,
    "quartic_spline": 2.5,
    "quintic_spline": 3.0,
    "gaussian": 3.0,  # cut off there
    "wendland_c2": 2.0,
    "wendland_c4": 2.0,
}
