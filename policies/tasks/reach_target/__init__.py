"""ReachTarget: a four-wheeled car drives to a target on a platform without walls ("Learning to Drive")."""
