"""What the vehicle carries and does not fly with: camera, gimbal, outputs."""
