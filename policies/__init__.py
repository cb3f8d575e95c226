"""Tasks, learning and trained policies. Importing it registers the tasks with Gymnasium, where that is installed."""

from policies.tasks.catalogue import CATALOGUE

try:
    import gymnasium
except ModuleNotFoundError:  # it comes with the extra `gym`; a policy flies without it
    pass
else:
    for _name, _entry in CATALOGUE.items():
        gymnasium.register(
            id=f"honeyguide/{_name}-v0",
            entry_point="policies.tasks.gym:TaskEnv",
            vector_entry_point="policies.tasks.gym:TaskVectorEnv",
            max_episode_steps=_entry.max_episode_steps,
            kwargs={"task": _name},
        )
