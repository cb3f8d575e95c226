"""Tasks as Gymnasium environments: one (`TaskEnv`) or a batch (`TaskVectorEnv`), the same kernels.

    env = gymnasium.make("policies:honeyguide/RollerBall-v0", preset="as-coded", numbers={"mass_kg": 2.0})
    envs = gymnasium.make_vec("policies:honeyguide/RollerBall-v0", num_envs=1024, autoreset_mode="NextStep")

Keyword arguments are the task's settings, and: `numbers`, its parameters; `has_privileged`, whether observations show
what critics alone may see. An observation is a vector, or a dict of `image`, `vector` and `privileged` where there is
more. `info["outcome"]` names how an episode ended, but where `gymnasium.make`'s limit cuts it, outside of here. Arrays
that are returned are copies; whoever wants none takes a `Task` and its buffers.
"""

from collections.abc import Mapping, Sequence
from numbers import Real
from typing import Any

import gymnasium
import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.utils.seeding import np_random
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from policies.tasks.catalogue import UnknownTask, build_task, task_settings
from policies.tasks.episode import Outcome
from policies.tasks.gym_arrays import Array, Observation, TaskArrays, action_space, observation_space
from policies.tasks.task import Task
from policies.tasks.task_params import NumberError, Sampler

Numbers = Mapping[str, float | tuple[float, float] | Sampler]


