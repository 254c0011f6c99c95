// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/result.hpp>
#include <lrt/model/representation.hpp>

#include "src/engine/body_task.hpp"
#include "src/engine/command_rules.hpp"
#include "src/engine/deadline_queue.hpp"
#include "src/engine/property_values.hpp"
#include "src/engine/resource.hpp"
#include "src/model/spec.hpp"

namespace lrt::engine {
inline namespace v0 {

/// A Property: its value with time, unit and frame, readable, observable, and writable if the user says so (R1.9, paper 5.2).
class PropertyResource final : public ValueResource {
 public:
  PropertyResource(const std::string& path, ThingNode* thing, std::shared_ptr<model::PropertySpec> s);

  Methods methods() const noexcept override;
  Outcome put(Context& context, Parts& parts) override;
  Outcome patch(Context& context, Parts& parts) override;
  std::string_view patch_types() const noexcept override { return value_patch_types; }
  Input input(const EngineOptions& options) const override { return input_of(*spec, *spec->type, spec->facets, options); }
  /// @pre published values were taken
  bool is_up_to_date() const noexcept override { return spec->slot && !spec->slot->has_change() && !is_refreshing() && !has_writes(); }
  std::string input_shape() const override { return spec->path; }

  void describe(const Description& d) const override;
  /// In a document of several properties: if it has no present value, or one of too many members, it says why instead (0068).
  /// @param left  how many members the RDF of the document may still have; counted down
  void describe_in_state(const Description& d, std::size_t& left) const;
  /// A writable Property has a binding, as Actions have.
  void describe_controls(About& about, const Description& d) const override;
  void describe_types(About& about, const Description& d) const override;
  const ResourceKind& kind() const noexcept override {
    static constexpr Observable observable{vocab::hybrit::Property};
    static constexpr ResourceKind kind{"property", Trait::fixed_links | Trait::plain_bodies | Trait::commands, &observable};
    return kind;
  }
  const model::ResourceSpec* command() const noexcept override { return in_graph ? nullptr : spec.get(); }
  void summarize(Overview& o) const override;
  const Variants& variants() const override { return own_variants_ ? *own_variants_ : value_variants(); }
  std::optional<PlainValue> plain_value(const Audience&) const override { return PlainValue{spec->type, &spec->facets, &value}; }
  bool fits_rdf(std::size_t max_values) const override { return only_octets || fits(value, max_values); }
  std::uint64_t state(std::uint64_t) const noexcept override { return revision; }
  std::string_view cache_control() const noexcept override { return spec->cache_control ? *spec->cache_control : Resource::cache_control(); }

  Reads reads() const noexcept override { return Reads::values; }
  void for_each_property(FunctionRef<void(PropertyResource&)> visit) const override;

  void set_observed(bool observed, ChangeScanner& scanner) override { set_watched(observed, scanner); }
  /// Called by its own observers and those of its Thing's state, which need new values.
  void set_watched(bool watched, ChangeScanner& scanner);
  /// Its value has changed: notifies its observers and those of whole_resource().
  void mark_value_changed();
  /// Its value is about to be replaced: notifies its observers and those of its Thing's state.
  void mark_changing();
  /// is_failing() has changed: notifies its observers and those of its Thing's state. Those of its value receive nothing, because the value is the
  /// same.
  void mark_readability_changed();
  /// Removes its value if that is too old.
  void expire(Utc now);
  void refresh() override {
    if (in_graph) in_graph->graph.refresh();
  }
  /// Reports published values that were never taken to its observers and to those of its Thing's state.
  /// @pre it is a pushed property
  void report_lost();

  /// Its changes so far, also those that the engine never saw because newer ones had overwritten them.
  std::uint64_t change_number() const noexcept override { return number_; }
  std::optional<Utc> value_time() const noexcept override { return value.is_null() ? std::nullopt : std::optional(modified); }
  /// Its value is about to become another one.
  /// @param taken  number of the value in the slot, which counts each publish(); 0: it is not from a slot
  void count(std::uint64_t taken) noexcept;
  /// A published value is the one that it has already. Those between count as changes.
  void count_unchanged(std::uint64_t taken) noexcept;

  /// Called when the resource is removed. Requests that wait for a write get 404.
  void removed(Parts& parts);

  const std::shared_ptr<model::PropertySpec> spec;
  rdf::Value value;                   ///< null: none yet
  std::shared_ptr<const void> whole;  ///< the T of the value, for the user's encoders
  Utc modified{};
  const bool promises_value;     ///< in its Blueprint: it is read for each request, or was published before the registration
  bool only_octets = false;      ///< the value has too many members for RDF, which describes its octets instead
  bool is_fault_logged = false;  ///< what was published last has no representation, see fault_of_value()

  ThinVector<Encoding> encodings;                  ///< of the present value, by the user's encoders; of the same index
  std::unique_ptr<PropertyRefresh> refresh_state;  ///< PropertyValues'; null: none was needed yet
  bool is_refreshing() const noexcept { return refresh_state && refresh_state->running; }
  /// There is no present value: the last read failed, or what was published last cannot be represented.
  bool is_failing() const noexcept { return refresh_state && !refresh_state->failure.empty(); }
  /// Why, for clients. @pre is_failing()
  const std::string& failure() const noexcept { return refresh_state->failure; }
  /// How often is_failing() has changed while the value was the same: changes that `revision` does not count.
  std::uint64_t failure_changes() const noexcept { return refresh_state ? refresh_state->failure_changes : 0; }
  /// The further state of a value that is published in a graph of a World.
  struct InGraph {
    ValueResource& graph;
    std::chrono::milliseconds expires_after{0};  ///< without a new value; zero: never
  };
  std::unique_ptr<const InGraph> in_graph;  ///< nullptr: it belongs to a Thing
  /// The other resource with the value: its graph, or the state of its Thing.
  ValueResource& whole_resource() const;
  std::uint32_t watchers = 0;
  std::uint32_t queues = 0;                      ///< observers with a queue, for which the slot keeps values; PropertyValues'
  DeadlineQueue<ResourceId>::Place next_sample;  ///< ChangeScanner's, of a pulled property
  std::uint64_t seen_lost = 0;                   ///< of the slot's lost values, those that observers know of

 private:
  struct Write {
    Ticket ticket;
    std::shared_ptr<const rdf::Value> value;  ///< shared with the lambda's call
    std::shared_ptr<const ValuePatch> patch;  ///< that makes the value; nullptr: it is there
    unsigned attempts = 0;                    ///< to apply the patch, before which the robot published
  };
  /// The result of the write lambda.
  struct Written {
    std::shared_ptr<const void> whole;
    std::shared_ptr<const rdf::Value> value{};  ///< that the patch has made
    std::unique_ptr<BodyFault> fault{};         ///< the patch is refused
    bool is_behind = false;                     ///< a value was published before the patch was applied: nothing was done
  };

  bool has_writes() const noexcept { return writes_ && (writes_->writing || !writes_->queue.empty()); }
  bool is_first_write(Ticket ticket) const noexcept { return writes_ && !writes_->queue.empty() && writes_->queue.front().ticket == ticket; }
  void describe(const Description& d, std::string_view failure) const;
  void describe_formats(About& about, const Description& d) const;
  void begin_next_write(Parts& parts, TimePoint now);
  void judge_after_refresh(Encodings wanted, Parts& parts);
  void judge_write(Parts& parts, TimePoint now, bool encoded);
  void judge_write(Ticket ticket, Parts& parts, TimePoint now, bool encoded);
  Outcome enqueue(Context& context, Parts& parts, Write write);
  void call_write(Ticket ticket, const Context& context, Parts& parts);
  void call_patch(Ticket ticket, const Context& context, Parts& parts);
  void patch_in_turn(Ticket ticket, Parts& parts, TimePoint now);
  void end_turn(Parts& parts, TimePoint now);
  void end_write(Result<Written> written, Refusal refusal, Parts& parts, TimePoint now);
  void respond_to(const Write& write, Result<Written> written, Refusal refusal, Parts& parts, TimePoint now);
  template <class Step>
  void drops_if_thrown(Ticket ticket, Step step);
  void drop_write();

  /// The waiting writes. The first may be running.
  struct Writes {
    std::vector<Write> queue;  ///< executed one at a time; the preconditions of each are evaluated when it starts
    bool writing = false;
    bool has_turn = false;  ///< PropertyValues::take_turn()
    std::shared_ptr<CancelToken> token;
  };

  void add_changes(std::uint64_t changes) noexcept;

  std::uint64_t number_ = 0;                      ///< of its present value
  std::uint64_t taken_ = 0;                       ///< of the slot, the value that was taken last
  std::unique_ptr<const Variants> own_variants_;  ///< nullptr: those of any value
  std::unique_ptr<Writes> writes_;                ///< nullptr: there are none
};

}  // namespace v0
}  // namespace lrt::engine
