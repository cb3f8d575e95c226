"""A model of a task's dynamics, learnt from logs, and a task to train in that is this model."""
