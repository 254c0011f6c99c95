// SPDX-License-Identifier: Apache-2.0
#include <lrt/model/representation.hpp>

#include <array>
#include <cstring>

#include <lrt/engine/engine.hpp>
#include <lrt/shacl/validator.hpp>

#include "src/http/etag.hpp"
#include "tests/support/bench.hpp"
#include "tests/support/blueprint.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

/// What a camera gives: its description in RDF, and the picture.
struct Frame {
  std::uint32_t number = 0;
  std::uint16_t width = 0, height = 0;
  Bytes jpeg;
};

}  // namespace

template <>
struct lrt::rdf::traits<Frame> : lrt::rdf::Record<Frame> {
  static void describe(Record<Frame>& r) { r.field("number", &Frame::number), r.field("width", &Frame::width), r.field("height", &Frame::height); }
};

namespace {

Frame frame(std::uint32_t number, std::string jpeg) { return {number, 640, 480, std::make_shared<const std::string>(std::move(jpeg))}; }

struct Camera {
  Camera() {
    Thing thing{"head"};
    image = thing.property<Frame>("image").representation("image/jpeg", [this](const Frame& f) {
      ++encoded;
      return f.jpeg;
    });
    image->representation("image/x-raw", [](const Frame& f) { return std::string(f.number, 'x'); },
                          {vocab::xsd::unsignedByte, {480, 640, 3}, Layout::ByteOrder::big_endian, unit::one});
    image->frame(Object::resource("head/optical"));
    bench.add(std::move(thing));
  }
  void publish(const Frame& f) {
    image->publish(f);
    bench.look();
  }
  Answer get(const std::string& accept, const std::string& fields = {}) { return bench.ask("GET /head/image\nAccept: " + accept + "\n" + fields); }
  int encoded = 0;
  std::optional<PushedProperty<Frame>> image;
  Bench bench;
};

const std::string all_bytes = [] {
  std::string bytes;
  for (int i = 0; i < 256; ++i) bytes += static_cast<char>(i);
  return bytes;
}();

}  // namespace

TEST_CASE("a property has the formats that its encoders make, and describes them in RDF", "[engine][R1.2]") {
  Camera camera;
  CHECK(camera.get("image/jpeg").status == 406);  // nothing was published
  camera.publish(frame(3, all_bytes));
  const Answer jpeg = camera.get("image/jpeg");
  CHECK(jpeg.status == 200);
  CHECK(jpeg.body == all_bytes);
  CHECK(jpeg.field("Content-Type") == "image/jpeg");
  CHECK(jpeg.links_to("http://localhost/head/image?accept=text/turtle", "describedby"));
  CHECK(jpeg.links_to("http://localhost/head/image?accept=image/jpeg", "alternate"));
  CHECK(camera.bench.get("/head/image?accept=image/jpeg").body == all_bytes);
  CHECK(camera.get("image/webp,image/*,*/*;q=0.8").body == all_bytes);  // what <img> of a browser requests
  CHECK(camera.get("*/*").field("Content-Type") == "text/turtle");
  CHECK(camera.get("application/json").body == R"({"number":3,"width":640,"height":480})");
  CHECK(camera.encoded == 1);
  CHECK(missing(camera.bench.get("/head/image"),
                "<http://localhost/head/image> dcterms:hasFormat <http://localhost/head/image?accept=image/jpeg>, "
                "<http://localhost/head/image?accept=image/x-raw> ;"
                "  lrt:frame <http://localhost/head/optical> ."
                "<http://localhost/head/image?accept=image/jpeg> a dcat:Distribution ; dcterms:format \"image/jpeg\" ;"
                "  dcat:mediaType <https://www.iana.org/assignments/media-types/image/jpeg> ; dcat:byteSize \"256\"^^xsd:nonNegativeInteger ."
                "<http://localhost/head/image?accept=image/x-raw> dcat:byteSize \"3\"^^xsd:nonNegativeInteger ; lrt:elementType xsd:unsignedByte ;"
                "  lrt:shape ( \"480\"^^xsd:nonNegativeInteger \"640\"^^xsd:nonNegativeInteger \"3\"^^xsd:nonNegativeInteger ) ;"
                "  lrt:byteOrder lrt:bigEndian ; lrt:frame <http://localhost/head/optical> .") == "");
}

