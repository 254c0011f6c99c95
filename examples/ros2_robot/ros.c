/* SPDX-License-Identifier: Apache-2.0 */
#include "ros.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { NAME_SIZE = 512, MAX_REQUESTS = 16 };

/* ---- memory and time ---- */

static struct block {
  struct block* next;
  max_align_t bytes[];
} * blocks;

void* scratch(size_t size) {
  struct block* block = calloc(1, sizeof *block + (size ? size : 1));
  if (!block) abort();
  block->next = blocks;
  blocks = block;
  return block->bytes;
}

void scratch_end(void) {
  while (blocks) {
    struct block* next = blocks->next;
    free(blocks);
    blocks = next;
  }
}

bool time_stands;

void stamp_now(builtin_interfaces_msg_dds__Time_* time) {
  static struct timespec now;
  if (!time_stands || now.tv_sec == 0) clock_gettime(CLOCK_REALTIME, &now);
  time->sec = (int32_t)now.tv_sec;
  time->nanosec = (uint32_t)now.tv_nsec;
}

/* ---- DDS ---- */

static dds_entity_t entity_of(dds_entity_t entity, const char* what) {
  if (entity < 0) {
    fprintf(stderr, "ros2_robot: %s: %s\n", what, dds_strretcode(-entity));
    exit(1);
  }
  return entity;
}

void write_sample(dds_entity_t writer, const void* sample) {
  const dds_return_t written = dds_write(writer, sample);
  if (written < 0 && written != DDS_RETCODE_TIMEOUT) entity_of(written, "writing");
}

static dds_qos_t* qos_of(enum quality quality, const char* user_data) {
  dds_qos_t* qos = dds_create_qos();
  const bool is_reliable = quality != SENSOR_DATA;
  dds_qset_reliability(qos, is_reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT, DDS_MSECS(100));
  dds_qset_durability(qos, quality == LATCHED ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, quality == LATCHED ? 1 : quality == SENSOR_DATA ? 5 : 10);
  if (user_data && *user_data) dds_qset_userdata(qos, user_data, strlen(user_data));
  return qos;
}

static dds_entity_t topic_of(struct graph* graph, const char* name, const dds_topic_descriptor_t* type) {
  return entity_of(dds_create_topic(graph->participant, type, name, NULL, NULL), name);
}

/* "/r7/base/max_speed" of "max_speed" (in the namespace), "~/max_speed" (below the node), "/..." (as it is). */
static void full_name(const struct node* node, const char* name, char* full) {
  const char* space = strcmp(node->space, "/") == 0 ? "" : node->space;
  if (name[0] == '/') snprintf(full, NAME_SIZE, "%s", name);
  else if (name[0] == '~') snprintf(full, NAME_SIZE, "%s/%s%s", space, node->name, name + 1);
  else snprintf(full, NAME_SIZE, "%s/%s", space, name);
}

/* "sensor_msgs/msg/Imu" of "sensor_msgs::msg::dds_::Imu_"; of a request or a response the type of the service. */
static void ros_type(const char* dds, bool is_service, char* ros) {
  const char *middle = strstr(dds, "::dds_::"), *kind = strstr(dds, "::");
  snprintf(ros, NAME_SIZE, "%.*s/%.*s/%s", (int)(kind - dds), dds, (int)(middle - kind - 2), kind + 2, middle + 8);
  ros[strlen(ros) - 1] = '\0';
  char* end = strrchr(ros, '_');
  if (is_service && end && (strcmp(end, "_Request") == 0 || strcmp(end, "_Response") == 0)) *end = '\0';
}

/* What endpoints say of themselves: "typehash=RIHS01_...;". */
static void add_hash(const struct graph* graph, const dds_topic_descriptor_t* type, bool is_service, char* user_data) {
  char name[NAME_SIZE];
  ros_type(type->m_typename, is_service, name);
  const char* hash = graph->hashes ? hash_of(name) : "";
  if (*hash) snprintf(user_data + strlen(user_data), NAME_SIZE - strlen(user_data), "typehash=%s;", hash);
}

