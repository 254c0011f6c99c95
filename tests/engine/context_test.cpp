// SPDX-License-Identifier: Apache-2.0
#include "src/engine/context.hpp"

#include <memory>
#include <optional>
#include <string>

#include "tests/support/catch.hpp"
#include "tests/support/message.hpp"

using namespace lrt;
using namespace lrt::test;
using namespace lrt::engine;

namespace {

std::optional<std::string> accept_of(const std::string& text) {
  RequestText request(text);
  const Context context(request.get(), {});
  const auto accept = context.accept();
  return accept ? std::optional<std::string>(*accept) : std::nullopt;
}

}  // namespace

TEST_CASE("the query of a GET or HEAD decides the media type before Accept", "[engine][R0.17]") {
  CHECK_FALSE(accept_of("GET /arm"));
  CHECK(accept_of("GET /arm\nAccept: a/b") == "a/b");
  CHECK(accept_of("GET /arm\nAccept: a/b\nAccept: c/d") == "a/b, c/d");
  CHECK(accept_of("GET /arm?accept=c%2Fd\nAccept: a/b") == "c/d");
  CHECK(accept_of("HEAD /arm?x=1&accept=c/d") == "c/d");
  CHECK(accept_of("GET /arm?accept=\nAccept: a/b") == "");
  CHECK(accept_of("GET /arm?accept=%zz\nAccept: a/b") == "a/b");
}

TEST_CASE("a context that is kept outlives the request, with all that was found out", "[engine][R0.6]") {
  std::optional<Context> kept;
  {
    auto request = std::make_unique<RequestText>("GET /arm?accept=a/b\nPrefer: wait=3\nX-Mark: mark\n\nbody");
    request->get().peer = "192.0.2.1";
    Context context(request->get(), {});
    CHECK(context.accept() == "a/b");
    CHECK(context.preferences().wait->count() == 3);
    context.base = 4;
    context.page = 2;
    kept.emplace(context.kept());
    kept.emplace(kept->kept());  // once more
  }
  CHECK(kept->request().method == "GET");
  CHECK(kept->request().target == "/arm?accept=a/b");
  CHECK(kept->request().peer == "192.0.2.1");
  CHECK(kept->request().find("x-mark") == "mark");
  CHECK(kept->request().body.empty());  // was read already
  CHECK(kept->accept() == "a/b");
  CHECK(kept->preferences().wait->count() == 3);
  CHECK(kept->base == 4);
  CHECK(kept->page == 2);
}

TEST_CASE("Accept of a kept context is that of the copy", "[engine][R0.17]") {
  std::optional<Context> kept;
  {
    auto request = std::make_unique<RequestText>("GET /arm\nAccept: text/turtle;q=0.25");
    const Context context(request->get(), {});
    CHECK(context.accept() == "text/turtle;q=0.25");
    kept.emplace(context.kept());
  }
  CHECK(kept->accept() == "text/turtle;q=0.25");
}
