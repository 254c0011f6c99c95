/* SPDX-License-Identifier: Apache-2.0 */
/* A simulated mobile manipulator that speaks ROS 2, without ROS: eight nodes on Cyclone DDS. It is there so that lrt-ros2 can be tried without a robot.

     ros2_robot [--domain N] [--namespace /NAME] [--only NODE,...] [--humble] [--localhost] [--demo] [--still]

   --domain N        the domain; default: that of ROS_DOMAIN_ID, or 0
   --namespace /NAME of all nodes; two robots in one domain have two namespaces
   --only NODE,...   some of the nodes: base, lidar, camera, map_server, arm_controller, gripper, robot_state_publisher, diagnostics; the others may run as
                     another process
   --humble          neither announces the hashes of types nor describes types, as ROS 2 Humble
   --localhost       for programs on this machine only; also if ROS_LOCALHOST_ONLY is 1, as ROS 2 does. The others need the same
   --demo            the arm moves by itself, and the base drives in a circle
   --still           stamps and the charge of the battery stay as they are, for tests that compare

   /cmd_vel drives the base, and it stops if no command comes for 0.5 s. /arm_controller/follow_joint_trajectory moves the arm. /gripper/move moves the
   gripper, and responds when it has arrived. */
#include <errno.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "ros.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

static const double PI = 3.14159265358979323846, STEP = 0.01 /* [s] */;

/* ---- the robot ---- */

struct joint {
  const char *name, *type, *parent, *child;
  double xyz[3];
  int axis; /* 0 x, 1 y, 2 z; -1: fixed */
  double lower, upper, max_velocity, max_effort;
  double position, velocity;
};

enum { LEFT_WHEEL, RIGHT_WHEEL, SHOULDER_PAN, SHOULDER_LIFT, ELBOW, WRIST, FINGER, MOVING_JOINTS };
enum { ARM_JOINTS = 4 };

/* Units: m, rad, m/s, rad/s, N, N m. The moving ones come first. */
static struct joint joints[] = {
    {"left_wheel_joint", "continuous", "base_link", "left_wheel", {0, 0.2, 0.08}, 1, 0, 0, 12, 8, 0, 0},
    {"right_wheel_joint", "continuous", "base_link", "right_wheel", {0, -0.2, 0.08}, 1, 0, 0, 12, 8, 0, 0},
    {"shoulder_pan_joint", "revolute", "base_link", "shoulder", {0.1, 0, 0.3}, 2, -2.9, 2.9, 1.2, 40, 0, 0},
    {"shoulder_lift_joint", "revolute", "shoulder", "upper_arm", {0, 0, 0.1}, 1, -1.9, 1.9, 1.2, 40, 0, 0},
    {"elbow_joint", "revolute", "upper_arm", "forearm", {0, 0, 0.35}, 1, -2.4, 2.4, 1.5, 25, 0, 0},
    {"wrist_joint", "revolute", "forearm", "hand", {0, 0, 0.3}, 2, -3.1, 3.1, 2.5, 10, 0, 0},
    {"finger_joint", "prismatic", "hand", "finger", {0, 0, 0.08}, 0, 0, 0.08, 0.1, 60, 0.04, 0},
    {"base_joint", "fixed", "base_footprint", "base_link", {0, 0, 0}, -1, 0, 0, 0, 0, 0, 0},
    {"laser_joint", "fixed", "base_link", "laser", {0.2, 0, 0.2}, -1, 0, 0, 0, 0, 0, 0},
    {"camera_joint", "fixed", "base_link", "camera", {0.22, 0, 0.3}, -1, 0, 0, 0, 0, 0, 0},
};

static char* make_urdf(void) {
  enum { SIZE = 8192 };
  char* text = calloc(1, SIZE);
  size_t used = 0;
#define ADD(...) used += (size_t)snprintf(text + used, SIZE - used, __VA_ARGS__)
  ADD("<?xml version=\"1.0\"?>\n<robot name=\"picker\">\n  <link name=\"base_footprint\"/>\n");
  for (size_t i = 0; i < COUNT(joints); ++i) {
    const struct joint* j = &joints[i];
    ADD("  <link name=\"%s\"/>\n  <joint name=\"%s\" type=\"%s\">\n    <parent link=\"%s\"/>\n    <child link=\"%s\"/>\n    <origin xyz=\"%g %g "
        "%g\"/>\n",
        j->child, j->name, j->type, j->parent, j->child, j->xyz[0], j->xyz[1], j->xyz[2]);
    if (j->axis >= 0) ADD("    <axis xyz=\"%d %d %d\"/>\n", j->axis == 0, j->axis == 1, j->axis == 2);
    if (j->upper > j->lower)
      ADD("    <limit lower=\"%g\" upper=\"%g\" velocity=\"%g\" effort=\"%g\"/>\n", j->lower, j->upper, j->max_velocity, j->max_effort);
    else if (j->axis >= 0) ADD("    <limit velocity=\"%g\" effort=\"%g\"/>\n", j->max_velocity, j->max_effort);
    ADD("  </joint>\n");
  }
  ADD("</robot>\n");
#undef ADD
  return text;
}

