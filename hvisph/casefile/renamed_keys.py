"""Renamed keys, values, state fields, commands and options: old spelling to present one, for error messages."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hvisph.case.model import Path

SELF_CONTACT = "self_contact: none, fragments or all"
CONSERVE = "conserve_angular_momentum: true or false"
# By the block that holds the key (empty at the top of a file) and the key.
KEYS = {
    ("", "watch"): "limits",
    ("", "limit"): "time_limit",
    ("eos", "reading"): "definition",
    ("eos", "complete_energy"): "vaporization_energy",
    ("eos", "cold_tension"): "expansion",
    ("eos", "energy_density"): "detonation_energy",
    ("damage", "failed"): "failed_strength",
    ("damage", "fails"): "permanent",
    ("formulation", "form"): "variant",
    ("formulation", "tension"): "tension_stabilization: true or false",
    ("formulation", "angular_momentum"): CONSERVE,
    ("formulation", "guard"): "min_support",
    ("formulation", "renew_reference"): "reference_update_strain",
    ("contact", "own_faces"): SELF_CONTACT,
    ("contact", "folds"): SELF_CONTACT,
    ("correction", "tested"): "limiter",
    ("spatial_correction", "tested"): "limiter",
    ("conversion", "guard"): "fallback",
    ("conversion", "guard_strain"): "fallback_strain",
    ("conversion", "guard_damage"): "fallback_damage",
    ("output", "whole_every"): "full_every",
    ("output", "constants"): "static_fields",
    ("regions", "one_in"): "stride",
    ("vary", "between"): "bracket",
    ("vary", "until"): "tolerance",
    ("vary", "for"): "parameters",
    ("event", "above"): "threshold",
    ("limits", "between"): "bracket",
    ("limits", "until"): "tolerance",
}
# By the key and its value.
VALUES = {
    ("arrangement", "even"): "uniform",
    ("arrangement", "given"): "from_file",
    ("expansion", "fading"): "faded",
    ("failed_strength", "keeps_stress"): "unchanged",
    ("high_triaxiality", "held"): "constant",
    ("variant", "consistent"): "corrected",
    ("variant", "printed"): "original",
    ("pressure_gradient", "printed"): "original",
    ("viscosity_in_shear", "whole"): "full",
    ("failed_particles", "leave"): "removed",
    ("failed_particles", "leave_with_jump"): "removed_renormalized",
    ("failed_particles", "stay"): "retained",
    ("type", "separating"): "frictional",
    ("type", "welded"): "bonded",
    ("type", "repulsive"): "penalty",
}
FIELDS = {
    "density_lead": "density_correction",
    "previous_spin": "torque_residual",
    "viscosity_share": "viscosity_factor",
    "memory": "history_variable",
}
COMMANDS = {"limit": "ballistic-limit", "limits": "correlations", "explain": "help"}
OPTIONS = {
    "--between": "--bracket",
    "--until": "--tolerance",
    "--above": "--threshold",
    "--dry": "--dry-run",
    "--work": "--worker",
    "--second": "--second-resolution",
    "--across": "--particles-across",
}


def renamed_key(path: Path, allowed: Sequence[str]) -> str:
    """Return what the unknown key at the end of `path` is now called, if that is one of the `allowed`; else empty."""
    blocks = [str(part) for part in path[-3:-1]] or [""]
    found = [KEYS[block, str(path[-1])] for block in blocks if (block, str(path[-1])) in KEYS]
    return next((f"is now `{now}`" for now in found if now.partition(":")[0] in allowed), "")


def renamed_value(key: str | int, value: object) -> str:
    """Return what the unknown `value` of `key` is now called; empty where it never was one."""
    now = VALUES.get((str(key), str(value)))
    return f"'{value}' is now `{now}`" if now else ""


def renamed_field(name: object) -> str:
    """Return what the state field `name` is now called; empty where it never was one."""
    return f"'{name}' is now `{FIELDS[str(name)]}`" if str(name) in FIELDS else ""