TEST_CASE("a format has its ETag, HEAD and ranges", "[engine][R0.11][R0.6]") {
  Camera camera;
  camera.publish(frame(1, all_bytes));
  const Answer whole = camera.get("image/jpeg");
  CHECK(camera.get("image/jpeg", "If-None-Match: " + whole.tag()).status == 304);
  const Answer part = camera.get("image/jpeg", "Range: bytes=10-19");
  CHECK(part.status == 206);
  CHECK(part.body == all_bytes.substr(10, 10));
  CHECK(part.field("Content-Range") == "bytes 10-19/256");
  CHECK(camera.get("image/jpeg", "Range: bytes=256-").status == 416);
  CHECK(camera.bench.ask("HEAD /head/image\nAccept: image/jpeg").tag() == whole.tag());
  camera.publish(frame(2, all_bytes));
  CHECK(camera.get("image/jpeg").tag() == whole.tag());  // the same bytes
  camera.publish(frame(3, all_bytes + "!"));
  CHECK(camera.get("image/jpeg").tag() != whole.tag());
  CHECK(camera.get("image/jpeg", "Range: bytes=0-9\nIf-Range: " + whole.tag()).status == 200);
}

TEST_CASE("subscribers to a format get its bytes as binary messages, the same for all", "[engine][R0.12][R0.17]") {
  Camera camera;
  camera.publish(frame(1, "one"));
  const auto a = camera.bench.open("/head/image?accept=image/jpeg"), b = camera.bench.open("/head/image", "Accept: image/jpeg\n");
  camera.bench.pushes();
  camera.encoded = 0;
  const Frame next = frame(2, all_bytes);
  camera.publish(next);
  std::size_t told = 0;
  for (const auto& [channel, push] : camera.bench.pushes()) {
    CHECK((channel == a || channel == b));
    CHECK_FALSE(push.text);
    CHECK(push.message == next.jpeg);  // the very bytes of the robot: not copied
    ++told;
  }
  CHECK(told == 2);
  CHECK(camera.encoded == 1);
}

TEST_CASE("an encoder may fail or have nothing; the other formats go on", "[engine][R0.6]") {
  Bench bench;
  int state = 0;
  Thing thing{"a"};
  thing.property("v", [&] { return state; })
      .representation("text/csv",
                      [](const int& v) -> Result<std::string> {
                        if (v == 1) return unexpected(Errc::failed, "the codec is broken");
                        if (v == 2) throw 7;
                        if (v == 3) return unexpected(Errc::unsupported_syntax, "no table of this");
                        return std::to_string(v) + "\n";
                      })
      .representation("image/png", [](const int& v) { return v == 0 ? nullptr : std::make_shared<const std::string>("png"); });
  bench.add(std::move(thing));
  const auto csv = [&] { return bench.ask("GET /a/v\nAccept: text/csv"); };
  CHECK(csv().body == "0\n");
  CHECK(bench.ask("GET /a/v\nAccept: image/png").status == 406);
  CHECK(bench.ask("GET /a/v\nAccept: image/png, text/plain;q=0.5").body == "0");
  state = 1;
  CHECK(csv().status == 500);
  CHECK(csv().says("the codec is broken"));
  CHECK(bench.ask("GET /a/v\nAccept: image/png").body == "png");
  CHECK(bench.get("/a/v").status == 200);
  state = 2;
  CHECK(csv().status == 500);
  state = 3;
  CHECK(csv().status == 406);
}

