#include <algorithm>

#include <lrt/base/media_type.hpp>
#include <lrt/rdf/lexical.hpp>

#include "src/engine/about.hpp"
#include "src/engine/impl.hpp"

namespace lrt::engine {

// Callback subscriptions in a file: one blank node each, with the terms by which they are made, and the base of the request that made
// them (SPEC 3.7). Observers of invocations are not saved: no invocation survives.

std::optional<std::string> Engine::Impl::take_saved() {
  if (!std::exchange(callbacks_changed_, false)) return std::nullopt;
  rdf::Graph graph;
  const auto save = [&](const std::string& base, const std::string& path, const std::string& id, Utc made, const std::string& url,
                        const std::string& secret, std::string_view type, const subscription::Policy& policy) {
    About about(graph, graph.fresh_blank());
    about.a(vocab::hybrit::WebCallback)
        .add(vocab::dcterms::identifier, rdf::literal(id))
        .link(vocab::dcterms::isPartOf, base + "/")
        .link(vocab::hybrit::onResource, base + path)
        .add(vocab::hybrit::callbackURL, rdf::literal(url, vocab::xsd::anyURI))
        .add(vocab::hybrit::mediaType, rdf::literal(type))
        .when(vocab::dcterms::created, made)
        .add(vocab::lrt::queueLength, rdf::literal(std::to_string(policy.queue_length), vocab::xsd::integer))
        .add(vocab::lrt::minimumInterval,
             rdf::literal(rdf::lexical::format(std::chrono::duration<double>(policy.minimum_interval).count()), vocab::xsd::double_));
    if (!secret.empty()) about.add(vocab::lrt::secret, rdf::literal(secret));
  };
  for (const auto& [path, thing] : things_)
    for (const auto& s : thing->members)
      if (s->protocol == Protocol::callback && s->observed.kind != Kind::invocation)
        save(bases_[s->base], s->observed.path, s->id, s->created, s->url, s->secret, offers_of(s->observed).type_of(s->form), s->backlog.policy());
  for (const Parked& p : parked_) save(p.base, p.path, p.id, p.created, p.wish.url, p.wish.secret, p.media_type, p.wish.policy);
  Result<std::string> text = rdf::write(graph, rdf::Syntax::turtle, options_.prefixes);
  if (!text) {
    log(LogLevel::error, "the subscriptions cannot be saved: " + text.error().message);
    return std::nullopt;
  }
  return *std::move(text);
}

Result<void> Engine::Impl::restore(std::string_view saved) {
  rdf::ReadOptions read_options;
  read_options.base = placeholder_base;
  read_options.max_triples = 100'000;
  const Result<rdf::Graph> graph = rdf::read(saved, rdf::Syntax::turtle, read_options);
  if (!graph) return Unexpected{graph.error()};
  const auto type = graph->find(vocab::rdf::type), callback = graph->find(vocab::hybrit::WebCallback);
  if (!type || !callback) return {};
  for (const rdf::Triple& t : graph->match(std::nullopt, *type, *callback)) {
    const auto text = [&](Iri predicate, bool iri = false) -> std::string {
      const auto p = graph->find(predicate);
      const auto found = p ? graph->object(t.subject, *p) : std::nullopt;
      return found && graph->term(*found).is_iri() == iri ? std::string(graph->term(*found).text) : std::string();
    };
    Parked parked;
    parked.id = text(vocab::dcterms::identifier);
    parked.base = text(vocab::dcterms::isPartOf, true);
    const std::string observed = text(vocab::hybrit::onResource, true);
    parked.wish.url = text(vocab::hybrit::callbackURL);
    parked.wish.secret = text(vocab::lrt::secret);
    const auto say = [&](const std::string& what) {
      std::string line = "the saved subscription \"" + parked.id + "\" " + what;
      for (char& c : line)
        if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) c = '?';  // the file may be anybody's
      log(LogLevel::warning, line);
    };
    const auto leave_out = [&](const std::string& why) {
      say("is left out: " + why);
      callbacks_changed_ = true;
    };
    const Result<std::string> id = model::encode_path(parked.id);
    if (!id || *id != parked.id || parked.id.find('/') != std::string::npos) {
      leave_out("its identifier is none");
      continue;
    }
    const bool base_fits = parked.base.size() > 1 && parked.base.back() == '/' && observed.size() > parked.base.size() &&
                           observed.compare(0, parked.base.size(), parked.base) == 0;
    if (!base_fits) {
      leave_out("its resource <" + observed + "> is not below its base <" + parked.base + ">");
      continue;
    }
    parked.path = observed.substr(parked.base.size() - 1);
    parked.base.pop_back();
    parked.media_type = text(vocab::hybrit::mediaType);
    const bool is_type = static_cast<bool>(MediaType::parse(parked.media_type));
    const auto interval = interval_of(text(vocab::lrt::minimumInterval));
    const auto length = rdf::lexical::parse_uint64(text(vocab::lrt::queueLength));
    if (!is_type || !interval || !length || *length > options_.subscriptions.max_queue_length || parked.wish.secret.size() > longest_secret) {
      leave_out("its media type, interval, queue length or secret is not possible");
      continue;
    }
    parked.wish.policy.minimum_interval = *interval;
    parked.wish.policy.queue_length = static_cast<std::size_t>(*length);
    if (const auto made = rdf::lexical::parse_instant(text(vocab::dcterms::created)))
      parked.created = Utc(std::chrono::duration_cast<Utc::duration>(*made));
    const Result<subscription::CallbackUrl> url = subscription::parse_callback_url(parked.wish.url);
    if (!url) {
      leave_out(url.error().message);
      continue;
    }
    if (!allowed_ || !allowed_->names(url->host, url->port) || is_this_server(*url)) {
      say("waits: this server may not call " + url->authority + " now");
      parked.refused = true;
    }
    const auto twin = [&](const auto& other) { return other.id == parked.id; };
    if (std::any_of(parked_.begin(), parked_.end(), twin) || callbacks_ + parked_.size() >= options_.subscriptions.callbacks.max_callbacks) {
      leave_out("there is another of that identifier, or there are too many");
      continue;
    }
    parked_.push_back(std::move(parked));
  }
  adopt_parked();
  return {};
}

/// Brings those to life whose resource is there now.
void Engine::Impl::adopt_parked() {
  for (std::size_t i = 0; i < parked_.size();) {
    Resource* observed = find(parked_[i].path);
    const bool fits = observed && observed->thing && (observed->kind == Kind::thing || observed->kind == Kind::state ||
                                                      observed->kind == Kind::property || observed->kind == Kind::action);
    if (!fits || parked_[i].refused || find(observed->thing->subscriptions.path + "/" + parked_[i].id)) {
      ++i;
      continue;
    }
    const auto form = offers_of(*observed).form_of(parked_[i].media_type);
    if (!form) {
      if (!std::exchange(parked_[i].told, true))
        log(LogLevel::warning, "the saved subscription \"" + parked_[i].id + "\" waits: there is no " + parked_[i].media_type + " of \"" + observed->path + "\" now");
      ++i;
      continue;
    }
    Parked parked = std::move(parked_[i]);
    parked_.erase(parked_.begin() + static_cast<std::ptrdiff_t>(i));
    const std::size_t base = intern_base(std::move(parked.base), false);
    parked.wish.observed = observed;
    parked.wish.form = *form;
    make_subscription(std::move(parked.wish), Protocol::callback, base, std::move(parked.id), parked.created);
  }
}

}  // namespace lrt::engine
