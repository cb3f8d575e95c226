"""Parameters of every task that is flown: the air, the sensors and what the vehicle's maker did not measure exactly."""

import warp as wp

from policies.tasks.task_params import TaskParam


@wp.struct
class FlightParams:
    """One row per environment; declared in `FLIGHT_PARAMS`, in the same order."""

    wind_m_s: float
    wind_turbulence: float
    wind_gust_m_s: float
    sensor_noise: float
    mass_scale: float
    motor_scale: float


FLIGHT_PARAMS = (
    TaskParam(
        "wind_m_s", 0.0, 0.0, 12.0, "m/s", "mean wind at all heights, from a direction drawn per episode", "guess"
    ),
    TaskParam("wind_turbulence", 1.0, 0.0, 3.0, "1", "of the mean wind; 1 is MIL-F-8785C's", "MIL-F-8785C"),
    TaskParam("wind_gust_m_s", 0.0, 0.0, 8.0, "m/s", "largest gust on top of the mean", "guess"),
    TaskParam("sensor_noise", 1.0, 0.0, 2.0, "1", "factor on every sensor's errors, rounded to a quarter", "guess"),
    TaskParam("mass_scale", 1.0, 0.7, 1.4, "1", "factor on mass and moments of inertia", "guess"),
    TaskParam("motor_scale", 1.0, 0.8, 1.2, "1", "factor on the motors' thrust", "guess"),
)