class TaskEnv(gymnasium.Env[Observation, Any]):
    """One environment of a task."""

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 50}  # noqa: RUF012  (as Gymnasium declares it)

    def __init__(
        self,
        task: str | type[Task],
        render_mode: str | None = None,
        *,
        numbers: Numbers | None = None,
        has_privileged: bool = False,
        **settings: Any,
    ) -> None:
        """Builds the task; nothing has begun yet.

        Args:
            task: its name, `module:Class`, or the class.
            render_mode: `rgb_array`, or none.
            numbers: its parameters, and what they are drawn from where that is not one value: a range or a sampler.
            has_privileged: whether observations have what critics alone may see, as `privileged`.
            settings: of the task.

        Raises:
            NumberError: a number that the task has not, or out of its bounds.
            UnknownTask: no such task, setting or value, or nothing privileged in it.
        """
        self._arguments = {"task": task, "render_mode": render_mode, **settings}
        self._arguments |= {"numbers": numbers, "has_privileged": has_privileged}
        self.task = _built(task, 1, numbers, settings)
        self.render_mode = render_mode
        self.metadata = {**self.metadata, "render_fps": _render_fps(self.task)}
        self.observation_space = observation_space(self.task.layout, has_privileged=has_privileged)
        self.action_space = action_space(self.task.layout)
        self._arrays = TaskArrays(self.task, has_privileged=has_privileged)
        self._is_next_begun = False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Starts an episode, after an end the one that the task has begun by itself; `options` are not used."""
        super().reset(seed=seed, options=options)
        if seed is not None or not self._arrays.is_begun:
            self._arrays.reset(_drawn_seed(self.np_random))
        elif not self._is_next_begun:  # to begin it again would lose what a task carries over from the last episode
            self.task.begin(np.ones(1, dtype=np.bool_))
        self._is_next_begun = False
        return self._arrays.observation(0), {}

    def step(self, action: Any) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """One decision.

        Raises:
            ResetNeeded: no episode has been started, or the last one has ended.
            ValueError: an action that the action space has not.
        """
        arrays = self._arrays
        if self._is_next_begun or not arrays.is_begun:
            raise ResetNeeded("step: no episode is running: call reset() first")
        arrays.act(action, is_single=True)
        self.task.step()
        is_over = self._is_next_begun = bool(arrays.is_over[0])
        info = {"outcome": Outcome(int(arrays.outcomes[0])).name.lower()} if is_over else {}
        return (
            arrays.observation(0, is_final=is_over),
            float(arrays.rewards[0]),
            bool(arrays.is_terminated[0]),
            bool(arrays.is_truncated[0]),
            info,
        )

    def close(self) -> None:
        """Gives back what the task holds besides memory."""
        self.task.close()

    def render(self) -> Any:
        """What is seen from above, RGB."""
        return self.task.top_view(0) if self.render_mode == "rgb_array" else None

    def __getstate__(self) -> dict[str, Any]:
        """What it was made from and how far it is: a pickle of it goes on where it was."""
        return {"arguments": self._arguments, **_progress(self), "is_next_begun": self._is_next_begun}

    def __setstate__(self, state: dict[str, Any]) -> None:
        TaskEnv.__init__(self, **state["arguments"])
        _go_on(self, state)
        self._is_next_begun = state["is_next_begun"]


class TaskVectorEnv(VectorEnv[Observation, Array, Array]):
    """Many environments in one launch."""

    metadata: dict[str, Any] = {  # noqa: RUF012  (as Gymnasium declares it)
        "render_modes": ["rgb_array"],
        "autoreset_mode": AutoresetMode.SAME_STEP,
    }

    def __init__(
        self,
        task: str | type[Task],
        num_envs: int = 1,
        render_mode: str | None = None,
        *,
        autoreset_mode: AutoresetMode | str = AutoresetMode.SAME_STEP,
        max_episode_steps: int | None = None,
        numbers: Numbers | None = None,
        has_privileged: bool = False,
        **settings: Any,
    ) -> None:
        """Builds the task; nothing has begun yet. The other arguments are those of `TaskEnv`.

        Args:
            task: its name, `module:Class`, or the class.
            num_envs: how many environments.
            render_mode: `rgb_array`, or none.
            autoreset_mode: when the episode after an end begins: in the same step, which shows the last observation as
                `info["final_obs"]`; with the next step, whose action is not used; or by `reset` alone.
            max_episode_steps: decisions after which an episode is truncated, whatever the task's own limit is; none, or
                -1 as Gymnasium has it: never.
            numbers: its parameters.
            has_privileged: whether observations have what critics alone may see.
            settings: of the task.

        Raises:
            NumberError: a number that the task has not, or out of its bounds.
            UnknownTask: no such task, setting or value, or nothing privileged in it.
        """
        self._arguments = {
            "task": task,
            "num_envs": num_envs,
            "render_mode": render_mode,
            "numbers": numbers,
            **settings,
        }
        self._arguments |= {"autoreset_mode": autoreset_mode, "max_episode_steps": max_episode_steps}
        self._arguments["has_privileged"] = has_privileged
        if max_episode_steps is not None and max_episode_steps != -1 and max_episode_steps < 1:
            raise NumberError(f"max_episode_steps: must be at least 1, or -1 for no limit, not {max_episode_steps}")
        self.task = _built(task, num_envs, numbers, settings)
        self.num_envs = num_envs
        self.render_mode = render_mode
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        self.metadata = {**self.metadata, "autoreset_mode": self.autoreset_mode, "render_fps": _render_fps(self.task)}
        self.single_observation_space = observation_space(self.task.layout, has_privileged=has_privileged)
        self.single_action_space = action_space(self.task.layout)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._limit = None if max_episode_steps == -1 else max_episode_steps
        self._arrays = TaskArrays(self.task, has_privileged=has_privileged)
        self._is_ended = np.zeros(num_envs, dtype=np.bool_)  # and nobody has been shown the next episode

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Starts episodes.

        Args:
            seed: of the first environment, the others' are the numbers that follow; or a list with one of each. None:
                the next episode, of which the first one's seed is drawn.
            options: `reset_mask`, shape (envs,): which environments begin; the others go on. Those that have ended
                begin the episode that the task has begun by itself.

        Raises:
            ResetNeeded: some are to begin where never all have.
            TypeError: a mask that is no array of booleans.
            ValueError: a list of seeds or a mask of another length, or a mask that chooses none.
        """
        super().reset(seed=seed if isinstance(seed, int) else None, options=options)
        mask = _reset_mask(options, self.num_envs)
        chosen = np.ones(self.num_envs, dtype=np.bool_) if mask is None else mask
        if not self._arrays.is_begun and not chosen.all():
            raise ResetNeeded("reset: reset_mask: no episode is running: reset all environments first")
        self._begin(chosen, [seed + i for i in range(self.num_envs)] if isinstance(seed, int) else seed)
        self._is_ended = self._is_ended & ~chosen  # a new array: the info of the last step has the old one
        return self._arrays.last_seen(self._is_ended), {}

    def _begin(self, is_chosen: NDArray[np.bool_], seeds: Sequence[int | None] | None) -> None:
        """Begins the chosen rows: by their seeds, or with their next episodes."""
        given = [None] * self.num_envs if seeds is None else list(seeds)
        if len(given) != self.num_envs:
            raise ValueError(f"reset: seed: there are {len(given)} for {self.num_envs} environments")
        is_anew = is_chosen & np.array([seed is not None or not self._arrays.is_begun for seed in given])
        generators = [self.np_random if seed is None else np_random(seed)[0] for seed in given]
        if is_anew.any():
            self._arrays.reset([_drawn_seed(generator) for generator in generators], is_anew)
        is_next = is_chosen & ~is_anew & ~self._is_ended  # what has ended has begun its next episode by itself
        if is_next.any():
            self.task.begin(is_next)

    def step(self, actions: Array) -> tuple[Observation, Array, Array, Array, dict[str, Any]]:
        """One decision each.

        Raises:
            ResetNeeded: nothing has begun; or an episode has ended, and nothing but `reset` begins the next.
            ValueError: an action that the action space has not.
        """
        arrays, held = self._arrays, self._is_ended
        if not arrays.is_begun or (held.any() and self.autoreset_mode is AutoresetMode.DISABLED):
            count = int(held.sum()) if arrays.is_begun else self.num_envs
            raise ResetNeeded(
                f"step: no episode is running in {count} of the environments: call reset() first, "
                "with reset_mask in its options for these alone"
            )
        arrays.act(actions, held)
        if held.any():
            self.task.step_others(held)
        else:
            self.task.step()
        if self._limit is not None:
            arrays.cut(self._limit, ~held)
        is_over = arrays.is_over & ~held
        info: dict[str, Any] = {}
        if is_over.any():
            outcome = {"outcome": arrays.outcomes.copy(), "_outcome": is_over}
            info = dict(outcome)
        is_same_step = self.autoreset_mode is AutoresetMode.SAME_STEP
        if is_same_step and is_over.any():
            info |= {"final_obs": arrays.final_observations(is_over), "_final_obs": is_over}
            info |= {"final_info": outcome, "_final_info": is_over}
        rewards = np.where(held, 0.0, arrays.rewards).astype(np.float64)
        is_terminated, is_truncated = arrays.is_terminated & ~held, arrays.is_truncated & ~held
        self._is_ended = np.zeros_like(is_over) if is_same_step else is_over
        return arrays.last_seen(self._is_ended), rewards, is_terminated, is_truncated, info

    def close_extras(self, **_: Any) -> None:
        """Gives back what the task holds besides memory."""
        self.task.close()

    def render(self) -> Any:
        """A tuple of images, RGB."""
        return tuple(self.task.top_view(i) for i in range(self.num_envs)) if self.render_mode == "rgb_array" else None

    def __getstate__(self) -> dict[str, Any]:
        """What it was made from and how far it is: a pickle of it goes on where it was."""
        return {"arguments": self._arguments, **_progress(self), "is_ended": self._is_ended}

    def __setstate__(self, state: dict[str, Any]) -> None:
        TaskVectorEnv.__init__(self, **state["arguments"])
        _go_on(self, state)
        self._is_ended = state["is_ended"]


