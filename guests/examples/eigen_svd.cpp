// Rotations by Eigen: R = U Vᵀ of a singular value decomposition, the usual way. Built in float and in double (REAL).
#include <cutproof/plugin.h>

#include <Eigen/Dense>

static int rotations(const cutproof_host*, void*, const cutproof_array* a, const cutproof_array*, cutproof_array* r) {
  using Matrix = Eigen::Matrix<REAL, 3, 3>;
  using Rows = Eigen::Matrix<REAL, 3, 3, Eigen::RowMajor>;
  for (int64_t i = 0; i < a->rows; ++i) {
    const Matrix given = Eigen::Map<const Rows>(static_cast<const REAL*>(a->data) + 9 * i);
    const Eigen::JacobiSVD<Matrix> svd(given, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Matrix u = svd.matrixU();
    if ((u * svd.matrixV().transpose()).determinant() < 0) u.col(2) = -u.col(2);  // a reflection becomes a rotation
    Eigen::Map<Rows>(static_cast<REAL*>(r->data) + 9 * i) = u * svd.matrixV().transpose();
  }
  return 0;
}

static const cutproof_plugin plugin = {
    .size = sizeof(cutproof_plugin),
    .abi = CUTPROOF_ABI,
    .name = "Eigen's JacobiSVD",
    .real = sizeof(REAL) == 4 ? CUTPROOF_F32 : CUTPROOF_F64,
    .rotations = rotations,
};
CUTPROOF_PLUGIN(plugin)