static dds_entity_t add_writer(struct node* node, const char* topic, const dds_topic_descriptor_t* type, enum quality quality,
                               const char* user_data) {
  dds_qos_t* qos = qos_of(quality, user_data);
  const dds_entity_t writer = entity_of(dds_create_writer(node->graph->participant, topic_of(node->graph, topic, type), qos, NULL), topic);
  dds_delete_qos(qos);
  if (node->writer_count == MAX_ENDPOINTS) abort();
  dds_get_guid(writer, &node->writers[node->writer_count++]);
  return writer;
}

static dds_entity_t add_reader(struct node* node, const char* topic, const dds_topic_descriptor_t* type, enum quality quality,
                               const char* user_data) {
  dds_qos_t* qos = qos_of(quality, user_data);
  const dds_entity_t reader = entity_of(dds_create_reader(node->graph->participant, topic_of(node->graph, topic, type), qos, NULL), topic);
  dds_delete_qos(qos);
  if (node->reader_count == MAX_ENDPOINTS) abort();
  dds_get_guid(reader, &node->readers[node->reader_count++]);
  return reader;
}

/* ---- nodes ---- */

void join(struct graph* graph, unsigned domain, const char* xml, bool hashes) {
  memset(graph, 0, sizeof *graph);
  graph->hashes = hashes;
  if (xml) entity_of(dds_create_domain(domain, xml), "the domain");
  dds_qos_t* qos = dds_create_qos();
  dds_qset_userdata(qos, "enclave=/;", strlen("enclave=/;"));
  graph->participant = entity_of(dds_create_participant(domain, qos, NULL), "the participant");
  dds_delete_qos(qos);
  qos = qos_of(LATCHED, NULL);
  graph->discovery = entity_of(
      dds_create_writer(graph->participant, topic_of(graph, "ros_discovery_info", &rmw_dds_common_msg_dds__ParticipantEntitiesInfo__desc), qos, NULL),
      "ros_discovery_info");
  dds_delete_qos(qos);
}

void announce(struct graph* graph) {
  rmw_dds_common_msg_dds__ParticipantEntitiesInfo_ info = {0};
  dds_guid_t guid;
  dds_get_guid(graph->participant, &guid);
  memcpy(info.gid.data, guid.v, sizeof info.gid.data);
  rmw_dds_common_msg_dds__NodeEntitiesInfo_* nodes = scratch(MAX_NODES * sizeof *nodes);
  for (uint32_t i = 0; i < graph->node_count; ++i) {
    struct node* node = &graph->nodes[i];
    nodes[i].node_namespace = node->space;
    nodes[i].node_name = node->name;
    /* Both are 16 bytes. */
    nodes[i].reader_gid_seq._buffer = (rmw_dds_common_msg_dds__Gid_*)node->readers;
    nodes[i].reader_gid_seq._length = node->reader_count;
    nodes[i].writer_gid_seq._buffer = (rmw_dds_common_msg_dds__Gid_*)node->writers;
    nodes[i].writer_gid_seq._length = node->writer_count;
  }
  info.node_entities_info_seq._buffer = nodes;
  info.node_entities_info_seq._length = graph->node_count;
  write_sample(graph->discovery, &info);
  scratch_end();
}

/// Returns when others have been told.
void leave(struct graph* graph) {
  (void)graph;
  dds_delete(DDS_CYCLONEDDS_HANDLE);
}

dds_entity_t publish_topic(struct node* node, const char* topic, const dds_topic_descriptor_t* type, enum quality quality) {
  char name[NAME_SIZE + 2] = "rt", user_data[NAME_SIZE] = "";
  full_name(node, topic, name + 2);
  add_hash(node->graph, type, false, user_data);
  return add_writer(node, name, type, quality, user_data);
}

dds_entity_t subscribe_topic(struct node* node, const char* topic, const dds_topic_descriptor_t* type, enum quality quality) {
  char name[NAME_SIZE + 2] = "rt", user_data[NAME_SIZE] = "";
  full_name(node, topic, name + 2);
  add_hash(node->graph, type, false, user_data);
  return add_reader(node, name, type, quality, user_data);
}

