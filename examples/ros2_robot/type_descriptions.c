/* SPDX-License-Identifier: Apache-2.0 */
/* What ROS 2 generates for each type: its hash (REP 2011), and what ~/get_type_description says of those that not every installation has. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "ros.h"

static const struct {
  const char *type, *hash;
} hashes[] = {
    {"action_msgs/msg/GoalStatusArray", "RIHS01_6c1684b00f177d37438febe6e709fc4e2b0d4248dca4854946f9ed8b30cda83e"},
    {"action_msgs/srv/CancelGoal", "RIHS01_573d8b0a534451d7bc2ac8c5ffde8ac14b8593b7001175d0cd6516dcbeb8689a"},
    {"control_msgs/action/FollowJointTrajectory", "RIHS01_738ebcb7a2d7cfa42f9f1001cc99ce3a4383d1cfe508015d9be8485e4b1c66f6"},
    {"control_msgs/action/FollowJointTrajectory_FeedbackMessage", "RIHS01_80398fcb9674a79081a9906e2ccf0c804dd7cb15e22e362e606ee87186beab71"},
    {"control_msgs/action/FollowJointTrajectory_GetResult", "RIHS01_e3ceb38e3e1867c8dc0f46014df26e90eb93422f27e9e97f936e07f94be4bc8b"},
    {"control_msgs/action/FollowJointTrajectory_SendGoal", "RIHS01_b13789dddc325a7a962825c45e28c77d37237ec129dd0c34dc5994562938c57f"},
    {"diagnostic_msgs/msg/DiagnosticArray", "RIHS01_5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e"},
    {"geometry_msgs/msg/Twist", "RIHS01_9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a"},
    {"lifecycle_msgs/msg/TransitionEvent", "RIHS01_d5f8873a2f0146498f812d7885c7327ce27e463d36811d8792f35ee38c0d6c38"},
    {"lifecycle_msgs/srv/ChangeState", "RIHS01_356fe34f0475a43acf54542013af4167b0e729f77ea22ffb045c6ad8e20668e5"},
    {"lifecycle_msgs/srv/GetAvailableStates", "RIHS01_00a07d79d2207d71e81a8cbc1880e5d924cc16d4688ea8e8e06e443dc8f8aa1d"},
    {"lifecycle_msgs/srv/GetAvailableTransitions", "RIHS01_59b7ecefce0982a8a844b9f2c4f14764c1c4543cc55e72924e2aa4adad83e9bc"},
    {"lifecycle_msgs/srv/GetState", "RIHS01_800a0a5aae599782b02932de0caf563f6dc4e7e94b794eadde075ba2cbef9795"},
    {"nav_msgs/msg/OccupancyGrid", "RIHS01_8d348150c12913a31ee0ec170fbf25089e4745d17035792a1ba94d6f0bc0cfc7"},
    {"nav_msgs/msg/Odometry", "RIHS01_3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0"},
    {"rcl_interfaces/msg/ParameterEvent", "RIHS01_043e627780fcad87a22d225bc2a037361dba713fca6a6b9f4b869a5aa0393204"},
    {"rcl_interfaces/srv/DescribeParameters", "RIHS01_845b484d71eb0673dae682f2e3ba3c4851a65a3dcfb97bddd82c5b57e91e4cff"},
    {"rcl_interfaces/srv/GetParameterTypes", "RIHS01_da199c878688b3e530bdfe3ca8f74cb9fa0c303101e980a9e8f260e25e1c80ca"},
    {"rcl_interfaces/srv/GetParameters", "RIHS01_bf9803d5c74cf989a5de3e0c2e99444599a627c7ff75f97b8c05b01003675cbc"},
    {"rcl_interfaces/srv/ListParameters", "RIHS01_3e6062bfbb27bfb8730d4cef2558221f51a11646d78e7bb30a1e83afac3aad9d"},
    {"rcl_interfaces/srv/SetParameters", "RIHS01_56eed9a67e169f9cb6c1f987bc88f868c14a8fc9f743a263bc734c154015d7e0"},
    {"rcl_interfaces/srv/SetParametersAtomically", "RIHS01_0e192ef259c07fc3c07a13191d27002222e65e00ccec653ca05e856f79285fcd"},
    {"ros2_robot/srv/MoveGripper", "RIHS01_7276c3c9584c4c99a70ae3d1502e88b872ad82cd6b1635fcf7b5136536d5c2b7"},
    {"sensor_msgs/msg/BatteryState", "RIHS01_4bee5dfce981c98faa6828b868307a0a73f992ed0789f374ee96c8f840e69741"},
    {"sensor_msgs/msg/Image", "RIHS01_d31d41a9a4c4bc8eae9be757b0beed306564f7526c88ea6a4588fb9582527d47"},
    {"sensor_msgs/msg/JointState", "RIHS01_a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e"},
    {"sensor_msgs/msg/LaserScan", "RIHS01_64c191398013af96509d518dac71d5164f9382553fce5c1f8cca5be7924bd828"},
    {"std_msgs/msg/String", "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"},
    {"std_srvs/srv/Trigger", "RIHS01_eeff2cd6fa5ad9d27cdf4dec64818317839b62f212a91e6b5304b634b2062c5f"},
    {"tf2_msgs/msg/TFMessage", "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"},
};

/* Types that are described, and those in them: "type name; type name", as in a .msg. */
static const struct {
  const char *type, *fields;
} descriptions[] = {
    {"builtin_interfaces/msg/Duration", "int32 sec; uint32 nanosec"},
    {"builtin_interfaces/msg/Time", "int32 sec; uint32 nanosec"},
    {"control_msgs/action/FollowJointTrajectory",
     "control_msgs/action/FollowJointTrajectory_Goal goal; control_msgs/action/FollowJointTrajectory_Result result; "
     "control_msgs/action/FollowJointTrajectory_Feedback feedback; control_msgs/action/FollowJointTrajectory_SendGoal send_goal_service; "
     "control_msgs/action/FollowJointTrajectory_GetResult get_result_service; control_msgs/action/FollowJointTrajectory_FeedbackMessage "
     "feedback_message"},
    {"control_msgs/action/FollowJointTrajectory_Feedback",
     "std_msgs/msg/Header header; string[] joint_names; trajectory_msgs/msg/JointTrajectoryPoint desired; trajectory_msgs/msg/JointTrajectoryPoint "
     "actual; trajectory_msgs/msg/JointTrajectoryPoint error; string[] multi_dof_joint_names; trajectory_msgs/msg/MultiDOFJointTrajectoryPoint "
     "multi_dof_desired; trajectory_msgs/msg/MultiDOFJointTrajectoryPoint multi_dof_actual; trajectory_msgs/msg/MultiDOFJointTrajectoryPoint "
     "multi_dof_error"},
    {"control_msgs/action/FollowJointTrajectory_FeedbackMessage",
     "unique_identifier_msgs/msg/UUID goal_id; control_msgs/action/FollowJointTrajectory_Feedback feedback"},
    {"control_msgs/action/FollowJointTrajectory_GetResult",
     "control_msgs/action/FollowJointTrajectory_GetResult_Request request_message; control_msgs/action/FollowJointTrajectory_GetResult_Response "
     "response_message; control_msgs/action/FollowJointTrajectory_GetResult_Event event_message"},
    {"control_msgs/action/FollowJointTrajectory_GetResult_Event",
     "service_msgs/msg/ServiceEventInfo info; control_msgs/action/FollowJointTrajectory_GetResult_Request[<=1] request; "
     "control_msgs/action/FollowJointTrajectory_GetResult_Response[<=1] response"},
    {"control_msgs/action/FollowJointTrajectory_GetResult_Request", "unique_identifier_msgs/msg/UUID goal_id"},
    {"control_msgs/action/FollowJointTrajectory_GetResult_Response", "int8 status; control_msgs/action/FollowJointTrajectory_Result result"},
    {"control_msgs/action/FollowJointTrajectory_Goal",
     "trajectory_msgs/msg/JointTrajectory trajectory; trajectory_msgs/msg/MultiDOFJointTrajectory multi_dof_trajectory; "
     "control_msgs/msg/JointTolerance[] path_tolerance; control_msgs/msg/JointComponentTolerance[] component_path_tolerance; "
     "control_msgs/msg/JointTolerance[] goal_tolerance; control_msgs/msg/JointComponentTolerance[] component_goal_tolerance; "
     "builtin_interfaces/msg/Duration goal_time_tolerance"},
    {"control_msgs/action/FollowJointTrajectory_Result", "int32 error_code; string error_string"},
    {"control_msgs/action/FollowJointTrajectory_SendGoal",
     "control_msgs/action/FollowJointTrajectory_SendGoal_Request request_message; control_msgs/action/FollowJointTrajectory_SendGoal_Response "
     "response_message; control_msgs/action/FollowJointTrajectory_SendGoal_Event event_message"},
    {"control_msgs/action/FollowJointTrajectory_SendGoal_Event",
     "service_msgs/msg/ServiceEventInfo info; control_msgs/action/FollowJointTrajectory_SendGoal_Request[<=1] request; "
     "control_msgs/action/FollowJointTrajectory_SendGoal_Response[<=1] response"},
    {"control_msgs/action/FollowJointTrajectory_SendGoal_Request",
     "unique_identifier_msgs/msg/UUID goal_id; control_msgs/action/FollowJointTrajectory_Goal goal"},
    {"control_msgs/action/FollowJointTrajectory_SendGoal_Response", "bool accepted; builtin_interfaces/msg/Time stamp"},
    {"control_msgs/msg/JointComponentTolerance", "string joint_name; uint16 component; float64 position; float64 velocity; float64 acceleration"},
    {"control_msgs/msg/JointTolerance", "string name; float64 position; float64 velocity; float64 acceleration"},
    {"geometry_msgs/msg/Quaternion", "float64 x; float64 y; float64 z; float64 w"},
    {"geometry_msgs/msg/Transform", "geometry_msgs/msg/Vector3 translation; geometry_msgs/msg/Quaternion rotation"},
    {"geometry_msgs/msg/Twist", "geometry_msgs/msg/Vector3 linear; geometry_msgs/msg/Vector3 angular"},
    {"geometry_msgs/msg/Vector3", "float64 x; float64 y; float64 z"},
    {"ros2_robot/srv/MoveGripper",
     "ros2_robot/srv/MoveGripper_Request request_message; ros2_robot/srv/MoveGripper_Response response_message; ros2_robot/srv/MoveGripper_Event "
     "event_message"},
    {"ros2_robot/srv/MoveGripper_Event",
     "service_msgs/msg/ServiceEventInfo info; ros2_robot/srv/MoveGripper_Request[<=1] request; ros2_robot/srv/MoveGripper_Response[<=1] response"},
    {"ros2_robot/srv/MoveGripper_Request", "float64 width; float64 max_force"},
    {"ros2_robot/srv/MoveGripper_Response", "bool reached; float64 width; string message"},
    {"service_msgs/msg/ServiceEventInfo", "uint8 event_type; builtin_interfaces/msg/Time stamp; uint8[16] client_gid; int64 sequence_number"},
    {"std_msgs/msg/Header", "builtin_interfaces/msg/Time stamp; string frame_id"},
    {"trajectory_msgs/msg/JointTrajectory", "std_msgs/msg/Header header; string[] joint_names; trajectory_msgs/msg/JointTrajectoryPoint[] points"},
    {"trajectory_msgs/msg/JointTrajectoryPoint",
     "float64[] positions; float64[] velocities; float64[] accelerations; float64[] effort; builtin_interfaces/msg/Duration time_from_start"},
    {"trajectory_msgs/msg/MultiDOFJointTrajectory",
     "std_msgs/msg/Header header; string[] joint_names; trajectory_msgs/msg/MultiDOFJointTrajectoryPoint[] points"},
    {"trajectory_msgs/msg/MultiDOFJointTrajectoryPoint",
     "geometry_msgs/msg/Transform[] transforms; geometry_msgs/msg/Twist[] velocities; geometry_msgs/msg/Twist[] accelerations; "
     "builtin_interfaces/msg/Duration time_from_start"},
    {"unique_identifier_msgs/msg/UUID", "uint8[16] uuid"},
};

