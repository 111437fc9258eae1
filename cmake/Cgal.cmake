# CGAL's package declares BUILD_TESTING with OFF as its default, which would switch off the tests of a project that takes
# this one in.
get_property(known CACHE BUILD_TESTING PROPERTY TYPE)
find_package(CGAL 5.5 REQUIRED)
if(NOT known)
  unset(BUILD_TESTING CACHE)
endif()
