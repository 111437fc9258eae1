# cutproof_test(name LIBRARIES...): an executable from name.cpp in the current folder, each of its tests known to CTest.
include(GoogleTest)
function(cutproof_test name)
  add_executable(${name} ${name}.cpp)
  target_link_libraries(${name} PRIVATE cutproof_options ${ARGN} GTest::gtest GTest::gtest_main)
  gtest_discover_tests(${name} DISCOVERY_TIMEOUT 60 DISCOVERY_MODE PRE_TEST PROPERTIES TIMEOUT 600)
endfunction()
