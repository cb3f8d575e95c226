"""Tasks: what a policy is asked to do, as Gymnasium environments round the rig."""
