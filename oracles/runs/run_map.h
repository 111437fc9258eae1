// What turns one run of a simulator into another that must correspond: other units, a mirror image, other numbers of
// particles (docs/reference/relate.md). Points and numbers are mapped, and so are the arrays of an input.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "model/arrays.h"
#include "model/vec.h"

namespace cutproof::oracles {

// A dimension: powers of length, time and mass.
struct Dimension {
  int length = 0, time = 0, mass = 0;
};

// How the numbers of an array follow a map.
enum class Follows : uint8_t {
  scalar,
  direction,  // turned
  velocity,   // turned, and boosted
  axial,      // turned, and reversed by a mirror: angular momentum
  point,      // turned, moved and boosted
  lattice,    // integer coordinates: turned
  nothing
};

class RunMap {
 public:
  // same, reset, checkpoint, split, refine, permute[:SEED], units:L,T,M as factors, mirror:x, rotate:90z, shift:X,Y,Z
  // [m], boost:X,Y,Z [m/s]. Throws InputError that names --map.
  static RunMap parse(const std::string& word);

  const std::string& name() const { return name_; }  // the word up to its colon
  uint64_t seed() const { return seed_; }
  double scale(Dimension of) const;  // by which a number of this dimension is multiplied
  // An entry at the time `time` of the first run.
  Vec3 mapped(Vec3 entry, Follows how, Dimension of, double time = 0) const;
  Vec3 point(Vec3 x, double time) const { return mapped(x, Follows::point, {1, 0, 0}, time); }
  Vec3 velocity(Vec3 v) const { return mapped(v, Follows::velocity, {1, -1, 0}); }
  bool reverses() const { return signs_[0] * signs_[1] * signs_[2] * parity_ < 0; }  // right hands become left ones
  bool needs_time() const { return boost_ != Vec3{}; }
  // Whether every number is mapped without rounding.
  bool is_exact() const { return is_exact_; }

 private:
  std::string name_ = "same";
  std::array<int, 3> axes_ = {0, 1, 2}, signs_ = {1, 1, 1};
  int parity_ = 1;  // of the permutation of axes
  double length_ = 1, time_ = 1, mass_ = 1;
  Vec3 shift_, boost_;
  uint64_t seed_ = 1;
  bool is_exact_ = true;
};

// Of an array that docs/reference/run.md names; of any other `known` is false.
struct ArrayRule {
  Follows how = Follows::nothing;
  Dimension of;
  bool known = false;
  bool by_particle = false;   // its entries, behind those by frame, are particles'
  bool of_particles = false;  // its values are numbers of particles
};
ArrayRule rule_of(std::string_view array);

// Arrays of an input, mapped; types are kept. `more`: rules of arrays that rule_of does not know. Throws InputError
// that names `file` for an array without a rule, and where a map needs what is not there. A permutation adds the array
// `permutation`: of each particle, which one it was.
Arrays mapped_input(const RunMap& map, const Arrays& input, const std::vector<std::pair<std::string, ArrayRule>>& more,
                    const std::string& file);

}  // namespace cutproof::oracles
