"""How good a policy in training is: it is judged on episodes of its own that it never trained on.

In: the policy, and the training's last episodes. Out: an evaluation, when one is worth its time: by it a training may
end early, and the best policy is kept. It is played on the run's own split of the positions: to choose the policy by
its success on test positions would be to train on them.
"""

from dataclasses import dataclass

from policies.learn.config.behavior import Behavior
from policies.learn.config.offline import OfflineHyperparameters
from policies.learn.curriculum import Curriculum, RecentEpisodes
from policies.learn.evaluate import Evaluation, evaluate
from policies.learn.networks.policy import Policy
from policies.tasks.episode import Outcome
from policies.tasks.task import TaskSettings


@dataclass(frozen=True, slots=True)
class SuccessTarget:
    """The fraction of episodes that is to succeed, and on what."""

    fraction: float | None
    """None: whatever; it is judged for the sake of the best, and training goes on."""
    task_name: str
    settings: TaskSettings
    episode_count: int = 2000
    """Of one judgement."""

    def judge(
        self, policy: Policy, recent: RecentEpisodes, curriculum: Curriculum, episodes_seed: int
    ) -> Evaluation | None:
        """The most probable actions in the last lesson; none before that, and while training fails too often.

        Args:
            policy: what is judged.
            recent: the training's last episodes.
            curriculum: the lessons.
            episodes_seed: of the episodes; another one at each judgement.
        """
        if not (curriculum.is_last and self._is_promising(recent)):
            return None
        params = curriculum.final_params()
        return evaluate(
            policy, self.task_name, self.settings, episodes=self.episode_count, seed=episodes_seed, params=params
        )

    def is_reached(self, evaluation: Evaluation) -> bool:
        """Whether the success rate is above the target with 97.5 % confidence."""
        return self.fraction is not None and evaluation.interval[0] >= self.fraction

    def _is_promising(self, recent: RecentEpisodes) -> bool:
        """Whether enough training episodes succeed, drawn actions and all, to make an evaluation worth its time."""
        if self.fraction is None:
            return True
        scores = recent.scores
        rate = scores.count(Outcome.SUCCESS) / max(scores.episode_count, 1)
        return scores.episode_count >= recent.least and rate >= 1.0 - 5.0 * (1.0 - self.fraction)


def target_of(behavior: Behavior, task_name: str, settings: TaskSettings) -> SuccessTarget | None:
    """What policies in a training are held against; None: nothing, or what a dataset is learnt from by itself."""
    is_offline = isinstance(behavior.hyperparameters, OfflineHyperparameters)
    if behavior.success_target is None and (is_offline or not behavior.keep_best):
        return None
    return SuccessTarget(behavior.success_target, task_name, settings)
