// SPDX-License-Identifier: Apache-2.0
// Which thread runs my lambda? Dispatch defines it, for a server or for one thing. Io defines whether lrt has a thread of its own.
#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

#include <lrt/lrt.hpp>

#include "examples/lesson.hpp"

thread_local std::string whoami = "a thread of lrt";

/// An executor of your own: one worker thread.
class Worker {
 public:
  ~Worker() {
    post({});
    thread_.join();
  }
  void post(std::function<void()> job) {
    {
      const std::lock_guard lock(mutex_);
      jobs_.push_back(std::move(job));
    }
    ready_.notify_one();
  }

 private:
  void work() {
    whoami = "the worker's thread";
    for (;;) {
      std::unique_lock lock(mutex_);
      ready_.wait(lock, [this] { return !jobs_.empty(); });
      const std::function<void()> job = std::move(jobs_.front());
      jobs_.pop_front();
      lock.unlock();
      if (!job) return;
      job();
    }
  }
  std::mutex mutex_;
  std::condition_variable ready_;
  std::deque<std::function<void()>> jobs_;
  std::thread thread_{[this] { work(); }};
};

lrt::Thing make(const char* name, lrt::Dispatch where) {
  lrt::Thing thing{name};
  thing.dispatch(where).property("thread", [] { return whoami; });
  return thing;
}

int main() {
  whoami = "the host's thread";
  Worker worker;

  lrt::Options options = lesson::options();
  options.threads.executor = [&](std::function<void()> job) { worker.post(std::move(job)); };
  lrt::Server server = lrt::Server::create(options).value();
  server.add(make("default", lrt::Dispatch::as_server)).value();   // in poll: robot code needs no locks
  server.add(make("quick", lrt::Dispatch::io_thread)).value();     // at once: for fast, thread-safe code
  server.add(make("elsewhere", lrt::Dispatch::executor)).value();  // for long work: a camera, a planner

  options.threads.io = lrt::Io::in_poll;  // lrt has no thread: requests are answered in poll() only
  options.listen.port = 0;
  lrt::Server single = lrt::Server::create(options).value();
  single.add(make("default", lrt::Dispatch::as_server)).value();
  single.add(make("quick", lrt::Dispatch::io_thread)).value();

  lesson::Visitor visitor(server, [](lesson::Client& client) {
    client.only({"rdf:value"});
    for (const char* path : {"/default/thread", "/quick/thread", "/elsewhere/thread"}) client.get(path);
  });
  server.run();  // run() is a loop over poll()
  if (lesson::serves()) return 0;

  lesson::Visitor again(single, [](lesson::Client& client) {
    client.only({"rdf:value"});
    for (const char* path : {"/default/thread", "/quick/thread"}) client.get(path);
  });
  while (again.is_here()) single.poll();
}

// Output:
// GET /default/thread
// 200 OK
// Content-Type: text/turtle
//     rdf:value "the host's thread" ;
//
// GET /quick/thread
// 200 OK
// Content-Type: text/turtle
//     rdf:value "a thread of lrt" ;
//
// GET /elsewhere/thread
// 200 OK
// Content-Type: text/turtle
//     rdf:value "the worker's thread" ;
//
// GET /default/thread
// 200 OK
// Content-Type: text/turtle
//     rdf:value "the host's thread" ;
//
// GET /quick/thread
// 200 OK
// Content-Type: text/turtle
//     rdf:value "the host's thread" ;
