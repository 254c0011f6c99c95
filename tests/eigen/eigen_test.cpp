// SPDX-License-Identifier: Apache-2.0
#include <lrt/eigen.hpp>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/value_codec.hpp>
#include <lrt/shacl/derive.hpp>
#include <lrt/shacl/shapes.hpp>
#include <lrt/shacl/validator.hpp>

#include "src/rdf/plain.hpp"
#include "tests/support/bench.hpp"
#include "tests/support/blueprint.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/graphs.hpp"

using namespace lrt;
using rdf::Facets;
using rdf::traits;
using rdf::Value;
using test::Answer;
using test::Bench;

namespace {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Bounded6d = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 6, 1>;
using Points = Eigen::Matrix<double, Eigen::Dynamic, 3>;
using RowMajor3d = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
using RowMajorPose = Eigen::Transform<double, 3, Eigen::Isometry, Eigen::RowMajor>;

const rdf::TermView here = rdf::iri("http://localhost/x");
constexpr const char* vocabulary = "http://localhost/ns/vocabulary#";
constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

template <class T>
rdf::Graph graph_of(const T& value, const Facets& facets = {}) {
  rdf::Graph graph;
  rdf::write_value(graph, graph.intern(here), traits<T>::type(), facets, traits<T>::encode(value), vocabulary);
  return graph;
}

/// The value at <x> as a T; an error if reading or the type refuses it.
template <class T>
Result<T> value_of(const rdf::Graph& graph, const Facets& facets = {}) {
  const auto focus = graph.find(here);
  if (!focus) return unexpected(Errc::expected_value, "nothing is said of <x>");
  std::vector<rdf::Mismatch> mismatches;
  Result<Value> read = rdf::read_value(graph, *focus, traits<T>::type(), facets, vocabulary, mismatches);
  if (!read) return Unexpected{read.error()};
  return traits<T>::decode(*read);
}

/// Whether <x> conforms to the shape of the type.
template <class T>
bool conforms(const rdf::Graph& graph, const Facets& facets = {}) {
  rdf::Graph shapes;
  const rdf::TermView shape = rdf::iri("http://localhost/blueprint#x");
  shacl::derive(shapes, shapes.intern(shape), traits<T>::type(), facets, vocabulary);
  const Result<shacl::Report> report = shacl::validate(shacl::Shapes::compile(shapes).value(), graph, here, shape);
  if (!report->conforms()) UNSCOPED_INFO(report->to_text());
  return report->conforms();
}

template <class T>
bool is_back(const Result<T>& back, const T& value) {
  if (!back) UNSCOPED_INFO(back.error().message);
  return back && traits<T>::same(*back, value);
}

template <class T>
bool survives(const T& value, const Facets& facets = {}) {
  const rdf::Graph graph = graph_of(value, facets);
  return is_back(value_of<T>(graph, facets), value) && conforms<T>(graph, facets);
}

/// The same through each syntax.
template <class T>
bool survives_text(const T& value, const Facets& facets = {}) {
  for (const rdf::Syntax syntax : rdf::available_syntaxes()) {
    rdf::ReadOptions options;
    options.base = "http://localhost/";
    const rdf::Graph back = rdf::read(rdf::write(graph_of(value, facets), syntax).value(), syntax, options).value();
    if (!is_back(value_of<T>(back, facets), value) || !conforms<T>(back, facets)) return false;
  }
  return true;
}

class Random {
 public:
  /// Any finite number, from random bits.
  template <class S>
  S number() {
    if constexpr (std::is_integral_v<S>) {
      return static_cast<S>(bits_());
    } else {
      S s;
      do {
        const std::uint64_t bits = bits_();
        std::memcpy(&s, &bits, sizeof s);
      } while (!std::isfinite(s));
      return s;
    }
  }
  template <class M>
  M matrix(Eigen::Index rows = M::RowsAtCompileTime, Eigen::Index columns = M::ColsAtCompileTime) {
    M m;
    m.resize(rows, columns);
    for (Eigen::Index r = 0; r < rows; ++r)
      for (Eigen::Index c = 0; c < columns; ++c) m(r, c) = number<typename M::Scalar>();
    return m;
  }
  template <class S>
  Eigen::Quaternion<S> rotation() {
    std::normal_distribution<double> normal;
    return Eigen::Quaterniond(normal(bits_), normal(bits_), normal(bits_), normal(bits_)).normalized().cast<S>();
  }
  template <class T>
  T pose() {
    T t = T::Identity();
    t.linear() = rotation<typename T::Scalar>().toRotationMatrix();
    t.translation() = matrix<Eigen::Matrix<typename T::Scalar, 3, 1>>();
    return t;
  }
  template <class T>
  T affine() {
    T t = T::Identity();
    t.linear() = matrix<Eigen::Matrix<typename T::Scalar, 3, 3>>();
    t.translation() = matrix<Eigen::Matrix<typename T::Scalar, 3, 1>>();
    return t;
  }

 private:
  std::mt19937_64 bits_{20261121};
};

/// The sentence of a refusal.
template <class T>
std::string refusal(const Result<T>& result) {
  if (result) return "it was taken";
  CHECK(result.error().code == Errc::expected_value);
  return result.error().message;
}
bool says(const std::string& text, const std::string& what) {
  UNSCOPED_INFO(text);
  return text.find(what) != std::string::npos;
}

/// Coordinates or a list as a value.
Value numbers(std::initializer_list<double> all) {
  Value::Sequence s;
  for (const double d : all) s.emplace_back(d);
  return Value(std::move(s));
}
Value sequence(std::initializer_list<Value> all) { return Value(Value::Sequence(all)); }

struct Grasp {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
  std::optional<Vector6d> wrench;
};

}  // namespace

