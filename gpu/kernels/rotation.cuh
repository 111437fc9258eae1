// The rotation of one cluster: argmax over rotations R of tr(Rᵀ A), by Newton's method. Kernels use single precision;
// double exists to measure the cost of precision. Other measured methods: benchmarks/rotation_algorithms.cuh; their
// worth: docs/results/accuracy.md, Rotations.
#pragma once
#include <limits>

#include "gpu/launch/block.h"
#include "gpu/state/float3.h"

namespace cutproof::gpu {

template <class Real>
struct Rotation {
  Matrix3x3<Real> r;
  bool degenerate = false;  // the answer was not unique, or A not finite
};

template <class Real>
struct Quaternion {
  Real w, x, y, z;
};

// The start of Newton's method, as quaternion and as matrix.
template <class Real>
struct Start {
  Quaternion<Real> q;
  Matrix3x3<Real> r;
};

namespace rotation_detail {

CUTPROOF_BOTH inline float absolute(float a) { return fabsf(a); }
CUTPROOF_BOTH inline double absolute(double a) { return fabs(a); }
CUTPROOF_BOTH inline float greater_of(float a, float b) { return fmaxf(a, b); }
CUTPROOF_BOTH inline double greater_of(double a, double b) { return fmax(a, b); }
CUTPROOF_BOTH inline float with_sign(float size, float sign) { return copysignf(size, sign); }
CUTPROOF_BOTH inline double with_sign(double size, double sign) { return copysign(size, sign); }
CUTPROOF_BOTH inline float times_power_of_two(float a, int exponent) { return ldexpf(a, exponent); }
CUTPROOF_BOTH inline double times_power_of_two(double a, int exponent) { return ldexp(a, exponent); }
// The exponent for which |a| / 2^exponent lies in [1/2, 1).
CUTPROOF_BOTH inline int exponent_of(float a) {
  int exponent = 0;
  static_cast<void>(frexpf(a, &exponent));
  return exponent;
}
CUTPROOF_BOTH inline int exponent_of(double a) {
  int exponent = 0;
  static_cast<void>(frexp(a, &exponent));
  return exponent;
}

CUTPROOF_BOTH inline unsigned bits_of(float a) {
  unsigned bits;
  memcpy(&bits, &a, sizeof bits);
  return bits;
}
CUTPROOF_BOTH inline float float_of(unsigned bits) {
  float a;
  memcpy(&a, &bits, sizeof a);
  return a;
}

template <class Real>
inline constexpr bool kSingle = sizeof(Real) == sizeof(float);
// A threshold at the level of rounding, given for single precision and scaled for double. `power`: the power in which
// the rounding enters.
template <class Real>
consteval Real rounding(double in_single, int power = 1) {
  for (int k = 0; k < power; ++k) in_single *= kSingle<Real> ? 1 : 0x1p-29;
  return static_cast<Real>(in_single);
}

template <class Real>
CUTPROOF_BOTH inline Real dot(Quaternion<Real> a, Quaternion<Real> b) {
  return a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class Real>
CUTPROOF_BOTH inline Quaternion<Real> operator*(Real s, Quaternion<Real> a) {
  return {s * a.w, s * a.x, s * a.y, s * a.z};
}
template <class Real>
CUTPROOF_BOTH inline Quaternion<Real> operator+(Quaternion<Real> a, Quaternion<Real> b) {
  return {a.w + b.w, a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class Real>
CUTPROOF_BOTH inline Quaternion<Real> operator*(Quaternion<Real> a, Quaternion<Real> b) {
  return {a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
          a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}
template <class Real>
CUTPROOF_BOTH inline Quaternion<Real> normalized(Quaternion<Real> a) {
  return (1 / root(dot(a, a))) * a;
}

// For any q but zero. Dividing by |q|² here, instead of q by |q| before, saves a third of the error in RᵀR.
template <class Real>
CUTPROOF_BOTH inline Matrix3x3<Real> matrix_of(Quaternion<Real> q) {
  const Real s = 2 / dot(q, q);
  Matrix3x3<Real> r;
  r(0, 0) = 1 - s * (q.y * q.y + q.z * q.z);
  r(0, 1) = s * (q.x * q.y - q.w * q.z);
  r(0, 2) = s * (q.x * q.z + q.w * q.y);
  r(1, 0) = s * (q.x * q.y + q.w * q.z);
  r(1, 1) = 1 - s * (q.x * q.x + q.z * q.z);
  r(1, 2) = s * (q.y * q.z - q.w * q.x);
  r(2, 0) = s * (q.x * q.z - q.w * q.y);
  r(2, 1) = s * (q.y * q.z + q.w * q.x);
  r(2, 2) = 1 - s * (q.x * q.x + q.y * q.y);
  return r;
}

// Shepperd 1978: divides by the largest of the four squares, so half turns lose no digits.
template <class Real>
CUTPROOF_BOTH inline Quaternion<Real> quaternion_of(const Matrix3x3<Real>& r) {
  const Real trace = r(0, 0) + r(1, 1) + r(2, 2);
  Quaternion<Real> q;
  if (trace >= r(0, 0) && trace >= r(1, 1) && trace >= r(2, 2)) {
    q = {1 + trace, r(2, 1) - r(1, 2), r(0, 2) - r(2, 0), r(1, 0) - r(0, 1)};
  } else if (r(0, 0) >= r(1, 1) && r(0, 0) >= r(2, 2)) {
    q = {r(2, 1) - r(1, 2), 1 + 2 * r(0, 0) - trace, r(0, 1) + r(1, 0), r(2, 0) + r(0, 2)};
  } else if (r(1, 1) >= r(2, 2)) {
    q = {r(0, 2) - r(2, 0), r(0, 1) + r(1, 0), 1 + 2 * r(1, 1) - trace, r(1, 2) + r(2, 1)};
  } else {
    q = {r(1, 0) - r(0, 1), r(2, 0) + r(0, 2), r(1, 2) + r(2, 1), 1 + 2 * r(2, 2) - trace};
  }
  return normalized(q);
}

template <class Real>
CUTPROOF_BOTH inline Vector3<Real> column(const Matrix3x3<Real>& a, int k) {
  return {a(0, k), a(1, k), a(2, k)};
}

// Scales A exactly, by a power of two, so that its greatest entry lies in [1/2, 1). So neither tiny nor huge clusters
// underflow or overflow. False if A is zero or not finite.
template <class Real>
CUTPROOF_BOTH inline bool scale_to_one(Matrix3x3<Real>& a) {
  if constexpr (kSingle<Real>) {
    // As bits, sizes have their order, with non-finite numbers above all. The maximum is taken by pairs: in sequence,
    // each step would wait for the previous one.
    unsigned size[9];
    for (int k = 0; k < 9; ++k) size[k] = bits_of(a.m[k]) & 0x7fffffffu;
    const auto greater = [](unsigned x, unsigned y) { return x > y ? x : y; };
    const unsigned greatest = greater(greater(greater(size[0], size[1]), greater(size[2], size[3])),
                                      greater(greater(greater(size[4], size[5]), greater(size[6], size[7])), size[8]));
    const unsigned exponent = greatest >> 23;
    // Here the number and its reciprocal are normal, and nothing that matters underflows.
    if (exponent >= 64 && exponent <= 190) {
      const float factor = float_of((253u - exponent) << 23);
      for (int k = 0; k < 9; ++k) a.m[k] = a.m[k] * factor;
      return true;
    }
  }
  Real greatest = 0;
  bool finite = true;
  for (int k = 0; k < 9; ++k) {
    const Real size = absolute(a.m[k]);
    finite = finite && size <= std::numeric_limits<Real>::max();  // false for NaN
    greatest = greater_of(greatest, size);
  }
  if (!finite || greatest == 0) return false;
  const int exponent = exponent_of(greatest);
  // Two factors, because neither 2^148 in single nor 2^1073 in double precision exists; denormals need them.
  const Real first = times_power_of_two(Real(1), -exponent / 2),
             second = times_power_of_two(Real(1), -exponent - -exponent / 2);
  for (int k = 0; k < 9; ++k) a.m[k] = a.m[k] * first * second;
  return true;
}

// Makes the off-diagonal entry `pq` of a symmetric matrix vanish; of the two rotations the one with the smaller angle.
// Returns the angle's tangent. No branch, and no overflow for entries up to 1e18.
template <class Real>
CUTPROOF_BOTH inline Real jacobi_tangent(Real pp, Real qq, Real pq) {
  const Real difference = qq - pp;
  const Real denominator = absolute(difference) + root(difference * difference + 4 * pq * pq);
  return denominator > 0 ? with_sign(2, difference) * pq / denominator : 0;
}

template <int P, int Q, class Real>
CUTPROOF_BOTH inline void annihilate(Real (&n)[4][4], Real (&v)[4][4]) {
  constexpr int kR = P == 0 ? (Q == 1 ? 2 : 1) : 0;  // the other two
  constexpr int kS = 6 - P - Q - kR;
  const Real t = jacobi_tangent(n[P][P], n[Q][Q], n[P][Q]);
  const Real c = 1 / root(1 + t * t), s = t * c;
  n[P][P] -= t * n[P][Q];
  n[Q][Q] += t * n[P][Q];
  n[P][Q] = n[Q][P] = 0;
  const Real rp = n[kR][P], rq = n[kR][Q], sp = n[kS][P], sq = n[kS][Q];
  n[kR][P] = n[P][kR] = c * rp - s * rq;
  n[kR][Q] = n[Q][kR] = s * rp + c * rq;
  n[kS][P] = n[P][kS] = c * sp - s * sq;
  n[kS][Q] = n[Q][kS] = s * sp + c * sq;
  for (int k = 0; k < 4; ++k) {
    const Real p = v[k][P], q = v[k][Q];
    v[k][P] = c * p - s * q;
    v[k][Q] = s * p + c * q;
  }
}

// Davenport's matrix: with q the unit quaternion of R, tr(Rᵀ A) = qᵀ N q (Horn 1987).
template <class Real>
CUTPROOF_BOTH inline void davenport(const Matrix3x3<Real>& a, Real (&n)[4][4]) {
  n[0][0] = a(0, 0) + a(1, 1) + a(2, 2);
  n[1][1] = a(0, 0) - a(1, 1) - a(2, 2);
  n[2][2] = a(1, 1) - a(0, 0) - a(2, 2);
  n[3][3] = a(2, 2) - a(0, 0) - a(1, 1);
  n[0][1] = n[1][0] = a(2, 1) - a(1, 2);
  n[0][2] = n[2][0] = a(0, 2) - a(2, 0);
  n[0][3] = n[3][0] = a(1, 0) - a(0, 1);
  n[1][2] = n[2][1] = a(0, 1) + a(1, 0);
  n[1][3] = n[3][1] = a(0, 2) + a(2, 0);
  n[2][3] = n[3][2] = a(1, 2) + a(2, 1);
}

// Eigenvalues nearer than this, relative to the greatest, count as one. The sweeps' rounding is below a third of it.
// Any vector of the joint eigenspace costs at most this much of the objective.
template <class Real>
inline constexpr Real kSameEigenvalue = rounding<Real>(0x1p-21);
// With one sweep fewer, a few of 40,000 matrices of a hard case are wrong in either precision.
template <class Real>
inline constexpr int kJacobiSweeps = kSingle<Real> ? 4 : 5;

template <class Real>
CUTPROOF_BOTH inline Rotation<Real> by_jacobi4(const Matrix3x3<Real>& a, const Matrix3x3<Real>& previous) {
  Real n[4][4];
  davenport(a, n);
  Real v[4][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}};
  for (int sweep = 0; sweep < kJacobiSweeps<Real>; ++sweep) {
    annihilate<0, 1>(n, v);
    annihilate<2, 3>(n, v);
    annihilate<0, 2>(n, v);
    annihilate<1, 3>(n, v);
    annihilate<0, 3>(n, v);
    annihilate<1, 2>(n, v);
  }
  Real top = n[0][0];
  Quaternion<Real> q = {v[0][0], v[1][0], v[2][0], v[3][0]};
  for (int k = 1; k < 4; ++k) {
    const bool better = n[k][k] > top;
    top = better ? n[k][k] : top;
    q = {better ? v[0][k] : q.w, better ? v[1][k] : q.x, better ? v[2][k] : q.y, better ? v[3][k] : q.z};
  }
  Rotation<Real> result;
  int dimension = 0;
  for (int k = 0; k < 4; ++k) dimension += top - n[k][k] <= kSameEigenvalue<Real> * top;
  result.degenerate = dimension > 1;
  if (result.degenerate) {
    // Of all unit vectors of the eigenspace, the nearest to the previous rotation.
    const Quaternion<Real> before = quaternion_of(previous);
    Quaternion<Real> projected = {0, 0, 0, 0};
    for (int k = 0; k < 4; ++k) {
      if (top - n[k][k] > kSameEigenvalue<Real> * top) continue;
      const Quaternion<Real> axis = {v[0][k], v[1][k], v[2][k], v[3][k]};
      projected = projected + dot(axis, before) * axis;
    }
    // A previous rotation orthogonal to all answers is equally far from each.
    if (dot(projected, projected) > rounding<Real>(1e-8)) q = projected;
  }
  result.r = matrix_of(q);
  return result;
}

// The objective at R, after a small further rotation ω in the rotated frame. With B = Rᵀ A it is tr B + g·ω - ½ ωᵀ H ω
// + …, where g is the axial vector of B and H = tr(B) I - sym(B).
template <class Real>
struct Expansion {
  Vector3<Real> g;
  Real h00, h11, h22, h01, h02, h12;
  Real c00, c01, c02, c11, c12, c22;  // cofactors of H
  Real determinant;
  // determinant · H⁻¹ g
  CUTPROOF_BOTH Vector3<Real> scaled_step() const {
    return {c00 * g.x + c01 * g.y + c02 * g.z, c01 * g.x + c11 * g.y + c12 * g.z, c02 * g.x + c12 * g.y + c22 * g.z};
  }
};

template <class Real>
CUTPROOF_BOTH inline Expansion<Real> expand(const Matrix3x3<Real>& a, const Matrix3x3<Real>& r) {
  Matrix3x3<Real> b;
  for (int row = 0; row < 3; ++row) {
    for (int k = 0; k < 3; ++k) b(row, k) = gpu::dot(column(r, row), column(a, k));
  }
  Expansion<Real> e;
  e.g = {b(2, 1) - b(1, 2), b(0, 2) - b(2, 0), b(1, 0) - b(0, 1)};
  e.h00 = b(1, 1) + b(2, 2);
  e.h11 = b(0, 0) + b(2, 2);
  e.h22 = b(0, 0) + b(1, 1);
  e.h01 = -Real(0.5) * (b(0, 1) + b(1, 0));
  e.h02 = -Real(0.5) * (b(0, 2) + b(2, 0));
  e.h12 = -Real(0.5) * (b(1, 2) + b(2, 1));
  e.c00 = e.h11 * e.h22 - e.h12 * e.h12;
  e.c01 = e.h02 * e.h12 - e.h01 * e.h22;
  e.c02 = e.h01 * e.h12 - e.h02 * e.h11;
  e.c11 = e.h00 * e.h22 - e.h02 * e.h02;
  e.c12 = e.h01 * e.h02 - e.h00 * e.h12;
  e.c22 = e.h00 * e.h11 - e.h01 * e.h01;
  e.determinant = e.h00 * e.c00 + e.h01 * e.c01 + e.h02 * e.c02;
  return e;
}

// q rotated further by ω in its own frame, through Cayley's map; not of unit length.
template <class Real>
CUTPROOF_BOTH inline Quaternion<Real> turned(Quaternion<Real> q, Vector3<Real> omega) {
  return q * Quaternion<Real>{1, Real(0.5) * omega.x, Real(0.5) * omega.y, Real(0.5) * omega.z};
}

// Newton's method from the previous rotation where it provably finds the best one, else by_jacobi4. At a stationary
// point B is symmetric with eigenvalues b1, b2, b3, and H has the eigenvalues bi + bj. Only at the greatest maximum are
// all positive, because N's other eigenvalues are lower by 2 (bi + bj). So a step below 1e-3 from a point where H is
// safely positive ends there. The objective's remaining error is below ½ |ω|⁴ / λ, 5e-8. λ >= 1e-5 is the least
// eigenvalue that the bound on the determinant admits. In double the step is 5e-6, which leaves 4e-17.
template <class Real>
inline constexpr Real kLastSquare = static_cast<Real>(kSingle<Real> ? 1e-6 : 3e-11);
template <class Real>
CUTPROOF_BOTH inline Rotation<Real> by_newton(const Matrix3x3<Real>& a, const Matrix3x3<Real>& previous,
                                              const Start<Real>& start) {
  Quaternion<Real> q = start.q;
  Matrix3x3<Real> r = start.r;
  for (int iteration = 0; iteration < 5; ++iteration) {
    const Expansion<Real> e = expand(a, r);
    const Real trace = e.h00 + e.h11 + e.h22;
    const bool positive = e.h00 > 0 && e.c22 > 0 && e.determinant > Real(1e-5) * trace * trace * trace;
    if (!positive) break;
    const Vector3<Real> omega = (1 / e.determinant) * e.scaled_step();
    q = turned(q, omega);
    r = matrix_of(q);  // from q of any length; if a long step made it NaN, the conditions below are false
    if (gpu::dot(omega, omega) < kLastSquare<Real>) return {r, false};
  }
  return by_jacobi4(a, previous);
}

}  // namespace rotation_detail

// The part that depends on the previous rotation alone, so that it can be computed before A is known.
template <class Real>
CUTPROOF_BOTH inline Start<Real> start_from(const Matrix3x3<Real>& previous) {
  const Quaternion<Real> q = rotation_detail::quaternion_of(previous);
  return {q, rotation_detail::matrix_of(q)};
}

// One rotation problem. Of several answers the nearest to `previous`; `previous` where A is zero or not finite. Never
// NaN if `previous` is a rotation. start: start_from(previous).
template <class Real>
CUTPROOF_BOTH inline Rotation<Real> rotate(Matrix3x3<Real> a, const Matrix3x3<Real>& previous,
                                           const Start<Real>& start) {
  if (!rotation_detail::scale_to_one(a)) return {previous, true};
  return rotation_detail::by_newton(a, previous, start);
}
template <class Real>
CUTPROOF_BOTH inline Rotation<Real> rotate(const Matrix3x3<Real>& a, const Matrix3x3<Real>& previous) {
  return rotate(a, previous, start_from(previous));
}

}  // namespace cutproof::gpu
