# CUTPROOF_STATIC: the programs need nothing but glibc, of version 2.34 or later, which Debian 12, Ubuntu 22.04 and RHEL 9
# have. All else is linked from the archives of Debian's packages. Included before packages are looked for.
set(CMAKE_FIND_LIBRARY_SUFFIXES .a)
set(HDF5_USE_STATIC_LIBRARIES ON)
set(Boost_USE_STATIC_LIBS ON)
set(CGAL_Boost_USE_STATIC_LIBS ON)

# Debian has no archive of fmt: cmake/static/fmt.cpp is one.
add_library(fmt::fmt INTERFACE IMPORTED GLOBAL)
# As Debian's own target has it, which other projects link the installed libraries with.
target_compile_definitions(fmt::fmt INTERFACE FMT_SHARED)

# After all packages are found: what their archives need of others, which a shared library says itself, and what takes the
# place of those that there are not.
function(cutproof_complete_archives)
  foreach(name sz aec amd camd ccolamd colamd suitesparseconfig lapack blas)
    find_library(CUTPROOF_${name} ${name} REQUIRED)
  endforeach()
  set_property(TARGET hdf5::hdf5 APPEND PROPERTY INTERFACE_LINK_LIBRARIES
    ${CUTPROOF_sz} ${CUTPROOF_aec} ZLIB::ZLIB ${CMAKE_DL_LIBS} m)
  set_property(TARGET SuiteSparse::cholmod APPEND PROPERTY INTERFACE_LINK_LIBRARIES
    ${CUTPROOF_camd} ${CUTPROOF_ccolamd} ${CUTPROOF_colamd} ${CUTPROOF_amd} ${CUTPROOF_suitesparseconfig}
    ${CUTPROOF_lapack} ${CUTPROOF_blas} -l:libgfortran.a -l:libquadmath.a -l:libgomp.a m)
  foreach(part fmt metis glibc)
    add_library(cutproof_${part} OBJECT cmake/static/${part}.cpp)
  endforeach()
  target_link_libraries(cutproof_fmt PRIVATE fmt::fmt)
  target_link_libraries(cutproof_metis PRIVATE SuiteSparse::cholmod)
endfunction()

# cutproof_link_statically(PROGRAM PART...)
function(cutproof_link_statically program)
  target_link_libraries(${program} PRIVATE cutproof_glibc ${ARGN})
  target_link_options(${program} PRIVATE -static-libstdc++ -static-libgcc -Wl,--wrap=hypot)
endfunction()

# The licences of what the program then holds, of which most have to be handed on with it.
function(cutproof_install_licences folder)
  foreach(package libstdc++-12-dev zlib1g-dev libaec-dev libblas-dev libboost1.74-dev libcgal-dev libcli11-dev libeigen3-dev
          libfmt-dev libgmp-dev libhdf5-dev libjs-three liblapack-dev libmpfr-dev libsuitesparse-dev nlohmann-json3-dev)
    file(REAL_PATH /usr/share/doc/${package}/copyright text)
    install(FILES ${text} DESTINATION ${folder} RENAME ${package})
  endforeach()
endfunction()
