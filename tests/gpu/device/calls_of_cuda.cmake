# Fails if one of LIBRARIES calls a function of CUDA's runtime that is not among CALLS.
execute_process(COMMAND ${NM} --undefined-only ${LIBRARIES} OUTPUT_VARIABLE symbols RESULT_VARIABLE status)
if(NOT status EQUAL 0)
  message(FATAL_ERROR "${NM} cannot read ${LIBRARIES}")
endif()
# These do not fail, or are done once in a process by what the compiler writes.
set(known ${CALLS} cudaGetErrorName cudaGetErrorString __cudaGetKernel __cudaPopCallConfiguration
  __cudaPushCallConfiguration __cudaRegisterFatBinary __cudaRegisterFatBinaryEnd __cudaRegisterFunction
  __cudaInitModule __cudaRegisterVar __cudaUnregisterFatBinary)
string(REGEX MATCHALL " U [_]*cuda[A-Za-z0-9_]+" found "${symbols}")
list(TRANSFORM found REPLACE "^ U " "")
list(REMOVE_DUPLICATES found)
list(LENGTH found count)
if(count LESS 20)
  message(FATAL_ERROR "only ${count} calls of CUDA were found in ${LIBRARIES}")
endif()
list(REMOVE_ITEM found ${known})
if(found)
  message(FATAL_ERROR "device_failures_test does not take over: ${found}")
endif()
