"""The signal, the axis and the unit that the names of columns stand for."""

import pytest

from identify.ingest.mapping.names import named, time_unit

KNOWN = [
    ("/odom", "twist.twist.linear.y", "velocity", 1, None),
    ("/odom", "twist.twist.angular.z", "gyro", 2, None),
    ("/odom", "pose.pose.position.z", "depth", 0, None),
    ("/imu/data", "angular_velocity.z", "gyro", 2, None),
    ("/imu/data", "linear_acceleration.x", "specific_force", 0, None),
    ("/imu/data", "orientation.w", "quaternion", 0, None),
    ("/imu/data", "orientation.x", "quaternion", 1, None),
    ("/pressure", "fluid_pressure", "pressure", 0, None),
    ("/sensor/pressure", "data", "pressure", 0, None),
    ("/sensor/attitude_twist", "angular.z", "euler", 2, None),
    ("/thrusters", "data.0", "pwm", 0, None),
    ("vehicle_angular_velocity", "xyz[0]", "gyro", 0, None),
    ("vehicle_attitude", "q[3]", "quaternion", 3, None),
    ("sensor_combined", "gyro_rad[1]", "gyro", 1, "rad/s"),
    ("sensor_combined", "accelerometer_m_s2[2]", "specific_force", 2, "m/s2"),
    ("actuator_outputs", "output[3]", "pwm", 3, None),
    ("battery_status", "voltage_v", "voltage", 0, "V"),
    ("", "RAW_IMU.yacc", "specific_force", 1, None),
    ("", "RAW_IMU.xgyro", "gyro", 0, "mrad/s"),
    ("SCALED_IMU2", "zgyro", "gyro", 2, "mrad/s"),
    ("", "HIGHRES_IMU.ygyro", "gyro", 1, None),
    ("", "LOCAL_POSITION_NED.vz", "velocity", 2, None),
    ("", "Fy", "tau_cmd", 1, None),
    ("", "wrench_sway", "tau_cmd", 1, None),
    ("", "wrench_yaw", "tau_cmd", 5, None),
    ("", "linear_y", "velocity", 1, None),
    ("/odometry/twist", "angular.z", "gyro", 2, None),
    ("", "positive_width_us_3", "pwm", 3, "us"),
    ("/pwm", "positive_width_us.0", "pwm", 0, "us"),
    ("", "surge_force_N", "tau_cmd", 0, "N"),
    ("", "u", "velocity", 0, None),
    ("", "surge", "velocity", 0, None),
    ("", "vel_x_ms", "velocity", 0, "m/s"),
    ("", "r [deg/s]", "gyro", 2, "deg/s"),
    ("", "yawRate", "gyro", 2, None),
    ("", "pitch_rate_deg_s", "gyro", 1, "deg/s"),
    ("", "w_yaw", "gyro", 2, None),
    ("", "heading_deg", "euler", 2, "deg"),
    ("/attitude/rpy", "vector.y", "euler", 1, None),
    ("/euler", "x", "euler", 0, None),
    ("", "theta", "euler", 1, None),
    ("", "acc_z_g", "specific_force", 2, "g"),
    ("", "Depth (cm)", "depth", 0, "cm"),
    ("", "depth_ft", "depth", 0, "ft"),
    ("", "pressure_mbar", "pressure", 0, "mbar"),
    ("", "Pressure [dbar]", "pressure", 0, "dbar"),
    ("", "pressure_kPa", "pressure", 0, "kPa"),
    ("", "press_psia", "pressure", 0, "psi"),
    ("", "surge [kn]", "velocity", 0, "kn"),
    ("", "v_y_kts", "velocity", 1, "kn"),
    ("", "u (ft/s)", "velocity", 0, "ft/s"),
    ("", "u_kmh", "velocity", 0, "km/h"),
    ("", "altitude_inches", "altitude", 0, "in"),
    ("", "Heading [°]", "euler", 2, "deg"),
    ("", "yaw rate [°/s]", "gyro", 2, "deg/s"),
    ("", "a_z [m/s²]", "specific_force", 2, "m/s2"),
    ("", "fog [°/h]", "fog", 0, "deg/h"),
    ("", "servo2 [µs]", "pwm", 2, "us"),
    ("", "tau_n_n_m", "tau_cmd", 5, "N"),
    ("", "servo1_raw", "pwm", 1, None),
    ("", "thruster_4", "pwm", 4, None),
    ("", "T8", "pwm", 8, None),
    ("", "pwm1", "pwm", 1, None),
    ("", "esc2_rpm", "rpm", 2, None),
    ("", "rpm_1", "rpm", 1, None),
    ("", "battery", "voltage", 0, None),
    ("", "vel_ned.1", "velocity", 1, None),
    ("", "v_enu[0]", "velocity", 1, None),
    ("", "thruster_force_N.5", "pwm", 5, "N"),
    ("", "thrust3_kgf", "pwm", 3, "kgf"),
    ("", "Speed ahead", "velocity", 0, None),
    ("", "stbd_velocity", "velocity", 1, None),
    ("", "turn rate [deg/s]", "gyro", 2, "deg/s"),
    ("", "eul.2", "euler", 2, None),
    ("", "pqr.0", "gyro", 0, None),
    ("", "uvw.1", "velocity", 1, None),
    ("", "nu.1", "velocity", 1, None),
    ("", "nu.5", "gyro", 2, None),
    ("", "eta.3", "euler", 0, None),
    ("", "vel_u", "velocity", 0, None),
    ("", "vel_r", "gyro", 2, None),
    ("", "AsX", "gyro", 0, None),
    ("", "AngleZ(deg)", "euler", 2, "deg"),
    ("", "thr_left", "pwm", 1, None),
    ("", "rightThruster", "pwm", 2, None),
    ("", "port_motor_rpm", "rpm", 1, None),
    ("", "starboard_thrust_N", "pwm", 2, "N"),
]


