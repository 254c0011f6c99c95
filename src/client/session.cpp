// SPDX-License-Identifier: Apache-2.0
#include "src/client/session.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include <lrt/rdf/vocab.hpp>

namespace lrt::client {
inline namespace v0 {

using rdf::Graph;
using rdf::TermId;
using rdf::TermView;
using rdf::Triple;

// --- RepresentationCache ---

RepresentationCache::Found RepresentationCache::find(const std::string& url) {
  const auto found = by_url_.find(url);
  if (found == by_url_.end()) return {};
  entries_.splice(entries_.begin(), entries_, found->second);
  return {found->second->representation, found->second->since};
}

void RepresentationCache::touch(const std::string& url) {
  if (const auto found = by_url_.find(url); found != by_url_.end()) found->second->since = std::chrono::steady_clock::now();
}

void RepresentationCache::put(const std::string& url, RepresentationPtr representation, std::size_t bytes) {
  remove(url);
  if (bytes > max_bytes_) return;
  entries_.push_front({url, std::move(representation), bytes, std::chrono::steady_clock::now()});
  by_url_[url] = entries_.begin();
  bytes_ += bytes;
  while (bytes_ > max_bytes_) {
    const std::string last = entries_.back().url;
    remove(last);
  }
}

void RepresentationCache::remove(const std::string& url) {
  const auto found = by_url_.find(url);
  if (found == by_url_.end()) return;
  bytes_ -= found->second->bytes;
  entries_.erase(found->second);
  by_url_.erase(found);
}

// --- Workers ---

bool Workers::post(UniqueFunction<UniqueFunction<void()>()> work) {
  if (waiting_.fetch_add(1) >= max_waiting) return --waiting_, false;
  const bool runs = tasks_.run([this, work = std::move(work)]() mutable {
    --waiting_;
    UniqueFunction<void()> done = work();
    work = {};
    if (in_background_) done();
    else call_in_poll(std::move(done));
  });
  if (!runs) --waiting_;
  return runs;
}

void Workers::call_in_poll(UniqueFunction<void()> callback) {
  {
    const std::lock_guard lock(mutex_);
    if (stopped_) return;
    callbacks_.push_back(std::move(callback));
  }
  waker_.wake();
}

bool Workers::run_one() noexcept {
  try {
    UniqueFunction<void()> callback;
    {
      const std::lock_guard lock(mutex_);
      if (callbacks_.empty()) return false;
      callback = std::move(callbacks_.front());
      callbacks_.pop_front();
    }
    callback();
  } catch (...) {}  // user code: its error cannot be reported
  return true;
}

void Workers::stop() noexcept {
  tasks_.stop();
  std::deque<UniqueFunction<void()>> callbacks;
  const std::lock_guard lock(mutex_);
  stopped_ = true;
  callbacks.swap(callbacks_);
}

// --- Session ---

Session::Session(std::shared_ptr<HttpClient> http, const Options& options)
    : options_(options),
      http_(std::move(http)),
      cache_(options.limits.max_cached_bytes),
      workers_(options.threads, options.callbacks == Callbacks::in_background),
      watches_(http_,
               [this] {
                 Watches::Hooks hooks;
                 hooks.wake = [this] { workers_.waker().wake(); };
                 return hooks;
               }()),
      structures_(*this, options_) {}

Session::~Session() = default;

void Session::stop() noexcept {
  watches_.stop();  // may still delete callbacks on servers
  http_->stop();
  workers_.stop();
}

Error error_of(const Response& response, const std::string& method, const std::string& url) {
  Errc code = Errc::failed;
  switch (response.status) {
    case 400:
    case 415:
    case 422: code = Errc::expected_value; break;
    case 401:
    case 403:
    case 405:
    case 409:
    case 412: code = Errc::refused; break;
    case 404:
    case 410: code = Errc::unknown_path; break;
    case 406: code = Errc::unsupported_syntax; break;
    case 413:
    case 429:
    case 503: code = Errc::limit_exceeded; break;
    case 502:
    case 504:  // of a gateway, which does not know
      if (method != "GET" && method != "HEAD") code = Errc::unconfirmed;
      break;
    default: break;
  }
  return {code, method + " " + url + ": " + std::to_string(response.status) + ": " + response.reason()};
}

Result<RepresentationPtr> Session::get(const std::string& given, const std::string& known_tag) {
  const std::string url(document_of(given));
  RepresentationPtr known;
  {
    const std::lock_guard lock(mutex_);
    known = cache_.find(url).representation;
  }
  Request request{"GET", url, {{"Accept", accept()}}, {}};
  const std::string& entity_tag = known ? known->entity_tag : known_tag;
  if (!entity_tag.empty()) request.fields.emplace_back("If-None-Match", entity_tag);
  if (accepts_gzip_) request.fields.emplace_back("Accept-Encoding", "gzip");
  Result<Response> response = http_->send(request);
  if (response && response->status == 406) {  // a server without RDF
    request.fields.front().second = "application/json, text/plain;q=0.9";
    response = http_->send(request);
  }
  if (!response) return unexpected(response.error());
  if (response->status == 304 && !entity_tag.empty()) {
    const std::lock_guard lock(mutex_);
    if (known) cache_.touch(url);
    return known;
  }
  if (!response->ok()) return unexpected(error_of(*response, "GET", url));
  Result<RepresentationPtr> read = read_representation(*response, options_);
  if (!read) return read;
  // A graph takes a few times the memory of its text.
  const std::lock_guard lock(mutex_);
  cache_.put(url, *read, 4 * response->body.size() + 1'000);
  return read;
}

Result<RepresentationPtr> Session::outline(const std::string& given) {
  const Result<Response> response = http_->send({"HEAD", std::string(document_of(given)), {}, {}});
  if (!response) return unexpected(response.error());
  if (!response->ok()) return unexpected(error_of(*response, "HEAD", given));
  return outline_of(*response);
}

Result<RepresentationPtr> Session::described(const std::string& given) {
  constexpr std::chrono::minutes longest{1};
  {
    const std::lock_guard lock(mutex_);
    const RepresentationCache::Found known = cache_.find(std::string(document_of(given)));
    if (known.representation && std::chrono::steady_clock::now() - known.since < longest) return known.representation;
  }
  return get(given);
}

void Session::forget(const std::string& url) {
  const std::lock_guard lock(mutex_);
  cache_.remove(std::string(document_of(url)));
}

Result<Response> Session::change(const Request& request) {
  Result<Response> response = http_->send(request);
  forget(request.url);
  if (response && response->status >= 300) return unexpected(error_of(*response, request.method, request.url));
  return response;
}

namespace {

/// What a shape of a document needs of it: what is reachable from its node, and what is said of classes and constraint components, which shapes use
/// without a link. Blank nodes keep their labels. A small document is taken whole.
Graph part_of(const Graph& document, const TermView& node) {
  constexpr std::size_t max_whole = 2'000;
  if (document.size() <= max_whole) return document;
  Graph part;
  std::vector<TermId> open;
  std::vector<bool> seen(document.term_count());
  const auto reach = [&](TermId id) {
    if (seen[static_cast<std::size_t>(id)] || document.term(id).is_literal()) return;
    seen[static_cast<std::size_t>(id)] = true;
    open.push_back(id);
  };
  const auto add = [&](const Triple& t) { part.add(document.term(t.subject), document.term(t.predicate), document.term(t.object)); };
  if (const auto id = document.find(node)) reach(*id);
  const auto type = document.find(vocab::rdf_::type), component = document.find(Iri("http://www.w3.org/ns/shacl#ConstraintComponent"));
  if (type && component)
    for (const Triple& t : document.match(std::nullopt, *type, *component)) reach(t.subject);
  while (!open.empty()) {
    const TermId subject = open.back();
    open.pop_back();
    for (const Triple& t : document.match(subject, std::nullopt, std::nullopt)) {
      add(t);
      reach(t.object);
    }
  }
  if (const auto sub_class = document.find(vocab::rdfs::subClassOf))
    for (const Triple& t : document.match(std::nullopt, *sub_class, std::nullopt)) add(t);
  return part;
}

}  // namespace

Result<Shape> Session::shape(const TermView& node, const Representation& known) {
  constexpr std::size_t max_documents = 16;
  Shape shape;
  shape.graph = part_of(known.graph, node);  // blank nodes keep their labels: `node` may be one
  shape.node = rdf::Term(node);
  std::set<std::string> documents{std::string(document_of(known.url))}, read;  // `read`: nodes
  const auto is_described = [&](const TermView& term) {
    const std::optional<TermId> id = shape.graph.find(term);
    return id && !shape.graph.match(*id, std::nullopt, std::nullopt).empty();
  };
  // Shapes that are referred to by IRI, beginning with the shape itself.
  std::vector<std::string> wanted;
  const auto want = [&](const TermView& term) {
    if (term.is_iri() && !is_described(term) && document_of(term.text) != document_of(known.url)) wanted.emplace_back(term.text);
  };
  want(node);
  for (std::size_t looked_at = 0;;) {
    const auto& triples = shape.graph.triples();
    for (; looked_at < triples.size(); ++looked_at) {
      const TermView predicate = shape.graph.term(triples[looked_at].predicate);
      for (const Iri refers : {vocab::sh::node, vocab::sh::property, vocab::sh::not_, vocab::sh::qualifiedValueShape})
        if (predicate.text == refers.text) want(shape.graph.term(triples[looked_at].object));
    }
    if (wanted.empty()) break;
    const std::string iri = std::move(wanted.back());
    wanted.pop_back();
    if (is_described(rdf::iri(iri)) || !read.insert(iri).second) continue;
    const std::string url(document_of(iri));
    documents.insert(url);
    if (documents.size() > max_documents) return unexpected(Errc::limit_exceeded, "a shape refers to more than 16 documents");
    if (!same_origin(url, known.url)) continue;  // a shape of another server is read from this document
    const Result<RepresentationPtr> found = described(url);
    if (!found) return unexpected(found.error());
    // Triples that are already present would be validated twice.
    const Graph part = part_of((*found)->graph, rdf::iri(iri));
    add_apart(shape.graph, part, [&](const TermView& subject) { return subject.is_iri() && is_described(subject); });
  }
  if (!is_described(shape.node.view())) {
    return unexpected(Errc::expected_value, "\"" + known.url + "\" refers to the shape " + rdf::to_string(node) + ", which has no description");
  }
  return shape;
}

}  // namespace v0
}  // namespace lrt::client
