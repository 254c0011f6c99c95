# SPDX-License-Identifier: Apache-2.0
# Redland::rdf: Raptor, Redland's library of RDF parsers and serialisers, found by pkg-config, for RDF/XML. librdf itself is not
# needed: see src/rdf/redland/redland.cpp. Not looked for when LRT_REDLAND is OFF.
find_package(PkgConfig QUIET)
if(PkgConfig_FOUND)
  pkg_check_modules(Raptor QUIET IMPORTED_TARGET GLOBAL raptor2)
endif()
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(Redland REQUIRED_VARS Raptor_LIBRARIES VERSION_VAR Raptor_VERSION)
if(Redland_FOUND AND NOT TARGET Redland::rdf)
  add_library(Redland::rdf INTERFACE IMPORTED)
  target_link_libraries(Redland::rdf INTERFACE PkgConfig::Raptor)
endif()