static struct {
  double x, y, heading, linear, angular;    /* where the base is, and how fast it is */
  double wanted_linear, wanted_angular;     /* the newest command */
  double commanded_at;                      /* [s] when it came */
  double max_linear, max_angular;           /* parameters */
  double scan_range, brightness, arm_speed; /* parameters */
  char operator_name[64], model[32];        /* parameters */
  double charge, gripper_target;
  bool lidar_is_active;
} robot = {.max_linear = 0.8,
           .max_angular = 1.5,
           .scan_range = 8,
           .brightness = 0.8,
           .arm_speed = 1,
           .operator_name = "nobody",
           .model = "picker-1",
           .charge = 0.87,
           .gripper_target = 0.08,
           .lidar_is_active = true};

static const double ROOM[2] = {3, 2}; /* half of its length and width [m] */
static double now;                    /* [s] since the start */
static bool is_demo;
static volatile sig_atomic_t interrupted;

static double limited(double value, double low, double high) { return value < low ? low : value > high ? high : value; }
static double towards(double from, double to, double most) { return from + limited(to - from, -most, most); }
static char* text(const char* constant) { return (char*)constant; } /* DDS reads it only */

static void set_header(std_msgs_msg_dds__Header_* header, const char* frame) {
  stamp_now(&header->stamp);
  header->frame_id = text(frame);
}

/* ---- base ---- */

static dds_entity_t odometry, battery, commands, status_of_robot;

static void step_base(void) {
  void* sample = NULL;
  dds_sample_info_t info;
  while (commands > 0 && dds_take(commands, &sample, &info, 1, 1) > 0) {
    const geometry_msgs_msg_dds__Twist_* twist = sample;
    if (info.valid_data && isfinite(twist->linear.x) && isfinite(twist->angular.z)) {
      robot.wanted_linear = twist->linear.x;
      robot.wanted_angular = twist->angular.z;
      robot.commanded_at = now;
    }
    dds_return_loan(commands, &sample, 1);
    sample = NULL;
  }
  if (now - robot.commanded_at > 0.5) robot.wanted_linear = robot.wanted_angular = 0;
  double linear = limited(robot.wanted_linear, -robot.max_linear, robot.max_linear);
  double angular = limited(robot.wanted_angular, -robot.max_angular, robot.max_angular);
  if (is_demo && linear == 0 && angular == 0) linear = 0.2, angular = 0.25;
  robot.linear = towards(robot.linear, linear, 1.5 * STEP);
  robot.angular = towards(robot.angular, angular, 4 * STEP);
  robot.heading = remainder(robot.heading + robot.angular * STEP, 2 * PI);
  robot.x = limited(robot.x + robot.linear * cos(robot.heading) * STEP, -ROOM[0] + 0.3, ROOM[0] - 0.3);
  robot.y = limited(robot.y + robot.linear * sin(robot.heading) * STEP, -ROOM[1] + 0.3, ROOM[1] - 0.3);
  for (int i = LEFT_WHEEL; i <= RIGHT_WHEEL; ++i) {
    joints[i].velocity = (robot.linear + (i == LEFT_WHEEL ? -0.2 : 0.2) * robot.angular) / 0.08;
    joints[i].position += joints[i].velocity * STEP;
  }
  if (!time_stands) robot.charge = limited(robot.charge - STEP * (1e-5 + 1e-4 * fabs(robot.linear)), 0.05, 1);
}

static void publish_odometry(void) {
  nav_msgs_msg_dds__Odometry_ sample = {.child_frame_id = text("base_footprint")};
  set_header(&sample.header, "odom");
  sample.pose.pose.position.x = robot.x;
  sample.pose.pose.position.y = robot.y;
  sample.pose.pose.orientation.z = sin(robot.heading / 2);
  sample.pose.pose.orientation.w = cos(robot.heading / 2);
  sample.twist.twist.linear.x = robot.linear;
  sample.twist.twist.angular.z = robot.angular;
  for (int i = 0; i < 6; ++i) sample.pose.covariance[7 * i] = sample.twist.covariance[7 * i] = 0.01;
  write_sample(odometry, &sample);
}

static void publish_battery(void) {
  sensor_msgs_msg_dds__BatteryState_ sample = {.location = text("base"), .serial_number = text("B-0117")};
  set_header(&sample.header, "base_link");
  sample.voltage = (float)(22 + 4 * robot.charge);
  sample.temperature = 31.5f;
  sample.current = (float)(-1.2 - 4 * fabs(robot.linear));
  sample.percentage = (float)robot.charge;
  sample.capacity = sample.design_capacity = 20;
  sample.charge = (float)(20 * robot.charge);
  sample.power_supply_status = 2;     /* POWER_SUPPLY_STATUS_DISCHARGING */
  sample.power_supply_health = 1;     /* POWER_SUPPLY_HEALTH_GOOD */
  sample.power_supply_technology = 2; /* POWER_SUPPLY_TECHNOLOGY_LION */
  sample.present = true;
  write_sample(battery, &sample);
}

/* ---- lidar ---- */

static dds_entity_t scans, lidar_transitions;

/* From the base in a room with four walls. */
static double distance(double angle) {
  const double dx = cos(robot.heading + angle), dy = sin(robot.heading + angle);
  const double x = dx == 0 ? HUGE_VAL : ((dx > 0 ? ROOM[0] : -ROOM[0]) - robot.x) / dx;
  const double y = dy == 0 ? HUGE_VAL : ((dy > 0 ? ROOM[1] : -ROOM[1]) - robot.y) / dy;
  return x < y ? x : y;
}

