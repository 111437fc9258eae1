# cutproof_add_test(NAME test PLUGIN target [OPS op...] [CASES n] [SEED n] [PARAMETERS text] [TIME_LIMIT s])
#
# Adds a CTest test that judges a plugin (cutproof/plugin.h): passed where everything holds, skipped where the plugin
# cannot run (no CUDA device), failed otherwise. OPS: rotations, components, surface, clusters, dissect, stages; all that the
# plugin has if there are none. Counterexamples are left in the current binary directory, and a report for continuous
# integration beside them (NAME.junit.xml).
function(cutproof_add_test)
  cmake_parse_arguments(test "" "NAME;PLUGIN;CASES;SEED;PARAMETERS;TIME_LIMIT" "OPS" ${ARGN})
  if(NOT test_NAME OR NOT test_PLUGIN OR test_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "cutproof_add_test(NAME test PLUGIN target [OPS op...] [CASES n] [SEED n] [PARAMETERS text] "
      "[TIME_LIMIT s]): a name and a plugin are needed, and nothing else is known. Not known: ${test_UNPARSED_ARGUMENTS}")
  endif()
  if(TARGET cutproof)
    set(program $<TARGET_FILE:cutproof>)
  else()
    find_program(CUTPROOF_EXECUTABLE cutproof HINTS ${CUTPROOF_PROGRAM_FOLDER})
    if(NOT CUTPROOF_EXECUTABLE)
      message(FATAL_ERROR "cutproof_add_test: the program cutproof is not found; set CUTPROOF_EXECUTABLE")
    endif()
    set(program ${CUTPROOF_EXECUTABLE})
  endif()
  set(options --save ${CMAKE_CURRENT_BINARY_DIR} --junit ${CMAKE_CURRENT_BINARY_DIR}/${test_NAME}.junit.xml)
  foreach(option IN ITEMS CASES SEED PARAMETERS TIME_LIMIT)
    if(DEFINED test_${option})
      string(TOLOWER ${option} name)
      string(REPLACE "_" "-" name ${name})
      list(APPEND options --${name} ${test_${option}})
    endif()
  endforeach()
  add_test(NAME ${test_NAME} COMMAND ${program} judge $<TARGET_FILE:${test_PLUGIN}> ${test_OPS} ${options})
  set_tests_properties(${test_NAME} PROPERTIES SKIP_RETURN_CODE 77)
endfunction()
