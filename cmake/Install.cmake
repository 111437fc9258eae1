# What other projects link: targets cutproof::NAME, in the build tree (add_subdirectory) and installed
# (find_package(cutproof CONFIG COMPONENTS NAME...)). Headers are included as <cutproof/FOLDER/...>.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

# NAME TARGET [FOLDER]: a component, its library, and the folder whose headers are installed with it (once for each
# folder). A component comes after those that it links.
set(cutproof_components
  "plugin cutproof_plugin"
  "model cutproof_model model"
  "io cutproof_io"
  "reference cutproof_reference reference_cpu"
  "host_kernels cutproof_host gpu"
  "oracles cutproof_oracles oracles"
  "surface_oracles cutproof_surface_oracles"
  "comparison cutproof_comparison"
  "relations cutproof_relations")

# What the installed libraries need of others, by target: what an installation says to find it. The empty ones are headers
# alone that only our own sources include.
set(needs_Eigen3::Eigen "")
set(needs_nlohmann_json::nlohmann_json "")
set(needs_fmt::fmt "find_dependency(fmt)")
set(needs_Threads::Threads "find_dependency(Threads)")
set(needs_Boost::context "find_dependency(Boost 1.74 COMPONENTS context)")
set(needs_hdf5::hdf5 "find_dependency(HDF5 COMPONENTS C)")
set(needs_ZLIB::ZLIB "find_dependency(ZLIB)")
set(needs_CGAL::CGAL "find_dependency(CGAL 5.5)")
foreach(part cholmod spqr btf)
  set(needs_SuiteSparse::${part} "include(\${CMAKE_CURRENT_LIST_DIR}/SuiteSparse.cmake)")
endforeach()

set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/cutproof)
set(known "")
foreach(component IN LISTS cutproof_components)
  string(REPLACE " " ";" folders "${component}")
  list(POP_FRONT folders name target)
  list(APPEND known ${name})
  set(component_of_${target} ${name})
  if(NOT TARGET cutproof::${name})
    add_library(cutproof::${name} ALIAS ${target})
  endif()
  if(NOT CUTPROOF_INSTALL)
    continue()
  endif()

  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name})
  install(TARGETS ${target} EXPORT cutproof_${name}
    ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}/cutproof)
  foreach(folder IN LISTS folders)
    install(DIRECTORY ${PROJECT_SOURCE_DIR}/${folder}/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/cutproof/${folder}
      FILES_MATCHING PATTERN "*.h" PATTERN "*.cuh" PATTERN "*.inc")
  endforeach()

  # From what the library links follows what has to be found first.
  set(find "")
  set(links "")
  get_target_property(all_links ${target} INTERFACE_LINK_LIBRARIES)
  foreach(link IN LISTS all_links)
    string(REGEX REPLACE "^\\$<LINK_ONLY:(.*)>$" "\\1" linked "${link}")
    if(NOT linked)  # no links at all
      continue()
    elseif(DEFINED component_of_${linked})
      list(APPEND find "cutproof_find_component(${component_of_${linked}})")
    elseif(NOT DEFINED needs_${linked})
      message(FATAL_ERROR "${target} links ${linked}, and cmake/Install.cmake does not say what an installation is to find for that.")
    elseif(needs_${linked} STREQUAL "")
      continue()
    else()
      list(APPEND find "${needs_${linked}}")
    endif()
    list(APPEND links "${link}")
  endforeach()
  set_target_properties(${target} PROPERTIES INTERFACE_LINK_LIBRARIES "${links}")
  list(REMOVE_DUPLICATES find)
  list(JOIN find "\n" find)
  file(CONFIGURE OUTPUT package/cutproof-${name}.cmake CONTENT [[
@find@
include(${CMAKE_CURRENT_LIST_DIR}/cutproof-@name@-targets.cmake)
]] @ONLY)
  install(EXPORT cutproof_${name} NAMESPACE cutproof:: FILE cutproof-${name}-targets.cmake DESTINATION ${package_folder})
  install(FILES ${CMAKE_CURRENT_BINARY_DIR}/package/cutproof-${name}.cmake DESTINATION ${package_folder})
endforeach()

if(CUTPROOF_INSTALL)
  list(JOIN known " " known)
  configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/cutproof-config.cmake.in
    ${CMAKE_CURRENT_BINARY_DIR}/package/cutproof-config.cmake INSTALL_DESTINATION ${package_folder}
    NO_SET_AND_CHECK_MACRO)
  write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/package/cutproof-config-version.cmake
    COMPATIBILITY SameMinorVersion)
  install(FILES
    ${CMAKE_CURRENT_BINARY_DIR}/package/cutproof-config.cmake
    ${CMAKE_CURRENT_BINARY_DIR}/package/cutproof-config-version.cmake
    ${CMAKE_CURRENT_LIST_DIR}/SuiteSparse.cmake
    ${CMAKE_CURRENT_LIST_DIR}/CutproofTest.cmake
    DESTINATION ${package_folder})
  if(CUTPROOF_PROGRAM)
    install(TARGETS cutproof)
    # The program reads no file by itself: scenes are for people to begin with.
    install(DIRECTORY ${PROJECT_SOURCE_DIR}/fixtures/scenes DESTINATION ${CMAKE_INSTALL_DATADIR}/cutproof
      FILES_MATCHING PATTERN "*.json")
    install(FILES ${PROJECT_SOURCE_DIR}/fixtures/scene.schema.json DESTINATION ${CMAKE_INSTALL_DATADIR}/cutproof)
    install(DIRECTORY ${PROJECT_SOURCE_DIR}/docs/reference/schemas DESTINATION ${CMAKE_INSTALL_DATADIR}/cutproof)
    install(DIRECTORY ${PROJECT_SOURCE_DIR}/ci/cluster DESTINATION ${CMAKE_INSTALL_DATADIR}/cutproof
      USE_SOURCE_PERMISSIONS)
    install(FILES ${CMAKE_CURRENT_LIST_DIR}/copyright ${PROJECT_SOURCE_DIR}/LICENSE ${PROJECT_SOURCE_DIR}/README.md
      ${PROJECT_SOURCE_DIR}/CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
    install(PROGRAMS ${PROJECT_SOURCE_DIR}/ci/judge.sh DESTINATION ${CMAKE_INSTALL_DATADIR}/cutproof)
    if(CUTPROOF_STATIC)
      cutproof_install_licences(${CMAKE_INSTALL_DOCDIR}/licences)
    endif()
  endif()
endif()
