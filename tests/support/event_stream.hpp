#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace lrt::test {

/// An event as a page gets it.
struct Event {
  std::string id, data;
  friend bool operator==(const Event& a, const Event& b) { return a.id == b.id && a.data == b.data; }
};

/// Reads an event stream as a browser does (WHATWG HTML 9.2.6).
class EventParser {
 public:
  void read(std::string_view bytes) {
    for (const char c : bytes) {
      const bool ends = c == '\r' || (c == '\n' && !after_cr_);
      if (c != '\r' && c != '\n') line_ += c;
      after_cr_ = c == '\r';
      if (ends) end_line(std::exchange(line_, {}));
    }
  }
  std::vector<Event> take() { return std::exchange(events_, {}); }
  std::size_t comments = 0;

 private:
  void end_line(const std::string& line) {
    if (line.empty()) {
      if (!data_.empty()) {
        data_.pop_back();
        events_.push_back({id_, std::exchange(data_, {})});
      }
      return;
    }
    const std::size_t colon = line.find(':');
    if (colon == 0) {
      ++comments;
      return;
    }
    const std::string name = line.substr(0, colon);
    std::string value = colon == std::string::npos ? std::string() : line.substr(colon + 1);
    if (!value.empty() && value[0] == ' ') value.erase(0, 1);
    if (name == "data") data_ += value + "\n";
    if (name == "id" && value.find('\0') == std::string::npos) id_ = value;
  }

  std::string line_, data_, id_;
  std::vector<Event> events_;
  bool after_cr_ = false;
};

}  // namespace lrt::test
