"""Covariance prediction and observation products. Written by autopilot/estimator/derive.py: do not edit."""

import warp as wp

from common.kernels import vec24

wp.set_module_options({"enable_backward": False})


@wp.func
def predict_covariance(
    cov: wp.array2d(dtype=vec24), i: int, rot: wp.mat33, delta_vel_ned: wp.vec3, dt_s: float, added_var: vec24
) -> None:
    """P = F P F' + diag(added_var) over one step; rows 9 to 23 of F are those of the identity."""
    f1 = -dt_s * rot[0, 0]
    f2 = -dt_s * rot[0, 1]
    f3 = -dt_s * rot[0, 2]
    f4 = -dt_s * rot[1, 0]
    f5 = -dt_s * rot[1, 1]
    f6 = -dt_s * rot[1, 2]
    f7 = -dt_s * rot[2, 0]
    f8 = -dt_s * rot[2, 1]
    f9 = -dt_s * rot[2, 2]
    f10 = delta_vel_ned[2]
    f11 = -delta_vel_ned[1]
    f12 = -delta_vel_ned[2]
    f13 = delta_vel_ned[0]
    f14 = delta_vel_ned[1]
    f15 = -delta_vel_ned[0]
    p0 = cov[i, 0]
    p1 = cov[i, 1]
    p2 = cov[i, 2]
    p3 = cov[i, 3]
    p4 = cov[i, 4]
    p5 = cov[i, 5]
    p6 = cov[i, 6]
    p7 = cov[i, 7]
    p8 = cov[i, 8]
    p9 = cov[i, 9]
    p10 = cov[i, 10]
    p11 = cov[i, 11]
    p12 = cov[i, 12]
    p13 = cov[i, 13]
    p14 = cov[i, 14]
    a0 = p0 + f1 * p9 + f2 * p10 + f3 * p11
    a1 = p1 + f4 * p9 + f5 * p10 + f6 * p11
    a2 = p2 + f7 * p9 + f8 * p10 + f9 * p11
    a3 = p3 + f10 * p1 + f11 * p2 + f1 * p12 + f2 * p13 + f3 * p14
    a4 = p4 + f12 * p0 + f13 * p2 + f4 * p12 + f5 * p13 + f6 * p14
    a5 = p5 + f14 * p0 + f15 * p1 + f7 * p12 + f8 * p13 + f9 * p14
    a6 = p6 + dt_s * p3
    a7 = p7 + dt_s * p4
    a8 = p8 + dt_s * p5
    n0_0 = a0[0] + f1 * a0[9] + f2 * a0[10] + f3 * a0[11] + added_var[0]
    n0_1 = a0[1] + f4 * a0[9] + f5 * a0[10] + f6 * a0[11]
    n0_2 = a0[2] + f7 * a0[9] + f8 * a0[10] + f9 * a0[11]
    n0_3 = a0[3] + f10 * a0[1] + f11 * a0[2] + f1 * a0[12] + f2 * a0[13] + f3 * a0[14]
    n0_4 = a0[4] + f12 * a0[0] + f13 * a0[2] + f4 * a0[12] + f5 * a0[13] + f6 * a0[14]
    n0_5 = a0[5] + f14 * a0[0] + f15 * a0[1] + f7 * a0[12] + f8 * a0[13] + f9 * a0[14]
    n0_6 = a0[6] + dt_s * a0[3]
    n0_7 = a0[7] + dt_s * a0[4]
    n0_8 = a0[8] + dt_s * a0[5]
    n1_1 = a1[1] + f4 * a1[9] + f5 * a1[10] + f6 * a1[11] + added_var[1]
    n1_2 = a1[2] + f7 * a1[9] + f8 * a1[10] + f9 * a1[11]
    n1_3 = a1[3] + f10 * a1[1] + f11 * a1[2] + f1 * a1[12] + f2 * a1[13] + f3 * a1[14]
    n1_4 = a1[4] + f12 * a1[0] + f13 * a1[2] + f4 * a1[12] + f5 * a1[13] + f6 * a1[14]
    n1_5 = a1[5] + f14 * a1[0] + f15 * a1[1] + f7 * a1[12] + f8 * a1[13] + f9 * a1[14]
    n1_6 = a1[6] + dt_s * a1[3]
    n1_7 = a1[7] + dt_s * a1[4]
    n1_8 = a1[8] + dt_s * a1[5]
    n2_2 = a2[2] + f7 * a2[9] + f8 * a2[10] + f9 * a2[11] + added_var[2]
    n2_3 = a2[3] + f10 * a2[1] + f11 * a2[2] + f1 * a2[12] + f2 * a2[13] + f3 * a2[14]
    n2_4 = a2[4] + f12 * a2[0] + f13 * a2[2] + f4 * a2[12] + f5 * a2[13] + f6 * a2[14]
    n2_5 = a2[5] + f14 * a2[0] + f15 * a2[1] + f7 * a2[12] + f8 * a2[13] + f9 * a2[14]
    n2_6 = a2[6] + dt_s * a2[3]
    n2_7 = a2[7] + dt_s * a2[4]
    n2_8 = a2[8] + dt_s * a2[5]
    n3_3 = a3[3] + f10 * a3[1] + f11 * a3[2] + f1 * a3[12] + f2 * a3[13] + f3 * a3[14] + added_var[3]
    n3_4 = a3[4] + f12 * a3[0] + f13 * a3[2] + f4 * a3[12] + f5 * a3[13] + f6 * a3[14]
    n3_5 = a3[5] + f14 * a3[0] + f15 * a3[1] + f7 * a3[12] + f8 * a3[13] + f9 * a3[14]
    n3_6 = a3[6] + dt_s * a3[3]
    n3_7 = a3[7] + dt_s * a3[4]
    n3_8 = a3[8] + dt_s * a3[5]
    n4_4 = a4[4] + f12 * a4[0] + f13 * a4[2] + f4 * a4[12] + f5 * a4[13] + f6 * a4[14] + added_var[4]
    n4_5 = a4[5] + f14 * a4[0] + f15 * a4[1] + f7 * a4[12] + f8 * a4[13] + f9 * a4[14]
    n4_6 = a4[6] + dt_s * a4[3]
    n4_7 = a4[7] + dt_s * a4[4]
    n4_8 = a4[8] + dt_s * a4[5]
    n5_5 = a5[5] + f14 * a5[0] + f15 * a5[1] + f7 * a5[12] + f8 * a5[13] + f9 * a5[14] + added_var[5]
    n5_6 = a5[6] + dt_s * a5[3]
    n5_7 = a5[7] + dt_s * a5[4]
    n5_8 = a5[8] + dt_s * a5[5]
    n6_6 = a6[6] + dt_s * a6[3] + added_var[6]
    n6_7 = a6[7] + dt_s * a6[4]
    n6_8 = a6[8] + dt_s * a6[5]
    n7_7 = a7[7] + dt_s * a7[4] + added_var[7]
    n7_8 = a7[8] + dt_s * a7[5]
    n8_8 = a8[8] + dt_s * a8[5] + added_var[8]
    a0[0] = n0_0
    a0[1] = n0_1
    a0[2] = n0_2
    a0[3] = n0_3
    a0[4] = n0_4
    a0[5] = n0_5
    a0[6] = n0_6
    a0[7] = n0_7
    a0[8] = n0_8
    cov[i, 0] = a0
    a1[0] = n0_1
    a1[1] = n1_1
    a1[2] = n1_2
    a1[3] = n1_3
    a1[4] = n1_4
    a1[5] = n1_5
    a1[6] = n1_6
    a1[7] = n1_7
    a1[8] = n1_8
    cov[i, 1] = a1
    a2[0] = n0_2
    a2[1] = n1_2
    a2[2] = n2_2
    a2[3] = n2_3
    a2[4] = n2_4
    a2[5] = n2_5
    a2[6] = n2_6
    a2[7] = n2_7
    a2[8] = n2_8
    cov[i, 2] = a2
    a3[0] = n0_3
    a3[1] = n1_3
    a3[2] = n2_3
    a3[3] = n3_3
    a3[4] = n3_4
    a3[5] = n3_5
    a3[6] = n3_6
    a3[7] = n3_7
    a3[8] = n3_8
    cov[i, 3] = a3
    a4[0] = n0_4
    a4[1] = n1_4
    a4[2] = n2_4
    a4[3] = n3_4
    a4[4] = n4_4
    a4[5] = n4_5
    a4[6] = n4_6
    a4[7] = n4_7
    a4[8] = n4_8
    cov[i, 4] = a4
    a5[0] = n0_5
    a5[1] = n1_5
    a5[2] = n2_5
    a5[3] = n3_5
    a5[4] = n4_5
    a5[5] = n5_5
    a5[6] = n5_6
    a5[7] = n5_7
    a5[8] = n5_8
    cov[i, 5] = a5
    a6[0] = n0_6
    a6[1] = n1_6
    a6[2] = n2_6
    a6[3] = n3_6
    a6[4] = n4_6
    a6[5] = n5_6
    a6[6] = n6_6
    a6[7] = n6_7
    a6[8] = n6_8
    cov[i, 6] = a6
    a7[0] = n0_7
    a7[1] = n1_7
    a7[2] = n2_7
    a7[3] = n3_7
    a7[4] = n4_7
    a7[5] = n5_7
    a7[6] = n6_7
    a7[7] = n7_7
    a7[8] = n7_8
    cov[i, 7] = a7
    a8[0] = n0_8
    a8[1] = n1_8
    a8[2] = n2_8
    a8[3] = n3_8
    a8[4] = n4_8
    a8[5] = n5_8
    a8[6] = n6_8
    a8[7] = n7_8
    a8[8] = n8_8
    cov[i, 8] = a8
    b9 = cov[i, 9]
    b9[0] = a0[9]
    b9[1] = a1[9]
    b9[2] = a2[9]
    b9[3] = a3[9]
    b9[4] = a4[9]
    b9[5] = a5[9]
    b9[6] = a6[9]
    b9[7] = a7[9]
    b9[8] = a8[9]
    b9[9] = b9[9] + added_var[9]
    cov[i, 9] = b9
    b10 = cov[i, 10]
    b10[0] = a0[10]
    b10[1] = a1[10]
    b10[2] = a2[10]
    b10[3] = a3[10]
    b10[4] = a4[10]
    b10[5] = a5[10]
    b10[6] = a6[10]
    b10[7] = a7[10]
    b10[8] = a8[10]
    b10[10] = b10[10] + added_var[10]
    cov[i, 10] = b10
    b11 = cov[i, 11]
    b11[0] = a0[11]
    b11[1] = a1[11]
    b11[2] = a2[11]
    b11[3] = a3[11]
    b11[4] = a4[11]
    b11[5] = a5[11]
    b11[6] = a6[11]
    b11[7] = a7[11]
    b11[8] = a8[11]
    b11[11] = b11[11] + added_var[11]
    cov[i, 11] = b11
    b12 = cov[i, 12]
    b12[0] = a0[12]
    b12[1] = a1[12]
    b12[2] = a2[12]
    b12[3] = a3[12]
    b12[4] = a4[12]
    b12[5] = a5[12]
    b12[6] = a6[12]
    b12[7] = a7[12]
    b12[8] = a8[12]
    b12[12] = b12[12] + added_var[12]
    cov[i, 12] = b12
    b13 = cov[i, 13]
    b13[0] = a0[13]
    b13[1] = a1[13]
    b13[2] = a2[13]
    b13[3] = a3[13]
    b13[4] = a4[13]
    b13[5] = a5[13]
    b13[6] = a6[13]
    b13[7] = a7[13]
    b13[8] = a8[13]
    b13[13] = b13[13] + added_var[13]
    cov[i, 13] = b13
    b14 = cov[i, 14]
    b14[0] = a0[14]
    b14[1] = a1[14]
    b14[2] = a2[14]
    b14[3] = a3[14]
    b14[4] = a4[14]
    b14[5] = a5[14]
    b14[6] = a6[14]
    b14[7] = a7[14]
    b14[8] = a8[14]
    b14[14] = b14[14] + added_var[14]
    cov[i, 14] = b14
    b15 = cov[i, 15]
    b15[0] = a0[15]
    b15[1] = a1[15]
    b15[2] = a2[15]
    b15[3] = a3[15]
    b15[4] = a4[15]
    b15[5] = a5[15]
    b15[6] = a6[15]
    b15[7] = a7[15]
    b15[8] = a8[15]
    b15[15] = b15[15] + added_var[15]
    cov[i, 15] = b15
    b16 = cov[i, 16]
    b16[0] = a0[16]
    b16[1] = a1[16]
    b16[2] = a2[16]
    b16[3] = a3[16]
    b16[4] = a4[16]
    b16[5] = a5[16]
    b16[6] = a6[16]
    b16[7] = a7[16]
    b16[8] = a8[16]
    b16[16] = b16[16] + added_var[16]
    cov[i, 16] = b16
    b17 = cov[i, 17]
    b17[0] = a0[17]
    b17[1] = a1[17]
    b17[2] = a2[17]
    b17[3] = a3[17]
    b17[4] = a4[17]
    b17[5] = a5[17]
    b17[6] = a6[17]
    b17[7] = a7[17]
    b17[8] = a8[17]
    b17[17] = b17[17] + added_var[17]
    cov[i, 17] = b17
    b18 = cov[i, 18]
    b18[0] = a0[18]
    b18[1] = a1[18]
    b18[2] = a2[18]
    b18[3] = a3[18]
    b18[4] = a4[18]
    b18[5] = a5[18]
    b18[6] = a6[18]
    b18[7] = a7[18]
    b18[8] = a8[18]
    b18[18] = b18[18] + added_var[18]
    cov[i, 18] = b18
    b19 = cov[i, 19]
    b19[0] = a0[19]
    b19[1] = a1[19]
    b19[2] = a2[19]
    b19[3] = a3[19]
    b19[4] = a4[19]
    b19[5] = a5[19]
    b19[6] = a6[19]
    b19[7] = a7[19]
    b19[8] = a8[19]
    b19[19] = b19[19] + added_var[19]
    cov[i, 19] = b19
    b20 = cov[i, 20]
    b20[0] = a0[20]
    b20[1] = a1[20]
    b20[2] = a2[20]
    b20[3] = a3[20]
    b20[4] = a4[20]
    b20[5] = a5[20]
    b20[6] = a6[20]
    b20[7] = a7[20]
    b20[8] = a8[20]
    b20[20] = b20[20] + added_var[20]
    cov[i, 20] = b20
    b21 = cov[i, 21]
    b21[0] = a0[21]
    b21[1] = a1[21]
    b21[2] = a2[21]
    b21[3] = a3[21]
    b21[4] = a4[21]
    b21[5] = a5[21]
    b21[6] = a6[21]
    b21[7] = a7[21]
    b21[8] = a8[21]
    b21[21] = b21[21] + added_var[21]
    cov[i, 21] = b21
    b22 = cov[i, 22]
    b22[0] = a0[22]
    b22[1] = a1[22]
    b22[2] = a2[22]
    b22[3] = a3[22]
    b22[4] = a4[22]
    b22[5] = a5[22]
    b22[6] = a6[22]
    b22[7] = a7[22]
    b22[8] = a8[22]
    b22[22] = b22[22] + added_var[22]
    cov[i, 22] = b22
    b23 = cov[i, 23]
    b23[0] = a0[23]
    b23[1] = a1[23]
    b23[2] = a2[23]
    b23[3] = a3[23]
    b23[4] = a4[23]
    b23[5] = a5[23]
    b23[6] = a6[23]
    b23[7] = a7[23]
    b23[8] = a8[23]
    b23[23] = b23[23] + added_var[23]
    cov[i, 23] = b23


