// SPDX-License-Identifier: Apache-2.0
// The table that lrt ships: what the common types of ROS 2 mean, by REP 103 and the comments in their definitions.
#include "src/ros2/bridge/shipped.hpp"

namespace lrt::ros2 {

// A type: its name, a title, and whether it is a command. Below it, indented, its fields: path, unit ('-': none), lowest and greatest value; or the
// names of its numbers.
const std::string_view shipped_table = R"(
std_msgs/msg/ColorRGBA; Colour
 r; -; 0; 1
 g; -; 0; 1
 b; -; 0; 1
 a; -; 0; 1
geometry_msgs/msg/Point; Point
 *; m
geometry_msgs/msg/Point32; Point
 *; m
geometry_msgs/msg/PointStamped; Point
geometry_msgs/msg/Quaternion; Orientation
 *; 1
geometry_msgs/msg/QuaternionStamped; Orientation
geometry_msgs/msg/Pose; Pose
geometry_msgs/msg/PoseStamped; Pose
geometry_msgs/msg/PoseArray; Poses
geometry_msgs/msg/PoseWithCovariance; Pose
geometry_msgs/msg/PoseWithCovarianceStamped; Pose
geometry_msgs/msg/Pose2D; Pose in the plane
 x; m
 y; m
 theta; rad
geometry_msgs/msg/Polygon; Polygon
geometry_msgs/msg/PolygonStamped; Polygon
geometry_msgs/msg/Transform; Transform
 translation.*; m
geometry_msgs/msg/TransformStamped; Transform
geometry_msgs/msg/Twist; Velocity; command
 linear.*; m/s
 angular.*; rad/s
geometry_msgs/msg/TwistStamped; Velocity; command
geometry_msgs/msg/TwistWithCovariance; Velocity
geometry_msgs/msg/TwistWithCovarianceStamped; Velocity
geometry_msgs/msg/VelocityStamped; Velocity
geometry_msgs/msg/Accel; Acceleration
 linear.*; m/s2
 angular.*; rad/s2
geometry_msgs/msg/AccelStamped; Acceleration
geometry_msgs/msg/AccelWithCovariance; Acceleration
geometry_msgs/msg/AccelWithCovarianceStamped; Acceleration
geometry_msgs/msg/Wrench; Force and torque
 force.*; N
 torque.*; N.m
geometry_msgs/msg/WrenchStamped; Force and torque
geometry_msgs/msg/Inertia; Inertia
 m; kg
 com.*; m
 ixx; kg.m2
 ixy; kg.m2
 ixz; kg.m2
 iyy; kg.m2
 iyz; kg.m2
 izz; kg.m2
geometry_msgs/msg/InertiaStamped; Inertia
nav_msgs/msg/Odometry; Odometry
nav_msgs/msg/Path; Path
nav_msgs/msg/MapMetaData; Map
 resolution; m
nav_msgs/msg/OccupancyGrid; Occupancy grid
 data; %; -1; 100
nav_msgs/msg/GridCells; Cells of a grid
 cell_width; m
 cell_height; m
sensor_msgs/msg/BatteryState; Battery
 voltage; V
 temperature; Cel
 current; A
 charge; A.h
 capacity; A.h
 design_capacity; A.h
 percentage; 1; 0; 1
 cell_voltage; V
 cell_temperature; Cel
sensor_msgs/msg/CameraInfo; Calibration of a camera
sensor_msgs/msg/CompressedImage; Compressed image
sensor_msgs/msg/FluidPressure; Pressure
 fluid_pressure; Pa
sensor_msgs/msg/Illuminance; Illuminance
 illuminance; lx
sensor_msgs/msg/Image; Image
sensor_msgs/msg/Imu; Inertial measurement
 angular_velocity.*; rad/s
 linear_acceleration.*; m/s2
sensor_msgs/msg/JointState; States of the joints
sensor_msgs/msg/Joy; Joystick
sensor_msgs/msg/LaserScan; Laser scan
 angle_min; rad
 angle_max; rad
 angle_increment; rad
 time_increment; s
 scan_time; s
 range_min; m
 range_max; m
 ranges; m
sensor_msgs/msg/MultiEchoLaserScan; Laser scan
 angle_min; rad
 angle_max; rad
 angle_increment; rad
 time_increment; s
 scan_time; s
 range_min; m
 range_max; m
sensor_msgs/msg/MagneticField; Magnetic field
 magnetic_field.*; T
sensor_msgs/msg/NavSatFix; Position on the earth
 latitude; deg; -90; 90
 longitude; deg; -180; 180
 altitude; m
sensor_msgs/msg/NavSatStatus; Status of the satellites
sensor_msgs/msg/PointCloud2; Point cloud
sensor_msgs/msg/Range; Distance
 radiation_type; =ULTRASOUND:0,INFRARED:1
 field_of_view; rad
 min_range; m
 max_range; m
 range; m
sensor_msgs/msg/RelativeHumidity; Humidity
 relative_humidity; 1; 0; 1
sensor_msgs/msg/Temperature; Temperature
 temperature; Cel
sensor_msgs/msg/TimeReference; Time of a source
tf2_msgs/msg/TFMessage; Transforms of frames
trajectory_msgs/msg/JointTrajectory; Trajectory of joints
trajectory_msgs/msg/JointTrajectoryPoint; Point of a trajectory
trajectory_msgs/msg/MultiDOFJointTrajectory; Trajectory
control_msgs/msg/GripperCommand; Command of a gripper
control_msgs/msg/JointTrajectoryControllerState; State of a trajectory
control_msgs/msg/DynamicJointState; States of the joints
ackermann_msgs/msg/AckermannDrive; Drive command; command
 steering_angle; rad
 steering_angle_velocity; rad/s
 speed; m/s
 acceleration; m/s2
 jerk; m/s3
ackermann_msgs/msg/AckermannDriveStamped; Drive command; command
diagnostic_msgs/msg/DiagnosticArray; Diagnostics
diagnostic_msgs/msg/DiagnosticStatus; Diagnosis
 level; =OK:0,WARN:1,ERROR:2,STALE:3
diagnostic_msgs/msg/KeyValue; Detail
lifecycle_msgs/msg/State; State of a node
 id; =UNKNOWN:0,UNCONFIGURED:1,INACTIVE:2,ACTIVE:3,FINALIZED:4,CONFIGURING:10,CLEANINGUP:11,SHUTTINGDOWN:12,ACTIVATING:13,DEACTIVATING:14,ERRORPROCESSING:15
lifecycle_msgs/msg/TransitionEvent; Transition of a node
action_msgs/msg/GoalStatus; Status of a goal
 status; =UNKNOWN:0,ACCEPTED:1,EXECUTING:2,CANCELING:3,SUCCEEDED:4,CANCELED:5,ABORTED:6
action_msgs/msg/GoalStatusArray; Status of the goals
rosgraph_msgs/msg/Clock; Clock
rcl_interfaces/msg/Log; Message of a node
 level; =UNSET:0,DEBUG:10,INFO:20,WARN:30,ERROR:40,FATAL:50
rcl_interfaces/msg/ParameterEvent; Change of parameters
stereo_msgs/msg/DisparityImage; Disparity image
 t; m
visualization_msgs/msg/Marker; Marker
 scale.*; m
visualization_msgs/msg/MarkerArray; Markers
)";

}  // namespace lrt::ros2