static void publish_scan(void) {
  enum { RAYS = 360 };
  float ranges[RAYS];
  sensor_msgs_msg_dds__LaserScan_ sample = {0};
  if (!robot.lidar_is_active) return;
  set_header(&sample.header, "laser");
  sample.angle_min = (float)-PI;
  sample.angle_increment = (float)(2 * PI / RAYS);
  sample.angle_max = sample.angle_min + (RAYS - 1) * sample.angle_increment;
  sample.scan_time = 0.1f;
  sample.range_min = 0.05f;
  sample.range_max = (float)robot.scan_range;
  for (int i = 0; i < RAYS; ++i) {
    const double range = distance(-PI + i * 2 * PI / RAYS);
    ranges[i] = range > robot.scan_range ? HUGE_VALF : (float)range; /* REP 117: nothing within reach */
  }
  sample.ranges._buffer = ranges;
  sample.ranges._length = RAYS;
  write_sample(scans, &sample);
}

/* The lidar is a managed node: primary states and transitions of lifecycle_msgs. */
enum { INACTIVE = 2, ACTIVE = 3, ACTIVATE = 3, DEACTIVATE = 4 };
static const lifecycle_msgs_msg_dds__State_ inactive = {INACTIVE, "inactive"}, active = {ACTIVE, "active"};
static const lifecycle_msgs_msg_dds__Transition_ activate = {ACTIVATE, "activate"}, deactivate = {DEACTIVATE, "deactivate"};

static bool get_state(struct node* node, void* context, const void* request, void* reply) {
  (void)node, (void)context, (void)request;
  ((lifecycle_msgs_srv_dds__GetState_Response_*)reply)->current_state = robot.lidar_is_active ? active : inactive;
  return true;
}

static bool get_available_states(struct node* node, void* context, const void* request, void* reply) {
  (void)node, (void)context, (void)request;
  lifecycle_msgs_srv_dds__GetAvailableStates_Response_* response = reply;
  response->available_states._length = 2;
  response->available_states._buffer = scratch(2 * sizeof *response->available_states._buffer);
  response->available_states._buffer[0] = inactive;
  response->available_states._buffer[1] = active;
  return true;
}

static bool get_available_transitions(struct node* node, void* context, const void* request, void* reply) {
  (void)node, (void)context, (void)request;
  lifecycle_msgs_srv_dds__GetAvailableTransitions_Response_* response = reply;
  response->available_transitions._length = 1;
  response->available_transitions._buffer = scratch(sizeof *response->available_transitions._buffer);
  response->available_transitions._buffer->transition = robot.lidar_is_active ? deactivate : activate;
  response->available_transitions._buffer->start_state = robot.lidar_is_active ? active : inactive;
  response->available_transitions._buffer->goal_state = robot.lidar_is_active ? inactive : active;
  return true;
}

static bool change_state(struct node* node, void* context, const void* request, void* reply) {
  (void)node, (void)context;
  const lifecycle_msgs_srv_dds__ChangeState_Request_* asked = request;
  const uint8_t id = asked->transition.id;
  /* By its number, or if that is 0 by its label, as ROS 2 does. */
  const bool wants_active = id == ACTIVATE || (id == 0 && strcmp(asked->transition.label, "activate") == 0);
  const bool wants_inactive = id == DEACTIVATE || (id == 0 && strcmp(asked->transition.label, "deactivate") == 0);
  if (robot.lidar_is_active ? !wants_inactive : !wants_active) return true;
  lifecycle_msgs_msg_dds__TransitionEvent_ event = {.timestamp = (uint64_t)time(NULL) * 1000000000};
  event.transition = robot.lidar_is_active ? deactivate : activate;
  event.start_state = robot.lidar_is_active ? active : inactive;
  robot.lidar_is_active = !robot.lidar_is_active;
  event.goal_state = robot.lidar_is_active ? active : inactive;
  write_sample(lidar_transitions, &event);
  ((lifecycle_msgs_srv_dds__ChangeState_Response_*)reply)->success = true;
  return true;
}

/* ---- camera and map ---- */

static dds_entity_t images, maps;

static void publish_image(void) {
  enum { WIDTH = 64, HEIGHT = 48 };
  static uint8_t pixels[HEIGHT][WIDTH][3];
  sensor_msgs_msg_dds__Image_ sample = {.height = HEIGHT, .width = WIDTH, .encoding = text("rgb8"), .step = 3 * WIDTH};
  set_header(&sample.header, "camera");
  for (int column = 0; column < WIDTH; ++column) {
    const double range = distance((WIDTH / 2 - column) * 0.02);
    for (int row = 0; row < HEIGHT; ++row) {
      /* The wall, seen from 0.3 m above the floor; it is 1 m high. */
      const double up = (HEIGHT / 2 - row) * 0.02 * range + 0.3;
      const double light = robot.brightness * 255 / (1 + 0.2 * range);
      pixels[row][column][0] = (uint8_t)(up < 0 ? light * 0.4 : up < 1 ? light : light * 0.5);
      pixels[row][column][1] = (uint8_t)(up < 0 ? light * 0.4 : up < 1 ? light * 0.8 : light * 0.7);
      pixels[row][column][2] = (uint8_t)(up < 0 ? light * 0.4 : up < 1 ? light * 0.5 : light);
    }
  }
  sample.data._buffer = &pixels[0][0][0];
  sample.data._length = sizeof pixels;
  write_sample(images, &sample);
}

