"""Where the reward comes from: the task, demonstrations, novelty."""
