// CHOLMOD's orderings by METIS, which Debian has as a shared library alone. They answer as in a CHOLMOD that was built
// without METIS, which then takes the ordering of AMD.
#include <cholmod.h>

namespace {

int without_metis(cholmod_common* common) {
  common->status = CHOLMOD_NOT_INSTALLED;
  return 0;
}
constexpr SuiteSparse_long kNoComponents = -1;

}  // namespace

extern "C" {

int cholmod_metis(cholmod_sparse*, int*, size_t, int, int*, cholmod_common* common) { return without_metis(common); }
int cholmod_l_metis(cholmod_sparse*, SuiteSparse_long*, size_t, int, SuiteSparse_long*, cholmod_common* common) {
  return without_metis(common);
}
SuiteSparse_long cholmod_nested_dissection(cholmod_sparse*, int*, size_t, int*, int*, int*, cholmod_common* common) {
  without_metis(common);
  return kNoComponents;
}
SuiteSparse_long cholmod_l_nested_dissection(cholmod_sparse*, SuiteSparse_long*, size_t, SuiteSparse_long*,
                                             SuiteSparse_long*, SuiteSparse_long*, cholmod_common* common) {
  without_metis(common);
  return kNoComponents;
}

}  // extern "C"