template <>
struct lrt::rdf::traits<Grasp> : lrt::rdf::Record<Grasp> {
  static void describe(Record<Grasp>& r) {
    r.field("point", &Grasp::point).unit(lrt::unit::metre);
    r.field("orientation", &Grasp::orientation);
    r.field("wrench", &Grasp::wrench);
  }
};

TEST_CASE("every finite vector and matrix reads back bit-identically", "[eigen][R0.5]") {
  Random random;
  const auto check = [&](auto make, int through_graph = 200, int through_text = 5) {
    for (int i = 0; i < through_graph; ++i)
      if (!survives(make())) FAIL("in graph " << i);
    for (int i = 0; i < through_text; ++i)
      if (!survives_text(make())) FAIL("in text " << i);
  };
  check([&] { return random.matrix<Eigen::Vector2d>(); });
  check([&] { return random.matrix<Eigen::Vector3d>(); });
  check([&] { return random.matrix<Eigen::Vector4d>(); });
  check([&] { return random.matrix<Eigen::Vector3f>(); });
  check([&] { return random.matrix<Eigen::RowVector3d>(); });
  check([&] { return random.matrix<Eigen::Vector2i>(); });
  check([&] { return random.matrix<Eigen::Matrix<std::uint8_t, 4, 1>>(); });
  check([&] { return random.matrix<Eigen::Matrix<double, 1, 1>>(); });
  check([&] { return random.matrix<Vector6d>(); });
  check([&] { return random.matrix<Bounded6d>(5, 1); });
  check([&] { return random.matrix<Eigen::VectorXd>(11, 1); });
  check([&] { return random.matrix<Eigen::RowVectorXf>(1, 7); });
  check([&] { return random.matrix<Eigen::Matrix2f>(); }, 50);
  check([&] { return random.matrix<Eigen::Matrix3d>(); }, 50);
  check([&] { return random.matrix<RowMajor3d>(); }, 50);
  check([&] { return random.matrix<Eigen::Matrix<double, 6, 7>>(); }, 10, 2);
  check([&] { return random.matrix<Eigen::MatrixXd>(4, 5); }, 10, 2);
  check([&] { return random.matrix<Points>(9, 3); }, 10, 2);
  check([&] { return random.matrix<Eigen::MatrixXi>(2, 3); }, 10, 2);
  check([&] { return Eigen::Translation3d(random.matrix<Eigen::Vector3d>()); });
  check([&] { return Eigen::Translation3f(random.matrix<Eigen::Vector3f>()); });
  check([&] { return random.affine<Eigen::Affine3d>(); }, 50);
  check([&] { return random.affine<Eigen::AffineCompact3f>(); }, 50);
}

