// SPDX-License-Identifier: Apache-2.0
#include "src/engine/saved_subscriptions.hpp"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <iterator>
#include <utility>

#include <lrt/base/media_type.hpp>
#include <lrt/rdf/lexical.hpp>

#include "src/engine/description.hpp"
#include "src/engine/receivers/callback.hpp"
#include "src/engine/resources/thing.hpp"
#include "src/model/spec.hpp"

namespace lrt::engine {

namespace {

/// Terms of the file only.
constexpr Iri known_by_term("https://w3id.org/lrt/ns#knownBy"), valid_term("http://purl.org/dc/terms/valid");

/// By security::KnownBy.
constexpr std::string_view names_of_known_by[] = {"host", "token", "certificate", "function"};

/// A file of an earlier version does not say it: the callback waits unless there is a token of that name.
security::KnownBy known_by_of(std::string_view name) noexcept {
  const auto* const found = std::find(std::begin(names_of_known_by), std::end(names_of_known_by), name);
  return found == std::end(names_of_known_by) ? security::KnownBy::token : static_cast<security::KnownBy>(found - std::begin(names_of_known_by));
}

/// One subscription as it stands in the file.
struct Entry {
  const std::string &base, &path;
  std::string_view kind;
  const std::string& id;
  Utc created;
  std::string_view url, secret;
  std::string_view type;
  const subscription::Policy& policy;
  bool has_confirmed;
  const security::Principal* owner;
};

/// Turtle without the prefixes.
std::string text_of(const Entry& e, const rdf::Prefixes& prefixes) {
  rdf::Graph graph;
  About about(graph, graph.fresh_blank());
  about.a(vocab::hybrit::WebCallback)
      .add(vocab::dcterms::identifier, rdf::literal(e.id))
      .link(vocab::dcterms::isPartOf, e.base + "/")
      .link(vocab::hybrit::onResource, e.base + e.path)
      .add(vocab::hybrit::callbackURL, rdf::literal(e.url, vocab::xsd::anyURI))
      .add(vocab::hybrit::mediaType, rdf::literal(e.type))
      .when(vocab::dcterms::created, e.created)
      .add(vocab::lrt_::queueLength, rdf::literal(std::to_string(e.policy.queue_length), vocab::xsd::integer))
      .add(vocab::lrt_::minimumInterval,
           rdf::literal(rdf::lexical::format(std::chrono::duration<double>(e.policy.minimum_interval).count()), vocab::xsd::double_));
  if (!e.kind.empty()) about.link(vocab::dcterms::type, std::string(e.kind));
  if (!e.secret.empty()) about.add(vocab::lrt_::secret, rdf::literal(e.secret));
  if (e.has_confirmed) about.add(vocab::lrt_::confirmed, rdf::literal("true", vocab::xsd::boolean));
  if (e.owner) about.add(vocab::lrt_::owner, rdf::literal(e.owner->name));
  if (e.owner) about.add(known_by_term, rdf::literal(names_of_known_by[static_cast<std::size_t>(e.owner->known_by)]));
  if (e.owner && e.owner->expires) about.when(valid_term, std::chrono::time_point_cast<Utc::duration>(*e.owner->expires));
  if (e.owner)
    for (const std::string& role : e.owner->roles) about.add(vocab::lrt_::role, rdf::literal(role));
  std::string text = rdf::write(graph, rdf::Syntax::turtle, prefixes).value();
  while (text.compare(0, 7, "@prefix") == 0 || text.front() == '\n') text.erase(0, text.find('\n') + 1);
  return text;
}

std::string header_of(const rdf::Prefixes& prefixes) {
  std::string header;
  for (const auto& [name, iri] : prefixes) header += "@prefix " + name + ": <" + iri + "> .\n";
  return header;
}

/// The end of the first entry, or of the header, in a text that may be damaged: a line that ends so. Texts of entries have no line ends.
std::size_t end_of_first(std::string_view text) {
  const std::size_t found = text.find(" .\n");
  return found == std::string_view::npos ? text.size() : found + 3;
}

}  // namespace

std::optional<SavedText> SavedSubscriptions::take() {
  const std::uint64_t revision = saves_.revision();
  if (std::exchange(taken_revision_, revision) == revision) return std::nullopt;
  try {
    SavedText saved{header_of(options_.prefixes), revision};
    for (const auto& [path, thing] : registry_.things())
      for (const auto& s : thing->subscriptions.subscriptions) {
        CallbackReceiver* const callback = s->receiver->callback();
        if (!callback || callback->is_cancelling() || s->observed.saved_type().empty()) continue;
        if (callback->saved_text.empty())
          callback->saved_text = text_of({bases_[s->base], s->observed.path_aside(0), s->observed.saved_type().text, s->subscription_id, s->created,
                                          callback->url(), callback->secret(), s->observed.variants().type_of(s->its_variant), s->backlog.policy(),
                                          callback->has_confirmed(), s->audience.principal.get()},
                                         options_.prefixes);
        saved.text.append("\n").append(callback->saved_text);
      }
    for (const PendingRestore& p : pending_)
      saved.text.append("\n").append(text_of({p.base, p.path, p.type, p.id, p.created, p.request.url, p.request.secret, p.media_type,
                                              p.request.policy, p.request.has_confirmed, p.request.audience.principal.get()},
                                             options_.prefixes));
    return saved;
  } catch (const std::exception& e) {
    responses_.log(LogLevel::error, "the subscriptions cannot be saved", e);
    saves_.saved(revision, false, clock_.now());
    return std::nullopt;
  }
}

void SavedSubscriptions::log(const std::string& id, const std::string& what) const {
  std::string line = "the saved subscription \"" + id + "\" " + what;
  for (char& c : line)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) c = '?';  // the file's bytes are not to be trusted
  responses_.log(LogLevel::warning, line);
}

