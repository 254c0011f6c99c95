#pragma once

#include <memory>
#include <string>
#include <type_traits>
#include <utility>

#include <lrt/model/detail/spec.hpp>
#include <lrt/rdf/traits.hpp>

namespace lrt {

/// Handle to a collection of a Thing: a container of values (way-points, tasks, saved poses). Clients create members by POST and remove
/// them by DELETE. The server stores the members. It calls your lambda before each change, and the lambda may refuse it.
template <class T>
class Collection {
 public:
  /// Allows POST. `create(id, T)` or `create(T)` returns void or Result<void>. After an error nothing is created, and the response is 409.
  template <class F>
  Collection& on_create(F create) {
    if (!spec_->sealed)
      spec_->create = [create = std::move(create)](const std::string& id, const rdf::Value& v) mutable -> Result<void> {
        Result<T> value = rdf::traits<T>::decode(v);
        if (!value) return Unexpected{std::move(value).error()};
        if constexpr (std::is_invocable_v<F&, const std::string&, T>) return call([&] { return create(id, *std::move(value)); });
        else return call([&] { return create(*std::move(value)); });
      };
    return *this;
  }
  /// Allows DELETE of members. `remove(id)` returns void or Result<void>. After an error the member is kept, and the response is 409.
  template <class F>
  Collection& on_remove(F remove) {
    if (!spec_->sealed)
      spec_->remove = [remove = std::move(remove)](const std::string& id) mutable -> Result<void> {
        return call([&] { return remove(id); });
      };
    return *this;
  }
  /// Where `create` and `remove` run. Default: as the thing's lambdas.
  Collection& dispatch(Dispatch where) { return edit([&](auto& s) { s.dispatch = where; }); }
  Collection& facets(const rdf::Facets& f) { return edit([&](auto& s) { s.facets = f; }); }
  /// Limits the number of members. A POST beyond it is answered 409. Default: 1000.
  Collection& max_members(std::size_t n) { return edit([&](auto& s) { s.max_members = n; }); }
  Collection& predicate(Iri p) { return edit([&](auto& s) { s.predicates.emplace_back(p.text); }); }
  /// Adds dcterms:title, for people.
  Collection& title(std::string text) { return add(vocab::dcterms::title, Object(std::move(text))); }
  Collection& add(Iri predicate, Object object) {
    return edit([&](auto& s) { s.statements.push_back({std::string(predicate.text), std::move(object)}); });
  }

 private:
  friend class Thing;
  explicit Collection(std::shared_ptr<model::CollectionSpec> spec) : spec_(std::move(spec)) {}
  template <class F>
  static Result<void> call(F f) {
    if constexpr (std::is_void_v<std::invoke_result_t<F&>>) {
      f();
      return {};
    } else {
      return f();
    }
  }
  template <class F>
  Collection& edit(F f) {
    if (!spec_->sealed) f(*spec_);
    return *this;
  }
  std::shared_ptr<model::CollectionSpec> spec_;
};

}  // namespace lrt
