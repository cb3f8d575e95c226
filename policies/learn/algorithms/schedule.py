"""Numbers that change as training goes on."""

from policies.learn.config.config_block import Schedule

RATE_FLOOR = 1e-10  # ML-Agents' last learning rate
BETA_FLOOR = 1e-5
EPSILON_FLOOR = 0.1


def scheduled(initial: float, floor: float, schedule: Schedule, fraction_done: float) -> float:
    """The number now: `linear` goes from `initial` to `floor`, where it arrives when all is done."""
    if schedule == "constant":
        return initial
    return floor + (initial - floor) * max(1.0 - fraction_done, 0.0)


def sharpened(whole: float, done_before: float, done: float) -> float:
    """What logits are to be scaled by now, so that by three quarters of a training all of `whole` has been."""
    before, after = (min(max(4.0 * fraction - 2.0, 0.0), 1.0) for fraction in (done_before, done))
    return float(whole ** (after - before))
