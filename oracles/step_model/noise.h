// Roundings at random, the same everywhere. Internal to oracles/.
#pragma once
#include <cmath>
#include <cstdint>

#include "model/vec.h"

namespace cutproof::oracles {

// Uniform in [-1, 1] (Vigna's splitmix64).
class Noise {
 public:
  explicit Noise(uint64_t seed) : seed_(seed * 0x9e3779b97f4a7c15u), state_(seed_) {}
  virtual ~Noise() = default;
  virtual double operator()() {
    uint64_t z = (state_ += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    z ^= z >> 31;
    return static_cast<double>(z >> 11) * 0x1p-52 - 1;
  }
  // Draws from here on are those of this name, whatever was drawn before.
  void name(uint64_t what, uint64_t index, uint64_t time) {
    state_ = seed_ ^ (what << 60 ^ time << 32 ^ index) * 0xd1342543de82ef95u;
  }
  Vec3 vector() {
    const double a = (*this)(), b = (*this)(), c = (*this)();
    return {a, b, c};
  }
  // Each component by at most so much of its own size, and by at most `more`.
  Vec3 off(Vec3 size, double more) {
    const Vec3 r = vector();
    return {r.x * (std::abs(size.x) + more), r.y * (std::abs(size.y) + more), r.z * (std::abs(size.z) + more)};
  }

 private:
  uint64_t seed_, state_;
};

// The greatest there is, one way or the other, and with the opposite sign the other way: few numbers are drawn of it,
// and each has to be tried both ways.
class OppositeNoise : public Noise {
 public:
  OppositeNoise(uint64_t seed, int sign) : Noise(~seed), sign_(sign) {}
  double operator()() override { return Noise::operator()() < 0 ? -sign_ : sign_; }

 private:
  int sign_;
};

}  // namespace cutproof::oracles
