// SPDX-License-Identifier: Apache-2.0
#pragma once

// Everything that describes and serves a robot. Include the headers that need further packages or libraries by name: eigen.hpp, urdf.hpp, protobuf.hpp,
// httplib.hpp, mqtt.hpp, query.hpp, client.hpp.
#include <lrt/action.hpp>
#include <lrt/collection.hpp>
#include <lrt/property.hpp>
#include <lrt/rdf/macros.hpp>
#include <lrt/rdf/traits.hpp>
#include <lrt/rdf/unit.hpp>
#include <lrt/rdf/vocab.hpp>
#include <lrt/responder.hpp>
#include <lrt/server.hpp>
#include <lrt/server_thing.hpp>
#include <lrt/thing.hpp>
#include <lrt/version.hpp>
#include <lrt/world.hpp>
