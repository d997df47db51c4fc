"""Switch of a run to its late stages, see `materials.eos.late`: at the end of the first step that reaches them."""

from math import inf, sqrt
from typing import NamedTuple

import numpy as np

from hvisph.case.case import Case
from hvisph.diagnostics.sanity_checks import Failure
from hvisph.materials.material_table import Material, late_material
from hvisph.schemes.derived_fields import diagnose
from hvisph.schemes.stepper import Stepper
from hvisph.setup.build import MODULUS_FACTOR, Setup
from hvisph.sph.neighbours.particle_layout import slots

ENERGY_SHARE = 0.99  # share of the kinetic energy below the speed that determines the default modulus
MODULUS_RATIO = 0.1  # modulus of a stage with `at: auto` over that of the stage before
CHECK_EVERY = 50  # steps between two checks whether such a stage begins
DISPERSED_SHARE = 0.5  # of the density at rest, below which particles move without pressure


class _State(NamedTuple):
    """Parameters of a late stage."""

    dispersed: np.ndarray  # whether particles have no pressure (n,)
    pressure: np.ndarray  # (n,) [Pa]
    stress: np.ndarray  # von Mises (n,) [Pa]
    highest: float  # pressure [Pa]
    fast: float  # speed below which particles under stress have `ENERGY_SHARE` of their kinetic energy [m/s]
    closing: float  # largest speed at which neighbours close [m/s]
    wanted: float  # least bulk modulus [Pa]


def _dominant_speed(speeds: np.ndarray, masses: np.ndarray) -> float:
    """Return the speed [m/s] below which particles (n,) have the share `ENERGY_SHARE` of the kinetic energy."""
    order = np.lexsort((masses, speeds))  # independent of the order of processes
    energy = np.cumsum((masses * speeds**2)[order])
    return float(speeds[order][np.searchsorted(energy, ENERGY_SHARE * energy[-1])]) if len(order) else 0.0