dds_entity_t add_service(struct node* node, const char* name, const dds_topic_descriptor_t* request, const dds_topic_descriptor_t* reply,
                         serve_function serve, void* context) {
  struct graph* graph = node->graph;
  if (graph->service_count == MAX_SERVICES) abort();
  struct service* service = &graph->services[graph->service_count++];
  char full[NAME_SIZE], topic[NAME_SIZE + 16], user_data[NAME_SIZE] = "serviceid=";
  /* An identity that ties the two endpoints of one server together. */
  for (int i = 0; i < 16; ++i)
    snprintf(user_data + strlen(user_data), NAME_SIZE - strlen(user_data), "%s%x", i ? "." : "", (unsigned)(rand() & 0xff));
  strcat(user_data, ";");
  add_hash(graph, request, true, user_data);
  full_name(node, name, full);
  snprintf(topic, sizeof topic, "rr%sReply", full);
  service->replies = add_writer(node, topic, reply, SERVICE, user_data);
  snprintf(topic, sizeof topic, "rq%sRequest", full);
  service->requests = add_reader(node, topic, request, SERVICE, user_data);
  service->reply_size = reply->m_size;
  service->node = node;
  service->serve = serve;
  service->context = context;
  return service->replies;
}

/* A client is found by two endpoints, one after the other. A response to a client whose reader is not known yet would be lost: the request waits for it,
   half a second at most, as the RMW of ROS 2 does. */
static bool is_reached(struct service* service) {
  enum { MOST_STEPS = 50 };
  dds_subscription_matched_status_t clients = {0};
  dds_publication_matched_status_t readers = {0};
  dds_get_subscription_matched_status(service->requests, &clients);
  dds_get_publication_matched_status(service->replies, &readers);
  if (readers.current_count >= clients.current_count) service->waited = 0;
  else if (service->waited < MOST_STEPS) return ++service->waited, false;
  return true;
}

void serve_requests(struct graph* graph) {
  for (uint32_t i = 0; i < graph->service_count; ++i) {
    struct service* service = &graph->services[i];
    if (!is_reached(service)) continue;
    void* samples[MAX_REQUESTS] = {NULL};
    dds_sample_info_t infos[MAX_REQUESTS];
    const dds_return_t count = dds_take(service->requests, samples, infos, MAX_REQUESTS, MAX_REQUESTS);
    for (dds_return_t j = 0; j < count; ++j) {
      if (!infos[j].valid_data) continue;
      void* reply = scratch(service->reply_size);
      const bool is_complete = service->serve(service->node, service->context, samples[j], reply);
      memcpy(reply, samples[j], 16); /* whom it is for */
      if (is_complete) write_sample(service->replies, reply);
      scratch_end();
    }
    if (count > 0) dds_return_loan(service->requests, samples, count);
  }
}

/* ---- parameters ---- */

enum { NOT_SET = 0, REAL = 3, TEXT = 4 };

static struct parameter* find_parameter(struct node* node, const char* name) {
  for (uint32_t i = 0; i < node->parameter_count; ++i)
    if (strcmp(node->parameters[i].name, name) == 0) return &node->parameters[i];
  return NULL;
}

/* Texts are never NULL on the wire. */
static void clear_value(rcl_interfaces_msg_dds__ParameterValue_* value) {
  memset(value, 0, sizeof *value);
  value->string_value = "";
}

static void get_value(const struct parameter* parameter, rcl_interfaces_msg_dds__ParameterValue_* value) {
  clear_value(value);
  if (!parameter) return;
  value->type = parameter->real ? REAL : TEXT;
  if (parameter->real) value->double_value = *parameter->real;
  else value->string_value = parameter->text;
}

static const char* refusal_of(const struct parameter* parameter, const rcl_interfaces_msg_dds__ParameterValue_* value) {
  if (!parameter) return "there is no such parameter";
  if (parameter->read_only) return "the parameter is read-only";
  if (value->type != (parameter->real ? REAL : TEXT)) return parameter->real ? "expected a double" : "expected a string";
  if (parameter->real && !(value->double_value >= parameter->from && value->double_value <= parameter->to)) return "the value is out of range";
  if (!parameter->real && strlen(value->string_value) >= parameter->text_size) return "the text is too long";
  return NULL;
}

