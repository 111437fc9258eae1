// Rotations by Eigen's geometry module: the rotation of an affine transformation. In float and in double (REAL).
#include <cutproof/plugin.h>

#include <Eigen/Geometry>

static int rotations(const cutproof_host*, void*, const cutproof_array* a, const cutproof_array*, cutproof_array* r) {
  using Rows = Eigen::Matrix<REAL, 3, 3, Eigen::RowMajor>;
  for (int64_t i = 0; i < a->rows; ++i) {
    Eigen::Transform<REAL, 3, Eigen::Affine> transform(Eigen::Transform<REAL, 3, Eigen::Affine>::Identity());
    transform.linear() = Eigen::Map<const Rows>(static_cast<const REAL*>(a->data) + 9 * i);
    Eigen::Map<Rows>(static_cast<REAL*>(r->data) + 9 * i) = transform.rotation();
  }
  return 0;
}

static const cutproof_plugin plugin = {
    .size = sizeof(cutproof_plugin),
    .abi = CUTPROOF_ABI,
    .name = "Eigen's Transform::rotation",
    .real = sizeof(REAL) == 4 ? CUTPROOF_F32 : CUTPROOF_F64,
    .rotations = rotations,
};
CUTPROOF_PLUGIN(plugin)
