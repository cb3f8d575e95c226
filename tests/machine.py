"""How fast is this machine? Those that run the tests differ by a factor of five; laws about time are told in frames."""

from time import thread_time

FRAME_S = 0.020
COUNTED = 400_000  # takes Python a frame on a machine that is fast enough to fly


def cost_s(work):
    """Processor time of this thread [s]."""
    start_s = thread_time()
    work()
    return thread_time() - start_s


def frame_s():
    """What stands for a frame here [s]: what counting takes now, on a fast machine a frame itself."""
    return max(FRAME_S, cost_s(lambda: sum(k * k for k in range(COUNTED))))