static void set_value(struct node* node, struct parameter* parameter, rcl_interfaces_msg_dds__Parameter_* given) {
  if (parameter->real) *parameter->real = given->value.double_value;
  else snprintf(parameter->text, parameter->text_size, "%s", given->value.string_value);
  char name[NAME_SIZE];
  rcl_interfaces_msg_dds__ParameterEvent_ event = {.node = name};
  full_name(node, node->name, name);
  stamp_now(&event.stamp);
  event.changed_parameters._buffer = given;
  event.changed_parameters._length = 1;
  write_sample(node->graph->parameter_events, &event);
}

static bool list_parameters(struct node* node, void* context, const void* request, void* reply) {
  (void)context;
  const rcl_interfaces_srv_dds__ListParameters_Request_* asked = request;
  rcl_interfaces_msg_dds__ListParametersResult_* result = &((rcl_interfaces_srv_dds__ListParameters_Response_*)reply)->result;
  result->names._buffer = scratch(node->parameter_count * sizeof(char*));
  for (uint32_t i = 0; i < node->parameter_count; ++i) {
    bool is_wanted = asked->prefixes._length == 0;
    for (uint32_t j = 0; j < asked->prefixes._length; ++j)
      is_wanted = is_wanted || strncmp(node->parameters[i].name, asked->prefixes._buffer[j], strlen(asked->prefixes._buffer[j])) == 0;
    if (is_wanted) result->names._buffer[result->names._length++] = (char*)node->parameters[i].name;
  }
  return true;
}

static bool get_parameters(struct node* node, void* context, const void* request, void* reply) {
  (void)context;
  const rcl_interfaces_srv_dds__GetParameters_Request_* asked = request;
  rcl_interfaces_srv_dds__GetParameters_Response_* response = reply;
  response->values._buffer = scratch(asked->names._length * sizeof *response->values._buffer);
  response->values._length = asked->names._length;
  for (uint32_t i = 0; i < asked->names._length; ++i) get_value(find_parameter(node, asked->names._buffer[i]), &response->values._buffer[i]);
  return true;
}

static bool get_parameter_types(struct node* node, void* context, const void* request, void* reply) {
  (void)context;
  const rcl_interfaces_srv_dds__GetParameterTypes_Request_* asked = request;
  rcl_interfaces_srv_dds__GetParameterTypes_Response_* response = reply;
  response->types._buffer = scratch(asked->names._length);
  response->types._length = asked->names._length;
  for (uint32_t i = 0; i < asked->names._length; ++i) {
    const struct parameter* parameter = find_parameter(node, asked->names._buffer[i]);
    response->types._buffer[i] = !parameter ? NOT_SET : parameter->real ? REAL : TEXT;
  }
  return true;
}

static bool describe_parameters(struct node* node, void* context, const void* request, void* reply) {
  (void)context;
  const rcl_interfaces_srv_dds__DescribeParameters_Request_* asked = request;
  rcl_interfaces_srv_dds__DescribeParameters_Response_* response = reply;
  response->descriptors._buffer = scratch(asked->names._length * sizeof *response->descriptors._buffer);
  response->descriptors._length = asked->names._length;
  for (uint32_t i = 0; i < asked->names._length; ++i) {
    const struct parameter* parameter = find_parameter(node, asked->names._buffer[i]);
    rcl_interfaces_msg_dds__ParameterDescriptor_* descriptor = &response->descriptors._buffer[i];
    descriptor->name = asked->names._buffer[i];
    descriptor->description = descriptor->additional_constraints = "";
    if (!parameter) continue;
    descriptor->type = parameter->real ? REAL : TEXT;
    descriptor->description = (char*)parameter->description;
    descriptor->read_only = parameter->read_only;
    if (!parameter->real) continue;
    descriptor->floating_point_range._buffer = scratch(sizeof *descriptor->floating_point_range._buffer);
    descriptor->floating_point_range._length = 1;
    descriptor->floating_point_range._buffer->from_value = parameter->from;
    descriptor->floating_point_range._buffer->to_value = parameter->to;
  }
  return true;
}

