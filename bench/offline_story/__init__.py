"""From logged flights to a policy, without flying it before it is known how good it is."""
