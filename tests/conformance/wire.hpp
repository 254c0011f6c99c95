// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace lrt::test {

/// What the client does in one step, and the bytes that it then has.
struct WireStep {
  std::string set;       ///< "angle 77", or "clock 5000"
  std::string request;   ///< sent, if there is no `set`
  std::string response;  ///< all that the server sends until it waits for the client
};

struct WireExchange {
  std::string name;
  std::vector<WireStep> steps;
};

struct WireRecording {
  std::string preface;  ///< the comment at the beginning of the file
  std::vector<WireExchange> exchanges;
};

/// One line of the file: `\r`, `\\`, `\xHH` stand for bytes, `\100*a` for a hundred times the letter; a line ends with a line feed unless its
/// last character is a single backslash.
inline std::string unescaped(std::string_view line) {
  std::string bytes;
  for (std::size_t at = 0; at < line.size(); ++at) {
    if (line[at] != '\\') {
      bytes += line[at];
    } else if (at + 1 == line.size()) {
      return bytes;
    } else if (line[++at] == 'x') {
      bytes += static_cast<char>(std::stoi(std::string(line.substr(at + 1, 2)), nullptr, 16));
      at += 2;
    } else if (line[at] >= '0' && line[at] <= '9') {
      const std::size_t star = line.find('*', at);
      bytes.append(std::stoul(std::string(line.substr(at, star - at))), line.at(star + 1));
      at = star + 1;
    } else {
      bytes += line[at] == 'r' ? '\r' : line[at];
    }
  }
  return bytes + '\n';
}

inline WireRecording read_recording(const std::string& path) {
  WireRecording recording;
  std::ifstream in(path);
  char before = 0;
  for (std::string line; std::getline(in, line);) {
    if (line.empty() || line[0] == '#') {
      if (recording.exchanges.empty()) recording.preface += line + "\n";
      before = 0;
      continue;
    }
    if (line.compare(0, 9, "exchange ") == 0) {
      recording.exchanges.push_back({line.substr(9), {}});
      before = 0;
      continue;
    }
    if (line == ".") {
      before = 0;
      continue;
    }
    if (recording.exchanges.empty() || line.size() < 2) throw std::runtime_error("wire.txt: unexpected: " + line);
    auto& steps = recording.exchanges.back().steps;
    const char kind = line[0];
    const std::string rest = line.substr(2);
    if (kind == '@') steps.push_back({rest, {}, {}});
    else if (kind == '>' && before != '>') steps.push_back({{}, unescaped(rest), {}});
    else if (kind == '>') steps.back().request += unescaped(rest);
    else if (kind == '<' && !steps.empty()) steps.back().response += unescaped(rest);
    else throw std::runtime_error("wire.txt: unexpected: " + line);
    before = kind;
  }
  return recording;
}

}  // namespace lrt::test
