# SPDX-License-Identifier: Apache-2.0
# Run by cpack before it makes packages: files that Debian's policy wants in each and that `cmake --install` does not install.
# The day of a release is that of CHANGELOG.md, so that packages of several architectures have the same files (Multi-Arch: same).
string(TIMESTAMP date "%a, %d %b %Y %H:%M:%S +0000" UTC)  # of SOURCE_DATE_EPOCH, if that is set
file(STRINGS ${CPACK_LRT_SOURCE_DIR}/CHANGELOG.md heading REGEX "^## ${CPACK_PACKAGE_VERSION} - ")
if(heading MATCHES " - ([0-9]+-[0-9]+-[0-9]+)$")
  execute_process(COMMAND date --utc --rfc-email --date=${CMAKE_MATCH_1} OUTPUT_VARIABLE date OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
endif()
foreach(component IN LISTS CPACK_COMPONENTS_ALL)
  string(TOUPPER ${component} upper)
  set(package ${CPACK_DEBIAN_${upper}_PACKAGE_NAME})
  set(root ${CPACK_TEMPORARY_DIRECTORY}/${component}/usr/share)
  set(doc ${root}/doc/${package})
  file(MAKE_DIRECTORY ${doc})
  file(COPY_FILE ${CPACK_LRT_SOURCE_DIR}/cmake/debian-copyright.txt ${doc}/copyright)
  file(COPY_FILE ${CPACK_LRT_SOURCE_DIR}/CHANGELOG.md ${doc}/changelog)
  file(WRITE ${doc}/changelog.Debian "lrt (${CPACK_PACKAGE_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE}) unstable; urgency=medium

  * Packages of lrt ${CPACK_PACKAGE_VERSION}. changelog.gz says what is new.

 -- ${CPACK_PACKAGE_CONTACT}  ${date}
")
  file(GLOB texts ${doc}/changelog* ${root}/man/man1/*.1)
  # The only override: the packages are not uploaded to Debian, where a bug would ask for them.
  file(WRITE ${root}/lintian/overrides/${package} "${package}: initial-upload-closes-no-bugs\n")
  execute_process(COMMAND gzip -9nf ${texts} COMMAND_ERROR_IS_FATAL ANY)
  file(GLOB_RECURSE files ${doc}/* ${root}/man/* ${root}/lintian/*)
  file(CHMOD ${files} PERMISSIONS OWNER_READ OWNER_WRITE GROUP_READ WORLD_READ)
endforeach()
