#include "src/engine/saved_subscriptions.hpp"

#include <algorithm>
#include <utility>

#include <lrt/base/media_type.hpp>
#include <lrt/rdf/lexical.hpp>

#include "src/engine/description.hpp"
#include "src/engine/resources/thing.hpp"

namespace lrt::engine {

std::optional<std::string> SavedSubscriptions::take() {
  const bool changed = std::exchange(pending_changed_, false);
  if (std::exchange(taken_revision_, subscriptions_.callbacks_revision()) == subscriptions_.callbacks_revision() && !changed) return std::nullopt;
  rdf::Graph graph;
  const auto save = [&](const std::string& base, const std::string& path, std::string_view kind, const std::string& id,
                        Utc made, const std::string& url, const std::string& secret, std::string_view type,
                        const subscription::Policy& policy) {
    About about(graph, graph.fresh_blank());
    about.a(vocab::hybrit::WebCallback)
        .add(vocab::dcterms::identifier, rdf::literal(id))
        .link(vocab::dcterms::isPartOf, base + "/")
        .link(vocab::hybrit::onResource, base + path)
        .add(vocab::hybrit::callbackURL, rdf::literal(url, vocab::xsd::anyURI))
        .add(vocab::hybrit::mediaType, rdf::literal(type))
        .when(vocab::dcterms::created, made)
        .add(vocab::lrt_::queueLength, rdf::literal(std::to_string(policy.queue_length), vocab::xsd::integer))
        .add(vocab::lrt_::minimumInterval,
             rdf::literal(rdf::lexical::format(std::chrono::duration<double>(policy.minimum_interval).count()), vocab::xsd::double_));
    if (!kind.empty()) about.link(vocab::dcterms::type, std::string(kind));
    if (!secret.empty()) about.add(vocab::lrt_::secret, rdf::literal(secret));
  };
  for (const auto& [path, thing] : registry_.things())
    for (const auto& s : thing->subscriptions.subscriptions)
      if (s->protocol == Protocol::callback && !s->observed.saved_type().empty())
        save(bases_[s->base], s->observed.path_aside(0), s->observed.saved_type().text, s->subscription_id, s->created, s->url,
             s->secret, s->observed.variants().type_of(s->its_variant), s->backlog.policy());
  for (const PendingRestore& p : pending_)
    save(p.base, p.path, p.type, p.id, p.created, p.request.url, p.request.secret, p.media_type, p.request.policy);
  Result<std::string> text = rdf::write(graph, rdf::Syntax::turtle, options_.prefixes);
  if (text) return *std::move(text);
  responses_.log(LogLevel::error, "the subscriptions cannot be saved: " + text.error().message);
  return std::nullopt;
}

void SavedSubscriptions::log(const std::string& id, const std::string& what) const {
  std::string line = "the saved subscription \"" + id + "\" " + what;
  for (char& c : line)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) c = '?';  // the file's bytes are not to be trusted
  responses_.log(LogLevel::warning, line);
}

/// @par Errors  refused: why it is left out
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
  const Result<std::string> id = model::encode_path(read.id);
  if (!id || *id != read.id || read.id.find('/') != std::string::npos) return unexpected(Errc::refused, "its identifier is not a path segment");
  const bool base_fits = read.base.size() > 1 && read.base.back() == '/' && observed.size() > read.base.size() &&
                         observed.compare(0, read.base.size(), read.base) == 0;
  if (!base_fits) return unexpected(Errc::refused, "its resource <" + observed + "> is not below its base <" + read.base + ">");
  read.path = observed.substr(read.base.size() - 1);
  read.base.pop_back();
  read.media_type = text(vocab::hybrit::mediaType);
  const auto interval = interval_of(text(vocab::lrt_::minimumInterval));
  const auto length = rdf::lexical::parse_uint64(text(vocab::lrt_::queueLength));
  if (!MediaType::parse(read.media_type) || !interval || !length || *length > options_.subscriptions.max_queue_length || read.request.secret.size() > max_secret)
    return unexpected(Errc::refused, "its media type, interval, queue length or secret is not possible");
  read.request.policy.minimum_interval = *interval;
  read.request.policy.queue_length = static_cast<std::size_t>(*length);
  if (const auto made = rdf::lexical::parse_instant(text(vocab::dcterms::created)))
    read.created = Utc(std::chrono::duration_cast<Utc::duration>(*made));
  const Result<subscription::CallbackUrl> url = subscription::parse_callback_url(read.request.url);
  if (!url) return unexpected(Errc::refused, url.error().message);
  read.refused = !subscriptions_.may_call(*url);
  if (read.refused) log(read.id, "waits: this server may not call " + url->authority + " now");
  const auto has_its_id = [&](const PendingRestore& other) { return other.id == read.id; };
  if (std::any_of(pending_.begin(), pending_.end(), has_its_id) ||
      subscriptions_.callback_count() + pending_.size() >= options_.callbacks.max_callbacks)
    return unexpected(Errc::refused, "there is another of that identifier, or there are too many");
  return read;
}

Result<void> SavedSubscriptions::restore(std::string_view saved) {
  rdf::ReadOptions read_options;
  read_options.base = placeholder_base;
  read_options.max_triples = 100'000;
  const Result<rdf::Graph> graph = rdf::read(saved, rdf::Syntax::turtle, read_options);
  if (!graph) return Unexpected{graph.error()};
  const auto type = graph->find(vocab::rdf_::type), callback = graph->find(vocab::hybrit::WebCallback);
  if (!type || !callback) return {};
  for (const rdf::Triple& t : graph->match(std::nullopt, *type, *callback)) {
    Result<PendingRestore> one = read(*graph, t.subject);
    if (one) {
      pending_.push_back(*std::move(one));
      continue;
    }
    const auto p = graph->find(vocab::dcterms::identifier);
    const auto id = p ? graph->object(t.subject, *p) : std::nullopt;
    log(id ? std::string(graph->term(*id).text) : std::string(), "is left out: " + one.error().message);
    pending_changed_ = true;
  }
  resume();
  return {};
}

void SavedSubscriptions::resume() {
  for (std::size_t i = 0; i < pending_.size();) {
    const PendingRestore& p = pending_[i];
    Resource* observed =
        p.type.empty() ? registry_.find(p.path) : registry_.find_usual(p.path, p.type);  // older files have no types
    const bool fits = observed && observed->thing && !observed->saved_type().empty() && !pending_[i].refused &&
                      !registry_.find(observed->thing->subscriptions.path + "/" + pending_[i].id);
    const auto variant = fits ? observed->variants().find(pending_[i].media_type) : std::nullopt;
    if (!variant) {
      if (fits && !std::exchange(pending_[i].missing_type_logged, true))
        log(pending_[i].id, "waits: there is no " + pending_[i].media_type + " of \"" + observed->path + "\" now");
      ++i;
      continue;
    }
    PendingRestore now = std::move(pending_[i]);
    pending_.erase(pending_.begin() + static_cast<std::ptrdiff_t>(i));
    const std::size_t base = bases_.intern(std::move(now.base), false);
    now.request.observed = observed;
    now.request.variant = *variant;
    subscriptions_.make(std::move(now.request), base, std::move(now.id), now.created);
  }
}

}  // namespace lrt::engine