TEST_CASE("what is too much for RDF, or for its slowest syntax, is had in the other formats", "[engine][json_ld][rdf_xml][R0.6]") {
  engine::EngineOptions options;
  options.max_value_members = 3;
  options.max_rdf_xml_triples = 8;
  Bench bench(options);
  Thing thing{"a"};
  using Rows = std::vector<std::vector<double>>;
  auto list = thing.property<Rows>("list").on_write([](const Rows&) {});
  thing.property<std::string>("text").publish("x");
  bench.add(std::move(thing));
  const auto get = [&](const std::string& path, const std::string& type) { return bench.ask("GET " + path + "\nAccept: " + type); };
  list.publish({{1, 2}});
  CHECK(get("/a/list", "text/turtle").status == 200);
  CHECK(get("/a/list", "application/ld+json").status == 200);
  CHECK(get("/a/text", "application/rdf+xml").status == 200);
  CHECK(get("/a/state", "text/turtle").status == 200);
  const Answer xml = get("/a/list", "application/rdf+xml");
  CHECK(xml.status == 406);
  CHECK(xml.says(" triples are too many for RDF/XML, which takes 8, but not for text/turtle"));
  CHECK(get("/a/list", "application/rdf+xml, text/turtle;q=0.5").field("Content-Type") == "text/turtle");

  list.publish({{1, 2}, {3}});
  CHECK(get("/a/list", "text/turtle").status == 200);
  // Of a state, the first values that fit.
  constexpr const char* left_out =
      "lrt:error \"its value is not in the RDF of this document, which has at most 3 values; application/json has it\" .";
  CHECK(missing(get("/a/state", "text/turtle"), "<a/list> rdf:value [] . <a/text> " + std::string(left_out)) == "");
  CHECK(get("/a/state", "application/json").body == R"({"list":[[1,2],[3]],"text":"x"})");
  list.publish({{1, 2}, {3, 4}});
  CHECK(missing(get("/a/state", "text/turtle"), "<a/text> rdf:value \"x\" . <a/list> " + std::string(left_out)) == "");
  for (const char* syntax : {"text/turtle", "application/n-triples", "application/rdf+xml", "application/ld+json"}) {
    INFO(syntax);
    const Answer answer = get("/a/list", syntax);
    CHECK(answer.status == 406);
    CHECK(answer.says("more than 3 values are too many for RDF, but not for application/json"));
  }
  CHECK(get("/a/list", "*/*").field("Content-Type") == "application/json");
  list.publish({{}, {}, {}, {}});
  CHECK(get("/a/list", "text/turtle").status == 406);
  list.publish({{1, 2}, {3, 4}});
  CHECK(get("/a/list", "application/json").body == "[[1,2],[3,4]]");
  CHECK(bench.ask("PUT /a/list\nContent-Type: application/json\nIf-Match: \"old\"\n\n[[0]]").status == 412);
  CHECK(bench.ask("PUT /a/list\nContent-Type: application/json\nIf-Match: " + get("/a/list", "application/json").tag() + "\n\n[[0]]").status == 204);
  CHECK(get("/a/list", "text/turtle").status == 200);
}

TEST_CASE("of numbers that are too many for RDF it describes the octets, and the blueprint promises no more", "[engine][R0.6][R1.11]") {
  engine::EngineOptions options;
  options.max_value_members = 3;
  Bench bench(options);
  Thing thing{"a"};
  using Rows = std::vector<std::vector<double>>;
  auto list = thing.property<Rows>("list").octets().on_write([](const Rows&) {});
  bench.add(std::move(thing));
  const auto says = [&](const char* path, std::string_view what) { return bench.get(path).body.find(what) != std::string::npos; };
  const auto conforms = [&] { return violations([&](const std::string& path) { return bench.get(path); }, "/a").empty(); };
  bench.open("/a/list", "Accept: text/turtle\n");
  bench.pushes();
  list.publish({{1, 2}, {3, 4}});
  bench.look();
  CHECK(bench.pushes().size() == 1);
  CHECK_FALSE(says("/a/list", "rdf:value"));
  constexpr const char* shape = "[] lrt:shape ( \"2\"^^xsd:nonNegativeInteger \"2\"^^xsd:nonNegativeInteger ) .";
  for (const char* path : {"/a/list", "/a/state"}) CHECK(missing(bench.get(path), shape) == "");
  const std::string tag = bench.get(kind_of(bench, "/a")).tag();
  CHECK(conforms());
  CHECK(bench.ask("GET /a/list\nAccept: application/octet-stream").body.size() == 32);
  // Rows of unlike lengths have no octets.
  list.publish({{1, 2}, {3}, {4}});
  CHECK(bench.get("/a/list").field("Content-Type") == "application/json");
  CHECK(bench.ask("PUT /a/list\nContent-Type: application/json\n\n[[1,2],[3]]").status == 204);
  CHECK(says("/a/list", "rdf:value"));
  CHECK(bench.get(kind_of(bench, "/a")).tag() == tag);  // what it promises does not depend on the value
  CHECK(conforms());
  list.publish({{1, 2}});  // few enough: both
  CHECK(says("/a/list", "rdf:value"));
  CHECK(says("/a/list", "lrt:shape"));
}

