// The rotation of one cluster: argmax over rotations R of tr(Rᵀ A), by several methods that can be exchanged for one
// another (device_view.h kJacobi4 …). Kernels use single precision; every method is there in double too, so that the
// cost of precision can be measured. What each of them is worth: docs/results/accuracy.md, Rotations.
#pragma once
#include <limits>

#include "gpu/kernels/float3.h"
#include "gpu/state/device_view.h"

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

// Where kNewton begins: a rotation both ways.
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
CUTPROOF_BOTH inline float sine(float a) { return sinf(a); }
CUTPROOF_BOTH inline double sine(double a) { return sin(a); }
CUTPROOF_BOTH inline float cosine(float a) { return cosf(a); }
CUTPROOF_BOTH inline double cosine(double a) { return cos(a); }
CUTPROOF_BOTH inline float times_power_of_two(float a, int exponent) { return ldexpf(a, exponent); }
CUTPROOF_BOTH inline double times_power_of_two(double a, int exponent) { return ldexp(a, exponent); }
// Such that |a| / 2^exponent lies in [1/2, 1).
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
// A threshold at the level of rounding, given for single precision: in double as many units of it, to the `power` in
// which the rounding enters.
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

// Of any q but zero. Dividing by |q|² here, and not q by |q| before, saves a third of the error in RᵀR.
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

// Shepperd 1978: the largest of the four squares is divided by, so no digits are lost near half turns.
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

// A times a power of two, so exactly, such that the greatest entry lies in [1/2, 1): tiny and huge clusters neither
// underflow nor overflow. False if there is nothing to scale: A is zero or not finite.
template <class Real>
CUTPROOF_BOTH inline bool scale_to_one(Matrix3x3<Real>& a) {
  if constexpr (kSingle<Real>) {
    // Bits of sizes are in the order of the sizes, with what is not finite above all. The greatest of them by pairs:
    // one after the other, each would wait for the one before.
    unsigned size[9];
    for (int k = 0; k < 9; ++k) size[k] = bits_of(a.m[k]) & 0x7fffffffu;
    const auto greater = [](unsigned x, unsigned y) { return x > y ? x : y; };
    const unsigned greatest = greater(greater(greater(size[0], size[1]), greater(size[2], size[3])),
                                      greater(greater(greater(size[4], size[5]), greater(size[6], size[7])), size[8]));
    const unsigned exponent = greatest >> 23;
    // Where both the number and its reciprocal are normal, and nothing that matters underflows.
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
  // In two factors, because 2^148, which a denormal needs, is not a number of single precision, nor 2^1073 of double.
  const Real first = times_power_of_two(Real(1), -exponent / 2),
             second = times_power_of_two(Real(1), -exponent - -exponent / 2);
  for (int k = 0; k < 9; ++k) a.m[k] = a.m[k] * first * second;
  return true;
}

// The rotation by the angle whose tangent is returned makes the off-diagonal entry `pq` of a symmetric matrix vanish;
// the smaller of the two angles. No branch, and no overflow for entries of at most 1e18.
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

// Two eigenvalues nearer than this, relative to the greatest, are one. The rounding of the sweeps is below a third
// of it, and taking any vector of the joint eigenspace costs at most this much of the objective.
template <class Real>
inline constexpr Real kSameEigenvalue = rounding<Real>(0x1p-21);
// With one sweep fewer a few of 40,000 matrices of a hard case are wrong, in either precision.
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
    // Any unit vector of the eigenspace is an answer: the one nearest to the previous rotation.
    const Quaternion<Real> before = quaternion_of(previous);
    Quaternion<Real> projected = {0, 0, 0, 0};
    for (int k = 0; k < 4; ++k) {
      if (top - n[k][k] > kSameEigenvalue<Real> * top) continue;
      const Quaternion<Real> axis = {v[0][k], v[1][k], v[2][k], v[3][k]};
      projected = projected + dot(axis, before) * axis;
    }
    // At right angles to all answers it is equally far from each: any will do.
    if (dot(projected, projected) > rounding<Real>(1e-8)) q = projected;
  }
  result.r = matrix_of(q);
  return result;
}

// Müller, Bender, Chentanez, Macklin 2016, "A robust method to extract the rotational part of deformations": torques
// turn the previous rotation. Never leaves an exact half turn, and stalls as σ2 + σ3 -> 0.
template <int MostIterations, class Real>
CUTPROOF_BOTH inline Rotation<Real> by_mueller2016(const Matrix3x3<Real>& a, const Matrix3x3<Real>& previous) {
  Quaternion<Real> q = quaternion_of(previous);
  for (int iteration = 0; iteration < MostIterations; ++iteration) {
    const Matrix3x3<Real> r = matrix_of(q);
    Vector3<Real> torque;
    Real value = 0;
    for (int k = 0; k < 3; ++k) {
      torque = torque + cross(column(r, k), column(a, k));
      value += gpu::dot(column(r, k), column(a, k));
    }
    const Vector3<Real> omega = (1 / (absolute(value) + Real(1e-9))) * torque;
    const Real angle = norm(omega);
    if (angle < rounding<Real>(2e-7)) break;  // the rounding of the torque
    const Real s = sine(Real(0.5) * angle) / angle;
    q = normalized(Quaternion<Real>{cosine(Real(0.5) * angle), s * omega.x, s * omega.y, s * omega.z} * q);
  }
  return {matrix_of(q), false};
}

