// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "src/check/survey.hpp"

namespace lrt::check {

/// Changes the value of a resource that the user permits to write, and puts it back. A number is changed by a thousandth, an integer by one.
class Change {
 public:
  /// @param url  of a resource that may be written; otherwise, or if it has no number, reason() says why there is no change
  Change(Context& context, const std::string& url);
  /// Puts the value back if that has not been done.
  ~Change() { put_back(); }
  Change(const Change&) = delete;
  Change& operator=(const Change&) = delete;

  /// PUT of another value. True: GET has another representation since.
  bool make();
  /// PUT of the first one. True: GET has another representation since.
  bool put_back();
  /// Why there is no change; empty: there was one, or nothing was tried.
  const std::string& reason() const noexcept { return reason_; }
  /// The last GET, without Accept.
  const Exchange& now() const noexcept { return now_; }
  /// The PUT that changed it.
  const Exchange& put() const noexcept { return put_; }

  /// Bodies with other values than `body`, most careful first: for tests of commands that must not be carried out, too.
  static std::vector<std::string> other_values(const std::string& body, const std::string& media_type, const std::string& url);
  /// PUT with the fields of a command.
  static Exchange write(Context& context, const std::string& url, const std::string& body, const std::string& media_type, FieldList fields = {});

 private:
  bool write(const std::string& body);

  Context& context_;
  const std::string url_;
  Exchange first_, now_, put_;
  std::string reason_;
  bool is_changed_ = false;
};

/// A message of a subscription.
struct Message {
  std::string body, media_type;  ///< `media_type` is empty where the protocol does not tell it
  Exchange shown;                ///< as evidence
};

/// What the messages of a subscription say about changes.
struct Observation {
  std::string not_testable;       ///< there was no change that could be followed: why
  std::string missing;            ///< a change had no message
  std::string wrong;              ///< the message after a change has not its content
  std::string seen;               ///< what was seen, if all is right
  std::optional<Exchange> proof;  ///< the exchange or the message that shows it
};

/// Looks for changes and for a message after each: two changes by PUT where the user permits it, otherwise those that happen by themselves.
/// @param type  that was requested for the messages; empty: none
/// @param next  the next message; nullopt: none until then
Observation observe(Context& context, const std::string& url, const std::string& type,
                    const std::function<std::optional<Message>(exchange::Instant until)>& next);

/// Whether two representations say the same, in whatever syntaxes of RDF.
bool same_content(const std::string& a, const std::string& b, const std::string& type, const std::string& base);

}  // namespace lrt::check
