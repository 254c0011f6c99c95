// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <lrt/base/abi.hpp>

namespace lrt::rdf {
inline namespace v0 {

struct Triple;
class SharedGraph;

/// Owns the content of a large graph, or nothing. A copy shares its structure.
class LRT_API SharedGraphPointer {
 public:
  SharedGraphPointer() noexcept = default;
  SharedGraphPointer(const SharedGraphPointer& other) : graph_(other.graph_ ? copy_of(*other.graph_) : nullptr) {}
  SharedGraphPointer(SharedGraphPointer&& other) noexcept : graph_(std::exchange(other.graph_, nullptr)) {}
  SharedGraphPointer& operator=(SharedGraphPointer other) noexcept {
    std::swap(graph_, other.graph_);
    return *this;
  }
  ~SharedGraphPointer() {
    if (graph_) destroy(graph_);
  }
  explicit operator bool() const noexcept { return graph_ != nullptr; }
  SharedGraph& operator*() const noexcept { return *graph_; }
  const SharedGraphPointer* operator->() const noexcept { return this; }

  std::size_t size() const noexcept;
  std::size_t term_count() const noexcept;
  const Triple& at(std::uint32_t place) const noexcept;
  const std::vector<Triple>& triples() const;

 private:
  friend class SharedGraph;
  explicit SharedGraphPointer(SharedGraph* graph) noexcept : graph_(graph) {}
  static SharedGraph* copy_of(const SharedGraph& graph);
  static void destroy(SharedGraph* graph) noexcept;

  SharedGraph* graph_ = nullptr;
};

}  // namespace v0
}  // namespace lrt::rdf