static void publish_map(void) {
  enum { WIDTH = 64, HEIGHT = 44 };
  static uint8_t cells[HEIGHT][WIDTH];
  nav_msgs_msg_dds__OccupancyGrid_ sample = {0};
  set_header(&sample.header, "map");
  sample.info.map_load_time = sample.header.stamp;
  sample.info.resolution = 0.1f;
  sample.info.width = WIDTH;
  sample.info.height = HEIGHT;
  sample.info.origin.position.x = -WIDTH * 0.05;
  sample.info.origin.position.y = -HEIGHT * 0.05;
  sample.info.origin.orientation.w = 1;
  for (int row = 0; row < HEIGHT; ++row)
    for (int column = 0; column < WIDTH; ++column) {
      const double x = fabs((column + 0.5) * 0.1 - WIDTH * 0.05), y = fabs((row + 0.5) * 0.1 - HEIGHT * 0.05);
      cells[row][column] = x > ROOM[0] + 0.1 || y > ROOM[1] + 0.1 ? 255 /* -1: not known */ : x > ROOM[0] || y > ROOM[1] ? 100 : 0;
    }
  sample.data._buffer = &cells[0][0];
  sample.data._length = sizeof cells;
  write_sample(maps, &sample);
}

/* ---- arm ---- */

static dds_entity_t joint_states, goal_feedback, goal_status, result_replies;

enum { ACCEPTED = 1, EXECUTING = 2, CANCELING = 3, SUCCEEDED = 4, CANCELED = 5, ABORTED = 6 };
enum { MAX_POINTS = 64, KEPT_GOALS = 8, MAX_WAITING = 8 };
enum { SUCCESSFUL = 0, INVALID_GOAL = -1 };

/* The goals, the newest first. */
static struct goal {
  uint8_t id[16];
  builtin_interfaces_msg_dds__Time_ stamp;
  int status; /* 0: none */
  double began;
  int count;
  double at[MAX_POINTS], positions[MAX_POINTS][ARM_JOINTS], from[ARM_JOINTS];
  int32_t error_code;
  const char* error;
  unsigned long long waiting[MAX_WAITING][2]; /* identities of requests for the result */
  int waiting_count;
} goals[KEPT_GOALS];

static bool is_active(const struct goal* goal) { return goal->status == ACCEPTED || goal->status == EXECUTING || goal->status == CANCELING; }

static struct goal* find_goal(const uint8_t id[16]) {
  for (int i = 0; i < KEPT_GOALS; ++i)
    if (goals[i].status && memcmp(goals[i].id, id, 16) == 0) return &goals[i];
  return NULL;
}

static void publish_goal_status(void) {
  action_msgs_msg_dds__GoalStatus_ list[KEPT_GOALS];
  action_msgs_msg_dds__GoalStatusArray_ sample = {0};
  for (int i = 0; i < KEPT_GOALS && goals[i].status; ++i, ++sample.status_list._length) {
    memcpy(list[i].goal_info.goal_id.uuid, goals[i].id, 16);
    list[i].goal_info.stamp = goals[i].stamp;
    list[i].status = (char)goals[i].status;
  }
  sample.status_list._buffer = list;
  write_sample(goal_status, &sample);
}

static void set_result(const struct goal* goal, control_msgs_action_dds__FollowJointTrajectory_GetResult_Response_* response) {
  response->status = (char)goal->status;
  response->result.error_code = goal->error_code;
  response->result.error_string = text(goal->error);
}

static void end_goal(struct goal* goal, int status, int32_t error_code, const char* error) {
  goal->status = status;
  goal->error_code = error_code;
  goal->error = error;
  for (int i = 0; i < ARM_JOINTS; ++i) joints[SHOULDER_PAN + i].velocity = 0;
  publish_goal_status();
  for (int i = 0; i < goal->waiting_count; ++i) {
    control_msgs_action_dds__FollowJointTrajectory_GetResult_Response_ response = {.client = goal->waiting[i][0],
                                                                                   .sequence_number = (long long)goal->waiting[i][1]};
    set_result(goal, &response);
    write_sample(result_replies, &response);
  }
  goal->waiting_count = 0;
}

/* Reads a trajectory into a goal; says what is wrong with it. */
static const char* read_trajectory(const trajectory_msgs_msg_dds__JointTrajectory_* given, struct goal* goal) {
  int index[ARM_JOINTS];
  const uint32_t names = given->joint_names._length;
  if (names == 0 || names > ARM_JOINTS) return "name one to four joints of the arm";
  if (given->points._length == 0 || given->points._length > MAX_POINTS) return "one to 64 points";
  for (uint32_t i = 0; i < names; ++i) {
    index[i] = -1;
    for (int j = 0; j < ARM_JOINTS; ++j)
      if (strcmp(joints[SHOULDER_PAN + j].name, given->joint_names._buffer[i]) == 0) index[i] = j;
    if (index[i] < 0) return "a joint that the arm does not have";
  }
  for (int j = 0; j < ARM_JOINTS; ++j) goal->from[j] = joints[SHOULDER_PAN + j].position;
  for (uint32_t point = 0; point < given->points._length; ++point) {
    const trajectory_msgs_msg_dds__JointTrajectoryPoint_* p = &given->points._buffer[point];
    goal->at[point] = p->time_from_start.sec + 1e-9 * p->time_from_start.nanosec;
    if (p->positions._length != names) return "a point needs a position for each joint";
    if (goal->at[point] < 0 || (point > 0 && goal->at[point] <= goal->at[point - 1])) return "the times of the points must rise";
    memcpy(goal->positions[point], point > 0 ? goal->positions[point - 1] : goal->from, sizeof goal->from);
    for (uint32_t i = 0; i < names; ++i) {
      const struct joint* joint = &joints[SHOULDER_PAN + index[i]];
      const double position = p->positions._buffer[i];
      if (!(position >= joint->lower && position <= joint->upper)) return "a position is beyond the limits of its joint";
      goal->positions[point][index[i]] = position;
    }
  }
  goal->count = (int)given->points._length;
  return NULL;
}