TEST_CASE("a value that a client wrote has its formats too", "[engine][R0.5]") {
  Bench bench;
  Thing thing{"a"};
  auto v = thing.property<double>("v").on_write([](double) {}).representation("text/csv", [](double d) { return std::to_string(d); });
  bench.add(std::move(thing));
  v.publish(1);
  CHECK(bench.ask("GET /a/v\nAccept: text/csv").body == "1.000000");
  CHECK(bench.ask("PUT /a/v\nContent-Type: text/plain\n\n2").status == 204);
  CHECK(bench.ask("GET /a/v\nAccept: text/csv").body == "2.000000");
}

TEST_CASE("a precondition that names a representation which is there makes no other", "[engine][R0.5][R0.11]") {
  Bench bench;
  int made = 0;
  Thing thing{"a"};
  auto v = thing.property<double>("v").on_write([](double) {}).representation("text/csv", [&](double d) { return ++made, std::to_string(d); });
  bench.add(std::move(thing));
  v.publish(1);
  bench.look();
  const std::string tag = bench.ask("GET /a/v\nAccept: application/json").tag();
  CHECK(bench.ask("PUT /a/v\nContent-Type: text/plain\nIf-Match: " + tag + "\n\n2").status == 204);
  CHECK(made == 0);  // RDF would have, which says its size
  CHECK(bench.ask("PUT /a/v\nContent-Type: text/plain\nIf-Match: " + tag + "\n\n2").status == 412);
  v.publish(1);
  bench.look();
  CHECK(bench.ask("PUT /a/v\nContent-Type: text/plain\nIf-Match: " + tag + "\n\n2").status == 204);  // not requested since
}

TEST_CASE("numbers are octets on request, both ways, with their layout described", "[engine][R0.5][R1.2]") {
  Bench bench;
  std::array<double, 3> joints{0.5, -1, 2};
  std::vector<float> scan{1, 2};
  Thing thing{"a"};
  thing
      .property(
          "joints", [&] { return joints; }, unit::radian)
      .octets()
      .frame("base")
      .on_write([&](const std::array<double, 3>& v) { joints = v; });
  thing.property("scan", [&] { return scan; }).octets();
  bench.add(std::move(thing));
  const Answer a = bench.ask("GET /a/joints\nAccept: application/octet-stream");
  REQUIRE(a.body.size() == 24);
  std::array<double, 3> got{};
  std::memcpy(got.data(), a.body.data(), 24);
  CHECK(got == joints);
  CHECK(missing(bench.get("/a/joints"),
                "<http://localhost/a/joints> dcterms:hasFormat <http://localhost/a/joints?accept=application/octet-stream> ."
                "<http://localhost/a/joints?accept=application/octet-stream> dcat:byteSize \"24\"^^xsd:nonNegativeInteger ;"
                "lrt:elementType xsd:double ; lrt:shape ( \"3\"^^xsd:nonNegativeInteger ) ; lrt:byteOrder lrt:littleEndian ;"
                "qudt:hasUnit unit:RAD ; vom:unit maths:Radian ; lrt:frame \"base\" .") == "");
  CHECK(missing(bench.get("/a/scan"),
                "[] dcat:byteSize \"8\"^^xsd:nonNegativeInteger ; lrt:elementType xsd:float ; lrt:shape ( \"2\"^^xsd:nonNegativeInteger ) .") == "");

  const std::array<double, 3> next{1, 2, 3};
  const std::string head = "PUT /a/joints\nContent-Type: application/octet-stream\n\n";
  const std::string bytes(reinterpret_cast<const char*>(next.data()), 24);
  CHECK(bench.ask(head + bytes).status == 204);
  CHECK(joints == next);
  CHECK(bench.ask(head + bytes.substr(1)).status == 400);
  CHECK(bench.ask(head + std::string("\0\0\0\0\0\0\xF8\x7F", 8) + bytes.substr(8)).status == 422);  // NaN
  CHECK(joints == next);
  CHECK(bench.ask("GET /a/scan?accept=application/json").body == "[1,2]");
}

