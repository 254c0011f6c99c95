// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <type_traits>
#include <utility>

#include <lrt/model/detail/spec.hpp>
#include <lrt/model/resource_handle.hpp>
#include <lrt/rdf/traits.hpp>

namespace lrt {
inline namespace v0 {

/// Handle to a collection of a Thing: a container of values (way-points, tasks, saved poses). Clients create members by POST and remove
/// them by DELETE. The server stores the members. It calls your lambda before each change, and the lambda may refuse it.
template <class T>
class Collection : public model::ResourceHandle<Collection<T>, model::CollectionSpec> {
  using Base = model::ResourceHandle<Collection<T>, model::CollectionSpec>;

 public:
  /// An empty handle, to be assigned later.
  Collection() noexcept = default;

  /// Allows POST. `create(id, T)` or `create(T)` returns void or Result<void>. After an error nothing is created, and the response is 409.
  template <class F>
  Collection& on_create(F create) {
    constexpr bool with_id = std::is_invocable_v<F&, const std::string&, T>, alone = std::is_invocable_v<F&, T>;
    if constexpr (!with_id && !alone) {
      static_assert(
          rdf::detail::always_false<F>,
          "lrt: on_create expects a callable (T) or (const std::string& id, T), where T is the collection's type; write [](T value) { ... }");
      return *this;
    } else if constexpr (with_id && alone) {
      static_assert(rdf::detail::always_false<F>,
                    "lrt: on_create cannot see whether this callable takes (T) or (id, T); write a lambda with explicit parameter types instead of "
                    "std::bind or a generic one");
      return *this;
    } else {
      constexpr bool refuses = [] {
        if constexpr (with_id) return model::refuses_by_result<std::invoke_result_t<F&, const std::string&, T>>;
        else return model::refuses_by_result<std::invoke_result_t<F&, T>>;
      }();
      if constexpr (!refuses) {
        static_assert(rdf::detail::always_false<F>,
                      "lrt: the callable of on_create returns void or Result<void>; write -> lrt::Result<void> and return lrt::refused(\"reason\")");
        return *this;
      } else {
        return this->edit("on_create", [&](auto& s) {
          s.create = [create = std::move(create)](const std::string& id, const rdf::Value& v) mutable -> Result<void> {
            Result<T> value = rdf::traits<T>::decode(v);
            if (!value) return Unexpected{std::move(value).error()};
            if constexpr (std::is_invocable_v<F&, const std::string&, T>) return model::result_of([&] { return create(id, *std::move(value)); });
            else return model::result_of([&] { return create(*std::move(value)); });
          };
        });
      }
    }
  }
  /// Allows DELETE of members. `remove(id)` returns void or Result<void>. After an error the member is kept, and the response is 409.
  template <class F>
  Collection& on_remove(F remove) {
    if constexpr (!std::is_invocable_v<F&, const std::string&>) {
      static_assert(rdf::detail::always_false<F>, "lrt: on_remove expects a callable of the member's id; write [](const std::string& id) { ... }");
      return *this;
    } else if constexpr (!model::refuses_by_result<std::invoke_result_t<F&, const std::string&>>) {
      static_assert(rdf::detail::always_false<F>,
                    "lrt: the callable of on_remove returns void or Result<void>; write -> lrt::Result<void> and return lrt::refused(\"reason\")");
      return *this;
    } else {
      return this->edit("on_remove", [&](auto& s) {
        s.remove = [remove = std::move(remove)](const std::string& id) mutable -> Result<void> {
          return model::result_of([&] { return remove(id); });
        };
      });
    }
  }
  /// Unit and bounds of the members. What `f` does not set stays as it is.
  Collection& facets(const rdf::Facets& f) {
    return this->edit("facets", [&](auto& s) { s.facets.merge(f); });
  }
  /// Limits the number of members. A POST beyond it is answered 409. Default: 1000.
  Collection& max_members(std::size_t n) {
    return this->edit("max_members", [&](auto& s) { s.max_members = n; });
  }

 private:
  friend class Thing;
  explicit Collection(std::shared_ptr<model::CollectionSpec> spec) noexcept : Base(std::move(spec)) {}
};

}  // namespace v0
}  // namespace lrt