typedef type_description_interfaces_msg_dds__IndividualTypeDescription_ Individual;
typedef type_description_interfaces_msg_dds__Field_ Field;

enum { MAX_REFERENCED = 64, MAX_FIELDS = 32 };
enum { NESTED = 1, ARRAY = 48, BOUNDED_SEQUENCE = 96, SEQUENCE = 144 };

const char* hash_of(const char* type) {
  for (size_t i = 0; i < sizeof hashes / sizeof *hashes; ++i)
    if (strcmp(hashes[i].type, type) == 0) return hashes[i].hash;
  return "";
}

static const char* fields_of(const char* type) {
  for (size_t i = 0; i < sizeof descriptions / sizeof *descriptions; ++i)
    if (strcmp(descriptions[i].type, type) == 0) return descriptions[i].fields;
  return NULL;
}

/* The number of a primitive type in type_description_interfaces/msg/FieldType. */
static uint8_t number_of(const char* type) {
  static const struct {
    const char* name;
    uint8_t number;
  } numbers[] = {{"int8", 2},   {"uint8", 3},    {"int16", 4},    {"uint16", 5}, {"int32", 6}, {"uint32", 7},  {"int64", 8},
                 {"uint64", 9}, {"float32", 10}, {"float64", 11}, {"bool", 15},  {"byte", 16}, {"string", 17}, {"wstring", 18}};
  for (size_t i = 0; i < sizeof numbers / sizeof *numbers; ++i)
    if (strcmp(numbers[i].name, type) == 0) return numbers[i].number;
  return NESTED;
}