TEST_CASE("octets of a matrix have the shape of the present value, and a ragged one has none", "[engine][json_ld][rdf_xml][R0.5][R1.2]") {
  Bench bench;
  std::vector<std::vector<float>> rows{{1, 2, 3}, {4, 5, 6}};
  Thing thing{"a"};
  thing
      .property(
          "m", [&] { return rows; }, unit::metre)
      .octets()
      .on_write([&](const std::vector<std::vector<float>>& m) { rows = m; });
  thing.property("row", [&] { return std::array<std::vector<float>, 1>{{rows[0]}}; })
      .octets()
      .on_write([&](const std::array<std::vector<float>, 1>& m) { rows[0] = m[0]; });
  bench.add(std::move(thing));
  const auto octets = [&] { return bench.ask("GET /a/m\nAccept: application/octet-stream"); };
  const std::string format = "<http://localhost/a/m?accept=application/octet-stream>";
  const auto described = [&](const std::string& bytes, const std::string& shape) {
    return missing(bench.get("/a/m"),
                   "<http://localhost/a/m> dcterms:hasFormat " + format + " . " + format + " dcat:byteSize \"" + bytes +
                       "\"^^xsd:nonNegativeInteger ; lrt:elementType xsd:float ; lrt:byteOrder lrt:littleEndian ; qudt:hasUnit unit:M ;"
                       " lrt:shape ( " +
                       shape + " ) .");
  };
  std::array<float, 6> got{};
  REQUIRE(octets().body.size() == 24);
  std::memcpy(got.data(), octets().body.data(), 24);
  CHECK(got == std::array<float, 6>{1, 2, 3, 4, 5, 6});
  CHECK(described("24", "\"2\"^^xsd:nonNegativeInteger \"3\"^^xsd:nonNegativeInteger") == "");

  rows = {{1, 2}, {3}};
  CHECK(octets().status == 406);
  CHECK(bench.ask("GET /a/m\nAccept: application/octet-stream, application/json;q=0.5").body == "[[1,2],[3]]");
  CHECK(bench.get("/a/m").status == 200);
  CHECK_FALSE(bench.get("/a/m").says("hasFormat"));
  rows = {};
  CHECK(octets().status == 200);
  CHECK(octets().body.empty());
  CHECK(described("0", "\"0\"^^xsd:nonNegativeInteger \"0\"^^xsd:nonNegativeInteger") == "");

  // A number of octets does not determine two free lengths: they are for reading only.
  rows = {{1, 2}};
  const Answer put = bench.ask("PUT /a/m\nContent-Type: application/octet-stream\n\n" + octets().body);
  CHECK(put.status == 415);
  CHECK(put.field("Accept") ==
        "text/turtle, application/n-triples, application/rdf+xml, application/ld+json, application/trig, application/n-quads, application/json, "
        "text/plain, application/cbor");
  CHECK(bench.ask("PUT /a/row\nContent-Type: application/octet-stream\n\n" + std::string("\0\0\x80?\0\0\0@\0\0\0\xC0", 12)).status == 204);
  CHECK(rows == std::vector<std::vector<float>>{{1, 2, -2}});
}

