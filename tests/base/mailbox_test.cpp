// SPDX-License-Identifier: Apache-2.0
#include "src/base/mailbox.hpp"

#include <cstddef>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

#include "tests/support/catch.hpp"

using lrt::Mailbox;

TEST_CASE("a mailbox gives its items in the order of put", "[base]") {
  Mailbox<int> mailbox;
  CHECK(mailbox.empty());
  for (int i = 0; i < 3; ++i) mailbox.put(i);
  CHECK_FALSE(mailbox.empty());
  std::vector<int> taken;
  mailbox.take_all([&](int i) { taken.push_back(i); });
  CHECK(taken == std::vector<int>{0, 1, 2});
  CHECK(mailbox.empty());
}

TEST_CASE("an item that is put during take_all is taken by the next call", "[base]") {
  Mailbox<int> mailbox;
  mailbox.put(1);
  std::vector<int> taken;
  const auto take = [&](int i) {
    taken.push_back(i);
    if (i == 1) mailbox.put(2);
  };
  mailbox.take_all(take);
  CHECK(taken == std::vector<int>{1});
  mailbox.take_all(take);
  CHECK(taken == std::vector<int>{1, 2});
}

TEST_CASE("a mailbox destroys the items that nobody took", "[base]") {
  const auto item = std::make_shared<int>(1);
  {
    Mailbox<std::shared_ptr<int>> mailbox;
    mailbox.put(item);
    mailbox.put(item);
    CHECK(item.use_count() == 3);
  }
  CHECK(item.use_count() == 1);
}

TEST_CASE("a mailbox takes every item of several threads once, each thread's in order", "[base][threads]") {
  constexpr std::size_t writers = 3, items = 20'000;
  Mailbox<std::pair<std::size_t, std::size_t>> mailbox;
  std::vector<std::thread> threads;
  for (std::size_t w = 0; w < writers; ++w)
    threads.emplace_back([&mailbox, w] {
      for (std::size_t i = 0; i < items; ++i) mailbox.put({w, i});
    });
  std::vector<std::size_t> next(writers, 0);
  std::size_t taken = 0, out_of_order = 0;
  while (taken < writers * items)
    mailbox.take_all([&](std::pair<std::size_t, std::size_t> item) {
      out_of_order += item.second != next[item.first]++;
      ++taken;
    });
  for (std::thread& thread : threads) thread.join();
  CHECK(out_of_order == 0);
  CHECK(mailbox.empty());
}
