// SPDX-License-Identifier: Apache-2.0
// A robot that has one of everything, for the page to show: structs, lists, enums, booleans, a picture, a collection, and a property that
// fails; and a gantry, four joints and the links between them, that is seen as a skeleton.
//
//   page_robot --port N [PUBLIC BASE]
//   page_robot --port N --tokens FILE    everybody may read, and those who have a token may do more
//   page_robot --port N --tokens FILE --policy FILE    as the policy says

#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <numeric>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <lrt/lrt.hpp>

#include "tests/support/sample_robot.hpp"

namespace {

volatile std::sig_atomic_t interrupted = 0;

struct Translation {
  double x = 0, y = 0, z = 0;
};
struct Rotation {
  double x = 0, y = 0, z = 0, w = 1;
};
template <class Coordinates>
struct Quantity {
  Coordinates value;
};
struct Frame {
  Quantity<Translation> translation;
  Quantity<Rotation> rotation;
};
struct Picture {
  unsigned number = 0;
  lrt::Bytes svg;
};
struct Remark {
  std::string text, status;
};
enum class Hinge : std::uint8_t { left, right };
struct Opening {
  double width = 1;
  Hinge hinge = Hinge::left;
};

}  // namespace

template <>
struct lrt::rdf::traits<Hinge> : lrt::rdf::Enumeration<Hinge> {
  static void describe(Enumeration<Hinge>& e) {
    e.name(Hinge::left, "left").title("On the left", "en").title("Links", "de");
    e.name(Hinge::right, "right");
  }
};
/// With a term that means something where the robot states it.
template <>
struct lrt::rdf::traits<Remark> : lrt::rdf::Record<Remark> {
  static void describe(Record<Remark>& r) {
    r.field("text", &Remark::text);
    r.field(Iri{"https://w3id.org/lrt/ns#status"}, &Remark::status);
  }
};
template <>
struct lrt::rdf::traits<Opening> : lrt::rdf::Record<Opening> {
  static void describe(Record<Opening>& r) {
    r.field("width", &Opening::width).title("Width", "en").title("Breite", "de").description("Lichtes Maß", "de");
    r.field("hinge", &Opening::hinge);
  }
};
template <>
struct lrt::rdf::traits<Translation> : lrt::rdf::Record<Translation> {
  static void describe(Record<Translation>& r) {
    r.is(vocab::maths::Vector3D);
    r.field(vocab::maths::x, &Translation::x);
    r.field(vocab::maths::y, &Translation::y);
    r.field(vocab::maths::z, &Translation::z);
  }
};
template <>
struct lrt::rdf::traits<Rotation> : lrt::rdf::Record<Rotation> {
  static void describe(Record<Rotation>& r) {
    r.field(vocab::maths::x, &Rotation::x);
    r.field(vocab::maths::y, &Rotation::y);
    r.field(vocab::maths::z, &Rotation::z);
    r.field(Iri{"http://vocab.arvida.de/2015/06/maths/vocab#w"}, &Rotation::w);
  }
};
template <class Coordinates>
struct lrt::rdf::traits<Quantity<Coordinates>> : lrt::rdf::Record<Quantity<Coordinates>> {
  static void describe(Record<Quantity<Coordinates>>& r) { r.field(vocab::vom::quantityValue, &Quantity<Coordinates>::value); }
};

template <>
struct lrt::rdf::traits<Frame> : lrt::rdf::Record<Frame> {
  static void describe(Record<Frame>& r) {
    r.is(Iri{"http://vocab.arvida.de/2015/06/spatial/vocab#SpatialRelationship"});
    r.field(Iri{"http://vocab.arvida.de/2015/06/spatial/vocab#translation"}, &Frame::translation);
    r.field(Iri{"http://vocab.arvida.de/2015/06/spatial/vocab#rotation"}, &Frame::rotation);
  }
};
template <>
struct lrt::rdf::traits<Picture> : lrt::rdf::Record<Picture> {
  static void describe(Record<Picture>& r) { r.field("number", &Picture::number); }
};

