"""Tasks, learning and trained policies. Importing it registers the tasks with Gymnasium."""

import gymnasium

from policies.tasks.gym import register

gymnasium.register(
    id="honeyguide/Hover-v0",
    entry_point="policies.tasks.hover:HoverEnv",
    vector_entry_point="policies.tasks.hover:HoverVectorEnv",
)
register()
