// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>
#include <lrt/client/latest.hpp>
#include <lrt/client/patch.hpp>
#include <lrt/client/representation.hpp>
#include <lrt/client/watch.hpp>
#include <lrt/rdf/traits.hpp>
#include <lrt/rdf/unit.hpp>
#include <lrt/rdf/value_codec.hpp>
#include <lrt/rdf/words.hpp>

namespace lrt {
inline namespace v0 {
class Client;
}  // namespace v0
}  // namespace lrt

namespace lrt::client {
inline namespace v0 {

class Session;

/// A published shape with the graph that contains it: its own document, and those to which it refers.
struct Shape {
  rdf::Graph graph{};  ///< the shapes graph
  rdf::Term node{};    ///< the shape in it
};

/// Options of Property::write().
struct WriteOptions {
  lrt::Unit unit{};        ///< unit of the number; empty: the declared one. Nothing is converted: another unit is an error
  std::string if_match{};  ///< an entity tag: the value is written only if the representation still has it (RFC 9110 13.1.1)
};

/// The names of a resource: shortened paths, titles and terms. Look-up by name accepts each of them.
struct Names {
  std::vector<std::string> titles{};      ///< dcterms:title, rdfs:label, schema:name
  std::vector<std::string> predicates{};  ///< predicates from its Thing to it, without hybrit:property and hybrit:action
};

/// What a server says of a Property or an Action in its structure document (SPEC 3.24), without its value. Robots that were opened by links have none.
struct Declared {
  rdf::Words words{};                  ///< title and description; without a language: in that of the server's choice
  std::string datatype{};              ///< IRI: of a number, text and so on, or of the members of a list; empty: it has several, or none
  lrt::Unit unit{};                    ///< of the value or input; empty: none
  bool has_value = false;              ///< false: an Action without input
  bool is_simple = false;              ///< the value or input is one number, one text without a fixed set, or true or false
  bool may_change = false;             ///< this client may write it, or invoke it
  bool is_stop = false;                ///< an Action that stops the robot
  std::vector<std::string> choices{};  ///< the names of an enumeration, "true" and "false", or the tags of a variant
  bool is_variant = false;             ///< the value or input is one of several alternatives, whose tags are `choices`
};

/// A Property of a Thing (R1.9): a resource of its own, or a node in the graph of its Thing.
/// @par Errors   of an exchange, see Client; refusals by the server as for Action::invoke().
/// @par Threads  Any. Functions that return a Result block until the response, at most the times of Limits. Not for a
///               control loop; see latest().
class LRT_API Property {
 public:
  const std::string& url() const noexcept { return url_; }  ///< its URL
  const Names& names() const noexcept { return names_; }    ///< its names
  /// The shortest name: the local name of its predicate, else the last segment of the path.
  std::string name() const;
  /// What the server says of it; nullptr: it was found by links.
  const Declared* declared() const noexcept { return declared_.get(); }

  /// The present representation, by GET. If it has not changed since the last GET, only the header section is
  /// transferred (R0.11).
  Result<RepresentationPtr> get() const;

  /// The present value. A number must have the given unit.
  /// @par Errors  of the exchange; expected_value: the representation has no such value, or another unit
  template <class T>
  Result<T> read(const lrt::Unit& unit = lrt::unit::none) const {
    Result<RepresentationPtr> found = get();
    if (!found) return Unexpected{std::move(found).error()};
    Result<rdf::Value> value = decode(**found, rdf::traits<T>::type(), unit);
    if (!value) return Unexpected{std::move(value).error()};
    return rdf::traits<T>::decode(*value);
  }

  /// Writes the value, by PUT (R0.5). With Options::validate the value is validated against the published shape first
  /// and, if it does not conform, not sent.
  ///
  /// A server that publishes neither binding nor shape for it may store documents. Its present document is then read, changed in what is the value, and sent
  /// with If-Match, up to three times if somebody else changes it meanwhile.
  /// @par Errors  expected_value: the value does not conform, with the shape's message; refused: the document has no strong entity tag, so that other
  ///              changes could be lost; refused, closed, ...: of the exchange, with the server's reason
  template <class T>
  Result<void> write(const T& value, const WriteOptions& options = {}) const {
    return write(rdf::traits<T>::type(), rdf::traits<T>::encode(value), options);
  }
  /// Writes a value of a type that is known at run time.
  Result<void> write(const rdf::Type& type, const rdf::Value& value, const WriteOptions& options = {}) const;
  /// Writes a graph; `focus` is the node of the value.
  Result<void> write(const rdf::Graph& graph, rdf::TermId focus, const WriteOptions& options = {}) const;

  /// Changes parts of the value, by PATCH with `application/merge-patch+json`. The robot's program merges them with the
  /// value that it has then, so that clients which change different parts do not undo each other's changes; the server judges
  /// the whole as that of write(). Nothing is validated here.
  ///
  ///     joint.property("command").value().patch(client::Patch().set("position", 0.1)).value();
  ///
  /// @param options  WriteOptions::unit must be empty: a record has units of its fields
  /// @par Errors  unsupported_syntax: the server takes no such patch of this property, and nothing was changed; unconfirmed:
  ///              the robot has begun and has not said whether it succeeded; refused, closed, ...: as write()
  Result<void> patch(const Patch& patch, const WriteOptions& options = {}) const;

  /// Whether the server states that it can be written: by its binding (SPEC 3.3) or by Allow.
  Result<bool> is_writable() const;
  /// The declared unit of a number; empty: none.
  Result<lrt::Unit> unit() const;
  /// The shape against which the server validates what is written. nullopt: it publishes none.
  Result<std::optional<Shape>> shape() const;
  /// The shape that its present value has, for a server that publishes none: one literal of its datatype, with its unit. nullopt: it has no such
  /// value.
  Result<std::optional<Shape>> present_shape() const;
  /// The shape of its value, also if it cannot be written: shape(), otherwise that of a linked Blueprint for its
  /// predicate. nullopt: there is none.
  Result<std::optional<Shape>> value_shape() const;

  /// Begins to watch it; see Client::watch().
  /// @par Errors  those of Client::watch()
  /// @par Time    Does not wait for the server.
  Result<Watch> watch(const WatchOptions& options, OnChange on_change) const;
  /// The newest value for a control loop, decoded on a thread of the client: a joint that follows a joint of another
  /// robot.
  /// @par Errors  expected_iri, invalid_option; closed: after Client::stop()
  template <class T>
  Result<Latest<T>> latest(const lrt::Unit& unit = lrt::unit::none, const WatchOptions& options = {}) const {
    return latest<T>(rdf::traits<T>::type(), unit, options);
  }
  /// The same for values that the server writes in another form than rdf::traits<T>::type().
  /// @param type  it must exist until the process ends
  template <class T>
  Result<Latest<T>> latest(const rdf::Type& type, const lrt::Unit& unit, const WatchOptions& options) const {
    return Latest<T>::follow([&](OnChange on_change) { return watch_at_once(options, std::move(on_change)); },
                             [self = *this, &type, unit](const Change& change) { return self.value_of<T>(change, type, unit); });
  }
  /// Decodes the value of a change that a watch has reported: of this property, or of its Thing's state.
  /// @par Errors  as read(); expected_rdf and others of Change::graph(); failed: the state says why the robot cannot read it now (lrt:error)
  /// @par Time    Sends no request.
  template <class T>
  Result<T> value_of(const Change& change, const lrt::Unit& unit = lrt::unit::none) const {
    return value_of<T>(change, rdf::traits<T>::type(), unit);
  }
  /// The same for a value in another form than rdf::traits<T>::type().
  template <class T>
  Result<T> value_of(const Change& change, const rdf::Type& type, const lrt::Unit& unit) const {
    Result<rdf::Value> value = decode(change, type, unit);
    if (!value) return Unexpected{std::move(value).error()};
    return rdf::traits<T>::decode(*value);
  }
  /// Decodes a value of a type that is known at run time.
  /// @par Errors  as value_of()
  /// @par Time    Sends no request.
  Result<rdf::Value> decode(const Change& change, const rdf::Type& type, const lrt::Unit& unit = lrt::unit::none) const;

  /// The node of the value in a graph of this property: the focus node or, of an inline property, the object of its
  /// predicate.
  /// @par Errors  expected_value: the node is ambiguous or missing; unknown_path: the Thing no longer has the property
  Result<rdf::TermId> value_node(const rdf::Graph& graph, std::optional<rdf::TermId> focus) const;
  /// Decodes the value of a representation of this property, or of its Thing's state.
  /// @par Errors  as value_node() and read(); failed: the state says why the robot cannot read it now (lrt:error)
  /// @par Time    Sends no request.
  Result<rdf::Value> decode(const Representation& representation, const rdf::Type& type, const lrt::Unit& unit = lrt::unit::none) const;

 private:
  friend class Session;
  friend class Discovery;
  friend class StructureReader;
  friend class lrt::Client;
  Property() = default;
  Result<void> put(const rdf::Graph& graph, rdf::TermId focus, const std::optional<Shape>& shape, const WriteOptions& options) const;
  Result<void> put_in_document(const rdf::Graph& value, rdf::TermId focus, const WriteOptions& options) const;
  Result<Watch> watch_at_once(const WatchOptions& options, OnChange on_change) const;
  std::vector<std::string> predicates_to(const Representation& representation) const;
  /// False: it is a node in the graph of its Thing, and has no representation of its own.
  bool is_resource() const noexcept;
  std::optional<rdf::TermId> node_in(const rdf::Graph& graph, std::optional<rdf::TermId> focus) const noexcept;
  Result<rdf::Value> decode(const rdf::Graph& graph, std::optional<rdf::TermId> focus, const rdf::Type& type, const lrt::Unit& unit) const;

  std::shared_ptr<Session> session_;
  std::string url_;        ///< of the resource; with a fragment that of a node in the document of its Thing; of a blank node that of its Thing
  std::string predicate_;  ///< blank node: from the Thing to the value; else empty
  Names names_;
  std::shared_ptr<const Declared> declared_;
};

/// One invocation of an action (SPEC 3.1).
/// @par Errors   of an exchange, see Client; refusals by the server as for Action::invoke().
/// @par Threads  Any. Functions that return a Result block until the response, at most the times of Limits.
class LRT_API Invocation {
 public:
  /// The status that the server states; unknown: none.
  enum class Status : unsigned char { pending, running, succeeded, failed, cancelled, unknown };
  /// What the server states about the invocation.
  struct State {
    Status status = Status::unknown;     ///< its status
    std::optional<double> progress{};    ///< 0 to 1
    std::string error{};                 ///< the robot's reason, if it failed
    RepresentationPtr representation{};  ///< null: the response to the request contained everything
  };

  /// Its URL; empty if the server has made no resource for it, because it had ended with the response.
  const std::string& url() const noexcept { return url_; }
  /// Requests its present state.
  Result<State> state() const;
  /// Waits until it has ended. `on_progress` is called on this thread when the status or the progress has changed.
  /// @par Errors  timed_out: it has not ended; unknown_path: the server no longer has it
  Result<State> wait(std::chrono::milliseconds at_most, const std::function<void(const State&)>& on_progress = {}) const;
  /// Cancels it, by DELETE.
  Result<void> cancel() const;

  /// The output of the action. @pre it has succeeded
  /// @par Errors  expected_value: there is no such result
  template <class T>
  Result<T> result(const lrt::Unit& unit = lrt::unit::none) const {
    Result<rdf::Value> value = result(rdf::traits<T>::type(), unit);
    if (!value) return Unexpected{std::move(value).error()};
    return rdf::traits<T>::decode(*value);
  }
  /// The output as a value of a type that is known at run time.
  /// @par Errors  as above
  Result<rdf::Value> result(const rdf::Type& type, const lrt::Unit& unit = lrt::unit::none) const;
  /// The node of the output, and the representation that contains it.
  struct ResultNode {
    RepresentationPtr representation;  ///< contains the node
    rdf::TermId node;                  ///< of its graph
  };
  /// Finds the output.
  /// @par Errors  expected_value: there is no result
  Result<ResultNode> result_node() const;

 private:
  friend class Action;
  friend class lrt::Client;
  Invocation() = default;
  std::shared_ptr<Session> session_;
  std::string url_;
  State ended_;                 ///< what the response to the request said
  bool states_status_ = false;  ///< the server is one that states lrt:status
};

/// Options of Action::invoke().
struct InvokeOptions {
  lrt::Unit unit{};                                           ///< see WriteOptions::unit
  bool async = false;                                         ///< `Prefer: respond-async`: the response does not wait for the beginning
  std::vector<std::pair<std::string, std::string>> fields{};  ///< further header fields
};

/// An Action of a Thing (R1.10).
/// @par Errors   of an exchange, see Client; refusals by the server as for invoke().
/// @par Threads  Any. Functions that return a Result block until the response, at most the times of Limits.
class LRT_API Action {
 public:
  const std::string& url() const noexcept { return url_; }  ///< its URL
  const Names& names() const noexcept { return names_; }    ///< its names
  /// The shortest of its names.
  std::string name() const;
  /// What the server says of it; nullptr: it was found by links.
  const Declared* declared() const noexcept { return declared_.get(); }
  /// The present representation, by GET.
  Result<RepresentationPtr> get() const;

  /// Invokes it by the method, the URL and the header fields of its binding (paper 5.4); without a binding by a POST to
  /// its URL. All that takes at most Options::command_life, also what is read for it. A stop of an lrt server that
  /// Client::open() has found is sent at once, without reading anything, and waits for Limits::response_time.
  /// @par Errors  expected_value: the input does not conform to the published shape, and nothing was sent; refused
  ///              (403, 409), expected_value (400, 422), unknown_path (404), limit_exceeded (429, 503), failed (5xx),
  ///              each with the server's reason; and those of the exchange
  template <class T>
  Result<Invocation> invoke(const T& input, const InvokeOptions& options = {}) const {
    return invoke(rdf::traits<T>::type(), rdf::traits<T>::encode(input), options);
  }
  /// Invokes it without input.
  Result<Invocation> invoke(const InvokeOptions& options = {}) const;
  /// Invokes it with a value of a type that is known at run time.
  Result<Invocation> invoke(const rdf::Type& type, const rdf::Value& input, const InvokeOptions& options = {}) const;
  /// Invokes it with a graph; `focus` is the node of the input.
  Result<Invocation> invoke(const rdf::Graph& input, rdf::TermId focus, const InvokeOptions& options = {}) const;

  /// Shape of the input (`hybrit:consumes`). nullopt: it has none, or does not state it.
  Result<std::optional<Shape>> input_shape() const;
  /// Shape of the output (`hybrit:produces`, except effects). nullopt: it has none, or does not state it.
  Result<std::optional<Shape>> output_shape() const;
  /// The declared unit of a number as input; empty: none.
  Result<lrt::Unit> unit() const;
  /// URLs of the Properties that it changes, each once: `sosa:forProperty` of its effects, or `ssn:forProperty`.
  Result<std::vector<std::string>> effects() const;
  /// Classes of its input: sh:class of the shape, the class of the binding's body, and sh:targetClass of the shape.
  Result<std::vector<std::string>> consumed_classes() const;
  /// Classes of its output and effects: sh:class of the shapes, and sh:targetClass.
  Result<std::vector<std::string>> produced_classes() const;
  /// Whether the robot offers it now (lrt:unavailable).
  Result<bool> is_available() const;
  /// URLs of running and past invocations to which the action links.
  Result<std::vector<std::string>> invocations() const;

 private:
  friend class Session;
  friend class Discovery;
  friend class StructureReader;
  friend class lrt::Client;
  Action() = default;
  Result<std::vector<std::string>> classes_of(Iri predicate) const;
  Result<Invocation> stop(const InvokeOptions& options) const;
  Result<Invocation> invoked(const Response& response, const std::string& method, bool states_status) const;
  Result<Invocation> send(const rdf::Graph* input, const InvokeOptions& options) const;

  std::shared_ptr<Session> session_;
  std::string url_;
  Names names_;
  std::shared_ptr<const Declared> declared_;
  bool is_stop_ = false;  ///< its Thing says so
};

/// A Thing that Client::open() has found. Its links and types are those of that time; see Robot::refresh().
/// @par Threads  Any.
class LRT_API Thing {
 public:
  const std::string& url() const noexcept { return url_; }  ///< its URL
  const Names& names() const noexcept { return names_; }    ///< its names
  /// The shortest of its names.
  std::string name() const;
  rdf::Words words() const { return words_; }                ///< title and description
  std::vector<std::string> types() const { return types_; }  ///< IRIs of its classes; opened by a structure document: without Blueprints
  bool is(Iri type) const;                                   ///< whether it has a class
  const std::vector<Property>& properties() const noexcept { return properties_; }  ///< its properties
  const std::vector<Action>& actions() const noexcept { return actions_; }          ///< its actions
  /// Its document, as it was read. Of a robot that was opened by a structure document it is read now, when it is first needed.
  /// @return  without triples: it cannot be read
  /// @par Time  May block, as Property::get().
  const RepresentationPtr& representation() const;

  /// The property with a name: a predicate or its local name, a title, a URL or the end of one ("friction",
  /// "arm/friction").
  /// @par Errors  unknown_path: there is none; the message lists the names. expected_value: several have the name
  Result<Property> property(std::string_view name) const;
  /// The property to which the Thing links by a predicate.
  /// @par Errors  as above
  Result<Property> property(Iri predicate) const { return property(predicate.text); }
  /// The action with a name, as property().
  /// @par Errors  as above
  Result<Action> action(std::string_view name) const;

  /// URL of the Subscriptions container (R1.8); empty: it has none.
  std::string subscriptions() const { return subscriptions_; }
  /// URL of the resource with the values of all its Properties (`lrt:state`); empty: it has none.
  std::string state() const { return state_; }
  /// URLs of the Blueprints (R1.11), from representation().
  std::vector<std::string> blueprints() const { return representation()->objects(vocab::hybrit::blueprint); }

 private:
  friend class Session;
  friend class Discovery;
  friend class StructureReader;
  Thing() = default;

  struct LateDocument;
  std::shared_ptr<Session> session_;
  std::string url_, subscriptions_, state_;
  Names names_;
  rdf::Words words_;
  std::vector<std::string> types_;
  std::shared_ptr<LateDocument> document_;  ///< shared by copies
  std::vector<Property> properties_;
  std::vector<Action> actions_;
};

/// A search for actions. Empty members are ignored.
struct ActionQuery {
  Iri consumes{};         ///< class of the input, maths:Scalar
  Iri produces{};         ///< class of the output or of the effect
  std::string affects{};  ///< a Property that an effect names: its URL, or a predicate from its Thing to it
  std::string thing{};    ///< URL of the action's Thing
};

/// Everything that Client::open() has found from one URL.
/// @par Threads  Any: immutable.
class LRT_API Robot {
 public:
  const std::string& url() const noexcept { return url_; }                ///< URL given to Client::open()
  const std::vector<Thing>& things() const noexcept { return *things_; }  ///< all Things
  std::vector<Thing> things(Iri type) const;                              ///< the Things with a class
  /// The Thing with a name: a title, a URL or the end of one ("right_s1", "baxter/right_s1").
  /// @par Errors  as Thing::property()
  Result<Thing> thing(std::string_view name) const;
  /// A property by the names of its Thing and its own, "right_s1/friction", or by its URL or the end of the URL.
  /// @par Errors  as Thing::property()
  Result<Property> property(std::string_view name) const;
  /// An action by the names of its Thing and its own, or by its URL or the end of the URL.
  /// @par Errors  as Thing::property()
  Result<Action> action(std::string_view name) const;
  /// The actions whose descriptions match a search.
  /// @par Errors  of the exchange for a description
  /// @par Time    Blocks while descriptions are requested.
  Result<std::vector<Action>> actions(const ActionQuery& query) const;
  /// Resources that could not be read, a sentence each; at most 100.
  const std::vector<std::string>& problems() const noexcept { return *problems_; }
  /// Number of requests that were needed.
  std::size_t requests() const noexcept { return requests_; }
  /// Reads it again; unchanged representations are not transferred.
  /// @par Errors  as Client::open()
  /// @par Time    Blocks, as Client::open().
  Result<Robot> refresh() const;

 private:
  friend class Session;
  friend class Discovery;
  friend class Structures;
  Robot() = default;

  std::shared_ptr<Session> session_;
  std::string url_;
  std::shared_ptr<const std::vector<Thing>> things_;
  std::shared_ptr<const std::vector<std::string>> problems_;
  std::size_t requests_ = 0;
};

/// The enumerator's name.
/// @par Threads  Any.
LRT_API std::string_view to_string(Invocation::Status status) noexcept;
/// Whether an invocation with this status has ended.
inline bool has_ended(Invocation::Status status) noexcept {
  return status == Invocation::Status::succeeded || status == Invocation::Status::failed || status == Invocation::Status::cancelled;
}

}  // namespace v0
}  // namespace lrt::client