static bool send_goal(struct node* node, void* context, const void* request, void* reply) {
  (void)node, (void)context;
  const control_msgs_action_dds__FollowJointTrajectory_SendGoal_Request_* asked = request;
  control_msgs_action_dds__FollowJointTrajectory_SendGoal_Response_* response = reply;
  static struct goal goal; /* its size */
  memset(&goal, 0, sizeof goal);
  stamp_now(&response->stamp);
  const char* fault = find_goal(asked->goal_id.uuid) ? "the goal is known" : read_trajectory(&asked->goal.trajectory, &goal);
  if (fault) return fprintf(stderr, "ros2_robot: a goal is rejected: %s\n", fault), true;
  if (is_active(&goals[0])) end_goal(&goals[0], ABORTED, INVALID_GOAL, "replaced by a newer goal");
  memcpy(goal.id, asked->goal_id.uuid, 16);
  goal.stamp = response->stamp;
  goal.status = EXECUTING;
  goal.began = now;
  goal.error = "";
  memmove(&goals[1], &goals[0], (KEPT_GOALS - 1) * sizeof *goals);
  goals[0] = goal;
  response->accepted = true;
  publish_goal_status();
  return true;
}

static bool cancel_goal(struct node* node, void* context, const void* request, void* reply) {
  (void)node, (void)context;
  static const uint8_t all[16];
  enum { UNKNOWN_GOAL_ID = 2, GOAL_TERMINATED = 3 };
  const action_msgs_srv_dds__CancelGoal_Request_* asked = request;
  action_msgs_srv_dds__CancelGoal_Response_* response = reply;
  struct goal* goal = memcmp(asked->goal_info.goal_id.uuid, all, 16) == 0 ? &goals[0] : find_goal(asked->goal_info.goal_id.uuid);
  if (!goal || !is_active(goal)) {
    response->return_code = goal && goal->status ? GOAL_TERMINATED : UNKNOWN_GOAL_ID;
    return true;
  }
  goal->status = CANCELING;
  response->goals_canceling._buffer = scratch(sizeof *response->goals_canceling._buffer);
  response->goals_canceling._length = 1;
  memcpy(response->goals_canceling._buffer->goal_id.uuid, goal->id, 16);
  response->goals_canceling._buffer->stamp = goal->stamp;
  publish_goal_status();
  return true;
}

static bool get_result(struct node* node, void* context, const void* request, void* reply) {
  (void)node, (void)context;
  const control_msgs_action_dds__FollowJointTrajectory_GetResult_Request_* asked = request;
  control_msgs_action_dds__FollowJointTrajectory_GetResult_Response_* response = reply;
  response->result.error_string = text("there is no such goal");
  struct goal* goal = find_goal(asked->goal_id.uuid);
  if (goal && is_active(goal) && goal->waiting_count < MAX_WAITING) {
    goal->waiting[goal->waiting_count][0] = asked->client;
    goal->waiting[goal->waiting_count++][1] = (unsigned long long)asked->sequence_number;
    return false;
  }
  if (goal) set_result(goal, response);
  return true;
}

static void publish_feedback(const struct goal* goal, const double desired[ARM_JOINTS]) {
  char* names[ARM_JOINTS];
  double wanted[ARM_JOINTS], actual[ARM_JOINTS], error[ARM_JOINTS];
  control_msgs_action_dds__FollowJointTrajectory_FeedbackMessage_ sample = {0};
  memcpy(sample.goal_id.uuid, goal->id, 16);
  set_header(&sample.feedback.header, "base_link");
  for (int i = 0; i < ARM_JOINTS; ++i) {
    names[i] = text(joints[SHOULDER_PAN + i].name);
    wanted[i] = desired[i];
    actual[i] = joints[SHOULDER_PAN + i].position;
    error[i] = wanted[i] - actual[i];
  }
  trajectory_msgs_msg_dds__JointTrajectoryPoint_* points[] = {&sample.feedback.desired, &sample.feedback.actual, &sample.feedback.error};
  double* values[] = {wanted, actual, error};
  for (int i = 0; i < 3; ++i) {
    points[i]->positions._buffer = values[i];
    points[i]->positions._length = ARM_JOINTS;
    points[i]->time_from_start.sec = (int32_t)floor(now - goal->began);
    points[i]->time_from_start.nanosec = (uint32_t)(1e9 * (now - goal->began - floor(now - goal->began)));
  }
  sample.feedback.joint_names._buffer = names;
  sample.feedback.joint_names._length = ARM_JOINTS;
  write_sample(goal_feedback, &sample);
}

