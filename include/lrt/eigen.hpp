// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <cstring>
#include <initializer_list>
#include <limits>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <lrt/base/immortal.hpp>
#include <lrt/base/result.hpp>
#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/traits.hpp>
#include <lrt/rdf/type.hpp>
#include <lrt/rdf/unit.hpp>
#include <lrt/rdf/value.hpp>
#include <lrt/rdf/vocab.hpp>

/// Traits of Eigen's types, for values of properties, actions and collections and for fields of records. Not part of
/// lrt.hpp.
///
/// | C++ | RDF | in JSON |
/// |---|---|---|
/// | vectors of 2, 3, 4; columns or rows | maths:Vector2D, 3D, 4D: maths:x, y, z, w | {"x": 1, "y": 2, "z": 3} |
/// | vectors of any other size, fixed or dynamic | list | [1, 2, 3, 4, 5, 6] |
/// | arrays (Eigen::Array) | as matrices; a row or a column is a list of numbers | [1, 2, 3] |
/// | matrices of any size | list of rows, for every storage order | [[1, 2], [3, 4]] |
/// | Quaternion | spatial:Rotation3D: vom:quantityValue a maths:Quaternion: maths:x, y, z, w | {"x": 0, "y": 0, "z": 0, "w": 1} |
/// | AngleAxis | spatial:AxisAngle, spatial:Rotation3D: spatial:rotationAngle [rad], spatial:rotationAxis | as in Figure 3 of the paper |
/// | Translation3 | spatial:Translation3D: vom:quantityValue a maths:Vector3D: maths:x, y, z | {"x": 1, "y": 2, "z": 3} |
/// | Isometry3 | spatial:SpatialRelationship: spatial:translation, spatial:rotation (a quaternion), lrt:matrix | a pose |
/// | Affine3, AffineCompact3 | spatial:SpatialRelationship: spatial:translation, lrt:matrix | |
///
/// Scalars are float, double and the integer types; in rotations and transforms float and double. The terms are those
/// of ARVIDA, in the spelling of its authors, except maths:Vector2D, which is formed like its siblings, and lrt:matrix.
/// maths:x, y, z and w are always plain numbers; the unit is stated at the vector or the translation.
///
/// - Finite values read back bit-identically. NaN and infinities from clients are always refused. Values that the robot
///   reads or publishes may be non-finite.
/// - A rotation is checked: the norm of a quaternion and of an axis is 1 within 1e-9; a rotation matrix times its
///   transpose is the identity within 1e-8, and its determinant is positive; the quaternion and the matrix of a pose
///   agree within 1e-7. For float the tolerances are 1000 times as large. A value outside is refused with a message
///   (422). A value inside is stored unchanged and not normalised.
///
/// - The property's unit applies to all coordinates: `property<Eigen::Vector3d>("tip", unit::metre)`; for a pose it
///   applies to the translation. Each member of a list repeats the unit in RDF, so large lists are better without a
///   unit.
/// - A property names its frame by frame(): lrt:frame, and for a pose spatial:sourceCoordinateSystem. By default it is
///   the frame of the owning thing. State the moved frame of a pose by `.add(vocab::spatial::targetCoordinateSystem,
///   Object::resource("arm/tool"))`.
///
/// - A lambda must return a value type instead of an expression: `[&]() -> Eigen::Vector3d { return r * v; }`.
/// - publish() of fixed sizes, and of dynamic sizes with a fixed maximum, takes no lock and does not allocate. VectorXd
///   and MatrixXd allocate, like std::vector.
/// - For large values and programs as readers use octets (octets() of a property): a matrix row by row in every storage
///   order, with its shape in the RDF. If the number of columns or rows is fixed (Matrix<double, Dynamic, 3>, one point
///   for each row), PUT accepts octets too.
///
/// @par Errors   Of decode(): expected_value and, for integers, out_of_range, with the member and what was expected.
/// @par Threads  Any: all functions of the traits of Eigen's types.
/// @par Time     encode() and decode() are linear in the numbers, and allocate.

