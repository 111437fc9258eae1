// Rotations by Bullet's polar decomposition, as its soft bodies ask for them.
#include <LinearMath/btPolarDecomposition.h>
#include <cutproof/plugin.h>

static int rotations(const cutproof_host*, void*, const cutproof_array* a, const cutproof_array*, cutproof_array* r) {
  for (int64_t i = 0; i < a->rows; ++i) {
    const float* const m = static_cast<const float*>(a->data) + 9 * i;
    btMatrix3x3 rotation, stretch;
    polarDecompose({m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7], m[8]}, rotation, stretch);
    for (int k = 0; k < 9; ++k) static_cast<float*>(r->data)[9 * i + k] = rotation[k / 3][k % 3];
  }
  return 0;
}

static const cutproof_plugin plugin = {
    .size = sizeof(cutproof_plugin),
    .abi = CUTPROOF_ABI,
    .name = "Bullet's polar decomposition",
    .real = CUTPROOF_F32,
    .rotations = rotations,
};
CUTPROOF_PLUGIN(plugin)