TEST_CASE("subscribers to octets get what there is of them, and a ragged value is left out", "[engine][R0.12][R0.17]") {
  engine::EngineOptions options;
  options.callbacks.allow = {"127.0.0.1"};
  Bench bench(std::move(options));
  using Rows = std::vector<std::vector<std::uint8_t>>;
  Thing thing{"a"};
  auto m = thing.property<Rows>("m").octets();
  bench.add(std::move(thing));
  const auto publish = [&](const Rows& rows) {
    m.publish(rows);
    bench.look();
  };
  const auto early = bench.open("/a/m?accept=application/octet-stream");  // before there is one
  CHECK(bench.messages(early).empty());
  publish({{1, 2}, {3}});
  CHECK(bench.messages(early).empty());
  const auto late = bench.open("/a/m", "Accept: application/octet-stream\n");
  const Answer callback = bench.ask("GET /a/m?accept=application/octet-stream\nUpgrade: callback\nCallback: http://127.0.0.1:9/receiver");
  CHECK(callback.status == 201);
  CHECK(callback.says("application/octet-stream"));
  bench.pushes();
  publish({{1, 2}, {3, 4}});
  std::size_t told = 0;
  for (const auto& [channel, push] : bench.pushes()) {
    CHECK((channel == early || channel == late));
    CHECK_FALSE(push.text);
    CHECK(*push.message == "\x01\x02\x03\x04");
    ++told;
  }
  CHECK(told == 2);
  CHECK(bench.take_callbacks().size() == 1);
  publish({{1}, {3, 4}});
  CHECK(bench.pushes().empty());
  publish({{5}, {6}});
  CHECK(bench.messages(late) == std::vector<std::string>{"\x05\x06"});
}

TEST_CASE("a format that cannot be offered is refused when the thing is added", "[engine][R0.3]") {
  const auto refusal = [](const auto& change) {
    engine::Engine engine;
    Thing thing{"a"};
    auto v = thing.property("v", [] { return std::string("x"); });
    change(v);
    const Result<void> added = engine.add(std::move(thing));
    REQUIRE_FALSE(added);
    CHECK(added.error().message.find("a/v") != std::string::npos);
    return added.error().code;
  };
  const auto encode = [](const std::string& s) { return s; };
  CHECK(refusal([&](auto& v) { v.representation("nonsense", encode); }) == Errc::expected_media_type);
  CHECK(refusal([&](auto& v) { v.representation("image/*", encode); }) == Errc::expected_media_type);
  CHECK(refusal([&](auto& v) { v.representation("TEXT/Turtle", encode); }) == Errc::duplicate_path);
  CHECK(refusal([&](auto& v) { v.representation("text/html", encode); }) == Errc::duplicate_path);
  CHECK(refusal([&](auto& v) { v.representation("application/json;charset=utf-8", encode); }) == Errc::duplicate_path);
  CHECK(refusal([&](auto& v) { v.representation("a/b;C=d", encode).representation("a/b; c=\"d\"", encode); }) == Errc::duplicate_path);
  CHECK(refusal([&](auto& v) { v.representation("a/b", encode).representation("a/b", encode); }) == Errc::duplicate_path);
  CHECK(refusal([&](auto& v) { v.octets(); }) == Errc::invalid_option);
  CHECK(refusal([&](auto& v) { v.representation("a/b", encode, {Iri("no iri"), {1}}); }) == Errc::expected_iri);
}

TEST_CASE("a browser that opens a camera gets the page, its <img> the picture", "[engine][R1.2]") {
  Camera camera;
  const std::string navigation = "text/html,application/xhtml+xml,application/xml;q=0.9,image/avif,image/webp,image/jpeg,image/*,*/*;q=0.8";
  CHECK(camera.get(navigation).field("Content-Type") == "text/html; charset=utf-8");
  camera.publish(frame(1, all_bytes));
  CHECK(camera.get(navigation).field("Content-Type") == "text/html; charset=utf-8");
  CHECK(camera.get("image/avif,image/webp,image/*,*/*;q=0.8").field("Content-Type") == "image/jpeg");
  Camera dark;
  CHECK(dark.get("image/jpeg, text/html;q=0.1").field("Content-Type") == "text/html; charset=utf-8");  // there is no picture yet
}

