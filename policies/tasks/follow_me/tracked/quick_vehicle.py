"""How our flight controller is set where a vehicle follows by its senses, in training and in flight: quicker than else.

So it stands sooner before who stops: 2.4 m from 4 m/s, not 3.1 m. At 8 m/s² it leans so far that its camera loses them.
"""

QUICK = {"MPC_ACC_HOR": 6.0, "MPC_JERK_MAX": 30.0}
_BRAKES = 0.925  # of the acceleration that is allowed; measured by bench.follow.braking
_JERK_S, _MOST_M_S2 = 0.2, 6.0  # in which it comes to it, and the most, in what was measured


def brake_m_s2(acceleration: float, jerk: float) -> float:
    """With which it is taken to brake [m/s²].

    Args:
        acceleration: MPC_ACC_HOR [m/s²]; more than was measured does not count.
        jerk: MPC_JERK_MAX [m/s³]; what it takes long to come to does not, either.
    """
    return _BRAKES * min(acceleration, _JERK_S * jerk, _MOST_M_S2)
