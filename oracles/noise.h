// Random rounding errors, the same on every machine. Internal to oracles/.
#pragma once
#include <bit>
#include <cmath>
#include <cstdint>

#include "model/vec.h"

namespace cutproof::oracles {

// Uniform in [-1, 1] (Vigna's splitmix64).
class Noise {
 public:
  // `alike`: numbers that agree to this share of themselves draw the same error; 0: each draws its own.
  explicit Noise(uint64_t seed, double alike = 0)
      : alike_(alike), seed_(seed * 0x9e3779b97f4a7c15u), state_(seed_), of_equals_(seed_) {}
  virtual ~Noise() = default;
  virtual double operator()() { return drawn(state_); }
  // Draws from here on are those of this key, whatever was drawn before.
  void name(uint64_t what, uint64_t index, uint64_t time) {
    const auto of = [&](uint64_t k) { return seed_ ^ (what << 60 ^ time << 32 ^ k) * 0xd1342543de82ef95u; };
    state_ = of(index);
    of_equals_ = of(~uint64_t{0} >> 32);
  }
  // The same for numbers that round alike; `index` where each rounds for itself.
  uint64_t key(double number, uint64_t index) const {
    if (alike_ == 0 || number == 0) return index;
    int exponent = 0;
    const double digits = std::floor(std::frexp(number, &exponent) / alike_);
    return (std::bit_cast<uint64_t>(digits) ^ static_cast<uint64_t>(exponent) << 1) * 0xff51afd7ed558ccdu >> 32;
  }
  Vec3 vector() {
    const double a = (*this)(), b = (*this)(), c = (*this)();
    return {a, b, c};
  }
  // An error for each component, uniform, of amplitude |size| + more.
  Vec3 off(Vec3 size, double more) {
    Vec3 r = vector();
    for (int k = 0; alike_ > 0 && k < 3; ++k) {
      if (size[k] == 0) continue;
      uint64_t state = of_equals_ ^ key(size[k], 0) << 2 ^ static_cast<uint64_t>(k);
      r[k] = drawn(state);
    }
    of_equals_ = of_equals_ * 0xd1342543de82ef95u + 1;  // the next draw is another rounding
    return {r.x * (std::abs(size.x) + more), r.y * (std::abs(size.y) + more), r.z * (std::abs(size.z) + more)};
  }

 private:
  static double drawn(uint64_t& state) {
    uint64_t z = (state += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    z ^= z >> 31;
    return static_cast<double>(z >> 11) * 0x1p-52 - 1;
  }

  double alike_;
  uint64_t seed_, state_, of_equals_;
};

// Draws 1 or -1. Two of one seed and opposite signs draw opposite numbers: where few are drawn, each is tried both
// ways.
class OppositeNoise : public Noise {
 public:
  OppositeNoise(uint64_t seed, int sign) : Noise(~seed), sign_(sign) {}
  double operator()() override { return Noise::operator()() < 0 ? -sign_ : sign_; }

 private:
  int sign_;
};

}  // namespace cutproof::oracles