namespace {

/// A camera that sees the number of its picture: so many pixels wide.
class Camera {
 public:
  lrt::Thing thing() {
    lrt::Thing eye{"sample/eye"};
    image_ = eye.property<Picture>("image");
    image_->representation("image/svg+xml", [](const Picture& p) { return p.svg; });
    image_->frame(lrt::Object::resource("sample/eye/optical_frame"));
    eye.action("shoot", [this] { shoot(); });
    shoot();
    return eye;
  }

 private:
  void shoot() {
    ++number_;
    const std::string width = std::to_string(60 * number_);
    image_->publish({number_, std::make_shared<const std::string>(
                                  "<svg xmlns='http://www.w3.org/2000/svg' width='" + width + "' height='60'><rect width='" + width +
                                  "' height='60' fill='#0a6e83'/><script>fetch('/sample/eye/actions/shoot', {method: 'POST'})</script></svg>")});
  }
  unsigned number_ = 0;
  std::optional<lrt::PushedProperty<Picture>> image_;
};

/// What an importer of robot descriptions makes of three revolute joints and a prismatic one, each half a metre above the last.
class Gantry {
 public:
  void add_to(lrt::Server& server) {
    lrt::Thing whole{"gantry"};
    whole.type(lrt::Iri{"http://ros.org/#Robot"}).add(lrt::Iri{"https://w3id.org/lrt/ns#rootLink"}, lrt::Object::resource("gantry/link0"));
    whole.add_turtle("<> <https://w3id.org/lrt/ns#positionsOf> (<gantry/joint1> <gantry/joint2> <gantry/joint3> <gantry/joint4>) .");
    all_ = whole.property<std::vector<double>>("positions");
    all_->predicate(lrt::vocab::lrt_::positions);
    server.add(std::move(whole)).value();

    lrt::Thing door{"door"};  // with words in two languages
    door.title("Door", "en").title("Tür", "de").description("The way into the cell.", "en");
    door.property("opening", [this] { return opening_; })
        .on_write([this](Opening v) { opening_ = v; })
        .title("Opening", "en")
        .title("Öffnung", "de")
        .description("What the door closes.", "en")
        .description("Was die Tür verschließt.", "de");
    door.control();
    door.action("shut", [] {}).title("Shut", "en").title("Schließen", "de").description("Schließt die Tür.", "de");
    server.add(std::move(door)).value();
    for (int n = 0; n <= 4; ++n) {
      lrt::Thing link{"gantry/link" + std::to_string(n)};
      link.type(lrt::vocab::ros::Link);
      server.add(std::move(link)).value();
    }
    for (int n = 1; n <= 4; ++n) server.add(joint(n)).value();
    all_->publish({positions_.begin(), positions_.end()});
  }

 private:
  lrt::Thing joint(int n) {
    const bool slides = n == 4;
    lrt::Thing thing{"gantry/joint" + std::to_string(n)};
    thing.type(lrt::Iri{"http://ros.org/#Joint"}).type(slides ? lrt::Iri{"http://ros.org/#PrismaticJoint"} : lrt::vocab::ros::RevoluteJoint);
    thing.add(lrt::vocab::ros::preceedingLink, lrt::Object::resource("gantry/link" + std::to_string(n - 1)));
    thing.add(lrt::vocab::ros::succeedingLink, lrt::Object::resource("gantry/link" + std::to_string(n)));
    // The first turns about the vertical; the others are tilted by a quarter turn about x, so that z of the first is y of theirs.
    const double half = std::sqrt(0.5);
    Frame origin{{{0, 0, n == 1 ? 0.2 : 0}}, {}};
    if (n == 2) origin = {{{0, 0, 0.5}}, {{half, 0, 0, half}}};
    if (n > 2) origin.translation.value = {0, 0.5, 0};
    auto frame = thing.property<Frame>("origin");
    frame.predicate(lrt::vocab::ros::jointReferenceFrame);
    frame.publish(origin);
    auto axis = thing.property<Translation>("axis");
    axis.predicate(lrt::vocab::lrt_::axis);
    axis.publish(slides ? Translation{0, 1, 0} : Translation{0, 0, 1});
    double& value = positions_[static_cast<std::size_t>(n - 1)];
    thing
        .property(
            "position", [&value] { return value; }, slides ? lrt::unit::metre : lrt::unit::radian)
        .between(slides ? 0 : -3, slides ? 0.4 : 3)
        .predicate(lrt::Iri{"http://ros.org/#position"})
        .on_write([this, &value](double v) {
          value = v;
          all_->publish({positions_.begin(), positions_.end()});
        });
    return thing;
  }
  std::array<double, 4> positions_{};
  std::optional<lrt::PushedProperty<std::vector<double>>> all_;
  Opening opening_;
};

}  // namespace