TEST_CASE("a subscription to a picture may come before the first one", "[engine][R0.17]") {
  Camera camera;
  const auto channel = camera.bench.open("/head/image?accept=image/jpeg");
  CHECK(camera.bench.messages(channel).empty());
  camera.publish(frame(1, "first"));
  CHECK(camera.bench.messages(channel) == std::vector<std::string>{"first"});
}

TEST_CASE("a media type is kept as clients write it, and odd ones do not spoil the RDF", "[engine][R1.2]") {
  Bench bench;
  Thing thing{"a"};
  auto v = thing.property("v", [] { return 1; });
  const auto encode = [](const int&) { return std::string("x"); };
  {
    std::string element = "http://example.org/element";  // not there any more when the thing is added
    v.representation(" Image/Raw ; A=\"b c\"", encode, {Iri(element), {1}}).representation("image/x^y", encode);
    element.assign(element.size(), '?');
  }
  bench.add(std::move(thing));
  CHECK(bench.ask("GET /a/v\nAccept: image/raw;a=\"b c\"").field("Content-Type") == "image/raw;a=\"b c\"");
  CHECK(bench.ask("GET /a/v\nAccept: image/x^y").status == 200);
  const Answer turtle = bench.get("/a/v");
  CHECK(turtle.field("Content-Type") == "text/turtle");
  CHECK(missing(turtle, "[] lrt:elementType <http://example.org/element> .") == "");
  CHECK(turtle.links_to("http://localhost/a/v?accept=image/raw%3Ba%3D%22b%20c%22", "alternate"));
  CHECK(bench.get("/a/v?accept=image/raw%3Ba%3D%22b%20c%22").body == "x");
}

TEST_CASE("text says its charset wherever it goes, and the pages of a container have their own alternates", "[engine][json_ld][R1.2]") {
  engine::EngineOptions options;
  options.max_page_members = 2;
  Bench bench(std::move(options));
  Thing thing{"a"};
  thing.action("say", [] { return std::string("\u00e4"); });
  bench.add(std::move(thing));
  bench.add(Thing{"b"});
  bench.add(Thing{"c"});
  const Answer said = bench.ask("POST /a/actions/say\nAccept: text/plain");
  CHECK(said.field("Content-Type") == "text/plain; charset=utf-8");
  CHECK(said.body == "\u00e4");
  CHECK(bench.get("/?page=2").links_to("http://localhost/?page=2&accept=application/ld+json", "alternate"));
  CHECK(bench.get("/?page=2&accept=application/ld+json").says("/c"));
}

