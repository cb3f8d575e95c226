"""Parts of the fast camera, `sim.sensors.fast_camera.fast_camera`."""
