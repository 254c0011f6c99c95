/* SPDX-License-Identifier: Apache-2.0 */
/* How a node of ROS 2 looks on DDS: what the RMW of ROS 2 on Cyclone DDS announces, and in which topics. A program that has ROS 2 does not need this. */
#ifndef ROS_H
#define ROS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include <dds/dds.h>

#include "types.h"

enum { MAX_NODES = 16, MAX_ENDPOINTS = 64, MAX_SERVICES = 128, MAX_PARAMETERS = 16 };

/* The qualities of service that ROS 2 uses. */
enum quality { RELIABLE, SENSOR_DATA, LATCHED, SERVICE };

struct node;

/* Serves one request. Memory of the reply is from scratch().
   Both structures begin with the identity of the request, which is copied by the caller.
   Returns false if the reply is written later; its identity is then that of the request. */
typedef bool (*serve_function)(struct node* node, void* context, const void* request, void* reply);

struct service {
  dds_entity_t requests, replies;
  size_t reply_size;
  int waited; /* steps, for a client that is found in part */
  struct node* node;
  serve_function serve;
  void* context;
};

struct parameter {
  const char *name, *description;
  double* real; /* its value, or: */
  char* text;   /* of text_size bytes */
  size_t text_size;
  double from, to; /* of a real */
  bool read_only;
};

struct node {
  struct graph* graph;
  char space[128], name[64]; /* namespace "/" or "/r7", and name "base" */
  dds_guid_t readers[MAX_ENDPOINTS], writers[MAX_ENDPOINTS];
  uint32_t reader_count, writer_count;
  struct parameter parameters[MAX_PARAMETERS];
  uint32_t parameter_count;
};

struct graph {
  dds_entity_t participant, discovery;
  bool hashes; /* announces the hashes of types and describes them, as ROS 2 Iron and later; else as Humble */
  struct node nodes[MAX_NODES];
  uint32_t node_count;
  struct service services[MAX_SERVICES];
  uint32_t service_count;
  dds_entity_t parameter_events;
};

/* Joins a domain. `xml` is a configuration of Cyclone DDS, or NULL. Ends the program if that fails. */
void join(struct graph* graph, unsigned domain, const char* xml, bool hashes);
/* Adds a node. Its names are those of ROS: relative topics are in its namespace, "~/" is below the node. With its parameters it gets the services of
   parameters, and with hashes `~/get_type_description`. */
struct node* add_node(struct graph* graph, const char* space, const char* name);
void add_real(struct node* node, const char* name, double* value, double from, double to, const char* description);
void add_text(struct node* node, const char* name, char* value, size_t size, bool read_only, const char* description);
/* A writer or a reader of a topic. */
dds_entity_t publish_topic(struct node* node, const char* topic, const dds_topic_descriptor_t* type, enum quality quality);
dds_entity_t subscribe_topic(struct node* node, const char* topic, const dds_topic_descriptor_t* type, enum quality quality);
/* A service. The hash that is announced is that of the service's type, whose request and reply have these types. Returns the writer of its
   replies. */
dds_entity_t add_service(struct node* node, const char* name, const dds_topic_descriptor_t* request, const dds_topic_descriptor_t* reply,
                         serve_function serve, void* context);
/* Publishes which node has which readers and writers. */
void announce(struct graph* graph);
/* Serves all requests that have come. */
void serve_requests(struct graph* graph);
void leave(struct graph* graph);

/* Writes a sample; a failure ends the program. */
void write_sample(dds_entity_t writer, const void* sample);
/* Zeroed memory until the present request or sample is done. */
void* scratch(size_t size);
void scratch_end(void);
/* The present time; if time stands, that of the first call. */
extern bool time_stands;
void stamp_now(builtin_interfaces_msg_dds__Time_* time);

/* The hash of a type by its name in ROS, "sensor_msgs/msg/Imu"; "" for one that is not in the table. */
const char* hash_of(const char* type);
/* ~/get_type_description. */
bool describe_type(struct node* node, void* context, const void* request, void* reply);

#endif
