// The kernel that `cutproof bench rotations` times: it reads A and the previous R, rotates, writes R. On the host and
// on the device, in both precisions, for the method of the step and for others beside it.
#pragma once
#include <cstdint>
#include <type_traits>

#include "gpu/kernels/rotation.cuh"
#include "gpu/launch/launcher.h"

namespace cutproof::benchmarks {

// Entry k of matrix i at [k · count + i], so that neighbouring threads read neighbouring numbers.
template <class Real>
struct RotationBatch {
  const Real* a = nullptr;
  const Real* previous = nullptr;
  Real* r = nullptr;
  unsigned char* flagged = nullptr;
  std::int64_t count = 0;
};
// What is read and written for each matrix.
template <class Real>
inline constexpr std::int64_t kRotationBytes = 27 * sizeof(Real) + 1;

// A method: a type with a name and a function `rotate` for both precisions.
template <int Number>
struct OfKernels {
  template <class Real>
  CUTPROOF_BOTH static gpu::Rotation<Real> rotate(const gpu::Matrix3x3<Real>& a, const gpu::Matrix3x3<Real>& previous) {
    return gpu::rotate<Number>(a, previous);
  }
};
struct Jacobi4 : OfKernels<gpu::kJacobi4> {
  static constexpr const char* kName = "jacobi4";
};
struct Newton : OfKernels<gpu::kNewton> {
  static constexpr const char* kName = "newton";
};
struct Svd : OfKernels<gpu::kSvd> {
  static constexpr const char* kName = "svd";
};
struct Quest : OfKernels<gpu::kQuest> {
  static constexpr const char* kName = "quest";
};
struct Apd : OfKernels<gpu::kApd> {
  static constexpr const char* kName = "apd";
};
struct Mueller : OfKernels<gpu::kMueller2016> {
  static constexpr const char* kName = "mueller";
};
// What the step does.
template <class Method, class Real>
inline constexpr bool kIsDefault = std::is_same_v<Method, Newton> && sizeof(Real) == sizeof(float);

// Müller 2016 without the previous rotation, with as many iterations as it may want.
struct MuellerCold {
  static constexpr const char* kName = "mueller_cold";
  template <class Real>
  CUTPROOF_BOTH static gpu::Rotation<Real> rotate(gpu::Matrix3x3<Real> a, const gpu::Matrix3x3<Real>& previous) {
    if (!gpu::rotation_detail::scale_to_one(a)) return {previous, true};
    return gpu::rotation_detail::by_mueller2016<100>(a, gpu::Matrix3x3<Real>{});
  }
};

// McAdams, Selle, Tamstorf, Teran, Sifakis 2011, "Computing the singular value decomposition of 3×3 matrices with
// minimal branching and elementary floating point operations": Jacobi on AᵀA with approximate Givens rotations, four
// sweeps, then a QR decomposition of A V; U and V as quaternions. Scaled before, which the paper does not do.
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

  // Half the turn that takes axis P towards axis Q, as a quaternion (ch, sh about the third axis).
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

  // Turns rows P and Q of B such that B(Q, P) vanishes; U becomes U G (§4).
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

template <class Method, class Real>
CUTPROOF_BOTH inline void rotate_one(const RotationBatch<Real>& batch, std::int64_t i) {
  gpu::Matrix3x3<Real> a, previous;
  for (int k = 0; k < 9; ++k) {
    a.m[k] = batch.a[k * batch.count + i];
    previous.m[k] = batch.previous[k * batch.count + i];
  }
  const gpu::Rotation<Real> best = Method::rotate(a, previous);
  for (int k = 0; k < 9; ++k) batch.r[k * batch.count + i] = best.r.m[k];
  batch.flagged[i] = best.degenerate;
}

// CUTPROOF_KERNEL (launcher.h) by hand, because that cannot carry template arguments.
template <class Method, class Real>
struct rotate_matrices_kernel_object {
  static constexpr const char* kName = "rotate_matrices_kernel";
  static constexpr int kMaxThreads = 256;
  template <class Block>
  CUTPROOF_DEVICE void operator()(Block& block, const RotationBatch<Real>& batch) const {
    for (std::int64_t i = block.first(); i < batch.count; i += block.stride()) rotate_one<Method>(batch, i);
  }
};

// Calls visit(method) for each method that runs on a device.
template <class Visit>
void each_kernel_method(Visit visit) {
  visit(Jacobi4{});
  visit(Newton{});
  visit(Svd{});
  visit(Quest{});
  visit(Apd{});
  visit(Mueller{});
  visit(MuellerCold{});
  visit(McAdams{});
}

}  // namespace cutproof::benchmarks
