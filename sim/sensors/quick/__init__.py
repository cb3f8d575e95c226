"""Parts of the fast camera, `sim.sensors.quick_camera`."""
