// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>

#include <redland.h>

/// The tasks of a robot, kept in an SQLite file by Redland. It knows nothing of lrt.
///
///     <urn:task:1> a schema:Action ; schema:name "fetch the red cup" ; schema:actionStatus schema:PotentialActionStatus .
///
/// Then schema:ActiveActionStatus, then schema:CompletedActionStatus. One thread uses a TaskList.
class TaskList {
 public:
  /// Opens the file, or makes it.
  explicit TaskList(const std::string& file) : world_(librdf_new_world()) {
    librdf_world_open(world_);
    storage_ = librdf_new_storage(world_, "sqlite", file.c_str(), std::filesystem::exists(file) ? "" : "new='yes'");
    if (!storage_) throw std::runtime_error("the storage of Redland on SQLite (Debian: librdf-storage-sqlite) does not open " + file);
    model_ = librdf_new_model(world_, storage_, nullptr);
  }
  ~TaskList() {
    librdf_free_model(model_);
    librdf_free_storage(storage_);
    librdf_free_world(world_);
  }
  TaskList(const TaskList&) = delete;
  TaskList& operator=(const TaskList&) = delete;

  bool empty() const { return librdf_model_size(model_) == 0; }

  void add(const std::string& task, const std::string& title) {
    librdf_model_transaction_start(model_);
    librdf_model_add(model_, uri(task), uri("http://www.w3.org/1999/02/22-rdf-syntax-ns#type"), uri("http://schema.org/Action"));
    librdf_model_add(model_, uri(task), uri("http://schema.org/name"), text(title));
    librdf_model_add(model_, uri(task), uri(has_status), uri(open));
    librdf_model_transaction_commit(model_);
  }

  static constexpr const char* open = "http://schema.org/PotentialActionStatus";
  static constexpr const char* active = "http://schema.org/ActiveActionStatus";
  static constexpr const char* done = "http://schema.org/CompletedActionStatus";

  /// A task with that status, "urn:task:1".
  std::optional<std::string> find(const std::string& status) const {
    librdf_node *const p = uri(has_status), *const o = uri(status);
    librdf_node* const found = librdf_model_get_source(model_, p, o);
    std::optional<std::string> task;
    if (found && librdf_node_is_resource(found)) task = reinterpret_cast<const char*>(librdf_uri_as_string(librdf_node_get_uri(found)));
    for (librdf_node* node : {p, o, found})
      if (node) librdf_free_node(node);
    return task;
  }

  /// Changes the status of a task, if it is still as expected.
  void move(const std::string& task, const std::string& from, const std::string& to) {
    librdf_model_transaction_start(model_);
    librdf_statement* const old = librdf_new_statement_from_nodes(world_, uri(task), uri(has_status), uri(from));
    if (librdf_model_remove_statement(model_, old) == 0) librdf_model_add(model_, uri(task), uri(has_status), uri(to));
    librdf_free_statement(old);
    librdf_model_transaction_commit(model_);
  }

  librdf_model* model() const noexcept { return model_; }

 private:
  static constexpr const char* has_status = "http://schema.org/actionStatus";
  static const unsigned char* bytes(const std::string& s) { return reinterpret_cast<const unsigned char*>(s.c_str()); }
  librdf_node* uri(const std::string& s) const { return librdf_new_node_from_uri_string(world_, bytes(s)); }
  librdf_node* text(const std::string& s) const { return librdf_new_node_from_literal(world_, bytes(s), nullptr, 0); }

  librdf_world* world_;
  librdf_storage* storage_ = nullptr;
  librdf_model* model_ = nullptr;
};
