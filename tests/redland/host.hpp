// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <time.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <lrt/lrt.hpp>
#include <lrt/query.hpp>
#include <lrt/redland.hpp>

#include "tests/support/folder.hpp"
#include "tests/support/message.hpp"
#include "tests/support/socket.hpp"

namespace lrt::test {

/// A storage of Redland: its name and options. `%` in the name of a store is a file of its own.
struct StorageKind {
  const char* name;
  const char* store;
  const char* options;
  bool has_transactions;
};
inline constexpr StorageKind memory{"memory", "", "", false};
inline constexpr StorageKind hashes{"hashes", "t", "hash-type='memory'", false};
inline constexpr StorageKind trees{"trees", "t", "", false};
inline constexpr StorageKind sqlite{"sqlite", ":memory:", "new='yes'", true};  // no test waits for the disk, unless it is about that
inline constexpr StorageKind sqlite_file{"sqlite", "%", "new='yes'", true};
inline constexpr StorageKind all_storages[] = {memory, hashes, trees, sqlite};

/// A program that uses librdf, and knows nothing of lrt.
class Stranger {
 public:
  explicit Stranger(const StorageKind& kind, const std::string& more = {}, librdf_log_func logger = nullptr, void* logger_data = nullptr)
      : world_(librdf_new_world()) {
    librdf_world_open(world_);
    if (logger) librdf_world_set_logger(world_, logger_data, logger);
    std::string options = kind.options + (more.empty() ? std::string() : (*kind.options != 0 ? "," : "") + more);
    if (*kind.store == '%') folder_.emplace();
    const std::string store = folder_ ? *folder_ / "store.db" : kind.store;
    storage_ = librdf_new_storage(world_, kind.name, store.empty() ? nullptr : store.c_str(), options.c_str());
    if (!storage_) throw std::runtime_error(std::string("no storage ") + kind.name + " (vendor/install.sh librdf)");
    model_ = librdf_new_model(world_, storage_, nullptr);
  }
  ~Stranger() {
    free_model();
    librdf_free_world(world_);
  }
  Stranger(const Stranger&) = delete;
  Stranger& operator=(const Stranger&) = delete;

  void free_model() {
    if (model_) librdf_free_model(std::exchange(model_, nullptr));
    if (storage_) librdf_free_storage(std::exchange(storage_, nullptr));
  }

  librdf_world* world() const noexcept { return world_; }
  librdf_model* model() const noexcept { return model_; }

  librdf_node* uri(const std::string& text) const { return librdf_new_node_from_uri_string(world_, bytes(text)); }
  librdf_node* text(const std::string& text, const char* language = nullptr) const {
    return librdf_new_node_from_literal(world_, bytes(text), language, 0);
  }
  librdf_node* blank(const std::string& id) const { return librdf_new_node_from_blank_identifier(world_, bytes(id)); }
  /// @return  what the storage returns
  int add(librdf_node* s, librdf_node* p, librdf_node* o) { return librdf_model_add(model_, s, p, o); }
  int add(const std::string& s, const std::string& p, const std::string& o) { return add(uri(s), uri(p), text(o)); }
  int remove(librdf_node* s, librdf_node* p, librdf_node* o) {
    librdf_statement* const statement = librdf_new_statement_from_nodes(world_, s, p, o);
    const int result = librdf_model_remove_statement(model_, statement);
    librdf_free_statement(statement);
    return result;
  }
  int remove(const std::string& s, const std::string& p, const std::string& o) { return remove(uri(s), uri(p), text(o)); }
  bool has(librdf_node* s, librdf_node* p, librdf_node* o) const {
    librdf_statement* const statement = librdf_new_statement_from_nodes(world_, s, p, o);
    const bool found = librdf_model_contains_statement(model_, statement) != 0;
    librdf_free_statement(statement);
    return found;
  }
  bool has(const std::string& s, const std::string& p, const std::string& o) const { return has(uri(s), uri(p), text(o)); }
  int size() const { return librdf_model_size(model_); }

 private:
  static const unsigned char* bytes(const std::string& text) { return reinterpret_cast<const unsigned char*>(text.c_str()); }
  std::optional<Folder> folder_;
  librdf_world* world_;
  librdf_storage* storage_ = nullptr;
  librdf_model* model_ = nullptr;
};

inline constexpr auto patience = std::chrono::seconds(30);

/// The same program with a server, whose poll() is in its loop.
class Host {
 public:
  using Change = std::function<void(Options&, GraphOptions&, redland::Options&)>;
  explicit Host(Stranger& stranger, const Change& change = {}) {
    Options options;
    options.listen.port = 0;
    options.query = query::endpoint();
    GraphOptions graph;
    graph.clients_may_write = true;
    redland::Options how;
    // No test depends on how slow the machine is, unless it is about that.
    how.write_timeout = std::chrono::seconds(20);
    options.limits.host_timeout = std::chrono::seconds(25);
    if (change) change(options, graph, how);
    server.emplace(Server::create(std::move(options)).value());
    World world("world");
    world.graph("own", {});
    Result<redland::Model> attached = redland::Model::attach(world, "tasks", stranger.model(), how, graph);
    if (!attached) throw std::runtime_error(attached.error().message);
    model.emplace(*std::move(attached));
    server->add(std::move(world)).value();
  }

  /// Turns of the host's loop until the condition holds.
  void until(const std::function<bool()>& holds) {
    const auto end = std::chrono::steady_clock::now() + patience;
    while (!holds()) {
      if (std::chrono::steady_clock::now() > end) throw std::runtime_error("not within 30 s");
      turn();
    }
  }
  void turn() {
    if (in_turn) in_turn();
    const double before = cpu_seconds();
    server->poll();
    longest_poll = std::max(longest_poll, cpu_seconds() - before);
    std::this_thread::sleep_for(std::chrono::microseconds(200));
  }
  /// A request, while the host's loop turns.
  Answer ask(const std::string& request) {
    Socket socket(server->port());
    socket.send(request);
    std::optional<Answer> answer;
    until([&] { return (answer = socket.receive()).has_value(); });
    return *std::move(answer);
  }
  Answer get(const std::string& path = "/world/tasks", const std::string& fields = {}) {
    return ask("GET " + path + "\nAccept: application/n-triples\n" + fields);
  }
  Answer patch(const std::string& update, const std::string& fields = {}) {
    return ask("PATCH /world/tasks\nContent-Type: application/sparql-update\n" + fields + "\n" + update);
  }
  Answer put(const std::string& turtle, const std::string& fields = {}) {
    return ask("PUT /world/tasks\nContent-Type: text/turtle\n" + fields + "\n" + turtle);
  }
  /// CSV
  std::string query(const std::string& sparql) {
    return ask("POST /sparql\nContent-Type: application/sparql-query\nAccept: text/csv\n\n" + sparql).body;
  }
  /// What the host has changed is shown.
  void changed() {
    const std::uint64_t before = model->counters().reads + model->counters().failed_reads;
    model->changed();
    until([&] { return model->counters().reads + model->counters().failed_reads > before; });
  }

  std::optional<Server> server;
  std::optional<redland::Model> model;
  std::function<void()> in_turn;
  double longest_poll = 0;  ///< seconds of CPU: others do not count

 private:
  static double cpu_seconds() {
    timespec now{};
    ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec) * 1e-9;
  }
};

}  // namespace lrt::test
