"""What the tracked policy would be shown, while another flies: the same senses, the same kernel functions.

In: what a companion hears and sees, and what is flown after each decision. Out: a frame of FollowMe's tracked layout.
"""

import numpy as np
from numpy.typing import NDArray

from common.image_stream import ImageFrame
from policies.companion.names import TASK
from policies.companion.senses.senses import Senses
from policies.companion.skills.skill import Floats, Velocity
from policies.companion.telemetry import Own, Owner
from policies.companion.tracked_observer import TrackedObserver
from policies.tasks.flight.own_state import ACTIONS
from policies.tasks.follow_me.observe import LAYOUT_VERSION
from policies.tasks.follow_me.tracked.vector import TRACKED_ELEMENTS
from policies.tasks.layout import Layout

RECORD_LAYOUT = Layout(TASK, LAYOUT_VERSION, TRACKED_ELEMENTS, ACTIONS)


class TrackedRecorder:
    """One vehicle's.

    Args:
        senses: what the skill has, fed by it; None: it has none, and these are its own.
    """

    def __init__(self, senses: Senses | None) -> None:
        self._own_senses = Senses(hears=True) if senses is None else None
        known = senses or self._own_senses
        if known is None:
            raise RuntimeError("one of them is there")
        self._observer = TrackedObserver(known)
        self._frame: NDArray[np.float32] = np.zeros(len(TRACKED_ELEMENTS), np.float32)

    def sense(self, own: Own, owner: Owner, image: ImageFrame | None) -> None:
        """Takes in what has come, if nobody else does."""
        if self._own_senses is not None:
            self._own_senses.sense(own, owner, image)

    def frame(self, own: Own, flown: Velocity, image_age_s: float, seen: Floats | None) -> Floats:
        """The frame of this decision.

        Args:
            own: telemetry.
            flown: what was asked for after it.
            image_age_s: since the newest image was taken.
            seen: what the policy was shown; None: it is shown something else.
        """
        frame = self._observer.vector(own, image_age_s) if seen is None else seen
        self._frame[:] = frame
        self._observer.flown(*flown)
        return self._frame.copy()