static void step_arm(void) {
  struct goal* goal = &goals[0];
  if (!is_active(goal)) {
    if (is_demo)
      for (int i = 0; i < ARM_JOINTS; ++i) {
        const double target = 0.4 * sin(now * (0.3 + 0.1 * i));
        joints[SHOULDER_PAN + i].velocity = (target - joints[SHOULDER_PAN + i].position) / STEP;
        joints[SHOULDER_PAN + i].position = target;
      }
    return;
  }
  if (goal->status == CANCELING) {
    end_goal(goal, CANCELED, SUCCESSFUL, "canceled");
    return;
  }
  const double at = (now - goal->began) * robot.arm_speed;
  int next = 0;
  while (next < goal->count && goal->at[next] <= at) ++next;
  double desired[ARM_JOINTS];
  bool has_arrived = next == goal->count;
  for (int i = 0; i < ARM_JOINTS; ++i) {
    struct joint* joint = &joints[SHOULDER_PAN + i];
    const double* before = next > 0 ? goal->positions[next - 1] : goal->from;
    const double began = next > 0 ? goal->at[next - 1] : 0;
    desired[i] = next == goal->count ? before[i] : before[i] + (goal->positions[next][i] - before[i]) * (at - began) / (goal->at[next] - began);
    const double position = towards(joint->position, desired[i], joint->max_velocity * STEP);
    joint->velocity = (position - joint->position) / STEP;
    joint->position = position;
    has_arrived = has_arrived && fabs(position - desired[i]) < 1e-9;
  }
  if ((long)(now / STEP + 0.5) % 10 == 0) publish_feedback(goal, desired);
  if (has_arrived) end_goal(goal, SUCCEEDED, SUCCESSFUL, "");
}

static void publish_joint_states(void) {
  char* names[MOVING_JOINTS];
  double positions[MOVING_JOINTS], velocities[MOVING_JOINTS], efforts[MOVING_JOINTS];
  sensor_msgs_msg_dds__JointState_ sample = {0};
  set_header(&sample.header, "");
  for (int i = 0; i < MOVING_JOINTS; ++i) {
    names[i] = text(joints[i].name);
    positions[i] = joints[i].position;
    velocities[i] = joints[i].velocity;
    efforts[i] = i == SHOULDER_LIFT || i == ELBOW ? 6 * sin(joints[SHOULDER_LIFT].position) : 0;
  }
  sample.name._buffer = names;
  sample.position._buffer = positions;
  sample.velocity._buffer = velocities;
  sample.effort._buffer = efforts;
  sample.name._length = sample.position._length = sample.velocity._length = sample.effort._length = MOVING_JOINTS;
  write_sample(joint_states, &sample);
}

/* ---- gripper ---- */

static dds_entity_t gripper_replies;
static ros2_robot_srv_dds__MoveGripper_Request_ gripper_request;
static bool gripper_has_request;

static void reply_gripper(bool has_reached, const char* message) {
  const ros2_robot_srv_dds__MoveGripper_Response_ response = {.client = gripper_request.client,
                                                              .sequence_number = gripper_request.sequence_number,
                                                              .reached = has_reached,
                                                              .width = 2 * joints[FINGER].position,
                                                              .message = text(message)};
  write_sample(gripper_replies, &response);
  gripper_has_request = false;
}

static bool move_gripper(struct node* node, void* context, const void* request, void* reply) {
  (void)node, (void)context;
  const ros2_robot_srv_dds__MoveGripper_Request_* asked = request;
  ros2_robot_srv_dds__MoveGripper_Response_* response = reply;
  if (!(asked->width >= 0 && asked->width <= 0.16)) {
    response->width = 2 * joints[FINGER].position;
    response->message = text("the width must be from 0 to 0.16 m");
    return true;
  }
  if (gripper_has_request) reply_gripper(false, "replaced by another request");
  gripper_request = *asked;
  gripper_has_request = true;
  robot.gripper_target = asked->width;
  return false;
}

static void step_gripper(void) {
  const double position = towards(joints[FINGER].position, robot.gripper_target / 2, joints[FINGER].max_velocity * STEP);
  joints[FINGER].velocity = (position - joints[FINGER].position) / STEP;
  joints[FINGER].position = position;
  if (gripper_has_request && position == robot.gripper_target / 2) reply_gripper(true, "");
}

static bool calibrate(struct node* node, void* context, const void* request, void* reply) {
  (void)node, (void)context, (void)request;
  std_srvs_srv_dds__Trigger_Response_* response = reply;
  response->success = true;
  response->message = text("calibrated");
  return true;
}

/* ---- robot_state_publisher and diagnostics ---- */

static dds_entity_t descriptions, transforms, static_transforms;
static char* urdf;

static void publish_description(void) {
  std_msgs_msg_dds__String_ sample = {.data = urdf};
  write_sample(descriptions, &sample);
}

static void publish_transforms(dds_entity_t writer, bool are_static) {
  enum { MOST = COUNT(joints) + 1 };
  geometry_msgs_msg_dds__TransformStamped_ list[MOST];
  tf2_msgs_msg_dds__TFMessage_ sample = {0};
  uint32_t count = 0;
  memset(list, 0, sizeof list);
  if (!are_static) {
    set_header(&list[0].header, "odom");
    list[0].child_frame_id = text("base_footprint");
    list[0].transform.translation.x = robot.x;
    list[0].transform.translation.y = robot.y;
    list[0].transform.rotation.z = sin(robot.heading / 2);
    list[0].transform.rotation.w = cos(robot.heading / 2);
    count = 1;
  }
  for (size_t i = 0; i < COUNT(joints); ++i) {
    const struct joint* joint = &joints[i];
    if ((joint->axis < 0) != are_static) continue;
    geometry_msgs_msg_dds__TransformStamped_* t = &list[count++];
    set_header(&t->header, joint->parent);
    t->child_frame_id = text(joint->child);
    t->transform.translation.x = joint->xyz[0];
    t->transform.translation.y = joint->xyz[1];
    t->transform.translation.z = joint->xyz[2];
    t->transform.rotation.w = 1;
    if (i == FINGER) t->transform.translation.x += joint->position;
    else if (joint->axis >= 0) {
      double* axes[] = {&t->transform.rotation.x, &t->transform.rotation.y, &t->transform.rotation.z};
      *axes[joint->axis] = sin(joint->position / 2);
      t->transform.rotation.w = cos(joint->position / 2);
    }
  }
  sample.transforms._buffer = list;
  sample.transforms._length = count;
  write_sample(writer, &sample);
}

