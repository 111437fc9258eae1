// Vectors and matrices of kernels, in single precision. Rotations are also measured in double, so their parts are
// templates (docs/results/accuracy.md, Rotations).
#pragma once
#include <cmath>
#include <cstring>
#include <type_traits>

#include "gpu/launch/block.h"

namespace cutproof::gpu {

struct alignas(16) Float4 {
  float x = 0, y = 0, z = 0, w = 0;
};

template <class Real>
struct Vector3 {
  Real x = 0, y = 0, z = 0;
  CUTPROOF_BOTH Real operator[](int axis) const { return axis == 0 ? x : axis == 1 ? y : z; }
  CUTPROOF_BOTH friend Vector3 operator+(Vector3 a, Vector3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  CUTPROOF_BOTH friend Vector3 operator-(Vector3 a, Vector3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  CUTPROOF_BOTH friend Vector3 operator*(Real s, Vector3 a) { return {s * a.x, s * a.y, s * a.z}; }
};
using Float3 = Vector3<float>;

template <class Real>
CUTPROOF_BOTH inline Real dot(Vector3<Real> a, Vector3<Real> b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class Real>
CUTPROOF_BOTH inline Vector3<Real> cross(Vector3<Real> a, Vector3<Real> b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
CUTPROOF_BOTH inline float root(float a) { return sqrtf(a); }
CUTPROOF_BOTH inline double root(double a) { return sqrt(a); }
template <class Real>
CUTPROOF_BOTH inline Real norm(Vector3<Real> a) {
  return root(dot(a, a));
}
CUTPROOF_BOTH inline Float3 xyz(Float4 a) { return {a.x, a.y, a.z}; }
CUTPROOF_BOTH inline Float4 with_w(Float3 a, float w) { return {a.x, a.y, a.z, w}; }

// Row-major.
template <class Real>
struct Matrix3x3 {
  Real m[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  CUTPROOF_BOTH Real& operator()(int row, int column) { return m[row * 3 + column]; }
  CUTPROOF_BOTH Real operator()(int row, int column) const { return m[row * 3 + column]; }
  CUTPROOF_BOTH friend Vector3<Real> operator*(const Matrix3x3& a, Vector3<Real> b) {
    return {a.m[0] * b.x + a.m[1] * b.y + a.m[2] * b.z, a.m[3] * b.x + a.m[4] * b.y + a.m[5] * b.z,
            a.m[6] * b.x + a.m[7] * b.y + a.m[8] * b.z};
  }
};
using Matrix3 = Matrix3x3<float>;

// Memory that neither this launch nor the previous, possibly overlapping one (launcher.h) writes. So the compiler may
// keep its value, unlike other memory, which any store could change.
template <class T>
CUTPROOF_DEVICE inline T constant(const T* at) {
  static_assert(std::is_trivially_copyable_v<T> && sizeof(T) % 4 == 0);
#if defined(__CUDA_ARCH__)
  using Word = std::conditional_t<alignof(T) >= 16, uint4, unsigned>;
  constexpr int kWords = static_cast<int>(sizeof(T) / sizeof(Word));
  Word words[kWords];
#pragma unroll
  for (int k = 0; k < kWords; ++k) words[k] = __ldg(reinterpret_cast<const Word*>(at) + k);
  T value;
  memcpy(&value, words, sizeof(T));
  return value;
#else
  return *at;
#endif
}

}  // namespace cutproof::gpu
