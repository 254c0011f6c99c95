// SPDX-License-Identifier: Apache-2.0
// A mobile base that exists already (mobile_base.hpp) as a Linked Robotic Thing, without a change to its classes. Their getters are fields of
// records, their callbacks answer commands, lrt logs to their logger, and the emergency stop works while everything else is busy.
//
//   ex_mobile_base [--port N]
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>

#include <lrt/lrt.hpp>

#include "examples/ex_mobile_base/mobile_base.hpp"

struct Target {
  double x = 0, y = 0;  // [m]
};

namespace lrt::rdf {
template <>
struct traits<mobile::Pose> : Record<mobile::Pose> {
  static void describe(Record& r) {
    r.field("x", &mobile::Pose::x).unit(unit::metre).title("Forwards", "en").title("Vorwärts", "de");
    r.field("y", &mobile::Pose::y).unit(unit::metre).title("To the left", "en").title("Nach links", "de");
    r.field("heading", &mobile::Pose::heading).unit(unit::radian).title("Heading", "en").title("Richtung", "de");
  }
};
template <>
struct traits<mobile::Battery> : Record<mobile::Battery> {
  static void describe(Record& r) {
    r.field("voltage", &mobile::Battery::getVoltage).unit(unit::volt).title("Voltage", "en").title("Spannung", "de");
    r.field("charging", &mobile::Battery::isCharging).title("Charging", "en").title("Wird geladen", "de");
  }
};
template <>
struct traits<mobile::PidGains> : Record<mobile::PidGains> {
  static void describe(Record& r) {
    r.field("p", &mobile::PidGains::getP, &mobile::PidGains::setP).between(0, 100);
    r.field("i", &mobile::PidGains::getI, &mobile::PidGains::setI).between(0, 100);
    r.field("d", &mobile::PidGains::getD, &mobile::PidGains::setD).between(0, 100);
  }
};
template <>
struct traits<mobile::LaserScan> : Record<mobile::LaserScan> {
  static void describe(Record& r) {
    r.field("firstAngle", &mobile::LaserScan::first_angle_deg).unit(unit::degree);
    r.field("step", &mobile::LaserScan::step_deg).unit(unit::degree);
    r.field("ranges", &mobile::LaserScan::ranges).unit(unit::metre);
  }
};
template <>
struct traits<Target> : Record<Target> {
  static void describe(Record& r) {
    r.field("x", &Target::x).title("Forwards", "en").title("Vorwärts", "de").unit(unit::metre).between(-50, 50);
    r.field("y", &Target::y).title("To the left", "en").title("Nach links", "de").unit(unit::metre).between(-50, 50);
  }
};
}  // namespace lrt::rdf

constexpr double arrival = 0.001;  // [m] in x and in y: how near the base comes to its target

volatile std::sig_atomic_t interrupted = 0;

int main(int argc, char** argv) {
  mobile::Logger logger;
  mobile::MobileBase base(logger);
  const auto refused = [&base] { return lrt::Error{lrt::Errc::refused, base.lastError()}; };

  lrt::Thing thing{"base"};
  thing.title("Mobile base", "en").title("Mobile Plattform", "de");
  thing.dispatch(lrt::Dispatch::io_thread);  // the class has a mutex: its functions may run on lrt's thread
  auto pose = thing.property("pose", [&] { return base.pose(); });
  pose.title("Pose", "en")
      .title("Lage", "de")
      .description("Where the base is, seen from where it was switched on.", "en")
      .description("Wo der Roboter steht, vom Ort des Einschaltens aus gesehen.", "de");
  thing
      .property(
          "speed", [&] { return base.speed(); }, lrt::unit::metre_per_second)
      .title("Speed", "en")
      .title("Geschwindigkeit", "de");
  // A driver writes it again and again. Without one the base stops: for the 200 ms of one missed command it goes 16 cm at most.
  thing
      .property(
          "drive", [&] { return base.wantedSpeed(); }, lrt::unit::metre_per_second)
      .on_write([&](double speed) -> lrt::Result<void> {
        if (base.setSpeed(speed)) return {};
        return lrt::Unexpected{refused()};
      })
      .expires(std::chrono::milliseconds(200),
               [&] {
                 if (base.wantedSpeed() != 0) base.setSpeed(0);
               })
      .between(0, 0.8)
      .title("Drive straight ahead", "en")
      .title("Geradeaus fahren", "de");
  thing.property("battery", [&] { return base.battery(); }).title("Battery", "en").title("Batterie", "de");
  thing.property("bumper", [&] { return base.bumperPressed(); }).title("Bumper pressed", "en").title("Stoßleiste gedrückt", "de");
  thing.property("scan", [&] { return base.scan(); }).title("Laser scan", "en").title("Laserscan", "de");
  thing.property("gains", [&] { return base.gains(); })
      .on_write([&](const mobile::PidGains& gains) -> lrt::Result<void> {
        if (base.setGains(gains)) return {};
        return lrt::Unexpected{refused()};
      })
      .title("Gains of the controller", "en")
      .title("Reglerverstärkungen", "de");
  auto stopped = thing.property("stopped", [&] { return base.isStopped(); });
  stopped.title("Stopped", "en").title("Angehalten", "de");
  thing
      .action("driveTo",
              [&](const Target& to, lrt::Responder done) {
                const double distance = std::hypot(to.x - base.pose().x(), to.y - base.pose().y());
                const auto progress = [done, distance](double left) { done.progress(distance > 0 ? 1 - left / distance : 1); };
                const auto finished = [done](bool arrived, const std::string& why) { arrived ? done.succeed() : done.fail(why); };
                if (!base.driveTo(to.x, to.y, progress, finished)) return done.fail(refused());
                done.on_cancel([&] { base.cancelDrive(); });
              })
      .title("Drive to", "en")
      .title("Fahren nach", "de")
      .description("Drives on a straight line to a point on the floor.", "en")
      .description("Fährt geradeaus zu einem Punkt auf dem Boden.", "de")
      .policy(lrt::ActionPolicy::preempt())
      .effect(pose, lrt::from_input.field("x", "x").within(arrival))
      .effect(pose, lrt::from_input.field("y", "y").within(arrival));
  lrt::Action release = thing.action("release", [&] { base.release(); });
  release.title("Release", "en").title("Freigeben", "de").effect(stopped, false);
  thing.action("emergencyStop", [&] { base.emergencyStop(); })
      .title("Emergency stop", "en")
      .title("Not-Halt", "de")
      .stop(stopped, release)  // the base itself knows, also if its button was pressed
      .effect(stopped, true);

  lrt::Options options;
  options.title = {{"Mobile base", "en"}, {"Mobile Plattform", "de"}};
  if (argc == 3 && std::string_view(argv[1]) == "--port") options.listen.port = static_cast<std::uint16_t>(std::atoi(argv[2]));
  options.log = [&](lrt::LogLevel level, std::string_view text) {
    level >= lrt::LogLevel::warning ? logger.error(std::string(text)) : logger.info(std::string(text));
  };
  auto server = lrt::Server::create(options);
  if (!server) return logger.error(server.error().message), 1;
  if (auto added = server->add(std::move(thing)); !added) return logger.error(added.error().message), 1;
  std::printf("the base is at %s (Ctrl-C ends)\n", server->url().c_str());
  std::fflush(stdout);
  for (const int end : {SIGINT, SIGTERM}) std::signal(end, [](int) { interrupted = 1; });
  while (!interrupted) std::this_thread::sleep_for(std::chrono::milliseconds(100));
}
