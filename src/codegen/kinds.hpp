// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include <lrt/client/description.hpp>

namespace lrt::codegen {

/// A property or action that all Things of a kind have in the same form.
template <class Description>
struct Member {
  const Description* first = nullptr;
  std::size_t count = 0;     ///< Things that have it
  std::string form;          ///< the type of its values, without bounds
  std::string bounded_form;  ///< with those of the first Thing
  bool equal_bounds = true;  ///< all Things have these
};
using PropertyMember = Member<client::PropertyDescription>;
using ActionMember = Member<client::ActionDescription>;

/// Things that share one class.
struct ThingKind {
  std::string name;
  std::vector<const client::ThingDescription*> things;
  std::vector<std::string> classes;  ///< the classes that all Things have
  std::map<std::string, PropertyMember> properties;
  std::map<std::string, ActionMember> actions;
};

/// Groups Things by Blueprint. Things with one Blueprint whose values differ by more than bounds are of different kinds. Kinds that differ only in
/// features that C++ cannot express, such as links between Things, are merged.
/// @return  in the order of their names; several may have one name
std::vector<ThingKind> kinds_of(const client::Description& robot);

}  // namespace lrt::codegen