def _built(task: str | type[Task], env_count: int, numbers: Numbers | None, settings: Mapping[str, Any]) -> Task:
    built = build_task(task, env_count, task_settings(task, settings))
    if built.is_skipped is not None:
        raise UnknownTask(f"{built.layout.task}: begins episodes by itself: take it from gymnasium.make_vec")
    if not isinstance(numbers, Mapping | None):
        raise NumberError(f"numbers: must be a dictionary of parameters and their values, not {numbers}")
    built.set_params({name: _drawn_from(name, value) for name, value in (numbers or {}).items()})
    return built


def _drawn_from(name: str, value: Any) -> float | Sampler:
    if not isinstance(value, (tuple, list)):
        return value
    if len(value) != 2 or not all(isinstance(end, Real) for end in value):
        raise NumberError(f"{name}: a range is a pair of numbers, not {value}")
    return Sampler(intervals=((value[0], value[1]),))


def _render_fps(task: Task) -> int:
    return max(1, round(1.0 / task.decision_s))


def _progress(env: TaskEnv | TaskVectorEnv) -> dict[str, Any]:
    """How far an environment is, and the generators of its spaces."""
    spaces = {name: value for name, value in vars(env).items() if name.endswith("_space")}
    own = {name: getattr(env, name) for name in ("spec", "_np_random", "_np_random_seed")}
    return {"task": env.task.state(), "is_begun": env._arrays.is_begun, "attributes": {**own, **spaces}}


def _go_on(env: TaskEnv | TaskVectorEnv, state: Mapping[str, Any]) -> None:
    vars(env).update(state["attributes"])
    env._arrays.is_begun = state["is_begun"]
    env.task.load_state(state["task"])


def _drawn_seed(generator: np.random.Generator) -> int:
    return int(generator.integers(2**31))


def _reset_mask(options: Mapping[str, Any] | None, env_count: int) -> NDArray[np.bool_] | None:
    if options is None or "reset_mask" not in options:
        return None
    mask = options["reset_mask"]
    if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_:
        raise TypeError("reset: reset_mask: must be a NumPy array of booleans")
    if mask.shape != (env_count,) or not mask.any():
        raise ValueError(f"reset: reset_mask: must have shape ({env_count},) and choose one at least")
    return mask
