"""Stepping a built case by hand, for tests that look at the state between steps."""


def advance(setup, end, cfl=0.3, steps=None, watch=None):
    """Step to `end` [s] (or for `steps`); return the change of total energy [J], what a contact holds included, and the names of the limits."""
    stepper, criteria = setup.stepper, setup.criteria

    def limit():
        found = criteria.limit(stepper.lengths, stepper.signals, stepper.rates, stepper.place, stepper.particles.id)
        assert found.criterion != "not_finite"
        return min([(found.dt, found.criterion), *((cfl * t, name) for t, name, _ in stepper.limits())])

    stepper.start()
    total = stepper.sums[:2].sum()
    step, time, names, count = limit()[0], 0.0, set(), 0
    stepper.predict(step)
    while time < end and (steps is None or count < steps):
        stepper.evaluate()
        following, name = limit()
        following = min(following, 1.1 * step)
        stepper.complete(step, following)
        time, step, count = time + step, following, count + 1
        names.add(name)
        if watch is not None:
            watch(setup)
    return stepper.sums[:2].sum() + stepper.stored_energy - total, names
