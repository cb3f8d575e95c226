"""What a task cannot go on with: something of the user's that returns what nothing can be learnt from."""


class TaskError(ValueError):
    """Something that a user's task or environment returned or lacks; the message is one sentence for the user."""