/// @par Errors  refused: the reason why it is skipped
Result<SavedSubscriptions::PendingRestore> SavedSubscriptions::read(const rdf::Graph& graph, rdf::TermId node) const {
  const auto text = [&](Iri predicate, bool iri = false) -> std::string {
    const auto p = graph.find(predicate);
    const auto found = p ? graph.object(node, *p) : std::nullopt;
    return found && graph.term(*found).is_iri() == iri ? std::string(graph.term(*found).text) : std::string();
  };
  PendingRestore read;
  read.id = text(vocab::dcterms::identifier);
  read.base = text(vocab::dcterms::isPartOf, true);
  const std::string observed = text(vocab::hybrit::onResource, true);
  read.type = text(vocab::dcterms::type, true);
  read.request.protocol = Protocol::callback;
  read.request.url = text(vocab::hybrit::callbackURL);
  read.request.secret = text(vocab::lrt_::secret);
  read.request.has_confirmed = text(vocab::lrt_::confirmed) == "true";  // absent in older files
  if (std::string owner = text(vocab::lrt_::owner); !owner.empty()) {
    security::Principal principal{std::move(owner), {}};
    principal.known_by = known_by_of(text(known_by_term));
    if (const auto end = rdf::lexical::parse_instant(text(valid_term)))
      principal.expires = std::chrono::system_clock::time_point(std::chrono::duration_cast<std::chrono::system_clock::duration>(*end));
    if (const auto role = graph.find(vocab::lrt_::role))
      for (const rdf::Triple& t : graph.match(node, *role, std::nullopt)) principal.roles.emplace_back(graph.term(t.object).text);
    read.request.audience.principal = std::make_shared<const security::Principal>(std::move(principal));
  }
  const Result<std::string> id = model::encode_path(read.id);
  if (!id || *id != read.id || read.id.find('/') != std::string::npos) return unexpected(Errc::refused, "its identifier is not a path segment");
  const bool base_fits =
      read.base.size() > 1 && read.base.back() == '/' && observed.size() > read.base.size() && observed.compare(0, read.base.size(), read.base) == 0;
  if (!base_fits) return unexpected(Errc::refused, "its resource <" + observed + "> is not below its base <" + read.base + ">");
  read.path = observed.substr(read.base.size() - 1);
  read.base.pop_back();
  read.media_type = text(vocab::hybrit::mediaType);
  const auto interval = interval_of(text(vocab::lrt_::minimumInterval));
  const auto length = rdf::lexical::parse_uint64(text(vocab::lrt_::queueLength));
  if (!MediaType::parse(read.media_type) || !interval || !length || *length > options_.subscriptions.max_queue_length ||
      read.request.secret.size() > max_secret)
    return unexpected(Errc::refused, "its media type, interval, queue length or secret is not valid");
  read.request.policy.minimum_interval = *interval;
  read.request.policy.queue_length = static_cast<std::size_t>(*length);
  if (const auto made = rdf::lexical::parse_instant(text(vocab::dcterms::created)))
    read.created = Utc(std::chrono::duration_cast<Utc::duration>(*made));
  const Result<subscription::CallbackUrl> url = subscription::parse_callback_url(read.request.url);
  if (!url) return unexpected(Errc::refused, url.error().message);
  read.refused = !rules_.may_call(*url);
  if (read.refused) log(read.id, "is not active: its receiver " + url->authority + " is not in the list of allowed receivers");
  const auto has_its_id = [&](const PendingRestore& other) { return other.id == read.id; };
  if (std::any_of(pending_.begin(), pending_.end(), has_its_id) ||
      subscriptions_.callback_count() + pending_.size() >= options_.callbacks.max_callbacks)
    return unexpected(Errc::refused, "its identifier is already in use, or the maximum number of subscriptions is reached");
  return read;
}

