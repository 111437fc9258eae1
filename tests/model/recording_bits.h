// Setups and snapshots as strings of all their bits: == on these tells NaN from NaN and 0 from -0.
#pragma once
#include <string>
#include <type_traits>
#include <vector>

#include "model/io/recording.h"

namespace cutproof::io {

class Bits {
 public:
  template <class T>
  Bits& add(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
    return *this;
  }
  template <class T>
  Bits& add(const std::vector<T>& values) {
    add(values.size());
    if (!values.empty()) bytes_.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
    return *this;
  }
  Bits& add(const std::string& text) {
    add(text.size());
    bytes_ += text;
    return *this;
  }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

inline std::string bits_of(const Snapshot& snapshot) {
  const State& s = snapshot.state;
  Bits bits;
  bits.add(snapshot.stage).add(s.frame).add(s.x).add(s.v).add(s.alive).add(s.removed).add(s.debris);
  bits.add(s.clusters.offsets).add(s.clusters.members).add(s.clusters.number).add(s.clusters.rotation);
  bits.add(s.clusters.rest_center).add(s.clusters.mass).add(s.clusters.degenerate);
  bits.add(s.tau).add(s.cap).add(s.edge_covered).add(s.impulse);
  bits.add(s.skin.owner).add(s.skin.direction).add(s.skin.position).add(s.skin.triangles);
  return bits.bytes();
}

inline std::string bits_of(const Setup& s) {
  Bits bits;
  bits.add(s.body.name).add(s.body.grid.nodes).add(s.body.grid.spacing).add(s.body.node).add(s.body.particle_at);
  bits.add(s.body.mass).add(s.body.origin).add(s.body.orientation);
  bits.add(s.step.solver).add(s.step.substeps).add(s.step.iterations).add(s.step.stiffness).add(s.step.relaxation);
  bits.add(s.step.acceleration);
  bits.add(s.step.damping).add(s.step.gravity);
  bits.add(s.detect.criterion).add(s.detect.epsilon).add(s.detect.strain).add(s.detect.without_blade);
  bits.add(s.split.debris).add(s.merge.rule).add(s.expand.rule).add(s.expand.depth);
  bits.add(s.skin.wanted).add(s.skin.alpha);
  for (const Wall& wall : s.walls) bits.add(wall.axis).add(wall.side).add(wall.offset).add(wall.friction);
  for (const Grip& grip : s.grips) bits.add(grip.particles).add(grip.active).add(grip.displacement);
  bits.add(s.has_blade).add(s.blade.length).add(s.blade.depth).add(s.blade.thickness).add(s.blade.friction);
  bits.add(s.substep_length).add(s.stroke_end);
  for (const BladeMove& move : s.blade_moves) bits.add(move.from).add(move.to).add(move.down).add(move.stroke);
  return bits.bytes();
}

}  // namespace cutproof::io
