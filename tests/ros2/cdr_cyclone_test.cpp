// SPDX-License-Identifier: Apache-2.0
// CDR as Cyclone DDS writes and reads it, in this process: what a writer of its own types has written is decoded, and what is encoded here is read by its
// types.
#include <lrt/ros2/message_type.hpp>

#include <unistd.h>

#include <cstdint>
#include <string>
#include <vector>

#include <dds/dds.h>
#include <dds/ddsi/ddsi_serdata.h>

#include <lrt/ros2/definitions.hpp>

#include "lrt_codec.h"
#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::ros2;
using Value = rdf::Value;

namespace {

/// A writer and a reader of one topic, on loopback.
class Both {
 public:
  Both() {
    const std::string xml =
        "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name=\"lo\" multicast=\"false\"/></Interfaces>"
        "<AllowMulticast>false</AllowMulticast></General></Domain></CycloneDDS>";
    const auto domain = static_cast<dds_domainid_t>(100 + ::getpid() % 100);
    domain_ = dds_create_domain(domain, xml.c_str());
    REQUIRE(domain_ > 0);
    participant_ = dds_create_participant(domain, nullptr, nullptr);
    REQUIRE(participant_ > 0);
    topic_ = dds_create_topic(participant_, &lrt_codec_All_desc, "codec", nullptr, nullptr);
    dds_qos_t* qos = dds_create_qos();
    dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(10));
    dds_qset_history(qos, DDS_HISTORY_KEEP_ALL, 0);
    reader_ = dds_create_reader(participant_, topic_, qos, nullptr);
    writer_ = dds_create_writer(participant_, topic_, qos, nullptr);
    dds_delete_qos(qos);
    REQUIRE(writer_ > 0);
    REQUIRE(reader_ > 0);
  }
  ~Both() { dds_delete(domain_); }

  /// The payload of a sample, as Cyclone writes it.
  std::string payload_of(const lrt_codec_All& sample) {
    REQUIRE(dds_write(writer_, &sample) == DDS_RETCODE_OK);
    ddsi_serdata* data = nullptr;
    dds_sample_info_t info;
    REQUIRE(dds_takecdr(reader_, &data, 1, &info, DDS_ANY_STATE) == 1);  // of this process: it is there at once
    std::string bytes(ddsi_serdata_size(data), '\0');
    ddsi_serdata_to_ser(data, 0, bytes.size(), bytes.data());
    type_ = data->type;  // the topic's
    ddsi_serdata_unref(data);
    return bytes;
  }
  /// Has Cyclone read a payload, after payload_of(); the sample is Cyclone's, until the next call.
  const lrt_codec_All* sample_of(std::string payload) {
    ddsrt_iovec_t part;
    part.iov_base = payload.data();
    part.iov_len = payload.size();
    ddsi_serdata* data = ddsi_serdata_from_ser_iov(type_, SDK_DATA, 1, &part, payload.size());
    if (!data) return nullptr;
    REQUIRE(dds_writecdr(writer_, data) == DDS_RETCODE_OK);
    if (taken_) dds_return_loan(reader_, &taken_, 1);
    taken_ = nullptr;
    dds_sample_info_t info;
    REQUIRE(dds_take(reader_, &taken_, &info, 1, 1) == 1);
    return static_cast<const lrt_codec_All*>(taken_);
  }

 private:
  dds_entity_t domain_ = 0, participant_ = 0, topic_ = 0, reader_ = 0, writer_ = 0;
  void* taken_ = nullptr;
  const ddsi_sertype* type_ = nullptr;
};

template <class... Members>
Value list(Members... members) {
  Value::Sequence sequence;
  (sequence.push_back(std::move(members)), ...);
  return Value(std::move(sequence));
}
Value text(std::string s) { return Value(std::move(s)); }
Value integer(std::int64_t n) { return Value(n); }

}  // namespace

TEST_CASE("payloads are those of Cyclone DDS, wide strings as numbers of 32 bits", "[ros2]") {
  Definitions known;
  known.add_text("demo/msg/Part", "byte flag\nstring name\nfloat64[] numbers\n").value();
  known.add_text("demo/msg/All", "bool a\nwstring b\nint64 c\nwstring[] d\nuint8[3] e\nPart[] f\nfloat32 g\nstring h\nuint64 i\n").value();
  const MessageType type = MessageType::of(known.message("demo/msg/All").value()).value();
  const Value value = list(Value(true), text("w\xc3\xa4\xf0\x9f\xa4\x96"), integer(-5), list(text(""), text("ab"), text("\xe3\x83\x8f")),
                           text("AQID"), list(list(integer(7), text("x"), list(Value(1.5), Value(-2.5))), list(integer(0), text(""), list())),
                           Value(0.25), text("h\xc3\xa4"), integer(9));

  std::uint32_t b[] = {'w', 0xE4, 0xD83E, 0xDD16}, d1[] = {'a', 'b'}, d2[] = {0x30CF};
  double numbers[] = {1.5, -2.5};
  char x[] = "x", none[] = "", h[] = "h\xc3\xa4";
  lrt_codec_Wide d[3] = {};
  d[1]._length = d[1]._maximum = 2, d[1]._buffer = d1;
  d[2]._length = d[2]._maximum = 1, d[2]._buffer = d2;
  lrt_codec_Part f[2] = {};
  f[0].flag = 7, f[0].name = x, f[0].numbers._length = f[0].numbers._maximum = 2, f[0].numbers._buffer = numbers;
  f[1].name = none;
  lrt_codec_All all = {};
  all.a = true;
  all.b._length = all.b._maximum = 4, all.b._buffer = b;
  all.c = -5;
  all.d._length = all.d._maximum = 3, all.d._buffer = d;
  all.e[0] = 1, all.e[1] = 2, all.e[2] = 3;
  all.f._length = all.f._maximum = 2, all.f._buffer = f;
  all.g = 0.25F;
  all.h = h;
  all.i = 9;

  Both cyclone;
  const std::string theirs = cyclone.payload_of(all);
  REQUIRE(type.decode(theirs));
  CHECK(rdf::same(type.decode(theirs).value(), value));
  const std::string ours = type.encode(value).value();
  CHECK(theirs.substr(0, 2) == ours.substr(0, 2));
  REQUIRE(theirs.size() >= ours.size());
  CHECK(theirs.size() - ours.size() < 4);  // padding behind the end, which the options of the encapsulation count
  CHECK(theirs.substr(4, ours.size() - 4) == ours.substr(4));
  for (const bool little : {true, false}) {
    const lrt_codec_All* const read = cyclone.sample_of(type.encode(value, little).value());
    REQUIRE(read);
    CHECK(read->a);
    CHECK(std::vector<std::uint32_t>(read->b._buffer, read->b._buffer + read->b._length) == std::vector<std::uint32_t>(std::begin(b), std::end(b)));
    CHECK(read->c == -5);
    REQUIRE(read->d._length == 3);
    CHECK(read->d._buffer[2]._buffer[0] == 0x30CF);
    REQUIRE(read->f._length == 2);
    CHECK(std::string(read->f._buffer[0].name) == "x");
    CHECK(read->f._buffer[0].numbers._buffer[1] == -2.5);
    CHECK(read->g == 0.25F);
    CHECK(std::string(read->h) == h);
    CHECK(read->i == 9);
  }
}
