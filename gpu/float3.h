// Single-precision vectors and matrices of the kernels.
#pragma once
#include <cmath>

#include "gpu/block.h"

namespace cutproof::gpu {

struct alignas(16) Float4 {
  float x = 0, y = 0, z = 0, w = 0;
};

struct Float3 {
  float x = 0, y = 0, z = 0;
  CUTPROOF_BOTH float operator[](int axis) const { return axis == 0 ? x : axis == 1 ? y : z; }
};

CUTPROOF_BOTH inline Float3 operator+(Float3 a, Float3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
CUTPROOF_BOTH inline Float3 operator-(Float3 a, Float3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
CUTPROOF_BOTH inline Float3 operator*(float s, Float3 a) { return {s * a.x, s * a.y, s * a.z}; }
CUTPROOF_BOTH inline float dot(Float3 a, Float3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
CUTPROOF_BOTH inline Float3 cross(Float3 a, Float3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
CUTPROOF_BOTH inline float norm(Float3 a) { return sqrtf(dot(a, a)); }
CUTPROOF_BOTH inline Float3 xyz(Float4 a) { return {a.x, a.y, a.z}; }
CUTPROOF_BOTH inline Float4 with_w(Float3 a, float w) { return {a.x, a.y, a.z, w}; }

// Row-major.
struct Matrix3 {
  float m[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  CUTPROOF_BOTH float& operator()(int row, int column) { return m[row * 3 + column]; }
  CUTPROOF_BOTH float operator()(int row, int column) const { return m[row * 3 + column]; }
};

CUTPROOF_BOTH inline Float3 operator*(const Matrix3& a, Float3 b) {
  return {a.m[0] * b.x + a.m[1] * b.y + a.m[2] * b.z, a.m[3] * b.x + a.m[4] * b.y + a.m[5] * b.z,
          a.m[6] * b.x + a.m[7] * b.y + a.m[8] * b.z};
}

}  // namespace cutproof::gpu