int main(int argc, char** argv) {
  lrt::Options options;
  options.listen.port = static_cast<std::uint16_t>(argc >= 3 && std::string(argv[1]) == "--port" ? std::atoi(argv[2]) : 0);
  if (argc == 4) options.listen.public_base = argv[3];
  if (argc >= 5) options.security.token_file = argv[4];
  if (argc == 5) options.security.anyone = lrt::security::Right::read | lrt::security::Right::subscribe;
  if (argc == 7) options.security.policy_file = argv[6];
  lrt::Server server = lrt::Server::create(options).value();
  lrt::test::SampleRobot robot;
  bool armed = false;
  lrt::Thing whole{"sample"};
  whole.title("<b>Sample</b> & \"robot\"");
  whole.property("armed", [&] { return armed; }).on_write([&](bool v) { armed = v; });
  whole.property("pose", [&] { return robot.pose; }).on_write([&](lrt::test::Pose v) { robot.pose = std::move(v); });
  whole.property("mode", [&] { return robot.mode; }).on_write([&](lrt::test::Mode v) { robot.mode = v; });
  whole.property("gains", [&] { return robot.gains; }).on_write([&](std::vector<double> v) { robot.gains = std::move(v); });
  whole.action("sum", [](const std::vector<double>& numbers) { return std::accumulate(numbers.begin(), numbers.end(), 0.0); });
  whole.action("measure", [] { return 2.5; }).produces(lrt::rdf::Facets{}.unit(lrt::unit::metre));
  std::atomic<int> stops{0};
  whole.property("stops", [&] { return stops.load(); }).dispatch(lrt::Dispatch::io_thread);
  whole.action("stop", [&] { ++stops; }).stop();
  std::atomic<bool> hangs{false};
  whole.property("hangs", [&] { return hangs.load(); }).dispatch(lrt::Dispatch::io_thread);
  whole.action("hang", [&] {
    hangs = true;
    for (const int before = stops; stops == before && !interrupted;) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    hangs = false;
  });
  // What clients of few rights may write.
  std::string note = "nothing yet";
  whole.property("note", [&] { return note; }).on_write([&](std::string v) { note = std::move(v); });
  whole.collection<Remark>("remarks").on_create([](const Remark&) {}).on_remove([](const std::string&) {});
  server.add(std::move(whole)).value();
  lrt::WorldOptions by_clients;
  by_clients.clients_may_create = true;
  lrt::World board{"board", by_clients};
  lrt::GraphOptions written;
  written.clients_may_write = true;
  board.graph("notes", written);
  server.add(std::move(board)).value();
  server.add(robot.arm()).value();
  server.add(robot.tool()).value();
  Camera camera;
  server.add(camera.thing()).value();
  Gantry gantry;
  gantry.add_to(server);

  std::signal(SIGTERM, [](int) { interrupted = 1; });
  std::printf("One of everything is at %s (Ctrl-C ends)\n", server.url().c_str());
  std::fflush(stdout);
  while (!interrupted) {
    server.poll();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  server.stop();
}
