"""Control allocation: torque and collective thrust to motor commands, and what could not be achieved, 250 Hz.

Where a rotor would leave its range, yaw gives way first, then collective thrust, roll and pitch last; but for these the
collective does not rise above the weight, lest a vehicle that leans hard again and again climbs away (ArduPilot bounds
it so by its throttle mix, PX4 lets it not rise at all unless MC_AIRMODE is set).
"""

import warp as wp

from autopilot.vehicles.multirotor.control_airframe import ControlAirframe
from common.geodesy import GRAVITY_M_S2
from common.kernels import vec8

wp.set_module_options({"enable_backward": False})

_TINY = wp.constant(1.0e-9)
_BIG = wp.constant(1.0e9)
_GRAVITY = wp.constant(GRAVITY_M_S2)


@wp.struct
class Allocation:
    thrust_n: vec8  # per rotor
    collective_n: float  # achieved
    torque_frd: wp.vec3  # [N m] achieved
    collective_short_n: float  # asked minus achieved
    torque_short_frd: wp.vec3


@wp.func
def speed_fraction(command: float, curve: float) -> float:
    """Rotor speed over greatest speed at a motor command [0..1]."""
    return curve * command + (1.0 - curve) * wp.sqrt(command)


@wp.func
def command_for_speed(fraction: float, curve: float) -> float:
    """Motor command for a rotor speed over greatest speed: the inverse of `speed_fraction`."""
    straight = 1.0 - curve
    root = 2.0 * fraction / wp.max(straight + wp.sqrt(straight * straight + 4.0 * curve * fraction), _TINY)
    return root * root


@wp.func
def is_used(airframe: ControlAirframe, rotor: int) -> bool:
    """Whether a rotor takes part; one that has failed does not."""
    return (airframe.left_out >> rotor) & 1 == 0


@wp.func
def tilt_thrusts(airframe: ControlAirframe, torque_frd: wp.vec3, span: float) -> vec8:
    """Rotor thrusts [N] for roll and pitch torque, scaled down so that they differ by at most `span`."""
    thrusts = airframe.mix_roll * torque_frd[0] + airframe.mix_pitch * torque_frd[1]
    low = float(_BIG)
    high = float(-_BIG)
    for i in range(airframe.rotor_count):
        if is_used(airframe, i):
            low = wp.min(low, thrusts[i])
            high = wp.max(high, thrusts[i])
    if high - low > span:
        thrusts = thrusts * (span / (high - low))
    return thrusts


@wp.func
def fitting_collective(airframe: ControlAirframe, thrusts: vec8, collective_n: float, low: float, high: float) -> float:
    """The collective thrust nearest to the asked one that keeps every rotor within [low, high]."""
    least = float(-_BIG)
    most = float(_BIG)
    for i in range(airframe.rotor_count):
        if is_used(airframe, i):
            fraction = wp.max(airframe.mix_thrust[i], _TINY)
            least = wp.max(least, (low - thrusts[i]) / fraction)
            most = wp.min(most, (high - thrusts[i]) / fraction)
    return wp.min(wp.max(collective_n, least), most)


@wp.func
def fitting_fraction(airframe: ControlAirframe, thrusts: vec8, change: vec8, low: float, high: float) -> float:
    """The greatest share [0..1] of `change` that keeps every rotor within [low, high]."""
    fraction = float(1.0)
    for i in range(airframe.rotor_count):
        if change[i] > _TINY:
            fraction = wp.min(fraction, (high - thrusts[i]) / change[i])
        if change[i] < -_TINY:
            fraction = wp.min(fraction, (low - thrusts[i]) / change[i])
    return wp.clamp(fraction, 0.0, 1.0)


@wp.func
def desaturate(airframe: ControlAirframe, torque_frd: wp.vec3, collective_n: float, low: float, high: float) -> vec8:
    """Rotor thrusts [N] within [low, high] that give up yaw, then collective thrust, then roll and pitch."""
    tilt = tilt_thrusts(airframe, torque_frd, high - low)
    fitting_n = fitting_collective(airframe, tilt, collective_n, low, high)
    level = airframe.mix_thrust * wp.min(fitting_n, wp.max(collective_n, airframe.mass_kg * _GRAVITY))
    thrusts = level + tilt * fitting_fraction(airframe, level, tilt, low, high)
    turn = airframe.mix_yaw * torque_frd[2]
    thrusts = thrusts + turn * fitting_fraction(airframe, thrusts, turn, low, high)
    for i in range(airframe.rotor_count):
        thrusts[i] = wp.clamp(thrusts[i], low, high)
    return thrusts


@wp.func
def allocate(
    airframe: ControlAirframe, torque_frd: wp.vec3, collective_n: float, thrust_low_n: float, thrust_high_n: float
) -> Allocation:
    """Rotor thrusts within [thrust_low_n, thrust_high_n], and exactly what they achieve and leave."""
    thrusts = airframe.mix_roll * torque_frd[0] + airframe.mix_pitch * torque_frd[1]
    thrusts = thrusts + airframe.mix_yaw * torque_frd[2] + airframe.mix_thrust * collective_n
    least = float(_BIG)
    most = float(-_BIG)
    for i in range(airframe.rotor_count):
        if is_used(airframe, i):
            least = wp.min(least, thrusts[i])
            most = wp.max(most, thrusts[i])
    if least < thrust_low_n or most > thrust_high_n:
        thrusts = desaturate(airframe, torque_frd, collective_n, thrust_low_n, thrust_high_n)
    roll = float(0.0)
    pitch = float(0.0)
    yaw = float(0.0)
    total = float(0.0)
    for i in range(airframe.rotor_count):
        thrust = thrusts[i]
        roll += airframe.arm_roll_m[i] * thrust
        pitch += airframe.arm_pitch_m[i] * thrust
        yaw += airframe.arm_yaw_m[i] * thrust
        if is_used(airframe, i):
            total += thrust
    result = Allocation()
    result.thrust_n = thrusts
    result.collective_n = total
    result.torque_frd = wp.vec3(roll, pitch, yaw)
    result.collective_short_n = collective_n - total
    result.torque_short_frd = torque_frd - result.torque_frd
    return result


@wp.func
def motor_commands(airframe: ControlAirframe, thrusts_n: vec8, voltage_fraction: float) -> vec8:
    """Motor commands [0..1] for rotor thrusts at a battery voltage over the full one."""
    commands = vec8()
    top = airframe.max_speed_rad_s * voltage_fraction
    per_newton = 1.0 / (airframe.thrust_n_s2 * top * top)
    for i in range(airframe.rotor_count):
        fraction = wp.sqrt(wp.clamp(thrusts_n[i] * per_newton, 0.0, 1.0))
        command = command_for_speed(fraction, airframe.command_curve)
        commands[i] = wp.clamp(command, airframe.idle_command, 1.0)
    return commands
