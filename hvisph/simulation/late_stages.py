"""Switch of a run to its late stages, see `materials.eos.late`: at the end of the first step that reaches them."""

from __future__ import annotations

from math import sqrt

import numpy as np

from hvisph.case.case import Case
from hvisph.diagnostics.sanity_checks import Failure
from hvisph.materials.material_table import Material, late_material
from hvisph.schemes.derived_fields import diagnose
from hvisph.schemes.stepper import Stepper
from hvisph.setup.build import Setup
from hvisph.sph.neighbours.particle_layout import slots

STIFF = 10.0  # least bulk modulus, of the largest pressure
SLOWER = 0.99  # quantile of the speeds that the default modulus is of
HALF = 0.5  # of the density at rest: thinner particles move without pressure


class LateStages:
    """The late stages of a case, in their order."""

    def __init__(self, case: Case, setup: Setup):
        self._stages, self._setup, self._done = case.late, setup, 0
        self._moduli = np.array([[one.bulk_modulus, one.shear_modulus] for one in setup.substances])
        if case.late:
            assert isinstance(setup.stepper, Stepper)
            self._stepper = setup.stepper

    def resume(self, time: float) -> None:
        """Take the materials of the stage that a state at `time` [s] is in."""
        self._done = sum(stage.at <= time for stage in self._stages)
        if self._done:
            self._take(self._done - 1, float(self._stepper.late[self._done]))

    def _take(self, number: int, modulus: float) -> np.ndarray:
        """Take the materials of a stage of a bulk modulus [Pa]; return growths of 1/K and 1/G by material [1/Pa]."""
        materials = [late_material(one, modulus, self._stages[number].nu) for one in self._setup.substances]
        self._stepper.use_late_materials(number, materials)
        before, self._moduli = self._moduli, np.array([[modulus, one.shear_modulus] for one in materials])
        stiff = before > 0.0
        return np.divide(1.0, self._moduli, where=stiff, out=np.zeros(before.shape)) - np.divide(
            1.0, before, where=stiff, out=np.zeros(before.shape)
        )

    def is_due(self, time: float) -> bool:
        """Return whether the next stage begins at `time` [s] or earlier."""
        return self._done < len(self._stages) and self._stages[self._done].at <= time

    def switch(self, time: float, step: int) -> str:
        """Begin the next stage and return a remark on it.

        Raises `Failure` where the pressure is above a tenth of the new bulk modulus.
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
        share, speed = self._setup.subdomain, np.sqrt((particles["velocity"] ** 2).sum(axis=1))
        highest = share.get_maxima(float(pressure.max(initial=0.0)))[0]
        stress = np.where(flies, 0.0, fields["von_mises_stress"])
        whole = share.gather_rows(speed[~flies])
        fast = share.world.broadcast_from_first(lambda: float(np.quantile(whole, SLOWER)) if len(whole) else 0.0)
        modulus = stage.bulk_modulus or self._default_modulus(highest, fast, float(stress.max(initial=0.0)))
        if highest * STIFF > modulus:
            raise Failure(
                "late", f"late stage at {time:.4g} s: the largest pressure is {highest:.3g} Pa, above a tenth of its "
                f"bulk modulus of {modulus:.3g} Pa; begin later, or give {STIFF * highest:.3g} Pa or more",
                None, None, None, time, step,
            )  # fmt: skip
        for number, material in enumerate(self._setup.substances):
            rows = np.flatnonzero(particles.material == number)
            reference = particles["density"][rows] / (1.0 + pressure[rows] / modulus)
            if self._done == 0:
                pores = material.porosity is not None
                particles["flaw_strain"][rows] = 1.0 / particles["history_variable"][rows] if pores else 1.0
            particles["history_variable"][rows] = np.where(flies[rows], np.inf, reference)
        slow = 0.1 * sqrt(modulus / max(one.density_at_rest for one in self._setup.substances))
        rates = stepper.rates[stepper.place, slots(particles.dim)["R_APPROACH"]]
        closing = share.get_maxima(float(np.where(flies, 0.0, np.abs(rates)).max(initial=0.0)))[0]
        softer = self._take(self._done, modulus)[particles.material]
        elastic = pressure**2 / 2.0 * softer[:, 0] + stress**2 / 6.0 * softer[:, 1]
        stepper.late[0] += share.exact_sum(particles["mass"] / particles["density"] * elastic)
        self._done += 1
        stepper.late[self._done] = modulus
        remark = (f"late stage from {time:.4g} s, bulk modulus {modulus:.3g} Pa: largest pressure {highest:.3g} Pa; "
                  f"99 % of the particles under pressure are slower than {fast:.3g} m/s")  # fmt: skip
        if closing > slow:
            remark += (
                f"; warning: particles close at {closing:.3g} m/s, above a tenth of the new sound speed, "
                f"{slow:.3g} m/s: the shock has not left; begin later or give a higher bulk modulus"
            )
        return remark

    def _default_modulus(self, pressure: float, speed: float, stress: float) -> float:
        """Return K_new [Pa] of the largest pressure and von Mises stress [Pa] and the speed of what moves [m/s]."""
        density = max(one.density_at_rest for one in self._setup.substances)
        stress = self._setup.subdomain.get_maxima(stress)[0]
        wanted = max(30.0 * pressure, 100.0 * density * speed**2, 100.0 * stress)
        return float(min(wanted, *self._moduli[:, 0])) or float(self._moduli[:, 0].min())

    def _flies(self, rows: np.ndarray, material: Material, temperature: np.ndarray | None) -> np.ndarray:
        """Return whether particles of a material fly on without pressure, hot or thin (n,)."""
        particles = self._stepper.particles
        rho, known = particles["density"][rows], particles["history_variable"][rows]
        if self._done:
            return np.asarray(~np.isfinite(known) | (rho < HALF * material.density * particles["flaw_strain"][rows]))
        thin = (rho if material.porosity is None else rho * known) < HALF * material.density
        hot = False if temperature is None else temperature > material.melting_point  # not a number is never above
        return np.asarray(thin | hot)