// The objective at the rotation R, turned on by a small ω in the rotated frame: with B = Rᵀ A it is
// tr B + g·ω - ½ ωᵀ H ω + …, g the axial vector of B and H = tr(B) I - sym(B).
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

// q turned on by ω in its own frame, through Cayley's map; not of unit length.
template <class Real>
CUTPROOF_BOTH inline Quaternion<Real> turned(Quaternion<Real> q, Vector3<Real> omega) {
  return q * Quaternion<Real>{1, Real(0.5) * omega.x, Real(0.5) * omega.y, Real(0.5) * omega.z};
}

// Kugelstadt, Koschier, Bender 2018, "Fast corotated FEM using operator splitting", §4: Newton's method from the
// previous rotation, up the gradient where the objective is not concave.
template <class Real>
CUTPROOF_BOTH inline Rotation<Real> by_apd(const Matrix3x3<Real>& a, const Matrix3x3<Real>& previous) {
  Quaternion<Real> q = quaternion_of(previous);
  for (int iteration = 0; iteration < 20; ++iteration) {
    const Expansion<Real> e = expand(a, matrix_of(q));
    Vector3<Real> omega = e.scaled_step();
    // Entries of A are below 1, so that 0.25 of the gradient is a short step.
    const bool newton = absolute(e.determinant) > rounding<Real>(1e-9) && gpu::dot(omega, e.g) * e.determinant > 0;
    omega = (newton ? 1 / e.determinant : 0) * omega + (newton ? 0 : Real(0.25)) * e.g;
    q = normalized(turned(q, omega));
    if (gpu::dot(omega, omega) < (newton ? rounding<Real>(1e-7) : rounding<Real>(1e-14, 2)))
      break;  // Newton's next step would be below rounding
  }
  return {matrix_of(q), false};
}

// Newton's method from the previous rotation where it can be shown to have found the best one, else kJacobi4. At a
// stationary point B is symmetric with eigenvalues b1, b2, b3, and H has the eigenvalues bi + bj: that they are
// positive is what distinguishes the greatest maximum (N's other eigenvalues are lower by 2 (bi + bj)). So a step of
// less than 1e-3 from a point where H is safely positive ends there: what is left of the objective is below
// ½ |ω|⁴ / λ, with λ >= 1e-5 the least eigenvalue that the bound on the determinant lets through: 5e-8. In double the
// step is 5e-6, which leaves 4e-17.
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
    r = matrix_of(q);  // of q of any length; should long steps leave none that is a number, nothing below is true
    if (gpu::dot(omega, omega) < kLastSquare<Real>) return {r, false};
  }
  return by_jacobi4(a, previous);
}

// Rotates columns p and q of B and V so that B's become orthogonal (Hestenes 1958).
template <int P, int Q, class Real>
CUTPROOF_BOTH inline void orthogonalize(Vector3<Real> (&b)[3], Vector3<Real> (&v)[3]) {
  const Real t = jacobi_tangent(gpu::dot(b[P], b[P]), gpu::dot(b[Q], b[Q]), gpu::dot(b[P], b[Q]));
  const Real c = 1 / root(1 + t * t), s = t * c;
  const Vector3<Real> bp = b[P], bq = b[Q], vp = v[P], vq = v[Q];
  b[P] = c * bp - s * bq;
  b[Q] = s * bp + c * bq;
  v[P] = c * vp - s * vq;
  v[Q] = s * vp + c * vq;
}

// Puts the longer of columns p and q first. One changes its sign, so that V stays a rotation.
template <int P, int Q, class Real>
CUTPROOF_BOTH inline void order(Vector3<Real> (&b)[3], Vector3<Real> (&v)[3]) {
  const bool swap = gpu::dot(b[P], b[P]) < gpu::dot(b[Q], b[Q]);
  const Vector3<Real> bp = b[P], bq = b[Q], vp = v[P], vq = v[Q];
  b[P] = swap ? bq : bp;
  v[P] = swap ? vq : vp;
  b[Q] = swap ? -1 * bp : bq;
  v[Q] = swap ? -1 * vp : vq;
}

