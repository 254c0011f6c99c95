# SPDX-License-Identifier: Apache-2.0
# `cmake --install`: the library, its headers, and the package that find_package(lrt) reads.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(LRT_INSTALL_CMAKEDIR ${CMAKE_INSTALL_LIBDIR}/cmake/lrt)
get_target_property(LRT_LIBRARY_TYPE lrt TYPE)

install(TARGETS lrt EXPORT lrtTargets
        LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}
        ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
        RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
if(TARGET lrt_client)  # apart, as lrt::urdf
  get_target_property(LRT_CLIENT_LIBRARY_TYPE lrt_client TYPE)
  install(TARGETS lrt_client EXPORT lrtClientTargets
          LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}
          ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
          RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
  install(EXPORT lrtClientTargets NAMESPACE lrt:: DESTINATION ${LRT_INSTALL_CMAKEDIR})
endif()
if(TARGET lrt_query)
  get_target_property(LRT_QUERY_LIBRARY_TYPE lrt_query TYPE)
  install(TARGETS lrt_query EXPORT lrtQueryTargets
          LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}
          ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
          RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
  install(EXPORT lrtQueryTargets NAMESPACE lrt:: DESTINATION ${LRT_INSTALL_CMAKEDIR})
endif()
if(TARGET lrt_urdf)  # apart, so that who does not use it does not need what it needs
  get_target_property(LRT_URDF_LIBRARY_TYPE lrt_urdf TYPE)
  install(TARGETS lrt_urdf EXPORT lrtUrdfTargets
          LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}
          ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
          RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
  install(EXPORT lrtUrdfTargets NAMESPACE lrt:: DESTINATION ${LRT_INSTALL_CMAKEDIR})
endif()
if(TARGET lrt_mqtt)  # apart, as lrt::urdf
  get_target_property(LRT_MQTT_LIBRARY_TYPE lrt_mqtt TYPE)
  install(TARGETS lrt_mqtt EXPORT lrtMqttTargets
          LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}
          ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
          RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
  install(EXPORT lrtMqttTargets NAMESPACE lrt:: DESTINATION ${LRT_INSTALL_CMAKEDIR})
endif()
if(TARGET lrt_command)
  install(TARGETS lrt_command RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
  install(FILES ${PROJECT_SOURCE_DIR}/tools/lrt/lrt.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1)
endif()
install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/lrt DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} FILES_MATCHING PATTERN *.hpp)
install(FILES ${PROJECT_SOURCE_DIR}/src/engine/terms.ttl DESTINATION ${CMAKE_INSTALL_DATADIR}/lrt)
install(EXPORT lrtTargets NAMESPACE lrt:: DESTINATION ${LRT_INSTALL_CMAKEDIR})

configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/lrtConfig.cmake.in ${PROJECT_BINARY_DIR}/cmake/lrtConfig.cmake
                              INSTALL_DESTINATION ${LRT_INSTALL_CMAKEDIR})
# Before 1.0 a minor version may break its users.
write_basic_package_version_file(${PROJECT_BINARY_DIR}/cmake/lrtConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/cmake/lrtConfig.cmake ${PROJECT_BINARY_DIR}/cmake/lrtConfigVersion.cmake
              ${PROJECT_SOURCE_DIR}/cmake/FindRedland.cmake ${PROJECT_SOURCE_DIR}/cmake/FindPCRE2.cmake
              ${PROJECT_SOURCE_DIR}/cmake/FindCppHttplib.cmake ${PROJECT_SOURCE_DIR}/cmake/FindLibwebsockets.cmake
              ${PROJECT_SOURCE_DIR}/cmake/FindTinyxml2.cmake ${PROJECT_SOURCE_DIR}/cmake/FindUrdfdom.cmake
              ${PROJECT_SOURCE_DIR}/cmake/FindMosquitto.cmake
        DESTINATION ${LRT_INSTALL_CMAKEDIR})
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})
