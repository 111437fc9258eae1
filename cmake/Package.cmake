# cpack -G DEB, cpack -G TGZ: whatever the install() rules of all folders install. Included last, after all of these.
set(CPACK_PACKAGE_NAME cutproof)
set(CPACK_PACKAGE_VENDOR "cutproof contributors")
set(CPACK_PACKAGE_CONTACT "cutproof contributors")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "validation toolkit for real-time soft-body dissection")
set(CPACK_PACKAGE_DESCRIPTION
"Cuts bodies made of shape matching clusters and certifies every frame of a
simulator that does: no ghost forces, no isolated clusters, a skin that shows
what is simulated, a motion that is one of those that could be.

Holds the program, example scenes, and the libraries with their headers and
a CMake package. The sources are MIT; the program links GPL code and is under
the GPL as a binary.")
set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
set(CPACK_PACKAGE_CHECKSUM SHA256)
set(CPACK_STRIP_FILES ON)
set(CPACK_VERBATIM_VARIABLES ON)
string(TOLOWER "${CMAKE_SYSTEM_NAME}-${CMAKE_SYSTEM_PROCESSOR}" cutproof_system)
set(CPACK_PACKAGE_FILE_NAME cutproof-${PROJECT_VERSION}-${cutproof_system})

set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
# The libraries that the programs link, from dpkg-shlibdeps.
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
# What a project needs to link our libraries, and the programs do not.
set(CPACK_DEBIAN_PACKAGE_SUGGESTS
  "cmake (>= 3.25), g++, libfmt-dev, libhdf5-dev, libboost-context-dev, libcgal-dev, libsuitesparse-dev")
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)

# Of a source package nothing is made here: the repository is that.
set(CPACK_SOURCE_GENERATOR "")
set(CPACK_GENERATOR "TGZ;DEB")
include(CPack)