class LateStages:
    """The late stages of a case, in their order."""

    def __init__(self, case: Case, setup: Setup):
        self._stages, self._setup, self._done = case.late, setup, 0
        self._moduli = np.array([[material.bulk_modulus, material.shear_modulus] for material in setup.substances])
        if case.late:
            assert isinstance(setup.stepper, Stepper)
            self._stepper = setup.stepper

    def resume(self) -> None:
        """Use the materials of the present stage of a resumed run."""
        self._done = int(np.count_nonzero(self._setup.stepper.late[1:]))
        if self._done:
            self._use_materials(self._done - 1, float(self._stepper.late[self._done]))

    def _use_materials(self, number: int, modulus: float) -> np.ndarray:
        """Use the materials of a stage with a bulk modulus [Pa]; return increases of 1/K and 1/G by material [1/Pa]."""
        materials = [late_material(material, modulus, self._stages[number].nu) for material in self._setup.substances]
        self._stepper.use_late_materials(number, materials)
        before, self._moduli = self._moduli, np.array([[modulus, material.shear_modulus] for material in materials])
        stiff = before > 0.0
        return np.divide(1.0, self._moduli, where=stiff, out=np.zeros(before.shape)) - np.divide(
            1.0, before, where=stiff, out=np.zeros(before.shape)
        )

    def is_due(self, time: float, step: int) -> bool:
        """Return whether the next stage begins at `time` [s] or earlier, or `auto` once its modulus suffices."""
        if self._done == len(self._stages):
            return False
        stage = self._stages[self._done]
        if stage.at != "auto":
            return stage.at <= time
        if step % CHECK_EVERY:
            return False
        state, modulus = self._evaluate(), self._largest_modulus()
        return state.wanted <= modulus and state.closing <= self._speed_limit(modulus)

    def pending(self) -> str:
        """Return a note on stages that have not begun; empty where there are none."""
        count = len(self._stages) - self._done
        return f"{count} late stage{'s' if count > 1 else ''} (at: auto) did not begin" if count else ""

    def _largest_modulus(self) -> float:
        """Return the bulk modulus of the next stage [Pa]; by default a tenth of the one before."""
        return float(self._stages[self._done].bulk_modulus or MODULUS_RATIO * self._moduli[:, 0].min())

    def _speed_limit(self, modulus: float) -> float:
        """Return a tenth of the sound speed [m/s] of a stage of a bulk modulus [Pa]."""
        return 0.1 * sqrt(modulus / max(material.density_at_rest for material in self._setup.substances))

    def _evaluate(self) -> _State:
        """Return the present state, on which the beginning of a stage depends."""
        stepper, share = self._stepper, self._setup.subdomain
        particles = stepper.particles
        fields = diagnose(particles, stepper.table, stepper.models)
        pressure, heat = np.maximum(fields["pressure"], 0.0), fields.get("temperature")
        dispersed = np.zeros(particles.count, dtype=bool)
        for number, material in enumerate(self._setup.substances):
            rows = np.flatnonzero(particles.material == number)
            dispersed[rows] = self._is_dispersed(rows, material, None if heat is None else heat[rows])
        pressure[dispersed] = 0.0
        stress = np.where(dispersed, 0.0, fields["von_mises_stress"])
        borne = (pressure > 0.0) | (stress > 0.0)
        speed = np.sqrt((particles["velocity"] ** 2).sum(axis=1))
        speeds, masses = share.gather_rows(speed[borne]), share.gather_rows(particles["mass"][borne])
        fast = share.world.broadcast_from_first(lambda: _dominant_speed(speeds, masses))
        rates = stepper.rates[stepper.place, slots(particles.dim)["R_APPROACH"]]
        highest, strongest, closing = (
            float(share.get_maxima(float(np.where(dispersed, 0.0, np.abs(values)).max(initial=0.0)))[0])
            for values in (pressure, stress, rates)
        )
        density = max(material.density_at_rest for material in self._setup.substances)
        modulus_wanted = max(30.0 * highest, 100.0 * density * fast**2, 100.0 * strongest)
        return _State(dispersed, pressure, stress, highest, fast, closing, modulus_wanted)

    def switch(self, time: float, step: int) -> str:
        """Begin the next stage and return a remark; `Failure` at a pressure above a tenth of its bulk modulus."""
        stepper, stage, state = self._stepper, self._stages[self._done], self._evaluate()
        particles, pressure, dispersed = stepper.particles, state.pressure, state.dispersed
        if stage.at == "auto":
            modulus = self._largest_modulus()
        else:  # without a speed, a pressure or a stress as it was
            modulus = stage.bulk_modulus or min(state.wanted or inf, *self._moduli[:, 0])
        if state.highest * MODULUS_FACTOR > modulus:
            raise Failure(
                "late", f"late stage at {time:.4g} s: the largest pressure is {state.highest:.3g} Pa, above a tenth of "
                f"its bulk modulus of {modulus:.3g} Pa; begin later, or give "
                f"{MODULUS_FACTOR * state.highest:.3g} Pa or more",
                None, None, None, time, step,
            )  # fmt: skip
        for number, material in enumerate(self._setup.substances):
            rows = np.flatnonzero(particles.material == number)
            reference = particles["density"][rows] / (1.0 + pressure[rows] / modulus)
            if self._done == 0:
                pores = material.porosity is not None
                particles["flaw_strain"][rows] = 1.0 / particles["history_variable"][rows] if pores else 1.0
            particles["history_variable"][rows] = np.where(dispersed[rows], np.inf, reference)
        softer = self._use_materials(self._done, modulus)[particles.material]
        elastic = pressure**2 / 2.0 * softer[:, 0] + state.stress**2 / 6.0 * softer[:, 1]
        stepper.late[0] += self._setup.subdomain.exact_sum(particles["mass"] / particles["density"] * elastic)
        self._done += 1
        stepper.late[self._done] = modulus
        remark = (f"late stage from {time:.4g} s, bulk modulus {modulus:.3g} Pa: largest pressure {state.highest:.3g} "
                  f"Pa; 99 % of the kinetic energy under stress is of particles slower than {state.fast:.3g} m/s; "
                  f"{state.wanted:.3g} Pa would be the default")  # fmt: skip
        slow = self._speed_limit(modulus)
        if state.closing > slow:
            remark += (
                f"; warning: particles close at {state.closing:.3g} m/s, above a tenth of the new sound speed, "
                f"{slow:.3g} m/s: the shock has not left; begin later or give a higher bulk modulus"
            )
        return remark

    def _is_dispersed(self, rows: np.ndarray, material: Material, temperature: np.ndarray | None) -> np.ndarray:
        """Return which particles of a material move without pressure, because they are hot or thin (n,)."""
        particles = self._stepper.particles
        rho, density_at_zero = particles["density"][rows], particles["history_variable"][rows]
        if self._done:
            limit = DISPERSED_SHARE * material.density * particles["flaw_strain"][rows]
            return np.asarray(~np.isfinite(density_at_zero) | (rho < limit))
        thin = (rho if material.porosity is None else rho * density_at_zero) < DISPERSED_SHARE * material.density
        hot = False if temperature is None else temperature > material.melting_point  # not a number is never above
        return np.asarray(thin | hot)
