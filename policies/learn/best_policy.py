"""The policy that was judged best so far: what a training with `keep_best` ends with.

In: the policy at each judgement. Out: a copy of the best, with its card; it goes into checkpoints with all else.
"""

import copy
import math
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from policies.learn.evaluate import Evaluation
from policies.learn.export.policy_file import PolicyCard, policy_of, policy_record
from policies.learn.networks.policy import Policy


class BestPolicy:
    """Empty until a policy was judged."""

    def __init__(self) -> None:
        self.judged: Evaluation | None = None
        """The judgement of the best."""
        self._worth = (False, -math.inf)
        self._record: dict[str, Any] = {}
        self._card: dict[str, Any] = {}

    def offer(self, policy: Policy, card: PolicyCard, judged: Evaluation, worth: tuple[bool, float]) -> None:
        """Keeps a copy if none was worth as much; of equals the later, which learned longer.

        Args:
            policy: that was judged.
            card: its.
            judged: what it came to.
            worth: `Evaluation.worth`, or something else that is compared so.
        """
        if worth >= self._worth:
            self.judged, self._worth = judged, worth
            self._record = copy.deepcopy(policy_record(policy))
            self._card = asdict(card)

    def restored(self) -> tuple[Policy, PolicyCard]:
        """The best."""
        return policy_of(self._record, "the best policy"), PolicyCard(**self._card)

    def state(self) -> dict[str, Any]:
        """Everything, as plain values and tensors."""
        judged = asdict(self.judged) if self.judged is not None else None
        return {"judged": judged, "worth": self._worth, "policy": self._record, "card": self._card}

    def load_state(self, state: Mapping[str, Any]) -> None:
        """Restores what `state` returned."""
        self.judged = Evaluation(**state["judged"]) if state["judged"] is not None else None
        self._record, self._card = state["policy"], state["card"]
        worth = state.get("worth")  # checkpoints of before held a number, or nothing
        known = self.judged.worth if self.judged is not None else (False, -math.inf)
        self._worth = worth if isinstance(worth, tuple) else known