TEST_CASE("a rotation and a pose read back bit-identically", "[eigen][R0.5]") {
  Random random;
  const auto check = [&](auto make) {
    for (int i = 0; i < 100; ++i)
      if (!survives(make())) FAIL("in graph " << i);
    for (int i = 0; i < 5; ++i)
      if (!survives_text(make())) FAIL("in text " << i);
  };
  check([&] { return random.rotation<double>(); });
  check([&] { return random.rotation<float>(); });
  check([&] { return Eigen::AngleAxisd(random.number<double>(), random.rotation<double>().vec().normalized()); });
  check([&] { return Eigen::AngleAxisf(random.number<float>(), random.rotation<float>().vec().normalized()); });
  check([&] { return random.pose<Eigen::Isometry3d>(); });
  check([&] { return random.pose<Eigen::Isometry3f>(); });
  check([&] { return random.pose<RowMajorPose>(); });
  // Rotations by half a turn have a quaternion with w = 0, and products of many drift.
  for (const Eigen::Vector3d& axis : {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(0, 0, 1)})
    CHECK(survives(Eigen::Isometry3d(Eigen::AngleAxisd(3.14159265358979323846, axis))));
  Eigen::Isometry3d drifted = Eigen::Isometry3d::Identity();
  for (int i = 0; i < 10'000; ++i) drifted = drifted * random.rotation<double>();
  CHECK(survives(drifted));
  CHECK(survives(Eigen::Quaterniond(-1, 0, -0.0, 0)));
  CHECK(survives(std::optional<Eigen::Quaterniond>(Eigen::Quaterniond(0, 1, 0, 0))));
  CHECK(survives(std::optional<Eigen::Translation3d>(Eigen::Translation3d(1, 2, 3)), Facets{unit::metre}));
  CHECK(survives_text(std::vector<Eigen::Isometry3d>{drifted, Eigen::Isometry3d::Identity()}, Facets{unit::metre}));
}

TEST_CASE("the terms are those of Figure 3 and of ARVIDA", "[eigen][R1.5]") {
  CHECK(
      test::missing(graph_of(Eigen::AngleAxisd(0.5, Eigen::Vector3d(0, 0, 1))),
                    "<x> a spatial:AxisAngle, spatial:Rotation3D ; spatial:rotationAngle [ a maths:Scalar ; vom:numericalValue \"0.5\"^^xsd:double ;"
                    " vom:unit maths:Radian ; qudt:hasUnit unit:RAD ] ; spatial:rotationAxis [ a maths:Vector3D ; maths:x \"0\"^^xsd:double ;"
                    " maths:y \"0\"^^xsd:double ; maths:z \"1\"^^xsd:double ] .") == "");
  CHECK(test::missing(graph_of(Eigen::Quaternionf(0.5F, 0.5F, -0.5F, 0.5F)),
                      "<x> a spatial:Rotation3D ; vom:quantityKind vom:Angle ; vom:quantityValue [ a maths:Quaternion, maths:Vector4D ;"
                      " maths:x \"0.5\"^^xsd:float ; maths:y \"-0.5\"^^xsd:float ; maths:w \"0.5\"^^xsd:float ] .") == "");
  CHECK(test::missing(graph_of(Eigen::Vector2i(1, 2)), "<x> a maths:Vector2D ; maths:x \"1\"^^xsd:int ; maths:y \"2\"^^xsd:int .") == "");
  CHECK(test::missing(graph_of(Eigen::Vector4d(1, 2, 3, 4)), "<x> a maths:Vector4D ; maths:z \"3\"^^xsd:double ; maths:w \"4\"^^xsd:double .") == "");
  Eigen::Isometry3d pose(Eigen::Quaterniond(0, 0, 0, 1));
  pose.translation() << 1, 2, 3;
  const rdf::Graph posed = graph_of(pose, Facets{unit::metre});
  CHECK(test::missing(
            posed,
            "<x> a spatial:SpatialRelationship ; spatial:translation [ a spatial:Translation3D ; qudt:hasUnit unit:M ; vom:quantityKind vom:Length ;"
            " vom:quantityValue [ a maths:Vector3D ; maths:x \"1\"^^xsd:double ; maths:y \"2\"^^xsd:double ; maths:z \"3\"^^xsd:double ] ] ;"
            " spatial:rotation [ a spatial:Rotation3D ; vom:quantityValue [ a maths:Quaternion ; maths:z \"1\"^^xsd:double ;"
            " maths:w \"0\"^^xsd:double ] ] ; lrt:matrix ( ( \"-1\"^^xsd:double \"0\"^^xsd:double \"0\"^^xsd:double ) [] [] ) .") == "");
  const auto units = posed.match(std::nullopt, posed.find(vocab::qudt::hasUnit), std::nullopt);
  CHECK(std::distance(units.begin(), units.end()) == 1);  // that of the translation: a rotation has none
}

TEST_CASE("the unit of a pose is that of its translation, in JSON too", "[eigen]") {
  const Facets metre{unit::metre};
  const Eigen::Isometry3d pose(Eigen::Translation3d(1, 2, 3));
  const rdf::Type& type = traits<Eigen::Isometry3d>::type();
  const std::string json = rdf::write_plain(type, metre, traits<Eigen::Isometry3d>::encode(pose), rdf::Plain::json_with_units).value();
  CHECK(json.find(R"({"translation":{"value":{"x":1,"y":2,"z":3},"unit":"m"},"rotation":{"x":0,)") == 0);
  for (const std::string& text : {json, std::string(R"({"translation":{"x":1,"y":2,"z":3},"rotation":{"x":0,"y":0,"z":0,"w":1}})")}) {
    CAPTURE(text);
    rdf::Graph graph;
    REQUIRE(rdf::read_plain(text, rdf::Plain::json, type, metre, vocabulary, 1000, graph, graph.intern(here)));
    CHECK(is_back(value_of<Eigen::Isometry3d>(graph, metre), pose));
    CHECK(conforms<Eigen::Isometry3d>(graph, metre));
  }
  rdf::Graph graph;
  CHECK_FALSE(rdf::read_plain(R"({"value":{"translation":{"x":1,"y":2,"z":3},"rotation":{"x":0,"y":0,"z":0,"w":1}},"unit":"m"})", rdf::Plain::json,
                              type, metre, vocabulary, 1000, graph, graph.intern(here)));
}

TEST_CASE("a matrix is a list of its rows in any storage order", "[eigen]") {
  Eigen::Matrix<int, 2, 3> columns;
  columns << 1, 2, 3, 4, 5, 6;
  const Eigen::Matrix<int, 2, 3, Eigen::RowMajor> rows = columns;
  const char* const expected =
      "<x> rdf:value ( ( \"1\"^^xsd:int \"2\"^^xsd:int \"3\"^^xsd:int ) ( \"4\"^^xsd:int \"5\"^^xsd:int \"6\"^^xsd:int ) ) .";
  CHECK(test::missing(graph_of(columns), expected) == "");
  CHECK(test::missing(graph_of(rows), expected) == "");
  CHECK(value_of<Eigen::MatrixXi>(test::turtle("<x> rdf:value ( ( 1 2 3 ) ( 4 5 6 ) ) .")).value() == columns);
}

TEST_CASE("an empty matrix keeps the size that its representation shows", "[eigen]") {
  CHECK(survives_text(Eigen::VectorXd()));
  CHECK(survives_text(Eigen::MatrixXd()));
  CHECK(survives_text(Points(0, 3)));
  CHECK(survives(Eigen::MatrixXd(3, 0)));
  CHECK(value_of<Eigen::MatrixXd>(graph_of(Eigen::MatrixXd(0, 3))).value().size() == 0);
}

TEST_CASE("the shape and the reader refuse the same input", "[eigen][R0.6][R1.11]") {
  const auto refused = [](auto of, const std::string& said) {
    using T = decltype(of);
    CAPTURE(said);
    const rdf::Graph graph = test::turtle("<x> " + said + " .");
    CHECK_FALSE(conforms<T>(graph));
    CHECK(refusal(value_of<T>(graph)) != "it was taken");
  };
  refused(Eigen::Vector3d(), "maths:x 1 ; maths:y 2");
  refused(Eigen::Vector3d(), "maths:x 1 ; maths:y 2 ; maths:z 3 , 4");
  refused(Eigen::Vector3d(), "maths:x 1 ; maths:y 2 ; maths:z \"NaN\"^^xsd:double");
  refused(Eigen::Vector3d(), "maths:x 1 ; maths:y 2 ; maths:z \"INF\"^^xsd:double");
  refused(Eigen::Vector3d(), "maths:x 1 ; maths:y 2 ; maths:z \"3\"");
  refused(Eigen::Vector3f(), "maths:x 1 ; maths:y 2 ; maths:z 1e39");
  refused(Eigen::Vector2i(), "maths:x 1 ; maths:y 2.5");
  refused(Eigen::Quaterniond(), "vom:quantityValue [ maths:x 0 ; maths:y 0 ; maths:z 1 ]");
  refused(Eigen::Quaterniond(), "maths:x 0 ; maths:y 0 ; maths:z 1 ; maths:w 0");
  refused(Eigen::Quaterniond(), "vom:quantityValue [ maths:x 0 ; maths:y 0 ; maths:z 1 ; maths:w 0 ] , [ maths:x 0 ]");
  refused(Eigen::Quaterniond(), "vom:quantityValue 1");
  refused(Eigen::AngleAxisd(), "spatial:rotationAngle 1 ; spatial:rotationAxis [ maths:x 0 ; maths:y 0 ; maths:z 1 ]");
  refused(Eigen::AngleAxisd(),
          "spatial:rotationAngle [ vom:numericalValue 1 ; vom:unit maths:Degree ] ; spatial:rotationAxis [ maths:x 0 ; maths:y 0 ; maths:z 1 ]");
  refused(Vector6d(), "rdf:value ( 1 2 3 4 5 )");
  refused(Vector6d(), "rdf:value ( 1 2 3 4 5 6 7 )");
  refused(Vector6d(), "rdf:value ( 1 2 3 4 5 \"NaN\"^^xsd:float )");
  refused(Bounded6d(), "rdf:value ( 1 2 3 4 5 6 7 )");
  refused(Eigen::VectorXd(), "rdf:value 1");
  refused(Eigen::Matrix2d(), "rdf:value ( ( 1 2 ) ( 3 ) )");
  refused(Eigen::Matrix2d(), "rdf:value ( ( 1 2 ) ( 3 4 ) ( 5 6 ) )");
  refused(Eigen::MatrixXd(), "rdf:value ( ( 1 2 ) 3 )");
  const std::string shift = "spatial:translation [ vom:quantityValue [ maths:x 1 ; maths:y 2 ; maths:z 3 ] ] ; ";
  const std::string turn = "spatial:rotation [ vom:quantityValue [ maths:x 0 ; maths:y 0 ; maths:z 0 ; maths:w 1 ] ]";
  refused(Eigen::Isometry3d(), turn);
  refused(Eigen::Isometry3d(), shift + "lrt:matrix ( ( 1 0 0 ) ( 0 1 0 ) ( 0 0 1 ) )");
  refused(Eigen::Isometry3d(), shift + turn + " ; lrt:matrix ( ( 1 0 0 ) ( 0 1 0 ) )");
  refused(Eigen::Affine3d(), shift + turn);
  CHECK(value_of<Eigen::Isometry3d>(test::turtle("<x> " + shift + turn + " .")));
}

TEST_CASE("NaN and infinity are refused for Eigen types", "[eigen][R0.6]") {
  const double infinity = std::numeric_limits<double>::infinity();
  CHECK(refusal(traits<Eigen::Vector3d>::decode(numbers({1, not_a_number, 3}))) == "y: expected a finite number, found NaN");
  CHECK(refusal(traits<Eigen::Vector3f>::decode(numbers({1, 2, 1e39}))) == "z: expected a finite number, found INF");
  CHECK(refusal(traits<Eigen::VectorXd>::decode(numbers({1, 2, -infinity}))) == "[2]: expected a finite number, found -INF");
  CHECK(refusal(traits<Eigen::MatrixXd>::decode(sequence({numbers({1, 2}), numbers({3, infinity})}))) ==
        "[1]/[1]: expected a finite number, found INF");
  CHECK(refusal(traits<Eigen::Translation3d>::decode(numbers({infinity, 2, 3}))) == "x: expected a finite number, found INF");
  CHECK(refusal(traits<Eigen::Quaterniond>::decode(numbers({0, 0, 0, not_a_number}))) == "w: expected a finite number, found NaN");
  CHECK(refusal(traits<Eigen::AngleAxisd>::decode(sequence({Value(infinity), numbers({0, 0, 1})}))) ==
        "rotationAngle: expected a finite number, found INF");
  // The type refuses them even if the facets allow them.
  const Facets any = Facets{}.allow_non_finite();
  CHECK_FALSE(value_of<Eigen::VectorXd>(graph_of(Eigen::VectorXd(Eigen::Vector2d(1, infinity)), any), any));
  // Values that the robot publishes are shown.
  CHECK(test::missing(graph_of(Eigen::Vector2d(not_a_number, infinity)), "<x> maths:x \"NaN\"^^xsd:double ; maths:y \"INF\"^^xsd:double .") == "");
}

TEST_CASE("a wrong length is refused with the length that was found", "[eigen][R0.6]") {
  CHECK(refusal(traits<Eigen::Vector3d>::decode(numbers({1, 2}))) != "it was taken");
  CHECK(refusal(traits<Vector6d>::decode(numbers({1, 2, 3, 4, 5}))) == "expected a list of 6 members, found 5");
  CHECK(refusal(traits<Bounded6d>::decode(numbers({1, 2, 3, 4, 5, 6, 7}))) == "expected a list of at most 6 members, found 7");
  CHECK(refusal(traits<Eigen::Matrix2d>::decode(sequence({numbers({1, 2}), numbers({3})}))) == "[1]: expected a list of 2 members, found 1");
  CHECK(refusal(traits<Eigen::MatrixXd>::decode(sequence({numbers({1, 2}), numbers({3})}))) ==
        "expected rows of one length, found 2 members in row 0 and 1 in row 1");
  // A long first row does not make a large matrix.
  Value::Sequence ragged(5000, numbers({}));
  ragged[0] = Value(Value::Sequence(100'000, Value(1.0)));
  CHECK(says(refusal(traits<Eigen::MatrixXd>::decode(Value(std::move(ragged)))), "100000 members in row 0 and 0 in row 1"));
  CHECK(refusal(traits<Eigen::Quaterniond>::decode(Value(1.0))) != "it was taken");
  CHECK(refusal(traits<Eigen::AngleAxisd>::decode(numbers({1, 2, 3}))) != "it was taken");
  CHECK(refusal(traits<Eigen::Isometry3d>::decode(Value())) != "it was taken");
  CHECK(refusal(traits<Eigen::Affine3d>::decode(sequence({numbers({1, 2, 3})}))) != "it was taken");
  CHECK(refusal(traits<Eigen::MatrixXd>::decode(sequence({Value(1.0)}))) != "it was taken");
}

TEST_CASE("an invalid rotation is refused, and a valid one is not normalised", "[eigen][R0.6]") {
  CHECK(refusal(traits<Eigen::Quaterniond>::decode(numbers({0, 0, 0, 2}))) == "expected a quaternion of norm 1 within 1e-09, found a norm of 2");
  CHECK(refusal(traits<Eigen::Quaterniond>::decode(numbers({0, 0, 0, 0}))) == "expected a quaternion of norm 1 within 1e-09, found a norm of 0");
  CHECK(says(refusal(traits<Eigen::Quaterniond>::decode(numbers({1e308, 1e308, 1e308, 1e308}))), "found a norm of INF"));
  CHECK(says(refusal(traits<Eigen::AngleAxisd>::decode(sequence({Value(1.0), numbers({0, 0, 0.5})}))),
             "rotationAxis: expected a vector of length 1 within 1e-09, found a length of 0.5"));
  for (const double off : {9e-10, -9e-10}) {
    CHECK(traits<Eigen::Quaterniond>::decode(numbers({0, 0, 0, 1 + off})).value().w() == 1 + off);
    CHECK(traits<Eigen::AngleAxisd>::decode(sequence({Value(7.0), numbers({0, 1 + off, 0})})).value().axis()[1] == 1 + off);
  }
  for (const double off : {1.1e-9, -1.1e-9}) {
    CHECK_FALSE(traits<Eigen::Quaterniond>::decode(numbers({0, 0, 0, 1 + off})));
    CHECK_FALSE(traits<Eigen::AngleAxisd>::decode(sequence({Value(7.0), numbers({0, 1 + off, 0})})));
    CHECK(traits<Eigen::Quaternionf>::decode(numbers({0, 0, 0, 1 + off})));
  }
  CHECK_FALSE(traits<Eigen::Quaternionf>::decode(numbers({0, 0, 0, 1 + 2e-6})));
}

TEST_CASE("a pose is given by its quaternion; a matrix beside it must be the same rotation", "[eigen][R0.5][R0.6]") {
  const Value shift = numbers({1, 2, 3}), half = numbers({0, 0, 1, 0});
  const auto pose = [&](const Value& turn, const Value& matrix) { return traits<Eigen::Isometry3d>::decode(sequence({shift, turn, matrix})); };
  const auto rows = [](const Eigen::Matrix3d& m) { return traits<Eigen::Matrix3d>::encode(m); };
  const Eigen::Isometry3d of_quaternion = pose(half, Value()).value();
  CHECK(of_quaternion.matrix() == (Eigen::Matrix4d() << -1, 0, 0, 1, 0, -1, 0, 2, 0, 0, 1, 3, 0, 0, 0, 1).finished());

  Eigen::Matrix3d near = of_quaternion.linear();
  near(0, 1) = 4e-9;
  CHECK(pose(half, rows(near)).value().linear()(0, 1) == 4e-9);
  near(0, 1) = 2e-8;
  CHECK(says(refusal(pose(half, rows(near))),
             "matrix: expected a rotation matrix, its product with its transpose the identity within 1e-08, found a difference of "));
  const Eigen::Matrix3d reflection = Eigen::Vector3d(-1, -1, -1).asDiagonal();
  CHECK(says(refusal(pose(half, rows(reflection))), "found a reflection"));
  CHECK(says(refusal(pose(half, rows(Eigen::Matrix3d::Identity()))),
             "matrix: expected the rotation of the quaternion (or no matrix) within 1e-07, found a difference of 2"));
  CHECK(says(refusal(pose(numbers({0, 0, 1, 1}), rows(Eigen::Matrix3d::Identity()))), "rotation: expected a quaternion of norm 1"));

  // A value that is accepted at the edge of a tolerance can be read and written again.
  Random random;
  for (int i = 0; i < 1000; ++i) {
    const auto back_again = [](auto q, double off) {
      using S = typename decltype(q)::Scalar;
      using T = Eigen::Transform<S, 3, Eigen::Isometry>;
      q.coeffs() *= static_cast<S>(1 + off);
      const Result<T> taken = traits<T>::decode(sequence({numbers({0, 0, 0}), traits<decltype(q)>::encode(q), Value()}));
      return taken && is_back(traits<T>::decode(traits<T>::encode(*taken)), *taken);
    };
    if (!back_again(random.rotation<double>(), i % 2 ? 0.99e-9 : -0.99e-9)) FAIL(i);
    if (!back_again(random.rotation<float>(), i % 2 ? 0.7e-6 : -0.7e-6)) FAIL(i);
  }
}

TEST_CASE("an invalid pose that the robot publishes is shown unchanged", "[eigen]") {
  Eigen::Isometry3d broken = Eigen::Isometry3d::Identity();
  broken.linear() *= 2;
  CHECK(test::missing(graph_of(broken), "<x> spatial:rotation [ vom:quantityValue [ maths:w \"1\"^^xsd:double ] ] .") == "");
  CHECK(says(refusal(value_of<Eigen::Isometry3d>(graph_of(broken))), "matrix: expected a rotation matrix"));
  broken.linear().setConstant(not_a_number);
  CHECK_FALSE(value_of<Eigen::Isometry3d>(graph_of(broken)));
}

TEST_CASE("Eigen's types are fields, members and options like any other", "[eigen][R1.5]") {
  Random random;
  Grasp grasp{random.matrix<Eigen::Vector3d>(), random.rotation<double>(), std::nullopt};
  CHECK(survives_text(grasp));
  grasp.wrench = random.matrix<Vector6d>();
  CHECK(survives_text(grasp));
  CHECK(survives_text(std::array<Eigen::Vector3d, 2>{random.matrix<Eigen::Vector3d>(), random.matrix<Eigen::Vector3d>()}));
  CHECK(survives_text(std::vector<Eigen::Vector4f>(3, random.matrix<Eigen::Vector4f>())));
  CHECK(survives_text(Eigen::Vector3d(1, 2, 3), Facets{unit::metre}));
  CHECK(survives_text(random.pose<Eigen::Isometry3d>(), Facets{unit::millimetre}));
  CHECK(survives_text(Eigen::VectorXd(Eigen::Vector3d(1, 2, 3)), Facets{unit::radian}));
  CHECK_FALSE(value_of<Eigen::Vector3d>(graph_of(Eigen::Vector3d(1, 2, 3), Facets{unit::metre}), Facets{unit::millimetre}));
}

namespace {

/// A robot with a pose that is pushed, and a target, a tool and gains that are written.
struct Robot {
  Robot() {
    Thing arm{"arm"};
    pose = arm.property<Eigen::Isometry3d>("pose", unit::metre);
    arm.property("target", [this] { return target; }).on_write([this](const Eigen::Quaterniond& q) { target = q; });
    arm.property(
           "tool", [this] { return tool; }, unit::metre)
        .on_write([this](const Eigen::Isometry3d& t) { tool = t; });
    arm.property("gains", [this] { return gains; }).on_write([this](const Eigen::MatrixXd& m) { gains = m; });
    arm.property("axis", [this] { return axis; }).on_write([this](const Eigen::AngleAxisf& a) { axis = a; });
    arm.action("reach", [this](const Eigen::Vector3d& point) { reached = point; }).consumes(Facets{unit::metre});
    arm.action("turn", [this](const Eigen::Quaterniond& q) { target = q; });
    arm.action("push", [](const Vector6d& wrench) { return Vector6d(2 * wrench); });
    arm.collection<Eigen::Translation3d>("waypoints").on_create([](const std::string&, const Eigen::Translation3d&) { return Result<void>(); });
    bench.add(std::move(arm));
  }
  Answer put(const std::string& name, const std::string& said) { return bench.turtle("PUT", "/arm/" + name, "<> " + said + " ."); }
  Answer post(const std::string& name, const std::string& said) { return bench.turtle("POST", "/arm/actions/" + name, "<> " + said + " ."); }

  Bench bench;
  std::optional<PushedProperty<Eigen::Isometry3d>> pose;
  Eigen::Quaterniond target = Eigen::Quaterniond::Identity();
  Eigen::Isometry3d tool = Eigen::Isometry3d::Identity();
  Eigen::MatrixXd gains = Eigen::MatrixXd::Identity(2, 3);
  Eigen::AngleAxisf axis{0.25F, Eigen::Vector3f(0, 1, 0)};
  Eigen::Vector3d reached = Eigen::Vector3d::Zero();
};

}  // namespace

TEST_CASE("GET shows a pose with its unit, and the state conforms to the Blueprint", "[eigen][json_ld][R0.5][R1.5][R1.11]") {
  Robot r;
  Eigen::Isometry3d pose(Eigen::AngleAxisd(1.57079632679489661923, Eigen::Vector3d::UnitZ()));
  pose.translation() << 0.1, 0, -2;
  r.pose->publish(pose);
  r.bench.look();
  const Answer a = r.bench.get("/arm/pose");
  CHECK(a.status == 200);
  CHECK(test::missing(a.graph(),
                      "<arm/pose> a spatial:SpatialRelationship ; spatial:translation [ qudt:hasUnit unit:M ; vom:quantityValue [ maths:x "
                      "\"0.1\"^^xsd:double ] ] ;"
                      " spatial:rotation [ a spatial:Rotation3D ; vom:quantityValue [ maths:z \"0.7071067811865475\"^^xsd:double ] ] .") == "");
  CHECK(test::violations([&](const std::string& path) { return r.bench.get(path); }, "/arm") == "");
  const Answer json = r.bench.ask("GET /arm/pose\nAccept: application/ld+json");
  CHECK(says(json.body, "\"translation\": {\"id\": \"http://localhost/arm/pose#translation\"}"));
  CHECK(says(json.body, "\"type\": [\"Quaternion\", \"Vector4D\"]"));
  CHECK(says(json.body, "\"matrix\": {\"id\": \"http://localhost/arm/pose#matrix-0\"}"));
}

TEST_CASE("the sensor and the pose of docs/modelling.md are shown as it says", "[eigen][R1.9]") {
  Bench bench;
  double force = 3;
  lrt::Thing sensor{"arm/force"};
  sensor.type(lrt::Iri{"http://www.w3.org/ns/sosa/Sensor"});
  sensor
      .property(
          "force", [&] { return force; }, lrt::unit::newton)
      .predicate(lrt::Iri{"http://www.w3.org/ns/sosa/observes"})  // the Property is what the sensor observes
      .type(lrt::Iri{"http://www.w3.org/ns/sosa/ObservableProperty"});
  bench.add(std::move(sensor));
  lrt::Thing arm{"arm"};
  arm.property<Eigen::Isometry3d>("tool", lrt::unit::metre)
      .frame(lrt::Object::resource("arm/base"))  // spatial:sourceCoordinateSystem
      .add(lrt::vocab::spatial::targetCoordinateSystem, lrt::Object::resource("arm/flange"));
  bench.add(std::move(arm));
  CHECK(test::missing(bench.get("/arm/force").graph(), "<arm/force> <http://www.w3.org/ns/sosa/observes> <arm/force/force> .") == "");
  CHECK(test::missing(bench.get("/arm/force/force").graph(),
                      "<arm/force/force> a <http://www.w3.org/ns/sosa/ObservableProperty> ; qudt:hasUnit unit:N ;"
                      " qudt:hasQuantityKind <http://qudt.org/vocab/quantitykind/Force> ; lrt:datatype xsd:double .") == "");
  const rdf::Graph tool = bench.get("/arm/tool").graph();
  CHECK(test::missing(tool,
                      "<arm/tool> a spatial:SpatialRelationship ; spatial:sourceCoordinateSystem <arm/base> ;"
                      " spatial:targetCoordinateSystem <arm/flange> .") == "");
  CHECK(tool.find(rdf::TermView(vocab::qudt::hasUnit)) == std::nullopt);  // it has no translation yet
}

TEST_CASE("PUT accepts the response of GET for Eigen's types in every syntax", "[eigen][json_ld][R0.5]") {
  Robot r;
  r.tool = Eigen::Translation3d(1, 2, 1.0 / 3) * Eigen::Quaterniond(0.5, -0.5, 0.5, 0.5);
  for (const char* path : {"/arm/target", "/arm/tool", "/arm/gains", "/arm/axis"})
    for (const char* type : {"text/turtle", "application/n-triples", "application/rdf+xml", "application/ld+json"}) {
      CAPTURE(path, type);
      const Answer before = r.bench.ask(std::string("GET ") + path + "\nAccept: " + type);
      const Answer put = r.bench.ask(std::string("PUT ") + path + "\nContent-Type: " + type + "\nIf-Match: " + before.tag() + "\n\n" + before.body);
      CHECK(put.status == 204);
      CHECK(r.bench.ask(std::string("GET ") + path + "\nAccept: " + type).body == before.body);
    }
}

TEST_CASE("GET gives a matrix as octets row by row, with its shape in the RDF", "[eigen][R0.5][R1.2]") {
  const auto check = [](const auto& matrix, const std::string& element_type, const std::string& shape) {
    using M = std::decay_t<decltype(matrix)>;
    using S = typename M::Scalar;
    CAPTURE(element_type, shape);
    Bench bench;
    Thing thing{"a"};
    thing
        .property(
            "m", [&]() -> M { return matrix; }, unit::metre)
        .octets()
        .frame("base");
    bench.add(std::move(thing));
    std::string bytes;
    for (Eigen::Index r = 0; r < matrix.rows(); ++r)
      for (Eigen::Index c = 0; c < matrix.cols(); ++c) {
        std::uint64_t bits = 0;
        const S number = matrix(r, c);
        std::memcpy(&bits, &number, sizeof number);  // little-endian, as the machines that tests run on
        for (std::size_t b = 0; b < sizeof number; ++b) bytes += static_cast<char>(bits >> (8 * b) & 0xFF);
      }
    const Answer octets = bench.ask("GET /a/m\nAccept: application/octet-stream");
    CHECK(octets.status == 200);
    CHECK(octets.body == bytes);
    CHECK(test::missing(bench.get("/a/m").graph(), "<a/m?accept=application/octet-stream> dcat:byteSize \"" + std::to_string(bytes.size()) +
                                                       "\"^^xsd:nonNegativeInteger ; lrt:elementType xsd:" + element_type +
                                                       " ; lrt:byteOrder lrt:littleEndian ; qudt:hasUnit unit:M ; lrt:frame \"base\" ;"
                                                       " lrt:shape ( " +
                                                       shape + " ) .") == "");
  };
  const auto count = [](int n) { return "\"" + std::to_string(n) + "\"^^xsd:nonNegativeInteger "; };
  const Eigen::MatrixXd m = Eigen::MatrixXd::Random(20, 3);
  check(m, "double", count(20) + count(3));
  check(Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>(m), "double", count(20) + count(3));
  check(Eigen::MatrixXf(m.cast<float>()), "float", count(20) + count(3));
  check(Eigen::MatrixXi((1000 * m).cast<int>()), "int", count(20) + count(3));
  check(Eigen::Matrix<std::int8_t, Eigen::Dynamic, Eigen::Dynamic>((100 * m).cast<std::int8_t>()), "byte", count(20) + count(3));
  check(Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 20, 4>(m), "double", count(20) + count(3));
  check(Eigen::Matrix<double, 3, Eigen::Dynamic>(m.transpose()), "double", count(3) + count(20));
  check(Points(m), "double", count(20) + count(3));
  check(Points(0, 3), "double", count(0) + count(3));
  check(RowMajor3d(m.topRows(3)), "double", count(3) + count(3));
  check(Eigen::VectorXd(m.col(0)), "double", count(20));
  check(Eigen::MatrixXd(), "double", count(0) + count(0));
  check(Eigen::MatrixXd(3, 0), "double", count(3) + count(0));
  check(Eigen::MatrixXd(0, 3), "double", count(0) + count(0));  // a list without rows shows no columns
  check(Eigen::Matrix<double, 3, Eigen::Dynamic>(3, 0), "double", count(3) + count(0));
}

TEST_CASE("a matrix is written as octets if one of its lengths is fixed", "[eigen][R0.5]") {
  Bench bench;
  Eigen::MatrixXd any(2, 2);
  Eigen::Matrix<float, 2, Eigen::Dynamic> wide(2, 0);
  Points points(0, 3);
  Thing thing{"a"};
  thing.property("any", [&] { return any; }).octets().on_write([&](const Eigen::MatrixXd& m) { any = m; });
  thing.property("wide", [&] { return wide; }).octets().on_write([&](const Eigen::Matrix<float, 2, Eigen::Dynamic>& m) { wide = m; });
  thing.property("points", [&] { return points; }).octets().on_write([&](const Points& p) { points = p; });
  bench.add(std::move(thing));
  const auto put = [&](const std::string& name, const auto& row_major) {
    return bench
        .ask("PUT /a/" + name + "\nContent-Type: application/octet-stream\n\n" +
             std::string(reinterpret_cast<const char*>(row_major.data()), sizeof row_major))
        .status;
  };
  const Eigen::Matrix<float, 2, 5, Eigen::RowMajor> five = Eigen::Matrix<float, 2, 5>::Random();
  CHECK(put("wide", five) == 204);
  CHECK(wide == five);
  const Eigen::Matrix<double, 4, 3, Eigen::RowMajor> four = Eigen::Matrix<double, 4, 3>::Random();
  CHECK(put("points", four) == 204);
  CHECK(points == four);
  CHECK(put("points", RowMajor3d::Constant(not_a_number).eval()) == 422);
  CHECK(put("points", std::array<double, 4>{}) == 400);
  CHECK(points == four);
  CHECK(put("any", four) == 415);
}

TEST_CASE("an invalid rotation is answered 422 with a message, and changes nothing", "[eigen][R0.6]") {
  Robot r;
  CHECK(r.put("target", "vom:quantityValue [ maths:x 0 ; maths:y 0.6 ; maths:z 0.8 ; maths:w 0 ]").status == 204);
  CHECK(r.target.z() == 0.8);
  const Answer a = r.put("target", "vom:quantityValue [ maths:x 0 ; maths:y 0.5 ; maths:z 0.8 ; maths:w 0 ]");
  CHECK(a.status == 422);
  CHECK(says(a.body, "expected a quaternion of norm 1 within 1e-09, found a norm of 0.94"));
  CHECK(r.put("target", "vom:quantityValue [ maths:x 0 ; maths:y 0.6 ; maths:z 0.8 ]").status == 422);
  CHECK(r.put("target", "vom:quantityValue [ maths:x \"NaN\"^^xsd:double ; maths:y 0.6 ; maths:z 0.8 ; maths:w 0 ]").status == 422);
  CHECK(r.target.y() == 0.6);
  const Answer turned = r.post("turn", "vom:quantityValue [ maths:x 0 ; maths:y 0 ; maths:z 0 ; maths:w 1.5 ]");
  CHECK(turned.status == 422);
  CHECK(says(turned.body, "found a norm of 1.5"));
  const std::string shift = "spatial:translation [ qudt:hasUnit unit:M ; vom:quantityValue [ maths:x 1 ; maths:y 2 ; maths:z 3 ] ] ; ";
  CHECK(r.put("tool", shift + "spatial:rotation [ vom:quantityValue [ maths:x 0 ; maths:y 0 ; maths:z 1 ; maths:w 0 ] ]").status == 204);
  CHECK(r.tool(0, 0) == -1);
  const Answer both = r.put("tool", shift +
                                        "spatial:rotation [ vom:quantityValue [ maths:x 0 ; maths:y 0 ; maths:z 1 ; maths:w 0 ] ] ;"
                                        " lrt:matrix ( ( 1 0 0 ) ( 0 1 0 ) ( 0 0 1 ) )");
  CHECK(both.status == 422);
  CHECK(says(both.body, "matrix: expected the rotation of the quaternion"));
  const Answer ragged = r.put("gains", "rdf:value ( ( 1 2 ) ( 3 ) )");
  CHECK(ragged.status == 422);
  CHECK(says(ragged.body, "expected rows of one length, found 2 members in row 0 and 1 in row 1"));
  CHECK(r.gains.cols() == 3);
}

TEST_CASE("actions and collections accept Eigen's types", "[eigen][R0.5][R1.10]") {
  Robot r;
  CHECK(r.post("reach", "a maths:Vector3D ; maths:x 0.5 ; maths:y 1 ; maths:z 1e-3 ; vom:unit <http://vocab.arvida.de/x>").status == 422);
  CHECK(r.post("reach", "a maths:Vector3D ; maths:x 0.5 ; maths:y 1 ; maths:z 1e-3 ; qudt:hasUnit unit:M").status == 204);
  CHECK(r.reached == Eigen::Vector3d(0.5, 1, 1e-3));
  CHECK(r.post("reach", "a maths:Vector3D ; maths:x 0.5 ; maths:y 1 ; qudt:hasUnit unit:M").status == 422);
  const Answer pushed = r.post("push", "rdf:value ( 1 2 3 4 5 6 )");
  CHECK(pushed.status == 200);
  CHECK(says(pushed.body, "\"12\"^^xsd:double"));
  CHECK(r.bench.turtle("POST", "/arm/waypoints", "<> a spatial:Translation3D ; vom:quantityValue [ maths:x 1 ; maths:y 2 ; maths:z 3 ] .").status ==
        201);
}