@wp.func
def mag_products(
    cov: wp.array2d(dtype=vec24),
    i: int,
    axis_ned: wp.vec3,
    i_axis: int,
    earth_field_ned: wp.vec3,
) -> tuple[vec24, float]:
    """P H' and H P H' of the magnetic field along a body axis: axis . earth + body field."""
    h0 = axis_ned[1] * earth_field_ned[2] - axis_ned[2] * earth_field_ned[1]
    h1 = -axis_ned[0] * earth_field_ned[2] + axis_ned[2] * earth_field_ned[0]
    h2 = axis_ned[0] * earth_field_ned[1] - axis_ned[1] * earth_field_ned[0]
    h15 = axis_ned[0]
    h16 = axis_ned[1]
    h17 = axis_ned[2]
    ph = h0 * cov[i, 0]
    ph = ph + h1 * cov[i, 1]
    ph = ph + h2 * cov[i, 2]
    ph = ph + h15 * cov[i, 15]
    ph = ph + h16 * cov[i, 16]
    ph = ph + h17 * cov[i, 17]
    ph = ph + cov[i, 18 + i_axis]
    hph = h0 * ph[0]
    hph = hph + h1 * ph[1]
    hph = hph + h2 * ph[2]
    hph = hph + h15 * ph[15]
    hph = hph + h16 * ph[16]
    hph = hph + h17 * ph[17]
    hph = hph + ph[18 + i_axis]
    return ph, hph


