# SPDX-License-Identifier: Apache-2.0
# Run by cpack after it has made packages. cpack lets scripts of a package with shared libraries call ldconfig; Debian's policy (8.1.1) wants a
# trigger instead.
foreach(deb IN LISTS CPACK_PACKAGE_FILES)
  if(NOT deb MATCHES "\\.deb$")
    continue()
  endif()
  set(work ${CPACK_TEMPORARY_DIRECTORY}/control)
  file(REMOVE_RECURSE ${work})
  execute_process(COMMAND dpkg-deb -R ${deb} ${work} COMMAND_ERROR_IS_FATAL ANY)
  if(NOT EXISTS ${work}/DEBIAN/shlibs)
    continue()
  endif()
  file(REMOVE ${work}/DEBIAN/postinst ${work}/DEBIAN/postrm)
  file(WRITE ${work}/DEBIAN/triggers "activate-noawait ldconfig\n")
  file(CHMOD ${work}/DEBIAN/triggers PERMISSIONS OWNER_READ OWNER_WRITE GROUP_READ WORLD_READ)
  execute_process(COMMAND dpkg-deb --root-owner-group -Zxz -b ${work} ${deb} OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
  file(REMOVE_RECURSE ${work})
endforeach()
