# cutproof_test(name SOURCES file... LINK library...): a program, each of whose tests is known to CTest. A folder has one,
# and its files a namespace each, so that they can be compiled in batches.
include(GoogleTest)
# Comes with the default linker, and takes a third of its time.
find_program(CUTPROOF_GOLD ld.gold)

function(cutproof_test name)
  cmake_parse_arguments(test "" "" "SOURCES;LINK" ${ARGN})
  add_executable(${name} ${test_SOURCES})
  target_link_libraries(${name} PRIVATE cutproof_model ${test_LINK} GTest::gtest GTest::gtest_main)
  # Of what a test does, nearly all is done in the libraries: its own code compiles in two thirds of the time.
  target_compile_options(${name} PRIVATE $<$<AND:$<COMPILE_LANGUAGE:CXX>,$<CONFIG:Release>>:-O0>)
  if(CUTPROOF_GOLD AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND NOT CUTPROOF_SANITIZE AND NOT CUTPROOF_LTO)
    target_link_options(${name} PRIVATE -fuse-ld=gold)
  endif()
  gtest_discover_tests(${name} DISCOVERY_TIMEOUT 60 DISCOVERY_MODE PRE_TEST PROPERTIES TIMEOUT 600)
endfunction()