@wp.func
def drag_products(
    cov: wp.array2d(dtype=vec24),
    i: int,
    axis_ned: wp.vec3,
    i_axis: int,
    vel_air_ned: wp.vec3,
    linear: float,
    square: float,
    speed_abs: float,
) -> tuple[vec24, float]:
    """P H' and H P H' of the drag along a body axis: -(linear u + square |u| u) + bias, u = axis . (velocity - wind)."""
    t0 = linear + 2.0 * speed_abs * square
    t1 = -t0
    h0 = t1 * (axis_ned[1] * vel_air_ned[2] - axis_ned[2] * vel_air_ned[1])
    h1 = t0 * (axis_ned[0] * vel_air_ned[2] - axis_ned[2] * vel_air_ned[0])
    h2 = t1 * (axis_ned[0] * vel_air_ned[1] - axis_ned[1] * vel_air_ned[0])
    h3 = axis_ned[0] * t1
    h4 = axis_ned[1] * t1
    h5 = axis_ned[2] * t1
    h21 = axis_ned[0] * t0
    h22 = axis_ned[1] * t0
    ph = h0 * cov[i, 0]
    ph = ph + h1 * cov[i, 1]
    ph = ph + h2 * cov[i, 2]
    ph = ph + h3 * cov[i, 3]
    ph = ph + h4 * cov[i, 4]
    ph = ph + h5 * cov[i, 5]
    ph = ph + h21 * cov[i, 21]
    ph = ph + h22 * cov[i, 22]
    ph = ph + cov[i, 12 + i_axis]
    hph = h0 * ph[0]
    hph = hph + h1 * ph[1]
    hph = hph + h2 * ph[2]
    hph = hph + h3 * ph[3]
    hph = hph + h4 * ph[4]
    hph = hph + h5 * ph[5]
    hph = hph + h21 * ph[21]
    hph = hph + h22 * ph[22]
    hph = hph + ph[12 + i_axis]
    return ph, hph


