#pragma once

#include <memory>
#include <string>

#include <lrt/http/message.hpp>
#include <lrt/subscription/channel.hpp>

namespace lrt::subscription {

/// A web callback that has something to post.
struct Due {
  Channel channel;
  std::string receiver;  ///< scheme, host and port of its URL
};

/// A notification to be posted to a web callback.
struct Notice {
  std::string url;                          ///< passed parse_callback_url() and AllowedHosts::names()
  http::Fields fields;                      ///< Content-Type, ETag, Link (SPEC 3.6)
  std::shared_ptr<const std::string> body;
  std::string secret;                       ///< signs the body; empty: unsigned
  bool failed_before = false;               ///< the last attempt to reach this subscriber failed
};

/// What became of it.
struct Receipt {
  int status = 0;        ///< of the receiver's answer; 0: there was none
  std::string error{};   ///< why there was none, a sentence
  bool refused = false;  ///< the host's addresses are not allowed: there is no point in trying again
};

}  // namespace lrt::subscription
