// Methods for the rotation of a cluster that `cutproof bench rotations` measures: the step's, and others, most of which
// fail on hard cases (docs/results/accuracy.md, Rotations). A method is a type with a name and a function `rotate` for
// both precisions. It returns argmax over rotations R of tr(Rᵀ A), or `previous` where A is zero or not finite.
#pragma once
#include <type_traits>

#include "gpu/kernels/rotation.cuh"

namespace cutproof::benchmarks {

namespace rotation_detail {

using namespace gpu::rotation_detail;
using gpu::cross;
using gpu::Matrix3x3;
using gpu::norm;
using gpu::Quaternion;
using gpu::root;
using gpu::Rotation;
using gpu::Vector3;

CUTPROOF_BOTH inline float sine(float a) { return sinf(a); }
CUTPROOF_BOTH inline double sine(double a) { return sin(a); }
CUTPROOF_BOTH inline float cosine(float a) { return cosf(a); }
CUTPROOF_BOTH inline double cosine(double a) { return cos(a); }

// Müller, Bender, Chentanez, Macklin 2016, "A robust method to extract the rotational part of deformations": torques
// rotate the previous rotation. Never leaves an exact half turn, and stalls as σ2 + σ3 -> 0.
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

// Kugelstadt, Koschier, Bender 2018, "Fast corotated FEM using operator splitting", §4: Newton's method from the
// previous rotation, up the gradient where the objective is not concave.
template <class Real>
CUTPROOF_BOTH inline Rotation<Real> by_apd(const Matrix3x3<Real>& a, const Matrix3x3<Real>& previous) {
  Quaternion<Real> q = quaternion_of(previous);
  for (int iteration = 0; iteration < 20; ++iteration) {
    const Expansion<Real> e = expand(a, matrix_of(q));
    Vector3<Real> omega = e.scaled_step();
    // Entries of A are below 1, so 0.25 of the gradient is a short step.
    const bool newton = absolute(e.determinant) > rounding<Real>(1e-9) && gpu::dot(omega, e.g) * e.determinant > 0;
    omega = (newton ? 1 / e.determinant : 0) * omega + (newton ? 0 : Real(0.25)) * e.g;
    q = normalized(turned(q, omega));
    if (gpu::dot(omega, omega) < (newton ? rounding<Real>(1e-7) : rounding<Real>(1e-14, 2)))
      break;  // Newton's next step would be below rounding
  }
  return {matrix_of(q), false};
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

// Smaller singular values, relative to the greatest, are rounding: ignoring two of them costs at most four times this
// much of the objective.
template <class Real>
inline constexpr Real kSameDirection = rounding<Real>(0x1p-23);

// One-sided Jacobi: A V = U Σ. The third direction of each side is the product of the first two. A reflection needs
// this: its smallest singular value is given up.
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
    // A reflection is not unique if the two smallest singular values are equal. This method does not look for the
    // answer nearest to the previous rotation.
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
  Real top = root(3 * squares);  // upper bound of λ = σ1 + σ2 ± σ3
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
  // Columns of the adjugate; with rank three they are multiples of the symmetric matrix's eigenvector.
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

struct Newton {
  static constexpr const char* kName = "newton";
  template <class Real>
  CUTPROOF_BOTH static gpu::Rotation<Real> rotate(const gpu::Matrix3x3<Real>& a, const gpu::Matrix3x3<Real>& previous) {
    return gpu::rotate(a, previous);
  }
};
// The step's method.
template <class Method, class Real>
inline constexpr bool kIsDefault = std::is_same_v<Method, Newton> && sizeof(Real) == sizeof(float);

// The fallback of the step's method.
struct Jacobi4 {
  static constexpr const char* kName = "jacobi4";
  template <class Real>
  CUTPROOF_BOTH static gpu::Rotation<Real> rotate(gpu::Matrix3x3<Real> a, const gpu::Matrix3x3<Real>& previous) {
    if (!gpu::rotation_detail::scale_to_one(a)) return {previous, true};
    return gpu::rotation_detail::by_jacobi4(a, previous);
  }
};

struct Svd {
  static constexpr const char* kName = "svd";
  template <class Real>
  CUTPROOF_BOTH static gpu::Rotation<Real> rotate(gpu::Matrix3x3<Real> a, const gpu::Matrix3x3<Real>& previous) {
    if (!gpu::rotation_detail::scale_to_one(a)) return {previous, true};
    return rotation_detail::by_svd(a, previous);
  }
};

struct Quest {
  static constexpr const char* kName = "quest";
  template <class Real>
  CUTPROOF_BOTH static gpu::Rotation<Real> rotate(gpu::Matrix3x3<Real> a, const gpu::Matrix3x3<Real>& previous) {
    if (!gpu::rotation_detail::scale_to_one(a)) return {previous, true};
    return rotation_detail::by_quest(a, previous);
  }
};

struct Apd {
  static constexpr const char* kName = "apd";
  template <class Real>
  CUTPROOF_BOTH static gpu::Rotation<Real> rotate(gpu::Matrix3x3<Real> a, const gpu::Matrix3x3<Real>& previous) {
    if (!gpu::rotation_detail::scale_to_one(a)) return {previous, true};
    return rotation_detail::by_apd(a, previous);
  }
};

struct Mueller {
  static constexpr const char* kName = "mueller";
  template <class Real>
  CUTPROOF_BOTH static gpu::Rotation<Real> rotate(gpu::Matrix3x3<Real> a, const gpu::Matrix3x3<Real>& previous) {
    if (!gpu::rotation_detail::scale_to_one(a)) return {previous, true};
    return rotation_detail::by_mueller2016<20>(a, previous);
  }
};

// Müller 2016 without the previous rotation, with enough iterations.
struct MuellerCold {
  static constexpr const char* kName = "mueller_cold";
  template <class Real>
  CUTPROOF_BOTH static gpu::Rotation<Real> rotate(gpu::Matrix3x3<Real> a, const gpu::Matrix3x3<Real>& previous) {
    if (!gpu::rotation_detail::scale_to_one(a)) return {previous, true};
    return rotation_detail::by_mueller2016<100>(a, gpu::Matrix3x3<Real>{});
  }
};

// McAdams, Selle, Tamstorf, Teran, Sifakis 2011, "Computing the singular value decomposition of 3×3 matrices with
// minimal branching and elementary floating point operations": Jacobi on AᵀA with approximate Givens rotations, four
// sweeps, then a QR decomposition of A V; U and V as quaternions. Unlike the paper, A is scaled first.
struct McAdams {
  static constexpr const char* kName = "mcadams";
  template <class Real>
  CUTPROOF_BOTH static gpu::Rotation<Real> rotate(gpu::Matrix3x3<Real> a, const gpu::Matrix3x3<Real>& previous) {
    if (!gpu::rotation_detail::scale_to_one(a)) return {previous, true};
    gpu::Matrix3x3<Real> s;
    for (int p = 0; p < 3; ++p) {
      for (int q = 0; q < 3; ++q) s(p, q) = gpu::dot(column(a, p), column(a, q));
    }
    gpu::Quaternion<Real> v = {1, 0, 0, 0};
    for (int sweep = 0; sweep < 4; ++sweep) {
      conjugate<0, 1>(s, v);
      conjugate<1, 2>(s, v);
      conjugate<2, 0>(s, v);
    }
    v = gpu::rotation_detail::normalized(v);
    const gpu::Matrix3x3<Real> turned = gpu::rotation_detail::matrix_of(v);
    gpu::Matrix3x3<Real> b;
    for (int row = 0; row < 3; ++row) {
      for (int k = 0; k < 3; ++k)
        b(row, k) = a(row, 0) * turned(0, k) + a(row, 1) * turned(1, k) + a(row, 2) * turned(2, k);
    }
    sort<0, 1>(b, v);
    sort<0, 2>(b, v);
    sort<1, 2>(b, v);
    gpu::Quaternion<Real> u = {1, 0, 0, 0};
    eliminate<0, 1>(b, u);
    eliminate<0, 2>(b, u);
    eliminate<1, 2>(b, u);
    const gpu::Quaternion<Real> v_back = {v.w, -v.x, -v.y, -v.z};
    using gpu::rotation_detail::operator*;
    return {gpu::rotation_detail::matrix_of(u * v_back), false};
  }

 private:
  template <class Real>
  CUTPROOF_BOTH static gpu::Vector3<Real> column(const gpu::Matrix3x3<Real>& m, int k) {
    return gpu::rotation_detail::column(m, k);
  }

  // Half the rotation from axis P towards axis Q, as a quaternion (ch, sh about the third axis).
  template <int P, int Q, class Real>
  CUTPROOF_BOTH static gpu::Quaternion<Real> half_turn(Real ch, Real sh) {
    constexpr int kSign = (Q - P + 3) % 3 == 1 ? 1 : -1;  // P × Q is the third axis or its opposite
    constexpr int kAxis = 3 - P - Q;
    return {ch, kAxis == 0 ? kSign * sh : 0, kAxis == 1 ? kSign * sh : 0, kAxis == 2 ? kSign * sh : 0};
  }

  // S becomes Gᵀ S G, V becomes V G, with G the approximate Givens rotation of §2.2.
  template <int P, int Q, class Real>
  CUTPROOF_BOTH static void conjugate(gpu::Matrix3x3<Real>& s, gpu::Quaternion<Real>& v) {
    using gpu::rotation_detail::operator*;
    constexpr int kOther = 3 - P - Q;
    constexpr double kGamma = 5.828427124746190;                                    // 3 + √8
    constexpr double kCosine = 0.923879532511286756, kSine = 0.382683432365089772;  // of π/8
    const Real near = 2 * (s(P, P) - s(Q, Q)), off = s(P, Q);
    const bool small = Real(kGamma) * off * off < near * near;
    const Real size = gpu::root(near * near + off * off);
    const Real ch = small ? near / size : Real(kCosine), sh = small ? off / size : Real(kSine);
    const Real c = ch * ch - sh * sh, n = 2 * ch * sh;
    const Real pp = s(P, P), qq = s(Q, Q), po = s(P, kOther), qo = s(Q, kOther);
    s(P, P) = c * (c * pp + n * off) + n * (c * off + n * qq);
    s(Q, Q) = -n * (c * off - n * pp) + c * (c * qq - n * off);
    s(P, Q) = s(Q, P) = c * (c * off - n * pp) + n * (c * qq - n * off);
    s(P, kOther) = s(kOther, P) = c * po + n * qo;
    s(Q, kOther) = s(kOther, Q) = c * qo - n * po;
    v = v * half_turn<P, Q>(ch, sh);
  }

  // Puts the longer of two columns first: a quarter turn, so V stays a rotation.
  template <int P, int Q, class Real>
  CUTPROOF_BOTH static void sort(gpu::Matrix3x3<Real>& b, gpu::Quaternion<Real>& v) {
    using gpu::rotation_detail::operator*;
    if (!(gpu::dot(column(b, P), column(b, P)) < gpu::dot(column(b, Q), column(b, Q)))) return;
    for (int row = 0; row < 3; ++row) {
      const Real p = b(row, P);
      b(row, P) = b(row, Q);
      b(row, Q) = -p;
    }
    constexpr double kHalf = 0.707106781186547524;
    v = v * half_turn<P, Q>(Real(kHalf), Real(kHalf));
  }

  // Rotates rows P and Q of B such that B(Q, P) vanishes; U becomes U G (§4).
  template <int P, int Q, class Real>
  CUTPROOF_BOTH static void eliminate(gpu::Matrix3x3<Real>& b, gpu::Quaternion<Real>& u) {
    using gpu::rotation_detail::operator*;
    constexpr Real kNothing = gpu::rotation_detail::rounding<Real>(1e-6);
    const Real pivot = b(P, P), other = b(Q, P);
    const Real size = gpu::root(pivot * pivot + other * other);
    Real sh = size > kNothing ? other : 0;
    Real ch = gpu::rotation_detail::absolute(pivot) + gpu::rotation_detail::greater_of(size, kNothing);
    if (pivot < 0) {
      const Real kept = sh;
      sh = ch;
      ch = kept;
    }
    const Real norm = gpu::root(ch * ch + sh * sh);
    ch = ch / norm;
    sh = sh / norm;
    const Real c = ch * ch - sh * sh, n = 2 * ch * sh;
    for (int k = 0; k < 3; ++k) {
      const Real p = b(P, k), q = b(Q, k);
      b(P, k) = c * p + n * q;
      b(Q, k) = c * q - n * p;
    }
    u = u * half_turn<P, Q>(ch, sh);
  }
};

}  // namespace cutproof::benchmarks