// Singular values smaller than this, relative to the greatest, are rounding: ignoring two of them costs at most four
// times this much of the objective.
template <class Real>
inline constexpr Real kSameDirection = rounding<Real>(0x1p-23);

// One-sided Jacobi: A V = U Σ. Only the first two directions of each side are used and the third is their product,
// which is what a reflection needs: its smallest singular value is the one given up.
template <class Real>
CUTPROOF_BOTH inline Rotation<Real> by_svd(const Matrix3x3<Real>& a, const Matrix3x3<Real>& previous) {
  Vector3<Real> b[3] = {column(a, 0), column(a, 1), column(a, 2)};
  Vector3<Real> v[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (int sweep = 0; sweep < 5; ++sweep) {
    orthogonalize<0, 1>(b, v);
    orthogonalize<0, 2>(b, v);
    orthogonalize<1, 2>(b, v);
  }
  order<0, 1>(b, v);
  order<0, 2>(b, v);
  order<1, 2>(b, v);
  const Real sigma = norm(b[0]);
  const Vector3<Real> u0 = (1 / sigma) * b[0];
  Vector3<Real> u1 = b[1] - gpu::dot(u0, b[1]) * u0;
  Rotation<Real> result;
  result.degenerate = norm(u1) <= kSameDirection<Real> * sigma;
  if (result.degenerate) {
    // Rank one fixes R v0 = u0 only: the previous rotation, followed by the shortest turn from P v0 to u0.
    const Vector3<Real> from = previous * v[0], side = previous * v[1];
    const Vector3<Real> axis = cross(from, u0);
    const Real cosine = 1 + gpu::dot(from, u0);
    u1 = side;
    if (cosine > Real(1e-6)) u1 = side + cross(axis, side) + (1 / cosine) * cross(axis, cross(axis, side));
    u1 = u1 - gpu::dot(u0, u1) * u0;
    if (norm(u1) < Real(0.1)) u1 = cross(u0, previous * cross(v[0], v[1]));  // half a turn about `side`'s normal
  } else if (gpu::dot(cross(u0, u1), b[2]) * gpu::dot(v[2], cross(v[0], v[1])) < 0) {
    // A reflection: not unique if the two smallest singular values are equal. This method does not look for the
    // answer nearest to the previous one.
    result.degenerate = norm(b[1]) - norm(b[2]) <= kSameDirection<Real> * sigma;
  }
  u1 = (1 / norm(u1)) * u1;
  const Vector3<Real> v0 = (1 / norm(v[0])) * v[0];
  Vector3<Real> v1 = v[1] - gpu::dot(v0, v[1]) * v0;
  v1 = (1 / norm(v1)) * v1;
  const Vector3<Real> u2 = cross(u0, u1), v2 = cross(v0, v1);
  for (int row = 0; row < 3; ++row) {
    for (int k = 0; k < 3; ++k) result.r(row, k) = u0[row] * v0[k] + u1[row] * v1[k] + u2[row] * v2[k];
  }
  return result;
}

// Shuster & Oh 1981 (QUEST) on any A: the greatest root λ of det(N - λ I) by Newton's method from above, then a
// column of the adjugate of N - λ I. Both lose half of their digits where the root is nearly double.
template <class Real>
CUTPROOF_BOTH inline Rotation<Real> by_quest(const Matrix3x3<Real>& a, const Matrix3x3<Real>& previous) {
  Real n[4][4];
  davenport(a, n);
  Real squares = 0;
  for (int k = 0; k < 9; ++k) squares += a.m[k] * a.m[k];
  const Real determinant = gpu::dot(column(a, 0), cross(column(a, 1), column(a, 2)));
  const auto minors = [](const Real(&m)[4][4], Real(&lower)[6], Real(&upper)[6]) {
    upper[0] = m[0][0] * m[1][1] - m[1][0] * m[0][1];
    upper[1] = m[0][0] * m[1][2] - m[1][0] * m[0][2];
    upper[2] = m[0][0] * m[1][3] - m[1][0] * m[0][3];
    upper[3] = m[0][1] * m[1][2] - m[1][1] * m[0][2];
    upper[4] = m[0][1] * m[1][3] - m[1][1] * m[0][3];
    upper[5] = m[0][2] * m[1][3] - m[1][2] * m[0][3];
    lower[0] = m[2][0] * m[3][1] - m[3][0] * m[2][1];
    lower[1] = m[2][0] * m[3][2] - m[3][0] * m[2][2];
    lower[2] = m[2][0] * m[3][3] - m[3][0] * m[2][3];
    lower[3] = m[2][1] * m[3][2] - m[3][1] * m[2][2];
    lower[4] = m[2][1] * m[3][3] - m[3][1] * m[2][3];
    lower[5] = m[2][2] * m[3][3] - m[3][2] * m[2][3];
  };
  Real c[6], s[6];
  minors(n, c, s);
  const Real constant = s[0] * c[5] - s[1] * c[4] + s[2] * c[3] + s[3] * c[2] - s[4] * c[1] + s[5] * c[0];
  Real top = root(3 * squares);  // λ = σ1 + σ2 ± σ3 is never above it
  for (int iteration = 0; iteration < 30; ++iteration) {
    const Real value = ((top * top - 2 * squares) * top - 8 * determinant) * top + constant;
    const Real slope = (4 * top * top - 4 * squares) * top - 8 * determinant;
    if (!(slope > 0)) break;
    const Real step = value / slope;
    top -= step;
    if (step <= rounding<Real>(1e-7) * top) break;
  }
  for (int k = 0; k < 4; ++k) n[k][k] -= top;
  minors(n, c, s);
  // Columns of the adjugate; of a symmetric matrix of rank three they are multiples of the eigenvector.
  const Quaternion<Real> columns[4] = {
      {n[1][1] * c[5] - n[1][2] * c[4] + n[1][3] * c[3], -n[1][0] * c[5] + n[1][2] * c[2] - n[1][3] * c[1],
       n[1][0] * c[4] - n[1][1] * c[2] + n[1][3] * c[0], -n[1][0] * c[3] + n[1][1] * c[1] - n[1][2] * c[0]},
      {-n[0][1] * c[5] + n[0][2] * c[4] - n[0][3] * c[3], n[0][0] * c[5] - n[0][2] * c[2] + n[0][3] * c[1],
       -n[0][0] * c[4] + n[0][1] * c[2] - n[0][3] * c[0], n[0][0] * c[3] - n[0][1] * c[1] + n[0][2] * c[0]},
      {n[3][1] * s[5] - n[3][2] * s[4] + n[3][3] * s[3], -n[3][0] * s[5] + n[3][2] * s[2] - n[3][3] * s[1],
       n[3][0] * s[4] - n[3][1] * s[2] + n[3][3] * s[0], -n[3][0] * s[3] + n[3][1] * s[1] - n[3][2] * s[0]},
      {-n[2][1] * s[5] + n[2][2] * s[4] - n[2][3] * s[3], n[2][0] * s[5] - n[2][2] * s[2] + n[2][3] * s[1],
       -n[2][0] * s[4] + n[2][1] * s[2] - n[2][3] * s[0], n[2][0] * s[3] - n[2][1] * s[1] + n[2][2] * s[0]}};
  Quaternion<Real> q = columns[0];
  for (int k = 1; k < 4; ++k) q = dot(columns[k], columns[k]) > dot(q, q) ? columns[k] : q;
  const Real size = dot(q, q);
  if (!(size > rounding<Real>(1e-30, 2))) return {previous, true};
  return {matrix_of(normalized(q)), false};
}

}  // namespace rotation_detail