TEST_CASE("a text beyond ASCII says its charset in every response, and its entity tag stays", "[engine][json_ld][R1.2][R0.11]") {
  Bench bench;
  Thing thing{"a"};
  auto text = thing.property<std::string>("v").on_write([](const std::string&) {});
  auto number = thing.property<int>("n");
  number.representation("text/csv", [](int n) { return std::string(n == 0   ? "0"
                                                                   : n == 1 ? "\u00b0"
                                                                            : "\xB0"); })
      .representation("text/x; charset=iso-8859-1", [](int) { return std::string("\u00b0"); });
  number.publish(0);
  thing.action("say", [](std::string s) { return s; });
  text.publish("plain");
  bench.add(std::move(thing));
  const std::string turtle = "text/turtle", wide = "text/turtle; charset=utf-8";
  const auto type = [&](const std::string& request) { return std::string(bench.ask(request).field("Content-Type")); };
  CHECK(type("GET /a/v") == turtle);
  CHECK(type("HEAD /a/v") == turtle);
  CHECK(type("GET /a") == turtle);
  CHECK(type("GET /a/state") == turtle);
  text.publish("Gr\u00fc\u00dfe");
  bench.look();
  for (const char* request : {"GET /a/v", "HEAD /a/v", "GET /a/v\nOrigin: http://elsewhere", "GET /a/v?accept=text/turtle", "GET /a/state",
                              "GET /all", "GET /a/v\nAccept: text/turtle;charset=utf-8", "GET /a/v\nRange: bytes=0-3", "GET /a/v\nAccept: text/*"}) {
    INFO(request);
    CHECK(type(request) == wide);
  }
  // The other media types fix their encoding.
  for (const char* other : {"application/n-triples", "application/trig", "application/n-quads", "application/json"})
    CHECK(type(std::string("GET /a/v\nAccept: ") + other) == other);
  CHECK(type("GET /a/v\nAccept: text/plain") == "text/plain; charset=utf-8");
  const Answer whole = bench.get("/a/v");
  const Answer part = bench.send("GET /a/v\nRange: bytes=0-3\nIf-Range: " + std::string(whole.field("ETag"))).answer;
  CHECK(part.status == 206);
  CHECK(part.field("Content-Type") == wide);
  CHECK(part.field("ETag") == whole.field("ETag"));
  const Answer same = bench.send("GET /a/v\nIf-None-Match: " + std::string(whole.field("ETag"))).answer;
  CHECK(same.status == 304);
  CHECK(same.field("Content-Type").empty());
  CHECK(whole.field("ETag") == http::entity_tag("text/turtle", whole.body));
  // A result and an error.
  CHECK(type("POST /a/actions/say\nContent-Type: application/json\nAccept: text/turtle\n\n\"\u00fc\"") == wide);
  CHECK(type("POST /a/actions/say\nContent-Type: application/json\nAccept: text/turtle\n\n\"u\"") == turtle);
  CHECK(type("PUT /a/v\nContent-Type: application/ld+json\nAccept: text/turtle\n\n{\"@id\": \"a: \u00fc\"}") == wide);
  CHECK(type("PUT /a/v\nContent-Type: application/ld+json\nAccept: text/turtle\n\n{\"@id\": \"a: u\"}") == turtle);
  // A format of the host: only what is UTF-8 beyond doubt, and what the host has not stated.
  const auto csv = [&](int n) {
    number.publish(n);
    bench.look();
    return type("GET /a/n\nAccept: text/csv");
  };
  CHECK(csv(0) == "text/csv");
  CHECK(csv(1) == "text/csv; charset=utf-8");
  CHECK(csv(2) == "text/csv");
  CHECK(type("GET /a/n\nAccept: text/x") == "text/x;charset=iso-8859-1");
}

TEST_CASE("a property as a file gives its bytes to a client that accepts anything, and is not in the state", "[engine][R0.17][R1.2]") {
  int made = 0;
  Bench bench;
  Thing thing{"arm"};
  thing.property("map", [] { return 7; })
      .representation("model/stl", [&](int n) { return ++made, std::string(static_cast<std::size_t>(n), 'x'); })
      .as_file();
  thing.property<int>("n").publish(1);
  bench.add(std::move(thing));
  CHECK(bench.ask("GET /arm/state\nAccept: application/json").body == "{\"n\":1}");
  CHECK(missing(bench.get("/arm"), "<arm> hybrit:property <arm/map> .") == "");
  CHECK(violations([&](const std::string& path) { return bench.get(path); }, "/arm") == "");
  CHECK(made == 0);
  const Answer bytes = bench.get("/arm/map");
  CHECK(bytes.field("Content-Type") == "model/stl");
  CHECK(bytes.body == "xxxxxxx");
  CHECK(bench.ask("GET /arm/map\nIf-None-Match: " + bytes.field("ETag")).status == 304);
  CHECK(bench.ask("GET /arm/map\nRange: bytes=2-3").body == "xx");
  const Answer described = bench.ask("GET /arm/map\nAccept: text/turtle");
  CHECK(missing(described,
                "<arm/map> dcterms:hasFormat <arm/map?accept=model/stl> . <arm/map?accept=model/stl> dcat:byteSize "
                "\"7\"^^xsd:nonNegativeInteger .") == "");
  CHECK(made == 1);
}