static char* copy(const char* text, size_t size) {
  char* copied = scratch(size + 1);
  memcpy(copied, text, size);
  return copied;
}

/* Reads "float64[36] covariance". */
static void describe_field(const char* text, size_t size, Field* field) {
  const char *space = memchr(text, ' ', size), *bracket = memchr(text, '[', (size_t)(space - text));
  const char* type = copy(text, (size_t)((bracket ? bracket : space) - text));
  field->name = copy(space + 1, size - (size_t)(space + 1 - text));
  field->default_value = field->type.nested_type_name = "";
  field->type.type_id = number_of(type);
  if (field->type.type_id == NESTED) field->type.nested_type_name = (char*)type;
  if (!bracket) return;
  const bool is_bounded = bracket[1] == '<';
  field->type.capacity = strtoull(bracket + (is_bounded ? 3 : 1), NULL, 10);
  field->type.type_id = (uint8_t)(field->type.type_id + (bracket[1] == ']' ? SEQUENCE : is_bounded ? BOUNDED_SEQUENCE : ARRAY));
}

static void describe_one(const char* type, Individual* description) {
  description->type_name = (char*)type;
  description->fields._buffer = scratch(MAX_FIELDS * sizeof *description->fields._buffer);
  for (const char* text = fields_of(type); text && *text;) {
    const char* end = strchr(text, ';');
    const size_t size = end ? (size_t)(end - text) : strlen(text);
    if (description->fields._length == MAX_FIELDS) abort();
    describe_field(text, size, &description->fields._buffer[description->fields._length++]);
    text += size + (end ? 2 : 0);
  }
}

