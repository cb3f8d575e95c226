"""Curricula: which lesson each environment parameter is in, and when the next begins.

In: the scores of ended episodes and the fraction of the training that is done. Out: parameters, or what they are drawn
from, for `Task.set_params`. A number or a sampler without a curriculum is a single lesson that never ends.
"""

from collections import deque
from collections.abc import Mapping
from typing import Any

from policies.learn.config.environment import CompletionCriteria, EnvironmentParameter, lessons_of
from policies.learn.training_curves import NO_SCORES, score_record, scores_of
from policies.tasks.episode import Outcome
from policies.tasks.task import Scores
from policies.tasks.task_params import Sampler


class RecentEpisodes:
    """The scores of the last so many episodes, and of those that ended in the same iteration as the oldest of them."""

    def __init__(self, least: int) -> None:
        self.least = least
        """Episodes that are kept at least."""
        self.scores = NO_SCORES
        self._parts: deque[Scores] = deque()

    def add(self, scores: Scores) -> None:
        """Counts the episodes of one iteration."""
        if not scores.episode_count:
            return
        self._parts.append(scores)
        self.scores = self.scores + scores
        while self.scores.episode_count - self._parts[0].episode_count >= self.least:
            self.scores = _without(self.scores, self._parts.popleft())

    def clear(self) -> None:
        """Forgets them."""
        self._parts.clear()
        self.scores = NO_SCORES

    def state(self) -> dict[str, Any]:
        """Everything, as plain values."""
        return {"sums": score_record(self.scores), "parts": [score_record(part) for part in self._parts]}

    def load_state(self, state: Mapping[str, Any]) -> None:
        """Restores what `state` returned."""
        self._parts = deque(scores_of(record) for record in state["parts"])
        self.scores = scores_of(state["sums"])


def _without(all_scores: Scores, part: Scores) -> Scores:
    outcomes = tuple(a - b for a, b in zip(all_scores.outcomes, part.outcomes, strict=True))
    return Scores(outcomes, all_scores.return_sum - part.return_sum, all_scores.length_sum - part.length_sum)


class Curriculum:
    """The lesson each parameter is in."""

    def __init__(self, parameters: Mapping[str, EnvironmentParameter]) -> None:
        self._lessons = {name: lessons_of(name, parameter) for name, parameter in parameters.items()}
        self.lesson = dict.fromkeys(self._lessons, 0)
        """Index of the lesson, by parameter."""
        self._smoothed = dict.fromkeys(self._lessons, 0.0)
        criteria = [lesson.completion_criteria for lessons in self._lessons.values() for lesson in lessons]
        self._episodes = RecentEpisodes(max([1, *(c.min_lesson_length for c in criteria if c)]))

    def params(self) -> dict[str, Sampler]:
        """What each parameter is drawn from now."""
        return {name: lessons[self.lesson[name]].sampler for name, lessons in self._lessons.items()}

    def final_params(self) -> dict[str, Sampler]:
        """What each parameter is drawn from in its last lesson: what a policy is judged by."""
        return {name: lessons[-1].sampler for name, lessons in self._lessons.items()}

    @property
    def is_last(self) -> bool:
        """Whether every parameter is in its last lesson."""
        return all(self.lesson[name] == len(lessons) - 1 for name, lessons in self._lessons.items())

    def advance(self, scores: Scores, progress: float) -> tuple[list[str], bool]:
        """Counts ended episodes and moves on where a lesson is over.

        Args:
            scores: of the episodes that ended since the last call.
            progress: fraction of the training's steps that are done.

        Returns:
            A line for the user per parameter that moved on, and whether the environments are to start anew.
        """
        self._episodes.add(scores)
        lines, is_reset = [], False
        for name, lessons in self._lessons.items():
            k = self.lesson[name]
            criteria = lessons[k].completion_criteria
            if criteria is None or k + 1 == len(lessons) or not self._is_over(name, criteria, progress):
                continue
            self.lesson[name] = k + 1
            is_reset = is_reset or criteria.require_reset
            lines.append(f"{name}: lesson {lessons[k + 1].name} begins")
        if lines:
            self._episodes.clear()
        return lines, is_reset

    def _is_over(self, name: str, criteria: CompletionCriteria, progress: float) -> bool:
        scores = self._episodes.scores
        count = scores.episode_count
        if count < criteria.min_lesson_length:
            return False
        if criteria.measure == "progress":
            return progress > criteria.threshold
        if count == 0:
            return False
        total = scores.return_sum if criteria.measure == "reward" else scores.count(Outcome.SUCCESS)
        measure = total / count
        if criteria.signal_smoothing:
            measure = 0.25 * self._smoothed[name] + 0.75 * measure
            self._smoothed[name] = measure
        return measure > criteria.threshold

    def tags(self) -> dict[str, float]:
        """TensorBoard tag to lesson number."""
        return {f"Environment/Lesson Number/{name}": float(k) for name, k in self.lesson.items()}

    def state(self) -> dict[str, Any]:
        """Everything, as plain values."""
        return {"lesson": self.lesson, "smoothed": self._smoothed, "episodes": self._episodes.state()}

    def load_state(self, state: Mapping[str, Any]) -> None:
        """Restores what `state` returned; parameters that are new since then begin with their first lesson."""
        for name, lessons in self._lessons.items():
            self.lesson[name] = min(state["lesson"].get(name, 0), len(lessons) - 1)
            self._smoothed[name] = state["smoothed"].get(name, 0.0)
        self._episodes.load_state(state["episodes"])
