"""Tasks, learning and trained policies. Importing it registers the tasks with Gymnasium, where that is installed."""

from contextlib import suppress

from policies.tasks.catalogue import CATALOGUE, task_names

try:
    import gymnasium
except ModuleNotFoundError:  # it comes with the extra `gym`; a policy flies without it
    pass
else:
    for _name in task_names():  # those of installed packages too, whose modules are imported where they are made
        with suppress(gymnasium.error.Error):  # a package's name of which Gymnasium makes no ID
            gymnasium.register(
                id=f"honeyguide/{_name}-v0",
                entry_point="policies.tasks.gym:TaskEnv",
                vector_entry_point="policies.tasks.gym:TaskVectorEnv",
                max_episode_steps=CATALOGUE[_name].max_episode_steps if _name in CATALOGUE else None,
                kwargs={"task": _name},
            )