static void publish_diagnostics(void) {
  char charge[16];
  snprintf(charge, sizeof charge, "%.2f", robot.charge);
  diagnostic_msgs_msg_dds__KeyValue_ values[] = {{text("charge"), charge}};
  diagnostic_msgs_msg_dds__DiagnosticStatus_ list[] = {{.level = robot.charge < 0.2 ? 1 : 0,
                                                        .name = text("battery"),
                                                        .message = text(robot.charge < 0.2 ? "low" : "ok"),
                                                        .hardware_id = text("B-0117")},
                                                       {.level = robot.lidar_is_active ? 0 : 3,
                                                        .name = text("lidar"),
                                                        .message = text(robot.lidar_is_active ? "ok" : "inactive"),
                                                        .hardware_id = text("L-3")}};
  list[0].values._buffer = values;
  list[0].values._length = 1;
  diagnostic_msgs_msg_dds__DiagnosticArray_ sample = {0};
  set_header(&sample.header, "");
  sample.status._buffer = list;
  sample.status._length = COUNT(list);
  write_sample(status_of_robot, &sample);
}

/* ---- the nodes ---- */

static const char* only; /* names of nodes; NULL: all */

static bool has_node(const char* name) {
  const size_t size = strlen(name);
  for (const char* at = only; at; at = strchr(at, ',') ? strchr(at, ',') + 1 : NULL)
    if (strncmp(at, name, size) == 0 && (at[size] == ',' || at[size] == '\0')) return true;
  return !only;
}

