// SPDX-License-Identifier: Apache-2.0
// A node of ROS 1 that makes joints web resources: each joint that a topic names becomes a Thing with its position, velocity and effort, and an
// action that sends a target to another topic.
//
//   ex_ros_node [--port N] [--public-base URL] [--allowed-host HOST]... [--cors ORIGIN]... [--linear JOINT]... [--limits JOINT LOWER UPPER]... [NAME:=VALUE]...
//
// joint_states     sensor_msgs/JointState, in: a joint is added when it is first named, with the values of that message
// joint_commands   sensor_msgs/JointState, out: one joint and its position for each command
//
// --linear JOINT                 a prismatic joint: m, m/s and N; other joints have rad, rad/s and N m
// --limits JOINT LOWER UPPER     commands outside are answered 422 and not sent
// NAME:=VALUE                    as for any node: joint_states:=/robot/joint_states
//
//   $ curl http://127.0.0.1:8080/robot/right_s1/position?accept=text/plain
//   $ curl -H 'Content-Type: application/json' -d '{"value": 0.75, "unit": "rad"}' http://127.0.0.1:8080/robot/right_s1/actions/command

#include <charconv>
#include <csignal>
#include <cstdio>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <ros/ros.h>
#include <sensor_msgs/JointState.h>

#include <lrt/lrt.hpp>

namespace {

using sensor_msgs::JointState;

/// Data that a JointState does not contain.
struct Description {
  std::set<std::string> linear;
  std::map<std::string, std::pair<double, double>> limits;  // in the unit of the position
};

struct Part {
  const char* path;
  std::vector<double> JointState::*values;
  lrt::Unit turning, sliding;
};
const Part parts[] = {{"position", &JointState::position, lrt::unit::radian, lrt::unit::metre},
                      {"velocity", &JointState::velocity, lrt::unit::radian_per_second, lrt::unit::metre_per_second},
                      {"effort", &JointState::effort, lrt::unit::newton_metre, lrt::unit::newton}};

constexpr std::size_t max_joints = 1000;  // every publisher of the topic can add Things

class LinkedJoints {
 public:
  LinkedJoints(lrt::Server& server, const Description& description)
      : server_(server),
        description_(description),
        commands_(node_.advertise<JointState>("joint_commands", 16)),
        states_(node_.subscribe("joint_states", 16, &LinkedJoints::take, this)) {}

 private:
  using Joint = std::vector<std::pair<const Part*, lrt::PushedProperty<double>>>;

  /// Called by ros::spin(). publish() does not wait.
  void take(const JointState& state) {
    for (std::size_t i = 0; i < state.name.size(); ++i) {
      auto found = joints_.find(state.name[i]);
      if (found == joints_.end() && joints_.size() == max_joints) {
        ROS_WARN_ONCE("only the first %zu joints are there", max_joints);
        continue;
      }
      if (found == joints_.end()) found = joints_.emplace(state.name[i], meet(state, i)).first;
      for (auto& [part, property] : found->second)
        if (const auto& values = state.*part->values; i < values.size()) property.publish(values[i]);
    }
  }

  /// A joint that was not named before.
  Joint meet(const JointState& state, std::size_t i) {
    const std::string& name = state.name[i];
    const bool linear = description_.linear.count(name) > 0;
    lrt::Thing thing{"robot/" + name};
    Joint joint;
    for (const Part& part : parts)
      if (const auto& values = state.*part.values; i < values.size()) {
        auto property = thing.property<double>(part.path);
        property.facets(
            lrt::Facets{linear ? part.sliding : part.turning}.allow_non_finite());  // drivers send NaN for values that they do not measure
        property.publish(values[i]);
        joint.emplace_back(&part, property);
      }
    lrt::Facets target{linear ? lrt::unit::metre : lrt::unit::radian};
    if (const auto limits = description_.limits.find(name); limits != description_.limits.end())
      target.between(limits->second.first, limits->second.second);
    // Called on the server's thread. A ros::Publisher may be used on any thread.
    thing
        .action("command",
                [name, commands = commands_](double position) -> lrt::Result<void> {
                  if (commands.getNumSubscribers() == 0) return lrt::unexpected(lrt::Errc::refused, "nobody listens to " + commands.getTopic());
                  JointState command;
                  command.header.stamp = ros::Time::now();
                  command.name = {name};
                  command.position = {position};
                  commands.publish(command);
                  return {};
                })
        .consumes(target);
    if (const auto added = server_.add(std::move(thing)); !added) ROS_WARN("joint %s is left out: %s", name.c_str(), added.error().message.c_str());
    return joint;
  }

  lrt::Server& server_;
  const Description& description_;
  std::map<std::string, Joint> joints_;
  ros::NodeHandle node_;
  ros::Publisher commands_;
  ros::Subscriber states_;
};

int usage() {
  std::fprintf(stderr,
               "usage: ex_ros_node [--port N] [--public-base URL] [--allowed-host HOST]... [--cors ORIGIN]... [--linear JOINT]... [--limits JOINT "
               "LOWER UPPER]... [NAME:=VALUE]...\n");
  return 2;
}

/// The whole of `text` is a number.
template <class T>
bool read(std::string_view text, T& number) {
  const auto [read_to, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && read_to == text.data() + text.size();
}

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "lrt");  // removes NAME:=VALUE from the arguments
  lrt::Options options;
  Description description;
  for (int i = 1; i < argc; ++i) {
    const std::string_view word = argv[i];
    if (word == "--port" && i + 1 < argc) {
      if (!read(argv[++i], options.listen.port)) return usage();
    } else if (word == "--public-base" && i + 1 < argc) {
      options.listen.public_base = argv[++i];
    } else if (word == "--allowed-host" && i + 1 < argc) {
      options.security.allowed_hosts.emplace_back(argv[++i]);
    } else if (word == "--cors" && i + 1 < argc) {
      options.security.read_origins.emplace_back(argv[++i]);
    } else if (word == "--linear" && i + 1 < argc) {
      description.linear.insert(argv[++i]);
    } else if (word == "--limits" && i + 3 < argc) {
      auto& [lower, upper] = description.limits[argv[i + 1]];
      if (!read(argv[i + 2], lower) || !read(argv[i + 3], upper) || !(lower <= upper)) return usage();
      i += 3;
    } else {
      return usage();
    }
  }

  auto server = lrt::Server::create(options);
  if (!server) return std::fprintf(stderr, "ex_ros_node: %s\n", server.error().message.c_str()), 1;
  server->add(lrt::Thing{"robot"}).value();
  server->start();                                            // on a thread of its own, because ROS uses the main thread
  std::signal(SIGTERM, [](int) { ros::requestShutdown(); });  // as ROS itself does at SIGINT
  std::printf("joints appear at %srobot (Ctrl-C ends)\n", server->url().c_str());
  std::fflush(stdout);

  LinkedJoints joints(*server, description);  // waits for the master
  ros::spin();                                // the server continues if the master ends
  server->stop();
}
