// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <lrt/client.hpp>

#include "tools/lrt/command_line.hpp"

/// Names on the command line, and what is said about those that name nothing.
namespace lrt::tool {

enum class Named : unsigned char { thing, property, action };

/// The error of a name that was looked up as a Thing, a property or an action, for a person: which part of it is unknown, what was probably meant, or what
/// it is instead and which command takes that.
Error explained(const client::Robot& robot, const std::string& name, Named wanted, const Error& error);

/// The error of a document that is not about the URL by which it was read, but about the same path at another host: the robot has a public base. nullopt:
/// it is about that URL, or about something else. Commands that would follow its links would leave the robot, or find nothing.
std::optional<Error> elsewhere(const std::string& url, const rdf::Graph& graph);

/// The same of the document by which a robot was opened. A robot that has its Things here is not read once more.
std::optional<Error> elsewhere(Client& client, const client::Robot& robot);

/// Why a robot has no Thing: its document may speak of another host.
std::string no_things(Client& client, const client::Robot& robot);

/// "right_s1/friction", "right_s1": the name of what has this URL. Empty: it is none of the robot's.
std::string name_of(const std::vector<client::Thing>& things, const std::string& url);

std::vector<NamedProperty> properties_of(const client::Thing& thing);

/// Whether a word has * or ?.
bool is_pattern(const std::string& word) noexcept;
/// The properties whose names fit: the part before the last '/' is the Thing's name or the end of its path, the part behind it the property's. Without a '/'
/// the properties of all Things that fit.
std::vector<NamedProperty> fitting(const client::Robot& robot, const std::string& pattern);

/// Whether a representation says that it is about a Thing, an action.
bool is_thing(const client::Representation& representation);
bool is_action(const client::Representation& representation);
/// Whether a document has a Thing, whatever its URL.
bool mentions_thing(const rdf::Graph& graph);

}  // namespace lrt::tool
