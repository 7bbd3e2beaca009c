"""Definitions of the ROS 2 messages of an MCAP file, which are stored in the file.

Fields are as in ``common_interfaces``, ``geometry2`` and ``rcl_interfaces`` of ROS 2. There is no
standard message for a range between two radios: ``sensor_msgs/Range`` is a cone of sound or light
from one sensor without another end, so `UwbRange` is our own.
"""

from __future__ import annotations

IMU = "sensor_msgs/msg/Imu"
MAGNETIC_FIELD = "sensor_msgs/msg/MagneticField"
ODOMETRY = "nav_msgs/msg/Odometry"
STRING = "std_msgs/msg/String"
TF = "tf2_msgs/msg/TFMessage"
UWB_RANGE = "relpos_msgs/msg/UwbRange"

_FIELDS = {
    "builtin_interfaces/Time": "int32 sec\nuint32 nanosec",
    "std_msgs/Header": "builtin_interfaces/Time stamp\nstring frame_id",
    "std_msgs/String": "string data",
    "geometry_msgs/Point": "float64 x\nfloat64 y\nfloat64 z",
    "geometry_msgs/Vector3": "float64 x\nfloat64 y\nfloat64 z",
    "geometry_msgs/Quaternion": "float64 x\nfloat64 y\nfloat64 z\nfloat64 w",
    "geometry_msgs/Pose": ("geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation"),
    "geometry_msgs/Twist": "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular",
    "geometry_msgs/PoseWithCovariance": "geometry_msgs/Pose pose\nfloat64[36] covariance",
    "geometry_msgs/TwistWithCovariance": "geometry_msgs/Twist twist\nfloat64[36] covariance",
    "geometry_msgs/Transform": (
        "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation"
    ),
    "geometry_msgs/TransformStamped": (
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform"
    ),
    "sensor_msgs/Imu": (
        "std_msgs/Header header\n"
        "geometry_msgs/Quaternion orientation\n"
        "float64[9] orientation_covariance\n"
        "geometry_msgs/Vector3 angular_velocity\n"
        "float64[9] angular_velocity_covariance\n"
        "geometry_msgs/Vector3 linear_acceleration\n"
        "float64[9] linear_acceleration_covariance"
    ),
    "sensor_msgs/MagneticField": (
        "std_msgs/Header header\n"
        "geometry_msgs/Vector3 magnetic_field\n"
        "float64[9] magnetic_field_covariance"
    ),
    "nav_msgs/Odometry": (
        "std_msgs/Header header\n"
        "string child_frame_id\n"
        "geometry_msgs/PoseWithCovariance pose\n"
        "geometry_msgs/TwistWithCovariance twist"
    ),
    "tf2_msgs/TFMessage": "geometry_msgs/TransformStamped[] transforms",
    "relpos_msgs/UwbRange": (
        "# Distance between the antennas of two nodes; the frame is that of node_i.\n"
        "std_msgs/Header header\n"
        "int64 node_i\n"
        "int64 node_j\n"
        "int64 antenna_i  # -1: the node's only one, at the origin of its body\n"
        "int64 antenna_j\n"
        "float64 range  # [m]\n"
        "bool surveyed  # measured by other means, once, between nodes that never move\n"
        "bool has_power  # whether the next two mean something\n"
        "float64 rx_power  # [dBm] received\n"
        "float64 fp_power  # [dBm] of the first path"
    ),
}


def definition(name: str) -> str:
    """Return the definition of a message and its parts in the format of MCAP and rosbag2.

    Args:
        name: Name with the part in the middle, ``sensor_msgs/msg/Imu``.
    """
    first = name.replace("/msg/", "/")
    order = [first]
    for one in order:
        for line in _FIELDS[one].splitlines():
            kind = line.split("[", 1)[0].split(" ", 1)[0]
            if kind in _FIELDS and kind not in order:
                order.append(kind)
    parts = [_FIELDS[first]]
    parts += [f"{'=' * 80}\nMSG: {one}\n{_FIELDS[one]}" for one in order[1:]]
    return "\n".join(parts) + "\n"