static bool set_parameters(struct node* node, void* context, const void* request, void* reply) {
  (void)context;
  const rcl_interfaces_srv_dds__SetParameters_Request_* asked = request;
  rcl_interfaces_srv_dds__SetParameters_Response_* response = reply;
  response->results._buffer = scratch(asked->parameters._length * sizeof *response->results._buffer);
  response->results._length = asked->parameters._length;
  for (uint32_t i = 0; i < asked->parameters._length; ++i) {
    rcl_interfaces_msg_dds__Parameter_* given = &asked->parameters._buffer[i];
    struct parameter* parameter = find_parameter(node, given->name);
    const char* refusal = refusal_of(parameter, &given->value);
    response->results._buffer[i].successful = !refusal;
    response->results._buffer[i].reason = refusal ? (char*)refusal : "";
    if (!refusal) set_value(node, parameter, given);
  }
  return true;
}

static bool set_parameters_atomically(struct node* node, void* context, const void* request, void* reply) {
  (void)context;
  const rcl_interfaces_srv_dds__SetParametersAtomically_Request_* asked = request;
  rcl_interfaces_msg_dds__SetParametersResult_* result = &((rcl_interfaces_srv_dds__SetParametersAtomically_Response_*)reply)->result;
  const char* refusal = NULL;
  for (uint32_t i = 0; i < asked->parameters._length && !refusal; ++i)
    refusal = refusal_of(find_parameter(node, asked->parameters._buffer[i].name), &asked->parameters._buffer[i].value);
  for (uint32_t i = 0; i < asked->parameters._length && !refusal; ++i)
    set_value(node, find_parameter(node, asked->parameters._buffer[i].name), &asked->parameters._buffer[i]);
  result->successful = !refusal;
  result->reason = refusal ? (char*)refusal : "";
  return true;
}

static struct parameter* add_parameter(struct node* node, const char* name, const char* description) {
  if (node->parameter_count == MAX_PARAMETERS) abort();
  struct parameter* parameter = &node->parameters[node->parameter_count++];
  parameter->name = name;
  parameter->description = description;
  return parameter;
}

void add_real(struct node* node, const char* name, double* value, double from, double to, const char* description) {
  struct parameter* parameter = add_parameter(node, name, description);
  parameter->real = value;
  parameter->from = from;
  parameter->to = to;
}

void add_text(struct node* node, const char* name, char* value, size_t size, bool read_only, const char* description) {
  struct parameter* parameter = add_parameter(node, name, description);
  parameter->text = value;
  parameter->text_size = size;
  parameter->read_only = read_only;
}

struct node* add_node(struct graph* graph, const char* space, const char* name) {
  if (graph->node_count == MAX_NODES) abort();
  struct node* node = &graph->nodes[graph->node_count++];
  node->graph = graph;
  snprintf(node->space, sizeof node->space, "%s", *space ? space : "/");
  snprintf(node->name, sizeof node->name, "%s", name);
  graph->parameter_events = publish_topic(node, "/parameter_events", &rcl_interfaces_msg_dds__ParameterEvent__desc, RELIABLE);
#define PARAMETER_SERVICE(name, Type, serve) \
  add_service(node, "~/" name, &rcl_interfaces_srv_dds__##Type##_Request__desc, &rcl_interfaces_srv_dds__##Type##_Response__desc, serve, NULL)
  PARAMETER_SERVICE("list_parameters", ListParameters, list_parameters);
  PARAMETER_SERVICE("get_parameters", GetParameters, get_parameters);
  PARAMETER_SERVICE("get_parameter_types", GetParameterTypes, get_parameter_types);
  PARAMETER_SERVICE("describe_parameters", DescribeParameters, describe_parameters);
  PARAMETER_SERVICE("set_parameters", SetParameters, set_parameters);
  PARAMETER_SERVICE("set_parameters_atomically", SetParametersAtomically, set_parameters_atomically);
  if (graph->hashes)
    add_service(node, "~/get_type_description", &type_description_interfaces_srv_dds__GetTypeDescription_Request__desc,
                &type_description_interfaces_srv_dds__GetTypeDescription_Response__desc, describe_type, NULL);
  return node;
}
