#pragma once

#include <memory>
#include <string>
#include <type_traits>
#include <utility>

#include <lrt/model/detail/spec.hpp>
#include <lrt/model/resource_handle.hpp>
#include <lrt/rdf/traits.hpp>

namespace lrt {

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
    return this->edit("on_create", [&](auto& s) {
      s.create = [create = std::move(create)](const std::string& id, const rdf::Value& v) mutable -> Result<void> {
        Result<T> value = rdf::traits<T>::decode(v);
        if (!value) return Unexpected{std::move(value).error()};
        if constexpr (std::is_invocable_v<F&, const std::string&, T>) return call([&] { return create(id, *std::move(value)); });
        else return call([&] { return create(*std::move(value)); });
      };
    });
  }
  /// Allows DELETE of members. `remove(id)` returns void or Result<void>. After an error the member is kept, and the response is 409.
  template <class F>
  Collection& on_remove(F remove) {
    return this->edit("on_remove", [&](auto& s) {
      s.remove = [remove = std::move(remove)](const std::string& id) mutable -> Result<void> {
        return call([&] { return remove(id); });
      };
    });
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
  template <class F>
  static Result<void> call(F f) {
    if constexpr (std::is_void_v<std::invoke_result_t<F&>>) {
      f();
      return {};
    } else {
      return f();
    }
  }
};

}  // namespace lrt
