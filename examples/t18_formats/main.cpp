// SPDX-License-Identifier: Apache-2.0
// Further formats of a value: JSON, text and CBOR are built in. Pictures, tables or raw numbers need encoders of your own. The RDF lists each
// format with its size, so that a client finds the bytes and their meaning.
#include <array>
#include <cstdint>
#include <memory>
#include <string>

#include <lrt/lrt.hpp>

#include "examples/lesson.hpp"

/// A frame of the camera. Its time stamp and number are in the RDF, so that two frames are different values; the picture is not in the RDF.
struct Frame {
  std::uint32_t number = 0;
  std::uint16_t width = 0, height = 0;
  lrt::Bytes picture;  // shared by all clients without a copy
};

template <>
struct lrt::rdf::traits<Frame> : lrt::rdf::Record<Frame> {
  static void describe(Record<Frame>& r) {
    r.field("number", &Frame::number);
    r.field("width", &Frame::width);
    r.field("height", &Frame::height);
  }
};

int main() {
  lrt::Thing head{"head"};
  auto image = head.property<Frame>("image");
  image.representation("image/x-portable-graymap", [](const Frame& f) { return f.picture; });
  image.frame(lrt::Object::resource("head/optical_frame"));

  std::array<double, 2> angles{0.25, -1};
  head.property(
          "angles", [&] { return angles; }, lrt::unit::radian)
      .octets()  // also application/octet-stream, for GET and PUT
      .on_write([&](const std::array<double, 2>& a) { angles = a; });

  lrt::Server server = lrt::Server::create(lesson::options()).value();
  server.add(std::move(head)).value();
  server.add(lrt::Thing{"head/optical_frame"}).value();  // the frame of the picture
  image.publish({1, 4, 2, std::make_shared<const std::string>("P2 4 2 3\n0 1 2 3\n3 2 1 0\n")});

  lesson::Visitor visitor(server, [](lesson::Client& client) {
    client.get("/head/image");
    client.get("/head/image", "Accept: image/*\r\n");   // as a browser requests a picture
    client.get("/head/image?accept=application/json");  // for clients that cannot set header fields
    client.put_as("application/json", "/head/angles", R"([0.5, {"value": 0, "unit": "rad"}])");
    client.get("/head/angles", "Accept: text/plain\r\n");
    client.put_as("application/json", "/head/angles", R"([0.5, {"value": 0, "unit": "deg"}])");
    client.get("/head/state", "Accept: application/json\r\n");
  });
  server.run();
}

// Output:
// GET /head/image
// 200 OK
// Content-Type: text/turtle
// <http://127.0.0.1:8080/head/image> a hybrit:Property, <http://127.0.0.1:8080/ns/vocabulary#Frame> ;
//     rdfs:seeAlso <http://127.0.0.1:8080/head> ;
//     <http://127.0.0.1:8080/ns/vocabulary#Frame/number> "1"^^xsd:unsignedInt ;
//     <http://127.0.0.1:8080/ns/vocabulary#Frame/width> "4"^^xsd:unsignedShort ;
//     <http://127.0.0.1:8080/ns/vocabulary#Frame/height> "2"^^xsd:unsignedShort ;
//     dcterms:modified "<time>"^^xsd:dateTime ;
//     lrt:frame <http://127.0.0.1:8080/head/optical_frame> ;
//     dcterms:hasFormat <http://127.0.0.1:8080/head/image?accept=image/x-portable-graymap> ;
//     hybrit:subscriptions <http://127.0.0.1:8080/head/subscriptions> ;
//     hybrit:websocketUrl "ws://127.0.0.1:8080/head/image"^^xsd:anyURI .
//
// <http://127.0.0.1:8080/head/image?accept=image/x-portable-graymap> a dcat:Distribution ;
//     dcterms:format "image/x-portable-graymap" ;
//     dcat:mediaType <https://www.iana.org/assignments/media-types/image/x-portable-graymap> ;
//     dcat:byteSize "25"^^xsd:nonNegativeInteger .
//
// GET /head/image
// Accept: image/*
// 200 OK
// Content-Type: image/x-portable-graymap
// P2 4 2 3
// 0 1 2 3
// 3 2 1 0
//
// GET /head/image?accept=application/json
// 200 OK
// Content-Type: application/json
// {"number":1,"width":4,"height":2}
//
// PUT /head/angles
// Content-Type: application/json
//   [0.5, {"value": 0, "unit": "rad"}]
// 204 No Content
//
// GET /head/angles
// Accept: text/plain
// 200 OK
// Content-Type: text/plain; charset=utf-8
// [0.5,0]
//
// PUT /head/angles
// Content-Type: application/json
//   [0.5, {"value": 0, "unit": "deg"}]
// 422 Unprocessable Content
// Content-Type: application/problem+json
// {"type":"about:blank","title":"Unprocessable Content","status":422,"detail":"body: at \"/1/unit\": expected \"rad\", found \"deg\"","errors":[{"detail":"expected \"rad\", found \"deg\"","pointer":"#/1/unit"}]}
//
// GET /head/state
// Accept: application/json
// 200 OK
// Content-Type: application/json
// {"image":{"number":1,"width":4,"height":2},"angles":[0.5,0]}
