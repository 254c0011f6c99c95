// SPDX-License-Identifier: Apache-2.0
#include "src/check/catalogue.hpp"

#include <algorithm>
#include <cassert>

namespace lrt::check {
namespace {

constexpr std::size_t max_evidence = 2;
constexpr std::size_t max_detail = 600;  // bytes

constexpr Level must = Level::must, should = Level::should, may = Level::may;

std::vector<std::string> words(std::string_view text) {
  std::vector<std::string> found;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(' '), text.size());
    found.emplace_back(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return found;
}

constexpr Check checks[] = {
    // ---- R0.1: HTTP/1.1
    {"http.version", "R0.1", must, "responses are HTTP/1.1", "A server states the highest minor version of HTTP/1 that it conforms to.",
     "RFC 9110 6.2, RFC 9112 2.3"},
    {"http.date", "R0.1", must, "responses have a Date", "A server with a clock sends Date in responses of the classes 2xx, 3xx and 4xx.",
     "RFC 9110 6.6.1"},
    {"http.framing", "R0.1", must, "the length of a body is what the header section says",
     "A body ends where Content-Length or the chunked coding says; both are never there together.", "RFC 9112 6.2, 6.3, 7.1"},
    {"http.head", "R0.1", must, "HEAD has no body and the status of GET",
     "HEAD is supported by all servers; its response is that of GET without content.", "RFC 9110 9.1, 9.3.2"},
    {"http.bodiless", "R0.1", must, "204 and 304 have no body", "A 204 or 304 ends with its header section; a 204 has no Content-Length.",
     "RFC 9110 8.6, 15.3.5, 15.4.5"},
    {"http.close", "R0.1", must, "`Connection: close` closes the connection",
     "A server that receives the close option closes the connection after the response.", "RFC 9112 9.6"},
    {"http.persistent", "R0.1", should, "a connection serves several requests", "Connections persist in HTTP/1.1 unless one side says close.",
     "RFC 9112 9.3"},
    {"http.pipelining", "R0.1", must, "pipelined requests are answered in order", "Responses come in the order of the requests on a connection.",
     "RFC 9112 9.3.2"},
    {"http.chunked-request", "R0.1", must, "a chunked request body is read",
     "A recipient decodes the chunked coding; what follows the body is the next request.", "RFC 9112 7.1"},
    {"http.expect", "R0.1", must, "`Expect: 100-continue` is answered before the body comes",
     "A server sends 100 or a final status, and does not wait for the body in silence.", "RFC 9110 10.1.1"},
    {"http.version-1.0", "R0.1", must, "a request in HTTP/1.0 is served and its connection closed",
     "A client of HTTP/1.0 gets no transfer coding, and the connection ends unless it was asked to stay.", "RFC 9112 6.1, 9.3"},
    {"http.host-missing", "R0.1", must, "a request without Host is refused", "A request in HTTP/1.1 without Host gets 400.", "RFC 9112 3.2"},
    {"http.host-repeated", "R0.1", must, "a request with two Host fields is refused", "A request with more than one Host gets 400.", "RFC 9112 3.2"},
    {"http.host-invalid", "R0.1", must, "a request with an invalid Host is refused", "A request whose Host has an invalid value gets 400.",
     "RFC 9112 3.2"},
    {"http.two-lengths", "R0.1", must, "a request with two lengths is refused",
     "Different Content-Length fields make the framing invalid: 400 and close.", "RFC 9112 6.3"},
    {"http.invalid-length", "R0.1", must, "a request with an invalid length is refused",
     "A Content-Length that is no number makes the framing invalid: 400 and close.", "RFC 9112 6.3"},
    {"http.length-and-chunked", "R0.1", must, "a request with a length and chunks cannot hide another one",
     "It is refused, or read by its chunks, and the connection is closed after the response.", "RFC 9112 6.1, 6.3"},
    {"http.chunked-not-last", "R0.1", must, "a request whose last transfer coding is not chunked is refused",
     "Its length cannot be found: 400 and close.", "RFC 9112 6.3"},
    {"http.invalid-chunk", "R0.1", must, "an invalid chunk size ends the connection", "What follows an invalid chunk size is not read as a request.",
     "RFC 9112 7.1, 11.2"},
    {"http.unknown-coding", "R0.1", should, "an unknown transfer coding is refused",
     "A transfer coding that the server does not understand gets 501.", "RFC 9112 6.1"},
    {"http.space-before-colon", "R0.1", must, "white space before the colon of a field is refused",
     "White space between the name of a field and its colon gets 400.", "RFC 9112 5.1"},
    {"http.request-line", "R0.1", should, "an invalid request line is refused", "An invalid request line gets 400.", "RFC 9112 3"},
    {"http.unknown-method", "R0.1", should, "an unknown method is refused", "A method that is not recognised gets 501, one that is not allowed 405.",
     "RFC 9110 9.1"},
    {"http.long-target", "R0.1", should, "a very long target is answered",
     "A target that is longer than the server wants to parse gets 414; others work.", "RFC 9112 3, RFC 9110 15.5.15"},
    {"http.alive", "R0.1", must, "the server serves after all of this", "Requests that were refused leave the server as it was.", "RFC 9110 2.2"},
    {"http.slow", "R0.1", may, "responses come soon", "A slow server is not a wrong one. Clients wait, and some give up.", "RFC 9110 9.2.2, 15.5.9"},
    {"head.length", "R0.1", must, "Content-Length of HEAD is that of GET",
     "A response to HEAD has no Content-Length, or the number of bytes that GET would have had.", "RFC 9110 8.6, 9.3.2"},
    {"head.fields", "R0.1", should, "HEAD has the fields of GET", "The response to HEAD has the header fields that GET would have had.",
     "RFC 9110 9.3.2"},
    {"alternates.bytes", "R0.1", must, "the bytes are what Content-Type says", "Content-Type is the media type of the representation.",
     "RFC 9110 8.3"},
    {"date.syntax", "R0.1", must, "dates have the format of HTTP", "Date and Last-Modified are in IMF-fixdate.", "RFC 9110 5.6.7, 6.6.1, 8.8.2"},
    {"date.moves", "R0.1", must, "Date moves with the time", "Date is when the response was generated.", "RFC 9110 6.6.1"},
    {"date.clock", "R0.1", may, "Date is right", "Times of a server whose clock is wrong mean nothing to others.", "RFC 9110 6.6.1"},
    {"modified.future", "R0.1", must, "Last-Modified is not after Date", "A server with a clock sends no Last-Modified that is later than Date.",
     "RFC 9110 8.8.2.1"},
    {"modified.changes", "R0.1", should, "Last-Modified moves with the representation",
     "What has changed after a response has a Last-Modified that is not before it.", "RFC 9110 8.8.2.1"},
    {"modified.condition", "R0.1", should, "If-Modified-Since is evaluated",
     "With the present Last-Modified GET is answered with 304, with an earlier date not.", "RFC 9110 13.1.3"},
    {"range.announced", "R0.1", should, "Accept-Ranges is true", "A server that announces ranges sends them.", "RFC 9110 14.2, 14.3"},
    {"range.bytes", "R0.1", must, "a part has the bytes that Content-Range says",
     "A 206 has the bytes of the representation at the range that it states.", "RFC 9110 14.4, 15.3.7"},
    {"range.if-range", "R0.1", must, "If-Range with another tag gets the whole", "If the condition is false, the Range is ignored.",
     "RFC 9110 13.1.5"},
    {"range.unsatisfiable", "R0.1", should, "a range behind the end gets 416 with the length",
     "A range that cannot be satisfied gets 416 with Content-Range, or the whole.", "RFC 9110 14.4, 15.5.17"},
    {"prefer.applied", "R0.1", must, "Preference-Applied is true", "The field names the preferences that the server has applied.", "RFC 7240 3"},
    // ---- R0.2 to R0.8
    {"tls.https", "R0.2", should, "the connection is protected by TLS",
     "A server should offer HTTPS; one on the Internet must, or have another protection.", "paper R0.2, RFC 9110 4.2.2"},
    {"uri.get", "R0.3 R0.9", must, "each advertised sub-resource answers GET",
     "A Robotic Thing and all its sub-resources have URIs at which they are found.", "paper R0.3"},
    {"uri.named", "R0.3", must, "sub-resources are named by IRIs", "A sub-resource has a URI: no blank node, no literal.", "paper R0.3"},
    {"root.get", "R0.4", must, "the root resource answers GET", "GET is supported on the root resource.", "paper R0.4"},
    {"methods.get", "R0.5", must, "GET retrieves a representation", "GET retrieves, POST creates, PUT replaces, DELETE removes.",
     "paper R0.5, RFC 9110 9.3.1"},
    {"methods.refused", "R0.5", must, "a method that Allow lacks is refused",
     "What a resource does not allow is answered with an error of the client, usually 405.", "RFC 9110 9.1, 15.5.6"},
    {"methods.allow-of-405", "R0.5 R0.10", must, "405 has Allow", "A 405 lists the methods that the resource supports.", "RFC 9110 15.5.6"},
    {"methods.announced", "R0.5 R0.10", must, "a method that Allow lists is not refused as unknown",
     "Allow lists the methods that a resource supports.", "RFC 9110 10.2.1, 15.5.6"},
    {"status.not-found", "R0.6", must, "an unknown URI gets an error of the client",
     "Status codes tell success from errors of the client; what does not exist gets 404.", "paper R0.6, RFC 9110 15.5.5"},
    {"status.bad-request", "R0.6", must, "400 is implemented", "400 tells that the request is wrong.", "paper R0.6, RFC 9110 15.5.1"},
    {"status.blame", "R0.6", must, "an error of the client gets no 5xx",
     "5xx is for errors of the server; a wrong request gets 4xx (501 and 505 say what is not implemented).", "paper R0.6, RFC 9110 15.5, 15.6"},
    {"status.500", "R0.6", must, "500 is implemented", "500 tells that the server failed.", "paper R0.6"},
    {"write.put", "R0.5", must, "PUT of the present representation succeeds", "PUT replaces the state of a resource.", "paper R0.5, RFC 9110 9.3.4"},
    {"write.no-content", "R0.7", should, "a successful PUT is answered with 204",
     "Successful PUT, POST and DELETE get 204, unless the client asks for more.", "paper R0.7"},
    {"write.media-type", "R0.6", should, "a body of an unknown media type is refused", "A media type that is not supported gets 415 (4xx).",
     "RFC 9110 15.5.16"},
    {"write.bad-rdf", "R0.6", must, "a body that is not what Content-Type says is refused", "A body that cannot be parsed gets 400 (4xx).",
     "paper R0.6, RFC 9110 15.5.1"},
    {"write.shape", "R0.6", must, "a body that violates the Blueprint is refused", "A Blueprint tells which bodies are valid; others get 4xx.",
     "paper 5.1, 5.4; SHACL 3; LDP 4.2.4.4"},
    {"write.alternatives", "R0.6", must, "a value has exactly one of its alternatives",
     "If the Blueprint says that a value is one of several alternatives, a body with two of them, and one with none, gets 4xx.",
     "paper 5.1, 5.4; SHACL 4.6.4"},
    {"write.if-match", "R0.11", must, "If-Match with another tag prevents a PUT", "If the condition is false, the method is not performed: 412.",
     "RFC 9110 13.1.1, LDP 4.2.4.5"},
    {"write.unchanged", "R0.6", must, "refused bodies change nothing", "What is answered with an error has had no effect.",
     "RFC 9110 15.5, paper 5.4"},
    {"invoke.post", "R0.5", must, "POST of a valid input succeeds", "POST invokes an action.", "paper R0.5, 5.4"},
    {"invoke.no-content", "R0.7", should, "a successful POST is answered with 204",
     "Successful POST requests get 204; 201 of a container, 202, and 200 with an output are accepted here.", "paper R0.7, LDP 5.2.3.1"},
    {"post.location", "R0.8", must, "a successful POST has Location", "Location names the resource that a POST has created.",
     "paper R0.8, RFC 9110 10.2.2"},
    {"post.location-get", "R0.8", must, "what Location names answers GET", "The created resource has a URI.", "paper R0.3, R0.8"},
    {"invoke.bad-rdf", "R0.6", must, "a POST whose body is not what Content-Type says is refused", "A body that cannot be parsed gets 400 (4xx).",
     "paper R0.6, RFC 9110 15.5.1"},
    {"invoke.shape", "R0.6", must, "a POST whose body violates the shape of the input is refused",
     "An action validates its input and rejects what does not conform.", "paper 5.4, SHACL 3"},
    {"invoke.alternatives", "R0.6", must, "an input has exactly one of its alternatives",
     "If the shape of the input says that it is one of several alternatives, a body with two of them, and one with none, gets 4xx.",
     "paper 5.4, SHACL 4.6.4"},
    // ---- R0.9 to R0.11
    {"link.related", "R0.9", must, "sub-resources are advertised by Link with rel=related",
     "The response of a Robotic Thing links to its sub-resources with the relation related.", "paper R0.9, RFC 8288 3"},
    {"link.targets", "R0.9", should, "what links lead to exists", "A link leads from a resource to another one.", "RFC 8288 3"},
    {"link.describedby", "R0.9", should, "what rel=describedby leads to describes", "The target of describedby gives information about the resource.",
     "RFC 8288 3, LDP 4.2.1.6"},
    {"alternates.get", "R0.9", should, "alternates are there in the media type of their link",
     "A link with rel=alternate leads to another representation.", "RFC 8288 3.4.1"},
    {"options.success", "R0.10", must, "OPTIONS is supported by each resource", "OPTIONS is supported for each exposed resource.",
     "paper R0.10, RFC 9110 9.3.7"},
    {"options.allow", "R0.10", must, "the response to OPTIONS has Allow with what works", "Allow advertises the permitted methods.",
     "paper R0.10, RFC 9110 10.2.1"},
    {"options.agrees", "R0.10", should, "Allow is the same in all responses", "GET, OPTIONS and 405 tell the same methods.", "RFC 9110 10.2.1"},
    {"options.complete", "R0.10", should, "a method that works is in Allow", "Allow advertises the permitted methods.",
     "paper R0.10, RFC 9110 10.2.1"},
    {"accept-post.options", "R0.10", should, "containers that permit POST have Accept-Post in OPTIONS", "Accept-Post tells what may be sent.",
     "LDP 5.2.3.14, 7.1"},
    {"accept-post.media-types", "R0.10", must, "a media type of Accept-Post is not refused", "Accept-Post lists the media types that POST accepts.",
     "LDP 7.1"},
    {"accept-patch.announced", "R0.10", should, "Accept-Patch and PATCH in Allow go together",
     "Accept-Patch tells that PATCH is allowed, and what may be sent.", "RFC 5789 3.1"},
    {"etag.get", "R0.11", must, "GET has an ETag", "Responses with representations have an entity tag.", "paper R0.11, RFC 9110 8.8.3"},
    {"etag.head", "R0.11", must, "HEAD has the ETag of GET", "Responses to HEAD have an entity tag, the one that GET would have.",
     "paper R0.11, RFC 9110 9.3.2"},
    {"etag.syntax", "R0.11", must, "the ETag is well-formed", "An entity tag is a quoted string, perhaps with W/ before it.", "RFC 9110 8.8.3"},
    {"etag.changes", "R0.11", must, "another representation has another strong ETag",
     "A strong tag changes when the bytes of the representation change.", "RFC 9110 8.8.1"},
    {"etag.stable", "R0.11", should, "the same representation keeps its ETag", "A tag that changes without need makes caches and conditions useless.",
     "RFC 9110 8.8.1"},
    {"etag.media-types", "R0.11", must, "different media types have different strong ETags",
     "A strong tag is unique over all representations of a resource.", "RFC 9110 8.8.1, 8.8.3.3"},
    {"etag.304", "R0.11", must, "If-None-Match with the present tag gets 304", "If the condition is false, GET is answered with 304.",
     "RFC 9110 13.1.2"},
    {"etag.304-tag", "R0.11", must, "304 has the ETag", "A 304 has the ETag that a 200 would have.", "RFC 9110 15.4.5"},
    {"etag.304-fields", "R0.11", must, "304 has Vary and Cache-Control of 200", "A 304 has the fields for caches that a 200 would have had.",
     "RFC 9110 15.4.5"},
    {"etag.304-false", "R0.11", must, "304 means that nothing has changed",
     "If-None-Match with a tag that is not the present one gets the representation.", "RFC 9110 13.1.2"},
    {"etag.list", "R0.11", must, "If-None-Match may be a list", "The condition is false if one of the tags is the present one.", "RFC 9110 13.1.2"},
    // ---- R0.12 to R0.17
    {"ws.handshake", "R0.15 R0.12 R0.14", must, "GET with `Upgrade: websocket` opens a WebSocket",
     "The Upgrade field creates subscriptions; its value websocket results in a WebSocket.", "paper R0.12, R0.14, R0.15; RFC 6455 4"},
    {"ws.accept", "R0.12", must, "Sec-WebSocket-Accept belongs to the key",
     "The value proves that the server has read the key; clients fail otherwise.", "RFC 6455 4.1, 4.2.2"},
    {"ws.fields", "R0.12", must, "the 101 has the fields of a WebSocket and nothing that was not offered",
     "Upgrade, Connection; no extension or subprotocol that the client did not offer.", "RFC 6455 4.1, 4.2.2"},
    {"ws.frames", "R0.12", must, "the frames of the server are well-formed", "Frames are unmasked, without reserved bits and opcodes.", "RFC 6455 5"},
    {"ws.ping", "R0.12", must, "a ping gets its pong", "A pong has the payload of the ping.", "RFC 6455 5.5.2, 5.5.3"},
    {"ws.close", "R0.12", must, "a close gets a close", "An endpoint that receives a close frame sends one.", "RFC 6455 5.5.1"},
    {"ws.version", "R0.12", must, "an unsupported version is refused", "The handshake is refused, and Sec-WebSocket-Version tells what is supported.",
     "RFC 6455 4.2.2, 4.4"},
    {"ws.first-message", "R0.15", may, "the first message is the present representation",
     "The paper does not ask for it. Without it a subscriber needs a GET and can miss a change in between.", "paper 5.3"},
    {"ws.notified", "R0.15", must, "a change is sent to the subscriber", "A subscription notifies of changes.", "paper 5.3, R0.15"},
    {"ws.content", "R0.15", must, "a message has the content after the change", "A notification carries what GET responds now.", "paper 5.3, R0.15"},
    {"ws.media-type", "R0.17", should, "Accept chooses the media type of messages", "Accept of the request that subscribes negotiates the content.",
     "paper R0.17"},
    {"callback.created", "R0.13 R0.16 R0.14", should, "GET with `Upgrade: callback` creates a callback",
     "Callbacks should be implemented; the value callback of Upgrade then creates one for the URI of the field Callback.",
     "paper R0.13, R0.14, R0.16"},
    {"callback.requires-uri", "R0.16", must, "`Upgrade: callback` without Callback is refused", "The field Callback is required.", "paper R0.16"},
    {"callback.delivered", "R0.16", must, "the callback is called", "A callback that was created is called with changes.", "paper R0.16, 5.3"},
    {"callback.content", "R0.16", must, "a notification has the content after the change", "A notification carries what GET responds now.",
     "paper R0.16, 5.3"},
    {"callback.media-type", "R0.17", should, "Accept chooses the media type of notifications",
     "Accept of the request that subscribes negotiates the content.", "paper R0.17"},
    {"callback.cancel", "R0.5 R1.8", must, "DELETE cancels the subscription", "A subscription is a resource, and DELETE cancels it.",
     "paper R0.5, 5.3"},
    {"callback.ends", "R1.8", must, "after DELETE there is no notification", "A subscription that was cancelled has ended.", "paper 5.3"},
    {"container.created", "R1.8", must, "a new subscription is listed", "The Subscriptions resource lists the subscriptions.",
     "paper R1.8, 5.3; LDP 5.2.3.2"},
    {"container.removed", "R1.8", must, "a deleted subscription is not listed", "The Subscriptions resource lists the subscriptions that are there.",
     "paper R1.8, 5.3; LDP 5.2.5.1"},
    // ---- R1
    {"rdf.turtle", "R1.2", must, "Turtle is the default", "Without Accept the representation of a Linked Robotic Thing is Turtle.",
     "paper R1.2, LDP 4.3.2.2"},
    {"rdf.accept-turtle", "R1.2", must, "`Accept: text/turtle` gets Turtle", "Turtle is what every client can ask for.", "paper R1.2, LDP 4.3.2.1"},
    {"rdf.valid", "R1.2", must, "representations are valid in their syntax", "RDF is well-formed in the media type that Content-Type states.",
     "RDF 1.1 Turtle 6"},
    {"negotiate.accept", "R1.2", should, "an offered media type is sent when Accept names it",
     "Content negotiation can lead to another outcome than Turtle.", "paper R1.2, RFC 9110 12.5.1"},
    {"negotiate.quality", "R1.2", should, "q-values of Accept decide", "The type with the greater weight is preferred.", "RFC 9110 12.4.2, 12.5.1"},
    {"negotiate.vary", "R1.2", should, "Vary names Accept", "Caches must know that the response depends on Accept.", "RFC 9110 12.5.5"},
    {"negotiate.not-acceptable", "R1.2", may, "Accept with no offered type gets 406",
     "A server may send what it has, but a client cannot tell that from success.", "RFC 9110 12.5.1, 15.5.7"},
    {"negotiate.listed", "R1.2", should, "what a 406 lists is sent", "A 406 has a list of the representations that are available.",
     "RFC 9110 15.5.7"},
    {"rdf.type", "R1.3", must, "each Thing has an rdf:type", "At least one rdf:type is set explicitly.", "paper R1.3, LDP 4.2.1.4"},
    {"rdf.vocabularies", "R1.5", should, "standard vocabularies are used",
     "Existing vocabularies such as RDFS, Dublin Core and LDP are used where possible: several, and no own term for what they have.",
     "paper R1.5, LDP 4.2.1.3"},
    {"subscriptions.triple", "R1.8", must, "each Thing has hybrit:subscriptions",
     "A triple hybrit:subscriptions leads from the Thing to its Subscriptions container.", "paper R1.8"},
    {"subscriptions.container", "R1.8", must, "the Subscriptions resource is a container",
     "It is a Linked Data Platform container that lists the subscriptions.", "paper R1.8, 5.3; LDP 5.2.1"},
    {"container.members", "R1.8", must, "what ldp:contains lists exists", "A container lists documents that are there.", "LDP 5.2.1, 5.2.5.1"},
    {"subscription.described", "R1.8", should, "a subscription is described",
     "A subscription is described by its type, its media type, its target and the data of its protocol.", "paper 5.3"},
    {"property.triples", "R1.9", should, "each Property has a triple hybrit:property",
     "Triples hybrit:property lead from the Thing to its Properties.", "paper R1.9"},
    {"modified.triple", "R1.9", should, "dcterms:modified is when the value has changed", "It moves with the value, and is not in the future.",
     "DCMI Metadata Terms"},
    {"action.triples", "R1.10", should, "each Action has a triple hybrit:action", "Triples hybrit:action lead from the Thing to its Actions.",
     "paper R1.10"},
    {"action.described", "R1.10", should, "an Action describes its input, its output and a binding that works",
     "An Action describes the data that it consumes and produces, and a binding by which a client can invoke it.", "paper 5.4"},
    {"blueprint.triple", "R1.11", should, "a Blueprint has a triple hybrit:blueprint",
     "A Thing may have a Blueprint; a triple hybrit:blueprint leads to it then.", "paper R1.11"},
    {"blueprint.shapes", "R1.11", should, "the Blueprint has valid shapes", "A Blueprint is machine-processable: shapes that a validator accepts.",
     "paper 5.1, SHACL 2"},
    {"blueprint.conforms", "R1.11", may, "the Thing conforms to its Blueprint", "The shapes describe the Thing.", "paper 5.1, SHACL 3"},
    {"blueprint.alternatives", "R1.11", should, "alternatives of a value exclude each other",
     "A shape of which a value has exactly one alternative (sh:xone, `oneOf` in JSON) accepts no value with two of them.", "paper 5.1, SHACL 4.6.4"},
    {"blueprint.targets", "R1.11", should, "published shapes target no terms of others",
     "A shape for a class of a foreign vocabulary judges the data of others as soon as graphs are merged.", "paper 5.1, SHACL 2.1.3"},
    {"merge.conforms", "R1.11", should, "the merged documents conform to all published shapes",
     "Blueprints describe what a client reads, and a client may merge all documents into one graph.", "paper 5.1, SHACL 3, RDF 1.1 Semantics 4.1"},
    {"merge.doubles", "R1.9", should, "merged documents describe nothing twice",
     "Blank nodes of two documents are two things after merging. What several documents describe has an IRI.", "RDF 1.1 Semantics 4.1"},
    {"merge.entailment", "R1.7", should, "RDFS entailment changes no class",
     "Clients with and without inference read the same: a domain or range gives a node no class that is neither stated nor above one.",
     "paper R1.7, RDF 1.1 Semantics 9.2.1"},
    {"metadata", "R1.12", may, "there are labels, descriptions or units", "Further meta data may describe the meaning of the parts.", "paper R1.12"},
    // ---- what lrt adds
    {"expiry.clock", "lrt", must, "Robot-Time moves on", "Robot-Time is a stamp of one run, and its milliseconds never go back.",
     "docs/specification.md"},
    {"expiry.late", "lrt", must, "a command that is late is refused", "A command whose Valid-Until is over gets 412 and is not carried out.",
     "docs/specification.md"},
    {"expiry.instance", "lrt", must, "a command for another run is refused",
     "Valid-Until of another run of the server gets 412 and is not carried out.", "docs/specification.md"},
    {"expiry.valid", "lrt", must, "a command in time is carried out", "Valid-Until that is ahead changes nothing.", "docs/specification.md"},
    {"expiry.problem", "lrt", should, "the refusal of a late command says so", "The problem type of the 412 is lrt:LateCommand.",
     "docs/specification.md"},
    {"heartbeat.comes", "lrt", must, "a heartbeat that was asked for comes", "An event stream with the parameter heartbeat has events of that type.",
     "docs/specification.md"},
    {"heartbeat.refused", "lrt", should, "a heartbeat that is no number is refused", "A value of heartbeat that is no number gets 400.",
     "docs/specification.md"},
    {"stop.state", "lrt", must, "a stop state can be read", "lrt:stopState leads to it, and the root says the same.", "docs/specification.md"},
    {"stop.refuses", "lrt", must, "what moves is refused while stopped", "A command to a stopped Thing gets 409 with the problem type lrt:Stopped.",
     "docs/specification.md"},
};

constexpr PaperRequirement requirements[] = {
    {"R0.1", must, "HTTP/1.1 conformant server", Outcome::not_testable, ""},
    {"R0.2", should, "HTTPS", Outcome::not_testable, ""},
    {"R0.3", must, "URIs for a Thing and its sub-resources", Outcome::not_testable, ""},
    {"R0.4", must, "GET on the root resource", Outcome::not_testable, ""},
    {"R0.5", must, "GET, POST, PUT, DELETE by their meaning", Outcome::not_testable, ""},
    {"R0.6", must, "status codes 200, 400, 500", Outcome::not_testable, "", "status.bad-request status.500"},
    {"R0.7", should, "204 for PUT, POST and DELETE", Outcome::not_testable, ""},
    {"R0.8", must, "Location of what POST created", Outcome::not_testable, ""},
    {"R0.9", must, "Link rel=related to sub-resources", Outcome::not_testable, ""},
    {"R0.10", must, "OPTIONS and Allow", Outcome::not_testable, ""},
    {"R0.11", must, "ETag for GET and HEAD", Outcome::not_testable, ""},
    {"R0.12", must, "WebSocket protocol", Outcome::not_testable, ""},
    {"R0.13", should, "HTTP callbacks", Outcome::not_testable, ""},
    {"R0.14", must, "Upgrade creates subscriptions", Outcome::not_testable, ""},
    {"R0.15", must, "Upgrade: websocket", Outcome::not_testable, ""},
    {"R0.16", must, "Upgrade: callback with Callback", Outcome::not_testable, ""},
    {"R0.17", should, "Accept in subscribing requests", Outcome::not_testable, ""},
    {"R1.1", must, "is a Robotic Thing", Outcome::pass, "no `must` of R0.1 to R0.17 has failed"},
    {"R1.2", must, "Turtle unless negotiated otherwise", Outcome::not_testable, ""},
    {"R1.3", must, "an explicit rdf:type", Outcome::not_testable, ""},
    {"R1.4", must, "clients expect several types", Outcome::not_applicable, "a requirement on clients"},
    {"R1.5", should, "existing vocabularies", Outcome::not_testable, ""},
    {"R1.6", should, "clients expect any set of predicates", Outcome::not_applicable, "a requirement on clients"},
    {"R1.7", must, "no inference needed", Outcome::not_testable, ""},
    {"R1.8", must, "hybrit:subscriptions", Outcome::not_testable, ""},
    {"R1.9", should, "hybrit:property", Outcome::not_testable, ""},
    {"R1.10", should, "hybrit:action", Outcome::not_testable, ""},
    {"R1.11", may, "hybrit:blueprint", Outcome::not_testable, ""},
    {"R1.12", may, "further meta data", Outcome::not_testable, ""},
};

const Check& check_of(std::string_view id) {
  const auto found = std::find_if(std::begin(checks), std::end(checks), [id](const Check& c) { return c.id == id; });
  assert(found != std::end(checks));
  return *found;
}

Level weaker(Level a, Level b) { return std::max(a, b); }

}  // namespace

Table<Check> catalogue() noexcept { return {std::begin(checks), std::end(checks)}; }
Table<PaperRequirement> paper_requirements() noexcept { return {std::begin(requirements), std::end(requirements)}; }

// -------------------------------------------------------------------------------------------------------------------------- Verdicts

Finding& Verdicts::finding(std::string_view id) {
  const auto found = findings_.find(id);
  if (found != findings_.end()) return found->second;
  const Check& check = check_of(id);
  Finding f;
  f.id = std::string(id);
  f.requirements = words(check.requirements);
  f.level = check.level;
  f.outcome = Outcome::not_applicable;
  f.title = std::string(check.title);
  f.specification = std::string(check.specification);
  f.references = std::string(check.references);
  return findings_.emplace(f.id, std::move(f)).first->second;
}

void Verdicts::pass(std::string_view id, const Exchange* exchange, const std::string& detail) {
  Finding& f = finding(id);
  ++f.tried;
  if (f.outcome == Outcome::fail) return;
  if (f.outcome != Outcome::pass) {
    f.outcome = Outcome::pass;
    f.detail = excerpt(detail, max_detail);
    f.evidence.clear();
    if (exchange != nullptr) f.evidence.push_back(exchange->evidence());
  }
}

void Verdicts::fail(std::string_view id, const std::string& detail, const Exchange* exchange, Certainty certainty) {
  if (exchange != nullptr && exchange->reply.timed_out()) return not_testable(id, "there was no response in time, which http.slow tells", exchange);
  if (exchange != nullptr && exchange->reply.not_asked()) return not_testable(id, exchange->reply.error->message, exchange);
  add_failure(id, detail, exchange, certainty);
}

void Verdicts::fail_silent(std::string_view id, const std::string& detail, const Exchange& exchange, bool is_fast) {
  if (is_fast || !exchange.reply.timed_out()) return add_failure(id, detail, &exchange, Certainty::certain);
  not_testable(id, "there was no response in time, and the server is slow", &exchange);
}

void Verdicts::add_failure(std::string_view id, const std::string& detail, const Exchange* exchange, Certainty certainty) {
  Finding& f = finding(id);
  ++f.tried;
  ++f.failed;
  if (f.outcome != Outcome::fail) {
    f.outcome = Outcome::fail;
    f.certainty = certainty;
    f.detail = excerpt(detail, max_detail);
    f.evidence.clear();
  } else if (certainty == Certainty::certain && f.certainty != certainty) {
    f.certainty = certainty;
    f.detail = excerpt(detail, max_detail);
  }
  if (exchange != nullptr && f.evidence.size() < max_evidence) f.evidence.push_back(exchange->evidence());
}

void Verdicts::fail_all(std::string_view id, const std::vector<std::string>& results, std::size_t count, std::size_t tried,
                        const Exchange* exchange) {
  fail(id, results.empty() ? std::to_string(count) + " results" : results.front(), exchange);
  Finding& f = finding(id);
  f.results.insert(f.results.end(), results.begin(), results.end());
  f.tried += tried - 1;
  f.failed += count - 1;
}

void Verdicts::not_testable(std::string_view id, const std::string& reason, const Exchange* exchange) {
  Finding& f = finding(id);
  if (f.outcome != Outcome::not_applicable) return;
  f.outcome = Outcome::not_testable;
  f.detail = excerpt(reason, max_detail);
  if (exchange != nullptr) f.evidence.push_back(exchange->evidence());
}

void Verdicts::not_applicable(std::string_view id, const std::string& reason) {
  Finding& f = finding(id);
  if (f.outcome == Outcome::not_applicable && f.detail.empty()) f.detail = excerpt(reason, max_detail);
}

void Verdicts::otherwise(std::string_view id, Outcome outcome, const std::string& reason) {
  if (findings_.find(id) != findings_.end()) return;
  Finding& f = finding(id);
  f.outcome = outcome;
  f.detail = excerpt(reason, max_detail);
}

bool Verdicts::failed(std::string_view id) const {
  const auto found = findings_.find(id);
  return found != findings_.end() && found->second.outcome == Outcome::fail;
}

std::vector<Finding> Verdicts::findings(const std::string& reason) const {
  std::vector<Finding> all;
  Verdicts rest;
  for (const Check& check : catalogue()) {
    const auto found = findings_.find(check.id);
    if (found == findings_.end()) rest.not_testable(check.id, reason);
    all.push_back(found == findings_.end() ? rest.finding(check.id) : found->second);
  }
  return all;
}

std::vector<Requirement> summarise(const std::vector<Finding>& findings) {
  const auto rank = [](const Finding& f) {
    switch (f.outcome) {
      case Outcome::fail: return f.level == Level::must ? 5 : f.level == Level::should ? 4 : 1;  // advice alone does not make a requirement fail
      case Outcome::pass: return 3;
      case Outcome::not_testable: return 2;
      case Outcome::not_applicable: break;
    }
    return 0;
  };
  std::vector<Requirement> all;
  bool robotic = true;
  for (const PaperRequirement& r : paper_requirements()) {
    Requirement summary{std::string(r.id), r.level, std::string(r.title), r.without, false, std::string(r.reason)};
    const Finding* worst = nullptr;
    for (const Finding& f : findings) {
      if (std::find(f.requirements.begin(), f.requirements.end(), r.id) == f.requirements.end()) continue;
      if (worst == nullptr || rank(f) > rank(*worst)) worst = &f;
    }
    if (worst != nullptr) {
      summary.outcome = rank(*worst) == 1 ? Outcome::pass : worst->outcome;
      summary.advice = worst->outcome == Outcome::fail && worst->level != Level::must;
      if (worst->outcome != Outcome::pass) summary.reason = worst->id + ": " + worst->detail;
      if (worst->outcome == Outcome::fail) summary.level = weaker(r.level, worst->level);
    }
    // A part that was not tested is not fulfilled by another one that was.
    for (const std::string& id : words(r.needs)) {
      const auto part = std::find_if(findings.begin(), findings.end(), [&](const Finding& f) { return f.id == id; });
      if (summary.outcome != Outcome::pass || part == findings.end() || part->outcome == Outcome::pass) continue;
      summary.outcome = Outcome::not_testable;
      summary.reason = part->id + ": " + part->detail;
    }
    if (r.id == "R1.1" && !robotic) summary.outcome = Outcome::fail, summary.reason = "a `must` of R0.1 to R0.17 has failed";
    if (r.id.substr(0, 2) == "R0" && summary.outcome == Outcome::fail && !summary.advice) robotic = false;
    all.push_back(std::move(summary));
  }
  return all;
}

}  // namespace lrt::check
