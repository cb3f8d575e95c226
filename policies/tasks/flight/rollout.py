"""What a vehicle does by a level velocity that it is asked for, and where braking to a stand from there leads it.

It answers with a lag, and no faster than by an acceleration that it is taken to have.
"""

import warp as wp

wp.set_module_options({"enable_backward": False})


@wp.kernel(enable_backward=False)
def roll(
    asked: wp.array(dtype=wp.vec2),
    now: wp.array(dtype=wp.vec2),
    hears_s: float,
    lag_s: float,
    brake: float,
    ahead_m: float,
    step_s: float,
    way: wp.array2d(dtype=wp.vec2),
) -> None:
    """Where each of some velocities leads, and so far ahead of it.

    Args:
        asked: [m/s], (velocities,).
        now: the vehicle's own [m/s], and what was asked for before and is answered until the new one is heard [m/s].
        hears_s: until then.
        lag_s: of the answer.
        brake: [m/s²] by which its velocity changes at most.
        ahead_m: [m] it looks beyond where it is, once it has the velocity that it was asked for.
        step_s: from place to place.
        way: [m] from here, out, (velocities, steps + 1); the first stays as it is.
    """
    i = wp.tid()
    unit = asked[i] / wp.max(wp.length(asked[i]), 1.0e-6)
    velocity = now[0]
    place = wp.vec2(0.0, 0.0)
    changed_s = float(-1.0)  # when it has the velocity that it is asked for
    for k in range(way.shape[1] - 1):
        time_s = (float(k) + 0.5) * step_s
        done = float(0.0)
        wanted = now[1]
        if time_s >= hears_s:
            if changed_s < 0.0:
                changed_s = hears_s + lag_s + wp.length(asked[i] - velocity) / brake
            done = wp.min((time_s - hears_s) / (changed_s - hears_s + 1.0e-3), 1.0)
            wanted = wp.where(done < 1.0, asked[i], wp.vec2(0.0, 0.0))
        change = (wanted - velocity) * wp.min(step_s / wp.max(lag_s, 1.0e-3), 1.0)
        change *= wp.min(brake * step_s / wp.max(wp.length(change), 1.0e-6), 1.0)
        place += (velocity + 0.5 * change) * step_s
        velocity += change
        way[i, k + 1] = place + done * ahead_m * unit
