"""The gimbal the camera hangs on."""
