"""What a companion's pilots are called."""

SCRIPTED = "scripted"
TASK = "FollowMe"
FOLLOWER = "follow-me-tracked"
"""The policy by which a drone follows unless another is named."""
