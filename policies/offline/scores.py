"""How good a policy is, between random actions and an expert, and how the training curves count an evaluation."""

from collections.abc import Sequence

from policies.learn.evaluate import Evaluation
from policies.tasks.episode import Outcome
from policies.tasks.task import Scores


def normalized_score(mean_return: float, references: Sequence[float]) -> float:
    """0 where random actions are, 100 where the expert is (Fu et al. 2020, D4RL, arXiv 2004.07219).

    Args:
        mean_return: of the policy's episodes.
        references: mean returns of random actions and of the expert.
    """
    random, expert = references
    return 100.0 * (mean_return - random) / (expert - random)


def scores_of(evaluation: Evaluation | None) -> Scores:
    """The episodes of an evaluation as those of a training are counted; none: no episode."""
    if evaluation is None:
        return Scores((0,) * len(Outcome), 0.0, 0.0)
    outcomes = tuple(evaluation.outcomes.get(outcome.name.lower(), 0) for outcome in Outcome)
    count = evaluation.episodes
    return Scores(outcomes, evaluation.mean_return * count, evaluation.mean_length * count)
