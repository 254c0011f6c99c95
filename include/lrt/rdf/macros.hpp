// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <lrt/rdf/traits.hpp>

/// @file
/// Descriptions of structs and enums in one line. A struct:
///
///     namespace robot {
///     struct Gains {
///       double p = 0, i = 0, d = 0;
///     };
///     LRT_RECORD(Gains, p, i, d)
///     inline void lrt_describe(lrt::rdf::Record<Gains>& r) {  // units, bounds, words, more fields; or leave it out
///       r.facets("p").unit(lrt::unit::newton_metre).at_least(0);
///     }
///     }  // namespace robot
///
/// It is what rdf::traits<Gains> with r.field("p", &Gains::p) and so on is, and stands in the namespace of the struct or in the
/// global one, before the first use of the struct in a Thing.

/// Describes a struct with up to 300 fields: data members, also of a base class, and getters, by their names, which are those of
/// JSON and of the terms. Not for bit-fields and references, which have no pointer to member: they need rdf::traits.
#define LRT_RECORD(...) [[maybe_unused]] inline LRT_DETAIL_RECORD_(false, LRT_DETAIL_FIRST(__VA_ARGS__, 0), __VA_ARGS__)
/// As LRT_RECORD, within the struct: for private members, for structs within others, and for templates.
///
///     template <class T>
///     class Limits {
///       T low_{}, high_{};
///       LRT_RECORD_MEMBERS(Limits, low_, high_)
///     };
#define LRT_RECORD_MEMBERS(...) friend LRT_DETAIL_RECORD_(true, LRT_DETAIL_FIRST(__VA_ARGS__, 0), __VA_ARGS__)
/// Names the enumerators of an enum as they are spelled: LRT_ENUM(Mode, idle, busy). It is needed for an enum without a
/// fixed underlying type, one with values outside of -16 to 127 that are no power of two, and one of which clients see only
/// some enumerators; others are named by the compiler. It stands where LRT_RECORD may stand.
#define LRT_ENUM(...)                                                                                                  \
  [[maybe_unused]] inline void lrt_names(::lrt::rdf::Enumeration<LRT_DETAIL_FIRST(__VA_ARGS__, 0)>& lrt_enumeration) { \
    using LrtType [[maybe_unused]] = LRT_DETAIL_FIRST(__VA_ARGS__, 0);                                                 \
    (void)lrt_enumeration;                                                                                             \
    LRT_DETAIL_EACH(LRT_DETAIL_ENUMERATOR, __VA_ARGS__)                                                                \
  }

/// @cond internal
#if defined(_MSC_VER) && !defined(__clang__)
#define LRT_DETAIL_FUNCTION __FUNCSIG__
#else
#define LRT_DETAIL_FUNCTION __PRETTY_FUNCTION__
#endif
#define LRT_DETAIL_FIRST(first, ...) first
#define LRT_DETAIL_RECORD_(is_friend, S, ...)             \
  void lrt_fields(::lrt::rdf::Record<S>& lrt_record) {    \
    using LrtType [[maybe_unused]] = S;                   \
    lrt_record.set_place(LRT_DETAIL_FUNCTION, is_friend); \
    LRT_DETAIL_EACH(LRT_DETAIL_FIELD, __VA_ARGS__)        \
  }
#define LRT_DETAIL_FIELD(x) lrt_record.field(#x, &LrtType::x);
#define LRT_DETAIL_ENUMERATOR(x) lrt_enumeration.name(LrtType::x, #x);

// f(x) for each argument x but the first. The preprocessor does not expand a macro within itself, so two take turns, and each scan of
// LRT_DETAIL_SCAN expands the next. `()()()` marks the end: only there LRT_DETAIL_AT_END is a call.
#define LRT_DETAIL_SCAN(...) LRT_DETAIL_SCAN3(LRT_DETAIL_SCAN3(LRT_DETAIL_SCAN3(LRT_DETAIL_SCAN3(__VA_ARGS__))))
#define LRT_DETAIL_SCAN3(...) LRT_DETAIL_SCAN2(LRT_DETAIL_SCAN2(LRT_DETAIL_SCAN2(LRT_DETAIL_SCAN2(__VA_ARGS__))))
#define LRT_DETAIL_SCAN2(...) LRT_DETAIL_SCAN1(LRT_DETAIL_SCAN1(LRT_DETAIL_SCAN1(LRT_DETAIL_SCAN1(__VA_ARGS__))))
#define LRT_DETAIL_SCAN1(...) LRT_DETAIL_SCAN0(LRT_DETAIL_SCAN0(LRT_DETAIL_SCAN0(LRT_DETAIL_SCAN0(__VA_ARGS__))))
#define LRT_DETAIL_SCAN0(...) __VA_ARGS__
#define LRT_DETAIL_END(...)
#define LRT_DETAIL_OUT
#define LRT_DETAIL_AT_END2() 0, LRT_DETAIL_END
#define LRT_DETAIL_AT_END1(...) LRT_DETAIL_AT_END2
#define LRT_DETAIL_AT_END(...) LRT_DETAIL_AT_END1
#define LRT_DETAIL_NEXT1(test, next, ...) next LRT_DETAIL_OUT
#define LRT_DETAIL_NEXT0(test, next) LRT_DETAIL_NEXT1(test, next, 0)
#define LRT_DETAIL_NEXT(test, next) LRT_DETAIL_NEXT0(LRT_DETAIL_AT_END test, next)
#define LRT_DETAIL_EACH_A(f, x, peek, ...) f(x) LRT_DETAIL_NEXT(peek, LRT_DETAIL_EACH_B)(f, peek, __VA_ARGS__)
#define LRT_DETAIL_EACH_B(f, x, peek, ...) f(x) LRT_DETAIL_NEXT(peek, LRT_DETAIL_EACH_A)(f, peek, __VA_ARGS__)
#define LRT_DETAIL_AFTER_FIRST(f, x, peek, ...) LRT_DETAIL_NEXT(peek, LRT_DETAIL_EACH_A)(f, peek, __VA_ARGS__)
#define LRT_DETAIL_EACH(f, ...) LRT_DETAIL_SCAN(LRT_DETAIL_AFTER_FIRST(f, __VA_ARGS__, ()()(), ()()(), ()()(), 0))
/// @endcond
