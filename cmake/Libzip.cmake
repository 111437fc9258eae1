# Debian's package for CMake wants libzip's programs as well, which nobody needs. Target: Libzip::zip.
if(TARGET Libzip::zip)
  return()
endif()
find_library(LIBZIP_LIBRARY zip REQUIRED)
find_path(LIBZIP_INCLUDE zip.h REQUIRED)
add_library(Libzip::zip UNKNOWN IMPORTED GLOBAL)
set_target_properties(Libzip::zip PROPERTIES IMPORTED_LOCATION ${LIBZIP_LIBRARY})
target_include_directories(Libzip::zip SYSTEM INTERFACE ${LIBZIP_INCLUDE})
