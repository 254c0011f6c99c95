// SPDX-License-Identifier: Apache-2.0
// A stranger for the tests of the graph: Eclipse Cyclone DDS with types of idlc, and the header form of services, as RMW's Cyclone has it.
//   cyclone_peer DOMAIN LEASE_MS [USER_DATA]
// It reads commands, a line each, and responds with lines:
//   writer NAME TOPIC reliable|best_effort transient_local|volatile [USER_DATA]     write NAME TEXT [TIMES [MILLISECONDS]]     readers NAME -> readers NAME COUNT
//   reader NAME TOPIC reliable|best_effort transient_local|volatile [USER_DATA]     -> got NAME TEXT
//   remove NAME     node /NAME     serve_add /SERVICE [plain|silent]     serve_fibonacci /ACTION     serve_parameters /NODE     endpoints COUNT PREFIX    quit
#include <dds/dds.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <iostream>
#include <list>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "graph_peer.h"

namespace {

dds_entity_t participant = 0;
std::map<std::string, dds_entity_t> topics, entities;
std::vector<dds_entity_t> readers, writers;
std::vector<std::function<void()>> work;
std::string node;

void say(const std::string& line) { std::cout << line << std::endl; }
dds_entity_t check(dds_entity_t entity, const char* what) {
  if (entity < 0) {
    say(std::string("failed ") + what + ": " + dds_strretcode(-entity));
    std::exit(1);
  }
  return entity;
}

dds_entity_t topic(const dds_topic_descriptor_t& type, const std::string& name) {
  dds_entity_t& found = topics[name];
  if (found == 0) found = check(dds_create_topic(participant, &type, name.c_str(), nullptr, nullptr), "topic");
  return found;
}
dds_qos_t* qos_of(bool reliable, bool transient_local, const std::string& user_data) {
  dds_qos_t* const qos = dds_create_qos();
  dds_qset_reliability(qos, reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT, DDS_SECS(1));
  dds_qset_durability(qos, transient_local ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 64);
  if (!user_data.empty()) dds_qset_userdata(qos, user_data.data(), user_data.size());
  return qos;
}
dds_entity_t make(bool is_writer, const dds_topic_descriptor_t& type, const std::string& name, bool reliable = true, bool transient_local = false,
                  const std::string& user_data = {}) {
  dds_qos_t* const qos = qos_of(reliable, transient_local, user_data);
  const dds_entity_t of = topic(type, name);
  const dds_entity_t entity =
      check(is_writer ? dds_create_writer(participant, of, qos, nullptr) : dds_create_reader(participant, of, qos, nullptr), "endpoint");
  dds_delete_qos(qos);
  (is_writer ? writers : readers).push_back(entity);
  return entity;
}

template <class T, class F>
void take(dds_entity_t reader, F&& f) {
  for (;;) {
    void* sample = nullptr;
    dds_sample_info_t info;
    const dds_return_t count = dds_take(reader, &sample, &info, 1, 1);
    if (count <= 0) return;
    if (info.valid_data) f(*static_cast<T*>(sample));
    dds_return_loan(reader, &sample, count);
  }
}

/// ros_discovery_info of all endpoints under one node.
void announce() {
  static dds_entity_t writer = 0;
  if (writer == 0) writer = make(true, rmw_dds_common_msg_dds__ParticipantEntitiesInfo__desc, "ros_discovery_info", true, true);
  const auto gids = [](const std::vector<dds_entity_t>& list) {
    std::vector<rmw_dds_common_msg_dds__Gid_> all;
    for (const dds_entity_t entity : list) {
      dds_guid_t guid;
      if (dds_get_guid(entity, &guid) != 0) continue;
      all.emplace_back();
      std::memcpy(all.back().data, guid.v, 16);
    }
    return all;
  };
  auto read = gids(readers), written = gids(writers);
  const auto slash = node.rfind('/');
  std::string space = slash == 0 ? "/" : node.substr(0, slash), name = node.substr(slash + 1);
  rmw_dds_common_msg_dds__NodeEntitiesInfo_ one{};
  one.node_namespace = space.data();
  one.node_name = name.data();
  one.reader_gid_seq._buffer = read.data();
  one.reader_gid_seq._length = one.reader_gid_seq._maximum = static_cast<uint32_t>(read.size());
  one.writer_gid_seq._buffer = written.data();
  one.writer_gid_seq._length = one.writer_gid_seq._maximum = static_cast<uint32_t>(written.size());
  rmw_dds_common_msg_dds__ParticipantEntitiesInfo_ info{};
  dds_guid_t guid;
  dds_get_guid(participant, &guid);
  std::memcpy(info.gid.data, guid.v, 16);
  info.node_entities_info_seq._buffer = &one;
  info.node_entities_info_seq._length = info.node_entities_info_seq._maximum = 1;
  check(dds_write(writer, &info), "write");
}

std::string service_id() {
  static int count = 0;
  char text[64];
  dds_guid_t guid;
  dds_get_guid(participant, &guid);
  std::string id = "serviceid=";
  for (int i = 0; i < 12; ++i) {
    std::snprintf(text, sizeof text, "%02x.", guid.v[i]);
    id += text;
  }
  std::snprintf(text, sizeof text, "0.0.0.%x;", ++count);
  return id + text;
}

/// A service whose `respond` fills the response but for the header.
template <class Request, class Response, class F>
void serve(const std::string& service, const dds_topic_descriptor_t& request, const dds_topic_descriptor_t& response, const std::string& user_data,
           F respond) {
  const dds_entity_t reader = make(false, request, "rq" + service + "Request", true, false, user_data);
  const dds_entity_t writer = make(true, response, "rr" + service + "Reply", true, false, user_data);
  work.push_back([=] {
    take<Request>(reader, [&](const Request& asked) {
      Response answer{};
      answer.client = asked.client;
      answer.number = asked.number;
      respond(asked, answer, [&] { check(dds_write(writer, &answer), "write"); });
    });
  });
}

struct FibonacciGoal {
  std::string id;
  int order = 0, step = 0;
  bool cancelling = false;
  int status = 2;
  std::vector<int32_t> numbers{};
  std::vector<std::pair<uint64_t, int64_t>> waiting{};  ///< client and number of requests of its result
};
std::list<FibonacciGoal> goals;

void serve_fibonacci(const std::string& action) {
  using namespace std;
  const dds_entity_t feedback = make(true, example_interfaces_action_dds__Fibonacci_FeedbackMessage__desc, "rt" + action + "/_action/feedback");
  const dds_entity_t status = make(true, action_msgs_msg_dds__GoalStatusArray__desc, "rt" + action + "/_action/status", true, true);
  const auto publish_status = [status] {
    vector<action_msgs_msg_dds__GoalStatus_> all;
    for (const FibonacciGoal& goal : goals) {
      all.emplace_back();
      memcpy(all.back().goal_info.goal_id, goal.id.data(), 16);
      all.back().status = static_cast<uint8_t>(goal.status);
    }
    action_msgs_msg_dds__GoalStatusArray_ array{};
    array.status_list._buffer = all.data();
    array.status_list._length = array.status_list._maximum = static_cast<uint32_t>(all.size());
    dds_write(status, &array);
  };
  serve<example_interfaces_action_dds__Fibonacci_SendGoal_Request_, example_interfaces_action_dds__Fibonacci_SendGoal_Response_>(
      action + "/_action/send_goal", example_interfaces_action_dds__Fibonacci_SendGoal_Request__desc,
      example_interfaces_action_dds__Fibonacci_SendGoal_Response__desc, service_id(), [=](const auto& asked, auto& answer, auto&& send) {
        answer.accepted = asked.order >= 0;
        send();
        say("goal " + to_string(asked.order));
        if (!answer.accepted) return;
        FibonacciGoal goal;
        goal.id.assign(reinterpret_cast<const char*>(asked.goal_id), 16);
        goal.order = asked.order;
        goals.push_back(move(goal));
        publish_status();
      });
  serve<example_interfaces_action_dds__Fibonacci_GetResult_Request_, example_interfaces_action_dds__Fibonacci_GetResult_Response_>(
      action + "/_action/get_result", example_interfaces_action_dds__Fibonacci_GetResult_Request__desc,
      example_interfaces_action_dds__Fibonacci_GetResult_Response__desc, service_id(), [=](const auto& asked, auto&, auto&&) {
        const string id(reinterpret_cast<const char*>(asked.goal_id), 16);
        for (FibonacciGoal& goal : goals)
          if (goal.id == id) goal.waiting.emplace_back(asked.client, asked.number);
      });
  const dds_entity_t results = writers.back();
  serve<action_msgs_srv_dds__CancelGoal_Request_, action_msgs_srv_dds__CancelGoal_Response_>(
      action + "/_action/cancel_goal", action_msgs_srv_dds__CancelGoal_Request__desc, action_msgs_srv_dds__CancelGoal_Response__desc, service_id(),
      [=](const auto& asked, auto& answer, auto&& send) {
        const string id(reinterpret_cast<const char*>(asked.goal_info.goal_id), 16);
        auto info = asked.goal_info;
        for (FibonacciGoal& goal : goals) {
          if (goal.id != id || goal.status > 3) continue;
          goal.cancelling = true;
          goal.status = 3;
          answer.goals_canceling._buffer = &info;
          answer.goals_canceling._length = answer.goals_canceling._maximum = 1;
        }
        send();
        publish_status();
        say("cancel");
      });
  work.push_back([=] {
    for (auto goal = goals.begin(); goal != goals.end(); ++goal) {
      if (goal->status > 3) {
        for (const auto& [client, number] : goal->waiting) {
          example_interfaces_action_dds__Fibonacci_GetResult_Response_ answer{};
          answer.client = client;
          answer.number = number;
          answer.status = static_cast<uint8_t>(goal->status);
          answer.numbers._buffer = goal->numbers.data();
          answer.numbers._length = answer.numbers._maximum = static_cast<uint32_t>(goal->numbers.size());
          dds_write(results, &answer);
        }
        goal->waiting.clear();
        continue;
      }
      if (goal->waiting.empty() && !goal->cancelling) continue;  // nobody waits for its result yet
      if (goal->cancelling) {
        goal->status = 5;
        publish_status();
        continue;
      }
      if (goal->order >= 1000) {  // runs until it is cancelled
        if (goal->numbers.size() >= 2) continue;
      } else if (goal->step >= goal->order) {
        goal->status = 4;
        publish_status();
        continue;
      }
      const size_t n = goal->numbers.size();
      goal->numbers.push_back(n < 2 ? 1 : goal->numbers[n - 1] + goal->numbers[n - 2]);
      ++goal->step;
      example_interfaces_action_dds__Fibonacci_FeedbackMessage_ message{};
      memcpy(message.goal_id, goal->id.data(), 16);
      message.numbers._buffer = goal->numbers.data();
      message.numbers._length = message.numbers._maximum = static_cast<uint32_t>(goal->numbers.size());
      dds_write(feedback, &message);
    }
  });
}

double speed = 1;
char speed_name[] = "speed", name_name[] = "name", robot[] = "r7", empty[] = "", text[] = "how fast it drives", reason[] = "too fast";
char* names[] = {speed_name, name_name};

/// Two parameters: speed in [0, 2] with step 0.5, and name, which is read-only.
void serve_parameters(const std::string& of) {
  const dds_entity_t events = make(true, rcl_interfaces_msg_dds__ParameterEvent__desc, "rt/parameter_events");
  serve<rcl_interfaces_srv_dds__ListParameters_Request_, rcl_interfaces_srv_dds__ListParameters_Response_>(
      of + "/list_parameters", rcl_interfaces_srv_dds__ListParameters_Request__desc, rcl_interfaces_srv_dds__ListParameters_Response__desc,
      service_id(), [](const auto&, auto& answer, auto&& send) {
        answer.names._buffer = names;
        answer.names._length = answer.names._maximum = 2;
        send();
      });
  const auto value_of = [](const std::string& name) {
    rcl_interfaces_msg_dds__ParameterValue_ value{};
    value.string_value = empty;
    if (name == "speed") {
      value.type = 3;
      value.double_value = speed;
    } else if (name == "name") {
      value.type = 4;
      value.string_value = robot;
    }
    return value;
  };
  serve<rcl_interfaces_srv_dds__GetParameters_Request_, rcl_interfaces_srv_dds__GetParameters_Response_>(
      of + "/get_parameters", rcl_interfaces_srv_dds__GetParameters_Request__desc, rcl_interfaces_srv_dds__GetParameters_Response__desc, service_id(),
      [value_of](const auto& asked, auto& answer, auto&& send) {
        std::vector<rcl_interfaces_msg_dds__ParameterValue_> values;
        for (uint32_t i = 0; i < asked.names._length; ++i) values.push_back(value_of(asked.names._buffer[i]));
        answer.values._buffer = values.data();
        answer.values._length = answer.values._maximum = static_cast<uint32_t>(values.size());
        send();
      });
  serve<rcl_interfaces_srv_dds__DescribeParameters_Request_, rcl_interfaces_srv_dds__DescribeParameters_Response_>(
      of + "/describe_parameters", rcl_interfaces_srv_dds__DescribeParameters_Request__desc,
      rcl_interfaces_srv_dds__DescribeParameters_Response__desc, service_id(), [](const auto& asked, auto& answer, auto&& send) {
        std::vector<rcl_interfaces_msg_dds__ParameterDescriptor_> descriptors;
        static rcl_interfaces_msg_dds__FloatingPointRange_ range{0, 2, 0.5};
        for (uint32_t i = 0; i < asked.names._length; ++i) {
          descriptors.emplace_back();
          auto& one = descriptors.back();
          std::memset(&one, 0, sizeof one);
          one.name = asked.names._buffer[i];
          one.description = one.additional_constraints = empty;
          const bool is_speed = std::strcmp(one.name, "speed") == 0;
          one.type = is_speed ? 3 : 4;
          one.read_only = !is_speed;
          if (!is_speed) continue;
          one.description = text;
          one.floating_point_range._buffer = &range;
          one.floating_point_range._length = one.floating_point_range._maximum = 1;
        }
        answer.descriptors._buffer = descriptors.data();
        answer.descriptors._length = answer.descriptors._maximum = static_cast<uint32_t>(descriptors.size());
        send();
      });
  serve<rcl_interfaces_srv_dds__SetParameters_Request_, rcl_interfaces_srv_dds__SetParameters_Response_>(
      of + "/set_parameters", rcl_interfaces_srv_dds__SetParameters_Request__desc, rcl_interfaces_srv_dds__SetParameters_Response__desc, service_id(),
      [of, events](const auto& asked, auto& answer, auto&& send) {
        rcl_interfaces_msg_dds__SetParametersResult_ result{};
        result.reason = empty;
        const auto& parameter = asked.parameters._buffer[0];
        result.successful = asked.parameters._length == 1 && std::strcmp(parameter.name, "speed") == 0 && parameter.value.type == 3 &&
                            parameter.value.double_value <= 2;
        if (!result.successful) result.reason = reason;
        if (result.successful) speed = parameter.value.double_value;
        answer.results._buffer = &result;
        answer.results._length = answer.results._maximum = 1;
        send();
        if (!result.successful) return;
        rcl_interfaces_msg_dds__ParameterEvent_ event{};
        std::string name = of;
        event.node = name.data();
        event.changed_parameters._buffer = &asked.parameters._buffer[0];
        event.changed_parameters._length = event.changed_parameters._maximum = 1;
        dds_write(events, &event);
      });
}

bool obey(const std::string& line) {
  std::istringstream words(line);
  std::string command, name;
  words >> command >> name;
  if (command == "quit") return false;
  if (command == "writer" || command == "reader") {
    std::string of, reliability, durability, user_data;
    words >> of >> reliability >> durability >> user_data;
    const dds_entity_t entity =
        make(command == "writer", std_msgs_msg_dds__String__desc, "rt" + of, reliability == "reliable", durability == "transient_local", user_data);
    entities[name] = entity;
    if (command == "reader")
      work.push_back([entity, name] {
        take<std_msgs_msg_dds__String_>(entity, [&](const std_msgs_msg_dds__String_& text) { say("got " + name + " " + text.data); });
      });
  } else if (command == "write") {
    std::string text;
    int times = 1, pause = 0;
    words >> text >> times >> pause;
    std_msgs_msg_dds__String_ sample{};
    for (int i = 0; i < (times < 1 ? 1 : times); ++i) {
      sample.data = text.data();
      check(dds_write(entities[name], &sample), "write");
      if (pause > 0) dds_sleepfor(DDS_MSECS(pause));
    }
  } else if (command == "readers") {
    dds_publication_matched_status_t status{};
    dds_get_publication_matched_status(entities[name], &status);
    return say("readers " + name + " " + std::to_string(status.current_count)), true;
  } else if (command == "remove") {
    const dds_entity_t gone = entities[name];
    entities.erase(name);
    for (auto* list : {&readers, &writers})
      for (auto it = list->begin(); it != list->end(); ++it)
        if (*it == gone) {
          list->erase(it);
          break;
        }
    dds_delete(gone);
  } else if (command == "node") {
    node = name;
  } else if (command == "serve_add") {
    std::string mode;
    words >> mode;
    serve<example_interfaces_srv_dds__AddTwoInts_Request_, example_interfaces_srv_dds__AddTwoInts_Response_>(
        name, example_interfaces_srv_dds__AddTwoInts_Request__desc, example_interfaces_srv_dds__AddTwoInts_Response__desc,
        mode == "plain" ? std::string() : service_id(), [mode](const auto& asked, auto& answer, auto&& send) {
          answer.sum = asked.a + asked.b;
          if (mode != "silent") send();
          say("asked " + std::to_string(asked.a) + " " + std::to_string(asked.b));
        });
  } else if (command == "serve_fibonacci") {
    serve_fibonacci(name);
  } else if (command == "serve_parameters") {
    serve_parameters(name);
  } else if (command == "endpoints") {
    std::string prefix;
    words >> prefix;
    for (int i = 0; i < std::atoi(name.c_str()); ++i) make(true, std_msgs_msg_dds__String__desc, "rt/" + prefix + std::to_string(i));
  } else {
    say("unknown " + command);
    return true;
  }
  if (!node.empty()) announce();
  say("done " + command);
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) return 2;
  const auto domain = static_cast<dds_domainid_t>(std::atoi(argv[1]));
  const std::string config =
      "<General><Interfaces><NetworkInterface name=\"lo\" multicast=\"true\"/></Interfaces></General><Discovery><LeaseDuration>" +
      std::string(argv[2]) +
      "ms</LeaseDuration><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>60</MaxAutoParticipantIndex></Discovery>";
  check(dds_create_domain(domain, config.c_str()), "domain");
  dds_qos_t* const qos = dds_create_qos();
  const std::string user_data = argc > 3 ? argv[3] : "enclave=/;";
  dds_qset_userdata(qos, user_data.data(), user_data.size());
  participant = check(dds_create_participant(domain, qos, nullptr), "participant");
  dds_delete_qos(qos);
  say("ready");
  std::string input;
  for (;;) {
    for (std::size_t i = 0; i < work.size(); ++i) work[i]();
    pollfd waiting{STDIN_FILENO, POLLIN, 0};
    if (::poll(&waiting, 1, 2) <= 0) continue;
    char bytes[4096];
    const auto count = ::read(STDIN_FILENO, bytes, sizeof bytes);
    if (count <= 0) break;
    input.append(bytes, static_cast<std::size_t>(count));
    for (auto end = input.find('\n'); end != std::string::npos; end = input.find('\n')) {
      const std::string line = input.substr(0, end);
      input.erase(0, end + 1);
      if (!obey(line)) {
        dds_delete(DDS_CYCLONEDDS_HANDLE);  // waits until others have been told
        return 0;
      }
    }
  }
  return 0;
}