/* Adds the types of the fields, and theirs, in order of their names. */
static void add_referenced(const Individual* of, type_description_interfaces_msg_dds__TypeDescription_* all) {
  for (uint32_t i = 0; i < of->fields._length; ++i) {
    const char* type = of->fields._buffer[i].type.nested_type_name;
    if (!*type) continue;
    uint32_t at = 0;
    while (at < all->referenced_type_descriptions._length && strcmp(all->referenced_type_descriptions._buffer[at].type_name, type) < 0) ++at;
    if (at < all->referenced_type_descriptions._length && strcmp(all->referenced_type_descriptions._buffer[at].type_name, type) == 0) continue;
    if (all->referenced_type_descriptions._length == MAX_REFERENCED) abort();
    Individual* place = &all->referenced_type_descriptions._buffer[at];
    memmove(place + 1, place, (all->referenced_type_descriptions._length++ - at) * sizeof *place);
    memset(place, 0, sizeof *place);
    describe_one(type, place);
    const Individual added = *place;
    add_referenced(&added, all);
  }
}

bool describe_type(struct node* node, void* context, const void* request, void* reply) {
  (void)node;
  (void)context;
  const type_description_interfaces_srv_dds__GetTypeDescription_Request_* asked = request;
  type_description_interfaces_srv_dds__GetTypeDescription_Response_* response = reply;
  response->failure_reason = "";
  response->type_description.type_description.type_name = "";
  if (!fields_of(asked->type_name) || strcmp(hash_of(asked->type_name), asked->type_hash) != 0) {
    response->failure_reason = "Type not currently in use by this node";
    return true;
  }
  response->successful = true;
  describe_one(asked->type_name, &response->type_description.type_description);
  response->type_description.referenced_type_descriptions._buffer = scratch((MAX_REFERENCED + 1) * sizeof(Individual));
  add_referenced(&response->type_description.type_description, &response->type_description);
  return true;
}
