// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <type_traits>
#include <utility>

#include <lrt/model/resource_handle.hpp>
#include <lrt/rdf/traits.hpp>

namespace lrt {
inline namespace v0 {

/// Handle to a collection of a Thing: an LDP container of values of one type (way-points, tasks, saved poses). Clients
/// create members by POST and remove them by DELETE. The server stores the members in memory. Before each change it
/// calls the lambda of on_create() or on_remove(), which may refuse the change.
///
/// Unit, bounds, title, predicates and dispatch of a collection are those of model::ResourceHandle.
///
/// @tparam T  type of a member, with rdf::traits<T>
/// @par Threads  Set-up: one thread at a time, before Server::add(). The lambdas run where dispatch() says. With
///               Dispatch::in_poll they run one after another; with Dispatch::executor several calls may run at the
///               same time if the executor has several threads.
/// @par Time     A request waits at most engine::Limits::host_timeout for its lambda, then the client gets 503 and a
///               lambda that has not begun is not called.
/// @par Implements  R0.5, R0.8, LDP 5.2
template <class T>
class Collection : public model::ResourceHandle<Collection<T>, model::CollectionSetup> {
  using Base = model::ResourceHandle<Collection<T>, model::CollectionSetup>;

 public:
  /// An empty handle, to be assigned later.
  Collection() noexcept = default;

  /// Allows POST: the server reads and validates the body as a T, makes an id, and calls `create`. If it succeeds, the
  /// server adds the member, and the response is 201 with Location. Without on_create() a POST is answered with 405.
  ///
  /// @param create  callable `(const std::string& id, T)` or `(T)` that returns void or Result<void>. `id` is the last
  ///                path segment of the member's IRI
  /// @par Errors  of `create`; no member is added. refused, out_of_range, limit_exceeded: 409 with the message.
  ///              expected_value: 422. Another error, or an exception: 500. A body that is not a T within the bounds is
  ///              answered with 400, 415 or 422, and `create` is not called.
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
        if constexpr (model::can_be_null<F>)
          if (!create) return this->refuse_null("on_create"), *this;
        if (this->is_editable("on_create")) {
          this->set_create([create = std::move(create)](const std::string& id, const rdf::Value& v) mutable -> Result<void> {
            Result<T> value = rdf::traits<T>::decode(v);
            if (!value) return Unexpected{std::move(value).error()};
            if constexpr (std::is_invocable_v<F&, const std::string&, T>) return model::result_of([&] { return create(id, *std::move(value)); });
            else return model::result_of([&] { return create(*std::move(value)); });
          });
        }
        return *this;
      }
    }
  }
  /// Allows DELETE of members: the server calls `remove`, and removes the member if it succeeds. Without on_remove() a
  /// DELETE is answered with 405.
  ///
  /// @param remove  callable `(const std::string& id)` that returns void or Result<void>
  /// @par Errors  of `remove`: as for on_create(); the member is kept. 409 also if the member is being removed already.
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
      if constexpr (model::can_be_null<F>)
        if (!remove) return this->refuse_null("on_remove"), *this;
      if (this->is_editable("on_remove")) {
        this->set_remove(
            [remove = std::move(remove)](const std::string& id) mutable -> Result<void> { return model::result_of([&] { return remove(id); }); });
      }
      return *this;
    }
  }
  /// Sets unit and bounds of the members. What `f` does not set stays as it is.
  Collection& facets(const rdf::Facets& f) {
    if (this->is_editable("facets")) this->facets_of().merge(f);
    return *this;
  }
  /// Limits the number of members; a POST beyond it is answered with 409. Default: 1000.
  Collection& max_members(std::size_t n) {
    if (this->is_editable("max_members")) this->set_max_members(n);
    return *this;
  }

 private:
  friend class Thing;
  explicit Collection(std::shared_ptr<model::ResourceSpec> spec) noexcept : Base(std::move(spec)) {}
};

}  // namespace v0
}  // namespace lrt
