# SPDX-License-Identifier: Apache-2.0
# Librdf::Librdf: librdf, Redland's models and storages, found by pkg-config. Redland::rdf of FindRedland.cmake is Raptor only.
include("${CMAKE_CURRENT_LIST_DIR}/LrtPackages.cmake")
lrt_find_by_pkg_config(Librdf Librdf::Librdf redland)