namespace lrt::rdf {
inline namespace v0 {

namespace detail::eigen {

using Eigen::Index;

template <class S>
inline constexpr double unit_tolerance = std::is_same_v<S, float> ? 1e-6 : 1e-9;
template <class S>
inline constexpr double matrix_tolerance = std::is_same_v<S, float> ? 1e-5 : 1e-8;  // accepts the matrix of every accepted quaternion
template <class S>
inline constexpr double pose_tolerance = std::is_same_v<S, float> ? 1e-4 : 1e-7;  // accepts the quaternion of every accepted matrix

inline constexpr Iri coordinate_terms[] = {vocab::maths::x, vocab::maths::y, vocab::maths::z, vocab::maths::w};

inline std::string local_name(Iri term) { return std::string(term.text.substr(term.text.find_last_of("#/") + 1)); }

inline FieldType field(Iri term, const Type& type, const Facets& facets = {}) { return {local_name(term), std::string(term.text), &type, facets}; }
inline Type record(std::initializer_list<Iri> classes, std::vector<FieldType> fields) {
  Type t;
  t.kind = Type::Kind::record;
  for (const Iri c : classes) t.classes.emplace_back(c.text);
  t.fields = std::move(fields);
  return t;
}
template <class S>
Type coordinates(std::initializer_list<Iri> classes, Index size) {
  std::vector<FieldType> fields;
  for (Index i = 0; i < size; ++i) fields.push_back(field(coordinate_terms[i], traits<S>::type()));
  return record(classes, std::move(fields));
}
/// A quantity whose coordinates are at the object of vom:quantityValue, as ARVIDA writes translations and rotations.
template <class S>
Type quantity(Iri its_class, Iri kind, std::initializer_list<Iri> value_classes, Index size) {
  Type t = coordinates<S>({its_class}, size);
  t.quantity_kind = kind;
  t.value_predicate = vocab::vom::quantityValue.text;
  for (const Iri c : value_classes) t.value_classes.emplace_back(c.text);
  return t;
}
inline FieldType field_with_unit(Iri term, const Type& type) {
  FieldType f = field(term, type);
  f.takes_unit = true;
  return f;
}

inline Unexpected at(const std::string& where, const Error& error) { return unexpected(error.code, where + ": " + error.message); }
inline Unexpected unfit(const std::string& expected, double tolerance, const std::string& found, double number) {
  return unexpected(Errc::expected_value,
                    "expected " + expected + " within " + lexical::format(tolerance) + ", found " + found + lexical::format(number));
}

template <class S>
Result<S> decode_number(const Value& value) {
  Result<S> number = traits<S>::decode(value);
  if constexpr (std::is_floating_point_v<S>)
    if (number && !std::isfinite(*number)) return unexpected(Errc::expected_value, "expected a finite number, found " + lexical::format(*number));
  return number;
}

/// Consecutive numbers as the fields of a record.
template <class S>
Value encode_coordinates(const S* first, Index size) {
  Value::Sequence out;
  out.reserve(static_cast<std::size_t>(size));
  for (Index i = 0; i < size; ++i) out.push_back(traits<S>::encode(first[i]));
  return Value(std::move(out));
}
template <class S>
Result<void> decode_coordinates(const Value& value, S* first, Index size) {
  const Value::Sequence* members = value.sequence();
  if (!members || members->size() != static_cast<std::size_t>(size)) return not_a_value_of("as many coordinates as there are axes");
  for (std::size_t i = 0; i < members->size(); ++i) {
    const Result<S> number = decode_number<S>((*members)[i]);
    if (!number) return at(local_name(coordinate_terms[i]), number.error());
    first[i] = *number;
  }
  return {};
}

/// The maximum number of members of a list for one dimension of a matrix.
constexpr std::size_t min_members(Index size) { return size == Eigen::Dynamic ? 0 : static_cast<std::size_t>(size); }
constexpr std::size_t max_members(Index largest) {
  return largest == Eigen::Dynamic ? std::numeric_limits<std::size_t>::max() : static_cast<std::size_t>(largest);
}
inline bool fits(const Value::Sequence* members, const Type& list) noexcept {
  return members && members->size() >= list.shortest && members->size() <= list.longest;
}
inline Unexpected does_not_fit(const Value::Sequence* members, const Type& list) {
  if (!members) return not_a_value_of("a list");
  return unexpected(Errc::expected_value, std::string("expected a list of ") + (list.shortest == list.longest ? "" : "at most ") +
                                              std::to_string(list.longest) + " members, found " + std::to_string(members->size()));
}

template <class M>
bool same_bits(const M& a, const M& b) noexcept {
  return a.rows() == b.rows() && a.cols() == b.cols() &&
         (a.size() == 0 || std::memcmp(a.data(), b.data(), static_cast<std::size_t>(a.size()) * sizeof(typename M::Scalar)) == 0);
}

/// Vectors of 2, 3 and 4.
template <class V>
struct Coordinates {
  using S = typename V::Scalar;
  static const Type& type() {
    static const Immortal<Type> t(coordinates<S>({V::SizeAtCompileTime == 2   ? vocab::maths::Vector2D
                                                  : V::SizeAtCompileTime == 3 ? vocab::maths::Vector3D
                                                                              : vocab::maths::Vector4D},
                                                 V::SizeAtCompileTime));
    return *t;
  }
  static Value encode(const V& v) { return encode_coordinates(v.data(), v.size()); }
  static Result<V> decode(const Value& value) {
    V out;
    if (Result<void> r = decode_coordinates(value, out.data(), out.size()); !r) return Unexpected{std::move(r).error()};
    return out;
  }
  static bool runs_user_code() noexcept { return false; }
  static bool same(const V& a, const V& b) noexcept { return same_bits(a, b); }
};

/// Vectors of other sizes.
template <class V>
struct List {
  using S = typename V::Scalar;
  static const Type& type() {
    static const Immortal<Type> t(list_type(traits<S>::type(), min_members(V::SizeAtCompileTime), max_members(V::MaxSizeAtCompileTime)));
    return *t;
  }
  static Value encode(const V& v) { return encode_coordinates(v.data(), v.size()); }
  static Result<V> decode(const Value& value) {
    const Value::Sequence* members = value.sequence();
    if (!fits(members, type())) return does_not_fit(members, type());
    V out;
    out.resize(static_cast<Index>(members->size()));
    for (std::size_t i = 0; i < members->size(); ++i) {
      const Result<S> number = decode_number<S>((*members)[i]);
      if (!number) return at("[" + std::to_string(i) + "]", number.error());
      out[static_cast<Index>(i)] = *number;
    }
    return out;
  }
  static bool runs_user_code() noexcept { return false; }
  static bool same(const V& a, const V& b) noexcept { return same_bits(a, b); }
};

template <class M>
struct Rows {
  using S = typename M::Scalar;
  static const Type& row_type() {
    static const Immortal<Type> t(list_type(traits<S>::type(), min_members(M::ColsAtCompileTime), max_members(M::MaxColsAtCompileTime)));
    return *t;
  }
  static const Type& type() {
    static const Immortal<Type> t(list_type(row_type(), min_members(M::RowsAtCompileTime), max_members(M::MaxRowsAtCompileTime)));
    return *t;
  }
  static Value encode(const M& m) {
    Value::Sequence rows;
    rows.reserve(static_cast<std::size_t>(m.rows()));
    for (Index r = 0; r < m.rows(); ++r) {
      Value::Sequence row;
      row.reserve(static_cast<std::size_t>(m.cols()));
      for (Index c = 0; c < m.cols(); ++c) row.push_back(traits<S>::encode(m(r, c)));
      rows.emplace_back(std::move(row));
    }
    return Value(std::move(rows));
  }
  static Result<M> decode(const Value& value) {
    const Value::Sequence* rows = value.sequence();
    if (!fits(rows, type())) return does_not_fit(rows, type());
    std::size_t columns = row_type().shortest;
    for (std::size_t r = 0; r < rows->size(); ++r) {  // checked before a matrix is made with the size of the first row
      const Value::Sequence* row = (*rows)[r].sequence();
      if (!fits(row, row_type())) return at("[" + std::to_string(r) + "]", does_not_fit(row, row_type()).error);
      if (r == 0) columns = row->size();
      if (row->size() != columns)
        return unexpected(Errc::expected_value, "expected rows of one length, found " + std::to_string(columns) + " members in row 0 and " +
                                                    std::to_string(row->size()) + " in row " + std::to_string(r));
    }
    M out;
    out.resize(static_cast<Index>(rows->size()), static_cast<Index>(columns));
    for (std::size_t r = 0; r < rows->size(); ++r)
      for (std::size_t c = 0; c < columns; ++c) {
        const Result<S> number = decode_number<S>((*(*rows)[r].sequence())[c]);
        if (!number) return at("[" + std::to_string(r) + "]/[" + std::to_string(c) + "]", number.error());
        out(static_cast<Index>(r), static_cast<Index>(c)) = *number;
      }
    return out;
  }
  static bool runs_user_code() noexcept { return false; }
  static bool same(const M& a, const M& b) noexcept { return same_bits(a, b); }
};

template <class M>
using MatrixTraits = std::conditional_t<!M::IsVectorAtCompileTime, Rows<M>,
                                        std::conditional_t<(M::SizeAtCompileTime >= 2 && M::SizeAtCompileTime <= 4), Coordinates<M>, List<M>>>;

template <class A>
using ArrayTraits = std::conditional_t<A::IsVectorAtCompileTime, List<A>, Rows<A>>;

/// The reason why it is not a rotation; nullopt: it is one.
template <class S>
std::optional<Error> no_rotation(const Eigen::Matrix<S, 3, 3>& m) {
  // Converts floats once. NOLINTNEXTLINE(performance-unnecessary-copy-initialization)
  const Eigen::Matrix3d r = m.template cast<double>();
  const double off = (r * r.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(off <= matrix_tolerance<S>))
    return unfit("a rotation matrix, its product with its transpose the identity", matrix_tolerance<S>, "a difference of ", off).error;
  if (r.determinant() < 0) return Error{Errc::expected_value, "expected a rotation matrix, found a reflection (its determinant is -1)"};
  return std::nullopt;
}

template <class T>
bool same_transform(const T& a, const T& b) noexcept {
  for (Index c = 0; c < 4; ++c)
    for (Index r = 0; r < 3; ++r)
      if (!traits<typename T::Scalar>::same(a(r, c), b(r, c))) return false;
  return true;
}

}  // namespace detail::eigen

/// Vectors and matrices, fixed and dynamic; see the table of lrt/eigen.hpp for their form. Lists are in the order of
/// the index; matrices are lists of rows for every storage order. A matrix without rows reads back without columns if
/// their number is dynamic.
template <class S, int Rows, int Columns, int Options, int MostRows, int MostColumns>
struct traits<Eigen::Matrix<S, Rows, Columns, Options, MostRows, MostColumns>>
    : detail::eigen::MatrixTraits<Eigen::Matrix<S, Rows, Columns, Options, MostRows, MostColumns>> {};

/// Arrays, fixed and dynamic: lists of numbers, or of rows. They have no coordinates: an ArrayXd of 3 is [1, 2, 3].
template <class S, int Rows, int Columns, int Options, int MostRows, int MostColumns>
struct traits<Eigen::Array<S, Rows, Columns, Options, MostRows, MostColumns>>
    : detail::eigen::ArrayTraits<Eigen::Array<S, Rows, Columns, Options, MostRows, MostColumns>> {};

/// Quaternions: 4 numbers by name (x, y, z, w), norm 1 within 1e-9 (float: 1e-6). A spatial rotation in the frame of
/// the owning thing. q and -q are different values; a GET shows the signs that the robot published. Finite values read
/// back bit-identically.
template <class S, int Options>
struct traits<Eigen::Quaternion<S, Options>> {
  using T = Eigen::Quaternion<S, Options>;
  static const Type& type() {
    static const Immortal<Type> t(
        detail::eigen::quantity<S>(vocab::spatial::Rotation3D, vocab::vom::Angle, {vocab::maths::Quaternion, vocab::maths::Vector4D}, 4));
    return *t;
  }
  static Value encode(const T& q) { return detail::eigen::encode_coordinates(q.coeffs().data(), 4); }
  static Result<T> decode(const Value& value) {
    T q;
    if (Result<void> r = detail::eigen::decode_coordinates(value, q.coeffs().data(), 4); !r) return Unexpected{std::move(r).error()};
    const double norm = q.coeffs().template cast<double>().norm();
    if (!(std::abs(norm - 1) <= detail::eigen::unit_tolerance<S>))
      return detail::eigen::unfit("a quaternion of norm 1", detail::eigen::unit_tolerance<S>, "a norm of ", norm);
    return q;
  }
  static bool runs_user_code() noexcept { return false; }
  static bool same(const T& a, const T& b) noexcept { return detail::eigen::same_bits(a.coeffs(), b.coeffs()); }
};

/// Rotations about an axis: an angle in radians, of any size and sign, and an axis of length 1 within 1e-9 (float:
/// 1e-6).
template <class S>
struct traits<Eigen::AngleAxis<S>> {
  using T = Eigen::AngleAxis<S>;
  using Axis = Eigen::Matrix<S, 3, 1>;
  static const Type& type() {
    using detail::eigen::field;
    static const Immortal<Type> t(detail::eigen::record(
        {vocab::spatial::AxisAngle, vocab::spatial::Rotation3D},
        {field(vocab::spatial::rotationAngle, traits<S>::type(), Facets{unit::radian}), field(vocab::spatial::rotationAxis, traits<Axis>::type())}));
    return *t;
  }
  static Value encode(const T& a) { return Value(Value::Sequence{traits<S>::encode(a.angle()), traits<Axis>::encode(a.axis())}); }
  static Result<T> decode(const Value& value) {
    using namespace detail::eigen;
    const Value::Sequence* members = value.sequence();
    if (!members || members->size() != 2) return detail::not_a_value_of("an angle and an axis");
    const Result<S> angle = decode_number<S>((*members)[0]);
    if (!angle) return at("rotationAngle", angle.error());
    const Result<Axis> axis = traits<Axis>::decode((*members)[1]);
    if (!axis) return at("rotationAxis", axis.error());
    const double length = axis->template cast<double>().norm();
    if (!(std::abs(length - 1) <= unit_tolerance<S>))
      return at("rotationAxis", unfit("a vector of length 1", unit_tolerance<S>, "a length of ", length).error);
    return T(*angle, *axis);
  }
  static bool runs_user_code() noexcept { return false; }
  static bool same(const T& a, const T& b) noexcept { return traits<S>::same(a.angle(), b.angle()) && traits<Axis>::same(a.axis(), b.axis()); }
};

/// Translations: 3 numbers by name (x, y, z), in the unit of the property.
template <class S>
struct traits<Eigen::Translation<S, 3>> {
  using T = Eigen::Translation<S, 3>;
  static const Type& type() {
    static const Immortal<Type> t(detail::eigen::quantity<S>(vocab::spatial::Translation3D, vocab::vom::Length, {vocab::maths::Vector3D}, 3));
    return *t;
  }
  static Value encode(const T& t) { return detail::eigen::encode_coordinates(t.vector().data(), 3); }
  static Result<T> decode(const Value& value) {
    T out;
    if (Result<void> r = detail::eigen::decode_coordinates(value, out.vector().data(), 3); !r) return Unexpected{std::move(r).error()};
    return out;
  }
  static bool runs_user_code() noexcept { return false; }
  static bool same(const T& a, const T& b) noexcept { return detail::eigen::same_bits(a.vector(), b.vector()); }
};

/// Poses. The rotation is represented twice: as a quaternion, for readers, and as lrt:matrix, which reads back
/// bit-identically. A body must have the quaternion. Without a matrix, the matrix is computed from the quaternion;
/// otherwise the matrix is stored and must agree with the quaternion. A GET shows the normalised quaternion of the
/// matrix: the same rotation, possibly with the other sign and a different last digit. To keep the exact quaternion,
/// use a Record of a Translation3 and a Quaternion.
template <class S, int Options>
struct traits<Eigen::Transform<S, 3, Eigen::Isometry, Options>> {
  using T = Eigen::Transform<S, 3, Eigen::Isometry, Options>;
  using Shift = Eigen::Translation<S, 3>;
  using Turn = Eigen::Quaternion<S, Options& int(Eigen::DontAlign)>;  // not aligned to more than the transform itself
  using Linear = Eigen::Matrix<S, 3, 3>;
  static const Type& type() {
    static const Immortal<Type> t(detail::eigen::record({vocab::spatial::SpatialRelationship},
                                                        {detail::eigen::field_with_unit(vocab::spatial::translation, traits<Shift>::type()),
                                                         detail::eigen::field(vocab::spatial::rotation, traits<Turn>::type()),
                                                         detail::eigen::field(vocab::lrt_::matrix, traits<std::optional<Linear>>::type())}));
    return *t;
  }
  static Value encode(const T& pose) {
    const Linear matrix = pose.linear();
    return Value(Value::Sequence{traits<Shift>::encode(Shift(pose.translation())), traits<Turn>::encode(Turn(matrix).normalized()),
                                 traits<Linear>::encode(matrix)});
  }
  static Result<T> decode(const Value& value) {
    using namespace detail::eigen;
    const Value::Sequence* members = value.sequence();
    if (!members || members->size() != 3) return detail::not_a_value_of("a translation, a rotation and a matrix");
    const Result<Shift> shift = traits<Shift>::decode((*members)[0]);
    if (!shift) return at("translation", shift.error());
    const Result<Turn> turn = traits<Turn>::decode((*members)[1]);
    if (!turn) return at("rotation", turn.error());
    const Result<std::optional<Linear>> given = traits<std::optional<Linear>>::decode((*members)[2]);
    if (!given) return at("matrix", given.error());
    Linear matrix = turn->toRotationMatrix();
    if (*given) {
      if (const auto error = no_rotation<S>(**given)) return at("matrix", *error);
      const double off = (**given - matrix).cwiseAbs().maxCoeff();
      if (!(off <= pose_tolerance<S>))
        return at("matrix", unfit("the rotation of the quaternion (or no matrix)", pose_tolerance<S>, "a difference of ", off).error);
      matrix = **given;
    }
    T pose = T::Identity();
    pose.linear() = matrix;
    pose.translation() = shift->vector();
    return pose;
  }
  static bool runs_user_code() noexcept { return false; }
  static bool same(const T& a, const T& b) noexcept { return detail::eigen::same_transform(a, b); }
};

/// Transforms with a translation and an arbitrary linear part: rotation, scale, shear.
template <class S, int Mode, int Options>
struct traits<Eigen::Transform<S, 3, Mode, Options>, std::enable_if_t<Mode == int(Eigen::Affine) || Mode == int(Eigen::AffineCompact)>> {
  using T = Eigen::Transform<S, 3, Mode, Options>;
  using Shift = Eigen::Translation<S, 3>;
  using Linear = Eigen::Matrix<S, 3, 3>;
  static const Type& type() {
    static const Immortal<Type> t(detail::eigen::record({vocab::spatial::SpatialRelationship},
                                                        {detail::eigen::field_with_unit(vocab::spatial::translation, traits<Shift>::type()),
                                                         detail::eigen::field(vocab::lrt_::matrix, traits<Linear>::type())}));
    return *t;
  }
  static Value encode(const T& transform) {
    return Value(Value::Sequence{traits<Shift>::encode(Shift(transform.translation())), traits<Linear>::encode(transform.linear())});
  }
  static Result<T> decode(const Value& value) {
    const Value::Sequence* members = value.sequence();
    if (!members || members->size() != 2) return detail::not_a_value_of("a translation and a matrix");
    const Result<Shift> shift = traits<Shift>::decode((*members)[0]);
    if (!shift) return detail::eigen::at("translation", shift.error());
    const Result<Linear> linear = traits<Linear>::decode((*members)[1]);
    if (!linear) return detail::eigen::at("matrix", linear.error());
    T out = T::Identity();
    out.linear() = *linear;
    out.translation() = shift->vector();
    return out;
  }
  static bool runs_user_code() noexcept { return false; }
  static bool same(const T& a, const T& b) noexcept { return detail::eigen::same_transform(a, b); }
};

}  // namespace v0
}  // namespace lrt::rdf