Result<std::size_t> SavedSubscriptions::restore(std::string_view saved) {
  Result<std::size_t> found = read_all(saved);
  if (found) resume();
  return found;
}

std::pair<std::size_t, std::size_t> SavedSubscriptions::recover(std::string_view damaged) {
  std::pair<std::size_t, std::size_t> found_and_lost;
  const std::string header = header_of(rdf::default_prefixes()) + header_of(options_.prefixes);
  while (!damaged.empty()) {
    const std::string_view first = damaged.substr(0, end_of_first(damaged));
    damaged.remove_prefix(first.size());
    const Result<std::size_t> found = read_all(header + std::string(first));
    if (found) found_and_lost.first += *found;
    else ++found_and_lost.second;
  }
  saves_.changed();
  resume();
  return found_and_lost;
}

Result<std::size_t> SavedSubscriptions::read_all(std::string_view saved) {
  rdf::ReadOptions read_options;
  read_options.base = placeholder_base;
  read_options.max_triples = std::max<std::size_t>(100'000, 20 * options_.callbacks.max_callbacks);
  const Result<rdf::Graph> graph = rdf::read(saved, rdf::Syntax::turtle, read_options);
  if (!graph) return Unexpected{graph.error()};
  const auto type = graph->find(vocab::rdf_::type), callback = graph->find(vocab::hybrit::WebCallback);
  if (!type || !callback) return std::size_t{0};
  std::size_t found = 0;
  for (const rdf::Triple& t : graph->match(std::nullopt, *type, *callback)) {
    ++found;
    Result<PendingRestore> one = read(*graph, t.subject);
    if (one) {
      pending_.push_back(*std::move(one));
      continue;
    }
    const auto p = graph->find(vocab::dcterms::identifier);
    const auto id = p ? graph->object(t.subject, *p) : std::nullopt;
    log(id ? std::string(graph->term(*id).text) : std::string(), "is left out: " + one.error().message);
    saves_.changed();
  }
  return found;
}

void SavedSubscriptions::sign_out(std::string_view principal) {
  const auto is_theirs = [&](const PendingRestore& p) {
    const auto& owner = p.request.audience.principal;
    return owner && owner->name == principal;
  };
  const auto theirs = std::remove_if(pending_.begin(), pending_.end(), is_theirs);
  if (theirs == pending_.end()) return;
  pending_.erase(theirs, pending_.end());
  saves_.changed();
}

void SavedSubscriptions::resume() {
  for (std::size_t i = 0; i < pending_.size();) {
    const PendingRestore& p = pending_[i];
    Resource* observed = p.type.empty() ? registry_.find(p.path) : registry_.find_usual(p.path, p.type);  // older files have no types
    const bool fits = observed && observed->thing && !observed->saved_type().empty() && !pending_[i].refused &&
                      !registry_.find(observed->thing->subscriptions.path + "/" + pending_[i].id);
    const auto variant = fits ? observed->variants().find(pending_[i].media_type) : std::nullopt;
    std::optional<Audience> audience = variant ? renewed(options_, p.request.audience, *observed) : std::nullopt;
    if (!audience) {
      if (fits && !variant && !std::exchange(pending_[i].missing_type_logged, true))
        log(pending_[i].id, "is not active: \"" + observed->path + "\" has no representation in " + pending_[i].media_type + " now");
      ++i;
      continue;
    }
    PendingRestore now = std::move(pending_[i]);
    pending_.erase(pending_.begin() + static_cast<std::ptrdiff_t>(i));
    const std::size_t base = bases_.restore(std::move(now.base));
    now.request.observed = observed;
    now.request.audience = *std::move(audience);
    now.request.variant = *variant;
    now.request.restored = true;
    subscriptions_.make(std::move(now.request), base, std::move(now.id), now.created);
  }
}

}  // namespace lrt::engine
