# SPDX-License-Identifier: Apache-2.0
# Redland::rdf: Raptor, Redland's library of RDF parsers and serialisers, found by pkg-config, for RDF/XML. librdf itself is not
# needed: see src/rdf/redland/redland.cpp. Not looked for when LRT_REDLAND is OFF.
include("${CMAKE_CURRENT_LIST_DIR}/LrtPackages.cmake")
lrt_find_by_pkg_config(Redland Redland::rdf raptor2)