@wp.func
def gravity_products(
    cov: wp.array2d(dtype=vec24),
    i: int,
    axis_ned: wp.vec3,
    i_axis: int,
    gravity: float,
) -> tuple[vec24, float]:
    """P H' and H P H' of the specific force at rest along a body axis: -axis . gravity + bias."""
    h0 = -axis_ned[1] * gravity
    h1 = axis_ned[0] * gravity
    ph = h0 * cov[i, 0]
    ph = ph + h1 * cov[i, 1]
    ph = ph + cov[i, 12 + i_axis]
    hph = h0 * ph[0]
    hph = hph + h1 * ph[1]
    hph = hph + ph[12 + i_axis]
    return ph, hph


@wp.func
def range_products(
    cov: wp.array2d(dtype=vec24),
    i: int,
    axis_ned: wp.vec3,
    height: float,
) -> tuple[vec24, float]:
    """P H' and H P H' of the distance along body down: (terrain - position) / axis_d."""
    t0 = height / (axis_ned[2] * axis_ned[2])
    t1 = 1.0 / axis_ned[2]
    h0 = -axis_ned[1] * t0
    h1 = axis_ned[0] * t0
    h8 = -t1
    h23 = t1
    ph = h0 * cov[i, 0]
    ph = ph + h1 * cov[i, 1]
    ph = ph + h8 * cov[i, 8]
    ph = ph + h23 * cov[i, 23]
    hph = h0 * ph[0]
    hph = hph + h1 * ph[1]
    hph = hph + h8 * ph[8]
    hph = hph + h23 * ph[23]
    return ph, hph
