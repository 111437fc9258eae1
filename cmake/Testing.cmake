# cutproof_test(path LIBRARIES...): an executable from path.cpp, named as the file is, each of its tests known to CTest.
include(GoogleTest)
# Comes with the default linker, and takes a third of its time.
find_program(CUTPROOF_GOLD ld.gold)

function(cutproof_test path)
  get_filename_component(name ${path} NAME)
  add_executable(${name} ${path}.cpp)
  target_link_libraries(${name} PRIVATE cutproof_model ${ARGN} GTest::gtest GTest::gtest_main)
  # Of what a test does, nearly all is done in the libraries.
  cutproof_optimise_little(${name})
  if(CUTPROOF_GOLD AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND NOT CUTPROOF_SANITIZE AND NOT CUTPROOF_LTO)
    target_link_options(${name} PRIVATE -fuse-ld=gold)
  endif()
  gtest_discover_tests(${name} DISCOVERY_TIMEOUT 60 DISCOVERY_MODE PRE_TEST PROPERTIES TIMEOUT 600)
endfunction()
