# How everything in this project is compiled. These are options of folders, not of targets, so that a project that links
# our libraries keeps its own.
add_compile_options(
  # No fused multiply-add: the same source gives the same bits on every machine, and on host and device (--fmad=false).
  "$<$<COMPILE_LANGUAGE:C,CXX>:-Wall;-Wextra;-Wshadow;-Wconversion;-Wno-sign-conversion;-ffp-contract=off>")
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
  # Says of every text = "x" that it may overlap itself (GCC bug 105329).
  add_compile_options("$<$<COMPILE_LANGUAGE:CXX>:-Wno-restrict>")
endif()
if(CUTPROOF_HAS_CUDA)
  add_compile_options(
    # --fmad=false as -ffp-contract=off above, for the same bits.
    "$<$<COMPILE_LANGUAGE:CUDA>:--fmad=false;--expt-relaxed-constexpr;-Xcompiler=-Wall,-ffp-contract=off>")
endif()
if(CUTPROOF_WERROR)
  add_compile_options("$<$<COMPILE_LANGUAGE:C,CXX>:-Werror>")
endif()
if(CUTPROOF_SANITIZE)
  add_compile_options(-fsanitize=${CUTPROOF_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  add_link_options(-fsanitize=${CUTPROOF_SANITIZE})
endif()
if(CUTPROOF_LTO)
  # One class with two definitions in one program (ODR) is seen only where all of it is put together.
  add_compile_options("$<$<COMPILE_LANGUAGE:C,CXX>:-flto=auto>")
  add_link_options(-flto=auto -Wodr -Werror=odr -Wlto-type-mismatch -Werror=lto-type-mismatch)
endif()

# cutproof_optimise_little(TARGET...): targets that call, print and write, and that no figure times. Their own code
# compiles in two thirds of the time.
function(cutproof_optimise_little)
  foreach(target IN LISTS ARGN)
    target_compile_options(${target} PRIVATE $<$<AND:$<COMPILE_LANGUAGE:CXX>,$<CONFIG:Release>>:-O1>)
  endforeach()
endfunction()
