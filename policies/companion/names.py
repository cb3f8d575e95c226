"""What a companion's pilots are called."""

SCRIPTED = "scripted"
TASK = "FollowMe"
