"""A person as a camera sees them: ten limbs, a torso and a head, walking or running by the phase of their gait.

Proportions are those of Drillis and Contini (1966, in Winter, Biomechanics and Motor Control of Human Movement, 2009,
fig. 4.1), as fractions of the stature; thicknesses and swings are guesses by eye.
"""

import warp as wp

from sim.sensors.fast_camera.camera_view import View
from sim.sensors.fast_camera.solids import Sights, is_in_solid, list_solid, make_solid, to_rdf
from sim.sensors.ray import PERSON, SKY
from sim.world.clothes import Clothes
from sim.world.people import Person

wp.set_module_options({"enable_backward": False})

_HIP = wp.constant(0.530)  # heights of joints
_SHOULDER = wp.constant(0.818)
_HEAD = wp.constant(0.932)  # middle of the head
_THIGH = wp.constant(0.245)  # lengths
_SHANK = wp.constant(0.246)
_UPPER_ARM = wp.constant(0.186)
_FOREARM = wp.constant(0.200)
_HIP_HALF = wp.constant(0.055)  # off the middle: of the thighs' axes
_SHOULDER_HALF = wp.constant(0.118)


@wp.func
def body_point(person: Person, forward: float, right: float, up: float) -> wp.vec3:
    """A position on the body in ned [m], given in fractions of the stature from the feet."""
    s = person.stature_m
    c = wp.cos(person.heading_rad) * s
    d = wp.sin(person.heading_rad) * s
    return person.pos_ned + wp.vec3(forward * c - right * d, forward * d + right * c, -up * s)


@wp.func
def list_limb(
    sights: Sights, i_camera: int, view: View, foot_ned: wp.vec3, tip_ned: wp.vec3, radius: float, albedo: wp.vec3,
    size: wp.vec2i,
) -> View:  # fmt: skip
    """The camera with a part of a body on its list."""
    limb = make_solid(to_rdf(view, foot_ned), to_rdf(view, tip_ned), radius, PERSON, albedo, 0.12)
    if view.inside == SKY and is_in_solid(limb):
        view.inside = PERSON
    return list_solid(sights, i_camera, view, limb, size[0], size[1])


@wp.func
def list_side(
    sights: Sights, i_camera: int, view: View, person: Person, clothes: Clothes, side: float, size: wp.vec2i
) -> View:
    """The camera with one leg and one arm on its list: those on the right for side 1, on the left for -1."""
    s = person.stature_m
    girth = clothes.girth * s
    phase = person.gait_phase + wp.where(side > 0.0, 3.14159265, 0.0)  # the left foot lands at 0
    pace = wp.length(person.vel_ned)
    swing = wp.min(1.0, 2.0 * pace) * wp.min(0.22 + 0.10 * pace, 0.65)
    is_fast = wp.clamp(pace - 1.8, 0.0, 1.0)  # from walking to running
    thigh = swing * wp.cos(phase)
    knee = thigh - wp.min(1.0, 2.0 * pace) * (0.10 + (0.5 + 0.8 * is_fast) * wp.max(0.0, -wp.sin(phase)))
    drop = (_THIGH + _SHANK) * (1.0 - wp.cos(swing * wp.cos(phase)))  # the hips sink as the legs part
    lean = 0.06 * is_fast
    hip_up = _HIP - drop
    knee_forward = _THIGH * wp.sin(thigh)
    knee_up = hip_up - _THIGH * wp.cos(thigh)
    heel_forward = knee_forward + _SHANK * wp.sin(knee)
    heel_up = wp.max(knee_up - _SHANK * wp.cos(knee), 0.022)
    off = side * _HIP_HALF
    hip = body_point(person, 0.0, off, hip_up)
    knee_ned = body_point(person, knee_forward, off, knee_up)
    heel = body_point(person, heel_forward, off, heel_up)
    toe = body_point(person, heel_forward + 0.085, off, heel_up - 0.004)
    view = list_limb(sights, i_camera, view, hip, knee_ned, 0.048 * girth, clothes.trousers, size)
    view = list_limb(sights, i_camera, view, knee_ned, heel, 0.032 * girth, clothes.trousers, size)
    view = list_limb(sights, i_camera, view, heel, toe, 0.022 * girth, clothes.shoes, size)
    arm = -0.9 * swing * wp.cos(phase)
    elbow = arm + 0.2 + 1.2 * is_fast
    shoulder_up = _SHOULDER - drop - 0.01
    elbow_forward = lean + _UPPER_ARM * wp.sin(arm)
    elbow_up = shoulder_up - _UPPER_ARM * wp.cos(arm)
    wrist_forward = elbow_forward + _FOREARM * wp.sin(elbow)
    wrist_up = elbow_up - _FOREARM * wp.cos(elbow)
    wide = side * _SHOULDER_HALF
    shoulder = body_point(person, lean, wide, shoulder_up)
    elbow_ned = body_point(person, elbow_forward, 1.12 * wide, elbow_up)
    wrist = body_point(person, wrist_forward, 1.08 * wide, wrist_up)
    view = list_limb(sights, i_camera, view, shoulder, elbow_ned, 0.030 * girth, clothes.shirt, size)
    return list_limb(sights, i_camera, view, elbow_ned, wrist, 0.023 * girth, clothes.skin, size)


@wp.func
def list_person(
    sights: Sights, i_camera: int, view: View, person: Person, clothes: Clothes, width: int, height: int
) -> View:
    """The camera with a person on its list; a stature of 0 means nobody."""
    s = person.stature_m
    if s <= 0.0:
        return view
    girth = clothes.girth * s
    size = wp.vec2i(width, height)
    pace = wp.length(person.vel_ned)
    lean = 0.06 * wp.clamp(pace - 1.8, 0.0, 1.0)
    waist = body_point(person, 0.0, 0.0, _HIP + 0.02)
    for k in range(2):  # two columns side by side are as broad as a chest
        off = (2.0 * float(k) - 1.0) * 0.045
        low = body_point(person, 0.0, off, _HIP + 0.03)
        high = body_point(person, lean, 1.25 * off, _SHOULDER - 0.065)
        view = list_limb(sights, i_camera, view, low, high, 0.070 * girth, clothes.shirt, size)
    neck = body_point(person, lean, 0.0, _SHOULDER)
    chin = body_point(person, lean + 0.008, 0.0, _HEAD - 0.02)
    crown = body_point(person, lean + 0.004, 0.0, _HEAD + 0.015)
    hair = body_point(person, lean - 0.016, 0.0, _HEAD + 0.018)
    view = list_limb(sights, i_camera, view, neck, chin, 0.032 * girth, clothes.skin, size)
    view = list_limb(sights, i_camera, view, chin, crown, 0.048 * girth, clothes.skin, size)
    view = list_limb(sights, i_camera, view, hair, hair, 0.052 * girth, clothes.hair, size)
    view = list_limb(sights, i_camera, view, waist, waist, 0.072 * girth, clothes.trousers, size)
    for k in range(2):
        view = list_side(sights, i_camera, view, person, clothes, 2.0 * float(k) - 1.0, size)
    return view