#define LIFECYCLE_SERVICE(node, name, Type, serve) \
  add_service(node, "~/" name, &lifecycle_msgs_srv_dds__##Type##_Request__desc, &lifecycle_msgs_srv_dds__##Type##_Response__desc, serve, NULL)

static void add_nodes(struct graph* graph, const char* space) {
  if (has_node("base")) {
    struct node* node = add_node(graph, space, "base");
    odometry = publish_topic(node, "odom", &nav_msgs_msg_dds__Odometry__desc, RELIABLE);
    battery = publish_topic(node, "battery_state", &sensor_msgs_msg_dds__BatteryState__desc, RELIABLE);
    commands = subscribe_topic(node, "cmd_vel", &geometry_msgs_msg_dds__Twist__desc, RELIABLE);
    add_real(node, "max_linear_velocity", &robot.max_linear, 0, 1.2, "Of the base, forwards and backwards [m/s]");
    add_real(node, "max_angular_velocity", &robot.max_angular, 0, 3, "Of the base [rad/s]");
    add_text(node, "operator", robot.operator_name, sizeof robot.operator_name, false, "Who is responsible");
    add_text(node, "model", robot.model, sizeof robot.model, true, "What the base is");
  }
  if (has_node("lidar")) {
    struct node* node = add_node(graph, space, "lidar");
    scans = publish_topic(node, "scan", &sensor_msgs_msg_dds__LaserScan__desc, SENSOR_DATA);
    lidar_transitions = publish_topic(node, "~/transition_event", &lifecycle_msgs_msg_dds__TransitionEvent__desc, RELIABLE);
    LIFECYCLE_SERVICE(node, "get_state", GetState, get_state);
    LIFECYCLE_SERVICE(node, "change_state", ChangeState, change_state);
    LIFECYCLE_SERVICE(node, "get_available_states", GetAvailableStates, get_available_states);
    LIFECYCLE_SERVICE(node, "get_available_transitions", GetAvailableTransitions, get_available_transitions);
    add_real(node, "range_max", &robot.scan_range, 1, 20, "Ranges beyond it are infinite [m]");
  }
  if (has_node("camera")) {
    struct node* node = add_node(graph, space, "camera");
    images = publish_topic(node, "camera/image_raw", &sensor_msgs_msg_dds__Image__desc, SENSOR_DATA);
    add_real(node, "brightness", &robot.brightness, 0, 1, "1: white is 255");
  }
  if (has_node("map_server")) maps = publish_topic(add_node(graph, space, "map_server"), "map", &nav_msgs_msg_dds__OccupancyGrid__desc, LATCHED);
  if (has_node("arm_controller")) {
    struct node* node = add_node(graph, space, "arm_controller");
    joint_states = publish_topic(node, "joint_states", &sensor_msgs_msg_dds__JointState__desc, RELIABLE);
#define ACTION "~/follow_joint_trajectory/_action/"
    goal_feedback = publish_topic(node, ACTION "feedback", &control_msgs_action_dds__FollowJointTrajectory_FeedbackMessage__desc, RELIABLE);
    goal_status = publish_topic(node, ACTION "status", &action_msgs_msg_dds__GoalStatusArray__desc, LATCHED);
    add_service(node, ACTION "send_goal", &control_msgs_action_dds__FollowJointTrajectory_SendGoal_Request__desc,
                &control_msgs_action_dds__FollowJointTrajectory_SendGoal_Response__desc, send_goal, NULL);
    add_service(node, ACTION "cancel_goal", &action_msgs_srv_dds__CancelGoal_Request__desc, &action_msgs_srv_dds__CancelGoal_Response__desc,
                cancel_goal, NULL);
    result_replies = add_service(node, ACTION "get_result", &control_msgs_action_dds__FollowJointTrajectory_GetResult_Request__desc,
                                 &control_msgs_action_dds__FollowJointTrajectory_GetResult_Response__desc, get_result, NULL);
    add_real(node, "speed", &robot.arm_speed, 0.1, 1, "Of the times in trajectories");
    publish_goal_status();
  }
  if (has_node("gripper")) {
    struct node* node = add_node(graph, space, "gripper");
    gripper_replies = add_service(node, "~/move", &ros2_robot_srv_dds__MoveGripper_Request__desc, &ros2_robot_srv_dds__MoveGripper_Response__desc,
                                  move_gripper, NULL);
    add_service(node, "~/calibrate", &std_srvs_srv_dds__Trigger_Request__desc, &std_srvs_srv_dds__Trigger_Response__desc, calibrate, NULL);
  }
  if (has_node("robot_state_publisher")) {
    struct node* node = add_node(graph, space, "robot_state_publisher");
    descriptions = publish_topic(node, "robot_description", &std_msgs_msg_dds__String__desc, LATCHED);
    transforms = publish_topic(node, "/tf", &tf2_msgs_msg_dds__TFMessage__desc, RELIABLE);
    static_transforms = publish_topic(node, "/tf_static", &tf2_msgs_msg_dds__TFMessage__desc, LATCHED);
  }
  if (has_node("diagnostics"))
    status_of_robot = publish_topic(add_node(graph, space, "diagnostics"), "/diagnostics", &diagnostic_msgs_msg_dds__DiagnosticArray__desc, RELIABLE);
}

static void end(int signal_number) {
  (void)signal_number;
  interrupted = 1;
}

static int usage(int status) {
  fprintf(status ? stderr : stdout,
          "usage: ros2_robot [--domain N] [--namespace /NAME] [--only NODE,...] [--humble] [--localhost] [--demo] [--still]\n");
  return status;
}

int main(int argc, char** argv) {
  const char *domain = getenv("ROS_DOMAIN_ID"), *space = "/";
  bool is_humble = false, is_local = getenv("ROS_LOCALHOST_ONLY") && strcmp(getenv("ROS_LOCALHOST_ONLY"), "1") == 0;
  for (int i = 1; i < argc; ++i) {
    if (strcmp(argv[i], "--domain") == 0 && i + 1 < argc) domain = argv[++i];
    else if (strcmp(argv[i], "--namespace") == 0 && i + 1 < argc) space = argv[++i];
    else if (strcmp(argv[i], "--only") == 0 && i + 1 < argc) only = argv[++i];
    else if (strcmp(argv[i], "--humble") == 0) is_humble = true;
    else if (strcmp(argv[i], "--localhost") == 0) is_local = true;
    else if (strcmp(argv[i], "--demo") == 0) is_demo = true;
    else if (strcmp(argv[i], "--still") == 0) time_stands = true;
    else return usage(strcmp(argv[i], "--help") == 0 ? 0 : 2);
  }
  char* rest = NULL;
  errno = 0;
  const long number = domain && *domain ? strtol(domain, &rest, 10) : 0;
  if (errno || (rest && *rest) || number < 0 || number > 232) return fprintf(stderr, "ros2_robot: the domain is a number from 0 to 232\n"), 2;
  if (*space != '/') return fprintf(stderr, "ros2_robot: the namespace begins with /\n"), 2;

  srand((unsigned)time(NULL));
  signal(SIGINT, end);
  signal(SIGTERM, end);
  static struct graph graph;
  /* Linux delivers multicast on the loopback interface, too, although the interface does not say so. */
  join(&graph, (unsigned)number,
       is_local ? "<General><Interfaces><NetworkInterface address=\"127.0.0.1\" multicast=\"true\"/></Interfaces>"
                  "<AllowMulticast>true</AllowMulticast></General>"
                : NULL,
       !is_humble);
  urdf = make_urdf();
  add_nodes(&graph, space);
  announce(&graph);
  if (maps) publish_map();
  if (descriptions) publish_description();
  if (static_transforms) publish_transforms(static_transforms, true);
  printf("ros2_robot: %u nodes in domain %ld (Ctrl-C ends)\n", graph.node_count, number);
  fflush(stdout);

  struct timespec next;
  clock_gettime(CLOCK_MONOTONIC, &next);
  for (unsigned long step = 0; !interrupted; ++step) {
    now = (double)step * STEP;
    serve_requests(&graph);
    if (odometry) step_base();
    if (joint_states) step_arm();
    if (gripper_replies) step_gripper();
    if (joint_states && step % 2 == 0) publish_joint_states();
    if (transforms && step % 2 == 0) publish_transforms(transforms, false);
    if (odometry && step % 5 == 0) publish_odometry();
    if (scans && step % 10 == 0) publish_scan();
    if (images && step % 20 == 0) publish_image();
    if (battery && step % 100 == 0) publish_battery();
    if (status_of_robot && step % 100 == 0) publish_diagnostics();
    next.tv_nsec += (long)(STEP * 1e9);
    if (next.tv_nsec >= 1000000000) next.tv_nsec -= 1000000000, ++next.tv_sec;
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &next, NULL) == EINTR && !interrupted) {}
  }
  leave(&graph);
  free(urdf);
  return 0;
}
