"""The connectors of a simulated vehicle's flight controller: readers and live rows of the rig."""

from autopilot.flight_controller import HostPorts
from common.records import late_reader, row_reader
from sim.rig import Rig
from sim.sensors.esc import esc_reader


def host_ports(rig: Rig, i_vehicle: int = 0) -> HostPorts:
    """The connectors of one vehicle's flight controller, on the live rows of a rig."""
    rows, chosen = rig.rows, slice(i_vehicle, i_vehicle + 1)
    estimator = rows["autopilot.ekf.rows"]
    return HostPorts(
        read_estimate=row_reader(estimator, i_vehicle, "Estimate", "estimate"),
        read_samples=late_reader(rows["sensors"], i_vehicle, "Samples", "samples"),
        read_actuators=row_reader(rows["autopilot.control"], i_vehicle, "Actuators", "actuators"),
        read_health=late_reader(estimator, i_vehicle, "EstimatorState"),
        setpoint=rows["autopilot.setpoint"][chosen],
        read_motor_speeds=esc_reader(rows["truth"], i_vehicle),
        external=rows["autopilot.ekf.external"][chosen],
        airframe=rows["autopilot.airframe"][chosen],
    )
