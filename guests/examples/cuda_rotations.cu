// Rotations on a CUDA device in single precision: 20 turns of a quaternion from the previous rotation towards the best
// one (Müller et al. 2016, "A robust method to extract the rotational part of deformations"), which is fast and not
// always there after 20 turns.
#include <cuda_runtime.h>
#include <cutproof/plugin.h>

__global__ void extract(int64_t n, const float* a, const float* previous, float* r) {
  const int64_t i = blockIdx.x * int64_t{blockDim.x} + threadIdx.x;
  if (i >= n) return;
  float m[9];
  for (int k = 0; k < 9; ++k) m[k] = previous[9 * i + k];
  const float* const s = a + 9 * i;
  for (int turn = 0; turn < 20; ++turn) {
    // ω = Σ rⱼ × aⱼ / (|Σ rⱼ · aⱼ| + ε) over columns j.
    float w[3] = {0, 0, 0}, trace = 0;
    for (int j = 0; j < 3; ++j) {
      w[0] += m[3 + j] * s[6 + j] - m[6 + j] * s[3 + j];
      w[1] += m[6 + j] * s[j] - m[j] * s[6 + j];
      w[2] += m[j] * s[3 + j] - m[3 + j] * s[j];
      trace += m[j] * s[j] + m[3 + j] * s[3 + j] + m[6 + j] * s[6 + j];
    }
    const float scale = 1 / (fabsf(trace) + 1e-9f);
    for (float& each : w) each *= scale;
    const float angle = sqrtf(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
    if (!(angle > 1e-9f)) break;
    // Turned about ω by this angle (Rodrigues), column by column.
    const float x = w[0] / angle, y = w[1] / angle, z = w[2] / angle, c = cosf(angle), si = sinf(angle);
    for (int j = 0; j < 3; ++j) {
      const float p = m[j], q = m[3 + j], t = m[6 + j], along = (x * p + y * q + z * t) * (1 - c);
      m[j] = p * c + (y * t - z * q) * si + x * along;
      m[3 + j] = q * c + (z * p - x * t) * si + y * along;
      m[6 + j] = t * c + (x * q - y * p) * si + z * along;
    }
  }
  for (int k = 0; k < 9; ++k) r[9 * i + k] = m[k];
}

static int rotations(const cutproof_host* host, void*, const cutproof_array* a, const cutproof_array* previous,
                     cutproof_array* r) {
  if (a->rows == 0) return 0;
  const auto blocks = static_cast<unsigned>((a->rows + 127) / 128);
  extract<<<blocks, 128, 0, static_cast<cudaStream_t>(host->stream)>>>(a->rows, static_cast<const float*>(a->data),
                                                                       static_cast<const float*>(previous->data),
                                                                       static_cast<float*>(r->data));
  return cudaGetLastError() == cudaSuccess ? 0 : 1;
}

static const cutproof_plugin plugin = {
    .size = sizeof(cutproof_plugin),
    .abi = CUTPROOF_ABI,
    .name = "Mueller's rotations",
    .device = CUTPROOF_CUDA,
    .real = CUTPROOF_F32,
    .rotations = rotations,
};
CUTPROOF_PLUGIN(plugin)
