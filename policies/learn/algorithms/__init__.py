"""PPO, SAC, behavioural cloning and DAgger, with their losses."""
