"""Components besides the autopilot: camera, gimbal, winch."""
