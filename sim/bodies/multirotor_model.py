"""The constants of a multirotor's body: mass, hull, rotors, battery and contact, from its airframe file."""

import warp as wp

from common.airframes.multirotor import MultirotorAirframe
from common.geodesy import DEFAULT_HOME
from common.kernels import vec8
from sim.battery import BatteryModel, battery_model
from sim.bodies.contact import ContactModel, contact_model
from sim.bodies.rigid_body import density_ratio_at

wp.set_module_options({"enable_backward": False})


@wp.struct
class MultirotorModel:
    """Constants of one airframe at one place."""

    mass_kg: float
    mass_inv: float  # [1/kg] divisions are dear at 1 kHz
    inertia_frd: wp.vec3  # [kg m²] diagonal
    inertia_inv_frd: wp.vec3  # [1/(kg m²)]
    drag_area_frd: wp.vec3  # [m²] c_d A along each axis
    angular_drag_n_m_s2: float
    rotor_count: int
    rotor_x: vec8  # [m] hubs, frd
    rotor_y: vec8  # [m]
    rotor_z: vec8  # [m]
    rotor_spin: vec8  # +1 counter-clockwise seen from above
    rotor_radius_m: float
    rotor_height_m: float  # mean height of the hubs over the centre of gravity
    thrust_n_s2: float
    torque_n_m_s2: float
    inflow_n_s2_m: float
    rotor_drag_n_s2_m: float
    max_speed_rad_s: float
    command_curve: float
    spin_up_time_s: float
    spin_down_time_s: float
    rotor_inertia_kg_m2: float
    home_density_ratio: float  # air density at home over that at sea level
    battery: BatteryModel
    contact: ContactModel


def multirotor_model(airframe: MultirotorAirframe, home_alt_amsl_m: float = DEFAULT_HOME.alt_m) -> MultirotorModel:
    """Constants of an airframe whose home lies home_alt_amsl_m above sea level."""
    body, rotor = airframe.body, airframe.rotor_model
    model = MultirotorModel()
    model.mass_kg = body.mass_kg
    model.mass_inv = 1.0 / body.mass_kg
    model.inertia_frd = wp.vec3(body.inertia_xx_kg_m2, body.inertia_yy_kg_m2, body.inertia_zz_kg_m2)
    model.inertia_inv_frd = wp.vec3(*(1.0 / moment for moment in model.inertia_frd))
    model.drag_area_frd = wp.vec3(body.drag_area_x_m2, body.drag_area_y_m2, body.drag_area_z_m2)
    model.angular_drag_n_m_s2 = body.angular_drag_n_m_s2
    model.rotor_count = len(airframe.rotors)
    for i, hub in enumerate(airframe.rotors):
        model.rotor_x[i] = hub.x_m
        model.rotor_y[i] = hub.y_m
        model.rotor_z[i] = hub.z_m
        model.rotor_spin[i] = hub.spin
    model.rotor_radius_m = rotor.radius_m
    model.rotor_height_m = -sum(hub.z_m for hub in airframe.rotors) / len(airframe.rotors)
    model.thrust_n_s2 = rotor.thrust_n_s2
    model.torque_n_m_s2 = rotor.torque_n_m_s2
    model.inflow_n_s2_m = rotor.inflow_n_s2_m
    model.rotor_drag_n_s2_m = rotor.drag_n_s2_m
    model.max_speed_rad_s = rotor.max_speed_rad_s
    model.command_curve = rotor.command_curve
    model.spin_up_time_s = rotor.spin_up_time_s
    model.spin_down_time_s = rotor.spin_down_time_s
    model.rotor_inertia_kg_m2 = rotor.inertia_kg_m2
    model.home_density_ratio = density_ratio_at(home_alt_amsl_m)
    model.battery = battery_model(airframe)
    model.contact = contact_model(airframe)
    return model
