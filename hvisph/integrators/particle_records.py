"""What compiled loops over single particles hand each other: named tuples of numbers, vectors and tensors."""

from __future__ import annotations

from collections import namedtuple

# The state of a particle: position, velocity, density, specific internal energy, smoothing length, deviator
# (six components), plastic strain, damage and memory (five numbers, see `materials.stress_update`); what it stands
# for is in `hvisph.core.fields`.
State = namedtuple("State", "x u rho e h s plastic_strain damage memory")

# The rates of a particle: acceleration, power, velocity gradient in the plane, rate of ln(rho) beside it, and the
# rate of the circumference of a ring, 0 elsewhere.
Rates = namedtuple("Rates", "a power l density hoop")

# What `pack` of a formulation writes into a particle's row: position and velocity, mass in the plane, density, energy,
# smoothing length, pressure, speeds of bulk, longitudinal and shear waves, deviator (six components), body, radius
# of the ring, 0 elsewhere, twice the rate at which angular momentum is to be taken back, for each mass (axial), and the
# lead of ln(rho) over the number of particles.
Shown = namedtuple("Shown", "x u mass rho e h p c c_l c_t s body ring spin lead")

# What `show_limits` of a formulation that asks for it writes beside: normal and shear traction that the particle bears,
# whether it has failed, how much of its order is left, whether its smoothing length is free to follow; its density at
# rest.
Limits = namedtuple("Limits", "tension shear failed order free at_rest")
