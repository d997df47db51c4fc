"""Switch of a run to its late stages, see `materials.eos.late`: at the end of the first step that reaches them."""

from __future__ import annotations

import numpy as np

from hvisph.case.case import Case
from hvisph.diagnostics.sanity_checks import Failure
from hvisph.materials.material_table import Material
from hvisph.schemes.derived_fields import diagnose
from hvisph.schemes.stepper import Stepper
from hvisph.setup.build import Setup

STIFF = 10.0  # least bulk modulus, of the largest pressure
HALF = 0.5  # of the density at rest: thinner particles move without pressure


class LateStages:
    """The late stages of a case, in their order."""

    def __init__(self, case: Case, setup: Setup):
        self._stages, self._setup, self._done = case.late, setup, 0
        if case.late:
            assert isinstance(setup.stepper, Stepper)
            self._stepper = setup.stepper

    def resume(self, time: float) -> None:
        """Take the materials of the stage that a state at `time` [s] is in."""
        self._done = sum(stage.at <= time for stage in self._stages)
        if self._done:
            self._stepper.use_late_materials(self._done - 1)

    def is_due(self, time: float) -> bool:
        """Return whether the next stage begins at `time` [s] or earlier."""
        return self._done < len(self._stages) and self._stages[self._done].at <= time

    def switch(self, time: float, step: int) -> str:
        """Begin the next stage and return a remark on it.

        Raises
        ------
        Failure
            Where the pressure is above a tenth of the new bulk modulus.
        """
        stepper, stage = self._stepper, self._stages[self._done]
        particles = stepper.particles
        fields = diagnose(particles, stepper.table, stepper.models)
        pressure, heat = np.maximum(fields["pressure"], 0.0), fields.get("temperature")
        flies = np.zeros(particles.count, dtype=bool)
        for number, material in enumerate(self._setup.substances):
            rows = np.flatnonzero(particles.material == number)
            flies[rows] = self._flies(rows, material, None if heat is None else heat[rows])
        pressure[flies] = 0.0
        highest = self._setup.subdomain.get_maxima(float(pressure.max(initial=0.0)))[0]
        if highest * STIFF > stage.bulk_modulus:
            raise Failure(
                "late", f"late stage at {time:.4g} s: the largest pressure is {highest:.3g} Pa, above a tenth of its "
                f"bulk modulus of {stage.bulk_modulus:.3g} Pa; begin later, or give {STIFF * highest:.3g} Pa or more",
                None, None, None, time, step,
            )  # fmt: skip
        for number, material in enumerate(self._setup.substances):
            rows = np.flatnonzero(particles.material == number)
            reference = particles["density"][rows] / (1.0 + pressure[rows] / stage.bulk_modulus)
            if self._done == 0:
                pores = material.porosity is not None
                particles["flaw_strain"][rows] = 1.0 / particles["history_variable"][rows] if pores else 1.0
            particles["history_variable"][rows] = np.where(flies[rows], np.inf, reference)
        stepper.use_late_materials(self._done)
        self._done += 1
        fast = np.quantile(np.sqrt((particles["velocity"] ** 2).sum(axis=1)), 0.99)
        return (f"late stage from {time:.4g} s, bulk modulus {stage.bulk_modulus:.3g} Pa: largest pressure "
                f"{highest:.3g} Pa; 99 % of the particles are slower than {fast:.3g} m/s")  # fmt: skip

    def _flies(self, rows: np.ndarray, material: Material, temperature: np.ndarray | None) -> np.ndarray:
        """Return whether particles of a material fly on without pressure, hot or thin (n,)."""
        particles = self._stepper.particles
        rho, known = particles["density"][rows], particles["history_variable"][rows]
        if self._done:
            return np.asarray(~np.isfinite(known) | (rho < HALF * material.density * particles["flaw_strain"][rows]))
        thin = (rho if material.porosity is None else rho * known) < HALF * material.density
        hot = False if temperature is None else temperature > material.melting_point  # not a number is never above
        return np.asarray(thin | hot)
