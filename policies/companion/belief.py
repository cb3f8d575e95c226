"""Where a policy believes the owner to be: its beliefs, read as a sighting for the tracker.

In: the beliefs of one decision (policies/learn/networks/perception.py). Out: the position of the owner's chest from the
vehicle in metres, if the policy believes to have them in the image.
"""

from common.attitude import Vector
from policies.learn.networks.perception import Beliefs, Perception
from policies.learn.networks.policy import Policy
from policies.tasks.layout import Layout

PLACE = tuple(f"true_owner_pos_hfrd_{axis}" for axis in "xyz")
IN_VIEW = "is_owner_in_view"
SURE = 0.5  # probability above which the owner counts as seen: whichever is likelier


class OwnerBelief:
    """Reads the beliefs of one policy.

    Args:
        layout: of the policy: its scales.
        perception: of the policy; knows PLACE and IN_VIEW.
    """

    def __init__(self, layout: Layout, perception: Perception) -> None:
        scales = {element.name: element.scale for element in layout.privileged}
        self._place = [(perception.names.index(name), scales[name]) for name in PLACE]
        self._in_view = perception.names.index(IN_VIEW)

    def position(self, beliefs: Beliefs) -> Vector | None:
        """[m] Ahead, right and down of the vehicle; None: the owner is believed to be out of sight."""
        means = beliefs.means[0].tolist()
        if means[self._in_view] < SURE:
            return None
        ahead, right, down = (means[k] * scale for k, scale in self._place)
        return ahead, right, down


def owner_belief(policy: Policy) -> OwnerBelief | None:
    """How to read a policy's beliefs; None if it has none of where the owner is."""
    perception = policy.perception
    if perception is None or not {*PLACE, IN_VIEW} <= {*perception.names}:
        return None
    return OwnerBelief(policy.layout, perception)