@pytest.mark.parametrize(("topic", "field", "signal", "place", "unit"), KNOWN)
def test_a_usual_name_is_known_with_its_axis_and_unit(topic, field, signal, place, unit):
    name = named(topic, field)
    assert name is not None
    assert (name.signal, name.place, name.unit) == (signal, place, unit)


@pytest.mark.parametrize(
    "field",
    [
        "desired_depth",
        "depth_setpoint",
        "angular_velocity_covariance.0",
        "pressure_temperature",
        "comment",
        "x",
        "thruster_front_left",
        "left_wheel",
    ],
)
def test_what_was_not_measured_and_what_nobody_knows_has_no_signal(field):
    assert named("", field) is None


@pytest.mark.parametrize(
    ("topic", "field"),
    [
        ("/plot_desired", "pose.position.z"),
        ("/attitude_setpoint", "angular.z"),
        ("/cmd_vel", "twist.linear.x"),
        ("/sensor/hull_pressure", "data"),
        ("/attitude/rate", "angular.z"),
        ("/imu/accel", "linear.x"),
        ("/joy_twist", "angular.z"),
    ],
)
def test_what_a_topic_wants_of_the_vehicle_or_has_of_its_inside_is_not_measured_outside(topic, field):
    assert named(topic, field) is None


def test_the_columns_of_one_set_share_a_family_whatever_their_axes_are_called():
    assert {named("", field).family for field in ("roll_deg", "pitch_deg", "heading_deg")} == {
        named("", "yaw").family
    }
    assert named("", "u_dvl").family != named("", "u").family


@pytest.mark.parametrize(
    ("field", "unit"),
    [
        ("t", None), ("Time [ms]", "ms"), ("timestamp_us", "us"), ("TimeUS", "us"), ("time_boot_ms", "ms"),
        ("stamp", None), ("t_ns", "ns"), ("ts", None), ("time_of_validity", None),
    ],
)  # fmt: skip
def test_a_time_is_known_by_its_name_and_its_unit(field, unit):
    assert time_unit(field) == (True, unit)


def test_a_name_that_holds_a_time_among_other_words_is_no_time():
    assert time_unit("timeout_count") == (False, None)