// What follows from the previous rotation alone, so that it may be computed before A is known.
template <int Method, class Real>
CUTPROOF_BOTH inline Start<Real> start_from(const Matrix3x3<Real>& previous) {
  Start<Real> start = {};
  if constexpr (Method == kNewton) {
    start.q = rotation_detail::quaternion_of(previous);
    start.r = rotation_detail::matrix_of(start.q);
  }
  return start;
}

// One rotation problem. Where the answer is not unique, the one nearest to `previous` (kJacobi4, kNewton; kSvd for rank
// one); where A is zero or not finite, `previous`. Never NaN if `previous` is a rotation. kMueller2016, kApd and
// kNewton start from `previous`, the others do not need it; kMueller2016, kApd and kQuest do not know when an answer is
// not unique. start: start_from<Method>(previous).
template <int Method, class Real>
CUTPROOF_BOTH inline Rotation<Real> rotate(Matrix3x3<Real> a, const Matrix3x3<Real>& previous,
                                           const Start<Real>& start) {
  if (!rotation_detail::scale_to_one(a)) return {previous, true};
  if constexpr (Method == kJacobi4) return rotation_detail::by_jacobi4(a, previous);
  if constexpr (Method == kMueller2016) return rotation_detail::by_mueller2016<20>(a, previous);
  if constexpr (Method == kApd) return rotation_detail::by_apd(a, previous);
  if constexpr (Method == kSvd) return rotation_detail::by_svd(a, previous);
  if constexpr (Method == kQuest) return rotation_detail::by_quest(a, previous);
  if constexpr (Method == kNewton) return rotation_detail::by_newton(a, previous, start);
}
template <int Method, class Real>
CUTPROOF_BOTH inline Rotation<Real> rotate(const Matrix3x3<Real>& a, const Matrix3x3<Real>& previous) {
  return rotate<Method>(a, previous, start_from<Method>(previous));
}

}  // namespace cutproof::gpu
