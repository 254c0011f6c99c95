// SPDX-License-Identifier: Apache-2.0
#include <lrt/check.hpp>

#include <algorithm>

#include "src/check/survey.hpp"
#include "src/exchange/no_sigpipe.hpp"

namespace lrt::check {
inline namespace v0 {

std::string_view to_string(Outcome outcome) noexcept {
  switch (outcome) {
    case Outcome::pass: return "pass";
    case Outcome::fail: return "fail";
    case Outcome::not_applicable: return "not applicable";
    case Outcome::not_testable: break;
  }
  return "not testable";
}

std::string_view to_string(Level level) noexcept { return level == Level::must ? "must" : level == Level::should ? "should" : "may"; }

std::string_view to_string(Certainty certainty) noexcept { return certainty == Certainty::certain ? "certain" : "likely"; }

const Finding* Report::find(std::string_view id) const noexcept {
  const auto found = std::find_if(findings.begin(), findings.end(), [id](const Finding& f) { return f.id == id; });
  return found == findings.end() ? nullptr : &*found;
}

Result<Report> run(const std::string& url, const CheckOptions& options) {
  const Result<http::Url> parts = url_of(url);
  if (!parts) return unexpected(parts.error().code, "\"" + url + "\": " + parts.error().message);
  std::vector<std::string> named = options.write;
  for (const Invocation& invocation : options.invoke) named.push_back(invocation.url);
  if (!options.root.empty()) named.push_back(options.root);
  for (const std::string& other : named) {
    const Result<http::Url> more = url_of(other);
    if (!more) return unexpected(more.error().code, "\"" + other + "\": " + more.error().message);
    if (more->origin() != parts->origin())
      return unexpected(Errc::invalid_option, "\"" + other + "\" is not on the checked server, " + parts->origin());
  }
  Result<std::shared_ptr<client::HttpClient>> http = client::HttpClient::create(options.client);
  if (!http) return unexpected(std::move(http).error());
  (*http)->trust(*parts);
  const exchange::NoSigpipe guard(true);

  Report report;
  report.started = std::chrono::system_clock::now();
  Probe probe(**http, options);
  Verdicts verdicts;
  Context context{options, probe, verdicts, without_fragment(url)};
  if (Result<void> visited = survey(context); !visited) return unexpected(std::move(visited).error());
  check_caching(context);
  check_resources(context);
  check_linked_data(context);
  check_subscriptions(context);
  check_writes(context);
  check_extensions(context);
  check_merging(context);
  check_http(context);  // last but for what is of all responses
  check_ended_subscriptions(context);
  check_moments(context);

  const std::string limit = probe.limit_reached();
  if (!limit.empty()) context.notes.push_back(limit);
  report.url = context.url;
  report.product = excerpt(context.resources.front().get.reply.field("Server"), 100);
  report.findings = verdicts.findings(!limit.empty() ? limit : options.subscribe ? "nothing shows it" : "subscriptions are switched off");
  report.requirements = summarise(report.findings);
  for (const Resource& resource : context.resources) report.resources.push_back(resource.url);
  report.requests = probe.requests();
  report.notes = std::move(context.notes);
  const auto fulfilled = [&](std::string_view layer) {
    return std::none_of(report.requirements.begin(), report.requirements.end(),
                        [layer](const Requirement& r) { return r.id.compare(0, 2, layer) == 0 && r.outcome == Outcome::fail && !r.advice; });
  };
  report.is_robotic_thing = fulfilled("R0");
  report.is_linked_robotic_thing = fulfilled("R1");
  return report;
}

int exit_status(const Result<Report>& report, bool strict) noexcept {
  if (!report) return 2;
  const bool failed = std::any_of(report->findings.begin(), report->findings.end(), [strict](const Finding& f) {
    return f.outcome == Outcome::fail && (f.level == Level::must || (strict && f.level == Level::should));
  });
  return failed ? 1 : 0;
}

}  // namespace v0
}  // namespace lrt::check
