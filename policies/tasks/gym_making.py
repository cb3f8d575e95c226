"""The environments of a Gymnasium ID, made and closed: in a row, in processes, or as a vector environment.

In: what is registered of the ID, and arguments. Out: a vector environment of Gymnasium, of which single environments
can be held, or one sentence why there is none. Processes leave signals to the process that has made them: whoever stops
a training would stop them in the midst of a step.
"""

import contextlib
import os
import signal
import warnings
from collections.abc import Mapping, Sequence
from typing import Any, Literal

import gymnasium
from gymnasium.envs.registration import EnvSpec, load_env_creator
from gymnasium.vector import AsyncVectorEnv, AutoresetMode, SyncVectorEnv, VectorEnv

from policies.tasks.catalogue import GYM, UnknownTask, import_users_module

Vectorization = Literal["sync", "async", "vector_entry_point"]

_CLOSE_S = 5.0  # for the step that processes are in; guess


class Holdable(gymnasium.Wrapper[Any, Any, Any, Any]):
    """An environment that can leave out the step after a reset: it then shows again what its episode begins with."""

    def __init__(self, env: gymnasium.Env[Any, Any]) -> None:
        super().__init__(env)
        self.is_held = False
        """Whether the next step is left out."""
        self._first: Any = None

    def reset(self, **options: Any) -> Any:
        self._first, info = self.env.reset(**options)
        return self._first, info

    def step(self, action: Any) -> Any:
        if self.is_held:
            self.is_held = False
            return self._first, 0.0, False, False, {}
        return self.env.step(action)


class _Maker:
    """Makes one environment, in this process or in one of its own."""

    def __init__(self, spec: EnvSpec, arguments: Mapping[str, Any]) -> None:
        self._spec, self._arguments, self._pid = spec, arguments, os.getpid()

    def __call__(self) -> Holdable:
        if os.getpid() != self._pid:
            os.setpgrp()  # Ctrl-C reaches the group of a terminal's processes
            for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):  # of a fork, handlers too
                signal.signal(number, signal.SIG_DFL)
        return Holdable(gymnasium.make(self._spec, **self._arguments))


def spec_of(env_id: str) -> EnvSpec:
    """What is registered of an ID; of `module:ID` by importing the module.

    Raises:
        UnknownTask: nothing is.
    """
    module, _, own_id = env_id.rpartition(":")
    if module:
        import_users_module(f"{GYM}{env_id}", module)
    try:
        return gymnasium.spec(own_id)
    except gymnasium.error.Error as error:
        raise UnknownTask(f"{GYM}{env_id}: {_one_line(error)}") from None


def is_vector(spec: EnvSpec, vectorization: Vectorization) -> bool:
    """Whether the vector environment of an ID is made: what steps all, and can hold none."""
    return spec.entry_point is None or vectorization == "vector_entry_point"


def make_envs(
    spec: EnvSpec, env_count: int, vectorization: Vectorization, arguments: Mapping[str, Any]
) -> VectorEnv[Any, Any, Any]:
    """Environments that begin no episode by themselves, or the vector environment of the ID as it is.

    Args:
        spec: what is registered.
        env_count: how many.
        vectorization: how they are stepped; of an ID that has a vector environment alone, by that.
        arguments: of the environments.

    Raises:
        UnknownTask: they cannot be made.
    """
    name = f"{GYM}{spec.id}"
    entry_point = spec.vector_entry_point if is_vector(spec, vectorization) else spec.entry_point
    arguments = dict(arguments)
    if "render_mode" not in arguments and "rgb_array" in _render_modes(name, entry_point):
        arguments["render_mode"] = "rgb_array"
    if is_vector(spec, vectorization):
        made = _called(name, lambda: gymnasium.make_vec(spec, env_count, "vector_entry_point", **arguments))
        envs: VectorEnv[Any, Any, Any] = made
        if not isinstance(envs.metadata.get("autoreset_mode"), AutoresetMode):
            raise UnknownTask(
                f"{name}: is a vector environment that does not say when it begins episodes: its metadata need an "
                "autoreset_mode"
            )
        return envs
    makers = [_Maker(spec, arguments)] * env_count
    kind = SyncVectorEnv if vectorization == "sync" else AsyncVectorEnv
    return _called(name, lambda: kind(makers, autoreset_mode=AutoresetMode.DISABLED))


def close_envs(envs: VectorEnv[Any, Any, Any]) -> None:
    """Closes environments, and ends processes of theirs; one that cannot be closed costs nobody what was learnt."""
    try:
        if isinstance(envs, AsyncVectorEnv):
            with contextlib.suppress(EOFError, OSError):  # of a process that has ended already
                envs.close(timeout=_CLOSE_S)
        else:
            envs.close()
    except Exception as error:  # whatever anybody's close raises
        warnings.warn(f"environments were not closed: {type(error).__name__}: {_one_line(error)}", stacklevel=2)


def renders(envs: VectorEnv[Any, Any, Any]) -> bool:
    """Whether environments may be asked for an image; what has a process of its own would end it by raising there."""
    return not isinstance(envs, AsyncVectorEnv) or envs.render_mode is not None


def _render_modes(name: str, at: Any) -> Sequence[str]:
    creator = _called(name, lambda: load_env_creator(at)) if isinstance(at, str) else at
    return getattr(creator, "metadata", {}).get("render_modes", ())


def _called(name: str, make: Any) -> Any:
    """What Gymnasium makes; what it or the environment's constructor will not take is told in one sentence."""
    try:
        return make()
    except Exception as error:  # whatever a constructor of somebody else's raises
        raise UnknownTask(f"{name}: cannot be made: {type(error).__name__}: {_one_line(error)}") from error


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split()).rstrip(".")
